//! The constraints of a scene, linearised at one instant.
//!
//! [`Linearized`] is what the time stepper reads: φ, ∂φ/∂t, ε, τ and J, as flat arrays whose layout depends on the
//! topology alone. Rows are numbered through all constraints, in the order of the scene.

use std::ops::{Deref, Range};

use nalgebra::Vector3;
use taut_lanes::{Aligned, Lanes};

use crate::body_vectors::BodyVectors;
use crate::constraint::{Constraint, RowKind, Rows};
use crate::packs::{Joint, JointLanes, JointSide, Packs};
use crate::scene::Scene;

/// One Jacobian block: how a constraint acts on a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot {
    /// Index of the constraint.
    pub constraint: usize,
    /// Index of the body.
    pub body: usize,
    /// Start of the block in [`Linearized::jacobian`]: rows × 6, row-major, columns 0..3 on the
    /// velocity and 3..6 on the angular velocity, both in the world frame. `usize::MAX` for
    /// [joints](Linearized::joints), whose blocks are stored in packs.
    pub offset: usize,
}

/// A slot's block of the Jacobian: a slice of rows × 6 numbers, row-major.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a>(Rows6<'a>);

#[derive(Debug, Clone, Copy)]
#[expect(
    clippy::large_enum_variant,
    reason = "a box would allocate in the step"
)]
enum Rows6<'a> {
    Stored(&'a [[f64; 6]]),
    /// From a pack, and their number.
    Copied([[f64; 6]; 6], usize),
}

impl Deref for Block<'_> {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        self.rows().as_flattened()
    }
}

impl Block<'_> {
    /// The block row by row: in each ∂φ̇/∂v (1, or rad/m where φ is an angle) and ∂φ̇/∂ω (m, or 1).
    #[inline]
    #[must_use]
    pub fn rows(&self) -> &[[f64; 6]] {
        match &self.0 {
            Rows6::Stored(rows) => rows,
            Rows6::Copied(rows, count) => &rows[..*count],
        }
    }
}

/// The transverse rows of a link ([`Distance`](crate::Distance)), in terms of rows of the scene.
///
/// They stand for the geometric stiffness |λ|/|d| of the link's tension. After [`Linearized::update`], which sets their
/// ε to 0, a time stepper with the multipliers λ \[N] of its last step writes
/// `compliance[link.rows()].fill(link.distance / lambda[link.length_row].abs())`, with its own bounds for a link without
/// tension, where ε = ∞ stands for no such rows, and for a link of length zero, where ε = 0 is rigid.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Transverse {
    /// The link's length row, whose multiplier is the tension.
    pub length_row: usize,
    /// The first of the two transverse rows.
    pub first_row: usize,
    /// |d|, distance between the attachment points at t \[m], ≥ 0.
    pub distance: f64,
}

impl Transverse {
    /// The two transverse rows.
    #[must_use]
    pub fn rows(&self) -> Range<usize> {
        self.first_row..self.first_row + 2
    }
}

/// Bounds lower ≤ λ ≤ upper of one row of the scene: a cable that cannot push, a motor or winch of limited force.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RowBounds {
    /// The row.
    pub row: usize,
    /// Its constraint.
    pub constraint: usize,
    /// Least λ \[N or N m]; −∞ for none.
    pub lower: f64,
    /// Largest λ \[N or N m], ≥ `lower`; ∞ for none.
    pub upper: f64,
}

impl RowBounds {
    /// Sign of the violation φ of a one-sided row where it is closed: 1 of what only pulls (λ ≤ 0), −1 of what only pushes;
    /// 0 of all others.
    #[must_use]
    pub fn side(&self) -> f64 {
        match (self.lower == 0.0, self.upper == 0.0) {
            (false, true) => 1.0,
            (true, false) => -1.0,
            _ => 0.0,
        }
    }
}

