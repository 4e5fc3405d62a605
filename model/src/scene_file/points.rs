//! Constraints of explicit scenes that run through points: massless cables and bends of links.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::build::{Entry, Names};
use super::keys::described;
use super::places::Fault;
use crate::body::Bodies;
use crate::constraint::{
    BendDefinition, Constraint, LinkBend, MasslessCable, RowLaw, Sheave, SheaveContact, Winch,
};
use crate::frame::{Frame, axes_along, hanging_axes};
use crate::motion::Motion;
use crate::scene::reeving::Part;
use crate::unlimited::is_zero;

/// A point of a body or of the world.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointEntry {
    /// `world` or a body's name.
    pub body: String,
    /// The point, body frame \[m] (world frame for the world); default the origin: a body's centre of mass.
    #[serde(default)]
    pub point: [f64; 3],
    /// Columns u, v, w of the frame, of which sheaves alone use any, as a written scene holds them for `axis`; default hanging.
    pub axes: Option<[[f64; 3]; 3]>,
    /// Motion of a point of the world.
    pub motion: Option<Motion>,
    /// The sheave whose hub it is, in massless cables: `{ radius, axis, … }`.
    pub sheave: Option<SheaveEntry>,
}

/// A sheave that a massless cable runs over; at an end of the cable a drum. See [`Sheave`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SheaveEntry {
    /// Radius \[m].
    pub radius: f64,
    /// Its axis in the frame of what it is fixed to, about which the cable travels in the positive sense; a scene
    /// that is written back has `axes` of the point instead.
    pub axis: Option<[f64; 3]>,
    /// Turns that the cable lies on it at first: whole ones of an inner sheave, all of a drum; default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub turns: f64,
    /// Coefficient of friction of an inner sheave, over which the cable slips beyond e^(friction × wrap); default 0, it
    /// slides freely.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub friction: f64,
    /// `true` where two parts of the cable meet: the next part begins here, or this one goes on
    /// from the one before (`after`). Written back only.
    pub shared: Option<bool>,
    /// The angles in v and w between which it lies on it \[rad]; default by the path. Written back only.
    pub on: Option<[f64; 2]>,
    /// `true` where the cable passes by.
    pub off: Option<bool>,
    /// `true` if a cable that passes by was last seen on the groove's side; default `false`.
    /// Written back only.
    pub clear: Option<bool>,
}

impl SheaveEntry {
    fn build(&self) -> Sheave {
        Sheave {
            radius: self.radius,
            turns: self.turns,
            friction: self.friction,
            shared: self.shared.unwrap_or(false),
            contact: match self.on {
                _ if self.off == Some(true) => SheaveContact::Off {
                    clear: self.clear == Some(true),
                },
                Some([arriving, leaving]) => SheaveContact::On { arriving, leaving },
                None => SheaveContact::New,
            },
        }
    }

    /// The sheave as it is written.
    pub(super) fn of(sheave: &Sheave) -> Self {
        let contact = sheave.contact;
        Self {
            radius: sheave.radius,
            axis: None,
            turns: sheave.turns,
            friction: sheave.friction,
            shared: sheave.shared.then_some(true),
            on: match contact {
                SheaveContact::On { arriving, leaving } => Some([arriving, leaving]),
                SheaveContact::New | SheaveContact::Off { .. } => None,
            },
            off: contact.is_off().then_some(true),
            clear: (contact == SheaveContact::Off { clear: true }).then_some(true),
        }
    }
}

described! {
    /// A massless cable: one length through two or more points, free to slide through the inner ones. Its one row has
    /// `stretch` or `ea`.
    #[derive(Default)]
    pub struct MasslessCableEntry {
        /// Its name.
        pub name: String,
        /// Its points in order, each `{ body = "…", point = [x, y, z] }` with an optional `motion` of a world point, and an
        /// optional `sheave = { radius, axis, turns, friction }` with its hub there.
        pub through: Vec<PointEntry>,
        /// The cable that it goes on from over the shared sheave at its beginning, which has the friction there.
        pub after: Option<String>,
        /// Total length at rest, with what lies on drums \[m]; default that of its path at first, with what lies on sheaves and
        /// drums. See `strained`.
        pub length: Option<f64>,
        /// How much longer it is than its path at first \[m], instead of `length`.
        pub slack: Option<f64>,
        /// Its tension at first \[N], instead of `length`; needs `ea`, or a `stretch` that is not 0.
        pub tension: Option<f64>,
        /// `true` lets it begin strained by more than 5 % with a pull of more than the scene's weight;
        /// default `false`: that is refused as a mistake.
        pub strained: Option<bool>,
        /// Axial stiffness \[N].
        pub ea: Option<f64>,
        /// Compliance \[m/N]; 0 is rigid.
        pub stretch: Option<f64>,
        /// Damping time \[s].
        #[serde(default, skip_serializing_if = "is_zero")]
        pub damping: f64,
        /// `true` (default) lets it go slack where it is too long, `false` lets it push.
        pub tension_only: Option<bool>,
        /// Winch that pays it out and hauls it in, m, s and N: any of `{ speed, since, force_limit,
        /// brake, brake_limit, shortest, longest }`.
        pub winch: Option<Winch>,
        /// Tension at which it breaks, or size of its force where it has no tension \[N]: an event called `NAME breaks`; default
        /// never.
        pub breaks_at: Option<f64>,
        /// Group for block Gauss–Seidel; default by topology.
        pub group: Option<u32>,
    }
}

