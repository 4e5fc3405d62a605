//! The networks at rest.

use taut_measure::trajectory::load_position;
use taut_tests::prelude::*;

#[test]
fn networks_hang_in_equilibrium_and_carry_their_weight() {
    for network in Network::ALL {
        for joint in [JointKind::Cosserat, JointKind::Spherical] {
            for (points, held) in [(2, Held::Edge), (1, Held::Corners)] {
                let params = NetworkParams::new(network)
                    .with(|p| (p.joint, p.points, p.held) = (joint, points, held));
                let place = format!("{network:?}, {joint:?}, {held:?}");
                let scene = params.build().expect("builds");
                let weight = scene.mass() * params.gravity;
                let stepper = Stepper::new(scene, StepOptions::default());
                let mut stepper = stepper.unwrap_or_else(|e| panic!("{place}: {e}"));
                let before = load_position(stepper.scene());
                stepper.step().expect("solvable");
                let dt = stepper.options().dt;
                let rows = stepper.linearized();
                let mut carried = 0.0;
                for (c, constraint) in stepper.scene().constraints.iter().enumerate() {
                    // Side a is the world.
                    if constraint.frames()[0].body_index().is_none() {
                        let row = rows.row_range(c).start + 2;
                        carried -= stepper.multipliers()[row] / dt;
                    }
                }
                let off = (carried / weight - 1.0).abs();
                assert!(off < 1e-7, "{place}: {carried} {weight}");
                taut_tests::steps(&mut stepper, 30);
                let way = (load_position(stepper.scene()) - before).norm();
                assert!(way < 1e-7, "{place}: {way:e}");
            }
        }
    }
}
