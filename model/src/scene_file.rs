//! Scenes from TOML text, with overrides `KEY=VALUE`.
//!
//! A text is one table with all parameters of a named scene, `[hoist]` with the fields of [`HoistParams`],
//! `[particles-a]` … `[particles-f]` with those of [`ParticleChainParams`], `[pull]`, `[twist]` or `[bend]` with those of
//! [`SpecimenParams`], `[ring]`, `[junction]`, `[cranes]`, `[ladder]` or `[net]` with those of [`NetworkParams`]; or it is a list of `[[body]]` and `[[joint]]` entries, see [`SceneText`]. Unknown keys are errors
//! that list the valid ones.

mod entries;
mod joint;
#[cfg(test)]
mod tests_explicit;

pub use entries::{BodyEntry, SceneText, Shape};
pub use joint::{JointEntry, Kind, MotionEntry};

use std::collections::BTreeMap;

use serde::de::DeserializeOwned;
use toml::de::DeTable;
use toml::{Table, Value};

use crate::error::SceneError;
use crate::hoist::HoistParams;
use crate::named::unknown;
use crate::network::{Network, NetworkParams};
use crate::particles::{ChainModel, ParticleChainParams};
use crate::scene::Scene;
use crate::specimen::{Specimen, SpecimenParams};

/// Where a scene comes from: its parameters, before it is built.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SceneSource {
    /// The hoist and its parameters.
    Hoist(Box<HoistParams>),
    /// The particle chain and its parameters.
    Particles(Box<ParticleChainParams>),
    /// A specimen and its parameters.
    Specimen(Box<SpecimenParams>),
    /// Cables with branches or loops and their parameters.
    Network(Box<NetworkParams>),
    /// Bodies and joints one by one.
    Explicit(Box<SceneText>),
}

/// A named scene whose parameters a table of that name holds.
#[derive(Debug, Clone, Copy)]
enum Whole {
    Hoist,
    Particles(ChainModel),
    Specimen(Specimen),
    Network(Network),
}

impl Whole {
    fn named(name: &str) -> Option<Self> {
        if name == "hoist" {
            return Some(Self::Hoist);
        }
        let chain = ChainModel::of_scene(name).map(Self::Particles);
        let specimen = || Specimen::named(name).map(Self::Specimen);
        let network = || Network::named(name).map(Self::Network);
        chain.or_else(specimen).or_else(network)
    }
}

impl SceneSource {
    /// The scene of that name, with `overrides` of (key, value) as in [`SceneSource::parse`].
    ///
    /// # Errors
    /// [`SceneError::UnknownScene`], [`SceneError::Override`] with the key.
    pub fn load(name: &str, overrides: &[(&str, &str)]) -> Result<Self, SceneError> {
        Whole::named(name).ok_or_else(|| unknown(name))?;
        Self::parse(&format!("[{name}]"), overrides)
    }

    /// Reads TOML text, with `overrides` of (key, value) merged in before the keys are checked.
    ///
    /// A key is a path: `mass_ratio` in a hoist, `spacing` in a particle chain; `gravity`, `body.hook.mass` or
    /// `joint.anchor.ei` (by name or number from 0) in an explicit scene. A value is TOML, or else taken as a string:
    /// `joint=paper` needs no quotes.
    ///
    /// # Errors
    /// [`SceneError::Toml`] with line and column, [`SceneError::Override`] with the key.
    pub fn parse(text: &str, overrides: &[(&str, &str)]) -> Result<Self, SceneError> {
        let mut table: Table = toml::from_str(text).map_err(|e| located(&e, text))?;
        let whole = table
            .keys()
            .find_map(|k| Some((k.clone(), Whole::named(k)?)));
        let Some((name, whole)) = whole else {
            let scene = merge::<SceneText>(text, &mut table, overrides)?;
            return Ok(Self::Explicit(Box::new(scene)));
        };
        alone(text, &name)?;
        let table = &mut table;
        Ok(match whole {
            Whole::Hoist => Self::Hoist(Box::new(read_whole(text, table, overrides)?)),
            Whole::Particles(model) => {
                let chain: ParticleChainParams = read_whole(text, table, overrides)?;
                Self::Particles(Box::new(ParticleChainParams { model, ..chain }))
            }
            Whole::Specimen(specimen) => {
                let params: SpecimenParams = read_whole(text, table, overrides)?;
                Self::Specimen(Box::new(SpecimenParams { specimen, ..params }))
            }
            Whole::Network(network) => {
                let params: NetworkParams = read_whole(text, table, overrides)?;
                Self::Network(Box::new(NetworkParams { network, ..params }))
            }
        })
    }

