//! Tracked cases: scenes × solvers, their measures, and the bar of each error.

use super::measures::Measure;
use super::start::PASS;
use std::fmt;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_measure::choice::Choice;
use taut_measure::reference;
use taut_model::{
    ContactScene, ContactSceneParams, Controls, GantryParams, HoistParams, Network, NetworkParams,
    Scene,
};
use taut_studies::ladder;
use taut_studies::scenes;

/// Δt of all cases \[s].
pub const DT: f64 = 1.0 / 60.0;

/// A scene at the size that is tracked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Workload {
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
    /// A load dragged over the floor by a cable that lies on it.
    Floor,
}

/// Drive of the gantry from rest \[m/s].
const DRIVE: Controls = Controls {
    trolley_speed: 0.5,
    hoist_speed: 0.1,
};

/// Load over segment mass of the networks.
const NETWORK_RATIO: f64 = 100.0;

/// Load over segment mass on the floor.
const FLOOR_RATIO: f64 = 1e3;

impl fmt::Display for Workload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hoist {
                segments,
                mass_ratio,
            } => write!(f, "hoist-{segments}-{mass_ratio:e}"),
            Self::Gantry => f.write_str("gantry"),
            Self::Floor => write!(f, "floor-{FLOOR_RATIO:e}"),
            Self::Network(network, size) => write!(f, "{}-{size}", network.name()),
        }
    }
}

impl Workload {
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
            ..ladder::Config::new(false).scene
        })
    }

    fn network(network: Network, size: usize) -> NetworkParams {
        scenes::Config::new(false).params(network, size, NETWORK_RATIO)
    }

    /// The scene at its beginning, in its static equilibrium.
    pub fn scene(self) -> Result<Scene, StepError> {
        if let Some(params) = self.hoist() {
            return Ok(reference::scene(&params)?);
        }
        match self {
            Self::Network(network, size) => scenes::swinging(&Self::network(network, size), DT),
            Self::Floor => {
                let params = ContactSceneParams {
                    mass_ratio: FLOOR_RATIO,
                    ..ContactSceneParams::new(ContactScene::Floor)
                };
                Ok(params.build()?)
            }
            _ => {
                let scene = GantryParams::default().build()?;
                let options = scenes::reference_choice().options(DT);
                Ok(Stepper::new(scene, options)?.into_scene())
            }
        }
    }

    /// A stepper of `scene`, which is this one, driven as the case is.
    pub fn stepper(self, scene: Scene, options: StepOptions) -> Result<Stepper, StepError> {
        let mut stepper = Stepper::new(scene, options)?;
        if self == Self::Gantry {
            stepper.set_controls(&DRIVE)?;
        }
        Ok(stepper)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// The scene.
    pub workload: Workload,
    /// The solver, as the command line reads it; its options besides are those of [`Choice::options`].
    pub backend: &'static str,
    /// Largest errors that pass, in the order of `BARRED`; infinite without a bar.
    pub bars: [f64; 4],
    /// Takes part in a quick run.
    pub quick: bool,
}

/// Measures that a case has a bar for; the last one is of hoists alone.
const BARRED: [Measure; 4] = [
    Measure::ForwardError,
    Measure::BackwardError,
    Measure::LoadError,
    Measure::ElongationError,
];

