//! H40: the ladder of mass ratios, from loads of one cable element to loads of 10¹⁰.
//!
//! First a chain of N particles whose last one is the load, without compliance, which has a formula for everything
//! ([`chain`]): conditions and sweeps of Gauss–Seidel are predicted and measured, conjugate gradient, which in exact
//! arithmetic needs N iterations, is counted. Then the errors of every solver on the hanging and the bent hoist against
//! 32 digits, with and without the one refinement of the default step ([`crate::linear`] says what to expect), and a
//! minute of swing.

pub mod chain;

use crate::check::{Check, ExperimentError, Outcome, Verdict, csv};
use crate::energy::pendulum;
use crate::hard::dynamics::law;
use crate::hard::numerics::extended_solution;
use crate::hard::{together, worse};
use crate::linear::{self, Record};
use crate::poses::Pose;
use crate::table::{error, table, text};
use crate::trajectory::{Sample, simulate};
use chain::{Chain, Row};
use indicatif::ProgressBar;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Write;
use taut_integrator::{Form, StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Scene, SceneError};
use taut_solver::{SymBlockMatrix, forward_error};

/// Elements of the chain and of the hoists.
pub const ELEMENTS: usize = 24;

/// What KKT forms are to reach at every ratio.
pub const KKT_BAR: f64 = 1e-13;

/// Unit roundoff u.
const ROUNDOFF: f64 = 0.5 * f64::EPSILON;

/// Distance of the change of a swing's amplitude in a minute from its law, where the motion is that of a pendulum alone.
const SWING_BAR: f64 = 1e-5;

/// What a free swing may gain of energy in a minute, over the largest kinetic energy.
const GAIN_BAR: f64 = 1e-5;

/// Most that waves of the cable may add to it, where the load does not outweigh the cable.
const MOST_WAVES: f64 = 1e-2;

/// Relative bars of predicted conditions and sweeps.
const CONDITION_BAR: f64 = 1e-5;
const SWEEPS_BAR: f64 = 0.05;

/// Seconds of the swing, and by how much the anchor moves in the first two \[s, m].
const SWING: f64 = 60.0;
const EARLY: f64 = 5.0;
const MOVE: f64 = 0.5;

/// Compliances over Δt² of the capped chains, and their mass ratio \[1/kg].
const CAPS: [f64; 3] = [1e-6, 1e-4, 1e-2];
const CAPPED_RATIO: f64 = 1e5;

fn ratios(quick: bool) -> Vec<f64> {
    let step = if quick { 5 } else { 1 };
    (0..=10).step_by(step).map(|k| 10_f64.powi(k)).collect()
}

/// The hoist of a ratio, of a material that bears it.
fn params(ratio: f64) -> Result<HoistParams, SceneError> {
    linear::Config::default().params(ELEMENTS, ratio)
}

/// Bent hoists over the ladder.
///
/// # Errors
/// As [`HoistParams::resolve`].
pub fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let of = |ratio: f64| {
        let mut scene = crate::poses::hoist(&params(ratio)?, Pose::Bent)?;
        scene.name = format!("R = {ratio:.0e}");
        Ok(scene)
    };
    [1.0, 1e3, 1e5, 1e8, 1e10].into_iter().map(of).collect()
}

