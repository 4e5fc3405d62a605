//! `taut ledger`: what a scene may do without.

use super::console::Console;
use super::{Failure, SceneArgs, StepArgs, step_options};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use taut_measure::files::{self, read_text};
use taut_measure::source;
use taut_output::table;
use taut_studies::ledger::{Ledger, Line, Question, Setup, change::flags, ledger, modes};
use taut_studies::options::{number, require_positive, steps};

/// Most steps of a run.
const MOST_STEPS: usize = 100_000;

#[derive(Debug, Args)]
pub(crate) struct LedgerArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    step: StepArgs,
    /// Largest error of the load that the lean scene may have (mm)
    #[arg(long, value_name = "MM", default_value_t = 1.0, value_parser = number, allow_negative_numbers = true)]
    tolerance: f64,
    /// Simulated time (s)
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = number, allow_negative_numbers = true)]
    time: f64,
    /// What the operator does, as in `taut run`
    #[arg(long, value_name = "FILE.csv")]
    controls: Option<PathBuf>,
    /// Writes the lean scene
    #[arg(long, value_name = "FILE.toml")]
    apply: Option<PathBuf>,
    /// Writes all lines to a file (`-` for standard output, which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
}

pub(crate) fn run(args: &LedgerArgs, console: Console) -> Result<(), Failure> {
    require_positive("`--tolerance`", &[args.tolerance])?;
    let options = step_options(&args.step)?;
    let count = steps(args.time, options.dt)?;
    if !(2..=MOST_STEPS).contains(&count) {
        return Err(Failure::Input(format!(
            "`--time` is {} s, {count} steps: the ledger keeps each of them, so it must be from 2 to {MOST_STEPS}",
            args.time
        )));
    }
    let mut read: Vec<&Path> = args.controls.as_deref().into_iter().collect();
    let scene = &args.scene.scene;
    read.extend(source::is_file(scene).then(|| Path::new(scene)));
    let [apply, json] = files::open(
        [
            ("--apply", args.apply.as_deref()),
            ("--json", args.json.as_deref()),
        ],
        &read,
    )?;
    let (whole, scene) = args.scene.built()?;
    source::inputs(args.controls.as_deref(), &scene).map_err(Failure::of)?;
    let question = Question {
        whole: Setup {
            source: whole,
            options,
        },
        controls: args.controls.as_deref().map(read_text).transpose()?,
        tolerance: 1e-3 * args.tolerance,
        time: args.time,
    };
    let bar = console.progress(1).with_message("ledger");
    let found = ledger(&question, &bar);
    bar.finish_and_clear();
    let found = found.map_err(|e| Failure::Unstable(e.to_string()))?;
    let command = command(args, &found.setup);
    let is_stdout = |output: &files::Output| output.is_stdout();
    if ![&apply, &json].into_iter().flatten().any(is_stdout) {
        files::print(&text(&found, args, &command))?;
    }
    if let Some(json) = json {
        json.json(&Written {
            tolerance_mm: args.tolerance,
            time_s: args.time,
            command: &command,
            ledger: &found,
        })?;
    }
    if let (Some(apply), true) = (&apply, found.whole.keeps) {
        let text = found.setup.source.to_commented_toml()?;
        apply.text(&format!("# {command}\n{text}"))?;
    }
    if found.whole.keeps {
        return Ok(());
    }
    Err(Failure::Check(format!(
        "the whole scene is {:.2e} mm off the finest, beyond the tolerance of {:e} mm: take more sub-steps or segments, or a \
         larger `--tolerance`",
        found.whole.error_mm.unwrap_or(f64::NAN),
        args.tolerance
    )))
}

/// Content of `--json`.
#[derive(Debug, Serialize)]
struct Written<'a> {
    tolerance_mm: f64,
    time_s: f64,
    /// How the lean scene is run.
    command: &'a str,
    #[serde(flatten)]
    ledger: &'a Ledger,
}

