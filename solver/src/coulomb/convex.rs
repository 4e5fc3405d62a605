//! Coulomb's law with given slips is a convex problem; Newton's method with an exact line search.
//!
//! With s = |u_T| of each contact given, the law is K* ∋ u + μ s e_N ⟂ x ∈ K, K the friction cone (De Saxcé & Feng 1998).
//! With W = W₀ + Σ its solution is the minimum of (Castro et al. 2022)
//!   f(z) = ½ zᵀ W₀ z + Σᵢ ½ σᵢ |x(z)ᵢ|², x(z)ᵢ = P_K(−(W₀ z + q + μ s e_N)ᵢ / σᵢ), ∇f = W₀ (z − x(z)).
//! Newton's step solves (I + D W₀) dz = x(z) − z with D = −∂x/∂u. That is a [`Step`] for z + dz: rays of the cone are both
//! column and row, and across a ray γ = σ (1/α − 1) with the slope α = μ x_N / |y_T| of the projection of y there.
//! f falls along every step, so that converges from anywhere.

use super::newton::direction;
use super::scaled::{Scaled, Three, dot, three};
use super::step::Step;

/// Most Newton steps.
const MOST: usize = 25;

/// Relative change of z that ends Newton.
const STILL: f64 = 1e-9;

/// Part of the first slope of f that the line search leaves, and its most evaluations.
const FLAT: f64 = 1e-6;
const SEARCHES: usize = 60;

/// Least scaled σ: what divides.
const LEAST_SIGMA: f64 = 1e-15;

/// The iterate and its workspace: of length 3n but the slips and σ, which are of length n.
#[derive(Debug, Default)]
pub(super) struct Convex {
    pub(super) z: Vec<f64>,
    pub(super) slips: Vec<f64>,
    sigma: Vec<f64>,
    /// W₀ z + q + μ s e_N.
    rate: Vec<f64>,
    /// The step, and W₀ times it.
    dz: Vec<f64>,
    change: Vec<f64>,
}

impl Convex {
    /// Begins with neither impulses nor slips.
    pub(super) fn begin(&mut self, problem: &Scaled) {
        for v in [&mut self.z, &mut self.rate, &mut self.dz, &mut self.change] {
            v.clear();
            v.resize(3 * problem.n, 0.0);
        }
        for v in [&mut self.slips, &mut self.sigma] {
            v.clear();
            v.resize(problem.n, 0.0);
        }
    }

    /// Moves the slips by `part` towards those at z, with `extra` regularisation.
    pub(super) fn update_slips(&mut self, problem: &Scaled, extra: f64, part: f64) {
        problem.velocities(&self.z, &mut self.rate);
        for (i, slip) in self.slips.iter_mut().enumerate() {
            let u = |k: usize| self.rate[3 * i + k] + extra * self.z[3 * i + k];
            *slip += part * (u(1).hypot(u(2)) - *slip);
        }
    }

    /// Minimises f for the slips, with `extra` regularisation, from z on. Returns the factorisations made.
    pub(super) fn minimise(&mut self, problem: &Scaled, step: &mut Step, extra: f64) -> usize {
        let own = self.sigma.iter_mut().zip(&problem.regularization);
        own.for_each(|(to, s)| *to = (s + extra).max(LEAST_SIGMA));
        let largest = |v: &[f64]| v.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for pivots in 1..=MOST {
            self.find_rate(problem);
            self.linearise(problem, step);
            let rate = |i: usize| {
                let [normal, a, b] = three(&problem.rates, i);
                [normal + problem.friction[i] * self.slips[i], a, b]
            };
            if !step.solve(problem, rate, &mut self.dz) {
                return pivots;
            }
            self.dz.iter_mut().zip(&self.z).for_each(|(d, z)| *d -= z);
            let part = self.line_search(problem);
            for (z, d) in self.z.iter_mut().zip(&self.dz) {
                *z += part * d;
            }
            if largest(&self.dz) <= STILL * largest(&self.z) {
                return pivots;
            }
        }
        MOST
    }

