//! Hard cases that are programs: what asks for more than a scene, a run and formulas.

mod gantry;
mod ladders;
pub mod long_run;
mod resolution;
mod routed;
mod winding;

use super::Coded;

pub const CASES: &[Coded] = &[
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
