//! Linear systems as files: those of a step written as Matrix Market, any others read, and every backend on them.
//!
//! A system is a matrix A, symmetric by blocks or general, a right-hand side b and, where it is known, the solution x.
//! Files are named as in the SuiteSparse collection: `A.mtx`, beside it `A_b.mtx` and `A_x.mtx`, each of them also as
//! `.mtx.gz`. A matrix that is stored as general and is symmetric to the last bit counts as symmetric.
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `market`, `write` | Matrix Market text, read and written |
//! | `order` | the elimination order of a matrix that has no good one of its own |
//! | `prepared` | one backend on one matrix, symmetric or not, in its phases |
//! | `exact` | solutions in extended precision, and how ill-conditioned a matrix is |
//! | `solve` | every backend on a system: times and errors |
//! | `dump` | the system of a step as files |
//! | `sequence` | the systems of consecutive steps as files |

pub mod dump;
pub mod exact;
pub mod market;
pub mod order;
pub mod prepared;
pub mod sequence;
pub mod solve;
pub mod write;

pub use market::MarketError;

use market::Market;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use taut_solver::{
    BackwardError, BlockPattern, DoubleDouble, GeneralMatrix, SolveError, SymBlockMatrix,
    backward_error, backward_error_general,
};

/// A square matrix of either kind.
#[derive(Debug, Clone, PartialEq)]
pub enum Matrix {
    /// Symmetric, with its blocks; scalar ones where nothing is known.
    Symmetric(SymBlockMatrix),
    /// Not symmetric.
    General(GeneralMatrix),
}

impl Matrix {
    /// Dimension.
    pub fn dim(&self) -> usize {
        match self {
            Self::Symmetric(a) => a.dim(),
            Self::General(a) => a.dim(),
        }
    }

    /// Number of block rows; of a general matrix that of its rows.
    pub fn blocks(&self) -> usize {
        match self {
            Self::Symmetric(a) => a.pattern().blocks(),
            Self::General(a) => a.dim(),
        }
    }

    /// Calls `f(r, c, a_rc)` for each entry, of both triangles.
    pub fn for_each(&self, mut f: impl FnMut(usize, usize, f64)) {
        match self {
            Self::General(a) => a.for_each(f),
            Self::Symmetric(a) => a.for_each_lower(|r, c, value| {
                f(r, c, value);
                if r != c {
                    f(c, r, value);
                }
            }),
        }
    }

    /// Stored entries, of both triangles.
    pub fn entries(&self) -> usize {
        let mut entries = 0;
        self.for_each(|_, _, _| entries += 1);
        entries
    }

    /// Backward errors of `x` as a solution of A x = b.
    pub fn backward_error(&self, b: &[f64], x: &[f64]) -> Result<BackwardError, SolveError> {
        match self {
            Self::Symmetric(a) => backward_error(a, b, x),
            Self::General(a) => backward_error_general(a, b, x),
        }
    }
}

/// Which triangle of a symmetric matrix stands for the whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Triangle {
    /// Below the diagonal: factors L Lᵀ.
    Lower,
    /// Above it: factors Uᵀ U.
    Upper,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RightHandSide {
    File(PathBuf),
    /// A·1, summed in extended precision and rounded.
    Ones {
        /// No rounding occurred, so the solution is exactly 1.
        exact: bool,
    },
}

/// Entries of a file that a matrix does not hold as such.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dropped {
    /// Stood at the place of an earlier one and were added to it.
    pub duplicates: usize,
    /// Zeros, as they stood or as the sum of several.
    pub zeros: usize,
}

/// A system that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// Name of the file without its ending.
    pub name: String,
    pub matrix: Matrix,
    /// Entries of the file that are none of the matrix.
    pub dropped: Dropped,
    pub b: Vec<f64>,
    /// Where b comes from.
    pub from: RightHandSide,
    /// x from a file, and which.
    pub x: Option<(Vec<f64>, PathBuf)>,
}

