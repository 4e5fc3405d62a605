//! Rigid bodies as a structure of arrays.
//!
//! State of body i: centre of mass x (m), unit quaternion e (body to world), velocity v (m/s) and angular velocity
//! ω (rad/s), all in the world frame. Mass m (kg) and inertia (kg m², body frame, about the centre of mass).

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Cause of a body's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Mobility {
    /// Forces and constraints.
    #[default]
    Dynamic,
    /// Nothing: it stays in its pose. Mass and inertia take no part.
    Static,
    /// Its prescribed velocities, whatever the forces. Mass and inertia take no part.
    Driven,
}

/// The quantities of bodies: each with its meaning and its type.
macro_rules! quantities {
    ($($(#[doc = $meaning:literal])* $quantity:ident: $type:ty,)*) => {
        /// One body's worth of [`Bodies`]: what [`Bodies::push`] takes.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Body {
            $(
                $(#[doc = $meaning])*
                pub $quantity: $type,
            )*
        }

        /// All bodies of a scene; every vector has one entry a body, in the order of [`Bodies::push`]. Methods of body `i`
        /// panic where `i` is not below [`Bodies::len`].
        #[derive(Debug, Clone, PartialEq, Default)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
        pub struct Bodies {
            $(
                $(#[doc = $meaning])*
                pub $quantity: Vec<$type>,
            )*
        }

        impl Bodies {
            /// Appends a body and returns its index.
            pub fn push(&mut self, body: Body) -> usize {
                $(self.$quantity.push(body.$quantity);)*
                self.len() - 1
            }

            /// Body `i` becomes another.
            pub(crate) fn put(&mut self, i: usize, body: Body) {
                $(self.$quantity[i] = body.$quantity;)*
            }

            /// A copy of body `i`.
            #[must_use]
            pub fn get(&self, i: usize) -> Body {
                Body {
                    $($quantity: self.$quantity[i],)*
                }
            }

            /// Keeps the bodies whose numbers `keep` is true of.
            pub(crate) fn retain(&mut self, keep: impl Fn(usize) -> bool) {
                $(
                    let mut numbers = 0..;
                    self.$quantity.retain(|_| numbers.next().is_none_or(&keep));
                )*
            }

            /// Moves the last body to number `at`.
            pub(crate) fn move_last(&mut self, at: usize) {
                $(last_to(&mut self.$quantity, at);)*
            }

            /// The lengths of its vectors, by their names.
            pub(crate) fn lengths(&self) -> impl Iterator<Item = (&'static str, usize)> {
                [$((concat!("bodies.", stringify!($quantity)), self.$quantity.len())),*].into_iter()
            }
        }
    };
}

quantities! {
    /// Cause of its motion.
    mobility: Mobility,
    /// Centre of mass, world \[m].
    position: Vector3<f64>,
    /// Rotation from the body frame to the world frame.
    orientation: UnitQuaternion<f64>,
    /// Velocity of the centre of mass, world \[m/s].
    velocity: Vector3<f64>,
    /// Angular velocity, world \[rad/s].
    angular_velocity: Vector3<f64>,
    /// Mass \[kg], > 0.
    mass: f64,
    /// Inertia about the centre of mass, body frame \[kg m²], symmetric positive definite; zero for a point mass.
    inertia: Matrix3<f64>,
    /// External force at the centre of mass besides gravity, world \[N].
    force: Vector3<f64>,
    /// External torque, world \[N m].
    torque: Vector3<f64>,
}

impl Body {
    /// A body of `mass` \[kg] and `inertia` (about its centre, body frame, \[kg m²]) at rest at the origin, with the body
    /// frame along the world's.
    #[must_use]
    pub fn new(mass: f64, inertia: Matrix3<f64>) -> Self {
        Self {
            mobility: Mobility::Dynamic,
            position: Vector3::zeros(),
            orientation: UnitQuaternion::identity(),
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
            mass,
            inertia,
            force: Vector3::zeros(),
            torque: Vector3::zeros(),
        }
    }

    /// A point mass, `mass` in kg: it has no inertia and never turns. Links, massless cables, bends of links and ball joints
    /// hold it, at its centre.
    #[must_use]
    pub fn particle(mass: f64) -> Self {
        Self::new(mass, Matrix3::zeros())
    }

    /// A solid cylinder with its axis along the body's z axis: a cable segment, a drum.
    ///
    /// `length` and `radius` in m, `mass` in kg. I_z = ½ m r², I_x = I_y = m (3 r² + l²)/12.
    #[must_use]
    pub fn rod(length: f64, radius: f64, mass: f64) -> Self {
        let across = mass * (3.0 * radius * radius + length * length) / 12.0;
        let along = 0.5 * mass * radius * radius;
        Self::new(mass, diagonal(across, across, along))
    }

    /// A solid sphere, `radius` in m, `mass` in kg. I = ⅖ m r².
    #[must_use]
    pub fn sphere(radius: f64, mass: f64) -> Self {
        let inertia = 0.4 * mass * radius * radius;
        Self::new(mass, diagonal(inertia, inertia, inertia))
    }

    /// A body that stays where it is: foundations, a crane's frame. Its mass of 1 kg and its inertia take no part.
    #[must_use]
    pub fn fixed() -> Self {
        Self {
            mobility: Mobility::Static,
            ..Self::new(1.0, Matrix3::identity())
        }
    }

    /// A solid box with edge lengths `size` (m) along the body axes, `mass` in kg. I_x = m (s_y² + s_z²)/12.
    #[must_use]
    pub fn cuboid(size: Vector3<f64>, mass: f64) -> Self {
        let sq = size.component_mul(&size) * (mass / 12.0);
        Self::new(mass, diagonal(sq.y + sq.z, sq.z + sq.x, sq.x + sq.y))
    }

    /// Moves the centre of mass to `position` (world, m).
    #[must_use]
    pub fn at(mut self, position: Vector3<f64>) -> Self {
        self.position = position;
        self
    }

    /// Turns the body to `orientation`, from body to world.
    #[must_use]
    pub fn turned(mut self, orientation: UnitQuaternion<f64>) -> Self {
        self.orientation = orientation;
        self
    }
}

/// Moves the last of the items to number `at`.
pub(crate) fn last_to<T>(items: &mut Vec<T>, at: usize) {
    if let Some(last) = items.pop() {
        items.insert(at, last);
    }
}

fn diagonal(x: f64, y: f64, z: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(x, y, z))
}

impl Bodies {
    /// Velocity \[m/s] and angular velocity \[rad/s] of body `i`, world, one after the other.
    #[must_use]
    pub fn rates(&self, i: usize) -> [f64; 6] {
        let (v, w) = (&self.velocity[i], &self.angular_velocity[i]);
        [v.x, v.y, v.z, w.x, w.y, w.z]
    }

    /// No bodies.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Number of bodies.
    #[must_use]
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True if there are no bodies.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// True if forces and constraints move body `i`; static and driven bodies are as heavy as the
    /// world.
    #[must_use]
    pub fn is_dynamic(&self, i: usize) -> bool {
        self.mobility[i] == Mobility::Dynamic
    }

    /// True if body `i` is dynamic and a point mass: it never turns and has three degrees of
    /// freedom.
    #[must_use]
    pub fn is_point(&self, i: usize) -> bool {
        self.is_dynamic(i) && self.inertia[i] == Matrix3::zeros()
    }

    /// Rotation matrix R of body `i`, body to world.
    #[must_use]
    pub fn rotation(&self, i: usize) -> Matrix3<f64> {
        self.orientation[i].to_rotation_matrix().into_inner()
    }

    /// Inertia of body `i` in the world frame, R I Rᵀ \[kg m²].
    #[must_use]
    pub fn inertia_world(&self, i: usize) -> Matrix3<f64> {
        let r = self.rotation(i);
        r * self.inertia[i] * r.transpose()
    }

    /// ω + ½ `dt` ω̇ of body `i`, which turns freely, I ω̇ = I ω × ω: its mean angular velocity over `dt` (s) to second order
    /// \[rad/s]. That of a driven body or a point mass is ω.
    pub(crate) fn mean_spin(&self, i: usize, dt: f64) -> Vector3<f64> {
        let omega = self.angular_velocity[i];
        if !self.is_dynamic(i) {
            return omega;
        }
        let inertia = self.inertia_world(i);
        let torque = (inertia * omega).cross(&omega);
        let change = inertia.try_inverse().map(|inverse| inverse * torque);
        change
            .filter(|change| change.iter().all(|x| x.is_finite()))
            .map_or(omega, |change| omega + change * (0.5 * dt))
    }

    /// Kinetic energy of body `i` \[J], ½ m v·v + ½ ω·Iω.
    #[must_use]
    pub fn kinetic_energy(&self, i: usize) -> f64 {
        let omega = self.angular_velocity[i];
        0.5 * self.mass[i] * self.velocity[i].norm_squared()
            + 0.5 * omega.dot(&(self.inertia_world(i) * omega))
    }

    /// World position of the body-frame point `point` (m) of body `i` \[m].
    #[must_use]
    pub fn point_world(&self, i: usize, point: &Vector3<f64>) -> Vector3<f64> {
        self.position[i] + self.rotation(i) * point
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inertias_of_shapes() {
        let rod = Body::rod(2.0, 0.1, 3.0);
        assert!((rod.inertia[(2, 2)] - 0.5 * 3.0 * 0.01).abs() < 1e-15);
        assert!((rod.inertia[(0, 0)] - 3.0 * (0.03 + 4.0) / 12.0).abs() < 1e-15);
        let cube = Body::cuboid(Vector3::new(2.0, 2.0, 2.0), 6.0);
        assert!((cube.inertia - Matrix3::identity() * 4.0).norm() < 1e-14);
        let ball = Body::sphere(0.5, 2.0);
        assert!((ball.inertia[(1, 1)] - 0.2).abs() < 1e-15);
        assert_eq!(Body::particle(3.0).inertia, Matrix3::zeros());
    }

    #[test]
    fn push_and_get_round_trip() {
        let mut bodies = Bodies::new();
        assert!(bodies.is_empty());
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.2, 0.9));
        let body = Body::rod(1.0, 0.01, 2.0).at(Vector3::new(1.0, 2.0, 3.0));
        let body = body.turned(turn);
        let i = bodies.push(body);
        assert_eq!((i, bodies.len()), (0, 1));
        assert_eq!(bodies.get(0), body);
        // A turned inertia keeps trace and determinant.
        let world = bodies.inertia_world(0);
        assert!((world.trace() - body.inertia.trace()).abs() < 1e-14);
        assert!((world.determinant() - body.inertia.determinant()).abs() < 1e-16);
    }

    #[test]
    fn energy_of_a_spinning_sphere() {
        let mut ball = Body::sphere(1.0, 5.0);
        ball.velocity = Vector3::new(0.0, 2.0, 0.0);
        ball.angular_velocity = Vector3::new(1.0, 0.0, 1.0);
        let mut bodies = Bodies::new();
        bodies.push(ball);
        assert!((bodies.kinetic_energy(0) - (10.0 + 0.5 * 2.0 * 2.0)).abs() < 1e-14);
    }
}
