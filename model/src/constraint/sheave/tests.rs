use super::*;
use crate::constraint::testing::{BAR, LAW, Poses};
use crate::testing::*;
use std::f64::consts::PI;

/// A cable through points (side, point, radius; 0 is a point) about the axis y, with its scene.
fn scene(bodies: Vec<Body>, through: &[(Option<usize>, Vector3<f64>, f64, f64)]) -> Scene {
    let mut scene = Scene::new("reeved");
    for (i, body) in bodies.into_iter().enumerate() {
        scene.add_body(format!("body-{i}"), body);
    }
    let frame = |side: Option<usize>, point: Vector3<f64>, sense: f64| {
        let frame = side.map_or(Frame::world(point), |i| Frame::body(i, point));
        frame.along(&(Vector3::y() * sense))
    };
    let frames = through.iter();
    let frames = frames.map(|&(side, point, _, s)| frame(side, point, s));
    let sheaves = through.iter();
    let sheaves = sheaves.map(|&(_, _, r, _)| (r > 0.0).then(|| Sheave::new(r)));
    let cable =
        MasslessCable::new(frames.collect(), 1.0, LAW).with(|p| p.sheaves = sheaves.collect());
    scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    scene
}

fn cable(scene: &mut Scene) -> &mut MasslessCable {
    match &mut scene.constraints[0] {
        Constraint::MasslessCable(cable) => cable,
        _ => unreachable!(),
    }
}

/// Λ of the scene's cable.
fn length(scene: &Scene) -> f64 {
    let mut phi = [0.0];
    scene.constraints[0].violation(&scene.bodies, 0.0, &mut phi);
    phi[0] + 1.0
}

fn xz(x: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, 0.0, z)
}

#[test]
fn jacobian_at_random_poses() {
    let mut worst = 0.0_f64;
    for seed in 1..=40 {
        let mut poses = Poses::new(seed);
        // Tilted a little, or as they come.
        let tilt = if seed % 2 == 0 { 0.05 } else { 0.6 };
        let mut body = |x: f64| {
            let turned = UnitQuaternion::from_scaled_axis(poses.vector() * tilt);
            Body::sphere(1.0, 1.0)
                .at(xz(x, 0.0) + poses.vector() * 0.5)
                .turned(turned)
        };
        let bodies = vec![body(0.0), body(3.0), body(6.0)];
        let mut off = || poses.vector() * 0.3;
        let through = [
            (None, xz(-3.0, -2.0), 0.0, 1.0),
            (Some(0), off(), 0.4, 1.0),
            (Some(1), off(), 0.3, -1.0),
            (Some(2), off(), 0.0, 1.0),
            (Some(0), off(), 0.2, 1.0),
            (
                None,
                xz(9.0, 2.0),
                0.5,
                if seed % 3 == 0 { 1.0 } else { -1.0 },
            ),
        ];
        let mut scene = scene(bodies, &through);
        // Enough that moving a little does not empty it.
        if let Some(drum) = cable(&mut scene).sheaves[5].as_mut() {
            drum.turns = 2.0;
        }
        let error = crate::check_jacobian(&scene, 0).max;
        assert!(error <= BAR, "{seed}: {error:e}");
        worst = worst.max(error);
    }
    println!("sheaves {worst:.1e}");
}

/// Open and crossed belts about two wheels, and the half turn of two hanging ends.
#[test]
fn lengths_in_the_plane_are_those_of_the_textbook() {
    let (ra, rb, far) = (0.5, 0.2, 2.0_f64);
    for (sense, part) in [(1.0, ra - rb), (-1.0, ra + rb)] {
        let through = [
            (None, xz(0.0, 0.0), ra, 1.0),
            (None, xz(far, 0.0), rb, sense),
        ];
        let straight = length(&scene(vec![], &through));
        let exact = (far * far - part * part).sqrt();
        assert!((straight - exact).abs() < 1e-15, "{straight} {exact}");
    }
    let through = [
        (None, xz(-0.3, -2.0), 0.0, 1.0),
        (None, xz(0.0, 0.0), 0.3, 1.0),
        (None, xz(0.3, -5.0), 0.0, 1.0),
    ];
    let mut over = scene(vec![], &through);
    assert!((length(&over) - (7.0 + 0.3 * PI)).abs() < 1e-14);
    for sheave in cable(&mut over).sheaves.iter_mut().flatten() {
        sheave.turns = 2.0;
    }
    assert!((length(&over) - (7.0 + 0.3 * 5.0 * PI)).abs() < 1e-14);
}

