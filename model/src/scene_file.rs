//! Scenes as TOML text, read and written; with overrides `KEY=VALUE`. This is where the format is explained.
//!
//! A text is **one table** with the parameters of a named scene, all of which have defaults: `[hoist]` with the fields of
//! [`HoistParams`], `[gantry]` with those of [`GantryParams`], `[particles-a]` … `[particles-f]` with those of
//! [`ParticleChainParams`], `[pull]`, `[twist]` or `[bend]` with those of [`SpecimenParams`], `[ring]`, `[junction]`,
//! `[cranes]`, `[ladder]` or `[net]` with those of [`NetworkParams`], `[capstan]`, `[tackle]` or `[elevator]` with those of
//! [`ReevedParams`], `[stack]`, `[floor]` or `[pile]` with those of [`ContactSceneParams`]. `taut scene NAME` writes it with
//! every key that the scene has a use for, its meaning and its unit. Or it is **explicit**: lists of bodies and of
//! constraints, one by one. `taut scene NAME --explicit` writes any scene so.
//!
//! ```toml
//! [hoist]
//! segments = 12
//! load_mass = 500       # kg
//! ```
//!
//! # Explicit scenes
//! SI units; angles in radians. Vectors are `[x, y, z]`, z upwards. The struct of a table explains its keys: each with its
//! meaning, its unit, and its default where it need not be given. `taut scene NAME --explicit` writes the meanings of the keys
//! that the scene uses beside them.
//!
//! | table | its keys | tables in it |
//! |---|---|---|
//! | top of the text | [`SceneText`] | |
//! | `[[body]]` | [`BodyEntry`] | `shape`: [`Shape`]; `collide`: [`SurfaceEntry`] |
//! | `[[joint]]` | [`JointEntry`], by its kind [`Kind`] | `motor`: [`MotorEntry`]; `motion`: [`Motion`](crate::Motion) |
//! | `[[cable]]` | [`CableEntry`], of rigid segments | `from`, `to`: [`EndEntry`]; `winch`: [`Winch`](crate::Winch); |
//! | | | `resolution`: [`ResolutionEntry`]; `collide`: [`SurfaceEntry`] |
//! | `[[massless_cable]]` | [`MasslessCableEntry`] | `through`: [`PointEntry`], with `sheave`: [`SheaveEntry`]; |
//! | | | `winch`: [`Winch`](crate::Winch) |
//! | `[[bend]]` | [`BendEntry`], of links | `through`: [`PointEntry`] |
//! | `[[ground]]` | [`GroundEntry`], a half-space | |
//! | `[[collider]]` | [`ColliderEntry`], other shapes | `shape`: [`Shape`](crate::Shape) |
//! | `[[control]]` | [`ControlEntry`] | `drives`: [`DriveEntry`] |
//! | `[[event]]` | [`EventEntry`] | `force`: [`ForceEntry`]; `distance`: [`DistanceEntry`]; `attach`: [`AttachEntry`]; |
//! | | | `set`: [`SetEntry`] |
//!
//! The name of a scene is `scene` unless it has one, its gravity `[0, 0, -9.81]`. A start in `equilibrium` knows no contacts:
//! it is not for a load that stands on the ground. Groups are by topology ([`Scene::group_by_topology`]) where no entry of the
//! text has one.
//!
//! A cable over sheaves with friction has parts `NAME`, `NAME-2` … with a tension each. The sign of a sheave's axis says over
//! which side the cable goes. A scene that is written back, such as by `taut scene NAME --explicit`, holds more of a sheave,
//! which nobody needs to write: `axes` of its point in place of `axis`, `on` with the angles between which the cable lies on it,
//! `clear` with `off`, and a cable over sheaves with friction as its parts, joined by `shared` and `after`. The winch of a part
//! has a `shortest` and `longest` that have moved with what slipped from part to part; `shortest` may then be negative,
//! elsewhere it is > 0.
//!
//! Which pairs never touch is said in the module [`collide`](crate::collide): bodies that a constraint joins, above all. A
//! cable does not touch itself, and there are no meshes. A scene has at most 32 groups of shapes. One that is written back has
//! each shape as a `[[collider]]`, with the groups `default`, `group-1` … `group-31`, which are names that any text may use.
//!
//! `breaks_at` (N) of a joint or massless cable is an event, called `NAME breaks`; of a cable one for
//! each joint, of which only the most strained breaks in a step.
//!
//! A hook picks a crate up and sets it down again:
//! ```
//! # use taut_model::scene_file::SceneText;
//! # let text = r#"
//! body = [
//!   { name = "hook", mass = 50, shape = { sphere = { radius = 0.1 } }, position = [0, 0, 1] },
//!   { name = "crate", mass = 200, shape = { sphere = { radius = 0.3 } } },
//! ]
//!
//! [[event]]
//! name = "pick up"
//! at = 2
//! attach = [{ name = "grip", a = { body = "hook" }, b = { body = "crate", point = [0, 0, 0.3] } }]
//!
//! [[event]]
//! name = "set down"
//! at = 8
//! release = ["grip"]
//! # "#;
//! # let text: SceneText = toml::from_str(text).unwrap();
//! # assert_eq!(text.build().unwrap().events.len(), 2);
//! ```
//!
//! A crane: its jib slews about the fixed tower, a trolley runs along the jib, a winch on it holds a hook on a massless
//! cable, and a load hangs from the hook; `taut run crane.toml` follows it:
//! ```toml
#![doc = include_str!("scene_file/crane.toml")]
//! ```
//!
//! A drum of 4 kW that lifts a load over a sheave with friction; `taut run drum.toml --columns time,load.z,rope-2.slip --out -`
//! follows it:
//! ```toml
#![doc = include_str!("scene_file/drum.toml")]
//! ```
//!
//! # Overrides
//! A key is a path: `mass_ratio` in a hoist, `spacing` in a particle chain; `gravity`, `body.hook.mass`,
//! `joint.anchor.ei`, `joint.rail.motor.speed` or `massless_cable.main.through.1.point` (entries by name or number from 0) in an
//! explicit scene. A value is
//! TOML, or else taken as a string: `joint=paper` needs no quotes.
//!
//! # Faults
//! Unknown keys are errors that list the valid ones. Faults of explicit scenes, also those found while building, name
//! line, key and cure; where an override brought the fault in, they name the override.

