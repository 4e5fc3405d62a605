//! Fig. 16: the energy of the swinging cable, and what takes it \[SL §VIII].
//!
//! The paper's crane loses a fifth of its energy in 10 s of swinging, "due to numerical dissipation of the cable
//! deformation". The linearly implicit step treats elasticity implicitly and tension and gravity explicitly: with the
//! elastic stiffness K_e = Jᵀε⁻¹J and the geometric one K_g it is
//!
//! ```text
//! (M + Δt² K_e) v⁺ = M v − Δt (K_e + K_g) q,    q⁺ = q + Δt v⁺
//! ```
//!
//! and for a mode φ with φᵀMφ = 1, ω_e² = φᵀK_eφ, whatever its φᵀK_gφ, this linear map has the determinant
//! 1/(1 + ω_e²Δt²): that is the factor of the mode's energy in each step. A swing that only gravity holds keeps its
//! energy; where the cable's ends are clamped, part of what holds it is bending, and it loses
//!
//! ```text
//! E(t) = Σ_k E_k (1 + ω_ek²Δt²)^(−t/Δt)
//! ```
//!
//! to first order in Δt, since damping also changes the modes. A mode of deformation alone, K_g = 0, has the eigenvalues
//! (1 ± iωΔt)/(1 + ω²Δt²): amplitude ×(1 + ω²Δt²)^(−1/2) and phase arctan(ωΔt) a step, exactly.
//!
//! The scene is a hoist with clamped ends: load and mass of the cable as printed, g = 10 m/s²; of the stiffnesses only the
//! leading digits can be read, and the length is not given. The stretch of a joint is taken as 5·10⁶ N/m, the length as
//! 2 m, and the bending stiffness is that for which a fifth is lost; both are chosen, not read. The gantry itself, as the paper
//! has it, swings with the same cable and load below its hook.

mod law;
mod report;

pub use report::{checks, text_tables};

use super::{DT, GRAVITY, words};
use crate::checks::each;
use crate::options::pick;
use indicatif::ProgressBar;
use law::law;
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::{Value, json};
use taut_integrator::{
    GeometricStiffness, Scheme, StepError, StepOptions, Stepper, static_equilibrium,
};
use taut_measure::inputs::Inputs;
use taut_measure::modes::{Mode, modes, predicted};
use taut_measure::trajectory::{Limits, Sample, load_position, simulate_driven, steps_in};
use taut_model::{End, GantryParams, HoistParams, Scene, SceneError};
use taut_output::check::{ExperimentError, Outcome};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Config {
    pub segments: usize,
    /// Length of the cable \[m].
    pub length: f64,
    /// Mass of the load \[kg].
    pub load: f64,
    /// Mass of the cable \[kg].
    pub cable: f64,
    /// Stiffness of a joint against stretching \[N/m].
    pub stretch: f64,
    /// Share of the energy that is to be lost.
    pub loss: f64,
    /// Angular velocity of the cable and the load about the anchor at the start: small and large, times √(g/L).
    pub amplitudes: [f64; 2],
    /// Other bending stiffnesses, in terms of the one for `loss`.
    pub factors: Vec<f64>,
    /// Simulated time \[s].
    pub time: f64,
    /// Δt \[s].
    pub dt: f64,
    /// ωΔt of the single deformation modes.
    pub frequencies: Vec<f64>,
}

impl Config {
    /// 300 kg on 0.3 kg of cable, ten segments, 10 s at 1/60 s; quick six segments.
    pub fn new(quick: bool) -> Self {
        Self {
            segments: pick(quick, [10, 6]),
            length: 2.0,
            load: 300.0,
            cable: 0.3,
            stretch: 5e6,
            loss: 0.2,
            amplitudes: [0.02, 0.6],
            factors: pick(quick, [vec![0.5, 1.0, 2.0, 4.0], vec![1.0, 2.0]]),
            time: 10.0,
            dt: DT,
            frequencies: pick(quick, [vec![0.01, 0.1, 1.0, 3.0], vec![0.1, 1.0]]),
        }
    }

    /// The hoist with bending stiffness `ei` (N m²), its ends held as `end`.
    fn params(&self, ei: f64, end: End) -> HoistParams {
        let segment = self.length / self.segments as f64;
        HoistParams {
            segments: self.segments,
            length: self.length,
            segment_mass: Some(self.cable / self.segments as f64),
            load_mass: Some(self.load),
            gravity: GRAVITY,
            ea: Some(self.stretch * segment),
            ei: Some(ei),
            anchor: end,
            attachment: end,
            ..HoistParams::default()
        }
    }

    /// Steps to half of the time and to its end.
    fn moments(&self) -> [usize; 2] {
        let last = steps_in(self.time, self.dt);
        [last / 2, last]
    }

