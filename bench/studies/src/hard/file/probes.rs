//! Quantities of a whole scene that the files of cases see in each step, beside the columns of `taut run`.

use super::rod::{Rod, Shape};
use crate::hard::worse;
use crate::rest::{Reading, read};
use nalgebra::{UnitQuaternion, Vector3};
use std::cell::OnceCell;
use taut_integrator::{StepReport, Stepper};
use taut_measure::modes::natural;
use taut_model::{Constraint, Scene};

/// A body, and where it has to be \[m].
pub(super) type Placed = (usize, Vector3<f64>);

/// A step as it is seen: the stepper, its report, and the scene at the beginning.
pub(super) struct Seen<'a> {
    pub(super) stepper: &'a Stepper,
    /// `None` at the beginning.
    pub(super) report: Option<&'a StepReport>,
    pub(super) first: &'a Scene,
    pub(super) swing: Option<&'a Swing>,
    pub(super) places: &'a [Placed],
    /// The scene before it comes to rest.
    pub(super) laid: &'a Scene,
    /// The exact shape of the clamped chain that it is then, once something asks for it.
    pub(super) shape: &'a OnceCell<Option<Shape>>,
    /// Angles of cables about the sheaves with friction, before the step \[rad].
    pub(super) wraps: &'a [f64],
}

/// A coordinate of a body, and how the body is turned at rest.
pub(super) struct Swing {
    pub(super) body: usize,
    /// Along x, y, z or about them.
    pub(super) coordinate: usize,
    pub(super) rest: UnitQuaternion<f64>,
}

impl Swing {
    fn value(&self, scene: &Scene) -> f64 {
        let bodies = &scene.bodies;
        match self.coordinate.checked_sub(3) {
            None => bodies.position[self.body][self.coordinate],
            Some(axis) => (bodies.orientation[self.body] * self.rest.inverse()).scaled_axis()[axis],
        }
    }
}

impl Seen<'_> {
    /// A figure of the report; NaN at the beginning.
    fn said(&self, of: fn(&StepReport) -> f64) -> f64 {
        self.report.map_or(f64::NAN, of)
    }

    fn scene(&self) -> &Scene {
        self.stepper.scene()
    }

    /// Tension of a part of a cable without mass.
    fn part_tension(&self, c: usize) -> Option<f64> {
        let constraint = &self.scene().constraints[c];
        let is_part = matches!(constraint, Constraint::MasslessCable(_));
        is_part.then(|| self.stepper.tension(c)).flatten()
    }

    /// Largest excess of a tension behind or before a sheave over e^(μθ) of the other one, relative.
    fn beyond_grip(&self) -> f64 {
        let capstans = self.scene().capstans.iter().zip(self.wraps);
        let beyond = capstans.map(|(capstan, wrap)| {
            let grip = (capstan.friction * wrap).exp();
            let [a, b] = capstan.parts.map(|c| self.part_tension(c).unwrap_or(0.0));
            let beyond = (a - grip * b).max(b - grip * a);
            beyond / a.max(b).max(f64::MIN_POSITIVE)
        });
        beyond.fold(0.0, worse)
    }

    fn angular_momentum(&self) -> Vector3<f64> {
        self.scene().angular_momentum(&Vector3::zeros())
    }

    /// A figure of the exact shape of a clamped chain.
    fn chain(&self, of: impl Fn(&Shape) -> f64) -> f64 {
        let exact = self.shape.get_or_init(|| Rod::of(self.laid).exact(20));
        exact.as_ref().map_or(f64::NAN, of)
    }

    /// Largest distance of an end of a segment of a clamped chain from its place in the exact shape.
    fn off_chain(&self) -> f64 {
        let ends = Rod::of(self.laid).ends(self.scene(), &self.laid.body_names);
        let Some(ends) = ends else { return f64::NAN };
        self.chain(|exact| {
            let pairs = ends.iter().zip(&exact.ends);
            pairs.fold(0.0, |all, (a, b)| worse(all, (a - b).norm()))
        })
    }

    /// What the joints of a specimen read, whose last body is its grip.
    fn readings(&self, of: fn(&Reading) -> f64) -> Vec<f64> {
        let scene = self.scene();
        read(scene, scene.bodies.len() - 1).iter().map(of).collect()
    }

    /// Their largest error beside equal shares of their sum, relative; those at the ends have half a share.
    fn off_shares(&self, of: fn(&Reading) -> f64) -> f64 {
        let found = self.readings(of);
        let (last, share) = (
            found.len() - 1,
            found.iter().sum::<f64>() / (found.len() - 1) as f64,
        );
        let half = |j: usize| if j == 0 || j == last { 0.5 } else { 1.0 };
        let errors = found.iter().enumerate();
        errors.fold(0.0, |all, (j, x)| {
            worse(all, (x / (half(j) * share) - 1.0).abs())
        })
    }

    /// The largest of what `of` measures of a body's place.
    fn widest(&self, of: fn(&Vector3<f64>) -> f64) -> f64 {
        self.scene().bodies.position.iter().map(of).fold(0.0, worse)
    }

    /// The largest turn of a body from what it was in a scene.
    fn turned(&self, from: &Scene) -> f64 {
        let turns = self.scene().bodies.orientation.iter();
        let turns = turns.zip(&from.bodies.orientation);
        turns.map(|(q, q0)| q.angle_to(q0)).fold(0.0, worse)
    }

    /// The largest way of a body from its place at the beginning, as `of` measures it.
    fn farthest(&self, of: fn(Vector3<f64>) -> f64) -> f64 {
        let first = &self.first.bodies.position;
        let ways = self.scene().bodies.position.iter().zip(first);
        ways.map(|(x, x0)| of(x - x0)).fold(0.0, worse)
    }
}

