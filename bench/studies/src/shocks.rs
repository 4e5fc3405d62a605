//! Shocks: kicks, jerks, drops. What becomes of a cable that something violent happens to, for each setting of the step.
//!
//! Every run is judged after its time (10 s) by four questions.
//!
//! 1. *Finite?* No step failed and the load stayed within ten cable lengths of the anchor.
//! 2. *Does it keep its length?* In the last second the elongation, the sum of all gaps, is at no time more than 1.05
//!    times the largest of the reference in its last 5 s, plus 10⁻³ L.
//! 3. *Does it gain no energy?* The total energy (kinetic, gravitational, ½ ε λ²) at no instant exceeds that of the
//!    beginning by more than 1 % of the reference's largest kinetic energy. What the motion begins with is worked out
//!    from the scene: its velocities, heights and ½ φ²/ε of its pose, not from a step that may have damped it already.
//!    The jerked anchor does work that depends on how its motion is resolved: there the reference's energy at the end of
//!    the jerk is taken, and the energies after it count.
//! 4. *Is it in the right swing?* The load ends within 10⁻² L of the reference.
//!
//! The reference is the default scheme with its guard at two fine steps. The finer one counts, and their distance at the
//! end, given beside the errors, is what is not known of it: errors of up to three times as much are none, and where it
//! exceeds 10⁻² L the swing is *chaotic*, neither right nor wrong. References are kept in files ([`taut_ground::cache`]).

mod outcome;
mod scene;
mod settings;
mod study;
mod table;

pub use outcome::{
    GAIN, Outcome, Reference, Run, SLACK, STRETCH, SWING, Swing, initial_energy, measure, times,
};
use scene::FRAME;
pub use scene::{DROP, PLUCK, SEGMENTS, Shock, scene};
pub use settings::Setting;
pub(crate) use study::STUDY;

use crate::cases::Cases;
use rayon::prelude::*;
use serde::Serialize;
use taut_ground::cache;
use taut_integrator::{StepError, StepOptions};
use taut_output::check::ExperimentError;
use taut_solver::Backend;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Settings; the steps of the first are timed, and its outcomes listed one by one.
    pub settings: Vec<Setting>,
    pub shocks: Vec<Shock>,
    /// Mass ratios load/segment.
    pub ratios: Vec<f64>,
    /// Lengths of the cable \[m].
    pub lengths: Vec<f64>,
    /// Simulated time \[s].
    pub time: f64,
    /// Steps a frame of the two reference motions, the finer one last.
    pub fineness: [usize; 2],
    /// Reads references from files and keeps them there.
    pub cached: bool,
    /// Runs of which the fastest counts for the time of a step; 0 times nothing.
    pub repeats: usize,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            settings: Setting::all(),
            shocks: Shock::ALL.to_vec(),
            ratios: vec![1e2, 1e3, 1e4, 1e5, 1e6],
            lengths: vec![10.0, 1.0],
            time: 10.0,
            fineness: [128, 256],
            cached: true,
            repeats: 3,
        }
    }
}

impl Config {
    /// Few settings, two mass ratios, one length, half the time, coarser references: a first look.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            settings: Setting::few(),
            ratios: vec![1e3, 1e5],
            lengths: vec![10.0],
            time: 5.0,
            fineness: [16, 32],
            ..Self::default()
        }
    }
}

/// All outcomes.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Results {
    /// Simulated time \[s].
    pub time: f64,
    /// Steps a frame of the two reference motions.
    pub fineness: [usize; 2],
    /// Setting by setting, each length by length, shock by shock, ratio by ratio.
    pub outcomes: Vec<Outcome>,
}

/// A shock with its ratio and length.
type Case = (Shock, f64, f64);

/// Runs every setting through every shock, in parallel, then times the first setting's steps alone. A shock with its ratio and
/// length is a case, with its reference and all its settings.
///
/// # Errors
/// A scene that cannot be built, options that a stepper refuses. A run that fails is an outcome.
pub fn run(config: &Config, cases: &Cases) -> Result<Results, ExperimentError> {
    let mut shocks: Vec<Case> = Vec::new();
    for &length in &config.lengths {
        for &shock in &config.shocks {
            shocks.extend(config.ratios.iter().map(|&ratio| (shock, ratio, length)));
        }
    }
    let parts = cases.parallel("shocks", &shocks, |&case| outcomes(config, case))?;
    let first = config.settings.first().filter(|_| config.repeats > 0);
    let timings = match first {
        None => None,
        Some(setting) => Some(cases.in_turn("timing", &shocks, |&case| {
            let (shock, ratio, length) = case;
            let options = &setting.options;
            let timing = times(shock, ratio, length, options, config.time, config.repeats)?;
            Ok::<_, StepError>([timing.max, timing.median])
        })?),
    };
    let mut parts = parts.all()?;
    if let Some(timings) = timings {
        for (part, [max, median]) in parts.iter_mut().zip(timings.all()?) {
            part[0].worst_step_ns = Some(max);
            part[0].median_step_ns = Some(median);
        }
    }
    let of = |setting: usize| parts.iter().map(move |part| part[setting].clone());
    Ok(Results {
        time: config.time,
        fineness: config.fineness,
        outcomes: (0..config.settings.len()).flat_map(of).collect(),
    })
}

/// Outcomes of a shock for all settings.
fn outcomes(config: &Config, case: Case) -> Result<Vec<Outcome>, StepError> {
    let (shock, ratio, length) = case;
    let [coarser, finer] = config.fineness;
    let fine_run = |substeps| fine_run(config, case, substeps);
    let (coarser, finer) = rayon::join(|| fine_run(coarser), || fine_run(finer));
    let reference = Reference::new(shock, ratio, length, &coarser?, finer?)?;
    let settings = config.settings.par_iter().map(|setting| {
        let run = measure(shock, ratio, length, &setting.options, config.time)?;
        Ok(Outcome::new(&setting.name, case, run, &reference))
    });
    settings.collect()
}

fn fine_run(
    config: &Config,
    (shock, ratio, length): Case,
    substeps: usize,
) -> Result<Run, StepError> {
    // Steps and not sub-steps, so that every one of them is seen.
    let options = StepOptions {
        dt: FRAME / substeps as f64,
        ..StepOptions::default()
    };
    let compute = || measure(shock, ratio, length, &options, config.time);
    if !config.cached {
        return compute();
    }
    // Which direct solver it was does not matter; the rest does.
    let defining = StepOptions {
        backend: Backend::Banded,
        ..options.clone()
    };
    let scene = scene(shock, ratio, length)?;
    let (time, shock_end) = (config.time, shock.end());
    let key = format!("shock {time} {shock_end} {defining:?} {scene:?}");
    cache::cached(&key, compute)
}
