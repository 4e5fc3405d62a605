//! Joints in packs of eight, number by number, for vectors: how the Jacobian of most constraints of a cable is stored.
//!
//! A joint here is a constraint with three gap rows and up to three rows that measure an angle of the relative rotation
//! ([`crate::constraint`], `gap`). A pack holds eight of them, whatever bodies and rows they belong to; a side that is held
//! by the world is on the body after the last one, which stands still.
//!
//! Ball joints and [`Cosserat`](crate::Cosserat) joints are evaluated in lanes, other kinds one by one. The layout is
//! private: [`JointLanes`] and [`JointSide`] are what others read.

mod evaluation;
mod products;

use evaluation::{Evaluation, Frames, Lagging};
use nalgebra::Vector3;
use products::{Rates, Transposed};
use taut_lanes::vector::{Vec3, combine, cross, dot, gather, scale, scale_add};
use taut_lanes::{Lanes, Level, dispatch_wide};

use crate::body_vectors::{BodyLanes, BodyNumbersMut, BodyPack, BodyVectors};
use crate::constraint::gap::JointJacobian;
use crate::constraint::{Constraint, RowKind, Rows};
use crate::lanes::{Numbers, PACK, PerLanes, load_part, part};
use crate::scene::Scene;

/// Largest distance of a twist from the reference that unwraps it after a step \[rad].
const LAG: f64 = 0.01;

/// The Jacobians of eight joints: a [`JointJacobian`] as it stands in memory.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(64))]
struct Pack {
    arms: [[Numbers; 3]; 2],
    gradients: [[Numbers; 3]; 3],
}

impl Pack {
    fn set_lane(&mut self, lane: usize, joint: &JointJacobian<f64>) {
        let to = self.arms.iter_mut().chain(&mut self.gradients).flatten();
        let from = joint.arms.iter().chain(&joint.gradients).flatten();
        for (to, from) in to.zip(from) {
            to[lane] = *from;
        }
    }

    /// Jacobian of one lane.
    fn lane(&self, lane: usize) -> JointJacobian<f64> {
        let numbers = |v: [Numbers; 3]| v.map(|x| x[lane]);
        JointJacobian {
            arms: self.arms.map(numbers),
            gradients: self.gradients.map(numbers),
        }
    }
}

/// Where a joint stands in the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Joint {
    /// Index of the constraint.
    pub constraint: usize,
    /// Its first row.
    pub row: usize,
    /// Number of its rows, 3 to 6: three of the gap, then angles.
    pub rows: usize,
    /// Bodies of the sides a and b; the number of bodies stands for the world.
    pub bodies: [usize; 2],
    kind: Kind,
    /// True if the last row is a twist.
    winds: bool,
}

/// True if the reference has to follow the twist, or one of them is NaN.
fn lags(twist: f64, reference: f64) -> bool {
    let within = (twist - reference).abs() <= LAG;
    !within
}

impl Joint {
    /// The last of its rows among the violations: its twist, if it [winds](Self::winds).
    fn twist(&self, phi: &[f64]) -> f64 {
        phi[self.row + self.rows - 1]
    }
}

/// Where the joints of a pack stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Places {
    /// First row of each.
    row: [usize; PACK],
    /// Number of rows of each.
    rows: [usize; PACK],
    /// Bodies of the sides a and b; the number of bodies stands for the world.
    bodies: [BodyPack; 2],
    shape: PerLanes<Shape>,
    /// Joints of the pack. The other lanes are padding: they have the last joint's Jacobian, zeros for rows, and the bodies
    /// after its own, whoever these belong to.
    count: usize,
}

/// Common properties of joints side by side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shape {
    /// True if none is padding and all have 6 rows.
    full: bool,
    /// The first row, if they are full and their rows follow each other.
    run: Option<usize>,
    angles: Angles,
    /// True for joints along a cable: the bodies of side b have consecutive numbers, and each
    /// joint's body a is body b of the joint before.
    along: bool,
}

/// How a joint is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// In lanes: gap rows, then the bends and the twist that it has.
    Cable { bend: bool, twist: bool },
    /// Anything else.
    Other,
}

