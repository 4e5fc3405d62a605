//! Solvers from other crates, under names of their own beside the backends of this one.
//!
//! A program registers them once, at its start; from then on [`Backend`] reads, lists and makes them like all others.
//! The list belongs to the process, since names are read where nothing but a text is at hand: on the command line, in
//! saved runs.

use crate::checked::{Checked, caught};
use crate::{Backend, Entry, LinearSolver, SolveError};
use std::fmt;
use std::sync::OnceLock;

/// Properties of a solver that a caller needs before it passes a system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Capabilities {
    /// True if it takes symmetric matrices that are not positive definite, such as the KKT matrix.
    pub indefinite: bool,
    /// True if it iterates: its error then depends on the number of iterations. Such a solver
    /// starts from the guess in `x`. It reads `iterations=N` and `tolerance=T` (relative to ‖b‖₂,
    /// 10⁻¹² unless given) among its options: studies set both.
    pub iterative: bool,
}

/// A solver from another crate.
///
/// ```
/// use taut_solver::{Capabilities, Entry, Foreign};
/// # use taut_solver::{Backend, LinearSolver, SolveError};
/// # fn make(_: &str) -> Result<Box<dyn LinearSolver>, SolveError> { "dense".parse::<Backend>().unwrap().create() }
///
/// let mine = Foreign {
///     entry: Entry { licence: "MIT", ..Entry::new("mine") },
///     capabilities: Capabilities { indefinite: true, iterative: false },
///     create: make, // fn(&str) -> Result<Box<dyn LinearSolver>, SolveError>
/// };
/// taut_solver::register(&[mine])?;
/// assert_eq!("mine".parse::<Backend>()?.licence(), "MIT");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Foreign {
    /// How it is listed.
    pub entry: Entry,
    /// Matrix class and method.
    pub capabilities: Capabilities,
    /// Makes one with the options that follow its name, `a:b=1` of `name:a:b=1`; refuses what it does not know.
    pub create: fn(&str) -> Result<Box<dyn LinearSolver>, SolveError>,
}

/// By name and capabilities: no two that are registered share a name.
impl PartialEq for Foreign {
    fn eq(&self, other: &Self) -> bool {
        self.entry.name == other.entry.name && self.capabilities == other.capabilities
    }
}

impl Foreign {
    /// Stands for a solver that is at hand as a value: others are made where one of its name is registered.
    #[must_use]
    pub fn of(solver: &dyn LinearSolver, capabilities: Capabilities) -> Self {
        Self {
            entry: Entry::new(solver.name()),
            capabilities,
            create: |_| Err(SolveError::NotRegistered),
        }
    }

    /// A solver with these options, [`Checked`].
    pub(crate) fn make(&self, options: &str) -> Result<Checked, SolveError> {
        let name = self.entry.name;
        let known = registered().iter().find(|known| known.entry.name == name);
        let create = known.map_or(self.create, |known| known.create);
        let made = caught(name, "create", || create(options))?;
        Ok(Checked::new(name, made, self.tolerance(options)))
    }

    /// The tolerance of an iteration with these options; none of a direct solver.
    pub(crate) fn tolerance(&self, options: &str) -> Option<f64> {
        let given = || option(options, "tolerance").unwrap_or(1e-12);
        self.capabilities.iterative.then(given)
    }

    /// Checks the entry for registration beside solvers named `others`.
    fn check(&self, others: &[&str]) -> Result<(), RegisterError> {
        let Entry { name, rows, .. } = self.entry;
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if name.is_empty() || !name.chars().all(plain) {
            return Err(RegisterError::Name { name });
        }
        if others.contains(&name) {
            return Err(RegisterError::Taken { name });
        }
        for row in rows {
            let text = match row.strip_suffix("/kkt") {
                Some(text) if self.capabilities.indefinite => text,
                _ => row,
            };
            let (own, options) = text.split_once(':').unwrap_or((text, ""));
            let refused = |reason| RegisterError::Row { name, row, reason };
            if own != name {
                let form = format!("it is no `{name}[:option…]`, with `/kkt` where indefinite");
                return Err(refused(form));
            }
            self.make(options).map_err(|e| refused(e.to_string()))?;
        }
        Ok(())
    }
}

/// The value of an option `key=value` among options with colons between them.
pub(crate) fn option<V: std::str::FromStr>(options: &str, key: &str) -> Option<V> {
    let mut pairs = options.split(':').filter_map(|o| o.split_once('='));
    pairs.find(|(own, _)| *own == key)?.1.parse().ok()
}

