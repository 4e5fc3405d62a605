//! Checks: a reference, what comes out here, the error between them, its bar and the verdict. What the reproduction of
//! the paper and the hard cases end in.

use crate::plot::{self, Chart, PlotError};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;
use taut_measure::errors::Cause;
use taut_solver::{SolveReport, Status};

/// A reference beside ours.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Row label: experiment, row, quantity.
    pub case: String,
    /// Value of the paper or the theory as text; a mark tells where the scan is illegible.
    pub reference: String,
    /// Our value as text, with its unit.
    pub ours: String,
    /// `None` if either value is not a number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compared: Option<Compared>,
    /// Distance of ours from the reference in the criterion's measure. JSON has null for a missing
    /// error and for one that is not finite; `reached` tells them apart.
    pub error: Option<f64>,
    pub reached: Reached,
    /// Largest `error` that passes.
    pub bar: Option<f64>,
    /// How `error` is measured, or what decides.
    pub criterion: String,
    /// Where the error comes from, where that is known.
    pub parts: Parts,
    pub verdict: Verdict,
    /// The condition of a claim that holds only under one; the cause of a failure.
    pub note: String,
}

/// A number and its reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Compared {
    pub reference: f64,
    pub ours: f64,
    /// The unit of both; empty for a ratio.
    pub unit: Cow<'static, str>,
}

/// How the distance of a number from its reference is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measure {
    /// Over the reference.
    Relative,
    /// In the unit of both.
    Absolute,
}

impl Measure {
    fn error(self, reference: f64, ours: f64) -> f64 {
        match self {
            Self::Relative => (ours / reference - 1.0).abs(),
            Self::Absolute => (ours - reference).abs(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Relative => "relative",
            Self::Absolute => "difference",
        }
    }

    /// Size of an error of 1, in the unit of the values.
    fn scale(self, reference: f64) -> f64 {
        match self {
            Self::Relative => reference.abs(),
            Self::Absolute => 1.0,
        }
    }
}

/// Numbers with their unit, to two digits beyond what a difference of `resolution` changes; a vector in brackets.
fn with_unit(values: &[f64], resolution: f64, unit: &str) -> String {
    let place = resolution.log10().floor();
    let decimals = 2 - place.clamp(-300.0, 300.0) as i32;
    let one = |value: &f64| {
        let size = value.abs();
        if !size.is_normal() || (1e-3..1e6).contains(&size) {
            format!("{value:.*}", decimals.clamp(0, 17) as usize)
        } else {
            let digits = decimals + size.log10().floor() as i32;
            format!("{value:.*e}", digits.clamp(1, 17) as usize)
        }
    };
    let shown: Vec<String> = values.iter().map(one).collect();
    let list = shown.join(", ");
    let list = if values.len() > 1 {
        format!("({list})")
    } else {
        list
    };
    format!("{list} {unit}").trim_end().to_owned()
}

/// Kind of an error, as JSON has it beside the number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reached {
    Number,
    /// The computed value is infinite or NaN; `error` is null in JSON.
    NotFinite,
    /// The check judges a statement, or, with the verdict `not-yet`, nothing was measured; `error`
    /// is null.
    Absent,
}

/// Most that the error of an answer may be, relative to the exact one, of which the solver says itself that it has not
/// converged. On a definite system neither Gauss–Seidel nor conjugate gradient ever leaves the distance from the solution
/// that it starts with, in the norm of energy; in that of the largest component this is room for it, and no more.
pub const UNCONVERGED: f64 = 10.0;

/// Where an error comes from, in the criterion's measure. A part is `None` where it is not measured, or does not exist.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Parts {
    /// Ours against the exact answer of the discrete model: what solver and rounding leave.
    pub algebraic: Option<f64>,
    /// Error due to the time step.
    pub time: Option<f64>,
    /// The exact answer of the discrete model against that of the continuum: what the segments add.
    pub space: Option<f64>,
}

