//! Modes of a scene at rest: M, K_e = Jᵀε⁻¹J and K_g = −∂(Jᵀλ)/∂q at fixed λ, in velocity coordinates, dense, of the
//! library's own Jacobians, masses and compliances.
//!
//! Rigid rows take part by the null space of their Jacobian: with its basis Z the modes are those of ZᵀKZ and ZᵀMZ.

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

/// Natural oscillations, slowest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Natural {
    /// ω² \[1/s²]; negative where the equilibrium is unstable.
    pub squares: Vec<f64>,
    /// Share of the elastic rows in each, φᵀK_eφ \[1/s²].
    pub elastic: Vec<f64>,
    /// Shapes with φᵀMφ = 1, one a column, six numbers a body: displacement \[m], rotation \[rad].
    pub shapes: DMatrix<f64>,
}

impl Natural {
    /// ω of mode `k` \[rad/s]; NaN beyond the last mode and for an unstable one.
    pub fn frequency(&self, k: usize) -> f64 {
        self.squares.get(k).map_or(f64::NAN, |w| w.sqrt())
    }

    /// The bodies of `scene` moved by mode `k`, whose largest displacement (m) or rotation (rad) becomes `amplitude`.
    pub fn displace(&self, scene: &mut Scene, k: usize, amplitude: f64) {
        let shape = self.shapes.column(k);
        let scale = amplitude / shape.amax();
        for i in 0..scene.bodies.len() {
            let part = |c: usize| Vector3::new(shape[c], shape[c + 1], shape[c + 2]) * scale;
            scene.bodies.position[i] += part(6 * i);
            let turn = UnitQuaternion::from_scaled_axis(part(6 * i + 3));
            scene.bodies.orientation[i] = turn * scene.bodies.orientation[i];
        }
    }
}

/// Displacement (m) and rotation (rad) of the finite differences.
const STEP: f64 = 1e-5;

