//! Damping of a contact that carries more than its spring can without ringing.
//!
//! A mass m on the compliance ε rings with √(m ε) unless the damping time τ is at least 2 √(m ε): then the force
//! (d + τ ḋ)/ε of a depth d never swings back below what is carried, so that nothing hops or slides while its weight settles, and
//! what the points of contact store as they change comes back as heat and not as motion. So
//!
//! ```text
//! τ = max(τ of the surfaces, 2 √(m ε)),      m = max(1/W, f/|g|)
//! ```
//!
//! with 1/W the mass of both bodies as seen along the normal, and with what the force f of the last step weighs: a light body
//! between heavy ones carries them. At 10⁻¹⁰ m/N a surface with 1 ms has its own up to a tonne a contact.
//!
//! This floor is for contacts that are soft for want of better knowledge. A contact softer than
//! [`STIFF`] is a spring by intent, with the damping of its surfaces.

use super::ContactPoint;
use taut_model::Scene;

/// Least damping time over √(m ε): that of critical damping.
const CRITICAL: f64 = 2.0;

/// Compliance from which on a contact is a spring by intent \[m/N].
const STIFF: f64 = 1e-8;

impl ContactPoint {
    /// Damping time of the contact where it carries `force` (N) \[s].
    pub(super) fn damping(&self, scene: &Scene, force: f64) -> f64 {
        let surface = &self.found.surface;
        if surface.compliance == 0.0 || surface.compliance > STIFF {
            return surface.damping;
        }
        let gravity = scene.gravity.norm();
        let carried = if gravity > 0.0 { force / gravity } else { 0.0 };
        let of = |mobility: f64| {
            let own = if mobility > 0.0 { 1.0 / mobility } else { 0.0 };
            CRITICAL * (surface.compliance * own.max(carried)).sqrt()
        };
        // Bodies that turn besides are lighter yet.
        if of(self.mobility_straight(scene)) <= surface.damping {
            return surface.damping;
        }
        surface.damping.max(of(self.mobility(scene)))
    }

    /// W without the bodies' turning \[1/kg].
    fn mobility_straight(&self, scene: &Scene) -> f64 {
        let bodies = &scene.bodies;
        let dynamic = self
            .carriers()
            .iter()
            .filter(|of| bodies.is_dynamic(of.body));
        dynamic
            .map(|of| of.part * of.part / bodies.mass[of.body])
            .sum()
    }
}
