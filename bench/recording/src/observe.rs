//! From a stepper to the layout of its scene, and to the numbers of a frame.

use crate::layout::{Body, Cable, Channel, Layout, Line, Point, Shape, Sheave, Solid};
use nalgebra::{UnitQuaternion, Vector3};
use taut_integrator::Stepper;
use taut_measure::columns;
use taut_measure::quantities::{OF_RUN, OfRun};
use taut_measure::trajectory::Sample;
use taut_model::collide::{self, Collider};
use taut_model::{Constraint, Loads, Motion, Scene, SheaveContact, Side, axes_along};

/// Value of one count of a quaternion component.
const TURN: f32 = 1.0 / 32767.0;

/// Quantities of a run that frames hold elsewhere, or that a frame has no number for.
const NOT_RECORDED: [&str; 5] = ["time", "load_x", "load_y", "load_z", "events"];

type OfLoads = fn(&Loads) -> Option<f64>;

/// Loads of a constraint, with units; the first three colour segments.
const OF_LOADS: [(&str, &str, OfLoads); 4] = [
    ("tension", "N", |l| l.tension),
    ("bending", "N m", |l| l.bending),
    ("twist", "N m", |l| l.twist),
    ("drive", "N", |l| l.drive),
];

/// Where channels come from, in their order.
#[derive(Debug, Clone, Copy)]
enum Source {
    Run(OfRun),
    /// Seven channels.
    Pose(usize),
    /// One for each quantity that the constraint has.
    Loads(usize, [bool; OF_LOADS.len()]),
    /// Length of a cable off its drums, and that of its first segment.
    Length(usize),
    First(usize),
    /// Three: where a point of the world is.
    Moved(usize, usize),
    /// Two: where a cable touches a sheave.
    SheaveAngles(usize, usize),
    Control(usize),
}

/// The layout of a scene, and where its channels come from.
#[derive(Debug, Default)]
pub struct Observer {
    pub layout: Layout,
    sources: Vec<Source>,
    /// Names of the scene's bodies and constraints, which change with it.
    names: [Vec<String>; 2],
    colliders: usize,
}

impl Observer {
    /// Layout of the stepper's scene in its current state.
    pub fn new(stepper: &Stepper) -> Self {
        let scene = stepper.scene();
        let mut new = Self {
            names: [&scene.body_names, &scene.constraint_names].map(Clone::clone),
            colliders: scene.colliders.len(),
            ..Self::default()
        };
        let recorded = |name: &&str| !NOT_RECORDED.contains(name);
        for (name, unit, of) in OF_RUN.into_iter().filter(|(name, ..)| recorded(name)) {
            new.channel(name, unit);
            new.sources.push(Source::Run(of));
        }
        let loads = new.constraints(stepper);
        new.bodies(scene, &loads);
        new.cables(scene, &loads);
        for (c, constraint) in scene.constraints.iter().enumerate() {
            new.points(scene, c, constraint, loads[c][0]);
        }
        for (i, control) in scene.controls.iter().enumerate() {
            new.channel(&control.name, "");
            new.sources.push(Source::Control(i));
        }
        let world = scene.colliders.iter().filter(|c| c.body.is_none());
        new.layout.world = world.map(solid).collect();
        new.layout.load = scene.load.or_else(|| scene.bodies.len().checked_sub(1));
        new
    }

    /// True if bodies, constraints, colliders and load are still those of the layout.
    pub fn fits(&self, scene: &Scene) -> bool {
        let load = scene.load.or_else(|| scene.bodies.len().checked_sub(1));
        let [bodies, constraints] = &self.names;
        *bodies == scene.body_names
            && *constraints == scene.constraint_names
            && self.colliders == scene.colliders.len()
            && self.layout.load == load
    }

    fn channel(&mut self, name: &str, unit: &str) -> usize {
        self.layout.channels.push(Channel {
            name: name.to_owned(),
            unit: unit.to_owned(),
            step: None,
        });
        self.layout.channels.len() - 1
    }

