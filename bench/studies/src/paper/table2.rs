//! Table II: the largest stable mass ratio M/m of rigid-body cables \[SL §VII-B].
//!
//! Under the tension T = M g a cable whose bending is treated implicitly and whose tension is not stays stable as long
//! as bending holds it, which for a long cable is Euler's load:
//!
//! ```text
//! M g = π² Y I_a/L²,   m = ρ A L/N   ⟹   M/m = π² Y N/(ρ g ζ L³),   ζ = A/I_a
//! ```
//!
//! so that the ratio grows as Y/ζ and as N; inertia adds what [`predicted_limit`] says.
//!
//! **What the paper's scene is** decides what Gauss–Seidel can do. "The end segments are given the mass M, whereas all
//! other segments are of mass m", and the load is an element of the cable "as this drastically increases the stability"
//! (§VIII): both ends are heavy, the cable with its load is one group, solved exactly, and only the anchor of the heavy
//! top is iterated for. A sweep then leaves M/(M_top + M) = ½ of the error, whatever the ratio ("heavy ends"). Where
//! the top is light and the load's joint the one apart ("light top"), k sweeps leave that joint open by
//! (M/m) g Δt²/k.
//!
//! The paper gives neither length nor density nor how the anchor moves: here the length is that of its §VII-A, 1 m, the
//! cable is a square one with ζ = 12/A and the density of steel, and the anchor moves by half a length in a second. A run
//! is stable by the criterion of [`crate::stability`].
//!
//! The search goes up by whole decades to the first that fails, then refines inside it to a quarter of a decade.
//! Instability is not monotone in the ratio: this is the end of the first stretch that holds, to the decade.

mod report;
mod rows;

pub(super) use report::enough;
pub use report::{checks, text_tables};
pub(super) use rows::ROWS;

use super::search::largest;
use super::{DT, GRAVITY, words};
use crate::checks::each;
use crate::options::pick;
use crate::stability::{predicted_limit, square_cable};
use indicatif::ProgressBar;
use rows::Row;
use serde_json::{Value, json};
use taut_integrator::{StepOptions, Stepper};
use taut_measure::reference::most_gap;
use taut_measure::trajectory::{Failure, simulate};
use taut_model::{Apart, HoistParams, JointKind, Material, TwistDefinition};
use taut_output::check::{ExperimentError, Outcome};
use taut_solver::Backend;

/// Length of the cables \[m]: that of the paper's specimens, since Table II has none.
const LENGTH: f64 = 1.0;

