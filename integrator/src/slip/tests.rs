use crate::testing::*;
use std::f64::consts::PI;

pub(super) const G: f64 = 9.81;
pub(super) const R: f64 = 0.2;
pub(super) const DT: f64 = 1.0 / 60.0;

pub(super) fn xz(x: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, 0.0, z)
}

/// Two masses over a sheave, locked or a wheel of some inertia (kg m²).
fn atwood(masses: [f64; 2], friction: f64, wheel: Option<f64>, law: RowLaw) -> Scene {
    let length = Some(8.0 + R * PI);
    hung_over(masses, xz(R, -4.0), length, friction, wheel, law)
}

/// [`atwood`] with a place for the heavy mass, and a length of the rope that is its way if none is given.
fn hung_over(
    masses: [f64; 2],
    place: Vector3<f64>,
    length: Option<f64>,
    friction: f64,
    wheel: Option<f64>,
    law: RowLaw,
) -> Scene {
    let mut scene = on_earth("atwood");
    let hub = match wheel {
        None => origin(),
        Some(inertia) => {
            let body = Body::new(5.0, Matrix3::from_diagonal(&Vector3::repeat(inertia)));
            let wheel = scene.add_body("wheel", body);
            let axes = axes_along(&Vector3::y()).unwrap();
            let frames = [origin(), centre(wheel)];
            let frames = frames.map(|f| f.with_axes(axes));
            let axle = Hinge::new(frames).with(|p| (p.stretch, p.tilt) = (law, law));
            scene.add_constraint("axle", axle, 0);
            centre(wheel)
        }
    };
    let mut hang = |name: &str, mass: f64, at: Vector3<f64>| {
        let body = scene.add_body(name, Body::particle(mass).at(at));
        centre(body)
    };
    // From the light one over the wheel to the heavy one.
    let frames = vec![
        hang("light", masses[1], xz(-R, -4.0)),
        hub.along(&Vector3::y()),
        hang("heavy", masses[0], place),
    ];
    let mut cable = over(sheave(friction, R), frames, 1.0, law);
    cable.length = length.unwrap_or_else(|| cable_length(&scene, &cable));
    scene.reeve("rope", &cable, 0).unwrap();
    scene
}

pub(super) fn options() -> StepOptions {
    StepOptions::default().with(|o| o.dt = DT)
}

/// Downwards acceleration of the last body in each step of 2 s, from its velocities.
fn accelerations(scene: Scene, options: StepOptions) -> Vec<f64> {
    let mut stepper = Stepper::new(scene, options).unwrap();
    let last = stepper.scene().bodies.len() - 1;
    stepper.begin().unwrap();
    let mut before = stepper.scene().bodies.velocity[last].z;
    (0..120)
        .map(|_| {
            stepper.step().unwrap();
            let now = stepper.scene().bodies.velocity[last].z;
            let a = -(now - before) / stepper.step.options.dt;
            before = now;
            a
        })
        .collect()
}

fn assert_all(found: &[f64], exact: f64, bar: f64, what: &str) {
    for (i, a) in found.iter().enumerate() {
        let off = (a - exact).abs();
        assert!(off <= bar, "{what}, step {i}: {a:.12}, not {exact:.12}");
    }
}

#[test]
fn a_wheel_that_sticks_turns_with_the_cable() {
    // Rigid rows without damping ring in the trapezoidal scheme.
    for (scheme, damping) in [
        (Scheme::THIRD_DIFFERENCE, 0.0),
        (Scheme::Spook, 2.5 * DT),
        (Scheme::LinearlyImplicit, 0.0),
    ] {
        let law = RowLaw::new(0.0, damping);
        let scene = atwood([3.0, 2.0], 100.0, Some(0.05), law);
        let found = accelerations(scene, options().with(|o| o.scheme = scheme));
        let exact = G / (5.0 + 0.05 / (R * R));
        assert_all(&found, exact, 1e-8, &scheme.to_string());
    }
}

#[test]
fn a_locked_sheave_holds_up_to_the_capstan_ratio_and_then_slips() {
    let k: f64 = (0.3 * PI).exp();
    assert!((k - 2.566_332_395).abs() < 1e-9);
    for form in [Form::Schur, Form::Kkt] {
        for scheme in Scheme::KINDS {
            let options = options().with(|o| (o.scheme, o.form) = (scheme, form));
            let slips = |heavy: f64| {
                let scene = atwood([heavy, 1.0], 0.3, None, RowLaw::RIGID);
                accelerations(scene, options.clone())
            };
            assert_all(&slips(2.56), 0.0, 1e-12, "2.56 : 1");
            let exact = G * (3.0 - k) / (3.0 + k);
            assert!((exact - 0.764_287_667_5).abs() < 1e-10);
            assert_all(&slips(3.0), exact, 1e-8, "3 : 1");
        }
    }
}

