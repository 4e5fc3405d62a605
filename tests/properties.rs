//! Properties that hold for all numbers.

/// Systems of every kind against 32 digits.
mod algebra;
/// The assembled systems: symmetric, definite, and the same as their definition.
mod assembly;
/// Rows with bounds: complementarity, against all active sets.
mod bounded;
/// Momenta, energy, unit quaternions.
mod conservation;
/// Runs repeated to the same bits.
mod determinism;
/// A step's equations as dense matrices.
mod equations;
/// Turning, shifting and renumbering a scene.
mod invariance;
/// Scenes that join two to five features.
mod products;
/// Guesses and refinement.
mod refinement;
/// Runs saved and taken up again, to the same bits.
mod saved;
