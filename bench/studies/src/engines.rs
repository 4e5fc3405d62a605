//! Whole engines on the hoist and on the ground: what one frame of 1/60 s costs, and how wrong the motion is.
//!
//! **On the hoist** every engine goes through the same two motions ([`taut_ground::engine::motion`]): the cable at rest,
//! whose elongation is known, and a swing, compared with our own step at 1/7680 s. Ours run at one step a frame and at a
//! few sub-steps. The rivals are given the cheapest setting that keeps both errors within the bar: each has ladders of
//! settings, cheapest first, and of each ladder the first that does is taken. Masses, lengths, gravity, stiffness and start
//! are the same; the rivals have no bending and no torsion, which a cable that swings straight does not ask for, and
//! nothing collides or sleeps.
//!
//! As measured (`taut study engines`, AVX-512 in a virtual machine): a frame of a swing from 0.3 rad for 6.5 s, in one step,
//! is 0.009 to 0.010 % of the length off at 10³ and 10⁵, 24 and 100 segments, the period's error of the scheme, and exact
//! at rest; 6.7 and 18 µs. An explicit leapfrog of point masses, without bending or torsion, needs 128 and 256 sub-steps to
//! be stable at all: 2.0 and 5.0 times as long, 0.002 to 0.004 % off. The physics engine Rapier (`--features rapier`,
//! Apache-2.0, off by default; a rival, no part of anything) at its cheapest setting within 1 %, sub-steps and sweeps
//! by powers of two: its soft rope solved implicitly takes 7.3 and 33 times as long at 24 segments, 19 and 101 times at
//! 100; swept by Gauss–Seidel 18 and 53, 37 and 137; impulse joints 47 and 182, 134 and 503; the multibody 984 times, with
//! springs 887 times at 10³ and 24 segments, and no multibody the others within real time.
//!
//! **On the ground** ([`taut_ground::engine::grounded`]) ours, in one step a frame, and Rapier go through motions whose end
//! is known: a box that slides to its stop, a stack of ten boxes that stays, a cable of 24 segments in the steady motion
//! of the load that it drags. Masses, shapes, friction, joints and their damping are the same. Two errors count: the
//! largest distance of a body from its place over the length of the scene, and the deepest penetration over the least
//! dimension of a shape. Rapier's ladders have sub-steps, sweeps, relaxation and the hardness of contacts; none beyond 4
//! ms a frame is tried.
//!
//! As measured in the same run: ours is 0.003 % of its way off with the box, at most 0.007 % with the
//! stack, at most 5·10⁻⁴ % of the cable's length and 0.12 % of its diameter with the load. At a ratio of 1 Rapier within
//! 1 % takes 0.72 times as long with the box, 0.08 times with the stack, 0.37 times with the load. At 10³ it takes 19 and
//! 3.7 times as long. At 10⁵ no setting is within 1 %: all 155 lose the stack or are too slow, and the load is 9.5 % off
//! at best, in 10 times as long.
//!
//! | module | holds |
//! |---|---|
//! | `ours` | our step in its settings |
//! | `grounded` | the engines on the ground |
//! | `leapfrog` | the explicit rival: point masses and springs; Rapier is in the crate `taut-rivals` |
//! | `search` | a run of a setting, the cheapest within the bar |
//! | `table` | text tables |

pub mod grounded;
pub mod leapfrog;
mod ours;
mod search;
mod study;
mod table;

pub use search::{Entry, Outcome};
pub(crate) use study::STUDY;

use crate::cases::Cases;
use serde::{Deserialize, Serialize};
use taut_ground::engine::motion::{self, Motion};
use taut_ground::engine::{self, Engine, Setting, doubling};
use taut_integrator::StepError;
use taut_model::HoistParams;
use taut_output::check::ExperimentError;

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
    /// Mass ratios of the stack and of the dragged load.
    pub ground: Vec<f64>,
    /// `longest_ns` on the ground \[ns].
    pub longest_on_ground_ns: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            segments: vec![24, 100],
            ratios: vec![1e3, 1e5],
            angle: 0.3,
            time: 6.5,
            bar: 0.01,
            // Beyond it an engine does not keep up.
            longest_ns: 1e9 * motion::FRAME,
            ground: vec![1.0, 1e3, 1e5],
            longest_on_ground_ns: 4e6,
        }
    }
}

