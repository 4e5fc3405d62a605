//! Cables that refine themselves.

use super::{Resolved, *};
use crate::testing::*;
use taut_model::scene::resolution::Resolution;

const RULE: Resolution = Resolution {
    bend: 0.05,
    phase: 0.25,
    shortest: 0.0,
    longest: f64::INFINITY,
    hysteresis: 2.0,
    pause: 0.1,
    most: 10_000,
    since: 0.0,
};

/// A load of `mass` (kg) that swings on 10 m of cable.
fn swing(segments: usize, mass: f64, rule: Option<Resolution>) -> Stepper {
    let mut scene = on_earth("swing");
    let load = Body::sphere(0.2, mass).at(-Vector3::z() * 10.0);
    let load = scene.add_body("load", load);
    scene.load = Some(load);
    let frames = [origin(), centre(load)];
    let cable = Cable {
        segments: Segments::Equal(segments),
        density: 0.1,
        stiffness: Stiffness {
            ea: 2e6,
            ei: 1.0,
            gj: 1.0,
        },
        damping: Damping::Time(5e-3),
        resolution: rule,
        ..Cable::round(
            "rope",
            &Material::STEEL,
            0.005,
            frames.map(CableEnd::Pinned),
        )
    };
    scene.add_cable(&cable).unwrap();
    scene.start_in_equilibrium = true;
    let mut stepper = Stepper::new(scene, StepOptions::default()).unwrap();
    let mut bodies = stepper.scene().bodies.clone();
    for i in 0..bodies.len() {
        let omega = Vector3::y() * 0.1;
        bodies.velocity[i] = omega.cross(&bodies.position[i]);
        bodies.angular_velocity[i] = omega;
    }
    stepper.set_state(&bodies, 0.0).unwrap();
    stepper
}

fn load(stepper: &Stepper) -> Vector3<f64> {
    stepper.scene().bodies.position[stepper.scene().load.unwrap()]
}

#[test]
fn a_taut_cable_merges_and_its_load_moves_as_before() {
    let mut ruled = swing(64, 1000.0, Some(RULE));
    let mut fixed = swing(64, 1000.0, None);
    let (mut all, mut worst) = (Resolved::default(), 0.0_f64);
    for _ in 0..600 {
        let resolved = ruled.step().unwrap().resolved;
        let jump = resolved.jump;
        let unforeseen = (jump.kinetic - jump.blow - jump.moved).abs();
        assert!(unforeseen <= 1e-10 * ruled.scene().kinetic_energy());
        all += resolved;
        fixed.step().unwrap();
        worst = worst.max((load(&ruled) - load(&fixed)).norm());
    }
    let left = ruled.scene().cables[0].bodies.len();
    println!("{left} segments, {worst:.1e} m apart, {all:?}");
    assert_eq!((all.segments, all.merges - all.splits), (left, 64 - left));
    assert!(left < 8 && worst < 1e-5, "{left} {worst}");
    let energy = ruled.scene().kinetic_energy() + ruled.scene().potential_energy();
    let [gained, swings] = [all.jump.kinetic + all.jump.gravity + all.elastic, 500.0];
    assert!(gained.abs() < 1e-5 * swings, "{gained} {energy}");
}

/// Loads let go: what was taut hangs by itself, and is fine again.
#[test]
fn a_cable_that_loses_its_load_splits() {
    let mut stepper = swing(32, 1000.0, Some(RULE));
    stepper.steps(120);
    let taut = stepper.scene().cables[0].bodies.len();
    assert!(taut < 8, "{taut}");
    let hook = stepper.constraint("rope-end").unwrap();
    stepper.change(|edit| edit.remove_constraint(hook)).unwrap();
    let mut splits = 0;
    for _ in 0..240 {
        splits += stepper.step().unwrap().resolved.splits;
    }
    let bodies = &stepper.scene().cables[0].bodies;
    let mass: f64 = bodies.iter().map(|i| stepper.scene().bodies.mass[*i]).sum();
    let holds = bodies.len() > 3 * taut && splits > 3 * taut;
    assert!(holds, "{}", bodies.len());
    assert!((mass - 1.0).abs() < 1e-12, "{mass}");
    assert_eq!(stepper.scene().validate(), Ok(()));
}

/// A load on 10 m of cable with a winch that hauls in, and a rule, and its fairlead.
fn hoist(mass: f64, rule: Option<Resolution>) -> (Stepper, ConstraintId) {
    let mut scene = on_earth("cut");
    let load = Body::sphere(0.2, mass).at(-Vector3::z() * 10.0);
    let load = scene.add_body("load", load);
    let ends = [origin(), centre(load)];
    let cable = Cable {
        segments: Segments::Equal(10),
        winch: Some(winch(-0.2)),
        resolution: rule,
        ..Cable::round("rope", &Material::NYLON, 0.01, ends.map(CableEnd::Pinned))
    };
    let lead = scene.add_cable(&cable).unwrap().joints[0];
    scene.start_in_equilibrium = true;
    let stepper = Stepper::new(scene, StepOptions::default()).unwrap();
    let lead = stepper.ids.of_constraint(lead);
    (stepper, lead)
}

