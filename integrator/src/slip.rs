//! Cables that slip over sheaves with friction ([`taut_model::scene::reeving`]), over any backend.
//!
//! A slip rate s of a sheave acts as a drive of the two rows that meet there: with the matrix A of the step and B = ±1 on
//! the rows after and before it, A μ = b + B s. Where the cable sticks s = 0; where it slips T_out = k T_in for s > 0, and
//! T_in = k T_out for s < 0, two of μ in a row of C. Leaving out the sheaves that stick,
//!
//! ```text
//! μ = A⁻¹ b + Z s,   Z = A⁻¹ B,   (C Z) s = −C A⁻¹ b
//! ```
//!
//! The system of the step stays symmetric and its factor serves every pattern of sticking and slipping; what is not
//! symmetric is C Z, as large as the sheaves that slip, and is eliminated densely. A factor costs one more solve for each
//! sheave that is tried slipping, and one at the end. Merging the parts that slip into one row instead makes the sparse matrix itself unsymmetric, of another pattern
//! each time, for the LU backends alone.
//!
//! Patterns are found from the last one: sheaves beyond their cone slip, those that slip against their friction stick, all
//! at once, and one at a time where that does not end. Parts of one cable go slack together: where T_in = 0, T_out = 0 is
//! all that friction allows.

use crate::active_set::ActiveSet;
use crate::system_data::SystemData;
use taut_model::Scene;

/// Patterns tried with all wrong sheaves changed at once, and then one at a time.
const TOGETHER: usize = 20;
const SINGLY: usize = 60;

/// Largest μθ: e^(μθ) is still a number.
const LARGEST: f64 = 700.0;

/// A tension beyond its cone, or a rate against its friction, is noise below this part of the largest, of those that stick too.
const NOISE: f64 = 1e-11;

/// State of a cable on its sheave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Motion {
    #[default]
    Sticks,
    /// In the direction of travel: s > 0.
    Forwards,
    /// s < 0.
    Backwards,
}

/// A sheave with friction.
#[derive(Debug, Clone)]
struct Sheave {
    /// Rows of the parts before and after it, and their numbers among the bounded rows.
    rows: [usize; 2],
    bounds: [usize; 2],
    friction: f64,
    /// k = e^(μθ) of this step.
    capstan_ratio: f64,
    motion: Motion,
    /// Slip rate s \[m/s].
    rate: f64,
    /// Part of the slip rate that ∂φ/∂t of the two rows already has; correction added to their c −
    /// J v.
    applied: f64,
    added: [f64; 2],
    /// A⁻¹ B, one a row; `is_known` while it is that of the present factor.
    response: Vec<f64>,
    is_known: bool,
}

impl Sheave {
    /// The row of C: factors of the two multipliers.
    fn law(&self) -> [f64; 2] {
        match self.motion {
            Motion::Forwards => [-self.capstan_ratio, 1.0],
            Motion::Backwards => [-1.0, self.capstan_ratio],
            Motion::Sticks => [0.0; 2],
        }
    }

    fn misses(&self, mu: &[f64]) -> f64 {
        let ([a, b], [before, after]) = (self.law(), self.rows);
        a * mu[before] + b * mu[after]
    }
}

/// The sheaves with friction of a scene, in the order of [`Scene::capstans`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Slip {
    sheaves: Vec<Sheave>,
    /// True if there are sheaves with friction, or a cable may come to lie on one that it passes.
    pub(crate) may_change: bool,
    /// Sheaves that slip, by their numbers.
    slipping: Vec<usize>,
    /// Set where a sheave begins or ceases to slip, or turns its sense, until W is built for it.
    pub(crate) has_changed: bool,
    /// Largest impulse of the parts \[N s], slipping or all sticking: without tension, as beyond released brakes, what is left is
    /// rounding of what would stick.
    pub(crate) largest: f64,
    /// Set where the last solve found no pattern of slip.
    pub(crate) undecided: bool,
    /// Dense system of their rates, row-major; each row ends with its right-hand side.
    dense: Vec<f64>,
    /// B of the sheave whose response is sought, one a row.
    pub(crate) column: Vec<f64>,
}

