//! Cables with branches and loops: a ring, a Y, two cranes with one load, a ladder of cables, a net.
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
use crate::error::{SceneError, check};
use crate::material::{Material, Stiffness};

/// Which scene it is.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Network {
    /// A closed cable.
    #[default]
    Ring,
    /// Three cables that meet in a body.
    Junction,
    /// Two cables that carry one beam.
    Cranes,
    /// Parallel cables with links between them.
    Ladder,
    /// Point masses with links in two directions.
    Net,
}

impl Network {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Ring,
        Self::Junction,
        Self::Cranes,
        Self::Ladder,
        Self::Net,
    ];

    /// Name of its scene: `ring`, `junction`, `cranes`, `ladder`, `net`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ring => "ring",
            Self::Junction => "junction",
            Self::Cranes => "cranes",
            Self::Ladder => "ladder",
            Self::Net => "net",
        }
    }

    /// The network with that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|n| n.name() == name)
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

/// Parameters of a network. SI units; `None` stands for the default that the field names. What a scene has no use for is
/// not looked at.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "toml", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "toml", serde(default, deny_unknown_fields))]
pub struct NetworkParams {
    /// Which scene it is. Not part of a scene's text: the table's name says it.
    #[cfg_attr(feature = "toml", serde(skip))]
    pub network: Network,
    /// Number N of segments of the ring, or of each cable; a ring needs 8. Not in `net`.
    pub segments: usize,
    /// Length L of the ring, or of each unstrained cable; of the net's longer side \[m].
    pub length: f64,
    /// Mass of a segment, or of a node of the net \[kg].
    pub segment_mass: f64,
    /// Mass of the load over that of a segment, without unit. In the net each node of the lowest row is such a load.
    pub mass_ratio: f64,
    /// Acceleration of gravity along −z \[m/s²], ≥ 0.
    pub gravity: f64,
    /// Axial stiffness YA \[N], of the links too.
    pub ea: f64,
    /// Bending stiffness YI \[N m²]. Default: of a solid round cable of steel. Not in `net`.
    pub ei: Option<f64>,
    /// Torsional stiffness GJ \[N m²]. Default: of a solid round cable of steel. Not in `net`.
    pub gj: Option<f64>,
    /// Kind of the inner joints: `spherical` or `cosserat`. Not in `net`.
    pub joint: JointKind,
    /// Points from which the ring hangs, 1 or 2. Only in `ring`.
    pub points: usize,
    /// Number k of the ladder's cables, at least 2. Only in `ladder`.
    pub cables: usize,
    /// Distance of the ladder's cables \[m]. Only in `ladder`.
    pub spacing: f64,
    /// Segments between the ladder's links. Only in `ladder`.
    pub rung_every: usize,
    /// Rows of the net, the lowest of which are the loads; at least 2. Only in `net`.
    pub rows: usize,
    /// Columns of the net, at least 2. Only in `net`.
    pub columns: usize,
    /// Where the world holds the net. Only in `net`.
    pub held: Held,
    /// `true` starts a simulation from the static equilibrium near the start, `false` from the
    /// unstrained pose.
    pub equilibrium: bool,
    /// Seed of random angular velocities of the segments, in the net of velocities of the nodes; 0 is none.
    pub seed: u64,
    /// Bound of each component of the random angular velocities \[rad/s]; in the net of the velocities \[m/s].
    pub seed_rate: f64,
    /// Damping time τ of all rows \[s].
    pub damping: f64,
}

