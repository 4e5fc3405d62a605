//! Hard cases at rest: H01 to H16 and H60.
//!
//! References are formulas of the continuum and of the chain of rigid segments itself, which most of these cases have
//! exactly: what separates the two is what the segments cost.

mod arc;
pub(super) mod buckling;
mod cantilever;
mod catenary;
mod column;
mod elastica;
mod ends;
mod independence;
pub mod rest;
mod ring;
mod rod;
mod routed;

use super::{Coded, no_scenes};
use taut_output::check::Check;

pub const CASES: &[Coded] = &[
    Coded {
        name: "H01",
        title: "axial pull: ΔL/L = F/EA",
        run: ends::pulled,
        scenes: || ends::scene(taut_model::Specimen::Pull),
    },
    Coded {
        name: "H02",
        title: "an end moment that rolls the cable to a circle",
        run: ends::rolled,
        scenes: || ends::scene(taut_model::Specimen::Bend),
    },
    Coded {
        name: "H03",
        title: "an end torque that winds the cable to 40 turns",
        run: ends::twisted,
        scenes: || ends::scene(taut_model::Specimen::Twist),
    },
    Coded {
        name: "H04",
        title: "a cantilever under a small load",
        run: cantilever::even,
        scenes: cantilever::scenes_of_even,
    },
    Coded {
        name: "H05",
        title: "the elastica: a cantilever bent far",
        run: elastica::outcome,
        scenes: || Ok(vec![elastica::rod(8, 1.0).scene()?]),
    },
    Coded {
        name: "H06",
        title: "a bow of 45° under a load across its plane",
        run: arc::outcome,
        scenes: || Ok(vec![arc::rod(8, 600.0).scene()?]),
    },
    Coded {
        name: "H07",
        title: "the catenary, of rods",
        run: |quick, progress| catenary::family(&catenary::RODS, quick, progress),
        scenes: || Ok(vec![catenary::scene(4, &catenary::RODS)?]),
    },
    Coded {
        name: "H07d",
        title: "the catenary, of links with masses at the joints",
        run: |quick, progress| catenary::family(&catenary::PARTICLES, quick, progress),
        scenes: || Ok(vec![catenary::scene(4, &catenary::PARTICLES)?]),
    },
    Coded {
        name: "H08",
        title: "the elastic catenary",
        run: catenary::elastic,
        scenes: catenary::scenes_of_elastic,
    },
    Coded {
        name: "H09",
        title: "columns that buckle under a thrust, under their own weight",
        run: column::thrust_and_weight,
        scenes: column::scenes_of_thrust,
    },
    Coded {
        name: "H10",
        title: "Greenhill's torque, with and without tension",
        run: column::torque,
        scenes: column::scenes_of_torque,
    },
    Coded {
        name: "H11",
        title: "Michell's ring: the twist that lifts a ring out of its plane",
        run: ring::outcome,
        scenes: || Ok(vec![ring::scene(8, 0.5)?]),
    },
    Coded {
        name: "H13",
        title: "one shape at rest, whatever the damping, time step, solver and order",
        run: independence::outcome,
        scenes: independence::scenes,
    },
    Coded {
        name: "H14",
        title: "segments of random lengths, two materials",
        run: cantilever::random,
        scenes: || Ok(vec![cantilever::uneven(8, 1).scene()?]),
    },
    Coded {
        name: "H15",
        title: "specimens that start in equilibrium under their whole load",
        run: rest::loaded_at_once,
        scenes: no_scenes,
    },
    Coded {
        name: "H16",
        title: "two slings from one point: rest with a direction that nothing resists",
        run: rest::from_one_point,
        scenes: no_scenes,
    },
    Coded {
        name: "H60",
        title: "cables along routes, and of unlike segments",
        run: routed::outcome,
        scenes: routed::scenes,
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
    let check = Check::second_order(format!("{case}: order in N"), order, ORDER_BAR);
    Some(
        check
            .by("of the exact chain's errors against the continuum, first and last N")
            .noting(list.join("; ")),
    )
}
