//! Systems that tempt a solver into false claims: indefinite, graded, singular to rounding, with growth.

use super::split_mix;
use super::systems::{Random, Shape, System, finish, positive_definite, quasi_definite};
use crate::{BlockPattern, LinearSolver, SolveError, Status, SymBlockMatrix, backward_error};
use std::sync::Arc;

/// Counts and largest error of a study's solves.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Study {
    /// Systems given.
    pub systems: usize,
    /// Solutions claimed.
    pub claims: usize,
    /// Systems refused with a typed error; all others are answers that claim nothing.
    pub refused: usize,
    /// Largest normwise backward error of a claim; no unit.
    pub backward_error: f64,
    /// Claims beyond [`FALSE`].
    pub false_claims: usize,
}

/// Normwise backward error beyond which a claim of a direct solver is false; of an iteration to a tolerance of 10⁻¹² as
/// much times √n, the most that ‖r‖₂ ≤ 10⁻¹² ‖b‖₂ allows.
pub const FALSE: f64 = 1e-12;

/// Kinds of system, in turn by seed: definite, quasi-definite with any ratios, indefinite, with
/// tiny diagonals, graded, singular to rounding, saddles without Σ, Hilbert's, Wilkinson's as [0 W;
/// Wᵀ 0]; and each of these scaled by 10^±100.
const KINDS: u64 = 9;

/// Gives the systems of those seeds to a solver, fresh from its making, and compares what it says with residuals in
/// 32 digits. Allocates.
///
/// # Errors
/// As for [`adverse`].
pub fn claims_study(
    solver: &mut dyn LinearSolver,
    seeds: std::ops::Range<u64>,
) -> Result<Study, SolveError> {
    let mut study = Study::default();
    for seed in seeds {
        let System { a, b, .. } = &adverse(seed)?;
        study.systems += 1;
        let mut x = vec![0.0; b.len()];
        let prepared = solver
            .analyze(a.pattern())
            .and_then(|_| solver.factorize(a));
        let Ok(report) = prepared.and_then(|_| solver.solve(a, b, &mut x)) else {
            study.refused += 1;
            continue;
        };
        if !report.is_claim() {
            continue;
        }
        study.claims += 1;
        let error = backward_error(a, b, &x)?.normwise;
        let error = if error.is_nan() { f64::INFINITY } else { error };
        let norms = (b.len() as f64).sqrt();
        let excused = if report.status == Status::Direct {
            1.0
        } else {
            norms
        };
        study.false_claims += usize::from(error > FALSE * excused);
        study.backward_error = study.backward_error.max(error);
    }
    Ok(study)
}

/// The system of a seed.
///
/// # Errors
/// None that these sizes could meet: those of [`BlockPattern::new`].
pub fn adverse(seed: u64) -> Result<System, SolveError> {
    let mut bits = split_mix(seed);
    let shape = Shape::ALL[(seed / (6 * KINDS) % 3) as usize];
    let mut system = match seed % KINDS {
        0 => positive_definite(shape, &mut bits),
        1 | 6 => quasi_definite(shape, &mut bits),
        7 => full(&[2 + bits() as usize % 13], &mut bits),
        8 => full(&[2 + bits() as usize % 59; 2], &mut bits),
        _ => positive_definite(shape, &mut bits),
    }?;
    let mut random = Random(&mut bits);
    let n = system.a.dim();
    let a = &mut system.a;
    let kind = match seed % KINDS {
        0 => "definite",
        1 => {
            let (most, least) = (
                random.log_uniform(1.0, 1e12),
                random.log_uniform(1e-18, 1.0),
            );
            entries(a, |r, c, v| match (r == c, v > 0.0) {
                (true, true) => v * most,
                (true, false) => v * least,
                _ => v,
            });
            "quasi-definite"
        }
        2 => {
            entries(a, |_, _, _| random.uniform());
            "indefinite"
        }
        3 => {
            let tiny = random.log_uniform(1e-22, 1e-6);
            entries(a, |r, c, _| {
                random.uniform() * if r == c { tiny } else { 1.0 }
            });
            "tiny diagonal"
        }
        4 => {
            let (decades, definite) = (random.log_uniform(1.0, 20.0), random.uniform() > 0.0);
            let size = |r: usize| 10_f64.powf(-decades * r as f64 / n as f64);
            entries(a, |r, c, v| {
                size(r) * size(c) * if definite { v } else { random.uniform() }
            });
            "graded"
        }
        5 => {
            // Some rows are others, or their sums to rounding.
            let v: Vec<[f64; 3]> = (0..n).map(|_| [(); 3].map(|()| random.uniform())).collect();
            let signs = [1.0, random.uniform().signum(), random.uniform().signum()];
            entries(a, |r, c, _| {
                (0..3).map(|k| signs[k] * v[r][k] * v[c][k]).sum()
            });
            "singular to rounding"
        }
        6 => {
            entries(a, |r, c, v| if r == c && v < 0.0 { 0.0 } else { v });
            "saddle"
        }
        7 => {
            let shift = [0.0, -0.1][random.below(2)];
            entries(a, |r, c, _| {
                1.0 / (r + c + 1) as f64 + if r == c { shift } else { 0.0 }
            });
            "Hilbert"
        }
        _ => {
            let half = n / 2;
            entries(a, |r, c, _| match (r.checked_sub(half), c) {
                (Some(r), c) if c < half => match r.cmp(&c) {
                    _ if c == half - 1 => 1.0,
                    std::cmp::Ordering::Less => 0.0,
                    std::cmp::Ordering::Equal => 1.0,
                    std::cmp::Ordering::Greater => -15.0 / 16.0,
                },
                _ => 0.0,
            });
            "Wilkinson"
        }
    };
    let scale = match seed / KINDS % 6 {
        0 => 1e100,
        1 => 1e-100,
        _ => 1.0,
    };
    entries(a, |_, _, v| v * scale);
    system.name = format!("{kind}, scaled by {scale:e}, seed {seed}: {}", system.name);
    Ok(system)
}

