//! Preconditioned conjugate gradient (Hestenes and Stiefel 1952; Saad, *Iterative Methods for Sparse Linear
//! Systems*, algorithm 9.1), without a preconditioner, with the diagonal blocks, or with the pattern's groups.
//!
//! On cables it is useless before it converges and then sudden: after about as many iterations as there are distinct
//! eigenvalues, whatever the mass ratio.
//!
//! An iteration is four passes: the product A p with p·A p; x, r and r·r; the preconditioner with r·z; p. Systems of small
//! blocks are laid out for them four block rows abreast (`slices`), all vectors too, and the diagonal blocks are
//! inverted. Products with S = J M⁻¹ Jᵀ + Σ from its pieces, without the blocks of S, cost the same on long cables and
//! 1.4 to 2 times as much on short ones and on nets: they won nowhere.

use super::check_solution;
use super::iteration::{self, Krylov, check_norm, largest_block};
use crate::Phases;
use crate::block_ldlt::{BlockLdlt, Pivots};
use crate::groups::Groups;
use crate::matrix::check_finite;
use crate::options::check_iteration;
use crate::slices::{Slices, dot, step, turn};
use crate::{AnalyzeReport, BlockPattern, CgOptions, FactorReport, LinearSolver, Preconditioner};
use crate::{SolveError, SolveReport, SymBlockMatrix, norm_inf};
use std::sync::Arc;

/// The `cg` backend.
pub(crate) struct ConjugateGradient {
    options: CgOptions,
    phases: Phases,
    plan: Option<Plan>,
    vectors: Vectors,
    /// True if the last solve failed.
    unsound: bool,
}

/// Data structures for the analysed pattern.
struct Plan {
    /// Where the blocks are small enough.
    slices: Option<Slices>,
    inside: Inside,
    /// Two vectors in the order of the pattern.
    rows: [Vec<f64>; 2],
}

/// The preconditioner.
enum Inside {
    Identity,
    /// The diagonal blocks.
    Diagonal {
        factor: BlockLdlt<f64>,
        /// True if the slices hold the inverses of the blocks, which then replace `factor`.
        inverted: bool,
    },
    Groups(Groups),
}

/// Solution, right-hand side, residual r, preconditioned residual z, direction p, product A p.
#[derive(Default)]
struct Vectors {
    x: Vec<f64>,
    b: Vec<f64>,
    r: Vec<f64>,
    z: Vec<f64>,
    p: Vec<f64>,
    ap: Vec<f64>,
}

impl ConjugateGradient {
    pub(crate) fn new(options: CgOptions) -> Result<Self, SolveError> {
        check_iteration(options.iterations, options.tolerance)?;
        Ok(Self {
            options,
            phases: Phases::default(),
            plan: None,
            vectors: Vectors::default(),
            unsound: false,
        })
    }
}

impl Plan {
    fn new(pattern: &BlockPattern, options: &CgOptions) -> Result<Self, SolveError> {
        let inside = match options.preconditioner {
            Preconditioner::None => Inside::Identity,
            Preconditioner::BlockJacobi => Inside::Diagonal {
                factor: BlockLdlt::new(pattern, &pattern.restricted(|i, j| i == j)?)?,
                inverted: false,
            },
            Preconditioner::Group => {
                let groups = pattern.groups();
                Inside::Groups(Groups::new(pattern, |i| groups[i] as usize)?)
            }
        };
        Ok(Self {
            slices: Slices::new(pattern, |_, _| true),
            inside,
            rows: [(); 2].map(|()| vec![0.0; pattern.dim()]),
        })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<(), SolveError> {
        if let Some(slices) = &mut self.slices {
            slices.fill(a);
        }
        match &mut self.inside {
            Inside::Identity => Ok(()),
            Inside::Diagonal { factor, inverted } => {
                *inverted = self.slices.as_mut().is_some_and(Slices::invert_diagonal);
                if *inverted {
                    return Ok(());
                }
                factor.factorize(a, Pivots::Positive)
            }
            Inside::Groups(groups) => groups.factorize(a),
        }
    }

    /// y = A x; returns x·y.
    fn product(&mut self, a: &SymBlockMatrix, x: &[f64], y: &mut [f64]) -> f64 {
        if let Some(slices) = &self.slices {
            return slices.product(x, y);
        }
        let [zero, _] = &mut self.rows;
        zero.fill(0.0);
        a.subtract_product(zero, x, y);
        y.iter_mut().for_each(|y| *y = -*y);
        dot(x, y)
    }

    /// z = preconditioner⁻¹ r; returns r·z. Not for the identity.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]) -> f64 {
        let [from, to] = &mut self.rows;
        match (&mut self.inside, &self.slices) {
            (Inside::Diagonal { inverted: true, .. }, Some(slices)) => {
                return slices.precondition(r, z);
            }
            (inside, Some(slices)) => {
                slices.save(r, from);
                inside.solve(from, to);
                slices.load(to, z);
            }
            (inside, None) => inside.solve(r, z),
        }
        dot(r, z)
    }

