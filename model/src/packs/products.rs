//! J v and Jᵀ μ of the joints.

use taut_lanes::{Lanes, WideKernel};

use super::Packs;
use crate::body_vectors::BodyVectors;

/// r = J Σ v, of one or two v.
pub(super) struct Rates<'a, const N: usize> {
    pub(super) joints: &'a Packs,
    pub(super) v: [&'a BodyVectors; N],
    pub(super) r: &'a mut [f64],
}

impl<const N: usize> WideKernel for Rates<'_, N> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) {
        let (v, more) = (self.v[0].view(), self.v[N - 1].view());
        for joints in self.joints.lanes::<L>() {
            let (on_a, on_b) = (joints.bodies(0), joints.bodies(1));
            let (mut a, mut b) = (v.load(&on_a), v.load(&on_b));
            if N > 1 {
                let (more_a, more_b): ([V; 6], [V; 6]) = (more.load(&on_a), more.load(&on_b));
                for i in 0..6 {
                    (a[i], b[i]) = (a[i] + more_a[i], b[i] + more_b[i]);
                }
            }
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
