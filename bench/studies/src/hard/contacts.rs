//! Hard cases of contacts with dry friction that are programs: H55, and cables of segments on a cylinder and on the ground.

mod edge;
mod touchdown;
mod wound;

use super::{Coded, no_scenes};
use nalgebra::Vector3;
use taut_integrator::{StepError, StepOptions, StepReport, Stepper};
use taut_model::Scene;
use taut_model::collide::Surface;

const GRAVITY: f64 = 9.81;
const DT: f64 = 1.0 / 60.0;

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

/// Steps of a run with something undecided, and those that the guard redid.
#[derive(Debug, Clone, Copy, Default)]
struct Said {
    undecided: usize,
    redone: usize,
}

/// So many steps of a scene, each of which `each` sees.
fn run(
    scene: Scene,
    options: StepOptions,
    steps: usize,
    mut each: impl FnMut(&Stepper, &StepReport),
) -> Result<(Stepper, Said), StepError> {
    let mut stepper = Stepper::new(scene, options)?;
    let mut said = Said::default();
    for _ in 0..steps {
        let report = taut_ground::pace::step(&mut stepper)?;
        said.undecided += usize::from(report.undecided > 0);
        said.redone += usize::from(report.redone);
        each(&stepper, &report);
    }
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
