//! Joints four abreast: what most constraints of a cable are, in a form that vectors work on.
//!
//! A joint here is a constraint with three gap rows and up to three rows that measure an angle of the relative rotation.
//! Its Jacobian is made of two lever arms r and of the angles' gradients g on ω_b alone (gap rows: the rows of −\[r]×
//! are (r × e_k)ᵀ):
//!
//! ```text
//! J_a = [ I  −[r_a]× ]      J_b = [ −I  [r_b]× ]
//!       [ 0  −gᵀ     ]            [  0   gᵀ    ]
//! ```
//!
//! so that 15 numbers stand for 72. Four joints make a [`Pack`], number by number, whatever bodies and rows they belong
//! to. Rows that a joint does not have have g = 0; a side that is held by the world is on the body after the last one,
//! which stands still.
//!
//! Ball joints and [`Cosserat`](crate::Cosserat) joints are evaluated in lanes where they bend by less than 60° and are
//! twisted by less than 23°, all others one by one. The formulas are others, of the same angles: where axes are not quite
//! orthonormal the two differ by as much.

mod evaluation;

use evaluation::{Evaluation, Frames};
use nalgebra::Vector3;
use taut_lanes::vector::{gather, load, save};
use taut_lanes::{Lanes, Level, dispatch};

use crate::constraint::{Constraint, MAX_ROWS, RowKind, Rows};
use crate::scene::Scene;

/// Joints in a pack.
pub const ABREAST: usize = 4;

/// Rows of a pack whose joints have 6 each.
const RUN: usize = 6 * ABREAST;

/// One number of each joint of a pack.
pub type Four = [f64; ABREAST];

/// The Jacobians of four joints.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(32))]
pub struct Pack {
    /// Lever arms of the sides a and b, world \[m].
    pub arms: [[Four; 3]; 2],
    /// Gradients of up to three angular rows on ω_b; those on ω_a are the negatives.
    pub gradients: [[Four; 3]; 3],
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
    /// Slots of the sides, `None` for the world.
    pub slots: [Option<usize>; 2],
    kind: Kind,
}

/// Where the four joints of a pack stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Places {
    /// First row of each.
    pub row: [usize; ABREAST],
    /// Number of rows of each.
    pub rows: [usize; ABREAST],
    /// The first row where all have 6 and those of one follow those of the other.
    pub run: Option<usize>,
    angles: Angles,
    /// Whether the joints are constraints one after the other.
    together: bool,
    /// Bodies of the sides a and b; the number of bodies stands for the world.
    pub bodies: [[usize; ABREAST]; 2],
    /// Whether a side's bodies are one after the other.
    pub neighbours: [bool; 2],
    /// Whether they are four joints along a cable: those of side b are one after the other, and those of side a, but for
    /// the first, are those of side b.
    pub along: bool,
    /// How many of the four are joints of their own, not copies of the last one. What is written for a copy, if it is, is
    /// written twice, and must not be added.
    pub count: usize,
}

/// What is evaluated in lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Gap rows, then two bends, then the twist, as far as they are there.
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
pub struct Abreast {
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
}

impl Abreast {
    /// The joints among the constraints of a scene, whose first rows and slots are given.
    pub(crate) fn new(scene: &Scene, row_start: &[usize], slot_start: &[usize]) -> Self {
        let world = scene.bodies.len();
        let mut joints: Vec<Joint> = Vec::new();
        let mut of_slot = vec![None; slot_start.last().copied().unwrap_or(0)];
        for (constraint, c) in scene.constraints.iter().enumerate() {
            let Some(kind) = kind(c) else { continue };
            let mut slot = slot_start[constraint];
            let (mut bodies, mut slots) = ([world; 2], [None; 2]);
            for (side, frame) in c.frames().iter().enumerate() {
                if let Some(body) = frame.body_index() {
                    bodies[side] = body;
                    slots[side] = Some(slot);
                    of_slot[slot] = Some((joints.len(), side));
                    slot += 1;
                }
            }
            joints.push(Joint {
                constraint,
                row: row_start[constraint],
                rows: row_start[constraint + 1] - row_start[constraint],
                bodies,
                slots,
                kind,
            });
        }
        let count = joints.len();
        if let Some(&last) = joints.last() {
            joints.resize(count.next_multiple_of(ABREAST), last);
        }
        let packs = joints.len() / ABREAST;
        let places = joints.as_chunks().0.iter().enumerate();
        let places = places.map(|(k, pack)| Places::new(pack, (count - ABREAST * k).min(ABREAST)));
        let held = |k: &usize| {
            let frames = scene.constraints[joints[*k].constraint].frames();
            frames.iter().any(|f| f.body_index().is_none())
        };
        Self {
            held: (0..joints.len()).filter(held).collect(),
            of_slot,
            count,
            packs: vec![Pack::default(); packs],
            places: places.collect(),
            frames: vec![Frames::default(); packs],
            joints,
        }
    }

