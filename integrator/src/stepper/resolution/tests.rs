//! Cables that refine themselves.

use super::*;
use crate::StepOptions;
use nalgebra::Vector3;
use taut_model::scene::resolution::Resolution;
use taut_model::{Body, Cable, CableEnd, Frame, Material, Segments};

fn rule() -> Resolution {
    Resolution {
        bend: 0.05,
        ..Resolution::default()
    }
}

/// A rope of 12 m in `segments` between points 10 m apart, laid as a triangle; at rest after a while.
fn catenary(segments: usize, resolution: Option<Resolution>) -> Stepper {
    let mut scene = Scene::new("catenary");
    scene.gravity.z = -9.81;
    let ends = [0.0, 10.0].map(|x| CableEnd::Pinned(Frame::world(Vector3::x() * x)));
    let cable = Cable {
        segments: Segments::Equal(segments),
        points: vec![Vector3::new(5.0, 0.0, -(11.0_f64.sqrt()))],
        resolution,
        damping: taut_model::Damping::Time(0.05),
        ..Cable::round("rope", &Material::NYLON, 0.01, ends)
    };
    scene.add_cable(&cable).unwrap();
    scene.start_in_equilibrium = true;
    Stepper::new(scene, StepOptions::default()).unwrap()
}

/// Lowest point of the cable \[m].
fn lowest(scene: &Scene) -> f64 {
    let bodies = &scene.bodies;
    let heights = scene.cables[0].bodies.iter().map(|i| bodies.position[*i].z);
    heights.fold(0.0, f64::min)
}

#[test]
fn a_catenary() {
    for (n, r) in [
        (256, None),
        (256, Some(rule())),
        (64, None),
        (
            16,
            Some(Resolution {
                shortest: 0.04,
                ..rule()
            }),
        ),
    ] {
        let mut stepper = catenary(n, r);
        let mut total = Resolved::default();
        for _ in 0..1200 {
            let report = stepper.step().unwrap();
            total.splits += report.resolved.splits;
            total.merges += report.resolved.merges;
        }
        let lengths: Vec<f64> = (0..stepper.scene().cables[0].bodies.len())
            .map(|k| stepper.scene().segment_length(0, k).unwrap_or(0.0))
            .collect();
        println!(
            "{n} {} {} {} {:?} {lengths:.2?}",
            stepper.scene().cables[0].bodies.len(),
            lowest(stepper.scene()),
            stepper.tension(0).unwrap(),
            total
        );
    }
    let _ = Body::sphere(1.0, 1.0);
}
