//! Projected Gauss–Seidel: each contact in turn solves its own problem, the others' impulses given.
//!
//! A contact that sees b = q + Σ W x of the others solves B x + b = u under Coulomb's law. It is open where b_N ≥ 0. Else
//! u_N = 0 gives x_N = −(b_N + B_NT x_T) / B_NN, and u_T = −λ x_T gives (S + λ I) x_T = −c with the Schur complement S of
//! B_NN and c = b_T − B_TN b_N / B_NN. It sticks where λ = 0 holds |x_T| ≤ μ x_N; else h(λ) = |x_T| − μ x_N changes its sign
//! between there and λ → ∞, and its root is found by bisection of λ / (1 + λ).

use super::scaled::{Scaled, Three, dot, put, three};

/// Halvings of the interval of λ / (1 + λ).
const HALVINGS: usize = 64;

/// One sweep from `x` on.
pub(super) fn sweep(problem: &Scaled, x: &mut [f64]) {
    let n = problem.n;
    for i in 0..n {
        let block = problem.block(i, i);
        let own = three(x, i);
        let mut seen = three(&problem.rates, i);
        for (component, seen) in seen.iter_mut().enumerate() {
            let first = (3 * i + component) * 3 * n;
            let row = &problem.operator[first..first + 3 * n];
            *seen += row.iter().zip(&*x).map(|(w, x)| w * x).sum::<f64>();
            *seen -= dot(block[component], own);
        }
        put(x, i, contact(&block, seen, problem.friction[i]));
    }
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
    let inside = |x: Three| x[1].hypot(x[2]) <= mu * x[0];
    let stick = at(0.0);
    if inside(stick) {
        return stick;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if inside(at(middle / (1.0 - middle))) {
            high = middle;
        } else {
            low = middle;
        }
    }
    if high == 1.0 {
        return [-b[0] / normal, 0.0, 0.0];
    }
    at(high / (1.0 - high))
}
