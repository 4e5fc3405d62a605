//! Cost of one linear solve, ours beside others' in the same run: every solver factorises and
//! solves the same matrices, in [turns].

mod case;
mod entrant;

pub use case::{Case, Joint, System};
pub use entrant::{Entrant, Use};

use crate::study::question::*;
use crate::systems::{StudyResult, add_omissions, grid, taking_part, turns};
use entrant::{Errors, work};
use serde::Serialize;
use std::time::Duration;
use taut_integrator::StepError;
use taut_measure::choice::Omission;

/// Rows beyond which the dense solver, whose cost is cubic, is left out.
pub const DENSE_ROWS: usize = taut_measure::matrix::solve::DENSE_ROWS;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub segments: Vec<usize>,
    pub ratios: Vec<f64>,
    /// Joints between the segments.
    pub joints: Vec<Joint>,
    /// Who solves.
    pub entrants: Vec<Entrant>,
    /// Time that each entrant gets in each case; those whose pass is longer get at least five samples.
    pub share: Duration,
}

impl Config {
    /// Quick a twentieth of the work: 24 and 100 segments.
    pub fn new(quick: bool) -> Self {
        Self {
            segments: pick(quick, [vec![24, 100, 1000, 10_000], vec![24, 100]]),
            ratios: vec![1e3],
            joints: Joint::ALL.to_vec(),
            entrants: Entrant::all(),
            share: Duration::from_millis(pick(quick, [150, 15])),
        }
    }
}

/// All rows, and what is missing.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Rows: segments, ratios, joints, entrants in the order asked for.
    pub records: Vec<Value>,
    #[serde(skip)]
    pub omissions: Vec<Omission>,
}

pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let mut hoists = Vec::new();
    for (segments, ratio) in grid(&config.segments, &config.ratios) {
        hoists.extend(config.joints.iter().map(|&joint| (segments, ratio, joint)));
    }
    // Each has its time, which a pass of a long cable exceeds.
    let parts = cases.in_turn("entrants", &hoists, |&(segments, ratio, joint)| {
        let case = Case::new(joint, segments, ratio)?;
        let (entrants, omissions) = entrants(&config.entrants, &case);
        Ok::<_, StepError>((rows(&case, &entrants, config.share), omissions))
    })?;
    let mut results = Results::default();
    for (records, omissions) in parts.all()? {
        results.records.extend(records);
        add_omissions(&mut results.omissions, omissions);
    }
    Ok(results)
}

/// Entrants that take part in a case, and reasons against the others.
fn entrants(all: &[Entrant], case: &Case) -> (Vec<Entrant>, Vec<Omission>) {
    let rows = case.schur().0.dim();
    taking_part(all, Entrant::family, |entrant| match entrant.check() {
        Err(e) => Some(e.to_string()),
        Ok(()) if entrant.is_dense() && rows > DENSE_ROWS => {
            Some(format!("cubic cost beyond {DENSE_ROWS} rows"))
        }
        Ok(()) => None,
    })
}

/// The rows of a case. Ratios are to `banded`; none where that was not run.
fn rows(case: &Case, entrants: &[Entrant], share: Duration) -> Vec<Value> {
    let works: Vec<_> = entrants.iter().map(|entrant| work(case, entrant)).collect();
    let (errors, works): (Vec<_>, Vec<_>) = works
        .into_iter()
        .map(|prepared| match prepared {
            Ok((errors, work)) => (Some(errors), Ok(work)),
            Err(e) => (None, Err(e)),
        })
        .unzip();
    let times: Vec<_> = turns::times(works, share)
        .into_iter()
        .map(|time| time.map(|[time, ..]| time))
        .collect();
    let ours = entrants
        .iter()
        .position(|entrant| entrant.to_string() == "banded");
    let ours = ours.and_then(|k| times[k].as_ref().ok().copied());
    let joints = case.schur().0.pattern().blocks();
    let row = |((entrant, errors), time): (
        (&Entrant, Option<Errors>),
        Result<turns::Time, StepError>,
    )| {
        let known = time.as_ref().ok();
        let each = (joints * entrant.cables()) as f64;
        let errors = errors.filter(|_| known.is_some());
        json!({
            "segments": case.segments,
            "mass_ratio": case.mass_ratio,
            "joints": joints,
            "joint_rows": case.joint.rows(),
            "solver": entrant.family(),
            "options": entrant.to_string(),
            "cables": entrant.cables(),
            "ns_per_joint": known.map(|t| t.least / each),
            "ns_per_joint_median": known.map(|t| t.median / each),
            "ratio": ours.map(|ours| Some(known?.least / each / (ours.least / joints as f64))),
            "ratio_median": ours.map(|ours| Some(known?.median / each / (ours.median / joints as f64))),
            "samples": known.map_or(0, |t| t.samples),
            "backward_error": errors.map(|e| e.backward.normwise),
            "backward_error_componentwise": errors.map(|e| e.backward.componentwise),
            "forward_error": errors.map(|e| e.forward),
            "error": time.as_ref().err().map(ToString::to_string),
        })
    };
    entrants.iter().zip(errors).zip(times).map(row).collect()
}

