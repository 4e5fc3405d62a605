use indicatif::ProgressBar;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use taut_tests::fuzzing;
use taut_tests::products::invariants::{Outcome, Violation, judge, order};
use taut_tests::products::{Choices, scene, shrink};

/// Scenes of a test, unless the variable `TAUT_PRODUCTS` says otherwise.
const SCENES: u64 = 200;

/// Refusals that a part of so much of the scenes may have: those of ropes and masses that the model's documentation excludes.
const REFUSED: f64 = 0.1;

fn variable(name: &str, default: u64) -> u64 {
    let text = std::env::var(name).ok();
    text.map_or(default, |text| {
        text.parse()
            .unwrap_or_else(|e| panic!("{name}={text}: {e}: give a whole number"))
    })
}

/// Outcomes of all scenes.
#[derive(Default)]
struct Tally {
    refused: BTreeMap<u64, String>,
    violated: BTreeMap<u64, Violation>,
    orders: Vec<f64>,
}

fn count(seed: u64, tally: &Mutex<Tally>) {
    let outcome = judge(&Choices::of_seed(seed));
    let order = match &outcome {
        Outcome::Sound(case) => order(case),
        _ => None,
    };
    let mut tally = tally.lock().expect("no judge panics");
    tally.orders.extend(order);
    match outcome {
        Outcome::Sound(_) => {}
        Outcome::Refused(text) => drop(tally.refused.insert(seed, text)),
        Outcome::Violated(violation) => drop(tally.violated.insert(seed, violation)),
    }
}

/// The first scene of each violated invariant, as small as it gets.
fn list(violated: &BTreeMap<u64, Violation>) -> String {
    let mut kinds: BTreeMap<&str, Vec<(u64, &Violation)>> = BTreeMap::new();
    for (seed, violation) in violated {
        let kind = kinds.entry(violation.invariant).or_default();
        kind.push((*seed, violation));
    }
    let mut text = String::new();
    for (invariant, found) in kinds {
        let (seed, violation) = found[0];
        let (choices, small) = shrink::smallest(&Choices::of_seed(seed), violation);
        let scene = scene::toml(&choices).unwrap_or_else(|e| e.to_string());
        text += &format!("\n# {invariant}: violated by\n");
        for (seed, violation) in &found {
            text += &format!(
                "# seed {seed}, step {}: {}\n",
                violation.step, violation.numbers
            );
        }
        text += &format!(
            "# smallest of seed {seed}, step {}: {}\n{scene}",
            small.step, small.numbers
        );
    }
    text
}

/// 200 scenes, or as many as `TAUT_PRODUCTS` says, from the seed `TAUT_PRODUCTS_SEED` on: see [`taut_tests::products`].
#[test]
fn products_of_features_keep_all_invariants() {
    let scenes = variable("TAUT_PRODUCTS", SCENES);
    let first = variable("TAUT_PRODUCTS_SEED", 0);
    let tally = Mutex::new(Tally::default());
    // Nothing is shown where standard error is no terminal.
    let bar = ProgressBar::new(scenes);
    let next = AtomicU64::new(first);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let seed = next.fetch_add(1, Ordering::Relaxed)
                    && seed < first + scenes
                {
                    count(seed, &tally);
                    bar.inc(1);
                }
            });
        }
    });
    bar.finish_and_clear();
    let mut tally = tally.into_inner().expect("no judge panics");
    println!("{scenes} scenes, {} refused", tally.refused.len());
    for (seed, text) in &tally.refused {
        println!("seed {seed}: {text}");
    }
    let violated = tally.violated.len();
    assert!(
        violated == 0,
        "{violated} of {scenes} scenes violate an invariant\n{}",
        list(&tally.violated)
    );
    let refused = tally.refused.len() as f64;
    assert!(refused <= REFUSED * scenes as f64, "{refused} are refused");
    // Few scenes are smooth: each is held to order 1 by itself.
    tally.orders.sort_by(f64::total_cmp);
    let median = tally.orders.get(tally.orders.len() / 2);
    println!("median order {median:?} of {}", tally.orders.len());
    let few = tally.orders.len() < 10;
    assert!(few || median.is_some_and(|order| *order > 1.5));
}

/// Seeds of the fuzzer, and scenes that it found.
#[test]
fn the_fuzzers_products_keep_all_invariants() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds/products");
    let entries =
        std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for entry in entries.flatten() {
        println!("{}", entry.path().display());
        let data = std::fs::read(entry.path()).expect("reads");
        assert!(fuzzing::products(&data), "a scene that is refused");
    }
}
