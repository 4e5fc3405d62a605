//! The joints' part of S = J M̃⁻¹ Jᵀ + Σ, a block in each lane.
//!
//! J is that of (26), `model/src/constraint/gap.rs`, of which this writes out the product of a pair. With Q = [ [r]×; gᵀ ]
//! for a side's lever arm and gradients, a joint's block on a body is ∓[I 0; 0 0] beside ±Q, and with w = 1/m and A the
//! inverse of the angular part of M̃
//!
//! ```text
//! S_kk = Σ_sides (w I₃ ⊕ 0) + Q A Qᵀ + Σ_k,      S_kl = ±((w I₃ ⊕ 0) + Q_k A Q_lᵀ) for joints k, l at one body,
//! ```
//!
//! the sign being + where both are its side a or both its side b. Of each row of \[r]× one number is zero. Of a diagonal
//! block the lower triangle is computed: with G of rows gᵀ, which both sides share, H = A Gᵀ and P = A \[r]×ᵀ, it is
//!
//! ```text
//! ⎡ Σ_sides w I₃ + [r]× P                     ⎤
//! ⎣ Σ_sides ([r]× H)ᵀ       G Σ_sides H       ⎦ + Σ_k
//! ```
//!
//! Along a cable, where joint k has its side b at the body of side a of joint k + 1, both blocks of a column of S take the
//! same A Q_kᵀ = (P, H) of side b: they are written together, and the other blocks below the diagonal by themselves.

use crate::inertia::Inertia;
use std::sync::atomic::{Ordering, compiler_fence};
use taut_lanes::vector::{Sym3, Vec3, add, columns};
use taut_lanes::{Aligned, Isa, Kernel, Lanes, Level, WideKernel, dispatch, dispatch_wide};
use taut_model::lanes::{PACK, PerLanes, part};
use taut_model::{BodyPack, Joint, JointLanes, JointSide, Linearized};
use taut_solver::SymBlockMatrix;

/// Two joints at one body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Coupling {
    /// Joint and side of the block's rows, and of its columns.
    pub(crate) sides: [(usize, usize); 2],
    pub(crate) body: usize,
    /// First value of the block.
    pub(crate) target: usize,
}

/// Blocks that couple joints of which neither follows the other, side by side.
const BELOW: usize = 4;

/// Values of a block of six rows and columns.
const BLOCK: usize = 36;

/// Values of the columns of a joint: its diagonal block, then the one below.
const COLUMNS: usize = 2 * BLOCK;

/// Where a joint's diagonal block stands, and the block below it that couples it to the next joint.
#[derive(Debug, Clone, Copy, Default)]
struct Column {
    /// First value and rows of the diagonal block.
    diagonal: usize,
    rows: usize,
    /// First value and rows of the block below, if the next joint is at its body b.
    below: Option<(usize, usize)>,
}

/// Places of the joints' blocks in the matrix, and the buffers that fill them.
#[derive(Debug, Clone)]
pub(crate) struct Assembly {
    /// Columns of each pack of joints. The second part is the first value of a run: blocks of six
    /// rows and columns that follow each other without a break.
    columns: Vec<([Column; PACK], PerLanes<Option<usize>>)>,
    /// Other blocks below the diagonal, padded with copies of the last one; `coupled` counts them
    /// without the padding.
    couplings: Vec<Coupling>,
    coupled: usize,
    /// Columns of all lanes of a pack that is no run, before they are copied to their places.
    room: Aligned,
    /// Products of levers, inverse inertias and Σ of the present joints, for all lanes: [`PARTS`]
    /// each.
    scratch: Aligned,
}

impl Assembly {
    /// For the diagonal blocks of the `joints`, given by their first values, and blocks below the diagonal.
    pub(crate) fn new(
        joints: &[Joint],
        diagonal: impl Iterator<Item = usize>,
        mut couplings: Vec<Coupling>,
    ) -> Self {
        let joint = |(diagonal, joint): (usize, &Joint)| Column {
            diagonal,
            rows: joint.rows,
            below: None,
        };
        let mut columns: Vec<Column> = diagonal.zip(joints).map(joint).collect();
        couplings.retain(|c| {
            let [(next, left), (k, right)] = c.sides;
            let follows = (next, left, right) == (k + 1, 0, 1);
            if follows {
                columns[k].below = Some((c.target, joints[next].rows));
            }
            !follows
        });
        let coupled = couplings.len();
        if let Some(&last) = couplings.last() {
            couplings.resize(coupled.next_multiple_of(BELOW), last);
        }
        columns.resize(columns.len().next_multiple_of(PACK), Column::default());
        let packs = columns.as_chunks().0.iter();
        Self {
            columns: packs
                .map(|pack| (*pack, PerLanes::new(pack, first_of_run)))
                .collect(),
            couplings,
            coupled,
            room: Aligned::new(COLUMNS * PACK),
            scratch: Aligned::new(PARTS * PACK),
        }
    }

