//! `taut run`: simulates a scene, or goes on with a run that was saved.

use super::console::Console;
use crate::{Failure, StepArgs, number, overrides, step_options, steps};
use clap::Args;
use std::path::{Path, PathBuf};
use taut_bench::inputs::Inputs;
use taut_bench::output;
use taut_bench::run::{self, Yardstick};
use taut_bench::run_file::RunFile;
use taut_integrator::Stepper;

#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// Name of a scene, or a TOML file
    #[arg(required_unless_present = "resume")]
    scene: Option<String>,
    /// Overrides a parameter of the scene
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    #[command(flatten)]
    step: StepArgs,
    /// Simulated time (s); of a resumed run that from its state on
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = number, allow_negative_numbers = true)]
    time: f64,
    /// What the operator does: a CSV file with the columns `time` (s) and names of the scene's controls; linear in
    /// between, the first and the last row hold outside
    #[arg(long, value_name = "FILE.csv")]
    controls: Option<PathBuf>,
    /// Writes one line a step to a CSV file
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Writes the summary to a file (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
    /// Saves the run, to be resumed with the same bits
    #[arg(long, value_name = "FILE.json")]
    save: Option<PathBuf>,
    /// Time of the state that is saved (s; default: the end)
    #[arg(long, value_name = "S", requires = "save", value_parser = number, allow_negative_numbers = true)]
    save_at: Option<f64>,
    /// Goes on with a saved run: its scene, solver and time step
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["scene", "overrides", "StepArgs"])]
    resume: Option<PathBuf>,
}

/// The stepper, what its run is judged by, and what drives it.
fn prepared(args: &RunArgs) -> Result<(Stepper, Yardstick, Inputs), Failure> {
    let inputs = |scene| match &args.controls {
        None => Ok(Inputs::default()),
        Some(path) => run::inputs(path, scene),
    };
    if let Some(path) = &args.resume {
        let (stepper, yardstick) = RunFile::resume(path)?;
        let inputs = inputs(stepper.scene())?;
        return Ok((stepper, yardstick, inputs));
    }
    let name = args.scene.as_deref().unwrap_or_default();
    let prepared = run::prepare(name, &overrides(&args.overrides)?)?;
    let inputs = inputs(&prepared.scene)?;
    let options = step_options(&args.step)?;
    steps(args.time, options.dt)?;
    let stepper = Stepper::new(prepared.scene, options)?;
    Ok((stepper, prepared.yardstick, inputs))
}

/// The time at which the run is to be saved, if it is, which must be one that it passes.
fn save_at(args: &RunArgs, start: f64) -> Result<Option<f64>, Failure> {
    let end = start + args.time;
    let at = args.save_at.unwrap_or(end);
    if !(at >= start && at <= end) {
        return Err(Failure::Input(format!(
            "`--save-at` is {at} s: it must be from {start} s to {end} s, which is what the run takes"
        )));
    }
    Ok(args.save.as_ref().map(|_| at))
}

/// Runs, and writes what is asked for.
pub(crate) fn run(args: &RunArgs, console: Console) -> Result<(), Failure> {
    let given = [&args.out, &args.json, &args.save];
    let to_stdout = |path: &Option<PathBuf>| path.as_deref() == Some(Path::new("-"));
    if given.iter().filter(|path| to_stdout(path)).count() > 1 {
        return Err(Failure::Input(
            "`--out -`, `--json -` and `--save -` cannot share standard output: give all but one a file".to_owned(),
        ));
    }
    let (mut stepper, yardstick, inputs) = prepared(args)?;
    let dt = stepper.options().dt;
    let count = steps(args.time, dt)?;
    if count == 0 {
        return Err(Failure::Input(format!(
            "`--time` is {} s: it must be at least one step of {dt} s",
            args.time
        )));
    }
    let save_at = save_at(args, stepper.time())?;
    let bar = console
        .progress(count as u64)
        .with_message(stepper.scene().name.clone());
    let (summary, trajectory, saved) =
        run::run(&mut stepper, &yardstick, &inputs, args.time, save_at, &bar);
    bar.finish_and_clear();
    if let (Some(path), Some(run)) = (&args.save, saved) {
        RunFile { run, yardstick }.write(path)?;
    }
    if let Some(path) = &args.out {
        output::write_text(path, &run::csv(&trajectory))?;
    }
    if !given.iter().any(|path| to_stdout(path)) {
        output::print(&run::text(&summary))?;
    }
    if let Some(path) = &args.json {
        output::write_json(path, &summary)?;
    }
    match summary.failure {
        None => Ok(()),
        Some(f) => Err(Failure::Unstable(format!(
            "unstable at t = {:.4} s: {}",
            f.time, f.reason
        ))),
    }
}
