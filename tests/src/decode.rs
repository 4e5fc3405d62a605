//! Arbitrary bytes as numbers, options and scenes: what the fuzzer's bytes stand for.

use crate::prelude::*;
use nalgebra::Quaternion;
use taut_model::named::NAMES;

/// Numbers that programs stumble over.
const AWKWARD: [f64; 14] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    5e-324,
    f64::MIN_POSITIVE,
    1e-160,
    1e160,
    f64::MAX,
    f64::MIN,
    -1.0,
    1e-9,
    1e9,
];

/// Names that a text has to quote.
const ODD: [&str; 5] = ["two words", "a.b", "\"quoted\"\n", "Seil #1 ü", ""];

/// Bytes that are read one after the other; zeros at their end.
#[derive(Debug)]
pub struct Bytes<'a> {
    data: &'a [u8],
    /// One in so many numbers is awkward.
    rarity: u8,
}

impl<'a> Bytes<'a> {
    /// The first byte says how often numbers are awkward.
    pub fn new(data: &'a [u8]) -> Self {
        let mut bytes = Self { data, rarity: 1 };
        bytes.rarity = bytes.byte();
        bytes
    }

    /// The next byte.
    pub fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.data.split_first() else {
            return 0;
        };
        self.data = rest;
        *first
    }

    /// A number below `n`, or 0.
    pub fn below(&mut self, n: usize) -> usize {
        usize::from(self.byte()) % n.max(1)
    }

    /// A double: moderate, awkward, or any.
    pub fn number(&mut self) -> f64 {
        let kind = self.byte();
        if self.rarity == 0 || !kind.is_multiple_of(self.rarity) {
            return (f64::from(kind) - 100.0) / 16.0;
        }
        match self.below(AWKWARD.len() + 1) {
            i if i < AWKWARD.len() => AWKWARD[i],
            _ => f64::from_bits(u64::from_le_bytes([(); 8].map(|()| self.byte()))),
        }
    }

    /// A number that is positive unless it is awkward.
    fn positive(&mut self) -> f64 {
        let x = self.number();
        if x.abs() < 10.0 { x.abs() + 0.01 } else { x }
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.number())
    }

    /// A named scene with some of its parameters set to other numbers.
    ///
    /// # Errors
    /// The errors of the scene for these numbers.
    pub fn named(&mut self) -> Result<SceneSource, SceneError> {
        let name = NAMES[self.below(NAMES.len())];
        let text = SceneSource::load(name, &[])?.to_toml()?;
        let keys: Vec<&str> = (text.lines())
            .filter_map(|line| Some(line.split_once('=')?.0.trim().trim_start_matches("# ")))
            .collect();
        let mut set = Vec::new();
        for _ in 0..self.below(6) {
            let key = keys[self.below(keys.len())];
            let value = match self.byte() % 4 {
                0 => format!("{}", self.byte() % 12),
                1 => ["true", "false", "\"steel\"", "[1, 2, 3]"][self.below(4)].to_owned(),
                _ => format!("{:?}", self.number()).to_lowercase(),
            };
            set.push((key, value));
        }
        let set = set.iter();
        let set: Vec<_> = set.map(|(key, value)| (*key, value.as_str())).collect();
        SceneSource::load(name, &set)
    }

    /// How a scene is stepped.
    pub fn options(&mut self, backends: &[Backend]) -> StepOptions {
        let scheme = match self.byte() % 4 {
            0 => Scheme::ThirdDifference {
                a: self.number(),
                gamma: self.number(),
            },
            kind => Scheme::KINDS[usize::from(kind) - 1],
        };
        let stiffness = match self.byte() % 6 {
            0 => GeometricStiffness::Off,
            1 | 2 => GeometricStiffness::Inertia {
                alpha: self.number(),
            },
            _ => GeometricStiffness::Inertia { alpha: 0.4 },
        };
        let guard = (!self.byte().is_multiple_of(3)).then(|| Guard {
            tolerance: if self.byte().is_multiple_of(4) {
                self.number()
            } else {
                0.005
            },
            hold: self.below(3),
            substeps: self.below(4),
            passes: self.below(8),
            halvings: u32::from(self.byte() % 5),
        });
        let backend = backends[self.below(backends.len())].with_iterations(1 + self.below(60));
        StepOptions {
            dt: if self.byte() % 8 == 7 {
                self.number()
            } else {
                1.0 / 60.0
            },
            substeps: 1 + self.below(2),
            // No byte of its own: the seeds keep their meaning.
            energy_tolerance: guard.map(|g| g.tolerance),
            estimate: guard.map(|g| 2 + g.hold),
            sleep: guard.map(|g| Sleep::default().with(|p| p.distance = g.tolerance)),
            scheme,
            stiffness,
            guard,
            form: {
                // Stood for an option that is no more: the seeds keep their meaning.
                self.byte();
                if self.byte().is_multiple_of(3) {
                    Form::Kkt
                } else {
                    Form::Schur
                }
            },
            elimination: Elimination::ALL[self.below(3)],
            refinements: self.below(3),
            warm_start: self.byte().is_multiple_of(2),
            contacts: Default::default(),
            backend,
        }
    }

    /// Bodies and constraints that nobody has checked.
    pub fn scene(&mut self) -> Scene {
        let mut scene = Scene::new("any");
        scene.gravity = self.vector();
        let bodies = self.below(5);
        for name in ODD.into_iter().take(bodies) {
            let body = self.body();
            scene.add_body(name, body);
        }
        let constraints = self.below(6);
        for i in 0..constraints {
            let constraint = self.constraint(bodies);
            let group = u32::from(self.byte() % 3);
            scene.add_constraint(format!("{}{i}", ODD[i % 5]), constraint, group);
        }
        for i in 0..self.below(3) {
            let drives = (0..self.below(3)).map(|_| Drive {
                constraint: self.below(constraints + 1),
                gain: self.number(),
            });
            let control = Control {
                name: format!("control-{i}"),
                drives: drives.collect(),
            };
            scene.controls.push(control);
        }
        scene.load = (self.byte().is_multiple_of(4)).then(|| self.below(bodies + 1));
        scene.start_in_equilibrium = self.byte().is_multiple_of(8);
        scene
    }

    fn body(&mut self) -> Body {
        let mut body = match self.byte() % 4 {
            0 => Body::rod(self.positive(), self.positive(), self.positive()),
            1 => Body::sphere(self.positive(), self.positive()),
            2 => Body::cuboid(Vector3::from_fn(|_, _| self.positive()), self.positive()),
            _ => Body::new(self.positive(), Matrix3::from_fn(|_, _| self.number())),
        };
        body.position = self.vector();
        body.orientation = match self.byte() % 8 {
            0 => UnitQuaternion::new_unchecked(Quaternion::new(
                self.number(),
                self.number(),
                self.number(),
                self.number(),
            )),
            1..4 => UnitQuaternion::identity(),
            _ => UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| {
                f64::from(self.byte()) / 40.0 - 3.0
            })),
        };
        let mobility = [Mobility::Dynamic, Mobility::Static, Mobility::Driven];
        body.mobility = mobility[self.below(5) % 3];
        if body.mobility != Mobility::Static || self.byte() == 0 {
            body.velocity = self.vector();
            body.angular_velocity = self.vector();
        }
        if self.byte().is_multiple_of(3) {
            body.force = self.vector();
            body.torque = self.vector();
        }
        body
    }

    fn frame(&mut self, bodies: usize) -> Frame {
        let point = self.vector();
        let mut frame = match self.below(bodies + 2) {
            0 => Frame::world(point).moving(match self.byte() % 4 {
                0 => Motion::Smooth {
                    displacement: self.vector(),
                    start: self.number(),
                    duration: self.positive(),
                },
                1 => Motion::Circle {
                    radius: self.positive(),
                    period: self.positive(),
                    start: self.number(),
                    ramp: self.positive(),
                },
                _ => Motion::Fixed,
            }),
            i if i <= bodies => Frame::body(i - 1, point),
            _ => Frame::body(self.below(bodies + 1), point),
        };
        if self.byte().is_multiple_of(4)
            && let Some(axes) = taut_model::axes_along(&self.vector())
        {
            frame.axes = axes;
        }
        frame
    }

    fn law(&mut self) -> RowLaw {
        let compliance = [0.0, 1e-8, 1e-4, 1.0];
        let compliance = match self.byte() % 5 {
            4 => self.number(),
            i => compliance[usize::from(i)],
        };
        let damping = if self.byte().is_multiple_of(4) {
            self.number()
        } else {
            0.0
        };
        RowLaw::new(compliance, damping)
    }

    fn joint_law(&mut self) -> JointLaw {
        let rows = self.byte();
        let mut law = |bit: u8| (rows & bit == 0).then(|| self.law());
        JointLaw {
            stretch: law(1),
            bend: law(2),
            twist: law(4),
        }
    }

    fn motor(&mut self) -> Option<Motor> {
        let target = match self.byte() % 3 {
            0 => return None,
            1 => Target::Position(self.number()),
            _ => Target::Speed(self.number()),
        };
        let mut motor = Motor::speed(0.0);
        motor.target = target;
        motor.law = self.law();
        if self.byte().is_multiple_of(2) {
            motor.force_limit = self.positive();
        }
        Some(motor)
    }

    fn winch(&mut self) -> Option<Winch> {
        if self.byte().is_multiple_of(2) {
            return None;
        }
        let mut winch = Winch::new();
        winch.speed = self.number();
        winch.brake = self.byte().is_multiple_of(3);
        if self.byte().is_multiple_of(2) {
            winch.force_limit = self.positive();
            winch.brake_limit = self.positive();
            winch.shortest = self.positive();
            winch.longest = self.positive();
            winch.since = self.number();
        }
        Some(winch)
    }

    /// A constraint of any kind between so many bodies.
    pub fn constraint(&mut self, bodies: usize) -> Constraint {
        let kind = self.byte() % 9;
        let frames = [self.frame(bodies), self.frame(bodies)];
        match kind {
            0 => Constraint::Spherical(Spherical {
                frames,
                stretch: self.law(),
            }),
            1 => Constraint::Paper(Paper::new(frames, self.joint_law())),
            2 => Constraint::Cosserat(Cosserat::new(frames, self.joint_law())),
            3 => Constraint::Lock(Lock {
                frames,
                linear: self.law(),
                angular: self.law(),
            }),
            4 => Constraint::Distance(Distance {
                frames,
                length: self.positive(),
                law: self.law(),
                transverse: self.byte().is_multiple_of(2),
            }),
            5 => Constraint::Hinge(Hinge::new(frames).with(|p| p.motor = self.motor())),
            6 => Constraint::Slider(Slider::new(frames).with(|p| p.motor = self.motor())),
            7 => {
                let mut points = frames.to_vec();
                for _ in 0..self.below(3) {
                    let frame = self.frame(bodies);
                    points.push(frame);
                }
                let mut cable = MasslessCable::new(points, self.positive(), self.law());
                cable.tension_only = !self.byte().is_multiple_of(3);
                cable.winch = self.winch();
                Constraint::MasslessCable(cable)
            }
            _ => Constraint::LinkBend(LinkBend {
                frames: [frames[0], frames[1], self.frame(bodies)],
                law: self.law(),
                definition: Default::default(),
            }),
        }
    }
}
