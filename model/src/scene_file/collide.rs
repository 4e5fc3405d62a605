//! Shapes that can touch, in explicit scenes: the key `collide` of bodies and cables, `[[ground]]` and `[[collider]]`.

use std::fmt;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::build::{Entry, Names, WORLD};
use super::entries::{self, BodyEntry, SceneText, is_zero};
use super::groups::{Groups, names_of};
use super::keys::described;
use super::motor::unless;
use super::places::{Fault, each};
use crate::collide::{Collider, DEFAULT_GROUP, Shape, Surface};
use crate::error::SceneError;
use crate::scene::Scene;

/// Contact of a body or a cable with others, and the surface for it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum CollideEntry {
    /// With the default surface, or not at all.
    Is(bool),
    /// With that surface.
    With(SurfaceEntry),
}

impl<'de> Deserialize<'de> for CollideEntry {
    /// By hand, for a fault of the table to name its key.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = CollideEntry;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("`true`, `false` or a table such as { friction = 0.3 }")
            }

            fn visit_bool<E>(self, is: bool) -> Result<CollideEntry, E> {
                Ok(CollideEntry::Is(is))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<CollideEntry, A::Error> {
                let entry = SurfaceEntry::deserialize(MapAccessDeserializer::new(map));
                entry.map(CollideEntry::With)
            }
        }

        deserializer.deserialize_any(Either)
    }
}

described! {
    /// The surface of a shape, and what it meets.
    #[derive(Default)]
    pub struct SurfaceEntry with surface {}
}

described! {
    /// The ground, or a wall: everything on one side of a plane of the world.
    #[derive(Default)]
    pub struct GroundEntry with surface {
        /// Its name.
        pub name: String,
        /// A point of its surface, world \[m]; default the origin.
        #[serde(default)]
        pub point: [f64; 3],
        /// Where free space is: a vector across the surface, world; default upwards, `[0, 0, 1]`.
        pub normal: Option<[f64; 3]>,
    }
}

described! {
    /// A shape of a body, which may have several, or of the world.
    pub struct ColliderEntry with surface {
        /// Its name.
        pub name: String,
        /// `world` or a body's name.
        pub body: String,
        /// The shape, in m: `{ sphere = { radius } }`, `{ box = { size } }`, `{ cylinder = { length, radius } }` or
        /// `{ capsule = { length, radius } }` along z, `length` between the centres of its ends; or `"half-space"` below z = 0.
        pub shape: Shape,
        /// Origin of the shape, body frame \[m] (world frame for the world); default the origin: a body's centre of mass.
        #[serde(default, skip_serializing_if = "is_zero")]
        pub position: [f64; 3],
        /// Unit quaternion from the shape's frame to the body's, scalar first; default unturned.
        pub orientation: Option<[f64; 4]>,
        /// Rotation vector from the shape's frame to the body's: axis times angle \[rad].
        pub rotation: Option<[f64; 3]>,
    }
}

impl CollideEntry {
    /// The surface, where it touches anything.
    pub(super) fn surface(&self) -> Option<SurfaceEntry> {
        match self {
            Self::Is(false) => None,
            Self::Is(true) => Some(SurfaceEntry::default()),
            Self::With(surface) => Some(surface.surface()),
        }
    }
}

impl SurfaceEntry {
    /// The surface of the entry `of`; `within` is what stands before its keys.
    pub(super) fn build(&self, of: &Entry<'_>, within: &str) -> Result<Surface, Fault> {
        let default = Surface::default();
        let surface = Surface {
            friction: self.friction.unwrap_or(default.friction),
            restitution: self.restitution.unwrap_or(default.restitution),
            compliance: self.compliance.unwrap_or(default.compliance),
            damping: self.damping.unwrap_or(default.damping),
        };
        let sound = surface.validate(|key| of.what(&format!("{within}{key}")));
        sound.map_err(Fault::named).map(|()| surface)
    }
}

