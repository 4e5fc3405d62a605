//! J v and Jᵀ μ of the joints.

use taut_lanes::{Lanes, WideKernel};

use super::Packs;
use crate::body_vectors::BodyVectors;

/// r = J v.
pub(super) struct Rates<'a> {
    pub(super) joints: &'a Packs,
    pub(super) v: &'a BodyVectors,
    pub(super) r: &'a mut [f64],
}

impl WideKernel for Rates<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) {
        let v = self.v.view();
        for joints in self.joints.lanes::<L>() {
            let (a, b) = (v.load(&joints.bodies(0)), v.load(&joints.bodies(1)));
            let rates = joints.jacobian::<V>().rates(&a, &b);
            joints.write_rows(&rates, self.r);
        }
    }
}

/// p += Jᵀ μ.
pub(super) struct Transposed<'a> {
    pub(super) joints: &'a Packs,
    pub(super) mu: &'a [f64],
    pub(super) p: &'a mut BodyVectors,
}

impl WideKernel for Transposed<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) {
        let mut impulse = self.p.view_mut();
        for joints in self.joints.lanes::<L>() {
            let mu = joints.rows_of::<V>(self.mu);
            let [on_a, on_b] = joints.jacobian().transposed(&mu);
            joints.add_to_sides([&on_a, &on_b], &mut impulse);
        }
    }
}
