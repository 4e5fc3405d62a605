//! A driven head sets a load down on a cable of segments with bending stiffness, which lies slack over it, and picks it
//! up again.
//!
//! At rest the floor carries N = M g − T_z, with T the force of the cable's last joint on the load. The slack cable is
//! between two pins, which are closer than it is long. It bends until its stiffness EI carries its weight, in a shape of
//! second order in the length of its segments: that of the static equilibrium of a chain of more segments.
//!
//! Picked up with the speed v, a load that stands on a floor pulls with M g (1 + (v/g) √(k/M)) at most,
//! k = EA/L.

use super::{DT, GRAVITY, borne, ground, put_box, rough};
use crate::hard::{at, either, worse};
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::pace;
use taut_ground::trajectory::ENERGY_TOLERANCE;
use taut_integrator::{StepError, StepOptions, Stepper, static_equilibrium};
use taut_model::{
    Body, Cable, CableEnd, Damping, Frame, Material, Mobility, Scene, SceneError, Segments,
    Stiffness,
};
use taut_output::check::{Check, ExperimentError, Outcome};

const MASS: f64 = 1e3;
const EDGE: f64 = 1.0;
const LENGTH: f64 = 4.0;
/// Height of the load above the floor before the cable stretches \[m].
const DROP: f64 = 0.05;
/// Way of the head down, and aside so that the cable gives way to one side \[m].
const DOWN: f64 = 0.6;
const ASIDE: f64 = 0.06;
/// Speed of the head down and up \[m/s].
const SPEED: f64 = 0.1;
const EA: f64 = 1e7;
/// Time for the slack cable to come to rest \[s].
const REST: f64 = 20.0;
/// Segments of the chain that is compared with.
const FINE: usize = 256;
/// Largest error of the floor's force over the weight.
const BAR: f64 = 1e-10;
/// Largest distance of the middle from that of the chain of as many segments at rest, over L.
const SHAPE: f64 = 1e-9;
/// Largest deviation of the order from 2.
const ORDER: f64 = 0.2;
/// Largest overshoot of the peak over the bound, which leaves out the blow of the cable's own mass, v √(EA μ) at most:
/// a part of 2·10⁻².
const OVER: f64 = 1e-2;
/// Largest energy from nowhere over the motion's own.
const GAINED: f64 = 1e-3;

/// The cable between its ends, along `points`.
fn cable(segments: usize, ends: [Frame; 2], points: Vec<Vector3<f64>>) -> Cable {
    let stiffness = Stiffness {
        ea: EA,
        ei: 10.0,
        gj: 10.0,
    };
    Cable {
        points,
        segments: Segments::Equal(segments),
        density: 1.0,
        stiffness,
        damping: Damping::Ratio(0.3),
        ..Cable::round("cable", &Material::STEEL, 0.01, ends.map(CableEnd::Pinned))
    }
}

/// The load above the floor, at rest under the head, body 0.
fn hanging(segments: usize) -> Result<Scene, SceneError> {
    let mut scene = ground("crane with a cable of segments", 0.0, rough(0.5));
    let mut head = Body::fixed().at(Vector3::z() * (DROP + EDGE + LENGTH));
    head.mobility = Mobility::Driven;
    let head = scene.add_body("head", head);
    let shape = [Vector3::repeat(EDGE), Vector3::z() * (DROP + 0.5 * EDGE)];
    let load = put_box(
        &mut scene,
        shape,
        UnitQuaternion::identity(),
        MASS,
        rough(0.5),
    );
    scene.load = Some(load);
    let ends = [
        Frame::body(head, Vector3::zeros()),
        Frame::body(load, Vector3::z() * 0.5 * EDGE),
    ];
    scene.add_cable(&cable(segments, ends, Vec::new()))?;
    scene.start_in_equilibrium = true;
    Ok(scene)
}

/// The middle joint of the cable \[m].
fn middle(scene: &Scene) -> Vector3<f64> {
    let bodies = &scene.cables[0].bodies;
    let half = 0.5 * LENGTH / bodies.len() as f64;
    let body = bodies[bodies.len() / 2];
    scene.bodies.position[body] + scene.bodies.orientation[body] * Vector3::z() * half
}

/// The middle of the cable alone at rest between these ends, on the side that the upper one has left.
fn resting(segments: usize, ends: [Vector3<f64>; 2]) -> Result<Vector3<f64>, ExperimentError> {
    let mut scene = Scene::new("slack cable");
    scene.gravity = Vector3::z() * -GRAVITY;
    let half = 0.5 * (ends[1] - ends[0]);
    let aside = Vector3::new(half.z, 0.0, -half.x).normalize();
    let out = (0.25 * LENGTH * LENGTH - half.norm_squared()).sqrt();
    let corner = ends[0] + half + aside * out;
    scene.add_cable(&cable(segments, ends.map(Frame::world), vec![corner]))?;
    let rested = static_equilibrium(scene, &StepOptions::default().backend)?;
    Ok(middle(&rested))
}