described! {
    /// The bend at the middle one of three points.
    #[derive(Default)]
    pub struct BendEntry {
        /// Its name.
        pub name: String,
        /// The three points, each `{ body = "…", point = [x, y, z] }` with an optional `motion` of a world point.
        pub through: Vec<PointEntry>,
        /// Measured quantity: `vector`, in both directions (the default), or `angle`, the paper's.
        #[serde(default)]
        pub definition: BendDefinition,
        /// Compliance \[rad/(N m)]; 0 is rigid.
        pub bend: f64,
        /// Damping time \[s].
        #[serde(default, skip_serializing_if = "is_zero")]
        pub damping: f64,
        /// Group for block Gauss–Seidel; default by topology.
        pub group: Option<u32>,
    }
}

impl MasslessCableEntry {
    /// The parts between bodies that have their places.
    pub(super) fn build(&self, bodies: &Bodies, names: &Names<'_>) -> Result<Vec<Part>, Fault> {
        let of = Entry::new("massless cable", &self.name);
        if self.through.len() < 2 {
            return Err(of.conflict("through", "needs at least 2 points"));
        }
        let frames = through(&of, &self.through, bodies, names)?;
        let is_part = self.through.iter().any(PointEntry::is_shared);
        let sound = (self.winch.iter()).try_for_each(|w| w.validate(is_part, || of.owner()));
        sound.map_err(Fault::named)?;
        let sheave = |point: &PointEntry| point.sheave.as_ref().map(SheaveEntry::build);
        let mut sheaves: Vec<_> = self.through.iter().map(sheave).collect();
        if sheaves.iter().all(Option::is_none) {
            sheaves.clear();
        }
        if let (Some(_), Some(Some(first))) = (&self.after, sheaves.first_mut()) {
            // It is the capstan's.
            first.friction = 0.0;
        }
        let laid = MasslessCable {
            sheaves,
            ..MasslessCable::new(frames, 1.0, RowLaw::RIGID)
        };
        let length = self.length_at_rest(&of, &laid, bodies)?;
        let stiffness = ("ea", self.ea);
        let compliance = of.compliance("stretch", self.stretch, stiffness, Some(length))?;
        let Some(compliance) = compliance else {
            return Err(of.conflict("stretch", "give it in m/N (0 is rigid), or ea in N"));
        };
        let cable = MasslessCable {
            length,
            law: of.law(("stretch", compliance), ("damping", self.damping))?,
            tension_only: self.tension_only.unwrap_or(true),
            winch: self.winch,
            ..laid
        };
        let parts = cable.in_parts(&self.name, bodies, 0.0);
        parts.map_err(|error| Fault::new("through", error))
    }

    /// Its length at rest \[m]: the one given, or one for the path that `laid` takes at first.
    fn length_at_rest(
        &self,
        of: &Entry<'_>,
        laid: &MasslessCable,
        bodies: &Bodies,
    ) -> Result<f64, Fault> {
        let given = [self.length, self.slack, self.tension];
        if given.iter().flatten().count() > 1 {
            let keys = ["length", "slack", "tension"];
            let last = (0..3).rfind(|k| given[*k].is_some());
            let reason = "is one of length, slack and tension: give one of them, or none for the length of the path";
            return Err(of.conflict(last.map_or("length", |k| keys[k]), reason));
        }
        if let Some(length) = self.length {
            return of.check("length", length, length > 0.0, "> 0 m");
        }
        let (path, wound) = (laid.path(bodies, 0.0), laid.wound());
        if !path.is_finite() {
            // It has none, which its sheaves tell.
            return Ok(f64::MAX);
        }
        if let Some(slack) = self.slack {
            return Ok(path + of.check("slack", slack, slack >= 0.0, "≥ 0 m")?);
        }
        let Some(tension) = self.tension else {
            return Ok(path);
        };
        of.check("tension", tension, tension >= 0.0, "≥ 0 N")?;
        // path − L = T ε of what is off the drums, ε = (L − wound)/EA or stretch (L − wound)/L.
        match (self.ea, self.stretch) {
            (Some(ea), None) if ea > 0.0 => {
                let strain = tension / ea;
                Ok((path + strain * wound) / (1.0 + strain))
            }
            (None, Some(stretch)) if stretch > 0.0 => {
                let (pulled, half) = (tension * stretch, 0.5 * (path - tension * stretch));
                let length = half + (half * half + pulled * wound).sqrt();
                let needs = "less than the path over stretch (N)";
                of.check("tension", tension, length > wound, needs)?;
                Ok(length)
            }
            (None, Some(0.0)) => {
                let reason = "belongs to a cable that stretches: give ea or a stretch that is not 0, or no tension";
                Err(of.conflict("tension", reason))
            }
            // Its stiffness is faulty, and reported as such.
            _ => Ok(path),
        }
    }

