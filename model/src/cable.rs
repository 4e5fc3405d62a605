//! Cables of rigid segments, laid along a route and joined end to end \[SL §IV]: [`Scene::add_cable`].
//!
//! A [`Cable`] runs from one end through given points to the other. Segments are the chords of this polyline between
//! points at equal arc lengths, or at the arc lengths given. Mass and compliance are those of the arcs; the rods are the
//! chords, equal to them on straight routes, shorter by a relative O(1/N²) on curves and by O(1/N) at a corner inside a
//! segment. A joint stands for the cable between the centres of its two segments, a joint at an end for
//! half a segment, each with the compliances l/EA, l/EI, l/GJ \[SL (34)–(36)]. The whole is then L/EA, and a clamped end
//! bends with an error of second order.
//!
//! # Frames
//! A segment lies along the z axis of its body, with the start of the cable at +z. Directions across the cable are carried
//! along the route by parallel transport: from one segment to the next by the smallest rotation that takes the one
//! direction to the other. So a cable that is straight at rest is laid bent but without torsion. Where the rest shape is
//! [`Rest::AsRouted`] the frames of each joint are turned to agree as laid, and nothing is strained.
//!
//! # Winch
//! A cable with a [`Winch`] at its start is hauled in and paid out there. Its first segment has the length that is off the
//! drum beyond whole segments, from half of one to one and a half; with it go its mass, its inertia and the compliances of
//! the joints at its ends ([`Fairlead`]). Where it grows beyond that it splits, where it falls short it merges with the next:
//! see [`winding`](crate::scene::winding). Limits are those of the whole length; the winch holds at half a segment.
//!
//! # Damping
//! A damping time τ gives a mode of frequency ω the damping ratio ζ = τω/2. [`Damping::Ratio`] is that of the lowest
//! longitudinal, bending and torsional mode of the cable alone, held at one end and without load, with μ the mass per
//! length and r the radius:
//!
//! ```text
//! ω = π/(2L) √(EA/μ),   (1.8751/L)² √(EI/μ),   π/(2L) √(GJ/(½ μ r²))
//! ```
//!
//! A load lowers the frequency, and with it the ratio.

pub(crate) mod route;
pub(crate) mod strand;

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;

use crate::body::Body;
use crate::collide::{Collider, DEFAULT_GROUP, Shape, Surface};
use crate::constraint::{
    Constraint, Cosserat, Fairlead, JointLaw, Paper, Spherical, TwistDefinition, Winch,
};
use crate::error::{SceneError, check, refuse};
use crate::frame::Frame;
use crate::material::{CrossSection, Material, Stiffness};
use crate::scene::resolution::Resolution;
use crate::scene::{CableParts, Scene, Stock};
use route::{PlacedSegment, Route};
use strand::Strand;

/// Most segments that a scene may have.
pub const MAX_SEGMENTS: usize = 10_000_000;

/// Kind of the cable's inner joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "toml", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "toml", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum JointKind {
    /// Ball joints: stretch only.
    Spherical,
    /// Stretch, two bend rows, twist.
    #[default]
    Cosserat,
    /// The paper's joint: stretch, one bend row, twist.
    Paper,
}

impl JointKind {
    /// A joint of this kind; ball joints take the stretch law alone.
    pub(crate) fn constraint(self, frames: [Frame; 2], law: JointLaw) -> Constraint {
        match self {
            Self::Spherical => Constraint::Spherical(Spherical {
                frames,
                stretch: law.stretch.unwrap_or_default(),
            }),
            Self::Cosserat => Constraint::Cosserat(Cosserat::new(frames, law)),
            Self::Paper => Constraint::Paper(Paper::new(frames, law)),
        }
    }

    /// Refuses a definition of the twist that only the paper's joint knows, for others.
    pub(crate) fn check_twist(self, definition: TwistDefinition) -> Result<(), SceneError> {
        if self == Self::Paper || definition == TwistDefinition::Ordinary {
            return Ok(());
        }
        let reason = "is a choice of the paper's joint: use joint = \"paper\"";
        refuse("twist_definition", reason)
    }
}

