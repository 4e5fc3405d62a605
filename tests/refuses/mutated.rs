use proptest::prelude::*;
use proptest::test_runner::FileFailurePersistence;
use std::fmt::Debug;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;
use taut_measure::trajectory::{Limits, Simulation};
use taut_model::named::NAMES;
use taut_model::scene_file::SceneText;
use taut_recording::Recorder;
use taut_tests::fuzzing::{self, TARGETS};
use taut_tests::machines::random_machine;
use taut_tests::prelude::*;
use taut_tests::products::{Choices, scene::toml};
use taut_tests::scenes::random_scene;

/// No input takes longer than so many of these slices: small scenes take milliseconds, and this machine may be busy. One that is
/// suspended for a while loses a slice.
const SLICES: usize = 60;
const SLICE: Duration = Duration::from_secs(1);

/// Does something with an input; one that takes too long, and so perhaps for ever, ends the tests and is printed.
fn in_time<R>(input: &(impl Debug + Sync + ?Sized), work: impl FnOnce() -> R) -> R {
    let (done, waiting) = mpsc::channel::<()>();
    thread::scope(|threads| {
        threads.spawn(move || {
            let late = || waiting.recv_timeout(SLICE) == Err(mpsc::RecvTimeoutError::Timeout);
            if (0..SLICES).all(|_| late()) {
                eprintln!("still at it after {SLICES} times {SLICE:?}: {input:?}");
                std::process::abort();
            }
        });
        let result = work();
        // Dropped by a panic as well, which ends the wait.
        drop(done);
        result
    })
}

/// Every run has other inputs; one that fails is kept beside this file, and tried first from then on.
fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: Some(Box::new(FileFailurePersistence::WithSource("regressions"))),
        ..ProptestConfig::default()
    }
}

/// Inputs of a target: good ones to start from, and those that once did harm.
fn seeds(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let folder = folder.join(target);
    let entries = fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    let read = |path: PathBuf| {
        let data = fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        (path, data)
    };
    paths.into_iter().map(read).collect()
}

/// Seeds of the fuzzer, and inputs that it found, pass through the functions that it calls.
#[test]
fn the_fuzzers_seeds_do_no_harm() {
    for (name, target) in TARGETS {
        let seeds = seeds(name);
        let mut far = 0;
        for (path, data) in &seeds {
            println!("{}", path.display());
            far += usize::from(in_time(path, || target(data)));
        }
        let holds = !seeds.is_empty() && far > 0;
        assert!(holds, "{name}: no seed gets anywhere");
    }
}

/// Replacements for a number in a text.
const NUMBERS: &str = "0 -0.0 nan inf -inf 1e308 -1e308 5e-324 1e-160 -1 1e17 9223372036854775807 \
    -9223372036854775808 2 null \"\"";

/// A change of a text: where, what, and with what.
type Change = (prop::sample::Index, u8, prop::sample::Index);

fn changes() -> impl Strategy<Value = Vec<Change>> {
    prop::collection::vec(
        (
            any::<prop::sample::Index>(),
            0..8_u8,
            any::<prop::sample::Index>(),
        ),
        1..5,
    )
}

/// The text with its numbers replaced, lines dropped, doubled or exchanged, bytes changed, its end cut off.
fn mutated(text: &str, changes: &[Change]) -> String {
    let mut text = text.to_owned();
    for (at, kind, with) in changes {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        if lines.is_empty() {
            break;
        }
        let line = at.index(lines.len());
        match kind {
            0..=3 => {
                // A number of the text for another.
                let digits = text.as_bytes();
                let from = at.index(digits.len());
                let is_number = |b: &u8| b.is_ascii_digit() || b"+-.e".contains(b);
                let Some(start) = (from..digits.len()).find(|&i| digits[i].is_ascii_digit()) else {
                    continue;
                };
                let start = (0..=start).rev();
                let start = start.take_while(|&i| is_number(&digits[i])).last();
                let start = start.unwrap_or(from);
                let rest = digits[start..].iter().take_while(|b| is_number(b)).count();
                let numbers: Vec<&str> = NUMBERS.split(' ').collect();
                text.replace_range(start..start + rest, numbers[with.index(numbers.len())]);
                continue;
            }
            4 => {
                lines.remove(line);
            }
            5 => {
                let copy = lines[line].clone();
                lines.insert(with.index(lines.len()), copy);
            }
            6 => {
                let other = with.index(lines.len());
                lines.swap(line, other);
            }
            _ => {
                let end = with.index(text.len() + 1);
                let end = (0..=end).rev().find(|&i| text.is_char_boundary(i));
                text.truncate(end.unwrap_or(0));
                continue;
            }
        }
        text = lines.join("\n");
    }
    text
}

/// Texts of scenes: parameters, and bodies and joints one by one.
fn scene_texts() -> Vec<String> {
    let mut texts = Vec::new();
    for name in NAMES {
        let small = match name {
            "pull" | "twist" | "bend" | "hoist" | "gantry" => ("segments", "4"),
            name if name.starts_with("particles") => ("particles", "4"),
            "net" => ("rows", "3"),
            "capstan" | "tackle" | "elevator" => ("falls", "3"),
            _ => ("segments", "8"),
        };
        let source = SceneSource::load(name, &[small]).expect("a scene");
        texts.push(source.to_toml().expect("a text"));
        let scene = source.build().expect("sound");
        if scene.bodies.len() < 25 {
            let text = SceneText::from_scene(&scene).expect("a text");
            texts.push(
                SceneSource::Explicit(Box::new(text))
                    .to_toml()
                    .expect("a text"),
            );
        }
    }
    texts
}

