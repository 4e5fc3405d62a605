//! Cables of segments in explicit scenes: one entry for what [`Scene::add_cable`](crate::Scene::add_cable) lays.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::build::{Entry, Names};
use super::collide::CollideEntry;
use super::groups::Groups;
use super::keys::described;
use super::places::Fault;
use crate::cable::{Cable, CableEnd, Damping, JointKind, Rest, Segments};
use crate::constraint::Winch;
use crate::error::SceneError;
use crate::frame::{Frame, Side};
use crate::material::{Material, RoundCable};
use crate::motion::Motion;
use crate::scene::resolution::Resolution;

described! {
    /// A cable of rigid segments, `NAME-1` …, with the joints `NAME-start`, `NAME-joint-1` …, `NAME-end`. Its size is
    /// `radius` or `ea`.
    #[derive(Default)]
    pub struct CableEntry {
        /// Its name.
        pub name: String,
        /// Where it begins: `{ body = "…", point = [x, y, z], held = "…" }`.
        pub from: EndEntry,
        /// Where it ends, likewise.
        pub to: EndEntry,
        /// Points between its ends, world \[m]; default none: straight.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub points: Vec<[f64; 3]>,
        /// Number of its segments; default 24.
        pub segments: Option<usize>,
        /// Lengths of its segments from its start \[m], which add up to the length of its route; instead of `segments`.
        pub lengths: Option<Vec<f64>>,
        /// `steel` (default), `nylon` or `rubber`.
        pub material: Option<String>,
        /// Radius \[m]; default that of a solid cable of the material with stiffness `ea`.
        pub radius: Option<f64>,
        /// Axial stiffness \[N]; default that of a solid cable of that radius.
        pub ea: Option<f64>,
        /// Bending stiffness \[N m²]; default that of a solid cable, EA r²/4.
        pub ei: Option<f64>,
        /// Torsional stiffness \[N m²]; default that of a solid cable, EI/(1 + ν).
        pub gj: Option<f64>,
        /// Mass per length \[kg/m]; default that of a solid cable.
        pub mass_per_length: Option<f64>,
        /// Damping time of all rows \[s]; default 0.
        pub damping: Option<f64>,
        /// Part of critical damping of the lowest modes of the cable alone; instead of `damping`.
        pub damping_ratio: Option<f64>,
        /// Kind of its joints: `cosserat` (default), `paper` or `spherical`.
        #[serde(default)]
        pub joint: JointKind,
        /// Bend rows in its joints; default `true`.
        pub bend: Option<bool>,
        /// Twist row in its joints; default `true`.
        pub twist: Option<bool>,
        /// Shape without strain: `straight` (default) or `as-routed`.
        #[serde(default)]
        pub rest: Rest,
        /// Tension at which each of its joints breaks \[N]: events called `NAME-joint-1 breaks` …; default never.
        pub breaks_at: Option<f64>,
        /// Winch at its start, which hauls it in and pays it out: as of a cable without mass; default none.
        pub winch: Option<Winch>,
        /// Rule by which its segments merge and split: `{ bend, phase, shortest, longest, hysteresis, pause, most }`, or `{}` for
        /// the defaults; default none.
        pub resolution: Option<ResolutionEntry>,
        /// Group of its joints for block Gauss–Seidel; default by topology.
        pub group: Option<u32>,
        /// Contact of its segments with others, as capsules of its radius: `true`, or `{ friction,
        /// restitution, compliance, damping, groups, meets }`; default `false`. A cable never touches
        /// itself.
        pub collide: Option<CollideEntry>,
    }
}

/// A rule of resolution: see [`Resolution`]. A load that swings out of a plane moves by millimetres where `from` and `to` are
/// exchanged: the rows of bending have the axes of one side, and the rule follows the angles.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResolutionEntry {
    /// Largest mean of the angles at a segment's ends \[rad]; default 0.1.
    pub bend: Option<f64>,
    /// Phase by which a segment oscillates across in a step \[rad]; default 0.25; 0: frequencies do not count.
    pub phase: Option<f64>,
    /// Least length of a segment \[m]; default the shortest that the cable is laid in.
    pub shortest: Option<f64>,
    /// Largest length of a segment \[m]; default that of the cable.
    pub longest: Option<f64>,
    /// Part that two segments are shorter than wanted before they merge; default 2.
    pub hysteresis: Option<f64>,
    /// Time without change before segments merge, > 0 \[s]; default 0.1.
    pub pause: Option<f64>,
    /// Most segments; default 10,000.
    pub most: Option<usize>,
}

impl ResolutionEntry {
    fn build(&self, of: &Entry<'_>) -> Result<Resolution, Fault> {
        let default = Resolution::default();
        if let Some(shortest) = self.shortest {
            of.check("resolution", shortest, shortest > 0.0, "a shortest > 0 m")?;
        }
        Ok(Resolution {
            bend: self.bend.unwrap_or(default.bend),
            phase: self.phase.unwrap_or(default.phase),
            shortest: self.shortest.unwrap_or(default.shortest),
            longest: self.longest.unwrap_or(default.longest),
            hysteresis: self.hysteresis.unwrap_or(default.hysteresis),
            pause: self.pause.unwrap_or(default.pause),
            most: self.most.unwrap_or(default.most),
            since: default.since,
        })
    }
}

