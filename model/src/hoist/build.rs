//! Builds the hoist from its parameters.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector3};

use super::{Apart, Hoist, HoistParams};
use crate::body::Body;
use crate::cable::strand::Strand;
use crate::cable::{End, JointKind};
use crate::error::SceneError;
use crate::frame::Frame;
use crate::material::Material;
use crate::motion::Motion;
use crate::scene::Scene;
use crate::seed;

impl HoistParams {
    /// Builds the scene with an unstrained cable. Bodies: the segments from the top, then the load. Constraints: the
    /// anchor, the inner joints from the top, the load's joint. Groups: the joint that is [`apart`](Self::apart) is 1, all
    /// others are 0.
    ///
    /// # Errors
    /// As [`HoistParams::resolve`].
    pub fn build(&self) -> Result<Scene, SceneError> {
        let hoist = self.resolve()?;
        let gaps = vec![0.0; hoist.segments + 1];
        let mut scene = self.assemble(&hoist, &gaps, self.initial_angle)?;
        scene.start_in_equilibrium = self.equilibrium;
        Ok(scene)
    }

    /// The scene with its bodies at the static equilibrium of the hanging cable, straight down: each joint open by
    /// ε_j T_j. `initial_angle` is ignored; the random angular velocities are not.
    ///
    /// # Errors
    /// As [`HoistParams::resolve`].
    pub fn hanging_equilibrium(&self) -> Result<Scene, SceneError> {
        let hoist = self.resolve()?;
        let gaps: Vec<_> = hoist.gaps(self.gravity).collect();
        self.assemble(&hoist, &gaps, 0.0)
    }

    /// Static elongation of the discrete cable \[m]: Σ_j ε_j T_j, T_j = g (M + masses of the segments below joint j). NaN when
    /// the parameters are refused by [`HoistParams::resolve`].
    #[must_use]
    pub fn exact_elongation(&self) -> f64 {
        self.resolve()
            .map_or(f64::NAN, |hoist| hoist.gaps(self.gravity).sum())
    }

    /// Elongation of a massless cable under the load \[m]: M g L/EA. NaN when the parameters are refused by
    /// [`HoistParams::resolve`].
    #[must_use]
    pub fn continuum_elongation(&self) -> f64 {
        self.resolve().map_or(f64::NAN, |hoist| {
            hoist.load_mass * self.gravity * self.length / hoist.stiffness.ea
        })
    }

    fn assemble(&self, hoist: &Hoist, gaps: &[f64], angle: f64) -> Result<Scene, SceneError> {
        let l = hoist.segment_length;
        // Exact identity for angle 0, so that a vertical cable keeps exact zeros in x and y.
        let turn = UnitQuaternion::from_scaled_axis(Vector3::y() * angle);
        let place = |depth: f64| turn * Vector3::new(0.0, 0.0, -depth);
        let mut scene = Scene::new("hoist");
        scene.gravity = Vector3::new(0.0, 0.0, -self.gravity);
        let mut depth = 0.0;
        let rods = gaps[..hoist.segments].iter().enumerate().map(|(i, gap)| {
            let centre = depth + gap + 0.5 * l;
            let mass = if i == 0 {
                hoist.top_mass
            } else {
                hoist.segment_mass
            };
            depth = centre + 0.5 * l;
            let rod = Body::rod(l, hoist.radius, mass);
            rod.at(place(centre)).turned(turn)
        });
        let cable = Strand::begin(&mut scene, "cable");
        Strand::add_segments(&mut scene, cable, "segment", rods);
        let centre = depth + gaps[hoist.segments] + self.load_offset;
        let volume = hoist.load_mass / Material::STEEL.density;
        let sphere = Body::sphere((0.75 * volume / PI).cbrt(), hoist.load_mass);
        let load = scene.add_body("load", sphere.at(place(centre)).turned(turn));
        scene.load = Some(load);
        self.add_joints(&mut scene, cable, hoist);
        let spins = &mut scene.bodies.angular_velocity[..hoist.segments];
        seed::replace(spins, self.seed, self.seed_rate);
        scene.validate()?;
        Ok(scene)
    }

    fn add_joints(&self, scene: &mut Scene, cable: usize, hoist: &Hoist) {
        let (n, l) = (hoist.segments, hoist.segment_length);
        let angular = self.joint != JointKind::Spherical;
        let strand = Strand {
            twist_definition: self.twist_definition,
            bend: self.bend.unwrap_or(angular),
            twist: self.twist.unwrap_or(angular),
            ..Strand::new(self.joint, hoist.stiffness, self.damping)
        };
        let held = |end: End, frames| (end.joint(self.joint), frames);
        let top = Frame::world(Vector3::zeros()).moving(self.motion());
        let anchor = held(self.anchor, [top, strand.ends(0, l)[0]]);
        strand.join(scene, cable, "anchor", anchor, 0.5 * l);
        strand.join_segments(scene, cable, "joint", 0..n, l);
        let hook = Frame::body(n, Vector3::new(0.0, 0.0, self.load_offset));
        let load = held(self.attachment, [strand.ends(n - 1, l)[1], hook]);
        strand.join(scene, cable, "load", load, 0.5 * l);
        let apart = match self.apart {
            Apart::Load => n,
            Apart::Anchor => 0,
        };
        scene.groups[apart] = 1;
    }

