//! φ and J of joints in lanes: their bodies and frames gathered, the formulas of `gap` and [`BendTwist`], and the rows
//! written.

use nalgebra::{Rotation3, UnitQuaternion};
use taut_lanes::vector::{
    Quaternion, combine, dot, load, product, relative, relative_to_digits, rotation, save, turned,
};
use taut_lanes::{Isa, Kernel, Lanes};

use super::{Angles, Four, FourJoints, Joint, Pack, Packs};
use crate::body::Bodies;
use crate::body_vectors::PACK;
use crate::constraint::gap::gap;
use crate::constraint::{BendTwist, bends_little};
use crate::frame::Frame;

/// What does not change while a cable moves, of four joints.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Frames {
    /// Attachment points of the sides, body frame.
    points: [[Four; 3]; 2],
    /// Axes of side a, body frame: columns u, v, w.
    axes: [[Four; 3]; 3],
    /// The rotation of side b's axes as side a's see them, where both bodies stand alike.
    between: [Four; 4],
    /// What the twist is unwrapped against.
    pub(super) twist: Four,
    /// Whether `between` is none in all lanes.
    parallel: bool,
}

impl Default for Frames {
    fn default() -> Self {
        Self {
            points: Default::default(),
            axes: Default::default(),
            between: [[0.0; PACK], [0.0; PACK], [0.0; PACK], [1.0; PACK]],
            twist: [0.0; PACK],
            parallel: true,
        }
    }
}

impl Frames {
    /// Takes the frames of a joint.
    pub(super) fn take(&mut self, lane: usize, a: &Frame, b: &Frame) {
        self.place(lane, 0, a.point.as_ref());
        self.place(lane, 1, b.point.as_ref());
        let (a, b) = (&a.axes, &b.axes);
        for (to, from) in self.axes.iter_mut().zip(a.column_iter()) {
            for (to, from) in to.iter_mut().zip(&from) {
                to[lane] = *from;
            }
        }
        let between = if a == b {
            UnitQuaternion::identity()
        } else {
            let between = Rotation3::from_matrix_unchecked(a.transpose() * b);
            UnitQuaternion::from_rotation_matrix(&between)
        };
        for (to, from) in self.between.iter_mut().zip(between.coords.iter()) {
            to[lane] = *from;
        }
        self.parallel = self.between == Self::default().between;
    }

    /// The rotation of b's axes as a's see them, from the rotation `turn` of side b's bodies as side a's see them. In the
    /// world frame it would lose the digits of small components.
    #[inline(always)]
    fn seen<V: Lanes>(&self, turn: &Quaternion<V>) -> Quaternion<V> {
        let [x, y, z, w] = *turn;
        let imaginary = [x, y, z];
        let seen = [
            dot(&load(&self.axes[0]), &imaginary),
            dot(&load(&self.axes[1]), &imaginary),
            dot(&load(&self.axes[2]), &imaginary),
            w,
        ];
        if self.parallel {
            return seen;
        }
        product(&seen, &load(&self.between))
    }

    /// Takes an attachment point, body frame.
    pub(super) fn place(&mut self, lane: usize, side: usize, point: &[f64; 3]) {
        for (to, x) in self.points[side].iter_mut().zip(point) {
            to[lane] = *x;
        }
    }
}

/// Evaluates all packs.
pub(super) struct Evaluation<'a> {
    pub(super) joints: &'a mut Packs,
    pub(super) bodies: &'a Bodies,
    pub(super) phi: &'a mut [f64],
}

impl Kernel for Evaluation<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Packs {
            joints,
            packs,
            places,
            frames,
            ..
        } = self.joints;
        let (joints, _) = joints.as_chunks::<PACK>();
        let packs = packs.iter_mut().zip(places).zip(frames).zip(joints);
        for (((pack, places), frames), joints) in packs {
            let (x_a, q_a) = places.bodies[0].poses::<I::X4>(self.bodies);
            let (x_b, q_b) = places.bodies[1].poses::<I::X4>(self.bodies);
            let arm_b = turned(&q_b, &load(&frames.points[1]));
            if places.angles == Angles::None {
                let arm_a = turned(&q_a, &load(&frames.points[0]));
                pack.arms = [save(&arm_a), save(&arm_b)];
                let gap = gap([&x_a, &x_b], [&arm_a, &arm_b]);
                I::X4::scatter(&gap, self.phi, places.row);
                continue;
            }
            let body = rotation(&q_a);
            let arm_a = combine(&body, &load(&frames.points[0]));
            pack.arms = [save(&arm_a), save(&arm_b)];
            let gap = gap([&x_a, &x_b], [&arm_a, &arm_b]);
            let axes = [
                combine(&body, &load(&frames.axes[0])),
                combine(&body, &load(&frames.axes[1])),
                combine(&body, &load(&frames.axes[2])),
            ];
            let mut seen = frames.seen(&relative(&q_a, &q_b));
            if !bends_little(&seen) {
                seen = frames.seen(&relative_to_digits(&q_a, &q_b));
            }
            let angles = BendTwist::new(&seen, I::X4::load(&frames.twist));
            let gradients = angles.gradients(&axes);
            if places.angles == Angles::All {
                let ([x, y, z], [beta_v, beta_w, twist]) = (gap, angles.angles);
                let four = FourJoints { pack, places };
                four.write_rows(&[x, y, z, beta_v, beta_w, twist], self.phi);
                for (to, gradient) in pack.gradients.iter_mut().zip(&gradients) {
                    *to = save(gradient);
                }
            } else {
                let angles = [save(&gap), save(&angles.angles)];
                let [first, second, third] = &gradients;
                let gradients = [save(first), save(second), save(third)];
                write_some(joints, angles, &gradients, self.phi, pack);
            }
        }
    }
}

/// Writes φ and gradients of joints that have some of the angles.
fn write_some(
    joints: &[Joint; PACK],
    [gap, angles]: [[Four; 3]; 2],
    gradients: &[[Four; 3]; 3],
    phi: &mut [f64],
    pack: &mut Pack,
) {
    for (lane, joint) in joints.iter().enumerate() {
        let phi = &mut phi[joint.row..joint.row + joint.rows];
        for (to, from) in phi.iter_mut().zip(&gap) {
            *to = from[lane];
        }
        let (bend, twist) = joint.kind.angles();
        let has = [bend, bend, twist];
        for (row, k) in (0..3).filter(|k| has[*k]).enumerate() {
            phi[3 + row] = angles[k][lane];
            for (to, from) in pack.gradients[row].iter_mut().zip(&gradients[k]) {
                to[lane] = from[lane];
            }
        }
    }
}
