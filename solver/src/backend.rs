//! The choice of a backend as a value: names, options, availability.

use crate::backends::dense::Dense;
use crate::backends::{self, General};
use crate::options::{
    CgOptions, DenseOptions, FaerFactorization, FaerOptions, GaussSeidelOptions, Partition,
    Precision, Preconditioner, Start, UmfpackOptions,
};
use crate::{BlockPattern, GeneralMatrix, LinearSolver, SolveError};
use std::fmt;
use std::str::FromStr;

/// A backend with its options. All variants always exist; [`create`](Self::create) fails for those not compiled in.
///
/// The text form is the name, then options after colons: `banded`, `gauss-seidel:groups:iterations=20`, `cg:jacobi`,
/// `faer:lu`, `dense:double`. [`FromStr`] reads what [`fmt::Display`] writes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Backend {
    /// Block LDLᵀ: chains from both ends, leaves and borders; other patterns in their order.
    Banded,
    /// Block Gauss–Seidel.
    GaussSeidel(GaussSeidelOptions),
    /// Preconditioned conjugate gradient.
    ConjugateGradient(CgOptions),
    /// SuiteSparse UMFPACK: sparse LU with pivoting (GPL).
    Umfpack(UmfpackOptions),
    /// faer's sparse factorisations.
    Faer(FaerOptions),
    /// nalgebra-sparse's Cholesky.
    NalgebraSparse,
    /// Dense LU with partial pivoting, for small systems.
    Dense(DenseOptions),
}

impl Backend {
    /// All backends with their default options, in order of preference.
    #[must_use]
    pub fn all() -> [Self; 7] {
        [
            Self::Banded,
            Self::Faer(FaerOptions::default()),
            Self::NalgebraSparse,
            Self::Umfpack(UmfpackOptions::default()),
            Self::ConjugateGradient(CgOptions::default()),
            Self::GaussSeidel(GaussSeidelOptions::default()),
            Self::Dense(DenseOptions::default()),
        ]
    }

    /// The first backend of [`all`](Self::all) that is compiled in, so that a dependent crate picks its solver by
    /// Cargo feature alone. Never fails today, since the dense solver is always there.
    ///
    /// # Errors
    /// [`SolveError::NotCompiled`] were there none.
    pub fn preferred() -> Result<Self, SolveError> {
        let none = SolveError::NotCompiled {
            backend: "any",
            feature: "banded",
        };
        Self::all().into_iter().find(Self::is_compiled).ok_or(none)
    }

