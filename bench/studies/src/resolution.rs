//! Benefit of segments by rule: many cables in one scene, in fixed segments and by rule, speed
//! against error.
//!
//! All cables are 20 m long and hang side by side. Their anchors move aside by 0.5 m within a second, and they swing out of
//! it. The loads of *hoists* are 10 to 10⁵ times as heavy as a hundredth of a cable; *ropes* bear as much as that
//! hundredth, and whip. Where each load was is compared with a run in [`FINE`] segments: what is told is the error of the
//! segments alone, the largest over the run, the median of all cables and the worst.

mod study;

pub(crate) use study::STUDY;

use crate::cases::Cases;
use crate::hard::{at, worse};
use serde::{Deserialize, Serialize};
use std::time::Instant;
use taut_ground::pace;
use taut_integrator::{Resolved, Stepper};
use taut_model::nalgebra::Vector3;
use taut_model::scene::resolution::Resolution;
use taut_model::{
    Body, Cable, CableEnd, Damping, Frame, Material, Motion, Scene, SceneError, Segments, Side,
};
use taut_output::check::ExperimentError;

/// Segments of the reference.
pub const FINE: usize = 400;

/// Segments that a rule begins with, and the lightest load in such segments.
const LAID: usize = 100;

const LENGTH: f64 = 20.0;
const DENSITY: f64 = 0.5;
const DT: f64 = 1.0 / 60.0;

/// How a cable is cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Cut {
    /// In so many segments.
    Fixed(usize),
    /// By rule: its bend and its phase \[rad].
    Ruled(f64, f64),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Cables of a scene.
    pub cables: usize,
    /// How they are cut.
    pub cuts: Vec<Cut>,
    /// Simulated time \[s].
    pub time: f64,
    /// Runs of each, of which the median counts.
    pub rounds: usize,
}

impl Default for Config {
    fn default() -> Self {
        let fixed = [100, 50, 25, 12, 6].map(Cut::Fixed);
        let ruled = [0.1, 0.25, 0.5, 1.0].map(|phase| Cut::Ruled(0.1, phase));
        let bent = [0.02, 0.3].map(|bend| Cut::Ruled(bend, 0.25));
        Self {
            cables: 64,
            cuts: [&fixed[..], &ruled, &bent].concat(),
            time: 10.0,
            rounds: 3,
        }
    }
}

impl Config {
    /// Four cables.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            cables: 4,
            cuts: vec![Cut::Fixed(100), Cut::Fixed(25), Cut::Ruled(0.1, 0.25)],
            time: 4.0,
            rounds: 1,
        }
    }
}

/// A run of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// `hoists` or `ropes`.
    pub scene: String,
    /// Cables of the scene.
    pub cables: usize,
    /// How they are cut, in words.
    pub cut: String,
    /// Segments by rule.
    pub ruled: bool,
    /// Segments of a cable, the mean over the run.
    pub segments: f64,
    /// Splits and merges.
    pub changes: usize,
    /// Mean time of a step, and the longest one \[ns].
    pub step_ns: f64,
    /// See `step_ns`.
    pub longest_ns: f64,
    /// Largest error over the run, the median of the cables and the worst \[mm].
    pub error_mm: f64,
    /// See `error_mm`.
    pub worst_mm: f64,
}

/// The scene with cables that are cut in that way.
fn scene(name: &str, cables: usize, cut: Cut) -> Result<Scene, SceneError> {
    let mut scene = Scene::new(name);
    scene.gravity.z = -9.81;
    for k in 0..cables {
        let ratio = match name {
            "ropes" => 1.0,
            _ => 10.0_f64.powf(1.0 + 4.0 * k as f64 / (cables.max(2) - 1) as f64),
        };
        let place = Vector3::new(0.0, k as f64, 0.0);
        let mass = DENSITY * LENGTH / LAID as f64 * ratio;
        let hanging = place - Vector3::z() * LENGTH;
        let load = scene.add_body(format!("load-{k}"), Body::sphere(0.3, mass).at(hanging));
        let anchor = Frame {
            side: Side::World(Motion::Smooth {
                displacement: Vector3::x() * 0.5,
                start: 0.0,
                duration: 1.0,
            }),
            ..Frame::world(place)
        };
        let (count, resolution) = match cut {
            Cut::Fixed(count) => (count, None),
            Cut::Ruled(bend, phase) => {
                let rule = Resolution {
                    bend,
                    phase,
                    ..Resolution::default()
                };
                (LAID, Some(rule))
            }
        };
        let ends = [anchor, Frame::body(load, Vector3::zeros())].map(CableEnd::Pinned);
        scene.add_cable(&Cable {
            segments: Segments::Equal(count),
            density: DENSITY,
            damping: Damping::Time(5e-3),
            resolution,
            ..Cable::round(format!("cable-{k}"), &Material::STEEL, 5e-3, ends)
        })?;
    }
    scene.start_in_equilibrium = true;
    Ok(scene)
}

