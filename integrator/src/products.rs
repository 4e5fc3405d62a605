//! Matrix-free products with the Jacobian: the joints four abreast by their lever arms and gradients, all other
//! constraints block by block.

use crate::lanes::{Vec3, cross, dot as dot3, load, of_bodies, of_rows, save};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
use taut_model::{ABREAST, Linearized, Slot};

/// p += Jᵀ μ; p: 6 numbers a body, μ: one a row.
pub(crate) fn add_transposed(rows: &Linearized, mu: &[f64], p: &mut [f64]) {
    let (p, _) = p.as_chunks_mut::<6>();
    dispatch(
        Level::best(),
        Transposed {
            rows,
            mu,
            p: &mut *p,
        },
    );
    for slot in other_slots(rows) {
        let mu = &mu[rows.row_range(slot.constraint)];
        let (jacobian, _) = rows.jacobian[slot.offset..].as_chunks::<6>();
        let p = &mut p[slot.body];
        for (j, mu) in jacobian.iter().zip(mu) {
            for (p, j) in p.iter_mut().zip(j) {
                *p += j * mu;
            }
        }
    }
}

/// r −= J v; v: 6 numbers a body, r: one a row.
pub(crate) fn subtract_jacobian(rows: &Linearized, v: &[f64], r: &mut [f64]) {
    let (v, _) = v.as_chunks::<6>();
    dispatch(
        Level::best(),
        Product {
            rows,
            v,
            r: &mut *r,
        },
    );
    for slot in other_slots(rows) {
        let r = &mut r[rows.row_range(slot.constraint)];
        let (jacobian, _) = rows.jacobian[slot.offset..].as_chunks::<6>();
        for (j, r) in jacobian.iter().zip(r) {
            *r -= dot(j, &v[slot.body]);
        }
    }
}

/// The slots of the constraints that are not abreast.
fn other_slots(rows: &Linearized) -> impl Iterator<Item = &Slot> {
    let others = rows.others().iter();
    others.flat_map(|&c| &rows.slots[rows.slot_range(c)])
}

/// a · b, summed in two halves: a shorter chain of additions.
#[inline]
pub(crate) fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (a[0] * b[0] + a[2] * b[2] + a[4] * b[4]) + (a[1] * b[1] + a[3] * b[3] + a[5] * b[5])
}

/// r −= J v of the joints.
struct Product<'a> {
    rows: &'a Linearized,
    v: &'a [[f64; 6]],
    r: &'a mut [f64],
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        for (pack, joints, count) in self.rows.abreast.packs() {
            let side = |side: usize| -> (Vec3<I::X4>, Vec3<I::X4>) {
                let [vx, vy, vz, x, y, z] =
                    of_bodies::<I::X4>(self.v, joints.each_ref().map(|j| j.bodies[side]));
                let (omega, arm) = ([x, y, z], load(&pack.arms[side]));
                let [x, y, z] = cross(&omega, &arm);
                ([vx + x, vy + y, vz + z], omega)
            };
            let ((point_a, omega_a), (point_b, omega_b)) = (side(0), side(1));
            let turning: Vec3<I::X4> = std::array::from_fn(|i| omega_b[i] - omega_a[i]);
            let angle = |q: usize| dot3(&load(&pack.gradients[q]), &turning);
            let rates = save(&[
                point_a[0] - point_b[0],
                point_a[1] - point_b[1],
                point_a[2] - point_b[2],
                angle(0),
                angle(1),
                angle(2),
            ]);
            for (lane, joint) in joints[..count].iter().enumerate() {
                let r = &mut self.r[joint.row..joint.row + joint.rows];
                if let Some(r) = r.first_chunk_mut::<6>() {
                    for (r, rate) in r.iter_mut().zip(&rates) {
                        *r -= rate[lane];
                    }
                } else {
                    for (r, rate) in r.iter_mut().zip(&rates) {
                        *r -= rate[lane];
                    }
                }
            }
        }
    }
}

/// p += Jᵀ μ of the joints.
struct Transposed<'a> {
    rows: &'a Linearized,
    mu: &'a [f64],
    p: &'a mut [[f64; 6]],
}

impl Kernel for Transposed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        for (pack, joints, count) in self.rows.abreast.packs() {
            let (row, rows) = (
                joints.each_ref().map(|j| j.row),
                joints.each_ref().map(|j| j.rows),
            );
            let [x, y, z, p, q, s] = of_rows::<I::X4>(self.mu, row, rows);
            let force = [x, y, z];
            let gradients = pack.gradients.each_ref().map(load::<I::X4, 3>);
            let torque: Vec3<I::X4> = std::array::from_fn(|i| {
                gradients[2][i].mul_add(s, gradients[1][i].mul_add(q, gradients[0][i] * p))
            });
            let arm_a = cross(&load(&pack.arms[0]), &force);
            let arm_b = cross(&load(&pack.arms[1]), &force);
            let on_a: Vec3<I::X4> = std::array::from_fn(|i| arm_a[i] - torque[i]);
            let on_b: Vec3<I::X4> = std::array::from_fn(|i| torque[i] - arm_b[i]);
            let [force, on_a, on_b] = [save(&force), save(&on_a), save(&on_b)];
            for (lane, joint) in joints[..count].iter().enumerate() {
                if let Some(p) = self.p.get_mut(joint.bodies[0]) {
                    for i in 0..3 {
                        p[i] += force[i][lane];
                        p[3 + i] += on_a[i][lane];
                    }
                }
                if let Some(p) = self.p.get_mut(joint.bodies[1]) {
                    for i in 0..3 {
                        p[i] -= force[i][lane];
                        p[3 + i] += on_b[i][lane];
                    }
                }
            }
        }
    }
}

const _: () = assert!(ABREAST == 4);
