use indicatif::ProgressBar;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use taut_tests::algebra::draw::Drawn;
use taut_tests::algebra::{Verdict, judge};

/// Systems of a test, unless the variable `TAUT_ALGEBRA` says otherwise.
const SYSTEMS: u64 = 500;

/// Part of the estimates of conditions that may be further off than a factor of three.
const OFF: f64 = 0.01;

fn variable(name: &str, default: u64) -> u64 {
    let text = std::env::var(name).ok();
    text.map_or(default, |text| {
        text.parse()
            .unwrap_or_else(|e| panic!("{name}={text}: {e}: give a whole number"))
    })
}

/// The first 20 of each kind of fault.
fn told(verdicts: &BTreeMap<u64, Verdict>) -> String {
    let mut kinds: BTreeMap<&str, Vec<(u64, &str)>> = BTreeMap::new();
    for (seed, verdict) in verdicts {
        for fault in &verdict.faults {
            let kind = kinds.entry(fault.kind).or_default();
            kind.push((*seed, &fault.numbers));
        }
    }
    let mut text = String::new();
    for (kind, found) in kinds {
        text += &format!("\n# {kind}: {}", found.len());
        for (seed, numbers) in found.iter().take(20) {
            let drawn = Drawn::of_seed(*seed);
            let (kind, rank, scaling) = (drawn.kind, drawn.rank, drawn.scaling);
            text += &format!("\nseed {seed}, {kind:?} {rank:?} {scaling:?}: {numbers}");
        }
    }
    text
}

/// 500 systems, or as many as `TAUT_ALGEBRA` says, from the seed `TAUT_ALGEBRA_SEED` on: see [`taut_tests::algebra`].
#[test]
fn nothing_false_is_told_of_any_system() {
    let systems = variable("TAUT_ALGEBRA", SYSTEMS);
    let first = variable("TAUT_ALGEBRA_SEED", 0);
    // Nothing is shown where standard error is no terminal.
    let bar = ProgressBar::new(systems);
    let next = AtomicU64::new(first);
    let verdicts = Mutex::new(BTreeMap::new());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let seed = next.fetch_add(1, Ordering::Relaxed)
                    && seed < first + systems
                {
                    let verdict = judge(seed);
                    verdicts
                        .lock()
                        .expect("no judge panics")
                        .insert(seed, verdict);
                    bar.inc(1);
                }
            });
        }
    });
    bar.finish_and_clear();
    let verdicts = verdicts.into_inner().expect("no judge panics");
    let claims: usize = verdicts.values().map(|v| v.claims).sum();
    let mut ratios: Vec<f64> = verdicts.values().flat_map(|v| v.ratios.clone()).collect();
    ratios.sort_by(f64::total_cmp);
    let off = ratios.iter().filter(|r| **r < 1.0 / 3.0).count();
    println!(
        "{systems} systems, {claims} claims, {} conditions from {:?} on, {off} off by more than 3",
        ratios.len(),
        ratios.first()
    );
    let faults: usize = verdicts.values().map(|v| v.faults.len()).sum();
    assert!(
        faults == 0,
        "{faults} faults in {systems} systems{}",
        told(&verdicts)
    );
    assert!(
        off as f64 <= OFF * ratios.len() as f64,
        "{off} of {} conditions",
        ratios.len()
    );
}