impl Kind {
    /// Bends and twist in lanes: true where the joint has them.
    fn angles(self) -> (bool, bool) {
        match self {
            Self::Cable { bend, twist } => (bend, twist),
            Self::Other => (false, false),
        }
    }
}

/// Which of the angles joints side by side have in lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Angles {
    None,
    Some,
    All,
}

/// The joints of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Packs {
    /// The joints in the order of the scene; the last pack is filled up with copies of the last joint.
    joints: Vec<Joint>,
    /// Number of joints.
    count: usize,
    packs: Vec<Pack>,
    places: Vec<Places>,
    frames: Vec<Frames>,
    /// Joints, and copies of the last one, with a side that is held by the world.
    held: Vec<usize>,
    /// Joint and side of each slot.
    of_slot: Vec<Option<(usize, usize)>>,
    /// Joints that are evaluated one by one.
    single: Vec<usize>,
}

impl Packs {
    /// The joints among the constraints of a scene, whose first rows and slots are given.
    pub(crate) fn new(scene: &Scene, row_start: &[usize], slot_start: &[usize]) -> Self {
        let world = scene.bodies.len();
        let mut joints: Vec<Joint> = Vec::new();
        let mut of_slot = vec![None; slot_start.last().copied().unwrap_or(0)];
        for (constraint, c) in scene.constraints.iter().enumerate() {
            let Some(kind) = kind(c) else { continue };
            let mut slot = slot_start[constraint];
            let mut bodies = [world; 2];
            for (side, frame) in c.frames().iter().enumerate() {
                if let Some(body) = frame.body_index() {
                    bodies[side] = body;
                    of_slot[slot] = Some((joints.len(), side));
                    slot += 1;
                }
            }
            joints.push(Joint {
                constraint,
                row: row_start[constraint],
                rows: row_start[constraint + 1] - row_start[constraint],
                bodies,
                kind,
                winds: c.parts().any(|(kind, ..)| kind == RowKind::Twist),
            });
        }
        let count = joints.len();
        if let Some(&last) = joints.last() {
            joints.resize(count.next_multiple_of(PACK), last);
        }
        let packs = joints.len() / PACK;
        let places = joints.as_chunks().0.iter().enumerate();
        let places = places.map(|(k, pack)| Places::new(pack, (count - PACK * k).min(PACK)));
        let held = |k: &usize| {
            let frames = scene.constraints[joints[*k].constraint].frames();
            frames.iter().any(|f| f.body_index().is_none())
        };
        let single = |k: &usize| joints[*k].kind == Kind::Other;
        Self {
            held: (0..joints.len()).filter(held).collect(),
            single: (0..joints.len()).filter(single).collect(),
            of_slot,
            count,
            packs: vec![Pack::default(); packs],
            places: places.collect(),
            frames: vec![Frames::default(); packs],
            joints,
        }
    }

    /// The joints, in the order of the scene.
    pub(crate) fn joints(&self) -> &[Joint] {
        &self.joints[..self.count]
    }

