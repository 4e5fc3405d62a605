//! a bow of 45° and radius 100, clamped, under a load across its plane at the tip (Bathe and Bolourchi).
//!
//! The section is 1 × 1, E = 10⁷, ν = 0; with the torsion constant 1/6 that the literature takes, GJ = EI. The bow
//! lies in the plane of x and y and starts along x; the load P is along z. The continuum, a Cosserat rod with n = P
//! ẑ constant,
//!
//! ```text
//! r' = Q (e₁ + C⁻¹ Qᵀ n),   Q' = Q [k₀ + B⁻¹ Qᵀ m]ₓ,   m' = −r' × n,   m(L) = 0
//! ```
//!
//! with k₀ = e₃/R, B = diag(GJ, EI, EI) and C = diag(EA, GA, GA) is solved by shooting from the clamp with Runge and
//! Kutta's method of fourth order. The chain has straight segments between points of the bow and the same compliance
//! EA of its joints in all directions: C = EA.

use crate::hard::file::rod::shoot;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_4;

const RADIUS: f64 = 100.0;
const YOUNG: f64 = 1e7;
const EI: f64 = YOUNG / 12.0;
/// Torsion constant of the literature.
const TORSION: f64 = 1.0 / 6.0;

/// Axial and shear compliance, 1/EA and 1/GA; both 0 for a rod that neither stretches nor shears.
const FLEXIBLE: [f64; 2] = [1.0 / YOUNG, 2.0 / YOUNG];

#[derive(Clone, Copy)]
struct State {
    place: Vector3<f64>,
    turn: Quaternion<f64>,
    moment: Vector3<f64>,
}

impl State {
    fn plus(self, h: f64, rate: &Self) -> Self {
        Self {
            place: self.place + rate.place * h,
            turn: self.turn + rate.turn * h,
            moment: self.moment + rate.moment * h,
        }
    }
}

fn rate(s: &State, force: &Vector3<f64>, gj: f64, [axial, shear]: [f64; 2]) -> State {
    let q = UnitQuaternion::new_normalize(s.turn);
    let (f, m) = (q.inverse() * force, q.inverse() * s.moment);
    let bend = Vector3::new(m.x / gj, m.y / EI, m.z / EI + 1.0 / RADIUS);
    let strain = Vector3::new(1.0 + axial * f.x, shear * f.y, shear * f.z);
    let along = q * strain;
    State {
        place: along,
        turn: s.turn * Quaternion::from_imag(bend) * 0.5,
        moment: -along.cross(force),
    }
}

/// Tip of the continuum under the load, with the torsion constant `torsion` and the compliances \[1/EA, 1/GA], by
/// `steps` steps of integration. NaN where the shooting does not converge.
fn continuum(load: f64, torsion: f64, compliance: [f64; 2], steps: usize) -> Vector3<f64> {
    let gj = 0.5 * YOUNG * torsion;
    let h = RADIUS * FRAC_PI_4 / steps as f64;
    let follow = |moment: Vector3<f64>, part: f64| {
        let force = Vector3::z() * (load * part);
        let rate = |s: &State| rate(s, &force, gj, compliance);
        let mut s = State {
            place: Vector3::zeros(),
            turn: Quaternion::identity(),
            // In the unit EI/R.
            moment: moment * (EI / RADIUS),
        };
        for _ in 0..steps {
            let a = rate(&s);
            let b = rate(&s.plus(0.5 * h, &a));
            let c = rate(&s.plus(0.5 * h, &b));
            let d = rate(&s.plus(h, &c));
            for (weight, slope) in [(1.0, a), (2.0, b), (2.0, c), (1.0, d)] {
                s = s.plus(weight * h / 6.0, &slope);
            }
        }
        s
    };
    let mut moment = Vector3::zeros();
    for k in 1..=8 {
        let part = f64::from(k) / 8.0;
        let found = shoot(moment, |m| Some(follow(m, part).moment * (RADIUS / EI)));
        let Some(found) = found else {
            return Vector3::repeat(f64::NAN);
        };
        moment = found;
    }
    follow(moment, 1.0).place
}

/// Steps of the continuum's integration: another half of them changes nothing in the twelfth digit.
const STEPS: usize = 400;

/// The tip under a load; of a rod as soft across as along where `is_chain` is not 0.
pub(super) fn tip(load: f64, is_chain: f64) -> Vector3<f64> {
    let [axial, shear] = FLEXIBLE;
    let shear = if is_chain == 0.0 { shear } else { axial };
    continuum(load, TORSION, [axial, shear], STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_continuum_has_the_known_numbers() {
        let near = |ours: Vector3<f64>, [x, y, z]: [f64; 3]| {
            assert!((ours - Vector3::new(x, y, z)).amax() < 1e-4, "{ours}");
        };
        for (load, printed) in [
            (300.0, [58.7791, 22.2448, 40.1919]),
            (450.0, [52.2386, 18.5082, 48.5029]),
            (600.0, [47.1504, 15.6848, 53.4749]),
        ] {
            near(continuum(load, TORSION, FLEXIBLE, 200), printed);
        }
        let values = [47.1513, 15.6851, 53.4686];
        near(continuum(600.0, TORSION, [0.0; 2], 200), values);
        let values = [46.8919, 15.5578, 53.6074];
        near(continuum(600.0, 0.14058, FLEXIBLE, 200), values);
    }

    #[test]
    fn the_integration_has_converged() {
        let [coarse, fine] = [STEPS, 2 * STEPS].map(|n| continuum(600.0, TORSION, FLEXIBLE, n));
        assert!((coarse - fine).norm() < 1e-9, "{coarse} {fine}");
    }
}
