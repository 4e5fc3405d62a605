//! Accuracy of whole motions: error of the load's position against cost, for every scheme, time step, solver and number
//! of refinements.
//!
//! The scene is the hoist, hanging in equilibrium, its segments disturbed in all directions, its anchor moved sideways or
//! driven round a circle. The reference is the paper's step at no more than 1/24000 s and extrapolated to zero
//! ([`taut_ground::reference::converged`]), whose own uncertainty stands beside the errors.

mod study;
mod table;

pub(crate) use study::STUDY;

use crate::cases::Cases;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use taut_ground::choice::Choice;
use taut_ground::reference::{self, Converged};
use taut_ground::trajectory::{Timing, Trajectory, simulate, steps_in};
use taut_integrator::{GeometricStiffness, Scheme, StepError, StepOptions, Stepper};
use taut_model::{HoistParams, JointKind};
use taut_output::check::ExperimentError;
use taut_solver::Backend;

/// How the anchor is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// 0.5 m sideways within 2 s.
    Aside,
    /// Round a horizontal circle of radius 0.25 m, one turn in 4 s.
    Circle,
}

/// One scene of the sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// Kind of the inner joints.
    pub joint: JointKind,
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// How the anchor is driven.
    pub drive: Drive,
}

impl Case {
    /// Its parameters: L = 10 m, segments of 1 kg, YA = 2·10⁷ N, random angular velocities up to 10⁻³ rad/s.
    #[must_use]
    pub fn params(&self) -> HoistParams {
        let base = HoistParams {
            segments: self.segments,
            mass_ratio: self.mass_ratio,
            joint: self.joint,
            seed: 1,
            ..HoistParams::default()
        };
        match self.drive {
            Drive::Aside => HoistParams {
                move_x: 0.5,
                move_duration: 2.0,
                ..base
            },
            Drive::Circle => HoistParams {
                circle_radius: 0.25,
                circle_period: 4.0,
                ..base
            },
        }
    }
}

/// A way of stepping, with its name in the tables.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub name: &'static str,
    /// Δt, sub-steps and backend of these are replaced by what is swept.
    pub options: StepOptions,
    /// Damping time of all rows in steps, τ/Δt.
    pub damping: f64,
    /// Sub-steps of a step.
    pub substeps: usize,
    /// Limit of iterations, 0 for direct solvers.
    pub iterations: usize,
}

/// The default, and every other scheme and variant, each a row.
#[must_use]
pub fn settings() -> Vec<Setting> {
    let options = StepOptions {
        guard: None,
        ..StepOptions::default()
    };
    let of = |name, scheme, stiffness| Setting {
        name,
        options: StepOptions {
            scheme,
            stiffness,
            ..options.clone()
        },
        damping: 0.0,
        substeps: 1,
        iterations: 0,
    };
    let third = |a, gamma| Scheme::ThirdDifference { a, gamma };
    let inertia = |alpha| GeometricStiffness::Inertia { alpha };
    let (implicit, spook) = (Scheme::LinearlyImplicit, Scheme::Spook);
    let off = GeometricStiffness::Off;
    let default = Scheme::THIRD_DIFFERENCE;
    vec![
        Setting {
            options: StepOptions::default(),
            ..of("default", default, off)
        },
        of("no guard", default, inertia(0.4)),
        Setting {
            options: StepOptions::default(),
            substeps: 2,
            ..of("2 sub-steps", default, off)
        },
        of("K α 1", default, inertia(1.0)),
        of("no K", default, off),
        of("3rd .26 -.005", third(0.26, -0.005), inertia(0.255)),
        of("3rd .3 -.02", third(0.3, -0.02), inertia(0.28)),
        of("3rd .6 -.15", third(0.6, -0.15), inertia(0.45)),
        of("3rd .75 -.2", third(0.75, -0.2), inertia(0.55)),
        of("spook K .25", spook, inertia(0.25)),
        of("spook K .5", spook, inertia(0.5)),
        Setting {
            damping: 0.5,
            ..of("spook K .5 τ Δt/2", spook, inertia(0.5))
        },
        of("spook", spook, off),
        of("implicit K .3", implicit, inertia(0.3)),
        of("implicit K .5", implicit, inertia(0.5)),
        Setting {
            options: StepOptions::paper(),
            ..of("paper", implicit, off)
        },
    ]
}

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub cases: Vec<Case>,
    /// Settings of the step.
    pub settings: Vec<Setting>,
    /// Steps a second; the first is what all settings run at, the default runs at each.
    pub rates: Vec<f64>,
    /// Solvers that the default also runs with, on the Cosserat joint with the fewest segments.
    pub choices: Vec<Choice>,
    /// Mass ratios of those runs.
    pub choice_ratios: Vec<f64>,
    /// Limits of iterations of the iterative ones.
    pub iterations: Vec<usize>,
    /// Simulated time \[s].
    pub time: f64,
}

