//! The solution of a drawn system and its conditions, by elimination in double-double arithmetic.

use super::draw::Drawn;
use super::size;
use taut_solver::{DoubleDouble, norm_inf};

/// Numbers below this part of the sizes that they are left of by cancellation are zero: what double-doubles make of it.
const ZERO: f64 = 1e-27;

/// Products with |B⁻¹| |B| that find the best scales.
const PRODUCTS: usize = 8;

/// A drawn system's right-hand side, solution and conditions.
#[derive(Debug, Clone)]
pub struct Truth {
    /// ‖A‖∞ ‖A⁻¹‖∞.
    pub condition: f64,
    /// Condition of R A C in the ∞-norm: rows and columns are scaled to a largest entry of about 1.
    pub scaled: f64,
    /// Bound of the least condition in the ∞-norm that scaled rows and columns leave: the spectral radius of |A⁻¹| |A|.
    pub least: f64,
    /// ‖C⁻¹ |A⁻¹| |A| |x|‖∞ over ‖C⁻¹ x‖∞: what rounded entries make of this solution (Skeel).
    pub of_solution: f64,
    /// Condition of S⁻¹ A S⁻¹ in the ∞-norm, with largest entries of about 1 in all rows.
    pub symmetrically_scaled: f64,
    /// A right-hand side.
    pub b: Vec<f64>,
    /// Its solution; none of a matrix that is singular for 32 digits.
    pub x: Option<Vec<f64>>,
    /// Scales of the columns, C; of a definite matrix the S⁻¹ by which its elimination is judged, since units of such a matrix
    /// are those of rows and columns at once.
    pub columns: Vec<f64>,
}

/// The nearest power of two, 1 of 0.
fn power(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        2.0_f64.powi(x.log2().round() as i32)
    }
}

/// R and C: powers of two over the largest entries of rows, then of columns.
fn scales(a: &[Vec<f64>]) -> [Vec<f64>; 2] {
    let n = a.len();
    let largest = |of: &mut dyn Iterator<Item = f64>| of.fold(0.0, |m: f64, v| m.max(v.abs()));
    let rows: Vec<f64> = a
        .iter()
        .map(|row| 1.0 / power(largest(&mut row.iter().copied())))
        .collect();
    let columns = (0..n).map(|c| 1.0 / power(largest(&mut (0..n).map(|r| rows[r] * a[r][c]))));
    let columns = columns.collect();
    [rows, columns]
}

/// L U of B with complete pivoting: the factors, and the order of the rows and of the columns; `None` where a pivot
/// vanishes.
struct Factor {
    lu: Vec<Vec<DoubleDouble>>,
    order: [Vec<usize>; 2],
}

impl Factor {
    fn of(b: &[Vec<f64>]) -> Option<Self> {
        let n = b.len();
        let wide = |row: &Vec<f64>| row.iter().map(|&v| v.into()).collect();
        let mut lu: Vec<Vec<DoubleDouble>> = b.iter().map(wide).collect();
        // Bounds of the roundoff in each entry, over the roundoff of a double-double: a small pivot that nothing was
        // subtracted from is as right as a large one.
        let bound = b.iter().map(|row| row.iter().map(|v| v.abs()).collect());
        let mut bound: Vec<Vec<f64>> = bound.collect();
        let mut order = [(); 2].map(|()| (0..n).collect::<Vec<_>>());
        for k in 0..n {
            let places = (k..n).flat_map(|r| (k..n).map(move |c| (r, c)));
            let size = |&(r, c): &(usize, usize)| lu[r][c].to_f64().abs();
            let (r, c) = places.max_by(|p, q| size(p).total_cmp(&size(q)))?;
            let pivot = size(&(r, c));
            if pivot == 0.0 {
                return None;
            }
            lu.swap(k, r);
            bound.swap(k, r);
            order[0].swap(k, r);
            lu.iter_mut().for_each(|row| row.swap(k, c));
            bound.iter_mut().for_each(|row| row.swap(k, c));
            order[1].swap(k, c);
            let (done, rest) = lu.split_at_mut(k + 1);
            let (bound, of_rest) = bound.split_at_mut(k + 1);
            for (row, of_row) in rest.iter_mut().zip(of_rest) {
                let factor = row[k] / done[k][k];
                row[k] = factor;
                let size = factor.to_f64().abs();
                let of_factor = (of_row[k] + size * bound[k][k]) / pivot;
                for c in k + 1..n {
                    let u = done[k][c];
                    row[c] = row[c] - factor * u;
                    of_row[c] += size * bound[k][c] + of_factor * u.to_f64().abs();
                    if row[c].to_f64().abs() <= ZERO * of_row[c] {
                        row[c] = 0.0.into();
                    }
                }
            }
        }
        Some(Self { lu, order })
    }

