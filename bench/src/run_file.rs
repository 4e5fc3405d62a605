//! Runs as files: JSON that holds all bits of a run's state, so that `taut run --resume` goes on where `--save` stopped.
//!
//! ```json
//! {"run": {"version": 1, "options": {…}, "scene": {…}, …}, "yardstick": {"cable": null, "max_gap": null, "planar": false}}
//! ```

use crate::output::{self, FileError};
use crate::run::Yardstick;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};
use taut_integrator::{SavedRun, StepError, Stepper};

/// A saved run with what it is judged by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFile {
    /// The run.
    pub run: SavedRun,
    /// What it is judged by.
    pub yardstick: Yardstick,
}

/// Why a file is no run that can be taken up again.
#[derive(Debug)]
pub enum RunFileError {
    /// It cannot be read or written.
    File(FileError),
    /// It is no saved run, or one of another version.
    Format(PathBuf, serde_json::Error),
    /// It cannot be stepped.
    Run(PathBuf, StepError),
}

impl fmt::Display for RunFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(e) => e.fmt(f),
            Self::Format(path, e) => {
                write!(f, "`{}` is no saved run: {e}", path.display())
            }
            Self::Run(path, e) => write!(f, "`{}`: {e}", path.display()),
        }
    }
}

impl std::error::Error for RunFileError {}

impl RunFile {
    /// Reads a text.
    ///
    /// # Errors
    /// The reader's, with line and column.
    pub fn parse(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }

    /// Writes the text; numbers that have no finite value are limits that are none.
    ///
    /// # Errors
    /// The writer's: none, as far as it is known.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string(self)? + "\n")
    }

    /// Reads a file, and makes the stepper.
    ///
    /// # Errors
    /// [`RunFileError`].
    pub fn resume(path: &Path) -> Result<(Stepper, Yardstick), RunFileError> {
        let text = output::read_text(path).map_err(RunFileError::File)?;
        let file = Self::parse(&text).map_err(|e| RunFileError::Format(path.to_owned(), e))?;
        let stepper = Stepper::restore(file.run);
        let stepper = stepper.map_err(|e| RunFileError::Run(path.to_owned(), e))?;
        Ok((stepper, file.yardstick))
    }

    /// Writes a file, `-` for standard output.
    ///
    /// # Errors
    /// [`RunFileError`].
    pub fn write(&self, path: &Path) -> Result<(), RunFileError> {
        let text = self.text();
        let text = text.map_err(|e| RunFileError::Format(path.to_owned(), e))?;
        output::write_text(path, &text).map_err(RunFileError::File)
    }
}
