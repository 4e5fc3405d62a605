//! Bodies, constraints, materials and scenes of hoisting cables.
//!
//! This crate is the physics of `taut`: what there is (bodies, joints, gravity), how far the joints are violated, how
//! the violations change with the motion (Jacobians), and how stiff the joints are (compliances from material
//! constants). It knows no time step and solves nothing: time stepping reads a [`Scene`] through [`Linearized`].
//!
//! Source: **\[SL]** M. Servin, C. Lacoursière, *Rigid Body Cable for Virtual Environments*; `[SL (21)]` is its
//! equation 21.
//!
//! # Example
//! A load of 5 t on 8 segments of steel cable, at rest:
//! ```
//! use taut_model::{HoistParams, Linearized};
//!
//! let params = HoistParams {
//!     segments: 8,
//!     load_mass: Some(5000.0),
//!     ..HoistParams::default()
//! };
//! let scene = params.hanging_equilibrium()?;
//! let mut lin = Linearized::new(&scene);
//! lin.update(&scene, 0.0);
//! // Row 2 of the anchor is its gap along z: tension = gap / compliance, here (5000 + 8) kg · 9.81 m/s².
//! let tension = lin.phi[2] / lin.compliance[2];
//! assert!((tension - 5008.0 * 9.81).abs() < 1e-6);
//! # Ok::<(), taut_model::SceneError>(())
//! ```
//!
//! # Symbols
//! SI units. Vectors are in the world frame unless said otherwise; angles are in radians.
//!
//! | symbol | name in the code | meaning | unit |
//! |---|---|---|---|
//! | x | `position` | centre of mass | m |
//! | e | `orientation` | unit quaternion, body to world | – |
//! | v, ω | `velocity`, `angular_velocity` | velocities; v = \[v; ω] together | m/s, rad/s |
//! | m, I | `mass`, `inertia` | mass; inertia about the centre, body frame | kg, kg m² |
//! | M | | diag(m I₃, R I Rᵀ) | kg, kg m² |
//! | r | [`Resolved::lever`] | centre of mass to attachment point | m |
//! | u, v, w | [`Frame::axes`] | along the cable, and two directions across | – |
//! | φ | [`Linearized::phi`] | violation \[SL (7)] | m or rad |
//! | ∂φ/∂t | [`Linearized::phi_t`] | its rate by prescribed motion | m/s or rad/s |
//! | J | [`Linearized::jacobian`] | φ̇ = J v + ∂φ/∂t | 1, m |
//! | ε | [`RowLaw::compliance`] | compliance: ε λ = −(φ + τ φ̇) | m/N or rad/(N m) |
//! | τ | [`RowLaw::damping`] | damping time | s |
//! | λ | | multiplier: force or torque of a row, force on the bodies Jᵀ λ | N or N m |
//! | θ, β | | bend angle; its two components | rad |
//! | Ω | `twist_reference` | twist angle with its winding; what it is unwrapped against | rad |
//! | d, n | [`Transverse::distance`] | between attachment points of a link, a minus b; d/\|d\| | m, – |
//! | t₁, t₂ | | unit vectors across a link ([`Distance`]) | – |
//! | s₀ | [`Paper::safeguard`] | keeps d/(s₀ + \|d\|) finite | – |
//! | Y, ν, ρ | [`Material`] | Young's modulus, Poisson's ratio, density | Pa, –, kg/m³ |
//! | A, I_a, J_t | [`CrossSection`] | area, second moment, torsion constant | m², m⁴, m⁴ |
//! | YA, YI, GJ | [`Stiffness`] `ea`, `ei`, `gj` | axial, bending, torsional stiffness | N, N m², N m² |
//! | l, L | `segment_length`, `length` | length of a segment, of the cable | m |
//! | r, θ, μ | [`Sheave`], [`Scene::wrap`], [`Capstan::friction`] | radius, wrap and friction of a sheave; μ is also [`Surface::friction`] | m, rad, – |
//! | L(t) | [`MasslessCable::length_at`], [`Fairlead::length_at`] | length at rest of a cable with a winch | m |
//! | lo, hi | [`RowBounds`] | bounds of λ: a cable cannot push, a motor has a limited force | N or N m |
//! | g | | gap of two shapes along the normal of a contact, < 0 in overlap | m |
//! | M/m | [`HoistParams::mass_ratio`] | mass of the load over that of a segment | – |
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | [`body`] | [`Bodies`] as a structure of arrays, shapes and their inertias |
//! | [`frame`] | attachment frames on bodies and in the world |
//! | [`constraint`] | the kinds of joint, one file each: derivation, φ, J, test; `constraint/gap.rs`: φ and J of the gap, [SL (25), (26)]; `constraint/loads.rs`: what a constraint carries |
//! | [`linearized`] | all constraints at one instant, in flat arrays |
//! | [`body_vectors`] | six numbers a body, as vectors of lanes want them |
//! | [`lanes`], `packs` | how joints are stored and evaluated, eight or four at a time |
//! | [`material`] | materials, sections, stiffness, compliance of joints |
//! | [`scene`] | [`Scene`]: everything together, energies, validation |
//! | `notes` | how far constraints may open, and what in a scene is likely to be a mistake |
//! | [`cable`] | [`Cable`]: segments and joints along a route; what belongs to a cable |
//! | [`collide`] | [`Collider`]: shapes on bodies and their surfaces, which pairs can touch |
//! | [`contacts`] | [`contacts::Collisions`]: where they touch; broad and narrow phase |
//! | [`topology`] | which bodies hang together, loops, groups, leaf-to-root order |
//! | [`hoist`], [`particles`], [`mod@named`] | the main scene, particle chains, and their parameters; scenes by name |
//! | [`network`] | cables with branches and loops: ring, junction, cranes, ladder, net |
//! | [`gantry`] | the gantry crane \[SL §VIII], its parameters and controls |
//! | [`scene::reeving`] | massless cables over sheaves with friction, in parts; `constraint/sheave.rs`: tangents and wraps |
//! | [`scene::segments`], [`scene::resolution`] | segments that split and merge; the rule by which a cable refines itself |
//! | [`scene::winding`] | cables of segments at their winches: cut, split and merged; `constraint/fairlead.rs`: φ and J there |
//! | [`contact_scenes`] | a stack of boxes, a load dragged over a floor, cables in a pile |
//! | [`reeved`] | a capstan, a block and tackle, a traction elevator |
//! | [`specimen`] | straight cables pulled, twisted, bent \[SL §VII-A] |
//! | `scene_file` (feature `toml`) | scenes as TOML text, read with overrides and written; the format |
//! | `unlimited` (feature `serde`) | limits that may be infinite, in formats that know finite numbers alone |
//! | `testing` (tests) | any constraint's Jacobian against finite differences |
//! | `motion` | [`Motion`]: prescribed motion of points of the world |
//! | `seed` | small random velocities, from a number |
//! | `error` | [`SceneError`]: what is wrong with a scene, and where |
//! | `params` | what states each parameter of a named scene once: meaning, type, default, range |
//! | `names` | [`nearest`] name, and which names an error of an unknown one tells |
//!
//! # Where this differs from the paper
//! - Joint compliance \[SL (34)–(36)] holds with half segment lengths: here l is the distance between the centres of
//!   neighbouring segments, and the torsion constant J_t is that of the section, not I_a ([`material`]).
//! - The twist angle \[SL (22)] is signed, or its winding number would be lost where the unsigned angle folds
//!   ([`Paper`]).
//! - The bend angle \[SL (21)] resists one of two transverse directions: the ordinary joint is [`Cosserat`], with two.
//! - A prescribed motion enters as ∂φ/∂t, absent in \[SL (11)] ([`Linearized::update`]).

