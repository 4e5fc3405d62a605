//! Sheaves: wheels that a massless cable runs over.
//!
//! A sheave has its hub c and axis a = u of its frame, radius r, and turns with what its frame is fixed to. The cable
//! travels in the positive sense about a; with the frame's v and w it touches the groove from the angle α to the angle ω,
//!
//! ```text
//! n(α) = cos α v + sin α w,   t(α) = a × n,   points c + r n(α), c + r n(ω),   wrap θ = ω − α
//! Λ = Σ |p_B − p_A| + Σ r θ,   F_A = n(ω_A)·(p_B − c_A) − r_A = 0,   F_B = n(α_B)·(p_A − c_B) − r_B = 0
//! ```
//!
//! for the spans from A to B. A point at the distance D and the angle γ has the tangents ω = γ − acos(r/D), α = γ + acos(r/D);
//! between two wheels Newton's method goes on from there. Full turns are those of the step before.
//!
//! **Gradient.** With d the direction of a span, ∂Λ/∂ω_A = r_A (1 − d·t_A) and ∂Λ/∂α_B = −r_B (1 − d·t_B) vanish in the
//! plane of the wheel: Λ then has the gradient of two points that are fixed to A and B. Out of the plane
//!
//! ```text
//! ∇Λ = d·δp_B − d·δp_A − η_A ∇F_A − η_B ∇F_B,    [∂F/∂(ω_A, α_B)]ᵀ η = (∂Λ/∂ω_A, ∂Λ/∂α_B)
//! ```
//!
//! which is exact for the length as defined. What is not modelled is the groove: a cable that may climb sideways by w in it
//! is shorter by at most w β/2 at each tangent point, β being the fleet angle. All torques about the hub go to what the frame
//! is fixed to, about the axis r (T_B − T_A).
//!
//! An end on a sheave is a **drum**: the cable is fastened to it at an angle that stays, and θ is what lies on it.
//! An inner sheave that the cable leaves is off until the cable lies across it again. Turns are counted from step to step, in
//! each of which a sheave has to turn by less than half of one.

use nalgebra::Vector3;
use std::f64::consts::TAU;

use super::unwrap_angle;
use crate::frame::Resolved;

/// Newton passes of a span between two wheels: four are enough.
const PASSES: usize = 20;

/// A change of the angles that leaves an error of its square \[rad].
const SMALL: f64 = 1e-8;

/// Cosine of the fleet angle beyond which a cable does not lie down in a groove.
const STEEP: f64 = 0.97;

/// A bend the other way that is rounding \[rad].
const STRAIGHT: f64 = 1e-9;

/// Cosine of the fleet angle beyond which a groove does not hold a cable.
const OBLIQUE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Distance from a wheel's plane within which a cable lies down on it, over its radius.
const GROOVE: f64 = 0.25;

/// Largest wrap with which a cable lies down on a sheave \[rad]: more would have passed through it.
pub(super) const LANDING: f64 = 1.0;

/// A wheel at a point of a [`MasslessCable`](super::MasslessCable): its hub is the frame's point, its axis the frame's u,
/// about which the cable travels in the positive sense.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sheave {
    /// Radius of the cable's middle in the groove \[m], > 0.
    pub radius: f64,
    /// Turns on it at first, ≥ 0. Inner sheave: whole turns, added to the fraction that the path gives. Drum: all turns.
    pub turns: f64,
    /// Coefficient of Coulomb friction μ ≥ 0 of an inner sheave, over which [`Scene::reeve`](crate::Scene::reeve) cuts the
    /// cable; 0 lets it slide freely.
    #[cfg_attr(feature = "serde", serde(default))]
    pub friction: f64,
    /// True at an end where the cable is fastened but goes on as another constraint: this end is no
    /// drum.
    #[cfg_attr(feature = "serde", serde(default))]
    pub shared: bool,
    /// Its contact with the cable.
    #[cfg_attr(feature = "serde", serde(rename = "lay"))]
    pub contact: SheaveContact,
}

impl Sheave {
    /// A sheave of a radius \[m] with less than a turn on it.
    #[must_use]
    pub fn new(radius: f64) -> Self {
        Self {
            radius,
            ..Self::default()
        }
    }
}

