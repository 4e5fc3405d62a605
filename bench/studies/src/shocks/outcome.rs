//! Records of runs through shocks, and the verdicts on them.

use super::scene::{Shock, scene};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use taut_ground::pace;
use taut_ground::trajectory::{Failure, Timing, gaps, load_position, steps_in};
use taut_integrator::{StepError, StepOptions, StepReport, Stepper};
use taut_model::{Bodies, Linearized, Scene};

/// Largest gain of energy, over the largest kinetic energy of the reference, that counts as none.
pub const GAIN: f64 = 0.01;

/// Largest error of the load's position, over the cable's length, in the right swing.
pub const SWING: f64 = 0.01;

/// The elongation may be larger than the reference's by this factor …
pub const STRETCH: f64 = 1.05;

/// … and by this part of the cable's length.
pub const SLACK: f64 = 1e-3;

/// Distance of the load from the anchor, over the cable's length, at which a run is given up.
const LOST: f64 = 10.0;

/// Times before the end over which a run's, and the reference's, elongation is taken \[s]: the latter holds a bounce of
/// the heaviest load.
const LAST: (f64, f64) = (1.0, 5.0);

/// Record of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Run {
    /// Why and when it ended early: a step failed or the load was lost.
    pub failure: Option<Failure>,
    /// Position of the load at the end \[m].
    pub load: [f64; 3],
    /// Largest kinetic energy, that of the beginning included \[J].
    pub peak_kinetic: f64,
    /// Total energy at the first instant after the shock \[J].
    pub first_energy: f64,
    /// Largest total energy from then on \[J].
    pub peak_energy: f64,
    /// Total energy at the end \[J].
    pub last_energy: f64,
    /// Largest elongation (sum of the gaps) in the last second \[m].
    pub elongation: f64,
    /// Largest elongation in the last 5 s \[m].
    pub swing_elongation: f64,
    /// Largest gap of a joint in the last second \[m].
    pub gap: f64,
    /// Steps taken back by the guard and redone.
    pub redone: usize,
    /// The guard's implicit sub-steps.
    pub implicit_substeps: usize,
    /// Implicit sub-steps whose Newton passes did not converge.
    pub unconverged_substeps: usize,
    /// Steps taken.
    pub steps: usize,
    /// Linear systems solved, of all steps.
    pub solves: usize,
    /// Most of a step.
    pub max_solves: usize,
}

/// Total energy of a scene \[J]: kinetic, gravitational, and ½ φ²/ε of its pose.
#[must_use]
pub fn initial_energy(scene: &Scene) -> f64 {
    let mut rows = Linearized::new(scene);
    rows.update(scene, 0.0);
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
///
/// # Errors
/// A scene or options that a stepper refuses.
pub fn measure(
    shock: Shock,
    ratio: f64,
    length: f64,
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
    let dt = options.dt;
    let mut stepper = Stepper::new(scene, options)?;
    let mut meter = Meter::default();
    let from = shock.end() - 1e-9;
    let mut counted = false;
    for _ in 0..steps_in(time, dt) {
        let report = match pace::step(&mut stepper) {
            Ok(report) => report,
            Err(e) => {
                run.fail(stepper.time(), e.to_string());
                break;
            }
        };
        if let Some(energy) = meter.read(&stepper, &report) {
            run.peak_kinetic = run.peak_kinetic.max(energy.kinetic);
            if energy.time >= from {
                if !std::mem::replace(&mut counted, true) {
                    run.first_energy = energy.total;
                }
                run.peak_energy = run.peak_energy.max(energy.total);
                run.last_energy = energy.total;
            }
        }
        run.count(&report);
        let left = time - report.time;
        if left < LAST.1 {
            let elongation = gaps(&stepper).sum();
            run.swing_elongation = run.swing_elongation.max(elongation);
            if left < LAST.0 {
                run.elongation = run.elongation.max(elongation);
                run.gap = gaps(&stepper).fold(run.gap, f64::max);
            }
        }
        let load = load_position(stepper.scene());
        run.load = load.into();
        if load.norm().is_nan() || load.norm() > LOST * length {
            run.fail(report.time, "the load is lost".to_owned());
            break;
        }
    }
    Ok(run)
}

impl Run {
    fn fail(&mut self, time: f64, reason: String) {
        self.failure = Some(Failure { time, reason });
    }

    fn count(&mut self, report: &StepReport) {
        self.steps += 1;
        self.redone += usize::from(report.redone);
        self.implicit_substeps += report.implicit_substeps;
        self.unconverged_substeps += report.unconverged_substeps;
        self.solves += report.solves;
        self.max_solves = self.max_solves.max(report.solves);
    }

    fn distance(&self, other: &Self) -> f64 {
        let squares = self.load.iter().zip(&other.load);
        squares.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    }
}

/// The step's times over a run through a shock: median and maximum, each step the fastest of `repeats` runs, which are
/// the same to the last bit.
///
/// # Errors
/// As [`measure`].
pub fn times(
    shock: Shock,
    ratio: f64,
    length: f64,
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

/// The fine motion that runs are judged by.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The finer of two.
    pub run: Run,
    /// Distance between the two ends of the load: what is not known of it \[m]. Infinite where one of them failed.
    pub uncertainty: f64,
    /// Total energy that the motion starts with \[J]: of the scene; of the reference after a jerk, whose work is not
    /// known beforehand.
    pub start_energy: f64,
    /// Largest gap of a joint at rest \[m].
    pub equilibrium_gap: f64,
}

impl Reference {
    pub(crate) fn new(
        shock: Shock,
        ratio: f64,
        length: f64,
        coarser: &Run,
        run: Run,
    ) -> Result<Self, StepError> {
        let failed = coarser.failure.is_some() || run.failure.is_some();
        Ok(Self {
            uncertainty: if failed {
                f64::INFINITY
            } else {
                run.distance(coarser)
            },
            start_energy: match shock {
                Shock::Jerk => run.first_energy,
                _ => initial_energy(&scene(shock, ratio, length)?),
            },
            equilibrium_gap: shock.equilibrium_gap(ratio, length)?,
            run,
        })
    }
}

/// Verdict on the load's final position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Swing {
    /// Within the bar, or within three times what is not known of the reference.
    Right,
    /// The two reference motions end farther apart than the bar: nobody knows.
    Chaotic,
    /// Elsewhere.
    Wrong,
}

