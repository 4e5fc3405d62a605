//! The motion that the steps at Δt = 1/60 s are judged by: a step at a small Δt, sampled at the frames, its error of
//! leading order taken away by extrapolation from two such time steps. On hoists that is the paper's step, stable at a Δt
//! that their tension tells; on other scenes, where nothing tells it, the default step with its guard.

use crate::choice::Choice;
use crate::inputs::Inputs;
use crate::pace;
use crate::trajectory::load_position;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use taut_integrator::{ContactImpulses, StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Scene, SceneError};
use taut_solver::{Backend, DenseOptions};

/// A finely stepped motion.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Its time step \[s].
    pub dt: f64,
    /// Load position after each frame, from the first on \[m].
    pub load: Vec<Vector3<f64>>,
    /// States at the frames wanted, up to the first event after two of them.
    pub states: Vec<Snapshot>,
    /// The scene in the first of these states.
    pub scene: Option<Scene>,
}

/// A scene, what drives it, and the step that goes through its motion finely.
#[derive(Debug, Clone)]
pub struct Motion {
    pub scene: Scene,
    /// Drive of the scene over time.
    pub inputs: Inputs,
    /// The step, but for its Δt.
    pub options: StepOptions,
    /// Order of its error in Δt.
    pub order: i32,
}

impl Motion {
    /// A hoist, with the paper's step.
    pub fn of_hoist(params: &HoistParams) -> Result<Self, SceneError> {
        Ok(Self {
            scene: scene(params)?,
            inputs: Inputs::default(),
            options: StepOptions {
                backend: reference_choice().backend,
                refinements: 0,
                ..StepOptions::paper()
            },
            order: 1,
        })
    }

    /// Any scene, with the default step.
    pub fn of_scene(scene: Scene, inputs: Inputs) -> Self {
        Self {
            scene,
            inputs,
            options: reference_choice().options(1.0),
            order: 2,
        }
    }
}

/// The direct solver that makes references and common states: the fastest that is compiled in.
pub fn reference_choice() -> Choice {
    Choice::schur(if Backend::Banded.is_compiled() {
        Backend::Banded
    } else {
        Backend::Dense(DenseOptions::default())
    })
}

/// The moving body that comes furthest from where it starts in so many steps, or until the first event: what stands in for
/// the load in a scene that names none.
pub fn moves_most(motion: &Motion, dt: f64, steps: usize) -> Result<usize, StepError> {
    crate::source::mass_ratio(&motion.scene)?;
    let options = StepOptions {
        dt,
        ..motion.options.clone()
    };
    let mut stepper = Stepper::new(motion.scene.clone(), options)?;
    let start = stepper.scene().bodies.position.clone();
    let mut way = vec![0.0_f64; start.len()];
    for _ in 0..steps {
        motion.inputs.apply(&mut stepper)?;
        if pace::step(&mut stepper)?.events > 0 {
            break;
        }
        let scene = stepper.scene();
        for i in scene.dynamic_bodies() {
            way[i] = way[i].max((scene.bodies.position[i] - start[i]).norm());
        }
    }
    let most = motion.scene.dynamic_bodies();
    let most = most.max_by(|&a, &b| way[a].total_cmp(&way[b]));
    Ok(most.unwrap_or_default())
}

/// A state that solvers are compared on: with the tension it makes the same linear system for all.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Time \[s].
    pub time: f64,
    /// The scene in its state: its bodies, and how its cables lie.
    pub scene: Scene,
    /// Multipliers of the step that led there, one a row; zeros at the beginning \[N, N m].
    pub tension: Vec<f64>,
    pub contacts: ContactImpulses,
}

impl Snapshot {
    /// The present state of a stepper, and the tension of its last solve.
    pub fn of(stepper: &Stepper) -> Self {
        let options = stepper.options();
        let dt = options.dt / options.substeps as f64;
        Self {
            time: stepper.time(),
            scene: stepper.scene().clone(),
            tension: stepper.multipliers().iter().map(|mu| mu / dt).collect(),
            contacts: stepper.contact_impulses(),
        }
    }

