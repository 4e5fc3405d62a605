//! Rows with bounds, lo ≤ λ ≤ hi, over any backend.
//!
//! The step's rows are then a mixed linear complementarity problem in S: with w = b − S μ, each row has lo ≤ μ ≤ hi and
//! w = 0 inside, w ≤ 0 at lo, w ≥ 0 at hi. The rows without bounds and those that are inside theirs make a linear system; a
//! row at a bound is a known force and leaves the system: its part of J is set to zero and its impulse is added to Δt f.
//! Nothing else changes, neither the pattern nor the backend nor the residual of the refinement.
//!
//! Which rows are at a bound is found by block principal pivoting (Júdice and Pires, *A block principal pivoting
//! algorithm for large-scale strictly monotone linear complementarity problems*, 1994): all rows that are in the wrong
//! place change it at once, as long as that makes them fewer, and else one at a time (Murty 1974), which ends for every
//! positive definite S, if not always within the passes allowed here. The places are kept from step to step, so that one
//! solve a step is enough unless a row changes.

use crate::system_data::SystemData;
use taut_model::linearized::dot;
use taut_model::{BodyVectors, Linearized, RowBounds};

/// Solves of one system at most: what an inexact solver leaves undecided stays so.
const PASSES: usize = 64;

/// Times that all wrong rows change at once without getting fewer.
const TRIES: usize = 3;

/// A multiplier beyond its bound, or a rate of the wrong sign, is noise below this part of the largest multiplier.
const NOISE: f64 = 1e-11;

/// [`NOISE`] beside contacts, which are solved to fewer digits.
const NOISE_BESIDE_CONTACTS: f64 = 1e-9;

/// Σ over J M̃⁻¹ Jᵀ of drives with limits of force in a system that is singular without it: above the rounding of a pivot, and so small
/// that a motor that pulls against a taut rope exceeds its limit, and is then held at it.
const GIVES: f64 = 1e-9;

/// State of a row in the active set: between its bounds, or at one of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub(crate) enum RowState {
    Inside,
    Lower,
    Upper,
}

/// Result of checking the places of the bounded rows after a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All rows are in their right place.
    Settled,
    /// Some rows changed their place: solve again.
    Changed,
    /// Some rows are in the wrong place, and the passes are used up.
    NotConverged,
}

/// A bounded row: its place, and what it held of the system before it left.
#[derive(Debug, Clone, Copy)]
struct Row {
    place: RowState,
    /// c − J v and Σ.
    rate: f64,
    sigma: f64,
    /// First of its slots in [`ActiveSet::jacobian`].
    first: usize,
}

/// The bounded rows of a scene, in the order of [`taut_model::Linearized::bounds`].
#[derive(Debug, Clone, Default)]
pub(crate) struct ActiveSet {
    rows: Vec<Row>,
    /// The rows of J that left the system, one a slot.
    jacobian: Vec<[f64; 6]>,
    /// Δt f without the impulses of rows at bounds.
    impulse: BodyVectors,
    wrong: Vec<usize>,
    /// Rows that go slack and taut together: the parts of a cable over sheaves with friction.
    chains: Vec<Vec<usize>>,
    /// Rope left on each row's drum after the step \[m], infinite where no end matters, and the drums that empty within the step.
    room: Vec<f64>,
    /// By their bounds before.
    emptied: Vec<Option<f64>>,
    /// Rows at bounds stay there, while the accelerations of an instant are sought.
    pub(crate) frozen: bool,
    /// Fewest wrong rows of this system so far; tries and passes left.
    fewest: usize,
    tries: usize,
    passes: usize,
    /// Rows only come free: the passes are used up.
    closing: bool,
    /// True if contacts press in the system.
    presses: bool,
    /// True if drives with limits of force [give way](GIVES) in the system.
    gives_way: bool,
}

impl ActiveSet {
    pub(crate) fn new(system_data: &SystemData) -> Self {
        let mut bounded = Self::default();
        let mut first = 0;
        for bound in &system_data.rows.bounds {
            bounded.rows.push(Row {
                place: first_place(bound, system_data),
                rate: 0.0,
                sigma: 0.0,
                first,
            });
            first += system_data.rows.slot_range(bound.constraint).len();
        }
        bounded.jacobian = vec![[0.0; 6]; first];
        bounded.wrong = Vec::with_capacity(bounded.rows.len());
        bounded.room = vec![f64::INFINITY; bounded.rows.len()];
        bounded.emptied = vec![None; bounded.rows.len()];
        if !bounded.is_empty() {
            bounded.impulse = system_data.v.clone();
        }
        bounded
    }

