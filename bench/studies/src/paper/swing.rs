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

use super::words;
use crate::options::pick;
use indicatif::ProgressBar;
use law::law;
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::{Value, json};
use taut_ground::inputs::Inputs;
use taut_ground::modes::{Mode, modes, predicted};
use taut_ground::trajectory::{Failure, Limits, Sample, load_position, simulate_driven, steps_in};
use taut_integrator::{
    GeometricStiffness, Scheme, StepError, StepOptions, Stepper, static_equilibrium,
};
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
            dt: 1.0 / 60.0,
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

/// Acceleration of gravity of the paper \[m/s²].
const GRAVITY: f64 = 10.0;

#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Name of the model and of the step.
    pub name: String,
    /// Bending stiffness \[N m²].
    pub ei: f64,
    /// Angular velocity at the start over √(g/L).
    pub amplitude: f64,
    /// Energy above that of rest, over its value at the start, after each step; each belongs to the step's beginning.
    pub energy: Vec<f64>,
    /// `energy` as predicted by the modes, for the paper's step.
    pub predicted: Vec<f64>,
    pub failure: Option<Failure>,
}

impl Run {
    /// Share of the energy lost by sample `i`; NaN where the run was lost.
    pub fn loss(&self, i: usize) -> f64 {
        self.energy.get(i).map_or(f64::NAN, |e| 1.0 - e)
    }

