//! Geometric stiffness of stretch rows: how the torque r × F of an attachment changes when the body, and with it the
//! lever arm r, turns under a constraint force F.
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

use crate::GeometricStiffness;
use crate::six::Six;
use nalgebra::Vector3;
use taut_lanes::vector::{Vec3, dot, load};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
use taut_model::{Abreast, Linearized, Scene, Side};

/// K of all bodies, and the angular velocities that the relative form refers to.
#[derive(Debug, Clone)]
pub(crate) struct Geometric {
    /// K of each body, in the world frame \[N m]: xx, yx, zx, yy, zy, zz.
    stiffness: Six,
    /// Group of each body: that of its first constraint; `None` for a body without one.
    group: Vec<Option<usize>>,
    /// Each group's first and last constraint: the chord's ends.
    chords: Vec<(usize, usize)>,
    /// Angular velocity of each chord \[rad/s].
    turning: Vec<Vector3<f64>>,
    /// Velocity of each body as a part of its chord; the angular part alone has a meaning.
    reference: Six,
}

impl Geometric {
    pub(crate) fn new(scene: &Scene, rows: &Linearized) -> Self {
        let mut names: Vec<u32> = scene.groups.clone();
        names.sort_unstable();
        names.dedup();
        let index = |c: usize| names.binary_search(&scene.groups[c]).unwrap_or(0);
        let mut group = vec![None; scene.bodies.len()];
        for slot in &rows.slots {
            group[slot.body].get_or_insert(index(slot.constraint));
        }
        let mut chords = vec![(usize::MAX, 0); names.len()];
        for c in 0..scene.constraints.len() {
            let (first, last) = &mut chords[index(c)];
            *first = (*first).min(c);
            *last = c;
        }
        Self {
            stiffness: Six::new(scene.bodies.len()),
            reference: Six::new(scene.bodies.len()),
            group,
            turning: vec![Vector3::zeros(); chords.len()],
            chords,
        }
    }

    /// K of each body: xx, yx, zx, yy, zy, zz.
    pub(crate) fn stiffness(&self) -> &Six {
        &self.stiffness
    }

    /// No stiffness.
    pub(crate) fn clear(&mut self) {
        self.stiffness.clear();
    }

    /// K from multipliers λ (N), at the attachments as linearised.
    pub(crate) fn update(&mut self, rows: &Linearized, lambda: &[f64]) {
        self.clear();
        let joints = Joints {
            joints: &rows.abreast,
            lambda,
            stiffness: &mut self.stiffness,
        };
        dispatch(Level::best(), joints);
        for s in rows.others().iter().flat_map(|&c| rows.slot_range(c)) {
            let r = rows.lever(s);
            let square = r.norm_squared();
            if square == 0.0 {
                continue;
            }
            let (force, _) = wrench(rows, s, lambda);
            let tension = force.dot(&r);
            if tension > 0.0 {
                let along = r * (tension / square);
                let k = [
                    tension - along.x * r.x,
                    -along.x * r.y,
                    -along.x * r.z,
                    tension - along.y * r.y,
                    -along.y * r.z,
                    tension - along.z * r.z,
                ];
                self.stiffness.add(rows.slots[s].body, k);
            }
        }
    }

    /// Angular velocity of the chord of each group, from the first constraint's first side to the last one's last.
    pub(crate) fn update_chords(&mut self, scene: &Scene, t: f64, dt: f64) {
        let bodies = &scene.bodies;
        for (turning, &(first, last)) in self.turning.iter_mut().zip(&self.chords) {
            let a = scene.constraints[first].frames().first();
            let b = scene.constraints[last].frames().last();
            let (Some(a), Some(b)) = (a, b) else {
                continue;
            };
            let end = |frame: &taut_model::Frame| match frame.side {
                Side::Body(i) => (bodies.position[i], bodies.velocity[i]),
                Side::World(motion) => (
                    frame.point + motion.displacement(t),
                    (motion.displacement(t) - motion.displacement(t - dt)) / dt,
                ),
            };
            let ((xa, va), (xb, vb)) = (end(a), end(b));
            let chord = xb - xa;
            let square = chord.norm_squared();
            *turning = if square > 0.0 {
                chord.cross(&(vb - va)) / square
            } else {
                Vector3::zeros()
            };
        }
        for (i, group) in self.group.iter().enumerate() {
            let turning = group.map_or_else(Vector3::zeros, |g| self.turning[g]);
            let reference = [0.0, 0.0, 0.0, turning.x, turning.y, turning.z];
            self.reference.set(i, reference);
        }
    }

