//! `taut track`: per-step figures against the baseline.

use super::Failure;
use super::console::Console;
use crate::machine::Machine;
use crate::track::{self, CASES, Case, Config, Counter, Entry, Row, Verdict};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Duration;
use taut_ground::Choice;
use taut_ground::files::{self, Output};
use taut_solver::Backend;

/// Where the baseline is, from the repository's root.
const BASELINE: &str = "bench/track-baseline.json";

/// What `--help` says below the options.
pub(crate) const AFTER_HELP: &str = "\
Exit code 1: a figure fails. Exit code 3: none fails, but instructions that were to be counted are compared with nothing.
A commit that changes the baseline says why.
Examples:
  taut track --quick
  taut track --instructions
  taut track --instructions --update";

#[derive(Debug, Args)]
pub(crate) struct TrackArgs {
    /// Cases by name, such as hoist-24-1e3/banded (default: all)
    #[arg(value_name = "CASE", value_parser = track::named)]
    cases: Vec<Case>,
    /// A few cases, some seconds
    #[arg(long)]
    quick: bool,
    /// Counts instructions as well, under valgrind
    #[arg(long)]
    instructions: bool,
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
    /// Steps a case and prints nothing: what runs under valgrind
    #[arg(long, hide = true, value_name = "CASE", value_parser = track::named)]
    instructions_of: Option<Case>,
    /// How many steps of it
    #[arg(long, hide = true, value_name = "K", default_value_t = track::PASS)]
    steps: usize,
}

/// Time that each case is timed for, with one thread and with two.
const BUDGET: Duration = Duration::from_millis(400);
const QUICK_BUDGET: Duration = Duration::from_millis(50);

/// Measures, prints the comparison.
pub(crate) fn run(args: &TrackArgs, console: Console) -> Result<(), Failure> {
    if let Some(case) = &args.instructions_of {
        return track::steps(case, args.steps).map_err(Failure::Input);
    }
    let read: Vec<&Path> = (!args.update)
        .then_some(&*args.baseline)
        .into_iter()
        .collect();
    let [json, bencher, update] = files::open(
        [
            ("--json", args.json.as_deref()),
            ("--bencher", args.bencher.as_deref()),
            ("--update", args.update.then_some(&*args.baseline)),
        ],
        &read,
    )?;
    let baseline = baseline(args)?;
    let counter = args.instructions.then(Counter::new);
    let config = Config {
        cases: cases(args),
        counter: counter.transpose()?,
        budget: if args.quick { QUICK_BUDGET } else { BUDGET },
    };
    // What all are measured from and against; another solver would take hours over the largest scenes.
    Choice::schur(Backend::Banded).check()?;
    let bar = console.progress(0);
    let figures = track::run(&config, &bar);
    bar.finish_and_clear();
    let rows = track::compare(&figures, &baseline);
    let rows_alone = [&json, &bencher]
        .into_iter()
        .flatten()
        .any(Output::is_stdout);
    if !rows_alone {
        files::print(&format!(
            "{}\n{}\n\n{}",
            Machine::current(),
            track::LEGEND,
            track::text(&rows)
        ))?;
    }
    let entries = track::entries(&figures);
    if let Some(json) = json {
        json.json(&entries)?;
    }
    if let Some(bencher) = bencher {
        bencher.json(&track::bencher(&figures))?;
    }
    let failed = |rows: &[Row]| rows.iter().filter(|r| r.verdict == Verdict::Fail).count();
    if let Some(to) = update {
        let updated = track::updated(&entries, &baseline);
        // What fails against itself is beyond a bar or could not be measured.
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

/// The cases named, each once; those of a quick run; or all.
fn cases(args: &TrackArgs) -> Vec<Case> {
    let all = CASES.into_iter();
    let named = |c: &Case| args.cases.is_empty() || args.cases.contains(c);
    all.filter(|c| named(c) && (c.quick || !args.quick))
        .collect()
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
