//! Ball joint: the two attachment points coincide, 3 rows (φ and J: `gap`).

use super::facts::{Facts, NO_ROWS, Parts};
use super::{RowKind, RowLaw, Rows};
use crate::body::Bodies;
use crate::frame::Frame;

/// Ball joint with isotropic compliance, 3 rows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Spherical {
    /// The two attachment frames; their axes are not used.
    pub frames: [Frame; 2],
    /// Law of the three rows, compliance in m/N.
    pub stretch: RowLaw,
}

impl Facts for Spherical {
    fn parts(&self) -> Parts {
        [(RowKind::Stretch, 3, Some(self.stretch)), NO_ROWS, NO_ROWS]
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let [a, b] = rows.resolve(&self.frames, bodies, t);
        rows.stretch(&a, &b);
    }

    fn only_pulls(&self, _side: usize) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{LAW, Poses, Sample, assert_rows, phi};
    use crate::testing::*;

    impl Sample for Spherical {
        fn sample(frames: [Frame; 2]) -> Self {
            Self {
                frames,
                stretch: LAW,
            }
        }
    }

    fn joint(frames: [Frame; 2]) -> Constraint {
        Spherical::sample(frames).into()
    }

    #[test]
    fn jacobian_at_random_poses() {
        assert_rows("spherical random", Poses::rotation, joint);
    }

    #[test]
    fn violation_is_the_gap() {
        let mut poses = Poses::new(3);
        let mut scene = poses.pair(&UnitQuaternion::identity(), joint);
        let frames = scene.constraints[0].frames();
        let [a, b] = [0, 1].map(|side| frames[side].resolve(&scene.bodies, 0.0).point());
        assert!((Vector3::from_column_slice(&phi(&scene)) - (a - b)).norm() < 1e-14);
        scene.bodies.position[1] += a - b;
        assert!(phi(&scene).iter().all(|gap| gap.abs() < 1e-14));
        assert_eq!(scene.constraints[0].row(2), (RowKind::Stretch, LAW));
    }

    #[test]
    fn world_side_has_no_block() {
        let mut scene = Scene::new("pendulum");
        scene.add_body("bob", crate::Body::sphere(0.1, 1.0));
        let frames = [origin(), Frame::body(0, Vector3::new(0.0, 0.3, 2.0))];
        scene.add_constraint("pivot", joint(frames), 0);
        assert!(crate::check_jacobian(&scene, 0).max < 1e-9);
        let lin = crate::Linearized::at(&scene, 0.0);
        assert_eq!((lin.slots.len(), lin.block(0).len()), (1, 18));
        assert_eq!(lin.block(0)[..6], [-1.0, 0.0, 0.0, 0.0, -2.0, 0.3]);
    }
}
