//! Restitution, by Newton's law: shapes that arrive faster than [`SLOWEST`] leave with e times their speed.
//!
//! The step that they arrive in ends where the rebound has brought them, at which the normal row's b aims. Once the step
//! stands a second solve with its W, on velocities alone, gives the rates of the rebound: Coulomb's law bounds its impulses
//! too. An implicit step ends where the shapes touch, and its rebound is in the velocities alone. Newton's law can gain energy
//! where friction turns a body; then the impulses are scaled so that the step's and theirs together add none.
//!
//! **Energy.** The motion is judged by its energy at the ends of the step, with velocities half a step on: of the mass m in
//! free fall with the acceleration a, the step's impulse p₀ and a blow's p₁ after it change
//!
//! ```text
//! v⁺ = v + a Δt + p₀/m + p₁/m,      x⁺ = x + Δt (v + a Δt + p₀/m)
//! Δ(½ m (v + ½ a Δt)² − m a·x) = (p₀ + p₁)·(u + ½ (p₀ + p₁)/m) + ½ Δt a·(p₁ − p₀),      u = v + a Δt
//! ```
//!
//! exactly so: beside the work with the step's rates there is that of what p₀ has lifted already and p₁ has not. Without it a
//! late blow would lose and an early one gain 2 g Δt/v of its energy. An implicit step has its rates at its end, and the
//! instant T of the blow gives them u⁻ + a (Δt − T) and u⁺. The step's own work is that of the bodies as they stood, the
//! rebound's that of the bodies as they have turned.
//!
//! **Rods that an event has just made** stop what they hold with a blow of their own. It comes first: the approach that
//! rebounds is the one that it leaves, which the step knows as the rate without contacts. Newton's law on the approach
//! before it would gain energy, for a rod turns a rate along it into one across it.
//!
//! **What other contacts carry.** A body that rests on the floor, or that a motor presses against a stop, does not move by the
//! acceleration without contacts before it is struck. Where a body that something bounces on touches something else, the rates that
//! blows fall in are those with the impulses of the contacts that nothing arrives at.
//!
//! **What arrives second.** Each contact aims by its own gap, as if nothing stopped its shapes before: a rope that is caught above a
//! floor, or a mat on it. Where something may, the step is solved without rebounds first. What carries nothing then has not arrived.
//!
//! The step by itself gains energy where a body that is thrown back meets another within the step, as in a row of balls: both
//! are then held together, and the one that arrived still rebounds. Then the step's impulses go towards those of a step
//! without restitution, which take energy away, until the gain is none.

use super::operator::Operator;
use super::{ContactPoint, Contacts, FLOOR};
use crate::response::Factor;
use crate::system_data::SystemData;
use taut_model::Scene;
use taut_solver::SolveError;
use taut_solver::coulomb::{ConeMethod, ConeReport};

/// Speed of arrival below which nothing bounces, over |g| Δt and the change in the step, and the least \[m/s].
const SLOWEST: f64 = 0.1;
const STANDSTILL: f64 = 1e-3;

/// Change of a rate by an impulse that is rounding, over the rate of arrival.
const NOTHING: f64 = 1e-9;

/// Rate at which what arrives is taken to part while the impulses of other contacts are found, over the fastest.
const AWAY: f64 = 1e3;

/// Rate that the regularisation of contacts gives way by, over the fastest rebound, and sum of normal impulses, over the
/// momentum, beyond which no impulses make the rebound.
const JAMMED: f64 = 1e-4;
const WEDGED: f64 = 1e4;

/// Speed of arrival below which nothing bounces in a step `dt` long \[m/s].
pub(crate) fn slowest(scene: &Scene, dt: f64) -> f64 {
    (SLOWEST * scene.gravity.norm() * dt).max(STANDSTILL)
}

impl ContactPoint {
    /// True if the shapes rest on each other: they close no faster than `slowest` (m/s), and this
    /// speed closes their gap within the step `dt` (s).
    pub(super) fn rests(&self, scene: &Scene, slowest: f64, dt: f64) -> bool {
        let rate = self.normal_rate(|i| scene.bodies.rates(i));
        rate >= -slowest && self.found.gap <= slowest * dt
    }

