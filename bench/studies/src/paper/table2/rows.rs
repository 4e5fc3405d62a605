//! The rows of the paper's table: what the scan shows, and how it is read here.

use super::LENGTH;
use crate::paper::GRAVITY;
use crate::paper::words::with;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::LazyLock;
use taut_model::Material;

/// A row of `rows.toml`.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::paper) struct Row {
    #[serde(rename = "young_gpa")]
    pub(super) young: f64,
    /// ζ = A/I_a, 12/A of a square section.
    #[serde(rename = "zeta_per_m2")]
    pub(super) zeta: f64,
    pub(super) segments: usize,
    pub(super) ratio: f64,
    scanned_zeta: String,
    scanned_ratio: String,
    inferred: bool,
}

pub(in crate::paper) static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let read = toml::from_str(include_str!("rows.toml"));
    let mut table: BTreeMap<String, _> = read.unwrap_or_else(|e| panic!("rows.toml: {e}"));
    table.remove("row").unwrap_or_default()
});

impl Row {
    /// Area of the square section \[m²].
    pub(super) fn area(&self) -> f64 {
        12.0 / self.zeta
    }

    /// π² Y N/(ρ g ζ L³), Euler's load over a segment's mass, for a cable of `length` (m) with the density of steel.
    pub(super) fn euler(&self, length: f64) -> f64 {
        let stiffness = PI * PI * self.young * 1e9 * self.segments as f64;
        stiffness / (Material::STEEL.density * GRAVITY * self.zeta * length.powi(3))
    }

    /// The length at which Euler's load is the paper's ratio \[m].
    pub(super) fn euler_length(&self) -> f64 {
        LENGTH * (self.euler(LENGTH) / self.ratio).cbrt()
    }

    /// The row with what follows from it.
    pub(super) fn read(&self) -> Value {
        let (certain, mark) = match self.inferred {
            true => ("inferred", " (inferred)"),
            false => ("legible", ""),
        };
        let more = json!({
            "certain": certain,
            "mark": mark,
            "decade": self.ratio.log10(),
            "young_over_zeta": self.young / self.zeta,
            "euler": self.euler(LENGTH),
            "length": self.euler_length(),
        });
        with(self, &more)
    }
}

/// The one length at which Euler's load comes nearest to all of the paper's ratios: the geometric mean of the rows'
/// \[m].
pub(super) fn fitted_length() -> f64 {
    let logs: f64 = ROWS.iter().map(|r| r.euler_length().ln()).sum();
    (logs / ROWS.len() as f64).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eulers_load_is_that_of_the_cable() {
        let row = &ROWS[7];
        let (area, length) = (0.012, 1.0);
        let second_moment = area * area / 12.0;
        let load = PI * PI * 2e11 * second_moment / (length * length);
        let segment = 7850.0 * area * length / 6.0;
        assert!((row.euler(length) / (load / (GRAVITY * segment)) - 1.0).abs() < 1e-12);
        assert!((row.euler(row.euler_length()) / row.ratio - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_rows_as_read_go_as_stiffness_over_zeta() {
        for part in [&ROWS[..5], &ROWS[5..]] {
            let scaled = part.iter().map(|r| r.ratio * r.zeta / r.young);
            assert!(
                scaled
                    .clone()
                    .all(
                        |s| (s / part[0].ratio / part[0].zeta * part[0].young - 1.0).abs() < 1e-12
                    )
            );
        }
    }
}
