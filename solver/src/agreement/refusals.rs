//! Refusals required of a backend, and systems that it may refuse or solve but not answer wrongly.

use super::{Disagreement, Examination, System, fault, plain_system};
use crate::{BlockPattern, SolveError, SymBlockMatrix, backward_error};
use std::sync::Arc;

/// Fails unless the phase was refused as `right` says.
fn refused<R>(
    result: Result<R, SolveError>,
    right: impl Fn(&SolveError) -> bool,
    asked: &'static str,
    system: &str,
) -> Result<(), Disagreement> {
    match result {
        Err(e) if right(&e) => Ok(()),
        Err(e) => Err(fault(asked, system, format!("error `{e}`"))),
        Ok(_) => Err(fault(asked, system, "no error")),
    }
}

fn out_of_order(e: &SolveError) -> bool {
    matches!(e, SolveError::OutOfOrder { .. })
}

fn not_finite(e: &SolveError) -> bool {
    matches!(e, SolveError::NonFinite { .. })
}

fn dimension(e: &SolveError) -> bool {
    matches!(e, SolveError::Dimension { .. })
}

/// The pattern of blocks of these sizes, each coupled with the one before it.
fn chain(sizes: &[usize]) -> Result<Arc<BlockPattern>, Disagreement> {
    let couplings: Vec<_> = (1..sizes.len()).map(|i| (i - 1, i)).collect();
    let pattern = BlockPattern::new(sizes, &couplings);
    let pattern = pattern.map_err(|e| fault("a pattern", "chain", e.to_string()))?;
    Ok(Arc::new(pattern))
}

/// The chain of scalar rows with this diagonal, −1 beside it.
fn tridiagonal(diagonal: &[f64], scale: f64) -> Result<SymBlockMatrix, Disagreement> {
    let pattern = chain(&vec![1; diagonal.len()])?;
    let mut a = SymBlockMatrix::zeros(pattern.clone());
    for (j, d) in diagonal.iter().enumerate() {
        for (k, value) in pattern.column(j).zip([*d, -1.0]) {
            a.block_mut(k).fill(scale * value);
        }
    }
    Ok(a)
}

