//! Whole engines on the hoist: what one frame of 1/60 s costs, and how wrong the motion is.
//!
//! Every engine goes through the same two motions ([`motion`]): the cable at rest, whose elongation is known, and a
//! swing, compared with our own step at 1/7680 s. Ours run at one step a frame and at a few sub-steps. The rivals are
//! given the cheapest setting that keeps both errors within the bar: each has ladders of settings, cheapest first, and
//! of each ladder the first that does is taken. Masses, lengths, gravity, stiffness and start are the same; the rivals
//! have no bending and no torsion, which a cable that swings straight does not ask for, and nothing collides or sleeps.
//!
//! | module | holds |
//! |---|---|
//! | `motion` | the two motions and their reference |
//! | `ours` | our step in its settings |
//! | `leapfrog` | the explicit rival: point masses and springs |
//! | `rapier` | the physics engine Rapier: soft rope, impulse joints, multibody (feature `rapier`) |
//! | `search` | a run of a setting, the cheapest within the bar |
//! | `table` | text tables |

pub mod leapfrog;
pub mod motion;
mod ours;
#[cfg(feature = "rapier")]
mod rapier;
mod search;
mod table;

pub use search::{Outcome, Setting};
pub use table::tables;

use indicatif::ProgressBar;
use motion::Motion;
use nalgebra::Vector3;
use serde::Serialize;
use taut_integrator::StepError;
use taut_model::HoistParams;

/// One frame of a run: the load's position after it, or why there is none \[m].
pub type Frame = Box<dyn FnMut() -> Result<Vector3<f64>, String>>;

/// An engine and its settings.
pub struct Engine {
    /// Its name in the tables.
    pub name: &'static str,
    /// Settings, ladder by ladder, each of them from the cheapest to the dearest.
    pub ladders: Vec<Vec<Setting>>,
    /// Whether every setting is a row. Else the cheapest within the bar is the only one.
    pub all: bool,
}

/// What the sweep runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Numbers of segments.
    pub segments: Vec<usize>,
    /// Mass ratios load/segment.
    pub ratios: Vec<f64>,
    /// Angle that the swing starts at \[rad].
    pub angle: f64,
    /// Simulated time of the swing \[s].
    pub time: f64,
    /// Errors that a rival's setting has to keep, over the cable's length.
    pub bar: f64,
    /// Settings whose frame takes longer are not searched any further \[ns].
    pub longest_ns: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            segments: vec![24, 100],
            ratios: vec![1e3, 1e5],
            angle: 0.3,
            time: 6.5,
            bar: 0.01,
            longest_ns: 2e7,
        }
    }
}

impl Config {
    /// The shorter cable, a third of the swing, no setting beyond 2 ms a frame: a look at it.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            segments: vec![24],
            time: 2.0,
            longest_ns: 2e6,
            ..Self::default()
        }
    }
}

/// One row: an engine in a setting on a cable.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// The engine.
    pub engine: String,
    /// Its setting.
    pub setting: String,
    /// Whether the setting was searched for.
    pub searched: bool,
    /// Settings tried.
    pub tried: usize,
    /// Errors and times.
    #[serde(flatten)]
    pub outcome: Outcome,
    /// Whether both errors are within the bar.
    pub within: bool,
    /// Minimum of a frame over the joints, segments + 1 \[ns].
    pub ns_per_joint: f64,
    /// Minimum of a frame over that of our default.
    pub over_ours: f64,
    /// What the reference differs by from that with half as many sub-steps, over the cable's length.
    pub reference_error: f64,
}

/// Runs the sweep, one engine at a time.
///
/// # Errors
/// Scenes or options that are not sound. Runs that end early are results.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Record>, StepError> {
    let mut records: Vec<Record> = Vec::new();
    progress.set_length((config.segments.len() * config.ratios.len() * engines().len()) as u64);
    for &segments in &config.segments {
        for &mass_ratio in &config.ratios {
            let scene = search::Cable::new(config, segments, mass_ratio)?;
            let mut ours = f64::NAN;
            for engine in engines() {
                progress.set_message(engine.name);
                for mut record in search::rows(config, &scene, &engine)? {
                    if ours.is_nan() {
                        ours = record.outcome.frame_ns_min;
                    }
                    record.over_ours = record.outcome.frame_ns_min / ours;
                    records.push(record);
                }
                progress.inc(1);
            }
        }
    }
    Ok(records)
}

/// All engines that are compiled in; ours come first, and the first of their settings is the default.
fn engines() -> Vec<Engine> {
    #[allow(unused_mut)] // without the feature
    let mut engines = vec![ours::engine(), leapfrog_engine()];
    #[cfg(feature = "rapier")]
    engines.extend(rapier::engines());
    engines
}

/// Sub-steps from `least` to `most`, doubling.
fn doubling(least: usize, most: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(least), move |n| (2 * n <= most).then_some(2 * n))
}

fn leapfrog_engine() -> Engine {
    let setting = |substeps: usize| Setting {
        text: format!("{substeps} sub-steps"),
        substeps,
        start: Box::new(move |motion: &Motion| {
            let dt = motion::FRAME / substeps as f64;
            let mut chain = leapfrog::Leapfrog::new(&motion.points()?, motion.params.gravity, dt);
            Ok(Box::new(move || {
                chain.advance(dt, substeps);
                Ok(chain.load())
            }))
        }),
    };
    Engine {
        name: "leapfrog, point masses",
        ladders: vec![doubling(1, 4096).map(setting).collect()],
        all: false,
    }
}

/// The hoist that all engines run: 10 m, segments of 1 kg, YA = 2·10⁷ N.
fn params(segments: usize, mass_ratio: f64) -> HoistParams {
    HoistParams {
        segments,
        mass_ratio,
        ..HoistParams::default()
    }
}