/// Violations, laws and Jacobian of all constraints of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct Linearized {
    /// First row of each constraint; length constraints + 1.
    pub row_start: Vec<usize>,
    /// First slot of each constraint; length constraints + 1.
    pub slot_start: Vec<usize>,
    /// Blocks of the Jacobian, constraint by constraint, in the order of the sides; world sides have none.
    pub slots: Vec<Slot>,
    /// Violations φ at t, one a row \[m or rad].
    pub phi: Aligned,
    /// ∂φ/∂t of prescribed motions, as the mean over \[t, t_next], one a row \[m/s or rad/s].
    pub phi_t: Aligned,
    /// Compliances ε, one a row \[m/N or rad/(N m)]. Those of transverse rows are zero until the time stepper sets
    /// them: see [`Transverse`].
    pub compliance: Aligned,
    /// Damping times τ, one a row \[s].
    pub damping: Aligned,
    /// The blocks of the constraints that are no [joints](Linearized::joints), rows × 6 numbers each, row by row, see
    /// [`Slot::offset`]; any block, with its units, is [`Linearized::block`].
    pub jacobian: Vec<f64>,
    /// Lever arms of these constraints' slots, zeros for all other slots.
    levers: Vec<Vector3<f64>>,
    /// Links with transverse rows, in the order of the scene.
    pub transverse: Vec<Transverse>,
    /// Rows with bounds, in the order of the scene; at most one of a constraint.
    pub bounds: Vec<RowBounds>,
    /// A massless cable that had no way over its sheaves in some update, its φ being NaN then, and why; until it is taken.
    pub lost: Option<(usize, &'static str)>,
    /// The joints' part of the Jacobian.
    pub(crate) packs: Packs,
    /// Constraints that are not joints.
    others: Vec<usize>,
}

const ANOTHER_TOPOLOGY: &str = "has another topology than at Linearized::new";

