//! Meanings of the keys of a scene, from the one place that states them: the doc comments of the
//! structs that hold them.

use super::{
    BendEntry, BodyEntry, CableEntry, ColliderEntry, ControlEntry, EventEntry, GroundEntry,
    JointEntry, MasslessCableEntry, SceneSource, each_source,
};
use crate::params::{Keys, Parameters};

/// A key and its meaning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Key {
    pub(super) name: String,
    pub(super) meaning: String,
}

/// A struct that [`described`] made.
pub(super) trait Described {
    /// Its keys.
    const KEYS: Keys;
}

/// The keys and their meanings, in their order.
pub(super) fn of(keys: Keys) -> Vec<Key> {
    let key = |(name, lines): &(&str, &[&str])| Key {
        name: (*name).to_owned(),
        meaning: clean(lines.concat().trim()),
    };
    keys.iter().map(key).collect()
}

/// Description of a named scene: the first paragraph of the documentation of its parameters. A model with a letter has no name
/// that describes it: its own documentation does.
pub(super) fn about(source: &SceneSource) -> String {
    fn of<P: Parameters>(params: &P) -> String {
        let lines = P::ABOUT.iter().map(|line| line.trim());
        let mut words: Vec<&str> = lines.take_while(|line| !line.is_empty()).collect();
        let kind = params.about_kind().strip_prefix(" (");
        words.extend(kind.and_then(|kind| Some(kind.split_once(") ")?.1)));
        clean(&words.join(" "))
    }
    each_source!(source, params => of(&**params), _ => String::new())
}

/// The keys of the parameters of a named scene; none for an explicit scene.
pub(super) fn of_source(source: &SceneSource) -> Vec<Key> {
    fn of_params<P: Parameters>(_: &P) -> Vec<Key> {
        of(P::KEYS)
    }
    each_source!(source, params => of_params(&**params), _ => Vec::new())
}

/// True if the named scene uses the key. Scenes that share their parameters say so in a key's
/// meaning, by the words "Only in" or "Not in" with their names.
pub(super) fn has_use(scene: &str, key: &Key) -> bool {
    let named = |words: &str| {
        let (_, scenes) = key.meaning.split_once(words)?;
        Some(scenes.contains(&format!("`{scene}`")))
    };
    named("Only in ").unwrap_or(true) && !named("Not in ").unwrap_or(false)
}

/// The lists of an explicit scene with their keys; those of constraints in the order in which they stand without `order`.
pub(super) const LISTS: [(&str, Keys); 9] = [
    ("body", BodyEntry::KEYS),
    ("joint", JointEntry::KEYS),
    ("cable", CableEntry::KEYS),
    ("massless_cable", MasslessCableEntry::KEYS),
    ("bend", BendEntry::KEYS),
    ("ground", GroundEntry::KEYS),
    ("collider", ColliderEntry::KEYS),
    ("control", ControlEntry::KEYS),
    ("event", EventEntry::KEYS),
];

/// An entry as it is read and written, with its keys and their meanings; no text holds the field after `;`. `with surface`
/// adds the keys of the surface of a shape.
macro_rules! described {
    (
        $(#[$attribute:meta])*
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])*
                $(#[serde($($how:tt)*)])?
                pub $field:ident: $type:ty,
            )*
            $(;
                $(#[doc = $aside:literal])*
                $vis:vis $hidden:ident: $of:ty,
            )?
        }
    ) => {
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        $(#[$attribute])*
        pub struct $name {
            $(
                $(#[doc = $doc])*
                $(#[serde($($how)*)])?
                pub $field: $type,
            )*
            $(
                $(#[doc = $aside])*
                #[serde(skip)]
                $vis $hidden: $of,
            )?
        }

        impl super::keys::Described for $name {
            const KEYS: crate::params::Keys = &[$((stringify!($field), &[$($doc),*])),*];
        }
    };
    (
        $(#[$attribute:meta])*
        pub struct $name:ident with surface { $($fields:tt)* }
    ) => {
        super::keys::described! {
            $(#[$attribute])*
            pub struct $name {
                $($fields)*
                /// Coefficient of friction; default 0.5.
                pub friction: Option<f64>,
                /// Speed of separation over speed of approach, 0 to 1; default 0.
                pub restitution: Option<f64>,
                /// Compliance of a contact point \[m/N]; default 1e-10.
                pub compliance: Option<f64>,
                /// Damping time of a contact point \[s]; default 1e-3.
                pub damping: Option<f64>,
                /// Names of the groups that it is a member of; default `["default"]`.
                pub groups: Option<Vec<String>>,
                /// Names of the groups whose members it meets; default all.
                pub meets: Option<Vec<String>>,
            }
        }

        impl $name {
            /// Its surface alone.
            pub(super) fn surface(&self) -> SurfaceEntry {
                SurfaceEntry {
                    friction: self.friction,
                    restitution: self.restitution,
                    compliance: self.compliance,
                    damping: self.damping,
                    groups: self.groups.clone(),
                    meets: self.meets.clone(),
                }
            }
        }
    };
}
pub(super) use described;

/// Without the marks of links and escapes.
fn clean(doc: &str) -> String {
    doc.replace("\\[", "[")
        .replace("[`", "`")
        .replace("`]", "`")
}
