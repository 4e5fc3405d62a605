//! Forces at a limit that give way, and so keep a scene awake.
//!
//! A slipping brake, winch or motor, a cable that slips over a sheave and a contact that slides at
//! its cone carry a force that no longer answers to the motion. The missing part accelerates the
//! scene for ever, however small it is and however short the path by which rest is judged. A force
//! that stands at its limit holds its load and may sleep: a motor that stalls against a stop, or a
//! heap whose friction is used up but which does not move. Slack cables and contacts without
//! friction carry no force that could fall short.

use crate::active_set::RowState;
use crate::step::Step;
use nalgebra::Vector3;
use taut_model::RowBounds;
use taut_model::linearized::dot;

/// Speed above which a force at its limit gives way, over the slowest creep δ/P that counts as
/// motion: rounding is slower.
pub(super) const MOVES: f64 = 1e-6;

/// Speed of contacts over that of [`MOVES`]: heaps at rest shuffle at their cones by the residual
/// of their solver, which exceeds rounding.
const SHUFFLES: f64 = 1e4;

/// Part of the friction that is used up at the cone.
const AT_CONE: f64 = 1.0 - 1e-9;

impl Step {
    /// True if a force at its limit gives way faster than `speed` (m/s). `reach` is the extent of
    /// the material points of each body \[m].
    pub(super) fn gives_way(&self, speed: f64, reach: &[Vector3<f64>]) -> bool {
        let rows = self.system_data.rows.bounds.iter();
        let mut bounds = rows.zip(self.active_set.places());
        bounds.any(|(bound, place)| place != RowState::Inside && self.yields(bound, speed, reach))
            || self.slip.rates().any(|rate| rate.abs() > speed)
            || self.slides(SHUFFLES * speed)
    }

    /// True if a row that carries a force at its limit moves.
    fn yields(&self, bound: &RowBounds, speed: f64, reach: &[Vector3<f64>]) -> bool {
        let rows = &self.system_data.rows;
        if self.multipliers.mu[bound.row] == 0.0 {
            return false;
        }
        let first = rows.row_range(bound.constraint).start;
        let (mut rate, mut fast) = (rows.phi_t[bound.row], 0.0);
        for s in rows.slot_range(bound.constraint) {
            let body = rows.slots[s].body;
            let j = rows.block(s).rows()[bound.row - first];
            rate += dot(&j, &self.scene.bodies.rates(body));
            // Rate of the row if a point at the body's reach moved at `speed`.
            let [x, y, z, p, q, r] = j;
            let turns = Vector3::new(p, q, r).norm() / reach[body].norm().max(f64::MIN_POSITIVE);
            fast += speed * Vector3::new(x, y, z).norm().max(turns);
        }
        rate.abs() > fast
    }

    /// True if a contact slides with its friction used up.
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
