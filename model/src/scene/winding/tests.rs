//! Invariants of splitting and merging at a winch.

use super::*;
use crate::constraint::testing::Poses;
use crate::testing::*;

/// Six segments of 1 m along `to` with a winch, held at both ends, each turned about its axis by 0.2 rad more than the
/// one before.
fn cable(to: Vector3<f64>, held: fn(Frame) -> CableEnd) -> Scene {
    let mut scene = Scene::new("winding");
    let load = scene.add_body("load", Body::sphere(0.2, 50.0).at(to));
    let ends = [origin(), centre(load)];
    let cable = Cable::round("rope", &Material::NYLON, 0.02, ends.map(held))
        .with(|p| (p.segments, p.winch) = (Segments::Equal(6), Some(Winch::new())));
    let parts = scene.add_cable(&cable).expect("laid");
    for (k, body) in parts.bodies.into_iter().enumerate() {
        let turn = UnitQuaternion::from_axis_angle(&-Vector3::z_axis(), 0.2 * (k as f64 + 0.5));
        scene.bodies.orientation[body] *= turn;
    }
    crate::update_windings(&mut scene, 0.0);
    scene
}

/// The fairlead is always the first constraint. What is fed moves the whole cable.
fn feed(scene: &mut Scene, by: f64) {
    let first = lead(scene).frames[1].body_index().expect("a body");
    let along = scene.bodies.orientation[first] * lead(scene).along();
    for place in &mut scene.bodies.position {
        *place += along * by;
    }
    assert!(scene.cut_at_winch(0, 0.0, by));
}

fn lead(scene: &Scene) -> &Fairlead {
    scene.lead(0).expect("a fairlead")
}

fn stock(scene: &Scene) -> &crate::scene::Stock {
    scene.cables[0].stock.as_ref().expect("a stock")
}

/// Splits and merges until nothing is due; how often each.
fn wind(scene: &mut Scene) -> [usize; 2] {
    let mut count = [0; 2];
    while let Some(splits) = scene.winding_due(0) {
        if splits {
            scene.split_at_winch(0, 0.0).expect("splits");
        } else {
            let merged = scene.merge_at_winch(0, 0.0).expect("merges");
            scene.remove(&[merged.body], &[merged.joint]).expect("goes");
        }
        count[usize::from(!splits)] += 1;
    }
    count
}

/// Length of cable off the drum by its masses, and sum of the twists.
fn measures(scene: &Scene) -> [f64; 2] {
    let parts = &scene.cables[0];
    let mass = parts.bodies.iter();
    let mass: f64 = mass.map(|body| scene.bodies.mass[*body]).sum();
    let rows = Linearized::at(scene, 0.0);
    let twisted = parts.joints.iter();
    let twisted = twisted.filter(|c| rows.row_range(**c).len() == 6);
    let twist = twisted.map(|c| rows.phi[rows.row_range(*c).end - 1]).sum();
    [mass / stock(scene).density, twist]
}

/// A cable at rest under its own weight stays so: −φ/ε is the tension at each joint.
#[test]
fn what_hangs_at_rest_stays_at_rest() {
    for by in [0.6, -0.55] {
        let mut scene = cable(-Vector3::z() * 6.0, CableEnd::Pinned);
        feed(&mut scene, by);
        let (density, pull, gravity) = (stock(&scene).density, 400.0, 9.81);
        let parts = scene.cables[0].clone();
        let tension = |below: f64| pull + density * gravity * below;
        let (mut below, mut place) = (6.0 + by, 0.0);
        for (body, joint) in parts.bodies.iter().zip(&parts.joints) {
            let length = scene.bodies.mass[*body] / density;
            let (_, law) = scene.constraints[*joint].row(0);
            place -= law.compliance * tension(below) + 0.5 * length;
            scene.bodies.position[*body] = Vector3::z() * place;
            place -= 0.5 * length;
            below -= length;
        }
        let end = *parts.joints.last().expect("an end");
        place -= scene.constraints[end].row(0).1.compliance * tension(0.0);
        scene.bodies.position[0] = Vector3::z() * place;
        let before = scene.bodies.position[parts.bodies[2]];
        let count = wind(&mut scene);
        assert_eq!(count[0] + count[1], 1);
        let mut kept = scene.body_names.iter();
        let kept = kept.position(|name| name == "rope-3").expect("there");
        assert_eq!(scene.bodies.position[kept], before);
        let rows = Linearized::at(&scene, 0.0);
        let mut below = 6.0 + by;
        for (n, joint) in scene.cables[0].joints.iter().enumerate() {
            let row = rows.row_range(*joint).start + if n == 0 { 0 } else { 2 };
            let strained = (rows.phi[row] / rows.compliance[row]).abs();
            let off = (strained / tension(below) - 1.0).abs();
            assert!(off < 1e-8, "{n}: {strained}");
            if let Some(body) = scene.cables[0].bodies.get(n) {
                below -= scene.bodies.mass[*body] / density;
            }
        }
    }
}

