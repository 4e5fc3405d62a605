//! Link of a particle chain: the attachment points keep their distance.
//!
//! With p = x + r the attachment points, d = p_a − p_b and n = d/|d|:
//!
//! **Length** (1 row, m): φ = |d| − L \[SL §III]. ḋ = v_a + ω_a × r_a − v_b − ω_b × r_b gives J_a = \[n, r_a × n],
//! J_b = −\[n, r_b × n]. A taut link has φ > 0, λ < 0 and tension |λ|.
//!
//! **Transverse** (2 rows, optional): φ = 0 always, J_a = \[t, r_a × t], J_b = −\[t, r_b × t] for two unit vectors
//! t₁, t₂ across n: they measure nothing and resist the transverse motion ṫ = t·ḋ. They carry the geometric stiffness
//! of the tension, |∂²(λ φ)/∂d²| = |λ| (I − n nᵀ)/|d|: two rows of stiffness |λ|/|d|, that is ε = |d|/|λ|, so that a step
//! is implicit in the turning of n and M stays diagonal. ε is no constant of the material: the time stepper sets it from
//! its last multiplier ([`Transverse`](crate::Transverse)). **As linearised, ε = 0: a stepper that leaves it
//! so makes the link rigid across.**
//!
//! **Directions** t₂ = (y − (n·y) n)/|…|, t₁ = t₂ × n: right-handed (t₁, t₂, n). They turn smoothly with n except where
//! the link points along ±y, and are exactly in and across the plane for motion in the xz plane. The bases without a
//! square root are no choice here: Frisvad (2012) is singular for a chain that hangs with its lower end as side a, and
//! that of Duff et al. (*Building an Orthonormal Basis, Revisited*, JCGT 6(1), 2017) jumps at n_z = 0, where the links
//! of a horizontal chain are; a jump matters to schemes that remember the rates of rows.
//!
//! Where d = 0 the link has no direction: it is taken to be n = z, so that all is finite and φ = −L.

use nalgebra::Vector3;

use super::facts::{Facts, NO_ROWS, Parts, gap_between, moved};
use super::{RowKind, RowLaw, Rows, gap};
use crate::body::Bodies;
use crate::error::{SceneError, check};
use crate::frame::Frame;

/// Link of constant length between two points: 1 row, or 3 with the transverse ones.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Distance {
    /// The two attachment frames; their axes are not used.
    pub frames: [Frame; 2],
    /// Length L of the link at rest \[m], > 0.
    pub length: f64,
    /// Law of the length row, compliance in m/N.
    pub law: RowLaw,
    /// Adds two transverse rows, whose compliance a stepper sets
    /// ([`Linearized::transverse`](crate::Linearized::transverse)).
    pub transverse: bool,
}

impl Distance {
    /// ∂φ/∂t \[m/s] while d goes to d + `change` within `time` (s): (|d + change| − |d|)/time, and t·change/time.
    fn drive(&self, d: &Vector3<f64>, change: &Vector3<f64>, time: f64, out: &mut [f64]) {
        let (before, n) = direction(d);
        let (after, m) = direction(&(d + change));
        // |d'| − |d| = (d' + d)·(d' − d)/(|d'| + |d|), without its cancellation.
        let sum = before + after;
        let mean = (n * before + m * after) / sum;
        let longer = if sum > 0.0 { mean.dot(change) } else { 0.0 };
        out[0] = longer / time;
        if self.transverse {
            for (rate, t) in out[1..].iter_mut().zip(across(&n)) {
                *rate = t.dot(change) / time;
            }
        }
    }
}

/// |d| and n = d/|d|, with n = z for d = 0.
pub(super) fn direction(d: &Vector3<f64>) -> (f64, Vector3<f64>) {
    if *d == Vector3::zeros() {
        return (0.0, Vector3::z());
    }
    // Scaled first, so that the square of a tiny or huge distance is a number.
    let size = d.amax();
    let scaled = d / size;
    let norm = scaled.norm();
    (size * norm, scaled / norm)
}

