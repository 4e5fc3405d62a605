use crate::*;

/// JSON without times and without values derived from times.
fn untimed(value: &Value) -> Value {
    match value {
        Value::Array(list) => list.iter().map(untimed).collect(),
        Value::Object(fields) => {
            let is_time = |key: &str| {
                let timed = ["fastest_at", "ratio", "ratio_median", "samples", "trace"];
                key.contains("ns") && !["constraints", "options"].contains(&key)
                    || timed.contains(&key)
            };
            let kept = fields.iter().filter(|(key, _)| !is_time(key));
            kept.map(|(key, value)| (key.clone(), untimed(value)))
                .collect()
        }
        other => other.clone(),
    }
}

/// The data of the page, without when and how it was made.
fn page(at: &At, study: &str) -> Value {
    let mut report = at.parsed(&format!("target/taut/{study}.report.json"));
    for field in ["unix_time", "command"] {
        report.as_object_mut().expect("a report").remove(field);
    }
    report
}

/// Runs a study in three shards and merges them, the last first, with an option of the merge: what that prints.
fn merged(at: &At, study: &str, call: &str, option: &str) -> String {
    for shard in 1..=3 {
        let told = at.good(format!("{call} --shard {shard}/3"));
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(told.starts_with(&format!("shard {shard}/3: ")), "{told}");
    }
    let files = [3, 1, 2].map(|k| format!("target/taut/{study}.{k}-of-3.cases"));
    let files = files.join(" ");
    at.good(format!("merge {files} --json merged.json {option}"))
}

/// Studies, whether all of their numbers are the same in every run, and a call of each.
const SHARDED: &str = "\
stability | same | study stability --quick --time 0.5
linear | same | study linear --segments 3 --ratios 10,1e6 --backends dense
energy | same | study energy --quick
bench | timed | bench --quick --segments 4 --ratios 10,100 --iterations 1,50 --time 0.3
kernels | timed | study kernels --quick --segments 3,4 --backends dense
shocks | timed | study shocks --quick --ratios 100 --time 1
scenes | timed | bench --scene ring,net --segments 8 --ratios 10 --backends dense,cg:group --quick";

#[test]
fn three_shards_merged_are_one_run() {
    for row in SHARDED.lines() {
        let [study, kind, call] = [0, 1, 2].map(|k| row.split(" | ").nth(k).expect("three"));
        let at = folder(&format!("shards_{study}"));
        let csv = |name: &str| match kind {
            "same" => format!("--csv {name}.csv"),
            _ => String::new(),
        };
        let whole = at.good(format!("{call} --json whole.json {}", csv("whole")));
        let own = page(&at, study);
        let told = merged(&at, study, call, &csv("merged"));
        let [a, b] = ["whole.json", "merged.json"].map(|name| untimed(&at.parsed(name)));
        assert_eq!(a, b, "{study}");
        let merged = page(&at, study);
        for field in ["settings", "omissions", "machine", "version"] {
            assert_eq!(merged[field], own[field], "{study}: {field}");
        }
        if kind == "same" {
            assert_eq!((told, merged), (whole, own), "{study}");
            for ending in ["json", "csv"] {
                let [a, b] = ["whole", "merged"].map(|name| {
                    let path = at.join(format!("{name}.{ending}"));
                    fs::read_to_string(path).expect("written")
                });
                assert_eq!(a, b, "{study}");
            }
            let report = at.parsed(&format!("target/taut/{study}.report.json"));
            let command = report["command"].as_str().expect("a command");
            assert!(command.contains("--quick") || command.contains("--segments=3"));
        }
    }
}

/// A weight on a rope as a case, judged by its tension times `factor`.
fn weighed(factor: f64) -> String {
    format!(
        r#"
name = "weight"
title = "a weight on a rope"
source = "statics"
[[run]]
steps = 3
see = ["pull = last(rope.tension)"]
check = [{{ case = "tension", reference = "2 * 9.81", ours = "{factor} * pull", unit = "N", bar = 1e-10 }}]
[run.scene]
load = "load"
body = [{{ name = "load", mass = 2, shape = "particle", position = [0, 0, -1] }}]
massless_cable = [{{ name = "rope", through = [{{ body = "world" }}, {{ body = "load" }}], length = 1, stretch = 0 }}]
"#
    )
}

