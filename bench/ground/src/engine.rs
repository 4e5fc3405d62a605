//! An engine that steps the hoist, ours or another's: its settings, and how it is put at the start of a motion.

pub mod motion;

use motion::Motion;
use nalgebra::Vector3;
use taut_integrator::StepError;

/// One frame of a run: the load's position after it, or why there is none \[m].
pub type Frame = Box<dyn FnMut() -> Result<Vector3<f64>, String>>;

/// How a motion is begun.
pub type Start = Box<dyn Fn(&Motion) -> Result<Frame, StepError>>;

/// A setting of an engine.
pub struct Setting {
    /// In the tables.
    pub text: String,
    /// Steps a frame, of whatever kind the engine makes.
    pub substeps: usize,
    /// Puts the engine at the start of a motion.
    pub start: Start,
}

/// An engine and its settings.
pub struct Engine {
    /// Its name in the tables.
    pub name: &'static str,
    /// Settings, ladder by ladder, each of them from the cheapest to the dearest.
    pub ladders: Vec<Vec<Setting>>,
    /// Whether every setting is a row. Else the cheapest within the bar is the only one.
    pub all: bool,
}

/// Sub-steps from `least` to `most`, doubling.
pub fn doubling(least: usize, most: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(least), move |n| (2 * n <= most).then_some(2 * n))
}

/// A number of sub-steps, as text.
#[must_use]
pub fn substeps(n: usize) -> String {
    match n {
        1 => "1 step".to_owned(),
        n => format!("{n} sub-steps"),
    }
}
