//! The gantry crane: see [`GantryParams`].
//!
//! ```text
//!  crane   ════════╤═════════════  static; the beam lies along x, through the origin
//!  trolley       [═╧═]             on a slider with a motor
//!                 ║ ║              two massless cables side by side, each reeved through trolley and hook
//!  hook           [_]              a box
//!                  │               rigid cable of segments, as in the hoist
//!  load           [ ]              a cube
//! ```
//!
//! The hook block hangs in 2 n vertical falls, n of each massless cable, at x = ±½ `rope_spread.x` and between, y = ±½
//! `rope_spread.y`; the sheaves are points without friction, or with `sheaves` wheels as wide as the distance of two falls,
//! fixed to trolley and hook, with `sheave_friction`. Without friction the block keeps its direction about z, stays level as far
//! as its weight and its load do it, and rises by 1/n of what the winches haul in.
//!
//! [`Controls`] holds the values of [`TROLLEY_SPEED`] and [`HOIST_SPEED`].

mod build;

use nalgebra::Vector3;

use crate::cable::{End, JointKind, MAX_SEGMENTS};
use crate::error::{SceneError, check, refuse};
use crate::material::{Material, Stiffness};
use crate::params::{check_count, check_worked_out, not_negative, params, representable};

/// Name of the control that is the trolley's speed along x \[m/s].
pub const TROLLEY_SPEED: &str = "trolley_speed";
/// Name of the control that is the speed at which the hook block is lifted \[m/s].
pub const HOIST_SPEED: &str = "hoist_speed";

/// Most falls of a hoist cable.
const MAX_PARTS: usize = 12;

/// Inputs of the gantry's operator, set between two steps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Controls {
    /// Speed of the trolley along x \[m/s].
    pub trolley_speed: f64,
    /// Speed at which the hook block is lifted \[m/s]; negative lowers it.
    pub hoist_speed: f64,
}