/// Unit vectors t₁, t₂ across the unit vector n, see the head of this file; t₁ = x, t₂ = −n_y z for n = ±y.
pub(super) fn across(n: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let s = n.x.hypot(n.z);
    // n without its part along y, normalised.
    let (x, z) = if s == 0.0 {
        (0.0, 1.0)
    } else {
        (n.x / s, n.z / s)
    };
    [
        Vector3::new(z, 0.0, -x),
        Vector3::new(-n.y * x, s, -n.y * z),
    ]
}

impl Facts for Distance {
    fn parts(&self) -> Parts {
        let across = self.transverse.then_some(RowLaw::RIGID);
        [
            (RowKind::Length, 1, Some(self.law)),
            (RowKind::Transverse, 2, across),
            NO_ROWS,
        ]
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let [a, b] = rows.resolve(&self.frames, bodies, t);
        let (distance, n) = direction(&gap(&a, &b));
        let levers = [&a.lever, &b.lever];
        rows.along(distance - self.length, &n, levers);
        if self.transverse {
            for t in across(&n) {
                rows.along(0.0, &t, levers);
            }
        }
        rows.distance = distance;
    }

    fn only_pulls(&self, _side: usize) -> bool {
        true
    }

    fn link_length(&self) -> Option<f64> {
        Some(self.length)
    }

    fn gap_ahead(&self, bodies: &Bodies, t: f64, dt: f64) -> ([f64; 3], usize) {
        let distance = gap_between(&self.frames, bodies, t, dt).norm();
        ([distance - self.length, 0.0, 0.0], 1)
    }

    fn drive_points(&self, bodies: &Bodies, times: [f64; 2], phi_t: &mut [f64]) {
        let [a, b] = &self.frames;
        let change = moved(a, times) - moved(b, times);
        // A link at rest needs no direction.
        if change != Vector3::zeros() {
            let d = gap(&a.resolve(bodies, times[0]), &b.resolve(bodies, times[0]));
            self.drive(&d, &change, times[1] - times[0], phi_t);
        }
    }

