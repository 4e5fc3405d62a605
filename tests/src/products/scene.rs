//! Choices as a scene file.

use super::{Choices, End, Form, G, Other, Rope};
use crate::prelude::*;
use std::fmt::Write;

/// Half of a body's height \[m].
fn half(form: Form) -> f64 {
    match form {
        Form::Ball => 0.25,
        Form::Block => 0.2,
        Form::Disc => 0.15,
    }
}

fn shape(form: Form) -> &'static str {
    match form {
        Form::Ball => "{ sphere = { radius = 0.25 } }",
        Form::Block => "{ box = { size = [0.6, 0.5, 0.4] } }",
        Form::Disc => "{ cylinder = { length = 0.3, radius = 0.4 } }",
    }
}

/// Thickness of a turntable \[m].
const TABLE: f64 = 0.2;

/// Radius of sheaves and drums \[m].
const WHEEL: f64 = 0.2;

/// Where things are \[m], world.
struct Places {
    load: [f64; 3],
    under: Option<[f64; 3]>,
    /// A point of the ground, and its normal.
    ground: [f64; 3],
    normal: [f64; 3],
    /// Points where the rope holds the load, and from which it hangs.
    held: [f64; 3],
    hub: [f64; 3],
}

fn along(from: [f64; 3], by: f64, way: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| from[k] + by * way[k])
}

fn places(c: &Choices) -> Places {
    let slope = c.ground.map_or(0.0, |g| g.slope);
    let normal = [slope.sin(), 0.0, slope.cos()];
    let height = half(c.load.form);
    let mut load = [0.0; 3];
    let mut under = None;
    let mut low = height;
    match c.other {
        Some(Other::Under { form, off, gap, .. }) => {
            let centre = along(load, -(height + gap + half(form)), normal);
            under = Some(along(centre, off, [0.0, 1.0, 0.0]));
            low += gap + 2.0 * half(form);
        }
        Some(Other::Turntable { radius, .. }) => {
            under = Some([-radius, 0.0, -height - 0.5 * TABLE]);
            low += TABLE + 1.0;
        }
        None => {}
    }
    // A body that is turned reaches as far as the ball about it.
    if c.load.turned != [0.0; 2] {
        let more = [0.3_f64, 0.25, 0.2].iter().map(|x| x * x).sum::<f64>();
        let more = more.sqrt().max(0.43) - height;
        load = along(load, more, normal);
    }
    let ground = along([0.0; 3], -low - c.ground.map_or(0.0, |g| g.below), normal);
    let held = along(load, height, [0.0, 0.0, 1.0]);
    let mut hub = held;
    if let Some(rope) = &c.rope {
        let (sin, cos) = rope.aside.sin_cos();
        hub = along(hub, rope.length, [-sin, 0.0, cos]);
        if rope.sheave.is_some() || matches!(rope.end, End::Drum(_)) {
            hub[0] -= WHEEL;
        }
    }
    Places {
        load,
        under,
        ground,
        normal,
        held,
        hub,
    }
}

/// Where the rope hangs from \[m], world.
pub(super) fn hub(c: &Choices) -> Vector3<f64> {
    Vector3::from(places(c).hub)
}

fn surface(c: &Choices) -> String {
    format!(
        "friction = {:?}, restitution = {:?}",
        c.friction, c.restitution
    )
}

/// The scene as text, its rope as long as its path and slack ask for.
///
/// # Errors
/// Where the model refuses it.
pub fn toml(c: &Choices) -> Result<String, SceneError> {
    let Some(rope) = c.rope.as_ref().filter(|rope| rope.segments.is_none()) else {
        return Ok(text(c, 0.0));
    };
    // Slack on any path: a rope that is too short is refused.
    let guess = 100.0;
    let scene = SceneSource::parse(&text(c, guess), &[])?.build()?;
    let mut rows = Linearized::new(&scene);
    rows.update(&scene, 0.0);
    let is_rope = |k: &usize| matches!(scene.constraints[*k], Constraint::MasslessCable(_));
    let parts = (0..scene.constraints.len()).filter(is_rope);
    let over: f64 = parts.map(|k| rows.phi[rows.row_range(k).start]).sum();
    let weight = if c.gravity {
        c.weight().min(1e12 * G)
    } else {
        0.0
    };
    let extra = match rope.slack > 0.0 {
        true => rope.slack,
        false => -compliance(c, rope) * weight * rope.aside.cos(),
    };
    Ok(text(c, guess + over + extra))
}

/// The scene itself.
///
/// # Errors
/// Where the model refuses it.
pub(super) fn build(c: &Choices) -> Result<Scene, SceneError> {
    SceneSource::parse(&toml(c)?, &[])?.build()
}

