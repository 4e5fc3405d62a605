//! Hanging chains with a payload, g = L = 1: ((R + s) y')' + Ω² y = 0, R = M/m_cable, y(1) = 0, y'(0) = −Ω² y(0), s from
//! below; and the discrete chain of masses on links.

use crate::hard::special::{bessel_zero, root};
use nalgebra::{DMatrix, DVector};

/// ω₁ √(L/g) of `n` masses of 1 on links, the lowest one of `last`: from the tensions over the links' length.
pub(super) fn masses(n: usize, last: f64) -> f64 {
    let link = (n as f64).recip();
    let mass = |i: usize| if i + 1 == n { last } else { 1.0 };
    let below = |i: usize| (i..n).map(mass).sum::<f64>() / link;
    let mut stiffness = DMatrix::zeros(n, n);
    for i in 0..n {
        stiffness[(i, i)] += below(i);
        if i > 0 {
            stiffness[(i - 1, i - 1)] += below(i);
            stiffness[(i - 1, i)] -= below(i);
            stiffness[(i, i - 1)] -= below(i);
        }
    }
    let root = DVector::from_iterator(n, (0..n).map(|i| mass(i).sqrt().recip()));
    let root = DMatrix::from_diagonal(&root);
    let squares = (&root * stiffness * &root).symmetric_eigenvalues();
    squares.iter().copied().fold(f64::INFINITY, f64::min).sqrt()
}

/// ω₁ √(L/g) of a cable of mass `ratio` times its payload's.
///
/// Around the upper end, x = 1 − s, the solution has a power series whose radius is 1 + R > 1.
pub(super) fn loaded(ratio: f64) -> f64 {
    let top = 1.0 + ratio.recip();
    let mismatch = |omega: f64| {
        let square = omega * omega;
        let (mut a, mut b) = (0.0, 1.0);
        let (mut value, mut slope) = (0.0, 1.0);
        for n in 0..4000_u32 {
            let n = f64::from(n);
            let c = ((n + 1.0) * (n + 1.0) * b - square * a) / (top * (n + 2.0) * (n + 1.0));
            // The terms of x^(n+1) in y and of x^(n+1) in y'.
            value += b;
            slope += (n + 2.0) * c;
            (a, b) = (b, c);
            if b.abs() * (n + 2.0) < 1e-18 && a.abs() < 1e-18 {
                break;
            }
        }
        slope - square * value
    };
    root(mismatch, 0.9, 1.2 * 0.5 * bessel_zero(0.0, 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hard::special::laguerre_zeros;

    #[test]
    fn a_payload_makes_a_pendulum_of_the_chain() {
        let printed = [
            (0.01, 1.000829123),
            (0.1, 1.007933711),
            (1.0, 1.056422480),
            (10.0, 1.157393756),
        ];
        for (ratio, digits) in printed {
            assert!((loaded(ratio) - digits).abs() < 1e-9, "{ratio}");
        }
        // All cable: the uniform chain.
        let uniform = 0.5 * bessel_zero(0.0, 1);
        assert!((loaded(200.0) / uniform - 1.0).abs() < 1e-2);
    }

    #[test]
    fn the_discrete_chain_has_the_zeros_of_laguerre() {
        let square = masses(5, 1.0).powi(2);
        assert!((square / (laguerre_zeros(5)[0] * 5.0) - 1.0).abs() < 1e-13);
        let discrete = masses(32, 32.5);
        assert!((discrete / loaded(1.0) - 1.0).abs() < 1e-3, "{discrete}");
    }
}
