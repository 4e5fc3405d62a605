//! Work of the drives in a sub-step, and of contacts that undo penetrations: the running sums that a balance of energy
//! judges.

use super::{Stage, Step};
use crate::active_set::RowState;
use crate::contact::ContactPoint;
use taut_model::Mobility;
use taut_model::linearized::{RowBounds, dot};

/// Steps that an excess has to last.
pub(crate) const LASTING: usize = 8;

/// Steps that it has to last for the next balance to begin with it.
const OWED: usize = 3;

/// Running sums of the balance.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Account {
    /// Energy before the first step, once there was one.
    pub(crate) start: Option<f64>,
    /// True of a balance that begins with the present sub-step, unless that closes it.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) opens: bool,
    /// Work up to the beginning of the last sub-step, and the work in it without that of the next
    /// forces.
    pub(crate) work: f64,
    pub(crate) pending: f64,
    /// Work of recovery, split likewise.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) recovery: [f64; 2],
    /// Rest of the deepest penetration of the start \[m].
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) overlap: f64,
    /// Half the drives' rates in the last sub-step \[m/s, rad/s], at which the next impulses act,
    /// and the last forces λ, one a row.
    pub(crate) open: Vec<f64>,
    pub(crate) lambda: Vec<f64>,
    /// Compliances of the bounded rows in the last sub-step \[m/N]; none before the first.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Vec::is_empty")
    )]
    pub(crate) compliance: Vec<f64>,
    /// Elastic energies of the bounded rows that were at a limit in the last sub-step, 0 of the others \[J].
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Vec::is_empty")
    )]
    pub(crate) strain: Vec<f64>,
    /// Excess in the last steps \[J], and that of the balance before.
    pub(crate) recent: [f64; LASTING],
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) owed: f64,
    /// Largest kinetic energy without excess, and largest work \[J].
    pub(crate) scale: f64,
    /// Weight times extent, and what makes motions too slow to be judged pass \[J].
    pub(crate) potential: f64,
}

impl Account {
    /// Numbers that are finite in a sound account, and the vectors with one number a row, or a bounded one, which are
    /// empty before the first step.
    pub(crate) fn numbers(&self) -> (impl Iterator<Item = &f64>, [&[f64]; 4]) {
        let sums = [
            &self.work,
            &self.pending,
            &self.owed,
            &self.overlap,
            &self.scale,
            &self.potential,
        ];
        (
            sums.into_iter().chain(&self.recovery).chain(&self.start),
            [&self.open, &self.lambda, &self.compliance, &self.strain],
        )
    }

    /// What a changed scene's balance begins with.
    pub(crate) fn left(&self) -> Self {
        let last = &self.recent[LASTING - OWED..];
        Self {
            recent: self.recent,
            owed: last.iter().copied().fold(f64::INFINITY, f64::min),
            ..Self::default()
        }
    }

    /// A new balance of so many rows, whose steps allocate nothing.
    pub(crate) fn begin(&mut self, rows: usize) {
        (self.open, self.lambda) = (vec![0.0; rows], vec![0.0; rows]);
    }

    /// Row `row` has given way by `paid` (m) under the `force` λ (N) of the last sub-step: in a step of the scheme under half
    /// of it, and half of the next.
    pub(crate) fn give(&mut self, row: usize, paid: f64, force: f64, stage: Stage) {
        let mut part = 1.0;
        if let Stage::Advanced {
            dt,
            implicit: false,
        } = stage
            && let Some(open) = self.open.get_mut(row)
        {
            part = 0.5;
            *open -= part * paid / dt;
        }
        self.pending += part * paid * force;
    }

    fn vectors(&mut self) -> [&mut Vec<f64>; 4] {
        [
            &mut self.open,
            &mut self.lambda,
            &mut self.compliance,
            &mut self.strain,
        ]
    }

    /// With the sums of `sums` and the vectors that it is lent, in the order of [`vectors`](Self::vectors).
    fn of(sums: &Self, [open, lambda, compliance, strain]: [Vec<f64>; 4]) -> Self {
        Self {
            open,
            lambda,
            compliance,
            strain,
            ..*sums
        }
    }

    /// Becomes a copy of `other`. Allocates only where this one has fewer rows.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        let mut own = self.vectors().map(std::mem::take);
        let [open, lambda, compliance, strain] = &mut own;
        open.clone_from(&other.open);
        lambda.clone_from(&other.lambda);
        compliance.clone_from(&other.compliance);
        strain.clone_from(&other.strain);
        *self = Self::of(other, own);
    }

    /// The next step begins a new balance.
    pub(crate) fn close(&mut self) {
        let mut own = self.vectors().map(std::mem::take);
        let [open, lambda, bounded @ ..] = &mut own;
        open.fill(0.0);
        lambda.fill(0.0);
        bounded.iter_mut().for_each(Vec::clear);
        *self = Self::of(&Self::default(), own);
    }
}