    /// The joints, in the order of the scene.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        &self.joints[..self.count]
    }

    /// The Jacobians and where they stand, pack by pack.
    pub fn packs(&self) -> impl Iterator<Item = (&Pack, &Places)> {
        self.packs.iter().zip(&self.places)
    }

    /// The Jacobians alone: joint k is lane k mod 4 of pack k/4.
    #[must_use]
    pub fn jacobians(&self) -> &[Pack] {
        &self.packs
    }

    /// Whether a constraint is one of the joints.
    pub(crate) fn holds(c: &Constraint) -> bool {
        kind(c).is_some()
    }

    /// Takes frames and twist references from the scene.
    pub(crate) fn refresh(&mut self, scene: &Scene) {
        for (k, joint) in self.joints.iter().enumerate() {
            let (frames, lane) = (&mut self.frames[k / ABREAST], k % ABREAST);
            let c = &scene.constraints[joint.constraint];
            if let [a, b] = c.frames() {
                frames.take(lane, a, b);
            }
            if let Constraint::Cosserat(c) = c {
                frames.twist[lane] = c.twist_reference;
            }
        }
    }

    /// Moves the unwrapping references of the joints to their angles at the present state, of which `phi` are the
    /// violations, at time `t`: here and in the scene.
    pub(crate) fn follow_windings(&mut self, scene: &mut Scene, phi: &[f64], t: f64) {
        let (joints, _) = self.joints.as_chunks::<ABREAST>();
        let packs = joints.iter().zip(&self.places).zip(&mut self.frames);
        for ((joints, places), frames) in packs {
            let Joint {
                constraint, row, ..
            } = joints[0];
            if places.together
                && places.angles == Angles::All
                && let Some(constraints) =
                    scene.constraints[constraint..].first_chunk_mut::<ABREAST>()
                && let Some(rows) = phi[row..].as_chunks::<6>().0.first_chunk::<ABREAST>()
            {
                for ((c, rows), to) in constraints.iter_mut().zip(rows).zip(&mut frames.twist) {
                    if let Constraint::Cosserat(c) = c {
                        c.twist_reference = rows[5];
                    }
                    *to = rows[5];
                }
                continue;
            }
            for (lane, joint) in joints.iter().enumerate() {
                let c = &mut scene.constraints[joint.constraint];
                match (joint.kind, c) {
                    (Kind::Cable { twist, .. }, Constraint::Cosserat(c)) if twist => {
                        let twist = phi[joint.row + joint.rows - 1];
                        c.twist_reference = twist;
                        frames.twist[lane] = twist;
                    }
                    (Kind::Other, c) if lane < places.count => c.update_winding(&scene.bodies, t),
                    _ => {}
                }
            }
        }
    }

    /// φ and the packs at time `t`; `rest` is for the joints that lanes cannot do.
    pub(crate) fn evaluate(
        &mut self,
        scene: &Scene,
        t: f64,
        phi: &mut [f64],
        rest: &mut Vec<usize>,
    ) {
        for &k in &self.held {
            let c = &scene.constraints[self.joints[k].constraint];
            for (side, frame) in c.frames().iter().enumerate() {
                if frame.body_index().is_none() {
                    let point = frame.point + frame.displacement(t);
                    self.frames[k / ABREAST].place(k % ABREAST, side, point.as_ref());
                }
            }
        }
        rest.clear();
        dispatch(
            Level::best(),
            Evaluation {
                joints: self,
                bodies: &scene.bodies,
                phi: &mut *phi,
                rest: &mut *rest,
            },
        );
        for &k in rest.iter() {
            let joint = self.joints[k];
            let mut blocks = [0.0; 2 * 6 * MAX_ROWS];
            let mut levers = [Vector3::zeros(); 2];
            let c = &scene.constraints[joint.constraint];
            let phi = &mut phi[joint.row..joint.row + joint.rows];
            c.evaluate(
                &scene.bodies,
                t,
                &mut Rows::new(phi, &mut blocks, &mut levers),
            );
            self.take(k, &blocks, &levers);
        }
    }

    /// Takes joint `k` from the blocks and levers of its moving sides, one after the other.
    fn take(&mut self, k: usize, blocks: &[f64], levers: &[Vector3<f64>; 2]) {
        let joint = self.joints[k];
        let (pack, lane) = (&mut self.packs[k / ABREAST], k % ABREAST);
        let sides = (0..2).filter(|side| joint.slots[*side].is_some());
        for (side, (block, lever)) in sides.zip(blocks.chunks_exact(6 * joint.rows).zip(levers)) {
            for (to, r) in pack.arms[side].iter_mut().zip(lever.iter()) {
                to[lane] = *r;
            }
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let (rows, _) = block.as_chunks::<6>();
            for (row, gradient) in rows[3..].iter().zip(&mut pack.gradients) {
                for (to, g) in gradient.iter_mut().zip(&row[3..]) {
                    to[lane] = sign * g;
                }
            }
        }
    }

    /// The constraints of the joints with a side that is held by the world.
    pub(crate) fn held(&self) -> impl Iterator<Item = usize> {
        let own = self.held.iter().take_while(|k| **k < self.count);
        own.map(|&k| self.joints[k].constraint)
    }

    /// Joint and side of a slot, `None` where it is none of a joint's.
    #[must_use]
    pub fn of_slot(&self, slot: usize) -> Option<(usize, usize)> {
        self.of_slot.get(slot).copied().flatten()
    }

    /// Lever arm of a joint's side.
    pub(crate) fn arm(&self, joint: usize, side: usize) -> Vector3<f64> {
        let arm = &self.packs[joint / ABREAST].arms[side];
        Vector3::from_fn(|i, _| arm[i][joint % ABREAST])
    }

    /// The block of a joint's side, as many rows as there is room for.
    pub(crate) fn write_block(&self, joint: usize, side: usize, block: &mut [f64]) {
        let (pack, lane) = (&self.packs[joint / ABREAST], joint % ABREAST);
        let sign = if side == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = pack.arms[side].map(|r| r[lane]);
        let gradient = |q: usize| {
            let [x, y, z] = pack.gradients[q].map(|g| g[lane]);
            [0.0, 0.0, 0.0, -sign * x, -sign * y, -sign * z]
        };
        let rows = [
            [sign, 0.0, 0.0, 0.0, sign * z, -sign * y],
            [0.0, sign, 0.0, -sign * z, 0.0, sign * x],
            [0.0, 0.0, sign, sign * y, -sign * x, 0.0],
            gradient(0),
            gradient(1),
            gradient(2),
        ];
        block.copy_from_slice(&rows.as_flattened()[..block.len()]);
    }
}

