//! Hard cases at rest: H01 to H16.
//!
//! References are formulas of the continuum and of the chain of rigid segments itself, which most of these cases have
//! exactly: what separates the two is what the segments cost.

pub mod arc;
pub mod buckling;
pub mod cantilever;
pub mod catenary;
pub mod column;
pub mod elastica;
pub mod ends;
pub mod independence;
pub mod rest;
pub mod ring;
pub mod rod;

use super::{Case, no_scenes};
use taut_output::check::Check;

/// The cases.
pub const CASES: &[Case] = &[
    Case {
        name: "H01",
        title: "axial pull: ΔL/L = F/EA",
        run: ends::pulled,
        scenes: ends::scenes_of_pulled,
    },
    Case {
        name: "H02",
        title: "an end moment that rolls the cable to a circle",
        run: ends::rolled,
        scenes: ends::scenes_of_rolled,
    },
    Case {
        name: "H03",
        title: "an end torque that winds the cable to 40 turns",
        run: ends::twisted,
        scenes: ends::scenes_of_twisted,
    },
    Case {
        name: "H04",
        title: "a cantilever under a small load",
        run: cantilever::even,
        scenes: cantilever::scenes_of_even,
    },
    Case {
        name: "H05",
        title: "the elastica: a cantilever bent far",
        run: elastica::outcome,
        scenes: elastica::scenes,
    },
    Case {
        name: "H06",
        title: "a bow of 45° under a load across its plane",
        run: arc::outcome,
        scenes: arc::scenes,
    },
    Case {
        name: "H07",
        title: "the catenary, of rods",
        run: catenary::rods,
        scenes: catenary::scenes_of_rods,
    },
    Case {
        name: "H07d",
        title: "the catenary, of links with masses at the joints",
        run: catenary::particles,
        scenes: catenary::scenes_of_particles,
    },
    Case {
        name: "H08",
        title: "the elastic catenary",
        run: catenary::elastic,
        scenes: catenary::scenes_of_elastic,
    },
    Case {
        name: "H09",
        title: "columns that buckle under a thrust, under their own weight",
        run: column::thrust_and_weight,
        scenes: column::scenes_of_thrust,
    },
    Case {
        name: "H10",
        title: "Greenhill's torque, with and without tension",
        run: column::torque,
        scenes: column::scenes_of_torque,
    },
    Case {
        name: "H11",
        title: "Michell's ring: the twist that lifts a ring out of its plane",
        run: ring::outcome,
        scenes: ring::scenes,
    },
    Case {
        name: "H13",
        title: "one shape at rest, whatever the damping, time step, solver and order",
        run: independence::outcome,
        scenes: independence::scenes,
    },
    Case {
        name: "H14",
        title: "segments of random lengths, two materials",
        run: cantilever::random,
        scenes: cantilever::scenes_of_random,
    },
    Case {
        name: "H15",
        title: "specimens that start in equilibrium under their whole load",
        run: rest::loaded_at_once,
        scenes: no_scenes,
    },
    Case {
        name: "H16",
        title: "two slings from one point: rest with a direction that nothing resists",
        run: rest::from_one_point,
        scenes: no_scenes,
    },
];

/// Bar on the deviation of an order of convergence from 2.
pub const ORDER_BAR: f64 = 0.15;

/// The order in N of the exact chain's errors against the continuum; nothing where they are rounding.
fn order(case: &str, errors: &[(usize, f64)]) -> Option<Check> {
    let order = crate::paper::specimens::order(errors)?;
    let list: Vec<String> = errors
        .iter()
        .map(|(n, e)| format!("{n}: {e:.2e}"))
        .collect();
    let check = Check::within(
        format!("{case}: order in N"),
        "2".to_owned(),
        format!("{order:.3}"),
        (order - 2.0).abs(),
        ORDER_BAR,
    );
    Some(
        check
            .by("of the exact chain's errors against the continuum, first and last N")
            .noting(list.join("; ")),
    )
}
