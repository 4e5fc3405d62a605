//! Where constraints write their rows.

use nalgebra::Vector3;

use super::gap;
use crate::body::Bodies;
use crate::frame::{Frame, Resolved};

/// Where a constraint writes: φ; the blocks of its moving sides one after the other (rows × 6, row-major, columns
/// \[linear, angular]); their lever arms. Blocks and levers may be left out.
pub(crate) struct Rows<'a> {
    pub(super) phi: &'a mut [f64],
    blocks: &'a mut [f64],
    levers: &'a mut [Vector3<f64>],
    /// Where the blocks of a joint's two sides start; `None` for a side that does not move.
    starts: [Option<usize>; 2],
    next: usize,
    /// |p_a − p_b| \[m], written by [`Distance`] alone.
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
            starts: [None; 2],
            next: 0,
            distance: 0.0,
        }
    }

    /// The two sides of a joint at time `t`, whose blocks and levers are those of the rows from now on.
    pub(super) fn resolve(
        &mut self,
        frames: &[Frame; 2],
        bodies: &Bodies,
        t: f64,
    ) -> [Resolved; 2] {
        let sides = frames.map(|f| f.resolve(bodies, t));
        let mut moving = 0;
        for ((frame, side), start) in frames.iter().zip(&sides).zip(&mut self.starts) {
            if frame.body_index().is_some() {
                *start = Some(6 * self.phi.len() * moving);
                if let Some(lever) = self.levers.get_mut(moving) {
                    *lever = side.lever;
                }
                moving += 1;
            }
        }
        sides
    }

    /// The lever arm of side a, where the force acts elsewhere than at its attachment point.
    pub(super) fn set_lever_of_a(&mut self, lever: Vector3<f64>) {
        if self.starts[0].is_some()
            && let Some(to) = self.levers.first_mut()
        {
            *to = lever;
        }
    }

    /// Three rows φ = x_a + r_a − x_b − r_b; J_a = \[I, −\[r_a]×], J_b = \[−I, \[r_b]×] \[SL (25), (26)].
    pub(super) fn stretch(&mut self, a: &Resolved, b: &Resolved) {
        let gap = gap(a, b);
        for (k, axis) in [Vector3::x(), Vector3::y(), Vector3::z()]
            .into_iter()
            .enumerate()
        {
            // Row k of −[r]× is (r × e_k)ᵀ.
            let (arm_a, arm_b) = (a.lever.cross(&axis), b.lever.cross(&axis));
            self.push(gap[k], [&axis, &arm_a], [&-axis, &-arm_b]);
        }
    }

    /// One row with the gradient `g` on ω_b and −`g` on ω_a.
    pub(super) fn angular(&mut self, phi: f64, g: &Vector3<f64>) {
        let zero = Vector3::zeros();
        self.push(phi, [&zero, &-g], [&zero, g]);
    }

    pub(super) fn push(&mut self, phi: f64, a: [&Vector3<f64>; 2], b: [&Vector3<f64>; 2]) {
        let row = self.next;
        self.phi[row] = phi;
        for (start, parts) in self.starts.into_iter().zip([a, b]) {
            if let Some(start) = start {
                self.write(start + 6 * row, parts);
            }
        }
        self.next = row + 1;
    }

    /// The gradient `g` of row `row` on the point of the moving side number `side`.
    pub(super) fn point(
        &mut self,
        side: usize,
        row: usize,
        g: &Vector3<f64>,
        lever: &Vector3<f64>,
    ) {
        if let Some(to) = self.levers.get_mut(side) {
            *to = *lever;
        }
        self.write(6 * (side * self.phi.len() + row), [g, &lever.cross(g)]);
    }

    pub(super) fn write(&mut self, at: usize, parts: [&Vector3<f64>; 2]) {
        if let Some(out) = self.blocks.get_mut(at..at + 6) {
            out[..3].copy_from_slice(parts[0].as_slice());
            out[3..].copy_from_slice(parts[1].as_slice());
        }
    }
}
