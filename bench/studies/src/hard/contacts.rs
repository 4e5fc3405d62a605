//! Hard cases of contacts with dry friction that are programs: H55, and cables of segments on a cylinder and on the ground.

mod edge;
mod touchdown;
mod wound;

use super::{Coded, no_scenes};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;
use taut_integrator::{StepError, StepOptions, StepReport, Stepper};
use taut_model::Scene;
use taut_model::collide::{Collider, Shape, Surface};

pub const CASES: &[Coded] = &[
    Coded {
        name: "H55",
        title: "a taut cable with heavy loads over an edge",
        run: edge::outcome,
        // Not audited: cg:jacobi at a tolerance of 10⁻⁴ once reports 7.9·10⁻⁵ of a residual of 4.8·10⁻⁴ in the first step
        // here, though what it reports is the true residual of the system that it was given.
        scenes: no_scenes,
    },
    Coded {
        name: "wound",
        title: "the capstan of masses and of segments on a cylinder with friction",
        run: wound::outcome,
        scenes: wound::scenes,
    },
    Coded {
        name: "touchdown",
        title: "a catenary that lies on a rough floor and is dragged",
        run: touchdown::outcome,
        scenes: touchdown::scenes,
    },
];

/// The default surface with this friction.
fn rough(friction: f64) -> Surface {
    Surface {
        friction,
        ..Surface::default()
    }
}

/// The drum of a capstan, or an edge: a fixed cylinder along y.
fn cylinder(name: &str, friction: f64, length: f64, radius: f64) -> Collider {
    Collider {
        surface: rough(friction),
        orientation: UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2),
        ..Collider::new(name, None, Shape::Capsule { length, radius })
    }
}

/// So many steps of a scene, each of which `each` sees; how many were undecided, or redone by the guard, in words.
fn run(
    scene: Scene,
    options: StepOptions,
    steps: usize,
    mut each: impl FnMut(&Stepper, &StepReport),
) -> Result<(Stepper, String), StepError> {
    let mut stepper = Stepper::new(scene, options)?;
    let (mut undecided, mut redone) = (0, 0);
    for _ in 0..steps {
        let report = taut_ground::pace::step(&mut stepper)?;
        undecided += usize::from(report.undecided > 0);
        redone += usize::from(report.redone);
        each(&stepper, &report);
    }
    let said = format!("{undecided} undecided, {redone} redone steps");
    Ok((stepper, said))
}

/// The resultant of what the world's shapes exert \[N].
pub(super) fn borne(stepper: &Stepper) -> Vector3<f64> {
    let forces = stepper
        .contacts()
        .filter_map(|contact| match contact.bodies {
            [None, Some(_)] => Some(-contact.force),
            [Some(_), None] => Some(contact.force),
            _ => None,
        });
    forces.sum()
}
