//! Tests that every backend over a library must pass; each takes the backend.

#![allow(dead_code)] // where no backend that uses it is compiled in

use crate::{
    AnalyzeReport, Backend, BlockPattern, DenseOptions, FactorReport, LinearSolver, SolveError,
    SolveReport, Status, SymBlockMatrix, backward_error,
};
use std::sync::Arc;

/// Pseudo-random numbers in −1 … 1.
pub(crate) fn noise(seed: u32) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX) * 2.0 - 1.0
    }
}

/// Couplings of a chain of `n` blocks.
fn chain(n: usize) -> Vec<(usize, usize)> {
    (1..n).map(|i| (i - 1, i)).collect()
}

/// Patterns of all kinds: chains, loops, borders, nearly full, uncoupled, with single rows and empty blocks.
pub(crate) fn patterns() -> Vec<Arc<BlockPattern>> {
    let mixed: Vec<usize> = (0..14).map(|i| if i % 3 == 0 { 3 } else { 6 }).collect();
    let full: Vec<_> = (0..16).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
    let cases = [
        (vec![6; 12], chain(12)),
        (mixed.clone(), [chain(14), vec![(0, 13)]].concat()),
        (
            mixed,
            [chain(12), vec![(0, 12), (11, 12), (3, 13), (8, 13)]].concat(),
        ),
        (vec![6; 16], full),
        (vec![1], vec![]),
        (vec![5; 4], vec![]),
        (vec![0, 3, 0, 2, 1], vec![(0, 1), (1, 2), (1, 3), (3, 4)]),
    ];
    cases
        .into_iter()
        .map(|(sizes, couplings)| Arc::new(BlockPattern::new(&sizes, &couplings).unwrap()))
        .collect()
}

/// A positive definite matrix: strong diagonal, everything else random.
pub(crate) fn positive_definite(pattern: &Arc<BlockPattern>, seed: u32) -> SymBlockMatrix {
    let (mut a, mut noise) = (SymBlockMatrix::zeros(pattern.clone()), noise(seed));
    a.values_mut().iter_mut().for_each(|v| *v = noise());
    for j in 0..pattern.blocks() {
        let n = pattern.size(j);
        let block = a.block_mut(pattern.column(j).start);
        for r in 0..n {
            for c in 0..r {
                block[c + n * r] = block[r + n * c];
            }
            block[r * (n + 1)] = 120.0 + 20.0 * noise();
        }
    }
    a
}

/// [M Jᵀ; J −Σ] with the rows of Σ (small) in every other block, as bodies and joints alternate.
pub(crate) fn quasi_definite(pattern: &Arc<BlockPattern>, seed: u32) -> SymBlockMatrix {
    let mut a = positive_definite(pattern, seed);
    for j in (1..pattern.blocks()).step_by(2) {
        a.block_mut(pattern.column(j).start)
            .iter_mut()
            .for_each(|v| *v *= -1e-4);
        // Couplings between two blocks of Σ must be as small.
        for k in pattern
            .column(j)
            .filter(|&k| pattern.row(k) > j && pattern.row(k) % 2 == 1)
        {
            a.block_mut(k).iter_mut().for_each(|v| *v *= 1e-4);
        }
    }
    a
}

/// A right-hand side.
fn right_side(n: usize) -> Vec<f64> {
    (0..n).map(|i| (i as f64).sin() + 0.1).collect()
}

/// Factorises and solves; the componentwise backward error has to be at roundoff.
pub(crate) fn solves(solver: &mut dyn LinearSolver, a: &SymBlockMatrix) {
    let b = right_side(a.dim());
    let mut x = vec![f64::NAN; a.dim()];
    solver.factorize(a).unwrap();
    for b in [b.clone(), b.iter().map(|b| 1.0 - b).collect()] {
        solver.solve(a, &b, &mut x).unwrap();
        let e = backward_error(a, &b, &x).unwrap();
        let holds = e.componentwise <= 1e-13;
        assert!(holds, "{} on {:?}: {e:?}", solver.name(), a.pattern());
    }
}

