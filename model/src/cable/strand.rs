//! Parts common to all cables of segments: the frames of a segment's ends, the law of a joint, and
//! the list of a cable's bodies and joints. The named scenes lay their segments by formulas of
//! their own and join them here.

use nalgebra::{Matrix3, Vector3};

use super::JointKind;
use crate::body::Body;
use crate::constraint::{Constraint, JointLaw, RowLaw, TwistDefinition};
use crate::frame::{Frame, hanging_axes};
use crate::material::Stiffness;
use crate::scene::{CableParts, Scene};

/// How the segments of a cable are joined.
pub(crate) struct Strand {
    pub(crate) kind: JointKind,
    pub(crate) twist_definition: TwistDefinition,
    pub(crate) stiffness: Stiffness,
    /// Damping times of the stretch, bend and twist rows \[s].
    pub(crate) damping: [f64; 3],
    /// Bend rows, and a twist row, in the joints.
    pub(crate) bend: bool,
    pub(crate) twist: bool,
    /// From a segment's centre towards the start of the cable, body frame: a unit vector.
    pub(crate) back: Vector3<f64>,
    /// Axes of the frames at a segment's ends, body frame.
    pub(crate) axes: Matrix3<f64>,
}

impl Strand {
    /// Segments along the z axes of their bodies, the start of the cable at +z; all rows damped by `damping` (s).
    pub(crate) fn new(kind: JointKind, stiffness: Stiffness, damping: f64) -> Self {
        Self {
            kind,
            twist_definition: TwistDefinition::Ordinary,
            stiffness,
            damping: [damping; 3],
            bend: true,
            twist: true,
            back: Vector3::z(),
            axes: hanging_axes(),
        }
    }

    /// Frames at the ends of body `segment`, `length` (m) long: towards the start of the cable, then towards its end.
    pub(crate) fn ends(&self, segment: usize, length: f64) -> [Frame; 2] {
        let start = self.back * (0.5 * length);
        [start, -start].map(|point| Frame::body(segment, point).with_axes(self.axes))
    }

    /// Laws of a joint that stands for `length` (m) of cable.
    pub(crate) fn law(&self, length: f64) -> JointLaw {
        let law = self.stiffness.joint_law(length, 0.0);
        let [stretch, bend, twist] = self.damping;
        let damped = |row: Option<RowLaw>, damping| row.map(|row| RowLaw { damping, ..row });
        JointLaw {
            stretch: damped(law.stretch, stretch),
            bend: damped(law.bend, bend).filter(|_| self.bend),
            twist: damped(law.twist, twist).filter(|_| self.twist),
        }
    }

    /// Adds a cable without segments and returns its number.
    pub(crate) fn begin(scene: &mut Scene, name: impl Into<String>) -> usize {
        scene.cables.push(CableParts {
            name: name.into(),
            ..CableParts::default()
        });
        scene.cables.len() - 1
    }

    /// Adds segments `prefix-1` … to cable number `cable`.
    pub(crate) fn add_segments(
        scene: &mut Scene,
        cable: usize,
        prefix: &str,
        bodies: impl IntoIterator<Item = Body>,
    ) {
        for (i, body) in bodies.into_iter().enumerate() {
            let segment = scene.add_body(format!("{prefix}-{}", i + 1), body);
            scene.cables[cable].bodies.push(segment);
        }
    }

    /// Adds a joint of cable number `cable` that stands for `length` (m) of it.
    pub(crate) fn join(
        &self,
        scene: &mut Scene,
        cable: usize,
        name: impl Into<String>,
        (kind, frames): (JointKind, [Frame; 2]),
        length: f64,
    ) {
        let mut joint = kind.constraint(frames, self.law(length));
        if let Constraint::Paper(paper) = &mut joint {
            paper.twist_definition = self.twist_definition;
        }
        let joint = scene.add_constraint(name, joint, 0);
        scene.cables[cable].joints.push(joint);
    }

    /// Adds the joints `prefix-1` … between neighbours of the bodies `segments`, all `length` (m) long.
    pub(crate) fn join_segments(
        &self,
        scene: &mut Scene,
        cable: usize,
        prefix: &str,
        segments: std::ops::Range<usize>,
        length: f64,
    ) {
        let first = segments.start;
        for i in 1..segments.len() {
            let [_, a] = self.ends(first + i - 1, length);
            let [b, _] = self.ends(first + i, length);
            let joint = (self.kind, [a, b]);
            self.join(scene, cable, format!("{prefix}-{i}"), joint, length);
        }
    }
}
