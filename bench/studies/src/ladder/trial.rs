//! A solver as a row of the main job runs it: in scenes with contacts joined to a method for these, and judged by the
//! velocities that its step ends with. The impulses of contacts need not be unique, the velocities are.
//!
//! With v the velocities after one step from a common state and v* those of the reference, the error is
//!   max |v − v*| / max(max |v*|, g Δt)
//! over moving bodies, the largest of the frames: gravity's part of a step is the scale of what rests. The reference is
//! Newton's method on a dense factorisation of 32 digits (up to [`DENSE_ROWS`] rows, else in double), with
//! [`REFINEMENTS`]. Its own error is the distance to the same with the reference solver.

use super::{Case, DENSE_ROWS};
use nalgebra::Vector3;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_measure::choice::Choice;
use taut_measure::errors::worse;
use taut_measure::pace;
use taut_measure::reference::reference_choice;
use taut_solver::coulomb::ConeMethod;
use taut_solver::{Backend, DenseOptions, Precision};

const METHODS: [&str; 4] = ["newton", "pgs:sweeps=10", "pgs:sweeps=50", "pgs:sweeps=200"];

const REFINEMENTS: usize = 3;

/// Contact methods for a solver: `None` alone in a scene without contacts. The first solver runs
/// with all methods. The others, which make the same dense problem, run with Newton's alone.
pub(super) fn methods(has_contacts: bool, is_first: bool) -> Vec<Option<ConeMethod>> {
    if !has_contacts {
        return vec![None];
    }
    let count = if is_first { METHODS.len() } else { 1 };
    METHODS[..count]
        .iter()
        .filter_map(|m| m.parse().ok().map(Some))
        .collect()
}

/// A solver, and the method of contacts.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    pub(super) choice: Choice,
    pub(super) contacts: Option<ConeMethod>,
}

impl Trial {
    /// Text of the solver, with the method's after it.
    fn joined(&self, solver: String) -> String {
        let Some(method) = self.contacts else {
            return solver;
        };
        let method = method.to_string();
        let kept = method.split(':').filter(|o| !o.starts_with("tolerance="));
        format!("{solver} + {}", kept.collect::<Vec<_>>().join(":"))
    }

    /// Without iterations and tolerances.
    pub(super) fn family(&self) -> String {
        self.joined(self.choice.family())
    }

    /// With all options of the solver.
    pub(super) fn text(&self) -> String {
        self.joined(self.choice.to_string())
    }

    /// Its step, without the guard.
    pub(super) fn plain_options(&self, dt: f64) -> StepOptions {
        StepOptions {
            contacts: self.contacts.unwrap_or_default(),
            ..self.choice.plain_options(dt)
        }
    }
}

/// Velocities of the moving bodies \[m/s].
type Velocities = Vec<Vector3<f64>>;

/// Velocities after a step from each common state but the first, and the largest violation of the contacts' conditions.
pub(super) fn velocities(
    case: &Case,
    options: StepOptions,
) -> Result<(Vec<Velocities>, f64), StepError> {
    let all = case.in_each(options, |stepper| {
        let report = pace::step(stepper)?;
        Ok((moving(stepper), report.contacts.complementarity))
    })?;
    let (velocities, violations): (Vec<_>, Vec<f64>) = all.into_iter().unzip();
    Ok((velocities, violations.into_iter().fold(0.0, worse)))
}

fn moving(stepper: &Stepper) -> Velocities {
    let scene = stepper.scene();
    scene
        .dynamic_bodies()
        .map(|i| scene.bodies.velocity[i])
        .collect()
}

pub(super) fn reference(case: &Case, dt: f64) -> Result<(Vec<Velocities>, f64), StepError> {
    let with = |choice: Choice| {
        let options = choice.plain_options(dt);
        let refinements = REFINEMENTS;
        velocities(
            case,
            StepOptions {
                refinements,
                ..options
            },
        )
    };
    let is_small = case.exact.first().is_none_or(|x| x.len() <= DENSE_ROWS);
    let precision = if is_small {
        Precision::Extended
    } else {
        Precision::default()
    };
    let (exact, _) = with(Choice::schur(Backend::Dense(DenseOptions { precision })))?;
    let (other, _) = with(reference_choice())?;
    let error = distance(&other, &exact, case.least_speed(dt));
    Ok((exact, error))
}

/// The error ([module](self)); `least` is g Δt.
pub(super) fn distance(ours: &[Velocities], exact: &[Velocities], least: f64) -> f64 {
    let frame = |(ours, exact): (&Velocities, &Velocities)| {
        let off = ours.iter().zip(exact).map(|(v, e)| (v - e).norm());
        let scale = exact.iter().map(Vector3::norm).fold(least, f64::max);
        off.fold(0.0, worse) / scale
    };
    ours.iter().zip(exact).map(frame).fold(0.0, worse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_understood_and_told() {
        let listed = methods(true, true).into_iter().map(|contacts| {
            let choice = reference_choice();
            Trial { choice, contacts }.family()
        });
        let expected = METHODS.map(|m| format!("{} + {m}", reference_choice().family()));
        assert!(listed.eq(expected));
        assert_eq!(methods(false, true), [None]);
        assert_eq!(methods(true, false), [Some(ConeMethod::default())]);
    }

    #[test]
    fn an_error_is_of_the_fastest_body_or_of_gravity() {
        let at = |x: f64| vec![vec![Vector3::x() * x]];
        assert_eq!(distance(&at(3.0), &at(2.0), 0.1), 0.5);
        assert_eq!(distance(&at(0.1), &at(0.0), 0.2), 0.5);
        assert!(distance(&at(f64::NAN), &at(1.0), 0.1).is_nan());
    }
}
