//! Geometric stiffness: how the torque r × F of an attachment changes when the body, and with it the lever arm r
//! ([`Linearized::lever`]), turns under a constraint force F, and how a joint's twist moment changes with its axis.
//!
//! The exact derivative, −∂(r × F)/∂θ = (F·r) I − r Fᵀ, is not symmetric. Its symmetric part with negative eigenvalues
//! removed ([T], [A]) has its null direction midway between r and F: a transverse torque then spins a thin segment about
//! its axis, where it has next to no inertia, and heavy loads (10⁶ segments' masses) are lost to that spin. Here F is
//! projected on the lever arm instead,
//!
//! ```text
//! K = Σ_k max(F_k·r_k, 0) (I − r_k r_kᵀ/|r_k|²)
//! ```
//!
//! which is exact where F ∥ r (a taut cable at rest), positive semidefinite without an eigenvalue problem, and leaves
//! the spin about r free.
//!
//! **Torque.** The twist moment M of a joint acts along the mean of its bodies' axes, so the turning of either body across
//! the axis moves it: with complex tilts θ a joint adds the coupling
//!
//! ```text
//! ½M (i θ̄_a θ_b − i θ_a θ̄_b)      straight chain, wave number k, bends c = EI/l:  2c (1 − cos k) − M sin k
//! ```
//!
//! which no block of a body can hold. It softens the helices of one hand, up to Greenhill's buckling, and stiffens those
//! of the other. The step sees it explicitly, and what alternates from step to step (z = −1) is lost where the added
//! stiffness exceeds what the filters leave: the excess F = 2 (p + q + s) − 1 of the bends' weights times their stiffness, and
//! E of the tension's K likewise. A joint's part of that balance is positive where both bodies have β more,
//!
//! ```text
//! ⎡ β + E t + F c    −F c − ½iM   ⎤ ⪰ 0      β = max(√(F²c² + ¼M²) − F c − E t, 0)      t = max(F·r, 0)
//! ⎣ −F c + ½iM       β + E t + F c ⎦
//! ```
//!
//! so β (I − m mᵀ), m the twist's axis, joins K. It is inertia as the tension's: statics, and so buckling, do not feel it. It
//! is 0 up to about a fifth of Greenhill's torque, and of second order in M: EI/l resists the rest.

use crate::GeometricStiffness;
use crate::options::Excess;
use nalgebra::{Matrix3, Vector3};
use taut_lanes::vector::{Vec3, dot};
use taut_lanes::{Lanes, Level, WideKernel, dispatch_wide};
use taut_model::BodyVectors;
use taut_model::body_vectors::{packed, unpacked};
use taut_model::lanes::{Numbers, PACK, in_packs, part};
use taut_model::{Constraint, Linearized, RowKind, Scene, Wrench};

/// K of all bodies.
#[derive(Debug, Clone)]
pub(crate) struct Geometric {
    /// K of each body, in the world frame \[N m]: xx, yx, zx, yy, zy, zz.
    stiffness: BodyVectors,
    /// Bending stiffness of the joints of each pack \[N m].
    bending: Vec<Numbers>,
}

impl Geometric {
    pub(crate) fn new(scene: &Scene, rows: &Linearized) -> Self {
        Self {
            stiffness: BodyVectors::new(scene.bodies.len()),
            bending: in_packs(
                rows.joints()
                    .iter()
                    .map(|joint| bending(&scene.constraints[joint.constraint])),
                RIGID,
            ),
        }
    }

    /// Takes the present bending stiffness of the joint at `place` in [`Linearized::joints`].
    pub(crate) fn renew(&mut self, place: usize, joint: &Constraint) {
        self.bending[place / PACK][place % PACK] = bending(joint);
    }

    /// K of each body: xx, yx, zx, yy, zy, zz.
    pub(crate) fn stiffness(&self) -> &BodyVectors {
        &self.stiffness
    }

    /// No stiffness.
    pub(crate) fn clear(&mut self) {
        self.stiffness.clear();
    }

