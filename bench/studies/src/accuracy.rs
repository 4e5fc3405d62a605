//! Accuracy of whole motions: error of the load's position against cost, for every scheme, time step, solver and number
//! of refinements.

use crate::options::{number as read, require_positive};
use crate::study::question::*;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::sync::LazyLock;
use taut_integrator::{PhaseTimes, Scheme, StepError, StepOptions, Stepper};
use taut_measure::choice::Choice;
use taut_measure::reference::{self, Converged};
use taut_measure::trajectory::{Timing, Trajectory, simulate, steps_in};
use taut_model::{HoistParams, JointKind};
use taut_solver::Backend;

pub(crate) const STUDY: Study = Study {
    name: "accuracy",
    question: question!("accuracy", FUNCTIONS),
    options: Own::augment_args,
    run: |matches, reporter| {
        let steps = Own::from_arg_matches(matches)?.dt;
        run(&Asked::read(matches), &steps, reporter.cases)
    },
    ..study::PLAIN
};

const FUNCTIONS: Functions = &[
    ("drive", Text(drive)),
    ("motion", Text(motion)),
    ("distance", Worth(distance)),
    ("is_motion", Holds(is_motion)),
    ("stable", Holds(|row| is(row, "stable"))),
    (
        "horizontal_m_shown",
        Text(|row| lost(row).unwrap_or_else(|| mm(distance(row)))),
    ),
];

#[derive(Debug, Args)]
struct Own {
    /// Time steps (s), fractions such as 1/60 too; the first is what all schemes run at
    #[arg(long, value_delimiter = ',', value_name = "S", value_parser = read, allow_negative_numbers = true)]
    dt: Vec<f64>,
}

/// What is run: every setting at the first rate, the default at each of the rates, and on the Cosserat joint with the
/// fewest segments the default with every solver.
struct Config {
    segments: Vec<usize>,
    ratios: Vec<f64>,
    /// Steps a second, ascending.
    rates: Vec<f64>,
    choices: Vec<Choice>,
    /// Mass ratios of the runs with every solver.
    choice_ratios: Vec<f64>,
    iterations: Vec<usize>,
    /// Simulated time \[s].
    time: f64,
}

impl Config {
    fn new(quick: bool) -> Self {
        let all = vec![1.0, 10.0, 1e2, 1e3, 1e4, 1e5, 1e6];
        let fastest = vec![Choice::schur(Backend::Banded)];
        Self {
            segments: pick(quick, [vec![24, 100], vec![24]]),
            ratios: pick(quick, [all, vec![1e2, 1e6]]),
            rates: vec![60.0, 120.0, 240.0],
            choices: pick(quick, [Choice::all(), fastest]),
            choice_ratios: pick(quick, [vec![1e2, 1e4, 1e6], vec![1e4]]),
            iterations: pick(quick, [vec![3, 10, 30, 100, 300], vec![10]]),
            time: pick(quick, [20.0, 2.0]),
        }
    }

    fn asked(asked: &Asked, dts: &[f64]) -> Result<Self, ExperimentError> {
        let mut config = Self::new(asked.quick);
        asked.segments(&mut config.segments);
        asked.ratios(&mut config.ratios)?;
        if !asked.ratios.is_empty() {
            config.choice_ratios.clone_from(&config.ratios);
        }
        asked.refuse_limits()?;
        if !asked.backends.is_empty() {
            config.choices = asked.choices()?;
        }
        asked.iterations(&mut config.iterations)?;
        if !dts.is_empty() {
            config.rates = rates(dts)?;
        }
        let frame = 1.0 / config.rates[0];
        let needs = "it must be at least one step";
        asked.time(&mut config.time, frame, 1, needs)?;
        Ok(config)
    }
}

/// Steps a second, ascending, of these time steps \[s].
fn rates(dts: &[f64]) -> Result<Vec<f64>, ExperimentError> {
    require_positive("a number of `--dt`", dts)?;
    let mut rates: Vec<f64> = dts.iter().map(|dt| 1.0 / dt).collect();
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    let first = rates[0];
    let whole = |rate: &f64| ((rate / first).round() - rate / first).abs() < 1e-9;
    if !rates.iter().all(whole) {
        return Err(
            "`--dt`: the largest must be a whole multiple of each of the others, so that they meet"
                .into(),
        );
    }
    Ok(rates)
}