    /// The rows of each of these chains go slack and taut together.
    pub(crate) fn join(&mut self, chains: Vec<Vec<usize>>) {
        self.chains = chains;
    }

    /// True if row `k` is held at a bound and so out of the system.
    pub(crate) fn holds(&self, k: usize) -> bool {
        self.rows[k].place != RowState::Inside
    }

    /// w = b − S μ of each bounded row, into its place in `w`.
    pub(crate) fn residuals(&self, system_data: &SystemData, mu: &[f64], w: &mut [f64]) {
        for (k, bound) in system_data.rows.bounds.iter().enumerate() {
            (w[bound.row], _) = residual(system_data, k, mu[bound.row]);
        }
    }

    /// Puts row `k` into its first place.
    pub(crate) fn start(&mut self, k: usize, system_data: &SystemData) {
        self.rows[k].place = first_place(&system_data.rows.bounds[k], system_data);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// RowState of each bounded row.
    pub(crate) fn places(&self) -> impl Iterator<Item = RowState> + '_ {
        self.rows.iter().map(|row| row.place)
    }

    /// The place of bounded row `k`.
    pub(crate) fn place(&self, k: usize) -> RowState {
        self.rows[k].place
    }

    /// Restores the [`places`](Self::places) of the bounded rows.
    pub(crate) fn put(&mut self, places: &[RowState]) {
        for (row, place) in self.rows.iter_mut().zip(places) {
            row.place = *place;
        }
    }

    /// Puts bounded row `k` where its violation φ has it, if it has an open side: closed for φ > 0 on that side.
    pub(crate) fn put_by_gap(&mut self, k: usize, bound: &RowBounds, phi: f64) {
        let open = if bound.side() > 0.0 {
            RowState::Upper
        } else {
            RowState::Lower
        };
        let place = &mut self.rows[k].place;
        *place = match bound.side() * phi {
            // One at its limit of force stays there.
            x if x > 0.0 && *place == open => RowState::Inside,
            x if x < 0.0 => open,
            _ => return,
        };
    }

