//! The command line. Tables go to standard output, progress and errors to standard error; exit code 2 stands
//! for bad input and for results that could not be written, 1 for a run that became unstable or a check that failed, 3 for
//! a check that could not be made, 128 + its number for a run that a signal ended.

mod against;
mod cases;
mod console;
mod ledger;
mod matrix;
mod merge;
mod parse;
mod replay;
mod report;
mod run;
mod scene;
mod signals;
mod study;
mod track;
mod view;

use clap::{ArgMatches, Args, Parser, Subcommand};
use console::Console;
use matrix::{DumpArgs, MatricesArgs, SolveArgs};
use merge::MergeArgs;
use report::ReportArgs;
use scene::ExplicitArgs;
use std::process::ExitCode;
use taut_integrator::{Elimination, GeometricStiffness, Guard, Scheme, StepOptions};
use taut_measure::errors::Cause;
use taut_measure::{Choice, files, source};
use taut_model::{Scene, SceneSource};
use taut_output::table;
use taut_solver::Foreign;
use taut_solver::coulomb::ConeMethod;
use taut_studies::options::{count, number, overrides, require_positive};
use track::TrackArgs;

/// The command line without the options of experiments, which [`parse`] adds.
#[derive(Debug, Parser)]
#[command(
    name = "taut",
    version,
    override_usage = "taut [OPTIONS]\n       taut [--quiet] <COMMAND>",
    max_term_width = 110,
    after_help = "Examples:\n  taut\n  taut --quick\n  taut run hoist --time 10"
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Tables and data only: no progress, no notes of what was written where
    // The last, whatever others there are.
    #[arg(long, short, global = true, display_order = 998)]
    quiet: bool,
    /// Arguments as parsed, with the options of the experiments.
    #[arg(skip)]
    matches: ArgMatches,
}

#[derive(Debug, Subcommand)]
enum Command {
    // An experiment has no text here: `parse` adds that of its study.
    Bench,
    /// The experiments beside the main job, each with options of its own; without a name, their list
    #[command(after_help = "Examples:\n  taut study\n  taut study kernels --segments 100")]
    Study,
    Static,
    /// Simulates a named scene or a TOML file
    #[command(
        after_help = "Examples:\n  taut run hoist --set mass_ratio=100 --set move_x=0.5 --time 10 --out load.csv\n  taut run gantry --columns time,hook.z,bottom.tension,hoist_speed --out lift.csv\n  taut run gantry --time 60 --save gantry.json --save-at 30\n  taut run --resume gantry.json --time 30\n  taut run gantry --record gantry.tape && taut replay gantry.tape"
    )]
    Run(run::RunArgs),
    /// Shows a recorded run: what it holds, as a table, as a page to play and scrub through, as a picture, as animated glTF
    #[command(after_help = replay::AFTER_HELP)]
    Replay(replay::ReplayArgs),
    /// Shows a scene in a browser on this machine, to be driven by its controls at 60 frames a second
    #[command(after_help = view::AFTER_HELP)]
    View(view::ViewArgs),
    /// What each thing that a scene models, and each part of its step, costs and is worth: time of a step, error of the load,
    /// tension, energy
    #[command(
        after_help = "Examples:\n  taut ledger gantry --tolerance 5\n  taut ledger crane.toml --controls drive.csv --tolerance 2 --apply lean.toml"
    )]
    Ledger(ledger::LedgerArgs),
    /// Writes a scene as TOML with the meaning of every key: what `taut run FILE` reads back to the identical run
    #[command(
        after_help = "Example: taut scene hoist --set segments=6 --explicit > six.toml && taut run six.toml"
    )]
    Scene(ExplicitArgs),
    Paper,
    Hard,
    /// The shards of a study as one: tables, page and rows as the study itself writes them
    #[command(after_help = merge::AFTER_HELP)]
    Merge(MergeArgs),
    /// Writes the linear systems of a step, or of many, as Matrix Market files: S and the KKT matrix, with exact solutions
    #[command(
        after_help = "Examples:\n  taut dump hoist --set mass_ratio=1e5 --step 60 --out target/systems\n  taut dump gantry --steps 0..600 --out target/sequence && taut study sequence target/sequence"
    )]
    Dump(DumpArgs),
    /// Solves a system from Matrix Market files with every backend: times, backward and forward errors
    #[command(
        after_help = "Examples:\n  taut solve target/systems/hoist_60.mtx --backend banded,faer:lu\n  taut solve bcsstk14.mtx.gz"
    )]
    Solve(SolveArgs),
    /// Writes a graded set of systems: sizes, mass ratios, topologies, states, compliances; and a sequence of 600
    #[command(after_help = "Example: taut matrices --out target/matrices --gzip")]
    Matrices(MatricesArgs),
    /// Instructions, allocations, errors and times of a step against the baseline: what CI fails on
    #[command(after_help = track::AFTER_HELP)]
    Track(TrackArgs),
    /// The page of a report: plots and tables in one HTML file
    #[command(after_help = report::AFTER_HELP)]
    Report(ReportArgs),
    /// Lists the backends, which are compiled in, and their licences
    #[command(after_help = "Example: taut backends")]
    Backends,
}

