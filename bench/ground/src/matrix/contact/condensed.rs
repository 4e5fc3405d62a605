//! A contact problem with its joints condensed: W, and v, λ, u for given impulses, from the pieces M, G, H and the two Σ.
//!
//! M is inverted block by block; v gets what M⁻¹ is inexact by in a second pass. λ is refined with the residual of the pieces,
//! since S has lost about roundoff × mass ratio in forming.

use super::{ContactProblem, ContactSolution};
use crate::matrix::market::{Market, MarketError};
use crate::matrix::prepared::Prepared;
use crate::matrix::{Matrix, matrix_of, shape};
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;
use std::path::Path;
use taut_integrator::Entry;
use taut_solver::SolveError;

/// Largest block of M that is inverted.
const LARGEST: usize = 64;

/// Refinements of λ.
const REFINEMENTS: usize = 2;

/// Columns of G or H at a block of M.
type Columns = Vec<(usize, DVector<f64>)>;

/// A block of M, and what acts on it.
struct Body {
    /// Its components of velocity.
    rows: Vec<usize>,
    inertia: DMatrix<f64>,
    inverse: DMatrix<f64>,
    joints: Columns,
    contacts: Columns,
    /// M⁻¹ of the contacts' columns.
    moved: Columns,
}

impl Body {
    /// v ← v + M⁻¹ (p − M v), twice.
    fn correct(&self, p: &[f64], v: &mut [f64]) {
        let take = |from: &[f64]| DVector::from_iterator(self.rows.len(), self.picked(from));
        let (p, mut own) = (take(p), take(v));
        for _ in 0..2 {
            own += &self.inverse * (&p - &self.inertia * &own);
        }
        for (&row, x) in self.rows.iter().zip(&own) {
            v[row] = *x;
        }
    }

    fn picked(&self, from: &[f64]) -> impl Iterator<Item = f64> {
        self.rows.iter().map(|&row| from[row])
    }
}

/// The problem's blocks, and S.
pub struct Condensed<'a> {
    problem: &'a ContactProblem,
    bodies: Vec<Body>,
    /// S; none without joints.
    pub joints: Option<Matrix>,
}

impl<'a> Condensed<'a> {
    /// Condenses a problem whose files are in `folder`.
    ///
    /// # Errors
    /// [`MarketError`] for M unless it consists of regular positive blocks of at most 64 rows, and
    /// for G.
    pub fn new(problem: &'a ContactProblem, folder: &Path) -> Result<Self, MarketError> {
        let mut bodies =
            blocks(problem).map_err(|message| shape(&folder.join("M.mtx"), message))?;
        let mut place = vec![(0, 0); problem.impulse.len()];
        for (b, body) in bodies.iter().enumerate() {
            for (k, &row) in body.rows.iter().enumerate() {
                place[row] = (b, k);
            }
        }
        let of_joints = columns(&problem.of_joints, &place, &bodies);
        let of_contacts = columns(&problem.of_contacts, &place, &bodies);
        let acting = of_joints.into_iter().zip(of_contacts);
        for (body, (joints, contacts)) in bodies.iter_mut().zip(acting) {
            let moved = contacts.iter().map(|(c, h)| (*c, &body.inverse * h));
            body.moved = moved.collect();
            (body.joints, body.contacts) = (joints, contacts);
        }
        let mut condensed = Self {
            problem,
            bodies,
            joints: None,
        };
        if !problem.joint_rates.is_empty() {
            let market = condensed.schur();
            let (matrix, _) = matrix_of(&market, &folder.join("G.mtx"))?;
            condensed.joints = Some(matrix);
        }
        Ok(condensed)
    }

    /// S as the lower triangle, with the blocks of the joints.
    fn schur(&self) -> Market {
        let problem = self.problem;
        let p = problem.joint_rates.len();
        let sigma = problem.joint_regularization.iter().enumerate();
        let mut entries: Vec<Entry> = sigma.map(|(j, sigma)| (j, j, *sigma)).collect();
        for body in &self.bodies {
            for (at, (i, g)) in body.joints.iter().enumerate() {
                let moved = &body.inverse * g;
                let lower = body.joints[..=at].iter();
                entries.extend(lower.map(|(j, g)| (*i, *j, g.dot(&moved))));
            }
        }
        Market {
            rows: p,
            columns: p,
            symmetric: true,
            entries,
            blocks: problem.joints.iter().copied().filter(|n| *n > 0).collect(),
            ..Market::default()
        }
    }

    /// W, row-major, m × m, with the factor of the joints, or that of the bodies alone.
    ///
    /// # Errors
    /// As the factor's solves.
    pub fn operator(&self, factor: Option<&mut Prepared<'_>>) -> Result<Vec<f64>, SolveError> {
        let m = self.problem.contact_rates.len();
        let mut w = vec![0.0; m * m];
        for (k, sigma) in self.problem.contact_regularization.iter().enumerate() {
            w[k * (m + 1)] += sigma;
        }
        // Gᵀ M⁻¹ H by its columns.
        let mut coupling: Vec<BTreeMap<usize, f64>> = vec![BTreeMap::new(); m];
        for body in &self.bodies {
            for (b, moved) in &body.moved {
                for (a, h) in &body.contacts {
                    w[a * m + b] += h.dot(moved);
                }
                for (j, g) in &body.joints {
                    *coupling[*b].entry(*j).or_default() += g.dot(moved);
                }
            }
        }
        let Some(factor) = factor else {
            return Ok(w);
        };
        let p = self.problem.joint_rates.len();
        let (mut b, mut x) = (vec![0.0; p], vec![0.0; p]);
        for k in 0..m {
            if coupling[k].is_empty() {
                continue;
            }
            b.fill(0.0);
            x.fill(0.0);
            coupling[k].iter().for_each(|(j, value)| b[*j] = *value);
            factor.solve(&b, &mut x)?;
            for (l, of) in coupling.iter().enumerate() {
                // Both triangles: what S⁻¹ is not symmetric by is rounding.
                let sum = 0.5 * of.iter().map(|(j, value)| value * x[*j]).sum::<f64>();
                w[l * m + k] -= sum;
                w[k * m + l] -= sum;
            }
        }
        Ok(w)
    }

