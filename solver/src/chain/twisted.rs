//! The two eliminations of a chain as the two lanes of a vector.

use super::block::{self, Blocks, ScratchOfTwo};
use super::layout::{self, columns_of, per_step, unroll};
use super::overlay::Overlay;
use super::schedule::{BlockSlot, Schedule, Step};
use super::substitution::{InBoth, lower_solve, pass_on, scaled, take_back, upper_solve};
use taut_lanes::{Halves, Isa, Kernel, Lanes, Quad};

/// Factorises; whether the pivots were accepted. Matrices without patches have code of their own: looking for patches takes
/// 2 to 3 % of it.
pub(super) struct Factorize<'a, const B: usize, const PATCHED: bool> {
    pub(super) schedule: &'a Schedule,
    pub(super) values: Overlay<'a>,
    pub(super) factor: &'a mut [f64],
    pub(super) scratch: &'a mut ScratchOfTwo,
    /// Units of roundoff of what a pivot was made from that it has to have.
    pub(super) least: f64,
}

/// D⁻¹ y with y = L⁻¹ b into `z`, in the order of elimination: the rows of a step for both lanes; of the middle block the
/// second lane is zero. Adds Uᵀ y to `sums`, two lanes a column, where there is a border.
pub(super) struct Forward<'a, const B: usize, const BORDER: bool> {
    pub(super) schedule: &'a Schedule,
    pub(super) factor: &'a [f64],
    pub(super) b: &'a [f64],
    pub(super) z: &'a mut [f64],
    pub(super) u: &'a [f64],
    pub(super) sums: &'a mut [f64],
}

/// L⁻ᵀ (z − U s) into the rows of the chain, s the border's part of a solution, where there is one.
pub(super) struct Backward<'a, const B: usize, const BORDER: bool> {
    pub(super) schedule: &'a Schedule,
    pub(super) factor: &'a [f64],
    pub(super) z: &'a [f64],
    pub(super) u: &'a [f64],
    pub(super) s: &'a [f64],
    pub(super) x: &'a mut [f64],
}