/// Name of a cable's sheave in errors.
pub(crate) fn side_name(cable: &str, side: usize) -> String {
    format!("{cable}: sheave {}", side + 1)
}

/// Contact of a cable with a sheave.
#[non_exhaustive]
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum SheaveContact {
    /// Not known yet: the path decides.
    #[default]
    New,
    /// No contact: the cable passes by.
    Off {
        /// True if the cable was last seen on the groove's side: from the far side it cannot lie
        /// down.
        clear: bool,
    },
    /// From one angle to the other in the frame's v and w, unwrapped \[rad].
    On {
        /// Angle of arrival; at a drum at the beginning, that of the fastening.
        arriving: f64,
        /// Angle of departure; at a drum at the end, that of the fastening.
        leaving: f64,
    },
}

impl SheaveContact {
    /// True if the cable passes by.
    #[must_use]
    pub fn is_off(self) -> bool {
        matches!(self, Self::Off { .. })
    }

    pub(super) fn arriving(self) -> Option<f64> {
        match self {
            Self::On { arriving, .. } => Some(arriving),
            _ => None,
        }
    }

    pub(super) fn leaving(self) -> Option<f64> {
        match self {
            Self::On { leaving, .. } => Some(leaving),
            _ => None,
        }
    }
}

/// A point of a path at one instant: a wheel, or with the radius 0 a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wheel {
    /// Centre of mass of what it is fixed to, and the hub.
    pub(super) centre: Vector3<f64>,
    hub: Vector3<f64>,
    /// Axis, v and w.
    axes: [Vector3<f64>; 3],
    radius: f64,
}

impl Wheel {
    pub(super) fn new(at: &Resolved, radius: f64) -> Self {
        Self {
            centre: at.centre,
            hub: at.point(),
            axes: [at.u(), at.v(), at.w()],
            radius,
        }
    }

    /// n and t at an angle.
    fn directions(&self, angle: f64) -> [Vector3<f64>; 2] {
        let ([_, v, w], (sine, cosine)) = (&self.axes, angle.sin_cos());
        [v * cosine + w * sine, w * cosine - v * sine]
    }

    /// c + r n.
    fn point(&self, angle: f64) -> Vector3<f64> {
        self.hub + self.directions(angle)[0] * self.radius
    }

    fn is_point(&self) -> bool {
        self.radius == 0.0
    }

    /// Angle of the tangent through a point, on which a cable leaves (`side` −1) or arrives (1);
    /// NaN for a point inside.
    fn tangent(&self, through: &Vector3<f64>, side: f64) -> f64 {
        let ([_, v, w], to) = (&self.axes, through - self.hub);
        let (x, y) = (v.dot(&to), w.dot(&to));
        y.atan2(x) + side * (self.radius / x.hypot(y)).acos()
    }

    /// Lever arm of the hub.
    pub(super) fn arm(&self) -> Vector3<f64> {
        self.hub - self.centre
    }
}

/// A force at a point with a torque besides, as what acts on the centre of a body.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pull {
    pub(super) force: Vector3<f64>,
    pub(super) torque: Vector3<f64>,
}

impl Pull {
    fn add(&mut self, force: Vector3<f64>, arm: &Vector3<f64>) {
        self.force += force;
        self.torque += arm.cross(&force);
    }

    pub(super) fn plus(self, other: &Self) -> Self {
        Self {
            force: self.force + other.force,
            torque: self.torque + other.torque,
        }
    }
}

/// A straight span from one wheel to the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    /// ω of the first wheel and α of the second; 0 of a point.
    pub(super) angles: [f64; 2],
    pub(super) length: f64,
    /// Gradient of Λ on both sides.
    pub(super) gradient: [Pull; 2],
    points: [Vector3<f64>; 2],
    /// The least cosine of the fleet angles; 1 between points.
    least_cosine: f64,
}

/// F of both ends at some angles, with what its derivatives are made of.
struct Closure {
    points: [Vector3<f64>; 2],
    normal: [Vector3<f64>; 2],
    along: [Vector3<f64>; 2],
    /// From each hub to the other's point.
    to: [Vector3<f64>; 2],
    /// ∂F/∂(ω, α), by rows; the row and column of a point are those of the identity.
    matrix: [[f64; 2]; 2],
    residual: [f64; 2],
}

