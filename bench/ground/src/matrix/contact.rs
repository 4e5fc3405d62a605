//! Contact problems as files: those of a step written and read, and every method on them.
//!
//! A problem is one of [`ContactProblem`], FCLIB's global one with two regularisations; [`files`] says what stands where.
//! To solve it the joints are condensed: with S = Gᵀ M⁻¹ G + Σ_G, factorised once,
//!
//! ```text
//! u = W r + q,    W = Hᵀ M⁻¹ H − (Gᵀ M⁻¹ H)ᵀ S⁻¹ (Gᵀ M⁻¹ H) + Σ_H,    q = u for r = 0
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `files` | the folder of a problem |
//! | `condensed` | W, and v, λ, u for impulses r, from the pieces |
//! | `solve` | every method with every direct backend: times and errors |

pub mod condensed;
pub mod files;
pub mod solve;

pub use taut_integrator::{ContactProblem, ContactSolution};

#[cfg(test)]
mod tests;