impl Config {
    /// The shorter cable, a third of the swing, no setting beyond 1 ms a frame: a look at it.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            segments: vec![24],
            time: 2.0,
            longest_ns: 1e6,
            longest_on_ground_ns: 5e5,
            ..Self::default()
        }
    }
}

/// One row: an engine in a setting on a cable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    #[serde(flatten)]
    pub entry: Entry,
    /// Minimum of a frame over the joints, segments + 1; NaN without a frame's time \[ns].
    pub ns_per_joint: f64,
    /// Minimum of a frame over that of our default, likewise.
    pub over_ours: f64,
    /// Distance of the reference from that with half as many sub-steps, over the cable's length.
    pub reference_error: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Results {
    /// On the hoist.
    pub records: Vec<Record>,
    /// On the ground.
    pub ground: Vec<grounded::Record>,
}

/// Runs the sweep: of each cable, a case, and of each scene on the ground, one engine after the other, then the
/// times of all rows in turns.
///
/// # Errors
/// Scenes or options that are not sound. Runs that end early are results.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let over_ratios = |&n: &usize| config.ratios.iter().map(move |&ratio| (n, ratio));
    let cables: Vec<(usize, f64)> = config.segments.iter().flat_map(over_ratios).collect();
    let rows = cases.in_turn("engines", &cables, |&(segments, ratio)| {
        rows(config, segments, ratio)
    })?;
    let scenes = grounded::scenes(config);
    let ground = cases.in_turn("ground", &scenes, |&(kind, ratio)| {
        grounded::rows(config, kind, ratio)
    })?;
    Ok(Results {
        records: rows.all()?.concat(),
        ground: ground.all()?.concat(),
    })
}

fn rows(config: &Config, segments: usize, mass_ratio: f64) -> Result<Vec<Record>, StepError> {
    let cable = search::Cable::new(config, segments, mass_ratio)?;
    let engines = engines();
    let mut rows = Vec::new();
    for engine in &engines {
        let run = |setting, longest| cable.run(setting, longest);
        let found = search::rows(engine, config.bar, config.longest_ns, run)?;
        rows.extend(found.into_iter().map(|row| (engine, row)));
    }
    let (engines, mut rows): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
    cable.time(&mut rows)?;
    let ours = rows.first().map_or(f64::NAN, |r| r.outcome.frame_ns_min);
    let record = |(engine, row): (&Engine, search::Row<'_>)| Record {
        segments,
        mass_ratio,
        ns_per_joint: row.outcome.frame_ns_min / (segments + 1) as f64,
        over_ours: row.outcome.frame_ns_min / ours,
        reference_error: cable.reference.halved / cable.length(),
        entry: row.entry(engine, config.bar),
    };
    Ok(engines.into_iter().zip(rows).map(record).collect())
}

/// All engines that are compiled in; ours come first, and the first of their settings is the default.
fn engines() -> Vec<Engine> {
    let engines = [ours::engine(), leapfrog_engine()].into_iter();
    #[cfg(feature = "rapier")]
    let engines = engines.chain(taut_rivals::rapier::engines());
    engines.collect()
}

