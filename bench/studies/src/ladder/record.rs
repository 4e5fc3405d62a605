//! A row of the main job, and which rows are the fastest within an error level.

use super::LEVELS;
use serde::{Deserialize, Serialize};
use taut_measure::trajectory::Failure;
use taut_output::notation::number;

/// One row: a solver with its options on one scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LadderRow {
    pub scene: String,
    /// Segments of the hoist's cable; none of another scene, which has no elongation either.
    pub segments: Option<usize>,
    /// Load over segment mass; of another scene the heaviest over the lightest moving body.
    pub mass_ratio: f64,
    /// Constraints; 0 in rows that are older than the count.
    #[serde(default)]
    pub joints: usize,
    /// Backend and form, without iterations.
    pub backend: String,
    /// All options of the backend, as the command line reads them.
    pub options: String,
    /// Limit of iterations; 0 for direct solvers.
    pub iterations: usize,
    /// Mean number of iterations of a step on the common states.
    pub iterations_used: f64,
    /// Δt \[s].
    pub dt: f64,
    /// Refinement sweeps from the pieces in the timed and simulated step.
    pub refinements: usize,
    /// Whole step, median \[ns].
    pub step_ns: Option<f64>,
    /// Whole step, minimum \[ns].
    pub step_ns_min: Option<f64>,
    /// Factorisation, solve and refinement, median \[ns].
    pub solve_ns: Option<f64>,
    /// Refinement alone, median \[ns].
    pub refine_ns: Option<f64>,
    /// Normwise backward error on the assembled system, without refinement; largest of the frames.
    pub backward_error: Option<f64>,
    /// Componentwise backward error, likewise.
    pub backward_error_componentwise: Option<f64>,
    /// Relative error of the multipliers against extended precision, as stepped; largest of the frames.
    pub forward_error: Option<f64>,
    /// `forward_error` without refinement.
    pub forward_error_unrefined: Option<f64>,
    /// Relative error of the velocities after a step, of scenes with contacts; largest of the frames.
    #[serde(default)]
    pub velocity_error: Option<f64>,
    /// Largest violation of the contacts' conditions in these steps, in rates over the largest of them.
    #[serde(default)]
    pub complementarity: Option<f64>,
    /// Relative error of the hanging cable's elongation against the exact discrete value after half a second.
    pub elongation_error: Option<f64>,
    /// Relative error of the elongation against the massless continuum, M g L/(YA).
    pub elongation_error_continuum: Option<f64>,
    /// Largest distance of the load from the reference motion while the run was stable \[m].
    pub load_error_m: Option<f64>,
    /// Change of the total energy after the anchor's motion, over the largest kinetic energy since; for stable runs.
    pub energy_drift: Option<f64>,
    /// Largest gap of a joint \[m].
    pub max_violation_m: Option<f64>,
    /// The run of `simulated_s` seconds stayed stable, and so did the step itself, solved directly,
    /// for 30 s.
    pub stable: bool,
    /// Simulated time asked for \[s].
    pub simulated_s: f64,
    /// How an unstable run ended.
    pub failure: Option<Failure>,
    /// Frames whose solver claimed a solution: an iteration by its convergence, a direct solver by its status.
    pub claimed_converged: Option<usize>,
    /// Claims of these that are true: the residual in extended precision met the tolerance. For
    /// direct solvers as below.
    pub verified_converged: Option<usize>,
    /// Claims of these that are true to rounding: also those with a normwise backward error of at
    /// most 10⁻¹⁴.
    #[serde(default)]
    pub verified_to_rounding: Option<usize>,
    pub frames: usize,
    /// Error levels at which this row is the fastest of its scene.
    pub fastest_at: Vec<Fastest>,
    /// Reason for missing numbers if the solver failed on the common states: they are null in JSON.
    /// Without it null means not measured.
    pub error: Option<String>,
}

/// The fastest of a scene within an error level: the multipliers' forward error and the elongation error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fastest {
    pub level: f64,
    /// The error requires the row's refinement.
    pub refined: bool,
    /// Step, median, without the refinement where that is not needed \[ns].
    pub step_ns: f64,
}

/// Identity of a scene in rows: its name, segments and mass ratio.
pub type SceneKey<'a> = (&'a str, Option<usize>, u64);

/// Marks, for each scene and error level, the fastest row whose error is within the level.
pub(super) fn mark_fastest(records: &mut [LadderRow]) {
    let same_scene = |a: &LadderRow, b: &LadderRow| a.scene_key() == b.scene_key();
    for rows in records.chunk_by_mut(same_scene) {
        for level in LEVELS {
            let candidates = rows.iter_mut();
            let candidates = candidates.filter_map(|r| r.within(level).map(|within| (r, within)));
            let fastest = candidates.min_by(|(_, a), (_, b)| a.step_ns.total_cmp(&b.step_ns));
            if let Some((row, fastest)) = fastest {
                row.fastest_at.push(fastest);
            }
        }
    }
}

impl LadderRow {
    pub fn scene_key(&self) -> SceneKey<'_> {
        (&self.scene, self.segments, self.mass_ratio.to_bits())
    }

    pub fn scene_title(&self) -> String {
        let ratio = number(self.mass_ratio);
        match self.segments {
            Some(segments) => format!("{segments} segments, load/segment {ratio}"),
            None => format!("{}, mass ratio {ratio}", self.scene),
        }
    }

    /// The error that its step is judged by: of the velocities with contacts, else of the multipliers.
    pub fn step_error(&self) -> f64 {
        let error = self.velocity_error.or(self.forward_error);
        error.unwrap_or(f64::NAN)
    }

    /// Time of a step with errors within `level`, less the refinement if the level does not need
    /// it. `None` if no error is within.
    pub fn within(&self, level: f64) -> Option<Fastest> {
        let held = self.error.is_none() && self.failure.is_none();
        // A hoist that did not hold has no elongation error and is not sound.
        let hangs = self.segments.is_none() || self.elongation_error.is_some_and(|e| e <= level);
        let whole = self.step_ns.filter(|ns| held && hangs && ns.is_finite())?;
        // With contacts the velocities decide, of the step as it is.
        if let Some(error) = self.velocity_error {
            return (error <= level).then_some(Fastest {
                level,
                refined: self.refinements > 0,
                step_ns: whole,
            });
        }
        // NaN is within no level.
        let is_within = |error: Option<f64>| error.is_some_and(|e| e <= level);
        let refined = !is_within(self.forward_error_unrefined);
        let refine_ns = self.refine_ns.filter(|_| !refined).unwrap_or(0.0);
        (!refined || is_within(self.forward_error)).then_some(Fastest {
            level,
            refined: refined && self.refinements > 0,
            step_ns: whole - refine_ns,
        })
    }
}