    fn validate(&self, what: &dyn Fn() -> String) -> Result<(), SceneError> {
        let length = self.length;
        check(format!("{}: length", what()), length, length > 0.0, "> 0 m")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{LAW, Poses, Sample, assert_rows, phi};
    use crate::testing::*;

    const LENGTH: f64 = 0.7;

    impl Sample for Distance {
        fn sample(frames: [Frame; 2]) -> Self {
            Self {
                frames,
                length: LENGTH,
                law: LAW,
                transverse: true,
            }
        }
    }

    fn link(frames: [Frame; 2], transverse: bool) -> Constraint {
        Constraint::Distance(Distance {
            transverse,
            ..Distance::sample(frames)
        })
    }

    /// p_a − p_b of the scene's only constraint.
    fn gap_at(scene: &Scene, t: f64) -> Vector3<f64> {
        let frames = scene.constraints[0].frames();
        let [a, b] = [0, 1].map(|side| frames[side].resolve(&scene.bodies, t).point());
        a - b
    }

    /// A particle at `point`, linked to the world's origin (side a), which moves.
    fn driven(point: Vector3<f64>) -> Scene {
        let motion = Motion::Smooth {
            displacement: Vector3::new(0.4, -0.3, 0.2),
            start: 0.0,
            duration: 1.0,
        };
        let mut scene = Scene::new("driven");
        scene.add_body("bob", Body::particle(2.0).at(point));
        let world = origin().moving(motion);
        let frames = [world, centre(0)];
        scene.add_constraint("link", link(frames, true), 0);
        scene
    }

    #[test]
    fn jacobian_at_random_poses() {
        assert_rows("distance random", Poses::rotation, |f| link(f, false));
        assert_rows("distance transverse", Poses::rotation, |f| link(f, true));
    }

    #[test]
    fn rows_and_violation() {
        let scene = Poses::new(3).pair(&UnitQuaternion::identity(), |f| link(f, true));
        let c = &scene.constraints[0];
        assert_eq!(c.rows(), 3);
        assert_eq!(c.row(0), (RowKind::Length, LAW));
        assert_eq!(c.row(2), (RowKind::Transverse, RowLaw::RIGID));
        assert!(!c.has_stretch_rows());
        let found = phi(&scene);
        assert!((found[0] - (gap_at(&scene, 0.0).norm() - LENGTH)).abs() < 1e-14);
        assert_eq!(found[1..], [0.0, 0.0]);
        let short = Poses::new(3).pair(&UnitQuaternion::identity(), |f| link(f, false));
        assert_eq!(short.constraints[0].rows(), 1);
        assert_eq!(phi(&short), found[..1]);
    }

    #[test]
    fn transverse_rows_are_across_and_differentiate_the_transverse_gap() {
        let mut poses = Poses::new(21);
        for _ in 0..20 {
            let turn = poses.rotation();
            let scene = poses.pair(&turn, |f| link(f, true));
            let lin = Linearized::at(&scene, 0.0);
            let [n, t1, t2] =
                [0, 6, 12].map(|at| Vector3::from_column_slice(&lin.block(0)[at..at + 3]));
            assert!((n - gap_at(&scene, 0.0).normalize()).norm() < 1e-14);
            assert!((t1.cross(&t2) - n).norm() < 1e-15);
            assert!((t1.norm() - 1.0).abs() < 1e-15 && (t2.norm() - 1.0).abs() < 1e-15);
            // t·(p_a − p_b) with t held: linear in positions, so that a large step does; central in rotations.
            for (side, row, t) in [(0, 1, t1), (0, 2, t2), (1, 1, t1), (1, 2, t2)] {
                for column in 0..6 {
                    let (h, mut delta) = (1e-5, Vector3::zeros());
                    delta[column % 3] = h;
                    let at = |delta: Vector3<f64>| {
                        let mut moved = scene.clone();
                        if column < 3 {
                            moved.bodies.position[side] += delta;
                        } else {
                            let turn = UnitQuaternion::from_scaled_axis(delta);
                            moved.bodies.orientation[side] = turn * moved.bodies.orientation[side];
                        }
                        t.dot(&gap_at(&moved, 0.0))
                    };
                    let numeric = (at(delta) - at(-delta)) / (2.0 * h);
                    let analytic = lin.block(side)[6 * row + column];
                    assert!((numeric - analytic).abs() < 1e-9, "{numeric} {analytic}");
                }
            }
        }
    }

    #[test]
    fn directions_are_orthonormal_everywhere() {
        let mut poses = Poses::new(8);
        let mut all: Vec<_> = (0..200).map(|_| poses.vector()).collect();
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            for tiny in [0.0, 1e-308, 1e-160, 1e-16, 1e-8, 1e-3] {
                let off = Vector3::new(tiny, -tiny, 0.3 * tiny);
                all.extend([axis + off, off - axis, axis * 1e-300, axis * 1e300]);
            }
        }
        for d in all {
            let (distance, n) = direction(&d);
            let [t1, t2] = across(&n);
            assert!((n * (distance / d.amax()) - d / d.amax()).norm() < 1e-15);
            assert!((t1.cross(&t2) - n).norm() < 4e-16, "{d}");
            for (error, what) in [
                (n.norm() - 1.0, "n"),
                (t1.norm() - 1.0, "t1"),
                (t2.norm() - 1.0, "t2"),
                (t1.dot(&t2), "t1 t2"),
                (t1.dot(&n), "t1 n"),
                (t2.dot(&n), "t2 n"),
            ] {
                assert!(error.abs() < 4e-16, "{what} {error:e} {d}");
            }
        }
    }

