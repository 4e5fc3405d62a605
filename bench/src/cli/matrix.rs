//! `taut dump`, `taut solve`, `taut matrices`: linear systems as files.

use super::console::Console;
use super::{Failure, SceneArgs, StepArgs, step_options};
use crate::machine::Machine;
use clap::{ArgGroup, Args};
use indicatif::ProgressBar;
use std::ops::Range;
use std::path::{Path, PathBuf};
use taut_integrator::Stepper;
use taut_measure::files::{self, Output};
use taut_measure::inputs::Inputs;
use taut_measure::matrix::dump::{self, Label};
use taut_measure::matrix::sequence::{INDEX, Recorder, Wanted, Written};
use taut_measure::matrix::solve::{STALLED, SystemRow};
use taut_measure::matrix::{System, files as system_files};
use taut_measure::{pace, source};
use taut_output::check::ExperimentError;
use taut_output::row::number_of;
use taut_output::table::MARK;
use taut_studies::matrix::{self, suite};

/// Most steps before a dump.
const MOST_STEPS: u64 = 10_000_000;

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("which").required(true).args(["at", "steps"]))]
pub(crate) struct DumpArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    step: StepArgs,
    /// What the operator does: a CSV file with the columns `time` (s) and names of the scene's controls; linear in
    /// between, the first and the last row hold outside
    #[arg(long, value_name = "FILE.csv")]
    controls: Option<PathBuf>,
    /// Steps made before the one whose system is written: 0 for the first
    #[arg(long = "step", value_name = "K")]
    at: Option<u64>,
    /// Writes a sequence instead, the systems of steps A to B − 1, counted from 0: one matrix for each pattern,
    /// arrays of values and right-hand sides with a column a step, and `sequence.csv`
    #[arg(long, value_name = "A..B", value_parser = range, conflicts_with = "name")]
    steps: Option<Range<u64>>,
    /// Writes the exact solutions of a sequence, in 32 digits
    #[arg(long, requires = "steps", conflicts_with = "at")]
    exact: bool,
    /// Folder of the files
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Name of the matrix (default: scene and step)
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Compresses the files
    #[arg(long)]
    gzip: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SolveArgs {
    /// The matrix: Matrix Market, plain or compressed
    #[arg(value_name = "A.mtx")]
    matrix: PathBuf,
    /// Right-hand side (default: `A_b.mtx` beside the matrix, else A·1)
    #[arg(value_name = "b.mtx")]
    b: Option<PathBuf>,
    /// Solution to compare with (default: `A_x.mtx` beside `A_b.mtx`, else one refined in 32 digits)
    #[arg(value_name = "x.mtx")]
    x: Option<PathBuf>,
    /// Backends with options after colons (default: all that accept the matrix)
    #[arg(
        long = "backend",
        visible_alias = "backends",
        value_delimiter = ',',
        value_name = "B"
    )]
    backends: Vec<String>,
    /// Writes the rows to a file as well (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct MatricesArgs {
    /// Folder of the files
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The small systems only
    #[arg(long)]
    quick: bool,
    /// Compresses the files
    #[arg(long)]
    gzip: bool,
    /// Writes the index to a file as JSON as well (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
}

const SOLVE_LEGEND: &str = "\
times: minima of repeats; normwise, compon.: backward errors, |r|/(|A||x|+|b|) in the largest norm and row by row;
error: relative error of x in the largest norm";

const STALLED_LEGEND: &str = "\
stalled: nothing is claimed of x, as no correction reduces its residual or error any further; in this solver's order or scaling
the matrix is nearly singular, or the tolerance is below rounding
";

/// Numbers of steps, `A..B`.
fn range(text: &str) -> Result<Range<u64>, String> {
    let ends = text.split_once("..");
    let ends = ends.and_then(|(a, b)| a.parse().ok().zip(b.parse().ok()));
    let (first, end) = ends.ok_or("give two whole numbers from 0 on, such as 0..600")?;
    if first >= end {
        return Err(format!(
            "the range is empty: its end, {end}, has to be beyond {first}"
        ));
    }
    Ok(first..end)
}

