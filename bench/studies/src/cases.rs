//! Cases: what a study runs one by one, keeps in a file as each is finished, and deals to shards.
//!
//! A study gives its cases as lists, stage by stage, with a function that runs one of them
//! ([`Cases::parallel`], [`Cases::in_turn`]). Its tables, page and verdicts depend on the records
//! alone. A resumed run takes the records of its file ([`Journal`]) by the names of the cases and
//! runs the rest; the files of all shards ([`Written::read`]) are the whole study.
//!
//! Every record is written as JSON and read where it is made, whether a file is written or not: what a merged study shows
//! cannot differ from what one run shows.

mod error;
mod file;
mod shard;
#[cfg(test)]
mod tests;
mod value;

pub use error::CasesError;
pub use file::{Header, Journal, Known, Written};
pub use shard::Shard;
pub use value::Record;

use file::Line;
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, OnceLock, PoisonError};
use taut_output::check::ExperimentError;

/// The cases of a running study. The default runs all, keeps no file and shows no progress.
#[derive(Debug)]
pub struct Cases {
    bar: ProgressBar,
    shard: Shard,
    known: Known,
    journal: Mutex<Option<Journal>>,
    /// Unknown cases are missing instead of due to run.
    is_merged: bool,
    counts: Counts,
}

/// How many cases there are of all shards, and of this one; how many were run here.
#[derive(Debug, Default)]
struct Counts {
    all: AtomicUsize,
    own: AtomicUsize,
    run: AtomicUsize,
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
            counts: Counts::default(),
        }
    }

    /// Cases of a finished study; none is run again.
    pub fn merged(known: Known) -> Self {
        Self {
            is_merged: true,
            ..Self::new(Shard::WHOLE, known, None)
        }
    }

    /// Sets the bar that shows the progress.
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
    pub fn parallel<C, T, E>(
        &self,
        stage: &'static str,
        list: &[C],
        run: impl Fn(&C) -> Result<T, E> + Sync,
    ) -> Result<Records<T>, ExperimentError>
    where
        C: Debug + Sync,
        T: Serialize + DeserializeOwned + Send,
        E: Into<ExperimentError>,
    {
        let own = self.begin(stage, list.len());
        let cases = own.into_par_iter().enumerate().with_max_len(1);
        let record = |(k, is_own)| self.case(is_own, (stage, k), &list[k], &run);
        Ok(Records(cases.map(record).collect::<Result<_, _>>()?))
    }

    /// Runs a stage's cases one after the other, such as those whose times are measured; else as
    /// [`parallel`](Self::parallel).
    pub fn in_turn<C, T, E>(
        &self,
        stage: &'static str,
        list: &[C],
        run: impl FnMut(&C) -> Result<T, E>,
    ) -> Result<Records<T>, ExperimentError>
    where
        C: Debug,
        T: Serialize + DeserializeOwned,
        E: Into<ExperimentError>,
    {
        let records = self.each(stage, list, run).collect::<Result<_, _>>()?;
        Ok(Records(records))
    }

    /// As [`in_turn`](Self::in_turn), each record as soon as it is there; none for a case of another shard.
    pub fn each<'a, C, T, E>(
        &'a self,
        stage: &'static str,
        list: &'a [C],
        mut run: impl FnMut(&C) -> Result<T, E> + 'a,
    ) -> impl Iterator<Item = Result<Option<T>, ExperimentError>> + 'a
    where
        C: Debug,
        T: Serialize + DeserializeOwned + 'a,
        E: Into<ExperimentError> + 'a,
    {
        let own = self.begin(stage, list.len()).into_iter().enumerate();
        own.map(move |(k, is_own)| self.case(is_own, (stage, k), &list[k], &mut run))
    }

    /// Result of `study`; `None` if it lacks cases of other shards. For a study with a further
    /// stage.
    pub fn unless_elsewhere<T>(
        study: Result<T, ExperimentError>,
    ) -> Result<Option<T>, ExperimentError> {
        match study {
            Err(e) if CasesError::is_elsewhere(&e) => Ok(None),
            other => other.map(Some),
        }
    }

    /// Deals the cases of a stage: which of them are run here.
    fn begin(&self, stage: &'static str, cases: usize) -> Vec<bool> {
        let own: Vec<bool> = (0..cases).map(|case| self.shard.owns(case)).collect();
        let count = own.iter().filter(|is_own| **is_own).count();
        self.counts.all.fetch_add(cases, Relaxed);
        self.counts.own.fetch_add(count, Relaxed);
        self.bar.reset();
        self.bar.set_length(count as u64);
        self.bar.set_message(stage);
        own
    }

    /// The record of an own case: that of the file, or what running it comes to, which is then appended.
    fn case<C: Debug, T: Serialize + DeserializeOwned, E: Into<ExperimentError>>(
        &self,
        is_own: bool,
        (stage, index): (&str, usize),
        case: &C,
        mut run: impl FnMut(&C) -> Result<T, E>,
    ) -> Result<Option<T>, ExperimentError> {
        if !is_own {
            return Ok(None);
        }
        let name = format!("{stage} {}: {case:?}", index + 1);
        let unkept = |reason| {
            let text = format!("the record of the case `{name}` cannot be kept: {reason}");
            CasesError::Refused(text)
        };
        let new;
        let record = match self.known.get(&name) {
            Some(record) => record,
            None if self.is_merged => {
                let text = format!(
                    "the case `{name}` is in no file: name those of all shards, and finish the stopped ones with `--resume`"
                );
                return Err(CasesError::Refused(text).into());
            }
            None => {
                let made = run(case).map_err(Into::into)?;
                new = Record::of(&made).map_err(unkept)?;
                self.write(Some(&Line::Case(name.clone(), new.0.clone())))?;
                self.counts.run.fetch_add(1, Relaxed);
                &new
            }
        };
        let read = record.read().map_err(unkept)?;
        self.bar.inc(1);
        Ok(Some(read))
    }

    fn write(&self, line: Option<&Line>) -> Result<(), CasesError> {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        journal.as_mut().map_or(Ok(()), |file| file.write(line))
    }

    /// Begins the file of a study that had no case to run.
    pub fn finish(&self) -> Result<(), CasesError> {
        self.write(None)
    }

    /// Counts of the cases, in a line.
    pub fn told(&self) -> String {
        let [all, own, run] = [&self.counts.all, &self.counts.own, &self.counts.run];
        let [all, own, run] = [all, own, run].map(|count| count.load(Relaxed));
        let shard = self.shard;
        format!(
            "shard {shard}: {own} of {all} cases, {run} run now, {} known",
            own - run
        )
    }
}

/// The records of a stage: of a shard its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Records<T>(Vec<Option<T>>);

impl<T> Records<T> {
    /// All of them, in the order of the cases.
    pub fn all(self) -> Result<Vec<T>, CasesError> {
        let all: Option<Vec<T>> = self.0.into_iter().collect();
        all.ok_or(CasesError::Elsewhere)
    }

    /// Record of a case.
    pub fn of(&self, case: usize) -> Result<&T, CasesError> {
        self.0[case].as_ref().ok_or(CasesError::Elsewhere)
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
