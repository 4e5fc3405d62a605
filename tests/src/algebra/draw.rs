//! Draws the system of a seed: a matrix of some kind, rank and scaling, written as a file might be,
//! with explicit zeros, repeated entries, empty rows and blocks.

use crate::prelude::*;
use taut_measure::matrix::market::Market;

/// Structure of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Springs of a net that some of its nodes hold.
    Definite,
    /// [M Jᵀ; J −Σ], M and Σ positive.
    QuasiDefinite,
    /// [M Jᵀ; J 0] with rows of J cleared, −1 on their diagonal.
    Kkt,
    /// Symmetric, of any signs.
    Indefinite,
    /// Not symmetric, sparse or full.
    Unsymmetric,
    /// Triangular, rows and columns permuted.
    Triangular,
    /// A line of neighbours, with one number on the whole diagonal, often 0.
    Path,
    /// As `Path`, but the first is the neighbour of all others.
    Star,
    /// As `Path`, with neighbours in the rows and columns of a grid.
    Grid,
    /// Each row that before it, turned by one; symmetric or not.
    Circulant,
    /// Entries that grow in the elimination by rows, in units of 1 or of rows and columns.
    Growth,
    /// Kahan's triangle, alone or RᵀR of it: far nearer to singular than its diagonal tells.
    Kahan,
    /// L Lᵀ of a unit triangle L: pivots of 1, whatever the condition.
    Factors,
    /// A diagonal of 1 and one number far larger or smaller beside it: regular in the right units.
    Bidiagonal,
}

const KINDS: [Kind; 16] = [
    Kind::Definite,
    Kind::QuasiDefinite,
    Kind::Kkt,
    Kind::Indefinite,
    Kind::Unsymmetric,
    Kind::Unsymmetric,
    Kind::Unsymmetric,
    Kind::Triangular,
    Kind::Path,
    Kind::Star,
    Kind::Grid,
    Kind::Circulant,
    Kind::Growth,
    Kind::Kahan,
    Kind::Factors,
    Kind::Bidiagonal,
];

/// Dependence of a row or column on others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rank {
    /// None is made.
    Full,
    /// A row (and column) is the sum of others, of whole numbers.
    Exact,
    /// As `Exact`, with real factors: the sum holds to rounding.
    Rounded,
}

/// How rows and columns are scaled, by powers of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scaling {
    /// Not at all.
    None,
    /// Everything by one, as small as 10⁻⁹⁰ or as large as 10⁹⁰.
    Whole,
    /// Each row by 10⁻¹² … 10¹²; of a symmetric matrix rows and columns by the root of it.
    Rows,
    /// Each column by that.
    Columns,
    Both,
    /// Falling from the first row and column to the last.
    Graded,
    /// Each entry of a matrix of full rank by 10⁻⁵⁷ … 10⁵⁷ of its own, which is no scaling of rows and columns.
    Scattered,
}

/// The system of a seed.
#[derive(Debug, Clone)]
pub struct Drawn {
    pub kind: Kind,
    pub rank: Rank,
    /// How it is scaled.
    pub scaling: Scaling,
    /// As a file would hold it.
    pub market: Market,
    signs: Vec<f64>,
}

/// A matrix by rows; `symmetric` where it is to stay so.
struct Made {
    a: Vec<Vec<f64>>,
    symmetric: bool,
}

