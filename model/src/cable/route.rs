//! The polyline that a cable follows, cut into chords, and the directions across it.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::{Cable, CableEnd, MAX_SEGMENTS, Segments};
use crate::error::{SceneError, check, refuse};
use crate::frame::{hanging_axes, smallest_rotation};
use crate::params::check_count;
use crate::scene::Scene;

/// Tolerance of the given lengths' sum against the length of the route, relative.
const SUM_TOLERANCE: f64 = 1e-9;

/// Part of its arc that a chord is at least: a segment that cuts off more of its route is no picture of it.
const SHORTEST_CHORD: f64 = 0.5;

/// Cosine of the sharpest corner of a route: a fold has no plane to carry directions in.
const FOLD: f64 = 1e-9 - 1.0;

/// A polyline of straight legs.
pub(super) struct Route {
    points: Vec<Vector3<f64>>,
    /// Arc length up to each point \[m].
    arcs: Vec<f64>,
}

/// A segment in its place on the route.
pub(super) struct PlacedSegment {
    pub(super) centre: Vector3<f64>,
    pub(super) turn: UnitQuaternion<f64>,
    /// Length of the rod, the chord, and of the cable that it stands for, the arc \[m].
    pub(super) chord: f64,
    pub(super) arc: f64,
    direction: Vector3<f64>,
}

impl PlacedSegment {
    /// Axes of a frame in the body of this segment that lie along those of a cable turned by `turn`.
    pub(super) fn axes_of(&self, turn: &UnitQuaternion<f64>) -> Matrix3<f64> {
        (self.turn.inverse() * turn).to_rotation_matrix() * hanging_axes()
    }

    /// The segment's rotation, carried to another direction.
    pub(super) fn carried(&self, direction: &Vector3<f64>) -> UnitQuaternion<f64> {
        smallest_rotation(&self.direction, direction) * self.turn
    }
}

/// The rotation halfway between those of two neighbours.
pub(super) fn halfway(a: &PlacedSegment, b: &PlacedSegment) -> UnitQuaternion<f64> {
    a.carried(&(a.direction + b.direction).normalize())
}

/// Some rotation that takes −z to the unit vector `direction`: none where that is −z.
fn first_rotation(direction: &Vector3<f64>) -> UnitQuaternion<f64> {
    if direction.z <= 0.0 {
        return smallest_rotation(&-Vector3::z(), direction);
    }
    let up = UnitQuaternion::from_quaternion(Quaternion::new(0.0, 0.0, 1.0, 0.0));
    smallest_rotation(&Vector3::z(), direction) * up
}

impl Route {
    /// The route of a cable in the scene that holds its ends, at `time` (s).
    pub(super) fn of(cable: &Cable, scene: &Scene, time: f64) -> Result<Self, SceneError> {
        let [start, end] = &cable.ends;
        let start = place(cable, scene, start, ("start", time))?;
        let end = place(cable, scene, end, ("end", time))?;
        let between = cable.points.iter().copied();
        let points: Vec<_> = std::iter::once(start).chain(between).chain([end]).collect();
        let mut arcs = vec![0.0; points.len()];
        for (i, pair) in points.windows(2).enumerate() {
            let leg = (pair[1] - pair[0]).norm();
            if leg == 0.0 {
                let reason = "are in one place: move or remove one of them";
                let points = format!("points {} and {} of the route", i + 1, i + 2);
                return refuse(cable.what(&points), reason);
            }
            let of = cable.what(&format!("leg {} of the route", i + 1));
            let needs = "finite coordinates, each point apart from the next by a length (m)";
            check(of, leg, true, needs)?;
            arcs[i + 1] = arcs[i] + leg;
        }
        let route = Self { points, arcs };
        let legs = 0..route.points.len() - 1;
        let folds = |leg: &usize| route.direction(leg - 1).dot(&route.direction(*leg)) < FOLD;
        if let Some(leg) = legs.skip(1).find(folds) {
            let reason = "is a fold: give the route a turn of less than 180° there";
            let point = format!("point {} of the route", leg + 1);
            return refuse(cable.what(&point), reason);
        }
        Ok(route)
    }

    /// Length of the route \[m].
    pub(super) fn length(&self) -> f64 {
        self.arcs[self.arcs.len() - 1]
    }

    /// Direction of the route at its end 0 or 1.
    pub(super) fn direction_at(&self, end: usize) -> Vector3<f64> {
        self.direction(end * (self.points.len() - 2))
    }

