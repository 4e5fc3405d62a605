//! `taut dump`, `taut solve`, `taut matrices`: linear systems as files.

use super::console::Console;
use super::{Failure, StepArgs, step_options};
use crate::machine::Machine;
use crate::run;
use clap::Args;
use std::path::{Path, PathBuf};
use taut_ground::files::{self, Output};
use taut_ground::inputs::Inputs;
use taut_ground::matrix::System;
use taut_ground::matrix::dump::{self, Label};
use taut_ground::pace;
use taut_integrator::Stepper;
use taut_output::table::MARK;
use taut_studies::matrix::{self, suite};
use taut_studies::options::overrides;

/// Most steps before a dump.
const MOST_STEPS: u64 = 10_000_000;

#[derive(Debug, Args)]
pub(crate) struct DumpArgs {
    /// Name of a scene, or a TOML file
    scene: String,
    /// Overrides a parameter of the scene
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    step: StepArgs,
    /// What the operator does: a CSV file as for `taut run`
    #[arg(long, value_name = "FILE.csv")]
    controls: Option<PathBuf>,
    /// Steps made before the one whose system is written: 0 for the first
    #[arg(long = "step", value_name = "K")]
    at: u64,
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

/// What the columns of `taut solve` are.
const SOLVE_LEGEND: &str = "\
times: minima of repeats; normwise, compon.: backward errors, |r|/(|A||x|+|b|) in the largest norm and row by row;
error: relative error of x in the largest norm";

/// Writes the system of a step.
pub(crate) fn dump(args: &DumpArgs, console: Console) -> Result<(), Failure> {
    let prepared = run::prepare(&args.scene, &overrides(&args.overrides)?)?;
    let inputs = match &args.controls {
        None => Inputs::default(),
        Some(path) => run::inputs(path, &prepared.scene)?,
    };
    if args.at > MOST_STEPS {
        return Err(Failure::Input(format!(
            "`--step` is {}: at most {MOST_STEPS}",
            args.at
        )));
    }
    let name = match &args.name {
        Some(name) if name.is_empty() || name.contains(['/', '\\']) => {
            return Err(Failure::Input(format!(
                "`--name {name}` is no name of a file in `--out`"
            )));
        }
        Some(name) => name.clone(),
        None => {
            let stem = Path::new(&args.scene).file_stem().unwrap_or_default();
            format!("{}_{}", stem.to_string_lossy(), args.at)
        }
    };
    let options = step_options(&args.step)?;
    let label = Label {
        name,
        comments: comments(args, &prepared.scene),
    };
    files::make_folder(&args.out)?;
    let mut stepper = Stepper::new(prepared.scene, options)?;
    let bar = console.progress(args.at).with_message("dump");
    for _ in 0..args.at {
        inputs.apply(&mut stepper)?;
        let stepped = pace::step(&mut stepper);
        stepped.map_err(|e| Failure::Unstable(e.to_string()))?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    inputs.apply(&mut stepper)?;
    for system in dump::systems(&mut stepper)? {
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

/// Scene, step, masses and options, as comments.
fn comments(args: &DumpArgs, scene: &taut_model::Scene) -> Vec<String> {
    let bodies = &scene.bodies;
    let masses = || scene.dynamic_bodies().map(|i| bodies.mass[i]);
    let (least, most) = (
        masses().fold(f64::INFINITY, f64::min),
        masses().fold(0.0, f64::max),
    );
    let set = args.overrides.join(" ");
    vec![
        format!("scene {} {set}", args.scene).trim_end().to_owned(),
        format!("step {0}: the system of the step after {0} others", args.at),
        format!(
            "time step {:e} s, scheme {}, {} sub-steps",
            args.step.dt, args.step.scheme, args.step.substeps
        ),
        format!("mass ratio {:e}: heaviest over lightest body", most / least),
    ]
}

/// Solves one system with the backends asked for.
pub(crate) fn solve(args: &SolveArgs) -> Result<(), Failure> {
    let given = [
        Some(args.matrix.as_path()),
        args.b.as_deref(),
        args.x.as_deref(),
    ];
    let read: Vec<&Path> = given.into_iter().flatten().collect();
    let [json] = files::open([("--json", args.json.as_deref())], &read)?;
    let system = System::read(&args.matrix, args.b.as_deref(), args.x.as_deref())?;
    let results = matrix::backends(&args.backends)
        .and_then(|config| matrix::measured(&system, &config))
        .map_err(|e| Failure::Input(e.to_string()))?;
    if !json.as_ref().is_some_and(Output::is_stdout) {
        let text = matrix::solved(&results);
        files::print(&format!(
            "{}\n{SOLVE_LEGEND}\n{MARK}\n{text}",
            Machine::current()
        ))?;
    }
    if let Some(json) = json {
        json.json(&results)?;
    }
    Ok(())
}

/// Writes the graded set.
pub(crate) fn matrices(args: &MatricesArgs, console: Console) -> Result<(), Failure> {
    files::make_folder(&args.out)?;
    let [json] = files::open([("--json", args.json.as_deref())], &[])?;
    let bar = console.progress(0).with_message("matrices");
    let entries = suite::generate(&suite::cases(args.quick), &args.out, args.gzip, &bar)?;
    bar.finish_and_clear();
    if !json.as_ref().is_some_and(Output::is_stdout) {
        let bytes: u64 = entries.iter().map(|e| e.bytes).sum();
        files::print(&matrix::suite_table(&entries))?;
        console.note(&format!(
            "\n{} systems, {:.1} MB, listed in {}",
            entries.len(),
            bytes as f64 / 1e6,
            args.out.join("index.csv").display()
        ))?;
    }
    if let Some(json) = json {
        json.json(&entries)?;
    }
    Ok(())
}
