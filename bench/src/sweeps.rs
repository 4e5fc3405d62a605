//! `taut bench --sweep NAME`: measurements beside the main job, each over its own range of mass ratios.

use crate::{BenchArgs, Failure, choices, deliver, progress, take_ratios};
use clap::ValueEnum;
use taut_bench::linear;
use taut_bench::machine::Machine;
use taut_bench::table;

/// The sweeps that there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Sweep {
    /// Forward errors of the multipliers with 0, 1 and 2 refinements, mass ratios 1 to 10¹²
    Linear,
}

impl Sweep {
    /// Its name on the command line, and of its file.
    fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
        }
    }
}

/// Runs a sweep.
pub(crate) fn run(sweep: Sweep, args: &BenchArgs) -> Result<(), Failure> {
    refuse_without_effect(sweep, args)?;
    match sweep {
        Sweep::Linear => linear(args),
    }
}

/// Fails where an option is given that the sweep does not read.
fn refuse_without_effect(sweep: Sweep, args: &BenchArgs) -> Result<(), Failure> {
    let unread = match sweep {
        Sweep::Linear => [
            (
                "--iterations",
                !args.iterations.is_empty(),
                "give a solver its own, such as cg:iterations=50",
            ),
            (
                "--set",
                !args.overrides.is_empty(),
                "its cables are its own",
            ),
            ("--time", args.time.is_some(), "it solves single states"),
        ],
    };
    match unread.into_iter().find(|(_, given, _)| *given) {
        None => Ok(()),
        Some((option, _, instead)) => Err(Failure::Input(format!(
            "`{option}` has no effect on `--sweep {}`: {instead}",
            sweep.name()
        ))),
    }
}

/// What the columns of the sweep's tables are.
const LINEAR_LEGEND: &str = "\
Each cell: relative errors of the multipliers against extended precision, ∞-norm, with 0, 1, 2 refinements. Iterative
solvers start from zero, and each of their solves has at most 1000 iterations, unless they name their own, to 1e-12";

fn linear(args: &BenchArgs) -> Result<(), Failure> {
    let mut config = if args.quick {
        linear::Config::quick()
    } else {
        linear::Config::default()
    };
    if !args.segments.is_empty() {
        config.segments.clone_from(&args.segments);
        config.segments.sort_unstable();
        config.segments.dedup();
    }
    take_ratios(&args.ratios, &mut config.ratios)?;
    if !args.backends.is_empty() {
        config.choices.clear();
        for (choice, name) in choices(&args.backends)?.into_iter().zip(&args.backends) {
            let choice = if name.contains("iterations=") {
                choice
            } else {
                linear::patient(&choice)
            };
            if !config.choices.contains(&choice) {
                config.choices.push(choice);
            }
        }
    }
    let bar = progress(0).with_message(Sweep::Linear.name());
    let records = linear::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\nhoist: strain of at most {} (steel, made stiffer with the load), Δt = 1/{:.0} s, {}\n{LINEAR_LEGEND}\n{}",
        Machine::current(),
        config.max_strain,
        1.0 / config.step.dt,
        config.step.scheme,
        table::linear(&records, &config.omissions())
    );
    deliver(args.json.as_deref(), Sweep::Linear.name(), &text, &records)
}
