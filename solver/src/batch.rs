//! Many cables at once: systems of equal pattern side by side, one in each lane of a vector.
//!
//! A cable's elimination is a chain of dependent divisions, and on one cable much of a processor waits. Cables of equal
//! shape (a fleet, samples of an uncertain load, gradients) are independent, so that each lane takes its own. For that
//! their numbers stand together: entry e of cable c of a quantity of n entries is number
//! `((c / 8) n + e) 8 + c % 8` ([`batch_index`]). That is the layout of matrices, right-hand sides and solutions.

use crate::block_ldlt::{BlockLdlt, NOISE, Pivots};
use crate::chain::Chain;
use crate::chain::batch::{self, LANES, spread};
use crate::error::{expect_len, expect_room};
use crate::matrix::check_finite;
use crate::{BlockPattern, SolveError, SymBlockMatrix};
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use taut_lanes::Aligned;
use taut_lanes::vector::gather;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// Place of entry `entry` of cable `cable` in a quantity with `len` entries for each cable.
#[must_use]
pub fn batch_index(len: usize, entry: usize, cable: usize) -> usize {
    (cable / LANES * len + entry) * LANES + cable % LANES
}

/// Numbers of a quantity with `len` entries for each of `count` cables: a multiple of eight of each, at most `usize::MAX`.
#[must_use]
pub fn batch_len(len: usize, count: usize) -> usize {
    count
        .div_ceil(LANES)
        .saturating_mul(len.saturating_mul(LANES))
}

/// The matrices of a batch: symmetric, of one pattern, with the values of all cables side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchMatrix {
    pattern: Arc<BlockPattern>,
    count: usize,
    values: Aligned,
}

impl BatchMatrix {
    /// Zero matrices of a pattern for `count` cables. Allocates.
    ///
    /// # Errors
    /// [`SolveError::TooLarge`] where there is no memory for their values.
    pub fn zeros(pattern: Arc<BlockPattern>, count: usize) -> Result<Self, SolveError> {
        let len = batch_len(pattern.stored_values(), count);
        expect_room::<f64>(len)?;
        Ok(Self {
            pattern,
            count,
            values: Aligned::new(len),
        })
    }

    /// The pattern of each.
    #[must_use]
    pub fn pattern(&self) -> &Arc<BlockPattern> {
        &self.pattern
    }

    /// Number of cables.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// All values, `batch_len(pattern.stored_values(), count)` of them: stored value `v` of cable `c` is number `batch_index(pattern.stored_values(), v, c)`.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The same, to be written.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Copies the matrix of one cable in. Spreading the values costs about as much as factorising them: where speed
    /// matters assemble into [`values_mut`](Self::values_mut), or leave each matrix where it is
    /// ([`BatchBanded::factorize_each`]).
    ///
    /// # Errors
    /// [`SolveError::PatternChanged`], [`SolveError::Dimension`] for a cable that is not there.
    pub fn set(&mut self, cable: usize, a: &SymBlockMatrix) -> Result<(), SolveError> {
        self.expect_cable(cable)?;
        if **a.pattern() != *self.pattern {
            return Err(SolveError::PatternChanged);
        }
        let len = a.values().len();
        let values = &mut *self.values;
        for (v, &value) in a.values().iter().enumerate() {
            values[batch_index(len, v, cable)] = value;
        }
        Ok(())
    }

    /// Copies the matrix of one cable out, into a matrix of the same pattern. Allocates nothing.
    ///
    /// # Errors
    /// As for [`set`](Self::set).
    pub fn get(&self, cable: usize, a: &mut SymBlockMatrix) -> Result<(), SolveError> {
        self.expect_cable(cable)?;
        if **a.pattern() != *self.pattern {
            return Err(SolveError::PatternChanged);
        }
        let len = self.pattern.stored_values();
        let values = &*self.values;
        for (v, value) in a.values_mut().iter_mut().enumerate() {
            *value = values[batch_index(len, v, cable)];
        }
        Ok(())
    }

    fn expect_cable(&self, cable: usize) -> Result<(), SolveError> {
        if cable < self.count {
            return Ok(());
        }
        Err(SolveError::Dimension {
            what: "cable",
            expected: self.count,
            found: cable,
        })
    }
}