    /// Aims at a rebound where the shapes arrive within the step `dt` faster than `slowest`: `before` are the rates that the
    /// step begins with, `free` those that it ends with without what arrives. Nothing `rebounds` in a solve after one that jammed.
    ///
    /// The normal rate at the beginning is w = before + a `late`, and a = (free − before)/Δt: rates are half a step behind, in implicit
    /// sub-steps half of the whole one. The gap φ + w t + ½ a t² closes at t = T with the rate w + a T; from there the
    /// shapes part with −e times that. An implicit step ends with what it begins with: where the shapes touch.
    fn aim(
        &mut self,
        [before, free]: [[f64; 3]; 2],
        (dt, late): (f64, f64),
        [of_scheme, rebounds]: [bool; 2],
    ) {
        (self.rebound, self.aim, self.arrival) = (None, 0.0, f64::INFINITY);
        let (e, gap) = (self.found.surface.restitution, self.found.gap.max(0.0));
        let a: [f64; 3] = std::array::from_fn(|k| (free[k] - before[k]) / dt);
        let w = before[0] + a[0] * late;
        let root = (w * w - 2.0 * a[0] * gap).max(0.0).sqrt();
        // The first root of the gap, in the form without cancellation for w < 0.
        let arrival = 2.0 * gap / (root - w);
        let arrives = w < 0.0 && (0.0..=dt).contains(&arrival);
        if arrives {
            self.arrival = arrival;
        }
        let time = match arrives {
            true => arrival,
            false if gap == 0.0 => 0.0,
            false => dt,
        };
        // The scheme's rates are known with its impulses.
        self.shift = [a.map(|a| a * (0.5 * (dt - time) - late)); 2];
        // What is pressed down bounces no longer than a fall does.
        let is_slow = -before[0] < SLOWEST * a[0].abs() * dt;
        if e == 0.0 || is_slow || !self.hit || !arrives || !rebounds || self.stopped {
            return;
        }
        let parting = e * root;
        if of_scheme {
            let left = dt - arrival;
            let reached = (parting * left + 0.5 * a[0] * left * left).max(0.0);
            self.aim = -reached / dt;
            self.rebound = Some(parting + a[0] * (dt - late - arrival));
        } else {
            self.rebound = Some(parting - a[0] * late);
        }
    }
}

impl Operator {
    /// Takes what the rates of a step of the scheme have beyond those that tell the work, after [`Operator::energy`] of its
    /// impulses: ± half of a Δt, by which free contacts change from the rates that `begun` gives to the `solved` ones less
    /// those of the impulses.
    /// There is no such change `after_blow`.
    fn take_free(
        &self,
        touches: &mut [ContactPoint],
        solved: &[f64],
        begun: &dyn Fn(usize) -> [f64; 6],
        after_blow: bool,
    ) {
        let moved = self.moved_rates.as_chunks::<3>().0;
        let solved = solved.as_chunks::<3>().0;
        for (i, (moved, solved)) in moved.iter().zip(solved).enumerate() {
            let (before, sigma) = (touches[i].rates(begun), self.sigma(i, touches));
            let impulse = touches[i].impulse;
            let half: [f64; 3] = std::array::from_fn(|k| match after_blow {
                true => 0.0,
                false => 0.5 * (solved[k] + moved[k] + sigma[k] * impulse[k] - before[k]),
            });
            touches[i].shift = [half, half.map(|x| -x)];
        }
    }
}

impl Contacts {
    /// The rates that a step ends with, from those `free` of contacts, with the impulses of the contacts that nothing arrives at.
    /// The others keep theirs.
    pub(crate) fn find_carried(
        &mut self,
        (method, free): (ConeMethod, &[f64]),
        is_dynamic: impl Fn(usize) -> bool,
        factor: &mut Factor<'_>,
        each: impl FnMut(ConeReport, bool),
    ) -> Result<(), SolveError> {
        self.carried.clear();
        self.carried.extend_from_slice(free);
        if !self.strikes_what_rests(is_dynamic) {
            return Ok(());
        }
        let mut known = std::mem::take(&mut self.resting);
        known.clear();
        known.extend(self.touches.iter().map(|touch| touch.impulse));
        let far = AWAY * free.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        let rates = self.carried.as_chunks_mut::<3>().0;
        for (touch, rates) in self.touches.iter_mut().zip(rates) {
            if touch.hit {
                (touch.impulse, rates[0]) = ([0.0; 3], far);
            }
        }
        let (operator, touches) = (&mut self.operator, &mut self.touches);
        let done = operator.solve(method, touches, &self.carried, factor, each);
        self.carried.copy_from_slice(free);
        for touch in touches.iter_mut() {
            touch.impulse = touch.impulse.map(|p| -p);
        }
        let done = match done {
            Ok(true) => operator.take_away(touches, &mut self.carried, factor),
            Ok(false) => Ok(()),
            Err(e) => Err(e),
        };
        for (touch, known) in touches.iter_mut().zip(known.drain(..)) {
            touch.impulse = known;
        }
        self.resting = known;
        done
    }