impl Controls {
    /// The values in the order of the scene's controls: name and value \[m/s].
    #[must_use]
    pub fn values(&self) -> [(&'static str, f64); 2] {
        [
            (TROLLEY_SPEED, self.trolley_speed),
            (HOIST_SPEED, self.hoist_speed),
        ]
    }
}

params! {
    /// The gantry crane of \[SL §VIII, Fig. 14]: a trolley on a beam, a hook block on two massless cables, a rigid cable and a
    /// load, driven by an operator through the controls `trolley_speed` and `hoist_speed`.
    ///
    /// Parameters in SI units; `None` stands for the default that the field names.
    pub struct GantryParams, named "gantry" {
        /// Number of segments of the rigid cable between hook and load.
        pub segments: usize = 12, |n| n >= 1.0, "at least 1";
        /// Length of the rigid cable, unstrained \[m].
        pub cable_length: f64 = 4.0, representable, "> 0 m, 1e-150 to 1e150";
        /// Mass of a segment \[kg].
        pub segment_mass: f64 = 1.0, representable, "> 0 kg, 1e-150 to 1e150";
        /// Mass of the load over that of a segment, without unit.
        pub mass_ratio: f64 = 1000.0, representable, "> 0, 1e-150 to 1e150";
        /// Mass of the hook block \[kg]. Default: a quarter of the load's.
        pub hook_mass: Option<f64> = None;
        /// Mass of the trolley \[kg]. Default: half of the load's.
        pub trolley_mass: Option<f64> = None;
        /// Acceleration of gravity along −z \[m/s²], ≥ 0.
        pub gravity: f64 = 9.81, not_negative, "≥ 0 m/s²";
        /// Distance from the trolley's centre down to the top of the hook block \[m].
        pub drop: f64 = 6.0, representable, "> 0 m, 1e-150 to 1e150";
        /// Falls of each of the two hoist cables, 2 to 12.
        pub parts: usize = 2, |n| (2.0..=MAX_PARTS as f64).contains(&n), "2 to 12";
        /// Extent of the falls along x and y \[m], > 0.
        pub rope_spread: [f64; 2] = [0.4, 0.6], representable, "two lengths > 0 m";
        /// Hoist cables over sheaves between their falls, which do not turn, instead of through points.
        pub sheaves: bool = false;
        /// Coefficient of friction of these sheaves, over which the cables slip where the tensions differ by more than e^(πμ).
        pub sheave_friction: f64 = 0.0, not_negative, "≥ 0";
        /// Axial stiffness of each hoist cable \[N]; 0 for rigid ones.
        pub rope_ea: f64 = 2e7, not_negative, "≥ 0 N; 0 is rigid";
        /// Height of the hook block \[m]: from where it hangs to where the cable is attached; its centre is in the middle.
        pub hook_height: f64 = 0.6, representable, "> 0 m, 1e-150 to 1e150";
        /// Distance from the load's centre up to where the cable is attached \[m]. Default: half its edge.
        pub load_offset: Option<f64> = None, not_negative, "≥ 0 m";
        /// Axial stiffness YA of the rigid cable \[N].
        pub ea: f64 = 2e7, representable, "> 0 N, 1e-150 to 1e150";
        /// Bending stiffness YI \[N m²]. Default: of a solid round cable of steel.
        pub ei: Option<f64> = None;
        /// Torsional stiffness GJ \[N m²]. Default: of a solid round cable of steel.
        pub gj: Option<f64> = None;
        /// Kind of the cable's inner joints: `spherical`, `cosserat` or `paper`.
        pub joint: JointKind = JointKind::Cosserat;
        /// How the cable is held at hook and load: `spherical`, or `clamped`, which turns the load with the hook.
        pub attachment: End = End::Clamped;
        /// Largest force of the trolley's motor \[N]. Default: no limit. Zero lets the trolley roll freely.
        pub trolley_force: Option<f64> = None, not_negative, "≥ 0 N";
        /// Largest tension that each winch holds \[N]. Default: no limit.
        pub winch_force: Option<f64> = None, not_negative, "≥ 0 N";
        /// Drop at which hauling in stops \[m], > 0.
        pub least_drop: f64 = 1.0, representable, "> 0 m, 1e-150 to 1e150";
        /// A control for each hoist cable, `rope_1_speed` and `rope_2_speed`, instead of `hoist_speed`:
        /// the speed at which it lifts its side of the hook block.
        pub separate_ropes: bool = false;
        /// `true` starts a simulation from the static equilibrium near this pose, `false` from
        /// unstrained cables.
        pub equilibrium: bool = true;
        /// Seed of the segments' random angular velocities; 0 is none.
        pub seed: u64 = 1;
        /// Bound of each component of the random angular velocities \[rad/s].
        pub seed_rate: f64 = 1e-3, not_negative, "≥ 0 rad/s";
        /// Damping time τ of all rows but those of the motors \[s].
        pub damping: f64 = 0.0, not_negative, "≥ 0 s";
    }
}

/// A gantry with all defaults worked out: [`GantryParams::resolve`].
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolvedGantry {
    /// Length of a segment \[m].
    pub segment_length: f64,
    /// Radius of the rigid cable \[m].
    pub radius: f64,
    /// Mass of the load \[kg].
    pub load_mass: f64,
    /// Edge of the load, a cube of steel \[m].
    pub load_edge: f64,
    /// Distance from the load's centre up to where the cable is attached \[m].
    pub load_offset: f64,
    /// Mass of the hook block \[kg].
    pub hook_mass: f64,
    /// Mass of the trolley \[kg].
    pub trolley_mass: f64,
    /// Stiffness of the rigid cable.
    pub stiffness: Stiffness,
}

impl GantryParams {
    /// Checks the parameters and works out their defaults.
    ///
    /// # Errors
    /// Names the parameter that is out of range, and what it has to be.
    pub fn resolve(&self) -> Result<ResolvedGantry, SceneError> {
        self.check_ranges()?;
        let load_mass = self.mass_ratio * self.segment_mass;
        let load_edge = (load_mass / Material::STEEL.density).cbrt();
        let cable = Material::STEEL.round(self.ea, None, [self.ei, self.gj]);
        let (radius, stiffness) = (cable.radius, cable.stiffness);
        let gantry = ResolvedGantry {
            segment_length: self.cable_length / self.segments as f64,
            radius,
            load_mass,
            load_edge,
            load_offset: self.load_offset.unwrap_or(0.5 * load_edge),
            hook_mass: self.hook_mass.unwrap_or(0.25 * load_mass),
            trolley_mass: self.trolley_mass.unwrap_or(0.5 * load_mass),
            stiffness,
        };
        check_worked_out(&[
            ("segment length", gantry.segment_length),
            ("cable radius", radius),
            ("load mass", load_mass),
            ("load edge", load_edge),
            ("hook_mass", gantry.hook_mass),
            ("trolley_mass", gantry.trolley_mass),
            ("ei", stiffness.ei),
            ("gj", stiffness.gj),
        ])?;
        Ok(gantry)
    }

    /// Offsets of the falls of one hoist cable from the middle of trolley and hook, in the order of the cable \[m]; `side`
    /// is ±1.
    fn falls(&self, side: f64) -> impl Iterator<Item = Vector3<f64>> {
        let [x, y] = self.rope_spread;
        let (parts, step) = (self.parts, x / (self.parts - 1) as f64);
        (0..parts).map(move |k| Vector3::new(k as f64 * step - 0.5 * x, 0.5 * side * y, 0.0))
    }

