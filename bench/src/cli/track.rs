//! `taut track`: per-step figures against the baseline.

use super::console::Console;
use crate::Failure;
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Duration;
use taut_bench::machine::Machine;
use taut_bench::track::{self, CASES, Case, Config, Counter, Entry, Row, Verdict};
use taut_bench::{Choice, output};
use taut_solver::Backend;

/// Where the baseline is, from the repository's root.
const BASELINE: &str = "bench/track-baseline.json";

/// What `--help` says below the options.
pub(crate) const AFTER_HELP: &str = "\
Instructions are counted in a second build of this program. The script `.ci/track` makes it and passes on its arguments:
`.ci/track --update` rewrites the baseline. A commit that changes the baseline says why.
Examples:
  taut track --quick
  RUSTFLAGS=\"-C target-cpu=x86-64-v3\" cargo build --release --locked --target-dir target/x86-64-v3
  taut track --icount-binary target/x86-64-v3/release/taut";

#[derive(Debug, Args)]
pub(crate) struct TrackArgs {
    /// Cases by name, such as hoist-24-1e3/banded (default: all)
    #[arg(value_name = "CASE", value_parser = track::named)]
    cases: Vec<Case>,
    /// A few cases, some seconds
    #[arg(long)]
    quick: bool,
    /// This program, built for x86-64-v3: instructions are counted in it under valgrind (default: they are not counted)
    #[arg(long, value_name = "PATH")]
    icount_binary: Option<PathBuf>,
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
    /// Prints compiler and target of this program
    #[arg(long, hide = true)]
    toolchain: bool,
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

/// Measures, prints the comparison. Code 1 where a figure fails.
pub(crate) fn run(args: &TrackArgs, console: Console) -> Result<(), Failure> {
    if args.toolchain {
        return Ok(output::print(&format!("{}\n", track::toolchain()))?);
    }
    if let Some(case) = &args.instructions_of {
        return track::steps(case, args.steps).map_err(Failure::Input);
    }
    let to_stdout = |path: &Option<PathBuf>| path.as_deref() == Some(Path::new("-"));
    let (json, bencher) = (to_stdout(&args.json), to_stdout(&args.bencher));
    if json && bencher {
        return Err(Failure::Input(
            "`--json -` and `--bencher -` cannot share standard output: give one of them a file"
                .to_owned(),
        ));
    }
    let baseline = read(args)?;
    let counter = args.icount_binary.as_deref().map(Counter::new);
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
    if !json && !bencher {
        output::print(&format!(
            "{}\n{}\n\n{}",
            Machine::current(),
            track::LEGEND,
            track::text(&rows)
        ))?;
    }
    let entries = track::entries(&figures);
    if let Some(path) = &args.json {
        output::write_json(path, &entries)?;
    }
    if let Some(path) = &args.bencher {
        output::write_json(path, &track::bencher(&figures))?;
    }
    let failed = |rows: &[Row]| rows.iter().filter(|r| r.verdict == Verdict::Fail).count();
    if args.update {
        let updated = track::updated(&entries, &baseline);
        // What fails against itself is beyond a bar or could not be measured.
        let stays = failed(&track::compare(&figures, &updated));
        if stays > 0 {
            return Err(Failure::Check(format!(
                "{stays} figures are beyond their bar or could not be measured: the baseline was not written"
            )));
        }
        return Ok(output::write_json(&args.baseline, &updated)?);
    }
    match failed(&rows) {
        0 => Ok(()),
        n => Err(Failure::Check(format!(
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
fn read(args: &TrackArgs) -> Result<Vec<Entry>, Failure> {
    let path = &args.baseline;
    if args.update && !path.exists() {
        return Ok(Vec::new());
    }
    let text = output::read_text(path).map_err(|e| {
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