#[test]
fn a_drum_winds_up_what_it_turns_and_has_the_torque_of_its_radius() {
    let drum = Body::sphere(0.4, 10.0);
    let through = [
        (Some(0), Vector3::zeros(), 0.25, 1.0),
        (Some(1), Vector3::zeros(), 0.0, 1.0),
    ];
    let load = Body::particle(1.0).at(xz(0.25, -3.0));
    let mut scene = scene(vec![drum, load], &through);
    for sheave in cable(&mut scene).sheaves.iter_mut().flatten() {
        sheave.turns = 1.5;
    }
    let begin = length(&scene);
    assert!((begin - (3.0 + 0.25 * 3.0 * PI)).abs() < 1e-14);
    scene.constraints[0].update_winding(&scene.bodies, 0.0);
    // Against the sense of the cable's travel it winds up.
    for step in 1..=40 {
        let turned = -0.7 * f64::from(step);
        scene.bodies.orientation[0] = UnitQuaternion::from_scaled_axis(Vector3::y() * turned);
        assert!((length(&scene) - (begin - 0.25 * turned)).abs() < 1e-13);
        scene.constraints[0].update_winding(&scene.bodies, 0.0);
    }
    let lin = Linearized::at(&scene, 0.0);
    let on_drum = lin.block(0);
    // φ̇ = J v: turning with the travel pays out.
    assert!((on_drum[4] + 0.25).abs() < 1e-15, "{:?}", &on_drum[..]);
    assert!((on_drum[2] - 1.0).abs() < 1e-15);
}

#[test]
fn a_cable_leaves_a_sheave_and_lies_down_again_without_a_jump() {
    let body = Body::sphere(0.2, 1.0).at(xz(0.0, 0.5));
    let through = [
        (None, xz(-2.0, 0.0), 0.0, 1.0),
        (Some(0), Vector3::zeros(), 0.1, 1.0),
        (None, xz(2.0, 0.0), 0.0, 1.0),
    ];
    let mut scene = scene(vec![body], &through);
    scene.constraints[0].update_winding(&scene.bodies, 0.0);
    let mut last = length(&scene);
    let mut seen = Vec::new();
    let heights = (0..=140).map(|k| 0.5 - 0.005 * f64::from(k));
    let back: Vec<f64> = heights.clone().collect();
    for z in heights.chain(back.into_iter().rev()) {
        scene.bodies.position[0].z = z;
        scene.constraints[0].update_winding(&scene.bodies, 0.0);
        let now = length(&scene);
        assert!((now - last).abs() < 0.005, "at {z}: {last} to {now}");
        let is_off = cable(&mut scene).sheaves[1].unwrap().contact.is_off();
        let touches = z > -0.1;
        if (z + 0.1).abs() > 1e-9 {
            assert_eq!(is_off, !touches, "at {z}");
        }
        let exact = if is_off { 4.0 } else { now };
        assert!((now - exact).abs() < 1e-15);
        seen.push(is_off);
        last = now;
    }
    assert!(seen.contains(&true) && !seen[seen.len() - 1]);
}

#[test]
fn no_tangent_is_no_number() {
    let inside = [
        (None, xz(0.1, 0.0), 0.0, 1.0),
        (None, xz(0.0, 0.0), 0.3, 1.0),
    ];
    assert!(length(&scene(vec![], &inside)).is_nan());
    let crossed = [
        (None, xz(0.0, 0.0), 0.3, 1.0),
        (None, xz(0.4, 0.0), 0.3, -1.0),
    ];
    assert!(length(&scene(vec![], &crossed)).is_nan());
}

#[test]
fn a_straight_rope_about_whole_turns_has_as_many_in_every_direction() {
    for k in 0..40 {
        let (sine, cosine) = (0.157 * f64::from(k)).sin_cos();
        let at = |along: f64, across: f64| {
            xz(
                along * cosine - across * sine,
                along * sine + across * cosine,
            )
        };
        let through = [
            (None, at(-2.0, 0.3), 0.0, 1.0),
            (None, at(0.0, 0.0), 0.3, 1.0),
            (None, at(3.0, 0.3), 0.0, 1.0),
        ];
        let mut scene = scene(vec![], &through);
        if let Some(sheave) = cable(&mut scene).sheaves[1].as_mut() {
            sheave.turns = 3.0;
        }
        let exact = 5.0 + 0.3 * 6.0 * PI;
        assert!((length(&scene) - exact).abs() < 1e-12, "{k}");
    }
}
