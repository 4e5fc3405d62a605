//! Table II: the largest stable mass ratio of rigid-body cables.

use super::{Outcome, PaperError};
use indicatif::ProgressBar;

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, PaperError> {
    Ok(Outcome::default())
}