/// How an end of the cable is held.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "toml", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "toml", serde(rename_all = "kebab-case"))]
pub enum End {
    /// A ball joint.
    #[default]
    Spherical,
    /// With the cable's own joint law over half a segment.
    Clamped,
}

impl End {
    /// Kind of the joint at this end of a cable with joints of `inner` kind.
    pub(crate) fn joint(self, inner: JointKind) -> JointKind {
        match self {
            Self::Spherical => JointKind::Spherical,
            Self::Clamped => inner,
        }
    }
}

/// Where a cable begins or ends, and how it is held there.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum CableEnd {
    /// At a point of the world \[m], held by nothing.
    Free(Vector3<f64>),
    /// At the point of the frame, by a ball joint.
    Pinned(Frame),
    /// At the point of the frame, in the direction in which the route meets it. The frame's axes are replaced.
    Clamped(Frame),
}

/// Segmentation of a cable.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Segments {
    /// Into so many segments of equal arc length, 1 to 10 million.
    Equal(usize),
    /// Into segments of these arc lengths from its start \[m], which add up to the length of the route.
    Lengths(Vec<f64>),
}

/// Damping of all rows of a cable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Damping {
    /// Damping time τ \[s], ≥ 0.
    Time(f64),
    /// Part of the critical damping of the cable's lowest modes, ≥ 0: see the [module](self).
    Ratio(f64),
}

/// Rest shape of a cable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "toml", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "toml", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Rest {
    /// Straight, whatever its route.
    #[default]
    Straight,
    /// The shape of its route.
    AsRouted,
}

/// A cable to be laid: [`Scene::add_cable`].
#[derive(Debug, Clone, PartialEq)]
pub struct Cable {
    /// Its name; its bodies are `NAME-1` …, its joints `NAME-start`, `NAME-joint-1` …, `NAME-end`.
    pub name: String,
    /// Where it begins and ends.
    pub ends: [CableEnd; 2],
    /// Points between its ends, world \[m].
    pub points: Vec<Vector3<f64>>,
    /// Its segmentation.
    pub segments: Segments,
    /// Winch that holds it at its start, hauls it in and pays it out: see the [module](self).
    pub winch: Option<Winch>,
    /// Rule by which its segments merge and split while it moves.
    pub resolution: Option<Resolution>,
    /// Mass per length \[kg/m].
    pub density: f64,
    /// Radius \[m], for the inertia of its segments.
    pub radius: f64,
    /// Its stiffness.
    pub stiffness: Stiffness,
    /// Its damping.
    pub damping: Damping,
    /// Kind of its inner joints. Ball joints resist neither bending nor torsion, and do not clamp.
    pub joint: JointKind,
    /// Bend rows in its joints.
    pub bend: bool,
    /// Twist row in its joints.
    pub twist: bool,
    /// Its rest shape.
    pub rest: Rest,
    /// Group of its joints, for block Gauss–Seidel over groups; see also [`Scene::group_by_topology`].
    pub group: u32,
    /// Surface of its segments, which are then capsules `NAME-1` … of its radius; `None`: nothing touches it. A
    /// capsule's ends reach over those of its segment by the radius, so that it overlaps the next.
    pub collide: Option<Surface>,
    /// Groups that its capsules are members of, a bit each: [`Collider::groups`].
    pub groups: u32,
    /// Groups whose members they meet, a bit each: [`Collider::meets`].
    pub meets: u32,
}

impl Cable {
    /// A solid round cable of that material and radius (m), straight from end to end in 24 segments with
    /// [`Cosserat`] joints, undamped. Nothing touches it; with a surface it is a member of [`DEFAULT_GROUP`] and meets all
    /// groups.
    #[must_use]
    pub fn round(
        name: impl Into<String>,
        material: &Material,
        radius: f64,
        ends: [CableEnd; 2],
    ) -> Self {
        let section = CrossSection::Circle { radius };
        Self {
            name: name.into(),
            ends,
            points: Vec::new(),
            segments: Segments::Equal(24),
            winch: None,
            resolution: None,
            density: material.density * section.area(),
            radius,
            stiffness: Stiffness::new(material, &section),
            damping: Damping::Time(0.0),
            joint: JointKind::Cosserat,
            bend: true,
            twist: true,
            rest: Rest::Straight,
            group: 0,
            collide: None,
            groups: DEFAULT_GROUP,
            meets: u32::MAX,
        }
    }

