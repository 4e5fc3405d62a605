//! Closest approach of moving shapes within a step.
//!
//! A contact over a gap keeps the shapes apart along its normal for the whole step. Where they move far, the normal of the
//! beginning is not that of the end: a ball that flies past an edge would be held back by the plane that was between
//! them before. So bodies that move are moved on, by v t and the turn ω t, to the instant at which they are closest.
//!
//! Until then they cannot have met (conservative advancement): with the direction n of the largest s(n) at time t
//! (`contacts/axis.rs`), that plane is between them at least until
//!
//! ```text
//! t + s(n) / (w_a + w_b − (v_a − v_b)·n)
//! ```
//!
//! where w bounds the speed at which a shape's turning moves its surface. A turn about the axis of a round shape moves none.
//! A plane towards which nothing moves stays between them for good. What passes by has its closest instant where the gap
//! stops to shrink, found by bisection.

use nalgebra::{Rotation3, Vector3};

use super::axis::axis;
use super::manifold::{Touch, between_segments};
use super::solid::{Core, Solid};
use super::speeds;
use crate::scene::Scene;

/// Instants that are looked at, at most: where they do not suffice, contacts are those of the beginning.
const LOOKS: usize = 48;
/// Halvings of the time in which shapes pass each other.
const HALVINGS: usize = 24;
/// Gap over the smallest dimension at which shapes touch.
const TOUCHING: f64 = 1e-9;
/// Angle between normals that count as the same \[rad].
const ALIKE: f64 = 1e-3;

/// How a body moves, from the point of reference of the pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    centre: Vector3<f64>,
    velocity: Vector3<f64>,
    turn: Vector3<f64>,
}

impl Motion {
    pub(super) fn of(scene: &Scene, body: Option<usize>, origin: &Vector3<f64>) -> Self {
        let [velocity, turn] = speeds(scene, body);
        let centre = body.map_or(*origin, |i| scene.bodies.position[i]) - origin;
        Self {
            centre,
            velocity,
            turn,
        }
    }

    /// A solid of the body after a time.
    fn moved(&self, solid: &Solid, time: f64) -> Solid {
        let mut moved = *solid;
        let way = self.velocity * time;
        if time == 0.0 || self.turn == Vector3::zeros() {
            moved.centre += way;
        } else {
            let turn = Rotation3::new(self.turn * time);
            moved.centre = self.centre + way + turn * (solid.centre - self.centre);
            moved.axes = turn * solid.axes;
        }
        moved
    }

    /// Largest speed at which the body's turning moves the surface of a solid.
    fn turning(&self, solid: &Solid) -> f64 {
        let turn = match solid.core {
            Core::Segment | Core::Cylinder => self.turn.cross(&solid.axis(2)),
            Core::Box | Core::HalfSpace => self.turn,
        };
        self.turn.norm() * (solid.centre - self.centre).norm() + turn.norm() * solid.half.norm()
    }

    /// Velocity of a point of the body where it is after a time.
    fn velocity_at(&self, point: &Vector3<f64>, time: f64) -> Vector3<f64> {
        let lever = point - self.centre - self.velocity * time;
        self.velocity + self.turn.cross(&lever)
    }
}

/// Two shapes that move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ahead {
    pub(super) solids: [Solid; 2],
    pub(super) motions: [Motion; 2],
}

/// Instant whose contacts count in the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Meeting {
    /// The beginning.
    AsNow,
    /// This later time (s), with the shapes where they are then.
    At(f64),
    Never,
}

/// The shapes at an instant.
#[derive(Debug, Clone, Copy)]
struct Look {
    time: f64,
    normal: Vector3<f64>,
    gap: f64,
    /// Rate of the gap \[m/s].
    rate: f64,
}

impl Ahead {
    /// The shapes after a time.
    pub(super) fn at(&self, time: f64) -> [Solid; 2] {
        [0, 1].map(|k| self.motions[k].moved(&self.solids[k], time))
    }

    /// Rate of the gap of a point of contact at a time \[m/s].
    pub(super) fn rate(&self, touch: &Touch, time: f64) -> f64 {
        let [v, w] = [0, 1].map(|k| self.motions[k].velocity_at(&touch.points[k], time));
        (v - w).dot(&touch.normal)
    }

    /// Points of contact at the beginning, had the shapes not turned.
    pub(super) fn before(&self, points: &[Vector3<f64>; 2], time: f64) -> [Vector3<f64>; 2] {
        [0, 1].map(|k| points[k] - self.motions[k].velocity * time)
    }

    /// The gap from which these velocities lead to that of a point of contact at a time \[m].
    pub(super) fn gap_before(&self, touch: &Touch, time: f64) -> f64 {
        match touch.gap() {
            gap if time > 0.0 => gap - self.rate(touch, time) * time,
            gap => gap,
        }
    }

    fn look(&self, time: f64) -> Look {
        let [a, b] = self.at(time);
        let (normal, gap) = match (a.core, b.core) {
            (Core::Segment, Core::Segment) => between_segments(&a, &b),
            _ => axis(&a, &b),
        };
        let points = [a.support(&-normal), b.support(&normal)];
        let rate = self.rate(&Touch { points, normal }, time);
        Look {
            time,
            normal,
            gap,
            rate,
        }
    }

    /// Instant of the contacts in a step `dt` (s). Shapes that stay apart by more than twice `near`
    /// (m) never meet; those closer than `near` do. `least` is the smallest dimension of the shapes
    /// (m). `faced` is true if they have contacts now.
    pub(super) fn meeting(&self, dt: f64, near: f64, least: f64, faced: bool) -> Meeting {
        let [a, b] = &self.motions;
        let turning = a.turning(&self.solids[0]) + b.turning(&self.solids[1]);
        let mut look = self.look(0.0);
        let (now, mut nearest) = (look.normal, look);
        // Between these instants the gap stops to shrink.
        let (mut before, mut after) = (0.0, None);
        for _ in 0..LOOKS {
            if look.gap < nearest.gap {
                nearest = look;
            }
            if look.rate >= 0.0 {
                after = after.or(Some(look.time));
            } else if after.is_none() {
                before = look.time;
            }
            let towards = turning - (a.velocity - b.velocity).dot(&look.normal);
            let touch = look.gap <= TOUCHING * least;
            if touch || look.time >= dt || towards <= 0.0 {
                if nearest.gap > 2.0 * near {
                    return Meeting::Never;
                }
                let passed = after.filter(|after| *after > before && !touch);
                let nearest =
                    passed.map_or(nearest, |after| self.passing([before, after], nearest));
                let alike = faced && (nearest.normal - now).norm() < ALIKE;
                return if alike {
                    Meeting::AsNow
                } else {
                    Meeting::At(nearest.time)
                };
            }
            let way = look.gap - if look.gap > 2.0 * near { near } else { 0.0 };
            look = self.look((look.time + way / towards).min(dt));
        }
        Meeting::AsNow
    }

    /// The closest instant between two, or the one that is known.
    fn passing(&self, [mut before, mut after]: [f64; 2], known: Look) -> Look {
        let mut nearest = known;
        for _ in 0..HALVINGS {
            let look = self.look(0.5 * (before + after));
            let bound = if look.rate < 0.0 {
                &mut before
            } else {
                &mut after
            };
            *bound = look.time;
            if look.gap < nearest.gap {
                nearest = look;
            }
        }
        nearest
    }
}
