//! Roots, angles, vectors and rotations in double-double arithmetic: what angles are measured with to 30 digits.

use taut_solver::DoubleDouble as Dd;

/// A vector.
pub(super) type V = [Dd; 3];

/// A quaternion, scalar first.
pub(super) type Q = [Dd; 4];

pub(super) fn dd(x: f64) -> Dd {
    x.into()
}

/// 2π: its double and what that lacks.
pub(super) fn tau() -> Dd {
    dd(std::f64::consts::TAU) + dd(2.449_293_598_294_706_4e-16)
}

pub(super) fn sqrt(x: Dd) -> Dd {
    let y = x.to_f64().sqrt();
    if y == 0.0 {
        return dd(0.0);
    }
    let mut y = dd(y);
    for _ in 0..2 {
        y = (y + x / y) * dd(0.5);
    }
    y
}

/// sin x and cos x for |x| ≤ 4: series at x/64, then angles doubled.
pub(super) fn sin_cos(x: Dd) -> (Dd, Dd) {
    const HALVINGS: i32 = 6;
    let small = x * dd(0.5_f64.powi(HALVINGS));
    let square = small * small;
    // sin and 1 − cos, which keeps its digits while it is doubled.
    let (mut sine, mut versine) = (small, dd(0.0));
    let (mut odd, mut even) = (small, dd(1.0));
    for k in 1..14 {
        let n = f64::from(2 * k);
        even = -(even * square) / dd(n * (n - 1.0));
        odd = -(odd * square) / dd(n * (n + 1.0));
        versine = versine - even;
        sine = sine + odd;
    }
    for _ in 0..HALVINGS {
        let cosine = dd(1.0) - versine;
        versine = dd(2.0) * sine * sine;
        sine = dd(2.0) * sine * cosine;
    }
    (sine, dd(1.0) - versine)
}

/// atan2(y, x): its double, and the rest from the sine of the difference.
pub(super) fn atan2(y: Dd, x: Dd) -> Dd {
    let first = y.to_f64().atan2(x.to_f64());
    let (sine, cosine) = sin_cos(dd(first));
    let rest = (y * cosine - x * sine) / (x * cosine + y * sine);
    dd(first) + rest - rest * rest * rest / dd(3.0)
}

pub(super) fn dot(a: &V, b: &V) -> Dd {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: &V, b: &V) -> V {
    let part = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
    [part(1, 2), part(2, 0), part(0, 1)]
}

pub(super) fn norm(a: &V) -> Dd {
    sqrt(dot(a, a))
}

pub(super) fn scaled(a: &V, factor: Dd) -> V {
    a.map(|x| x * factor)
}

pub(super) fn plus(a: &V, b: &V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn minus(a: &V, b: &V) -> V {
    plus(a, &scaled(b, dd(-1.0)))
}

pub(super) fn unit(a: &V) -> V {
    scaled(a, dd(1.0) / norm(a))
}

/// Angle between two vectors, 0 to π.
pub(super) fn angle(p: &V, q: &V) -> Dd {
    atan2(norm(&cross(p, q)), dot(p, q))
}

pub(super) fn times(p: &Q, q: &Q) -> Q {
    let [a, b, c, d] = *p;
    let [e, f, g, h] = *q;
    [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]
}

pub(super) fn conjugate(q: &Q) -> Q {
    [q[0], -q[1], -q[2], -q[3]]
}

/// The rotation by `turn` about coordinate axis `axis` of the world.
pub(super) fn about(axis: usize, turn: Dd) -> Q {
    let (sine, cosine) = sin_cos(turn * dd(0.5));
    let mut q = [cosine, dd(0.0), dd(0.0), dd(0.0)];
    q[axis + 1] = sine;
    q
}

/// q of the length 1.
pub(super) fn normalized(q: &Q) -> Q {
    let length = sqrt(q.iter().fold(dd(0.0), |sum, x| sum + *x * *x));
    q.map(|x| x / length)
}

/// The vector `v` turned by the unit quaternion `q`.
pub(super) fn rotated(q: &Q, v: &V) -> V {
    let pure = [dd(0.0), v[0], v[1], v[2]];
    let [_, x, y, z] = times(&times(q, &pure), &conjugate(q));
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_their_sines_agree_to_thirty_digits() {
        let mut worst = 0.0_f64;
        for k in -31..=31 {
            let x = dd(f64::from(k)) / dd(10.0);
            let (s, c) = sin_cos(x);
            let one = (s * s + c * c - dd(1.0)).to_f64().abs();
            worst = worst.max(one).max((atan2(s, c) - x).to_f64().abs());
        }
        assert!(worst < 1e-28, "{worst:e}");
        let half = sin_cos(tau() * dd(1.0 / 8.0));
        assert!((half.0 - sqrt(dd(0.5))).to_f64().abs() < 1e-29);
        assert!(sin_cos(tau() * dd(0.5)).0.to_f64().abs() < 1e-28);
    }
}
