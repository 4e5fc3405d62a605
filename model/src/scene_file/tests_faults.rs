//! Faulty explicit texts: every message is one line that starts with the line at fault, names the key and says the cure.

use super::SceneSource;
use super::testing::{built, check_faults, fault, says};

const CRANE: &str = r#"name = "crane"
gravity = [0, 0, -9.81]
load = "hook"
order = ["link", "main", "stiff"]

[[body]]
name = "hook"
mass = 50
shape = { box = { size = [0.2, 0.2, 0.3] } }
position = [0, 0, -2]
velocity = [0, 0, -1]

[[body]]
name = "bob"
mass = 10
inertia = [1, 2, 2.5]
position = [0, 0, -3]
orientation = [0.6, 0, 0.8, 0]

[[massless_cable]]
name = "main"
through = [
  { body = "world", point = [-1.5, 0, 0] },
  { body = "hook", point = [0, 0, 0.15] },
  { body = "world", point = [1.5, 0, 0], motion = { smooth = { displacement = [0.5, 0, 0], duration = 2 } } },
]
length = 4.8
ea = 1e6

[[joint]]
name = "link"
kind = "cosserat"
a = "hook"
b = "bob"
point_a = [0, 0, -0.15]
point_b = [0, 0, 0.1]
axes_a = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
stretch = 1e-6
bend = 1e-3
damping = 0.1

[[bend]]
name = "stiff"
through = [{ body = "world" }, { body = "hook" }, { body = "bob" }]
bend = 1e-3
"#;

const FAULTS: &str = r##"
    # Reading
    mass = 50 → mas = 50 → line 8, column 1 … `mas` … expected one of … `mass`
    mass = 50⏎ →  → line 6, column 1 … body `hook`: mass: is missing … give it in kg
    mass = 50 → mass = "heavy" → line 8, column 8 … key `mass` … expected f64
    mass = 50 → mass = 50⏎mass = 51 → line 9, column 1 … `mass` is there twice … remove one
    mass = 50 → mass = = 50 → line 8
    "cosserat" → "weld" → line 32, column 8 … key `kind` … `cosserat`
    velocity = [0, 0, -1] → velocity = [0, 0] → line 11, column 12 … key `velocity` … 3
    { body = "bob" } → { bod = "bob" } → line 44 … `bod` … expected one of `body`
    [[joint]] → [joint] → line 30, column 1: `joint` is a list … write [[joint]]
    [[joint]] → [ground]⏎name = "floor"⏎[[joint]] → line 30, column 1: `ground` is a list … write [[ground]]
    order = → collider = { name = "wall" }⏎order = → line 4, column 12: `collider` is a list … write [[collider]]
    # Bodies
    mass = 50 → mass = -50 → line 8, column 1: body `hook`: mass is -50 … > 0 kg
    [0.2, 0.2, 0.3] → [0.2, 0.2, 0] → line 9, column 19: body `hook`: shape.box.size … > 0 m
    [1, 2, 2.5] → [1, 2, -2.5] → line 16, column 1 … inertia … positive principal moments
    [0.6, 0, 0.8, 0] → [0.7, 0, 0.8, 0] → line 18, column 1 … orientation … unit quaternion
    orientation = → rotation = [0, 1, 0]⏎orientation = → line … excludes rotation
    inertia = → shape = { sphere = { radius = 1 } }⏎inertia = → line 17, column 1 … inertia … exactly one
    name = "bob" → name = "hook" → line 14, column 1: two body entries … `hook` … rename … name
    name = "bob" → name = "world" → line 14, column 1 … name … take another
    position = [0, 0, -2] → position = [0, 0, inf] → line 10, column 1 … position is inf … finite
    # Joints
    b = "bob" → b = "bbo" → line 34, column 1 … key `b` … choose one of hook, bob
    b = "bob" → b = "hook" → line 34, column 1 … key `b` … make one side another body
    [[1, 0, 0], [0, 1, 0] → [[1, 0, 0], [0, 2, 0] → line 37, column 1 … axes_a … orthonormal … unit columns
    stretch = 1e-6 → stretch = -1e-6 → line 38, column 1 … stretch: compliance is - … 0 is rigid
    stretch = 1e-6 → stretch = 0⏎transverse = true → line … transverse: needs kind
    stretch = 1e-6 → stretch = 0⏎motion = { circle = { radius = 1, period = 2, ramp = 2 } } → line … moves the world side
    a = "hook"⏎b = "bob" → a = "world"⏎b = "world" → line … the world to the world
    stretch = 1e-6 → ea = 1e6 → line 38, column 1: joint `link`: ea … needs length
    damping = 0.1 → damping = -0.1 → line 40, column 1 … damping is -0.1 … ≥ 0 s
    "cosserat" → "distance" → line 32, column 1 … kind … cosserat
    bend = 1e-3⏎damping → rotation = 1⏎damping → line 39, column 1 … rotation … use bend
    stretch = 1e-6⏎bend = 1e-3⏎damping → damping → line 32, column 1 … no rows … give it … key `kind`
    point_a = [0, 0, -0.15]⏎ →  → line 35, column 1 … point … both point_a and point_b
    # Cables
    length = 4.8 → length = 0 → line 27, column 1: massless cable `main`: length is 0 … > 0 m
    ea = 1e6 → ea = -1 → line 28, column 1: massless cable `main`: ea is -1 … > 0 N
    ea = 1e6⏎ →  → line 20, column 1: massless cable `main`: stretch … give it in m/N … or ea
    ea = 1e6 → ea = 1e6⏎stretch = 0 → line 29, column 1: massless cable `main`: stretch … give one of them
    body = "hook", point → body = "hoko", point → line 24, column 5: massless cable `main` … names the body `hoko` … choose one of
    duration = 2 → duration = 0 → line 25, column 92 … (duration, period, run-up) … > 0 s
    { body = "hook", point = [0, 0, 0.15] } → { body = "world", point = [-1.5, 0, 1] } → line 22, column 1: massless cable `main`: through … ties the world to the world … put at least one point on a body
    { body = "world", point = [-1.5, 0, 0] } → { body = "hook", point = [0, 0, 0.15] } → line 24, column 20: massless cable `main`: through.1.point … in one place … move or remove
    # Bends
    { body = "world" }, { body = "hook" } → { body = "hook" } → line 44, column 1 … through … exactly 3 points
    name = "stiff" → name = "main" → line 43, column 1: two constraint entries … `main` … rename
    { body = "world" }, { → { body = "hook" }, { → line 44, column 31 … through.1.point … in one place
    # The top
    load = "hook" → load = "hok" → line 3, column 1: load … choose one of hook, bob
    -9.81] → nan] → line 2, column 1: gravity is NaN … finite
    ["link", "main" → ["link", "mian" → line 4, column 1: order: `mian` … remove it or write
    ["link", "main",  → ["link",  → line 4, column 1: order: `main` … name every constraint once
    ["link", "main" → ["link", "link", "main" → line 4, column 1: order: `link` … twice … remove one
"##;

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
fn faults_name_line_key_and_cure() {
    check_faults(CRANE, FAULTS);
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
    let text = fault(
        &CRANE.replacen("mass = 50", "mass = -50", 1),
        &[("load", "bob")],
    );
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
