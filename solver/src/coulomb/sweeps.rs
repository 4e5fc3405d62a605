//! Projected Gauss–Seidel: each contact in turn solves its own problem, the others' impulses given.
//!
//! A contact that sees b = q + Σ W x of the others solves B x + b = u under Coulomb's law. It is open where b_N ≥ 0. Else
//! u_N = 0 gives x_N = −(b_N + B_NT x_T) / B_NN, and u_T = −λ x_T gives (S + λ I) x_T = −c with the Schur complement S of
//! B_NN and c = b_T − B_TN b_N / B_NN. It sticks where λ = 0 holds |x_T| ≤ μ x_N; else h(λ) = |x_T| − μ x_N changes its sign
//! between there and λ → ∞, and its root is found by regula falsi in λ / (1 + λ).

use super::scaled::{Scaled, Three, clip, dot, put, three, violation};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};

/// Most guesses of the root.
const GUESSES: usize = 64;

/// One sweep from `x` on. The largest residual that a contact had at its turn, over the problem's velocity.
pub(super) fn sweep(problem: &Scaled, x: &mut [f64]) -> f64 {
    dispatch(Level::best(), Sweep(problem, x))
}

struct Sweep<'a>(&'a Scaled, &'a mut [f64]);

impl Kernel for Sweep<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<I: Isa>(self) -> f64 {
        let Self(problem, x) = self;
        let (n, mut worst) = (problem.n, 0.0_f64);
        for i in 0..n {
            let block = problem.block(i, i);
            let own = three(x, i);
            let mut seen = three(&problem.rates, i);
            let rows = &problem.operator[9 * n * i..9 * n * (i + 1)];
            let products = products::<I>(rows, x);
            let mut u = [0.0; 3];
            for k in 0..3 {
                u[k] = seen[k] + products[k];
                seen[k] = u[k] - dot(block[k], own);
            }
            worst = worst.max(violation(own, u, problem.friction[i]) * problem.root[i]);
            put(x, i, contact(&block, seen, problem.friction[i]));
        }
        if worst > 0.0 {
            worst / problem.largest_velocity(x)
        } else {
            0.0
        }
    }
}

/// Three rows, one after the other, times x.
#[inline(always)]
fn products<I: Isa>(rows: &[f64], x: &[f64]) -> Three {
    let (x4, tail) = x.as_chunks::<4>();
    let mut sums = [[I::X4::splat(0.0); 2]; 3];
    let row = |k: usize| rows[k * x.len()..(k + 1) * x.len()].as_chunks::<4>();
    let rows = [row(0), row(1), row(2)];
    for (j, x) in x4.iter().enumerate() {
        let x = I::X4::load(x);
        for (sums, (row, _)) in sums.iter_mut().zip(rows) {
            sums[j % 2] = I::X4::load(&row[j]).mul_add(x, sums[j % 2]);
        }
    }
    let mut out = [0.0; 3];
    for (out, ([a, b], (_, rest))) in out.iter_mut().zip(sums.into_iter().zip(rows)) {
        let mut lanes = [0.0; 4];
        (a + b).store(&mut lanes);
        let tail: f64 = rest.iter().zip(tail).map(|(w, x)| w * x).sum();
        *out = (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + tail;
    }
    out
}

/// The impulse of one contact that sees b: zero where its block vanishes, and nothing would change.
fn contact(block: &[Three; 3], b: Three, mu: f64) -> Three {
    let normal = block[0][0];
    if b[0] >= 0.0 || normal <= 0.0 {
        return [0.0; 3];
    }
    if mu == 0.0 {
        return [-b[0] / normal, 0.0, 0.0];
    }
    let coupling = [block[1][0], block[2][0]];
    let schur = |r: usize, c: usize| block[r + 1][c + 1] - coupling[r] * coupling[c] / normal;
    let (s11, s12, s22) = (schur(0, 0), schur(0, 1), schur(1, 1));
    let c = [
        b[1] - coupling[0] * b[0] / normal,
        b[2] - coupling[1] * b[0] / normal,
    ];
    let at = |lambda: f64| -> Three {
        let (a, d) = (s11 + lambda, s22 + lambda);
        let det = a * d - s12 * s12;
        let t = [(s12 * c[1] - d * c[0]) / det, (s12 * c[0] - a * c[1]) / det];
        [
            -(b[0] + coupling[0] * t[0] + coupling[1] * t[1]) / normal,
            t[0],
            t[1],
        ]
    };
    // How far an impulse lies outside its cone.
    let outside = |x: Three| (x[1] * x[1] + x[2] * x[2]).sqrt() - mu * x[0];
    let stick = at(0.0);
    let mut low = (0.0, outside(stick));
    if low.1 <= 0.0 {
        return stick;
    }
    // λ = m/(1 − m). The weight of an end that stays twice is halved (Illinois); every third guess is the middle.
    let none = [-b[0] / normal, 0.0, 0.0];
    let (mut high, mut best) = ((1.0, outside(none)), none);
    let (mut least, mut last) = (high.1.abs(), None);
    for round in 1..=GUESSES {
        let middle = if round % 3 == 0 {
            0.5 * (low.0 + high.0)
        } else {
            (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1)
        };
        if !(low.0 < middle && middle < high.0) {
            break;
        }
        let x = at(middle / (1.0 - middle));
        let off = outside(x);
        if off.abs() < least {
            (best, least) = (x, off.abs());
        }
        if off.abs() <= f64::EPSILON * mu * x[0] {
            break;
        }
        let is_low = off > 0.0;
        let (end, other) = if is_low {
            (&mut low, &mut high)
        } else {
            (&mut high, &mut low)
        };
        *end = (middle, off);
        if last == Some(is_low) {
            other.1 *= 0.5;
        }
        last = Some(is_low);
    }
    (best[1], best[2]) = clip(best, mu * best[0].max(0.0));
    best
}