    /// True if something that may bounce strikes a body that other contacts carry.
    fn strikes_what_rests(&self, is_dynamic: impl Fn(usize) -> bool) -> bool {
        let active = || self.touches.iter().filter(|touch| touch.active);
        let bounces = |touch: &&ContactPoint| touch.hit && touch.found.surface.restitution > 0.0;
        let struck = active().filter(bounces).flat_map(ContactPoint::carriers);
        struck.filter(|of| is_dynamic(of.body)).any(|of| {
            let rests = active().filter(|touch| !touch.hit);
            let mut carried = rests.flat_map(ContactPoint::carriers);
            carried.any(|other| other.body == of.body)
        })
    }

    /// Aims at rebounds where shapes arrive, with the rates `free` of a step `dt` without contacts, which then aim there too, after
    /// [`find_carried`](Self::find_carried). The step begins with the blow of a rod if `after_blow`.
    pub(crate) fn aim(
        &mut self,
        system_data: &SystemData,
        free: &mut [f64],
        dt: f64,
        after_blow: bool,
    ) {
        let kinds = [self.of_scheme, self.rebounds];
        self.after_blow = after_blow;
        let carried = self.carried.as_chunks::<3>().0;
        let free = free.as_chunks_mut::<3>().0.iter_mut().zip(carried);
        let touches = self.touches.iter_mut().zip(free);
        for (touch, (free, carried)) in touches.filter(|(touch, _)| touch.active) {
            free[0] -= touch.aim;
            let own = [touch.offset + touch.aim, touch.turn[0], touch.turn[1]];
            let alone = std::array::from_fn(|k| carried[k] - own[k]);
            let before = match after_blow {
                true => alone,
                false => touch.rates(|i| system_data.v.get(i)),
            };
            touch.aim([before, alone], (dt, self.late), kinds);
            free[0] += touch.aim;
        }
    }

    /// Energy that the step's impulses p have added, p·u − ½ p·W p in the instant that they belong to, ≤ 0 where they have not \[J]:
    /// of the rates that the step `solved` for, before the bodies turned, and of those that it `begun` with. The impulses are kept
    /// in `resting`.
    pub(crate) fn begin_rebound(
        &mut self,
        [begun, solved]: [&dyn Fn(usize) -> [f64; 6]; 2],
        factor: &mut Factor<'_>,
    ) -> Result<f64, SolveError> {
        self.resting.clear();
        let resting = self.touches.iter().map(|t| t.impulse);
        self.resting.extend(resting);
        let square = self.operator.energy(&self.touches, factor)?;
        let mut rates = std::mem::take(&mut self.rates);
        rates.clear();
        rates.extend(self.touches.iter().flat_map(|touch| touch.rates(solved)));
        if self.of_scheme {
            let touches = &mut self.touches;
            self.operator
                .take_free(touches, &rates, begun, self.after_blow);
        }
        let spent = along(&self.touches, &rates, 0) - 0.5 * square;
        self.rates = rates;
        Ok(spent)
    }

