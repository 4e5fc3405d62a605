//! Common parts of the tests across crates: random numbers with a fixed seed, random block systems,
//! scenes, solvers.
//!
//! Functions for arbitrary bytes return true if these came as far as a solution, and panic where
//! the program would have:
//!
//! ```
//! use taut_tests::fuzzing::matrix_market;
//!
//! assert!(matrix_market(b"%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 2.0\n"));
//! assert!(!matrix_market(b"no matrix"));
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `random` | one generator, that of the experiments; every failure message names its seed |
//! | `algebra` | systems of every kind, scaling and rank, and what may not be claimed of them |
//! | `claims` | audits: claims of solvers beside residuals in double-double |
//! | `systems` | random block systems with the shapes of cables |
//! | `graphs` | branches, rings, nets and ladders of bodies |
//! | `fuzzing`, `decode` | functions for arbitrary bytes, and the decoding of these bytes |
//! | `prelude` | names that most tests use |
//! | `machines` | random scenes of machines: motors, winches, static and driven bodies |
//! | `products` | small scenes that join two to five features, and their invariants |
//! | `scenes` | hoists in awkward poses, free cables, rigid chains, random scenes; moving and relabelling them |
//!
//! | tests | guarantee |
//! |---|---|
//! | `exact` | what has a formula or a definition is that |
//! | `conserves` | momenta are kept, no energy comes from nowhere |
//! | `converges` | errors fall with the square of Δt and of the length of a segment |
//! | `deterministic` | the same run gives the same bits; turning, shifting and renumbering change nothing |
//! | `agrees` | every backend agrees with extended precision, and what it claims is true |
//! | `refuses` | typed errors, never a panic and never a silent NaN |
//! | `survives` | hard cases, heavy loads, long runs, joined features |
//! | `allocates_nothing` | steps allocate nothing: a binary of its own |
//! | `golden::prints`, `golden::reads_old_files` | what the program prints, and that it reads files of earlier versions |
//! | `structure` | imports, features, unsafe code, the top level |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

pub mod algebra;
pub mod claims;
pub mod decode;
pub mod fuzzing;
pub mod graphs;
pub mod machines;
pub mod prelude;
pub mod products;
pub mod scenes;
pub mod systems;

pub use taut_measure::random;

/// The README's program, compiled by the tests of the documentation.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
pub struct Readme;

use std::fmt;
use taut_integrator::{StepOptions, Stepper};
use taut_measure::Choice;
use taut_solver::{Backend, DenseOptions, Precision};

/// All solvers that are compiled in, in both forms where they take them.
pub fn compiled() -> Vec<Choice> {
    let choices = Choice::all().into_iter();
    let mut choices: Vec<Choice> = choices.filter(|c| c.check().is_ok()).collect();
    choices.push(Choice::kkt(Backend::Dense(DenseOptions::default())));
    choices
}

/// The direct ones among them.
pub fn compiled_direct() -> Vec<Choice> {
    let mut choices = compiled();
    choices.retain(|c| !c.backend.is_iterative());
    choices
}

/// The iterative ones among them.
pub fn compiled_iterative() -> Vec<Choice> {
    let mut choices = compiled();
    choices.retain(|c| c.backend.is_iterative());
    choices
}

/// The paper's step with the solver, form and refinements of a choice: for laws of that step, and for what depends on
/// the present state alone.
pub fn paper(choice: &Choice, dt: f64) -> StepOptions {
    let StepOptions {
        form,
        backend,
        refinements,
        ..
    } = choice.options(dt);
    StepOptions::paper()
        .with(|o| (o.dt, o.form, o.backend) = (dt, form, backend))
        .with(|o| o.refinements = refinements)
}

/// The default step likewise, every step as it comes.
pub fn unguarded(choice: &Choice, dt: f64) -> StepOptions {
    choice.options(dt).with(|o| o.guard = None)
}

/// A value with a change.
pub trait With: Sized {
    fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

impl<T> With for T {}

/// So many steps.
#[track_caller]
pub fn steps(stepper: &mut Stepper, count: usize) {
    for n in 0..count {
        if let Err(e) = stepper.step() {
            panic!("step {n} of {count}: {e}");
        }
    }
}

/// Everything that a run leaves, as bits.
pub fn bits(stepper: &Stepper) -> Vec<u64> {
    let bodies = &stepper.scene().bodies;
    let vectors = bodies.position.iter().chain(&bodies.velocity);
    let vectors = vectors.chain(&bodies.angular_velocity).flatten();
    let turns = bodies.orientation.iter().flat_map(|q| q.coords.iter());
    let all = vectors.chain(turns).chain(stepper.multipliers());
    all.map(|x| x.to_bits()).collect()
}

/// The dense oracle.
pub fn oracle() -> Backend {
    Backend::Dense(DenseOptions {
        precision: Precision::Extended,
    })
}

/// Ten times a measured error: what a test allows. Errors below an ulp count as one.
pub fn allowed(measured: f64) -> f64 {
    10.0 * measured.max(f64::EPSILON)
}

/// The largest of many errors, and where it was met. `cargo test -- --nocapture` shows what is measured.
#[derive(Debug, Default)]
pub struct Worst {
    error: f64,
    place: String,
}

impl Worst {
    /// Takes an error into account; NaN counts as infinite.
    pub fn see(&mut self, error: f64, place: impl fmt::Display) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        if error > self.error {
            *self = Self {
                error,
                place: place.to_string(),
            };
        }
    }

    /// The largest error.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Fails where the largest error is beyond ten times the measured one.
    #[track_caller]
    pub fn expect_measured(&self, what: &str, measured: f64) {
        let Self { error, place } = self;
        println!("{what}: {error:.1e} (measured before: {measured:.1e}) at {place}");
        let bound = allowed(measured);
        let holds = *error <= bound;
        assert!(holds, "{what}: {error:e} exceeds {bound:e} at {place}");
    }
}
