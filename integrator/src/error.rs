//! Errors of a step, in the scene's own names.

use crate::Form;
use std::fmt;
use taut_model::SceneError;
use taut_solver::SolveError;

/// Why a stepper cannot be made or a step cannot be taken.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// An option is out of its range.
    InvalidOption {
        /// Name of the option.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The limit.
        allowed: &'static str,
    },
    /// The backend does not take matrices of this form.
    FormNotAccepted {
        /// The backend with its options.
        backend: String,
        /// The form.
        form: Form,
    },
    /// The scene is not valid.
    Scene(SceneError),
    /// The linear system could not be solved.
    Solve {
        /// The solver's error.
        source: SolveError,
        /// The constraint or body that its block number stands for, where it gave one.
        culprit: Option<String>,
        /// Time at the beginning of the step \[s].
        time: f64,
    },
    /// The handle is of a body, constraint or control that has been removed from the scene.
    Gone {
        /// `body`, `constraint` or `control`.
        kind: &'static str,
    },
    /// A motor, winch, body or control cannot be set like that.
    NotControllable {
        /// Which.
        what: String,
        /// The reason, and the cure.
        reason: &'static str,
    },
    /// The parts of a saved run do not fit together, or hold what cannot be saved.
    Saved {
        /// Name of the part.
        what: &'static str,
        /// The fault.
        reason: String,
    },
    /// A massless cable has no way over its sheaves any more, or a motor does not know its angle.
    OffPath {
        /// Name of the cable or its part, or of the hinge.
        cable: String,
        /// The cause, and the cure.
        reason: &'static str,
        /// Time of the last state that it had one in, or at the end of the step \[s].
        time: f64,
    },
    /// The active set of the rows with bounds was not found.
    Undecided {
        /// Time at the beginning of the step \[s].
        time: f64,
    },
    /// The flag of [`Stepper::stop_by`](crate::Stepper::stop_by) was set, and the step was taken
    /// back: the run is in the state that the step began with, also before its first sub-step. No
    /// event has fired.
    ///
    /// Once the flag is cleared, further steps go on with the bits of a run that was not stopped; so
    /// does a [`SavedRun`](crate::SavedRun) made of this state. Between
    /// [`solve`](crate::Stepper::solve) and [`advance`](crate::Stepper::advance), solve again.
    Stopped {
        /// Time at which the step looked at the flag, within the interrupted sub-step \[s].
        time: f64,
    },
    /// The contacts of the step took more work than a step may, some 10 s. With a flag
    /// ([`Stepper::stop_by`](crate::Stepper::stop_by)) the run is in the state that the step began
    /// with, otherwise its state is not to be used.
    TooMuchWork {
        /// Time at the beginning of the sub-step that took too much \[s].
        time: f64,
    },
    /// More contacts than the step solves.
    TooManyContacts {
        /// Contacts with a part in the step.
        contacts: usize,
        /// Most of them.
        most: usize,
        /// Time at the beginning of the step \[s].
        time: f64,
    },
    /// No static equilibrium was found.
    NoEquilibrium {
        /// Solves made.
        passes: usize,
        /// Largest change of a position in the last of them that was taken, over the scene's extent.
        change: f64,
        /// The body that it was.
        body: Option<String>,
        /// Residual force, over the largest force.
        equilibrium_residual: f64,
        /// A constraint that gave way at its limit of force.
        limited: Option<String>,
    },
    /// Shapes overlap in the static equilibrium, which knows no contacts.
    EquilibriumOverlaps {
        /// The names of the colliders that overlap most.
        colliders: [String; 2],
        /// Depth of the overlap \[m].
        depth: f64,
    },
    /// More energy than the motion began with and its drives have put in: the step has become unstable. The state is that
    /// of the step's end; a further step begins a new balance.
    EnergyGain {
        /// Energy from nowhere \[J].
        excess: f64,
        /// Scale of the motion's energy \[J]:
        /// [`EnergyBalance::scale`](crate::EnergyBalance::scale).
        scale: f64,
        /// Time at the end of the step \[s].
        time: f64,
    },
    /// The state is no longer finite: the step has become unstable.
    NonFinite {
        /// Name of the first body concerned.
        body: String,
        /// Time at the end of the step \[s].
        time: f64,
    },
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InvalidOption {
                field,
                value,
                allowed,
            } => {
                write!(f, "option `{field}` is {value}: it must be {allowed}")
            }
            Self::FormNotAccepted { backend, form } => write!(
                f,
                "backend `{backend}` does not take the indefinite `{form}` form: use the `schur` form, or banded, \
                 faer:ldlt, faer:lblt, faer:lu, umfpack or dense"
            ),
            Self::Scene(e) => e.fmt(f),
            Self::Solve {
                source,
                culprit,
                time,
            } => {
                write!(f, "at t = {time:.4} s: ")?;
                if let Some(name) = culprit {
                    write!(f, "`{name}`: ")?;
                }
                source.fmt(f)
            }
            Self::Gone { kind } => write!(
                f,
                "the {kind} has been removed: look it up again by its name"
            ),
            Self::NotControllable { what, reason } => write!(f, "{what} {reason}"),
            Self::Saved { what, reason } => write!(f, "saved run: `{what}` {reason}"),
            Self::OffPath {
                cable,
                reason,
                time,
            } => write!(f, "at t = {time:.4} s: `{cable}` {reason}"),
            Self::Undecided { time } => write!(
                f,
                "at t = {time:.4} s: which cables are slack and which motors at their limits could not be decided"
            ),
            Self::Stopped { time } => {
                write!(f, "at t = {time:.4} s: the step was asked to end")
            }
            Self::TooMuchWork { time } => write!(
                f,
                "at t = {time:.4} s: the contacts of the step take too long to find: make the time step smaller, part \
                 bodies that are pressed into each other, or give fewer of them a shape"
            ),
            Self::TooManyContacts {
                contacts,
                most,
                time,
            } => write!(
                f,
                "at t = {time:.4} s: {contacts} shapes touch, and the most is {most}: give fewer bodies a shape, or \
                 part them"
            ),
            Self::NoEquilibrium {
                passes,
                change,
                body,
                equilibrium_residual,
                limited,
            } => {
                write!(f, "no static equilibrium found in {passes} solves: ")?;
                if let Some(body) = body {
                    write!(
                        f,
                        "the last moved `{body}` the most, by {change:.1e} of the scene's extent, and left \
                         {equilibrium_residual:.1e} of the largest force without balance: "
                    )?;
                }
                match limited {
                    Some(name) => write!(f, "`{name}` gives way at its limit of force: raise it"),
                    None => f.write_str(
                        "hold the body where it is free, look at stiffnesses (N, N m²) and lengths (m), or start without \
                         equilibrium",
                    ),
                }
            }
            Self::EquilibriumOverlaps {
                colliders: [a, b],
                depth,
            } => write!(
                f,
                "in the static equilibrium the shapes `{a}` and `{b}` overlap by {depth:.3e} m: it is found without \
                 contacts: shorten what the bodies hang on, move one, or start without equilibrium"
            ),
            Self::EnergyGain {
                excess,
                scale,
                time,
            } => gained(f, *excess, *scale, *time),
            Self::NonFinite { body, time } => write!(
                f,
                "the state of body `{body}` is not finite at t = {time:.4} s: the step is unstable (use a smaller Δt, \
                 a smaller mass ratio or stiffer bending)"
            ),
        }
    }
}

/// Message of [`StepError::EnergyGain`].
fn gained(f: &mut fmt::Formatter<'_>, excess: f64, scale: f64, time: f64) -> fmt::Result {
    if !excess.is_finite() {
        return write!(
            f,
            "at t = {time:.4} s: the energy is {excess} J: the step is unstable"
        );
    }
    write!(
        f,
        "at t = {time:.4} s: the motion has {excess:.2e} J from nowhere, {:.2} of its own {scale:.2e} J: the step is \
         unstable (use a smaller Δt, a guard, or another scheme or solver)",
        excess / scale
    )
}

impl std::error::Error for StepError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Scene(e) => Some(e),
            Self::Solve { source, .. } => Some(source),
            _ => None,
        }
    }
}

impl From<SceneError> for StepError {
    fn from(e: SceneError) -> Self {
        Self::Scene(e)
    }
}