    /// The hanging scene, turning about its anchor with `amplitude` √(g/L).
    fn scene(&self, params: &HoistParams, amplitude: f64) -> Result<Scene, SceneError> {
        let mut scene = params.hanging_equilibrium()?;
        turn(&mut scene, 0, amplitude * (GRAVITY / self.length).sqrt());
        Ok(scene)
    }
}

/// Turns the bodies from one on about the origin with `omega` (rad/s).
fn turn(scene: &mut Scene, from: usize, omega: f64) {
    let omega = Vector3::y() * omega;
    let bodies = &mut scene.bodies;
    for i in from..bodies.len() {
        bodies.velocity[i] = omega.cross(&bodies.position[i]);
        bodies.angular_velocity[i] = omega;
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// Bending stiffness for which the wanted share is predicted to be lost \[N m²].
    ei: f64,
    /// Its modes, those with most energy first.
    modes: Vec<Mode>,
    /// The runs: group, and shares of the energy lost by half of the time and by its end, none where the run was lost.
    pub runs: Vec<Value>,
    /// The single deformation modes.
    pub laws: Vec<Value>,
}

impl Results {
    fn of<'a>(&'a self, group: &str) -> impl Iterator<Item = &'a Value> {
        self.runs.iter().filter(move |run| run["group"] == group)
    }
}

/// Groups of runs: the paper's step, `Spook` with geometric stiffness and the default step, each at small and at large
/// amplitude.
const STEPS: &str = "steps";
/// The paper's step at small amplitude for other bending stiffnesses, and with ball joints at the ends.
const OTHERS: &str = "others";
/// `Spook` with geometric stiffness at large amplitude, all rows damped with τ = Δt/2.
const DAMPED: &str = "damped";
/// The gantry at large amplitude, its cable clamped at hook and load: the paper's step and the default one.
const GANTRY: &str = "gantry";

