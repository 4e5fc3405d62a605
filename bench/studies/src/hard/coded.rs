//! Hard cases that are programs: what asks for more than a scene, a run and formulas.

mod ends;
mod gantry;
mod ladders;
pub mod long_run;
mod resolution;
pub mod rest;
mod routed;
mod winding;

use super::Coded;
use taut_model::Specimen;

pub const CASES: &[Coded] = &[
    Coded {
        name: "H02",
        title: "an end moment that rolls the cable to a circle",
        run: ends::rolled,
        scenes: || ends::scene(Specimen::Bend),
    },
    Coded {
        name: "H03",
        title: "an end torque that winds the cable to 40 turns",
        run: ends::twisted,
        scenes: || ends::scene(Specimen::Twist),
    },
    Coded {
        name: "H16",
        title: "two slings from one point: rest with a direction that nothing resists",
        run: rest::from_one_point,
        scenes: || Ok(Vec::new()),
    },
    Coded {
        name: "H48",
        title: "segments that merge and split at a winch",
        run: winding::outcome,
        scenes: winding::scenes,
    },
    Coded {
        name: "H48-rule",
        title: "segments that merge and split by rule",
        run: resolution::outcome,
        scenes: resolution::scenes,
    },
    Coded {
        name: "H49",
        title: "ten million steps of a swing",
        run: long_run::outcome,
        scenes: || Ok(vec![long_run::scene()?]),
    },
    Coded {
        name: "H54",
        title: "ladders of time steps and iterations",
        run: ladders::outcome,
        scenes: ladders::scenes,
    },
    Coded {
        name: "H60",
        title: "cables along routes, and of unlike segments",
        run: routed::outcome,
        scenes: routed::scenes,
    },
    Coded {
        name: "gantry",
        title: "the gantry crane driven for a minute, loads to 10⁵ cable elements",
        run: gantry::outcome,
        scenes: gantry::scenes,
    },
];