/// Both passes for two right-hand sides, a half of a vector for each.
pub(super) struct SolveTwo<'a, const B: usize> {
    pub(super) schedule: &'a Schedule,
    pub(super) factor: &'a [f64],
    pub(super) b: [&'a [f64]; 2],
    /// D⁻¹ L⁻¹ b of the steps before the middle block, between the passes.
    pub(super) z: &'a mut [f64],
    pub(super) x: [&'a mut [f64]; 2],
}

/// A block of full size, column-major.
type Full<const B: usize> = [[f64; B]; B];

/// The blocks of a step, of each end: its own diagonal block, the next one, column-major, and the stored coupling to it,
/// which for the second end is the transposed one.
struct Ends<'a, const B: usize> {
    own: [&'a Full<B>; 2],
    diagonal: [&'a Full<B>; 2],
    coupling: [&'a Full<B>; 2],
}

/// One double in each lane.
#[inline(always)]
pub(super) fn pair<V: Halves>(up: f64, down: f64) -> V {
    V::join(V::Half::splat(up), V::Half::splat(down))
}

impl<Q: Quad<Half: Halves>, const B: usize> Blocks<Q, B> for Ends<'_, B> {
    #[inline(always)]
    fn own(&self, i: usize) -> Q::Half {
        let [up, down] = self.own;
        pair(up[i][i], down[i][i])
    }
    #[inline(always)]
    fn row(&self, i: usize, j: usize) -> Q::Half {
        let [up, down] = self.diagonal;
        pair(up[j][i], down[j][i])
    }
    #[inline(always)]
    fn rows(&self, i: usize, j: usize) -> Q {
        let [up, down] = self.diagonal;
        Q::interleave(two(&up[j], i), two(&down[j], i))
    }
    #[inline(always)]
    fn columns(&self, i: usize, j: usize) -> Q {
        let [up, down] = self.diagonal;
        Q::join(
            pair(up[j][i], down[j][i]),
            pair(up[j + 1][i], down[j + 1][i]),
        )
    }
    #[inline(always)]
    fn coupling(&self, i: usize, j: usize) -> Q::Half {
        let [up, down] = self.coupling;
        pair(up[j][i], down[i][j])
    }
    #[inline(always)]
    fn couplings(&self, i: usize, j: usize) -> Q {
        let [up, down] = self.coupling;
        Q::interleave(two(&up[j], i), &[down[i][j], down[i + 1][j]])
    }
}

/// Entries i and i + 1.
#[inline(always)]
fn two<const B: usize>(v: &[f64; B], i: usize) -> &[f64; 2] {
    v[i..].first_chunk().unwrap_or(&[0.0; 2])
}

/// The sum of both lanes, in both lanes.
#[inline(always)]
pub(super) fn add<V: Halves>(v: V) -> V {
    V::both(v.lower() + v.upper())
}

/// The sum of both lanes of each half, in both lanes of that half.
#[inline(always)]
pub(super) fn add_in_halves<V: Halves<Half: Halves>>(v: V) -> V {
    V::join(add(v.lower()), add(v.upper()))
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

    /// The couplings of a step and the diagonal blocks that they lead to; the middle block is the first end's alone, and
    /// the second finds zeros.
    fn fill(&mut self, values: Overlay<'_>, step: &Step, next: &Step, middle: bool) {
        for (end, place) in step.ends.into_iter().enumerate() {
            self.diagonal(values, end, next.ends[end]);
            self.coupling[end] = [[0.0; B]; B];
            if let Some(first) = place.coupling {
                let size = match end {
                    0 => [place.next, place.size],
                    _ => [place.size, place.next],
                };
                copy(values, first, size, &mut self.coupling[end]);
            }
        }
        if middle {
            self.diagonal[1] = [[0.0; B]; B];
        }
    }

    fn diagonal(&mut self, values: Overlay<'_>, end: usize, place: BlockSlot) {
        let n = place.size;
        self.diagonal[end] = [[0.0; B]; B];
        copy(values, place.diagonal, [n, n], &mut self.diagonal[end]);
        for r in n..B {
            self.diagonal[end][r][r] = 1.0;
        }
    }
}

/// A block of the values into the corner of a full one.
fn copy<const B: usize>(values: Overlay<'_>, first: usize, size: [usize; 2], to: &mut Full<B>) {
    let [rows, columns] = size;
    let block = values.block(first, rows * columns);
    for (c, to) in to[..columns].iter_mut().enumerate() {
        let from = &block[c * rows..(c + 1) * rows];
        match rows {
            // A point's joint.
            3 => to[..3].copy_from_slice(&from[..3]),
            _ if rows == B => to.copy_from_slice(&from[..B]),
            _ => to[..rows].copy_from_slice(from),
        }
    }
}

/// A block of full size of each end, where it lies; `None` where there is none.
#[inline(always)]
fn in_place<const B: usize, const PATCHED: bool>(
    matrix: Overlay<'_>,
    first: [Option<usize>; 2],
) -> Option<[&Full<B>; 2]> {
    let at = |first: usize| {
        let block = match PATCHED {
            true => matrix.get(first, B * B)?,
            false => matrix.values.get(first..first + B * B)?,
        };
        let (columns, _) = block.as_chunks::<B>();
        columns.first_chunk::<B>()
    };
    Some([at(first[0]?)?, at(first[1]?)?])
}

impl<const B: usize, const PATCHED: bool> Kernel for Factorize<'_, B, PATCHED> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self) -> bool {
        self.factorize::<I::X4>().is_some()
    }
}

