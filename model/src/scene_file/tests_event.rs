//! Events as entries, and their faults.

use super::testing::{built, check_faults, reads_back, round_trip};
use crate::testing::*;

const CRANE: &str = r#"
load = "block"

[[body]]
name = "block"
mass = 500
shape = { sphere = { radius = 0.2 } }
position = [0, 0, -8]

[[body]]
name = "sack"
mass = 20
shape = { sphere = { radius = 0.1 } }
position = [0, 0, -9]

[[cable]]
name = "rope"
from = { body = "world" }
to = { body = "block" }
segments = 2
radius = 0.01
breaks_at = 9e4

[[massless_cable]]
name = "sling"
through = [{ body = "block" }, { body = "sack" }]
length = 1
stretch = 1e-5
breaks_at = 5e3
winch = {}

[[control]]
name = "lower"
drives = [{ joint = "sling" }]

[[event]]
name = "let go"
at = 2.5
release = ["sling", "rope-end"]

[[event]]
name = "caught"
distance = { a = { body = "block" }, b = { body = "world", point = [3, 0, -8] }, below = 0.1 }
attach = [{ name = "hook", a = { body = "block" }, b = { body = "world", point = [3, 0, -8] } }]
set = [{ control = "lower", value = 0.5 }]

[[event]]
name = "slack"
force = { joint = "rope-start", above = 1e4 }
set = [{ control = "lower", value = 1 }]
"#;

#[test]
fn entries_and_breaks_are_events() {
    let scene = built(CRANE);
    let names: Vec<_> = scene.events.iter().map(|e| e.name.as_str()).collect();
    let breaks = [
        "rope-start breaks",
        "rope-joint-1 breaks",
        "rope-end breaks",
    ];
    assert_eq!(names[..3], breaks);
    assert_eq!(names[3..], ["sling breaks", "let go", "caught", "slack"]);
    assert_eq!(
        scene.events[4].then,
        [Action::Release(3), Action::Release(2)]
    );
    let (constraint, above) = (3, 5e3);
    assert_eq!(scene.events[3].when, When::Force { constraint, above });
    let (control, value) = (0, 0.5);
    assert_eq!(scene.events[5].then[1], Action::Set { control, value });
    round_trip(&scene);
    let source = SceneSource::parse(CRANE, &[("event.caught.distance.below", "0.2")]);
    reads_back(&source.unwrap());
}

#[test]
fn faults_of_events_name_line_and_key() {
    let faults = r##"
        at = 2.5 → at = -1 → … event `let go`: time is -1: it has to be ≥ 0 s
        at = 2.5 → at = nan → … event `let go`: time is NaN
        at = 2.5⏎ →  → line 36, column 1: event `let go`: at: give one condition
        "sling", "rope-end" → "slink" → line 39, column 1: event `let go` names `slink`
        release = ["sling", "rope-end"] →  → … event `let go`: does nothing
        breaks_at = 5e3 → breaks_at = 0 → … event `sling breaks`: force is 0
        breaks_at = 9e4 → breaks_at = -1 → … event `rope-start breaks`: force is -1
        below = 0.1 → below = 0 → … event `caught`: distance is 0
        control = "lower", value = 0.5 → control = "lift", value = 1 → … called `lift`
        name = "hook" → name = "sling" → … two joint entries are called `sling`
        name = "slack" → name = "caught" → … two event entries are called `caught`
        a = { body = "block" }, b = { body = "world", point = [3, 0, -8] } } → a = { body = "blog" }, b = { body = "world" } } → … the body `blog`
    "##;
    check_faults(CRANE, faults);
}

/// A load that is picked up and set down twice, under one name, and taken over in between.
const PICKED: &str = r#"
[[body]]
name = "hook"
mass = 50
shape = { sphere = { radius = 0.1 } }
position = [0, 0, 1]
[[body]]
name = "crate"
mass = 200
shape = { sphere = { radius = 0.3 } }

[[joint]]
name = "stand"
kind = "spherical"
stretch = 0
a = "world"
b = "crate"
point = [0, 0, 0]

[[event]]
name = "early"
at = 0.5
release = ["grip"]

[[event]]
name = "up"
at = 1
attach = [{ name = "grip", a = { body = "hook" }, b = { body = "crate" } }]
release = ["stand"]

[[event]]
name = "down"
at = 2
release = ["grip"]
attach = [{ name = "stand", a = { body = "world" }, b = { body = "crate" } }]

[[event]]
name = "again"
at = 3
attach = [{ name = "grip", a = { body = "hook" }, b = { body = "crate", point = [0, 0, 0.3] } }]
"#;

#[test]
fn what_an_event_attaches_an_event_can_release() {
    let scene = built(PICKED);
    let grip = || Action::Detach("grip".into());
    assert_eq!(scene.events[0].then, [grip()]);
    assert_eq!(scene.events[1].then[0], Action::Detach("stand".into()));
    assert_eq!(scene.events[2].then[0], grip());
    round_trip(&scene);
    let faults = r##"
        release = ["stand"] → release = ["grap"] → … event `up` names `grap`, which is not there: choose one of stand, grip
        name = "grip", a = { body = "hook" }, b = { body = "crate" } } → name = "grip", a = { body = "hook" }, b = { body = "crate" } },⏎  { name = "grip", a = { body = "hook" }, b = { body = "world" } } → … two joint entries are called `grip`
        kind = "spherical"⏎stretch = 0 → kind = "hinge"⏎axis = [0, 1, 0] → … called `stand`
    "##;
    check_faults(PICKED, faults);
}
