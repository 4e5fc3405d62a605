//! Records of runs through shocks.

use super::Case;
use super::scene::scene;
use crate::motions::{self, linearized};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use taut_integrator::{StepError, StepOptions, StepReport, Stepper};
use taut_measure::trajectory::{Failure, Timing, gaps, load_position, steps_in};
use taut_model::{Bodies, Scene};

/// Distance of the load from the anchor, over the cable's length, at which a run is given up.
const LOST: f64 = 10.0;

/// Times before the end over which a run's, and the reference's, elongation is taken \[s]: the latter holds a bounce of
/// the heaviest load.
const LAST: (f64, f64) = (1.0, 5.0);

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Run {
    /// Why and when it ended early: a step failed or the load was lost.
    pub(super) failure: Option<Failure>,
    /// Position of the load at the end \[m].
    pub(super) load: [f64; 3],
    /// Largest kinetic energy, that of the beginning included \[J].
    pub(super) peak_kinetic: f64,
    /// Total energy at the first instant after the shock \[J].
    pub(super) first_energy: f64,
    /// Largest total energy from then on \[J].
    pub(super) peak_energy: f64,
    /// Total energy at the end \[J].
    pub(super) last_energy: f64,
    /// Largest elongation (sum of the gaps) in the last second \[m].
    pub(super) elongation: f64,
    /// Largest elongation in the last 5 s \[m].
    pub(super) swing_elongation: f64,
    /// Largest gap of a joint in the last second \[m].
    pub(super) gap: f64,
    /// Steps taken back by the guard and redone.
    pub(super) redone: usize,
    /// The guard's implicit sub-steps.
    pub(super) implicit_substeps: usize,
    /// Implicit sub-steps whose Newton passes did not converge.
    pub(super) unconverged_substeps: usize,
    pub(super) steps: usize,
    /// Linear systems solved, of all steps.
    pub(super) solves: usize,
    /// Most of a step.
    pub(super) max_solves: usize,
}

/// Total energy of a scene \[J]: kinetic, gravitational, and ½ φ²/ε of its pose.
pub(super) fn initial_energy(scene: &Scene) -> f64 {
    let rows = linearized(scene);
    let stored = rows.phi.iter().zip(&rows.compliance);
    let elastic: f64 = stored
        .filter(|(_, e)| **e > 0.0)
        .map(|(phi, e)| 0.5 * phi * phi / e)
        .sum();
    scene.kinetic_energy() + scene.potential_energy() + elastic
}

/// Reads energies whose parts belong to one instant.
///
/// A staggered step evaluates its rows not at the positions x_n but at x̃ = x_n + Δt (p v_{n+1} − q v_n + s v_{n−1}), see
/// [`Scheme`](taut_integrator::Scheme). The tension of a bouncing load belongs to x̃, and so must its height: λ is large, and what the elastic
/// energy gains through it over a small difference of positions would be taken for a gain of energy. The tension of an
/// implicit step belongs to its end. Either way the kinetic energy is that of the mean of the velocities before and
/// after, so that an implicit step is read together with the next; the first step of all is not read, for what it starts
/// from is known.
#[derive(Default)]
struct Meter {
    /// −g·(momentum), the rate of the gravitational energy, after the last step and the one before, where the scheme
    /// knows them \[W].
    power: [Option<f64>; 2],
    /// Gravitational and elastic energy at the end of the last step, where that was implicit \[J].
    potential: Option<f64>,
    /// Velocities after the last step.
    velocity: Vec<Vector3<f64>>,
    angular_velocity: Vec<Vector3<f64>>,
}

/// Energies at one instant \[J], and the instant \[s].
struct Reading {
    kinetic: f64,
    total: f64,
    time: f64,
}

impl Meter {
    /// After a step, which must not have sub-steps.
    fn read(&mut self, stepper: &Stepper, report: &StepReport) -> Option<Reading> {
        let (scene, dt) = (stepper.scene(), stepper.options().dt);
        let scheme = stepper.options().scheme;
        let power = -scene.gravity.dot(&scene.momentum());
        let [now, before] = self.power;
        let potential = scene.potential_energy() + stepper.elastic_energy();
        let reading = |kinetic, potential| Reading {
            kinetic,
            total: kinetic + potential,
            time: report.time - dt,
        };
        let read;
        if scheme.is_staggered() && !report.redone && report.implicit_substeps == 0 {
            let weights = scheme.weights();
            read = now.map(|now| {
                // x̃ − x_{n+1}, seen along gravity.
                let back = (weights.next - 1.0) * power - weights.now * now
                    + weights.before * before.unwrap_or(now);
                reading(stepper.energy().kinetic, potential + dt * back)
            });
            self.power = [Some(power), now];
            self.potential = None;
        } else {
            read = self
                .potential
                .map(|potential| reading(self.mean_kinetic(&scene.bodies), potential));
            // The next step takes its past to be like its present.
            self.power = [Some(power), None];
            self.potential = Some(potential);
        }
        self.velocity.clone_from(&scene.bodies.velocity);
        self.angular_velocity
            .clone_from(&scene.bodies.angular_velocity);
        read
    }