/// A quantity: its name, unit and value.
pub(super) type Probe = (&'static str, &'static str, fn(&Seen<'_>) -> f64);

pub(super) const PROBES: &[Probe] = &[
    // Largest way of a body from its beginning, and its level part.
    ("farthest", "m", |s| s.farthest(|way| way.norm())),
    ("drift", "m", |s| s.farthest(|way| way.xy().norm())),
    // Largest turn of a body from its beginning, and from where it was before the scene came to rest.
    ("turned", "rad", |s| s.turned(s.first)),
    ("turned_to_rest", "rad", |s| s.turned(s.laid)),
    // Largest distance of a body from the x axis.
    ("off_axis", "m", |s| s.widest(|x| x.yz().norm())),
    ("off_plane", "m", |s| s.widest(|x| x.z.abs())),
    // The largest distance of a body from where it has to be, and the lowest point of a joint.
    ("misplaced", "m", |s| {
        let bodies = &s.scene().bodies.position;
        let off = s
            .places
            .iter()
            .map(|(body, place)| (bodies[*body] - place).norm());
        off.reduce(worse).unwrap_or(f64::NAN)
    }),
    ("lowest", "m", |s| {
        let frames = s.scene().constraints.iter().flat_map(Constraint::frames);
        let depths = frames.map(|frame| -frame.resolve(&s.scene().bodies, 0.0).point().z);
        -depths.fold(0.0, worse)
    }),
    // Modes of the scene as it stands that grow, but for free motions; their ω² is above 10⁻² 1/s².
    ("unstable", "", |s| {
        let modes = natural(s.scene(), &[0, 1, 2, 3, 4, 5]);
        let squares = modes.map_or_else(Vec::new, |modes| modes.squares);
        squares.iter().filter(|square| **square < -1e-2).count() as f64
    }),
    // Tip of the exact chain that the scene is before it comes to rest, and slope there; largest distance of a segment's end
    // from it; way of the tip under a small load; slope of the last segment but the tip.
    ("chain_x", "m", |s| s.chain(|shape| shape.tip().x)),
    ("chain_y", "m", |s| s.chain(|shape| shape.tip().y)),
    ("chain_z", "m", |s| s.chain(|shape| shape.tip().z)),
    ("chain_slope", "rad", |s| {
        s.chain(|shape| shape.tangent.y.atan2(shape.tangent.x))
    }),
    ("off_chain", "m", |s| s.off_chain()),
    ("chain_levers", "m", |s| Rod::of(s.laid).by_levers()),
    ("slope", "rad", |s| {
        let turns = &s.scene().bodies.orientation;
        let along = turns[turns.len() - 2] * Vector3::z();
        along.y.atan2(along.x)
    }),
    // Of all joints of a specimen: gaps, bends and twists; how far a gap or twist is from its share.
    ("gaps", "m", |s| s.readings(|j| j.gap).iter().sum()),
    ("bends", "rad", |s| s.readings(|j| j.bend).iter().sum()),
    ("twists", "rad", |s| s.readings(|j| j.twist).iter().sum()),
    ("gap_shares", "", |s| s.off_shares(|j| j.gap)),
    ("twist_shares", "", |s| s.off_shares(|j| j.twist)),
    ("load_mass", "kg", |s| {
        let load = s.scene().load;
        load.map_or(f64::NAN, |load| s.scene().bodies.mass[load])
    }),
    // Turn of the first body.
    ("turn_x", "rad", |s| {
        s.scene().bodies.orientation[0].scaled_axis().x
    }),
    ("turn_z", "rad", |s| {
        s.scene().bodies.orientation[0].scaled_axis().z
    }),
    // Mean over all bodies.
    ("speed", "m/s", |s| {
        let all = &s.scene().bodies.velocity;
        let sum: f64 = all.iter().map(Vector3::norm_squared).sum();
        (sum / all.len() as f64).sqrt()
    }),
    ("momentum_x", "kg m/s", |s| s.scene().momentum().x),
    ("momentum_y", "kg m/s", |s| s.scene().momentum().y),
    ("momentum_z", "kg m/s", |s| s.scene().momentum().z),
    // About the origin.
    ("angular_x", "kg m²/s", |s| s.angular_momentum().x),
    ("angular_y", "kg m²/s", |s| s.angular_momentum().y),
    ("angular_z", "kg m²/s", |s| s.angular_momentum().z),
    // Angular velocity of the first body about its own second axis.
    ("own_spin", "rad/s", |s| {
        let bodies = &s.scene().bodies;
        (bodies.orientation[0].inverse() * bodies.angular_velocity[0]).y
    }),
    // Energy of the state, and the stepper's, at the instant that its forces belong to.
    ("state_energy", "J", |s| {
        s.scene().kinetic_energy() + s.scene().potential_energy()
    }),
    ("height_energy", "J", |s| s.scene().potential_energy()),
    ("energy", "J", |s| s.stepper.energy().total()),
    ("motion_energy", "J", |s| s.stepper.energy().kinetic),
    ("position_energy", "J", |s| s.stepper.energy().gravity),
    // Vertical part of what the world's shapes exert.
    ("borne_z", "N", |s| borne(s.stepper).z),
    ("load_on_ground", "N", |s| s.said(|r| r.contacts.load)),
    // Gap of the scene's first row.
    ("first_gap", "m", |s| {
        s.stepper.linearized().phi.first().copied().unwrap_or(0.0)
    }),
    // Angle about the first sheave with friction before the step, and the largest excess over e^(μθ) on all.
    ("wrap", "rad", |s| {
        s.wraps.first().copied().unwrap_or(f64::NAN)
    }),
    ("beyond_grip", "", |s| s.beyond_grip()),
    ("slipping", "", |s| {
        s.said(|r| f64::from(u8::from(r.slipping > 0)))
    }),
    // Sum over all parts of cables without mass.
    ("all_tensions", "N", |s| {
        let constraints = 0..s.scene().constraints.len();
        constraints.filter_map(|c| s.part_tension(c)).sum()
    }),
    // Joint in the middle of the first cable of segments.
    ("middle_x", "m", |s| middle(s.scene()).x),
    ("middle_z", "m", |s| middle(s.scene()).z),
    // Energy from nowhere, over that of the motion and in all, where the step keeps a balance of it.
    ("excess", "", |s| {
        s.said(|r| r.balance.map_or(f64::NAN, |b| b.excess))
    }),
    ("from_nowhere", "J", |s| {
        s.said(|r| r.balance.map_or(f64::NAN, |b| b.gained - b.work))
    }),
    // Largest coordinate of the natural oscillation that the run started in.
    ("mode", "m", |s| {
        s.swing.map_or(f64::NAN, |swing| swing.value(s.scene()))
    }),
    // Largest relative error of a pile's normal forces.
    ("interfaces", "", |s| interfaces(s.stepper)),
    // Largest penetration, and violations of the conditions on contacts.
    ("deepest", "m", |s| s.said(|r| r.contacts.deepest)),
    ("complementarity", "", |s| {
        s.said(|r| r.contacts.complementarity)
    }),
    ("cone", "", |s| s.said(|r| r.contacts.cone)),
    // 1 in steps with something undecided, redone by the guard, or left to Newton's fall-backs; parts of a divided one.
    ("undecided", "", |s| {
        s.said(|r| f64::from(u8::from(r.undecided > 0)))
    }),
    ("redone", "", |s| s.said(|r| f64::from(u8::from(r.redone)))),
    ("fallbacks", "", |s| {
        s.said(|r| f64::from(u8::from(r.contacts.fallbacks > 0)))
    }),
    ("divided", "", |s| s.said(|r| r.divided as f64)),
    ("solves", "", |s| s.said(|r| r.solves as f64)),
    ("implicit_substeps", "", |s| {
        s.said(|r| r.implicit_substeps as f64)
    }),
    ("unconverged", "", |s| {
        s.said(|r| r.unconverged_substeps as f64)
    }),
];

/// The resultant of what the world's shapes exert \[N].
fn borne(stepper: &Stepper) -> Vector3<f64> {
    let forces = stepper
        .contacts()
        .filter_map(|contact| match contact.bodies {
            [None, Some(_)] => Some(-contact.force),
            [Some(_), None] => Some(contact.force),
            _ => None,
        });
    forces.sum()
}

/// The joint in the middle of the first cable of segments \[m].
fn middle(scene: &Scene) -> Vector3<f64> {
    let joints = scene.cables.first().map_or(&[][..], |c| &c.joints);
    let joint = joints.get(joints.len() / 2).map(|c| &scene.constraints[*c]);
    joint.map_or(Vector3::repeat(f64::NAN), |joint| {
        joint.frames()[1].resolve(&scene.bodies, 0.0).point()
    })
}

/// Largest relative error of the normal forces in a pile of bodies on the ground, each on the one before, beside the weight
/// of all that stands above.
fn interfaces(stepper: &Stepper) -> f64 {
    let (scene, masses) = (stepper.scene(), &stepper.scene().bodies.mass);
    let mut found = vec![0.0; masses.len()];
    for contact in stepper.contacts() {
        // The higher body of the two: the ground is none.
        if let Some(upper) = contact.bodies.into_iter().flatten().max() {
            found[upper] += contact.force.dot(&contact.normal).abs();
        }
    }
    let above = |k: usize| scene.gravity.norm() * masses[k..].iter().sum::<f64>();
    let errors = found.iter().enumerate();
    errors.fold(0.0, |all, (k, n)| worse(all, (n / above(k) - 1.0).abs()))
}
