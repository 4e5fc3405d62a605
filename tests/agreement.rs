//! Every backend against extended precision.

/// Branches, rings and nets in every order of elimination, and what the orders cost.
mod elimination;
/// Direct solvers with one refinement at mass ratios up to 10⁹, and what limits them.
mod linear;
/// The oracles: extended precision against extended precision, and against closed forms.
mod reference;
/// Every solver on hoists, with and without refinement.
mod scenes;
/// Every backend on random block systems.
mod systems;
