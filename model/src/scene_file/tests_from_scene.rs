//! Tests of scenes written and read back. Equality is that of the bits: Rust's debug text tells −0 from 0.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::keys::{self, Described};
use super::testing::{reads_back, round_trip, says};
use super::{SceneSource, SceneText};
use crate::body::{Body, Mobility};
use crate::constraint::{
    BendDefinition, Constraint, Cosserat, Distance, Hinge, JointLaw, LinkBend, Lock, MasslessCable,
    Motor, Paper, RowLaw, Slider, Spherical, Target, TwistDefinition, Winch,
};
use crate::contact_scenes::ContactScene;
use crate::frame::{Frame, hanging_axes};
use crate::motion::Motion;
use crate::named::NAMES;
use crate::network::Network;
use crate::reeved::Reeved;
use crate::scene::{Control, Drive, Scene};

#[test]
fn every_named_scene() {
    for name in NAMES {
        let specimen = ["pull", "twist", "bend"].contains(&name);
        let sets = match name {
            "hoist" => {
                "joint=paper seed=3 initial_angle=0.3|move_x=0.5 equilibrium=true damping=0.01|\
                 circle_radius=2 anchor=clamped twist=false"
            }
            "gantry" => "joint=paper parts=2 seed=3|trolley_force=2e4 winch_force=1e5",
            _ if specimen => "joint=paper bearing=true seed=1",
            _ if Network::named(name).is_some() => {
                "joint=spherical seed=7 held=corners damping=0.01"
            }
            _ if Reeved::named(name).is_some() => "friction=0 falls=3 counter_mass=7",
            _ if ContactScene::named(name).is_some() => "friction=0.7 count=3 ei=0",
            _ => "transverse=true seed=7 horizontal=false",
        };
        for set in [""].into_iter().chain(sets.split('|')) {
            let overrides: Vec<_> = set.split(' ').filter_map(|s| s.split_once('=')).collect();
            let source = SceneSource::load(name, &overrides).expect("loads");
            round_trip(&source.build().expect("builds"));
            reads_back(&source);
        }
    }
}

struct Random(Xoshiro256PlusPlus);

