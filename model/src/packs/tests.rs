//! Joints in packs beside single ones.

use super::*;
use crate::testing::*;

/// A cable whose joints bend and twist by about `angle`, of every number of joints in the last pack.
fn cable(segments: usize, angle: f64, seed: u64) -> Scene {
    let params =
        HoistParams::default().with(|p| (p.segments, p.anchor) = (segments, crate::End::Clamped));
    let mut scene = params.build().expect("builds");
    let mut state = seed;
    let mut number = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    for q in &mut scene.bodies.orientation {
        *q *= UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| angle * number()));
    }
    for x in &mut scene.bodies.position {
        *x += Vector3::from_fn(|_, _| 0.01 * number());
    }
    scene
}

#[test]
fn lanes_and_single_joints_agree() {
    for segments in [1, 2, 3, 4, 7, 24] {
        for angle in [0.0, 1e-12, 1e-6, 1e-3, 0.05, 0.2, 1.0, 3.0] {
            let mut scene = cable(segments, angle, 7 + segments as u64);
            let mut lin = Linearized::new(&scene);
            for _ in 0..2 {
                lin.update(&scene, 0.0);
                assert_agree(&lin, &scene, &format!("{segments} {angle}"));
                lin.follow_windings(&mut scene, 0.0);
            }
        }
    }
}

/// Joints in lanes have the rows that they have one by one.
fn assert_agree(lin: &Linearized, scene: &Scene, case: &str) {
    for (k, c) in scene.constraints.iter().enumerate() {
        let rows = lin.row_range(k);
        let mut phi = vec![0.0; rows.len()];
        let (mut blocks, mut levers) = ([0.0; 12 * MAX_ROWS], [Vector3::zeros(); 2]);
        let mut out = Rows::new(&mut phi, &mut blocks, &mut levers);
        c.evaluate(&scene.bodies, 0.0, &mut out);
        // Towards the fold the rows, and what rounding of the axes makes of them, grow without bound.
        let size = blocks.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        let blocks = blocks.chunks_exact(6 * rows.len());
        for (slot, exact) in lin.slot_range(k).zip(blocks) {
            for (found, exact) in lin.block(slot).iter().zip(exact) {
                let error = (found - exact).abs();
                assert!(error < 4e-15 * size, "{case} {k}: {found} {exact}");
            }
        }
        for (found, exact) in lin.phi[rows].iter().zip(&phi) {
            let error = (found - exact).abs();
            assert!(error < 2e-15 * size, "{case} {k}: {found} {exact}");
        }
        let error = crate::check_jacobian(scene, k).max;
        assert!(error < 1e-8, "{case} {k}: {error:e}");
    }
    let finite = |slot: usize| lin.block(slot).iter().all(|x| x.is_finite());
    assert!((0..lin.slots.len()).all(finite), "{case}");
}

