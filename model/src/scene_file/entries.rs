//! Explicit scenes and their bodies.

use std::collections::HashMap;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::joint::{JointEntry, WORLD};
use crate::body::Body;
use crate::error::{SceneError, check};
use crate::scene::validate::unique;
use crate::scene::{Scene, first_names};

/// An explicit scene as written in TOML:
///
/// ```toml
/// gravity = [0, 0, -9.81]          # m/s²; this is the default
/// equilibrium = true               # start from the static equilibrium near this pose; default false
/// load = "hook"                    # the body that reports follow
///
/// [[body]]
/// name = "hook"
/// mass = 50                        # kg
/// shape = { sphere = { radius = 0.1 } }
/// position = [0, 0, -2]            # m, centre of mass
///
/// [[joint]]
/// name = "anchor"
/// kind = "spherical"
/// a = "world"
/// b = "hook"
/// point = [0, 0, 0]                # m, world, in the pose given
/// ea = 1e6                         # N
/// length = 2                       # m of cable that the joint stands for
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneText {
    /// Name of the scene.
    #[serde(default = "default_name")]
    pub name: String,
    /// Acceleration of gravity, world \[m/s²].
    #[serde(default = "default_gravity")]
    pub gravity: [f64; 3],
    /// Whether to start from the static equilibrium near the pose given.
    #[serde(default)]
    pub equilibrium: bool,
    /// Name of the body that reports follow.
    pub load: Option<String>,
    /// The bodies.
    #[serde(default)]
    pub body: Vec<BodyEntry>,
    /// The joints.
    #[serde(default)]
    pub joint: Vec<JointEntry>,
}

fn default_name() -> String {
    "scene".into()
}

fn default_gravity() -> [f64; 3] {
    [0.0, 0.0, -9.81]
}

/// A body. Exactly one of `shape`, `inertia`, `inertia_matrix` gives its inertia; at most one of `orientation`,
/// `rotation` its pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BodyEntry {
    /// Its name; `world` is taken.
    pub name: String,
    /// Mass \[kg].
    pub mass: f64,
    /// A solid shape of that mass.
    pub shape: Option<Shape>,
    /// Principal moments of inertia along the body axes \[kg m²].
    pub inertia: Option<[f64; 3]>,
    /// Inertia matrix in the body frame, by rows \[kg m²].
    pub inertia_matrix: Option<[[f64; 3]; 3]>,
    /// Centre of mass, world \[m].
    #[serde(default)]
    pub position: [f64; 3],
    /// Unit quaternion from body to world, scalar first.
    pub orientation: Option<[f64; 4]>,
    /// Rotation vector from body to world: axis times angle \[rad].
    pub rotation: Option<[f64; 3]>,
    /// Velocity, world \[m/s].
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Angular velocity, world \[rad/s].
    #[serde(default)]
    pub angular_velocity: [f64; 3],
    /// External force, world \[N].
    #[serde(default)]
    pub force: [f64; 3],
    /// External torque, world \[N m].
    #[serde(default)]
    pub torque: [f64; 3],
}

/// A solid shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Radius \[m].
        radius: f64,
    },
    /// A cylinder along the body's z axis.
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

impl SceneText {
    /// Builds the scene.
    ///
    /// # Errors
    /// The first body or joint that is wrong.
    pub fn build(&self) -> Result<Scene, SceneError> {
        let mut scene = Scene::new(self.name.clone());
        scene.gravity = self.gravity.into();
        scene.start_in_equilibrium = self.equilibrium;
        for entry in &self.body {
            scene.add_body(entry.name.clone(), entry.build()?);
        }
        // Before the joints look for them: a name that two bodies have hides one of them.
        unique("body", &scene.body_names)?;
        let numbers = self.body.iter().enumerate();
        let index: HashMap<_, _> = numbers.map(|(i, b)| (b.name.as_str(), i)).collect();
        let find = |name: &str, what: &str| {
            index
                .get(name)
                .copied()
                .ok_or_else(|| SceneError::UnknownBody {
                    what: what.to_owned(),
                    name: name.to_owned(),
                    known: first_names(&scene.body_names),
                })
        };
        let load = self.load.as_ref().map(|name| find(name, "load"));
        let joints: Result<Vec<_>, _> = self
            .joint
            .iter()
            .map(|entry| entry.build(&scene.bodies, &find))
            .collect();
        for (entry, joint) in self.joint.iter().zip(joints?) {
            scene.add_constraint(entry.name.clone(), joint, entry.group);
        }
        scene.load = load.transpose()?;
        scene.validate()?;
        Ok(scene)
    }
}

impl BodyEntry {
    fn build(&self) -> Result<Body, SceneError> {
        let what = |key: &str| format!("body `{}`: {key}", self.name);
        let conflict = |key: &str, reason| SceneError::Conflict {
            what: what(key),
            reason,
        };
        if self.name == WORLD {
            return Err(conflict("name", "stands for the fixed world: take another"));
        }
        let mass = check(what("mass"), self.mass, self.mass > 0.0, "> 0 kg")?;
        let mut body = match (&self.shape, &self.inertia, &self.inertia_matrix) {
            (Some(shape), None, None) => shape.body(mass, what)?,
            (None, Some(moments), None) => {
                Body::new(mass, Matrix3::from_diagonal(&(*moments).into()))
            }
            (None, None, Some(rows)) => Body::new(mass, Matrix3::from(*rows).transpose()),
            _ => {
                let reason = "give exactly one of shape, inertia, inertia_matrix";
                return Err(conflict("inertia", reason));
            }
        };
        body.position = self.position.into();
        body.orientation = match (self.orientation, self.rotation) {
            (None, None) => UnitQuaternion::identity(),
            (None, Some(vector)) => UnitQuaternion::from_scaled_axis(Vector3::from(vector)),
            // Taken as it is, so that a written scene reads back to the same bits; validation checks the norm.
            (Some([w, x, y, z]), None) => {
                UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
            }
            (Some(_), Some(_)) => {
                let reason = "excludes rotation: give one of them";
                return Err(conflict("orientation", reason));
            }
        };
        body.velocity = self.velocity.into();
        body.angular_velocity = self.angular_velocity.into();
        body.force = self.force.into();
        body.torque = self.torque.into();
        Ok(body)
    }
}

impl Shape {
    fn body(&self, mass: f64, what: impl Fn(&str) -> String) -> Result<Body, SceneError> {
        let long = |key, value| check(what(key), value, value > 0.0, "> 0 m");
        Ok(match *self {
            Self::Sphere { radius } => Body::sphere(long("radius", radius)?, mass),
            Self::Rod { length, radius } => {
                Body::rod(long("length", length)?, long("radius", radius)?, mass)
            }
            Self::Box { size } => {
                for edge in size {
                    long("size", edge)?;
                }
                Body::cuboid(size.into(), mass)
            }
        })
    }
}
