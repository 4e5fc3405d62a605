//! − G S⁻¹ Gᵀ of a group: what its contacts make of each other's rates through the joints.
//!
//! G = J M̃⁻¹ Hᵀ takes one solve a row of H. Many contacts of few bodies, such as a load on the floor, take fewer: with
//! C = J M̃⁻¹ of the six columns of each body that is touched
//!
//! ```text
//! G S⁻¹ Gᵀ = H (Cᵀ S⁻¹ C) Hᵀ
//! ```
//!
//! takes six solves a body. It is formed so where that halves the solves at least.

use super::CARRIERS;
use super::ContactPoint;
use super::operator::Operator;
use crate::response::Factor;
use crate::system_data::SystemData;
use taut_lanes::{Isa, Kernel, Level, dispatch};
use taut_model::linearized::dot;
use taut_solver::{SolveError, SolveReport};

/// Systems of the joints solved at once.
const TOGETHER: usize = 16;

/// Sparse columns by rows of the joints, one after the other.
#[derive(Default)]
pub(super) struct Columns {
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Columns {
    pub(super) fn clear(&mut self) {
        self.starts.clear();
        self.starts.push(0);
        self.entries.clear();
    }

    /// Adds the entries of J x for x on body `i`, whose joints have these slots, to the last column.
    pub(super) fn extend(&mut self, system_data: &SystemData, slots: &[usize], x: &[f64; 6]) {
        let rows = &system_data.rows;
        for &s in slots {
            let first = rows.row_range(rows.slots[s].constraint).start;
            let block = rows.block(s);
            let of = block.rows().iter().enumerate();
            let entries = of.map(|(r, j)| (first + r, dot(j, x)));
            self.entries.extend(entries.filter(|e| e.1 != 0.0));
        }
    }

    /// Ends the last column.
    pub(super) fn end(&mut self) {
        self.starts.push(self.entries.len());
    }

    pub(super) fn of(&self, k: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[k]..self.starts[k + 1]]
    }
}

/// Sparse columns times those abreast, appended to the sums.
struct Meet<'a, C>(C, &'a [[f64; TOGETHER]], &'a mut Vec<[f64; TOGETHER]>);

impl<'a, C: Iterator<Item = &'a [(usize, f64)]>> Kernel for Meet<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self(columns, abreast, to) = self;
        to.extend(columns.map(|column| {
            let mut sums = [0.0; TOGETHER];
            for (r, g) in column {
                let of = sums.iter_mut().zip(&abreast[*r]);
                of.for_each(|(sum, z)| *sum += g * z);
            }
            sums
        }));
    }
}

/// A row of H on the touched body of that number.
type Row = Option<(usize, [f64; 6])>;

/// Workspace of the products.
#[derive(Default)]
pub(super) struct Through {
    /// S⁻¹ times [`TOGETHER`] columns, one after the other and interleaved.
    columns: Vec<f64>,
    abreast: Vec<[f64; TOGETHER]>,
    /// Products of each column so far with the interleaved ones.
    sums: Vec<[f64; TOGETHER]>,
    /// Touched bodies with joints, C, and Cᵀ S⁻¹ C, row-major.
    bodies: Vec<usize>,
    of_bodies: Columns,
    mobility: Vec<f64>,
    /// Each row of H, and a row of H Cᵀ S⁻¹ C.
    rows: Vec<[Row; CARRIERS]>,
    moved: Vec<f64>,
}

impl Through {
    /// aᵀ S⁻¹ b for each pair l ≤ k of these `columns`, the `numbered` ones of `n`, to `add`.
    fn products(
        &mut self,
        columns: &Columns,
        (n, numbered): (usize, impl Fn(usize) -> usize),
        factor: &mut Factor<'_>,
        mut add: impl FnMut([usize; 2], f64),
    ) -> Result<SolveReport, SolveError> {
        let count = factor.rows.rows();
        let mut report = SolveReport::DIRECT;
        let of = |k: usize| columns.of(numbered(k));
        let exists = |k: &usize| !of(*k).is_empty();
        let mut left = (0..n).filter(exists);
        loop {
            let mut numbers = [0; TOGETHER];
            let taken = numbers
                .iter_mut()
                .zip(left.by_ref())
                .map(|(to, k)| *to = k)
                .count();
            let numbers = &numbers[..taken];
            let Some(&last) = numbers.last() else {
                return Ok(report);
            };
            self.columns.clear();
            self.columns.resize(taken * count, 0.0);
            for (k, column) in numbers.iter().zip(self.columns.chunks_exact_mut(count)) {
                for &(r, g) in of(*k) {
                    column[r] += g;
                }
            }
            report = report.and(factor.respond(&mut self.columns)?);
            self.abreast.resize(count, [0.0; TOGETHER]);
            for (j, column) in self.columns.chunks_exact(count).enumerate() {
                let to = self.abreast.iter_mut().zip(column);
                to.for_each(|(to, z)| to[j] = *z);
            }
            self.sums.clear();
            let meet = Meet((0..=last).map(of), &self.abreast, &mut self.sums);
            dispatch(Level::best(), meet);
            for (l, sums) in self.sums.iter().enumerate().filter(|(l, _)| exists(l)) {
                // One triangle for both: what S⁻¹ is not symmetric by is rounding.
                for (&k, sum) in numbers.iter().zip(sums).filter(|(k, _)| l <= **k) {
                    add([l, k], *sum);
                }
            }
        }
    }