    /// Friction of the sheave that it shares with the cable before it.
    pub(super) fn shared_friction(&self) -> f64 {
        let first = self.through.first().and_then(|point| point.sheave.as_ref());
        first.map_or(0.0, |sheave| sheave.friction)
    }
}

impl BendEntry {
    /// The constraint between bodies that have their places.
    pub(super) fn build(&self, bodies: &Bodies, names: &Names<'_>) -> Result<Constraint, Fault> {
        let of = Entry::new("bend", &self.name);
        if let Some(i) = self.through.iter().position(|point| point.sheave.is_some()) {
            return Err(of.conflict(&format!("through.{i}.sheave"), ONLY_CABLES));
        }
        let frames = through(&of, &self.through, bodies, names)?;
        let Ok(frames) = <[Frame; 3]>::try_from(frames) else {
            return Err(of.conflict("through", "needs exactly 3 points"));
        };
        Ok(Constraint::LinkBend(LinkBend {
            frames,
            law: of.law(("bend", self.bend), ("damping", self.damping))?,
            definition: self.definition,
        }))
    }
}

/// Error for a sheave anywhere else.
pub(super) const ONLY_CABLES: &str = "is for massless cables: remove it";

/// The frames of the points: not all on the world nor on one body, and no two neighbours in one place.
fn through(
    of: &Entry<'_>,
    points: &[PointEntry],
    bodies: &Bodies,
    names: &Names<'_>,
) -> Result<Vec<Frame>, Fault> {
    let numbered = points.iter().enumerate();
    let frames: Result<Vec<_>, _> = numbered
        .map(|(i, p)| p.frame_at(of, &format!("through.{i}"), names))
        .collect();
    let frames = frames?;
    let first = frames.first().and_then(Frame::body_index);
    if !points.iter().any(PointEntry::is_shared) && frames.iter().all(|f| f.body_index() == first) {
        let reason = if first.is_none() {
            "ties the world to the world: put at least one point on a body"
        } else {
            "ties a body to itself: put at least one point on another body or on the world"
        };
        return Err(of.conflict("through", reason));
    }
    let places = frames.iter().map(|f| f.resolve(bodies, 0.0).point());
    let places: Vec<Vector3<f64>> = places.collect();
    if let Some(i) = places.windows(2).position(|pair| pair[0] == pair[1]) {
        let key = format!("through.{}.point", i + 1);
        let reason = "is in one place with the point before it: move or remove one of them";
        return Err(of
            .conflict(&key, reason)
            .or_at(&format!("through.{}", i + 1)));
    }
    Ok(frames)
}

impl PointEntry {
    /// True if two parts of a cable meet there.
    fn is_shared(&self) -> bool {
        let sheave = self.sheave.as_ref();
        sheave.is_some_and(|sheave| sheave.shared == Some(true))
    }

    /// The frame of the point whose keys stand at `path`.
    pub(super) fn frame_at(
        &self,
        of: &Entry<'_>,
        path: &str,
        names: &Names<'_>,
    ) -> Result<Frame, Fault> {
        let key = |key: &str| format!("{path}.{key}");
        let side = names.holder(of, path, (&self.body, &self.point), self.motion.as_ref())?;
        let axis = self.sheave.as_ref().and_then(|sheave| sheave.axis);
        let axes = match (axis, self.axes) {
            (None, None) if self.sheave.is_some() => {
                let reason = "is missing: give the direction of the sheave's axis, about which the cable travels in the \
                              positive sense";
                return Err(of
                    .conflict(&key("sheave.axis"), reason)
                    .or_at(&key("sheave")));
            }
            (None, axes) => axes.map_or_else(hanging_axes, Matrix3::from),
            (Some(_), Some(_)) => {
                let reason = "is the u of `axes`: remove one of them";
                return Err(of.conflict(&key("sheave.axis"), reason));
            }
            (Some(axis), None) => {
                of.finite(&key("sheave.axis"), &axis)?;
                axes_along(&axis.into())
                    .ok_or_else(|| of.conflict(&key("sheave.axis"), "has no direction"))?
            }
        };
        Ok(Frame {
            side,
            point: self.point.into(),
            axes,
        })
    }
}
