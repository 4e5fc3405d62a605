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

use crate::pieces::Pieces;
use taut_model::linearized::dot;
use taut_model::{BodyVectors, RowBounds};

/// Solves of one system at most: what an inexact solver leaves undecided stays so.
const PASSES: usize = 64;

/// How often all wrong rows change at once without getting fewer.
const TRIES: usize = 3;

/// A multiplier beyond its bound, or a rate of the wrong sign, is noise below this part of the largest multiplier.
const NOISE: f64 = 1e-11;

/// Where a row's multiplier is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub(crate) enum Place {
    Inside,
    Lower,
    Upper,
}

/// What a system came to after a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// All rows are in their right place.
    Settled,
    /// Some changed theirs: solve again.
    Changed,
    /// Some are not, and the passes are used up.
    Undecided,
}

/// A bounded row: its place, and what it held of the system before it left.
#[derive(Debug, Clone, Copy)]
struct Row {
    place: Place,
    /// c − J v and Σ.
    rate: f64,
    sigma: f64,
    /// First of its slots in [`Bounded::jacobian`].
    first: usize,
}

/// The bounded rows of a scene, in the order of [`taut_model::Linearized::bounds`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Bounded {
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
    emptied: Vec<bool>,
    /// Whether all rows stay where they are: the accelerations of an instant are wanted.
    pub(crate) frozen: bool,
    /// Fewest wrong rows of this system yet, tries and passes left.
    fewest: usize,
    tries: usize,
    passes: usize,
}

impl Bounded {
    pub(crate) fn new(pieces: &Pieces) -> Self {
        let mut bounded = Self::default();
        let mut first = 0;
        for bound in &pieces.rows.bounds {
            bounded.rows.push(Row {
                place: first_place(bound, pieces),
                rate: 0.0,
                sigma: 0.0,
                first,
            });
            first += pieces.rows.slot_range(bound.constraint).len();
        }
        bounded.jacobian = vec![[0.0; 6]; first];
        bounded.wrong = Vec::with_capacity(bounded.rows.len());
        bounded.room = vec![f64::INFINITY; bounded.rows.len()];
        bounded.emptied = vec![false; bounded.rows.len()];
        if !bounded.is_empty() {
            bounded.impulse = pieces.v.clone();
        }
        bounded
    }

    /// The rows of each of these chains go slack and taut together.
    pub(crate) fn join(&mut self, chains: Vec<Vec<usize>>) {
        self.chains = chains;
    }

    /// Whether row `k` is held at a bound, out of the system.
    pub(crate) fn holds(&self, k: usize) -> bool {
        self.rows[k].place != Place::Inside
    }

    /// w = b − S μ of each bounded row, into its place in `w`.
    pub(crate) fn residuals(&self, pieces: &Pieces, mu: &[f64], w: &mut [f64]) {
        for (k, bound) in pieces.rows.bounds.iter().enumerate() {
            (w[bound.row], _) = residual(pieces, k, mu[bound.row]);
        }
    }

    /// Puts row `k` where it is to begin with.
    pub(crate) fn start(&mut self, k: usize, pieces: &Pieces) {
        self.rows[k].place = first_place(&pieces.rows.bounds[k], pieces);
    }

