//! A mode of a discrete scene beside its formula: as eigenvalue of the library's own matrices ([`taut_ground::modes`]), and
//! as the frequency of the motion that starts in its shape.

use super::frequency;
use taut_ground::modes::Natural;
use taut_integrator::StepOptions;
use taut_model::Scene;
use taut_output::check::{Check, ExperimentError};

/// Largest displacement (m) or rotation (rad) of a motion.
const AMPLITUDE: f64 = 1e-5;

/// A mode, and what is known of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape<'a> {
    /// The scene at rest.
    pub(super) scene: &'a Scene,
    /// Its natural oscillations.
    pub(super) modes: Option<&'a Natural>,
    /// Which of them.
    pub(super) number: usize,
    /// Exact frequency of the discrete scene \[rad/s].
    pub(super) discrete: f64,
    /// Frequency of the continuum \[rad/s].
    pub(super) continuum: f64,
    /// Largest relative error beside the discrete scene that passes.
    pub(super) bar: f64,
}

impl Shape<'_> {
    fn beside(&self, case: impl Into<String>, found: f64) -> Check {
        Check::relative(case, [self.discrete, found], "rad/s", self.bar)
            .space_part((self.discrete / self.continuum - 1.0).abs())
    }

    pub(super) fn eigenvalue(&self, case: impl Into<String>) -> Check {
        let found = self.modes.map_or(f64::NAN, |m| m.frequency(self.number));
        self.beside(case, found)
            .algebraic()
            .by("relative, beside the discrete model; space: that beside the continuum")
    }

    /// The scene moved into the shape.
    pub(super) fn displaced(&self) -> Scene {
        let mut scene = self.scene.clone();
        if let Some(modes) = self.modes {
            modes.displace(&mut scene, self.number, AMPLITUDE);
        }
        scene
    }

    /// The motion over `periods`, whose frequency is `stepped` (rad/s) by the law of the step; where that is not known, by
    /// the motion in half as long steps, which has a quarter of the time step's error.
    pub(super) fn motion(
        &self,
        case: impl Into<String>,
        options: StepOptions,
        (stepped, periods): (Option<f64>, f64),
    ) -> Result<Check, ExperimentError> {
        let largest = |m: &Natural| m.shapes.column(self.number).iamax();
        let of = self.modes.map_or(0, largest);
        let (body, c) = (of / 6, of % 6);
        let rest = self.scene.bodies.orientation[body].inverse();
        let coordinate = |scene: &Scene| {
            if c < 3 {
                scene.bodies.position[body][c]
            } else {
                (scene.bodies.orientation[body] * rest).scaled_axis()[c - 3]
            }
        };
        let expected = (self.discrete, periods);
        let of = |options| frequency::of_motion(self.displaced(), options, expected, coordinate);
        let finer = StepOptions {
            dt: 0.5 * options.dt,
            ..options.clone()
        };
        let found = of(options)?;
        let (stepped, by) = match stepped {
            Some(stepped) => (stepped, "by its law"),
            // An error of second order left in half the steps is a third of the change.
            None => {
                let change = found - of(finer)?;
                (
                    self.discrete + 4.0 / 3.0 * change,
                    "by the motion in half as long steps",
                )
            }
        };
        let by = format!(
            "relative, beside the discrete model; time: what the scheme makes of its frequency, {by}; algebraic: what \
             remains; space: the discrete model beside the continuum"
        );
        let check = self
            .beside(case, found)
            .algebraic_part((found / stepped - 1.0).abs());
        Ok(check
            .time_part((stepped / self.discrete - 1.0).abs())
            .by(by))
    }
}