/// The checks of H40.
///
/// # Errors
/// A scene that cannot be built, or one without a reference.
pub fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let most_sweeps = if quick { 20_000 } else { 400_000 };
    let ratios = ratios(quick);
    let chains: Vec<Row> = ratios
        .par_iter()
        .map(|&ratio| chain::measure(&Chain::new(ELEMENTS, ratio, 0.0), most_sweeps))
        .collect::<Result<_, StepError>>()?;
    let capped: Vec<Row> = CAPS
        .par_iter()
        .map(|&cap| chain::measure(&Chain::new(ELEMENTS, CAPPED_RATIO, cap), most_sweeps))
        .collect::<Result<_, StepError>>()?;
    let config = linear::Config {
        segments: vec![ELEMENTS],
        poses: vec![Pose::Straight, Pose::Bent],
        refinements: vec![0, 1, 2],
        ratios: ratios.clone(),
        ..linear::Config::default()
    };
    let records = linear::run(&config, progress)?;
    let conditions: Vec<Condition> = ratios
        .par_iter()
        .flat_map(|&ratio| [Pose::Straight, Pose::Bent].map(|pose| (ratio, pose)))
        .map(|(ratio, pose)| condition(ratio, pose))
        .collect::<Result<_, StepError>>()?;
    // All of the ladder, for where it ends is what is judged.
    let singles: Vec<Single> = self::ratios(false)
        .into_par_iter()
        .flat_map(|ratio| [Pose::Straight, Pose::Bent].map(|pose| (ratio, pose)))
        .map(|(ratio, pose)| single(ratio, pose))
        .collect::<Result<_, _>>()?;
    let swings: Vec<Swing> = ratios
        .par_iter()
        .map(|&r| swing(r))
        .collect::<Result<_, _>>()?;
    let mut checks = predicted(&chains, &capped);
    checks.extend(accurate(&records, &conditions));
    checks.extend(in_single_precision(&singles));
    checks.extend(swings.iter().flat_map(|s| [s.check(), s.energy()]));
    let mut out = chain_table(&chains, &capped);
    for refinements in [0, 1, 2] {
        let _ = writeln!(
            out,
            "\nErrors of the multipliers against 32 digits, larger of the poses, {refinements} refinements, over R"
        );
        out.push_str(&error_table(&records, &conditions, refinements, &ratios));
    }
    out.push('\n');
    Ok(Outcome {
        checks,
        text: out,
        csv: csv(&chains)?,
        more_csv: vec![("errors.csv", csv(&records)?), ("swing.csv", csv(&swings)?)],
        ..Outcome::default()
    })
}

/// How far the formulas hold.
fn predicted(chains: &[Row], capped: &[Row]) -> Vec<Check> {
    let worst = |rows: &[Row], of: fn(&Row) -> f64| rows.iter().map(of).fold(0.0, worse);
    let shown = |e: f64| format!("(1 ± {e:.0e})");
    let off = |found: f64, predicted: f64| (found / predicted - 1.0).abs();
    let condition = worst(chains, |r| {
        (r.condition / r.predicted_condition - 1.0).abs()
    });
    let sweeps = worst(chains, |r| (r.sweeps / r.predicted_sweeps - 1.0).abs());
    let multipliers = worst(chains, |r| r.multipliers_error);
    let mut checks = vec![
        Check::within(
            "chain: condition",
            "4 N R + 2 N (N − 1)".to_owned(),
            shown(condition),
            condition,
            CONDITION_BAR,
        )
        .by("largest relative deviation over R; S has rounded 1 + 1/R"),
        Check::within(
            "chain: Gauss-Seidel",
            "ln 10⁶ / (−2 ln cos θ)".to_owned(),
            shown(sweeps),
            sweeps,
            SWEEPS_BAR,
        )
        .by("largest relative deviation over R of the sweeps to 10⁻⁶"),
        Check::within(
            "chain: multipliers",
            "λᵢ = g Σ m".to_owned(),
            shown(multipliers),
            multipliers,
            KKT_BAR,
        )
        .by("32 digits against the formula, relative"),
    ];
    checks.push(finite_termination(chains));
    for r in capped {
        let error = off(r.condition, r.predicted_condition);
        checks.push(
            Check::within(
                format!("chain: R = 1e5, ε/Δt² = {:.0e}", r.cap),
                format!("{:.1e}", r.predicted_condition),
                format!("{:.1e}", r.condition),
                error,
                CAP_BAR,
            )
            .by("condition against 1/(1/κ₀ + σ/4): both limits are exact, between them it is a mean"),
        );
        let error = off(r.sweeps, r.predicted_sweeps);
        checks.push(
            Check::within(
                format!("chain: R = 1e5, ε/Δt² = {:.0e}: Gauss-Seidel", r.cap),
                format!("{:.3e} sweeps", r.predicted_sweeps),
                format!("{:.3e}", r.sweeps),
                error,
                SWEEPS_BAR,
            )
            .by("sweeps to 10⁻⁶ against what is left of the slowest mode, from its rate and its share"),
        );
    }
    checks
}