/// Modes of a scene in equilibrium without rigid rows, the one with most energy first.
pub fn modes(scene: &Scene) -> Vec<Mode> {
    let dim = 6 * scene.bodies.len();
    let all: Vec<usize> = (0..dim).collect();
    let system = System::new(scene, &all);
    // M^(−1/2) of the blocks m I and I: its Cholesky factor serves as well as its root.
    let mut v = DVector::zeros(dim);
    for (i, (velocity, omega)) in velocities(scene).enumerate() {
        v.rows_mut(6 * i, 3).copy_from(velocity);
        v.rows_mut(6 * i + 3, 3).copy_from(omega);
    }
    let momentum = &system.mass * v;
    let Some(inverse) = inverse_root(system.mass) else {
        return Vec::new();
    };
    let scaled = |k: &DMatrix<f64>| &inverse * k * inverse.transpose();
    let eigen = SymmetricEigen::new(scaled(&(&system.elastic + system.geometric)));
    let elastic = scaled(&system.elastic);
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

/// Natural oscillations of a scene in equilibrium in which of each body's six coordinates (displacements along x, y, z,
/// rotations about them) only `coordinates` move: by its symmetry the others do not, and static bodies never do. `None` where rows or masses are
/// degenerate, or nothing moves.
pub fn natural(scene: &Scene, coordinates: &[usize]) -> Option<Natural> {
    let bodies = scene.bodies.len();
    let free = |i: &usize| scene.bodies.is_dynamic(*i);
    let turns = |column: &usize| column % 6 < 3 || !scene.bodies.is_point(column / 6);
    let columns: Vec<usize> = (0..bodies)
        .filter(free)
        .flat_map(|i| coordinates.iter().map(move |c| 6 * i + c))
        .filter(turns)
        .collect();
    if columns.is_empty() {
        return None;
    }
    let system = System::new(scene, &columns);
    let free = null_space(&system.rigid)?;
    let reduced = |k: &DMatrix<f64>| free.transpose() * k * &free;
    let inverse = inverse_root(reduced(&system.mass))?;
    let stiffness = reduced(&(&system.elastic + &system.geometric));
    let eigen = SymmetricEigen::new(&inverse * stiffness * inverse.transpose());
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let moved = free * inverse.transpose() * &eigen.eigenvectors;
    let mut shapes = DMatrix::zeros(6 * bodies, order.len());
    let of_rows = |k: &usize| {
        let shape = moved.column(*k);
        shape.dot(&(&system.elastic * shape))
    };
    let elastic = order.iter().map(of_rows).collect();
    for (to, from) in order.iter().enumerate() {
        for (row, column) in columns.iter().enumerate() {
            shapes[(*column, to)] = moved[(row, *from)];
        }
    }
    let squares = order.iter().map(|k| eigen.eigenvalues[*k]).collect();
    Some(Natural {
        squares,
        elastic,
        shapes,
    })
}

/// M, K_e, K_g, and the Jacobian of the rigid rows.
struct System {
    mass: DMatrix<f64>,
    elastic: DMatrix<f64>,
    geometric: DMatrix<f64>,
    rigid: DMatrix<f64>,
}

impl System {
    /// System in the coordinates `columns`; a body has six.
    fn new(scene: &Scene, columns: &[usize]) -> Self {
        let dim = 6 * scene.bodies.len();
        let mut lin = Linearized::new(scene);
        lin.update(scene, 0.0);
        let jacobian = dense(&lin, dim);
        // Transverse rows measure nothing: what they carry is K_g.
        let counts = |r: &usize| !lin.transverse.iter().any(|link| link.rows().contains(r));
        let is_rigid = |r: usize| lin.compliance[r] == 0.0;
        let rows = (0..lin.rows()).filter(counts);
        let (hard, soft): (Vec<usize>, Vec<usize>) = rows.partition(|r| is_rigid(*r));
        let mut lambda = DVector::zeros(lin.rows());
        for r in &soft {
            lambda[*r] = -lin.phi[*r] / lin.compliance[*r];
        }
        let mut mass = DMatrix::zeros(dim, dim);
        let mut force = jacobian.transpose() * &lambda;
        for i in 0..scene.bodies.len() {
            let (bodies, x, w) = (&scene.bodies, 6 * i, 6 * i + 3);
            mass.view_mut((x, x), (3, 3)).fill_diagonal(bodies.mass[i]);
            let mut angular = mass.view_mut((w, w), (3, 3));
            if bodies.is_point(i) {
                // Rotations that nothing resists and nothing excites.
                angular.fill_diagonal(1.0);
            } else {
                angular.copy_from(&bodies.inertia_world(i));
            }
            let mut own = force.rows_mut(x, 3);
            own += scene.gravity * bodies.mass[i] + bodies.force[i];
            let mut own = force.rows_mut(w, 3);
            own += bodies.torque[i];
        }
        let all_rigid = jacobian.select_rows(&hard);
        // Rigid rows carry what is left of the forces: J Jᵀ λ = −J f.
        if let Some(factor) = (&all_rigid * all_rigid.transpose()).cholesky() {
            let found = factor.solve(&(&all_rigid * -force));
            for (r, value) in hard.iter().zip(found.iter()) {
                lambda[*r] = *value;
            }
        }
        let kept = jacobian.select_columns(columns);
        let stiff =
            DVector::from_iterator(soft.len(), soft.iter().map(|r| lin.compliance[*r].recip()));
        let springs = kept.select_rows(&soft);
        Self {
            mass: mass.select_rows(columns).select_columns(columns),
            elastic: springs.transpose() * DMatrix::from_diagonal(&stiff) * &springs,
            geometric: geometric(scene, &mut lin, &lambda, columns),
            rigid: kept.select_rows(&hard),
        }
    }
}

/// The inverse of M's Cholesky factor.
fn inverse_root(mass: DMatrix<f64>) -> Option<DMatrix<f64>> {
    mass.cholesky()?.l().try_inverse()
}

/// A basis of what `rows` leave free, one vector a column. Rows that are zero in the coordinates kept do not count.
fn null_space(rows: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let dim = rows.ncols();
    let bound = (0..rows.nrows()).filter(|r| rows.row(*r).amax() > 1e-12);
    let bound = bound.count();
    let eigen = SymmetricEigen::try_new(rows.transpose() * rows, f64::EPSILON, 0)?;
    let mut order: Vec<usize> = (0..dim).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    order.truncate(dim.checked_sub(bound)?);
    Some(eigen.eigenvectors.select_columns(&order))
}

fn velocities(scene: &Scene) -> impl Iterator<Item = (&Vector3<f64>, &Vector3<f64>)> {
    let bodies = &scene.bodies;
    bodies.velocity.iter().zip(&bodies.angular_velocity)
}

fn dense(lin: &Linearized, dim: usize) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(lin.rows(), dim);
    for (s, slot) in lin.slots.iter().enumerate() {
        let first = lin.row_range(slot.constraint).start;
        for (r, row) in lin.block(s).chunks_exact(6).enumerate() {
            for (c, value) in row.iter().enumerate() {
                jacobian[(first + r, 6 * slot.body + c)] += *value;
            }
        }
    }
    jacobian
}

