//! A chain of rigid segments, clamped at its first joint and loaded at its free end, and the exact answer of that
//! chain.
//!
//! Joints stand at nodes; joint j has the compliances ε_s, ε_b, ε_t of the cable that it stands for. Loads are dead: a
//! force F at the tip and the weights of the segments. The force through joint j is then known, F_j = F + Σ_{i ≥ j}
//! m_i g, its gap is ε_s F_j, and the moments follow from segment to segment,
//!
//! ```text
//! G_{j+1} = G_j − (b_j − a_j) × F_j + ½ (b_j − a_j) × m_j g
//! ```
//!
//! with a_j, b_j the ends of segment j. A joint with the moment G turns by θ about n and by Ω about u_a, where
//! G = (θ/ε_b) n + (Ω/ε_t) (u_a + u_b)/(1 + cos θ): Ω = ε_t G·u_a, and of the part across u_a,
//! |G_⊥|² = (θ/ε_b)² + (G·u_a)² tan²½θ, which has one root θ. So the whole shape follows from the moment at the
//! clamp, and that from the condition that the tip has none: three equations, solved by Newton's method with the
//! load raised in steps. None of it uses the model's own joints or Jacobians.

use crate::hard::special::root;
use nalgebra::{Matrix3, Rotation3, Vector3};
use std::f64::consts::PI;
use taut_model::Scene;

/// Compliances of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Compliance {
    /// In all directions \[m/N].
    stretch: f64,
    /// \[rad/(N m)].
    bend: f64,
    twist: f64,
}

/// The chain, unstrained.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rod {
    /// Joints 0 to n − 1 and the tip \[m].
    nodes: Vec<Vector3<f64>>,
    /// Direction of the cable at the clamp.
    clamp: Vector3<f64>,
    joints: Vec<Compliance>,
    /// Masses of the segments \[kg]; without gravity they have no part in the answer.
    masses: Vec<f64>,
    gravity: Vector3<f64>,
    /// Mass of the particle that the tip carries \[kg].
    tip_mass: f64,
    /// Force on that particle \[N].
    force: Vector3<f64>,
}

/// The chain under its load.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    /// Ends of the segments: the start of the first, then the end of each \[m]. The last one is the tip.
    pub(super) ends: Vec<Vector3<f64>>,
    /// Direction of the last segment.
    pub(super) tangent: Vector3<f64>,
}

impl Shape {
    pub(super) fn tip(&self) -> Vector3<f64> {
        self.ends.last().copied().unwrap_or_default()
    }
}

impl Rod {
    /// The chain of a scene: segments from the clamp, then the tip's particle; the joints from the clamp, then the tip's.
    pub(super) fn of(scene: &Scene) -> Self {
        let (bodies, n) = (&scene.bodies, scene.bodies.len() - 1);
        let place = |joint: usize| {
            let frame = scene.constraints[joint].frames()[0];
            frame.resolve(bodies, 0.0).point()
        };
        let law = |joint: usize| {
            let row = |k: usize| scene.constraints[joint].row(k).1.compliance;
            Compliance {
                stretch: row(0),
                bend: row(3),
                twist: row(5),
            }
        };
        let mut nodes: Vec<Vector3<f64>> = (0..n).map(place).collect();
        nodes.push(bodies.position[n]);
        Self {
            nodes,
            clamp: scene.constraints[0].frames()[0].axes.column(0).into(),
            joints: (0..n).map(law).collect(),
            masses: bodies.mass[..n].to_vec(),
            gravity: scene.gravity,
            tip_mass: bodies.mass[n],
            force: bodies.force[n],
        }
    }

    fn chord(&self, i: usize) -> Vector3<f64> {
        self.nodes[i + 1] - self.nodes[i]
    }

