//! Scenes without one of the things that they model, and with more or fewer segments: what a ledger of cost and worth
//! compares.
//!
//! A scene keeps the form that it is written in, as far as its keys can say what is left out: `twist = false` of a hoist or a
//! `[[cable]]`, `friction = 0`. Else it is written body by body.

use nalgebra::Vector3;
use taut_model::scene_file::{
    CollideEntry, JointEntry, Kind, MasslessCableEntry, PointEntry, ResolutionEntry, SceneText,
    SurfaceEntry,
};
use taut_model::{ContactScene, JointKind, Network, Rest, Scene, SceneError, SceneSource};

/// A thing that scenes model and may do without.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The twist rows of cables.
    Torsion,
    /// The bend rows of cables and links.
    Bending,
    /// The compliance of cables along themselves: they become rigid, with as many rows.
    Stretch,
    /// Friction of sheaves and shapes.
    Friction,
    /// The shapes that can touch.
    Contacts,
    /// The segments of cables, which become massless and straight.
    Segments,
}

impl Part {
    pub const ALL: [Self; 6] = [
        Self::Torsion,
        Self::Bending,
        Self::Stretch,
        Self::Friction,
        Self::Contacts,
        Self::Segments,
    ];
}

/// Scenes that are leaner, or finer, than their source says.
pub trait Leaner: Sized {
    /// The scene without `part`; `None` where it has none.
    ///
    /// # Errors
    /// As [`SceneSource::build`] of this scene and of the one without the part, such as of events
    /// that need it.
    fn without(&self, part: Part) -> Result<Option<Self>, SceneError>;

    /// The scene with `factor` times as many segments of the same cables, at least one each; `None` where it has none whose
    /// number is a key, or where something else names a segment.
    ///
    /// # Errors
    /// [`SceneError`] of a scene that can have no such number.
    fn with_segments(&self, factor: f64) -> Result<Option<Self>, SceneError>;

    /// The scene with the default rule of resolution for each `[[cable]]` that has none and may have one; `None` where there is
    /// no such cable, or where something else names a segment.
    ///
    /// # Errors
    /// [`SceneError`] of a scene that cannot be written.
    fn with_resolution(&self) -> Result<Option<Self>, SceneError>;
}

impl Leaner for SceneSource {
    fn without(&self, part: Part) -> Result<Option<Self>, SceneError> {
        let scene = self.build()?;
        let mut lean = self.clone();
        match (&mut lean, part) {
            (Self::Hoist(params), Part::Torsion) => params.twist = Some(false),
            (Self::Hoist(params), Part::Bending) => params.bend = Some(false),
            (Self::Gantry(params), Part::Friction) => params.sheave_friction = 0.0,
            (Self::Reeved(params), Part::Friction) => params.friction = 0.0,
            (Self::ContactScene(params), Part::Friction) => params.friction = 0.0,
            (Self::Explicit(text), part) if !matches!(part, Part::Stretch | Part::Segments) => {
                leave_out(text, part);
            }
            _ => {
                let mut text = SceneText::from_scene(&scene)?;
                match part {
                    Part::Segments if !leave_out_segments(&mut text, &scene) => return Ok(None),
                    Part::Segments => {}
                    part => leave_out(&mut text, part),
                }
                lean = Self::Explicit(Box::new(text));
            }
        }
        let other = lean.build()?;
        Ok((other != scene).then_some(lean))
    }

    fn with_segments(&self, factor: f64) -> Result<Option<Self>, SceneError> {
        let scaled = |count: usize| ((count as f64 * factor).round() as usize).max(1);
        // Masses of cable and load stay.
        let scale = |segments: &mut usize, mass: &mut f64, mass_ratio: &mut f64| {
            let part = *segments as f64 / scaled(*segments) as f64;
            *mass *= part;
            *mass_ratio /= part;
            *segments = scaled(*segments);
        };
        let mut lean = self.clone();
        match &mut lean {
            Self::Hoist(p) => {
                let own = p.material.is_none() && p.radius.is_none();
                let given = p.segment_mass.or(own.then_some(1.0));
                let mut mass = given.unwrap_or_default();
                scale(&mut p.segments, &mut mass, &mut p.mass_ratio);
                p.segment_mass = given.map(|_| mass);
            }
            Self::Gantry(p) => scale(&mut p.segments, &mut p.segment_mass, &mut p.mass_ratio),
            Self::ContactScene(p) if p.scene == ContactScene::Floor => {
                scale(&mut p.segments, &mut p.segment_mass, &mut p.mass_ratio);
            }
            Self::Network(p) if !matches!(p.network, Network::Ladder | Network::Net) => {
                scale(&mut p.segments, &mut p.segment_mass, &mut p.mass_ratio);
            }
            Self::Specimen(params) => {
                params.grip_mass = Some(params.resolve()?.grip_mass);
                params.segments = scaled(params.segments);
            }
            Self::Explicit(text) if !text.cable.is_empty() && !names_segments(text)? => {
                for cable in &mut text.cable {
                    match &mut cable.lengths {
                        Some(lengths) => *lengths = resampled(lengths, scaled(lengths.len())),
                        None => cable.segments = Some(scaled(cable.segments.unwrap_or(24))),
                    }
                }
            }
            _ => return Ok(None),
        }
        let (before, after) = (self.build()?, lean.build()?);
        Ok((before != after).then_some(lean))
    }