fn leapfrog_engine() -> Engine {
    let setting = |substeps: usize| Setting {
        text: engine::substeps(substeps),
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
        name: "leapfrog",
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

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(results: &Results, config: &Config) -> String {
        let rows = crate::study::data(&results).unwrap();
        taut_output::table::plain(&table::text(&rows, results, config))
    }
    use std::f64::consts::FRAC_PI_2;
    use taut_integrator::{Scheme, StepOptions};

    /// Six segments through a swing, one ratio after the other.
    fn quick() -> (Config, Results) {
        let config = Config {
            segments: vec![6],
            ground: vec![1.0],
            ..Config::quick()
        };
        let results = run(&config, &Cases::default()).expect("sound");
        println!("{}", shown(&results, &config));
        (config, results)
    }

    /// A pendulum of frequency ω, taken at x + a δ²x, runs fast by (1/24 − a/2)(ωΔt)²: with amplitude θ it is behind by
    /// θ ω t times that after t, in lengths of the cable. Half of that and twice it are the bars, for the swing is not
    /// quite harmonic. With sub-steps the error falls with their square.
    #[test]
    fn our_error_is_that_of_the_pendulums_period() {
        let (config, Results { records, .. }) = quick();
        let Scheme::ThirdDifference { a, .. } = StepOptions::default().scheme else {
            panic!("the default scheme is another: so is its error");
        };
        for &mass_ratio in &config.ratios {
            let ours = |setting: &str| {
                let record = records
                    .iter()
                    .find(|r| r.entry.setting == setting && r.mass_ratio == mass_ratio)
                    .expect("a row");
                assert!(record.entry.within && record.entry.outcome.frame_ns_min > 0.0);
                (
                    record
                        .entry
                        .outcome
                        .errors
                        .elongation_error
                        .expect("it rests"),
                    record.entry.outcome.errors.load_error.expect("it swings"),
                )
            };
            let params = params(6, mass_ratio);
            let length = params.length + params.exact_elongation();
            let omega = (params.gravity / length).sqrt();
            // The phase error shows where the load is fastest, a quarter of a period after the start at the earliest.
            let phase = omega * config.time;
            assert!(phase > FRAC_PI_2);
            let late = (1.0 / 24.0 - 0.5 * a).abs() * (omega * motion::FRAME).powi(2) * phase;
            let expected = late * config.angle * length / params.length;
            let (elongation, load) = ours("default, 1 step");
            println!("ratio {mass_ratio}: expected {expected:e}, load {load:e}");
            assert!((0.5 * expected..2.0 * expected).contains(&load));
            assert!(elongation < 1e-12);
            let (_, halved) = ours("2 sub-steps");
            assert!((3.5..4.5).contains(&(load / halved)), "{}", load / halved);
        }
    }

    #[test]
    fn every_row_has_its_figures_and_the_table_is_narrow() {
        let (config, results) = quick();
        let records = &results.records;
        assert_eq!(
            records.len(),
            config.ratios.len() * (6 + engines().len() - 1)
        );
        for r in records {
            // The short time given to Rapier's multibody leaves its error open.
            let bar = if r.entry.engine.contains("multibody") {
                1.0
            } else {
                config.bar
            };
            assert!(r.entry.outcome.error() < bar, "{r:?}");
            assert!(r.reference_error < 1e-6, "{r:?}");
            let outcome = &r.entry.outcome;
            let times = [outcome.frame_ns, outcome.frame_ns_min, r.ns_per_joint];
            assert!(times.iter().all(|ns| ns.is_finite() && *ns > 0.0), "{r:?}");
        }
        assert_eq!(records[0].over_ours, 1.0);
        // Slide, stack and floor.
        let on_ground = if cfg!(feature = "rapier") { 6 } else { 3 };
        assert_eq!(results.ground.len(), on_ground);
        for r in &results.ground {
            assert!(r.entry.within && r.entry.outcome.frame_ns > 0.0, "{r:?}");
        }
        let text = shown(&results, &config);
        assert!(text.lines().all(|line| line.chars().count() <= 120));
    }

    /// A rival that no setting brings within the bar is said to be that, with the best it reached.
    #[test]
    fn what_is_not_reached_is_said() {
        let mut config = Config {
            bar: 1e-9,
            segments: vec![3],
            ratios: vec![1e3],
            ground: Vec::new(),
            ..Config::quick()
        };
        config.time = 0.5;
        let results = run(&config, &Cases::default()).expect("sound");
        assert!(results.records.iter().all(|r| !r.entry.within));
        let text = shown(&results, &config);
        assert!(
            text.contains("leapfrog, 3 segments, ratio 1000: 1e-7 % not reached; best of"),
            "{text}"
        );
    }
}
