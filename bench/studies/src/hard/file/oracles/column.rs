//! The weight under which a chain of rods buckles that stands clamped: half a joint's length at the clamp, weights in the
//! segments' middles. A tilt ψ_i of segment i lowers the weights by ½ l² q (n − i − ½) ψ_i², and turns its joints:
//! K ψ = q D ψ, with c = EI/l of an inner joint. The beam's is q = (9/4) j²_{−1/3,1}.

use nalgebra::DMatrix;

/// The weight over EI/L³ of the chain of `n` segments.
pub(super) fn own_weight(n: usize) -> f64 {
    let c = n as f64;
    let lowers = |i: usize| ((c - i as f64 - 0.5) / (c * c)).sqrt();
    let spring = |j: usize| if j == 0 { 2.0 * c } else { c };
    let entry = |i: usize, j: usize| {
        let k = match i.abs_diff(j) {
            0 => spring(i) + if i + 1 < n { c } else { 0.0 },
            1 => -c,
            _ => 0.0,
        };
        k / (lowers(i) * lowers(j))
    };
    DMatrix::from_fn(n, n, entry).symmetric_eigenvalues().min()
}

#[cfg(test)]
mod tests {
    use super::own_weight;
    use crate::hard::special::bessel_zero;

    #[test]
    fn the_chain_nears_the_beam_at_second_order() {
        let beam = 2.25 * bessel_zero(-1.0 / 3.0, 1).powi(2);
        assert!((beam / 7.837347439 - 1.0).abs() < 1e-9);
        let off = |n| own_weight(n) / beam - 1.0;
        assert!((off(32) / off(64) / 4.0 - 1.0).abs() < 0.02);
    }
}
