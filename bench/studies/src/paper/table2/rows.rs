//! The rows of the paper's table: what the scan shows, and how it is read here.

use super::{GRAVITY, LENGTH};
use crate::paper::words::with;
use serde::Serialize;
use serde_json::{Value, json};
use std::f64::consts::PI;
use taut_model::Material;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(in crate::paper) struct Row {
    /// Young's modulus Y \[GN/m²]; the scan is clear.
    pub(super) young: f64,
    /// ζ = A/I_a, 12/A of a square section, as read \[1/m²].
    pub(super) zeta: f64,
    /// Number of segments; the scan is clear.
    pub(super) segments: usize,
    /// Largest stable mass ratio, as read.
    pub(super) ratio: f64,
    /// Legible part of ζ in the scan; empty if there is none.
    pub(super) scanned_zeta: &'static str,
    /// Legible part of the ratio in the scan.
    pub(super) scanned_ratio: &'static str,
    /// ζ or the ratio is inferred: the exponents of a column go by decades as Y/ζ does, and agree
    /// where one is legible.
    pub(super) inferred: bool,
}

const fn row(
    (young, segments): (f64, usize),
    (scanned_zeta, zeta): (&'static str, f64),
    (scanned_ratio, ratio): (&'static str, f64),
    inferred: bool,
) -> Row {
    Row {
        young,
        zeta,
        segments,
        ratio,
        scanned_zeta,
        scanned_ratio,
        inferred,
    }
}

/// The paper's rows, in its order. Fully legible is the one with ζ = 10³, six segments.
pub(in crate::paper) const ROWS: [Row; 10] = [
    row((200.0, 24), ("107", 1e6), ("10", 1e1), true),
    row((200.0, 24), ("10°", 1e5), ("107", 1e2), true),
    row((200.0, 24), ("10*", 1e4), ("108", 1e3), true),
    row((200.0, 24), ("10°", 1e3), ("10*", 1e4), true),
    row((2000.0, 24), ("10", 1e3), ("10°", 1e5), true),
    row((200.0, 6), ("", 1e5), ("10", 1e1), true),
    row((200.0, 6), ("", 1e4), ("102", 1e2), true),
    row((200.0, 6), ("103", 1e3), ("103", 1e3), false),
    row((200.0, 6), ("107", 1e2), ("10*", 1e4), true),
    row((2000.0, 6), ("10", 1e2), ("1", 1e5), true),
];

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
        let (euler, length) = (self.euler(LENGTH), self.euler_length());
        let certain = if self.inferred { "inferred" } else { "legible" };
        with(
            self,
            &json!({ "certain": certain, "euler": euler, "length": length }),
        )
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
        let row = ROWS[7];
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