impl Drawn {
    /// Draws the system of `seed`.
    pub fn of_seed(seed: u64) -> Self {
        let random = &mut Random::new(seed);
        let kind = KINDS[random.below(KINDS.len())];
        let is_dense = matches!(kind, Kind::Growth | Kind::Kahan | Kind::Factors);
        let most = match random.below(20) {
            _ if is_dense => 59,
            0 => 63,
            _ => 20,
        };
        let n = 2 + random.below(most);
        let mut made = made(kind, n, random);
        let rank = [Rank::Full, Rank::Full, Rank::Exact, Rank::Rounded][random.below(4)];
        reduce(&mut made, rank, random);
        let scaling = [
            Scaling::None,
            Scaling::None,
            Scaling::Whole,
            Scaling::Rows,
            Scaling::Columns,
            Scaling::Both,
            Scaling::Graded,
            Scaling::Scattered,
        ][random.below(8)];
        // Scattered, its inverse has no numbers.
        let scaling = match (kind, scaling) {
            (Kind::Bidiagonal, Scaling::Scattered) => Scaling::None,
            _ => scaling,
        };
        if scaling == Scaling::Scattered {
            scatter(&mut made, rank, random);
        } else {
            scale(&mut made, scaling, random);
        }
        let market = written(&mut made, random);
        let signs = (0..made.a.len()).map(|_| random.uniform().signum());
        let signs = signs.collect();
        Self {
            kind,
            rank,
            scaling,
            market,
            signs,
        }
    }

    /// Rows.
    pub fn dim(&self) -> usize {
        self.market.rows
    }

    /// Entries of both triangles.
    pub fn entries(&self) -> Vec<(usize, usize, f64)> {
        let mirrored = |&(r, c, v): &(usize, usize, f64)| {
            let mirror = self.market.symmetric && r != c;
            std::iter::once((r, c, v)).chain(mirror.then_some((c, r, v)))
        };
        self.market.entries.iter().flat_map(mirrored).collect()
    }

    /// By rows, zeros included.
    pub fn full(&self) -> Vec<Vec<f64>> {
        let n = self.dim();
        let mut a = vec![vec![0.0; n]; n];
        for (r, c, v) in self.entries() {
            a[r][c] += v;
        }
        a
    }

    /// b of an x of the sizes of the columns, with signs: without rounding where the entries are whole numbers.
    pub fn right_hand_side(&self, a: &[Vec<f64>], columns: &[f64]) -> Vec<f64> {
        let of_row = |row: &Vec<f64>| {
            let x = columns.iter().zip(&self.signs).map(|(c, s)| c * s);
            let terms = row.iter();
            let terms = terms.zip(x).map(|(&a, x)| DoubleDouble::from(a) * x.into());
            terms
                .fold(DoubleDouble::default(), |sum, term| sum + term)
                .to_f64()
        };
        a.iter().map(of_row).collect()
    }

    /// Positive definite beyond doubt.
    pub fn is_definite(&self) -> bool {
        let is_kept = self.scaling != Scaling::Scattered;
        self.kind == Kind::Definite && self.rank == Rank::Full && self.market.symmetric && is_kept
    }
}

