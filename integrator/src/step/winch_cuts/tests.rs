//! Hoists of cables of segments.

use crate::testing::*;

/// A load of `mass` (kg) on `length` (m) of cable in `segments`, hauled at `speed` (m/s), in motion already.
fn hoist(length: f64, segments: usize, mass: f64, speed: f64) -> Scene {
    hoist_with(length, segments, mass, speed, CableEnd::Pinned)
}

/// [`hoist`] with the ends `end`.
fn hoist_with(
    length: f64,
    segments: usize,
    mass: f64,
    speed: f64,
    end: fn(Frame) -> CableEnd,
) -> Scene {
    let mut scene = on_earth("hoist");
    let mut load = Body::sphere(0.2, mass).at(-Vector3::z() * length);
    load.velocity.z = -speed;
    let load = scene.add_body("load", load);
    let ends = [origin(), centre(load)];
    let cable = Cable {
        segments: Segments::Equal(segments),
        density: 0.1,
        stiffness: Stiffness {
            ea: 2e7,
            ei: 10.0,
            gj: 8.0,
        },
        joint: JointKind::Cosserat,
        winch: Some(winch(speed)),
        ..Cable::round("rope", &Material::STEEL, 0.01, ends.map(end))
    };
    let parts = scene.add_cable(&cable).unwrap();
    for body in parts.bodies {
        scene.bodies.velocity[body].z = -speed;
    }
    scene.load = Some(load);
    scene
}

/// The height of the load, the tension at it, and the fairlead.
fn seen(stepper: &Stepper) -> (f64, f64, &Fairlead) {
    let scene = stepper.scene();
    let joints = &scene.cables[0].joints;
    let load = scene.load.unwrap();
    let tension = stepper.tension(joints[joints.len() - 1]).unwrap();
    let Constraint::Fairlead(lead) = &scene.constraints[joints[0]] else {
        panic!("a fairlead comes first");
    };
    (scene.bodies.position[load].z, tension, lead)
}

fn started(mut scene: Scene) -> Stepper {
    scene.start_in_equilibrium = true;
    Stepper::new(scene, StepOptions::default()).unwrap()
}

/// A scene at rest whose winch follows a control.
fn at_rest(length: f64, segments: usize, mass: f64) -> Scene {
    let mut scene = hoist(length, segments, mass, 0.0);
    let lead = scene.cables[0].joints[0];
    scene.controls.push(Control::of("hoist", lead, 1.0));
    scene
}

#[test]
fn a_steady_hoist_has_no_kicks() {
    let mut stepper = started(hoist(10.0, 20, 100.0, -0.5));
    let mut worst = 0.0_f64;
    for k in 0..600 {
        stepper.step().unwrap();
        if k > 60 {
            worst = worst.max((seen(&stepper).1 / 981.0 - 1.0).abs());
        }
    }
    let (_, _, lead) = seen(&stepper);
    println!("largest change of the tension {worst:.1e}");
    assert!((lead.length - 5.0).abs() < 1e-9 && stepper.scene().cables[0].bodies.len() == 10);
    assert!((stepper.scene().mass() - 100.0 - 0.5).abs() < 1e-9);
    assert!(worst < 1e-4, "{worst}");
}

/// The cable is so light that the load must move as on a massless one.
#[test]
fn a_heavy_load_rises_and_sinks_as_on_a_massless_cable() {
    let mass = 1e4;
    let mut stepper = started(at_rest(10.0, 40, mass));
    let mut other = on_earth("massless");
    let load = other.add_body("load", Body::particle(mass).at(-Vector3::z() * 10.0));
    let frames = vec![origin(), centre(load)];
    let cable = reeled(Winch::new(), frames, 10.0, RowLaw::new(10.0 / 2e7, 0.0));
    other.add_constraint("cable", cable, 0);
    other.controls.push(Control::of("hoist", 0, 1.0));
    let mut other = started(other);
    let mut worst = 0.0_f64;
    for k in 0..1200 {
        for (after, speed) in [(10, -0.1), (400, 0.0), (500, 0.15), (800, -0.05)] {
            if k == after {
                stepper.set_control(0, speed).unwrap();
                other.set_control(0, speed).unwrap();
            }
        }
        stepper.step().unwrap();
        other.step().unwrap();
        worst = worst.max((seen(&stepper).0 - other.scene().bodies.position[0].z).abs());
    }
    println!("largest distance {worst:.1e} m");
    assert!(worst < 2e-4, "{worst}");
}

