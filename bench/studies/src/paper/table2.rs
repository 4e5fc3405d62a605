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
mod search;

pub(super) use report::enough;
pub use report::{charts, checks, text_tables};
pub use rows::{ROWS, Row};
pub use search::{Found, largest};

use crate::checks::each;
use crate::options::pick;
use crate::stability::predicted_limit;
use indicatif::ProgressBar;
use serde::Serialize;
use std::fmt;
use taut_ground::trajectory::{Failure, simulate};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{
    Apart, CrossSection, Hoist, HoistParams, JointKind, Material, SceneError, Stiffness,
    TwistDefinition,
};
use taut_output::check::{ExperimentError, Outcome, csv};
use taut_solver::{Backend, CgOptions, GaussSeidelOptions, Partition, Preconditioner, Start};

/// Acceleration of gravity \[m/s²] and Δt \[s] of the paper.
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

    fn options(self, solver: Solver) -> StepOptions {
        let base = match self {
            Self::Stiffened => StepOptions {
                guard: None,
                ..StepOptions::default()
            },
            _ => StepOptions::paper(),
        };
        let backend = solver.backend();
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
        let twist = |twist: &TwistDefinition| match twist {
            TwistDefinition::Ordinary => "ord.",
            TwistDefinition::Alternative => "alt.",
            _ => "other",
        };
        match self {
            Self::Planar(t) => write!(f, "planar {}", twist(t)),
            Self::Seeded(t) => write!(f, "seeded {}", twist(t)),
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
        f.write_str(match self {
            Self::Heavy => "heavy ends",
            Self::Light => "light top",
        })
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
        let sweeps = |iterations, start| {
            Backend::GaussSeidel(GaussSeidelOptions {
                partition: Partition::Groups,
                start,
                iterations,
                ..GaussSeidelOptions::default()
            })
        };
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
    /// Masses of the ends.
    pub ends: Ends,
    /// Joint, seeds, step.
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

fn product(rows: &[Row], settings: &[Setting], solvers: &[Solver]) -> Vec<Case> {
    let mut cases = Vec::new();
    for &row in rows {
        for &setting in settings {
            cases.extend(solvers.iter().map(|&solver| Case {
                row,
                length: LENGTH,
                ends: Ends::Heavy,
                setting,
                solver,
            }));
        }
    }
    cases
}

/// Sweeps with a light top: the paper's joint in the plane, and geometric stiffness.
fn light_top(rows: &[Row]) -> Vec<Case> {
    let settings = [Setting::ALL[0], Setting::Stiffened];
    let sweeps = [Solver::Sweeps(3), Solver::Sweeps(20)];
    let cases = product(rows, &settings, &sweeps).into_iter();
    let light = |case| Case {
        ends: Ends::Light,
        ..case
    };
    cases.map(light).collect()
}

impl Config {
    /// All rows with all settings and solvers for 30 s, up to 10⁸; the sweeps with a light top, and two rows from the last
    /// step's multipliers; and the paper's own joint at the length that fits its column best. Quick two rows of six
    /// segments, 5 s, whole decades.
    pub fn new(quick: bool) -> Self {
        let rows = if quick {
            vec![ROWS[5], ROWS[7]]
        } else {
            ROWS.to_vec()
        };
        let mut cases = product(&rows, &Setting::ALL, &Solver::ALL);
        cases.extend(light_top(&rows));
        if !quick {
            let paper = [Setting::ALL[0]];
            let warm = [Solver::WarmSweeps(3), Solver::WarmSweeps(20)];
            cases.extend(product(&[ROWS[2], ROWS[7]], &paper, &warm));
            let length = rows::fitted_length();
            let other = product(&ROWS, &paper, &[Solver::Sweeps(20), Solver::Direct]);
            cases.extend(other.into_iter().map(|case| Case { length, ..case }));
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
    let paper = [Setting::ALL[0]];
    let sweeps = [Solver::Sweeps(3), Solver::Sweeps(20), Solver::Direct];
    let mut cases = product(rows, &paper, &sweeps);
    cases.extend(
        light_top(rows)
            .into_iter()
            .filter(|c| c.setting == paper[0]),
    );
    Config {
        cases,
        ..Config::new(false)
    }
}

/// Result for a cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Young's modulus Y \[GN/m²].
    #[serde(rename = "young_gpa")]
    pub young: f64,
    /// ζ = A/I_a \[1/m²].
    #[serde(rename = "zeta_per_m2")]
    pub zeta: f64,
    pub segments: usize,
    /// The paper's ratio, as read.
    pub paper: f64,
    /// Length of the cable \[m].
    #[serde(rename = "length_m")]
    pub length: f64,
    /// Masses of the ends.
    pub ends: String,
    /// Joint and seeds.
    pub setting: String,
    pub solver: String,
    /// Largest stable ratio; `None` where 1 is unstable.
    pub stable: Option<f64>,
    /// The largest ratio tried is stable.
    pub capped: bool,
    /// When the first unstable ratio of the search above it failed \[s].
    #[serde(rename = "failure_time_s")]
    pub failure_time: Option<f64>,
    pub failure: Option<String>,
    /// Euler's load of the cable, as a ratio.
    pub euler: f64,
    /// [`predicted_limit`] of the explicit tension, with the twist row's share of bending where it has one; `None` with
    /// geometric stiffness.
    pub predicted: Option<f64>,
}

/// The hoist of a cell at a mass ratio.
fn params(case: &Case, ratio: f64) -> HoistParams {
    let Case {
        row,
        length,
        ends,
        setting,
        ..
    } = *case;
    let (heavy, apart) = match ends {
        Ends::Heavy => (true, Apart::Anchor),
        Ends::Light => (false, Apart::Load),
    };
    let area = row.area();
    let side = area.sqrt();
    let law = Material {
        young: row.young * 1e9,
        ..Material::STEEL
    };
    let Stiffness { ea, ei, gj } = Stiffness::new(&law, &CrossSection::Square { side });
    let (joint, twist_definition) = setting.joint();
    let rate = setting.seed_rate();
    let segment_mass = law.density * area * length / row.segments as f64;
    HoistParams {
        segments: row.segments,
        length,
        segment_mass: Some(segment_mass),
        mass_ratio: ratio,
        top_mass: heavy.then_some(ratio * segment_mass),
        apart,
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
    let limit = taut_ground::reference::most_gap(&params)?;
    let options = case.setting.options(case.solver);
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

fn record(case: &Case, found: Found) -> Result<Record, StepError> {
    let Row {
        young,
        zeta,
        segments,
        ratio,
        ..
    } = case.row;
    let explicit = case.setting != Setting::Stiffened;
    let hoist = bending_hoist(case)?;
    let (failure_time, failure) = found.failure.map(|f| (f.time, f.reason)).unzip();
    Ok(Record {
        young,
        zeta,
        segments,
        paper: ratio,
        length: case.length,
        ends: case.ends.to_string(),
        setting: case.setting.to_string(),
        solver: case.solver.to_string(),
        stable: found.stable,
        capped: found.capped,
        failure_time,
        failure,
        euler: case.row.euler(case.length),
        predicted: explicit.then(|| predicted_limit(&hoist, GRAVITY, DT, true)),
    })
}

/// Searches every cell, in parallel. `progress` advances once for each.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Record>, StepError> {
    each(&config.cases, progress, |case| {
        let fails = |ratio| fails(case, ratio, config.time);
        record(case, largest(config.decades, config.per_decade, fails)?)
    })
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let config = Config::new(quick);
    let records = run(&config, progress)?;
    Ok(Outcome {
        checks: checks(&records, &config),
        text: text_tables(&records, &config),
        csv: csv(&records)?,
        charts: charts(&records),
        ..Outcome::default()
    })
}
