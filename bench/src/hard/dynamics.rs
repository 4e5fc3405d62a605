//! Hard cases in motion: H20 to H34, and the gantry crane driven for a minute.

pub mod crane;
pub mod frequency;
pub mod gantry;
pub mod hoisting;
pub mod tackle;

use super::{Case, no_scenes};

/// The cases.
pub const CASES: &[Case] = &[
    Case {
        name: "gantry",
        title: "the gantry crane driven for a minute, loads to 10⁵ cable elements",
        run: gantry::outcome,
        scenes: no_scenes,
    },
    Case {
        name: "H28",
        title: "a pendulum that is hoisted slowly",
        run: hoisting::outcome,
        scenes: no_scenes,
    },
    Case {
        name: "H29",
        title: "frequencies of cranes: trolley, hook and load, two parallel cables, the gantry",
        run: crane::outcome,
        scenes: no_scenes,
    },
    Case {
        name: "H30",
        title: "masses over a sheave, tackles of 2 to 12 parts",
        run: tackle::outcome,
        scenes: no_scenes,
    },
];