impl<const B: usize, const PATCHED: bool> Factorize<'_, B, PATCHED> {
    #[inline(always)]
    fn factorize<Q: Quad<Half: Halves>>(self) -> Option<()> {
        let Self {
            schedule,
            values,
            factor,
            scratch,
            least,
        } = self;
        let (steps, count) = (&schedule.steps[..], schedule.steps());
        // A step's own blocks may be padded, and so may the next ones: of even and of odd steps. Where all are full these
        // are not made, which takes as long as a step.
        let all_full = count > 0 && steps[..count].iter().all(|step| step.full);
        let mut padded = (!all_full).then(|| [Padded::<B>::new(), Padded::new()]);
        let mut first = match &mut padded {
            Some([even, _]) if !steps[0].full => {
                for end in 0..2 {
                    even.diagonal(values, end, steps[0].ends[end]);
                }
                even.diagonal.each_ref()
            }
            _ => in_place::<B, PATCHED>(values, steps[0].ends.map(|end| Some(end.diagonal)))?,
        };
        // The middle block is the first end's alone.
        let none = [[0.0; B]; B];
        if count == 0 {
            first[1] = &none;
        }
        let mut pivot = block::begin::<Q, B, _, _>(
            scratch,
            &Ends {
                own: first,
                diagonal: first,
                coupling: first,
            },
        );
        for (t, step) in steps[..count].iter().enumerate() {
            let next = &steps[t + 1];
            let ends = if step.full {
                let mut ends = Ends {
                    own: in_place::<B, PATCHED>(values, step.ends.map(|end| Some(end.diagonal)))?,
                    diagonal: in_place::<B, PATCHED>(
                        values,
                        next.ends.map(|end| Some(end.diagonal)),
                    )?,
                    coupling: in_place::<B, PATCHED>(values, step.ends.map(|end| end.coupling))?,
                };
                if t + 1 == count {
                    ends.diagonal[1] = &none;
                }
                ends
            } else {
                let (padded, other) = match (&mut padded, t % 2) {
                    (Some([even, odd]), 0) => (&*even, odd),
                    (Some([even, odd]), _) => (&*odd, even),
                    (None, _) => return None,
                };
                other.fill(values, step, next, t + 1 == count);
                let whole = step.ends.iter().all(|end| end.size == B);
                let own = whole.then_some(step.ends.map(|end| Some(end.diagonal)));
                Ends {
                    own: own.map_or(Some(padded.diagonal.each_ref()), |own| {
                        in_place::<B, PATCHED>(values, own)
                    })?,
                    diagonal: other.diagonal.each_ref(),
                    coupling: other.coupling.each_ref(),
                }
            };
            let here = &mut factor[2 * per_step(B) * t..];
            pivot = block::eliminate::<Q, B, _, _>(pivot, scratch, &ends, least, here)?;
        }
        let middle = steps[count].ends[0].diagonal;
        let [middle, _] = match (steps[..count].last(), &padded) {
            (Some(before), _) if before.full => in_place::<B, PATCHED>(values, [Some(middle); 2])?,
            (_, Some(padded)) => padded[count % 2].diagonal.each_ref(),
            (_, None) => return None,
        };
        let mut own = [Q::Half::splat(0.0); B];
        unroll!(i < B, {
            own[i] = Q::Half::splat(middle[i][i]);
        });
        for v in scratch.left_mut::<Q::Half, B>().chunks_exact_mut(2) {
            add(Q::Half::load(v)).store(v);
        }
        let here = &mut factor[2 * per_step(B) * count..];
        block::finish(add(pivot), scratch, own, least, here)
    }
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
        let at = |place: BlockSlot, i: usize| {
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

impl<const B: usize, const BORDER: bool> Kernel for Forward<'_, B, BORDER> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self {
            schedule,
            factor,
            b,
            z,
            u,
            sums,
        } = self;
        let (steps, count) = (&schedule.steps[..], schedule.steps());
        let mut rows = gather::<I::X2, B>(b, &steps[0]);
        let (of_steps, middle) = factor.split_at(2 * per_step(B) * count);
        let each = of_steps.chunks_exact(2 * per_step(B)).zip(&steps[1..]);
        for (t, (factor, step)) in each.enumerate() {
            let done = lower_solve(factor, rows);
            store_rows(&scaled(factor, done), &mut z[2 * B * t..]);
            rows = pass_on(factor, done, gather(b, step));
            if BORDER {
                add_to_sums(u, t, &done, sums);
            }
        }
        if count > 0 {
            rows = rows.map(add);
        }
        let one = pair::<I::X2>(1.0, 0.0);
        let done = lower_solve(middle, rows).map(|v| v * one);
        store_rows(&scaled(middle, done), &mut z[2 * B * count..]);
        if BORDER {
            add_to_sums(u, count, &done, sums);
        }
    }
}

/// Adds the part of step `t`, with rows `y`, to the sums Uᵀ y.
#[inline(always)]
fn add_to_sums<V: Lanes, const B: usize>(u: &[f64], t: usize, y: &[V; B], sums: &mut [f64]) {
    let columns = columns_of(u, B, sums.len() / 2, t);
    for (u, sum) in columns.zip(sums.chunks_exact_mut(2)) {
        let mut total = V::load(sum);
        unroll!(i < B, {
            total = layout::get::<V>(u, i).mul_add(y[i], total);
        });
        total.store(sum);
    }
}

