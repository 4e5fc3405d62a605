//! Joints of explicit scenes.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::body::Bodies;
use crate::constraint::{
    Constraint, Cosserat, Distance, JointLaw, Lock, Paper, RowLaw, Spherical, TwistDefinition,
};
use crate::error::{SceneError, check};
use crate::frame::{Frame, Side, axes_along, hanging_axes};
use crate::motion::Motion;

/// The name that stands for the world in a joint.
pub(super) const WORLD: &str = "world";

/// Kind of a joint in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Stretch rows only.
    Spherical,
    /// Stretch, two bend rows, twist.
    Cosserat,
    /// The paper's joint.
    Paper,
    /// Gap and rotation vector; rigid unless compliances are given.
    Lock,
    /// Link of a particle chain: the distance of its points.
    Distance,
}

/// A joint between a and b, `world` or names of bodies.
///
/// Its rows: `stretch`, `bend`, `twist` as compliances, or `ea`, `ei`, `gj` with `length`; rows without either are not
/// there. A lock has `stretch` and `rotation`, rigid by default. A distance has `length`, `stretch` or `ea`, and may have
/// `transverse`; its points are `point_a` and `point_b`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointEntry {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: Kind,
    /// Side a: `world` or a body's name.
    pub a: String,
    /// Side b: `world` or a body's name.
    pub b: String,
    /// Attachment point of both sides in the pose given, world \[m].
    pub point: Option<[f64; 3]>,
    /// Attachment point on a, body frame \[m] (world frame for the world).
    pub point_a: Option<[f64; 3]>,
    /// Attachment point on b, body frame \[m] (world frame for the world).
    pub point_b: Option<[f64; 3]>,
    /// Direction of the cable in the pose given, world; default −z. The joint is straight and untwisted there.
    pub axis: Option<[f64; 3]>,
    /// Columns u, v, w of side a in its body frame; instead of `axis`.
    pub axes_a: Option<[[f64; 3]; 3]>,
    /// Columns u, v, w of side b in its body frame; instead of `axis`.
    pub axes_b: Option<[[f64; 3]; 3]>,
    /// Length of cable that the joint stands for \[m], for `ea`, `ei`, `gj`; length at rest of a distance.
    pub length: Option<f64>,
    /// Axial stiffness \[N].
    pub ea: Option<f64>,
    /// Bending stiffness \[N m²].
    pub ei: Option<f64>,
    /// Torsional stiffness \[N m²].
    pub gj: Option<f64>,
    /// Compliance of the stretch rows, or of a distance \[m/N]; 0 is rigid.
    pub stretch: Option<f64>,
    /// Compliance of the bend rows \[rad/(N m)]; 0 is rigid.
    pub bend: Option<f64>,
    /// Compliance of the twist row \[rad/(N m)]; 0 is rigid.
    pub twist: Option<f64>,
    /// Compliance of a lock's rotation rows \[rad/(N m)]; 0 is rigid.
    pub rotation: Option<f64>,
    /// Damping time of all rows \[s].
    #[serde(default)]
    pub damping: f64,
    /// Group for block Gauss–Seidel.
    #[serde(default)]
    pub group: u32,
    /// Whether a distance has transverse rows, for time steppers that know them; default `false`.
    pub transverse: Option<bool>,
    /// `ordinary` or `alternative`, for the paper's joint.
    pub twist_definition: Option<TwistDefinition>,
    /// Motion of the world side.
    pub motion: Option<MotionEntry>,
}

/// Motion of a joint's world side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum MotionEntry {
    /// See [`Motion::Smooth`].
    Smooth {
        /// Whole displacement, world \[m].
        displacement: [f64; 3],
        /// Start \[s].
        #[serde(default)]
        start: f64,
        /// Duration \[s].
        duration: f64,
    },
    /// See [`Motion::Circle`].
    Circle {
        /// Radius \[m].
        radius: f64,
        /// Time of one turn \[s].
        period: f64,
        /// Start \[s].
        #[serde(default)]
        start: f64,
        /// Run-up \[s].
        ramp: f64,
    },
}

impl JointEntry {
    /// The constraint; `find` gives the index of a body's name.
    pub(super) fn build(
        &self,
        bodies: &Bodies,
        find: &impl Fn(&str, &str) -> Result<usize, SceneError>,
    ) -> Result<Constraint, SceneError> {
        let frames = self.frames(bodies, find)?;
        let law = JointLaw {
            stretch: self.law(("stretch", self.stretch), ("ea", self.ea))?,
            bend: self.law(("bend", self.bend), ("ei", self.ei))?,
            twist: self.law(("twist", self.twist), ("gj", self.gj))?,
        };
        if self.rotation.is_some() && self.kind != Kind::Lock {
            return Err(self.conflict("rotation", "is for locks: use bend and twist"));
        }
        let no_angles = matches!(self.kind, Kind::Spherical | Kind::Lock | Kind::Distance);
        if no_angles && (law.bend.or(law.twist)).is_some() {
            let reason = "bend, twist, ei, gj need kind = \"cosserat\" or \"paper\"";
            return Err(self.conflict("kind", reason));
        }
        if self.twist_definition.is_some() && self.kind != Kind::Paper {
            return Err(self.conflict("twist_definition", "needs kind = \"paper\""));
        }
        if self.transverse.is_some() && self.kind != Kind::Distance {
            return Err(self.conflict("transverse", "needs kind = \"distance\""));
        }
        let no_rows = || SceneError::NoRows {
            joint: self.name.clone(),
        };
        Ok(match self.kind {
            Kind::Spherical => Constraint::Spherical(Spherical {
                frames,
                stretch: law.stretch.ok_or_else(no_rows)?,
            }),
            Kind::Cosserat => Constraint::Cosserat(Cosserat::new(frames, law)),
            Kind::Paper => Constraint::Paper(Paper {
                twist_definition: self.twist_definition.unwrap_or_default(),
                ..Paper::new(frames, law)
            }),
            Kind::Lock => Constraint::Lock(Lock {
                frames,
                linear: law.stretch.unwrap_or(RowLaw::new(0.0, self.damping)),
                angular: RowLaw::new(self.rotation.unwrap_or(0.0), self.damping),
            }),
            Kind::Distance => Constraint::Distance(Distance {
                frames,
                length: self.distance()?,
                law: law.stretch.ok_or_else(no_rows)?,
                transverse: self.transverse.unwrap_or(false),
            }),
        })
    }

