//! Faulty explicit texts: every message is one line that starts with the line at fault, names the key and says the cure.

use super::SceneSource;
use super::testing::{built, fault, says};

const CRANE: &str = include_str!("texts/loads.toml");

#[test]
fn the_text_without_faults_is_sound() {
    assert_eq!(built(CRANE).constraint_names, ["link", "main", "stiff"]);
    let free = CRANE.replace(
        "order = [\"link\", \"main\", \"stiff\"]",
        "order = [\"stiff\", \"main\", \"link\"]",
    );
    assert_eq!(built(&free).constraint_names, ["stiff", "main", "link"]);
}

#[test]
fn overrides_that_bring_a_fault_in_are_named() {
    let rows = "\
body.hook.mass → -1 → body `hook`: mass is -1: it has to be > 0 kg
body.1.orientation → [1, 1, 0, 0] → unit quaternion
massless_cable.main.through.1.body → ring → names the body `ring`
massless_cable.main.through.2.motion.smooth.duration → -1 → > 0 s
bend.stiff.bend → nan → compliance is NaN
joint.link.kind → lock → bend, twist, ei, gj need kind
order → [\"main\"] → name every constraint once
load → ring → choose one of hook, bob";
    for row in rows.lines() {
        let [key, value, words] = [0, 1, 2].map(|i| row.split(" → ").nth(i).expect("a cell"));
        let others = [
            ("body.bob.mass", "20"),
            (key, value),
            ("gravity", "[0, 0, -1]"),
        ];
        says(
            &fault(CRANE, &others),
            &format!("override `{key}`: … {words}"),
        );
    }
    // Two that are sound together only: none is at fault.
    let both = [("joint.link.kind", "lock"), ("joint.link.name", "weld")];
    let text = CRANE.replacen("bend = 1e-3\ndamping", "damping", 1);
    let text = text.replacen("order = [\"link\"", "order = [\"weld\"", 1);
    assert!(
        SceneSource::parse(&text, &both)
            .and_then(|s| s.build())
            .is_ok()
    );
    // The text's own fault keeps its line.
    let set = &[("load", "bob")];
    let text = fault(&CRANE.replacen("mass = 50", "mass = -50", 1), set);
    assert!(text.starts_with("line 8, column 1: body `hook`"), "{text}");
}

#[test]
fn a_scene_changed_after_reading_has_no_lines() {
    let Ok(SceneSource::Explicit(mut scene)) = SceneSource::parse(CRANE, &[]) else {
        panic!("an explicit scene");
    };
    scene.body[1].mass = Some(-1.0);
    let text = scene.build().expect_err("a fault").to_string();
    assert_eq!(text, "body `bob`: mass is -1: it has to be > 0 kg");
}