mod build;
mod cable;
mod collide;
mod control;
mod entries;
mod event;
mod from_scene;
mod groups;
mod joint;
mod keys;
mod motor;
mod overrides;
mod places;
mod points;
#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_cable;
#[cfg(test)]
mod tests_collide;
#[cfg(test)]
mod tests_drives;
#[cfg(test)]
mod tests_event;
#[cfg(test)]
mod tests_explicit;
#[cfg(test)]
mod tests_faults;
#[cfg(test)]
mod tests_from_scene;
#[cfg(test)]
mod tests_lengths;
#[cfg(test)]
mod tests_named;
#[cfg(test)]
mod tests_sheaves;
mod write;

pub use cable::{CableEntry, EndEntry, Hold, ResolutionEntry};
pub use collide::{CollideEntry, ColliderEntry, GroundEntry, SurfaceEntry};
pub use control::{ControlEntry, DriveEntry};
pub use entries::{BodyEntry, SceneText, Shape};
pub use event::{AttachEntry, DistanceEntry, EventEntry, ForceEntry, SetEntry};
pub use joint::{JointEntry, Kind};
pub use motor::MotorEntry;
pub use points::{BendEntry, MasslessCableEntry, PointEntry, SheaveEntry};

use overrides::merge;
use places::{Places, located};

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use toml::Table;
use toml::de::DeTable;

use crate::contact_scenes::ContactSceneParams;
use crate::error::SceneError;
use crate::gantry::GantryParams;
use crate::hoist::HoistParams;
use crate::named::unknown;
use crate::network::NetworkParams;
use crate::params::Parameters;
use crate::particles::ParticleChainParams;
use crate::reeved::ReevedParams;
use crate::scene::Scene;
use crate::specimen::SpecimenParams;

