//! Hard cases: scenes with known answers, or with a known absence of one, that solvers and steps are known to fail on.
//!
//! A case is a file ([`file`]), or a row of the table of those that are programs ([`coded`]): its name, what it is, the function
//! that measures it, in a module of its own, and the scenes on which every solver's claims are audited. It ends in an
//! [`Outcome`] as the paper's experiments do: rows of checks with reference, ours, error, bar and verdict, and the parts
//! of the error that come from the solver, the time step and the segments where the exact discrete answer is known.

pub mod coded;
mod file;
mod special;
mod study;

pub use file::{CaseError, CaseFile};
pub(crate) use study::STUDY;

pub use crate::checks::Measured;
use crate::options::Refused;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::sync::LazyLock;
use taut_integrator::StepOptions;
use taut_measure::choice::Choice;
pub(crate) use taut_measure::errors::worse;
use taut_model::Scene;
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};
use taut_output::table;

/// A hard case that is a program.
#[derive(Debug, Clone, Copy)]
pub struct Coded {
    pub name: &'static str,
    pub title: &'static str,
    /// Measures it, whole or quick.
    pub run: fn(bool, &ProgressBar) -> Result<Outcome, ExperimentError>,
    /// Its scenes at their beginnings, of each kind one: every solver solves some of their steps, and what it says of
    /// itself is compared with what it did.
    pub scenes: fn() -> Result<Vec<Scene>, ExperimentError>,
}

/// A hard case: a program, or a file ([`file`]).
#[derive(Debug, Clone, Copy)]
pub enum Case {
    Coded(Coded),
    File(&'static CaseFile),
}

impl Case {
    /// Tells whether a case of this name is the same one.
    pub(crate) fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::File(own), Self::File(file)) => std::ptr::eq(*own, *file),
            (Self::Coded(own), Self::Coded(program)) => own.name == program.name,
            _ => false,
        }
    }

    /// Its scenes at their beginnings, on which the solvers' claims are audited.
    pub fn scenes(&self) -> Result<Vec<Scene>, ExperimentError> {
        match self {
            Self::Coded(case) => (case.scenes)(),
            Self::File(case) => file::scenes(case),
        }
    }
}

impl Measured for Case {
    fn name(&self) -> &'static str {
        match self {
            Self::Coded(case) => case.name,
            Self::File(case) => &case.name,
        }
    }

    fn title(&self) -> &'static str {
        match self {
            Self::Coded(case) => case.title,
            Self::File(case) => &case.title,
        }
    }

    fn run(&self, quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
        match self {
            Self::Coded(case) => (case.run)(quick, progress),
            Self::File(case) => file::outcome(case, quick, progress),
        }
    }
}

/// All cases: the programs, those of files.
pub fn cases() -> impl Iterator<Item = Case> {
    let programs = coded::CASES.iter().copied().map(Case::Coded);
    programs.chain(from_files())
}

/// The cases of the files that come with the program.
pub fn from_files() -> impl Iterator<Item = Case> {
    static FILES: LazyLock<Vec<CaseFile>> = LazyLock::new(|| {
        let read = |text: &&str| CaseFile::parse(text).unwrap_or_else(|e| panic!("{e}: {text}"));
        file::FILES.iter().map(read).collect()
    });
    FILES.iter().map(Case::File)
}

/// The case with that name, in upper or lower case.
pub fn named(name: &str) -> Result<Case, Refused> {
    let found = cases().find(|c| c.name().eq_ignore_ascii_case(name));
    found.ok_or_else(|| {
        let names: Vec<&str> = cases().map(|c| c.name()).collect();
        let names = names.join(", ");
        Refused(format!("no case is called `{name}`: choose one of {names}"))
    })
}

/// Every solver compiled in, the iterative ones with iterations enough to converge to rounding on small scenes.
pub fn solvers() -> Vec<Choice> {
    let compiled = Choice::all().into_iter().filter(|c| c.check().is_ok());
    let patient = compiled.map(|choice| Choice {
        backend: choice.backend.with_iterations(20_000).with_tolerance(1e-13),
        form: choice.form,
    });
    patient.collect()
}

/// One check by every solver, those that pass alike in one row ([`together`]).
pub(crate) fn each_solver(
    case: &str,
    mut check: impl FnMut(&Choice) -> Result<Check, ExperimentError>,
) -> Result<Vec<Check>, ExperimentError> {
    let found = solvers().into_iter().map(|choice| {
        let check = check(&choice)?;
        Ok((choice.family(), check))
    });
    let found: Result<_, ExperimentError> = found.collect();
    Ok(together(case, found?))
}

/// A table of rows by name, with `corner` over the names.
pub(crate) fn grid(
    corner: &str,
    heads: &[String],
    rows: impl IntoIterator<Item = (String, Vec<String>)>,
) -> String {
    let mut header = vec![corner];
    header.extend(heads.iter().map(String::as_str));
    let mut t = table::table(&header);
    for (name, cells) in rows {
        t.add_row([vec![name], cells].concat());
    }
    table::text(&t)
}

