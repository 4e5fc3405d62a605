//! Cases: what a study runs one by one, keeps in a file as each is finished, and deals to shards.
//!
//! A study gives its cases as lists, stage by stage, with a function that runs one of them
//! ([`Cases::parallel`], [`Cases::in_turn`]). Its tables, page and verdicts depend on the records
//! alone. A resumed run takes the records of its file ([`Journal`]) by the names of the cases and
//! runs the rest; the files of all shards ([`Written::read`]) are the whole study.
//!
//! Every record is written as JSON and read where it is made, whether a file is written or not: what a merged study shows
//! cannot differ from what one run shows.

mod file;
#[cfg(test)]
mod tests;
mod value;

pub use file::{Header, Journal, Known, Written, not_cases};
pub use value::Record;

use file::{Line, damaged};
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::{self, Debug};
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, OnceLock, PoisonError};
use taut_output::check::ExperimentError;

/// No fault: the study is not whole, for other shards have the rest of its cases.
#[derive(Debug, thiserror::Error)]
#[error("the other cases are those of other shards")]
pub struct Elsewhere;

/// One of several runs that share a study, such as `3/8`: the third of eight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which it is, from 1.
    pub number: usize,
    pub of: usize,
}

const MOST: usize = 10_000;

impl Shard {
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// True for its own cases. They are dealt in turn, each round begun one shard later: a list that repeats itself is dealt
    /// evenly all the same.
    fn owns(self, case: usize) -> bool {
        (case + case / self.of) % self.of + 1 == self.number
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let shard = text.split_once('/').and_then(|(number, of)| {
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            (1 <= number && number <= of && of <= MOST).then_some(Self { number, of })
        });
        shard.ok_or_else(|| {
            format!(
                "a shard is its number and how many there are, at most {MOST}: from 1/8 to 8/8 for eight"
            )
        })
    }
}

/// Anything that a file of cases can hold.
pub trait Kept: Serialize + DeserializeOwned {}

impl<T: Serialize + DeserializeOwned> Kept for T {}

/// The cases of a running study. The default runs all, keeps no file and shows no progress.
#[derive(Debug)]
pub struct Cases {
    bar: ProgressBar,
    shard: Shard,
    known: Known,
    journal: Mutex<Option<Journal>>,
    /// Unknown cases are missing instead of due to run.
    is_merged: bool,
    /// Cases of all shards, of this one, and of these those that were run here.
    counts: [AtomicUsize; 3],
}

impl Default for Cases {
    fn default() -> Self {
        Self::new(Shard::WHOLE, Known::new(), None)
    }
}

impl Cases {
    /// Cases of a shard; `known` ones are not run again, finished ones are appended to the journal.
    pub fn new(shard: Shard, known: Known, journal: Option<Journal>) -> Self {
        Self {
            bar: ProgressBar::hidden(),
            shard,
            known,
            journal: Mutex::new(journal),
            is_merged: false,
            counts: Default::default(),
        }
    }

    /// Cases of a finished study; none is run again.
    pub fn merged(known: Known) -> Self {
        Self {
            is_merged: true,
            ..Self::new(Shard::WHOLE, known, None)
        }
    }

    pub fn shown_by(self, bar: ProgressBar) -> Self {
        Self { bar, ..self }
    }

    /// The bar, which advances once for each case.
    pub fn bar(&self) -> &ProgressBar {
        &self.bar
    }

    /// True if the shard is the whole study.
    pub fn is_whole(&self) -> bool {
        self.shard == Shard::WHOLE
    }

    /// Runs a stage's cases in parallel, those that are dealt to this shard by their places in the list.
    pub fn parallel<C: Debug + Sync, T: Kept + Send, E: Into<ExperimentError>>(
        &self,
        stage: &'static str,
        list: &[C],
        run: impl Fn(&C) -> Result<T, E> + Sync,
    ) -> Result<Records<T>, ExperimentError> {
        self.begin(stage, list.len());
        let cases = list.par_iter().enumerate().with_max_len(1);
        let record = |(k, case)| self.case((stage, k), case, &run);
        Ok(Records(cases.map(record).collect::<Result<_, _>>()?))
    }

    /// Runs a stage's cases one after the other, such as those whose times are measured; else as
    /// [`parallel`](Self::parallel).
    pub fn in_turn<C: Debug, T: Kept, E: Into<ExperimentError>>(
        &self,
        stage: &'static str,
        list: &[C],
        run: impl FnMut(&C) -> Result<T, E>,
    ) -> Result<Records<T>, ExperimentError> {
        let records = self.each(stage, list, run).collect::<Result<_, _>>()?;
        Ok(Records(records))
    }

