//! Scenes by name.

use crate::error::SceneError;
use crate::hoist::HoistParams;
use crate::particles::{self, ParticleChainParams};
use crate::scene::Scene;
use crate::specimen::{Specimen, SpecimenParams};

/// Names of the scenes that [`named`] builds.
pub const NAMES: [&str; 5] = ["hoist", particles::NAME, "pull", "twist", "bend"];

/// The scene called `name`, with its default parameters.
///
/// # Errors
/// [`SceneError::UnknownScene`], which lists the names that there are.
pub fn named(name: &str) -> Result<Scene, SceneError> {
    match name {
        "hoist" => HoistParams::default().build(),
        particles::NAME => ParticleChainParams::default().build(),
        _ => match Specimen::named(name) {
            Some(specimen) => SpecimenParams::new(specimen).build(),
            None => Err(unknown(name)),
        },
    }
}

pub(crate) fn unknown(name: &str) -> SceneError {
    SceneError::UnknownScene {
        name: name.to_owned(),
        known: NAMES.map(str::to_owned).to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_builds_and_is_the_scene_s() {
        for name in NAMES {
            let scene = named(name).expect("builds");
            assert_eq!(scene.name, name);
            assert_eq!(scene.validate(), Ok(()));
        }
    }

    #[test]
    fn unknown_name_lists_the_known() {
        let message = named("hoits").expect_err("no such scene").to_string();
        assert_eq!(
            message,
            "no scene is called `hoits`: choose one of hoist, particles-a, pull, twist, bend, or give a TOML file"
        );
    }
}
