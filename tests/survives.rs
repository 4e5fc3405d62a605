//! Heavy loads up to 10⁶ cable elements, long runs and joined features end in no failure that is not foretold.

/// The hard cases in their short form, each row with its verdict.
mod cases;
/// Particle chains: the paper's Table I, Figs 2–5 and the claims about bending.
mod chains;
/// The long swing of H49.
mod long_swing;
/// Scenes that join two to five features.
mod products;
/// The experiments on stability and energy, in small.
mod sweeps;