/// Rows `z` less those of step `t` of U s.
#[inline(always)]
fn less_border<V: Lanes, const B: usize>(z: [V; B], u: &[f64], s: &[f64], t: usize) -> [V; B] {
    let mut rows = z;
    for (u, s) in columns_of(u, B, s.len(), t).zip(s) {
        let s = V::splat(*s);
        unroll!(i < B, {
            rows[i] = layout::get::<V>(u, i).neg_mul_add(s, rows[i]);
        });
    }
    rows
}

impl<const B: usize, const BORDER: bool> Kernel for Backward<'_, B, BORDER> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self {
            schedule,
            factor,
            z,
            u,
            s,
            x,
        } = self;
        let (steps, count) = (&schedule.steps[..], schedule.steps());
        let (of_steps, middle) = factor.split_at(2 * per_step(B) * count);
        let mut left = load_rows::<I::X2, B>(&z[2 * B * count..]);
        if BORDER {
            left = less_border(left, u, s, count);
        }
        let mut rows = upper_solve(middle, left.map(add));
        scatter(&rows, &steps[count], x);
        let z = z.chunks_exact(2 * B);
        let of_steps = of_steps.chunks_exact(2 * per_step(B));
        let each = of_steps.zip(z).zip(&steps[..count]).enumerate();
        for (t, ((factor, z), step)) in each.rev() {
            let mut left = load_rows(z);
            if BORDER {
                left = less_border(left, u, s, t);
            }
            rows = take_back(factor, left, rows);
            scatter(&rows, step, x);
        }
    }
}

impl<const B: usize> Kernel for SolveTwo<'_, B> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self {
            schedule,
            factor,
            b,
            z,
            x: [x, x_too],
        } = self;
        let (steps, count) = (&schedule.steps[..], schedule.steps());
        let mut rows = gather_two::<I::X4, B>(b, &steps[0]);
        let (of_steps, middle) = factor.split_at(2 * per_step(B) * count);
        let of_steps = of_steps.chunks_exact(2 * per_step(B));
        let each = of_steps.clone().zip(&steps[1..]);
        for ((factor, step), z) in each.zip(z.chunks_exact_mut(4 * B)) {
            let done = lower_solve(InBoth(factor), rows);
            store_rows(&scaled(InBoth(factor), done), z);
            rows = pass_on(InBoth(factor), done, gather_two(b, step));
        }
        let rows_of_middle = rows.map(add_in_halves);
        let done = lower_solve(InBoth(middle), rows_of_middle);
        rows = upper_solve(InBoth(middle), scaled(InBoth(middle), done));
        scatter(&rows.map(Halves::lower), &steps[count], x);
        scatter(&rows.map(Halves::upper), &steps[count], x_too);
        let back = of_steps.zip(z.chunks_exact(4 * B)).zip(&steps[..count]);
        for ((factor, z), step) in back.rev() {
            rows = take_back(InBoth(factor), load_rows(z), rows);
            scatter(&rows.map(Halves::lower), step, x);
            scatter(&rows.map(Halves::upper), step, x_too);
        }
    }
}

#[inline(always)]
fn gather_two<V: Halves<Half: Halves>, const B: usize>(b: [&[f64]; 2], step: &Step) -> [V; B] {
    let [one, other]: [[V::Half; B]; 2] = [gather(b[0], step), gather(b[1], step)];
    let mut rows = [V::splat(0.0); B];
    unroll!(i < B, {
        rows[i] = V::join(one[i], other[i]);
    });
    rows
}

#[inline(always)]
pub(super) fn store_rows<V: Lanes, const B: usize>(rows: &[V; B], to: &mut [f64]) {
    let to = &mut to[..V::LANES * B];
    unroll!(i < B, {
        rows[i].store(&mut to[V::LANES * i..]);
    });
}

#[inline(always)]
pub(super) fn load_rows<V: Lanes, const B: usize>(from: &[f64]) -> [V; B] {
    let from = &from[..V::LANES * B];
    let mut rows = [V::splat(0.0); B];
    unroll!(i < B, {
        rows[i] = V::load(&from[V::LANES * i..]);
    });
    rows
}
