//! Motors of joints, as they are written. A limit left out is infinite.

use serde::{Deserialize, Serialize};

use super::build::Entry;
use super::places::Fault;
use crate::constraint::{Motor, RowLaw, Target};
use crate::unlimited::is_zero;

/// A motor: exactly one of `speed` and `position`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotorEntry {
    /// Rate that it holds \[m/s or rad/s]; 0 is a brake.
    pub speed: Option<f64>,
    /// Coordinate that it holds \[m or rad].
    pub position: Option<f64>,
    /// Largest force \[N] or torque \[N m], in both directions; default no limit, as `inf`.
    pub force_limit: Option<f64>,
    /// Compliance while it holds a position \[m/N or rad/(N m)]; default 0: rigid.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub compliance: f64,
    /// Damping time while it holds a position \[s]; default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub damping: f64,
}

/// `value`, unless it has the bits of `default`.
pub(super) fn unless(value: f64, default: f64) -> Option<f64> {
    (value.to_bits() != default.to_bits()).then_some(value)
}

impl MotorEntry {
    /// The motor of the joint `of`.
    pub(super) fn build(&self, of: &Entry<'_>) -> Result<Motor, Fault> {
        let target = match (self.speed, self.position) {
            (Some(speed), None) => Target::Speed(speed),
            (None, Some(position)) => Target::Position(position),
            (Some(_), Some(_)) => {
                let reason = "excludes motor.position: give one of them";
                return Err(of.conflict("motor.speed", reason));
            }
            (None, None) => return Err(of.conflict("motor", "needs speed or position: give one")),
        };
        let motor = Motor {
            target,
            force_limit: self.force_limit.unwrap_or(f64::INFINITY),
            law: RowLaw::new(self.compliance, self.damping),
        };
        let sound = motor.validate(|| of.owner());
        sound.map_err(Fault::named).map(|()| motor)
    }

    /// The motor as it is written.
    pub(super) fn of(motor: &Motor) -> Self {
        let (speed, position) = match motor.target {
            Target::Speed(speed) => (Some(speed), None),
            Target::Position(position) => (None, Some(position)),
        };
        Self {
            speed,
            position,
            force_limit: unless(motor.force_limit, f64::INFINITY),
            compliance: motor.law.compliance,
            damping: motor.law.damping,
        }
    }
}
