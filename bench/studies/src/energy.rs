//! Conservation by the schemes: the swing of a load over a minute, the energy over a million steps,
//! the angular momentum of a free cable.
//!
//! | module | holds |
//! |---|---|
//! | `swing` | amplitude of the load after 5 s and after 60 s |
//! | `band` | energy over many steps: the width of its band, and whether the band drifts |
//! | `spin` | angular momentum of a free, taut, spinning cable, with its order in Δt |

mod band;
mod spin;
mod study;
mod swing;
mod table;

pub use band::{Band, BandCase};
pub use spin::{Spin, free_cable};
pub(crate) use study::STUDY;
pub use swing::{Amplitude, Pendulum, Swing, pendulum};
pub use table::text_tables;

use crate::cases::Cases;
use serde::{Deserialize, Serialize};
use taut_integrator::{GeometricStiffness, Guard, Scheme, StepOptions};
use taut_model::HoistParams;
use taut_output::check::ExperimentError;

/// A scheme with its geometric stiffness.
pub type Setting = (Scheme, GeometricStiffness);

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Segments of the swinging cables.
    pub segments: usize,
    /// Their mass ratios load/segment.
    pub ratios: Vec<f64>,
    /// Schemes of all three experiments; the swing's have the guard on, the free cable's have it off.
    pub settings: Vec<Setting>,
    /// Swings at Δt and, with the default scheme, at Δt/`finer`.
    pub finer: usize,
    /// Times at which the amplitudes are taken \[s].
    pub moments: [f64; 2],
    /// Cases of the energy band.
    pub bands: Vec<BandCase>,
    /// Steps of the energy band.
    pub steps: usize,
    /// Time steps of the free cable \[s], descending.
    pub spin_dts: Vec<f64>,
    /// Simulated time of the free cable \[s].
    pub spin_time: f64,
    /// Δt elsewhere \[s].
    pub dt: f64,
}

/// The three schemes with their geometric stiffness.
fn settings() -> Vec<Setting> {
    [Scheme::default(), Scheme::Spook, Scheme::LinearlyImplicit]
        .map(|scheme| (scheme, GeometricStiffness::inertia(scheme.default_alpha())))
        .to_vec()
}

impl Default for Config {
    fn default() -> Self {
        let case = |segments, mass_ratio, (scheme, stiffness), guarded, seeded| BandCase {
            segments,
            mass_ratio,
            scheme,
            stiffness,
            guarded,
            seeded,
        };
        let settings = settings();
        let (third, spook) = (settings[0], settings[1]);
        let bands = vec![
            case(24, 1e2, third, true, true),
            case(24, 1e4, third, true, true),
            case(24, 1e6, third, true, true),
            case(6, 1e2, third, true, true),
            case(6, 1e4, third, true, true),
            case(6, 1e4, third, false, false),
            case(6, 1e4, spook, false, false),
            case(24, 1e4, spook, false, false),
            case(6, 1e4, spook, true, true),
        ];
        Self {
            segments: 24,
            ratios: vec![1e2, 1e4, 1e6],
            settings,
            finer: 8,
            moments: [5.0, 60.0],
            bands,
            steps: 1_000_000,
            spin_dts: [60.0, 120.0, 240.0, 480.0].map(|f| 1.0 / f).to_vec(),
            spin_time: 10.0,
            dt: 1.0 / 60.0,
        }
    }
}

impl Config {
    /// One ratio, six segments, 20 000 steps.
    #[must_use]
    pub fn quick() -> Self {
        let full = Self::default();
        let bands = full.bands.into_iter().filter(|b| b.segments == 6);
        Self {
            segments: 6,
            ratios: vec![1e4],
            bands: bands.collect(),
            finer: 4,
            steps: 20_000,
            spin_dts: full.spin_dts[..2].to_vec(),
            spin_time: 2.0,
            ..full
        }
    }
}

/// The rows of the three experiments.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    pub swings: Vec<Swing>,
    /// Energy bands.
    pub bands: Vec<Band>,
    /// Free cables.
    pub spins: Vec<Spin>,
}

/// The scene of the swing and of the energy band: a hanging cable whose anchor moves by 0.5 m within 2 s.
fn moved(segments: usize, mass_ratio: f64, seeded: bool) -> HoistParams {
    HoistParams {
        segments,
        mass_ratio,
        seed: u64::from(seeded),
        move_x: MOVE,
        move_duration: MOVE_TIME,
        ..HoistParams::default()
    }
}

const MOVE: f64 = 0.5;
const MOVE_TIME: f64 = 2.0;

fn options((scheme, stiffness): Setting, dt: f64, guarded: bool) -> StepOptions {
    StepOptions {
        dt,
        scheme,
        stiffness,
        guard: guarded.then(Guard::default),
        ..StepOptions::default()
    }
}

/// One run of one of the experiments.
#[derive(Debug)]
enum Task<'a> {
    Swing(f64, Setting, usize),
    Band(&'a BandCase),
    Spin(Setting, f64),
}

#[derive(Serialize, Deserialize)]
enum Row {
    Swing(Swing),
    Band(Band),
    Spin(Spin),
}

/// Runs the three experiments, in parallel, each run a case.
///
/// # Errors
/// Unsound scenes or options. An unstable run is not an error.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    // The longest runs come first.
    let mut tasks: Vec<Task<'_>> = config.bands.iter().map(Task::Band).collect();
    for &ratio in &config.ratios {
        tasks.push(Task::Swing(ratio, config.settings[0], config.finer));
        let coarse = config.settings.iter();
        tasks.extend(coarse.map(|&setting| Task::Swing(ratio, setting, 1)));
    }
    for &setting in &config.settings {
        let dts = config.spin_dts.iter();
        tasks.extend(dts.map(|&dt| Task::Spin(setting, dt)));
    }
    let rows = cases.parallel("runs", &tasks, |task| match *task {
        Task::Swing(ratio, setting, finer) => {
            swing::run(config, ratio, setting, finer).map(Row::Swing)
        }
        Task::Band(case) => band::run(case, config.steps, config.dt, cases.bar()).map(Row::Band),
        Task::Spin(setting, dt) => spin::run(setting, dt, config.spin_time).map(Row::Spin),
    })?;
    let mut results = Results::default();
    for row in rows.all()? {
        match row {
            Row::Swing(r) => results.swings.push(r),
            Row::Band(r) => results.bands.push(r),
            Row::Spin(r) => results.spins.push(r),
        }
    }
    swing::compare(&mut results.swings);
    spin::orders(&mut results.spins);
    Ok(results)
}
