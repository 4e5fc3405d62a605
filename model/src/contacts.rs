//! Contacts between the colliders of a scene, found anew at each instant.
//!
//! [`Collisions::find`] knows nothing of earlier instants: the same poses and velocities have the same contacts, bit for bit.
//!
//! # Reach
//! A pair has contacts with a gap of at most
//!
//! ```text
//! dt (|v_a − v_b| + |ω_a| e_a + |ω_b| e_b + |g| dt) + h/1000
//! ```
//!
//! with the velocities v, ω of its bodies, the distance e from a body's centre of mass to the farthest point of its shape
//! (of a half-space, the farthest point of the other shape), gravity g, and the smallest dimension h of either: so far the
//! shapes come towards each other in a step of dt.
//!
//! Where the velocities say that a contact over a gap would hold the shapes back, it is that of the instant at which they are
//! closest within the step, and there is none where they pass each other by more than the last two parts of the reach
//! (`contacts/ahead.rs`).
//!
//! # Pairs
//! The boxes along the world's axes that hold the shapes, grown by the reach of each, are sorted along the axis in which they
//! are spread most, and those that overlap there are compared along the others. Half-spaces are compared with everything.
//! Pairs that never meet ([`collide`](crate::collide)) are left out.
//!
//! # Points
//! All kinds of shapes meet all others. Contacts of spheres, capsules and half-spaces are closed formulas. Boxes and cylinders
//! have the direction of least overlap, of faces, pairs of edges, and searches over circles where one of the shapes is round
//! (`contacts/axis.rs`); then the points of the faces or edges that touch there (`contacts/manifold.rs`). Gaps are exact to
//! rounding along the normal found, and the normal of a face is its own. Two boxes or cylinders that are apart may count as
//! closer than they are where a corner is nearest, and then have no contact before they overlap. Where they overlap by much,
//! they have one contact at least, with the direction in which they come apart on the shortest way. Where a joint holds two
//! capsules end to end, both end in the same ball, which has its contacts once (`contacts/balls.rs`).
//!
//! # Curvature
//! A contact knows how both surfaces are curved, and so how its gap changes to second order as its bodies turn
//! (`contacts/curvature.rs`).

mod ahead;
mod axis;
mod balls;
mod curvature;
mod manifold;
mod pairs;
mod polygon;
mod solid;

use nalgebra::Vector3;

use crate::collide::{Shape, Surface};
use crate::error::{SceneError, check_length};
use crate::scene::Scene;
use ahead::{Ahead, Meeting, Motion};
use balls::Balls;
pub use curvature::Curvature;
use manifold::{Touch, touch};
use pairs::Pairs;
use solid::{Core, Solid};

/// Curvature that counts as flat, times the size of the shapes.
const FLAT: f64 = 0.01;

/// A point where two shapes touch, or are about to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Numbers of the colliders, the lower first.
    pub colliders: [usize; 2],
    /// Their bodies; `None`: the world.
    pub bodies: [Option<usize>; 2],
    /// The bodies that each shares its ball with where it touches there, as the next segment of a cable: both are then held by
    /// the mean of their motions, and carry half of the force each.
    pub partners: [Option<usize>; 2],
    /// The points on their surfaces, world \[m].
    pub points: [Vector3<f64>; 2],
    /// Unit vector from collider 1 to collider 0, world: a positive force along it pushes body 0.
    pub normal: Vector3<f64>,
    /// Their distance along the normal \[m], negative where the shapes overlap: (points\[0] − points\[1])·normal. Where the
    /// points belong to a later instant, they are as the bodies' velocities have them before, and the gap counts the turning.
    pub gap: f64,
    /// Curvatures of the two surfaces there; edges and corners are round with 10⁻³ of their shape's
    /// size.
    pub curvature: [Curvature; 2],
    /// Curvature of a radius a hundred times the shapes' sizes \[1/m]: what both together are less curved than touches along
    /// a line.
    pub flat: f64,
    /// [`Surface::meet`] of both.
    pub surface: Surface,
    /// The point on collider 0 in the frame of its shape \[m], by which a contact is known again in the next step.
    pub key: Vector3<f64>,
}

impl Contact {
    /// Sum of the sizes of both shapes \[m]; half-spaces have none.
    #[must_use]
    pub fn size(&self) -> f64 {
        FLAT / self.flat
    }
}

/// A collider where it is now.
#[derive(Debug, Clone, Copy)]
struct PlacedSolid {
    solid: Solid,
    /// Corners of its box, grown by its own reach, world \[m].
    low: Vector3<f64>,
    high: Vector3<f64>,
}

/// Finds contacts. It holds what does not change while a scene has the same colliders, constraints and cables, and memory
/// that it works in: allocates only where more contacts are found than before.
#[derive(Debug, Clone)]
pub struct Collisions {
    pairs: Pairs,
    balls: Balls,
    /// Numbers of the colliders with an end, in the order of the last sort, and of the half-spaces.
    bounded: Vec<usize>,
    planes: Vec<usize>,
    places: Vec<PlacedSolid>,
    near: Vec<[usize; 2]>,
    touches: Vec<Touch>,
    contacts: Vec<Contact>,
}

