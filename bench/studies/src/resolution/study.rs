//! The study of segments by rule: its options, settings, table and plot.

use super::{Config, FINE};
use crate::cases::Cases;
use crate::options::Quick;
use crate::study::{self, Found, Study, data};
use clap::{Args, FromArgMatches};
use std::fmt::Write;
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, Plan, error, positive};
use taut_output::settings::{seconds, set};
use taut_output::sheet::{self, Sheet, Show, column};

/// `taut study resolution`.
pub(crate) const STUDY: Study = Study {
    name: "resolution",
    title: "segments by rule",
    about: "Cables that merge and split their segments by rule against fixed ones: speed and error",
    examples: &["--quick"],
    mark: ("", "longest_ns"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    #[command(flatten)]
    quick: Quick,
}

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let config = options.quick.of(Config::quick);
    let found = super::run(&config, cases)?;
    let mut text = String::new();
    for (row, gain) in super::gains(&found) {
        let gain = match gain {
            Some(gain) => {
                format!("{gain:.2} × as fast as fixed segments of no larger median error")
            }
            None => "no fixed segments have as small an error".to_owned(),
        };
        let _ = writeln!(text, "{}, {}: {gain}", row.scene, row.cut);
    }
    let rows = data(&found)?;
    Ok(Found {
        settings: set([
            ("cables", config.cables.to_string()),
            ("reference", format!("{FINE} segments")),
            ("simulated", seconds(config.time)),
        ]),
        text: format!("{}\n{text}", study::tables(SHEETS, &rows)),
        rows,
        ..Found::default()
    })
}

const SHEETS: &[Sheet] = &[Sheet {
    columns: &[
        column("scene", "scene"),
        column("cut", "segments of a cable"),
        column("segments", "mean").shown(Show::Fixed(1)),
        column("changes", "changes"),
        column("step_ns", "step").unit("ns"),
        column("longest_ns", "longest").unit("ns"),
        column("error_mm", "error").unit("mm").shown(Show::Error(1)),
        column("worst_mm", "worst cable")
            .unit("mm")
            .shown(Show::Error(1)),
    ],
    ..sheet::PLAIN
}];

const PLOTS: &[Plan] = &[Plan {
    id: "resolution",
    title: "Time of a step against error",
    text: "The median of the cables' errors: further left is faster, further down is better.",
    list: "",
    series: &["scene", "ruled"],
    x: positive(&["step_ns"], "time of a step (µs)", 1e-3),
    y: error(&["error_mm"], "error of the load (mm)"),
    ..PLAIN
}];
