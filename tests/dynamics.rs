//! Motions under the time step.

/// Elastic ropes that catch and swing their load, motors and winches against stops.
mod caught;
/// Dampers of what swings, drums that slip beside contacts.
mod damped;
/// Bounded rows, motors, winches, driven bodies.
mod driven;
/// Contacts beside motors and ropes.
mod meeting;
/// Swings: order in Δt, sub-steps, the guard, fast spins.
mod motion;
/// Static shapes, however they are reached.
mod rest;
/// Rigid rows, and compliant ones near that limit.
mod rigid;
/// The experiments on stability and energy, in small.
mod sweeps;
