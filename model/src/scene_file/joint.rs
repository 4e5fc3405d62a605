//! Joints of explicit scenes: constraints with two sides.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::build::{Entry, Names};
use super::from_scene::{same_bits, side};
use super::keys::described;
use super::motor::{MotorEntry, unless};
use super::places::Fault;
use crate::body::Bodies;
use crate::constraint::{
    Constraint, Cosserat, Distance, Hinge, JointLaw, Lock, Paper, RowKind, RowLaw, Slider,
    Spherical, TwistDefinition,
};
use crate::error::SceneError;
use crate::frame::{Frame, Side, axes_along, hanging_axes};
use crate::motion::Motion;
use crate::scene::Scene;
use crate::scene::validate::ROWS;
use crate::unlimited::is_zero;

/// Kind of a joint in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Kind {
    /// Stretch rows only.
    #[default]
    Spherical,
    /// Stretch, two bend rows, twist.
    Cosserat,
    /// The paper's joint.
    Paper,
    /// Gap and rotation vector; rigid unless compliances are given.
    Lock,
    /// Link of a particle chain: the distance of its points.
    Distance,
    /// Turns about its axis; rigid otherwise unless compliances are given.
    Hinge,
    /// Slides along the axis of a; rigid otherwise unless compliances are given.
    Slider,
}

described! {
    /// A joint between a and b, `world` or names of bodies.
    ///
    /// Its rows: `stretch`, `bend`, `twist` as compliances, or `ea`, `ei`, `gj` with `length`; rows without either are not
    /// there. A lock has `stretch` and `rotation`, a hinge `stretch` and `bend`, a slider `rotation` and `across`, all rigid
    /// by default; hinge and slider may have a `motor`. A distance has `length`, `stretch` or `ea`, and may have
    /// `transverse`; its points are `point_a` and `point_b`.
    #[derive(Default)]
    pub struct JointEntry {
        /// Its name.
        pub name: String,
        /// Its kind: `spherical`, `cosserat`, `paper`, `lock`, `distance`, `hinge` or `slider`.
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
        /// Direction of the cable, hinge or slider in the pose given, world; default −z. The joint is straight and
        /// untwisted there.
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
        /// Compliance of the bend rows, or of a hinge's tilt \[rad/(N m)]; 0 is rigid.
        pub bend: Option<f64>,
        /// Compliance of the twist row \[rad/(N m)]; 0 is rigid.
        pub twist: Option<f64>,
        /// Compliance of the rotation rows of a lock or slider \[rad/(N m)]; 0 is rigid.
        pub rotation: Option<f64>,
        /// Compliance of a slider's rows across its axis \[m/N]; 0 is rigid.
        pub across: Option<f64>,
        /// Damping time of all rows \[s] without one of their own.
        #[serde(default, skip_serializing_if = "is_zero")]
        pub damping: f64,
        /// Damping time of the stretch rows, or of a distance \[s].
        pub stretch_damping: Option<f64>,
        /// Damping time of the bend rows \[s].
        pub bend_damping: Option<f64>,
        /// Damping time of the twist row \[s].
        pub twist_damping: Option<f64>,
        /// Damping time of the rotation rows of a lock or slider \[s].
        pub rotation_damping: Option<f64>,
        /// Damping time of a slider's rows across its axis \[s].
        pub across_damping: Option<f64>,
        /// Drives a hinge or slider: `{ speed, force_limit }`, or `{ position, force_limit, compliance, damping }`; in m or
        /// rad, N or N m, s. No limit where it is left out.
        pub motor: Option<MotorEntry>,
        /// Group for block Gauss–Seidel; default by topology.
        pub group: Option<u32>,
        /// Transverse rows of a distance, for time steppers that know them; default `false`.
        pub transverse: Option<bool>,
        /// `ordinary` or `alternative`, for the paper's joint.
        pub twist_definition: Option<TwistDefinition>,
        /// Safeguard of the paper's joint where its angles have no direction, without unit; default 1e-14.
        pub safeguard: Option<f64>,
        /// Twist that the pose given is counted from, whole turns with it \[rad]; default 0.
        pub twist_reference: Option<f64>,
        /// Angle that a hinge's pose is counted from, whole turns with it \[rad]; default 0.
        pub angle_reference: Option<f64>,
        /// Motion of the world side.
        pub motion: Option<Motion>,
        /// Name of the cable whose joint it is; default none.
        pub cable: Option<String>,
        /// Tension at which it breaks, or size of its force where it has no tension \[N]: an event called `NAME breaks`; default
        /// never.
        pub breaks_at: Option<f64>,
    }
}

