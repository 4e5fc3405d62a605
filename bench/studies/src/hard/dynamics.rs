//! Hard cases in motion that are programs: H48, and the gantry crane driven for a minute.

pub(super) mod frequency;
mod gantry;
mod resolution;
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
];