    /// Axis u of joint j at rest, along the cable: the direction of the clamp, or the mean of the neighbours'.
    fn axis(&self, j: usize) -> Vector3<f64> {
        match j {
            0 => self.clamp,
            _ => (self.chord(j - 1).normalize() + self.chord(j).normalize()).normalize(),
        }
    }

    /// Ends of the segments, which have these names, as a scene's bodies stand \[m].
    pub(super) fn ends(&self, scene: &Scene, names: &[String]) -> Option<Vec<Vector3<f64>>> {
        let mut ends = Vec::new();
        for (i, name) in names[..self.joints.len()].iter().enumerate() {
            let body = scene.body(name).ok()?;
            let centre = scene.bodies.position[body];
            let along = scene.bodies.orientation[body] * Vector3::z();
            let half = along * (0.5 * self.chord(i).norm());
            ends.extend((i == 0).then_some(centre - half));
            ends.push(centre + half);
        }
        Some(ends)
    }

    /// F Σ s_j² ε_j with the distances s_j of the joints from the tip: how far a small load moves it along y, where the chain is
    /// straight along x \[m].
    pub(super) fn by_levers(&self) -> f64 {
        let tip = self.nodes[self.joints.len()].x;
        let levers = self.nodes.iter().zip(&self.joints);
        let ways = levers.map(|(node, joint)| (tip - node.x).powi(2) * joint.bend);
        self.force.y * ways.sum::<f64>()
    }

    /// The exact shape, with all loads raised in `steps` steps. `None` where Newton's method does not converge.
    pub(super) fn exact(&self, steps: usize) -> Option<Shape> {
        let mut moment = Vector3::zeros();
        for k in 1..=steps {
            let load = k as f64 / steps as f64;
            moment = shoot(moment, |m| Some(self.follow(m, load)?.1))?;
        }
        Some(self.follow(moment, 1.0)?.0)
    }

    /// The shape for a moment at the clamp, and the moment left at the tip, under the part `load` of the loads.
    fn follow(&self, mut moment: Vector3<f64>, load: f64) -> Option<(Shape, Vector3<f64>)> {
        let weight = |mass: f64| self.gravity * (mass * load);
        let mut force = self.force * load + weight(self.tip_mass);
        force += weight(self.masses.iter().sum());
        let mut turned = Rotation3::identity();
        let mut end = self.nodes[0];
        let mut ends = Vec::with_capacity(self.nodes.len());
        let mut tangent = self.clamp;
        for (j, joint) in self.joints.iter().enumerate() {
            let u = turned * self.axis(j);
            turned = joint_turn(&u, &moment, joint)? * turned;
            end += force * joint.stretch;
            if j == 0 {
                ends.push(end);
            }
            let side = turned * self.chord(j);
            moment -= side.cross(&force);
            moment += 0.5 * side.cross(&weight(self.masses[j]));
            force -= weight(self.masses[j]);
            end += side;
            ends.push(end);
            tangent = side.normalize();
        }
        Some((Shape { ends, tangent }, moment))
    }
}

/// How a joint with axis u on side a turns side b under a moment.
fn joint_turn(
    u: &Vector3<f64>,
    moment: &Vector3<f64>,
    joint: &Compliance,
) -> Option<Rotation3<f64>> {
    let torsion = moment.dot(u);
    let across = moment - u * torsion;
    let size = across.norm();
    let bend = |theta: f64| (theta / joint.bend).hypot(torsion * (0.5 * theta).tan()) - size;
    // Without torsion it is size · ε.
    let most = (size * joint.bend).min(PI - 1e-9);
    let theta = if torsion == 0.0 || size == 0.0 {
        size * joint.bend
    } else {
        root(bend, 0.0, most * (1.0 + 1e-12))
    };
    if theta.is_nan() || theta >= PI {
        return None;
    }
    let twist = Rotation3::from_scaled_axis(u * (joint.twist * torsion));
    // across = α n + β n × u.
    let (alpha, beta) = (theta / joint.bend, torsion * (0.5 * theta).tan());
    let sum = alpha * alpha + beta * beta;
    if sum == 0.0 {
        return Some(twist);
    }
    let n = (across * alpha + u.cross(&across) * beta) / sum;
    Some(Rotation3::from_scaled_axis(n * theta) * twist)
}