#[test]
fn scene_files_that_are_mutated_are_refused_or_run() {
    let texts = scene_texts();
    assert!(
        texts
            .iter()
            .all(|text| fuzzing::scene_file(text.as_bytes()))
    );
    proptest!(config(400), |(which in any::<prop::sample::Index>(), changes in changes())| {
        let text = mutated(&texts[which.index(texts.len())], &changes);
        let _ = in_time(&text, || fuzzing::scene_file(text.as_bytes()));
    });
}

/// Bytes of which the first is what it is to be.
fn bytes(first: impl Strategy<Value = u8>, most: usize) -> impl Strategy<Value = Vec<u8>> {
    (first, prop::collection::vec(any::<u8>(), most / 2..most)).prop_map(|(first, mut rest)| {
        rest.insert(0, first);
        rest
    })
}

/// Numbers are awkward never, all of them, or one in some.
fn rarity() -> impl Strategy<Value = u8> {
    prop_oneof![Just(0_u8), Just(1), Just(7), Just(60), any::<u8>()]
}

#[test]
fn scenes_of_any_numbers_are_refused_or_run() {
    proptest!(config(1500), |(data in bytes(rarity(), 400))| {
        let _ = in_time(&data, || fuzzing::scene_builder(&data));
    });
}

/// Scenes with joints, motors and contacts of all kinds.
#[test]
fn scenes_are_read_back_to_the_bit() {
    let mut read = 0;
    for seed in 1..=200 {
        let net = toml(&Choices::of_seed(seed));
        let net = net.and_then(|text| SceneSource::parse(&text, &[])?.build());
        let all = [random_scene(seed), random_machine(seed)].into_iter();
        read += all
            .chain(net)
            .filter(|s| fuzzing::reads_back(s.clone()))
            .count();
    }
    // All but what a text cannot hold.
    assert!(read > 570, "{read}");
}

#[test]
fn systems_of_any_numbers_are_refused_or_solved() {
    proptest!(config(600), |(data in bytes(rarity(), 600))| {
        let _ = in_time(&data, || fuzzing::matrix_and_rhs(&data));
    });
}

const MARKETS: [&str; 4] = [
    "%%MatrixMarket matrix coordinate real symmetric\n% blocks 2 1\n% groups 0 1\n% signs + -\n3 3 5\n1 1 4\n2 1 1\n\
     2 2 3\n3 1 0.5\n3 3 -2\n",
    "%%MatrixMarket matrix coordinate real general\n3 3 5\n1 1 4\n1 2 1.5e0\n2 2 3\n3 1 0.5\n3 3 -2\n",
    "%%MatrixMarket matrix array real general\n3 1\n1\n2\n3\n",
    "%%MatrixMarket matrix array integer symmetric\n2 2\n4\n1\n3\n",
];

#[test]
fn matrix_market_texts_that_are_mutated_are_refused_or_solved() {
    proptest!(config(1500), |(which in 0..MARKETS.len(), changes in changes())| {
        let text = mutated(MARKETS[which], &changes);
        let _ = in_time(&text, || fuzzing::matrix_market(text.as_bytes()));
    });
}

#[test]
fn saved_runs_that_are_mutated_are_refused_or_go_on() {
    let mut texts = Vec::new();
    for (name, set) in [
        ("gantry", ("segments", "2")),
        ("hoist", ("segments", "2")),
        ("particles-f", ("particles", "3")),
    ] {
        let scene = SceneSource::load(name, &[set]).and_then(|s| s.build());
        let scene = scene.expect("sound");
        let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
        stepper.step().expect("a stable run");
        let run = stepper.save().expect("a sound state");
        let yardstick = "{\"cable\": null, \"planar\": false}";
        // One number a line, for the mutations that go by lines.
        let run = serde_json::to_string_pretty(&run).expect("a text");
        let rest = "\"driven\": [], \"checksum\": 0";
        texts.push(format!(
            "{{\"run\": {run},\n\"yardstick\": {yardstick}, {rest}}}"
        ));
    }
    assert!(texts.iter().all(|text| fuzzing::saved_run(text.as_bytes())));
    proptest!(config(400), |(which in 0..texts.len(), changes in changes())| {
        let text = mutated(&texts[which], &changes);
        let _ = in_time(&text, || fuzzing::saved_run(text.as_bytes()));
    });
}

/// A short recording of a scene with ground, cable and contacts, as lines.
fn recorded() -> String {
    let set = [("count", "1"), ("segments", "3")];
    let source = SceneSource::load("pile", &set).expect("a scene");
    let scene = source.build().expect("sound");
    let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
    let mut simulation = Simulation::new(3, Limits::Sweep(10.0));
    let mut file = Vec::new();
    let mut recorder = Recorder::begin(&mut file, &stepper, 3).expect("begun");
    while let Some(sample) = simulation.step(&mut stepper) {
        recorder
            .step(&mut file, &stepper, &sample)
            .expect("written");
    }
    recorder
        .end(&mut file, stepper.time(), None)
        .expect("ended");
    fuzzing::lines_of_recording(&file)
}

#[test]
fn recordings_that_are_mutated_are_refused_or_shown() {
    let text = recorded();
    assert!(fuzzing::recording(text.as_bytes()));
    proptest!(config(40), |(changes in changes())| {
        let text = mutated(&text, &changes);
        let _ = in_time(&text, || fuzzing::recording(text.as_bytes()));
    });
}

#[test]
fn bytes_that_are_no_text_do_no_harm() {
    proptest!(config(400), |(data in prop::collection::vec(any::<u8>(), 0..300))| {
        for (_, target) in TARGETS {
            let _ = in_time(&data, || target(&data));
        }
    });
}