impl Step {
    /// A sub-step of `dt` is done, whose forces belong to its beginning or, where it is `implicit`, to its end: its work.
    pub(crate) fn account(&mut self, dt: f64, implicit: bool) {
        let [_, scratch] = &mut self.system.in_rows;
        let mut moved = std::mem::take(scratch);
        self.drives(dt, &mut moved);
        self.yielded(dt, &mut moved);
        let loads = self.work_of_loads(dt);
        let by_contacts = 0.5 * self.work_by_contacts();
        let recovery = 0.5 * self.work_of_recovery(dt);
        let wound = self.wound(dt) - self.strained();
        let account = &mut self.output.account;
        account.open.resize(self.multipliers.mu.len(), 0.0);
        account.lambda.resize(self.multipliers.mu.len(), 0.0);
        account.work += account.pending + by_contacts;
        account.pending = loads + by_contacts - wound;
        account.recovery[0] += account.recovery[1] + recovery;
        account.recovery[1] = recovery;
        let last = account.open.iter_mut().zip(&mut account.lambda);
        for ((mu, moved), (open, lambda)) in self.multipliers.mu.iter().zip(&moved).zip(last) {
            // An impulse acts at the mean of the rates before it and after it, however long their steps are; the force of an
            // implicit step over half its motion, and the force before it over the other half.
            let (force, half) = (mu / dt, 0.5 * moved);
            account.work -= *open * mu;
            if implicit {
                account.pending -= half * (force + *lambda);
            } else {
                account.pending -= half * force;
            }
            (*open, *lambda) = (if implicit { 0.0 } else { half / dt }, force);
        }
        if implicit {
            account.work += std::mem::take(&mut account.pending);
            account.recovery[0] += std::mem::take(&mut account.recovery[1]);
        }
        self.system.in_rows[1] = moved;
    }

    /// Strain energy ½ λ² Δε that ropes have gained by their lengths alone since the last sub-step \[J].
    fn wound(&mut self, dt: f64) -> f64 {
        let (rows, known) = (&self.system_data.rows, &mut self.output.account.compliance);
        let of = |bound: &RowBounds| rows.compliance[bound.row];
        if known.len() != rows.bounds.len() {
            known.clear();
            known.extend(rows.bounds.iter().map(of));
        }
        let mut wound = 0.0;
        for (bound, before) in rows.bounds.iter().zip(known) {
            let change = of(bound) - std::mem::replace(before, of(bound));
            if change != 0.0 {
                let force = self.multipliers.mu[bound.row] / dt;
                wound += 0.5 * change * force * force;
            }
        }
        wound
    }

    /// Elastic energy that motors and joints have gained while they were at their limits \[J]: the force there is that of the limit,
    /// whatever the stretch.
    fn strained(&mut self) -> f64 {
        let mut strain = std::mem::take(&mut self.output.account.strain);
        strain.resize(self.system_data.rows.bounds.len(), 0.0);
        let mut gained = 0.0;
        for (k, strain) in strain.iter_mut().enumerate() {
            let bound = self.system_data.rows.bounds[k];
            let is_drive = bound.side() == 0.0 && !self.is_winch(k);
            let is_at_limit = is_drive && self.active_set.place(k) != RowState::Inside;
            if is_at_limit || *strain > 0.0 {
                let now = self.stored(bound.constraint, bound.row);
                if *strain > 0.0 {
                    // A spring that lets go below its limit pays for that itself.
                    let least = if is_at_limit { f64::NEG_INFINITY } else { 0.0 };
                    gained += (now - *strain).max(least);
                }
                *strain = if is_at_limit { now } else { 0.0 };
            }
        }
        self.output.account.strain = strain;
        gained
    }

    /// Half of the present impulses bring the velocities to their own time at the last rates of the drives, or, with `sign` 1, back
    /// from it. Returns their work \[J].
    pub(crate) fn account_for_half(&mut self, sign: f64) -> f64 {
        let account = &mut self.output.account;
        let halves = account.open.iter().zip(&self.multipliers.mu[..]);
        let work = sign * halves.map(|(open, mu)| open * mu).sum::<f64>();
        account.work += work;
        work
    }

    /// The contacts' impulses are those of a blow after the sub-step: its work, with that of drives by the impulses of rows \[J].
    pub(super) fn account_for_blow(&mut self, by_rows: f64) {
        if self.options.energy_tolerance.is_some() {
            self.output.account.pending += self.work_by_contacts() + by_rows;
        }
    }

    /// Work of driven bodies and drives in a blow by the impulses `mu` of the rows \[J]. What a cable slips over its sheaves is no
    /// drive.
    pub(super) fn work_by_rows(&mut self, mu: &[f64]) -> f64 {
        let mut rates = std::mem::take(&mut self.system.in_rows[0]);
        self.drives(1.0, &mut rates);
        for (k, bound) in self.system_data.rows.bounds.iter().enumerate() {
            if self.slip.holds(k) {
                rates[bound.row] = 0.0;
            }
        }
        let work: f64 = rates.iter().zip(mu).map(|(rate, mu)| rate * mu).sum();
        self.system.in_rows[0] = rates;
        -work
    }