    fn what(&self, quantity: &str) -> String {
        format!("cable `{}`: {quantity}", self.name)
    }

    fn check_ranges(&self) -> Result<(), SceneError> {
        if self.name.is_empty() {
            let reason = "needs a name: its segments and joints are called after it";
            return refuse("a cable", reason);
        }
        let (damping, unit) = match self.damping {
            Damping::Time(time) => (time, "≥ 0 s"),
            Damping::Ratio(ratio) => (ratio, "≥ 0, a part of critical damping"),
        };
        for (what, value, needs) in [
            ("mass_per_length", self.density, "> 0 kg/m"),
            ("radius", self.radius, "> 0 m"),
            ("ea", self.stiffness.ea, "> 0 N"),
            ("ei", self.stiffness.ei, "> 0 N m²"),
            ("gj", self.stiffness.gj, "> 0 N m²"),
        ] {
            check(self.what(what), value, value > 0.0, needs)?;
        }
        check(self.what("damping"), damping, damping >= 0.0, unit)?;
        let ruled = self.resolution.as_ref().map(|_| "resolution");
        let splits = self.winch.map(|_| "winch").or(ruled);
        if let Some((what, reason)) = splits.zip(self.against_other_segments()) {
            return refuse(self.what(what), reason);
        }
        if let Some(reason) = self.winch.and_then(|_| self.against_winch()) {
            return refuse(self.what("winch"), reason);
        }
        let clamped = |end: &CableEnd| matches!(end, CableEnd::Clamped(_));
        if self.joint == JointKind::Spherical && self.ends.iter().any(clamped) {
            let reason = "ball joints do not clamp an end: pin it, or take another kind of joint";
            return refuse(self.what("joint"), reason);
        }
        Ok(())
    }

    /// Why its segments cannot split and merge.
    fn against_other_segments(&self) -> Option<&'static str> {
        let kinds = "makes joints of the kinds `cosserat` and `spherical` alone: take one of them";
        let routed = "makes cable that is straight at rest: leave out `as-routed`";
        let is_paper = (self.joint == JointKind::Paper).then_some(kinds);
        is_paper.or((self.rest == Rest::AsRouted).then_some(routed))
    }

    /// Why it can have no winch.
    fn against_winch(&self) -> Option<&'static str> {
        if matches!(self.ends[0], CableEnd::Free(_)) {
            return Some("needs a cable that is held at its start: pin or clamp it there");
        }
        let touches = self.collide.is_some();
        touches.then_some("is for cables that touch nothing: leave out `collide`")
    }

    /// Material of its segments, if a winch or a rule splits and merges them.
    fn stock(&self, strand: &Strand, placed: &[PlacedSegment], time: f64) -> Option<Stock> {
        if self.winch.is_none() && self.resolution.is_none() {
            return None;
        }
        let mut per_metre = strand.law(1.0);
        if self.joint == JointKind::Spherical {
            (per_metre.bend, per_metre.twist) = (None, None);
        }
        Some(Stock {
            density: self.density,
            radius: self.radius,
            per_metre,
            named: placed.len(),
            resolution: self.resolution.as_ref().map(|rule| {
                let lengths = placed.iter().map(|segment| segment.arc);
                rule.laid(lengths, time)
            }),
        })
    }

    /// The joint at its winch, between the frames.
    fn fairlead(
        (frames, winch): ([Frame; 2], Winch),
        (kind, strand): (JointKind, &Strand),
        placed: &[PlacedSegment],
    ) -> Fairlead {
        let mut law = strand.law(0.5 * placed[0].arc);
        if kind == JointKind::Spherical {
            (law.bend, law.twist) = (None, None);
        }
        Fairlead {
            frames,
            winch,
            length: placed.iter().map(|segment| segment.arc).sum(),
            first: placed[0].arc,
            segment: placed.get(1).unwrap_or(&placed[0]).arc,
            law,
            twist_reference: 0.0,
        }
    }

    /// Damping times of the stretch, bend and twist rows of a cable `length` (m) long \[s].
    fn damping_times(&self, length: f64) -> [f64; 3] {
        /// The first root of cos x cosh x = −1: a cantilever.
        const CANTILEVER: f64 = 1.875_104_068_711_961;
        let ratio = match self.damping {
            Damping::Time(time) => return [time; 3],
            Damping::Ratio(ratio) => ratio,
        };
        let Stiffness { ea, ei, gj } = self.stiffness;
        let quarter = FRAC_PI_2 / length;
        let spin = 0.5 * self.density * self.radius * self.radius;
        [
            quarter * (ea / self.density).sqrt(),
            (CANTILEVER / length).powi(2) * (ei / self.density).sqrt(),
            quarter * (gj / spin).sqrt(),
        ]
        .map(|frequency| 2.0 * ratio / frequency)
    }

    fn strand(&self, length: f64) -> Strand {
        Strand {
            damping: self.damping_times(length),
            bend: self.bend,
            twist: self.twist,
            ..Strand::new(self.joint, self.stiffness, 0.0)
        }
    }
}