#[test]
fn the_file_of_a_case_counts_with_its_content() {
    let at = folder("edited_case");
    let write = |name: &str, factor| at.write(name, weighed(factor));
    write("own.toml", 1.0);
    write("OTHER.TOML", 3.0);
    at.good("hard own.toml");
    at.good("hard own.toml --resume");
    at.refused("hard own.toml OTHER.TOML", &["two cases", "`weight`"]);
    write("own.toml", 3.0);
    at.refused("hard own.toml --resume", &["content of what it reads"]);
    at.ends(1, "hard own.toml");
}

/// Files that a study finds by others count as well, and are not written over.
#[test]
fn files_that_other_files_lead_to_are_read() {
    let at = folder("led_to");
    at.write("a.toml", at.good("scene hoist --set segments=3"));
    let question = "on = [{ scenes = [\"a.toml\"] }]\nbackends = [\"dense\"]";
    at.write("q.toml", question);
    at.good("dump a.toml --step 1 --out d --name m");
    at.good("dump a.toml --steps 0..2 --out s");
    at.write("t.csv", "time,x\n0,0\n1,0\n");
    let case = weighed(1.0).replace("steps = 3", "file = \"t.csv\"\nsteps = 3");
    at.write("own.toml", case);
    let calls = [
        ("study systems q.toml --quick", "a.toml"),
        ("study matrix d/m.mtx --quick --backends dense", "d/m_b.mtx"),
        ("study sequence s --backends dense", "s/schur_1_rhs.mtx"),
        ("hard own.toml", "t.csv"),
    ];
    for (k, (call, file)) in calls.into_iter().enumerate() {
        let call = format!("{call} --cases {k}.cases");
        at.refused(format!("{call} --json {file}"), &["it is read"]);
        at.good(&call);
        at.good(format!("{call} --resume"));
        let text = at.read(file);
        at.write(file, format!("{text}\n"));
        let told = ["content of what it reads", file];
        at.refused(format!("{call} --resume"), &told);
        at.refused(format!("merge {k}.cases"), &told);
        fs::remove_file(at.join(file)).expect("there");
        let missing = format!("`{file} is missing`");
        at.refused(format!("merge {k}.cases"), &[&missing]);
        at.write(file, text);
    }
    at.refused("solve d/m.mtx --json d/m_b.mtx", &["it is read"]);
}

/// Refused before anything is made.
#[test]
fn cases_share_no_file_with_what_else_is_written() {
    let at = folder("shared_file");
    let rows = r"
        study stability --cases x --json x → `--json` and `--cases` cannot share a file
        study stability --cases x --csv ./x → `--csv` and `--cases`
        study stability --json target/taut/stability.cases → `--json` and `--cases`
        study stability --cases target/taut/report.html → `--cases` and the page
        hard --json target/taut/hard.report.json → `--json` and its data
    ";
    at.refuses(rows);
    assert_eq!(fs::read_dir(&at.0).expect("a folder").count(), 0);
}

/// The checks of `taut hard` and what `taut paper` writes are those of one run.
#[test]
fn experiments_that_end_in_checks_are_merged() {
    let at = folder("shards_checks");
    let call = "hard H01 H54 --quick";
    let whole = at.good(format!("{call} --json whole.json"));
    assert_eq!(merged(&at, "hard", call, ""), whole);
    assert_eq!(at.parsed("merged.json"), at.parsed("whole.json"));
    let files = [1, 2, 3].map(|shard| format!("target/taut/hard.{shard}-of-3.cases"));
    let merge = format!("merge {} --csv a.csv", files.join(" "));
    at.refused(&merge, &["taut hard", "--csv"]);
    let call = "paper table1 fig2 --quick --out figures";
    let whole = at.good(call);
    let files = || {
        let entries = fs::read_dir(at.join("figures")).expect("a folder");
        let entries = entries.flatten();
        let files = entries.map(|e| (e.file_name(), fs::read(e.path()).expect("readable")));
        let mut files: Vec<_> = files.collect();
        files.sort();
        files
    };
    let own = files();
    fs::remove_dir_all(at.join("figures")).expect("removed");
    assert_eq!(merged(&at, "paper", call, ""), whole);
    assert_eq!(files(), own);
}

#[test]
fn a_study_that_refuses_its_options_costs_no_cases() {
    let at = folder("kept");
    let call = "study stability --quick --time 0.1";
    at.good(call);
    let path = at.join("target/taut/stability.cases");
    let kept = fs::read(&path).expect("written");
    at.refused("study stability --quick --time 0", &["--time"]);
    assert_eq!(fs::read(&path).expect("there"), kept);
    at.good(format!("{call} --resume"));
    assert_eq!(fs::read(&path).expect("there"), kept);
}

