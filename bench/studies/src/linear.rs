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

use crate::options::choice;
use crate::study::question::*;
use crate::systems::{Start, State, Told, add_omissions, entrants};
use serde::{Deserialize, Serialize};
use taut_ground::choice::{Choice, Omission};
use taut_ground::poses::{self, Pose};
use taut_integrator::{StepError, StepOptions};
use taut_model::{HoistParams, SceneError};

/// Largest relative error of the multipliers for a direct solver with one refinement.
pub const BAR: f64 = 1e-12;

/// The mass ratio up to which it is to reach it.
pub const BAR_RATIO: f64 = 1e9;

/// Rows beyond which the dense solver, whose cost is cubic, would outlast all others together: of 32 segments.
const DENSE_ROWS: usize = 200;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
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
pub fn patient(choice: &Choice) -> Choice {
    Choice {
        backend: choice.backend.with_iterations(1000),
        form: choice.form,
    }
}

impl Default for Config {
    fn default() -> Self {
        Self::new(false)
    }
}

impl Config {
    /// 24 and 100 segments, ratios 1 to 10¹², both poses, every solver, 0 to 2 refinements, at most 1 % of strain. Quick a
    /// fifth of the work: 24 segments and every third ratio.
    pub fn new(quick: bool) -> Self {
        let every = pick(quick, [1, 3]);
        Self {
            segments: pick(quick, [vec![24, 100], vec![24]]),
            ratios: (0..=12).step_by(every).map(|k| 10_f64.powi(k)).collect(),
            poses: vec![Pose::Straight, Pose::Bent],
            choices: Choice::all().iter().map(patient).collect(),
            refinements: vec![0, 1, 2],
            max_strain: 1e-2,
            step: StepOptions::default(),
        }
    }

    /// The hoist with a load of `mass_ratio` segments, its material stiff enough for it.
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

    /// Who has rows for a number of segments, and why the others have none.
    fn entrants(&self, segments: usize) -> (Vec<Choice>, Vec<Omission>) {
        let rows = 6 * (segments + 1);
        entrants(&self.choices, DENSE_ROWS, |_| rows)
    }