    /// Name, as on the command line.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Banded => "banded",
            Self::GaussSeidel(_) => "gauss-seidel",
            Self::ConjugateGradient(_) => "cg",
            Self::Umfpack(_) => "umfpack",
            Self::Faer(_) => "faer",
            Self::NalgebraSparse => "nalgebra-sparse",
            Self::Dense(_) => "dense",
        }
    }

    /// The Cargo feature that brings it; `None` where it is always there.
    #[must_use]
    pub fn feature(&self) -> Option<&'static str> {
        match self {
            Self::Dense(_) => None,
            other => Some(other.name()),
        }
    }

    /// Licence of the code behind it.
    #[must_use]
    pub fn licence(&self) -> &'static str {
        match self {
            Self::Umfpack(_) => "GPL-2.0-or-later",
            Self::Faer(_) => "MIT",
            Self::NalgebraSparse => "Apache-2.0",
            _ => "MIT OR Apache-2.0",
        }
    }

    /// Whether it accepts symmetric matrices that are not positive definite, such as the KKT matrix.
    #[must_use]
    pub fn accepts_indefinite(&self) -> bool {
        match self {
            Self::Banded | Self::Umfpack(_) | Self::Dense(_) => true,
            Self::Faer(o) => o.factorization != FaerFactorization::Llt,
            Self::GaussSeidel(_) | Self::ConjugateGradient(_) | Self::NalgebraSparse => false,
        }
    }

    /// Whether it iterates, so that its error depends on its iterations.
    #[must_use]
    pub fn is_iterative(&self) -> bool {
        matches!(self, Self::GaussSeidel(_) | Self::ConjugateGradient(_))
    }

    /// Whether it reads the block that couples two block rows of the given groups: the iterative ones' factors hold no
    /// more than their groups or single blocks.
    #[must_use]
    pub fn factorizes(&self, (i, group_i): (usize, u32), (j, group_j): (usize, u32)) -> bool {
        match self {
            Self::GaussSeidel(o) if o.partition == Partition::Groups => group_i == group_j,
            Self::ConjugateGradient(o) if o.preconditioner == Preconditioner::Group => {
                group_i == group_j
            }
            Self::GaussSeidel(_) | Self::ConjugateGradient(_) => i == j,
            _ => true,
        }
    }

    /// Whether it factorises, the whole matrix or its groups, in the order of the pattern.
    #[must_use]
    pub fn keeps_order(&self) -> bool {
        match self {
            Self::Banded | Self::NalgebraSparse => true,
            Self::Faer(o) => o.factorization != FaerFactorization::Lu,
            Self::Umfpack(_) | Self::Dense(_) => false,
            Self::GaussSeidel(_) | Self::ConjugateGradient(_) => self.factorizes_groups(),
        }
    }

    /// Whether it factorises the groups of the pattern.
    #[must_use]
    pub fn factorizes_groups(&self) -> bool {
        self.is_iterative() && self.factorizes((0, 0), (1, 0))
    }

    /// Scalar rows of the border where it eliminates the blocks of `pattern` in `order` (position → block) as a chain with
    /// leaves and a border, in vectors: faster than in others that take as many operations, and the faster the fewer
    /// these rows are. `None` where it does not. Allocates.
    ///
    /// # Errors
    /// [`SolveError::Dimension`] and [`SolveError::InvalidOption`] where `order` is no permutation of the blocks.
    pub fn border_rows(
        &self,
        pattern: &BlockPattern,
        order: &[usize],
    ) -> Result<Option<usize>, SolveError> {
        match self {
            #[cfg(feature = "banded")]
            Self::Banded => crate::backends::banded::border_rows(pattern, order),
            _ => crate::ordering::positions(order, pattern.blocks()).map(|_| None),
        }
    }

    /// Whether it is compiled in.
    #[must_use]
    pub fn is_compiled(&self) -> bool {
        !matches!(self.create(), Err(SolveError::NotCompiled { .. }))
    }

    /// The same backend with another limit of iterations; unchanged where it does not iterate.
    #[must_use]
    pub fn with_iterations(&self, iterations: usize) -> Self {
        match self {
            Self::GaussSeidel(o) => Self::GaussSeidel(GaussSeidelOptions { iterations, ..*o }),
            Self::ConjugateGradient(o) => Self::ConjugateGradient(CgOptions { iterations, ..*o }),
            other => other.clone(),
        }
    }

    /// The same backend with another tolerance, relative to ‖b‖₂; unchanged where it does not iterate.
    #[must_use]
    pub fn with_tolerance(&self, tolerance: f64) -> Self {
        match self {
            Self::GaussSeidel(o) => Self::GaussSeidel(GaussSeidelOptions { tolerance, ..*o }),
            Self::ConjugateGradient(o) => Self::ConjugateGradient(CgOptions { tolerance, ..*o }),
            other => other.clone(),
        }
    }

    /// A solver with these options.
    ///
    /// # Errors
    /// [`SolveError::NotCompiled`], [`SolveError::InvalidOption`].
    pub fn create(&self) -> Result<Box<dyn LinearSolver>, SolveError> {
        match self {
            #[cfg(feature = "banded")]
            Self::Banded => Ok(Box::new(backends::banded::Banded::default())),
            #[cfg(feature = "gauss-seidel")]
            Self::GaussSeidel(o) => Ok(Box::new(backends::gauss_seidel::GaussSeidel::new(*o)?)),
            #[cfg(feature = "cg")]
            Self::ConjugateGradient(o) => Ok(Box::new(
                backends::conjugate_gradient::ConjugateGradient::new(*o)?,
            )),
            #[cfg(feature = "umfpack")]
            Self::Umfpack(o) => Ok(Box::new(backends::umfpack::Umfpack::new(*o))),
            #[cfg(feature = "faer")]
            Self::Faer(o) => Ok(Box::new(backends::faer::Faer::new(*o))),
            #[cfg(feature = "nalgebra-sparse")]
            Self::NalgebraSparse => Ok(Box::new(
                backends::nalgebra_sparse::NalgebraSparse::default(),
            )),
            Self::Dense(o) => Ok(backends::dense::create(*o)),
            #[allow(unreachable_patterns)] // with every feature on
            other => Err(SolveError::NotCompiled {
                backend: other.name(),
                feature: other.name(),
            }),
        }
    }

    /// A solver for matrices with the pattern of `a`, which need not be symmetric and has at least one row.
    pub(crate) fn create_general(&self, a: &GeneralMatrix) -> Result<General, SolveError> {
        Ok(match self {
            Self::Dense(o) if o.precision == Precision::Extended => {
                General::Extended(Dense::general(a)?)
            }
            Self::Dense(_) => General::Dense(Dense::general(a)?),
            #[cfg(feature = "faer")]
            Self::Faer(_) => General::Faer(Box::new(backends::faer::Lu::general(a)?)),
            #[cfg(feature = "umfpack")]
            Self::Umfpack(o) => General::Umfpack(Box::new(backends::umfpack::General::new(*o, a)?)),
            other => {
                return Err(SolveError::NotSymmetric {
                    backend: other.name(),
                });
            }
        })
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Banded | Self::NalgebraSparse => Ok(()),
            Self::GaussSeidel(o) => {
                let partition = match o.partition {
                    Partition::Joints => "joints",
                    Partition::Groups => "groups",
                };
                let start = match o.start {
                    Start::Guess => "",
                    Start::Trial => ":trial",
                };
                write!(
                    f,
                    ":{partition}{start}:iterations={}:tolerance={:e}",
                    o.iterations, o.tolerance
                )
            }
            Self::ConjugateGradient(o) => {
                let preconditioner = match o.preconditioner {
                    Preconditioner::None => "none",
                    Preconditioner::BlockJacobi => "jacobi",
                    Preconditioner::Group => "group",
                };
                write!(
                    f,
                    ":{preconditioner}:iterations={}:tolerance={:e}",
                    o.iterations, o.tolerance
                )
            }
            Self::Umfpack(o) => write!(f, ":refinement={}", o.refinement_steps),
            Self::Faer(o) => f.write_str(match o.factorization {
                FaerFactorization::Llt => ":llt",
                FaerFactorization::Ldlt => ":ldlt",
                FaerFactorization::Lblt => ":lblt",
                FaerFactorization::Lu => ":lu",
            }),
            Self::Dense(o) => f.write_str(match o.precision {
                Precision::Double => ":double",
                Precision::Extended => ":extended",
            }),
        }
    }
}

