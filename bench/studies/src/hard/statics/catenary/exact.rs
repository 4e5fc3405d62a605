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
pub(super) const SPAN: f64 = 8.0;
/// Length L of the unstrained cable \[m].
pub(super) const LENGTH: f64 = 10.0;
/// Weight w a metre \[N/m].
pub(super) const WEIGHT: f64 = 10.0;
/// EA of the elastic cable \[N].
pub(super) const EA: f64 = 1e4;

/// Forces and sag of a hanging cable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hanging {
    /// Horizontal force \[N].
    pub(super) horizontal: f64,
    /// Tension at the ends \[N].
    pub(super) end_tension: f64,
    /// Depth of the lowest point \[m].
    pub(super) sag: f64,
}

/// The catenary; `ea` (N) is infinite for a cable that does not stretch.
pub(super) fn continuum(ea: f64) -> Hanging {
    let v = 0.5 * WEIGHT * LENGTH;
    let span = |h: f64| h * LENGTH / ea + 2.0 * h / WEIGHT * (v / h).asinh() - SPAN;
    let h = root(span, 1e-3 * v, 1e3 * v);
    let (half, arc) = (0.5 * LENGTH, (1.0 + (v / h).powi(2)).sqrt());
    Hanging {
        horizontal: h,
        end_tension: v.hypot(h),
        sag: half / ea * (v - 0.5 * WEIGHT * half) + h / WEIGHT * (arc - 1.0),
    }
}

/// The exact chain of `n` links: start and end of each \[m], apart by the gaps of the joints; and its measures. `masses_at_joints`: half a link's weight at each end of it, else rods; a support then carries half a
/// link besides the tension at the end.
pub(super) fn chain(n: usize, ea: f64, masses_at_joints: bool) -> (Vec<Vector3<f64>>, Hanging) {
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
    let hanging = Hanging {
        horizontal: f,
        end_tension: f.hypot(end),
        sag: -lowest,
    };
    (nodes, hanging)
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
        near(rigid.horizontal / WEIGHT, 3.382018790853, 1e-12);
        near(rigid.sag, 2.654375091398, 1e-12);
        near(rigid.end_tension / (WEIGHT * LENGTH), 0.603639388, 1e-9);
        let angle = (rigid.horizontal / rigid.end_tension).acos().to_degrees();
        near(angle, 55.92543, 1e-7);
        let elastic = continuum(EA);
        near(elastic.horizontal, 33.3548086, 1e-9);
        near(elastic.end_tension, 60.1044363, 1e-9);
        near(elastic.sag, 2.6874627640, 1e-10);
    }

    #[test]
    fn the_chain_has_the_known_numbers() {
        let curve = continuum(f64::INFINITY);
        let of = |n| chain(n, f64::INFINITY, true).1;
        for (n, printed) in [
            (4, -1.58e-2),
            (8, -4.15e-3),
            (16, -1.04e-3),
            (32, -2.61e-4),
            (64, -6.52e-5),
        ] {
            near(of(n).horizontal / curve.horizontal - 1.0, printed, 5e-3);
        }
        near(of(4).sag / curve.sag - 1.0, 3.55e-2, 5e-3);
        near(of(64).sag / curve.sag - 1.0, 1.30e-4, 5e-3);
    }
}
