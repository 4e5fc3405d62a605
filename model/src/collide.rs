//! Shapes of bodies and of the world, and which of them can touch.
//!
//! A [`Collider`] is a [`Shape`] in a frame that is fixed to a body or to the world, with a [`Surface`]. Two colliders that
//! meet have the surface [`Surface::meet`]: friction √(μ₁ μ₂), the larger restitution and damping, and the sum of the
//! compliances, as of two springs in a row. A contact point is then a row with multiplier λ ≥ 0 and the gap g along the
//! normal: ε λ = −(g + τ ġ) where that is positive.
//!
//! # Pairs that never meet
//! - Neither has a dynamic body: nothing would move.
//! - Both are of the same body, or both of the world.
//! - A joint or link holds both bodies, or a bend does that is between them: at a point, along an axis, or at a constant
//!   distance. A cable without mass does not: a load that it hoists meets the jib that it hangs
//!   from. The world does not count as a body: a load on a rope from a point of the world lands on
//!   the ground.
//! - Both are segments of the same cable: a cable does not touch itself.
//! - The masks say no. They meet where each is a member of a group that the other meets:
//!
//! ```text
//! a.groups & b.meets ≠ 0   and   b.groups & a.meets ≠ 0
//! ```
//!
//! # Limits
//! Shapes are convex and there are no meshes: a body has as many colliders as it takes. The world's half-spaces are without
//! end, and no dynamic body has one. A point mass has spheres about its centre alone, for nothing turns it, and friction
//! acts at its centre.

use nalgebra::{UnitQuaternion, Vector3};

/// A convex solid in a frame of its own, with the origin at its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
#[non_exhaustive]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Radius \[m], > 0.
        radius: f64,
    },
    /// A box; `box` in a text.
    #[cfg_attr(feature = "serde", serde(rename = "box", alias = "cuboid"))]
    Cuboid {
        /// Edge lengths along x, y and z \[m], > 0.
        size: Vector3<f64>,
    },
    /// A cylinder along z with half a ball on each end.
    Capsule {
        /// Distance between the centres of the half balls \[m], ≥ 0.
        length: f64,
        /// Radius \[m], > 0.
        radius: f64,
    },
    /// A cylinder along z; `rod` in a text, too.
    #[cfg_attr(feature = "serde", serde(alias = "rod"))]
    Cylinder {
        /// Length \[m], > 0.
        length: f64,
        /// Radius \[m], > 0.
        radius: f64,
    },
    /// Everything below z = 0: the ground. Its normal is +z.
    HalfSpace,
}

impl Shape {
    /// Smallest and largest dimension \[m], with the half balls of a capsule; infinite of a half-space.
    #[must_use]
    pub fn dimensions(&self) -> [f64; 2] {
        match *self {
            Self::Sphere { radius } => [2.0 * radius; 2],
            Self::Cuboid { size } => [size.min(), size.max()],
            Self::Capsule { length, radius } => [2.0 * radius, length + 2.0 * radius],
            Self::Cylinder { length, radius } => {
                [length.min(2.0 * radius), length.max(2.0 * radius)]
            }
            Self::HalfSpace => [f64::INFINITY; 2],
        }
    }

    /// Radius of the ball about the origin of its frame that holds it \[m]; infinite of a half-space.
    #[must_use]
    pub fn reach(&self) -> f64 {
        match *self {
            Self::Sphere { radius } => radius,
            Self::Cuboid { size } => 0.5 * size.norm(),
            Self::Capsule { length, radius } => 0.5 * length + radius,
            Self::Cylinder { length, radius } => radius.hypot(0.5 * length),
            Self::HalfSpace => f64::INFINITY,
        }
    }
}

/// Properties of a shape's contact points.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Surface {
    /// Coefficient of friction μ, ≥ 0.
    pub friction: f64,
    /// Speed of separation over speed of approach, 0 to 1.
    pub restitution: f64,
    /// Compliance of a contact point \[m/N], ≥ 0; 0 is rigid.
    pub compliance: f64,
    /// Damping time of a contact point \[s], ≥ 0. That of critical damping counts where it is longer and the
    /// contact's compliance at most 10⁻⁸ m/N.
    pub damping: f64,
}

impl Default for Surface {
    /// Friction 0.5, no restitution, 10⁻¹⁰ m/N, 1 ms.
    fn default() -> Self {
        Self {
            friction: 0.5,
            restitution: 0.0,
            compliance: 1e-10,
            damping: 1e-3,
        }
    }
}

impl Surface {
    /// The surface of a contact between two: friction √(μ₁ μ₂), the larger restitution and damping time, and the sum of
    /// the compliances.
    #[must_use]
    pub fn meet(&self, other: &Self) -> Self {
        // The product of the roots: that of two frictions may overflow.
        let friction = if self.friction == other.friction {
            self.friction
        } else {
            self.friction.sqrt() * other.friction.sqrt()
        };
        // −0 + 0 = 0: a contact's numbers have no sign.
        Self {
            friction: friction + 0.0,
            restitution: self.restitution.max(other.restitution) + 0.0,
            compliance: self.compliance + other.compliance + 0.0,
            damping: self.damping.max(other.damping) + 0.0,
        }
    }
}

/// The group of a collider that names none, as a mask.
pub const DEFAULT_GROUP: u32 = 1;

/// A shape that is fixed to a body or to the world.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Collider {
    /// Its name, different from those of all other colliders.
    pub name: String,
    /// Number of the body that it is fixed to; `None`: the world.
    pub body: Option<usize>,
    /// Origin of the shape's frame, in the body's frame or the world's \[m].
    pub position: Vector3<f64>,
    /// Rotation from the shape's frame to the body's or the world's.
    pub orientation: UnitQuaternion<f64>,
    /// The shape.
    pub shape: Shape,
    /// Its surface.
    pub surface: Surface,
    /// Groups that it is a member of, a bit each.
    pub groups: u32,
    /// Groups whose members it meets, a bit each.
    pub meets: u32,
}

impl Collider {
    /// A shape at the centre of a body, or at the origin of the world where `body` is `None`, unturned, with the
    /// [default surface](Surface::default). It is a member of [`DEFAULT_GROUP`] and meets all groups.
    #[must_use]
    pub fn new(name: impl Into<String>, body: Option<usize>, shape: Shape) -> Self {
        Self {
            name: name.into(),
            body,
            position: Vector3::zeros(),
            orientation: UnitQuaternion::identity(),
            shape,
            surface: Surface::default(),
            groups: DEFAULT_GROUP,
            meets: u32::MAX,
        }
    }

    /// True if the groups of both let them meet.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        self.groups & other.meets != 0 && other.groups & self.meets != 0
    }
}

#[cfg(test)]
mod tests;
