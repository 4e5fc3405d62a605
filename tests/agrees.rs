//! Every solver agrees with 32 digits within the bar of its kind, and what it claims of itself is true.

/// Systems of every kind against 32 digits.
mod algebra;
/// The chain of particles, which has a formula for its conditions, sweeps and iterations.
mod chain;
/// Claims of every solver beside residuals in double-double, in the scenes of the hard cases and of adverse systems.
mod claims;
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
/// Guesses and refinement.
mod refinement;
/// Every solver on hoists, with and without refinement.
mod scenes;
/// The KKT matrix in single precision, at mass ratios up to 10¹⁰.
mod single;
/// Every backend on random block systems.
mod systems;
