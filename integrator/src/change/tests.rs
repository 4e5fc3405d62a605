use super::*;
use crate::{Scheme, StepOptions};
use nalgebra::Vector3;
use taut_model::{
    CableEnd, Distance, Frame, GantryParams, HoistParams, JointKind, Lock, Material, RowLaw,
    Segments,
};

const WEIGHT: f64 = 9.81;

fn options() -> StepOptions {
    StepOptions {
        backend: taut_solver::Backend::Dense(taut_solver::DenseOptions::default()),
        ..StepOptions::default()
    }
}

fn gantry() -> Stepper {
    let params = GantryParams {
        segments: 4,
        ..GantryParams::default()
    };
    Stepper::new(params.build().unwrap(), options()).unwrap()
}

fn rigid_link(frames: [Frame; 2], length: f64) -> Constraint {
    Constraint::Distance(Distance {
        frames,
        length,
        law: RowLaw::RIGID,
        transverse: false,
    })
}

fn lock(frames: [Frame; 2]) -> Constraint {
    Constraint::Lock(Lock {
        frames,
        linear: RowLaw::RIGID,
        angular: RowLaw::RIGID,
    })
}

fn steps(stepper: &mut Stepper, count: usize) {
    for _ in 0..count {
        stepper.step().unwrap();
    }
}

#[test]
fn a_change_that_changes_nothing_leaves_all_bits() {
    let [mut plain, mut changed] = [gantry(), gantry()];
    for stepper in [&mut plain, &mut changed] {
        stepper.set_control(0, 0.4).unwrap();
        steps(stepper, 20);
    }
    changed.change(|_| Ok(())).unwrap();
    changed
        .change(|edit| {
            let body = edit.add_body("visitor", Body::sphere(1.0, 1.0));
            edit.remove_body(body)
        })
        .unwrap();
    for _ in 0..20 {
        let (a, b) = (plain.step().unwrap(), changed.step().unwrap());
        assert_eq!((a.solves, a.disagreement), (b.solves, b.disagreement));
        assert_eq!(plain.scene(), changed.scene());
        assert_eq!(plain.multipliers(), changed.multipliers());
    }
}

#[test]
fn what_stays_goes_on_as_it_was() {
    let [mut plain, mut changed] = [gantry(), gantry()];
    for stepper in [&mut plain, &mut changed] {
        stepper.set_control(0, 0.4).unwrap();
        stepper.set_control(1, 0.1).unwrap();
        steps(stepper, 30);
    }
    // A body of its own between those that are there, so to speak: rows and bodies move, the motion does not.
    let far = Vector3::new(50.0, 0.0, 0.0);
    let visitor = changed
        .change(|edit| {
            let visitor = edit.add_body("visitor", Body::sphere(1.0, 1.0).at(far));
            let body = edit.body_index(visitor)?;
            let frames = [Frame::world(far), Frame::body(body, Vector3::zeros())];
            edit.add_constraint("pin", lock(frames), 0);
            Ok(visitor)
        })
        .unwrap();
    steps(&mut plain, 30);
    steps(&mut changed, 30);
    let of = |stepper: &Stepper| stepper.scene().bodies.position.clone();
    for (a, b) in of(&plain).into_iter().zip(of(&changed)) {
        assert!((a - b).norm() < 1e-12, "{a} {b}");
    }
    let body = changed.body_index(visitor).unwrap();
    assert_eq!(changed.scene().body_names[body], "visitor");
    assert!((of(&changed)[body] - far).norm() < 1e-12);
    changed
        .change(|edit| {
            edit.remove_constraint(edit.constraint("pin")?)?;
            edit.remove_body(visitor)
        })
        .unwrap();
    assert_eq!(changed.scene().bodies.len(), plain.scene().bodies.len());
    let gone = changed.body_index(visitor).unwrap_err();
    assert_eq!(gone, StepError::Gone { kind: "body" });
    steps(&mut plain, 30);
    steps(&mut changed, 30);
    for (a, b) in of(&plain).into_iter().zip(of(&changed)) {
        assert!((a - b).norm() < 1e-12, "{a} {b}");
    }
}

