//! Hard cases at rest that are programs: H01 to H03, H13, H14, H16 and H60.
//!
//! References are formulas of the continuum and of the chain of rigid segments itself, which most of these cases have
//! exactly: what separates the two is what the segments cost.

mod cantilever;
mod ends;
mod independence;
pub mod rest;
pub(super) mod rod;
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