/// Conjugate gradient, plain and scaled, ends after as many iterations as there are eigenvalues, at every ratio.
fn finite_termination(chains: &[Row]) -> Check {
    let counts = chains.iter().flat_map(|r| [r.cg, r.cg_jacobi]);
    // One that did not end has no count.
    let most = counts
        .map(|n| n.map_or(f64::INFINITY, |n| n as f64))
        .fold(0.0, worse);
    Check::within(
        "chain: conjugate gradient",
        format!("at most N = {ELEMENTS}"),
        format!("{most}"),
        most,
        ELEMENTS as f64,
    )
    .by("most iterations to 10⁻⁶ of the multipliers over R, none and jacobi")
}

/// Relative bar of a capped condition.
const CAP_BAR: f64 = 0.1;

/// Direct solvers against the bars: S 10 u R, unrefined and as the step refines it; KKT forms, as the step refines them,
/// 10⁻¹³.
fn accurate(records: &[Record], conditions: &[Condition]) -> Vec<Check> {
    let direct = || records.iter().filter(|r| r.direct);
    let mut backends: Vec<&str> = Vec::new();
    for r in direct() {
        if !backends.contains(&r.backend.as_str()) {
            backends.push(&r.backend);
        }
    }
    let over = |backend: &str, refinements: usize, bar: fn(f64) -> f64| {
        let own = direct().filter(move |r| r.backend == backend && r.refinements == refinements);
        own.max_by(|a, b| {
            let size = |r: &Record| r.forward_error.abs() / bar(r.mass_ratio);
            size(a).total_cmp(&size(b))
        })
        .map(|r| {
            let relative = r.forward_error / bar(r.mass_ratio);
            let ours = format!(
                "{:.1e} at R = {:.0e}, {}",
                r.forward_error, r.mass_ratio, r.pose
            );
            let mut check = Check::within("", String::new(), ours, relative, 1.0);
            check.note = r.error.clone().unwrap_or_default();
            (backend.to_owned(), check)
        })
    };
    let group = |case: &str, kkt: bool, refinements: usize, bar: fn(f64) -> f64, said: &str| {
        let own = backends.iter().filter(|b| b.ends_with("/kkt") == kkt);
        let rows = own.filter_map(|b| over(b, refinements, bar)).map(|(b, c)| {
            let c = Check {
                reference: said.to_owned(),
                ..c.by(
                    "error of the multipliers against 32 digits over the bar, the largest over R",
                )
            };
            (b, c)
        });
        together(case, rows.collect())
    };
    let formed = |ratio: f64| 10.0 * ROUNDOFF * ratio.max(1.0);
    let exact = |_: f64| KKT_BAR;
    let mut checks = group("S, unrefined", false, 0, formed, "10 u R");
    for check in checks.iter_mut().filter(|c| c.verdict == Verdict::Fail) {
        explain(check, records, conditions);
    }
    checks.extend(group("S, 1 refinement", false, 1, formed, "10 u R"));
    let mut kkt = group("KKT, 1 refinement", true, 1, exact, "1e-13");
    for check in kkt.iter_mut().filter(|c| c.verdict == Verdict::Fail) {
        square(check, records);
    }
    checks.extend(kkt);
    checks
}

