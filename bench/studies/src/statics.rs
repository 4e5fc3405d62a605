//! The hanging cable at rest: is it as long as it must be, and how many iterations does that take?

use crate::options::count;
use crate::study::question::*;
use crate::systems::{Fewest, grid};
use serde::{Deserialize, Serialize};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_measure::choice::Choice;
use taut_measure::pace;
use taut_measure::trajectory::load_position;
use taut_model::{HoistParams, Scene, SceneError};
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
    pub backend: String,
    pub segments: usize,
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
    pub backend: String,
    pub segments: usize,
    pub mass_ratio: f64,
    /// Each step starts from the last one's multipliers; otherwise from zero.
    pub warm_start: bool,
    /// Relative error of the elongation asked for.
    pub level: f64,
    /// Iterations needed; `None` where the limit was not enough.
    pub iterations: Option<usize>,
    pub limit: usize,
}

/// Finds the fewest iterations a step for each level, to 2 % above 64 (the error falls with the iterations, but not
/// strictly: the count is the smallest that is met).
pub fn iterations_needed(
    params: &HoistParams,
    options: &StepOptions,
    family: &str,
    levels: &[f64],
    limit: usize,
) -> Result<Vec<Needed>, StepError> {
    hanging(params)?;
    // The stopping test is off: the count is what is asked for. An iteration that diverges has not met the level.
    let error_with = |iterations: usize| {
        let backend = options.backend.with_iterations(iterations);
        let options = StepOptions {
            backend: backend.with_tolerance(0.0),
            ..options.clone()
        };
        Ok(hold(params, &options).map_or(f64::INFINITY, |held| held.error))
    };
    let mut search = Fewest::new(limit, 64, error_with);
    let needed = levels.iter().map(|&level| {
        Ok(Needed {
            backend: family.to_owned(),
            segments: params.segments,
            mass_ratio: params.mass_ratio,
            warm_start: options.warm_start,
            level,
            iterations: search.within(level)?,
            limit,
        })
    });
    needed.collect()
}

#[derive(Default, Serialize, Deserialize)]
struct Results {
    /// Direct solvers: the cable damped to rest.
    settled: Vec<Settled>,
    /// Iterative solvers: iterations needed, warm and cold.
    needed: Vec<Needed>,
}

/// Most steps of [`settle`] in the study: the load's bounce at the largest ratios takes a few hundred.
const SETTLE_STEPS: usize = 6000;

/// Δt \[s].
const DT: f64 = 1.0 / 60.0;

/// Relative errors of the elongation that iterations are counted for.
const LEVELS: [f64; 3] = [1e-3, 1e-6, 1e-9];

/// A solver on a cable: settled where it is direct, else its iterations, warm and cold.
fn rows(params: &HoistParams, choice: &Choice, limit: usize) -> Result<Results, StepError> {
    let mut rows = Results::default();
    if !choice.backend.is_iterative() {
        rows.settled.push(settle(params, choice, DT, SETTLE_STEPS)?);
        return Ok(rows);
    }
    for warm_start in [true, false] {
        let options = StepOptions {
            warm_start,
            ..choice.plain_options(DT)
        };
        let needed = iterations_needed(params, &options, &choice.family(), &LEVELS, limit)?;
        rows.needed.extend(needed);
    }
    Ok(rows)
}

pub(crate) const STUDY: Study = Study {
    name: "static",
    question: question!("static", FUNCTIONS),
    options: Own::augment_args,
    run: |matches, reporter| {
        let limit = Own::from_arg_matches(matches)?.limit;
        ask(&Asked::read(matches), limit, reporter.cases)
    },
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[("start", Text(start)), ("needed", Text(needed))];

#[derive(Debug, Args)]
struct Own {
    /// Most iterations tried for the iterative solvers
    #[arg(long, default_value_t = 4096, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    limit: usize,
}

/// Settles the cable with every direct solver and counts the iterations of the others, in parallel; each solver on each
/// scene is a case. The dense solver, whose cost is cubic, takes part where it is named.
fn ask(asked: &Asked, limit: usize, cases: &Cases) -> Result<Found, ExperimentError> {
    let is_named = !asked.backends.is_empty();
    let fits = |c: &Choice| is_named || (c.check().is_ok() && c.backend.name() != "dense");
    let mut choices = asked.choices()?;
    choices.retain(fits);
    let (mut segments, mut ratios) = (vec![24, 100], vec![1.0, 10.0, 1e2, 1e3, 1e4, 1e5]);
    asked.segments(&mut segments);
    asked.ratios(&mut ratios)?;
    if limit == 0 {
        return Err(Refused("`--limit` is 0: it must be at least 1".to_owned()).into());
    }
    let mut tasks = Vec::new();
    for (segments, mass_ratio) in grid(&segments, &ratios) {
        let params = HoistParams {
            segments,
            mass_ratio,
            ..HoistParams::default()
        };
        tasks.extend(choices.iter().map(|choice| (params.clone(), choice)));
    }
    let run = |(params, choice): &(HoistParams, &Choice)| rows(params, choice, limit);
    let mut all = Results::default();
    for mut part in cases.parallel("solvers", &tasks, run)?.all()? {
        all.settled.append(&mut part.settled);
        all.needed.append(&mut part.needed);
    }
    let rows = data(&all)?;
    let legend = STUDY.question().legend;
    let [settled, needed] = ["settled", "needed"].map(|name| STUDY.sheet(name).text(&rows));
    Ok(Found {
        settings: set([
            ("segments", counts(&segments)),
            ("load/segment", numbers(&ratios)),
            ("solvers", solvers(&choices)),
            ("most iterations", limit.to_string()),
            ("Δt", step(DT)),
        ]),
        text: format!(
            "Released unstretched and damped to rest, one refinement: elongation\n{MARK}\n{settled}\n{legend}\n\
             {needed}"
        ),
        rows,
        ..Found::default()
    })
}

fn start(row: &Row) -> String {
    pick(is(row, "warm_start"), ["cold", "warm"]).to_owned()
}

fn needed(row: &Row) -> String {
    let [needed, limit] = ["iterations", "limit"].map(|key| number_of(row, key));
    let more = || format!("> {}", limit.unwrap_or(f64::NAN));
    needed.map_or_else(more, |n| n.to_string())
}
