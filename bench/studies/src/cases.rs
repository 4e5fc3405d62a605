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
use taut_ground::files;
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
        Self {
            bar: ProgressBar::hidden(),
            shard: Shard::WHOLE,
            known: Known::new(),
            journal: Mutex::new(None),
            is_merged: false,
            counts: Counts::default(),
        }
    }
}

impl Cases {
    /// Cases of a shard; `known` ones are not run again, finished ones are appended to the journal.
    #[must_use]
    pub fn new(shard: Shard, known: Known, journal: Option<Journal>) -> Self {
        Self {
            shard,
            known,
            journal: Mutex::new(journal),
            ..Self::default()
        }
    }

    /// Cases of a finished study; none is run again.
    #[must_use]
    pub fn merged(known: Known) -> Self {
        Self {
            known,
            is_merged: true,
            ..Self::default()
        }
    }

    /// Sets the bar that shows the progress.
    #[must_use]
    pub fn shown_by(self, bar: ProgressBar) -> Self {
        Self { bar, ..self }
    }

    /// The bar, which advances once for each case.
    #[must_use]
    pub fn bar(&self) -> &ProgressBar {
        &self.bar
    }

    /// True if the shard is the whole study.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.shard == Shard::WHOLE
    }

    /// Runs a stage's cases in parallel, those that are dealt to this shard by their `cost`, in any unit. A list of the same
    /// costs is dealt alike in every stage.
    ///
    /// # Errors
    /// The error of a case; a record that cannot be kept.
    pub fn parallel<C, T, E>(
        &self,
        stage: &'static str,
        list: &[C],
        cost: impl Fn(&C) -> f64,
        run: impl Fn(&C) -> Result<T, E> + Sync,
    ) -> Result<Records<T>, ExperimentError>
    where
        C: Debug + Sync,
        T: Serialize + DeserializeOwned + Send,
        E: Into<ExperimentError>,
    {
        let own = self.begin(stage, list, cost);
        let cases = own.into_par_iter().enumerate().with_max_len(1);
        let record = |(k, is_own): (usize, bool)| {
            let run = || run(&list[k]);
            is_own
                .then(|| self.case(stage, k, &list[k], run))
                .transpose()
        };
        Ok(Records(cases.map(record).collect::<Result<_, _>>()?))
    }

    /// Runs a stage's cases one after the other, such as those whose times are measured; else as
    /// [`parallel`](Self::parallel).
    ///
    /// # Errors
    /// As for [`parallel`](Self::parallel).
    pub fn in_turn<C, T, E>(
        &self,
        stage: &'static str,
        list: &[C],
        cost: impl Fn(&C) -> f64,
        run: impl FnMut(&C) -> Result<T, E>,
    ) -> Result<Records<T>, ExperimentError>
    where
        C: Debug,
        T: Serialize + DeserializeOwned,
        E: Into<ExperimentError>,
    {
        let records = self
            .each(stage, list, cost, run)
            .collect::<Result<_, _>>()?;
        Ok(Records(records))
    }

    /// As [`in_turn`](Self::in_turn), each record as soon as it is there; none for a case of another shard.
    pub fn each<'a, C, T, E>(
        &'a self,
        stage: &'static str,
        list: &'a [C],
        cost: impl Fn(&C) -> f64,
        mut run: impl FnMut(&C) -> Result<T, E> + 'a,
    ) -> impl Iterator<Item = Result<Option<T>, ExperimentError>> + 'a
    where
        C: Debug,
        T: Serialize + DeserializeOwned + 'a,
        E: Into<ExperimentError> + 'a,
    {
        let own = self.begin(stage, list, cost).into_iter().enumerate();
        own.map(move |(k, is_own)| {
            let run = || run(&list[k]);
            is_own
                .then(|| self.case(stage, k, &list[k], run))
                .transpose()
        })
    }

    /// Result of `study`; `None` if it lacks cases of other shards. For a study with a further
    /// stage.
    ///
    /// # Errors
    /// Errors of the study.
    pub fn unless_elsewhere<T>(
        study: Result<T, ExperimentError>,
    ) -> Result<Option<T>, ExperimentError> {
        match study {
            Err(e) if CasesError::is_elsewhere(&e) => Ok(None),
            other => other.map(Some),
        }
    }

    /// Deals the cases of a stage: which of them are run here.
    fn begin<C>(&self, stage: &'static str, list: &[C], cost: impl Fn(&C) -> f64) -> Vec<bool> {
        let costs: Vec<f64> = list.iter().map(cost).collect();
        let own = self.shard.own(&costs);
        let count = own.iter().filter(|is_own| **is_own).count();
        self.counts.all.fetch_add(list.len(), Relaxed);
        self.counts.own.fetch_add(count, Relaxed);
        self.bar.reset();
        self.bar.set_length(count as u64);
        self.bar.set_message(stage);
        own
    }

    /// The record of a case: that of the file, or what running it comes to, which is then appended.
    fn case<C: Debug, T: Serialize + DeserializeOwned, E: Into<ExperimentError>>(
        &self,
        stage: &'static str,
        index: usize,
        case: &C,
        run: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, ExperimentError> {
        let name = format!("{stage} {}: {case:?}", index + 1);
        let new;
        let record = match self.known.get(&name) {
            Some(record) => record,
            None if self.is_merged => return Err(CasesError::Missing(name).into()),
            None => {
                let made = run().map_err(Into::into)?;
                new = Record::of(&made).map_err(|e| CasesError::Record(name.clone(), e))?;
                self.write(Some(&Line::Case(name.clone(), new.0.clone())))?;
                self.counts.run.fetch_add(1, Relaxed);
                &new
            }
        };
        let read = record.read().map_err(|e| CasesError::Record(name, e))?;
        self.bar.inc(1);
        Ok(read)
    }

    /// Writes to the file. One that nobody asked for is given up where it cannot be written, and the study goes on.
    fn write(&self, line: Option<&Line>) -> Result<(), CasesError> {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(open) = journal.as_mut() else {
            return Ok(());
        };
        match open.write(line) {
            Err(e) if !open.is_asked_for => {
                files::complain(&format!("{e}: this run cannot be resumed"));
                *journal = None;
                Ok(())
            }
            other => other,
        }
    }

    /// Begins the file of a study that had no case to run.
    ///
    /// # Errors
    /// A file that cannot be written, where it was asked for.
    pub fn finish(&self) -> Result<(), CasesError> {
        self.write(None)
    }

    /// Counts of the cases, in a line.
    #[must_use]
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
    ///
    /// # Errors
    /// [`CasesError::Elsewhere`] where some are those of other shards.
    pub fn all(self) -> Result<Vec<T>, CasesError> {
        let all: Option<Vec<T>> = self.0.into_iter().collect();
        all.ok_or(CasesError::Elsewhere)
    }

    /// Record of a case.
    ///
    /// # Errors
    /// [`CasesError::Elsewhere`] where it is of another shard.
    pub fn of(&self, case: usize) -> Result<&T, CasesError> {
        self.0[case].as_ref().ok_or(CasesError::Elsewhere)
    }
}

/// Value shared by the stages of a case; the first stage to need it makes it.
///
/// # Errors
/// Errors of `make`.
pub fn shared<T, E>(place: &OnceLock<T>, make: impl FnOnce() -> Result<T, E>) -> Result<&T, E> {
    match place.get() {
        Some(made) => Ok(made),
        // Not under the lock: what is made may be made in parallel.
        None => make().map(|made| place.get_or_init(|| made)),
    }
}