impl Random {
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * 2.0_f64.powi(-53)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.0.next_u64() % n as u64) as usize
    }

    /// Any sign and size, and the zeros.
    fn number(&mut self) -> f64 {
        match self.below(8) {
            0 => 0.0,
            1 => -0.0,
            // Not so large that a point of its body is lost in it.
            2 => (self.unit() - 0.5) * 10.0_f64.powi(self.below(40) as i32 - 30),
            _ => 10.0 * self.unit() - 5.0,
        }
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.number(), self.number(), self.number())
    }

    fn turn(&mut self) -> UnitQuaternion<f64> {
        match self.below(3) {
            0 => UnitQuaternion::identity(),
            _ => UnitQuaternion::from_scaled_axis(self.vector().map(|x| x % 3.0)),
        }
    }

    fn axes(&mut self) -> Matrix3<f64> {
        match self.below(3) {
            0 => hanging_axes(),
            1 => Matrix3::identity(),
            _ => self.turn().to_rotation_matrix().into_inner(),
        }
    }

    fn law(&mut self) -> RowLaw {
        let damping = if self.below(2) == 0 {
            0.25
        } else {
            self.unit()
        };
        RowLaw::new(self.number().abs(), damping)
    }

    fn maybe_law(&mut self) -> Option<RowLaw> {
        (self.below(3) > 0).then(|| self.law())
    }

    fn motion(&mut self) -> Motion {
        match self.below(3) {
            0 => Motion::Fixed,
            1 => Motion::Smooth {
                displacement: self.vector(),
                start: self.number(),
                duration: self.unit() + 1e-3,
            },
            _ => Motion::Circle {
                radius: self.number(),
                period: self.unit() + 1e-3,
                start: self.number(),
                ramp: self.unit() + 1e-3,
            },
        }
    }

    /// A frame on a body, or on the world for body 0.
    fn frame(&mut self, body: usize) -> Frame {
        // Far apart, so that no two points are in one place.
        let far = Vector3::x() * (self.unit() + 1.0) * 1e3;
        let frame = match body {
            0 => Frame::world(self.vector() - far).moving(self.motion()),
            i => Frame::body(i - 1, self.vector() + far * i as f64),
        };
        frame.with_axes(self.axes())
    }

    /// A body that something else than forces may move, and that then may lack mass and inertia.
    fn any_body(&mut self) -> Body {
        let fixed = Body::fixed();
        let mut body = self.body();
        body.mobility = [Mobility::Dynamic, Mobility::Static, Mobility::Driven][self.below(3)];
        if body.mobility != Mobility::Dynamic {
            body.mass = [body.mass, fixed.mass][self.below(2)];
            body.inertia = [body.inertia, fixed.inertia][self.below(2)];
        }
        if body.mobility == Mobility::Static {
            body.velocity = [Vector3::zeros(), -Vector3::zeros()][self.below(2)];
            body.angular_velocity = Vector3::zeros();
        }
        body
    }

    /// A limit of a force, or none.
    fn limit(&mut self) -> f64 {
        [self.number().abs(), f64::INFINITY][self.below(2)]
    }

    fn motor(&mut self) -> Option<Motor> {
        let target = [Target::Speed, Target::Position][self.below(2)](self.number());
        let motor = Motor {
            target,
            force_limit: self.limit(),
            law: [RowLaw::RIGID, self.law()][self.below(2)],
        };
        [None, Some(motor), Some(Motor::speed(0.5))][self.below(3)]
    }

    fn winch(&mut self) -> Option<Winch> {
        // Cables are between 0.1 and 1.1 m long.
        let shortest = [Winch::new().shortest, 0.09 * self.unit() + 1e-9][self.below(2)];
        let winch = Winch {
            speed: self.number(),
            force_limit: self.limit(),
            brake: self.below(2) == 0,
            brake_limit: self.limit(),
            shortest,
            longest: 1.2 + self.limit(),
            stalled: false,
            since: self.number(),
        };
        [None, Some(winch), Some(Winch::new())][self.below(3)]
    }

    fn body(&mut self) -> Body {
        let mass = 10.0_f64.powi(self.below(12) as i32 - 6) * (self.unit() + 0.1);
        let mut body = Body::rod(self.unit() + 0.1, self.unit() + 0.1, mass);
        if self.below(2) == 0 {
            let turn = self.turn().to_rotation_matrix().into_inner();
            let inertia = turn * body.inertia * turn.transpose();
            body.inertia = (inertia + inertia.transpose()) * 0.5;
        }
        body = body.at(self.vector()).turned(self.turn());
        body.velocity = self.vector();
        body.angular_velocity = self.vector();
        body.force = self.vector();
        body.torque = self.vector();
        body
    }

    fn constraint(&mut self, scene: &Scene) -> Constraint {
        let bodies = scene.bodies.len();
        let dynamic: Vec<_> = scene.dynamic_bodies().collect();
        let b = dynamic[self.below(dynamic.len())] + 1;
        let a = (b + 1 + self.below(bodies)) % (bodies + 1);
        let frames = [self.frame(a), self.frame(b)];
        let law = JointLaw {
            stretch: self.maybe_law(),
            bend: self.maybe_law(),
            twist: Some(self.law()),
        };
        let twist_reference = TAU * self.below(3) as f64 + self.number();
        match self.below(9) {
            0 => Constraint::Spherical(Spherical {
                frames,
                stretch: self.law(),
            }),
            1 => Constraint::Cosserat(Cosserat {
                frames,
                law,
                twist_reference,
            }),
            2 => Constraint::Paper(Paper {
                frames,
                law,
                twist_definition: TwistDefinition::Alternative,
                safeguard: self.unit().max(1e-16),
                twist_reference,
            }),
            3 => Constraint::Lock(Lock {
                frames,
                linear: self.law(),
                angular: self.law(),
            }),
            4 => Constraint::Distance(Distance {
                frames,
                length: self.unit() + 0.1,
                law: self.law(),
                transverse: self.below(2) == 0,
            }),
            5 => Constraint::Hinge(Hinge {
                frames,
                stretch: self.law(),
                tilt: self.law(),
                motor: self.motor(),
                angle_reference: twist_reference,
            }),
            6 => Constraint::Slider(Slider {
                frames,
                rotation: self.law(),
                across: self.law(),
                motor: self.motor(),
            }),
            7 => {
                let mut through = frames.to_vec();
                for _ in 0..self.below(4) {
                    let body = self.below(bodies + 1);
                    through.push(self.frame(body));
                }
                Constraint::MasslessCable(MasslessCable {
                    frames: through,
                    sheaves: Vec::new(),
                    length: self.unit() + 0.1,
                    law: self.law(),
                    tension_only: self.below(2) == 0,
                    winch: self.winch(),
                })
            }
            _ => {
                let third = self.below(bodies + 1);
                Constraint::LinkBend(LinkBend {
                    frames: [frames[0], frames[1], self.frame(third)],
                    law: self.law(),
                    definition: [BendDefinition::Angle, BendDefinition::Vector][self.below(2)],
                })
            }
        }
    }

    fn scene(&mut self) -> Scene {
        let names = [
            "plain",
            "two words",
            "a.b",
            "\"quoted\"\n",
            "Seil #1 ü",
            "1",
            "",
        ];
        let mut scene = Scene::new(names[self.below(7)]);
        scene.gravity = self.vector();
        scene.start_in_equilibrium = self.below(2) == 0;
        let bodies = self.below(4) + 1;
        for (i, name) in names.iter().enumerate().take(bodies) {
            let body = if i == 0 { self.body() } else { self.any_body() };
            scene.add_body(format!("{name}{i}"), body);
        }
        for i in 0..self.below(8) {
            let constraint = self.constraint(&scene);
            let group = self.0.next_u64() as u32;
            scene.add_constraint(format!("{}{i}", names[i % 7]), constraint, group);
        }
        let mut followers: Vec<_> = (0..scene.constraints.len())
            .filter(|&i| scene.constraints[i].follows_speed())
            .collect();
        for name in names.iter().take(self.below(4)) {
            // Each follows one control at most.
            if followers.is_empty() {
                break;
            }
            let drives = (1 + self.below(3)).min(followers.len());
            let mut drive = || {
                let follower = self.below(followers.len());
                let gain = [1.0, self.number()][self.below(2)];
                Drive {
                    constraint: followers.swap_remove(follower),
                    gain: if gain == 0.0 { -2.5 } else { gain },
                }
            };
            scene.controls.push(Control {
                drives: (0..drives).map(|_| drive()).collect(),
                name: (*name).to_owned(),
            });
        }
        scene.load = (self.below(2) == 0).then(|| self.below(bodies));
        scene
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_scenes(seed in any::<u64>()) {
        let scene = Random(Xoshiro256PlusPlus::seed_from_u64(seed)).scene();
        prop_assert_eq!(scene.validate(), Ok(()));
        round_trip(&scene);
    }
}

