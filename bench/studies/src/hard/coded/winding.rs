//! H48: a cable of segments that a winch hauls in, whose first segment merges with the next and splits.
//!
//! A load of 10⁵ segments of 1 m swings while it is hoisted to 5 m. The reference is the same cable in segments a quarter as
//! long. Turned against the winch, the cable keeps its twist however short it becomes. Mass, length and momenta of the
//! segments are weighed before and after a merge and a split in the midst of that motion.

use crate::hard::{DT, at, farthest, under_gravity, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_integrator::Stepper;
use taut_measure::pace;
use taut_model::scene::resolution::Resolution;
use taut_model::{
    Body, Cable, CableEnd, Constraint, Frame, Material, Scene, Segments, Slider, Stiffness, Winch,
    hanging_axes, update_windings,
};
use taut_output::check::{Check, ExperimentError, Outcome};

const SPEED: f64 = 0.5;
/// Length that hauling in ends at \[m].
const SHORTEST: f64 = 5.0;
/// Mass per length \[kg/m], and the load's mass \[kg].
const DENSITY: f64 = 0.1;
const LOAD: f64 = 1e4;
/// Rate of the swing at the start \[rad/s].
const SWING: f64 = 3e-3;
/// Twist \[rad].
const TURNS: f64 = 12.0;
const STIFFNESS: Stiffness = Stiffness {
    ea: 2e7,
    ei: 10.0,
    gj: 8.0,
};
/// Largest distance from the finer cable \[m], and bar of the twist and of what a split or merge keeps.
const BARS: [f64; 3] = [1e-3, 1e-9, 1e-12];

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let length = if quick { 20.0 } else { 100.0 };
    let mut midst = Scene::default();
    let mut run = |segment: f64| -> Result<_, ExperimentError> {
        let (mut places, half) = (Vec::new(), steps(length) / 2);
        let scene = hoist(length, segment, CableEnd::Pinned, None)?;
        hoisted(scene, length, |k, stepper| {
            pace::step(stepper)?;
            if k % 20 == 0 {
                places.push(stepper.scene().bodies.position[0]);
            }
            if k == half && segment >= 1.0 {
                midst = stepper.scene().clone();
            }
            Ok(())
        })?;
        Ok(places)
    };
    let apart = farthest(&run(1.0)?, &run(0.25)?);
    let case = "m, load of 10⁵ segments: segments of 1 m against 0.25 m";
    let twist = twisted(length.min(20.0))?;
    let mut checks = vec![
        Check::within(
            format!("{length} → {SHORTEST} {case}"),
            "the same motion",
            format!("{apart:.2e} m apart"),
            apart,
            BARS[0],
        )
        .by("largest distance of the loads, m"),
        Check::within(
            "twist kept while hauled in",
            "12 rad",
            format!("{twist:.1e} rad off"),
            twist,
            BARS[1],
        )
        .by("largest change of the sum of all twists, rad"),
    ];
    for (what, first) in [("merge", 0.45), ("split", 1.6)] {
        let [mass, lengths, momentum, angular, energy] = kept(&midst, first)?;
        let worst = [mass, lengths, momentum, angular]
            .into_iter()
            .fold(0.0, worse);
        checks.push(
            Check::within(
                format!("{what}: mass, length, momentum, angular momentum"),
                "kept",
                format!("{mass:.1e}, {lengths:.1e}, {momentum:.1e}, {angular:.1e}"),
                worst,
                BARS[2],
            )
            .by("largest relative change, of the segments alone")
            .with_note(format!(
                "kinetic energy of the segments changes by {energy:.1e} of itself"
            )),
        );
    }
    Ok(checks.into())
}

/// A load on a cable in segments of about `segment` (m), held by `held`, with a winch that hauls it in.
pub(super) fn hoist(
    length: f64,
    segment: f64,
    held: fn(Frame) -> CableEnd,
    resolution: Option<Resolution>,
) -> Result<Scene, ExperimentError> {
    let mut scene = under_gravity("hoisted load");
    let place = -Vector3::z() * length;
    let load = scene.add_body("load", Body::sphere(0.2, LOAD).at(place));
    scene.load = Some(load);
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(load, Vector3::zeros()),
    ];
    scene.add_cable(&Cable {
        segments: Segments::Equal((length / segment).round() as usize),
        density: DENSITY,
        stiffness: STIFFNESS,
        winch: Some(Winch {
            speed: -SPEED,
            shortest: SHORTEST,
            ..Winch::new()
        }),
        resolution,
        ..Cable::round("cable", &Material::STEEL, 0.01, frames.map(held))
    })?;
    scene.start_in_equilibrium = true;
    Ok(scene)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![hoist(20.0, 1.0, CableEnd::Pinned, None)?])
}

