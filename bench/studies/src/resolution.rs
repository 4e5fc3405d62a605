//! Benefit of segments by rule: many cables in one scene, in fixed segments and by rule, speed
//! against error.

use crate::hard::at;
use crate::motions;
use crate::study::question::*;
use nalgebra::Vector3;
use std::fmt::Write;
use std::time::Instant;
use taut_integrator::{Resolved, Stepper};
use taut_measure::inputs::Inputs;
use taut_model::scene::resolution::Resolution;
use taut_model::{
    Body, Cable, CableEnd, Damping, Frame, Material, Motion, Scene, SceneError, Segments, Side,
};

pub(crate) const STUDY: Study = Study {
    name: "resolution",
    question: question!("resolution", &[]),
    run: |matches, reporter| study(Asked::read(matches).quick, reporter.cases),
    ..study::PLAIN
};

/// Segments of the reference.
const FINE: usize = 400;

/// Segments that a rule begins with, and the lightest load in such segments.
const LAID: usize = 100;

const LENGTH: f64 = 20.0;
const DENSITY: f64 = 0.5;
const DT: f64 = 1.0 / 60.0;

/// How a cable is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cut {
    /// In so many segments.
    Fixed(usize),
    /// By rule: its bend and its phase \[rad].
    Ruled(f64, f64),
}

struct Config {
    cables: usize,
    cuts: Vec<Cut>,
    /// Simulated time \[s].
    time: f64,
    /// Runs of each, of which the median counts.
    rounds: usize,
}

impl Config {
    fn new(quick: bool) -> Self {
        let few = vec![Cut::Fixed(100), Cut::Fixed(25), Cut::Ruled(0.1, 0.25)];
        let fixed = [100, 50, 25, 12, 6].map(Cut::Fixed);
        let ruled = [0.1, 0.25, 0.5, 1.0].map(|phase| Cut::Ruled(0.1, phase));
        let bent = [0.02, 0.3].map(|bend| Cut::Ruled(bend, 0.25));
        Self {
            cables: pick(quick, [64, 4]),
            cuts: pick(quick, [[&fixed[..], &ruled, &bent].concat(), few]),
            time: pick(quick, [10.0, 4.0]),
            rounds: pick(quick, [3, 1]),
        }
    }
}

/// Runs both scenes, one after the other.
fn study(quick: bool, cases: &Cases) -> Result<Found, ExperimentError> {
    let config = Config::new(quick);
    let scenes = ["hoists".to_owned(), "ropes".to_owned()];
    let found = cases.in_turn("resolution", &scenes, |name| rows(name, &config))?;
    let rows = Value::Array(found.all()?.concat());
    let text = format!("{}\n{}", STUDY.tables(&rows), gains(&rows));
    Ok(Found {
        settings: set([
            ("cables", config.cables.to_string()),
            ("reference", format!("{FINE} segments")),
            ("simulated", seconds(config.time)),
        ]),
        text,
        rows,
        ..Found::default()
    })
}

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

/// Where the loads were after each step, and what it took.
struct Run {
    /// A path for each load.
    paths: Vec<Vec<Vector3<f64>>>,
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
        paths: vec![Vec::with_capacity(steps); cables],
        segments: 0.0,
        resolved: Resolved::default(),
        step_ns: 0.0,
        longest_ns: 0.0,
    };
    let mut begun = Instant::now();
    let failure = motions::follow(
        &mut stepper,
        &Inputs::default(),
        steps,
        |stepper, report| {
            let took = begun.elapsed().as_nanos() as f64;
            run.step_ns += took / steps as f64;
            run.longest_ns = run.longest_ns.max(took);
            run.resolved += report.resolved;
            let scene = stepper.scene();
            let count: usize = scene.cables.iter().map(|cable| cable.bodies.len()).sum();
            run.segments += count as f64 / (steps * cables) as f64;
            for (path, id) in run.paths.iter_mut().zip(&loads) {
                let body = stepper.body_index(*id).map_err(|e| e.to_string())?;
                path.push(scene.bodies.position[body]);
            }
            begun = Instant::now();
            Ok(())
        },
    );
    failure.map_or(Ok(run), |failure| Err(failure.reason.into()))
}

fn rows(name: &str, config: &Config) -> Result<Vec<Value>, ExperimentError> {
    let Config { cables, time, .. } = *config;
    let fine = once(&scene(name, cables, Cut::Fixed(FINE))?, cables, time)?;
    let of = |&cut: &Cut| {
        let scene = scene(name, cables, cut)?;
        let run = once(&scene, cables, time)?;
        let mut times = vec![(run.step_ns, run.longest_ns)];
        for _ in 1..config.rounds {
            let again = once(&scene, cables, time)?;
            times.push((again.step_ns, again.longest_ns));
        }
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (step_ns, longest_ns) = times[times.len() / 2];
        let paths = run.paths.iter().zip(&fine.paths);
        let mut errors: Vec<f64> = paths.map(|(a, b)| 1e3 * motions::apart(a, b)).collect();
        errors.sort_by(f64::total_cmp);
        Ok(json!({
            "scene": name,
            "cables": cables,
            "cut": match cut {
                Cut::Fixed(count) => format!("{count}"),
                Cut::Ruled(bend, phase) => format!("by rule: bend {bend}, phase {phase}"),
            },
            "ruled": matches!(cut, Cut::Ruled(..)),
            // Of a cable, the mean over the run.
            "segments": run.segments,
            // Splits and merges.
            "changes": run.resolved.splits + run.resolved.merges,
            "step_ns": step_ns,
            "longest_ns": longest_ns,
            // Largest over the run: the median of the cables and the worst.
            "error_mm": errors[cables / 2],
            "worst_mm": errors[cables - 1],
        }))
    };
    config.cuts.iter().map(of).collect()
}

/// How many times as fast each run by rule is as the fastest one in fixed segments that has no larger error.
fn gains(data: &Value) -> String {
    let rows = rows_of(data, "");
    let number = |row: &Row, key| number_of(row, key).unwrap_or(f64::NAN);
    let mut text = String::new();
    for row in rows.iter().filter(|row| is(row, "ruled")) {
        let baselines = rows.iter().filter(|fixed| {
            !is(fixed, "ruled")
                && fixed["scene"] == row["scene"]
                && number(fixed, "error_mm") <= number(row, "error_mm")
        });
        let times = baselines.map(|fixed| number(fixed, "step_ns"));
        let gain = match times.min_by(f64::total_cmp) {
            Some(fastest) => {
                let gain = fastest / number(row, "step_ns");
                format!("{gain:.2} × as fast as fixed segments of no larger median error")
            }
            None => "no fixed segments have as small an error".to_owned(),
        };
        let [scene, cut] = ["scene", "cut"].map(|key| text_of(row, key));
        let _ = writeln!(text, "{scene}, {cut}: {gain}");
    }
    text
}