    /// As [`in_turn`](Self::in_turn), each record as soon as it is there; none for a case of another shard.
    pub fn each<'a, C: Debug, T: Kept + 'a, E: Into<ExperimentError> + 'a>(
        &'a self,
        stage: &'static str,
        list: &'a [C],
        mut run: impl FnMut(&C) -> Result<T, E> + 'a,
    ) -> impl Iterator<Item = Result<Option<T>, ExperimentError>> + 'a {
        self.begin(stage, list.len());
        let cases = list.iter().enumerate();
        cases.map(move |(k, case)| self.case((stage, k), case, &mut run))
    }

    /// Result of `study`; `None` if it lacks cases of other shards. For a study with a further
    /// stage.
    pub fn unless_elsewhere<T>(
        study: Result<T, ExperimentError>,
    ) -> Result<Option<T>, ExperimentError> {
        match study {
            Err(e) if e.is::<Elsewhere>() => Ok(None),
            other => other.map(Some),
        }
    }

    fn begin(&self, stage: &'static str, cases: usize) {
        let own = (0..cases).filter(|case| self.shard.owns(*case)).count();
        self.counts[0].fetch_add(cases, Relaxed);
        self.counts[1].fetch_add(own, Relaxed);
        self.bar.reset();
        self.bar.set_length(own as u64);
        self.bar.set_message(stage);
    }

    /// The record of an own case: that of the file, or what running it comes to, which is then appended.
    fn case<C: Debug, T: Kept, E: Into<ExperimentError>>(
        &self,
        (stage, index): (&str, usize),
        case: &C,
        run: impl FnOnce(&C) -> Result<T, E>,
    ) -> Result<Option<T>, ExperimentError> {
        if !self.shard.owns(index) {
            return Ok(None);
        }
        let name = format!("{stage} {}: {case:?}", index + 1);
        let unkept = |why| format!("the record of the case `{name}` cannot be kept: {why}");
        let new;
        let record = match self.known.get(&name) {
            Some((record, _)) => record,
            None if self.is_merged => {
                let unknown = format!(
                    "the case `{name}` is in no file: name those of all shards, and finish the stopped ones with `--resume`"
                );
                return Err(unknown.into());
            }
            None => {
                new = Record::of(&run(case).map_err(Into::into)?).map_err(unkept)?;
                self.write(Some(&Line::Case(name.clone(), new.0.clone())))?;
                self.counts[2].fetch_add(1, Relaxed);
                &new
            }
        };
        let read = record.read().map_err(|why| match self.known.get(&name) {
            Some((_, path)) => damaged(path, &format!("the record of the case `{name}` ({why})")),
            None => unkept(why),
        })?;
        self.bar.inc(1);
        Ok(Some(read))
    }

    fn write(&self, line: Option<&Line>) -> Result<(), String> {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        journal.as_mut().map_or(Ok(()), |file| file.write(line))
    }

    /// Begins the file of a study that had no case to run.
    pub fn finish(&self) -> Result<(), String> {
        self.write(None)
    }

    /// Counts of the cases, in a line.
    pub fn summary(&self) -> String {
        let [all, own, run] = self.counts.each_ref().map(|count| count.load(Relaxed));
        let (shard, known) = (self.shard, own - run);
        format!("shard {shard}: {own} of {all} cases, {run} run now, {known} known")
    }
}

/// The records of a stage: of a shard its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Records<T>(Vec<Option<T>>);

impl<T> Records<T> {
    /// All of them, in the order of the cases.
    pub fn all(self) -> Result<Vec<T>, Elsewhere> {
        let all: Option<Vec<T>> = self.0.into_iter().collect();
        all.ok_or(Elsewhere)
    }

    pub fn of(&self, case: usize) -> Result<&T, Elsewhere> {
        self.0[case].as_ref().ok_or(Elsewhere)
    }
}

/// Value shared by the stages of a case; the first stage to need it makes it.
pub fn shared<T, E>(place: &OnceLock<T>, make: impl FnOnce() -> Result<T, E>) -> Result<&T, E> {
    match place.get() {
        Some(made) => Ok(made),
        // Not under the lock: what is made may be made in parallel.
        None => make().map(|made| place.get_or_init(|| made)),
    }
}
