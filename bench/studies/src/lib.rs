//! Experiments on hoisting cables: speed against error of every solver, statics, hard cases, the paper.
//!
//! An experiment is a `Config`, a `run` that takes it, and records that serialise. A [`study::Study`] gives it a name,
//! options, columns and plots; [`mod@studies`] lists them:
//! ```
//! use taut_studies::cases::Cases;
//! use taut_studies::linear::{Config, run};
//!
//! let config = Config { segments: vec![3], ratios: vec![10.0], ..Config::new(true) };
//! let (records, _) = run(&config, &Cases::default())?;
//! # assert!(!format!("{records:?}").is_empty());
//! # Ok::<(), taut_output::check::ExperimentError>(())
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `ladder` | the main job: backends × mass ratios × iterations |
//! | `kernels` | what one linear solve costs, ours beside others' on the same matrices |
//! | `linear` | forward errors of the multipliers over mass ratios up to 10¹² |
//! | `scenes` | branches and loops: every solver on the networks, cost against size |
//! | `accuracy` | errors of whole motions against cost: schemes, time steps, solvers, refinements |
//! | `shocks` | kicks, jerks and drops: what survives them, how well, at what cost |
//! | `statics` | the hanging cable: elongation, iterations needed |
//! | `stability` | the stability map: largest stable mass ratio of schemes, joints, segments, materials |
//! | `energy` | swing amplitude, energy over a million steps, angular momentum of a free cable |
//! | `estimate` | the estimate of the load's error against the error |
//! | `resolution` | segments by rule against fixed ones: speed and error |
//! | `engines` | whole engines on the hoist and on the ground: what a frame costs, how wrong the motion is |
//! | `motions` | scene, options and drive, run and compared: what the studies of motions are questions on |
//! | `rest` | scenes brought to rest, and what their joints read |
//! | `matrix` | every backend on systems from files; a graded set of systems |
//! | `sequence` | every solver on the systems of consecutive steps from a folder |
//! | `paper` | the paper's tables, figures and claims, ours beside theirs |
//! | `ledger` | what each thing that a scene models costs and is worth |
//! | `fit` | lines and powers by least squares |
//! | `buckling` | the torque at which a twisted rod buckles |
//! | `law` | what a scheme does to one mode |
//! | `hard` | hard cases: reference beside ours, one module for each |
//! | `checks` | experiments that end in checks: what `hard` and `paper` share |
//! | `cases` | what a study runs one by one, keeps in a file and deals to shards |
//! | `systems` | solvers on systems: the engine of the studies that compare solvers |
//! | `study`, `studies` | an experiment as a value: options, run, rows; the list of all |
//! | `question` | what an experiment is called and takes, its tables and its plots, as a file |
//! | `options` | options that several experiments read |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

pub mod accuracy;
mod buckling;
pub mod cases;
pub mod checks;
pub mod energy;
pub mod engines;
pub mod estimate;
mod fit;
pub mod hard;
pub mod kernels;
pub mod ladder;
mod law;
pub mod ledger;
pub mod linear;
pub mod matrix;
mod motions;
pub mod options;
pub mod paper;
pub mod question;
pub mod resolution;
mod rest;
pub mod scenes;
pub mod sequence;
pub mod shocks;
pub mod stability;
pub mod statics;
pub mod studies;
pub mod study;
pub mod systems;