fn run(asked: &Asked, dts: &[f64], cases: &Cases) -> Result<Found, ExperimentError> {
    let config = Config::asked(asked, dts)?;
    let settings = settings(1.0 / config.rates[0]);
    let rows = json!({ "records": records(&config, cases)? });
    Ok(Found {
        settings: set([
            ("segments", counts(&config.segments)),
            ("load/segment", numbers(&config.ratios)),
            ("Δt", list(&config.rates, |rate| step(1.0 / rate))),
            ("simulated", seconds(config.time)),
            ("steps", list(&settings, |s| s.name.to_owned())),
            ("solvers", solvers(&config.choices)),
            ("their load/segment", numbers(&config.choice_ratios)),
            ("iterations", counts(&config.iterations)),
            ("refinements", "1; of direct solvers 0, 1, 2".to_owned()),
        ]),
        text: format!(
            "{} s of the hoist, 10 m, segments of 1 kg, YA = 2·10⁷ N{}",
            config.time,
            text(&rows)
        ),
        rows,
        ..Found::default()
    })
}

/// One scene: L = 10 m, segments of 1 kg, YA = 2·10⁷ N, random angular velocities up to 10⁻³ rad/s.
#[derive(Debug)]
struct Case {
    params: HoistParams,
    /// `aside`: the anchor moves by 0.5 m sideways within 2 s; `circle`: round a horizontal circle of radius 0.25 m, one
    /// turn in 4 s.
    drive: &'static str,
    /// Runs with every solver, too.
    with_solvers: bool,
}

/// Both joints, and the circle with up to 24 segments: a turning anchor shows nothing more on a longer chain.
fn scenes(config: &Config) -> Vec<Case> {
    let mut cases = Vec::new();
    for &segments in &config.segments {
        let circle = (segments <= 24).then_some((JointKind::Cosserat, "circle"));
        let kinds = [JointKind::Cosserat, JointKind::Spherical].map(|joint| (joint, "aside"));
        for (joint, drive) in kinds.into_iter().chain(circle) {
            cases.extend(config.ratios.iter().map(|&mass_ratio| {
                let still = HoistParams {
                    segments,
                    mass_ratio,
                    joint,
                    seed: 1,
                    ..HoistParams::default()
                };
                let params = match drive {
                    "aside" => HoistParams {
                        move_x: 0.5,
                        move_duration: 2.0,
                        ..still
                    },
                    _ => HoistParams {
                        circle_radius: 0.25,
                        circle_period: 4.0,
                        ..still
                    },
                };
                Case {
                    params,
                    drive,
                    with_solvers: (joint, drive) == (JointKind::Cosserat, "aside")
                        && segments == config.segments[0]
                        && config.choice_ratios.contains(&mass_ratio),
                }
            }));
        }
    }
    cases
}

/// A way of stepping, with its name in the tables.
#[derive(Clone)]
struct Setting {
    name: &'static str,
    options: StepOptions,
    /// Damping time of all rows in steps, τ/Δt.
    damping: f64,
    /// Limit of iterations, 0 for direct solvers.
    iterations: usize,
}

/// The default at this Δt \[s].
fn default(dt: f64) -> Setting {
    Setting {
        name: "default",
        options: StepOptions {
            dt,
            ..StepOptions::default()
        },
        damping: 0.0,
        iterations: 0,
    }
}

/// The default, and every other scheme and variant, each a row.
fn settings(dt: f64) -> Vec<Setting> {
    let third = |a, gamma| Scheme::ThirdDifference { a, gamma };
    let (own, spook, implicit) = (
        Scheme::THIRD_DIFFERENCE,
        Scheme::Spook,
        Scheme::LinearlyImplicit,
    );
    // With the weight α of the geometric stiffness and τ/Δt, unguarded.
    let table = [
        ("no guard", own, 0.4, 0.0),
        ("K α 1", own, 1.0, 0.0),
        ("no K", own, 0.0, 0.0),
        ("3rd .26 -.005", third(0.26, -0.005), 0.255, 0.0),
        ("3rd .3 -.02", third(0.3, -0.02), 0.28, 0.0),
        ("3rd .6 -.15", third(0.6, -0.15), 0.45, 0.0),
        ("3rd .75 -.2", third(0.75, -0.2), 0.55, 0.0),
        ("spook K .25", spook, 0.25, 0.0),
        ("spook K .5", spook, 0.5, 0.0),
        ("spook K .5 τ Δt/2", spook, 0.5, 0.5),
        ("spook", spook, 0.0, 0.0),
        ("implicit K .3", implicit, 0.3, 0.0),
        ("implicit K .5", implicit, 0.5, 0.0),
    ];
    let default = default(dt);
    let of = |name, options| Setting {
        name,
        options: StepOptions { dt, ..options },
        ..default.clone()
    };
    let mut settings = vec![default.clone()];
    settings.extend(table.map(|(name, scheme, alpha, damping)| Setting {
        damping,
        ..of(name, motions::step(scheme, alpha, dt, false))
    }));
    let halved = StepOptions {
        substeps: 2,
        ..StepOptions::default()
    };
    settings.insert(2, of("2 sub-steps", halved));
    settings.push(of("paper", StepOptions::paper()));
    settings
}

