//! Restitution, by Newton's law: shapes that arrive faster than [`SLOWEST`] leave with e times their speed.
//!
//! The step that they arrive in ends where the rebound has brought them, at which the normal row's b aims. Once the step
//! stands a second solve with its W, on velocities alone, gives the rates of the rebound: Coulomb's law bounds its impulses
//! too. Newton's law can gain energy where friction turns a body; then the impulses are scaled so that the step's and theirs
//! together add none.
//!
//! The step by itself gains energy where a body that is thrown back meets another within the step, as in a row of balls: both
//! are then held together, and the one that arrived still rebounds. Then the step's impulses go towards those of a step
//! without restitution, which take energy away, until the gain is none.

use super::operator::Factor;
use super::{Contacts, Touch};
use crate::pieces::Pieces;
use taut_model::Scene;
use taut_solver::SolveError;
use taut_solver::coulomb::{ConeMethod, ConeReport};

/// Speed of arrival below which nothing bounces, over |g| Δt, and the least \[m/s].
const SLOWEST: f64 = 0.1;
const STANDSTILL: f64 = 1e-3;

/// Speed of arrival below which nothing bounces in a step `dt` long \[m/s].
pub(crate) fn slowest(scene: &Scene, dt: f64) -> f64 {
    (SLOWEST * scene.gravity.norm() * dt).max(STANDSTILL)
}

impl Touch {
    /// Whether the shapes touch and do not arrive, neither faster than `slowest` nor over a gap that takes more than that in
    /// a step `dt`.
    pub(super) fn rests(&self, scene: &Scene, slowest: f64, dt: f64) -> bool {
        let [rate, ..] = self.rates(|i| scene.bodies.rates(i));
        rate >= -slowest && self.found.gap <= slowest * dt
    }

    /// Aims at a rebound where the shapes arrive within the step `dt` faster than `slowest`: `before` is the normal rate that
    /// the step begins with, `free` the one that it ends with without contacts.
    ///
    /// The rate belongs to the middles of the steps, so the gap is φ + w t + ½ a t² with a = (free − before)/Δt and
    /// w = before + ½ a Δt. It closes at t = T with the rate w + a T; from there the shapes part with −e times that.
    fn aim(&mut self, before: f64, free: f64, slowest: f64, dt: f64) {
        (self.rebound, self.aim) = (None, 0.0);
        let (e, gap) = (self.found.surface.restitution, self.found.gap.max(0.0));
        let a = (free - before) / dt;
        let w = before + 0.5 * a * dt;
        let root = (w * w - 2.0 * a * gap).max(0.0).sqrt();
        // The first root of the gap, in the form without cancellation for w < 0.
        let arrival = 2.0 * gap / (root - w);
        if e == 0.0 || before > -slowest || w >= 0.0 || arrival.is_nan() || arrival > dt {
            return;
        }
        let (left, parting) = (dt - arrival, e * root);
        let reached = (parting * left + 0.5 * a * left * left).max(0.0);
        self.aim = -reached / dt;
        self.rebound = Some(parting + a * (0.5 * dt - arrival));
    }
}

impl Contacts {
    /// Aims at rebounds where shapes arrive, with the rates `free` of a step `dt` without contacts, which then aim there too.
    pub(crate) fn aim(&mut self, scene: &Scene, pieces: &Pieces, free: &mut [f64], dt: f64) {
        if !self.bounces {
            return;
        }
        let slowest = slowest(scene, dt);
        let touches = self.touches.iter_mut().zip(free.as_chunks_mut::<3>().0);
        for (touch, free) in touches.filter(|(touch, _)| touch.active) {
            let [before, ..] = touch.rates(|i| pieces.v.get(i));
            free[0] -= touch.aim;
            touch.aim(before, free[0] - touch.offset, slowest, dt);
            free[0] += touch.aim;
        }
    }

    /// Impulses of rebounds, from the velocities at the end of a step `dt` long, which `of` gives: those of the step are kept
    /// in `resting`. Scaled so that both together add no energy.
    pub(crate) fn rebound(
        &mut self,
        method: ConeMethod,
        dt: f64,
        of: impl Fn(usize) -> [f64; 6],
        factor: &mut Factor<'_>,
        each: impl FnMut(ConeReport, bool),
    ) -> Result<(), SolveError> {
        let mut rates = std::mem::take(&mut self.rates);
        let mut wanted = std::mem::take(&mut self.wanted);
        wanted.clear();
        rates.clear();
        for touch in &self.touches {
            let [n, s, t] = touch.rates(&of);
            rates.extend([n, s, t]);
            let room = (touch.found.gap + dt * n).max(0.0) / dt;
            wanted.extend([touch.rebound.map_or(n + room, |rate| n - rate), s, t]);
        }
        self.resting.clear();
        let resting = self.touches.iter().map(|t| t.impulse);
        self.resting.extend(resting);
        // Of the step: p₀·u and p₀·W p₀.
        let along = |touches: &[Touch], rates: &[f64]| -> f64 {
            let impulses = touches.iter().flat_map(|t| t.impulse);
            impulses.zip(rates).map(|(p, u)| p * u).sum()
        };
        let spent =
            along(&self.touches, &rates) - 0.5 * self.operator.energy(&self.touches, factor)?;
        let gains = spent > 0.0;
        if gains {
            // A step without restitution: its rates without impulses, and no more than closing the gaps.
            for (wanted, rate) in wanted.iter_mut().step_by(3).zip(rates.iter().step_by(3)) {
                *wanted = rate.max(*wanted);
            }
            self.operator
                .take_away(&self.touches, &mut wanted, factor)?;
        }
        self.touches.iter_mut().for_each(|t| t.impulse = [0.0; 3]);
        self.operator
            .solve(method, &mut self.touches, &wanted, factor, each)?;
        if gains {
            for (touch, resting) in self.touches.iter_mut().zip(&self.resting) {
                for (p, resting) in touch.impulse.iter_mut().zip(resting) {
                    *p -= resting;
                }
            }
        }
        let (linear, square) = (
            along(&self.touches, &rates),
            self.operator.energy(&self.touches, factor)?,
        );
        let part = if gains {
            least_part(spent, linear, square)
        } else {
            largest_part(spent, linear, square)
        };
        for touch in &mut self.touches {
            touch.impulse = touch.impulse.map(|p| p * part);
        }
        (self.rates, self.wanted) = (rates, wanted);
        Ok(())
    }

    /// The impulses are those of the step and its rebounds together.
    pub(crate) fn end_rebound(&mut self) {
        for (touch, resting) in self.touches.iter_mut().zip(self.resting.drain(..)) {
            for (p, resting) in touch.impulse.iter_mut().zip(resting) {
                *p += resting;
            }
            touch.rebound = None;
        }
    }
}

/// The largest θ ≤ 1 with spent + θ linear + ½ θ² square ≤ 0, where `spent` ≤ 0.
fn largest_part(spent: f64, linear: f64, square: f64) -> f64 {
    if spent + linear + 0.5 * square <= 0.0 || square <= 0.0 {
        return 1.0;
    }
    ((-linear + (linear * linear - 2.0 * square * spent).sqrt()) / square).clamp(0.0, 1.0)
}

/// The least θ ≤ 1 with the same ≤ 0, where `spent` > 0: the first root, in the form without cancellation.
fn least_part(spent: f64, linear: f64, square: f64) -> f64 {
    let root = (linear * linear - 2.0 * square * spent).max(0.0).sqrt();
    let part = 2.0 * spent / (root - linear);
    if part.is_finite() {
        part.clamp(0.0, 1.0)
    } else {
        1.0
    }
}
