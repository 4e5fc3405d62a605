//! Motions of world points in explicit scenes.

use serde::{Deserialize, Serialize};

use super::build::Entry;
use super::places::Fault;
use crate::motion::Motion;
use crate::scene::validate::validate_motion;

/// Motion of a point of the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum MotionEntry {
    /// See [`Motion::Smooth`].
    Smooth {
        /// Whole displacement, world \[m].
        displacement: [f64; 3],
        /// Start \[s].
        #[serde(default)]
        start: f64,
        /// Duration \[s].
        duration: f64,
    },
    /// See [`Motion::Circle`].
    Circle {
        /// Radius \[m].
        radius: f64,
        /// Time of one turn \[s].
        period: f64,
        /// Start \[s].
        #[serde(default)]
        start: f64,
        /// Run-up \[s].
        ramp: f64,
    },
}

impl MotionEntry {
    /// The motion.
    fn motion(&self) -> Motion {
        match *self {
            Self::Smooth {
                displacement,
                start,
                duration,
            } => Motion::Smooth {
                displacement: displacement.into(),
                start,
                duration,
            },
            Self::Circle {
                radius,
                period,
                start,
                ramp,
            } => Motion::Circle {
                radius,
                period,
                start,
                ramp,
            },
        }
    }

    /// The motion, sound; `key` is that of the entry `of` that holds it.
    pub(super) fn build(&self, of: &Entry<'_>, key: &str) -> Result<Motion, Fault> {
        let motion = self.motion();
        let what = |quantity: &str| of.what(quantity);
        validate_motion(what, &motion)
            .map_err(|error| Fault::new(format!("{key}.{}", self.wrong_key()), error))?;
        Ok(motion)
    }

    /// The key of the first number that a motion cannot have.
    fn wrong_key(&self) -> &'static str {
        let bad_span = |x: f64| !(x.is_finite() && x > 0.0);
        match *self {
            Self::Smooth { duration, .. } if bad_span(duration) => "smooth.duration",
            Self::Smooth { start, .. } if !start.is_finite() => "smooth.start",
            Self::Smooth { .. } => "smooth.displacement",
            Self::Circle { period, .. } if bad_span(period) => "circle.period",
            Self::Circle { ramp, .. } if bad_span(ramp) => "circle.ramp",
            Self::Circle { start, .. } if !start.is_finite() => "circle.start",
            Self::Circle { .. } => "circle.radius",
        }
    }

    /// The motion as it is written; none where the point rests.
    pub(super) fn of(motion: &Motion) -> Option<Self> {
        match *motion {
            Motion::Fixed => None,
            Motion::Smooth {
                displacement,
                start,
                duration,
            } => Some(Self::Smooth {
                displacement: displacement.into(),
                start,
                duration,
            }),
            Motion::Circle {
                radius,
                period,
                start,
                ramp,
            } => Some(Self::Circle {
                radius,
                period,
                start,
                ramp,
            }),
        }
    }
}
