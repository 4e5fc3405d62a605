//! How exact a solve is: forward errors of the multipliers against the KKT system in extended precision, for every
//! solver with 0, 1 and 2 refinements, over mass ratios up to 10¹².
//!
//! Each scene is one state, a straight or a bent cable under its tension, and each row one solve of it from zero. The
//! system is that of the default step, with the same tension in the geometric stiffness for every solver: that of the
//! state without geometric stiffness, in extended precision.
//!
//! A load of 10⁹ kg would draw the hoist's steel (YA = 2·10⁷ N) out to 500 times its length, and the compliance of
//! such joints would hide what the mass ratio does to S. So the material is made stiffer with the load, at the same
//! radius, where the strain would exceed [`Config::max_strain`]. The same numbers, scaled, are those of one rope with a
//! load that it can bear and ever lighter segments: the compliances fall as 1/ratio.
//!
//! # What to expect
//! Elimination, joint by joint or body by body, subtracts inverse segment masses 1/m from each other until only the
//! compliances and 1/M of the load are left, and each difference carries the roundoff u/m. Together the compliances of
//! the cable are strain · L/(p g Δt²) times 1/M, with the weight p of the step's end (1 in the paper's scheme). So a
//! solve without refinement has, for N segments hanging straight, a relative error of about
//!
//! ```text
//! r₀ ≈ 2 N u (M/m) / (1 + strain · L/(p g Δt²)),    r₁ ≈ r₀²
//! ```
//!
//! on S as on the KKT matrix without pivoting, which forms S on the way; each refinement multiplies it by r₀ once more,
//! as far as its residual is exact. With p = 1, errors of 10⁻¹² with one refinement, r₀ = 10⁻⁶, thus reach up to
//! M/m = 1.7·10⁹ for 100 segments at a strain of 1 %, 2·10⁸ at 0.1 %, and to any ratio at the stiffness of steel; the
//! default scheme, p = 0.4, reaches twice as far. Bent cables lose less, unless they are as good as rigid, in bending
//! too (strain 10⁻⁸). LU with pivoting on the KKT matrix has errors of at most 10⁻¹² without refinement up to 10⁹.
//!
//! On S all this needs an exact residual. Geometric stiffness makes thin segments resist turning across their axis with
//! up to 10¹⁰ times their inertia about it, and M̃⁻¹ is as inexact: with Δv corrected once, r₁ of a bent cable of 100
//! segments was 7·10⁻¹² at 10⁹, corrected twice it is 10⁻¹⁵.

mod study;
mod table;

pub(crate) use study::STUDY;

use crate::cases::Cases;
use serde::{Deserialize, Serialize};
use taut_ground::choice::{Choice, Omission};
use taut_ground::poses::{self, Pose};
use taut_integrator::{GeometricStiffness, StepError, StepOptions, Stepper};
use taut_model::{HoistParams, Scene, SceneError};
use taut_output::check::ExperimentError;
use taut_solver::{backward_error, forward_error};

/// Largest relative error of the multipliers for a direct solver with one refinement.
pub const BAR: f64 = 1e-12;

/// The mass ratio up to which it is to reach it.
pub const BAR_RATIO: f64 = 1e9;

/// Segments beyond which the dense solver, whose cost is cubic, would outlast all others together.
const DENSE_SEGMENTS: usize = 32;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Numbers of segments.
    pub segments: Vec<usize>,
    /// Mass ratios load/segment, ascending.
    pub ratios: Vec<f64>,
    pub poses: Vec<Pose>,
    /// Solvers with their limits of iterations; those that are not compiled in have no rows.
    pub choices: Vec<Choice>,
    /// Refinement sweeps, ascending.
    pub refinements: Vec<usize>,
    /// Largest strain of the hanging cable, without unit; ∞ for steel under every load.
    pub max_strain: f64,
    /// The step whose system is solved: Δt, scheme, geometric stiffness.
    pub step: StepOptions,
}

/// The choice with 1000 iterations for each of its solves, where it iterates.
#[must_use]
pub fn patient(choice: &Choice) -> Choice {
    Choice {
        backend: choice.backend.with_iterations(1000),
        form: choice.form,
    }
}