    /// Channels of what each constraint carries: their numbers.
    fn constraints(&mut self, stepper: &Stepper) -> Vec<[Option<usize>; OF_LOADS.len()]> {
        let scene = stepper.scene();
        let mut all = Vec::new();
        for (c, name) in scene.constraint_names.iter().enumerate() {
            let loads = stepper.loads(c).unwrap_or_default();
            let has = OF_LOADS.map(|(.., of)| of(&loads).is_some());
            let turns = matches!(scene.constraints[c], Constraint::Hinge(_));
            let mut own = [None; OF_LOADS.len()];
            for (k, (quantity, unit, _)) in OF_LOADS.iter().enumerate().filter(|(k, _)| has[*k]) {
                let unit = if turns && *quantity == "drive" {
                    "N m"
                } else {
                    unit
                };
                own[k] = Some(self.channel(&format!("{name}.{quantity}"), unit));
            }
            self.sources.push(Source::Loads(c, has));
            if columns::length(stepper, c).is_some() {
                self.channel(&format!("{name}.length"), "m");
                self.sources.push(Source::Length(c));
            }
            all.push(own);
        }
        all
    }

    fn bodies(&mut self, scene: &Scene, loads: &[[Option<usize>; OF_LOADS.len()]]) {
        for (i, name) in scene.body_names.iter().enumerate() {
            let pose = self.layout.channels.len();
            for quantity in ["x", "y", "z"] {
                self.channel(&format!("{name}.{quantity}"), "m");
            }
            for quantity in ["qw", "qx", "qy", "qz"] {
                let k = self.channel(&format!("{name}.{quantity}"), "");
                self.layout.channels[k].step = Some(TURN);
            }
            self.sources.push(Source::Pose(i));
            let cable = scene.cables.iter().find(|c| c.bodies.contains(&i));
            let joints = cable.map_or(&[][..], |cable| &cable.joints);
            let holds = |c: &&usize| {
                scene.constraints[**c]
                    .frames()
                    .iter()
                    .any(|f| f.body_index() == Some(i))
            };
            let joints: Vec<usize> = joints.iter().filter(holds).copied().collect();
            let solids = match cable {
                Some(_) => vec![self.segment(scene, i, &joints)],
                None => solids(scene, i),
            };
            let dynamic = scene.bodies.is_dynamic(i);
            self.layout.bodies.push(Body {
                name: name.clone(),
                pose,
                mass: if dynamic {
                    scene.bodies.mass[i] as f32
                } else {
                    0.0
                },
                solids,
                loads: [0, 1, 2].map(|k| joints.iter().filter_map(|c| loads[*c][k]).collect()),
            });
        }
    }

    /// A segment of a cable, from one of its joints to the other.
    fn segment(&mut self, scene: &Scene, body: usize, joints: &[usize]) -> Solid {
        let frames = joints.iter().flat_map(|c| scene.constraints[*c].frames());
        let mut ends = frames
            .filter(|f| f.body_index() == Some(body))
            .map(|f| f.point);
        let first = ends.next().unwrap_or_default();
        let last = ends.next().unwrap_or(-first);
        let leads = |c: &&usize| matches!(&scene.constraints[**c], Constraint::Fairlead(_));
        let lead = joints.iter().find(leads).copied();
        let mass = scene.bodies.mass[body];
        let axis = (last - first).try_normalize(0.0).unwrap_or(Vector3::z());
        let about = axis.dot(&(scene.bodies.inertia[body] * axis));
        // A rod of radius r has the moment of inertia ½ m r² about its axis.
        let radius = (2.0 * about / mass).sqrt();
        let length = lead.map(|c| {
            let name = format!("{}.first", scene.constraint_names[c]);
            self.sources.push(Source::First(c));
            self.channel(&name, "m")
        });
        Solid {
            shape: Shape::Capsule {
                length: (last - first).norm() as f32,
                radius: radius as f32,
            },
            at: (0.5 * (first + last)).map(|x| x as f32).into(),
            turn: turn(&axis),
            length,
        }
    }

    fn cables(&mut self, scene: &Scene, loads: &[[Option<usize>; OF_LOADS.len()]]) {
        for cable in &scene.cables {
            self.layout.cables.push(Cable {
                name: cable.name.clone(),
                bodies: cable.bodies.clone(),
                tensions: cable.joints.iter().filter_map(|c| loads[*c][0]).collect(),
            });
        }
    }

