//! Saved runs and recordings of earlier versions: read, or refused by the name of what they lack.

use crate::prints::{golden, program, taut, writes};
use std::fs;

/// Scenes whose states are kept: a cable alone, sheaves, contacts, winches and events.
const SCENES: [&str; 4] = ["hoist", "tackle", "floor", "elevator"];

#[test]
fn saved_runs_and_recordings_of_earlier_versions_are_read_or_refused_by_name() {
    let folder = golden().join("saved");
    for name in SCENES {
        let [state, tape] = ["json", "tape"].map(|ext| folder.join(format!("{name}.{ext}")));
        // Those of earlier versions stay: no later one can write them again.
        let missing = [("--save", &state), ("--record", &tape)].into_iter();
        let missing = missing.filter(|(_, path)| !path.exists());
        let missing = missing.map(|(option, path)| format!(" {option} {}", path.display()));
        let missing: String = missing.collect();
        let (state, tape) = (state.display(), tape.display());
        if writes() && !missing.is_empty() {
            fs::create_dir_all(&folder).expect("a folder");
            let run = format!("run {name} --time 0.2 --estimate off --quiet{missing}");
            assert_eq!(taut("saved", &run).1, 0, "{run}");
            continue;
        }
        for read in [
            format!("run --resume {state} --time 0.1 --quiet"),
            format!("replay {tape} --csv time,load_z --quiet"),
        ] {
            let output = program("saved", &read);
            let [text, error] =
                [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("UTF-8"));
            // A refusal prints one line with what the version lacks.
            let refused =
                output.status.code() == Some(2) && text.is_empty() && error.contains("version");
            let read_well = output.status.success() && !text.is_empty();
            assert!(read_well || refused, "{read}: {error}");
        }
    }
}