    fn mean_kinetic(&self, bodies: &Bodies) -> f64 {
        let of = |i: usize| {
            let v = (self.velocity[i] + bodies.velocity[i]) * 0.5;
            let w = (self.angular_velocity[i] + bodies.angular_velocity[i]) * 0.5;
            0.5 * (bodies.mass[i] * v.norm_squared() + w.dot(&(bodies.inertia_world(i) * w)))
        };
        (0..bodies.len()).map(of).sum()
    }
}

/// Runs a shock's scene for `time` (s). Sub-steps are taken as steps, so that each is seen.
pub(super) fn measure(
    (shock, ratio, length): Case,
    options: &StepOptions,
    time: f64,
) -> Result<Run, StepError> {
    let scene = scene(shock, ratio, length)?;
    let mut run = Run {
        peak_kinetic: scene.kinetic_energy(),
        peak_energy: f64::MIN,
        ..Run::default()
    };
    let options = StepOptions {
        dt: options.dt / options.substeps as f64,
        substeps: 1,
        ..options.clone()
    };
    let steps = steps_in(time, options.dt);
    let mut meter = Meter::default();
    let from = shock.end() - 1e-9;
    let mut counted = false;
    run.failure = motions::run(scene, options, steps, |stepper, report| {
        if let Some(energy) = meter.read(stepper, report) {
            run.peak_kinetic = run.peak_kinetic.max(energy.kinetic);
            if energy.time >= from {
                if !std::mem::replace(&mut counted, true) {
                    run.first_energy = energy.total;
                }
                run.peak_energy = run.peak_energy.max(energy.total);
                run.last_energy = energy.total;
            }
        }
        run.count(report);
        let left = time - report.time;
        if left < LAST.1 {
            let elongation = gaps(stepper).sum();
            run.swing_elongation = run.swing_elongation.max(elongation);
            if left < LAST.0 {
                run.elongation = run.elongation.max(elongation);
                run.gap = gaps(stepper).fold(run.gap, f64::max);
            }
        }
        let load = load_position(stepper.scene());
        run.load = load.into();
        if load.norm().is_nan() || load.norm() > LOST * length {
            return Err("the load is lost".to_owned());
        }
        Ok(())
    })?;
    Ok(run)
}

impl Run {
    fn count(&mut self, report: &StepReport) {
        self.steps += 1;
        self.redone += usize::from(report.redone);
        self.implicit_substeps += report.implicit_substeps;
        self.unconverged_substeps += report.unconverged_substeps;
        self.solves += report.solves;
        self.max_solves = self.max_solves.max(report.solves);
    }

    /// Distance of the load at the end from another run's \[m].
    pub(super) fn distance(&self, other: &Self) -> f64 {
        let squares = self.load.iter().zip(&other.load);
        squares.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    }
}

/// The step's times over a run through a shock: median and maximum, each step the fastest of `repeats` runs, which are
/// the same to the last bit.
pub(super) fn times(
    (shock, ratio, length): Case,
    options: &StepOptions,
    time: f64,
    repeats: usize,
) -> Result<Timing, StepError> {
    let mut fastest = vec![Duration::MAX; steps_in(time, options.dt)];
    for _ in 0..repeats {
        let mut stepper = Stepper::new(scene(shock, ratio, length)?, options.clone())?;
        for fastest in &mut fastest {
            let Ok(report) = stepper.step() else {
                break;
            };
            *fastest = report.phases.total().min(*fastest);
        }
    }
    Ok(Timing::of(
        fastest.into_iter().filter(|t| *t < Duration::MAX),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shocks::Shock;

    /// The load's bounce, in which energies of 10⁶ J change places, and a swing after a jerk: what is read stays within
    /// a thousandth of what the scene has.
    #[test]
    fn readings_agree_with_the_scene_and_with_each_other() {
        let unguarded = StepOptions {
            guard: None,
            dt: 1.0 / 480.0,
            ..StepOptions::default()
        };
        for shock in [Shock::Double, Shock::LoadKick] {
            let run = measure((shock, 1e5, 10.0), &unguarded, 1.0).unwrap();
            let begin = initial_energy(&scene(shock, 1e5, 10.0).unwrap());
            for end in [run.first_energy, run.peak_energy, run.last_energy] {
                let off = (end - begin) / run.peak_kinetic;
                assert!(off.abs() < 1e-3, "{shock}: {off}");
            }
        }
    }
}
