//! A chain of N particles, N − 1 of mass 1 and the last of mass R, hanging from the world by rigid links: what is known
//! of its S.
//!
//! S is tridiagonal: 1 at the world, 2 inside, 1 + 1/R at the load, −1 beside; (S⁻¹)ᵢⱼ is the mass below the lower of
//! the links i and j. So ‖S‖∞ = 4, ‖S⁻¹‖∞ = N R + N (N − 1)/2, and
//!
//! ```text
//! κ = 4 N R + 2 N (N − 1)
//! ```
//!
//! **Gauss–Seidel.** S is consistently ordered, so that a sweep takes off the square of what a Jacobi iteration does
//! (Young 1954). With D the diagonal of S, S v = μ D v has in its interior the solutions vₖ = cos kθ, μ = 1 − cos θ,
//! which meet the world's row. The load's row, (1 + 1/R) cos θ cos (N−1)θ = cos (N−2)θ, asks for
//!
//! ```text
//! tan θ tan (N−1)θ = 1/R,   ρ = cos² θ
//! ```
//!
//! The smallest θ is π/2N at R = 1 and 1/√((N−1) R) for heavy loads: ln 10⁶ (N−1) R sweeps to 10⁻⁶.
//!
//! **Groups.** The last link is a group of its own, coupled to the others by one −1. So (G₁ the first p + 1 links, δ their
//! last pivot, d the pivot of the load's link) each sweep takes the error at the coupling down by
//!
//! ```text
//! ρ = 1/(δ d),   without compliance δ = 1, d = 1 + 1/R: ρ = R/(R + 1)
//! ```
//!
//! and after the k-th sweep from zero the largest error is that of link p, ρ^(k−1) λ_load/δ: exact, whatever the load. With the
//! groups' blocks as preconditioner the matrix is the identity and a coupling of rank 2: three eigenvalues, 1 and 1 ± √ρ, and
//! so three iterations of conjugate gradient.
//!
//! **Compliance.** Σ = σ, ε/Δt² for all links, adds σ to the diagonal: λ_min ≥ σ, and κ lies near 1/(1/κ₀ + σ/4). The
//! slowest vector of a Jacobi iteration, (L + U) v = m D v, is positive: m is the largest root of the recurrence
//! d₀ m v₀ = v₁, dₖ m vₖ = vₖ₋₁ + vₖ₊₁, dₙ m vₙ = vₙ₋₁. A sweep of Gauss–Seidel takes the vector m^k vₖ down by m²; an error
//! e has the share zᵀ(D − L)e / zᵀ(D − L)x of it, with zₖ = m^(−k) vₖ.

use crate::hard::numerics::extended_solution;
use taut_ground::choice::Choice;
use taut_integrator::{Form, StepOptions, Stepper};
use taut_model::{ChainModel, ParticleChainParams};
use taut_output::check::ExperimentError;
use taut_solver::{
    Backend, CgOptions, DenseOptions, GaussSeidelOptions, Partition, Preconditioner, SolveError,
    SymBlockMatrix, forward_error, norm_inf,
};

/// Error that the iterations have to reach.
const GOAL: f64 = 1e-6;

/// Most iterations of conjugate gradient that are tried.
const MOST_CG: usize = 400;

const DT: f64 = 1.0 / 60.0;
const GRAVITY: f64 = 9.81;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Chain {
    /// Particles N, the load among them.
    pub(super) particles: usize,
    /// R: mass of the load over that of a particle.
    pub(super) ratio: f64,
    /// σ = ε/Δt² over the mass of a particle's inverse.
    pub(super) cap: f64,
}

impl Chain {
    /// A chain.
    pub(super) fn new(particles: usize, ratio: f64, cap: f64) -> Self {
        Self {
            particles,
            ratio,
            cap,
        }
    }