impl System {
    /// Reads a matrix, and b and x from the files given. Where none is given they are read from those beside the matrix,
    /// x only together with b; without them b is A·1.
    pub fn read(path: &Path, b: Option<&Path>, x: Option<&Path>) -> Result<Self, MarketError> {
        let (matrix, dropped) = matrix_of(&market::read(path)?, path)?;
        let beside_b = b.is_none().then(|| sibling(path, "b")).flatten();
        let beside_x = beside_b.is_some().then(|| sibling(path, "x")).flatten();
        let read = |path: PathBuf| {
            let v = vector_of(&market::read(&path)?, &path, matrix.dim())?;
            Ok((v, path))
        };
        let b = b.map(Path::to_owned).or(beside_b).map(read).transpose()?;
        let x = x.map(Path::to_owned).or(beside_x);
        let x = x.map(read).transpose()?;
        let (b, from) = match b {
            Some((b, path)) => (b, RightHandSide::File(path)),
            None => {
                let (b, exact) = times_ones(&matrix);
                (b, RightHandSide::Ones { exact })
            }
        };
        if let Some(row) = b.iter().position(|b| !b.is_finite()) {
            return Err(shape(
                path,
                format!("row {} of A·1 overflows: give a right-hand side", row + 1),
            ));
        }
        Ok(Self {
            name: stem(path),
            matrix,
            dropped,
            b,
            from,
            x,
        })
    }
}

/// A file of a folder, plain or compressed.
pub(crate) fn member(folder: &Path, name: &str) -> PathBuf {
    let plain = folder.join(format!("{name}.mtx"));
    let packed = folder.join(format!("{name}.mtx.gz"));
    if !plain.exists() && packed.exists() {
        packed
    } else {
        plain
    }
}

pub(crate) fn shape(path: &Path, message: String) -> MarketError {
    MarketError {
        path: path.to_owned(),
        line: None,
        message,
    }
}

/// Name of a file without `.mtx` and `.gz`.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.strip_suffix(".mtx").unwrap_or(name).to_owned()
}

/// `A_b.mtx` or `A_b.mtx.gz` beside `A.mtx`, if there is one.
fn sibling(path: &Path, what: &str) -> Option<PathBuf> {
    let stem = stem(path);
    let names = ["mtx", "mtx.gz"].map(|end| path.with_file_name(format!("{stem}_{what}.{end}")));
    names.into_iter().find(|p| p.is_file())
}

/// The files that a system is read from: the matrix, and those of b and x that there are beside it.
pub fn files(path: &Path) -> Vec<PathBuf> {
    let beside = ["b", "x"]
        .into_iter()
        .filter_map(|what| sibling(path, what));
    std::iter::once(path.to_owned()).chain(beside).collect()
}

/// The matrix of a file without its zeros, and what was dropped.
pub fn matrix_of(market: &Market, path: &Path) -> Result<(Matrix, Dropped), MarketError> {
    matrix_with(market, path, GeneralMatrix::drop_zeros)
}

/// The matrix of a file with its stored zeros, for systems that share one pattern.
pub(crate) fn stored_matrix_of(market: &Market, path: &Path) -> Result<Matrix, MarketError> {
    matrix_with(market, path, |_| 0).map(|(matrix, _)| matrix)
}

fn matrix_with(
    market: &Market,
    path: &Path,
    drop_zeros: fn(&mut GeneralMatrix) -> usize,
) -> Result<(Matrix, Dropped), MarketError> {
    let n = market.rows;
    let fault = |message: String| shape(path, message);
    if n != market.columns {
        return Err(fault(format!(
            "{n} × {} is not square: only square systems are solved",
            market.columns
        )));
    }
    if n == 0 {
        return Err(fault(
            "the matrix has no rows: there is nothing to solve".to_owned(),
        ));
    }
    // Before anything is made that is as large as the header says: each row of a regular matrix holds an entry.
    let reached = if market.symmetric { 2 } else { 1 } * market.entries.len();
    if reached < n {
        let mut held: Vec<usize> = market.entries.iter().map(|(row, ..)| *row).collect();
        if market.symmetric {
            held.extend(market.entries.iter().map(|(_, column, _)| *column));
        }
        held.sort_unstable();
        held.dedup();
        let empty = held.iter().zip(0..).take_while(|(row, k)| **row == *k);
        return Err(fault(format!(
            "{n} rows, {} entries: it is singular, row {} holds nothing",
            market.entries.len(),
            empty.count() + 1
        )));
    }
    let given = market.entries.len();
    let entries = GeneralMatrix::from_entries(n, market.entries.clone());
    let mut entries = entries.map_err(|e| fault(e.to_string()))?;
    if !entries.values().iter().all(|v| v.is_finite()) {
        return Err(fault(
            "entries at one place add up to more than a double holds: scale them".to_owned(),
        ));
    }
    let duplicates = given - entries.values().len();
    let zeros = drop_zeros(&mut entries);
    let dropped = Dropped { duplicates, zeros };
    if !market.symmetric && !entries.is_symmetric() {
        return Ok((Matrix::General(entries), dropped));
    }
    let a = symmetric(&entries, market).map_err(fault)?;
    Ok((Matrix::Symmetric(a), dropped))
}