impl Default for Config {
    /// 24 and 100 segments, ratios 1 to 10¹², both poses, every solver, 0 to 2 refinements, at most 1 % of strain.
    fn default() -> Self {
        Self {
            segments: vec![24, 100],
            ratios: (0..=12).map(|exponent| 10_f64.powi(exponent)).collect(),
            poses: vec![Pose::Straight, Pose::Bent],
            choices: Choice::all().iter().map(patient).collect(),
            refinements: vec![0, 1, 2],
            max_strain: 1e-2,
            step: StepOptions::default(),
        }
    }
}

impl Config {
    /// A fifth of the work: 24 segments and every third ratio.
    #[must_use]
    pub fn quick() -> Self {
        Self {
            segments: vec![24],
            ratios: vec![1.0, 1e3, 1e6, 1e9, 1e12],
            ..Self::default()
        }
    }

    /// The hoist with a load of `mass_ratio` segments, its material stiff enough for it.
    ///
    /// # Errors
    /// As [`HoistParams::resolve`].
    pub fn params(&self, segments: usize, mass_ratio: f64) -> Result<HoistParams, SceneError> {
        let steel = HoistParams {
            segments,
            mass_ratio,
            seed: 7,
            ..HoistParams::default()
        };
        let hoist = steel.resolve()?;
        let mass = hoist.load_mass + hoist.segment_mass * segments as f64;
        let needed = steel.gravity * mass / self.max_strain;
        Ok(HoistParams {
            ea: Some(hoist.stiffness.ea.max(needed)),
            radius: Some(hoist.radius),
            segment_mass: Some(hoist.segment_mass),
            ..steel
        })
    }

    /// Why a solver has no rows for a number of segments.
    fn omitted(&self, choice: &Choice, segments: usize) -> Option<String> {
        if let Err(e) = choice.check() {
            return Some(e.to_string());
        }
        let dense = |c: &Choice| c.backend.name() == "dense";
        let dense = dense(choice) && !self.choices.iter().all(dense);
        (dense && segments > DENSE_SEGMENTS)
            .then(|| format!("cubic cost at {segments} segments; ask for it alone with --backends"))
    }

    /// The solvers without rows, and why.
    #[must_use]
    pub fn omissions(&self) -> Vec<Omission> {
        let mut omissions: Vec<Omission> = Vec::new();
        for choice in &self.choices {
            for &segments in &self.segments {
                let omission = self.omitted(choice, segments).map(|reason| Omission {
                    backend: choice.family(),
                    reason,
                });
                omissions.extend(omission.filter(|o| !omissions.contains(o)));
            }
        }
        omissions
    }
}

/// One row: one solve of one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Pose of the cable.
    pub pose: Pose,
    /// Segments of the cable.
    pub segments: usize,
    /// Load over segment mass.
    pub mass_ratio: f64,
    /// Axial stiffness YA of the cable \[N].
    pub ea: f64,
    /// Backend and form, without iterations.
    pub backend: String,
    /// All options of the backend, as the command line reads them.
    pub options: String,
    /// Direct solver: the bar applies.
    pub direct: bool,
    /// Refinement sweeps: from the pieces on S, with b − A x on the KKT matrix.
    pub refinements: usize,
    /// ‖μ − μ*‖∞ / ‖μ*‖∞ of the multipliers against extended precision; NaN where the solver failed.
    pub forward_error: f64,
    /// Normwise backward error on the assembled system, S or the KKT matrix; NaN where the solver failed.
    pub backward_error: f64,
    /// Iterations of the solve with its refinements; 0 for direct solvers.
    pub iterations: usize,
    /// Reason for missing numbers if the solver failed: they are null in JSON. Without it null
    /// means not measured.
    pub error: Option<String>,
}

/// A scene of the sweep with what all its rows share.
struct Case {
    pose: Pose,
    params: HoistParams,
    ea: f64,
    scene: Scene,
    /// The multipliers that the geometric stiffness is made of: those of the state without it \[N, N m].
    tension: Vec<f64>,
    /// The exact multipliers.
    exact: Vec<f64>,
}

impl Case {
    fn new(
        config: &Config,
        segments: usize,
        pose: Pose,
        mass_ratio: f64,
    ) -> Result<Self, StepError> {
        let params = config.params(segments, mass_ratio)?;
        let scene = poses::hoist(&params, pose)?;
        let step = |stiffness| StepOptions {
            stiffness,
            ..config.step.clone()
        };
        let mut soft = Stepper::new(scene.clone(), step(GeometricStiffness::Off))?;
        let impulses = soft.reference_multipliers()?;
        let tension: Vec<f64> = impulses.iter().map(|mu| mu / config.step.dt).collect();
        let mut stepper = Stepper::new(scene.clone(), config.step.clone())?;
        stepper.set_tension(&tension)?;
        let exact = stepper.reference_multipliers()?;
        let ea = params.resolve()?.stiffness.ea;
        Ok(Self {
            pose,
            params,
            ea,
            scene,
            tension,
            exact,
        })
    }

