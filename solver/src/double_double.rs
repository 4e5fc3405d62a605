//! Extended precision: a number as the unevaluated sum of two doubles, about 32 decimal digits.
//!
//! Error-free sums (Knuth) and products (fused multiply-add); the operations are those of Joldes, Muller and Popescu,
//! *Tight and rigorous error bounds for basic building blocks of double-word arithmetic* (2017), with relative errors
//! of a few 2⁻¹⁰⁴. It serves the reference solutions and the residuals that the errors are measured with.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// `hi + lo` with |lo| ≤ ulp(hi)/2.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DoubleDouble {
    hi: f64,
    lo: f64,
}

/// a + b exactly, as a rounded sum and its error, for any a and b.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let bb = s - a;
    (s, (a - (s - bb)) + (b - bb))
}

/// a + b exactly, as a rounded sum and its error; requires |a| ≥ |b|.
fn fast_two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    (s, b - (s - a))
}

impl DoubleDouble {
    /// The nearest double.
    #[must_use]
    pub fn to_f64(self) -> f64 {
        self.hi + self.lo
    }

    /// a·b exactly (barring over- and underflow).
    #[must_use]
    pub fn product(a: f64, b: f64) -> Self {
        let hi = a * b;
        Self {
            hi,
            lo: a.mul_add(b, -hi),
        }
    }

    /// Absolute value.
    #[must_use]
    pub fn abs(self) -> Self {
        if self.hi < 0.0 { -self } else { self }
    }
}

impl From<f64> for DoubleDouble {
    fn from(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        let (s, e) = two_sum(self.hi, o.hi);
        let (t, f) = two_sum(self.lo, o.lo);
        let (s, e) = fast_two_sum(s, e + t);
        let (hi, lo) = fast_two_sum(s, e + f);
        Self { hi, lo }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            hi: -self.hi,
            lo: -self.lo,
        }
    }
}

impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let p = Self::product(self.hi, o.hi);
        let cross = self.lo.mul_add(o.hi, self.hi * o.lo);
        let (hi, lo) = fast_two_sum(p.hi, p.lo + cross);
        Self { hi, lo }
    }
}

impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        // Three quotient digits, each the double quotient of what the ones before it left.
        let q1 = self.hi / o.hi;
        let r = self - o * q1.into();
        let q2 = r.hi / o.hi;
        let r = r - o * q2.into();
        let (hi, lo) = fast_two_sum(q1, q2);
        Self { hi, lo } + (r.hi / o.hi).into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dd(x: f64) -> DoubleDouble {
        x.into()
    }

    #[test]
    fn keeps_what_doubles_lose() {
        let tiny = dd(1.0) + dd(1e-25) - dd(1.0);
        assert!((tiny.to_f64() - 1e-25).abs() < 1e-40, "{tiny:?}");
        let found = DoubleDouble::product(1.0 + f64::EPSILON, 1.0 - f64::EPSILON).lo;
        assert_eq!(found, -f64::EPSILON * f64::EPSILON);
    }

    #[test]
    fn quotient_times_divisor_is_the_dividend() {
        let mut worst = 0.0_f64;
        for i in 1..200 {
            let a = dd(f64::from(i)) / dd(7.0);
            let b = dd(1.0) / dd(f64::from(i) + 0.1);
            let back = a / b * b - a;
            worst = worst.max((back.to_f64() / a.to_f64()).abs());
        }
        let holds = worst > 0.0 && worst < 1e-30;
        assert!(holds, "worst relative error {worst:e}");
    }

    #[test]
    fn square_root_two_by_newton_to_thirty_digits() {
        let mut x = dd(2.0_f64.sqrt());
        for _ in 0..2 {
            x = (x + dd(2.0) / x) * dd(0.5);
        }
        assert!((x * x - dd(2.0)).abs().to_f64() < 1e-30);
    }
}
