//! `taut track`: per-step figures against the baseline.

use super::Failure;
use super::against;
use super::console::Console;
use crate::machine::Machine;
use crate::track::{self, CASES, Case, Comparison, Config, Counter, Entry, Row, Run};
use clap::{Args, value_parser};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Duration;
use taut_measure::Choice;
use taut_measure::files::{self, Output};
use taut_solver::Backend;
use taut_studies::options::number;

/// Where the baseline is, from the repository's root.
const BASELINE: &str = "bench/track-baseline.json";

pub(crate) const AFTER_HELP: &str = "\
`--against`: the base is the program or revision named, the head is this program. Both are started 80 times (`--quick`: 32) \
and time blocks of 2 ms in turns: base, head, head, base. A start gives the ratio of their least times; the table has the \
median of these ratios with its bootstrap interval of 95 %. A figure whose interval holds the bar takes up to four times \
as many starts, until it does not. Two builds of the same sources may differ by a percent, by \
where their code lies. A figure that the base has and the head lacks fails.

A revision is built below target/taut/against, with the profile, features and compiler flags of this program and \
otherwise in the same environment; one build at a time.

`--self-test` checks the comparisons on this machine: the slowed program spins after each step for 10 % of its time, and \
each of its figures has to fail.

Exit code 1: a figure or the self-test fails. Exit code 3: nothing was compared, or instructions that were to be counted \
are compared with nothing. A commit that changes the baseline says why. Workflows to copy: `bench/ci`.

Examples:
  taut track --quick
  taut track --instructions
  taut track --instructions --update
  taut track --against origin/main --instructions
  taut track hoist-24-1e3/banded --against ../other/target/release/taut
  taut track --self-test
  taut track --history track.jsonl && taut report track.jsonl --out track.html";

#[derive(Debug, Args)]
pub(crate) struct TrackArgs {
    /// Cases by name, such as hoist-24-1e3/banded (default: all)
    #[arg(value_name = "CASE", value_parser = track::named)]
    pub(super) cases: Vec<Case>,
    /// A few cases unless some are named, and less time for each
    #[arg(long)]
    pub(super) quick: bool,
    /// Counts instructions as well, under valgrind
    #[arg(long)]
    pub(super) instructions: bool,
    /// What the figures are compared with
    #[arg(long, value_name = "FILE", default_value = BASELINE)]
    baseline: PathBuf,
    /// Rewrites the baseline with what was measured, unless an error is beyond its bar
    #[arg(long)]
    update: bool,
    /// Writes the figures to a file as well, in github-action-benchmark's customSmallerIsBetter (`-` for standard output,
    /// which then holds nothing else)
    #[arg(long, value_name = "PATH")]
    json: Option<PathBuf>,
    /// The same in Bencher's metric format
    #[arg(long, value_name = "PATH")]
    bencher: Option<PathBuf>,
    /// Compares this program with another program `taut`, or with a revision of the repository here, built as this program
    /// was: fails where a step takes longer by 3 % and by more than chance
    #[arg(long, value_name = "BINARY|REVISION", conflicts_with_all = ["update", "baseline"])]
    against: Option<String>,
    /// Compares this program so often with itself, which has to pass, and with itself made 10 % slower, which has to fail
    #[arg(
        long,
        value_name = "TRIALS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "20",
        value_parser = value_parser!(u32).range(1..=1000),
        conflicts_with_all = ["against", "update", "baseline", "json", "bencher", "history", "instructions"]
    )]
    self_test: Option<u32>,
    /// Longest time in which a program that is compared has to answer (s)
    #[arg(long, value_name = "S", default_value = "60", value_parser = seconds, allow_negative_numbers = true)]
    pub(super) limit: Duration,
    /// Adds the figures to a file as well, a line for each run; `taut report FILE.jsonl` is their page
    #[arg(long, value_name = "FILE.jsonl")]
    history: Option<PathBuf>,
    /// Answers on standard output how long steps take: what `--against` and `--self-test` start
    #[arg(long, hide = true)]
    measure: bool,
    /// Spins after each of these steps for this part of its time
    #[arg(long, hide = true, requires = "measure", default_value_t = 0.0)]
    slowed: f64,
    /// Steps a case and prints nothing: what runs under valgrind
    #[arg(long, hide = true, value_name = "CASE", value_parser = track::named)]
    instructions_of: Option<Case>,
    /// How many steps of it
    #[arg(long, hide = true, value_name = "K", default_value_t = track::PASS)]
    steps: usize,
}

/// Time that the passes of each case are timed for.
const BUDGET: Duration = Duration::from_millis(400);
const QUICK_BUDGET: Duration = Duration::from_millis(50);

