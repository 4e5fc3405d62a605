//! Angular rows of the joints from half angles in 32 digits, without the model's own formulas.
//!
//! The relative rotation of a joint is swing after twist, q = q_s q_t with q_t about u. Bend rows are the components of
//! the swing's rotation vector on v and w, the twist row is the twist's angle, the rotation rows of locks and sliders
//! are the rotation vector of q.

use super::extended::{
    Q, V, about, angle, atan2, conjugate, cross, dd, dot, minus, norm, normalized, plus, rotated,
    scaled, sqrt, tau, times, unit,
};
use std::f64::consts::{FRAC_PI_2, PI};
use taut_measure::errors::worse;
use taut_solver::DoubleDouble as Dd;
use taut_tests::prelude::*;

/// A law that is not looked at.
const LAW: RowLaw = RowLaw::new(1e-6, 0.0);

/// The kinds of joint that measure angles: the paper's twist is between v and w, its alternative between v and v.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Cosserat,
    Hinge,
    Lock,
    Slider,
    PaperBend,
    PaperTwist,
    PaperAlternative,
    LinkAngle,
    LinkVector,
}

impl Kind {
    pub(super) const ALL: [Self; 9] = [
        Self::Cosserat,
        Self::Hinge,
        Self::Lock,
        Self::Slider,
        Self::PaperBend,
        Self::PaperTwist,
        Self::PaperAlternative,
        Self::LinkAngle,
        Self::LinkVector,
    ];

    /// True if the row loses its direction at the singularity, as an unsigned angle does at zero.
    /// The Jacobian then has no limit.
    pub(super) fn loses_direction(self) -> bool {
        matches!(
            self,
            Self::PaperBend | Self::PaperTwist | Self::PaperAlternative | Self::LinkAngle
        )
    }

    fn is_links(self) -> bool {
        matches!(self, Self::LinkAngle | Self::LinkVector)
    }

    /// Number of its first angular row, and how many there are.
    fn rows(self) -> (usize, usize) {
        match self {
            Self::Cosserat | Self::Hinge | Self::Lock => (3, 3),
            Self::Slider => (0, 3),
            Self::PaperBend | Self::PaperTwist | Self::PaperAlternative => (3, 1),
            Self::LinkAngle => (0, 1),
            Self::LinkVector => (0, 2),
        }
    }

    /// The joint.
    fn constraint(self, frames: [Frame; 2]) -> Constraint {
        let all = JointLaw {
            stretch: Some(LAW),
            bend: Some(LAW),
            twist: Some(LAW),
        };
        let paper = |bends: bool, twist_definition| {
            let law = JointLaw {
                stretch: Some(LAW),
                bend: bends.then_some(LAW),
                twist: (!bends).then_some(LAW),
            };
            Constraint::Paper(Paper {
                twist_definition,
                ..Paper::new(frames, law)
            })
        };
        match self {
            Self::Cosserat => Constraint::Cosserat(Cosserat::new(frames, all)),
            Self::Hinge => Constraint::Hinge(Hinge {
                motor: Some(Motor::speed(0.0).with(|p| p.target = Target::Position(0.0))),
                ..Hinge::new(frames)
            }),
            Self::Lock => Constraint::Lock(Lock {
                frames,
                linear: LAW,
                angular: LAW,
            }),
            Self::Slider => Constraint::Slider(Slider::new(frames)),
            Self::PaperTwist => paper(false, TwistDefinition::Ordinary),
            Self::PaperAlternative => paper(false, TwistDefinition::Alternative),
            _ => paper(true, TwistDefinition::Ordinary),
        }
    }

    /// φ of its angular rows for the relative rotation `q`.
    fn measured(self, q: &Q) -> Vec<Dd> {
        match self {
            Self::Cosserat | Self::Hinge => swing_twist(q).to_vec(),
            Self::Lock | Self::Slider => rotation_vector(q).to_vec(),
            Self::PaperBend => vec![angle(&axis(0), &rotated(q, &axis(0)))],
            Self::PaperTwist => vec![signed(q, 2)],
            _ => vec![signed(q, 1)],
        }
    }
}

fn axis(k: usize) -> V {
    let mut v = [dd(0.0); 3];
    v[k] = dd(1.0);
    v
}

/// Components of the swing on v and w, twist about u.
fn swing_twist(q: &Q) -> [Dd; 3] {
    let [q0, q1, q2, q3] = *q;
    let cosine = sqrt(q0 * q0 + q1 * q1);
    let (c, s) = (q0 / cosine, q1 / cosine);
    let (y, z) = (q2 * c - q3 * s, q3 * c + q2 * s);
    let sine = sqrt(q2 * q2 + q3 * q3);
    let theta = dd(2.0) * atan2(sine, cosine);
    let twist = dd(2.0) * atan2(q1, q0);
    if sine.to_f64() == 0.0 {
        return [dd(0.0), dd(0.0), twist];
    }
    [theta * y / sine, theta * z / sine, twist]
}