impl Examination<'_> {
    pub(super) fn phases_have_an_order(&mut self) -> Result<(), Disagreement> {
        let system = plain_system()?;
        let (a, name) = (&system.a, &system.name);
        refused(
            self.solver.factorize(a),
            out_of_order,
            "factorize before analyze is refused",
            name,
        )?;
        self.comes_too_early(&system, "solve before analyze is refused")?;
        let asked = "analyze succeeds";
        Self::must(self.solver.analyze(a.pattern()), asked, name)?;
        self.comes_too_early(&system, "solve before factorize is refused")?;
        self.prepare(&system)?;
        Self::must(self.solver.analyze(a.pattern()), asked, name)?;
        self.comes_too_early(&system, "a new analysis forgets the factorisation")
    }

    /// A solve that something has to come before.
    fn comes_too_early(
        &mut self,
        system: &System,
        asked: &'static str,
    ) -> Result<(), Disagreement> {
        let mut x = vec![0.0; system.a.dim()];
        let solved = self.solver.solve(&system.a, &system.b, &mut x);
        refused(solved, out_of_order, asked, &system.name)
    }

    pub(super) fn bad_input_is_refused(&mut self) -> Result<(), Disagreement> {
        let system = plain_system()?;
        let (a, b, name) = (&system.a, &system.b, &system.name);
        let mut x = vec![0.0; a.dim()];
        self.prepare(&system)?;
        let asked = "a right-hand side of another length is refused";
        refused(
            self.solver.solve(a, &b[1..], &mut x),
            dimension,
            asked,
            name,
        )?;
        let asked = "a solution of another length is refused";
        refused(self.solver.solve(a, b, &mut x[1..]), dimension, asked, name)?;
        for bad in [f64::NAN, f64::INFINITY] {
            let mut b = b.clone();
            b[a.dim() / 2] = bad;
            let asked = "a right-hand side with NaN or infinity is refused";
            refused(self.solver.solve(a, &b, &mut x), not_finite, asked, name)?;
        }
        let other = tridiagonal(&[2.0; 5], 1.0)?;
        let changed = |e: &SolveError| matches!(e, SolveError::PatternChanged);
        let asked = "a matrix of another pattern is refused";
        refused(self.solver.factorize(&other), changed, asked, name)?;
        self.prepare(&system)?;
        let mut nan = a.clone();
        nan.values_mut()[0] = f64::NAN;
        let asked = "a matrix with NaN is refused";
        refused(self.solver.factorize(&nan), not_finite, asked, name)?;
        let asked = "a failed factorisation leaves nothing to solve with";
        self.comes_too_early(&system, asked)?;
        // Nor does it do lasting harm.
        self.agrees(&system)
    }

    /// Singular, indefinite and badly scaled: an error, a status that claims nothing, or a solution.
    pub(super) fn answers_are_never_wrong(&mut self) -> Result<(), Disagreement> {
        let singular = [1.0, 2.0, 2.0, 2.0, 1.0];
        let indefinite = [2.0, 2.0, -2.0, 2.0, 2.0];
        let definite = [2.0; 5];
        let cases = [
            ("a chain that nothing holds", singular, 1.0),
            ("zeros", [0.0; 5], 0.0),
            ("an indefinite chain", indefinite, 1.0),
            ("a chain of numbers near the largest", definite, 1e307),
            ("a chain of numbers near the smallest", definite, 1e-300),
            ("a chain of numbers without all digits", definite, 1e-320),
        ];
        for (name, diagonal, scale) in cases {
            let a = tridiagonal(&diagonal, scale)?;
            for b in [[1.0, -2.0, 3.0, -4.0, 5.0], [1e300; 5], [1e-300; 5]] {
                self.is_not_answered_wrongly(&a, &b, name)?;
            }
        }
        Ok(())
    }

    fn is_not_answered_wrongly(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        name: &str,
    ) -> Result<(), Disagreement> {
        let asked = "analyze succeeds";
        Self::must(self.solver.analyze(a.pattern()), asked, name)?;
        let mut x = vec![0.0; a.dim()];
        let solved = self.solver.factorize(a).is_ok();
        let Some(report) = solved
            .then(|| self.solver.solve(a, b, &mut x).ok())
            .flatten()
        else {
            return Ok(());
        };
        if let Some(bad) = x.iter().find(|x| !x.is_finite()) {
            let asked = "what is not an error is finite";
            return Err(fault(asked, name, format!("{bad} in x")));
        }
        let error = Self::must(backward_error(a, b, &x), "a solution", name)?.normwise;
        // An x below the smallest normal number may flush to 0: it is a solution, though its
        // residual is all of b.
        let lost = x.iter().all(|x| x.abs() < f64::MIN_POSITIVE);
        // Nor has a matrix of numbers below the smallest normal one all its digits.
        let lost = lost || (f64::from_bits(1)..1e-290).contains(&a.norm_inf());
        let bar = self.claims.backward_error;
        // At the ends of the range of numbers the error itself overflows.
        if report.is_claim() && error > bar && error.is_finite() && !lost {
            let found = format!("{:?} with a backward error of {error:.1e}", report.status);
            return Err(fault("no wrong answer is called a solution", name, found));
        }
        Ok(())
    }

    pub(super) fn empty_systems_are_solved(&mut self) -> Result<(), Disagreement> {
        for sizes in [&[][..], &[0, 0]] {
            let a = SymBlockMatrix::zeros(chain(sizes)?);
            let name = "no rows";
            Self::must(self.solver.analyze(a.pattern()), "analyze succeeds", name)?;
            Self::must(self.solver.factorize(&a), "factorize succeeds", name)?;
            Self::must(self.solver.solve(&a, &[], &mut []), "solve succeeds", name)?;
        }
        Ok(())
    }
}
