//! Sequences: the linear systems of consecutive steps in a folder, for measuring refactorisation and warm starts.
//!
//! A *stretch* is as many consecutive steps as have the same pattern; an event that changes the scene begins the next one,
//! numbered from 1. The folder holds, for each stretch and form (`schur`, `kkt`), with `.gz` after the names where compressed:
//!
//! | file | holds |
//! |---|---|
//! | `sequence.csv` | a line a step: its number, its time \[s], its stretch |
//! | `FORM_N.mtx` | the matrix of the first step: all entries of the pattern, zeros among them, as [`super::write`] has it |
//! | `FORM_N_values.mtx` | an array: a column a step, a row for each entry of `FORM_N.mtx`, in the order of that file |
//! | `FORM_N_rhs.mtx` | an array: a column a step, the right-hand side |
//! | `FORM_N_exact.mtx` | an array: a column a step, the solution of A x = b in 32 digits, rounded; where asked for |
//!
//! All but the index are Matrix Market files, numbers in the fewest digits that give the same bits.

mod record;

pub use record::{Recorder, Wanted, Written};

use super::market;
use super::{Matrix, member, shape, stored_matrix_of};
use crate::errors::Cause;
use crate::files::read_text;
use std::path::{Path, PathBuf};
use taut_integrator::Form;
use taut_solver::SymBlockMatrix;

pub const INDEX: &str = "sequence.csv";

/// Heading of the index.
const HEADING: [&str; 3] = ["step", "time", "stretch"];

/// Both forms, in the order of a stretch's systems.
pub const FORMS: [Form; 2] = [Form::Schur, Form::Kkt];

/// Consecutive systems.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Number of the first step: that of steps before it.
    pub first: u64,
    /// Stretches, one pattern each.
    pub stretches: Vec<Stretch>,
}

/// Consecutive systems of the same pattern.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Time at the beginning of each step \[s].
    pub time: Vec<f64>,
    /// The systems in both [`FORMS`].
    pub systems: [Systems; 2],
}

/// Systems of one form and pattern.
#[derive(Debug, Clone, PartialEq)]
pub struct Systems {
    /// The matrix of the first step.
    matrix: SymBlockMatrix,
    /// Places of each entry of the file in the matrix's values: the second is the transposed one in a diagonal block.
    places: Vec<[usize; 2]>,
    /// Values of the entries, step by step.
    values: Vec<Vec<f64>>,
    /// Right-hand sides, step by step.
    pub rhs: Vec<Vec<f64>>,
    /// Exact solutions, step by step, where they are known.
    pub exact: Option<Vec<Vec<f64>>>,
}

impl Sequence {
    /// Number of systems.
    pub fn len(&self) -> usize {
        self.stretches
            .iter()
            .map(|stretch| stretch.time.len())
            .sum()
    }

    /// True without systems; [`read`] never returns that.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Systems {
    /// The matrix of the first step, for [`put`](Self::put).
    pub fn first(&self) -> SymBlockMatrix {
        self.matrix.clone()
    }

    /// Finds the exact solutions where they are not known, and where they are within reach.
    pub fn solve_exactly(&mut self) {
        if self.exact.is_none() {
            self.exact = record::solutions(self);
        }
    }

    /// Gives a matrix of the pattern the values of a step of the stretch.
    pub fn put(&self, step: usize, into: &mut SymBlockMatrix) {
        let to = into.values_mut();
        for (places, value) in self.places.iter().zip(&self.values[step]) {
            places.iter().for_each(|&place| to[place] = *value);
        }
    }

    fn of(matrix: SymBlockMatrix) -> Self {
        Self {
            places: entries(&matrix)
                .into_iter()
                .map(|(.., place)| place)
                .collect(),
            matrix,
            values: Vec::new(),
            rhs: Vec::new(),
            exact: None,
        }
    }

    /// The values of a matrix of the pattern, in the order of the file.
    fn values_of(&self, matrix: &SymBlockMatrix) -> Vec<f64> {
        let values = matrix.values();
        self.places
            .iter()
            .map(|[place, _]| values[*place])
            .collect()
    }
}

/// The entries of the lower triangle, column by column as in a file: column, row, and where they stand in the values.
fn entries(a: &SymBlockMatrix) -> Vec<(usize, usize, [usize; 2])> {
    let p = a.pattern();
    let mut entries = Vec::new();
    for j in 0..p.blocks() {
        for k in p.column(j) {
            let (i, start) = (p.row(k), p.values(k).start);
            let (rows, columns) = (p.size(i), p.size(j));
            for at in 0..rows * columns {
                let (r, c) = (at % rows, at / rows);
                // A diagonal block stores its lower triangle.
                if i != j || r >= c {
                    let mirror = if i == j { c + r * rows } else { at };
                    let place = [start + at, start + mirror];
                    entries.push((p.rows(j).start + c, p.rows(i).start + r, place));
                }
            }
        }
    }
    entries.sort_unstable_by_key(|&(c, r, _)| (c, r));
    entries
}

fn name(form: Form, stretch: usize) -> String {
    format!("{form}_{}", stretch + 1)
}

