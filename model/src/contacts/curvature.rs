//! Curvature of shapes where they touch, and the second-order change of the gap as a body turns.
//!
//! Over the plane across the normal n through the contact the surfaces are at the heights ½ xᵀB₀x and −½ xᵀB₁x. A small
//! motion of body i tilts its surface there by the slope g_i, moves its point of contact by d_i along the plane and by w_i
//! along n, so that the gap is
//!
//! ```text
//! φ = min_x  w₀ + g₀·(x − d₀) + ½ (x − d₀)ᵀB₀(x − d₀) − w₁ − g₁·(x − d₁) + ½ (x − d₁)ᵀB₁(x − d₁)
//!   = w₀ − w₁ − g₀·d₀ + g₁·d₁ + ½ d₀ᵀB₀d₀ + ½ d₁ᵀB₁d₁ − ½ bᵀC b
//! b = g₀ − g₁ − B₀d₀ − B₁d₁,    C = (B₀ + B₁)⁻¹
//! ```
//!
//! which is the classical kinematics of contact: the point moves over the plane by −C b, and the normal turns with it. A turn
//! θ about a centre that is a below the surface has g = n × θ, d = a g, w = ½ a g², and
//!
//! ```text
//! −∂²φ/∂g₀² = C + a (C B₁ + B₁C) − a² B₀C B₁ − a = (ρ₀ − a)(ρ₁ + a)/(ρ₀ + ρ₁)
//! ```
//!
//! the latter for radii of curvature ρ in common directions; of body 1 the same with 0 and 1 exchanged. A force N times
//! that is the stiffness by which the contact brings a turned body back: N (ρ₁ + a) of a straight rod across a cylinder, 0 of
//! whatever turns about its own axis, −N a of a corner. A turn about n has none, and where both bodies turn
//!
//! ```text
//! −∂²φ/∂g₀∂g₁ = −(ρ₀ − a₀)(ρ₁ − a₁)/(ρ₀ + ρ₁)
//! ```
//!
//! which vanishes where one of the shapes is round about its body's centre.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::Contact;
use super::axis::across;
use super::solid::{Core, Solid};

/// Radius of edges and corners over the size of their shape.
const SHARP: f64 = 1e-3;
/// Distance from a border, over the size of the shape, at which a point lies on it.
const BORDER: f64 = 1e-6;

/// The curvature of a surface: how its normal turns along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curvature {
    /// Unit vector along the surface, world.
    pub axis: Vector3<f64>,
    /// Normal curvature in its direction \[1/m]: 0 where the surface is flat, 1/r of a ball of radius r.
    pub along: f64,
    /// Normal curvature across it \[1/m].
    pub across: f64,
}

impl Curvature {
    /// B in the directions `u` and `v` along the surface.
    fn matrix(&self, [u, v]: &[Vector3<f64>; 2]) -> Matrix2<f64> {
        let round = Matrix2::from_diagonal_element(self.across);
        let axis = Vector2::new(self.axis.dot(u), self.axis.dot(v));
        let square = axis.norm_squared();
        if self.along == self.across || square == 0.0 {
            return round;
        }
        round + axis * axis.transpose() * ((self.along - self.across) / square)
    }
}

