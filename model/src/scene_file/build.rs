//! Explicit scenes from their entries: what is common to all of them, and their order.

use std::collections::{HashMap, HashSet};

use super::cable::CableEntry;
use super::collide::collide_body;
use super::entries::SceneText;
use super::groups::Groups;
use super::places::{Fault, each};
use crate::cable::strand::Strand;
use crate::constraint::{Constraint, RowLaw};
use crate::error::{SceneError, check};
use crate::frame::Side;
use crate::motion::Motion;
use crate::names::near_names;
use crate::scene::reeving::{Part, part_name};
use crate::scene::validate::validate_motion;
use crate::scene::{CableParts, Capstan, Scene};

/// The name that stands for the world in a constraint.
pub(super) const WORLD: &str = "world";

/// An entry as its faults name it: the list that it stands in, and its name.
pub(super) struct Entry<'a> {
    list: &'static str,
    name: &'a str,
}

impl<'a> Entry<'a> {
    pub(super) fn new(list: &'static str, name: &'a str) -> Self {
        Self { list, name }
    }

    pub(super) fn owner(&self) -> String {
        format!("{} `{}`", self.list, self.name)
    }

    pub(super) fn what(&self, quantity: &str) -> String {
        format!("{}: {quantity}", self.owner())
    }

    pub(super) fn conflict(&self, key: &str, reason: &'static str) -> Fault {
        let what = self.what(key);
        Fault::new(key, SceneError::Conflict { what, reason })
    }

    pub(super) fn check(
        &self,
        key: &str,
        value: f64,
        ok: bool,
        needs: &'static str,
    ) -> Result<f64, Fault> {
        let checked = check(self.what(key), value, ok, needs);
        checked
            .map(|()| value)
            .map_err(|error| Fault::new(key, error))
    }

    pub(super) fn finite(&self, key: &str, values: &[f64]) -> Result<(), Fault> {
        let mut values = values.iter();
        values.try_for_each(|x| self.check(key, *x, true, "finite").map(drop))
    }

    /// The law of a row with that compliance and damping time, of the keys that give them.
    pub(super) fn law(
        &self,
        (key, compliance): (&str, f64),
        (damping_key, damping): (&str, f64),
    ) -> Result<RowLaw, Fault> {
        let what = self.what(&format!("{key}: compliance"));
        let needs = "≥ 0 (m/N or rad/(N m)); 0 is rigid";
        let checked = check(what, compliance, compliance >= 0.0, needs);
        checked.map_err(|error| Fault::new(key, error))?;
        self.check(damping_key, damping, damping >= 0.0, "≥ 0 s")?;
        Ok(RowLaw::new(compliance, damping))
    }

    /// The compliance given, or `length` over the stiffness given; `None` where neither is.
    pub(super) fn compliance(
        &self,
        key: &str,
        compliance: Option<f64>,
        (stiff_key, stiffness): (&str, Option<f64>),
        length: Option<f64>,
    ) -> Result<Option<f64>, Fault> {
        let Some(stiffness) = stiffness else {
            return Ok(compliance);
        };
        if compliance.is_some() {
            let reason = "is given as a compliance and as a stiffness: give one of them";
            return Err(self.conflict(key, reason));
        }
        self.check(stiff_key, stiffness, stiffness > 0.0, "> 0 N, or N m²")?;
        let Some(length) = length else {
            let reason = "needs length: the metres of cable that the joint stands for";
            return Err(self.conflict(stiff_key, reason));
        };
        let length = self.check("length", length, length > 0.0, "> 0 m")?;
        Ok(Some(length / stiffness))
    }
}

/// The bodies by name.
pub(super) struct Names<'a> {
    index: HashMap<&'a str, usize>,
    all: &'a [String],
}

impl<'a> Names<'a> {
    fn of(all: &'a [String]) -> Self {
        let numbered = all.iter().enumerate();
        let index = numbered.map(|(i, name)| (name.as_str(), i)).collect();
        Self { index, all }
    }

    /// The world with its motion (of the key `motion_key`), or the body called `name`; `key` is that of the name.
    pub(super) fn side(
        &self,
        of: &Entry<'_>,
        key: &str,
        name: &str,
        motion: Option<&Motion>,
        motion_key: &str,
    ) -> Result<Side, Fault> {
        if name == WORLD {
            let motion = motion.copied().unwrap_or_default();
            validate_motion(|quantity| of.what(quantity), &motion).map_err(|error| {
                let key = motion.fault().map_or("", |(key, ..)| key);
                Fault::new(format!("{motion_key}.{key}"), error)
            })?;
            return Ok(Side::World(motion));
        }
        self.body(of, key, name).map(Side::Body)
    }

