//! Elementary functions near zero, without branches: rational and polynomial approximations of double precision, with
//! the coefficients of fdlibm (Sun Microsystems, 1993: `e_asin.c`, `s_atan.c`, `k_sin.c`, `k_cos.c`).

use crate::Lanes;

/// c₀ + x (c₁ + x (c₂ + …)).
#[inline(always)]
fn polynomial<V: Lanes, const N: usize>(x: V, coefficients: [f64; N]) -> V {
    let mut sum = V::splat(coefficients[N - 1]);
    for c in coefficients[..N - 1].iter().rev() {
        sum = sum.mul_add(x, V::splat(*c));
    }
    sum
}

/// arcsin(√t)/√t as (numerator, denominator), for 0 ≤ t ≤ ¼: a caller that divides anyway saves a division.
#[must_use]
#[inline(always)]
pub fn asin_ratio<V: Lanes>(t: V) -> (V, V) {
    let p = polynomial(
        t,
        [
            1.666_666_666_666_666_6e-1,
            -3.255_658_186_224_009e-1,
            2.012_125_321_348_629_3e-1,
            -4.005_553_450_067_941e-2,
            7.915_349_942_898_145e-4,
            3.479_331_075_960_212e-5,
        ],
    );
    let q = polynomial(
        t,
        [
            1.0,
            -2.403_394_911_734_414,
            2.020_945_760_233_505_7,
            -6.882_839_716_054_533e-1,
            7.703_815_055_590_194e-2,
        ],
    );
    (t.mul_add(p, q), q)
}

/// arctan(x) for |x| ≤ 7/16.
#[must_use]
#[inline(always)]
pub fn atan<V: Lanes>(x: V) -> V {
    let z = x * x;
    let w = z * z;
    let odd = polynomial(
        w,
        [
            3.333_333_333_333_293e-1,
            1.428_571_427_250_346_6e-1,
            9.090_887_133_436_507e-2,
            6.661_073_137_387_531e-2,
            4.976_877_994_615_932e-2,
            1.628_582_011_536_578_2e-2,
        ],
    );
    let even = polynomial(
        w,
        [
            -1.999_999_999_987_648_3e-1,
            -1.111_111_040_546_235_6e-1,
            -7.691_876_205_044_83e-2,
            -5.833_570_133_790_573e-2,
            -3.653_157_274_421_691_6e-2,
        ],
    );
    x.neg_mul_add(z * z.mul_add(even, odd), x)
}

/// (sin x / x, cos x) of the square z = x², for |x| ≤ π/4.
#[must_use]
#[inline(always)]
pub fn sinc_cos<V: Lanes>(z: V) -> (V, V) {
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
                    worst[k] = worst[k].max(if exact == found { 0.0 } else { error });
                }
            };
            for i in 0..PACKS {
                let at = |range: f64| {
                    std::array::from_fn(|l| range * (4 * i + l) as f64 / (4 * PACKS) as f64)
                };
                let x: [f64; 4] = at(7.0 / 16.0);
                see(0, atan(I::X4::load(&x)), x.map(f64::atan));
                see(0, atan(-I::X4::load(&x)), x.map(|x| -x.atan()));
                let x: [f64; 4] = at(std::f64::consts::FRAC_PI_4);
                let (sine, cosine) = sinc_cos(I::X4::load(&x.map(|x| x * x)));
                see(1, sine, x.map(|x| if x == 0.0 { 1.0 } else { x.sin() / x }));
                see(2, cosine, x.map(f64::cos));
                let t: [f64; 4] = at(0.25);
                let (p, q) = asin_ratio(I::X4::load(&t));
                let exact = |t: f64| {
                    if t == 0.0 {
                        1.0
                    } else {
                        t.sqrt().asin() / t.sqrt()
                    }
                };
                see(3, p / q, t.map(exact));
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
