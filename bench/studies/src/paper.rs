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

use indicatif::ProgressBar;
use taut_output::check::{ExperimentError, Outcome};

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
    /// [`ExperimentError`]. A run that becomes unstable is a result, not an error.
    pub fn run(self, quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
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
