//! Scenes on the ground: see [`ContactSceneParams`].
//!
//! **Stack**: boxes on each other, the lowest of `segment_mass`, each heavier than the one below by the same factor up to
//! `mass_ratio`. A floor carries N boxes of masses m_k with (Σ m_k) g.
//!
//! **Floor**: a cable that lies on the floor, between a load and a tug that drags it with a steady speed: while the load
//! slides its cable pulls with the friction μ M g.
//!
//! **Pile**: cables laid crosswise above each other fall on the floor and on each other. Every other one is `mass_ratio`
//! times as heavy.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{UnitQuaternion, Vector3};

use crate::body::{Body, Mobility};
use crate::cable::{Cable, CableEnd, Damping, JointKind, Segments};
use crate::collide::{Collider, Shape, Surface};
use crate::error::SceneError;
use crate::frame::Frame;
use crate::material::{Material, Stiffness};
use crate::params::{finite, not_negative, params, representable, scenes};
use crate::scene::Scene;

/// Density of the load that is dragged \[kg/m³].
const DENSITY: f64 = 2500.0;

scenes! {
    /// Kind of scene on the ground.
    pub enum ContactScene {
        /// Boxes on each other.
        Stack = "stack",
        /// A load dragged by a cable.
        Floor = "floor",
        /// Cables that fall on each other.
        Pile = "pile",
    }
}

params! {
    /// Scenes on the ground, with contacts: a stack of boxes, a load that a cable drags over the floor, cables in a pile.
    ///
    /// Parameters in SI units.
    pub struct ContactSceneParams, of scene: ContactScene {
        /// Boxes of the stack or cables of the pile, 1 to 200. Default: 10 boxes, 4 cables. Not in `floor`.
        pub count: Option<usize> = None, |n| (1.0..=200.0).contains(&n), "1 to 200";
        /// Segments of a cable, 1 to 10 000. Not in `stack`.
        pub segments: usize = 24, |n| (1.0..=10_000.0).contains(&n), "1 to 10 000";
        /// Length of a cable, and edge of a box times its number \[m].
        pub length: f64 = 10.0, representable, "> 0, 1e-150 to 1e150";
        /// Radius of a cable \[m]. Not in `stack`.
        pub radius: f64 = 0.02, representable, "> 0, 1e-150 to 1e150";
        /// Mass of a segment, and of the lightest box \[kg].
        pub segment_mass: f64 = 1.0, representable, "> 0, 1e-150 to 1e150";
        /// Mass of the heaviest box, of the load or of a heavy segment over `segment_mass`, ≥ 1.
        pub mass_ratio: f64 = 100.0, |ratio| (1.0..=1e12).contains(&ratio), "1 to 1e12";
        /// Axial stiffness of a cable \[N]. Not in `stack`.
        pub ea: f64 = 2e7, representable, "> 0, 1e-150 to 1e150";
        /// Bending and torsional stiffness of a cable \[N m²]; 0 for ball joints. Not in `stack`.
        pub ei: f64 = 20.0, not_negative, "≥ 0";
        /// Damping time τ of a cable \[s]. Not in `stack`.
        pub damping: f64 = 0.01, not_negative, "≥ 0";
        /// Coefficient of friction of all surfaces.
        pub friction: f64 = 0.3, not_negative, "≥ 0";
        /// Coefficient of restitution of all surfaces, 0 to 1.
        pub restitution: f64 = 0.0, |e| (0.0..=1.0).contains(&e), "0 to 1";
        /// Speed of the tug \[m/s]. Only in `floor`.
        pub speed: f64 = 0.5, finite, "a number";
        /// Acceleration of gravity along −z \[m/s²], ≥ 0.
        pub gravity: f64 = 9.81, not_negative, "≥ 0";
    }
}

impl ContactSceneParams {
    fn count(&self) -> usize {
        let is_pile = self.scene == ContactScene::Pile;
        self.count.unwrap_or(if is_pile { 4 } else { 10 })
    }

    /// Builds the scene. Bodies: `box-1` … from the ground; `tug`, `load` and the cable `rope`; the cables `rope-1` … The load
    /// is the highest box, what is dragged, the last segment of the highest cable.
    ///
    /// # Errors
    /// Names the parameter that is out of range, and what it has to be.
    pub fn build(&self) -> Result<Scene, SceneError> {
        self.check_each()?;
        let mut scene = Scene::new(self.scene.name());
        scene.gravity = Vector3::z() * -self.gravity;
        let ground = Collider::new("ground", None, Shape::HalfSpace);
        self.add(&mut scene, ground);
        match self.scene {
            ContactScene::Stack => self.stack(&mut scene),
            ContactScene::Floor => self.floor(&mut scene)?,
            ContactScene::Pile => self.pile(&mut scene)?,
        }
        scene.group_by_topology();
        scene.validate()?;
        Ok(scene)
    }