/// Why one refinement is not enough, in the figures of the same solver with none and with two. No more than that: an
/// error within twice the square, of a solver that two refinements bring within the bar, is a limit.
fn square(check: &mut Check, records: &[Record]) {
    let worst = |refinements: usize| {
        let own = records.iter().filter(|r| {
            r.refinements == refinements && check.case.ends_with(&format!(": {}", r.backend))
        });
        own.map(|r| r.forward_error).fold(0.0, worse)
    };
    let (none, one, two) = (worst(0), worst(1), worst(2));
    if one <= 2.0 * none * none && two <= KKT_BAR {
        check.verdict = Verdict::Limit;
    }
    let _ = write!(
        check.note,
        "a refinement leaves the square of what it begins with, {none:.1e}² = {:.1e}: without pivoting S is formed on \
         the way, and has lost its u R; two refinements leave {two:.1e}",
        none * none
    );
}

/// 10 u R leaves out the part of the condition that has no R in it. What a stable solver leaves of S, whose entries are
/// rounded when it is formed, is a multiple of u κ(S), S scaled to a diagonal of 1, which
/// elimination without pivoting does not notice: within u κ of each hoist's own S a miss is none of the solver's,
/// and from the ratio on where R outweighs that part the bar has to hold.
fn explain(check: &mut Check, records: &[Record], conditions: &[Condition]) {
    let unrefined = |r: &&Record| r.direct && r.refinements == 0 && !r.backend.ends_with("/kkt");
    let own = records
        .iter()
        .filter(unrefined)
        .filter(|r| check.case.ends_with(&format!(": {}", r.backend)));
    let of = |r: &Record| {
        let here = |c: &&Condition| c.ratio == r.mass_ratio && c.pose == r.pose;
        conditions
            .iter()
            .find(here)
            .map_or(f64::NAN, |c| c.condition)
    };
    let of_stable = |r: &Record| r.forward_error / (ROUNDOFF * of(r));
    let stable = own.clone().map(of_stable).fold(0.0, worse);
    let heavy = |r: &&Record| r.mass_ratio >= HEAVY;
    let of_bar = |r: &Record| r.forward_error / (10.0 * ROUNDOFF * r.mass_ratio);
    let worst = own.clone().filter(heavy).map(of_bar).fold(0.0, worse);
    if stable <= 1.0 && worst <= 1.0 {
        check.verdict = Verdict::Limit;
    }
    let light = conditions.iter().filter(|c| c.ratio == 1.0);
    let light = light.map(|c| c.condition).fold(0.0, worse);
    let _ = write!(
        check.note,
        "the bar has R for κ, and κ of S with a diagonal of 1 is {light:.1e} at R = 1: at all ratios the error is at most {stable:.1e} of u κ, \
         from R = {HEAVY:.0e} on at most {worst:.1e} of the bar; the default step refines"
    );
}

/// The ratio from which on R outweighs the length in the condition.
const HEAVY: f64 = 1e3;

/// The condition of a hoist's S.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Condition {
    ratio: f64,
    pose: Pose,
    /// ‖S‖∞ ‖S⁻¹‖∞ of S scaled to a diagonal of 1.
    condition: f64,
}

/// The condition of S of a hoist, its inverse column by column in 32 digits.
fn condition(ratio: f64, pose: Pose) -> Result<Condition, StepError> {
    let scene = crate::poses::hoist(&params(ratio)?, pose)?;
    let mut stepper = Stepper::new(scene, linear::Config::default().step)?;
    // Which linearises.
    stepper.reference_multipliers()?;
    let (s, _) = stepper.assembled(Form::Schur)?;
    let n = s.dim();
    // Rows of metres and of radians side by side: the scale is none of the problem's.
    let scale: Vec<f64> = (0..n).map(|i| s.get(i, i).sqrt().recip()).collect();
    let mut rows = vec![0.0; n];
    s.for_each_lower(|r, c, a| {
        let size = (scale[r] * a * scale[c]).abs();
        rows[r] += size;
        if r != c {
            rows[c] += size;
        }
    });
    let mut sums = vec![0.0; n];
    for column in 0..n {
        let mut unit = vec![0.0; n];
        unit[column] = 1.0;
        let inverse = extended_solution(&s, &unit).map_err(|source| StepError::Solve {
            source,
            culprit: None,
            time: 0.0,
        })?;
        for ((sum, x), d) in sums.iter_mut().zip(inverse).zip(&scale) {
            *sum += (x / (d * scale[column])).abs();
        }
    }
    Ok(Condition {
        ratio,
        pose,
        condition: [rows, sums]
            .into_iter()
            .map(|sums| sums.into_iter().fold(0.0, worse))
            .product(),
    })
}

