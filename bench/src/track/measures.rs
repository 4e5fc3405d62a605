//! The figures of a case: names, units, kinds.

use taut_integrator::StepError;

/// One figure of a case. Smaller is better for all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Instructions of a step.
    Instructions,
    /// Calls of the allocator in a step.
    Allocations,
    /// Relative error of the multipliers against the KKT system in extended precision, as stepped.
    ForwardError,
    /// Componentwise backward error on the assembled system, without refinement.
    BackwardError,
    /// Largest distance of the load, over a second from the start, from a motion in steps 16 times finer.
    LoadError,
    /// Relative error of the hanging cable's elongation after half a second, against the exact discrete value.
    ElongationError,
    /// Least time of a step.
    Min,
    /// Median time of a step.
    Median,
    /// The time that 99 % of the steps of a driven minute stay within, each step at its least.
    P99,
}

/// How a figure is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Against the baseline.
    Instructions,
    /// Against the case's bar.
    Barred,
    Wall,
}

impl Measure {
    /// All, in the order of the tables.
    pub const ALL: [Self; 9] = [
        Self::Instructions,
        Self::Allocations,
        Self::ForwardError,
        Self::BackwardError,
        Self::LoadError,
        Self::ElongationError,
        Self::Min,
        Self::Median,
        Self::P99,
    ];

    /// Its part of a figure's name, its unit, and how it is judged.
    fn about(self) -> (&'static str, &'static str, Kind) {
        match self {
            Self::Instructions => ("instructions", "instructions/step", Kind::Instructions),
            Self::Allocations => ("allocations", "calls/step", Kind::Barred),
            Self::ForwardError => ("forward-error", "relative", Kind::Barred),
            Self::BackwardError => ("backward-error", "relative", Kind::Barred),
            Self::LoadError => ("load-error", "m", Kind::Barred),
            Self::ElongationError => ("elongation-error", "relative", Kind::Barred),
            Self::Min => ("time-min", "ns/step", Kind::Wall),
            Self::Median => ("time-median", "ns/step", Kind::Wall),
            Self::P99 => ("time-p99", "ns/step", Kind::Wall),
        }
    }

    pub fn name(self) -> &'static str {
        self.about().0
    }

    pub fn unit(self) -> &'static str {
        self.about().1
    }

    pub fn kind(self) -> Kind {
        self.about().2
    }
}

/// Result of one measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    pub case: String,
    pub measure: Measure,
    /// The value, or the reason why it is missing.
    pub value: Result<f64, Missing>,
    /// Half the range between the quartiles, for medians.
    pub spread: Option<f64>,
    /// Toolchain or machine that the value is valid for.
    pub condition: String,
    /// Largest value that passes; `None` without a bar.
    pub bar: Option<f64>,
}

/// Reason for a missing value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Missing {
    /// It was not asked for or cannot be had here: no fault.
    NotMeasured(String),
    Failed(String),
}

impl Missing {
    /// Why.
    pub fn reason(self) -> String {
        let (Self::NotMeasured(why) | Self::Failed(why)) = self;
        why
    }
}

impl From<StepError> for Missing {
    fn from(e: StepError) -> Self {
        Self::Failed(e.to_string())
    }
}

impl Figure {
    /// `scene/backend/measure`.
    pub fn name(&self) -> String {
        format!("{}/{}", self.case, self.measure.name())
    }
}