/// A folder that cannot be written costs the file of cases only, unless that was asked for.
#[test]
fn a_file_of_cases_that_cannot_be_written_is_named() {
    let at = folder("no_cases");
    at.write("target", "");
    let call = "study stability --quick --time 0.1";
    let [stdout, stderr] = at.ends(0, call);
    assert!(stdout.contains("linearly-implicit"));
    assert!(stderr.contains("cannot be resumed"));
    for option in ["--shard 1/2", "--resume", "--cases target/a.cases"] {
        at.refuses(format!("{call} {option} → cannot write … target"));
    }
}

/// A shard that is queued twice loses nothing.
#[test]
fn a_shard_is_not_run_over_its_own_cases() {
    let at = folder("shard_again");
    let call = "study stability --quick --time 0.1 --shard 1/2";
    at.good(call);
    let path = at.join("target/taut/stability.1-of-2.cases");
    let kept = fs::read(&path).expect("written");
    at.refused(call, &["stability.1-of-2.cases", "--resume", "delete"]);
    assert_eq!(fs::read(&path).expect("there"), kept);
    at.good(format!("{call} --resume"));
    fs::remove_file(&path).expect("removed");
    at.good(call);
}

#[test]
fn shards_that_are_none_are_refused() {
    let at = folder("no_shards");
    let rows = r"
        study stability --shard 3/2 → --shard … from 1/8
        study stability --shard 1/2 --json a.json → cannot be used
        study stability --shard 1/2 --csv a.csv → cannot be used
        merge → FILE.cases
    ";
    at.refuses(rows);
    assert_eq!(fs::read_dir(&at.0).expect("a folder").count(), 0);
}

#[test]
fn files_that_cannot_be_merged_or_resumed_are_named() {
    let at = folder("no_merge");
    let call = "study stability --quick --time 0.1";
    for shard in ["1/2", "2/2"] {
        at.good(format!("{call} --shard {shard}"));
    }
    let [one, two] = [
        "target/taut/stability.1-of-2.cases",
        "target/taut/stability.2-of-2.cases",
    ];
    at.good("study stability --quick --time 0.2 --shard 2/2 --cases other.cases");
    let bytes = fs::read(at.join(two)).expect("readable");
    at.write("torn.cases", &bytes[..30]);
    at.write("cut.cases", &bytes[..bytes.len() - 3]);
    at.write("text.cases", "a,b\n");
    at.write("built.cases", at.read(one).replacen(" (", " (0", 1));
    let rows = format!(
        r"
        merge {one} --json merged.json → is in no file … all shards
        merge {one} other.cases --json merged.json → other.cases` has another command … --time=0.2
        merge built.cases --json merged.json → built.cases` has another version … one build
        merge {one} text.cases --json merged.json → text.cases` is no file of cases … taut
        merge {one} none.cases --json merged.json → cannot read … none.cases
        merge {one} {two} --json {one} → it is read
        study stability --quick --resume --cases other.cases → another command … --time=0.2 … this run
        "
    );
    at.refuses(&rows);
    assert!(!at.join("merged.json").exists());
    for file in ["torn.cases", "cut.cases"] {
        let output = at.taut(format!("merge {one} {file}"));
        let note = format!("note: the last line of `{file}`");
        for words in [&note, "is in no file", "--resume"] {
            assert!(text(&output.stderr).contains(words), "{words}: {output:?}");
        }
    }
    // What is torn is run again; a file without a whole line has nothing to lose.
    for file in ["torn.cases", "cut.cases"] {
        let [_, stderr] = at.ends(0, format!("{call} --shard 2/2 --resume --cases {file}"));
        let note = format!("note: the last line of `{file}` is torn");
        assert!(stderr.contains(&note), "{stderr}");
        let length = fs::read(at.join(file)).expect("there").len();
        assert_eq!(length, bytes.len());
    }
}

/// The inputs of a study are part of the identity of its cases.
#[test]
fn a_scene_that_changed_is_not_resumed() {
    let at = folder("changed");
    at.write("a.toml", at.good("scene hoist --set segments=3"));
    let call = "bench --quick --scene a.toml --backends dense --time 0.4";
    at.good(call);
    at.write("a.toml", at.good("scene hoist --set segments=4"));
    let rows = format!(
        r"
        {call} --resume → content of what it reads … a.toml
        merge target/taut/bench.cases → content of what it reads … this program
        "
    );
    at.refuses(&rows);
    at.good(call);
}