    /// The solvers without rows, and why.
    pub fn omissions(&self) -> Vec<Omission> {
        let mut omissions = Vec::new();
        for &segments in &self.segments {
            add_omissions(&mut omissions, self.entrants(segments).1);
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

/// The rows of a scene.
fn rows(
    config: &Config,
    segments: usize,
    pose: Pose,
    mass_ratio: f64,
) -> Result<Vec<Record>, StepError> {
    let params = config.params(segments, mass_ratio)?;
    let state = State::tense(poses::hoist(&params, pose)?, &config.step)?;
    let ea = params.resolve()?.stiffness.ea;
    let row = |choice: &Choice, refinements: usize| {
        let options = StepOptions {
            form: choice.form,
            backend: choice.backend.clone(),
            refinements,
            ..config.step.clone()
        };
        let solved = state.solve(options, Start::Cold);
        let known = solved.as_ref().ok();
        Record {
            pose,
            segments,
            mass_ratio,
            ea,
            backend: choice.family(),
            options: choice.to_string(),
            direct: !choice.backend.is_iterative(),
            refinements,
            forward_error: known.map_or(f64::NAN, |s| s.forward),
            backward_error: known.map_or(f64::NAN, |s| s.backward.normwise),
            iterations: known.map_or(0, |s| s.iterations),
            error: solved.as_ref().err().map(ToString::to_string),
        }
    };
    let (entrants, _) = config.entrants(segments);
    let rows = entrants.iter().flat_map(|choice| {
        let refinements = config.refinements.iter();
        refinements
            .map(|&refinements| row(choice, refinements))
            .collect::<Vec<_>>()
    });
    Ok(rows.collect())
}

/// Solves every scene with every solver, in parallel, each scene a case. Rows are ordered by segments, pose, ratio, solver,
/// refinements.
pub fn run(config: &Config, cases: &Cases) -> Result<Vec<Record>, ExperimentError> {
    let mut scenes = Vec::new();
    for &segments in &config.segments {
        for &pose in &config.poses {
            scenes.extend(config.ratios.iter().map(|&ratio| (segments, pose, ratio)));
        }
    }
    let rows = cases.parallel("scenes", &scenes, |&(segments, pose, ratio)| {
        rows(config, segments, pose, ratio)
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
    pub fn holds(&self) -> bool {
        self.worst.forward_error <= BAR
    }
}

/// The verdicts on all direct solvers with rows for one refinement and ratios up to [`BAR_RATIO`].
pub fn verdicts(records: &[Record]) -> Vec<Verdict> {
    let judged = || records.iter().filter(|r| r.direct && r.refinements == 1);
    let verdict = |backend: &String| {
        let own = || judged().filter(|r| r.backend == *backend);
        let beyond = own().filter(|r| r.forward_error.is_nan() || r.forward_error > BAR);
        let beyond = beyond.map(|r| r.mass_ratio).fold(f64::INFINITY, f64::min);
        let within = own().map(|r| r.mass_ratio).filter(|ratio| *ratio < beyond);
        // `total_cmp` puts a positive NaN last; of equal errors the first row's counts.
        let size = |r: &Record| r.forward_error.abs();
        let counted = own().rev().filter(|r| r.mass_ratio <= BAR_RATIO);
        let worst = counted.max_by(|a, b| size(a).total_cmp(&size(b)))?;
        Some(Verdict {
            backend: backend.clone(),
            limit: within.max_by(f64::total_cmp),
            worst: worst.clone(),
        })
    };
    let backends = distinct(judged().map(|r| &r.backend));
    backends.into_iter().filter_map(verdict).collect()
}

/// `taut study linear`.
pub(crate) const STUDY: Study = Study {
    name: "linear",
    title: "errors of the multipliers against mass ratio",
    about: "Forward errors of the multipliers with 0, 1 and 2 refinements, mass ratios 1 to 10¹²",
    examples: &["--segments 24"],
    mark: ("", "pose"),
    takes: &["segments", "ratios", "backends", "quick"],
    run: |matches, reporter| ask(&Asked::read(matches), reporter.cases),
    sheets: SHEETS,
    plots: PLOTS,
    ..study::PLAIN
};

const LEGEND: &str = "\
Each cell: relative errors of the multipliers against extended precision, ∞-norm, with 0, 1, 2 refinements, compared by
the last. Iterative solvers start from zero, and each of their solves has at most 1000 iterations, unless they name
their own, to 1e-12";

fn ask(asked: &Asked, cases: &Cases) -> Result<Found, ExperimentError> {
    let mut config = Config::new(asked.quick);
    asked.segments(&mut config.segments);
    asked.ratios(&mut config.ratios)?;
    if !asked.backends.is_empty() {
        let named = asked.backends.iter().map(|name| match choice(name)? {
            choice if name.contains("iterations=") => Ok(choice),
            choice => Ok::<_, Refused>(patient(&choice)),
        });
        config.choices = distinct(named.collect::<Result<Vec<_>, _>>()?.into_iter());
    }
    let records = run(&config, cases)?;
    let told = Told {
        settings: settings(&config),
        heading: format!(
            "hoist: strain of at most {} (steel, made stiffer with the load), Δt = 1/{:.0} s, {}",
            config.max_strain,
            1.0 / config.step.dt,
            config.step.scheme
        ),
        legend: LEGEND,
        sheets: SHEETS,
        rows: data(&records)?,
        conclusion: bars(&verdicts(&records)),
        omissions: config.omissions(),
    };
    Ok(told.into())
}

fn settings(config: &Config) -> Vec<Setting> {
    set([
        ("segments", counts(&config.segments)),
        ("load/segment", numbers(&config.ratios)),
        ("poses", list(&config.poses, ToString::to_string)),
        ("solvers", solvers(&config.choices)),
        ("refinements", counts(&config.refinements)),
        ("largest strain", number(config.max_strain)),
        ("scheme", config.step.scheme.to_string()),
        ("Δt", step(config.step.dt)),
    ])
}

const PLOTS: &[Plan] = &[Plan {
    id: "mass-ratios",
    title: "Error against mass ratio",
    text: "What forming S loses, about roundoff × mass ratio, refinement from the pieces brings back.",
    panels: &["pose", "segments", "refinements"],
    x: positive(&["mass_ratio"], "load/segment mass ratio (1)", 1.0),
    y: error(&["forward_error"], "relative error of the multipliers (1)"),
    ..PLAIN
}];

const SHEETS: &[Sheet] = &[Sheet {
    shared: &[column("pose", "{}"), column("segments", "{} segments")],
    columns: &[column("options", "solver").shown(Show::Row(backend))],
    across: Some(Across {
        by: &[column("mass_ratio", "{}").shown(Show::Ratio)],
        cells: &[sheet::error("forward_error", "").shown(Show::Error(0))],
        several: true,
        most: 5,
    }),
    counts: has_no_error,
    ..sheet::PLAIN
}];

/// The solver without its limit of iterations, which all have.
fn backend(row: &Row) -> String {
    text_of(row, "backend").to_owned()
}

const BARS: Sheet = Sheet {
    columns: &[
        column("backend", "solver"),
        column("limit", "kept up to").shown(Show::Row(kept)),
        column("worst_forward_error", "largest").shown(Show::Error(1)),
        column("worst_mass_ratio", "at ratio").shown(Show::Ratio),
        column("worst_pose", "pose"),
        column("worst_segments", "segments"),
    ],
    ..sheet::PLAIN
};

fn kept(row: &Row) -> String {
    number_of(row, "limit").map_or("nowhere".to_owned(), ratio)
}

/// Which direct solvers keep the bar.
fn bars(verdicts: &[Verdict]) -> String {
    if verdicts.is_empty() {
        return String::new();
    }
    let missed = verdicts.iter().filter(|v| !v.holds());
    let missed: Vec<&str> = missed.map(|v| v.backend.as_str()).collect();
    let all = verdicts.len();
    let who = if missed.is_empty() {
        format!("all {all} direct solvers")
    } else {
        let held = all - missed.len();
        format!(
            "{held} of {all} direct solvers, not with\n{}",
            missed.join(", ")
        )
    };
    format!(
        "\nOne refinement, ratios up to {BAR_RATIO:.0e}: errors of at most {BAR:.0e} with {who}\n{}",
        BARS.of(&verdicts)
    )
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

    #[test]
    fn the_widest_table_fits_into_120_columns() {
        let config = Config {
            segments: vec![3],
            ..Config::default()
        };
        let records = run(&config, &Cases::default()).unwrap();
        let text = taut_output::table::plain(&SHEETS[0].text(&data(&records).unwrap()));
        let heading = text.lines().find(|l| l.contains("solver")).unwrap();
        let ratios: Vec<&str> = heading.split_whitespace().skip(1).collect();
        assert_eq!(ratios, ["1", "1000", "1e6", "1e9", "1e12"]);
        let width = text.lines().map(|l| l.chars().count()).max();
        assert!(width <= Some(120), "{width:?}\n{text}");
        assert!(text.contains("straight, 3 segments") && text.contains("bent, 3 segments"));
    }
}