    fn direction(&self, leg: usize) -> Vector3<f64> {
        (self.points[leg + 1] - self.points[leg]).normalize()
    }

    /// The segments of the cable along this route.
    pub(super) fn segments(&self, cable: &Cable) -> Result<Vec<PlacedSegment>, SceneError> {
        let lengths = self.lengths(cable)?;
        let mut placed: Vec<PlacedSegment> = Vec::with_capacity(lengths.len());
        let (mut start, mut leg) = (0.0, 0);
        let mut from = self.points[0];
        for (i, length) in lengths.iter().enumerate() {
            let last = i + 1 == lengths.len();
            let arc = match &cable.segments {
                Segments::Equal(count) => self.length() * ((i + 1) as f64 / *count as f64),
                Segments::Lengths(_) => start + length,
            };
            let [first_leg, last_leg] = self.legs(leg, [start, arc], last);
            start = arc;
            leg = last_leg;
            let to = match last {
                true => self.points[self.points.len() - 1],
                false => {
                    self.points[last_leg] + self.direction(last_leg) * (arc - self.arcs[last_leg])
                }
            };
            // On one leg, chord and arc are the same: to the last digit, too.
            let (direction, chord) = match first_leg == last_leg {
                true => (self.direction(first_leg), *length),
                false => ((to - from).normalize(), (to - from).norm()),
            };
            let turned = placed.last().map(|b| b.direction.dot(&direction));
            let sharp = turned.is_some_and(|cosine| cosine < FOLD);
            if sharp || chord.is_nan() || chord < SHORTEST_CHORD * length {
                let reason = "cuts off too much of a corner of its route: take another number of `segments`, or give `lengths` with \
                             a joint at the corner";
                return refuse(cable.what(&format!("segment {}", i + 1)), reason);
            }
            let turn = match placed.last() {
                None => first_rotation(&direction),
                Some(before) => before.carried(&direction),
            };
            placed.push(PlacedSegment {
                centre: 0.5 * (from + to),
                turn,
                chord,
                arc: *length,
                direction,
            });
            from = to;
        }
        Ok(placed)
    }

    /// The legs that an arc begins and ends on, at or after `leg`. A point within rounding of a corner counts for the leg
    /// that the arc has there.
    fn legs(&self, mut leg: usize, [start, end]: [f64; 2], last: bool) -> [usize; 2] {
        let rounding = 1e-12 * self.length();
        let legs = self.points.len() - 1;
        while leg + 1 < legs && self.arcs[leg + 1] <= start + rounding {
            leg += 1;
        }
        let first = leg;
        while leg + 1 < legs && (last || self.arcs[leg + 1] < end - rounding) {
            leg += 1;
        }
        [first, leg]
    }

    /// Arc lengths of the segments \[m].
    fn lengths(&self, cable: &Cable) -> Result<Vec<f64>, SceneError> {
        let whole = self.length();
        let count = match &cable.segments {
            Segments::Equal(count) => *count,
            Segments::Lengths(lengths) => lengths.len(),
        };
        check_count("segments", count, MAX_SEGMENTS)?;
        let of = cable.what("segments");
        check(of, count as f64, count > 0, "at least 1")?;
        let lengths = match &cable.segments {
            Segments::Equal(count) => return Ok(vec![whole / *count as f64; *count]),
            Segments::Lengths(lengths) => lengths,
        };
        for (i, length) in lengths.iter().enumerate() {
            let of = cable.what(&format!("length of segment {}", i + 1));
            check(of, *length, *length > 0.0, "> 0 m")?;
        }
        let sum: f64 = lengths.iter().sum();
        let adds_up = (sum / whole - 1.0).abs() <= SUM_TOLERANCE;
        let of = format!("sum of the segments' lengths on a route of {whole} m");
        check(cable.what(&of), sum, adds_up, "the length of the route")?;
        Ok(lengths.clone())
    }
}

/// Position of an end, world \[m].
fn place(
    cable: &Cable,
    scene: &Scene,
    end: &CableEnd,
    (which, time): (&str, f64),
) -> Result<Vector3<f64>, SceneError> {
    let frame = match end {
        CableEnd::Free(point) => return Ok(*point),
        CableEnd::Pinned(frame) | CableEnd::Clamped(frame) => frame,
    };
    match frame.body_index() {
        Some(body) if body >= scene.bodies.len() => {
            Err(scene.unknown_body(&cable.what(which), body))
        }
        _ => Ok(frame.resolve(&scene.bodies, time).point()),
    }
}
