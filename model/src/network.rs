//! Cables with branches and loops: see [`NetworkParams`].
//!
//! All lie in the plane of x and z, with gravity along −z and the world's points at z = 0. Cables are made as in the
//! hoist: solid rods of length l = L/N, inner joints that stand for l of cable, end joints for l/2 that are ball joints.
//! The start closes the geometry exactly: every gap is zero up to rounding.
//!
//! ```text
//! ring       a closed cable that hangs from one or two points, the load at its bottom
//! junction   two cables from the world to one body, and a third with the load below it
//! cranes     two cables from the world to the ends of one beam
//! ladder     k cables side by side from the world to one beam, with links between neighbours every few segments
//! net        n × m point masses with links to their neighbours, held at its upper edge or upper corners
//! ```
//!
//! Bending alone carries no load here, so the joints may be ball joints. Where each constraint is a group is read off
//! the topology: one group for what forms trees, one for what closes loops.

mod build;
#[cfg(test)]
mod tests;

use crate::cable::{JointKind, MAX_SEGMENTS};
use crate::error::{SceneError, check, refuse};
use crate::material::{Material, Stiffness};
use crate::params::{check_count, check_worked_out, not_negative, params, positive, scenes};

scenes! {
    /// Which scene it is.
    pub enum Network {
        /// A closed cable.
        Ring = "ring",
        /// Three cables that meet in a body.
        Junction = "junction",
        /// Two cables that carry one beam.
        Cranes = "cranes",
        /// Parallel cables with links between them.
        Ladder = "ladder",
        /// Point masses with links in two directions.
        Net = "net",
    }
}

/// Where the world holds a net.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "toml", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "toml", serde(rename_all = "kebab-case"))]
pub enum Held {
    /// At all nodes of the upper edge.
    #[default]
    Edge,
    /// At the two ends of the upper edge, between which the net sags.
    Corners,
}

params! {
    /// Cables with branches and loops: a ring, a Y, two cranes with one load, a ladder of cables, a net.
    ///
    /// Parameters in SI units; `None` stands for the default that the field names. What a scene has no use for is
    /// not looked at.
    pub struct NetworkParams, of network: Network {
        /// Number N of segments of the ring, or of each cable; a ring needs 8. Not in `net`.
        pub segments: usize = 24;
        /// Length L of the ring, or of each unstrained cable; of the net's longer side \[m].
        pub length: f64 = 10.0, positive, "> 0 m";
        /// Mass of a segment, or of a node of the net \[kg].
        pub segment_mass: f64 = 1.0, positive, "> 0 kg";
        /// Mass of the load over that of a segment, without unit. In the net each node of the lowest row is such a load.
        pub mass_ratio: f64 = 100.0, positive, "> 0";
        /// Acceleration of gravity along −z \[m/s²], ≥ 0.
        pub gravity: f64 = 9.81, not_negative, "≥ 0 m/s²";
        /// Axial stiffness YA \[N], of the links too.
        pub ea: f64 = 2e7, positive, "> 0 N";
        /// Bending stiffness YI \[N m²]. Default: of a solid round cable of steel. Not in `net`.
        pub ei: Option<f64> = None, positive, "> 0 N m²";
        /// Torsional stiffness GJ \[N m²]. Default: of a solid round cable of steel. Not in `net`.
        pub gj: Option<f64> = None, positive, "> 0 N m²";
        /// Kind of the inner joints: `spherical` or `cosserat`. Not in `net`.
        pub joint: JointKind = JointKind::Cosserat;
        /// Points from which the ring hangs, 1 or 2. Only in `ring`.
        pub points: usize = 2, |n| n == 1.0 || n == 2.0, "1 or 2";
        /// Number k of the ladder's cables, at least 2. Only in `ladder`.
        pub cables: usize = 4, |n| n >= 2.0, "at least 2";
        /// Distance of the ladder's cables \[m]. Only in `ladder`.
        pub spacing: f64 = 0.5, positive, "> 0 m";
        /// Segments between the ladder's links. Only in `ladder`.
        pub rung_every: usize = 4, |n| n >= 1.0, "at least 1";
        /// Rows of the net, the lowest of which are the loads; at least 2. Only in `net`.
        pub rows: usize = 8, |n| n >= 2.0, "at least 2";
        /// Columns of the net, at least 2. Only in `net`.
        pub columns: usize = 8, |n| n >= 2.0, "at least 2";
        /// Where the world holds the net. Only in `net`.
        pub held: Held = Held::Edge;
        /// `true` starts a simulation from the static equilibrium near the start, `false` from the
        /// unstrained pose.
        pub equilibrium: bool = true;
        /// Seed of random angular velocities of the segments, in the net of velocities of the nodes; 0 is none.
        pub seed: u64 = 0;
        /// Bound of each component of the random angular velocities \[rad/s]; in the net of the velocities \[m/s].
        pub seed_rate: f64 = 1e-3, not_negative, "≥ 0";
        /// Damping time τ of all rows \[s].
        pub damping: f64 = 0.0, not_negative, "≥ 0 s";
    }
}

/// A network with all defaults worked out: [`NetworkParams::resolve`].
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolvedNetwork {
    /// Length of a segment, or of a net's link \[m].
    pub segment_length: f64,
    /// Radius of the cable \[m].
    pub radius: f64,
    /// Mass of the load, or of each of a net's loads \[kg].
    pub load_mass: f64,
    /// Stiffness of the cable.
    pub stiffness: Stiffness,
}

impl NetworkParams {
    /// Checks the parameters and works out their defaults.
    ///
    /// # Errors
    /// Names the parameter that is out of range, and what it has to be.
    pub fn resolve(&self) -> Result<ResolvedNetwork, SceneError> {
        self.check_ranges()?;
        let parts = match self.network {
            Network::Net => self.rows.max(self.columns) - 1,
            _ => self.segments,
        };
        let cable = Material::STEEL.round(self.ea, None, [self.ei, self.gj]);
        let (radius, stiffness) = (cable.radius, cable.stiffness);
        let network = ResolvedNetwork {
            segment_length: self.length / parts as f64,
            radius,
            load_mass: self.mass_ratio * self.segment_mass,
            stiffness,
        };
        check_worked_out(&[
            ("segment length", network.segment_length),
            ("cable radius", radius),
            ("load mass", network.load_mass),
            ("ei", stiffness.ei),
            ("gj", stiffness.gj),
        ])?;
        Ok(network)
    }

    fn check_ranges(&self) -> Result<(), SceneError> {
        self.check_each()?;
        let least = if self.network == Network::Ring { 8 } else { 1 };
        let needs = "at least 1, for a ring at least 8";
        let n = self.segments;
        check("segments", n as f64, n >= least, needs)?;
        let (what, bodies) = match self.network {
            Network::Net => ("rows × columns", self.rows.saturating_mul(self.columns)),
            Network::Ladder => ("segments × cables", n.saturating_mul(self.cables)),
            _ => ("segments", self.segments),
        };
        check_count(what, bodies, MAX_SEGMENTS)?;
        if self.joint == JointKind::Paper {
            let reason = "a network has \"spherical\" or \"cosserat\" joints";
            return refuse("joint", reason);
        }
        Ok(())
    }
}
