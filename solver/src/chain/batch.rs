//! Chains of equal pattern side by side, one in each lane, eliminated from the first block on.
//!
//! Numbers of eight chains stand together (see [`crate::BatchMatrix`]); a kernel works on as many of these as a register
//! holds, from a lane on. Matrices that each have their values to themselves are put together block by block, as the
//! elimination comes to them: a whole one is soon larger than the nearest caches.

use super::block::{self, Blocks, ScratchOfEight};
use super::layout::{per_step, unroll};
use super::places::{Place, in_order, size_of_chain};
use super::substitution::{lower_solve, pass_on, scaled, take_back, upper_solve};
use super::with_size;
use crate::BlockPattern;
use crate::block_ldlt::NOISE;
use taut_lanes::vector;
use taut_lanes::{Halves, Isa, Kernel, Lanes, Level, dispatch};

/// Chains whose numbers stand together.
pub(crate) const LANES: usize = 8;

/// Which chains a kernel works on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Side {
    /// The first one's place among eight.
    pub(crate) lane: usize,
    /// The instructions, which say how many there are.
    pub(crate) level: Level,
}

/// Where the values of chains side by side are.
pub(crate) trait Values {
    /// A block of full size where it lies; `None` where those of eight do not lie together.
    fn in_place<const B: usize>(&self, first: usize) -> Option<&Full<B>>;

    /// A block of `rows` × `columns` from the value `first` on, into the corner of a full one.
    fn copy<I: Isa, const B: usize>(&self, first: usize, size: [usize; 2], to: &mut Full<B>);
}

/// Values of eight chains, interleaved.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Together<'a>(pub(crate) &'a [[f64; LANES]]);

/// Values of each chain by itself, for the first and the last four lanes of eight. `None` where
/// none of the four lanes is in use.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Apart<'a>(pub(crate) [Option<[&'a [f64]; 4]>; 2]);

/// The order of elimination of chains side by side.
#[derive(Debug, Clone)]
pub(crate) struct InOrder {
    size: usize,
    places: Vec<Place>,
    /// Work space for two sides.
    scratch: Box<[ScratchOfEight; 2]>,
}

impl InOrder {
    /// `None` where the pattern is no chain of blocks of at most six rows.
    pub(crate) fn new(pattern: &BlockPattern) -> Option<Self> {
        let all: Vec<usize> = (0..pattern.blocks()).collect();
        Some(Self {
            size: size_of_chain(pattern, &all)?,
            places: in_order(pattern, &all),
            scratch: Box::new([ScratchOfEight::new(), ScratchOfEight::new()]),
        })
    }

    /// Lengths of the factor of `width` chains and of what a solve needs besides.
    pub(crate) fn storage(&self, width: usize) -> [usize; 2] {
        let (blocks, size) = (self.places.len(), self.size);
        [per_step(size), size].map(|n| n * width * blocks)
    }

    /// Factorises the chains of one or two sides of the same eight, given by the place of their first one and with their
    /// factors; whether the pivots of all were accepted.
    pub(crate) fn factorize(
        &mut self,
        level: Level,
        values: &impl Values,
        sides: &mut [(usize, &mut [f64])],
    ) -> bool {
        with_size!(
            self.size,
            level,
            Factorize<_> {
                places: &self.places,
                values: values,
                sides: sides,
                scratch: &mut self.scratch,
            }
        )
    }

    /// Solves for the right-hand sides of a side; whether the solutions are finite.
    pub(crate) fn solve(
        &self,
        (side, factor, half): (Side, &[f64], &mut [f64]),
        b: &[[f64; LANES]],
        x: &mut [[f64; LANES]],
    ) -> bool {
        with_size!(
            self.size,
            side.level,
            Solve {
                places: &self.places,
                side: side,
                factor: factor,
                half: half,
                b: b,
                x: x,
            }
        )
    }
}

struct Factorize<'a, 'b, const B: usize, V> {
    places: &'a [Place],
    values: &'a V,
    sides: &'a mut [(usize, &'b mut [f64])],
    scratch: &'a mut [ScratchOfEight; 2],
}