fn chain_table(chains: &[Row], capped: &[Row]) -> String {
    let mut out = format!(
        "Chain of {ELEMENTS} particles, R: load/element; κ in the ∞-norm; sweeps of Gauss-Seidel and iterations of\n\
         CG to 10⁻⁶ of the multipliers from zero, ~: extrapolated from the rate measured over the sweeps made\n"
    );
    let mut t = table(&[
        "R",
        "load/cable",
        "ε/Δt²",
        "κ formula",
        "κ",
        "sweeps formula",
        "sweeps",
        "CG",
        "CG jacobi",
    ]);
    let count = |n: Option<usize>| n.map_or_else(|| "-".to_owned(), |n| n.to_string());
    for r in chains.iter().chain(capped) {
        let mark = if r.extrapolated { "~" } else { "" };
        t.add_row([
            format!("{:.0e}", r.ratio),
            format!("{:.1e}", r.ratio / (ELEMENTS - 1) as f64),
            format!("{:.0e}", r.cap),
            format!("{:.3e}", r.predicted_condition),
            format!("{:.3e}", r.condition),
            format!("{:.2e}", r.predicted_sweeps),
            format!("{mark}{:.2e}", r.sweeps),
            count(r.cg),
            count(r.cg_jacobi),
        ]);
    }
    out.push_str(&text(&t));
    out
}

fn error_table(
    records: &[Record],
    conditions: &[Condition],
    refinements: usize,
    ratios: &[f64],
) -> String {
    let heads: Vec<String> = ratios.iter().map(|r| format!("{r:.0e}")).collect();
    let mut header = vec!["solver"];
    header.extend(heads.iter().map(String::as_str));
    let mut t = table(&header);
    let own = || records.iter().filter(|r| r.refinements == refinements);
    let mut backends: Vec<&str> = Vec::new();
    for r in own().filter(|r| r.direct || refinements == 0) {
        if !backends.contains(&r.backend.as_str()) {
            backends.push(&r.backend);
        }
    }
    let mut row = vec!["κ∞ of S, scaled".to_owned()];
    for &ratio in ratios {
        let here = conditions.iter().filter(|c| c.ratio == ratio);
        row.push(error(Some(here.map(|c| c.condition).fold(0.0, worse))));
    }
    t.add_row(row);
    for backend in backends {
        let mut row = vec![backend.to_owned()];
        for &ratio in ratios {
            let here = own().filter(|r| r.backend == backend && r.mass_ratio == ratio);
            let worst = here.map(|r| r.forward_error.abs()).max_by(f64::total_cmp);
            row.push(error(worst));
        }
        t.add_row(row);
    }
    text(&t)
}

/// The KKT matrix in single precision, by LU with partial pivoting: errors of the solution against 32 digits, without
/// and with one refinement of residuals in double.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Single {
    ratio: f64,
    pose: Pose,
    errors: [f64; 2],
}

