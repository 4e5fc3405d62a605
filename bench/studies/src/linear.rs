//! How exact a solve is: forward errors of the multipliers against the KKT system in extended precision, for every
//! solver with 0, 1 and 2 refinements, over mass ratios up to 10¹².

use crate::study::question::*;
use crate::systems::{Asking, SolveRow, Start, State, StudyResult, collected};
use serde::{Deserialize, Serialize};
use taut_integrator::{StepError, StepOptions};
use taut_measure::choice::{Choice, Omission};
use taut_measure::poses::{self, Pose};
use taut_model::{HoistParams, SceneError};

/// Largest relative error of the multipliers for a direct solver with one refinement.
pub const BAR: f64 = 1e-12;

/// The mass ratio up to which it is to reach it.
pub const BAR_RATIO: f64 = 1e9;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub segments: Vec<usize>,
    /// Mass ratios load/segment, ascending.
    pub ratios: Vec<f64>,
    pub poses: Vec<Pose>,
    /// Largest strain of the hanging cable, without unit; ∞ for steel under every load.
    pub max_strain: f64,
    /// Solvers, refinements, and the step whose system is solved.
    pub asking: Asking,
}

impl Config {
    /// 24 and 100 segments, ratios 1 to 10¹², both poses, every solver, 0 to 2 refinements, at most 1 % of strain. Quick a
    /// fifth of the work: 24 segments and every third ratio.
    pub fn new(quick: bool) -> Self {
        let every = pick(quick, [1, 3]);
        Self {
            segments: pick(quick, [vec![24, 100], vec![24]]),
            ratios: (0..=12).step_by(every).map(|k| 10_f64.powi(k)).collect(),
            poses: vec![Pose::Straight, Pose::Bent],
            max_strain: 1e-2,
            asking: Asking {
                choices: Choice::all(),
                limits: vec![1000],
                refinements: vec![0, 1, 2],
                step: StepOptions::default(),
                targets: Vec::new(),
                starts: vec![Start::Cold],
                budget: None,
            },
        }
    }

    /// The hoist with a load of `mass_ratio` segments, its material stiff enough for it.
    pub fn params(&self, segments: usize, mass_ratio: f64) -> Result<HoistParams, SceneError> {
        let steel = HoistParams {
            segments,
            mass_ratio,
            seed: 7,
            ..HoistParams::default()
        };
        let hoist = steel.resolve()?;
        let mass = hoist.load_mass + hoist.segment_mass * segments as f64;
        let needed = steel.gravity * mass / self.max_strain;
        Ok(HoistParams {
            ea: Some(hoist.stiffness.ea.max(needed)),
            radius: Some(hoist.radius),
            segment_mass: Some(hoist.segment_mass),
            ..steel
        })
    }
}

/// What the rows of a scene share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shared {
    pub pose: Pose,
    pub segments: usize,
    pub mass_ratio: f64,
    /// Axial stiffness YA of the cable \[N].
    pub ea: f64,
}

pub type LinearRow = SolveRow<Shared>;

/// Solves every scene with every solver, in parallel, each scene a case: its rows, and which solvers have none. Rows are ordered by
/// segments, pose, ratio, solver, refinements.
pub fn run(
    config: &Config,
    cases: &Cases,
) -> Result<(Vec<LinearRow>, Vec<Omission>), ExperimentError> {
    let mut scenes = Vec::new();
    for &segments in &config.segments {
        for &pose in &config.poses {
            scenes.extend(config.ratios.iter().map(|&ratio| (segments, pose, ratio)));
        }
    }
    let rows = |&(segments, pose, mass_ratio): &(usize, Pose, f64)| {
        let params = config.params(segments, mass_ratio)?;
        let state = State::tense(poses::hoist(&params, pose)?, &config.asking.step)?;
        let shared = Shared {
            pose,
            segments,
            mass_ratio,
            ea: params.resolve()?.stiffness.ea,
        };
        Ok::<_, StepError>(config.asking.rows(&shared, &state))
    };
    collected(cases.parallel("scenes", &scenes, rows)?)
}

/// How far a direct solver with one refinement is within [`BAR`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DirectReach {
    pub backend: String,
    /// Largest ratio of the sweep up to which all errors are within the bar; `None` if the smallest
    /// one exceeds it.
    pub limit: Option<f64>,
    /// The row with the largest error up to [`BAR_RATIO`], where NaN counts as the largest.
    pub worst: LinearRow,
}

