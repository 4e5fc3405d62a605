//! Forces of a step against the change of momentum in it, where several solves or a blow share it.

use crate::contact::tests::{add, bouncing, ground};
use crate::testing::*;

const DT: f64 = 1.0 / 60.0;
const MASS: f64 = 50.0;
const RADIUS: f64 = 0.25;

fn options(substeps: usize) -> StepOptions {
    StepOptions::default().with(|o| o.substeps = substeps)
}

/// Force on body 0 that all constraints and contacts report.
fn reported_force(stepper: &Stepper) -> Vector3<f64> {
    let constraints = 0..stepper.scene().constraints.len();
    let joints = constraints.map(|c| stepper.force(c).expect("a constraint").force);
    joints.sum::<Vector3<f64>>() + stepper.contacts().map(|c| c.on(0)).sum::<Vector3<f64>>()
}

/// Most that the reported force of a step differs from what accelerates body 0, over the largest force, in so many steps; the largest
/// force \[N]. A divided step leaves velocities of its end.
fn most_apart(stepper: &mut Stepper, steps: usize) -> (f64, f64) {
    let (mut most, mut largest, mut divided) = (0.0_f64, 0.0_f64, true);
    for _ in 0..steps {
        let before = stepper.scene().bodies.velocity[0];
        let is_divided = stepper.step().expect("a step").divided > 0;
        let scene = stepper.scene();
        let rate = (scene.bodies.velocity[0] - before) / DT;
        let needed = (rate - scene.gravity) * scene.bodies.mass[0];
        let force = reported_force(stepper);
        largest = largest.max(force.norm());
        if !is_divided && !divided {
            most = most.max((force - needed).norm());
        }
        divided = is_divided;
    }
    (most / largest, largest)
}

/// A load on a rope that is `slack` (m) longer than its way, of this compliance.
fn falling(slack: f64, compliance: f64) -> Scene {
    let mut scene = Scene::default().with(|p| p.gravity = Vector3::z() * -9.81);
    let load = scene.add_body("load", Body::sphere(RADIUS, MASS));
    let law = RowLaw::new(compliance, 0.0);
    let frames = vec![Frame::world(Vector3::z() * 2.0), centre(load)];
    let cable = MasslessCable::new(frames, 2.0 + slack, law);
    scene.add_constraint("rope", cable, 0);
    scene
}

/// A ball over a slope, and its place.
fn above(slope: f64, surface: Surface, drop: f64) -> (Scene, usize, Vector3<f64>) {
    let mut scene = ground(slope, surface);
    let at = Vector3::z() * (RADIUS + drop);
    let body = Body::sphere(RADIUS, MASS).at(at);
    let ball = add(&mut scene, body, Shape::Sphere { radius: RADIUS }, surface);
    (scene, ball, at)
}

#[test]
fn a_catch_is_told_whatever_the_sub_step_that_has_it() {
    for substeps in [1, 2, 4, 7] {
        let scene = falling(0.3, 1e-5);
        let mut stepper = Stepper::new(scene, options(substeps)).expect("a sound scene");
        let (apart, largest) = most_apart(&mut stepper, 40);
        assert!(apart < 1e-12, "{substeps}: {apart:e}");
        assert!(largest > 10.0 * MASS * 9.81, "{substeps}: {largest}");
    }
}

/// A ball that strikes a wall, on a rod of 2 m.
#[test]
fn a_blow_that_passes_through_a_rod_is_in_its_force() {
    for substeps in [1, 3] {
        let (mut scene, ball, at) = above(0.5, bouncing(0.7, 0.3), 0.05);
        let (far, own) = (at + Vector3::new(-1.8, 0.0, 0.6), Vector3::zeros());
        let frames = [Frame::world(far), Frame::body(ball, own)];
        let rod = link(frames, (far - at).norm(), RowLaw::RIGID);
        scene.add_constraint("rod", rod, 0);
        let mut stepper = Stepper::new(scene, options(substeps)).expect("a sound scene");
        let (apart, _) = most_apart(&mut stepper, 60);
        // The rod turns by up to 0.02 rad in a step.
        assert!(apart < 2e-2, "{substeps}: {apart:e}");
    }
}

#[test]
fn a_restored_run_tells_the_same() {
    let mut stepper = Stepper::new(falling(0.3, 1e-5), options(4)).expect("a sound scene");
    stepper.steps(17);
    let restored = stepper.saved();
    let force = stepper.row_forces(0).expect("a rope");
    let holds = force[0] < -1e3 && stepper.step.output.reported.forces().is_some();
    assert!(holds, "{force:?}");
    assert_eq!(force, restored.row_forces(0).expect("a rope"));
}