    /// The joints, `L` at a time.
    #[inline(always)]
    pub(crate) fn lanes<const L: usize>(&self) -> impl Iterator<Item = JointLanes<'_, L>> {
        (0..self.count).step_by(L).map(|first| self.lanes_at(first))
    }

    /// The `L` joints from `first` on, a multiple of `L`.
    #[inline(always)]
    fn lanes_at<const L: usize>(&self, first: usize) -> JointLanes<'_, L> {
        JointLanes {
            pack: &self.packs[first / PACK],
            places: &self.places[first / PACK],
            lane: first % PACK,
        }
    }

    /// r = J Σ v of the joints' rows. The world's part of each v is zero.
    pub(crate) fn times_jacobian<const N: usize>(&self, v: [&BodyVectors; N], r: &mut [f64]) {
        dispatch_wide(Level::best(), Rates { joints: self, v, r });
    }

    /// p += Jᵀ μ of the joints' rows; what acts on the world is added there.
    pub(crate) fn add_transposed(&self, mu: &[f64], p: &mut BodyVectors) {
        dispatch_wide(
            Level::best(),
            Transposed {
                joints: self,
                mu,
                p,
            },
        );
    }

    /// True if the constraint counts as a joint, in lanes or by itself.
    pub(crate) fn holds(c: &Constraint) -> bool {
        kind(c).is_some()
    }

    /// Takes frames and twist references from the scene.
    pub(crate) fn refresh(&mut self, scene: &Scene) {
        for (k, joint) in self.joints.iter().enumerate() {
            let (frames, lane) = (&mut self.frames[k / PACK], k % PACK);
            let c = &scene.constraints[joint.constraint];
            if let [a, b] = c.frames() {
                frames.take(lane, a, b);
            }
            if let Some(reference) = c.twist_reference() {
                frames.twist[lane] = reference;
            }
        }
    }

    /// Moves the unwrapping references of the joints to their twists among the violations `phi` of the present state, here
    /// and in the scene. A reference within [`LAG`] stays: it unwraps the twist to the same angle, and what is not written
    /// of the constraints of a long cable need not be fetched from memory.
    pub(crate) fn follow_windings(&mut self, scene: &mut Scene, phi: &[f64]) {
        if !dispatch_wide(Level::best(), Lagging { joints: self, phi }) {
            return;
        }
        for (joints, frames) in self.joints.chunks_exact(PACK).zip(&mut self.frames) {
            for (joint, reference) in joints.iter().zip(&mut frames.twist) {
                let twist = joint.twist(phi);
                if joint.winds && lags(twist, *reference) {
                    *reference = twist;
                    scene.constraints[joint.constraint].set_twist_reference(*reference);
                }
            }
        }
    }

    /// φ and the packs at time `t`.
    pub(crate) fn evaluate(&mut self, scene: &Scene, t: f64, phi: &mut [f64]) {
        for &k in &self.held {
            let c = &scene.constraints[self.joints[k].constraint];
            for (side, frame) in c.frames().iter().enumerate() {
                if frame.body_index().is_none() {
                    let point = frame.point + frame.displacement(t);
                    self.frames[k / PACK].place(k % PACK, side, point.as_ref());
                }
            }
        }
        dispatch_wide(
            Level::best(),
            Evaluation {
                joints: self,
                bodies: &scene.bodies,
                phi: &mut *phi,
            },
        );
        for n in 0..self.single.len() {
            let k = self.single[n];
            let joint = self.joints[k];
            let phi = &mut phi[joint.row..joint.row + joint.rows];
            let mut out = Rows::new(phi, &mut [], &mut []);
            scene.constraints[joint.constraint].evaluate(&scene.bodies, t, &mut out);
            self.packs[k / PACK].set_lane(k % PACK, &out.joint);
        }
    }

    /// The constraints of the joints with a side that is held by the world.
    pub(crate) fn held(&self) -> impl Iterator<Item = usize> {
        let own = self.held.iter().take_while(|k| **k < self.count);
        own.map(|&k| self.joints[k].constraint)
    }

    /// Joint and side of a slot; `None` if it is not a joint's.
    pub(crate) fn of_slot(&self, slot: usize) -> Option<(usize, usize)> {
        self.of_slot.get(slot).copied().flatten()
    }

    /// Lever arm of a joint's side.
    pub(crate) fn arm(&self, joint: usize, side: usize) -> Vector3<f64> {
        let jacobian = self.packs[joint / PACK].lane(joint % PACK);
        jacobian.arms[side].into()
    }

    /// The block of a joint's side; the rows after its last are zero.
    pub(crate) fn block(&self, joint: usize, side: usize) -> [[f64; 6]; 6] {
        self.packs[joint / PACK].lane(joint % PACK).block(side)
    }

    /// The sides of any joints, given by the numbers of the joints and of their sides.
    #[inline(always)]
    pub(crate) fn sides<V: Lanes, const L: usize>(
        &self,
        sides: [(usize, usize); L],
    ) -> JointSide<V> {
        // A side is 0 or 1, which the bounds check cannot know.
        let at = sides.map(|(k, side)| (&self.packs[k / PACK], k % PACK, side & 1));
        let zero = [V::splat(0.0); 3];
        let (mut arm, mut gradients) = (zero, [zero; 3]);
        for (i, arm) in arm.iter_mut().enumerate() {
            *arm = V::from_fn(|l| at[l].0.arms[at[l].2][i][at[l].1]);
        }
        for (q, gradient) in gradients.iter_mut().enumerate() {
            for (i, g) in gradient.iter_mut().enumerate() {
                *g = V::from_fn(|l| at[l].0.gradients[q][i][at[l].1]);
            }
        }
        JointSide { arm, gradients }
    }
}