/// Springs between five nodes that nothing holds, in chains and rings; and the same with a grain of 10⁻¹² of each more at
/// both of its nodes, which holds them. The weaker those of some node, from a third to that over 2 to the power of `digits` − 1, the more of its pivot
/// is what rounding made of the others.
pub(crate) fn springs(digits: i32) -> impl Iterator<Item = (String, [SymBlockMatrix; 2])> {
    let stiffness = |digits: i32| {
        let weak = 0.5_f64.powi(digits) / 3.0;
        [
            [0.3, 0.7, 1.1, 0.9 * weak, 0.4 * weak],
            [0.3, 0.7 * weak, 1.1 * weak, 0.9, 0.0],
            [0.3, 0.7, 1.1, 0.9 * weak, 0.0],
        ]
    };
    (0..digits).flat_map(stiffness).map(|stiffness| {
        let mut ends = vec![(0, 1), (1, 2), (2, 3), (3, 4)];
        if stiffness[4] > 0.0 {
            ends.push((0, 4));
        }
        let pattern = Arc::new(BlockPattern::new(&[1; 5], &ends).unwrap());
        let system = |grain: f64| {
            let mut a = SymBlockMatrix::zeros(pattern.clone());
            let mut add = |i: usize, j: usize, k: f64| {
                a.block_mut(pattern.find(i.max(j), i.min(j)).unwrap())[0] += k;
            };
            for (&(i, j), &k) in ends.iter().zip(&stiffness) {
                add(i, i, k * (1.0 + grain));
                add(j, j, k * (1.0 + grain));
                add(i, j, -k);
            }
            a
        };
        (format!("{stiffness:?}"), [0.0, 1e-12].map(system))
    })
}

/// Dependence is seen whichever pivot it leaves weak, and nothing else is taken for it.
pub(crate) fn sees_dependence(solver: &mut dyn LinearSolver) {
    // Two less than without roots, whose squares are twice as inexact.
    for (name, [loose, firm]) in springs(23) {
        solver.analyze(loose.pattern()).unwrap();
        let refused = solver.factorize(&loose);
        let singular = matches!(refused, Err(SolveError::Singular { .. }));
        assert!(singular, "{name}: {refused:?}");
        solves(solver, &firm);
    }
}

/// The dense solver with a fault of that name, or with none.
pub(crate) struct Faulty {
    pub(crate) inner: Box<dyn LinearSolver>,
    pub(crate) fault: &'static str,
}

impl Faulty {
    pub(crate) fn dense(fault: &'static str) -> Self {
        let inner = Backend::Dense(DenseOptions::default()).create().unwrap();
        Self { inner, fault }
    }
}

impl LinearSolver for Faulty {
    fn name(&self) -> &'static str {
        "faulty"
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        self.inner.analyze(pattern)
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        let result = self.inner.factorize(a);
        match self.fault {
            "forgets the pattern" => Err(SolveError::PatternChanged),
            "keeps an old factorisation" => Ok(FactorReport::default()),
            _ => result,
        }
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        let given = x.to_vec();
        let result = self.inner.solve(a, b, x);
        if self.fault == "nothing is an error" {
            return Ok(SolveReport::DIRECT);
        }
        let mut report = result?;
        let Some(last) = x.len().checked_sub(1) else {
            return Ok(report);
        };
        match self.fault {
            "wrong in the seventh digit" => x.iter_mut().for_each(|x| *x *= 1.0 + 1e-7),
            "gives up" => report.status = Status::IterationLimit,
            "writes NaN" => x[last] = f64::NAN,
            "writes less" => x[last] = given[last],
            "writes more" => x[given.len()] = 0.0,
            "reads the guess" => x[0] += given[0],
            "claims falsely" => x[0] *= 1.0 + 1e-6,
            _ => {}
        }
        Ok(report)
    }

    fn solve_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        match self.fault {
            "stops after two columns" => {
                let (b, x) = (&b[..2 * a.dim()], &mut x[..2 * a.dim()]);
                self.inner.solve_many(a, b, x)
            }
            "forgets the last column" => {
                let report = self.inner.solve_many(a, b, x);
                x[b.len() - a.dim()..].fill(0.0);
                report
            }
            _ => self.inner.solve_many(a, b, x),
        }
    }
}