/// Why a text names no backend.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ParseBackendError {
    /// No backend has this name.
    UnknownName {
        /// The name given.
        name: String,
    },
    /// The backend has no such option, or not with this value.
    UnknownOption {
        /// The backend.
        backend: &'static str,
        /// The option given.
        option: String,
        /// What it knows.
        known: &'static str,
    },
}

impl fmt::Display for ParseBackendError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownName { name } => {
                let names = Backend::all().map(|b| b.name()).join(", ");
                write!(f, "unknown backend `{name}`: choose one of {names}")
            }
            Self::UnknownOption {
                backend,
                option,
                known,
            } => {
                write!(
                    f,
                    "backend `{backend}` has no option `{option}`: it knows {known}"
                )
            }
        }
    }
}

impl std::error::Error for ParseBackendError {}

impl FromStr for Backend {
    type Err = ParseBackendError;

    fn from_str(text: &str) -> Result<Self, ParseBackendError> {
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or_default();
        let unknown = || ParseBackendError::UnknownName {
            name: name.to_owned(),
        };
        let mut backend = Self::all()
            .into_iter()
            .find(|b| b.name() == name)
            .ok_or_else(unknown)?;
        for option in parts {
            if !backend.set(option) {
                let (backend, known) = (backend.name(), backend.known_options());
                return Err(ParseBackendError::UnknownOption {
                    backend,
                    option: option.to_owned(),
                    known,
                });
            }
        }
        Ok(backend)
    }
}