fn single(ratio: f64, pose: Pose) -> Result<Single, StepError> {
    let scene = crate::poses::hoist(&params(ratio)?, pose)?;
    let mut stepper = Stepper::new(scene, StepOptions::default())?;
    // Which linearises.
    stepper.reference_multipliers()?;
    let (a, b) = stepper.assembled(Form::Kkt)?;
    let exact = extended_solution(&a, &b).map_err(|source| StepError::Solve {
        source,
        culprit: None,
        time: 0.0,
    })?;
    let n = a.dim();
    let scale = equilibration(&a);
    let factors = DMatrix::from_fn(n, n, |r, c| (scale[r] * a.get(r, c) * scale[c]) as f32).lu();
    let (mut x, mut residual) = (vec![0.0; n], b.clone());
    let mut errors = [f64::NAN; 2];
    for error in &mut errors {
        let scaled = residual.iter().zip(&scale).map(|(r, s)| (r * s) as f32);
        let right = DVector::from_iterator(n, scaled);
        let Some(correction) = factors.solve(&right) else {
            break;
        };
        for ((x, d), s) in x.iter_mut().zip(correction.iter()).zip(&scale) {
            *x += f64::from(*d) * s;
        }
        *error = forward_error(&x, &exact);
        a.subtract_product(&b, &x, &mut residual);
    }
    Ok(Single {
        ratio,
        pose,
        errors,
    })
}

/// Scales s with the largest entry of each row of s_r A_rc s_c near 1, masses and levers of single precision's range;
/// powers of two, which round nothing (Ruiz 2001).
fn equilibration(a: &SymBlockMatrix) -> Vec<f64> {
    let mut scale = vec![1.0_f64; a.dim()];
    for _ in 0..ROUNDS {
        let mut largest = vec![0.0_f64; a.dim()];
        a.for_each_lower(|r, c, x| {
            let size = (scale[r] * x * scale[c]).abs();
            largest[r] = largest[r].max(size);
            largest[c] = largest[c].max(size);
        });
        for (s, m) in scale.iter_mut().zip(&largest) {
            *s *= (-0.5 * m.log2()).round().exp2();
        }
    }
    scale
}

/// Rounds of [`equilibration`].
const ROUNDS: usize = 10;

/// What single precision is to reach on the KKT matrix at every ratio.
const SINGLE_BAR: f64 = 1e-6;

/// The ratio up to which what forming S on the way loses, u R of single precision, is still brought back by one
/// refinement.
const SINGLE_RATIO: f64 = 1e4;

fn in_single_precision(singles: &[Single]) -> Vec<Check> {
    let row = |pose: Pose| {
        let own = || singles.iter().filter(|s| s.pose == pose);
        let size = |s: &&Single| s.errors[1].abs();
        let worst = own().max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let unrefined = own().map(|s| s.errors[0]).fold(0.0, worse);
        let mut check = Check::within(
            format!("KKT in single precision, 1 refinement, {pose}"),
            "32 digits".to_owned(),
            format!("{:.1e} at R = {:.0e}", worst.errors[1], worst.ratio),
            worst.errors[1],
            SINGLE_BAR,
        )
        .by("largest error of the solution over R, dense LU with partial pivoting, residual in double, relative, ∞-norm");
        check.note = format!("unrefined {unrefined:.1e}");
        // One that is no number misses.
        let misses = own().filter(|s| s.errors[1].is_nan() || s.errors[1] > SINGLE_BAR);
        let first = misses.map(|s| s.ratio).fold(f64::INFINITY, f64::min);
        // A refinement multiplies the error by what it begins with.
        let squared = |s: &Single| s.errors[1] <= 2.0 * s.errors[0].powi(2);
        let beyond = own().filter(|s| s.errors[1] > SINGLE_BAR || s.errors[1].is_nan());
        if check.verdict == Verdict::Fail && first > SINGLE_RATIO && beyond.clone().all(squared) {
            check.verdict = Verdict::Limit;
            let _ = write!(
                check.note,
                "; within the bar below R = {first:.0e}; a refinement leaves the square of what it begins with, here {:.1e}² = \
                 {:.1e}",
                worst.errors[0],
                worst.errors[0].powi(2)
            );
        }
        Some(check)
    };
    let poses = [Pose::Straight, Pose::Bent];
    poses.into_iter().filter_map(row).collect()
}

