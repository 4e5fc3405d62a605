//! Greenhill's torque, at which a twisted rod without tension buckles.
//!
//! With both ends held in line (clamped) it is T = 8.987 YI/L, between pinned ends 2π YI/L. For the chain of this crate
//! the linearised balance of the segments' tilts ψ_j (complex, y + iz) is
//!
//! ```text
//! m_j = i c_j (ψ_j − ψ_{j−1}) + ½ T (ψ_j + ψ_{j−1}),   m_{j+1} = m_j − i l (f − P ψ_j),   c_j = YI/l_j
//! ```
//!
//! with a constant lateral force f; [`buckling_torque`] is the least T for which it has a solution with both ends held.
//! (P = 0 for the paper's: a bearing that cannot slide holds the straight specimen without tension.)

use nalgebra::Complex;
use std::f64::consts::PI;

/// Greenhill's torque of the chain of `n` segments with both ends held in line, in units of YI/L: the least T for which
/// the linearised tilts have a solution. `slenderness` is YA L²/YI, for the joints' compliance across, `tension` P L²/YI.
/// NaN where none is below 60.
pub fn buckling_torque(n: usize, slenderness: f64, tension: f64) -> f64 {
    let i = Complex::i();
    let l = 1.0 / n as f64;
    // Tilt of the grip and place of the cable's end for a moment m at the clamp and a lateral force f.
    let shoot = |t: f64, mut m: Complex<f64>, f: f64| {
        let (mut tilt, mut place) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
        for j in 0..=n {
            let length = if j == 0 || j == n { 0.5 * l } else { l };
            let c = i / length;
            tilt = (m + tilt * (c - 0.5 * t)) / (c + 0.5 * t);
            place += length / slenderness * f;
            if j < n {
                place += tilt * l;
                m -= i * (l * (f - tilt * tension));
            }
        }
        (tilt, place)
    };
    let determinant = |t: f64| {
        let (a, b) = (
            shoot(t, Complex::new(1.0, 0.0), 0.0),
            shoot(t, Complex::new(0.0, 0.0), 1.0),
        );
        (a.0 * b.1 - b.0 * a.1).norm()
    };
    // The modulus touches zero: its first minimum near it, refined by thirds.
    let h = 0.01;
    for k in 2..6000 {
        let t = f64::from(k) * h;
        let (before, at, after) = (determinant(t - h), determinant(t), determinant(t + h));
        if at < before && at <= after {
            let (mut low, mut high) = (t - h, t + h);
            for _ in 0..100 {
                let third = (high - low) / 3.0;
                if determinant(low + third) < determinant(high - third) {
                    high -= third;
                } else {
                    low += third;
                }
            }
            let root = 0.5 * (low + high);
            if determinant(root) < 1e-5 * determinant(0.5 * root) {
                return root;
            }
        }
    }
    f64::NAN
}

/// Greenhill's torque between clamped ends over YI/L: twice the first positive root of tan x = x.
pub fn greenhill() -> f64 {
    let mut x = 4.5_f64;
    for _ in 0..50 {
        x = x.atan() + PI;
    }
    2.0 * x
}