impl Backend {
    /// Sets one option from its text; `false` where there is no such option or value.
    fn set(&mut self, option: &str) -> bool {
        let (key, value) = option.split_once('=').unwrap_or((option, ""));
        match (self, key) {
            (Self::GaussSeidel(o), "joints") => o.partition = Partition::Joints,
            (Self::GaussSeidel(o), "groups") => o.partition = Partition::Groups,
            (Self::GaussSeidel(o), "guess") => o.start = Start::Guess,
            (Self::GaussSeidel(o), "trial") => o.start = Start::Trial,
            (Self::GaussSeidel(o), "iterations") => return assign(&mut o.iterations, value),
            (Self::GaussSeidel(o), "tolerance") => return assign(&mut o.tolerance, value),
            (Self::ConjugateGradient(o), "none") => o.preconditioner = Preconditioner::None,
            (Self::ConjugateGradient(o), "jacobi") => {
                o.preconditioner = Preconditioner::BlockJacobi
            }
            (Self::ConjugateGradient(o), "group") => o.preconditioner = Preconditioner::Group,
            (Self::ConjugateGradient(o), "iterations") => return assign(&mut o.iterations, value),
            (Self::ConjugateGradient(o), "tolerance") => return assign(&mut o.tolerance, value),
            (Self::Umfpack(o), "refinement") => return assign(&mut o.refinement_steps, value),
            (Self::Faer(o), "llt") => o.factorization = FaerFactorization::Llt,
            (Self::Faer(o), "ldlt") => o.factorization = FaerFactorization::Ldlt,
            (Self::Faer(o), "lblt") => o.factorization = FaerFactorization::Lblt,
            (Self::Faer(o), "lu") => o.factorization = FaerFactorization::Lu,
            (Self::Dense(o), "double") => o.precision = Precision::Double,
            (Self::Dense(o), "extended") => o.precision = Precision::Extended,
            _ => return false,
        }
        value.is_empty()
    }

    fn known_options(&self) -> &'static str {
        match self {
            Self::Banded | Self::NalgebraSparse => "none",
            Self::GaussSeidel(_) => "joints, groups, guess, trial, iterations=N, tolerance=T",
            Self::ConjugateGradient(_) => "none, jacobi, group, iterations=N, tolerance=T",
            Self::Umfpack(_) => "refinement=N",
            Self::Faer(_) => "llt, ldlt, lblt, lu",
            Self::Dense(_) => "double, extended",
        }
    }
}

fn assign<V: FromStr>(to: &mut V, text: &str) -> bool {
    text.parse().map(|v| *to = v).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{MOST_ITERATIONS, check_iteration};

    #[test]
    fn text_form_round_trips() {
        let texts = [
            "banded",
            "gauss-seidel:groups:trial:iterations=7:tolerance=1e-3",
            "cg:none:iterations=3:tolerance=0e0",
            "cg:jacobi",
            "umfpack:refinement=0",
            "faer:lblt",
            "faer:lu",
            "nalgebra-sparse",
            "dense:extended",
            "dense:double",
        ];
        for text in texts {
            let backend: Backend = text.parse().unwrap();
            assert_eq!(backend.to_string().parse(), Ok(backend), "{text}");
        }
    }

    #[test]
    fn unknown_names_and_options_list_what_is_known() {
        let e = "superlu".parse::<Backend>().unwrap_err().to_string();
        assert!(
            e.contains("superlu") && e.contains("banded") && e.contains("umfpack"),
            "{e}"
        );
        for text in [
            "banded:fast",
            "cg:iterations=x",
            "cg:group=1",
            "cg:matrix-free",
            "faer:qr",
            "",
        ] {
            assert!(text.parse::<Backend>().is_err(), "{text}");
        }
    }

    #[test]
    fn what_is_not_compiled_is_named_with_its_feature() {
        for backend in Backend::all() {
            match backend.create() {
                Ok(solver) => assert_eq!(solver.name(), backend.name()),
                Err(e) => {
                    let feature = backend.feature().unwrap();
                    assert_eq!(
                        e,
                        SolveError::NotCompiled {
                            backend: backend.name(),
                            feature
                        }
                    );
                }
            }
        }
        assert!(Backend::preferred().unwrap().is_compiled());
    }

    #[test]
    fn iteration_options_are_checked() {
        assert!(check_iteration(0, 0.1).is_err());
        assert!(check_iteration(usize::MAX, 0.0).is_err());
        assert!(check_iteration(MOST_ITERATIONS, 0.0).is_ok());
        assert!(check_iteration(1, f64::NAN).is_err());
        assert!(check_iteration(1, -1.0).is_err());
        assert!(check_iteration(1, 0.0).is_ok());
    }
}