impl DirectReach {
    /// True if the bar holds at all ratios up to [`BAR_RATIO`].
    pub fn holds(&self) -> bool {
        self.worst.forward_error <= BAR
    }
}

/// The verdicts on all direct solvers with rows for one refinement and ratios up to [`BAR_RATIO`].
pub fn verdicts(records: &[LinearRow]) -> Vec<DirectReach> {
    let once = |r: &&LinearRow| r.start.is_none() && r.refinements == 1;
    let judged = || records.iter().filter(once);
    let verdict = |backend: &String| {
        let own = || judged().filter(|r| r.backend == *backend);
        let beyond = own().filter(|r| r.forward_error.is_nan() || r.forward_error > BAR);
        let ratio = |r: &LinearRow| r.of.mass_ratio;
        let beyond = beyond.map(ratio).fold(f64::INFINITY, f64::min);
        let within = own().map(ratio).filter(|ratio| *ratio < beyond);
        // `total_cmp` puts a positive NaN last; of equal errors the first row's counts.
        let size = |r: &LinearRow| r.forward_error.abs();
        let counted = own().rev().filter(|r| r.of.mass_ratio <= BAR_RATIO);
        let worst = counted.max_by(|a, b| size(a).total_cmp(&size(b)))?;
        Some(DirectReach {
            backend: backend.clone(),
            limit: within.max_by(f64::total_cmp),
            worst: worst.clone(),
        })
    };
    let backends = distinct(judged().map(|r| &r.backend));
    backends.into_iter().filter_map(verdict).collect()
}

pub(crate) const STUDY: Study = Study {
    name: "linear",
    question: question!("linear", FUNCTIONS),
    run: |matches, reporter| ask(&Asked::read(matches), reporter.cases),
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[("backend", Text(backend)), ("kept", Text(kept))];

fn ask(asked: &Asked, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = Config::new(asked.quick);
    asked.segments(&mut config.segments);
    asked.ratios(&mut config.ratios)?;
    asked.refuse_limits()?;
    config.asking.choices = asked.choices()?;
    let (records, omissions) = run(&config, cases)?;
    let step = &config.asking.step;
    let result = StudyResult {
        settings: settings(&config),
        heading: format!(
            "hoist: strain of at most {} (steel, made stiffer with the load), Δt = 1/{:.0} s, {}",
            config.max_strain,
            1.0 / step.dt,
            step.scheme
        ),
        study: &STUDY,
        rows: data(&records)?,
        conclusion: bars(&verdicts(&records)),
        omissions,
    };
    Ok(result.into())
}

fn settings(config: &Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("poses", list(&config.poses, ToString::to_string)),
        ("solvers", solvers(&config.asking.choices)),
        ("refinements", counts(&config.asking.refinements)),
        ("largest strain", number(config.max_strain)),
        ("scheme", config.asking.step.scheme.to_string()),
        ("Δt", step(config.asking.step.dt)),
    ])
}

/// The solver without its limit of iterations, which all have.
fn backend(row: &Row) -> String {
    text_of(row, "backend").to_owned()
}

fn kept(row: &Row) -> String {
    number_of(row, "limit").map_or("nowhere".to_owned(), ratio)
}