impl Scene {
    /// Lays a cable with its segments and joints at the end of the scene, and returns their numbers. Add the bodies that
    /// hold its ends first, in the pose in which the cable is laid.
    ///
    /// # Errors
    /// The number, point, end or name that is wrong. The scene is then as it was.
    pub fn add_cable(&mut self, cable: &Cable) -> Result<CableParts, SceneError> {
        self.add_cable_at(cable, 0.0)
    }

    /// [`add_cable`](Self::add_cable) with prescribed motions evaluated at `time` (s).
    ///
    /// # Errors
    /// As there.
    pub fn add_cable_at(&mut self, cable: &Cable, time: f64) -> Result<CableParts, SceneError> {
        cable.check_ranges()?;
        let route = Route::of(cable, self, time)?;
        let placed = route.segments(cable)?;
        if let Some(winch) = cable.winch {
            winch.validate(false, || format!("cable `{}`", cable.name))?;
            let length = route.length();
            let within = (winch.shortest..=winch.longest).contains(&length);
            let needs = "between shortest and longest of its winch";
            check(cable.what("length"), length, within, needs)?;
        }
        self.check_new_names(cable, placed.len())?;
        let (bodies, constraints) = (self.bodies.len(), self.constraints.len());
        let colliders = self.colliders.len();
        self.add_placed(cable, &route, &placed, time);
        let new_bodies: Vec<usize> = (bodies..self.bodies.len()).collect();
        let new: Vec<usize> = (constraints..self.constraints.len()).collect();
        let mut bodies = new_bodies.iter();
        let stock = self.cables.last().and_then(|parts| parts.stock.as_ref());
        let sound = stock.map_or(Ok(()), |stock| {
            stock.validate(|| format!("cable `{}`", cable.name))
        });
        let sound = sound.and_then(|()| bodies.try_for_each(|i| self.validate_body(*i)));
        let sound = sound.and_then(|()| new.iter().try_for_each(|i| self.validate_constraint(*i)));
        let mut capsules = colliders..self.colliders.len();
        let sound = sound.and_then(|()| capsules.try_for_each(|i| self.validate_collider(i)));
        if sound.is_err() {
            self.remove(&new_bodies, &new)?;
        }
        sound.map(|()| self.cables.last().cloned().unwrap_or_default())
    }