    /// Whether no row has bounds.
    pub(crate) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Where each bounded row is.
    pub(crate) fn places(&self) -> impl Iterator<Item = Place> + '_ {
        self.rows.iter().map(|row| row.place)
    }

    /// Puts each bounded row where [`places`](Self::places) said.
    pub(crate) fn put(&mut self, places: &[Place]) {
        for (row, place) in self.rows.iter_mut().zip(places) {
            row.place = *place;
        }
    }

    /// The bounded rows, by their numbers, that are at their lower bound.
    pub(crate) fn at_lower(&self) -> impl Iterator<Item = usize> + '_ {
        let places = self.places().enumerate();
        places.filter_map(|(k, place)| (place == Place::Lower).then_some(k))
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
        all.filter_map(|(k, emptied)| emptied.then_some(k))
    }

    /// Empties drum `k` where its slip in the solved system of a step of `dt` exceeds the rope left on it: the row then holds any
    /// tension, driven by the rest of the rope. Returns true where it does.
    fn empty(&mut self, k: usize, pieces: &mut Pieces, dt: f64) -> bool {
        let (bound, room) = (pieces.rows.bounds[k], self.room[k]);
        if room == f64::INFINITY || self.emptied[k] {
            return false;
        }
        let r = bound.row;
        let rates = jacobian(pieces, k).map(|(body, j)| {
            let (v, dv) = (pieces.v.get(body), pieces.dv.get(body));
            dot(&j, &v) + dot(&j, &dv)
        });
        let rate = rates.sum::<f64>() + pieces.rows.phi_t[r];
        let stretch = -pieces.rows.compliance[r] * bound.lower;
        if pieces.rows.phi[r] + dt * rate - stretch <= room {
            return false;
        }
        self.emptied[k] = true;
        pieces.rows.phi_t[r] -= room / dt;
        pieces.rate[r] += room / dt;
        pieces.rows.bounds[k].lower = f64::NEG_INFINITY;
        true
    }

    /// Before the first solve of a system.
    pub(crate) fn begin(&mut self) {
        self.emptied.fill(false);
        (self.fewest, self.tries, self.passes) = (usize::MAX, TRIES, PASSES);
    }

    /// Takes the rows at bounds out of the system of a step `dt` long.
    pub(crate) fn hold(&mut self, pieces: &mut Pieces, dt: f64) {
        if self.is_empty() {
            return;
        }
        self.impulse.copy_from(&pieces.inertia.impulse);
        for (k, row) in self.rows.iter_mut().enumerate() {
            let bound = pieces.rows.bounds[k];
            let value = match row.place {
                Place::Inside => continue,
                Place::Lower => bound.lower * dt,
                Place::Upper => bound.upper * dt,
            };
            if value.is_infinite() {
                // The bound has been lifted since.
                row.place = Place::Inside;
                continue;
            }
            let saved = &mut self.jacobian[row.first..];
            row.sigma = pieces.regularization.sigma[bound.row];
            row.rate = pieces.rate[bound.row];
            let size = row.sigma + response(pieces, k);
            for (s, saved) in pieces.rows.slot_range(bound.constraint).zip(saved) {
                let (body, from) = (pieces.rows.slots[s].body, entry(pieces, k, s));
                saved.copy_from_slice(&pieces.rows.jacobian[from..from + 6]);
                pieces.rows.jacobian[from..from + 6].fill(0.0);
                pieces.inertia.add_impulse(body, saved, value);
            }
            // Σ μ = c of about the row's own size in S, which no iteration then stumbles over.
            let size = if size > 0.0 { size } else { 1.0 };
            pieces.regularization.sigma[bound.row] = size;
            pieces.rate[bound.row] = size * value;
        }
    }

    /// Puts back what [`hold`](Self::hold) took.
    pub(crate) fn release(&self, pieces: &mut Pieces) {
        if self.places().all(|place| place == Place::Inside) {
            return;
        }
        pieces.inertia.impulse.copy_from(&self.impulse);
        for (k, row) in self.rows.iter().enumerate() {
            if row.place == Place::Inside {
                continue;
            }
            let bound = pieces.rows.bounds[k];
            let saved = &self.jacobian[row.first..];
            for (s, saved) in pieces.rows.slot_range(bound.constraint).zip(saved) {
                let to = entry(pieces, k, s);
                pieces.rows.jacobian[to..to + 6].copy_from_slice(saved);
            }
            pieces.regularization.sigma[bound.row] = row.sigma;
            pieces.rate[bound.row] = row.rate;
        }
    }

    /// Whether all rows are in their right place with the impulses `mu` of a step `dt` long, after
    /// [`release`](Self::release); moves those that are not. `mu` then keeps its bounds to the last bit.
    pub(crate) fn judge(&mut self, pieces: &mut Pieces, mu: &mut [f64], dt: f64) -> Verdict {
        if self.is_empty() {
            return Verdict::Settled;
        }
        let limits = |k: usize, pieces: &Pieces| {
            let bound = pieces.rows.bounds[k];
            (bound.row, bound.lower * dt, bound.upper * dt)
        };
        for (k, row) in self.rows.iter().enumerate() {
            let (r, lower, upper) = limits(k, pieces);
            match row.place {
                Place::Inside => {}
                Place::Lower => mu[r] = lower,
                Place::Upper => mu[r] = upper,
            }
        }
        if self.places().any(|place| place != Place::Inside) {
            pieces.update_velocity_change(mu);
        }
        let noise = NOISE * mu.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        self.wrong.clear();
        if self.frozen {
            return self.pivot(pieces, mu, dt);
        }
        for k in 0..self.rows.len() {
            if self.rows[k].place == Place::Lower && self.empty(k, pieces, dt) {
                self.wrong.push(k);
            }
        }
        for (k, row) in self.rows.iter_mut().enumerate() {
            if self.emptied[k] && row.place == Place::Lower {
                continue;
            }
            let (r, lower, upper) = limits(k, pieces);
            let wanted = match row.place {
                Place::Inside if mu[r] < lower - noise => Place::Lower,
                Place::Inside if mu[r] > upper + noise => Place::Upper,
                Place::Inside => Place::Inside,
                Place::Lower | Place::Upper if lower == upper => {
                    // A row without any force is held on the side that it would leave.
                    let (w, _) = residual(pieces, k, mu[r]);
                    row.place = if w < 0.0 { Place::Lower } else { Place::Upper };
                    row.place
                }
                held => {
                    let (w, size) = residual(pieces, k, mu[r]);
                    let inward = if held == Place::Lower { w } else { -w };
                    if inward > noise * size {
                        Place::Inside
                    } else {
                        held
                    }
                }
            };
            if wanted != row.place {
                self.wrong.push(k);
            }
        }
        self.judge_chains(pieces, mu, noise);
        self.pivot(pieces, mu, dt)
    }

    /// A chain is slack as a whole or not at all: its parts share their lengths, so that the sum of their residuals counts.
    fn judge_chains(&mut self, pieces: &Pieces, mu: &[f64], noise: f64) {
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
                Place::Lower => true,
                Place::Inside => mu[pieces.rows.bounds[*k].row] <= 0.0,
                Place::Upper => false,
            });
            let slack = chain.iter().filter(is_at(Place::Upper));
            let (w, size) = slack.clone().fold((0.0, 0.0), |(sum, sizes), &k| {
                let (w, size) = residual(pieces, k, mu[pieces.rows.bounds[k].row]);
                (sum + w, sizes + size)
            });
            if slack.clone().count() > 0 {
                if -w > noise * size {
                    wrong.extend(slack);
                }
                continue;
            }
            let pushes = |k: &&usize| mu[pieces.rows.bounds[**k].row] > noise;
            let pulls = |k: &usize| mu[pieces.rows.bounds[*k].row] < -noise;
            if !chain.iter().any(pulls) && chain.iter().any(|k| pushes(&k)) {
                wrong.extend(chain.iter().filter(is_at(Place::Inside)));
            }
        }
    }

    fn pivot(&mut self, pieces: &mut Pieces, mu: &mut [f64], dt: f64) -> Verdict {
        let verdict = match (self.wrong.len(), self.passes) {
            (0, _) => Verdict::Settled,
            (_, 0) => Verdict::Undecided,
            _ => Verdict::Changed,
        };
        if verdict != Verdict::Changed {
            for (row, bound) in self.rows.iter().zip(&pieces.rows.bounds) {
                let only = pieces.rows.row_range(bound.constraint).len() == 1;
                pieces.idle[bound.constraint] = only && row.place != Place::Inside;
            }
            for bound in &pieces.rows.bounds {
                // Within the noise, or undecided.
                mu[bound.row] = mu[bound.row].clamp(bound.lower * dt, bound.upper * dt);
            }
            return verdict;
        }
        self.passes -= 1;
        if self.wrong.len() < self.fewest {
            (self.fewest, self.tries) = (self.wrong.len(), TRIES);
        } else if self.tries > 0 {
            self.tries -= 1;
        } else {
            // Murty's rule: the last of them alone.
            let last = self.wrong[self.wrong.len() - 1];
            let with = self.chains.iter().find(|chain| chain.contains(&last));
            self.wrong
                .retain(|k| *k == last || with.is_some_and(|chain| chain.contains(k)));
        }
        for &k in &self.wrong {
            let bound = pieces.rows.bounds[k];
            let place = &mut self.rows[k].place;
            *place = match place {
                Place::Inside if mu[bound.row] < bound.lower * dt => Place::Lower,
                Place::Inside => Place::Upper,
                Place::Lower | Place::Upper => Place::Inside,
            };
        }
        Verdict::Changed
    }
}

