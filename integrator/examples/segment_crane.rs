//! A small crane hoists 2 t on a cable of segments from 20 m to 5 m and lets it down again:
//! `cargo run -p taut-integrator --example segment_crane`

use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Body, Cable, CableEnd, Control, Frame, Material, Scene, Segments, Winch};
use taut_model::{SceneError, nalgebra::Vector3};

fn crane() -> Result<Scene, SceneError> {
    let mut scene = Scene::new("segment-crane");
    scene.gravity.z = -9.81;
    let load = Body::cuboid(Vector3::repeat(1.0), 2000.0).at(Vector3::z() * -20.5); // m, kg
    let load = scene.add_body("load", load);
    scene.load = Some(load);
    let jib = CableEnd::Clamped(Frame::world(Vector3::zeros()));
    let hook = CableEnd::Pinned(Frame::body(load, Vector3::z() * 0.5));
    let rope = scene.add_cable(&Cable {
        segments: Segments::Equal(20),
        winch: Some(Winch {
            force_limit: 5e4, // N
            shortest: 4.0,
            longest: 22.0,
            ..Winch::new()
        }),
        ..Cable::round("rope", &Material::STEEL, 0.008, [jib, hook])
    })?;
    // The winch is the cable's first joint; positive hauls in.
    scene
        .controls
        .push(Control::of("hoist_speed", rope.joints[0], -1.0));
    scene.start_in_equilibrium = true;
    Ok(scene)
}

fn run() -> Result<[f64; 2], StepError> {
    let mut stepper = Stepper::new(crane()?, StepOptions::default())?;
    let winch = stepper.constraint("rope-start")?;
    let mut highest = f64::NEG_INFINITY;
    for k in 0..3660 {
        let speed = if k < 1800 { 0.5 } else { -0.5 };
        stepper.set_control(0, if k < 3600 { speed } else { 0.0 })?; // m/s
        let t = stepper.step()?.time;
        let height = stepper.scene().bodies.position[0].z;
        highest = highest.max(height);
        if k % 300 == 0 {
            let winch = stepper.constraint_index(winch)?;
            let tension = stepper.tension(winch).unwrap_or(0.0); // N
            let segments = stepper.scene().cables[0].bodies.len();
            println!("{t:5.2} s {height:7.3} m  {segments:2} segments  {tension:6.0} N");
        }
    }
    Ok([highest, stepper.scene().bodies.position[0].z])
}

fn main() {
    if let Err(e) = run() {
        eprintln!("segment_crane: {e}"); // in its own words
    }
}

#[test]
fn runs() {
    let [highest, last] = run().unwrap();
    assert!((highest + 5.5).abs() < 0.02, "{highest}");
    assert!((last + 20.5).abs() < 0.05, "{last}");
}
