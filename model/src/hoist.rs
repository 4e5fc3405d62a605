//! The hoist: see [`HoistParams`].
//!
//! The cable starts at the origin and hangs along −z. Its segments are solid rods; the load is a solid steel sphere.
//! Inner joints stand for one segment length l of cable, the two end joints for l/2 each: a joint at the middle of
//! every stretch of cable that it stands for, so that the whole is L/EA, and a clamped end bends with an error of
//! second order in l.

mod build;

use crate::cable::{End, JointKind, MAX_SEGMENTS};
use crate::constraint::TwistDefinition;
use crate::error::{SceneError, check, refuse};
use crate::material::{Material, Stiffness};
use crate::params::{check_count, finite, not_negative, params, positive};

/// Which joint is a group of its own, for block Gauss–Seidel over groups \[SL §VI-A]. All others are one group.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "toml", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "toml", serde(rename_all = "kebab-case"))]
pub enum Apart {
    /// The load's joint.
    #[default]
    Load,
    /// The anchor: the cable and its load are one group, as \[SL §VIII] has it.
    Anchor,
}

params! {
    /// The main scene: one cable that hangs from the world, and a load at its lower end.
    ///
    /// Parameters in SI units; `None` stands for the default that the field names.
    pub struct HoistParams, named "hoist" {
        /// Number of segments, 1 to 10 million.
        pub segments: usize = 24, |n| n >= 1.0, "at least 1";
        /// Length of the unstrained cable \[m].
        pub length: f64 = 10.0, positive, "> 0 m";
        /// Mass of a segment \[kg]. Default: from density and radius when `material` or `radius` is given, else 1 kg.
        pub segment_mass: Option<f64> = None, positive, "> 0 kg";
        /// Mass of the load over that of a segment, without unit.
        pub mass_ratio: f64 = 1000.0, positive, "> 0";
        /// Mass of the load \[kg]; replaces `mass_ratio` when given.
        pub load_mass: Option<f64> = None, positive, "> 0 kg";
        /// Mass of the uppermost segment \[kg], with as much more inertia: \[SL §VII-B] gives both end segments the load's.
        /// Default: that of the others.
        pub top_mass: Option<f64> = None, positive, "> 0 kg";
        /// Which joint is a group of its own: `load` or `anchor`.
        pub apart: Apart = Apart::Load;
        /// Acceleration of gravity along −z \[m/s²], ≥ 0.
        pub gravity: f64 = 9.81, not_negative, "≥ 0 m/s²";
        /// `steel`, `nylon` or `rubber`. Default: steel.
        pub material: Option<String> = None;
        /// Radius of the cable \[m]. Default: that of a solid cable of the material with stiffness `ea`.
        pub radius: Option<f64> = None, positive, "> 0 m";
        /// Axial stiffness YA \[N]. Default: from material and radius when `radius` is given, else 2·10⁷ N.
        pub ea: Option<f64> = None, positive, "> 0 N";
        /// Bending stiffness YI \[N m²]. Default: of a solid round cable, EA r²/4.
        pub ei: Option<f64> = None, positive, "> 0 N m²";
        /// Torsional stiffness GJ \[N m²]. Default: of a solid round cable, EI/(1 + ν).
        pub gj: Option<f64> = None, positive, "> 0 N m²";
        /// Kind of the inner joints: `spherical`, `cosserat` or `paper`.
        pub joint: JointKind = JointKind::Cosserat;
        /// Between which vectors `paper` joints take the twist angle: `ordinary` or `alternative`; other kinds have the
        /// ordinary one only.
        pub twist_definition: TwistDefinition = TwistDefinition::Ordinary;
        /// Stretch rows in the joints. A cable needs them: `false` is refused.
        pub stretch: bool = true;
        /// Bend rows in the joints. Default: all kinds but `spherical`.
        pub bend: Option<bool> = None;
        /// Twist row in the joints. Default: all kinds but `spherical`.
        pub twist: Option<bool> = None;
        /// How the upper end is held by the world: `spherical` or `clamped`.
        pub anchor: End = End::Spherical;
        /// How the load is held by the lower end: `spherical` or `clamped`.
        pub attachment: End = End::Spherical;
        /// Distance of the hook point above the load's centre \[m].
        pub load_offset: f64 = 0.0, finite, "finite";
        /// Rotation of the straight cable with its load about the y axis through the anchor, at the start \[rad].
        pub initial_angle: f64 = 0.0, finite, "finite";
        /// `true` starts a simulation from the static equilibrium near this pose, `false` from the
        /// unstrained cable.
        pub equilibrium: bool = false;
        /// Seed of the segments' random angular velocities; 0 is none.
        pub seed: u64 = 0;
        /// Bound of each component of the random angular velocities \[rad/s].
        pub seed_rate: f64 = 1e-3, not_negative, "≥ 0 rad/s";
        /// Damping time τ of all rows \[s].
        pub damping: f64 = 0.0, not_negative, "≥ 0 s";
        /// Displacement of the anchor along x \[m].
        pub move_x: f64 = 0.0, finite, "finite";
        /// Time at which the anchor starts to move \[s].
        pub move_start: f64 = 0.0, finite, "finite";
        /// How long the anchor moves \[s].
        pub move_duration: f64 = 1.0, positive, "> 0 s";
        /// Radius of a horizontal circle that the anchor moves on \[m]; excludes `move_x`. It starts at `move_start`.
        pub circle_radius: f64 = 0.0, not_negative, "≥ 0 m";
        /// Time of one turn on that circle \[s], and of the run-up to it.
        pub circle_period: f64 = 4.0, positive, "> 0 s";
    }
}