/// Measures, prints the comparison.
pub(crate) fn run(args: &TrackArgs, console: Console) -> Result<(), Failure> {
    if let Some(case) = &args.instructions_of {
        return track::steps(case, args.steps).map_err(Failure::Input);
    }
    if args.measure {
        return against::serve(args.slowed);
    }
    if let Some(trials) = args.self_test {
        return against::self_test(args, trials as usize, &cases(args, true), console);
    }
    if let Some(base) = &args.against {
        return against::run(args, base, &cases(args, args.quick), console);
    }
    let mut outputs = Outputs::open(args)?;
    let baseline = baseline(args)?;
    let config = Config {
        cases: cases(args, args.quick),
        counter: counter(args)?,
        budget: if args.quick { QUICK_BUDGET } else { BUDGET },
    };
    // Every start and reference needs this backend; another one would take hours over the largest
    // scenes.
    Choice::schur(Backend::Banded).check()?;
    let bar = console.progress(0);
    let figures = track::run(&config, &bar);
    bar.finish_and_clear();
    let rows = track::compare(&figures, &baseline);
    let update = outputs.update.take();
    let entries = track::entries(&figures);
    outputs.write(
        &format!("{}\n\n{}", track::LEGEND, track::text(&rows)),
        entries.clone(),
        &track::bencher(&figures),
    )?;
    let failed = |rows: &[Row]| {
        rows.iter()
            .filter(|r| r.verdict == Comparison::Fail)
            .count()
    };
    if let Some(to) = update {
        let updated = track::updated(&entries, &baseline);
        // A figure that fails against itself exceeds a bar or was not measured.
        let stays = failed(&track::compare(&figures, &updated));
        if stays > 0 {
            return Err(Failure::Check(format!(
                "{stays} figures are beyond their bar or could not be measured: the baseline was not written"
            )));
        }
        return Ok(to.json(&updated)?);
    }
    match (failed(&rows), track::uncompared(&rows)) {
        (0, 0) => Ok(()),
        (0, n) if args.instructions => Err(Failure::NotChecked(format!(
            "{n} counts of instructions are compared with nothing: the notes say why"
        ))),
        (0, _) => Ok(()),
        (n, _) => Err(Failure::Check(format!(
            "{n} of {} figures fail",
            rows.len()
        ))),
    }
}

/// The counter of instructions, where they are asked for.
pub(super) fn counter(args: &TrackArgs) -> Result<Option<Counter>, Failure> {
    let counter = args.instructions.then(Counter::new).transpose();
    counter.map_err(|missing| Failure::Input(missing.reason()))
}

/// The cases named, each once; or else those of a quick run, or all.
fn cases(args: &TrackArgs, quick: bool) -> Vec<Case> {
    let chosen = |c: &Case| match args.cases.as_slice() {
        [] => c.quick || !quick,
        named => named.contains(c),
    };
    CASES.into_iter().filter(chosen).collect()
}

/// Where figures go.
pub(super) struct Outputs {
    json: Option<Output>,
    bencher: Option<Output>,
    update: Option<Output>,
    history: Option<(Output, PathBuf)>,
}

impl Outputs {
    /// Finds out whether all can be written, before anything is measured.
    pub(super) fn open(args: &TrackArgs) -> Result<Self, Failure> {
        let compares = !args.update && args.against.is_none();
        let read: Vec<&Path> = compares.then_some(&*args.baseline).into_iter().collect();
        let [json, bencher, update, history] = files::open(
            [
                ("--json", args.json.as_deref()),
                ("--bencher", args.bencher.as_deref()),
                ("--update", args.update.then_some(&*args.baseline)),
                ("--history", args.history.as_deref()),
            ],
            &read,
        )?;
        if history.as_ref().is_some_and(Output::is_stdout) {
            let why = "`--history` adds to a file, and standard output is none: name one";
            return Err(Failure::Input(why.to_owned()));
        }
        let runs = args.history.as_deref().map(track::read).transpose();
        runs.map_err(Failure::Input)?;
        Ok(Self {
            json,
            bencher,
            update,
            history: history.zip(args.history.clone()),
        })
    }

    /// Prints the table below the machine, unless a file takes its place; writes the figures.
    pub(super) fn write(
        self,
        table: &str,
        figures: Vec<Entry>,
        metrics: &impl Serialize,
    ) -> Result<(), Failure> {
        let files = [&self.json, &self.bencher];
        if !files.into_iter().flatten().any(Output::is_stdout) {
            files::print(&format!("{}\n{table}", Machine::current()))?;
        }
        if let Some(json) = self.json {
            json.json(&figures)?;
        }
        if let Some(bencher) = self.bencher {
            bencher.json(metrics)?;
        }
        if let Some((history, path)) = self.history {
            // Others may have added to it meanwhile.
            let runs = track::read(&path).map_err(Failure::Input)?;
            track::append(&history, &runs, &Run::new(figures))?;
        }
        Ok(())
    }
}

/// A time of a millisecond to a day.
fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = number(text)?;
    if (1e-3..=86_400.0).contains(&seconds) {
        return Ok(Duration::from_secs_f64(seconds));
    }
    Err("a time from 0.001 to 86400 s is needed".to_owned())
}

/// The baseline; an update may make the first one.
fn baseline(args: &TrackArgs) -> Result<Vec<Entry>, Failure> {
    let path = &args.baseline;
    if args.update && !path.exists() {
        return Ok(Vec::new());
    }
    let text = files::read_text(path).map_err(|e| {
        Failure::Input(format!(
            "{e}; run this at the repository's root, or say where the baseline is with `--baseline`"
        ))
    })?;
    serde_json::from_str(&text).map_err(|e| {
        Failure::Input(format!(
            "`{}` is no baseline: {e}; `--update` writes one where there is none",
            path.display()
        ))
    })
}
