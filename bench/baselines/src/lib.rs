//! Third-party solvers and engines to compare with, each behind its feature. Nothing but `taut-studies` depends on them.
//! ```
//! # #[cfg(feature = "rapier")]
//! # {
//! use taut_baselines::rapier::engines;
//!
//! // Ladders of settings, each of them from the cheapest to the dearest.
//! assert!(engines().iter().all(|engine| !engine.ladders.is_empty()));
//! # }
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `lapack` | Cholesky factorisation of a band by the system's LAPACK (feature `lapack`) |
//! | `rapier` | the physics engine Rapier on the hoist and on the ground: soft rope, impulse joints, multibody (feature `rapier`) |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

#[cfg(feature = "lapack")]
pub mod lapack;
#[cfg(feature = "rapier")]
pub mod rapier;