    fn with_resolution(&self) -> Result<Option<Self>, SceneError> {
        let Self::Explicit(text) = self else {
            return Ok(None);
        };
        if names_segments(text)? {
            return Ok(None);
        }
        let mut text = text.clone();
        let mut any = false;
        for cable in &mut text.cable {
            let may = cable.joint != JointKind::Paper && cable.rest == Rest::Straight;
            if may && cable.resolution.is_none() {
                cable.resolution = Some(ResolutionEntry::default());
                any = true;
            }
        }
        Ok(any.then_some(Self::Explicit(text)))
    }
}

/// As many lengths with the same sum, equal within each of the old ones' share.
fn resampled(lengths: &[f64], count: usize) -> Vec<f64> {
    let ends: Vec<f64> = std::iter::once(0.0)
        .chain(lengths.iter().scan(0.0, |sum, length| {
            *sum += length;
            Some(*sum)
        }))
        .collect();
    let at = |k: usize| {
        let place = k as f64 * lengths.len() as f64 / count as f64;
        let first = (place as usize).min(lengths.len() - 1);
        ends[first] + (place - first as f64) * lengths[first]
    };
    (0..count).map(|k| at(k + 1) - at(k)).collect()
}

/// True if anything but the cables themselves names a segment or an inner joint of one.
fn names_segments(text: &SceneText) -> Result<bool, SceneError> {
    let mut others = text.clone();
    others.cable.clear();
    let written = SceneSource::Explicit(Box::new(others)).to_toml()?;
    Ok(text.cable.iter().any(|cable| {
        let begin = format!("\"{}-", cable.name);
        let mut named = written.match_indices(&begin);
        named.any(|(at, _)| {
            let rest = &written[at + begin.len()..];
            !rest.starts_with("start\"") && !rest.starts_with("end\"")
        })
    }))
}

fn leave_out(text: &mut SceneText, part: Part) {
    match part {
        Part::Torsion => {
            text.cable.iter_mut().for_each(|c| c.twist = Some(false));
            cable_joints(text).for_each(|joint| {
                (joint.twist, joint.gj, joint.twist_damping) = (None, None, None);
            });
        }
        Part::Bending => {
            text.cable.iter_mut().for_each(|c| c.bend = Some(false));
            cable_joints(text).for_each(|joint| {
                (joint.bend, joint.ei, joint.bend_damping) = (None, None, None);
            });
            let bends: Vec<String> = text.bend.drain(..).map(|bend| bend.name).collect();
            text.order.retain(|name| !bends.contains(name));
        }
        Part::Stretch => {
            for joint in &mut text.joint {
                let cable = matches!(joint.kind, Kind::Cosserat | Kind::Paper);
                if cable || matches!(joint.kind, Kind::Spherical | Kind::Distance) {
                    joint.ea = None;
                    joint.stretch = joint.stretch.map(|_| 0.0);
                }
            }
            for cable in &mut text.massless_cable {
                (cable.ea, cable.stretch) = (None, Some(0.0));
            }
        }
        Part::Friction => smooth(text),
        Part::Contacts => {
            text.body.iter_mut().for_each(|body| body.collide = None);
            text.cable.iter_mut().for_each(|cable| cable.collide = None);
            text.ground.clear();
            text.collider.clear();
        }
        Part::Segments => {}
    }
}

/// The joints within and at the ends of cables.
fn cable_joints(text: &mut SceneText) -> impl Iterator<Item = &mut JointEntry> {
    let joints = text.joint.iter_mut();
    joints.filter(|joint| matches!(joint.kind, Kind::Cosserat | Kind::Paper))
}

