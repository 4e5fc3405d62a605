use crate::{folder, good, json, refused, taut, text};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

/// A quick run of the hoist with the banded solver.
const QUICK: &str = "track hoist-24-1e3/banded --quick --baseline base.json";

fn read(text: &str) -> Vec<Value> {
    serde_json::from_str(text).expect("a list")
}

#[test]
fn bad_input_is_named() {
    let at = folder("track_refused");
    let known = ["hoist/lu", "hoist-24-1e3/banded", "gantry/banded"];
    refused(&at, "track hoist/lu", &known);
    let absent = ["bench/track-baseline.json", "--baseline"];
    refused(&at, "track --quick", &absent);
    fs::write(at.join("base.json"), "{}").expect("writes");
    refused(&at, QUICK, &["base.json", "no baseline", "--update"]);
    fs::write(at.join("base.json"), "[]").expect("writes");
    let both = format!("{QUICK} --json - --bencher -");
    refused(&at, &both, &["--json", "--bencher"]);
}

#[test]
fn counts_that_are_compared_with_nothing_are_not_passed() {
    if !cfg!(feature = "banded") {
        return;
    }
    let at = folder("track_counts");
    fs::write(at.join("base.json"), "[]").expect("writes");
    let counted = format!("{QUICK} --instructions");
    if Command::new("valgrind").arg("--version").output().is_err() {
        return refused(&at, &counted, &["valgrind", "--instructions"]);
    }
    let of = |arguments: &str| taut(&at, arguments).status.code();
    assert_eq!(of(&counted), Some(3));
    assert_eq!(of(&format!("{counted} --update")), Some(0));
    let baseline = fs::read_to_string(at.join("base.json")).expect("a baseline");
    let other = baseline.replace("valgrind-", "valgrind-9");
    fs::write(at.join("base.json"), &other).expect("writes");
    assert_eq!(of(&counted), Some(0));
    fs::write(at.join("base.json"), other.replace("\"rustc ", "\"rustc 9")).expect("writes");
    assert_eq!(of(&counted), Some(3));
}

#[test]
fn figures_are_compared_with_a_baseline_that_an_update_writes() {
    if !cfg!(feature = "banded") {
        return;
    }
    let at = folder("track");
    let table = good(&at, &format!("{QUICK} --update"));
    assert!(table.contains("hoist-24-1e3/banded") && table.contains("new"));
    assert!(table.contains("instructions were not counted"), "{table}");
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    let file = || fs::read_to_string(at.join("base.json")).expect("a baseline");
    let names: BTreeSet<String> = read(&file())
        .iter()
        .map(|entry| {
            assert!(
                entry["value"].is_number() && entry["unit"].is_string(),
                "{entry}"
            );
            entry["name"].as_str().expect("a name").to_owned()
        })
        .collect();
    for measure in "allocations forward-error load-error time-min time-median".split(' ') {
        assert!(
            names.contains(&format!("hoist-24-1e3/banded/{measure}")),
            "{names:?}"
        );
    }
    assert!(!names.contains("hoist-24-1e3/banded/instructions"));
    let again = json(&at, &format!("{QUICK} --json - --bencher bencher.json"));
    let again: BTreeSet<&str> = again
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|entry| entry["name"].as_str())
        .collect();
    assert_eq!(again, names.iter().map(String::as_str).collect());
    let bencher = fs::read_to_string(at.join("bencher.json")).expect("a file");
    let bencher: Value = serde_json::from_str(&bencher).expect("JSON");
    let latency = &bencher["hoist-24-1e3/banded"]["latency"];
    assert!(
        latency["value"].as_f64() >= latency["lower_value"].as_f64(),
        "{bencher}"
    );
    assert!(latency["lower_value"].is_number(), "{bencher}");
    // A figure whose name has vanished fails; an update removes it.
    let renamed = file().replace(
        "hoist-24-1e3/banded/load-error",
        "hoist-23/banded/load-error",
    );
    fs::write(at.join("base.json"), renamed).expect("writes");
    let output = taut(&at, QUICK);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("no longer tracked"));
    assert!(
        text(&output.stderr).contains("1 of"),
        "{}",
        text(&output.stderr)
    );
    good(&at, &format!("{QUICK} --update"));
    assert!(!file().contains("hoist-23/"));
}