fn text(c: &Choices, length: f64) -> String {
    let at = places(c);
    let mut out = format!("# {:?}\n", c.steps);
    bodies(c, &at, &mut out);
    if let Some(ground) = c.ground {
        let (point, normal) = (at.ground, at.normal);
        let kept = if ground.slope == 0.0 {
            [0.0, 0.0, 1.0]
        } else {
            normal
        };
        let _ = write!(
            out,
            "[[ground]]\nname = \"ground\"\npoint = {point:?}\nnormal = {kept:?}\nfriction = {:?}\nrestitution = {:?}\n",
            c.friction, c.restitution
        );
    }
    if let Some(rope) = &c.rope {
        if rope.segments.is_some() {
            segments(c, rope, &at, &mut out);
        } else {
            massless(c, rope, &at, length, &mut out);
        }
        winch_events(rope, &mut out);
    }
    events(c, &at, &mut out);
    out
}

fn bodies(c: &Choices, at: &Places, out: &mut String) {
    let gravity = if c.gravity { -G } else { 0.0 };
    let (load, surface) = (&c.load, surface(c));
    let (mut velocity, mut spin) = (load.velocity, load.spin);
    if let Some(Other::Turntable { rate, radius }) = c.other {
        (velocity, spin) = ([0.0, rate * radius, 0.0], [0.0, 0.0, rate]);
    }
    let slope = c.ground.map_or(0.0, |g| g.slope);
    let turned = [load.turned[1], load.turned[0] + slope, 0.0];
    let _ = write!(
        out,
        "load = \"load\"\ngravity = [0, 0, {gravity:?}]\n[[body]]\nname = \"load\"\nmass = {:?}\nshape = {}\n\
         position = {:?}\nrotation = {turned:?}\nvelocity = {velocity:?}\nangular_velocity = {spin:?}\n\
         collide = {{ {surface} }}\n",
        load.mass,
        shape(load.form),
        at.load
    );
    match (c.other, at.under) {
        (Some(Other::Under { form, ratio, .. }), Some(centre)) => {
            let _ = write!(
                out,
                "[[body]]\nname = \"under\"\nmass = {:?}\nshape = {}\nposition = {centre:?}\n\
                 rotation = [0, {slope:?}, 0]\ncollide = {{ {surface} }}\n",
                ratio * load.mass,
                shape(form)
            );
        }
        (Some(Other::Turntable { rate, radius }), Some(centre)) => {
            let wide = radius + 2.0;
            let _ = write!(
                out,
                "[[body]]\nname = \"table\"\nmobility = \"driven\"\nposition = {centre:?}\n\
                 shape = {{ cylinder = {{ length = {TABLE}, radius = {wide:?} }} }}\n\
                 angular_velocity = [0, 0, {rate:?}]\ncollide = {{ {surface} }}\n"
            );
        }
        _ => {}
    }
}

/// Compliance of the rope \[m/N].
fn compliance(c: &Choices, rope: &Rope) -> f64 {
    rope.strain * rope.length / (G * c.load.mass.min(1e12))
}

fn massless(c: &Choices, rope: &Rope, at: &Places, length: f64, out: &mut String) {
    let (hub, height) = (at.hub, half(c.load.form));
    let wheel = |extra: &str| format!("sheave = {{ radius = {WHEEL}, axis = [0, 1, 0]{extra} }}");
    let far = along(hub, -3.0, [1.0, 0.0, 0.0]);
    let drum = if rope.sheave.is_some() { far } else { hub };
    let mut through = match rope.end {
        End::World if rope.sheave.is_none() => format!("{{ body = \"world\", point = {hub:?} }}, "),
        End::World => format!("{{ body = \"world\", point = {far:?} }}, "),
        End::Counterweight(_) => "{ body = \"counter\" }, ".to_owned(),
        End::Drum(_) => {
            let wheel = format!("sheave = {{ radius = {WHEEL}, axis = [0, 0, -1], turns = 3.25 }}");
            format!("{{ body = \"drum\", {wheel} }}, ")
        }
    };
    if let Some(friction) = rope.sheave {
        let _ = write!(
            through,
            "{{ body = \"world\", point = {hub:?}, {} }}, ",
            wheel(&format!(", friction = {friction:?}"))
        );
    }
    match rope.end {
        End::Counterweight(ratio) => {
            let mut centre = hub;
            if rope.sheave.is_some() {
                centre = along(hub, -0.5 * rope.length, [0.0, 0.0, 1.0]);
                centre[0] -= WHEEL;
            }
            let _ = write!(
                out,
                "[[body]]\nname = \"counter\"\nmass = {:?}\nshape = {{ sphere = {{ radius = 0.15 }} }}\n\
                 position = {centre:?}\n",
                ratio * c.load.mass
            );
        }
        End::Drum(speed) => {
            let _ = write!(
                out,
                "[[body]]\nname = \"drum\"\nmass = {:?}\nshape = {{ cylinder = {{ length = 1, radius = {WHEEL} }} }}\n\
                 position = {drum:?}\nrotation = [1.5707963267948966, 0, 0]\n\
                 [[joint]]\nname = \"axle\"\nkind = \"hinge\"\na = \"world\"\nb = \"drum\"\npoint = {drum:?}\n\
                 axis = [0, 1, 0]\nmotor = {{ speed = {speed:?} }}\n",
                0.2 * c.load.mass
            );
        }
        End::World => {}
    }
    let _ = write!(
        out,
        "[[massless_cable]]\nname = \"rope\"\nthrough = [{through}{{ body = \"load\", point = [0, 0, {height:?}] }}]\n\
         length = {length:?}\nstretch = {:?}\ndamping = {:?}\n",
        compliance(c, rope),
        rope.damping
    );
    rest_of_rope(c, rope, length, out);
}

