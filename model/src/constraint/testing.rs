//! Random two-body scenes with a given relative rotation, for the tests of the constraints.

use crate::testing::*;
use nalgebra::Rotation3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use crate::testing::{JacobianCheck, check_jacobian};

/// Largest relative error of a row that the tests accept.
pub(super) const BAR: f64 = 1e-7;

/// A law for tests that do not look at it.
pub(super) const LAW: RowLaw = RowLaw::new(1e-6, 0.01);

/// A constraint of a kind between two frames, with all rows of its that measure something.
pub(crate) trait Sample {
    fn sample(frames: [Frame; 2]) -> Self;
}

/// Source of random poses with a fixed seed.
pub(crate) struct Poses(Xoshiro256PlusPlus);

impl Poses {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// Uniform in −1 to 1.
    pub(crate) fn number(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * 2.0_f64.powi(-52) - 1.0
    }

    pub(crate) fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.number(), self.number(), self.number())
    }

    pub(super) fn rotation(&mut self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(self.vector() * 3.0)
    }

    /// A unit vector across u, in joint axes (u = x).
    pub(super) fn across(&mut self) -> Vector3<f64> {
        let angle = self.number() * 3.2;
        Vector3::new(0.0, angle.cos(), angle.sin())
    }

    /// Two bodies at random poses, joined so that the axes of b are turned by `relative` (in the axes of a).
    pub(super) fn pair(
        &mut self,
        relative: &UnitQuaternion<f64>,
        joint: impl Fn([Frame; 2]) -> Constraint,
    ) -> Scene {
        let mut scene = Scene::new("pair");
        let [axes_a, axes_b] = [(); 2].map(|()| self.rotation());
        let turn = self.rotation();
        let matrix = |q: &UnitQuaternion<f64>| -> Matrix3<f64> { Rotation3::from(*q).into_inner() };
        let frames = [(0, &axes_a), (1, &axes_b)]
            .map(|(i, axes)| Frame::body(i, self.vector()).with_axes(matrix(axes)));
        let turn_b = turn * axes_a * relative * axes_b.inverse();
        for (name, orientation) in [("a", turn), ("b", turn_b)] {
            let body = Body::sphere(1.0, 1.0);
            let body = body.at(self.vector() * 5.0).turned(orientation);
            scene.add_body(name, body);
        }
        scene.add_constraint("joint", joint(frames), 0);
        scene
    }
}

/// Relative rotation of a joint bent by `theta` about `n` (across u) after a twist by `omega` about u.
pub(super) fn bent(theta: f64, n: &Vector3<f64>, omega: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(n * theta)
        * UnitQuaternion::from_scaled_axis(Vector3::x() * omega)
}

/// φ of the scene's only constraint.
pub(super) fn phi(scene: &Scene) -> Vec<f64> {
    let c = &scene.constraints[0];
    let mut phi = vec![0.0; c.rows()];
    c.violation(&scene.bodies, 0.0, &mut phi);
    phi
}

/// Checks the Jacobian of many random pairs, prints the largest error of each row and asserts the bar.
pub(super) fn assert_rows(
    regime: &str,
    relative: impl Fn(&mut Poses) -> UnitQuaternion<f64>,
    joint: impl Fn([Frame; 2]) -> Constraint,
) {
    let mut poses = Poses::new(7);
    let mut worst: Vec<(f64, f64)> = Vec::new();
    for _ in 0..40 {
        let turn = relative(&mut poses);
        let scene = poses.pair(&turn, &joint);
        let JacobianCheck {
            relative_error,
            uncertainty,
            ..
        } = check_jacobian(&scene, 0);
        worst.resize(relative_error.len(), (0.0, 0.0));
        for (w, new) in worst
            .iter_mut()
            .zip(relative_error.iter().zip(&uncertainty))
        {
            assert!(new.0.is_finite(), "{regime}: {relative_error:?}");
            *w = (w.0.max(*new.0), w.1.max(*new.1));
        }
    }
    let text = worst.iter();
    let text: Vec<_> = text.map(|(e, u)| format!("{e:.1e} ({u:.0e})")).collect();
    println!("{regime:28} {}", text.join("  "));
    assert!(worst.iter().all(|(e, _)| *e <= BAR), "{regime}: {text:?}");
}
