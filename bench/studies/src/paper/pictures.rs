//! Figs 9, 14 and 15: pictures from runs, each with what it has to show.
//!
//! - **Fig. 9.** A specimen of 24 segments at rest under a moment, bent to parts of a circle, and under a torque, twisted. The
//!   stripe along its segments shows the twist.
//! - **Fig. 14.** The gantry, its trolley driven and stopped, the load swinging.
//! - **Fig. 15.** The gantry lowers its load onto the ground until the cable is slack. Two cables that differ in bending
//!   stiffness slacken into different shapes, "the geometric shape of the slacking cable depends on the elasticity".
//!
//! Masses and g of the crane are the paper's where its scan can be read: 300 kg of load on 0.3 kg of cable, 10 m/s².

use super::specimens::{Joint, MATERIALS, bend, twist};
use super::words::{largest, named_check, number, worst};
use super::{DT, GRAVITY};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use serde_json::json;
use std::f64::consts::{PI, TAU};
use taut_integrator::{StepOptions, Stepper};
use taut_measure::trajectory::{Limits, Simulation, load_position, steps_in};
use taut_model::collide::{Collider, DEFAULT_GROUP, Shape};
use taut_model::{Controls, GantryParams, Material, Scene};
use taut_output::check::{ExperimentError, Outcome};
use taut_recording::{Recorder, Recording, still};

const SEGMENTS: usize = 24;

/// A scene that is stepped so many times, driven before each, and its recording.
fn recorded(
    scene: Scene,
    steps: usize,
    controls: impl Fn(f64) -> Option<Controls>,
) -> Result<(Stepper, Recording), ExperimentError> {
    let limits = Limits::Scene(scene.gap_limits());
    let options = StepOptions {
        dt: DT,
        ..StepOptions::default()
    };
    let mut stepper = Stepper::new(scene, options)?;
    let mut simulation = Simulation::new(steps, limits);
    let mut file = Vec::new();
    let mut recorder = Recorder::begin(&mut file, &stepper, steps)?;
    for _ in 0..steps {
        if let Some(controls) = controls(stepper.time()) {
            stepper.set_controls(&controls)?;
        }
        let Some(sample) = simulation.step(&mut stepper) else {
            break;
        };
        recorder.step(&mut file, &stepper, &sample)?;
    }
    if let Some(failure) = simulation.failure {
        return Err(failure.reason.into());
    }
    recorder.end(&mut file, stepper.time(), None)?;
    Ok((stepper, Recording::read(&mut &file[..])?))
}

fn portrait(scene: Scene) -> Result<Vec<u8>, ExperimentError> {
    let (_, recording) = recorded(scene, 1, |_| None)?;
    Ok(still(&recording, 0.0)?.png)
}

pub(super) fn specimens(_: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let nylon = MATERIALS[1];
    // Parts of a circle that they are bent to, and turns that they are twisted by.
    let (bends, twists) = ([0.25, 0.5, 0.75], [1.0, 2.0]);
    progress.set_length((bends.len() + twists.len()) as u64);
    let mut shown = Outcome::default();
    let (checks, pictures) = (&mut shown.checks, &mut shown.pictures);
    for part in bends {
        let (scene, row) = bend::bent(nylon, SEGMENTS, part)?;
        checks.push(named_check("bent", json!({ "part": part })).off(number(&row, "tip_error")));
        pictures.push((format!("bend-{part}").into(), portrait(scene)?));
        progress.inc(1);
    }
    for turns in twists {
        let (scene, rows) = twist::at_rest(nylon, SEGMENTS, Joint::Cosserat, turns * TAU)?;
        let twist = worst(rows.last(), "twist");
        let said = named_check("twisted", json!({ "turns": turns }));
        checks.push(said.compared_with([turns, twist / TAU]));
        pictures.push((format!("twist-{turns}").into(), portrait(scene)?));
        progress.inc(1);
    }
    Ok(shown)
}

/// Mass of the cable \[kg], its segments, half its thickness \[m].
const CABLE: f64 = 0.3;
const LINKS: usize = 16;
const RADIUS: f64 = 0.01;

