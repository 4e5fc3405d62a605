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
//! same A Q_kᵀ and stand one after the other: a stretch of four joints is written in one go.

use crate::inertia::Inertia;
use crate::lanes::{of_rows, side};
use crate::six::{Group, View};
use taut_lanes::vector::{Sym3, Vec3, columns, combine, cross, dot, load, save, scale, scale_add};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
use taut_model::{ABREAST, Abreast, Four, Linearized, Pack};
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

/// Values of the blocks of a stretch.
const STRETCH: usize = 2 * BLOCK * ABREAST;

/// A pack of joints of six rows, each of which is followed by another at its body b.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    pack: usize,
    /// First value of the first diagonal block. The block below it follows, then the next diagonal block, and so on.
    first: usize,
}

/// Where the joints' blocks are.
#[derive(Debug, Clone)]
pub(crate) struct Assembly {
    stretches: Vec<Stretch>,
    /// All other packs, and the first value of each joint's diagonal block, filled up with copies of the last one.
    apart: Vec<(usize, [usize; ABREAST])>,
    /// All other blocks below the diagonal, filled up likewise.
    couplings: Vec<Coupling>,
}

impl Assembly {
    /// For the diagonal blocks of the `joints`, given by their first values, and blocks below the diagonal.
    pub(crate) fn new(
        joints: &Abreast,
        mut diagonal: Vec<usize>,
        mut couplings: Vec<Coupling>,
    ) -> Self {
        // Whether a joint is followed by the next, as in a stretch.
        let mut followed = vec![false; diagonal.len()];
        for c in &couplings {
            let [(next, left), (k, right)] = c.sides;
            followed[k] |= (next, left, right) == (k + 1, 0, 1)
                && [k, next].iter().all(|&k| joints.joints()[k].rows == 6)
                && c.target == diagonal[k] + BLOCK;
        }
        let mut stretches = Vec::new();
        for (pack, first) in diagonal.as_chunks::<ABREAST>().0.iter().enumerate() {
            let places = (0..ABREAST).map(|lane| first[0] + 2 * BLOCK * lane);
            let at = ABREAST * pack..ABREAST * (pack + 1);
            let whole = followed[at.clone()].iter().all(|followed| *followed);
            if whole && first.iter().copied().eq(places) {
                let first = first[0];
                stretches.push(Stretch { pack, first });
            } else {
                followed[at].fill(false);
            }
        }
        let rest = diagonal.len() - diagonal.len() % ABREAST;
        followed[rest..].fill(false);
        couplings.retain(|c| !followed[c.sides[1].0] || c.target != diagonal[c.sides[1].0] + BLOCK);
        if let Some(&last) = diagonal.last() {
            diagonal.resize(diagonal.len().next_multiple_of(ABREAST), last);
        }
        if let Some(&last) = couplings.last() {
            couplings.resize(couplings.len().next_multiple_of(ABREAST), last);
        }
        let packs = diagonal.as_chunks().0.iter().copied().enumerate();
        let alone = |(pack, _): &(usize, _)| !followed.get(ABREAST * pack).is_some_and(|f| *f);
        Self {
            apart: packs.filter(alone).collect(),
            stretches,
            couplings,
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
            Stretches {
                plan: self,
                rows,
                inertia,
                sigma,
                values: &mut *values,
            },
        );
        dispatch(
            Level::best(),
            Diagonal {
                plan: self,
                rows,
                inertia,
                sigma,
                values: &mut *values,
            },
        );
        let joints = &rows.abreast;
        dispatch(
            Level::best(),
            Below {
                plan: self,
                joints,
                inertia,
                values,
            },
        );
    }
}

/// Lever arm and gradients of one side, whatever the side.
struct Side<V> {
    arm: Vec3<V>,
    gradients: [Vec3<V>; 3],
}

impl<V: Lanes> Side<V> {
    #[inline(always)]
    fn of_pack(pack: &Pack, side: usize) -> Self {
        let [p, q, s] = &pack.gradients;
        Self {
            arm: load(&pack.arms[side]),
            gradients: [load(p), load(q), load(s)],
        }
    }

