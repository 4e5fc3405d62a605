//! What the paper claims in words, each with a number.

use super::{Outcome, PaperError};
use indicatif::ProgressBar;

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}
