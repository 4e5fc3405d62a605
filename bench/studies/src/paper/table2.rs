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
//! top is iterated for. A sweep then leaves M/(M_top + M) = ½ of the error, whatever the ratio ([`Ends::Heavy`]). Where
//! the top is light and the load's joint the one apart ([`Ends::Light`]), k sweeps leave that joint open by
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
pub use rows::{ROWS, Row};

use super::search::{Found, largest};
use super::words;
use crate::checks::each;
use crate::options::pick;
use crate::stability::predicted_limit;
use indicatif::ProgressBar;
use serde::Serialize;
use std::fmt;
use taut_ground::reference::most_gap;
use taut_ground::trajectory::{Failure, simulate};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{
    Apart, CrossSection, Hoist, HoistParams, JointKind, Material, SceneError, Stiffness,
    TwistDefinition,
};
use taut_output::check::{ExperimentError, Outcome, csv};
use taut_solver::{Backend, CgOptions, GaussSeidelOptions, Partition, Preconditioner, Start};

/// Acceleration of gravity of the paper \[m/s²].
pub const GRAVITY: f64 = 10.0;
/// Δt of the paper \[s].
pub const DT: f64 = 1.0 / 60.0;
/// Length of the cables \[m]: that of the paper's specimens, since Table II has none.
pub const LENGTH: f64 = 1.0;

/// Joint, seeds and step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Setting {
    /// The paper's joint and step, nothing out of the plane.
    Planar(TwistDefinition),
    /// The paper's joint and step with angular velocities of up to 10⁻⁶ rad/s in all directions.
    Seeded(TwistDefinition),
    /// The paper's step with the Cosserat joint, seeds of up to 10⁻³ rad/s.
    Cosserat,
    /// The default scheme with its geometric stiffness, without guard; Cosserat joint, seeds of up to 10⁻³ rad/s.
    Stiffened,
}

/// The paper's own joint as it was used there.
const PAPER: Setting = Setting::ALL[0];

impl Setting {
    /// All, in the order of the tables.
    pub const ALL: [Self; 6] = [
        Self::Planar(TwistDefinition::Alternative),
        Self::Planar(TwistDefinition::Ordinary),
        Self::Seeded(TwistDefinition::Alternative),
        Self::Seeded(TwistDefinition::Ordinary),
        Self::Cosserat,
        Self::Stiffened,
    ];

    fn seed_rate(self) -> f64 {
        match self {
            Self::Planar(_) => 0.0,
            Self::Seeded(_) => 1e-6,
            Self::Cosserat | Self::Stiffened => 1e-3,
        }
    }

    fn joint(self) -> (JointKind, TwistDefinition) {
        match self {
            Self::Planar(twist) | Self::Seeded(twist) => (JointKind::Paper, twist),
            Self::Cosserat | Self::Stiffened => (JointKind::Cosserat, TwistDefinition::Ordinary),
        }
    }

    fn options(self, backend: Backend) -> StepOptions {
        let base = match self {
            Self::Stiffened => StepOptions {
                guard: None,
                ..StepOptions::default()
            },
            _ => StepOptions::paper(),
        };
        StepOptions {
            dt: DT,
            refinements: usize::from(!backend.is_iterative()),
            backend,
            ..base
        }
    }
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let twist = match self.joint().1 {
            TwistDefinition::Ordinary => "ord.",
            _ => "alt.",
        };
        match self {
            Self::Planar(_) => write!(f, "planar {twist}"),
            Self::Seeded(_) => write!(f, "seeded {twist}"),
            Self::Cosserat => f.write_str("Cosserat"),
            Self::Stiffened => f.write_str("K"),
        }
    }
}

/// Masses of the ends, and what Gauss–Seidel iterates for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ends {
    /// The uppermost segment as heavy as the load, the anchor apart: the paper.
    Heavy,
    /// The uppermost segment as light as the others, the load's joint apart.
    Light,
}

impl fmt::Display for Ends {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(["heavy ends", "light top"][*self as usize])
    }
}

/// How the multipliers are solved for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Solver {
    /// So many sweeps of Gauss–Seidel over the groups from their own solutions \[SL Algorithm 1].
    Sweeps(usize),
    /// So many sweeps from the last step's multipliers.
    WarmSweeps(usize),
    /// Conjugate gradient preconditioned by the groups, tolerance 10⁻¹⁰.
    Cg,
    /// Banded factorisation.
    Direct,
}