    /// Builds the scene.
    ///
    /// # Errors
    /// The first parameter, body or joint that is wrong.
    pub fn build(&self) -> Result<Scene, SceneError> {
        match self {
            Self::Hoist(hoist) => hoist.build(),
            Self::Particles(chain) => chain.build(),
            Self::Specimen(specimen) => specimen.build(),
            Self::Network(network) => network.build(),
            Self::Explicit(text) => text.build(),
        }
    }

    /// The source as TOML text that [`SceneSource::parse`] reads back to an equal source.
    ///
    /// # Errors
    /// [`SceneError::Toml`] for numbers that TOML cannot hold (seeds above 2⁶³ − 1).
    pub fn to_toml(&self) -> Result<String, SceneError> {
        let text = match self {
            Self::Hoist(hoist) => toml::to_string(&BTreeMap::from([("hoist", hoist)])),
            Self::Particles(chain) => {
                toml::to_string(&BTreeMap::from([(chain.model.scene_name(), chain)]))
            }
            Self::Specimen(params) => {
                toml::to_string(&BTreeMap::from([(params.specimen.name(), params)]))
            }
            Self::Network(params) => {
                toml::to_string(&BTreeMap::from([(params.network.name(), params)]))
            }
            Self::Explicit(scene) => toml::to_string(&**scene),
        };
        text.map_err(|e| SceneError::Toml {
            line: None,
            column: None,
            message: one_line(&e.to_string()),
        })
    }
}

/// Refuses whatever stands beside the table `whole`, which holds all of a scene.
fn alone(text: &str, whole: &str) -> Result<(), SceneError> {
    let table = DeTable::parse(text).map_err(|e| located(&e, text))?;
    let other = table.get_ref().keys().find(|k| k.get_ref() != whole);
    let Some(other) = other else {
        return Ok(());
    };
    Err(fault_at(
        Some(other.span().start),
        text,
        &format!(
            "`{}` stands beside [{whole}], which is a whole scene: give one of them",
            other.get_ref()
        ),
    ))
}

/// The parameters in the only table of the text.
fn read_whole<T: DeserializeOwned + Default>(
    text: &str,
    table: &mut Table,
    overrides: &[(&str, &str)],
) -> Result<T, SceneError> {
    let params = merge::<BTreeMap<String, T>>(text, table, overrides)?;
    Ok(params.into_values().next().unwrap_or_default())
}

/// Merges the overrides into `table` and deserialises it. When the text alone is sound, the overrides are tried one
/// after the other, so that the one at fault can be named.
fn merge<T: DeserializeOwned>(
    text: &str,
    table: &mut Table,
    overrides: &[(&str, &str)],
) -> Result<T, SceneError> {
    let mut scene = toml::from_str::<T>(text).map_err(|e| located(&e, text));
    let sound = scene.is_ok();
    for (key, value) in overrides {
        let at_fault = |message: String| SceneError::Override {
            key: (*key).to_owned(),
            message,
        };
        let value = value
            .parse::<Value>()
            .unwrap_or_else(|_| Value::String((*value).to_owned()));
        insert(table, key, value).map_err(at_fault)?;
        if sound {
            let read = table.clone().try_into::<T>();
            scene = Ok(read.map_err(|e| at_fault(one_line(e.message())))?);
        }
    }
    if !sound && !overrides.is_empty() {
        // The overrides may have mended the text; if not, the text's own error knows the line.
        return table.clone().try_into::<T>().or(scene);
    }
    scene
}

/// Puts `value` at the path `key`. Entries of lists are found by their `name` or their number.
fn insert(table: &mut Table, key: &str, value: Value) -> Result<(), String> {
    let mut parts: Vec<&str> = key.trim().split('.').map(str::trim).collect();
    let whole = table
        .keys()
        .find(|name| Whole::named(name).is_some())
        .cloned();
    if let Some(whole) = &whole
        && parts[0] != whole
    {
        parts.insert(0, whole);
    }
    let Some((last, path)) = parts.split_last() else {
        return Err("the key is empty".into());
    };
    let mut parts = path.iter();
    let mut here = table;
    while let Some(part) = parts.next() {
        here = match here.get_mut(*part) {
            Some(Value::Table(inner)) => inner,
            Some(Value::Array(list)) => {
                let Some(name) = parts.next() else {
                    return Err(format!("say which entry: {part}.NAME.{last}"));
                };
                let index = position(list, name)
                    .ok_or_else(|| format!("`{part}` has no entry called `{name}`"))?;
                match &mut list[index] {
                    Value::Table(inner) => inner,
                    _ => return Err(format!("`{part}.{name}` has no keys")),
                }
            }
            Some(_) => return Err(format!("`{part}` has no keys")),
            None => return Err(format!("there is no `{part}` to hold `{last}`")),
        };
    }
    here.insert((*last).to_owned(), value);
    Ok(())
}

