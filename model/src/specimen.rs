//! Test specimens: see [`SpecimenParams`].
//!
//! The cable runs from the world's origin along +x, without gravity. Its N segments are square prisms of length
//! l = L/N. A grip is clamped to its far end; the loads act on the grip. Inner joints stand for one length l of cable,
//! the two end joints for l/2 each, so that the compliances of all joints add up to L/YA, L/YI, L/GJ. Under loads at the
//! ends alone every cross-section carries the same force or moment, and the discrete specimen is exact:
//!
//! ```text
//! pull    gap of a joint    F l_j/YA       elongation of the whole   F L/YA
//! twist   angle of a joint  T l_j/GJ       of the whole              T L/GJ
//! bend    angle of a joint  M l_j/YI       of the whole              M L/YI: a regular polygon, closed at 2π
//! ```
//!
//! with l_j = l, or l/2 at the ends. All axes are exact unit vectors: a straight specimen keeps exact zeros across.
//!
//! The paper's cable is 1 m long; the exponent of its cross-section's area cannot be read in the scan. 10⁻⁴ m² is the
//! default here.

use nalgebra::{Matrix3, Vector3};

use crate::body::Body;
use crate::cable::strand::Strand;
use crate::cable::{JointKind, MAX_SEGMENTS};
use crate::constraint::{Constraint, Cosserat, JointLaw, RowLaw, TwistDefinition};
use crate::error::{SceneError, check, refuse};
use crate::frame::Frame;
use crate::material::{CrossSection, Material, Stiffness};
use crate::params::{
    check_count, check_worked_out, finite, not_negative, params, positive, scenes,
};
use crate::scene::Scene;
use crate::seed;

scenes! {
    /// The kind of loading of a specimen, with its default load.
    pub enum Specimen {
        /// Pulled by F = YA/10: 10 % longer.
        Pull = "pull",
        /// Twisted by T = 2π GJ/L: one turn.
        Twist = "twist",
        /// Bent by M = (π/2) YI/L: a quarter of a circle.
        Bend = "bend",
    }
}

params! {
    /// Test specimens: a straight cable, clamped at one end, pulled, twisted or bent at the other \[SL §VII-A].
    ///
    /// Parameters in SI units; `None` stands for the default that the field names.
    pub struct SpecimenParams, of specimen: Specimen {
        /// Number N of segments, 1 to 10 million.
        pub segments: usize = 24, |n| n >= 1.0, "at least 1";
        /// Length L of the unstrained cable \[m].
        pub length: f64 = 1.0, positive, "> 0 m";
        /// Area A of the square cross-section \[m²].
        pub area: f64 = 1e-4, positive, "> 0 m²";
        /// `steel`, `nylon` or `rubber`.
        pub material: String = "steel".to_owned();
        /// Young's modulus Y \[Pa]. Default: the material's.
        pub young: Option<f64> = None, positive, "> 0 Pa";
        /// Poisson's ratio ν. Default: the material's.
        pub poisson: Option<f64> = None, |nu| nu > -1.0 && nu <= 0.5, "above -1 and at most 0.5";
        /// Density ρ \[kg/m³]. Default: the material's.
        pub density: Option<f64> = None, positive, "> 0 kg/m³";
        /// Axial stiffness YA \[N]. Default: of the solid square.
        pub ea: Option<f64> = None, positive, "> 0 N";
        /// Bending stiffness YI \[N m²]. Default: of the solid square.
        pub ei: Option<f64> = None, positive, "> 0 N m²";
        /// Torsional stiffness GJ \[N m²]. Default: of the solid square.
        pub gj: Option<f64> = None, positive, "> 0 N m²";
        /// Kind of the joints: `cosserat` or `paper`.
        pub joint: JointKind = JointKind::Cosserat;
        /// The twist angle of the paper's joint: `ordinary` or `alternative`.
        pub twist_definition: TwistDefinition = TwistDefinition::Ordinary;
        /// Mass of the grip \[kg], a cube with the section's side. Default: that of a segment.
        pub grip_mass: Option<f64> = None, positive, "> 0 kg";
        /// A bearing that holds the grip on the axis, free to turn about it only. The cable then is
        /// drawn between its ends by the tension `force` when straight; the bearing takes up `moment`.
        pub bearing: bool = false;
        /// Force F on the grip along +x \[N]. Default: 0, or that of [`Specimen::Pull`].
        pub force: Option<f64> = None, finite, "finite";
        /// Torque T on the grip about +x \[N m], of fixed direction. Default: 0, or that of [`Specimen::Twist`].
        pub torque: Option<f64> = None, finite, "finite";
        /// Moment M on the grip across the cable \[N m], of fixed direction. Default: 0, or that of [`Specimen::Bend`].
        pub moment: Option<f64> = None, finite, "finite";
        /// Direction of the moment: its angle from +z towards +y about the cable \[rad]. At 0 the cable bends in the plane
        /// of x and y.
        pub moment_direction: f64 = 0.0, finite, "finite";
        /// `true` (the default) starts a simulation from the static equilibrium under its loads, since
        /// a load put on at once is a blow; `false` from the straight, unstrained specimen.
        pub equilibrium: bool = true;
        /// Seed of the segments' random angular velocities; 0 is none.
        pub seed: u64 = 0;
        /// Bound of each component of the random angular velocities \[rad/s].
        pub seed_rate: f64 = 1e-3, not_negative, "≥ 0 rad/s";
        /// Damping time τ of all rows \[s].
        pub damping: f64 = 0.0, not_negative, "≥ 0 s";
    }
}

