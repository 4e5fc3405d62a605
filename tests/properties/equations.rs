use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};
use taut_integrator::{Scheme, StepOptions};
use taut_model::{Bodies, Linearized, RowBounds, RowKind, Scene};

/// The equations of a step as dense matrices, made from the scene without the integrator's maps: velocities
/// v⁺ = v + M̃⁻¹ (Δt f + Jᵀ μ) with J v⁺ + Σ μ = c. The past is like the present state.
pub(crate) struct Equations {
    /// J with all its columns: 6 a body, one row a row.
    pub(crate) jacobian: DMatrix<f64>,
    /// J with the columns of dynamic bodies only: through which multipliers act.
    pub(crate) coupling: DMatrix<f64>,
    /// M̃ = M + αΔt²K, the identity where a body is not dynamic.
    pub(crate) mass: DMatrix<f64>,
    /// M̃⁻¹, zero where a body is not dynamic.
    pub(crate) inverse: DMatrix<f64>,
    /// The diagonal of Σ.
    pub(crate) sigma: DVector<f64>,
    pub(crate) c: DVector<f64>,
    /// Δt f.
    pub(crate) impulse: DVector<f64>,
    /// c − J (v + M̃⁻¹ Δt f).
    pub(crate) b: DVector<f64>,
    /// The magnitudes that b is a sum of.
    pub(crate) b_made_of: DVector<f64>,
    pub(crate) bounds: Vec<RowBounds>,
}

impl Equations {
    /// Those of the scene at time `t` (s), with the geometric stiffness of multipliers `lambda`.
    pub(crate) fn of(scene: &Scene, t: f64, lambda: &[f64], options: &StepOptions) -> Self {
        let dt = options.dt;
        let mut rows = Linearized::new(scene);
        rows.update(scene, t);
        rows.drive(scene, t - dt, t);
        let rate_before = DVector::from_column_slice(&rows.phi_t);
        rows.drive(scene, t, t + dt);
        let jacobian = jacobian(scene, &rows);
        let (n, m) = jacobian.shape();
        let (mut mass, mut inverse) = (DMatrix::identity(m, m), DMatrix::zeros(m, m));
        let (mut coupling, mut impulse) = (DMatrix::zeros(n, m), DVector::zeros(m));
        for i in scene.dynamic_bodies() {
            for r in 6 * i..6 * i + 3 {
                mass[(r, r)] = scene.bodies.mass[i];
                inverse[(r, r)] = 1.0 / scene.bodies.mass[i];
            }
            let k = geometric_stiffness(&rows, lambda, i);
            let angular = scene.bodies.inertia_world(i) + k * (options.stiffness.alpha() * dt * dt);
            let block = (6 * i + 3, 6 * i + 3);
            mass.view_mut(block, (3, 3)).copy_from(&angular);
            let angular = angular.try_inverse().expect("an inertia");
            inverse.view_mut(block, (3, 3)).copy_from(&angular);
            let columns = jacobian.columns(6 * i, 6);
            coupling.columns_mut(6 * i, 6).copy_from(&columns);
            let force = scene.bodies.mass[i] * scene.gravity + scene.bodies.force[i];
            let torque = scene.bodies.torque[i] * dt + gyroscopic_impulse(&scene.bodies, i, dt);
            impulse.rows_mut(6 * i, 3).copy_from(&(force * dt));
            impulse.rows_mut(6 * i + 3, 3).copy_from(&torque);
        }
        let v = velocities(&scene.bodies);
        let rates = &jacobian * &v + rate_before;
        let [next, now, past] = weights(options.scheme);
        let speeds = speed_rows(scene);
        let sigma = DVector::from_fn(n, |r, _| match speeds[r] {
            true => 0.0,
            false => rows.compliance[r] / (dt * dt) / (next + rows.damping[r] / dt),
        });
        let c = DVector::from_fn(n, |r, _| {
            let known = (now - past) * rates[r] - rows.phi[r] / dt;
            let known = known / (next + rows.damping[r] / dt);
            if speeds[r] { 0.0 } else { known }
        }) - DVector::from_column_slice(&rows.phi_t);
        let free = inverse.abs() * impulse.abs();
        let gaps = DVector::from_fn(n, |r, _| match speeds[r] {
            true => 0.0,
            false => (rows.phi[r] / dt / (next + rows.damping[r] / dt)).abs(),
        });
        let b_made_of = c.abs() + gaps + jacobian.abs() * (v.abs() + free);
        let b = &c - &jacobian * (v + &inverse * &impulse);
        Self {
            jacobian,
            coupling,
            mass,
            inverse,
            sigma,
            c,
            impulse,
            b,
            b_made_of,
            bounds: rows.bounds,
        }
    }

    /// S = J M̃⁻¹ Jᵀ + Σ.
    pub(crate) fn schur(&self) -> DMatrix<f64> {
        &self.coupling * &self.inverse * self.coupling.transpose()
            + DMatrix::from_diagonal(&self.sigma)
    }