/// A setting's run through one shock, against the reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    pub setting: String,
    pub shock: Shock,
    /// Mass of the load over that of a segment.
    pub ratio: f64,
    /// Length of the cable \[m].
    pub length: f64,
    #[serde(flatten)]
    pub run: Run,
    /// Distance of the load at the end from the reference's \[m].
    pub error_m: f64,
    /// Uncertainty of the reference's load position \[m].
    pub uncertainty_m: f64,
    /// Largest energy after the shock less that which the motion started with, over `scale_j`.
    pub gain: f64,
    /// Largest kinetic energy of the reference \[J].
    pub scale_j: f64,
    /// Elongation that the cable may have in the last second \[m].
    pub elongation_bar_m: f64,
    /// Largest gap of the last second less the largest at rest, over a segment's length.
    pub excess_gap: f64,
    /// The run reached its end.
    pub finite: bool,
    /// The elongation is within its bar.
    pub keeps_length: bool,
    /// The gain of energy is at most [`GAIN`].
    pub no_gain: bool,
    pub swing: Swing,
    /// Worst step, of the setting whose steps are timed \[ns].
    pub worst_step_ns: Option<f64>,
    /// Median step, likewise \[ns].
    pub median_step_ns: Option<f64>,
}

impl Outcome {
    pub(crate) fn new(
        setting: &str,
        (shock, ratio, length): (Shock, f64, f64),
        run: Run,
        reference: &Reference,
    ) -> Self {
        let finite = run.failure.is_none();
        let scale_j = reference.run.peak_kinetic;
        let gain = (run.peak_energy - reference.start_energy) / scale_j;
        let error_m = run.distance(&reference.run);
        let elongation_bar_m = STRETCH * reference.run.swing_elongation + SLACK * length;
        let bar = (SWING * length).max(3.0 * reference.uncertainty);
        let segment = length / super::SEGMENTS as f64;
        Self {
            setting: setting.to_owned(),
            shock,
            ratio,
            length,
            error_m,
            uncertainty_m: reference.uncertainty,
            gain,
            scale_j,
            elongation_bar_m,
            excess_gap: (run.gap - reference.equilibrium_gap) / segment,
            finite,
            keeps_length: finite && run.elongation <= elongation_bar_m,
            no_gain: finite && gain <= GAIN,
            swing: if reference.uncertainty > SWING * length {
                Swing::Chaotic
            } else if finite && error_m <= bar {
                Swing::Right
            } else {
                Swing::Wrong
            },
            worst_step_ns: None,
            median_step_ns: None,
            run,
        }
    }

    /// True if the run is finite, keeps its length and gains no energy.
    #[must_use]
    pub fn survives(&self) -> bool {
        self.finite && self.keeps_length && self.no_gain
    }

    /// True if all four verdicts are good.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.survives() && self.swing == Swing::Right
    }

    /// True if a verdict is bad. A chaotic swing is not.
    #[must_use]
    pub fn fails(&self) -> bool {
        !self.survives() || self.swing == Swing::Wrong
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference(uncertainty: f64) -> Reference {
        Reference {
            run: Run {
                peak_kinetic: 100.0,
                swing_elongation: 1.0,
                ..Run::default()
            },
            uncertainty,
            start_energy: -50.0,
            equilibrium_gap: 0.0,
        }
    }

    fn judge(uncertainty: f64, change: impl FnOnce(&mut Run)) -> Outcome {
        let mut run = Run {
            peak_energy: -50.0,
            ..Run::default()
        };
        change(&mut run);
        Outcome::new("", (Shock::Drop, 1e3, 10.0), run, &reference(uncertainty))
    }

    #[test]
    fn each_verdict_has_its_bar() {
        assert!(judge(0.0, |_| ()).passes());
        let gains = |joules| judge(0.0, |r| r.peak_energy += joules);
        assert!(gains(0.99).no_gain && !gains(1.01).no_gain && gains(1.01).fails());
        let longer = |metres| judge(0.0, |r| r.elongation = metres);
        assert!(longer(1.059).keeps_length && !longer(1.061).keeps_length);
        let swing = |uncertainty, error| judge(uncertainty, |r| r.load[0] = error).swing;
        assert_eq!(swing(0.0, 0.099), Swing::Right);
        assert_eq!(swing(0.0, 0.101), Swing::Wrong);
        assert_eq!(swing(0.05, 0.149), Swing::Right);
        assert_eq!(swing(0.05, 0.151), Swing::Wrong);
        assert_eq!(swing(0.11, 0.0), Swing::Chaotic);
        let ends = judge(0.0, |r| r.fail(1.0, String::new()));
        assert!(!(ends.finite || ends.keeps_length || ends.no_gain));
        assert_eq!(ends.swing, Swing::Wrong);
    }

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
            let run = measure(shock, 1e5, 10.0, &unguarded, 1.0).unwrap();
            let begin = initial_energy(&scene(shock, 1e5, 10.0).unwrap());
            for end in [run.first_energy, run.peak_energy, run.last_energy] {
                let off = (end - begin) / run.peak_kinetic;
                assert!(off.abs() < 1e-3, "{shock}: {off}");
            }
        }
    }
}