/// Puts vectors of four cables, of number `first` on, where a batch has them: entry `r` of cable `first + k` at
/// `batch_index(len, r, first + k)`. Allocates nothing.
///
/// # Errors
/// [`SolveError::InvalidOption`] where `first` is no multiple of four, [`SolveError::Dimension`] where the vectors differ
/// in length or do not fit.
pub fn batch_set_four(to: &mut [f64], first: usize, from: [&[f64]; 4]) -> Result<(), SolveError> {
    let eight = place_of_four(first, from.map(<[f64]>::len), to.len())?;
    let (to, _) = to[eight].as_chunks_mut::<LANES>();
    let lane = first % LANES;
    dispatch(Level::best(), Spread { from, to, lane });
    Ok(())
}

/// The reverse of [`batch_set_four`]. Allocates nothing.
///
/// # Errors
/// As there.
pub fn batch_get_four(from: &[f64], first: usize, to: [&mut [f64]; 4]) -> Result<(), SolveError> {
    let lens = [to[0].len(), to[1].len(), to[2].len(), to[3].len()];
    let eight = place_of_four(first, lens, from.len())?;
    let (from, _) = from[eight].as_chunks::<LANES>();
    let lane = first % LANES;
    dispatch(Level::best(), Collect { from, to, lane });
    Ok(())
}

/// Where the eight are that four cables are among, in numbers of a batch.
fn place_of_four(first: usize, lens: [usize; 4], all: usize) -> Result<Range<usize>, SolveError> {
    if !first.is_multiple_of(4) {
        return Err(SolveError::InvalidOption {
            option: "first",
            allowed: "a multiple of four",
        });
    }
    let len = lens[0];
    for found in lens {
        expect_len("vector", len, found)?;
    }
    let begin = (first / LANES).saturating_mul(len * LANES);
    let end = begin.saturating_add(len * LANES);
    if end > all {
        return Err(SolveError::Dimension {
            what: "batch",
            expected: end,
            found: all,
        });
    }
    Ok(begin..end)
}

/// Arrays of four cables side by side, into four lanes.
struct Spread<'a> {
    from: [&'a [f64]; 4],
    to: &'a mut [[f64; LANES]],
    lane: usize,
}

impl Kernel for Spread<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        spread::<I::X4>(self.from, self.to, self.lane);
    }
}

/// The reverse of [`Spread`].
struct Collect<'a> {
    from: &'a [[f64; LANES]],
    to: [&'a mut [f64]; 4],
    lane: usize,
}

impl Kernel for Collect<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        const TOGETHER: usize = 4;
        let Self { from, to, lane } = self;
        let (groups, rest) = from.as_chunks::<TOGETHER>();
        let [a, b, c, d] = to.map(|v| v.as_chunks_mut::<TOGETHER>());
        let each = a.0.iter_mut().zip(b.0).zip(c.0.iter_mut().zip(d.0));
        for (from, ((a, b), (c, d))) in groups.iter().zip(each) {
            let rows = from.each_ref().map(|row| four_from(row, lane));
            let cables: [I::X4; TOGETHER] = gather(rows);
            for (cable, to) in cables.iter().zip([a, b, c, d]) {
                cable.store(to);
            }
        }
        for (cable, to) in [a.1, b.1, c.1, d.1].into_iter().enumerate() {
            for (to, from) in to.iter_mut().zip(rest) {
                *to = from[lane + cable];
            }
        }
    }
}

/// The four numbers of the first or the last four lanes.
#[inline(always)]
fn four_from(row: &[f64; LANES], lane: usize) -> &[f64; 4] {
    let (fours, _) = row.as_chunks::<4>();
    &fours[lane / 4]
}

/// Why a batch has no solutions.
#[derive(Debug, Clone, PartialEq)]
pub struct BatchError {
    /// The first cable that fails; `None` where the call itself is at fault.
    pub cable: Option<usize>,
    /// The fault.
    pub error: SolveError,
}

impl fmt::Display for BatchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.cable {
            Some(cable) => write!(f, "cable {cable}: {}", self.error),
            None => self.error.fmt(f),
        }
    }
}

impl std::error::Error for BatchError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&self.error)
    }
}

impl From<SolveError> for BatchError {
    fn from(error: SolveError) -> Self {
        Self { cable: None, error }
    }
}

