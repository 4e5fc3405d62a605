//! Products of features: small scenes that join two to five features of the model, and what has to hold in all of them.
//!
//! A seed (or the fuzzer's bytes) draws [`Choices`], plain data; [`scene::toml`] writes them as a scene file; `run::Case`
//! steps that for two seconds at 60 steps a second; `invariants::ALL` are judged on what it saw; [`shrink::smallest`] drops
//! features and halves numbers as long as an invariant stays violated.
//!
//! `cargo test -p taut-tests --test all products` draws 200 scenes. A longer search, with another first seed, and the
//! scenes that one seed stands for:
//!
//! ```text
//! TAUT_PRODUCTS=10000 TAUT_PRODUCTS_SEED=1000 cargo test --release -p taut-tests --test all products -- --nocapture
//! TAUT_PRODUCTS=1 TAUT_PRODUCTS_SEED=4711 cargo test -p taut-tests --test all products
//! ```

mod contacts;
pub mod invariants;
mod paired;
mod ropes;
mod run;
pub mod scene;
pub mod shrink;

use crate::With;
use crate::random::Random;

/// Simulated time \[s] and steps a second.
pub(crate) const TIME: f64 = 2.0;
pub(crate) const RATE: f64 = 60.0;

/// Acceleration of gravity \[m/s²].
pub(crate) const G: f64 = 9.81;

/// Features of a scene, and their numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Choices {
    pub(crate) gravity: bool,
    pub(crate) load: Load,
    pub(crate) rope: Option<Rope>,
    pub(crate) ground: Option<Ground>,
    pub(crate) other: Option<Other>,
    /// Friction and restitution of everything that touches.
    pub(crate) friction: f64,
    pub(crate) restitution: f64,
    /// When the rope is released \[s].
    pub(crate) release: Option<f64>,
    /// When a link from the load to the world is made, and when an event lets it go \[s].
    pub(crate) attach: Option<[f64; 2]>,
    pub(crate) steps: Steps,
}

/// Outlines of bodies, all about half a metre across.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Form {
    Ball,
    Block,
    Disc,
}

/// The body that all is about.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Load {
    pub(crate) form: Form,
    /// kg.
    pub(crate) mass: f64,
    /// m/s.
    pub(crate) velocity: [f64; 3],
    /// rad/s.
    pub(crate) spin: [f64; 3],
    /// About y, x \[rad], before it falls.
    pub(crate) turned: [f64; 2],
}

/// Rope from which the load hangs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rope {
    /// A cable of so many segments, or one without mass.
    pub(crate) segments: Option<usize>,
    /// m, from the load to the point or sheave above.
    pub(crate) length: f64,
    /// How much longer it is than its path \[m]; 0 is stretched by the load's weight.
    pub(crate) slack: f64,
    /// Strain under the load's weight, 0 for a rigid one.
    pub(crate) strain: f64,
    /// s.
    pub(crate) damping: f64,
    /// Angle from the vertical \[rad].
    pub(crate) aside: f64,
    /// Friction of a sheave that it runs over.
    pub(crate) sheave: Option<f64>,
    pub(crate) end: End,
    pub(crate) winch: Option<Winch>,
    /// Times the weight of the load.
    pub(crate) breaks: Option<f64>,
}

/// Support of the rope's other end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum End {
    World,
    /// A body of so many times the load's mass.
    Counterweight(f64),
    /// A motor's speed \[rad/s].
    Drum(f64),
}

/// Hauls in and pays out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Winch {
    /// m/s, positive pays out: of the three thirds of the time.
    pub(crate) speeds: [f64; 3],
    /// Times the weight of the load: of the motor, of the brake.
    pub(crate) force: Option<f64>,
    pub(crate) brake: Option<f64>,
    /// How far it may haul in and pay out \[m].
    pub(crate) range: Option<f64>,
}

/// Ground below the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ground {
    /// Between it and the lowest body \[m].
    pub(crate) below: f64,
    /// Angle of its slope \[rad].
    pub(crate) slope: f64,
}

