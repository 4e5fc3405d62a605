//! `taut bench`: the main job.

use super::console::Console;
use super::deliver::{self, Way};
use crate::{Failure, overrides};
use clap::Args;
use std::path::PathBuf;
use taut_bench::machine::Machine;
use taut_ground::files::{self, Output};
use taut_model::{HoistParams, Network};
use taut_output::table::MARK;
use taut_studies::ladder::{self, Config, LEGEND};
use taut_studies::options::{Backends, Iterations, Quick, Ratios, Segments, Time};
use taut_studies::scenes;

/// Options of `taut bench`.
#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    /// Cables with branches and loops instead of the hoist: ring, junction, cranes, ladder, net; `--segments` are the
    /// ladder's cables, the net's rows and columns
    #[arg(long = "scene", value_delimiter = ',', value_name = "NAME", value_parser = scenes::network,
        conflicts_with_all = ["overrides", "time", "rows"])]
    scenes: Vec<Network>,
    #[command(flatten)]
    pub(crate) segments: Segments,
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
    pub(crate) quick: Quick,
    /// Writes all rows to a file as well (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
}

fn config(args: &BenchArgs) -> Result<Config, Failure> {
    let mut config = args.quick.of(Config::quick);
    if !args.segments.segments.is_empty() {
        config.segments.clone_from(&args.segments.segments);
    }
    args.ratios.replace(&mut config.ratios)?;
    args.iterations.replace(&mut config.iterations)?;
    let needs = format!("it must be at least one step of {:.4} s", config.dt);
    args.time.replace(&mut config.time, config.dt, 1, &needs)?;
    args.backends.refuse_limits()?;
    config.choices = args.backends.choices()?;
    let swept = |o: &&String| {
        let key = o.split('=').next().unwrap_or_default();
        ["segments", "mass_ratio", "load_mass"].contains(&key)
    };
    if let Some(o) = args.overrides.iter().find(swept) {
        return Err(Failure::Input(format!(
            "`--set {o}` has no effect on the main job: use `--segments` and `--ratios`"
        )));
    }
    config.scene = hoist(&config.scene, &overrides(&args.overrides)?)?;
    Ok(config)
}

/// The hoist with parameters overridden.
fn hoist(defaults: &HoistParams, overrides: &[(&str, &str)]) -> Result<HoistParams, Failure> {
    let text = taut_model::SceneSource::Hoist(Box::new(defaults.clone())).to_toml()?;
    match taut_model::SceneSource::parse(&text, overrides)? {
        taut_model::SceneSource::Hoist(params) => Ok(*params),
        _ => Err(Failure::Input(
            "the main job runs the hoist only".to_owned(),
        )),
    }
}

/// What the columns of its answer are.
const ANSWER: &str = "\
Fastest: the least median time of a whole step with multipliers and elongation within the error, unrefined where that
suffices; next: the same of another family of solvers, and how many times as long it takes; k×: iterations a step";

/// Where the rest is.
const MORE: &str =
    "Every row: `taut bench --rows`, target/taut/bench.json; plots: target/taut/report.html";

/// Runs the main job on the hoist, or on the scenes asked for.
pub(crate) fn run(args: &BenchArgs, console: Console) -> Result<(), Failure> {
    let [json] = files::open([("--json", args.json.as_deref())], &[])?;
    let way = Way {
        console,
        json: json.as_ref(),
        is_rows_alone: json.as_ref().is_some_and(Output::is_stdout),
    };
    if !args.scenes.is_empty() {
        return of_scenes(args, way);
    }
    let config = config(args)?;
    let bar = console.progress(0);
    let results = ladder::run(&config, &bar)?;
    bar.finish_and_clear();
    let scene = format!(
        "{}\nhoist: L = {} m, segments of {} kg, Δt = 1/{:.0} s, anchor moved {} m; {} s simulated",
        Machine::current(),
        config.scene.length,
        config.scene.resolve()?.segment_mass,
        1.0 / config.dt,
        config.scene.move_x,
        config.time
    );
    let answer = ladder::answer(&results);
    let text = if args.rows {
        let rows = ladder::rows(&results);
        format!("{scene}\n{LEGEND}\n{MARK}\n{rows}\n{ANSWER}\n{answer}")
    } else {
        format!("{scene}\n{ANSWER}\n\n{answer}\n{MORE}")
    };
    if !way.is_rows_alone {
        files::print(&text)?;
    }
    deliver::write("bench", &results.records, way)?;
    let settings = ladder::settings(&config)?;
    super::report::of_main_job(&config, &results, settings, args.quick.quick, way)
}

fn of_scenes(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let options = scenes::Options {
        scenes: args.scenes.clone(),
        segments: args.segments.clone(),
        ratios: args.ratios.clone(),
        backends: args.backends.clone(),
        iterations: args.iterations.clone(),
        quick: args.quick,
    };
    let bar = way.console.progress(0);
    let found = scenes::run_study(&options, &bar).map_err(|e| Failure::Input(e.to_string()))?;
    bar.finish_and_clear();
    deliver::deliver("scenes", found, way)
}