    /// κ in the ∞-norm.
    pub(super) fn condition(&self) -> f64 {
        let n = self.particles as f64;
        let rigid = 4.0 * n * self.ratio + 2.0 * n * (n - 1.0);
        1.0 / (1.0 / rigid + 0.25 * self.cap)
    }

    /// −ln ρ: what a sweep of Gauss–Seidel takes off the logarithm of the error of a chain without compliance.
    pub(super) fn rate(&self) -> f64 {
        let n = self.particles as f64;
        // tan θ tan (N−1)θ grows from 0 without bound up to the pole.
        let (mut low, mut high) = (0.0, std::f64::consts::FRAC_PI_2 / (n - 1.0));
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if middle.tan() * ((n - 1.0) * middle).tan() < self.ratio.recip() {
                low = middle;
            } else {
                high = middle;
            }
        }
        // 1 − cos²θ without its cancellation.
        -(-low.sin().powi(2)).ln_1p()
    }

    /// Sweeps of Gauss–Seidel to 10⁻⁶ of a chain without compliance, were all of the error its slowest mode.
    pub(super) fn sweeps(&self) -> f64 {
        -GOAL.ln() / self.rate()
    }

    /// Sweeps of Gauss–Seidel from zero to 10⁻⁶ of the solution `exact`, from the slowest mode's rate and share of it.
    pub(super) fn sweeps_to(&self, exact: &[f64]) -> f64 {
        let n = self.particles;
        let diagonal = |k: usize| self.diagonal(k);
        // Beyond the largest root everything stays positive, what the load's row leaves too.
        let vector = |m: f64| {
            let mut v = vec![1.0, diagonal(0) * m];
            for k in 1..n {
                v.push(diagonal(k) * m * v[k] - v[k - 1]);
            }
            v
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if vector(middle).iter().all(|x| *x > 0.0) {
                high = middle;
            } else {
                low = middle;
            }
        }
        let v = vector(high);
        let x: Vec<f64> = (0..n).map(|k| high.powi(k as i32) * v[k]).collect();
        // zᵀ(D − L)e; L is 1 below the diagonal.
        let share = |e: &[f64]| -> f64 {
            let row = |k: usize| diagonal(k) * e[k] - if k > 0 { e[k - 1] } else { 0.0 };
            (0..n).map(|k| v[k] / high.powi(k as i32) * row(k)).sum()
        };
        let part = (share(exact) / share(&x)).abs() * norm_inf(&x) / norm_inf(exact);
        (part / GOAL).ln() / (-2.0 * high.ln())
    }

    /// S's entry on the diagonal of link `k`.
    fn diagonal(&self, k: usize) -> f64 {
        let rigid = match k {
            0 => 1.0,
            _ if k + 1 == self.particles => 1.0 + self.ratio.recip(),
            _ => 2.0,
        };
        rigid + self.cap
    }

    /// Sweeps of Gauss–Seidel over groups from zero to 10⁻⁶ of the solution `exact`, the last link a group of its own.
    pub(super) fn sweeps_over_groups(&self, exact: &[f64]) -> f64 {
        let last = self.particles - 1;
        let pivot = (1..last).fold(self.diagonal(0), |pivot, k| {
            self.diagonal(k) - pivot.recip()
        });
        let rate = (pivot * self.diagonal(last)).ln();
        let first = exact[last].abs() / pivot / norm_inf(exact);
        (1.0 + (first / GOAL).ln() / rate).ceil()
    }

    /// Impulses μ = Δt g Σ m of the links, the world's first, of a chain without compliance.
    pub(super) fn multipliers(&self) -> Vec<f64> {
        let n = self.particles;
        let below = |i: usize| self.ratio + (n - 1 - i) as f64;
        (0..n).map(|i| DT * GRAVITY * below(i)).collect()
    }

    /// S and the right-hand side of a step from rest, and its impulses in 32 digits from the pieces of S.
    pub(super) fn system(&self) -> Result<(SymBlockMatrix, Vec<f64>, Vec<f64>), ExperimentError> {
        let params = ParticleChainParams {
            model: ChainModel::Links,
            particles: self.particles,
            mass: 1.0,
            load_mass: self.ratio,
            compliance: self.cap * DT * DT,
            gravity: GRAVITY,
            transverse: false,
            horizontal: false,
            seed: 0,
            damping: 0.0,
            ..ParticleChainParams::default()
        };
        let options = StepOptions {
            dt: DT,
            backend: Backend::Dense(DenseOptions::default()),
            ..StepOptions::paper()
        };
        let mut stepper = Stepper::new(params.build()?, options)?;
        let exact = stepper.reference_multipliers()?;
        let (a, b) = stepper.assembled(Form::Schur)?;
        Ok((a, b, exact))
    }
}

