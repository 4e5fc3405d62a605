//! H48: a cable of segments that a winch hauls in, whose first segment merges with the next and splits.
//!
//! A load of 10⁵ segments of 1 m swings while it is hoisted to 5 m. The reference is the same cable in segments a quarter as
//! long. Turned against the winch, the cable keeps its twist however short it becomes. Mass, length and momenta of the
//! segments are weighed before and after a merge and a split in the midst of that motion.

use crate::hard::{at, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::pace;
use taut_integrator::Stepper;
use taut_model::{
    Body, Cable, CableEnd, Constraint, Frame, Material, Scene, Segments, Slider, Stiffness, Winch,
    hanging_axes, update_windings,
};
use taut_output::check::{Check, ExperimentError, Outcome};

const GRAVITY: f64 = 9.81;
const DT: f64 = 1.0 / 60.0;
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
    let (coarse, fine) = (hoisted(length, 1.0)?, hoisted(length, 0.25)?);
    let apart = coarse.places.iter().zip(&fine.places);
    let apart = apart.fold(0.0, |worst, (a, b)| worse(worst, (a - b).norm()));
    let mut checks = vec![
        Check::within(
            format!(
                "{length} → {SHORTEST} m, load of 10⁵ segments: segments of 1 m against 0.25 m"
            ),
            "the same motion",
            format!("{apart:.2e} m apart"),
            apart,
            BARS[0],
        )
        .by("largest distance of the loads, m"),
    ];
    let twist = twisted(length.min(20.0))?;
    checks.push(
        Check::within(
            "twist kept while hauled in",
            "12 rad",
            format!("{twist:.1e} rad off"),
            twist,
            BARS[1],
        )
        .by("largest change of the sum of all twists, rad"),
    );
    for (what, first) in [("merge", 0.45), ("split", 1.6)] {
        let [mass, lengths, momentum, angular, energy] = kept(&coarse.midst, first)?;
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
            .noting(format!(
                "kinetic energy of the segments changes by {energy:.1e} of itself"
            )),
        );
    }
    Ok(checks.into())
}

/// A load on a cable in segments of about `segment` (m), held by `held`, with a winch that hauls it in.
fn scene(length: f64, segment: f64, held: fn(Frame) -> CableEnd) -> Result<Scene, ExperimentError> {
    let mut scene = Scene::new("hoisted load");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
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
        ..Cable::round("cable", &Material::STEEL, 0.01, frames.map(held))
    })?;
    scene.start_in_equilibrium = true;
    Ok(scene)
}

/// The hoist at its beginning, in segments of 1 m.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![scene(20.0, 1.0, CableEnd::Pinned)?])
}

/// A hoist: where its load was every third of a second, and how all was half-way.
struct Hoisted {
    places: Vec<Vector3<f64>>,
    midst: Scene,
}

fn hoisted(length: f64, segment: f64) -> Result<Hoisted, ExperimentError> {
    let mut stepper = Stepper::new(scene(length, segment, CableEnd::Pinned)?, at(DT))?;
    let mut bodies = stepper.scene().bodies.clone();
    for i in 0..bodies.len() {
        let swing = Vector3::y() * -SWING;
        bodies.velocity[i] = swing.cross(&bodies.position[i]) + Vector3::z() * SPEED;
        bodies.angular_velocity[i] = swing;
    }
    stepper.set_state(&bodies, 0.0)?;
    let steps = ((length - SHORTEST) / SPEED / DT).round() as usize;
    let mut run = Hoisted {
        places: Vec::new(),
        midst: stepper.scene().clone(),
    };
    for k in 0..steps {
        pace::step(&mut stepper)?;
        if k % 20 == 0 {
            run.places.push(stepper.scene().bodies.position[0]);
        }
        if k == steps / 2 {
            run.midst = stepper.scene().clone();
        }
    }
    Ok(run)
}

/// Largest change of the twist of a cable that is clamped at both ends, its load on a rail \[rad].
fn twisted(length: f64) -> Result<f64, ExperimentError> {
    let mut scene = scene(length, 1.0, CableEnd::Clamped)?;
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
    let steps = ((length - SHORTEST) / SPEED / DT).round() as usize;
    let mut stepper = Stepper::new(scene, at(DT))?;
    let mut worst = 0.0;
    for _ in 0..steps {
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
    let before = sums(&scene);
    if scene.split_at_winch(0, 0.0).is_none()
        && let Some(merged) = scene.merge_at_winch(0, 0.0)
    {
        scene.remove(&[merged.body], &[merged.joint])?;
    }
    let after = sums(&scene);
    let change = |of: fn(&Sums) -> f64| (of(&after) / of(&before) - 1.0).abs();
    let moved =
        |of: fn(&Sums) -> Vector3<f64>| (of(&after) - of(&before)).norm() / of(&before).norm();
    Ok([
        change(|s| s.mass),
        change(|s| s.length),
        moved(|s| s.momentum),
        moved(|s| s.angular),
        change(|s| s.energy),
    ])
}

/// Sums over the segments alone.
struct Sums {
    mass: f64,
    length: f64,
    momentum: Vector3<f64>,
    angular: Vector3<f64>,
    energy: f64,
}

fn sums(scene: &Scene) -> Sums {
    let mut segments = Scene::new("segments");
    for &body in &scene.cables[0].bodies {
        segments.add_body("", scene.bodies.get(body));
    }
    let length = match &scene.constraints[0] {
        Constraint::Fairlead(lead) => {
            lead.first + lead.segment * (scene.cables[0].bodies.len() - 1) as f64
        }
        _ => f64::NAN,
    };
    Sums {
        mass: segments.mass(),
        length,
        momentum: segments.momentum(),
        angular: segments.angular_momentum(&Vector3::zeros()),
        energy: segments.kinetic_energy(),
    }
}
