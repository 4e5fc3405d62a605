//! The colliders of a scene: added and checked.

use super::Scene;
use super::validate::unique;
use crate::collide::{Collider, Shape, Surface};
use crate::error::{SceneError, check, refuse};

/// Smallest over largest dimension of a shape that contacts can be found of: beyond it rounding decides.
const SLENDEREST: f64 = 1e-9;

impl Scene {
    /// Appends a collider and returns its number. Nothing is checked: [`Scene::validate`] does.
    pub fn add_collider(&mut self, collider: Collider) -> usize {
        self.colliders.push(collider);
        self.colliders.len() - 1
    }

    /// Checks all colliders.
    pub(crate) fn validate_colliders(&self) -> Result<(), SceneError> {
        unique("collider", self.colliders.iter().map(|c| &c.name))?;
        (0..self.colliders.len()).try_for_each(|i| self.validate_collider(i))
    }

    /// Checks collider number `i`, but for its name.
    pub(crate) fn validate_collider(&self, i: usize) -> Result<(), SceneError> {
        let collider = &self.colliders[i];
        if let Some(body) = collider.body.filter(|body| *body >= self.bodies.len()) {
            return Err(self.unknown_body(&format!("collider `{}`", collider.name), body));
        }
        let of = |quantity: &str| self.collider_quantity(collider, quantity);
        for x in collider.position.iter() {
            check(of("position"), *x, true, "finite")?;
        }
        let norm = collider.orientation.as_vector().norm();
        let unit = (norm - 1.0).abs() <= 1e-9;
        let needs = "a unit quaternion (scalar first)";
        check(of("norm of the orientation"), norm, unit, needs)?;
        collider.shape.validate(of)?;
        collider.surface.validate(of)?;
        self.check_collider_body(collider)
    }

    /// Whose quantity a fault is about.
    fn collider_quantity(&self, collider: &Collider, quantity: &str) -> String {
        let body = collider
            .body
            .map(|i| format!(" of body `{}`", self.body_names[i]));
        let body = body.unwrap_or_default();
        format!("collider `{}`{body}: {quantity}", collider.name)
    }

    /// Refuses shapes that the body cannot have.
    fn check_collider_body(&self, collider: &Collider) -> Result<(), SceneError> {
        let what = || self.collider_quantity(collider, "shape");
        let Some(body) = collider.body else {
            return Ok(());
        };
        if collider.shape == Shape::HalfSpace && self.bodies.is_dynamic(body) {
            let reason = "is a half-space, which has no end: give it to the world or to a static or driven body";
            return refuse(what(), reason);
        }
        let ball = matches!(collider.shape, Shape::Sphere { .. });
        if self.bodies.is_point(body) && !(ball && collider.position.amax() == 0.0) {
            let reason = "would turn a point mass: give it a sphere about its centre, or the body a shape or an inertia";
            return refuse(what(), reason);
        }
        Ok(())
    }
}

impl Shape {
    /// Checks the dimensions; `of` names a quantity with its owner.
    pub(crate) fn validate(&self, of: impl Fn(&str) -> String) -> Result<(), SceneError> {
        let long = |quantity: &str, value: f64| check(of(quantity), value, value > 0.0, "> 0 m");
        match *self {
            Self::Sphere { radius } => long("radius", radius)?,
            Self::Cuboid { size } => size.iter().try_for_each(|edge| long("size", *edge))?,
            Self::Capsule { length, radius } => {
                check(of("length"), length, length >= 0.0, "≥ 0 m")?;
                long("radius", radius)?;
            }
            Self::Cylinder { length, radius } => {
                long("length", length)?;
                long("radius", radius)?;
            }
            Self::HalfSpace => return Ok(()),
        }
        let [least, most] = self.dimensions();
        let needs = "> 1e-9 of the largest dimension, or contacts are lost in rounding";
        let of = of("smallest dimension");
        check(of, least, least > SLENDEREST * most, needs)
    }
}

impl Surface {
    /// Checks the numbers; `of` names a quantity with its owner.
    pub(crate) fn validate(&self, of: impl Fn(&str) -> String) -> Result<(), SceneError> {
        check(of("friction"), self.friction, self.friction >= 0.0, "≥ 0")?;
        let bounces = (0.0..=1.0).contains(&self.restitution);
        check(of("restitution"), self.restitution, bounces, "from 0 to 1")?;
        let (compliance, needs) = (self.compliance, "≥ 0 m/N; 0 is rigid");
        check(of("compliance"), compliance, compliance >= 0.0, needs)?;
        check(of("damping"), self.damping, self.damping >= 0.0, "≥ 0 s")
    }
}