impl Collisions {
    /// Candidates for contact in a valid `scene`. Make it anew when colliders, constraints, cables
    /// or the mobility of bodies change.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        let plane = |i: &usize| scene.colliders[*i].shape == Shape::HalfSpace;
        let (planes, bounded) = (0..scene.colliders.len()).partition(plane);
        Self {
            pairs: Pairs::of(scene),
            balls: Balls::of(scene),
            bounded,
            planes,
            places: Vec::with_capacity(scene.colliders.len()),
            near: Vec::new(),
            touches: Vec::new(),
            contacts: Vec::new(),
        }
    }

    /// True if no two colliders can ever meet.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// The first collider of each dynamic body or cable that meets nothing, whatever the poses.
    pub(crate) fn alone(&self, scene: &Scene) -> Vec<usize> {
        self.pairs.alone(scene)
    }

    /// The contacts of all pairs that could touch within `dt` (s), in the order of their colliders.
    ///
    /// # Errors
    /// [`SceneError::Length`] where the scene has not the number of colliders or bodies that it had,
    /// [`SceneError::BadValue`] where a body's pose or velocity is not finite.
    pub fn find(&mut self, scene: &Scene, dt: f64) -> Result<&[Contact], SceneError> {
        self.contacts.clear();
        self.check(scene)?;
        if self.is_empty() {
            return Ok(&self.contacts);
        }
        self.place(scene, dt);
        self.sweep(scene);
        self.balls.begin();
        for pair in 0..self.near.len() {
            self.meet(scene, self.near[pair], dt);
        }
        self.balls.unite(&mut self.contacts);
        Ok(&self.contacts)
    }

    fn check(&self, scene: &Scene) -> Result<(), SceneError> {
        let colliders = self.bounded.len() + self.planes.len();
        check_length("colliders", scene.colliders.len(), colliders)?;
        check_length("bodies", scene.bodies.len(), self.pairs.bodies())?;
        let mut bodies = scene.colliders.iter().filter_map(|c| c.body);
        bodies.try_for_each(|i| scene.bodies.validate_state(i, &scene.body_names[i]))
    }

    /// Places all colliders, with their boxes.
    fn place(&mut self, scene: &Scene, dt: f64) {
        self.places.clear();
        for collider in &scene.colliders {
            let solid = Solid::of(collider, &scene.bodies);
            let margin = if collider.shape == Shape::HalfSpace {
                0.0
            } else {
                let [v, turn] = speeds(scene, collider.body);
                let end = collider.position.norm() + collider.shape.reach();
                dt * (v.norm() + turn.norm() * end + scene.gravity.norm() * dt)
                    + 1e-3 * collider.shape.dimensions()[0]
            };
            let half = solid.extents().add_scalar(margin);
            self.places.push(PlacedSolid {
                solid,
                low: solid.centre - half,
                high: solid.centre + half,
            });
        }
    }

    /// Finds the pairs whose boxes overlap, in order.
    fn sweep(&mut self, scene: &Scene) {
        let (places, pairs) = (&self.places, &self.pairs);
        let near = &mut self.near;
        near.clear();
        let mut add = |i: usize, j: usize| {
            let pair = [i.min(j), i.max(j)];
            if pairs.meet(scene, pair) {
                near.push(pair);
            }
        };
        let k = widest(&self.bounded, places);
        let order = |i: &usize, j: &usize| places[*i].low[k].total_cmp(&places[*j].low[k]);
        self.bounded
            .sort_unstable_by(|i, j| order(i, j).then(i.cmp(j)));
        for (n, &i) in self.bounded.iter().enumerate() {
            let first = &places[i];
            let beside = |j: &&usize| places[**j].low[k] <= first.high[k];
            for &j in self.bounded[n + 1..].iter().take_while(beside) {
                let second = &places[j];
                if (0..3).all(|k| second.low[k] <= first.high[k] && first.low[k] <= second.high[k])
                {
                    add(i, j);
                }
            }
            for &plane in &self.planes {
                add(plane, i);
            }
        }
        near.sort_unstable();
    }

    /// Appends the contacts of a pair.
    fn meet(&mut self, scene: &Scene, pair: [usize; 2], dt: f64) {
        let colliders = pair.map(|i| &scene.colliders[i]);
        let mut solids = pair.map(|i| self.places[i].solid);
        // Rounding is that of the shapes, not that of their distance from the origin.
        let bounded = usize::from(solids[0].core == Core::HalfSpace);
        let origin = solids[bounded].centre;
        solids.iter_mut().for_each(|solid| solid.centre -= origin);
        let motions = colliders.map(|c| Motion::of(scene, c.body, &origin));
        let ahead = Ahead { solids, motions };
        self.touches.clear();
        let reach = reach(scene, pair, &self.places, dt);
        touch(&solids[0], &solids[1], reach.all(), &mut self.touches);
        let time = self.look_ahead(&ahead, reach, dt);
        let [a, b] = ahead.at(time);
        let surface = colliders[0].surface.meet(&colliders[1].surface);
        let bodies = colliders.map(|c| c.body);
        let flat = FLAT / (a.size() + b.size());
        for (n, touch) in self.touches.iter().enumerate() {
            let [p, q] = touch.points;
            let cores = [
                (&a, p + touch.normal * a.radius),
                (&b, q - touch.normal * b.radius),
            ];
            self.balls.add(self.contacts.len() + n, pair, cores);
        }
        self.contacts
            .extend(self.touches.iter().map(|touch| Contact {
                colliders: pair,
                bodies,
                partners: [None; 2],
                points: ahead.before(&touch.points, time).map(|p| p + origin),
                normal: touch.normal,
                gap: ahead.gap_before(touch, time),
                curvature: [
                    a.curvature(&touch.points[0], &-touch.normal),
                    b.curvature(&touch.points[1], &touch.normal),
                ],
                flat,
                surface,
                key: a.axes.tr_mul(&(touch.points[0] - a.centre)),
            }));
    }

    /// Replaces the points of contact of the beginning where the shapes meet otherwise within `dt`, adds those of shapes that
    /// meet and do not face each other yet, and leaves none where they do not meet: the time that the points belong to \[s].
    fn look_ahead(&mut self, ahead: &Ahead, reach: Reach, dt: f64) -> f64 {
        let touches = &mut self.touches;
        let apart = touches.iter().all(|touch| touch.gap() > 0.0);
        let arrives = |touch: &Touch| touch.gap() + dt * ahead.rate(touch, 0.0) < 0.0;
        let planes = ahead.solids.iter().any(|s| s.core == Core::HalfSpace);
        let moves = reach.moving > reach.shape && !planes;
        if !(moves && apart && (touches.is_empty() || touches.iter().any(arrives))) {
            return 0.0;
        }
        let (near, least) = (reach.shape + reach.falling, 1e3 * reach.shape);
        match ahead.meeting(dt, near, least, !touches.is_empty()) {
            Meeting::AsNow => 0.0,
            Meeting::Never => {
                touches.clear();
                0.0
            }
            Meeting::At(time) => {
                let (first, [a, b]) = (touches.len(), ahead.at(time));
                let left = reach.all() - reach.moving * time / dt;
                touch(&a, &b, left, touches);
                if touches.len() == first {
                    return 0.0;
                }
                touches.drain(..first);
                time
            }
        }
    }
}

