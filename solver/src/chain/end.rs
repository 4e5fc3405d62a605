//! One of the two eliminations of a chain alone, for a thread of its own.
//!
//! It stops before the middle: the last block that it reaches is factorised and its coupling to the middle is not
//! eliminated (the two ends of that last step go together, in `twisted`). Here a vector of two lanes holds two rows.

use super::block::{
    self, Apart, Blocks, lower_solve, pass_on, per_step, scaled, take_back, triangle, unroll,
};
use super::places::Place;
use super::with_size;
use taut_lanes::{Halves, Isa, Kernel, Lanes, Level, dispatch};

/// One end of a chain: where its blocks lie and their factor.
#[derive(Debug, Clone)]
pub(super) struct End {
    /// All blocks are padded to this many rows.
    size: usize,
    level: Level,
    /// Whether it is the second end, whose couplings are stored transposed.
    down: bool,
    /// The blocks in the order of elimination; at least one.
    places: Vec<Place>,
    factor: Vec<f64>,
    /// D⁻¹ L⁻¹ b between the forward and the backward pass, of all blocks but the last.
    half: Vec<f64>,
}

impl End {
    /// Of blocks padded to `size` rows, in the order of elimination. Allocates all that is needed.
    pub(super) fn new(size: usize, level: Level, down: bool, places: Vec<Place>) -> Self {
        Self {
            size,
            level,
            down,
            factor: vec![0.0; places.len() * per_step(size)],
            half: vec![0.0; places.len() * size],
            places,
        }
    }

    /// Factorises; whether all pivots are more than noise.
    pub(super) fn factorize(&mut self, values: &[f64]) -> bool {
        with_size!(
            self.size,
            self.level,
            Factorize {
                places: &self.places,
                down: self.down,
                values: values,
                factor: &mut self.factor,
            }
        )
    }

    /// The factor of the last block: a triangle and reciprocal pivots, see `block`.
    pub(super) fn last(&self) -> &[f64] {
        let steps = self.places.len() - 1;
        &self.factor[steps * per_step(self.size)..][..triangle(self.size)]
    }

    /// The forward pass: what is left of `b` in the rows of the last block, into these rows of `x`.
    pub(super) fn forward(&mut self, b: &[f64], x: &mut [f64]) {
        with_size!(
            self.size,
            self.level,
            Forward {
                places: &self.places,
                factor: &self.factor,
                b: b,
                half: &mut self.half,
                x: x,
            }
        );
    }

    /// The backward pass: from the solution in the rows of the last block of `x` to all others.
    pub(super) fn backward(&self, x: &mut [f64]) {
        with_size!(
            self.size,
            self.level,
            Backward {
                places: &self.places,
                factor: &self.factor,
                half: &self.half,
                x: x,
            }
        );
    }
}

struct Factorize<'a, const B: usize> {
    places: &'a [Place],
    down: bool,
    values: &'a [f64],
    factor: &'a mut [f64],
}

struct Forward<'a, const B: usize> {
    places: &'a [Place],
    factor: &'a [f64],
    b: &'a [f64],
    half: &'a mut [f64],
    x: &'a mut [f64],
}

struct Backward<'a, const B: usize> {
    places: &'a [Place],
    factor: &'a [f64],
    half: &'a [f64],
    x: &'a mut [f64],
}

/// A block of full size, column-major.
type Full<const B: usize> = [[f64; B]; B];

/// A coupling as stored, and the diagonal block that it leads to.
struct Pair<'a, const B: usize> {
    diagonal: &'a Full<B>,
    coupling: &'a Full<B>,
    down: bool,
}

/// Entries i and i + 1.
#[inline(always)]
fn two<const B: usize>(v: &[f64; B], i: usize) -> &[f64; 2] {
    v[i..].first_chunk().unwrap_or(&[0.0; 2])
}

impl<Q: Halves, const B: usize> Blocks<Q, B> for Pair<'_, B> {
    #[inline(always)]
    fn row(&self, i: usize, j: usize) -> Q::Half {
        Q::Half::splat(self.diagonal[j][i])
    }
    #[inline(always)]
    fn rows(&self, i: usize, j: usize) -> Q {
        Q::load(two(&self.diagonal[j], i))
    }
    #[inline(always)]
    fn coupling(&self, i: usize) -> [Q::Half; B] {
        let mut row = [Q::Half::splat(0.0); B];
        unroll!(j < B, {
            let from = if self.down { (i, j) } else { (j, i) };
            row[j] = Q::Half::splat(self.coupling[from.0][from.1]);
        });
        row
    }
    #[inline(always)]
    fn couplings(&self, i: usize) -> [Q; B] {
        let mut rows = [Q::splat(0.0); B];
        if self.down {
            let (first, second) = (&self.coupling[i], &self.coupling[i + 1]);
            unroll!(j < B, {
                rows[j] = Q::join(Q::Half::splat(first[j]), Q::Half::splat(second[j]));
            });
        } else {
            unroll!(j < B, {
                rows[j] = Q::load(two(&self.coupling[j], i));
            });
        }
        rows
    }
}

/// Copies of blocks that are not of full size, padded.
struct Padded<const B: usize> {
    diagonal: Full<B>,
    coupling: Full<B>,
}

