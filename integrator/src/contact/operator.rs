//! The contacts' dense operator W = H M̃⁻¹ Hᵀ − G S⁻¹ Gᵀ + diag σ, from the factor of the joints' system.
//!
//! Only active contacts have rows here: those that carry an impulse or would be passed through without one. The others are
//! looked at after each solution, and become active where they have to.
//!
//! Rows on bodies without joints have no G and cost no solve. Each group of contacts is a dense problem of its own: see
//! [`super::groups`]; those of a split island are solved in turn: [`super::sweeps`].

use super::groups::Groups;
use super::sweeps::Split;
use super::through::{Columns, Through};
use super::{CARRIERS, ContactBody, ContactPoint, FLOOR};
use crate::effort::Effort;
use crate::response::Factor;
use crate::system_data::SystemData;
use std::ops::Range;
use taut_model::linearized::dot;
use taut_model::{Linearized, Scene};
use taut_solver::coulomb::{ConeMethod, ConeReport, ConeSolver, Contacts as Problem};
use taut_solver::{SolveError, SolveReport};

/// Multiplications that a dense problem is worth: some tenths of a second. Of 893 hard problems of a pile at a mass ratio of
/// 10⁵ they leave 23 unsolved, and ten times as many 19.
const WORK: f64 = 5e9;

/// Violation of the conditions, over the largest rate, above which an island is softened. A smaller one does less harm than
/// softer contacts.
const CLOSE: f64 = 1e-4;

/// Factor by which an island is softened at a time, and number of times at most.
const SOFTER: (f64, usize) = (100.0, 3);

/// W over its part without joints below which it is rounding: the joints hold the bodies against each other.
const HELD: f64 = 1e-10;

/// Least regularisation over W without joints, where these leave none.
const LEAST: f64 = 1e-13;

/// A row of H on one body, times M̃⁻¹.
type Moved = Option<(usize, [f64; 6])>;

/// W of all contacts, group by group, and the dense problem's vectors.
#[derive(Default)]
pub(crate) struct Operator {
    pub(crate) groups: Groups,
    /// G row by row, and M̃⁻¹ hᵀ body by body.
    pub(super) columns: Columns,
    pub(super) moved: Vec<[Moved; CARRIERS]>,
    /// W of each group, one after the other, and where each begins.
    w: Vec<f64>,
    blocks: Vec<usize>,
    /// q, p, μ_f and the regularisation of a group.
    rates: Vec<f64>,
    pub(super) impulses: Vec<f64>,
    friction: Vec<f64>,
    regularization: Vec<f64>,
    /// Regularisation, mean of W of each contact's own rows, and W of its normal row without joints, in the order of the
    /// contacts.
    floor: Vec<f64>,
    own: Vec<f64>,
    direct: Vec<f64>,
    /// Workspace of − G S⁻¹ Gᵀ.
    pub(super) through: Through,
    /// −W p of all contacts.
    pub(super) moved_rates: Vec<f64>,
    solver: ConeSolver,
    /// Workspace of islands of several groups.
    pub(super) split: Split,
}

impl Operator {
    pub(crate) fn new(scene: &Scene, rows: &Linearized) -> Self {
        Self {
            groups: Groups::new(scene, rows),
            solver: ConeSolver::limited(WORK),
            ..Self::default()
        }
    }

    /// G and M̃⁻¹ Hᵀ.
    fn couple(&mut self, system_data: &SystemData, touches: &[ContactPoint]) {
        let inertia = &system_data.inertia;
        self.columns.clear();
        self.moved.clear();
        for &i in &self.groups.order {
            for k in 0..3 {
                let mut moved = [None; CARRIERS];
                for (to, (body, row)) in moved.iter_mut().zip(touches[i].row(k)) {
                    if inertia.is_immovable(body) {
                        continue;
                    }
                    let mut inverse = [0.0; 6];
                    inertia.apply_inverse(body, &row, &mut inverse);
                    *to = Some((body, inverse));
                    let slots = &self.groups.slots[body];
                    self.columns.extend(system_data, slots, &inverse);
                }
                self.columns.end();
                self.moved.push(moved);
            }
        }
    }

    /// W of the system's data, whose joints have this factor, after [`Groups::divide`].
    pub(crate) fn build(
        &mut self,
        system_data: &SystemData,
        touches: &mut [ContactPoint],
        factor: &mut Factor<'_>,
    ) -> Result<SolveReport, SolveError> {
        self.couple(system_data, touches);
        self.floor.clear();
        self.floor.resize(touches.len(), 0.0);
        self.own.resize(touches.len(), 1.0);
        self.direct.resize(touches.len(), 0.0);
        self.blocks.clear();
        let mut total = 0;
        for k in 0..self.groups.count() {
            self.blocks.push(total);
            total += 9 * self.groups.members(k).len().pow(2);
        }
        self.w.clear();
        self.w.resize(total, 0.0);
        let mut report = SolveReport::DIRECT;
        let (groups, mut w) = (
            std::mem::take(&mut self.groups),
            std::mem::take(&mut self.w),
        );
        let mut done = Ok(());
        for k in 0..groups.count() {
            if factor.effort.ends() {
                break;
            }
            let (members, first) = (groups.members(k), self.blocks[k]);
            let block = &mut w[first..first + 9 * members.len().pow(2)];
            self.touch_directly(members, &groups.order, touches, block);
            self.keep_direct(members, &groups.order, block);
            let (of, at) = ((members, &groups.order[..]), (system_data, &*touches));
            match self.touch_through_joints(of, at, factor, block, &groups.slots) {
                Ok(of) => report = report.and(of),
                Err(e) => done = Err(e),
            }
            self.regularize(members, &groups.order, touches, block);
        }
        (self.groups, self.w) = (groups, w);
        done.map(|()| report)
    }

