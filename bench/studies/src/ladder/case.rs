//! The cases of the main job: a scene with what all its rows share, its reference motion, common states and exact
//! multipliers.

use super::trial;
use super::{Config, SceneNote};
use nalgebra::Vector3;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_measure::inputs::Inputs;
use taut_measure::reference::{self, Motion, Reference, reference_choice};
use taut_measure::source;
use taut_measure::trajectory::{Failure, Limits, simulate_driven, steps_in};
use taut_model::{HoistParams, Scene, SceneError};
use taut_output::check::ExperimentError;

/// Frames of the reference motion that the algebra is measured on.
const FRAMES: usize = 16;

/// Steps of a frame, of the coarser of the two runs that the reference motion of a scene other than the hoist comes from.
const SUBSTEPS: usize = 16;

/// `SUBSTEPS` of a scene with contacts.
const CONTACT_SUBSTEPS: usize = 2;

/// A scene other than the hoist, with its drive.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnScene {
    pub name: String,
    pub scene: Scene,
    pub inputs: Inputs,
}

/// A scene as the main job takes it.
#[derive(Debug, Clone)]
pub(super) enum Subject {
    /// One of the family over segments and mass ratios.
    Hoist(Box<HoistParams>),
    Own(Box<OwnScene>),
}

/// A scene of the main job with what all its rows share.
pub(super) struct Case {
    pub(super) name: String,
    /// Parameters of a hoist, which give its exact elongation.
    pub(super) hoist: Option<HoistParams>,
    /// Load over segment mass of a hoist; else of the moving bodies the heaviest over the lightest.
    pub(super) mass_ratio: f64,
    /// Scene and drive, with the load or what stands in for it.
    pub(super) motion: Motion,
    /// The body that stands in for a load.
    stand_in: Option<String>,
    /// The scene in the first of the common states, without its events.
    common: Scene,
    pub(super) reference: Reference,
    /// Exact multipliers of the states but the first, which iterations only start from.
    pub(super) exact: Vec<Vec<f64>>,
    /// Velocities of the moving bodies after a step from these states, of scenes with contacts \[m/s]; their own error.
    pub(super) velocities: Vec<Vec<Vector3<f64>>>,
    velocity_error: Option<f64>,
    /// How long the step itself, solved directly, was tried \[s].
    stability_time: f64,
    pub(super) failure: Option<Failure>,
}

/// Error of a scene of the user's own before any solver is compared.
#[derive(Debug, thiserror::Error)]
#[error("{scene}: {error}")]
struct Named {
    scene: String,
    error: StepError,
}

/// True if the motion of a scene was lost: its text is sound.
pub fn is_lost(error: &ExperimentError) -> bool {
    let named = error.downcast_ref::<Named>().map(|named| &named.error);
    matches!(
        named.or_else(|| error.downcast_ref()),
        Some(
            StepError::NonFinite { .. } | StepError::EnergyGain { .. } | StepError::OffPath { .. }
        )
    )
}

impl Subject {
    /// An error, with the name of a scene that is not the hoist.
    pub(super) fn named(&self, error: StepError) -> ExperimentError {
        match self {
            Self::Hoist(_) => error.into(),
            Self::Own(own) => Box::new(Named {
                scene: own.name.clone(),
                error,
            }),
        }
    }

    pub(super) fn title(&self) -> String {
        match self {
            Self::Hoist(params) => {
                format!("{} segments at {:e}", params.segments, params.mass_ratio)
            }
            Self::Own(own) => own.name.clone(),
        }
    }

    /// How finely its reference is stepped, and what is stepped.
    fn motion(&self, config: &Config) -> Result<(Motion, usize), StepError> {
        match self {
            Self::Hoist(params) => {
                let substeps = reference::stable_substeps(params, config.dt)?;
                Ok((Motion::of_hoist(params)?, substeps))
            }
            Self::Own(own) => {
                let mut motion = Motion::of_scene(own.scene.clone(), own.inputs.clone());
                if motion.scene.load.is_none() {
                    let steps = steps_in(config.time, config.dt);
                    let most = reference::moves_most(&motion, config.dt, steps)?;
                    motion.scene.load = Some(most);
                }
                let substeps = if own.scene.colliders.is_empty() {
                    SUBSTEPS
                } else {
                    CONTACT_SUBSTEPS
                };
                Ok((motion, substeps))
            }
        }
    }
}

