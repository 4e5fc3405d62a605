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
use crate::paper::specimens::settle;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::PI;
use taut_model::{
    Body, Constraint, Cosserat, Frame, JointLaw, RowLaw, Scene, SceneError, Spherical, axes_along,
};
use taut_output::check::ExperimentError;

/// Compliances of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Compliance {
    /// In all directions \[m/N].
    pub(super) stretch: f64,
    /// \[rad/(N m)].
    pub(super) bend: f64,
    pub(super) twist: f64,
}

impl Compliance {
    /// Compliance of `length` (m) of an inextensible cable with EI and GJ (N m²).
    pub(super) fn of(length: f64, ei: f64, gj: f64) -> Self {
        Self {
            stretch: 0.0,
            bend: length / ei,
            twist: length / gj,
        }
    }
}

/// The chain, unstrained.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::hard) struct Rod {
    /// Joints 0 to n − 1 and the tip \[m].
    pub(super) nodes: Vec<Vector3<f64>>,
    /// Direction of the cable at the clamp.
    pub(super) clamp: Vector3<f64>,
    pub(super) joints: Vec<Compliance>,
    /// Masses of the segments \[kg]; without gravity they have no part in the answer.
    pub(super) masses: Vec<f64>,
    pub(super) gravity: Vector3<f64>,
    /// Mass of the particle that the tip carries \[kg].
    pub(super) tip_mass: f64,
    /// Force on that particle \[N].
    pub(super) force: Vector3<f64>,
    /// Damping time of the joints' rows \[s].
    pub(super) damping: f64,
}

/// The chain under its load.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::hard) struct Shape {
    /// Ends of the segments: the start of the first, then the end of each \[m]. The last one is the tip.
    pub(super) ends: Vec<Vector3<f64>>,
    /// Direction of the last segment.
    pub(in crate::hard) tangent: Vector3<f64>,
}

impl Shape {
    pub(in crate::hard) fn tip(&self) -> Vector3<f64> {
        self.ends.last().copied().unwrap_or_default()
    }
}

impl Rod {
    /// A straight chain along x without weight, its first joint at `start` (m), with segments of the given lengths
    /// (m).
    pub(super) fn straight(start: f64, lengths: &[f64], joints: Vec<Compliance>) -> Self {
        let mut nodes = vec![Vector3::x() * start];
        let mut x = start;
        for length in lengths {
            x += length;
            nodes.push(Vector3::x() * x);
        }
        Self {
            nodes,
            clamp: Vector3::x(),
            joints,
            masses: vec![1.0 / lengths.len() as f64; lengths.len()],
            gravity: Vector3::zeros(),
            tip_mass: 0.1,
            force: Vector3::zeros(),
            damping: 0.0,
        }
    }

    /// A straight chain of `n` joints on a cable of length 1 m with EI = GJ = 1 N m², each the midpoint of the piece
    /// of 1/n m that it stands for: half a piece is held by the clamp, half a piece is beyond the last joint.
    pub(super) fn midpoints(n: usize) -> Self {
        let h = 1.0 / n as f64;
        let mut lengths = vec![h; n];
        lengths[n - 1] = 0.5 * h;
        Self::straight(0.5 * h, &lengths, vec![Compliance::of(h, 1.0, 1.0); n])
    }

