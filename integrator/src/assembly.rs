//! The joints' part of S = J M̃⁻¹ Jᵀ + Σ, four blocks at a time.
//!
//! With Q = [ [r]×; gᵀ ] for a side's lever arm and gradients, a joint's block on a body is ∓[I 0; 0 0] beside ±Q, and
//! with w = 1/m and A the inverse of the angular part of M̃
//!
//! ```text
//! S_kk = Σ_sides (w I₃ ⊕ 0) + Q A Qᵀ + Σ_k,      S_kl = ±((w I₃ ⊕ 0) + Q_k A Q_lᵀ) for joints k, l at one body,
//! ```
//!
//! + where both are its side a or both its side b. Of each row of \[r]× one number is zero.
//!
//! Along a cable, where joint k has its side b at the body of side a of joint k + 1, both blocks of a column of S take the
//! same A Q_kᵀ: they are written together, and the other blocks below the diagonal by themselves.

use crate::inertia::Inertia;
use taut_lanes::vector::{Sym3, Vec3, columns};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
use taut_model::{FourBodies, FourJoints, Joint, JointSide, Linearized, PACK};
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

/// Values of a block of six rows and columns.
const BLOCK: usize = 36;

/// Values of the columns of four joints: of each its diagonal block, then the one below.
const COLUMNS: usize = 2 * BLOCK * PACK;

/// Where a joint's diagonal block stands, and the block below it that couples it to the next joint.
#[derive(Debug, Clone, Copy, Default)]
struct Column {
    /// First value and rows of the diagonal block.
    diagonal: usize,
    rows: usize,
    /// First value and rows of the block below, if the next joint is at its body b.
    below: Option<(usize, usize)>,
}

/// Where the joints' blocks are.
#[derive(Debug, Clone)]
pub(crate) struct Assembly {
    /// Of each pack, and the first value where all of it is of blocks of six rows and columns, one after the other.
    columns: Vec<([Column; PACK], Option<usize>)>,
    /// All other blocks below the diagonal, filled up with copies of the last one, and how many they are.
    couplings: Vec<Coupling>,
    coupled: usize,
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
            couplings.resize(coupled.next_multiple_of(PACK), last);
        }
        columns.resize(columns.len().next_multiple_of(PACK), Column::default());
        let packs = columns.as_chunks().0.iter();
        Self {
            columns: packs.map(|pack| (*pack, first_of_run(pack))).collect(),
            couplings,
            coupled,
        }
    }

    /// Writes all blocks of joints.
    pub(crate) fn fill(
        &self,
        rows: &Linearized,
        inertia: &Inertia,
        sigma: &[f64],
        a: &mut SymBlockMatrix,
    ) {
        let values = a.values_mut();
        dispatch(
            Level::best(),
            Columns {
                plan: self,
                rows,
                inertia,
                sigma,
                values: &mut *values,
            },
        );
        dispatch(
            Level::best(),
            Below {
                plan: self,
                rows,
                inertia,
                values,
            },
        );
    }
}

/// The first value of a pack's columns where they are of blocks of six rows and columns, one after the other.
fn first_of_run(pack: &[Column; PACK]) -> Option<usize> {
    let first = pack[0].diagonal;
    let in_run = |(lane, column): (usize, &Column)| {
        let at = first + 2 * BLOCK * lane;
        (column.diagonal, column.rows, column.below) == (at, 6, Some((at + BLOCK, 6)))
    };
    pack.iter().enumerate().all(in_run).then_some(first)
}

/// Takes the first `rows` rows and `columns` columns of a block of six rows.
fn copy_block(block: &[f64], rows: usize, columns: usize, to: &mut [f64]) {
    if rows == 6 {
        let all = 6 * columns;
        return to[..all].copy_from_slice(&block[..all]);
    }
    let columns = block.chunks_exact(6).take(columns);
    for (to, from) in to.chunks_exact_mut(rows).zip(columns) {
        to.copy_from_slice(&from[..rows]);
    }
}

/// Diagonal blocks, and those that couple a joint to the next.
struct Columns<'a> {
    plan: &'a Assembly,
    rows: &'a Linearized,
    inertia: &'a Inertia,
    sigma: &'a [f64],
    values: &'a mut [f64],
}

impl Kernel for Columns<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mass = &self.inertia.inverse_mass[..];
        let angular = self.inertia.inverse_angular.view();
        let mut room = [0.0; COLUMNS];
        let mut following = self.rows.four_joints();
        following.next();
        for (four, (columns, run)) in self.rows.four_joints().zip(&self.plan.columns) {
            let bodies = [four.bodies(0), four.bodies(1)];
            let between = bodies[1].load::<I::X4>(mass);
            let pair = Pair {
                four,
                inverse: [angular.load(bodies[0]), angular.load(bodies[1])],
                mass: bodies[0].load::<I::X4>(mass) + between,
                sigma: four.rows_of::<I::X4>(self.sigma),
                next: four.negative_side_of_next(&following.next().unwrap_or(four)),
                between,
            };
            let in_place = run.and_then(|first| self.values[first..].first_chunk_mut());
            let is_in_place = in_place.is_some();
            pair.write_all(in_place.unwrap_or(&mut room));
            if is_in_place {
                continue;
            }
            let blocks = room.as_chunks::<BLOCK>().0.chunks_exact(2);
            for (column, blocks) in columns.iter().zip(blocks).take(four.count()) {
                let m = column.rows;
                copy_block(&blocks[0], m, m, &mut self.values[column.diagonal..]);
                if let Some((at, rows)) = column.below {
                    copy_block(&blocks[1], rows, m, &mut self.values[at..]);
                }
            }
        }
    }
}