    /// v and λ for the impulses r, with the factor of the joints; without it λ = 0.
    ///
    /// # Errors
    /// As the factor's solves.
    pub fn solution(
        &self,
        factor: Option<&mut Prepared<'_>>,
        r: &[f64],
    ) -> Result<ContactSolution, SolveError> {
        let problem = self.problem;
        let mut impulse = problem.impulse.clone();
        for &(row, column, h) in &problem.of_contacts {
            impulse[row] += h * r[column];
        }
        let p = problem.joint_rates.len();
        let mut velocities = vec![0.0; impulse.len()];
        let mut joints = vec![0.0; p];
        self.correct(&impulse, &mut velocities);
        if let Some(factor) = factor {
            let mut change = vec![0.0; p];
            for _ in 0..=REFINEMENTS {
                let rates = problem.joint_rates.iter().zip(&joints);
                let with_sigma = rates.zip(&problem.joint_regularization);
                let mut lacking: Vec<f64> = with_sigma
                    .map(|((b, lambda), sigma)| -b - sigma * lambda)
                    .collect();
                for &(row, column, g) in &problem.of_joints {
                    lacking[column] -= g * velocities[row];
                }
                change.fill(0.0);
                factor.solve(&lacking, &mut change)?;
                joints.iter_mut().zip(&change).for_each(|(l, c)| *l += c);
                let mut all = impulse.clone();
                for &(row, column, g) in &problem.of_joints {
                    all[row] += g * joints[column];
                }
                self.correct(&all, &mut velocities);
            }
        }
        Ok(ContactSolution {
            velocities,
            joints,
            contacts: r.to_vec(),
        })
    }

    fn correct(&self, impulse: &[f64], velocities: &mut [f64]) {
        let bodies = self.bodies.iter();
        bodies.for_each(|body| body.correct(impulse, velocities));
    }

    /// u of a solution.
    #[must_use]
    pub fn rates(&self, solution: &ContactSolution) -> Vec<f64> {
        let problem = self.problem;
        let own = problem.contact_rates.iter().zip(&solution.contacts);
        let own = own.zip(&problem.contact_regularization);
        let mut rates: Vec<f64> = own.map(|((w, r), sigma)| w + sigma * r).collect();
        for &(row, column, h) in &problem.of_contacts {
            rates[column] += h * solution.velocities[row];
        }
        rates
    }
}

/// The diagonal blocks of M: rows that entries join.
fn blocks(problem: &ContactProblem) -> Result<Vec<Body>, String> {
    let n = problem.impulse.len();
    let mut first: Vec<usize> = (0..n).collect();
    let root = |first: &[usize], mut i: usize| {
        while first[i] != i {
            i = first[i];
        }
        i
    };
    for &(r, c, _) in &problem.inertia {
        let (a, b) = (root(&first, r), root(&first, c));
        first[a.max(b)] = a.min(b);
    }
    let mut rows: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for i in 0..n {
        rows.entry(root(&first, i)).or_default().push(i);
    }
    if let Some(block) = rows.values().find(|rows| rows.len() > LARGEST) {
        return Err(format!(
            "row {} hangs together with {} others: blocks of M may have {LARGEST} rows, one a body",
            block[0] + 1,
            block.len() - 1
        ));
    }
    let mut bodies: Vec<Body> = Vec::with_capacity(rows.len());
    let mut place = vec![(0, 0); n];
    for (b, rows) in rows.into_values().enumerate() {
        for (k, &row) in rows.iter().enumerate() {
            place[row] = (b, k);
        }
        let size = rows.len();
        bodies.push(Body {
            rows,
            inertia: DMatrix::zeros(size, size),
            inverse: DMatrix::zeros(size, size),
            joints: Vec::new(),
            contacts: Vec::new(),
            moved: Vec::new(),
        });
    }
    for &(r, c, value) in &problem.inertia {
        let ((b, i), (_, j)) = (place[r], place[c]);
        bodies[b].inertia[(i, j)] = value;
        bodies[b].inertia[(j, i)] = value;
    }
    for body in &mut bodies {
        let factor = body.inertia.clone().cholesky();
        let inverse = factor.map(|factor| factor.inverse());
        match inverse.filter(|inverse| inverse.iter().all(|x| x.is_finite())) {
            Some(inverse) => body.inverse = inverse,
            None => {
                let row = body.rows[0] + 1;
                return Err(format!(
                    "the block of row {row} is not positive definite: it is no inertia"
                ));
            }
        }
    }
    Ok(bodies)
}

/// The columns of G or H at each body.
fn columns(entries: &[Entry], place: &[(usize, usize)], bodies: &[Body]) -> Vec<Columns> {
    let mut of: Vec<BTreeMap<usize, DVector<f64>>> = vec![BTreeMap::new(); bodies.len()];
    for &(row, column, value) in entries {
        let (b, k) = place[row];
        let size = bodies[b].rows.len();
        let own = of[b].entry(column);
        own.or_insert_with(|| DVector::zeros(size))[k] += value;
    }
    let columns = of.into_iter().map(|columns| columns.into_iter().collect());
    columns.collect()
}
