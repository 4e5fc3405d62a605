//! What holds whatever the numbers are.

/// The assembled systems: symmetric, definite, and the same as their definition.
mod assembly;
/// Momenta, energy, unit quaternions.
mod conservation;
/// The same run gives the same bits.
mod determinism;
/// Turning, shifting and renumbering a scene.
mod invariance;
/// Guesses and refinement.
mod refinement;
