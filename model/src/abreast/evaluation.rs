//! Gaps, angles and their gradients of joints four abreast, as they are evaluated in lanes.
//!
//! The formulas are those of [`crate::Cosserat`] in terms of the quaternion (x, y, z, w) of side b's axes as side a's
//! see them, where square roots cancel: with t = y² + z² = sin²(θ/2), d = u_a × u_b and f of [`over_sine`],
//!
//! ```text
//! c = 1 − 2t      d·v_a = 2 (w y − x z)      d·w_a = 2 (x y + w z)      Ω = 2 arctan(x/w)
//! g = 1 + t f(t)      h = (2 − c f(t))/(4 (1 − t))      1 + c = 2 (1 − t) = 2 (w² + x²)
//! ```

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use taut_lanes::functions::{atan, over_sine};
use taut_lanes::vector::{
    Quaternion, Vec3, add, combine, dot, gather, load, product, relative, rotation, save,
    scale_add, sub, turned,
};
use taut_lanes::{Isa, Kernel, Lanes};

use super::{ABREAST, Abreast, Angles, Four, Joint, Kind, Pack, Places};
use crate::body::Bodies;
use crate::frame::Frame;

/// What must stay below [`LIMITS`] for a joint to be evaluated in lanes: |x/w|, the tangent of half the twist; the
/// distance of the twist from what it is unwrapped against; t.
type Measures<V> = [V; 3];

/// See [`Measures`].
const LIMITS: [f64; 3] = [0.2087, std::f64::consts::PI, 0.25];

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
            between: [
                [0.0; ABREAST],
                [0.0; ABREAST],
                [0.0; ABREAST],
                [1.0; ABREAST],
            ],
            twist: [0.0; ABREAST],
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

    /// Takes an attachment point, body frame.
    pub(super) fn place(&mut self, lane: usize, side: usize, point: &[f64; 3]) {
        for (to, x) in self.points[side].iter_mut().zip(point) {
            to[lane] = *x;
        }
    }
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
            places,
            frames,
            ..
        } = self.joints;
        let (joints, _) = joints.as_chunks::<ABREAST>();
        let stand = Standing::new(self.bodies);
        let (for_a, for_b) = (&mut Copies::default(), &mut Copies::default());
        let packs = packs.iter_mut().zip(places).zip(frames).zip(joints);
        for (p, (((pack, places), frames), joints)) in packs.enumerate() {
            let a = stand.of(places, 0, for_a);
            let b = stand.of(places, 1, for_b);
            if places.angles == Angles::None {
                let gap = gap::<I::X4>(a, b, frames, pack);
                I::X4::scatter(&gap, self.phi, places.row);
                rest(self.rest, ABREAST * p, joints, [true; ABREAST]);
                continue;
            }
            let (q_a, q_b) = (orientation::<I::X4>(a.1), orientation(b.1));
            let arm_b = turned(&q_b, &load(&frames.points[1]));
            let turn = relative(&q_a, &q_b);
            let body = rotation(&q_a);
            let arm_a = combine(&body, &load(&frames.points[0]));
            pack.arms = [save(&arm_a), save(&arm_b)];
            let gap = add(&sub(&position(a.0), &position(b.0)), &sub(&arm_a, &arm_b));
            let axes = [
                combine(&body, &load(&frames.axes[0])),
                combine(&body, &load(&frames.axes[1])),
                combine(&body, &load(&frames.axes[2])),
            ];
            let angular = Angular::new(frames, &axes, &turn);
            let good = if places.angles == Angles::All {
                angular.write(&gap, &axes, self.phi, places, pack)
            } else {
                Err(angular.write_some(&gap, &axes, self.phi, joints, pack))
            };
            if let Err(good) = good {
                rest(self.rest, ABREAST * p, joints, good);
            }
        }
    }
}

/// Adds the joints of a pack that lanes cannot do, of which `first` is the first.
fn rest(rest: &mut Vec<usize>, first: usize, joints: &[Joint; ABREAST], good: [bool; ABREAST]) {
    for (lane, (joint, good)) in joints.iter().zip(good).enumerate() {
        if !good || joint.kind == Kind::Other {
            rest.push(first + lane);
        }
    }
}

/// Positions and orientations of the four bodies of one side.
type Stand<'a> = (
    &'a [Vector3<f64>; ABREAST],
    &'a [UnitQuaternion<f64>; ABREAST],
);

