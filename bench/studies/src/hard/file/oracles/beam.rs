//! Bending modes of a beam of 2 m and 1 kg, EI = 10 N m², that is clamped at one end or at both: of the continuum, and of the
//! chain of rods. The chain bends in its joints by a_j − a_{j−1}, the first one by a_1 over half a rod, and has the exact
//! frequencies of a small eigenvalue problem in the rods' angles a_j: mass from the centres' displacements and the rods' own
//! inertia, stiffness EI/l a joint.

use crate::hard::special::root;
use nalgebra::{DMatrix, SymmetricEigen};
use std::f64::consts::PI;

const LENGTH: f64 = 2.0;
const MASS: f64 = 1.0;
const RADIUS: f64 = 1e-3;
const EI: f64 = 10.0;

/// (βL)² of mode `k`, from 1: cos βL cosh βL = −1 for a cantilever, 1 for a beam clamped at both ends.
pub(super) fn square(clamped: bool, k: usize) -> f64 {
    let (sign, middle) = if clamped {
        (-1.0, k as f64 + 0.5)
    } else {
        (1.0, k as f64 - 0.5)
    };
    // cos x = ∓1/cosh x lies near (k ∓ ½)π.
    let beta = root(
        |x| x.cos() + sign / x.cosh(),
        (middle - 0.4) * PI,
        (middle + 0.4) * PI,
    );
    beta * beta
}

/// ω of the chain of rods \[rad/s], ascending.
pub(super) fn rods(clamped: bool, segments: usize) -> Vec<f64> {
    let n = segments;
    let l = LENGTH / n as f64;
    let rod = MASS / n as f64;
    let inertia = rod * (3.0 * RADIUS * RADIUS + l * l) / 12.0;
    // Centre j is moved by l(a_1 + … + a_{j−1} + ½ a_j).
    let centre = DMatrix::from_fn(n, n, |j, i| match i.cmp(&j) {
        std::cmp::Ordering::Less => l,
        std::cmp::Ordering::Equal => 0.5 * l,
        std::cmp::Ordering::Greater => 0.0,
    });
    let mass = centre.transpose() * &centre * rod + DMatrix::identity(n, n) * inertia;
    let k = EI / l;
    let mut stiffness = DMatrix::zeros(n, n);
    for i in 0..n {
        // Half a rod's length at a clamped end.
        stiffness[(i, i)] += if i == 0 { 2.0 * k } else { k };
        if i + 1 < n {
            stiffness[(i, i)] += k;
            stiffness[(i, i + 1)] -= k;
            stiffness[(i + 1, i)] -= k;
        } else if clamped {
            stiffness[(i, i)] += 2.0 * k;
        }
    }
    // Clamped below too, the end does not move: Σ a = 0, whose complement is kept.
    let basis = if clamped {
        let mean = DMatrix::from_element(n, n, 1.0 / n as f64);
        let eigen = SymmetricEigen::new(mean);
        let kept: Vec<usize> = (0..n).filter(|i| eigen.eigenvalues[*i] < 0.5).collect();
        eigen.eigenvectors.select_columns(&kept)
    } else {
        DMatrix::identity(n, n)
    };
    let reduced = |m: DMatrix<f64>| basis.transpose() * m * &basis;
    let Some(factor) = reduced(mass).cholesky() else {
        return Vec::new();
    };
    let Some(inverse) = factor.l().try_inverse() else {
        return Vec::new();
    };
    let values = (&inverse * reduced(stiffness) * inverse.transpose()).symmetric_eigenvalues();
    let mut values: Vec<f64> = values.iter().map(|w| w.sqrt()).collect();
    values.sort_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wave_numbers_as_printed() {
        for (k, digits) in [(1, 3.516015269), (2, 22.03449156), (3, 61.69721441)] {
            assert!((square(false, k) / digits - 1.0).abs() < 1e-9);
        }
        assert!((square(true, 1) / 22.37328545 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_chain_of_rods_tends_to_the_beam() {
        let scale = (EI * LENGTH / MASS).sqrt() / (LENGTH * LENGTH);
        for clamped in [false, true] {
            let exact = square(clamped, 1) * scale;
            let error = |n| (rods(clamped, n)[0] / exact - 1.0).abs();
            let (coarse, fine) = (error(20), error(40));
            let holds = fine < 5e-3 && (coarse / fine).log2() > 1.9;
            assert!(holds, "{coarse} {fine}");
        }
    }
}