fn rotation_vector(q: &Q) -> V {
    let q = if q[0].to_f64() < 0.0 {
        q.map(|x| -x)
    } else {
        *q
    };
    let v = [q[1], q[2], q[3]];
    let sine = norm(&v);
    scaled(&v, dd(2.0) * atan2(sine, q[0]) / sine)
}

/// Angle from v_a to an axis of b with the sign of the turn about u, up to a constant.
fn signed(q: &Q, of_b: usize) -> Dd {
    let (p, b) = (axis(1), rotated(q, &axis(of_b)));
    let along = dot(&cross(&p, &b), &plus(&axis(0), &rotated(q, &axis(0))));
    let found = angle(&p, &b);
    if along.to_f64() < 0.0 { -found } else { found }
}

/// φ of two links from p₀ to p₁ and on to p₂.
fn links(kind: Kind, points: &[V; 3]) -> Vec<Dd> {
    let [e1, e2] = [0, 1].map(|k| unit(&minus(&points[k + 1], &points[k])));
    let theta = angle(&e1, &e2);
    if kind == Kind::LinkAngle {
        return vec![theta];
    }
    let n = unit(&cross(&e1, &e2));
    let t = unit(&plus(&e1, &e2));
    let s = sqrt(t[0] * t[0] + t[2] * t[2]);
    let (x, z) = (t[0] / s, t[2] / s);
    let across = [[z, dd(0.0), -x], [-(t[1] * x), s, -(t[1] * z)]];
    across.map(|a| theta * dot(&n, &a)).to_vec()
}

/// Largest error of the Jacobian at a pose, relative to the row's largest entry: against central differences
/// in 32 digits, extrapolated, whose step is a small part of the distance to the singularity.
pub(super) fn jacobian_error(kind: Kind, theta: f64, pose: &Pose) -> f64 {
    let error = if kind.is_links() {
        links_error
    } else {
        joint_error
    };
    error(kind, theta, pose, step(theta))
}

fn step(theta: f64) -> f64 {
    1e-4 * theta.min(PI - theta).min(1.0)
}

/// Where the joint is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    /// Orientation of a.
    pub(super) turn: UnitQuaternion<f64>,
    /// Direction of the bending, about u from v \[rad].
    pub(super) across: f64,
    /// Twist \[rad].
    pub(super) twist: f64,
}

/// Two bodies, their centres at the joint, and a joint whose axes are the bodies'.
fn pair(kind: Kind, theta: f64, pose: &Pose) -> Scene {
    let mut scene = Scene::new("pair");
    let n = Vector3::new(0.0, pose.across.cos(), pose.across.sin());
    let (bend, twist) = match kind {
        // θ is the angle in all: the axis has no need of a twist beside it.
        Kind::Lock | Kind::Slider => (theta, 0.0),
        // θ is the angle from v_a to w_b or v_b, of an unbent joint.
        Kind::PaperTwist => (0.0, theta - FRAC_PI_2),
        Kind::PaperAlternative => (0.0, theta),
        _ => (theta, pose.twist),
    };
    let relative = UnitQuaternion::from_scaled_axis(n * bend)
        * UnitQuaternion::from_scaled_axis(Vector3::x() * twist);
    for (name, turn) in [("a", pose.turn), ("b", pose.turn * relative)] {
        scene.add_body(name, Body::sphere(1.0, 1.0).turned(turn));
    }
    let frames = [0, 1].map(|i| centre(i).with_axes(Matrix3::identity()));
    scene.add_constraint("joint", kind.constraint(frames), 0);
    scene
}

/// The derivative at 0 of each row.
fn differentiate(phi: impl Fn(Dd) -> Vec<Dd>, step: f64) -> Vec<f64> {
    let central = |h: f64| {
        let slope = move |(p, m): (Dd, Dd)| {
            // An angle that wraps in between.
            let turn = match (p - m).to_f64() {
                d if d > PI => -tau(),
                d if d < -PI => tau(),
                _ => dd(0.0),
            };
            (p - m + turn) / dd(2.0 * h)
        };
        phi(dd(h)).into_iter().zip(phi(dd(-h))).map(slope)
    };
    let extrapolated = |(c, f): (Dd, Dd)| ((dd(4.0) * f - c) / dd(3.0)).to_f64();
    central(step)
        .zip(central(0.5 * step))
        .map(extrapolated)
        .collect()
}