#[test]
fn a_cable_wound_in_and_out_is_a_cable() {
    let [mut random, mut speeds] = [7, 8].map(Poses::new);
    let mut scene = cable(-Vector3::z() * 6.0, CableEnd::Clamped);
    let about = |by: f64| UnitQuaternion::from_axis_angle(&-Vector3::z_axis(), by);
    scene.bodies.orientation[0] = about(2.0);
    scene.break_at(2, 1e4);
    let (mut splits, mut merges, mut length) = (0, 0, 6.0);
    for _ in 0..400 {
        let by = (0.45 * random.number()).max(0.55 - lead(&scene).length);
        if by == 0.0 {
            continue;
        }
        feed(&mut scene, by);
        length += by;
        for (k, body) in scene.cables[0].bodies.clone().into_iter().enumerate() {
            // As torsion would: alike along the cable.
            let place = lead(&scene).first + k as f64
                - if k == 0 {
                    0.5 * lead(&scene).first
                } else {
                    0.5
                };
            scene.bodies.orientation[body] = about(2.0 * place / length);
        }
        crate::update_windings(&mut scene, 0.0);
        let twist = measures(&scene)[1];
        assert!((twist - 2.0).abs() < 1e-11, "{twist}");
        for velocity in &mut scene.bodies.velocity {
            *velocity = speeds.vector() * 0.1;
        }
        let momentum = scene.momentum();
        let [split, merged] = wind(&mut scene);
        assert!((scene.momentum() - momentum).norm() < 1e-12 * scene.mass());
        (splits, merges) = (splits + split, merges + merged);
        assert_eq!(scene.validate(), Ok(()));
        let [by_mass, twisted] = measures(&scene);
        assert!((twisted - twist).abs() < 1e-11, "{twisted} {twist}");
        let lead = lead(&scene);
        assert!((by_mass - length).abs() < 1e-11 && (lead.length - length).abs() < 1e-11);
        let parts = &scene.cables[0];
        assert_eq!(parts.bodies.len() + 1, parts.joints.len());
        assert!(parts.joints.is_sorted() && parts.bodies.is_sorted());
        let whole = parts.bodies.len() - 1;
        assert!((lead.first + whole as f64 - length).abs() < 1e-11);
        assert!((0.49..=1.51).contains(&lead.first) || whole == 0);
    }
    assert!(splits > 30 && merges > 30, "{splits} {merges}");
    let mut breaks = scene.events.iter();
    let breaks = breaks.all(|event| event.name.ends_with("breaks"));
    assert!(breaks);
}

#[test]
fn others_hold_on_to_the_material() {
    let mut scene = cable(-Vector3::z() * 6.0, CableEnd::Pinned);
    let second = scene.cables[0].bodies[1];
    let point = Vector3::new(0.05, 0.0, 0.2);
    let held = scene.bodies.point_world(second, &point);
    let frames = [Frame::world(held), Frame::body(second, point)];
    let stretch = RowLaw::RIGID;
    scene.add_constraint("hook", Spherical { frames, stretch }, 0);
    let at = |scene: &Scene| {
        let hook = scene.constraint("hook").expect("there");
        scene.constraints[hook].frames()[1]
            .resolve(&scene.bodies, 0.0)
            .point()
    };
    for (by, count) in [(-0.6, [0, 1]), (0.6, [1, 0])] {
        let held = at(&scene);
        feed(&mut scene, by);
        assert!((at(&scene) - held + Vector3::z() * by).norm() < 1e-12);
        assert_eq!(wind(&mut scene), count);
        // The segments have turned by what they were twisted against each other.
        let moved = at(&scene) - held + Vector3::z() * by;
        let holds = moved.norm() < 0.25 * 0.05 && moved.z.abs() < 1e-12;
        assert!(holds, "{moved}");
    }
}

#[test]
fn a_winch_without_cable_is_refused() {
    let mut scene = cable(-Vector3::z() * 6.0, CableEnd::Pinned);
    scene.cables.clear();
    let fault = scene.validate().expect_err("a fault").to_string();
    let says = fault.contains("`rope-start`: is a winch without a cable");
    assert!(says, "{fault}");
    assert_eq!(scene.winding_due(0), None);
}

#[test]
fn laws_are_those_of_the_lengths() {
    let mut scene = cable(-Vector3::z() * 6.0, CableEnd::Clamped);
    let whole = scene.constraints[3].row(0).1.compliance;
    for (by, lengths) in [(0.2, [1.2, 1.0]), (0.4, [0.6, 1.0]), (-0.4, [1.2, 1.0])] {
        feed(&mut scene, by);
        wind(&mut scene);
        let joints = &scene.cables[0].joints;
        let of = |n: usize| scene.constraints[joints[n]].row(0).1.compliance / whole;
        let [first, second] = lengths;
        assert!((of(0) - 0.5 * first).abs() < 1e-12);
        assert!((of(1) - 0.5 * (first + second)).abs() < 1e-12);
        assert!((of(2) - second).abs() < 1e-12);
    }
    let JointLaw { bend, twist, .. } = lead(&scene).law;
    assert!(bend.is_some() && twist.is_some());
}