impl JointEntry {
    /// The constraint between bodies that have their places.
    pub(super) fn build(&self, bodies: &Bodies, names: &Names<'_>) -> Result<Constraint, Fault> {
        let of = Entry::new("joint", &self.name);
        let frames = self.frames(&of, bodies, names)?;
        self.check_keys(&of)?;
        let law = JointLaw {
            stretch: self.law(&of, "stretch", self.stretch, ("ea", self.ea))?,
            bend: self.law(&of, "bend", self.bend, ("ei", self.ei))?,
            twist: self.law(&of, "twist", self.twist, ("gj", self.gj))?,
        };
        let no_rows = || {
            let (what, reason) = (format!("{} has no rows", of.owner()), ROWS);
            Fault::new("kind", SceneError::Conflict { what, reason })
        };
        let rigid = matches!(self.kind, Kind::Lock | Kind::Hinge | Kind::Slider);
        if [law.stretch, law.bend, law.twist] == [None; 3] && !rigid {
            return Err(no_rows());
        }
        let or_rigid = |key, law: Option<RowLaw>| law.map_or_else(|| self.row(&of, key, 0.0), Ok);
        let motor = self.motor.as_ref().map(|motor| motor.build(&of));
        let motor = motor.transpose();
        let twist_reference = self.twist_reference.unwrap_or(0.0);
        Ok(match self.kind {
            Kind::Spherical => Constraint::Spherical(Spherical {
                frames,
                stretch: law.stretch.ok_or_else(no_rows)?,
            }),
            Kind::Cosserat => Constraint::Cosserat(Cosserat {
                twist_reference,
                ..Cosserat::new(frames, law)
            }),
            Kind::Paper => Constraint::Paper(Paper {
                twist_definition: self.twist_definition.unwrap_or_default(),
                safeguard: self.safeguard.unwrap_or(Paper::SAFEGUARD),
                twist_reference,
                ..Paper::new(frames, law)
            }),
            Kind::Lock => Constraint::Lock(Lock {
                frames,
                linear: or_rigid("stretch", law.stretch)?,
                angular: self.row(&of, "rotation", self.rotation.unwrap_or(0.0))?,
            }),
            Kind::Hinge => Constraint::Hinge(Hinge {
                frames,
                stretch: or_rigid("stretch", law.stretch)?,
                tilt: or_rigid("bend", law.bend)?,
                motor: motor?,
                angle_reference: self.angle_reference.unwrap_or(0.0),
            }),
            Kind::Slider => Constraint::Slider(Slider {
                frames,
                rotation: self.row(&of, "rotation", self.rotation.unwrap_or(0.0))?,
                across: self.row(&of, "across", self.across.unwrap_or(0.0))?,
                motor: motor?,
            }),
            Kind::Distance => Constraint::Distance(Distance {
                frames,
                length: self.distance(&of, &frames, bodies)?,
                law: law.stretch.ok_or_else(no_rows)?,
                transverse: self.transverse.unwrap_or(false),
            }),
        })
    }

    /// The joint as it is written; `None` for what is no joint in a text.
    pub(super) fn of(scene: &Scene, name: &str, joint: &Constraint, group: u32) -> Option<Self> {
        let mut own = Self::default();
        own.kind = match joint {
            Constraint::Spherical(_) => Kind::Spherical,
            Constraint::Cosserat(_) => Kind::Cosserat,
            Constraint::Paper(paper) => {
                let ordinary = paper.twist_definition == TwistDefinition::default();
                own.twist_definition = (!ordinary).then_some(paper.twist_definition);
                own.safeguard = unless(paper.safeguard, Paper::SAFEGUARD);
                Kind::Paper
            }
            Constraint::Lock(_) => Kind::Lock,
            Constraint::Distance(link) => {
                own.length = Some(link.length);
                own.transverse = link.transverse.then_some(true);
                Kind::Distance
            }
            Constraint::Hinge(hinge) => {
                own.angle_reference = unless(hinge.angle_reference, 0.0);
                Kind::Hinge
            }
            Constraint::Slider(_) => Kind::Slider,
            Constraint::MasslessCable(_) | Constraint::LinkBend(_) | Constraint::Fairlead(_) => {
                return None;
            }
        };
        let twist = joint.cable_joint().map_or(0.0, |(_, twist)| twist);
        own.twist_reference = unless(twist, 0.0);
        own.motor = joint.motor().map(MotorEntry::of);
        let mut first = None;
        for (kind, _, law) in joint.parts() {
            if let Some((compliance, damping)) = own.row_mut(kind) {
                *compliance = Some(law.compliance);
                let of_all = *first.get_or_insert(law.damping);
                *damping = unless(law.damping, of_all);
            }
        }
        own.damping = first.unwrap_or(0.0);
        let [a, b] = [&joint.frames()[0], &joint.frames()[1]];
        let axes = |frame: &Frame| {
            let turn = match frame.side {
                Side::World(_) => Matrix3::identity(),
                Side::Body(i) => scene.bodies.rotation(i),
            };
            let default = same_bits(&(turn.transpose() * hanging_axes()), &frame.axes);
            (!default).then(|| frame.axes.into())
        };
        Some(Self {
            name: name.to_owned(),
            a: side(scene, a).0,
            b: side(scene, b).0,
            point_a: Some(a.point.into()),
            point_b: Some(b.point.into()),
            axes_a: axes(a),
            axes_b: axes(b),
            group: Some(group),
            motion: side(scene, a).1.or(side(scene, b).1),
            ..own
        })
    }