struct Solve<'a, const B: usize> {
    places: &'a [Place],
    side: Side,
    factor: &'a [f64],
    half: &'a mut [f64],
    b: &'a [[f64; LANES]],
    x: &'a mut [[f64; LANES]],
}

/// A block of full size, column-major.
pub(crate) type Full<const B: usize> = [[[f64; LANES]; B]; B];

/// A diagonal block, a coupling and the diagonal block that it leads to.
struct Pair<'a, const B: usize> {
    own: &'a Full<B>,
    diagonal: &'a Full<B>,
    coupling: &'a Full<B>,
    lane: usize,
}

impl<Q: Halves, const B: usize> Blocks<Q, B> for Pair<'_, B> {
    #[inline(always)]
    fn own(&self, i: usize) -> Q::Half {
        Q::Half::load(&self.own[i][i][self.lane..])
    }
    #[inline(always)]
    fn row(&self, i: usize, j: usize) -> Q::Half {
        Q::Half::load(&self.diagonal[j][i][self.lane..])
    }
    #[inline(always)]
    fn rows(&self, i: usize, j: usize) -> Q {
        Q::join(
            Q::Half::load(&self.diagonal[j][i][self.lane..]),
            Q::Half::load(&self.diagonal[j][i + 1][self.lane..]),
        )
    }
    #[inline(always)]
    fn columns(&self, i: usize, j: usize) -> Q {
        Q::join(
            Q::Half::load(&self.diagonal[j][i][self.lane..]),
            Q::Half::load(&self.diagonal[j + 1][i][self.lane..]),
        )
    }
    #[inline(always)]
    fn coupling(&self, i: usize, j: usize) -> Q::Half {
        Q::Half::load(&self.coupling[j][i][self.lane..])
    }
    #[inline(always)]
    fn couplings(&self, i: usize, j: usize) -> Q {
        let column = &self.coupling[j];
        Q::join(
            Q::Half::load(&column[i][self.lane..]),
            Q::Half::load(&column[i + 1][self.lane..]),
        )
    }
}

/// Copies of blocks that are not of full size, or not of eight together, padded. Aligned, so that no four lanes cross a
/// cache line.
#[repr(align(64))]
struct Padded<const B: usize> {
    diagonal: Full<B>,
    coupling: Full<B>,
}

impl<const B: usize> Padded<B> {
    fn new() -> Self {
        Self {
            diagonal: [[[0.0; LANES]; B]; B],
            coupling: [[[0.0; LANES]; B]; B],
        }
    }

    #[inline(always)]
    fn fill<I: Isa>(&mut self, values: &impl Values, here: Option<Place>, next: Place) {
        let n = next.size;
        let coupling = here.and_then(|p| Some((p.coupling?, p.size)));
        if n < B {
            self.diagonal = [[[0.0; LANES]; B]; B];
            for r in n..B {
                self.diagonal[r][r] = [1.0; LANES];
            }
        }
        values.copy::<I, B>(next.diagonal, [n, n], &mut self.diagonal);
        if n < B || coupling.is_none_or(|(_, columns)| columns < B) {
            self.coupling = [[[0.0; LANES]; B]; B];
        }
        if let Some((first, columns)) = coupling {
            values.copy::<I, B>(first, [n, columns], &mut self.coupling);
        }
    }
}

impl Values for Together<'_> {
    #[inline(always)]
    fn in_place<const B: usize>(&self, first: usize) -> Option<&Full<B>> {
        let (columns, _) = self.0.get(first..first + B * B)?.as_chunks::<B>();
        columns.first_chunk::<B>()
    }

    #[inline(never)]
    fn copy<I: Isa, const B: usize>(&self, first: usize, size: [usize; 2], to: &mut Full<B>) {
        let [rows, columns] = size;
        let block = &self.0[first..first + rows * columns];
        for (c, to) in to[..columns].iter_mut().enumerate() {
            to[..rows].copy_from_slice(&block[c * rows..(c + 1) * rows]);
        }
    }
}