    /// The holder of a point whose keys `body`, `point` and `motion` stand at `path`: a motion is for points of the world.
    pub(super) fn holder(
        &self,
        of: &Entry<'_>,
        path: &str,
        (body, point): (&str, &[f64; 3]),
        motion: Option<&Motion>,
    ) -> Result<Side, Fault> {
        let at = |key: &str| format!("{path}.{key}");
        of.finite(&at("point"), point)?;
        let side = self.side(of, &at("body"), body, motion, &at("motion"))?;
        if motion.is_some() && matches!(side, Side::Body(_)) {
            return Err(of.conflict(&at("motion"), "moves points of the world: remove it"));
        }
        Ok(side)
    }

    /// Number of the body called `name`, under `key` of the entry `of`.
    pub(super) fn body(&self, of: &Entry<'_>, key: &str, name: &str) -> Result<usize, Fault> {
        let body = self.find(of.owner(), name);
        body.map_err(|error| Fault::new(key, error))
    }

    fn find(&self, what: String, name: &str) -> Result<usize, SceneError> {
        let body = self.index.get(name).copied();
        body.ok_or_else(|| SceneError::UnknownBody {
            what,
            name: name.to_owned(),
            known: near_names(name, self.all),
        })
    }
}

/// A constraint with its name and its group if the text gives one, and the path of its entry.
struct Built {
    path: String,
    name: String,
    group: Option<u32>,
    /// The cable that it belongs to.
    cable: Option<String>,
    breaks_at: Option<f64>,
    /// The part of a massless cable before it, and the friction between.
    after: Option<(String, f64)>,
    constraint: Constraint,
}

impl Built {
    /// The constraint of entry number `i` of a list.
    fn new(list: &str, i: usize, name: &str, group: Option<u32>, constraint: Constraint) -> Self {
        Self {
            path: format!("{list}.{i}"),
            name: name.to_owned(),
            group,
            cable: None,
            breaks_at: None,
            after: None,
            constraint,
        }
    }
}

impl SceneText {
    /// Builds the scene.
    ///
    /// # Errors
    /// The first body or constraint that is wrong. A scene that was read tells the line of its fault
    /// ([`SceneError::InText`]), or the override that brought it in ([`SceneError::Override`]).
    pub fn build(&self) -> Result<Scene, SceneError> {
        self.assemble()
            .map_err(|fault| self.places.located(self, fault))
    }

