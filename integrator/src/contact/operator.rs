//! The contacts' dense operator W = H M̃⁻¹ Hᵀ − G S⁻¹ Gᵀ + diag σ, from the factor of the joints' system.
//!
//! Only active contacts have rows here: those that carry an impulse or would be passed through without one. The others are
//! looked at after each solution, and become active where they have to.
//!
//! Rows on bodies without joints have no G and cost no solve. Contacts that share neither a body nor a tree of joints do
//! not couple: each such island is a dense problem of its own.

use super::{FLOOR, Touch};
use crate::Form;
use crate::pieces::Pieces;
use crate::plan::Plan;
use std::ops::Range;
use taut_model::linearized::dot;
use taut_model::{Linearized, Scene};
use taut_solver::coulomb::{ConeMethod, ConeReport, ConeSolver, Contacts as Problem};
use taut_solver::{LinearSolver, SolveError, SolveReport, SymBlockMatrix};

/// By how much an island is softened at a time, and how often at most.
const SOFTER: (f64, usize) = (100.0, 3);

/// Systems of the joints solved at once.
const TOGETHER: usize = 16;

/// The factor of the joints' system, for right-hand sides of rows.
pub(crate) struct Factor<'a> {
    pub(crate) solver: &'a mut dyn LinearSolver,
    pub(crate) matrix: &'a SymBlockMatrix,
    pub(crate) plan: &'a Plan,
    pub(crate) form: Form,
    /// Right-hand sides and solutions.
    pub(crate) system: &'a mut [Vec<f64>; 2],
}

impl Factor<'_> {
    /// μ of S μ = b for each of these vectors of rows, in place.
    pub(crate) fn respond(
        &mut self,
        rows: &Linearized,
        vectors: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        let (dim, count) = (self.matrix.dim(), vectors.len() / rows.rows().max(1));
        let [b, x] = &mut *self.system;
        for s in [&mut *b, &mut *x] {
            s.resize(dim * count, 0.0);
        }
        for (b, rhs) in b
            .chunks_exact_mut(dim)
            .zip(vectors.chunks_exact(rows.rows()))
        {
            self.plan.gather(rows, None, rhs, 1.0, b);
        }
        x.fill(0.0);
        let report = match count {
            1 => self.solver.solve(self.matrix, b, x),
            _ => self.solver.solve_many(self.matrix, b, x),
        };
        let sign = match self.form {
            Form::Schur => 1.0,
            Form::Kkt => -1.0,
        };
        for (x, to) in x
            .chunks_exact(dim)
            .zip(vectors.chunks_exact_mut(rows.rows()))
        {
            self.plan.scatter_multipliers(rows, x, sign, to);
        }
        report
    }
}

/// A row of H on one body, times M̃⁻¹.
type Moved = Option<(usize, [f64; 6])>;

/// W of all contacts, island by island, and the dense problem's vectors.
#[derive(Default)]
pub(crate) struct Operator {
    /// Slots of the joints at each body, and the part of the scene that hangs together with it by joints.
    slots: Vec<Vec<usize>>,
    part: Vec<usize>,
    /// Contacts in the order of their islands, and each island's range of them.
    pub(crate) order: Vec<usize>,
    pub(crate) islands: Vec<Range<usize>>,
    joined: Vec<usize>,
    /// G row by row, and M̃⁻¹ hᵀ of both sides.
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
    moved: Vec<[Moved; 2]>,
    /// W of each island, one after the other.
    w: Vec<f64>,
    /// q, p, μ_f and the regularisation of an island.
    rates: Vec<f64>,
    impulses: Vec<f64>,
    friction: Vec<f64>,
    floor: Vec<f64>,
    /// Mean of W of each contact's own rows, in the order of the contacts.
    own: Vec<f64>,
    columns: Vec<f64>,
    solver: ConeSolver,
}

