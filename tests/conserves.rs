//! Momenta are kept to rounding, and no energy comes from nowhere.

/// Elastic ropes that catch and swing their load, motors and winches against stops.
mod caught;
/// Dampers of what swings, drums that slip beside contacts.
mod damped;
/// Contacts beside motors and ropes.
mod instants;
mod meeting;
/// Momenta, energy, unit quaternions of a free cable.
mod momenta;
