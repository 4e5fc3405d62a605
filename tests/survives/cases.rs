//! The hard cases in their short form. A case holds its bars; here each row has the verdict that the
//! golden file has for it, so that no row that passed becomes a limit unseen.

use indicatif::ProgressBar;
use std::collections::BTreeMap;
use taut_integrator::{StepOptions, Stepper};
use taut_output::check::{Check, Verdict};
use taut_studies::hard::{self, Case, Measured, coded, from_files};

/// Verdicts of the golden file by case and row; none where the row has no other cell.
fn verdicts() -> BTreeMap<&'static str, Option<&'static str>> {
    let lines = include_str!("../golden/hard.rows").lines().skip(1);
    let row = |line: &'static str| {
        let mut cells = line.split(" | ");
        Some((cells.next()?, cells.last()))
    };
    lines.filter_map(row).collect()
}

/// Rows of a case that fail, or have another verdict than before. Other programs decide those of times.
fn changed(case: &Case) -> Vec<Check> {
    let golden = verdicts();
    let outcome = case.outcome(true, &ProgressBar::hidden()).expect("runs");
    let is_as_before = |check: &Check| match check.verdict {
        Verdict::Fail | Verdict::NotYet => false,
        _ if check.criterion.contains("wall clock") => true,
        verdict => {
            let before = golden.get(format!("{} {}", case.name(), check.case).as_str());
            before.is_some_and(|before| before.is_none_or(|before| before == verdict.to_string()))
        }
    };
    let passes = |check: &Check| check.verdict == Verdict::Pass;
    assert!(outcome.checks.iter().any(passes), "{}", case.name());
    let mut checks = outcome.checks;
    checks.retain(|check| !is_as_before(check));
    checks
}

fn all_are_as_before(cases: impl Iterator<Item = Case>) {
    for case in cases {
        let changed = changed(&case);
        assert!(changed.is_empty(), "{}: {changed:#?}", case.name());
    }
}

fn programs() -> impl Iterator<Item = Case> {
    coded::CASES.iter().copied().map(Case::Coded)
}

// Two tests, for two cores.
#[test]
fn cases_of_files_are_as_before() {
    all_are_as_before(from_files().step_by(2));
}

#[test]
fn every_other_case_of_a_file_is_as_before() {
    all_are_as_before(from_files().skip(1).step_by(2));
}

#[test]
fn programs_are_as_before() {
    all_are_as_before(programs());
}

/// Every case has a scene at its beginning that can be stepped, but for those that step none.
#[test]
fn the_scenes_at_their_beginnings_can_be_stepped() {
    // None of these is audited, but for H42, whose rigid mechanism every step may refuse by name.
    let none = ["H15", "H16", "H42", "H55", "scale"];
    for case in hard::cases().filter(|case| !none.contains(&case.name())) {
        let scenes = case.scenes().expect("scenes");
        assert!(!scenes.is_empty(), "{}", case.name());
        for scene in scenes {
            let place = format!("{}: {}", case.name(), scene.name);
            let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
            for _ in 0..3 {
                stepper.step().unwrap_or_else(|e| panic!("{place}: {e}"));
            }
        }
    }
}
