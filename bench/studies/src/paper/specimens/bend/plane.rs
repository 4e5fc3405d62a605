//! Stability of the plane shape.
//!
//! A moment of fixed direction follows no potential. Beyond 0.85 to 0.9 of a circle the plane shape is an unstable
//! equilibrium against motion out of its plane, with any time step.

use super::loaded;
use crate::paper::specimens::{MATERIALS, SEGMENTS};
use crate::paper::words::{largest, named_check};
use crate::rest::step_from_rest;
use serde_json::json;
use taut_integrator::{StepOptions, Stepper};
use taut_model::ResolvedSpecimen;
use taut_output::check::{Check, ExperimentError};

/// Slowest bending mode of the cantilever, 3.516 (YI/(ρA L⁴))^½ \[rad/s].
pub(super) fn slowest_mode(specimen: &ResolvedSpecimen) -> f64 {
    let length = specimen.segment_length * specimen.segments as f64;
    let line_mass = specimen.segment_mass / specimen.segment_length;
    3.516 * (specimen.stiffness.ei / line_mass).sqrt() / length.powi(2)
}

/// By how much a disturbance out of the plane of a steel specimen with `segments` segments grows, bent to `part` of a
/// circle and left to creep: largest displacement at the end over that at a sixth of the way, and 0 where it falls to
/// rounding. `refined` divides the time step by it, over the same time.
pub fn growth_out_of_plane(
    segments: usize,
    part: f64,
    refined: f64,
) -> Result<f64, ExperimentError> {
    const PASSES: f64 = 300.0;
    let (mut scene, specimen, _) = loaded(MATERIALS[2], segments, part, 1.0)?;
    for (i, x) in scene.bodies.position.iter_mut().enumerate() {
        x.z += 1e-9 * (1.7 * i as f64).sin();
    }
    let options = StepOptions {
        dt: 1.0 / (3.0 * refined * slowest_mode(&specimen)),
        ..StepOptions::paper()
    };
    let mut stepper = Stepper::new(scene, options)?;
    // A pass from rest moves by Δt²: the creep's time.
    let passes = (PASSES * refined * refined) as usize;
    let aside =
        |stepper: &Stepper| largest(stepper.scene().bodies.position.iter().map(|x| x.z.abs()));
    let mut early = f64::NAN;
    for pass in 0..passes {
        if step_from_rest(&mut stepper).is_err() {
            return Ok(f64::INFINITY);
        }
        if pass == passes / 6 {
            early = aside(&stepper);
        }
    }
    let late = aside(&stepper);
    Ok(if late < 1e-14 { 0.0 } else { late / early })
}

/// Up to which part of a circle the plane shape is stable, with two time steps.
pub(super) fn stability_of_the_plane() -> Result<Check, ExperimentError> {
    const PARTS: [f64; 5] = [0.75, 0.8, 0.85, 0.9, 1.0];
    let segments = SEGMENTS[SEGMENTS.len() - 1];
    let mut stable = [0.0_f64; 2];
    for (stable, refined) in stable.iter_mut().zip([1.0, 2.0]) {
        for part in PARTS {
            if growth_out_of_plane(segments, part, refined)? > 10.0 {
                break;
            }
            *stable = part;
        }
    }
    let row = json!({ "n": segments, "whole": stable[0], "half": stable[1] });
    Ok(named_check("bend-plane", row).so(stable[0] >= 1.0 && stable[1] >= 1.0))
}
