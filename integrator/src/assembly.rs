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
use crate::lanes::of_rows;
use taut_lanes::vector::{
    Sym3, Vec3, columns, cross, dot, gather, load, save, scale, scale_add, times,
};
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

    /// The rows of Q A; those of \[r]× are (0, −z, y), (z, 0, −x), (−y, x, 0).
    #[inline(always)]
    fn times(&self, a: &Sym3<V>) -> [Vec3<V>; 6] {
        let [x, y, z] = self.arm;
        let [ax, ay, az] = columns(a);
        let [p, q, s] = &self.gradients;
        [
            scale_add(&az, y, &scale(&ay, -z)),
            scale_add(&ax, z, &scale(&az, -x)),
            scale_add(&ay, x, &scale(&ax, -y)),
            times(a, p),
            times(a, q),
            times(a, s),
        ]
    }

    /// Q x.
    #[inline(always)]
    fn apply(&self, v: &Vec3<V>) -> [V; 6] {
        let [x, y, z] = cross(&self.arm, v);
        let [p, q, s] = &self.gradients;
        [x, y, z, dot(p, v), dot(q, v), dot(s, v)]
    }
}

/// Writes column `C` of four blocks with 6 rows and columns.
#[inline(always)]
fn put<V: Lanes, const C: usize>(column: &[V; 6], values: &mut [f64], targets: [usize; ABREAST]) {
    V::scatter(column, values, targets.map(|t| t + 6 * C));
}

/// Writes four blocks of other sizes, rows × columns.
#[inline(always)]
fn put_smaller<V: Lanes>(
    columns: &[[V; 6]; 6],
    values: &mut [f64],
    targets: [usize; ABREAST],
    sizes: [(usize, usize); ABREAST],
) {
    for (c, column) in columns.iter().enumerate() {
        let column: [Four; 6] = save(column);
        for (lane, (target, (m, n))) in targets.into_iter().zip(sizes).enumerate() {
            if c < n {
                let to = &mut values[target + m * c..target + m * (c + 1)];
                for (to, from) in to.iter_mut().zip(&column) {
                    *to = from[lane];
                }
            }
        }
    }
}

/// Writes four blocks by their columns.
#[inline(always)]
fn put_all<V: Lanes>(
    columns: &[[V; 6]; 6],
    values: &mut [f64],
    targets: [usize; ABREAST],
    sizes: [(usize, usize); ABREAST],
) {
    if sizes == [(6, 6); ABREAST] {
        put::<V, 0>(&columns[0], values, targets);
        put::<V, 1>(&columns[1], values, targets);
        put::<V, 2>(&columns[2], values, targets);
        put::<V, 3>(&columns[3], values, targets);
        put::<V, 4>(&columns[4], values, targets);
        put::<V, 5>(&columns[5], values, targets);
    } else {
        put_smaller(columns, values, targets, sizes);
    }
}

/// 1/m and A of four bodies; zeros for the world.
#[inline(always)]
fn inverse_inertia<V: Lanes>(inertia: &Inertia, bodies: [usize; ABREAST]) -> (V, Sym3<V>) {
    let mass = V::from_fn(|l| inertia.inverse_mass.get(bodies[l]).copied().unwrap_or(0.0));
    let nothing = [0.0; 6];
    let angular = gather(bodies.map(|i| inertia.inverse_angular.get(i).unwrap_or(&nothing)));
    (mass, angular)
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
        let packs = self.rows.abreast.packs();
        let (targets, _) = self.plan.diagonal.as_chunks::<ABREAST>();
        for ((pack, places), targets) in packs.zip(targets) {
            let (w_a, a) = inverse_inertia::<I::X4>(self.inertia, places.bodies[0]);
            let (w_b, b) = inverse_inertia::<I::X4>(self.inertia, places.bodies[1]);
            let (side_a, side_b) = (Side::of_pack(pack, 0), Side::of_pack(pack, 1));
            let (turned_a, turned_b) = (side_a.times(&a), side_b.times(&b));
            let sigma = of_rows::<I::X4>(self.sigma, places);
            let mut block = [
                both(&side_a, &turned_a[0], &side_b, &turned_b[0]),
                both(&side_a, &turned_a[1], &side_b, &turned_b[1]),
                both(&side_a, &turned_a[2], &side_b, &turned_b[2]),
                both(&side_a, &turned_a[3], &side_b, &turned_b[3]),
                both(&side_a, &turned_a[4], &side_b, &turned_b[4]),
                both(&side_a, &turned_a[5], &side_b, &turned_b[5]),
            ];
            let w = w_a + w_b;
            block[0][0] = block[0][0] + (w + sigma[0]);
            block[1][1] = block[1][1] + (w + sigma[1]);
            block[2][2] = block[2][2] + (w + sigma[2]);
            block[3][3] = block[3][3] + sigma[3];
            block[4][4] = block[4][4] + sigma[4];
            block[5][5] = block[5][5] + sigma[5];
            put_all(&block, self.values, *targets, places.rows.map(|n| (n, n)));
        }
    }
}

/// Q_a x + Q_b y.
#[inline(always)]
fn both<V: Lanes>(a: &Side<V>, x: &Vec3<V>, b: &Side<V>, y: &Vec3<V>) -> [V; 6] {
    let (mut sum, on_b) = (a.apply(x), b.apply(y));
    for (sum, on_b) in sum.iter_mut().zip(on_b) {
        *sum = *sum + on_b;
    }
    sum
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
        let (packs, joints) = (self.joints.jacobians(), self.joints.joints());
        let (couplings, _) = self.plan.couplings.as_chunks::<ABREAST>();
        for couplings in couplings {
            let (w, a) = inverse_inertia::<I::X4>(self.inertia, couplings.map(|c| c.body));
            let left = Side::<I::X4>::of_joints(packs, couplings.map(|c| c.sides[0]));
            let right = Side::<I::X4>::of_joints(packs, couplings.map(|c| c.sides[1]));
            let same = |c: &Coupling| c.sides[0].1 == c.sides[1].1;
            let sign = I::X4::from_fn(|l| if same(&couplings[l]) { 1.0 } else { -1.0 });
            let mut signed = a;
            for a in &mut signed {
                *a = *a * sign;
            }
            let (turned, w) = (right.times(&signed), w * sign);
            let mut block = [
                left.apply(&turned[0]),
                left.apply(&turned[1]),
                left.apply(&turned[2]),
                left.apply(&turned[3]),
                left.apply(&turned[4]),
                left.apply(&turned[5]),
            ];
            block[0][0] = block[0][0] + w;
            block[1][1] = block[1][1] + w;
            block[2][2] = block[2][2] + w;
            let size = |[(k, _), (l, _)]: [(usize, usize); 2]| (joints[k].rows, joints[l].rows);
            let sizes = couplings.map(|c| size(c.sides));
            put_all(&block, self.values, couplings.map(|c| c.target), sizes);
        }
    }
}
