//! Runs that are saved and taken up again: all that the steps to come depend on, so that a restored run goes on with the
//! same bits.
//!
//! Besides the scene and its state these are the multipliers (where iterations start and what the geometric stiffness
//! is made of), the rates that multistep schemes look back on, the places and ages of bounded rows, and how long the guard still
//! holds. What each step computes anew is not saved, nor is the linear system of the last solve, which
//! [`Stepper::system`] shows. No backend knows more than this: what each keeps from step to step comes from the pattern.

pub(crate) mod beginning;
mod options;

use crate::activation::{Made, UNKNOWN};
use crate::active_set::RowState;
use crate::contact::Known;
use crate::history::History;
use crate::run::Stepper;
use crate::run::change::Moved;
use crate::run::sleep::Watch;
use crate::step::work::Account;
use crate::step::{Stage, Step};
use crate::{StepError, StepOptions};
use taut_model::{BodyVectors, Constraint, Scene};
use taut_solver::{LinearSolver, SolveError};

/// A run between two steps, as [`Stepper::save`] leaves it and [`Stepper::restore`] takes it.
///
/// With the feature `serde` it can be written and read in any format that keeps all bits of a double (with `serde_json`:
/// its feature `float_roundtrip`). Restoring checks every number.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SavedRun {
    #[cfg_attr(
        feature = "serde",
        serde(deserialize_with = "crate::serde_forms::known_version")
    )]
    version: u32,
    #[cfg_attr(
        feature = "serde",
        serde(deserialize_with = "crate::serde_forms::options")
    )]
    options: StepOptions,
    scene: Scene,
    time: f64,
    started: bool,
    #[cfg_attr(feature = "serde", serde(default))]
    fresh: Vec<usize>,
    advanced: f64,
    holding: usize,
    #[cfg_attr(feature = "serde", serde(default))]
    implicit: bool,
    impulses: Vec<f64>,
    impulse_time: f64,
    /// Forces reported of the last step, where they are not those of its last solve.
    #[cfg_attr(
        feature = "serde",
        serde(default, rename = "told", skip_serializing_if = "Vec::is_empty")
    )]
    reported: Vec<f64>,
    tension: Option<Vec<f64>>,
    places: Vec<RowState>,
    /// Steps since the bounded rows were last at a bound.
    ages: Vec<u8>,
    /// Rows without bounds that an event has just made.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Vec::is_empty")
    )]
    made: Vec<Made>,
    /// Where cables slip over sheaves with friction, 1 in the direction of travel, −1 against it.
    #[cfg_attr(feature = "serde", serde(default))]
    slips: Vec<i8>,
    /// Contacts of the last solve, and the length of their step \[s].
    #[cfg_attr(feature = "serde", serde(default))]
    contacts: Vec<Known>,
    #[cfg_attr(feature = "serde", serde(default))]
    contact_time: f64,
    /// v at the beginning of the last sub-step and its change: the energy belongs to the middle.
    velocity: Vec<[f64; 6]>,
    velocity_change: Vec<[f64; 6]>,
    /// ∂φ/∂t of the last step.
    drive: Vec<f64>,
    #[cfg_attr(feature = "serde", serde(default))]
    account: Account,
    /// Observations of rest; `None` in a scene that may not sleep.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Option::is_none")
    )]
    watch: Option<Watch>,
    past: Past,
}

/// Rates of the step before, for multistep schemes: see [`History`].
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
struct Past {
    known: bool,
    rate: Vec<f64>,
    drive: Vec<f64>,
    velocity: Vec<[f64; 6]>,
}

impl SavedRun {
    /// Version of the format; reading refuses others.
    pub const VERSION: u32 = 3;

    /// Version of the format.
    #[must_use]
    pub fn version(&self) -> u32 {
        self.version
    }

    /// The scene in its state.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// How it is stepped.
    #[must_use]
    pub fn options(&self) -> &StepOptions {
        &self.options
    }

