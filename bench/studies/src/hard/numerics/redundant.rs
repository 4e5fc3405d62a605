//! H42, first part: one joint two and three times.
//!
//! A ball of mass m hangs at rest from k equal ball joints at the same place. With the compliance ε > 0 each carries
//! m g/k, whatever ε: of all multipliers with the sum m g these have the least norm, and the least elastic energy. With
//! ε = 0 only the sum is determined, and S has rank 3 of 3 k: a definite factorisation has to say which joint depends on
//! those before it. Conjugate gradient without groups starts from zero, stays in the range of S, and so ends at the same
//! least norm; Gauss–Seidel joint by joint leaves all to the first.

use crate::hard::{solvers, together, worse};
use nalgebra::Vector3;
use taut_ground::choice::Choice;
use taut_integrator::{StepError, Stepper};
use taut_model::{Body, Constraint, Frame, RowLaw, Scene, SceneError, Spherical};
use taut_output::check::{Check, Verdict};
use taut_solver::SolveReport;

/// Relative bar of a share.
pub const BAR: f64 = 1e-8;

const DT: f64 = 1.0 / 60.0;
const MASS: f64 = 3.0;
const GRAVITY: f64 = 9.81;

/// Outcome of a scene with a solver.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    Shares {
        /// The force of each joint, upwards, over its share m g/k of the weight, without unit.
        shares: Vec<f64>,
        /// Sideways part of each joint's force, over the same share.
        across: Vec<f64>,
        /// Report of the solver.
        said: SolveReport,
    },
    /// A typed error.
    Refused {
        /// The constraint that it names.
        culprit: Option<String>,
        /// In words.
        message: String,
    },
}

impl Found {
    /// Largest distance of a share from 1 upwards and 0 sideways; ∞ if the solver refused.
    #[must_use]
    pub fn uneven(&self) -> f64 {
        match self {
            Self::Shares { shares, across, .. } => {
                let each = shares.iter().zip(across);
                each.map(|(s, a)| (s - 1.0).hypot(*a)).fold(0.0, worse)
            }
            Self::Refused { .. } => f64::INFINITY,
        }
    }

    /// Deviation of the sum of the forces from the weight, relative; ∞ if the solver refused.
    #[must_use]
    pub fn unbalanced(&self) -> f64 {
        match self {
            Self::Shares { shares, .. } => {
                (shares.iter().sum::<f64>() / shares.len() as f64 - 1.0).abs()
            }
            Self::Refused { .. } => f64::INFINITY,
        }
    }
}

/// The ball on `copies` equal joints of compliance `compliance` (m/N), in equilibrium.
///
/// # Errors
/// A compliance that is out of range.
pub fn scene(copies: usize, compliance: f64) -> Result<Scene, SceneError> {
    let mut scene = Scene::new("copies");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let gap = compliance * MASS * GRAVITY / copies as f64;
    let hook = Vector3::new(0.0, 0.0, 0.2);
    let centre = -hook - Vector3::z() * gap;
    let ball = scene.add_body("ball", Body::sphere(0.1, MASS).at(centre));
    for i in 1..=copies {
        let joint = Constraint::Spherical(Spherical {
            frames: [Frame::world(Vector3::zeros()), Frame::body(ball, hook)],
            stretch: RowLaw::new(compliance, 0.0),
        });
        scene.add_constraint(format!("copy-{i}"), joint, 0);
    }
    scene.validate()?;
    Ok(scene)
}

/// One step of the scene with a solver.
///
/// # Errors
/// [`StepError::Scene`], and errors other than a failure of the solve.
pub fn solve(copies: usize, compliance: f64, choice: &Choice) -> Result<Found, StepError> {
    let mut stepper = Stepper::new(scene(copies, compliance)?, choice.plain_options(DT))?;
    match stepper.step() {
        Ok(report) => {
            let share = MASS * GRAVITY / copies as f64;
            let rows = stepper.multipliers().chunks_exact(3);
            // Side a is the world, so the force on the ball is −λ.
            let of = |mu: &[f64]| (-mu[2] / DT / share, mu[0].hypot(mu[1]) / DT / share);
            let (shares, across) = rows.map(of).unzip();
            Ok(Found::Shares {
                shares,
                across,
                said: report.solve,
            })
        }
        Err(StepError::Solve {
            source, culprit, ..
        }) => Ok(Found::Refused {
            culprit,
            message: source.to_string(),
        }),
        Err(e @ StepError::NonFinite { .. }) => Ok(Found::Refused {
            culprit: None,
            message: e.to_string(),
        }),
        Err(e) => Err(e),
    }
}

/// The checks of the doubled joints.
pub(super) fn checks() -> Result<Vec<Check>, StepError> {
    let mut checks = Vec::new();
    for copies in [2, 3] {
        for compliance in [1e-6, 1e-10, 0.0] {
            let mut found = Vec::new();
            for choice in solvers() {
                let solved = solve(copies, compliance, &choice)?;
                let check = if compliance > 0.0 {
                    shared(copies, &solved)
                } else {
                    rigid(&solved)
                };
                found.push((choice.family(), check));
            }
            let law = if compliance > 0.0 {
                format!("{compliance:.0e} m/N")
            } else {
                "0".to_owned()
            };
            let case = format!("joint × {copies}, ε = {law}");
            checks.extend(together(&case, found));
        }
    }
    Ok(checks)
}

/// An iteration that says of itself that it is not there yet is at its limit.
fn shared(copies: usize, found: &Found) -> Check {
    let reference = format!("m g/{copies} each");
    match found {
        Found::Shares { shares, said, .. } => {
            Check::within("", reference, forces(shares), found.uneven(), BAR).unless_claimed(said)
        }
        Found::Refused { message, .. } => Check::failed("", reference, message),
    }
}

fn forces(shares: &[f64]) -> String {
    let shown: Vec<String> = shares.iter().map(|s| format!("{s:.4}")).collect();
    shown.join(", ")
}

/// Without compliance a solver refuses and names a copy; or its answer is that of least norm. Another share of the
/// right sum is a limit.
fn rigid(found: &Found) -> Check {
    let reference = "a typed error, or least norm";
    match found {
        Found::Shares { shares, .. } => {
            let even = found.uneven() <= BAR;
            let norm = if even { "least norm" } else { "not least norm" };
            let right = found.unbalanced() <= BAR;
            let verdict = match (right, even) {
                (true, true) => Verdict::Pass,
                (true, false) => Verdict::Limit,
                _ => Verdict::Fail,
            };
            let ours = format!("{}: {norm}", forces(shares));
            let note = if verdict == Verdict::Limit {
                "joint by joint the first takes all that is to be carried, and leaves the others what they started with"
            } else {
                ""
            };
            Check::claim("", reference, ours, verdict, note)
        }
        Found::Refused { culprit, message } => {
            let named = culprit.as_deref().unwrap_or("no joint");
            let ours = format!("refused, names {named}");
            Check::stated("", reference, ours, culprit.is_some()).noting(message.as_str())
        }
    }
}