    fn find_rate(&mut self, problem: &Scaled) {
        problem.velocities(&self.z, &mut self.rate);
        subtract_regularization(problem, &self.z, &mut self.rate);
        for (i, slip) in self.slips.iter().enumerate() {
            self.rate[3 * i] += problem.friction[i] * slip;
        }
    }

    /// The unknowns of the step at z.
    fn linearise(&self, problem: &Scaled, step: &mut Step) {
        step.clear();
        for i in 0..problem.n {
            let (mu, sigma) = (problem.friction[i], self.sigma[i]);
            let y = three(&self.rate, i).map(|u| -u / sigma);
            // The operator holds the problem's own regularisation already.
            let extra = sigma - problem.regularization[i];
            match Side::of(y, mu) {
                Side::Polar => {}
                Side::Inside => step.stick(i, extra),
                Side::Ray { normal, t } => {
                    let unit = 1.0 / (1.0 + mu * mu).sqrt();
                    let ray = [unit, unit * mu * t.0, unit * mu * t.1];
                    let slope = mu * normal / y[1].hypot(y[2]);
                    step.slide(i, (ray, extra), ray, t, sigma * (1.0 / slope - 1.0) + extra);
                }
            }
        }
    }

    /// The part of the step that minimises f along it: the root of f', which grows.
    fn line_search(&mut self, problem: &Scaled) -> f64 {
        self.change.fill(0.0);
        problem.add_product(&self.dz, &mut self.change);
        subtract_regularization(problem, &self.dz, &mut self.change);
        let start = self.slope(problem, 0.0);
        let (mut low, mut high) = ((0.0, start), (1.0, self.slope(problem, 1.0)));
        // At the minimum rounding decides their signs.
        if start.is_nan() || start >= 0.0 || high.1.is_nan() || high.1 <= -FLAT * start {
            return 1.0;
        }
        for search in 0..SEARCHES {
            let part = if search % 2 == 0 {
                low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1)
            } else {
                0.5 * (low.0 + high.0)
            };
            let value = self.slope(problem, part);
            if value.abs() <= -FLAT * start {
                return part;
            }
            if value < 0.0 {
                low = (part, value);
            } else {
                high = (part, value);
            }
        }
        high.0
    }

    /// f' along the step.
    fn slope(&self, problem: &Scaled, part: f64) -> f64 {
        let of_contact = |i: usize| {
            let (z, dz) = (three(&self.z, i), three(&self.dz, i));
            let (rate, change) = (three(&self.rate, i), three(&self.change, i));
            let mu = problem.friction[i];
            let y = [0, 1, 2].map(|k| -(rate[k] + part * change[k]) / self.sigma[i]);
            let x = Side::of(y, mu).point(y, mu);
            dot(change, [0, 1, 2].map(|k| z[k] + part * dz[k] - x[k]))
        };
        (0..problem.n).map(of_contact).sum()
    }
}

/// y −= Σ x: what makes W₀ x of W x.
fn subtract_regularization(problem: &Scaled, x: &[f64], y: &mut [f64]) {
    for (k, (y, x)) in y.iter_mut().zip(x).enumerate() {
        *y -= problem.regularization[k / 3] * x;
    }
}

/// Where a point is projected to in the cone |x_T| ≤ μ x_N.
enum Side {
    /// To its apex.
    Polar,
    /// To itself.
    Inside,
    /// To the ray along (1, μ t), where the normal part is `normal`.
    Ray { normal: f64, t: (f64, f64) },
}

impl Side {
    fn of(y: Three, mu: f64) -> Self {
        let length = y[1].hypot(y[2]);
        if length <= mu * y[0] && mu > 0.0 {
            return Self::Inside;
        }
        if mu * length <= -y[0] {
            return Self::Polar;
        }
        Self::Ray {
            normal: (y[0] + mu * length) / (1.0 + mu * mu),
            t: direction(y, length),
        }
    }

    /// The projection of `y`.
    fn point(&self, y: Three, mu: f64) -> Three {
        match *self {
            Self::Polar => [0.0; 3],
            Self::Inside => y,
            Self::Ray { normal, t } => [normal, mu * normal * t.0, mu * normal * t.1],
        }
    }
}
