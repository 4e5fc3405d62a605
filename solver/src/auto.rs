//! The solver that `auto` stands for: of those compiled in the one that takes the least time by what is counted of the
//! system ([`Backend::predicted`]).

use crate::clock::Moment;
use crate::{
    AnalyzeReport, Backend, BlockPattern, Counts, FactorReport, LinearSolver, SolveError,
    SolveReport, Status, SymBlockMatrix,
};
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// The solver that was chosen; its text is the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// The solver.
    pub backend: Backend,
    /// Predicted time of its factorisation and two solves \[ns of the machine that the coefficients are from]; none of one
    /// that iterates.
    pub cost: Option<f64>,
    /// The next best solver with its predicted time; none where there was no other.
    pub next: Option<(Backend, f64)>,
    /// Counts of the system, from which the time is predicted.
    pub counts: Counts,
    /// Time that choosing took, besides the counting of orders that a solver by name is made with, too.
    pub analysis: Duration,
}

impl Chosen {
    /// The one that takes the least predicted time, the first of equal ones, each with the counts of the order that it
    /// would have. `None` among none.
    #[must_use]
    pub fn among(candidates: &[(Backend, Counts)]) -> Option<Self> {
        let timed = |(backend, counts): &(Backend, Counts)| backend.predicted(counts);
        let mut timed: Vec<_> = candidates.iter().map(|c| (timed(c), c)).collect();
        // Without a prediction last.
        let time = |time: Option<f64>| time.unwrap_or(f64::INFINITY);
        timed.sort_by(|a, b| time(a.0).total_cmp(&time(b.0)));
        let (cost, (backend, counts)) = *timed.first()?;
        let next = timed
            .get(1)
            .and_then(|(t, (b, _))| Some((b.clone(), (*t)?)));
        Some(Self {
            backend: backend.clone(),
            cost,
            next,
            counts: *counts,
            analysis: Duration::ZERO,
        })
    }

    /// For matrices of `pattern`, of which nothing else is known: they may be indefinite.
    fn of(pattern: &BlockPattern) -> Result<Self, SolveError> {
        let begun = Moment::now();
        let counts = Counts::in_order(pattern)?;
        let order: Vec<usize> = (0..pattern.blocks()).collect();
        let mut candidates = Vec::new();
        for backend in Backend::candidates(true) {
            let border = backend.border_rows(pattern, &order)?;
            candidates.push((backend, Counts { border, ..counts }));
        }
        // The dense solver is always there.
        let none = SolveError::NotCompiled {
            backend: "auto",
            feature: "banded",
        };
        let chosen = Self::among(&candidates).ok_or(none)?;
        Ok(Self {
            analysis: begun.elapsed(),
            ..chosen
        })
    }
}

impl fmt::Display for Chosen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Counts {
            rows,
            factor,
            border,
            ..
        } = self.counts;
        match border {
            Some(0) => write!(f, "{rows} rows that are a chain")?,
            Some(border) => write!(f, "{rows} rows that are a chain with a border of {border}")?,
            None => write!(
                f,
                "{rows} rows, {} entries of the factor, {:.1e} operations",
                factor.entries, factor.flops as f64
            )?,
        }
        match (&self.next, self.cost) {
            (Some((next, time)), Some(cost)) => write!(
                f,
                ": predicted to take {:.2} of the time of {next}, the next",
                cost / time
            ),
            _ => f.write_str(": no other solver compiled in takes them"),
        }
    }
}

/// The solver of [`Backend::Auto`], chosen for each pattern.
#[derive(Default)]
pub(crate) struct Auto {
    /// `None` before `analyze`.
    solver: Option<Box<dyn LinearSolver>>,
}

impl Auto {
    fn analyzed(&mut self, called: &'static str) -> Result<&mut Box<dyn LinearSolver>, SolveError> {
        let needs = "analyze";
        let too_early = SolveError::OutOfOrder { called, needs };
        self.solver.as_mut().ok_or(too_early)
    }
}

