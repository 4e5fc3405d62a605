//! The systems that all solve: those of one step of the hoist.

use crate::systems::{Start, State};
use serde::Serialize;
use taut_integrator::{Form, StepError, StepOptions, Stepper};
use taut_measure::choice::Choice;
use taut_measure::reference::reference_choice;
use taut_model::{HoistParams, JointKind};
use taut_solver::SymBlockMatrix;

const DT: f64 = 1.0 / 60.0;

/// Angle of the cable \[rad].
const ANGLE: f64 = 0.3;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Joint {
    /// Three rows of stretch.
    Spherical,
    /// Three rows of stretch and two of bending.
    Untwisted,
    /// Three rows of stretch, two of bending and one of twist.
    Cosserat,
}

impl Joint {
    /// All of them, by their rows.
    pub const ALL: [Self; 3] = [Self::Spherical, Self::Untwisted, Self::Cosserat];

    pub fn rows(self) -> usize {
        match self {
            Self::Spherical => 3,
            Self::Untwisted => 5,
            Self::Cosserat => 6,
        }
    }

    /// The hoist with these joints, hanging at an angle.
    pub fn hoist(self, segments: usize, mass_ratio: f64) -> HoistParams {
        HoistParams {
            segments,
            mass_ratio,
            initial_angle: ANGLE,
            joint: match self {
                Self::Spherical => JointKind::Spherical,
                Self::Untwisted | Self::Cosserat => JointKind::Cosserat,
            },
            twist: (self == Self::Untwisted).then_some(false),
            ..HoistParams::default()
        }
    }
}

/// A matrix with its right-hand side.
pub type System = (SymBlockMatrix, Vec<f64>);

/// A hoist, the systems of its step in both forms, and the solution.
#[derive(Debug)]
pub struct Case {
    pub joint: Joint,
    pub segments: usize,
    pub mass_ratio: f64,
    state: State,
    schur: System,
    kkt: System,
}

impl Case {
    pub fn new(joint: Joint, segments: usize, mass_ratio: f64) -> Result<Self, StepError> {
        let scene = joint.hoist(segments, mass_ratio).build()?;
        let options = reference_choice().plain_options(DT);
        let state = State::tense(scene, &options)?;
        let mut stepper = state.stepper(options, Start::Cold)?;
        stepper.solve()?;
        let (a, b, _) = stepper.system();
        let schur = (a.clone(), b.to_vec());
        Ok(Self {
            joint,
            segments,
            mass_ratio,
            state,
            schur,
            kkt: stepper.assembled(Form::Kkt)?,
        })
    }

    /// S with its right-hand side.
    pub fn schur(&self) -> (&SymBlockMatrix, &[f64]) {
        (&self.schur.0, &self.schur.1)
    }

    /// The KKT matrix with its right-hand side.
    pub fn kkt(&self) -> (&SymBlockMatrix, &[f64]) {
        (&self.kkt.0, &self.kkt.1)
    }

    pub(super) fn state(&self) -> &State {
        &self.state
    }

    /// A stepper of the scene that solves S with a solver and refines once, from the pieces.
    pub(super) fn refining(&self, choice: &Choice) -> Result<Stepper, StepError> {
        let options = StepOptions {
            refinements: 1,
            ..choice.plain_options(DT)
        };
        self.state.stepper(options, Start::Cold)
    }
}

/// The multipliers in a solution of the KKT system, in the order of S: −μ stands where the diagonal, −Σ, is not
/// positive.
pub(super) fn multipliers(kkt: &SymBlockMatrix, x: &[f64]) -> Vec<f64> {
    let p = kkt.pattern();
    let mut mu = Vec::new();
    for j in 0..p.blocks() {
        let diagonal = kkt.block(p.column(j).start).iter();
        let diagonal = diagonal.step_by(p.size(j) + 1);
        let held = diagonal.zip(p.rows(j)).filter(|(d, _)| **d <= 0.0);
        mu.extend(held.map(|(_, r)| -x[r]));
    }
    mu
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_solver::{forward_error, reference_solution};

    #[test]
    fn the_two_forms_have_the_same_multipliers() {
        for joint in Joint::ALL {
            let case = Case::new(joint, 9, 100.0).unwrap();
            let (a, b) = case.schur();
            assert_eq!(a.pattern().size(4), joint.rows());
            assert_eq!(a.dim(), case.state().exact().len());
            let x = reference_solution(a, b).unwrap();
            let error = forward_error(&x, case.state().exact());
            assert!(error > 0.0 && error < 1e-11, "{joint:?}: {error}");
        }
    }

    #[test]
    fn a_refining_step_solves_the_same_matrix() {
        let case = Case::new(Joint::Untwisted, 9, 100.0).unwrap();
        let mut stepper = case.refining(&reference_choice()).unwrap();
        for _ in 0..2 {
            case.state().put(&mut stepper, Start::Cold).unwrap();
            stepper.solve().unwrap();
            let (a, b, _) = stepper.system();
            let (expected, rhs) = case.schur();
            assert_eq!(a, expected);
            // It comes by way of velocities that are corrected from those before.
            assert!(forward_error(b, rhs) < 1e-15);
        }
    }
}