/// Verdict of a [`Check`]. `Pass`, `Fail`, `NotYet` and `Limit` judge our own results, the others
/// the paper's statements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
    pub fn key(self) -> String {
        self.to_string().to_lowercase().replace(' ', "-")
    }

    /// Judges a statement of the paper.
    pub fn of(holds: bool) -> Self {
        Self::either(holds, [Self::Holds, Self::DoesNotHold])
    }

    /// The first where something is so, else the second.
    pub fn either(is_so: bool, [first, second]: [Self; 2]) -> Self {
        if is_so { first } else { second }
    }

    /// Judges a statement of the paper that holds at least under the condition in the note.
    pub fn or_only_if(holds: bool) -> Self {
        Self::either(holds, [Self::Holds, Self::HoldsOnlyIf])
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

/// True of an error that keeps a bar. Errors may be negative, where less is better: what does not gain energy may lose it.
/// NaN and −∞ are no errors, but what a formula without a result ends in, and ∞ is no bar.
fn is_within(error: f64, bar: f64) -> bool {
    f64::NEG_INFINITY < error && error <= bar && bar.is_finite()
}

impl Check {
    /// A row whose error must be within our own bar: [`Verdict::Pass`] or [`Verdict::Fail`].
    pub fn within(
        case: impl Into<String>,
        reference: impl Into<String>,
        ours: impl Into<String>,
        error: f64,
        bar: f64,
    ) -> Self {
        Self {
            error: Some(error),
            reached: if error.is_finite() {
                Reached::Number
            } else {
                Reached::NotFinite
            },
            bar: Some(bar),
            ..Self::stated(case, reference, ours, is_within(error, bar))
        }
    }

    /// A number beside its reference, both in `unit`.
    pub fn number(
        case: impl Into<String>,
        [reference, ours]: [f64; 2],
        unit: impl Into<Cow<'static, str>>,
        measure: Measure,
        bar: f64,
    ) -> Self {
        let unit = unit.into();
        let shown = |value: f64| with_unit(&[value], measure.scale(reference) * bar, &unit);
        let error = measure.error(reference, ours);
        let [wanted, found] = [reference, ours].map(shown);
        Self {
            compared: Some(Compared {
                reference,
                ours,
                unit,
            }),
            criterion: measure.name().to_owned(),
            ..Self::within(case, wanted, found, error, bar)
        }
    }

    /// A number whose error is relative to its reference.
    pub fn relative(
        case: impl Into<String>,
        [reference, ours]: [f64; 2],
        unit: impl Into<Cow<'static, str>>,
        bar: f64,
    ) -> Self {
        Self::number(case, [reference, ours], unit, Measure::Relative, bar)
    }

    /// An order of convergence that has to be 2.
    pub fn second_order(case: impl Into<String>, order: f64, bar: f64) -> Self {
        Self::number(case, [2.0, order], "", Measure::Absolute, bar)
            .by("difference of the order from 2")
    }

    /// A vector beside its reference, both in `unit`; the error is what the caller measures.
    pub fn vector(
        case: impl Into<String>,
        [reference, ours]: [&[f64]; 2],
        unit: &str,
        [error, bar]: [f64; 2],
    ) -> Self {
        let size = reference.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let shown = |values| with_unit(values, size * bar, unit);
        Self::within(case, shown(reference), shown(ours), error, bar)
    }

    /// Row for a quantity known only by its distance from the reference, in `unit`.
    pub fn off(
        case: impl Into<String>,
        reference: impl Into<String>,
        error: f64,
        unit: &str,
        bar: f64,
    ) -> Self {
        let ours = format!("{error:.1e} {unit}");
        Self::within(case, reference, ours.trim_end(), error, bar)
    }

    /// A statement in words of ours that is so, or is not.
    pub fn stated(
        case: impl Into<String>,
        reference: impl Into<String>,
        ours: impl Into<String>,
        good: bool,
    ) -> Self {
        let verdict = if good { Verdict::Pass } else { Verdict::Fail };
        Self::claim(case, reference, ours, verdict, "")
    }

    /// Failed row for an error in place of a result.
    pub fn failed(
        case: impl Into<String>,
        reference: impl Into<String>,
        error: &impl fmt::Display,
    ) -> Self {
        Self::stated(case, reference, "failed", false).with_note(error.to_string())
    }

    /// A claim in words, with its verdict and the condition or the cause.
    pub fn claim(
        case: impl Into<String>,
        reference: impl Into<String>,
        ours: impl Into<String>,
        verdict: Verdict,
        note: impl Into<String>,
    ) -> Self {
        Self {
            case: case.into(),
            reference: reference.into(),
            ours: ours.into(),
            compared: None,
            error: None,
            reached: Reached::Absent,
            bar: None,
            criterion: String::new(),
            parts: Parts::default(),
            verdict,
            note: note.into(),
        }
    }

    /// Judges the paper's value instead of ours: [`Verdict::Holds`] where ours would pass.
    pub fn published(mut self) -> Self {
        self.verdict = Verdict::of(self.verdict == Verdict::Pass);
        self
    }

    /// Turns a failure into [`Verdict::Limit`] with `cause` as its note, if `known`.
    pub fn limited(mut self, known: bool, cause: impl Into<String>) -> Self {
        if known && self.verdict == Verdict::Fail {
            self.verdict = Verdict::Limit;
            self.note = cause.into();
        }
        self
    }

    pub fn by(mut self, criterion: impl Into<String>) -> Self {
        self.criterion = criterion.into();
        self
    }

    /// Attributes the whole error to [`Parts::algebraic`].
    pub fn algebraic(self) -> Self {
        let error = self.error.unwrap_or(f64::NAN);
        self.algebraic_part(error)
    }

    pub fn algebraic_part(mut self, part: f64) -> Self {
        self.parts.algebraic = Some(part);
        self
    }

    pub fn time_part(mut self, part: f64) -> Self {
        self.parts.time = Some(part);
        self
    }

    pub fn space_part(mut self, part: f64) -> Self {
        self.parts.space = Some(part);
        self
    }

    /// True if any part of the error is known.
    pub fn is_split(&self) -> bool {
        self.parts != Parts::default()
    }

    /// True if the error does not keep the bar, whatever the verdict.
    pub fn is_beyond(&self) -> bool {
        matches!((self.error, self.bar), (Some(error), Some(bar)) if !is_within(error, bar))
    }

    /// Turns a failure into a limit if the solver does not claim convergence and the error is at
    /// most [`UNCONVERGED`]. The note repeats what the solver `said`.
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

    pub fn with_note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }
}

