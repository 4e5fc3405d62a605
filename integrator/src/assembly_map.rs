//! Assembly maps of the linear system: block patterns and index maps of a topology, computed once.

use crate::Form;
use crate::assembly::{Assembly, Coupling};
use crate::inertia::Inertia;
use crate::regularization::Regularization;
use std::sync::Arc;
use taut_model::BodyVectors;
use taut_model::body_vectors::unpacked;
use taut_model::linearized::dot;
use taut_model::{Linearized, MAX_ROWS, Scene};
use taut_solver::{BlockPattern, SolveError, SymBlockMatrix};

/// Owner of a block row of the linear system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BlockOf {
    Body(usize),
    Constraint(usize),
}

/// Pattern and maps of one form of the linear system.
#[derive(Debug, Clone)]
pub(crate) struct AssemblyMap {
    pub(crate) pattern: Arc<BlockPattern>,
    /// Owner of each block row.
    pub(crate) block: Vec<BlockOf>,
    /// Block row of each constraint.
    constraint: Vec<usize>,
    /// True if the system's rows are the scene's, in their own order: the Schur form of a cable.
    pub(crate) in_scene_order: bool,
    maps: Maps,
}

#[derive(Debug, Clone)]
enum Maps {
    /// The joints' own blocks, and the contributions W_s J_tᵀ of all others to stored blocks.
    Schur {
        joints: Assembly,
        /// Stored blocks that products alone are added into.
        cleared: Vec<usize>,
        /// Slots that products read W of.
        weighted: Vec<usize>,
        products: Vec<Product>,
        /// W = J M̃⁻¹ of these slots, each with room for as many rows as there can be.
        w: Vec<f64>,
    },
    /// Stored diagonal block of each body; stored block of each slot, none where the body is static or driven.
    Kkt {
        body: Vec<usize>,
        slot: Vec<Option<usize>>,
    },
}

/// Stored block `target` receives W of the slot that is number `left` of those weighted, times Jᵀ of slot `right`.
#[derive(Debug, Clone, Copy)]
struct Product {
    target: usize,
    left: usize,
    right: usize,
}

/// Numbers of W a slot.
const W: usize = 6 * MAX_ROWS;

impl AssemblyMap {
    /// The constraints stand in `order` (position → constraint), each of them once.
    pub(crate) fn new(
        form: Form,
        scene: &Scene,
        rows: &Linearized,
        order: &[usize],
    ) -> Result<Self, SolveError> {
        match form {
            Form::Schur => Self::schur(scene, rows, order),
            Form::Kkt => Self::kkt(scene, rows, order),
        }
    }

    /// One block row a constraint; two are coupled where they act on the same dynamic body.
    fn schur(scene: &Scene, rows: &Linearized, order: &[usize]) -> Result<Self, SolveError> {
        let sizes: Vec<usize> = order.iter().map(|&c| rows.row_range(c).len()).collect();
        let mut place = vec![0; order.len()];
        for (k, &c) in order.iter().enumerate() {
            place[c] = k;
        }
        let block_of = |s: usize| place[rows.slots[s].constraint];
        let mut slots_of_body = vec![Vec::new(); scene.bodies.len()];
        for (s, slot) in rows.slots.iter().enumerate() {
            if scene.bodies.is_dynamic(slot.body) {
                slots_of_body[slot.body].push(s);
            }
        }
        // All ordered pairs of slots at a body whose block lies in the lower triangle.
        let mut pairs = Vec::new();
        for slots in &slots_of_body {
            for &left in slots {
                let lower = slots.iter().filter(|&&r| block_of(r) <= block_of(left));
                pairs.extend(lower.map(|&right| (left, right)));
            }
        }
        pairs.sort_unstable();
        let couplings: Vec<_> = pairs
            .iter()
            .map(|&(l, r)| (block_of(l), block_of(r)))
            .collect();
        let groups = order.iter().map(|&c| scene.groups[c]).collect();
        let pattern = BlockPattern::new(&sizes, &couplings)?.with_groups(groups)?;
        let maps = schur_maps(rows, &pattern, &place, &pairs);
        Ok(Self {
            pattern: Arc::new(pattern),
            block: order.iter().copied().map(BlockOf::Constraint).collect(),
            in_scene_order: order.iter().copied().eq(0..order.len()),
            constraint: place,
            maps,
        })
    }

