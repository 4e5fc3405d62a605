//! What is tracked: scenes × solvers, what is measured of each, and the bar of each error.

use super::measures::{Bars, Measure};
use crate::choice::Choice;
use crate::ladder;
use crate::reference;
use crate::scenes;
use std::fmt;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Controls, GantryParams, HoistParams, Network, NetworkParams, Scene};

/// Δt of all cases \[s].
pub const DT: f64 = 1.0 / 60.0;

/// A scene at the size that is tracked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// The hoist of the main job, its anchor moved.
    Hoist {
        /// Segments of the cable.
        segments: usize,
        /// Load over segment mass.
        mass_ratio: f64,
    },
    /// The gantry, driven along and upwards from its equilibrium.
    Gantry,
    /// A network of one size, as in [`scenes`], swinging about the line of its anchors.
    Network(Network, usize),
}

/// What the gantry is driven with, from rest.
const DRIVE: Controls = Controls {
    trolley_speed: 0.5,
    hoist_speed: 0.1,
};

/// Load over segment mass of the networks.
const NETWORK_RATIO: f64 = 100.0;

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hoist {
                segments,
                mass_ratio,
            } => write!(f, "hoist-{segments}-{mass_ratio:e}"),
            Self::Gantry => f.write_str("gantry"),
            Self::Network(network, size) => write!(f, "{}-{size}", network.name()),
        }
    }
}

impl Place {
    /// The parameters where this is a hoist.
    #[must_use]
    pub fn hoist(self) -> Option<HoistParams> {
        let Self::Hoist {
            segments,
            mass_ratio,
        } = self
        else {
            return None;
        };
        Some(HoistParams {
            segments,
            mass_ratio,
            ..ladder::Config::default().scene
        })
    }

    fn network(network: Network, size: usize) -> NetworkParams {
        scenes::Config::default().params(network, size, NETWORK_RATIO)
    }

    /// The scene at its beginning, in its static equilibrium.
    ///
    /// # Errors
    /// A scene that cannot be built or has no equilibrium.
    pub fn scene(self) -> Result<Scene, StepError> {
        if let Some(params) = self.hoist() {
            return Ok(reference::scene(&params)?);
        }
        match self {
            Self::Network(network, size) => scenes::swinging(&Self::network(network, size), DT),
            _ => {
                let scene = GantryParams::default().build()?;
                let options = scenes::reference_choice().options(DT);
                Ok(Stepper::new(scene, options)?.into_scene())
            }
        }
    }

    /// A stepper of `scene`, which is this one, driven as the case is.
    ///
    /// # Errors
    /// As [`Stepper::new`].
    pub fn stepper(self, scene: Scene, options: StepOptions) -> Result<Stepper, StepError> {
        let mut stepper = Stepper::new(scene, options)?;
        if self == Self::Gantry {
            stepper.set_controls(&DRIVE)?;
        }
        Ok(stepper)
    }
}

/// A tracked case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// The scene.
    pub place: Place,
    /// The solver, as the command line reads it; its options besides are those of [`Choice::options`].
    pub backend: &'static str,
    /// What its errors may be.
    pub bars: Bars,
    /// Whether a quick run has it.
    pub quick: bool,
}

const fn case(place: Place, backend: &'static str, bars: Bars) -> Case {
    Case {
        place,
        backend,
        bars,
        quick: false,
    }
}

const fn quick(case: Case) -> Case {
    Case {
        quick: true,
        ..case
    }
}

const fn hoist(segments: usize, mass_ratio: f64) -> Place {
    Place::Hoist {
        segments,
        mass_ratio,
    }
}

const fn bars(forward: f64, backward: f64, load: f64, elongation: f64) -> Bars {
    Bars {
        forward,
        backward,
        load,
        elongation,
    }
}

