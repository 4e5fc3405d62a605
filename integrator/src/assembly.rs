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

/// Where the joints' blocks are.
#[derive(Debug, Clone)]
pub(crate) struct Assembly {
    /// First value of each joint's diagonal block, filled up with copies of the last one.
    diagonal: Vec<usize>,
    /// Blocks below the diagonal, filled up likewise.
    couplings: Vec<Coupling>,
}

impl Assembly {
    pub(crate) fn new(mut diagonal: Vec<usize>, mut couplings: Vec<Coupling>) -> Self {
        if let Some(&last) = diagonal.last() {
            diagonal.resize(diagonal.len().next_multiple_of(ABREAST), last);
        }
        if let Some(&last) = couplings.last() {
            couplings.resize(couplings.len().next_multiple_of(ABREAST), last);
        }
        Self {
            diagonal,
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
        let packs = self.rows.abreast.packs();
        let (targets, _) = self.plan.diagonal.as_chunks::<ABREAST>();
        for ((pack, places), targets) in packs.zip(targets) {
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
            blocks.write::<I::X4, 0>(&joint.column::<0>());
            blocks.write::<I::X4, 1>(&joint.column::<1>());
            blocks.write::<I::X4, 2>(&joint.column::<2>());
            blocks.write::<I::X4, 3>(&joint.column::<3>());
            blocks.write::<I::X4, 4>(&joint.column::<4>());
            blocks.write::<I::X4, 5>(&joint.column::<5>());
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
    #[inline(always)]
    fn column<const C: usize>(&self) -> [V; 6] {
        let [a, b] = &self.sides;
        let mut column = a.apply(&a.row_times::<C>(&self.inverse[0]));
        let on_b = b.apply(&b.row_times::<C>(&self.inverse[1]));
        for (sum, on_b) in column.iter_mut().zip(on_b) {
            *sum = *sum + on_b;
        }
        let straight = if C < 3 {
            self.mass + self.sigma[C]
        } else {
            self.sigma[C]
        };
        column[C] = column[C] + straight;
        column
    }
}

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
