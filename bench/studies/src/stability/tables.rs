//! The stability map as tables, linear theory and the paper's own table beside it.

use super::{Config, READABLE_AREA, square};
use serde::Serialize;
use serde_json::Value;
use taut_output::row::{Row, is, number_of, text_of};
use taut_output::sheet::{self, Across, Column, Sheet, Show, column};

const JOINT: Column = column("joint", "joint");
const SEGMENTS: Column = column("segments", "segments");
const LARGEST: Column = column("highest", "largest").shown(Show::Row(largest));

pub(super) const SHEETS: &[Sheet] = &[Sheet {
    shared: &[column("cable", "{}"), column("segments", "{} segments")],
    columns: &[JOINT, column("scheme", "scheme")],
    across: Some(Across {
        by: &[column("stiffness", "{}").shown(Show::Row(stiffness))],
        cells: &[column("highest", "").shown(Show::Row(largest))],
        several: false,
        most: usize::MAX,
    }),
    takes: |row| !is(row, "guarded") && !is(row, "planar") && !readable(row),
    ..sheet::PLAIN
}];

const GUARDED: Sheet = Sheet {
    title: "The default options with the guard on, hoist",
    columns: &[
        JOINT,
        SEGMENTS,
        column("scheme", "scheme"),
        column("stiffness", "stiffness"),
        LARGEST,
    ],
    takes: |row| is(row, "guarded"),
    ..sheet::PLAIN
};

const THEORY: Sheet = Sheet {
    title: "The paper's step (linearly implicit, no K): largest stable ratio by linear theory and measured",
    columns: &[
        column("cable", "cable"),
        SEGMENTS,
        JOINT,
        column("planar", "motion").shown(Show::Row(motion)),
        column("predicted", "predicted").shown(Show::Fixed(0)),
        column("stable_to", "measured to").shown(Show::Fixed(0)),
        column("highest", "highest").shown(Show::Fixed(0)),
    ],
    takes: |row| number_of(row, "predicted").is_some(),
    ..sheet::PLAIN
};

const PRINTED: Sheet = Sheet {
    columns: &[
        column("young", "Y").unit("GPa"),
        column("zeta", "ζ").unit("1/m²").shown(Show::Error(0)),
        SEGMENTS,
        column("ratio", "(M/m) max").shown(Show::Error(0)),
    ],
    ..sheet::PLAIN
};

/// True for the cable of the paper's readable entry.
fn readable(row: &Row) -> bool {
    text_of(row, "cable") == square("steel", READABLE_AREA).name()
}

fn stiffness(row: &Row) -> String {
    match text_of(row, "stiffness") {
        "off" => "no K".to_owned(),
        weight => weight.to_owned(),
    }
}

fn motion(row: &Row) -> String {
    if is(row, "planar") {
        "planar"
    } else {
        "seeded"
    }
    .to_owned()
}

/// log₁₀ of the largest ratio up to which all are stable; in brackets the largest stable one where it is another.
pub(super) fn largest(row: &Row) -> String {
    let ratios = row.get("ratios").and_then(Value::as_array);
    let cap = ratios.and_then(|all| all.last()?.as_f64());
    let exponent = |r: f64| {
        let end = if Some(r) == cap { "≥" } else { "" };
        format!("{end}{:.2}", r.log10())
    };
    match (number_of(row, "stable_to"), number_of(row, "highest")) {
        (None, None) => "<0".to_owned(),
        (None, Some(high)) => format!("<0({})", exponent(high)),
        (Some(low), Some(high)) if high > low => format!("{}({})", exponent(low), exponent(high)),
        (Some(low), _) => exponent(low),
    }
}

/// The map, a table for each cable and number of segments, then the guard's, then the paper's.
#[must_use]
pub fn text_tables(data: &Value, config: &Config) -> String {
    format!(
        "Stability map: log₁₀ of the largest load/segment mass ratio up to which every ratio of the grid is stable for\n\
         {} s at Δt = 1/{:.0} s; in brackets the largest stable one where some below it are not. Guard off.\n\
         {}{}{}\n\
         The paper's Table II (20 Gauss–Seidel iterations, alternative twist); its figure for a direct solver is not\n\
         readable, nor is what has no number. ζ = 12/A: 1.2e5 for 1e-4 m², 1e3 for 1.2e-2 m².\n{}",
        config.time,
        1.0 / config.dt,
        SHEETS[0].text(data),
        GUARDED.text(data),
        THEORY.text(data),
        PRINTED.of(&TABLE_II)
    )
}

/// A row of the paper's Table II: Y \[GPa], ζ = A/I_a \[1/m²], segments, largest stable ratio; `None` where the exponent
/// is lost in the text at hand. Made with 20 Gauss–Seidel iterations and the alternative twist.
#[derive(Serialize)]
struct Printed {
    young: f64,
    zeta: Option<f64>,
    segments: usize,
    ratio: Option<f64>,
}

const fn printed(young: f64, zeta: Option<f64>, segments: usize, ratio: Option<f64>) -> Printed {
    Printed {
        young,
        zeta,
        segments,
        ratio,
    }
}

const TABLE_II: [Printed; 10] = [
    printed(200.0, None, 24, None),
    printed(200.0, None, 24, None),
    printed(200.0, None, 24, None),
    printed(200.0, None, 24, None),
    printed(2000.0, None, 24, None),
    printed(200.0, None, 6, None),
    printed(200.0, None, 6, Some(1e2)),
    printed(200.0, Some(1e3), 6, Some(1e3)),
    printed(200.0, None, 6, None),
    printed(2000.0, None, 6, None),
];
