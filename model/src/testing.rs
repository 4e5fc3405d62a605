//! Names for all tests, and for those of constraints a Jacobian against finite differences on the manifold.
//!
//! Each body is moved to x + δ and exp(δ)⊗e, one component of δ at a time. The derivative of φ is a central difference
//! extrapolated to step zero (Ridders: a Richardson tableau that keeps the entry with the smallest estimated error),
//! started from steps of 10⁻¹ down to 10⁻⁸, because near straight and near the fold φ varies over lengths of the size
//! of the distance to the singularity. The estimate includes the rounding noise of φ divided by the step.

use crate::constraint::Rows;
use nalgebra::Matrix;

// What most tests name: they import all of this module.
pub(crate) use crate::*;
pub(crate) use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// A value with a change.
pub(crate) trait With: Sized {
    fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

impl<T> With for T {}

/// The world's origin.
pub(crate) fn origin() -> Frame {
    Frame::world(Vector3::zeros())
}

/// The centre of a body.
pub(crate) fn centre(body: usize) -> Frame {
    Frame::body(body, Vector3::zeros())
}

/// Result of [`check_jacobian`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct JacobianCheck {
    /// Error of each row, relative to the largest entry of that row: entries on velocities and on angular velocities
    /// are each compared with the largest of their own part (at least 10⁻³ of the row's largest).
    pub(crate) relative_error: Vec<f64>,
    /// Estimated error of the finite differences themselves, one a row, in the same measure.
    pub(crate) uncertainty: Vec<f64>,
    /// The largest of `relative_error`.
    pub(crate) max: f64,
}

/// Compares the Jacobian of constraint number `constraint` at t = 0 with extrapolated finite differences.
///
/// Agreement to 10⁻⁷ and better is to be expected; `uncertainty` says what the differences can resolve. Rows of kind
/// [`RowKind::Transverse`] and [`RowKind::Speed`] have no φ to differentiate: theirs are zero unless the Jacobian is not
/// finite.
///
/// # Panics
/// When there is no such constraint, or it names a body that is not there.
pub(crate) fn check_jacobian(scene: &Scene, constraint: usize) -> JacobianCheck {
    let mut c = scene.constraints[constraint].clone();
    // Differences must not see the angle wrap.
    c.update_winding(&scene.bodies, 0.0);
    let rows = c.rows();
    let mut phi = [0.0; MAX_ROWS];
    let mut blocks = vec![0.0; 6 * rows * c.bodies().count()];
    let mut out = Rows::new(&mut phi[..rows], &mut blocks, &mut []);
    c.evaluate(&scene.bodies, 0.0, &mut out);
    let mut moved: Vec<usize> = c.bodies().collect();
    moved.sort_unstable();
    moved.dedup();

    let mut noise = [0.0; MAX_ROWS];
    for (row, noise) in noise[..rows].iter_mut().enumerate() {
        // Directions are rounded to ε: φ to ε times its largest derivative.
        let entries = blocks.chunks_exact(6 * rows);
        let entries = entries.flat_map(|b| &b[6 * row..6 * row + 6]);
        let gradient = entries.fold(0.0_f64, |m, e| m.max(e.abs()));
        let offset = scene.bodies.position.iter();
        let offset = offset.map(Matrix::amax).fold(0.0, f64::max);
        *noise = f64::EPSILON * (phi[row].abs() + gradient * (1.0 + offset));
    }
    let mut error = vec![[0.0_f64; 2]; rows];
    let mut uncertainty = vec![[0.0_f64; 2]; rows];
    let mut largest = vec![[0.0_f64; 2]; rows];
    for body in moved {
        // A body that the constraint acts on twice moves with both of its blocks.
        let mut block = vec![0.0; 6 * rows];
        let sides = blocks.chunks_exact(6 * rows).zip(c.bodies());
        for (part, _) in sides.filter(|(_, b)| *b == body) {
            block
                .iter_mut()
                .zip(part)
                .for_each(|(to, from)| *to += from);
        }
        for column in 0..6 {
            let numeric = differentiate(&scene.bodies, &c, (body, column), &noise);
            let part = column / 3;
            for row in 0..rows {
                let analytic = block[6 * row + column];
                let (value, doubt) = match c.row(row).0 {
                    RowKind::Transverse | RowKind::Speed => (analytic, 0.0),
                    _ => numeric[row],
                };
                error[row][part] = error[row][part].max_nan((value - analytic).abs());
                uncertainty[row][part] = uncertainty[row][part].max_nan(doubt);
                largest[row][part] = largest[row][part].max_nan(analytic.abs());
            }
        }
    }
    let relative = |errors: &[[f64; 2]]| -> Vec<f64> {
        errors
            .iter()
            .zip(&largest)
            .map(|(e, size)| {
                let floor = 1e-3 * size[0].max(size[1]);
                (e[0] / size[0].max(floor)).max_nan(e[1] / size[1].max(floor))
            })
            .collect()
    };
    let relative_error = relative(&error);
    JacobianCheck {
        max: relative_error.iter().fold(0.0, |m, e| m.max_nan(*e)),
        uncertainty: relative(&uncertainty),
        relative_error,
    }
}

