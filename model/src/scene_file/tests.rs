//! Tests of scenes as one table, and of overrides.

use super::*;
use crate::cable::JointKind;
use crate::{ChainModel, HoistParams};
use proptest::prelude::*;

fn hoist(source: &SceneSource) -> &HoistParams {
    match source {
        SceneSource::Hoist(params) => params,
        _ => panic!("not a hoist"),
    }
}

fn fault(text: &str, overrides: &[(&str, &str)]) -> String {
    let error = SceneSource::parse(text, overrides)
        .and_then(|s| s.build())
        .expect_err("a fault");
    let text = error.to_string();
    assert!(!text.contains('\n'), "{text}");
    text
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
fn written_text_reads_back_to_the_identical_scene() {
    let overrides = [
        ("ea", "1.2345678901234567e7"),
        ("initial_angle", "0.1"),
        ("seed", "77"),
        ("damping", "1e-300"),
    ];
    let source = SceneSource::load("hoist", &overrides).expect("loads");
    let text = source.to_toml().expect("writes");
    let again = SceneSource::parse(&text, &[]).expect("reads");
    assert_eq!(again, source);
    assert_eq!(again.build(), source.build());
}

#[test]
fn particle_chains_by_name_and_text() {
    let overrides = [
        ("particles", "9"),
        ("load_mass", "1e3"),
        ("particles-a.transverse", "true"),
        ("compliance", "1.2345678901234567e-9"),
        ("seed", "3"),
    ];
    let source = SceneSource::load("particles-a", &overrides).expect("loads");
    let scene = source.build().expect("builds");
    assert_eq!((scene.bodies.len(), scene.bodies.mass[8]), (9, 1e3));
    assert_eq!(scene.constraints[0].rows(), 3);
    let text = source.to_toml().expect("writes");
    assert!(text.starts_with("[particles-a]"), "{text}");
    let again = SceneSource::parse(&text, &[]).expect("reads");
    assert_eq!(again, source);
    assert_eq!(again.build(), Ok(scene));
    let text = fault("[particles-a]\nspacing = -1\n", &[]);
    assert_eq!(text.split(':').next(), Some("spacing is -1"));
    let text = fault("[particles-a]", &[("spcaing", "2")]);
    assert!(text.starts_with("override `spcaing`: unknown"), "{text}");
    assert!(fault("[particles-a]", &[("mass", "nan")]).contains("mass is NaN"));
    let both = fault("[particles-a]\n[hoist]", &[]);
    assert!(both.contains("stands beside [hoist]"), "{both}");
    let both = fault("[particles-a]\n[particles-e]", &[]);
    assert!(
        both.starts_with("line 2, column 2: `particles-e`"),
        "{both}"
    );
}

#[test]
fn every_model_of_the_chain_reads_back() {
    for model in ChainModel::ALL {
        let name = model.name();
        let overrides = [("added_compliance", "1e-7"), ("particles", "3")];
        let source = SceneSource::load(name, &overrides).expect("loads");
        let text = source.to_toml().expect("writes");
        assert!(text.starts_with(&format!("[{name}]")), "{text}");
        assert_eq!(SceneSource::parse(&text, &[]), Ok(source.clone()));
        assert_eq!(source.build().expect("builds").name, name);
    }
}

#[test]
fn specimens_by_name_and_text() {
    for (name, load) in [("pull", "force"), ("twist", "torque"), ("bend", "moment")] {
        let overrides = [("segments", "5"), ("material", "rubber"), (load, "0.25")];
        let source = SceneSource::load(name, &overrides).expect("loads");
        let scene = source.build().expect("builds");
        assert_eq!((scene.bodies.len(), scene.name.as_str()), (6, name));
        let text = source.to_toml().expect("writes");
        assert!(text.starts_with(&format!("[{name}]")), "{text}");
        assert_eq!(SceneSource::parse(&text, &[]), Ok(source));
    }
    let text = fault("[twist]\nforce = 1\n[bend]\n", &[]);
    assert!(text.contains("stands beside [bend]"), "{text}");
    let text = fault("[twist]", &[("tork", "2")]);
    assert!(text.starts_with("override `tork`: unknown"), "{text}");
}

#[test]
fn faults_say_where() {
    let unknown = SceneSource::load("hoits", &[]).expect_err("no such scene");
    assert!(
        unknown
            .to_string()
            .contains("choose one of hoist, gantry, particles-a")
    );
    assert!(fault("", &[]).contains("no bodies"));
    let text = fault("[hoist]\nsegments = 3\nlenght = 2.0\n", &[]);
    assert!(
        text.starts_with("line 3, column 1: unknown field `lenght`"),
        "{text}"
    );
    assert!(text.contains("`length`"), "{text}");
    let text = fault("[hoist]\nsegments = \"many\"\n", &[]);
    assert!(
        text.starts_with("line 2, column 12: invalid type"),
        "{text}"
    );
    let text = fault("[hoist]\nsegments = = 3\n", &[]);
    assert!(text.starts_with("line 2, column"), "{text}");
    let text = fault("[hoist]\nsegments = 3\n[extra]\n", &[]);
    assert!(
        text.starts_with("line 3, column 2: `extra` stands beside [hoist]"),
        "{text}"
    );
    assert!(fault("# nothing\n", &[]).contains("no bodies"));
}

#[test]
fn faults_of_overrides_name_the_key() {
    let text = fault("[hoist]", &[("segments", "4"), ("mass", "3")]);
    assert!(
        text.starts_with("override `mass`: unknown field `mass`"),
        "{text}"
    );
    assert!(text.contains("`mass_ratio`"), "{text}");
    let text = fault("[hoist]", &[("segments", "2.5")]);
    assert!(
        text.starts_with("override `segments`: invalid type"),
        "{text}"
    );
    let text = fault("[hoist]", &[("segments", "-2")]);
    assert!(text.starts_with("override `segments`:"), "{text}");
    assert!(fault("[hoist]", &[("joint", "welded")]).contains("`cosserat`"));
    assert!(fault("[hoist]", &[("a.b", "1")]).contains("there is no `a`"));
    assert!(fault("[hoist]", &[("", "1")]).contains("override ``"));
    assert!(fault("[hoist]", &[("segments.x", "1")]).contains("there is no `segments`"));
    assert!(fault("[hoist]", &[("ea", "nan")]).contains("ea is NaN"));
    // The text is at fault, not the override: its own line is told.
    let text = fault("[hoist]\nsegmnts = 3\n", &[("length", "2")]);
    assert!(text.starts_with("line 2, column 1"), "{text}");
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

    #[test]
    fn any_override_builds_or_is_refused(
        key in "(segments|length|mass_ratio|ea|ei|gj|joint|anchor|seed|damping|gravity|bend|material)",
        value in "(-?[0-9]{1,2}(\\.[0-9]|e-?[0-9]{1,3})?|nan|inf|true|false|paper|clamped|steel|\\[1\\])",
    ) {
        let source = SceneSource::load("hoist", &[(&key, &value)]);
        match source.and_then(|s| s.build()) {
            Ok(scene) => prop_assert_eq!(scene.validate(), Ok(())),
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{error}"),
        }
    }
}