impl Closure {
    fn at(ends: [&Wheel; 2], angles: [f64; 2]) -> Self {
        let [(na, ta), (nb, tb)] = [0, 1].map(|k| {
            let [normal, along] = ends[k].directions(angles[k]);
            (normal, along)
        });
        let [a, b] = ends;
        let points = [a.hub + na * a.radius, b.hub + nb * b.radius];
        let to = [points[1] - a.hub, points[0] - b.hub];
        let mut matrix = [
            [ta.dot(&to[0]), b.radius * na.dot(&tb)],
            [a.radius * nb.dot(&ta), tb.dot(&to[1])],
        ];
        let mut residual = [na.dot(&to[0]) - a.radius, nb.dot(&to[1]) - b.radius];
        for (k, end) in ends.iter().enumerate() {
            if end.is_point() {
                (matrix[k][k], matrix[k][1 - k], matrix[1 - k][k]) = (1.0, 0.0, 0.0);
                residual[k] = 0.0;
            }
        }
        Self {
            points,
            normal: [na, nb],
            along: [ta, tb],
            to,
            matrix,
            residual,
        }
    }

    /// x with A x = `of`, or with Aᵀ.
    fn solve(&self, of: [f64; 2], transposed: bool) -> [f64; 2] {
        let [[a, b], [c, d]] = self.matrix;
        let [b, c] = if transposed { [c, b] } else { [b, c] };
        let inverse = 1.0 / (a * d - b * c);
        [
            (d * of[0] - b * of[1]) * inverse,
            (a * of[1] - c * of[0]) * inverse,
        ]
    }
}

/// The angles of a span, of full turns those next to the last ones. They depend on nothing else of these, so that a state
/// has one length, however it was reached.
fn touching(ends: [&Wheel; 2], last: [Option<f64>; 2]) -> [f64; 2] {
    let [a, b] = ends;
    let found = match [a.is_point(), b.is_point()] {
        [true, true] => return [0.0; 2],
        [false, true] => [a.tangent(&b.hub, -1.0), 0.0],
        [true, false] => [0.0, b.tangent(&a.hub, 1.0)],
        [false, false] => between_wheels(ends),
    };
    [0, 1].map(|k| last[k].map_or(found[k], |last| unwrap_angle(found[k], last)))
}

/// By Newton's method from each wheel's tangent through the other one's point; NaN where there is none.
fn between_wheels(ends: [&Wheel; 2]) -> [f64; 2] {
    let [a, b] = ends;
    let mut angles = [a.tangent(&b.hub, -1.0), 0.0];
    angles[1] = b.tangent(&a.point(angles[0]), 1.0);
    for _ in 0..PASSES {
        let closure = Closure::at(ends, angles);
        let step = closure.solve(closure.residual, false);
        angles = [angles[0] - step[0], angles[1] - step[1]];
        let size = step[0].abs().max(step[1].abs());
        if size <= SMALL {
            // The cable arrives on the other one of two tangents, and leaves towards what is ahead.
            let [[leaves, _], [_, arrives]] = closure.matrix;
            if leaves > 0.0 && arrives < 0.0 {
                return angles;
            }
            break;
        }
    }
    [f64::NAN; 2]
}