    /// Cᵀ S⁻¹ C of the touched bodies, whose joints have these slots.
    fn find_mobility(
        &mut self,
        system_data: &SystemData,
        slots: &[Vec<usize>],
        factor: &mut Factor<'_>,
    ) -> Result<SolveReport, SolveError> {
        let mut own = std::mem::take(&mut self.of_bodies);
        own.clear();
        for &body in &self.bodies {
            for c in 0..6 {
                let (mut axis, mut column) = ([0.0; 6], [0.0; 6]);
                axis[c] = 1.0;
                system_data.inertia.apply_inverse(body, &axis, &mut column);
                own.extend(system_data, &slots[body], &column);
                own.end();
            }
        }
        let m = 6 * self.bodies.len();
        let mut mobility = std::mem::take(&mut self.mobility);
        mobility.clear();
        mobility.resize(m * m, 0.0);
        let add = |[l, k]: [usize; 2], sum: f64| {
            (mobility[l * m + k], mobility[k * m + l]) = (sum, sum);
        };
        let report = self.products(&own, (m, |k| k), factor, add);
        (self.mobility, self.of_bodies) = (mobility, own);
        report
    }

    /// Subtracts H (Cᵀ S⁻¹ C) Hᵀ of these contacts from their W.
    fn subtract<'a>(&mut self, contacts: impl Iterator<Item = &'a ContactPoint>, w: &mut [f64]) {
        let bodies = &self.bodies;
        self.rows.clear();
        for touch in contacts {
            self.rows.extend((0..3).map(|k| {
                let mut carriers = [None; CARRIERS];
                for (to, (body, h)) in carriers.iter_mut().zip(touch.row(k)) {
                    *to = bodies.binary_search(&body).ok().map(|body| (body, h));
                }
                carriers
            }));
        }
        let (m, n) = (6 * bodies.len(), self.rows.len());
        for k in 0..n {
            self.moved.clear();
            self.moved.resize(m, 0.0);
            for (body, h) in self.rows[k].iter().flatten() {
                let rows = self.mobility[6 * body * m..].chunks_exact(m);
                for (row, h) in rows.zip(h) {
                    let to = self.moved.iter_mut().zip(row);
                    to.for_each(|(to, y)| *to += h * y);
                }
            }
            let moved = self.moved.as_chunks::<6>().0;
            for l in 0..=k {
                let of = self.rows[l].iter().flatten();
                let sum: f64 = of.map(|(body, h)| dot(h, &moved[*body])).sum();
                subtract([l, k], n, sum, w);
            }
        }
    }
}

/// From both triangles.
fn subtract([l, k]: [usize; 2], n: usize, sum: f64, w: &mut [f64]) {
    w[l * n + k] -= sum;
    if l != k {
        w[k * n + l] -= sum;
    }
}

impl Operator {
    /// Subtracts G S⁻¹ Gᵀ of a group from its W.
    pub(super) fn touch_through_joints(
        &mut self,
        (members, order): (&[usize], &[usize]),
        (system_data, touches): (&SystemData, &[ContactPoint]),
        factor: &mut Factor<'_>,
        w: &mut [f64],
        slots: &[Vec<usize>],
    ) -> Result<SolveReport, SolveError> {
        let n = 3 * members.len();
        let number = |k: usize| 3 * members[k / 3] + k % 3;
        let (through, columns) = (&mut self.through, &self.columns);
        let solves = (0..n).filter(|k| !columns.of(number(*k)).is_empty());
        let solves = solves.count();
        through.bodies.clear();
        let touched = members.iter().flat_map(|i| touches[order[*i]].carriers());
        let touched = touched.map(|carrier| carrier.body);
        let jointed = touched
            .filter(|body| !slots[*body].is_empty() && !system_data.inertia.is_immovable(*body));
        through.bodies.extend(jointed);
        through.bodies.sort_unstable();
        through.bodies.dedup();
        if 12 * through.bodies.len() > solves || solves == 0 {
            let add = |pair: [usize; 2], sum: f64| subtract(pair, n, sum, w);
            return through.products(columns, (n, number), factor, add);
        }
        let report = through.find_mobility(system_data, slots, factor)?;
        through.subtract(members.iter().map(|i| &touches[order[*i]]), w);
        Ok(report)
    }
}
