//! Tests of what moves: mobility, hinges, sliders, motors, winches, controls, and of their faults.

use crate::testing::*;

use super::SceneText;
use super::testing::{built, check_faults, fault, says};

const CRANE: &str = r#"name = "crane"
[[body]]
name = "tower"
mobility = "static"
position = [0, 0, 10]
[[body]]
name = "ship"
mobility = "driven"
shape = { box = { size = [9, 3, 2] } }
velocity = [0.5, 0, 0]
[[body]]
name = "jib"
mass = 900
shape = { cylinder = { length = 20, radius = 0.4 } }
position = [10, 0, 10]
rotation = [0, 1.5707963267948966, 0]
[[body]]
name = "trolley"
mass = 100
inertia = [9, 9, 9]
position = [4, 0, 9]
[[body]]
name = "hook"
mass = 50
inertia = [1, 1, 1]
position = [4, 0, 2]
[[joint]]
name = "slew"
kind = "hinge"
a = "tower"
b = "jib"
point = [0, 0, 10]
axis = [0, 0, 1]
bend = 1e-9
angle_reference = 6.5
motor = { position = 6.5, force_limit = 1e5, compliance = 1e-6, damping = 0.2 }
[[joint]]
name = "rail"
kind = "slider"
a = "jib"
b = "trolley"
point_a = [0, 0, -10]
point_b = [0, 0, 0]
axis = [1, 0, 0]
across = 2e-8
across_damping = 0.3
motor = { speed = 0.5 }
[[massless_cable]]
name = "rope"
through = [{ body = "trolley" }, { body = "hook" }]
length = 7
stretch = 1e-6
winch = { speed = -0.25, force_limit = 4000, brake_limit = 9e3, longest = 30 }
[[control]]
name = "hoist_speed"
drives = [{ joint = "rope", gain = -2.0 }, { joint = "rail" }]
"#;

