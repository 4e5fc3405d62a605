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

mod motion;
mod report;
mod rest;

pub use crate::buckling::{buckling_torque, greenhill};
pub use motion::{Motion, Step};
pub use report::outcome;
pub(in crate::paper) use rest::at_rest;
pub use rest::leaks;

use super::{Joint, MATERIALS, POISSON, params, tasks};
use crate::checks::each;
use crate::options::pick;
use crate::paper::words::with;
use indicatif::ProgressBar;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use taut_model::{Specimen, SpecimenParams};
use taut_output::check::ExperimentError;

/// YA L²/YI of the paper's specimen: 12 L²/A.
const SLENDERNESS: f64 = 1.2e5;

/// Turns at a torque in units of YI/L, for the paper's J_t = I_a.
fn turns(torque: f64) -> f64 {
    torque * 2.0 * (1.0 + POISSON) / TAU
}

/// The paper's largest twist \[rad].
pub const FARTHEST: f64 = 233.0;

/// The runs of `motions.toml`: all combinations of what its entries list.
fn motions(quick: bool) -> Result<Vec<Motion>, ExperimentError> {
    let file: Value = toml::from_str(include_str!("twist/motions.toml"))?;
    let entries = file[pick(quick, ["whole", "quick"])].as_array();
    let entries = entries.into_iter().flatten();
    let mut all: Vec<Value> = entries.map(|entry| with(&file["usual"], entry)).collect();
    for key in ["segments", "joint", "tension", "step", "dt"] {
        let each = |row: Value| match row[key].as_array() {
            Some(values) => values
                .iter()
                .map(|v| with(&row, &json!({ key: v })))
                .collect(),
            None => vec![row],
        };
        all = all.into_iter().flat_map(each).collect();
    }
    let motions = all.into_iter().map(serde_json::from_value);
    Ok(motions.collect::<Result<_, _>>()?)
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
    let materials = pick(quick, [&MATERIALS[..], &MATERIALS[2..]]);
    let tasks = tasks(materials, &Joint::ALL);
    let rows = each(&tasks, progress, |&(material, n, joint)| {
        Ok::<_, ExperimentError>(at_rest(material, n, joint, FARTHEST)?.1)
    })?;
    progress.reset();
    let held = each(&motions(quick)?, progress, motion::in_motion)?;
    Ok([rows.concat(), held, leaks()?])
}