    /// Joint and side of each lane.
    #[inline(always)]
    fn of_joints(packs: &[Pack], sides: [(usize, usize); ABREAST]) -> Self {
        // A side is 0 or 1, which the bounds check cannot know.
        let at = sides.map(|(k, side)| (&packs[k / ABREAST], k % ABREAST, side & 1));
        let zero = [V::splat(0.0); 3];
        let (mut arm, mut gradients) = (zero, [zero; 3]);
        for (i, arm) in arm.iter_mut().enumerate() {
            *arm = V::from_fn(|l| at[l].0.arms[at[l].2][i][at[l].1]);
        }
        for (q, gradient) in gradients.iter_mut().enumerate() {
            for (i, g) in gradient.iter_mut().enumerate() {
                *g = V::from_fn(|l| at[l].0.gradients[q][i][at[l].1]);
            }
        }
        Self { arm, gradients }
    }

    /// Row `R` of Q A, for the columns of A; those of \[r]× are (0, −z, y), (z, 0, −x), (−y, x, 0).
    #[inline(always)]
    fn row_times<const R: usize>(&self, a: &[Vec3<V>; 3]) -> Vec3<V> {
        let [x, y, z] = self.arm;
        let [ax, ay, az] = a;
        match R {
            0 => scale_add(az, y, &scale(ay, -z)),
            1 => scale_add(ax, z, &scale(az, -x)),
            2 => scale_add(ay, x, &scale(ax, -y)),
            _ => combine(a, &self.gradients[R - 3]),
        }
    }

    /// Q x.
    #[inline(always)]
    fn apply(&self, v: &Vec3<V>) -> [V; 6] {
        let [x, y, z] = cross(&self.arm, v);
        let [p, q, s] = &self.gradients;
        [x, y, z, dot(p, v), dot(q, v), dot(s, v)]
    }
}

impl<V: Lanes> Side<V> {
    /// Side a of the joints that follow those of a pack, −Q instead of Q.
    #[inline(always)]
    fn negative_of_next(pack: &Pack, next: &Pack) -> Self {
        Self {
            arm: negative_shifted(&pack.arms[0], &next.arms[0]),
            gradients: [
                negative_shifted(&pack.gradients[0], &next.gradients[0]),
                negative_shifted(&pack.gradients[1], &next.gradients[1]),
                negative_shifted(&pack.gradients[2], &next.gradients[2]),
            ],
        }
    }
}

/// What stands one lane on, with the other sign.
#[inline(always)]
fn negative_shifted<V: Lanes>(pack: &[Four; 3], next: &[Four; 3]) -> Vec3<V> {
    let mut shifted = [V::splat(0.0); 3];
    for (to, (a, b)) in shifted.iter_mut().zip(pack.iter().zip(next)) {
        *to = -V::from_fn(|l| if l + 1 < ABREAST { a[l + 1] } else { b[0] });
    }
    shifted
}

/// Where four blocks are written to, column by column.
struct Blocks<'a> {
    values: &'a mut [f64],
    /// First value, rows and columns of each.
    targets: [usize; ABREAST],
    rows: [usize; ABREAST],
    columns: [usize; ABREAST],
    /// Whether all have 6 rows and columns.
    six: bool,
}

impl Blocks<'_> {
    #[inline(always)]
    fn write<V: Lanes, const C: usize>(&mut self, column: &[V; 6]) {
        if self.six {
            return V::scatter(column, self.values, self.targets.map(|t| t + 6 * C));
        }
        let column: [Four; 6] = save(column);
        for lane in 0..ABREAST {
            let m = self.rows[lane];
            if C < self.columns[lane] {
                let to = &mut self.values[self.targets[lane] + m * C..][..m];
                for (to, from) in to.iter_mut().zip(&column) {
                    *to = from[lane];
                }
            }
        }
    }
}

/// 1/m and A of four bodies; zeros for the world.
#[inline(always)]
fn inverse_inertia<V: Lanes>(mass: &[f64], angular: &View<'_>, bodies: &Group) -> (V, Sym3<V>) {
    (bodies.load(mass), angular.load(bodies))
}

