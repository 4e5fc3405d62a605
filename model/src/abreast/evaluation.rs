//! Gaps, angles and their gradients of joints four abreast, as they are evaluated in lanes.

use taut_lanes::functions::{asin_ratio, atan};
use taut_lanes::vector::{
    Quaternion, Vec3, add, combine, cross, dot, gather, load, rotation, save, scale, scale_add, sub,
};
use taut_lanes::{Isa, Kernel, Lanes};

use super::{ABREAST, Abreast, Four, Joint, Kind, Pack};
use crate::body::Bodies;

/// Largest |sin|/cos of a twist in lanes.
const TWIST: f64 = 0.4375;
/// Least cosine of a bend in lanes.
const BEND: f64 = 0.5;

/// What does not change while a cable moves, of four joints.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(32))]
pub(super) struct Frames {
    /// Attachment points of the sides, body frame.
    pub(super) points: [[Four; 3]; 2],
    /// Axes of the sides, body frame: columns u, v, w.
    pub(super) axes: [[[Four; 3]; 3]; 2],
    /// What the twist is unwrapped against.
    pub(super) twist: Four,
}

/// Evaluates all packs.
pub(super) struct Evaluation<'a> {
    pub(super) joints: &'a mut Abreast,
    pub(super) bodies: &'a Bodies,
    pub(super) phi: &'a mut [f64],
    pub(super) rest: &'a mut Vec<usize>,
}

impl Kernel for Evaluation<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Abreast {
            joints,
            packs,
            frames,
            ..
        } = self.joints;
        let (joints, _) = joints.as_chunks::<ABREAST>();
        for (p, ((pack, frames), joints)) in packs.iter_mut().zip(frames).zip(joints).enumerate() {
            let found = evaluate::<I::X4>(joints, frames, self.bodies, pack);
            for (lane, joint) in joints.iter().enumerate() {
                let phi = &mut self.phi[joint.row..joint.row + joint.rows];
                // Six is what most have, and a loop of constant length.
                if let Some(phi) = phi.first_chunk_mut::<6>() {
                    for (to, from) in phi.iter_mut().zip(&found.phi) {
                        *to = from[lane];
                    }
                } else {
                    for (to, from) in phi.iter_mut().zip(&found.phi) {
                        *to = from[lane];
                    }
                }
                if !found.good[lane] || joint.kind == Kind::Other {
                    self.rest.push(ABREAST * p + lane);
                }
            }
        }
    }
}

/// Four joints, as evaluated.
struct Found {
    phi: [Four; 6],
    /// Which lanes hold what they should.
    good: [bool; ABREAST],
}

/// Position and orientation of one side.
#[inline(always)]
fn pose<V: Lanes>(bodies: &Bodies, index: [usize; ABREAST]) -> (Vec3<V>, Quaternion<V>) {
    let world = (&[0.0; 3], &[0.0, 0.0, 0.0, 1.0]);
    let at = index.map(
        |i| match (bodies.position.get(i), bodies.orientation.get(i)) {
            (Some(x), Some(q)) => (x.as_ref(), q.coords.as_ref()),
            _ => world,
        },
    );
    (gather(at.map(|at| at.0)), gather(at.map(|at| at.1)))
}

/// The axes of one side in the world frame.
#[inline(always)]
fn axes<V: Lanes>(rotation: &[Vec3<V>; 3], axes: &[[Four; 3]; 3]) -> [Vec3<V>; 3] {
    let [u, v, w] = axes;
    [
        combine(rotation, &load(u)),
        combine(rotation, &load(v)),
        combine(rotation, &load(w)),
    ]
}

/// What both bends of a joint are made of, in the notation of [`crate::Cosserat`].
struct Bend<V> {
    ua: Vec3<V>,
    ub: Vec3<V>,
    d: Vec3<V>,
    c: V,
    g: V,
    h: V,
}

