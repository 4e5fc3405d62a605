//! Hard cases for the program: H42 to H58. What they asserted about algebra alone is tested beside `tests/agreement`.

mod ladders;
pub mod long_run;
mod lost;
mod mechanisms;
pub mod rigid_limit;

use super::Coded;

pub const CASES: &[Coded] = &[
    Coded {
        name: "H42",
        title: "dependent constraints: Bricard's six-bar, rows of four-bars",
        run: mechanisms::outcome,
        scenes: mechanisms::scenes,
    },
    Coded {
        name: "H49",
        title: "ten million steps of a swing",
        run: long_run::outcome,
        scenes: || Ok(vec![long_run::scene()?]),
    },
    Coded {
        name: "H51",
        title: "joints ever stiffer, and rigid",
        run: rigid_limit::outcome,
        scenes: rigid_limit::scenes,
    },
    Coded {
        name: "H54",
        title: "ladders of time steps and iterations",
        run: ladders::outcome,
        scenes: ladders::scenes,
    },
    Coded {
        name: "H58",
        title: "lost runs are called so, and no others",
        run: lost::outcome,
        scenes: || Ok(vec![lost::chain()?, lost::winched()]),
    },
];