/// Direct solver of a batch of chains, as the `banded` backend is of one: positive definite matrices. Each cable's result
/// agrees with that of `banded` to rounding (the elimination runs from one end only), and does not depend on its
/// neighbours or on their number, up to rounding.
///
/// Singular matrices are refused where a pivot shows it, as of a row that repeats another: `banded` also tests those whose
/// weak pivots are above the noise of their own rows.
///
/// Pivots below 1e-120 are refused, for squares of such numbers lose digits to underflow, and so is what overflows where
/// it is squared (entries beyond 1e154): scale such matrices.
///
/// As many cables go together as a register holds doubles; fewer than four that are left over go one by one.
///
/// ```
/// use std::sync::Arc;
/// use taut_solver::{BatchBanded, BatchMatrix, BlockPattern, batch_index, batch_len};
///
/// let pattern = Arc::new(BlockPattern::new(&[1, 1], &[(1, 0)])?);
/// let mut a = BatchMatrix::zeros(pattern.clone(), 5)?;
/// let (mut b, mut x) = (vec![0.0; batch_len(2, 5)], vec![0.0; batch_len(2, 5)]);
/// for cable in 0..5 {
///     for (v, value) in [2.0 + cable as f64, -1.0, 2.0].into_iter().enumerate() {
///         a.values_mut()[batch_index(3, v, cable)] = value;
///     }
///     b[batch_index(2, 0, cable)] = 1.0;
/// }
/// let mut solver = BatchBanded::new(&pattern, 5)?;
/// solver.factorize(&a)?;
/// solver.solve(&b, &mut x)?;
/// assert!((x[batch_index(2, 0, 3)] - 2.0 / 9.0).abs() < 1e-15);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct BatchBanded {
    pattern: Arc<BlockPattern>,
    count: usize,
    order: batch::InOrder,
    /// Cables that are factorised together.
    sides: Vec<Side>,
    /// Cables that fill no side.
    single: Option<Single>,
    factorized: bool,
}

/// Cables side by side.
#[derive(Debug, Clone)]
struct Side {
    /// Which eight they are among.
    eight: usize,
    side: batch::Side,
    factor: Aligned,
    half: Vec<f64>,
}

impl Side {
    /// Their first one's place among the eight, and their factor.
    fn with_factor(&mut self) -> (usize, &mut [f64]) {
        (self.side.lane, &mut *self.factor)
    }
}

/// Cables that are worked on one by one, each with its factor.
#[derive(Debug, Clone)]
struct Single {
    first: usize,
    chains: Vec<Chain>,
    a: SymBlockMatrix,
    b: Vec<f64>,
    x: Vec<f64>,
}

impl BatchBanded {
    /// For `count` matrices of `pattern`. Allocates all that is needed.
    ///
    /// # Errors
    /// [`SolveError::InvalidOption`] where the pattern is no chain in its order, or a block has more than six rows;
    /// [`SolveError::TooLarge`] where there is no memory for as many factors.
    pub fn new(pattern: &Arc<BlockPattern>, count: usize) -> Result<Self, BatchError> {
        Self::with_level(pattern, count, Level::best())
    }

    pub(crate) fn with_level(
        pattern: &Arc<BlockPattern>,
        count: usize,
        level: Level,
    ) -> Result<Self, BatchError> {
        let order = batch::InOrder::new(pattern);
        let (Some(order), Some(chain)) = (order, Chain::new(pattern, level)) else {
            let error = SolveError::InvalidOption {
                option: "pattern",
                allowed: "chains whose blocks couple to their neighbours only and have at most 6 rows",
            };
            return Err(error.into());
        };
        let [factor, half] = order.storage(LANES);
        let of_eight = factor + half + size_of::<Side>() / size_of::<f64>();
        expect_room::<f64>(count.div_ceil(LANES).saturating_mul(of_eight))?;
        let (mut sides, mut first, mut level) = (Vec::new(), 0, level);
        while first < count {
            if count - first < level.widest() {
                // Four are worth their own vectors, fewer are not.
                let four = Level::available().into_iter().find(|l| l.widest() == 4);
                match four.filter(|_| level.widest() > 4 && count - first >= 4) {
                    Some(four) => level = four,
                    None => break,
                }
            }
            let [factor, half] = order.storage(level.widest());
            let lane = first % LANES;
            sides.push(Side {
                eight: first / LANES,
                side: batch::Side { lane, level },
                factor: Aligned::new(factor),
                half: vec![0.0; half],
            });
            first += level.widest();
        }
        let single = (first < count).then(|| Single {
            first,
            chains: vec![chain; count - first],
            a: SymBlockMatrix::zeros(pattern.clone()),
            b: vec![0.0; pattern.dim()],
            x: vec![0.0; pattern.dim()],
        });
        Ok(Self {
            pattern: pattern.clone(),
            count,
            order,
            sides,
            single,
            factorized: false,
        })
    }

