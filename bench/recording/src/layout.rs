//! Channels of a scene, and the bodies, constraints and contacts to draw.
//!
//!
//! A layout holds until bodies or constraints come or go; then another one begins. It names the
//! channels that move each thing, so that a reader needs no other rule.

use serde::{Deserialize, Serialize};

/// A number of each frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Its name, as that of a column of `taut run`: `NAME.QUANTITY`, or a quantity of the run or a control alone.
    pub name: String,
    /// Its unit; empty for counts and controls.
    pub unit: String,
    /// Value of one count. `None` if the integers are the bits of single-precision numbers.
    pub step: Option<f32>,
}

/// Outline of a body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Radius \[m].
        radius: f32,
    },
    Box {
        /// Edge lengths \[m].
        size: [f32; 3],
    },
    /// A cylinder along z with half a ball on each end.
    Capsule {
        /// Distance between the centres of the half balls \[m].
        length: f32,
        /// Radius \[m].
        radius: f32,
    },
    /// A cylinder along z.
    Cylinder {
        /// Length \[m].
        length: f32,
        /// Radius \[m].
        radius: f32,
    },
    /// Everything below z = 0.
    Ground,
    /// Something without a size.
    Point,
}

impl Shape {
    fn is_finite(&self) -> bool {
        match self {
            Self::Sphere { radius } => radius.is_finite(),
            Self::Box { size } => size.iter().all(|x| x.is_finite()),
            Self::Capsule { length, radius } | Self::Cylinder { length, radius } => {
                length.is_finite() && radius.is_finite()
            }
            Self::Ground | Self::Point => true,
        }
    }
}

/// A shape in a place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Solid {
    pub shape: Shape,
    /// Its centre, frame of its body or of the world \[m].
    pub at: [f32; 3],
    /// Its turn in that frame: a unit quaternion, scalar first.
    pub turn: [f32; 4],
    /// Channel of the length of a capsule whose length changes.
    pub length: Option<usize>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    pub name: String,
    /// First of its seven channels: centre of mass x, y, z \[m] and unit quaternion, scalar first.
    pub pose: usize,
    /// Mass \[kg]; zero for what no force moves.
    pub mass: f32,
    pub solids: Vec<Solid>,
    /// Channels of the tensions \[N], bending and twisting moments \[N m] of the joints that hold it as a segment of a
    /// cable: each of these lists is empty otherwise.
    pub loads: [Vec<usize>; 3],
}

/// A cable of segments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cable {
    pub name: String,
    /// Its segments, from its start: numbers of bodies.
    pub bodies: Vec<usize>,
    /// Channels of the tensions of its joints \[N].
    pub tensions: Vec<usize>,
}

/// A point that something holds on to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// The body that it is fixed to; `None` for the world.
    pub body: Option<usize>,
    /// Where, frame of the body or of the world \[m].
    pub at: [f32; 3],
    /// First of three channels that hold where it is now \[m], for a point of the world that is moved.
    pub moved: Option<usize>,
    /// The sheave around it.
    pub sheave: Option<Sheave>,
}

/// A wheel that a line runs over.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sheave {
    /// Radius \[m].
    pub radius: f32,
    /// Two unit vectors v and w across its axis, frame of what it is fixed to: the angle α is at cos α v + sin α w.
    pub axes: [[f32; 3]; 2],
    /// First of two channels: the angles at which the line arrives and leaves \[rad], no numbers where it passes by.
    #[serde(rename = "lay")]
    pub angles: usize,
}

/// A massless cable or link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Line {
    pub name: String,
    /// The points that it runs through.
    pub points: Vec<Point>,
    /// Channel of its tension \[N].
    pub tension: Option<usize>,
}

/// Description of a scene from one change of it to the next.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layout {
    /// The numbers of each frame.
    pub channels: Vec<Channel>,
    pub bodies: Vec<Body>,
    /// The load; the last body where the scene names none.
    pub load: Option<usize>,
    /// The cables of segments.
    pub cables: Vec<Cable>,
    /// Massless cables and links.
    pub lines: Vec<Line>,
    /// Points at which the world holds bodies by joints.
    pub anchors: Vec<Point>,
    /// Static shapes of the world: the ground, walls.
    pub world: Vec<Solid>,
}

impl Layout {
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c.name == name)
    }

    /// True if every body and channel number is in range and every length is finite.
    pub(crate) fn is_sound(&self) -> bool {
        let has = |first: usize, count: usize| {
            let end = first.checked_add(count);
            end.is_some_and(|end| end <= self.channels.len())
        };
        let body = |number: usize| number < self.bodies.len();
        let finite = |x: &[f32]| x.iter().all(|x| x.is_finite());
        let point = |p: &Point| {
            finite(&p.at)
                && p.body.is_none_or(body)
                && p.moved.is_none_or(|first| has(first, 3))
                && p.sheave.as_ref().is_none_or(|s| has(s.angles, 2))
        };
        let solid = |s: &Solid| {
            finite(&s.at)
                && finite(&s.turn)
                && s.shape.is_finite()
                && s.length.is_none_or(|c| has(c, 1))
        };
        let of_body = |b: &Body| {
            has(b.pose, 7)
                && b.solids.iter().all(solid)
                && b.loads.iter().flatten().all(|c| has(*c, 1))
        };
        let of_cable =
            |c: &Cable| c.bodies.iter().all(|b| body(*b)) && c.tensions.iter().all(|c| has(*c, 1));
        let of_line = |l: &Line| l.points.iter().all(point) && l.tension.is_none_or(|c| has(c, 1));
        self.load.is_none_or(body)
            && self.bodies.iter().all(of_body)
            && self.cables.iter().all(of_cable)
            && self.lines.iter().all(of_line)
            && self.anchors.iter().all(point)
            && self.world.iter().all(solid)
    }
}