#[test]
fn turns_stay_in_what_is_off_the_drum() {
    let mut scene = hoist(10.0, 20, 1e3, -0.5);
    let (turns, load) = (12.0, scene.load.unwrap());
    let about = |by: f64| UnitQuaternion::from_scaled_axis(-Vector3::z() * by);
    let CableParts { bodies, joints, .. } = scene.cables[0].clone();
    let Constraint::Fairlead(lead) = &mut scene.constraints[joints[0]] else {
        panic!("a fairlead comes first");
    };
    let stock = scene.cables[0].stock.as_ref().expect("a winch");
    let half = |law: Option<RowLaw>| {
        law.map(|law| RowLaw::new(0.5 * lead.first * law.compliance, law.damping))
    };
    let law = JointLaw {
        stretch: half(stock.per_metre.stretch),
        bend: half(stock.per_metre.bend),
        twist: half(stock.per_metre.twist),
    };
    lead.law = law;
    let end = &mut scene.constraints[joints[20]];
    *end = Cosserat::new([end.frames()[0], end.frames()[1]], law).into();
    for (k, body) in bodies.into_iter().enumerate() {
        scene.bodies.orientation[body] = about(turns * (k as f64 + 0.5) / 20.0);
    }
    scene.bodies.orientation[load] = about(turns);
    let axes = scene.bodies.rotation(load).transpose() * hanging_axes();
    let rail = [origin(), centre(load).with_axes(axes)];
    scene.add_constraint("rail", Slider::new(rail), 0);
    let mut stepper = started(scene);
    for _ in 0..600 {
        stepper.step().unwrap();
        let joints = &stepper.scene().cables[0].joints;
        let rows = stepper.linearized();
        let twists = joints.iter().map(|c| rows.phi[rows.row_range(*c).end - 1]);
        assert!((twists.sum::<f64>() - turns).abs() < 1e-9);
        let torque = |c: &usize| stepper.loads(*c).unwrap().twist.unwrap();
        // GJ times the twist over the length of half a step ago.
        let exact = 8.0 * turns / (seen(&stepper).2.length + 0.25 / 60.0);
        for torque in joints.iter().map(torque) {
            assert!((torque / exact - 1.0).abs() < 1e-3, "{torque} {exact}");
        }
    }
}

#[test]
fn a_drum_slips_at_its_limit_and_a_brake_holds() {
    let mut scene = at_rest(10.0, 10, 1000.0);
    let lead = scene.cables[0].joints[0];
    let held = 9810.0 + 9.81;
    let Constraint::Fairlead(of) = &mut scene.constraints[lead] else {
        panic!("a fairlead comes first");
    };
    of.winch = Winch::new().with(|w| (w.speed, w.brake) = (-0.5, true));
    let mut stepper = started(scene);
    let from = seen(&stepper).0;
    stepper.steps(30);
    assert!((seen(&stepper).0 - from).abs() < 1e-6 && seen(&stepper).2.length == 10.0);
    let winch = Winch {
        force_limit: 0.9 * held,
        longest: 12.0,
        speed: 0.0,
        ..seen(&stepper).2.winch
    };
    stepper
        .set_winch(lead, winch.with(|w| w.brake = false))
        .unwrap();
    for _ in 0..30 {
        stepper.step().unwrap();
        let lead = stepper.scene().cables[0].joints[0];
        assert!(stepper.tension(lead).unwrap() <= 0.9 * held * (1.0 + 1e-12));
    }
    let fallen = from - seen(&stepper).0;
    println!("fallen {fallen} m");
    let off = (fallen / (0.05 * 9.81 * 0.25) - 1.0).abs();
    assert!(off < 0.05, "{fallen}");
    stepper.steps(120);
    // The drum is empty, and its end holds.
    assert!((seen(&stepper).2.length - 12.0).abs() < 1e-9);
    assert_eq!(stepper.scene().cables[0].bodies.len(), 12);
}

