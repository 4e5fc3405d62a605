//! Fixed-step time stepping of constrained rigid bodies: one linear solve a step.
//!
//! This crate joins a scene (`taut-model`) and a linear solver (`taut-solver`). It holds the time step Δt, the assembly
//! of the linear system and the update of velocities and positions, [SL §II and Algorithm 1]:
//!
//! ```text
//! [ M̃  −Jᵀ ] [ Δv ]   [ Δt f    ]        Schur form   S μ = c − J (v + M̃⁻¹ Δt f),  S = J M̃⁻¹ Jᵀ + Σ
//! [ J    Σ  ] [ μ  ] = [ c − J v ]        KKT form     the symmetric [M̃ Jᵀ; J −Σ] with −μ as unknown
//!
//! v⁺ = v + Δv,   x⁺ = x + Δt v⁺,   e⁺ = exp(Δt ω⁺) ⊗ e,   multipliers λ = μ/Δt
//! ```
//!
//! Dynamic bodies turn as free ones do instead, with their angular momentum kept: those with an axis of symmetry, as
//! segments are, exactly, others in parts of a tenth of a radian (module `gyroscopic`).
//!
//! # Schemes and what keeps heavy loads stable
//! [`Scheme`] sets Σ and c; [`GeometricStiffness`] adds α Δt² K to the rotational inertia in M̃, for the tension's
//! resistance to rotation and what large twist moments need, which the paper's step treats explicitly: it becomes unstable
//! with real steel at mass ratios from 10³ on; [`Guard`] redoes steps whose linearisation did not hold. The default,
//! [`Scheme::THIRD_DIFFERENCE`] with all of it, is of second order and carries loads of 10⁶ segments' masses at 60 steps a
//! second; [`StepOptions::paper`] is the paper's.
//!
//! # A step in passes
//! Each pass goes once through contiguous arrays and handles eight joints or bodies at a time where a register holds as
//! many numbers, four elsewhere (crate `taut-lanes`):
//!
//! | phase | pass | reads | writes |
//! |---|---|---|---|
//! | linearise | rates | v, levers and gradients | J v |
//! | | regularise | φ, ε, τ, rates now and before | Σ, c − J v |
//! | | stiffness | λ, levers | K |
//! | | inertia | orientations, K, forces | M̃, M̃⁻¹, Δt f |
//! | assemble | free motion | M̃⁻¹, Δt f, J | right-hand side |
//! | | blocks | levers, gradients, M̃⁻¹, Σ | S: joints' columns, then other couplings |
//! | factorise, solve | the backend's | S, right-hand side | μ |
//! | refine | residual | μ, J, M̃⁻¹ | Δv, residual; one more solve |
//! | update | impulses | μ, J, M̃⁻¹ | Δv |
//! | | motion | v, Δv | velocities, positions, orientations |
//! | | joints | positions, orientations | φ, levers, gradients |
//! | | guard | φ, prediction | disagreement |
//!
//! Rows (μ, φ, Σ …) stand one after the other as in the scene. What bodies have six of (v, Δv, impulses, M̃, K) stands
//! number by number ([`taut_model::BodyVectors`]), so that neighbours fill a vector; joints stand in packs of eight
//! ([`taut_model::JointLanes`]). Constraints that are no joints, and bodies without an axis of symmetry, go one by one.
//!
//! Whole scenes do not go side by side: steps of eight hoists whose systems were eliminated together, one in each lane,
//! took 0.9 of their time one by one with 8 segments, 0.98 with 24 and 1.02 to 1.06 with 100. Nor do they share the other
//! phases: of eight hoists of 24 segments in one scene, joint k of each in the lanes of one vector, linearising takes 0.75
//! of its time one by one, updating 0.52, assembling more (AVX-512).
//!
//! Nor does a long cable go stretch by stretch: phases that took 128 or 512 joints through all their kernels before the next
//! ones gained 5 to 8 % of a step of 10⁴ segments and nothing of one of 1000 to 4000. What such steps wait for is the memory
//! that each kernel reads once; fewer numbers a row and constraints left where they lie made 1000 segments faster by a sixth.
//!
//! Sources besides the paper \[SL]: Lacoursière, *Ghosts and Machines* (2007) for SPOOK; Tournier, Nesme, Gilles, Faure,
//! *Stable Constrained Dynamics* (2015) \[T] and Andrews, Teichmann, Kry, *Geometric Stiffness for Real-time Constrained
//! Multibody Dynamics* (2017) \[A] for K, in another form than here (see `geometric`).
//!
//! ```
//! use taut_integrator::{StepOptions, Stepper};
//! use taut_model::HoistParams;
//!
//! let scene = HoistParams { segments: 12, mass_ratio: 50.0, ..HoistParams::default() }.build()?;
//! let mut stepper = Stepper::new(scene, StepOptions::default())?;
//! for _ in 0..60 {
//!     stepper.step()?;
//! }
//! assert!((stepper.time() - 1.0).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `step` | the step: phases in order, update, nothing allocated after the first |
//! | `step/linearize`, `step/system` | the other phases |
//! | `step/start` | velocities and multipliers of a start |
//! | `step/guarded`, `step/divided` | the guard: its implicit sub-steps, its steps in parts |
//! | `step/potential` | the incremental potential that implicit sub-steps minimise, and the search along their Newton steps |
//! | `step/condensed`, `step/contact_solve` | the solve with bounds and cables that slip, and with contacts |
//! | `step/winch_cuts` | what a step does with cables at their winches |
//! | `step/forces`, `step/reported`, `step/work` | what a step tells: forces, their means over it, the work of its drives |
//! | `step/reference` | the exact multipliers; samples of the error of a solve |
//! | `step/choice` | the solver that `auto` stands for |
//! | `run` | [`Stepper`]: steps one after the other, and what happens between them |
//! | `run/access` | values set between steps: states, loads, motors, winches, controls |
//! | `run/change` | bodies, constraints and controls added and removed |
//! | `run/events` | events after a step: ropes that break, hooks that catch |
//! | `run/resolution` | cables that merge and split their segments by rule |
//! | `run/balance` | energy of a motion beyond the work of its drives |
//! | `run/estimate` | the error of the load's position, by a coarse run of longer steps |
//! | `run/sleep` | scenes at rest, whose steps cost no solve |
//! | `run/saved` | runs saved and taken up again, to the same bits |
//! | `run/identity` | stable handles of bodies and constraints |
//! | `run/observe` | queries: forces, loads, energies, the linear system |
//! | `energy` | kinetic, gravitational and elastic energy |
//! | `options` | scheme, geometric stiffness, guard, Δt, form of the system, backend |
//! | `elimination` | the order in which the constraints are eliminated |
//! | `equilibrium`, `equilibrium_residual` | static equilibrium by solves; residual forces and law violations of a state at rest |
//! | `active_set` | rows with bounds: cables that cannot push, motors of limited force |
//! | `activation` | how such rows close and open without energy from nowhere |
//! | `response` | unknowns beside the linear system, condensed onto its factor: slip and contacts |
//! | `slip` | cables that slip over sheaves with friction |
//! | `contact`, `contact/operator` | contacts with friction: rows, dense operator |
//! | `effort` | the work that a step may spend on contacts, and the flag that ends it |
//! | `system_data` | data of the linear system, its residual, and dampers of ropes and rods that swing |
//! | `inertia` | M̃ and Δt f, in one place |
//! | `geometric`, `gyroscopic` | K; free rotation |
//! | `motion` | velocities and positions from velocity changes |
//! | `regularization` | Σ and c − J v, in one place |
//! | `history` | state to return to, past rates for multistep schemes |
//! | `assembly_map` | block patterns and index maps of a topology; fills the matrix |
//! | `assembly` | the joints' blocks of S, eight or four at a time |
//! | `serde_forms` | options by their names, times in seconds, for `serde` |
//! | `report` | report of a step, time of each phase |
//! | `error` | [`StepError`]: why there is no step, with the names of constraints |
//!
//! `run` uses `step`, never the reverse.

