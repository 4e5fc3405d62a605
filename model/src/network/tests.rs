//! Geometry, rows, groups and faults of the networks.

use super::*;
use crate::testing::*;

/// Every network in some sizes and forms.
fn all() -> Vec<NetworkParams> {
    let mut found = Vec::new();
    for network in Network::ALL {
        for (segments, joint) in [(8, JointKind::Cosserat), (13, JointKind::Spherical)] {
            for points in [1, 2] {
                found.push(NetworkParams {
                    segments,
                    joint,
                    points,
                    held: if points == 1 {
                        Held::Edge
                    } else {
                        Held::Corners
                    },
                    columns: segments,
                    rung_every: 3,
                    ..NetworkParams::new(network)
                });
            }
        }
    }
    found
}

fn build(params: &NetworkParams) -> Scene {
    params.build().unwrap_or_else(|e| panic!("{params:?}: {e}"))
}

#[test]
fn every_gap_is_closed_at_the_start() {
    for params in all() {
        let scene = build(&params);
        let lin = Linearized::at(&scene, 0.0);
        for (c, constraint) in scene.constraints.iter().enumerate() {
            let mut row = lin.row_range(c).start;
            for (kind, count, _) in constraint.parts() {
                for phi in &lin.phi[row..row + count] {
                    assert!(phi.is_finite());
                    if kind != RowKind::Bend {
                        let name = &scene.constraint_names[c];
                        assert!(phi.abs() < 1e-14, "{params:?}: {name} {kind:?} {phi:e}");
                    }
                }
                row += count;
            }
        }
    }
}

#[test]
fn loads_hang_at_the_bottom_and_in_the_middle() {
    for params in all() {
        let scene = build(&params);
        let load = scene.load.expect("a load");
        let mass = scene.bodies.mass[load];
        assert_eq!(mass, params.mass_ratio * params.segment_mass);
        let z = |i: usize| scene.bodies.position[i].z;
        let top = (0..scene.bodies.len()).map(z).fold(f64::MIN, f64::max);
        assert!(z(load) < top - 0.1, "{params:?}");
        if params.held == Held::Edge && params.network != Network::Net {
            let lowest = (0..scene.bodies.len()).map(z).fold(f64::MAX, f64::min);
            assert!(z(load) <= lowest, "{params:?}");
        }
    }
}

/// Joint k joins segments k and k + 1, and the last one closes the ring: such rings are a chain with a border in this order.
#[test]
fn rings_list_their_joints_from_end_to_end() {
    for points in [1, 2] {
        let params = NetworkParams::new(Network::Ring).with(|p| p.points = points);
        let scene = build(&params);
        for (k, joint) in scene.constraints[..params.segments].iter().enumerate() {
            let sides = joint.frames().iter().map(|frame| frame.side);
            let next = (k + 1) % params.segments;
            assert!(sides.eq([Side::Body(k), Side::Body(next)]), "joint {k}");
        }
    }
}

#[test]
fn loops_are_a_group_of_their_own() {
    // Closing constraints: independent loops through bodies, the world being none.
    for (network, closing) in [
        (Network::Ring, 1),
        (Network::Junction, 0),
        (Network::Cranes, 0),
        // 5 links in each of 3 gaps; the beam joins the cables.
        (Network::Ladder, 15),
        // 7 × 7 meshes.
        (Network::Net, 49),
    ] {
        let scene = build(&NetworkParams::new(network));
        let count = scene.groups.iter().filter(|g| **g == 1).count();
        assert_eq!(count, closing, "{network:?}");
        assert!(scene.groups.iter().all(|g| *g <= 1));
        assert!(scene.start_in_equilibrium);
    }
}
