//! The paper's tables, figures and claims, computed: what it prints beside what comes out here (\[SL §III, §VII, §VIII]).
//!
//! Each experiment is a module with a `run`, whole or quick, that makes rows; it ends in an [outcome]: rows of
//! checks, tables for people, rows for programs, charts. The scan of the paper that the figures come from has lost
//! most exponents: where one was inferred, the row says so.
//!
//! [outcome]: taut_output::check::Outcome

pub mod chains;
pub mod claims;
mod pictures;
mod search;
pub mod specimens;
mod study;
pub mod swing;
pub mod table1;
pub mod table2;
pub mod timing;
mod words;

pub(crate) use study::STUDY;

use crate::checks::Experiment;
use indicatif::ProgressBar;
use specimens::{bend, pull, twist};
use taut_output::check::{ExperimentError, Outcome};

/// Acceleration of gravity of the paper \[m/s²], and its Δt \[s].
const GRAVITY: f64 = 10.0;
const DT: f64 = 1.0 / 60.0;

type Run = fn(bool, &ProgressBar) -> Result<Outcome, ExperimentError>;

/// The tables, figures and claims of the paper that hold results, in its order. Its Figs 1 and 6–8 are drawings.
const RUNS: [(&str, Run); 15] = [
    ("table1", table1::outcome),
    ("fig2", |quick, progress| {
        chains::distribution(chains::LINKS, "fig2", quick, progress)
    }),
    ("fig3", |quick, progress| {
        chains::distribution(chains::BENDING, "fig3", quick, progress)
    }),
    ("fig4", chains::return_maps),
    ("fig5", chains::spectra),
    ("fig9", pictures::specimens),
    ("fig10", |quick, progress| {
        pull::outcome(&pull::run(quick, progress)?)
    }),
    ("fig11", |quick, progress| {
        twist::outcome(&twist::run(quick, progress)?)
    }),
    ("fig12", |quick, progress| {
        bend::outcome(&bend::run(quick, progress)?)
    }),
    ("table2", table2::outcome),
    ("fig13", timing::outcome),
    ("fig14", pictures::gantry),
    ("fig15", pictures::landing),
    ("fig16", swing::outcome),
    ("claims", claims::outcome),
];

pub fn experiments() -> [Experiment; 15] {
    RUNS.map(|(name, run)| Experiment {
        name,
        title: words::title(name),
        run,
    })
}

pub fn named(name: &str) -> Result<Experiment, String> {
    let found = experiments().into_iter().find(|e| e.name == name);
    let names = || RUNS.map(|(name, _)| name).join(", ");
    found.ok_or_else(|| format!("choose one of {}; the other figures are drawings", names()))
}