/// Largest error of `found` rows against the `exact` columns, over each row's largest entry.
fn off(found: &[[f64; 3]], exact: &[Vec<f64>; 3]) -> f64 {
    let of_row = |(r, row): (usize, &[f64; 3])| {
        let size = exact.iter().map(|e| e[r].abs()).fold(0.0, f64::max);
        let errors = row.iter().zip(exact).map(|(x, e)| (x - e[r]).abs() / size);
        errors.fold(0.0, worse)
    };
    found.iter().enumerate().map(of_row).fold(0.0, worse)
}

/// Largest error of the three columns from `column` on of some sides of the scene's first joint.
fn compared(
    (kind, scene): (Kind, &Scene),
    (sides, column): (usize, usize),
    exact: impl Fn(usize) -> [Vec<f64>; 3],
) -> f64 {
    let mut rows = Linearized::new(scene);
    rows.update(scene, 0.0);
    let (first, count) = kind.rows();
    let of_side = |side: usize| {
        let block = rows.block(side);
        let own = block.rows()[first..first + count].iter();
        let found: Vec<[f64; 3]> = own.map(|r| [0, 1, 2].map(|k| r[column + k])).collect();
        off(&found, &exact(side))
    };
    (0..sides).map(of_side).fold(0.0, worse)
}

fn joint_error(kind: Kind, theta: f64, pose: &Pose, step: f64) -> f64 {
    let scene = pair(kind, theta, pose);
    let both = [0, 1].map(|i| {
        let q = scene.bodies.orientation[i];
        normalized(&[q.w, q.i, q.j, q.k].map(dd))
    });
    compared((kind, &scene), (2, 3), |side| {
        [0, 1, 2].map(|k| {
            let phi = |h: Dd| {
                let mut turned = both;
                turned[side] = times(&about(k, h), &both[side]);
                kind.measured(&times(&conjugate(&turned[0]), &turned[1]))
            };
            differentiate(phi, step)
        })
    })
}

/// The largest change of the exact Jacobian of two links, relative as its errors, where a coordinate of the middle
/// point moves by a rounding: what no Jacobian in doubles is better than. 0 for joints.
pub(super) fn sensitivity(kind: Kind, theta: f64, pose: &Pose) -> f64 {
    if !kind.is_links() {
        return 0.0;
    }
    let step = step(theta);
    let places = link_points(theta, pose).map(|p| [p.x, p.y, p.z].map(dd));
    let of_side = |coordinate: usize, side: usize| {
        let mut rounded = places;
        rounded[1][coordinate] = rounded[1][coordinate] + dd(0.5 * f64::EPSILON);
        let other = link_columns(kind, &rounded, side, step);
        let rows = (0..kind.rows().1).map(|r| [0, 1, 2].map(|k| other[k][r]));
        off(
            &rows.collect::<Vec<_>>(),
            &link_columns(kind, &places, side, step),
        )
    };
    let all = (0..9).map(|k| of_side(k / 3, k % 3));
    all.fold(0.0, f64::max)
}

fn link_points(theta: f64, pose: &Pose) -> [Vector3<f64>; 3] {
    let turn = pose.turn * UnitQuaternion::from_scaled_axis(Vector3::x() * pose.across);
    let bent = UnitQuaternion::from_scaled_axis(Vector3::z() * theta);
    [
        Vector3::zeros(),
        turn * Vector3::x(),
        turn * (Vector3::x() + bent * Vector3::x() * 0.7),
    ]
}

/// The derivatives by the coordinates of one point.
fn link_columns(kind: Kind, places: &[V; 3], side: usize, step: f64) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|k| {
        let phi = |h: Dd| {
            let mut moved = *places;
            moved[side][k] = moved[side][k] + h;
            links(kind, &moved)
        };
        differentiate(phi, step)
    })
}

/// Three particles on two links with the angle `theta`.
fn links_error(kind: Kind, theta: f64, pose: &Pose, step: f64) -> f64 {
    let points = link_points(theta, pose);
    let mut scene = Scene::new("links");
    let frames = points.map(|p| {
        let name = format!("p{}", scene.bodies.len());
        Frame::body(
            scene.add_body(name, Body::particle(1.0).at(p)),
            Vector3::zeros(),
        )
    });
    let definition = match kind {
        Kind::LinkAngle => BendDefinition::Angle,
        _ => BendDefinition::Vector,
    };
    let bend = LinkBend {
        frames,
        law: LAW,
        definition,
    };
    scene.add_constraint("bend", Constraint::LinkBend(bend), 0);
    let places = points.map(|p| [p.x, p.y, p.z].map(dd));
    let exact = |side| link_columns(kind, &places, side, step);
    compared((kind, &scene), (3, 0), exact)
}
