//! Cost of one linear solve, ours beside others' in the same run: every solver factorises and
//! solves the same matrices, in turns.
//!
//! A case is the system of one step of the hoist, hanging at an angle, with joints of 3, 5 or 6 rows between its
//! segments; its ends are ball joints. A pass is what each step repeats: factorisation and solve of the assembled system,
//! by a solver that has analysed the pattern before. The rivals take turns of about [`VISIT`] each, so that what slows
//! the machine for a while slows all, and a slow one waits until the others have had as much time. A turn begins with
//! passes that are not timed, and is cut into samples long enough for the clock. Least times are compared; medians stand
//! beside them.
//!
//! A solver of this workspace takes the matrix as it is assembled; where it is a library's, the copy into the library's
//! format is timed. LAPACK takes it as a band, the filling of which is not timed. A solve with refinement is that of the
//! step itself, residual from the pieces included, by the step's own clock.
//!
//! Forward errors are those of the multipliers against the KKT system in extended precision, backward errors those of
//! the system that was solved.

mod case;
mod rival;
mod study;
mod table;
mod timing;

pub use case::{Case, Joint, System};
pub use rival::Rival;
pub(crate) use study::STUDY;

use crate::cases::Cases;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use taut_ground::choice::Omission;
use taut_integrator::StepError;
use taut_output::check::ExperimentError;
use timing::Contestant;

/// Time of a rival's turn.
pub const VISIT: Duration = Duration::from_millis(1);

/// Rows beyond which the dense solver, whose cost is cubic, is left out.
pub const DENSE_ROWS: usize = taut_ground::matrix::solve::DENSE_ROWS;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Numbers of segments.
    pub segments: Vec<usize>,
    /// Mass ratios load/segment.
    pub ratios: Vec<f64>,
    /// Joints between the segments.
    pub joints: Vec<Joint>,
    /// Who solves.
    pub rivals: Vec<Rival>,
    /// Time that each rival gets in each case; those whose pass is longer get at least five samples.
    pub share: Duration,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            segments: vec![24, 100, 1000, 10_000],
            ratios: vec![1e3],
            joints: Joint::ALL.to_vec(),
            rivals: Rival::all(),
            share: Duration::from_millis(150),
        }
    }
}

impl Config {
    /// A twentieth of the work: 24 and 100 segments.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            segments: vec![24, 100],
            share: Duration::from_millis(15),
            ..Self::default()
        }
    }
}

/// One row: a rival on a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// Joints, ends included: block rows of S.
    pub joints: usize,
    /// Rows of a joint between segments.
    pub joint_rows: usize,
    /// Who solves, without iterations.
    pub solver: String,
    /// All its options, as the command line reads them.
    pub options: String,
    /// Cables, or right-hand sides of one cable, that a pass solves.
    pub cables: usize,
    /// Factorisation and solve for each joint of each cable or right-hand side, least of the samples \[ns].
    pub ns_per_joint: f64,
    /// The same, median.
    pub ns_per_joint_median: f64,
    /// `ns_per_joint` over that of `banded` in the same case; none where that was not run.
    pub ratio: Option<f64>,
    /// `ns_per_joint_median` over that of `banded`.
    pub ratio_median: Option<f64>,
    pub samples: usize,
    /// Normwise backward error on the system that was solved, S or the KKT matrix; of several cables the largest.
    pub backward_error: f64,
    /// Componentwise backward error, likewise.
    pub backward_error_componentwise: f64,
    /// ‖μ − μ*‖∞ / ‖μ*‖∞ of the multipliers against the KKT system in extended precision; of several cables that of the
    /// first.
    pub forward_error: f64,
    /// Reason for missing numbers if the solver failed: they are null in JSON. Without it null
    /// means not measured.
    pub error: Option<String>,
}

/// All rows, and what is missing.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Rows: segments, ratios, joints, rivals in the order asked for.
    pub records: Vec<Record>,
    #[serde(skip)]
    pub omissions: Vec<Omission>,
}

/// Runs all rivals on all cases, case by case.
///
/// # Errors
/// A scene that cannot be built or has no reference; a rival's own failure is a row.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let mut hoists = Vec::new();
    for &segments in &config.segments {
        for &ratio in &config.ratios {
            hoists.extend(config.joints.iter().map(|&joint| (segments, ratio, joint)));
        }
    }
    // Each has its time, which a pass of a long cable exceeds.
    let parts = cases.in_turn("rivals", &hoists, |&(segments, ratio, joint)| {
        let case = Case::new(joint, segments, ratio)?;
        let (rivals, omissions) = taking_part(&config.rivals, &case);
        Ok::<_, StepError>((rows(&case, &rivals, config.share), omissions))
    })?;
    let mut results = Results::default();
    for (records, omissions) in parts.all()? {
        results.records.extend(records);
        let new = |o: &Omission| !results.omissions.contains(o);
        let new: Vec<Omission> = omissions.into_iter().filter(new).collect();
        results.omissions.extend(new);
    }
    Ok(results)
}