/// An end of a cable.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EndEntry {
    /// `world` or a body's name.
    pub body: String,
    /// The point, body frame \[m] (world frame for the world); default the origin: a body's centre of mass.
    #[serde(default)]
    pub point: [f64; 3],
    /// How it is held there.
    #[serde(default)]
    pub held: Hold,
    /// Motion of a point of the world.
    pub motion: Option<Motion>,
}

/// How an end of a cable is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Hold {
    /// By a ball joint.
    #[default]
    Pinned,
    /// In the direction in which the route meets it.
    Clamped,
    /// By nothing.
    Free,
}

impl CableEntry {
    /// The cable between bodies that have their places.
    pub(super) fn build(&self, names: &Names<'_>, groups: &Groups) -> Result<Cable, Fault> {
        let of = Entry::new("cable", &self.name);
        let round = self.section(&of)?;
        let from = self.from.build(&of, "from", names)?;
        let to = self.to.build(&of, "to", names)?;
        of.finite("points", self.points.as_flattened())?;
        let segments = match (&self.segments, &self.lengths) {
            (Some(_), Some(_)) => {
                return Err(of.conflict("lengths", "excludes segments: give one of them"));
            }
            (None, Some(lengths)) => Segments::Lengths(lengths.clone()),
            (count, None) => Segments::Equal(count.unwrap_or(24)),
        };
        let damping = match (self.damping, self.damping_ratio) {
            (Some(_), Some(_)) => {
                return Err(of.conflict("damping_ratio", "excludes damping: give one of them"));
            }
            (None, Some(ratio)) => Damping::Ratio(ratio),
            (time, None) => Damping::Time(time.unwrap_or(0.0)),
        };
        let resolution = self.resolution.as_ref().map(|rule| rule.build(&of));
        let surface = self.collide.as_ref().and_then(CollideEntry::surface);
        let collide = surface.as_ref().map(|s| s.build(&of, "collide."));
        let (groups, meets) = groups.masks(&surface.unwrap_or_default());
        Ok(Cable {
            collide: collide.transpose()?,
            groups,
            meets,
            points: self.points.iter().copied().map(Vector3::from).collect(),
            segments,
            winch: self.winch,
            resolution: resolution.transpose()?,
            density: self.mass_per_length.unwrap_or(round.density),
            stiffness: round.stiffness,
            damping,
            joint: self.joint,
            bend: self.bend.unwrap_or(true),
            twist: self.twist.unwrap_or(true),
            rest: self.rest,
            ..Cable::round(&*self.name, &Material::STEEL, round.radius, [from, to])
        })
    }

    /// Its radius and stiffness, and the mass per length of a solid cable.
    fn section(&self, of: &Entry<'_>) -> Result<RoundCable, Fault> {
        let name = self.material.as_deref().unwrap_or("steel");
        let material = Material::find(name).map_err(|error| Fault::new("material", error))?;
        for (key, value, needs) in [("radius", self.radius, "> 0 m"), ("ea", self.ea, "> 0 N")] {
            let value = value.unwrap_or(1.0);
            of.check(key, value, value > 0.0, needs)?;
        }
        let of_radius = self.radius.map(|radius| material.round_stiffness(radius));
        let ea = self.ea.or(of_radius);
        let ea = ea.ok_or_else(|| of.conflict("radius", "give it in m, or ea in N"))?;
        Ok(material.round(ea, self.radius, [self.ei, self.gj]))
    }

    /// The fault of laying this cable, at the key that it is about.
    pub(super) fn fault(error: SceneError) -> Fault {
        let text = error.to_string();
        let about = text.split_once("`: ").map_or("", |(_, about)| about);
        let keys = [
            ("damping", &["damping", "damping_ratio"][..]),
            ("length of segment", &["lengths"]),
            ("sum of", &["lengths"]),
            ("point", &["points", "to"]),
            ("leg", &["points", "to"]),
            ("resolution", &["resolution"]),
            ("length is", &["winch"]),
            ("segment", &["segments", "lengths", "points"]),
            ("smallest dimension", &["collide", "radius"]),
        ];
        match keys.iter().find(|(start, _)| about.starts_with(start)) {
            Some((_, keys)) => Fault::at(keys, error),
            None => Fault::named(error).or_at("name"),
        }
    }
}

impl EndEntry {
    fn build(&self, of: &Entry<'_>, key: &str, names: &Names<'_>) -> Result<CableEnd, Fault> {
        let motion = self.motion.as_ref();
        let side = names.holder(of, key, (&self.body, &self.point), motion)?;
        let point = Vector3::from(self.point);
        let frame = Frame {
            side,
            ..Frame::world(point)
        };
        match (self.held, side) {
            (Hold::Pinned, _) => Ok(CableEnd::Pinned(frame)),
            (Hold::Clamped, _) => Ok(CableEnd::Clamped(frame)),
            (Hold::Free, Side::World(_)) if motion.is_none() => Ok(CableEnd::Free(point)),
            (Hold::Free, _) => {
                let reason = "a free end is a point of the world without motion";
                Err(of.conflict(&format!("{key}.held"), reason))
            }
        }
    }
}