/// The rule makes long segments, of which the winch takes in one whole one after another.
#[test]
fn a_winch_takes_from_long_segments() {
    let (mut stepper, lead) = hoist(5e3, Some(RULE));
    let (mut fixed, own) = hoist(5e3, None);
    let (mut fewest, mut apart, mut worst) = (usize::MAX, 0.0_f64, 0.0_f64);
    for _ in 0..1500 {
        stepper.step().unwrap();
        fixed.step().unwrap();
        let scene = stepper.scene();
        fewest = fewest.min(scene.cables[0].bodies.len());
        let [lead, own] = [(&stepper, lead), (&fixed, own)].map(|(s, c)| s.constraint_index(c));
        let (lead, own) = (lead.unwrap(), own.unwrap());
        assert_eq!(scene.cables[0].joints.first(), Some(&lead));
        apart = apart.max((scene.bodies.position[0] - fixed.scene().bodies.position[0]).norm());
        let pulls = [stepper.tension(lead).unwrap(), fixed.tension(own).unwrap()];
        worst = worst.max((pulls[0] - pulls[1]).abs() / (5e3 * 9.81));
    }
    let stock = stepper.scene().cables[0].stock.as_ref().unwrap();
    let bodies = stepper.scene().cables[0].bodies.iter();
    let mass: f64 = bodies.map(|i| stepper.scene().bodies.mass[*i]).sum();
    println!("{fewest} segments at least, {apart:.1e} m apart, tension by {worst:.1e}");
    let holds = (mass / stock.density - 5.0).abs() < 1e-9 && fewest <= 3;
    assert!(holds, "{fewest}");
    assert!(apart < 1e-4 && worst < 1e-3, "{apart} {worst}");
}

/// The piece cut off below a winch splits by its rule, and the winch goes on.
#[test]
fn a_cable_that_is_cut_below_its_winch_goes_on() {
    let fine = RULE.with(|p| p.shortest = 0.2);
    let (mut stepper, lead) = hoist(500.0, Some(fine));
    for k in 0..240 {
        if k == 120 {
            let cut = stepper.change(|edit| {
                let middle = edit.scene().cables[0].bodies.len() / 2;
                edit.cut("rope", middle - 1)
            });
            cut.unwrap();
        }
        stepper.step().unwrap();
    }
    let (scene, lead) = (stepper.scene(), stepper.constraint_index(lead).unwrap());
    assert_eq!(scene.cables[0].joints.first(), Some(&lead));
    let mass = scene.cables[0].bodies.iter();
    let mass: f64 = mass.map(|i| scene.bodies.mass[*i]).sum();
    let density = scene.cables[0].stock.as_ref().unwrap().density;
    // 0.2 m/s for 4 s.
    assert!((mass / density - 9.2).abs() < 1e-9, "{}", mass / density);
    let found = scene.cables[0].bodies.len();
    assert!(found > 20, "{}", scene.cables[0].bodies.len());
}

#[test]
fn a_saved_run_goes_on_with_the_same_bits() {
    let mut stepper = swing(32, 100.0, Some(RULE));
    stepper.steps(7);
    let mut restored = stepper.saved();
    let mut changes = 0;
    for _ in 0..120 {
        let resolved = stepper.step().unwrap().resolved;
        changes += resolved.merges;
        assert_eq!(resolved, restored.step().unwrap().resolved);
        assert_eq!(stepper.scene(), restored.scene());
    }
    assert!(changes > 10, "{changes}");
}

/// The coarse run of the estimate keeps the segments of each moment.
#[test]
fn the_error_is_estimated() {
    let mut stepper = swing(32, 1000.0, Some(RULE));
    let options = stepper.options().clone().with(|o| o.estimate = Some(2));
    stepper = Stepper::new(stepper.into_scene(), options).unwrap();
    let mut error = None;
    for _ in 0..300 {
        error = stepper.step().unwrap().error;
    }
    let error = error.unwrap();
    let holds = !error.lost && (1e-7..1e-2).contains(&error.time);
    assert!(holds, "{error:?}");
    assert!(error.unseen < 30, "{error:?}");
}

/// Places of a load that swings on a cable along a slope, whose ends are called so or the other way round.
fn of_ends(
    exchanged: bool,
    (segments, mass, bend): (usize, f64, f64),
    steps: usize,
) -> (Vector3<f64>, [usize; 2]) {
    let mut scene = on_earth("ends");
    let load = Body::sphere(0.2, mass).at(Vector3::new(3.0, 0.0, -1.0));
    let load = scene.add_body("load", load);
    let anchor = origin();
    let mut ends = [anchor, centre(load)].map(CableEnd::Pinned);
    if exchanged {
        ends.reverse();
    }
    let rule = Resolution::default().with(|p| p.bend = bend);
    let cable = Cable::round("rope", &Material::NYLON, 0.01, ends)
        .with(|p| p.segments = Segments::Equal(segments))
        .with(|p| p.points = vec![Vector3::new(1.5, 0.0, -1.5)])
        .with(|p| (p.damping, p.resolution) = (Damping::Time(0.02), Some(rule)));
    scene.add_cable(&cable).unwrap();
    let mut stepper = Stepper::new(scene, StepOptions::default()).unwrap();
    let mut done = [0; 2];
    for _ in 0..steps {
        let resolved = stepper.step().unwrap().resolved;
        done[0] += resolved.splits;
        done[1] += resolved.merges;
    }
    (stepper.scene().bodies.position[load], done)
}

/// Slack and taut, odd and even numbers of segments, light and heavy: nothing but rounding tells which end is the first.
#[test]
fn exchanging_the_ends_of_a_cable_moves_nothing() {
    for numbers in [
        (31, 200.0, 0.1),
        (48, 20.0, 0.2),
        (17, 5.0, 0.05),
        (23, 1e3, 0.1),
    ] {
        let [(one, done), (other, again)] =
            [false, true].map(|exchanged| of_ends(exchanged, numbers, 180));
        assert!(done[0] + done[1] > 4, "{numbers:?}: {done:?}");
        assert_eq!(done, again, "{numbers:?}");
        let apart = (one - other).norm();
        assert!(apart < 1e-12, "{numbers:?}: {apart:e}");
    }
}
