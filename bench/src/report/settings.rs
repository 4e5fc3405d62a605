//! What each benchmark was set to, as its page and its `NAME.report.json` say: a name and a value with its unit.

use super::charts::distinct;
use crate::choice::Choice;
use crate::matrix::solve;
use crate::notation::number;
use crate::{
    accuracy, energy, engines, iterative, kernels, ladder, linear, scenes, shocks, stability,
};
use taut_model::{Network, SceneError};
use taut_solver::Backend;

/// A name and a value.
pub type Setting = (String, String);

fn set<const N: usize>(pairs: [(&str, String); N]) -> Vec<Setting> {
    pairs.map(|(name, value)| (name.to_owned(), value)).to_vec()
}

/// Values beside each other; a name may hold a comma.
fn list<T>(values: &[T], shown: impl Fn(&T) -> String) -> String {
    let shown: Vec<String> = values.iter().map(shown).collect();
    let has_comma = shown.iter().any(|text| text.contains(','));
    shown.join(if has_comma { "; " } else { ", " })
}

/// Most numbers that are named one by one.
const MOST: usize = 14;

/// Numbers in order; of many the first and the last.
fn numbers(values: &[f64]) -> String {
    match values {
        [first, .., last] if values.len() > MOST => {
            format!(
                "{} from {} to {}",
                values.len(),
                number(*first),
                number(*last)
            )
        }
        _ => list(values, |x| number(*x)),
    }
}

fn counts(values: &[usize]) -> String {
    list(values, ToString::to_string)
}

fn seconds(time: f64) -> String {
    format!("{} s", number(time))
}

/// A time step, as a fraction of a second where it is one.
fn step(dt: f64) -> String {
    let rate = 1.0 / dt;
    if rate > 1.0 && (rate - rate.round()).abs() < 1e-6 * rate {
        format!("1/{rate:.0} s")
    } else {
        seconds(dt)
    }
}

fn solvers(choices: &[Choice]) -> String {
    list(choices, Choice::family)
}

/// Of direct solvers on the step.
const ONE_REFINEMENT: &str = "1 for direct solvers; umfpack/kkt its own, iterations none";

/// Of the main job.
///
/// # Errors
/// A hoist whose parameters contradict each other.
pub fn main_job(config: &ladder::Config) -> Result<Vec<Setting>, SceneError> {
    let hoist = config.scene.resolve()?;
    Ok(set([
        ("scene", "hoist".to_owned()),
        ("length", format!("{} m", config.scene.length)),
        ("segments of", format!("{} kg", hoist.segment_mass)),
        ("YA", format!("{} N", number(hoist.stiffness.ea))),
        ("anchor moved", format!("{} m", config.scene.move_x)),
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("solvers", solvers(&config.choices)),
        ("iterations", counts(&config.iterations)),
        ("refinements", ONE_REFINEMENT.to_owned()),
        ("Δt", step(config.dt)),
        ("simulated", seconds(config.time)),
        ("stable for", seconds(config.stability_time)),
    ]))
}

/// Of `--sweep accuracy`.
#[must_use]
pub fn accuracy(config: &accuracy::Config) -> Vec<Setting> {
    let segments = distinct(config.cases.iter().map(|c| c.segments));
    let ratios = distinct(config.cases.iter().map(|c| c.mass_ratio));
    set([
        ("segments", counts(&segments)),
        ("load/segment", numbers(&ratios)),
        ("Δt", list(&config.rates, |rate| step(1.0 / rate))),
        ("simulated", seconds(config.time)),
        ("steps", list(&config.settings, |s| s.name.to_owned())),
        ("solvers", solvers(&config.choices)),
        ("their load/segment", numbers(&config.choice_ratios)),
        ("iterations", counts(&config.iterations)),
        ("refinements", "1; of direct solvers 0, 1, 2".to_owned()),
    ])
}

/// Of `--sweep shocks`.
#[must_use]
pub fn shocks(config: &shocks::Config) -> Vec<Setting> {
    set([
        ("shocks", list(&config.shocks, ToString::to_string)),
        ("steps", list(&config.settings, |s| s.name.clone())),
        ("load/segment", numbers(&config.ratios)),
        ("lengths", format!("{} m", numbers(&config.lengths))),
        ("Δt", step(1.0 / 60.0)),
        ("simulated", seconds(config.time)),
        (
            "references",
            format!("{} steps a frame", counts(&config.fineness)),
        ),
        ("timed", format!("{} times", config.repeats)),
    ])
}