/// The factors of a joint's diagonal block and of the one below it. They exceed the registers: each column loads them
/// anew, which is cheaper than spilling.
struct Pair<'a, V> {
    four: FourJoints<'a>,
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

impl<V: Lanes> Pair<'_, V> {
    /// Writes both.
    #[inline(always)]
    fn write_all(&self, to: &mut [f64; COLUMNS]) {
        self.write::<0, 1>(to);
        self.write::<2, 3>(to);
        self.write::<4, 5>(to);
    }

    /// Writes columns `C` and `D`, which is the next, of both.
    #[inline(always)]
    fn write<const C: usize, const D: usize>(&self, to: &mut [f64; COLUMNS]) {
        let at = [0, 1, 2, 3].map(|lane| 2 * BLOCK * lane + 6 * C);
        let (at_rest, at_below) = (at.map(|at| at + 4), at.map(|at| at + BLOCK));
        let ([x, y, z, p, q, s], on_b) = self.column::<C>();
        V::scatter_fours(&[x, y, z, p], to, at);
        let [x, y, z, p, t, u] = self.below::<C>(&on_b);
        V::scatter_fours(&[x, y, z, p], to, at_below);
        let ([x, y, z, a, b, c], on_b) = self.column::<D>();
        V::scatter_fours(&[q, s, x, y, z, a, b, c], to, at_rest);
        let [x, y, z, a, b, c] = self.below::<D>(&on_b);
        let at_rest = at_below.map(|at| at + 4);
        V::scatter_fours(&[t, u, x, y, z, a, b, c], to, at_rest);
    }

    /// Column `C` of the diagonal block, and that of A Qᵀ of side b.
    #[inline(always)]
    fn column<const C: usize>(&self) -> ([V; 6], Vec3<V>) {
        let (a, b) = (self.four.side::<V>(0), self.four.side::<V>(1));
        let mut column = a.apply(&a.row_times::<C>(&columns(&self.inverse[0])));
        let times_b = b.row_times::<C>(&columns(&self.inverse[1]));
        for (sum, on_b) in column.iter_mut().zip(b.apply(&times_b)) {
            *sum = *sum + on_b;
        }
        let straight = if C < 3 {
            self.mass + self.sigma[C]
        } else {
            self.sigma[C]
        };
        column[C] = column[C] + straight;
        (column, times_b)
    }

    /// Column `C` of the block below.
    #[inline(always)]
    fn below<const C: usize>(&self, on_b: &Vec3<V>) -> [V; 6] {
        let mut below = self.next.apply(on_b);
        if C < 3 {
            below[C] = below[C] - self.between;
        }
        below
    }
}

/// Blocks that couple two joints of which neither follows the other.
struct Below<'a> {
    plan: &'a Assembly,
    rows: &'a Linearized,
    inertia: &'a Inertia,
    values: &'a mut [f64],
}

impl Kernel for Below<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mass = &self.inertia.inverse_mass[..];
        let angular = self.inertia.inverse_angular.view();
        let joints = self.rows.joints();
        let (couplings, _) = self.plan.couplings.as_chunks::<PACK>();
        let mut room = [0.0; BLOCK * PACK];
        for (k, couplings) in couplings.iter().enumerate() {
            let bodies = couplings.map(|c| c.body);
            let bodies = FourBodies::new(bodies);
            let (w, a) = (bodies.load::<I::X4>(mass), angular.load(&bodies));
            let same = |c: &Coupling| c.sides[0].1 == c.sides[1].1;
            let sign = I::X4::from_fn(|l| if same(&couplings[l]) { 1.0 } else { -1.0 });
            let mut signed: Sym3<I::X4> = a;
            for a in &mut signed {
                *a = *a * sign;
            }
            let blocks = Across {
                left: self
                    .rows
                    .joint_sides::<I::X4>(couplings.map(|c| c.sides[0])),
                right: self.rows.joint_sides(couplings.map(|c| c.sides[1])),
                inverse: columns(&signed),
                mass: w * sign,
            };
            blocks.write::<0>(&mut room);
            blocks.write::<1>(&mut room);
            blocks.write::<2>(&mut room);
            blocks.write::<3>(&mut room);
            blocks.write::<4>(&mut room);
            blocks.write::<5>(&mut room);
            let count = self.plan.coupled - PACK * k;
            let blocks = room.as_chunks::<BLOCK>().0;
            for (c, block) in couplings.iter().zip(blocks).take(count) {
                let [rows, columns] = c.sides.map(|(k, _)| joints[k].rows);
                copy_block(block, rows, columns, &mut self.values[c.target..]);
            }
        }
    }
}

/// What a block that couples two joints is made of, with the sign of A and 1/m that their sides give it.
struct Across<V> {
    left: JointSide<V>,
    right: JointSide<V>,
    inverse: [Vec3<V>; 3],
    mass: V,
}

impl<V: Lanes> Across<V> {
    /// Writes column `C`.
    #[inline(always)]
    fn write<const C: usize>(&self, to: &mut [f64; BLOCK * PACK]) {
        let mut column = self.left.apply(&self.right.row_times::<C>(&self.inverse));
        if C < 3 {
            column[C] = column[C] + self.mass;
        }
        V::scatter(&column, to, [0, 1, 2, 3].map(|lane| BLOCK * lane + 6 * C));
    }
}
