//! Effect of splits and merges of segments on the energy of their cable.
//!
//! With u the rate of the second segment against the first at their joint (velocity and angular velocity) and K = J M⁻¹ Jᵀ the
//! inverse of their reduced inertia there, the blow of a merge takes ½ uᵀ K⁻¹ u. Then the two move as one, and come into one
//! line: ½ Lᵀ I⁻¹ L changes with their inertia and their centre. About the axis of a merged segment the spins are kept instead
//! of the angular momentum about the bent pair's chord, which a thin rod would have to take up by spinning (ℓ/r)² times faster.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::Neighbours;
use crate::body::Body;
use crate::scene::Scene;

/// Change of the energy of a cable by a split or a merge \[J].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Jump {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Kinetic energy that the blow of a merge is foreseen to take, −½ uᵀ K⁻¹ u.
    pub blow: f64,
    /// Kinetic energy that the displacement of the segments is foreseen to add, at given momenta.
    pub moved: f64,
    /// Angular momentum about the axis of the segments that is not kept, its size \[N m s].
    pub unspun: f64,
    /// Potential energy of gravity.
    pub gravity: f64,
}

impl std::ops::AddAssign for Jump {
    fn add_assign(&mut self, other: Self) {
        self.kinetic += other.kinetic;
        self.blow += other.blow;
        self.moved += other.moved;
        self.unspun += other.unspun;
        self.gravity += other.gravity;
    }
}

impl Scene {
    /// Kinetic energy, and that of gravity, of two bodies \[J].
    pub(super) fn energies(&self, pair: &[usize]) -> [f64; 2] {
        let bodies = &self.bodies;
        let gravity = |i: usize| -bodies.mass[i] * self.gravity.dot(&bodies.position[i]);
        [
            pair.iter().map(|i| bodies.kinetic_energy(*i)).sum(),
            pair.iter().map(|i| gravity(*i)).sum(),
        ]
    }

    /// Centre of bodies \[m], and their inertia about it, world \[kg m²].
    pub(super) fn as_one(&self, all: &[usize]) -> (Vector3<f64>, Matrix3<f64>) {
        let bodies = &self.bodies;
        let mass: f64 = all.iter().map(|i| bodies.mass[*i]).sum();
        let parts = all
            .iter()
            .map(|i| bodies.position[*i] * (bodies.mass[*i] / mass));
        let centre: Vector3<f64> = parts.sum();
        let inertia = all.iter().map(|i| {
            let r = bodies.position[*i] - centre;
            let point = Matrix3::from_diagonal_element(r.norm_squared()) - r * r.transpose();
            bodies.inertia_world(*i) + point * bodies.mass[*i]
        });
        (centre, inertia.sum())
    }

    /// Change of the rotational energy ½ Lᵀ I⁻¹ L \[J] when two segments that move as one about
    /// their centre become a rod of their masses in the pose of `rod`; and the angular momentum
    /// about the rod that is lost \[N m s]. The rod keeps their angular momentum across it, and
    /// their own spins about it.
    pub(super) fn straightened(&self, pair: &[Neighbours; 2], rod: &Body) -> [f64; 2] {
        let bodies = &self.bodies;
        let (centre, inertia) = self.as_one(&pair.map(|p| p.body));
        let about = |point: &Vector3<f64>| {
            let angular = pair.iter().map(|p| {
                let orbital = (bodies.position[p.body] - point).cross(&bodies.velocity[p.body]);
                let spin = bodies.inertia_world(p.body) * bodies.angular_velocity[p.body];
                orbital * bodies.mass[p.body] + spin
            });
            angular.sum::<Vector3<f64>>()
        };
        let (before, after) = (about(&centre), about(&rod.position));
        let axis = rod.orientation * pair[0].along;
        let [across, along] = [rod.inertia[(0, 0)], rod.inertia[(2, 2)]];
        let spins = pair.iter().map(|p| {
            let own = bodies.orientation[p.body] * p.along;
            bodies.inertia[p.body][(2, 2)] * own.dot(&bodies.angular_velocity[p.body])
        });
        let spin: f64 = spins.sum();
        let bent = inertia.try_inverse().unwrap_or_default();
        let (turning, about_rod) = (after - axis * axis.dot(&after), axis.dot(&after));
        let rotation = 0.5 * (turning.norm_squared() / across + spin * spin / along);
        let change = rotation - 0.5 * before.dot(&(bent * before));
        [change, (about_rod - spin).abs()]
    }

    /// ½ uᵀ K⁻¹ u of the two bodies of a joint \[J]: the energy of a blow that makes them one.
    pub(super) fn blow(&self, joint: usize) -> f64 {
        let (bodies, mut u, mut k) = (&self.bodies, Vector6::zeros(), Matrix6::zeros());
        let frames = self.constraints[joint].frames();
        // Both at one point, whatever the gap.
        let Some(point) = frames.first().and_then(|frame| {
            let body = frame.body_index()?;
            Some(bodies.point_world(body, &frame.point))
        }) else {
            return 0.0;
        };
        for (frame, sign) in frames.iter().zip([-1.0, 1.0]) {
            let Some(body) = frame.body_index() else {
                continue;
            };
            let r = point - bodies.position[body];
            let omega = bodies.angular_velocity[body];
            let rate = bodies.velocity[body] + omega.cross(&r);
            u += Vector6::from_iterator(rate.iter().chain(&omega).map(|x| sign * x));
            let inverse = bodies.inertia_world(body).try_inverse();
            let (inverse, lever) = (inverse.unwrap_or_default(), r.cross_matrix());
            let mass = Matrix3::from_diagonal_element(1.0 / bodies.mass[body]);
            let (above, beside) = (mass - lever * inverse * lever, -lever * inverse);
            let below = [(3, 0, inverse * lever), (3, 3, inverse)];
            for (row, column, part) in [(0, 0, above), (0, 3, beside)].into_iter().chain(below) {
                let mut sum = k.fixed_view_mut::<3, 3>(row, column);
                sum += part;
            }
        }
        k.cholesky().map_or(f64::NAN, |k| 0.5 * u.dot(&k.solve(&u)))
    }
}
