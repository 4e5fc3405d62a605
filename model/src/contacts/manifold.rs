//! The points of contact of two shapes, from the direction in which they touch.
//!
//! Where that is the normal of a face, what lies on the face is cut off at its outline, and each corner that is left is a
//! point of contact with its own height over the face: four of a box on a plate, two of a cylinder on its side. A polygon
//! stands for a rim; where the rim crosses the outline of the other shape its own points are taken. Elsewhere two
//! edges touch, in one point, or in two where they are parallel. Two capsules touch as balls at their centre lines do: each of
//! their points has its own normal.
//!
//! Boxes and cylinders that overlap by less than a thousandth of their smallest dimension along two directions across each
//! other, of which one is normal to a face, have no contact: they miss each other by as little. So a body that slides over
//! boxes side by side, in which it rests with a small penetration, does not catch on the side faces between them. Inner edges
//! are left where it sinks in deeper than that, where the boxes' faces differ in height by more, and where it is tilted by
//! more than 10⁻³ rad. Others that overlap have at least one point: where the outlines of round faces, which have corners
//! here, do not reach each other, the one that is nearest to the middle of the face.

use nalgebra::Vector3;

use super::axis::{axis, pass};
use super::polygon::Polygon;
use super::solid::{Core, Solid};

/// Most points of a face: more say nothing new.
const MOST: usize = 8;
/// Sine of the angle below which capsules touch in two points.
const NEARLY_PARALLEL: f64 = 0.1;
/// Sine of the angle below which two edges touch in two points, with one normal.
const PARALLEL: f64 = 1e-3;
/// Overlap, over half of the smallest dimension, by which boxes and cylinders miss each other.
const FLUSH: f64 = 2e-3;
/// Rounding of lengths, over the size of the shapes.
const ROUNDING: f64 = 1e-11;

/// A point of contact, relative to the point of reference of the pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// On the surfaces of a and of b \[m].
    pub(super) points: [Vector3<f64>; 2],
    /// From b to a.
    pub(super) normal: Vector3<f64>,
}

impl Touch {
    /// From points of the cores.
    fn of_cores(a: &Solid, b: &Solid, cores: [Vector3<f64>; 2], normal: Vector3<f64>) -> Self {
        let points = [cores[0] - normal * a.radius, cores[1] + normal * b.radius];
        Self { points, normal }
    }

    /// \[m]
    pub(super) fn gap(&self) -> f64 {
        (self.points[0] - self.points[1]).dot(&self.normal)
    }
}

/// Appends the points of contact of `a` and `b` with a gap of at most `reach` (m).
pub(super) fn touch(a: &Solid, b: &Solid, reach: f64, found: &mut Vec<Touch>) {
    match (a.core, b.core) {
        (Core::HalfSpace, Core::HalfSpace) => {}
        (Core::HalfSpace, _) => on_plane(b, a, reach, |t| found.push(turned(t))),
        (_, Core::HalfSpace) => on_plane(a, b, reach, |t| found.push(t)),
        (Core::Segment, Core::Segment) => capsules(a, b, reach, found),
        _ => {
            let (normal, gap) = axis(a, b);
            let flush = FLUSH * a.half.min().min(b.half.min());
            if gap <= reach && !pass(a, b, (&normal, gap), flush) {
                solids(a, b, (normal, gap), reach, found);
            }
        }
    }
}

/// The contact with the two shapes exchanged.
fn turned(touch: Touch) -> Touch {
    let Touch {
        points: [a, b],
        normal,
    } = touch;
    Touch {
        points: [b, a],
        normal: -normal,
    }
}

/// A shape on a half-space.
fn on_plane(a: &Solid, plane: &Solid, reach: f64, mut push: impl FnMut(Touch)) {
    let normal = plane.axis(2);
    for corner in a.lying_along(&-normal).iter() {
        let point = corner - normal * a.radius;
        let gap = (point - plane.centre).dot(&normal);
        if gap <= reach {
            let points = [point, point - normal * gap];
            push(Touch { points, normal });
        }
    }
}

/// Balls about points of two segments.
fn capsules(a: &Solid, b: &Solid, reach: f64, found: &mut Vec<Touch>) {
    let rounding = ROUNDING * (a.size() + b.size());
    let (p, q) = (a.edge_along(&Vector3::z()), b.edge_along(&Vector3::z()));
    let at = |cores: [Vector3<f64>; 2]| Touch::of_cores(a, b, cores, between(a, b, cores));
    let closest = at(closest(p, q));
    let mut deepest = f64::INFINITY;
    let mut ends = overlap(p, q, NEARLY_PARALLEL).into_iter().flatten();
    let ends = [ends.next(), ends.next()];
    for s in ends.into_iter().flatten() {
        let on_a = p[0] + (p[1] - p[0]) * s;
        let touch = at([on_a, nearest_of(q, &on_a)]);
        deepest = deepest.min(touch.gap());
        if touch.gap() <= reach {
            found.push(touch);
        }
    }
    if closest.gap() <= reach && closest.gap() < deepest - rounding {
        found.push(closest);
    }
}

