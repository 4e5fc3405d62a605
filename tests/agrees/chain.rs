//! A chain of N particles, N − 1 of mass 1 and the last of mass R, hanging from the world by links: what is known of S.
//!
//! S is tridiagonal: σ + 1 at the world, σ + 2 inside, σ + 1 + 1/R at the load, −1 beside, σ = ε/Δt² the compliance. Without
//! it (S⁻¹)ᵢⱼ is the mass below the lower of the links i and j, and
//!
//! ```text
//! κ∞ = 4 N R + 2 N (N − 1),   with compliance near 1/(1/κ∞ + σ/4)
//! ```
//!
//! **Gauss–Seidel.** S is consistently ordered, so that a sweep takes off the square of what a Jacobi iteration does (Young
//! 1954), whose slowest vector, (L + U) v = m D v, is positive: m is the largest root of d₀ m v₀ = v₁,
//! dₖ m vₖ = vₖ₋₁ + vₖ₊₁, dₙ m vₙ = vₙ₋₁. A sweep takes the vector m^k vₖ down by m²; an error e has the share
//! zᵀ(D − L)e / zᵀ(D − L)x of it, zₖ = m^(−k) vₖ. Without compliance m = cos θ, tan θ tan (N − 1)θ = 1/R.
//!
//! **Groups.** The last link is a group of its own. With δ the last pivot of the others and d the load's entry each sweep takes
//! the error at the coupling down by 1/(δ d), from λ_load/δ after the first. With the groups' blocks as preconditioner the
//! matrix is the identity and a coupling of rank 2: three eigenvalues, and so three iterations of conjugate gradient.

use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;

/// Particles, and the error that iterations have to reach.
const N: usize = 24;
const GOAL: f64 = 1e-6;

/// Most sweeps that are made; the others are extrapolated from the rate of the last half.
const SWEEPS: usize = 20_000;

/// Entries of the diagonal of S.
fn diagonal(ratio: f64, cap: f64) -> [f64; N] {
    std::array::from_fn(|k| match k {
        0 => 1.0 + cap,
        _ if k + 1 == N => 1.0 + ratio.recip() + cap,
        _ => 2.0 + cap,
    })
}

