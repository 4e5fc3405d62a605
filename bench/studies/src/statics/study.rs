//! The study of the hanging cable: its options and what its tables are.

use super::table::SHEETS;
use super::{Config, sweep};
use crate::cases::Cases;
use crate::options::{Refused, choices, count, number, require_positive};
use crate::study::{self, Found, Study, data};
use clap::{Args, FromArgMatches};
use taut_ground::choice::Choice;
use taut_output::check::ExperimentError;
use taut_output::settings::{counts, numbers, set, solvers, step};
use taut_output::table::MARK;

/// `taut static`.
pub(crate) const STUDY: Study = Study {
    name: "static",
    title: "the cable hanging at rest",
    about: "The cable hanging at rest: elongation of every direct solver, iterations that the others need",
    examples: &["--segments 24 --ratios 1,1e3,1e5 --json static.json"],
    writes: "the rows",
    mark: ("settled", "sideways_m"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    /// Numbers of segments
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "24,100",
        value_name = "N",
        value_parser = count,
        allow_negative_numbers = true
    )]
    segments: Vec<usize>,
    /// Mass ratios load/segment
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "1,10,1e2,1e3,1e4,1e5",
        value_name = "R",
        value_parser = number,
        allow_negative_numbers = true
    )]
    ratios: Vec<f64>,
    /// Solvers (default: all but the dense one, whose cost is cubic)
    #[arg(long, value_delimiter = ',', value_name = "B")]
    backends: Vec<String>,
    /// Most iterations tried for the iterative solvers
    #[arg(long, default_value_t = 4096, value_name = "K", value_parser = count, allow_negative_numbers = true)]
    limit: usize,
}

/// Legend of the second table.
const NEEDED_LEGEND: &str = "\
Iterations a step (to 2 % above 64) that hold the hanging cable for half a second within a relative error of its length.
A straight cable is a chain of scalar systems, on which conjugate gradient ends after as many iterations as there are
joints; for a bent, swinging one see `taut bench`.";

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let named = !options.backends.is_empty();
    let fits = |c: &Choice| named || (c.check().is_ok() && c.backend.name() != "dense");
    let choices = choices(&options.backends)?;
    let config = Config {
        segments: options.segments.clone(),
        ratios: options.ratios.clone(),
        choices: choices.into_iter().filter(fits).collect(),
        levels: vec![1e-3, 1e-6, 1e-9],
        limit: options.limit,
        dt: 1.0 / 60.0,
    };
    require_positive("a number of `--ratios`", &config.ratios)?;
    if config.limit == 0 {
        return Err(Refused("`--limit` is 0: it must be at least 1".to_owned()).into());
    }
    let rows = data(&sweep(&config, cases)?)?;
    let [settled, needed] = SHEETS.map(|sheet| sheet.text(&rows));
    Ok(Found {
        settings: set([
            ("segments", counts(&config.segments)),
            ("load/segment", numbers(&config.ratios)),
            ("solvers", solvers(&config.choices)),
            ("most iterations", config.limit.to_string()),
            ("Δt", step(config.dt)),
        ]),
        text: format!(
            "Released unstretched and damped to rest, one refinement: elongation\n{MARK}\n{settled}\n{NEEDED_LEGEND}\n\
             {needed}"
        ),
        rows,
        ..Found::default()
    })
}
