//! Cables of segments as entries: what they lay, and their faults.

use super::testing::{built, check_faults, fault, reads_back, round_trip, says};
use super::{SceneSource, SceneText};

const ROPE: &str = r#"
load = "hook"

[[body]]
name = "hook"
mass = 500
shape = { sphere = { radius = 0.2 } }
position = [1, 0, -8]

[[joint]]
name = "sling"
kind = "distance"
a = "rope-3"
b = "hook"
length = 6
point_a = [0, 0, 0]
point_b = [0, 0, 0]
stretch = 1e-7

[[cable]]
name = "rope"
from = { body = "world", held = "clamped" }
to = { body = "hook", point = [0, 0, 0.2] }
points = [[1, 0, -4]]
segments = 6
radius = 0.01
damping_ratio = 0.02

[[cable]]
name = "tail"
from = { body = "rope-6", point = [0, 0, -0.5] }
to = { body = "world", point = [2, 0, -9], held = "free" }
lengths = [0.5, 1.3]
ea = 1e6
ei = 20
mass_per_length = 0.3
joint = "paper"
rest = "as-routed"
"#;

/// `tail` has the length that its segments say.
fn text() -> String {
    let message = fault(ROPE, &[("cable.tail.lengths", "[1e9]")]);
    let (_, length) = message.split_once("on a route of ").unwrap();
    let length: f64 = length.split(' ').next().unwrap().parse().unwrap();
    ROPE.replace("[0.5, 1.3]", &format!("[0.5, {}]", length - 0.5))
}

