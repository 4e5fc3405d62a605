//! A guard around a solver of unknown quality: what it does wrong becomes an error with its name, never an answer.

use crate::agreement::FALSE;
use crate::error::{columns, expect_columns};
use crate::{
    AnalyzeReport, BlockPattern, FactorReport, LinearSolver, Phases, SolveError, SolveReport,
    Status, SymBlockMatrix, norm_inf,
};
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// A breach of the solver contract.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// It panicked. It is not called again: what it left behind is unknown.
    Panicked {
        /// In which phase.
        phase: &'static str,
        /// Message of the panic.
        message: String,
    },
    /// Its solution holds a NaN or an infinity.
    NotFinite {
        /// Block row of the first one.
        block: usize,
    },
    /// A direct solver left rows of `x` as they were given: its answer is shorter, or made from the guess.
    Unwritten {
        /// Rows left.
        rows: usize,
        /// Rows of the system.
        of: usize,
    },
    /// It claims a solution that is none.
    FalseClaim {
        /// Normwise backward error of what it claims.
        backward_error: f64,
    },
    /// It claims an iteration converged that is not.
    Unconverged {
        /// ‖b − A x‖₂ / ‖b‖₂ of what it claims.
        residual: f64,
        /// The most that its tolerance allows.
        tolerance: f64,
    },
    /// It calls a pattern new, or a phase missing, that it was given.
    Forgot {
        /// In which phase.
        phase: &'static str,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Panicked { phase, message } => write!(f, "panicked in `{phase}`: {message}"),
            Self::NotFinite { block } => write!(
                f,
                "calls a solution what holds a NaN or an infinity in block {block}"
            ),
            Self::Unwritten { rows, of } => write!(
                f,
                "leaves {rows} of {of} rows of its solution unwritten, or reads the guess, which a direct solver ignores"
            ),
            Self::FalseClaim { backward_error } => write!(
                f,
                "claims a solution whose backward error is {backward_error:.1e}"
            ),
            Self::Unconverged {
                residual,
                tolerance,
            } => write!(
                f,
                "claims to have converged to {tolerance:.1e} at a residual of {residual:.1e}"
            ),
            Self::Forgot { phase } => write!(
                f,
                "refuses in `{phase}` the pattern that it was given to analyse, or the phase before"
            ),
        }
    }
}

/// Claims of the first solves after an analysis are all verified.
const FIRST: usize = 256;

/// After the first [`FIRST`] solves, claims are verified at one solve in this many.
const EVERY: usize = 16;

/// Bit pattern that marks rows of `x` before a direct solve: a quiet NaN that no computation makes.
const UNWRITTEN: u64 = 0x7ff8_7461_7574_0001;

/// Normwise backward error that rounding of the residual alone may leave, at any tolerance of an iteration.
const ROUNDING: f64 = 1e-14;

/// A solver whose faults are errors: [`SolveError::Misbehaved`] instead of a panic, of a solution with NaN or with rows
/// left out, of a false claim, of a pattern forgotten. Its input is checked before it sees it.
///
/// A claim of a direct solver is false where the normwise backward error is beyond [`FALSE`]: elimination without
/// pivoting of 10⁴ rows may honestly come near that, so a claim that is wrong by less passes. A claim of an iteration to
/// a tolerance τ is false where ‖b − A x‖₂ > 2 τ ‖b‖₂ and the backward error is more than rounding, 10⁻¹⁴: a recurrence
/// that has drifted by less than the factor passes. All claims are verified of the first 256 solves after an analysis,
/// then one in 16.
///
/// It costs a pass over the matrix a factorisation, two over `x` a solve, a product A x where a claim is verified, and no
/// allocation after the analysis: a step of 24 segments takes 5.7 % more instructions with `banded` behind the guard.
/// Panics are caught where the program unwinds; their message goes to standard error too.
pub struct Checked {
    name: &'static str,
    inner: Box<dyn LinearSolver>,
    tolerance: Option<f64>,
    phases: Phases,
    /// Solves since the analysis.
    solves: usize,
    residual: Vec<f64>,
    sums: Vec<f64>,
    /// How it ended, if it did.
    panicked: Option<SolveError>,
}

impl Checked {
    /// Guards `inner`, which errors call `name`; `tolerance` is that of an iteration, relative to ‖b‖₂, `None` of a direct
    /// solver.
    #[must_use]
    pub fn new(name: &'static str, inner: Box<dyn LinearSolver>, tolerance: Option<f64>) -> Self {
        Self {
            name,
            inner,
            tolerance,
            phases: Phases::default(),
            solves: 0,
            residual: Vec::new(),
            sums: Vec::new(),
            panicked: None,
        }
    }

    fn fault(&self, fault: Fault) -> SolveError {
        SolveError::Misbehaved {
            solver: self.name,
            fault,
        }
    }