/// A second body that the load may touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Other {
    /// Under it: form, mass over the load's, and by how much the load is off its centre \[m].
    Under {
        form: Form,
        ratio: f64,
        off: f64,
        gap: f64,
    },
    /// A driven turntable: rad/s, and the load's distance from its axis \[m].
    Turntable { rate: f64, radius: f64 },
}

/// How it is stepped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Steps {
    pub(crate) substeps: usize,
    pub(crate) guard: bool,
    pub(crate) estimate: bool,
    pub(crate) sleep: bool,
}

/// Something that a draw adds.
type Feature = fn(&mut Choices, &mut Draw<'_>);

/// Beginnings of scenes, and the features that go with each.
const KINDS: [(Feature, &[&[Feature]]); 9] = [
    (hanging, &[&OF_ROPES, &OF_LOADS]),
    (hanging, &[&OF_ROPES, &OF_LOADS]),
    (hanging, &[&OF_ROPES, &OF_ROPES, &OF_GROUND]),
    (lowered, &[&OF_ROPES, &OF_GROUND]),
    (lowered, &[&OF_ROPES, &OF_GROUND]),
    (falling, &[&OF_LOADS, &OF_GROUND]),
    (falling, &[&OF_LOADS, &OF_GROUND]),
    (standing, &[&OF_LOADS, &OF_GROUND]),
    (riding, &[&OF_LOADS]),
];

fn hanging(_: &mut Choices, _: &mut Draw<'_>) {}

/// A load that a winch sets down.
fn lowered(c: &mut Choices, d: &mut Draw<'_>) {
    let below = d.of(&[0.01, 0.05, 0.2]);
    c.ground = Some(Ground { below, slope: 0.0 });
    c.rope().winch = Some(Winch {
        speeds: d.of(&[[0.5; 3], [1.0; 3], [0.5, 0.0, -0.5]]),
        ..Winch::still()
    });
    if d.below(2) == 0 {
        c.rope().sheave = Some(0.1);
    }
}

fn falling(c: &mut Choices, d: &mut Draw<'_>) {
    let below = d.log(0.01, 1.0);
    c.ground = Some(Ground { below, slope: 0.0 });
    c.restitution = d.of(&[0.0, 0.3, 0.6, 0.8, 0.9, 1.0]);
    c.rope = None;
}

fn standing(c: &mut Choices, d: &mut Draw<'_>) {
    c.load.form = d.form();
    c.other = Some(Other::Under {
        form: d.form(),
        ratio: d.of(&[1.0, 0.01, 0.1, 10.0]),
        off: d.of(&[0.0, 3e-3, 0.03, 0.1]),
        gap: d.of(&[0.0, 0.0, 0.01, 0.3]),
    });
    let below = d.of(&[0.0, 0.0, 0.1]);
    c.ground = Some(Ground { below, slope: 0.0 });
    c.rope = None;
}

fn riding(c: &mut Choices, d: &mut Draw<'_>) {
    let (rate, radius) = (d.log(0.1, 2.0), d.log(0.5, 10.0));
    c.other = Some(Other::Turntable { rate, radius });
}

const OF_ROPES: [Feature; 13] = [
    |c, d| c.rope().slack = d.log(1e-4, 1.0),
    |c, d| c.rope().damping = d.of(&[0.02, 0.05, 0.2, 0.5, 5.0]),
    |c, d| c.rope().damping = d.of(&[0.02, 0.05]),
    |c, d| c.rope().strain = d.log(1e-5, 0.1),
    |c, _| c.rope().strain = 0.0,
    |c, d| c.rope().sheave = Some(d.of(&[0.0, 0.02, 0.1, 0.3])),
    |c, d| c.rope().end = End::Drum(d.of(&[0.0, 0.5, -0.5, 2.0])),
    |c, d| c.rope().end = End::Counterweight(d.log(0.1, 10.0)),
    |c, d| c.rope().segments = Some(2 + d.below(5)),
    |c, d| c.rope().aside = d.of(&[0.02, 0.3, 1.0]),
    |c, d| c.rope().winch = Some(d.winch()),
    |c, d| {
        let brake = Some(d.of(&[0.5, 0.9999, 1.0001, 2.0]));
        c.rope().winch = Some(Winch::still().with(|w| w.brake = brake));
    },
    |c, d| c.rope().breaks = Some(d.of(&[1.2, 3.0, 10.0])),
];

const OF_LOADS: [Feature; 8] = [
    |c, d| c.load.mass = d.log(1.0, 1e6),
    |c, d| c.load.mass = d.of(&[1e4, 1e5, 1e5, 1e6]),
    |c, d| c.load.mass = d.of(&[1e4, 1e6, 1e160]),
    |c, d| {
        c.load.form = d.form();
        c.load.spin = [d.even(5.0), d.even(5.0), d.even(2.0)];
        c.load.turned = [d.even(0.5), d.even(0.5)];
    },
    |c, d| c.load.velocity = [d.even(2.0), d.even(1.0), d.even(1.0)],
    |c, d| c.release = Some(d.of(&[0.3, 0.8])),
    |c, d| c.attach = Some([d.of(&[0.2, 0.5]), d.of(&[0.9, 1.3])]),
    |c, d| c.gravity = d.below(3) > 0,
];

const OF_GROUND: [Feature; 4] = [
    |c, d| {
        let below = d.of(&[0.0, 1e-3, 0.05, 0.3]);
        c.ground = Some(Ground { below, slope: 0.0 });
    },
    |c, d| c.ground().slope = d.of(&[0.2, 0.5]),
    |c, d| c.restitution = d.of(&[0.3, 0.6, 0.8, 0.9, 1.0]),
    |c, d| c.load.mass = d.log(1.0, 1e6),
];

impl Choices {
    /// 100 kg on 3 m of rope at rest.
    pub(crate) fn plain() -> Self {
        Self {
            gravity: true,
            load: Load {
                form: Form::Ball,
                mass: 100.0,
                velocity: [0.0; 3],
                spin: [0.0; 3],
                turned: [0.0; 2],
            },
            rope: Some(Rope::plain()),
            ground: None,
            other: None,
            friction: 0.5,
            restitution: 0.0,
            release: None,
            attach: None,
            steps: Steps {
                substeps: 1,
                guard: true,
                estimate: false,
                sleep: false,
            },
        }
    }

    /// Choices of a seed.
    pub fn of_seed(seed: u64) -> Self {
        let mut random = Random::new(seed);
        Self::draw(&mut Draw(&mut || random.bits()))
    }

    /// Choices from bytes, eight for each; zeros at their end.
    pub fn of_bytes(data: &[u8]) -> Self {
        let mut words = data.chunks(8);
        Self::draw(&mut Draw(&mut || {
            let mut word = [0; 8];
            let next = words.next().unwrap_or_default();
            word[..next.len()].copy_from_slice(next);
            u64::from_le_bytes(word)
        }))
    }

    /// Two to five features of the scene, and some of the steps.
    fn draw(d: &mut Draw<'_>) -> Self {
        let mut choices = Self::plain();
        let (begin, features) = KINDS[d.below(KINDS.len())];
        begin(&mut choices, d);
        for _ in 0..1 + d.below(4) {
            let group = d.of(features);
            d.of(group)(&mut choices, d);
        }
        choices.friction = d.of(&[0.5, 0.5, 0.0, 0.2, 1.0]);
        choices.steps = Steps {
            substeps: d.of(&[1, 1, 1, 1, 1, 1, 1, 2, 2, 4, 4, 16]),
            guard: d.below(6) > 0,
            estimate: d.below(3) == 0,
            sleep: d.below(3) == 0,
        };
        choices.settled()
    }

    fn ground(&mut self) -> &mut Ground {
        let level = Ground {
            below: 0.0,
            slope: 0.0,
        };
        self.ground.get_or_insert(level)
    }

    fn rope(&mut self) -> &mut Rope {
        self.rope.get_or_insert_with(Rope::plain)
    }

    /// Without what the model's documentation excludes: sheaves and drums of cables of segments, winches beside drums, events
    /// of ropes that are not there.
    pub(crate) fn settled(mut self) -> Self {
        if matches!(self.other, Some(Other::Turntable { .. })) {
            (self.rope, self.ground) = (None, None);
            self.gravity = true;
            // A ball rolls off.
            let (form, mass) = (Form::Block, self.load.mass);
            self.load = Self::plain().load.with(|p| (p.form, p.mass) = (form, mass));
        }
        if self.rope.is_none() {
            self.release = None;
        }
        if let Some(rope) = &mut self.rope {
            if rope.segments.is_some() {
                (rope.sheave, rope.end, rope.slack) = (None, End::World, 0.0);
                // Straight to rounding, segments that are set down or let out stand as a column.
                if rope.aside == 0.0 && self.load.velocity[..2] == [0.0; 2] {
                    self.load.velocity[0] = 0.05;
                }
            }
            if rope.end != End::World {
                rope.winch = None;
            }
            if rope.strain == 0.0 && rope.sheave.is_some() {
                // A rigid rope has no tension between the points of one body.
                rope.strain = 1e-3;
            }
            if !self.gravity && matches!(rope.end, End::World) {
                rope.end = End::Counterweight(2.0);
                (rope.sheave, rope.segments, rope.winch) = (None, None, None);
            }
        }
        if !self.gravity {
            (self.ground, self.attach) = (None, None);
        }
        self
    }

    /// True if nothing drives the scene.
    pub(crate) fn is_passive(&self) -> bool {
        let turns = |w: &Winch| w.speeds.iter().any(|s| *s != 0.0);
        let rope = self.rope.as_ref();
        !matches!(self.other, Some(Other::Turntable { .. }))
            && !rope.is_some_and(|r| {
                r.winch.as_ref().is_some_and(turns) || matches!(r.end, End::Drum(_))
            })
    }

    /// Weight of the load \[N].
    pub(crate) fn weight(&self) -> f64 {
        G * self.load.mass
    }
}

impl Rope {
    pub(crate) fn plain() -> Self {
        Self {
            segments: None,
            length: 3.0,
            slack: 0.0,
            strain: 1e-3,
            damping: 0.0,
            aside: 0.0,
            sheave: None,
            end: End::World,
            winch: None,
            breaks: None,
        }
    }
}

impl Winch {
    const fn still() -> Self {
        Self {
            speeds: [0.0; 3],
            force: None,
            brake: None,
            range: None,
        }
    }
}

/// Numbers of choices.
struct Draw<'a>(&'a mut dyn FnMut() -> u64);

impl Draw<'_> {
    fn below(&mut self, n: usize) -> usize {
        (self.0() >> 33) as usize % n
    }

    /// In 0 … 1.
    fn part(&mut self) -> f64 {
        (self.0() >> 11) as f64 * 2.0_f64.powi(-53)
    }

    /// In −most … most.
    fn even(&mut self, most: f64) -> f64 {
        rounded(most * (2.0 * self.part() - 1.0))
    }

    fn log(&mut self, from: f64, to: f64) -> f64 {
        rounded((from.ln() + self.part() * (to / from).ln()).exp())
    }

    fn of<T: Copy>(&mut self, these: &[T]) -> T {
        these[self.below(these.len())]
    }

    fn form(&mut self) -> Form {
        self.of(&[Form::Ball, Form::Block, Form::Disc])
    }

    fn winch(&mut self) -> Winch {
        let speed = self.of(&[0.1, 0.5, 1.0]);
        let ways = self.of(&[[1.0; 3], [-1.0; 3], [1.0, -1.0, 1.0], [1.0, 0.0, -1.0]]);
        Winch {
            speeds: ways.map(|way| way * speed),
            force: self.of(&[None, None, Some(0.5), Some(1.5)]),
            range: self.of(&[None, None, Some(0.2)]),
            brake: None,
        }
    }
}

/// To three digits, so that a scene can be read.
fn rounded(x: f64) -> f64 {
    format!("{x:.2e}").parse().unwrap_or(x)
}
