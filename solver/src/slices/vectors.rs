//! Passes over whole vectors, whatever their layout.

use super::ROWS;
use super::kernels::sum;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// x += s p and r −= s q; returns r·r.
pub(crate) fn step(s: f64, [p, q]: [&[f64]; 2], [x, r]: [&mut [f64]; 2]) -> f64 {
    dispatch(Level::best(), Step { s, p, q, x, r })
}

/// p = z + s p.
pub(crate) fn turn(s: f64, z: &[f64], p: &mut [f64]) {
    dispatch(Level::best(), Turn { s, z, p });
}

/// a·b.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    dispatch(Level::best(), Dot(a, b))
}

struct Step<'a> {
    s: f64,
    p: &'a [f64],
    q: &'a [f64],
    x: &'a mut [f64],
    r: &'a mut [f64],
}

impl Kernel for Step<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        let (p, p_rest) = self.p.as_chunks::<ROWS>();
        let (q, q_rest) = self.q.as_chunks::<ROWS>();
        let (x, x_rest) = self.x.as_chunks_mut::<ROWS>();
        let (r, r_rest) = self.r.as_chunks_mut::<ROWS>();
        let s = I::X4::splat(self.s);
        let mut norm = I::X4::splat(0.0);
        for (((p, q), x), r) in p.iter().zip(q).zip(x).zip(r) {
            s.mul_add(I::X4::load(p), I::X4::load(x)).store(x);
            let residual = s.neg_mul_add(I::X4::load(q), I::X4::load(r));
            residual.store(r);
            norm = residual.mul_add(residual, norm);
        }
        let mut norm = sum::<I::X4>(norm);
        for (((p, q), x), r) in p_rest.iter().zip(q_rest).zip(x_rest).zip(r_rest) {
            *x += self.s * p;
            *r -= self.s * q;
            norm += *r * *r;
        }
        norm
    }
}

struct Turn<'a> {
    s: f64,
    z: &'a [f64],
    p: &'a mut [f64],
}

impl Kernel for Turn<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let (z, z_rest) = self.z.as_chunks::<ROWS>();
        let (p, p_rest) = self.p.as_chunks_mut::<ROWS>();
        let s = I::X4::splat(self.s);
        for (z, p) in z.iter().zip(p) {
            s.mul_add(I::X4::load(p), I::X4::load(z)).store(p);
        }
        for (z, p) in z_rest.iter().zip(p_rest) {
            *p = z + self.s * *p;
        }
    }
}

struct Dot<'a>(&'a [f64], &'a [f64]);

impl Kernel for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        let ((a, a_rest), (b, b_rest)) = (self.0.as_chunks::<8>(), self.1.as_chunks::<8>());
        let mut sums = [I::X4::splat(0.0); 2];
        for (a, b) in a.iter().zip(b) {
            sums[0] = I::X4::load(&a[..4]).mul_add(I::X4::load(&b[..4]), sums[0]);
            sums[1] = I::X4::load(&a[4..]).mul_add(I::X4::load(&b[4..]), sums[1]);
        }
        let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
        sum::<I::X4>(sums[0] + sums[1]) + rest
    }
}