    /// H M̃⁻¹ Hᵀ of a group.
    fn touch_directly(
        &self,
        members: &[usize],
        order: &[usize],
        touches: &[ContactPoint],
        w: &mut [f64],
    ) {
        let n = 3 * members.len();
        for (a, i) in members.iter().enumerate() {
            let touch = &touches[order[*i]];
            for (b, j) in members.iter().enumerate().take(a + 1) {
                let shares =
                    |of: &ContactBody| touch.carriers().iter().any(|own| own.body == of.body);
                if !touches[order[*j]].carriers().iter().any(shares) {
                    continue;
                }
                for l in 0..3 {
                    let moved = &self.moved[3 * j + l];
                    for k in 0..3 {
                        let mut sum = 0.0;
                        for (body, row) in touch.row(k) {
                            let of = moved.iter().flatten().filter(|(other, _)| *other == body);
                            sum += of.map(|(_, moved)| dot(&row, moved)).sum::<f64>();
                        }
                        w[(3 * a + k) * n + 3 * b + l] = sum;
                        w[(3 * b + l) * n + 3 * a + k] = sum;
                    }
                }
            }
        }
    }

    /// Keeps the normal part of H M̃⁻¹ Hᵀ of a group.
    fn keep_direct(&mut self, members: &[usize], order: &[usize], w: &[f64]) {
        let n = 3 * members.len();
        for (a, place) in members.iter().enumerate() {
            self.direct[order[*place]] = w[3 * a * (n + 1)];
        }
    }

    /// + diag σ of a group.
    fn regularize(
        &mut self,
        members: &[usize],
        order: &[usize],
        touches: &mut [ContactPoint],
        w: &mut [f64],
    ) {
        let n = 3 * members.len();
        for (a, place) in members.iter().enumerate() {
            let (i, at) = (order[*place], |k: usize| (3 * a + k) * (n + 1));
            let (own, direct) = ((w[at(0)] + w[at(1)] + w[at(2)]) / 3.0, self.direct[i]);
            if w[at(0)] <= HELD * direct {
                touches[i].soften();
            }
            self.own[i] = own;
            let floor = (FLOOR * own).max(LEAST * direct);
            self.floor[i] = floor.max(f64::MIN_POSITIVE);
            for (k, sigma) in self.sigma(i, touches).into_iter().enumerate() {
                w[at(k)] += sigma;
            }
        }
    }

    /// σ of the rows of contact `i`.
    pub(super) fn sigma(&self, i: usize, touches: &[ContactPoint]) -> [f64; 3] {
        let floor = self.floor[i];
        [floor + touches[i].softness, floor, floor]
    }

    /// Adds σ p of each contact, which [`super::Contacts::rates`] leave out.
    pub(crate) fn add_regularization(&self, touches: &[ContactPoint], rates: &mut [f64]) {
        for &i in &self.groups.order {
            for (k, sigma) in self.sigma(i, touches).into_iter().enumerate() {
                rates[3 * i + k] += sigma * touches[i].impulse[k];
            }
        }
    }

    /// σ of contact `i` without its compliance \[1/kg]; 0 where it is not active.
    pub(crate) fn floor(&self, i: usize) -> f64 {
        self.floor.get(i).copied().unwrap_or(0.0)
    }

    /// p·W p of the contacts' impulses \[J].
    pub(crate) fn energy(
        &mut self,
        touches: &[ContactPoint],
        factor: &mut Factor<'_>,
    ) -> Result<f64, SolveError> {
        let mut moved = std::mem::take(&mut self.moved_rates);
        moved.clear();
        moved.resize(3 * touches.len(), 0.0);
        self.take_away(touches, &mut moved, factor)?;
        let impulses = touches.iter().flat_map(|touch| touch.impulse);
        let energy = -impulses.zip(&moved).map(|(p, u)| p * u).sum::<f64>();
        self.moved_rates = moved;
        Ok(energy)
    }

    /// Mean of W of contact `i`'s own rows \[1/kg].
    pub(crate) fn weight(&self, i: usize) -> f64 {
        self.own.get(i).copied().unwrap_or(1.0)
    }

    /// Range of W that belongs to group `k`.
    fn block(&self, k: usize) -> Range<usize> {
        let first = self.blocks[k];
        first..first + 9 * self.groups.members(k).len().pow(2)
    }

