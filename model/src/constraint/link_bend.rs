//! Bending between two links that share a point, for chains of particles: three points, no rotations.
//!
//! With the points p₀, p₁, p₂ (p = x + r), d₁ = p₁ − p₀, d₂ = p₂ − p₁, e = d/|d|, n = e₁ × e₂/|e₁ × e₂|:
//!
//! **Angle** (1 row, rad): φ = θ = atan2(|d₁ × d₂|, d₁·d₂) \[SL §III (e)],
//!
//!   ∂θ/∂d₁ = −(n × d₁)/|d₁|²,  ∂θ/∂d₂ = (n × d₂)/|d₂|²
//!
//! the paper's (12)–(16) without their subtractions. Where the links are in one line n has no direction: it is then the
//! one across them nearest to y, so that a straight chain in the xz plane resists its first bending. The row resists
//! one of two transverse directions only: **it holds in exactly planar motion**.
//!
//! **Vector** (2 rows, rad): φ_k = b·t_k, b = θ n, on two unit vectors t₁, t₂ across the mean tangent
//! t = (e₁ + e₂)/|e₁ + e₂| (those of [`Distance`](super::Distance) across t: exactly in and across the plane for motion
//! in the xz plane). Smooth at θ = 0; |φ| = |θ|, so that in a plane it is the angle row with a sign. With
//! g = θ/sin θ, h = (1 − θ cot θ)/sin²θ, d = e₁ × e₂, c = e₁·e₂ and a = t_k, turning e₂ (e₁) by ω gives ḃ·a = w₂·ω
//! (w₁·ω),
//!
//!   w₂ = h (d·a) d + g (c a − (e₂·a) e₁),   w₁ = b × a − w₂
//!
//! and the turning of the axes adds σ t·(a × b), σ = (t_y/s) ṫ·t₁ their spin, s² = 1 − t_y². Singular where t points
//! along ±y, and at the fold θ = π. The axes belong to the world: multipliers along b itself (equal compliances, at rest)
//! make no moment about the whole, others do, of the order of what separates them from b.

use nalgebra::Vector3;

use super::cosserat::{FOLD, Factors};
use super::distance::{across, direction};
use super::facts::{Facts, NO_ROWS, Parts};
use super::paper::angle_between;
use super::{RowKind, RowLaw, Rows, gap};
use crate::body::Bodies;
use crate::frame::{Frame, Resolved};

/// Measure of bending in a [`LinkBend`].
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum BendDefinition {
    /// The angle between the links, 1 row: the paper's.
    Angle,
    /// The angle times its axis, 2 rows.
    #[default]
    Vector,
}

impl BendDefinition {
    fn rows(self) -> usize {
        match self {
            Self::Angle => 1,
            Self::Vector => 2,
        }
    }
}

/// Bending at the middle one of three points, 1 or 2 rows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinkBend {
    /// The attachment frames of p₀, p₁, p₂; their axes are not used.
    pub frames: [Frame; 3],
    /// Law of the rows, compliance in rad/(N m).
    pub law: RowLaw,
    /// Angle or vector that the rows measure.
    pub definition: BendDefinition,
}

impl LinkBend {
    /// Row `row` with the gradients `g` on e₁ and e₂, which need not be across them.
    fn write(
        &self,
        sides: &[Resolved; 3],
        row: usize,
        phi: f64,
        g: [Vector3<f64>; 2],
        links: [(f64, Vector3<f64>); 2],
        rows: &mut Rows<'_>,
    ) {
        // ∂/∂d = (I − e eᵀ) ∂/∂e / |d|.
        let [g1, g2] = [0, 1].map(|k| {
            let (length, e) = links[k];
            (g[k] - e * e.dot(&g[k])) / length.max(f64::MIN_POSITIVE)
        });
        rows.phi[row] = phi;
        let mut blocks = 0;
        for (k, g) in [-g1, g1 - g2, g2].iter().enumerate() {
            if let Some(block) = rows.block_of(k, &self.frames[k], &mut blocks) {
                rows.point(block, row, g, &sides[k].lever);
            }
        }
    }
}

/// Both components of the bend vector \[rad] with their gradients on e₁ and e₂.
fn vector(e1: Vector3<f64>, e2: Vector3<f64>) -> [(f64, [Vector3<f64>; 2]); 2] {
    let d = e1.cross(&e2);
    // At the fold the axis has no direction: everything stays finite.
    let Factors { g, h, c, .. } = Factors::between(&e1, &e2);
    let b = d * g;
    let (sum, t) = direction(&(e1 + e2));
    let axes = across(&t);
    let s = t.x.hypot(t.z).max(FOLD);
    axes.map(|a| {
        let w2 = d * (h * d.dot(&a)) + (a * c - e1 * e2.dot(&a)) * g;
        let w1 = b.cross(&a) - w2;
        let spin = axes[0] * (t.y / s * t.dot(&a.cross(&b)) / sum.max(FOLD));
        (b.dot(&a), [w1.cross(&e1) + spin, w2.cross(&e2) + spin])
    })
}

