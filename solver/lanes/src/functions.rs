//! Elementary functions near zero, without branches: polynomial approximations of double precision. The coefficients of
//! sine and cosine are those of fdlibm (Sun Microsystems, 1993: `k_sin.c`, `k_cos.c`), the others interpolate at
//! Chebyshev's points.

use crate::Lanes;
use crate::vector::{load, save};
use std::f64::consts::FRAC_PI_4;

/// `f` of the numbers of each lane, one lane after the other: for arguments that are rare, where a function has no form
/// without branches.
#[must_use]
#[inline(always)]
pub fn lane_by_lane<V: Lanes, const N: usize, const M: usize>(
    x: &[V; N],
    f: fn([f64; N]) -> [f64; M],
) -> [V; M] {
    /// Lanes of the longest vector.
    const MOST: usize = 8;
    let from: [[f64; MOST]; N] = save(x);
    let mut to = [[0.0; MOST]; M];
    for l in 0..V::LANES {
        for (to, y) in to.iter_mut().zip(f(from.map(|x| x[l]))) {
            to[l] = y;
        }
    }
    load(&to)
}

/// c₀ + x (c₁ + x (c₂ + …)).
#[inline(always)]
fn polynomial<V: Lanes, const N: usize>(x: V, coefficients: [f64; N]) -> V {
    let mut sum = V::splat(coefficients[N - 1]);
    for c in coefficients[..N - 1].iter().rev() {
        sum = sum.mul_add(x, V::splat(*c));
    }
    sum
}

/// f(t) of θ/sin θ = 1 + t f(t) with t = sin²(θ/2), for 0 ≤ t ≤ ¼. 1 − θ cot θ = t (2 − (1 − 2 t) f(t)) loses nothing
/// near zero.
#[must_use]
#[inline(always)]
pub fn over_sine<V: Lanes>(t: V) -> V {
    let square = t * t;
    let even = polynomial(
        square,
        [
            6.666_666_666_666_666e-1,
            4.571_428_571_263_605_5e-1,
            3.694_082_804_493_618_6e-1,
            3.182_021_665_112_481e-1,
            2.762_582_522_436_188_3e-1,
            3.019_370_046_536_456_4e-2,
            -1.082_636_309_271_642,
        ],
    );
    let odd = polynomial(
        square,
        [
            5.333_333_333_333_969e-1,
            4.063_492_080_287_483e-1,
            3.409_951_534_220_973e-1,
            3.003_277_676_303_172e-1,
            3.201_179_172_058_006_3e-1,
            9.464_135_631_192_144e-1,
            1.506_523_202_046_277_5,
        ],
    );
    odd.mul_add(t, even)
}

/// arctan(x) for |x| ≤ 0.209.
#[must_use]
#[inline(always)]
pub fn atan<V: Lanes>(x: V) -> V {
    let z = x * x;
    let cubic = polynomial(
        z,
        [
            3.333_333_333_333_331_3e-1,
            -1.999_999_999_955_398e-1,
            1.428_571_412_319_179_5e-1,
            -1.111_108_885_809_156_3e-1,
            9.089_453_636_238_456e-2,
            -7.643_154_788_845_684e-2,
            5.831_791_848_398_258e-2,
        ],
    );
    x.neg_mul_add(z * cubic, x)
}

/// (sin x / x, cos x) of the square z = x²: by polynomials where |x| < π/4 in all lanes, one lane after the other
/// otherwise.
#[must_use]
#[inline(always)]
pub fn sinc_cos<V: Lanes>(z: V) -> (V, V) {
    if z.all_below(V::splat(FRAC_PI_4 * FRAC_PI_4)) {
        return sinc_cos_near(z);
    }
    let [sinc, cosine] = lane_by_lane(&[z], sinc_cos_far);
    (sinc, cosine)
}

#[cold]
fn sinc_cos_far([z]: [f64; 1]) -> [f64; 2] {
    if z < FRAC_PI_4 * FRAC_PI_4 {
        let (sinc, cosine) = sinc_cos_near(z);
        return [sinc, cosine];
    }
    let (sine, cosine) = z.sqrt().sin_cos();
    [sine / z.sqrt(), cosine]
}

/// [`sinc_cos`] for |x| ≤ π/4.
#[inline(always)]
fn sinc_cos_near<V: Lanes>(z: V) -> (V, V) {
    let one = V::splat(1.0);
    let sine = polynomial(
        z,
        [
            -1.666_666_666_666_663_2e-1,
            8.333_333_333_322_49e-3,
            -1.984_126_982_985_795e-4,
            2.755_731_370_707_007e-6,
            -2.505_076_025_340_686_3e-8,
            1.589_690_995_211_55e-10,
        ],
    );
    let cosine = polynomial(
        z,
        [
            -0.5,
            4.166_666_666_666_66e-2,
            -1.388_888_888_887_411e-3,
            2.480_158_728_947_673e-5,
            -2.755_731_435_139_066_3e-7,
            2.087_572_321_298_175e-9,
            -1.135_964_755_778_819_5e-11,
        ],
    );
    (sine.mul_add(z, one), cosine.mul_add(z, one))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Isa, Kernel, Level, dispatch};

    /// Packs of arguments.
    const PACKS: usize = if cfg!(miri) { 20 } else { 5000 };

    /// Largest error, in units of roundoff relative to the exact value.
    struct Errors;

    /// (arcsin √t / √(t (1 − t)) − 1)/t = ⅔ (1 + ⅘ t (1 + 6/7 t (1 + …))).
    fn series(t: f64) -> f64 {
        let ratio = |k: u32| f64::from(2 * k) / f64::from(2 * k + 1);
        ratio(1) * (2..60).rev().fold(1.0, |sum, k| 1.0 + ratio(k) * t * sum)
    }

    impl Kernel for Errors {
        type Output = [f64; 4];

        #[inline(always)]
        fn run<I: Isa>(self) -> [f64; 4] {
            let mut worst = [0.0_f64; 4];
            let mut see = |k: usize, found: I::X4, exact: [f64; 4]| {
                let mut lanes = [0.0; 4];
                found.store(&mut lanes);
                for (found, exact) in lanes.into_iter().zip(exact) {
                    let error = (found - exact).abs() / (exact.abs() * f64::EPSILON / 2.0);
                    assert!(!error.is_nan() || exact == found, "{found} for {exact}");
                    worst[k] = worst[k].max(if exact == found { 0.0 } else { error });
                }
            };
            for i in 0..PACKS {
                let at = |range: f64| {
                    std::array::from_fn(|l| range * (4 * i + l) as f64 / (4 * PACKS) as f64)
                };
                let x: [f64; 4] = at(0.209);
                see(0, atan(I::X4::load(&x)), x.map(f64::atan));
                see(0, atan(-I::X4::load(&x)), x.map(|x| -x.atan()));
                let x: [f64; 4] = at(std::f64::consts::FRAC_PI_4);
                let (sine, cosine) = sinc_cos(I::X4::load(&x.map(|x| x * x)));
                see(1, sine, x.map(|x| if x == 0.0 { 1.0 } else { x.sin() / x }));
                see(2, cosine, x.map(f64::cos));
                let lanes: [f64; 4] = at(0.25);
                let t = I::X4::load(&lanes);
                see(3, over_sine(t), lanes.map(series));
            }
            worst
        }
    }

    #[test]
    fn functions_are_those_of_the_library_to_rounding() {
        for level in Level::available() {
            let errors = dispatch(level, Errors);
            println!("{level}: {errors:?}");
            assert!(errors.iter().all(|e| *e <= 5.0), "{level}: {errors:?}");
        }
    }
}