/// Writes the system of a step, or those of a sequence.
pub(crate) fn dump(args: &DumpArgs, console: Console) -> Result<(), Failure> {
    let (_, scene) = args.scene.built()?;
    let inputs = source::inputs(args.controls.as_deref(), &scene).map_err(Failure::of)?;
    let at = args.at.unwrap_or_default();
    let steps = args.steps.clone().unwrap_or(at..at + 1);
    if steps.end > MOST_STEPS {
        let option = if args.steps.is_some() {
            "steps"
        } else {
            "step"
        };
        return Err(Failure::Input(format!(
            "`--{option}` goes to {}: at most {MOST_STEPS}",
            steps.end
        )));
    }
    let comments = comments(args, source::mass_ratio(&scene)?);
    let name = name_of(args, at)?;
    let mut stepper = Stepper::new(scene, step_options(&args.step)?)?;
    files::make_folder(&args.out)?;
    let bar = console.progress(steps.end).with_message("dump");
    for _ in 0..steps.start {
        advance(&mut stepper, &inputs)?;
        bar.inc(1);
    }
    if args.steps.is_some() {
        let mut recorder = Recorder::new(Wanted {
            folder: args.out.clone(),
            comments,
            exact: args.exact,
            gzip: args.gzip,
        })
        .map_err(Failure::of)?;
        record(&mut recorder, &mut stepper, &inputs, steps, &bar)?;
        bar.finish_and_clear();
        return print_written(recorder.finish().map_err(Failure::of)?, console);
    }
    bar.finish_and_clear();
    inputs.apply(&mut stepper)?;
    let label = Label { name, comments };
    let systems = dump::systems(&mut stepper)?;
    for system in systems {
        if let Err(e) = &system.x {
            let form = system.form;
            files::complain(&format!(
                "no exact solution of the {form} form is written: {e}"
            ));
        }
        for path in dump::write(&system, &label, &args.out, args.gzip)? {
            files::print(&format!("{}\n", path.display()))?;
        }
    }
    Ok(())
}

/// Name of the files of a single step.
fn name_of(args: &DumpArgs, at: u64) -> Result<String, Failure> {
    match &args.name {
        Some(name) if name.is_empty() || name.contains(['/', '\\']) => Err(Failure::Input(
            format!("`--name {name}` is no name of a file in `--out`"),
        )),
        Some(name) => Ok(name.clone()),
        None => {
            let stem = Path::new(&args.scene.scene).file_stem().unwrap_or_default();
            Ok(format!("{}_{at}", stem.to_string_lossy()))
        }
    }
}

/// Makes a step.
fn advance(stepper: &mut Stepper, inputs: &Inputs) -> Result<(), Failure> {
    inputs.apply(stepper)?;
    let stepped = pace::step(stepper);
    stepped.map_err(|e| Failure::Unstable(e.to_string()))?;
    Ok(())
}

/// Records the systems of steps, the first of which comes next.
fn record(
    recorder: &mut Recorder,
    stepper: &mut Stepper,
    inputs: &Inputs,
    steps: Range<u64>,
    bar: &ProgressBar,
) -> Result<(), Failure> {
    for step in steps {
        inputs.apply(stepper)?;
        recorder.take(step, stepper).map_err(Failure::of)?;
        advance(stepper, inputs)?;
        bar.inc(1);
    }
    Ok(())
}

/// Names the files of a sequence, and the changes of its pattern.
fn print_written(written: Written, console: Console) -> Result<(), Failure> {
    for name in written.inexact {
        files::complain(&format!(
            "no exact solutions of {name}.mtx are written: they are out of reach"
        ));
    }
    let stretches = written.stretches;
    for path in written.files {
        files::print(&format!("{}\n", path.display()))?;
    }
    if stretches > 1 {
        let changes = stretches - 1;
        console.doubt(format!(
            "the pattern changes {changes} times: the files are numbered by pattern, {INDEX} says which step has which"
        ));
    }
    Ok(())
}

