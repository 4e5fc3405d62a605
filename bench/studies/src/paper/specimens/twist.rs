//! Fig. 11: twist. Ω = T L/GJ, to 37 turns with the winding followed, and what ends it.
//!
//! **At rest** the torque rises in steps in which no joint turns by more than half a turn; the exactly straight
//! specimen keeps exact zeros across, and the discrete answer T l_j/GJ a joint is met to rounding by every material and
//! every N (`rest`).
//!
//! **In motion** a twisted rod does not stay straight. Without tension it buckles at Greenhill's torque
//! ([`buckling_torque`]): with GJ = Y I_a/(2(1 + ν)), J_t = I_a as the paper writes, that is 3.7 turns of any material
//! with both ends held in line and 2.6 between pinned ends; with the square's own J_t it is 2.2 and 1.5. A tension
//! P > T²/(4YI) keeps a long rod straight. The dynamic runs are those of [`Motion`].
//!
//! **Leak**: what the twist row reads at a joint that is bent without twist, by definition of the angle ([`leaks`]).

mod buckling;
mod motion;
mod report;
mod rest;

pub use buckling::{buckling_torque, greenhill};
pub use motion::{Motion, Step};
pub use report::outcome;
pub use rest::leaks;
pub(in crate::paper) use rest::twisted;

use super::{Joint, MATERIALS, POISSON, SEGMENTS, params};
use crate::checks::each;
use crate::options::pick;
use indicatif::ProgressBar;
use serde_json::Value;
use std::f64::consts::TAU;
use taut_model::{Specimen, SpecimenParams};
use taut_output::check::ExperimentError;

/// The paper's largest twist \[rad].
pub const FARTHEST: f64 = 233.0;

/// Without tension, 1 turn in 4 s.
fn loose(joint: Joint, segments: usize, step: Step, dt: f64) -> Motion {
    Motion {
        joint,
        segments,
        step,
        dt,
        tension: 0.0,
        disturbed: true,
        turns: 12.0,
        ramp: 48.0,
        hold: 0.0,
    }
}

/// With tension, to 37 turns and 5 s more.
fn taut(segments: usize, step: Step, tension: f64) -> Motion {
    Motion {
        tension,
        turns: FARTHEST / TAU,
        ramp: 10.0,
        hold: 5.0,
        ..loose(Joint::Cosserat, segments, step, DT)
    }
}

const DT: f64 = 1.0 / 60.0;

/// The paper's joint and the taut specimen.
fn few() -> Vec<Motion> {
    vec![
        loose(Joint::Ordinary, 24, Step::Paper, DT),
        loose(Joint::Cosserat, 24, Step::Default, DT),
        taut(24, Step::Paper, 1.1),
        taut(24, Step::Default, 1.1),
        taut(24, Step::Stiffened, 1.1),
    ]
}

/// The paper's N and both steps, and finer ones.
fn all() -> Vec<Motion> {
    use Joint::{Alternative, Cosserat, Ordinary};
    use Step::{Default, Paper, Stiffened};
    let mut motions = Vec::new();
    for n in SEGMENTS {
        for joint in Joint::ALL {
            motions.extend([Paper, Default].map(|step| loose(joint, n, step, DT)));
        }
    }
    motions.extend([Ordinary, Alternative].map(|joint| Motion {
        disturbed: false,
        turns: FARTHEST / TAU,
        ..loose(joint, 24, Paper, DT)
    }));
    motions.extend([Ordinary, Alternative].map(|joint| Motion {
        turns: 0.0,
        ramp: 10.0,
        ..loose(joint, 24, Paper, DT)
    }));
    let finer = [(Paper, 4.0), (Default, 4.0), (Default, 16.0)];
    motions.extend(finer.map(|(step, parts)| loose(Cosserat, 24, step, DT / parts)));
    for n in [12, 24] {
        for tension in [0.6, 1.1] {
            motions.extend([Paper, Default, Stiffened].map(|step| taut(n, step, tension)));
        }
    }
    motions.push(taut(24, Default, 2.0));
    motions
}

/// A steel or other specimen with the paper's GJ = Y I_a/(2(1 + ν)).
fn specimen(
    material: (&str, f64),
    segments: usize,
    joint: Joint,
) -> Result<SpecimenParams, ExperimentError> {
    let square = params(Specimen::Twist, material, segments, joint);
    let ei = square.resolve()?.stiffness.ei;
    Ok(SpecimenParams {
        gj: Some(ei / (2.0 * (1.0 + POISSON))),
        ..square
    })
}

/// Specimens at rest, in motion, in parallel, and the leaks of a bent joint; in the quick form steel alone at rest.
pub fn run(quick: bool, progress: &ProgressBar) -> Result<[Vec<Value>; 3], ExperimentError> {
    let mut tasks = Vec::new();
    for &material in pick(quick, [&MATERIALS[..], &MATERIALS[2..]]) {
        for n in SEGMENTS {
            tasks.extend(Joint::ALL.map(|joint| (material, n, joint)));
        }
    }
    let rows = each(&tasks, progress, |&(material, n, joint)| {
        rest::at_rest(material, n, joint)
    })?;
    progress.reset();
    let motions = if quick { few() } else { all() };
    let held = each(&motions, progress, motion::in_motion)?;
    Ok([rows.concat(), held, leaks()?])
}