/// Time step of most cases \[s].
pub(crate) const DT: f64 = 1.0 / 60.0;
/// \[m/s²].
pub(crate) const GRAVITY: f64 = 9.81;

/// An empty scene in which things fall down along z.
pub(crate) fn under_gravity(name: &str) -> Scene {
    let mut scene = Scene::new(name);
    scene.gravity = Vector3::z() * -GRAVITY;
    scene
}

/// Largest distance of two ways, place by place.
pub(crate) fn farthest(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let each = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    each.fold(0.0, worse)
}

/// The default step in time steps of `dt` (s).
pub(crate) fn at(dt: f64) -> StepOptions {
    StepOptions {
        dt,
        ..StepOptions::default()
    }
}

/// The checks of several solvers on one thing, `case`: those that pass the same bar, or in the same words, share a row
/// with the largest of their errors, the others have one each.
pub fn together(case: &str, checks: Vec<(String, Check)>) -> Vec<Check> {
    alike(case, "solvers", checks)
}

/// [`together`] of things that are called so.
pub(crate) fn alike(case: &str, noun: &str, checks: Vec<(String, Check)>) -> Vec<Check> {
    // A passed check with a number and a bar, or one in words, which have to be the same.
    let way = |c: &Check| match (c.verdict, c.error) {
        (Verdict::Pass, Some(_)) => Some(format!("{:?}", c.bar)),
        (Verdict::Pass, None) => Some(c.ours.clone()),
        _ => None,
    };
    let mut groups: Vec<Vec<(String, Check)>> = Vec::new();
    for (solver, check) in checks {
        let own = way(&check);
        let known = own.is_some().then(|| {
            let same = |g: &&mut Vec<(String, Check)>| way(&g[0].1) == own;
            groups.iter_mut().find(same)
        });
        match known.flatten() {
            Some(group) => group.push((solver, check)),
            None => groups.push(vec![(solver, check)]),
        }
    }
    let merged = groups.into_iter().filter_map(|group| {
        let names: Vec<&str> = group.iter().map(|(solver, _)| solver.as_str()).collect();
        let (who, names) = match names.as_slice() {
            [one] => ((*one).to_owned(), String::new()),
            all => (format!("{} {noun}", all.len()), all.join(", ")),
        };
        let size = |c: &Check| c.error.unwrap_or(0.0);
        let (_, worst) = group
            .iter()
            .max_by(|(_, a), (_, b)| size(a).total_cmp(&size(b)))?;
        let note = [names.as_str(), worst.note.as_str()];
        let note: Vec<&str> = note.into_iter().filter(|t| !t.is_empty()).collect();
        Some(Check {
            case: format!("{case}: {who}"),
            note: note.join("; "),
            ..worst.clone()
        })
    });
    merged.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_case_lists_the_known() {
        let e = named("H99").unwrap_err().to_string();
        assert!(e.starts_with("no case is called `H99`: choose one of "));
        assert!(cases().all(|c| e.contains(c.name())), "{e}");
        assert_eq!(named("h42").unwrap().name(), "H42");
    }

    #[test]
    fn every_case_has_a_name_of_its_own() {
        let mut names: Vec<&str> = cases().map(|c| c.name()).collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all);
    }

    #[test]
    fn a_case_without_checks_has_failed() {
        let case = Case::Coded(Coded {
            run: |_, _| Ok(Outcome::default()),
            ..coded::CASES[0]
        });
        let outcome = case.outcome(true, &ProgressBar::hidden()).unwrap();
        let verdicts: Vec<Verdict> = outcome.checks.iter().map(|c| c.verdict).collect();
        assert_eq!(verdicts, [Verdict::Fail]);
    }

    #[test]
    fn solvers_that_pass_alike_share_a_row() {
        let within = |error| Check::within("", "1", "2", error, 1.0);
        let said = |words: &str| Check::claim("", "", words.to_owned(), Verdict::Pass, "");
        let rows = [
            ("a", within(0.1)),
            ("b", within(2.0)),
            ("c", within(0.3)),
            ("d", said("refused")),
            ("e", said("silent")),
            ("f", said("refused")),
        ];
        let rows = rows.map(|(solver, check)| (solver.to_owned(), check));
        let merged = together("it", rows.to_vec());
        let shown: Vec<_> = merged.iter().map(|c| (c.case.as_str(), c.error)).collect();
        let expected = [
            ("it: 2 solvers", Some(0.3)),
            ("it: b", Some(2.0)),
            ("it: 2 solvers", None),
            ("it: e", None),
        ];
        assert_eq!(shown, expected);
        assert_eq!(merged[0].note, "a, c");
    }
}