/// A specimen with all defaults worked out: [`SpecimenParams::resolve`].
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolvedSpecimen {
    /// Number N of segments.
    pub segments: usize,
    /// Length l of a segment \[m].
    pub segment_length: f64,
    /// Mass of a segment \[kg].
    pub segment_mass: f64,
    /// Side of the cross-section \[m].
    pub side: f64,
    /// Mass of the grip \[kg].
    pub grip_mass: f64,
    /// Stiffness of the cable \[N, N m²].
    pub stiffness: Stiffness,
    /// Force on the grip along the cable, or the tension that its bearing draws \[N].
    pub force: f64,
    /// Torque on the grip about the cable \[N m].
    pub torque: f64,
    /// Moment on the grip across the cable \[N m].
    pub moment: f64,
}

impl ResolvedSpecimen {
    /// Length of cable that joint `joint` stands for \[m], 0 to N: l, and l/2 for the first and the last.
    #[must_use]
    pub fn joint_length(&self, joint: usize) -> f64 {
        let end = joint == 0 || joint == self.segments;
        self.segment_length * if end { 0.5 } else { 1.0 }
    }
}

impl SpecimenParams {
    /// Checks the parameters and works out their defaults.
    ///
    /// # Errors
    /// Names the parameter that is out of range, and what it has to be.
    pub fn resolve(&self) -> Result<ResolvedSpecimen, SceneError> {
        self.check_ranges()?;
        let material = self.material()?;
        let side = self.area.sqrt();
        let solid = Stiffness::new(&material, &CrossSection::Square { side });
        let stiffness = Stiffness {
            ea: self.ea.unwrap_or(solid.ea),
            ei: self.ei.unwrap_or(solid.ei),
            gj: self.gj.unwrap_or(solid.gj),
        };
        let segment_length = self.length / self.segments as f64;
        let segment_mass = material.density * self.area * segment_length;
        let load = |of: Specimen, given: Option<f64>, default: f64| {
            given.unwrap_or(if of == self.specimen { default } else { 0.0 })
        };
        let turn = std::f64::consts::TAU / self.length;
        let specimen = ResolvedSpecimen {
            segments: self.segments,
            segment_length,
            segment_mass,
            side,
            grip_mass: self.grip_mass.unwrap_or(segment_mass),
            stiffness,
            force: load(Specimen::Pull, self.force, 0.1 * stiffness.ea),
            torque: load(Specimen::Twist, self.torque, turn * stiffness.gj),
            moment: load(Specimen::Bend, self.moment, 0.25 * turn * stiffness.ei),
        };
        check_worked_out(&[
            ("segment length", specimen.segment_length),
            ("segment mass", specimen.segment_mass),
            ("side", specimen.side),
            ("grip_mass", specimen.grip_mass),
            ("ea", stiffness.ea),
            ("ei", stiffness.ei),
            ("gj", stiffness.gj),
        ])?;
        for (what, value) in [
            ("force", specimen.force),
            ("torque", specimen.torque),
            ("moment", specimen.moment),
        ] {
            check(what, value, value.abs() <= 1e150, "at most 1e150")?;
        }
        let shortest = -0.9 * stiffness.ea;
        let needs = "at least −0.9 YA: a specimen has a length left";
        check("force", specimen.force, specimen.force >= shortest, needs)?;
        Ok(specimen)
    }

    fn material(&self) -> Result<Material, SceneError> {
        let material = Material::find(&self.material)?;
        Ok(Material {
            young: self.young.unwrap_or(material.young),
            poisson: self.poisson.unwrap_or(material.poisson),
            density: self.density.unwrap_or(material.density),
        })
    }