/// Direction from `b` to `a` in which two segments with radii are closest, and their gap \[m].
pub(super) fn between_segments(a: &Solid, b: &Solid) -> (Vector3<f64>, f64) {
    let cores = closest(a.edge_along(&Vector3::z()), b.edge_along(&Vector3::z()));
    let normal = between(a, b, cores);
    (normal, Touch::of_cores(a, b, cores, normal).gap())
}

/// Direction from a point of `b` to one of `a`, of two segments.
fn between(a: &Solid, b: &Solid, [p, q]: [Vector3<f64>; 2]) -> Vector3<f64> {
    let normal = (p - q).try_normalize(ROUNDING * (a.size() + b.size()));
    normal.unwrap_or_else(|| across_both(a, b))
}

/// A direction across the axes of two capsules whose axes cross, from `b` to `a`.
fn across_both(a: &Solid, b: &Solid) -> Vector3<f64> {
    let between = a.centre - b.centre;
    let both = a.axis(2).cross(&b.axis(2));
    let least = |u: &Vector3<f64>| {
        let mut v = Vector3::zeros();
        v[u.iamin()] = 1.0;
        v - u * u.dot(&v)
    };
    // Where they are parallel, across the longer: a sphere's axis means nothing.
    let long = if a.size() - a.radius >= b.size() - b.radius {
        a
    } else {
        b
    };
    let normal = both
        .try_normalize(1e-9)
        .unwrap_or_else(|| least(&long.axis(2)).normalize());
    if normal.dot(&between) < 0.0 {
        -normal
    } else {
        normal
    }
}

/// Points along a face's normal or of two edges.
fn solids(
    a: &Solid,
    b: &Solid,
    (normal, gap): (Vector3<f64>, f64),
    reach: f64,
    found: &mut Vec<Touch>,
) {
    let first = found.len();
    let faces = [a.face_along(&-normal), b.face_along(&normal)].map(|face| face.is_some());
    // A corner of a box on a round face is found exactly, the rim of a round face on a box is not, nor that of a wide one on
    // a narrow one.
    let on_round = faces[0] && a.core == Core::Cylinder && b.is_narrower(a);
    if faces[1] && !on_round {
        on_face(a, b, (normal, gap), reach, |t| found.push(t));
    } else if faces[0] {
        on_face(b, a, (-normal, gap), reach, |t| found.push(turned(t)));
    } else {
        edges(a, b, normal, reach, found);
    }
    if found.len() == first && gap <= 0.0 {
        let cores = [a.support(&-normal), b.support(&normal)];
        found.push(Touch::of_cores(a, b, cores, normal));
    }
}

/// Points of `above` on the face of `below` that has the outward normal `normal`.
fn on_face(
    above: &Solid,
    below: &Solid,
    (normal, overlap): (Vector3<f64>, f64),
    reach: f64,
    mut push: impl FnMut(Touch),
) {
    let Some((outward, face)) = below.face_along(&normal) else {
        return;
    };
    let rounding = ROUNDING * (above.size() + below.size());
    let lying = above.lying_along(&-outward);
    let crossings = rim_crossings(above, &lying, below, &face, &outward);
    let mut kept = if lying.len() == 2 && !crossings.is_empty() {
        Polygon::default()
    } else {
        lying
            .within(&face, &outward, rounding)
            .spread(&outward, MOST)
    };
    for corner in crossings.iter() {
        kept.push(*corner);
    }
    let inside = |p: &Vector3<f64>| {
        let flat = p - outward * (p - face[0]).dot(&outward);
        (below.nearest(&flat) - flat).norm() <= 10.0 * rounding
    };
    // The polygon of a round face cuts off corners that lie on the face itself.
    if below.core == Core::Cylinder {
        for corner in lying.iter().filter(|p| inside(p)) {
            if kept.iter().all(|k| (k - corner).norm() > 10.0 * rounding) {
                kept.push(*corner);
            }
        }
    }
    if kept.is_empty() {
        let middle = above.nearest_lying(&lying, &below.centre, &outward);
        if overlap <= 0.0 || inside(&middle) {
            kept.push(middle);
        }
    }
    for corner in kept.iter() {
        let point = corner - outward * above.radius;
        let gap = (point - face[0]).dot(&outward);
        if gap <= reach {
            let points = [point, point - outward * gap];
            push(Touch {
                points,
                normal: outward,
            });
        }
    }
}