    /// Factorises the matrices of a batch. Allocates nothing where it succeeds.
    ///
    /// # Errors
    /// Error of the first cable that fails: [`SolveError::Singular`],
    /// [`SolveError::NotPositiveDefinite`], [`SolveError::OutOfRange`] or [`SolveError::NonFinite`]
    /// with the block (entries above the diagonal are not looked at). Also
    /// [`SolveError::PatternChanged`] and [`SolveError::Dimension`]. After an error no cable has a
    /// factor.
    pub fn factorize(&mut self, a: &BatchMatrix) -> Result<(), BatchError> {
        self.factorized = false;
        if !Arc::ptr_eq(&self.pattern, &a.pattern) && *self.pattern != *a.pattern {
            return Err(SolveError::PatternChanged.into());
        }
        expect_len("cables", self.count, a.count)?;
        let stored = self.pattern.stored_values();
        let (values, _) = a.values.as_chunks::<LANES>();
        self.factorize_from(
            |eight, _| batch::Together(&values[eight * stored..(eight + 1) * stored]),
            |cable, to| a.get(cable, to),
        )
    }

    /// Factorises matrices that are stored separately. `a(cable)` returns the matrix of a cable; it
    /// is called several times and must return the same matrix each time. The elimination
    /// interleaves the values as it reaches them, which costs less than filling a [`BatchMatrix`].
    /// Allocates nothing where it succeeds.
    ///
    /// # Errors
    /// As for [`factorize`](Self::factorize); [`SolveError::PatternChanged`] names the cable.
    pub fn factorize_each<'a>(
        &mut self,
        a: impl Fn(usize) -> &'a SymBlockMatrix,
    ) -> Result<(), BatchError> {
        self.factorized = false;
        for cable in 0..self.count {
            let pattern = a(cable).pattern();
            if !Arc::ptr_eq(&self.pattern, pattern) && *self.pattern != **pattern {
                let cable = Some(cable);
                let error = SolveError::PatternChanged;
                return Err(BatchError { cable, error });
            }
        }
        let four = |first: usize, cables: &Range<usize>| {
            // Lanes outside the range of cables repeat its nearest cable.
            let cable = |k: usize| (first + k).clamp(cables.start, cables.end - 1);
            let some = first < cables.end && first + 4 > cables.start;
            some.then(|| [0, 1, 2, 3].map(|k| a(cable(k)).values()))
        };
        self.factorize_from(
            |eight, cables| batch::Apart([0, 4].map(|lane| four(eight * LANES + lane, &cables))),
            |cable, to| {
                to.values_mut().copy_from_slice(a(cable).values());
                Ok(())
            },
        )
    }

    /// Factorises matrices given by the values of some cables, all among the same eight, and by one cable's matrix.
    fn factorize_from<V: batch::Values>(
        &mut self,
        values: impl Fn(usize, Range<usize>) -> V,
        one: impl Fn(usize, &mut SymBlockMatrix) -> Result<(), SolveError>,
    ) -> Result<(), BatchError> {
        let same = |a: &Side, b: &Side| a.eight == b.eight && a.side.level == b.side.level;
        let eights = self.sides.chunk_by_mut(same);
        for sides in eights.flat_map(|sides| sides.chunks_mut(2)) {
            let (eight, side) = (sides[0].eight, sides[0].side);
            let first = eight * LANES + side.lane;
            let cables = first..first + sides.len() * side.level.widest();
            let values = values(eight, cables.clone());
            let accepted = match sides {
                [one, other] => {
                    let sides = &mut [one.with_factor(), other.with_factor()];
                    self.order.factorize(side.level, &values, sides)
                }
                _ => {
                    let mut one = sides.iter_mut().map(Side::with_factor);
                    one.all(|one| self.order.factorize(side.level, &values, &mut [one]))
                }
            };
            if !accepted {
                return Err(blame(&self.pattern, one, cables));
            }
        }
        if let Some(single) = &mut self.single {
            for (i, chain) in single.chains.iter_mut().enumerate() {
                let cable = Some(single.first + i);
                let failed = |error| BatchError { cable, error };
                one(single.first + i, &mut single.a).map_err(failed)?;
                single.a.check_finite().map_err(failed)?;
                if !chain.factorize(&single.a, NOISE) {
                    let cable = single.first + i;
                    return Err(blame(&self.pattern, one, cable..cable + 1));
                }
            }
        }
        self.factorized = true;
        Ok(())
    }

    /// Solves A x = b for all cables: entry `r` of cable `c` of both is number `batch_index(dim, r, c)`, their length
    /// is `batch_len(dim, count)`. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`], [`SolveError::Dimension`]; of the first cable that fails [`SolveError::NonFinite`].
    pub fn solve(&mut self, b: &[f64], x: &mut [f64]) -> Result<(), BatchError> {
        if !self.factorized {
            let (called, needs) = ("solve", "factorize");
            return Err(SolveError::OutOfOrder { called, needs }.into());
        }
        let dim = self.pattern.dim();
        let len = batch_len(dim, self.count);
        expect_len("right-hand side", len, b.len())?;
        expect_len("solution", len, x.len())?;
        let ((b, _), (x, _)) = (b.as_chunks::<LANES>(), x.as_chunks_mut::<LANES>());
        let mut finite = true;
        for side in &mut self.sides {
            let rows = side.eight * dim..(side.eight + 1) * dim;
            let with = (side.side, &*side.factor, &mut side.half[..]);
            finite &= self.order.solve(with, &b[rows.clone()], &mut x[rows]);
        }
        if let Some(single) = &mut self.single {
            for (i, chain) in single.chains.iter_mut().enumerate() {
                let (eight, lane) = ((single.first + i) / LANES, (single.first + i) % LANES);
                let rows = eight * dim..(eight + 1) * dim;
                for (to, from) in single.b.iter_mut().zip(&b[rows.clone()]) {
                    *to = from[lane];
                }
                chain.solve(&single.b, &mut single.x);
                finite &= single.x.iter().all(|x| x.is_finite());
                for (to, from) in x[rows].iter_mut().zip(&single.x) {
                    to[lane] = *from;
                }
            }
        }
        if finite {
            return Ok(());
        }
        let mut row = vec![0.0; dim];
        for cable in 0..self.count {
            for (what, v) in [("right-hand side", b), ("solution", &*x)] {
                let rows = &v[cable / LANES * dim..];
                for (to, from) in row.iter_mut().zip(rows) {
                    *to = from[cable % LANES];
                }
                let named = |error| BatchError {
                    cable: Some(cable),
                    error,
                };
                check_finite(&self.pattern, what, &row).map_err(named)?;
            }
        }
        Ok(())
    }
}