impl Slip {
    pub(crate) fn new(scene: &Scene, system_data: &SystemData) -> Self {
        let rows = &system_data.rows;
        let bound = |c: usize| rows.bounds.binary_search_by_key(&c, |b| b.constraint);
        let sheave = |capstan: &taut_model::Capstan| Sheave {
            rows: capstan.parts.map(|c| rows.row_range(c).start),
            // A part cannot push: its row has bounds.
            bounds: capstan.parts.map(|c| bound(c).unwrap_or_default()),
            friction: capstan.friction,
            capstan_ratio: 1.0,
            motion: Motion::Sticks,
            rate: 0.0,
            applied: 0.0,
            added: [0.0; 2],
            response: vec![0.0; rows.rows()],
            is_known: false,
        };
        let sheaves: Vec<_> = scene.capstans.iter().map(sheave).collect();
        let count = sheaves.len();
        Self {
            may_change: scene.has_rough_sheaves(),
            slipping: Vec::with_capacity(count),
            has_changed: false,
            largest: 0.0,
            undecided: false,
            dense: vec![0.0; count * (count + 1)],
            column: vec![0.0; if count > 0 { rows.rows() } else { 0 }],
            sheaves,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.sheaves.is_empty()
    }

    /// Returns true if bounded row `k` is a part of a cable that friction may hold.
    pub(crate) fn holds(&self, k: usize) -> bool {
        self.sheaves.iter().any(|s| s.bounds.contains(&k))
    }

    /// Numbers of the bounded rows that are parts of a cable beside a sheave that it slips over.
    pub(crate) fn giving(&self) -> impl Iterator<Item = usize> + '_ {
        let slips = |s: &&Sheave| s.motion != Motion::Sticks;
        self.sheaves.iter().filter(slips).flat_map(|s| s.bounds)
    }

    /// Number of sheaves over which a cable slips.
    pub(crate) fn count(&self) -> usize {
        self.sheaves.iter().filter(|s| s.rate != 0.0).count()
    }

