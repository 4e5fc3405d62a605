//! Lines and powers through points, by least squares.

/// Offset and slope \[a, b] of the least-squares line y = a + b x.
pub(crate) fn line(points: &[[f64; 2]]) -> [f64; 2] {
    weighted_line(points, |_| 1.0)
}

/// Weighted least-squares line: offset and slope.
fn weighted_line(points: &[[f64; 2]], weight: impl Fn(&[f64; 2]) -> f64) -> [f64; 2] {
    let total: f64 = points.iter().map(&weight).sum();
    let mean = |i: usize| points.iter().map(|p| weight(p) * p[i]).sum::<f64>() / total;
    let (x, y) = (mean(0), mean(1));
    let of = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(|p| weight(p) * f(p)).sum::<f64>();
    let slope = of(&|p| (p[0] - x) * (p[1] - y)) / of(&|p| (p[0] - x).powi(2));
    [y - slope * x, slope]
}

/// Offset and slope of y = a + b x with the least sum of squared relative errors.
pub(crate) fn relative_line(points: &[[f64; 2]]) -> [f64; 2] {
    weighted_line(points, |p| p[1].powi(-2))
}

/// The exponent p of y = c x^p by least squares of the logarithms.
pub(crate) fn exponent(points: &[[f64; 2]]) -> f64 {
    let logs: Vec<_> = points.iter().map(|p| p.map(f64::ln)).collect();
    line(&logs)[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_powers_are_found_again() {
        let xs = [10.0, 100.0, 1e3, 1e4];
        let straight = xs.map(|x| [x, 3.0 + 0.25 * x]);
        for [a, b] in [line(&straight), relative_line(&straight)] {
            let holds = (a - 3.0).abs() < 1e-10 && (b - 0.25).abs() < 1e-13;
            assert!(holds, "{a} {b}");
        }
        let power = xs.map(|x| [x, 7.0 * x.powf(1.3)]);
        assert!((exponent(&power) - 1.3).abs() < 1e-13);
    }

    /// An error in the largest value does not move the offset that the small ones show.
    #[test]
    fn the_relative_line_keeps_the_small_end() {
        let mut points = [10.0, 100.0, 1e3, 1e4].map(|x| [x, 50.0 + x]);
        points[3][1] *= 1.1;
        assert!((relative_line(&points)[0] - 50.0).abs() < 3.0);
        assert!((line(&points)[0] - 50.0).abs() > 30.0);
    }
}