    fn solve(&self, b: &[DoubleDouble]) -> Vec<DoubleDouble> {
        let n = b.len();
        let mut y: Vec<DoubleDouble> = self.order[0].iter().map(|&r| b[r]).collect();
        for k in 0..n {
            for c in 0..k {
                y[k] = y[k] - self.lu[k][c] * y[c];
            }
        }
        for k in (0..n).rev() {
            for c in k + 1..n {
                y[k] = y[k] - self.lu[k][c] * y[c];
            }
            y[k] = y[k] / self.lu[k][k];
        }
        let mut x = y.clone();
        for (at, &c) in self.order[1].iter().enumerate() {
            x[c] = y[at];
        }
        x
    }
}

/// S with rows of S⁻¹ A S⁻¹ whose largest entry is about 1.
fn symmetric_scales(a: &[Vec<f64>]) -> Vec<f64> {
    let mut s = vec![1.0; a.len()];
    for _ in 0..16 {
        let largest = a.iter().zip(&s).map(|(row, r)| {
            let entries = row.iter().zip(&s).map(|(v, c)| (v / r / c).abs());
            entries.fold(0.0, f64::max)
        });
        let largest: Vec<f64> = largest.collect();
        for (s, largest) in s.iter_mut().zip(largest).filter(|(_, l)| *l > 0.0) {
            *s *= largest.sqrt();
        }
    }
    s
}

/// True if the pivots of S⁻¹ A S⁻¹, taken in order, are positive.
fn is_definite(a: &[Vec<f64>], s: &[f64]) -> bool {
    let n = a.len();
    let of_row = |r: usize| {
        let of_place = |c: usize| DoubleDouble::from(a[r][c]) / s[r].into() / s[c].into();
        (0..n).map(of_place).collect()
    };
    let mut rest: Vec<Vec<DoubleDouble>> = (0..n).map(of_row).collect();
    for k in 0..n {
        if rest[k][k].to_f64() <= ZERO {
            return false;
        }
        let (done, rest) = rest.split_at_mut(k + 1);
        for row in rest {
            let factor = row[k] / done[k][k];
            for (a, &u) in row[k..].iter_mut().zip(&done[k][k..]) {
                *a = *a - factor * u;
            }
        }
    }
    true
}

/// ‖·‖∞ of a matrix of these entries.
fn norm(n: usize, entry: impl Fn(usize, usize) -> f64) -> f64 {
    let row = |r: usize| (0..n).map(|c| entry(r, c).abs()).sum::<f64>();
    (0..n).map(row).fold(0.0, f64::max)
}

/// |A| v.
fn times_sizes(n: usize, entry: impl Fn(usize, usize) -> f64, v: &[f64]) -> Vec<f64> {
    let row = |r: usize| {
        v.iter()
            .enumerate()
            .map(|(c, v)| entry(r, c).abs() * v)
            .sum()
    };
    (0..n).map(row).collect()
}

/// maxᵢ (|B⁻¹| |B| c)ᵢ / cᵢ, an upper bound of the spectral radius for each c > 0, after some products.
fn least_condition(
    n: usize,
    entry: impl Fn(usize, usize) -> f64,
    of_inverse: impl Fn(usize, usize) -> f64,
) -> f64 {
    let mut c = vec![1.0; n];
    let mut least = f64::INFINITY;
    for _ in 0..PRODUCTS {
        let y = times_sizes(n, &of_inverse, &times_sizes(n, &entry, &c));
        let ratios = y.iter().zip(&c).map(|(y, c)| y / c);
        least = ratios.fold(0.0, f64::max).min(least);
        let largest = norm_inf(&y);
        c = y
            .iter()
            .map(|y| (y / largest).max(f64::MIN_POSITIVE))
            .collect();
    }
    least
}

