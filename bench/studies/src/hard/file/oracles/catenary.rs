//! The catenary of the continuum and that of the chain.
//!
//! The continuum of length L and weight w a metre over the span S hangs in y = a cosh(x/a), 2a sinh(S/2a) = L; its
//! horizontal force is H = w a, its tension at the ends H cosh(S/2a). Stretched, with EA,
//!
//! ```text
//! x(s) = H s/EA + (H/w) [asinh(V/H) − asinh((V − w s)/H)],   V = ½ w L
//! y(s) = (s/EA) (V − ½ w s) + (H/w) [(1 + (V/H)²)^½ − (1 + ((V − w s)/H)²)^½]
//! ```
//!
//! A chain of N links of length h = L/N with its masses at the joints, or of N rods with theirs at the centres, has in
//! the middle of link i the vertical force V_i = (½N − ½ − i) w h, and by the balance of moments stands at
//! tan ψ_i = V_i/H, whether the joints are rigid or open by ε times the force through them. H follows from the span:
//! Σ h cos ψ_i + H Σ ε_j = S. That is exact for the chain.

use crate::hard::special::root;
use nalgebra::Vector3;

/// Span S \[m].
const SPAN: f64 = 8.0;
/// Length L of the unstrained cable \[m].
const LENGTH: f64 = 10.0;
/// Weight w a metre \[N/m].
const WEIGHT: f64 = 10.0;

/// Horizontal force \[N], tension at the ends \[N] and depth of the lowest point \[m]; `ea` (N) is infinite for a cable that
/// does not stretch.
pub(super) fn continuum(ea: f64) -> [f64; 3] {
    let v = 0.5 * WEIGHT * LENGTH;
    let span = |h: f64| h * LENGTH / ea + 2.0 * h / WEIGHT * (v / h).asinh() - SPAN;
    let h = root(span, 1e-3 * v, 1e3 * v);
    let (half, arc) = (0.5 * LENGTH, (1.0 + (v / h).powi(2)).sqrt());
    let sag = half / ea * (v - 0.5 * WEIGHT * half) + h / WEIGHT * (arc - 1.0);
    [h, v.hypot(h), sag]
}

/// The exact chain of n links, from n, EA and 1 where half a link's weight is at each end of it, else 0: start and end of each
/// \[m], apart by the gaps of the joints; and the measures of [`continuum`]. A support of rods carries half a link besides the
/// tension at the end.
pub(super) fn chain(x: &[f64]) -> (Vec<Vector3<f64>>, [f64; 3]) {
    let (n, ea, masses_at_joints) = (x[0] as usize, x[1], x[2] != 0.0);
    let h = LENGTH / n as f64;
    let vertical = |i: f64| (0.5 * n as f64 - i) * WEIGHT * h;
    let middle = |i: usize| vertical(i as f64 + 0.5);
    // The joints' lengths add up to L, half a link each at the ends.
    let span = |f: f64| {
        let links = (0..n).map(|i| h * f / f.hypot(middle(i)));
        links.sum::<f64>() + f * LENGTH / ea - SPAN
    };
    let most = WEIGHT * LENGTH;
    let f = root(span, 1e-6 * most, 1e3 * most);
    let mut place = Vector3::zeros();
    let mut nodes = Vec::with_capacity(2 * n);
    for i in 0..n {
        // Side b is drawn on by what hangs on it: down to the middle, then up.
        let length = if i == 0 { 0.5 * h } else { h };
        let gap = length / ea;
        place += Vector3::new(f, 0.0, -vertical(i as f64)) * gap;
        nodes.push(place);
        let tension = f.hypot(middle(i));
        place += Vector3::new(f, 0.0, -middle(i)) * (h / tension);
        nodes.push(place);
    }
    let lowest = nodes.iter().map(|p| p.z).fold(0.0, f64::min);
    let end = if masses_at_joints {
        middle(0)
    } else {
        vertical(0.0)
    };
    (nodes, [f, f.hypot(end), -lowest])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(ours: f64, printed: f64, error: f64) {
        assert!((ours / printed - 1.0).abs() < error, "{ours} {printed}");
    }

    #[test]
    fn the_curve_has_the_known_numbers() {
        let rigid = continuum(f64::INFINITY);
        near(rigid[0] / WEIGHT, 3.382018790853, 1e-12);
        near(rigid[2], 2.654375091398, 1e-12);
        near(rigid[1] / (WEIGHT * LENGTH), 0.603639388, 1e-9);
        let angle = (rigid[0] / rigid[1]).acos().to_degrees();
        near(angle, 55.92543, 1e-7);
        let elastic = continuum(1e4);
        near(elastic[0], 33.3548086, 1e-9);
        near(elastic[1], 60.1044363, 1e-9);
        near(elastic[2], 2.6874627640, 1e-10);
    }

    #[test]
    fn the_chain_has_the_known_numbers() {
        let curve = continuum(f64::INFINITY);
        let of = |n: i32| chain(&[f64::from(n), f64::INFINITY, 1.0]).1;
        for (n, printed) in [
            (4, -1.58e-2),
            (8, -4.15e-3),
            (16, -1.04e-3),
            (32, -2.61e-4),
            (64, -6.52e-5),
        ] {
            near(of(n)[0] / curve[0] - 1.0, printed, 5e-3);
        }
        near(of(4)[2] / curve[2] - 1.0, 3.55e-2, 5e-3);
        near(of(64)[2] / curve[2] - 1.0, 1.30e-4, 5e-3);
    }
}
