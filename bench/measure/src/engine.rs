//! An engine, ours or another's: its settings, and how it is put at the start of a motion.
//!
//! Types are those of the hoist unless they are named: `M` is the start, `P` what a frame tells, the load's position
//! \[m]. On the [ground](contact_scenes) it is that of every body.

pub mod contact_scenes;
pub mod motion;

use motion::Motion;
use nalgebra::Vector3;
use taut_integrator::StepError;

/// One frame of a run: what is known after it, or why nothing is.
pub type Frame<P = Vector3<f64>> = Box<dyn FnMut() -> Result<P, String>>;

/// How a motion is begun.
pub type Start<M = Motion, P = Vector3<f64>> = Box<dyn Fn(&M) -> Result<Frame<P>, StepError>>;

pub struct Setting<M = Motion, P = Vector3<f64>> {
    pub text: String,
    /// Steps a frame, of whatever kind the engine makes.
    pub substeps: usize,
    /// Puts the engine at the start of a motion.
    pub start: Start<M, P>,
}

/// An engine and its settings.
pub struct Engine<M = Motion, P = Vector3<f64>> {
    /// Name in the tables.
    pub name: &'static str,
    /// Settings, ladder by ladder, each of them from the cheapest to the dearest.
    pub ladders: Vec<Vec<Setting<M, P>>>,
    /// Shows every setting as a row; otherwise only the cheapest one within the bar.
    pub all: bool,
}

/// Sub-steps from `least` to `most`, doubling.
pub fn doubling(least: usize, most: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(least), move |n| (2 * n <= most).then_some(2 * n))
}

/// A number of sub-steps, as text.
pub fn substeps(n: usize) -> String {
    match n {
        1 => "1 step".to_owned(),
        n => format!("{n} sub-steps"),
    }
}
