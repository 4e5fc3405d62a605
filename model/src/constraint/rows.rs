//! Destination of the rows that constraints evaluate.

use nalgebra::Vector3;

use super::JointLaw;
use super::cosserat::{BendTwist, columns};
use super::gap;
use super::gap::{JointJacobian, joined, row_along};
use crate::body::Bodies;
use crate::frame::{Frame, Resolved};

/// Destination of one constraint: φ; the blocks of its moving sides one after the other (rows × 6,
/// row-major, columns \[linear, angular]), or that of one side alone; their lever arms. Blocks and
/// levers may be left out.
pub(crate) struct Rows<'a> {
    pub(super) phi: &'a mut [f64],
    blocks: &'a mut [f64],
    levers: &'a mut [Vector3<f64>],
    /// The side whose block is written, moving or not, where it is one alone.
    only: Option<usize>,
    /// Starts of the blocks of a joint's two sides; `None` for a side without one.
    starts: [Option<usize>; 2],
    next: usize,
    /// J of a joint whose rows are a gap and up to three angles.
    pub(crate) joint: JointJacobian<f64>,
    /// |p_a − p_b| \[m], written by a kind with transverse rows.
    pub(crate) distance: f64,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(
        phi: &'a mut [f64],
        blocks: &'a mut [f64],
        levers: &'a mut [Vector3<f64>],
    ) -> Self {
        Self {
            phi,
            blocks,
            levers,
            only: None,
            starts: [None; 2],
            next: 0,
            joint: JointJacobian {
                arms: [[0.0; 3]; 2],
                gradients: [[0.0; 3]; 3],
            },
            distance: 0.0,
        }
    }

    /// The block of side number `side` alone, which may be held by the world; no lever arms.
    pub(super) fn of_side(side: usize, phi: &'a mut [f64], block: &'a mut [f64]) -> Self {
        Self {
            only: Some(side),
            ..Self::new(phi, block, &mut [])
        }
    }

    /// Number of the block of side number `side`, where it has one and `before` sides before it do.
    #[inline(always)]
    pub(super) fn block_of(&self, side: usize, frame: &Frame, before: &mut usize) -> Option<usize> {
        if let Some(only) = self.only {
            return (side == only).then_some(0);
        }
        frame.body_index()?;
        *before += 1;
        Some(*before - 1)
    }

    /// The two sides of a joint at time `t`, whose blocks and levers are those of the rows from now on.
    #[inline(always)]
    pub(super) fn resolve(
        &mut self,
        frames: &[Frame; 2],
        bodies: &Bodies,
        t: f64,
    ) -> [Resolved; 2] {
        let sides = frames.map(|f| f.resolve(bodies, t));
        let mut blocks = 0;
        for (k, (frame, side)) in frames.iter().zip(&sides).enumerate() {
            if let Some(block) = self.block_of(k, frame, &mut blocks) {
                self.starts[k] = Some(6 * self.phi.len() * block);
                if let Some(lever) = self.levers.get_mut(block) {
                    *lever = side.lever;
                }
            }
        }
        sides
    }

    /// The lever arm of a joint's side, where it is not that of its attachment point: see
    /// [`Linearized::lever`](crate::Linearized::lever).
    pub(super) fn set_lever(&mut self, side: usize, lever: Vector3<f64>) {
        let block = side.min(usize::from(self.starts[0].is_some()));
        if self.starts[side].is_some()
            && let Some(to) = self.levers.get_mut(block)
        {
            *to = lever;
        }
    }

    /// The three rows of the gap.
    pub(super) fn stretch(&mut self, a: &Resolved, b: &Resolved) {
        self.joint.arms = [a.lever.into(), b.lever.into()];
        let [on_a, on_b] = [self.joint.block(0), self.joint.block(1)];
        for (k, phi) in gap(a, b).iter().enumerate() {
            self.push(*phi, &on_a[k], &on_b[k]);
        }
    }

    /// One row with the gradient `g` on ω_b and −`g` on ω_a.
    pub(super) fn angular(&mut self, phi: f64, g: &Vector3<f64>) {
        if let Some(k) = self.next.checked_sub(3)
            && let Some(to) = self.joint.gradients.get_mut(k)
        {
            *to = (*g).into();
        }
        let row = [0.0, 0.0, 0.0, g.x, g.y, g.z];
        self.push(phi, &row.map(|g| -g), &row);
    }

    /// The rows of bend and twist that `law` has, the twist unwrapped to `reference` \[rad].
    #[inline(always)]
    pub(super) fn bend_twist(
        &mut self,
        a: &Resolved,
        b: &Resolved,
        law: &JointLaw,
        reference: f64,
    ) {
        let angles = BendTwist::of_frames(a, b, reference);
        let gradients = angles.gradients(&columns(&a.axes));
        let has = [law.bend, law.bend, law.twist].map(|law| law.is_some());
        for k in (0..3).filter(|k| has[*k]) {
            self.angular(angles.angles[k], &gradients[k].into());
        }
    }

    /// One row of the gap of a force along `k` that acts on both sides at one point, with the levers `arms`.
    pub(super) fn along(&mut self, phi: f64, k: &Vector3<f64>, arms: [&Vector3<f64>; 2]) {
        let [on_a, on_b] = arms.map(|arm| row_along(k, arm));
        self.push(phi, &on_a, &on_b.map(|j| -j));
    }

    /// One row with its Jacobian on both sides.
    fn push(&mut self, phi: f64, a: &[f64; 6], b: &[f64; 6]) {
        let row = self.next;
        self.phi[row] = phi;
        for (start, numbers) in self.starts.into_iter().zip([a, b]) {
            if let Some(start) = start {
                self.write(start + 6 * row, numbers);
            }
        }
        self.next = row + 1;
    }

    /// The gradient `g` of row `row` on the point of the side of block number `block`.
    pub(super) fn point(
        &mut self,
        block: usize,
        row: usize,
        g: &Vector3<f64>,
        lever: &Vector3<f64>,
    ) {
        if let Some(to) = self.levers.get_mut(block) {
            *to = *lever;
        }
        let at = 6 * (block * self.phi.len() + row);
        self.write(at, &row_along(g, lever));
    }

    /// The gradient of row `row` on the side of block number `block`: a force that acts at `lever` with what it turns.
    pub(super) fn pull(
        &mut self,
        block: usize,
        row: usize,
        [force, torque]: [&Vector3<f64>; 2],
        lever: Vector3<f64>,
    ) {
        if let Some(to) = self.levers.get_mut(block) {
            *to = lever;
        }
        let at = 6 * (block * self.phi.len() + row);
        self.write(at, &joined(force, torque));
    }

    fn write(&mut self, at: usize, numbers: &[f64; 6]) {
        if let Some(out) = self.blocks.get_mut(at..at + 6) {
            out.copy_from_slice(numbers);
        }
    }
}