fn position(list: &[Value], name: &str) -> Option<usize> {
    let named = |entry: &Value| entry.get("name").and_then(Value::as_str) == Some(name);
    let by_number = || name.parse().ok().filter(|i| *i < list.len());
    list.iter().position(named).or_else(by_number)
}

/// A reader's error with its place.
fn located(error: &toml::de::Error, text: &str) -> SceneError {
    fault_at(error.span().map(|span| span.start), text, error.message())
}

/// A fault of the text with line and column from 1 of the byte `at`, columns in characters.
fn fault_at(at: Option<usize>, text: &str, message: &str) -> SceneError {
    let before = at.and_then(|at| text.get(..at));
    SceneError::Toml {
        line: before.map(|t| t.matches('\n').count() + 1),
        column: before.map(|t| t.chars().rev().take_while(|c| *c != '\n').count() + 1),
        message: one_line(message),
    }
}

fn one_line(message: &str) -> String {
    message.trim().replace('\n', ", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hoist::JointKind;
    use proptest::prelude::*;

    fn hoist(source: &SceneSource) -> &HoistParams {
        match source {
            SceneSource::Hoist(params) => params,
            _ => panic!("not a hoist"),
        }
    }

    fn fault(text: &str, overrides: &[(&str, &str)]) -> String {
        let error = SceneSource::parse(text, overrides)
            .and_then(|s| s.build())
            .expect_err("a fault");
        let text = error.to_string();
        assert!(!text.contains('\n'), "{text}");
        text
    }

    #[test]
    fn names_and_overrides() {
        let overrides = [
            ("segments", "6"),
            ("mass_ratio", "1e5"),
            ("hoist.joint", "paper"),
            ("load_offset", "1"),
        ];
        let source = SceneSource::load("hoist", &overrides).expect("loads");
        let params = hoist(&source);
        assert_eq!((params.segments, params.mass_ratio), (6, 1e5));
        assert_eq!((params.joint, params.load_offset), (JointKind::Paper, 1.0));
        assert_eq!(source.build().expect("builds").bodies.len(), 7);
        let text = "[hoist]\nsegments = 3\nanchor = \"clamped\"\n";
        let source = SceneSource::parse(text, &[("segments", "4")]).expect("loads");
        assert_eq!(hoist(&source).segments, 4);
    }

    #[test]
    fn written_text_reads_back_to_the_identical_scene() {
        let overrides = [
            ("ea", "1.2345678901234567e7"),
            ("initial_angle", "0.1"),
            ("seed", "77"),
            ("damping", "1e-300"),
        ];
        let source = SceneSource::load("hoist", &overrides).expect("loads");
        let text = source.to_toml().expect("writes");
        let again = SceneSource::parse(&text, &[]).expect("reads");
        assert_eq!(again, source);
        assert_eq!(again.build(), source.build());
    }

    #[test]
    fn particle_chains_by_name_and_text() {
        let overrides = [
            ("particles", "9"),
            ("load_mass", "1e3"),
            ("particles-a.transverse", "true"),
            ("compliance", "1.2345678901234567e-9"),
            ("seed", "3"),
        ];
        let source = SceneSource::load("particles-a", &overrides).expect("loads");
        let scene = source.build().expect("builds");
        assert_eq!((scene.bodies.len(), scene.bodies.mass[8]), (9, 1e3));
        assert_eq!(scene.constraints[0].rows(), 3);
        let text = source.to_toml().expect("writes");
        assert!(text.starts_with("[particles-a]"), "{text}");
        let again = SceneSource::parse(&text, &[]).expect("reads");
        assert_eq!(again, source);
        assert_eq!(again.build(), Ok(scene));
        let text = fault("[particles-a]\nspacing = -1\n", &[]);
        assert_eq!(text.split(':').next(), Some("spacing is -1"));
        let text = fault("[particles-a]", &[("spcaing", "2")]);
        assert!(text.starts_with("override `spcaing`: unknown"), "{text}");
        assert!(fault("[particles-a]", &[("mass", "nan")]).contains("mass is NaN"));
        let both = fault("[particles-a]\n[hoist]", &[]);
        assert!(both.contains("stands beside [hoist]"), "{both}");
        let both = fault("[particles-a]\n[particles-e]", &[]);
        assert!(
            both.starts_with("line 2, column 2: `particles-e`"),
            "{both}"
        );
    }

    #[test]
    fn every_model_of_the_chain_reads_back() {
        for model in ChainModel::ALL {
            let name = model.scene_name();
            let overrides = [("added_compliance", "1e-7"), ("particles", "3")];
            let source = SceneSource::load(name, &overrides).expect("loads");
            let text = source.to_toml().expect("writes");
            assert!(text.starts_with(&format!("[{name}]")), "{text}");
            assert_eq!(SceneSource::parse(&text, &[]), Ok(source.clone()));
            assert_eq!(source.build().expect("builds").name, name);
        }
    }

    #[test]
    fn specimens_by_name_and_text() {
        for (name, load) in [("pull", "force"), ("twist", "torque"), ("bend", "moment")] {
            let overrides = [("segments", "5"), ("material", "rubber"), (load, "0.25")];
            let source = SceneSource::load(name, &overrides).expect("loads");
            let scene = source.build().expect("builds");
            assert_eq!((scene.bodies.len(), scene.name.as_str()), (6, name));
            let text = source.to_toml().expect("writes");
            assert!(text.starts_with(&format!("[{name}]")), "{text}");
            assert_eq!(SceneSource::parse(&text, &[]), Ok(source));
        }
        let text = fault("[twist]\nforce = 1\n[bend]\n", &[]);
        assert!(text.contains("stands beside [bend]"), "{text}");
        let text = fault("[twist]", &[("tork", "2")]);
        assert!(text.starts_with("override `tork`: unknown"), "{text}");
    }

    #[test]
    fn faults_say_where() {
        let unknown = SceneSource::load("hoits", &[]).expect_err("no such scene");
        assert!(
            unknown
                .to_string()
                .contains("choose one of hoist, particles-a")
        );
        assert!(fault("", &[]).contains("no bodies"));
        let text = fault("[hoist]\nsegments = 3\nlenght = 2.0\n", &[]);
        assert!(
            text.starts_with("line 3, column 1: unknown field `lenght`"),
            "{text}"
        );
        assert!(text.contains("`length`"), "{text}");
        let text = fault("[hoist]\nsegments = \"many\"\n", &[]);
        assert!(
            text.starts_with("line 2, column 12: invalid type"),
            "{text}"
        );
        let text = fault("[hoist]\nsegments = = 3\n", &[]);
        assert!(text.starts_with("line 2, column"), "{text}");
        let text = fault("[hoist]\nsegments = 3\n[extra]\n", &[]);
        assert!(
            text.starts_with("line 3, column 2: `extra` stands beside [hoist]"),
            "{text}"
        );
        assert!(fault("# nothing\n", &[]).contains("no bodies"));
    }

    #[test]
    fn faults_of_overrides_name_the_key() {
        let text = fault("[hoist]", &[("segments", "4"), ("mass", "3")]);
        assert!(
            text.starts_with("override `mass`: unknown field `mass`"),
            "{text}"
        );
        assert!(text.contains("`mass_ratio`"), "{text}");
        let text = fault("[hoist]", &[("segments", "2.5")]);
        assert!(
            text.starts_with("override `segments`: invalid type"),
            "{text}"
        );
        let text = fault("[hoist]", &[("segments", "-2")]);
        assert!(text.starts_with("override `segments`:"), "{text}");
        assert!(fault("[hoist]", &[("joint", "welded")]).contains("`cosserat`"));
        assert!(fault("[hoist]", &[("a.b", "1")]).contains("there is no `a`"));
        assert!(fault("[hoist]", &[("", "1")]).contains("override ``"));
        assert!(fault("[hoist]", &[("segments.x", "1")]).contains("there is no `segments`"));
        assert!(fault("[hoist]", &[("ea", "nan")]).contains("ea is NaN"));
        // The text is at fault, not the override: its own line is told.
        let text = fault("[hoist]\nsegmnts = 3\n", &[("length", "2")]);
        assert!(text.starts_with("line 2, column 1"), "{text}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_text_is_read_or_refused(
            text in "(\\[hoist\\]\n|\\[\\[body\\]\\]\n|\\[\\[joint\\]\\]\n)?(.|\n|=|\\[|\"){0,60}",
            key in "(segments|length|joint|[a-z_.]{0,12})",
            value in "([-+0-9.e]{0,6}|.{0,8})",
        ) {
            for overrides in [&[][..], &[(key.as_str(), value.as_str())][..]] {
                if let Err(error) = SceneSource::parse(&text, overrides) {
                    prop_assert!(!error.to_string().contains('\n'), "{error}");
                }
            }
        }

        #[test]
        fn any_override_builds_or_is_refused(
            key in "(segments|length|mass_ratio|ea|ei|gj|joint|anchor|seed|damping|gravity|bend|material)",
            value in "(-?[0-9]{1,2}(\\.[0-9]|e-?[0-9]{1,3})?|nan|inf|true|false|paper|clamped|steel|\\[1\\])",
        ) {
            let source = SceneSource::load("hoist", &[(&key, &value)]);
            match source.and_then(|s| s.build()) {
                Ok(scene) => prop_assert_eq!(scene.validate(), Ok(())),
                Err(error) => prop_assert!(!error.to_string().contains('\n'), "{error}"),
            }
        }
    }
}