    /// K from multipliers λ (N, N m), at the attachments as linearised; with that of the twist moments for a step that sees
    /// them explicitly.
    pub(crate) fn update(&mut self, rows: &Linearized, lambda: &[f64], excess: Option<Excess>) {
        self.clear();
        let joints = Joints {
            rows,
            lambda,
            bending: &self.bending,
            excess,
            stiffness: &mut self.stiffness,
        };
        dispatch_wide(Level::best(), joints);
        for s in rows.others().iter().flat_map(|&c| rows.slot_range(c)) {
            let (r, (force, _)) = (rows.lever(s), wrench(rows, s, lambda));
            self.add_force(rows.slots[s].body, &r, &force);
        }
    }

    /// Adds K of a force (N) that acts at the lever arm `r` (m) of a body.
    pub(crate) fn add_force(&mut self, body: usize, r: &Vector3<f64>, force: &Vector3<f64>) {
        let tension = force.dot(r);
        if tension > 0.0 {
            self.stiffness.add(body, across(tension, r.as_ref()));
        }
    }

    /// Adds what K lacks of the symmetric part of −Σ ∂(r × F)/∂θ of a body, as far as it is positive: what forces at
    /// several points of a body resist together, as a load does that rocks about the ends of its slings. K is then
    /// nowhere too soft.
    pub(crate) fn complete(&mut self, rows: &Linearized, lambda: &[f64], bodies: usize) {
        let mut exact = vec![Matrix3::zeros(); bodies];
        for (s, slot) in rows.slots.iter().enumerate() {
            let (r, (force, _)) = (rows.lever(s), wrench(rows, s, lambda));
            let product = force * r.transpose();
            let symmetric = 0.5 * (product + product.transpose());
            exact[slot.body] += Matrix3::from_diagonal_element(force.dot(&r)) - symmetric;
        }
        for (i, exact) in exact.into_iter().enumerate() {
            self.add_positive(i, exact - unpacked(self.stiffness.get(i)));
        }
    }

    /// Adds the positive part of a symmetric matrix to K of a body.
    pub(crate) fn add_positive(&mut self, body: usize, k: Matrix3<f64>) {
        if k.iter().all(|k| k.is_finite()) {
            let mut eigen = k.symmetric_eigen();
            eigen.eigenvalues.apply(|k| *k = k.max(0.0));
            self.stiffness.add(body, packed(&eigen.recompose()));
        }
    }
}

/// The angular velocities g of the term Δt² K g on the right-hand side of the velocity change: `now` and `before` are
/// the bodies' velocities, `gamma` the scheme's weight of the third difference over that of K. Only the angular numbers of
/// g are set.
pub(crate) fn drive(
    form: GeometricStiffness,
    gamma: f64,
    now: &BodyVectors,
    before: &BodyVectors,
    g: &mut BodyVectors,
) {
    match form {
        GeometricStiffness::Off => g.clear(),
        GeometricStiffness::Inertia { alpha } => {
            g.combine_last((gamma * alpha, now), (-gamma * alpha, before));
        }
    }
}

/// Bending stiffness of a rigid joint \[N m]; its square is finite.
const RIGID: f64 = 1e150;

/// Stiffness by which a joint resists that a twist moment bends it \[N m]; [`RIGID`] for a joint
/// that cannot bend or has no twist in its last row.
fn bending(c: &Constraint) -> f64 {
    let mut parts = c.parts().filter(|(_, rows, _)| *rows > 0);
    let law = parts.find_map(|(kind, _, law)| (kind == RowKind::Bend).then_some(law));
    match (law, parts.last()) {
        (Some(law), Some((RowKind::Twist, ..))) if c.rows() == 6 => {
            (1.0 / law.compliance).min(RIGID)
        }
        _ => RIGID,
    }
}

/// K of the joints.
struct Joints<'a> {
    rows: &'a Linearized,
    lambda: &'a [f64],
    bending: &'a [Numbers],
    excess: Option<Excess>,
    stiffness: &'a mut BodyVectors,
}

