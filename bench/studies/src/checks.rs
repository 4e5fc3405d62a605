//! Experiments that end in checks: run one after the other, reported, counted, judged. What `hard` and `paper` share.

use crate::study::{Found, Reporter, data};
use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;
use std::fmt::Write;
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};
use taut_output::settings::set;
use taut_output::table;

#[derive(Debug, Clone, Copy)]
pub struct Experiment {
    /// Its name on the command line, and of its files.
    pub name: &'static str,
    pub title: &'static str,
    /// Runs it, whole or quick; the bar gets its length from the experiment. A run that becomes unstable is a result,
    /// not an error.
    pub run: fn(bool, &ProgressBar) -> Result<Outcome, ExperimentError>,
}

impl Measured for Experiment {
    fn name(&self) -> &'static str {
        self.name
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn run(&self, quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
        (self.run)(quick, progress)
    }
}

/// Anything that ends in checks.
pub trait Measured: Copy + Sync {
    /// Its name on the command line, and of its files.
    fn name(&self) -> &'static str;

    fn title(&self) -> &'static str;

    /// Runs it, whole or quick.
    fn run(&self, quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError>;

    /// Runs it, whole or quick. An experiment that comes to no check at all has failed.
    fn outcome(&self, quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
        let mut outcome = self.run(quick, progress)?;
        if outcome.checks.is_empty() {
            let ours = "nothing was measured";
            let check = Check::claim(self.title(), "", ours, Verdict::Fail, "");
            outcome.checks.push(check);
        }
        Ok(outcome)
    }
}

/// Runs tasks in parallel; `progress` advances once for each.
pub(crate) fn each<T: Sync, R: Send, E: Send>(
    tasks: &[T],
    progress: &ProgressBar,
    run: impl Fn(&T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    progress.set_length(tasks.len() as u64);
    let run = |task| run(task).inspect(|_| progress.inc(1));
    tasks.par_iter().with_max_len(1).map(run).collect()
}

/// Experiments that are reported together.
pub(crate) struct Catalogue<E> {
    /// Legend of the columns, and the reference's heading.
    pub(crate) legend: &'static str,
    pub(crate) reference: &'static str,
    pub(crate) experiments: Vec<E>,
    pub(crate) quick: bool,
}

/// A check as it is written.
#[derive(Serialize)]
struct Row {
    experiment: &'static str,
    title: &'static str,
    #[serde(flatten)]
    check: Check,
}

/// What an error leaves of a case, or of one of its runs.
pub(crate) fn ended(what: &str, e: &ExperimentError) -> Check {
    let [wanted, ours] = ["runs to its end", "an error"];
    Check::claim(what, wanted, ours, Verdict::Fail, e.to_string())
}

/// Runs the experiments, each once and each a case, tells their tables, gives each outcome to `write`.
pub(crate) fn run<E: Measured>(
    catalogue: &Catalogue<E>,
    reporter: &mut Reporter<'_>,
    write: &dyn Fn(&E, &Outcome) -> Result<(), ExperimentError>,
) -> Result<Found, ExperimentError> {
    (reporter.say)(&format!("{}\n", catalogue.legend))?;
    let mut experiments: Vec<E> = Vec::new();
    for experiment in &catalogue.experiments {
        if !experiments
            .iter()
            .any(|known| known.name() == experiment.name())
        {
            experiments.push(*experiment);
        }
    }
    let names: Vec<_> = experiments.iter().map(E::name).enumerate().collect();
    let bar = reporter.cases.bar();
    let outcome = |(k, name): &(usize, &'static str)| {
        bar.reset();
        bar.set_message(*name);
        // The others are still reported.
        let outcome = experiments[*k].outcome(catalogue.quick, bar);
        Ok::<_, ExperimentError>(
            outcome.unwrap_or_else(|e| vec![ended("the case itself", &e)].into()),
        )
    };
    let outcomes = reporter.cases.each("experiments", &names, outcome);
    let mut rows: Vec<Row> = Vec::new();
    for (experiment, outcome) in experiments.iter().zip(outcomes) {
        let outcome = outcome?;
        // A shard tells nothing.
        let Some(outcome) = outcome.filter(|_| reporter.cases.is_whole()) else {
            continue;
        };
        let (name, title) = (experiment.name(), experiment.title());
        write(experiment, &outcome)?;
        let shown = table::checks(&outcome, catalogue.reference);
        (reporter.say)(&format!("\n{name}: {title}\n{shown}"))?;
        rows.extend(outcome.checks.into_iter().map(|check| Row {
            experiment: name,
            title,
            check,
        }));
    }
    let failed = rows.iter().filter(|r| r.check.verdict == Verdict::Fail);
    let (failed, count) = (failed.count(), rows.len());
    Ok(Found {
        settings: set([("quick", catalogue.quick.to_string())]),
        text: summary(&rows),
        rows: data(&rows)?,
        missed: (failed > 0).then(|| format!("{failed} of {count} checks miss their bar")),
        ..Found::default()
    })
}

/// How many checks came to what.
fn summary(rows: &[Row]) -> String {
    let mut out = format!("\n{} checks:", rows.len());
    for verdict in Verdict::ALL {
        let own = || rows.iter().filter(|r| r.check.verdict == verdict);
        let count = own().count();
        if count > 0 {
            let _ = write!(out, " {count} {verdict}");
            let beyond = own().filter(|r| r.check.is_beyond()).count();
            if verdict == Verdict::Limit && beyond > 0 {
                let _ = write!(out, " ({beyond} beyond the catalogue's bar)");
            }
            out.push(',');
        }
    }
    format!("{}\n", out.trim_end_matches(','))
}
