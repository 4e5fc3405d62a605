//! Islands of several groups: block Gauss–Seidel over their dense problems.
//!
//! Only the groups' own blocks of W are stored. What a change Δp of a group's impulses makes of the rates of the others goes
//! through its bodies, and once through the joints' factor where they have joints:
//!
//! ```text
//! Δu = H M̃⁻¹ Hᵀ Δp − G S⁻¹ Gᵀ Δp + σ Δp
//! ```
//!
//! A sweep solves each group in turn, forwards and backwards in turn, without those that keep their conditions.
//! The passes of the step go on where a solution ends; what they leave is reported as undecided.

use super::ContactPoint;
use super::groups::Island;
use super::operator::Operator;
use crate::response::Factor;
use taut_model::linearized::dot;
use taut_solver::SolveError;
use taut_solver::coulomb::{ConeMethod, ConeReport, violation};

/// Most sweeps of a solution through W.
const SWEEPS: usize = 20;

/// Factorisations after which no further sweep begins: they are of up to 600 rows, a few milliseconds each.
const WORK: usize = 200;

/// Violation of the conditions, over the size of the rates, that needs no further sweep.
const TOLERANCE: f64 = 3e-11;

/// Workspace of an island of several groups.
#[derive(Default)]
pub(crate) struct Split {
    /// u of all contacts \[m/s].
    rates: Vec<f64>,
    /// u without the impulses of the present group, and these impulses before its solution.
    q: Vec<f64>,
    before: Vec<[f64; 3]>,
    /// M̃⁻¹ Hᵀ Δp by bodies, and the numbers of the bodies where it is not zero.
    change: Vec<[f64; 6]>,
    changed: Vec<usize>,
    /// Gᵀ Δp, then S⁻¹ Gᵀ Δp, one a row of the joints.
    column: Vec<f64>,
}

impl Operator {
    /// Impulses of a split island for u = W p + q, from those that its contacts have, as far as the sweeps come.
    pub(super) fn sweep(
        &mut self,
        island: &Island,
        method: ConeMethod,
        touches: &mut [ContactPoint],
        q: &[f64],
        factor: &mut Factor<'_>,
        each: &mut impl FnMut(ConeReport, bool),
    ) -> Result<(), SolveError> {
        let mut rates = std::mem::take(&mut self.split.rates);
        rates.clear();
        rates.extend_from_slice(q);
        self.add_response_of_all(island, 1.0, touches, &mut rates, factor)?;
        let mut spent = 0;
        for sweep in 0..SWEEPS {
            let size = self.size(island, touches, q);
            let mut worst = 0.0_f64;
            for n in 0..island.groups.len() {
                if factor.effort.ends() {
                    break;
                }
                let backwards = sweep % 2 == 1;
                let k = if backwards {
                    island.groups.end - 1 - n
                } else {
                    island.groups.start + n
                };
                let found = self.worst_of(k, touches, &rates);
                worst = worst.max(found);
                if found <= TOLERANCE * size {
                    continue;
                }
                let report = self.update(k, island, method, touches, &mut rates, factor)?;
                spent += report.pivots;
                each(report, false);
            }
            let ends = factor.effort.is_spent() || factor.effort.ends();
            if worst <= TOLERANCE * size || spent > WORK || ends {
                break;
            }
        }
        self.split.rates = rates;
        Ok(())
    }

    /// Solves a group, and tells the others.
    fn update(
        &mut self,
        k: usize,
        island: &Island,
        method: ConeMethod,
        touches: &mut [ContactPoint],
        rates: &mut [f64],
        factor: &mut Factor<'_>,
    ) -> Result<ConeReport, SolveError> {
        let mut before = std::mem::take(&mut self.split.before);
        before.clear();
        before.extend(self.groups.contacts(k).map(|i| touches[i].impulse));
        let mut q = std::mem::take(&mut self.split.q);
        q.clear();
        q.extend_from_slice(rates);
        self.take_group_away(k, touches, &mut q);
        let method = factor.effort.method(method);
        let report = self.try_group(k, method, touches, &q, true);
        self.split.q = q;
        let report = report?;
        factor.effort.spend(self.impulses.len(), &report);
        self.hand_over(k, touches);
        for (change, i) in before.iter_mut().zip(self.groups.contacts(k)) {
            for (p, new) in change.iter_mut().zip(touches[i].impulse) {
                *p = new - *p;
            }
        }
        let members = self.groups.members(k).to_vec();
        let done = self.add_response(island, (&members, &before), touches, rates, factor);
        self.split.before = before;
        done.map(|()| report)
    }