    fn rows(&self, config: &Config) -> Vec<Record> {
        let segments = self.params.segments;
        let choices = config.choices.iter();
        let with_rows = choices.filter(|c| config.omitted(c, segments).is_none());
        with_rows
            .flat_map(|c| config.refinements.iter().map(move |&k| (c, k)))
            .map(|(choice, refinements)| self.row(config, choice, refinements))
            .collect()
    }

    fn row(&self, config: &Config, choice: &Choice, refinements: usize) -> Record {
        let mut row = Record {
            pose: self.pose,
            segments: self.params.segments,
            mass_ratio: self.params.mass_ratio,
            ea: self.ea,
            backend: choice.family(),
            options: choice.to_string(),
            direct: !choice.backend.is_iterative(),
            refinements,
            forward_error: f64::NAN,
            backward_error: f64::NAN,
            iterations: 0,
            error: None,
        };
        let options = StepOptions {
            form: choice.form,
            backend: choice.backend.clone(),
            refinements,
            ..config.step.clone()
        };
        if let Err(e) = self.measure(options, &mut row) {
            row.error = Some(e.to_string());
        }
        row
    }

    fn measure(&self, options: StepOptions, row: &mut Record) -> Result<(), StepError> {
        let mut stepper = Stepper::new(self.scene.clone(), options)?;
        stepper.set_tension(&self.tension)?;
        row.iterations = stepper.solve()?.iterations;
        row.forward_error = forward_error(stepper.multipliers(), &self.exact);
        let (a, b, x) = stepper.system();
        let errors = backward_error(a, b, x).map_err(|source| StepError::Solve {
            source,
            culprit: None,
            time: 0.0,
        })?;
        row.backward_error = errors.normwise;
        Ok(())
    }
}

/// Solves every scene with every solver, in parallel, each scene a case. Rows are ordered by segments, pose, ratio, solver,
/// refinements.
///
/// # Errors
/// A scene that cannot be built, or one without a reference; a solver's own failure is a row.
pub fn run(config: &Config, cases: &Cases) -> Result<Vec<Record>, ExperimentError> {
    let mut scenes = Vec::new();
    for &segments in &config.segments {
        for &pose in &config.poses {
            scenes.extend(config.ratios.iter().map(|&ratio| (segments, pose, ratio)));
        }
    }
    let rows = cases.parallel("scenes", &scenes, |&(segments, pose, ratio)| {
        Ok::<_, StepError>(Case::new(config, segments, pose, ratio)?.rows(config))
    })?;
    Ok(rows.all()?.concat())
}

/// How far a direct solver with one refinement is within [`BAR`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Backend and form.
    pub backend: String,
    /// Largest ratio of the sweep up to which all errors are within the bar; `None` if the smallest
    /// one exceeds it.
    pub limit: Option<f64>,
    /// The row with the largest error up to [`BAR_RATIO`], where NaN counts as the largest.
    pub worst: Record,
}

impl Verdict {
    /// True if the bar holds at all ratios up to [`BAR_RATIO`].
    #[must_use]
    pub fn holds(&self) -> bool {
        self.worst.forward_error <= BAR
    }
}