    /// The bounded rows, by their numbers, that are at their lower bound.
    pub(crate) fn at_lower(&self) -> impl Iterator<Item = usize> + '_ {
        let places = self.places().enumerate();
        places.filter_map(|(k, place)| (place == RowState::Lower).then_some(k))
    }

    /// True if bounded row `k` is part of a cable over sheaves with friction, and its tension moves no body, or next to none beside
    /// another part: J M̃⁻¹ Jᵀ at most `part` of that part's.
    pub(crate) fn is_held(&self, system_data: &SystemData, k: usize, part: f64) -> bool {
        let Some(chain) = self.chains.iter().find(|chain| chain.contains(&k)) else {
            return false;
        };
        let own = response(system_data, k);
        chain
            .iter()
            .any(|other| *other != k && own <= part * response(system_data, *other))
    }

    /// No drum has an end.
    pub(crate) fn forget_room(&mut self) {
        self.room.fill(f64::INFINITY);
    }

    /// Rope left on drum `k` after what its winch pays out in the step \[m].
    pub(crate) fn leave_room(&mut self, k: usize, room: f64) {
        self.room[k] = room;
    }

    /// Numbers of the rows whose drums empty in the step.
    pub(crate) fn emptied(&self) -> impl Iterator<Item = usize> + '_ {
        let all = self.emptied.iter().enumerate();
        all.filter_map(|(k, emptied)| emptied.map(|_| k))
    }

    /// φ of the rows whose drums have emptied in the step, which know nothing yet of the rest of the rope.
    pub(crate) fn run_out(&self, rows: &mut Linearized) {
        for k in self.emptied() {
            rows.phi[rows.bounds[k].row] -= self.room[k];
        }
    }

    /// Empties drum `k` where its slip in the solved system of a step of `dt` exceeds the rope left on it: the row then holds any
    /// tension, driven by the rest of the rope. Returns true where it does.
    fn empty(&mut self, k: usize, system_data: &mut SystemData, dt: f64) -> bool {
        let (bound, room) = (system_data.rows.bounds[k], self.room[k]);
        if room == f64::INFINITY || self.emptied[k].is_some() {
            return false;
        }
        let r = bound.row;
        let rates = jacobian(system_data, k).map(|(body, j)| {
            let (v, dv) = (system_data.v.get(body), system_data.dv.get(body));
            dot(&j, &v) + dot(&j, &dv)
        });
        let rate = rates.sum::<f64>() + system_data.rows.phi_t[r];
        let stretch = -system_data.rows.compliance[r] * bound.lower;
        if system_data.rows.phi[r] + dt * rate - stretch <= room {
            return false;
        }
        self.emptied[k] = Some(bound.lower);
        system_data.rows.phi_t[r] -= room / dt;
        system_data.rate[r] += room / dt;
        system_data.rows.bounds[k].lower = f64::NEG_INFINITY;
        true
    }

    /// Before another solve of a system of a step of `dt`: its drums hold what they held before the last one.
    pub(crate) fn refill(&mut self, system_data: &mut SystemData, dt: f64) {
        for (k, emptied) in self.emptied.iter_mut().enumerate() {
            if let Some(lower) = emptied.take() {
                let bound = &mut system_data.rows.bounds[k];
                bound.lower = lower;
                system_data.rows.phi_t[bound.row] += self.room[k] / dt;
                system_data.rate[bound.row] -= self.room[k] / dt;
            }
        }
    }

    /// Before the first solve of a system.
    pub(crate) fn begin(&mut self, rows: &Linearized) {
        self.emptied.fill(None);
        (self.fewest, self.tries, self.passes) = (usize::MAX, TRIES, PASSES);
        (self.closing, self.gives_way) = (false, false);
        // What can have no force is in no system: two such rows of one body may be the same.
        for (row, bound) in self.rows.iter_mut().zip(&rows.bounds) {
            if row.place == RowState::Inside && bound.lower == bound.upper {
                row.place = RowState::Upper;
            }
        }
        self.unite_chains(rows);
    }

    /// Puts chains that are slack in part where the sum of their gaps has them: parts of a cable at its natural length are slack or
    /// taut by rounding, and slip passes no length on between a slack and a taut one.
    fn unite_chains(&mut self, system: &Linearized) {
        for chain in &self.chains {
            let is_at = |place| chain.iter().any(|k| self.rows[*k].place == place);
            if !(is_at(RowState::Upper) && is_at(RowState::Inside)) {
                continue;
            }
            let gaps = chain.iter().map(|k| system.phi[system.bounds[*k].row]);
            let place = match gaps.sum::<f64>() < 0.0 {
                true => RowState::Upper,
                false => RowState::Inside,
            };
            for k in chain {
                let own = &mut self.rows[*k].place;
                if *own != RowState::Lower {
                    *own = place;
                }
            }
        }
    }

    /// Drives with limits give way in this system from now on, which has failed. Returns false if they did, or if there are none.
    pub(crate) fn give_way(&mut self, bounds: &[RowBounds]) -> bool {
        let is_new = !self.gives_way && bounds.iter().any(is_limited);
        self.gives_way |= is_new;
        is_new
    }

    /// Takes the rows at bounds out of the system of a step `dt` long.
    pub(crate) fn hold(&mut self, system_data: &mut SystemData, dt: f64) {
        if self.is_empty() {
            return;
        }
        self.impulse.copy_from(&system_data.inertia.impulse);
        for (k, row) in self.rows.iter_mut().enumerate() {
            let bound = system_data.rows.bounds[k];
            let value = match row.place {
                RowState::Inside if self.gives_way && is_limited(&bound) => {
                    row.sigma = system_data.regularization.sigma[bound.row];
                    let sigma = GIVES * response(system_data, k);
                    system_data.regularization.sigma[bound.row] += sigma;
                    continue;
                }
                RowState::Inside => continue,
                RowState::Lower => bound.lower * dt,
                RowState::Upper => bound.upper * dt,
            };
            if value.is_infinite() {
                // The bound has been lifted since.
                row.place = RowState::Inside;
                continue;
            }
            let saved = &mut self.jacobian[row.first..];
            row.sigma = system_data.regularization.sigma[bound.row];
            row.rate = system_data.rate[bound.row];
            let size = row.sigma + response(system_data, k);
            for (s, saved) in system_data.rows.slot_range(bound.constraint).zip(saved) {
                let (body, from) = (system_data.rows.slots[s].body, entry(system_data, k, s));
                saved.copy_from_slice(&system_data.rows.jacobian[from..from + 6]);
                system_data.rows.jacobian[from..from + 6].fill(0.0);
                system_data.inertia.add_impulse(body, saved, value);
            }
            // Σ μ = c of about the row's own size in S, which no iteration then stumbles over.
            let size = if size > 0.0 { size } else { 1.0 };
            system_data.regularization.sigma[bound.row] = size;
            system_data.rate[bound.row] = size * value;
        }
    }

    /// Holds the rows inside their bounds that a blow with the impulses `blow` takes beyond them, after a step of `dt` (s) with
    /// the impulses `mu`: what pulls only never pushes in a blow, however much it pulls before. Returns true if there are any.
    pub(crate) fn let_go(
        &mut self,
        system_data: &SystemData,
        [mu, blow]: [&[f64]; 2],
        dt: f64,
    ) -> bool {
        let noise = NOISE * blow.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut any = false;
        for (row, bound) in self.rows.iter_mut().zip(&system_data.rows.bounds) {
            let (before, blow) = (mu[bound.row], blow[bound.row]);
            let left = |limit: f64| match limit {
                0.0 => 0.0,
                limit => limit * dt - before,
            };
            let place = match row.place {
                RowState::Inside if blow > left(bound.upper) + noise => RowState::Upper,
                RowState::Inside if blow < left(bound.lower) - noise => RowState::Lower,
                _ => continue,
            };
            (row.place, any) = (place, true);
        }
        any
    }

    /// Puts back what [`hold`](Self::hold) took.
    pub(crate) fn release(&self, system_data: &mut SystemData) {
        if !self.gives_way && self.places().all(|place| place == RowState::Inside) {
            return;
        }
        system_data.inertia.impulse.copy_from(&self.impulse);
        for (k, row) in self.rows.iter().enumerate() {
            let bound = system_data.rows.bounds[k];
            if row.place == RowState::Inside {
                if self.gives_way && is_limited(&bound) {
                    system_data.regularization.sigma[bound.row] = row.sigma;
                }
                continue;
            }
            let saved = &self.jacobian[row.first..];
            for (s, saved) in system_data.rows.slot_range(bound.constraint).zip(saved) {
                let to = entry(system_data, k, s);
                system_data.rows.jacobian[to..to + 6].copy_from_slice(saved);
            }
            system_data.regularization.sigma[bound.row] = row.sigma;
            system_data.rate[bound.row] = row.rate;
        }
    }

    /// Checks the places of all rows against the impulses `mu` of a step of `dt` (s), after
    /// [`release`](Self::release), and moves the rows that are wrong by more than noise, as it is beside `mu` and an impulse of
    /// `largest` (N s); a contact `presses` or none. `mu` then keeps its bounds to the last bit, but for those of drives that stay undecided.
    pub(crate) fn judge(
        &mut self,
        system_data: &mut SystemData,
        mu: &mut [f64],
        dt: f64,
        (presses, largest): (bool, f64),
    ) -> Outcome {
        if self.is_empty() {
            return Outcome::Settled;
        }
        self.presses = presses;
        let noise = if presses {
            NOISE_BESIDE_CONTACTS
        } else {
            NOISE
        };
        let limits = |k: usize, system_data: &SystemData| {
            let bound = system_data.rows.bounds[k];
            (bound.row, bound.lower * dt, bound.upper * dt)
        };
        for (k, row) in self.rows.iter().enumerate() {
            let (r, lower, upper) = limits(k, system_data);
            match row.place {
                RowState::Inside => {}
                RowState::Lower => mu[r] = lower,
                RowState::Upper => mu[r] = upper,
            }
        }
        if self.places().any(|place| place != RowState::Inside) {
            system_data.update_velocity_change(mu);
        }
        let noise = noise * mu.iter().fold(largest, |m, x| m.max(x.abs()));
        self.wrong.clear();
        if self.frozen {
            // A row that is taken out has no part in what contacts carry, as one that is cut off would.
            for (k, row) in self.rows.iter().enumerate() {
                let (r, lower, upper) = limits(k, system_data);
                let is_within = mu[r] >= lower - noise && mu[r] <= upper + noise;
                if row.place == RowState::Inside && !is_within {
                    self.wrong.push(k);
                }
            }
            return self.pivot(system_data, mu, dt);
        }
        for k in 0..self.rows.len() {
            if self.rows[k].place == RowState::Lower && self.empty(k, system_data, dt) {
                self.wrong.push(k);
            }
        }
        for (k, row) in self.rows.iter_mut().enumerate() {
            if self.emptied[k].is_some() && row.place == RowState::Lower {
                continue;
            }
            let (r, lower, upper) = limits(k, system_data);
            let wanted = match row.place {
                RowState::Inside if mu[r] < lower - noise => RowState::Lower,
                RowState::Inside if mu[r] > upper + noise => RowState::Upper,
                RowState::Inside => RowState::Inside,
                RowState::Lower | RowState::Upper if lower == upper => {
                    // A row without any force is held on the side that it would leave.
                    let (w, _) = residual(system_data, k, mu[r]);
                    row.place = if w < 0.0 {
                        RowState::Lower
                    } else {
                        RowState::Upper
                    };
                    row.place
                }
                held => {
                    let (w, size) = residual(system_data, k, mu[r]);
                    let inward = if held == RowState::Lower { w } else { -w };
                    if inward > noise * size {
                        RowState::Inside
                    } else {
                        held
                    }
                }
            };
            if wanted != row.place {
                self.wrong.push(k);
            }
        }
        self.judge_chains(system_data, mu, noise);
        self.pivot(system_data, mu, dt)
    }

    /// A chain is slack as a whole or not at all: its parts share their lengths, so that the sum of their residuals counts.
    fn judge_chains(&mut self, system_data: &SystemData, mu: &[f64], noise: f64) {
        let Self {
            rows,
            chains,
            wrong,
            ..
        } = self;
        let rows = &*rows;
        for chain in chains {
            let is_at = |place| move |k: &&usize| rows[**k].place == place;
            // A limit of its winch is a part's own.
            wrong.retain(|k| match rows[*k].place {
                _ if !chain.contains(k) => true,
                RowState::Lower => true,
                RowState::Inside => mu[system_data.rows.bounds[*k].row] <= 0.0,
                RowState::Upper => false,
            });
            let slack = chain.iter().filter(is_at(RowState::Upper));
            let (w, size) = slack.clone().fold((0.0, 0.0), |(sum, sizes), &k| {
                let (w, size) = residual(system_data, k, mu[system_data.rows.bounds[k].row]);
                (sum + w, sizes + size)
            });
            if slack.clone().count() > 0 {
                if -w > noise * size {
                    wrong.extend(slack);
                }
                continue;
            }
            let pushes = |k: &&usize| mu[system_data.rows.bounds[**k].row] > noise;
            let pulls = |k: &usize| mu[system_data.rows.bounds[*k].row] < -noise;
            if !chain.iter().any(pulls) && chain.iter().any(|k| pushes(&k)) {
                wrong.extend(chain.iter().filter(is_at(RowState::Inside)));
            }
        }
    }

    /// Beside contacts, which friction makes no complementarity problem of a definite matrix, the pivots may cycle. Motors and
    /// brakes at the wrong limit, which would spin a wheel up by τ Δt/I, then come free: their force may exceed it for a step.
    fn close(&mut self, system_data: &SystemData) {
        let bounds = &system_data.rows.bounds;
        let rows = &self.rows;
        self.wrong
            .retain(|k| drives(&bounds[*k]) && rows[*k].place != RowState::Inside);
        (self.closing, self.passes) = (true, self.passes.max(1));
    }

    fn pivot(&mut self, system_data: &mut SystemData, mu: &mut [f64], dt: f64) -> Outcome {
        let settled = self.wrong.is_empty();
        if !settled && self.passes == 0 || self.closing {
            self.close(system_data);
        }
        let verdict = match self.wrong.is_empty() {
            true if settled => Outcome::Settled,
            true => Outcome::NotConverged,
            false => Outcome::Changed,
        };
        if verdict != Outcome::Changed {
            for (row, bound) in self.rows.iter().zip(&system_data.rows.bounds) {
                let only = system_data.rows.row_range(bound.constraint).len() == 1;
                system_data.idle[bound.constraint] = only && row.place != RowState::Inside;
            }
            for bound in &system_data.rows.bounds {
                // Within the noise, or undecided. The contacts belong to the larger force of a drive that came free.
                if !(self.closing && drives(bound)) {
                    mu[bound.row] = mu[bound.row].clamp(bound.lower * dt, bound.upper * dt);
                }
            }
            return verdict;
        }
        self.passes -= 1;
        if self.wrong.len() < self.fewest {
            (self.fewest, self.tries) = (self.wrong.len(), TRIES);
        } else if self.tries > 0 {
            self.tries -= 1;
        } else if !self.closing {
            // Murty's rule: the last of them alone.
            let last = self.wrong[self.wrong.len() - 1];
            let with = self.chains.iter().find(|chain| chain.contains(&last));
            self.wrong
                .retain(|k| *k == last || with.is_some_and(|chain| chain.contains(k)));
        }
        for &k in &self.wrong {
            let bound = system_data.rows.bounds[k];
            let place = &mut self.rows[k].place;
            *place = match place {
                RowState::Inside if mu[bound.row] < bound.lower * dt => RowState::Lower,
                RowState::Inside => RowState::Upper,
                // A drum that slips as its load lands and rebounds: inside, the rope would keep the load from landing.
                RowState::Lower if self.presses && self.tries == 0 && bound.upper == 0.0 => {
                    RowState::Upper
                }
                RowState::Lower | RowState::Upper => RowState::Inside,
            };
        }
        Outcome::Changed
    }
}

