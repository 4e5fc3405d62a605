//! Locks all six relative coordinates: 3 rows of gap and 3 of the relative rotation.
//!
//! Rows 0–2 are those of the ball joint. Rows 3–5 are the components, on u_a, v_a, w_a, of the rotation vector ρ of
//! the rotation exp(\[ρ]×) = A_aᵀ A_b that takes the axes of a to those of b. With the relative angular velocity in a's
//! axes, ω' = A_aᵀ (ω_b − ω_a):
//!
//!   ρ̇ = J_l⁻¹(ρ) ω',  J_l⁻¹(ρ) = I − ½ \[ρ]× + k \[ρ]×²,  k = (1 − (θ/2) cot(θ/2))/θ²,  θ = |ρ|
//!
//! (J_l the left Jacobian of SO(3)). k = 1/12 at θ = 0. ρ changes sign where θ passes π: use it for joints that stay
//! well below.

use nalgebra::{Matrix3, Vector3};

use super::cosserat::quaternion;
use super::facts::{Facts, NO_ROWS, Parts};
use super::{RowKind, RowLaw, Rows};
use crate::body::Bodies;
use crate::frame::{Frame, Resolved};

/// Rigid or compliant lock of two frames, 6 rows: gap (world axes), rotation vector (axes of a).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Lock {
    /// The two attachment frames.
    pub frames: [Frame; 2],
    /// Law of the three gap rows, compliance in m/N.
    pub linear: RowLaw,
    /// Law of the three rotation rows, compliance in rad/(N m).
    pub angular: RowLaw,
}

/// The three rows of ρ.
pub(super) fn rotation_rows(a: &Resolved, b: &Resolved, rows: &mut Rows<'_>) {
    let rho = rotation_vector(&(a.axes.transpose() * b.axes));
    let jacobian = inverse_left_jacobian(&rho) * a.axes.transpose();
    for k in 0..3 {
        rows.angular(rho[k], &jacobian.row(k).transpose());
    }
}

/// Rotation vector ρ \[rad], |ρ| ≤ π, of the rotation matrix `r`.
fn rotation_vector(r: &Matrix3<f64>) -> Vector3<f64> {
    let [x, y, z, w] = quaternion(r);
    let q = Vector3::new(x, y, z);
    let sine = q.norm();
    if sine < 1e-8 * w {
        return q * (2.0 / w);
    }
    q * (2.0 * sine.atan2(w) / sine)
}

/// J_l⁻¹(ρ).
fn inverse_left_jacobian(rho: &Vector3<f64>) -> Matrix3<f64> {
    let q = rho.norm_squared();
    let k = if q < 1e-2 {
        // Next term: q⁴/47 900 160.
        1.0 / 12.0 + q * (1.0 / 720.0 + q * (1.0 / 30240.0 + q / 1_209_600.0))
    } else {
        let half = 0.5 * q.sqrt();
        (1.0 - half / half.tan()) / q
    };
    let cross = rho.cross_matrix();
    Matrix3::identity() - cross * 0.5 + cross * cross * k
}

impl Facts for Lock {
    fn parts(&self) -> Parts {
        [
            (RowKind::Stretch, 3, Some(self.linear)),
            (RowKind::Rotation, 3, Some(self.angular)),
            NO_ROWS,
        ]
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let [a, b] = rows.resolve(&self.frames, bodies, t);
        rows.stretch(&a, &b);
        rotation_rows(&a, &b, rows);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::Constraint;
    use crate::constraint::testing::{LAW, Poses, Sample, assert_rows, phi};
    use nalgebra::{Rotation3, UnitQuaternion};
    use std::f64::consts::PI;

    impl Sample for Lock {
        fn sample(frames: [Frame; 2]) -> Self {
            Self {
                frames,
                linear: LAW,
                angular: LAW,
            }
        }
    }

    fn joint(frames: [Frame; 2]) -> Constraint {
        Lock::sample(frames).into()
    }

    #[test]
    fn jacobian_at_random_poses() {
        assert_rows("lock random", Poses::rotation, joint);
    }

    #[test]
    fn violation_is_the_rotation_vector() {
        let mut poses = Poses::new(37);
        for angle in [0.0, 1e-12, 1e-5, 0.1, 1.0, 2.0, 3.0, PI - 1e-6] {
            let rho = poses.vector().normalize() * angle;
            let scene = poses.pair(&UnitQuaternion::from_scaled_axis(rho), joint);
            let found = Vector3::from_column_slice(&phi(&scene)[3..]);
            let off = (found - rho).norm();
            assert!(off < 2e-15 * (1.0 + angle), "{found} {rho}");
        }
    }

    #[test]
    fn rotation_vector_of_half_turns() {
        for axis in [
            Vector3::x(),
            Vector3::y(),
            Vector3::z(),
            Vector3::new(1.0, -2.0, 2.0) / 3.0,
        ] {
            let rho = rotation_vector(&Rotation3::from_scaled_axis(axis * PI).into_inner());
            assert!((rho.norm() - PI).abs() < 1e-14);
            assert!(rho.cross(&axis).norm() < 1e-14);
        }
    }
}