/// With v⁺ = v − Δt g and x⁺ = x + Δt v⁺ a load let go at rest has fallen Δt² g n(n + 1)/2 after n steps.
#[test]
fn a_load_let_go_falls_freely_from_the_next_step_on() {
    let params = HoistParams {
        segments: 8,
        mass_ratio: 1e3,
        ..HoistParams::default()
    };
    let mut stepper = Stepper::new(params.hanging_equilibrium().unwrap(), options()).unwrap();
    steps(&mut stepper, 5);
    let load = stepper.body("load").unwrap();
    let hook = stepper.constraint("load").unwrap();
    stepper.change(|edit| edit.remove_constraint(hook)).unwrap();
    let place = |stepper: &Stepper| {
        let i = stepper.body_index(load).unwrap();
        (
            stepper.scene().bodies.position[i],
            stepper.scene().bodies.velocity[i],
        )
    };
    let (start, velocity) = place(&stepper);
    let dt = stepper.options().dt;
    for n in 1..=60 {
        stepper.step().unwrap();
        let t = dt * f64::from(n);
        let fallen = start + velocity * t - Vector3::z() * (0.5 * WEIGHT * t * (t + dt));
        let off = (place(&stepper).0 - fallen).norm();
        assert!(off < 1e-12, "{n}: {off}");
    }
    let stale = stepper
        .change(|edit| edit.remove_constraint(hook))
        .unwrap_err();
    assert_eq!(stale, StepError::Gone { kind: "constraint" });
}

/// A body of mass m₁ at the speed v catches one of m₂ at rest by a rigid link: they go on together at m₁ v/(m₁ + m₂).
#[test]
fn a_catch_by_a_rigid_link_keeps_the_momentum() {
    for scheme in Scheme::KINDS {
        let (m1, m2, v) = (3.0, 1000.0, 2.0);
        let mut scene = Scene::new("catch");
        let mut runner = Body::sphere(0.1, m1);
        runner.velocity = Vector3::x() * v;
        scene.add_body("runner", runner);
        scene.add_body("block", Body::sphere(0.5, m2).at(Vector3::x() * 1.5));
        let options = StepOptions {
            scheme,
            ..options()
        };
        let mut stepper = Stepper::new(scene, options).unwrap();
        steps(&mut stepper, 10);
        let length = {
            let x = &stepper.scene().bodies.position;
            (x[1] - x[0]).norm()
        };
        stepper
            .change(|edit| {
                let frames = [0, 1].map(|body| Frame::body(body, Vector3::zeros()));
                edit.add_constraint("link", rigid_link(frames, length), 0);
                Ok(())
            })
            .unwrap();
        steps(&mut stepper, 200);
        let momentum = stepper.scene().momentum().x / (m1 * v);
        assert!(
            (momentum - 1.0).abs() < 1e-14 * 10.0,
            "{scheme}: {momentum}"
        );
        let energy = m1 * m1 * v * v / (2.0 * (m1 + m2));
        let kinetic = stepper.scene().kinetic_energy() / energy;
        assert!((kinetic - 1.0).abs() < 1e-12, "{scheme}: {kinetic}");
    }
}

/// A free, taut cable that spins about its middle and is cut there: no force acts on the whole.
#[test]
fn a_cut_keeps_momentum_and_angular_momentum() {
    let half = Vector3::x() * 2.0;
    let mut scene = Scene::new("spin");
    let ends = [half, -half].map(CableEnd::Free);
    let cable = Cable {
        segments: Segments::Equal(8),
        ..Cable::round("rope", &Material::NYLON, 0.01, ends)
    };
    scene.add_cable(&cable).unwrap();
    let spin = Vector3::new(0.3, -0.2, 4.0);
    for i in 0..8 {
        let x = scene.bodies.position[i];
        scene.bodies.velocity[i] = spin.cross(&x) + Vector3::new(0.5, 0.1, -0.2);
        scene.bodies.angular_velocity[i] = spin;
    }
    let mut stepper = Stepper::new(scene, options()).unwrap();
    steps(&mut stepper, 20);
    let momenta = |stepper: &Stepper| {
        let about = Vector3::new(1.0, 2.0, 3.0);
        let scene = stepper.scene();
        (scene.momentum(), scene.angular_momentum(&about))
    };
    let (_, before) = momenta(&stepper);
    steps(&mut stepper, 1);
    let (p, l) = momenta(&stepper);
    // Of the scheme itself, whose forces act at the beginning of a step.
    let drift = (l - before).norm();
    stepper.change(|edit| edit.cut("rope", 3)).unwrap();
    let twice = stepper.change(|edit| edit.cut("rope", 3)).unwrap_err();
    let words = "cable `rope`: segments 4 and 5: are not joined";
    assert!(twice.to_string().starts_with(words), "{twice}");
    assert_eq!(momenta(&stepper), (p, l));
    steps(&mut stepper, 1);
    let (cut_p, cut_l) = momenta(&stepper);
    let kicked = (cut_p - p).norm();
    assert!(kicked < 1e-12 * p.norm(), "{kicked}");
    let turned = (cut_l - l).norm();
    assert!(
        turned < drift && drift < 1e-5 * l.norm(),
        "{turned} {drift}"
    );
    steps(&mut stepper, 60);
    let apart = stepper.scene().bodies.position[0] - stepper.scene().bodies.position[7];
    assert!(apart.norm() > 4.5, "{}", apart.norm());
}

