//! J v and Jᵀ μ of the joints, four at a time.

use taut_lanes::{Isa, Kernel};

use super::Packs;
use crate::body_vectors::BodyVectors;

/// r = J v.
pub(super) struct Rates<'a> {
    pub(super) joints: &'a Packs,
    pub(super) v: &'a BodyVectors,
    pub(super) r: &'a mut [f64],
}

impl Kernel for Rates<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let v = self.v.view();
        for four in self.joints.fours() {
            let (a, b) = (v.load(four.bodies(0)), v.load(four.bodies(1)));
            let rates = four.jacobian::<I::X4>().rates(&a, &b);
            four.write_rows(&rates, self.r);
        }
    }
}

/// p += Jᵀ μ.
pub(super) struct Transposed<'a> {
    pub(super) joints: &'a Packs,
    pub(super) mu: &'a [f64],
    pub(super) p: &'a mut BodyVectors,
}

impl Kernel for Transposed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mut impulse = self.p.view_mut();
        for four in self.joints.fours() {
            let mu = four.rows_of::<I::X4>(self.mu);
            let [on_a, on_b] = four.jacobian().transposed(&mu);
            four.add_to_sides([&on_a, &on_b], &mut impulse);
        }
    }
}
