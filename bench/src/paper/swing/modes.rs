//! Modes of a hanging scene: M, K_e = Jᵀε⁻¹J and K_g = −∂(Jᵀλ)/∂q at fixed λ, in velocity coordinates, dense.

use nalgebra::{DMatrix, DVector, SymmetricEigen, UnitQuaternion, Vector3};
use taut_model::{Linearized, Scene};

/// A mode φ with φᵀMφ = 1, and the energy that the scene's velocities give it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// ω² = φᵀ(K_e + K_g)φ \[1/s²].
    pub total: f64,
    /// ω_e² = φᵀK_eφ \[1/s²].
    pub elastic: f64,
    /// ½(φᵀMv)² \[J].
    pub energy: f64,
}

/// Displacement (m) and rotation (rad) of the finite differences.
const STEP: f64 = 1e-5;

/// Modes of a scene in equilibrium without rigid rows, the one with most energy first.
#[must_use]
pub fn modes(scene: &Scene) -> Vec<Mode> {
    let bodies = &scene.bodies;
    let dim = 6 * bodies.len();
    let mut lin = Linearized::new(scene);
    lin.update(scene, 0.0);
    let lambda: Vec<f64> = lin
        .phi
        .iter()
        .zip(&lin.compliance)
        .map(|(phi, e)| -phi / e)
        .collect();
    let jacobian = dense(&lin, dim);
    let soft = DVector::from_iterator(lin.rows(), lin.compliance.iter().map(|e| e.recip()));
    let elastic = jacobian.transpose() * DMatrix::from_diagonal(&soft) * &jacobian;
    let geometric = geometric(scene, &mut lin, &lambda);
    // M^(−1/2) of the blocks m I and I: its Cholesky factor serves as well as its root.
    let mut mass = DMatrix::zeros(dim, dim);
    let mut v = DVector::zeros(dim);
    for i in 0..bodies.len() {
        let (x, w) = (6 * i, 6 * i + 3);
        mass.view_mut((x, x), (3, 3)).fill_diagonal(bodies.mass[i]);
        mass.view_mut((w, w), (3, 3))
            .copy_from(&bodies.inertia_world(i));
        v.rows_mut(x, 3).copy_from(&bodies.velocity[i]);
        v.rows_mut(w, 3).copy_from(&bodies.angular_velocity[i]);
    }
    let momentum = &mass * v;
    let Some(factor) = mass.cholesky() else {
        return Vec::new();
    };
    let inverse = factor
        .l()
        .try_inverse()
        .unwrap_or_else(|| DMatrix::zeros(dim, dim));
    let scaled = |k: &DMatrix<f64>| &inverse * k * inverse.transpose();
    let eigen = SymmetricEigen::new(scaled(&(&elastic + geometric)));
    let elastic = scaled(&elastic);
    let momentum = inverse * momentum;
    let mode = |k: usize| {
        let phi = eigen.eigenvectors.column(k);
        Mode {
            total: eigen.eigenvalues[k],
            elastic: phi.dot(&(&elastic * phi)),
            energy: 0.5 * phi.dot(&momentum).powi(2),
        }
    };
    let mut modes: Vec<Mode> = (0..dim).map(mode).collect();
    modes.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    modes
}

fn dense(lin: &Linearized, dim: usize) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(lin.rows(), dim);
    for (s, slot) in lin.slots.iter().enumerate() {
        let first = lin.row_range(slot.constraint).start;
        for (r, row) in lin.block(s).chunks_exact(6).enumerate() {
            for (c, value) in row.iter().enumerate() {
                jacobian[(first + r, 6 * slot.body + c)] = *value;
            }
        }
    }
    jacobian
}

/// −∂(Jᵀλ)/∂q by central differences, symmetrised: it is symmetric in equilibrium.
fn geometric(scene: &Scene, lin: &mut Linearized, lambda: &[f64]) -> DMatrix<f64> {
    let dim = 6 * scene.bodies.len();
    let lambda = DVector::from_column_slice(lambda);
    let mut moved = scene.clone();
    let mut stiffness = DMatrix::zeros(dim, dim);
    for column in 0..dim {
        let (body, c) = (column / 6, column % 6);
        let mut force = |step: f64| {
            let mut unit = Vector3::zeros();
            unit[c % 3] = step;
            if c < 3 {
                moved.bodies.position[body] = scene.bodies.position[body] + unit;
            } else {
                let turn = UnitQuaternion::from_scaled_axis(unit);
                moved.bodies.orientation[body] = turn * scene.bodies.orientation[body];
            }
            lin.update(&moved, 0.0);
            dense(lin, dim).transpose() * &lambda
        };
        let change = (force(STEP) - force(-STEP)) / (-2.0 * STEP);
        stiffness.set_column(column, &change);
        moved.bodies.position[body] = scene.bodies.position[body];
        moved.bodies.orientation[body] = scene.bodies.orientation[body];
    }
    (&stiffness + stiffness.transpose()) * 0.5
}

/// Σ_k E_k (1 + ω_ek²Δt²)^(−t/Δt) over Σ_k E_k at `time` (s).
#[must_use]
pub fn predicted(modes: &[Mode], dt: f64, time: f64) -> f64 {
    let all: f64 = modes.iter().map(|m| m.energy).sum();
    let kept = modes.iter().map(|m| {
        let rate = (m.elastic.max(0.0) * dt * dt).ln_1p() / dt;
        m.energy * (-rate * time).exp()
    });
    kept.sum::<f64>() / all
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_model::{HoistParams, JointKind};

    /// A load on one stiff rod is a pendulum: ω² = g (M L + m L/2)/(M L² + m L²/3), nothing of it elastic.
    #[test]
    fn a_pendulum_has_its_frequency() {
        let (m, load, length) = (1e-2, 1.0, 2.0);
        let params = HoistParams {
            segments: 1,
            length,
            segment_mass: Some(m),
            load_mass: Some(load),
            joint: JointKind::Spherical,
            ..HoistParams::default()
        };
        let mut scene = params.hanging_equilibrium().expect("sound");
        scene.bodies.velocity[1].x = 0.1;
        scene.bodies.velocity[0].x = 0.05;
        scene.bodies.angular_velocity[0].y = -0.05;
        let modes = modes(&scene);
        let first = modes[0];
        let inertia = load * length * length + m * length * length / 3.0;
        let exact = 9.81 * (load * length + 0.5 * m * length) / inertia;
        assert!(
            (first.total / exact - 1.0).abs() < 1e-4,
            "{first:?} {exact}"
        );
        assert!(first.elastic.abs() < 1e-3 * first.total, "{first:?}");
        let energy = 0.5 * inertia * 0.05 * 0.05;
        assert!((first.energy / energy - 1.0).abs() < 1e-4, "{first:?}");
    }

    #[test]
    fn each_mode_keeps_its_share() {
        let mode = |elastic, energy| Mode {
            total: 1.0,
            elastic,
            energy,
        };
        let dt = 0.01;
        let modes = [mode(0.0, 3.0), mode(1e4, 1.0)];
        assert!((predicted(&modes, dt, 0.0) - 1.0).abs() < 1e-15);
        let after = (3.0 + 0.25) / 4.0;
        assert!((predicted(&modes, dt, 2.0 * dt) - after).abs() < 1e-14);
    }
}
