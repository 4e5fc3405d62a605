//! H51: what stiff joints come to as ε → 0, and ε = 0.
//!
//! Where J has full rank nothing is singular at ε = 0: S(ε) = S₀ + ε/(w Δt²) is regular there and
//!
//! ```text
//! μ(ε) = μ₀ − ε S₀⁻¹ μ₀/(w Δt²) + O(ε²)
//! ```
//!
//! so that multipliers are bounded, continuous and differ from the rigid ones by a multiple of ε. Measured on the bent
//! rigid hoist with its joints shut: multipliers of one step over ten decades of ε with every solver, against its own
//! at ε = 0; the rigid ones against 32 digits; and the place of the load after a second of swing.

use crate::hard::{grid, solvers, together, worse};
use indicatif::ProgressBar;
use rayon::prelude::*;
use taut_ground::choice::Choice;
use taut_ground::pace;
use taut_ground::trajectory::load_position;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Constraint, HoistParams, JointKind, RowLaw, Scene, SceneError};
use taut_output::check::{Check, ExperimentError, Measure, Outcome};
use taut_output::table::error;
use taut_solver::{SolveReport, forward_error, norm_inf};

/// Error of the rigid multipliers against 32 digits.
pub const BAR: f64 = 1e-8;

/// How far the order of the difference in ε may be from 1.
const ORDER_BAR: f64 = 0.05;

/// Compliances \[m/N].
const COMPLIANCES: [f64; 11] = [
    1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15, 1e-16,
];

/// Differences below this, over the multipliers, are rounding.
const RESOLVED: f64 = 1e-9;

const DT: f64 = 1.0 / 60.0;

/// The hoist with spherical joints of that compliance, unstrained, turned aside, in motion.
///
/// # Errors
/// Parameters out of range.
pub fn scene(compliance: f64) -> Result<Scene, SceneError> {
    let params = HoistParams {
        segments: 6,
        mass_ratio: 20.0,
        joint: JointKind::Spherical,
        initial_angle: 0.5,
        seed: 5,
        ..HoistParams::default()
    };
    let mut scene = params.build()?;
    for constraint in &mut scene.constraints {
        if let Constraint::Spherical(joint) = constraint {
            joint.stretch = RowLaw::new(compliance, 0.0);
        }
    }
    scene.name = format!("ε = {compliance:.0e}");
    scene.validate()?;
    Ok(scene)
}

/// Hoists that are stiff, stiffer, rigid.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let all = [1e-8, 1e-12, 1e-16, 0.0].into_iter().map(scene);
    Ok(all.collect::<Result<_, _>>()?)
}

/// A solver over the compliances.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    pub backend: String,
    /// ‖μ(ε) − μ(0)‖ / ‖μ(0)‖ of its own multipliers, for each compliance.
    pub differences: Vec<f64>,
    /// Largest ‖μ(ε)‖ / ‖μ(0)‖.
    pub largest: f64,
    /// Error of its rigid multipliers against 32 digits.
    pub error: f64,
    /// Report of the rigid solve.
    pub said: SolveReport,
    /// The solver claims all of its solves.
    pub claimed: bool,
}

fn multipliers(
    options: &StepOptions,
    compliance: f64,
) -> Result<(Vec<f64>, SolveReport), StepError> {
    let mut stepper = Stepper::new(scene(compliance)?, options.clone())?;
    let report = stepper.solve()?;
    Ok((stepper.multipliers().to_vec(), report.solve))
}

/// The limit of a solver on the paper's step, whose system is that of the joints alone.
///
/// # Errors
/// A solve that fails.
pub fn limit(choice: &Choice) -> Result<Limit, StepError> {
    let own = choice.plain_options(DT);
    let options = StepOptions {
        form: own.form,
        backend: own.backend,
        refinements: own.refinements,
        guard: None,
        dt: DT,
        ..StepOptions::paper()
    };
    let (rigid, said) = multipliers(&options, 0.0)?;
    let mut claimed = said.is_claim();
    let exact = Stepper::new(scene(0.0)?, options.clone())?.reference_multipliers()?;
    let (mut differences, mut largest) = (Vec::new(), 0.0_f64);
    for compliance in COMPLIANCES {
        let (mu, of_it) = multipliers(&options, compliance)?;
        claimed &= of_it.is_claim();
        differences.push(forward_error(&mu, &rigid));
        largest = worse(largest, norm_inf(&mu) / norm_inf(&rigid));
    }
    Ok(Limit {
        backend: choice.family(),
        differences,
        largest,
        error: forward_error(&rigid, &exact),
        said,
        claimed,
    })
}

