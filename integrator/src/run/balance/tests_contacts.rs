//! The balance of energy where contacts do work.

use crate::contact::tests::add;
use crate::testing::*;

const G: f64 = 9.81;

const SCHEMES: [Scheme; 2] = [Scheme::LinearlyImplicit, Scheme::THIRD_DIFFERENCE];

fn scene(gravity: f64) -> Scene {
    let mut scene = Scene::new("touching");
    scene.gravity.z = -gravity;
    scene
}

fn with_ground(gravity: f64, surface: Surface) -> Scene {
    let mut scene = scene(gravity);
    scene.add_collider(Collider {
        surface,
        ..Collider::new("ground", None, Shape::HalfSpace)
    });
    scene
}

fn add_box(scene: &mut Scene, size: [f64; 3], at: [f64; 3], mass: f64) -> usize {
    let size = Vector3::from(size);
    let body = Body::cuboid(size, mass).at(Vector3::from(at));
    add(scene, body, Shape::Cuboid { size }, Surface::default())
}

fn add_driven(scene: &mut Scene, size: [f64; 3], at: [f64; 3], velocity: [f64; 3]) -> usize {
    let i = add_box(scene, size, at, 1.0);
    scene.bodies.mobility[i] = Mobility::Driven;
    scene.bodies.velocity[i] = velocity.into();
    i
}

fn add_ball(scene: &mut Scene, height: f64, speed: f64, surface: Surface) -> usize {
    let radius = 0.1;
    let body = Body::sphere(radius, 1.0).at(Vector3::z() * height);
    let ball = add(scene, body, Shape::Sphere { radius }, surface);
    scene.bodies.velocity[ball].z = speed;
    ball
}

fn bouncy(restitution: f64) -> Surface {
    Surface::default().with(|s| s.restitution = restitution)
}

fn stepper(scene: Scene, scheme: Scheme) -> Stepper {
    let options =
        StepOptions::default().with(|o| (o.scheme, o.energy_tolerance) = (scheme, Some(0.2)));
    Stepper::new(scene, options).expect("a sound scene")
}

/// The balance after a run of `time` seconds, none of whose steps had energy from nowhere.
fn last(stepper: &mut Stepper, time: f64) -> EnergyBalance {
    let steps = (time / stepper.options().dt).round() as usize;
    let mut last = EnergyBalance::default();
    for _ in 0..steps {
        last = stepper.step().expect("a step").balance.expect("watched");
        assert!(last.excess < 1e-3, "{last:?}");
    }
    last
}

#[test]
fn a_platform_pays_for_what_it_lifts() {
    let implicit = Guard::default().with(|g| g.tolerance = 1e-300);
    for (scheme, substeps, guard) in [
        (Scheme::LinearlyImplicit, 1, None),
        (Scheme::THIRD_DIFFERENCE, 1, None),
        (Scheme::THIRD_DIFFERENCE, 4, None),
        (Scheme::THIRD_DIFFERENCE, 1, Some(implicit)),
    ] {
        let mut scene = scene(G);
        let platform = add_driven(&mut scene, [2.0, 2.0, 0.2], [0.0; 3], [0.0; 3]);
        add_box(&mut scene, [1.0; 3], [0.0, 0.0, 0.6], 10.0);
        let options = StepOptions {
            substeps,
            guard,
            ..stepper(scene.clone(), scheme).options().clone()
        };
        let mut stepper = Stepper::new(scene, options).expect("a sound scene");
        last(&mut stepper, 0.1);
        stepper.step.scene.bodies.velocity[platform].z = 1.0;
        let balance = last(&mut stepper, 2.0);
        // The platform starts at once: half of what that takes is lost in the blow.
        let work = 10.0 * (G * 2.0 + 1.0);
        assert!((balance.work / work - 1.0).abs() < 0.02, "{balance:?}");
        let off = (balance.gained / (work - 5.0) - 1.0).abs();
        assert!(off < 0.02, "{balance:?}");
    }
}

#[test]
fn a_belt_pays_for_friction_as_well_as_for_speed() {
    for scheme in SCHEMES {
        let mut scene = scene(G);
        add_driven(&mut scene, [100.0, 1.0, 0.2], [0.0; 3], [2.0, 0.0, 0.0]);
        add_box(&mut scene, [0.4; 3], [0.0, 0.0, 0.3], 3.0);
        let balance = last(&mut stepper(scene, scheme), 2.0);
        // m v² in all, of which half becomes motion; the implicit scheme's balance begins in the middle of its first step.
        assert!((balance.work / 12.0 - 1.0).abs() < 0.03, "{balance:?}");
        assert!((balance.gained / 6.0 - 1.0).abs() < 0.01, "{balance:?}");
    }
}

#[test]
fn a_ram_pays_for_the_friction_of_what_it_pushes() {
    let mut scene = with_ground(G, Surface::default());
    let ram = [-1.0, 0.0, 0.6];
    add_driven(&mut scene, [0.2, 1.0, 1.0], ram, [1.0, 0.0, 0.0]);
    scene.colliders[1].surface.friction = 0.0;
    let pushed = add_box(&mut scene, [1.0; 3], [0.0, 0.0, 0.5], 10.0);
    let mut stepper = stepper(scene, Scheme::default());
    let balance = last(&mut stepper, 2.0);
    let way = stepper.scene().bodies.position[pushed].x;
    let work = 0.5 * 10.0 * G * way + 10.0;
    let holds = way > 1.5 && (balance.work / work - 1.0).abs() < 0.03;
    assert!(holds, "{balance:?} {work}");
}