/// k (I − r rᵀ/r²).
#[inline(always)]
fn across<V: Lanes>(k: V, r: &Vec3<V>) -> [V; 6] {
    // Without a lever there is no torque; the least number keeps 0/0 out.
    let along = k / (dot(r, r) + V::splat(f64::MIN_POSITIVE));
    let [x, y, z] = *r;
    [
        (x * along).neg_mul_add(x, k),
        -(x * along * y),
        -(x * along * z),
        (y * along).neg_mul_add(y, k),
        -(y * along * z),
        (z * along).neg_mul_add(z, k),
    ]
}

/// β of both sides of joints with the twist moments `twist`, F c of `bends` and E t of `tension`; `None` where it is zero.
#[inline(always)]
fn beyond<V: Lanes>(twist: V, bends: V, tension: [V; 2]) -> Option<[V; 2]> {
    let (half, least) = (V::splat(0.5) * twist, V::splat(f64::MIN_POSITIVE));
    let (square, slack) = (half * half, tension[0].min(tension[1]));
    if square.all_below((bends + bends + slack).mul_add(slack, least)) {
        return None;
    }
    let needed = square / (bends.mul_add(bends, square).sqrt() + bends + least);
    let zero = V::splat(0.0);
    let [a, b] = tension;
    Some([(needed - a).max(zero), (needed - b).max(zero)])
}

impl WideKernel for Joints<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) {
        let mut stiffness = self.stiffness.view_mut();
        for (k, joints) in self.rows.joint_lanes::<L>().enumerate() {
            let [x, y, z, _, _, twist] = joints.rows_of::<V>(self.lambda);
            let arms = [joints.arm(0), joints.arm(1)];
            let zero = V::splat(0.0);
            let on_a = dot(&[x, y, z], &arms[0]).max(zero);
            let on_b = dot(&[-x, -y, -z], &arms[1]).max(zero);
            let mut k_a = across(on_a, &arms[0]);
            let mut k_b = across(on_b, &arms[1]);
            if let Some(Excess { bends, tension }) = self.excess {
                let first = k * L;
                let bending = part::<_, L>(&self.bending[first / PACK], first % PACK);
                let bends = V::load(bending) * V::splat(bends);
                let factor = V::splat(tension);
                let tension = [on_a * factor, on_b * factor];
                if let Some([on_a, on_b]) = beyond(twist, bends, tension) {
                    let axis = joints.gradient(2);
                    let (more_a, more_b) = (across(on_a, &axis), across(on_b, &axis));
                    for n in 0..6 {
                        k_a[n] = k_a[n] + more_a[n];
                        k_b[n] = k_b[n] + more_b[n];
                    }
                }
            }
            joints.add_to_sides([&k_a, &k_b], &mut stiffness);
        }
    }
}

