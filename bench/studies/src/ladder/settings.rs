//! Settings of the main job, for its page.

use super::Config;
use taut_model::SceneError;
use taut_output::notation::number;
use taut_output::settings::{
    ONE_REFINEMENT, Setting, counts, numbers, seconds, set, solvers, step,
};

/// The settings of a run, as its page shows them.
///
/// # Errors
/// A hoist whose parameters contradict each other.
pub(super) fn settings(config: &Config) -> Result<Vec<Setting>, SceneError> {
    let scene = if config.own.is_empty() {
        let hoist = config.scene.resolve()?;
        set([
            ("scene", "hoist".to_owned()),
            ("length", format!("{} m", config.scene.length)),
            ("segments of", format!("{} kg", hoist.segment_mass)),
            ("YA", format!("{} N", number(hoist.stiffness.ea))),
            ("anchor moved", format!("{} m", config.scene.move_x)),
            ("segments", counts(&config.segments)),
            ("load/segment", numbers(&config.ratios)),
        ])
    } else {
        let mut own: Vec<_> = config.own.iter().map(|own| own.name.clone()).collect();
        own.dedup();
        set([("scenes", own.join(", "))])
    };
    let run = set([
        ("solvers", solvers(&config.choices)),
        ("iterations", counts(&config.iterations)),
        ("refinements", ONE_REFINEMENT.to_owned()),
        ("Δt", step(config.dt)),
        ("simulated", seconds(config.time)),
        ("stable for", seconds(config.stability_time)),
    ]);
    Ok([scene, run].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_have_units() {
        let settings = settings(&Config::default()).expect("a hoist");
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