    /// Share that is predicted to be lost by sample `i`.
    pub fn predicted_loss(&self, i: usize) -> f64 {
        self.predicted.get(i).map_or(f64::NAN, |e| 1.0 - e)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Results {
    /// Bending stiffness for which the wanted share is predicted to be lost \[N m²].
    pub ei: f64,
    /// Its modes, those with most energy first.
    pub modes: Vec<Mode>,
    /// The paper's step, `Spook` with geometric stiffness and the default step, each at small and at large amplitude.
    pub runs: Vec<Run>,
    /// The paper's step at small amplitude for other bending stiffnesses, and with ball joints at the ends.
    pub others: Vec<Run>,
    /// `Spook` with geometric stiffness at large amplitude, all rows damped with τ = Δt/2.
    pub damped: Run,
    /// The gantry at large amplitude, its cable clamped at hook and load: the paper's step and the default one.
    pub gantry: [Run; 2],
    /// The single deformation modes.
    pub laws: Vec<Value>,
}

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

/// Energy \[J] before each step. The linearly implicit step's tension belongs to the end of the step, so that there the
/// elastic energy is that of the step before; at first it is that of rest, `elastic`.
fn energies(samples: &[Sample], scheme: Scheme, elastic: f64) -> Vec<f64> {
    let mut before = elastic;
    let energy = |s: &Sample| {
        let late = std::mem::replace(&mut before, s.energy.elastic);
        let elastic = match scheme {
            Scheme::LinearlyImplicit => late,
            _ => s.energy.elastic,
        };
        s.energy.kinetic + s.energy.gravity + elastic
    };
    samples.iter().map(energy).collect()
}

/// A run of a swinging scene; its energy is measured from that of the scene at rest, without numbers where it is lost.
fn swung(
    config: &Config,
    (name, ei, amplitude): (&str, f64, f64),
    [rest, moving]: [Scene; 2],
    limits: Limits,
    options: &StepOptions,
) -> Result<Run, StepError> {
    let rest = {
        let mut stepper = Stepper::new(rest, options.clone())?;
        stepper.step()?;
        stepper.energy()
    };
    let mut stepper = Stepper::new(moving, options.clone())?;
    // The first sample belongs to time 0, and the one after the last step to the end.
    let time = config.time + config.dt;
    let trajectory = simulate_driven(&mut stepper, &Inputs::default(), time, limits, |_| ());
    let mut energy = energies(&trajectory.samples, options.scheme, rest.elastic);
    let first = energy.first().map_or(f64::NAN, |e| e - rest.total());
    for e in &mut energy {
        *e = (*e - rest.total()) / first;
    }
    Ok(Run {
        name: name.to_owned(),
        ei,
        amplitude,
        energy,
        predicted: Vec::new(),
        failure: trajectory.failure,
    })
}

fn swing(
    config: &Config,
    name: &str,
    params: &HoistParams,
    amplitude: f64,
    options: &StepOptions,
) -> Result<Run, StepError> {
    let limits = Limits::Sweep(taut_ground::reference::most_gap(params)?);
    let scene = config.scene(params, amplitude)?;
    let modes = (options.scheme == Scheme::LinearlyImplicit).then(|| modes(&scene));
    let scenes = [config.scene(params, 0.0)?, scene];
    let case = (name, params.resolve()?.stiffness.ei, amplitude);
    let mut run = swung(config, case, scenes, limits, options)?;
    if let Some(modes) = modes {
        let times = (0..=steps_in(config.time, config.dt)).map(|i| i as f64 * config.dt);
        run.predicted = times.map(|t| predicted(&modes, config.dt, t)).collect();
    }
    Ok(run)
}

/// One run of the gantry, whose hook, cable and load turn about the trolley at first.
fn gantry(
    config: &Config,
    (name, ei, amplitude): (&str, f64, f64),
    options: &StepOptions,
) -> Result<Run, StepError> {
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
    let rest = static_equilibrium(params.build()?, &options.backend)?;
    let mut moving = rest.clone();
    let depth = -load_position(&moving).z;
    turn(&mut moving, HANGING, amplitude * (GRAVITY / depth).sqrt());
    let limits = Limits::Scene(moving.gap_limits());
    swung(
        config,
        (name, ei, amplitude),
        [rest, moving],
        limits,
        options,
    )
}

/// The first body of the gantry that hangs: below crane and trolley.
const HANGING: usize = 2;

/// Runs everything. `progress` advances once for each motion.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Results, StepError> {
    progress.set_length(config.factors.len() as u64 + 10);
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
    let ours = |name: &str, params: &HoistParams, amplitude, options: &StepOptions| {
        let run = swing(config, name, params, amplitude, options);
        run.inspect(|_| progress.inc(1))
    };
    let mut runs = Vec::new();
    for (name, options) in [
        ("paper's step", &paper),
        ("Spook + K", &spook),
        ("default", &default),
    ] {
        for amplitude in config.amplitudes {
            runs.push(ours(name, &params, amplitude, options)?);
        }
    }
    let [small, large] = config.amplitudes;
    let with_damping = HoistParams {
        damping: 0.5 * config.dt,
        ..params.clone()
    };
    let damped = ours("Spook + K, τ = Δt/2", &with_damping, large, &spook)?;
    let mut others = Vec::new();
    for factor in &config.factors {
        let params = config.params(factor * ei, End::Clamped);
        let name = format!("clamped, {factor} EI");
        others.push(ours(&name, &params, small, &paper)?);
    }
    let free = config.params(ei, End::Spherical);
    others.push(ours("ball joints at the ends", &free, small, &paper)?);
    let on_gantry = |name: &str, options: &StepOptions| {
        gantry(config, (name, ei, large), options).inspect(|_| progress.inc(1))
    };
    let gantry = [
        on_gantry("gantry, paper's step", &paper)?,
        on_gantry("gantry, default", &default)?,
    ];
    let laws = config.frequencies.iter().map(|&w| law(w, config.dt));
    let laws: Vec<[Value; 2]> = laws.collect::<Result<_, _>>()?;
    Ok(Results {
        ei,
        modes: modes(&config.scene(&params, small)?),
        runs,
        others,
        damped,
        gantry,
        laws: laws.concat(),
    })
}

fn samples(run: &Run, dt: f64) -> Vec<Value> {
    let sample = |(i, energy): (usize, &f64)| {
        json!({
            "run": run.name,
            "ei_n_m2": run.ei,
            "amplitude": run.amplitude,
            "time_s": i as f64 * dt,
            "energy_share": energy,
            "predicted": run.predicted.get(i),
        })
    };
    run.energy.iter().enumerate().map(sample).collect()
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let config = Config::new(quick);
    let results = run(&config, progress)?;
    let runs = results.runs.iter().chain(&results.others);
    let runs = runs.chain([&results.damped]).chain(&results.gantry);
    let samples: Vec<_> = runs.map(|run| samples(run, config.dt)).collect();
    let charts = report::charts(&results, &config);
    let (checks, text) = (checks(&results, &config), text_tables(&results, &config));
    words::outcome(checks, text, &samples.concat(), charts)
}