/// The root of three equations near `start`, by Newton's method with differences. `None` if it does
/// not converge.
pub(super) fn shoot(
    start: Vector3<f64>,
    f: impl Fn(Vector3<f64>) -> Option<Vector3<f64>>,
) -> Option<Vector3<f64>> {
    let mut x = start;
    let mut last = f64::INFINITY;
    for _ in 0..60 {
        let residual = f(x)?;
        let h = 1e-6 * (1.0 + x.norm());
        let mut jacobian = Matrix3::zeros();
        for k in 0..3 {
            let mut step = Vector3::zeros();
            step[k] = h;
            jacobian.set_column(k, &((f(x + step)? - f(x - step)?) / (2.0 * h)));
        }
        let step = jacobian.lu().solve(&residual)?;
        x -= step;
        let size = step.norm();
        // Differences leave a part in 10⁷ of each step: the last ones are rounding.
        if size <= 1e-13 * (x.norm() + 1e-3) || (size < 1e-9 * x.norm() && size >= last) {
            return Some(x);
        }
        last = size;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_model::{Body, Constraint, Cosserat, Frame, JointLaw, RowLaw};

    #[test]
    fn a_joint_turns_as_the_model_s_rows_say() {
        let joint = Compliance {
            stretch: 0.0,
            bend: 0.5,
            twist: 1.0 / 3.0,
        };
        let (u, moment) = (Vector3::x(), Vector3::new(1.1, 0.7, -2.0));
        let turn = joint_turn(&u, &moment, &joint).expect("a turn");
        let mut scene = Scene::new("joint");
        scene.add_body("b", Body::sphere(1.0, 1.0).turned(turn.into()));
        let frames = [
            Frame::world(Vector3::zeros()),
            Frame::body(0, Vector3::zeros()),
        ];
        let frames = frames.map(|f| f.with_axes(Matrix3::identity()));
        let law = |compliance| Some(RowLaw::new(compliance, 0.0));
        let law = JointLaw {
            stretch: None,
            bend: law(joint.bend),
            twist: law(joint.twist),
        };
        scene.add_constraint("j", Constraint::Cosserat(Cosserat::new(frames, law)), 0);
        let mut rows = taut_model::Linearized::new(&scene);
        rows.update(&scene, 0.0);
        // Jᵀ φ/ε on the body is the moment that bends the joint.
        let mut found = Vector3::zeros();
        for row in 0..3 {
            let gradient = rows.block(0);
            let of_row = Vector3::from_fn(|k, _| gradient[6 * row + 3 + k]);
            found += of_row * (rows.phi[row] / rows.compliance[row]);
        }
        assert!((found - moment).norm() < 1e-12, "{found} {moment}");
    }

    #[test]
    fn a_small_load_bends_as_the_levers_say() {
        let n = 12;
        let h = 1.0 / n as f64;
        let place = |i: usize| Vector3::x() * ((i as f64 + 0.5) * h).min(1.0);
        let joint = Compliance {
            stretch: 0.0,
            bend: h,
            twist: h,
        };
        let rod = Rod {
            nodes: (0..=n).map(place).collect(),
            clamp: Vector3::x(),
            joints: vec![joint; n],
            masses: vec![h; n],
            gravity: Vector3::zeros(),
            tip_mass: 0.1,
            force: Vector3::new(0.0, 3e-6, 0.0),
        };
        let tip = rod.exact(1).expect("a shape").tip();
        let exact = 1e-6 * (1.0 - 1.0 / (4.0 * 144.0));
        assert!((tip.y / exact - 1.0).abs() < 1e-9, "{tip}");
    }
}