/// A block of mass `mass` that hangs in `falls` falls over locked sheaves, and a hand that holds the end.
pub(super) fn tackle(falls: usize, mass: f64, hand: f64, friction: f64, ea: f64) -> Scene {
    let (drop, radius) = (4.0, 0.1);
    let mut scene = on_earth("tackle");
    let size = Vector3::new(2.0, 0.3, 0.3);
    let block = scene.add_body("block", Body::cuboid(size, mass).at(xz(0.0, -drop)));
    scene.load = Some(block);
    // A rail, or it would rock.
    let frames = [origin(), centre(block)];
    let rail = Slider::new(frames.map(|f| f.along(&Vector3::z())));
    scene.add_constraint("rail", rail, 0);
    // Vertical falls 2 r apart: fast on block or beam, then over a sheave at each end in turns, and down to the hand.
    let middle = 0.5 * (2 * falls - 1) as f64 * radius;
    let x = |fall: usize| 2.0 * radius * fall as f64 - middle;
    let top = |point: Vector3<f64>| Frame::world(point);
    let bottom = |point: Vector3<f64>| Frame::body(block, point);
    let starts_below = falls % 2 == 1;
    let mut frames = Vec::new();
    let mut sheaves = Vec::new();
    let start = xz(x(0), 0.0);
    frames.push(if starts_below {
        bottom(start)
    } else {
        top(start)
    });
    sheaves.push(None);
    for fall in 0..falls {
        let is_top = (fall % 2 == 0) == starts_below;
        let hub = xz(x(fall) + radius, 0.0);
        // Over the upper ones in the sense of y, under the lower ones against it.
        let sense = if is_top { 1.0 } else { -1.0 };
        let frame = if is_top { top(hub) } else { bottom(hub) };
        frames.push(frame.along(&(Vector3::y() * sense)));
        sheaves.push(Some(sheave(friction, radius)));
    }
    let held = scene.add_body("hand", Body::particle(hand).at(xz(x(falls), -2.0)));
    frames.push(centre(held));
    sheaves.push(None);
    let length = drop * falls as f64 + 2.0 + PI * radius * falls as f64;
    let cable = MasslessCable::new(frames, length, RowLaw::new(length / ea, 0.1))
        .with(|p| p.sheaves = sheaves);
    scene.reeve("rope", &cable, 0).unwrap();
    scene
}

/// Tensions of all parts \[N].
pub(super) fn tensions(stepper: &Stepper) -> Vec<f64> {
    let parts = stepper.scene().constraints.iter().enumerate();
    let parts = parts.filter(|(_, c)| matches!(c, Constraint::MasslessCable(_)));
    let row = |c: usize| stepper.linearized().row_range(c).start;
    let of = |(c, _)| -stepper.multipliers()[row(c)] / stepper.step.multipliers.mu_dt;
    parts.map(of).collect()
}

#[test]
fn tackles_over_locked_sheaves_carry_what_friction_leaves() {
    let k: f64 = (0.1 * PI).exp();
    for (falls, exact) in [(2, 1.263_890_783), (4, 1.938_161_463), (8, 2.489_780_712)] {
        let sum: f64 = (1..=falls).map(|i| k.powi(-(i as i32))).sum();
        assert!((sum - exact).abs() < 1e-9);
        // The hand, falling, hauls the block up: all sheaves slip.
        let scene = tackle(falls, 100.0, 1000.0, 0.1, 1e7);
        let mut stepper = Stepper::new(scene, options()).unwrap();
        for step in 0..60 {
            // The hubs are beside the rail: wraps change a little with rounding alone.
            let wraps: Vec<f64> = (0..falls).map(|i| stepper.scene().wrap(i)).collect();
            let report = stepper.step().unwrap();
            assert_eq!(report.slipping, falls, "{falls}");
            let found = tensions(&stepper);
            for (i, wrap) in wraps.into_iter().enumerate() {
                let ratio = found[i + 1] / found[i] / (0.1 * wrap).exp();
                assert!((ratio - 1.0).abs() < 1e-12, "{falls}: {ratio}");
            }
            let carried: f64 = found[..falls].iter().sum();
            let error = carried / found[falls] / sum - 1.0;
            assert!(step > 0 || error.abs() < 1e-12, "{falls}: {found:?}");
        }
        // A load just below the limit of friction hangs still; one just above it moves.
        for (part, holds) in [(0.95, true), (1.0 / 0.95, false)] {
            let scene = tackle(falls, 100.0, 100.0 / sum * part, 0.1, 1e7);
            let mut stepper = Stepper::new(scene, options()).unwrap();
            stepper.steps(300);
            let speed = stepper.scene().bodies.velocity[0].z.abs();
            assert_eq!(speed < 1e-4, holds, "{falls}, {part}: {speed}");
        }
    }
}