/// The parts of the distance that the surfaces of a pair may be apart \[m]: the ways by their velocities and by gravity,
/// and one for their size.
#[derive(Debug, Clone, Copy)]
struct Reach {
    moving: f64,
    falling: f64,
    shape: f64,
}

impl Reach {
    fn all(self) -> f64 {
        self.moving + self.falling + self.shape
    }
}

/// Velocity and angular velocity of a body or of the world.
fn speeds(scene: &Scene, body: Option<usize>) -> [Vector3<f64>; 2] {
    let bodies = &scene.bodies;
    body.map_or([Vector3::zeros(); 2], |i| {
        [bodies.velocity[i], bodies.angular_velocity[i]]
    })
}

/// Largest distance at which a pair counts.
fn reach(scene: &Scene, pair: [usize; 2], places: &[PlacedSolid], dt: f64) -> Reach {
    let colliders = pair.map(|i| &scene.colliders[i]);
    let [[v, _], [w, _]] = colliders.map(|c| speeds(scene, c.body));
    let turning = |own: usize, other: usize| {
        let Some(body) = colliders[own].body else {
            return 0.0;
        };
        let end = match colliders[own].shape {
            Shape::HalfSpace => {
                let way = places[pair[other]].solid.centre - scene.bodies.position[body];
                way.norm() + colliders[other].shape.reach()
            }
            shape => colliders[own].position.norm() + shape.reach(),
        };
        scene.bodies.angular_velocity[body].norm() * end
    };
    let least = colliders.map(|c| c.shape.dimensions()[0]);
    Reach {
        moving: dt * ((v - w).norm() + turning(0, 1) + turning(1, 0)),
        falling: dt * dt * scene.gravity.norm(),
        shape: 1e-3 * least[0].min(least[1]),
    }
}

/// The axis along which the boxes are spread most.
fn widest(bounded: &[usize], places: &[PlacedSolid]) -> usize {
    let infinite = Vector3::repeat(f64::INFINITY);
    let (mut low, mut high) = (infinite, -infinite);
    for i in bounded {
        let centre = places[*i].solid.centre;
        (low, high) = (low.inf(&centre), high.sup(&centre));
    }
    if bounded.is_empty() {
        0
    } else {
        (high - low).imax()
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_ahead;
#[cfg(test)]
mod tests_curvature;
#[cfg(test)]
mod tests_random;
#[cfg(test)]
mod tests_scene;
