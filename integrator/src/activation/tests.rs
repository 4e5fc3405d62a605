use crate::testing::*;

pub(super) const G: f64 = 9.81;
pub(super) const DT: f64 = 1.0 / 60.0;
/// Mass of the load that falls \[kg], length of its rope \[m].
const LOAD: f64 = 50.0;
const LENGTH: f64 = 4.0;

pub(super) fn options(dt: f64, substeps: usize) -> StepOptions {
    StepOptions {
        dt,
        substeps,
        backend: taut_solver::Backend::Dense(taut_solver::DenseOptions::default()),
        ..StepOptions::default()
    }
}

pub(super) fn ball(scene: &mut Scene, mass: f64, at: Vector3<f64>) -> Frame {
    let body = scene.add_body(format!("ball {at}"), Body::sphere(0.1, mass).at(at));
    centre(body)
}

pub(super) fn rope(scene: &mut Scene, frames: Vec<Frame>, length: f64, law: RowLaw) {
    let name = format!("rope {}", scene.constraints.len());
    scene.add_constraint(name, MasslessCable::new(frames, length, law), 0);
}

/// A ball at `at` on a rope from `top`.
pub(super) fn hung(
    mass: f64,
    [at, top]: [Vector3<f64>; 2],
    length: f64,
    law: RowLaw,
    winch: Option<Winch>,
) -> Scene {
    let mut scene = on_earth("hung");
    let load = ball(&mut scene, mass, at);
    let cable = reeled(winch, vec![Frame::world(top), load], length, law);
    scene.add_constraint("rope", cable, 0);
    scene
}

/// The load `height` above where its rope is straight, whose law and winch these are.
fn falling_on(height: f64, law: RowLaw, winch: Option<Winch>) -> Scene {
    let at = Vector3::z() * (height - LENGTH);
    hung(LOAD, [at, Vector3::zeros()], LENGTH, law, winch)
}

fn falling(height: f64, compliance: f64) -> Scene {
    falling_on(height, RowLaw::new(compliance, 0.0), None)
}

/// Compliance at which Ω of a step `DT` is `omega`.
fn compliance(omega: f64) -> f64 {
    (DT / omega).powi(2) / LOAD
}

/// A rigid rope that is too short is taken back over the step, however short the sub-steps of its redoing.
#[test]
fn drift_is_taken_back_over_the_whole_step() {
    let gap = 4e-3;
    let mut scene = falling(-gap, 0.0);
    // So that no step is as its linearisation says.
    scene.bodies.velocity[0].x = 1.0;
    let guard = Guard::default().with(|g| (g.tolerance, g.substeps) = (f64::MIN_POSITIVE, 8));
    let options = options(DT / 4.0, 1).with(|o| o.guard = Some(guard));
    let speed = gap / options.dt;
    let mut stepper = Stepper::new(scene, options).unwrap();
    let start = stepper.energy().total();
    for step in 0..240 {
        let redone = stepper.step().unwrap().redone;
        // A slack rope has no gap that could disagree.
        assert!(redone || step > 0);
        let gain = stepper.energy().total() - start;
        let allowed = 0.5 * LOAD * speed * speed + LOAD * G * gap;
        assert!(gain < 1.05 * allowed, "{gain} J of {allowed} J");
    }
}

/// A rod made in flight stops a load along it: without rebound where it is stiff, with a rebound that the steps resolve where it
/// is soft.
#[test]
fn a_rod_that_is_made_between_parting_bodies_stops_them_without_a_rebound() {
    // Velocities of the middles of steps are larger by Ω²/24 of a swing.
    for (omega, highest) in [
        (f64::INFINITY, 0.01),
        (300.0, 0.01),
        (30.0, 0.05),
        (0.2, 1.002),
    ] {
        for speed in [0.3, 3.0, -3.0] {
            for substeps in [1, 2, 4] {
                let mut scene = Scene::new("caught");
                let load = ball(&mut scene, LOAD, Vector3::z() * -LENGTH);
                let body = load.body_index().unwrap();
                scene.bodies.velocity[body] = Vector3::new(0.0, 0.0, -speed);
                let mut stepper = Stepper::new(scene, options(DT, substeps)).unwrap();
                stepper.step().unwrap();
                let length = -stepper.scene().bodies.position[body].z;
                let law = RowLaw::new(compliance(omega * substeps as f64), 0.0);
                let rod = link([origin(), load], length, law);
                stepper.tie("rod", rod);
                let mut fastest = 0.0_f64;
                for _ in 0..120 {
                    stepper.step().unwrap();
                    let away = -stepper.scene().bodies.velocity[body].z / speed;
                    fastest = fastest.max(-away);
                }
                let what = format!("Ω = {omega}, {speed} m/s, {substeps} sub-steps: {fastest}");
                assert!(fastest <= highest + 1e-9, "{what}");
                assert!(omega > 1.0 || fastest > 0.9, "{what}");
            }
        }
    }
}

/// A load swings on a rigid rope as a rod to another point is made: the rod takes over without throwing it off.
#[test]
fn a_rod_beside_a_rigid_rope_takes_its_load_over() {
    for substeps in [1, 4, 16, 64] {
        let mut scene = on_earth("held twice");
        let load = ball(&mut scene, LOAD, Vector3::zeros());
        let body = load.body_index().unwrap();
        let hub = Vector3::new(-0.06, 0.0, 3.0);
        let frames = vec![Frame::world(hub), load];
        let rope = MasslessCable::new(frames, hub.norm(), RowLaw::new(0.0, 0.0));
        scene.add_constraint("rope", rope, 0);
        let mut stepper = Stepper::new(scene, options(DT, substeps)).unwrap();
        stepper.steps(30);
        let bodies = &stepper.scene().bodies;
        let before = bodies.velocity[body].norm();
        assert!(before > 0.05, "it swings: {before}");
        let anchor = Vector3::new(0.2, 0.0, 1.0);
        let rod = link(
            [Frame::world(anchor), load],
            (anchor - bodies.position[body]).norm(),
            RowLaw::new(1e-10, 0.0),
        );
        stepper.tie("rod", rod);
        for n in 0..15 {
            stepper.step().unwrap();
            let speed = stepper.scene().bodies.velocity[body].norm();
            let what = format!("{substeps} sub-steps, step {n}: {speed} m/s of {before}");
            assert!(speed < 1.1 * before, "{what}");
        }
    }
}
