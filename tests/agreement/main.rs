//! Every backend against extended precision.

/// Direct solvers with one refinement at mass ratios up to 10⁹, and what limits them.
mod linear;
/// The oracles: extended precision against extended precision, and against closed forms.
mod reference;
/// Every solver on hoists, with and without refinement.
mod scenes;
/// Every backend on random block systems.
mod systems;
