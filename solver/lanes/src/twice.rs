//! Two vectors as one of twice the lanes.

use crate::{Halves, Lanes, Quad};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Lower lanes, upper lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Twice<V>(V, V);

macro_rules! lanewise {
    ($($trait:ident $method:ident),*) => {$(
        impl<V: Lanes> $trait for Twice<V> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($trait::$method(self.0, other.0), $trait::$method(self.1, other.1))
            }
        }
    )*};
}
lanewise!(Add add, Sub sub, Mul mul, Div div);

impl<V: Lanes> Neg for Twice<V> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<V: Lanes> Lanes for Twice<V> {
    const LANES: usize = 2 * V::LANES;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self(V::splat(x), V::splat(x))
    }
    #[inline(always)]
    fn from_fn(mut f: impl FnMut(usize) -> f64) -> Self {
        let lower = V::from_fn(&mut f);
        Self(lower, V::from_fn(|i| f(V::LANES + i)))
    }
    #[inline(always)]
    fn load(from: &[f64]) -> Self {
        let (lower, upper) = from[..Self::LANES].split_at(V::LANES);
        Self(V::load(lower), V::load(upper))
    }
    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        let (lower, upper) = to[..Self::LANES].split_at_mut(V::LANES);
        self.0.store(lower);
        self.1.store(upper);
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        Self(self.0.mul_add(a.0, b.0), self.1.mul_add(a.1, b.1))
    }
    #[inline(always)]
    fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self(self.0.neg_mul_add(a.0, b.0), self.1.neg_mul_add(a.1, b.1))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn all_below(self, other: Self) -> bool {
        self.0.all_below(other.0) && self.1.all_below(other.1)
    }
    #[inline(always)]
    fn shift_in(self, next: Self) -> Self {
        Self(self.0.shift_in(self.1), self.1.shift_in(next.0))
    }
    #[inline(always)]
    fn first_lane(self) -> f64 {
        self.0.first_lane()
    }
}

impl<V: Lanes> Halves for Twice<V> {
    type Half = V;

    #[inline(always)]
    fn join(lower: V, upper: V) -> Self {
        Self(lower, upper)
    }
    #[inline(always)]
    fn lower(self) -> V {
        self.0
    }
    #[inline(always)]
    fn upper(self) -> V {
        self.1
    }
}

impl<V: Halves> Quad for Twice<V> {
    #[inline(always)]
    fn interleave(p: &[f64; 2], q: &[f64; 2]) -> Self {
        let one = V::Half::splat;
        Self(V::join(one(p[0]), one(q[0])), V::join(one(p[1]), one(q[1])))
    }
}
