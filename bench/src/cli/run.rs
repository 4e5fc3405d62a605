//! `taut run`: simulates a scene, or goes on with a run that was saved.

use super::console::Console;
use super::signals::{self, signals};
use super::{Failure, StepArgs, step_options};
use crate::run::{self, ReferenceValues, Requests, Summary};
use crate::run_file::RunFile;
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use taut_integrator::{Sleep, StepOptions, Stepper};
use taut_measure::columns::Columns;
use taut_measure::files::{self, FileError, Output, Writing};
use taut_measure::inputs::Inputs;
use taut_measure::source;
use taut_measure::trajectory::{self, Sample};
use taut_recording::Recorder;
use taut_studies::options::{number, overrides, require_positive, steps};

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
    /// Lets the scene sleep while it rests: no step then costs a solve, and nothing is farther than this from where it would
    /// be awake, in oscillations of up to a minute (mm; without a number 1)
    #[arg(long, value_name = "MM", num_args = 0..=1, require_equals = true, default_missing_value = "1", value_parser = number, allow_negative_numbers = true)]
    sleep: Option<f64>,
    /// Simulated time (s); of a resumed run that from its state on
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = number, allow_negative_numbers = true)]
    time: f64,
    /// What the operator does: a CSV file with the columns `time` (s) and names of the scene's controls; linear in
    /// between, the first and the last row hold outside
    #[arg(long, value_name = "FILE.csv")]
    controls: Option<PathBuf>,
    /// Estimates the error of the load's position, by a coarse run of steps so many times as long: off, or 2 and more; 2 adds
    /// about half of the time
    #[arg(
        long,
        value_name = "K",
        default_value = "2",
        allow_hyphen_values = true
    )]
    estimate: String,
    /// Largest estimate of that error (mm): the run starts anew with twice the sub-steps until it keeps it
    #[arg(long, value_name = "MM", value_parser = number, allow_negative_numbers = true, conflicts_with = "resume")]
    error: Option<f64>,
    /// Writes one line a step to a CSV file
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// Columns of `--out`, and `columns` of `--json`: NAME.QUANTITY of a body (x y z vx vy vz speed wx wy wz, and
    /// of the force of its contacts the norm, contact, and contact_x contact_y contact_z), of a joint (tension fx fy fz force bending twist drive gap, and of the torque of what holds an angle the norm, moment, and mx my mz), of a massless cable or of its part `NAME-2`, `NAME-3` … beyond a sheave with friction (tension drive length path, and slip of a part over the sheave that it begins at);
    /// CABLE.tension, CABLE.SEGMENT.tension of a cable of segments, from 0; the name of a control; of the run: time
    /// load_x load_y load_z kinetic gravity elastic max_gap iterations step load_tension events contacts sliding groups error
    /// (mm) asleep
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    columns: Vec<String>,
    /// Writes the summary and the path of the load to a file (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
    /// Saves the run, to be resumed with the same bits (by the same program and `TAUT_SIMD`): at the end, after the last whole
    /// step where a signal ends it
    #[arg(long, value_name = "FILE.json")]
    save: Option<PathBuf>,
    /// Time of the state that is saved (s; default: the end)
    #[arg(long, value_name = "S", requires = "save", value_parser = number, allow_negative_numbers = true)]
    save_at: Option<f64>,
    /// Records what moves, what it carries and touches, events and step times, at most 60 times a simulated second, for
    /// `taut replay`; up to where a disk is full. A run that is killed leaves `.FILE.taut-PID-N.part` beside it, which `taut
    /// replay` reads and the next whole FILE removes
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Goes on with a saved run: its scene, solver and time step
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["scene", "overrides", "StepArgs", "estimate", "sleep"])]
    resume: Option<PathBuf>,
    /// Goes on with a run that was driven without its table: the controls keep their last values
    #[arg(long, requires = "resume", conflicts_with_all = ["scene", "controls"])]
    hold_controls: bool,
}

/// A run to be made.
struct Prepared {
    stepper: Stepper,
    yardstick: ReferenceValues,
    inputs: Inputs,
    /// Names of the controls that are driven, or were.
    driven: Vec<String>,
}

/// Steps of the coarse run that `--estimate` asks for: off, or 2 and more.
pub(super) fn every(text: &str) -> Result<Option<usize>, Failure> {
    match text {
        "off" => Ok(None),
        text => text
            .parse()
            .map(Some)
            .map_err(|_| Failure::Input(format!("`--estimate` is `{text}`: give off, 2 or more"))),
    }
}

