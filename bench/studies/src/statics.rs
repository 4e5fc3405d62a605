//! The hanging cable at rest: is it as long as it must be, and how many iterations does that take?
//!
//! The exact discrete elongation is Σⱼ εⱼ Tⱼ over the joints; the massless continuum is M g L/(YA). The cable hangs
//! along z exactly, so that x and y stay zero to the last bit and the step's transverse instability at large mass
//! ratios has nothing to grow from: what is measured here is the solver.

mod study;
mod table;

pub(crate) use study::STUDY;

use crate::cases::Cases;
use serde::{Deserialize, Serialize};
use taut_ground::choice::Choice;
use taut_ground::pace;
use taut_ground::trajectory::load_position;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Scene, SceneError};
use taut_output::check::ExperimentError;
use taut_solver::Status;

/// Steps of [`hold`]: half a second at 60 Hz.
pub const HOLD_STEPS: usize = 30;

/// How a solver holds a cable that hangs in equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// |elongation/exact − 1| at the end, against the exact discrete value.
    pub error: f64,
    /// |elongation/(M g L/(YA)) − 1| at the end, against the massless continuum.
    pub error_continuum: f64,
    /// Steps whose solve claimed convergence.
    pub claimed: usize,
}

/// The hanging scene of the given hoist: no motion, no seeds, and the damping time 2/ω that damps the bounce of the
/// load (ω² = YA/(L M)) critically.
///
/// # Errors
/// As [`HoistParams::resolve`].
pub fn hanging(params: &HoistParams) -> Result<HoistParams, SceneError> {
    let hoist = params.resolve()?;
    let stiffness = hoist.stiffness.ea / params.length;
    Ok(HoistParams {
        seed: 0,
        move_x: 0.0,
        circle_radius: 0.0,
        initial_angle: 0.0,
        damping: 2.0 * (hoist.load_mass / stiffness).sqrt(),
        ..params.clone()
    })
}

/// Elongation of the hanging cable: how far the load is below the end of the unstrained cable \[m].
fn elongation(params: &HoistParams, scene: &Scene) -> f64 {
    -load_position(scene).z - params.length - params.load_offset
}

/// Holds the cable for [`HOLD_STEPS`] steps from its exact equilibrium, multipliers started from zero.
///
/// # Errors
/// As [`Stepper::step`].
pub fn hold(params: &HoistParams, options: &StepOptions) -> Result<Held, StepError> {
    let params = hanging(params)?;
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options.clone())?;
    let mut claimed = 0;
    for _ in 0..HOLD_STEPS {
        let report = pace::step(&mut stepper)?;
        claimed += usize::from(report.solve.status == Status::Converged);
    }
    let elongation = elongation(&params, stepper.scene());
    let error = |exact: f64| (elongation / exact - 1.0).abs();
    Ok(Held {
        error: error(params.exact_elongation()),
        error_continuum: error(params.continuum_elongation()),
        claimed,
    })
}

/// A cable released unstretched and damped to rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settled {
    /// Backend and form.
    pub backend: String,
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// Steps until the length had stayed within 10⁻¹³ of the elongation, or within the rounding of the load's position,
    /// for 30 steps; or the limit.
    pub steps: usize,
    /// Elongation at the end \[m].
    pub elongation_m: f64,
    /// |elongation/exact − 1|, exact discrete value.
    pub error: f64,
    /// |elongation/(M g L/YA) − 1|.
    pub error_continuum: f64,
    /// Largest magnitude of a body's x and y \[m].
    pub sideways_m: f64,
}

/// Releases the unstretched cable and waits for rest, at most `limit` steps.
///
/// # Errors
/// As [`Stepper::step`].
pub fn settle(
    params: &HoistParams,
    choice: &Choice,
    dt: f64,
    limit: usize,
) -> Result<Settled, StepError> {
    let params = hanging(params)?;
    let mut stepper = Stepper::new(params.build()?, choice.plain_options(dt))?;
    let exact = params.exact_elongation();
    // At rest the load may still go to and fro between a number and its two neighbours.
    let rest = (1e-13 * exact).max(2.0 * f64::EPSILON * (params.length + params.load_offset));
    let (mut steps, mut last, mut quiet) = (0, f64::INFINITY, 0);
    let mut since_quiet = f64::INFINITY;
    while steps < limit && quiet < 30 {
        pace::step(&mut stepper)?;
        steps += 1;
        last = elongation(&params, stepper.scene());
        if (last - since_quiet).abs() <= rest {
            quiet += 1;
        } else {
            (quiet, since_quiet) = (0, last);
        }
    }
    let sideways = stepper
        .scene()
        .bodies
        .position
        .iter()
        .map(|x| x.x.abs().max(x.y.abs()));
    Ok(Settled {
        backend: choice.family(),
        segments: params.segments,
        mass_ratio: params.mass_ratio,
        steps,
        elongation_m: last,
        error: (last / exact - 1.0).abs(),
        error_continuum: (last / params.continuum_elongation() - 1.0).abs(),
        sideways_m: sideways.fold(0.0, f64::max),
    })
}