/// Steps in which the cable is hauled in.
fn steps(length: f64) -> usize {
    ((length - SHORTEST) / SPEED / DT).round() as usize
}

/// Hoists a load that swings; `step` makes each of the numbered steps.
pub(super) fn hoisted(
    scene: Scene,
    length: f64,
    mut step: impl FnMut(usize, &mut Stepper) -> Result<(), ExperimentError>,
) -> Result<(), ExperimentError> {
    let mut stepper = Stepper::new(scene, at(DT))?;
    let mut bodies = stepper.scene().bodies.clone();
    for i in 0..bodies.len() {
        let swing = Vector3::y() * -SWING;
        bodies.velocity[i] = swing.cross(&bodies.position[i]) + Vector3::z() * SPEED;
        bodies.angular_velocity[i] = swing;
    }
    stepper.set_state(&bodies, 0.0)?;
    (0..steps(length)).try_for_each(|k| step(k, &mut stepper))
}

/// Largest change of the twist of a cable that is clamped at both ends, its load on a rail \[rad].
fn twisted(length: f64) -> Result<f64, ExperimentError> {
    let mut scene = hoist(length, 1.0, CableEnd::Clamped, None)?;
    let about = |by: f64| UnitQuaternion::from_scaled_axis(-Vector3::z() * by);
    let bodies = scene.cables[0].bodies.clone();
    for (k, &body) in bodies.iter().enumerate() {
        scene.bodies.orientation[body] = about(TURNS * (k as f64 + 0.5) / bodies.len() as f64);
    }
    scene.bodies.orientation[0] = about(TURNS);
    let axes = scene.bodies.rotation(0).transpose() * hanging_axes();
    let rail = [
        Frame::world(Vector3::zeros()),
        Frame::body(0, Vector3::zeros()).with_axes(axes),
    ];
    scene.add_constraint("rail", Slider::new(rail), 0);
    update_windings(&mut scene, 0.0);
    let mut stepper = Stepper::new(scene, at(DT))?;
    let mut worst = 0.0;
    for _ in 0..steps(length) {
        pace::step(&mut stepper)?;
        let (rows, joints) = (stepper.linearized(), &stepper.scene().cables[0].joints);
        let twists = joints.iter().map(|c| rows.phi[rows.row_range(*c).end - 1]);
        worst = worse(worst, (twists.sum::<f64>() - TURNS).abs());
    }
    Ok(worst)
}

/// Relative changes of mass, length, momentum, angular momentum and kinetic energy of the segments, where the first one is
/// cut to `first` (m) and then splits or merges.
fn kept(midst: &Scene, first: f64) -> Result<[f64; 5], ExperimentError> {
    let mut scene = midst.clone();
    if let Constraint::Fairlead(lead) = &mut scene.constraints[0] {
        lead.winch.brake = true;
        let by = first - lead.first;
        scene.cut_at_winch(0, 0.0, by);
    }
    let before = (segments(&scene), length(&scene));
    if scene.split_at_winch(0, 0.0).is_none()
        && let Some(merged) = scene.merge_at_winch(0, 0.0)
    {
        scene.remove(&[merged.body], &[merged.joint])?;
    }
    let after = (segments(&scene), length(&scene));
    let change = |[before, after]: [f64; 2]| (after / before - 1.0).abs();
    let moved = |of: fn(&Scene) -> Vector3<f64>| {
        (of(&after.0) - of(&before.0)).norm() / of(&before.0).norm()
    };
    Ok([
        change([before.0.mass(), after.0.mass()]),
        change([before.1, after.1]),
        moved(Scene::momentum),
        moved(|s| s.angular_momentum(&Vector3::zeros())),
        change([before.0.kinetic_energy(), after.0.kinetic_energy()]),
    ])
}

/// The segments of the first cable alone.
pub(super) fn segments(scene: &Scene) -> Scene {
    let mut segments = Scene::new("segments");
    for &body in &scene.cables[0].bodies {
        segments.add_body("", scene.bodies.get(body));
    }
    segments
}

/// Length of cable that the winch has left out \[m].
fn length(scene: &Scene) -> f64 {
    match &scene.constraints[0] {
        Constraint::Fairlead(lead) => {
            lead.first + lead.segment * (scene.cables[0].bodies.len() - 1) as f64
        }
        _ => f64::NAN,
    }
}