/// Of `--sweep stability`.
#[must_use]
pub fn stability(config: &stability::Config) -> Vec<Setting> {
    let segments = distinct(config.cases.iter().map(|c| c.segments));
    set([
        ("cells", config.cases.len().to_string()),
        ("segments", counts(&segments)),
        ("load/segment", numbers(&config.ratios)),
        ("Δt", step(config.dt)),
        ("simulated", seconds(config.time)),
    ])
}

/// Of `--sweep energy`.
#[must_use]
pub fn energy(config: &energy::Config) -> Vec<Setting> {
    let setting = |(scheme, stiffness): &energy::Setting| format!("{scheme} K {stiffness}");
    set([
        ("segments of swings", config.segments.to_string()),
        ("their load/segment", numbers(&config.ratios)),
        ("schemes", list(&config.settings, setting)),
        ("Δt", step(config.dt)),
        ("finer step", step(config.dt / config.finer as f64)),
        ("amplitudes at", format!("{} s", numbers(&config.moments))),
        ("steps of bands", number(config.steps as f64)),
        ("Δt of spins", list(&config.spin_dts, |dt| step(*dt))),
        ("simulated spins", seconds(config.spin_time)),
    ])
}

/// Of `--sweep linear`.
#[must_use]
pub fn linear(config: &linear::Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("poses", list(&config.poses, ToString::to_string)),
        ("solvers", solvers(&config.choices)),
        ("refinements", counts(&config.refinements)),
        ("largest strain", number(config.max_strain)),
        ("scheme", config.step.scheme.to_string()),
        ("Δt", step(config.step.dt)),
    ])
}

/// Of `--sweep kernels`.
#[must_use]
pub fn kernels(config: &kernels::Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        (
            "rows of a joint",
            list(&config.joints, |joint| joint.rows().to_string()),
        ),
        ("solvers", list(&config.rivals, ToString::to_string)),
        ("time of each", seconds(config.share.as_secs_f64())),
        ("Δt", step(1.0 / 60.0)),
        ("threads", "1".to_owned()),
    ])
}

/// Of `--sweep iterative`.
#[must_use]
pub fn iterative(config: &iterative::Config) -> Vec<Setting> {
    let network = |(network, size): &(Network, usize)| format!("{} of {size}", network.name());
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("networks", list(&config.networks, network)),
        ("solvers", solvers(&config.choices)),
        ("errors", numbers(&config.targets)),
        ("iterations at most", config.limit.to_string()),
        ("Δt", step(config.dt)),
        ("steps before", iterative::WARM_UP.to_string()),
    ])
}

/// Of `--sweep engines`.
#[must_use]
pub fn engines(config: &engines::Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("swing from", format!("{} rad", config.angle)),
        ("frame", step(engines::motion::FRAME)),
        ("simulated", seconds(config.time)),
        ("error within", format!("{} of the length", config.bar)),
    ])
}

/// Of `--scene`.
#[must_use]
pub fn scenes(config: &scenes::Config) -> Vec<Setting> {
    let sizes = |(network, sizes): &(Network, Vec<usize>)| {
        format!("{} of {}", network.name(), counts(sizes))
    };
    set([
        ("scenes", list(&config.sizes, sizes)),
        ("load/segment", numbers(&config.ratios)),
        ("solvers", solvers(&config.choices)),
        ("iterations", counts(&config.iterations)),
        ("refinements", ONE_REFINEMENT.to_owned()),
        ("Δt", step(config.dt)),
        ("simulated", seconds(config.time)),
    ])
}

/// Of `--matrix`.
#[must_use]
pub fn matrix(config: &solve::Config) -> Vec<Setting> {
    let family = |backend: &Backend| Choice::schur(backend.clone()).family();
    set([
        ("solvers", list(&config.backends, family)),
        ("iterations", counts(&config.iterations)),
        ("time of each", seconds(config.budget.as_secs_f64())),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_short_and_have_units() {
        assert_eq!(step(1.0 / 60.0), "1/60 s");
        assert_eq!(step(0.015), "0.015 s");
        assert_eq!(numbers(&[1.0, 1e3, 1e5]), "1, 10³, 10⁵");
        let many: Vec<f64> = (0..25).map(|k| 10_f64.powf(f64::from(k) / 4.0)).collect();
        assert_eq!(numbers(&many), "25 from 1 to 10⁶");
        let settings = main_job(&ladder::Config::default()).expect("a hoist");
        let value = |name: &str| {
            settings
                .iter()
                .find(|(n, _)| n == name)
                .map(|s| s.1.as_str())
        };
        assert_eq!(value("Δt"), Some("1/60 s"));
        assert_eq!(value("YA"), Some("2·10⁷ N"));
        assert_eq!(value("segments"), Some("24, 100"));
    }
}