    /// Into the layout that the iteration works in.
    fn load(&self, from: &[f64], to: &mut [f64]) {
        match &self.slices {
            Some(slices) => slices.load(from, to),
            None => to.copy_from_slice(from),
        }
    }

    /// And out of it.
    fn save(&self, from: &[f64], to: &mut [f64]) {
        match &self.slices {
            Some(slices) => slices.save(from, to),
            None => to.copy_from_slice(from),
        }
    }
}

/// The iteration on a system.
struct Run<'a> {
    plan: &'a mut Plan,
    v: &'a mut Vectors,
    a: &'a SymBlockMatrix,
}

impl Krylov for Run<'_> {
    fn residual(&mut self) -> Result<f64, SolveError> {
        let Self { plan, v, a } = self;
        if v.x.iter().all(|x| *x == 0.0) {
            v.ap.fill(0.0);
        } else {
            plan.product(a, &v.x, &mut v.ap);
        }
        v.r.copy_from_slice(&v.ap);
        turn(-1.0, &v.b, &mut v.r);
        let norm = dot(&v.r, &v.r).sqrt();
        if !norm.is_finite() {
            let mut rows = std::mem::take(&mut plan.rows);
            let [x, r] = &mut rows;
            plan.save(&v.x, x);
            plan.save(&v.r, r);
            let checked = check_norm(a.pattern(), norm, x, r);
            plan.rows = rows;
            checked?;
        }
        Ok(norm)
    }

    fn iterate(&mut self, target: f64, limit: usize) -> Result<usize, SolveError> {
        let Self { plan, v, a } = self;
        let identity = matches!(plan.inside, Inside::Identity);
        let mut square = dot(&v.r, &v.r);
        let mut rz = if identity {
            square
        } else {
            plan.precondition(&v.r, &mut v.z)
        };
        let z = if identity { &v.r } else { &v.z };
        v.p.copy_from_slice(z);
        let mut iterations = 0;
        while square.sqrt() > target && iterations < limit && rz > 0.0 {
            let curvature = plan.product(a, &v.p, &mut v.ap);
            if curvature <= 0.0 || !curvature.is_finite() {
                // Where the direction is largest.
                let mut rows = std::mem::take(&mut plan.rows[0]);
                plan.save(&v.p, &mut rows);
                let block = largest_block(a.pattern(), &rows);
                plan.rows[0] = rows;
                return Err(if !v.p.iter().all(|p| p.is_finite()) {
                    let what = "solution";
                    SolveError::NonFinite { what, block }
                } else if curvature.is_finite() && !underflows(a, &v.p, &v.ap) {
                    SolveError::NotPositiveDefinite { block }
                } else {
                    SolveError::OutOfRange { block }
                });
            }
            square = step(rz / curvature, [&v.p, &v.ap], [&mut v.x, &mut v.r]);
            iterations += 1;
            if !(square.is_finite() && square.sqrt() > target) || iterations == limit {
                break;
            }
            let next = if identity {
                square
            } else {
                plan.precondition(&v.r, &mut v.z)
            };
            let z = if identity { &v.r } else { &v.z };
            turn(next / rz, z, &mut v.p);
            rz = next;
        }
        Ok(iterations)
    }
}

/// True if q = A p, or pᵀq, has lost digits below the normal numbers.
fn underflows(a: &SymBlockMatrix, p: &[f64], q: &[f64]) -> bool {
    if q.iter().all(|q| *q == 0.0) {
        let size = norm_inf(a.values());
        return size > 0.0 && size * norm_inf(p) < f64::MIN_POSITIVE;
    }
    let mut pairs = p.iter().zip(q).filter(|(p, q)| **p != 0.0 && **q != 0.0);
    let least = p.len() as f64 * f64::MIN_POSITIVE;
    pairs.clone().next().is_some() && pairs.all(|(p, q)| (p * q).abs() < least)
}

