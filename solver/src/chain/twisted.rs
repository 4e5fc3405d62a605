//! The two eliminations of a chain as the two lanes of a vector.

use super::block::{
    self, Blocks, Taken, lower_solve, pass_on, scaled, take_back, triangle, unroll, upper_solve,
};
use super::places::{Place, Places, Step};
use taut_lanes::{Halves, Isa, Kernel, Lanes};

/// Factorises; whether the pivots were accepted.
pub(super) struct Factorize<'a, const B: usize> {
    pub(super) places: &'a Places,
    pub(super) values: &'a [f64],
    pub(super) factor: &'a mut [f64],
}

/// Solves with a factor.
pub(super) struct Solve<'a, const B: usize> {
    pub(super) places: &'a Places,
    pub(super) factor: &'a [f64],
    pub(super) half: &'a mut [f64],
    pub(super) b: &'a [f64],
    pub(super) x: &'a mut [f64],
}

/// Most numbers of a coupling in both lanes.
const MOST: usize = 2 * 6 * 6;

/// A block of full size, column-major.
type Full<const B: usize> = [[f64; B]; B];

/// The blocks of a step: of each end the diagonal block, column-major, and the stored coupling, which for the second
/// end is the transposed one.
struct Ends<'a, const B: usize> {
    diagonal: [&'a Full<B>; 2],
    coupling: [&'a Full<B>; 2],
}

/// One double in each lane.
#[inline(always)]
fn pair<V: Halves>(up: f64, down: f64) -> V {
    V::join(V::Half::splat(up), V::Half::splat(down))
}

impl<V: Halves, const B: usize> Blocks<V> for Ends<'_, B> {
    #[inline(always)]
    fn diagonal(&self, i: usize, j: usize) -> V {
        let [up, down] = self.diagonal;
        pair(up[j][i], down[j][i])
    }
    #[inline(always)]
    fn coupling(&self, i: usize, j: usize) -> V {
        let [up, down] = self.coupling;
        pair(up[j][i], down[i][j])
    }
}

/// Copies of blocks that are not of full size, padded.
struct Padded<const B: usize> {
    diagonal: [Full<B>; 2],
    coupling: [Full<B>; 2],
}

impl<const B: usize> Padded<B> {
    fn new() -> Self {
        Self {
            diagonal: [[[0.0; B]; B]; 2],
            coupling: [[[0.0; B]; B]; 2],
        }
    }

    /// The blocks of a step before the middle one.
    fn fill(&mut self, values: &[f64], step: &Step) {
        for (end, place) in step.ends.into_iter().enumerate() {
            self.diagonal(values, end, place);
            self.coupling[end] = [[0.0; B]; B];
            if let Some(first) = place.coupling {
                let size = match end {
                    0 => [place.next, place.size],
                    _ => [place.size, place.next],
                };
                copy(values, first, size, &mut self.coupling[end]);
            }
        }
    }

    fn diagonal(&mut self, values: &[f64], end: usize, place: Place) {
        let n = place.size;
        self.diagonal[end] = [[0.0; B]; B];
        copy(values, place.diagonal, [n, n], &mut self.diagonal[end]);
        for r in n..B {
            self.diagonal[end][r][r] = 1.0;
        }
    }

    /// The middle block, which is the first end's; the second finds zeros.
    fn middle(&mut self, values: &[f64], middle: Place) {
        self.diagonal(values, 0, middle);
        self.diagonal[1] = [[0.0; B]; B];
    }

    #[inline(always)]
    fn ends(&self) -> Ends<'_, B> {
        Ends {
            diagonal: self.diagonal.each_ref(),
            coupling: self.coupling.each_ref(),
        }
    }
}

/// A block of the values into the corner of a full one.
fn copy<const B: usize>(values: &[f64], first: usize, size: [usize; 2], to: &mut Full<B>) {
    let [rows, columns] = size;
    let block = &values[first..first + rows * columns];
    for (c, to) in to[..columns].iter_mut().enumerate() {
        for (to, from) in to[..rows].iter_mut().zip(&block[c * rows..]) {
            *to = *from;
        }
    }
}

/// The blocks of a step of full ones, where they lie; `None` where one would reach beyond the values.
#[inline(always)]
fn in_place<'a, const B: usize>(values: &'a [f64], here: &Step) -> Option<Ends<'a, B>> {
    let at = |first: usize| {
        let (columns, _) = values.get(first..first + B * B)?.as_chunks::<B>();
        columns.first_chunk::<B>()
    };
    let diagonal = |end: usize| at(here.ends[end].diagonal);
    let coupling = |end: usize| at(here.ends[end].coupling?);
    Some(Ends {
        diagonal: [diagonal(0)?, diagonal(1)?],
        coupling: [coupling(0)?, coupling(1)?],
    })
}

/// The sum of both lanes, in both lanes.
#[inline(always)]
fn add<V: Lanes>(v: V) -> V {
    let mut lanes = [0.0; 2];
    v.store(&mut lanes);
    V::splat(lanes[0] + lanes[1])
}