/// Where a row is that has not been solved for: a cable that is too long is slack.
fn first_place(bound: &RowBounds, pieces: &Pieces) -> Place {
    if bound.upper == 0.0 && pieces.rows.phi[bound.row] < 0.0 {
        Place::Upper
    } else {
        Place::Inside
    }
}

/// Where the Jacobian of bounded row `k` starts for slot `s`.
fn entry(pieces: &Pieces, k: usize, s: usize) -> usize {
    let bound = &pieces.rows.bounds[k];
    let first = pieces.rows.row_range(bound.constraint).start;
    pieces.rows.slots[s].offset + 6 * (bound.row - first)
}

/// J of bounded row `k`, slot by slot, with the slot's body.
fn jacobian(pieces: &Pieces, k: usize) -> impl Iterator<Item = (usize, [f64; 6])> + '_ {
    let slots = pieces.rows.slot_range(pieces.rows.bounds[k].constraint);
    slots.map(move |s| {
        let mut j = [0.0; 6];
        let from = entry(pieces, k, s);
        j.copy_from_slice(&pieces.rows.jacobian[from..from + 6]);
        (pieces.rows.slots[s].body, j)
    })
}

/// J M̃⁻¹ Jᵀ of bounded row `k` alone \[1/kg].
pub(crate) fn response(pieces: &Pieces, k: usize) -> f64 {
    jacobian(pieces, k)
        .map(|(body, j)| response_of(pieces, body, &j))
        .sum()
}

