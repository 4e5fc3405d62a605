//! Joints in packs of four, number by number, for vectors: how the Jacobian of most constraints of a cable is stored.
//!
//! A joint here is a constraint with three gap rows and up to three rows that measure an angle of the relative rotation
//! ([`crate::constraint`], `gap`). A pack holds four of them, whatever bodies and rows they belong to; a side that is held
//! by the world is on the body after the last one, which stands still.
//!
//! Ball joints and [`Cosserat`](crate::Cosserat) joints are evaluated in lanes, other kinds one by one. The layout is
//! private: [`FourJoints`] and [`JointSide`] are what others read.

mod evaluation;
mod products;

use evaluation::{Evaluation, Frames};
use nalgebra::Vector3;
use products::{Rates, Transposed};
use taut_lanes::vector::{Vec3, combine, cross, dot, gather, load, save, scale, scale_add};
use taut_lanes::{Halves, Lanes, Level, dispatch};

use crate::body_vectors::{BodyNumbersMut, BodyVectors, FourBodies, PACK, follow};
use crate::constraint::gap::JointJacobian;
use crate::constraint::{Constraint, RowKind, Rows};
use crate::scene::Scene;

/// Rows of a pack whose joints have 6 each.
const RUN: usize = 6 * PACK;

/// One number of each joint or body of a pack.
pub type Four = [f64; PACK];

/// The Jacobians of four joints: a [`JointJacobian`] as it stands in memory.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(32))]
struct Pack {
    arms: [[Four; 3]; 2],
    gradients: [[Four; 3]; 3],
}

impl Pack {
    #[inline(always)]
    fn jacobian<V: Lanes>(&self) -> JointJacobian<V> {
        let ([a, b], [p, q, s]) = (&self.arms, &self.gradients);
        JointJacobian {
            arms: [load(a), load(b)],
            gradients: [load(p), load(q), load(s)],
        }
    }

    fn set_lane(&mut self, lane: usize, joint: &JointJacobian<f64>) {
        let to = self.arms.iter_mut().chain(&mut self.gradients).flatten();
        let from = joint.arms.iter().chain(&joint.gradients).flatten();
        for (to, from) in to.zip(from) {
            to[lane] = *from;
        }
    }

    /// That of one lane.
    fn lane(&self, lane: usize) -> JointJacobian<f64> {
        let numbers = |v: [Four; 3]| v.map(|x| x[lane]);
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
    /// Whether the last row is a twist.
    winds: bool,
}

/// Where the four joints of a pack stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Places {
    /// First row of each.
    row: [usize; PACK],
    /// Number of rows of each.
    rows: [usize; PACK],
    /// The first row where all have 6 and those of one follow those of the other.
    run: Option<usize>,
    angles: Angles,
    /// Bodies of the sides a and b; the number of bodies stands for the world.
    bodies: [FourBodies; 2],
    /// Whether they are four joints along a cable: those of side b are one after the other, and those of side a, but for
    /// the first, are those of side b.
    along: bool,
    /// Joints of the pack. The other lanes are padding, copies of the last joint: assign to them, never accumulate.
    count: usize,
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
    /// Whether there are bends and a twist for lanes.
    fn angles(self) -> (bool, bool) {
        match self {
            Self::Cable { bend, twist } => (bend, twist),
            Self::Other => (false, false),
        }
    }
}