/// The larger lane, in both lanes.
#[inline(always)]
fn larger<V: Lanes>(v: V) -> V {
    let mut lanes = [0.0; 2];
    v.store(&mut lanes);
    V::splat(lanes[0].max(lanes[1]))
}

/// Vectors of a step in the factor.
const fn per_step(size: usize) -> usize {
    triangle(size) + size * size
}

impl<const B: usize> Kernel for Factorize<'_, B> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        let Self {
            places,
            values,
            factor,
        } = self;
        factorize::<I::X4, B>(places, values, factor).is_some()
    }
}

#[inline(always)]
fn factorize<Q: Halves<Half: Halves>, const B: usize>(
    places: &Places,
    values: &[f64],
    factor: &mut [f64],
) -> Option<()> {
    let (steps, count) = (&places.steps[..], places.steps());
    let mut padded = Padded::<B>::new();
    let mut largest = Q::Half::splat(0.0);
    // Nothing is taken away from the first blocks.
    let (mut x, mut w) = ([[0.0; MOST]; 2], &[0.0; MOST][..]);
    let [mut x_before, mut x_here] = x.each_mut();
    let (of_steps, of_middle) = factor.split_at_mut(2 * per_step(B) * count);
    for (step, to) in steps.iter().zip(of_steps.chunks_exact_mut(2 * per_step(B))) {
        let ends = if step.full {
            in_place(values, step)?
        } else {
            padded.fill(values, step);
            padded.ends()
        };
        let taken = Taken { x: x_before, w };
        block::eliminate::<Q, B>(&ends, taken, to, x_here, &mut largest)?;
        (x_before, x_here) = (x_here, x_before);
        w = &to[2 * triangle(B)..];
    }
    padded.middle(values, steps[count].ends[0]);
    let taken = Taken { x: x_before, w };
    block::meet::<Q, B>(
        &padded.ends(),
        taken,
        of_middle,
        &mut largest,
        (add, larger),
    )?;
    largest
        .all_below(Q::Half::splat(f64::INFINITY))
        .then_some(())
}

/// The rows of a step's blocks in a vector; zero where there is only padding.
#[inline(always)]
fn gather<V: Halves, const B: usize>(v: &[f64], step: &Step) -> [V; B] {
    let mut rows = [V::splat(0.0); B];
    let [up, down] = step.ends;
    if up.size == B && down.size == B {
        let (up, down) = (&v[up.row..up.row + B], &v[down.row..down.row + B]);
        unroll!(i < B, {
            rows[i] = pair(up[i], down[i]);
        });
    } else {
        let at = |place: Place, i: usize| {
            if i < place.size {
                v[place.row + i]
            } else {
                0.0
            }
        };
        unroll!(i < B, {
            rows[i] = pair(at(up, i), at(down, i));
        });
    }
    rows
}

/// The reverse.
#[inline(always)]
fn scatter<V: Lanes, const B: usize>(rows: &[V; B], step: &Step, v: &mut [f64]) {
    let [up, down] = step.ends;
    let mut lanes = [[0.0; 2]; B];
    unroll!(i < B, {
        rows[i].store(&mut lanes[i]);
    });
    if up.size == B && down.size == B {
        let to = &mut v[up.row..up.row + B];
        unroll!(i < B, {
            to[i] = lanes[i][0];
        });
        let to = &mut v[down.row..down.row + B];
        unroll!(i < B, {
            to[i] = lanes[i][1];
        });
    } else {
        for (end, place) in [up, down].into_iter().enumerate() {
            for (i, to) in v[place.row..place.row + place.size].iter_mut().enumerate() {
                *to = lanes[i][end];
            }
        }
    }
}

impl<const B: usize> Kernel for Solve<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self {
            places,
            factor,
            half,
            b,
            x,
        } = self;
        let (steps, count) = (&places.steps[..], places.steps());
        let (of_steps, middle) = factor.split_at(2 * per_step(B) * count);
        let of_steps = of_steps.chunks_exact(2 * per_step(B));
        let mut rows = gather::<I::X2, B>(b, &steps[0]);
        let halves = half.chunks_exact_mut(2 * B);
        for ((factor, half), step) in of_steps.clone().zip(halves).zip(&steps[1..]) {
            let y = lower_solve(factor, rows);
            let z = scaled(factor, y);
            unroll!(i < B, {
                z[i].store(&mut half[2 * i..]);
            });
            rows = pass_on(&factor[2 * triangle(B)..], y, gather(b, step));
        }
        if count > 0 {
            rows = rows.map(add);
        }
        rows = upper_solve(middle, scaled(middle, lower_solve(middle, rows)));
        scatter(&rows, &steps[count], x);
        let halves = half.chunks_exact(2 * B);
        for ((factor, half), step) in of_steps.zip(halves).zip(&steps[..count]).rev() {
            let mut z = rows;
            unroll!(i < B, {
                z[i] = I::X2::load(&half[2 * i..]);
            });
            rows = take_back(factor, z, rows);
            scatter(&rows, step, x);
        }
    }
}