    /// A phase of the solver, whose input is good.
    fn call<R>(
        &mut self,
        phase: &'static str,
        work: impl FnOnce(&mut dyn LinearSolver) -> Result<R, SolveError>,
    ) -> Result<R, SolveError> {
        if let Some(end) = &self.panicked {
            return Err(end.clone());
        }
        let inner = &mut *self.inner;
        let result = caught(self.name, phase, || work(inner));
        if let Err(e) = &result {
            match e {
                SolveError::PatternChanged | SolveError::OutOfOrder { .. } => {
                    return Err(self.fault(Fault::Forgot { phase }));
                }
                SolveError::Misbehaved { .. } => self.panicked = Some(e.clone()),
                _ => {}
            }
        }
        result
    }

    /// A solve of one or more columns, judged or not, whose input is good.
    fn solve_by(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
        phase: &'static str,
        work: impl FnOnce(&mut dyn LinearSolver, &mut [f64]) -> Result<SolveReport, SolveError>,
    ) -> Result<SolveReport, SolveError> {
        if self.tolerance.is_none() {
            x.fill(f64::from_bits(UNWRITTEN));
        }
        let report = self.call(phase, |inner| work(inner, x))?;
        if let Some(row) = x.iter().position(|x| !x.is_finite()) {
            let rows = x.iter().filter(|x| x.to_bits() == UNWRITTEN).count();
            let block = a.pattern().block_of_row(row % a.dim());
            return Err(if rows > 0 {
                self.fault(Fault::Unwritten { rows, of: x.len() })
            } else if report.is_claim() {
                self.fault(Fault::NotFinite { block })
            } else {
                // An iteration that diverged, and says so.
                let what = "solution";
                SolveError::NonFinite { what, block }
            });
        }
        for (b, x) in columns(a.dim(), b, x) {
            self.solves = self.solves.wrapping_add(1);
            if report.is_claim() && (self.solves <= FIRST || self.solves.is_multiple_of(EVERY)) {
                self.verify(a, b, x)?;
            }
        }
        Ok(report)
    }

    /// Verifies the claim that `x` solves A x = b.
    fn verify(&mut self, a: &SymBlockMatrix, b: &[f64], x: &[f64]) -> Result<(), SolveError> {
        a.subtract_product(b, x, &mut self.residual);
        let (left, size) = (norm_inf(&self.residual), norm_inf(b));
        // Scaled by ‖b‖∞: no square over- or underflows.
        let square = |v: &[f64]| v.iter().map(|v| (v / size).powi(2)).sum::<f64>();
        let residual = || (square(&self.residual) / square(b)).sqrt();
        let met = match self.tolerance {
            None => left <= FALSE * size,
            Some(tolerance) => residual() <= 2.0 * tolerance,
        };
        if met {
            return Ok(());
        }
        let error = left / (a.norm_inf_in(&mut self.sums) * norm_inf(x) + size);
        // An error that is NaN counts as infinite.
        let or_infinite = |error: f64| if error.is_nan() { f64::INFINITY } else { error };
        Err(self.fault(match self.tolerance {
            None if error <= FALSE => return Ok(()),
            Some(_) if error <= ROUNDING => return Ok(()),
            None => Fault::FalseClaim {
                backward_error: or_infinite(error),
            },
            Some(tolerance) => Fault::Unconverged {
                residual: or_infinite(residual()),
                tolerance,
            },
        }))
    }
}

impl LinearSolver for Checked {
    fn name(&self) -> &'static str {
        self.name
    }

    fn takes_guess(&self) -> bool {
        // As it was registered, not as it says.
        self.tolerance.is_some()
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        self.phases = Phases::default();
        let report = self.call("analyze", |inner| inner.analyze(pattern))?;
        self.phases.analyzed(pattern);
        self.solves = 0;
        for buffer in [&mut self.residual, &mut self.sums] {
            buffer.resize(pattern.dim(), 0.0);
        }
        Ok(report)
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.phases.begin_factorize(a)?;
        let report = self.call("factorize", |inner| inner.factorize(a))?;
        self.phases.factorized();
        Ok(report)
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.phases.begin_solve(a, b, x)?;
        self.solve_by(a, b, x, "solve", |inner, x| inner.solve(a, b, x))
    }

    fn solve_unjudged(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.phases.begin_solve(a, b, x)?;
        self.solve_by(a, b, x, "solve_unjudged", |inner, x| {
            inner.solve_unjudged(a, b, x)
        })
    }

    fn claims(&mut self, a: &SymBlockMatrix, evidence: bool) -> Result<Status, SolveError> {
        self.call("claims", |inner| inner.claims(a, evidence))
    }

    fn error_bound(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &[f64],
        r: &[f64],
    ) -> Result<f64, SolveError> {
        self.call("error_bound", |inner| inner.error_bound(a, b, x, r))
    }

    fn solve_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        expect_columns(a.dim(), b, x)?;
        for (b, x) in columns(a.dim(), b, x) {
            self.phases.begin_solve(a, b, x)?;
        }
        let solve = |inner: &mut dyn LinearSolver, x: &mut [f64]| inner.solve_many(a, b, x);
        self.solve_by(a, b, x, "solve_many", solve)
    }
}