/// J M̃⁻¹ Jᵀ of any row of a constraint alone \[1/kg].
pub(crate) fn response_of_row(pieces: &Pieces, constraint: usize, row: usize) -> f64 {
    let rows = &pieces.rows;
    let first = rows.row_range(constraint).start;
    let of = |s: usize| {
        let j = rows.block(s).rows()[row - first];
        response_of(pieces, rows.slots[s].body, &j)
    };
    rows.slot_range(constraint).map(of).sum()
}

/// The part of `body` in J M̃⁻¹ Jᵀ of a row whose Jacobian is `j` there.
pub(crate) fn response_of(pieces: &Pieces, body: usize, j: &[f64; 6]) -> f64 {
    let mut inverse = [0.0; 6];
    pieces.inertia.apply_inverse(body, j, &mut inverse);
    dot(&inverse, j)
}

/// w = (b − S μ) of bounded row `k` from the pieces, and S of the row alone.
fn residual(pieces: &Pieces, k: usize, mu: f64) -> (f64, f64) {
    let r = pieces.rows.bounds[k].row;
    let sigma = pieces.regularization.sigma[r];
    let moved = jacobian(pieces, k).map(|(body, j)| dot(&j, &pieces.dv.get(body)));
    let w = moved.fold(pieces.rate[r] - sigma * mu, |w, moved| w - moved);
    (w, sigma + response(pieces, k))
}