const fn case(workload: Workload, backend: &'static str, bars: [f64; 4]) -> Case {
    Case {
        workload,
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

const fn hoist(segments: usize, mass_ratio: f64) -> Workload {
    Workload::Hoist {
        segments,
        mass_ratio,
    }
}

const HOIST: Workload = hoist(24, 1e3);
const HEAVY: Workload = hoist(24, 1e5);
const LONG: Workload = hoist(100, 1e3);
const LONGEST: Workload = hoist(1000, 1e3);
const RING: Workload = Workload::Network(Network::Ring, 24);
const LADDER: Workload = Workload::Network(Network::Ladder, 4);
const NET: Workload = Workload::Network(Network::Net, 8);
/// No bar: an iteration that does not converge there, or a scene without that error. Nor has the componentwise backward
/// error of any iteration: they stop by a norm, in which small components do not count.
const NONE: f64 = f64::INFINITY;

/// All cases, with the bars of their errors: of the multipliers against extended precision (relative), of the
/// componentwise backward error without refinement, of the load's place against finer steps (m), of the hanging cable's
/// elongation (relative).
///
/// They stand about ten times above what was measured; those of the load three times, since that is the time step's own
/// error and hardly depends on rounding.
pub const CASES: [Case; 21] = [
    quick(case(HOIST, "banded", [2e-15, 2e-14, 1e-4, 5e-13])),
    case(HOIST, "faer:llt", [2e-15, 2e-14, 1e-4, 5e-13]),
    case(HOIST, "nalgebra-sparse", [2e-15, 2e-14, 1e-4, 5e-13]),
    case(HOIST, "umfpack", [2e-15, 7e-14, 1e-4, 5e-13]),
    quick(case(HOIST, "cg:group", [3e-12, NONE, 1e-4, 5e-11])),
    // Does not converge: what its sweeps cost.
    case(HOIST, "gauss-seidel:groups", [1e-3, NONE, NONE, NONE]),
    case(HEAVY, "banded", [5e-15, 5e-15, 1e-4, 1e-13]),
    case(HEAVY, "cg:group", [6e-13, NONE, 1e-4, 3e-10]),
    case(LONG, "banded", [3e-15, 3e-15, 1e-4, 3e-12]),
    case(LONG, "faer:llt", [3e-15, 3e-15, 1e-4, 3e-12]),
    case(LONG, "nalgebra-sparse", [3e-15, 3e-15, 1e-4, 3e-12]),
    case(LONG, "umfpack", [3e-15, 3e-15, 1e-4, 3e-12]),
    case(LONG, "cg:group", [1e-11, NONE, 1e-4, 5e-11]),
    case(LONG, "gauss-seidel:groups", [5e-4, NONE, NONE, NONE]),
    case(LONGEST, "banded", [1e-14, 5e-15, 3e-4, 1e-12]),
    quick(case(Workload::Gantry, "banded", [1e-15, 2e-15, 1e-2, NONE])),
    case(RING, "banded", [5e-15, 3e-15, 4e-4, NONE]),
    case(LADDER, "banded", [2e-15, 1e-13, 4e-4, NONE]),
    case(NET, "banded", [8e-15, 8e-15, 3e-4, NONE]),
    case(NET, "gauss-seidel:groups", [1e-12, NONE, 3e-4, NONE]),
    case(Workload::Floor, "banded", [5e-14, 3e-13, 1e-2, NONE]),
];

impl Case {
    /// `scene/backend`: what its figures are called, which does not change.
    pub fn name(&self) -> String {
        format!("{}/{}", self.workload, self.backend)
    }

    pub fn choice(&self) -> Result<Choice, String> {
        let choice: Choice = self.backend.parse()?;
        choice.check().map_err(|e| e.to_string())?;
        Ok(choice)
    }

    /// True for the project's own solvers, whose steps allocate nothing.
    pub fn is_own(&self) -> bool {
        ["banded", "gauss-seidel", "cg", "minres"]
            .iter()
            .any(|own| self.backend.starts_with(own))
    }

    /// True if instructions are counted. The last digits decide the length of an iteration and
    /// differ between C libraries; UMFPACK is seldom compiled in.
    pub fn counts_instructions(&self) -> bool {
        ["banded", "faer", "nalgebra-sparse"]
            .iter()
            .any(|direct| self.backend.starts_with(direct))
    }

    /// True for a cable of the length in the paper's tests, for which the code is tuned.
    pub fn has_24_segments(&self) -> bool {
        matches!(
            self.workload,
            Workload::Hoist { segments: 24, .. } | Workload::Network(_, 24)
        )
    }

    /// Steps of the shorter of the two runs that instructions are counted in. What comes before the steps varies by some
    /// ten thousand, with the seeds of hash tables: the smaller the scene, the more steps are to outweigh that.
    pub fn counted_steps(&self) -> usize {
        match self.workload {
            Workload::Hoist { segments, .. } if segments >= 1000 => PASS,
            _ => 4 * PASS,
        }
    }

    /// Measures of the case, in the order of the tables.
    pub fn measures(&self) -> impl Iterator<Item = Measure> + use<> {
        let (counts, hoist) = (self.counts_instructions(), self.workload.hoist().is_some());
        let drives = self.workload == Workload::Gantry;
        Measure::ALL.into_iter().filter(move |m| match m {
            Measure::Instructions => counts,
            Measure::ElongationError => hoist,
            Measure::P99 => drives,
            _ => true,
        })
    }

    /// Largest figure that passes; `None` if it is judged otherwise or not at all.
    pub fn bar(&self, measure: Measure) -> Option<f64> {
        if measure == Measure::Allocations && self.is_own() {
            return Some(0.0);
        }
        let place = BARRED.iter().position(|known| *known == measure)?;
        Some(self.bars[place]).filter(|bar| bar.is_finite())
    }
}

pub fn named(name: &str) -> Result<Case, String> {
    let found = CASES.into_iter().find(|case| case.name() == name);
    found.ok_or_else(|| {
        let names = CASES.map(|c| c.name()).join(", ");
        format!("no case is called `{name}`: choose one of {names}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_solver_that_wins_somewhere_is_tracked() {
        let untracked = ["dense", "minres"];
        for backend in taut_solver::Backend::all() {
            let mut tracked = CASES.iter();
            let tracked = tracked.any(|c| c.backend.split(':').next() == Some(backend.name()));
            assert_eq!(tracked, !untracked.contains(&backend.name()), "{backend}");
        }
    }

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
        let e = named("hoist-24/banded").unwrap_err();
        assert!(e.contains("hoist-24-1e3/banded, "), "{e}");
    }
}