/// As many joints as there are lanes: their Jacobian, and where they stand.
#[derive(Debug, Clone, Copy)]
pub struct JointLanes<'a, const L: usize> {
    pack: &'a Pack,
    places: &'a Places,
    /// The first joint's lane in the pack.
    lane: usize,
}

impl<const L: usize> JointLanes<'_, L> {
    /// Number of joints. The other lanes are padding: they have the last joint's Jacobian, zeros for rows, and the bodies
    /// after its own, whoever these belong to: what is added there has to be zero.
    #[inline(always)]
    #[must_use]
    pub fn count(&self) -> usize {
        (self.places.count - self.lane).min(L)
    }

    /// The bodies of side a (0) or b (1); the number of bodies stands for the world.
    #[inline(always)]
    #[must_use]
    pub fn bodies(&self, side: usize) -> BodyLanes<'_, L> {
        self.places.bodies[side].lanes(self.lane)
    }

    #[inline(always)]
    fn shape(&self) -> &Shape {
        self.places.shape.get::<L>(self.lane)
    }

    /// True for joints along a cable: the bodies of side b have consecutive numbers, and each
    /// joint's body a is body b of the joint before.
    #[inline(always)]
    #[must_use]
    pub fn are_along_a_cable(&self) -> bool {
        self.shape().along
    }

    /// The lever arms of side a (0) or b (1), world \[m].
    #[inline(always)]
    #[must_use]
    pub fn arm<V: Lanes>(&self, side: usize) -> Vec3<V> {
        load_part::<V, L, 3>(&self.pack.arms[side], self.lane)
    }

    /// The gradient on ω_b of angular row 0, 1 or 2, world; that on ω_a is the negative. Zero where a joint has no such
    /// row.
    #[inline(always)]
    #[must_use]
    pub fn gradient<V: Lanes>(&self, row: usize) -> Vec3<V> {
        load_part::<V, L, 3>(&self.pack.gradients[row], self.lane)
    }

    /// One side of each.
    #[inline(always)]
    #[must_use]
    pub fn side<V: Lanes>(&self, side: usize) -> JointSide<V> {
        JointSide {
            arm: self.arm(side),
            gradients: [self.gradient(0), self.gradient(1), self.gradient(2)],
        }
    }

    /// Side a of the joints that follow these, −Q instead of Q; the last of them is the first of `next`.
    #[inline(always)]
    #[must_use]
    pub fn negative_side_of_next<V: Lanes>(&self, next: &Self) -> JointSide<V> {
        let (these, next) = (self.side(0), next.side(0));
        let gradients = [0, 1, 2].map(|row| [&these.gradients[row], &next.gradients[row]]);
        JointSide {
            arm: negative_shifted([&these.arm, &next.arm]),
            gradients: [
                negative_shifted(gradients[0]),
                negative_shifted(gradients[1]),
                negative_shifted(gradients[2]),
            ],
        }
    }

    #[inline(always)]
    pub(crate) fn jacobian<V: Lanes>(&self) -> JointJacobian<V> {
        JointJacobian {
            arms: [self.arm(0), self.arm(1)],
            gradients: [self.gradient(0), self.gradient(1), self.gradient(2)],
        }
    }

    /// The rows of the joints out of all rows `from`, zeros for those that a joint does not have.
    ///
    /// # Panics
    /// When `from` is shorter than the scene has rows.
    #[inline(always)]
    #[must_use]
    pub fn rows_of<V: Lanes>(&self, from: &[f64]) -> [V; 6] {
        let (shape, row) = (self.shape(), part::<_, L>(&self.places.row, self.lane));
        if let Some(first) = shape.run
            && let (rows, []) = from[first..first + 6 * L].as_chunks::<6>()
            && let Some(rows) = rows.first_chunk::<L>()
        {
            return V::load_arrays(rows);
        }
        if shape.full {
            return gather(row.map(|row| from[row..row + 6].first_chunk().unwrap_or(&[0.0; 6])));
        }
        let rows = part::<_, L>(&self.places.rows, self.lane);
        let mut lanes = [[0.0; 6]; L];
        for (lane, to) in lanes.iter_mut().enumerate().take(self.count()) {
            copy_rows(&from[row[lane]..][..rows[lane]], to);
        }
        gather(lanes.each_ref())
    }

    /// Writes the rows of the joints to all rows `to`.
    ///
    /// # Panics
    /// When `to` is shorter than the scene has rows.
    #[inline(always)]
    pub fn write_rows<V: Lanes>(&self, from: &[V; 6], to: &mut [f64]) {
        let (shape, row) = (self.shape(), part::<_, L>(&self.places.row, self.lane));
        if let Some(first) = shape.run {
            let (rows, _) = to[first..first + 6 * L].as_chunks_mut::<6>();
            if let Some(rows) = rows.first_chunk_mut::<L>() {
                return V::store_arrays(from, rows);
            }
        }
        if shape.full {
            return V::scatter(from, to, *row);
        }
        let rows = part::<_, L>(&self.places.rows, self.lane);
        let mut lanes = [[0.0; 6]; L];
        V::spread(from, lanes.each_mut());
        for (lane, from) in lanes.iter().enumerate().take(self.count()) {
            let rows = rows[lane];
            copy_rows(&from[..rows], &mut to[row[lane]..row[lane] + rows]);
        }
    }

    /// Adds to the numbers of the bodies of the sides a and b.
    ///
    /// # Panics
    /// When there is no room for a body.
    #[inline(always)]
    pub fn add_to_sides<V: Lanes>(&self, [on_a, on_b]: [&[V; 6]; 2], to: &mut BodyNumbersMut<'_>) {
        let (a, b) = (self.bodies(0), self.bodies(1));
        if self.are_along_a_cable() {
            to.add_along(&a, &b, [on_a, on_b]);
        } else {
            to.add(&a, on_a, self.count());
            to.add(&b, on_b, self.count());
        }
    }
}