/// Runs `work` and turns a panic into an error.
pub(crate) fn caught<R>(
    solver: &'static str,
    phase: &'static str,
    work: impl FnOnce() -> Result<R, SolveError>,
) -> Result<R, SolveError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let message = match (panic.downcast_ref::<&str>(), panic.downcast_ref::<String>()) {
            (Some(text), _) => (*text).to_owned(),
            (_, Some(text)) => text.clone(),
            _ => "without a message".to_owned(),
        };
        Err(SolveError::Misbehaved {
            solver,
            fault: Fault::Panicked { phase, message },
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Backend;
    use crate::agreement::{Claims, adverse, check};
    use crate::backends::testing::Faulty;

    fn faulty(fault: &'static str) -> Checked {
        Checked::new("faulty", Box::new(Faulty::dense(fault)), None)
    }

    fn solved(solver: &mut Checked) -> Result<SolveReport, SolveError> {
        let system = adverse(0).unwrap();
        solver.analyze(system.a.pattern())?;
        solver.factorize(&system.a)?;
        solver.solve(&system.a, &system.b, &mut vec![0.0; system.b.len()])
    }

    #[test]
    fn each_fault_is_an_error_that_names_the_solver() {
        for (fault, words) in [
            ("forgets the pattern", "refuses in `factorize`"),
            ("writes NaN", "NaN"),
            ("writes less", "leaves 1 of"),
            ("writes more", "panicked in `solve`: index out of bounds"),
            ("reads the guess", "reads the guess"),
            ("claims falsely", "backward error is"),
        ] {
            let e = solved(&mut faulty(fault)).unwrap_err().to_string();
            let holds = e.starts_with("solver `faulty` ") && e.contains(words);
            assert!(holds, "{e}");
        }
        assert!(solved(&mut faulty("none")).is_ok());
    }

    #[test]
    fn what_panicked_is_not_called_again() {
        let mut solver = faulty("writes more");
        let first = solved(&mut solver).unwrap_err();
        solver.inner = Box::new(Faulty::dense("none"));
        assert_eq!(solved(&mut solver), Err(first));
    }

    #[test]
    fn claims_are_verified_for_ever() {
        let system = adverse(0).unwrap();
        let mut solver = faulty("none");
        solver.analyze(system.a.pattern()).unwrap();
        solver.factorize(&system.a).unwrap();
        solver.solves = 10 * FIRST;
        let fault = "claims falsely";
        let inner = solver.inner;
        solver.inner = Box::new(Faulty { inner, fault });
        let mut x = vec![0.0; system.b.len()];
        let mut solve = || solver.solve(&system.a, &system.b, &mut x);
        let first = (1..=EVERY).find(|_| solve().is_err());
        assert_eq!(first, Some(EVERY));
    }

    #[test]
    fn a_claim_of_an_iteration_is_held_to_its_tolerance() {
        let claims = |tolerance, factor: f64| {
            let mut solver = faulty("claims falsely");
            // x₀ is wrong by 10⁻⁶ of itself.
            solver.tolerance = Some(tolerance);
            let system = adverse(0).unwrap();
            solver.analyze(system.a.pattern()).unwrap();
            solver.factorize(&system.a).unwrap();
            let b: Vec<f64> = system.b.iter().map(|b| factor * b).collect();
            solver.solve(&system.a, &b, &mut vec![0.0; b.len()])
        };
        for factor in [1.0, 1e200, 1e-200] {
            assert!(claims(1e-3, factor).is_ok());
            let e = claims(1e-9, factor).unwrap_err().to_string();
            assert!(e.contains("converged to 1.0e-9 at a residual of"), "{e}");
        }
    }

    #[test]
    fn many_columns_are_solved_at_once_and_each_is_verified() {
        let system = adverse(0).unwrap();
        let n = system.b.len();
        let mut solver = faulty("stops after two columns");
        solver.analyze(system.a.pattern()).unwrap();
        solver.factorize(&system.a).unwrap();
        let b = system.b.repeat(3);
        let mut x = vec![0.0; 3 * n];
        let two = solver.solve_many(&system.a, &b[..2 * n], &mut x[..2 * n]);
        assert!(two.is_ok(), "{two:?}");
        assert_eq!(solver.solves, 2);
        let e = solver.solve_many(&system.a, &b, &mut x).unwrap_err();
        let words = format!("leaves {n} of {} rows", 3 * n);
        assert!(e.to_string().contains(&words), "{e}");
        let short = solver.solve_many(&system.a, &b[1..], &mut x[1..]);
        assert!(matches!(short, Err(SolveError::Dimension { .. })));
    }

    /// The guard reports no fault of a sound backend.
    #[test]
    fn a_sound_solver_agrees_as_it_does_alone() {
        for backend in Backend::built_in() {
            let backend = backend.with_iterations(10_000);
            if let Ok(inner) = backend.create() {
                let mut guarded = Checked::new("guarded", inner, backend.tolerance());
                check(&mut guarded, &Claims::of(&backend)).unwrap_or_else(|e| panic!("{e}"));
            }
        }
    }
}