    pub(super) fn assemble(&self) -> Result<Scene, Fault> {
        let mut scene = Scene::new(self.name.clone());
        scene.gravity = self.gravity.into();
        scene.start_in_equilibrium = self.equilibrium;
        let colliding = Groups::of(self)?;
        let mut seen = HashSet::with_capacity(self.body.len());
        each("body", &self.body, |i, entry| {
            scene.add_body(entry.name.clone(), entry.build()?);
            scene.validate_body(i).map_err(of_body)?;
            // A name that two bodies have hides one of them from the constraints.
            if !seen.insert(entry.name.as_str()) {
                return Err(duplicate("body", &entry.name));
            }
            if let Some(cable) = &entry.cable {
                parts_of(&mut scene, cable).bodies.push(i);
            }
            collide_body(&mut scene, i, entry, &colliding)
        })?;
        let of_cables = self.lay_cables(&mut scene, &colliding)?;
        let names = scene.body_names.clone();
        let names = Names::of(&names);
        self.add_colliders(&mut scene, &names, &colliding)?;
        let load = self
            .load
            .as_ref()
            .map(|name| names.find("load".into(), name));
        scene.load = load.transpose().map_err(|e| Fault::new("load", e))?;
        let all = self.in_order(self.constraints(of_cables, &scene, &names)?)?;
        let grouped = all.iter().any(|built| built.group.is_some());
        scene.capstans = capstans(&all)?;
        for built in all {
            let group = built.group.unwrap_or(0);
            let i = scene.add_constraint(built.name, built.constraint, group);
            let sound = scene.validate_constraint(i);
            sound.map_err(|error| of_constraint(error).within(&built.path))?;
            if let Some(cable) = built.cable {
                let known = scene.cables.iter_mut().rfind(|c| c.name == cable);
                let Some(known) = known else {
                    let of = Entry::new("joint", &scene.constraint_names[i]);
                    let reason = "names a cable that no body belongs to: name one that is there";
                    return Err(of.conflict("cable", reason).within(&built.path));
                };
                known.joints.push(i);
            }
            if let Some(force) = built.breaks_at {
                scene.break_at(i, force);
                let event = scene.validate_event(scene.events.len() - 1);
                event.map_err(|e| Fault::new("breaks_at", e).within(&built.path))?;
            }
        }
        if !grouped {
            scene.group_by_topology();
        }
        each("control", &self.control, |i, entry| {
            let control = entry.build(&scene)?;
            if self.control[..i].iter().any(|c| c.name == entry.name) {
                return Err(duplicate("control", &entry.name));
            }
            scene.controls.push(control);
            Ok(())
        })?;
        each("event", &self.event, |_, entry| {
            let event = entry.build(&scene, &names, &self.event)?;
            if scene.events.iter().any(|e| e.name == entry.name) {
                return Err(duplicate("event", &entry.name));
            }
            scene.events.push(event);
            Ok(())
        })?;
        // One may release what a later one attaches.
        let first = scene.events.len() - self.event.len();
        each("event", &self.event, |i, _| {
            let sound = scene.validate_event(first + i);
            sound.map_err(|error| Fault::at(&[], error))
        })?;
        self.check_lengths(&scene)?;
        scene.validate().map_err(|error| {
            let gravity = matches!(&error, SceneError::BadValue { what, .. } if what == "gravity");
            Fault::at(if gravity { &["gravity"] } else { &[] }, error)
        })?;
        Ok(scene)
    }

    /// Refuses massless cables that are far shorter than their paths, unless the equilibrium moves what they hold.
    fn check_lengths(&self, scene: &Scene) -> Result<(), Fault> {
        each("massless_cable", &self.massless_cable, |_, entry| {
            if self.equilibrium || entry.strained == Some(true) {
                return Ok(());
            }
            let first = scene.constraint(&entry.name).ok();
            let sound = first.map_or(Ok(()), |first| scene.check_short(first));
            sound.map_err(|error| Fault::at(&["length", "tension", "name"], error))
        })
    }

    /// Lays the cables of segments: their bodies in the scene, their joints in a list.
    fn lay_cables(&self, scene: &mut Scene, groups: &Groups) -> Result<Vec<Built>, Fault> {
        let mut all = Vec::new();
        each("cable", &self.cable, |i, entry| {
            let cable = entry.build(&Names::of(&scene.body_names), groups)?;
            scene.add_cable(&cable).map_err(CableEntry::fault)?;
            let names = std::mem::take(&mut scene.constraint_names);
            for (name, joint) in names.into_iter().zip(scene.constraints.drain(..)) {
                all.push(Built {
                    cable: Some(entry.name.clone()),
                    breaks_at: entry.breaks_at,
                    ..Built::new("cable", i, &name, entry.group, joint)
                });
            }
            scene.groups.clear();
            parts_of(scene, &entry.name).joints.clear();
            Ok(())
        })?;
        Ok(all)
    }