/// Blocks of those sizes, all of them stored, and zero.
fn full(sizes: &[usize], bits: &mut dyn FnMut() -> u64) -> Result<System, SolveError> {
    let all = 0..sizes.len();
    let pairs: Vec<_> = all.flat_map(|i| (0..i).map(move |j| (i, j))).collect();
    let a = SymBlockMatrix::zeros(Arc::new(BlockPattern::new(sizes, &pairs)?));
    Ok(finish(a, "full", &mut Random(bits)))
}

/// Sets each entry (row, column, value), symmetrically.
fn entries(a: &mut SymBlockMatrix, mut f: impl FnMut(usize, usize, f64) -> f64) {
    let p = a.pattern().clone();
    for j in 0..p.blocks() {
        for k in p.column(j) {
            let (i, m, n) = (p.row(k), p.size(p.row(k)), p.size(j));
            let block = a.block_mut(k);
            for c in 0..n {
                for r in if i == j { c } else { 0 }..m {
                    let value = f(p.rows(i).start + r, p.rows(j).start + c, block[r + m * c]);
                    block[r + m * c] = value;
                    if i == j {
                        block[c + m * r] = value;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Backend;

    /// Right-hand sides whose squares underflow, wholly or in part.
    #[test]
    fn small_numbers_are_not_claimed_to_converge() {
        for name in [
            "cg:none",
            "cg",
            "gauss-seidel",
            "gauss-seidel:groups",
            "minres",
        ] {
            let backend: Backend = name.parse().unwrap();
            let Ok(mut solver) = backend.create() else {
                continue;
            };
            for (seed, size) in
                (0..80).flat_map(|s| [1e-170, 1e-162, 3e-161, 1e-152].map(|b| (s, b)))
            {
                let System { a, b, .. } = &adverse(9 * (6 * seed + 2)).unwrap();
                let largest = crate::norm_inf(b);
                let b: Vec<f64> = b.iter().map(|b| b / largest * size).collect();
                let mut x = vec![0.0; b.len()];
                solver.analyze(a.pattern()).unwrap();
                solver.factorize(a).unwrap();
                // Again, from the last solution.
                for _ in 0..2 {
                    let report = solver.solve(a, &b, &mut x).unwrap();
                    let error = backward_error(a, &b, &x).unwrap().normwise;
                    let holds = !report.is_claim() || error < 1e-10;
                    assert!(holds, "{name} {size:e}: {error:e}");
                }
            }
        }
    }

    /// Condition 2.6, and a first pivot whose elimination leaves nothing of the rest.
    #[test]
    fn a_tiny_first_pivot_is_corrected() {
        let pattern = Arc::new(BlockPattern::new(&[1, 1], &[(0, 1)]).unwrap());
        let mut a = SymBlockMatrix::zeros(pattern.clone());
        for first in [1e-20, 1e-12, -1e-16] {
            a.values_mut().copy_from_slice(&[first, 1.0, 1.0]);
            for name in ["banded", "faer:ldlt", "faer:lu", "umfpack", "dense:double"] {
                let backend: Backend = name.parse().unwrap();
                let Ok(mut solver) = backend.create() else {
                    continue;
                };
                solver.analyze(&pattern).unwrap();
                solver.factorize(&a).unwrap();
                let mut x = [0.0; 2];
                let report = solver.solve(&a, &[1.0, 2.0], &mut x).unwrap();
                assert_eq!(report.status, Status::Direct, "{name} {first}");
                let error = backward_error(&a, &[1.0, 2.0], &x).unwrap().normwise;
                assert!(error < 1e-15, "{name} {first}: {error:e} {x:?}");
            }
        }
    }
}