fn segments(c: &Choices, rope: &Rope, at: &Places, out: &mut String) {
    let ea = c.weight() / rope.strain.max(1e-6);
    let _ = write!(
        out,
        "[[cable]]\nname = \"rope\"\nfrom = {{ body = \"world\", point = {:?} }}\n\
         to = {{ body = \"load\", point = [0, 0, {:?}] }}\nsegments = {}\nea = {ea:?}\nei = {:?}\ngj = {:?}\n\
         mass_per_length = {:?}\ndamping = {:?}\n",
        at.hub,
        half(c.load.form),
        rope.segments.unwrap_or(1),
        1e-5 * ea,
        1e-5 * ea,
        1e-3 * c.load.mass,
        rope.damping
    );
    let _ = at.held;
    rest_of_rope(c, rope, rope.length, out);
}

/// Keys that both kinds of rope have.
fn rest_of_rope(c: &Choices, rope: &Rope, length: f64, out: &mut String) {
    let weight = c.weight();
    if let Some(times) = rope.breaks {
        let _ = writeln!(out, "breaks_at = {:?}", times * weight);
    }
    if let Some(winch) = rope.winch {
        let mut keys = vec!["since = 0".to_owned()];
        if let Some(times) = winch.force {
            keys.push(format!("force_limit = {:?}", times * weight));
        }
        if let Some(times) = winch.brake {
            keys.push(format!("brake = true, brake_limit = {:?}", times * weight));
        }
        if let Some(range) = winch.range {
            let (least, most) = ((length - range).max(0.1), length + range);
            keys.push(format!("shortest = {least:?}, longest = {most:?}"));
        }
        let _ = writeln!(out, "winch = {{ {} }}", keys.join(", "));
    }
}

/// The speeds of a winch, each for a third of the time.
fn winch_events(rope: &Rope, out: &mut String) {
    let Some(winch) = rope.winch.filter(|w| w.speeds != [0.0; 3]) else {
        return;
    };
    out.push_str("[[control]]\nname = \"hoist\"\ndrives = [{ joint = \"rope\" }]\n");
    for (k, speed) in winch.speeds.iter().enumerate() {
        let time = 0.1 + 0.6 * k as f64;
        let _ = write!(
            out,
            "[[event]]\nname = \"turn-{k}\"\nat = {time:?}\nset = [{{ control = \"hoist\", value = {speed:?} }}]\n"
        );
    }
}

fn events(c: &Choices, at: &Places, out: &mut String) {
    if let Some([made, gone]) = c.attach {
        // Bodies on the ground move away from the place where the link would press them against it.
        let point = along(at.load, 1.0, [0.2, 0.0, 1.0]);
        let _ = write!(
            out,
            "[[event]]\nname = \"catch\"\nat = {made:?}\nattach = [{{ name = \"link\", a = {{ body = \"world\", \
             point = {point:?} }}, b = {{ body = \"load\" }} }}]\n[[event]]\nname = \"drop\"\nat = {gone:?}\n\
             release = [\"link\"]\n"
        );
    }
    if let Some(time) = c.release {
        let joint = match c.rope.as_ref().and_then(|r| r.segments) {
            Some(_) => "rope-end",
            None => "rope",
        };
        let _ = write!(
            out,
            "[[event]]\nname = \"let go\"\nat = {time:?}\nrelease = [\"{joint}\"]\n"
        );
    }
}