    #[test]
    fn directions_turn_smoothly_and_keep_the_plane() {
        // A link that turns over in the xz plane, and one that stays 30° off it.
        for tilt in [0.0, 0.5_f64] {
            let mut last: Option<[Vector3<f64>; 2]> = None;
            for k in 0..=1000 {
                let angle = std::f64::consts::TAU * f64::from(k) / 1000.0;
                let d = Vector3::new(angle.sin(), tilt, angle.cos());
                let now = across(&direction(&d).1);
                if tilt == 0.0 {
                    assert_eq!([now[0].y, now[1].x, now[1].z], [0.0; 3]);
                }
                if let Some(last) = last {
                    assert!((now[0] - last[0]).norm() < 7e-3);
                    assert!((now[1] - last[1]).norm() < 7e-3);
                }
                last = Some(now);
            }
        }
        // Hanging, whichever side is the upper: exact coordinate axes.
        assert_eq!(across(&Vector3::z()), [Vector3::x(), Vector3::y()]);
        assert_eq!(across(&-Vector3::z()), [-Vector3::x(), Vector3::y()]);
    }

    #[test]
    fn a_link_of_length_zero_is_finite() {
        let mut scene = driven(Vector3::zeros());
        let mut lin = Linearized::at(&scene, 0.0);
        lin.drive(&scene, 0.0, 0.0);
        assert_eq!(*lin.phi, [-LENGTH, 0.0, 0.0]);
        assert_eq!(lin.transverse[0].distance, 0.0);
        assert_eq!(lin.block(0)[..3], [0.0, 0.0, -1.0]);
        assert!(lin.jacobian.iter().all(|j| j.is_finite()));
        // Driven from there: the distance grows at the speed of the motion.
        lin.drive(&scene, 0.0, 0.5);
        let moved = scene.constraints[0].frames()[0].displacement(0.5);
        assert!((lin.phi_t[0] - moved.norm() / 0.5).abs() < 1e-15);
        assert!(lin.phi_t.iter().all(|rate| rate.is_finite()));
        // Resting there.
        scene.constraints[0].frames_mut()[0].side = crate::Side::World(Motion::Fixed);
        lin.drive(&scene, 0.0, 0.5);
        assert_eq!(*lin.phi_t, [0.0; 3]);
    }

    #[test]
    fn drive_is_the_exact_change_with_the_bodies_held() {
        let mut scene = driven(Vector3::new(0.2, 0.1, -0.8));
        for reversed in [false, true] {
            if reversed {
                scene.constraints[0].frames_mut().reverse();
            }
            let (t, t_next) = (0.3, 0.5);
            let (mut lin, after) = (Linearized::at(&scene, t), Linearized::at(&scene, t_next));
            lin.drive(&scene, t, t_next);
            let change = after.phi[0] - lin.phi[0];
            assert!((lin.phi_t[0] * 0.2 - change).abs() < 1e-15);
            assert!(change.abs() > 0.01);
            // The transverse rates are those of the gap across the link as it is at t.
            let d = gap_at(&scene, t_next) - gap_at(&scene, t);
            for (rate, t) in lin.phi_t[1..]
                .iter()
                .zip(across(&gap_at(&scene, t).normalize()))
            {
                assert!((rate * 0.2 - t.dot(&d)).abs() < 1e-15);
            }
            lin.drive(&scene, t, t);
            assert_eq!(*lin.phi_t, [0.0; 3]);
        }
    }

    #[test]
    fn levers_and_transverse_rows_are_told_to_the_stepper() {
        let scene = Poses::new(5).pair(&UnitQuaternion::identity(), |f| link(f, true));
        let lin = Linearized::at(&scene, 0.0);
        let found = lin.transverse[0];
        assert_eq!((found.length_row, found.rows()), (0, 1..3));
        assert!((found.distance - gap_at(&scene, 0.0).norm()).abs() < 1e-14);
        assert_eq!(*lin.compliance, [LAW.compliance, 0.0, 0.0]);
        assert_eq!(*lin.damping, [LAW.damping, 0.0, 0.0]);
        let levers = |lin: &crate::Linearized| [lin.lever(0), lin.lever(1)];
        for (lever, frame) in levers(&lin).iter().zip(scene.constraints[0].frames()) {
            assert_eq!(*lever, frame.resolve(&scene.bodies, 0.0).lever);
        }
        let without = Poses::new(5).pair(&UnitQuaternion::identity(), |f| link(f, false));
        let without = Linearized::at(&without, 0.0);
        assert!(without.transverse.is_empty());
        assert_eq!(levers(&without), levers(&lin));
    }
}