const FAULTS: &str = r##"
    # Bodies
    position = [0, 0, 10]⏎ → velocity = [0, 0, 1]⏎ → line 5, column 1: body `tower`: velocity is 1 … 0 for a static body … make it driven
    position = [0, 0, 10]⏎ → angular_velocity = [0, 0, nan]⏎ → line 5, column 1: body `tower`: angular_velocity is NaN … finite
    "driven" → "dynamic" → line 6, column 1: body `ship`: mass … give it in kg … static or driven
    "driven" → "drifting" → line 8, column 12 … key `mobility` … `static` … `driven`
    length = 20 → length = -20 → line 14, column 24: body `jib` … > 0 m
    # Hinges and sliders
    b = "jib" → b = "ship" → line 31, column 1: joint `slew` … (key `b`) … make one side a dynamic body
    axis = [1, 0, 0] → axis = [0, 0, 0] → line 44, column 1: joint `rail`: axis … no direction … not zero
    bend = 1e-9 → twist = 1e-9 → line 34, column 1: joint `slew`: twist … remove it … motor
    bend = 1e-9 → across = 1e-9 → line 34, column 1: joint `slew`: across … "slider"
    bend = 1e-9 → rotation = 1e-9 → line 34, column 1: joint `slew`: rotation … use bend
    6.5⏎motor → inf⏎motor → line 35, column 1: joint `slew`: angle_reference is inf … finite
    across = 2e-8 → ea = 2e8 → line 45, column 1: joint `rail`: ea … use rotation and across
    across = 2e-8 → across = -2e-8 → line 45, column 1: joint `rail`: across: compliance is - … 0 is rigid
    across = 2e-8 → angle_reference = 1 → line 45, column 1: joint `rail`: angle_reference … "hinge"
    across_damping = 0.3 → across_damping = -0.3 → line 46, column 1: joint `rail`: across_damping is -0.3 … ≥ 0 s
    kind = "hinge" → kind = "cosserat" → line 35, column 1: joint `slew`: angle_reference … "hinge"
    kind = "slider" → kind = "lock" → line 45, column 1: joint `rail`: across … "slider"
    # Motors
    { speed = 0.5 } → { speed = 0.5, position = 1 } → line 47, column 11: joint `rail`: motor.speed … excludes motor.position … give one
    { speed = 0.5 } → { force_limit = 5 } → line 47, column 1: joint `rail`: motor … speed or position … give one
    { speed = 0.5 } → { speed = nan } → line 47, column 11: joint `rail`: motor.speed is NaN … finite
    { position = 6.5, → { position = inf, → line … joint `slew`: motor.position is inf … finite
    { speed = 0.5 } → { velocity = 0.5 } → line 47, column 11 … `velocity` … `speed`
    force_limit = 1e5 → force_limit = -1e5 → line 36, column 27: joint `slew`: motor.force_limit is -100000 … ≥ 0 N or N m … leave it out
    compliance = 1e-6 → compliance = -1e-6 → line 36, column 46: joint `slew`: motor.compliance … 0 is rigid
    damping = 0.2 → damping = -0.2 → line 36, column 65: joint `slew`: motor.damping is -0.2 … ≥ 0 s
    [[massless_cable]] → [[joint]]⏎name = "weld"⏎kind = "lock"⏎a = "world"⏎b = "jib"⏎point = [0, 0, 0]⏎motor = { speed = 1 }⏎[[massless_cable]] → line 54, column 1: joint `weld`: motor … "hinge" or "slider"
    # Winches
    longest = 30 → longest = 3, shortest = 4 → line 53, column 65: massless cable `rope`: winch.longest is 3 … ≥ winch.shortest … leave it out
    longest = 30 → shortest = 0 → line 53, column 65: massless cable `rope`: winch.shortest is 0 … > 0 m … hauling in
    force_limit = 4000 → force_limit = -4e3 → line … massless cable `rope`: winch.force_limit is -4000 … ≥ 0 N
    speed = -0.25 → speed = nan → line … massless cable `rope`: winch.speed is NaN … finite
    longest = 30 → since = nan → line … massless cable `rope`: winch.since is NaN … finite
    velocity = [0.5, 0, 0] → velocity = [inf, 0, 0] → line … body `ship`: velocity is inf … finite
    a = "tower"⏎b = "jib" → a = "tower"⏎b = "ship" → line … make one side a dynamic body
    brake_limit = 9e3 → brake_limit = -9e3 → line 53, column 46: massless cable `rope`: winch.brake_limit is -9000 … ≥ 0 N … leave it out
    brake_limit = 9e3 → brake = 1 → line 53 … key `brake` … boolean
    { body = "trolley" }, { body = "hook" } → { body = "tower" }, { body = "ship" } → line 50, column 1 … `rope` … make one side a dynamic body
    # Controls
    joint = "rope" → joint = "rop" → line 56, column 13: control `hoist_speed`: drives names `rop` … choose one of rail, rope … joint
    joint = "rail" → joint = "slew" → line 56, column 46: control `hoist_speed`: drives.1.joint … neither a motor with a speed nor a winch … name one
    motor = { speed = 0.5 }⏎ →  → line 55, column 46: control `hoist_speed`: drives.1.joint … give it one
    gain = -2.0 → gain = nan → line 56, column 29: control `hoist_speed`: drives.0.gain is NaN … finite
    [[control]] → [[control]]⏎name = "hoist_speed"⏎drives = []⏎[[control]] → line 58, column 1: two control entries … `hoist_speed` … rename … name
"##;

#[test]
fn the_crane_is_what_its_text_says() {
    let scene = built(CRANE);
    let tower = Body::fixed().at(Vector3::z() * 10.0);
    assert_eq!(scene.bodies.get(0), tower);
    assert_eq!(scene.bodies.mobility[1], Mobility::Driven);
    // Its mass is that of a fixed body: 1 kg.
    let ship = Body::cuboid(Vector3::new(9.0, 3.0, 2.0), 1.0);
    assert_eq!(scene.bodies.inertia[1], ship.inertia);
    assert_eq!(scene.bodies.inertia[2], Body::rod(20.0, 0.4, 900.0).inertia);
    let Constraint::Hinge(slew) = &scene.constraints[0] else {
        panic!("{:?}", scene.constraints[0]);
    };
    let motor = Motor {
        target: Target::Position(6.5),
        force_limit: 1e5,
        law: RowLaw::new(1e-6, 0.2),
    };
    assert_eq!(slew.motor, Some(motor));
    assert_eq!((slew.stretch, slew.tilt.compliance), (RowLaw::RIGID, 1e-9));
    assert_eq!(slew.angle_reference, 6.5);
    let upwards = axes_along(&Vector3::z()).expect("a direction");
    assert_eq!(slew.frames[0].axes, upwards);
    let Constraint::Slider(rail) = &scene.constraints[1] else {
        panic!("{:?}", scene.constraints[1]);
    };
    assert_eq!(rail.motor, Some(Motor::speed(0.5)));
    assert_eq!(
        (rail.rotation, rail.across),
        (RowLaw::RIGID, RowLaw::new(2e-8, 0.3))
    );
    // Along the jib, whose z axis is along the world's x.
    assert!((rail.frames[0].axes.column(0) - Vector3::z()).norm() < 1e-15);
    let Constraint::MasslessCable(rope) = &scene.constraints[2] else {
        panic!("{:?}", scene.constraints[2]);
    };
    let winch = Winch::new()
        .with(|w| (w.speed, w.force_limit, w.brake_limit) = (-0.25, 4000.0, 9000.0))
        .with(|w| w.longest = 30.0);
    assert_eq!((rope.winch, rope.tension_only), (Some(winch), true));
    let drive = |constraint, gain| Drive { constraint, gain };
    assert_eq!(scene.controls[0].name, "hoist_speed");
    assert_eq!(scene.controls[0].drives, [drive(2, -2.0), drive(1, 1.0)]);
}

#[test]
fn limits_left_out_and_infinite_ones_are_none() {
    let text = CRANE.replace("force_limit = 4000", "force_limit = inf");
    let open = CRANE.replace("force_limit = 4000, ", "");
    assert_eq!(built(&text), built(&open));
    let scene = built(&open);
    let text = SceneText::from_scene(&scene).expect("a text");
    let toml = SceneSource::Explicit(Box::new(text)).to_toml();
    assert!(!toml.expect("writes").contains("inf"));
    let still = CRANE.replace(
        "{ speed = -0.25, force_limit = 4000, brake_limit = 9e3, longest = 30 }",
        "{}",
    );
    let Constraint::MasslessCable(rope) = &built(&still).constraints[2] else {
        panic!("a cable");
    };
    assert_eq!(rope.winch, Some(Winch::new()));
}

#[test]
fn groups_are_those_of_the_topology_unless_an_entry_gives_one() {
    // A second pair of bodies, and a second rope that closes a loop.
    let more = r#"
[[body]]
name = "bob"
mass = 1
inertia = [1, 1, 1]
position = [9, 9, 0]
[[massless_cable]]
name = "far"
through = [{ body = "world", point = [9, 9, 9] }, { body = "bob" }]
length = 9
stretch = 0
[[massless_cable]]
name = "loop"
through = [{ body = "jib" }, { body = "hook" }]
length = 12
stretch = 0
"#;
    let text = format!("{CRANE}{more}");
    let scene = built(&text);
    let mut again = scene.clone();
    again.group_by_topology();
    assert_eq!(scene.groups, again.groups);
    assert_eq!(scene.groups, [0, 0, 0, 1, 2]);
    let text = text.replace("kind = \"slider\"", "kind = \"slider\"\ngroup = 7");
    assert_eq!(built(&text).groups, [0, 7, 0, 0, 0]);
    // Written groups are kept, even where all are 0.
    let mut flat = scene;
    flat.groups.fill(0);
    let text = SceneText::from_scene(&flat).expect("a text");
    assert_eq!(text.build().expect("builds").groups, [0; 5]);
}

#[test]
fn faults_name_line_key_and_cure() {
    built(CRANE);
    check_faults(CRANE, FAULTS);
}

#[test]
fn overrides_of_what_moves() {
    let set = [
        ("joint.rail.motor.speed", "0.75"),
        ("control.hoist_speed.drives.0.gain", "3"),
        ("massless_cable.rope.winch.brake", "true"),
        ("body.tower.mobility", "driven"),
    ];
    let scene = SceneSource::parse(CRANE, &set).and_then(|s| s.build());
    let scene = scene.expect("builds");
    assert_eq!(
        scene.constraints[1].motor().copied(),
        Some(Motor::speed(0.75))
    );
    assert_eq!(scene.controls[0].drives[0].gain, 3.0);
    assert_eq!(scene.bodies.mobility[0], Mobility::Driven);
    assert_eq!(scene.bodies.inertia[0], Matrix3::identity());
    let text = fault(CRANE, &[("joint.slew.motor.force_limit", "-1")]);
    says(
        &text,
        "override `joint.slew.motor.force_limit`: joint `slew`",
    );
}
