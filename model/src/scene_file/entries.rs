//! Explicit scenes and their bodies, as they are written.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::build::{Entry, WORLD};
use super::cable::CableEntry;
use super::collide::{CollideEntry, ColliderEntry, GroundEntry};
use super::control::ControlEntry;
use super::event::EventEntry;
use super::joint::JointEntry;
use super::keys::described;
use super::places::{Fault, Places};
use super::points::{BendEntry, MasslessCableEntry};
use crate::body::{Body, Mobility};
use crate::collide;

described! {
    /// An explicit scene: bodies and constraints one by one. The format is explained in the module's documentation.
    #[serde(default)]
    pub struct SceneText {
        /// Name of the scene.
        pub name: String,
        /// Acceleration of gravity, world \[m/s²].
        pub gravity: [f64; 3],
        /// `true` starts from the static equilibrium near the pose given.
        pub equilibrium: bool,
        /// Name of the body that reports follow.
        pub load: Option<String>,
        /// Names of all constraints in their order. Default: the joints, then those of the cables, the massless cables and the
        /// bends, as listed.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pub order: Vec<String>,
        /// The bodies.
        pub body: Vec<BodyEntry>,
        /// The joints.
        pub joint: Vec<JointEntry>,
        /// The cables of segments.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pub cable: Vec<CableEntry>,
        /// The massless cables.
        pub massless_cable: Vec<MasslessCableEntry>,
        /// The bends of links.
        pub bend: Vec<BendEntry>,
        /// Half-spaces of the world.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pub ground: Vec<GroundEntry>,
        /// Other shapes that can touch.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pub collider: Vec<ColliderEntry>,
        /// The inputs.
        pub control: Vec<ControlEntry>,
        /// The events.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        pub event: Vec<EventEntry>,
        ;
        /// Where all this was read from.
        pub(super) places: Places,
    }
}

impl Default for SceneText {
    /// An empty text: no bodies, gravity of 9.81 m/s² along −z.
    fn default() -> Self {
        Self {
            name: "scene".into(),
            gravity: [0.0, 0.0, -9.81],
            equilibrium: false,
            load: None,
            order: Vec::new(),
            body: Vec::new(),
            joint: Vec::new(),
            cable: Vec::new(),
            massless_cable: Vec::new(),
            bend: Vec::new(),
            ground: Vec::new(),
            collider: Vec::new(),
            control: Vec::new(),
            event: Vec::new(),
            places: Places::default(),
        }
    }
}

described! {
    /// A body. Exactly one of `shape`, `inertia`, `inertia_matrix` gives its inertia; at most one of `orientation`,
    /// `rotation` its pose. A static or driven body needs neither mass nor inertia: it then has those of [`Body::fixed`].
    #[derive(Default)]
    pub struct BodyEntry {
        /// Its name; `world` is taken.
        pub name: String,
        /// Cause of its motion: `dynamic`, forces (the default); `static`, none; `driven`, its
        /// velocities whatever the forces.
        #[serde(default, skip_serializing_if = "is_dynamic")]
        pub mobility: Mobility,
        /// Mass \[kg]; a static or driven body needs none.
        pub mass: Option<f64>,
        /// A solid shape of that mass, or `particle`.
        pub shape: Option<Shape>,
        /// Principal moments of inertia along the body axes \[kg m²].
        pub inertia: Option<[f64; 3]>,
        /// Inertia matrix in the body frame, by rows \[kg m²].
        pub inertia_matrix: Option<[[f64; 3]; 3]>,
        /// Contact of its shape with others: `true`, or `{ friction, restitution, compliance, damping,
        /// groups, meets }`; default `false`.
        pub collide: Option<CollideEntry>,
        /// Centre of mass, world \[m].
        #[serde(default)]
        pub position: [f64; 3],
        /// Unit quaternion from body to world, scalar first.
        pub orientation: Option<[f64; 4]>,
        /// Rotation vector from body to world: axis times angle \[rad].
        pub rotation: Option<[f64; 3]>,
        /// Velocity, world \[m/s]. What rigid joints do not allow of it ends in a blow before the first step.
        #[serde(default, skip_serializing_if = "is_zero")]
        pub velocity: [f64; 3],
        /// Angular velocity, world \[rad/s].
        #[serde(default, skip_serializing_if = "is_zero")]
        pub angular_velocity: [f64; 3],
        /// External force, world \[N].
        #[serde(default, skip_serializing_if = "is_zero")]
        pub force: [f64; 3],
        /// External torque, world \[N m].
        #[serde(default, skip_serializing_if = "is_zero")]
        pub torque: [f64; 3],
        /// Name of the cable whose segment it is; default none.
        pub cable: Option<String>,
    }
}

