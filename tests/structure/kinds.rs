//! Where code tells kinds of constraint apart, and which lists of the tests have all of them.

use super::sources::{code, rust_files};
use std::collections::{BTreeMap, BTreeSet};
use taut_model::{Constraint, Frame, nalgebra::Vector3};
use taut_tests::decode::Bytes;
use taut_tests::scenes::{KINDS, joint};

/// Lines that match on a kind, outside the kinds' own files and the text of scenes: what they say of other kinds must be true of a
/// new one. What is asked of any kind is a fact (`model/src/constraint/facts.rs`).
const MATCHES: [(&str, usize); 26] = [
    // What massless cables and fairleads alone have: sheaves, drums, winches, segments to cut.
    ("integrator/src/run/access.rs", 2),
    ("integrator/src/run/change.rs", 1),
    ("integrator/src/run/change/segments.rs", 1),
    ("integrator/src/run/saved.rs", 1),
    ("integrator/src/run/saved/beginning.rs", 1),
    ("integrator/src/step/winch_cuts.rs", 5),
    ("model/src/linearized.rs", 1),
    ("model/src/scene/reeving.rs", 2),
    ("model/src/scene/validate.rs", 2),
    ("model/src/scene/winding.rs", 4),
    // Besides, motors that turn: a hinge's.
    ("bench/measure/src/columns.rs", 1),
    ("bench/recording/src/observe.rs", 5),
    ("integrator/src/step.rs", 2),
    ("integrator/src/step/divided.rs", 3),
    // Links have transverse rows of their own.
    ("integrator/src/equilibrium.rs", 2),
    // All but ropes keep the shapes of their bodies apart.
    ("model/src/contacts/pairs.rs", 1),
    // Joints that are stored in packs; all others are not.
    ("model/src/packs.rs", 4),
    // Joints of cables of segments, and ties that an event made.
    ("model/src/cable/strand.rs", 1),
    ("model/src/scene/event.rs", 2),
    ("model/src/scene/resolution.rs", 2),
    // Experiments on scenes that they know.
    ("bench/measure/src/engine/contact_scenes.rs", 1),
    ("bench/baselines/src/rapier.rs", 1),
    ("bench/studies/src/hard/coded/winding.rs", 2),
    ("bench/studies/src/hard/file/probes.rs", 1),
    ("bench/studies/src/hard/file/run.rs", 1),
    ("bench/studies/src/paper/claims.rs", 1),
];

/// A line that takes a constraint apart by the name of its kind; others make one.
fn is_match(line: &str) -> bool {
    let Some((before, after)) = line.split_once("Constraint::") else {
        return false;
    };
    let is_kind = Constraint::KINDS.iter().any(|kind| after.starts_with(kind));
    is_kind
        && (before.contains("matches!") || ["(_)", "=>", " = "].iter().any(|s| after.contains(s)))
}

#[test]
fn few_places_match_on_kinds() {
    let mut found: BTreeMap<String, usize> = BTreeMap::new();
    let bench = "measure output recording baselines studies view".split(' ');
    let bench = bench.map(|name| format!("bench/{name}/src"));
    let folders = ["model/src", "integrator/src", "bench/src"].map(str::to_owned);
    for (file, text) in folders
        .into_iter()
        .chain(bench)
        .flat_map(|f| rust_files(&f))
    {
        let own = ["model/src/constraint", "model/src/scene_file"];
        let name = file.rsplit('/').next().unwrap_or_default();
        if own.iter().any(|own| file.starts_with(own))
            || file.contains("tests")
            || name == "testing.rs"
        {
            continue;
        }
        let text = text.split("\nmod tests {").next().unwrap_or_default();
        let count = code(text).filter(|(_, line)| is_match(line)).count();
        if count > 0 {
            found.insert(file, count);
        }
    }
    let known = MATCHES.map(|(file, count)| (file.to_owned(), count));
    assert_eq!(found, known.into(), "ask a fact of the kind instead");
}

/// The names of the kinds of constraints.
fn names(all: impl IntoIterator<Item = Constraint>) -> BTreeSet<String> {
    let name = |c: Constraint| format!("{c:?}").split('(').next().map(str::to_owned);
    all.into_iter().filter_map(name).collect()
}

/// All kinds but some.
fn all_but(left_out: &[&str]) -> BTreeSet<String> {
    let kinds = Constraint::KINDS
        .iter()
        .filter(|kind| !left_out.contains(kind));
    kinds.map(|kind| (*kind).to_owned()).collect()
}

/// A new kind is drawn from bytes, and takes part where joints of all kinds do.
#[test]
fn lists_have_all_kinds() {
    let drawn = (0..=u8::MAX).map(|byte| Bytes::new(&[0, byte]).constraint(2));
    // Of a cable with a winch, which has its own scenes.
    assert_eq!(names(drawn), all_but(&["Fairlead"]));
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(0, Vector3::zeros()),
    ];
    let joined = KINDS.map(|kind| joint(kind, frames, 1e-6, 1e-6, 0.0));
    // Chains of particles have these.
    assert_eq!(
        names(joined),
        all_but(&["Fairlead", "Distance", "LinkBend"])
    );
}
