//! How options are written with `serde`: by the names that they have on the command line, which read back to the last
//! bit; times of phases in seconds.

use crate::{
    Elimination, Form, GeometricStiffness, Phase, PhaseTimes, SavedRun, Scheme, StepOptions,
};
use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};
use std::fmt::Display;
use std::str::FromStr;
use std::time::Duration;

/// The text of anything that has one.
pub(crate) mod text {
    use super::{Deserialize, Deserializer, Display, Error, FromStr, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        value: &impl Display,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_str(value)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>, T: FromStr<Err: Display>>(
        deserializer: D,
    ) -> Result<T, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(D::Error::custom)
    }
}

macro_rules! by_text {
    ($($kind:ty),*) => {$(
        impl Serialize for $kind {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                text::serialize(self, serializer)
            }
        }

        impl<'de> Deserialize<'de> for $kind {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                text::deserialize(deserializer)
            }
        }
    )*};
}

by_text!(Scheme, GeometricStiffness, Form, Elimination);

/// Refuses what another version wrote, before the rest is read.
pub(crate) fn known_version<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    match u32::deserialize(deserializer)? {
        SavedRun::VERSION => Ok(SavedRun::VERSION),
        other => Err(D::Error::custom(format!(
            "version {other} of saved runs, where {} is what can be read: run the scene again",
            SavedRun::VERSION
        ))),
    }
}

/// Options of a run. Earlier versions had a scheme for the rows that measure angles besides, which was `null` as a rule.
pub(crate) fn options<'de, D: Deserializer<'de>>(deserializer: D) -> Result<StepOptions, D::Error> {
    #[derive(serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Written {
        #[serde(default)]
        angular_scheme: Option<String>,
        #[serde(flatten)]
        options: StepOptions,
    }
    let Written {
        angular_scheme,
        options,
    } = Written::deserialize(deserializer)?;
    angular_scheme.map_or(Ok(options), |scheme| {
        Err(D::Error::custom(format!(
            "`angular_scheme` is `{scheme}`, where all rows take `scheme`: run the scene again with that alone"
        )))
    })
}

/// The time of each phase \[s].
#[derive(serde::Serialize, serde::Deserialize)]
pub(crate) struct PhaseSeconds {
    linearize: f64,
    assemble: f64,
    factorize: f64,
    solve: f64,
    refine: f64,
    update: f64,
}

impl From<PhaseTimes> for PhaseSeconds {
    fn from(times: PhaseTimes) -> Self {
        let [linearize, assemble, factorize, solve, refine, update] =
            Phase::ALL.map(|phase| times.of(phase).as_secs_f64());
        Self {
            linearize,
            assemble,
            factorize,
            solve,
            refine,
            update,
        }
    }
}

impl From<PhaseSeconds> for PhaseTimes {
    fn from(s: PhaseSeconds) -> Self {
        let seconds = [
            s.linearize,
            s.assemble,
            s.factorize,
            s.solve,
            s.refine,
            s.update,
        ];
        // A negative or infinite number, or NaN, counts as no time.
        Self::from_times(seconds.map(|s| Duration::try_from_secs_f64(s).unwrap_or_default()))
    }
}