/// The kinds of sources, with the parameters of their named scenes.
macro_rules! sources {
    ($(#[doc = $doc:literal] $source:ident: $params:ident,)*) => {
        /// Where a scene comes from: its parameters, before it is built.
        #[derive(Debug, Clone, PartialEq)]
        #[non_exhaustive]
        pub enum SceneSource {
            $(
                #[doc = $doc]
                $source(Box<$params>),
            )*
            /// Bodies and joints one by one.
            Explicit(Box<SceneText>),
        }

        $(
            impl From<$params> for SceneSource {
                fn from(params: $params) -> Self {
                    Self::$source(Box::new(params))
                }
            }
        )*

        impl SceneSource {
            /// The scene of that name with its default parameters.
            fn named(name: &str) -> Option<Self> {
                None$(.or_else(|| Some($params::of_scene(name)?.into())))*
            }
        }

        /// Matches over the sources: `$do` for the parameters of any named scene, `$with_text` for the text of an explicit one.
        macro_rules! each_source {
            ($from:expr, $own:ident => $do:expr, $text:pat => $with_text:expr) => {
                match $from {
                    $(SceneSource::$source($own) => $do,)*
                    SceneSource::Explicit($text) => $with_text,
                }
            };
        }
        use each_source;
    };
}

sources!(
    /// The hoist and its parameters.
    Hoist: HoistParams,
    /// The gantry crane and its parameters.
    Gantry: GantryParams,
    /// The particle chain and its parameters.
    Particles: ParticleChainParams,
    /// A specimen and its parameters.
    Specimen: SpecimenParams,
    /// Cables with branches or loops and their parameters.
    Network: NetworkParams,
    /// Cables over sheaves and their parameters.
    Reeved: ReevedParams,
    /// Scenes on the ground and their parameters.
    ContactScene: ContactSceneParams,
);

impl SceneSource {
    /// Builds the scene.
    ///
    /// # Errors
    /// The first parameter, body or joint that is wrong.
    pub fn build(&self) -> Result<Scene, SceneError> {
        each_source!(self, params => params.build(), text => text.build())
    }

    /// The scene of that name, with `overrides` of (key, value) as in [`SceneSource::parse`].
    ///
    /// # Errors
    /// [`SceneError::UnknownScene`], [`SceneError::Override`] with the key.
    pub fn load(name: &str, overrides: &[(&str, &str)]) -> Result<Self, SceneError> {
        Self::named(name).ok_or_else(|| unknown(name))?;
        Self::parse(&format!("[{name}]"), overrides)
    }

    /// Reads TOML text, with `overrides` of (key, value) merged in before the keys are checked (see the
    /// module's documentation).
    ///
    /// # Errors
    /// [`SceneError::Toml`] with line and column, [`SceneError::Override`] with the key.
    pub fn parse(text: &str, overrides: &[(&str, &str)]) -> Result<Self, SceneError> {
        let mut table: Table = toml::from_str(text).map_err(|e| located(&e, text))?;
        let Some((name, mut source)) = whole_of(&table) else {
            let mut scene = merge::<SceneText>(text, &mut table, overrides)?;
            scene.places = Places::new(text, overrides);
            return Ok(Self::Explicit(Box::new(scene)));
        };
        alone(text, &name)?;
        let table = &mut table;
        each_source!(
            &mut source,
            params => **params = read_whole(&**params, text, table, overrides)?,
            _ => {}
        );
        Ok(source)
    }

    /// The source as TOML text for people: every key that it has a use for, with its meaning, its unit and its value. It
    /// reads back to an equal source.
    ///
    /// # Errors
    /// As [`SceneSource::to_toml`].
    pub fn to_commented_toml(&self) -> Result<String, SceneError> {
        each_source!(
            self,
            params => write::commented(self, &**params),
            scene => write::explicit(scene, true)
        )
    }

    /// The source as TOML text that [`SceneSource::parse`] reads back to an equal source.
    ///
    /// # Errors
    /// [`SceneError::Toml`] for numbers that TOML cannot hold (seeds above 2⁶³ − 1).
    pub fn to_toml(&self) -> Result<String, SceneError> {
        each_source!(
            self,
            params => {
                let table = BTreeMap::from([(params.scene_name(), params)]);
                toml::to_string(&table).map_err(|e| unwritten(&e))
            },
            scene => write::explicit(scene, false)
        )
    }
}

/// The fault of what TOML cannot hold.
fn unwritten(error: &toml::ser::Error) -> SceneError {
    fault_at(None, "", &error.to_string())
}

/// The table that is a whole scene; the list `[[bend]]` is not the table `[bend]`.
fn whole_of(table: &Table) -> Option<(String, SceneSource)> {
    let mut tables = table.iter().filter(|(_, value)| value.is_table());
    tables.find_map(|(name, _)| Some((name.clone(), SceneSource::named(name)?)))
}

/// Refuses whatever stands beside the table `whole`, which holds all of a scene.
fn alone(text: &str, whole: &str) -> Result<(), SceneError> {
    let table = DeTable::parse(text).map_err(|e| located(&e, text))?;
    let other = table.get_ref().keys().find(|k| k.get_ref() != whole);
    other.map_or(Ok(()), |other| {
        let key = other.get_ref();
        let fault =
            format!("`{key}` stands beside [{whole}], which is a whole scene: give one of them");
        Err(fault_at(Some(other.span().start), text, &fault))
    })
}

/// The parameters in the only table of the text, of the scene that `named` has.
fn read_whole<P: Parameters + DeserializeOwned + Default>(
    named: &P,
    text: &str,
    table: &mut Table,
    overrides: &[(&str, &str)],
) -> Result<P, SceneError> {
    let params = merge::<BTreeMap<String, P>>(text, table, overrides)?;
    let params = params.into_values().next().unwrap_or_default();
    Ok(params.with_kind_of(named))
}

/// A fault of the text with line and column from 1 of the byte `at`, columns in characters.
fn fault_at(at: Option<usize>, text: &str, message: &str) -> SceneError {
    let place = at.map(|at| places::line_column(text, at));
    SceneError::Toml {
        place,
        message: one_line(message),
    }
}

fn one_line(message: &str) -> String {
    message.trim().replace('\n', ", ")
}