impl Values for Apart<'_> {
    #[inline(always)]
    fn in_place<const B: usize>(&self, _: usize) -> Option<&Full<B>> {
        None
    }

    #[inline(always)]
    fn copy<I: Isa, const B: usize>(&self, first: usize, size: [usize; 2], to: &mut Full<B>) {
        let [rows, columns] = size;
        for (four, lane) in self.0.into_iter().zip([0, 4]) {
            let Some(four) = four else { continue };
            let block = four.map(|values| &values[first..first + rows * columns]);
            if rows == B {
                spread::<I::X4>(block, &mut to.as_flattened_mut()[..rows * columns], lane);
                continue;
            }
            for (c, to) in to[..columns].iter_mut().enumerate() {
                let column = block.map(|block| &block[c * rows..(c + 1) * rows]);
                spread::<I::X4>(column, &mut to[..rows], lane);
            }
        }
    }
}

impl<const B: usize, V: Values> Kernel for Factorize<'_, '_, B, V> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        self.factorize::<I, I::Twice>().is_some()
    }
}

impl<const B: usize, V: Values> Factorize<'_, '_, B, V> {
    /// A step of all sides before the next one: what they read stands in the same cache lines.
    #[inline(always)]
    fn factorize<I: Isa, Q: Halves>(self) -> Option<()> {
        let Self {
            places,
            values,
            sides,
            scratch,
        } = self;
        let Some(&first) = places.first() else {
            return Some(());
        };
        for (lane, _) in &mut *sides {
            *lane = (*lane).min(LANES - Q::Half::LANES);
        }
        // A block may be padded, and so may the next one.
        let [mut even, mut odd] = [Padded::<B>::new(), Padded::new()];
        even.fill::<I>(values, None, first);
        let mut pivots = [Q::Half::splat(0.0); 2];
        for ((lane, _), (scratch, pivot)) in sides.iter().zip(scratch.iter_mut().zip(&mut pivots)) {
            let blocks = Pair {
                own: &even.diagonal,
                diagonal: &even.diagonal,
                coupling: &even.coupling,
                lane: *lane,
            };
            *pivot = block::begin::<Q, B, _, _>(scratch, &blocks);
        }
        let step = Q::Half::LANES * per_step(B);
        for (t, pair) in places.array_windows::<2>().enumerate() {
            let [here, next] = *pair;
            let (padded, other) = match t % 2 {
                0 => (&even, &mut odd),
                _ => (&odd, &mut even),
            };
            let full = here.size == B && next.size == B;
            let where_they_lie = here.coupling.filter(|_| full).and_then(|coupling| {
                let diagonal = values.in_place(next.diagonal)?;
                Some((diagonal, values.in_place(coupling)?))
            });
            let (diagonal, coupling) = match where_they_lie {
                Some(blocks) => blocks,
                None => {
                    other.fill::<I>(values, Some(here), next);
                    (&other.diagonal, &other.coupling)
                }
            };
            let own = own(values, here, padded);
            let with = scratch.iter_mut().zip(&mut pivots);
            for ((lane, factor), (scratch, pivot)) in sides.iter_mut().zip(with) {
                let blocks = Pair {
                    own,
                    diagonal,
                    coupling,
                    lane: *lane,
                };
                let here = &mut factor[step * t..];
                *pivot = block::eliminate::<Q, B, _, _>(*pivot, scratch, &blocks, NOISE, here)?;
            }
        }
        let count = places.len() - 1;
        let padded = if count % 2 == 0 { &even } else { &odd };
        let last = own(values, places[count], padded);
        let with = scratch.iter_mut().zip(&pivots);
        for ((lane, factor), (scratch, &pivot)) in sides.iter_mut().zip(with) {
            let mut own = [Q::Half::splat(0.0); B];
            unroll!(i < B, {
                own[i] = Q::Half::load(&last[i][i][*lane..]);
            });
            block::finish(pivot, scratch, own, NOISE, &mut factor[step * count..])?;
        }
        Some(())
    }
}

/// The diagonal block of a step.
#[inline(always)]
fn own<'a, const B: usize>(
    values: &'a impl Values,
    place: Place,
    padded: &'a Padded<B>,
) -> &'a Full<B> {
    let full = place.size == B;
    let in_place = full.then(|| values.in_place(place.diagonal)).flatten();
    in_place.unwrap_or(&padded.diagonal)
}