    /// Length at rest of a distance.
    fn distance(&self) -> Result<f64, SceneError> {
        if self.point.is_some() {
            let reason = "puts both ends of the distance in one place: give point_a and point_b";
            return Err(self.conflict("point", reason));
        }
        let Some(length) = self.length else {
            return Err(self.conflict("length", "is needed: metres between the points at rest"));
        };
        check(self.what("length"), length, length > 0.0, "> 0 m")
    }

    fn what(&self, key: &str) -> String {
        format!("joint `{}`: {key}", self.name)
    }

    fn conflict(&self, key: &str, reason: &'static str) -> SceneError {
        SceneError::Conflict {
            what: self.what(key),
            reason,
        }
    }

    fn law(
        &self,
        (key, compliance): (&str, Option<f64>),
        (stiff_key, stiffness): (&str, Option<f64>),
    ) -> Result<Option<RowLaw>, SceneError> {
        let compliance = match (compliance, stiffness) {
            (None, None) => return Ok(None),
            (Some(compliance), None) => compliance,
            (None, Some(stiffness)) => {
                let needs = "> 0 N, or N m²";
                check(self.what(stiff_key), stiffness, stiffness > 0.0, needs)?;
                let Some(length) = self.length else {
                    let reason = "needs length: the metres of cable that the joint stands for";
                    return Err(self.conflict(stiff_key, reason));
                };
                check(self.what("length"), length, length > 0.0, "> 0 m")? / stiffness
            }
            (Some(_), Some(_)) => {
                let reason = "is given as a compliance and as a stiffness: give one of them";
                return Err(self.conflict(key, reason));
            }
        };
        Ok(Some(RowLaw::new(compliance, self.damping)))
    }

    fn frames(
        &self,
        bodies: &Bodies,
        find: &impl Fn(&str, &str) -> Result<usize, SceneError>,
    ) -> Result<[Frame; 2], SceneError> {
        let straight = match self.axis {
            None => hanging_axes(),
            Some(axis) => axes_along(&axis.into()).ok_or_else(|| {
                self.conflict(
                    "axis",
                    "has no direction: give a finite vector that is not zero",
                )
            })?,
        };
        if self.axis.is_some() && (self.axes_a.is_some() || self.axes_b.is_some()) {
            return Err(self.conflict("axis", "excludes axes_a and axes_b: give one kind"));
        }
        let mut driven = false;
        let mut frame = |name: &str, point: Option<[f64; 3]>, axes: Option<[[f64; 3]; 3]>| {
            let (side, turn, centre) = if name == WORLD {
                let motion = self
                    .motion
                    .as_ref()
                    .map_or(Motion::Fixed, MotionEntry::motion);
                driven = true;
                (Side::World(motion), Matrix3::identity(), Vector3::zeros())
            } else {
                let i = find(name, &format!("joint `{}`", self.name))?;
                (Side::Body(i), bodies.rotation(i), bodies.position[i])
            };
            let point = match (point, self.point) {
                (Some(point), None) => point.into(),
                (None, Some(point)) => turn.transpose() * (Vector3::from(point) - centre),
                _ => {
                    let reason = "give either point or both point_a and point_b";
                    return Err(self.conflict("point", reason));
                }
            };
            let axes = axes.map_or_else(|| turn.transpose() * straight, Matrix3::from);
            Ok(Frame { side, point, axes })
        };
        let a = frame(&self.a, self.point_a, self.axes_a)?;
        let b = frame(&self.b, self.point_b, self.axes_b)?;
        if self.motion.is_some() && !driven {
            return Err(self.conflict("motion", "moves the world side: make a or b \"world\""));
        }
        Ok([a, b])
    }
}

impl MotionEntry {
    fn motion(&self) -> Motion {
        match *self {
            Self::Smooth {
                displacement,
                start,
                duration,
            } => Motion::Smooth {
                displacement: displacement.into(),
                start,
                duration,
            },
            Self::Circle {
                radius,
                period,
                start,
                ramp,
            } => Motion::Circle {
                radius,
                period,
                start,
                ramp,
            },
        }
    }
}
