//! The study of the choice of a solver: its options and tables.

use super::{Config, FITTED, Fitted, RATIO, Record, STEPS, fit};
use crate::cases::Cases;
use crate::options::Quick;
use crate::study::{self, Found, Study, data, tables};
use clap::{Args, FromArgMatches};
use taut_output::check::ExperimentError;
use taut_output::row::{Row, is};
use taut_output::settings::{Setting, seconds, set, solvers, step};
use taut_output::sheet::{self, Sheet, Show, column};

/// `taut study auto`.
pub(crate) const STUDY: Study = Study {
    name: "auto",
    title: "the solver that `auto` chooses",
    about: "The solver that `auto` chooses against every other one; how it is predicted",
    examples: &["--quick", "--fit"],
    mark: ("", "analysis_steps"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    /// Scenes, each a name with overrides KEY=VALUE after blanks, in place of its own
    #[arg(long = "scene", value_name = "SCENE")]
    scenes: Vec<String>,
    /// Fits the times that the choice is predicted from, on scenes of their own, in place of judging it
    #[arg(long, conflicts_with = "quick")]
    fit: bool,
    #[command(flatten)]
    quick: Quick,
}

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    if options.fit {
        config.scenes = FITTED.map(str::to_owned).to_vec();
    }
    if !options.scenes.is_empty() {
        config.scenes.clone_from(&options.scenes);
    }
    if options.fit {
        let fit = fit(&config.scenes, config.dt, cases)?;
        return Ok(Found {
            text: fit.ways.iter().map(line).collect(),
            rows: data(&fit)?,
            ..Found::default()
        });
    }
    let records = super::run(&config, cases)?;
    let rows = data(&records)?;
    Ok(Found {
        settings: settings(&config),
        text: format!("{LEGEND}\n{}\n{}", tables(SHEETS, &rows), reasons(&records)),
        missed: missed(&records),
        rows,
        ..Found::default()
    })
}

/// The times of a way, as the solver's table has them.
fn line(fitted: &Fitted) -> String {
    let times: Vec<String> = fitted.times.iter().map(|t| format!("{t:9.3}")).collect();
    let [rms, largest] = fitted.errors.map(|e| 100.0 * e);
    format!(
        "{:>10} [{}] ns; {} scenes, error {rms:.0} %, at most {largest:.0} %\n",
        fitted.way,
        times.join(", "),
        fitted.scenes
    )
}

fn reasons(records: &[Record]) -> String {
    let line = |r: &Record| format!("{}: {}: {}\n", r.scene, r.chosen, r.reason);
    records.iter().map(line).collect()
}

/// The scenes that miss a bar.
fn missed(records: &[Record]) -> Option<String> {
    let missed = records.iter().filter(|r| !r.within_bar);
    let scenes: Vec<&str> = missed.map(|r| r.scene.as_str()).collect();
    (!scenes.is_empty()).then(|| {
        format!(
            "`auto` takes more than {RATIO} times as long as the fastest solver, or {STEPS} steps to choose, in {}",
            scenes.join("; ")
        )
    })
}

fn settings(config: &Config) -> Vec<Setting> {
    set([
        ("scenes", config.scenes.len().to_string()),
        ("solvers", solvers(&config.choices)),
        ("rounds", config.rounds.to_string()),
        ("round", seconds(config.round.as_secs_f64())),
        ("Δt", step(config.dt)),
    ])
}

const SHEETS: &[Sheet] = &[Sheet {
    columns: &[
        column("scene", "scene"),
        column("rows", "rows"),
        column("chosen", "chosen"),
        column("step_ns", "step").shown(Show::Time),
        column("best", "fastest other"),
        column("best_ns", "step").shown(Show::Time),
        column("ratio", "ratio").shown(Show::Fixed(2)),
        column("analysis_steps", "analysis").shown(Show::Fixed(2)),
        column("within_bar", "bar").shown(Show::Row(mark)),
    ],
    ..sheet::PLAIN
}];

fn mark(row: &Row) -> String {
    let kept = is(row, "within_bar");
    if kept { "" } else { "MISSED" }.to_owned()
}

const LEGEND: &str = "\
step: median time of a whole step with `auto`, and with the fastest other solver; ratio: median of the ratios of both in
the same round; analysis: least time of choosing, in steps; bar: where either is missed";
