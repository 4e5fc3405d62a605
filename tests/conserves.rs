//! Momenta are kept to rounding, and no energy comes from nowhere.

/// What arrives second in a step, drums at their end, blows that joints pass on.
mod arrivals;
/// Scenes that say themselves what holds of them.
mod cases;
/// Dampers of what swings.
mod damped;
/// Forces of an instant: catches, jumps of drives, blows.
mod instants;
/// Contacts beside motors and ropes.
mod meeting;
/// Momenta, energy, unit quaternions of a free cable.
mod momenta;
