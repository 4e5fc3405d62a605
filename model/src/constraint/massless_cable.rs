//! Massless cable: the total length through any number of attachment points.
//!
//! With the points p₀ … p_m (p = x + r) and the spans d_k = p_{k−1} − p_k, n_k = d_k/|d_k|:
//!
//!   φ = Σ_k |d_k| − L  \[SL §III (b)],   φ̇ = Σ_j (n_{j+1} − n_j)·ṗ_j,  n_0 = n_{m+1} = 0
//!
//! 1 row, m. The cable slides freely through the inner points: one tension |λ| in all spans. φ > 0 and λ < 0 where it is
//! taut; as written here it also pushes where it is too short.
//!
//! A span of length zero has no direction: it is taken to be z, so that all is finite.

use nalgebra::Vector3;

use super::distance::direction;
use super::{RowLaw, Rows};
use crate::body::Bodies;
use crate::frame::Frame;

/// Constant total length through two or more points, 1 row.
#[derive(Debug, Clone, PartialEq)]
pub struct MasslessCable {
    /// The attachment frames in the order of the cable, at least 2; their axes are not used.
    pub frames: Vec<Frame>,
    /// Total length L at rest \[m], > 0.
    pub length: f64,
    /// Law of the row, compliance in m/N.
    pub law: RowLaw,
}

impl MasslessCable {
    pub(super) fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let mut sides = self.frames.iter().map(|f| (f, f.resolve(bodies, t)));
        let Some(mut last) = sides.next() else {
            return;
        };
        let (mut total, mut moving) = (0.0, 0);
        let mut before = Vector3::zeros();
        let mut finish = |(frame, side): &(&Frame, _), g: Vector3<f64>| {
            let side: &crate::frame::Resolved = side;
            if frame.body_index().is_some() {
                rows.point(moving, 0, &g, &side.lever);
                moving += 1;
            }
        };
        for next in sides {
            let (length, n) = direction(&super::gap(&last.1, &next.1));
            total += length;
            finish(&last, n - before);
            (before, last) = (n, next);
        }
        finish(&last, -before);
        rows.phi[0] = total - self.length;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{BAR, LAW, Poses};
    use crate::constraint::{Constraint, RowKind};
    use crate::{Body, Linearized, Motion, Scene, Side};

    /// A cable from the world through bodies and back to a world point that moves, attached off the centres.
    fn scene(seed: u64) -> Scene {
        let mut poses = Poses::new(seed);
        let mut scene = Scene::new("reeved");
        let motion = Motion::Smooth {
            displacement: Vector3::new(0.3, -0.2, 0.1),
            start: 0.0,
            duration: 1.0,
        };
        let mut frames = vec![Frame::world(poses.vector())];
        for name in ["a", "b", "c"] {
            let body = Body::sphere(1.0, 1.0).at(poses.vector() * 3.0);
            let index = scene.add_body(name, body.turned(poses.rotation()));
            frames.push(Frame::body(index, poses.vector()));
        }
        // Twice through the first body.
        frames.push(Frame::body(0, poses.vector()));
        frames.push(Frame::world(poses.vector()).moving(motion));
        let cable = MasslessCable {
            frames,
            length: 5.0,
            law: LAW,
        };
        scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
        scene
    }

    #[test]
    fn jacobian_at_random_poses() {
        let mut worst = 0.0_f64;
        for seed in 1..=20 {
            let error = crate::check_jacobian(&scene(seed), 0).max;
            assert!(error <= BAR, "{error:e}");
            worst = worst.max(error);
        }
        println!("massless cable {worst:.1e}");
    }

    #[test]
    fn violation_is_the_excess_length_and_the_rate_of_a_driven_end() {
        let scene = scene(4);
        let points: Vec<_> = scene.constraints[0]
            .frames()
            .iter()
            .map(|f| f.resolve(&scene.bodies, 0.3).point())
            .collect();
        let total: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let mut lin = Linearized::new(&scene);
        lin.update(&scene, 0.3);
        assert!((lin.phi[0] - (total - 5.0)).abs() < 1e-13);
        assert_eq!(scene.constraints[0].row(0), (RowKind::Length, LAW));
        let mut after = lin.clone();
        after.update(&scene, 0.5);
        lin.drive(&scene, 0.3, 0.5);
        assert!((0.2 * lin.phi_t[0] - (after.phi[0] - lin.phi[0])).abs() < 1e-15);
        assert!(lin.phi_t[0].abs() > 0.01);
    }

    #[test]
    fn tension_is_the_same_in_all_spans() {
        // A point on a cable between two others is pulled along the bisector: n₂ − n₁.
        let mut scene = Scene::new("sheave");
        scene.add_body("sheave", Body::particle(1.0).at(-Vector3::z()));
        let at = |x| Frame::world(Vector3::new(x, 0.0, 0.0));
        let frames = vec![at(-1.0), Frame::body(0, Vector3::zeros()), at(1.0)];
        let cable = MasslessCable {
            frames,
            length: 2.0,
            law: RowLaw::RIGID,
        };
        scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
        let mut lin = Linearized::new(&scene);
        lin.update(&scene, 0.0);
        let half = 0.5_f64.sqrt();
        assert!((lin.block(0)[2] + 2.0 * half).abs() < 1e-15, "{lin:?}");
        assert!(lin.block(0)[0].abs() < 1e-15);
        assert!((lin.phi[0] - (2.0 / half - 2.0)).abs() < 1e-15);
    }

    #[test]
    fn spans_of_length_zero_are_finite() {
        let mut scene = scene(9);
        for frame in scene.constraints[0].frames_mut() {
            frame.side = Side::World(Motion::Fixed);
            frame.point = Vector3::zeros();
        }
        scene.constraints[0].frames_mut()[2] = Frame::body(1, Vector3::zeros());
        scene.bodies.position[1] = Vector3::zeros();
        let mut lin = Linearized::new(&scene);
        lin.update(&scene, 0.0);
        assert_eq!(lin.phi, [-5.0]);
        assert!(lin.jacobian.iter().all(|j| j.is_finite()));
    }
}