/// A minute of the default step.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Swing {
    ratio: f64,
    /// Amplitude after [`EARLY`] and at the end \[m]; none of a run that was lost.
    early_m: Option<f64>,
    late_m: Option<f64>,
    /// What of the first is not of the pendulum's frequency \[m].
    rest_m: Option<f64>,
    /// Change of the amplitude in between as the scheme's law has it, relative.
    damped: f64,
    /// Mean energy at the end less that after [`EARLY`], over the largest kinetic energy.
    gain: f64,
    /// Steps that the guard redid.
    redone: usize,
    failure: Option<String>,
}

fn swing(ratio: f64) -> Result<Swing, StepError> {
    let params = HoistParams {
        seed: 1,
        move_x: MOVE,
        move_duration: 2.0,
        ..params(ratio)?
    };
    let options = StepOptions::default();
    let (dt, scheme) = (options.dt, options.scheme);
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    let length = params.length + params.exact_elongation();
    let rate = (params.gravity / length).sqrt();
    let kept = law::modulus(scheme, rate * dt);
    let periods = 2.0 * std::f64::consts::TAU / rate;
    let run = simulate(&mut stepper, SWING + periods + dt, params.length, |_| {});
    let x: Vec<f64> = run.samples.iter().map(|s| s.load.x - MOVE).collect();
    let at = |moment| pendulum(&x, dt, moment, rate);
    Ok(Swing {
        ratio,
        early_m: at(EARLY).map(|p| p.amplitude),
        late_m: at(SWING).map(|p| p.amplitude),
        rest_m: at(EARLY).map(|p| p.rest),
        damped: kept.powf((SWING - EARLY) / dt) - 1.0,
        gain: gain(&run.samples, periods),
        redone: run.samples.iter().filter(|s| s.redone).count(),
        failure: run
            .failure
            .map(|f| format!("{} at {:.2} s", f.reason, f.time)),
    })
}

/// What a swing gains of energy once nothing drives it: the means of two windows of `time` (s); NaN of one that ended
/// before.
fn gain(samples: &[Sample], time: f64) -> f64 {
    let window = |from: f64| {
        samples
            .iter()
            .filter(move |s| (from..from + time).contains(&s.time))
    };
    let mean = |from: f64| {
        let sum: f64 = window(from).map(|s| s.energy.total()).sum();
        sum / window(from).count() as f64
    };
    let kinetic = window(EARLY).map(|s| s.energy.kinetic).fold(0.0, worse);
    (mean(SWING) - mean(EARLY)) / kinetic
}

impl Swing {
    /// No energy comes from anywhere.
    fn energy(&self) -> Check {
        let ours = format!("{:+.1e}", self.gain);
        let case = format!("swing for {SWING} s, R = {:.0e}: energy", self.ratio);
        Check::within(case, "no gain".to_owned(), ours, self.gain, GAIN_BAR)
            .by("mean energy of two periods after 60 s less that after 5 s, over the largest kinetic energy")
    }

    fn check(&self) -> Check {
        let case = format!("swing for {SWING} s, R = {:.0e}", self.ratio);
        let reference = "stays whole";
        match (&self.failure, self.early_m, self.late_m, self.rest_m) {
            (None, Some(early), Some(late), Some(rest)) => {
                let change = late / early - 1.0;
                let waves = rest / early;
                let bar = SWING_BAR + waves.min(MOST_WAVES);
                let ours = format!("amplitude {change:+.1e}");
                let reference = format!("{:+.1e}", self.damped);
                Check::within(case, reference, ours, (change - self.damped).abs(), bar)
                    .by("relative change of the amplitude from 5 s on, less what the scheme's law damps; the bar has what \
                         waves of the cable have of the motion on top")
                    .noting(format!("waves {waves:.0e}; {} steps redone by the guard", self.redone))
            }
            (failure, ..) => {
                let why = failure.clone().unwrap_or_default();
                Check::claim(case, reference, "lost".to_owned(), Verdict::Fail, why)
            }
        }
    }
}