#[test]
fn a_saved_hoist_goes_on_with_the_same_bits() {
    let mut stepper = started(at_rest(6.0, 6, 500.0));
    stepper.set_control(0, 1.0).unwrap();
    stepper.steps(77);
    let mut restored = stepper.saved();
    for k in 0..200 {
        if k == 100 {
            stepper.set_control(0, -2.0).unwrap();
            restored.set_control(0, -2.0).unwrap();
        }
        stepper.step().unwrap();
        restored.step().unwrap();
        assert_eq!(stepper.scene(), restored.scene());
    }
    let stock = stepper.scene().cables[0].stock.as_ref();
    assert_eq!(stock.unwrap().named, 9);
}

/// Moments of twist bend the joints: their stiffness is that of the cut segments.
#[test]
fn a_saved_hoist_that_twists_goes_on_with_the_same_bits() {
    for (substeps, speed) in [(1, 1.0), (4, -0.5), (4, 0.5), (16, -1.0)] {
        let mut scene = hoist_with(6.0, 2, 50.0, 0.0, CableEnd::Clamped);
        let (load, lead) = (scene.load.unwrap(), scene.cables[0].joints[0]);
        scene.controls.push(Control::of("hoist", lead, 1.0));
        // Under its weight the rope would resist the moments.
        scene.gravity.z = 0.0;
        scene.bodies.angular_velocity[load] = Vector3::new(0.3, -0.2, 8.0);
        let options = StepOptions::default().with(|o| o.substeps = substeps);
        let mut stepper = Stepper::new(scene, options).unwrap();
        stepper.set_control(0, speed).unwrap();
        for _ in 0..60 {
            let mut restored = stepper.saved();
            stepper.step().unwrap();
            restored.step().unwrap();
            assert_eq!(stepper.scene(), restored.scene(), "{substeps} sub-steps");
            assert_eq!(stepper.multipliers(), restored.multipliers());
        }
    }
}

#[test]
fn handles_follow_what_a_winch_inserts() {
    let mut stepper = started(at_rest(6.0, 6, 500.0));
    let ids = (1..=6).map(|n| stepper.body(&format!("rope-{n}")).unwrap());
    let ids: Vec<_> = ids.collect();
    stepper.set_control(0, 1.0).unwrap();
    stepper.steps(120);
    for (n, id) in ids.iter().enumerate() {
        let name = &stepper.scene().body_names[stepper.body_index(*id).unwrap()];
        assert_eq!(*name, format!("rope-{}", n + 1));
    }
    stepper.set_control(0, -1.0).unwrap();
    stepper.steps(300);
    let there = ids.iter();
    let there: Vec<bool> = there.map(|id| stepper.body_index(*id).is_ok()).collect();
    assert_eq!(there, [true, false, false, false, true, true]);
}

#[test]
fn a_winch_too_fast_for_its_segments_is_refused() {
    let mut stepper = started(at_rest(6.0, 6, 500.0));
    stepper.step().unwrap();
    let before = stepper.save().unwrap();
    stepper.set_control(0, -16.0).unwrap();
    let error = stepper.step().unwrap_err().to_string();
    let holds = error.contains("rope-start") && error.contains("quarter of a segment");
    assert!(holds, "{error}");
    stepper.set_control(0, 0.0).unwrap();
    assert_eq!(stepper.save().unwrap(), before);
    stepper.set_control(0, -14.0).unwrap();
    stepper.steps(60);
    // It stops at half a segment.
    assert!((seen(&stepper).2.length - 0.5).abs() < 1e-12);
}