impl Solver {
    /// Solvers of the tables.
    pub const ALL: [Self; 4] = [Self::Sweeps(3), Self::Sweeps(20), Self::Cg, Self::Direct];

    fn backend(self) -> Backend {
        match self {
            Self::Sweeps(n) => sweeps(n, Start::Trial),
            Self::WarmSweeps(n) => sweeps(n, Start::Guess),
            Self::Cg => Backend::ConjugateGradient(CgOptions {
                preconditioner: Preconditioner::Group,
                tolerance: 1e-10,
                ..CgOptions::default()
            }),
            Self::Direct => Backend::Banded,
        }
    }
}

/// Gauss–Seidel over the groups.
pub(super) fn sweeps(iterations: usize, start: Start) -> Backend {
    Backend::GaussSeidel(GaussSeidelOptions {
        partition: Partition::Groups,
        start,
        iterations,
        ..GaussSeidelOptions::default()
    })
}

impl fmt::Display for Solver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sweeps(n) => write!(f, "Gauss–Seidel, {n} iterations"),
            Self::WarmSweeps(n) => write!(f, "Gauss–Seidel, {n} iterations, warm start"),
            Self::Cg => f.write_str("conjugate gradient"),
            Self::Direct => f.write_str("direct"),
        }
    }
}

/// One cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// The paper's row.
    pub row: Row,
    /// Length of the cable \[m].
    pub length: f64,
    pub ends: Ends,
    pub setting: Setting,
    pub solver: Solver,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// The cells.
    pub cases: Vec<Case>,
    /// Simulated time of each run \[s].
    pub time: f64,
    /// Highest decade tried.
    pub decades: u32,
    /// Steps a decade that the limit is refined to: a power of two.
    pub per_decade: u32,
}