impl Solid {
    /// Its curvature at a point of its surface with the normal `outward`.
    pub(super) fn curvature(&self, point: &Vector3<f64>, outward: &Vector3<f64>) -> Curvature {
        let size = self.size();
        let (sharp, border) = (1.0 / (SHARP * size), BORDER * size);
        let core = point - outward * self.radius;
        let local = self.axes.tr_mul(&(core - self.centre));
        let ends = (self.half - local.abs()).map(|left| left <= border);
        let curvature = |axis, along, across| Curvature {
            axis,
            along,
            across,
        };
        match self.core {
            Core::HalfSpace => curvature(self.axis(0), 0.0, 0.0),
            Core::Segment => {
                let round = 1.0 / self.radius;
                curvature(self.axis(2), if ends.z { round } else { 0.0 }, round)
            }
            Core::Box => match [ends.x, ends.y, ends.z].map(usize::from).iter().sum() {
                3 => curvature(self.axis(0), sharp, sharp),
                2 => {
                    let edge = [ends.x, ends.y, ends.z].iter().position(|end| !end);
                    curvature(self.axis(edge.unwrap_or(0)), 0.0, sharp)
                }
                _ => curvature(self.axis(0), 0.0, 0.0),
            },
            Core::Cylinder => {
                let radial = local.xy();
                let away = self.axes * Vector3::new(radial.x, radial.y, 0.0);
                let bent = away.dot(outward).max(0.0) / (self.half.x * self.half.x);
                match (radial.norm() >= self.half.x - border, ends.z) {
                    (true, true) => curvature(self.axis(2).cross(&away).normalize(), bent, sharp),
                    (true, false) => curvature(self.axis(2), 0.0, 1.0 / self.half.x),
                    _ => curvature(self.axis(0), 0.0, 0.0),
                }
            }
        }
    }
}

/// C, but 0 in directions in which both surfaces are flatter than `flat`: a line or plane touches in points that stay.
fn inverse(sum: &Matrix2<f64>, flat: f64) -> Matrix2<f64> {
    let (mean, half) = (0.5 * sum.trace(), 0.5 * (sum.m11 - sum.m22));
    let larger = mean + half.hypot(sum.m12);
    if larger < flat {
        return Matrix2::zeros();
    }
    let smaller = sum.determinant() / larger;
    if smaller >= flat {
        return Matrix2::new(sum.m22, -sum.m12, -sum.m21, sum.m11) / (larger * smaller);
    }
    (sum - Matrix2::from_diagonal_element(smaller)) / ((larger - smaller) * larger)
}

impl Contact {
    /// Velocity of the point of contact along the surfaces beyond their own, as body 0 turns with
    /// `turn` (rad/s) against body 1, world \[m/s]: C (ω × n). It is r ω for a ball of radius r
    /// that rolls on a plane, and 0 for corners, faces and turns about n.
    #[must_use]
    pub fn rolling(&self, turn: &Vector3<f64>) -> Vector3<f64> {
        let Some(plane) = across(&self.normal) else {
            return Vector3::zeros();
        };
        let [own, other] = self.curvature.map(|of| of.matrix(&plane));
        let along = turn.cross(&self.normal);
        let along = Vector2::new(along.dot(&plane[0]), along.dot(&plane[1]));
        let moved = inverse(&(own + other), self.flat) * along;
        plane[0] * moved.x + plane[1] * moved.y
    }

    /// −∂²φ/∂θ² of the gap φ for turns θ of body `side` about `centre`, world \[m/rad²]: times a force along the normal, its
    /// part of the body's geometric stiffness.
    #[must_use]
    pub fn turning(&self, side: usize, centre: &Vector3<f64>) -> Matrix3<f64> {
        let Some(plane) = across(&self.normal) else {
            return Matrix3::zeros();
        };
        let [own, other] = [side, 1 - side].map(|i| self.curvature[i].matrix(&plane));
        let below = (centre - self.points[side]).dot(&self.normal);
        let a = if side == 0 { below } else { -below };
        let c = inverse(&(own + other), self.flat);
        let (turned, both) = (c * other, own * c * other);
        let k = c + (turned + turned.transpose()) * a
            - (both + both.transpose()) * (0.5 * a * a)
            - Matrix2::from_diagonal_element(a);
        // g = n × θ.
        let [u, v] = plane;
        let (along_u, along_v) = (-v, u);
        let crossed = along_u * along_v.transpose();
        along_u * along_u.transpose() * k.m11
            + along_v * along_v.transpose() * k.m22
            + (crossed + crossed.transpose()) * k.m12
    }
}