impl Facts for LinkBend {
    fn parts(&self) -> Parts {
        let rows = self.definition.rows();
        [(RowKind::Bend, rows, Some(self.law)), NO_ROWS, NO_ROWS]
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        let sides = self.frames.map(|f| f.resolve(bodies, t));
        let links = [gap(&sides[1], &sides[0]), gap(&sides[2], &sides[1])].map(|d| direction(&d));
        match self.definition {
            BendDefinition::Angle => {
                let [(_, e1), (_, e2)] = links;
                let (theta, mut n) = angle_between(&e1, &e2, f64::MIN_POSITIVE);
                if n == Vector3::zeros() {
                    n = across(&e1)[1];
                }
                self.write(&sides, 0, theta, [-n.cross(&e1), n.cross(&e2)], links, rows);
            }
            BendDefinition::Vector => {
                for (row, (phi, g)) in vector(links[0].1, links[1].1).into_iter().enumerate() {
                    self.write(&sides, row, phi, g, links, rows);
                }
            }
        }
    }

    fn only_pulls(&self, _side: usize) -> bool {
        true
    }

    fn acts_at_points(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::testing::{BAR, LAW, Poses, Sample};
    use crate::testing::*;

    /// The third point is one of the world.
    impl Sample for LinkBend {
        fn sample(frames: [Frame; 2]) -> Self {
            Self {
                frames: [frames[0], frames[1], Frame::world(Vector3::x())],
                law: LAW,
                definition: BendDefinition::Vector,
            }
        }
    }

    /// Three bodies with the points at `points`, attached off their centres where `levers` are given.
    fn scene(points: [Vector3<f64>; 3], levers: Option<u64>, definition: BendDefinition) -> Scene {
        let mut scene = Scene::new("links");
        let mut poses = Poses::new(levers.unwrap_or(1));
        let frames = points.map(|p| {
            let (turn, lever) = match levers {
                Some(_) => (poses.rotation(), poses.vector()),
                None => (UnitQuaternion::identity(), Vector3::zeros()),
            };
            let name = format!("p{}", scene.bodies.len());
            let body = Body::particle(1.0).at(p - turn * lever).turned(turn);
            Frame::body(scene.add_body(name, body), lever)
        });
        let bend = LinkBend {
            frames,
            law: LAW,
            definition,
        };
        scene.add_constraint("bend", Constraint::LinkBend(bend), 0);
        scene
    }

    /// Points of two links of random lengths with the angle `theta` between them, in any position.
    fn bent(poses: &mut Poses, theta: f64) -> [Vector3<f64>; 3] {
        let turn = poses.rotation();
        let lengths = [poses.number(), poses.number()].map(|x| 1.5 + x);
        let p = poses.vector() * 3.0;
        let d1 = turn * Vector3::x() * lengths[0];
        let d2 = turn * Vector3::new(theta.cos(), theta.sin(), 0.0) * lengths[1];
        [p, p + d1, p + d1 + d2]
    }

    #[test]
    fn jacobian_at_random_poses() {
        for definition in [BendDefinition::Angle, BendDefinition::Vector] {
            // Near straight and folded: beside differences in 32 digits, in the tests of the workspace.
            for theta in [1.0, 2.0, 0.5, 0.03, 0.030_001] {
                let mut poses = Poses::new(7);
                let mut worst = 0.0_f64;
                for k in 0..20 {
                    let points = bent(&mut poses, theta);
                    let levers = (k % 2 == 0).then_some(k + 1);
                    let error = check_jacobian(&scene(points, levers, definition), 0).max;

                    assert!(error <= BAR, "{definition:?} θ = {theta}: {error:e}");
                    worst = worst.max(error);
                }
                println!("{definition:?} θ = {theta:.1e}: {worst:.1e}");
            }
        }
    }

    /// The paper's own Jacobian (12)–(16): (d_· ∂d_× − d_× ∂d_·)/(d_×² + d_·²), d_× = |d₁ × d₂|, d_· = d₁·d₂, in which
    /// ∂d_× = (−n_×, …) is the derivative of the norm of the cross product.
    fn as_printed([p0, p1, p2]: [Vector3<f64>; 3]) -> [Vector3<f64>; 3] {
        let (d1, d2) = (p1 - p0, p2 - p1);
        let cross = d1.cross(&d2);
        let (sine, cosine) = (cross.norm(), d1.dot(&d2));
        let unit = cross / sine;
        let square = sine * sine + cosine * cosine;
        // ∂|d₁ × d₂| on d₁ and d₂.
        let (on_d1, on_d2) = (d2.cross(&unit), unit.cross(&d1));
        let sines = [-on_d1, on_d1 - on_d2, on_d2];
        let cosines = [-d2, d2 - d1, d1];
        [0, 1, 2].map(|k| (sines[k] * cosine - cosines[k] * sine) / square)
    }

    #[test]
    fn the_paper_s_jacobian_is_the_simpler_one() {
        let mut poses = Poses::new(11);
        let mut worst = 0.0_f64;
        for k in 0..200 {
            let theta = 0.05 + 3.0 * (f64::from(k) / 200.0);
            let points = bent(&mut poses, theta);
            let lin = Linearized::at(&scene(points, None, BendDefinition::Angle), 0.0);
            let printed = as_printed(points);
            let size = printed.iter().map(Vector3::norm).fold(0.0, f64::max);
            for (side, g) in printed.iter().enumerate() {
                let ours = Vector3::from_column_slice(&lin.block(side)[..3]);
                worst = worst.max((ours - g).norm() / size);
            }
        }
        println!("the paper's (12)–(16) against the simpler form: {worst:.1e}");
        assert!(worst <= 1e-14, "{worst:e}");
    }

    #[test]
    fn the_vector_is_the_angle_with_a_sign_in_the_plane_and_its_norm_in_space() {
        let mut poses = Poses::new(13);
        for theta in [1e-6, 0.2, 1.0, 3.0] {
            for _ in 0..10 {
                let points = bent(&mut poses, theta);
                let phi = |points, d| Linearized::at(&scene(points, None, d), 0.0).phi;
                let angle = phi(points, BendDefinition::Angle)[0];
                let vector = phi(points, BendDefinition::Vector);
                assert!((angle - theta).abs() < 1e-14);
                assert!((vector[0].hypot(vector[1]) - theta).abs() < 1e-14);
                // Flat on the xz plane.
                let flat = points.map(|p| Vector3::new(p.x, 0.0, p.z));
                let vector = phi(flat, BendDefinition::Vector);
                let angle = phi(flat, BendDefinition::Angle)[0];
                let d = (flat[1] - flat[0]).cross(&(flat[2] - flat[1]));
                assert_eq!(vector[0], 0.0);
                assert!((vector[1] - angle * d.y.signum()).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn bending_moves_no_momentum() {
        // Gradients sum to zero, and so do their moments: internal forces.
        let mut poses = Poses::new(17);
        for definition in [BendDefinition::Angle, BendDefinition::Vector] {
            let points = bent(&mut poses, 0.7);
            let lin = Linearized::at(&scene(points, None, definition), 0.0);
            let rows = definition.rows();
            for row in 0..rows {
                let g = |side: usize| Vector3::from_column_slice(&lin.block(side)[6 * row..][..3]);
                let sum: Vector3<f64> = (0..3).map(g).sum();
                assert!(sum.norm() < 1e-15);
                if definition == BendDefinition::Angle {
                    // For the vector, this holds for multipliers along it: below.
                    let moment: Vector3<f64> = (0..3).map(|s| points[s].cross(&g(s))).sum();
                    assert!(moment.norm() < 1e-14);
                }
            }
            let force = |side: usize| -> Vector3<f64> {
                let g = |row: usize| Vector3::from_column_slice(&lin.block(side)[6 * row..][..3]);
                (0..rows).map(|row| g(row) * lin.phi[row]).sum()
            };
            let moment: Vector3<f64> = (0..3).map(|s| points[s].cross(&force(s))).sum();
            assert!(moment.norm() < 1e-14, "{definition:?} {moment}");
            let kind = scene(points, None, definition).constraints[0].row(0);
            assert_eq!(kind, (RowKind::Bend, LAW));
        }
    }

    #[test]
    fn degenerate_links_are_finite() {
        let x = Vector3::x();
        let y = Vector3::y();
        let zero = Vector3::zeros();
        for points in [
            [zero, x, x * 2.0],
            [zero, x, zero],
            [zero, zero, x],
            [zero, zero, zero],
            [zero, y, y * 2.0],
        ] {
            for definition in [BendDefinition::Angle, BendDefinition::Vector] {
                let lin = Linearized::at(&scene(points, None, definition), 0.0);
                let all = lin.phi.iter().chain(&lin.jacobian);
                assert!(all.clone().all(|v| v.is_finite()), "{points:?} {lin:?}");
            }
        }
    }

    #[test]
    fn a_driven_point_bends_the_links() {
        let points = [Vector3::zeros(), Vector3::x(), Vector3::new(2.0, 0.0, 0.1)];
        let mut scene = scene(points, None, BendDefinition::Vector);
        let motion = Motion::Smooth {
            displacement: Vector3::new(0.0, 0.1, 0.3),
            start: 0.0,
            duration: 1.0,
        };
        scene.constraints[0].frames_mut()[0] = origin().moving(motion);
        let mut lin = Linearized::at(&scene, 0.4);
        lin.drive(&scene, 0.4, 0.6);
        let mut after = lin.clone();
        after.update(&scene, 0.6);
        for row in 0..2 {
            let change = after.phi[row] - lin.phi[row];
            assert!((0.2 * lin.phi_t[row] - change).abs() < 1e-15);
            assert!(change.abs() > 0.01);
        }
        assert_eq!(lin.slots.len(), 2);
    }
}
