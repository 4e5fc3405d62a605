//! The energy of a swing over very many steps.

use super::{MOVE_TIME, moved, options};
use indicatif::ProgressBar;
use serde::{Deserialize, Serialize};
use taut_ground::pace;
use taut_ground::trajectory::{Failure, steps_in};
use taut_integrator::{GeometricStiffness, Scheme, StepError, Stepper};

/// Steps of a window: 20 s at 1/60 s, three swings of a cable of 10 m.
pub(super) const WINDOW: usize = 1200;

/// Case of an energy band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandCase {
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    pub scheme: Scheme,
    pub stiffness: GeometricStiffness,
    pub guarded: bool,
    /// The motion starts with random angular velocities; otherwise it is exactly planar.
    pub seeded: bool,
}

/// Energy band of a run. Energies are those of [`Stepper::energy`] over the load's largest kinetic
/// energy in the first window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Band {
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    pub scheme: String,
    pub stiffness: String,
    pub guarded: bool,
    /// The motion leaves its plane.
    pub seeded: bool,
    /// Steps made, those while the anchor moved not counted.
    pub steps: usize,
    /// Largest minus smallest energy of the first window.
    pub first_band: Option<f64>,
    /// Largest minus smallest energy of the last window.
    pub last_band: Option<f64>,
    /// Mean of the last tenth of the windows minus that of the first tenth.
    pub drift: Option<f64>,
    /// Mean of each window minus that of the first.
    pub means: Vec<f64>,
    /// Steps that the guard redid.
    pub redone: usize,
    /// How the run was lost.
    pub failure: Option<Failure>,
}

/// Least, largest and mean energy of a window.
#[derive(Debug, Clone, Copy)]
struct Window {
    least: f64,
    most: f64,
    mean: f64,
}

impl Window {
    /// Window of `energies`. The mean is taken relative to the first one, which keeps its digits.
    fn of(energies: &[f64]) -> Self {
        let floor = energies.first().copied().unwrap_or(0.0);
        let sum: f64 = energies.iter().map(|e| e - floor).sum();
        Self {
            least: energies.iter().copied().fold(f64::INFINITY, f64::min),
            most: energies.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            mean: floor + sum / energies.len() as f64,
        }
    }
}

/// Swings for `steps` steps after the anchor has stopped.
pub(super) fn run(
    case: &BandCase,
    steps: usize,
    dt: f64,
    progress: &ProgressBar,
) -> Result<Band, StepError> {
    let params = moved(case.segments, case.mass_ratio, case.seeded);
    let options = options((case.scheme, case.stiffness), dt, case.guarded);
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options)?;
    let mut band = Band {
        segments: case.segments,
        mass_ratio: case.mass_ratio,
        scheme: case.scheme.to_string(),
        stiffness: case.stiffness.to_string(),
        guarded: case.guarded,
        seeded: case.seeded,
        steps: 0,
        first_band: None,
        last_band: None,
        drift: None,
        means: Vec::new(),
        redone: 0,
        failure: None,
    };
    let still = steps_in(MOVE_TIME, dt) + 1;
    let mut scale = 0.0_f64;
    let mut windows = Vec::with_capacity(steps / WINDOW);
    let mut energies = Vec::with_capacity(WINDOW);
    for step in 0..still + steps {
        match pace::step(&mut stepper) {
            Ok(report) => band.redone += usize::from(report.redone),
            Err(e) => {
                band.failure = Some(Failure {
                    time: stepper.time(),
                    reason: e.to_string(),
                });
                break;
            }
        }
        if step < still {
            continue;
        }
        band.steps += 1;
        let energy = stepper.energy();
        if windows.is_empty() {
            scale = scale.max(energy.kinetic);
        }
        energies.push(energy.total());
        if energies.len() == WINDOW {
            windows.push(Window::of(&energies));
            energies.clear();
            progress.tick();
        }
    }
    band.evaluate(&windows, scale);
    Ok(band)
}

impl Band {
    fn evaluate(&mut self, windows: &[Window], scale: f64) {
        let width = |w: &Window| (w.most - w.least) / scale;
        self.first_band = windows.first().map(width);
        self.last_band = windows.last().map(width);
        if let Some(first) = windows.first() {
            let means = windows.iter().map(|w| (w.mean - first.mean) / scale);
            self.means = means.collect();
        }
        let part = windows.len().div_ceil(10);
        if windows.len() >= 2 {
            let mean = |means: &[f64]| means.iter().sum::<f64>() / means.len() as f64;
            let last = &self.means[self.means.len() - part..];
            self.drift = Some(mean(last) - mean(&self.means[..part]));
        }
    }
}