/// Numbers in 0 to 1.
pub(super) struct Numbers(pub(super) u64);

impl Numbers {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Two masses and, between them, upper sheaves that are locked or turn and moving blocks, of random sizes.
pub(super) fn reeving(seed: u64) -> Scene {
    let mut numbers = Numbers(seed);
    let mut scene = on_earth("reeving");
    let count = 1 + 2 * (numbers.next() * 2.5) as usize;
    let (mut frames, mut sheaves) = (Vec::new(), Vec::new());
    let point = |scene: &mut Scene, name: &str, mass: f64, at: Vector3<f64>| {
        let body = scene.add_body(name, Body::particle(mass).at(at));
        centre(body)
    };
    frames.push(point(
        &mut scene,
        "left",
        1.0 + 9.0 * numbers.next(),
        xz(-1.0, -3.0),
    ));
    sheaves.push(None);
    for i in 0..count {
        let x = i as f64;
        let radius = 0.1 + 0.2 * numbers.next();
        let tilt = Vector3::new(0.04 * numbers.next(), 1.0, 0.04 * numbers.next());
        let is_top = i % 2 == 0;
        let axis = if is_top { tilt } else { -tilt };
        let inertia = Matrix3::from_diagonal(&Vector3::repeat(0.02 + numbers.next()));
        let mut wheel = |scene: &mut Scene, at: Vector3<f64>| {
            scene.add_body(
                format!("wheel-{i}"),
                Body::new(1.0 + 9.0 * numbers.next(), inertia).at(at),
            )
        };
        frames.push(if is_top && i % 3 == 0 {
            Frame::world(xz(x, 0.0)).along(&axis)
        } else if is_top {
            let wheel = wheel(&mut scene, xz(x, 0.0));
            let ends = [Frame::world(xz(x, 0.0)), centre(wheel)];
            let axle = Hinge::new(ends.map(|f| f.along(&axis)));
            scene.add_constraint(format!("axle-{i}"), axle, 0);
            ends[1].along(&axis)
        } else {
            let block = wheel(&mut scene, xz(x, -3.0));
            centre(block).along(&axis)
        });
        sheaves.push(Some(sheave(0.4 * numbers.next(), radius)));
    }
    frames.push(point(
        &mut scene,
        "right",
        1.0 + 9.0 * numbers.next(),
        xz(count as f64, -3.0),
    ));
    sheaves.push(None);
    let mut cable = MasslessCable::new(frames, 1.0, RowLaw::new(1e-5, 0.0));
    cable.sheaves = sheaves;
    let slack = if numbers.next() < 0.2 { 1.02 } else { 1.0 };
    cable.length = slack * cable_length(&scene, &cable);
    scene.reeve("rope", &cable, 0).unwrap();
    scene
}

pub(crate) fn cable_length(scene: &Scene, cable: &MasslessCable) -> f64 {
    let mut phi = [0.0];
    Constraint::MasslessCable(cable.clone()).violation(&scene.bodies, 0.0, &mut phi);
    phi[0] + cable.length
}

/// Length at rest of all massless cables.
pub(super) fn total_length(scene: &Scene) -> f64 {
    let of = |c: &Constraint| match c {
        Constraint::MasslessCable(cable) => cable.length,
        _ => 0.0,
    };
    scene.constraints.iter().map(of).sum()
}

/// Kinetic, gravitational and elastic energy, that of taut cables \[J].
pub(super) fn total_energy(stepper: &Stepper) -> f64 {
    let (scene, rows) = (stepper.scene(), stepper.linearized());
    let stored = rows.bounds.iter().map(|b| {
        let phi = rows.phi[b.row].max(0.0);
        0.5 * phi * phi / rows.compliance[b.row]
    });
    scene.kinetic_energy() + scene.potential_energy() + stored.sum::<f64>()
}

#[test]
fn a_saved_run_goes_on_with_the_same_bits_and_all_forms_and_solvers_agree() {
    for seed in [3, 7, 11, 20] {
        let run = |options: StepOptions| {
            let mut stepper = Stepper::new(reeving(seed), options).unwrap();
            stepper.steps(20);
            stepper
        };
        let mut whole = run(options());
        let mut restored = whole.saved();
        whole.steps(20);
        restored.steps(20);
        assert_eq!(whole.scene(), restored.scene(), "{seed}");
        assert_eq!(whole.multipliers(), restored.multipliers(), "{seed}");
        let position = |stepper: &Stepper| stepper.scene().bodies.position.clone();
        let reference = position(&run(options()));
        for backend in ["dense", "banded", "cg"] {
            for form in [Form::Schur, Form::Kkt] {
                let backend: taut_solver::Backend = backend.parse().unwrap();
                if form == Form::Kkt && backend.is_iterative() {
                    continue;
                }
                let name = format!("{seed}, {backend}, {form}");
                let found = run(options().with(|o| (o.backend, o.form) = (backend, form)));
                for (a, b) in position(&found).iter().zip(&reference) {
                    assert!((a - b).norm() < 1e-9, "{name}: {}", (a - b).norm());
                }
            }
        }
    }
}

/// Positions after stick, slip, stick under a swinging weight, with time steps that are halved.
#[test]
fn stick_and_slip_are_of_second_order() {
    let swinging = |halvings: u32, scheme: Scheme| {
        // Rigid rows without damping ring in the trapezoidal scheme.
        let damping = if scheme == Scheme::Spook { 2.5 } else { 0.0 };
        let law = RowLaw::new(0.0, damping * DT / f64::from(1 << halvings));
        // Aside and let go: the tension swings between cos and more than the weight.
        let place = xz(R + 4.0 * 0.6_f64.sin(), -4.0 * 0.6_f64.cos());
        let scene = hung_over([2.2, 1.0], place, None, 0.3, None, law);
        let mut options = options().with(|o| o.scheme = scheme);
        options.dt = DT / f64::from(1 << halvings);
        let mut stepper = Stepper::new(scene, options).unwrap();
        let mut stuck = [0, 0];
        for _ in 0..180 << halvings {
            let report = stepper.step().unwrap();
            stuck[report.slipping] += 1;
        }
        assert!(stuck.iter().all(|n| *n > 30 << halvings), "{stuck:?}");
        stepper.scene().bodies.position[1]
    };
    for scheme in [Scheme::THIRD_DIFFERENCE, Scheme::Spook] {
        let found: Vec<_> = (0..4).map(|halvings| swinging(halvings, scheme)).collect();
        let change: Vec<f64> = found.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
        let ratios = change.windows(2).map(|c| c[0] / c[1]);
        for ratio in ratios {
            assert!((3.4..4.6).contains(&ratio), "{scheme}: {change:?}");
        }
    }
}

/// A restored run keeps its friction while the guard redoes every step.
#[test]
fn a_run_that_is_taken_up_while_the_guard_holds_keeps_its_friction() {
    let mut tight = options();
    tight.guard = Some(crate::Guard::default().with(|g| g.tolerance = 1e-12));
    let mut whole = Stepper::new(reeving(7), tight).unwrap();
    whole.steps(9);
    let mut restored = whole.saved();
    for _ in 0..9 {
        assert!(whole.step().unwrap().implicit_substeps > 0);
        restored.step().unwrap();
    }
    assert_eq!(whole.scene(), restored.scene());
}

#[test]
fn a_winch_feeds_the_whole_cable_over_sheaves_that_grip_it() {
    let mut scene = tackle(2, 100.0, 50.0, 0.1, 1e7);
    // The hand's end goes to a winch instead: the cable the other way round.
    let parts: Vec<usize> = (0..scene.constraints.len())
        .filter(|&c| matches!(scene.constraints[c], Constraint::MasslessCable(_)))
        .collect();
    let total = |scene: &Scene, t: f64| -> f64 {
        let length = |c: &usize| match &scene.constraints[*c] {
            Constraint::MasslessCable(cable) => cable.length_at(t),
            _ => 0.0,
        };
        parts.iter().map(length).sum()
    };
    let whole = total(&scene, 0.0);
    if let Constraint::MasslessCable(first) = &mut scene.constraints[parts[0]] {
        first.winch = Some(taut_model::Winch {
            speed: 0.5,
            longest: first.length + 1.0,
            ..taut_model::Winch::new()
        });
    }
    let mut stepper = Stepper::new(scene, options()).unwrap();
    for step in 1..=240 {
        stepper.step().unwrap();
        let t = stepper.time();
        let fed = (0.5 * f64::from(step) / 60.0).min(1.0);
        let found = total(stepper.scene(), t) - whole;
        assert!((found - fed).abs() < 1e-9, "{step}: {found} of {fed}");
    }
    stepper.save().unwrap();
}