    /// q = u − W p of all contacts for their rates u, in place.
    pub(crate) fn take_away(
        &mut self,
        touches: &[ContactPoint],
        rates: &mut [f64],
        factor: &mut Factor<'_>,
    ) -> Result<(), SolveError> {
        for k in 0..self.groups.islands.len() {
            let island = self.groups.islands[k].clone();
            if island.is_split() {
                self.add_response_of_all(&island, -1.0, touches, rates, factor)?;
            } else {
                self.take_group_away(island.groups.start, touches, rates);
            }
        }
        Ok(())
    }

    /// q = u − W p of a group for its rates u, in place.
    pub(super) fn take_group_away(
        &mut self,
        k: usize,
        touches: &[ContactPoint],
        rates: &mut [f64],
    ) {
        self.impulses.clear();
        let of = self.groups.contacts(k);
        self.impulses.extend(of.flat_map(|i| touches[i].impulse));
        let n = self.impulses.len();
        for (i, rows) in (self.groups.contacts(k)).zip(self.w[self.block(k)].chunks_exact(3 * n)) {
            for (to, row) in rates[3 * i..3 * i + 3].iter_mut().zip(rows.chunks_exact(n)) {
                let moved = row.iter().zip(&self.impulses);
                *to -= moved.map(|(w, p)| w * p).sum::<f64>();
            }
        }
    }

    /// Impulses p of the conditions for u = W p + q, from the ones that the contacts have; `false` where Newton's method finds
    /// none. `each` gets the report of each solution, and whether it is one of a softer group.
    pub(crate) fn solve(
        &mut self,
        method: ConeMethod,
        touches: &mut [ContactPoint],
        rates: &[f64],
        factor: &mut Factor<'_>,
        mut each: impl FnMut(ConeReport, bool),
    ) -> Result<bool, SolveError> {
        let mut found = true;
        for k in 0..self.groups.islands.len() {
            let island = self.groups.islands[k].clone();
            if island.is_split() {
                self.sweep(&island, method, touches, rates, factor, &mut each)?;
            } else {
                let effort = &mut *factor.effort;
                let at = (island.groups.start, effort);
                found &= self.solve_group(at, method, touches, rates, &mut each)?;
            }
        }
        Ok(found)
    }

    /// Impulses of one group, with `rates` of all contacts, as [`solve`](Self::solve). The group is
    /// softened where no impulses are found; q does not depend on σ.
    fn solve_group(
        &mut self,
        (k, effort): (usize, &mut Effort),
        method: ConeMethod,
        touches: &mut [ContactPoint],
        rates: &[f64],
        each: &mut impl FnMut(ConeReport, bool),
    ) -> Result<bool, SolveError> {
        let mut found = true;
        for softer in 0..=SOFTER.1 {
            if effort.ends() {
                break;
            }
            let method = effort.method(method);
            let report = self.try_group(k, method, touches, rates, softer == 0)?;
            effort.spend(self.impulses.len(), &report);
            each(report, softer > 0);
            let is_softened = method == ConeMethod::Newton && report.is_definite;
            found = report.solved || !is_softened;
            if found || report.complementarity <= CLOSE || softer == SOFTER.1 {
                break;
            }
            let block = self.block(k);
            let (w, n) = (&mut self.w[block], self.impulses.len());
            for (a, i) in self.groups.contacts(k).enumerate() {
                let more = self.floor[i] * (SOFTER.0 - 1.0);
                self.floor[i] += more;
                (3 * a..3 * a + 3).for_each(|k| w[k * (n + 1)] += more);
            }
        }
        if !effort.ends() {
            self.hand_over(k, touches);
        }
        Ok(found)
    }

    /// The contacts of a group have the impulses in its vector.
    pub(super) fn hand_over(&self, k: usize, touches: &mut [ContactPoint]) {
        for (i, p) in self
            .groups
            .contacts(k)
            .zip(self.impulses.as_chunks::<3>().0)
        {
            touches[i].impulse = *p;
        }
    }

    /// The impulses of a group into its vector, from those of its contacts or from what the last trial left there.
    pub(super) fn try_group(
        &mut self,
        k: usize,
        method: ConeMethod,
        touches: &[ContactPoint],
        rates: &[f64],
        first: bool,
    ) -> Result<ConeReport, SolveError> {
        let groups = &self.groups;
        if first {
            self.impulses.clear();
            let impulses = groups.contacts(k).flat_map(|i| touches[i].impulse);
            self.impulses.extend(impulses);
        }
        self.rates.clear();
        let of = groups.contacts(k).flat_map(|i| &rates[3 * i..3 * i + 3]);
        self.rates.extend(of);
        self.friction.clear();
        let of = groups
            .contacts(k)
            .map(|i| touches[i].found.surface.friction);
        self.friction.extend(of);
        self.regularization.clear();
        let of = groups.contacts(k).map(|i| self.floor[i]);
        self.regularization.extend(of);
        let problem = Problem {
            operator: &self.w[self.block(k)],
            rates: &self.rates,
            friction: &self.friction,
            regularization: &self.regularization,
        };
        self.solver.solve(&problem, method, &mut self.impulses)
    }
}
