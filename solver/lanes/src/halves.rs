//! Vectors of two halves, and of two rows.

use crate::Lanes;

/// A vector of two halves, which are vectors too: two numbers for each of some problems side by side.
pub trait Halves: Lanes {
    /// A vector of half the lanes.
    type Half: Lanes;

    /// Two halves side by side.
    fn join(lower: Self::Half, upper: Self::Half) -> Self;

    /// `half` in both halves.
    #[must_use]
    #[inline(always)]
    fn both(half: Self::Half) -> Self {
        Self::join(half, half)
    }

    /// The first half of the lanes.
    #[must_use]
    fn lower(self) -> Self::Half;

    /// The second half.
    #[must_use]
    fn upper(self) -> Self::Half;
}

/// Four lanes that are two rows of two columns, filled from two places.
pub trait Quad: Halves {
    /// `[p₀, q₀, p₁, q₁]`.
    fn interleave(p: &[f64; 2], q: &[f64; 2]) -> Self;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Isa, Kernel, Level, dispatch};

    #[inline(always)]
    fn lanes<V: Lanes>(v: V) -> Vec<f64> {
        let mut lanes = [0.0; 8];
        v.store(&mut lanes);
        lanes[..V::LANES].to_vec()
    }

    #[inline(always)]
    fn joins<V: Halves>() {
        let n = V::Half::LANES;
        let lower = V::Half::from_fn(|i| i as f64);
        let upper = V::Half::from_fn(|i| (n + i) as f64);
        let all: Vec<f64> = (0..2 * n).map(|i| i as f64).collect();
        let joined = V::join(lower, upper);
        assert_eq!(lanes(joined), all);
        assert_eq!(lanes(joined.lower()), all[..n]);
        assert_eq!(lanes(joined.upper()), all[n..]);
        assert_eq!(lanes(V::both(upper)), [&all[n..], &all[n..]].concat());
    }

    struct All;

    impl Kernel for All {
        type Output = ();

        #[inline(always)]
        fn run<I: Isa>(self) {
            joins::<I::X2>();
            joins::<I::X4>();
            joins::<I::X8>();
            let v = I::X4::interleave(&[1.0, 2.0], &[5.0, 6.0]);
            assert_eq!(lanes(v), [1.0, 5.0, 2.0, 6.0]);
        }
    }

    #[test]
    fn halves_and_rows_at_every_level() {
        for level in Level::available() {
            dispatch(level, All);
        }
    }
}
