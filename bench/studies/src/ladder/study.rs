//! The study of the main job: its options, what it says, its rows with what its page shows besides.

use super::Config;
use super::extras::measure;
use super::settings::settings;
use super::table::{LEGEND, answer, rows};
use crate::options::{Backends, Iterations, Quick, Ratios, Refused, Segments, Time, overrides};
use crate::scenes;
use crate::study::{self, Found, Reporter, Study, data};
use clap::{Args, FromArgMatches};
use taut_model::{HoistParams, Network, SceneSource};
use taut_output::check::ExperimentError;
use taut_output::table::MARK;

/// `taut bench`.
pub(crate) const STUDY: Study = Study {
    name: "bench",
    title: "speed against error of sparse solvers on hoisting cables",
    about: "Every solver, every mass ratio: what a step costs and how wrong it is (the default command)",
    details: "The answer goes to standard output, all rows to target/taut/bench.json (or --json), and a page of plots and tables to target/taut/report.html, with its data in bench.report.json beside it.",
    examples: &[
        "--segments 24 --ratios 1,1e5 --backends banded,umfpack/kkt,cg:group",
        "--scene ring,net --quick",
    ],
    mark: ("", "fastest_at"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter),
    ..study::PLAIN
};

/// What it reads.
#[derive(Debug, Args)]
struct Options {
    /// Cables with branches and loops instead of the hoist: ring, junction, cranes, ladder, net; `--segments` are the
    /// ladder's cables, the net's rows and columns
    #[arg(long = "scene", value_delimiter = ',', value_name = "NAME", value_parser = scenes::network,
        conflicts_with_all = ["overrides", "time", "rows"])]
    scenes: Vec<Network>,
    #[command(flatten)]
    segments: Segments,
    #[command(flatten)]
    ratios: Ratios,
    #[command(flatten)]
    backends: Backends,
    #[command(flatten)]
    iterations: Iterations,
    /// Parameters of the hoist
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    time: Time,
    /// Prints every row: each solver, each limit of iterations
    #[arg(long)]
    rows: bool,
    #[command(flatten)]
    quick: Quick,
}

fn config(options: &Options) -> Result<Config, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    if !options.segments.segments.is_empty() {
        config.segments.clone_from(&options.segments.segments);
    }
    options.ratios.replace(&mut config.ratios)?;
    options.iterations.replace(&mut config.iterations)?;
    let needs = format!("it must be at least one step of {:.4} s", config.dt);
    options
        .time
        .replace(&mut config.time, config.dt, 1, &needs)?;
    options.backends.refuse_limits()?;
    config.choices = options.backends.choices()?;
    let swept = |o: &&String| {
        let key = o.split('=').next().unwrap_or_default();
        ["segments", "mass_ratio", "load_mass"].contains(&key)
    };
    if let Some(o) = options.overrides.iter().find(swept) {
        let reason = "has no effect on the main job: use `--segments` and `--ratios`";
        return Err(Refused(format!("`--set {o}` {reason}")).into());
    }
    config.scene = hoist(&config.scene, &overrides(&options.overrides)?)?;
    Ok(config)
}

/// The hoist with parameters overridden.
fn hoist(
    defaults: &HoistParams,
    overrides: &[(&str, &str)],
) -> Result<HoistParams, ExperimentError> {
    let text = SceneSource::Hoist(Box::new(defaults.clone())).to_toml()?;
    match SceneSource::parse(&text, overrides)? {
        SceneSource::Hoist(params) => Ok(*params),
        _ => Err(Refused("the main job runs the hoist only".to_owned()).into()),
    }
}

/// What the columns of its answer are.
const ANSWER: &str = "\
Fastest: the least median time of a whole step with multipliers and elongation within the error, unrefined where that
suffices; next: the same of another family of solvers, and how many times as long it takes; k×: iterations a step";

/// Where the rest is.
const MORE: &str =
    "Every row: `taut bench --rows`, target/taut/bench.json; plots: target/taut/report.html";

fn run(options: &Options, reporter: &mut Reporter<'_>) -> Result<Found, ExperimentError> {
    let config = config(options)?;
    let results = super::run(&config, reporter.progress)?;
    let scene = format!(
        "hoist: L = {} m, segments of {} kg, Δt = 1/{:.0} s, anchor moved {} m; {} s simulated",
        config.scene.length,
        config.scene.resolve()?.segment_mass,
        1.0 / config.dt,
        config.scene.move_x,
        config.time
    );
    let answer = answer(&results);
    (reporter.say)(&if options.rows {
        let rows = rows(&results);
        format!("{scene}\n{LEGEND}\n{MARK}\n{rows}\n{ANSWER}\n{answer}")
    } else {
        format!("{scene}\n{ANSWER}\n\n{answer}\n{MORE}\n")
    })?;
    let extras = measure(&config.choices, options.quick.quick, reporter.progress)?;
    Ok(Found {
        settings: settings(&config)?,
        rows: data(&results.records)?,
        extras: data(&extras)?,
        omissions: results.omissions,
        ..Found::default()
    })
}