/// The default with every solver: direct ones with 0, 1 and 2 refinements, the others over their iterations.
fn solver_settings(config: &Config, dt: f64) -> Vec<Setting> {
    let mut settings = Vec::new();
    for choice in config.choices.iter().filter(|c| c.check().is_ok()) {
        let with = |backend: Backend, refinements, iterations| Setting {
            iterations,
            options: StepOptions {
                backend,
                form: choice.form,
                refinements,
                ..default(dt).options
            },
            ..default(dt)
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

/// The rows, scene by scene: a scene is a case, with its reference and all its runs.
fn records(config: &Config, cases: &Cases) -> Result<Vec<Value>, ExperimentError> {
    let frame = 1.0 / config.rates[0];
    let frames = steps_in(config.time, frame);
    let records = cases.parallel("scenes", &scenes(config), |case| {
        let reference = reference::converged(&case.params, frame, frames)?;
        let mut runs = settings(frame);
        runs.extend(config.rates[1..].iter().map(|rate| default(1.0 / rate)));
        if case.with_solvers {
            runs.extend(solver_settings(config, frame));
        }
        let runs = runs.par_iter();
        let run = |setting| record(case, &reference, setting, config.time);
        runs.map(run).collect::<Result<Vec<_>, StepError>>()
    })?;
    Ok(records.all()?.concat())
}

/// Stepped by `setting`, compared with the reference at its frames.
fn record(
    case: &Case,
    reference: &Converged,
    setting: &Setting,
    time: f64,
) -> Result<Value, StepError> {
    let options = &setting.options;
    let dt = options.dt;
    let params = HoistParams {
        damping: setting.damping * dt,
        ..case.params.clone()
    };
    let mut stepper = Stepper::new(reference::scene(&params)?, options.clone())?;
    let run = simulate(&mut stepper, time, reference::most_gap(&params)?, |_| {});
    let [horizontal, vertical] = load_errors(&run, reference, dt);
    let timing: Timing = run.nanoseconds(PhaseTimes::total);
    let steps = run.samples.len().max(1) as f64;
    let times = run.samples.iter().map(|s| s.phases.total().as_secs_f64());
    Ok(json!({
        "joint": params.joint,
        "segments": params.segments,
        "mass_ratio": params.mass_ratio,
        "drive": case.drive,
        "setting": setting.name,
        "scheme": options.scheme.to_string(),
        "stiffness": options.stiffness.to_string(),
        "guard": options.guard.is_some(),
        "backend": Choice::of(options).family(),
        "iterations": setting.iterations,
        "refinements": options.refinements,
        "dt": dt,
        "substeps": options.substeps,
        // Simulated time of stable motion.
        "held_s": run.failure.as_ref().map_or(time, |f| f.time),
        "stable": run.failure.is_none(),
        "horizontal_m": horizontal,
        "vertical_m": vertical,
        "reference_m": reference.uncertainty,
        "redone": run.samples.iter().filter(|s| s.redone).count(),
        "solves": run.samples.iter().map(|s| s.solves).sum::<usize>() as f64 / steps,
        "step_ns": timing.median,
        "step_ns_min": timing.min,
        // Wall-clock time of a simulated second, the guard's work included; runs share the machine.
        "cost": times.sum::<f64>() / (steps * dt),
    }))
}

/// Largest horizontal and vertical distance of the load from the reference at its frames, while stable \[m].
fn load_errors(run: &Trajectory, reference: &Converged, dt: f64) -> [f64; 2] {
    let every = steps_in(reference.frame, dt).max(1);
    let frames = run.samples.iter().skip(every - 1).step_by(every);
    let apart = frames.zip(&reference.load).map(|(sample, exact)| {
        let d = sample.load - Vector3::from(*exact);
        [d.x.hypot(d.y), d.z.abs()]
    });
    apart.fold([0.0; 2], |most, d| [most[0].max(d[0]), most[1].max(d[1])])
}

fn drive(row: &Row) -> String {
    match text_of(row, "drive") {
        "aside" => "anchor moved 0.5 m in 2 s".to_owned(),
        _ => "anchor on a circle".to_owned(),
    }
}

/// The load's distance from the reference \[m].
fn distance(row: &Row) -> Option<f64> {
    Some(number_of(row, "horizontal_m")?.hypot(number_of(row, "vertical_m")?))
}

/// Cell of a lost run: † and the time that it held \[s].
fn lost(row: &Row) -> Option<String> {
    let held = number_of(row, "held_s").unwrap_or(f64::NAN);
    (!is(row, "stable")).then(|| format!("†{held:.2}"))
}

fn motion(row: &Row) -> String {
    lost(row).unwrap_or_else(|| {
        let [across, along] = ["horizontal_m", "vertical_m"].map(|key| mm(number_of(row, key)));
        let redone = number_of(row, "redone").filter(|n| *n > 0.0);
        let redone = redone.map_or(String::new(), |n| format!(" g{n}"));
        format!("{across}/{along}{redone}")
    })
}

/// Two digits, in millimetres.
fn mm(metres: Option<f64>) -> String {
    match 1e3 * metres.unwrap_or(f64::NAN) {
        mm if mm >= 10.0 => format!("{mm:.0}"),
        mm if mm >= 1.0 => format!("{mm:.1}"),
        mm if mm >= 0.1 => format!("{mm:.2}"),
        mm => format!("{mm:.3}"),
    }
}

/// True for rows over settings and rates, which use the default solver with one refinement.
fn is_motion(row: &Row) -> bool {
    let is_one = |key, count| number_of(row, key) == Some(count);
    text_of(row, "backend") == *SOLVER && is_one("refinements", 1.0) && is_one("iterations", 0.0)
}

/// The solver that the settings run with.
static SOLVER: LazyLock<String> = LazyLock::new(|| {
    let options = StepOptions::default();
    Choice::schur(options.backend).family()
});

fn text(data: &Value) -> String {
    let mut default = rows_of(data, "records");
    default.retain(|row| text_of(row, "setting") == "default");
    let dt = |row: &Row| number_of(row, "dt").unwrap_or(f64::NAN);
    let first = default.iter().map(dt).fold(0.0, f64::max);
    let (motions, solved): (Vec<Row>, Vec<Row>) = default.into_iter().partition(is_motion);
    let scenes = distinct(motions.iter().map(scene));
    let runs: Vec<Vec<&Row>> = scenes
        .iter()
        .map(|own| motions.iter().filter(|row| scene(row) == *own).collect())
        .collect();
    let orders: Vec<Value> = runs.iter().map(|own| orders(own)).collect();
    let at_first = runs
        .iter()
        .filter_map(|own| own.iter().find(|row| dt(row) == first).copied());
    let verdict = verdict(&at_first.collect::<Vec<_>>(), first);
    // The default's own solver stands among the others where these have run.
    let with_others = distinct(solved.iter().map(scene));
    let own = motions
        .iter()
        .filter(|row| dt(row) == first && with_others.contains(&scene(row)));
    let solvers: Vec<&Row> = own.chain(&solved).collect();
    format!(
        "{}{}{verdict}{}",
        STUDY.sheet("motions").text(data),
        STUDY.sheet("orders").of(&orders),
        STUDY.sheet("solvers").of(&solvers)
    )
}

/// Columns that tell a scene from others.
fn scene(row: &Row) -> [Option<&Value>; 4] {
    ["joint", "segments", "mass_ratio", "drive"].map(|key| row.get(key))
}

/// Observed orders of the default on a scene, between its rates.
fn orders(runs: &[&Row]) -> Value {
    let mut stable: Vec<&&Row> = runs.iter().filter(|row| is(row, "stable")).collect();
    let point = |row: &Row| [distance(row), number_of(row, "dt")].map(|x| x.unwrap_or(f64::NAN));
    stable.sort_by(|a, b| point(b)[1].total_cmp(&point(a)[1]));
    // The sweep over solvers repeats some.
    stable.dedup_by_key(|row| point(row)[1].to_bits());
    let orders: Vec<String> = stable
        .windows(2)
        .map(|w| format!("{:.2}", motions::order(point(w[0]), point(w[1]))))
        .collect();
    let unknown = runs.iter().filter_map(|row| number_of(row, "reference_m"));
    let mut row = runs[0].clone();
    row.insert("orders".to_owned(), json!(orders.join(" ")));
    row.insert(
        "reference_mm".to_owned(),
        json!(1e3 * unknown.fold(0.0, f64::max)),
    );
    Value::Object(row)
}

/// Verdict on the default at the first rate, a row a scene: stable everywhere, and from ratio 100 on within 1 mm across and
/// 10 mm along.
fn verdict(runs: &[&Row], dt: f64) -> String {
    let stable = runs.iter().filter(|row| is(row, "stable")).count();
    let worst = |key| {
        let heavy = |row: &&&Row| number_of(row, "mass_ratio").is_some_and(|ratio| ratio >= 100.0);
        let errors = runs.iter().filter(heavy);
        let errors = errors.filter_map(|row| number_of(row, key));
        mm(Some(errors.fold(0.0, f64::max)))
    };
    format!(
        "\nThe default at Δt = 1/{:.0} s: stable in {stable} of {} scenes;\nfrom ratio 100 on at most {} mm across \
         (bar 1) and {} mm along (bar 10).\n",
        1.0 / dt,
        runs.len(),
        worst("horizontal_m"),
        worst("vertical_m"),
    )
}
