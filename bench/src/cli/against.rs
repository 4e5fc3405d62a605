//! `taut track --against` and `--self-test`: this program in turns with another one, or with itself.

use super::Failure;
use super::console::Console;
use super::track::{Outputs, TrackArgs, counter};
use crate::machine::Machine;
use crate::track::{self, Case, Comparison, Effort, Measure, Program, Row, Versus};
use std::io;
use taut_measure::files;

/// Serves `--measure`: answers on the program's streams, whatever else they are connected to.
pub(crate) fn serve(slowed: f64) -> Result<(), Failure> {
    Ok(track::serve(slowed, io::stdin().lock(), io::stdout())?)
}

/// Compares with what `name` is, prints the comparison.
pub(crate) fn run(
    args: &TrackArgs,
    name: &str,
    cases: &[Case],
    console: Console,
) -> Result<(), Failure> {
    let outputs = Outputs::open(args)?;
    let counter = counter(args)?;
    let bar = console.progress(0);
    let base = track::base(name, |doing| bar.set_message(doing.to_owned()));
    let base = base.map_err(Failure::Input)?;
    let versus = Versus {
        counter,
        ..versus(args, base)?
    };
    bar.set_message("in turns");
    let compared = track::against(&versus, cases, &bar);
    bar.finish_and_clear();
    let compared = compared.map_err(Failure::Input)?;
    let base = &versus.base;
    let table = format!(
        "{}\n\nbase {} ({}), head {}\n{}",
        track::AGAINST_LEGEND,
        base.name,
        base.path.display(),
        versus.head.name,
        track::against_text(&compared)
    );
    let (entries, metrics) = track::ratios(&compared, &base.name);
    outputs.write(&table, entries, &metrics)?;
    verdict(&compared)
}

fn versus(args: &TrackArgs, base: Program) -> Result<Versus, Failure> {
    Ok(Versus {
        base,
        head: Program::this(0.0)?,
        effort: if args.quick {
            Effort::QUICK
        } else {
            Effort::FULL
        },
        limit: args.limit,
        counter: None,
        every_case: args.cases.is_empty(),
    })
}

fn verdict(compared: &[Row]) -> Result<(), Failure> {
    let count = |verdict| compared.iter().filter(|c| c.verdict == verdict).count();
    let uncounted = |c: &&Row| c.measure == Measure::Instructions.name() && c.ratio.is_none();
    let uncounted = compared.iter().filter(uncounted).count();
    match (count(Comparison::Fail), count(Comparison::NotMeasured)) {
        (0, n) if n == compared.len() => Err(Failure::NotChecked(
            "nothing was compared: the notes say why".to_owned(),
        )),
        (0, _) if uncounted > 0 => Err(Failure::NotChecked(format!(
            "the instructions of {uncounted} cases are compared with nothing: the notes say why"
        ))),
        (0, _) => Ok(()),
        (n, _) => Err(Failure::Check(format!(
            "{n} of {} figures fail against the base",
            compared.len()
        ))),
    }
}

/// Compares this program with itself, as it is and slowed, and says how often that came out.
pub(crate) fn self_test(
    args: &TrackArgs,
    trials: usize,
    cases: &[Case],
    console: Console,
) -> Result<(), Failure> {
    let versus = versus(args, Program::this(0.0)?)?;
    let bar = console.progress(0);
    let test = track::self_test(&versus, cases, trials, &bar);
    bar.finish_and_clear();
    let test = test.map_err(Failure::Input)?;
    files::print(&format!(
        "{}\n{}",
        Machine::current(),
        track::self_test_text(&test)
    ))?;
    match test.figures {
        0 => Err(Failure::NotChecked(
            "nothing was measured: this build has the backend of no case".to_owned(),
        )),
        _ if test.is_passed() => Ok(()),
        _ => Err(Failure::Check(
            "the self-test fails: `--against` cannot be trusted on this machine".to_owned(),
        )),
    }
}