/// The options with this one set.
pub(crate) fn with_option(options: &str, key: &str, value: &dyn fmt::Display) -> String {
    let others = options
        .split(':')
        .filter(|o| !o.is_empty() && o.split('=').next() != Some(key));
    let own = format!("{key}={value}");
    let all: Vec<&str> = others.chain([own.as_str()]).collect();
    all.join(":")
}

static REGISTERED: OnceLock<Vec<Foreign>> = OnceLock::new();

/// The solvers registered; none before [`register`].
pub(crate) fn registered() -> &'static [Foreign] {
    REGISTERED.get().map_or(&[], Vec::as_slice)
}

/// Gives solvers of other crates their names in this process: [`Backend::all`] lists them and [`Backend`] reads and makes
/// them from then on. To be called once, at the program's start.
///
/// # Errors
/// A name that cannot be told from options or is taken, a row that is none of this solver, a second call.
pub fn register(solvers: &[Foreign]) -> Result<(), RegisterError> {
    let mut names: Vec<&str> = Backend::own().map(|own| own.name()).collect();
    for solver in solvers {
        solver.check(&names)?;
        names.push(solver.entry.name);
    }
    let first = REGISTERED.set(solvers.to_vec());
    first.map_err(|_| RegisterError::Again)
}

/// Why a solver cannot be registered.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum RegisterError {
    /// Names are lower-case letters, digits and hyphens.
    Name {
        /// The name.
        name: &'static str,
    },
    /// Another solver has the name.
    Taken {
        /// The name.
        name: &'static str,
    },
    /// A row of its entry names no variant of it.
    Row {
        /// The solver.
        name: &'static str,
        /// The row.
        row: &'static str,
        /// Why not.
        reason: String,
    },
    /// Solvers were registered before.
    Again,
}

impl fmt::Display for RegisterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name { name } => write!(
                f,
                "`{name}` is no name of a solver: lower-case letters, digits and hyphens are"
            ),
            Self::Taken { name } => {
                write!(f, "there is a solver `{name}` already: choose another name")
            }
            Self::Row { name, row, reason } => {
                write!(f, "row `{row}` of solver `{name}`: {reason}")
            }
            Self::Again => {
                f.write_str("solvers were registered before: register all of them in one call")
            }
        }
    }
}

impl std::error::Error for RegisterError {}

#[cfg(test)]
mod tests {
    use super::*;

    fn dense(options: &str) -> Result<Box<dyn LinearSolver>, SolveError> {
        match options {
            "" | "fast" => Backend::Dense(crate::DenseOptions::default()).create(),
            "broken" => panic!("no such thing"),
            _ => Err(SolveError::InvalidOption {
                option: "mine",
                allowed: "fast",
            }),
        }
    }

    fn named(name: &'static str, rows: &'static [&'static str]) -> Foreign {
        Foreign {
            entry: Entry {
                rows,
                ..Entry::new(name)
            },
            capabilities: Capabilities::default(),
            create: dense,
        }
    }

    #[test]
    fn names_and_rows_that_would_mislead_are_refused() {
        let refused = |name, rows| {
            named(name, rows)
                .check(&["banded"])
                .unwrap_err()
                .to_string()
        };
        for name in ["", "a:b", "a/kkt", "A", "a+b", "a b"] {
            assert!(refused(name, &[]).contains("no name"), "{name}");
        }
        assert!(refused("banded", &[]).contains("already"));
        assert!(Backend::own().any(|own| own.name() == "auto"));
        for row in [&["other"], &["mine/kkt"], &["mine:slow"], &["mine:broken"]] {
            let e = refused("mine", row);
            assert!(e.contains(row[0]) && e.contains("mine"), "{e}");
        }
        assert_eq!(named("mine", &["mine:fast"]).check(&["banded"]), Ok(()));
    }

    #[test]
    fn options_are_found_and_set() {
        assert_eq!(option("a:iterations=3:b", "iterations"), Some(3));
        assert_eq!(option::<f64>("a", "tolerance"), None);
        assert_eq!(with_option("", "iterations", &3), "iterations=3");
        let found = with_option("a:iterations=9:b", "iterations", &3);
        assert_eq!(found, "a:b:iterations=3");
    }

    #[test]
    fn one_at_hand_as_a_value_cannot_be_made_again() {
        let solver = dense("").unwrap();
        let foreign = Foreign::of(&*solver, Capabilities::default());
        assert_eq!(foreign.make("").err(), Some(SolveError::NotRegistered));
    }
}