    /// Refuses keys that the kind does not have, and numbers that it cannot have.
    fn check_keys(&self, of: &Entry<'_>) -> Result<(), Fault> {
        use Kind::{Cosserat, Distance, Hinge, Lock, Paper, Slider};
        let only = |kinds: &[Kind], reason, keys: &[(&str, bool)]| {
            let has = kinds.contains(&self.kind);
            let wrong = keys.iter().find(|(_, given)| *given && !has);
            wrong.map_or(Ok(()), |(key, _)| Err(of.conflict(key, reason)))
        };
        let reason = "is for locks and sliders: use bend and twist, and their damping";
        let damping = ("rotation_damping", self.rotation_damping.is_some());
        let rotation = ("rotation", self.rotation.is_some());
        only(&[Lock, Slider], reason, &[rotation, damping])?;
        let damping = ("across_damping", self.across_damping.is_some());
        let across = ("across", self.across.is_some());
        only(&[Slider], "needs kind = \"slider\"", &[across, damping])?;
        let reason = "needs kind = \"cosserat\", \"paper\" or \"hinge\"";
        let damping = ("bend_damping", self.bend_damping.is_some());
        only(&[Cosserat, Paper, Hinge], reason, &[damping])?;
        let reason = "needs kind = \"cosserat\" or \"paper\"";
        let damping = ("twist_damping", self.twist_damping.is_some());
        let twist = ("twist_reference", self.twist_reference.is_some());
        only(&[Cosserat, Paper], reason, &[damping, twist])?;
        let angle = ("angle_reference", self.angle_reference.is_some());
        only(&[Hinge], "needs kind = \"hinge\"", &[angle])?;
        let definition = ("twist_definition", self.twist_definition.is_some());
        let safeguard = ("safeguard", self.safeguard.is_some());
        only(&[Paper], "needs kind = \"paper\"", &[safeguard, definition])?;
        let transverse = ("transverse", self.transverse.is_some());
        only(&[Distance], "needs kind = \"distance\"", &[transverse])?;
        let reason = "needs kind = \"hinge\" or \"slider\"";
        only(&[Hinge, Slider], reason, &[("motor", self.motor.is_some())])?;
        self.check_rows(of)?;
        of.finite("angle_reference", self.angle_reference.as_slice())?;
        of.finite("twist_reference", self.twist_reference.as_slice())
    }

    /// Refuses rows that the kind does not have.
    fn check_rows(&self, of: &Entry<'_>) -> Result<(), Fault> {
        let bend = self.bend.or(self.ei).is_some();
        let twist = self.twist.or(self.gj).is_some();
        match self.kind {
            Kind::Spherical | Kind::Lock | Kind::Distance if bend || twist => {
                let reason = "bend, twist, ei, gj need kind = \"cosserat\" or \"paper\"";
                Err(of.conflict("kind", reason))
            }
            Kind::Hinge if twist => {
                let key = if self.twist.is_some() { "twist" } else { "gj" };
                let reason = "holds what a hinge leaves free: remove it, or give a motor";
                Err(of.conflict(key, reason))
            }
            Kind::Slider => {
                let given = [
                    ("stretch", self.stretch),
                    ("stretch_damping", self.stretch_damping),
                    ("bend", self.bend),
                    ("twist", self.twist),
                    ("ea", self.ea),
                    ("ei", self.ei),
                    ("gj", self.gj),
                ];
                let wrong = given.into_iter().find(|(_, value)| value.is_some());
                wrong.map_or(Ok(()), |(key, _)| {
                    Err(of.conflict(key, "is no row of a slider: use rotation and across"))
                })
            }
            _ => Ok(()),
        }
    }

