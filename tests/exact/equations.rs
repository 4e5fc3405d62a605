use taut_tests::prelude::*;

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
    /// Equations of the scene at time `t` (s), with the geometric stiffness of multipliers
    /// `lambda`.
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
            let k = geometric_stiffness(scene, &rows, lambda, options, i);
            let angular = scene.bodies.inertia_world(i) + k * (options.stiffness.alpha() * dt * dt);
            let block = (6 * i + 3, 6 * i + 3);
            mass.view_mut(block, (3, 3)).copy_from(&angular);
            let angular = angular.try_inverse().expect("an inertia");
            inverse.view_mut(block, (3, 3)).copy_from(&angular);
            let columns = jacobian.columns(6 * i, 6);
            coupling.columns_mut(6 * i, 6).copy_from(&columns);
            let force = scene.bodies.mass[i] * scene.gravity + scene.bodies.force[i];
            let torque = scene.bodies.torque[i];
            impulse.rows_mut(6 * i, 3).copy_from(&(force * dt));
            impulse.rows_mut(6 * i + 3, 3).copy_from(&(torque * dt));
        }
        let v = velocities(&scene.bodies);
        let rates = &jacobian * &v + rate_before;
        let alone = |r: usize| {
            let j = coupling.row(r);
            (j * &inverse * j.transpose())[(0, 0)]
        };
        let mut weights = vec![weights(options.scheme); n];
        let mut phi = rows.phi.clone();
        for bound in &rows.bounds {
            let r = bound.row;
            let soft = rows.compliance[r] / (dt * dt * alone(r));
            (weights[r], phi[r]) = at_bound(bound, (phi[r], rates[r] * dt), soft, weights[r]);
            // The damper of a slack row takes the rate of max(0, φ).
            let slack = match (bound.lower == 0.0, bound.upper == 0.0) {
                (false, true) => rows.phi[r].min(0.0),
                (true, false) => rows.phi[r].max(0.0),
                _ => 0.0,
            };
            phi[r] += rows.damping[r] / dt * slack;
        }
        // Dampers take the rate of the path, which is not that of its tangent.
        let mut curved = beyond_tangent(scene, &rows, &(&jacobian * &v), t, dt);
        for (r, beyond) in curved.iter_mut().enumerate() {
            *beyond *= rows.damping[r] / dt;
            phi[r] += *beyond;
        }
        let speeds = speed_rows(scene);
        let divisor = |r: usize| weights[r][0] + rows.damping[r] / dt;
        let sigma = DVector::from_fn(n, |r, _| match speeds[r] {
            true => 0.0,
            false => rows.compliance[r] / (dt * dt) / divisor(r),
        });
        let c = DVector::from_fn(n, |r, _| {
            let [_, now, past] = weights[r];
            let known = (now - past) * rates[r] - phi[r] / dt;
            if speeds[r] { 0.0 } else { known / divisor(r) }
        }) - DVector::from_column_slice(&rows.phi_t);
        let free = inverse.abs() * impulse.abs();
        let gaps = DVector::from_fn(n, |r, _| match speeds[r] {
            true => 0.0,
            false => (rows.phi[r].abs().max(phi[r].abs()) + curved[r].abs()) / dt / divisor(r),
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

/// What φ of each row of length or gap grows by beyond its tangent in a step \[m], for the rates `jv` = J v.
fn beyond_tangent(
    scene: &Scene,
    rows: &Linearized,
    jv: &DVector<f64>,
    t: f64,
    dt: f64,
) -> DVector<f64> {
    let mut beyond = DVector::zeros(rows.rows());
    for (c, constraint) in scene.constraints.iter().enumerate() {
        let first = rows.row_range(c).start;
        let is_held = constraint.frames().iter().any(|f| f.body_index().is_none());
        if constraint.has_stretch_rows() && !is_held {
            continue;
        }
        let (ahead, count) = constraint.gap_ahead(&scene.bodies, t, dt);
        for (r, ahead) in (first..).zip(ahead).take(count) {
            beyond[r] = ahead - (rows.phi[r] + dt * (jv[r] + rows.phi_t[r]));
        }
    }
    beyond
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

/// Rows that hold a speed: in every scheme they are J v⁺ + ∂φ/∂t = 0.
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

/// Weights of the rates after, before and the step before that.
fn weights(scheme: Scheme) -> [f64; 3] {
    let weights = scheme.weights();
    [weights.next, weights.now, weights.before]
}

/// Weights and φ of a row of compliance ε that can be open, for φ and Δt r of its present state, `soft` = ε/(Δt² J M̃⁻¹ Jᵀ)
/// and a scheme's `weights`; its past is like its present. Rows that slip on both sides are as others are.
fn at_bound(
    bound: &RowBounds,
    (phi, path): (f64, f64),
    soft: f64,
    weights: [f64; 3],
) -> ([f64; 3], f64) {
    let side = match (bound.lower == 0.0, bound.upper == 0.0) {
        (false, true) => 1.0,
        (true, false) => -1.0,
        _ => return (weights, phi),
    };
    let (depth, reach) = (side * phi, path.abs());
    // A row that is open within a step of now has no past: it is wholly implicit if it opens
    // further.
    let share = if depth >= reach {
        0.0
    } else if side * path < 0.0 {
        1.0
    } else {
        1.0 / (1.0 + (9.0 * soft).powi(2))
    };
    let implicit = [1.0, 0.0, 0.0];
    let mixed: [f64; 3] = std::array::from_fn(|k| share * implicit[k] + (1.0 - share) * weights[k]);
    if depth.abs() >= reach {
        return (mixed, phi);
    }
    // The mean of max(depth, 0) along the path, weighted by the hat over the steps before and after: the second
    // difference of x³/6 where x > 0.
    let third = |x: f64| x.max(0.0).powi(3) / 6.0;
    let second = third(depth + reach) - 2.0 * third(depth) + third(depth - reach);
    let mean = second / (reach * reach);
    // At a constant rate the row looks at φ + (p − q + s) Δt r.
    let [next, now, past] = mixed;
    let here = 1.0 - (next - now + past);
    (
        mixed,
        phi + here * soft / (1.0 + soft) * side * (mean - depth),
    )
}

/// K of a body from multipliers λ: over its attachments max(F·r, 0) (I − r rᵀ/r²), and β (I − m mᵀ) of joints with the twist
/// moment M about m and bends of stiffness c, where β + E max(F·r, 0) + G c is just what the two sides need for
/// (β + E t + G c)² = (G c)² + (M/2)². G and E are what the rows and K resist beyond their stiffness of what alternates
/// from step to step.
fn geometric_stiffness(
    scene: &Scene,
    rows: &Linearized,
    lambda: &[f64],
    options: &StepOptions,
    body: usize,
) -> Matrix3<f64> {
    let weights = weights(options.scheme);
    let alternating = 2.0 * weights.iter().sum::<f64>();
    let of_tension = alternating * options.stiffness.alpha() / weights[0] - 1.0;
    let across = |axis: Vector3<f64>| {
        let unit = axis.normalize();
        Matrix3::identity() - unit * unit.transpose()
    };
    let mut k = Matrix3::zeros();
    for (s, slot) in rows.slots.iter().enumerate().filter(|x| x.1.body == body) {
        let (r, lambda) = (rows.lever(s), &lambda[rows.row_range(slot.constraint)]);
        let block = rows.block(s);
        let pulls = block.chunks_exact(6).zip(lambda);
        let force = pulls.map(|(j, l)| Vector3::new(j[0], j[1], j[2]) * *l);
        let force: Vector3<f64> = force.sum();
        let tension = force.dot(&r).max(0.0);
        if r.norm() > 0.0 {
            k += across(r) * tension;
        }
        if let Constraint::Cosserat(joint) = &scene.constraints[slot.constraint] {
            let compliance = joint.law.bend.expect("a bend").compliance;
            let (bends, half) = ((alternating - 1.0) / compliance, 0.5 * lambda[5]);
            // hypot(bends, half) − bends, without the cancellation.
            let needed = half * half / (bends.hypot(half) + bends);
            let twist = Vector3::new(block[33], block[34], block[35]);
            k += across(twist) * (needed - of_tension * tension).max(0.0);
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

/// Bodies turn freely at the end of a step, from the orientations `start`: back to the angular velocities that the linear
/// system gave. Those with an axis of symmetry have turned about their angular momentum; of the others it is the same.
pub(crate) fn take_back_rotation(bodies: &mut Bodies, start: &Bodies, dt: f64) {
    for i in (0..bodies.len()).filter(|&i| start.is_dynamic(i)) {
        let omega = bodies.angular_velocity[i];
        let momentum = bodies.inertia_world(i) * omega;
        bodies.angular_velocity[i] = match across(&bodies.inertia[i]) {
            Some(across) => UnitQuaternion::from_scaled_axis(momentum / across * -dt) * omega,
            None => start.inertia_world(i).try_inverse().expect("an inertia") * momentum,
        };
    }
}
