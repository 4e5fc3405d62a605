//! Tests of scenes as one table, and of overrides.

use super::testing::{built, check_faults, fault, says};
use super::*;
use crate::testing::*;
use proptest::prelude::*;

fn hoist(source: &SceneSource) -> &HoistParams {
    match source {
        SceneSource::Hoist(params) => params,
        _ => panic!("not a hoist"),
    }
}

#[test]
fn names_and_overrides() {
    let overrides = [
        ("segments", "6"),
        ("mass_ratio", "1e5"),
        ("hoist.joint", "paper"),
        ("load_offset", "1"),
    ];
    let source = SceneSource::load("hoist", &overrides).expect("loads");
    let params = hoist(&source);
    assert_eq!((params.segments, params.mass_ratio), (6, 1e5));
    assert_eq!((params.joint, params.load_offset), (JointKind::Paper, 1.0));
    assert_eq!(source.build().expect("builds").bodies.len(), 7);
    let text = "[hoist]\nsegments = 3\nanchor = \"clamped\"\n";
    let source = SceneSource::parse(text, &[("segments", "4")]).expect("loads");
    assert_eq!(hoist(&source).segments, 4);
}

#[test]
fn faults_say_where() {
    let unknown = SceneSource::load("hoits", &[]).expect_err("no such scene");
    assert!(
        unknown
            .to_string()
            .contains("choose one of hoist, gantry, particles-a")
    );
    let faults = r##"
        TEXT →  → … no bodies
        TEXT → # nothing → … no bodies
        TEXT → [hoist]⏎segments = 3⏎lenght = 2.0 → line 3, column 1: unknown field `lenght` … `length`
        TEXT → [hoist]⏎segments = "many" → line 2, column 12: invalid type
        TEXT → [hoist]⏎segments = = 3 → line 2, column
        TEXT → [hoist]⏎segments = 3⏎[extra] → line 3, column 2: `extra` stands beside [hoist]
        TEXT → [particles-a]⏎[hoist] → line … stands beside [hoist]
        TEXT → [particles-a]⏎[particles-e] → line 2, column 2: `particles-e`
        TEXT → [twist]⏎force = 1⏎[bend] → line … stands beside [bend]
    "##;
    check_faults("TEXT", faults);
}

/// A sound text and the table of its faults.
macro_rules! faulty {
    ($name:literal) => {{
        let faults = include_str!(concat!("texts/", $name, ".faults"));
        (include_str!(concat!("texts/", $name, ".toml")), faults)
    }};
}

/// Each row of a table of faults is one in the sound text beside it.
#[test]
fn faults_name_line_key_and_cure() {
    let cables = super::tests_cable::text();
    let wound = include_str!("texts/wound.toml").replace("FRICTION", "");
    let hoist = include_str!("../../../integrator/examples/segment_crane.toml");
    let rope = include_str!("../../../integrator/examples/rope.toml");
    for (sound, faults) in [
        (cables.as_str(), include_str!("texts/cables.faults")),
        (wound.as_str(), include_str!("texts/wound.faults")),
        (hoist, include_str!("texts/winch.faults")),
        (rope, include_str!("texts/rule.faults")),
        faulty!("yard"),
        faulty!("drives"),
        faulty!("events"),
        faulty!("picked"),
        faulty!("links"),
        faulty!("loads"),
        faulty!("reeved"),
    ] {
        assert!(sound == wound || !built(sound).bodies.is_empty());
        check_faults(sound, faults);
    }
    let passed =
        include_str!("texts/reeved.toml").replace("point = [2, 0, -1]", "point = [2, 0, 1]");
    let fault = "length = 20 → length = 20.0 → line … sheave 2 … does not touch the cable";
    check_faults(&passed.replace(", turns = 1 }", " }"), fault);
}

#[test]
fn faults_of_overrides_name_the_key() {
    for (scene, key, value, words) in [
        ("hoist", "mass", "3", "unknown field `mass` … `mass_ratio`"),
        ("hoist", "segments", "2.5", "invalid type"),
        ("hoist", "segments", "-2", ""),
        ("hoist", "joint", "welded", "… `cosserat`"),
        ("hoist", "a.b", "1", "… there is no `a`"),
        ("hoist", "", "1", ""),
        ("hoist", "segments.x", "1", "… there is no `segments`"),
        ("particles-a", "spcaing", "2", "unknown"),
        ("twist", "tork", "2", "unknown"),
    ] {
        let text = fault(&format!("[{scene}]"), &[("seed", "4"), (key, value)]);
        says(&text, &format!("override `{key}`: {words}"));
    }
    says(&fault("[hoist]", &[("ea", "nan")]), "… ea is NaN");
    says(&fault("[particles-a]", &[("mass", "nan")]), "… mass is NaN");
    // The text is at fault, not the override: its own line is named.
    let text = fault("[hoist]\nsegmnts = 3\n", &[("length", "2")]);
    says(&text, "line 2, column 1");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_read_or_refused(
        text in "(\\[hoist\\]\n|\\[\\[body\\]\\]\n|\\[\\[joint\\]\\]\n)?(.|\n|=|\\[|\"){0,60}",
        key in "(segments|length|joint|[a-z_.]{0,12})",
        value in "([-+0-9.e]{0,6}|.{0,8})",
    ) {
        for overrides in [&[][..], &[(key.as_str(), value.as_str())][..]] {
            if let Err(error) = SceneSource::parse(&text, overrides) {
                prop_assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
}

#[test]
fn the_crane_of_the_documentation_is_a_scene() -> Result<(), SceneError> {
    let text = include_str!("crane.toml");
    let mut scene = SceneSource::parse(text, &[("body.load.mass", "2000")])?.build()?;
    assert_eq!(scene.constraint_names, ["slew", "rail", "sling", "rope"]);
    assert_eq!(scene.groups, [0; 4]);
    assert_eq!(SceneText::from_scene(&scene)?.build()?, scene);
    scene.set_control(0, 0.25, 0.0);
    let rope = scene.constraints[3].massless_cable().expect("the rope");
    assert_eq!(rope.length_at(4.0), 18.0);
    says(
        &fault(&text.replace("ea = 2e7", "ea = -1"), &[]),
        "line 67, column 1: massless cable `rope`: ea is -1: it has to be > 0 N, or N m²",
    );
    Ok(())
}