/// A value between `low`, where `above` is false, and `high`.
fn bisected(mut low: f64, mut high: f64, above: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *(if above(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

/// Sweeps of Gauss–Seidel from zero to the goal, from the slowest vector's rate and its share of the solution.
fn sweeps(d: &[f64; N], exact: &[f64]) -> f64 {
    let vector = |m: f64| {
        let mut v = vec![1.0, d[0] * m];
        for k in 1..N {
            v.push(d[k] * m * v[k] - v[k - 1]);
        }
        v
    };
    // Beyond the largest root everything stays positive, what the load's row leaves too.
    let m = bisected(0.0, 1.0, |m| vector(m).iter().all(|x| *x > 0.0));
    let v = vector(m);
    let x: Vec<f64> = (0..N).map(|k| m.powi(k as i32) * v[k]).collect();
    let share = |e: &[f64]| -> f64 {
        let row = |k: usize| d[k] * e[k] - if k > 0 { e[k - 1] } else { 0.0 };
        (0..N).map(|k| v[k] / m.powi(k as i32) * row(k)).sum()
    };
    let part = (share(exact) / share(&x)).abs() * norm_inf(&x) / norm_inf(exact);
    (part / GOAL).ln() / (-2.0 * m.ln())
}

/// Sweeps of a chain without compliance, were all of the error its slowest mode: the recurrence loses the rate, 1 − m,
/// to rounding at heavy loads.
fn rigid_sweeps(ratio: f64) -> f64 {
    let n = (N - 1) as f64;
    // It grows from 0 without bound up to the pole.
    let pole = std::f64::consts::FRAC_PI_2 / n;
    let theta = bisected(0.0, pole, |t| t.tan() * (n * t).tan() > ratio.recip());
    // 1 − cos²θ without its cancellation.
    GOAL.ln() / (-theta.sin().powi(2)).ln_1p()
}

/// Sweeps over groups from zero to the goal.
fn sweeps_over_groups(d: &[f64; N], exact: &[f64]) -> f64 {
    let pivot = d[1..N - 1].iter().fold(d[0], |pivot, d| d - pivot.recip());
    let first = exact[N - 1].abs() / pivot / norm_inf(exact);
    (1.0 + (first / GOAL).ln() / (pivot * d[N - 1]).ln()).ceil()
}

/// S and the right-hand side of a step from rest.
fn system(ratio: f64, cap: f64) -> (SymBlockMatrix, Vec<f64>) {
    let params = ParticleChainParams::default()
        .with(|p| (p.model, p.particles, p.mass) = (ChainModel::Links, N, 1.0))
        .with(|p| (p.load_mass, p.compliance, p.transverse) = (ratio, cap * DT * DT, false))
        .with(|p| (p.horizontal, p.seed, p.damping) = (false, 0, 0.0));
    let options = StepOptions::paper().with(|o| o.dt = DT);
    let scene = params.build().expect("sound parameters");
    let mut stepper = Stepper::new(scene, options).expect("sound");
    stepper.reference_multipliers().expect("solvable");
    stepper.assembled(Form::Schur).expect("assembled")
}

/// x of A x = b after `passes` solves from what the ones before left, each seen by `see`; none where the backend of that
/// name is not compiled in.
fn solves(
    name: &str,
    (a, b): (&SymBlockMatrix, &[f64]),
    passes: usize,
    mut see: impl FnMut(usize, &[f64]) -> bool,
) -> Option<Vec<f64>> {
    let backend: Backend = name.parse().expect("a known name");
    if !backend.is_compiled() {
        return None;
    }
    let mut solver = backend.create().expect("sound options");
    solver.analyze(a.pattern()).expect("sound");
    solver.factorize(a).expect("regular");
    let mut x = vec![0.0; b.len()];
    for pass in 1..=passes {
        solver.solve(a, b, &mut x).expect("solvable");
        if see(pass, &x) {
            break;
        }
    }
    Some(x)
}

/// Sweeps of a partition to the goal, counted or extrapolated.
fn counted(partition: &str, system: (&SymBlockMatrix, &[f64]), exact: &[f64]) -> Option<f64> {
    let name = format!("gauss-seidel:{partition}:iterations=1:tolerance=0");
    let (mut half, mut last, mut made) = (1.0, 1.0, 0);
    solves(&name, system, SWEEPS, |sweep, x| {
        (last, made) = (forward_error(x, exact), sweep);
        if sweep == SWEEPS / 2 {
            half = last;
        }
        last <= GOAL
    })?;
    let rate = (half / last).ln() / (SWEEPS / 2) as f64;
    Some(match last <= GOAL {
        true => made as f64,
        false => made as f64 + (last / GOAL).ln() / rate,
    })
}

#[test]
fn conditions_sweeps_and_iterations_of_a_chain_are_as_predicted() {
    let chains = (0..=10).map(|k| (10_f64.powi(k), 0.0));
    let capped = [1e-6, 1e-4, 1e-2].map(|cap| (1e5, cap));
    for (ratio, cap) in chains.chain(capped) {
        let (a, b) = system(ratio, cap);
        let system = (&a, &b[..]);
        let place = format!("R = {ratio:e}, σ = {cap:e}");
        let near = |what: &str, found: f64, predicted: f64, bar: f64| {
            println!("{place}, {what}: {found:e}, {predicted:e}");
            let off = (found / predicted - 1.0).abs();
            assert!(off <= bar, "{place}, {what}: {found:e}, not {predicted:e}");
        };
        let direct = |b: &[f64]| {
            let name = oracle().to_string();
            solves(&name, (&a, b), 1, |_, _| true).expect("always there")
        };
        let (exact, d, n) = (direct(&b), diagonal(ratio, cap), N as f64);
        // S⁻¹ has no negative entries: its largest row sum is that of S⁻¹ 1.
        let condition = a.norm_inf() * norm_inf(&direct(&[1.0; N]));
        let rigid = 4.0 * n * ratio + 2.0 * n * (n - 1.0);
        let bar = if cap > 0.0 { 0.1 } else { 1e-5 };
        near(
            "condition",
            condition,
            1.0 / (1.0 / rigid + 0.25 * cap),
            bar,
        );
        if let Some(found) = counted("joints", system, &exact) {
            let predicted = if cap > 0.0 {
                sweeps(&d, &exact)
            } else {
                rigid_sweeps(ratio)
            };
            near("Gauss–Seidel", found, predicted, 0.05);
        }
        if let Some(found) = counted("groups", system, &exact) {
            near("over groups", found, sweeps_over_groups(&d, &exact), 0.05);
        }
        for (name, most) in [("none", N), ("jacobi", N), ("group", 3)] {
            // As many as there are eigenvalues in exact arithmetic.
            let name = format!("cg:{name}:iterations={most}:tolerance=0");
            if let Some(x) = solves(&name, system, 1, |_, _| true).filter(|_| cap == 0.0) {
                let error = forward_error(&x, &exact);
                assert!(error <= GOAL, "{place}, {name}: {error:e}");
            }
        }
    }
    for (ratio, expected) in [(1.0, 3.2e3), (1e3, 3.2e5), (1e5, 3.2e7)] {
        let apart = (rigid_sweeps(ratio) / expected - 1.0).abs();
        assert!(apart < 0.02, "{ratio}");
    }
}
