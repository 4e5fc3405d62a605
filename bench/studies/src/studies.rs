//! The experiments that `taut study` runs. A new one is a module `NAME` with its `STUDY` in `NAME/study.rs`, and an entry
//! in [`STUDIES`]; the commands `bench`, `static`, `hard` and `paper` run the other experiments.

use crate::study::Study;
use crate::{
    accuracy, energy, engines, iterative, kernels, linear, matrix, scenes, shocks, stability,
};
use serde_json::Value;

/// All of them, as they are listed.
pub const STUDIES: [&Study; 10] = [
    &accuracy::STUDY,
    &linear::STUDY,
    &kernels::STUDY,
    &iterative::STUDY,
    &scenes::STUDY,
    &matrix::STUDY,
    &shocks::STUDY,
    &stability::STUDY,
    &energy::STUDY,
    &engines::STUDY,
];

/// The study of that name.
#[must_use]
pub fn named(name: &str) -> Option<&'static Study> {
    STUDIES.into_iter().find(|study| study.name == name)
}

/// The study whose rows these are.
#[must_use]
pub fn of_rows(rows: &Value) -> Option<&'static Study> {
    let is = |study: &&Study| {
        let (list, column) = study.mark;
        let list = if list.is_empty() {
            Some(rows)
        } else {
            rows.get(list)
        };
        let first = list.and_then(Value::as_array).and_then(|rows| rows.first());
        first.is_some_and(|row| row.get(column).is_some())
    };
    STUDIES.into_iter().find(is)
}
