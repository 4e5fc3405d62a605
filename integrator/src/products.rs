//! Products with the Jacobian: the joints four abreast by their lever arms and gradients, all other
//! constraints block by block.

use crate::lanes::side as of_side;
use crate::six::{Six, View};
use taut_lanes::vector::{Vec3, add, combine, cross, load, sub};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch, vector};
use taut_model::{Linearized, Pack, Places, Slot};

/// p += Jᵀ μ, μ: one a row; what acts on the world is added there.
pub(crate) fn add_transposed(rows: &Linearized, mu: &[f64], p: &mut Six) {
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
        for (j, mu) in jacobian.iter().zip(mu) {
            p.add(slot.body, j.map(|j| j * mu));
        }
    }
}

/// r = J v; r: one a row. The world's part of v is zero.
pub(crate) fn times_jacobian(rows: &Linearized, v: &Six, r: &mut [f64]) {
    dispatch(
        Level::best(),
        Product {
            rows,
            v,
            r: &mut *r,
        },
    );
    for &c in rows.others() {
        r[rows.row_range(c)].fill(0.0);
    }
    for slot in other_slots(rows) {
        let r = &mut r[rows.row_range(slot.constraint)];
        let (jacobian, _) = rows.jacobian[slot.offset..].as_chunks::<6>();
        let v = v.get(slot.body);
        for (j, r) in jacobian.iter().zip(r) {
            *r += dot(j, &v);
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

/// Velocity of the attachment point of one side, and the body's angular velocity.
#[inline(always)]
fn point<V: Lanes>(pack: &Pack, places: &Places, v: &View<'_>, side: usize) -> (Vec3<V>, Vec3<V>) {
    let [vx, vy, vz, x, y, z] = v.load::<V>(&of_side(places, side));
    let (velocity, omega) = ([vx, vy, vz], [x, y, z]);
    (
        add(&velocity, &cross(&omega, &load(&pack.arms[side]))),
        omega,
    )
}

/// r = J v of the joints.
struct Product<'a> {
    rows: &'a Linearized,
    v: &'a Six,
    r: &'a mut [f64],
}

impl Kernel for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let v = self.v.view();
        for (pack, places) in self.rows.abreast.packs() {
            let (point_a, omega_a) = point::<I::X4>(pack, places, &v, 0);
            let (point_b, omega_b) = point::<I::X4>(pack, places, &v, 1);
            let [x, y, z] = sub(&point_a, &point_b);
            let turning = sub(&omega_b, &omega_a);
            let [p, q, s] = &pack.gradients;
            let rates = [
                x,
                y,
                z,
                vector::dot(&load(p), &turning),
                vector::dot(&load(q), &turning),
                vector::dot(&load(s), &turning),
            ];
            places.write_rows(&rates, self.r);
        }
    }
}

/// p += Jᵀ μ of the joints.
struct Transposed<'a> {
    rows: &'a Linearized,
    mu: &'a [f64],
    p: &'a mut Six,
}

impl Kernel for Transposed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mut impulse = self.p.view_mut();
        for (pack, places) in self.rows.abreast.packs() {
            let [x, y, z, p, q, s] = places.rows_of::<I::X4>(self.mu);
            let force = [x, y, z];
            let [first, second, third] = &pack.gradients;
            let gradients = [load(first), load(second), load(third)];
            let torque = combine::<I::X4>(&gradients, &[p, q, s]);
            let on_a = sub(&cross(&load(&pack.arms[0]), &force), &torque);
            let on_b = sub(&torque, &cross(&load(&pack.arms[1]), &force));
            let ([ax, ay, az], [bx, by, bz]) = (on_a, on_b);
            let (on_a, on_b) = ([x, y, z, ax, ay, az], [-x, -y, -z, bx, by, bz]);
            impulse.add_sides(places, [&on_a, &on_b]);
        }
    }
}