mod activation;
mod active_set;
mod assembly;
mod assembly_map;
mod contact;
mod effort;
mod elimination;
mod energy;
mod equilibrium;
mod equilibrium_residual;
mod error;
mod geometric;
mod gyroscopic;
mod history;
mod inertia;
mod motion;
mod options;
mod regularization;
mod report;
mod response;
mod run;
#[cfg(feature = "serde")]
mod serde_forms;
mod slip;
mod step;
mod system_data;
#[cfg(test)]
mod testing;

pub use contact::{ContactForce, ContactImpulses};
pub use elimination::{Elimination, EliminationOrder};
pub use energy::Energy;
pub use equilibrium::static_equilibrium;
pub use error::StepError;
pub use options::{Form, GeometricStiffness, Guard, Scheme, StepOptions, UnknownName, Weights};
pub use report::{ContactReport, Phase, PhaseTimes, StepReport};
pub use run::balance::EnergyBalance;
pub use run::estimate::{ErrorEstimate, ErrorPart};
pub use run::identity::{BodyId, ConstraintId, ControlId};
pub use run::resolution::Resolved;
pub use run::saved::SavedRun;
pub use run::sleep::Sleep;
pub use run::{Edit, Stepper};
pub use step::choice::Chosen;
pub use step::forces::RowForces;