/// A scene, as most commands take one.
#[derive(Debug, Args)]
struct SceneArgs {
    /// Name of a scene, or a TOML file
    scene: String,
    /// Overrides a parameter of the scene
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
}

impl SceneArgs {
    fn built(&self) -> Result<(SceneSource, Scene), Failure> {
        let built = source::built(&self.scene, &overrides(&self.overrides)?);
        built.map_err(Failure::of)
    }
}

/// Scheme, solver and time step of a simulation.
#[derive(Debug, Args)]
struct StepArgs {
    /// Backend with options after colons, `/kkt` for the KKT form (default: the first one compiled in)
    #[arg(long, value_name = "B")]
    backend: Option<String>,
    /// Integration scheme: linearly-implicit (the paper's), spook, `third-difference[:a=A][:gamma=G]`
    #[arg(long, value_name = "NAME", default_value_t = Scheme::default())]
    scheme: Scheme,
    /// Geometric stiffness as inertia: off, or its weight α (default: 0.4; a + γ of a third difference, else 0.5)
    #[arg(long, value_name = "WEIGHT", allow_hyphen_values = true)]
    stiffness: Option<GeometricStiffness>,
    /// Redo steps whose linearisation does not hold: off, or the tolerance (of lever arms)
    #[arg(
        long,
        value_name = "TOLERANCE",
        default_value = "0.005",
        allow_hyphen_values = true
    )]
    guard: String,
    /// Sub-steps that each step is made of
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = count, allow_negative_numbers = true)]
    substeps: usize,
    /// Order in which the constraints are eliminated: auto, scene, minimum-degree
    #[arg(long, value_name = "ORDER", default_value_t = Elimination::default())]
    elimination: Elimination,
    /// Refinement sweeps from the pieces (default: 1 for direct solvers, 0 for iterative ones)
    #[arg(long, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    refine: Option<usize>,
    /// How impulses of contacts are found: newton, or pgs:sweeps=N:tolerance=X
    #[arg(long, value_name = "METHOD", default_value_t = ConeMethod::default())]
    contacts: ConeMethod,
    /// Time step (s)
    #[arg(long, value_name = "S", default_value = "1/60", value_parser = number, allow_negative_numbers = true)]
    dt: f64,
}

/// Most refinement sweeps that a run may ask for.
const MAX_REFINEMENTS: usize = 100;

/// Reason for an exit code other than 0.
enum Failure {
    /// Bad input: code 2.
    Input(String),
    /// A run that became unstable: code 1.
    Unstable(String),
    /// A check that was missed: code 1.
    Check(String),
    /// A check that could not be made: code 3.
    NotChecked(String),
    /// A run that a signal of that number ended: code 128 + number.
    Stopped(String, usize),
}

impl Failure {
    /// A cause that is no more than bad input.
    fn of(e: impl Into<Cause>) -> Self {
        Self::Input(e.into().to_string())
    }

    /// Prints it on standard error.
    fn print(&self) {
        let (Self::Input(text)
        | Self::Unstable(text)
        | Self::Check(text)
        | Self::NotChecked(text)
        | Self::Stopped(text, _)) = self;
        files::complain(text);
    }

    fn code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Unstable(_) | Self::Check(_) => 1,
            Self::NotChecked(_) => 3,
            Self::Stopped(_, signal) => 128 + *signal as u8,
        }
    }
}

impl<E: std::error::Error> From<E> for Failure {
    fn from(e: E) -> Self {
        Self::Input(e.to_string())
    }
}