impl Linearized {
    /// Sizes and slots from the scene's topology; all values are zero until [`Linearized::update`]. Allocates: yes.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let mut lin = Self {
            row_start: vec![0],
            slot_start: vec![0],
            ..Self::default()
        };
        let (mut rows, mut values) = (0, 0);
        for (constraint, c) in scene.constraints.iter().enumerate() {
            if c.parts().any(|(kind, ..)| kind == RowKind::Transverse) {
                lin.transverse.push(Transverse {
                    length_row: rows,
                    first_row: rows + 1,
                    distance: 0.0,
                });
            }
            if let Some((row, lower, upper)) = c.bounds(0.0) {
                lin.bounds.push(RowBounds {
                    row: rows + row,
                    constraint,
                    lower,
                    upper,
                });
            }
            rows += c.rows();
            let joint = Packs::holds(c);
            for body in c.bodies() {
                let offset = if joint { usize::MAX } else { values };
                lin.slots.push(Slot {
                    constraint,
                    body,
                    offset,
                });
                values += if joint { 0 } else { 6 * c.rows() };
            }
            lin.row_start.push(rows);
            lin.slot_start.push(lin.slots.len());
        }
        lin.packs = Packs::new(scene, &lin.row_start, &lin.slot_start);
        let other = |c: &usize| !Packs::holds(&scene.constraints[*c]);
        lin.others = (0..scene.constraints.len()).filter(other).collect();
        lin.phi = Aligned::new(rows);
        lin.phi_t = Aligned::new(rows);
        lin.compliance = Aligned::new(rows);
        lin.damping = Aligned::new(rows);
        lin.jacobian = vec![0.0; values];
        lin.levers = vec![Vector3::zeros(); lin.slots.len()];
        lin
    }

    /// Evaluates φ, J and the laws of all constraints at time `t` (s). Cost: O(rows). Allocates: no.
    ///
    /// # Panics
    /// When the scene's constraints do not have the rows and bodies that [`Linearized::new`] saw.
    pub fn update(&mut self, scene: &Scene, t: f64) {
        assert_eq!(
            scene.constraints.len(),
            self.constraints(),
            "the scene has another number of constraints than at Linearized::new"
        );
        for (i, c) in scene.constraints.iter().enumerate() {
            let rows = self.row_range(i);
            let found = (c.rows(), c.bodies().count());
            assert_eq!(
                (rows.len(), self.slot_range(i).len()),
                found,
                "constraint {i} {ANOTHER_TOPOLOGY}"
            );
            let mut row = rows.start;
            for (_, count, law) in c.parts() {
                self.compliance[row..row + count].fill(law.compliance);
                self.damping[row..row + count].fill(law.damping);
                row += count;
            }
        }
        self.packs.refresh(scene);
        self.update_state(scene, t);
    }

    /// [`Linearized::update`] where the scene is the one of the last update but for its bodies, what time changes, and
    /// its windings, if [`Linearized::follow_windings`] alone changed them: frames and laws of joints stay.
    ///
    /// # Panics
    /// As [`Linearized::update`].
    pub fn update_state(&mut self, scene: &Scene, t: f64) {
        self.packs.evaluate(scene, t, &mut self.phi);
        let (mut links, mut bounded) = (0, 0);
        for k in 0..self.others.len() {
            let i = self.others[k];
            let (c, rows) = (&scene.constraints[i], self.row_range(i));
            let distance = self.evaluate(scene, i, t);
            if let Constraint::MasslessCable(cable) = c
                && self.phi[rows.start].is_nan()
            {
                self.lost = cable.lost(&scene.bodies, t).map(|reason| (i, reason));
            }
            let factor = c.compliance_factor(t, self.phi[rows.start]);
            let mut row = rows.start;
            for (kind, count, law) in c.parts() {
                if kind == RowKind::Transverse {
                    let link = self.transverse.get_mut(links);
                    let link = link.filter(|link| link.first_row == row);
                    link.unwrap_or_else(|| panic!("constraint {i} {ANOTHER_TOPOLOGY}"))
                        .distance = distance;
                    links += 1;
                }
                self.compliance[row..row + count].fill(law.compliance * factor);
                row += count;
            }
            if let Some((row, lower, upper)) = c.bounds(t) {
                let bound = self.bounds.get_mut(bounded);
                let bound = bound.filter(|bound| bound.row == rows.start + row);
                let bound = bound.unwrap_or_else(|| panic!("constraint {i} {ANOTHER_TOPOLOGY}"));
                (bound.lower, bound.upper) = (lower, upper);
                bounded += 1;
            }
        }
        let found = (links, bounded);
        let known = (self.transverse.len(), self.bounds.len());
        assert_eq!(found, known, "a constraint {ANOTHER_TOPOLOGY}");
    }

    /// φ, J and lever arms of one constraint; the distance that a link measures.
    fn evaluate(&mut self, scene: &Scene, i: usize, t: f64) -> f64 {
        let c = &scene.constraints[i];
        let (rows, slots) = (self.row_range(i), self.slot_range(i));
        let start = self.slots.get(slots.start).map_or(0, |s| s.offset);
        let blocks = &mut self.jacobian[start..start + 6 * rows.len() * slots.len()];
        let levers = if c.acts_at_points() {
            &mut self.levers[slots]
        } else {
            &mut []
        };
        let mut out = Rows::new(&mut self.phi[rows], blocks, levers);
        c.evaluate(&scene.bodies, t, &mut out);
        out.distance
    }

    /// [`update_windings`] by the angles of the last [`Linearized::update`] or
    /// [`update_state`](Linearized::update_state), which was at the scene's present state at time `t` (s). The reference of
    /// a joint stays while the twist is within 0.01 rad of it, and unwraps it to the same angle. Whether some rows are
    /// evaluated otherwise after that: those of cables over sheaves.
    ///
    /// # Panics
    /// As [`Linearized::update`].
    pub fn follow_windings(&mut self, scene: &mut Scene, t: f64) -> bool {
        self.packs.follow_windings(scene, &self.phi);
        let mut changed = false;
        for &i in &self.others {
            changed |= scene.constraints[i].update_winding(&scene.bodies, t);
        }
        scene.recut(t);
        changed
    }

    /// Evaluates ∂φ/∂t of the prescribed motions as the mean over \[`t`, `t_next`] (s) with the bodies held; zero when
    /// `t_next == t` or nothing is driven. Cost: O(rows). Allocates: no.
    ///
    /// # Panics
    /// As [`Linearized::update`].
    pub fn drive(&mut self, scene: &Scene, t: f64, t_next: f64) {
        // Joints between bodies have none, and keep their zeros.
        for i in self.packs.held().chain(self.others.iter().copied()) {
            let rows = self.row_start[i]..self.row_start[i + 1];
            let phi_t = &mut self.phi_t[rows];
            scene.constraints[i].drive(&scene.bodies, t, t_next, phi_t);
        }
    }

    /// r = J v, one a row, for the velocities `v` \[v, ω] of the bodies, zero for the world. Cost: O(rows). Allocates: no.
    ///
    /// # Panics
    /// When `v` or `r` is of another scene's size.
    pub fn times_jacobian(&self, v: &BodyVectors, r: &mut [f64]) {
        self.packs.times_jacobian([v], r);
        self.times_other_jacobians([v], r);
    }

    /// r = J (v + Δv).
    ///
    /// # Panics
    /// As [`Linearized::times_jacobian`].
    pub fn times_jacobian_of_sum(&self, v: [&BodyVectors; 2], r: &mut [f64]) {
        self.packs.times_jacobian(v, r);
        self.times_other_jacobians(v, r);
    }

    /// The rows of constraints that are no joints.
    fn times_other_jacobians<const N: usize>(&self, v: [&BodyVectors; N], r: &mut [f64]) {
        for &c in &self.others {
            r[self.row_range(c)].fill(0.0);
        }
        for slot in self.other_slots() {
            let r = &mut r[self.row_range(slot.constraint)];
            let (jacobian, _) = self.jacobian[slot.offset..].as_chunks::<6>();
            let mut sum = v[0].get(slot.body);
            for v in &v[1..] {
                for (sum, v) in sum.iter_mut().zip(v.get(slot.body)) {
                    *sum += v;
                }
            }
            for (j, r) in jacobian.iter().zip(r) {
                *r += dot(j, &sum);
            }
        }
    }

    /// p += Jᵀ μ, `mu` one a row; what acts on the world is added there. Cost: O(rows). Allocates: no.
    ///
    /// # Panics
    /// As [`Linearized::times_jacobian`].
    pub fn add_transposed(&self, mu: &[f64], p: &mut BodyVectors) {
        self.packs.add_transposed(mu, p);
        for slot in self.other_slots() {
            let mu = &mu[self.row_range(slot.constraint)];
            let (jacobian, _) = self.jacobian[slot.offset..].as_chunks::<6>();
            for (j, mu) in jacobian.iter().zip(mu) {
                p.add(slot.body, j.map(|j| j * mu));
            }
        }
    }

    /// The slots of the constraints that are no joints.
    fn other_slots(&self) -> impl Iterator<Item = &Slot> {
        let others = self.others.iter();
        others.flat_map(|&c| &self.slots[self.slot_range(c)])
    }

    /// The joints: constraints with three gap rows and up to three angular ones between two sides, in the order of the
    /// scene. Their Jacobian is stored by lever arms and gradients, in packs of eight.
    #[must_use]
    pub fn joints(&self) -> &[Joint] {
        self.packs.joints()
    }

    /// The joints, `L` at a time, four or eight, for kernels.
    #[inline(always)]
    pub fn joint_lanes<const L: usize>(&self) -> impl Iterator<Item = JointLanes<'_, L>> {
        self.packs.lanes()
    }

    /// The sides of any joints, each given by the number of the joint and its side, 0 or 1.
    ///
    /// # Panics
    /// When there is no such joint.
    #[inline(always)]
    #[must_use]
    pub fn joint_sides<V: Lanes, const L: usize>(
        &self,
        sides: [(usize, usize); L],
    ) -> JointSide<V> {
        self.packs.sides(sides)
    }

    /// Joint and side of a slot; `None` if its constraint is not a joint.
    #[must_use]
    pub fn joint_of_slot(&self, slot: usize) -> Option<(usize, usize)> {
        self.packs.of_slot(slot)
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.phi.len()
    }

    /// Number of constraints.
    #[must_use]
    pub fn constraints(&self) -> usize {
        self.row_start.len().saturating_sub(1)
    }

    /// The constraints that are not [joints](Linearized::joints).
    #[must_use]
    pub fn others(&self) -> &[usize] {
        &self.others
    }

    /// Rows of constraint `i`.
    ///
    /// # Panics
    /// When `i` is not below [`Linearized::constraints`].
    #[must_use]
    pub fn row_range(&self, i: usize) -> Range<usize> {
        self.row_start[i]..self.row_start[i + 1]
    }

    /// Indices into [`Linearized::slots`] of constraint `i`.
    ///
    /// # Panics
    /// When `i` is not below [`Linearized::constraints`].
    #[must_use]
    pub fn slot_range(&self, i: usize) -> Range<usize> {
        self.slot_start[i]..self.slot_start[i + 1]
    }

    /// The Jacobian block of slot `slot`, rows × 6, row-major.
    ///
    /// # Panics
    /// When `slot` is not below the number of slots.
    #[inline]
    #[must_use]
    pub fn block(&self, slot: usize) -> Block<'_> {
        let at = &self.slots[slot];
        let count = self.row_range(at.constraint).len();
        Block(match self.packs.of_slot(slot) {
            Some((joint, side)) => Rows6::Copied(self.packs.block(joint, side), count),
            None => Rows6::Stored(&self.jacobian[at.offset..].as_chunks().0[..count]),
        })
    }

    /// Lever arm of slot `slot`, world \[m]: from the body's centre to the point of the force that turns with the body. Geometric
    /// stiffness is made of it. Of a joint's gap, and of a force along a link, that point is the attachment point, although J of
    /// a link is the same for its other end; on the side of a slider or fairlead that guides the other one it is where the other
    /// one is. Zero where no force acts at a point.
    ///
    /// # Panics
    /// When `slot` is not below the number of slots.
    #[must_use]
    pub fn lever(&self, slot: usize) -> Vector3<f64> {
        match self.packs.of_slot(slot) {
            Some((joint, side)) => self.packs.arm(joint, side),
            None => self.levers[slot],
        }
    }
}

