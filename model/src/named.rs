//! Scenes by name.

use crate::error::SceneError;
use crate::gantry::GantryParams;
use crate::grounded::{Grounded, GroundedParams};
use crate::hoist::HoistParams;
use crate::network::{Network, NetworkParams};
use crate::particles::{ChainModel, ParticleChainParams};
use crate::reeved::{Reeved, ReevedParams};
use crate::scene::Scene;
use crate::specimen::{Specimen, SpecimenParams};

/// Names of the scenes that [`named`] builds.
pub const NAMES: [&str; 22] = [
    "hoist",
    "gantry",
    ChainModel::Links.scene_name(),
    ChainModel::MasslessCable.scene_name(),
    ChainModel::LoadEnforcement.scene_name(),
    ChainModel::Truncated.scene_name(),
    ChainModel::BendAngle.scene_name(),
    ChainModel::BendVector.scene_name(),
    Specimen::Pull.name(),
    Specimen::Twist.name(),
    Specimen::Bend.name(),
    Network::Ring.name(),
    Network::Junction.name(),
    Network::Cranes.name(),
    Network::Ladder.name(),
    Network::Net.name(),
    Reeved::Capstan.name(),
    Reeved::Tackle.name(),
    Reeved::Elevator.name(),
    Grounded::Stack.name(),
    Grounded::Floor.name(),
    Grounded::Pile.name(),
];

/// The scene called `name`, with its default parameters.
///
/// # Errors
/// [`SceneError::UnknownScene`], which lists the names that there are.
pub fn named(name: &str) -> Result<Scene, SceneError> {
    if name == "hoist" {
        HoistParams::default().build()
    } else if name == "gantry" {
        GantryParams::default().build()
    } else if let Some(model) = ChainModel::of_scene(name) {
        let chain = ParticleChainParams {
            model,
            ..ParticleChainParams::default()
        };
        chain.build()
    } else if let Some(specimen) = Specimen::named(name) {
        SpecimenParams::new(specimen).build()
    } else if let Some(network) = Network::named(name) {
        NetworkParams::new(network).build()
    } else if let Some(reeved) = Reeved::named(name) {
        ReevedParams::new(reeved).build()
    } else if let Some(grounded) = Grounded::named(name) {
        GroundedParams::new(grounded).build()
    } else {
        Err(unknown(name))
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
            "no scene is called `hoits`: choose one of hoist, gantry, particles-a, particles-b, particles-c, particles-d, \
             particles-e, particles-f, pull, twist, bend, ring, junction, cranes, ladder, net, \
             capstan, tackle, elevator, stack, floor, pile, or give a TOML file"
        );
    }
}
