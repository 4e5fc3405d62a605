//! Momenta are kept to rounding, and no energy comes from nowhere.

/// What arrives second in a step, drums at their end, blows that joints pass on.
mod arrivals;
/// Elastic ropes that catch and swing their load, motors and winches against stops.
mod caught;
/// Dampers of what swings, drums that slip beside contacts.
mod damped;
/// Forces of an instant: catches, jumps of drives, blows.
mod instants;
/// Contacts beside motors and ropes.
mod meeting;
/// Momenta, energy, unit quaternions of a free cable.
mod momenta;