    /// Bodies, six rows each and three of a point mass, and constraints, each body just before the first constraint that
    /// acts on it: in this order no pivot rests on Σ alone, so that rigid rows (Σ = 0) have one too.
    fn kkt(scene: &Scene, rows: &Linearized, order: &[usize]) -> Result<Self, SolveError> {
        let mut block = Vec::new();
        let mut body_block = vec![usize::MAX; scene.bodies.len()];
        let mut constraint_block = vec![0; order.len()];
        for &c in order {
            for slot in &rows.slots[rows.slot_range(c)] {
                if body_block[slot.body] == usize::MAX {
                    body_block[slot.body] = block.len();
                    block.push(BlockOf::Body(slot.body));
                }
            }
            constraint_block[c] = block.len();
            block.push(BlockOf::Constraint(c));
        }
        for (i, b) in body_block
            .iter_mut()
            .enumerate()
            .filter(|(_, b)| **b == usize::MAX)
        {
            *b = block.len();
            block.push(BlockOf::Body(i));
        }
        let sizes: Vec<usize> = block
            .iter()
            .map(|b| match b {
                BlockOf::Body(i) if scene.bodies.is_point(*i) => 3,
                BlockOf::Body(_) => 6,
                BlockOf::Constraint(c) => rows.row_range(*c).len(),
            })
            .collect();
        let place = |s: &taut_model::Slot| (constraint_block[s.constraint], body_block[s.body]);
        let dynamic = |s: &&taut_model::Slot| scene.bodies.is_dynamic(s.body);
        let couplings: Vec<_> = rows.slots.iter().filter(dynamic).map(place).collect();
        let pattern = BlockPattern::new(&sizes, &couplings)?;
        let slot = rows
            .slots
            .iter()
            .map(|s| pattern.find(place(s).0, place(s).1))
            .collect();
        let body = body_block
            .iter()
            .map(|&b| pattern.column(b).start)
            .collect();
        Ok(Self {
            pattern: Arc::new(pattern),
            block,
            constraint: constraint_block,
            in_scene_order: false,
            maps: Maps::Kkt { body, slot },
        })
    }

    /// Fills the matrix.
    pub(crate) fn fill(
        &mut self,
        rows: &Linearized,
        inertia: &Inertia,
        regularization: &Regularization,
        a: &mut SymBlockMatrix,
    ) {
        match &mut self.maps {
            Maps::Schur {
                joints,
                cleared,
                weighted,
                products,
                w,
            } => {
                for &k in &*cleared {
                    a.block_mut(k).fill(0.0);
                }
                joints.fill(rows, inertia, &regularization.sigma, a);
                fill_w(rows, inertia, weighted, w);
                for p in &*products {
                    let left = rows.slots[weighted[p.left]].constraint;
                    let m = rows.row_range(left).len();
                    let left = &w[W * p.left..][..6 * m];
                    add_product(left, &rows.block(p.right), a.block_mut(p.target));
                }
                for &c in rows.others() {
                    let sigma = &regularization.sigma[rows.row_range(c)];
                    let diagonal = a.block_mut(self.pattern.column(self.constraint[c]).start);
                    for (r, s) in sigma.iter().enumerate() {
                        diagonal[r * (sigma.len() + 1)] += s;
                    }
                }
            }
            Maps::Kkt { body, slot } => {
                a.values_mut().fill(0.0);
                for (i, &k) in body.iter().enumerate() {
                    let (block, angular) = (a.block_mut(k), unpacked(inertia.angular.get(i)));
                    let is_point = block.len() == 9;
                    for r in 0..3 {
                        if is_point {
                            block[4 * r] = inertia.mass[i];
                            continue;
                        }
                        block[7 * r] = inertia.mass[i];
                        for c in 0..3 {
                            block[(3 + r) + 6 * (3 + c)] = angular[(r, c)];
                        }
                    }
                }
                for (s, k) in slot.iter().enumerate() {
                    let Some(k) = *k else {
                        continue;
                    };
                    let n = rows.row_range(rows.slots[s].constraint).len();
                    let block = a.block_mut(k);
                    // Two slots of a constraint on one body share a block, which has three columns for a point mass.
                    for (r, row) in rows.block(s).rows().iter().enumerate() {
                        for (column, j) in block.chunks_exact_mut(n).zip(row) {
                            column[r] += j;
                        }
                    }
                }
                for (c, &block) in self.constraint.iter().enumerate() {
                    let sigma = &regularization.sigma[rows.row_range(c)];
                    let diagonal = a.block_mut(self.pattern.column(block).start);
                    for (r, s) in sigma.iter().enumerate() {
                        diagonal[r * (sigma.len() + 1)] = -s;
                    }
                }
            }
        }
    }

