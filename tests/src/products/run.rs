//! A scene of choices, stepped, and what each step showed.

use super::{Choices, RATE, TIME, scene};
use crate::prelude::*;
use std::cell::OnceCell;

/// A part of a cable without mass at the end of a step.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) name: String,
    /// Path less length \[m].
    pub(crate) phi: f64,
    /// At rest, with what lies on drums \[m].
    pub(crate) length: f64,
    /// m/N and s.
    pub(crate) compliance: f64,
    pub(crate) damping: f64,
    /// Over the last sub-step, over the step, and at which its drum slips \[N].
    pub(crate) tension: f64,
    pub(crate) mean: f64,
    pub(crate) holds: f64,
}

/// A sheave with friction in the last sub-step.
#[derive(Debug, Clone)]
pub(crate) struct Wheel {
    pub(crate) parts: [String; 2],
    /// Slip in the direction of travel \[m/s].
    pub(crate) slip: f64,
    /// e^(μθ) of the end of the step.
    pub(crate) grip: f64,
}

/// Observations of one step.
#[derive(Debug, Clone)]
pub(crate) struct Moment {
    pub(crate) report: StepReport,
    /// At the end of the step.
    pub(crate) bodies: Bodies,
    pub(crate) parts: Vec<Part>,
    pub(crate) wheels: Vec<Wheel>,
    pub(crate) contacts: Vec<ContactForce>,
    /// Mean force of constraints and contacts on each body in the step \[N].
    pub(crate) forces: Vec<Vector3<f64>>,
    /// The sizes of those forces, added up \[N].
    pub(crate) sizes: Vec<f64>,
    /// Tensions of a cable of segments \[N]: as its last joint reports it, in its last segment, and
    /// the largest in any.
    pub(crate) column: Option<[f64; 3]>,
    pub(crate) fired: Vec<String>,
    /// The force by which each of them was due \[N].
    pub(crate) fired_forces: Vec<Option<f64>>,
    pub(crate) bits: Vec<u64>,
}

/// A run, and what ended it early.
#[derive(Debug, Default)]
pub(crate) struct Run {
    pub(crate) steps: Vec<Moment>,
    pub(crate) error: Option<StepError>,
}

/// Choices, their scene, its run.
#[derive(Debug)]
pub struct Case {
    pub(crate) choices: Choices,
    pub(crate) scene: Scene,
    /// Energy of its massless ropes at the start \[J].
    pub(crate) stretched: f64,
    pub(crate) run: Run,
    /// Distances of the load's ends \[m] with Δt, Δt/2 and Δt/4, once they are known.
    pub(crate) halvings: OnceCell<Option<[f64; 2]>>,
    /// Its run with a step for each sub-step, once it is known.
    fine: OnceCell<Option<Run>>,
}

/// Options of a run of the choices.
pub(crate) fn options(c: &Choices) -> StepOptions {
    StepOptions {
        dt: 1.0 / RATE,
        substeps: c.steps.substeps,
        guard: c.steps.guard.then(Guard::default),
        // The balance is judged here, not by the step.
        energy_tolerance: Some(1e300),
        estimate: c.steps.estimate.then_some(2),
        sleep: c.steps.sleep.then(sleep),
        ..StepOptions::default()
    }
}

/// Rest is seen in half a second: in the default three nothing sleeps within the time of a run. The
/// period is beyond that of the slowest swing.
pub(crate) fn sleep() -> Sleep {
    Sleep {
        distance: 1e-3,
        after: 0.3,
        period: 5.0,
    }
}

impl Moment {
    fn of(stepper: &Stepper, report: StepReport) -> Self {
        let scene = stepper.scene();
        let rows = stepper.linearized();
        let time = stepper.time();
        let mut parts = Vec::new();
        for (k, constraint) in scene.constraints.iter().enumerate() {
            if let Constraint::MasslessCable(cable) = constraint {
                // The laws are those of a solve; nothing pushes in a whole step either.
                let force = stepper.last_forces(k).map_or(0.0, |rows| rows[0]);
                let mean = stepper.row_forces(k).map_or(0.0, |rows| rows[0]);
                parts.push(Part {
                    name: scene.constraint_names[k].clone(),
                    phi: rows.phi[rows.row_range(k).start],
                    length: cable.length_at(time),
                    compliance: rows.compliance[rows.row_range(k).start],
                    damping: cable.law.damping,
                    // Not −0.
                    tension: 0.0 - force,
                    mean: 0.0 - mean,
                    holds: (scene.constraints[k].bounds(time))
                        .map_or(f64::INFINITY, |(_, lower, _)| -lower),
                });
            }
        }
        let wheels = scene.capstans.iter().zip(stepper.slip_rates());
        let wheels = wheels.enumerate().map(|(i, (capstan, slip))| Wheel {
            parts: capstan.parts.map(|c| scene.constraint_names[c].clone()),
            slip,
            grip: (capstan.friction * scene.wrap(i)).exp(),
        });
        let (forces, sizes) = forces(stepper);
        Self {
            report,
            bodies: scene.bodies.clone(),
            parts,
            wheels: wheels.collect(),
            contacts: stepper.contacts().collect(),
            forces,
            sizes,
            column: column(stepper),
            fired: stepper.fired().to_vec(),
            fired_forces: stepper.fired_forces().to_vec(),
            bits: bits(stepper),
        }
    }