impl Span {
    /// The span between two wheels, which last touched them at these angles.
    pub(super) fn between(ends: [&Wheel; 2], last: [Option<f64>; 2]) -> Self {
        let angles = touching(ends, last);
        let closure = Closure::at(ends, angles);
        let Closure {
            points,
            normal,
            along,
            to,
            ..
        } = &closure;
        let (length, direction) = super::distance::direction(&(points[1] - points[0]));
        let cosine = along.map(|t| direction.dot(&t));
        let wheel = |k: usize| !ends[k].is_point();
        let bends = [0, 1].map(|k| {
            let sign = [1.0, -1.0][k];
            if wheel(k) {
                sign * ends[k].radius * (1.0 - cosine[k])
            } else {
                0.0
            }
        });
        let eta = closure.solve(bends, true);
        let mut gradient = [Pull::default(); 2];
        for k in 0..2 {
            let [own, other] = [k, 1 - k];
            let arm = points[k] - ends[k].centre;
            gradient[k].add(direction * [-1.0, 1.0][k], &arm);
            if wheel(own) {
                gradient[k].add(normal[own] * eta[own], &ends[own].arm());
                gradient[k].torque -= normal[own].cross(&to[own]) * eta[own];
            }
            if wheel(other) {
                gradient[k].add(normal[other] * -eta[other], &arm);
            }
        }
        Self {
            angles,
            length,
            gradient,
            points: *points,
            least_cosine: [0, 1]
                .into_iter()
                .filter(|&k| wheel(k))
                .map(|k| cosine[k])
                .fold(1.0, f64::min),
        }
    }
}

/// A wheel of a path with what is known of it.
struct Item {
    side: usize,
    wheel: Wheel,
    sheave: Option<Sheave>,
}

impl Item {
    fn contact(&self) -> SheaveContact {
        self.sheave
            .map_or(SheaveContact::New, |sheave| sheave.contact)
    }
}

/// The sides of a path that the cable touches.
fn touched(
    resolved: impl Iterator<Item = Resolved>,
    sheave: impl Fn(usize) -> Option<Sheave>,
) -> impl Iterator<Item = Item> {
    let items = resolved.enumerate().map(move |(side, at)| {
        let sheave = sheave(side);
        let wheel = Wheel::new(&at, sheave.map_or(0.0, |s| s.radius));
        Item {
            side,
            wheel,
            sheave,
        }
    });
    items.filter(|item| !item.contact().is_off())
}

/// Goes along a path through its sides as `resolved` and over their sheaves: tells each side that the cable touches, with
/// its gradient of Λ and its angles (0 of a point). Returns Λ.
pub(super) fn follow(
    resolved: impl Iterator<Item = Resolved>,
    sheave: impl Fn(usize) -> Option<Sheave>,
    mut of: impl FnMut(usize, &Wheel, Pull, [f64; 2]),
) -> f64 {
    let mut items = touched(resolved, sheave);
    let Some(mut last) = items.next() else {
        return 0.0;
    };
    let mut total = 0.0;
    let mut finish = |item: &Item, pull: Pull, angles: [Option<f64>; 2]| {
        let found = item.sheave.map_or([0.0; 2], |s| s.wrapped(angles));
        of(item.side, &item.wheel, pull, found);
        item.wheel.radius * (found[1] - found[0])
    };
    let (mut pull, mut arriving) = (Pull::default(), None);
    for next in items {
        let known = [last.contact().leaving(), next.contact().arriving()];
        let span = Span::between([&last.wheel, &next.wheel], known);
        let [on_last, on_next] = span.gradient;
        let angles = [arriving, Some(span.angles[0])];
        total += span.length + finish(&last, pull.plus(&on_last), angles);
        (pull, arriving, last) = (on_next, Some(span.angles[1]), next);
    }
    total + finish(&last, pull, [arriving, None])
}

/// The first sheave that a path has no tangent on, and why.
pub(super) fn fault(
    resolved: impl Iterator<Item = Resolved>,
    sheave: impl Fn(usize) -> Option<Sheave>,
) -> Option<(usize, &'static str)> {
    let mut items = touched(resolved, sheave);
    let mut last = items.next()?;
    for next in items {
        let span = Span::between([&last.wheel, &next.wheel], [None; 2]);
        if !span.length.is_finite() || span.least_cosine < OBLIQUE {
            let ends = [&last, &next];
            let on = ends.into_iter().find(|item| !item.wheel.is_point())?;
            let other = if on.side == last.side { &next } else { &last };
            let reason = if span.length.is_finite() {
                "lies askew: the cable departs at more than 45° from its plane: turn its axis across the cable"
            } else if on.wheel.axes[0]
                .cross(&(other.wheel.hub - on.wheel.hub))
                .norm()
                <= on.wheel.radius
            {
                "has no tangent to the next point of the path, which lies within its radius or along its axis: move one \
                 of them, or make the radius smaller"
            } else {
                "has no tangent to the other sheave on these sides: they overlap there; move one of them or turn its axis round"
            };
            return Some((on.side, reason));
        }
        last = next;
    }
    None
}

