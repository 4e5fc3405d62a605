//! Hard cases in motion: H12, H20 to H39, H48, H59 and H61, and the gantry crane driven for a minute.

mod beam;
mod bounce;
mod capstan;
mod chain;
mod changes;
mod crane;
mod damped;
mod damping;
mod falling;
pub(super) mod frequency;
mod gantry;
mod heavy;
mod hoisting;
mod line;
mod pendulum;
mod resolution;
mod shape;
pub(super) mod snap;
mod spaghetti;
mod strings;
mod tackle;
mod top;
mod torque;
mod torsion;
mod waves;
mod whirl;
mod winding;

use super::{Case, worse};
use taut_ground::pace;
use taut_integrator::{Energy, StepError, StepOptions, Stepper};
use taut_model::{Control, Drive, Scene};

pub const CASES: &[Case] = &[
    Case {
        name: "gantry",
        title: "the gantry crane driven for a minute, loads to 10⁵ cable elements",
        run: gantry::outcome,
        scenes: gantry::scenes,
    },
    Case {
        name: "H12",
        title: "sheaves, drums and the capstan",
        run: capstan::outcome,
        scenes: capstan::scenes,
    },
    Case {
        name: "H20",
        title: "a pendulum of large amplitude",
        run: pendulum::outcome,
        scenes: pendulum::scenes,
    },
    Case {
        name: "H21",
        title: "frequencies of a hanging chain, with a payload and without",
        run: chain::outcome,
        scenes: chain::scenes,
    },
    Case {
        name: "H22",
        title: "a taut string, a stiff one",
        run: strings::outcome,
        scenes: strings::scenes,
    },
    Case {
        name: "H23",
        title: "longitudinal waves in a steel bar",
        run: waves::outcome,
        scenes: || Ok(vec![waves::pulled()]),
    },
    Case {
        name: "H24",
        title: "a torsional pendulum",
        run: torsion::outcome,
        scenes: torsion::scenes,
    },
    Case {
        name: "H25",
        title: "bending modes of beams",
        run: beam::outcome,
        scenes: beam::scenes,
    },
    Case {
        name: "H26",
        title: "a folded chain that falls",
        run: falling::outcome,
        scenes: || Ok(vec![falling::chain(25)]),
    },
    Case {
        name: "H27",
        title: "a slack rope that snaps taut",
        run: snap::outcome,
        scenes: snap::scenes,
    },
    Case {
        name: "H28",
        title: "a pendulum that is hoisted slowly",
        run: hoisting::outcome,
        scenes: hoisting::scenes,
    },
    Case {
        name: "H29",
        title: "frequencies of cranes: trolley, hook and load, two parallel cables, the gantry",
        run: crane::outcome,
        scenes: || {
            Ok(vec![
                crane::on_a_trolley().0,
                crane::hook_and_load(),
                crane::on_two_cables().0,
            ])
        },
    },
    Case {
        name: "H30",
        title: "masses over a sheave, tackles of 2 to 12 parts",
        run: tackle::outcome,
        scenes: tackle::scenes,
    },
    Case {
        name: "H31",
        title: "the flying spaghetti",
        run: spaghetti::outcome,
        scenes: spaghetti::scenes,
    },
    Case {
        name: "H32",
        title: "a free body about its intermediate axis",
        run: top::outcome,
        scenes: || Ok(vec![top::scene(5.0)]),
    },
    Case {
        name: "H33",
        title: "the law by which a step damps a deformation mode",
        run: damping::outcome,
        scenes: damping::modes_at_the_start,
    },
    Case {
        name: "H34",
        title: "the time in which an initial gap closes",
        run: damping::gaps,
        scenes: damping::gap_at_the_start,
    },
    Case {
        name: "H35",
        title: "loads that fall into slack ropes, and what the ropes give back",
        run: bounce::outcome,
        scenes: bounce::scenes,
    },
    Case {
        name: "H36",
        title: "heavy loads that snap coarse cables taut",
        run: heavy::outcome,
        scenes: || Ok(vec![heavy::hoist(6, 1e4, 2.6, 7).build()?]),
    },
    Case {
        name: "H37",
        title: "a twisted cable in motion stays straight to Greenhill's torque",
        run: torque::outcome,
        scenes: || Ok(vec![torque::scene(8, 1.0, 100.0)?]),
    },
    Case {
        name: "H38",
        title: "bodies whirled by up to three turns a step",
        run: whirl::outcome,
        scenes: whirl::scenes,
    },
    Case {
        name: "H39",
        title: "a winch that hauls in a moving load from the start",
        run: bounce::winch,
        scenes: || Ok(vec![bounce::hauled()]),
    },
    Case {
        name: "H48",
        title: "segments that merge and split at a winch",
        run: winding::outcome,
        scenes: winding::scenes,
    },
    Case {
        name: "H48-rule",
        title: "segments that merge and split by rule",
        run: resolution::outcome,
        scenes: resolution::scenes,
    },
    Case {
        name: "H59",
        title: "hooked on, let go, cut and broken while it moves",
        run: changes::outcome,
        scenes: changes::scenes,
    },
    Case {
        name: "H61",
        title: "a slack rope with a damper catches a load where it is taut",
        run: damped::outcome,
        scenes: damped::scenes,
    },
];

/// A control that hauls in the cable which is the scene's first constraint, metres a second.
fn hauling(name: &str) -> Control {
    Control {
        name: name.to_owned(),
        drives: vec![Drive {
            constraint: 0,
            gain: -1.0,
        }],
    }
}

/// The energy of a run beside that of its start.
struct Gained {
    start: Energy,
    /// Largest energy less that of the start \[J].
    largest: f64,
    /// Steps that the guard took implicitly.
    redone: usize,
    /// Why it ended early.
    lost: Option<StepError>,
}

impl Gained {
    fn over(scene: Scene, options: StepOptions, time: f64) -> Result<Self, StepError> {
        let steps = (time / options.dt).round() as usize;
        let mut stepper = Stepper::new(scene, options)?;
        let mut run = Self {
            start: stepper.energy(),
            largest: 0.0,
            redone: 0,
            lost: None,
        };
        for _ in 0..steps {
            match pace::step(&mut stepper) {
                Ok(report) => run.redone += usize::from(report.redone),
                Err(e) => {
                    run.lost = Some(e);
                    break;
                }
            }
            let gained = stepper.energy().total() - run.start.total();
            run.largest = worse(run.largest, gained);
        }
        Ok(run)
    }
}
