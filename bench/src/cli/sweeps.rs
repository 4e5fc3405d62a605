//! `taut bench --sweep NAME`: measurements beside the main job, each over its own range of mass ratios.

use super::deliver::{Found, Way};
use crate::{BenchArgs, Failure, choices, positive, steps, take_ratios};
use clap::ValueEnum;
use taut_bench::machine::Machine;
use taut_bench::report::settings;
use taut_bench::table::MARK;
use taut_bench::{accuracy, energy, engines, iterative, kernels, linear, shocks, stability, table};

/// The sweeps that there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Sweep {
    /// Error of whole motions against cost: every scheme, time step, solver and number of refinements
    Accuracy,
    /// Kicks, jerks and drops: what survives them, how well, at what cost
    Shocks,
    /// Largest stable mass ratio of schemes, stiffness, joints, segments and materials
    Stability,
    /// Swing amplitude over a minute, energy over a million steps, angular momentum of a free cable
    Energy,
    /// Forward errors of the multipliers with 0, 1 and 2 refinements, mass ratios 1 to 10¹²
    Linear,
    /// Factorisation and solve, ns per joint: ours beside every other on the same matrices in the same run
    Kernels,
    /// Time and iterations of the iterative solvers to given errors, cold and warm, against the direct solver
    Iterative,
    /// Whole engines: what a frame costs, how wrong the motion is; with the feature `rapier` Rapier's too
    Engines,
}

impl Sweep {
    /// Its name on the command line, and of its file.
    fn name(self) -> &'static str {
        match self {
            Self::Accuracy => "accuracy",
            Self::Shocks => "shocks",
            Self::Stability => "stability",
            Self::Energy => "energy",
            Self::Linear => "linear",
            Self::Kernels => "kernels",
            Self::Iterative => "iterative",
            Self::Engines => "engines",
        }
    }

    /// The options of the main job that it reads as well, besides `--quick` and `--json`.
    fn reads(self) -> &'static [&'static str] {
        match self {
            Self::Accuracy => &[
                "--segments",
                "--ratios",
                "--backends",
                "--iterations",
                "--dt",
                "--time",
            ],
            Self::Shocks => &["--ratios", "--time"],
            Self::Stability | Self::Energy => &[],
            Self::Linear | Self::Kernels => &["--segments", "--ratios", "--backends"],
            Self::Iterative => &["--segments", "--ratios", "--backends", "--iterations"],
            Self::Engines => &["--segments", "--ratios", "--time"],
        }
    }
}

/// Runs a sweep.
pub(crate) fn run(sweep: Sweep, args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    refuse_without_effect(sweep, args)?;
    match sweep {
        Sweep::Accuracy => accuracy(args, way),
        Sweep::Shocks => shocks(args, way),
        Sweep::Stability => stability(args, way),
        Sweep::Energy => energy(args, way),
        Sweep::Linear => linear(args, way),
        Sweep::Kernels => kernels(args, way),
        Sweep::Iterative => iterative(args, way),
        Sweep::Engines => engines(args, way),
    }
}

/// Fails where an option is given that the sweep does not read.
fn refuse_without_effect(sweep: Sweep, args: &BenchArgs) -> Result<(), Failure> {
    let given = [
        ("--segments", !args.segments.is_empty()),
        ("--ratios", !args.ratios.is_empty()),
        ("--backends", !args.backends.is_empty()),
        ("--iterations", !args.iterations.is_empty()),
        ("--dt", !args.dt.is_empty()),
        ("--set", !args.overrides.is_empty()),
        ("--time", args.time.is_some()),
    ];
    let unread = given
        .into_iter()
        .find(|(option, given)| *given && !sweep.reads().contains(option));
    match unread {
        None => Ok(()),
        Some((option, _)) => Err(Failure::Input(format!(
            "`{option}` has no effect on `--sweep {}`, which reads {}",
            sweep.name(),
            [sweep.reads(), &["--quick", "--json"]].concat().join(", ")
        ))),
    }
}