fn made(kind: Kind, n: usize, random: &mut Random) -> Made {
    let symmetric = match kind {
        Kind::Unsymmetric | Kind::Triangular | Kind::Growth | Kind::Bidiagonal => false,
        Kind::Circulant | Kind::Kahan => random.below(2) == 0,
        _ => true,
    };
    let whole = random.below(2) == 0;
    let mut number = || {
        let number = random.uniform();
        if whole {
            (9.0 * number).round()
        } else {
            number
        }
    };
    let zeros = || vec![vec![0.0; n]; n];
    let a = match kind {
        Kind::Definite => springs(n, random),
        Kind::QuasiDefinite | Kind::Kkt => saddle(n, kind == Kind::Kkt, random),
        Kind::Indefinite | Kind::Unsymmetric => {
            let mut a = zeros();
            a.iter_mut().flatten().for_each(|a| *a = number());
            let kept = [1, 2, 4][random.below(3)];
            let dropped =
                |r: usize, c: usize, random: &mut Random| r != c && random.below(kept) > 0;
            for (r, c) in (0..n).flat_map(|r| (0..n).map(move |c| (r, c))) {
                if dropped(r, c, random) {
                    a[r][c] = 0.0;
                }
            }
            a
        }
        Kind::Triangular => {
            let mut a = zeros();
            for (r, row) in a.iter_mut().enumerate() {
                row[..=r].fill_with(&mut number);
                row[r] = 1.0;
            }
            let (rows, columns) = (random.permutation(n), random.permutation(n));
            let at = |r: usize, c: usize| a[rows[r]][columns[c]];
            (0..n).map(|r| (0..n).map(|c| at(r, c)).collect()).collect()
        }
        Kind::Path | Kind::Star | Kind::Grid => {
            let mut a = zeros();
            let wide = (n as f64).sqrt().round() as usize;
            for r in 1..n {
                match kind {
                    Kind::Path => a[r][r - 1] = 1.0,
                    Kind::Star => a[r][0] = 1.0,
                    _ => {
                        a[r][r - 1] = if r % wide > 0 { 1.0 } else { 0.0 };
                        a[r][r.saturating_sub(wide)] = 1.0;
                    }
                }
            }
            let diagonal = [0.0, 0.0, 1.0, 2.0, 4.0, 0.3][random.below(6)];
            (0..n).for_each(|r| a[r][r] = diagonal);
            a
        }
        Kind::Circulant => {
            let row: Vec<f64> = (0..n).map(|_| number()).collect();
            let near = 1 + random.below(n);
            let at = |r: usize, c: usize| {
                if (c + n - r) % n < near {
                    row[(c + n - r) % n]
                } else {
                    0.0
                }
            };
            (0..n).map(|r| (0..n).map(|c| at(r, c)).collect()).collect()
        }
        Kind::Growth => {
            let below = -[1.0, 0.9375, 0.5][random.below(3)];
            let at = |r: usize, c: usize| match r.cmp(&c) {
                _ if c == n - 1 => 1.0,
                std::cmp::Ordering::Equal => 1.0,
                std::cmp::Ordering::Greater => below,
                std::cmp::Ordering::Less => 0.0,
            };
            (0..n).map(|r| (0..n).map(|c| at(r, c)).collect()).collect()
        }
        Kind::Kahan => kahan(n, symmetric, random),
        Kind::Factors => factors(n, random),
        Kind::Bidiagonal => {
            // A⁻¹ stays within 10^±100.
            let most = 330.0 / n as f64;
            let above = 2.0_f64.powi((most.min(100.0) * random.uniform()) as i32);
            let at = |r: usize, c: usize| match c.wrapping_sub(r) {
                0 => 1.0,
                1 => above,
                _ => 0.0,
            };
            (0..n).map(|r| (0..n).map(|c| at(r, c)).collect()).collect()
        }
    };
    let mut made = Made { a, symmetric };
    mirror(&mut made);
    made
}

/// The lower triangle into the upper one.
fn mirror(made: &mut Made) {
    if made.symmetric {
        for r in 0..made.a.len() {
            for c in 0..r {
                made.a[c][r] = made.a[r][c];
            }
        }
    }
}

/// R with sⁱ on the diagonal and −c sⁱ right of it, s² + c² = 1; RᵀR of it.
fn kahan(n: usize, squared: bool, random: &mut Random) -> Vec<Vec<f64>> {
    let angle = [0.3_f64, 0.7, 1.2][random.below(3)] + 0.1 * random.uniform();
    let (s, c) = angle.sin_cos();
    let at = |row: usize, column: usize| match row.cmp(&column) {
        std::cmp::Ordering::Equal => s.powi(row as i32),
        std::cmp::Ordering::Less => -c * s.powi(row as i32),
        std::cmp::Ordering::Greater => 0.0,
    };
    let r: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| at(i, j)).collect()).collect();
    if !squared {
        return r;
    }
    let product = |i: usize, j: usize| (0..n).map(|k| r[k][i] * r[k][j]).sum();
    (0..n)
        .map(|i| (0..n).map(|j| product(i, j)).collect())
        .collect()
}

/// L Lᵀ with 1 on the diagonal of L and numbers of one sign, or of both, below it, in a band or everywhere; sixteenths, so that
/// the product has no rounding, or any.
fn factors(n: usize, random: &mut Random) -> Vec<Vec<f64>> {
    let (from, to) = [(0.6, 1.4), (0.2, 0.6), (1.0, 2.5), (-1.0, 1.0)][random.below(4)];
    let band = [1, 2, n][random.below(3)];
    let exact = random.below(2) == 0;
    let mut l = vec![vec![0.0; n]; n];
    for (r, row) in l.iter_mut().enumerate() {
        row[r] = 1.0;
        for entry in &mut row[r.saturating_sub(band)..r] {
            let below = from + (to - from) * (0.5 + 0.5 * random.uniform());
            *entry = if exact {
                -(16.0 * below).round() / 16.0
            } else {
                -below
            };
        }
    }
    let product = |i: usize, j: usize| (0..n).map(|k| l[i][k] * l[j][k]).sum();
    (0..n)
        .map(|i| (0..n).map(|j| product(i, j)).collect())
        .collect()
}

