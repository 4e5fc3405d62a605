//! The amplitude of the load's swing, early and late.

use super::{Config, MOVE, Setting, moved, options};
use nalgebra::{Matrix4, Vector4};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use taut_ground::pace;
use taut_ground::trajectory::{Failure, load_position};
use taut_integrator::{StepError, Stepper};

/// Amplitudes of one run \[m].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Amplitude {
    /// At the first moment.
    pub early_m: f64,
    /// At the second.
    pub late_m: f64,
}

impl Amplitude {
    /// Relative change from the first to the second.
    #[must_use]
    pub fn change(&self) -> f64 {
        self.late_m / self.early_m - 1.0
    }
}

/// One run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Swing {
    /// Load over segment mass.
    pub mass_ratio: f64,
    pub scheme: String,
    /// The geometric stiffness.
    pub stiffness: String,
    /// Δt \[s].
    pub dt: f64,
    /// Amplitudes; `None` where the run was lost before the second moment.
    pub amplitudes: Option<Amplitude>,
    /// late/early over that of the run with the smallest time step, minus 1: what the scheme does, apart from what the
    /// motion does by itself.
    pub change_over_fine: Option<f64>,
    /// Steps that the guard redid.
    pub redone: usize,
    /// How the run was lost.
    pub failure: Option<Failure>,
}

/// The pendulum's motion in a swing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pendulum {
    /// Its amplitude \[m].
    pub amplitude: f64,
    /// Root mean square of what is of other frequencies \[m].
    pub rest: f64,
}

/// The pendulum's motion in a swing sampled every `dt` (s): that of the sinusoid which fits two periods
/// from time `from` (s) on best, frequency included, so that the cable's own modes do not count. `rate` (rad/s) is a first
/// guess of its frequency. `None` where there are not enough samples. Sample i belongs to the time (i + 1) `dt`.
#[must_use]
pub fn pendulum(x: &[f64], dt: f64, from: f64, rate: f64) -> Option<Pendulum> {
    let first = ((from / dt).round() as usize).saturating_sub(1);
    let count = (2.0 * TAU / (rate * dt)).round() as usize;
    let x = x.get(first..first.checked_add(count)?)?;
    let middle = 0.5 * (count as f64 - 1.0);
    let mut rate = rate;
    let mut fit = Vector4::zeros();
    // Gauss-Newton on x ≈ c + a cos ωt + b sin ωt, t from the window's middle; the first passes find a and b.
    for _ in 0..FIT_PASSES {
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for (i, x) in x.iter().enumerate() {
            let t = (i as f64 - middle) * dt;
            let (sin, cos) = (rate * t).sin_cos();
            let slope = t * (fit[2] * cos - fit[1] * sin);
            let gradient = Vector4::new(1.0, cos, sin, slope);
            normal += gradient * gradient.transpose();
            right += gradient * *x;
        }
        // Without an amplitude there is nothing to say about the frequency.
        if normal.m44 == 0.0 {
            normal.m44 = 1.0;
        }
        fit = normal.lu().solve(&right)?;
        rate += fit[3];
    }
    let rest = x.iter().enumerate().map(|(i, x)| {
        let (sin, cos) = (rate * (i as f64 - middle) * dt).sin_cos();
        (x - fit[0] - fit[1] * cos - fit[2] * sin).powi(2)
    });
    Some(Pendulum {
        amplitude: fit[1].hypot(fit[2]),
        rest: (rest.sum::<f64>() / count as f64).sqrt(),
    })
}

const FIT_PASSES: usize = 12;

/// Swings with the time step of `config` over `finer`.
pub(super) fn run(
    config: &Config,
    mass_ratio: f64,
    setting: Setting,
    finer: usize,
) -> Result<Swing, StepError> {
    let params = moved(config.segments, mass_ratio, true);
    let dt = config.dt / finer as f64;
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, options(setting, dt, true))?;
    let length_over_gravity = (params.length + params.exact_elongation()) / params.gravity;
    let [early, late] = config.moments;
    let rate = length_over_gravity.sqrt().recip();
    let steps = ((late + 2.0 * TAU / rate) / dt).ceil() as usize + 1;
    let mut swing = Swing {
        mass_ratio,
        scheme: setting.0.to_string(),
        stiffness: setting.1.to_string(),
        dt,
        amplitudes: None,
        change_over_fine: None,
        redone: 0,
        failure: None,
    };
    let mut x = Vec::with_capacity(steps);
    for _ in 0..steps {
        match pace::step(&mut stepper) {
            Ok(report) => swing.redone += usize::from(report.redone),
            Err(e) => {
                swing.failure = Some(Failure {
                    time: stepper.time(),
                    reason: e.to_string(),
                });
                return Ok(swing);
            }
        }
        x.push(load_position(stepper.scene()).x - MOVE);
    }
    let at = |moment| Some(pendulum(&x, dt, moment, rate)?.amplitude);
    swing.amplitudes = at(early)
        .zip(at(late))
        .map(|(early_m, late_m)| Amplitude { early_m, late_m });
    Ok(swing)
}

/// Fills in `change_over_fine` from the finest run of each ratio.
pub(super) fn compare(swings: &mut [Swing]) {
    for group in swings.chunk_by_mut(|a, b| a.mass_ratio == b.mass_ratio) {
        let Some(fine) = group.iter().min_by(|a, b| a.dt.total_cmp(&b.dt)) else {
            continue;
        };
        let (dt, fine) = (fine.dt, fine.amplitudes);
        for swing in group.iter_mut().filter(|s| s.dt > dt) {
            let both = swing.amplitudes.zip(fine);
            swing.change_over_fine =
                both.map(|(own, fine)| (1.0 + own.change()) / (1.0 + fine.change()) - 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_amplitude_of_a_pendulum_is_found_among_other_motions() {
        let dt = 1.0 / 60.0;
        let sample = |i: u32| {
            let t = dt * f64::from(i);
            0.3 * (0.97 * t + 0.4).cos() + 0.01 + 1e-3 * (7.3 * t).sin()
        };
        let x: Vec<f64> = (1..2400).map(sample).collect();
        for from in [0.0, 1.234, 5.0, 20.0] {
            let found = pendulum(&x, dt, from, 1.0).unwrap().amplitude;
            assert!((found / 0.3 - 1.0).abs() < 2e-4, "{found}");
        }
        assert_eq!(pendulum(&x, dt, 33.0, 1.0), None);
        assert_eq!(pendulum(&x, dt, 1e9, 1.0), None);
    }
}