/// The order of differences in ε: the slope over the decades that are resolved, farthest from 1.
fn order(compliances: &[f64], differences: &[f64], resolved: f64) -> f64 {
    let pairs: Vec<(f64, f64)> = compliances
        .iter()
        .copied()
        .zip(differences.iter().copied())
        .filter(|(_, d)| *d > resolved && *d < 1e-2)
        .collect();
    let slopes = pairs
        .windows(2)
        .map(|w| (w[0].1 / w[1].1).ln() / (w[0].0 / w[1].0).ln());
    slopes
        .max_by(|a, b| (a - 1.0).abs().total_cmp(&(b - 1.0).abs()))
        .unwrap_or(f64::NAN)
}

/// Load positions after a second for each compliance and for none, as distances from that for none \[m].
fn motion(quick: bool) -> Result<Vec<(f64, f64)>, StepError> {
    let place = |compliance: f64| -> Result<_, StepError> {
        let mut stepper = Stepper::new(scene(compliance)?, StepOptions::default())?;
        for _ in 0..taut_ground::trajectory::steps_in(1.0, DT) {
            pace::step(&mut stepper)?;
        }
        Ok(load_position(stepper.scene()))
    };
    let rigid = place(0.0)?;
    let some = COMPLIANCES.iter().step_by(if quick { 2 } else { 1 });
    let all = some.map(|&c| Ok((c, (place(c)? - rigid).norm())));
    all.collect()
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let choices = solvers();
    progress.set_length(choices.len() as u64);
    let found: Vec<(String, Result<Limit, StepError>)> = choices
        .par_iter()
        .map(|choice| {
            let limit = limit(choice);
            progress.inc(1);
            (choice.family(), limit)
        })
        .collect();
    let groups = [
        ("order in ε", slope as fn(&Limit) -> Check),
        ("bounded", bounded),
        ("ε = 0", rigid),
    ];
    let mut checks = Vec::new();
    for (case, judge) in groups {
        let own = found.iter().map(|(backend, limit)| {
            let check = match limit {
                Ok(limit) => judge(limit),
                Err(e) => Check::failed("", "", &e),
            };
            (backend.clone(), check)
        });
        checks.extend(together(case, own.collect()));
    }
    let moved = motion(quick)?;
    let (compliances, ways): (Vec<f64>, Vec<f64>) = moved.iter().copied().unzip();
    let slope = order(&compliances, &ways, 1e-11);
    checks.push(
        Check::number(
            "load after 1 s: order in ε",
            [1.0, slope],
            "",
            Measure::Absolute,
            ORDER_BAR,
        )
        .by("slope of the distance from the rigid run between decades of ε, the farthest from 1"),
    );
    let limits: Vec<&Limit> = found.iter().filter_map(|(_, l)| l.as_ref().ok()).collect();

    Ok(Outcome {
        checks,
        text: tables(&limits, &moved),
        ..Outcome::default()
    })
}

fn tables(limits: &[&Limit], moved: &[(f64, f64)]) -> String {
    let heads = COMPLIANCES.map(|c| format!("{c:.0e}"));
    let mut rows: Vec<(String, Vec<String>)> = Vec::new();
    for l in limits {
        let cells = l.differences.iter().map(|d| error(Some(*d)));
        rows.push((l.backend.clone(), cells.collect()));
    }
    let moved = COMPLIANCES.map(|c| error(moved.iter().find(|m| m.0 == c).map(|m| m.1)));
    rows.push(("load after 1 s [m]".to_owned(), moved.to_vec()));
    grid("‖μ(ε) − μ(0)‖/‖μ(0)‖", &heads, rows) + "\n"
}

fn slope(l: &Limit) -> Check {
    let slope = order(&COMPLIANCES, &l.differences, RESOLVED);
    Check::number("", [1.0, slope], "", Measure::Absolute, ORDER_BAR)
        .by("slope of ‖μ(ε) − μ(0)‖ between decades of ε above rounding, the farthest from 1")
}

fn bounded(l: &Limit) -> Check {
    let beyond = worse(0.0, l.largest - 1.0);
    let ours = format!("‖μ(ε)‖ ≤ {:.6} ‖μ(0)‖", l.largest);
    Check::within("", "bounded", ours, beyond, 1e-2).by("largest ‖μ(ε)‖/‖μ(0)‖ less 1")
}

fn rigid(l: &Limit) -> Check {
    Check::off("", "32 digits", l.error, "", BAR)
        .by("error of the rigid multipliers")
        .unless_claimed(&l.said)
}