/// Where the bodies stand.
struct Standing<'a> {
    position: &'a [Vector3<f64>],
    orientation: &'a [UnitQuaternion<f64>],
}

/// Positions and orientations of four bodies. The alignment is that of the kernel's vectors, which share its stack.
#[derive(Default)]
#[repr(C, align(32))]
struct Copies([Vector3<f64>; ABREAST], [UnitQuaternion<f64>; ABREAST]);

impl<'a> Standing<'a> {
    #[inline(always)]
    fn new(bodies: &'a Bodies) -> Self {
        let position = &bodies.position[..];
        Self {
            position,
            orientation: &bodies.orientation[..position.len()],
        }
    }

    /// The bodies of one side; in `copies`, if they are not one after the other.
    #[inline(always)]
    fn of<'b>(
        &self,
        places: &Places,
        side: usize,
        copies: &'b mut Copies,
    ) -> (
        &'b [Vector3<f64>; ABREAST],
        &'b [UnitQuaternion<f64>; ABREAST],
    )
    where
        'a: 'b,
    {
        let index = &places.bodies[side];
        if places.neighbours[side]
            && let Some(x) = four(self.position, index[0])
            && let Some(q) = four(self.orientation, index[0])
        {
            return (x, q);
        }
        for ((x, q), i) in copies.0.iter_mut().zip(&mut copies.1).zip(index) {
            // The world is no body.
            *x = self.position.get(*i).copied().unwrap_or_default();
            *q = self.orientation.get(*i).copied().unwrap_or_default();
        }
        (&copies.0, &copies.1)
    }
}

/// Four from the first on, if there are as many.
#[inline(always)]
fn four<T>(of: &[T], first: usize) -> Option<&[T; ABREAST]> {
    of.get(first..)?.first_chunk()
}

#[inline(always)]
fn position<V: Lanes>(of: &[Vector3<f64>; ABREAST]) -> Vec3<V> {
    gather(of.each_ref().map(AsRef::as_ref))
}

#[inline(always)]
fn orientation<V: Lanes>(of: &[UnitQuaternion<f64>; ABREAST]) -> Quaternion<V> {
    gather(of.each_ref().map(|q| q.coords.as_ref()))
}

/// Gaps and lever arms of joints without angles.
#[inline(always)]
fn gap<V: Lanes>(a: Stand<'_>, b: Stand<'_>, frames: &Frames, pack: &mut Pack) -> Vec3<V> {
    let arm_a = turned(&orientation(a.1), &load(&frames.points[0]));
    let arm_b = turned(&orientation(b.1), &load(&frames.points[1]));
    pack.arms = [save(&arm_a), save(&arm_b)];
    add(&sub(&position(a.0), &position(b.0)), &sub(&arm_a, &arm_b))
}

/// Bends and twist of four joints.
struct Angular<V> {
    angles: [V; 3],
    /// Components of the gradients along side a's axes: of the bends' those along v and w, v v, v w and w w; of the
    /// twist's those along v and w.
    bends: [V; 3],
    twist: [V; 2],
    measures: Measures<V>,
}

impl<V: Lanes> Angular<V> {
    /// By the axes of side a, and the rotation that takes side a's bodies to side b's, all in the world frame.
    #[inline(always)]
    fn new(frames: &Frames, axes: &[Vec3<V>; 3], turn: &Quaternion<V>) -> Self {
        let [x, y, z, w] = *turn;
        let imaginary = [x, y, z];
        let mut seen = [
            dot(&axes[0], &imaginary),
            dot(&axes[1], &imaginary),
            dot(&axes[2], &imaginary),
            w,
        ];
        if !frames.parallel {
            seen = product(&seen, &load(&frames.between));
        }
        let [x, y, z, w] = seen;
        let (one, half) = (V::splat(1.0), V::splat(0.5));
        let (x2, w2) = (x + x, w + w);
        let (along_v, along_w) = (x2.neg_mul_add(z, w2 * y), x2.mul_add(y, w2 * z));
        let t = z.mul_add(z, y * y);
        let rest = one - t;
        let c = rest - t;
        // One division for x/w and 1/(1 + c).
        let inverse = one / (w * rest);
        let tangent = x * rest * inverse;
        let mean = half * (w * inverse);
        let f = over_sine(t);
        let g = f.mul_add(t, one);
        let h = mean * f.neg_mul_add(half * c, one);
        let (beta_v, beta_w, straight) = (g * along_v, g * along_w, g * c);
        let half_twist = atan(tangent);
        let twist = half_twist + half_twist;
        let (hv, hw) = (h * along_v, h * along_w);
        let (vv, vw, ww) = (
            hv.mul_add(along_v, straight),
            hv * along_w,
            hw.mul_add(along_w, straight),
        );
        Self {
            angles: [beta_v, beta_w, twist],
            bends: [vv, vw, ww],
            twist: [mean * along_w, -(mean * along_v)],
            measures: [tangent.abs(), (V::load(&frames.twist) - twist).abs(), t],
        }
    }