/// True if a row may push and pull up to its limits, as a motor or a brake.
fn drives(bound: &RowBounds) -> bool {
    bound.lower < 0.0 && bound.upper > 0.0
}

/// True if a row pulls up to a limit, as a motor, a brake or a winch.
fn is_limited(bound: &RowBounds) -> bool {
    bound.lower < 0.0 && bound.lower > f64::NEG_INFINITY
}

/// First place of a row, before any solve: a cable that is too long is slack.
fn first_place(bound: &RowBounds, system_data: &SystemData) -> RowState {
    if bound.upper == 0.0 && system_data.rows.phi[bound.row] < 0.0 {
        RowState::Upper
    } else {
        RowState::Inside
    }
}

/// Start of the Jacobian of bounded row `k` for slot `s`.
fn entry(system_data: &SystemData, k: usize, s: usize) -> usize {
    let bound = &system_data.rows.bounds[k];
    let first = system_data.rows.row_range(bound.constraint).start;
    system_data.rows.slots[s].offset + 6 * (bound.row - first)
}

/// J of bounded row `k`, slot by slot, with the slot's body.
pub(crate) fn jacobian(
    system_data: &SystemData,
    k: usize,
) -> impl Iterator<Item = (usize, [f64; 6])> + '_ {
    let slots = system_data
        .rows
        .slot_range(system_data.rows.bounds[k].constraint);
    slots.map(move |s| {
        let mut j = [0.0; 6];
        let from = entry(system_data, k, s);
        j.copy_from_slice(&system_data.rows.jacobian[from..from + 6]);
        (system_data.rows.slots[s].body, j)
    })
}