    /// The size of the rates.
    fn size(&self, island: &Island, touches: &[ContactPoint], q: &[f64]) -> f64 {
        let of = self.groups.order[island.contacts.clone()].iter();
        of.fold(0.0, |most: f64, &i| {
            let inert = touches[i].impulse.map(|p| self.weight(i) * p);
            let rates = q[3 * i..3 * i + 3].iter().chain(&inert);
            rates.fold(most, |most, x| most.max(x.abs()))
        })
    }

    /// Largest violation of the conditions in a group \[m/s].
    fn worst_of(&self, k: usize, touches: &[ContactPoint], rates: &[f64]) -> f64 {
        self.groups.contacts(k).fold(0.0, |worst: f64, i| {
            let inert = touches[i].impulse.map(|p| self.weight(i) * p);
            let rate = [0, 1, 2].map(|k| rates[3 * i + k]);
            worst.max(violation(inert, rate, touches[i].found.surface.friction))
        })
    }

    /// Adds W p times `sign` of a split island.
    pub(super) fn add_response_of_all(
        &mut self,
        island: &Island,
        sign: f64,
        touches: &[ContactPoint],
        rates: &mut [f64],
        factor: &mut Factor<'_>,
    ) -> Result<(), SolveError> {
        let places: Vec<usize> = island.contacts.clone().collect();
        let of = places
            .iter()
            .map(|at| touches[self.groups.order[*at]].impulse.map(|p| sign * p));
        let impulses: Vec<[f64; 3]> = of.collect();
        self.add_response(island, (&places, &impulses), touches, rates, factor)
    }

    /// Adds W Δp to the rates of an island, for Δp at these places.
    fn add_response(
        &mut self,
        island: &Island,
        (places, impulses): (&[usize], &[[f64; 3]]),
        touches: &[ContactPoint],
        rates: &mut [f64],
        factor: &mut Factor<'_>,
    ) -> Result<(), SolveError> {
        let mut split = std::mem::take(&mut self.split);
        split.change.resize(self.groups.slots.len(), [0.0; 6]);
        split.column.clear();
        split.column.resize(factor.rows.rows(), 0.0);
        let mut jointed = false;
        for (&place, p) in places.iter().zip(impulses) {
            let i = self.groups.order[place];
            let sigma = self.sigma(i, touches);
            for k in (0..3).filter(|k| p[*k] != 0.0) {
                rates[3 * i + k] += sigma[k] * p[k];
                for (body, moved) in self.moved[3 * place + k].iter().flatten() {
                    split.changed.push(*body);
                    let change = split.change[*body].iter_mut();
                    change.zip(moved).for_each(|(to, m)| *to += m * p[k]);
                }
                for (r, g) in self.columns.of(3 * place + k) {
                    split.column[*r] += g * p[k];
                    jointed = true;
                }
            }
        }
        let done = if jointed {
            factor.respond(&mut split.column).map(|_| ())
        } else {
            Ok(())
        };
        for place in island.contacts.clone() {
            let i = self.groups.order[place];
            for k in 0..3 {
                let direct = touches[i]
                    .row(k)
                    .map(|(body, row)| dot(&row, &split.change[body]));
                let direct: f64 = direct.sum();
                let joints = self.columns.of(3 * place + k).iter();
                let joints: f64 = joints.map(|(r, g)| g * split.column[*r]).sum();
                rates[3 * i + k] += direct - joints;
            }
        }
        for body in split.changed.drain(..) {
            split.change[body] = [0.0; 6];
        }
        self.split = split;
        done
    }
}