impl Inside {
    /// x from b, in the order of the pattern.
    fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        match self {
            Self::Groups(groups) => groups.solve(b, x),
            Self::Diagonal { factor, .. } => {
                x.copy_from_slice(b);
                factor.solve(x);
            }
            Self::Identity => x.copy_from_slice(b),
        }
    }
}

impl LinearSolver for ConjugateGradient {
    fn name(&self) -> &'static str {
        "cg"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let plan = Plan::new(pattern, &self.options)?;
        let factor_entries = match &plan.inside {
            Inside::Identity => None,
            Inside::Diagonal { factor, .. } => Some(factor.factor_values()),
            Inside::Groups(groups) => Some(groups.factor_values()),
        };
        let len = plan.slices.as_ref().map_or(pattern.dim(), Slices::len);
        let zeros = || vec![0.0; len];
        self.vectors = Vectors {
            x: zeros(),
            b: zeros(),
            r: zeros(),
            z: zeros(),
            p: zeros(),
            ap: zeros(),
        };
        self.plan = Some(plan);
        self.phases.analyzed(pattern);
        Ok(AnalyzeReport { factor_entries })
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        if let Some(plan) = &mut self.plan {
            plan.factorize(a)?;
        }
        self.phases.factorized();
        Ok(FactorReport::default())
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.phases.begin_solve(a, b, x)?;
        let Some(plan) = &mut self.plan else {
            return Err(SolveError::OutOfOrder {
                called: "solve",
                needs: "analyze",
            });
        };
        let Some(scale) = iteration::begin(a.pattern(), b, x)? else {
            return Ok(SolveReport::ZERO);
        };
        check_finite(a.pattern(), "guess", x)?;
        let v = &mut self.vectors;
        if std::mem::replace(&mut self.unsound, true) {
            // After a failed solve the padding may hold values that are not finite. Loads do not
            // overwrite it.
            for v in [&mut v.x, &mut v.b, &mut v.r, &mut v.z, &mut v.p, &mut v.ap] {
                v.fill(0.0);
            }
        }
        plan.load(b, &mut v.b);
        plan.load(x, &mut v.x);
        let CgOptions {
            tolerance,
            iterations,
            ..
        } = self.options;
        let mut work = Run { plan, v, a };
        let report = iteration::run(&mut work, scale, tolerance, iterations)?;
        plan.save(&self.vectors.x, x);
        check_solution(a, x)?;
        self.unsound = false;
        Ok(report)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preconditioner;

    /// A chain of blocks of two rows, which are padded, with a strong diagonal.
    fn chain(scale: f64) -> SymBlockMatrix {
        let couplings: Vec<_> = (1..9).map(|i| (i - 1, i)).collect();
        let pattern = Arc::new(BlockPattern::new(&[2; 9], &couplings).expect("a pattern"));
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        a.values_mut().fill(-0.5 * scale);
        for j in 0..9 {
            let diagonal = a.block_mut(pattern.column(j).start);
            diagonal.copy_from_slice(&[4.0, 0.5, 0.5, 3.0].map(|v| v * scale));
        }
        a
    }

    /// Products that are no doubles tell nothing of definiteness.
    #[test]
    fn products_out_of_range_are_told_as_such() {
        for (scale, b) in [
            (1e-110, 1e-110),
            (1e-200, 1e-100),
            (1e-200, 1e-125),
            (1e120, 1e120),
        ] {
            let a = chain(scale);
            let options = CgOptions {
                preconditioner: Preconditioner::None,
                ..CgOptions::default()
            };
            let mut solver = ConjugateGradient::new(options).expect("sound options");
            solver.analyze(a.pattern()).expect("analysed");
            solver.factorize(&a).expect("definite");
            let b: Vec<_> = (0..a.dim()).map(|i| b * (1.0 + (i as f64).cos())).collect();
            let e = solver.solve(&a, &b, &mut vec![0.0; a.dim()]);
            let refused = matches!(e, Err(SolveError::OutOfRange { .. }));
            assert!(refused, "{scale:e}: {e:?}");
        }
    }
}