/// Force (N) and torque about the centre (N m) of multipliers `lambda` on the body of slot `s`.
pub(crate) fn wrench(rows: &Linearized, s: usize, lambda: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    let range = rows.row_range(rows.slots[s].constraint);
    let Wrench { force, torque } = Wrench::of_rows(rows.block(s).rows(), &lambda[range]);
    (force, torque)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;
    use nalgebra::{DMatrix, DVector};

    /// The angular part of body `i`.
    fn angular(of: &BodyVectors, i: usize) -> Vector3<f64> {
        let [.., x, y, z] = of.get(i);
        Vector3::new(x, y, z)
    }

    /// −∂(torque of fixed forces)/∂θ of a hanging cable, by central differences, is K.
    #[test]
    fn stiffness_is_the_derivative_of_the_torque_of_a_taut_cable() {
        let scene = HoistParams::default().with(|p| p.load_offset = 0.3);
        let mut scene = scene.hanging_equilibrium().unwrap();
        let mut rows = Linearized::new(&scene);
        rows.update(&scene, 0.0);
        let mu = rows.phi.iter();
        let mu: Vec<f64> = mu.zip(&rows.compliance).map(|(phi, e)| -phi / e).collect();
        let mut geometric = Geometric::new(&scene, &rows);
        geometric.update(&rows, &mu, None);
        let torque = |rows: &Linearized, body: usize| {
            let mut p = BodyVectors::new(25);
            rows.add_transposed(&mu, &mut p);
            angular(&p, body)
        };
        for body in [0, 11, 24] {
            let k = unpacked(geometric.stiffness().get(body));
            assert!(k.norm() > 1.0);
            for axis in 0..3 {
                let h = 1e-5;
                let mut difference = Vector3::zeros();
                for sign in [1.0, -1.0] {
                    let at = scene.bodies.orientation[body];
                    let mut turn = Vector3::zeros();
                    turn[axis] = sign * h;
                    scene.bodies.orientation[body] = UnitQuaternion::from_scaled_axis(turn) * at;
                    rows.update(&scene, 0.0);
                    difference += torque(&rows, body) * sign;
                    scene.bodies.orientation[body] = at;
                }
                let exact = -difference / (2.0 * h);
                let error = (k.column(axis) - exact).norm();
                assert!(error < 1e-6 * k.norm(), "body {body} axis {axis}: {error}");
            }
        }
        update_windings(&mut scene, 0.0);
    }

    /// A load of weight W whose two slings hold it h above its centre rocks about their ends against W h, though each
    /// sling alone pulls inwards.
    #[test]
    fn a_load_rocks_about_its_slings_against_its_weight() {
        let (weight, h) = (50.0, 0.5);
        let mut scene = Scene::new("slings");
        scene.add_body("load", Body::sphere(1.0, 5.0));
        for side in [-1.0, 1.0] {
            let ends = vec![
                Frame::world(Vector3::z() * 1.5),
                Frame::body(0, Vector3::new(side, 0.0, h)),
            ];
            let sling = MasslessCable::new(ends, 1.0, RowLaw::RIGID);
            scene.add_constraint("sling", Constraint::MasslessCable(sling), 0);
        }
        let mut rows = Linearized::new(&scene);
        rows.update(&scene, 0.0);
        let lambda = [-weight / 2.0_f64.sqrt(); 2];
        let mut geometric = Geometric::new(&scene, &rows);
        geometric.update(&rows, &lambda, None);
        assert_eq!(geometric.stiffness, BodyVectors::new(1));
        geometric.complete(&rows, &lambda, 1);
        let k = unpacked(geometric.stiffness().get(0));
        let exact = Matrix3::from_diagonal(&Vector3::new(weight * h, 0.0, 0.0));
        assert!((k - exact).norm() < 1e-13 * weight, "{k}");
    }

    /// Bending, and what is left of it and of the tension beside what alternates.
    const EXCESS: Excess = Excess {
        bends: 0.2,
        tension: 0.2,
    };

    /// A straight cable of EI = 30 N m², 8 segments of 0.25 m, with the forces of 400 N tension and of a torque (N m).
    fn twisted(torque: f64) -> (Scene, Linearized, Vec<f64>) {
        let params = taut_model::SpecimenParams::new(taut_model::Specimen::Twist)
            .with(|p| (p.segments, p.length, p.ei) = (8, 2.0, Some(30.0)));
        let scene = params.build().unwrap();
        let mut rows = Linearized::new(&scene);
        rows.update(&scene, 0.0);
        let lambda = (0..scene.constraints.len()).flat_map(|_| [400.0, 0.0, 0.0, 0.0, 0.0, torque]);
        let lambda = lambda.collect();
        (scene, rows, lambda)
    }

    /// −∂(torques of fixed multipliers)/∂θ of all bodies by central differences, its symmetric part.
    fn derivative(scene: &mut Scene, rows: &mut Linearized, lambda: &[f64]) -> DMatrix<f64> {
        let (n, h) = (scene.bodies.len(), 1e-5);
        let mut k = DMatrix::zeros(3 * n, 3 * n);
        for (column, sign) in (0..3 * n).flat_map(|c| [(c, 1.0), (c, -1.0)]) {
            let (body, mut turn) = (column / 3, Vector3::zeros());
            turn[column % 3] = sign * h;
            let at = scene.bodies.orientation[body];
            scene.bodies.orientation[body] = UnitQuaternion::from_scaled_axis(turn) * at;
            rows.update(scene, 0.0);
            scene.bodies.orientation[body] = at;
            let mut p = BodyVectors::new(n);
            rows.add_transposed(lambda, &mut p);
            for i in 0..n {
                let torque = angular(&p, i) * (sign / (2.0 * h));
                let mut block = k.fixed_view_mut::<3, 1>(3 * i, column);
                block -= torque;
            }
        }
        rows.update(scene, 0.0);
        (&k + k.transpose()) * 0.5
    }

    /// Modes that alternate from step to step are resisted by E K of the tension, by F K_b of the
    /// bends and by the twist moments' part of K. Together they outweigh the explicit effect of the
    /// moments; without the last part they do not.
    #[test]
    fn twist_moments_are_outweighed() {
        for torque in [60.0, -120.0, 230.0, 2000.0] {
            let (mut scene, mut rows, lambda) = twisted(torque);
            let n = scene.bodies.len();
            let exact = derivative(&mut scene, &mut rows, &lambda);
            let mut geometric = Geometric::new(&scene, &rows);
            let mut least = |excess: Option<Excess>| {
                geometric.update(&rows, &lambda, None);
                let tension = geometric.stiffness().clone();
                geometric.update(&rows, &lambda, excess);
                // The derivative less the tension's is the moments'.
                let mut sum = -exact.clone();
                for i in 0..n {
                    let (all, tension) = (geometric.stiffness().get(i), tension.get(i));
                    let mut block = sum.fixed_view_mut::<3, 3>(3 * i, 3 * i);
                    block += unpacked(all) + unpacked(tension) * EXCESS.tension;
                }
                for r in (0..rows.rows()).filter(|r| r % 6 == 3 || r % 6 == 4) {
                    let slots = rows.slot_range(r / 6);
                    let mut row = DVector::zeros(3 * n);
                    for s in slots {
                        let j = rows.block(s).rows()[r % 6];
                        let at = 3 * rows.slots[s].body;
                        row.rows_mut(at, 3).copy_from_slice(&j[3..]);
                    }
                    sum += &row * row.transpose() * (EXCESS.bends / rows.compliance[r]);
                }
                sum.symmetric_eigenvalues().min() / torque.abs()
            };
            assert!(least(None) < -0.03, "{torque}: {}", least(None));
            let found = least(Some(EXCESS));
            assert!(found > -1e-6, "{torque}: {}", least(Some(EXCESS)));
        }
    }

    /// The scheme takes the angle at θ_n + a δ²θ + γ δ³θ, with backward differences that end at t_{n+1}; what Δω does not
    /// multiply is the drive.
    #[test]
    fn the_drive_is_the_history_of_the_third_difference() {
        let (a, gamma, dt) = (0.7, -0.15, 0.1);
        let scheme = crate::Scheme::ThirdDifference { a, gamma };
        let scene = HoistParams::default().build().unwrap();
        // θ of one body at t_{n−2} … t_{n+1}, about each axis.
        let angles = [
            [0.3, -0.1, 0.2],
            [0.1, 0.4, -0.5],
            [0.25, 0.2, 0.9],
            [-0.4, 0.7, 0.1],
        ];
        let bodies = BodyVectors::new(scene.bodies.len());
        let omega = |k: usize| {
            let [x, y, z] = std::array::from_fn(|i| (angles[k + 1][i] - angles[k][i]) / dt);
            let mut all = bodies.clone();
            all.set(0, [0.0, 0.0, 0.0, x, y, z]);
            all
        };
        let (before, now, next) = (omega(0), omega(1), omega(2));
        let mut g = bodies.clone();
        let alpha = scheme.default_alpha();
        let form = GeometricStiffness::Inertia { alpha };
        drive(form, scheme.weights().history(), &now, &before, &mut g);
        for i in [0, 1, 2] {
            let [t0, t1, t2, t3] = std::array::from_fn(|k| angles[k][i]);
            let taken = a * (t3 - 2.0 * t2 + t1) + gamma * (t3 - 3.0 * t2 + 3.0 * t1 - t0);
            let change = next.get(0)[3 + i] - now.get(0)[3 + i];
            let ours = dt * (alpha * change - g.get(0)[3 + i]);
            assert!((ours - taken).abs() < 1e-14, "{ours} {taken}");
        }
    }
}