impl Places {
    fn new(joints: &[Joint; ABREAST], count: usize) -> Self {
        let bodies = [0, 1].map(|side| joints.each_ref().map(|j| j.bodies[side]));
        let rows = joints.each_ref().map(|j| j.rows);
        let row = joints.each_ref().map(|j| j.row);
        let follows = row.windows(2).all(|pair| pair[1] == pair[0] + 6);
        let neighbours = bodies.each_ref().map(follow);
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
            run: (rows == [6; ABREAST] && follows).then_some(row[0]),
            together: follow(&joints.each_ref().map(|j| j.constraint)),
            along: neighbours[1] && count == ABREAST && bodies[0][1..] == bodies[1][..ABREAST - 1],
            neighbours,
            bodies,
            count,
        }
    }

    /// The rows of the four joints out of all rows `from`, zeros for those that a joint does not have; copies of the last
    /// joint have its rows.
    ///
    /// # Panics
    /// When `from` is shorter than the scene has rows.
    #[inline(always)]
    #[must_use]
    pub fn rows_of<V: Lanes>(&self, from: &[f64]) -> [V; 6] {
        if let Some(first) = self.run
            && let Some(rows) = from[first..].first_chunk::<RUN>()
            && let ([a, b, c, d], []) = rows.as_chunks::<6>()
        {
            return gather([a, b, c, d]);
        }
        if let [Some(a), Some(b), Some(c), Some(d)] = self.row.map(|row| from[row..].first_chunk())
            && self.rows == [6; ABREAST]
        {
            return gather([a, b, c, d]);
        }
        let mut lanes = [[0.0; ABREAST]; 6];
        for lane in 0..self.count {
            let rows = &from[self.row[lane]..][..self.rows[lane]];
            for (to, from) in lanes.iter_mut().zip(rows) {
                to[lane] = *from;
            }
        }
        let last = self.count - 1;
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
        if let Some(first) = self.run
            && let Some(rows) = to[first..].first_chunk_mut::<RUN>()
        {
            return V::scatter(from, rows, [0, 6, 12, 18]);
        }
        if self.rows == [6; ABREAST] {
            return V::scatter(from, to, self.row);
        }
        let from: [Four; 6] = save(from);
        for lane in 0..self.count {
            let rows = &mut to[self.row[lane]..][..self.rows[lane]];
            for (r, from) in rows.iter_mut().zip(&from) {
                *r = from[lane];
            }
        }
    }
}

/// Whether four are one after the other.
fn follow(four: &[usize; ABREAST]) -> bool {
    four.windows(2).all(|pair| pair[1] == pair[0] + 1)
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
