//! H02, H03: a cable bent to a circle and twisted by loads at its end. Every joint carries the same
//! load, so that the discrete answer is exact and the continuum's: angles M l_j/EI and T l_j/GJ
//! ([`crate::paper::specimens`]).

use crate::options::pick;
use crate::paper::specimens::{Joint, MATERIALS, SEGMENTS, bend, largest, twist, worst};
use indicatif::ProgressBar;
use serde_json::Value;
use std::f64::consts::TAU;
use taut_model::{Scene, Specimen, SpecimenParams};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Bar of the tip of the circle, over L.
const BEND_BAR: f64 = 1e-9;
/// Relative bar of the twist.
const TWIST_BAR: f64 = 1e-9;
/// Turns of the twisted cable.
const TURNS: f64 = 40.0;

/// H02.
pub(super) fn rolled(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let segments = pick(quick, [&SEGMENTS[..], &[3, 24]]);
    let rows = bend::run(segments, pick(quick, bend::LOADS), progress)?;
    let mut checks = Vec::new();
    for (material, _) in MATERIALS {
        let own = || {
            let rows = rows.iter().filter(|r| r["material"] == material);
            rows.filter(|r| r["joint"] == "cosserat")
        };
        let error = worst(own(), "tip_error");
        let check = Check::off(
            format!("{material}: end of the polygon, to a circle"),
            "where the angles M l/EI lead",
            error,
            "L",
            BEND_BAR,
        );
        checks.push(
            check
                .by("largest distance over N, two directions, all moments; over L")
                .algebraic(),
        );
        let is_full = |r: &&Value| worst([*r], "angle_theory") > 0.999 * TAU;
        let closed = worst(own().filter(is_full), "tip_from_arc");
        let check = Check::off(
            format!("{material}: M = 2π EI/L"),
            "end at the clamp",
            closed,
            "L",
            BEND_BAR,
        );
        checks.push(check.by("largest distance over N, over L").algebraic());
    }
    Ok(checks.into())
}

/// H03.
pub(super) fn twisted(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let segments = pick(quick, [&SEGMENTS[..], &[6, 24]]);
    progress.set_length((segments.len() * MATERIALS.len()) as u64);
    let mut checks = Vec::new();
    for material in MATERIALS {
        let mut rows = Vec::new();
        for &n in segments {
            rows.extend(twist::at_rest(material, n, Joint::Cosserat, TURNS * TAU)?);
            progress.inc(1);
        }
        let errors = ["angle_error", "total_error"].map(|key| worst(&rows, key));
        let farthest = worst(&rows, "twist") / TAU;
        let check = Check::within(
            format!("{}, N = {segments:?}", material.0),
            "T l/GJ a joint",
            format!("to {farthest:.3} turns"),
            largest(errors.into_iter()),
            TWIST_BAR,
        );
        checks.push(
            check
                .by("largest relative error of a joint and of the whole over the torques")
                .algebraic(),
        );
    }
    Ok(checks.into())
}

pub(super) fn scene(specimen: Specimen) -> Result<Vec<Scene>, ExperimentError> {
    let params = SpecimenParams {
        segments: 6,
        equilibrium: false,
        ..SpecimenParams::new(specimen)
    };
    Ok(vec![params.build()?])
}
