//! The problem in the scale of its contacts, and how far impulses are from its solution.
//!
//! With ρᵢ = tr Wᵢᵢ / 3 and x = √ρ r: W' = ρ^-½ W ρ^-½ has diagonal blocks of trace 3, q' = ρ^-½ q, u' = ρ^-½ u. One ρᵢ
//! scales all three rows of a contact, so the cones stay what they are.

use super::Contacts;

/// A vector of a contact: normal, then two tangents.
pub(super) type Three = [f64; 3];

pub(super) fn three(of: &[f64], contact: usize) -> Three {
    [of[3 * contact], of[3 * contact + 1], of[3 * contact + 2]]
}

pub(super) fn put(to: &mut [f64], contact: usize, value: Three) {
    to[3 * contact..3 * contact + 3].copy_from_slice(&value);
}

pub(super) fn dot(a: Three, b: Three) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The tangential part, no longer than `radius`.
pub(super) fn clip(v: Three, radius: f64) -> (f64, f64) {
    let length = v[1].hypot(v[2]);
    if length <= radius {
        (v[1], v[2])
    } else {
        (v[1] / length * radius, v[2] / length * radius)
    }
}

/// The residual of a contact ([module](super)) from its ρ r and its u, both in m/s.
#[must_use]
pub fn violation(x: [f64; 3], u: [f64; 3], friction: f64) -> f64 {
    let p = [x[0] - u[0], x[1] - u[1], x[2] - u[2]];
    let (a, b) = clip(p, friction * p[0].max(0.0));
    x[0].min(u[0]).hypot((x[1] - a).hypot(x[2] - b))
}

/// The problem, scaled.
#[derive(Debug, Default)]
pub(super) struct Scaled {
    /// Contacts.
    pub(super) n: usize,
    /// W', row-major, 3n × 3n.
    pub(super) operator: Vec<f64>,
    /// q', length 3n.
    pub(super) rates: Vec<f64>,
    /// μ, length n.
    pub(super) friction: Vec<f64>,
    /// The scaled diagonal part σᵢ/ρᵢ, length n.
    pub(super) regularization: Vec<f64>,
    /// √ρᵢ, length n; 1 where the operator's block vanishes.
    pub(super) root: Vec<f64>,
    /// 1/√ρᵢ of each row, length 3n.
    inverse: Vec<f64>,
}

impl Scaled {
    /// Takes the problem over. `false` where a number is not finite, or friction or regularisation is negative.
    pub(super) fn load(&mut self, problem: &Contacts<'_>) -> bool {
        let n = problem.friction.len();
        let size = 3 * n;
        self.n = n;
        let w = problem.operator;
        self.root.clear();
        self.root.extend((0..n).map(|i| {
            let trace: f64 = (3 * i..3 * i + 3).map(|k| w[k * size + k]).sum();
            if trace > 0.0 {
                (trace / 3.0).sqrt()
            } else {
                1.0
            }
        }));
        let root = &self.root;
        self.inverse.clear();
        self.inverse
            .extend(root.iter().flat_map(|root| [1.0 / root; 3]));
        self.operator.clear();
        for (row, inverse) in w.chunks_exact(size.max(1)).zip(&self.inverse) {
            let scaled = row.iter().zip(&self.inverse);
            self.operator.extend(scaled.map(|(w, j)| w * inverse * j));
        }
        self.rates.clear();
        let rates = problem.rates.iter().enumerate();
        self.rates.extend(rates.map(|(i, q)| q / root[i / 3]));
        self.friction.clear();
        self.friction.extend_from_slice(problem.friction);
        self.regularization.clear();
        let sigma = problem.regularization.iter().zip(root);
        self.regularization.extend(sigma.map(|(s, r)| s / r / r));
        let finite = |v: &[f64]| v.iter().all(|x| x.is_finite());
        let positive = |v: &[f64]| v.iter().all(|&x| x >= 0.0);
        finite(&self.operator)
            && finite(&self.rates)
            && finite(&self.friction)
            && finite(&self.regularization)
            && finite(root)
            && positive(&self.friction)
            && positive(&self.regularization)
    }

    /// √ρ of each row.
    pub(super) fn root_of_rows(&self) -> impl Iterator<Item = &f64> {
        self.root.iter().flat_map(|root| [root; 3])
    }

    /// u' = W' x + q'.
    pub(super) fn velocities(&self, x: &[f64], u: &mut [f64]) {
        u.copy_from_slice(&self.rates);
        self.add_product(x, u);
    }

    /// y += W' x. Rows stand for columns: the operator is symmetric, and most contacts may be open.
    pub(super) fn add_product(&self, x: &[f64], y: &mut [f64]) {
        for (row, &x) in self.operator.chunks_exact((3 * self.n).max(1)).zip(x) {
            if x != 0.0 {
                y.iter_mut().zip(row).for_each(|(y, w)| *y += w * x);
            }
        }
    }

    /// The block of W' that couples two contacts.
    pub(super) fn block(&self, i: usize, j: usize) -> [Three; 3] {
        let row = |k: usize| {
            let first = (3 * i + k) * 3 * self.n + 3 * j;
            three(&self.operator[first..first + 3], 0)
        };
        [row(0), row(1), row(2)]
    }

    /// The problem's velocity: the largest |q| and |ρ r|.
    pub(super) fn largest_velocity(&self, x: &[f64]) -> f64 {
        let (rates, impulses) = (self.rates.iter(), x.iter());
        let largest = rates.zip(impulses).enumerate();
        largest.fold(0.0, |most: f64, (k, (q, x))| {
            most.max(self.root[k / 3] * q.abs().max(x.abs()))
        })
    }

    /// The largest residual of a contact in units of velocity, relative to [`largest_velocity`](Self::largest_velocity); NaN where
    /// something is no number.
    pub(super) fn complementarity(&self, x: &[f64], u: &[f64]) -> f64 {
        let mut worst: f64 = 0.0;
        for i in 0..self.n {
            let own = violation(three(x, i), three(u, i), self.friction[i]);
            let residual = own * self.root[i];
            if !residual.is_finite() {
                return f64::NAN;
            }
            worst = worst.max(residual);
        }
        if worst > 0.0 {
            worst / self.largest_velocity(x)
        } else {
            0.0
        }
    }

    /// Moves impulses into their cones: pulling ones to zero, tangential parts no longer than μ times the normal one.
    /// Where the operator's block vanishes there is none, since it would change nothing.
    pub(super) fn admit(&self, x: &mut [f64]) {
        for (i, (x, &mu)) in x.chunks_exact_mut(3).zip(&self.friction).enumerate() {
            let diagonal = self.operator[3 * i * (3 * self.n + 1)];
            x[0] = if diagonal > 0.0 { x[0].max(0.0) } else { 0.0 };
            (x[1], x[2]) = clip(three(x, 0), mu * x[0]);
        }
    }
}
