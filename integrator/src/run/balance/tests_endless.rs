//! Energies that are infinite, no number, or hidden behind larger ones.

use crate::testing::*;

/// A point of this mass (kg) on a joint of this compliance (m/N), which moves at this speed (m/s).
fn hung(mass: f64, compliance: f64, speed: f64, energy_tolerance: Option<f64>) -> Stepper {
    let mut scene = on_earth("hung");
    let mut point = Body::particle(mass);
    point.velocity.x = speed;
    let point = scene.add_body("point", point);
    let joint = Spherical {
        frames: [origin(), centre(point)],
        stretch: RowLaw::new(compliance, 0.0),
    };
    scene.add_constraint("joint", joint, 0);
    let options =
        StepOptions::default().with(|o| (o.energy_tolerance, o.guard) = (energy_tolerance, None));
    Stepper::new(scene, options).unwrap()
}

/// λ² of 10¹⁵⁴ kg is infinite, and what a rigid joint stores is 0 nevertheless.
#[test]
fn a_rigid_joint_stores_nothing_however_large_its_force() {
    for mass in [1.0, 1e150, 1e153, 1e154, 1e155] {
        let mut stepper = hung(mass, 0.0, 0.0, None);
        for _ in 0..20 {
            stepper.step().unwrap();
            assert_eq!(stepper.energy().elastic, 0.0, "{mass:e}");
            assert!(stepper.energy().total().is_finite(), "{mass:e}");
        }
    }
}

#[test]
fn an_energy_without_end_is_an_error() {
    for (mass, compliance, speed) in [
        (1e155, 1e-155, 0.0),
        (1e156, 1e-158, 0.0),
        (1e100, 1e-10, 1e110),
        (1e154, 1.0, 1e80),
    ] {
        let mut stepper = hung(mass, compliance, speed, Some(0.2));
        let error = (0..20).find_map(|_| stepper.step().err());
        assert!(
            matches!(
                error,
                Some(
                    StepError::EnergyGain { .. }
                        | StepError::NonFinite { .. }
                        | StepError::Solve { .. }
                )
            ),
            "{mass:e} {compliance:e}: {error:?}, {:?}",
            stepper.energy()
        );
    }
}

/// A blow from nowhere leaves 10⁴ times the motion's energy, and 10⁶ times for an instant; in the second run the scene changes
/// four steps later.
#[test]
fn a_gain_does_not_hide_behind_the_blow_that_made_it() {
    for changes in [false, true] {
        let mut scene = Scene::new("free");
        let mut ball = Body::sphere(0.1, 1.0);
        ball.velocity.x = 1.0;
        scene.add_body("ball", ball);
        let options = StepOptions::default().with(|o| o.energy_tolerance = Some(0.2));
        let mut stepper = Stepper::new(scene, options).unwrap();
        let kick = |stepper: &mut Stepper, factor: f64| {
            stepper.step().unwrap();
            stepper.step.scene.bodies.velocity[0] *= factor;
        };
        kick(&mut stepper, 1e3);
        kick(&mut stepper, 0.1);
        stepper.steps(4);
        if changes {
            let far = Body::particle(1.0).at(Vector3::y() * 50.0);
            let added = stepper.change(|edit| Ok(edit.add_body("far", far)));
            added.unwrap();
        }
        let found = (0..5).find_map(|_| stepper.step().err());
        let gained = matches!(found, Some(StepError::EnergyGain { .. }));
        assert!(gained, "{changes}: {found:?}");
    }
}
