use crate::*;
use std::collections::BTreeSet;

/// A quick run of the hoist with the banded solver.
const QUICK: &str = "track hoist-24-1e3/banded --quick --baseline base.json";

fn read(text: &str) -> Vec<Value> {
    serde_json::from_str(text).expect("a list")
}

#[test]
fn bad_input_is_named() {
    let at = folder("track_refused");
    let known = ["hoist/lu", "hoist-24-1e3/banded", "gantry/banded"];
    at.refused("track hoist/lu", &known);
    let absent = ["bench/track-baseline.json", "--baseline"];
    at.refused("track --quick", &absent);
    at.write("base.json", "{}");
    at.refused(QUICK, &["base.json", "no baseline", "--update"]);
    at.write("base.json", "[]");
    let both = format!("{QUICK} --json - --bencher -");
    at.refused(&both, &["--json", "--bencher"]);
}

#[test]
fn counts_that_are_compared_with_nothing_are_not_passed() {
    if !cfg!(feature = "banded") {
        return;
    }
    let at = folder("track_counts");
    at.write("base.json", "[]");
    let counted = format!("{QUICK} --instructions");
    if Command::new("valgrind").arg("--version").output().is_err() {
        return at.refused(&counted, &["valgrind", "--instructions"]);
    }
    let of = |arguments: &str| at.taut(arguments).status.code();
    assert_eq!(of(&counted), Some(3));
    assert_eq!(of(&format!("{counted} --update")), Some(0));
    let baseline = at.read("base.json");
    let other = baseline.replace("valgrind-", "valgrind-9");
    at.write("base.json", &other);
    assert_eq!(of(&counted), Some(0));
    at.write("base.json", other.replace("\"rustc ", "\"rustc 9"));
    assert_eq!(of(&counted), Some(3));
}

#[test]
fn figures_are_compared_with_a_baseline_that_an_update_writes() {
    if !cfg!(feature = "banded") {
        return;
    }
    let at = folder("track");
    let table = at.good(format!("{QUICK} --update"));
    assert!(table.contains("hoist-24-1e3/banded") && table.contains("new"));
    assert!(table.contains("instructions were not counted"), "{table}");
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    let file = || at.read("base.json");
    let names: BTreeSet<String> = read(&file())
        .iter()
        .map(|entry| {
            let holds = entry["value"].is_number() && entry["unit"].is_string();
            assert!(holds, "{entry}");
            entry["name"].as_str().expect("a name").to_owned()
        })
        .collect();
    for measure in "allocations forward-error load-error time-min time-median".split(' ') {
        let says = names.contains(&format!("hoist-24-1e3/banded/{measure}"));
        assert!(says, "{names:?}");
    }
    assert!(!names.contains("hoist-24-1e3/banded/instructions"));
    let again = at.json(format!("{QUICK} --json - --bencher bencher.json"));
    let again = again.as_array().expect("a list").iter();
    let again: BTreeSet<&str> = again.filter_map(|entry| entry["name"].as_str()).collect();
    assert_eq!(again, names.iter().map(String::as_str).collect());
    let bencher = at.read("bencher.json");
    let bencher: Value = serde_json::from_str(&bencher).expect("JSON");
    let latency = &bencher["hoist-24-1e3/banded"]["latency"];
    let found = latency["value"].as_f64();
    assert!(found >= latency["lower_value"].as_f64(), "{bencher}");
    assert!(latency["lower_value"].is_number(), "{bencher}");
    // A figure whose name has vanished fails; an update removes it.
    let renamed = file().replace(
        "hoist-24-1e3/banded/load-error",
        "hoist-23/banded/load-error",
    );
    at.write("base.json", renamed);
    let [stdout, stderr] = at.ends(1, QUICK);
    assert!(stdout.contains("no longer tracked"));
    let says = stderr.contains("1 of");
    assert!(says, "{}", stderr);
    at.good(format!("{QUICK} --update"));
    assert!(!file().contains("hoist-23/"));
}