fn comments(args: &DumpArgs, mass_ratio: f64) -> Vec<String> {
    let set = args.scene.overrides.join(" ");
    let scene = format!("scene {} {set}", args.scene.scene);
    vec![
        scene.trim_end().to_owned(),
        match (&args.steps, args.at.unwrap_or_default()) {
            (Some(steps), _) => format!("steps {} to {}", steps.start, steps.end - 1),
            (None, at) => format!("step {at}: the system of the step after {at} others"),
        },
        format!(
            "time step {:e} s, scheme {}, {} sub-steps",
            args.step.dt, args.step.scheme, args.step.substeps
        ),
        format!("mass ratio {mass_ratio:e}: heaviest over lightest body"),
    ]
}

/// Solves one system with the backends asked for.
pub(crate) fn solve(args: &SolveArgs) -> Result<(), Failure> {
    let own = system_files(&args.matrix);
    let read = own.iter().chain(&args.b).chain(&args.x);
    let read: Vec<&Path> = read.map(PathBuf::as_path).collect();
    if args.matrix.is_dir() || args.matrix.ends_with("info.toml") {
        return Err(Failure::Input(format!(
            "`{}` is no matrix: contact problems are solved in their scene, `taut run SCENE --contacts METHOD`",
            args.matrix.display()
        )));
    }
    let [json] = files::open([("--json", args.json.as_deref())], &read)?;
    let system = System::read(&args.matrix, args.b.as_deref(), args.x.as_deref())?;
    let results = matrix::backends(&args.backends)
        .and_then(|config| matrix::measured(&system, &config))
        .map_err(|e| Failure::Input(e.to_string()))?;
    if !json.as_ref().is_some_and(Output::is_stdout) {
        let text = matrix::solved(&results);
        let is_stalled = |record: &SystemRow| record.status == STALLED;
        let stalled = match results.records.iter().any(is_stalled) {
            true => STALLED_LEGEND,
            false => "",
        };
        files::print(&format!(
            "{}\n{SOLVE_LEGEND}\n{stalled}{MARK}\n{text}",
            Machine::current()
        ))?;
    }
    if let Some(json) = json {
        json.json(&results)?;
    }
    Ok(())
}

/// Writes the graded set and the sequence.
pub(crate) fn matrices(args: &MatricesArgs, console: Console) -> Result<(), Failure> {
    files::make_folder(&args.out)?;
    let [json] = files::open([("--json", args.json.as_deref())], &[])?;
    let bar = console.progress(0).with_message("matrices");
    let unmade = |e: ExperimentError| Failure::Input(e.to_string());
    let cases = suite::cases(args.quick);
    let entries = suite::generate(&cases, &args.out, args.gzip, &bar).map_err(unmade)?;
    let steps = if args.quick { 60 } else { 600 };
    let sequence = suite::generate_sequence(steps, &args.out, args.gzip, &bar).map_err(unmade)?;
    bar.finish_and_clear();
    if !json.as_ref().is_some_and(Output::is_stdout) {
        let bytes = entries.iter().filter_map(|e| number_of(e, "bytes"));
        files::print(&matrix::suite_table(&entries))?;
        files::print(&format!(
            "sequence {}: {steps} systems, {:.1} MB\n",
            suite::SEQUENCE,
            sequence as f64 / 1e6
        ))?;
        console.note(&format!(
            "\n{} systems, {:.1} MB, listed in {}",
            entries.len(),
            bytes.sum::<f64>() / 1e6,
            args.out.join("index.csv").display()
        ))?;
    }
    if let Some(json) = json {
        json.json(&entries)?;
    }
    Ok(())
}
