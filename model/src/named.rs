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
    Grounded::Stack.name(),
    Grounded::Floor.name(),
    Grounded::Pile.name(),
];

/// Where a scene comes from: its parameters, before it is built.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SceneSource {
    /// The hoist and its parameters.
    Hoist(Box<HoistParams>),
    /// The gantry crane and its parameters.
    Gantry(Box<GantryParams>),
    /// The particle chain and its parameters.
    Particles(Box<ParticleChainParams>),
    /// A specimen and its parameters.
    Specimen(Box<SpecimenParams>),
    /// Cables with branches or loops and their parameters.
    Network(Box<NetworkParams>),
    /// Cables over sheaves and their parameters.
    Reeved(Box<ReevedParams>),
    /// Scenes on the ground and their parameters.
    Grounded(Box<GroundedParams>),
    /// Bodies and joints one by one.
    #[cfg(feature = "toml")]
    Explicit(Box<crate::scene_file::SceneText>),
}

/// Matches over the sources: `$do` for the parameters of any named scene, `$with_text` for the text of an explicit one.
macro_rules! each_source {
    ($source:expr, $params:ident => $do:expr, $text:pat => $with_text:expr) => {
        match $source {
            $crate::SceneSource::Hoist($params) => $do,
            $crate::SceneSource::Gantry($params) => $do,
            $crate::SceneSource::Particles($params) => $do,
            $crate::SceneSource::Specimen($params) => $do,
            $crate::SceneSource::Network($params) => $do,
            $crate::SceneSource::Reeved($params) => $do,
            $crate::SceneSource::Grounded($params) => $do,
            #[cfg(feature = "toml")]
            $crate::SceneSource::Explicit($text) => $with_text,
        }
    };
}
#[cfg(feature = "toml")]
pub(crate) use each_source;

impl SceneSource {
    /// The scene of that name with its default parameters.
    pub(crate) fn named(name: &str) -> Option<Self> {
        let chain = || ChainModel::named(name).map(ParticleChainParams::new);
        let specimen = || Specimen::named(name).map(SpecimenParams::new);
        let network = || Network::named(name).map(NetworkParams::new);
        let reeved = || Reeved::named(name).map(ReevedParams::new);
        let grounded = || Grounded::named(name).map(GroundedParams::new);
        match name {
            "hoist" => Some(Self::Hoist(Box::default())),
            "gantry" => Some(Self::Gantry(Box::default())),
            _ => (chain().map(|params| Self::Particles(Box::new(params))))
                .or_else(|| specimen().map(|params| Self::Specimen(Box::new(params))))
                .or_else(|| network().map(|params| Self::Network(Box::new(params))))
                .or_else(|| reeved().map(|params| Self::Reeved(Box::new(params))))
                .or_else(|| grounded().map(|params| Self::Grounded(Box::new(params)))),
        }
    }

    /// Builds the scene.
    ///
    /// # Errors
    /// The first parameter, body or joint that is wrong.
    pub fn build(&self) -> Result<Scene, SceneError> {
        each_source!(self, params => params.build(), text => text.build())
    }
}

/// The scene called `name`, with its default parameters.
///
/// # Errors
/// [`SceneError::UnknownScene`], which lists the names that there are.
pub fn named(name: &str) -> Result<Scene, SceneError> {
    SceneSource::named(name)
        .ok_or_else(|| unknown(name))?
        .build()
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
