//! H47: ring, junction, cranes, ladder and net with every solver: the multipliers of a common state against the KKT
//! system in 32 digits, and the place of the load after a second against that of the reference solver.

use crate::cases::Cases;
use crate::scenes::{self, BAR, Config, Record};
use indicatif::ProgressBar;
use std::time::Duration;
use taut_model::{Network, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Iterations that the iterative solvers have in each solve.
const ITERATIONS: usize = 1000;

/// Load over segment mass of the scenes on which claims are audited.
const MASS_RATIO: f64 = 100.0;

/// The scenes that are compared: in their smallest size, or the two smallest and the largest.
pub(super) fn config(quick: bool) -> Config {
    let own = quick.then(Config::quick).unwrap_or_default();
    let chosen = |sizes: Vec<usize>| -> Vec<usize> {
        let last = sizes.len().saturating_sub(1);
        let some = |i: &usize| *i == 0 || (!quick && (*i == 1 || *i == last));
        (0..sizes.len()).filter(some).map(|i| sizes[i]).collect()
    };
    Config {
        sizes: own
            .sizes
            .into_iter()
            .map(|(network, sizes)| (network, chosen(sizes)))
            .collect(),
        iterations: vec![ITERATIONS],
        timing_budget: Duration::ZERO,
        ..own
    }
}

/// The networks in their smallest size, swinging.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let config = Config::quick();
    let swinging = Network::ALL.into_iter().filter_map(|network| {
        let (_, sizes) = config.sizes.iter().find(|(n, _)| *n == network)?;
        let params = config.params(network, *sizes.first()?, MASS_RATIO);
        Some(scenes::swinging(&params, config.dt))
    });
    Ok(swinging.collect::<Result<_, _>>()?)
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let results = scenes::run(&config(quick), &Cases::default().shown_by(progress.clone()))?;
    let mut checks = Vec::new();
    for network in Network::ALL {
        let own = results.records.iter().filter(|r| r.scene == network.name());
        let mut sizes: Vec<usize> = own.clone().map(|r| r.size).collect();
        sizes.dedup();
        for size in sizes {
            let direct: Vec<&Record> = own
                .clone()
                .filter(|r| r.size == size && r.iterations == 0)
                .collect();
            checks.extend(worst(network, size, &direct));
        }
    }
    for r in results.records.iter().filter(|r| r.iterations > 0) {
        checks.push(iterative(r));
    }
    Ok(checks.into())
}

/// The direct solver with the largest error, and the one with the load farthest away.
fn worst(network: Network, size: usize, rows: &[&Record]) -> Vec<Check> {
    let of = |what: &str, reference: &str, error: fn(&Record) -> Option<f64>| {
        // Too large for a run.
        if rows.iter().all(|r| error(r).is_none() && r.error.is_none()) {
            return None;
        }
        // A solver that failed has no number, which counts as the largest.
        let value = |r: &Record| error(r).unwrap_or(f64::INFINITY);
        let worst = rows.iter().max_by(|a, b| value(a).total_cmp(&value(b)))?;
        let ours = format!("{:.1e} with {}", value(worst), worst.backend);
        let case = format!(
            "{} {size}: {what}, {} direct solvers",
            network.name(),
            rows.len()
        );
        let note = worst.error.clone().unwrap_or_default();
        Some(Check::within(case, reference, ours, value(worst), BAR).noting(note))
    };
    let checks = [
        of("multipliers", "32 digits", |r| r.forward_error),
        of("load after 1 s", "banded", |r| r.load_difference),
    ];
    checks.into_iter().flatten().collect()
}

/// An iteration within the bar passes; one that says of itself that it did not converge is at its limit; a false claim
/// fails.
fn iterative(r: &Record) -> Check {
    let error = r.forward_error.unwrap_or(f64::INFINITY);
    let case = format!("{} {}: {}", r.scene, r.size, r.backend);
    let ours = format!(
        "{error:.1e}, claims {} after {}",
        r.status, r.iterations_used
    );
    let check = Check::within(case, "32 digits", ours, error, BAR)
        .by("one solve from the multipliers of the step before, to its own tolerance");
    match (&r.error, &r.said) {
        (None, Some(said)) => check.unless_claimed(said),
        (failed, _) => check.noting(failed.clone().unwrap_or_default()),
    }
}