/// Both blocks of the columns of a stretch's joints.
struct Stretches<'a> {
    plan: &'a Assembly,
    rows: &'a Linearized,
    inertia: &'a Inertia,
    sigma: &'a [f64],
    values: &'a mut [f64],
}

impl Kernel for Stretches<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mass = &self.inertia.inverse_mass[..];
        let angular = self.inertia.inverse_angular.view();
        let joints = &self.rows.abreast;
        let packs = joints.jacobians();
        for s in &self.plan.stretches {
            let (pack, places) = (&packs[s.pack], &joints.places()[s.pack]);
            let bodies = [side(places, 0), side(places, 1)];
            let between = bodies[1].load::<I::X4>(mass);
            let mut room = [[[0.0; ABREAST]; 6]; 2];
            let [room_a, room_b] = &mut room;
            let pair = Pair {
                pack,
                inverse: [
                    angular.places(&bodies[0], room_a),
                    angular.places(&bodies[1], room_b),
                ],
                mass: bodies[0].load::<I::X4>(mass) + between,
                sigma: of_rows::<I::X4>(self.sigma, places),
                next: Side::negative_of_next(pack, &packs[s.pack + 1]),
                between,
            };
            let Some(to) = self.values[s.first..].first_chunk_mut() else {
                continue;
            };
            pair.write::<0>(to);
            pair.write::<1>(to);
            pair.write::<2>(to);
            pair.write::<3>(to);
            pair.write::<4>(to);
            pair.write::<5>(to);
        }
    }
}

/// What a joint's diagonal block and the one below it are made of. Registers do not hold it: what stands in memory is
/// left there, and loaded for each column anew, for a load is nothing beside the store that it takes to keep a number.
struct Pair<'a, V> {
    pack: &'a Pack,
    /// A of both bodies.
    inverse: [[&'a Four; 6]; 2],
    /// 1/m_a + 1/m_b.
    mass: V,
    sigma: [V; 6],
    /// Side a of the next joint, −Q instead of Q.
    next: Side<V>,
    /// 1/m of the body between the two.
    between: V,
}

/// The columns of A.
#[inline(always)]
fn loaded<V: Lanes>(a: &[&Four; 6]) -> [Vec3<V>; 3] {
    let mut loaded = [V::splat(0.0); 6];
    for (to, from) in loaded.iter_mut().zip(a) {
        *to = V::load(*from);
    }
    columns(&loaded)
}

impl<V: Lanes> Pair<'_, V> {
    /// Writes column `C` of both.
    #[inline(always)]
    fn write<const C: usize>(&self, to: &mut [f64; STRETCH]) {
        let [a, b] = &self.inverse;
        let joint = Whole {
            sides: [Side::of_pack(self.pack, 0), Side::of_pack(self.pack, 1)],
            inverse: [loaded(a), loaded(b)],
            mass: self.mass,
            sigma: self.sigma,
        };
        let (column, on_b) = joint.column::<C>();
        let at = [0, 1, 2, 3].map(|lane| 2 * BLOCK * lane + 6 * C);
        V::scatter(&column, to, at);
        let mut below = self.next.apply(&on_b);
        if C < 3 {
            below[C] = below[C] - self.between;
        }
        V::scatter(&below, to, at.map(|at| at + BLOCK));
    }
}

/// Diagonal blocks of all other joints.
struct Diagonal<'a> {
    plan: &'a Assembly,
    rows: &'a Linearized,
    inertia: &'a Inertia,
    sigma: &'a [f64],
    values: &'a mut [f64],
}

