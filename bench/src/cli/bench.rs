//! `taut bench`: the main job, or what the options name instead.

use super::console::Console;
use super::deliver::{Found, Way};
use super::scenes;
use super::sweeps::{self, Sweep};
use crate::{Failure, choices, count, number, overrides, steps, take_ratios};
use clap::Args;
use std::path::{Path, PathBuf};
use taut_bench::ladder::{self, Config};
use taut_bench::machine::Machine;
use taut_bench::output;
use taut_bench::report::settings;
use taut_bench::table::{self, MARK};
use taut_model::{HoistParams, Network};

/// Options of `taut bench`.
#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    /// Measures something else than the main job
    #[arg(long, value_enum, value_name = "NAME")]
    pub(crate) sweep: Option<Sweep>,
    /// Cables with branches and loops instead of the hoist: ring, junction, cranes, ladder, net
    #[arg(long = "scene", value_delimiter = ',', value_name = "NAME", value_parser = scenes::network)]
    pub(crate) scenes: Vec<Network>,
    /// Systems from Matrix Market files instead of the hoist
    #[arg(long = "matrix", value_delimiter = ',', value_name = "A.mtx")]
    pub(crate) matrices: Vec<PathBuf>,
    /// Numbers of segments; of the ladder's cables; of the net's rows and columns
    #[arg(long, value_delimiter = ',', value_name = "N", value_parser = count,
        allow_negative_numbers = true)]
    pub(crate) segments: Vec<usize>,
    /// Mass ratios load/segment
    #[arg(long, value_delimiter = ',', value_name = "R", value_parser = number, allow_negative_numbers = true)]
    pub(crate) ratios: Vec<f64>,
    /// Solvers: a backend with options after colons, `/kkt` for the KKT form, such as cg:jacobi or umfpack/kkt; for
    /// `--sweep kernels` also batch, NAME+refine, lapack:lower, lapack:upper
    #[arg(long, value_delimiter = ',', value_name = "B")]
    pub(crate) backends: Vec<String>,
    /// Limits of iterations for the iterative solvers
    #[arg(long, value_delimiter = ',', value_name = "K", value_parser = count,
        allow_negative_numbers = true)]
    pub(crate) iterations: Vec<usize>,
    /// Parameters of the hoist
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) overrides: Vec<String>,
    /// Time steps of the accuracy sweep (s), fractions such as 1/60 too; the first is what all schemes run at
    #[arg(long, value_delimiter = ',', value_name = "S", value_parser = number, allow_negative_numbers = true)]
    pub(crate) dt: Vec<f64>,
    /// Simulated time of what is run to its end, such as the columns `load` and `held` (s)
    #[arg(long, value_name = "S", value_parser = number, allow_negative_numbers = true)]
    pub(crate) time: Option<f64>,
    /// Prints every row of the main job: each solver, each limit of iterations
    #[arg(long)]
    pub(crate) rows: bool,
    /// A tenth of the work, under 10 s
    #[arg(long)]
    pub(crate) quick: bool,
    /// Writes all rows to a file as well (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    pub(crate) json: Option<PathBuf>,
}

fn config(args: &BenchArgs) -> Result<Config, Failure> {
    let mut config = args.quick.then(Config::quick).unwrap_or_default();
    let replace = |list: &mut Vec<usize>, with: &[usize]| {
        if !with.is_empty() {
            *list = with.to_vec();
        }
    };
    replace(&mut config.segments, &args.segments);
    replace(&mut config.iterations, &args.iterations);
    config.iterations.sort_unstable();
    config.iterations.dedup();
    if config.iterations.first() == Some(&0) {
        return Err(Failure::Input(
            "`--iterations` holds 0: each limit must be at least 1".to_owned(),
        ));
    }
    take_ratios(&args.ratios, &mut config.ratios)?;
    if let Some(time) = args.time {
        config.time = time;
    }
    if steps(config.time, config.dt)? == 0 {
        return Err(Failure::Input(format!(
            "`--time` is {} s: it must be at least one step of {:.4} s",
            config.time, config.dt
        )));
    }
    config.choices = choices(&args.backends)?;
    if let Some(name) = args.backends.iter().find(|b| b.contains("iterations=")) {
        return Err(Failure::Input(format!(
            "`iterations=` in `{name}` has no effect on the main job: use `--iterations`"
        )));
    }
    if !args.dt.is_empty() {
        return Err(Failure::Input(
            "`--dt` has no effect on the main job: use `--sweep accuracy`".to_owned(),
        ));
    }
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

/// What the columns of the main job's tables are.
const LEGEND: &str = "\
step: median time of a whole step; ns/joint: of its linear solve, with one refinement for direct solvers (umfpack/kkt:
its own); backw.: componentwise backward error without that refinement, the worst row's; error: of the multipliers
against extended precision (r0: without that refinement); elong.: of the hanging cable after ½ s; load m: distance from
the reference motion; held: simulated time, or the time of the end; fastest 1e: of this scene, with error and elong.
within 1e-3 and so on, refined or not";

/// What the columns of its answer are.
const ANSWER: &str = "\
Fastest: the least median time of a whole step with multipliers and elongation within the error, unrefined where that
suffices; next: the same of another family of solvers, and how many times as long it takes; k×: iterations a step";

/// Where the rest is.
const MORE: &str =
    "Every row: `taut bench --rows`, target/taut/bench.json; plots: target/taut/report.html";

/// Runs the main job, or what is asked for instead of it.
pub(crate) fn run(args: &BenchArgs, console: Console) -> Result<(), Failure> {
    let read: Vec<&Path> = args.matrices.iter().map(PathBuf::as_path).collect();
    let [json] = output::open([("--json", args.json.as_deref())], &read)?;
    let way = Way {
        console,
        json: json.as_ref(),
    };
    if !args.matrices.is_empty() {
        return super::matrix::bench(args, way);
    }
    if !args.scenes.is_empty() {
        return scenes::run(args, way);
    }
    if let Some(sweep) = args.sweep {
        return sweeps::run(sweep, args, way);
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
    let answer = table::answer(&results);
    let text = if args.rows {
        let rows = table::ladder(&results);
        format!("{scene}\n{LEGEND}\n{MARK}\n{rows}\n{ANSWER}\n{answer}")
    } else {
        format!("{scene}\n{ANSWER}\n\n{answer}\n{MORE}")
    };
    let found = Found {
        name: "bench",
        settings: settings::main_job(&config)?,
        text,
        rows: &results.records,
        omissions: &results.omissions,
    };
    found.deliver_rows(way)?;
    super::report::of_main_job(&config, &results, found.settings, args.quick, way)
}
