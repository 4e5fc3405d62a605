//! Conformance test of backends: one check that any [`LinearSolver`] can be given, whoever wrote
//! it.
//!
//! [`check`] solves random block systems with the shapes of cables, A x = b of 1 … 120 rows in blocks of 1 … 7, and
//! compares x with the solution x* in 32 digits ([`reference_solution`]):
//!
//! ```text
//! normwise backward error  η = ‖b − A x‖∞ / (‖A‖∞ ‖x‖∞ + ‖b‖∞)      forward error  ‖x − x*‖∞ / ‖x*‖∞
//! ```
//!
//! It then uses factorisations and analyses again, gives the backend what it has to refuse (phases out of order, wrong
//! lengths, NaN, another pattern), and what it may refuse or solve but not answer wrongly: singular, indefinite and
//! badly scaled matrices. What [`Claims`] says is what it is held to. [`claims_study`] looks at claims alone, of any number
//! of adverse systems.
//!
//! ```
//! use taut_solver::agreement::{Claims, check};
//! use taut_solver::Backend;
//!
//! let backend = Backend::preferred()?;
//! let agreement = check(&mut *backend.create()?, &Claims::of(&backend))?;
//! assert!(agreement.systems > 0 && agreement.forward_error < 1e-8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A backend written outside this crate goes the same way: see the crate in `tests/skyline`.

pub mod systems;

mod adverse;
mod refusals;

pub use adverse::{FALSE, Study, adverse, claims_study};

use crate::{
    Backend, BlockPattern, LinearSolver, SolveError, Status, SymBlockMatrix, backward_error,
    forward_error, reference_solution,
};
use std::fmt;
use std::sync::Arc;
use systems::{Shape, System};

/// Error bounds and matrix class that a backend must satisfy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Claims {
    /// True if it takes quasi-definite matrices \[M Jᵀ; J −Σ] besides positive definite ones.
    pub indefinite: bool,
    /// Largest normwise backward error η; no unit.
    pub backward_error: f64,
    /// Largest forward error, relative in the ∞-norm; no unit.
    pub forward_error: f64,
}

impl Claims {
    /// Claims of direct solvers: η at roundoff, x to ten digits. The worst conditioned of the
    /// systems cost about five.
    pub const DIRECT: Self = Self {
        indefinite: false,
        backward_error: 1e-14,
        forward_error: 1e-10,
    };

    /// Claims of iterative solvers with a tolerance of 10⁻¹² or near it.
    pub const ITERATIVE: Self = Self {
        indefinite: false,
        backward_error: 1e-10,
        forward_error: 1e-8,
    };

    /// Claims of a backend of this crate; an iterative one has its default tolerance and enough
    /// iterations.
    #[must_use]
    pub fn of(backend: &Backend) -> Self {
        let claims = if backend.is_iterative() {
            Self::ITERATIVE
        } else {
            Self::DIRECT
        };
        Self {
            indefinite: backend.accepts_indefinite(),
            ..claims
        }
    }
}

/// How well a backend agrees: the largest errors over all systems.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Agreement {
    /// Systems solved and compared.
    pub systems: usize,
    /// Largest normwise backward error η; no unit.
    pub backward_error: f64,
    /// Largest forward error, relative in the ∞-norm; no unit.
    pub forward_error: f64,
    /// Most iterations that a solve took; 0 of direct backends.
    pub iterations: usize,
}

/// Where a backend does not do what it is held to.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Disagreement {
    /// The check that failed.
    pub asked: &'static str,
    /// Description of the system.
    pub system: String,
    /// The result that was found instead.
    pub found: String,
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            asked,
            system,
            found,
        } = self;
        write!(f, "{asked}: {found} (system: {system})")
    }
}

impl std::error::Error for Disagreement {}

fn fault(asked: &'static str, system: &str, found: impl Into<String>) -> Disagreement {
    Disagreement {
        asked,
        system: system.to_owned(),
        found: found.into(),
    }
}

/// A solver under examination, and how it has done.
struct Examination<'a> {
    solver: &'a mut dyn LinearSolver,
    claims: &'a Claims,
    agreement: Agreement,
}

/// Holds a solver, fresh from its making, to its claims. Takes less than a second of a direct backend. Allocates.
///
/// # Errors
/// The first [`Disagreement`].
pub fn check(solver: &mut dyn LinearSolver, claims: &Claims) -> Result<Agreement, Disagreement> {
    let mut examination = Examination {
        solver,
        claims,
        agreement: Agreement::default(),
    };
    examination.phases_have_an_order()?;
    for system in random_systems(claims)? {
        examination.agrees(&system)?;
    }
    examination.serves_again()?;
    examination.bad_input_is_refused()?;
    examination.answers_are_never_wrong()?;
    examination.empty_systems_are_solved()?;
    Ok(examination.agreement)
}

/// SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) fn split_mix(mut state: u64) -> impl FnMut() -> u64 {
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

/// Random systems of each seed, shape, and kind that is claimed.
fn random_systems(claims: &Claims) -> Result<Vec<System>, Disagreement> {
    let mut all = Vec::new();
    for seed in 1..=8 {
        for shape in Shape::ALL {
            let mut bits = split_mix(seed);
            let mut made = vec![systems::positive_definite(shape, &mut bits)];
            if claims.indefinite {
                made.push(systems::quasi_definite(shape, &mut bits));
            }
            for system in made {
                let mut system = system.map_err(|e| fault("a pattern", "random", e.to_string()))?;
                system.name += &format!(", random bits of {seed}");
                all.push(system);
            }
        }
    }
    Ok(all)
}

