//! Solutions in whole numbers, for what 32 digits do not decide: doubles are whole numbers once rows and columns are scaled by
//! powers of two, and elimination without fractions (Bareiss, *Sylvester's identity and multistep integer-preserving Gaussian
//! elimination*, 1968) leaves determinants of them.

use num_bigint::{BigInt, Sign};

/// Whole number m and exponent e of a double m 2ᵉ.
fn parts(x: f64) -> (i64, i64) {
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i64;
    let fraction = (bits & ((1 << 52) - 1)) as i64 + (i64::from(exponent > 0) << 52);
    let sign = if x < 0.0 { -1 } else { 1 };
    let even = i64::from(fraction.trailing_zeros() % 64);
    (sign * (fraction >> even), exponent.max(1) - 1075 + even)
}

/// m 2ᵉ to within an ulp, where it is a normal number.
fn double(m: &BigInt, e: i64) -> f64 {
    let shift = m.bits().saturating_sub(64);
    let top = (m.magnitude() >> shift).iter_u64_digits().next();
    let (size, e) = (top.unwrap_or(0), e + shift as i64);
    // Two factors: one alone may be no double though the product is.
    let power = |e: i64| 2.0_f64.powi(e.clamp(-1000, 1000) as i32);
    let half = e / 2;
    let size = size as f64 * power(half) * power(e - half);
    if m.sign() == Sign::Minus { -size } else { size }
}

/// x of A x = b, rounded; none of a singular A.
pub fn solution(a: &[Vec<f64>], b: &[f64]) -> Option<Vec<f64>> {
    let n = b.len();
    let of_row = |row: &Vec<f64>| row.iter().filter(|v| **v != 0.0).map(|v| parts(*v).1).min();
    let rows: Vec<i64> = a.iter().map(of_row).collect::<Option<_>>()?;
    let of_column = |c: usize| {
        let left = |r: usize| (a[r][c] != 0.0).then(|| parts(a[r][c]).1 - rows[r]);
        (0..n).filter_map(left).min()
    };
    let columns: Vec<i64> = (0..n).map(of_column).collect::<Option<_>>()?;
    // b in units of its own: 2^unit.
    let unit = (0..n).filter(|&r| b[r] != 0.0);
    let unit = unit.map(|r| parts(b[r]).1 - rows[r]).min().unwrap_or(0);
    let whole = |x: f64, e: i64| {
        let (m, of_x) = parts(x);
        if m == 0 {
            BigInt::ZERO
        } else {
            BigInt::from(m) << (of_x - e)
        }
    };
    let row = |r: usize| {
        let entries = (0..n).map(|c| whole(a[r][c], rows[r] + columns[c]));
        entries.chain([whole(b[r], rows[r] + unit)]).collect()
    };
    let mut m: Vec<Vec<BigInt>> = (0..n).map(row).collect();
    let mut before = BigInt::from(1);
    for k in 0..n {
        let pivot = (k..n).find(|&r| m[r][k] != BigInt::ZERO)?;
        m.swap(k, pivot);
        let (done, rest) = m.split_at_mut(k + 1);
        let top = &done[k];
        for row in rest {
            for c in k + 1..=n {
                row[c] = (&row[c] * &top[k] - &row[k] * &top[c]) / &before;
            }
            row[k] = BigInt::ZERO;
        }
        before = m[k][k].clone();
    }
    // det x is whole (Cramer), and so is each step of the substitution.
    let det = before;
    let mut y = vec![BigInt::ZERO; n];
    for k in (0..n).rev() {
        let mut sum = &m[k][n] * &det;
        for c in k + 1..n {
            sum -= &m[k][c] * &y[c];
        }
        y[k] = sum / &m[k][k];
    }
    let x = y.iter().zip(&columns).map(|(y, column)| {
        // A quotient of at least 80 bits.
        let up = (det.bits() as i64 - y.bits() as i64).max(0) + 80;
        double(&((y << up) / &det), unit - column - up)
    });
    Some(x.collect())
}