/// Name, joint, twist definition, and largest angular velocity of the seeds in all directions \[rad/s].
type Setting = (&'static str, JointKind, TwistDefinition, f64);

/// All take the paper's step but [`STIFFENED`], which takes the default scheme with its geometric stiffness, without
/// guard.
const SETTINGS: [Setting; 6] = {
    use JointKind::{Cosserat, Paper};
    use TwistDefinition::{Alternative, Ordinary};
    [
        (PAPER, Paper, Alternative, 0.0),
        (ORDINARY, Paper, Ordinary, 0.0),
        (SEEDED[0], Paper, Alternative, 1e-6),
        (SEEDED[1], Paper, Ordinary, 1e-6),
        ("Cosserat", Cosserat, Ordinary, 1e-3),
        (STIFFENED, Cosserat, Ordinary, 1e-3),
    ]
};
/// The paper's own joint as it was used there.
const PAPER: &str = "planar alt.";
const ORDINARY: &str = "planar ord.";
const SEEDED: [&str; 2] = ["seeded alt.", "seeded ord."];
const STIFFENED: &str = "K";

/// The uppermost segment as heavy as the load, the anchor apart: the paper.
const HEAVY: &str = "heavy ends";
/// The uppermost segment as light as the others, the load's joint apart.
const LIGHT: &str = "light top";

/// Names of the solvers: sweeps over the groups from their own solutions \[SL Algorithm 1], or from the last step's
/// multipliers; `words.toml` has their backends.
type Solver = &'static str;
const SOLVERS: [Solver; 4] = [SWEEPS[0], SWEEPS[1], CG, DIRECT];
const SWEEPS: [Solver; 2] = ["Gauss–Seidel, 3 iterations", "Gauss–Seidel, 20 iterations"];
const WARM_SWEEPS: [Solver; 2] = [
    "Gauss–Seidel, 3 iterations, warm start",
    "Gauss–Seidel, 20 iterations, warm start",
];
const CG: Solver = "conjugate gradient";
const DIRECT: Solver = "direct";

/// One cell; the length of the cable in m.
#[derive(Clone, Copy)]
pub struct Case {
    row: &'static Row,
    length: f64,
    ends: &'static str,
    setting: Setting,
    solver: Solver,
}

/// Cells of all rows, settings and solvers.
fn product(
    rows: &[&'static Row],
    (length, ends): (f64, &'static str),
    settings: &[&str],
    solvers: &[Solver],
) -> Vec<Case> {
    let mut cases = Vec::new();
    for &row in rows {
        for setting in SETTINGS.into_iter().filter(|s| settings.contains(&s.0)) {
            cases.extend(solvers.iter().map(|&solver| Case {
                row,
                length,
                ends,
                setting,
                solver,
            }));
        }
    }
    cases
}

/// All rows with all settings and solvers; the sweeps with a light top, and two rows from the last step's multipliers; and
/// the paper's own joint at the length that fits its column best. Quick two rows of six segments.
pub fn cases(quick: bool) -> Vec<Case> {
    let rows = pick(quick, [ROWS.iter().collect(), vec![&ROWS[5], &ROWS[7]]]);
    let (heavy, light) = ((LENGTH, HEAVY), (LENGTH, LIGHT));
    let mut cases = product(&rows, heavy, &SETTINGS.map(|s| s.0), &SOLVERS);
    cases.extend(product(&rows, light, &[PAPER, STIFFENED], &SWEEPS));
    if !quick {
        let few = [&ROWS[2], &ROWS[7]];
        cases.extend(product(&few, heavy, &[PAPER], &WARM_SWEEPS));
        let fitted = (rows::fitted_length(), HEAVY);
        cases.extend(product(&rows, fitted, &[PAPER], &[SWEEPS[1], DIRECT]));
    }
    cases
}

/// The sweeps of the paper's joint in the plane, with heavy ends and with a light top, and the direct solver beside them.
pub(super) fn sweeps_only(rows: &[&'static Row]) -> Vec<Case> {
    let [few, many] = SWEEPS;
    let mut cases = product(rows, (LENGTH, HEAVY), &[PAPER], &[few, many, DIRECT]);
    cases.extend(product(rows, (LENGTH, LIGHT), &[PAPER], &SWEEPS));
    cases
}

/// Simulated time of each run \[s], and steps a decade that a limit is refined to, a power of two.
const TIMES: [f64; 2] = [30.0, 5.0];
const PER_DECADE: [f64; 2] = [4.0, 1.0];

/// The hoist of a cell at a mass ratio.
fn params(case: &Case, ratio: f64) -> HoistParams {
    let (row, length) = (case.row, case.length);
    let is_heavy = case.ends == HEAVY;
    let material = Material {
        young: row.young * 1e9,
        ..Material::STEEL
    };
    let cable = square_cable(&material, row.area(), length, row.segments);
    let (_, joint, twist_definition, rate) = case.setting;
    let top_mass = cable.segment_mass.map(|mass| ratio * mass);
    HoistParams {
        mass_ratio: ratio,
        top_mass: top_mass.filter(|_| is_heavy),
        apart: if is_heavy { Apart::Anchor } else { Apart::Load },
        gravity: GRAVITY,
        joint,
        twist_definition,
        seed: u64::from(rate > 0.0),
        seed_rate: rate,
        move_x: 0.5 * length,
        move_duration: 1.0,
        ..cable
    }
}

/// How and when a run becomes unstable.
fn fails(case: &Case, ratio: f64, time: f64) -> Result<Option<Failure>, ExperimentError> {
    let params = params(case, ratio);
    let limit = most_gap(&params)?;
    let backend: Backend = words::backend(case.solver)?;
    let base = match case.setting.0 {
        STIFFENED => StepOptions {
            guard: None,
            ..StepOptions::default()
        },
        _ => StepOptions::paper(),
    };
    let options = StepOptions {
        dt: DT,
        refinements: usize::from(!backend.is_iterative()),
        backend,
        ..base
    };
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    Ok(simulate(&mut stepper, time, limit, |_| ()).failure)
}

/// Searches every cell up to 10⁸, in parallel: its largest stable ratio, none where 1 is unstable, and how the first one
/// above it failed.
pub fn run(
    cases: &[Case],
    quick: bool,
    progress: &ProgressBar,
) -> Result<Vec<Value>, ExperimentError> {
    let (time, steps) = (pick(quick, TIMES), pick(quick, PER_DECADE));
    each(cases, progress, |case| {
        let (stable, failure) = largest([8.0, 1.0, 1.0 / steps], |decade| {
            fails(case, 10.0_f64.powf(decade), time)
        })?;
        let (row, failure) = (case.row, failure.as_ref());
        let mut hoist = params(case, 1.0).resolve()?;
        // This angle measures bending in the plane of the motion: its stiffness adds to that of bending.
        if case.setting.2 == TwistDefinition::Alternative {
            hoist.stiffness.ei += hoist.stiffness.gj;
        }
        let is_explicit = case.setting.0 != STIFFENED;
        let predicted = is_explicit.then(|| predicted_limit(&hoist, GRAVITY, DT, true));
        Ok(json!({
            "young_gpa": row.young,
            "zeta_per_m2": row.zeta,
            "segments": row.segments,
            "paper": row.ratio,
            "length_m": case.length,
            "ends": case.ends,
            "setting": case.setting.0,
            "solver": case.solver,
            "stable": stable.map(|decade| 10.0_f64.powf(decade)),
            "capped": failure.is_none(),
            "failure_time_s": failure.map(|f| f.time),
            "failure": failure.map(|f| f.reason.as_str()),
            "euler": row.euler(case.length),
            "predicted": predicted,
        }))
    })
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let records = run(&cases(quick), quick, progress)?;
    let (checks, text) = (checks(&records, quick), text_tables(&records, quick));
    words::outcome(checks, text, &records, report::charts(&records))
}