/// Q = \[ \[r]×; gᵀ ] of one side of each of some joints: the angular part of J_b, and of −J_a.
#[derive(Debug, Clone, Copy)]
pub struct JointSide<V> {
    arm: Vec3<V>,
    gradients: [Vec3<V>; 3],
}

impl<V: Lanes> JointSide<V> {
    /// Row `R` of Q A, for the columns of A; those of \[r]× are (0, −z, y), (z, 0, −x), (−y, x, 0).
    #[inline(always)]
    #[must_use]
    pub fn row_times<const R: usize>(&self, a: &[Vec3<V>; 3]) -> Vec3<V> {
        let [x, y, z] = self.arm;
        let [ax, ay, az] = a;
        match R {
            0 => scale_add(az, y, &scale(ay, -z)),
            1 => scale_add(ax, z, &scale(az, -x)),
            2 => scale_add(ay, x, &scale(ax, -y)),
            _ => combine(a, &self.gradients[R - 3]),
        }
    }

    /// The rows of \[r]× A, for the columns of A: for a symmetric A the columns of A \[r]×ᵀ.
    #[inline(always)]
    #[must_use]
    pub fn gap_times(&self, a: &[Vec3<V>; 3]) -> [Vec3<V>; 3] {
        [
            self.row_times::<0>(a),
            self.row_times::<1>(a),
            self.row_times::<2>(a),
        ]
    }

    /// The rows of gᵀ A, for the columns of A.
    #[inline(always)]
    #[must_use]
    pub fn angles_times(&self, a: &[Vec3<V>; 3]) -> [Vec3<V>; 3] {
        [
            self.row_times::<3>(a),
            self.row_times::<4>(a),
            self.row_times::<5>(a),
        ]
    }

    /// \[r]× x.
    #[inline(always)]
    #[must_use]
    pub fn gap_of(&self, x: &Vec3<V>) -> Vec3<V> {
        cross(&self.arm, x)
    }

