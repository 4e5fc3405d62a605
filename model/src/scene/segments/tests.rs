//! Invariants of splitting and merging, anywhere in a cable.

use super::*;
use crate::constraint::testing::Poses;
use crate::{Cable, CableEnd, Collider, Linearized, Material, Segments, Surface};

const LENGTHS: [f64; 6] = [0.5, 1.25, 0.75, 1.5, 0.25, 1.75];

/// Six segments, 6 m along `to`, between the world and a load, each turned about its axis by 0.2 rad a metre.
fn cable(to: Vector3<f64>, held: [fn(Frame) -> CableEnd; 2]) -> Scene {
    let mut scene = Scene::new("segments");
    scene.gravity.z = -9.81;
    let load = scene.add_body("load", Body::sphere(0.2, 50.0).at(to * 6.0));
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(load, Vector3::zeros()),
    ];
    let cable = Cable {
        segments: Segments::Lengths(LENGTHS.to_vec()),
        resolution: Some(Resolution::default()),
        collide: Some(Surface::default()),
        ..Cable::round(
            "rope",
            &Material::NYLON,
            0.02,
            [held[0](frames[0]), held[1](frames[1])],
        )
    };
    let parts = scene.add_cable(&cable).expect("laid");
    let mut place = 0.0;
    for (body, length) in parts.bodies.into_iter().zip(LENGTHS) {
        let turn = 0.2 * (place + 0.5 * length);
        scene.bodies.orientation[body] *=
            UnitQuaternion::from_axis_angle(&-Vector3::z_axis(), turn);
        place += length;
    }
    scene.bodies.orientation[load] *= UnitQuaternion::from_axis_angle(&-Vector3::z_axis(), 1.2);
    crate::update_windings(&mut scene, 0.0);
    scene
}

fn free(frame: Frame) -> CableEnd {
    CableEnd::Free(frame.resolve(&crate::Bodies::new(), 0.0).point())
}

/// Momentum, angular momentum, mass, length of the rods, sum of the twists of the inner joints and of the clamped ends.
fn sums(scene: &Scene) -> (Vector3<f64>, Vector3<f64>, [f64; 3]) {
    let about = Vector3::new(0.3, 0.2, -0.5);
    let rows = Linearized::at(scene, 0.0);
    let joints = scene.cables[0].joints.iter();
    let twisted = joints.filter(|c| rows.row_range(**c).len() == 6);
    let twist = twisted.map(|c| rows.phi[rows.row_range(*c).end - 1]).sum();
    let rods = scene.colliders.iter().map(|c| match c.shape {
        Shape::Capsule { length, .. } => length,
        _ => f64::NAN,
    });
    (
        scene.momentum(),
        scene.angular_momentum(&about),
        [scene.mass(), rods.sum(), twist],
    )
}

/// Moves the cable; its segments are bent and their rates differ by `rough`.
fn stir(scene: &mut Scene, random: &mut Poses, bend: f64, rough: f64) {
    let omega = random.vector() * 0.5;
    for body in scene.cables[0].bodies.clone() {
        let turn = UnitQuaternion::from_scaled_axis(random.vector() * bend);
        let bodies = &mut scene.bodies;
        bodies.orientation[body] = turn * bodies.orientation[body];
        bodies.velocity[body] = omega.cross(&bodies.position[body]) + random.vector() * rough;
        bodies.angular_velocity[body] = omega + random.vector() * rough;
        bodies.force[body] = random.vector();
    }
}

fn merge(scene: &mut Scene, segment: usize) -> Merged {
    let merged = scene.merge_segments((0, segment), 0.0).expect("merges");
    scene.remove(&[merged.body], &[merged.joint]).expect("goes");
    merged
}

type Held = fn(Frame) -> CableEnd;

const ENDS: [[Held; 2]; 3] = [
    [CableEnd::Clamped, CableEnd::Clamped],
    [CableEnd::Pinned, CableEnd::Pinned],
    [CableEnd::Pinned, CableEnd::Clamped],
];