    /// A vector of the system from the bodies' part, if it has one, and `sign` times the rows' part.
    pub(crate) fn gather(
        &self,
        rows: &Linearized,
        bodies: Option<&BodyVectors>,
        multipliers: &[f64],
        sign: f64,
        b: &mut [f64],
    ) {
        if self.in_scene_order && sign == 1.0 {
            b.copy_from_slice(multipliers);
            return;
        }
        for (k, block) in self.block.iter().enumerate() {
            let to = &mut b[self.pattern.rows(k)];
            match *block {
                BlockOf::Body(i) => {
                    let six = bodies.map_or([0.0; 6], |b| b.get(i));
                    to.copy_from_slice(&six[..to.len()]);
                }
                BlockOf::Constraint(c) => {
                    for (to, from) in to.iter_mut().zip(&multipliers[rows.row_range(c)]) {
                        *to = sign * from;
                    }
                }
            }
        }
    }

    /// The multipliers' part of a solution times `sign`, and back in [`gather`](Self::gather)'s order.
    pub(crate) fn scatter_multipliers(
        &self,
        rows: &Linearized,
        x: &[f64],
        sign: f64,
        multipliers: &mut [f64],
    ) {
        if self.in_scene_order && sign == 1.0 {
            multipliers.copy_from_slice(x);
            return;
        }
        for (k, block) in self.block.iter().enumerate() {
            if let BlockOf::Constraint(c) = *block {
                for (to, from) in multipliers[rows.row_range(c)]
                    .iter_mut()
                    .zip(&x[self.pattern.rows(k)])
                {
                    *to = sign * from;
                }
            }
        }
    }
}

/// Who writes which block: diagonal blocks of joints and blocks that couple two joints through one body are written in
/// lanes; the rest are sums of products.
fn schur_maps(
    rows: &Linearized,
    pattern: &BlockPattern,
    place: &[usize],
    pairs: &[(usize, usize)],
) -> Maps {
    let block_of = |s: usize| place[rows.slots[s].constraint];
    let diagonal = |c: usize| pattern.values(pattern.column(place[c]).start).start;
    let joints = rows.joints().iter();
    let mut written = vec![false; pattern.stored_blocks()];
    for joint in rows.joints() {
        written[pattern.column(place[joint.constraint]).start] = true;
    }
    let (mut couplings, mut products, mut weighted) = (Vec::new(), Vec::new(), Vec::new());
    for &(left, right) in pairs {
        let (row, column) = (block_of(left), block_of(right));
        let Some(target) = pattern.find(row, column) else {
            continue;
        };
        match (rows.joint_of_slot(left), rows.joint_of_slot(right)) {
            (Some(_), Some(_)) if row == column => {}
            (Some(left_side), Some(right_side)) if !written[target] => {
                written[target] = true;
                couplings.push(Coupling {
                    sides: [left_side, right_side],
                    body: rows.slots[left].body,
                    target: pattern.values(target).start,
                });
            }
            _ => {
                weighted.push(left);
                products.push(Product {
                    target,
                    left,
                    right,
                });
            }
        }
    }
    weighted.sort_unstable();
    weighted.dedup();
    for p in &mut products {
        p.left = weighted.partition_point(|&s| s < p.left);
    }
    Maps::Schur {
        joints: Assembly::new(
            rows.joints(),
            joints.map(|j| diagonal(j.constraint)),
            couplings,
        ),
        cleared: (0..written.len()).filter(|&k| !written[k]).collect(),
        w: vec![0.0; W * weighted.len()],
        weighted,
        products,
    }
}

/// W = J M̃⁻¹ of some slots, one after the other.
fn fill_w(rows: &Linearized, inertia: &Inertia, slots: &[usize], w: &mut [f64]) {
    for (&s, w) in slots.iter().zip(w.chunks_exact_mut(W)) {
        let (w, _) = w.as_chunks_mut::<6>();
        for (j, w) in rows.block(s).rows().iter().zip(w) {
            inertia.apply_inverse(rows.slots[s].body, j, w);
        }
    }
}

