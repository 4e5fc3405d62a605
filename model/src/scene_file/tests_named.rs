//! Faulty parameters of the named scenes.

use super::testing::{fault, says};
use super::{SceneSource, keys};
use crate::named::NAMES;

/// Scene, parameters and what the message starts with and holds.
const FAULTS: &str = "
    hoist segments=0 → segments is 0: it has to be at least 1
    hoist segments=20000000 → segments … at most 10000000
    hoist length=0 → length is 0: it has to be > 0 m
    hoist mass_ratio=-1 → mass_ratio is -1
    hoist segment_mass=0 → segment_mass is 0
    hoist top_mass=0 → top_mass is 0
    hoist ea=-2e7 → ea is -20000000
    hoist material=wood → … choose one of steel, nylon, rubber
    hoist stretch=false → … stretch
    hoist move_x=1 circle_radius=1 → … excludes move_x
    hoist joint=spherical anchor=clamped → anchor: spherical joints have stretch rows only
    hoist joint=spherical twist=true → twist: spherical joints
    hoist twist_definition=alternative → twist_definition: is a choice of the paper's joint
    hoist length=1e-305 → … when all is worked out
    particles-a particles=0 → particles is 0: it has to be at least
    particles-a particles=20000000 → particles is 20000000
    particles-a spacing=-1 → spacing is -1: it has to be > 0 m
    particles-a load_mass=0 → load_mass is 0
    particles-a compliance=-1e-9 → compliance is -
    particles-a added_compliance=-1 → added_compliance is -1
    particles-a seed_velocity=-1 → seed_velocity is -1
    gantry segments=0 → segments is 0: it has to be at least
    gantry segments=9223372036854775807 → segments is 9223372036854775807
    gantry parts=1 → parts is 1: it has to be 2 to 12
    gantry parts=13 → parts is 13
    gantry hook_mass=0 → hook_mass is 0
    gantry least_drop=0 → least_drop is 0
    gantry drop=0.5 → drop is 0.5: it has to be at least
    gantry sheave_friction=0.1 rope_ea=1e7 → … set `sheaves = true`
    gantry sheaves=true sheave_friction=0.1 rope_ea=0 → … rope_ea
    pull segments=0 → segments is 0: it has to be at least 1
    pull segments=20000000 → segments … at most 10000000
    pull length=-1 → length is -1: it has to be > 0 m
    pull area=0 → area is 0: it has to be > 0 m²
    pull poisson=0.6 → poisson is 0.6
    pull material=wood → … choose one of steel, nylon
    pull joint=spherical → joint: a specimen of ball
    pull damping=-1 → damping is -1
    pull area=1e-320 → … when all is worked out
    ring segments=7 → segments is 7: it has to be at least 1, for a ring
    ring points=3 → points is 3: it has to be 1 or 2
    ladder cables=1 → cables is 1: it has to be at least 2
    ladder rung_every=0 → rung_every is 0
    ladder cables=9223372036854775807 → … segments × cables
    net rows=1 → rows is 1
    net columns=20000000 → … rows × columns
    cranes ea=0 → ea is 0: it has to be > 0 N
    cranes joint=paper → joint: a network has
    cranes length=1e-200 → … when all is worked out
    capstan friction=-0.1 → friction is -0.1
    capstan friction=300 → … friction times wrap
    tackle falls=0 → falls is 0
    tackle ea=0 → ea is 0
    elevator wheel_inertia=0 → … inertia is 0
    stack count=0 → count is 0
    stack restitution=1.5 → restitution is 1.5
    stack mass_ratio=0.5 → mass_ratio is 0.5
";

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