/// A solid shape, or none.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Shape {
    /// A point mass, which has no inertia: what holds it acts at its centre.
    Particle,
    /// A ball.
    Sphere {
        /// Radius \[m].
        radius: f64,
    },
    /// A cylinder along the body's z axis; `cylinder` in a text, too.
    #[serde(alias = "cylinder")]
    Rod {
        /// Length \[m].
        length: f64,
        /// Radius \[m].
        radius: f64,
    },
    /// A box.
    Box {
        /// Edge lengths along the body axes \[m].
        size: [f64; 3],
    },
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde asks with a reference"
)]
fn is_dynamic(mobility: &Mobility) -> bool {
    *mobility == Mobility::Dynamic
}

/// True if all numbers are +0, bit for bit.
pub(super) fn is_zero(vector: &[f64; 3]) -> bool {
    vector.iter().all(|x| x.to_bits() == 0)
}

impl BodyEntry {
    pub(super) fn build(&self) -> Result<Body, Fault> {
        let of = Entry::new("body", &self.name);
        if self.name == WORLD {
            return Err(of.conflict("name", "stands for the fixed world: take another"));
        }
        let held = self.mobility != Mobility::Dynamic;
        let fixed = Body::fixed();
        let mass = match self.mass {
            Some(mass) => mass,
            None if held => fixed.mass,
            None => {
                let reason = "is missing: give it in kg, or make the body static or driven";
                return Err(of.conflict("mass", reason));
            }
        };
        let mut body = match (&self.shape, &self.inertia, &self.inertia_matrix) {
            (Some(shape), None, None) => shape.body(mass, &of)?,
            (None, None, None) if held => Body::new(mass, fixed.inertia),
            (None, Some(moments), None) => {
                Body::new(mass, Matrix3::from_diagonal(&(*moments).into()))
            }
            (None, None, Some(rows)) => Body::new(mass, Matrix3::from(*rows).transpose()),
            _ => {
                let reason = "give exactly one of shape, inertia, inertia_matrix";
                return Err(of.conflict("inertia", reason));
            }
        };
        body.mobility = self.mobility;
        body.position = self.position.into();
        body.orientation = turn(self.orientation, self.rotation, &of)?;
        body.velocity = self.velocity.into();
        body.angular_velocity = self.angular_velocity.into();
        body.force = self.force.into();
        body.torque = self.torque.into();
        Ok(body)
    }
}

/// The turn that an entry gives as a quaternion, scalar first, or as a rotation vector (rad).
pub(super) fn turn(
    orientation: Option<[f64; 4]>,
    rotation: Option<[f64; 3]>,
    of: &Entry<'_>,
) -> Result<UnitQuaternion<f64>, Fault> {
    of.finite("rotation", rotation.as_slice().as_flattened())?;
    match (orientation, rotation) {
        (None, None) => Ok(UnitQuaternion::identity()),
        (None, Some(vector)) => Ok(UnitQuaternion::from_scaled_axis(Vector3::from(vector))),
        // Taken as it is, so that a written scene reads back to the same bits; validation checks the norm.
        (Some([w, x, y, z]), None) => {
            Ok(UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)))
        }
        (Some(_), Some(_)) => {
            let reason = "excludes rotation: give one of them";
            Err(of.conflict("orientation", reason))
        }
    }
}

/// A turn as it is written: nothing where there is none.
pub(super) fn written(orientation: &UnitQuaternion<f64>) -> Option<[f64; 4]> {
    let q = orientation.as_ref();
    let quaternion = [q.w, q.i, q.j, q.k];
    let turned = quaternion.map(f64::to_bits) != [1.0, 0.0, 0.0, 0.0].map(f64::to_bits);
    turned.then_some(quaternion)
}

impl Shape {
    /// Its shape in contacts; a point mass has none.
    pub(super) fn collides(&self) -> Option<collide::Shape> {
        Some(match *self {
            Self::Particle => return None,
            Self::Sphere { radius } => collide::Shape::Sphere { radius },
            Self::Rod { length, radius } => collide::Shape::Cylinder { length, radius },
            Self::Box { size } => collide::Shape::Cuboid { size: size.into() },
        })
    }

    fn body(&self, mass: f64, of: &Entry<'_>) -> Result<Body, Fault> {
        let long = |key, value| of.check(key, value, value > 0.0, "> 0 m");
        Ok(match *self {
            Self::Particle => Body::particle(mass),
            Self::Sphere { radius } => Body::sphere(long("shape.sphere.radius", radius)?, mass),
            Self::Rod { length, radius } => {
                let length = long("shape.rod.length", length)
                    .map_err(|fault| fault.or_at("shape.cylinder.length"))?;
                let radius = long("shape.rod.radius", radius)
                    .map_err(|fault| fault.or_at("shape.cylinder.radius"))?;
                Body::rod(length, radius, mass)
            }
            Self::Box { size } => {
                for edge in size {
                    long("shape.box.size", edge)?;
                }
                Body::cuboid(size.into(), mass)
            }
        })
    }
}