#[test]
fn what_a_text_cannot_hold_is_named() {
    let scene = || {
        let mut scene = Scene::new("pair");
        scene.add_body("a", Body::sphere(1.0, 1.0));
        let frames = [Vector3::zeros(), Vector3::z()];
        let frames = [Frame::world(frames[0]), Frame::body(0, frames[1])];
        let link = Distance {
            frames,
            length: 1.0,
            law: RowLaw::RIGID,
            transverse: false,
        };
        scene.add_constraint("link", Constraint::Distance(link), 0);
        scene
    };
    let refused = |change: fn(&mut Scene), words: &str| {
        let mut scene = scene();
        round_trip(&scene);
        change(&mut scene);
        let error = SceneText::from_scene(&scene).expect_err("a fault");
        says(&error.to_string(), words);
    };
    refused(
        |s| s.body_names[0] = "world".into(),
        "… a body called `world`",
    );
    refused(|s| s.bodies.mass[0] = f64::NAN, "… body `a`: mass is NaN");
    refused(
        |s| s.constraints[0].frames_mut()[1].point = Vector3::zeros(),
        "… joint `link`: point_b: is in one place with point_a",
    );
    refused(|s| s.bodies = crate::Bodies::new(), "… no bodies");
}

/// The keys that a reader of the table `table` takes, from its own message.
fn taken(table: &str) -> Vec<String> {
    let text = format!("{table}\nno-such-key = 1\n");
    let error = SceneSource::parse(&text, &[]).expect_err("unknown key");
    let error = error.to_string();
    let (_, known) = error.split_once("expected ").expect("the known keys");
    let quoted = known.split('`').skip(1).step_by(2);
    quoted.map(str::to_owned).collect()
}