impl<V: Lanes> Bend<V> {
    /// The angle about an axis of side a, and its gradient on ω_b.
    #[inline(always)]
    fn about(&self, axis: &Vec3<V>) -> (V, Vec3<V>) {
        let along = dot(&self.d, axis);
        let inner = scale_add(&self.ua, -dot(&self.ub, axis), &scale(axis, self.c));
        let row = scale_add(&self.d, self.h * along, &scale(&inner, self.g));
        (self.g * along, row)
    }
}

/// Gaps, bends and twists of four joints: the formulas of [`crate::Cosserat`], in another arrangement where that saves
/// divisions: with t = sin²(θ/2) = sin²θ/(2 (1 + cos θ)), θ/sin θ = (arcsin √t/√t)/√(1 − t).
#[inline(always)]
fn evaluate<V: Lanes>(
    joints: &[Joint; ABREAST],
    frames: &Frames,
    bodies: &Bodies,
    pack: &mut Pack,
) -> Found {
    let (centre_a, a) = pose::<V>(bodies, joints.each_ref().map(|j| j.bodies[0]));
    let (centre_b, b) = pose::<V>(bodies, joints.each_ref().map(|j| j.bodies[1]));
    let (a, b) = (rotation(&a), rotation(&b));
    let arm_a = combine(&a, &load(&frames.points[0]));
    let arm_b = combine(&b, &load(&frames.points[1]));
    let gap = add(&sub(&centre_a, &centre_b), &sub(&arm_a, &arm_b));
    pack.arms = [save(&arm_a), save(&arm_b)];
    let mut found = Found {
        phi: [[0.0; ABREAST]; 6],
        good: [true; ABREAST],
    };
    found.phi[..3].copy_from_slice(&save::<V, ABREAST, 3>(&gap));
    let angular = |joint: &Joint| match joint.kind {
        Kind::Cable { bend, twist } => (bend, twist),
        Kind::Other => (false, false),
    };
    let parts = joints.each_ref().map(angular);
    if parts == [(false, false); ABREAST] {
        return found;
    }
    let ([ua, va, wa], [ub, vb, wb]) = (axes(&a, &frames.axes[0]), axes(&b, &frames.axes[1]));
    let (one, half) = (V::splat(1.0), V::splat(0.5));
    let d = cross(&ua, &ub);
    let (c, q) = (dot(&ua, &ub), dot(&d, &d));
    let inverse = one / (one + c);
    let t = q * inverse * half;
    let (p, r) = asin_ratio(t);
    let g = p / (r * (one - t).sqrt());
    // For a straight joint h is 0/0; it is multiplied with squares of d, which vanish faster than its error grows.
    let h = g.neg_mul_add(c, one) / (q + V::splat(1e-40));
    let straight = Bend { ua, ub, d, c, g, h };
    let (beta_v, row_v) = straight.about(&va);
    let (beta_w, row_w) = straight.about(&wa);
    let sine = dot(&wa, &vb) - dot(&va, &wb);
    let cosine = dot(&va, &vb) + dot(&wa, &wb);
    let twist = atan(sine / cosine);
    let row_twist = scale(&add(&ua, &ub), inverse);
    let angles: [Four; 6] = save(&[beta_v, beta_w, twist, c, sine, cosine]);
    let (row_v, row_w, row_twist) = (save(&row_v), save(&row_w), save(&row_twist));
    for (lane, (bend, twist)) in parts.into_iter().enumerate() {
        let mut row = 0;
        let mut put = |angle: f64, gradient: &[Four; 3]| {
            found.phi[3 + row][lane] = angle;
            for (to, from) in pack.gradients[row].iter_mut().zip(gradient) {
                to[lane] = from[lane];
            }
            row += 1;
        };
        let [beta_v, beta_w, angle, c, sine, cosine] = angles.each_ref().map(|x| x[lane]);
        if bend {
            put(beta_v, &row_v);
            put(beta_w, &row_w);
        }
        if twist {
            put(angle, &row_twist);
            found.good[lane] &= sine.abs() <= TWIST * cosine
                && (frames.twist[lane] - angle).abs() < std::f64::consts::PI;
        }
        found.good[lane] &= !(bend || twist) || c >= BEND;
    }
    found
}