/// The cases of the sweep: both joints with 24 and 100 segments, and the circle with 24 segments and the full joint.
#[must_use]
pub fn cases(segments: &[usize], ratios: &[f64]) -> Vec<Case> {
    let mut cases = Vec::new();
    for &segments in segments {
        for (joint, drive) in [
            (JointKind::Cosserat, Drive::Aside),
            (JointKind::Spherical, Drive::Aside),
            (JointKind::Cosserat, Drive::Circle),
        ] {
            // A turning anchor shows nothing more on a longer chain.
            if drive == Drive::Circle && segments > 24 {
                continue;
            }
            cases.extend(ratios.iter().map(|&mass_ratio| Case {
                joint,
                segments,
                mass_ratio,
                drive,
            }));
        }
    }
    cases
}

impl Default for Config {
    fn default() -> Self {
        Self {
            cases: cases(&[24, 100], &[1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6]),
            settings: settings(),
            rates: vec![60.0, 120.0, 240.0],
            choices: Choice::all(),
            choice_ratios: vec![1e2, 1e4, 1e6],
            iterations: vec![3, 10, 30, 100, 300],
            time: 20.0,
        }
    }
}

impl Config {
    /// Three ratios, 24 segments, 2 s, the solvers that are the fastest: a look at it.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            cases: cases(&[24], &[1e2, 1e6]),
            choices: vec![Choice::schur(Backend::Banded)],
            choice_ratios: vec![1e4],
            iterations: vec![10],
            time: 2.0,
            ..Self::default()
        }
    }
}

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    #[serde(flatten)]
    pub case: Case,
    /// Name of the setting.
    pub setting: String,
    /// Scheme, as the command line reads it.
    pub scheme: String,
    /// Geometric stiffness, likewise.
    pub stiffness: String,
    /// The guard was on.
    pub guard: bool,
    /// Solver.
    pub backend: String,
    /// Limit of iterations; 0 for direct solvers.
    pub iterations: usize,
    /// Refinement sweeps.
    pub refinements: usize,
    /// Δt \[s].
    pub dt: f64,
    /// Sub-steps of a step.
    pub substeps: usize,
    /// Simulated time of stable motion \[s].
    pub held_s: f64,
    /// Stable over the whole time asked for.
    pub stable: bool,
    /// Largest horizontal distance of the load from the reference while stable \[m].
    pub horizontal_m: f64,
    /// Largest vertical distance, likewise \[m].
    pub vertical_m: f64,
    /// Uncertainty of the reference \[m].
    pub reference_m: f64,
    /// Steps that the guard took back.
    pub redone: usize,
    /// Linear systems solved a step, mean.
    pub solves: f64,
    /// Step, median \[ns].
    pub step_ns: f64,
    /// Step, minimum \[ns].
    pub step_ns_min: f64,
    /// Wall-clock time of a simulated second, the guard's work included; runs share the machine \[s].
    pub cost: f64,
}