impl<const B: usize> Padded<B> {
    fn new() -> Self {
        Self {
            diagonal: [[0.0; B]; B],
            coupling: [[0.0; B]; B],
        }
    }

    fn fill(&mut self, values: &[f64], here: Option<(Place, bool)>, next: Place) {
        let n = next.size;
        self.diagonal = [[0.0; B]; B];
        copy(values, next.diagonal, [n, n], &mut self.diagonal);
        for r in n..B {
            self.diagonal[r][r] = 1.0;
        }
        self.coupling = [[0.0; B]; B];
        if let Some((here, down)) = here
            && let Some(first) = here.coupling
        {
            let size = if down { [here.size, n] } else { [n, here.size] };
            copy(values, first, size, &mut self.coupling);
        }
    }
}

/// A block of the values into the corner of a full one.
fn copy<const B: usize>(values: &[f64], first: usize, size: [usize; 2], to: &mut Full<B>) {
    let [rows, columns] = size;
    let block = &values[first..first + rows * columns];
    for (c, to) in to[..columns].iter_mut().enumerate() {
        to[..rows].copy_from_slice(&block[c * rows..(c + 1) * rows]);
    }
}

/// A block of full size, where it lies.
#[inline(always)]
fn in_place<const B: usize>(values: &[f64], first: usize) -> Option<&Full<B>> {
    let (columns, _) = values.get(first..first + B * B)?.as_chunks::<B>();
    columns.first_chunk::<B>()
}

impl<const B: usize> Kernel for Factorize<'_, B> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        self.factorize::<I::X2>().is_some()
    }
}

impl<const B: usize> Factorize<'_, B> {
    #[inline(always)]
    fn factorize<Q: Halves>(self) -> Option<()> {
        let Self {
            places,
            down,
            values,
            factor,
        } = self;
        let mut largest = Q::Half::splat(0.0);
        let mut padded = Padded::<B>::new();
        padded.fill(values, None, *places.first()?);
        let blocks = Pair {
            diagonal: &padded.diagonal,
            coupling: &padded.coupling,
            down,
        };
        block::first::<Q, B>(&blocks, factor, &mut largest)?;
        for (t, pair) in places.array_windows::<2>().enumerate() {
            let [here, next] = *pair;
            let (before, after) = factor[per_step(B) * t..].split_at_mut(per_step(B));
            let full = here.size == B && next.size == B;
            let blocks = match here.coupling {
                Some(coupling) if full => Pair {
                    diagonal: in_place(values, next.diagonal)?,
                    coupling: in_place(values, coupling)?,
                    down,
                },
                _ => {
                    padded.fill(values, Some((here, down)), next);
                    Pair {
                        diagonal: &padded.diagonal,
                        coupling: &padded.coupling,
                        down,
                    }
                }
            };
            block::eliminate::<Q, B>(&blocks, before, after, &mut largest, &Apart)?;
        }
        largest
            .all_below(Q::Half::splat(f64::INFINITY))
            .then_some(())
    }
}

/// The rows of a block; zero where there is only padding.
#[inline(always)]
fn gather<V: Lanes, const B: usize>(v: &[f64], place: Place) -> [V; B] {
    let mut rows = [V::splat(0.0); B];
    let v = &v[place.row..place.row + place.size];
    if place.size == B {
        unroll!(i < B, {
            rows[i] = V::splat(v[i]);
        });
    } else {
        unroll!(i < B, {
            if i < place.size {
                rows[i] = V::splat(v[i]);
            }
        });
    }
    rows
}

/// The reverse.
#[inline(always)]
fn scatter<V: Lanes, const B: usize>(rows: &[V; B], place: Place, x: &mut [f64]) {
    let x = &mut x[place.row..place.row + place.size];
    unroll!(i < B, {
        if i < place.size {
            rows[i].store(&mut x[i..]);
        }
    });
}

impl<const B: usize> Kernel for Forward<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self {
            places,
            factor,
            b,
            half,
            x,
        } = self;
        let Some((&first, others)) = places.split_first() else {
            return;
        };
        let mut rows = gather::<I::X1, B>(b, first);
        let halves = half.as_chunks_mut::<B>().0;
        let steps = factor.chunks_exact(per_step(B)).zip(halves).zip(others);
        for ((factor, half), &place) in steps {
            let y = lower_solve(factor, rows);
            let z = scaled(factor, y);
            unroll!(i < B, {
                z[i].store(&mut half[i..]);
            });
            rows = pass_on(&factor[triangle(B)..], y, gather(b, place));
        }
        scatter(&rows, others.last().copied().unwrap_or(first), x);
    }
}

impl<const B: usize> Kernel for Backward<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self {
            places,
            factor,
            half,
            x,
        } = self;
        let Some((&last, others)) = places.split_last() else {
            return;
        };
        let mut rows = gather::<I::X1, B>(x, last);
        let halves = half.as_chunks::<B>().0;
        // Not from the last block on: its step is no longer of this end.
        let factors = &factor[..others.len() * per_step(B)];
        let steps = factors.chunks_exact(per_step(B)).zip(halves).zip(others);
        for ((factor, half), &place) in steps.rev() {
            let mut z = rows;
            unroll!(i < B, {
                z[i] = I::X1::splat(half[i]);
            });
            rows = take_back(factor, z, rows);
            scatter(&rows, place, x);
        }
    }
}