/// All cases. The bars stand about ten times above what was measured: of the multipliers' relative error against the
/// KKT system in extended precision; of the normwise backward error without refinement; of the load's distance from a
/// motion in finer steps (m); of the relative error of the hanging cable's elongation, for hoists.
pub const CASES: [Case; 19] = [
    quick(case(
        hoist(24, 1e3),
        "banded",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    )),
    case(hoist(24, 1e3), "faer:llt", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    case(
        hoist(24, 1e3),
        "nalgebra-sparse",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    ),
    case(hoist(24, 1e3), "umfpack", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    quick(case(
        hoist(24, 1e3),
        "cg:group",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    )),
    case(
        hoist(24, 1e3),
        "gauss-seidel:groups",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    ),
    case(hoist(24, 1e5), "banded", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    case(hoist(24, 1e5), "cg:group", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    case(hoist(100, 1e3), "banded", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    case(hoist(100, 1e3), "faer:llt", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    case(
        hoist(100, 1e3),
        "nalgebra-sparse",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    ),
    case(hoist(100, 1e3), "umfpack", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    case(hoist(100, 1e3), "cg:group", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    case(
        hoist(100, 1e3),
        "gauss-seidel:groups",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    ),
    case(hoist(1000, 1e3), "banded", bars(1e-14, 1e-15, 1e-2, 1e-10)),
    quick(case(
        Place::Gantry,
        "banded",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    )),
    case(
        Place::Network(Network::Ring, 24),
        "banded",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    ),
    case(
        Place::Network(Network::Ladder, 4),
        "banded",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    ),
    case(
        Place::Network(Network::Net, 8),
        "banded",
        bars(1e-14, 1e-15, 1e-2, 1e-10),
    ),
];

impl Case {
    /// `scene/backend`: what its figures are called, which does not change.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}/{}", self.place, self.backend)
    }

    /// The solver.
    ///
    /// # Errors
    /// Why it cannot be had: not compiled in.
    pub fn choice(&self) -> Result<Choice, String> {
        let choice: Choice = self.backend.parse()?;
        choice.check().map_err(|e| e.to_string())?;
        Ok(choice)
    }

    /// Whether the solver is one of the project's own, of which a step allocates nothing.
    #[must_use]
    pub fn is_own(&self) -> bool {
        ["banded", "gauss-seidel", "cg"]
            .iter()
            .any(|own| self.backend.starts_with(own))
    }

    /// Whether its instructions are counted. A step of an iteration is as long as its last digits make it, which differ
    /// between C libraries; UMFPACK is compiled in seldom.
    #[must_use]
    pub fn counts_instructions(&self) -> bool {
        ["banded", "faer", "nalgebra-sparse"]
            .iter()
            .any(|direct| self.backend.starts_with(direct))
    }

    /// What is measured of it, in the order of the tables.
    pub fn measures(&self) -> impl Iterator<Item = Measure> + use<> {
        let (counts, hoist) = (self.counts_instructions(), self.place.hoist().is_some());
        Measure::ALL.into_iter().filter(move |m| match m {
            Measure::Instructions => counts,
            Measure::ElongationError => hoist,
            _ => true,
        })
    }

    /// The bar of an error; no error may be larger.
    #[must_use]
    pub fn bar(&self, measure: Measure) -> Option<f64> {
        match measure {
            Measure::Allocations => self.is_own().then_some(0.0),
            Measure::ForwardError => Some(self.bars.forward),
            Measure::BackwardError => Some(self.bars.backward),
            Measure::LoadError => Some(self.bars.load),
            Measure::ElongationError => Some(self.bars.elongation),
            _ => None,
        }
    }
}

/// The case of a name.
///
/// # Errors
/// [`UnknownCase`].
pub fn named(name: &str) -> Result<Case, UnknownCase> {
    let found = CASES.into_iter().find(|case| case.name() == name);
    found.ok_or_else(|| UnknownCase {
        name: name.to_owned(),
    })
}

/// A name that no case has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownCase {
    /// The name.
    pub name: String,
}

impl fmt::Display for UnknownCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = CASES.map(|c| c.name()).join(", ");
        write!(
            f,
            "no case is called `{}`: choose one of {names}",
            self.name
        )
    }
}

impl std::error::Error for UnknownCase {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_lead_back() {
        let mut names = CASES.map(|case| case.name());
        for (case, name) in CASES.iter().zip(&names) {
            assert_eq!(named(name).as_ref(), Ok(case));
            let choice: Choice = case.backend.parse().unwrap();
            assert_eq!(choice.family(), case.backend, "{name}");
        }
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        let e = named("hoist-24/banded").unwrap_err().to_string();
        assert!(e.contains("hoist-24-1e3/banded, "), "{e}");
    }
}