impl Record {
    /// Distance from the reference \[m].
    #[must_use]
    pub fn error(&self) -> f64 {
        self.horizontal_m.hypot(self.vertical_m)
    }
}

/// Cost of parts of the step: ratios of step times within one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Segments of the cable.
    pub segments: usize,
    /// Part of the step, in words.
    pub what: String,
    /// Step time over that of the first row of these segments.
    pub ratio: f64,
    /// Step, minimum over the blocks of the median in a block \[ns].
    pub step_ns: f64,
}

/// All runs.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Runs, scene by scene.
    pub records: Vec<Record>,
    /// Costs of K, guard and refinement.
    pub costs: Vec<Cost>,
}

/// Runs the sweep. A scene is a case, with its reference and all its runs; so are the costs of each size.
///
/// # Errors
/// Scenes or options that are not sound. Runs that end early are results.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let frame = 1.0 / config.rates.first().copied().unwrap_or(60.0);
    let frames = steps_in(config.time, frame);
    let records = cases.parallel("scenes", &config.cases, |case| {
        let reference = reference::converged(&case.params(), frame, frames)?;
        let runs = runs_of(config, case, frame).into_par_iter();
        let run = |(setting, dt)| run_one(case, &reference, &setting, dt, config.time);
        runs.map(run).collect::<Result<Vec<_>, StepError>>()
    })?;
    let mut sizes: Vec<usize> = config.cases.iter().map(|c| c.segments).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let costs = cases.in_turn("costs", &sizes, |n| costs(*n))?;
    Ok(Results {
        records: records.all()?.concat(),
        costs: costs.all()?.concat(),
    })
}

/// The runs of a scene, each with its Δt \[s].
fn runs_of(config: &Config, case: &Case, frame: f64) -> Vec<(Setting, f64)> {
    let own = config.settings.iter().cloned();
    let mut runs: Vec<_> = own.map(|setting| (setting, frame)).collect();
    let default = settings().swap_remove(0);
    let finer = config.rates.iter().skip(1);
    runs.extend(finer.map(|rate| (default.clone(), 1.0 / rate)));
    let fewest = config.cases.iter().map(|c| c.segments).min();
    let chosen = case.joint == JointKind::Cosserat
        && case.drive == Drive::Aside
        && Some(case.segments) == fewest
        && config.choice_ratios.contains(&case.mass_ratio);
    if chosen {
        runs.extend(
            solver_settings(config)
                .into_iter()
                .map(|setting| (setting, frame)),
        );
    }
    runs
}

/// The default with every solver: direct ones with 0, 1 and 2 refinements, the others over their iterations.
fn solver_settings(config: &Config) -> Vec<Setting> {
    let mut settings = Vec::new();
    let compiled = config.choices.iter().filter(|c| c.check().is_ok());
    for choice in compiled {
        let with = |backend: Backend, refinements, iterations| Setting {
            iterations,
            name: "default",
            options: StepOptions {
                backend,
                form: choice.form,
                refinements,
                ..StepOptions::default()
            },
            damping: 0.0,
            substeps: 1,
        };
        if choice.backend.is_iterative() {
            let limits = config.iterations.iter();
            settings.extend(limits.map(|&k| with(choice.backend.with_iterations(k), 0, k)));
        } else {
            settings.extend([0, 1, 2].map(|r| with(choice.backend.clone(), r, 0)));
        }
    }
    settings
}

