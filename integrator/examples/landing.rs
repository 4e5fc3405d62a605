//! A winch lowers a crate of 2 t onto the ground, slowly at last, until its cable is slack:
//! `cargo run -p taut-integrator --example landing`

use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Body, Collider, Control, Frame, MasslessCable, RowLaw, Scene, Shape, Winch};
use taut_model::{SceneError, nalgebra::Vector3};

fn crane() -> Result<Scene, SceneError> {
    let at = |z| Vector3::new(0.0, 0.0, z); // m
    let mut scene = Scene::new("landing");
    scene.gravity = at(-9.81);
    let size = Vector3::new(2.0, 2.0, 1.0);
    let load = scene.add_body("crate", Body::cuboid(size, 2000.0).at(at(1.5))); // kg
    scene.load = Some(load);
    scene.add_collider(Collider::new("crate", Some(load), Shape::Cuboid { size }));
    scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
    let ends = vec![Frame::world(at(20.0)), Frame::body(load, at(0.5))];
    let law = RowLaw::new(3.6e-6, 0.02); // m/N, s
    let mut rope = MasslessCable::new(ends, 18.0, law);
    rope.winch = Some(Winch::new());
    let rope = scene.add_constraint("rope", rope, 0);
    scene
        .controls
        .push(Control::of("lowering_speed", rope, 1.0));
    scene.start_in_equilibrium = true;
    Ok(scene)
}

fn run() -> Result<[f64; 2], StepError> {
    let mut stepper = Stepper::new(crane()?, StepOptions::default())?;
    let rope = stepper.scene().constraint("rope")?;
    let load = stepper.scene().body("crate")?;
    let (mut t, mut height, mut ground, mut tension) = (0.0_f64, 1.0, 0.0, f64::INFINITY);
    while t < 20.0 && tension > 0.0 {
        stepper.set_control(0, if height > 0.1 { 0.25 } else { 0.05 })?; // m/s
        t = stepper.step()?.time;
        height = stepper.scene().bodies.position[load].z - 0.5; // m
        let forces = stepper.contacts().map(|contact| contact.on(load));
        ground = forces.sum::<Vector3<f64>>().z; // N
        tension = stepper.tension(rope).unwrap_or(0.0); // N
        if (60.0 * t).round() % 30.0 == 0.0 {
            println!("{t:5.2} s {height:6.3} m  ground {ground:6.0} N  cable {tension:6.0} N");
        }
    }
    println!("{t:5.2} s: the cable is slack, the ground carries {ground:.0} N");
    Ok([ground, tension])
}

fn main() {
    if let Err(e) = run() {
        eprintln!("landing: {e}"); // in its own words
    }
}

#[test]
fn runs() {
    let [ground, tension] = run().unwrap();
    assert!((ground / (2000.0 * 9.81) - 1.0).abs() < 0.01 && tension == 0.0);
}
