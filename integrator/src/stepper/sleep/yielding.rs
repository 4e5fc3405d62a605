//! What gives way at a limit of its force, and so keeps a scene awake.
//!
//! A brake, winch or motor that slips at its limit, a cable that slips over a sheave and a contact that slides at its cone carry
//! a force that no longer answers to the motion: what is missing of it accelerates the scene for ever, however little that
//! is and however small the way that rest is seen in. Those that stand at their limit hold what presses on them, and may sleep:
//! a motor that stalls against a stop, or a heap whose friction is used up but which does not move. Slack cables and contacts
//! without friction carry nothing that could be missing.

use crate::bounded::Place;
use crate::stepper::Stepper;
use nalgebra::Vector3;
use taut_model::RowBounds;
use taut_model::linearized::dot;

/// Part of the slowest creep that is taken for motion, δ/P, beyond which what gives way does move: rounding is slower.
pub(super) const MOVES: f64 = 1e-6;

/// The same of contacts: heaps at rest shuffle at their cones by what their solver leaves, more than rounding.
const SHUFFLES: f64 = 1e4;

/// Part of the friction that is used up at the cone.
const AT_CONE: f64 = 1.0 - 1e-9;

impl Stepper {
    /// Whether a force at its limit gives way, so that material points move faster than `speed` (m/s) by it; `reach` is as
    /// far as those of each body are \[m].
    pub(super) fn gives_way(&self, speed: f64, reach: &[Vector3<f64>]) -> bool {
        let mut bounds = self.pieces.rows.bounds.iter().zip(self.bounded.places());
        bounds.any(|(bound, place)| place != Place::Inside && self.yields(bound, speed, reach))
            || self.slip.rates().any(|rate| rate.abs() > speed)
            || self.slides(SHUFFLES * speed)
    }

    /// Whether a row at a limit of force moves.
    fn yields(&self, bound: &RowBounds, speed: f64, reach: &[Vector3<f64>]) -> bool {
        let rows = &self.pieces.rows;
        if self.mu[bound.row] == 0.0 {
            return false;
        }
        let first = rows.row_range(bound.constraint).start;
        let (mut rate, mut fast) = (rows.phi_t[bound.row], 0.0);
        for s in rows.slot_range(bound.constraint) {
            let body = rows.slots[s].body;
            let j = rows.block(s).rows()[bound.row - first];
            rate += dot(&j, &self.scene.bodies.rates(body));
            // What a point at the body's reach makes of the row at that speed.
            let [x, y, z, p, q, r] = j;
            let turns = Vector3::new(p, q, r).norm() / reach[body].norm().max(f64::MIN_POSITIVE);
            fast += speed * Vector3::new(x, y, z).norm().max(turns);
        }
        rate.abs() > fast
    }

    /// Whether a contact slides whose friction is used up.
    fn slides(&self, speed: f64) -> bool {
        let bodies = &self.scene.bodies;
        self.contacts.touches.iter().any(|touch| {
            let [n, s, t] = touch.impulse;
            let most = touch.found.surface.friction * n;
            let [_, across, along] = touch.rates(|i| bodies.rates(i));
            most > 0.0 && s.hypot(t) >= most * AT_CONE && across.hypot(along) > speed
        })
    }
}
