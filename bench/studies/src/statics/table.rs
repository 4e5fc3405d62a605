//! The resting cables and the iterations that hold them, as text.

use taut_output::row::{Row, is, number_of};
use taut_output::sheet::{self, Across, Column, Sheet, Show, column};

const SOLVER: Column = column("backend", "solver");
const SEGMENTS: Column = column("segments", "segments");
const RATIO: Column = column("mass_ratio", "ratio").shown(Show::Ratio);

/// The cables damped to rest, and the iterations needed, the levels side by side.
pub(super) const SHEETS: &[Sheet; 2] = &[SETTLED, NEEDED];

const SETTLED: Sheet = Sheet {
    list: "settled",
    columns: &[
        SOLVER,
        SEGMENTS,
        RATIO,
        column("steps", "steps"),
        column("elongation_m", "elongation")
            .unit("m")
            .shown(Show::Fixed(9)),
        sheet::error("error", "vs discrete"),
        column("error_continuum", "vs MgL/YA").shown(Show::Error(1)),
        column("sideways_m", "sideways")
            .unit("m")
            .shown(Show::Error(1)),
    ],
    rivals: &["segments", "mass_ratio"],
    ..sheet::PLAIN
};

const NEEDED: Sheet = Sheet {
    list: "needed",
    columns: &[
        SOLVER,
        SEGMENTS,
        RATIO,
        column("warm_start", "start").shown(Show::Row(start)),
    ],
    across: Some(Across {
        by: &[column("level", "{}").shown(Show::Error(0))],
        cells: &[column("iterations", "")
            .shown(Show::Row(iterations))
            .least()],
        several: false,
        most: usize::MAX,
    }),
    rivals: &["segments", "mass_ratio"],
    ..sheet::PLAIN
};

fn start(row: &Row) -> String {
    if is(row, "warm_start") {
        "warm"
    } else {
        "cold"
    }
    .to_owned()
}

fn iterations(row: &Row) -> String {
    let [needed, limit] = ["iterations", "limit"].map(|key| number_of(row, key));
    let more = || format!("> {}", limit.unwrap_or(f64::NAN));
    needed.map_or_else(more, |n| n.to_string())
}
