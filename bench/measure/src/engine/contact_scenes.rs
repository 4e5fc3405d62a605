//! Motions on the ground whose end is known: in each of them all bodies have gone the same way along x.
//!
//! **Slide.** A box with the speed v stops after v²/(2 μ g).
//!
//! **Stack.** Boxes on each other, heavier and heavier, stay where they are.
//!
//! **Floor.** A cable drags a load over the floor with the tug's speed v. It starts in the steady motion: friction takes
//! μ m g of each of the bodies behind a joint, which has the gap that this tension asks for, and all bodies go v t.

use super::motion::FRAME;
use crate::trajectory::steps_in;
use nalgebra::Vector3;
use taut_model::{Constraint, ContactScene, ContactSceneParams, Mobility, Scene, SceneError};

/// Positions of a scene's bodies \[m].
pub type Places = Vec<Vector3<f64>>;

/// Simulated time \[s]; the second half of it counts.
pub const TIME: f64 = 2.0;

/// Speed of the box that slides \[m/s].
const SPEED: f64 = 2.0;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A box slides until it stops.
    Slide,
    /// Boxes stand on each other.
    Stack,
    /// A cable drags a load.
    Floor,
}

/// A start, and where its bodies are after it.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// The start.
    pub scene: Scene,
    /// Reference length of position errors: the way of the box, the stack's height, the cable's
    /// length \[m].
    pub length: f64,
    /// Reference length of penetrations: the least dimension of a body's shape \[m].
    pub thickness: f64,
    /// Distance from its place at which a body is lost \[m].
    pub reach: f64,
    /// Way of all bodies along x in the second half, at first and with time \[m, m/s].
    way: [f64; 2],
    /// Each body stands on the one before.
    stacked: bool,
}

/// How far bodies are from where they belong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Off {
    /// Largest distance of a body from its place \[m].
    pub place: f64,
    /// Deepest penetration \[m].
    pub depth: f64,
}

impl Kind {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Slide, Self::Stack, Self::Floor];

    /// Its name in the tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Slide => "slide",
            Self::Stack => "stack",
            Self::Floor => "floor",
        }
    }
}

/// Frames of a motion.
pub fn frames() -> usize {
    steps_in(TIME, FRAME)
}

impl Known {
    /// The motion of this kind, the heaviest body over the lightest as the ratio says; there is one box that slides.
    pub fn new(kind: Kind, mass_ratio: f64) -> Result<Self, SceneError> {
        let grounded = match kind {
            Kind::Floor => ContactScene::Floor,
            _ => ContactScene::Stack,
        };
        let slides = kind == Kind::Slide;
        let mut params = ContactSceneParams {
            mass_ratio,
            // Ball joints, which is all that the baselines have.
            ei: 0.0,
            ..ContactSceneParams::new(grounded)
        };
        if slides {
            params.count = Some(1);
            params.length = 1.0;
        }
        let mut scene = params.build()?;
        if slides {
            scene.bodies.velocity[0].x = SPEED;
        }
        let (length, reach, way) = match kind {
            Kind::Slide => {
                let way = 0.5 * SPEED * SPEED / (params.friction * params.gravity);
                (way, 0.5 * way, [way, 0.0])
            }
            // Half an edge.
            Kind::Stack => (params.length, 0.05 * params.length, [0.0; 2]),
            Kind::Floor => {
                drag(&mut scene, &params);
                (params.length, 0.5 * params.length, [0.0, params.speed])
            }
        };
        let bodies = scene.colliders.iter().filter(|c| c.body.is_some());
        let least = bodies.map(|c| c.shape.dimensions()[0]);
        let thickness = least.fold(f64::INFINITY, f64::min);
        Ok(Self {
            scene,
            length,
            thickness,
            reach,
            way,
            stacked: kind != Kind::Floor,
        })
    }

    /// How far bodies are off at the end of so many frames, in the second half.
    pub fn off(&self, frames: usize, places: &[Vector3<f64>]) -> Off {
        let [at_first, speed] = self.way;
        let way = Vector3::x() * (at_first + speed * FRAME * frames as f64);
        let start = &self.scene.bodies.position;
        let (mut off, mut below) = (
            Off {
                place: 0.0,
                depth: 0.0,
            },
            0.0,
        );
        for (place, start) in places.iter().zip(start) {
            let moved = place - start;
            let place = (moved - way).norm();
            // No number is far away, and `max` would lose it.
            off.place = off
                .place
                .max(if place.is_nan() { f64::INFINITY } else { place });
            off.depth = off.depth.max(below - moved.z);
            if self.stacked {
                below = moved.z;
            }
        }
        off
    }
}

/// Puts the scene of a load, a tug and a cable between them in its steady motion.
fn drag(scene: &mut Scene, params: &ContactSceneParams) {
    let speed = params.speed;
    let Scene {
        bodies,
        constraints,
        ..
    } = scene;
    bodies.velocity.fill(Vector3::x() * speed);
    let (mut behind, mut gaps) = (0.0, 0.0);
    // The joints are in their order, the load's first.
    for constraint in constraints.iter() {
        let Constraint::Spherical(joint) = constraint else {
            continue;
        };
        let [Some(last), Some(next)] = joint.frames.map(|frame| frame.body_index()) else {
            continue;
        };
        if bodies.mobility[last] == Mobility::Dynamic {
            behind += bodies.mass[last];
        }
        gaps += joint.stretch.compliance * params.friction * behind * params.gravity;
        bodies.position[next].x += gaps;
    }
}
