//! Splits and merges that the rule asks for.

use super::*;
use crate::testing::*;

/// Eight segments of 1 m on a circle: neighbours meet at `bend` (rad).
fn arc(bend: f64, rule: Resolution) -> Scene {
    let mut scene = Scene::new("arc");
    let end = Vector3::z() * -8.0;
    let load = scene.add_body("load", Body::sphere(0.2, 50.0).at(end));
    let frames = [origin(), centre(load)];
    let cable = Cable::round("rope", &Material::STEEL, 0.01, frames.map(CableEnd::Pinned))
        .with(|p| (p.segments, p.resolution) = (Segments::Equal(8), Some(rule)));
    let parts = scene.add_cable(&cable).expect("laid");
    for (k, body) in parts.bodies.into_iter().enumerate() {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), bend * k as f64);
        scene.bodies.orientation[body] = turn;
    }
    scene.load = Some(load);
    scene
}

/// The segments that split, and those that merge, at a wave speed (m/s) and a time step of 10 ms, at time `time` (s), where
/// body `touching` touches something.
fn due(scene: &Scene, speed: f64, time: f64, touching: Option<usize>) -> [Vec<usize>; 2] {
    let density = scene.cables[0].stock.as_ref().expect("a stock").density;
    let mut touches = vec![false; scene.bodies.len()];
    if let Some(body) = touching {
        touches[body] = true;
    }
    let rows = crate::Linearized::at(scene, 0.0);
    let mut lambda = vec![0.0; rows.rows()];
    let parts = &scene.cables[0];
    for &joint in &parts.joints {
        let frames = scene.constraints[joint].frames();
        let body = frames.iter().find_map(|frame| {
            let body = frame.body_index()?;
            parts.bodies.contains(&body).then_some(body)
        });
        let along = scene.bodies.orientation[body.expect("a segment")] * -Vector3::z();
        let first = rows.row_range(joint).start;
        lambda[first..first + 3].copy_from_slice((along * density * speed * speed).as_slice());
    }
    let joints = scene.joints_of_segments();
    let view = View {
        time,
        dt: 0.01,
        phi: &rows.phi,
        first_rows: &rows.row_start,
        impulses: &lambda,
        impulse_time: 1.0,
        touching: &touches,
        stays: &scene.unresolved(&joints),
        joints: &joints,
    };
    let (mut wanted, mut due) = (Vec::new(), Vec::new());
    scene.resolution_due(0, &view, &mut wanted, &mut due);
    [true, false].map(|splits| {
        let all = due.iter().filter(|due| due.splits == splits);
        let mut all: Vec<usize> = all.map(|due| due.segment).collect();
        all.sort_unstable();
        all
    })
}

fn rule() -> Resolution {
    Resolution::default().with(|p| (p.phase, p.shortest, p.longest) = (0.0, 0.25, 4.0))
}

const ALL: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
const NONE: [usize; 0] = [];

#[test]
fn a_bend_beyond_the_rule_splits_and_far_below_merges() {
    // Between half of half of the bend and the bend nothing is due.
    for (bend, splits, merges) in [
        // One joint bends each of those at the ends.
        (0.201, &ALL[..], &NONE[..]),
        (0.101, &ALL[1..7], &NONE),
        (0.099, &NONE, &NONE),
        (0.026, &NONE, &NONE),
        (0.024, &NONE, &[0, 2, 4, 6]),
        (0.0, &NONE, &[0, 2, 4, 6]),
    ] {
        let found = due(&arc(bend, rule()), 100.0, 1.0, None);
        assert_eq!(found, [splits, merges], "{bend}");
    }
}

#[test]
fn a_phase_below_the_rule_splits_and_far_above_merges() {
    let rule = rule().with(|p| p.phase = 0.25);
    // c Δt/φ is 0.04 s times the speed: 1 m, and 4 m for two of 1 m to merge.
    for (speed, splits, merges) in [
        (24.9, &ALL[..], &NONE[..]),
        (25.1, &NONE, &NONE),
        (99.0, &NONE, &NONE),
        (101.0, &NONE, &[0, 2, 4, 6]),
    ] {
        let found = due(&arc(0.0, rule.clone()), speed, 1.0, None);
        assert_eq!(found, [splits, merges], "{speed}");
    }
}