/// The largest fleet angle of a path, between a span and the plane of the sheave where it ends \[rad], and the side of that
/// sheave; NaN angles, of a path without tangents, count for nothing.
pub(super) fn steepest(
    resolved: impl Iterator<Item = Resolved>,
    sheave: impl Fn(usize) -> Option<Sheave>,
) -> Option<(usize, f64)> {
    let mut items = touched(resolved, sheave);
    let mut last = items.next()?;
    let mut found: Option<(usize, f64)> = None;
    for next in items {
        let span = Span::between([&last.wheel, &next.wheel], [None; 2]);
        let [start, end] = span.points;
        for item in [&last, &next] {
            let aside = (end - start).dot(&item.wheel.axes[0]) / span.length;
            let angle = aside.abs().min(1.0).asin();
            if !item.wheel.is_point() && found.is_none_or(|(_, most)| angle > most) {
                found = Some((item.side, angle));
            }
        }
        last = next;
    }
    found
}

impl Sheave {
    /// The angles that the cable touches it between, through all turns, where it arrives and leaves; of a drum one of the two
    /// is where it is fastened.
    fn wrapped(&self, angles: [Option<f64>; 2]) -> [f64; 2] {
        let lies = TAU * self.turns;
        let is_end = angles.contains(&None);
        let found = match angles {
            [Some(arriving), Some(leaving)] if self.contact == SheaveContact::New => {
                let part = (leaving - arriving).rem_euclid(TAU);
                // A straight rope about whole turns has no part of one, whatever its rounding.
                let part = if part > TAU - STRAIGHT {
                    part - TAU
                } else {
                    part
                };
                [arriving, arriving + part + TAU * self.turns.floor()]
            }
            [Some(arriving), Some(leaving)] => [arriving, leaving],
            [None, Some(leaving)] => [self.contact.arriving().unwrap_or(leaving - lies), leaving],
            [Some(arriving), None] => [arriving, self.contact.leaving().unwrap_or(arriving + lies)],
            [None, None] => [0.0, lies],
        };
        if is_end && !self.shared && found[1] < found[0] {
            // A drum that has run empty holds nothing.
            return [f64::NAN; 2];
        }
        found
    }

    /// Length that lies on a drum \[m].
    pub(super) fn wound(&self) -> f64 {
        match self.contact {
            _ if self.shared => 0.0,
            SheaveContact::On { arriving, leaving } => self.radius * (leaving - arriving),
            _ => self.radius * TAU * self.turns,
        }
    }

    /// New state of a sheave that a cable passes by on its way between two wheels. `clear` is true
    /// if it was last seen on the groove's side. The cable lies down where it goes from the
    /// groove's side to the far one, near the wheel's plane and with a fleet angle that a groove
    /// takes.
    pub(super) fn passed(clear: bool, [before, here, after]: [&Wheel; 3]) -> SheaveContact {
        let [to, from] = [[before, here], [here, after]].map(|ends| Span::between(ends, [None; 2]));
        let [arriving, leaving] = [to.angles[1], from.angles[0]];
        let wrap = unwrap_angle(leaving - arriving, 0.0);
        if wrap.is_nan() || wrap <= 0.0 {
            return SheaveContact::Off { clear: wrap <= 0.0 };
        }
        let straight = Span::between([before, after], [None; 2]);
        let [start, end] = straight.points;
        let along = (end - start) / straight.length;
        let way = (here.hub - start).dot(&along).clamp(0.0, straight.length);
        let aside = (start + along * way - here.hub).dot(&here.axes[0]);
        let fits = to.least_cosine.min(from.least_cosine) >= STEEP;
        let near = aside.abs() <= GROOVE * here.radius;
        if clear && wrap < LANDING && fits && near {
            let leaving = arriving + wrap;
            return SheaveContact::On { arriving, leaving };
        }
        SheaveContact::Off { clear: false }
    }
}

#[cfg(test)]
mod tests;