    /// Rate at which the cable slips over each sheave, in the direction of travel \[m/s].
    pub(crate) fn rates(&self) -> impl Iterator<Item = f64> + '_ {
        self.sheaves.iter().map(|sheave| sheave.rate)
    }

    /// Sense of the slip at each sheave: 1, 0 or −1.
    pub(crate) fn motions(&self) -> impl Iterator<Item = i8> + '_ {
        let sign = |sheave: &Sheave| match sheave.motion {
            Motion::Sticks => 0,
            Motion::Forwards => 1,
            Motion::Backwards => -1,
        };
        self.sheaves.iter().map(sign)
    }

    /// Restores the senses of [`motions`](Self::motions).
    pub(crate) fn put(&mut self, motions: &[i8]) {
        for (sheave, sign) in self.sheaves.iter_mut().zip(motions) {
            sheave.motion = match sign {
                0 => Motion::Sticks,
                1.. => Motion::Forwards,
                _ => Motion::Backwards,
            };
        }
    }

    /// ActiveSet rows that go slack together: those of one cable.
    pub(crate) fn chains(&self) -> Vec<Vec<usize>> {
        let mut chains: Vec<Vec<usize>> = Vec::new();
        for sheave in &self.sheaves {
            let mut joined = sheave.bounds.to_vec();
            chains.retain(|chain| {
                let meets = chain.iter().any(|k| sheave.bounds.contains(k));
                if meets {
                    joined.extend(chain);
                }
                !meets
            });
            joined.sort_unstable();
            joined.dedup();
            chains.push(joined);
        }
        chains
    }

    /// k of the present wraps.
    pub(crate) fn update_ratios(&mut self, scene: &Scene) {
        for (i, sheave) in self.sheaves.iter_mut().enumerate() {
            let turned = sheave.friction * scene.wrap(i);
            sheave.capstan_ratio = turned.clamp(0.0, LARGEST).exp();
        }
    }

    /// The drives and c − J v are those without any slip.
    pub(crate) fn forget(&mut self) {
        for sheave in &mut self.sheaves {
            (sheave.rate, sheave.applied, sheave.added) = (0.0, 0.0, [0.0; 2]);
        }
    }

    /// Takes the slip out of the drives and, where c − J v is still that of the last solve, out of it.
    pub(crate) fn take_out(&mut self, system_data: &mut SystemData) {
        for sheave in &mut self.sheaves {
            let driven = [-sheave.applied, sheave.applied];
            for ((row, driven), added) in sheave.rows.into_iter().zip(driven).zip(sheave.added) {
                system_data.rows.phi_t[row] += driven;
                system_data.rate[row] -= added;
            }
        }
        self.forget();
    }

    /// The drives hold the slip.
    pub(crate) fn drive(&mut self, system_data: &mut SystemData) {
        for sheave in &mut self.sheaves {
            let more = sheave.rate - std::mem::replace(&mut sheave.applied, sheave.rate);
            let [before, after] = sheave.rows;
            system_data.rows.phi_t[before] += more;
            system_data.rows.phi_t[after] -= more;
        }
    }

    /// The drives hold the slip, and so does c − J v of the rows that are not held at a bound.
    pub(crate) fn apply(&mut self, system_data: &mut SystemData, bounded: &ActiveSet) {
        self.drive(system_data);
        self.add(system_data, |k| !bounded.holds(k));
    }

    /// Adds the slip to c − J v of the bounded rows that `are_in` it, where it is not there yet.
    fn add(&mut self, system_data: &mut SystemData, are_in: impl Fn(usize) -> bool) {
        for sheave in &mut self.sheaves {
            for (k, sign) in [-1.0, 1.0].into_iter().enumerate() {
                if sheave.added[k] == 0.0 && are_in(sheave.bounds[k]) {
                    sheave.added[k] = sign * sheave.rate;
                    system_data.rate[sheave.rows[k]] += sheave.added[k];
                }
            }
        }
    }

    /// The rows that were held are back in the system's data, without the slip.
    pub(crate) fn release(&mut self, system_data: &mut SystemData) {
        self.drive(system_data);
        self.add(system_data, |_| true);
    }

    /// After a factorisation: nothing is known of A⁻¹.
    pub(crate) fn begin(&mut self) {
        for sheave in &mut self.sheaves {
            sheave.is_known = false;
        }
    }

    /// The first sheave that slips and whose response A⁻¹ B is not known, with B.
    pub(crate) fn wanted(&mut self, bounded: &ActiveSet) -> Option<(usize, &[f64])> {
        let of = |s: &Sheave| s.motion != Motion::Sticks && !s.is_known;
        let i = self.sheaves.iter().position(of)?;
        let Sheave { rows, bounds, .. } = self.sheaves[i];
        self.column.fill(0.0);
        for ((row, bound), b) in rows.into_iter().zip(bounds).zip([-1.0, 1.0]) {
            if !bounded.holds(bound) {
                self.column[row] = b;
            }
        }
        Some((i, &self.column))
    }

    /// A⁻¹ B of sheave number `i`.
    pub(crate) fn learn(&mut self, i: usize, response: &[f64]) {
        let sheave = &mut self.sheaves[i];
        sheave.response.copy_from_slice(response);
        sheave.is_known = true;
    }

    /// True if any sheave slips.
    pub(crate) fn slips(&self) -> bool {
        !self.slipping.is_empty()
    }

    /// Corrects the rates of the sheaves that slip so that μ obeys their law, and μ with them. False where no rates do.
    pub(crate) fn correct(&mut self, mu: &mut [f64]) -> bool {
        let solved = self.obey(mu);
        if solved {
            let width = self.slipping.len() + 1;
            for (row, &i) in self.dense.chunks_exact(width).zip(&self.slipping) {
                self.sheaves[i].rate += row[width - 1];
            }
        }
        solved
    }

    /// μ = A⁻¹ b becomes the one with the sheaves that slip; their further rates end the rows of the dense system. False
    /// where no rates do.
    pub(crate) fn obey(&mut self, mu: &mut [f64]) -> bool {
        let Self {
            sheaves,
            slipping,
            dense,
            ..
        } = self;
        let (count, width) = (slipping.len(), slipping.len() + 1);
        for (r, &i) in slipping.iter().enumerate() {
            for (c, &j) in slipping.iter().enumerate() {
                dense[r * width + c] = sheaves[i].misses(&sheaves[j].response);
            }
            dense[r * width + count] = -sheaves[i].misses(mu);
        }
        if !eliminate(dense, count) {
            return false;
        }
        for (r, &i) in slipping.iter().enumerate() {
            let change = dense[r * width + count];
            for (mu, z) in mu.iter_mut().zip(&sheaves[i].response) {
                *mu += change * z;
            }
        }
        true
    }

    /// Pattern number `pass`: rates from the multipliers `stuck` of none, which `mu` becomes those of. Whether the pattern
    /// stays; the next one is chosen where it does not, none after the last. `speed` is a size of the rates of the rows.
    pub(crate) fn settle(
        &mut self,
        stuck: &[f64],
        mu: &mut [f64],
        speed: f64,
        pass: usize,
    ) -> Option<bool> {
        if pass >= TOGETHER + SINGLY {
            return None;
        }
        let singly = pass >= TOGETHER;
        mu.copy_from_slice(stuck);
        self.sheaves.iter_mut().for_each(|s| s.rate = 0.0);
        self.slipping.clear();
        let slips = |s: &Sheave| s.motion != Motion::Sticks;
        let numbers = (0..self.sheaves.len()).filter(|&i| slips(&self.sheaves[i]));
        self.slipping.extend(numbers);
        if !self.correct(mu) {
            // Nothing resists: the cable does not slip where it may.
            self.sheaves
                .iter_mut()
                .for_each(|s| s.motion = Motion::Sticks);
            return Some(false);
        }
        let rows = self.sheaves.iter().flat_map(|s| s.rows);
        self.largest = rows.fold(0.0, |m, r| m.max(mu[r].abs()).max(stuck[r].abs()));
        let noise = NOISE * self.largest;
        let mut settled = true;
        for sheave in self.sheaves.iter_mut().rev() {
            let [t_in, t_out] = sheave.rows.map(|r| -mu[r]);
            let next = match sheave.motion {
                // Without tension on either side the cable is slack: friction has nothing to hold.
                Motion::Sticks if t_in.max(t_out) <= noise => Motion::Sticks,
                Motion::Sticks if t_out > sheave.capstan_ratio * t_in + noise => Motion::Forwards,
                Motion::Sticks if t_in > sheave.capstan_ratio * t_out + noise => Motion::Backwards,
                Motion::Forwards if sheave.rate < -NOISE * speed => Motion::Sticks,
                Motion::Backwards if sheave.rate > NOISE * speed => Motion::Sticks,
                same => same,
            };
            if next != sheave.motion && (settled || !singly) {
                (sheave.motion, settled) = (next, false);
                self.has_changed = true;
            }
        }
        Some(settled)
    }

    /// Rates of a slack cable, the least with which no part is short while another hangs: `w` are the rows' residuals, which
    /// are ≥ 0 of what is slack.
    pub(crate) fn share_slack(&mut self, w: &mut [f64], bounded: &ActiveSet) {
        let slack = |s: &Sheave| s.bounds.iter().all(|b| bounded.holds(*b));
        let mut give = |sheave: &mut Sheave, from: usize, sign: f64| {
            let short = w[sheave.rows[from]].min(0.0);
            sheave.rate += sign * short;
            w[sheave.rows[from]] -= short;
            w[sheave.rows[1 - from]] += short;
        };
        for sheave in self.sheaves.iter_mut().filter(|s| slack(s)) {
            give(sheave, 0, 1.0);
        }
        for sheave in self.sheaves.iter_mut().rev().filter(|s| slack(s)) {
            give(sheave, 1, -1.0);
        }
    }

    /// Moves the rope that slips in `dt` up to the time `end` (s) from one part to the next.
    pub(crate) fn move_lengths(&self, scene: &mut Scene, dt: f64, end: f64) {
        for (i, sheave) in self.sheaves.iter().enumerate() {
            if sheave.rate != 0.0 {
                scene.slip(i, dt * sheave.rate, end);
            }
        }
    }
}

/// Solves a dense system of `count` rows, each with its right-hand side at the end, in place by elimination with row
/// pivots. False where it is singular.
fn eliminate(rows: &mut [f64], count: usize) -> bool {
    let width = count + 1;
    for k in 0..count {
        let size = |r: &usize| rows[r * width + k].abs();
        let Some(pivot) = (k..count).max_by(|a, b| size(a).total_cmp(&size(b))) else {
            return false;
        };
        if size(&pivot) == 0.0 || size(&pivot).is_nan() {
            return false;
        }
        for c in 0..width {
            rows.swap(k * width + c, pivot * width + c);
        }
        let inverse = 1.0 / rows[k * width + k];
        for r in (0..count).filter(|r| *r != k) {
            let factor = rows[r * width + k] * inverse;
            for c in k..width {
                rows[r * width + c] -= factor * rows[k * width + c];
            }
        }
    }
    for r in 0..count {
        rows[r * width + count] /= rows[r * width + r];
    }
    true
}

#[cfg(test)]
pub(crate) mod tests;
#[cfg(test)]
mod tests_energy;
#[cfg(test)]
mod tests_lifting;
