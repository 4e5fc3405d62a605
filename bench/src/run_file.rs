//! Runs as files: JSON that holds all bits of a run's state, so that `taut run --resume` goes on where `--save` stopped.
//!
//! ```json
//! {"run": {"version": 2, "options": {…}, "scene": {…}, …}, "yardstick": {…}, "driven": ["hoist_speed"], "checksum": 907060870}
//! ```
//!
//! The checksum is the CRC-32 of run, yardstick and names as they are written without blanks: laid out anew, with its keys in
//! another order and its numbers in another form, a file is still good, and a number that is another one is found.

use crate::run::ReferenceValues;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::io;
use std::path::Path;
use taut_integrator::{SavedRun, Stepper};
use taut_measure::files::{self, FileError, Output};

/// A saved run with what it is judged by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunFile {
    pub run: SavedRun,
    pub yardstick: ReferenceValues,
    /// Names of the controls that a table of inputs has driven.
    pub driven: Vec<String>,
    checksum: u32,
    /// Checksum of the content as this version writes it, or else as read, with the keys that only earlier versions wrote.
    #[serde(skip)]
    read: Option<u32>,
}

/// A CRC-32: what is written into it is counted in.
#[derive(Default)]
pub(crate) struct Sum(crc32fast::Hasher);

impl Sum {
    pub(crate) fn finalize(self) -> u32 {
        self.0.finalize()
    }
}

impl io::Write for Sum {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn sum(content: &impl Serialize) -> Result<u32, serde_json::Error> {
    let mut sum = Sum::default();
    serde_json::to_writer(&mut sum, content)?;
    Ok(sum.finalize())
}

impl RunFile {
    /// File of a run that a table of inputs drives by the controls `driven`. Writing computes the
    /// checksum.
    pub fn new(run: SavedRun, yardstick: ReferenceValues, driven: Vec<String>) -> Self {
        Self {
            run,
            yardstick,
            driven,
            checksum: 0,
            read: None,
        }
    }

    /// True if it was read, and its checksum is that of the content.
    pub fn is_whole(&self) -> bool {
        self.read == Some(self.checksum)
    }

    /// Reads a text, damaged or not ([`is_whole`](Self::is_whole)).
    pub fn parse(text: &str) -> Result<Self, serde_json::Error> {
        let mut file: Self = serde_json::from_str(text)?;
        let mut read = sum(&(&file.run, &file.yardstick, &file.driven))?;
        if read != file.checksum {
            let content: Value = serde_json::from_str(text)?;
            let [run, yardstick, driven] = ["run", "yardstick", "driven"].map(|key| &content[key]);
            read = sum(&(run, yardstick, driven))?;
        }
        file.read = Some(read);
        Ok(file)
    }

    /// Reads a file, and makes the stepper; the names are those of the controls that were driven.
    pub fn resume(path: &Path) -> Result<(Stepper, ReferenceValues, Vec<String>), String> {
        let text = files::read_text(path).map_err(|e| e.to_string())?;
        let name = path.display();
        let file = Self::parse(&text).map_err(|e| format!("`{name}` is no saved run: {e}"))?;
        if !file.is_whole() {
            return Err(format!(
                "`{name}` is damaged: what it holds has another checksum; take a copy of it, or run the scene again"
            ));
        }
        let stepper = Stepper::restore(file.run).map_err(|e| format!("`{name}`: {e}"))?;
        Ok((stepper, file.yardstick, file.driven))
    }

    pub fn write(mut self, to: &Output) -> Result<(), FileError> {
        to.write(|out| self.put(out))
    }

    /// Content of the file.
    pub fn bytes(mut self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.put(&mut bytes)?;
        Ok(bytes)
    }

    fn put(&mut self, out: &mut dyn io::Write) -> io::Result<()> {
        self.checksum = sum(&(&self.run, &self.yardstick, &self.driven))?;
        serde_json::to_writer(&mut *out, self)?;
        out.write_all(b"\n")
    }
}