#[test]
fn what_touches_is_fine() {
    let scene = arc(0.0, rule());
    let third = scene.cables[0].bodies[3];
    let found = due(&scene, 100.0, 1.0, Some(third));
    assert_eq!(found, [vec![3], vec![0, 4, 6]]);
    let last = rule().with(|p| p.shortest = 0.6);
    let scene = arc(0.0, last);
    assert_eq!(due(&scene, 100.0, 1.0, Some(third))[0], NONE);
}

#[test]
fn merges_wait_for_the_pause_and_splits_do_not() {
    let rule = rule().with(|p| p.since = 0.95);
    assert_eq!(due(&arc(0.0, rule.clone()), 100.0, 1.0, None)[1], NONE);
    assert_eq!(due(&arc(0.0, rule.clone()), 100.0, 1.06, None)[1].len(), 4);
    assert_eq!(due(&arc(0.21, rule), 100.0, 1.0, None)[0], ALL);
}

/// The halves of what has split do not split again before they have moved, nor do their neighbours.
#[test]
fn splits_are_not_contagious() {
    for bend in [0.101, 0.15, 0.19] {
        let mut scene = arc(bend, rule());
        scene.bodies.orientation[scene.cables[0].bodies[0]] *=
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.4 * bend);
        for segment in due(&scene, 100.0, 1.0, None)[0].iter().rev() {
            scene
                .split_segment((0, *segment), 0.5, 0.0)
                .expect("splits");
        }
        assert_eq!(due(&scene, 100.0, 1.0, None)[0], NONE, "{bend}");
    }
}

#[test]
fn what_is_too_short_merges_whatever_the_bend() {
    let coarse = rule().with(|p| p.shortest = 1.5);
    let [_, found] = due(&arc(0.3, coarse.clone()), 100.0, 1.0, None);
    assert_eq!(found, [0, 2, 4, 6]);
    let none = coarse.with(|p| p.longest = 1.9);
    assert_eq!(due(&arc(0.3, none), 100.0, 1.0, None)[1], NONE);
}

/// A segment that is too short waits until its neighbours need not split: nothing splits and merges at once.
#[test]
fn what_is_too_short_waits_for_splits() {
    let mut scene = arc(0.15, rule());
    let third = scene.cables[0].bodies[3];
    scene.bodies.mass[third] *= 0.2;
    assert_eq!(due(&scene, 100.0, 1.0, None), [vec![1, 2, 4, 5, 6], vec![]]);
    for (k, body) in scene.cables[0].bodies.clone().into_iter().enumerate() {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.06 * k as f64);
        scene.bodies.orientation[body] = turn;
    }
    assert_eq!(due(&scene, 100.0, 1.0, None), [vec![], vec![2]]);
}

/// A joint that an event releases stays; one that only breaks by itself may go.
#[test]
fn joints_of_events_stay() {
    let mut scene = arc(0.0, rule());
    let joints = scene.cables[0].joints.clone();
    scene.break_at(joints[3], 1e5);
    assert_eq!(due(&scene, 100.0, 1.0, None)[1], [0, 2, 4, 6]);
    scene.events.push(Event {
        name: "cut".into(),
        when: When::Time(5.0),
        then: vec![Action::Release(joints[3])],
    });
    assert_eq!(due(&scene, 100.0, 1.0, None)[1], [0, 4, 6]);
}

