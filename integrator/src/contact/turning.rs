//! Surfaces that turn within a step: what sticks to them follows to second order.
//!
//! Friction that makes velocities equal at the beginning of a step lets what rides on a turning platform go off along the
//! tangent, ½ Δt ω² r outwards in each step. The condition is that of the middle of the step. There the lever of a body is
//! r + ½ Δt (ċ − v), with the velocity v of the body and ċ of the point of contact, so that to the rate of the rows across the
//! normal comes b of
//!
//! ```text
//! ½ Δt Σ ± ω × (ċ − v),      ċ − v = ω × r + C (ω_r × n)
//! ```
//!
//! The point of contact moves with the surface, and along it where the surfaces roll over each other with the relative
//! velocity of turning ω_r ([`rolling`](taut_model::contacts::Contact::rolling)): r = −R n of a ball on a plane stays as it is,
//! b is along n, and balls roll as if there were none. Turns s about the normal change no point of contact at all, so they
//! count to all orders: with θ = s Δt, n × r times
//!
//! ```text
//! s (sin θ/θ − 1)    and    n × (n × r) times    s² Δt ((1 − cos θ)/θ² − ½)
//! ```
//!
//! The normal row needs none: its gap is that of each step anew. ω is that of the beginning, and changes it by Δt² at most.

use super::ContactPoint;
use nalgebra::Vector3;
use taut_model::Scene;

/// Square of an angular velocity \[rad²/s²] of which b is a rounding error of g Δt: 10⁻¹⁶ m/s and less.
const STILL: f64 = 1e-14;

impl ContactPoint {
    /// Takes b of the rows across the normal for a step `dt`, after it is known whether the contact is hit.
    pub(super) fn follow(&mut self, scene: &Scene, dt: f64) {
        let spins = &scene.bodies.angular_velocity;
        let carriers = &self.carriers[..self.count];
        let still = |carrier: &super::ContactBody| spins[carrier.body].norm_squared() < STILL;
        if self.hit || carriers.iter().all(still) {
            return;
        }
        let turns = carriers.iter().map(|of| spins[of.body] * of.part);
        let rolls = self.found.rolling(&turns.sum());
        let normal = self.axes[0];
        let mut ways = Vector3::zeros();
        for carrier in carriers {
            let (spin, lever) = (&spins[carrier.body], &carrier.lever);
            let about = spin.dot(&normal);
            let [once, twice] = higher(about * dt);
            let across = normal.cross(lever);
            let way = spin.cross(&(spin.cross(lever) + rolls)) * (0.5 * dt)
                + across * (about * once)
                + normal.cross(&across) * (about * about * dt * twice);
            ways += way * carrier.part;
        }
        self.turn = [1, 2].map(|k| self.axes[k].dot(&ways));
    }
}

/// sin θ/θ − 1 and (1 − cos θ)/θ² − ½ of an angle θ.
fn higher(angle: f64) -> [f64; 2] {
    let square = angle * angle;
    if square > 0.01 {
        return [
            angle.sin() / angle - 1.0,
            (1.0 - angle.cos()) / square - 0.5,
        ];
    }
    [
        -square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)),
        -square / 24.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)),
    ]
}

#[cfg(test)]
mod tests {
    use super::higher;

    #[test]
    fn both_forms_of_the_angles_agree() {
        for angle in [0.099_999_f64, -0.1] {
            let series = higher(angle);
            let exact = [
                angle.sin() / angle - 1.0,
                (1.0 - angle.cos()) / (angle * angle) - 0.5,
            ];
            for (a, b) in series.iter().zip(exact) {
                assert!((a - b).abs() < 1e-12, "{angle}: {a} {b}");
            }
        }
    }
}
