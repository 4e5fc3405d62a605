//! The damping law on single deformation modes: a ball on a spring, and two balls that twist against each other.

use crate::paper::words::filled;
use serde_json::{Value, json};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::SceneSource;

/// Mass of the balls \[kg], and the moment of inertia of one, ⅖ m r², halved, since both turn \[kg m²].
const MASS: f64 = 2.0;
const INERTIA: f64 = 0.5 * 0.4 * MASS * 0.1 * 0.1;

/// The modes, and their rows in the scene.
const MODES: [(&str, usize); 2] = [("stretch", 0), ("twist", 8)];

/// Amplitude factor and phase of x_{n+2} = 2 a cos θ x_{n+1} − a² x_n, from four samples.
fn recurrence(x: [f64; 4]) -> [f64; 2] {
    let determinant = x[1] * x[1] - x[0] * x[2];
    let square = (x[2] * x[2] - x[1] * x[3]) / determinant;
    let trace = (x[1] * x[2] - x[0] * x[3]) / determinant;
    let amplitude = square.sqrt();
    // Near a cosine of 1 the sine determines the angle better.
    let cosine = 0.5 * trace / amplitude;
    let sine = ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt();
    [amplitude, sine.atan2(cosine)]
}

/// The stretch and the twist mode with frequency ωΔt = `frequency`, stepped by the paper's step: factor of the amplitude and
/// phase (rad) of a step beside (1 + ω²Δt²)^(−1/2) and arctan ωΔt, and the larger of the two distances from them.
pub(super) fn law(frequency: f64, dt: f64) -> Result<[Value; 2], StepError> {
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
    let [amplitude_law, phase_law] = [
        (1.0 + frequency * frequency).sqrt().recip(),
        frequency.atan(),
    ];
    Ok([0, 1].map(|i| {
        let [amplitude, phase] = recurrence(samples[i]);
        json!({
            "mode": MODES[i].0,
            "frequency": frequency,
            "amplitude": amplitude,
            "amplitude_law": amplitude_law,
            "phase": phase,
            "phase_law": phase_law,
            "error": (amplitude - amplitude_law).abs().max((phase - phase_law).abs()),
        })
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recurrence_is_found_again() {
        let x = [0.0, 1.0, 2.0, 3.0].map(|n: f64| 0.9_f64.powf(n) * (0.3 * n + 0.2).cos());
        let [amplitude, phase] = recurrence(x);
        assert!((amplitude - 0.9).abs() < 1e-14 && (phase - 0.3).abs() < 1e-13);
    }
}
