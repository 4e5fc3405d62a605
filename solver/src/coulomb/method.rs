//! The choice of a method, and its text.

use std::fmt;
use std::str::FromStr;

/// How a contact problem is solved. [`FromStr`] reads what [`fmt::Display`] writes: `newton`,
/// `pgs:sweeps=50:tolerance=1e-10`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum ConeMethod {
    /// Semismooth Newton, with a continuation where it cycles.
    #[default]
    Newton,
    /// Projected Gauss–Seidel over blocks of a contact.
    GaussSeidel {
        /// Most sweeps.
        sweeps: usize,
        /// It stops where the report's complementarity is at most this.
        tolerance: f64,
    },
}

/// Sweeps and tolerance where the text names none.
const SWEEPS: (usize, f64) = (50, 1e-10);

impl fmt::Display for ConeMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Newton => f.write_str("newton"),
            Self::GaussSeidel { sweeps, tolerance } => {
                write!(f, "pgs:sweeps={sweeps}:tolerance={tolerance:e}")
            }
        }
    }
}

/// Why a text names no method.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParseConeMethodError {
    /// The part of the text that is not understood.
    pub part: String,
}

impl fmt::Display for ParseConeMethodError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = &self.part;
        let why = match &part[..] {
            "staggered" => "names contacts before the joints, which no longer exist",
            _ => "is no part of a contact method",
        };
        write!(
            f,
            "`{part}` {why}: give `newton` or `pgs:sweeps=N:tolerance=X`"
        )
    }
}

impl std::error::Error for ParseConeMethodError {}

impl FromStr for ConeMethod {
    type Err = ParseConeMethodError;

    fn from_str(text: &str) -> Result<Self, ParseConeMethodError> {
        let mut parts = text.split(':');
        let name = parts.next().unwrap_or_default();
        if !["newton", "pgs"].contains(&name) {
            let part = name.to_owned();
            return Err(ParseConeMethodError { part });
        }
        let (mut sweeps, mut tolerance) = SWEEPS;
        for part in parts {
            let known = match part.split_once('=') {
                Some(("sweeps", value)) if name == "pgs" => {
                    value.parse().map(|v| sweeps = v).is_ok()
                }
                Some(("tolerance", value)) if name == "pgs" => {
                    value.parse().map(|v| tolerance = v).is_ok()
                }
                _ => false,
            };
            if !known {
                let part = part.to_owned();
                return Err(ParseConeMethodError { part });
            }
        }
        Ok(match name {
            "newton" => Self::Newton,
            _ => Self::GaussSeidel { sweeps, tolerance },
        })
    }
}
