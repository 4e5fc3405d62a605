//! Meanings of the keys of a scene, from the one place that states them: the doc comments of the
//! structs that hold them.

use super::{ChainModel, SceneSource};

/// A key and its meaning.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Key {
    pub(super) name: String,
    pub(super) meaning: String,
}

/// The keys of the parameters of a named scene; none for an explicit scene.
pub(super) fn of_source(source: &SceneSource) -> Vec<Key> {
    match source {
        SceneSource::Hoist(_) => of_struct(include_str!("../hoist.rs"), "HoistParams"),
        SceneSource::Gantry(_) => of_struct(include_str!("../gantry.rs"), "GantryParams"),
        SceneSource::Particles(_) => {
            of_struct(include_str!("../particles.rs"), "ParticleChainParams")
        }
        SceneSource::Specimen(_) => of_struct(include_str!("../specimen.rs"), "SpecimenParams"),
        SceneSource::Network(_) => of_struct(include_str!("../network.rs"), "NetworkParams"),
        SceneSource::Reeved(_) => of_struct(include_str!("../reeved.rs"), "ReevedParams"),
        SceneSource::Grounded(_) => of_struct(include_str!("../grounded.rs"), "GroundedParams"),
        SceneSource::Explicit(_) => Vec::new(),
    }
}

/// Description of a named scene: the first paragraph of its own documentation.
pub(super) fn about(source: &SceneSource) -> String {
    match source {
        SceneSource::Hoist(_) => first_paragraph(include_str!("../hoist.rs")),
        SceneSource::Gantry(_) => first_paragraph(include_str!("../gantry.rs")),
        SceneSource::Particles(p) => about_chain(p.model),
        SceneSource::Specimen(_) => first_paragraph(include_str!("../specimen.rs")),
        SceneSource::Network(_) => first_paragraph(include_str!("../network.rs")),
        SceneSource::Reeved(_) => first_paragraph(include_str!("../reeved.rs")),
        SceneSource::Grounded(_) => first_paragraph(include_str!("../grounded.rs")),
        SceneSource::Explicit(_) => "Bodies and constraints one by one.".to_owned(),
    }
}

fn about_chain(model: ChainModel) -> String {
    let letter = model.scene_name().trim_start_matches("particles-");
    let mark = format!("/// ({letter}) ");
    let source = include_str!("../particles.rs");
    let line = source.lines().find_map(|l| l.trim().strip_prefix(&mark));
    let model = line.map_or_else(String::new, |l| format!(" {}", clean(l)));
    format!("A chain of particles and links.{model}")
}

/// The first paragraph of a module's documentation.
fn first_paragraph(source: &str) -> String {
    let lines = source.lines().map(|l| l.trim_start_matches("//!").trim());
    let paragraph: Vec<&str> = lines.take_while(|l| !l.is_empty()).collect();
    clean(&paragraph.join(" "))
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

/// The keys of a list of an explicit scene, or of its top (`scene`).
pub(super) fn of_list(list: &str) -> Vec<Key> {
    match list {
        "scene" => of_struct(include_str!("entries.rs"), "SceneText"),
        "body" => of_struct(include_str!("entries.rs"), "BodyEntry"),
        "joint" => of_struct(include_str!("joint.rs"), "JointEntry"),
        "cable" => of_struct(include_str!("cable.rs"), "CableEntry"),
        "event" => of_struct(include_str!("event.rs"), "EventEntry"),
        "control" => of_struct(include_str!("control.rs"), "ControlEntry"),
        "massless_cable" => of_struct(include_str!("points.rs"), "MasslessCableEntry"),
        "ground" => of_struct(include_str!("collide.rs"), "GroundEntry"),
        "collider" => of_struct(include_str!("collide.rs"), "ColliderEntry"),
        "bend" => of_struct(include_str!("points.rs"), "BendEntry"),
        _ => Vec::new(),
    }
}

/// The public fields of the struct `name` in the Rust file `source`, in their order, without those that no text holds.
pub(super) fn of_struct(source: &str, name: &str) -> Vec<Key> {
    let opening = format!("pub struct {name} {{");
    let lines = source.lines().skip_while(|line| *line != opening).skip(1);
    let mut keys = Vec::new();
    let (mut docs, mut skipped) = (Vec::new(), false);
    for line in lines.take_while(|line| *line != "}").map(str::trim) {
        if let Some(doc) = line.strip_prefix("///") {
            docs.push(doc.trim());
        } else if line.starts_with("#[") {
            skipped |= line.contains("serde(skip)");
        } else if let Some((field, _)) = line.split_once(':') {
            let meaning = clean(&docs.join(" "));
            if let Some(name) = field.strip_prefix("pub ").filter(|_| !skipped) {
                let name = name.to_owned();
                keys.push(Key { name, meaning });
            }
            docs.clear();
            skipped = false;
        }
    }
    keys
}

/// Without the marks of links and escapes.
fn clean(doc: &str) -> String {
    doc.replace("\\[", "[")
        .replace("[`", "`")
        .replace("`]", "`")
}