impl GroundEntry {
    fn build(&self) -> Result<Collider, Fault> {
        let of = Entry::new("ground", &self.name);
        of.finite("point", &self.point)?;
        let normal = Vector3::from(self.normal.unwrap_or([0.0, 0.0, 1.0]));
        of.finite("normal", normal.as_slice())?;
        if normal.amax() == 0.0 {
            return Err(of.conflict("normal", "is zero: give a vector out of the ground"));
        }
        // Scaled first, so that the square of a tiny or huge vector is a number.
        let normal = (normal / normal.amax()).normalize();
        let upside_down = UnitQuaternion::from_quaternion(Quaternion::new(0.0, 1.0, 0.0, 0.0));
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &normal);
        let mut collider = Collider::new(&*self.name, None, Shape::HalfSpace);
        collider.position = self.point.into();
        collider.orientation = turn.unwrap_or(upside_down);
        collider.surface = self.surface().build(&of, "")?;
        Ok(collider)
    }
}

impl ColliderEntry {
    fn build(&self, names: &Names<'_>) -> Result<Collider, Fault> {
        let of = Entry::new("collider", &self.name);
        let body = match &*self.body {
            WORLD => None,
            name => Some(names.body(&of, "body", name)?),
        };
        let mut collider = Collider::new(&*self.name, body, self.shape);
        collider.position = self.position.into();
        collider.orientation = entries::turn(self.orientation, self.rotation, &of)?;
        collider.surface = self.surface().build(&of, "")?;
        Ok(collider)
    }

    /// The collider as it is written.
    pub(super) fn of(collider: &Collider, scene: &Scene) -> Self {
        let (surface, default) = (&collider.surface, Surface::default());
        let body = collider.body.map(|i| scene.body_names[i].clone());
        Self {
            name: collider.name.clone(),
            body: body.unwrap_or_else(|| WORLD.to_owned()),
            shape: collider.shape,
            position: collider.position.into(),
            orientation: entries::written(&collider.orientation),
            rotation: None,
            friction: unless(surface.friction, default.friction),
            restitution: unless(surface.restitution, default.restitution),
            compliance: unless(surface.compliance, default.compliance),
            damping: unless(surface.damping, default.damping),
            groups: (collider.groups != DEFAULT_GROUP).then(|| names_of(collider.groups)),
            meets: (collider.meets != u32::MAX).then(|| names_of(collider.meets)),
        }
    }
}

/// Gives body number `i`, which is the scene's last, the shape that its mass has.
pub(super) fn collide_body(
    scene: &mut Scene,
    i: usize,
    entry: &BodyEntry,
    groups: &Groups,
) -> Result<(), Fault> {
    let Some(surface) = entry.collide.as_ref().and_then(CollideEntry::surface) else {
        return Ok(());
    };
    let of = Entry::new("body", &entry.name);
    let Some(shape) = entry.shape.as_ref().and_then(entries::Shape::collides) else {
        let reason = "needs shape: a sphere, a box or a cylinder; or write a [[collider]]";
        return Err(of.conflict("collide", reason));
    };
    let mut collider = Collider::new(&*entry.name, Some(i), shape);
    collider.surface = surface.build(&of, "collide.")?;
    (collider.groups, collider.meets) = groups.masks(&surface);
    add(scene, collider).map_err(|error| Fault::at(&["shape", "collide"], error))
}

impl SceneText {
    /// Adds the colliders that stand for themselves.
    pub(super) fn add_colliders(
        &self,
        scene: &mut Scene,
        names: &Names<'_>,
        groups: &Groups,
    ) -> Result<(), Fault> {
        let mut add_own = |mut collider: Collider, surface: &SurfaceEntry| {
            (collider.groups, collider.meets) = groups.masks(surface);
            add(scene, collider).map_err(|error| match &error {
                SceneError::Duplicate { .. } => Fault::new("name", error),
                _ => Fault::named(error).or_at("shape"),
            })
        };
        each("ground", &self.ground, |_, entry| {
            add_own(entry.build()?, &entry.surface())
        })?;
        each("collider", &self.collider, |_, entry| {
            add_own(entry.build(names)?, &entry.surface())
        })
    }
}

/// Adds a collider with a name of its own that is sound.
fn add(scene: &mut Scene, collider: Collider) -> Result<(), SceneError> {
    if scene.colliders.iter().any(|c| c.name == collider.name) {
        return Err(SceneError::Duplicate {
            kind: "collider",
            name: collider.name,
        });
    }
    let number = scene.add_collider(collider);
    scene.validate_collider(number)
}