/// The crane with something to see: its beam, and the ground below it, which load and cable touch.
fn crane(load: f64, ei: Option<f64>) -> Result<Scene, ExperimentError> {
    let segment_mass = CABLE / LINKS as f64;
    let params = GantryParams {
        segments: LINKS,
        segment_mass,
        mass_ratio: load / segment_mass,
        gravity: GRAVITY,
        ei,
        damping: 0.02,
        equilibrium: true,
        // A cable that is exactly straight does not slacken.
        seed: 1,
        ..GantryParams::default()
    };
    let mut scene = params.build()?;
    let size = Vector3::repeat(params.resolve()?.load_edge);
    let beam = Vector3::new(12.0, 0.3, 0.4);
    let capsule = Shape::Capsule {
        length: params.cable_length / LINKS as f64,
        radius: RADIUS,
    };
    let mut shapes = vec![
        (scene.load, Shape::Cuboid { size }, DEFAULT_GROUP, 0.0),
        (None, Shape::HalfSpace, DEFAULT_GROUP, -GROUND),
        (Some(0), Shape::Cuboid { size: beam }, OWN, 0.55),
    ];
    let segments = scene.cables[0].bodies.iter();
    shapes.extend(segments.map(|body| (Some(*body), capsule, OWN, 0.0)));
    for (k, (body, shape, groups, z)) in shapes.into_iter().enumerate() {
        let mut collider = Collider {
            groups,
            meets: DEFAULT_GROUP,
            ..Collider::new(format!("shape-{k}"), body, shape)
        };
        collider.position.z = z;
        scene.add_collider(collider);
    }
    Ok(scene)
}

/// Depth of the ground below the beam \[m].
const GROUND: f64 = 12.0;

/// The group of beam and cable, which meet load and ground but not each other.
const OWN: u32 = 2;

pub(super) fn gantry(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let loads = [300.0, 3000.0];
    progress.set_length(loads.len() as u64);
    let mut shown = Outcome::default();
    let (checks, pictures) = (&mut shown.checks, &mut shown.pictures);
    let time = if quick { 4.0 } else { 10.0 };
    for load in loads {
        let scene = crane(load, None)?;
        let run = recorded(scene, steps_in(time, DT), |time| {
            Some(Controls {
                trolley_speed: if time < 2.0 { 0.8 } else { 0.0 },
                hoist_speed: if (1.0..3.0).contains(&time) { 0.3 } else { 0.0 },
            })
        });
        let (ours, error) = match &run {
            Ok(_) => ("stable, with its own inertia", String::new()),
            Err(e) => ("failed", e.to_string()),
        };
        let row = json!({ "time": time, "ratio": load / CABLE, "ours": ours, "error": error });
        checks.push(named_check("gantry", row).so(run.is_ok()));
        if let (Ok((_, recording)), true) = (run, pictures.is_empty()) {
            pictures.push(("swing".into(), still(&recording, 3.5)?.png));
        }
        progress.inc(1);
    }
    Ok(shown)
}

/// Upward forces on the load, of the ground and of the cable \[N].
fn carried(stepper: &Stepper) -> Result<[f64; 2], ExperimentError> {
    let scene = stepper.scene();
    let load = scene.load.ok_or("the gantry has no load")?;
    let bottom = stepper.constraint_index(stepper.constraint("bottom")?)?;
    let joint = stepper.force(bottom).ok_or("the cable has no end")?;
    let (mut ground, mut cable) = (0.0, joint.force.z);
    for contact in stepper.contacts() {
        let force = contact.on(load).z;
        match contact.bodies.contains(&None) {
            true => ground += force,
            false => cable += force,
        }
    }
    Ok([ground, cable])
}

pub(super) fn landing(_: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let load = 300.0;
    // Bending stiffness of a solid wire of the cable's mass.
    let area = CABLE / GantryParams::default().cable_length / Material::STEEL.density;
    let steel = Material::STEEL.young * area * area / (4.0 * PI);
    let stiffnesses = [("steel", steel), ("soft", 0.01 * steel)];
    progress.set_length(stiffnesses.len() as u64);
    let (mut shown, mut bulges) = (Outcome::default(), Vec::new());
    let (checks, pictures) = (&mut shown.checks, &mut shown.pictures);
    for (name, ei) in stiffnesses {
        let scene = crane(load, Some(ei))?;
        let (stepper, recording) = recorded(scene, steps_in(12.0, DT), |time| {
            Some(Controls {
                trolley_speed: 0.0,
                hoist_speed: if time < 6.0 { -0.4 } else { 0.0 },
            })
        })?;
        let scene = stepper.scene();
        let [ground, cable] = carried(&stepper)?;
        let said = named_check("ground", json!({ "name": name }));
        checks.push(said.compared_with([load * GRAVITY - cable, ground]));
        // How far a slack cable bulges: the largest distance of a segment from the vertical through the load.
        let segments = scene.cables[0].bodies.iter();
        let aside = segments.map(|i| {
            (scene.bodies.position[*i] - load_position(scene))
                .xy()
                .norm()
        });
        bulges.push(largest(aside));
        pictures.push((name.into(), still(&recording, stepper.time())?.png));
        progress.inc(1);
    }
    let differ = (bulges[0] / bulges[1]).ln().abs() > 0.1;
    let row = json!({ "steel": bulges[0], "soft": bulges[1] });
    checks.push(named_check("slack", row).so(differ));
    Ok(shown)
}