pub fn read(folder: &Path) -> Result<Sequence, Cause> {
    let (first, times) = read_index(folder)?;
    let stretch = |(stretch, time): (usize, Vec<f64>)| {
        let systems = |form| read_systems(folder, &name(form, stretch), time.len());
        let [schur, kkt] = FORMS.map(systems);
        Ok(Stretch {
            systems: [schur?, kkt?],
            time,
        })
    };
    let stretches = times.into_iter().enumerate().map(stretch);
    Ok(Sequence {
        first,
        stretches: stretches.collect::<Result<_, Cause>>()?,
    })
}

/// The files that a sequence is read from.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let stretches = read_index(folder).map_or(0, |(_, times)| times.len());
    let names = (0..stretches).flat_map(|stretch| FORMS.map(|form| name(form, stretch)));
    let members = names.flat_map(|name| {
        ["", "_values", "_rhs", "_exact"].map(|what| member(folder, &format!("{name}{what}")))
    });
    let there = members.filter(|path| path.exists());
    std::iter::once(folder.join(INDEX)).chain(there).collect()
}

/// The first step, and the times of each stretch.
fn read_index(folder: &Path) -> Result<(u64, Vec<Vec<f64>>), Cause> {
    let path = folder.join(INDEX);
    if !path.is_file() {
        let folder = folder.display();
        return Err(format!(
            "`{folder}` holds no sequence, as it has no {INDEX}: write one with `taut dump SCENE --steps A..B --out DIR`"
        )
        .into());
    }
    let text = read_text(&path)?;
    let shown = path.display();
    let fault = |line: usize, fault: String| format!("{shown}: line {}: {fault}", line + 1);
    let mut lines = text.lines().enumerate();
    if lines.next().map(|(_, heading)| heading) != Some(&HEADING.join(",")) {
        return Err(fault(0, format!("it has to be `{}`", HEADING.join(","))).into());
    }
    let (mut first, mut last, mut times) = (None, None::<u64>, Vec::<Vec<f64>>::new());
    for (at, line) in lines {
        let mut words = line.split(',');
        let step = words.next().and_then(|w| w.parse::<u64>().ok());
        let time = words.next().and_then(|w| w.parse::<f64>().ok());
        let time = time.filter(|time| time.is_finite());
        let stretch = words.next().and_then(|w| w.parse::<usize>().ok());
        let (Some(step), Some(time), Some(stretch), None) = (step, time, stretch, words.next())
        else {
            let what = format!("`{line}` is not a step, its time and its stretch");
            return Err(fault(at, what).into());
        };
        if let Some(before) = last.filter(|last| last.checked_add(1) != Some(step)) {
            return Err(format!(
                "{shown}: step {step} follows step {before}: a sequence has no gaps, write it again with `taut dump`"
            )
            .into());
        }
        if stretch == times.len() + 1 {
            times.push(Vec::new());
        }
        let current = times.len();
        let Some(own) = times.last_mut().filter(|_| stretch == current) else {
            let what = format!("stretch {stretch}: they are numbered from 1 without a gap");
            return Err(fault(at, what).into());
        };
        own.push(time);
        first.get_or_insert(step);
        last = Some(step);
    }
    match first {
        Some(first) => Ok((first, times)),
        None => Err(fault(1, "there are no steps".to_owned()).into()),
    }
}

fn read_systems(folder: &Path, name: &str, steps: usize) -> Result<Systems, Cause> {
    let path = member(folder, name);
    let market = market::read(&path)?;
    let Matrix::Symmetric(matrix) = stored_matrix_of(&market, &path)? else {
        let message = "the matrix of a step is symmetric, this one is not".to_owned();
        return Err(shape(&path, message).into());
    };
    let mut systems = Systems::of(matrix);
    let all = entries(&systems.matrix);
    if all.len() != market.entries.len() {
        let (found, all) = (market.entries.len(), all.len());
        let message =
            format!("{found} entries, where the blocks hold {all}: it has to hold them all");
        return Err(shape(&path, message).into());
    }
    // The rows of the values follow them.
    let mut both = all.iter().zip(&market.entries);
    if let Some((_, (row, column, _))) = both.find(|(a, b)| (a.0, a.1) != (b.1, b.0)) {
        let message = format!(
            "entry ({}, {}) is out of order: entries stand column by column, each once",
            row + 1,
            column + 1
        );
        return Err(shape(&path, message).into());
    }
    let array = |what: &str, rows: usize| {
        let path = member(folder, &format!("{name}_{what}"));
        read_array(&path, rows, steps)
    };
    let rows = systems.matrix.dim();
    systems.values = array("values", systems.places.len())?;
    systems.rhs = array("rhs", rows)?;
    if member(folder, &format!("{name}_exact")).exists() {
        systems.exact = Some(array("exact", rows)?);
    }
    Ok(systems)
}

fn read_array(path: &Path, rows: usize, columns: usize) -> Result<Vec<Vec<f64>>, Cause> {
    let market = market::read(path)?;
    if (market.rows, market.columns) != (rows, columns) {
        let message = format!(
            "{} × {} numbers, where its matrix and {INDEX} ask for {rows} × {columns}",
            market.rows, market.columns
        );
        return Err(shape(path, message).into());
    }
    if !market.array || market.symmetric {
        let message = "it has to be an `array real general`".to_owned();
        return Err(shape(path, message).into());
    }
    let mut array = vec![vec![0.0; rows]; columns];
    for (row, column, value) in market.entries {
        array[column][row] = value;
    }
    Ok(array)
}

#[cfg(test)]
mod tests;