    fn add_placed(&mut self, cable: &Cable, route: &Route, placed: &[PlacedSegment], time: f64) {
        let strand = cable.strand(route.length());
        let number = Strand::begin(self, &*cable.name);
        let first = self.bodies.len();
        let rods = placed.iter().map(|segment| {
            let rod = Body::rod(segment.chord, cable.radius, cable.density * segment.arc);
            rod.at(segment.centre).turned(segment.turn)
        });
        Strand::add_segments(self, number, &cable.name, rods);
        self.cables[number].stock = cable.stock(&strand, placed, time);
        if let Some(surface) = cable.collide {
            self.cover(cable, first, placed, surface);
        }
        let ends = |i: usize| strand.ends(first + i, placed[i].chord);
        let name = |of: &str| format!("{}-{of}", cable.name);
        if let Some((kind, frame)) = self.held(cable, route, &placed[0], 0) {
            let joint = (kind, [frame, ends(0)[0]]);
            if let Some(mut winch) = cable.winch {
                winch.since = winch.since.max(time);
                let lead = Cable::fairlead((joint.1, winch), (kind, &strand), placed);
                let lead = self.add_constraint(name("start"), lead, 0);
                self.cables[number].joints.push(lead);
            } else {
                strand.join(self, number, name("start"), joint, 0.5 * placed[0].arc);
            }
        }
        for (i, pair) in placed.windows(2).enumerate() {
            let [mut a, mut b] = [ends(i)[1], ends(i + 1)[0]];
            if cable.rest == Rest::AsRouted {
                let between = route::halfway(&pair[0], &pair[1]);
                (a.axes, b.axes) = (pair[0].axes_of(&between), pair[1].axes_of(&between));
            }
            let length = 0.5 * (pair[0].arc + pair[1].arc);
            let (joint, name) = ((cable.joint, [a, b]), name(&format!("joint-{}", i + 1)));
            strand.join(self, number, name, joint, length);
        }
        let last = placed.len() - 1;
        if let Some((kind, frame)) = self.held(cable, route, &placed[last], 1) {
            let joint = (kind, [ends(last)[1], frame]);
            strand.join(self, number, name("end"), joint, 0.5 * placed[last].arc);
        }
        for joint in &self.cables[number].joints {
            self.groups[*joint] = cable.group;
        }
    }

    /// Gives the segments, from body `first` on, their capsules.
    fn cover(&mut self, cable: &Cable, first: usize, placed: &[PlacedSegment], surface: Surface) {
        for (i, segment) in placed.iter().enumerate() {
            let (length, radius) = (segment.chord, cable.radius);
            let capsule = Shape::Capsule { length, radius };
            let name = format!("{}-{}", cable.name, i + 1);
            self.colliders.push(Collider {
                surface,
                groups: cable.groups,
                meets: cable.meets,
                ..Collider::new(name, Some(first + i), capsule)
            });
        }
    }

    /// The joint and the frame that hold end 0 or 1 of a cable, at its segment there.
    fn held(
        &self,
        cable: &Cable,
        route: &Route,
        segment: &PlacedSegment,
        end: usize,
    ) -> Option<(JointKind, Frame)> {
        match cable.ends[end] {
            CableEnd::Free(_) => None,
            CableEnd::Pinned(frame) => Some((JointKind::Spherical, frame)),
            CableEnd::Clamped(frame) => {
                let turn = match cable.rest {
                    Rest::Straight => segment.carried(&route.direction_at(end)),
                    Rest::AsRouted => segment.turn,
                };
                let axes = turn.to_rotation_matrix() * crate::frame::hanging_axes();
                let body = frame.body_index().map(|i| self.bodies.rotation(i));
                let axes = body.map_or(axes, |rotation| rotation.transpose() * axes);
                Some((cable.joint, frame.with_axes(axes)))
            }
        }
    }

    /// Refuses cable, segment and joint names that are in use.
    fn check_new_names(&self, cable: &Cable, segments: usize) -> Result<(), SceneError> {
        let prefix = format!("{}-", cable.name);
        let counted = |number: &str| {
            let number = number.parse();
            number.is_ok_and(|n: usize| (1..=segments).contains(&n))
        };
        let body = |name: &&String| name.strip_prefix(&prefix).is_some_and(counted);
        let joint = |name: &&String| match name.strip_prefix(&prefix) {
            Some("start" | "end") => true,
            Some(rest) => rest.strip_prefix("joint-").is_some_and(counted),
            None => false,
        };
        let mut cables = self.cables.iter().map(|c| &c.name);
        let covered = cable.collide.is_some();
        let mut capsules = self.colliders.iter().map(|c| &c.name).filter(|_| covered);
        for (kind, taken) in [
            ("collider", capsules.find(body)),
            ("cable", cables.find(|name| **name == cable.name)),
            ("body", self.body_names.iter().find(body)),
            ("joint", self.constraint_names.iter().find(joint)),
        ] {
            if let Some(name) = taken.cloned() {
                return Err(SceneError::Duplicate { kind, name });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
