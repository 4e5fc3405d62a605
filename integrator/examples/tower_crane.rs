//! A tower crane: 5 t on two slings under 20 m of steel cable, driven along the jib until the cable is overloaded:
//! `cargo run -p taut-integrator --example tower_crane`

use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Body, Cable, CableEnd, Control, Frame, MasslessCable, Material, Motor};
use taut_model::{RowLaw, Scene, SceneError, Segments, Slider, nalgebra::Vector3};

fn crane() -> Result<Scene, SceneError> {
    let at = |x, z| Vector3::new(x, 0.0, z); // m
    let on = |body, x, z| Frame::body(body, at(x, z));
    let mut scene = Scene::new("tower-crane");
    scene.gravity = at(0.0, -9.81);
    let mast = scene.add_body("mast", Body::fixed());
    let trolley = scene.add_body("trolley", Body::sphere(0.5, 400.0).at(at(10.0, 40.0)));
    let hook = scene.add_body("hook", Body::sphere(0.2, 300.0).at(at(10.0, 19.8)));
    let load = Body::cuboid(Vector3::new(2.0, 2.0, 1.0), 5000.0).at(at(10.0, 17.3)); // m, kg
    let load = scene.add_body("load", load);
    scene.load = Some(load);
    let rail = [on(mast, 10.0, 40.0), on(trolley, 0.0, 0.0)].map(|f| f.along(&Vector3::x()));
    let rail = scene.add_constraint("rail", Slider::new(rail).driven(Motor::speed(0.0)), 0);
    scene.controls.push(Control::of("trolley_speed", rail, 1.0));
    for (name, x) in [("left", -1.0), ("right", 1.0)] {
        let ends = vec![on(hook, 0.0, 0.0), on(load, x, 0.5)];
        let law = RowLaw::new(2e-7, 0.0); // m/N
        scene.add_constraint(name, MasslessCable::new(ends, 5_f64.sqrt(), law), 0);
    }
    let ends = [on(trolley, 0.0, 0.0), on(hook, 0.0, 0.2)].map(CableEnd::Pinned);
    let mut rope = Cable::round("rope", &Material::STEEL, 0.012, ends);
    rope.segments = Segments::Equal(30);
    scene.add_cable(&rope)?;
    scene.start_in_equilibrium = true;
    Ok(scene)
}

fn run() -> Result<(), StepError> {
    let mut stepper = Stepper::new(crane()?, StepOptions::default())?;
    println!("solver {}", stepper.options().backend); // the first that the features bring
    let load = stepper.scene().body("load")?;
    let (mut t, mut tension) = (0.0_f64, 0.0);
    while t < 20.0 && tension < 57e3 {
        stepper.set_control(0, t.min(2.0).min(4.0 * (8.0 - t)).max(0.0))?; // m/s
        t = stepper.step()?.time;
        tension = stepper.tension_in("rope", 0)?; // N
        if (60.0 * t).round() % 60.0 == 0.0 {
            let x = stepper.scene().bodies.position[load]; // m
            println!("{t:5.2} s {:7.3} m {:7.3} m {tension:6.0} N", x.x, x.z);
        }
    }
    println!("{t:5.2} s: stopped at {tension:.0} N");
    Ok(())
}

fn main() {
    run().unwrap_or_else(|e| eprintln!("tower_crane: {e}")); // in its own words
}

#[test]
fn runs() {
    run().unwrap();
}