/// Numbers that blocks may hold whatever the entries of the file; beyond it they are to be at most 16 for each.
const FEW: usize = 1 << 20;

/// The lower triangle of `lower` with the blocks of `market`.
fn symmetric(lower: &GeneralMatrix, market: &Market) -> Result<SymBlockMatrix, String> {
    const CURE: &str = "correct that comment, or drop it";
    let n = lower.dim();
    let sizes = if market.blocks.is_empty() {
        vec![1; n]
    } else {
        market.blocks.clone()
    };
    let rows = sizes
        .iter()
        .try_fold(0_usize, |sum, &size| sum.checked_add(size));
    if rows != Some(n) {
        return Err(format!(
            "the sizes in `% blocks` do not add up to {n} rows: {CURE}"
        ));
    }
    for (what, found) in [
        ("groups", market.groups.len()),
        ("signs", market.signs.len()),
    ] {
        if found != 0 && found != sizes.len() {
            return Err(format!(
                "`% {what}` are {found} for {} blocks: {CURE}",
                sizes.len()
            ));
        }
    }
    let pattern = BlockPattern::of_lower(lower, &sizes).map_err(|e| e.to_string())?;
    let pattern = if market.groups.is_empty() {
        pattern
    } else {
        let grouped = pattern.with_groups(market.groups.clone());
        grouped.map_err(|e| e.to_string())?
    };
    let (numbers, entries) = (pattern.stored_values(), market.entries.len());
    if numbers > FEW.max(16 * entries) {
        return Err(format!(
            "the blocks in `% blocks` hold {numbers} numbers, the file {entries} entries: {CURE}"
        ));
    }
    let mut a = SymBlockMatrix::try_zeros(Arc::new(pattern)).map_err(|e| e.to_string())?;
    a.set_lower(lower).map_err(|e| e.to_string())?;
    Ok(a)
}

/// The vector of a file: one column of `n` rows.
pub fn vector_of(market: &Market, path: &Path, n: usize) -> Result<Vec<f64>, MarketError> {
    if market.rows != n || market.columns != 1 {
        return Err(shape(
            path,
            format!(
                "{} × {} is no vector for a matrix of {n} rows: one number a row is needed, several vectors in as many files",
                market.rows, market.columns
            ),
        ));
    }
    let mut v = vec![0.0; n];
    let mut known = vec![false; n];
    for &(row, _, value) in &market.entries {
        if known[row] {
            v[row] += value;
        } else {
            (v[row], known[row]) = (value, true);
        }
    }
    if let Some(row) = v.iter().position(|v| !v.is_finite()) {
        return Err(shape(
            path,
            format!(
                "the entries of row {} add up to more than a double holds: scale them",
                row + 1
            ),
        ));
    }
    Ok(v)
}

/// A·1 in extended precision, rounded, and whether nothing was lost by that.
fn times_ones(a: &Matrix) -> (Vec<f64>, bool) {
    let mut sums = vec![DoubleDouble::default(); a.dim()];
    a.for_each(|r, _, value| sums[r] = sums[r] + value.into());
    let exact = sums.iter().all(|&s| s - s.to_f64().into() == 0.0.into());
    (sums.into_iter().map(DoubleDouble::to_f64).collect(), exact)
}

#[cfg(test)]
mod tests;