fn springs(n: usize, random: &mut Random) -> Vec<Vec<f64>> {
    let mut a = vec![vec![0.0; n]; n];
    let decades = [1.0, 1e3, 1e6][random.below(3)];
    for r in 0..n {
        a[r][r] += if random.below(3) == 0 || r == 0 {
            random.log_uniform(0.1, 10.0)
        } else {
            0.0
        };
        for _ in 0..random.below(3) + usize::from(r > 0) {
            let c = random.below(n);
            if c != r {
                let stiff = random.log_uniform(1.0, decades);
                let (low, high) = (r.max(c), r.min(c));
                a[low][high] -= stiff;
                a[r][r] += stiff;
                a[c][c] += stiff;
            }
        }
        // Tied to the one before, so that all are held.
        if r > 0 {
            a[r][r - 1] -= 1.0;
            a[r][r] += 1.0;
            a[r - 1][r - 1] += 1.0;
        }
    }
    a
}

/// Bodies first, or each before the row that holds it.
fn saddle(n: usize, cleared: bool, random: &mut Random) -> Vec<Vec<f64>> {
    let mut a = vec![vec![0.0; n]; n];
    let alternating = random.below(2) == 0;
    let is_row = |r: usize| {
        if alternating {
            r % 2 == 1
        } else {
            r >= n.div_ceil(2)
        }
    };
    let (heavy, soft) = (random.log_uniform(1.0, 1e6), random.log_uniform(1e-12, 1.0));
    for (r, row) in a.iter_mut().enumerate() {
        for (c, entry) in row[..r].iter_mut().enumerate() {
            if is_row(r) != is_row(c) && random.below(3) > 0 {
                *entry = random.uniform();
            }
        }
        row[r] = match is_row(r) {
            false => random.log_uniform(1.0, heavy.max(1.1)),
            true if cleared => 0.0,
            true => -soft,
        };
    }
    for r in (0..n).filter(|&r| cleared && is_row(r)) {
        if random.below(3) == 0 {
            (0..n).for_each(|c| a[r.max(c)][r.min(c)] = 0.0);
            a[r][r] = -1.0;
        }
    }
    a
}

/// Makes a row, and of a symmetric matrix the column, depend on others.
fn reduce(made: &mut Made, rank: Rank, random: &mut Random) {
    let n = made.a.len();
    if rank == Rank::Full || n < 3 {
        return;
    }
    let order = random.permutation(n);
    let (to, from) = (order[0], &order[1..n.min(4)]);
    let parts: Vec<f64> = match rank {
        Rank::Exact => from
            .iter()
            .map(|_| [1.0, -1.0, 2.0][random.below(3)])
            .collect(),
        _ => from.iter().map(|_| random.uniform()).collect(),
    };
    if rank == Rank::Exact {
        let largest = made.a.iter();
        let largest = largest.flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
        let unit = if largest > 1e3 { largest / 1e3 } else { 0.1 };
        made.a
            .iter_mut()
            .flatten()
            .for_each(|a| *a = (*a / unit).round());
    }
    let mix =
        |v: &dyn Fn(usize) -> f64| from.iter().zip(&parts).map(|(&k, p)| p * v(k)).sum::<f64>();
    let row: Vec<f64> = (0..n).map(|c| mix(&|k| made.a[k][c])).collect();
    let by_column = !made.symmetric && random.below(2) == 0;
    if by_column {
        let column: Vec<f64> = (0..n).map(|r| mix(&|k| made.a[r][k])).collect();
        (0..n).for_each(|r| made.a[r][to] = column[r]);
        return;
    }
    made.a[to].copy_from_slice(&row);
    if made.symmetric {
        let corner = mix(&|k| row[k]);
        (0..n).for_each(|r| made.a[r][to] = row[r]);
        made.a[to][to] = corner;
    }
}

