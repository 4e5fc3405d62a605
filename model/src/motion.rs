//! Prescribed motion of a point of the world: how a crane moves the upper end of its cable.

use nalgebra::Vector3;
use std::f64::consts::TAU;

/// Prescribed displacement of a world-side [`Frame`](crate::Frame), as a function of time. Twice continuously
/// differentiable, zero before its start; the attachment's axes keep their directions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub enum Motion {
    /// The point rests.
    #[default]
    Fixed,
    /// Moves by `displacement` along a straight line and stays there.
    Smooth {
        /// Whole displacement, world \[m].
        displacement: Vector3<f64>,
        /// Time at which the motion starts \[s]; in a text default 0.
        #[cfg_attr(feature = "serde", serde(default))]
        start: f64,
        /// How long it takes \[s], > 0. Peak speed is 15/8, peak acceleration 10/√3 of the mean (|d|/T, |d|/T²).
        duration: f64,
    },
    /// Moves on a horizontal circle through the frame's point, counter-clockwise seen from +z, with its centre at −x.
    Circle {
        /// Radius \[m], ≥ 0.
        radius: f64,
        /// Time of one turn at full speed \[s], > 0.
        period: f64,
        /// Time at which the motion starts \[s]; in a text default 0.
        #[cfg_attr(feature = "serde", serde(default))]
        start: f64,
        /// Time of the smooth run-up from rest to full speed \[s], > 0.
        ramp: f64,
    },
}

impl Motion {
    /// Displacement from the rest position at time `t` (s), world \[m].
    #[must_use]
    pub fn displacement(&self, t: f64) -> Vector3<f64> {
        match *self {
            Self::Fixed => Vector3::zeros(),
            Self::Smooth {
                displacement,
                start,
                duration,
            } => displacement * blend((t - start) / duration),
            Self::Circle {
                radius,
                period,
                start,
                ramp,
            } => {
                let angle = TAU / period * ramp * blend_integral((t - start) / ramp);
                // cos − 1 written without cancellation, so that the start is smooth to rounding.
                let half = (0.5 * angle).sin();
                Vector3::new(-2.0 * half * half, angle.sin(), 0.0) * radius
            }
        }
    }

    /// The key of the first number that it cannot have, the number, and true for a time that has to be > 0.
    pub(crate) fn fault(&self) -> Option<(&'static str, f64, bool)> {
        let lost = |x: &f64| !x.is_finite();
        let numbers = match *self {
            Self::Fixed => Vec::new(),
            Self::Smooth {
                displacement: d,
                start,
                duration,
            } => vec![
                (
                    "smooth.displacement",
                    d[d.iter().position(lost).unwrap_or(0)],
                    false,
                ),
                ("smooth.start", start, false),
                ("smooth.duration", duration, true),
            ],
            Self::Circle {
                radius,
                period,
                start,
                ramp,
            } => vec![
                ("circle.radius", radius, false),
                ("circle.start", start, false),
                ("circle.period", period, true),
                ("circle.ramp", ramp, true),
            ],
        };
        let mut numbers = numbers.into_iter();
        numbers.find(|(_, x, is_span)| lost(x) || *is_span && *x <= 0.0)
    }

    /// True if the displacement is zero at all times.
    #[must_use]
    pub fn is_fixed(&self) -> bool {
        match self {
            Self::Fixed => true,
            Self::Smooth { displacement, .. } => *displacement == Vector3::zeros(),
            Self::Circle { radius, .. } => *radius == 0.0,
        }
    }
}

/// Quintic blend from 0 (s ≤ 0) to 1 (s ≥ 1) with zero first and second derivatives at both ends.
fn blend(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

/// ∫₀ˢ of [`blend`]: s − ½ from s = 1 on.
fn blend_integral(s: f64) -> f64 {
    if s >= 1.0 {
        return s - 0.5;
    }
    let s = s.max(0.0);
    s * s * s * s * (2.5 + s * (s - 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMOOTH: Motion = Motion::Smooth {
        displacement: Vector3::new(0.5, 0.0, -0.25),
        start: 1.0,
        duration: 2.0,
    };
    const CIRCLE: Motion = Motion::Circle {
        radius: 2.0,
        period: 4.0,
        start: 1.0,
        ramp: 3.0,
    };

    #[test]
    fn starts_at_zero_and_ends_at_the_displacement() {
        assert_eq!(SMOOTH.displacement(0.3), Vector3::zeros());
        assert_eq!(SMOOTH.displacement(9.0), Vector3::new(0.5, 0.0, -0.25));
        assert!((SMOOTH.displacement(2.0) - Vector3::new(0.25, 0.0, -0.125)).norm() < 1e-16);
        assert_eq!(CIRCLE.displacement(1.0), Vector3::zeros());
        assert!(!SMOOTH.is_fixed() && !CIRCLE.is_fixed() && Motion::Fixed.is_fixed());
    }

    #[test]
    fn second_derivative_is_continuous_at_the_joins() {
        let h = 1e-4;
        let second = |m: &Motion, t: f64| {
            (m.displacement(t + h) - 2.0 * m.displacement(t) + m.displacement(t - h)) / (h * h)
        };
        for (motion, joins) in [(SMOOTH, [1.0, 3.0]), (CIRCLE, [1.0, 4.0])] {
            for t in joins {
                let jump = second(&motion, t + 2.0 * h) - second(&motion, t - 2.0 * h);
                assert!(jump.norm() < 2e-2, "jump {jump} at {t}");
            }
        }
    }

    #[test]
    fn circle_keeps_its_radius_and_period() {
        let centre = Vector3::new(-2.0, 0.0, 0.0);
        for t in [1.5, 4.0, 5.3, 11.0] {
            let p = CIRCLE.displacement(t) - centre;
            assert!((p.norm() - 2.0).abs() < 1e-14 && p.z == 0.0);
        }
        assert!((CIRCLE.displacement(5.0) - CIRCLE.displacement(9.0)).norm() < 1e-13);
    }
}