/// Where the loads were, and what it took.
struct Run {
    places: Vec<Vec<Vector3<f64>>>,
    segments: f64,
    resolved: Resolved,
    step_ns: f64,
    longest_ns: f64,
}

fn once(scene: &Scene, cables: usize, time: f64) -> Result<Run, ExperimentError> {
    let mut stepper = Stepper::new(scene.clone(), at(DT))?;
    let loads = (0..cables).map(|k| stepper.body(&format!("load-{k}")));
    let loads = loads.collect::<Result<Vec<_>, _>>()?;
    let steps = (time / DT).round() as usize;
    let mut run = Run {
        places: Vec::with_capacity(steps),
        segments: 0.0,
        resolved: Resolved::default(),
        step_ns: 0.0,
        longest_ns: 0.0,
    };
    for _ in 0..steps {
        let begun = Instant::now();
        let report = pace::step(&mut stepper)?;
        let took = begun.elapsed().as_nanos() as f64;
        run.step_ns += took / steps as f64;
        run.longest_ns = run.longest_ns.max(took);
        run.resolved += report.resolved;
        let scene = stepper.scene();
        let count: usize = scene.cables.iter().map(|cable| cable.bodies.len()).sum();
        run.segments += count as f64 / (steps * cables) as f64;
        let place = |id| Ok::<_, ExperimentError>(scene.bodies.position[stepper.body_index(id)?]);
        run.places.push(
            loads
                .iter()
                .map(|id| place(*id))
                .collect::<Result<_, _>>()?,
        );
    }
    Ok(run)
}

/// The largest distances of each cable's load \[mm], sorted.
fn errors(run: &Run, fine: &Run) -> Vec<f64> {
    let mut largest = vec![0.0; run.places.first().map_or(0, Vec::len)];
    for (places, exact) in run.places.iter().zip(&fine.places) {
        for ((largest, a), b) in largest.iter_mut().zip(places).zip(exact) {
            *largest = worse(*largest, 1e3 * (a - b).norm());
        }
    }
    largest.sort_by(f64::total_cmp);
    largest
}

/// The rows of a scene.
fn rows(name: &str, config: &Config) -> Result<Vec<Row>, ExperimentError> {
    let Config { cables, time, .. } = *config;
    let fine = once(&scene(name, cables, Cut::Fixed(FINE))?, cables, time)?;
    let of = |&cut: &Cut| {
        let scene = scene(name, cables, cut)?;
        let mut run = once(&scene, cables, time)?;
        let mut times = vec![(run.step_ns, run.longest_ns)];
        for _ in 1..config.rounds {
            let again = once(&scene, cables, time)?;
            times.push((again.step_ns, again.longest_ns));
        }
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        (run.step_ns, run.longest_ns) = times[times.len() / 2];
        let errors = errors(&run, &fine);
        Ok(Row {
            scene: name.to_owned(),
            cables,
            cut: match cut {
                Cut::Fixed(count) => format!("{count}"),
                Cut::Ruled(bend, phase) => format!("by rule: bend {bend}, phase {phase}"),
            },
            ruled: matches!(cut, Cut::Ruled(..)),
            segments: run.segments,
            changes: run.resolved.splits + run.resolved.merges,
            step_ns: run.step_ns,
            longest_ns: run.longest_ns,
            error_mm: errors.get(errors.len() / 2).copied().unwrap_or(0.0),
            worst_mm: errors.last().copied().unwrap_or(0.0),
        })
    };
    config.cuts.iter().map(of).collect()
}

/// How many times as fast each run by rule is as the fastest one in fixed segments that has no larger error.
pub fn gains(rows: &[Row]) -> impl Iterator<Item = (&Row, Option<f64>)> {
    rows.iter().filter(|row| row.ruled).map(|row| {
        let rivals = rows.iter().filter(|fixed| {
            !fixed.ruled && fixed.scene == row.scene && fixed.error_mm <= row.error_mm
        });
        let fastest = rivals.map(|fixed| fixed.step_ns).min_by(f64::total_cmp);
        (row, fastest.map(|fixed| fixed / row.step_ns))
    })
}

/// Runs both scenes, one after the other.
///
/// # Errors
/// A step that fails.
pub fn run(config: &Config, cases: &Cases) -> Result<Vec<Row>, ExperimentError> {
    let scenes = ["hoists".to_owned(), "ropes".to_owned()];
    let found = cases.in_turn("resolution", &scenes, |name| rows(name, config))?;
    Ok(found.all()?.concat())
}
