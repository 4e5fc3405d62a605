//! The direction in which two shapes are apart, or overlap least.
//!
//! For a unit vector n, a and b the support points of the cores along −n and n, and r the radii,
//!
//! ```text
//! s(n) = (a(−n) − b(n)) · n − r_a − r_b
//! ```
//!
//! is how far a plane across n separates shape b from shape a. Its maximum over n is the distance of shapes that are apart and
//! minus the smallest translation that separates shapes that overlap, and s(n) never says more than that: a direction that is not
//! the best understates the gap and nothing else.
//!
//! Where a core is a point or a segment, and the cores are apart, n is along their shortest connection. The distance from a
//! segment to a convex solid is convex along it, so that a bisection of its slope finds that. Else the difference of the
//! cores is a convex solid with the origin inside, and s is largest at a point of its surface: on a face of it, which
//! belongs to a face of a or b or to two edges of them, or where it is round. There n is across an edge or axis of one of
//! them, and a search over that circle finds it, or the rims of two cylinders cross, and n is across both. No
//! simplex grows in any of this, so that there is nothing that could degenerate. Of boxes that are apart nothing else is
//! looked for: two corners, or a corner and an edge, count as apart by a little less than they are.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::solid::{Core, Solid};

/// Steps of a bisection: more than the digits of a number.
const HALVINGS: usize = 60;
/// Directions that a search over a circle begins with.
const SAMPLES: usize = 24;
/// Distance of cores over their size below which their connection has no direction to speak of.
const CLOSE: f64 = 1e-6;
/// Most turns of an improvement, each of two circles.
const CLIMBS: usize = 20;
/// Overlap over the size beyond which the direction of two rims is improved.
const DEEP: f64 = 1e-3;
/// By how much another direction has to be better, over the size: rounding does not decide between a face and an edge.
const BETTER: f64 = 1e-11;

/// By how much a direction across two edges or rims, which touch in one point, has to be better,
/// over the size: bodies that rock on each other keep the corners of their faces.
const CLEARLY: f64 = 1e-3;
/// Cosine between the normal of a face and another direction, above which the shapes stand on the face and do not pass beside it.
const UPRIGHT: f64 = 0.9;
/// Cosine between directions that count as perpendicular where two faces are flush.
const ACROSS: f64 = 1e-3;

/// s(n) \[m].
pub(super) fn separation(a: &Solid, b: &Solid, n: &Vector3<f64>) -> f64 {
    (a.support(&-n) - b.support(n)).dot(n) - a.radius - b.radius
}

/// The direction n from `b` towards `a` with the largest s(n), and that. Not of half-spaces, nor of two segments.
pub(super) fn axis(a: &Solid, b: &Solid) -> (Vector3<f64>, f64) {
    let apart = match (a.core, b.core) {
        (Core::Segment, _) => connection(a, b),
        (_, Core::Segment) => connection(b, a).map(|n| -n),
        _ => None,
    };
    apart.map_or_else(
        || Search::over(a, b),
        |n| {
            // Exactly the normal of a face where it is that but for rounding.
            let face = a.face_along(&-n).map(|(normal, _)| -normal);
            let n = face
                .or_else(|| b.face_along(&n).map(|(normal, _)| normal))
                .unwrap_or_else(|| lying(a, b, n));
            (n, separation(a, b, &n))
        },
    )
}

