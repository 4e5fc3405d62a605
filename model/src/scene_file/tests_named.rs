//! Faulty parameters of the named scenes.

use super::testing::{fault, says};
use super::{SceneSource, keys};
use crate::named::NAMES;

/// Scene, parameters and what the message starts with and holds.
const FAULTS: &str = include_str!("texts/named.faults");

#[test]
fn faults_name_the_parameter() {
    for row in FAULTS.lines().map(str::trim).filter(|row| !row.is_empty()) {
        let (scene, wanted) = row.split_once(" → ").expect("two cells");
        let mut words = scene.split(' ');
        let name = words.next().expect("a scene");
        let set: Vec<_> = words.filter_map(|word| word.split_once('=')).collect();
        says(&fault(&format!("[{name}]"), &set), wanted);
    }
}

#[test]
fn no_parameter_is_nan_or_infinite() {
    let mut found = 0;
    for name in NAMES {
        let source = SceneSource::load(name, &[]).expect("loads");
        for key in keys::of_source(&source) {
            for value in ["nan", "-nan", "inf", "-inf"] {
                let set = [(key.name.as_str(), value)];
                let Ok(source) = SceneSource::load(name, &set) else {
                    // No number.
                    continue;
                };
                found += 1;
                let message = source.build().expect_err(&key.name).to_string();
                let named = message.contains(&format!("{} is ", key.name));
                assert!(named, "{name}, {} = {value}: {message}", key.name);
            }
        }
    }
    assert!(found > 900, "{found}");
}

/// The same seed is the same scene, none leaves it at rest, and one moves all but four bodies at most.
#[test]
fn seeds_are_reproducible_and_bounded() {
    for (name, rate) in [
        ("hoist", "seed_rate"),
        ("gantry", "seed_rate"),
        ("particles-a", "seed_velocity"),
        ("ring", "seed_rate"),
        ("junction", "seed_rate"),
        ("ladder", "seed_rate"),
        ("cranes", "seed_rate"),
        ("net", "seed_rate"),
    ] {
        let rates = |seed| {
            let source = SceneSource::load(name, &[("seed", seed), (rate, "0.01")]);
            let bodies = source.and_then(|s| s.build()).expect(name).bodies;
            let pairs = bodies.velocity.into_iter().zip(bodies.angular_velocity);
            pairs.map(|(v, w)| v + w).collect::<Vec<_>>()
        };
        let five = rates("5");
        assert!(five == rates("5") && five != rates("6"), "{name}");
        assert!(rates("0").iter().all(|rate| rate.amax() == 0.0), "{name}");
        assert!(five.iter().all(|rate| rate.amax() <= 0.01), "{name}");
        let moving = five.iter().filter(|rate| rate.amin() > 0.0).count();
        assert!(moving + 4 >= five.len(), "{name}: {moving}");
    }
}