/// Entries by powers of two of their own; of a matrix that is to be singular nothing.
fn scatter(made: &mut Made, rank: Rank, random: &mut Random) {
    if rank != Rank::Full {
        return;
    }
    for r in 0..made.a.len() {
        for c in 0..made.a.len() {
            if made.symmetric && c < r {
                made.a[r][c] = made.a[c][r];
            } else {
                made.a[r][c] *= 2.0_f64.powi((190.0 * random.uniform()).round() as i32);
            }
        }
    }
}

fn scale(made: &mut Made, scaling: Scaling, random: &mut Random) {
    let n = made.a.len();
    // 10^±12 is 2^±40.
    let power =
        |most: f64, random: &mut Random| 2.0_f64.powi((most * random.uniform()).round() as i32);
    let of = |wanted: bool, most: f64, random: &mut Random| -> Vec<f64> {
        (0..n)
            .map(|_| if wanted { power(most, random) } else { 1.0 })
            .collect()
    };
    let (mut rows, mut columns) = match scaling {
        Scaling::None | Scaling::Scattered => return,
        Scaling::Whole => (vec![power(300.0, random); n], vec![1.0; n]),
        Scaling::Rows => (of(true, 40.0, random), of(false, 0.0, random)),
        Scaling::Columns => (of(false, 0.0, random), of(true, 40.0, random)),
        Scaling::Both => (of(true, 40.0, random), of(true, 40.0, random)),
        Scaling::Graded => {
            let fall = -40.0 / n as f64;
            let graded = (0..n).map(|r| 2.0_f64.powi((fall * r as f64) as i32));
            let graded: Vec<f64> = graded.collect();
            (graded.clone(), graded)
        }
    };
    if made.symmetric && scaling != Scaling::Whole && scaling != Scaling::Graded {
        if random.below(3) == 0 {
            made.symmetric = false;
        } else {
            rows = of(true, 20.0, random);
            columns.copy_from_slice(&rows);
        }
    }
    for (r, row) in made.a.iter_mut().enumerate() {
        row.iter_mut()
            .zip(&columns)
            .for_each(|(a, c)| *a *= rows[r] * c);
    }
}

/// Its entries in some order, with zeros and entries in two parts, sometimes with an empty row or in blocks.
fn written(made: &mut Made, random: &mut Random) -> Market {
    let n = made.a.len();
    if random.below(20) == 0 {
        let empty = random.below(n);
        made.a[empty].fill(0.0);
        if made.symmetric {
            made.a.iter_mut().for_each(|row| row[empty] = 0.0);
        }
    }
    let [zeros, doubled] = [(); 2].map(|()| random.below(3) == 0);
    let mut entries = Vec::new();
    for r in 0..n {
        for c in 0..if made.symmetric { r + 1 } else { n } {
            match made.a[r][c] {
                0.0 => {
                    if zeros && random.below(4) == 0 {
                        entries.push((r, c, 0.0));
                    } else if doubled && random.below(8) == 0 {
                        entries.extend([(r, c, 1.5), (r, c, -1.5)]);
                    }
                }
                v if doubled && random.below(4) == 0 => entries.extend([(r, c, 0.5 * v); 2]),
                v => entries.push((r, c, v)),
            }
        }
    }
    let order = random.permutation(entries.len().max(1));
    let blocks = if made.symmetric && random.below(4) == 0 {
        let pairs = std::iter::repeat_n(2, n / 2);
        pairs.chain((!n.is_multiple_of(2)).then_some(1)).collect()
    } else {
        Vec::new()
    };
    Market {
        rows: n,
        columns: n,
        array: false,
        symmetric: made.symmetric,
        entries: order
            .into_iter()
            .filter_map(|k| entries.get(k).copied())
            .collect(),
        blocks,
        ..Market::default()
    }
}