impl Case {
    pub(super) fn new(config: &Config, subject: &Subject) -> Result<Self, StepError> {
        let (motion, substeps) = subject.motion(config)?;
        let (name, hoist, mass_ratio) = match subject {
            Subject::Hoist(params) => {
                let hoist = (**params).clone();
                ("hoist".to_owned(), Some(hoist), params.mass_ratio)
            }
            Subject::Own(own) => (own.name.clone(), None, source::mass_ratio(&own.scene)?),
        };
        let stand_in = match subject {
            Subject::Own(own) if own.scene.load.is_none() => motion.scene.load,
            _ => None,
        };
        let stand_in = stand_in.map(|body| motion.scene.body_names[body].clone());
        let frames = steps_in(config.time, config.dt).max(FRAMES + 1);
        // From the middle of the run on, where the scene is in motion.
        let first = (frames / 2).min(frames - FRAMES - 1);
        let kept = first..first + FRAMES + 1;
        let (reference, _) = reference::extrapolated(&motion, config.dt, substeps, frames, kept)?;
        let mut common = common_scene(&reference)?;
        common.events.clear();
        let mut case = Self {
            name,
            hoist,
            mass_ratio,
            motion,
            stand_in,
            common,
            reference,
            exact: Vec::new(),
            velocities: Vec::new(),
            velocity_error: None,
            stability_time: config.stability_time,
            failure: None,
        };
        let plain = reference_choice().plain_options(config.dt);
        case.exact = case.in_each(plain.clone(), Stepper::reference_multipliers)?;
        if case.has_contacts() {
            let (velocities, error) = trial::reference(&case, config.dt)?;
            (case.velocities, case.velocity_error) = (velocities, Some(error));
        }
        let mut stepper = case.at_start(plain)?;
        let (inputs, time) = (&case.motion.inputs, config.stability_time);
        case.failure = simulate_driven(&mut stepper, inputs, time, case.limits(), |_| {}).failure;
        Ok(case)
    }

    /// True if the scene has shapes that may touch.
    pub(super) fn has_contacts(&self) -> bool {
        !self.common.colliders.is_empty()
    }

    /// g Δt: the least scale of velocities \[m/s].
    pub(super) fn least_speed(&self, dt: f64) -> f64 {
        self.common.gravity.norm() * dt
    }

    pub(super) fn at_start(&self, options: StepOptions) -> Result<Stepper, StepError> {
        Stepper::new(self.motion.scene.clone(), options)
    }

    /// A stepper that [`put`](Self::put) takes from one common state to the next.
    pub(super) fn at_common_states(&self, options: StepOptions) -> Result<Stepper, StepError> {
        Stepper::new(self.common.clone(), options)
    }

    /// Puts a stepper into a common state, with the controls of its frame. Of a driven scene the states have to be taken in
    /// turn: the length of a winch is of its past.
    pub(super) fn put(&self, state: usize, stepper: &mut Stepper) -> Result<(), StepError> {
        self.reference.states[state].put(stepper)?;
        self.motion.inputs.apply(stepper)
    }

    /// Findings in each common state, taken in turn by a stepper of these options; not in the first, which iterations only
    /// start from.
    pub(super) fn in_each<R>(
        &self,
        options: StepOptions,
        mut of: impl FnMut(&mut Stepper) -> Result<R, StepError>,
    ) -> Result<Vec<R>, StepError> {
        let mut stepper = self.at_common_states(options)?;
        let states = 0..self.reference.states.len();
        let mut all = states.map(|state| {
            self.put(state, &mut stepper)?;
            of(&mut stepper)
        });
        all.next().transpose()?;
        all.collect()
    }

    /// When a run is lost: a hoist where a joint is open by a segment's length, any other by its own lengths.
    pub(super) fn limits(&self) -> Limits {
        match &self.hoist {
            Some(hoist) => Limits::Sweep(hoist.length / hoist.segments as f64),
            None => Limits::Scene(self.motion.scene.gap_limits()),
        }
    }

    pub(super) fn segments(&self) -> Option<usize> {
        self.hoist.as_ref().map(|hoist| hoist.segments)
    }

    pub(super) fn note(&self) -> SceneNote {
        SceneNote {
            scene: self.name.clone(),
            segments: self.segments(),
            mass_ratio: self.mass_ratio,
            stand_in: self.stand_in.clone(),
            reference_dt: self.reference.dt,
            velocity_reference_error: self.velocity_error,
            stability_s: self.stability_time,
            failure: self.failure.clone(),
        }
    }
}

fn common_scene(reference: &Reference) -> Result<Scene, StepError> {
    let scene = reference.scene.clone();
    let scene = scene.filter(|_| reference.states.len() > 1);
    scene.ok_or_else(|| {
        StepError::Scene(SceneError::Conflict {
            what: "the scene".to_owned(),
            reason: "has events in every frame from the middle of the run on, and the errors of solvers are measured on two \
                     frames without: give another `--time`",
        })
    })
}