/// How the lean scene is run.
fn command(args: &LedgerArgs, setup: &Setup) -> String {
    let file = args.apply.as_deref().unwrap_or(Path::new("LEAN.toml"));
    let mut command = format!("taut run {} --time {}", file.display(), args.time);
    if let Some(controls) = &args.controls {
        command.push_str(&format!(" --controls {}", controls.display()));
    }
    let flags = flags(&setup.options);
    if !flags.is_empty() {
        command.push(' ');
        command.push_str(&flags);
    }
    command
}

/// The ledger for people.
fn text(found: &Ledger, args: &LedgerArgs, command: &str) -> String {
    let mut out = lines(found);
    out.push_str(LEGEND);
    out.push_str(&modes_of(found));
    out.push('\n');
    out.push_str(&conclusion(found, args, command));
    out
}

const LEGEND: &str = "
saves: of the time of a step, ± the spread of the ratios. error: of any point of the load, from the finest; moves: from the
whole. tension: rms error over the largest. energy: change beyond the work of drives, over the motion's own.
keeps: yes, within the tolerance; idle, so too, but the motion did not need it.

";

fn lines(found: &Ledger) -> String {
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.1e}"));
    let of_run = |line: &Line, text: String| {
        if line.failure.is_some() {
            "-".into()
        } else {
            text
        }
    };
    let error = |line: &Line| match (&line.failure, line.undecided) {
        (Some(_), _) => "lost".to_owned(),
        (None, 0) => number(line.error_mm),
        (None, steps) => format!("{}, {steps} undecided", number(line.error_mm)),
    };
    let keeps = |line: &Line| match (line.keeps, line.used) {
        (false, _) => "no",
        (true, false) => "idle",
        (true, true) => "yes",
    };
    let ends = found.finest.iter().chain([&found.whole]);
    let all = ends.chain(&found.lines).chain([&found.lean]);
    let mut out = table::of_records(
        all,
        &[
            ("", &|line: &Line| line.what.clone()),
            ("rows", &|line| of_run(line, line.rows.to_string())),
            ("step", &|line| {
                of_run(line, table::nanoseconds(line.step_ns))
            }),
            ("saves %", &|line| {
                of_run(
                    line,
                    format!("{:.0} ± {:.0}", 100.0 * line.saves, 100.0 * line.spread),
                )
            }),
            ("error mm", &error),
            ("moves mm", &|line| number(line.apart_mm)),
            ("tension", &|line| number(line.tension)),
            ("energy", &|line| number(line.energy)),
            ("keeps", &|line| keeps(line).into()),
            ("by", &|line| line.how.clone()),
        ],
    );
    for line in &found.lines {
        if let Some(why) = &line.failure {
            out.push_str(&format!("{}: {why}\n", line.what));
        }
    }
    out
}

fn modes_of(found: &Ledger) -> String {
    let rows = match &found.modes {
        Ok(rows) if rows.is_empty() => return "No oscillation about the equilibrium.\n".into(),
        Ok(rows) => rows,
        Err(why) => return format!("No modes: {why}\n"),
    };
    let pair = |[phase, damping]: [f64; 2]| format!("{phase:+.2e} {damping:.2e}");
    let law = |row: &modes::Row| row.predicted.map_or("no law".into(), pair);
    table::of_records(
        rows,
        &[
            ("oscillation", &|row: &modes::Row| {
                format!("{:.4} Hz", row.omega / std::f64::consts::TAU)
            }),
            ("phase error, damping a sub-step: predicted", &law),
            ("measured", &|row| pair(row.measured)),
        ],
    )
}

fn conclusion(found: &Ledger, args: &LedgerArgs, command: &str) -> String {
    if !found.whole.keeps {
        return String::new();
    }
    let tolerance = args.tolerance;
    if found.left_out.is_empty() {
        return format!("Nothing that saves time may go within {tolerance:e} mm.\n");
    }
    let written = if args.apply.is_some() {
        ""
    } else {
        " (`--apply LEAN.toml` writes it)"
    };
    format!(
        "These may go: {}. The lean scene is {:.1e} mm off over {} s, and a step takes {:.0} % of the whole's time{written}:\n  {command}\n",
        found.left_out.join(", "),
        found.lean.error_mm.unwrap_or(f64::NAN),
        args.time,
        100.0 * (1.0 - found.lean.saves),
    )
}
