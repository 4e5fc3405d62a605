//! Truth of a solver's claim of a solution.
//!
//! A claim is true where ‖r‖₂ ≤ τ ‖b‖₂ with the tolerance τ of an iteration, or where the normwise backward error is at most
//! [`ROUNDING`]. A direct solver has the second alone.

/// Normwise backward error that rounding alone leaves.
pub const ROUNDING: f64 = 1e-14;

/// ‖r‖₂/‖b‖₂ over what a claim says of it, with what rounding excuses: at most 1 where the claim is true.
pub fn over(residual: f64, backward_error: f64, tolerance: Option<f64>) -> f64 {
    let rounding = backward_error / ROUNDING;
    tolerance.map_or(rounding, |t| rounding.min(residual / t))
}

/// As [`over`], but without what rounding excuses of an iteration.
pub fn over_letter(residual: f64, backward_error: f64, tolerance: Option<f64>) -> f64 {
    tolerance.map_or(backward_error / ROUNDING, |t| residual / t)
}
