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
        let checks = outcome(&case, quick, &ProgressBar::hidden())
            .unwrap()
            .checks;
        let names: Vec<&str> = checks.iter().map(|c| c.case.as_str()).collect();
        assert_eq!(names, cases);
        assert!(
            checks.iter().all(|c| c.verdict == Verdict::Pass),
            "{checks:?}"
        );
    }
    let told: Vec<String> = case.guarantees().collect();
    assert_eq!(told, ["{mass} kg: mass * 9.81 within 1e-10 N"]);
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
    let found: Vec<_> = checks
        .iter()
        .map(|c| (c.case.as_str(), c.verdict))
        .collect();
    let expected = [
        ("2 kg: 2 of them", Verdict::Pass),
        ("2 kg: 1 N", Verdict::Fail),
    ];
    assert_eq!(found, expected);
}

#[test]
fn unknown_names_are_told_in_one_line_with_the_nearest() {
    let good = hung(SEE, CHECK);
    let expected = [
        (
            "steps = 3",
            "stepps = 3",
            "`line 7`: no key is called `stepps`: perhaps `steps`",
        ),
        (
            "unit =",
            "units =",
            "`line 9`: no key is called `units`: perhaps `unit`",
        ),
        (
            "last(rope",
            "lst(rope",
            "`lst(rope.tension)`: no function is called `lst`: perhaps `last`",
        ),
        (
            "rope.tension",
            "rope.tensoin",
            "no quantity is called `tensoin`: perhaps `tension`",
        ),
        (
            "rope.tension",
            "rop.tension",
            "no body, joint or cable is called `rop`: perhaps `rope`",
        ),
        (
            "steps = 3",
            "steps = -3",
            "`steps` is -3: it has to be from 0 to 1e8",
        ),
        (
            "steps = 3",
            "time = nan",
            "`time` is NaN: it has to be from 0 to 2e6",
        ),
        (
            "rope.tension",
            "deepst",
            "no probe is called `deepst`: perhaps `deepest`",
        ),
        (
            "ours = \"pull\"",
            "ours = \"pul\"",
            "`pul`: no value is called `pul`: perhaps `pull`",
        ),
    ];
    assert_eq!(error(&good), "none");
    for (right, wrong, told) in expected {
        let found = error(&good.replace(right, wrong));
        assert_eq!(found, told);
    }
}

#[test]
fn entries_repeat_and_lists_combine() {
    let text = r#"
name = "row"
title = "masses in a row"
source = "statics"
[[run]]
each = { n = [1, 3], g = [{ gx = 0, gz = -10 }] }
over = { way = 2 }
steps = 1
see = ["held = last(link_0.tension)"]
check = [{ case = "{n} masses", reference = "10 * n", ours = "held", bar = 1e-12 }]
[run.scene]
gravity = ["=gx", 0, "=gz"]
body = [{ repeat = "=n", name = "m_{k}", mass = 1, shape = "particle", position = [0, 0, "=-(k + 1)"] }]
massless_cable = [
  { name = "link_0", through = [{ body = "world" }, { body = "m_0" }], length = 1, stretch = 0 },
  { repeat = "=n - 1", name = "link_{k + 1}", through = [{ body = "m_{k}" }, { body = "m_{k + 1}" }], length = 1, stretch = 0 },
]
"#;
    let case = CaseFile::parse(text).unwrap();
    let checks = outcome(&case, true, &ProgressBar::hidden()).unwrap().checks;
    let passed: Vec<_> = checks
        .iter()
        .map(|c| (c.case.as_str(), c.verdict))
        .collect();
    assert_eq!(
        passed,
        [("1 masses", Verdict::Pass), ("3 masses", Verdict::Pass)]
    );
}

/// Each file that comes with the program is read, and all its names are found.
#[test]
fn all_files_are_sound() {
    for text in FILES {
        let case = CaseFile::parse(text).unwrap();
        verify(&case).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    }
}