    /// Time of the state \[s].
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// A run without state.
    fn empty(scene: Scene, options: StepOptions) -> Self {
        Self {
            version: Self::VERSION,
            options,
            scene,
            time: 0.0,
            started: false,
            fresh: Vec::new(),
            advanced: 0.0,
            holding: 0,
            implicit: false,
            impulses: Vec::new(),
            impulse_time: 0.0,
            reported: Vec::new(),
            tension: None,
            places: Vec::new(),
            ages: Vec::new(),
            made: Vec::new(),
            slips: Vec::new(),
            contacts: Vec::new(),
            contact_time: 0.0,
            velocity: Vec::new(),
            velocity_change: Vec::new(),
            drive: Vec::new(),
            account: Account::default(),
            watch: None,
            past: Past::default(),
        }
    }

    /// The run of a changed scene, whose bodies and rows have come from other places.
    pub(crate) fn moved(self, to: &Moved) -> Self {
        let Past {
            known,
            rate,
            drive,
            velocity,
        } = self.past;
        Self {
            fresh: Vec::new(),
            impulses: to.rows(&self.impulses),
            reported: match self.reported.is_empty() {
                true => Vec::new(),
                false => to.rows(&self.reported),
            },
            tension: self.tension.map(|tension| to.rows(&tension)),
            places: to.bounded(&self.places, RowState::Inside),
            ages: to.bounded(&self.ages, UNKNOWN),
            made: to.made(&self.made),
            // A changed cable finds its pattern of slip anew.
            slips: Vec::new(),
            contacts: to.contacts(&self.contacts),
            velocity: to.bodies(&self.velocity),
            velocity_change: to.bodies(&self.velocity_change),
            drive: to.rows(&self.drive),
            account: self.account.left(),
            watch: None,
            past: Past {
                known,
                rate: to.rows(&rate),
                drive: to.rows(&drive),
                velocity: to.bodies(&velocity),
            },
            ..self
        }
    }

    /// Checks what [`Stepper::new`] does not: numbers that are finite, as many as the scene has rows, bodies and bounds.
    fn check(&self, [rows, bodies, bounded, capstans]: [usize; 4]) -> Result<(), StepError> {
        for (what, time) in [
            ("time", self.time),
            ("advanced", self.advanced),
            ("impulse_time", self.impulse_time),
            ("contact_time", self.contact_time),
        ] {
            finite(what, [time].iter())?;
        }
        let contacts = self.contacts.iter();
        let numbers = contacts.flat_map(|known| known.key.iter().chain(&known.impulse));
        finite("contacts", numbers)?;
        for (what, positive) in [
            (
                "contact_time",
                self.contacts.is_empty() || self.contact_time > 0.0,
            ),
            ("impulse_time", self.impulse_time > 0.0),
            ("advanced", self.advanced >= 0.0),
        ] {
            if !positive {
                return Err(fault(what, "is negative or zero".to_owned()));
            }
        }
        let Past {
            rate,
            drive,
            velocity,
            ..
        } = &self.past;
        for (what, numbers) in [
            ("impulses", Some(&self.impulses)),
            (
                "told",
                Some(&self.reported).filter(|forces| !forces.is_empty()),
            ),
            ("tension", self.tension.as_ref()),
            ("drive", Some(&self.drive)),
            ("past.rate", Some(rate)),
            ("past.drive", Some(drive)),
        ] {
            let Some(numbers) = numbers else { continue };
            count(what, numbers.len(), rows)?;
            finite(what, numbers.iter())?;
        }
        for (what, numbers) in [
            ("velocity", &self.velocity),
            ("velocity_change", &self.velocity_change),
            ("past.velocity", velocity),
        ] {
            count(what, numbers.len(), bodies)?;
            finite(what, numbers.iter().flatten())?;
        }
        let (sums, by_row) = self.account.numbers();
        finite("account", sums)?;
        let counts = [rows, rows, bounded, bounded];
        let vectors = by_row.into_iter().zip(counts);
        for (numbers, needed) in vectors.filter(|(numbers, _)| !numbers.is_empty()) {
            count("account", numbers.len(), needed)?;
            finite("account", numbers.iter())?;
        }
        if let Some(watch) = &self.watch {
            let (numbers, counts) = watch.numbers();
            finite("watch", numbers)?;
            for found in counts {
                count("watch", found, bodies)?;
            }
        }
        if let Some(body) = self.fresh.iter().find(|body| **body >= bodies) {
            return Err(fault("fresh", format!("names body {body} of {bodies}")));
        }
        if !self.slips.is_empty() {
            count("slips", self.slips.len(), capstans)?;
        }
        let beyond = |row: &&Made| row.row >= rows;
        if let Some(row) = self.made.iter().find(beyond) {
            return Err(fault("made", format!("names row {} of {rows}", row.row)));
        }
        count("places", self.places.len(), bounded)?;
        count("ages", self.ages.len(), bounded)
    }
}

