//! The tip of a folded chain that falls: with its fall x, L = g = 1, the arm that falls has the length ½(1 − x) and all of the
//! kinetic energy,
//!
//! ```text
//! v² = x (2 − x)/(1 − x),    t(x) = √2 (2E(φ, k) − F(φ, k)),  sin²φ = x, k² = ½,    t(1) = 1.19814…
//! ```

use crate::hard::special::elliptic;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// t(x) √(g/L) of the tip's fall x L.
pub(super) fn time(x: f64) -> f64 {
    let (k, phi) = (FRAC_1_SQRT_2, x.sqrt().asin());
    let [first, second] = elliptic(phi, k);
    SQRT_2 * (2.0 * second - first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_as_printed() {
        assert!((time(1.0) - 1.1981402347).abs() < 1e-10);
        // dt/dx = 1/v.
        for x in [0.2, 0.5, 0.9] {
            let h = 1e-5;
            let slope = (time(x + h) - time(x - h)) / (2.0 * h);
            let speed = (x * (2.0 - x) / (1.0 - x)).sqrt();
            assert!((slope * speed - 1.0).abs() < 1e-8, "{x}");
        }
    }
}