#[test]
fn a_bat_pays_for_the_rebound_too() {
    for scheme in SCHEMES {
        let mut scene = scene(0.0);
        add_driven(&mut scene, [1.0, 1.0, 0.2], [0.0; 3], [0.0, 0.0, 2.0]);
        add_ball(&mut scene, 0.5, 0.0, bouncy(0.8));
        let balance = last(&mut stepper(scene, scheme), 1.0);
        let speed = 1.8 * 2.0;
        let off = (balance.gained / (0.5 * speed * speed) - 1.0).abs();
        assert!(off < 1e-5, "{balance:?}");
        let off = (balance.work / (speed * 2.0) - 1.0).abs();
        assert!(off < 1e-5, "{balance:?}");
    }
}

#[test]
fn a_balance_begins_before_a_blow_in_its_first_step() {
    let check = |stepper: &mut Stepper| {
        let gained = last(stepper, 0.3).gained;
        let begun = stepper.energy().total() - gained;
        let off = begun - (12.5 + 0.14 * G);
        assert!(off.abs() < 1e-9, "{}: {begun}", stepper.options().scheme);
    };
    for scheme in SCHEMES {
        let mut scene = with_ground(G, Surface::default());
        add_ball(&mut scene, 0.14, -5.0, bouncy(0.8));
        let mut stepper = stepper(scene, scheme);
        check(&mut stepper);
        // A balance that begins anew after a change of state starts before the blow, too.
        let mut bodies = stepper.scene().bodies.clone();
        (bodies.position[0].z, bodies.velocity[0].z) = (0.14, -5.0);
        stepper.set_state(&bodies, 0.0).expect("a state");
        check(&mut stepper);
    }
}

#[test]
fn what_begins_in_the_ground_comes_out_of_it() {
    for scheme in SCHEMES {
        let mut scene = with_ground(G, Surface::default());
        add_box(&mut scene, [1.0; 3], [0.0, 0.0, 0.4], 100.0);
        let balance = last(&mut stepper(scene, scheme), 2.0);
        let lifted = 100.0 * G * 0.1;
        assert!((balance.gained / lifted - 1.0).abs() < 0.04, "{balance:?}");
        // Once the speed of recovery is lost besides, and half of it more where the start goes half a step back.
        let most = lifted + 1.5 * 100.0 * 0.5 * 0.5 + 0.1 * lifted;
        assert!((lifted..most).contains(&balance.recovery), "{balance:?}");
        assert_eq!(balance.work, 0.0);
    }
}

#[test]
fn a_compliant_contact_gives_back_what_it_took_and_no_more() {
    for scheme in SCHEMES {
        for compliance in [1e-10, 1e-6, 1e-5, 1e-4, 1e-3] {
            let surface =
                Surface::default().with(|s| (s.compliance, s.damping) = (compliance, 0.0));
            let mut scene = with_ground(0.0, surface);
            // Pressed in at the start, and so far as the speed of recovery lets it be a spring.
            add_ball(&mut scene, 0.1 - 0.008, 0.0, surface);
            let mut stepper = stepper(scene, scheme);
            let balance = last(&mut stepper, 2.0);
            let stored = 0.5 * 0.008 * 0.008 / (compliance + 1e-10);
            let kinetic = stepper.scene().kinetic_energy();
            assert!(kinetic > 0.0 && kinetic < stored, "{compliance}: {kinetic}");
            let holds = balance.recovery < 3.1 * kinetic;
            assert!(holds, "{compliance}: {balance:?} {kinetic}");
        }
    }
}

#[test]
fn a_press_pays_for_what_soft_ground_stores() {
    for scheme in SCHEMES {
        let surface = Surface::default().with(|s| s.compliance = 1e-4);
        let mut scene = with_ground(0.0, surface);
        add_ball(&mut scene, 0.1, 0.0, Surface::default());
        let values = [0.0, 0.0, -0.01];
        add_driven(&mut scene, [1.0, 1.0, 0.2], [0.0, 0.0, 0.3], values);
        let balance = last(&mut stepper(scene, scheme), 0.4);
        let stored = 0.5 * 0.004 * 0.004 / 1e-4;
        assert!((balance.work / stored - 1.0).abs() < 0.05, "{balance:?}");
        // At the beginning of the step, to whose end the contact's force belongs.
        assert!((balance.gained / stored - 1.0).abs() < 0.1, "{balance:?}");
    }
}

/// A bounce on a soft ground, whose ball a trick of the caller's makes faster.
#[test]
fn a_bounce_that_gains_is_an_error() {
    for (gain, lost) in [(1.0, false), (1.05, true)] {
        let soft = Surface::default().with(|s| s.compliance = 1e-4);
        let mut scene = with_ground(G, soft);
        let ball = add_ball(&mut scene, 1.0, 0.0, bouncy(0.9));
        let mut stepper = stepper(scene, Scheme::default());
        let failed = (0..120).find_map(|_| {
            stepper.step.scene.bodies.velocity[ball] *= gain;
            stepper.step().err()
        });
        let gained = matches!(failed, Some(StepError::EnergyGain { .. }));
        assert_eq!(gained, lost, "{failed:?}");
    }
}
