//! Shared ground of the experiments on hoisting cables: solvers by name, recorded motions, references, matrices, files:
//! ```
//! use taut_measure::Choice;
//! use taut_integrator::Stepper;
//! use taut_model::HoistParams;
//!
//! // A backend and a form of the system as on the command line, and the step that goes with them.
//! let choice: Choice = "dense/kkt".parse()?;
//! let scene = HoistParams { segments: 3, ..HoistParams::default() }.build()?;
//! let mut stepper = Stepper::new(scene, choice.options(1.0 / 60.0))?;
//! // How wrong the multipliers of its first solve are, against 32 digits.
//! let exact = stepper.reference_multipliers()?;
//! stepper.solve()?;
//! assert!(taut_solver::forward_error(stepper.multipliers(), &exact) < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Mathematics
//! For a solution μ of A μ = b and the exact μ*: forward error ‖μ − μ*‖∞ / ‖μ*‖∞, normwise backward
//! error ‖b − A μ‖∞ / (‖A‖∞ ‖μ‖∞ + ‖b‖∞), componentwise maxᵢ |b − A μ|ᵢ / (|A| |μ| + |b|)ᵢ. None
//! has a unit. Motions are compared with finely stepped ones, in metres; times are medians and
//! minima of repeats, in nanoseconds.
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `choice` | a backend and a form as one value, with its text form; a backend left out, and why |
//! | `claim`, `errors` | whether a solver's claim of a solution is true; which error is worse |
//! | `trajectory` | a run and what is recorded of it: load, energies, gaps, times, stability |
//! | `columns` | any quantity of a body, joint, cable or control, by name |
//! | `openings` | the widest gap of a run, and what of it no force explains |
//! | `reference` | finely stepped motions to compare with |
//! | `engine` | an engine on the hoist or on the ground with its settings, and the motions that it goes through |
//! | `modes` | natural oscillations of a scene at rest, from the library's Jacobians |
//! | `source` | scenes by name or from TOML files, with what drives them |
//! | `time_table`, `inputs` | values over time, from CSV files; those of what an operator does |
//! | `lean` | scenes without one of the things that they model, and with other numbers of segments |
//! | `poses`, `random` | straight and bent hoists; the one generator of random numbers |
//! | `matrix` | linear systems as files: Matrix Market, every backend on any matrix |
//! | `files`, `cache` | JSON and CSV files, texts for people; references kept in files |
//! | `quantities` | those of a run, by name and with units, for tables and recordings |
//! | `pace` | how fast simulations go, for progress bars |
//! | `allocations` | an allocator that counts its calls |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

pub mod allocations;
pub mod cache;
pub mod choice;
pub mod claim;
pub mod columns;
pub mod engine;
pub mod errors;
pub mod files;
pub mod inputs;
pub mod lean;
pub mod matrix;
pub mod modes;
pub mod openings;
pub mod pace;
pub mod poses;
pub mod quantities;
pub mod random;
pub mod reference;
pub mod source;
pub mod time_table;
pub mod trajectory;

pub use choice::Choice;