/// Checks `--estimate` against `--error`. Returns the coarse run's step in steps of the run;
/// `None` disables the estimate.
fn estimate(args: &RunArgs) -> Result<Option<usize>, Failure> {
    let every = every(&args.estimate)?;
    match (every, args.error) {
        (None, Some(_)) => Err(Failure::Input(
            "`--error` needs the estimate that `--estimate off` turns off: leave one of them out"
                .to_owned(),
        )),
        (every, _) => Ok(every),
    }
}

fn prepared(args: &RunArgs, console: Console) -> Result<Prepared, Failure> {
    let inputs = |scene| source::inputs(args.controls.as_deref(), scene).map_err(Failure::of);
    if let Some(path) = &args.resume {
        let (stepper, yardstick, mut driven) = RunFile::resume(path).map_err(Failure::Input)?;
        if args.controls.is_none() && !args.hold_controls && !driven.is_empty() {
            return Err(Failure::Input(format!(
                "`{}` was driven by a table of {}: give one with `--controls`, or `--hold-controls` to go on at the last \
                 values",
                path.display(),
                driven.join(", ")
            )));
        }
        let inputs = inputs(stepper.scene())?;
        driven.extend_from_slice(inputs.names());
        driven.sort_unstable();
        driven.dedup();
        return Ok(Prepared {
            stepper,
            yardstick,
            inputs,
            driven,
        });
    }
    let name = args.scene.as_deref().unwrap_or_default();
    let built = source::built(name, &overrides(&args.overrides)?);
    let prepared = run::prepare(built.map_err(Failure::of)?);
    let inputs = inputs(&prepared.scene)?;
    let driven = inputs.names().to_vec();
    let options = StepOptions {
        energy_tolerance: Some(trajectory::ENERGY_TOLERANCE),
        estimate: estimate(args)?,
        sleep: args.sleep.map(|distance| Sleep {
            distance: 1e-3 * distance,
            ..Sleep::default()
        }),
        ..step_options(&args.step)?
    };
    let count = at_least_one_step(args.time, options.dt)?;
    let options = match args.error {
        None => options,
        Some(error) => {
            require_positive("`--error`", &[error])?;
            let bar = console.progress(count as u64).with_message("sub-steps");
            let run = (&prepared.scene, &options);
            let found = run::substeps_within(1e-3 * error, run, &inputs, count, &bar);
            bar.finish_and_clear();
            found.map_err(Failure::Unstable)?
        }
    };
    Ok(Prepared {
        stepper: Stepper::new(prepared.scene, options)?,
        yardstick: prepared.yardstick,
        inputs,
        driven,
    })
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

/// The columns that are asked for, if there are.
fn columns(args: &RunArgs, stepper: &Stepper) -> Result<Option<Columns>, Failure> {
    if args.columns.is_empty() {
        return Ok(None);
    }
    if args.out.is_none() && args.json.is_none() {
        let message = "`--columns` says what `--out` and `--json` write: give one of them";
        return Err(Failure::Input(message.to_owned()));
    }
    Ok(Some(Columns::find(&args.columns, stepper)?))
}

/// Where results go.
struct Outputs {
    out: Option<Output>,
    json: Option<Output>,
    save: Option<Output>,
    record: Option<Output>,
}

impl Outputs {
    fn open(args: &RunArgs) -> Result<Self, FileError> {
        let scene = args.scene.as_deref().filter(|scene| source::is_file(scene));
        let mut read: Vec<&Path> = scene.map(Path::new).into_iter().collect();
        read.extend(args.controls.as_deref());
        // A run that goes on may take its own place.
        let place = |path: &Option<PathBuf>| path.as_ref().and_then(|p| p.canonicalize().ok());
        if place(&args.resume) != place(&args.save) {
            read.extend(args.resume.as_deref());
        }
        let [out, json, save, record] = files::open(
            [
                ("--out", args.out.as_deref()),
                ("--json", args.json.as_deref()),
                ("--save", args.save.as_deref()),
                ("--record", args.record.as_deref()),
            ],
            &read,
        )?;
        Ok(Self {
            out,
            json,
            save,
            record,
        })
    }

    fn is_any_stdout(&self) -> bool {
        let all = [&self.out, &self.json, &self.save, &self.record];
        all.into_iter().flatten().any(Output::is_stdout)
    }
}

/// The number of steps in a time \[s], which is not much shorter than one: steps are counted to the nearest.
fn at_least_one_step(time: f64, dt: f64) -> Result<usize, Failure> {
    const NEARLY: f64 = 0.99;
    match steps(time, dt)? {
        count if count == 0 || time < NEARLY * dt => Err(Failure::Input(format!(
            "`--time` is {time} s: it must be at least one step of {dt} s"
        ))),
        count => Ok(count),
    }
}

fn write_heading(rows: &mut Writing, columns: Option<&Columns>) {
    rows.add(|out| match columns {
        Some(columns) => columns.heading(out),
        None => out.write_all(run::CSV_HEADING.as_bytes()),
    });
}

fn write_line(rows: &mut Writing, columns: Option<&Columns>, stepper: &Stepper, sample: &Sample) {
    rows.add(|out| match columns {
        Some(columns) => columns.line(out, stepper, sample),
        None => run::csv_line(out, sample),
    });
}

/// A recording that is being written, if one is.
struct Tape(Option<(Writing, Option<Recorder>)>);

impl Tape {
    fn begin(to: Option<&Output>, stepper: &Stepper, steps: usize) -> Result<Self, FileError> {
        let Some(mut to) = to.map(Output::begin).transpose()? else {
            return Ok(Self(None));
        };
        let mut recorder = None;
        to.add(|out| {
            recorder = Some(Recorder::begin(out, stepper, steps)?);
            Ok(())
        });
        Ok(Self(Some((to, recorder))))
    }

    fn step(&mut self, stepper: &Stepper, sample: &Sample) {
        if let Some((to, Some(recorder))) = &mut self.0 {
            to.add(|out| recorder.step(out, stepper, sample));
        }
    }

    fn end(self, time: f64, summary: &Summary) -> Result<(), FileError> {
        let Some((mut to, recorder)) = self.0 else {
            return Ok(());
        };
        let failure = summary.failure.as_ref().map(|f| f.reason.clone());
        let stopped = || summary.stopped.map(|why| format!("stopped by {why}"));
        if let Some(recorder) = recorder {
            to.add(|out| recorder.end(out, time, failure.or_else(stopped)));
        }
        to.keep()
    }
}

/// Runs, and writes what is asked for: what cannot be written costs nothing else.
pub(crate) fn run(args: &RunArgs, console: Console) -> Result<(), Failure> {
    let outputs = Outputs::open(args)?;
    let Prepared {
        mut stepper,
        yardstick,
        inputs,
        driven,
    } = prepared(args, console)?;
    let dt = stepper.options().dt;
    let count = at_least_one_step(args.time, dt)?;
    let save_at = save_at(args, stepper.time())?;
    let columns = columns(args, &stepper)?;
    let notes = stepper.scene().notes();
    notes.iter().for_each(|note| console.doubt(note));
    let mut rows = outputs.out.as_ref().map(Output::begin).transpose()?;
    if let Some(rows) = &mut rows {
        write_heading(rows, columns.as_ref());
    }
    let mut tape = Tape::begin(outputs.record.as_ref(), &stepper, count)?;
    let signals = signals()?;
    stepper.stop_by(Arc::clone(&signals.asked));
    let bar = console
        .progress(count as u64)
        .with_message(files::line(&stepper.scene().name));
    let mut written = Vec::new();
    let mut requests = Requests {
        save_at,
        save: &mut |run| {
            let file = RunFile::new(run, yardstick, driven.clone());
            written.extend(outputs.save.as_ref().map(|save| file.write(save)));
        },
        path: outputs.json.is_some(),
        columns: columns.as_ref().filter(|_| outputs.json.is_some()),
        sample: &mut |stepper, sample| {
            if let Some(rows) = &mut rows {
                write_line(rows, columns.as_ref(), stepper, sample);
            }
            tape.step(stepper, sample);
        },
        stop: &|| signals::name(signals.last()),
    };
    let summary = run::run(
        &mut stepper,
        &yardstick,
        &inputs,
        count,
        &mut requests,
        &bar,
    );
    bar.finish_and_clear();
    written.extend(rows.map(Writing::finish));
    written.push(tape.end(stepper.time(), &summary));
    if !outputs.is_any_stdout() {
        written.push(files::print(&run::text(&summary)));
    }
    written.extend(outputs.json.map(|json| json.json(&summary)));
    let failed = written.into_iter().filter_map(Result::err);
    ended(&summary, count, signals.last(), failed.collect())
}

/// How a run ended, and what of it could not be written.
fn ended(
    summary: &Summary,
    count: usize,
    signal: usize,
    unwritten: Vec<FileError>,
) -> Result<(), Failure> {
    let mut failures: Vec<Failure> = unwritten.into_iter().map(Failure::from).collect();
    if let Some(failure) = &summary.failure {
        failures.push(Failure::Unstable(failure.to_string()));
    }
    if let Some(why) = summary.stopped {
        let steps = summary.steps;
        let message = format!(
            "stopped by {why} after {steps} of {count} steps: what was asked for is written up to there"
        );
        failures.push(Failure::Stopped(message, signal));
    }
    let mut failures = failures.into_iter();
    let first = failures.next();
    failures.for_each(|other| other.print());
    first.map_or(Ok(()), Err)
}
