//! Bad input gives a typed error that names the fault: never a panic, never a NaN that goes on.

/// Systems that no backend can or should solve.
mod backends;
/// Shapes, surfaces and places of bodies that touch.
mod contacts;
/// Input that means nothing, is strange, or has numbers at the ends of their range.
mod degenerate;
/// Rows that depend on each other: joints two and three times, a cable too short for its ends, joints ever stiffer.
mod dependent;
/// Motors, winches, controls, gantries, networks, static and driven bodies.
mod drives;
/// Inputs that are mutated at random, and those that once did harm.
mod mutated;
/// Saved runs that are damaged, foreign or of another version.
mod saved;
/// Scenes, parameters and step options.
mod scenes;
/// Files and scenes of absurd size, scenes that change in every step.
mod sizes;

use taut_solver::Backend;
use taut_tests::fuzzing::backends as compiled;

/// The direct ones among them.
fn compiled_direct() -> Vec<Backend> {
    let mut all = compiled();
    all.retain(|b| !b.is_iterative());
    all
}