/// So many seconds with the head at that speed (m/s) upwards and back aside; `each` sees every step. Returns the largest
/// energy from nowhere.
fn drive(
    stepper: &mut Stepper,
    [speed, time]: [f64; 2],
    mut each: impl FnMut(&Stepper),
) -> Result<f64, StepError> {
    let way = Vector3::new(-ASIDE / DOWN, 0.0, 1.0) * speed;
    stepper.set_velocity(0, way, Vector3::zeros())?;
    let mut gained = 0.0;
    for _ in 0..(time / stepper.options().dt).round() as usize {
        let report = pace::step(stepper)?;
        gained = worse(gained, report.balance.map_or(f64::NAN, |b| b.excess));
        each(stepper);
    }
    Ok(gained)
}

fn stepped(scene: Scene, dt: f64) -> Result<Stepper, StepError> {
    let watched = StepOptions {
        energy_tolerance: Some(ENERGY_TOLERANCE),
        ..at(dt)
    };
    Stepper::new(scene, watched)
}

/// The force of the last joint on the load \[N].
fn pull(stepper: &Stepper) -> Vector3<f64> {
    let last = stepper.scene().cables[0].joints.last();
    let wrench = last.and_then(|&joint| stepper.force_on(joint, 1));
    wrench.map_or(Vector3::repeat(f64::NAN), |w| w.force)
}

/// The load under its slack cable.
struct Lying {
    scene: Scene,
    /// Largest error of the floor's force in the last two seconds, over the weight.
    floor: f64,
    /// Downward pull of the cable on the load \[N].
    share: f64,
    gained: f64,
}

/// Sets the load down and lets the cable come to rest.
fn set_down(segments: usize) -> Result<Lying, ExperimentError> {
    let mut stepper = stepped(hanging(segments)?, DT)?;
    let mut floor = 0.0;
    let falling = drive(&mut stepper, [-SPEED, DOWN / SPEED], |_| {})?;
    let calming = drive(&mut stepper, [0.0, REST - 2.0], |_| {})?;
    let resting = drive(&mut stepper, [0.0, 2.0], |stepper| {
        let sum = borne(stepper).z + pull(stepper).z;
        floor = worse(floor, (sum / (MASS * GRAVITY) - 1.0).abs());
    })?;
    Ok(Lying {
        floor,
        share: -pull(&stepper).z,
        gained: worse(falling, worse(calming, resting)),
        scene: stepper.into_scene(),
    })
}

/// Its peak, and the largest energy from nowhere, of a load that is picked up.
fn pick_up(lying: Scene, dt: f64) -> Result<(Check, f64), ExperimentError> {
    let mut stepper = stepped(lying, dt)?;
    let mut peak = 0.0;
    let gained = drive(&mut stepper, [SPEED, DOWN / SPEED], |stepper| {
        peak = worse(peak, pull(stepper).norm());
    })?;
    let bound = MASS * GRAVITY + SPEED * (EA / LENGTH * MASS).sqrt();
    let texts = [format!("{bound:.1} N at most"), format!("{peak:.1} N")];
    let case = format!("load picked up, {:.0} steps a second: peak", 1.0 / dt);
    let [reference, ours] = texts;
    let height = stepper.scene().bodies.position[1].z - 0.5 * EDGE;
    let lifted = peak >= MASS * GRAVITY && height > 0.0;
    let over = if lifted {
        worse(0.0, peak / bound - 1.0)
    } else {
        f64::NAN
    };
    let check = Check::within(case, reference, ours, over, OVER);
    let note = format!("{height:.4} m above the floor at the end");
    Ok((check.by("overshoot, relative").noting(note), gained))
}

pub(super) fn outcome(quick: bool) -> Result<Outcome, ExperimentError> {
    let counts: &[usize] = either(quick, &[8, 16], &[8, 16, 32]);
    let (mut checks, mut errors, mut gained) = (Vec::new(), Vec::new(), 0.0);
    for &segments in counts {
        let found = set_down(segments)?;
        gained = worse(gained, found.gained);
        let case = format!("load set down on {segments} segments: N = M g − T at rest");
        let check = Check::off(case, "balance", found.floor, "M g", BAR);
        let note = format!("the cable adds {:.4} N of its weight", found.share);
        checks.push(check.by("largest error in two seconds").noting(note));
        let [head, load] = [0, 1].map(|body| found.scene.bodies.position[body]);
        let ends = [head, load + Vector3::z() * 0.5 * EDGE];
        let place = middle(&found.scene);
        let off = |other: Vector3<f64>| (place - other).norm() / LENGTH;
        let case = format!("slack cable of {segments} segments: its middle");
        let same = off(resting(segments, ends)?);
        let check = Check::off(case, "the static equilibrium", same, "L", SHAPE);
        let coarse = off(resting(FINE, ends)?);
        errors.push(coarse);
        checks.push(check.space_part(coarse));
        if errors.len() == counts.len() {
            for dt in [DT, either(quick, 4.0, 1.0) / 6000.0] {
                let (peak, found) = pick_up(found.scene.clone(), dt)?;
                gained = worse(gained, found);
                checks.push(peak);
            }
        }
    }
    let last = errors.len() - 1;
    let order = (errors[0] / errors[last]).log2() / last as f64;
    let check = Check::second_order("slack cable: order in N of its middle", order, ORDER);
    checks.push(check.noting(format!("first and last N, against {FINE} segments")));
    let case = "load on segments set down and picked up: energy";
    let check = Check::off(case, "none gained", gained, "", GAINED);
    checks.push(check.by("energy from nowhere over the motion's own"));
    Ok(checks.into())
}
