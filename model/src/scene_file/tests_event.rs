//! Events as entries, and their faults.

use super::testing::{built, reads_back, round_trip};
use crate::testing::*;

const CRANE: &str = include_str!("texts/events.toml");

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
    let expected = [Action::Release(3), Action::Release(2)];
    assert_eq!(scene.events[4].then, expected);
    let (constraint, above) = (3, 5e3);
    assert_eq!(scene.events[3].when, When::Force { constraint, above });
    let (control, value) = (0, 0.5);
    assert_eq!(scene.events[5].then[1], Action::Set { control, value });
    round_trip(&scene);
    let source = SceneSource::parse(CRANE, &[("event.caught.distance.below", "0.2")]);
    reads_back(&source.unwrap());
}

/// A load that is picked up and set down twice, under one name, and taken over in between.
const PICKED: &str = include_str!("texts/picked.toml");

#[test]
fn what_an_event_attaches_an_event_can_release() {
    let scene = built(PICKED);
    let grip = || Action::Detach("grip".into());
    assert_eq!(scene.events[0].then, [grip()]);
    assert_eq!(scene.events[1].then[0], Action::Detach("stand".into()));
    assert_eq!(scene.events[2].then[0], grip());
    round_trip(&scene);
}
