//! All experiments: those that `taut study` runs, and those with a command of their own. A new one is a module `NAME`,
//! declared in `lib.rs` with a row of its map, its `STUDY`, and an entry in [`STUDIES`]. Whatever
//! it runs goes through [`Cases`](crate::cases::Cases), so that it can be resumed and dealt to shards.

use crate::options::Refused;
use crate::study::Study;
use crate::{
    accuracy, energy, engines, estimate, hard, kernels, ladder, linear, matrix, paper, resolution,
    scenes, sequence, shocks, stability, statics, systems,
};
use clap::ArgMatches;
use serde_json::Value;

pub const BENCH: &Study = &ladder::STUDY;
pub const SCENES: &Study = &scenes::STUDY;

pub const COMMANDS: [&Study; 4] = [BENCH, &statics::STUDY, &paper::STUDY, &hard::STUDY];

/// Studies of `taut study`, in the order of its list.
pub const STUDIES: [&Study; 14] = [
    &accuracy::STUDY,
    &linear::STUDY,
    &kernels::STUDY,
    SCENES,
    &systems::STUDY,
    &systems::ITERATIVE,
    &matrix::STUDY,
    &sequence::STUDY,
    &shocks::STUDY,
    &stability::STUDY,
    &energy::STUDY,
    &estimate::STUDY,
    &resolution::STUDY,
    &engines::STUDY,
];

/// The study that `taut bench` runs: the main job, or on networks that of branches and loops, which reads the same options.
pub fn main_job(matches: &ArgMatches) -> Result<&'static Study, Refused> {
    Ok(match ladder::are_networks(matches)? {
        true => SCENES,
        false => BENCH,
    })
}

fn all() -> impl Iterator<Item = &'static Study> {
    COMMANDS.into_iter().chain(STUDIES)
}

/// The experiment of that name.
pub fn named(name: &str) -> Option<&'static Study> {
    all().find(|study| study.name == name)
}

/// The experiment whose rows these are.
pub fn of_rows(rows: &Value) -> Option<&'static Study> {
    let is = |study: &&Study| {
        let [list, column] = study.question().mark;
        let list = if list.is_empty() {
            Some(rows)
        } else {
            rows.get(list)
        };
        let first = list.and_then(Value::as_array).and_then(|rows| rows.first());
        first.is_some_and(|row| row.get(column).is_some())
    };
    all().find(is)
}