/// The normal of a face on which a capsule lies, or else `n`, the direction of their shortest connection. Where the capsule
/// reaches over an edge of the face and is tilted by next to nothing, it is nearest to that edge, and would touch it in one
/// point.
fn lying(a: &Solid, b: &Solid, n: Vector3<f64>) -> Vector3<f64> {
    let (capsule, solid, sign) = match a.core {
        Core::Segment => (a, b, 1.0),
        _ => (b, a, -1.0),
    };
    if capsule.half.z == 0.0 {
        return n;
    }
    let clearly = CLEARLY * a.size().min(b.size());
    let most = separation(a, b, &n) - clearly;
    let lies = |m: &Vector3<f64>| {
        let near = m.dot(&n) > UPRIGHT && (most..clearly).contains(&separation(a, b, m));
        let face = solid.face_along(&(m * sign)).filter(|_| near);
        face.is_some_and(|(outward, face)| {
            let line = capsule.lying_along(&-outward);
            line.within(&face, &outward, CLOSE * clearly).len() > 1
        })
    };
    let mut normals = solid.faces().map(|m| m * m.dot(&n).signum());
    normals.find(lies).unwrap_or(n)
}

/// True if boxes or cylinders with s(n) = `gap` along n just miss each other. Another face across n
/// passes over or under the other shape up to `flush` (m), and the overlap along n is no larger.
pub(super) fn pass(a: &Solid, b: &Solid, (n, gap): (&Vector3<f64>, f64), flush: f64) -> bool {
    let misses = |m: Vector3<f64>| {
        let apart = || separation(a, b, &m).max(separation(a, b, &-m));
        m.dot(n).abs() < ACROSS && apart().abs() <= flush
    };
    gap >= -flush && a.faces().chain(b.faces()).any(misses)
}

/// Direction of the shortest connection from `solid` to the segment `a`, where they are apart.
fn connection(a: &Solid, solid: &Solid) -> Option<Vector3<f64>> {
    let [start, end] = a.edge_along(&Vector3::z());
    let along = end - start;
    let away = |t: f64| {
        let p = start + along * t;
        p - solid.nearest(&p)
    };
    let slope = |t: f64| away(t).dot(&along);
    let t = if slope(0.0) >= 0.0 {
        0.0
    } else if slope(1.0) <= 0.0 {
        1.0
    } else {
        bisect([0.0, 1.0], slope)
    };
    let shortest = away(t);
    let length = shortest.norm();
    (length > CLOSE * (a.size() + solid.size())).then(|| shortest / length)
}

