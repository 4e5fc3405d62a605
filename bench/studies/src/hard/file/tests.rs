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
    assert_eq!(
        guarantees(&case),
        ["2, 30 kg: 19.62, 294.3 N within 1e-10 of it"]
    );
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

/// A sound text; in each line of `faults` what stands in it, what stands there instead, and what is told of that.
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

#[test]
fn unknown_names_are_told_in_one_line_with_the_nearest() {
    refused(
        &hung(SEE, CHECK),
        r#"
title | titel | line 3: no key is called `titel`: perhaps `title`
steps = 3 | stepps = 3 | line 7: no key is called `stepps`: perhaps `steps`
unit = | units = | line 9: no key is called `units`: perhaps `unit`
long = | lnog = | line 6: no value is called `lnog`: perhaps `long`
last(rope | lst(rope | line 8: `lst(rope.tension)`: no function is called `lst`: perhaps `last`
rope.tension | rope.tensoin | line 8: no quantity is called `tensoin`: perhaps `tension`
rope.tension | rop.tension | line 8: no body, joint or cable is called `rop`: perhaps `rope`
steps = 3 | steps = -3 | line 7: `steps` is -3: it has to be from 0 to 1e8
steps = 3 | steps = 2.7 | line 7: `steps` is 2.7: it has to be whole, from 0 to 1e8
steps = 3 | time = nan | line 7: `time` is NaN: it has to be from 0 to 2e6
rope.tension | deepst | line 8: no probe is called `deepst`: perhaps `deepest`
ours = "pull" | ours = "pul" | line 9: `pul`: no value is called `pul`: perhaps `pull`
bar = | if = "pul > 0", bar = | line 9: `pul > 0`: no value is called `pul`: perhaps `pull`
ours = "pull" | ours = "xyz" | line 9: `xyz`: no value is called `xyz`
steps = 3 |  | line 5: [[run]] needs `steps`"#,
    );
}

/// Each table of a run, down to those whose wrong keys once were passed over.
#[test]
fn unknown_keys_of_a_run_are_told() {
    let own = r#"steps = 3
over = { extra = [0, 1] }
quick = { extra = [0] }
rest = true
may-fail = true
step = { balance = true }
drive = { hoist = 0 }
path = [{ repeat = 1, value = "load" }]
places = [{ body = "load", place = [0, 0, -1] }]
load = { load = { force = [0, 0, 0], torque = [0, 0, 0] } }
change = [{ step = 9, remove = "rope" }, { step = 9, tie = ["load", "post"] }]
audit = [{ mass = 2, extra = 0 }]
keep = ["pull"]"#;
    let text = hung(SEE, CHECK).replace("steps = 3", own);
    let text = text.replace(
        "body = [",
        "control = [{ name = \"hoist\", drives = [{ joint = \"rope\" }] }]\nbody = [{ name = \"post\", mobility = \"static\" }, ",
    );
    let text = text.replace("stretch = 0 }]", "stretch = 0, winch = {} }]");
    refused(
        &text,
        r#"
quick = { extra | quick = { extr | line 9: no list is called `extr`: perhaps `extra`
quick = { extra = [0] } | quick = { extra = [] } | line 9: `values` is 0: it has to be from 1 to 1e4
over = { extra = [0, 1] } | over = { extra = [0], more = 1e12 } | line 8: `values` is 1000000000000: it has to be from 1 to 1e4
rest = true | rest = { steps = 2, pas = 1 } | line 10: no key is called `pas`: perhaps `pass`
rest = true | rest = { steps = 2, creep = 1 } | line 10: `rest` is true, { steps, pass }, { creep }, { solved } or { follow, pass }
may-fail = true | may-fail = "limit" | line 11: `may-fail` is true, false or "limits"
balance = true | balance = "yes" | line 12: `balance` is true, or how much may come from nowhere, such as 1e-9
balance = true | scheme = "spok" | line 12: unknown scheme `spok`: choose one of linearly-implicit, spook, third-difference[:a=A][:gamma=G]
{ hoist = 0 | { hoit = 0 | line 13: no control is called `hoit`: perhaps `hoist`
{ hoist = 0 | { loda = [0, 0, 0] | line 13: no body is called `loda`: perhaps `load`
{ hoist = 0 | { load = [0, 0] | line 13: a vector has three numbers, not 2
value = "load" | value = "lod" | line 14: no body is called `lod`: perhaps `load`
{ repeat = 1, value | { repaet = 1, value | line 14: no key is called `repaet`: perhaps `repeat`
place = [0 | plaec = [0 | line 15: no key is called `plaec`: perhaps `place`
load = { load | load = { lod | line 16: no body is called `lod`: perhaps `load`
torque | toruqe | line 16: no key is called `toruqe`: perhaps `torque`
remove = "rope" | remove = "rop" | line 17: no joint or cable is called `rop`: perhaps `rope`
"load", "post" | "load", "pots" | line 17: no body is called `pots`: perhaps `post`
extra = 0 } | exrta = 0 } | line 18: no value is called `exrta`: perhaps `extra`
keep = ["pull"] | keep = ["pul"] | line 19: `pul`: no value is called `pul`: perhaps `pull`"#,
    );
}

/// The scene that is built has its entries repeated, its keys in another order and other lines.
#[test]
fn faults_of_a_scene_are_told_in_the_lines_of_the_file() {
    let text = r#"
name = "row"
title = "masses in a row"
source = "statics"

[scene]
body = [
  { repeat = 3, name = "m_{k}", mass = 1, shape = "particle", position = [0, 0, "=-(k + 1)"] },
  { name = "last", mass = 1, shape = { sphere = { radius = 1 } }, position = [0, 0, -9] },
]
gravity = [0, 0, -10]
massless_cable = [
  { repeat = 3, name = "link_{k}", through = [{ body = "world" }, { body = "m_{k}" }], stretch = 0 },
  { name = "far", through = [{ body = "world" }, { body = "last" }], stretch = 0 },
]

[[run]]
steps = 1
check = []

[[run]]
steps = 1
check = []
[run.scene]
# The masses hang from nothing here.
[run.scene.hoist]
segments = 3
"#;
    refused(
        text,
        r#"
gravity = | gravty = | line 11: no key is called `gravty`: perhaps `gravity`
{ name = "last", mass | { name = "last", mas | line 9: no key is called `mas`: perhaps `mass`
sphere = { radius | sphere = { raduis | line 9: no key is called `raduis`: perhaps `radius`
sphere | spere | line 9: no choice is called `spere`: perhaps `sphere`
m_{k}", mass = 1 | m_{k}", mass = "=1 - k" | line 8: body `m_1`: mass is 0: it has to be > 0 kg
m_{k}", mass = 1 | m_{k}", mass = "=j" | line 8: `j`: no value is called `j`
repeat = 3, name = "link | repeat = 4, name = "link | line 13: massless cable `link_3` names the body `m_3`, which is not there: choose one of m_0, m_1, m_2, last
{ body = "last" } | { body = "lats" } | line 14: massless cable `far` names the body `lats`, which is not there: choose one of m_0, m_1, m_2, last
{ body = "last" } | { bdy = "last" } | line 14: no key is called `bdy`: perhaps `body`
last" }], stretch = 0 | last" }], stretch = -1 | line 14: massless cable `far`: stretch: compliance is -1: it has to be ≥ 0 (m/N or rad/(N m)); 0 is rigid
repeat = 3, name = "link | repaet = 3, name = "link | line 13: `k`: no value is called `k`
segments | segmnets | line 27: no key is called `segmnets`: perhaps `segments`
segments = 3 | segments = 0 | line 27: segments is 0: it has to be at least 1
run.scene.hoist | run.scene.hosit | line 26: no key is called `hosit`: perhaps `hoist`"#,
    );
}

/// The keys that people are told are those that are read.
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
    read::<Place>("run.places", &["repeat", "value"]);
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
    let passed = checks.iter();
    let passed: Vec<_> = passed.map(|c| (c.case.as_str(), c.verdict)).collect();
    assert_eq!(
        passed,
        [("1 masses", Verdict::Pass), ("3 masses", Verdict::Pass)]
    );
}

#[test]
fn all_files_are_sound() {
    for text in FILES {
        let case = CaseFile::parse(text).unwrap();
        verify(&case).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    }
}

#[test]
fn counts_out_of_range_are_refused() {
    let text = r#"
name = "hoist"
title = "a hoist"
source = "none"

[[run]]
steps = 1
bodies = [{ cable = "cable", every = 2, heavier = 2 }]
mode = { coordinates = [0], number = 0, amplitude = 0.01 }
check = []
[run.scene.hoist]
segments = 4
"#;
    verify(&CaseFile::parse(text).unwrap()).unwrap();
    refused(
        text,
        r#"
every = 2 | every = 0 | line 8: `every` is 0: it has to be from 1 to 1e9
[0], number = 0 | [6], number = 0 | line 9: `coordinates` is 6: it has to be from 0 to 5
number = 0 | number = 99 | line 9: `number` is 99: it has to be from 0 to 4"#,
    );
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
