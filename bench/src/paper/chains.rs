//! Figs 2–5: what bending does to a chain's motion.

use super::{Outcome, PaperError};
use indicatif::ProgressBar;

/// Which chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Model {
    /// (a)
    Links,
    /// (e)
    Bending,
}

pub(super) fn distribution(
    _model: Model,
    _quick: bool,
    _progress: &ProgressBar,
) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}

pub(super) fn return_maps(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}

pub(super) fn spectra(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}