    /// \[r]× x + sum.
    #[inline(always)]
    #[must_use]
    pub fn add_gap_of(&self, x: &Vec3<V>, sum: &Vec3<V>) -> Vec3<V> {
        let r = &self.arm;
        [
            r[2].neg_mul_add(x[1], r[1].mul_add(x[2], sum[0])),
            r[0].neg_mul_add(x[2], r[2].mul_add(x[0], sum[1])),
            r[1].neg_mul_add(x[0], r[0].mul_add(x[1], sum[2])),
        ]
    }

    /// The rows gᵀ times x.
    #[inline(always)]
    #[must_use]
    pub fn angles_of(&self, x: &Vec3<V>) -> Vec3<V> {
        let [p, q, s] = &self.gradients;
        [dot(p, x), dot(q, x), dot(s, x)]
    }

    /// Q x.
    #[inline(always)]
    #[must_use]
    pub fn apply(&self, v: &Vec3<V>) -> [V; 6] {
        let ([x, y, z], [p, q, s]) = (self.gap_of(v), self.angles_of(v));
        [x, y, z, p, q, s]
    }
}

/// Copies the rows of a joint: faster where their number is known.
#[inline(always)]
fn copy_rows(from: &[f64], to: &mut [f64]) {
    match from.len() {
        3 => to[..3].copy_from_slice(&from[..3]),
        6 => to[..6].copy_from_slice(&from[..6]),
        rows => to[..rows].copy_from_slice(from),
    }
}

/// The lanes one on, with the other sign.
#[inline(always)]
fn negative_shifted<V: Lanes>([these, next]: [&Vec3<V>; 2]) -> Vec3<V> {
    let mut shifted = *these;
    for (lanes, next) in shifted.iter_mut().zip(next) {
        *lanes = -lanes.shift_in(*next);
    }
    shifted
}

impl Places {
    fn new(joints: &[Joint; PACK], count: usize) -> Self {
        let mut joints = *joints;
        for lane in count..PACK {
            joints[lane].bodies = joints[lane - 1].bodies.map(|body| body + 1);
        }
        let numbered = std::array::from_fn(|lane| (joints[lane], lane < count));
        Self {
            row: joints.map(|j| j.row),
            rows: joints.map(|j| j.rows),
            bodies: [0, 1].map(|side| BodyPack::new(joints.map(|j| j.bodies[side]))),
            shape: PerLanes::new(&numbered, Shape::new),
            count,
        }
    }
}

impl Shape {
    /// Properties of `joints`, each with true if it is no padding.
    fn new(joints: &[(Joint, bool)]) -> Self {
        let have = |angles| joints.iter().all(|(j, _)| j.kind.angles() == angles);
        let full = joints.iter().all(|(j, real)| *real && j.rows == 6);
        let pairs = || joints.windows(2).map(|pair| [pair[0].0, pair[1].0]);
        Self {
            full,
            run: (full && pairs().all(|[a, b]| b.row == a.row + 6)).then_some(joints[0].0.row),
            angles: match () {
                () if have((true, true)) => Angles::All,
                () if have((false, false)) => Angles::None,
                () => Angles::Some,
            },
            along: pairs()
                .all(|[a, b]| b.bodies[1] == a.bodies[1] + 1 && b.bodies[0] == a.bodies[1]),
        }
    }
}

/// Kind of a constraint as a joint; `None` if it is not a joint.
fn kind(c: &Constraint) -> Option<Kind> {
    let has = |wanted| c.parts().any(|(kind, ..)| kind == wanted);
    if let [a, b] = c.frames()
        && a.body_index() == b.body_index()
    {
        return None;
    }
    match c {
        Constraint::Spherical(_) => Some(Kind::Cable {
            bend: false,
            twist: false,
        }),
        Constraint::Cosserat(_) if c.has_stretch_rows() => Some(Kind::Cable {
            bend: has(RowKind::Bend),
            twist: has(RowKind::Twist),
        }),
        Constraint::Paper(_) if c.has_stretch_rows() => Some(Kind::Other),
        Constraint::Lock(_) => Some(Kind::Other),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