    /// Puts a stepper of the same scene there.
    pub fn put(&self, stepper: &mut Stepper) -> Result<(), StepError> {
        stepper.lay_cables(&self.scene)?;
        stepper.set_state(&self.scene.bodies, self.time)?;
        stepper.set_contact_impulses(&self.contacts);
        stepper.set_tension(&self.tension)
    }
}

/// Sub-steps a frame for which the paper's step is stable on this scene: segments that rotate against the tension
/// T = g (M + m N) have the frequency ω = 2 √(12 T/(m l)), and Δt ω < 2 is needed; 1.3 is kept here.
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
pub fn scene(params: &HoistParams) -> Result<Scene, SceneError> {
    if params.initial_angle == 0.0 {
        params.hanging_equilibrium()
    } else {
        params.build()
    }
}

/// Largest gap of a joint of the hanging cable, and a segment's length: beyond their sum a run is not that of a cable
/// any more \[m].
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
pub fn converged(params: &HoistParams, frame: f64, frames: usize) -> Result<Converged, StepError> {
    let stable = stable_substeps(params, frame)?;
    let coarse = stable.max((0.5 * FINEST * frame).ceil() as usize);
    let key = format!("converged 1 {params:?} {frame:e} {frames} {coarse}");
    crate::cache::cached(&key, || {
        let motion = Motion::of_hoist(params)?;
        let (finer, uncertainty) = extrapolated(&motion, frame, coarse, frames, 0..0)?;
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
pub fn extrapolated(
    motion: &Motion,
    frame: f64,
    substeps: usize,
    frames: usize,
    keep: std::ops::Range<usize>,
) -> Result<(Reference, f64), StepError> {
    let (coarse, finer) = rayon::join(
        || compute(motion, frame, substeps, frames, 0..0),
        || compute(motion, frame, 2 * substeps, frames, keep),
    );
    let (coarse, mut finer) = (coarse?, finer?);
    let left = 2.0_f64.powi(motion.order) - 1.0;
    let mut moved = 0.0_f64;
    for (fine, coarse) in finer.load.iter_mut().zip(&coarse.load) {
        let change = (*fine - coarse) / left;
        moved = moved.max(change.norm());
        *fine += change;
    }
    Ok((finer, moved))
}

/// Steps the scene for `frames` frames of length `frame` (s) with `substeps` each; keeps the states before the frames
/// in `keep`.
fn compute(
    motion: &Motion,
    frame: f64,
    substeps: usize,
    frames: usize,
    keep: std::ops::Range<usize>,
) -> Result<Reference, StepError> {
    let dt = frame / substeps as f64;
    let options = StepOptions {
        dt,
        ..motion.options.clone()
    };
    let mut stepper = Stepper::new(motion.scene.clone(), options)?;
    let mut reference = Reference {
        dt,
        load: Vec::with_capacity(frames),
        states: Vec::new(),
        scene: None,
    };
    let mut is_cut = false;
    for i in 0..frames {
        if keep.contains(&i) && !is_cut {
            reference.keep(&stepper, i as f64 * frame);
        }
        let mut events = 0;
        for _ in 0..substeps {
            motion.inputs.apply(&mut stepper)?;
            events += pace::step(&mut stepper)?.events;
        }
        if events > 0 {
            is_cut |= reference.cut();
        }
        reference.load.push(load_position(stepper.scene()));
    }
    Ok(reference)
}

impl Reference {
    fn keep(&mut self, stepper: &Stepper, time: f64) {
        if self.states.is_empty() {
            self.scene = Some(stepper.scene().clone());
        }
        self.states.push(Snapshot {
            time,
            ..Snapshot::of(stepper)
        });
    }

    /// Takes back the last state, whose frame an event has ended: what follows is of another scene. Whether enough are left.
    fn cut(&mut self) -> bool {
        self.states.pop();
        let enough = self.states.len() > 1;
        if !enough {
            self.states.clear();
        }
        enough
    }
}