    /// Impulses of rebounds, from the velocities at the end of a step `dt` long, which `of` gives. Scaled so that they add no
    /// energy to that of the step's impulses, which have `spent`, where bodies do not turn.
    pub(crate) fn rebound(
        &mut self,
        (method, dt, spent): (ConeMethod, f64, f64),
        of: impl Fn(usize) -> [f64; 6],
        factor: &mut Factor<'_>,
        each: impl FnMut(ConeReport, bool),
    ) -> Result<Budget, SolveError> {
        let mut rates = std::mem::take(&mut self.rates);
        let mut wanted = std::mem::take(&mut self.wanted);
        wanted.clear();
        rates.clear();
        let gains = spent > 0.0;
        for touch in &self.touches {
            let [n, s, t] = touch.rates(&of);
            rates.extend([n, s, t]);
            let room = (touch.found.gap + dt * n).max(0.0) / dt;
            let wanted_rate = touch.rebound.map_or(n + room, |rate| n - rate);
            // A step without restitution: its rates without impulses, and no more than closing the gaps.
            let least = if gains { n } else { f64::NEG_INFINITY };
            wanted.extend([wanted_rate.max(least), s, t]);
        }
        if gains {
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
            along(&self.touches, &rates, 1),
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
        let moved = |touch: &ContactPoint| dot3(&touch.impulse, &touch.shift[1]);
        Ok(Budget {
            spent,
            shifted: self.touches.iter().map(moved).sum(),
        })
    }

    /// True if something arrives in the step that leaves with its restitution.
    pub(crate) fn rebound_is_due(&self) -> bool {
        self.touches.iter().any(|touch| touch.rebound.is_some())
    }

    /// True if a body that is thrown back in the step arrives before that at what throws it back less.
    pub(crate) fn may_be_stopped(&self, is_dynamic: impl Fn(usize) -> bool) -> bool {
        let body = |touch: &ContactPoint, i: usize| touch.carriers().iter().any(|of| of.body == i);
        let stops = |touch: &ContactPoint, late: &ContactPoint| {
            let [less, more] = [touch, late].map(|touch| match touch.rebound {
                Some(_) => touch.found.surface.restitution,
                None => 0.0,
            });
            let mut own = late.carriers().iter().filter(|of| is_dynamic(of.body));
            touch.arrival < late.arrival && less < more && own.any(|of| body(touch, of.body))
        };
        let mut thrown = self.thrown_back();
        thrown.any(|late| self.touches.iter().any(|touch| stops(touch, late)))
    }

    /// After a solve without rebounds from the velocities that `begun` gives: what carries nothing has been stopped before it arrives.
    pub(crate) fn note_stopped(&mut self, begun: impl Fn(usize) -> [f64; 6]) {
        for (i, touch) in self.touches.iter_mut().enumerate() {
            let changed = self.operator.floor(i) / FLOOR * touch.impulse[0];
            touch.stopped = changed <= NOTHING * touch.normal_rate(&begun).abs();
        }
    }

    /// True if something in the step just solved was stopped before it arrives.
    pub(crate) fn has_stopped(&self) -> bool {
        self.touches.iter().any(|touch| touch.stopped)
    }

    /// True if no impulses make the rebounds: friction wedges shapes between joints. They are then beyond [`WEDGED`] times all of
    /// the momentum, for a `mass` (kg), the rates that the step began with and a `fall` (m/s), and the regularisation gives way by
    /// more than the part [`JAMMED`] of the fastest rebound.
    pub(crate) fn jam(&self, mass: f64, fall: f64, begun: impl Fn(usize) -> [f64; 6]) -> bool {
        let (mut fastest, mut rate, mut gives, mut pressed) = (0.0_f64, fall, 0.0_f64, 0.0_f64);
        for (i, touch) in self.touches.iter().enumerate() {
            fastest = fastest.max(touch.rebound.unwrap_or(0.0));
            rate = touch
                .rates(&begun)
                .into_iter()
                .fold(rate, |most, u| most.max(u.abs()));
            let p = touch.impulse[0].abs();
            gives = gives.max(self.operator.floor(i) * p);
            pressed += p;
        }
        gives > JAMMED * fastest && pressed > WEDGED * mass * rate
    }

    /// The impulses are those of the step again.
    pub(crate) fn rest(&mut self) {
        for (touch, resting) in self.touches.iter_mut().zip(&self.resting) {
            touch.impulse = *resting;
        }
    }

    /// The impulses of the rebounds are `part` of what they were.
    pub(crate) fn lessen(&mut self, part: f64) {
        for touch in &mut self.touches {
            touch.impulse = touch.impulse.map(|p| p * part);
        }
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

/// p·u of impulses p at the rates u less their shift of this stage \[J].
fn along(touches: &[ContactPoint], rates: &[f64], stage: usize) -> f64 {
    let impulses = touches.iter().flat_map(|t| t.impulse);
    let shifts = touches.iter().flat_map(|t| t.shift[stage]);
    let instant = rates.iter().zip(shifts).map(|(u, shift)| u - shift);
    impulses.zip(instant).map(|(p, u)| p * u).sum()
}

/// a·b of three numbers.
fn dot3(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Energy that a blow may use.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Budget {
    /// Energy that the step's impulses have added, ≤ 0 where they have not \[J].
    spent: f64,
    /// Part of the blow's work between its own instant and that of the velocities \[J].
    shifted: f64,
}

impl Budget {
    /// The part of a change Δv of velocities that adds no more than was spent, for v·M Δv and Δv·M Δv as the bodies stand.
    pub(crate) fn part(&self, linear: f64, square: f64) -> f64 {
        if self.spent > 0.0 {
            return least_part(self.spent, linear - self.shifted, square);
        }
        largest_part(self.spent, linear - self.shifted, square)
    }
}

/// The largest θ ≤ 1 with spent + θ linear + ½ θ² square ≤ 0, where `spent` ≤ 0.
fn largest_part(spent: f64, linear: f64, square: f64) -> f64 {
    if spent + linear + 0.5 * square <= 0.0 || square <= 0.0 {
        return 1.0;
    }
    ((-linear + (linear * linear - 2.0 * square * spent).sqrt()) / square).clamp(0.0, 1.0)
}

/// The least θ ≤ 1 with the same ≤ 0, where `spent` > 0: the first root, in the form without cancellation; or the one with
/// the least of it.
fn least_part(spent: f64, linear: f64, square: f64) -> f64 {
    let below = linear * linear - 2.0 * square * spent;
    let part = if below >= 0.0 {
        2.0 * spent / (below.sqrt() - linear)
    } else {
        -linear / square
    };
    if part.is_finite() {
        part.clamp(0.0, 1.0)
    } else {
        1.0
    }
}
