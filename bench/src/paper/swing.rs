//! Fig. 16: energy of the swinging cable.

use super::{Outcome, PaperError};
use indicatif::ProgressBar;

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}
