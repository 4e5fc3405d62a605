//! Every backend against extended precision.

/// The chain of particles, which has a formula for its conditions, sweeps and iterations.
mod chain;
/// Claims of every solver beside residuals in double-double, in the scenes of the hard cases and of adverse systems.
mod claims;
/// Rows that depend on each other: joints two and three times, a cable too short for its ends, joints ever stiffer.
mod dependent;
/// Branches, rings and nets in every order of elimination, and what the orders cost.
mod elimination;
/// Direct solvers with one refinement at mass ratios up to 10⁹, and what limits them.
mod linear;
/// Matrices that are ill-conditioned by themselves: Hilbert, bending, graded, growth.
mod matrices;
/// Ring, junction, cranes, ladder and net.
mod networks;
/// The oracles: extended precision against extended precision, and against closed forms.
mod reference;
/// Every solver on hoists, with and without refinement.
mod scenes;
/// The KKT matrix in single precision, at mass ratios up to 10¹⁰.
mod single;
/// Every backend on random block systems.
mod systems;