/// A positive definite chain: what the contract is checked on.
fn plain_system() -> Result<System, Disagreement> {
    systems::positive_definite(Shape::Chain, &mut split_mix(99))
        .map_err(|e| fault("a pattern", "plain", e.to_string()))
}

impl Examination<'_> {
    /// A phase that has to succeed.
    fn must<R>(
        result: Result<R, SolveError>,
        asked: &'static str,
        system: &str,
    ) -> Result<R, Disagreement> {
        result.map_err(|e| fault(asked, system, format!("error `{e}`")))
    }

    fn prepare(&mut self, system: &System) -> Result<(), Disagreement> {
        let (pattern, name) = (system.a.pattern(), &system.name);
        Self::must(self.solver.analyze(pattern), "analyze succeeds", name)?;
        Self::must(self.solver.factorize(&system.a), "factorize succeeds", name)?;
        Ok(())
    }

    /// Solves with what was factorised, and compares.
    fn compare(&mut self, a: &SymBlockMatrix, b: &[f64], name: &str) -> Result<(), Disagreement> {
        let mut x = vec![0.0; a.dim()];
        let report = Self::must(self.solver.solve(a, b, &mut x), "solve succeeds", name)?;
        if !report.is_claim() {
            let found = format!("{report:?}");
            return Err(fault("a solve ends in a solution", name, found));
        }
        if report.status == Status::Direct {
            let mut again = vec![1e300; a.dim()];
            Self::must(self.solver.solve(a, b, &mut again), "a second solve", name)?;
            if again != x {
                let found = "another x from another guess";
                return Err(fault("direct solvers ignore the guess", name, found));
            }
        }
        self.measure(a, b, &x, name)?;
        self.agreement.iterations = self.agreement.iterations.max(report.iterations);
        Ok(())
    }

    /// Solves for several right-hand sides at once, and compares each.
    fn compare_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[Vec<f64>],
        name: &str,
    ) -> Result<(), Disagreement> {
        let mut x = vec![0.0; b.len() * a.dim()];
        let solved = self.solver.solve_many(a, &b.concat(), &mut x);
        let report = Self::must(solved, "solve_many succeeds", name)?;
        if !report.is_claim() {
            let found = format!("{report:?}");
            return Err(fault("solve_many ends in solutions", name, found));
        }
        let mut columns = b.iter().zip(x.chunks(a.dim()));
        columns.try_for_each(|(b, x)| self.measure(a, b, x, name))
    }

    /// Holds the errors of x to the claims.
    fn measure(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &[f64],
        name: &str,
    ) -> Result<(), Disagreement> {
        let exact = Self::must(reference_solution(a, b), "a reference", name)?;
        let eta = Self::must(backward_error(a, b, x), "a solution", name)?.normwise;
        let forward = forward_error(x, &exact);
        let Claims {
            backward_error,
            forward_error,
            ..
        } = *self.claims;
        for (asked, error, bar) in [
            ("the backward error is small", eta, backward_error),
            ("x agrees with 32 digits", forward, forward_error),
        ] {
            // NaN is beyond every bar.
            if error.is_nan() || error > bar {
                return Err(fault(asked, name, format!("{error:.1e} beyond {bar:.1e}")));
            }
        }
        let worst = &mut self.agreement;
        worst.systems += 1;
        worst.backward_error = worst.backward_error.max(eta);
        worst.forward_error = worst.forward_error.max(forward);
        Ok(())
    }

    fn agrees(&mut self, system: &System) -> Result<(), Disagreement> {
        self.prepare(system)?;
        self.compare(&system.a, &system.b, &system.name)
    }

    /// One analysis for many values, one factorisation for many right-hand sides.
    fn serves_again(&mut self) -> Result<(), Disagreement> {
        let mut system = plain_system()?;
        self.prepare(&system)?;
        for round in 1..=3_usize {
            // D A D with D = 1 + (block mod round): other values, still definite.
            let p: Arc<BlockPattern> = system.a.pattern().clone();
            for j in 0..p.blocks() {
                for k in p.column(j) {
                    let scale = (1 + p.row(k) % round) as f64 * (1 + j % round) as f64;
                    system.a.block_mut(k).iter_mut().for_each(|v| *v *= scale);
                }
            }
            let name = format!("{}, values {round}", system.name);
            let asked = "the analysis serves other values";
            Self::must(self.solver.factorize(&system.a), asked, &name)?;
            let shifted = |shift| system.b.iter().map(|b| b + shift).collect();
            let sides: [Vec<f64>; 3] = [0.0, 0.5, -2.0].map(shifted);
            for b in &sides {
                self.compare(&system.a, b, &name)?;
            }
            self.compare_many(&system.a, &sides, &name)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backends::testing::Faulty;

    #[test]
    fn each_fault_is_found() {
        for (fault, asked) in [
            ("wrong in the seventh digit", "the backward error is small"),
            ("reads the guess", "direct solvers ignore the guess"),
            ("nothing is an error", "solve before analyze is refused"),
            (
                "keeps an old factorisation",
                "factorize before analyze is refused",
            ),
            ("gives up", "a solve ends in a solution"),
            ("forgets the last column", "the backward error is small"),
        ] {
            let mut faulty = Faulty::dense(fault);
            let claims = Claims::DIRECT;
            assert_eq!(check(&mut faulty, &claims).unwrap_err().asked, asked);
        }
    }
}
