//! φ and J of joints in lanes: their bodies and frames gathered, the formulas of `gap` and [`BendTwist`], and the rows
//! written.

use nalgebra::{Rotation3, UnitQuaternion};
use taut_lanes::vector::{
    Quaternion, combine, dot, product, relative, relative_to_digits, rotation, save, turned,
};
use taut_lanes::{Lanes, WideKernel};

use super::{Angles, Joint, LAG, Pack, Packs, lags};
use crate::body::Bodies;
use crate::constraint::gap::gap;
use crate::constraint::{BendTwist, bends_little};
use crate::frame::Frame;
use crate::lanes::{Numbers, PACK, load_part, part, save_part};

/// Frames and twist references of eight joints. From step to step only references and points of
/// moved world sides change.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub(super) struct Frames {
    /// Attachment points of the sides, body frame.
    points: [[Numbers; 3]; 2],
    /// Axes of side a, body frame: columns u, v, w.
    axes: [[Numbers; 3]; 3],
    /// The rotation of side b's axes as side a's see them, where both bodies stand alike.
    between: [Numbers; 4],
    /// References that unwrap the twists \[rad].
    pub(super) twist: Numbers,
    /// True if `between` is the identity in all lanes.
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
    fn seen<V: Lanes, const L: usize>(&self, lane: usize, turn: &Quaternion<V>) -> Quaternion<V> {
        let [x, y, z, w] = *turn;
        let imaginary = [x, y, z];
        let seen = [
            dot(&load_part::<V, L, 3>(&self.axes[0], lane), &imaginary),
            dot(&load_part::<V, L, 3>(&self.axes[1], lane), &imaginary),
            dot(&load_part::<V, L, 3>(&self.axes[2], lane), &imaginary),
            w,
        ];
        if self.parallel {
            return seen;
        }
        product(&seen, &load_part::<V, L, 4>(&self.between, lane))
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

impl WideKernel for Evaluation<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) {
        for first in (0..self.joints.count).step_by(L) {
            let (k, lane) = (first / PACK, first % PACK);
            let (frames, places) = (&self.joints.frames[k], &self.joints.places[k]);
            let pack = &mut self.joints.packs[k];
            let angles_here = places.shape.get::<L>(lane).angles;
            let count = (places.count - lane).min(L);
            let [side_a, side_b] = &places.bodies;
            let (x_a, q_a) = side_a.lanes::<L>(lane).poses::<V>(self.bodies, count);
            let (x_b, q_b) = side_b.lanes::<L>(lane).poses::<V>(self.bodies, count);
            let [point_a, point_b] = &frames.points;
            let (point_a, point_b) = (
                load_part::<V, L, 3>(point_a, lane),
                load_part::<V, L, 3>(point_b, lane),
            );
            let arm_b = turned(&q_b, &point_b);
            save_part::<V, L, 3>(&arm_b, &mut pack.arms[1], lane);
            if angles_here == Angles::None {
                let arm_a = turned(&q_a, &point_a);
                save_part::<V, L, 3>(&arm_a, &mut pack.arms[0], lane);
                let gap = gap([&x_a, &x_b], [&arm_a, &arm_b]);
                V::scatter(&gap, self.phi, *part::<_, L>(&places.row, lane));
                continue;
            }
            let body = rotation(&q_a);
            let arm_a = combine(&body, &point_a);
            save_part::<V, L, 3>(&arm_a, &mut pack.arms[0], lane);
            let gap = gap([&x_a, &x_b], [&arm_a, &arm_b]);
            let axes = [
                combine(&body, &load_part::<V, L, 3>(&frames.axes[0], lane)),
                combine(&body, &load_part::<V, L, 3>(&frames.axes[1], lane)),
                combine(&body, &load_part::<V, L, 3>(&frames.axes[2], lane)),
            ];
            let mut seen = frames.seen::<V, L>(lane, &relative(&q_a, &q_b));
            if !bends_little(&seen) {
                seen = frames.seen::<V, L>(lane, &relative_to_digits(&q_a, &q_b));
            }
            let angles = BendTwist::new(&seen, V::load(part::<_, L>(&frames.twist, lane)));
            let gradients = angles.gradients(&axes);
            if angles_here == Angles::All {
                let ([x, y, z], [beta_v, beta_w, twist]) = (gap, angles.angles);
                for (to, gradient) in pack.gradients.iter_mut().zip(&gradients) {
                    save_part::<V, L, 3>(gradient, to, lane);
                }
                let joints = self.joints.lanes_at::<L>(first);
                joints.write_rows(&[x, y, z, beta_v, beta_w, twist], self.phi);
            } else {
                let angles = [save(&gap), save(&angles.angles)];
                let [p, q, s] = &gradients;
                let gradients = [save(p), save(q), save(s)];
                let joints = &self.joints.joints[first..first + L];
                write_some::<L>(joints, angles, &gradients, self.phi, (pack, lane));
            }
        }
    }
}

/// Finds whether the reference of any joint has to follow its twist among the violations `phi`.
pub(super) struct Lagging<'a> {
    pub(super) joints: &'a Packs,
    pub(super) phi: &'a [f64],
}

impl WideKernel for Lagging<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) -> bool {
        let Self { joints, phi } = self;
        for first in (0..joints.count).step_by(L) {
            let some = joints.lanes_at::<L>(first);
            let references = part::<_, L>(&joints.frames[first / PACK].twist, first % PACK);
            if some.shape().full && some.shape().angles == Angles::All {
                let [.., twist] = some.rows_of::<V>(phi);
                if !(twist - V::load(references)).abs().all_below(V::splat(LAG)) {
                    return true;
                }
                continue;
            }
            for (joint, reference) in joints.joints[first..first + L].iter().zip(references) {
                if joint.winds && lags(joint.twist(phi), *reference) {
                    return true;
                }
            }
        }
        false
    }
}

/// Writes φ and gradients of joints that have some of the angles.
fn write_some<const L: usize>(
    joints: &[Joint],
    [gap, angles]: [[[f64; L]; 3]; 2],
    gradients: &[[[f64; L]; 3]; 3],
    phi: &mut [f64],
    (pack, first): (&mut Pack, usize),
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
                to[first + lane] = from[lane];
            }
        }
    }
}