impl Kernel for Diagonal<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mass = &self.inertia.inverse_mass[..];
        let angular = self.inertia.inverse_angular.view();
        let joints = &self.rows.abreast;
        for (k, targets) in &self.plan.apart {
            let (pack, places) = (&joints.jacobians()[*k], &joints.places()[*k]);
            let (w_a, a) = inverse_inertia::<I::X4>(mass, &angular, &side(places, 0));
            let (w_b, b) = inverse_inertia::<I::X4>(mass, &angular, &side(places, 1));
            let (side_a, side_b) = (Side::of_pack(pack, 0), Side::of_pack(pack, 1));
            let sigma = of_rows::<I::X4>(self.sigma, places);
            let mut blocks = Blocks {
                values: &mut *self.values,
                targets: *targets,
                rows: places.rows,
                columns: places.rows,
                six: places.six,
            };
            let joint = Whole {
                sides: [side_a, side_b],
                inverse: [columns(&a), columns(&b)],
                mass: w_a + w_b,
                sigma,
            };
            blocks.write::<I::X4, 0>(&joint.column::<0>().0);
            blocks.write::<I::X4, 1>(&joint.column::<1>().0);
            blocks.write::<I::X4, 2>(&joint.column::<2>().0);
            blocks.write::<I::X4, 3>(&joint.column::<3>().0);
            blocks.write::<I::X4, 4>(&joint.column::<4>().0);
            blocks.write::<I::X4, 5>(&joint.column::<5>().0);
        }
    }
}

/// What a joint's diagonal block is made of.
struct Whole<V> {
    sides: [Side<V>; 2],
    /// A of both bodies.
    inverse: [[Vec3<V>; 3]; 2],
    /// 1/m_a + 1/m_b.
    mass: V,
    sigma: [V; 6],
}

impl<V: Lanes> Whole<V> {
    /// Column `C`, and that of A Qᵀ of side b.
    #[inline(always)]
    fn column<const C: usize>(&self) -> ([V; 6], Vec3<V>) {
        let [a, b] = &self.sides;
        let mut column = a.apply(&a.row_times::<C>(&self.inverse[0]));
        let times_b = b.row_times::<C>(&self.inverse[1]);
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
}

/// Blocks that couple two joints and are not of a stretch.
struct Below<'a> {
    plan: &'a Assembly,
    joints: &'a Abreast,
    inertia: &'a Inertia,
    values: &'a mut [f64],
}

impl Kernel for Below<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mass = &self.inertia.inverse_mass[..];
        let angular = self.inertia.inverse_angular.view();
        let (packs, joints) = (self.joints.jacobians(), self.joints.joints());
        let (couplings, _) = self.plan.couplings.as_chunks::<ABREAST>();
        for couplings in couplings {
            let bodies = couplings.map(|c| c.body);
            let neighbours = bodies.windows(2).all(|pair| pair[1] == pair[0] + 1);
            let bodies = Group::new(bodies, neighbours);
            let (w, a) = inverse_inertia::<I::X4>(mass, &angular, &bodies);
            let left = Side::<I::X4>::of_joints(packs, couplings.map(|c| c.sides[0]));
            let right = Side::<I::X4>::of_joints(packs, couplings.map(|c| c.sides[1]));
            let same = |c: &Coupling| c.sides[0].1 == c.sides[1].1;
            let sign = I::X4::from_fn(|l| if same(&couplings[l]) { 1.0 } else { -1.0 });
            let mut signed = a;
            for a in &mut signed {
                *a = *a * sign;
            }
            let (signed, w) = (columns(&signed), w * sign);
            let rows = couplings.map(|c| joints[c.sides[0].0].rows);
            let across = couplings.map(|c| joints[c.sides[1].0].rows);
            let mut blocks = Blocks {
                values: &mut *self.values,
                targets: couplings.map(|c| c.target),
                six: rows == [6; ABREAST] && across == [6; ABREAST],
                rows,
                columns: across,
            };
            let mut first = left.apply(&right.row_times::<0>(&signed));
            first[0] = first[0] + w;
            blocks.write::<I::X4, 0>(&first);
            let mut second = left.apply(&right.row_times::<1>(&signed));
            second[1] = second[1] + w;
            blocks.write::<I::X4, 1>(&second);
            let mut third = left.apply(&right.row_times::<2>(&signed));
            third[2] = third[2] + w;
            blocks.write::<I::X4, 2>(&third);
            blocks.write::<I::X4, 3>(&left.apply(&right.row_times::<3>(&signed)));
            blocks.write::<I::X4, 4>(&left.apply(&right.row_times::<4>(&signed)));
            blocks.write::<I::X4, 5>(&left.apply(&right.row_times::<5>(&signed)));
        }
    }
}