    /// The angular velocities g of the term Δt² K g on the right-hand side of the velocity change: `now` and `before` are
    /// the bodies' velocities, `gamma` the scheme's weight of the third difference over that of K.
    pub(crate) fn drive(
        &self,
        form: GeometricStiffness,
        gamma: f64,
        now: &Six,
        before: &Six,
        g: &mut Six,
    ) {
        match form {
            GeometricStiffness::Off => g.clear(),
            GeometricStiffness::Inertia { alpha } => {
                g.combine((gamma * alpha, now), (-gamma * alpha, before));
            }
            GeometricStiffness::Relative { alpha } => {
                g.combine((alpha, &self.reference), (-alpha, now));
            }
        }
    }
}

/// K of the joints.
struct Joints<'a> {
    joints: &'a Abreast,
    lambda: &'a [f64],
    stiffness: &'a mut Six,
}

/// max(F·r, 0) (I − r rᵀ/r²).
#[inline(always)]
fn across<V: Lanes>(force: &Vec3<V>, r: &Vec3<V>) -> [V; 6] {
    let tension = dot(force, r).max(V::splat(0.0));
    // Without a lever there is no torque; the least number keeps 0/0 out.
    let along = tension / (dot(r, r) + V::splat(f64::MIN_POSITIVE));
    let [x, y, z] = *r;
    [
        (x * along).neg_mul_add(x, tension),
        -(x * along * y),
        -(x * along * z),
        (y * along).neg_mul_add(y, tension),
        -(y * along * z),
        (z * along).neg_mul_add(z, tension),
    ]
}

impl Kernel for Joints<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let mut stiffness = self.stiffness.view_mut();
        for (pack, places) in self.joints.packs() {
            let [x, y, z, ..] = places.rows_of::<I::X4>(self.lambda);
            let on_a = across(&[x, y, z], &load(&pack.arms[0]));
            let on_b = across(&[-x, -y, -z], &load(&pack.arms[1]));
            stiffness.add_sides(places, [&on_a, &on_b]);
        }
    }
}

/// Force (N) and torque (N m) of multipliers `lambda` on the body of slot `s`.
pub(crate) fn wrench(rows: &Linearized, s: usize, lambda: &[f64]) -> (Vector3<f64>, Vector3<f64>) {
    let range = rows.row_range(rows.slots[s].constraint);
    let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
    for (j, lambda) in rows.block(s).rows().iter().zip(&lambda[range]) {
        force += Vector3::new(j[0], j[1], j[2]) * *lambda;
        torque += Vector3::new(j[3], j[4], j[5]) * *lambda;
    }
    (force, torque)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::unpacked;
    use nalgebra::UnitQuaternion;
    use taut_model::{HoistParams, update_windings};

    /// The angular part of body `i`.
    fn angular(of: &Six, i: usize) -> Vector3<f64> {
        let [.., x, y, z] = of.get(i);
        Vector3::new(x, y, z)
    }

    /// −∂(torque of fixed forces)/∂θ of a hanging cable, by central differences, is K.
    #[test]
    fn stiffness_is_the_derivative_of_the_torque_of_a_taut_cable() {
        let mut scene = HoistParams {
            load_offset: 0.3,
            ..HoistParams::default()
        }
        .hanging_equilibrium()
        .unwrap();
        let mut rows = Linearized::new(&scene);
        rows.update(&scene, 0.0);
        let mu: Vec<f64> = rows
            .phi
            .iter()
            .zip(&rows.compliance)
            .map(|(phi, e)| -phi / e)
            .collect();
        let mut geometric = Geometric::new(&scene, &rows);
        geometric.update(&rows, &mu);
        let torque = |rows: &Linearized, body: usize| {
            let mut p = Six::new(25);
            crate::products::add_transposed(rows, &mu, &mut p);
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

    #[test]
    fn a_pushed_body_has_none() {
        let scene = HoistParams::default().hanging_equilibrium().unwrap();
        let mut rows = Linearized::new(&scene);
        rows.update(&scene, 0.0);
        let pushed: Vec<f64> = rows.phi.clone();
        let mut geometric = Geometric::new(&scene, &rows);
        geometric.update(&rows, &pushed);
        assert_eq!(geometric.stiffness, Six::new(25));
    }

    #[test]
    fn the_chord_turns_with_a_rigid_swing() {
        let mut scene = HoistParams::default().hanging_equilibrium().unwrap();
        let omega = Vector3::new(0.2, -0.3, 0.0);
        for i in 0..scene.bodies.len() {
            scene.bodies.velocity[i] = omega.cross(&scene.bodies.position[i]);
        }
        let rows = Linearized::new(&scene);
        let mut geometric = Geometric::new(&scene, &rows);
        geometric.update_chords(&scene, 0.0, 0.1);
        assert!((angular(&geometric.reference, 3) - omega).norm() < 1e-12);
    }
}
