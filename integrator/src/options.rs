//! How a scene is stepped: scheme, time step, form of the linear system, backend.

use crate::StepError;
use std::fmt;
use std::str::FromStr;
use taut_solver::Backend;

/// How positions, velocities and multipliers are advanced over one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Scheme {
    /// Symplectic Euler with linearly implicit constraint forces, [SL (8)–(11)]: first order, damps stiff modes.
    #[default]
    LinearlyImplicit,
}

impl Scheme {
    /// All schemes.
    pub const ALL: [Self; 1] = [Self::LinearlyImplicit];
}

impl fmt::Display for Scheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::LinearlyImplicit => "linearly-implicit",
        })
    }
}

/// Which linear system a step solves for the multipliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Form {
    /// The Schur complement S = J M⁻¹ Jᵀ + Σ, symmetric positive definite, [SL (11)]. Forming it loses about
    /// roundoff × mass ratio of relative accuracy; one refinement from the pieces brings it back.
    #[default]
    Schur,
    /// The symmetric KKT matrix [M Jᵀ; J −Σ], quasi-definite, [SL (10)].
    Kkt,
}

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Schur => "schur",
            Self::Kkt => "kkt",
        })
    }
}

/// A name that is none of the known ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownName {
    /// What was to be named: `"scheme"`, `"form"`.
    pub what: &'static str,
    /// The name given.
    pub name: String,
    /// The names that there are.
    pub known: String,
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "unknown {} `{}`: choose one of {}",
            self.what, self.name, self.known
        )
    }
}

impl std::error::Error for UnknownName {}

fn named<T: Copy + fmt::Display>(
    what: &'static str,
    all: &[T],
    name: &str,
) -> Result<T, UnknownName> {
    all.iter()
        .copied()
        .find(|v| v.to_string() == name)
        .ok_or_else(|| {
            let known = all.iter().map(T::to_string).collect::<Vec<_>>().join(", ");
            UnknownName {
                what,
                name: name.to_owned(),
                known,
            }
        })
}

impl FromStr for Scheme {
    type Err = UnknownName;
    fn from_str(name: &str) -> Result<Self, UnknownName> {
        named("scheme", &Self::ALL, name)
    }
}

impl FromStr for Form {
    type Err = UnknownName;
    fn from_str(name: &str) -> Result<Self, UnknownName> {
        named("form", &[Self::Schur, Self::Kkt], name)
    }
}

/// Options of a [`crate::Stepper`].
#[derive(Debug, Clone, PartialEq)]
pub struct StepOptions {
    /// Time step Δt > 0 \[s].
    pub dt: f64,
    /// The scheme.
    pub scheme: Scheme,
    /// The linear system.
    pub form: Form,
    /// The solver.
    pub backend: Backend,
    /// Refinement sweeps after the solve: from the pieces M, J, Σ for [`Form::Schur`], with b − A x for [`Form::Kkt`].
    pub refinements: usize,
    /// Whether iterative backends start from the last step's multipliers (else from zero).
    pub warm_start: bool,
}

impl Default for StepOptions {
    /// 1/60 s, the paper's scheme on the Schur complement, the first backend compiled in, one refinement.
    fn default() -> Self {
        let backend = Backend::preferred().unwrap_or(Backend::Banded);
        Self {
            dt: 1.0 / 60.0,
            scheme: Scheme::default(),
            form: Form::default(),
            refinements: usize::from(!backend.is_iterative()),
            backend,
            warm_start: true,
        }
    }
}

impl StepOptions {
    /// Checks what the type system does not.
    pub(crate) fn validate(&self) -> Result<(), StepError> {
        if !(self.dt > 0.0 && self.dt.is_finite()) {
            return Err(StepError::InvalidOption {
                field: "dt",
                value: self.dt,
                allowed: "a positive finite number of seconds",
            });
        }
        if self.form == Form::Kkt && !self.backend.accepts_indefinite() {
            return Err(StepError::FormNotAccepted {
                backend: self.backend.to_string(),
                form: self.form,
            });
        }
        Ok(())
    }
}