/// Error of the first cable that fails by itself. If none does, [`SolveError::OutOfRange`] for the
/// cable and block with the diagonal entry farthest from 1, in decades.
fn blame(
    pattern: &Arc<BlockPattern>,
    matrix: impl Fn(usize, &mut SymBlockMatrix) -> Result<(), SolveError>,
    cables: Range<usize>,
) -> BatchError {
    let mut one = SymBlockMatrix::zeros(pattern.clone());
    let mut worst = (0.0, None, 0);
    for cable in cables {
        let finite = matrix(cable, &mut one).and_then(|()| one.check_finite());
        if let Err(error) = finite.and_then(|()| factorize_in_order(&one)) {
            let cable = Some(cable);
            return BatchError { cable, error };
        }
        for block in 0..pattern.blocks() {
            let entries = one.block(pattern.column(block).start);
            for d in entries.iter().step_by(pattern.size(block) + 1) {
                let decades = d.log10().abs();
                if decades > worst.0 {
                    worst = (decades, Some(cable), block);
                }
            }
        }
    }
    let (_, cable, block) = worst;
    let error = SolveError::OutOfRange { block };
    BatchError { cable, error }
}

/// The elimination of one matrix from its first block on.
fn factorize_in_order(a: &SymBlockMatrix) -> Result<(), SolveError> {
    BlockLdlt::<f64>::new(a.pattern(), a.pattern())?.factorize(a, Pivots::Positive)
}

#[cfg(test)]
mod tests;