    /// The magnitudes that S x is a sum of, |J| |M̃⁻¹| |Jᵀ| |x| + Σ |x|.
    pub(crate) fn schur_made_of(&self, x: &DVector<f64>) -> DVector<f64> {
        let impulse = self.coupling.transpose().abs() * x.abs();
        self.coupling.abs() * (self.inverse.abs() * impulse) + self.sigma.component_mul(&x.abs())
    }
}

fn jacobian(scene: &Scene, rows: &Linearized) -> DMatrix<f64> {
    let mut jacobian = DMatrix::zeros(rows.rows(), 6 * scene.bodies.len());
    for (s, slot) in rows.slots.iter().enumerate() {
        let first = rows.row_range(slot.constraint).start;
        for (r, row) in rows.block(s).chunks_exact(6).enumerate() {
            for (c, j) in row.iter().enumerate() {
                jacobian[(first + r, 6 * slot.body + c)] += j;
            }
        }
    }
    jacobian
}

/// Whether each row holds a speed: it then is J v⁺ + ∂φ/∂t = 0 in every scheme.
fn speed_rows(scene: &Scene) -> Vec<bool> {
    let constraints = scene.constraints.iter();
    let kinds = constraints.flat_map(|c| (0..c.rows()).map(|r| c.row(r).0));
    kinds.map(|kind| kind == RowKind::Speed).collect()
}

/// Velocities and angular velocities, 6 numbers a body.
pub(crate) fn velocities(bodies: &Bodies) -> DVector<f64> {
    let pairs = bodies.velocity.iter().zip(&bodies.angular_velocity);
    let numbers = pairs.flat_map(|(v, w)| v.iter().chain(w.iter()));
    DVector::from_iterator(6 * bodies.len(), numbers.copied())
}

/// Weights of the rates after, before and the step before that, of the schemes that are tested here.
fn weights(scheme: Scheme) -> [f64; 3] {
    match scheme {
        Scheme::LinearlyImplicit => [1.0, 0.0, 0.0],
        Scheme::ThirdDifference { a, gamma } => [a + gamma, a + 2.0 * gamma, gamma],
        other => panic!("{other} is not tested here"),
    }
}

/// K of a body from multipliers λ: Σ max(F·r, 0) (I − r rᵀ/r²) over its attachments.
fn geometric_stiffness(rows: &Linearized, lambda: &[f64], body: usize) -> Matrix3<f64> {
    let mut k = Matrix3::zeros();
    for (s, slot) in rows.slots.iter().enumerate() {
        let (r, lambda) = (rows.lever(s), &lambda[rows.row_range(slot.constraint)]);
        if slot.body == body && r.norm() > 0.0 {
            let block = rows.block(s);
            let pulls = block.chunks_exact(6).zip(lambda);
            let force: Vector3<f64> = pulls
                .map(|(j, l)| Vector3::new(j[0], j[1], j[2]) * *l)
                .sum();
            let across = Matrix3::identity() - r.normalize() * r.normalize().transpose();
            k += across * force.dot(&r).max(0.0);
        }
    }
    k
}

/// The principal moment that a body with an axis of symmetry has twice.
fn across(inertia: &Matrix3<f64>) -> Option<f64> {
    let d = inertia.diagonal();
    let diagonal = *inertia == Matrix3::from_diagonal(&d);
    let twice = [0, 1, 2].into_iter().find(|&k| d[k] == d[(k + 1) % 3]);
    twice.filter(|_| diagonal).map(|k| d[k])
}

/// Bodies with an axis of symmetry end a step with an angular velocity that has turned about their angular momentum:
/// back to what the linear system gave.
pub(crate) fn take_back_precession(bodies: &mut Bodies, dt: f64) {
    for i in (0..bodies.len())
        .filter(|&i| bodies.is_dynamic(i))
        .collect::<Vec<_>>()
    {
        if let Some(across) = across(&bodies.inertia[i]) {
            let omega = bodies.angular_velocity[i];
            let turning = bodies.inertia_world(i) * omega / across;
            let back = UnitQuaternion::from_scaled_axis(turning * -dt);
            bodies.angular_velocity[i] = back * omega;
        }
    }
}

/// What free rotation through a step does to a body's angular momentum: I y⁺ − I y with
/// exp(½Δt ŷ⁺) I y⁺ = exp(−½Δt ŷ) I y in the body's frame, by fixed-point iteration; nothing where the body has an axis of
/// symmetry, whose angular velocity turns with it.
fn gyroscopic_impulse(bodies: &Bodies, i: usize, dt: f64) -> Vector3<f64> {
    let (inertia, turn) = (bodies.inertia[i], bodies.orientation[i]);
    if across(&inertia).is_some() {
        return Vector3::zeros();
    }
    let y = turn.inverse() * bodies.angular_velocity[i];
    let back = |y: Vector3<f64>| UnitQuaternion::from_scaled_axis(y * (-0.5 * dt));
    let before = back(y) * (inertia * y);
    let inverse = inertia.try_inverse().expect("an inertia");
    let mut next = y;
    for _ in 0..60 {
        next = inverse * (back(next) * before);
    }
    turn * (inertia * (next - y))
}