/// Stepped by `setting` at `dt`, compared with the reference at its frames.
fn run_one(
    case: &Case,
    reference: &Converged,
    setting: &Setting,
    dt: f64,
    time: f64,
) -> Result<Record, StepError> {
    let params = HoistParams {
        damping: setting.damping * dt,
        ..case.params()
    };
    let options = StepOptions {
        dt,
        substeps: setting.substeps,
        ..setting.options.clone()
    };
    let mut stepper = Stepper::new(reference::scene(&params)?, options.clone())?;
    let run = simulate(&mut stepper, time, reference::most_gap(&params)?, |_| {});
    let (horizontal, vertical) = load_errors(&run, reference, dt);
    let timing: Timing = run.nanoseconds(taut_integrator::PhaseTimes::total);
    let steps = run.samples.len().max(1) as f64;
    let times = run.samples.iter().map(|s| s.phases.total().as_secs_f64());
    let total: f64 = times.sum();
    Ok(Record {
        case: *case,
        setting: setting.name.to_owned(),
        scheme: options.scheme.to_string(),
        stiffness: options.stiffness.to_string(),
        guard: options.guard.is_some(),
        backend: Choice {
            backend: options.backend.clone(),
            form: options.form,
        }
        .family(),
        iterations: setting.iterations,
        refinements: options.refinements,
        dt,
        substeps: options.substeps,
        held_s: run.failure.as_ref().map_or(time, |f| f.time),
        stable: run.failure.is_none(),
        horizontal_m: horizontal,
        vertical_m: vertical,
        reference_m: reference.uncertainty,
        redone: run.samples.iter().filter(|s| s.redone).count(),
        solves: run.samples.iter().map(|s| s.solves).sum::<usize>() as f64 / steps,
        step_ns: timing.median,
        step_ns_min: timing.min,
        cost: total / (steps * dt),
    })
}

/// Largest horizontal and vertical distance of the load from the reference at its frames \[m].
fn load_errors(run: &Trajectory, reference: &Converged, dt: f64) -> (f64, f64) {
    let every = steps_in(reference.frame, dt).max(1);
    let (mut horizontal, mut vertical) = (0.0_f64, 0.0_f64);
    let frames = run.samples.iter().skip(every - 1).step_by(every);
    for (sample, exact) in frames.zip(&reference.load) {
        let d = sample.load - Vector3::from(*exact);
        horizontal = horizontal.max(d.x.hypot(d.y));
        vertical = vertical.max(d.z.abs());
    }
    (horizontal, vertical)
}

/// Blocks of steps that the variants take turns in.
const BLOCKS: usize = 24;
/// Steps of a block.
const BLOCK: usize = 60;

/// Cost of K, guard and refinements on the hoist at ratio 10⁴, with the default scheme and the
/// banded solver.
fn costs(segments: usize) -> Result<Vec<Cost>, StepError> {
    let base = StepOptions {
        guard: None,
        refinements: 0,
        stiffness: GeometricStiffness::Off,
        ..StepOptions::default()
    };
    let k = StepOptions {
        stiffness: StepOptions::default().stiffness,
        ..base.clone()
    };
    let refined = |refinements| StepOptions {
        refinements,
        ..k.clone()
    };
    let variants = [
        ("scheme alone", base.clone()),
        ("with K", k.clone()),
        ("with K, 1 refinement", refined(1)),
        ("with K, 2 refinements", refined(2)),
        (
            "with K, guard, 1 refinement (default)",
            StepOptions::default(),
        ),
    ];
    // At rest, so that the scheme without K takes the same steps and more.
    let params = HoistParams {
        segments,
        mass_ratio: 1e4,
        ..HoistParams::default()
    };
    let mut steppers = variants
        .iter()
        .map(|(_, o)| Stepper::new(reference::scene(&params)?, o.clone()))
        .collect::<Result<Vec<_>, _>>()?;
    let mut best = vec![f64::INFINITY; variants.len()];
    for _ in 0..BLOCKS {
        for (stepper, best) in steppers.iter_mut().zip(&mut best) {
            let times = (0..BLOCK)
                .map(|_| Ok(stepper.step()?.phases.total()))
                .collect::<Result<Vec<_>, StepError>>()?;
            *best = best.min(Timing::of(times.into_iter()).median);
        }
    }
    let rows = variants.iter().zip(&best).map(|((what, _), ns)| Cost {
        segments,
        what: (*what).to_owned(),
        ratio: ns / best[0],
        step_ns: *ns,
    });
    Ok(rows.collect())
}
