//! `taut bench --scene NAME,…`: every solver on cables with branches and loops.

use super::deliver::{Found, Way};
use super::sweeps::sorted;
use crate::{BenchArgs, Failure, choices, take_ratios};
use taut_bench::machine::Machine;
use taut_bench::report::settings;
use taut_bench::scenes::{self, Config};
use taut_bench::table::MARK;
use taut_model::Network;

/// The network of that name.
pub(crate) fn network(name: &str) -> Result<Network, String> {
    let names = || Network::ALL.map(Network::name).join(", ");
    Network::named(name).ok_or_else(|| format!("choose one of {}", names()))
}

/// Runs the benchmark on the scenes named.
pub(crate) fn run(args: &BenchArgs, way: Way<'_>) -> Result<(), Failure> {
    let unread = [
        ("--sweep", args.sweep.is_some()),
        ("--dt", !args.dt.is_empty()),
        ("--set", !args.overrides.is_empty()),
        ("--time", args.time.is_some()),
    ];
    if let Some((option, _)) = unread.into_iter().find(|(_, given)| *given) {
        return Err(Failure::Input(format!(
            "`{option}` has no effect beside `--scene`, which reads --segments, --ratios, --backends, --iterations, \
             --quick, --json"
        )));
    }
    let config = args.quick.then(Config::quick).unwrap_or_default();
    let mut networks = Vec::new();
    for network in &args.scenes {
        if !networks.contains(network) {
            networks.push(*network);
        }
    }
    let mut config = config.with(&networks, &sorted(&args.segments, Vec::new()));
    take_ratios(&args.ratios, &mut config.ratios)?;
    config.iterations = sorted(&args.iterations, config.iterations);
    if config.iterations.first() == Some(&0) {
        return Err(Failure::Input(
            "`--iterations` holds 0: each limit must be at least 1".to_owned(),
        ));
    }
    config.choices = choices(&args.backends)?;
    let bar = way.console.progress(0);
    let results = scenes::run(&config, &bar)?;
    bar.finish_and_clear();
    let text = format!(
        "{}\ncables of 10 m, segments of 1 kg, Δt = 1/{:.0} s; {}\n{}\n{MARK}\n{}",
        Machine::current(),
        1.0 / config.dt,
        scenes::bar(),
        scenes::LEGEND,
        scenes::text_tables(&results)
    );
    Found {
        name: "scenes",
        settings: settings::scenes(&config),
        text,
        rows: &results,
        omissions: &results.omissions,
    }
    .deliver(way)
}
