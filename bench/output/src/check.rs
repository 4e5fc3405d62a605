//! Checks: a reference, what comes out here, the error between them, its bar and the verdict. What the reproduction of
//! the paper and the hard cases end in.

use crate::plot::{self, Chart, PlotError};
use serde::{Serialize, Serializer};
use std::fmt;
use taut_integrator::StepError;
use taut_model::SceneError;
use taut_solver::{SolveReport, Status};

/// A reference beside ours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// What is compared: experiment, row, quantity.
    pub case: String,
    /// What the paper or the theory says, as text, with a mark where the scan cannot be read.
    pub reference: String,
    /// What comes out here, as text with its unit.
    pub ours: String,
    /// Distance of ours from the reference in the criterion's measure. In JSON, where what is no number is null as
    /// well as what is not there, [`Check::reached`] stands beside it and tells them apart.
    #[serde(flatten, serialize_with = "with_reached")]
    pub error: Option<f64>,
    /// What that distance may be.
    pub bar: Option<f64>,
    /// How `error` is measured, or what decides.
    pub criterion: String,
    /// Where the error comes from, where that is known.
    pub parts: Parts,
    /// The verdict.
    pub verdict: Verdict,
    /// The condition of a claim that holds only under one; the cause of a failure.
    pub note: String,
}

/// What there is of an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reached {
    /// A number.
    Number,
    /// What was computed is infinite, or no number at all; `error` is null in JSON.
    NotFinite,
    /// There is none: what is judged is a statement, or, where the verdict is `not-yet`, nothing was measured;
    /// `error` is null.
    Absent,
}

impl Reached {
    fn of(error: Option<f64>) -> Self {
        match error {
            None => Self::Absent,
            Some(e) if e.is_finite() => Self::Number,
            Some(_) => Self::NotFinite,
        }
    }
}

/// Writes an error and what there is of it.
fn with_reached<S: Serializer>(error: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Both {
        error: Option<f64>,
        reached: Reached,
    }
    let reached = Reached::of(*error);
    let both = Both {
        error: *error,
        reached,
    };
    both.serialize(to)
}

/// Most that the error of an answer may be, relative to the exact one, of which the solver says itself that it has not
/// converged. On a definite system neither Gauss–Seidel nor conjugate gradient ever leaves the distance from the solution
/// that it starts with, in the norm of energy; in that of the largest component this is room for it, and no more.
pub const UNCONVERGED: f64 = 10.0;

/// Where an error comes from, in the criterion's measure. A part is `None` where it is not measured, or does not exist.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Parts {
    /// Ours against the exact answer of the discrete model: what solver and rounding leave.
    pub algebraic: Option<f64>,
    /// What the time step adds.
    pub time: Option<f64>,
    /// The exact answer of the discrete model against that of the continuum: what the segments add.
    pub space: Option<f64>,
}

/// What a [`Check`] found: pass, fail, not yet and limit speak of what is ours, the others of what the paper says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Our own bar is kept.
    Pass,
    /// Our own bar is missed.
    Fail,
    /// Not measured.
    NotYet,
    /// Where something of ours, or of the step that it is compared with, ends: known, with its cause in the note. Its
    /// error may be beyond its bar ([`Check::is_beyond`]).
    Limit,
    /// The paper's figure or claim holds.
    Holds,
    /// It holds under the condition of the note.
    HoldsOnlyIf,
    /// It does not hold.
    DoesNotHold,
}

impl Verdict {
    /// All, our own bars first.
    pub const ALL: [Self; 7] = [
        Self::Pass,
        Self::Fail,
        Self::NotYet,
        Self::Limit,
        Self::Holds,
        Self::HoldsOnlyIf,
        Self::DoesNotHold,
    ];

    /// As it is written in JSON.
    #[must_use]
    pub fn key(self) -> String {
        self.to_string().to_lowercase().replace(' ', "-")
    }

    /// What a statement of the paper comes to.
    #[must_use]
    pub fn of(holds: bool) -> Self {
        if holds {
            Self::Holds
        } else {
            Self::DoesNotHold
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pass => "pass",
            Self::Fail => "FAIL",
            Self::NotYet => "not yet",
            Self::Limit => "limit",
            Self::Holds => "holds",
            Self::HoldsOnlyIf => "holds only if",
            Self::DoesNotHold => "does not hold",
        })
    }
}

impl Check {
    /// A row whose error must be within our own bar: [`Verdict::Pass`] or [`Verdict::Fail`].
    #[must_use]
    pub fn within(
        case: impl Into<String>,
        reference: String,
        ours: String,
        error: f64,
        bar: f64,
    ) -> Self {
        Self::judged(
            case,
            reference,
            ours,
            error,
            bar,
            [Verdict::Pass, Verdict::Fail],
        )
    }

    /// A row on what the paper prints: [`Verdict::Holds`] where the error is within the bar.
    #[must_use]
    pub fn published(
        case: impl Into<String>,
        reference: String,
        ours: String,
        error: f64,
        bar: f64,
    ) -> Self {
        Self::judged(
            case,
            reference,
            ours,
            error,
            bar,
            [Verdict::Holds, Verdict::DoesNotHold],
        )
    }

    /// A claim in words, with its verdict and the condition or the cause.
    #[must_use]
    pub fn claim(
        case: impl Into<String>,
        reference: &str,
        ours: String,
        verdict: Verdict,
        note: impl Into<String>,
    ) -> Self {
        Self {
            case: case.into(),
            reference: reference.to_owned(),
            ours,
            error: None,
            bar: None,
            criterion: String::new(),
            parts: Parts::default(),
            verdict,
            note: note.into(),
        }
    }