/// A maximum that keeps NaN, so that a Jacobian of NaN cannot pass.
trait MaxNan {
    fn max_nan(self, other: f64) -> f64;
}

impl MaxNan for f64 {
    fn max_nan(self, other: f64) -> f64 {
        if self.is_nan() || other.is_nan() {
            f64::NAN
        } else {
            self.max(other)
        }
    }
}

/// ∂φ/∂δ of one component of one body, with its estimated error, for every row.
fn differentiate(
    bodies: &Bodies,
    c: &Constraint,
    (body, column): (usize, usize),
    noise: &[f64; MAX_ROWS],
) -> [(f64, f64); MAX_ROWS] {
    let mut moved = bodies.clone();
    let mut phi_at = |delta: f64| {
        let mut step = Vector3::zeros();
        step[column % 3] = delta;
        if column < 3 {
            moved.position[body] = bodies.position[body] + step;
        } else {
            let turn = UnitQuaternion::from_scaled_axis(step);
            moved.orientation[body] = turn * bodies.orientation[body];
        }
        let mut phi = [0.0; MAX_ROWS];
        c.violation(&moved, 0.0, &mut phi[..c.rows()]);
        phi
    };
    // From small steps to large: a larger step is more precise while it agrees, and out of the game for good once it
    // does not, because then it reaches across a singularity.
    let mut best = ridders(&mut phi_at, 1e-8, noise);
    let mut agrees = [true; MAX_ROWS];
    for start in (1..8).rev() {
        let found = ridders(&mut phi_at, 10_f64.powi(-start), noise);
        for ((best, found), agrees) in best.iter_mut().zip(found).zip(&mut agrees) {
            *agrees &= (found.0 - best.0).abs() <= 4.0 * (found.1 + best.1);
            if *agrees && found.1 < best.1 {
                *best = found;
            }
        }
    }
    best
}

/// Central differences from step `start` on, extrapolated to zero, for every row: (derivative, estimated error).
fn ridders(
    phi_at: &mut impl FnMut(f64) -> [f64; MAX_ROWS],
    start: f64,
    noise: &[f64; MAX_ROWS],
) -> [(f64, f64); MAX_ROWS] {
    const LEVELS: usize = 8;
    const SHRINK: f64 = 1.5;
    let mut best = [(f64::NAN, f64::INFINITY); MAX_ROWS];
    let mut last = [[0.0; MAX_ROWS]; LEVELS];
    let mut step = start;
    for level in 0..LEVELS {
        let (plus, minus) = (phi_at(step), phi_at(-step));
        let mut now = [[0.0; MAX_ROWS]; LEVELS];
        for row in 0..MAX_ROWS {
            now[0][row] = (plus[row] - minus[row]) / (2.0 * step);
            let mut factor = 1.0;
            for order in 1..=level {
                factor *= SHRINK * SHRINK;
                now[order][row] =
                    (factor * now[order - 1][row] - last[order - 1][row]) / (factor - 1.0);
                let value = now[order][row];
                let doubt = (value - now[order - 1][row])
                    .abs()
                    .max((value - last[order - 1][row]).abs())
                    + noise[row] / step;
                if doubt < best[row].1 {
                    best[row] = (value, doubt);
                }
            }
        }
        last = now;
        step /= SHRINK;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ridders_is_precise_for_smooth_functions() {
        let mut f = |h: f64| [(0.7 + h).exp().sin(); MAX_ROWS];
        let exact = 0.7_f64.exp().cos() * 0.7_f64.exp();
        let (value, doubt) = ridders(&mut f, 0.1, &[f64::EPSILON; MAX_ROWS])[0];
        assert!((value - exact).abs() < 1e-11, "{value} {exact}");
        assert!((value - exact).abs() < doubt && doubt < 1e-9);
    }

    #[test]
    fn nan_cannot_pass() {
        assert!(1.0.max_nan(f64::NAN).is_nan());
        assert!(f64::NAN.max_nan(1.0).is_nan());
        assert_eq!(1.0.max_nan(2.0), 2.0);
    }

    #[test]
    fn a_fold_within_reach_is_noticed() {
        // The paper's bend row at θ = 1e-4 with a safeguard so large that its gradient is wrong by a half.
        let params = crate::HoistParams::default()
            .with(|p| (p.segments, p.joint) = (2, crate::JointKind::Paper));
        let mut scene = params.build().expect("builds");
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(1e-4, 0.0, 0.0));
        scene.bodies.orientation[1] = tilt;
        assert!(check_jacobian(&scene, 1).max < 1e-9);
        if let Constraint::Paper(p) = &mut scene.constraints[1] {
            p.safeguard = 1e-4;
        }
        let check = check_jacobian(&scene, 1);
        assert!((check.relative_error[3] - 1.0).abs() < 1e-3, "{check:?}");
        assert!(check.max >= check.relative_error[3]);
    }
}