#[test]
fn hooking_on_and_off_costs_no_memory_and_no_energy() {
    let mut scene = Scene::new("hook");
    scene.add_body("trolley", Body::sphere(0.2, 50.0));
    scene.add_body("load", Body::sphere(0.2, 20.0).at(Vector3::z() * -1.0));
    let velocity = Vector3::new(0.2, 0.0, 0.0);
    scene.bodies.velocity.fill(velocity);
    let mut stepper = Stepper::new(scene, options()).unwrap();
    let before = stepper.scene().kinetic_energy();
    for _ in 0..10_000 {
        stepper
            .change(|edit| {
                let frames = [0, 1].map(|body| Frame::body(body, Vector3::zeros()));
                edit.add_constraint("link", rigid_link(frames, 1.0), 0);
                Ok(())
            })
            .unwrap();
        stepper.step().unwrap();
        stepper
            .change(|edit| edit.remove_constraint(edit.constraint("link")?))
            .unwrap();
    }
    assert!(stepper.scene().constraints.capacity() <= 4);
    let after = stepper.scene().kinetic_energy();
    assert!((after / before - 1.0).abs() < 1e-12, "{after} {before}");
}

#[test]
fn what_does_not_go_is_refused_by_name_and_changes_nothing() {
    let mut stepper = gantry();
    steps(&mut stepper, 3);
    let before = stepper.scene().clone();
    type Work = fn(&mut Edit) -> Result<(), StepError>;
    let cases: &[(Work, &str)] = &[
        (
            |edit| edit.remove_body(edit.body("hook")?),
            "body `hook` cannot be removed while `rope-1` holds it",
        ),
        (
            |edit| edit.remove_body(edit.body("load")?),
            "body `load`: is the load",
        ),
        (
            |edit| {
                edit.add_body("hook", Body::sphere(1.0, 1.0));
                Ok(())
            },
            "two body entries are called `hook`",
        ),
        (
            |edit| edit.cut("cable", 3),
            "cable `cable`: segments 4 and 5: are not joined",
        ),
        (
            |edit| edit.cut("rope", 0),
            "cable `rope` is not known: choose one of cable",
        ),
        (|edit| edit.remove_cable("cable"), "removed"),
        (
            |edit| edit.remove_constraint(edit.constraint("nail")?),
            "`nail`, which is not there",
        ),
        (
            |edit| {
                edit.add_body("bad", Body::sphere(1.0, f64::NAN));
                Ok(())
            },
            "body `bad`: mass is NaN",
        ),
    ];
    for (work, words) in cases {
        let outcome = stepper.change(work);
        if *words == "removed" {
            // The whole cable may go: its joints hold hook and load no longer.
            outcome.unwrap();
            assert!(stepper.scene().cables.is_empty());
            stepper = gantry();
            steps(&mut stepper, 3);
            continue;
        }
        let message = outcome.unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
        assert_eq!(stepper.scene(), &before);
    }
    stepper.solve().unwrap();
    let between = stepper.change(|_| Ok(())).unwrap_err().to_string();
    assert!(between.contains("change"), "{between}");
    stepper.advance().unwrap();
    stepper.change(|_| Ok(())).unwrap();
}

#[test]
fn a_winch_rope_added_later_hangs_and_holds() {
    let mut scene = Scene::new("crane");
    scene.gravity = Vector3::z() * -WEIGHT;
    scene.add_body("crane", Body::fixed());
    scene.add_body("load", Body::sphere(0.3, 100.0).at(Vector3::z() * -5.0));
    scene.load = Some(1);
    let options = StepOptions {
        energy_tolerance: Some(0.1),
        ..options()
    };
    let mut stepper = Stepper::new(scene, options).unwrap();
    steps(&mut stepper, 3);
    let rope = stepper
        .change(|edit| {
            let bottom = edit.scene().bodies.position[1];
            let ends = [
                CableEnd::Pinned(Frame::body(0, Vector3::zeros())),
                CableEnd::Pinned(Frame::body(1, Vector3::zeros())),
            ];
            let cable = Cable {
                segments: Segments::Equal(6),
                joint: JointKind::Spherical,
                ..Cable::round("rope", &Material::STEEL, 0.005, ends)
            };
            assert!(bottom.z < -5.0);
            edit.add_cable(&cable)
        })
        .unwrap();
    steps(&mut stepper, 600);
    let weight = WEIGHT * stepper.scene().mass();
    let top = stepper.tension(rope.joints[0]).unwrap();
    assert!((top / weight - 1.0).abs() < 0.5, "{top} {weight}");
}
