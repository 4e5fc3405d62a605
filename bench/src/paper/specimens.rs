//! Figs 10–12: specimens pulled, twisted and bent.

use super::{Outcome, PaperError};
use indicatif::ProgressBar;

pub(super) fn pull(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}

pub(super) fn twist(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}

pub(super) fn bend(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}