    /// Writes all blocks of joints.
    pub(crate) fn fill(
        &mut self,
        rows: &Linearized,
        inertia: &Inertia,
        sigma: &[f64],
        a: &mut SymBlockMatrix,
    ) {
        let values = a.values_mut();
        dispatch_wide(
            Level::best(),
            Columns {
                assembly_map: &mut *self,
                rows,
                inertia,
                sigma,
                values: &mut *values,
            },
        );
        dispatch(
            Level::best(),
            Below {
                assembly_map: self,
                rows,
                inertia,
                values,
            },
        );
    }
}

/// The first value of some columns where they are of blocks of six rows and columns, one after the other.
fn first_of_run(columns: &[Column]) -> Option<usize> {
    let first = columns[0].diagonal;
    let in_run = |(lane, column): (usize, &Column)| {
        let at = first + COLUMNS * lane;
        (column.diagonal, column.rows, column.below) == (at, 6, Some((at + BLOCK, 6)))
    };
    columns.iter().enumerate().all(in_run).then_some(first)
}

/// Takes the first `rows` rows and `columns` columns of a block of six rows.
#[inline(always)]
fn copy_block(block: &[f64; BLOCK], rows: usize, columns: usize, to: &mut [f64]) {
    match (rows, columns) {
        (6, 6) => to[..BLOCK].copy_from_slice(block),
        (6, 3) => to[..BLOCK / 2].copy_from_slice(&block[..BLOCK / 2]),
        _ => {
            let (all, _) = block.as_chunks::<6>();
            for (to, from) in to.chunks_exact_mut(rows).zip(&all[..columns]) {
                for (to, from) in to.iter_mut().zip(from) {
                    *to = *from;
                }
            }
        }
    }
}

/// Diagonal blocks, and those that couple a joint to the next.
struct Columns<'a> {
    assembly_map: &'a mut Assembly,
    rows: &'a Linearized,
    inertia: &'a Inertia,
    sigma: &'a [f64],
    values: &'a mut [f64],
}

impl WideKernel for Columns<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) {
        let mass = &self.inertia.inverse_mass[..];
        let angular = self.inertia.inverse_angular.view();
        let Assembly {
            columns,
            room,
            scratch,
            ..
        } = self.assembly_map;
        let (scratch, _) = scratch.as_chunks_mut::<L>();
        let mut following = self.rows.joint_lanes::<L>();
        following.next();
        for (k, joints) in self.rows.joint_lanes::<L>().enumerate() {
            let (first, bodies) = (k * L, [joints.bodies(0), joints.bodies(1)]);
            let between = bodies[1].load::<V>(mass);
            let pair = Pair {
                joints,
                inverse: [angular.load(&bodies[0]), angular.load(&bodies[1])],
                mass: bodies[0].load::<V>(mass) + between,
                sigma: joints.rows_of::<V>(self.sigma),
                next: joints.negative_side_of_next(&following.next().unwrap_or(joints)),
                between,
            };
            let (columns, run) = &columns[first / PACK];
            let in_place = run.get::<L>(first % PACK).map(|at| at..at + COLUMNS * L);
            let to = match &in_place {
                Some(at) => &mut self.values[at.clone()],
                None => &mut room[..COLUMNS * L],
            };
            pair.write_all(scratch, to);
            if in_place.is_some() {
                continue;
            }
            let blocks = room.as_chunks::<BLOCK>().0.chunks_exact(2);
            let columns = part::<_, L>(columns, first % PACK);
            for (column, blocks) in columns.iter().zip(blocks).take(joints.count()) {
                let m = column.rows;
                copy_block(&blocks[0], m, m, &mut self.values[column.diagonal..]);
                if let Some((at, rows)) = column.below {
                    copy_block(&blocks[1], rows, m, &mut self.values[at..]);
                }
            }
        }
    }
}

/// Where the parts of a joint's blocks are in the scratch, as vectors: H of side a, H and P of side b, and the lower
/// triangle of the diagonal block: rows of the gap, rows of the angles below them, rows of the angles beside these.
const H_A: usize = 0;
const H_B: usize = 9;
const P_B: usize = 18;
const GAP: usize = 27;
const MIXED: usize = 33;
const ANGLES: usize = 42;
const PARTS: usize = 48;

/// The factors of a joint's diagonal block and of the one below it. With what is made of them they exceed the registers:
/// the parts lie in memory, from which each is loaded where it is used.
struct Pair<'a, V, const L: usize> {
    joints: JointLanes<'a, L>,
    /// A of both bodies.
    inverse: [Sym3<V>; 2],
    /// 1/m_a + 1/m_b.
    mass: V,
    sigma: [V; 6],
    /// Side a of the next joint, −Q instead of Q.
    next: JointSide<V>,
    /// 1/m of the body between the two.
    between: V,
}

