use super::guarantees::guarantees;
use super::run::{outcome, verify};
use super::*;
use indicatif::ProgressBar;
use taut_output::check::Verdict;

/// A weight on a rope, of which `see` and `check` are to be given.
fn hung(see: &str, check: &str) -> String {
    format!(
        r#"
name = "hung"
title = "a weight on a rope"
source = "statics"
[[run]]
each = [{{ mass = 2 }}, {{ mass = 30, long = true }}]
steps = 3
see = [{see}]
check = [{{ case = "{{mass}} kg", {check} }}]
[run.scene]
load = "load"
body = [{{ name = "load", mass = "=mass", shape = "particle", position = [0, 0, -1] }}]
massless_cable = [{{ name = "rope", through = [{{ body = "world" }}, {{ body = "load" }}], length = 1, stretch = 0 }}]
"#
    )
}

const SEE: &str = r#""pull = last(rope.tension)""#;
const CHECK: &str = r#"reference = "mass * 9.81", ours = "pull", unit = "N", bar = 1e-10"#;

fn error(text: &str) -> String {
    let read = CaseFile::parse(text).map_err(|e| e.to_string());
    match read.and_then(|case| verify(&case).map_err(|e| e.to_string())) {
        Ok(()) => "none".to_owned(),
        Err(e) => e,
    }
}

#[test]
fn a_case_of_a_few_lines_is_measured() {
    let case = CaseFile::parse(&hung(SEE, CHECK)).unwrap();
    for (quick, cases) in [(true, vec!["2 kg"]), (false, vec!["2 kg", "30 kg"])] {
        let checks = outcome(&case, quick, &ProgressBar::hidden()).unwrap();
        let checks = checks.checks;
        let names: Vec<&str> = checks.iter().map(|c| c.case.as_str()).collect();
        assert_eq!(names, cases);
        let all_hold = checks.iter().all(|c| c.verdict == Verdict::Pass);
        assert!(all_hold, "{checks:?}");
    }
    let found = guarantees(&case);
    assert_eq!(found, ["2, 30 kg: 19.62, 294.3 N within 1e-10 of it"]);
}

#[test]
fn a_wrong_reference_fails() {
    let wrong = CHECK.replace("9.81", "9.8100001");
    let case = CaseFile::parse(&hung(SEE, &wrong)).unwrap();
    let checks = outcome(&case, true, &ProgressBar::hidden()).unwrap().checks;
    assert_eq!(checks[0].verdict, Verdict::Fail);
}

/// Runs that pass alike share a row, another one stands by itself.
#[test]
fn each_run_is_judged_by_itself() {
    let check = r#"by-run = ["{extra} N", "of them"], reference = "mass * 9.81 + extra", ours = "pull", bar = 1e-10"#;
    let over = "steps = 3\nover = { extra = [0, 1e-12, 1] }";
    let text = hung(SEE, check).replace("steps = 3", over);
    let case = CaseFile::parse(&text).unwrap();
    let checks = outcome(&case, true, &ProgressBar::hidden()).unwrap().checks;
    let found = checks.iter();
    let found: Vec<_> = found.map(|c| (c.case.as_str(), c.verdict)).collect();
    let expected = [
        ("2 kg: 2 of them", Verdict::Pass),
        ("2 kg: 1 N", Verdict::Fail),
    ];
    assert_eq!(found, expected);
}

/// A sound text; in each line of `faults` what stands in it, what stands there instead, and the error of that.
fn refused(text: &str, faults: &str) {
    assert_eq!(error(text), "none");
    for line in faults.trim().lines() {
        let parts: Vec<&str> = line.split(" | ").collect();
        let [right, wrong, told] = parts[..] else {
            panic!("three parts: {line}")
        };
        assert!(text.contains(right), "{right}");
        assert_eq!(error(&text.replacen(right, wrong, 1)), told);
    }
}

/// Each table of a run, down to those whose wrong keys once were passed over.
#[test]
fn unknown_keys_of_a_run_are_told() {
    let own = include_str!("texts/keys.toml").trim_end();
    let text = hung(SEE, CHECK).replace("steps = 3", own);
    let text = text.replace(
        "body = [",
        "control = [{ name = \"hoist\", drives = [{ joint = \"rope\" }] }]\nbody = [{ name = \"post\", mobility = \"static\" }, ",
    );
    let text = text.replace("stretch = 0 }]", "stretch = 0, winch = {} }]");
    refused(&text, include_str!("texts/keys.faults"));
    refused(&hung(SEE, CHECK), include_str!("texts/hung.faults"));
}

#[test]
fn faults_of_a_scene_are_told_in_the_lines_of_the_file() {
    let row = include_str!("texts/row.toml");
    refused(row, include_str!("texts/row.faults"));
    let hoist = include_str!("texts/hoist.toml");
    refused(hoist, include_str!("texts/hoist.faults"));
}

