//! A hook lets a rope down onto the ground and pulls it taut; its segments merge and split by rule:
//! `cargo run -p taut-integrator --example rope`

use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::scene::resolution::Resolution;
use taut_model::{Body, Cable, CableEnd, Collider, Damping, Frame, Material, Mobility, Scene};
use taut_model::{SceneError, Segments, Shape, Surface, nalgebra::Vector3};

fn scene() -> Result<Scene, SceneError> {
    let mut scene = Scene::new("rope");
    scene.gravity.z = -9.81;
    scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
    let hook = Body {
        mobility: Mobility::Driven,
        ..Body::sphere(0.1, 20.0) // m, kg
    };
    let hook = scene.add_body("hook", hook.at(Vector3::z() * 8.0));
    let ends = [
        Frame::body(hook, Vector3::zeros()),
        Frame::world(Vector3::new(3.0, 0.0, 0.05)),
    ];
    scene.add_cable(&Cable {
        segments: Segments::Equal(48),
        damping: Damping::Time(0.02), // s
        collide: Some(Surface::default()),
        resolution: Some(Resolution {
            bend: 0.2, // rad
            ..Resolution::default()
        }),
        ..Cable::round("rope", &Material::NYLON, 0.01, ends.map(CableEnd::Pinned))
    })?;
    Ok(scene)
}

/// Most and fewest segments.
fn run() -> Result<[usize; 2], StepError> {
    let mut stepper = Stepper::new(scene()?, StepOptions::default())?;
    let [mut most, mut fewest] = [0, usize::MAX];
    for k in 0..900 {
        let speed = match k {
            60..360 => -1.0,
            480..780 => 1.0,
            _ => 0.0,
        };
        stepper.set_velocity(0, Vector3::z() * speed, Vector3::zeros())?; // m/s
        let report = stepper.step()?;
        let segments = report.resolved.segments;
        (most, fewest) = (most.max(segments), fewest.min(segments));
        if k % 60 == 0 {
            let height = stepper.scene().bodies.position[0].z;
            let touching = report.contacts.touching;
            println!(
                "{:5.2} s  hook at {height:.2} m  {segments:2} segments  {touching:2} contacts",
                report.time
            );
        }
    }
    Ok([most, fewest])
}

fn main() {
    if let Err(e) = run() {
        eprintln!("rope: {e}"); // in its own words
    }
}

#[test]
fn runs() {
    let [most, fewest] = run().unwrap();
    assert!(most == 48 && fewest < 16, "{most} {fewest}");
}