/// Joints with all angles, bends, twist or none, packs of one kind and of several, frames along any axes that are
/// parallel or not, bodies in any order: lanes do them all, and the angles follow their windings.
#[test]
fn lanes_do_joints_of_every_kind() {
    let turn = |x: f64, y: f64, z: f64| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z));
        turn.to_rotation_matrix().into_inner()
    };
    let mut followed = [0; 2];
    for (kinds, reversed) in [
        ([0; 4], false),
        ([1; 4], false),
        ([2; 4], true),
        ([3; 4], true),
        ([0, 1, 2, 3], false),
        ([3, 0, 0, 1], true),
    ] {
        for lean in [0.0, 1e-9, 1.0] {
            let mut scene = cable(11, 0.05, 5);
            for (k, c) in scene.constraints.iter_mut().enumerate() {
                // The load hangs on a ball joint.
                let Constraint::Cosserat(c) = c else {
                    continue;
                };
                c.twist_reference = if k % 3 == 1 { 2.0 } else { 0.0 };
                let kind = kinds[k % 4];
                c.law.bend = c.law.bend.filter(|_| [0, 1].contains(&kind));
                c.law.twist = c.law.twist.filter(|_| [0, 2].contains(&kind));
                // Exact axes have a between whose cosine is 1 where they lean little.
                let skew = if lean == 1e-9 { 0.0 } else { 1.0 };
                let a = turn(0.3 * skew * k as f64, skew, -0.4 * skew) * c.frames[0].axes;
                let between = turn(0.1 * lean, -0.05 * lean, 0.02 * lean * k as f64);
                // Bends do not see a half turn of the axes about u.
                let half = turn(if kind == 1 { std::f64::consts::PI } else { 0.0 }, 0.0, 0.0);
                let b = if lean == 0.0 { a } else { between * a * half };
                (c.frames[0].axes, c.frames[1].axes) = (a, b);
            }
            if reversed {
                scene.constraints.reverse();
                scene.constraints.swap(1, 4);
            }
            let case = format!("{kinds:?} {reversed} {lean}");
            let mut lin = Linearized::new(&scene);
            for _ in 0..2 {
                lin.update(&scene, 0.0);
                assert_agree(&lin, &scene, &case);
                let before = scene.constraints.clone();
                lin.follow_windings(&mut scene, 0.0);
                for (k, pair) in scene.constraints.iter().zip(&before).enumerate() {
                    if let (Constraint::Cosserat(c), Constraint::Cosserat(before)) = pair
                        && c.law.twist.is_some()
                    {
                        let twist = lin.phi[lin.row_range(k).end - 1];
                        let lags = (twist - before.twist_reference).abs() > 0.01;
                        let expected = if lags { twist } else { before.twist_reference };
                        assert_eq!(c.twist_reference, expected, "{case}");
                        followed[usize::from(lags)] += 1;
                    }
                }
            }
        }
    }
    assert!(followed.iter().all(|count| *count > 0), "{followed:?}");
}

/// Bends beside a half turn, exact or nearly so, have no division by zero.
#[test]
fn bends_do_not_see_half_turns() {
    for off in [0.0, 1e-17, 1e-9] {
        let mut scene = cable(4, 0.0, 3);
        for c in &mut scene.constraints {
            let Constraint::Cosserat(c) = c else {
                continue;
            };
            c.law.twist = None;
            let half = nalgebra::Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, off, 0.0, -off, -1.0);
            c.frames[1].axes *= half;
        }
        let lin = Linearized::at(&scene, 0.0);
        assert_agree(&lin, &scene, &format!("{off}"));
    }
}

/// Eight lanes, which many processors only emulate, find what the level's own find.
#[test]
fn eight_lanes_find_what_four_find() {
    use taut_lanes::dispatch_eight;
    for (level, segments) in Level::available()
        .into_iter()
        .flat_map(|level| [1, 3, 7, 8, 9, 24].map(|segments| (level, segments)))
    {
        let scene = cable(segments, 0.1, 5);
        let lin = Linearized::at(&scene, 0.0);
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-13 * a.abs().max(1.0);
        let bodies = scene.bodies.len();
        let mut v = BodyVectors::new(bodies);
        for i in 0..bodies {
            v.set(i, std::array::from_fn(|k| (6 * i + k) as f64 * 0.1));
        }
        let mut own = vec![0.0; lin.rows()];
        lin.packs.times_jacobian([&v], &mut own);
        let mut eight = vec![0.0; lin.rows()];
        let joints = &lin.packs;
        let rates = Rates {
            joints,
            v: [&v],
            r: &mut eight,
        };
        dispatch_eight(level, rates);
        assert!(own.iter().zip(&eight).all(|(a, b)| close(*a, *b)));
        let (mut p, mut q) = (BodyVectors::new(bodies), BodyVectors::new(bodies));
        joints.add_transposed(&own, &mut p);
        let transposed = Transposed {
            joints,
            mu: &own,
            p: &mut q,
        };
        dispatch_eight(level, transposed);
        for i in 0..=bodies {
            let pairs = p.get(i).into_iter().zip(q.get(i));
            let all_hold = { pairs }.all(|(a, b)| close(a, b));
            assert!(all_hold, "{level} {segments} {i}");
        }
        let mut again = lin.packs.clone();
        let evaluation = Evaluation {
            joints: &mut again,
            bodies: &scene.bodies,
            phi: &mut eight,
        };
        dispatch_eight(level, evaluation);
        assert!(lin.phi.iter().zip(&eight).all(|(a, b)| close(*a, *b)));
        for joint in 0..again.count {
            let blocks = [&lin.packs, &again].map(|packs| packs.block(joint, 1));
            let pairs = blocks[0].iter().flatten().zip(blocks[1].iter().flatten());
            let all_hold = { pairs }.all(|(a, b)| close(*a, *b));
            assert!(all_hold, "{level} {segments} {joint}");
        }
    }
}