    /// All constraints, list by list, with different names; `of_cables` are those of the cables.
    fn constraints(
        &self,
        of_cables: Vec<Built>,
        scene: &Scene,
        names: &Names<'_>,
    ) -> Result<Vec<Built>, Fault> {
        let bodies = &scene.bodies;
        let mut all = Vec::with_capacity(of_cables.len() + self.joint.len());
        each("joint", &self.joint, |i, entry| {
            let joint = entry.build(bodies, names)?;
            all.push(Built {
                cable: entry.cable.clone(),
                breaks_at: entry.breaks_at,
                ..Built::new("joint", i, &entry.name, entry.group, joint)
            });
            Ok(())
        })?;
        all.extend(of_cables);
        each("massless_cable", &self.massless_cable, |i, entry| {
            let mut before = entry.after.clone().zip(Some(entry.shared_friction()));
            for Part { cable, after } in entry.build(bodies, names)? {
                let (number, friction) = after.unwrap_or_default();
                let name = part_name(&entry.name, number);
                let own = before.replace((name.clone(), friction));
                all.push(Built {
                    // All parts break with the first.
                    breaks_at: entry.breaks_at.filter(|_| after.is_none()),
                    after: own.map(|(name, of_entry)| (name, after.map_or(of_entry, |_| friction))),
                    ..Built::new("massless_cable", i, &name, entry.group, cable.into())
                });
            }
            Ok(())
        })?;
        each("bend", &self.bend, |i, entry| {
            let bend = entry.build(bodies, names)?;
            all.push(Built::new("bend", i, &entry.name, entry.group, bend));
            Ok(())
        })?;
        let mut seen = HashMap::with_capacity(all.len());
        for built in &all {
            let list = |path: &str| path.split('.').next() == Some("joint");
            if let Some(first) = seen.insert(built.name.as_str(), built.path.as_str()) {
                let joints = list(first) && list(&built.path);
                let kind = if joints { "joint" } else { "constraint" };
                return Err(duplicate(kind, &built.name).within(&built.path));
            }
        }
        Ok(all)
    }

    /// The constraints in the order that the text asks for.
    fn in_order(&self, all: Vec<Built>) -> Result<Vec<Built>, Fault> {
        if self.order.is_empty() {
            return Ok(all);
        }
        let conflict = |name: &str, reason| {
            let what = format!("order: `{name}`");
            Fault::new("order", SceneError::Conflict { what, reason })
        };
        let named = all.into_iter().map(|built| (built.name.clone(), built));
        let mut named: HashMap<_, _> = named.collect();
        let mut ordered = Vec::with_capacity(named.len());
        for (i, name) in self.order.iter().enumerate() {
            let Some(built) = named.remove(name) else {
                let reason = match self.order[..i].contains(name) {
                    true => "is there twice: remove one",
                    false => "is no joint, cable or bend: remove it or write it as there",
                };
                return Err(conflict(name, reason).or_at(&format!("order.{i}")));
            };
            ordered.push(built);
        }
        // The first one of the text that is left out, whatever the order in the map.
        match named.into_values().min_by(|a, b| a.path.cmp(&b.path)) {
            Some(Built { name, .. }) => {
                Err(conflict(&name, "is left out: name every constraint once"))
            }
            None => Ok(ordered),
        }
    }
}

/// Where parts of a massless cable go on from others.
fn capstans(all: &[Built]) -> Result<Vec<Capstan>, Fault> {
    let number = |name: &str| all.iter().position(|built| built.name == name);
    let mut capstans = Vec::new();
    for (i, built) in all.iter().enumerate() {
        let Some((before, friction)) = &built.after else {
            continue;
        };
        let Some(before) = number(before) else {
            let of = Entry::new("massless cable", &built.name);
            let reason = "names a cable that is not there";
            return Err(of.conflict("after", reason).within(&built.path));
        };
        capstans.push(Capstan {
            parts: [before, i],
            friction: *friction,
        });
    }
    Ok(capstans)
}

/// The cable of that name, which is there or is added.
fn parts_of<'a>(scene: &'a mut Scene, name: &str) -> &'a mut CableParts {
    let known = scene.cables.iter().rposition(|cable| cable.name == name);
    let number = known.unwrap_or_else(|| Strand::begin(scene, name));
    &mut scene.cables[number]
}

fn duplicate(kind: &'static str, name: &str) -> Fault {
    let name = name.to_owned();
    Fault::new("name", SceneError::Duplicate { kind, name })
}

/// A fault of a body, whose inertia may be given by other keys.
fn of_body(error: SceneError) -> Fault {
    let fault = match error {
        SceneError::Inertia { .. } => Fault::new("inertia", error),
        _ => Fault::named(error),
    };
    fault.or_at("inertia_matrix").or_at("shape")
}

/// The fault of a constraint, at the keys that may have caused it.
fn of_constraint(error: SceneError) -> Fault {
    let keys: &[&str] = match &error {
        SceneError::Axes { side, .. } if side == "a" => &["axes_a", "through"],
        SceneError::Axes { side, .. } if side == "b" => &["axes_b", "through"],
        SceneError::Axes { .. } => &["through"],
        SceneError::BothWorld { .. } | SceneError::SameBody { .. } => &["b", "through"],
        _ => return Fault::named(error),
    };
    Fault::at(keys, error)
}
