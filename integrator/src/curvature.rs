//! Dampers of rods, massless cables and joints that swing.
//!
//! A damper of a row resists the rate at which φ grows over the step. With positions x⁺ = x + Δt v⁺ this is
//!
//! ```text
//! (φ(x + Δt v⁺) − φ(x))/Δt = r⁺ + Δt κ/2 + …,    κ = vᵀ (∂²φ/∂x²) v
//! ```
//!
//! and not r⁺, the rate along the tangent: on a circle of radius L, κ = v²/L. A damper that takes r⁺ resists the return of the
//! Δt² κ/2 that each step leaves, and a load at v on a rope with the damping time τ swings τ Δt κ/2 too far out: 54 mm for
//! 100 kg on 2 m from 90°, 172 mm with ten times the damping time. Here the row counts as violated by τ/Δt times what φ grows
//! by beyond its tangent if the bodies go on at the velocities of the step before: the rate is then right to second order in Δt.
//! The lever arm r of a body that a joint holds to the world bends the way of the gap likewise, by ω × (ω × r) Δt²/2. Joints
//! between bodies are left out: light bodies that whip between loads of 10⁵ times their mass do not go on at the velocities of
//! the step before, and gained energy by it.

use crate::system_data::SystemData;
use taut_model::{Constraint, Frame, Scene};

/// Constraints whose dampers follow the curve.
#[derive(Debug, Clone, Default)]
pub(crate) struct Curvature {
    /// Rods and massless cables.
    lengths: Vec<usize>,
    /// Joints to the world whose three rows of the gap are damped.
    joints: Vec<usize>,
}

impl Curvature {
    pub(crate) fn new(scene: &Scene) -> Self {
        let damped = |c: &usize| {
            let first = scene.constraints[*c].parts().next();
            first.is_some_and(|(.., law)| law.damping > 0.0)
        };
        let of = |kind: fn(&Constraint) -> bool| {
            let all = (0..scene.constraints.len()).filter(damped);
            all.filter(|c| kind(&scene.constraints[*c])).collect()
        };
        Self {
            lengths: of(|c| matches!(c, Constraint::MasslessCable(_) | Constraint::Distance(_))),
            joints: of(|c| c.has_stretch_rows() && c.frames().iter().any(is_of_world)),
        }
    }

    /// In the prepared system of a step from `time`, `dt` long (s); J v of the rows is `jv`.
    pub(crate) fn follow(
        &self,
        scene: &Scene,
        system_data: &mut SystemData,
        jv: &[f64],
        (time, dt): (f64, f64),
    ) {
        for &c in &self.lengths {
            let rows = &system_data.rows;
            let r = rows.row_range(c).start;
            let tangent = rows.phi[r] + dt * (jv[r] + rows.phi_t[r]);
            let ahead = scene.constraints[c].length_ahead(&scene.bodies, time, dt);
            let beyond = ahead.map_or(0.0, |ahead| ahead - tangent);
            // A path over sheaves may end ahead.
            if beyond.is_finite() {
                let damped = rows.damping[r] * beyond / dt;
                system_data.add_violation(r, damped, dt);
            }
        }
        for &c in &self.joints {
            let first = system_data.rows.row_range(c).start;
            for s in system_data.rows.slot_range(c) {
                let rows = &system_data.rows;
                let (body, lever) = (rows.slots[s].body, rows.lever(s));
                let omega = &scene.bodies.angular_velocity[body];
                let inwards = omega.cross(&omega.cross(&lever));
                let block = rows.block(s);
                let along = |j: &[f64; 6]| j[0] * inwards.x + j[1] * inwards.y + j[2] * inwards.z;
                let beyond: [f64; 3] = std::array::from_fn(|k| along(&block.rows()[k]));
                for (r, beyond) in (first..).zip(beyond) {
                    let damped = system_data.rows.damping[r] * beyond * (0.5 * dt);
                    system_data.add_violation(r, damped, dt);
                }
            }
        }
    }
}

fn is_of_world(frame: &Frame) -> bool {
    frame.body_index().is_none()
}