fn fault(what: &'static str, reason: String) -> StepError {
    StepError::Saved { what, reason }
}

fn count(what: &'static str, found: usize, expected: usize) -> Result<(), StepError> {
    if found == expected {
        return Ok(());
    }
    let reason = format!("has {found} entries: the scene has {expected}");
    Err(fault(what, reason))
}

fn finite<'a>(
    what: &'static str,
    mut numbers: impl Iterator<Item = &'a f64>,
) -> Result<(), StepError> {
    match numbers.find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(x) => Err(fault(what, format!("holds {x}: it must be finite"))),
    }
}

fn refill<T>(to: &mut Vec<T>, from: impl Iterator<Item = T>) {
    to.clear();
    to.extend(from);
}

fn put_into(six: &mut BodyVectors, numbers: &[[f64; 6]]) {
    for (i, x) in numbers.iter().enumerate() {
        six.set(i, *x);
    }
}

impl Stepper {
    /// The run as it stands between two steps. Allocates.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`] in [`StepError::Solve`] between [`solve`](Self::solve) and
    /// [`advance`](Self::advance); [`StepError::Scene`] and [`StepError::Saved`] where a step that failed or a setting
    /// has left numbers that are not finite.
    pub fn save(&self) -> Result<SavedRun, StepError> {
        if self.step.progress.stage == Stage::Solved {
            return Err(StepError::Solve {
                source: SolveError::OutOfOrder {
                    called: "save",
                    needs: "advance",
                },
                culprit: None,
                time: self.step.time,
            });
        }
        self.step.scene.validate()?;
        let saved = self.run_of(self.step.scene.clone());
        let (bodies, capstans) = (self.step.scene.bodies.len(), self.step.scene.capstans.len());
        let counts = [
            self.step.multipliers.mu.len(),
            bodies,
            saved.places.len(),
            capstans,
        ];
        saved.check(counts)?;
        Ok(saved)
    }

    /// The run as it stands, of the scene or of another that takes its place.
    pub(crate) fn run_of(&self, scene: Scene) -> SavedRun {
        let mut run = SavedRun::empty(scene, self.step.options.clone());
        self.fill(&mut run);
        if !self.step.multipliers.tension_known {
            run.tension = None;
        }
        run.watch = self.rest.as_ref().map(|rest| rest.watch.clone());
        run
    }

    /// Writes the run as it stands into `run`, but for scene, options and observations of rest. The
    /// tension is there even where it is not known. Allocates only where `run` had less of
    /// something.
    fn fill(&self, run: &mut SavedRun) {
        let bodies = self.step.scene.bodies.len();
        let six = |to: &mut Vec<[f64; 6]>, of: &BodyVectors| {
            refill(to, (0..bodies).map(|i| of.get(i)));
        };
        run.time = self.step.time;
        run.started = self.step.progress.started;
        run.fresh.clone_from(&self.step.progress.newly_added);
        run.advanced = self.step.progress.stage.advanced();
        run.holding = self.step.guarded.hold_off;
        run.implicit = match self.step.progress.stage {
            Stage::Advanced { implicit, .. } => implicit,
            // A question about the next step came between.
            _ => !self.step.progress.started && self.step.guarded.division.goes_on,
        };
        refill(&mut run.impulses, self.step.multipliers.mu.iter().copied());
        run.impulse_time = self.step.multipliers.mu_dt;
        let reported = self.step.output.reported.forces().into_iter().flatten();
        refill(&mut run.reported, reported.copied());
        let tension = run.tension.get_or_insert_default();
        refill(tension, self.step.multipliers.tension.iter().copied());
        refill(&mut run.places, self.step.active_set.places());
        refill(&mut run.ages, self.step.activation.ages().iter().copied());
        refill(&mut run.made, self.step.activation.made().iter().copied());
        refill(&mut run.slips, self.step.slip.motions());
        let (known, dt) = self.step.contacts.known();
        refill(&mut run.contacts, known.iter().copied());
        run.contact_time = dt;
        six(&mut run.velocity, &self.step.system_data.v);
        six(&mut run.velocity_change, &self.step.system_data.dv);
        refill(
            &mut run.drive,
            self.step.system_data.rows.phi_t.iter().copied(),
        );
        run.account.copy_from(&self.step.output.account);
        let History {
            known,
            rate,
            phi_t,
            v,
            ..
        } = &self.step.history;
        run.past.known = *known;
        refill(&mut run.past.rate, rate.iter().copied());
        refill(&mut run.past.drive, phi_t.iter().copied());
        six(&mut run.past.velocity, v);
    }

