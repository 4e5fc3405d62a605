//! Scenes by name.

use crate::contact_scenes::ContactScene;
use crate::error::SceneError;
use crate::network::Network;
use crate::particles::ChainModel;
use crate::reeved::Reeved;
use crate::scene::Scene;
use crate::specimen::Specimen;

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

/// Does `$do` with the default parameters of the scene called `$name`; `None` where there is none.
macro_rules! with_named {
    ($name:expr, $params:ident => $do:expr) => {{
        let name: &str = $name;
        if name == "hoist" {
            let $params = $crate::HoistParams::default();
            Some($do)
        } else if name == "gantry" {
            let $params = $crate::GantryParams::default();
            Some($do)
        } else if let Some(model) = $crate::ChainModel::named(name) {
            let $params = $crate::ParticleChainParams::new(model);
            Some($do)
        } else if let Some(specimen) = $crate::Specimen::named(name) {
            let $params = $crate::SpecimenParams::new(specimen);
            Some($do)
        } else if let Some(network) = $crate::Network::named(name) {
            let $params = $crate::NetworkParams::new(network);
            Some($do)
        } else if let Some(reeved) = $crate::Reeved::named(name) {
            let $params = $crate::ReevedParams::new(reeved);
            Some($do)
        } else {
            $crate::ContactScene::named(name).map(|grounded| {
                let $params = $crate::ContactSceneParams::new(grounded);
                $do
            })
        }
    }};
}
#[cfg(feature = "toml")]
pub(crate) use with_named;

/// The scene called `name`, with its default parameters.
///
/// # Errors
/// [`SceneError::UnknownScene`], which lists the names that there are.
pub fn named(name: &str) -> Result<Scene, SceneError> {
    with_named!(name, params => params.build()).unwrap_or_else(|| Err(unknown(name)))
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