/// Rivals that take part in a case, and reasons against the others.
fn taking_part<'a>(rivals: &'a [Rival], case: &Case) -> (Vec<&'a Rival>, Vec<Omission>) {
    let (mut present, mut omissions) = (Vec::new(), Vec::new());
    for rival in rivals {
        let rows = case.schur().0.dim();
        let reason = match rival.check() {
            Err(e) => Some(e.to_string()),
            Ok(()) if rival.is_dense() && rows > DENSE_ROWS => {
                Some(format!("cubic cost beyond {DENSE_ROWS} rows"))
            }
            Ok(()) => None,
        };
        match reason {
            None => present.push(rival),
            Some(reason) => omissions.push(Omission {
                backend: rival.family(),
                reason,
            }),
        }
    }
    (present, omissions)
}

fn rows(case: &Case, rivals: &[&Rival], share: Duration) -> Vec<Record> {
    let prepare = |rival: &&Rival| Contestant::new(case, rival);
    let mut contestants: Vec<_> = rivals.iter().map(prepare).collect();
    timing::in_turns(&mut contestants, share);
    let rows = rivals.iter().zip(&contestants);
    let mut rows: Vec<Record> = rows.map(|(rival, c)| row(case, rival, c)).collect();
    let ours = rows.iter().find(|r| r.options == "banded");
    let ours = ours.map(|r| (r.ns_per_joint, r.ns_per_joint_median));
    if let Some((least, median)) = ours {
        for row in &mut rows {
            row.ratio = Some(row.ns_per_joint / least);
            row.ratio_median = Some(row.ns_per_joint_median / median);
        }
    }
    rows
}

fn row(case: &Case, rival: &Rival, contestant: &Contestant<'_>) -> Record {
    let joints = case.schur().0.pattern().blocks();
    let mut row = Record {
        segments: case.segments(),
        mass_ratio: case.mass_ratio(),
        joints,
        joint_rows: case.joint().rows(),
        solver: rival.family(),
        options: rival.to_string(),
        cables: rival.cables(),
        ns_per_joint: f64::NAN,
        ns_per_joint_median: f64::NAN,
        ratio: None,
        ratio_median: None,
        samples: contestant.samples(),
        backward_error: f64::NAN,
        backward_error_componentwise: f64::NAN,
        forward_error: f64::NAN,
        error: None,
    };
    match contestant.measured() {
        Err(e) => row.error = Some(e.to_string()),
        Ok((errors, time)) => {
            let each = (joints * rival.cables()) as f64;
            row.ns_per_joint = time.least / each;
            row.ns_per_joint_median = time.median / each;
            row.backward_error = errors.backward.normwise;
            row.backward_error_componentwise = errors.backward.componentwise;
            row.forward_error = errors.forward;
        }
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_ground::Choice;

    fn small(rivals: Vec<Rival>) -> Config {
        Config {
            segments: vec![7, 24],
            rivals,
            share: Duration::from_millis(1),
            ..Config::default()
        }
    }

    #[test]
    fn every_rival_has_times_and_errors() {
        let config = small(Rival::all());
        let results = run(&config, &Cases::default()).unwrap();
        let compiled = config.rivals.iter().filter(|r| r.check().is_ok());
        assert_eq!(results.records.len(), 6 * compiled.count());
        for r in &results.records {
            assert_eq!(r.error, None, "{r:?}");
            assert_eq!(r.joints, r.segments + 1);
            assert!(r.samples >= timing::LEAST_SAMPLES, "{r:?}");
            let (least, median) = (r.ns_per_joint, r.ns_per_joint_median);
            assert!(
                least > 0.0 && least <= median && median.is_finite(),
                "{r:?}"
            );
            assert!(r.backward_error < 1e-13, "{r:?}");
            assert!(r.forward_error < 1e-9, "{r:?}");
            if r.options == "banded" {
                assert!(r.backward_error_componentwise <= 1e-15, "{r:?}");
            }
            if r.options == "banded+refine" {
                assert!(r.forward_error < 1e-15, "{r:?}");
            }
        }
        let refined = "banded+refine".parse::<Rival>().unwrap();
        assert_eq!(refined.check().is_ok(), cfg!(feature = "banded"));
    }

    /// Ratios are to `banded` of the same case, and none without it.
    #[test]
    fn ratios_are_to_banded() {
        let names = ["dense", "banded"].map(|name| name.parse::<Rival>().unwrap());
        let results = run(&small(names.to_vec()), &Cases::default()).unwrap();
        let has_banded = cfg!(feature = "banded");
        for r in &results.records {
            assert_eq!(r.ratio.is_some(), has_banded, "{r:?}");
            assert!(
                r.ratio
                    .is_none_or(|x| (x == 1.0) == (r.options == "banded"))
            );
        }
    }

    #[test]
    fn what_cannot_take_part_is_left_out_with_its_reason() {
        let dense: Choice = "dense".parse().unwrap();
        let rivals = [Rival::Solver(dense), "faer:llt".parse().unwrap()];
        let case = Case::new(Joint::Cosserat, 300, 10.0).unwrap();
        let (present, omissions) = taking_part(&rivals, &case);
        assert_eq!(present.len(), usize::from(cfg!(feature = "faer")));
        assert!(omissions[0].reason.contains("cubic"), "{omissions:?}");
    }
}
