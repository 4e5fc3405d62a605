//! Effective inertia M̃ of all bodies at the beginning of a step, and products with it.
//!
//! M̃ = diag(m I₃, R I Rᵀ + α Δt² K) block by block, [SL (3)] with the geometric stiffness K of [`crate::geometric`].
//! This is the one place where it is computed. Static and driven bodies are infinitely heavy: M̃⁻¹ = 0 and Δt f = 0; their
//! M̃ is the identity, which the KKT matrix needs.

use crate::geometric::Geometric;
use crate::gyroscopic;
use nalgebra::{Matrix3, Vector3};
use taut_model::{Bodies, Scene};

/// M̃ and its inverse for all bodies, and the impulses Δt f that do not come from constraints.
#[derive(Debug, Clone)]
pub(crate) struct Inertia {
    /// Mass of each body \[kg].
    pub(crate) mass: Vec<f64>,
    /// 1/mass \[1/kg].
    pub(crate) inverse_mass: Vec<f64>,
    /// Angular part of M̃, world frame \[kg m²].
    pub(crate) angular: Vec<Matrix3<f64>>,
    /// Its inverse.
    pub(crate) inverse_angular: Vec<Matrix3<f64>>,
    /// Δt f: 6 numbers a body, [linear (N s), angular (N m s)]: gravity, external and gyroscopic.
    pub(crate) impulse: Vec<f64>,
}

impl Inertia {
    pub(crate) fn new(bodies: &Bodies) -> Self {
        let n = bodies.len();
        let dynamic = |i: &usize| bodies.is_dynamic(*i);
        let mass = |i| if dynamic(&i) { bodies.mass[i] } else { 1.0 };
        let inverse = |i| {
            if dynamic(&i) {
                1.0 / bodies.mass[i]
            } else {
                0.0
            }
        };
        Self {
            mass: (0..n).map(mass).collect(),
            inverse_mass: (0..n).map(inverse).collect(),
            angular: vec![Matrix3::identity(); n],
            inverse_angular: vec![Matrix3::zeros(); n],
            impulse: vec![0.0; 6 * n],
        }
    }

    /// M̃ and Δt f of the scene's present state, with the geometric stiffness times `alpha`. `Err(body)` where the
    /// inertia has no inverse.
    pub(crate) fn update(
        &mut self,
        scene: &Scene,
        dt: f64,
        geometric: &Geometric,
        alpha: f64,
    ) -> Result<(), usize> {
        let bodies = &scene.bodies;
        for i in scene.dynamic_bodies() {
            let rotation = bodies.rotation(i);
            let world = rotation * bodies.inertia[i] * rotation.transpose();
            let inertia = world + geometric.stiffness[i] * (alpha * dt * dt);
            let inverse = inertia.try_inverse().ok_or(i)?;
            let omega = &bodies.angular_velocity[i];
            let force = bodies.mass[i] * scene.gravity + bodies.force[i];
            let gyroscopic = gyroscopic::impulse(&bodies.inertia[i], &rotation, &world, omega, dt);
            let angular = dt * bodies.torque[i] + gyroscopic;
            self.impulse[6 * i..6 * i + 3].copy_from_slice((dt * force).as_slice());
            self.impulse[6 * i + 3..6 * i + 6].copy_from_slice(angular.as_slice());
            self.angular[i] = inertia;
            self.inverse_angular[i] = inverse;
        }
        Ok(())
    }

    /// M̃ of body `i` grows by `mass` (kg) and by `angular` (kg m²) about every axis; Δt f stays. `false` where there is
    /// no inverse.
    pub(crate) fn add_ballast(&mut self, i: usize, mass: f64, angular: f64) -> bool {
        if self.is_immovable(i) {
            return true;
        }
        self.mass[i] += mass;
        self.inverse_mass[i] = 1.0 / self.mass[i];
        self.angular[i] += Matrix3::from_diagonal_element(angular);
        let inverse = self.angular[i].try_inverse();
        inverse.is_some_and(|inverse| {
            self.inverse_angular[i] = inverse;
            true
        })
    }

    /// Whether body `i` is static or driven.
    pub(crate) fn is_immovable(&self, i: usize) -> bool {
        self.inverse_mass[i] == 0.0
    }

    /// Adds an impulse's angular part to Δt f of body `i`.
    pub(crate) fn add_angular_impulse(&mut self, i: usize, impulse: &Vector3<f64>) {
        if self.is_immovable(i) {
            return;
        }
        for (to, p) in self.impulse[6 * i + 3..6 * i + 6]
            .iter_mut()
            .zip(impulse.iter())
        {
            *to += p;
        }
    }

    /// Adds Jᵀ μ of one row `j` on body `i` to Δt f.
    pub(crate) fn add_impulse(&mut self, i: usize, j: &[f64; 6], mu: f64) {
        if self.is_immovable(i) {
            return;
        }
        for (to, j) in self.impulse[6 * i..6 * i + 6].iter_mut().zip(j) {
            *to += j * mu;
        }
    }

    /// y = M̃ v for body `i`.
    #[inline]
    pub(crate) fn apply(&self, i: usize, v: &[f64; 6], y: &mut [f64; 6]) {
        product(self.mass[i], &self.angular[i], v, y);
    }

    /// y = M̃⁻¹ p for body `i`.
    #[inline]
    pub(crate) fn apply_inverse(&self, i: usize, p: &[f64; 6], y: &mut [f64; 6]) {
        product(self.inverse_mass[i], &self.inverse_angular[i], p, y);
    }
}

/// y = diag(linear I₃, angular) v.
#[inline(always)]
fn product(linear: f64, angular: &Matrix3<f64>, v: &[f64; 6], y: &mut [f64; 6]) {
    let turned = angular * Vector3::new(v[3], v[4], v[5]);
    *y = [
        linear * v[0],
        linear * v[1],
        linear * v[2],
        turned.x,
        turned.y,
        turned.z,
    ];
}