/// Cells of all rows, settings and solvers.
fn product(
    rows: &[Row],
    (length, ends): (f64, Ends),
    settings: &[Setting],
    solvers: &[Solver],
) -> Vec<Case> {
    let mut cases = Vec::new();
    for &row in rows {
        for &setting in settings {
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

/// The paper's masses at a length of one metre.
const HEAVY: (f64, Ends) = (LENGTH, Ends::Heavy);
const LIGHT: (f64, Ends) = (LENGTH, Ends::Light);
const SWEEPS: [Solver; 2] = [Solver::Sweeps(3), Solver::Sweeps(20)];

impl Config {
    /// All rows with all settings and solvers for 30 s, up to 10⁸; the sweeps with a light top, and two rows from the last
    /// step's multipliers; and the paper's own joint at the length that fits its column best. Quick two rows of six
    /// segments, 5 s, whole decades.
    pub fn new(quick: bool) -> Self {
        let rows = pick(quick, [ROWS.to_vec(), vec![ROWS[5], ROWS[7]]]);
        let mut cases = product(&rows, HEAVY, &Setting::ALL, &Solver::ALL);
        cases.extend(product(&rows, LIGHT, &[PAPER, Setting::Stiffened], &SWEEPS));
        if !quick {
            let warm = [Solver::WarmSweeps(3), Solver::WarmSweeps(20)];
            cases.extend(product(&[ROWS[2], ROWS[7]], HEAVY, &[PAPER], &warm));
            let fitted = (rows::fitted_length(), Ends::Heavy);
            let solvers = [Solver::Sweeps(20), Solver::Direct];
            cases.extend(product(&ROWS, fitted, &[PAPER], &solvers));
        }
        Self {
            cases,
            time: pick(quick, [30.0, 5.0]),
            decades: 8,
            per_decade: pick(quick, [4, 1]),
        }
    }
}

/// The sweeps of the paper's joint in the plane, with heavy ends and with a light top, and the direct solver beside them.
pub(super) fn sweeps_only(rows: &[Row]) -> Config {
    let [few, many] = SWEEPS;
    let mut cases = product(rows, HEAVY, &[PAPER], &[few, many, Solver::Direct]);
    cases.extend(product(rows, LIGHT, &[PAPER], &SWEEPS));
    Config {
        cases,
        ..Config::new(false)
    }
}

/// Result for a cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    #[serde(skip)]
    pub case: Case,
    /// Young's modulus Y \[GN/m²].
    pub young_gpa: f64,
    /// ζ = A/I_a \[1/m²].
    pub zeta_per_m2: f64,
    pub segments: usize,
    /// The paper's ratio, as read.
    pub paper: f64,
    /// Length of the cable \[m].
    pub length_m: f64,
    pub ends: String,
    pub setting: String,
    pub solver: String,
    /// Largest stable ratio; `None` where 1 is unstable.
    pub stable: Option<f64>,
    /// The largest ratio tried is stable.
    pub capped: bool,
    /// When the first unstable ratio of the search above it failed \[s].
    pub failure_time_s: Option<f64>,
    pub failure: Option<String>,
    /// Euler's load of the cable, as a ratio.
    pub euler: f64,
    /// [`predicted_limit`] of the explicit tension, with the twist row's share of bending where it has one; `None` with
    /// geometric stiffness.
    pub predicted: Option<f64>,
}

/// The hoist of a cell at a mass ratio.
fn params(case: &Case, ratio: f64) -> HoistParams {
    let (row, length) = (case.row, case.length);
    let is_heavy = case.ends == Ends::Heavy;
    let area = row.area();
    let side = area.sqrt();
    let law = Material {
        young: row.young * 1e9,
        ..Material::STEEL
    };
    let Stiffness { ea, ei, gj } = Stiffness::new(&law, &CrossSection::Square { side });
    let (joint, twist_definition) = case.setting.joint();
    let rate = case.setting.seed_rate();
    let segment_mass = law.density * area * length / row.segments as f64;
    HoistParams {
        segments: row.segments,
        length,
        segment_mass: Some(segment_mass),
        mass_ratio: ratio,
        top_mass: is_heavy.then_some(ratio * segment_mass),
        apart: if is_heavy { Apart::Anchor } else { Apart::Load },
        gravity: GRAVITY,
        // The disc with the square's moments of inertia.
        radius: Some(side / 3.0_f64.sqrt()),
        ea: Some(ea),
        ei: Some(ei),
        gj: Some(gj),
        joint,
        twist_definition,
        seed: u64::from(rate > 0.0),
        seed_rate: rate,
        move_x: 0.5 * length,
        move_duration: 1.0,
        ..HoistParams::default()
    }
}

/// How and when a run becomes unstable.
fn fails(case: &Case, ratio: f64, time: f64) -> Result<Option<Failure>, StepError> {
    let params = params(case, ratio);
    let limit = most_gap(&params)?;
    let options = case.setting.options(case.solver.backend());
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    Ok(simulate(&mut stepper, time, limit, |_| ()).failure)
}

/// The alternative twist angle measures bending in the plane of the motion: its stiffness adds to that of bending.
fn bending_hoist(case: &Case) -> Result<Hoist, SceneError> {
    let mut hoist = params(case, 1.0).resolve()?;
    if case.setting.joint() == (JointKind::Paper, TwistDefinition::Alternative) {
        hoist.stiffness.ei += hoist.stiffness.gj;
    }
    Ok(hoist)
}

fn record(case: &Case, found: Found<Failure>) -> Result<Record, StepError> {
    let explicit = case.setting != Setting::Stiffened;
    let hoist = bending_hoist(case)?;
    let capped = found.failure.is_none();
    let (failure_time_s, failure) = found.failure.map(|f| (f.time, f.reason)).unzip();
    Ok(Record {
        case: *case,
        young_gpa: case.row.young,
        zeta_per_m2: case.row.zeta,
        segments: case.row.segments,
        paper: case.row.ratio,
        length_m: case.length,
        ends: case.ends.to_string(),
        setting: case.setting.to_string(),
        solver: case.solver.to_string(),
        stable: found.stable.map(|decade| 10.0_f64.powf(decade)),
        capped,
        failure_time_s,
        failure,
        euler: case.row.euler(case.length),
        predicted: explicit.then(|| predicted_limit(&hoist, GRAVITY, DT, true)),
    })
}

/// Searches every cell, in parallel. `progress` advances once for each.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Record>, StepError> {
    let widths = [
        f64::from(config.decades),
        1.0,
        1.0 / f64::from(config.per_decade),
    ];
    each(&config.cases, progress, |case| {
        let fails = |decade| fails(case, 10.0_f64.powf(decade), config.time);
        record(case, largest(widths, fails)?)
    })
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let config = Config::new(quick);
    let records = run(&config, progress)?;
    let charts = report::charts(&records);
    let (checks, text) = (checks(&records, &config), text_tables(&records, &config));
    Ok(words::outcome(checks, text, csv(&records)?, charts))
}