/// The numbers given, in order and once each; those of `default` where none is given.
pub(crate) fn sorted(given: &[usize], default: Vec<usize>) -> Vec<usize> {
    let mut numbers = if given.is_empty() {
        default
    } else {
        given.to_vec()
    };
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

fn accuracy(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let mut config = args.quick.then(accuracy::Config::quick).unwrap_or_default();
    let mut ratios: Vec<f64> = config.cases.iter().map(|c| c.mass_ratio).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.dedup();
    take_ratios(&args.ratios, &mut ratios)?;
    if !args.ratios.is_empty() {
        config.choice_ratios.clone_from(&ratios);
    }
    let segments = config.cases.iter().map(|c| c.segments).collect();
    config.cases = accuracy::cases(&sorted(&args.segments, segments), &ratios);
    if !args.backends.is_empty() {
        config.choices = choices(&args.backends)?;
    }
    config.iterations = sorted(&args.iterations, config.iterations);
    if config.iterations.first() == Some(&0) {
        return Err(Failure::Input(
            "`--iterations` holds 0: each limit must be at least 1".to_owned(),
        ));
    }
    if !args.dt.is_empty() {
        positive("a number of `--dt`", &args.dt)?;
        config.rates = args.dt.iter().map(|dt| 1.0 / dt).collect();
        config.rates.sort_by(f64::total_cmp);
        config.rates.dedup();
        let first = config.rates[0];
        let whole = |rate: &f64| ((rate / first).round() - rate / first).abs() < 1e-9;
        if !config.rates.iter().all(whole) {
            return Err(Failure::Input(
                "`--dt`: the largest must be a whole multiple of each of the others, so that they meet".to_owned(),
            ));
        }
    }
    config.time = args.time.unwrap_or(config.time);
    if steps(config.time, 1.0 / config.rates[0])? == 0 {
        return Err(Failure::Input(format!(
            "`--time` is {} s: it must be at least one step",
            config.time
        )));
    }
    let bar = way.console.progress(0).with_message(Sweep::Accuracy.name());
    let results = accuracy::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\n{} s of the hoist, 10 m, segments of 1 kg, YA = 2·10⁷ N{}",
        Machine::current(),
        config.time,
        accuracy::tables(&results)
    );
    Found {
        name: Sweep::Accuracy.name(),
        settings: settings::accuracy(&config),
        text,
        rows: &results,
        omissions: &[],
    }
    .deliver(way)
}

fn shocks(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let mut config = args.quick.then(shocks::Config::quick).unwrap_or_default();
    take_ratios(&args.ratios, &mut config.ratios)?;
    config.time = args.time.unwrap_or(config.time);
    if steps(config.time, 1.0 / 60.0)? < 60 {
        return Err(Failure::Input(format!(
            "`--time` is {} s: the shocks need at least 1 s",
            config.time
        )));
    }
    let bar = way.console.progress(0).with_message(Sweep::Shocks.name());
    let results = shocks::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!("{}\n{}", Machine::current(), shocks::table(&results));
    Found {
        name: Sweep::Shocks.name(),
        settings: settings::shocks(&config),
        text,
        rows: &results,
        omissions: &[],
    }
    .deliver(way)
}

fn stability(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let config = args
        .quick
        .then(stability::Config::quick)
        .unwrap_or_default();
    let bar = way
        .console
        .progress(0)
        .with_message(Sweep::Stability.name());
    let records = stability::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\n{}",
        Machine::current(),
        stability::text_tables(&records, &config)
    );
    Found {
        name: Sweep::Stability.name(),
        settings: settings::stability(&config),
        text,
        rows: &records,
        omissions: &[],
    }
    .deliver(way)
}

fn energy(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let config = args.quick.then(energy::Config::quick).unwrap_or_default();
    let bar = way.console.progress(0).with_message(Sweep::Energy.name());
    let results = energy::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\n{}",
        Machine::current(),
        energy::text_tables(&results, &config)
    );
    Found {
        name: Sweep::Energy.name(),
        settings: settings::energy(&config),
        text,
        rows: &results,
        omissions: &[],
    }
    .deliver(way)
}

fn engines(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let mut config = args.quick.then(engines::Config::quick).unwrap_or_default();
    config.segments = sorted(&args.segments, config.segments);
    take_ratios(&args.ratios, &mut config.ratios)?;
    config.time = args.time.unwrap_or(config.time);
    if steps(config.time, engines::motion::FRAME)? == 0 {
        return Err(Failure::Input(format!(
            "`--time` is {} s: it must be at least one frame of 1/60 s",
            config.time
        )));
    }
    let bar = way.console.progress(0);
    let records = engines::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\n{}",
        Machine::current(),
        engines::tables(&records, &config)
    );
    Found {
        name: Sweep::Engines.name(),
        settings: settings::engines(&config),
        text,
        rows: &records,
        omissions: &[],
    }
    .deliver(way)
}

/// What the columns of the sweep's tables are.
const LINEAR_LEGEND: &str = "\
Each cell: relative errors of the multipliers against extended precision, ∞-norm, with 0, 1, 2 refinements, compared by
the last. Iterative solvers start from zero, and each of their solves has at most 1000 iterations, unless they name
their own, to 1e-12";

