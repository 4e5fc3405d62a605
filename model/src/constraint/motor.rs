//! Motors: one row that holds the coordinate of a joint, or its rate, with a limited force.
//!
//! Position: φ = s − s₀, bounds −F ≤ λ ≤ F. Speed: φ = 0 at all times and ∂φ/∂t = −ṡ₀, so that the row reads J v = ṡ₀;
//! it is rigid, and its multiplier is the force that holding the speed takes. Where that would be more than F the row
//! gives way: λ = ±F.

use super::{Constraint, RowKind, RowLaw};
use crate::error::{SceneError, check, limited};

/// Quantity that a motor holds, and its value.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Target {
    /// The coordinate \[m or rad].
    Position(f64),
    /// Its rate \[m/s or rad/s]; zero is a brake.
    Speed(f64),
}

/// Drives the free coordinate of a [`Slider`](crate::Slider) or [`Hinge`](crate::Hinge).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Motor {
    /// Coordinate or rate that it holds.
    pub target: Target,
    /// Largest force \[N] or torque \[N m] ≥ 0, in both directions; infinite is no limit, zero lets the joint run free.
    #[cfg_attr(feature = "serde", serde(with = "crate::unlimited"))]
    pub force_limit: f64,
    /// Law of the row while it holds a position, compliance in m/N or rad/(N m).
    pub law: RowLaw,
}

impl Motor {
    /// A rigid motor without limit that holds the rate `speed` (m/s or rad/s).
    #[must_use]
    pub const fn speed(speed: f64) -> Self {
        Self {
            target: Target::Speed(speed),
            force_limit: f64::INFINITY,
            law: RowLaw::RIGID,
        }
    }

    /// Checks that all numbers are in their ranges; `what` is whose motor it is.
    ///
    /// # Errors
    /// The first number that is not.
    pub fn validate(&self, what: impl Fn() -> String) -> Result<(), SceneError> {
        let of = |key: &str| format!("{}: motor.{key}", what());
        let (key, target) = match self.target {
            Target::Position(position) => ("position", position),
            Target::Speed(speed) => ("speed", speed),
        };
        check(of(key), target, true, "finite (m, rad, m/s or rad/s)")?;
        let limit = self.force_limit;
        let needs = "≥ 0 N or N m; leave it out, or inf, for no limit";
        limited(of("force_limit"), limit, limit >= 0.0, needs)?;
        let (compliance, damping) = (self.law.compliance, self.law.damping);
        let needs = "≥ 0 (m/N or rad/(N m)); 0 is rigid";
        check(of("compliance"), compliance, compliance >= 0.0, needs)?;
        check(of("damping"), damping, damping >= 0.0, "≥ 0 s")
    }

    /// The row, whose coordinate is an angle or a length.
    pub(super) fn part(&self, angular: bool) -> (RowKind, usize, Option<RowLaw>) {
        let (kind, law) = match (self.target, angular) {
            (Target::Position(_), false) => (RowKind::Position, self.law),
            (Target::Position(_), true) => (RowKind::Angle, self.law),
            (Target::Speed(_), _) => (RowKind::Speed, RowLaw::RIGID),
        };
        (kind, 1, Some(law))
    }

    /// φ where the coordinate is `s`.
    pub(super) fn violation(&self, s: f64) -> f64 {
        match self.target {
            Target::Position(target) => s - target,
            Target::Speed(_) => 0.0,
        }
    }

    /// ∂φ/∂t.
    pub(super) fn drive(&self) -> f64 {
        match self.target {
            Target::Position(_) => 0.0,
            Target::Speed(speed) => -speed,
        }
    }
}

impl Constraint {
    /// True if a control can drive it: it has a motor that holds a speed, or a winch.
    pub(crate) fn follows_speed(&self) -> bool {
        self.driven_speed().is_some()
    }

    /// Speed of the motor \[m/s or rad/s], or at which the winch pays out \[m/s].
    pub(crate) fn driven_speed(&self) -> Option<f64> {
        if let Some(winch) = self.winch() {
            return Some(winch.speed);
        }
        match self.motor()?.target {
            Target::Speed(speed) => Some(speed),
            Target::Position(_) => None,
        }
    }
}