/// Results of an experiment.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Outcome {
    /// Published beside ours, row by row.
    pub checks: Vec<Check>,
    /// Tables for people, besides that of the checks.
    pub text: String,
    /// The measured rows as CSV, with a header.
    pub csv: String,
    /// Rows of another kind, each with the ending of its file's name.
    pub more_csv: Vec<(Cow<'static, str>, String)>,
    pub charts: Vec<Chart>,
    /// Pictures, PNG, each with the ending of its file's name.
    pub pictures: Vec<(Cow<'static, str>, Vec<u8>)>,
}

impl From<Vec<Check>> for Outcome {
    fn from(checks: Vec<Check>) -> Self {
        Self {
            checks,
            ..Self::default()
        }
    }
}

/// Why an experiment could not be done: a scene, a step or its set-up, rows or charts that could not be written.
pub type ExperimentError = Cause;

/// The charts of an outcome as one picture; `None` without charts.
pub fn picture(outcome: &Outcome) -> Result<Option<String>, PlotError> {
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
        let row = |error| Check::within("case", "", "", error, 1.0);
        let claim = Check::claim("case", "", "", Verdict::NotYet, "");
        let unbarred = Check::within("case", "", "", 0.5, f64::INFINITY);
        for (check, error, reached, verdict) in [
            (row(0.5), json!(0.5), "number", "pass"),
            (row(f64::NAN), Value::Null, "not-finite", "fail"),
            (row(f64::INFINITY), Value::Null, "not-finite", "fail"),
            (row(f64::NEG_INFINITY), Value::Null, "not-finite", "fail"),
            (row(-2.0), json!(-2.0), "number", "pass"),
            (claim, Value::Null, "absent", "not-yet"),
            (unbarred, json!(0.5), "number", "fail"),
        ] {
            let written = serde_json::to_value(&check).expect("JSON");
            assert_eq!(written["error"], error);
            assert_eq!(written["reached"], reached);
            assert_eq!(written["verdict"], verdict);
        }
    }

    #[test]
    fn numbers_are_written_as_far_as_the_bar_resolves() {
        let row = Check::relative("period", [2.0, 2.0 + 1e-5], "s", 1e-4);
        assert_eq!([row.reference, row.ours], ["2.000000 s", "2.000010 s"]);
        assert_eq!(row.verdict, Verdict::Pass);
        let row = Check::number("order", [2.0, f64::NAN], "", Measure::Absolute, 0.1);
        assert_eq!([row.reference, row.ours], ["2.000", "NaN"]);
        assert_eq!(row.verdict, Verdict::Fail);
        assert_eq!(with_unit(&[3.5e9, 0.0], 1e6, "N"), "(3.50000e9, 0) N");
        let written = serde_json::to_value(Check::relative("", [2.0, 3.0], "m", 1.0));
        let compared = &written.expect("JSON")["compared"];
        let expected = json!({"reference": 2.0, "ours": 3.0, "unit": "m"});
        assert_eq!(*compared, expected);
    }
}