/// a · b, summed in two halves: a shorter chain of additions.
#[inline]
#[must_use]
pub fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5])
}

/// Moves each twist row's unwrapping reference to its present value at time `t` (s): call it after each accepted step,
/// so that twist is followed through any number of turns. Linearising itself changes nothing. Allocates: no.
///
/// # Panics
/// When a constraint names a body that is not there.
pub fn update_windings(scene: &mut Scene, t: f64) {
    for c in &mut scene.constraints {
        c.update_winding(&scene.bodies, t);
    }
    scene.recut(t);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    impl Linearized {
        /// Rows of a scene in its state at the time `t` (s).
        pub(crate) fn at(scene: &Scene, t: f64) -> Self {
            let mut rows = Self::new(scene);
            rows.update(scene, t);
            rows
        }
    }

    fn hoist() -> Scene {
        let params = HoistParams::default()
            .with(|p| (p.segments, p.seed, p.initial_angle) = (3, 4, 0.4))
            .with(|p| (p.anchor, p.damping, p.move_x) = (End::Clamped, 0.02, 0.5));
        params.build().expect("builds")
    }

    /// J v of one row.
    fn rate(lin: &Linearized, scene: &Scene, constraint: usize, row: usize) -> f64 {
        let slots = lin.slot_range(constraint);
        slots
            .map(|s| {
                let block = &lin.block(s)[6 * row..6 * row + 6];
                let body = lin.slots[s].body;
                let v = Vector3::from_column_slice(&block[..3]).dot(&scene.bodies.velocity[body]);
                let omega = &scene.bodies.angular_velocity[body];
                v + Vector3::from_column_slice(&block[3..]).dot(omega)
            })
            .sum()
    }

    #[test]
    fn layout_follows_the_topology() {
        let lin = Linearized::new(&hoist());
        assert_eq!(lin.row_start, [0, 6, 12, 18, 21]);
        assert_eq!(lin.slot_start, [0, 1, 3, 5, 7]);
        assert_eq!((lin.rows(), lin.constraints()), (21, 4));
        assert_eq!(lin.slots[1].body, 0);
        assert!(lin.jacobian.is_empty(), "all are joints");
        assert_eq!(lin.block(1).len(), 36);
        assert_eq!(lin.block(6).len(), 18);
    }

    #[test]
    fn jacobian_and_drive_predict_the_change_of_phi() {
        let mut scene = hoist();
        for (i, v) in scene.bodies.velocity.iter_mut().enumerate() {
            *v = Vector3::new(0.3, -0.1, 0.2) * (1.0 + i as f64);
        }
        let (t, dt) = (0.5, 1e-6);
        let mut lin = Linearized::at(&scene, t);
        lin.drive(&scene, t, t + dt);
        let mut next = scene.clone();
        for i in 0..next.bodies.len() {
            next.bodies.position[i] += next.bodies.velocity[i] * dt;
            let turn =
                nalgebra::UnitQuaternion::from_scaled_axis(scene.bodies.angular_velocity[i] * dt);
            next.bodies.orientation[i] = turn * next.bodies.orientation[i];
        }
        let mut after = lin.clone();
        after.update(&next, t + dt);
        after.drive(&next, t + dt, t + dt);
        for c in 0..lin.constraints() {
            for (row, k) in lin.row_range(c).enumerate() {
                let change = (after.phi[k] - lin.phi[k]) / dt;
                let predicted = rate(&lin, &scene, c, row) + lin.phi_t[k];
                let off = (change - predicted).abs();
                assert!(off < 1e-6, "{c} {row}: {change} {predicted}");
            }
        }
        assert!(lin.phi_t[0] > 0.9, "the anchor moves at 15/8 of 0.5 m/s");
        assert!(after.phi_t.iter().all(|rate| *rate == 0.0));
    }

    #[test]
    fn laws_are_those_of_the_rows() {
        let scene = hoist();
        let lin = Linearized::at(&scene, 0.0);
        for (i, c) in scene.constraints.iter().enumerate() {
            for (k, row) in lin.row_range(i).enumerate() {
                assert_eq!(lin.compliance[row], c.row(k).1.compliance);
                assert_eq!(lin.damping[row], 0.02);
            }
            assert!(c.rows() <= MAX_ROWS);
        }
    }

    #[test]
    fn vertical_cable_has_exact_zeros_across() {
        for joint in [JointKind::Cosserat, JointKind::Paper, JointKind::Spherical] {
            let scene = HoistParams::default().with(|p| p.joint = joint);
            let scene = scene.hanging_equilibrium().expect("builds");
            let lin = Linearized::at(&scene, 0.0);
            for i in 0..lin.constraints() {
                for (k, row) in lin.row_range(i).enumerate() {
                    if k != 2 {
                        assert_eq!(lin.phi[row], 0.0, "{joint:?} row {k}");
                    }
                }
            }
        }
    }

    #[test]
    fn transverse_rows_are_found_among_others() {
        let chain = crate::ParticleChainParams {
            particles: 3,
            transverse: true,
            ..Default::default()
        };
        let mut scene = chain.build().expect("builds");
        if let crate::Constraint::Distance(link) = &mut scene.constraints[1] {
            link.transverse = false;
        }
        let mut lin = Linearized::at(&scene, 0.0);
        assert_eq!(lin.row_start, [0, 3, 4, 7]);
        let rows: Vec<_> = lin.transverse.iter().map(Transverse::rows).collect();
        assert_eq!(rows, [1..3, 5..7]);
        assert_eq!(lin.transverse[1].length_row, 4);
        assert!(lin.transverse.iter().all(|link| link.distance == 1.0));
        // Setting the compliances lasts until the next update.
        for link in &lin.transverse {
            lin.compliance[link.rows()].fill(link.distance / 50.0);
        }
        assert_eq!(lin.compliance[1..3], [0.02, 0.02]);
        lin.update(&scene, 0.0);
        assert_eq!(lin.compliance[1..3], [0.0, 0.0]);
    }

    #[test]
    #[should_panic(expected = "another topology")]
    fn another_kind_with_as_many_rows_is_refused() {
        let chain = crate::ParticleChainParams {
            transverse: true,
            ..Default::default()
        };
        let mut scene = chain.build().expect("builds");
        let mut lin = Linearized::new(&scene);
        scene.constraints[4] = crate::Constraint::Spherical(crate::Spherical {
            frames: scene.constraints[4].frames().try_into().expect("two sides"),
            stretch: crate::RowLaw::RIGID,
        });
        lin.update(&scene, 0.0);
    }

    #[test]
    #[should_panic(expected = "another topology")]
    fn changed_rows_are_refused() {
        let mut scene = hoist();
        let mut lin = Linearized::new(&scene);
        if let crate::Constraint::Cosserat(c) = &mut scene.constraints[1] {
            c.law.twist = None;
        }
        lin.update(&scene, 0.0);
    }
}