/// The bending stiffness for which the modes predict the loss that is wanted: by halving a bracket of its logarithm.
fn fitted_stiffness(config: &Config) -> Result<f64, SceneError> {
    let loss = |ei: f64| -> Result<f64, SceneError> {
        let params = config.params(ei, End::Clamped);
        let modes = modes(&config.scene(&params, config.amplitudes[0])?);
        Ok(1.0 - predicted(&modes, config.dt, config.time))
    };
    // Clamped ends stiffen the swing as the root of EI: the loss grows with it.
    let (mut low, mut high) = (0.0_f64, 7.0_f64);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if loss(10_f64.powf(middle))? < config.loss {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(10_f64.powf(low))
}

/// Group, name and amplitude of a run, and its step.
type Task = (&'static str, String, f64, StepOptions);

/// A run of a swinging scene with bending stiffness `ei` (N m²), with its samples: its energy above that of the scene at rest
/// over its value at the start, after each step; each belongs to the step's beginning. Beside it stands what the modes
/// predict for the paper's step.
fn swung(
    config: &Config,
    (group, name, amplitude, options): &Task,
    ei: f64,
    [rest, moving]: [Scene; 2],
    limits: Limits,
    modes: Option<&[Mode]>,
) -> Result<Value, StepError> {
    let rest = {
        let mut stepper = Stepper::new(rest, options.clone())?;
        stepper.step()?;
        stepper.energy()
    };
    let mut stepper = Stepper::new(moving, options.clone())?;
    // The first sample belongs to time 0, and the one after the last step to the end.
    let time = config.time + config.dt;
    let trajectory = simulate_driven(&mut stepper, &Inputs::default(), time, limits, |_| ());
    // The linearly implicit step's tension belongs to the end of the step, so that there the elastic energy is that of the
    // step before; at first it is that of rest.
    let is_late = options.scheme == Scheme::LinearlyImplicit;
    let mut before = rest.elastic;
    let energy = trajectory.samples.iter().map(|Sample { energy, .. }| {
        let late = std::mem::replace(&mut before, energy.elastic);
        let elastic = if is_late { late } else { energy.elastic };
        energy.kinetic + energy.gravity + elastic
    });
    let energy: Vec<f64> = energy.collect();
    let share = |i: usize| Some((energy.get(i)? - rest.total()) / (energy[0] - rest.total()));
    let predicted = |i: usize| Some(predicted(modes?, config.dt, i as f64 * config.dt));
    let sample = |i: usize| {
        json!({
            "run": name,
            "ei_n_m2": ei,
            "amplitude": amplitude,
            "time_s": i as f64 * config.dt,
            "energy_share": share(i),
            "predicted": predicted(i),
        })
    };
    let [half, end] = config.moments();
    let failure = trajectory.failure.as_ref();
    Ok(json!({
        "group": group,
        "run": name,
        "ei": ei,
        "amplitude": amplitude,
        "size": if *amplitude == config.amplitudes[0] { "small" } else { "large" },
        "half": share(half).map(|e| 1.0 - e),
        "half_predicted": predicted(half).map(|e| 1.0 - e),
        "end": share(end).map(|e| 1.0 - e),
        "end_predicted": predicted(end).map(|e| 1.0 - e),
        "lost": failure.map(|f| format!("{:.2} s", f.time)),
        "reason": failure.map(|f| &f.reason),
        "samples": (0..energy.len()).map(sample).collect::<Vec<_>>(),
    }))
}

fn swing(config: &Config, task: &Task, params: &HoistParams) -> Result<Value, StepError> {
    let limits = Limits::Sweep(taut_measure::reference::most_gap(params)?);
    let scenes = [config.scene(params, 0.0)?, config.scene(params, task.2)?];
    let is_paper = task.3.scheme == Scheme::LinearlyImplicit;
    let modes = is_paper.then(|| modes(&scenes[1]));
    let ei = params.resolve()?.stiffness.ei;
    swung(config, task, ei, scenes, limits, modes.as_deref())
}

/// One run of the gantry, whose hook, cable and load turn about the trolley at first.
fn gantry(config: &Config, task: &Task, ei: f64) -> Result<Value, StepError> {
    let segment_mass = config.cable / config.segments as f64;
    let params = GantryParams {
        segments: config.segments,
        cable_length: config.length,
        segment_mass,
        mass_ratio: config.load / segment_mass,
        gravity: GRAVITY,
        ea: config.stretch * config.length / config.segments as f64,
        ei: Some(ei),
        attachment: End::Clamped,
        ..GantryParams::default()
    };
    let rest = static_equilibrium(params.build()?, &task.3.backend)?;
    let mut moving = rest.clone();
    let depth = -load_position(&moving).z;
    turn(&mut moving, HANGING, task.2 * (GRAVITY / depth).sqrt());
    let limits = Limits::Scene(moving.gap_limits());
    swung(config, task, ei, [rest, moving], limits, None)
}

/// The first body of the gantry that hangs: below crane and trolley.
const HANGING: usize = 2;

/// Runs everything, in parallel. `progress` advances once for each motion.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Results, StepError> {
    let ei = fitted_stiffness(config)?;
    let params = config.params(ei, End::Clamped);
    let dt = config.dt;
    let at = |options| StepOptions { dt, ..options };
    let [paper, default] = [StepOptions::paper(), StepOptions::default()].map(at);
    let spook = StepOptions {
        scheme: Scheme::Spook,
        stiffness: GeometricStiffness::Inertia { alpha: 0.5 },
        ..paper.clone()
    };
    let [small, large] = config.amplitudes;
    let task = |group, name: &str, amplitude, options: &StepOptions| -> Task {
        (group, name.to_owned(), amplitude, options.clone())
    };
    let mut tasks = Vec::new();
    let names = ["paper's step", "Spook + K", "default"];
    for (name, options) in names.into_iter().zip([&paper, &spook, &default]) {
        let of = |size| (task(STEPS, name, size, options), params.clone());
        tasks.extend(config.amplitudes.map(of));
    }
    let mut add = |group, name: &str, amplitude, options, params: HoistParams| {
        tasks.push((task(group, name, amplitude, options), params));
    };
    for factor in &config.factors {
        let params = config.params(factor * ei, End::Clamped);
        add(
            OTHERS,
            &format!("clamped, {factor} EI"),
            small,
            &paper,
            params,
        );
    }
    let free = config.params(ei, End::Spherical);
    add(OTHERS, "ball joints at the ends", small, &paper, free);
    let damped = HoistParams {
        damping: 0.5 * dt,
        ..params.clone()
    };
    add(DAMPED, "Spook + K, τ = Δt/2", large, &spook, damped);
    let mut runs = each(&tasks, progress, |(task, params)| {
        swing(config, task, params)
    })?;
    progress.reset();
    let on_gantry = [
        task(GANTRY, "gantry, paper's step", large, &paper),
        task(GANTRY, "gantry, default", large, &default),
    ];
    runs.extend(each(&on_gantry, progress, |task| gantry(config, task, ei))?);
    let laws = config.frequencies.iter().map(|&w| law(w, dt));
    let laws: Vec<[Value; 2]> = laws.collect::<Result<_, _>>()?;
    Ok(Results {
        ei,
        modes: modes(&config.scene(&params, small)?),
        runs,
        laws: laws.concat(),
    })
}

fn samples(run: &Value) -> impl Iterator<Item = &Value> {
    run["samples"].as_array().into_iter().flatten()
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let config = Config::new(quick);
    let results = run(&config, progress)?;
    let samples: Vec<Value> = results.runs.iter().flat_map(samples).cloned().collect();
    let charts = report::charts(&results, &config);
    let (checks, text) = (checks(&results, &config), text_tables(&results, &config));
    words::outcome(checks, text, &samples, charts)
}
