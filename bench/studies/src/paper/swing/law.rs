//! The damping law on single deformation modes: a ball on a spring, and two balls that twist against each other.

use crate::law::{fitted, roots};
use crate::paper::words::filled;
use serde::Serialize;
use serde_json::json;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::SceneSource;

/// Measured effect of the step on a mode, beside the law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Law {
    /// `stretch`, `twist`.
    pub mode: &'static str,
    /// ωΔt.
    pub frequency: f64,
    /// Factor of the amplitude in a step.
    pub amplitude: f64,
    /// (1 + ω²Δt²)^(−1/2).
    pub amplitude_law: f64,
    /// Phase of a step \[rad].
    pub phase: f64,
    /// arctan ωΔt \[rad].
    pub phase_law: f64,
}

impl Law {
    /// The larger of the two distances from the law.
    pub fn error(&self) -> f64 {
        let amplitude = (self.amplitude - self.amplitude_law).abs();
        amplitude.max((self.phase - self.phase_law).abs())
    }
}

/// Mass of the balls \[kg], and the moment of inertia of one, ⅖ m r², halved, since both turn \[kg m²].
const MASS: f64 = 2.0;
const INERTIA: f64 = 0.5 * 0.4 * MASS * 0.1 * 0.1;

/// The modes, and their rows in the scene.
const MODES: [(&str, usize); 2] = [("stretch", 0), ("twist", 8)];

/// The stretch and the twist mode with frequency ωΔt = `frequency`, stepped by the paper's step.
pub fn law(frequency: f64, dt: f64) -> Result<[Law; 2], StepError> {
    // ω² = 1/(ε m).
    let square = (frequency / dt).powi(2);
    let row = json!({ "stretch": 1.0 / (square * MASS), "twist": 1.0 / (square * INERTIA) });
    let text = filled(include_str!("modes.toml"), &row);
    let options = StepOptions {
        dt,
        ..StepOptions::paper()
    };
    let mut stepper = Stepper::new(SceneSource::parse(&text, &[])?.build()?, options)?;
    let mut samples = [[0.0; 4]; 2];
    for k in 0..4 {
        for (x, (_, row)) in samples.iter_mut().zip(MODES) {
            x[k] = stepper.linearized().phi[row];
        }
        stepper.step()?;
    }
    Ok([0, 1].map(|i| {
        let found = roots(&fitted(&samples[i], 2));
        let [amplitude, phase] = found.first().copied().unwrap_or([f64::NAN; 2]);
        Law {
            mode: MODES[i].0,
            frequency,
            amplitude,
            amplitude_law: (1.0 + frequency * frequency).sqrt().recip(),
            phase,
            phase_law: frequency.atan(),
        }
    }))
}
