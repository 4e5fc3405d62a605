//! Tests of scenes written and read back. Equality is that of the bits: Rust's debug text tells −0 from 0.

use crate::testing::*;

use super::SceneText;
use super::keys::{self, Described};
use super::testing::{reads_back, round_trip, says};
use crate::named::NAMES;

#[test]
fn every_named_scene() {
    for name in NAMES {
        let specimen = ["pull", "twist", "bend"].contains(&name);
        let sets = match name {
            "hoist" => {
                "joint=paper seed=3 initial_angle=0.3|move_x=0.5 equilibrium=true damping=0.01|\
                 circle_radius=2 anchor=clamped twist=false"
            }
            "gantry" => "joint=paper parts=2 seed=3|trolley_force=2e4 winch_force=1e5",
            _ if specimen => "joint=paper bearing=true seed=1",
            _ if Network::named(name).is_some() => {
                "joint=spherical seed=7 held=corners damping=0.01"
            }
            _ if Reeved::named(name).is_some() => "friction=0 falls=3 counter_mass=7",
            _ if ContactScene::named(name).is_some() => "friction=0.7 count=3 ei=0",
            _ => "transverse=true seed=7 horizontal=false",
        };
        for set in [""].into_iter().chain(sets.split('|')) {
            let overrides: Vec<_> = set.split(' ').filter_map(|s| s.split_once('=')).collect();
            let source = SceneSource::load(name, &overrides).expect("loads");
            round_trip(&source.build().expect("builds"));
            reads_back(&source);
        }
    }
}

#[test]
fn what_a_text_cannot_hold_is_named() {
    let scene = || {
        let mut scene = Scene::new("pair");
        scene.add_body("a", Body::sphere(1.0, 1.0));
        let frames = [Vector3::zeros(), Vector3::z()];
        let frames = [Frame::world(frames[0]), Frame::body(0, frames[1])];
        let link = Distance {
            frames,
            length: 1.0,
            law: RowLaw::RIGID,
            transverse: false,
        };
        scene.add_constraint("link", Constraint::Distance(link), 0);
        scene
    };
    let refused = |change: fn(&mut Scene), words: &str| {
        let mut scene = scene();
        round_trip(&scene);
        change(&mut scene);
        let error = SceneText::from_scene(&scene).expect_err("a fault");
        says(&error.to_string(), words);
    };
    refused(
        |s| s.body_names[0] = "world".into(),
        "… a body called `world`",
    );
    refused(|s| s.bodies.mass[0] = f64::NAN, "… body `a`: mass is NaN");
    refused(
        |s| s.constraints[0].frames_mut()[1].point = Vector3::zeros(),
        "… joint `link`: point_b: is in one place with point_a",
    );
    refused(|s| s.bodies = crate::Bodies::new(), "… no bodies");
}

/// The keys that a reader of the table `table` takes, from its own message.
fn taken(table: &str) -> Vec<String> {
    let text = format!("{table}\nno-such-key = 1\n");
    let error = SceneSource::parse(&text, &[]).expect_err("unknown key");
    let error = error.to_string();
    let (_, known) = error.split_once("expected ").expect("the known keys");
    let quoted = known.split('`').skip(1).step_by(2);
    quoted.map(str::to_owned).collect()
}

#[test]
fn every_key_has_its_meaning() {
    let tables = NAMES.map(|name| {
        let source = SceneSource::load(name, &[]).expect("loads");
        (format!("[{name}]"), keys::of_source(&source))
    });
    let lists = keys::LISTS.map(|(list, keys)| (format!("[[{list}]]"), keys::of(keys)));
    let top = (String::new(), keys::of(SceneText::KEYS));
    for (table, keys) in tables.into_iter().chain(lists).chain([top]) {
        let names: Vec<_> = keys.iter().map(|key| key.name.clone()).collect();
        assert_eq!(names, taken(&table), "{table}");
        for key in keys {
            assert!(key.meaning.len() > 5, "{table} {}", key.name);
            assert!(!key.meaning.contains("\\["), "{}", key.meaning);
            assert!(!key.meaning.contains("[`"), "{}", key.meaning);
        }
    }
}

#[test]
fn comments_stand_before_their_keys() {
    let source = SceneSource::load("hoist", &[("radius", "0.02")]).expect("loads");
    let text = source.to_commented_toml().expect("writes");
    let says = text.contains("\n# Length of the unstrained cable [m].\nlength = 10.0\n");
    assert!(says, "{text}");
    let says = text.contains("\nradius = 0.02\n# Axial stiffness YA [N].");
    assert!(says, "{text}");
    assert!(text.contains("\n# ea =    (not given)\n"), "{text}");
    let scene = source.build().expect("builds");
    let explicit = SceneText::from_scene(&scene).expect("a text");
    let text = SceneSource::Explicit(Box::new(explicit)).to_commented_toml();
    let text = text.expect("writes");
    let found = text.matches("# mass: Mass [kg]; a static or driven body needs none.\n");
    let found = found.count();
    assert_eq!(found, 1, "{text}");
    assert_eq!(text.matches("\n[[body]]\n").count(), 25);
    assert!(!text.contains("order"), "{text}");
}

#[test]
fn keys_that_a_scene_has_no_use_for_are_left_out_and_change_nothing() {
    let mut left_out = 0;
    for name in crate::named::NAMES {
        let source = SceneSource::load(name, &[]).expect("loads");
        let scene = source.build().expect("builds");
        let text = source.to_commented_toml().expect("writes");
        for key in keys::of_source(&source) {
            let line = format!("\n{} =", key.name);
            if text.contains(&line) || text.contains(&line.replace('\n', "\n# ")) {
                continue;
            }
            left_out += 1;
            let mut others = 0;
            for value in ["2", "9", "2.5", "corners", "spherical"] {
                let Ok(other) = SceneSource::load(name, &[(&key.name, value)]) else {
                    continue;
                };
                // Where it has another value it is written, to be read back.
                let written = other.to_commented_toml().expect("writes");
                others += usize::from(written.contains(&line));
                assert_eq!(SceneSource::parse(&written, &[]), Ok(other.clone()));
                if let Ok(built) = other.build() {
                    assert_eq!(built, scene, "{name}: {} = {value}", key.name);
                }
            }
            assert!(others > 0, "{name}: {}", key.name);
        }
    }
    assert!(left_out > 20, "{left_out}");
}