/// Halves of what has split do not merge, nor does what has merged split, whatever the bend.
#[test]
fn nothing_goes_to_and_fro() {
    for step in 0..400 {
        let bend = 1e-3 * f64::from(step);
        let scene = arc(bend, rule());
        let [splits, merges] = due(&scene, 100.0, 1.0, None);
        let mut changed = scene.clone();
        if let Some(&segment) = merges.first() {
            let merged = changed.merge_segments((0, segment), 0.0).expect("merges");
            changed
                .remove(&[merged.body], &[merged.joint])
                .expect("goes");
            let again = due(&changed, 100.0, 2.0, None)[0].clone();
            assert!(!again.contains(&segment), "{bend}: {again:?}");
        } else if let Some(&segment) = splits.first() {
            changed
                .split_segment((0, segment), 0.5, 0.0)
                .expect("splits");
            let again = due(&changed, 100.0, 2.0, None)[1].clone();
            assert!(!again.contains(&segment), "{bend}: {again:?}");
        }
    }
}

#[test]
fn those_that_miss_most_split_first() {
    let cap = Resolution { most: 10, ..rule() };
    let mut scene = arc(0.2, cap);
    for k in [2, 3] {
        // A kink of 0.6 rad between both.
        let body = scene.cables[0].bodies[k];
        let by = if k == 2 { -0.2 } else { 0.2 };
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), by);
        scene.bodies.orientation[body] *= turn;
    }
    assert_eq!(due(&scene, 100.0, 1.0, None)[0], [2, 3]);
    let few = Resolution { most: 3, ..rule() };
    assert_eq!(due(&arc(0.2, few), 100.0, 1.0, None)[0], NONE);
}

#[test]
fn what_holds_other_things_stays() {
    let mut scene = arc(0.21, rule());
    let bodies = scene.cables[0].bodies.clone();
    let point = scene.bodies.position[bodies[2]];
    let frames = [Frame::world(point), centre(bodies[2])];
    let stretch = crate::RowLaw::RIGID;
    scene.add_constraint("hook", crate::Spherical { frames, stretch }, 0);
    scene.load = Some(bodies[5]);
    let sphere = crate::Shape::Sphere { radius: 0.1 };
    scene.add_collider(Collider::new("knot", Some(bodies[7]), sphere));
    assert_eq!(due(&scene, 100.0, 1.0, None)[0], [0, 1, 3, 4, 6]);
    for body in bodies {
        scene.bodies.orientation[body] = UnitQuaternion::identity();
    }
    assert_eq!(due(&scene, 100.0, 1.0, None)[1], [0, 3]);
}

#[test]
fn ends_that_are_clamped_bend() {
    let held = |held: fn(Frame) -> CableEnd| {
        let mut scene = Scene::new("cantilever");
        let cable = Cable {
            segments: Segments::Equal(2),
            resolution: Some(rule()),
            ..Cable::round(
                "rope",
                &Material::STEEL,
                0.01,
                [held(origin()), CableEnd::Free(Vector3::x() * 2.0)],
            )
        };
        let parts = scene.add_cable(&cable).expect("laid");
        for body in parts.bodies {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
            scene.bodies.orientation[body] = turn * scene.bodies.orientation[body];
        }
        due(&scene, 100.0, 1.0, None)
    };
    assert_eq!(held(CableEnd::Clamped)[0], [0]);
    assert_eq!(held(CableEnd::Pinned), [NONE.to_vec(), vec![0]]);
}

/// Rules that no text can hold, too; of others [`crate::scene_file`] tells the line.
#[test]
fn rules_that_cannot_be_are_refused() {
    type Change = fn(&mut Resolution);
    let faults: [(&str, Change); 5] = [
        ("bend", |r| r.bend = 3.2),
        ("longest", |r| r.longest = 0.2),
        ("hysteresis", |r| r.hysteresis = 0.9),
        ("since", |r| r.since = f64::NAN),
        ("most", |r| r.most = 0),
    ];
    for (words, change) in faults {
        let mut scene = arc(0.0, rule());
        let stock = scene.cables[0].stock.as_mut().expect("a stock");
        change(stock.resolution.as_mut().expect("a rule"));
        let fault = scene.validate().expect_err("refused").to_string();
        let start = format!("cable `rope`: resolution: {words} is");
        assert!(fault.starts_with(&start), "{fault}");
    }
}
