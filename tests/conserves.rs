//! Momenta are kept to rounding, and no energy comes from nowhere.

/// Scenes that say themselves what holds of them.
mod cases;
/// Dampers of what swings.
mod damped;
/// Contacts beside motors and ropes.
mod instants;
mod meeting;
/// Momenta, energy, unit quaternions of a free cable.
mod momenta;
