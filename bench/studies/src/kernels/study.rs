//! The study of single solves: its options, settings and plots.

use super::table::SHEETS;
use super::{Config, Rival};
use crate::cases::Cases;
use crate::options::{Quick, Ratios, Segments};
use crate::study::{self, Found, Study, data, tables};
use clap::{Args, FromArgMatches};
use taut_output::check::ExperimentError;
use taut_output::plan::{PLAIN, PRECISION, Plan, error, positive};
use taut_output::settings::{Setting, counts, list, numbers, seconds, set, step};
use taut_output::table::{MARK, omissions};

/// `taut study kernels`.
pub(crate) const STUDY: Study = Study {
    name: "kernels",
    title: "factorisation and solve alone",
    about: "Factorisation and solve, ns per joint: ours beside every other on the same matrices in the same run",
    examples: &["--backends banded,faer:llt"],
    mark: ("records", "joint_rows"),
    options: Options::augment_args,
    run: |matches, reporter| run(&Options::from_arg_matches(matches)?, reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

#[derive(Debug, Args)]
struct Options {
    #[command(flatten)]
    segments: Segments,
    #[command(flatten)]
    ratios: Ratios,
    /// Solvers: a backend with options after colons, `/kkt` for the KKT form; NAME+refine, NAME+many, lapack:lower, lapack:upper
    #[arg(long, value_delimiter = ',', value_name = "B")]
    backends: Vec<String>,
    #[command(flatten)]
    quick: Quick,
}

const LEGEND: &str = "\
ns/joint: factorisation and solve of the assembled system, least of the samples; median ns: of the samples; × banded:
over banded's of the same table; normwise, compon.: backward errors on the system solved, the latter of its worst row;
error: relative error of the multipliers against the KKT system in extended precision. All take turns on the same
matrices. +refine: with one refinement from the pieces, by the step's clock; umfpack: with its own refinement, its
default; +many: 8 right-hand sides a factorisation, each; lapack: dpbtrf and dpbtrs, without filling the band";

fn run(options: &Options, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = options.quick.of(Config::quick);
    options.segments.replace(&mut config.segments);
    options.ratios.replace(&mut config.ratios)?;
    if !options.backends.is_empty() {
        config.rivals.clear();
        for name in &options.backends {
            let rival: Rival = name.parse()?;
            rival.check()?;
            if !config.rivals.contains(&rival) {
                config.rivals.push(rival);
            }
        }
    }
    let results = super::run(&config, cases)?;
    let rows = data(&results)?;
    let text = format!(
        "hoist: hanging at an angle, Δt = 1/60 s, one thread\n{LEGEND}\n{MARK}\n{}{}",
        tables(SHEETS, &rows),
        omissions(&results.omissions)
    );
    Ok(Found {
        settings: settings(&config),
        text,
        rows,
        omissions: results.omissions,
        ..Found::default()
    })
}

fn settings(config: &Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        (
            "rows of a joint",
            list(&config.joints, |joint| joint.rows().to_string()),
        ),
        ("solvers", list(&config.rivals, ToString::to_string)),
        ("time of each", seconds(config.share.as_secs_f64())),
        ("Δt", step(1.0 / 60.0)),
        ("threads", "1".to_owned()),
    ])
}

const PLOTS: &[Plan] = &[
    Plan {
        id: PRECISION,
        title: "Work against precision",
        text: "Factorisation and solve of one system. Lower left is better.",
        list: "records",
        panels: &["joint_rows", "mass_ratio", "segments"],
        series: &["solver"],
        x: error(&["forward_error"], "relative error of the multipliers (1)"),
        y: positive(
            &["ns_per_joint"],
            "factorise and solve, per joint (ns)",
            1.0,
        ),
        ..PLAIN
    },
    Plan {
        id: "sizes",
        title: "Time against elements",
        text: "A level line is a cost in proportion to the cable's elements.",
        list: "records",
        panels: &["joint_rows", "mass_ratio"],
        series: &["solver"],
        x: positive(&["segments"], "segments (1)", 1.0),
        y: positive(
            &["ns_per_joint"],
            "factorise and solve, per joint (ns)",
            1.0,
        ),
        ..PLAIN
    },
];