/// −∂(Jᵀλ)/∂q of the coordinates `columns` by central differences, symmetrised: it is symmetric in equilibrium.
fn geometric(
    scene: &Scene,
    lin: &mut Linearized,
    lambda: &DVector<f64>,
    columns: &[usize],
) -> DMatrix<f64> {
    let mut moved = scene.clone();
    let mut stiffness = DMatrix::zeros(columns.len(), columns.len());
    for (k, &column) in columns.iter().enumerate() {
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
            forces(lin, lambda, scene.bodies.len())
        };
        let change = (force(STEP) - force(-STEP)) / (-2.0 * STEP);
        stiffness.set_column(k, &change.select_rows(columns));
        moved.bodies.position[body] = scene.bodies.position[body];
        moved.bodies.orientation[body] = scene.bodies.orientation[body];
    }
    (&stiffness + stiffness.transpose()) * 0.5
}

/// Jᵀλ.
fn forces(lin: &Linearized, lambda: &DVector<f64>, bodies: usize) -> DVector<f64> {
    let mut out = DVector::zeros(6 * bodies);
    for (s, slot) in lin.slots.iter().enumerate() {
        let first = lin.row_range(slot.constraint).start;
        for (r, row) in lin.block(s).chunks_exact(6).enumerate() {
            for (c, value) in row.iter().enumerate() {
                out[6 * slot.body + c] += *value * lambda[first + r];
            }
        }
    }
    out
}

/// Σ_k E_k (1 + ω_ek²Δt²)^(−t/Δt) over Σ_k E_k at `time` (s).
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
        let off = (first.total / exact - 1.0).abs();
        assert!(off < 1e-4, "{first:?} {exact}");
        assert!(first.elastic.abs() < 1e-3 * first.total, "{first:?}");
        let energy = 0.5 * inertia * 0.05 * 0.05;
        assert!((first.energy / energy - 1.0).abs() < 1e-4, "{first:?}");
    }

    /// Two equal masses on rigid massless links: ω² = (g/l)(2 ∓ √2).
    #[test]
    fn rigid_links_leave_a_double_pendulum() {
        let params = taut_model::ParticleChainParams {
            particles: 2,
            spacing: 0.7,
            load_mass: 1.0,
            compliance: 0.0,
            horizontal: false,
            ..taut_model::ParticleChainParams::default()
        };
        let found = natural(&params.build().expect("sound"), &[0, 2]).expect("regular");
        assert_eq!(found.squares.len(), 2);
        for (k, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let exact = 10.0 / 0.7 * (2.0 + sign * 2.0_f64.sqrt());
            assert!((found.squares[k] / exact - 1.0).abs() < 1e-8, "{found:?}");
        }
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