/// A hint to read from memory what was stored before; without it the same is computed, slower.
#[inline(always)]
fn fence() {
    compiler_fence(Ordering::SeqCst);
}

#[inline(always)]
fn get<V: Lanes, const L: usize, const N: usize>(from: &[[f64; L]], at: usize) -> [V; N] {
    let from = &from[at..at + N];
    let mut to = [V::splat(0.0); N];
    for (to, from) in to.iter_mut().zip(from) {
        *to = V::load(from);
    }
    to
}

#[inline(always)]
fn put<V: Lanes, const L: usize, const N: usize>(from: &[V; N], to: &mut [[f64; L]], at: usize) {
    for (to, from) in to[at..at + N].iter_mut().zip(from) {
        from.store(to);
    }
}

impl<V: Lanes, const L: usize> Pair<'_, V, L> {
    /// Writes both, of one joint after the other.
    #[inline(always)]
    fn write_all(&self, parts: &mut [[f64; L]], to: &mut [f64]) {
        let parts = &mut parts[..PARTS];
        self.side_a(parts);
        fence();
        self.side_b(parts);
        fence();
        self.sum_angles(parts);
        fence();
        self.write_blocks(parts, to);
    }

    /// The part of side a.
    #[inline(always)]
    fn side_a(&self, parts: &mut [[f64; L]]) {
        let (a, inverse) = (self.joints.side::<V>(0), columns(&self.inverse[0]));
        let [p, q, s] = a.gap_times(&inverse);
        let ([xx, xy, xz], [_, yy, yz], [.., zz]) = (a.gap_of(&p), a.gap_of(&q), a.gap_of(&s));
        put(&[xx, xy, xz, yy, yz, zz], parts, GAP);
        let h = a.angles_times(&inverse);
        for (row, h) in h.iter().enumerate() {
            put(h, parts, H_A + 3 * row);
            put(&a.gap_of(h), parts, MIXED + 3 * row);
        }
    }

    /// The part of side b, and what the gap has of the masses and Σ.
    #[inline(always)]
    fn side_b(&self, parts: &mut [[f64; L]]) {
        let (b, inverse) = (self.joints.side::<V>(1), columns(&self.inverse[1]));
        let p = b.gap_times(&inverse);
        let [xx, xy, xz, yy, yz, zz] = get(parts, GAP);
        let [xx, xy, xz] = b.add_gap_of(&p[0], &[xx, xy, xz]);
        let [_, yy, yz] = b.add_gap_of(&p[1], &[yy, yy, yz]);
        let [.., zz] = b.add_gap_of(&p[2], &[zz, zz, zz]);
        let [x, y, z, ..] = self.sigma;
        let (xx, yy) = (xx + (self.mass + x), yy + (self.mass + y));
        put(&[xx, xy, xz, yy, yz, zz + (self.mass + z)], parts, GAP);
        let h = b.angles_times(&inverse);
        for (row, (p, h)) in p.iter().zip(&h).enumerate() {
            put(p, parts, P_B + 3 * row);
            put(h, parts, H_B + 3 * row);
            let mixed = b.add_gap_of(h, &get(parts, MIXED + 3 * row));
            put(&mixed, parts, MIXED + 3 * row);
        }
    }

    /// The rows of the angles beside themselves.
    #[inline(always)]
    fn sum_angles(&self, parts: &mut [[f64; L]]) {
        let side = self.joints.side::<V>(0);
        let [.., p, q, s] = self.sigma;
        let [pp, qp, sp] = side.angles_of(&add(&get(parts, H_A), &get(parts, H_B)));
        let [_, qq, sq] = side.angles_of(&add(&get(parts, H_A + 3), &get(parts, H_B + 3)));
        let [.., ss] = side.angles_of(&add(&get(parts, H_A + 6), &get(parts, H_B + 6)));
        put(&[pp + p, qp, sp, qq + q, sq, ss + s], parts, ANGLES);
    }

    /// Writes the diagonal block out of its lower triangle, and the block below, whose columns are Q of the next joint times
    /// P and H of side b, with the mass between for the gap.
    #[inline(always)]
    fn write_blocks(&self, parts: &[[f64; L]], to: &mut [f64]) {
        let to = &mut to[..COLUMNS * L];
        let at =
            |first: usize| -> [usize; L] { std::array::from_fn(|lane| COLUMNS * lane + first) };
        let [xx, xy, xz, yy, yz, zz] = get::<V, L, 6>(parts, GAP);
        let [px, py, pz, qx, qy, qz, sx, sy, sz] = get::<V, L, 9>(parts, MIXED);
        let [pp, qp, sp, qq, sq, ss] = get::<V, L, 6>(parts, ANGLES);
        V::scatter_fours(&[xx, xy, xz, px, qx, sx, xy, yy], to, at(0));
        V::scatter_fours(&[yz, py, qy, sy, xz, yz, zz, pz], to, at(8));
        V::scatter_fours(&[qz, sz, px, py, pz, pp, qp, sp], to, at(16));
        V::scatter_fours(&[qx, qy, qz, qp, qq, sq, sx, sy], to, at(24));
        fence();
        let between = self.between;
        let [x, y, z, p, t, u] = self.next.apply(&get(parts, P_B));
        V::scatter_fours(&[sz, sp, sq, ss, x - between, y, z, p], to, at(32));
        let [x, y, z, p, q, s] = self.next.apply(&get(parts, P_B + 3));
        V::scatter_fours(&[t, u, x, y - between, z, p, q, s], to, at(40));
        let [x, y, z, p, q, s] = self.next.apply(&get(parts, P_B + 6));
        let [d, e, f, g, t, u] = self.next.apply(&get(parts, H_B));
        V::scatter_fours(&[x, y, z - between, p, q, s, d, e], to, at(48));
        let [x, y, z, p, q, s] = self.next.apply(&get(parts, H_B + 3));
        V::scatter_fours(&[f, g, t, u, x, y, z, p], to, at(56));
        let [x, y, z, p, t, u] = self.next.apply(&get(parts, H_B + 6));
        V::scatter_fours(&[q, s, x, y, z, p, t, u], to, at(64));
    }
}