/// Which direct solvers keep the bar.
fn bars(verdicts: &[DirectReach]) -> String {
    if verdicts.is_empty() {
        return String::new();
    }
    let missed = verdicts.iter().filter(|v| !v.holds());
    let missed: Vec<&str> = missed.map(|v| v.backend.as_str()).collect();
    let all = verdicts.len();
    let who = if missed.is_empty() {
        format!("all {all} direct solvers")
    } else {
        let held = all - missed.len();
        format!(
            "{held} of {all} direct solvers, not with\n{}",
            missed.join(", ")
        )
    };
    format!(
        "\nOne refinement, ratios up to {BAR_RATIO:.0e}: errors of at most {BAR:.0e} with {who}\n{}",
        STUDY.sheet("bars").of(&verdicts)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiny() -> Config {
        Config {
            segments: vec![3, 100],
            ratios: vec![1.0, 1e6],
            ..Config::new(false)
        }
    }

    #[test]
    fn every_solver_has_its_rows_or_a_reason() {
        let config = tiny();
        let (records, omissions) = run(&config, &Cases::default()).unwrap();
        for choice in &config.asking.choices {
            let own = |segments: usize| {
                let of = |r: &&LinearRow| r.backend == choice.family() && r.of.segments == segments;
                records.iter().filter(of).count()
            };
            let omitted = omissions.iter().any(|o| o.backend == choice.family());
            let dense = choice.backend.name() == "dense";
            let per_cable = 2 * 2 * 3;
            let compiled = choice.check().is_ok();
            assert_eq!(own(3), per_cable * usize::from(compiled), "{choice}");
            assert_eq!(
                own(100),
                per_cable * usize::from(compiled && !dense),
                "{choice}"
            );
            assert_eq!(omitted, dense || !compiled, "{choice}");
        }
        for r in &records {
            assert_eq!(r.error, None, "{r:?}");
            let holds = r.forward_error.is_finite() && r.backward_error < 1.0;
            assert!(holds, "{r:?}");
            assert_eq!(r.start.is_none(), r.iterations_used == 0, "{r:?}");
        }
    }

    #[test]
    fn the_strain_stays_within_its_bound() {
        let config = Config::new(false);
        for mass_ratio in [1.0, 1e4, 1e5, 1e12] {
            let params = config.params(24, mass_ratio).unwrap();
            let hoist = params.resolve().unwrap();
            let steel = HoistParams::default().resolve().unwrap();
            assert_eq!(hoist.radius, steel.radius);
            assert_eq!(hoist.segment_mass, steel.segment_mass);
            let strain = params.exact_elongation() / params.length;
            assert!(strain <= config.max_strain, "{strain}");
            let stiffened = hoist.stiffness.ea > steel.stiffness.ea;
            assert_eq!(stiffened, mass_ratio >= 1e5, "{mass_ratio:e}");
            assert!(!stiffened || strain > 0.99 * config.max_strain, "{strain}");
        }
    }

    #[test]
    fn a_verdict_names_the_limit_and_the_worst_row() {
        let mut config = Config {
            segments: vec![2],
            ratios: vec![1.0],
            poses: vec![Pose::Bent],
            ..Config::new(false)
        };
        config.asking.refinements = vec![1];
        config.asking.choices = vec![taut_measure::reference::reference_choice()];
        let row = run(&config, &Cases::default()).unwrap().0.remove(0);
        let at = |mass_ratio: f64, forward_error: f64| {
            let mut row = LinearRow {
                forward_error,
                ..row.clone()
            };
            row.of.mass_ratio = mass_ratio;
            row
        };
        let judged = |errors: [f64; 4]| {
            let ratios = [1.0, 1e6, 1e9, 1e12];
            let records = ratios.iter().zip(errors).map(|(&r, e)| at(r, e));
            verdicts(&records.collect::<Vec<_>>()).remove(0)
        };
        let good = judged([1e-16, 1e-13, 1e-15, 1e-7]);
        assert!(good.holds() && good.limit == Some(1e9));
        assert_eq!(good.worst.of.mass_ratio, 1e6);
        let bad = judged([1e-16, 1e-11, 1e-15, 1e-7]);
        assert!(!bad.holds() && bad.limit == Some(1.0));
        let failed = judged([f64::NAN, 1e-11, 1e-15, 1e-7]);
        assert!(!failed.holds() && failed.limit.is_none());
        assert_eq!(failed.worst.of.mass_ratio, 1.0);
        // Nothing within the bar's range: nothing to say.
        assert_eq!(verdicts(&[at(1e10, 1e-16)]), []);
    }

    #[test]
    fn the_widest_table_fits_into_120_columns() {
        let config = Config {
            segments: vec![3],
            ..Config::new(false)
        };
        let (records, _) = run(&config, &Cases::default()).unwrap();
        let text = taut_output::table::plain(&STUDY.sheet("errors").text(&data(&records).unwrap()));
        let heading = text.lines().find(|l| l.contains("solver")).unwrap();
        let ratios: Vec<&str> = heading.split_whitespace().skip(1).collect();
        assert_eq!(ratios, ["1", "1000", "1e6", "1e9", "1e12"]);
        let width = text.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{text}");
        assert!(text.contains("straight, 3 segments") && text.contains("bent, 3 segments"));
    }
}