    fn surface(&self) -> Surface {
        Surface {
            friction: self.friction,
            restitution: self.restitution,
            ..Surface::default()
        }
    }

    fn add(&self, scene: &mut Scene, collider: Collider) {
        let surface = self.surface();
        scene.add_collider(Collider {
            surface,
            ..collider
        });
    }

    /// A box that stands on the ground, or on what is `z` high.
    fn add_box(
        &self,
        scene: &mut Scene,
        name: &str,
        [x, z]: [f64; 2],
        edge: f64,
        mass: f64,
    ) -> usize {
        let size = Vector3::repeat(edge);
        let place = Vector3::new(x, 0.0, z + 0.5 * edge);
        let body = scene.add_body(name, Body::cuboid(size, mass).at(place));
        let collider = Collider::new(name, Some(body), Shape::Cuboid { size });
        self.add(scene, collider);
        body
    }

    fn stack(&self, scene: &mut Scene) {
        let edge = self.length / self.count() as f64;
        for k in 0..self.count() {
            let part = k as f64 / (self.count() - 1).max(1) as f64;
            let mass = self.segment_mass * self.mass_ratio.powf(part);
            let name = format!("box-{}", k + 1);
            scene.load = Some(self.add_box(scene, &name, [0.0, k as f64 * edge], edge, mass));
        }
    }

    fn floor(&self, scene: &mut Scene) -> Result<(), SceneError> {
        let mass = self.segment_mass * self.mass_ratio;
        let edge = (mass / DENSITY).cbrt().max(2.0 * self.radius);
        let load = self.add_box(scene, "load", [-0.5 * edge, 0.0], edge, mass);
        scene.load = Some(load);
        let mut tug = Body::fixed().at(Vector3::new(self.length, 0.0, self.radius));
        tug.mobility = Mobility::Driven;
        tug.velocity.x = self.speed;
        let tug = scene.add_body("tug", tug);
        let hitch = Vector3::new(0.5 * edge, 0.0, self.radius - 0.5 * edge);
        let ends = [Frame::body(load, hitch), Frame::body(tug, Vector3::zeros())];
        let rope = self.cable("rope", ends.map(CableEnd::Pinned), 1.0);
        scene.add_cable(&rope).map(drop)
    }

    fn pile(&self, scene: &mut Scene) -> Result<(), SceneError> {
        for k in 0..self.count() {
            let height = self.radius * (3.0 + 3.0 * k as f64);
            // Off the middles of the others, so that crossings are not at joints.
            let offset =
                0.3 * self.length / self.segments as f64 * (1.0 + k as f64 / self.count() as f64);
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2 * k as f64);
            let ends = [-0.5, 0.5].map(|part| {
                let place = Vector3::new(part * self.length, offset, height);
                CableEnd::Free(turn * place)
            });
            let heavy = if k % 2 == 1 { self.mass_ratio } else { 1.0 };
            let parts = scene.add_cable(&self.cable(&format!("rope-{}", k + 1), ends, heavy))?;
            scene.load = parts.bodies.last().copied();
        }
        Ok(())
    }

    /// A cable whose segments are `heavy` times `segment_mass`.
    fn cable(&self, name: &str, ends: [CableEnd; 2], heavy: f64) -> Cable {
        let stiff = self.ei > 0.0;
        // A cable that resists neither bending nor torsion has no such rows, and any stiffness will do.
        let ei = if stiff { self.ei } else { 1.0 };
        Cable {
            segments: Segments::Equal(self.segments),
            density: heavy * self.segment_mass * self.segments as f64 / self.length,
            stiffness: Stiffness {
                ea: self.ea,
                ei,
                gj: ei,
            },
            damping: Damping::Time(self.damping),
            joint: if stiff {
                JointKind::Cosserat
            } else {
                JointKind::Spherical
            },
            bend: stiff,
            twist: stiff,
            collide: Some(self.surface()),
            ..Cable::round(name, &Material::STEEL, self.radius, ends)
        }
    }
}
