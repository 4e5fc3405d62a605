//! Records the systems of a run as a [sequence](super).

use super::{FORMS, HEADING, INDEX, Stretch, Systems, name};
use crate::errors::Cause;
use crate::files::{Output, make_folder, remove};
use crate::matrix::dump::{self, body_rows};
use crate::matrix::prepared::Problem;
use crate::matrix::{Matrix, exact, write};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use taut_integrator::Stepper;
use taut_solver::SymBlockMatrix;

/// Most numbers of a stretch: half a gigabyte of doubles.
const MOST_NUMBERS: usize = 1 << 26;

/// How a sequence is written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wanted {
    /// Folder of the files.
    pub folder: PathBuf,
    /// Lines about scene and step.
    pub comments: Vec<String>,
    /// Writes the exact solutions.
    pub exact: bool,
    /// Compresses the files.
    pub gzip: bool,
}

/// Takes the systems of consecutive steps and writes a stretch when it ends.
#[derive(Debug)]
pub struct Recorder {
    wanted: Wanted,
    stretch: Option<Stretch>,
    /// Stretches that are written.
    written: usize,
    /// Numbers that are held.
    numbers: usize,
    /// Lines of the index.
    lines: Vec<String>,
    /// Files that are written.
    files: Vec<PathBuf>,
    /// Systems without the solutions that were asked for.
    inexact: Vec<String>,
}

/// Result of [`Recorder::finish`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    pub files: Vec<PathBuf>,
    pub stretches: usize,
    /// Matrix files whose exact solutions were asked for and are out of reach.
    pub inexact: Vec<String>,
}

impl Recorder {
    /// Recorder without steps. It removes the index of an earlier sequence from the folder, which
    /// ends that sequence.
    pub fn new(wanted: Wanted) -> Result<Self, Cause> {
        make_folder(&wanted.folder)?;
        remove(&wanted.folder.join(INDEX))?;
        Ok(Self {
            wanted,
            stretch: None,
            written: 0,
            numbers: 0,
            lines: Vec::new(),
            files: Vec::new(),
            inexact: Vec::new(),
        })
    }

    /// Takes the systems of the step that a stepper is about to make, which stays as it is.
    pub fn take(&mut self, step: u64, stepper: &Stepper) -> Result<(), Cause> {
        // A copy: a solve more would have another geometric stiffness in the next step.
        let mut copy = Stepper::restore(stepper.save()?)?;
        let systems = dump::assembled(&mut copy)?;
        let continues = |stretch: &Stretch| {
            let both = stretch.systems.iter().zip(&systems);
            both.into_iter()
                .all(|(known, (a, _))| known.matrix.pattern() == a.pattern())
        };
        if !self.stretch.as_ref().is_some_and(continues) {
            self.end_stretch()?;
        }
        let stretch = self.stretch.get_or_insert_with(|| Stretch {
            time: Vec::new(),
            systems: [&systems[0].0, &systems[1].0].map(|a| Systems::of(a.clone())),
        });
        stretch.time.push(stepper.time());
        for (own, (a, b)) in stretch.systems.iter_mut().zip(systems) {
            self.numbers += own.places.len() + 2 * b.len();
            own.values.push(own.values_of(&a));
            own.rhs.push(b);
        }
        if self.numbers > MOST_NUMBERS {
            return Err(format!(
                "the systems hold more than {MOST_NUMBERS} numbers: write fewer `--steps` at once"
            )
            .into());
        }
        let (time, number) = (stepper.time(), self.written + 1);
        self.lines.push(format!("{step},{time:e},{number}"));
        Ok(())
    }

    /// Writes what is left and the index.
    pub fn finish(mut self) -> Result<Written, Cause> {
        self.end_stretch()?;
        let path = self.wanted.folder.join(INDEX);
        Output::open(&path)?.write(|out| {
            writeln!(out, "{}", HEADING.join(","))?;
            self.lines
                .iter()
                .try_for_each(|line| writeln!(out, "{line}"))
        })?;
        self.files.push(path);
        Ok(Written {
            files: self.files,
            stretches: self.written,
            inexact: self.inexact,
        })
    }

    fn end_stretch(&mut self) -> Result<(), Cause> {
        let Some(stretch) = self.stretch.take() else {
            return Ok(());
        };
        for (form, systems) in FORMS.into_iter().zip(&stretch.systems) {
            let name = name(form, self.written);
            self.write(&name, systems)?;
        }
        self.written += 1;
        self.numbers = 0;
        Ok(())
    }

    fn write(&mut self, name: &str, systems: &Systems) -> Result<(), Cause> {
        let Wanted {
            folder,
            comments,
            exact,
            gzip,
            ..
        } = &self.wanted;
        let folder: &Path = folder;
        let signs = if name.starts_with("kkt") {
            body_rows(&systems.matrix)
        } else {
            Vec::new()
        };
        // An earlier sequence may have left solutions, and files of the other ending, which would be read with these.
        for what in ["", "_values", "_rhs", "_exact"] {
            remove(&folder.join(format!("{name}{what}.mtx")))?;
            remove(&folder.join(format!("{name}{what}.mtx.gz")))?;
        }
        let mut put = |what: &str, text: &str| {
            let path = write::file(folder, &format!("{name}{what}"), text, *gzip)?;
            self.files.push(path);
            Ok::<(), Cause>(())
        };
        put("", &write::symmetric(&systems.matrix, &signs, comments))?;
        let array = |columns: &[Vec<f64>], comment: &str| {
            let comments = [comments.as_slice(), &[comment.to_owned()]].concat();
            write::array(columns, &comments)
        };
        let comment =
            "values: a column a step, a row for each entry of the matrix file, in its order";
        put("_values", &array(&systems.values, comment))?;
        put("_rhs", &array(&systems.rhs, "b: a column a step"))?;
        if *exact {
            let Some(x) = solutions(systems) else {
                self.inexact.push(name.to_owned());
                return Ok(());
            };
            let comment = "x: a column a step, the solution of A x = b in 32 digits, rounded";
            put("_exact", &array(&x, comment))?;
        }
        Ok(())
    }
}

/// The solutions in extended precision; none where that of a step is out of reach.
pub(super) fn solutions(systems: &Systems) -> Option<Vec<Vec<f64>>> {
    let solution = |(step, b): (usize, &Vec<f64>)| {
        let mut matrix: SymBlockMatrix = systems.first();
        systems.put(step, &mut matrix);
        let matrix = Matrix::Symmetric(matrix);
        exact::solution(&Problem::new(&matrix), b).map(|(x, _)| x)
    };
    systems.rhs.par_iter().enumerate().map(solution).collect()
}