#[test]
fn mass_length_momenta_and_twist_stay() {
    for (seed, ends) in ENDS.into_iter().enumerate() {
        for (segment, splits) in [
            (0, true),
            (3, true),
            (5, true),
            (0, false),
            (2, false),
            (4, false),
        ] {
            for bend in [0.0, 1e-2] {
                let mut random = Poses::new(seed as u64);
                let mut scene = cable(random.vector().normalize(), ends);
                stir(&mut scene, &mut random, bend, 0.1);
                let before = sums(&scene);
                let energies = [scene.kinetic_energy(), scene.potential_energy()];
                let force: Vector3<f64> = scene.bodies.force.iter().sum();
                let jump = if splits {
                    let keep = 0.4 * LENGTHS[segment];
                    scene
                        .split_segment((0, segment), keep, 0.0)
                        .expect("splits")
                        .jump
                } else {
                    merge(&mut scene, segment).jump
                };
                assert_eq!(scene.validate(), Ok(()));
                let after = sums(&scene);
                assert!((after.0 - before.0).norm() < 1e-12 * before.0.norm());
                let mut turned = after.1 - before.1;
                // Both are small here: what a part of the angular momentum is about the axis, and what moving adds.
                assert!((turned.norm() - jump.unspun).abs() < 1e-11 * before.1.norm());
                assert!(jump.unspun < (bend + 1e-12) * before.1.norm());
                assert!(jump.moved.abs() < 10.0 * bend * energies[0] + 1e-12);
                if bend > 0.0 {
                    // But about the axis that the segments share: see the module.
                    let own = |k: usize| scene.cables[0].bodies[k];
                    let place = |k: usize| scene.bodies.position[own(k)];
                    let axis = if splits {
                        (place(segment + 1) - place(segment)).normalize()
                    } else {
                        scene.bodies.orientation[own(segment)] * Vector3::z()
                    };
                    turned -= axis * axis.dot(&turned);
                }
                let off = turned.norm();
                assert!(off < 1e-12 * before.1.norm(), "{segment} {splits} {turned}");
                for (after, before) in after.2.iter().zip(before.2).take(2) {
                    assert!((after / before - 1.0).abs() < 1e-12, "{after} {before}");
                }
                let holonomy = 10.0 * bend * bend;
                // At a pinned end two that merge are free to turn back.
                let turns_back = !splits && (segment == 0 && seed > 0 || segment == 4 && seed == 1);
                let twisted = if turns_back {
                    0.0
                } else {
                    (after.2[2] - before.2[2]).abs()
                };
                let holds = twisted < 1e-12 + holonomy;
                assert!(holds, "{seed} {segment} {splits} {twisted}");
                let pull: Vector3<f64> = scene.bodies.force.iter().sum();
                assert!((pull - force).norm() < 1e-12);
                let error = jump.blow + jump.moved - jump.kinetic;
                assert!(error.abs() < 1e-10 * energies[0], "{error:e}");
                let gained = [
                    scene.kinetic_energy() - energies[0],
                    scene.potential_energy() - energies[1],
                ];
                for (gained, told) in gained.into_iter().zip([jump.kinetic, jump.gravity]) {
                    let off = (gained - told).abs();
                    assert!(off < 1e-10 * energies[0], "{gained} {told}");
                }
            }
        }
    }
}

/// In one line and unstrained a merge loses ½ uᵀ K⁻¹ u, and a split nothing.
#[test]
fn a_merge_loses_the_energy_of_a_blow() {
    for seed in 0..20 {
        let mut random = Poses::new(seed);
        let mut scene = cable(random.vector().normalize(), ENDS[0]);
        stir(&mut scene, &mut random, 0.0, 1.0);
        let energy = scene.kinetic_energy();
        let split = scene.split_segment((0, 3), 0.6, 0.0).expect("splits");
        assert!((scene.kinetic_energy() - energy).abs() < 1e-12 * energy);
        assert!(split.jump.kinetic.abs() < 1e-12 * energy);
        // The halves of a split merge without loss.
        let whole = merge(&mut scene, 3).jump;
        assert!(whole.kinetic.abs() < 1e-12 * energy && whole.blow.abs() < 1e-12 * energy);
        let lost = merge(&mut scene, 2).jump;
        assert!(lost.blow < -1e-3 * energy && lost.moved.abs() < 1e-12 * energy);
        let error = lost.kinetic / lost.blow - 1.0;
        assert!(error.abs() < 1e-10, "{error:e}");
    }
}