    /// Takes a saved run up again: it goes on with the same bits, on the same machine and with the same features.
    ///
    /// # Errors
    /// As [`Stepper::new`] for its scene and options; [`StepError::Saved`] where its parts do not fit together.
    pub fn restore(saved: SavedRun) -> Result<Self, StepError> {
        Self::restore_with(saved, &mut None)
    }

    /// Restores a run with the solver `given`, as [`build`](Self::build) takes it.
    pub(crate) fn restore_with(
        mut saved: SavedRun,
        given: &mut Option<Box<dyn LinearSolver>>,
    ) -> Result<Self, StepError> {
        let mut scene = std::mem::take(&mut saved.scene);
        scene.start_in_equilibrium = false;
        // Before cables that are new are taken to lie as they are laid.
        scene.validate()?;
        saved.options.validate()?;
        let massless = |c: &Constraint| matches!(c, Constraint::MasslessCable(_));
        if scene.constraints.iter().any(massless) {
            scene.lay_cables(saved.time);
            scene.validate()?;
            scene.lay_cables(0.0);
        }
        let mut stepper = Self::of(Step::new(scene, saved.options.clone(), given)?);
        let bounded = stepper.step.active_set.places().count();
        let (bodies, capstans) = (
            stepper.step.scene.bodies.len(),
            stepper.step.scene.capstans.len(),
        );
        let counts = [stepper.step.multipliers.mu.len(), bodies, bounded, capstans];
        if let Err(e) = saved.check(counts) {
            *given = Some(stepper.step.system.solver);
            return Err(e);
        }
        stepper.step.time = saved.time;
        stepper.step.progress.started = saved.started;
        stepper.step.progress.newly_added = saved.fresh;
        if saved.advanced > 0.0 {
            stepper.step.progress.stage = Stage::Advanced {
                dt: saved.advanced,
                implicit: saved.implicit,
            };
        }
        stepper.step.guarded.division.goes_on = saved.implicit;
        stepper.step.guarded.hold_off = saved.holding;
        stepper.step.multipliers.mu = saved.impulses.into();
        stepper.step.multipliers.mu_dt = saved.impulse_time;
        if !saved.reported.is_empty() {
            stepper.step.output.reported.put(saved.reported);
        }
        stepper.step.multipliers.tension_known = saved.tension.is_some();
        if let Some(tension) = saved.tension {
            stepper.step.multipliers.tension = tension.into();
        }
        stepper.step.active_set.put(&saved.places);
        stepper.step.activation.put(&saved.ages);
        stepper.step.make_young(saved.made);
        stepper.step.slip.put(&saved.slips);
        stepper
            .step
            .contacts
            .put(saved.contacts, saved.contact_time);
        let rows = &mut stepper.step.system_data.rows;
        rows.update(&stepper.step.scene, saved.time);
        rows.phi_t = saved.drive.into();
        put_into(&mut stepper.step.system_data.v, &saved.velocity);
        put_into(&mut stepper.step.system_data.dv, &saved.velocity_change);
        stepper.step.output.account = saved.account;
        if let (Some(rest), Some(watch)) = (&mut stepper.rest, saved.watch) {
            if watch.asleep.is_some() {
                stepper.step.tell_known_contacts()?;
            }
            rest.watch = watch;
        }
        stepper.step.history.known = saved.past.known;
        stepper.step.history.rate = saved.past.rate.into();
        stepper.step.history.phi_t = saved.past.drive.into();
        put_into(&mut stepper.step.history.v, &saved.past.velocity);
        Ok(stepper)
    }
}
