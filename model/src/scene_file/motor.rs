//! Motors of joints and winches of cables, as they are written. A limit that is left out is none.

use serde::{Deserialize, Serialize};

use super::build::Entry;
use super::joint::is_zero;
use super::places::Fault;
use crate::constraint::{Motor, RowLaw, Target, Winch};

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

/// A winch. Without any key it stands still and holds any tension.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WinchEntry {
    /// Speed at which it pays out \[m/s]; negative hauls in; default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub speed: f64,
    /// Largest tension that it holds while the brake is off \[N]; default no limit, as `inf`.
    pub force_limit: Option<f64>,
    /// Whether the brake is on; default `false`.
    pub brake: Option<bool>,
    /// Largest tension that the brake holds \[N]; default no limit, as `inf`.
    pub brake_limit: Option<f64>,
    /// Length at which hauling in stops \[m]; default 1e-3.
    pub shortest: Option<f64>,
    /// Length at which the drum is empty \[m]; default no limit, as `inf`.
    pub longest: Option<f64>,
    /// Time from which on `speed` holds \[s]; default 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub since: f64,
}

/// A number that may be infinite.
fn limit(
    of: &Entry<'_>,
    key: &str,
    value: f64,
    good: bool,
    needs: &'static str,
) -> Result<f64, Fault> {
    if good {
        return Ok(value);
    }
    of.check(key, value, false, needs)
}

/// `value`, unless it has the bits of `default`.
pub(super) fn unless(value: f64, default: f64) -> Option<f64> {
    (value.to_bits() != default.to_bits()).then_some(value)
}

impl MotorEntry {
    /// The motor of the joint `of`.
    pub(super) fn build(&self, of: &Entry<'_>) -> Result<Motor, Fault> {
        let target = match (self.speed, self.position) {
            (Some(speed), None) => Target::Speed(of.check("motor.speed", speed, true, "finite")?),
            (None, Some(position)) => {
                Target::Position(of.check("motor.position", position, true, "finite")?)
            }
            (Some(_), Some(_)) => {
                let reason = "excludes motor.position: give one of them";
                return Err(of.conflict("motor.speed", reason));
            }
            (None, None) => return Err(of.conflict("motor", "needs speed or position: give one")),
        };
        let force = self.force_limit.unwrap_or(f64::INFINITY);
        let needs = "≥ 0 N or N m; leave it out for no limit";
        let force_limit = limit(of, "motor.force_limit", force, force >= 0.0, needs)?;
        of.check_compliance("motor.compliance", self.compliance)?;
        let damping = self.damping;
        of.check("motor.damping", damping, damping >= 0.0, "≥ 0 s")?;
        Ok(Motor {
            target,
            force_limit,
            law: RowLaw::new(self.compliance, damping),
        })
    }

    /// The motor as it is written.
    pub(super) fn of(motor: &Motor) -> Self {
        let Motor {
            target,
            force_limit,
            law: RowLaw {
                compliance,
                damping,
            },
        } = *motor;
        let (speed, position) = match target {
            Target::Speed(speed) => (Some(speed), None),
            Target::Position(position) => (None, Some(position)),
        };
        Self {
            speed,
            position,
            force_limit: unless(force_limit, f64::INFINITY),
            compliance,
            damping,
        }
    }
}

impl WinchEntry {
    /// The winch of the cable `of`.
    pub(super) fn build(&self, of: &Entry<'_>, is_part: bool) -> Result<Winch, Fault> {
        let default = Winch::new();
        let force = |key, value: Option<f64>, default| {
            let value = value.unwrap_or(default);
            let needs = "≥ 0 N; leave it out for no limit";
            limit(of, key, value, value >= 0.0, needs)
        };
        let shortest = self.shortest.unwrap_or(default.shortest);
        let longest = self.longest.unwrap_or(default.longest);
        let needs = "≥ winch.shortest (m); leave it out for no limit";
        Ok(Winch {
            speed: of.check("winch.speed", self.speed, true, "finite")?,
            force_limit: force("winch.force_limit", self.force_limit, default.force_limit)?,
            brake: self.brake.unwrap_or(default.brake),
            brake_limit: force("winch.brake_limit", self.brake_limit, default.brake_limit)?,
            shortest: of.check(
                "winch.shortest",
                shortest,
                // That of a part is less by what lies in the others.
                shortest > 0.0 || is_part,
                "> 0 m: where hauling in stops",
            )?,
            longest: limit(of, "winch.longest", longest, longest >= shortest, needs)?,
            stalled: false,
            since: of.check("winch.since", self.since, true, "finite")?,
        })
    }

    /// The winch as it is written.
    pub(super) fn of(winch: &Winch) -> Self {
        let Winch {
            speed,
            force_limit,
            brake,
            brake_limit,
            shortest,
            longest,
            stalled: _,
            since,
        } = *winch;
        let default = Winch::new();
        Self {
            speed,
            force_limit: unless(force_limit, default.force_limit),
            brake: (brake != default.brake).then_some(brake),
            brake_limit: unless(brake_limit, default.brake_limit),
            shortest: unless(shortest, default.shortest),
            longest: unless(longest, default.longest),
            since,
        }
    }
}