impl Operator {
    pub(crate) fn new(scene: &Scene, rows: &Linearized) -> Self {
        let bodies = scene.bodies.len();
        let mut slots = vec![Vec::new(); bodies];
        let mut part: Vec<usize> = (0..bodies).collect();
        for (s, slot) in rows.slots.iter().enumerate() {
            slots[slot.body].push(s);
        }
        for c in 0..rows.constraints() {
            let moved = rows.slots[rows.slot_range(c)].iter().map(|s| s.body);
            let mut dynamic = moved.filter(|i| scene.bodies.is_dynamic(*i));
            if let Some(first) = dynamic.next() {
                dynamic.for_each(|other| join(&mut part, first, other));
            }
        }
        for i in 0..bodies {
            part[i] = root(&part, i);
        }
        Self {
            slots,
            part,
            ..Self::default()
        }
    }

    /// Sorts the active contacts by islands.
    pub(crate) fn divide(&mut self, pieces: &Pieces, touches: &[Touch]) {
        let Self { joined, part, .. } = self;
        joined.clear();
        joined.extend(0..part.len());
        let parts = |touch: &Touch| {
            let movable = |i: &usize| !pieces.inertia.is_immovable(*i);
            touch
                .found
                .bodies
                .map(|i| i.filter(movable).map(|i| part[i]))
        };
        for touch in touches.iter().filter(|touch| touch.active) {
            if let [Some(a), Some(b)] = parts(touch) {
                join(joined, a, b);
            }
        }
        let island = |i: &usize| {
            parts(&touches[*i])
                .into_iter()
                .flatten()
                .next()
                .map(|p| root(joined, p))
        };
        self.order.clear();
        self.order
            .extend((0..touches.len()).filter(|i| touches[*i].active));
        self.order.sort_by_key(island);
        self.islands.clear();
        let mut first = 0;
        for k in 0..self.order.len() {
            let last = k + 1 == self.order.len();
            if last || island(&self.order[k]) != island(&self.order[k + 1]) {
                self.islands.push(first..k + 1);
                first = k + 1;
            }
        }
    }

    /// G and M̃⁻¹ Hᵀ.
    fn couple(&mut self, pieces: &Pieces, touches: &[Touch]) {
        let (rows, inertia) = (&pieces.rows, &pieces.inertia);
        self.starts.clear();
        self.entries.clear();
        self.moved.clear();
        for &i in &self.order {
            for k in 0..3 {
                self.starts.push(self.entries.len());
                let mut moved = [None; 2];
                for (side, (body, row)) in touches[i].row(k).enumerate() {
                    if inertia.is_immovable(body) {
                        continue;
                    }
                    let mut inverse = [0.0; 6];
                    inertia.apply_inverse(body, &row, &mut inverse);
                    moved[side] = Some((body, inverse));
                    for &s in &self.slots[body] {
                        let first = rows.row_range(rows.slots[s].constraint).start;
                        let block = rows.block(s);
                        let of = block.rows().iter().enumerate();
                        let entries = of.map(|(r, j)| (first + r, dot(j, &inverse)));
                        self.entries.extend(entries.filter(|e| e.1 != 0.0));
                    }
                }
                self.moved.push(moved);
            }
        }
        self.starts.push(self.entries.len());
    }