impl Default for NetworkParams {
    fn default() -> Self {
        Self {
            network: Network::Ring,
            segments: 24,
            length: 10.0,
            segment_mass: 1.0,
            mass_ratio: 100.0,
            gravity: 9.81,
            ea: 2e7,
            ei: None,
            gj: None,
            joint: JointKind::Cosserat,
            points: 2,
            cables: 4,
            spacing: 0.5,
            rung_every: 4,
            rows: 8,
            columns: 8,
            held: Held::Edge,
            equilibrium: true,
            seed: 0,
            seed_rate: 1e-3,
            damping: 0.0,
        }
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
    /// The default parameters of a network.
    #[must_use]
    pub fn new(network: Network) -> Self {
        Self {
            network,
            ..Self::default()
        }
    }

    /// Checks the parameters and works out their defaults.
    ///
    /// # Errors
    /// Names the parameter that is out of range, and what it has to be.
    pub fn resolve(&self) -> Result<ResolvedNetwork, SceneError> {
        self.check_counts()?;
        self.check_ranges()?;
        let parts = match self.network {
            Network::Net => self.rows.max(self.columns) - 1,
            _ => self.segments,
        };
        let radius = Material::STEEL.round_radius(self.ea);
        let stiffness =
            Stiffness::of_round(self.ea, radius, Material::STEEL.poisson, [self.ei, self.gj]);
        let network = ResolvedNetwork {
            segment_length: self.length / parts as f64,
            radius,
            load_mass: self.mass_ratio * self.segment_mass,
            stiffness,
        };
        for (what, value) in [
            ("segment length", network.segment_length),
            ("cable radius", radius),
            ("load mass", network.load_mass),
            ("ei", stiffness.ei),
            ("gj", stiffness.gj),
        ] {
            let needs = "between 1e-150 and 1e150 when all is worked out";
            check(what, value, (1e-150..=1e150).contains(&value), needs)?;
        }
        Ok(network)
    }

    fn check_counts(&self) -> Result<(), SceneError> {
        let least = if self.network == Network::Ring { 8 } else { 1 };
        for (what, value, ok, needs) in [
            (
                "segments",
                self.segments,
                self.segments >= least,
                "at least 1, for a ring at least 8",
            ),
            (
                "points",
                self.points,
                matches!(self.points, 1 | 2),
                "1 or 2",
            ),
            ("cables", self.cables, self.cables >= 2, "at least 2"),
            (
                "rung_every",
                self.rung_every,
                self.rung_every >= 1,
                "at least 1",
            ),
            ("rows", self.rows, self.rows >= 2, "at least 2"),
            ("columns", self.columns, self.columns >= 2, "at least 2"),
        ] {
            check(what, value as f64, ok, needs)?;
        }
        let (what, bodies) = match self.network {
            Network::Net => ("rows × columns", self.rows.saturating_mul(self.columns)),
            Network::Ladder => (
                "segments × cables",
                self.segments.saturating_mul(self.cables),
            ),
            _ => ("segments", self.segments),
        };
        if bodies > MAX_SEGMENTS {
            return Err(SceneError::TooLarge {
                what,
                value: bodies,
                limit: MAX_SEGMENTS,
            });
        }
        Ok(())
    }

    fn check_ranges(&self) -> Result<(), SceneError> {
        for (what, value, needs) in [
            ("length", Some(self.length), "> 0 m"),
            ("segment_mass", Some(self.segment_mass), "> 0 kg"),
            ("mass_ratio", Some(self.mass_ratio), "> 0"),
            ("ea", Some(self.ea), "> 0 N"),
            ("ei", self.ei, "> 0 N m²"),
            ("gj", self.gj, "> 0 N m²"),
            ("spacing", Some(self.spacing), "> 0 m"),
        ] {
            if let Some(value) = value {
                check(what, value, value > 0.0, needs)?;
            }
        }
        for (what, value, needs) in [
            ("gravity", self.gravity, "≥ 0 m/s²"),
            ("seed_rate", self.seed_rate, "≥ 0"),
            ("damping", self.damping, "≥ 0 s"),
        ] {
            check(what, value, value >= 0.0, needs)?;
        }
        if self.joint == JointKind::Paper {
            return Err(SceneError::Conflict {
                what: "joint".into(),
                reason: "a network has \"spherical\" or \"cosserat\" joints",
            });
        }
        Ok(())
    }
}
