//! A solver from a crate of its own, to copy: profile (skyline) Cholesky, A = L Lᵀ, against the public interface alone.
//!
//! 1. `profile.rs` implements [`LinearSolver`]; it knows `taut-solver` only.
//! 2. [`SKYLINE`] says what it is called and what it can do, and reads its options.
//! 3. `main.rs` is the program `taut` with it: `cargo run -p taut-skyline -- bench --backends skyline,banded`.
//!
//! ```
//! use taut_skyline::Skyline;
//! use taut_solver::agreement::{Claims, check};
//!
//! let agreement = check(&mut Skyline::default(), &Claims::DIRECT)?;
//! assert!(agreement.forward_error < 1e-10);
//! # Ok::<(), taut_solver::agreement::Disagreement>(())
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `profile` | the solver |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

mod profile;

pub use profile::Skyline;

use taut_solver::{Capabilities, Entry, Foreign, LinearSolver, SolveError};

/// The solver as the command line knows it. Its option `noise=N` is that of [`Skyline::new`].
pub const SKYLINE: Foreign = Foreign {
    entry: Entry {
        licence: "MIT OR Apache-2.0",
        options: "noise=N",
        ..Entry::new("skyline")
    },
    capabilities: Capabilities {
        indefinite: false,
        iterative: false,
    },
    create,
};

fn create(options: &str) -> Result<Box<dyn LinearSolver>, SolveError> {
    let noise = match options.split_once('=') {
        None if options.is_empty() => return Ok(Box::new(Skyline::default())),
        Some(("noise", value)) => value.parse().ok().filter(|n| (0.0..1e15).contains(n)),
        _ => None,
    };
    let refused = SolveError::InvalidOption {
        option: "noise",
        allowed: "roundoffs, from 0 to below 10^15, and there is no other option",
    };
    Ok(Box::new(Skyline::new(noise.ok_or(refused)?)))
}