impl LinearSolver for Auto {
    fn name(&self) -> &'static str {
        Backend::Auto.name()
    }

    fn takes_guess(&self) -> bool {
        self.solver.as_ref().is_none_or(|s| s.takes_guess())
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let mut solver = Chosen::of(pattern)?.backend.create()?;
        let report = solver.analyze(pattern)?;
        self.solver = Some(solver);
        Ok(report)
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        self.analyzed("factorize")?.factorize(a)
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.analyzed("solve")?.solve(a, b, x)
    }

    fn solve_unjudged(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.analyzed("solve")?.solve_unjudged(a, b, x)
    }

    fn claims(&mut self, a: &SymBlockMatrix, evidence: bool) -> Result<Status, SolveError> {
        self.analyzed("claims")?.claims(a, evidence)
    }

    fn error_bound(&mut self, a: &SymBlockMatrix, x: &[f64], r: &[f64]) -> Result<f64, SolveError> {
        self.analyzed("error_bound")?.error_bound(a, x, r)
    }

    fn solve_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.analyzed("solve")?.solve_many(a, b, x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agreement::{Claims, check};
    use crate::{CgOptions, DenseOptions};

    fn chain(blocks: usize, size: usize) -> BlockPattern {
        let couplings: Vec<_> = (1..blocks).map(|i| (i - 1, i)).collect();
        BlockPattern::new(&vec![size; blocks], &couplings).expect("a pattern")
    }

    /// Every block coupled to every other one.
    fn full(blocks: usize) -> BlockPattern {
        let couplings: Vec<_> = (0..blocks)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .collect();
        BlockPattern::new(&vec![1; blocks], &couplings).expect("a pattern")
    }

    #[test]
    fn it_solves_as_a_direct_solver() {
        let claims = Claims::of(&Backend::Auto);
        let agreement = check(&mut *Backend::Auto.create().expect("made"), &claims);
        assert!(agreement.unwrap_or_else(|e| panic!("{e}")).systems >= 24);
    }

    #[test]
    fn chains_are_for_the_solver_of_chains() {
        for (blocks, size) in [(5, 6), (25, 6), (101, 5), (3001, 6)] {
            let pattern = chain(blocks, size);
            let [first, second] = [(); 2].map(|()| Chosen::of(&pattern).expect("chosen"));
            let same = Chosen {
                analysis: first.analysis,
                ..second
            };
            assert_eq!(first, same);
            if Backend::Banded.is_compiled() {
                assert_eq!(first.backend, Backend::Banded, "{blocks}: {first}");
                assert!(first.to_string().contains("that are a chain: "), "{first}");
            }
        }
    }

    #[test]
    fn the_least_time_by_the_counts_is_taken() {
        for pattern in [full(30), full(600), chain(40, 8)] {
            let chosen = Chosen::of(&pattern).expect("chosen");
            let counts = Counts::in_order(&pattern).expect("counted");
            let all = Backend::candidates(true).into_iter();
            let all = all.filter(|b| *b != Backend::Banded);
            let times = all.filter_map(|b| Some((b.predicted(&counts)?, b)));
            let (cost, next) = (chosen.cost.expect("a time"), chosen.next.expect("another"));
            assert!(cost <= next.1);
            for (time, backend) in times {
                assert!(time >= next.1 || backend == chosen.backend, "{backend}");
            }
        }
    }

    #[test]
    fn what_is_compiled_in_alone_is_taken_where_it_can_be() {
        let dense = Backend::Dense(DenseOptions::default());
        let cg = Backend::ConjugateGradient(CgOptions::default());
        let of = |all: &[&Backend], indefinite| {
            Backend::fitting(all.iter().copied().cloned(), indefinite)
        };
        assert_eq!(of(&[&Backend::Banded], false), [Backend::Banded]);
        assert_eq!(of(&[&cg, &dense], false), vec![cg.clone()]);
        assert_eq!(of(&[&cg, &dense], true), vec![dense.clone()]);
        assert_eq!(of(&[&Backend::NalgebraSparse, &cg], true), []);
        let both = of(&[&Backend::Banded, &cg, &dense], true);
        assert_eq!(both, [Backend::Banded, dense]);
        let counts = Counts::in_order(&chain(3, 3)).expect("counted");
        let alone = Chosen::among(&[(cg.clone(), counts)]).expect("one");
        assert_eq!((&alone.backend, alone.cost), (&cg, None));
        assert!(alone.to_string().contains("no other"), "{alone}");
        assert!(Chosen::among(&[]).is_none());
    }

    #[test]
    fn nothing_works_before_the_analysis() {
        let a = SymBlockMatrix::zeros(Arc::new(chain(2, 3)));
        let too_early = Backend::Auto.create().expect("made").factorize(&a);
        assert!(matches!(too_early, Err(SolveError::OutOfOrder { .. })));
    }
}