    fn motion(&self) -> Motion {
        if self.circle_radius > 0.0 {
            return Motion::Circle {
                radius: self.circle_radius,
                period: self.circle_period,
                start: self.move_start,
                ramp: self.circle_period,
            };
        }
        if self.move_x == 0.0 {
            return Motion::Fixed;
        }
        Motion::Smooth {
            displacement: Vector3::new(self.move_x, 0.0, 0.0),
            start: self.move_start,
            duration: self.move_duration,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linearized::Linearized;
    use crate::testing::With;

    #[test]
    fn it_is_unstrained_whatever_the_angle() {
        for initial_angle in [0.0, 0.7, -1.5] {
            let params = HoistParams::default()
                .with(|p| (p.initial_angle, p.load_offset) = (initial_angle, 0.3));
            let lin = Linearized::at(&params.build().expect("builds"), 0.0);
            assert!(lin.phi.iter().all(|phi| phi.abs() < 1e-14));
        }
    }

    #[test]
    fn equilibrium_carries_the_weight() {
        let params = HoistParams::default()
            .with(|p| (p.mass_ratio, p.segment_mass, p.load_offset) = (1e5, Some(0.5), 0.2));
        let scene = params.hanging_equilibrium().expect("builds");
        let lin = Linearized::at(&scene, 0.0);
        for j in 0..=24 {
            let row = lin.row_range(j).start + 2;
            // λ = −φ/ε acts upwards on the body below: it is the weight of what hangs there.
            let below = 9.81 * (5e4 + 0.5 * (24 - j) as f64);
            let tension = lin.phi[row] / lin.compliance[row];
            assert!((tension / below - 1.0).abs() < 1e-12, "joint {j}");
        }
        let elongation = params.exact_elongation();
        let hook = scene.bodies.position[24].z + 0.2;
        assert!((hook + 10.0 + elongation).abs() < 1e-14 * 10.0);
        let continuum = params.continuum_elongation();
        let cable = 24.0 * 0.5 * 9.81 * 10.0 / 2e7 / 2.0;
        assert!((elongation - continuum - cable).abs() < 1e-12);
    }

    #[test]
    fn a_heavy_top_hangs_on_the_anchor_alone() {
        let params = HoistParams::default()
            .with(|p| (p.top_mass, p.apart, p.segments) = (Some(700.0), Apart::Anchor, 3));
        let scene = params.hanging_equilibrium().expect("builds");
        assert_eq!(scene.bodies.mass, [700.0, 1.0, 1.0, 1000.0]);
        assert_eq!(scene.groups, [1, 0, 0, 0]);
        let lin = Linearized::at(&scene, 0.0);
        for (j, mass) in [1702.0, 1002.0, 1001.0, 1000.0].into_iter().enumerate() {
            let row = lin.row_range(j).start + 2;
            let tension = lin.phi[row] / lin.compliance[row];
            assert!((tension / (9.81 * mass) - 1.0).abs() < 1e-12, "joint {j}");
        }
    }

    #[test]
    fn joints_and_rows_can_be_chosen() {
        let rows = |params: &HoistParams| {
            let scene = params.build().expect("builds");
            [0, 1, 24].map(|i| scene.constraints[i].rows())
        };
        let mut params = HoistParams::default();
        assert_eq!(rows(&params), [3, 6, 3]);
        params.twist = Some(false);
        params.anchor = End::Clamped;
        assert_eq!(rows(&params), [5, 5, 3]);
        params.joint = JointKind::Paper;
        params.attachment = End::Clamped;
        assert_eq!(rows(&params), [4, 4, 4]);
        params = HoistParams::default().with(|p| p.joint = JointKind::Spherical);
        assert_eq!(rows(&params), [3, 3, 3]);
    }

    #[test]
    fn anchor_moves_as_told() {
        let anchor = |params: HoistParams, t| {
            let scene = params.build().expect("builds");
            scene.constraints[0].frames()[0].displacement(t)
        };
        let slide = HoistParams::default().with(|p| (p.move_x, p.move_start) = (0.5, 1.0));
        assert_eq!(anchor(slide.clone(), 1.0), Vector3::zeros());
        assert_eq!(anchor(slide, 2.0), Vector3::new(0.5, 0.0, 0.0));
        let circle = HoistParams::default().with(|p| p.circle_radius = 2.0);
        assert!(anchor(circle, 3.0).y > 0.5);
    }
}