/// Blocks that couple two joints of which neither follows the other.
struct Below<'a> {
    assembly_map: &'a mut Assembly,
    rows: &'a Linearized,
    inertia: &'a Inertia,
    values: &'a mut [f64],
}

impl Kernel for Below<'_> {
    type Output = ();

    /// They are few, and what they are made of is gathered number by number: eight lanes would take twice as long for each.
    #[inline(always)]
    fn run<I: Isa>(self) {
        self.write::<I::X4, BELOW>();
    }
}

impl Below<'_> {
    #[inline(always)]
    fn write<V: Lanes, const L: usize>(self) {
        let mass = &self.inertia.inverse_mass[..];
        let angular = self.inertia.inverse_angular.view();
        let joints = self.rows.joints();
        let Assembly {
            couplings,
            coupled,
            room,
            ..
        } = self.assembly_map;
        let (couplings, _) = couplings.as_chunks::<L>();
        for (k, couplings) in couplings.iter().enumerate() {
            let bodies = BodyPack::new(std::array::from_fn(|l| couplings[l % L].body));
            let bodies = bodies.lanes::<L>(0);
            let (w, a) = (bodies.load::<V>(mass), angular.load(&bodies));
            let same = |c: &Coupling| c.sides[0].1 == c.sides[1].1;
            let sign = V::from_fn(|l| if same(&couplings[l]) { 1.0 } else { -1.0 });
            let mut signed: Sym3<V> = a;
            for a in &mut signed {
                *a = *a * sign;
            }
            let blocks = Across {
                left: self.rows.joint_sides(couplings.map(|c| c.sides[0])),
                right: self.rows.joint_sides(couplings.map(|c| c.sides[1])),
                inverse: columns(&signed),
                mass: w * sign,
            };
            blocks.write::<L, 0>(room);
            blocks.write::<L, 1>(room);
            blocks.write::<L, 2>(room);
            blocks.write::<L, 3>(room);
            blocks.write::<L, 4>(room);
            blocks.write::<L, 5>(room);
            let count = *coupled - L * k;
            let blocks = room.as_chunks::<BLOCK>().0;
            for (c, block) in couplings.iter().zip(blocks).take(count) {
                let [rows, columns] = c.sides.map(|(k, _)| joints[k].rows);
                copy_block(block, rows, columns, &mut self.values[c.target..]);
            }
        }
    }
}

/// Factors of a block that couples two joints at one body. `inverse` and `mass` carry the sign that
/// the sides give M̃⁻¹.
struct Across<V> {
    left: JointSide<V>,
    right: JointSide<V>,
    inverse: [Vec3<V>; 3],
    mass: V,
}

impl<V: Lanes> Across<V> {
    /// Writes column `C`.
    #[inline(always)]
    fn write<const L: usize, const C: usize>(&self, to: &mut [f64]) {
        let mut column = self.left.apply(&self.right.row_times::<C>(&self.inverse));
        if C < 3 {
            column[C] = column[C] + self.mass;
        }
        let at: [usize; L] = std::array::from_fn(|lane| BLOCK * lane + 6 * C);
        V::scatter(&column, to, at);
    }
}
