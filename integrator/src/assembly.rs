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
use crate::lanes::{of_rows, symmetric};
use taut_lanes::vector::{Sym3, Vec3, columns, dot, load, scale, scale_add, times};
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
    /// First value of each joint's diagonal block.
    diagonal: Vec<usize>,
    /// Blocks below the diagonal, filled up with copies of the last one.
    couplings: Vec<Coupling>,
}

impl Assembly {
    pub(crate) fn new(diagonal: Vec<usize>, mut couplings: Vec<Coupling>) -> Self {
        if let Some(&last) = couplings.last() {
            couplings.resize(couplings.len().next_multiple_of(ABREAST), last);
        }
        Self {
            diagonal,
            couplings,
        }
    }

    /// Writes all blocks of joints: of diagonal blocks the lower triangle.
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

    /// Row `r` of Q times x.
    #[inline(always)]
    fn row(&self, r: usize, v: &Vec3<V>) -> V {
        let [x, y, z] = self.arm;
        match r {
            0 => z.neg_mul_add(v[1], y * v[2]),
            1 => x.neg_mul_add(v[2], z * v[0]),
            2 => y.neg_mul_add(v[0], x * v[1]),
            _ => dot(&self.gradients[r - 3], v),
        }
    }
}

/// 1/m and A of four bodies; zeros for the world.
#[inline(always)]
fn inverse_inertia<V: Lanes>(inertia: &Inertia, bodies: [usize; ABREAST]) -> (V, Sym3<V>) {
    let mass = V::from_fn(|l| inertia.inverse_mass.get(bodies[l]).copied().unwrap_or(0.0));
    let zero = nalgebra::Matrix3::zeros();
    let angular = symmetric(bodies.map(|i| inertia.inverse_angular.get(i).unwrap_or(&zero)));
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
        let targets = self.plan.diagonal.chunks(ABREAST);
        for ((pack, joints, count), targets) in packs.zip(targets) {
            let body = |side: usize| joints.each_ref().map(|j| j.bodies[side]);
            let (w_a, a) = inverse_inertia::<I::X4>(self.inertia, body(0));
            let (w_b, b) = inverse_inertia::<I::X4>(self.inertia, body(1));
            let (side_a, side_b) = (Side::of_pack(pack, 0), Side::of_pack(pack, 1));
            let (turned_a, turned_b) = (side_a.times(&a), side_b.times(&b));
            let sigma = of_rows::<I::X4>(
                self.sigma,
                joints.each_ref().map(|j| j.row),
                joints.each_ref().map(|j| j.rows),
            );
            let mut block: [[Four; 6]; 6] = [[[0.0; ABREAST]; 6]; 6];
            for c in 0..6 {
                for r in c..6 {
                    let mut s = side_a.row(r, &turned_a[c]) + side_b.row(r, &turned_b[c]);
                    if r == c {
                        s = s + if r < 3 {
                            w_a + w_b + sigma[r]
                        } else {
                            sigma[r]
                        };
                    }
                    s.store(&mut block[c][r]);
                }
            }
            for (lane, (joint, &target)) in joints[..count].iter().zip(targets).enumerate() {
                let n = joint.rows;
                if n == 6
                    && let Some(to) = self.values[target..].first_chunk_mut::<36>()
                {
                    for c in 0..6 {
                        for r in c..6 {
                            to[6 * c + r] = block[c][r][lane];
                        }
                    }
                } else {
                    for (c, to) in self.values[target..target + n * n]
                        .chunks_exact_mut(n)
                        .enumerate()
                    {
                        for (to, from) in to.iter_mut().zip(&block[c]).skip(c) {
                            *to = from[lane];
                        }
                    }
                }
            }
        }
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
            let mut block: [[Four; 6]; 6] = [[[0.0; ABREAST]; 6]; 6];
            for c in 0..6 {
                for r in 0..6 {
                    let mut s = left.row(r, &turned[c]);
                    if r == c && r < 3 {
                        s = s + w;
                    }
                    s.store(&mut block[c][r]);
                }
            }
            for (lane, coupling) in couplings.iter().enumerate() {
                let [m, n] = coupling.sides.map(|(k, _)| joints[k].rows);
                let target = coupling.target;
                if (m, n) == (6, 6)
                    && let Some(to) = self.values[target..].first_chunk_mut::<36>()
                {
                    for c in 0..6 {
                        for r in 0..6 {
                            to[6 * c + r] = block[c][r][lane];
                        }
                    }
                } else {
                    for (to, from) in self.values[target..target + m * n]
                        .chunks_exact_mut(m)
                        .zip(&block)
                    {
                        for (to, from) in to.iter_mut().zip(from) {
                            *to = from[lane];
                        }
                    }
                }
            }
        }
    }
}