    fn entries_of(&self, row: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[row]..self.starts[row + 1]]
    }

    /// W of the pieces, whose joints have this factor, or W of the bodies alone, after [`divide`](Self::divide).
    pub(crate) fn build(
        &mut self,
        pieces: &Pieces,
        touches: &[Touch],
        mut factor: Option<Factor<'_>>,
    ) -> Result<SolveReport, SolveError> {
        self.couple(pieces, touches);
        let size = |island: &Range<usize>| 9 * island.len() * island.len();
        let total = self.islands.iter().map(size).sum();
        self.w.clear();
        self.w.resize(total, 0.0);
        let mut report = SolveReport::DIRECT;
        let (islands, mut w) = (
            std::mem::take(&mut self.islands),
            std::mem::take(&mut self.w),
        );
        let mut rest = &mut w[..];
        let mut done = Ok(());
        for island in &islands {
            let (part, others) = rest.split_at_mut(size(island));
            rest = others;
            self.touch_directly(island, touches, part);
            if let Some(factor) = &mut factor {
                match self.touch_through_joints(island, &pieces.rows, factor, part) {
                    Ok(of) => report = report.and(of),
                    Err(e) => done = Err(e),
                }
            }
            self.regularize(island, touches, part);
        }
        (self.islands, self.w) = (islands, w);
        done.map(|()| report)
    }

    /// H M̃⁻¹ Hᵀ of an island.
    fn touch_directly(&self, island: &Range<usize>, touches: &[Touch], w: &mut [f64]) {
        let n = 3 * island.len();
        for (a, i) in island.clone().enumerate() {
            let touch = &touches[self.order[i]];
            for (b, j) in island.clone().enumerate().take(a + 1) {
                let meets = |moved: &Moved| {
                    moved.is_some_and(|(body, _)| touch.found.bodies.contains(&Some(body)))
                };
                for l in 0..3 {
                    let moved = &self.moved[3 * j + l];
                    if !moved.iter().any(meets) {
                        continue;
                    }
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

    /// − G S⁻¹ Gᵀ of an island.
    fn touch_through_joints(
        &mut self,
        island: &Range<usize>,
        rows: &Linearized,
        factor: &mut Factor<'_>,
        w: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        let (count, n, first) = (rows.rows(), 3 * island.len(), 3 * island.start);
        let mut report = SolveReport::DIRECT;
        let mut columns = std::mem::take(&mut self.columns);
        let jointed = |k: &usize| !self.entries_of(first + *k).is_empty();
        let mut left = (0..n).filter(jointed);
        loop {
            let mut numbers = [0; TOGETHER];
            let taken = numbers
                .iter_mut()
                .zip(left.by_ref())
                .map(|(to, k)| *to = k)
                .count();
            if taken == 0 {
                break;
            }
            columns.clear();
            columns.resize(taken * count, 0.0);
            for (k, column) in numbers.iter().zip(columns.chunks_exact_mut(count)) {
                for &(r, g) in self.entries_of(first + k) {
                    column[r] += g;
                }
            }
            report = report.and(factor.respond(rows, &mut columns)?);
            for (k, column) in numbers.iter().zip(columns.chunks_exact(count)) {
                for l in (0..n).filter(jointed) {
                    let of = self.entries_of(first + l).iter();
                    // Both triangles: what S⁻¹ is not symmetric by is rounding.
                    let sum = 0.5 * of.map(|(r, g)| g * column[*r]).sum::<f64>();
                    w[l * n + k] -= sum;
                    w[k * n + l] -= sum;
                }
            }
        }
        self.columns = columns;
        Ok(report)
    }

    /// + diag σ of an island.
    fn regularize(&mut self, island: &Range<usize>, touches: &[Touch], w: &mut [f64]) {
        let n = 3 * island.len();
        self.floor.resize(self.order.len(), 0.0);
        self.own.resize(touches.len(), 1.0);
        for (a, i) in island.clone().enumerate() {
            let at = |k: usize| (3 * a + k) * (n + 1);
            let own = (w[at(0)] + w[at(1)] + w[at(2)]) / 3.0;
            let floor = (FLOOR * own).max(f64::MIN_POSITIVE);
            self.floor[i] = floor;
            self.own[self.order[i]] = own;
            for k in 0..3 {
                w[at(k)] += floor
                    + if k == 0 {
                        touches[self.order[i]].softness
                    } else {
                        0.0
                    };
            }
        }
    }

    /// Adds σ p of each contact, which [`super::Contacts::rates`] leave out.
    pub(crate) fn add_regularization(&self, touches: &[Touch], rates: &mut [f64]) {
        for (floor, &i) in self.floor.iter().zip(&self.order) {
            let touch = &touches[i];
            for k in 0..3 {
                let sigma = floor + if k == 0 { touch.softness } else { 0.0 };
                rates[3 * i + k] += sigma * touch.impulse[k];
            }
        }
    }

    /// σ of each of `count` contacts without its compliance \[1/kg]; 0 where it is not active.
    pub(crate) fn floors(&self, count: usize) -> Vec<f64> {
        let mut floors = vec![0.0; count];
        for (floor, &i) in self.floor.iter().zip(&self.order) {
            floors[i] = *floor;
        }
        floors
    }

    /// p·W p of the contacts' impulses \[J].
    pub(crate) fn energy(&mut self, touches: &[Touch]) -> f64 {
        let mut moved = vec![0.0; 3 * touches.len()];
        self.take_away(touches, &mut moved);
        let impulses = touches.iter().flat_map(|touch| touch.impulse);
        -impulses.zip(&moved).map(|(p, u)| p * u).sum::<f64>()
    }

    /// Mean of W of contact `i`'s own rows \[1/kg].
    pub(crate) fn weight(&self, i: usize) -> f64 {
        self.own.get(i).copied().unwrap_or(1.0)
    }

    /// The impulses of an island.
    fn impulses_of(&mut self, island: &Range<usize>, touches: &[Touch]) {
        self.impulses.clear();
        let of = self.order[island.clone()].iter();
        self.impulses.extend(of.flat_map(|i| touches[*i].impulse));
    }

    /// q = u − W p of all contacts for their rates u, in place.
    pub(crate) fn take_away(&mut self, touches: &[Touch], rates: &mut [f64]) {
        let mut first = 0;
        for k in 0..self.islands.len() {
            let island = self.islands[k].clone();
            let n = 3 * island.len();
            self.impulses_of(&island, touches);
            let w = &self.w[first..first + n * n];
            for (r, row) in w.chunks_exact(n).enumerate() {
                let to = 3 * self.order[island.start + r / 3] + r % 3;
                let moved = row.iter().zip(&self.impulses);
                rates[to] -= moved.map(|(w, p)| w * p).sum::<f64>();
            }
            first += n * n;
        }
    }

    /// Impulses p of the conditions for u = W p + q, from the ones that the contacts have. An island for which none are found
    /// is softened; q does not depend on σ. `each` gets the report of each solution, and whether it is one of a softer island.
    pub(crate) fn solve(
        &mut self,
        method: ConeMethod,
        touches: &mut [Touch],
        rates: &[f64],
        mut each: impl FnMut(ConeReport, bool),
    ) -> Result<(), SolveError> {
        let mut first = 0;
        for k in 0..self.islands.len() {
            let island = self.islands[k].clone();
            let n = 3 * island.len();
            self.impulses_of(&island, touches);
            let members = &self.order[island.clone()];
            self.rates.clear();
            self.rates
                .extend(members.iter().flat_map(|i| &rates[3 * i..3 * i + 3]));
            self.friction.clear();
            let friction = members.iter().map(|i| touches[*i].found.surface.friction);
            self.friction.extend(friction);
            for softer in 0..=SOFTER.1 {
                let problem = Problem {
                    operator: &self.w[first..first + n * n],
                    rates: &self.rates,
                    friction: &self.friction,
                    regularization: &self.floor[island.clone()],
                };
                let report = self.solver.solve(&problem, method, &mut self.impulses)?;
                each(report, softer > 0);
                if report.solved || method != ConeMethod::Newton {
                    break;
                }
                let w = &mut self.w[first..first + n * n];
                for (a, floor) in self.floor[island.clone()].iter_mut().enumerate() {
                    let more = *floor * (SOFTER.0 - 1.0);
                    *floor += more;
                    (3 * a..3 * a + 3).for_each(|k| w[k * (n + 1)] += more);
                }
            }
            for (i, p) in members.iter().zip(self.impulses.as_chunks::<3>().0) {
                touches[*i].impulse = *p;
            }
            first += n * n;
        }
        Ok(())
    }
}

fn root(part: &[usize], mut i: usize) -> usize {
    while part[i] != i {
        i = part[i];
    }
    i
}

/// The two become one part, named by its least member.
fn join(part: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(part, a), root(part, b));
    part[a.max(b)] = a.min(b);
}