/// The rows of a block; zero where there is only padding.
#[inline(always)]
fn gather<V: Lanes, const B: usize>(v: &[[f64; LANES]], place: Place, lane: usize) -> [V; B] {
    let mut rows = [V::splat(0.0); B];
    let v = &v[place.row..place.row + place.size];
    if place.size == B {
        unroll!(i < B, {
            rows[i] = V::load(&v[i][lane..]);
        });
    } else {
        unroll!(i < B, {
            if i < place.size {
                rows[i] = V::load(&v[i][lane..]);
            }
        });
    }
    rows
}

/// The reverse; adds 0 where finite, NaN elsewhere, to `check`.
#[inline(always)]
fn scatter<V: Lanes, const B: usize>(
    rows: &[V; B],
    place: Place,
    lane: usize,
    x: &mut [[f64; LANES]],
    check: &mut V,
) {
    let x = &mut x[place.row..place.row + place.size];
    unroll!(i < B, {
        if i < place.size {
            rows[i].store(&mut x[i][lane..]);
            *check = rows[i].mul_add(V::splat(0.0), *check);
        }
    });
}

impl<const B: usize> Kernel for Solve<'_, B> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        self.solve::<I::Widest>()
    }
}

impl<const B: usize> Solve<'_, B> {
    #[inline(always)]
    fn solve<V: Lanes>(self) -> bool {
        let Self {
            places,
            factor,
            half,
            b,
            x,
            ..
        } = self;
        let lane = self.side.lane.min(LANES - V::LANES);
        let Some((&last, _)) = places.split_last() else {
            return true;
        };
        let step = V::LANES * per_step(B);
        let (of_steps, of_last) = factor.split_at(step * (places.len() - 1));
        let mut rows = gather::<V, B>(b, places[0], lane);
        let halves = half.chunks_exact_mut(V::LANES * B);
        for ((factor, half), &place) in of_steps.chunks_exact(step).zip(halves).zip(&places[1..]) {
            let y = lower_solve(factor, rows);
            let z = scaled(factor, y);
            unroll!(i < B, {
                z[i].store(&mut half[V::LANES * i..]);
            });
            rows = pass_on(factor, y, gather(b, place, lane));
        }
        rows = upper_solve(of_last, scaled(of_last, lower_solve(of_last, rows)));
        let mut check = V::splat(0.0);
        scatter(&rows, last, lane, x, &mut check);
        let halves = half.chunks_exact(V::LANES * B);
        let steps = of_steps.chunks_exact(step).zip(halves).zip(places);
        for ((factor, half), &place) in steps.rev() {
            let mut z = rows;
            unroll!(i < B, {
                z[i] = V::load(&half[V::LANES * i..]);
            });
            rows = take_back(factor, z, rows);
            scatter(&rows, place, lane, x, &mut check);
        }
        check.all_below(V::splat(1.0))
    }
}

/// Arrays of four chains side by side, into the lanes from one on.
#[inline(always)]
pub(crate) fn spread<V: Lanes>(from: [&[f64]; 4], to: &mut [[f64; LANES]], lane: usize) {
    const TOGETHER: usize = 4;
    let [a, b, c, d] = from.map(|v| v.as_chunks::<TOGETHER>());
    let (groups, rest) = to.as_chunks_mut::<TOGETHER>();
    let each = a.0.iter().zip(b.0).zip(c.0.iter().zip(d.0));
    for (to, ((a, b), (c, d))) in groups.iter_mut().zip(each) {
        let numbers: [V; TOGETHER] = vector::gather([a, b, c, d]);
        for (to, number) in to.iter_mut().zip(numbers) {
            number.store(&mut to[lane..]);
        }
    }
    for (k, to) in rest.iter_mut().enumerate() {
        (to[lane], to[lane + 1]) = (a.1[k], b.1[k]);
        (to[lane + 2], to[lane + 3]) = (c.1[k], d.1[k]);
    }
}
