//! Experiments on hoisting cables: speed against error of every solver, statics, runs. The binary `taut` prints them,
//! the workspace's tests assert on them.
//!
//! An experiment is a `Config`, a `run` that takes it, and records that serialise. A [`study::Study`] gives it a name,
//! options, columns and plots; [`studies`] lists them. A part of an experiment:
//! ```
//! use taut_bench::Choice;
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
//! Of a solution μ of A μ = b and the exact μ*: forward error ‖μ − μ*‖∞ / ‖μ*‖∞, normwise backward error
//! ‖b − A μ‖∞ / (‖A‖∞ ‖μ‖∞ + ‖b‖∞), componentwise maxᵢ |b − A μ|ᵢ / (|A| |μ| + |b|)ᵢ, none with a unit. Motions are
//! compared with finely stepped ones, in metres; times are medians and minima of repeats, in nanoseconds.
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `ladder` | the main job: backends × mass ratios × iterations |
//! | `kernels` | what one linear solve costs, ours beside others' on the same matrices |
//! | `linear` | forward errors of the multipliers over mass ratios up to 10¹² |
//! | `iterative` | time to a given error of the iterative solvers, against the direct one |
//! | `scenes` | branches and loops: every solver on the networks, cost against size |
//! | `accuracy` | errors of whole motions against cost: schemes, time steps, solvers, refinements |
//! | `shocks` | kicks, jerks and drops: what survives them, how well, at what cost |
//! | `statics` | the hanging cable: elongation, iterations needed |
//! | `stability` | the stability map: largest stable mass ratio of schemes, joints, segments, materials |
//! | `energy` | swing amplitude, energy over a million steps, angular momentum of a free cable |
//! | `engines` | whole engines on the hoist: what a frame costs, how wrong the motion is |
//! | `reference` | finely stepped motions to compare with |
//! | `run`, `run_file` | one scene, as `taut run` runs it; runs saved to files and resumed |
//! | `modes` | natural oscillations of a scene at rest, from the library's Jacobians |
//! | `trajectory` | a run and what is recorded of it: load, energies, gaps, times, stability |
//! | `check` | a reference beside ours, error, bar, verdict: what the paper and the hard cases end in |
//! | `paper` | the paper's tables, figures and claims, ours beside theirs |
//! | `hard` | hard cases: reference beside ours, one module for each |
//! | `matrix` | linear systems as files: Matrix Market, every backend on any matrix, a graded set |
//! | `track` | per-step timing that CI can trust: instructions, allocations, errors, times against a baseline |
//! | `allocations` | an allocator that counts its calls |
//! | `plot`, `notation` | charts as SVG; how numbers are written for people |
//! | `inputs` | what an operator does, from a table of times and control values |
//! | `poses`, `random` | straight and bent hoists; the one generator of random numbers |
//! | `study`, `studies` | an experiment as a value: options, run, rows, plots; the list of all |
//! | `options` | options that several experiments read |
//! | `settings`, `sheet`, `plan` | what a run was set to, its rows as text, its rows as plots |
//! | `report` | the report as one HTML file |
//! | `choice` | a backend and a form as one value, with its text form; a backend left out, and why |
//! | `claim` | whether a solver's claim of a solution is true |
//! | `cache` | references kept in files |
//! | `pace` | how fast simulations go, for progress bars |
//! | `table`, `output`, `machine` | text tables, JSON and CSV files, what machine this is |

pub mod accuracy;
pub mod allocations;
pub mod cache;
pub mod check;
pub mod choice;
pub mod claim;
pub mod energy;
pub mod engines;
pub mod hard;
pub mod inputs;
pub mod iterative;
pub mod kernels;
pub mod ladder;
pub mod linear;
pub mod machine;
pub mod matrix;
pub mod modes;
mod notation;
pub mod options;
pub mod output;
pub mod pace;
pub mod paper;
pub mod plan;
pub mod plot;
pub mod poses;
pub mod random;
pub mod reference;
pub mod report;
pub mod run;
pub mod run_file;
pub mod scenes;
pub mod settings;
pub mod sheet;
pub mod shocks;
pub mod stability;
pub mod statics;
pub mod studies;
pub mod study;
pub mod table;
pub mod track;
pub mod trajectory;

pub use choice::Choice;