    fn check_ranges(&self) -> Result<(), SceneError> {
        check_count("segments", self.segments, MAX_SEGMENTS)?;
        self.check_each()?;
        if self.joint == JointKind::Spherical {
            let reason = "a specimen of ball joints resists no load: use \"cosserat\" or \"paper\"";
            return refuse("joint", reason);
        }
        self.joint.check_twist(self.twist_definition)
    }

    /// Builds the straight, unstrained specimen. Bodies: the segments from the clamp, then the grip. Constraints: the
    /// clamp, the inner joints, the grip's joint, the bearing. Groups: the grip's joint and the bearing are 1, all
    /// others 0.
    ///
    /// # Errors
    /// As [`SpecimenParams::resolve`].
    pub fn build(&self) -> Result<Scene, SceneError> {
        let specimen = self.resolve()?;
        let (n, l, side) = (specimen.segments, specimen.segment_length, specimen.side);
        let mut scene = Scene::new(self.specimen.name());
        let segments = (0..n).map(|i| {
            let segment = Body::cuboid(Vector3::new(l, side, side), specimen.segment_mass);
            segment.at(Vector3::new(l * (i as f64 + 0.5), 0.0, 0.0))
        });
        let cable = Strand::begin(&mut scene, "cable");
        Strand::add_segments(&mut scene, cable, "segment", segments);
        let end = Vector3::new(self.length, 0.0, 0.0);
        let cube = Vector3::repeat(side);
        let mut grip = Body::cuboid(cube, specimen.grip_mass).at(end);
        let (y, z) = self.moment_direction.sin_cos();
        let moment = specimen.moment;
        grip.torque = Vector3::new(specimen.torque, moment * y, moment * z);
        if !self.bearing {
            grip.force.x = specimen.force;
        }
        let grip = scene.add_body("grip", grip);
        scene.load = Some(grip);
        let strand = Strand {
            twist_definition: self.twist_definition,
            back: -Vector3::x(),
            axes: Matrix3::identity(),
            ..Strand::new(self.joint, specimen.stiffness, self.damping)
        };
        let world = |point| Frame::world(point).with_axes(strand.axes);
        let grip_frame = Frame::body(grip, Vector3::zeros()).with_axes(strand.axes);
        let clamp = [world(Vector3::zeros()), strand.ends(0, l)[0]];
        strand.join(&mut scene, cable, "clamp", (self.joint, clamp), 0.5 * l);
        strand.join_segments(&mut scene, cable, "joint", 0..n, l);
        let held = [strand.ends(n - 1, l)[1], grip_frame];
        strand.join(&mut scene, cable, "grip", (self.joint, held), 0.5 * l);
        scene.groups[n] = 1;
        if self.bearing {
            let drawn = self.length * (1.0 + specimen.force / specimen.stiffness.ea);
            let place = world(Vector3::new(drawn, 0.0, 0.0));
            let law = JointLaw {
                stretch: Some(RowLaw::RIGID),
                bend: Some(RowLaw::RIGID),
                twist: None,
            };
            let frames = [place, grip_frame];
            let bearing = Constraint::Cosserat(Cosserat::new(frames, law));
            scene.add_constraint("bearing", bearing, 1);
        }
        let spins = &mut scene.bodies.angular_velocity[..n];
        seed::replace(spins, self.seed, self.seed_rate);
        scene.start_in_equilibrium = self.equilibrium;
        scene.validate()?;
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linearized::Linearized;
    use crate::testing::With;
    use std::f64::consts::PI;

    #[test]
    fn a_bearing_draws_the_cable() {
        let params =
            SpecimenParams::new(Specimen::Twist).with(|p| (p.bearing, p.force) = (true, Some(2e5)));
        let scene = params.build().expect("builds");
        assert_eq!(scene.bodies.force[24], Vector3::zeros());
        let bearing = &scene.constraints[25];
        assert_eq!(bearing.rows(), 5);
        let gap = Linearized::at(&scene, 0.0).phi[6 * 25];
        assert!((gap - 0.01).abs() < 1e-15);
    }

    #[test]
    fn moments_point_where_they_are_told_and_seeds_stay_small() {
        let params = SpecimenParams::new(Specimen::Bend)
            .with(|p| (p.moment, p.moment_direction, p.seed) = (Some(2.0), PI / 2.0, 3));
        let scene = params.build().expect("builds");
        let torque = scene.bodies.torque[24];
        assert!((torque - Vector3::new(0.0, 2.0, 0.0)).norm() < 1e-15);
        let spins = &scene.bodies.angular_velocity;
        assert!(
            spins[..24]
                .iter()
                .all(|w| w.amax() <= 1e-3 && w.amin() > 0.0)
        );
        assert_eq!(spins[24], Vector3::zeros());
    }
}
