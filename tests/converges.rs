//! Errors fall with the square of Δt and of the length of a segment.

/// Swings: order in Δt, sub-steps, the guard, fast spins.
mod motion;
/// The paper's Table II, Fig. 13 and Fig. 16, in small.
mod paper;
/// Pulled, bent and twisted cables: the paper's Figs 10–12, in small.
mod specimens;