/// The program `taut`, with the arguments that it was called with and these solvers beside its own, in every command and
/// under their own names. A crate of any place makes it with its `main`:
///
/// ```no_run
/// # use taut_solver::{Backend, Capabilities, Entry, Foreign};
/// # const SKYLINE: Foreign = Foreign {
/// #     entry: Entry::new("skyline"),
/// #     capabilities: Capabilities { indefinite: false, iterative: false },
/// #     create: |_| Backend::preferred()?.create(),
/// # };
/// /// Allocations are counted where this line is.
/// #[global_allocator]
/// static ALLOCATOR: taut_bench::Counting = taut_bench::Counting;
///
/// fn main() -> std::process::ExitCode {
///     taut_bench::command_line(&[SKYLINE])
/// }
/// ```
pub fn command_line(solvers: &[Foreign]) -> ExitCode {
    if let Err(e) = taut_solver::register(solvers) {
        return report_failure(&Failure::from(e));
    }
    let cli = match parse::parse(std::env::args_os()) {
        Ok(cli) => cli,
        Err(e) if e.use_stderr() => {
            // One line, as for every other bad input.
            let text = e.to_string();
            let paragraph = text.lines().map(str::trim).take_while(|l| !l.is_empty());
            let line = paragraph.collect::<Vec<_>>().join(" ");
            let line = line.trim_start_matches("error: ");
            return report_failure(&Failure::Input(format!(
                "{line} (see `{} --help`)",
                parse::asked_for()
            )));
        }
        Err(help) => {
            let shown = files::print(&help.render().ansi().to_string());
            return shown.map_or_else(
                |e| report_failure(&Failure::from(e)),
                |()| ExitCode::SUCCESS,
            );
        }
    };
    if let Err(e) = taut_lanes::Level::wanted() {
        return report_failure(&Failure::Input(format!("TAUT_SIMD: {e}")));
    }
    signals::survive_long_files();
    let console = Console { quiet: cli.quiet };
    let done = match &cli.command {
        Some(Command::Merge(args)) => merge::run(args, console),
        Some(Command::Run(args)) => run::run(args, console),
        Some(Command::Replay(args)) => replay::run(args),
        Some(Command::View(args)) => view::run(args),
        Some(Command::Ledger(args)) => ledger::run(args, console),
        Some(Command::Scene(args)) => scene::run(args),
        Some(Command::Dump(args)) => matrix::dump(args, console),
        Some(Command::Solve(args)) => matrix::solve(args),
        Some(Command::Matrices(args)) => matrix::matrices(args, console),
        Some(Command::Track(args)) => track::run(args, console),
        Some(Command::Report(args)) => report::run(args, console),
        None
        | Some(
            Command::Study | Command::Bench | Command::Static | Command::Paper | Command::Hard,
        ) => study::run(&cli, console),
        Some(Command::Backends) => files::print(&table::backends()).map_err(Failure::from),
    };
    done.map_or_else(|failure| report_failure(&failure), |()| ExitCode::SUCCESS)
}

/// Says what ended the program.
fn report_failure(failure: &Failure) -> ExitCode {
    failure.print();
    ExitCode::from(failure.code())
}

/// The guard with the tolerance of the text, or none.
fn guard(text: &str) -> Result<Option<Guard>, Failure> {
    if text == "off" {
        return Ok(None);
    }
    let tolerance: f64 = text.parse().map_err(|_| {
        Failure::Input(format!(
            "`--guard {text}` is neither `off` nor a tolerance such as 0.005"
        ))
    })?;
    Ok(Some(Guard {
        tolerance,
        ..Guard::default()
    }))
}

/// The options that the arguments stand for.
fn step_options(args: &StepArgs) -> Result<StepOptions, Failure> {
    let mut options = StepOptions::default();
    if let Some(name) = &args.backend {
        let choice: Choice = name.parse().map_err(Failure::Input)?;
        choice.check()?;
        options = choice.options(args.dt);
    }
    options.dt = args.dt;
    options.substeps = args.substeps;
    options.scheme = args.scheme;
    options.stiffness = args
        .stiffness
        .unwrap_or(GeometricStiffness::inertia(args.scheme.default_alpha()));
    options.guard = guard(&args.guard)?;
    options.elimination = args.elimination;
    options.contacts = args.contacts;
    options.refinements = args.refine.unwrap_or(options.refinements);
    if options.refinements > MAX_REFINEMENTS {
        return Err(Failure::Input(format!(
            "`--refine` is {}: at most {MAX_REFINEMENTS}, and more than 2 improve nothing",
            options.refinements
        )));
    }
    require_positive("`--dt`", &[args.dt])?;
    Ok(options)
}
