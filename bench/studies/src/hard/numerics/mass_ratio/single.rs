//! H40: the KKT matrix in single precision, with residuals in double.

use super::params;
use crate::hard::numerics::extended_solution;
use crate::hard::worse;
use nalgebra::{DMatrix, DVector};
use std::fmt::Write;
use taut_ground::poses::Pose;
use taut_integrator::{Form, StepOptions, Stepper};
use taut_output::check::{Check, ExperimentError, Verdict};
use taut_solver::{SymBlockMatrix, forward_error};

/// The KKT matrix in single precision, by LU with partial pivoting: errors of the solution against 32 digits, without
/// and with one refinement of residuals in double.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Single {
    ratio: f64,
    pose: Pose,
    errors: [f64; 2],
}

/// The errors of a ratio and a pose.
///
/// # Errors
/// A scene that cannot be built, or one without a reference.
pub(super) fn single(ratio: f64, pose: Pose) -> Result<Single, ExperimentError> {
    let scene = taut_ground::poses::hoist(&params(ratio)?, pose)?;
    let mut stepper = Stepper::new(scene, StepOptions::default())?;
    // Which linearises.
    stepper.reference_multipliers()?;
    let (a, b) = stepper.assembled(Form::Kkt)?;
    let exact = extended_solution(&a, &b)?;
    let n = a.dim();
    let scale = equilibration(&a);
    let factors = DMatrix::from_fn(n, n, |r, c| (scale[r] * a.get(r, c) * scale[c]) as f32).lu();
    let (mut x, mut residual) = (vec![0.0; n], b.clone());
    let mut errors = [f64::NAN; 2];
    for error in &mut errors {
        let scaled = residual.iter().zip(&scale).map(|(r, s)| (r * s) as f32);
        let right = DVector::from_iterator(n, scaled);
        let Some(correction) = factors.solve(&right) else {
            break;
        };
        for ((x, d), s) in x.iter_mut().zip(correction.iter()).zip(&scale) {
            *x += f64::from(*d) * s;
        }
        *error = forward_error(&x, &exact);
        a.subtract_product(&b, &x, &mut residual);
    }
    Ok(Single {
        ratio,
        pose,
        errors,
    })
}

/// Scales s with the largest entry of each row of s_r A_rc s_c near 1, masses and levers of single precision's range;
/// powers of two, which round nothing (Ruiz 2001).
fn equilibration(a: &SymBlockMatrix) -> Vec<f64> {
    let mut scale = vec![1.0_f64; a.dim()];
    for _ in 0..ROUNDS {
        let mut largest = vec![0.0_f64; a.dim()];
        a.for_each_lower(|r, c, x| {
            let size = (scale[r] * x * scale[c]).abs();
            largest[r] = largest[r].max(size);
            largest[c] = largest[c].max(size);
        });
        for (s, m) in scale.iter_mut().zip(&largest) {
            *s *= (-0.5 * m.log2()).round().exp2();
        }
    }
    scale
}

/// Rounds of [`equilibration`].
const ROUNDS: usize = 10;

/// Largest error of single precision on the KKT matrix that passes at every ratio.
const SINGLE_BAR: f64 = 1e-6;

/// u R from which on a factorisation in single precision may have no digit right: S is scaled, and its condition about
/// that many times R.
const LOST: f64 = 1e-2;

/// The ratio up to which what forming S on the way loses, u R of single precision, is still brought back by one
/// refinement.
const SINGLE_RATIO: f64 = 1e4;

/// A row for each pose.
pub(super) fn in_single_precision(singles: &[Single]) -> Vec<Check> {
    let row = |pose: Pose| {
        let own = || singles.iter().filter(|s| s.pose == pose);
        let size = |s: &&Single| s.errors[1].abs();
        let worst = own().max_by(|a, b| size(a).total_cmp(&size(b)))?;
        let unrefined = own().map(|s| s.errors[0]).fold(0.0, worse);
        let mut check = Check::within(
            format!("KKT in single precision, 1 refinement, {pose}"),
            "32 digits",
            format!("{:.1e} at R = {:.0e}", worst.errors[1], worst.ratio),
            worst.errors[1],
            SINGLE_BAR,
        )
        .by("largest error of the solution over R, dense LU with partial pivoting, residual in double, relative, ∞-norm");
        check.note = format!("unrefined {unrefined:.1e}");
        // NaN misses the bar.
        let misses = own().filter(|s| s.errors[1].is_nan() || s.errors[1] > SINGLE_BAR);
        let first = misses.map(|s| s.ratio).fold(f64::INFINITY, f64::min);
        // A refinement multiplies the error by what it begins with, where that is a part of the solution; where no digit is
        // right to begin with, u R of single precision is above what it would have to be below.
        let squared = |s: &Single| {
            let [before, after] = s.errors;
            let lost = 0.5 * f64::from(f32::EPSILON) * s.ratio >= LOST;
            if before < 1.0 {
                after <= 2.0 * before.powi(2)
            } else {
                lost && after.is_finite()
            }
        };
        let beyond = own().filter(|s| s.errors[1] > SINGLE_BAR || s.errors[1].is_nan());
        if check.verdict == Verdict::Fail && first > SINGLE_RATIO && beyond.clone().all(squared) {
            check.verdict = Verdict::Limit;
            let _ = write!(
                check.note,
                "; within the bar below R = {first:.0e}; a refinement leaves the square of what it begins with, and nothing \
                 where no digit is right before it: here {:.1e}",
                worst.errors[0],
            );
        }
        Some(check)
    };
    let poses = [Pose::Straight, Pose::Bent];
    poses.into_iter().filter_map(row).collect()
}