/// The verdicts on all direct solvers with rows for one refinement and ratios up to [`BAR_RATIO`].
#[must_use]
pub fn verdicts(records: &[Record]) -> Vec<Verdict> {
    let judged = |r: &&Record| r.direct && r.refinements == 1;
    let mut verdicts: Vec<Verdict> = Vec::new();
    for r in records.iter().filter(judged) {
        if r.mass_ratio > BAR_RATIO || verdicts.iter().any(|v| v.backend == r.backend) {
            continue;
        }
        let own: Vec<&Record> = records
            .iter()
            .filter(judged)
            .filter(|o| o.backend == r.backend)
            .collect();
        let beyond = |o: &&&Record| o.forward_error.is_nan() || o.forward_error > BAR;
        let first_beyond = own.iter().filter(beyond).map(|o| o.mass_ratio);
        let first_beyond = first_beyond.fold(f64::INFINITY, f64::min);
        let within = own.iter().map(|o| o.mass_ratio);
        let limit = within.filter(|ratio| *ratio < first_beyond);
        // `total_cmp` puts a positive NaN last.
        let magnitude = |o: &Record| o.forward_error.abs();
        let counted = own.iter().filter(|o| o.mass_ratio <= BAR_RATIO);
        let worst = counted.fold(r, |worst, o| {
            let larger = magnitude(o).total_cmp(&magnitude(worst)).is_gt();
            if larger { o } else { worst }
        });
        verdicts.push(Verdict {
            backend: r.backend.clone(),
            limit: limit.max_by(f64::total_cmp),
            worst: worst.clone(),
        });
    }
    verdicts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tiny() -> Config {
        Config {
            segments: vec![3, 40],
            ratios: vec![1.0, 1e6],
            ..Config::default()
        }
    }

    #[test]
    fn every_solver_has_its_rows_or_a_reason() {
        let config = tiny();
        let records = run(&config, &Cases::default()).unwrap();
        let omissions = config.omissions();
        for choice in &config.choices {
            let own = |segments: usize| {
                let of = |r: &&Record| r.backend == choice.family() && r.segments == segments;
                records.iter().filter(of).count()
            };
            let omitted = omissions.iter().any(|o| o.backend == choice.family());
            let dense = choice.backend.name() == "dense";
            let per_cable = 2 * 2 * 3;
            let compiled = choice.check().is_ok();
            assert_eq!(own(3), per_cable * usize::from(compiled), "{choice}");
            assert_eq!(
                own(40),
                per_cable * usize::from(compiled && !dense),
                "{choice}"
            );
            assert_eq!(omitted, dense || !compiled, "{choice}");
        }
        for r in &records {
            assert_eq!(r.error, None, "{r:?}");
            assert!(
                r.forward_error.is_finite() && r.backward_error < 1.0,
                "{r:?}"
            );
            assert_eq!(r.direct, r.iterations == 0, "{r:?}");
        }
    }

    #[test]
    fn the_strain_stays_within_its_bound() {
        let config = Config::default();
        for mass_ratio in [1.0, 1e4, 1e5, 1e12] {
            let params = config.params(24, mass_ratio).unwrap();
            let hoist = params.resolve().unwrap();
            let steel = HoistParams::default().resolve().unwrap();
            assert_eq!(hoist.radius, steel.radius);
            assert_eq!(hoist.segment_mass, steel.segment_mass);
            let strain = params.exact_elongation() / params.length;
            assert!(strain <= config.max_strain, "{strain}");
            let stiffened = hoist.stiffness.ea > steel.stiffness.ea;
            assert_eq!(stiffened, mass_ratio >= 1e5, "{mass_ratio:e}");
            assert!(!stiffened || strain > 0.99 * config.max_strain, "{strain}");
        }
    }

    #[test]
    fn a_verdict_names_the_limit_and_the_worst_row() {
        let config = Config {
            segments: vec![2],
            ratios: vec![1.0],
            poses: vec![Pose::Bent],
            refinements: vec![1],
            choices: vec![Choice::schur(taut_solver::Backend::Dense(
                taut_solver::DenseOptions::default(),
            ))],
            ..Config::default()
        };
        let row = run(&config, &Cases::default()).unwrap().remove(0);
        let at = |mass_ratio: f64, forward_error: f64| Record {
            mass_ratio,
            forward_error,
            ..row.clone()
        };
        let judged = |errors: [f64; 4]| {
            let ratios = [1.0, 1e6, 1e9, 1e12];
            let records = ratios.iter().zip(errors).map(|(&r, e)| at(r, e));
            verdicts(&records.collect::<Vec<_>>()).remove(0)
        };
        let good = judged([1e-16, 1e-13, 1e-15, 1e-7]);
        assert!(good.holds() && good.limit == Some(1e9));
        assert_eq!(good.worst.mass_ratio, 1e6);
        let bad = judged([1e-16, 1e-11, 1e-15, 1e-7]);
        assert!(!bad.holds() && bad.limit == Some(1.0));
        let failed = judged([f64::NAN, 1e-11, 1e-15, 1e-7]);
        assert!(!failed.holds() && failed.limit.is_none());
        assert_eq!(failed.worst.mass_ratio, 1.0);
        // Nothing within the bar's range: nothing to say.
        assert_eq!(verdicts(&[at(1e10, 1e-16)]), []);
    }
}
