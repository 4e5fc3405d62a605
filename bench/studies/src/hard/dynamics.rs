//! Hard cases in motion that are programs: H31 to H36, H48 and H59, and the gantry crane driven for a minute.

mod changes;
mod damping;
pub(super) mod frequency;
mod gantry;
mod heavy;
mod resolution;
mod spaghetti;
mod winding;

use super::Coded;

pub const CASES: &[Coded] = &[
    Coded {
        name: "gantry",
        title: "the gantry crane driven for a minute, loads to 10⁵ cable elements",
        run: gantry::outcome,
        scenes: gantry::scenes,
    },
    Coded {
        name: "H31",
        title: "the flying spaghetti",
        run: spaghetti::outcome,
        scenes: spaghetti::scenes,
    },
    Coded {
        name: "H33",
        title: "the law by which a step damps a deformation mode",
        run: damping::outcome,
        scenes: damping::modes_at_the_start,
    },
    Coded {
        name: "H34",
        title: "the time in which an initial gap closes",
        run: damping::gaps,
        scenes: damping::gap_at_the_start,
    },
    Coded {
        name: "H36",
        title: "heavy loads that snap coarse cables taut",
        run: heavy::outcome,
        scenes: || Ok(vec![heavy::hoist(6, 1e4, 2.6, 7).build()?]),
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
        name: "H59",
        title: "hooked on, let go, cut and broken while it moves",
        run: changes::outcome,
        scenes: changes::scenes,
    },
];