    /// Length at rest of what holds its points apart: they must be in two places.
    fn distance(&self, of: &Entry<'_>, frames: &[Frame; 2], bodies: &Bodies) -> Result<f64, Fault> {
        if self.point.is_some() {
            let reason = "puts both ends in one place: give point_a and point_b";
            return Err(of.conflict("point", reason));
        }
        let Some(length) = self.length else {
            return Err(of.conflict("length", "is needed: metres between the points at rest"));
        };
        of.check("length", length, length > 0.0, "> 0 m")?;
        let [a, b] = frames.map(|f| f.resolve(bodies, 0.0).point());
        if a == b {
            let reason = "is in one place with point_a, without a direction: move one";
            return Err(of.conflict("point_b", reason));
        }
        Ok(length)
    }

    /// A row's law of a compliance or of a stiffness, `None` where neither is given.
    fn law(
        &self,
        of: &Entry<'_>,
        key: &'static str,
        compliance: Option<f64>,
        (stiff_key, stiffness): (&str, Option<f64>),
    ) -> Result<Option<RowLaw>, Fault> {
        let compliance = of.compliance(key, compliance, (stiff_key, stiffness), self.length)?;
        compliance.map(|c| self.row(of, key, c)).transpose()
    }

    /// Compliance and damping time of the rows of a kind; `None` of rows without any.
    pub(super) fn row_mut(
        &mut self,
        kind: RowKind,
    ) -> Option<(&mut Option<f64>, &mut Option<f64>)> {
        match kind {
            RowKind::Stretch | RowKind::Length => {
                Some((&mut self.stretch, &mut self.stretch_damping))
            }
            RowKind::Bend => Some((&mut self.bend, &mut self.bend_damping)),
            RowKind::Twist => Some((&mut self.twist, &mut self.twist_damping)),
            RowKind::Rotation => Some((&mut self.rotation, &mut self.rotation_damping)),
            RowKind::Across => Some((&mut self.across, &mut self.across_damping)),
            RowKind::Position | RowKind::Angle | RowKind::Speed | RowKind::Transverse => None,
        }
    }

    /// A row's law with the damping time of the row's own, or else that of all.
    fn row(&self, of: &Entry<'_>, key: &str, compliance: f64) -> Result<RowLaw, Fault> {
        let (damping, own) = match key {
            "stretch" => ("stretch_damping", self.stretch_damping),
            "bend" => ("bend_damping", self.bend_damping),
            "twist" => ("twist_damping", self.twist_damping),
            "across" => ("across_damping", self.across_damping),
            _ => ("rotation_damping", self.rotation_damping),
        };
        let of_all = ("damping", self.damping);
        of.law((key, compliance), own.map_or(of_all, |own| (damping, own)))
    }

    fn frames(
        &self,
        of: &Entry<'_>,
        bodies: &Bodies,
        names: &Names<'_>,
    ) -> Result<[Frame; 2], Fault> {
        let straight = match self.axis {
            None => hanging_axes(),
            Some(axis) => axes_along(&axis.into()).ok_or_else(|| {
                let reason = "has no direction: give a finite vector that is not zero";
                of.conflict("axis", reason)
            })?,
        };
        if self.axis.is_some() && (self.axes_a.is_some() || self.axes_b.is_some()) {
            return Err(of.conflict("axis", "excludes axes_a and axes_b: give one kind"));
        }
        let mut driven = false;
        let mut frame = |key: &str, name: &str, point: Option<[f64; 3]>, axes: Option<_>| {
            let side = names.side(of, key, name, self.motion.as_ref(), "motion")?;
            let (turn, centre) = match side {
                Side::World(_) => {
                    driven = true;
                    (Matrix3::identity(), Vector3::zeros())
                }
                Side::Body(i) => (bodies.rotation(i), bodies.position[i]),
            };
            let point_key = format!("point_{key}");
            let point = match (point, self.point) {
                (Some(point), None) => {
                    of.finite(&point_key, &point)?;
                    point.into()
                }
                (None, Some(point)) => {
                    of.finite("point", &point)?;
                    turn.transpose() * (Vector3::from(point) - centre)
                }
                _ => {
                    let reason = "give either point or both point_a and point_b";
                    return Err(of
                        .conflict("point", reason)
                        .or_at("point_a")
                        .or_at("point_b"));
                }
            };
            let axes = axes.map_or_else(|| turn.transpose() * straight, Matrix3::from);
            Ok(Frame { side, point, axes })
        };
        let a = frame("a", &self.a, self.point_a, self.axes_a)?;
        let b = frame("b", &self.b, self.point_b, self.axes_b)?;
        if self.motion.is_some() && !driven {
            return Err(of.conflict("motion", "moves the world side: make a or b \"world\""));
        }
        Ok([a, b])
    }
}