    /// The line of what pulls along one, and points of the world that joints hold on to.
    fn points(&mut self, scene: &Scene, c: usize, constraint: &Constraint, tension: Option<usize>) {
        let name = &scene.constraint_names[c];
        if matches!(constraint, Constraint::LinkBend(_)) {
            return;
        }
        let cable = constraint.massless_cable();
        let sheaves = cable.map_or(&[][..], |cable| &cable.sheaves);
        let mut points = Vec::new();
        for (side, frame) in constraint.frames().iter().enumerate() {
            let moved = matches!(frame.side, Side::World(motion) if motion != Motion::Fixed);
            let moved = moved.then(|| {
                self.sources.push(Source::Moved(c, side));
                let [first, ..] =
                    ["x", "y", "z"].map(|q| self.channel(&format!("{name}.point-{side}.{q}"), "m"));
                first
            });
            let wheel = sheaves.get(side).copied().flatten();
            let sheave = wheel.map(|wheel| {
                self.sources.push(Source::SheaveAngles(c, side));
                let angles = ["arriving", "leaving"]
                    .map(|q| self.channel(&format!("{name}.sheave-{side}.{q}"), "rad"));
                Sheave {
                    radius: wheel.radius as f32,
                    axes: [1, 2].map(|k| frame.axes.column(k).map(|x| x as f32).into()),
                    angles: angles[0],
                }
            });
            points.push(Point {
                body: frame.body_index(),
                at: frame.point.map(|x| x as f32).into(),
                moved,
                sheave,
            });
        }
        if constraint.link_length().is_some() {
            self.layout.lines.push(Line {
                name: name.clone(),
                points,
                tension,
            });
        } else {
            let of_world = points.into_iter().filter(|p| p.body.is_none());
            self.layout.anchors.extend(of_world);
        }
    }

    /// Adds the numbers of a frame: one a channel, turns as counts that go on from those of the frame before, all others as the
    /// bits of single-precision numbers.
    pub fn observe(
        &self,
        stepper: &Stepper,
        sample: &Sample,
        before: &[i32],
        values: &mut Vec<i32>,
    ) {
        let (scene, begun) = (stepper.scene(), values.len());
        for source in &self.sources {
            match *source {
                Source::Run(of) => put(values, [of(sample).unwrap_or(f64::NAN)]),
                Source::Pose(i) => {
                    put(values, scene.bodies.position[i].into());
                    let at = values.len() - begun;
                    let last = before.get(at..at + 4).and_then(|last| last.try_into().ok());
                    values.extend(counts(&scene.bodies.orientation[i], last));
                }
                Source::Loads(c, has) => {
                    let loads = stepper.loads(c).unwrap_or_default();
                    for ((.., of), _) in OF_LOADS.iter().zip(has).filter(|(_, has)| *has) {
                        put(values, [of(&loads).unwrap_or(f64::NAN)]);
                    }
                }
                Source::Length(c) => {
                    put(values, [columns::length(stepper, c).unwrap_or(f64::NAN)]);
                }
                Source::First(c) => put(values, [first(&scene.constraints[c])]),
                Source::Moved(c, side) => {
                    let frame = &scene.constraints[c].frames()[side];
                    let at = frame.resolve(&scene.bodies, stepper.time());
                    put(values, at.point().into());
                }
                Source::SheaveAngles(c, side) => {
                    put(values, sheave_angles(&scene.constraints[c], side))
                }
                Source::Control(i) => put(values, [scene.control_value(i).unwrap_or(f64::NAN)]),
            }
        }
    }
}

/// Adds the ten integers of each contact that carries a force: two bodies and those that share it with them, −1 for none, where
/// it is \[m], and the force on the first side \[N], as bits of single-precision numbers.
pub fn observe_contacts(stepper: &Stepper, contacts: &mut Vec<i32>) {
    for contact in stepper.contacts().filter(|c| c.force.amax() != 0.0) {
        let number = |body: Option<usize>| body.map_or(-1, |i| i as i32);
        contacts.extend(contact.bodies.map(number));
        contacts.extend(contact.partners.map(number));
        put(contacts, contact.point.into());
        put(contacts, contact.force.into());
    }
}