/// J M̃⁻¹ Jᵀ of bounded row `k` alone \[1/kg].
pub(crate) fn response(system_data: &SystemData, k: usize) -> f64 {
    jacobian(system_data, k)
        .map(|(body, j)| response_of(system_data, body, &j))
        .sum()
}

/// J M̃⁻¹ Jᵀ of any row of a constraint alone \[1/kg].
pub(crate) fn response_of_row(system_data: &SystemData, constraint: usize, row: usize) -> f64 {
    let rows = &system_data.rows;
    let first = rows.row_range(constraint).start;
    let of = |s: usize| {
        let j = rows.block(s).rows()[row - first];
        response_of(system_data, rows.slots[s].body, &j)
    };
    rows.slot_range(constraint).map(of).sum()
}

/// The part of `body` in J M̃⁻¹ Jᵀ of a row whose Jacobian is `j` there.
pub(crate) fn response_of(system_data: &SystemData, body: usize, j: &[f64; 6]) -> f64 {
    let mut inverse = [0.0; 6];
    system_data.inertia.apply_inverse(body, j, &mut inverse);
    dot(&inverse, j)
}

/// w = (b − S μ) of bounded row `k` from the system's data, and S of the row alone.
fn residual(system_data: &SystemData, k: usize, mu: f64) -> (f64, f64) {
    let r = system_data.rows.bounds[k].row;
    let sigma = system_data.regularization.sigma[r];
    let moved = jacobian(system_data, k).map(|(body, j)| dot(&j, &system_data.dv.get(body)));
    let w = moved.fold(system_data.rate[r] - sigma * mu, |w, moved| w - moved);
    (w, sigma + response(system_data, k))
}
