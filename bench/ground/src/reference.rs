//! The motion that the steps at Δt = 1/60 s are judged by: the paper's step at a time step so small that it is stable,
//! sampled at the frames, and its first-order error taken away by extrapolation from two such time steps.

use crate::pace;
use crate::trajectory::load_position;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Bodies, HoistParams, Scene, SceneError};
use taut_solver::Backend;

/// A finely stepped motion.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Its time step \[s].
    pub dt: f64,
    /// Load position after each frame, from the first on \[m].
    pub load: Vec<Vector3<f64>>,
    /// States at the frames wanted.
    pub states: Vec<Snapshot>,
}

/// A state that solvers are compared on: with the tension it makes the same linear system for all.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Time \[s].
    pub time: f64,
    /// State of the bodies.
    pub bodies: Bodies,
    /// Multipliers of the step that led there, one a row; zeros at the beginning \[N, N m].
    pub tension: Vec<f64>,
}

impl Snapshot {
    /// The present state of a stepper, and the tension of its last solve.
    #[must_use]
    pub fn of(stepper: &Stepper) -> Self {
        let options = stepper.options();
        let dt = options.dt / options.substeps as f64;
        Self {
            time: stepper.time(),
            bodies: stepper.scene().bodies.clone(),
            tension: stepper.multipliers().iter().map(|mu| mu / dt).collect(),
        }
    }

    /// Puts a stepper of the same scene there.
    ///
    /// # Errors
    /// As [`Stepper::set_state`].
    pub fn put(&self, stepper: &mut Stepper) -> Result<(), StepError> {
        stepper.set_state(&self.bodies, self.time)?;
        stepper.set_tension(&self.tension)
    }
}

/// Sub-steps a frame for which the paper's step is stable on this scene: segments that rotate against the tension
/// T = g (M + m N) have the frequency ω = 2 √(12 T/(m l)), and Δt ω < 2 is needed; 1.3 is kept here.
///
/// # Errors
/// Parameters that are not sound, and a reference motion of more than [`MAX_STEPS`] a second.
pub fn stable_substeps(params: &HoistParams, frame: f64) -> Result<usize, StepError> {
    let hoist = params.resolve()?;
    let (mass, segments) = (hoist.segment_mass, hoist.segments as f64);
    let tension = params.gravity * (hoist.load_mass + mass * segments);
    let omega = 2.0 * (12.0 * tension / (mass * hoist.segment_length)).sqrt();
    let substeps = (frame * omega / 1.3).ceil();
    if substeps > MAX_STEPS * frame {
        return Err(StepError::InvalidOption {
            field: "mass_ratio",
            value: params.mass_ratio,
            allowed: "such that the reference motion needs at most a million steps a second",
        });
    }
    Ok((substeps as usize).max(40))
}

/// Most steps of a reference motion in a second of it.
pub const MAX_STEPS: f64 = 1e6;

/// The scene that is run: hanging in its static equilibrium, so that what moves is the swing and not the bounce of a
/// dropped load; turned aside and unstretched where an initial angle is asked for.
///
/// # Errors
/// As [`HoistParams::build`].
pub fn scene(params: &HoistParams) -> Result<Scene, SceneError> {
    if params.initial_angle == 0.0 {
        params.hanging_equilibrium()
    } else {
        params.build()
    }
}

/// Largest gap of a joint of the hanging cable, and a segment's length: beyond their sum a run is not that of a cable
/// any more \[m].
///
/// # Errors
/// Parameters that are not sound.
pub fn most_gap(params: &HoistParams) -> Result<f64, SceneError> {
    let hoist = params.resolve()?;
    let hanging = hoist.gaps(params.gravity).fold(0.0, f64::max);
    Ok(hanging + hoist.segment_length)
}

/// A motion of the load that the step is compared with, converged in Δt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Converged {
    /// Time between the positions \[s].
    pub frame: f64,
    /// Steps a frame of the finer of the two runs that it is extrapolated from.
    pub substeps: usize,
    /// Load positions after each frame \[m].
    pub load: Vec<[f64; 3]>,
    /// Largest distance of the extrapolated positions from the finer run's: the first-order error of that run, which
    /// the extrapolation removes but for its square, and so a bound that is wide of the mark \[m].
    pub uncertainty: f64,
}

/// Most of Δt that a converged reference's finer run may have: 1/24000 s.
const FINEST: f64 = 24_000.0;

/// The paper's step at Δt ≤ 1/24000 s and at twice that, extrapolated to Δt = 0 (it is of first order). Kept in a file
/// under `target/taut/reference`, since it takes up to minutes.
///
/// # Errors
/// As [`Stepper::step`].
pub fn converged(params: &HoistParams, frame: f64, frames: usize) -> Result<Converged, StepError> {
    let stable = stable_substeps(params, frame)?;
    let coarse = stable.max((0.5 * FINEST * frame).ceil() as usize);
    let key = format!("converged 1 {params:?} {frame:e} {frames} {coarse}");
    crate::cache::cached(&key, || {
        let (finer, uncertainty) = extrapolated(params, frame, coarse, frames, 0..0)?;
        Ok(Converged {
            frame,
            substeps: 2 * coarse,
            load: finer.load.into_iter().map(Into::into).collect(),
            uncertainty,
        })
    })
}

/// The motion with `2 substeps` a frame, its load positions extrapolated to Δt = 0 from those and the ones with
/// `substeps`; and the largest distance that this moves them \[m].
///
/// # Errors
/// As [`Stepper::step`].
pub fn extrapolated(
    params: &HoistParams,
    frame: f64,
    substeps: usize,
    frames: usize,
    keep: std::ops::Range<usize>,
) -> Result<(Reference, f64), StepError> {
    let (coarse, finer) = rayon::join(
        || compute(params, frame, substeps, frames, 0..0),
        || compute(params, frame, 2 * substeps, frames, keep),
    );
    let (coarse, mut finer) = (coarse?, finer?);
    let mut moved = 0.0_f64;
    for (fine, coarse) in finer.load.iter_mut().zip(&coarse.load) {
        let change = *fine - coarse;
        moved = moved.max(change.norm());
        *fine += change;
    }
    Ok((finer, moved))
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
        ..StepOptions::paper()
    };
    let mut stepper = Stepper::new(scene(params)?, options)?;
    let mut reference = Reference {
        dt,
        load: Vec::with_capacity(frames),
        states: Vec::new(),
    };
    for i in 0..frames {
        if keep.contains(&i) {
            reference.states.push(Snapshot {
                time: i as f64 * frame,
                ..Snapshot::of(&stepper)
            });
        }
        for _ in 0..substeps {
            pace::step(&mut stepper)?;
        }
        reference.load.push(load_position(stepper.scene()));
    }
    Ok(reference)
}
