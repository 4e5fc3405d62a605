//! The times that `auto` predicts from: least squares over scenes of what the linear solve takes.
//!
//! For each way that a solver goes ([`Backend::way`]) times c ≥ 0 of the counts x are sought with the least Σ (c·x/t − 1)²
//! over the scenes, t the measured time. Of all subsets of the counts the smallest is taken whose error is hardly larger
//! than that of the best, so that counts that go together do not share what one of them explains.

use super::measure::{DENSE_ROWS, start, steps};
use crate::cases::Cases;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use taut_ground::choice::Choice;
use taut_ground::trajectory::Timing;
use taut_integrator::Stepper;
use taut_model::Constraint;
use taut_output::check::ExperimentError;
use taut_solver::{Backend, Counts, EliminationCost, TERMS};

/// Steps that are timed.
const STEPS: usize = 40;

/// Times that a larger subset must be better to be taken.
const BETTER: f64 = 1.1;

/// A measured solve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    pub scene: String,
    pub solver: String,
    /// The way that it goes there.
    pub way: String,
    /// The counts.
    pub terms: [f64; TERMS],
    /// Least time of a linear solve with one refinement \[ns].
    pub solve_ns: f64,
}

/// The times of a way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    pub way: String,
    /// Times of the counts \[ns].
    pub times: [f64; TERMS],
    pub scenes: usize,
    /// Root of the mean square of predicted over measured time − 1, and the largest.
    pub errors: [f64; 2],
}

/// The times of all ways, and what they come from.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Fit {
    pub ways: Vec<Fitted>,
    /// Every candidate on every scene.
    pub measured: Vec<Measured>,
}

/// Measures the scenes and fits every way.
///
/// # Errors
/// A scene that cannot be built.
pub fn fit(scenes: &[String], dt: f64, cases: &Cases) -> Result<Fit, ExperimentError> {
    let measured = cases.in_turn("fit", scenes, |scene| measured(scene, dt))?;
    let all = measured.all()?.concat();
    let mut ways: Vec<&str> = all.iter().map(|m| m.way.as_str()).collect();
    ways.sort_unstable();
    ways.dedup();
    let ways = ways.into_iter().filter_map(|way| fitted(way, &all));
    Ok(Fit {
        ways: ways.collect(),
        measured: all,
    })
}

/// Every candidate on a scene.
fn measured(name: &str, dt: f64) -> Result<Vec<Measured>, ExperimentError> {
    let scene = start(name, dt)?;
    let rows: usize = scene.constraints.iter().map(Constraint::rows).sum();
    let takes_part = |b: &Backend| rows <= DENSE_ROWS || !matches!(b, Backend::Dense(_));
    let mut found = Vec::new();
    for backend in Backend::candidates(false).into_iter().filter(takes_part) {
        let options = Choice::schur(backend.clone()).plain_options(dt);
        let mut stepper = Stepper::new(scene.clone(), options)?;
        let pattern = stepper.system().0.pattern().clone();
        let cost = stepper.elimination().cost.unwrap_or(EliminationCost::MAX);
        let order: Vec<usize> = (0..pattern.blocks()).collect();
        let border = backend.border_rows(&pattern, &order)?;
        let Some((way, terms)) = backend.way(&Counts::new(&pattern, cost, border)) else {
            continue;
        };
        steps(&mut stepper, 2)?;
        let reports = steps(&mut stepper, STEPS)?;
        found.push(Measured {
            scene: name.to_owned(),
            solver: backend.to_string(),
            way: way.to_owned(),
            terms,
            solve_ns: Timing::of(reports.iter().map(|r| r.phases.linear())).min,
        });
    }
    Ok(found)
}

/// The times of a way, if there are any that fit.
fn fitted(way: &str, all: &[Measured]) -> Option<Fitted> {
    let own: Vec<&Measured> = all.iter().filter(|m| m.way == way).collect();
    let a = DMatrix::from_fn(own.len(), TERMS, |i, j| own[i].terms[j] / own[i].solve_ns);
    let errors = |times: &DVector<f64>| (&a * times).map(|part| part - 1.0);
    let subsets = (1_usize..1 << TERMS).filter_map(|subset| {
        let times = of_subset(&a, subset)?;
        Some((subset.count_ones(), errors(&times).norm(), times))
    });
    let mut subsets: Vec<_> = subsets.collect();
    subsets.sort_by(|a, b| {
        (a.0, a.1)
            .partial_cmp(&(b.0, b.1))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let least = subsets.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
    let (_, norm, times) = subsets.into_iter().find(|s| s.1 <= BETTER * least)?;
    let mut taken = [0.0; TERMS];
    taken
        .iter_mut()
        .zip(&times)
        .for_each(|(to, from)| *to = *from);
    Some(Fitted {
        way: way.to_owned(),
        times: taken,
        scenes: own.len(),
        errors: [norm / (own.len() as f64).sqrt(), errors(&times).amax()],
    })
}

/// Least squares of the columns in a subset; `None` where a time would be negative or nothing tells the columns apart.
fn of_subset(a: &DMatrix<f64>, subset: usize) -> Option<DVector<f64>> {
    let columns: Vec<usize> = (0..TERMS).filter(|j| subset >> j & 1 == 1).collect();
    let mut part = a.select_columns(&columns);
    // Columns of the same size.
    let sizes: Vec<f64> = part.column_iter().map(|c| c.norm()).collect();
    if sizes.contains(&0.0) {
        return None;
    }
    for (mut column, size) in part.column_iter_mut().zip(&sizes) {
        column /= *size;
    }
    let ones = DVector::from_element(a.nrows(), 1.0);
    let solved = (part.tr_mul(&part)).cholesky()?.solve(&part.tr_mul(&ones));
    let mut times = DVector::zeros(TERMS);
    for ((&j, size), time) in columns.iter().zip(&sizes).zip(&solved) {
        times[j] = time / size;
    }
    (times.min() >= 0.0).then_some(times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_found_again() {
        let times = [700.0, 0.0, 2.0, 0.25, 0.0, 0.0, 0.0];
        let measured = |k: u32| {
            let (n, x) = (f64::from(k), f64::from(k * k % 17 + 1));
            let terms = [1.0, n, n * x, n * x * x, n, n * x, 0.0];
            let solve_ns = terms.iter().zip(times).map(|(t, c)| t * c).sum();
            Measured {
                scene: k.to_string(),
                solver: String::new(),
                way: "made up".to_owned(),
                terms,
                solve_ns,
            }
        };
        let all: Vec<Measured> = (3..60).map(measured).collect();
        let fitted = fitted("made up", &all).unwrap();
        assert!(fitted.errors[1] < 1e-6, "{fitted:?}");
        assert!((fitted.times[3] - 0.25).abs() < 1e-6 && fitted.times[1] < 1e-6);
    }
}
