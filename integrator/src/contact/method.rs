//! Methods for the impulses of a step's contacts, and their names.
//!
//! [`ContactMethod::Condensed`] solves contacts and joints together: see [`crate::contact`].
//!
//! [`ContactMethod::Staggered`] is lines 1–4 and 16–17 of \[SL Algorithm 1] as printed, for comparison (§V-D: "impulses are
//! treated as discrete forces, integrated over a time step"). The contacts come first, from iterative projections of the
//! velocities that the bodies would have without joints,
//!
//! ```text
//! u = W₀ p + q,    W₀ = H M̃⁻¹ Hᵀ + diag σ,    q = H (v + M̃⁻¹ Δt f) + b
//! ```
//!
//! from p = 0 on; Hᵀ p joins Δt f, and the joints are solved once. The contacts know nothing of the joints' forces: a body
//! that a cable presses on the ground with n times its weight gets an impulse for its weight alone, and goes through. The
//! step's report says what it falls short of, [`complementarity`](crate::ContactReport) of the final velocities and
//! penetration; the conditions hold where no joint acts on what touches and the sweeps converge. A solve that breaks them by
//! more than 10⁻¹⁰ counts as undecided, which nearly all do.
//!
//! Errors over three seconds of `taut run SCENE --set mass_ratio=R --time 3`, with ten staggered
//! sweeps and with contacts and joints together: deepest penetration, and largest violation of the
//! conditions over the largest rate.
//!
//! | scene | ratio | staggered: deepest | violation | together: deepest | violation |
//! |---|---:|---:|---:|---:|---:|
//! | `stack`, no joints | 1 | falls in 0.9 s: energy from nowhere | 6·10⁻² | 5·10⁻⁹ m | 10⁻¹³ |
//! | `stack` | 10 … 10⁵ | 0.5 … 1.2 m, of boxes of 1 m | 10⁻¹ | 2·10⁻⁸ … 7·10⁻⁵ m | 10⁻¹³ |
//! | `floor` | 1 … 10⁵ | 2 … 11 mm, of a cable 40 mm thick | 0.5 … 1.1 | 10⁻⁹ … 6·10⁻⁵ m | 2·10⁻¹³ |
//! | `pile` | 1 … 100 | 37 … 43 mm, of cables 40 mm thick | 0.1 … 0.3 | 2·10⁻⁵ … 3·10⁻⁴ m | 10⁻¹³ |
//! | `pile` | 10³ … 10⁵ | 43 mm | 9·10⁻² | 3·10⁻⁴ … 6·10⁻³ m | 10⁻¹³ … 10⁻¹¹ |
//!
//! On the stack more sweeps help: a thousand hold it for three seconds at ratio 1, and not at 10³. On the floor they do not: with
//! a thousand the cable of ratio 10³ breaks the conditions by 0.99 as with ten by 0.96. That error is the joints'.

use crate::StepError;
use crate::options::check;
use std::fmt;
use std::str::FromStr;
use taut_solver::coulomb::{ConeMethod, ParseConeMethodError};

/// How the impulses of contacts are found. [`FromStr`] reads what [`fmt::Display`] writes: `newton`,
/// `pgs:sweeps=50:tolerance=1e-10`, `staggered:sweeps=10`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ContactMethod {
    /// Together with the joints, on the contacts' part of their system.
    Condensed(ConeMethod),
    /// Before the joints and without them, as the paper's Algorithm 1 is printed: for comparison.
    Staggered {
        /// Sweeps of projections; the paper's crane has 10.
        sweeps: usize,
    },
}

/// The paper's collision iterations \[SL Fig. 14].
const SWEEPS: usize = 10;

/// Most sweeps that a step may ask for.
const MOST_SWEEPS: usize = 100_000;

impl ContactMethod {
    /// Method for a dense problem of contacts.
    #[must_use]
    pub fn of_dense_problems(self) -> ConeMethod {
        match self {
            Self::Condensed(method) => method,
            Self::Staggered { sweeps } => ConeMethod::GaussSeidel {
                sweeps,
                tolerance: 0.0,
            },
        }
    }

    pub(crate) fn is_staggered(self) -> bool {
        matches!(self, Self::Staggered { .. })
    }

    pub(crate) fn validate(self) -> Result<(), StepError> {
        let ConeMethod::GaussSeidel { sweeps, .. } = self.of_dense_problems() else {
            return Ok(());
        };
        let some = sweeps <= MOST_SWEEPS;
        check("contacts.sweeps", sweeps as f64, some, "at most 100000")
    }
}

impl Default for ContactMethod {
    fn default() -> Self {
        Self::Condensed(ConeMethod::default())
    }
}

impl fmt::Display for ContactMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Condensed(method) => method.fmt(f),
            Self::Staggered { sweeps } => write!(f, "staggered:sweeps={sweeps}"),
        }
    }
}

/// Why a text names no method.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParseContactMethodError {
    /// The part of the text that is not understood.
    pub part: String,
}

impl fmt::Display for ParseContactMethodError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "`{}` is no part of a contact method: it is `newton`, `pgs:sweeps=N:tolerance=X` or `staggered:sweeps=N`",
            self.part
        )
    }
}

impl std::error::Error for ParseContactMethodError {}

impl From<ParseConeMethodError> for ParseContactMethodError {
    fn from(e: ParseConeMethodError) -> Self {
        Self { part: e.part }
    }
}

impl FromStr for ContactMethod {
    type Err = ParseContactMethodError;

    fn from_str(text: &str) -> Result<Self, ParseContactMethodError> {
        let mut parts = text.split(':');
        if parts.next() != Some("staggered") {
            return Ok(Self::Condensed(text.parse()?));
        }
        let mut sweeps = SWEEPS;
        for part in parts {
            let number = part.strip_prefix("sweeps=").map(str::parse);
            let Some(Ok(number)) = number else {
                let part = part.to_owned();
                return Err(ParseContactMethodError { part });
            };
            sweeps = number;
        }
        Ok(Self::Staggered { sweeps })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_round_trip() {
        for text in [
            "newton",
            "pgs:sweeps=7:tolerance=1e-3",
            "staggered:sweeps=10",
        ] {
            let method: ContactMethod = text.parse().expect("known");
            assert_eq!(method.to_string(), text);
        }
        assert_eq!(
            "staggered".parse(),
            Ok(ContactMethod::Staggered { sweeps: 10 })
        );
        for (text, part) in [
            ("staggered:sweeps", "sweeps"),
            ("staggered:tolerance=1", "tolerance=1"),
            ("staggered:sweeps=-1", "sweeps=-1"),
            ("newton:sweeps=3", "sweeps=3"),
            ("jacobi", "jacobi"),
        ] {
            let error = text.parse::<ContactMethod>().expect_err(text);
            assert_eq!(error.part, part);
        }
    }
}