#[test]
fn entries_lay_cables_that_others_hold_on_to() {
    let scene = built(&text());
    let names: Vec<_> = scene.cables.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["rope", "tail"]);
    assert_eq!(scene.cables[0].bodies, [1, 2, 3, 4, 5, 6]);
    assert_eq!(scene.cables[0].joints, [1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(scene.cables[1].bodies, [7, 8]);
    assert_eq!(scene.constraint_names[..2], ["sling", "rope-start"]);
    let held = scene.constraints[8].frames()[0].body_index();
    assert_eq!(
        (scene.constraint_names[8].as_str(), held),
        ("tail-start", Some(6))
    );
    // Written one by one it is the same scene, cables and all.
    let explicit = SceneText::from_scene(&scene).unwrap();
    assert!(explicit.cable.is_empty());
    round_trip(&scene);
    // As entries, too.
    reads_back(&SceneSource::parse(&text(), &[]).unwrap());
}

#[test]
fn overrides_find_cables_by_name() {
    let overrides = [("cable.rope.segments", "3"), ("joint.sling.a", "rope-2")];
    // `tail` begins on a segment that is not there.
    let message = fault(&text(), &overrides);
    says(&message, "… `rope-6`, which is not there");
}

#[test]
fn faults_of_cables_name_line_and_key() {
    let faults = r##"
        segments = 6 → segments = 0 → line 25, column 1: cable `rope`: segments is 0
        segments = 6 → segments = 6⏎lengths = [1] → line 26, column 1: cable `rope`: lengths
        radius = 0.01 → radius = -1 → line 26, column 1: cable `rope`: radius is -1
        radius = 0.01⏎ →  → … cable `rope`: radius: give it in m, or ea
        radius = 0.01 → radius = 0.01⏎material = "wood" → … material `wood` is not known
        damping_ratio = 0.02 → damping_ratio = nan → line 27, column 1
        [[1, 0, -4]] → [[0, 0, 0]] → line 24, column 1: cable `rope`: points 1 and 2
        body = "world", held → body = "word", held → … names the body `word`
        [2, 0, -9], held → [2, 0, -9], hold → … unknown field `hold`
        body = "rope-6" → held = "free", body = "rope-6" → … a free end is a point
        segments = 6 → segments = 20000000 → … at most 10000000
        segments = 6 → lengths = [1, 1] → … lengths on a route of
        segments = 6 → lengths = [9, -1] → … length of segment 2 is -1
        [[1, 0, -4]] → [[nan, 0, -4]] → … cable `rope`: points is NaN
        [[1, 0, -4]] → [[2, 0, -15.6]] → … point 2 of the route: is a fold
        points = [[1, 0, -4]]⏎segments = 6 → points = [[30, 0, -4]]⏎segments = 1 → … segment 1: cuts off too much
        damping_ratio = 0.02 → damping_ratio = -0.1 → … damping is -0.1 … damping_ratio
        damping_ratio = 0.02 → joint = "spherical" → … ball joints do not clamp
        mass_per_length = 0.3 → mass_per_length = nan → … mass_per_length is NaN
        mass_per_length = 0.3 → mass_per_length = 1e-320 → … `tail-1`: mass is 0.000
        ei = 20 → ei = 20⏎gj = -1 → … gj is -1
        ei = 20 → ei = 0 → line 35, column 1: cable `tail`: ei is 0
        name = "tail" → name = "rope" → … two cable entries are called `rope`
        points = [[1 → through = [[1 → … is a [[massless_cable]]
        name = "sling" → name = "sling"⏎cable = "rop" → line 12, column 1: joint `sling`: cable
        [[joint]] → [[body]]⏎name = "rope-2"⏎mass = 1⏎inertia = [1, 1, 1]⏎⏎[[joint]] → … two body entries are called `rope-2`
    "##;
    check_faults(&text(), faults);
}

const HOIST: &str = include_str!("../../../integrator/examples/segment_crane.toml");

#[test]
fn a_winch_hauls_in_a_cable_of_segments() {
    let scene = built(HOIST);
    let lead = scene.constraint("rope-start").unwrap();
    let crate::Constraint::Fairlead(of) = &scene.constraints[lead] else {
        panic!("a fairlead");
    };
    assert_eq!((of.winch.force_limit, of.winch.shortest), (5e4, 4.0));
    assert!(of.law.bend.is_some() && (of.length, of.first) == (20.0, 1.0));
    assert_eq!(scene.controls[0].drives[0].constraint, lead);
    let refused = SceneText::from_scene(&scene).unwrap_err().to_string();
    says(&refused, "… the winch of a cable of segments, `rope-start`");
    reads_back(&SceneSource::parse(HOIST, &[]).unwrap());
}

#[test]
fn faults_of_winches_name_line_and_key() {
    let faults = r##"
        from = { body = "jib", point = [8, 0, 0], held = "clamped" } → from = { body = "world", held = "free" } → line 18, column 1: cable `rope`: winch: needs a cable
        winch = { force_limit = 5e4, brake_limit = 8e4, shortest = 4, longest = 22 }⏎ →  → … drives.0.joint: has neither a motor with a speed nor a winch
        shortest = 4 → shortest = 30 → … ≥ winch.shortest
        longest = 22 → longest = 10 → line 18, column 1: cable `rope`: length is 20
        shortest = 4 → speed = nan → … winch.speed is NaN
        radius = 0.008 → radius = 0.008⏎rest = "as-routed" → … straight at rest
        radius = 0.008 → radius = 0.008⏎joint = "paper" → … `cosserat` and `spherical` alone
        radius = 0.008 → radius = 0.008⏎collide = true → … touch nothing
        [[control]] → [[joint]]⏎name = "x"⏎kind = "lock"⏎a = "jib"⏎b = "load"⏎winch = {}⏎⏎[[control]] → … winch
    "##;
    check_faults(HOIST, faults);
}

const RULED: &str = include_str!("../../../integrator/examples/rope.toml");

#[test]
fn a_rule_of_resolution_is_read() {
    let source = SceneSource::parse(RULED, &[]).unwrap();
    let scene = source.build().unwrap();
    let stock = scene.cables[0].stock.as_ref().unwrap();
    let rule = stock.resolution.as_ref().unwrap();
    let length = 73.0_f64.sqrt();
    assert!((rule.shortest - length / 48.0).abs() < 0.01 && (rule.longest - length).abs() < 0.1);
    let default = crate::scene::resolution::Resolution::default();
    assert_eq!(
        (rule.bend, rule.phase, rule.most),
        (0.2, default.phase, default.most)
    );
    let refused = SceneText::from_scene(&scene).unwrap_err().to_string();
    says(&refused, "… the rule of resolution of the cable `rope`");
    reads_back(&source);
}

#[test]
fn faults_of_rules_name_line_and_key() {
    let faults = r##"
        { bend = 0.2 } → { bend = 0 } → line 33, column 1: cable `rope`: resolution … bend is 0
        { bend = 0.2 } → { phase = -0.1 } → line 33, column 1: cable `rope`: resolution … phase is -0.1
        { bend = 0.2 } → { shortest = 0 } → line 33, column 1: cable `rope`: resolution … is 0: it has to be a shortest
        { bend = 0.2 } → { shortest = 2, longest = 1 } → line 33, column 1: cable `rope`: resolution … longest is 1: it has to be at least `shortest`
        { bend = 0.2 } → { hysteresis = 0.5 } → line 33, column 1: cable `rope`: resolution … hysteresis is 0.5
        { bend = 0.2 } → { pause = 0 } → line 33, column 1: cable `rope`: resolution … pause is 0: it has to be > 0 s
        { bend = 0.2 } → { most = 0 } → line 33, column 1: cable `rope`: resolution … most is 0: it has to be at least 1 segment
        { bend = 0.2 } → { finest = 1 } → line  … unknown field `finest`
        { bend = 0.2 } → {}⏎joint = "paper" → line 33, column 1: cable `rope`: resolution … makes joints of the kinds
        { bend = 0.2 } → {}⏎rest = "as-routed" → line 33, column 1: cable `rope`: resolution … straight at rest
    "##;
    check_faults(RULED, faults);
}