    /// Work of driven bodies by the contacts' impulses \[J].
    pub(super) fn work_by_contacts(&self) -> f64 {
        let bodies = &self.scene.bodies;
        let mut work = 0.0;
        for touch in &self.contacts.touches {
            for (k, p) in touch.impulse.iter().enumerate() {
                let driven = touch
                    .row(k)
                    .filter(|(i, _)| bodies.mobility[*i] == Mobility::Driven);
                work -= p * driven
                    .map(|(i, row)| dot(&row, &bodies.rates(i)))
                    .sum::<f64>();
            }
        }
        work
    }

    /// Work of the contacts' impulses in the last sub-step of `dt` that undo the penetrations of the start \[J].
    fn work_of_recovery(&mut self, dt: f64) -> f64 {
        let (account, touches) = (&mut self.output.account, &self.contacts.touches);
        let rate = |touch: &ContactPoint| match touch.impulse[0] {
            p if p > 0.0 => (-touch.offset - touch.softness * p).max(0.0),
            _ => 0.0,
        };
        let (mut deepest, mut fastest, mut work) = (0.0_f64, 0.0_f64, 0.0);
        for touch in touches {
            deepest = deepest.max(-touch.found.gap);
            fastest = fastest.max(rate(touch));
            work += touch.impulse[0] * rate(touch);
        }
        account.overlap = match account.start {
            None => deepest,
            Some(_) => account.overlap.min(deepest),
        };
        let undone = account.overlap.min(dt * fastest);
        account.overlap -= undone;
        if undone > 0.0 {
            work * undone / (dt * fastest)
        } else {
            0.0
        }
    }

    /// Into `moved` by how much driven bodies and ∂φ/∂t have changed the rows in the last sub-step of `dt`: dt (J_d v_d + ∂φ/∂t).
    fn drives(&self, dt: f64, moved: &mut [f64]) {
        let (bodies, rows) = (&self.scene.bodies, &self.system_data.rows);
        for (moved, phi_t) in moved.iter_mut().zip(&rows.phi_t) {
            *moved = dt * phi_t;
        }
        for (s, slot) in rows.slots.iter().enumerate() {
            if bodies.mobility[slot.body] == Mobility::Driven {
                let velocity = bodies.rates(slot.body);
                let moved = &mut moved[rows.row_range(slot.constraint)];
                for (moved, j) in moved.iter_mut().zip(rows.block(s).rows()) {
                    *moved += dt * dot(j, &velocity);
                }
            }
        }
    }

    /// From `moved` by how much motors and joints at their limits of force have yielded in the last sub-step of `dt`:
    /// dt (J v + ∂φ/∂t) of all bodies.
    fn yielded(&self, dt: f64, moved: &mut [f64]) {
        let (bodies, rows) = (&self.scene.bodies, &self.system_data.rows);
        for k in self.at_limits().filter(|k| !self.is_winch(*k)) {
            let bound = rows.bounds[k];
            let first = rows.row_range(bound.constraint).start;
            let moved = &mut moved[bound.row];
            *moved -= dt * rows.phi_t[bound.row];
            for s in rows.slot_range(bound.constraint) {
                let j = rows.block(s).rows()[bound.row - first];
                *moved -= dt * dot(&j, &bodies.rates(rows.slots[s].body));
            }
        }
    }

    /// Bounded rows at a limit of force, by their numbers among the bounds.
    fn at_limits(&self) -> impl Iterator<Item = usize> + '_ {
        let bounds = self
            .system_data
            .rows
            .bounds
            .iter()
            .zip(self.active_set.places());
        let at_limit = |(bound, place): (&RowBounds, RowState)| {
            place != RowState::Inside && self.multipliers.mu[bound.row] != 0.0
        };
        (0..)
            .zip(bounds)
            .filter_map(move |(k, of)| at_limit(of).then_some(k))
    }

    fn is_winch(&self, bound: usize) -> bool {
        let constraint = self.system_data.rows.bounds[bound].constraint;
        self.scene.constraints[constraint].winch().is_some()
    }

    /// Work of external loads, and of what drums at their limits of force held before, in the last sub-step of `dt` \[J].
    fn work_of_loads(&self, dt: f64) -> f64 {
        let (bodies, rows) = (&self.scene.bodies, &self.system_data.rows);
        let mut work = 0.0;
        for k in self.at_limits().filter(|k| self.is_winch(*k)) {
            // As the drum pays out it is credited with the work of all of that. What the rope was stretched by was no work
            // where no force tells it: before the first step, against a damper, as the gap of a rigid row.
            let row = rows.bounds[k].row;
            let last = self.output.account.lambda.get(row);
            let is_told = last.is_some_and(|last| *last != 0.0);
            let compliance = rows.compliance[row];
            if compliance == 0.0 || !is_told && rows.damping[row] == 0.0 {
                let kept = compliance * self.activation.spring_of_limit(rows, k, dt);
                let force = self.multipliers.mu[row] / dt;
                work -= force * (self.activation.begun(k) - kept).max(0.0);
            }
        }
        for i in self.scene.dynamic_bodies() {
            work += dt
                * (bodies.force[i].dot(&bodies.velocity[i])
                    + bodies.torque[i].dot(&bodies.angular_velocity[i]));
        }
        work
    }
}