#[test]
fn every_key_has_its_meaning() {
    let tables = NAMES.map(|name| {
        let source = SceneSource::load(name, &[]).expect("loads");
        (format!("[{name}]"), keys::of_source(&source))
    });
    let lists = keys::LISTS.map(|(list, keys)| (format!("[[{list}]]"), keys::of(keys)));
    let top = (String::new(), keys::of(SceneText::KEYS));
    for (table, keys) in tables.into_iter().chain(lists).chain([top]) {
        let names: Vec<_> = keys.iter().map(|key| key.name.clone()).collect();
        assert_eq!(names, taken(&table), "{table}");
        for key in keys {
            assert!(key.meaning.len() > 5, "{table} {}", key.name);
            assert!(!key.meaning.contains("\\["), "{}", key.meaning);
            assert!(!key.meaning.contains("[`"), "{}", key.meaning);
        }
    }
}

#[test]
fn comments_stand_before_their_keys() {
    let source = SceneSource::load("hoist", &[("radius", "0.02")]).expect("loads");
    let text = source.to_commented_toml().expect("writes");
    assert!(
        text.contains("\n# Length of the unstrained cable [m].\nlength = 10.0\n"),
        "{text}"
    );
    assert!(
        text.contains("\nradius = 0.02\n# Axial stiffness YA [N]."),
        "{text}"
    );
    assert!(text.contains("\n# ea =    (not given)\n"), "{text}");
    let scene = source.build().expect("builds");
    let explicit = SceneText::from_scene(&scene).expect("a text");
    let text = SceneSource::Explicit(Box::new(explicit)).to_commented_toml();
    let text = text.expect("writes");
    assert_eq!(
        text.matches("# mass: Mass [kg]; a static or driven body needs none.\n")
            .count(),
        1,
        "{text}"
    );
    assert_eq!(text.matches("\n[[body]]\n").count(), 25);
    assert!(!text.contains("order"), "{text}");
}

#[test]
fn keys_that_a_scene_has_no_use_for_are_left_out_and_change_nothing() {
    let mut left_out = 0;
    for name in crate::named::NAMES {
        let source = SceneSource::load(name, &[]).expect("loads");
        let scene = source.build().expect("builds");
        let text = source.to_commented_toml().expect("writes");
        for key in keys::of_source(&source) {
            let line = format!("\n{} =", key.name);
            if text.contains(&line) || text.contains(&line.replace('\n', "\n# ")) {
                continue;
            }
            left_out += 1;
            let mut others = 0;
            for value in ["2", "9", "2.5", "corners", "spherical"] {
                let Ok(other) = SceneSource::load(name, &[(&key.name, value)]) else {
                    continue;
                };
                // Where it has another value it is written, to be read back.
                let written = other.to_commented_toml().expect("writes");
                others += usize::from(written.contains(&line));
                assert_eq!(SceneSource::parse(&written, &[]), Ok(other.clone()));
                if let Ok(built) = other.build() {
                    assert_eq!(built, scene, "{name}: {} = {value}", key.name);
                }
            }
            assert!(others > 0, "{name}: {}", key.name);
        }
    }
    assert!(left_out > 20, "{left_out}");
}
