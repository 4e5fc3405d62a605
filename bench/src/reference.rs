//! The motion that the steps at Δt = 1/60 s are judged by: the same scheme at a time step so small that it is stable
//! and its first-order error small, sampled at the frames.

use crate::trajectory::load_position;
use nalgebra::Vector3;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Bodies, HoistParams};
use taut_solver::Backend;

/// A finely stepped motion.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Its time step \[s].
    pub dt: f64,
    /// Load position after each frame, from the first on \[m].
    pub load: Vec<Vector3<f64>>,
    /// States at the frames wanted, with their times.
    pub states: Vec<(f64, Bodies)>,
}

/// Sub-steps a frame for which the paper's step is stable on this scene: segments that rotate against the tension
/// T = g (M + m N) have the frequency ω = 2 √(12 T/(m l)), and Δt ω < 2 is needed; 1.3 is kept here.
#[must_use]
pub fn stable_substeps(params: &HoistParams, frame: f64) -> usize {
    let mass = params.segment_mass.unwrap_or(1.0);
    let segments = params.segments as f64;
    let tension = params.gravity * mass * (params.mass_ratio + segments);
    let omega = 2.0 * (12.0 * tension / (mass * params.length / segments)).sqrt();
    ((frame * omega / 1.3).ceil() as usize).max(40)
}

/// Steps the scene for `frames` frames of length `frame` (s) with `substeps` each; keeps the states before the frames
/// in `keep`.
///
/// # Errors
/// As [`Stepper::step`].
pub fn compute(
    params: &HoistParams,
    frame: f64,
    substeps: usize,
    frames: usize,
    keep: std::ops::Range<usize>,
) -> Result<Reference, StepError> {
    let dt = frame / substeps as f64;
    // Any direct solver serves; the banded one is the fastest where it is compiled in.
    let backend = if Backend::Banded.is_compiled() {
        Backend::Banded
    } else {
        StepOptions::default().backend
    };
    let options = StepOptions {
        dt,
        backend,
        refinements: 0,
        ..StepOptions::default()
    };
    let mut stepper = Stepper::new(params.build()?, options)?;
    let mut reference = Reference {
        dt,
        load: Vec::with_capacity(frames),
        states: Vec::new(),
    };
    for i in 0..frames {
        if keep.contains(&i) {
            reference
                .states
                .push((i as f64 * frame, stepper.scene().bodies.clone()));
        }
        for _ in 0..substeps {
            stepper.step()?;
        }
        reference.load.push(load_position(stepper.scene()));
    }
    Ok(reference)
}