impl Truth {
    /// Solves a drawn system and computes its conditions.
    pub fn of(drawn: &Drawn) -> Self {
        let a = drawn.full();
        let n = a.len();
        let [rows, columns] = scales(&a);
        let b = drawn.right_hand_side(&a, &columns);
        let scaled = |r: usize, c: usize| rows[r] * a[r][c] * columns[c];
        let matrix = (0..n).map(|r| (0..n).map(|c| scaled(r, c)).collect());
        let matrix: Vec<Vec<f64>> = matrix.collect();
        let unknown = || {
            let [condition, scaled, least, of_solution, symmetrically_scaled] = [f64::INFINITY; 5];
            Self {
                condition,
                scaled,
                least,
                of_solution,
                symmetrically_scaled,
                b: b.clone(),
                x: None,
                columns: columns.clone(),
            }
        };
        let Some(factor) = Factor::of(&matrix) else {
            return unknown();
        };
        let unit = |at: usize| {
            let column = (0..n).map(|r| f64::from(u8::from(r == at)).into());
            let column: Vec<_> = column.collect();
            factor.solve(&column)
        };
        let inverse: Vec<Vec<DoubleDouble>> = (0..n).map(unit).collect();
        // Entries of B⁻¹, then of A⁻¹ = C B⁻¹ R.
        let of_scaled = |r: usize, c: usize| inverse[c][r].to_f64();
        let of_matrix = |r: usize, c: usize| columns[r] * of_scaled(r, c) * rows[c];
        let s = symmetric_scales(&a);
        let wide: Vec<DoubleDouble> = b.iter().zip(&rows).map(|(b, r)| (b * r).into()).collect();
        let mut y = factor.solve(&wide);
        for _ in 0..2 {
            let mut left = wide.clone();
            for (left, row) in left.iter_mut().zip(&matrix) {
                for (&a, &y) in row.iter().zip(&y) {
                    *left = *left - y * a.into();
                }
            }
            for (y, d) in y.iter_mut().zip(factor.solve(&left)) {
                *y = *y + d;
            }
        }
        let x = y.iter();
        let x: Vec<f64> = x.zip(&columns).map(|(y, c)| y.to_f64() * c).collect();
        // Scattered, an inverse may be beyond all doubles.
        let inverses = (0..n).flat_map(|r| (0..n).map(move |c| (r, c)));
        let mut inverses = inverses.map(|(r, c)| of_scaled(r, c));
        if !inverses.all(f64::is_finite) || !x.iter().all(|x| x.is_finite()) {
            return unknown();
        }
        Self {
            condition: norm(n, |r, c| a[r][c]) * norm(n, of_matrix),
            scaled: norm(n, scaled) * norm(n, of_scaled),
            least: least_condition(n, scaled, of_scaled),
            of_solution: {
                let y: Vec<f64> = y.iter().map(|y| y.to_f64().abs()).collect();
                let of_y = times_sizes(n, of_scaled, &times_sizes(n, scaled, &y));
                norm_inf(&of_y) / norm_inf(&y)
            },
            symmetrically_scaled: norm(n, |r, c| a[r][c] / s[r] / s[c])
                * norm(n, |r, c| s[r] * of_matrix(r, c) * s[c]),
            b,
            x: Some(x),
            columns: match drawn.market.symmetric && is_definite(&a, &s) {
                true => s.iter().map(|s| 1.0 / s).collect(),
                false => columns,
            },
        }
    }
}

/// Relative error of x, each component over the scale of its column, in the largest norm; none where nothing is right.
pub fn scaled_error(x: &[f64], truth: &Truth) -> Option<f64> {
    let right = truth.x.as_ref()?;
    let off: Vec<f64> = x.iter().zip(right).map(|(x, right)| x - right).collect();
    Some(size(&off, &truth.columns) / size(right, &truth.columns))
}

/// Relative error of x in the largest norm; none where nothing is right.
pub fn largest_error(x: &[f64], truth: &Truth) -> Option<f64> {
    let right = truth.x.as_ref()?;
    let off: Vec<f64> = x.iter().zip(right).map(|(x, right)| x - right).collect();
    Some(norm_inf(&off) / norm_inf(right))
}
