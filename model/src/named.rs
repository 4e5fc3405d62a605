//! Scenes by name.

use crate::error::SceneError;
use crate::scene::Scene;
use crate::{ChainModel, ContactScene, Network, Reeved, Specimen};
use crate::{ContactSceneParams, GantryParams, HoistParams, NetworkParams};
use crate::{ParticleChainParams, ReevedParams, SpecimenParams};

/// Names of the scenes that [`named`] builds.
pub const NAMES: [&str; 22] = [
    "hoist",
    "gantry",
    ChainModel::Links.name(),
    ChainModel::MasslessCable.name(),
    ChainModel::LoadEnforcement.name(),
    ChainModel::Truncated.name(),
    ChainModel::BendAngle.name(),
    ChainModel::BendVector.name(),
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
    ContactScene::Stack.name(),
    ContactScene::Floor.name(),
    ContactScene::Pile.name(),
];

/// The scene called `name`, with its default parameters.
///
/// # Errors
/// [`SceneError::UnknownScene`], which lists the names that there are.
pub fn named(name: &str) -> Result<Scene, SceneError> {
    let built = HoistParams::of_scene(name).map(|params| params.build());
    let built = built.or_else(|| Some(GantryParams::of_scene(name)?.build()));
    let built = built.or_else(|| Some(ParticleChainParams::of_scene(name)?.build()));
    let built = built.or_else(|| Some(SpecimenParams::of_scene(name)?.build()));
    let built = built.or_else(|| Some(NetworkParams::of_scene(name)?.build()));
    let built = built.or_else(|| Some(ReevedParams::of_scene(name)?.build()));
    let built = built.or_else(|| Some(ContactSceneParams::of_scene(name)?.build()));
    built.unwrap_or_else(|| Err(unknown(name)))
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
