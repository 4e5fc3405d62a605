//! Random block systems by their seeds: their names tell how to make them again.

use crate::prelude::*;
use taut_solver::agreement::systems;

pub use taut_solver::agreement::systems::{MOST_ROWS, Shape, System};

type Make = fn(Shape, &mut dyn FnMut() -> u64) -> Result<System, SolveError>;

fn of_seed(make: Make, shape: Shape, seed: u64) -> System {
    let mut random = Random::new(seed);
    let mut system = make(shape, &mut || random.bits()).expect("a sound pattern");
    system.name += &format!(", seed {seed}");
    system
}

pub fn positive_definite(shape: Shape, seed: u64) -> System {
    of_seed(systems::positive_definite, shape, seed)
}

pub fn quasi_definite(shape: Shape, seed: u64) -> System {
    of_seed(systems::quasi_definite, shape, seed)
}