    fn judged(
        case: impl Into<String>,
        reference: String,
        ours: String,
        error: f64,
        bar: f64,
        [good, bad]: [Verdict; 2],
    ) -> Self {
        Self {
            case: case.into(),
            reference,
            ours,
            error: Some(error),
            bar: Some(bar),
            criterion: String::new(),
            parts: Parts::default(),
            // An error that is no number is none that is small.
            verdict: if error <= bar { good } else { bad },
            note: String::new(),
        }
    }

    /// The same row with its criterion.
    #[must_use]
    pub fn by(mut self, criterion: impl Into<String>) -> Self {
        self.criterion = criterion.into();
        self
    }

    /// The same row with the parts of its error.
    #[must_use]
    pub fn split(mut self, parts: Parts) -> Self {
        self.parts = parts;
        self
    }

    /// Whether any part of the error is known.
    #[must_use]
    pub fn is_split(&self) -> bool {
        self.parts != Parts::default()
    }

    /// Whether the error is beyond the bar, whatever the verdict.
    #[must_use]
    pub fn is_beyond(&self) -> bool {
        matches!((self.error, self.bar), (Some(error), Some(bar)) if error > bar || error.is_nan())
    }

    /// The same row of a solver that says `said` of its answer: an error beyond the bar is a limit where it does not claim
    /// to have converged, and the error is within [`UNCONVERGED`]; what it did stands in the note.
    #[must_use]
    pub fn unless_claimed(mut self, said: &SolveReport) -> Self {
        let near = self.error.is_some_and(|e| e <= UNCONVERGED);
        if self.verdict != Verdict::Fail || said.is_claim() || !near {
            return self;
        }
        self.verdict = Verdict::Limit;
        self.note = match said.status {
            Status::IterationLimit => format!(
                "says that it has not converged: {} iterations leave a residual of {:.0e}",
                said.iterations, said.residual
            ),
            _ if said.iterations > 0 => format!(
                "says that it stalled: after {} iterations rounding keeps the residual at {:.0e}",
                said.iterations, said.residual
            ),
            _ => "says that its refinement does not contract: the matrix is singular to rounding"
                .to_owned(),
        };
        self
    }

    /// Whether the error is a number, is none, or is absent: `reached` in JSON.
    #[must_use]
    pub fn reached(&self) -> Reached {
        Reached::of(self.error)
    }

    /// The same row with a note.
    #[must_use]
    pub fn noting(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }
}

/// What an experiment ends in.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// Published beside ours, row by row.
    pub checks: Vec<Check>,
    /// Tables for people, besides that of the checks.
    pub text: String,
    /// The measured rows as CSV, with a header.
    pub csv: String,
    /// Rows of another kind, each with the ending of its file's name.
    pub more_csv: Vec<(&'static str, String)>,
    /// Charts.
    pub charts: Vec<Chart>,
}

/// An experiment that could not be done.
#[derive(Debug)]
pub enum ExperimentError {
    /// A step or its set-up.
    Step(StepError),
    /// A scene.
    Scene(SceneError),
    /// Rows that could not be written as CSV.
    Csv(csv::Error),
    /// A chart.
    Plot(PlotError),
}

impl fmt::Display for ExperimentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Step(e) => e.fmt(f),
            Self::Scene(e) => e.fmt(f),
            Self::Csv(e) => write!(f, "cannot write the rows: {e}"),
            Self::Plot(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for ExperimentError {}

impl From<StepError> for ExperimentError {
    fn from(e: StepError) -> Self {
        Self::Step(e)
    }
}

impl From<SceneError> for ExperimentError {
    fn from(e: SceneError) -> Self {
        Self::Scene(e)
    }
}

impl From<PlotError> for ExperimentError {
    fn from(e: PlotError) -> Self {
        Self::Plot(e)
    }
}

/// Records as CSV with a header.
///
/// # Errors
/// [`ExperimentError::Csv`] for records that are no flat rows.
pub fn csv(rows: &[impl Serialize]) -> Result<String, ExperimentError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(ExperimentError::Csv)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|e| ExperimentError::Csv(e.into_error().into()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The charts of an outcome as one picture; nothing where there are none.
///
/// # Errors
/// [`ExperimentError::Plot`].
pub fn picture(outcome: &Outcome) -> Result<Option<String>, ExperimentError> {
    if outcome.charts.is_empty() {
        return Ok(None);
    }
    Ok(Some(plot::svg(&outcome.charts)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    #[test]
    fn an_error_that_is_no_number_is_told_from_one_that_is_absent() {
        let row = |error| Check::within("case", String::new(), String::new(), error, 1.0);
        let claim = Check::claim("case", "", String::new(), Verdict::NotYet, "");
        for (check, error, reached, verdict) in [
            (row(0.5), json!(0.5), "number", "pass"),
            (row(f64::NAN), Value::Null, "not-finite", "fail"),
            (row(f64::INFINITY), Value::Null, "not-finite", "fail"),
            (claim, Value::Null, "absent", "not-yet"),
        ] {
            let written = serde_json::to_value(&check).expect("JSON");
            assert_eq!(written["error"], error);
            assert_eq!(written["reached"], reached);
            assert_eq!(written["verdict"], verdict);
        }
    }
}