/// Where a slope turns from negative to positive.
fn bisect([mut low, mut high]: [f64; 2], slope: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if slope(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The best direction so far.
struct Search<'a> {
    a: &'a Solid,
    b: &'a Solid,
    best: (Vector3<f64>, f64),
    better: f64,
}

impl<'a> Search<'a> {
    /// The best of all directions. The ones that come first win where others are as good but for rounding.
    fn over(a: &'a Solid, b: &'a Solid) -> (Vector3<f64>, f64) {
        let size = a.size() + b.size();
        let mut search = Self {
            a,
            b,
            best: (Vector3::z(), f64::NEG_INFINITY),
            better: BETTER * size,
        };
        a.faces().chain(b.faces()).for_each(|n| search.try_both(&n));
        search.better = CLEARLY * size;
        for e in a.edges() {
            b.edges().for_each(|f| search.try_along(&e.cross(&f), 1e-9));
        }
        search.better = BETTER * size;
        let flat = search.best;
        let round = |s: &Solid| s.core == Core::Cylinder;
        if !(round(a) || round(b)) {
            return flat;
        }
        for solid in [a, b] {
            if round(solid) {
                let axis = solid.axis(2);
                let between = a.centre - b.centre;
                search.try_along(&(between - axis * axis.dot(&between)), 1e-9 * size);
            }
        }
        let edges = a.edges().chain(b.edges());
        edges.for_each(|e| search.around(&e));
        if round(a) && round(b) {
            for [i, j] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
                search.rims([i, j]);
            }
            search.climb();
        }
        // A rim touches in one point, too: what stands on a round face keeps the corners that carry it.
        let (clearly, best) = (CLEARLY * size, search.best);
        let stands = flat.1.abs() <= clearly && flat.0.dot(&best.0) > UPRIGHT;
        if stands && best.1 <= flat.1 + clearly {
            flat
        } else {
            best
        }
    }

    /// Improves the direction between two cylinders that overlap deeply, where rims cross otherwise than at their closest
    /// points: along two circles through it that are across each other, in turns.
    fn climb(&mut self) {
        let deep = DEEP * (self.a.size() + self.b.size());
        for _ in 0..CLIMBS {
            let before = self.best;
            let Some([u, v]) = across(&before.0).filter(|_| before.1 < -deep) else {
                return;
            };
            self.around(&u);
            self.around(&v);
            if self.best == before {
                return;
            }
        }
    }

    /// Both directions of a vector that is longer than `least`, and not of what rounding leaves.
    fn try_along(&mut self, direction: &Vector3<f64>, least: f64) {
        if let Some(n) = direction.try_normalize(least) {
            self.try_both(&n);
        }
    }

    fn try_both(&mut self, n: &Vector3<f64>) {
        self.try_one(*n);
        self.try_one(-n);
    }

    fn try_one(&mut self, n: Vector3<f64>) {
        let gap = separation(self.a, self.b, &n);
        if gap > self.best.1 + self.better {
            self.best = (n, gap);
        }
    }

    /// The directions across `edge`.
    fn around(&mut self, edge: &Vector3<f64>) {
        let Some([u, v]) = across(edge) else {
            return;
        };
        let (a, b) = (self.a, self.b);
        // No support points are farther apart, and |ds/dθ| is no larger.
        let reach = (a.centre - b.centre).norm() + a.size() + b.size();
        let at = |angle: f64| u * angle.cos() + v * angle.sin();
        // Minus the slope, for the bisection looks for a minimum.
        let slope = |angle: f64| {
            let n = at(angle);
            let turned = v * angle.cos() - u * angle.sin();
            (b.support(&n) - a.support(&-n)).dot(&turned)
        };
        // About the axis of a round shape all directions may be as good, and none a maximum.
        self.try_one(u);
        let step = TAU / SAMPLES as f64;
        for i in 0..SAMPLES {
            let ends = [i as f64 * step, (i + 1) as f64 * step];
            let best_here = separation(a, b, &at(0.5 * (ends[0] + ends[1]))) + reach * step;
            if best_here > self.best.1 && slope(ends[0]) < 0.0 && slope(ends[1]) >= 0.0 {
                self.try_one(at(bisect(ends, slope)));
            }
        }
    }

    /// The directions across the rims of two cylinders, at the ends that the signs name, where the rims are closest.
    fn rims(&mut self, ends: [f64; 2]) {
        let ([a, b], [i, j]) = ([self.a, self.b], ends);
        let (of_a, of_b) = (a.rim(i), b.rim(j));
        let tangent = |angle: f64| of_a.at(angle + 0.25 * TAU) - of_a.middle;
        let slope = |angle: f64| {
            let p = of_a.at(angle);
            (p - of_b.nearest(&p)).dot(&tangent(angle))
        };
        let step = TAU / SAMPLES as f64;
        for k in 0..SAMPLES {
            let interval = [k as f64 * step, (k + 1) as f64 * step];
            // Where they are closest, or in a deep overlap farthest from each other.
            let sign = if slope(interval[0]) < 0.0 { 1.0 } else { -1.0 };
            if sign * slope(interval[1]) >= 0.0 {
                let angle = bisect(interval, |angle| sign * slope(angle));
                let other = of_b.nearest(&of_a.at(angle));
                let other = b.axis(2).cross(&(other - of_b.middle));
                let both = tangent(angle).normalize().cross(&other.normalize());
                self.try_along(&both, 1e-9);
            }
        }
    }
}

/// Two unit vectors across `direction` and each other.
pub(super) fn across(direction: &Vector3<f64>) -> Option<[Vector3<f64>; 2]> {
    let axes = crate::frame::axes_along(direction)?;
    Some([1, 2].map(|k| axes.column(k).into_owned()))
}
