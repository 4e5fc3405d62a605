//! Recordings of runs: what moved, what it carried and touched, in one file that people look at and programs read.
//!
//! ```
//! use taut_measure::trajectory::{Limits, Simulation};
//! use taut_integrator::{StepOptions, Stepper};
//! use taut_model::HoistParams;
//! use taut_recording::{Recorder, Recording};
//!
//! let scene = HoistParams { segments: 3, ..HoistParams::default() }.build()?;
//! let mut stepper = Stepper::new(scene, StepOptions { backend: "dense".parse()?, ..StepOptions::default() })?;
//! let mut file = Vec::new();
//! let mut recorder = Recorder::begin(&mut file, &stepper, 60)?;
//! let mut simulation = Simulation::new(60, Limits::Sweep(1.0));
//! while let Some(sample) = simulation.step(&mut stepper) {
//!     recorder.step(&mut file, &stepper, &sample)?;
//! }
//! recorder.end(&mut file, stepper.time(), None)?;
//! let recording = Recording::read(&mut &file[..])?;
//! assert_eq!(recording.frames(), 60);
//! let load = recording.parts[0].layout.channel("load.z").expect("recorded");
//! assert!((recording.parts[0].value(59, load) - stepper.scene().bodies.position[3].z).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The format
//! Numbers are little-endian. A file is `taut-recording` and a line feed, a byte with the version, which is
//! 1, and chunks:
//!
//! | bytes | hold |
//! |---:|---|
//! | 4 | n, the length of the rest |
//! | 4 | its CRC-32 (IEEE) |
//! | n | raw deflate of a CBOR item (RFC 8949) and of the bytes behind it |
//!
//! The items are maps of one entry, by the names of the fields here:
//!
//! | item | holds |
//! |---|---|
//! | `header` | program, scene, solver, gravity, Δt: [`Header`]; the first chunk |
//! | `layout` | channels, bodies, shapes, cables, sheaves, ground: [`layout::Layout`]; another one where bodies come or go |
//! | `frames` | times, numbers of contacts, events; behind it the numbers of all channels, and ten of each contact |
//! | `end` | time, steps, and why the run ended early, if it did: [`End`]; the last chunk |
//!
//! **Numbers.** Times have 64 bits. Channels and contacts have 32: single-precision numbers, which keep 7 digits, such as
//! 1 µm in 10 m, and NaN for what is not there; but for quaternions, whose components are counts of 1/32767, so that
//! directions keep 10⁻⁴ rad. `planes.rs` has their coding. Forces are those of
//! [`Stepper::loads`](taut_integrator::Stepper::loads); energies, gaps, the estimate of the error (m) and the time of a step
//! (ns) are those of the frame's step.
//!
//! **Frames** are those of each n-th step: at most 60 of a simulated second, and so few that without contacts a run of the length
//! that was announced takes 2²⁷ bytes before they are deflated. Where contacts, layouts or more steps take more, n doubles, and
//! again when half of what is left of 2²⁸ bytes is used up: a file is bounded, whatever the number of steps.
//!
//! **Cut files.** A chunk is whole or does not count: a file that was cut or damaged is read up to there. A state that is not
//! finite is the end of its recording.
//!
//! # Map
//! | module | holds |
//! |---|---|
//! | `record`, `observe` | what records a run; what a frame and a layout take from a stepper |
//! | `read` | what was recorded |
//! | `layout` | what a recording knows of a scene |
//! | `table`, `page`, `animation`, `still` | tables of it; a page to look at; animated glTF; one frame as a picture |
//! | `place` | where things are in a frame |
//! | `file`, `planes` | chunks, and the coding of numbers |

// Unpublished: a comment says why, a unit or an error, not a name again.
#![allow(missing_docs)]

mod animation;
mod file;
pub mod layout;
mod observe;
mod page;
mod place;
mod planes;
mod read;
mod record;
mod still;
mod table;
#[cfg(test)]
mod tests;

pub use animation::{NoFrames, animation};
pub use file::{End, Header, RecordingError, VERSION};
pub use observe::{Observer, observe_contacts};
pub use page::{LOOK, PICTURE, STYLE, page};
pub use read::{Contact, Ending, Part, Recording};
pub use record::{BUDGET, MOST_A_SECOND, Recorder};
pub use still::{Still, still};
pub use table::table;