pub(crate) const STUDY: Study = Study {
    name: "kernels",
    question: question!("kernels", FUNCTIONS),
    options: Own::augment_args,
    run: |matches, reporter| {
        let named = Own::from_arg_matches(matches)?.backends;
        ask(&Asked::read(matches), &named, reporter.cases)
    },
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[("joints", Text(joints))];

#[derive(Debug, Args)]
struct Own {
    /// Solvers: a backend with options after colons, `/kkt` for the KKT form; NAME+refine, NAME+many, lapack:lower, lapack:upper
    #[arg(long, value_delimiter = ',', value_name = "B")]
    backends: Vec<String>,
}

fn ask(asked: &Asked, named: &[String], cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = Config::new(asked.quick);
    asked.segments(&mut config.segments);
    asked.ratios(&mut config.ratios)?;
    if !named.is_empty() {
        let entrants = named.iter().map(|name| {
            let entrant: Entrant = name.parse()?;
            entrant
                .check()
                .map(|()| entrant)
                .map_err(ExperimentError::from)
        });
        config.entrants = distinct(entrants.collect::<Result<Vec<_>, _>>()?.into_iter());
    }
    let results = run(&config, cases)?;
    let result = StudyResult {
        settings: settings(&config),
        heading: "hoist: hanging at an angle, Δt = 1/60 s, one thread".to_owned(),
        study: &STUDY,
        rows: data(&results)?,
        conclusion: String::new(),
        omissions: results.omissions,
    };
    Ok(result.into())
}

fn settings(config: &Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        (
            "rows of a joint",
            list(&config.joints, |joint| joint.rows().to_string()),
        ),
        ("solvers", list(&config.entrants, ToString::to_string)),
        ("time of each", seconds(config.share.as_secs_f64())),
        ("Δt", step(1.0 / 60.0)),
        ("threads", "1".to_owned()),
    ])
}

fn joints(row: &Row) -> String {
    let count = |key| number_of(row, key).unwrap_or(f64::NAN);
    format!("{} joints of {} rows", count("joints"), count("joint_rows"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::systems::turns::LEAST_SAMPLES;
    use taut_measure::Choice;
    use taut_output::table::plain;

    fn small(entrants: Vec<Entrant>) -> Config {
        Config {
            segments: vec![7, 24],
            entrants,
            share: Duration::from_millis(1),
            ..Config::new(false)
        }
    }

    #[test]
    fn every_entrant_has_times_and_errors() {
        let config = small(Entrant::all());
        let results = run(&config, &Cases::default()).unwrap();
        let compiled = config.entrants.iter().filter(|r| r.check().is_ok());
        assert_eq!(results.records.len(), 6 * compiled.count());
        for r in &results.records {
            let number = |key: &str| r[key].as_f64().unwrap_or(f64::NAN);
            assert_eq!(r["error"], Value::Null, "{r:?}");
            assert_eq!(number("joints"), number("segments") + 1.0);
            assert!(number("samples") >= LEAST_SAMPLES as f64, "{r:?}");
            let (least, median) = (number("ns_per_joint"), number("ns_per_joint_median"));
            let holds = least > 0.0 && least <= median && median.is_finite();
            assert!(holds, "{r:?}");
            assert!(number("backward_error") < 1e-13, "{r:?}");
            assert!(number("forward_error") < 1e-9, "{r:?}");
            if r["options"] == "banded" {
                assert!(number("backward_error_componentwise") <= 1e-15, "{r:?}");
            }
            if r["options"] == "banded+refine" {
                assert!(number("forward_error") < 1e-15, "{r:?}");
            }
        }
        let refined = "banded+refine".parse::<Entrant>().unwrap();
        assert_eq!(refined.check().is_ok(), cfg!(feature = "banded"));
        let shown = plain(&STUDY.tables(&data(&results).unwrap()));
        let width = shown.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{shown}");
        assert!(shown.contains("7 segments, 8 joints of 3 rows, mass ratio 1000"));
    }

    #[test]
    fn ratios_are_to_banded() {
        let names = ["dense", "banded"].map(|name| name.parse::<Entrant>().unwrap());
        let results = run(&small(names.to_vec()), &Cases::default()).unwrap();
        let has_banded = cfg!(feature = "banded");
        for r in &results.records {
            let ratio = r["ratio"].as_f64();
            assert_eq!(ratio.is_some(), has_banded, "{r:?}");
            assert!(ratio.is_none_or(|x| (x == 1.0) == (r["options"] == "banded")));
        }
    }

    #[test]
    fn what_cannot_take_part_is_left_out_with_its_reason() {
        let dense: Choice = "dense".parse().unwrap();
        let both = [
            Entrant::Solver(dense, Use::Plain),
            "faer:llt".parse().unwrap(),
        ];
        let case = Case::new(Joint::Cosserat, 300, 10.0).unwrap();
        let (present, omissions) = entrants(&both, &case);
        assert_eq!(present.len(), usize::from(cfg!(feature = "faer")));
        assert!(omissions[0].reason.contains("cubic"), "{omissions:?}");
    }

    /// One that fails is a row with its reason, beside others that have theirs.
    #[test]
    fn a_failure_is_told_with_its_reason() {
        let case = Case::new(Joint::Spherical, 4, 10.0).unwrap();
        let entrants =
            ["dense", "gauss-seidel:iterations=0"].map(|n| n.parse::<Entrant>().unwrap());
        let rows = rows(&case, &entrants, Duration::ZERO);
        assert!(rows[0]["ns_per_joint"].is_number() && rows[1]["ns_per_joint"].is_null());
        let shown = plain(&STUDY.tables(&json!({ "records": rows })));
        assert!(shown.contains("gauss-seidel:joints failed: "), "{shown}");
    }
}
