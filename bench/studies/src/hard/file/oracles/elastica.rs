//! the elastica, a cantilever bent far by a dead load P across its tip, α = P L²/EI.
//!
//! With the tip's slope θ and k² = (1 + sin θ)/2, sin φ = 1/(k √2):
//!
//! ```text
//! √α = K(k) − F(φ, k),   x/L = (2 sin θ/α)^½,   y/L = 1 − 2 (E(k) − E(φ, k))/√α
//! ```

use crate::hard::special::{elliptic, root};
use std::f64::consts::FRAC_PI_2;

/// The tip of the elastica of length 1: x, y and slope (rad).
pub(super) fn elastica(alpha: f64) -> [f64; 3] {
    let modulus = |slope: f64| (0.5 * (1.0 + slope.sin())).sqrt();
    let amplitude = |k: f64| (1.0 / (k * 2.0_f64.sqrt())).min(1.0).asin();
    let beyond = |slope: f64, kind: usize| {
        let k = modulus(slope);
        elliptic(FRAC_PI_2, k)[kind] - elliptic(amplitude(k), k)[kind]
    };
    let load = |slope: f64| beyond(slope, 0) - alpha.sqrt();
    let slope = root(load, 1e-12, FRAC_PI_2 - 1e-6);
    [
        (2.0 * slope.sin() / alpha).sqrt(),
        1.0 - 2.0 * beyond(slope, 1) / alpha.sqrt(),
        slope,
    ]
}

#[cfg(test)]
mod tests {
    use super::elastica;

    #[test]
    fn the_elastica_has_the_known_numbers() {
        for (alpha, x, y, slope) in [
            (0.25, 0.9958821816, 0.0827459154, 7.121432),
            (1.0, 0.9435667637, 0.3017207738, 26.433520),
            (4.0, 0.6710587578, 0.6699641813, 64.242282),
            (10.0, 0.4450044022, 0.8106090249, 81.949325),
        ] {
            let [a, b, c] = elastica(alpha);
            let holds = (a - x).abs() < 2e-10 && (b - y).abs() < 2e-10;
            assert!(holds, "{alpha}: {a} {b}");
            assert!((c.to_degrees() - slope).abs() < 1e-6, "{alpha}: {c}");
        }
    }
}
