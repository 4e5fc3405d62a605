//! Dampers of ropes, rods and joints whose load swings, in implicit steps.

use taut_tests::prelude::*;

/// A run of the scene `text` at 60 steps a second under this guard.
fn guarded(text: &str, guard: Guard) -> Stepper {
    let source = SceneSource::parse(text, &[]).expect("reads");
    let options = StepOptions::default().with(|o| o.guard = Some(guard));
    Stepper::new(source.build().expect("builds"), options).expect("starts")
}

/// Suspensions of 100 kg, thrown at 8 m/s on 1 m: a rod, ropes, one over a sheave, joints to the world and between two bodies, a rope
/// that a winch hauls in, and one that slips.
const THROWN: [&str; 7] = [
    "shape = 'particle'\n[[joint]]\nname = 'damped'\nkind = 'distance'\nlength = 1\na = 'world'\nb = 'load'\n\
     point_a = [0, 0, 0]\npoint_b = [0, 0, 0]\n",
    "shape = 'particle'\n[[massless_cable]]\nname = 'damped'\nlength = 1\nthrough = [{ body = 'world' }, { body = 'load' }]\n",
    "shape = 'particle'\n[[massless_cable]]\nname = 'damped'\nthrough = [{ body = 'world', point = [-1, 0, -1] }, \
     { body = 'world', sheave = { radius = 0.2, axis = [0, 1, 0] } }, { body = 'load' }]\n",
    "shape = { sphere = { radius = 0.1 } }\nangular_velocity = [0, 8, 0]\n[[joint]]\nname = 'damped'\n\
     kind = 'spherical'\na = 'world'\nb = 'load'\npoint = [0, 0, 0]\n",
    "shape = { sphere = { radius = 0.1 } }\nangular_velocity = [0, 8, 0]\n[[body]]\nname = 'hub'\nmass = 100\n\
     shape = { sphere = { radius = 0.2 } }\n[[joint]]\nname = 'axle'\nkind = 'spherical'\na = 'world'\nb = 'hub'\n\
     point = [0, 0, 0]\nstretch = 0\n[[joint]]\nname = 'damped'\nkind = 'spherical'\na = 'hub'\nb = 'load'\n\
     point = [0, 0, 0]\n",
    "shape = 'particle'\n[[massless_cable]]\nname = 'damped'\nlength = 1\nthrough = [{ body = 'world' }, { body = 'load' }]\n\
     winch = { speed = -1, since = 0 }\n",
    "shape = 'particle'\n[[massless_cable]]\nname = 'damped'\nthrough = [{ body = 'world', point = [-1, 0, -1] }, \
     { body = 'world', sheave = { radius = 0.2, axis = [0, 1, 0], friction = 0.1 } }, { body = 'load' }]\n",
];

/// Dampers of implicit steps resist what their path has grown by. With the rate along the tangent at the end the laws were off by
/// τ/(Δt + τ) of v² Δt²/2L, 9 mm a step, by which the load was drawn in: ropes of 5 s ended 9 mm too short, rods and joints up to
/// 0.4 m, with 20 times the energy of the throw.
#[test]
fn dampers_of_implicit_steps_follow_the_path() {
    // Newton's method ends within this part of the length, 0.01 of the tolerance.
    const NEAR: f64 = 0.01 * 0.005;
    let (mass, stretch, dt) = (100.0, 1e-6, 1.0 / 60.0);
    for suspension in THROWN {
        for damping in [0.05, 0.5, 5.0] {
            let text = format!(
                "load = 'load'\n[[body]]\nname = 'load'\nmass = {mass}\nposition = [1, 0, 0]\nvelocity = [0, 0, -8]\n\
                 {suspension}stretch = {stretch}\ndamping = {damping}\n\
                 [[massless_cable]]\nname = 'idle'\nlength = 10\nstretch = 0\n\
                 through = [{{ body = 'world' }}, {{ body = 'load' }}]\n"
            );
            let guard = Guard::default().with(|g| g.hold = 1000);
            let mut stepper = guarded(&text, guard);
            let names = &stepper.scene().constraint_names;
            let damped = names.iter().position(|name| name == "damped");
            let damped = damped.expect("a damped constraint");
            let laws = |stepper: &Stepper| {
                let mut rows = Linearized::new(stepper.scene());
                rows.update(stepper.scene(), stepper.time());
                let range = rows.row_range(damped);
                let laws = rows.phi[range.clone()].iter().zip(&rows.compliance[range]);
                laws.map(|(gap, compliance)| (*gap, *compliance))
                    .collect::<Vec<_>>()
            };
            let energy = |stepper: &Stepper| {
                let energy = stepper.energy();
                energy.kinetic + energy.gravity
            };
            let thrown = energy(&stepper);
            let (mut before, mut slipping) = (laws(&stepper), 0);
            for step in 1..=15 {
                let what = format!("{damping} s on {suspension}: step {step}");
                let report = stepper.step().expect("a step");
                assert_eq!(report.implicit_substeps, 1, "{what}");
                slipping += report.slipping;
                let now = laws(&stepper);
                let forces = stepper.row_forces(damped).expect("its forces");
                for ((force, (gap, compliance)), (begun, _)) in forces.iter().zip(&now).zip(&before)
                {
                    let law = (damping * begun - compliance * dt * force) / (dt + damping);
                    assert!((gap - law).abs() < NEAR, "{what}: {gap} m for {law} m");
                }
                let gained = energy(&stepper) - thrown;
                let hauls = suspension.contains("winch");
                assert!(hauls || gained < 0.0, "{what}: {gained} J");
                before = now;
            }
            assert!(slipping > 0 || !suspension.contains("friction"));
        }
    }
}