    fn check_ranges(&self) -> Result<(), SceneError> {
        check_count("segments", self.segments, MAX_SEGMENTS)?;
        self.check_each()?;
        let lowered = self.drop >= self.least_drop;
        check("drop", self.drop, lowered, "at least least_drop")?;
        let rough = self.sheave_friction > 0.0;
        match (rough, self.sheaves, self.rope_ea > 0.0) {
            (true, false, _) => refuse(
                "sheave_friction",
                "is that of sheaves: set `sheaves = true`",
            ),
            (true, _, false) => {
                let reason = "leaves the tensions of rigid falls that stick undetermined: give the cables a stiffness `rope_ea`";
                refuse("sheave_friction", reason)
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::Constraint;
    use crate::testing::With;
    use crate::{Linearized, Mobility, check_jacobian};

    #[test]
    fn the_default_is_a_closed_geometry() {
        for parts in [2, 3, 4, 12] {
            let params = GantryParams::default().with(|p| p.parts = parts);
            let scene = params.build().expect("builds");
            let lin = Linearized::at(&scene, 0.0);
            assert!(lin.phi.iter().all(|phi| phi.abs() < 1e-12), "{:?}", lin.phi);
            for i in 0..scene.constraints.len() {
                let check = check_jacobian(&scene, i);
                assert!(check.max < 1e-7, "{}: {check:?}", scene.constraint_names[i]);
            }
            assert_eq!(scene.body_names[..3], ["crane", "trolley", "hook"]);
            assert_eq!(scene.bodies.mobility[0], Mobility::Static);
            let falls = scene.constraints.iter().filter_map(|c| match c {
                Constraint::MasslessCable(c) => Some(c.frames.len()),
                _ => None,
            });
            assert_eq!(falls.collect::<Vec<_>>(), [2 * parts; 2]);
        }
    }

    #[test]
    fn falls_over_sheaves_hang_as_those_over_points() {
        for (parts, friction) in [(2, 0.0), (3, 0.0), (12, 0.0), (2, 0.1), (4, 0.2), (12, 0.2)] {
            let params = GantryParams::default()
                .with(|p| (p.parts, p.sheaves, p.sheave_friction) = (parts, true, friction));
            let scene = params.build().expect("builds");
            let lin = Linearized::at(&scene, 0.0);
            assert!(lin.phi.iter().all(|phi| phi.abs() < 1e-12), "{:?}", lin.phi);
            let capstans = if friction > 0.0 { 2 * (parts - 1) } else { 0 };
            assert_eq!(scene.capstans.len(), capstans);
            for i in 0..capstans {
                assert!((scene.wrap(i) - std::f64::consts::PI).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn controls_drive_trolley_and_winches() {
        let mut scene = GantryParams::default().build().expect("builds");
        let names: Vec<_> = scene.controls.iter().map(|c| c.name.as_str()).collect();
        let controls = Controls {
            trolley_speed: 0.5,
            hoist_speed: 0.25,
        };
        assert_eq!(names, controls.values().map(|(name, _)| name));
        for (i, (_, value)) in controls.values().into_iter().enumerate() {
            scene.set_control(i, value, 0.0);
        }
        let mut lin = Linearized::at(&scene, 0.0);
        lin.drive(&scene, 0.0, 0.1);
        let driven: Vec<_> = lin.phi_t.iter().filter(|rate| **rate != 0.0).collect();
        // The motor's row, and two falls of each cable shorten by 0.25 m/s.
        assert_eq!(driven.len(), 3);
        assert_eq!(*driven[0], -0.5);
        assert!(driven[1..].iter().all(|rate| (**rate - 0.5).abs() < 1e-12));
    }

    #[test]
    fn each_rope_may_have_its_own_control() {
        let params = GantryParams::default().with(|p| p.separate_ropes = true);
        let mut scene = params.build().expect("builds");
        scene.set_control(scene.control("rope_2_speed").expect("there"), 0.25, 0.0);
        let mut lin = Linearized::at(&scene, 0.0);
        lin.drive(&scene, 0.0, 0.1);
        let ropes = ["rope-1", "rope-2"].map(|name| {
            let rope = scene.constraint(name).expect("there");
            lin.phi_t[lin.row_range(rope).start]
        });
        let found = (ropes[0], (ropes[1] - 0.5).abs() < 1e-12);
        assert!(found == (0.0, true), "{ropes:?}");
    }
}