/// −φ/ε is the tension at each joint of a cable at rest; it is so after any split and merge.
#[test]
fn what_hangs_at_rest_stays_at_rest() {
    let [pull, gravity] = [400.0, 9.81];
    for (segment, splits) in [
        (0, true),
        (3, true),
        (5, true),
        (0, false),
        (2, false),
        (4, false),
    ] {
        let mut scene = cable(-Vector3::z(), ENDS[1]);
        let density = scene.cables[0].stock.as_ref().expect("a stock").density;
        let tension = |below: f64| pull + density * gravity * below;
        let parts = scene.cables[0].clone();
        let (mut below, mut place) = (6.0, 0.0);
        for ((&body, &joint), length) in parts.bodies.iter().zip(&parts.joints).zip(LENGTHS) {
            place -= scene.constraints[joint].row(0).1.compliance * tension(below) + 0.5 * length;
            scene.bodies.position[body] = Vector3::z() * place;
            place -= 0.5 * length;
            below -= length;
        }
        let end = parts.joints[6];
        place -= scene.constraints[end].row(0).1.compliance * tension(0.0);
        scene.bodies.position[0] = Vector3::z() * place;
        let at = scene.bodies.position.clone();
        if splits {
            scene
                .split_segment((0, segment), 0.4 * LENGTHS[segment], 0.0)
                .expect("splits");
        } else {
            merge(&mut scene, segment);
        }
        let still = scene.bodies.position.iter();
        let still = still.filter(|place| at.contains(place)).count();
        assert_eq!(still, if splits { 6 } else { 5 });
        let rows = Linearized::at(&scene, 0.0);
        let mut below = 6.0;
        let parts = &scene.cables[0];
        for (n, joint) in parts.joints.iter().enumerate() {
            let row = rows.row_range(*joint).start + 2;
            let strained = (rows.phi[row] / rows.compliance[row]).abs();
            let off = (strained / tension(below) - 1.0).abs();
            assert!(off < 1e-8, "{n}: {strained}");
            below -= parts
                .bodies
                .get(n)
                .map_or(0.0, |body| scene.bodies.mass[*body])
                / density;
        }
    }
}

#[test]
fn a_free_end_takes_up_what_a_bent_pair_is_shorter_by() {
    let mut scene = cable(Vector3::x(), [free, CableEnd::Pinned]);
    assert!(scene.cables[0].joints.len() == 6);
    let (count, mass) = (scene.bodies.len(), scene.mass());
    let split = scene.split_segment((0, 0), 0.2, 0.0).expect("splits");
    assert_eq!(split.around[0], None);
    assert_eq!(scene.validate(), Ok(()));
    merge(&mut scene, 0);
    assert_eq!((scene.bodies.len(), scene.validate()), (count, Ok(())));
    assert!((scene.mass() - mass).abs() < 1e-12);
    let parts = scene.cables[0].clone();
    scene.bodies.orientation[parts.bodies[0]] *=
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.1);
    let gap = |scene: &Scene| scene.gap_at(Some(parts.joints[1]), 0.0);
    let before = gap(&scene);
    merge(&mut scene, 0);
    let joint = scene.cables[0].joints[0];
    assert!((scene.gap_at(Some(joint), 0.0) - before).norm() < 1e-12);
}

#[test]
fn what_cannot_split_or_merge_is_left() {
    let mut scene = cable(Vector3::x(), ENDS[0]);
    let before = scene.clone();
    for keep in [0.0, -1.0, 1.5, f64::NAN] {
        assert_eq!(scene.split_segment((0, 3), keep, 0.0), None);
    }
    assert_eq!(scene.split_segment((0, 6), 0.1, 0.0), None);
    assert_eq!(scene.split_segment((1, 0), 0.1, 0.0), None);
    assert_eq!(scene.merge_segments((0, 5), 0.0), None);
    assert_eq!(scene, before);
    let joint = scene.cables[0].joints[3];
    scene.remove(&[], &[joint]).expect("cut");
    assert_eq!(scene.merge_segments((0, 2), 0.0), None);
    scene.cables[0].stock = None;
    assert_eq!(scene.merge_segments((0, 0), 0.0), None);
    scene.add_collider(Collider::new(
        "hook",
        Some(1),
        Shape::Sphere { radius: 0.1 },
    ));
    assert!(scene.unresolved(&scene.joints_of_segments())[1]);
}

/// Splits and merges share the twists themselves, by whatever the references lag.
#[test]
fn references_that_lag_share_the_same_twists() {
    let edited = |lag: f64, splits: bool| {
        let mut scene = cable(Vector3::z(), ENDS[0]);
        for joint in scene.cables[0].joints.clone() {
            if let Some(twist) = scene.constraints[joint].twist_reference() {
                scene.constraints[joint].set_twist_reference(twist + lag);
            }
        }
        if splits {
            let keep = 0.4 * LENGTHS[3];
            scene.split_segment((0, 3), keep, 0.0).expect("splits");
        } else {
            merge(&mut scene, 2);
        }
        scene.bodies.orientation.clone()
    };
    for splits in [true, false] {
        assert_eq!(edited(0.0, splits), edited(0.3, splits));
    }
}