/// Predictions and measurements for a chain.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    /// R.
    pub(super) ratio: f64,
    /// ε/Δt².
    pub(super) cap: f64,
    /// κ by the formula.
    pub(super) predicted_condition: f64,
    /// κ of S as it was formed, in 32 digits.
    pub(super) condition: f64,
    /// Sweeps of Gauss–Seidel to 10⁻⁶ by the formula.
    pub(super) predicted_sweeps: f64,
    /// Sweeps as counted, or extrapolated from the measured rate.
    pub(super) sweeps: f64,
    /// `sweeps` is extrapolated.
    pub(super) extrapolated: bool,
    /// Iterations of conjugate gradient to 10⁻⁶; none where it is not reached.
    pub(super) cg: Option<usize>,
    /// Iterations with the diagonal as preconditioner.
    pub(super) cg_jacobi: Option<usize>,
    /// Iterations with the groups' blocks as preconditioner.
    pub(super) cg_group: Option<usize>,
    /// Sweeps of Gauss–Seidel over groups to 10⁻⁶ by the formula.
    pub(super) predicted_group_sweeps: f64,
    /// Sweeps over groups as counted, or extrapolated.
    pub(super) group_sweeps: f64,
    /// `group_sweeps` is extrapolated.
    pub(super) groups_extrapolated: bool,
    /// The multipliers in 32 digits against the formula, relative; 0 with compliance, which has none.
    pub(super) multipliers_error: f64,
}

/// Measures a chain with at most that many sweeps.
pub(super) fn measure(chain: &Chain, most_sweeps: usize) -> Result<Row, ExperimentError> {
    let (a, b, multipliers) = chain.system()?;
    // S⁻¹ has no negative entries, so that its largest row sum is that of S⁻¹ 1.
    let sums = extended_solution(&a, &vec![1.0; a.dim()])?;
    let exact = extended_solution(&a, &b)?;
    let over = |partition| sweeps((&a, &b), &exact, partition, most_sweeps);
    let (sweeps, extrapolated) = over(Partition::Joints)?;
    let (group_sweeps, groups_extrapolated) = over(Partition::Groups)?;
    let cg = |p| iterations((&a, &b), &exact, p);
    let multipliers_error = if chain.cap == 0.0 {
        // A rope pulls: the multiplier of a link under tension is negative.
        let size: Vec<f64> = multipliers.iter().map(|x| x.abs()).collect();
        forward_error(&size, &chain.multipliers())
    } else {
        0.0
    };
    Ok(Row {
        ratio: chain.ratio,
        cap: chain.cap,
        predicted_condition: chain.condition(),
        condition: a.norm_inf() * norm_inf(&sums),
        predicted_sweeps: if chain.cap > 0.0 {
            chain.sweeps_to(&exact)
        } else {
            chain.sweeps()
        },
        sweeps,
        extrapolated,
        cg: cg(Preconditioner::None)?,
        cg_jacobi: cg(Preconditioner::BlockJacobi)?,
        cg_group: cg(Preconditioner::Group)?,
        predicted_group_sweeps: chain.sweeps_over_groups(&exact),
        group_sweeps,
        groups_extrapolated,
        multipliers_error,
    })
}