fn put<const N: usize>(values: &mut Vec<i32>, numbers: [f64; N]) {
    values.extend(numbers.map(|x| (x as f32).to_bits() as i32));
}

/// A turn in counts of [`TURN`]; of its two quaternions the one nearer to the last.
fn counts(turn: &UnitQuaternion<f64>, last: Option<[i32; 4]>) -> [i32; 4] {
    let counts = [turn.w, turn.i, turn.j, turn.k].map(|x| (x / f64::from(TURN)).round() as i32);
    let nearer = |last: [i32; 4]| -> i64 {
        let pairs = last.into_iter().zip(counts);
        pairs.map(|(a, b)| i64::from(a) * i64::from(b)).sum()
    };
    let other = last.is_some_and(|last| nearer(last) < 0);
    counts.map(|x| if other { -x } else { x })
}

fn first(constraint: &Constraint) -> f64 {
    match constraint {
        Constraint::Fairlead(lead) => lead.first,
        _ => f64::NAN,
    }
}

fn sheave_angles(constraint: &Constraint, side: usize) -> [f64; 2] {
    match constraint {
        Constraint::MasslessCable(cable) => match cable.sheaves.get(side) {
            Some(Some(sheave)) if let SheaveContact::On { arriving, leaving } = sheave.contact => {
                [arriving, leaving]
            }
            _ => [f64::NAN; 2],
        },
        _ => [f64::NAN; 2],
    }
}

/// The turn from z to a direction, scalar first.
fn turn(axis: &Vector3<f64>) -> [f32; 4] {
    // With the axes of a frame along it: v, w and the direction itself.
    let axes = axes_along(axis).unwrap_or_default();
    let columns = [1, 2, 0].map(|k| axes.column(k).into_owned());
    quaternion(&UnitQuaternion::from_basis_unchecked(&columns))
}

fn quaternion(turn: &UnitQuaternion<f64>) -> [f32; 4] {
    [turn.w, turn.i, turn.j, turn.k].map(|x| x as f32)
}

fn solid(collider: &Collider) -> Solid {
    let shape = match collider.shape {
        collide::Shape::Sphere { radius } => Shape::Sphere {
            radius: radius as f32,
        },
        collide::Shape::Cuboid { size } => Shape::Box {
            size: size.map(|x| x as f32).into(),
        },
        collide::Shape::Capsule { length, radius } => Shape::Capsule {
            length: length as f32,
            radius: radius as f32,
        },
        collide::Shape::Cylinder { length, radius } => Shape::Cylinder {
            length: length as f32,
            radius: radius as f32,
        },
        collide::Shape::HalfSpace => Shape::Ground,
        _ => Shape::Point,
    };
    Solid {
        shape,
        at: collider.position.map(|x| x as f32).into(),
        turn: quaternion(&collider.orientation),
        length: None,
    }
}

/// Shapes of a body that does not belong to a cable of segments: its colliders, or else the ball or
/// box of its mass and inertia.
fn solids(scene: &Scene, body: usize) -> Vec<Solid> {
    let own = scene.colliders.iter().filter(|c| c.body == Some(body));
    let own: Vec<Solid> = own.map(solid).collect();
    if !own.is_empty() {
        return own;
    }
    let (mass, inertia) = (scene.bodies.mass[body], &scene.bodies.inertia[body]);
    let about = inertia.diagonal();
    let shape = if !scene.bodies.is_dynamic(body) || scene.bodies.is_point(body) {
        Shape::Point
    } else if about.max() - about.min() <= 1e-6 * about.max() {
        Shape::Sphere {
            radius: (2.5 * about.x / mass).sqrt() as f32,
        }
    } else {
        // I_x = m (s_y² + s_z²)/12.
        let square = |k: usize| 6.0 * (about.sum() - 2.0 * about[k]) / mass;
        Shape::Box {
            size: [0, 1, 2].map(|k| square(k).max(0.0).sqrt() as f32),
        }
    };
    vec![Solid {
        shape,
        at: [0.0; 3],
        turn: [1.0, 0.0, 0.0, 0.0],
        length: None,
    }]
}
