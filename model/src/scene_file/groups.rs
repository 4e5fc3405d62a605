//! Groups of colliders: names in a text, bits in a scene.
//!
//! `default` is bit 0, in which everything is that names no group, and `group-7` is bit 7. Other names take the lowest bits
//! that are left, in the order in which they stand in the text. A scene does not keep the names, so that what is written
//! back has those with numbers.

use std::collections::HashMap;

use super::collide::{CollideEntry, SurfaceEntry};
use super::entries::SceneText;
use super::places::Fault;
use crate::collide::DEFAULT_GROUP;
use crate::error::refuse;
use crate::params::check_count;

/// Most groups that there are.
const MOST: usize = 32;

/// The bits of the names.
#[derive(Debug, Default)]
pub(super) struct Groups(HashMap<String, u32>);

impl Groups {
    /// Bits of all group names in the text, at most 32.
    pub(super) fn of(text: &SceneText) -> Result<Self, Fault> {
        let surfaces = surfaces(text);
        let mut bits: HashMap<String, u32> = HashMap::new();
        let mut taken = DEFAULT_GROUP;
        let named = |s: &SurfaceEntry| [s.groups.clone(), s.meets.clone()].into_iter().flatten();
        let all = || surfaces.iter().flat_map(|(_, s)| named(s)).flatten();
        for name in all() {
            if let Some(bit) = numbered(&name) {
                taken |= bit;
                bits.insert(name, bit);
            }
        }
        for (path, surface) in &surfaces {
            for name in surface.groups.iter().flatten() {
                if bits.contains_key(name) {
                    continue;
                }
                let bit = taken.trailing_ones();
                let fits = check_count("number of groups", bit as usize + 1, MOST);
                fits.map_err(|error| Fault::new(format!("{path}groups"), error))?;
                taken |= 1 << bit;
                bits.insert(name.clone(), 1 << bit);
            }
        }
        for (path, surface) in &surfaces {
            let mut meets = surface.meets.iter().flatten();
            if let Some(name) = meets.find(|name| !bits.contains_key(*name)) {
                let reason =
                    "is a group that nothing is in: name one of those under `groups`, or `default`";
                let refused = refuse(format!("meets: `{name}`"), reason);
                refused.map_err(|error| Fault::new(format!("{path}meets"), error))?;
            }
        }
        Ok(Self(bits))
    }

    /// Groups of a surface, and groups that it meets, a bit each.
    pub(super) fn masks(&self, surface: &SurfaceEntry) -> (u32, u32) {
        let bit = |name: &String| self.0.get(name).copied().unwrap_or_default();
        let mask = |names: &Vec<String>| names.iter().map(bit).fold(0, |all, bit| all | bit);
        let groups = surface.groups.as_ref().map_or(DEFAULT_GROUP, mask);
        (groups, surface.meets.as_ref().map_or(u32::MAX, mask))
    }
}

/// The surfaces in the order of the text, with the paths before their keys.
fn surfaces(text: &SceneText) -> Vec<(String, SurfaceEntry)> {
    let of = |list: &str, i: usize, entry: &Option<CollideEntry>| {
        let surface = entry.as_ref().and_then(CollideEntry::surface)?;
        Some((format!("{list}.{i}.collide."), surface))
    };
    let bodies = text.body.iter().enumerate();
    let bodies = bodies.filter_map(|(i, entry)| of("body", i, &entry.collide));
    let cables = text.cable.iter().enumerate();
    let cables = cables.filter_map(|(i, entry)| of("cable", i, &entry.collide));
    let grounds = text.ground.iter().enumerate();
    let grounds = grounds.map(|(i, entry)| (format!("ground.{i}."), entry.surface()));
    let colliders = text.collider.iter().enumerate();
    let colliders = colliders.map(|(i, entry)| (format!("collider.{i}."), entry.surface()));
    bodies
        .chain(cables)
        .chain(grounds)
        .chain(colliders)
        .collect()
}

/// The bit that a name stands for by itself.
fn numbered(name: &str) -> Option<u32> {
    if name == "default" {
        return Some(DEFAULT_GROUP);
    }
    let number = name.strip_prefix("group-")?;
    let bit: u32 = number.parse().ok()?;
    // One spelling each.
    ((bit as usize) < MOST && number == bit.to_string()).then(|| 1 << bit)
}

/// The names of a mask's bits.
pub(super) fn names_of(mask: u32) -> Vec<String> {
    let bits = (0..MOST).filter(|bit| mask >> bit & 1 == 1);
    bits.map(|bit| match bit {
        0 => "default".to_owned(),
        bit => format!("group-{bit}"),
    })
    .collect()
}