fn linear(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let mut config = args.quick.then(linear::Config::quick).unwrap_or_default();
    config.segments = sorted(&args.segments, config.segments);
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
    let bar = way.console.progress(0).with_message(Sweep::Linear.name());
    let records = linear::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\nhoist: strain of at most {} (steel, made stiffer with the load), Δt = 1/{:.0} s, {}\n\
         {LINEAR_LEGEND}\n{MARK}\n{}",
        Machine::current(),
        config.max_strain,
        1.0 / config.step.dt,
        config.step.scheme,
        table::linear(&records, &config.omissions())
    );
    Found {
        name: Sweep::Linear.name(),
        settings: settings::linear(&config),
        text,
        rows: &records,
        omissions: &config.omissions(),
    }
    .deliver(way)
}

/// What the columns of the sweep's tables are.
const KERNELS_LEGEND: &str = "\
ns/joint: factorisation and solve of the assembled system, least of the samples; median ns: of the samples; × banded:
over banded's of the same table; normwise, compon.: backward errors on the system solved, the latter of its worst row;
error: relative error of the multipliers against the KKT system in extended precision. All take turns on the same
matrices. +refine: with one refinement from the pieces, by the step's clock; umfpack: with its own refinement, its
default; batch: 8 cables side by side, without the copies that bring them there; lapack: dpbtrf and dpbtrs, without the
filling of the band";

fn kernels(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let mut config = args.quick.then(kernels::Config::quick).unwrap_or_default();
    config.segments = sorted(&args.segments, config.segments);
    take_ratios(&args.ratios, &mut config.ratios)?;
    if !args.backends.is_empty() {
        config.rivals.clear();
        for name in &args.backends {
            let rival: kernels::Rival = name.parse().map_err(Failure::Input)?;
            rival.check()?;
            if !config.rivals.contains(&rival) {
                config.rivals.push(rival);
            }
        }
    }
    let bar = way.console.progress(0).with_message(Sweep::Kernels.name());
    let results = kernels::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\nhoist: hanging at an angle, Δt = 1/60 s, one thread\n{KERNELS_LEGEND}\n{MARK}\n{}",
        Machine::current(),
        table::kernels(&results)
    );
    Found {
        name: Sweep::Kernels.name(),
        settings: settings::kernels(&config),
        text,
        rows: &results,
        omissions: &results.omissions,
    }
    .deliver(way)
}

/// What the cells of the sweep's tables are.
const ITERATIVE_LEGEND: &str = "\
Each cell: fewest iterations that reach the error of the multipliers against extended precision (∞-norm): µs from the
pieces to the multipliers (assembly, factorisation, solve), × the direct solver's time over it: above 1 it wins. First
row: the direct solver, r0 without, r1 with one refinement. cold: from zero; warm: from the step before; no: not
reached; guess: the step before is as near as that";

fn iterative(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let mut config = args
        .quick
        .then(iterative::Config::quick)
        .unwrap_or_default();
    if !args.segments.is_empty() || !args.ratios.is_empty() {
        // Both are the hoist's.
        config.networks.clear();
    }
    config.segments = sorted(&args.segments, config.segments);
    take_ratios(&args.ratios, &mut config.ratios)?;
    if !args.backends.is_empty() {
        config.choices.clear();
        for choice in choices(&args.backends)? {
            if !config.choices.contains(&choice) {
                config.choices.push(choice);
            }
        }
    }
    if let Some(direct) = config.choices.iter().find(|c| !c.backend.is_iterative()) {
        return Err(Failure::Input(format!(
            "`--backends {direct}`: `--sweep iterative` takes iterative solvers, gauss-seidel and cg"
        )));
    }
    if let Some(name) = args.backends.iter().find(|b| b.contains('=')) {
        return Err(Failure::Input(format!(
            "`{name}`: iterations are what the sweep looks for, without a tolerance; use `--iterations`"
        )));
    }
    config.limit = match args.iterations[..] {
        [] => config.limit,
        [limit] if limit > 0 => limit,
        _ => {
            return Err(Failure::Input(
                "`--iterations`: `--sweep iterative` takes one limit, at least 1".to_owned(),
            ));
        }
    };
    let bar = way
        .console
        .progress(0)
        .with_message(Sweep::Iterative.name());
    let results = iterative::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\nhoist at {} rad and networks, state after {} steps of 1/{:.0} s, up to {} iterations\n\
         {ITERATIVE_LEGEND}\n{MARK}\n{}",
        Machine::current(),
        iterative::ANGLE,
        iterative::WARM_UP,
        1.0 / config.dt,
        config.limit,
        table::iterative(&results, config.limit)
    );
    Found {
        name: Sweep::Iterative.name(),
        settings: settings::iterative(&config),
        text,
        rows: &results.records,
        omissions: &results.omissions,
    }
    .deliver(way)
}