/// A += W Jᵀ for row-major m×6 W and n×6 J, column-major m×n A.
#[inline]
fn add_product(w: &[f64], j: &[f64], a: &mut [f64]) {
    let ((w, _), (j, _)) = (w.as_chunks::<6>(), j.as_chunks::<6>());
    for (column, j) in a.chunks_exact_mut(w.len().max(1)).zip(j) {
        for (a, w) in column.iter_mut().zip(w) {
            *a += dot(w, j);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    /// J M̃⁻¹ Jᵀ of two constraints, or with `absolute` the same of the absolute values of all numbers in it, row by row.
    fn product(stepper: &Stepper, pair: [usize; 2], absolute: bool) -> Vec<f64> {
        let rows = &stepper.step.system_data.rows;
        let inertia = &stepper.step.system_data.inertia;
        let number = |x: f64| if absolute { x.abs() } else { x };
        let [left, right] = pair.map(|c| rows.slot_range(c));
        let [m, n] = pair.map(|c| rows.row_range(c).len());
        let mut sum = vec![0.0; m * n];
        for (s, t) in left.flat_map(|s| right.clone().map(move |t| (s, t))) {
            let body = rows.slots[s].body;
            if body != rows.slots[t].body {
                continue;
            }
            let w = inertia.inverse_mass[body];
            let a = unpacked(inertia.inverse_angular.get(body));
            for (r, left) in rows.block(s).rows().iter().enumerate() {
                for (c, right) in rows.block(t).rows().iter().enumerate() {
                    let to = &mut sum[n * r + c];
                    for i in 0..3 {
                        *to += number(left[i] * w * right[i]);
                        for k in 0..3 {
                            *to += number(left[3 + i] * a[(i, k)] * right[3 + k]);
                        }
                    }
                }
            }
        }
        sum
    }

    /// Whatever writes a block, it is J M̃⁻¹ Jᵀ + Σ as the blocks of J have it: cables, branches, loops, joints of every
    /// number of rows, two joints between the same bodies, in the orders of elimination.
    #[test]
    fn the_assembled_matrix_is_the_product_of_its_pieces() {
        let mut scenes: Vec<Scene> = [
            "hoist",
            "gantry",
            "ring",
            "junction",
            "cranes",
            "net",
            "particles-b",
            "particles-f",
        ]
        .map(|name| named(name).unwrap())
        .into();
        for joint in [JointKind::Spherical, JointKind::Paper] {
            let cable = HoistParams::default().with(|p| (p.segments, p.joint) = (6, joint));
            scenes.push(cable.build().unwrap());
        }
        let mut doubled = named("hoist").unwrap();
        for k in [2, 3, 7] {
            let twin = doubled.constraints[k].clone();
            doubled.add_constraint(format!("twin of {k}"), twin, 0);
        }
        scenes.push(doubled);
        for scene in scenes {
            let name = scene.name.clone();
            let mut stepper = Stepper::new(scene, StepOptions::default()).unwrap();
            stepper.steps(20);
            stepper
                .step
                .linearize(stepper.step.options.stiffness)
                .unwrap();
            stepper.step.assemble(stepper.step.options.dt);
            let assembly_map = &stepper.step.system.assembly_map;
            let sigma = &stepper.step.system_data.regularization.sigma;
            let constraints: Vec<usize> = (assembly_map.block.iter())
                .map(|b| match b {
                    BlockOf::Constraint(c) => *c,
                    BlockOf::Body(_) => unreachable!("a Schur form has constraints alone"),
                })
                .collect();
            for (j, &column) in constraints.iter().enumerate() {
                for (i, &row) in constraints.iter().enumerate().skip(j) {
                    let n = stepper.step.system_data.rows.row_range(column).len();
                    let exact = product(&stepper, [row, column], false);
                    let size = product(&stepper, [row, column], true);
                    for (k, (exact, size)) in exact.iter().zip(&size).enumerate() {
                        let (r, c) = (k / n, k % n);
                        let on_diagonal = (i, r) == (j, c);
                        let first = stepper.step.system_data.rows.row_range(row).start;
                        let sigma = if on_diagonal { sigma[first + r] } else { 0.0 };
                        let at =
                            |block: usize, k: usize| assembly_map.pattern.rows(block).start + k;
                        let found = stepper.step.system.matrix.get(at(i, r), at(j, c));
                        let error = (found - (exact + sigma)).abs();
                        assert!(
                            error <= 16.0 * f64::EPSILON * (size + sigma),
                            "{name}: row {r} of {row}, column {c} of {column}: {found:e}, not {exact:e} + {sigma:e}"
                        );
                    }
                }
            }
        }
    }
}