    /// The chain of a scene: segments from the clamp, then the tip's particle; the joints from the clamp, then the tip's.
    pub(in crate::hard) fn of(scene: &Scene) -> Self {
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
            damping: 0.0,
        }
    }

    pub(super) fn segments(&self) -> usize {
        self.joints.len()
    }

    fn chord(&self, i: usize) -> Vector3<f64> {
        self.nodes[i + 1] - self.nodes[i]
    }

    /// Axes of joint j at rest, u along the cable: the direction of the clamp, or the mean of the neighbours'.
    fn axes(&self, j: usize) -> Matrix3<f64> {
        let along = match j {
            0 => self.clamp,
            _ => self.chord(j - 1).normalize() + self.chord(j).normalize(),
        };
        axes_along(&along).unwrap_or_else(Matrix3::identity)
    }

    /// The scene, unstrained and at rest. Bodies: the segments from the clamp, then the tip's particle. Constraints:
    /// the joints from the clamp, then the tip's.
    pub(super) fn scene(&self) -> Result<Scene, SceneError> {
        let n = self.segments();
        let mut scene = Scene::new("rod");
        scene.gravity = self.gravity;
        let law = |c: Compliance| {
            let law = |compliance| Some(RowLaw::new(compliance, self.damping));
            JointLaw {
                stretch: law(c.stretch),
                bend: law(c.bend),
                twist: law(c.twist),
            }
        };
        let mut turns = Vec::new();
        for i in 0..n {
            let chord = self.chord(i);
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &chord)
                .unwrap_or_else(|| UnitQuaternion::from_scaled_axis(Vector3::x() * PI));
            let length = chord.norm();
            let rod = Body::rod(length, 0.1 * length, self.masses[i]);
            let centre = self.nodes[i] + 0.5 * chord;
            scene.add_body(format!("segment-{}", i + 1), rod.at(centre).turned(turn));
            turns.push(turn);
        }
        let mut particle = Body::particle(self.tip_mass).at(self.nodes[n]);
        particle.force = self.force;
        let tip = scene.add_body("tip", particle);
        scene.load = Some(tip);
        let end = |i: usize, sign: f64| Vector3::z() * (sign * 0.5 * self.chord(i).norm());
        for j in 0..n {
            let axes = self.axes(j);
            let at = |i: usize, sign: f64| {
                let local = turns[i].inverse().to_rotation_matrix() * axes;
                Frame::body(i, end(i, sign)).with_axes(local)
            };
            let a = match j {
                0 => Frame::world(self.nodes[0]).with_axes(axes),
                _ => at(j - 1, 1.0),
            };
            let joint = Cosserat::new([a, at(j, -1.0)], law(self.joints[j]));
            scene.add_constraint(format!("joint-{j}"), Constraint::Cosserat(joint), 0);
        }
        let hold = Spherical {
            frames: [
                Frame::body(n - 1, end(n - 1, 1.0)),
                Frame::body(tip, Vector3::zeros()),
            ],
            stretch: RowLaw::RIGID,
        };
        scene.add_constraint("tip", Constraint::Spherical(hold), 0);
        scene.validate()?;
        Ok(scene)
    }

    /// Ends of the segments as the scene's bodies stand \[m].
    pub(super) fn read(&self, scene: &Scene) -> Shape {
        let n = self.segments();
        let half = |i: usize| {
            let along = scene.bodies.orientation[i] * Vector3::z();
            (along, along * (0.5 * self.chord(i).norm()))
        };
        let mut ends = vec![scene.bodies.position[0] - half(0).1];
        ends.extend((0..n).map(|i| scene.bodies.position[i] + half(i).1));
        Shape {
            ends,
            tangent: half(n - 1).0,
        }
    }

    /// The shape that the scene comes to rest in.
    pub(super) fn settled(&self) -> Result<Shape, ExperimentError> {
        Ok(self.read(&settle(self.scene()?)?))
    }

    /// The exact shape, with all loads raised in `steps` steps. `None` where Newton's method does not converge.
    pub(in crate::hard) fn exact(&self, steps: usize) -> Option<Shape> {
        let mut moment = Vector3::zeros();
        for k in 1..=steps {
            let load = k as f64 / steps as f64;
            moment = shoot(moment, |m| Some(self.follow(m, load)?.1))?;
        }
        Some(self.follow(moment, 1.0)?.0)
    }

    /// The shape for a moment at the clamp, and the moment left at the tip, under the part `load` of the loads.
    fn follow(&self, mut moment: Vector3<f64>, load: f64) -> Option<(Shape, Vector3<f64>)> {
        let n = self.segments();
        let weight = |mass: f64| self.gravity * (mass * load);
        let mut force = self.force * load + weight(self.tip_mass);
        force += weight(self.masses.iter().sum());
        let mut turned = Rotation3::identity();
        let mut end = self.nodes[0];
        let mut ends = Vec::with_capacity(n + 1);
        let mut tangent = self.clamp;
        for (j, joint) in self.joints.iter().enumerate() {
            let u = (turned * self.axes(j)).column(0).into_owned();
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
pub(in crate::hard) fn shoot(
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

    #[test]
    fn a_joint_turns_as_the_model_s_rows_say() {
        let joint = Compliance::of(1.0, 2.0, 3.0);
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
        let mut rod = Rod::midpoints(n);
        rod.force = Vector3::new(0.0, 3e-6, 0.0);
        let tip = rod.exact(1).expect("a shape").tip();
        let exact = 1e-6 * (1.0 - 1.0 / (4.0 * 144.0));
        assert!((tip.y / exact - 1.0).abs() < 1e-9, "{tip}");
    }
}