    /// The gradients on ω_b, by side a's axes, world.
    #[inline(always)]
    fn gradients(&self, [u, v, w]: &[Vec3<V>; 3]) -> [Vec3<V>; 3] {
        let ([beta_v, beta_w, _], [vv, vw, ww], [tv, tw]) = (self.angles, self.bends, self.twist);
        let axes = [*v, *w, *u];
        [
            combine(&axes, &[vv, vw, -beta_w]),
            combine(&axes, &[vw, ww, beta_v]),
            scale_add(w, tw, &scale_add(v, tv, u)),
        ]
    }

    /// Writes φ and the gradients of joints that have all rows; which lanes hold what they should, if not all.
    #[inline(always)]
    fn write(
        &self,
        gap: &Vec3<V>,
        axes: &[Vec3<V>; 3],
        phi: &mut [f64],
        places: &Places,
        pack: &mut Pack,
    ) -> Result<(), [bool; ABREAST]> {
        let ([x, y, z], [beta_v, beta_w, twist]) = (*gap, self.angles);
        places.write_rows(&[x, y, z, beta_v, beta_w, twist], phi);
        let good = self.good();
        for (to, gradient) in pack.gradients.iter_mut().zip(&self.gradients(axes)) {
            *to = save(gradient);
        }
        good
    }

    /// Which lanes are within the limits, if not all.
    #[inline(always)]
    fn good(&self) -> Result<(), [bool; ABREAST]> {
        let [tangent, turn, t] = &self.measures;
        if tangent.all_below(V::splat(LIMITS[0]))
            && turn.all_below(V::splat(LIMITS[1]))
            && t.all_below(V::splat(LIMITS[2]))
        {
            return Ok(());
        }
        let measures: [Four; 3] = save(&self.measures);
        let below = |lane: usize| (0..3).all(|k| measures[k][lane] < LIMITS[k]);
        Err(std::array::from_fn(below))
    }

    /// The same of joints that have some of the rows; which lanes hold what they should.
    #[inline(always)]
    fn write_some(
        &self,
        gap: &Vec3<V>,
        axes: &[Vec3<V>; 3],
        phi: &mut [f64],
        joints: &[Joint; ABREAST],
        pack: &mut Pack,
    ) -> [bool; ABREAST] {
        let (gap, angles): ([Four; 3], [Four; 3]) = (save(gap), save(&self.angles));
        let measures: [Four; 3] = save(&self.measures);
        let [first, second, third] = &self.gradients(axes);
        let gradients: [[Four; 3]; 3] = [save(first), save(second), save(third)];
        let mut good = [true; ABREAST];
        for (lane, joint) in joints.iter().enumerate() {
            let phi = &mut phi[joint.row..joint.row + joint.rows];
            for (to, from) in phi.iter_mut().zip(&gap) {
                *to = from[lane];
            }
            let (bend, twist) = joint.kind.angles();
            let has = [bend, bend, twist];
            let mut row = 0;
            for k in (0..3).filter(|k| has[*k]) {
                phi[3 + row] = angles[k][lane];
                for (to, from) in pack.gradients[row].iter_mut().zip(&gradients[k]) {
                    to[lane] = from[lane];
                }
                row += 1;
            }
            let [tangent, turn, t] = measures.each_ref().map(|x| x[lane]);
            if twist {
                good[lane] = tangent < LIMITS[0] && turn < LIMITS[1];
            }
            // Where w is zero the bends are not numbers either.
            good[lane] &= row == 0 || t < LIMITS[2] && tangent < f64::INFINITY;
        }
        good
    }
}