/// Which of the angles the joints of a pack have in lanes.
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

    /// The joints, four by four.
    #[inline(always)]
    pub(crate) fn fours(&self) -> impl Iterator<Item = FourJoints<'_>> {
        let packs = self.packs.iter().zip(&self.places);
        packs.map(|(pack, places)| FourJoints { pack, places })
    }

    /// r = J v of the joints' rows. The world's part of v is zero.
    pub(crate) fn times_jacobian(&self, v: &BodyVectors, r: &mut [f64]) {
        dispatch(Level::best(), Rates { joints: self, v, r });
    }

    /// p += Jᵀ μ of the joints' rows; what acts on the world is added there.
    pub(crate) fn add_transposed(&self, mu: &[f64], p: &mut BodyVectors) {
        dispatch(
            Level::best(),
            Transposed {
                joints: self,
                mu,
                p,
            },
        );
    }

    /// Whether a constraint is one of the joints.
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
            if let Constraint::Cosserat(c) = c {
                frames.twist[lane] = c.twist_reference;
            }
        }
    }

    /// Moves the unwrapping references of the joints to their twists among the violations `phi` of the present state: here
    /// and in the scene.
    pub(crate) fn follow_windings(&mut self, scene: &mut Scene, phi: &[f64]) {
        for (joints, frames) in self.joints.chunks_exact(PACK).zip(&mut self.frames) {
            for (joint, reference) in joints.iter().zip(&mut frames.twist) {
                if joint.winds {
                    *reference = phi[joint.row + joint.rows - 1];
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
        dispatch(
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

    /// Joint and side of a slot, `None` where it is none of a joint's.
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

    /// The sides of four joints, given by the numbers of the joints and of their sides.
    #[inline(always)]
    pub(crate) fn sides<V: Lanes>(&self, sides: [(usize, usize); PACK]) -> JointSide<V> {
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

/// Four joints: their Jacobian in lanes, and where they stand.
#[derive(Debug, Clone, Copy)]
pub struct FourJoints<'a> {
    pack: &'a Pack,
    places: &'a Places,
}

impl FourJoints<'_> {
    /// Joints of the pack. The other lanes are padding, copies of the last joint: assign to them, never accumulate.
    #[inline(always)]
    #[must_use]
    pub fn count(&self) -> usize {
        self.places.count
    }

    /// The bodies of side a (0) or b (1); the number of bodies stands for the world.
    #[inline(always)]
    #[must_use]
    pub fn bodies(&self, side: usize) -> &FourBodies {
        &self.places.bodies[side]
    }

    /// Whether they are four joints along a cable: the bodies of side b are one after the other, and those of side a, but
    /// for the first, are those of side b.
    #[must_use]
    pub fn are_along_a_cable(&self) -> bool {
        self.places.along
    }

    /// The lever arms of side a (0) or b (1), world \[m].
    #[inline(always)]
    #[must_use]
    pub fn arm<V: Lanes>(&self, side: usize) -> Vec3<V> {
        load(&self.pack.arms[side])
    }

    /// The gradient on ω_b of angular row 0, 1 or 2, world; that on ω_a is the negative. Zero where a joint has no such
    /// row.
    #[inline(always)]
    #[must_use]
    pub fn gradient<V: Lanes>(&self, row: usize) -> Vec3<V> {
        load(&self.pack.gradients[row])
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
        let (pack, next) = (self.pack, next.pack);
        JointSide {
            arm: negative_shifted(&pack.arms[0], &next.arms[0]),
            gradients: [
                negative_shifted(&pack.gradients[0], &next.gradients[0]),
                negative_shifted(&pack.gradients[1], &next.gradients[1]),
                negative_shifted(&pack.gradients[2], &next.gradients[2]),
            ],
        }
    }

    #[inline(always)]
    pub(crate) fn jacobian<V: Lanes>(&self) -> JointJacobian<V> {
        self.pack.jacobian()
    }

    /// The rows of the four joints out of all rows `from`, zeros for those that a joint does not have; copies of the last
    /// joint have its rows.
    ///
    /// # Panics
    /// When `from` is shorter than the scene has rows.
    #[inline(always)]
    #[must_use]
    pub fn rows_of<V: Lanes>(&self, from: &[f64]) -> [V; 6] {
        let places = self.places;
        if let Some(first) = places.run
            && let Some(rows) = from[first..].first_chunk::<RUN>()
            && let ([a, b, c, d], []) = rows.as_chunks::<6>()
        {
            return gather([a, b, c, d]);
        }
        if let [Some(a), Some(b), Some(c), Some(d)] =
            places.row.map(|row| from[row..].first_chunk())
            && places.rows == [6; PACK]
        {
            return gather([a, b, c, d]);
        }
        let mut lanes = [[0.0; PACK]; 6];
        for lane in 0..places.count {
            let rows = &from[places.row[lane]..][..places.rows[lane]];
            for (to, from) in lanes.iter_mut().zip(rows) {
                to[lane] = *from;
            }
        }
        let last = places.count - 1;
        for number in &mut lanes {
            let copied = number[last];
            number[last..].fill(copied);
        }
        load(&lanes)
    }

    /// Writes the rows of the four joints to all rows `to`.
    ///
    /// # Panics
    /// When `to` is shorter than the scene has rows.
    #[inline(always)]
    pub fn write_rows<V: Lanes>(&self, from: &[V; 6], to: &mut [f64]) {
        let places = self.places;
        if let Some(first) = places.run
            && let Some(rows) = to[first..].first_chunk_mut::<RUN>()
        {
            return V::scatter(from, rows, [0, 6, 12, 18]);
        }
        if places.rows == [6; PACK] {
            return V::scatter(from, to, places.row);
        }
        let from: [Four; 6] = save(from);
        for lane in 0..places.count {
            let rows = &mut to[places.row[lane]..][..places.rows[lane]];
            for (r, from) in rows.iter_mut().zip(&from) {
                *r = from[lane];
            }
        }
    }

    /// Adds to the numbers of the bodies of the sides a and b.
    ///
    /// # Panics
    /// When there is no room for a body.
    #[inline(always)]
    pub fn add_to_sides<V>(&self, [on_a, on_b]: [&[V; 6]; 2], to: &mut BodyNumbersMut<'_>)
    where
        V: Halves<Half: Halves>,
    {
        let [a, b] = &self.places.bodies;
        if self.places.along {
            to.add_along(a, b, [on_a, on_b]);
        } else {
            to.add(a, on_a, self.places.count);
            to.add(b, on_b, self.places.count);
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

    /// Q x.
    #[inline(always)]
    #[must_use]
    pub fn apply(&self, v: &Vec3<V>) -> [V; 6] {
        let [x, y, z] = cross(&self.arm, v);
        let [p, q, s] = &self.gradients;
        [x, y, z, dot(p, v), dot(q, v), dot(s, v)]
    }
}

/// The lanes one on, with the other sign.
#[inline(always)]
fn negative_shifted<V: Lanes>(pack: &[Four; 3], next: &[Four; 3]) -> Vec3<V> {
    let mut shifted: Vec3<V> = load(pack);
    for (lanes, next) in shifted.iter_mut().zip(next) {
        *lanes = -lanes.shift_in(V::load(next));
    }
    shifted
}

impl Places {
    fn new(joints: &[Joint; PACK], count: usize) -> Self {
        let bodies = [0, 1].map(|side| joints.each_ref().map(|j| j.bodies[side]));
        let rows = joints.each_ref().map(|j| j.rows);
        let row = joints.each_ref().map(|j| j.row);
        let follows = row.windows(2).all(|pair| pair[1] == pair[0] + 6);
        let have = |angles| joints.iter().all(|j| j.kind.angles() == angles);
        let angles = match () {
            () if have((true, true)) => Angles::All,
            () if have((false, false)) => Angles::None,
            () => Angles::Some,
        };
        Self {
            angles,
            row,
            rows,
            run: (rows == [6; PACK] && follows).then_some(row[0]),
            along: follow(&bodies[1]) && count == PACK && bodies[0][1..] == bodies[1][..PACK - 1],
            bodies: bodies.map(FourBodies::new),
            count,
        }
    }
}

/// What a constraint is as a joint, if it is one.
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