/// Leaves friction out, but for the sheaves of a written cable, whose parts have tensions of their own.
fn smooth(text: &mut SceneText) {
    let bodies = text.body.iter_mut().map(|body| &mut body.collide);
    let cables = text.cable.iter_mut().map(|cable| &mut cable.collide);
    for collide in bodies.chain(cables).flatten() {
        match collide {
            CollideEntry::With(surface) => surface.friction = Some(0.0),
            CollideEntry::Is(true) => {
                *collide = CollideEntry::With(SurfaceEntry {
                    friction: Some(0.0),
                    ..SurfaceEntry::default()
                });
            }
            _ => {}
        }
    }
    let ground = text.ground.iter_mut().map(|ground| &mut ground.friction);
    let collider = text.collider.iter_mut().map(|shape| &mut shape.friction);
    ground.chain(collider).for_each(|mu| *mu = Some(0.0));
    let whole = |cable: &&mut MasslessCableEntry| cable.after.is_none();
    let points = text.massless_cable.iter_mut().filter(whole);
    let sheaves = points.flat_map(|cable| &mut cable.through);
    for sheave in sheaves.filter_map(|point| point.sheave.as_mut()) {
        sheave.friction = 0.0;
    }
}

/// Puts a massless cable of the same length and compliance in the place of each cable of segments that two bodies, or a body
/// and the world, hold; `scene` is what the text builds. The constraints then have the order of
/// their lists. Whether there was such a cable.
fn leave_out_segments(text: &mut SceneText, scene: &Scene) -> bool {
    let before = text.massless_cable.len();
    for cable in &scene.cables {
        let is_own = |name: &str| cable.bodies.iter().any(|i| scene.body_names[*i] == name);
        let mut joints = Vec::new();
        for c in &cable.joints {
            let name = &scene.constraint_names[*c];
            joints.extend(text.joint.iter().position(|joint| joint.name == *name));
        }
        let ends = |joint: &JointEntry| !is_own(&joint.a) || !is_own(&joint.b);
        let held = joints.iter().filter(|j| ends(&text.joint[**j])).count();
        if held != 2 || hold_between(text, &joints, &is_own) {
            continue;
        }
        let joints: Vec<JointEntry> = joints.iter().map(|j| text.joint[*j].clone()).collect();
        let entry = massless(&cable.name, &joints, &is_own);
        let gone = |name: &str| joints.iter().any(|joint| joint.name == name);
        text.joint.retain(|joint| !gone(&joint.name));
        text.collider.retain(|shape| !is_own(&shape.body));
        text.body.retain(|body| !is_own(&body.name));
        text.massless_cable.push(entry);
    }
    let any = text.massless_cable.len() > before;
    if any {
        text.order.clear();
    }
    any
}

/// True if anything but a cable's `joints` holds its segments.
fn hold_between(text: &SceneText, joints: &[usize], is_own: &dyn Fn(&str) -> bool) -> bool {
    let others = (text.joint.iter().enumerate()).filter(|(j, _)| !joints.contains(j));
    let joints = others.flat_map(|(_, joint)| [&joint.a, &joint.b]);
    let cables = text.massless_cable.iter().flat_map(|cable| &cable.through);
    let points = cables.chain(text.bend.iter().flat_map(|bend| &bend.through));
    let mut held = joints.chain(points.map(|point| &point.body));
    held.any(|body| is_own(body))
}

/// The massless cable in the place of one of segments, between what holds its ends.
fn massless(
    name: &str,
    joints: &[JointEntry],
    is_own: &dyn Fn(&str) -> bool,
) -> MasslessCableEntry {
    let mut through = Vec::new();
    let mut ends: Vec<(&str, Vector3<f64>)> = Vec::new();
    let mut stretch = 0.0;
    for joint in joints {
        stretch += joint.stretch.unwrap_or(0.0);
        for (body, point) in [(&joint.a, joint.point_a), (&joint.b, joint.point_b)] {
            let point = point.unwrap_or_default();
            if is_own(body) {
                ends.push((body, Vector3::from(point)));
            } else {
                through.push(PointEntry {
                    body: body.clone(),
                    point,
                    motion: joint.motion,
                    ..PointEntry::default()
                });
            }
        }
    }
    // Each segment has two ends in its own frame.
    ends.sort_by_key(|(body, _)| *body);
    let segments = ends.chunk_by(|a, b| a.0 == b.0);
    let length: f64 = segments
        .filter(|ends| ends.len() == 2)
        .map(|ends| (ends[0].1 - ends[1].1).norm())
        .sum();
    MasslessCableEntry {
        name: name.to_owned(),
        through,
        length: Some(length),
        stretch: Some(stretch),
        damping: joints[0].damping,
        ..MasslessCableEntry::default()
    }
}

#[cfg(test)]
mod tests;