    /// True if the step is that of the scheme, solved once: its forces are no means.
    pub(crate) fn is_one_solve(&self) -> bool {
        self.report.implicit_substeps == 0 && self.report.divided == 0
    }

    /// The part of that name, if there is one.
    pub(crate) fn part(&self, name: &str) -> Option<&Part> {
        self.parts.iter().find(|part| part.name == name)
    }
}

/// The sum of the forces on each body, and of their sizes.
fn forces(stepper: &Stepper) -> (Vec<Vector3<f64>>, Vec<f64>) {
    let scene = stepper.scene();
    let mut forces = vec![Vector3::zeros(); scene.bodies.len()];
    let mut sizes = vec![0.0; forces.len()];
    for (k, constraint) in scene.constraints.iter().enumerate() {
        for (side, frame) in constraint.frames().iter().enumerate() {
            if let (Some(body), Some(wrench)) = (frame.body_index(), stepper.force_on(k, side)) {
                forces[body] += wrench.force;
                sizes[body] += wrench.force.norm();
            }
        }
    }
    for contact in stepper.contacts() {
        for (body, force) in forces.iter_mut().enumerate() {
            *force += contact.on(body);
            sizes[body] += contact.on(body).norm();
        }
    }
    (forces, sizes)
}

fn column(stepper: &Stepper) -> Option<[f64; 3]> {
    let cable = stepper.scene().cables.first()?;
    let at_end = stepper.tension(*cable.joints.last()?)?;
    let within = (0..cable.bodies.len()).map(|s| stepper.tension_in(&cable.name, s));
    let within: Vec<f64> = within.flatten().collect();
    let most = within.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some([at_end, *within.last()?, most])
}

impl Run {
    /// So many steps of a stepper.
    pub(crate) fn of(mut stepper: Stepper, steps: usize) -> Self {
        let mut run = Self::default();
        for _ in 0..steps {
            match stepper.step() {
                Ok(report) => run.steps.push(Moment::of(&stepper, report)),
                Err(error) => {
                    run.error = Some(error);
                    break;
                }
            }
        }
        run
    }
}

/// Steps of a run.
pub(crate) fn steps() -> usize {
    (TIME * RATE) as usize
}

impl Case {
    /// Builds and runs.
    ///
    /// # Errors
    /// Where the scene, or its first state, is refused.
    pub(crate) fn of(choices: &Choices) -> Result<Self, StepError> {
        let refused = |e: SceneError| StepError::Scene(e);
        let scene = scene::build(choices).map_err(refused)?;
        let stepper = Stepper::new(scene.clone(), options(choices))?;
        let rows = stepper.linearized();
        let stored = |(k, c): (usize, &Constraint)| {
            let Constraint::MasslessCable(cable) = c else {
                return 0.0;
            };
            let phi = rows.phi[rows.row_range(k).start].max(0.0);
            0.5 * phi * phi / cable.compliance_at(0.0).max(1e-300)
        };
        let stretched = scene.constraints.iter().enumerate().map(stored).sum();
        Ok(Self {
            stretched,
            halvings: OnceCell::new(),
            fine: OnceCell::new(),
            choices: choices.clone(),
            run: Run::of(stepper, steps()),
            scene,
        })
    }

    /// The run with a step for each sub-step: the case's own, where a step has one.
    pub(crate) fn fine(&self) -> Option<&Run> {
        let own = options(&self.choices);
        let substeps = own.substeps;
        if substeps == 1 {
            return Some(&self.run);
        }
        let run = || {
            let options = own.with(|o| (o.dt, o.substeps) = (o.dt / substeps as f64, 1));
            let stepper = Stepper::new(self.scene.clone(), options).ok()?;
            Some(Run::of(stepper, self.run.steps.len() * substeps))
        };
        self.fine.get_or_init(run).as_ref()
    }

    /// Steps a second of the run with a step for each sub-step.
    pub(crate) fn rate(&self) -> f64 {
        RATE * self.choices.steps.substeps as f64
    }

    /// Number of the load's body.
    pub(crate) fn load(&self) -> usize {
        self.scene.load.unwrap_or(0)
    }

    /// The moment before step `n`: its bodies.
    pub(crate) fn before(&self, n: usize) -> &Bodies {
        match n.checked_sub(1) {
            Some(last) => &self.run.steps[last].bodies,
            None => &self.scene.bodies,
        }
    }
}
