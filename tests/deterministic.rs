//! The same run gives the same bits, and its description does not matter beyond rounding.

/// Runs repeated to the same bits.
mod determinism;
/// Turning, shifting and renumbering a scene.
mod invariance;
/// Runs saved and taken up again, to the same bits.
mod saved;