/// The keys that users are shown are those that are read.
#[test]
fn the_table_of_keys_is_that_of_the_reader() {
    fn read<T: serde::de::DeserializeOwned>(table: &str, names: &[&str]) {
        let mut told = keys::keys(table);
        let refusal = toml::from_str::<T>("unheard-of = 1");
        let refusal = refusal.err().expect("no such key").to_string();
        let read = refusal.split('`').skip(3);
        let mut read: Vec<&str> = read.step_by(2).chain(names.iter().copied()).collect();
        read.sort_unstable();
        told.sort_unstable();
        assert_eq!(told, read, "{table}");
    }
    read::<CaseFile>("", &[]);
    read::<Run>("run", &[]);
    read::<Bodies>("run.bodies", &[]);
    read::<Mode>("run.mode", &[]);
    read::<BodyAt>("run.places", &["repeat", "value"]);
    read::<Step>("run.step", &[]);
    read::<Load>("run.load.BODY", &[]);
    read::<Change>("run.change", &[]);
    read::<Halve>("run.halve", &[]);
    read::<CheckEntry>("run.check", &[]);
    read::<Limit>("run.check.limit", &[]);
    for line in keys::help().lines() {
        assert!(line.chars().count() <= 120, "{line}");
    }
}

/// What a run alone can tell is left open, what the rows say is filled in.
#[test]
fn guarantees_are_told_without_a_run() {
    let rows = r#"{ n = [2, 3, 5, 8, 13], way = ["up", "down"] }"#;
    let text = hung(SEE, CHECK).replace("[{ mass = 2 }, { mass = 30, long = true }]", rows);
    let text = text.replace("=mass", "=n");
    let text = text.replace("{mass} kg", "{n} kg {way}, {pull:.1} N");
    let words = r#"reference = "{n * n:.1} N", error = "pull", bar = "=n / 10""#;
    let once = r#"reference = "pull", ours = "pull", bar = 1, if = "n > 5""#;
    for (check, told) in [
        (
            words,
            "2 … 13 kg up, down, … N: 4.0 … 169.0 N within 0.2 … 1.3",
        ),
        (
            once,
            "8, 13 kg up, down, … N: what the run has as `pull` within 1 of it",
        ),
    ] {
        let case = CaseFile::parse(&text.replace(CHECK, check)).unwrap();
        assert_eq!(guarantees(&case), [told]);
    }
    for text in FILES {
        let case = CaseFile::parse(text).unwrap();
        for line in guarantees(&case) {
            assert!(!line.contains(['{', '}']), "{}: {line}", case.name);
        }
    }
}

#[test]
fn entries_repeat_and_lists_combine() {
    let case = CaseFile::parse(include_str!("texts/repeated.toml")).unwrap();
    let checks = outcome(&case, true, &ProgressBar::hidden()).unwrap().checks;
    let passed = checks.iter();
    let passed: Vec<_> = passed.map(|c| (c.case.as_str(), c.verdict)).collect();
    let expected = [("1 masses", Verdict::Pass), ("3 masses", Verdict::Pass)];
    assert_eq!(passed, expected);
}

#[test]
fn all_files_are_sound() {
    for text in FILES {
        let case = CaseFile::parse(text).unwrap();
        verify(&case).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    }
}

/// A table beside the case is a value as any other, at the times of the steps.
#[test]
fn a_table_beside_the_case_is_its_reference() {
    let see = r#""pull = last(file.pull)", "early = first(file.pull)""#;
    let check = r#"reference = "pull", ours = "mass * 9.81", bar = 1e-10"#;
    let text = hung(see, check).replace("steps = 3", "steps = 3\nfile = \"pulls.csv\"");
    let read = |text: &str, table: &'static str| {
        let beside = move |name: &str| match name {
            "pulls.csv" => Ok(table.to_owned()),
            name => Err(format!("no `{name}`").into()),
        };
        let case = CaseFile::read(text, &beside)?;
        verify(&case).map(|()| case)
    };
    for (table, verdict) in [
        ("time,pull\n0,0\n0.05,19.62", Verdict::Pass),
        // Linear between rows, where the third step is in the middle of two.
        ("time,pull\n0,0\n0.1,39.24", Verdict::Pass),
        ("time,pull\n0,0\n0.05,19.63", Verdict::Fail),
        // The run goes on when the table has ended.
        ("time,pull\n0,0\n0.04,19.62", Verdict::Fail),
    ] {
        let case = read(&text, table).unwrap();
        let checks = outcome(&case, true, &ProgressBar::hidden()).unwrap().checks;
        assert_eq!(checks[0].verdict, verdict, "{table}");
    }
    let sound = "time,pull\n0,0\n1,1";
    for (table, right, wrong, told) in [
        (
            sound,
            "last(file.pull)",
            "last(file.pul)",
            "line 9: no column is called `pul`: perhaps `pull`",
        ),
        (
            sound,
            "pulls.csv",
            "pull.csv",
            "line 8: `pull.csv`: no `pull.csv`",
        ),
        (
            "time,pull\n0,x",
            "",
            "",
            "line 8: `pulls.csv`: line 2: `pull` is `x`: give a finite number",
        ),
    ] {
        let error = read(&text.replacen(right, wrong, 1), table).unwrap_err();
        assert_eq!(error.to_string(), told);
    }
}