#[test]
fn packs_hold_what_the_blocks_hold() {
    for angle in [0.1, 2.0] {
        let scene = cable(6, angle, 3);
        let lin = Linearized::at(&scene, 0.0);
        let mut joints = 0;
        for JointLanes {
            pack,
            places,
            lane: first,
        } in lin.joint_lanes::<4>()
        {
            for lane in first..places.count.min(first + 4) {
                let joint = lin.joints()[joints];
                joints += 1;
                let slot = lin.slot_range(joint.constraint).end - 1;
                let block = lin.block(slot);
                let block = block.rows();
                let arm = pack.arms[1].map(|r| r[lane]);
                assert_eq!(block[0][4..], [-arm[2], arm[1]]);
                for (row, g) in block[3..].iter().zip(&pack.gradients) {
                    assert_eq!(row[3..], g.map(|g| g[lane]));
                }
                for g in &pack.gradients[joint.rows - 3..] {
                    assert_eq!(g.map(|g| g[lane]), [0.0; 3]);
                }
            }
        }
        assert_eq!(joints, 7);
    }
}

/// References follow twists that are more than 0.01 rad off, and start anew after NaN: for joints
/// in lanes and others, in full packs and beside padding.
#[test]
fn references_follow_their_twists() {
    let row = Some(RowLaw {
        compliance: 1e-6,
        damping: 0.0,
    });
    let law = JointLaw {
        stretch: row,
        bend: row,
        twist: row,
    };
    let paper = |frames| Constraint::Paper(Paper::new(frames, law));
    let cosserat = |frames| Constraint::Cosserat(Cosserat::new(frames, law));
    for kind in [&paper as &dyn Fn([Frame; 2]) -> Constraint, &cosserat] {
        for (off, follows) in [
            (0.009, false),
            (-0.009, false),
            (0.011, true),
            (-2.0, true),
            (f64::NAN, true),
        ] {
            for at in [0, 7, 8] {
                let mut scene = Scene::new("twisted");
                for i in 0..10 {
                    scene.add_body("body", Body::rod(1.0, 0.1, 1.0));
                    scene.bodies.position[i] = Vector3::z() * i as f64;
                }
                for i in 1..10 {
                    let frames = [(i - 1, 0.5), (i, -0.5)];
                    let frames = frames.map(|(i, z)| Frame::body(i, Vector3::z() * z));
                    scene.add_constraint("joint", kind(frames), 0);
                }
                let mut lin = Linearized::new(&scene);
                update_windings(&mut scene, 0.0);
                let twist = scene.constraints[at].twist_reference().unwrap();
                scene.constraints[at].set_twist_reference(twist + off);
                lin.update(&scene, 0.0);
                lin.follow_windings(&mut scene, 0.0);
                let reference = scene.constraints[at].twist_reference().unwrap();
                let expected = if follows { twist } else { twist + off };
                assert_eq!(reference, expected, "{off} {at}");
            }
        }
    }
}
