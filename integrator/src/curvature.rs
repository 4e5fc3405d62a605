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
//! by beyond its tangent if the bodies go on freely from the velocities of the step before: the rate is then right to second order in Δt.
//! The lever arm r of a body that a joint holds to the world bends the way of the gap likewise, by (ω × (ω × r) + ω̇ × r) Δt²/2
//! with ω̇ of its free rotation. Joints between bodies are left out: light bodies that whip between loads of 10⁵ times their
//! mass do not go on at the velocities of the step before, and gained energy by it. The guard's implicit steps know the path of
//! their last iterate, and follow it in all lengths.

use crate::system_data::SystemData;
use taut_model::{Constraint, Scene};

/// Constraints whose dampers follow the curve: rods, massless cables, and joints to the world.
#[derive(Debug, Clone, Default)]
pub(crate) struct Curvature {
    damped: Vec<usize>,
}

impl Curvature {
    pub(crate) fn new(scene: &Scene) -> Self {
        let is_damped = |c: &usize| {
            let constraint = &scene.constraints[*c];
            let first = constraint.parts().next();
            let is_followed = match constraint {
                Constraint::MasslessCable(_) | Constraint::Distance(_) => true,
                joint => {
                    let mut frames = joint.frames().iter();
                    joint.has_stretch_rows() && frames.any(|f| f.body_index().is_none())
                }
            };
            is_followed && first.is_some_and(|(.., law)| law.damping > 0.0)
        };
        Self {
            damped: (0..scene.constraints.len()).filter(is_damped).collect(),
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
        for &c in &self.damped {
            let (ahead, count) = scene.constraints[c].gap_ahead(&scene.bodies, time, dt);
            let first = system_data.rows.row_range(c).start;
            for (r, ahead) in (first..).zip(ahead).take(count) {
                let rows = &system_data.rows;
                let beyond = ahead - (rows.phi[r] + dt * (jv[r] + rows.phi_t[r]));
                // A path over sheaves may end ahead.
                if beyond.is_finite() {
                    system_data.add_violation(r, rows.damping[r] * beyond / dt, dt);
                }
            }
        }
    }
}

/// In the prepared system of a Newton pass of a sub-step `dt` long, which began with φ = `begun`: the rows hold φ of the last
/// iterate, and `known` its rates along the tangent.
pub(crate) fn follow_iterate(system_data: &mut SystemData, begun: &[f64], known: &[f64], dt: f64) {
    for (r, (begun, known)) in begun.iter().zip(known).enumerate() {
        let damping = system_data.path_damping(r);
        if damping > 0.0 {
            let beyond = (system_data.rows.phi[r] - begun) / dt - known;
            system_data.add_violation(r, damping * beyond, dt);
        }
    }
}
