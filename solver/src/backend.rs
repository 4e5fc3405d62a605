//! The choice of a backend as a value: names, options, availability.

use crate::backends::dense::Dense;
use crate::backends::{self, General};
use crate::entry::{self, Entry};
use crate::foreign::{Foreign, option, registered, with_option};
use crate::options::{
    CgOptions, DenseOptions, FaerFactorization, FaerOptions, GaussSeidelOptions, MinresOptions,
    Partition, Precision, Preconditioner, Start, UmfpackOptions,
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
    /// Preconditioned MINRES.
    Minres(MinresOptions),
    /// SuiteSparse UMFPACK: sparse LU with pivoting (GPL).
    Umfpack(UmfpackOptions),
    /// faer's sparse factorisations.
    Faer(FaerOptions),
    /// nalgebra-sparse's Cholesky.
    NalgebraSparse,
    /// Dense LU with partial pivoting, for small systems.
    Dense(DenseOptions),
    /// The first that is compiled in and takes indefinite matrices ([`first_for`](Self::first_for)). Who knows more of a
    /// system, as a stepper does, may choose another one.
    Auto,
    /// A solver from another crate.
    Foreign {
        /// The solver.
        solver: Foreign,
        /// Its options, with colons between them.
        options: String,
    },
}

impl Backend {
    /// All backends with their default options: those of this crate in order of preference, then those
    /// [registered](crate::register). [`Backend::Auto`] stands for one of them.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let foreign = registered().iter().map(|&solver| Self::Foreign {
            solver,
            options: String::new(),
        });
        Self::built_in().into_iter().chain(foreign).collect()
    }

    /// All backends of this crate but `auto`.
    pub(crate) fn built_in() -> [Self; 8] {
        [
            Self::Banded,
            Self::Faer(FaerOptions::default()),
            Self::NalgebraSparse,
            Self::Umfpack(UmfpackOptions::default()),
            Self::ConjugateGradient(CgOptions::default()),
            Self::GaussSeidel(GaussSeidelOptions::default()),
            Self::Minres(MinresOptions::default()),
            Self::Dense(DenseOptions::default()),
        ]
    }

    /// All backends of this crate, `auto` last.
    pub(crate) fn own() -> impl Iterator<Item = Self> {
        Self::built_in().into_iter().chain([Self::Auto])
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

    /// The first backend of this crate that is compiled in and takes the systems asked for, `indefinite` ones such as the KKT
    /// matrix or not: a direct one, else one that iterates, else the dense one. UMFPACK does not refine by itself then, since
    /// a caller that leaves the choice refines.
    #[must_use]
    pub fn first_for(indefinite: bool) -> Option<Self> {
        let compiled = Self::built_in().into_iter().filter(Self::is_compiled);
        Self::first_of(compiled, indefinite)
    }

    fn first_of(mut all: impl Iterator<Item = Self>, indefinite: bool) -> Option<Self> {
        let mut first = all.find(|b| !indefinite || b.accepts_indefinite())?;
        if let Self::Umfpack(options) = &mut first {
            options.refinement_steps = 0;
        }
        Some(first)
    }

    /// How it is listed.
    #[must_use]
    pub fn entry(&self) -> Entry {
        match self {
            Self::Banded => entry::BANDED,
            Self::GaussSeidel(_) => entry::GAUSS_SEIDEL,
            Self::ConjugateGradient(_) => entry::CONJUGATE_GRADIENT,
            Self::Minres(_) => entry::MINRES,
            Self::Umfpack(_) => entry::UMFPACK,
            Self::Faer(_) => entry::FAER,
            Self::NalgebraSparse => entry::NALGEBRA_SPARSE,
            Self::Dense(_) => entry::DENSE,
            Self::Auto => entry::AUTO,
            Self::Foreign { solver, .. } => solver.entry,
        }
    }

    /// Name, as on the command line.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.entry().name
    }

    /// The Cargo feature that brings it; `None` where it is always there.
    #[must_use]
    pub fn feature(&self) -> Option<&'static str> {
        self.entry().feature
    }

    /// Licence of the code behind it.
    #[must_use]
    pub fn licence(&self) -> &'static str {
        self.entry().licence
    }

    /// Returns true if it accepts symmetric matrices that are not positive definite, such as the
    /// KKT matrix.
    #[must_use]
    pub fn accepts_indefinite(&self) -> bool {
        match self {
            Self::Banded | Self::Minres(_) | Self::Umfpack(_) | Self::Dense(_) | Self::Auto => true,
            Self::Faer(o) => o.factorization != FaerFactorization::Llt,
            Self::GaussSeidel(_) | Self::ConjugateGradient(_) | Self::NalgebraSparse => false,
            Self::Foreign { solver, .. } => solver.capabilities.indefinite,
        }
    }

    /// Returns true if it iterates: its error then depends on the number of iterations.
    #[must_use]
    pub fn is_iterative(&self) -> bool {
        match self {
            Self::GaussSeidel(_) | Self::ConjugateGradient(_) | Self::Minres(_) => true,
            Self::Banded | Self::Umfpack(_) | Self::Faer(_) => false,
            Self::NalgebraSparse | Self::Dense(_) | Self::Auto => false,
            Self::Foreign { solver, .. } => solver.capabilities.iterative,
        }
    }

    /// Returns true if its factor uses the block that couples two block rows (index, group).
    /// Iterative backends factorise their groups or single blocks only; iterative solvers of other
    /// crates are assumed to factorise single blocks.
    #[must_use]
    pub fn factorizes(&self, (i, group_i): (usize, u32), (j, group_j): (usize, u32)) -> bool {
        match self {
            Self::GaussSeidel(o) if o.partition == Partition::Groups => group_i == group_j,
            Self::ConjugateGradient(o) if o.preconditioner == Preconditioner::Group => {
                group_i == group_j
            }
            Self::GaussSeidel(_) | Self::ConjugateGradient(_) | Self::Minres(_) => i == j,
            Self::Banded | Self::Umfpack(_) | Self::Faer(_) => true,
            Self::NalgebraSparse | Self::Dense(_) | Self::Auto => true,
            Self::Foreign { .. } => !self.is_iterative() || i == j,
        }
    }

    /// Returns true if it factorises the whole matrix, or its groups, in the order of the pattern.
    /// Direct solvers of other crates are assumed to do so, and are given a good order.
    #[must_use]
    pub fn keeps_order(&self) -> bool {
        match self {
            Self::Banded | Self::NalgebraSparse | Self::Auto => true,
            Self::Faer(o) => o.factorization != FaerFactorization::Lu,
            Self::Minres(_) | Self::Umfpack(_) | Self::Dense(_) => false,
            Self::GaussSeidel(_) | Self::ConjugateGradient(_) => self.factorizes_groups(),
            Self::Foreign { .. } => !self.is_iterative(),
        }
    }

    /// Returns true if it iterates and factorises the groups of the pattern.
    #[must_use]
    pub fn factorizes_groups(&self) -> bool {
        self.is_iterative() && self.factorizes((0, 0), (1, 0))
    }

    /// Scalar rows of the border where it eliminates the blocks of `pattern` in `order` (position → block) as a chain with
    /// leaves and a border, in vectors: faster than in others that take as many operations, and the faster the fewer
    /// pairs of these rows are. `None` where it does not. Allocates.
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
            Self::Banded | Self::Auto => crate::backends::banded::border_rows(pattern, order),
            _ => crate::ordering::positions(order, pattern.blocks()).map(|_| None),
        }
    }

    /// Returns true if it is compiled in.
    #[must_use]
    pub fn is_compiled(&self) -> bool {
        !matches!(self.create(), Err(SolveError::NotCompiled { .. }))
    }

    /// Its limit of iterations; none of a direct one, and of one of another crate whose options name none.
    #[must_use]
    pub fn iterations(&self) -> Option<usize> {
        match self {
            Self::GaussSeidel(o) => Some(o.iterations),
            Self::ConjugateGradient(o) => Some(o.iterations),
            Self::Minres(o) => Some(o.iterations),
            Self::Foreign { options, .. } if self.is_iterative() => option(options, "iterations"),
            Self::Banded | Self::Umfpack(_) | Self::Faer(_) => None,
            Self::NalgebraSparse | Self::Dense(_) | Self::Auto | Self::Foreign { .. } => None,
        }
    }

    /// Its tolerance, relative to ‖b‖₂; none of a direct one.
    #[must_use]
    pub fn tolerance(&self) -> Option<f64> {
        match self {
            Self::GaussSeidel(o) => Some(o.tolerance),
            Self::ConjugateGradient(o) => Some(o.tolerance),
            Self::Minres(o) => Some(o.tolerance),
            Self::Foreign { solver, options } => solver.tolerance(options),
            Self::Banded | Self::Umfpack(_) | Self::Faer(_) => None,
            Self::NalgebraSparse | Self::Dense(_) | Self::Auto => None,
        }
    }

    /// One of another crate with an option set; unchanged where it does not iterate.
    fn with(&self, key: &str, value: &dyn fmt::Display) -> Self {
        match self {
            Self::Foreign { solver, options } if self.is_iterative() => Self::Foreign {
                solver: *solver,
                options: with_option(options, key, value),
            },
            other => other.clone(),
        }
    }

    /// Sets the limit of iterations; returns the backend unchanged if it does not iterate.
    #[must_use]
    pub fn with_iterations(&self, iterations: usize) -> Self {
        match self {
            Self::GaussSeidel(o) => Self::GaussSeidel(GaussSeidelOptions { iterations, ..*o }),
            Self::ConjugateGradient(o) => Self::ConjugateGradient(CgOptions { iterations, ..*o }),
            Self::Minres(o) => Self::Minres(MinresOptions { iterations, ..*o }),
            other => other.with("iterations", &iterations),
        }
    }

    /// Sets the tolerance, relative to ‖b‖₂; returns the backend unchanged if it does not iterate.
    #[must_use]
    pub fn with_tolerance(&self, tolerance: f64) -> Self {
        match self {
            Self::GaussSeidel(o) => Self::GaussSeidel(GaussSeidelOptions { tolerance, ..*o }),
            Self::ConjugateGradient(o) => Self::ConjugateGradient(CgOptions { tolerance, ..*o }),
            Self::Minres(o) => Self::Minres(MinresOptions { tolerance, ..*o }),
            other => other.with("tolerance", &format_args!("{tolerance:e}")),
        }
    }

    /// A solver with these options; one of another crate is [`Checked`](crate::Checked).
    ///
    /// # Errors
    /// [`SolveError::NotCompiled`], [`SolveError::InvalidOption`], [`SolveError::NotRegistered`].
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
            #[cfg(feature = "minres")]
            Self::Minres(o) => Ok(Box::new(backends::minres::Minres::new(*o)?)),
            #[cfg(feature = "umfpack")]
            Self::Umfpack(o) => Ok(Box::new(backends::umfpack::Umfpack::new(*o))),
            #[cfg(feature = "faer")]
            Self::Faer(o) => Ok(Box::new(backends::faer::Faer::new(*o))),
            #[cfg(feature = "nalgebra-sparse")]
            Self::NalgebraSparse => Ok(Box::new(
                backends::nalgebra_sparse::NalgebraSparse::default(),
            )),
            Self::Dense(o) => Ok(backends::dense::create(*o)),
            Self::Auto => {
                let none = SolveError::NotCompiled {
                    backend: self.name(),
                    feature: "banded",
                };
                Self::first_for(true).ok_or(none)?.create()
            }
            Self::Foreign { solver, options } => Ok(Box::new(solver.make(options)?)),
            #[allow(unreachable_patterns)] // those compiled in
            Self::Banded
            | Self::GaussSeidel(_)
            | Self::ConjugateGradient(_)
            | Self::Minres(_)
            | Self::Umfpack(_)
            | Self::Faer(_)
            | Self::NalgebraSparse => Err(SolveError::NotCompiled {
                backend: self.name(),
                feature: self.name(),
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
            #[allow(unreachable_patterns)] // those compiled in
            Self::Banded
            | Self::GaussSeidel(_)
            | Self::ConjugateGradient(_)
            | Self::Minres(_)
            | Self::Umfpack(_)
            | Self::Faer(_)
            | Self::NalgebraSparse
            | Self::Auto
            | Self::Foreign { .. } => {
                return Err(SolveError::NotSymmetric {
                    backend: self.name(),
                });
            }
        })
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())?;
        match self {
            Self::Banded | Self::NalgebraSparse | Self::Auto => Ok(()),
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
            Self::Minres(o) => {
                write!(
                    f,
                    ":iterations={}:tolerance={:e}",
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
            // Handed over as a value: no text means this one.
            Self::Foreign { solver, .. }
                if Self::own().any(|own| own.name() == solver.entry.name) =>
            {
                f.write_str(":handed-over")
            }
            Self::Foreign { options, .. } if options.is_empty() => Ok(()),
            Self::Foreign { options, .. } => write!(f, ":{options}"),
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
        /// Options that the backend knows.
        known: &'static str,
    },
    /// A solver of another crate does not take its options.
    Refused {
        /// The solver.
        backend: &'static str,
        /// The options given.
        options: String,
        /// The solver's message.
        reason: String,
    },
}

impl fmt::Display for ParseBackendError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownName { name } => {
                let names: Vec<&str> = Backend::all().iter().map(Backend::name).collect();
                let names = names.join(", ");
                write!(
                    f,
                    "unknown backend `{name}`: choose one of {names}, or auto"
                )
            }
            Self::Refused {
                backend,
                options,
                reason,
            } => write!(f, "backend `{backend}` refuses `{options}`: {reason}"),
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
            .chain([Self::Auto])
            .find(|b| b.name() == name)
            .ok_or_else(unknown)?;
        if let Self::Foreign { solver, options } = &mut backend {
            *options = parts.collect::<Vec<_>>().join(":");
            let refused = |e| ParseBackendError::Refused {
                backend: solver.entry.name,
                options: options.clone(),
                reason: format!("{e} (it knows {})", solver.entry.options),
            };
            solver.make(options).map_err(refused)?;
            return Ok(backend);
        }
        for option in parts {
            if !backend.set(option) {
                let Entry {
                    name: backend,
                    options: known,
                    ..
                } = backend.entry();
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
        match self {
            Self::GaussSeidel(o) => match key {
                "joints" => o.partition = Partition::Joints,
                "groups" => o.partition = Partition::Groups,
                "guess" => o.start = Start::Guess,
                "trial" => o.start = Start::Trial,
                "iterations" => return assign(&mut o.iterations, value),
                "tolerance" => return assign(&mut o.tolerance, value),
                _ => return false,
            },
            Self::ConjugateGradient(o) => match key {
                "none" => o.preconditioner = Preconditioner::None,
                "jacobi" => o.preconditioner = Preconditioner::BlockJacobi,
                "group" => o.preconditioner = Preconditioner::Group,
                "iterations" => return assign(&mut o.iterations, value),
                "tolerance" => return assign(&mut o.tolerance, value),
                _ => return false,
            },
            Self::Minres(o) => match key {
                "iterations" => return assign(&mut o.iterations, value),
                "tolerance" => return assign(&mut o.tolerance, value),
                _ => return false,
            },
            Self::Umfpack(o) => {
                return key == "refinement" && assign(&mut o.refinement_steps, value);
            }
            Self::Faer(o) => match key {
                "llt" => o.factorization = FaerFactorization::Llt,
                "ldlt" => o.factorization = FaerFactorization::Ldlt,
                "lblt" => o.factorization = FaerFactorization::Lblt,
                "lu" => o.factorization = FaerFactorization::Lu,
                _ => return false,
            },
            Self::Dense(o) => match key {
                "double" => o.precision = Precision::Double,
                "extended" => o.precision = Precision::Extended,
                _ => return false,
            },
            Self::Banded | Self::NalgebraSparse | Self::Auto | Self::Foreign { .. } => {
                return false;
            }
        }
        value.is_empty()
    }
}

fn assign<V: FromStr>(to: &mut V, text: &str) -> bool {
    text.parse().map(|v| *to = v).is_ok()
}

#[cfg(test)]
mod tests;
