//! The sign of a cable's tension: whatever it is made of, held by and laid like.

use crate::testing::*;

/// A straight cable along `along` (m), whose ends are pinned or clamped to a body each, and its name.
fn laid(
    material: &Material,
    joint: JointKind,
    pinned: [bool; 2],
    along: Vector3<f64>,
    bend: bool,
) -> Scene {
    let mut scene = Scene::new("cable");
    let a = scene.add_body("a", Body::sphere(0.2, 10.0));
    let b = scene.add_body("b", Body::sphere(0.2, 900.0).at(along));
    let end = |body: usize, pinned: bool| {
        let frame = centre(body);
        if pinned {
            CableEnd::Pinned(frame)
        } else {
            CableEnd::Clamped(frame)
        }
    };
    let cable = Cable {
        segments: Segments::Equal(3),
        joint,
        bend,
        ..Cable::round(
            "rope",
            material,
            0.013,
            [end(a, pinned[0]), end(b, pinned[1])],
        )
    };
    scene.add_cable(&cable).expect("is laid");
    scene
}

/// A chain of rods on ball joints.
fn chain(along: Vector3<f64>) -> Scene {
    let (ball, free) = (JointKind::Spherical, [true, true]);
    laid(&Material::STEEL, ball, free, along, true)
}

/// Multipliers of a joint that pulls the points before it and after it together with the force `tension` (N).
fn pulling(constraint: &Constraint, scene: &Scene, along: &Vector3<f64>, tension: f64) -> [f64; 6] {
    let place = |frame: &Frame| match frame.side {
        Side::World(_) => panic!("held by bodies"),
        Side::Body(body) => scene.bodies.position[body].dot(along),
    };
    let [a, b] = [0, 1].map(|side: usize| place(&constraint.frames()[side]));
    let force = along.normalize() * (tension * (b - a).signum());
    [force.x, force.y, force.z, 0.3, -0.2, 0.1]
}

#[test]
fn a_cable_pulls_with_a_positive_and_pushes_with_a_negative_tension() {
    let ends = [[true, true], [true, false], [false, true], [false, false]];
    let kinds = [JointKind::Cosserat, JointKind::Paper, JointKind::Spherical];
    let mut joints = 0;
    for material in [&Material::STEEL, &Material::NYLON, &Material::RUBBER] {
        for along in [Vector3::z() * -7.0, Vector3::new(2.0, 3.0, -1.0)] {
            for (kind, pinned, bend) in kinds
                .into_iter()
                .flat_map(|kind| ends.map(|ends| (kind, ends)))
                .flat_map(|(kind, ends)| [true, false].map(|bend| (kind, ends, bend)))
            {
                if kind == JointKind::Spherical && pinned != [true, true] {
                    continue;
                }
                let mut scene = laid(material, kind, pinned, along, bend);
                for swapped in [false, true] {
                    for joint in scene.cables[0].joints.clone() {
                        if swapped {
                            scene.constraints[joint].frames_mut().swap(0, 1);
                        }
                        for tension in [3.7e4, -381e3] {
                            let lambda =
                                pulling(&scene.constraints[joint], &scene, &along, tension);
                            let loads = scene.loads(joint, 0.0, &lambda).expect("is there");
                            let found = loads.tension.expect("a tension");
                            assert!(
                                (found / tension - 1.0).abs() < 1e-9,
                                "{kind:?} {pinned:?} {bend} {swapped} {joint}: {found} {tension}"
                            );
                            joints += 1;
                        }
                    }
                }
            }
        }
    }
    assert!(joints > 1000, "{joints}");
    assert_eq!(Scene::new("none").loads(0, 0.0, &[]), None);
}

/// Outside cables a ball joint has no direction.
#[test]
fn a_ball_joint_alone_has_the_size_of_its_force() {
    let along = Vector3::x() * 2.0;
    let mut scene = chain(along);
    scene.cables.clear();
    let lambda = [-3.0, 0.0, 4.0];
    for joint in 0..scene.constraints.len() {
        let loads = scene.loads(joint, 0.0, &lambda);
        assert_eq!(loads.expect("is there").tension, Some(5.0));
    }
}

/// A chain that is folded back onto itself, or bent: along the mean of its links.
#[test]
fn a_bent_chain_pulls_along_the_mean_of_its_links() {
    let along = Vector3::x() * 3.0;
    let mut scene = chain(along);
    let joint = scene.cables[0].joints[1];
    let turned = scene.cables[0].bodies[1];
    for (angle, expected) in [
        (0.8_f64, 100.0 * 0.4_f64.cos()),
        (2.0, 100.0 * 1.0_f64.cos()),
    ] {
        let axis = Vector3::z() * angle;
        let straight = chain(along);
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(axis);
        scene.bodies.orientation[turned] = turn * straight.bodies.orientation[turned];
        let loads = scene.loads(joint, 0.0, &[100.0, 0.0, 0.0]);
        let found = loads.and_then(|loads| loads.tension).expect("one");
        assert!((found - expected).abs() < 1e-9, "{angle}: {found}");
    }
}