pub mod body;
pub mod body_vectors;
pub mod cable;
pub mod collide;
pub mod constraint;
pub mod contact_scenes;
pub mod contacts;
mod error;
pub mod frame;
pub mod gantry;
pub mod hoist;
pub mod lanes;
pub mod linearized;
pub mod material;
mod motion;
pub mod named;
mod names;
pub mod network;
mod notes;
mod packs;
mod params;
pub mod particles;
pub mod reeved;
pub mod scene;
#[cfg(feature = "toml")]
pub mod scene_file;
mod seed;
pub mod specimen;
#[cfg(test)]
mod testing;
pub mod topology;
#[cfg(feature = "serde")]
pub mod unlimited;

pub use body::{Bodies, Body, Mobility};
pub use body_vectors::{BodyLanes, BodyPack, BodyVectors};
pub use cable::{Cable, CableEnd, Damping, End, JointKind, Rest, Segments};
pub use collide::{Collider, DEFAULT_GROUP, Shape, Surface};
pub use constraint::kinds::*;
pub use constraint::{
    BendDefinition, Constraint, JointLaw, Loads, MAX_ROWS, Motor, RowKind, RowLaw, Sheave,
    SheaveContact, Target, TwistDefinition, Winch, Wrench,
};
pub use contact_scenes::{ContactScene, ContactSceneParams};
pub use error::SceneError;
pub use frame::{Frame, Resolved, Side, axes_along, hanging_axes};
pub use gantry::{Controls, GantryParams, ResolvedGantry};
pub use hoist::{Apart, Hoist, HoistParams};
pub use linearized::{Block, Linearized, RowBounds, Slot, Transverse, update_windings};
pub use material::{CrossSection, Material, Stiffness};
pub use motion::Motion;
/// The vectors and rotations of the public items, in the version that they are of.
pub use nalgebra;
pub use named::named;
pub use names::nearest;
pub use network::{Held, Network, NetworkParams, ResolvedNetwork};
pub use packs::{Joint, JointLanes, JointSide};
pub use particles::{ChainModel, ParticleChainParams};
pub use reeved::{Reeved, ReevedParams};
pub use scene::{Action, CableParts, Capstan, Control, Drive, Event, Scene, When};
#[cfg(feature = "toml")]
pub use scene_file::SceneSource;
pub use specimen::{ResolvedSpecimen, Specimen, SpecimenParams};
#[cfg(test)]
use testing::check_jacobian;
pub use topology::Topology;