/// A hoist with all defaults worked out: [`HoistParams::resolve`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hoist {
    /// Number of segments.
    pub segments: usize,
    /// Length of a segment \[m].
    pub segment_length: f64,
    /// Mass of a segment \[kg].
    pub segment_mass: f64,
    /// Radius of the cable \[m].
    pub radius: f64,
    /// Mass of the load \[kg].
    pub load_mass: f64,
    /// Mass of the uppermost segment \[kg].
    pub top_mass: f64,
    /// Stiffness of the cable.
    pub stiffness: Stiffness,
}

impl HoistParams {
    /// Checks the parameters and works out their defaults.
    ///
    /// # Errors
    /// Names the parameter that is out of range, and what it has to be.
    pub fn resolve(&self) -> Result<Hoist, SceneError> {
        check_count("segments", self.segments, MAX_SEGMENTS)?;
        self.check_each()?;
        self.check_conflicts()?;
        let material = Material::find(self.material.as_deref().unwrap_or("steel"))?;
        let of_radius = self.radius.map(|radius| material.round_stiffness(radius));
        let ea = self.ea.or(of_radius).unwrap_or(2e7);
        let cable = material.round(ea, self.radius, [self.ei, self.gj]);
        let segment_length = self.length / self.segments as f64;
        let from_density = self.material.is_some() || self.radius.is_some();
        let segment_mass = match self.segment_mass {
            Some(mass) => mass,
            None if from_density => cable.density * segment_length,
            None => 1.0,
        };
        let hoist = Hoist {
            segments: self.segments,
            segment_length,
            segment_mass,
            radius: cable.radius,
            load_mass: self.load_mass.unwrap_or(self.mass_ratio * segment_mass),
            top_mass: self.top_mass.unwrap_or(segment_mass),
            stiffness: cable.stiffness,
        };
        hoist.check_representable()
    }

    fn check_conflicts(&self) -> Result<(), SceneError> {
        if self.move_x != 0.0 && self.circle_radius != 0.0 {
            return refuse("circle_radius", "excludes move_x: set one of them to 0");
        }
        if !self.stretch {
            let reason = "a cable without stretch rows is not connected: leave it true";
            return refuse("stretch", reason);
        }
        self.joint.check_twist(self.twist_definition)?;
        if self.joint == JointKind::Spherical {
            let reason =
                "spherical joints have stretch rows only: use joint = \"cosserat\" or \"paper\"";
            for (what, given) in [
                ("bend", self.bend == Some(true)),
                ("twist", self.twist == Some(true)),
                ("anchor", self.anchor == End::Clamped),
                ("attachment", self.attachment == End::Clamped),
            ] {
                if given {
                    return refuse(what, reason);
                }
            }
        }
        Ok(())
    }
}

impl Hoist {
    /// Gaps ε_j T_j of the hanging cable at rest \[m], from the anchor to the load's joint, under `gravity` (m/s²).
    pub fn gaps(&self, gravity: f64) -> impl Iterator<Item = f64> {
        let hoist = *self;
        (0..=hoist.segments).map(move |j| {
            let below = (hoist.segments - j) as f64;
            let mut mass = hoist.load_mass + hoist.segment_mass * below;
            if j == 0 && hoist.top_mass != hoist.segment_mass {
                mass += hoist.top_mass - hoist.segment_mass;
            }
            let tension = gravity * mass;
            let end = j == 0 || j == hoist.segments;
            let length = hoist.segment_length * if end { 0.5 } else { 1.0 };
            length / hoist.stiffness.ea * tension
        })
    }

    /// Extreme inputs can under- or overflow on the way: catch it here, where the parameters are known.
    fn check_representable(self) -> Result<Self, SceneError> {
        for (what, value) in [
            ("segment length", self.segment_length),
            ("segment mass", self.segment_mass),
            ("cable radius", self.radius),
            ("load mass", self.load_mass),
            ("top mass", self.top_mass),
            ("ea", self.stiffness.ea),
            ("ei", self.stiffness.ei),
            ("gj", self.stiffness.gj),
        ] {
            let needs = "between 1e-300 and 1e300 when all is worked out";
            check(what, value, (1e-300..=1e300).contains(&value), needs)?;
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::CrossSection;
    use crate::testing::With;
    use std::f64::consts::PI;

    #[test]
    fn stiffness_defaults_are_those_of_a_steel_circle() {
        let hoist = HoistParams::default().resolve().expect("sound");
        let section = CrossSection::Circle {
            radius: hoist.radius,
        };
        let steel = Stiffness::new(&Material::STEEL, &section);
        assert!((steel.ea / hoist.stiffness.ea - 1.0).abs() < 1e-14);
        assert!((steel.ei / hoist.stiffness.ei - 1.0).abs() < 1e-14);
        assert!((steel.gj / hoist.stiffness.gj - 1.0).abs() < 1e-14);
        assert!((hoist.stiffness.ei - 159.155).abs() < 1e-3);
    }

    #[test]
    fn material_and_radius_give_mass_and_stiffness() {
        let params = HoistParams {
            material: Some("nylon".into()),
            radius: Some(0.02),
            mass_ratio: 7.0,
            ..HoistParams::default()
        };
        let hoist = params.resolve().expect("sound");
        let mass = 1150.0 * PI * 4e-4 * 10.0 / 24.0;
        assert!((hoist.segment_mass - mass).abs() < 1e-12);
        assert!((hoist.load_mass - 7.0 * mass).abs() < 1e-11);
        assert!((hoist.stiffness.ea - 3e9 * PI * 4e-4).abs() < 1e-6);
        let load = params.with(|p| p.load_mass = Some(3.0));
        assert_eq!(load.resolve().expect("sound").load_mass, 3.0);
    }
}