/// Sweeps until the error is [`GOAL`], and whether they are extrapolated.
fn sweeps(
    (a, b): (&SymBlockMatrix, &[f64]),
    exact: &[f64],
    partition: Partition,
    most: usize,
) -> Result<(f64, bool), SolveError> {
    let backend = Backend::GaussSeidel(GaussSeidelOptions {
        partition,
        iterations: 1,
        tolerance: 0.0,
        ..GaussSeidelOptions::default()
    });
    if Choice::schur(backend.clone()).check().is_err() {
        return Ok((f64::NAN, false));
    }
    let mut solver = backend.create()?;
    solver.analyze(a.pattern())?;
    solver.factorize(a)?;
    let mut x = vec![0.0; b.len()];
    let (mut half, mut last) = (1.0, 1.0);
    for sweep in 1..=most {
        solver.solve(a, b, &mut x)?;
        last = forward_error(&x, exact);
        if last <= GOAL {
            return Ok((sweep as f64, false));
        }
        if sweep == most / 2 {
            half = last;
        }
    }
    let rate = (half / last).ln() / (most - most / 2) as f64;
    Ok((most as f64 + (last / GOAL).ln() / rate, true))
}

/// Iterations of conjugate gradient until the error is [`GOAL`]; none where they do not reach it, or the backend is not
/// compiled in.
fn iterations(
    (a, b): (&SymBlockMatrix, &[f64]),
    exact: &[f64],
    preconditioner: Preconditioner,
) -> Result<Option<usize>, SolveError> {
    let mut x = vec![0.0; b.len()];
    for iterations in 1..=MOST_CG {
        let backend = Backend::ConjugateGradient(CgOptions {
            preconditioner,
            iterations,
            tolerance: 0.0,
        });
        if Choice::schur(backend.clone()).check().is_err() {
            return Ok(None);
        }
        let mut solver = backend.create()?;
        solver.analyze(a.pattern())?;
        solver.factorize(a)?;
        x.fill(0.0);
        let report = solver.solve(a, b, &mut x)?;
        if forward_error(&x, exact) <= GOAL {
            return Ok(Some(iterations));
        }
        if report.iterations < iterations {
            break;
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The figures of the formula for N = 24.
    #[test]
    fn sweeps_and_conditions_of_24_elements() {
        for (ratio, sweeps) in [(1.0, 3.2e3), (1e3, 3.2e5), (1e5, 3.2e7)] {
            let found = Chain::new(24, ratio, 0.0).sweeps();
            assert!((found / sweeps - 1.0).abs() < 0.02, "{ratio}: {found}");
        }
        for (cap, condition) in [(1e-6, 2.8e6), (1e-4, 4.0e4), (1e-2, 4.0e2)] {
            let found = Chain::new(24, 1e5, cap).condition();
            assert!((found / condition - 1.0).abs() < 0.02, "{cap}: {found}");
        }
        // Without compliance the recurrence has the formula's rate: the share does not depend on the goal.
        let chain = Chain::new(24, 1e3, 0.0);
        let ones: Vec<f64> = vec![1.0; 24];
        let slowest = chain.sweeps_to(&ones);
        assert!((slowest / chain.sweeps() - 1.0).abs() < 0.01, "{slowest}");
        // The load's link beside the others: a half is left at R = 1 of 1/24 at first.
        let exact = Chain::new(24, 1.0, 0.0).multipliers();
        assert_eq!(Chain::new(24, 1.0, 0.0).sweeps_over_groups(&exact), 17.0);
        // π/2N at R = 1.
        let rate = Chain::new(24, 1.0, 0.0).rate();
        let exact = -2.0 * (std::f64::consts::PI / 48.0).cos().ln();
        assert!((rate / exact - 1.0).abs() < 1e-12, "{rate} {exact}");
    }
}
