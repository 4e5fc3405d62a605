//! Momenta are kept to rounding, and no energy comes from nowhere.

/// Scenes that say themselves what holds of them.
mod cases;
/// Dampers of what swings, in implicit steps.
mod damped;
/// Momenta, energy, unit quaternions of a free cable.
mod momenta;
/// Drives that are set between steps.
mod set;