/// Fewest iterations a step that hold the hanging cable's elongation within a level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Needed {
    /// Backend and form.
    pub backend: String,
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// Each step starts from the last one's multipliers; otherwise from zero.
    pub warm_start: bool,
    /// Relative error of the elongation asked for.
    pub level: f64,
    /// Iterations needed; `None` where the limit was not enough.
    pub iterations: Option<usize>,
    pub limit: usize,
}

/// Finds the fewest iterations a step for each level by doubling and bisection (the error falls with the iterations,
/// but not strictly: the count is the smallest that the bisection meets).
///
/// # Errors
/// As [`Stepper::step`].
pub fn iterations_needed(
    params: &HoistParams,
    options: &StepOptions,
    family: &str,
    levels: &[f64],
    limit: usize,
) -> Result<Vec<Needed>, StepError> {
    // The stopping test is off: the count is what is asked for. An iteration that diverges has not met the level.
    let error_with = |iterations: usize| {
        let backend = options
            .backend
            .with_iterations(iterations)
            .with_tolerance(0.0);
        let options = StepOptions {
            backend,
            ..options.clone()
        };
        hold(params, &options).map_or(f64::INFINITY, |held| held.error)
    };
    hanging(params)?;
    let mut needed = Vec::new();
    let (mut low, mut high, mut reachable) = (0, 1, true);
    for &level in levels {
        // No level below an unreachable one is reachable.
        let mut met = reachable && error_with(high) <= level;
        while reachable && !met && high < limit {
            low = high;
            high = (2 * high).min(limit);
            met = error_with(high) <= level;
        }
        reachable = met;
        let (mut below, mut enough) = (low, high);
        while met && enough - below > 1 + below / 64 {
            let middle = below.midpoint(enough);
            if error_with(middle) <= level {
                enough = middle;
            } else {
                below = middle;
            }
        }
        needed.push(Needed {
            backend: family.to_owned(),
            segments: params.segments,
            mass_ratio: params.mass_ratio,
            warm_start: options.warm_start,
            level,
            iterations: met.then_some(enough),
            limit,
        });
        // A stricter level needs at least as many.
        low = below;
        high = enough;
    }
    Ok(needed)
}

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Numbers of segments.
    pub segments: Vec<usize>,
    /// Mass ratios load/segment.
    pub ratios: Vec<f64>,
    pub choices: Vec<Choice>,
    /// Relative errors of the elongation that iterations are counted for, strictest last.
    pub levels: Vec<f64>,
    /// Most iterations tried.
    pub limit: usize,
    /// Δt \[s].
    pub dt: f64,
}

/// Rows of a sweep.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Results {
    /// Direct solvers: the cable damped to rest.
    pub settled: Vec<Settled>,
    /// Iterative solvers: iterations needed, warm and cold.
    pub needed: Vec<Needed>,
}

/// Most steps of [`settle`] in a sweep: the load's bounce at the largest ratios takes a few hundred.
const SETTLE_STEPS: usize = 6000;

/// Settles the cable with every direct solver and counts the iterations of the others, in parallel; each solver on each scene
/// is a case.
///
/// # Errors
/// As [`Stepper::step`].
pub fn sweep(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let mut tasks = Vec::new();
    for &segments in &config.segments {
        for &mass_ratio in &config.ratios {
            tasks.extend(config.choices.iter().map(|choice| {
                let params = HoistParams {
                    segments,
                    mass_ratio,
                    ..HoistParams::default()
                };
                (params, choice)
            }));
        }
    }
    let run = |(params, choice): &(HoistParams, &Choice)| sweep_one(config, params, choice);
    let mut all = Results::default();
    for mut part in cases.parallel("solvers", &tasks, run)?.all()? {
        all.settled.append(&mut part.settled);
        all.needed.append(&mut part.needed);
    }
    Ok(all)
}

fn sweep_one(config: &Config, params: &HoistParams, choice: &Choice) -> Result<Results, StepError> {
    let mut part = Results::default();
    if !choice.backend.is_iterative() {
        part.settled
            .push(settle(params, choice, config.dt, SETTLE_STEPS)?);
        return Ok(part);
    }
    for warm_start in [true, false] {
        let options = StepOptions {
            warm_start,
            ..choice.plain_options(config.dt)
        };
        let rows = iterations_needed(
            params,
            &options,
            &choice.family(),
            &config.levels,
            config.limit,
        )?;
        part.needed.extend(rows);
    }
    Ok(part)
}