/// Points of `lying` over which the rim of one shape crosses the straight outline of the other. The polygon that stands for a
/// rim is cut up to 8 % of the radius inside it: what tips over a rim would sink in between, and be thrown out by the next
/// corner that is found.
fn rim_crossings(
    above: &Solid,
    lying: &Polygon,
    below: &Solid,
    face: &Polygon,
    outward: &Vector3<f64>,
) -> Polygon {
    let is_round =
        |solid: &Solid, polygon: &Polygon| solid.core == Core::Cylinder && polygon.len() > 2;
    let mut found = Polygon::default();
    let (outline, rim) = match (is_round(above, lying), is_round(below, face)) {
        (true, false) => (face, above.rim(-above.axis(2).dot(outward).signum())),
        (false, true) => (lying, below.rim(below.axis(2).dot(outward).signum())),
        _ => return found,
    };
    // A segment has one side, not two.
    let sides = if outline.len() > 2 {
        outline.len()
    } else {
        outline.len() - 1
    };
    for i in 0..sides {
        let [start, end] = [outline[i], outline[(i + 1) % outline.len()]];
        let along = end - start;
        let Some(sideways) = along.cross(outward).try_normalize(0.0) else {
            continue;
        };
        let flat = outward.cross(&sideways);
        for point in rim.across(&sideways, sideways.dot(&start)) {
            let part = flat.dot(&(point - start)) / flat.dot(&along);
            if (0.0..=1.0).contains(&part) {
                let of_rim = std::ptr::eq(outline, face);
                found.push(if of_rim { point } else { start + along * part });
            }
        }
    }
    found
}

/// Two edges, or an edge and a round side.
fn edges(a: &Solid, b: &Solid, normal: Vector3<f64>, reach: f64, found: &mut Vec<Touch>) {
    let (p, q) = (a.edge_along(&-normal), b.edge_along(&normal));
    let mut push = |cores: [Vector3<f64>; 2]| {
        let touch = Touch::of_cores(a, b, cores, normal);
        let offset = touch.points[0] - touch.points[1];
        let sideways = (offset - normal * offset.dot(&normal)).norm();
        // Edges that pass by each other do not touch.
        if touch.gap() <= reach && (sideways <= reach || touch.gap() <= 0.0) {
            found.push(touch);
        }
    };
    match overlap(p, q, PARALLEL) {
        Some(ends) => {
            for s in ends {
                let on_a = p[0] + (p[1] - p[0]) * s;
                push([on_a, nearest_of(q, &on_a)]);
            }
        }
        None => push(closest(p, q)),
    }
}

/// Parts of segment `p`, from 0 to 1, between which `q` is beside it; `None` where they are not parallel up to the sine
/// `parallel` of an angle, or not beside each other.
fn overlap(p: [Vector3<f64>; 2], q: [Vector3<f64>; 2], parallel: f64) -> Option<[f64; 2]> {
    let (u, v) = (p[1] - p[0], q[1] - q[0]);
    let (length, other) = (u.norm_squared(), v.norm_squared());
    let sine = u.cross(&v).norm();
    if !(length > 0.0 && other > 0.0 && sine <= parallel * (length * other).sqrt()) {
        return None;
    }
    let [s, t] = q.map(|end| (end - p[0]).dot(&u) / length);
    let ends = [s.min(t).max(0.0), s.max(t).min(1.0)];
    (ends[1] - ends[0] > 1e-9).then_some(ends)
}

/// The point of a segment nearest to `p`.
pub(super) fn nearest_of([start, end]: [Vector3<f64>; 2], p: &Vector3<f64>) -> Vector3<f64> {
    let along = end - start;
    let length = along.norm_squared();
    if length == 0.0 {
        return start;
    }
    start + along * ((p - start).dot(&along) / length).clamp(0.0, 1.0)
}

/// The nearest points of two segments.
fn closest(p: [Vector3<f64>; 2], q: [Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
    let (u, v, w) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    // The square of the area that they span, without the cancellation of |u|² |v|² − (u·v)².
    let normal = u.cross(&v);
    let area = normal.norm_squared();
    if area > 1e-18 * u.norm_squared() * v.norm_squared() {
        let s = -w.cross(&v).dot(&normal) / area;
        let t = -w.cross(&u).dot(&normal) / area;
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            return [p[0] + u * s, q[0] + v * t];
        }
    }
    // Else an end of one of them is nearest to the other.
    let pairs = [
        [p[0], nearest_of(q, &p[0])],
        [p[1], nearest_of(q, &p[1])],
        [nearest_of(p, &q[0]), q[0]],
        [nearest_of(p, &q[1]), q[1]],
    ];
    let apart = |pair: &[Vector3<f64>; 2]| (pair[0] - pair[1]).norm_squared();
    let nearest = pairs
        .into_iter()
        .min_by(|x, y| apart(x).total_cmp(&apart(y)));
    nearest.unwrap_or(pairs[0])
}
