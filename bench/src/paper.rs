//! The paper's tables, figures and claims, computed: what it prints beside what comes out here (\[SL §III, §VII, §VIII]).
//!
//! Each experiment is a module with a `Config` (whole and quick), a `run`, and records; it ends in an [`Outcome`]: rows
//! of checks, tables for people, rows for programs, charts. The scan of the paper that the figures come from has lost
//! most exponents: where one was inferred, the row says so.

pub mod chains;
pub mod claims;
pub mod specimens;
pub mod swing;
pub mod table1;
pub mod table2;
pub mod timing;

use crate::plot::{self, Chart, PlotError};
use indicatif::ProgressBar;
use serde::Serialize;
use std::fmt;
use taut_integrator::StepError;
use taut_model::SceneError;

/// One figure of the paper beside ours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// What is compared: experiment, row, quantity.
    pub case: String,
    /// What the paper or the theory says, as text, with a mark where the scan cannot be read.
    pub reference: String,
    /// What comes out here, as text with its unit.
    pub ours: String,
    /// Distance of ours from the reference in the criterion's measure.
    pub error: Option<f64>,
    /// What that distance may be.
    pub bar: Option<f64>,
    /// How `error` is measured, or what decides.
    pub criterion: String,
    /// The verdict.
    pub verdict: Verdict,
    /// The condition of a claim that holds only under one; the cause of a failure.
    pub note: String,
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
    /// Where something of ours, or of the step that it is compared with, ends: known, no bar.
    Limit,
    /// The paper's figure or claim holds.
    Holds,
    /// It holds under the condition of the note.
    HoldsOnlyIf,
    /// It does not hold.
    DoesNotHold,
}

impl Verdict {
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
pub enum PaperError {
    /// A step or its set-up.
    Step(StepError),
    /// A scene.
    Scene(SceneError),
    /// Rows that could not be written as CSV.
    Csv(csv::Error),
    /// A chart.
    Plot(PlotError),
}

impl fmt::Display for PaperError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Step(e) => e.fmt(f),
            Self::Scene(e) => e.fmt(f),
            Self::Csv(e) => write!(f, "cannot write the rows: {e}"),
            Self::Plot(e) => e.fmt(f),
        }
    }
}

impl std::error::Error for PaperError {}

impl From<StepError> for PaperError {
    fn from(e: StepError) -> Self {
        Self::Step(e)
    }
}

impl From<SceneError> for PaperError {
    fn from(e: SceneError) -> Self {
        Self::Scene(e)
    }
}

impl From<PlotError> for PaperError {
    fn from(e: PlotError) -> Self {
        Self::Plot(e)
    }
}

/// Records as CSV with a header.
///
/// # Errors
/// [`PaperError::Csv`] for records that are no flat rows.
pub fn csv(rows: &[impl Serialize]) -> Result<String, PaperError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).map_err(PaperError::Csv)?;
    }
    let bytes = writer
        .into_inner()
        .map_err(|e| PaperError::Csv(e.into_error().into()))?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// The tables, figures and claims of the paper that hold results. Its Figs 1, 6–9, 14 and 15 are drawings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Experiment {
    /// Largest stable load of particle chains.
    Table1,
    /// Distributions of stretch and bend of the link chain.
    Fig2,
    /// The same with regularised bending.
    Fig3,
    /// Return maps of both.
    Fig4,
    /// Spectra for three bending compliances.
    Fig5,
    /// Pull specimens.
    Fig10,
    /// Twist specimens.
    Fig11,
    /// Bend specimens.
    Fig12,
    /// Largest stable load of rigid-body cables.
    Table2,
    /// Time a step over the number of elements.
    Fig13,
    /// Energy of the swinging cable.
    Fig16,
    /// What the paper claims in words.
    Claims,
}

impl Experiment {
    /// All, in the order of the paper.
    pub const ALL: [Self; 12] = [
        Self::Table1,
        Self::Fig2,
        Self::Fig3,
        Self::Fig4,
        Self::Fig5,
        Self::Fig10,
        Self::Fig11,
        Self::Fig12,
        Self::Table2,
        Self::Fig13,
        Self::Fig16,
        Self::Claims,
    ];

    /// Its name on the command line, and of its files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Table1 => "table1",
            Self::Fig2 => "fig2",
            Self::Fig3 => "fig3",
            Self::Fig4 => "fig4",
            Self::Fig5 => "fig5",
            Self::Fig10 => "fig10",
            Self::Fig11 => "fig11",
            Self::Fig12 => "fig12",
            Self::Table2 => "table2",
            Self::Fig13 => "fig13",
            Self::Fig16 => "fig16",
            Self::Claims => "claims",
        }
    }

    /// What it shows.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Table1 => "Table I: largest stable load/particle mass ratio of particle chains",
            Self::Fig2 => "Fig. 2: distribution of stretch and bend, link chain (a)",
            Self::Fig3 => {
                "Fig. 3: distribution of stretch and bend, chain with regularised bending (e)"
            }
            Self::Fig4 => "Fig. 4: return maps of the stretch, chains (a) and (e)",
            Self::Fig5 => "Fig. 5: spectrum of the bend angle for three bending compliances",
            Self::Fig10 => "Fig. 10: pull",
            Self::Fig11 => "Fig. 11: twist",
            Self::Fig12 => "Fig. 12: bend",
            Self::Table2 => "Table II: largest stable load/segment mass ratio of rigid-body cables",
            Self::Fig13 => "Fig. 13: time a step over the number of elements",
            Self::Fig16 => "Fig. 16: energy of the swinging cable",
            Self::Claims => "The paper's claims in words",
        }
    }

    /// Runs it, whole or quick; `progress` gets its length from the experiment.
    ///
    /// # Errors
    /// [`PaperError`]. A run that becomes unstable is a result, not an error.
    pub fn run(self, quick: bool, progress: &ProgressBar) -> Result<Outcome, PaperError> {
        match self {
            Self::Table1 => table1::outcome(quick, progress),
            Self::Fig2 => chains::distribution(chains::LINKS, "fig2", quick, progress),
            Self::Fig3 => chains::distribution(chains::BENDING, "fig3", quick, progress),
            Self::Fig4 => chains::return_maps(quick, progress),
            Self::Fig5 => chains::spectra(quick, progress),
            Self::Fig10 => specimens::pull(quick, progress),
            Self::Fig11 => specimens::twist(quick, progress),
            Self::Fig12 => specimens::bend(quick, progress),
            Self::Table2 => table2::outcome(quick, progress),
            Self::Fig13 => timing::outcome(quick, progress),
            Self::Fig16 => swing::outcome(quick, progress),
            Self::Claims => claims::outcome(quick, progress),
        }
    }
}

/// The charts of an outcome as one picture; nothing where there are none.
///
/// # Errors
/// [`PaperError::Plot`].
pub fn picture(outcome: &Outcome) -> Result<Option<String>, PaperError> {
    if outcome.charts.is_empty() {
        return Ok(None);
    }
    Ok(Some(plot::svg(&outcome.charts)?))
}
