//! The run that is driven: commands change it, frames show it. It knows no clock.

use axum::body::Bytes;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use taut_integrator::{GeometricStiffness, Scheme, StepError, StepOptions, Stepper};
use taut_measure::Choice;
use taut_measure::trajectory::{Limits, Sample, Simulation};
use taut_model::{Control, Scene};
use taut_recording::layout::Layout;
use taut_recording::{Observer, Recorder, observe_contacts};

/// A command of a driver. In JSON, for example,
/// `{"set": {"control": "hoist_speed", "value": 0.5}}` or `"restart"`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Command {
    /// Sets a control, or one of the motors and winches that follow it.
    Set {
        control: String,
        /// The name of the joint or cable that follows it; `None` for all.
        #[serde(default)]
        drive: Option<String>,
        /// Its value \[m/s or rad/s].
        value: f64,
    },
    /// Stands still, or goes on.
    Pause(bool),
    /// Makes one step, and stands still.
    Step,
    /// Goes on with another solver: [`Choice`].
    Solver(String),
    /// Goes on with another scheme: [`Scheme`].
    Scheme(String),
    /// Goes on with another mass of the load \[kg].
    Mass(f64),
    /// Begins a recording, or ends it.
    Record(bool),
    /// Begins anew, with the present solver and scheme; where they make no step, with those of the last step that was made,
    /// or of the start, which [`Status::fallback`] then says.
    Restart,
}

/// State of the run that the page shows beside frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Status {
    /// Solver and scheme.
    pub solver: String,
    /// See `solver`.
    pub scheme: String,
    pub paused: bool,
    /// Steps made.
    pub steps: u64,
    /// Values of the controls, one for each motor and winch that follows \[m/s or rad/s].
    pub controls: Vec<Vec<Option<f64>>>,
    /// Mass of the load \[kg].
    pub load: Option<f64>,
    /// The estimated error of the load so far.
    pub error: Option<Error>,
    /// Why the run has ended.
    pub failure: Option<String>,
    /// Why the run began with other options than the chosen ones, and with which.
    pub fallback: Option<String>,
    /// Bytes of the recording that goes on.
    pub recording: Option<usize>,
    /// Bytes of the one that has ended.
    pub recorded: Option<usize>,
}

/// The estimated error of the load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Error {
    /// The largest so far \[m].
    pub total: f64,
    /// True once the estimate is lost, for example because the motion is chaotic.
    pub lost: bool,
    /// Steps that were not compared.
    pub unseen: u64,
}

/// Data that a page needs to draw frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct About {
    /// Number of the layout that frames name.
    pub generation: u32,
    /// Gravity \[m/s²].
    pub gravity: [f64; 3],
    /// Names of the controls, and of the motors and winches that follow each.
    pub controls: Vec<(String, Vec<String>)>,
    /// The solvers and schemes to choose from.
    pub solvers: Vec<String>,
    /// See `solvers`.
    pub schemes: Vec<String>,
    pub layout: Layout,
}

/// A run that is driven.
pub struct Drive {
    start: Scene,
    stepper: Stepper,
    simulation: Simulation,
    observer: Observer,
    generation: u32,
    /// The last step.
    sample: Sample,
    /// Simulated time that is due \[s].
    due: f64,
    steps: u64,
    paused: bool,
    values: Vec<i32>,
    /// Numbers of the last frame, whose turns the next one goes on from.
    last: Vec<i32>,
    contacts: Vec<i32>,
    tape: Option<(Recorder, Vec<u8>)>,
    recorded: Option<Bytes>,
    options: Options,
    stop: Option<Arc<AtomicBool>>,
    /// Why the run began with other options than the chosen ones.
    fallback: Option<String>,
}

/// Options that a restart may begin with, beside the stepper's own.
struct Options {
    first: StepOptions,
    /// Options of the last step that was made; `None` until they differ from `first`.
    proven: Option<StepOptions>,
    /// Options chosen after the run has ended, for the restart.
    next: Option<StepOptions>,
}

/// A run after its first step, which `stop` ends early.
type Begun = (Stepper, Simulation, Sample);

fn begun(
    scene: &Scene,
    options: StepOptions,
    stop: Option<&Arc<AtomicBool>>,
) -> Result<Begun, StepError> {
    let mut stepper = Stepper::new(scene.clone(), options)?;
    if let Some(stop) = stop {
        stepper.stop_by(Arc::clone(stop));
    }
    let mut simulation = Simulation::new(usize::MAX, Limits::Scene(scene.gap_limits()));
    match simulation.step(&mut stepper) {
        Some(sample) => Ok((stepper, simulation, sample)),
        // A step without an error was asked to end.
        None => Err(simulation.error.unwrap_or(StepError::Stopped {
            time: stepper.time(),
        })),
    }
}

/// Message of a run that begins with the options `held`, since the `asked` ones end with `error`.
fn fallback_message(asked: &StepOptions, held: &StepOptions, error: &StepError) -> String {
    let name = |options: &StepOptions| format!("`{}`, `{}`", Choice::of(options), options.scheme);
    let (asked, held) = (name(asked), name(held));
    format!("{asked} makes no step ({error}): the run began anew with {held}")
}

impl Options {
    /// Options of the last step that was made.
    fn last(&self) -> &StepOptions {
        self.proven.as_ref().unwrap_or(&self.first)
    }
}

impl Drive {
    /// A run of a scene, after its first step.
    pub fn new(scene: Scene, options: StepOptions) -> Result<Self, StepError> {
        let first = options.clone();
        let (stepper, simulation, sample) = begun(&scene, options, None)?;
        Ok(Self {
            options: Options {
                first,
                proven: None,
                next: None,
            },
            stop: None,
            fallback: None,
            observer: Observer::new(&stepper),
            start: scene,
            stepper,
            simulation,
            generation: 1,
            sample,
            due: 0.0,
            steps: 1,
            paused: false,
            values: Vec::new(),
            last: Vec::new(),
            contacts: Vec::new(),
            tape: None,
            recorded: None,
        })
    }

    pub fn stepper(&self) -> &Stepper {
        &self.stepper
    }

    /// Ends steps early once `stop` is set: [`Stepper::stop_by`].
    pub fn stop_by(&mut self, stop: Arc<AtomicBool>) {
        self.stepper.stop_by(Arc::clone(&stop));
        self.stop = Some(stop);
    }

    /// The recording that has ended.
    pub fn recorded(&self) -> Option<Bytes> {
        self.recorded.clone()
    }

    fn goes_on(&self) -> bool {
        self.simulation.failure.is_none()
    }

    /// Makes the steps of so much time (s) while `may` allows; none where the run stands still. Time that is left is lost.
    pub fn advance(&mut self, span: f64, may: &dyn Fn() -> bool) {
        if self.paused || !self.goes_on() {
            return;
        }
        let dt = self.stepper.options().dt;
        self.due += span;
        // Rounding leaves no step out.
        while self.due > (1.0 - 1e-6) * dt && self.goes_on() {
            if !may() {
                self.due = 0.0;
                return;
            }
            self.due -= dt;
            self.step();
        }
    }

    fn step(&mut self) {
        let Some(sample) = self.simulation.step(&mut self.stepper) else {
            return;
        };
        self.sample = sample;
        self.steps += 1;
        if self.goes_on() && self.options.last() != self.stepper.options() {
            self.options.proven = Some(self.stepper.options().clone());
        }
        if let Some((recorder, bytes)) = &mut self.tape {
            // Memory takes all that is written.
            let _ = recorder.step(bytes, &self.stepper, &sample);
        }
    }

    /// Obeys, or says why not; then nothing has changed.
    pub fn command(&mut self, command: Command) -> Result<(), String> {
        let text = |e: StepError| e.to_string();
        match command {
            Command::Set {
                control,
                drive,
                value,
            } => self.set(&control, drive.as_deref(), value),
            Command::Pause(paused) => {
                self.paused = paused;
                Ok(())
            }
            Command::Step => {
                self.paused = true;
                if self.goes_on() {
                    self.step();
                }
                Ok(())
            }
            Command::Solver(name) => {
                let choice: Choice = name.parse()?;
                choice.check().map_err(|e| e.to_string())?;
                self.with_options(|options| {
                    let old = Choice::of(options).options(options.dt);
                    let new = choice.options(options.dt);
                    options.backend = new.backend;
                    options.form = new.form;
                    // A number that was asked for stays.
                    if options.refinements == old.refinements {
                        options.refinements = new.refinements;
                    }
                })
            }
            Command::Scheme(name) => {
                let scheme = Scheme::from_str(&name).map_err(|e| e.to_string())?;
                self.with_options(|options| {
                    let usual =
                        |scheme: Scheme| GeometricStiffness::inertia(scheme.default_alpha());
                    if options.stiffness == usual(options.scheme) {
                        options.stiffness = usual(scheme);
                    }
                    options.scheme = scheme;
                })
            }
            Command::Mass(mass) => self.set_mass(mass),
            Command::Record(true) => self.record(),
            Command::Record(false) => {
                self.end_recording();
                Ok(())
            }
            Command::Restart => self.restart().map_err(text),
        }
    }

    /// The options that the run has, or will have once it begins anew.
    fn options(&self) -> &StepOptions {
        self.options.next.as_ref().unwrap_or(self.stepper.options())
    }

    fn restart(&mut self) -> Result<(), StepError> {
        let (begun, fallback) = self.begun_anew()?;
        self.end_recording();
        (self.stepper, self.simulation, self.sample) = begun;
        self.options.next = None;
        self.fallback = fallback;
        (self.due, self.steps) = (0.0, 1);
        self.renew();
        Ok(())
    }

    /// The run from its start: with the chosen options or, where these make no step, with others and
    /// the reason.
    fn begun_anew(&self) -> Result<(Begun, Option<String>), StepError> {
        let begin = |options: &StepOptions| begun(&self.start, options.clone(), self.stop.as_ref());
        let error = match begin(self.options()) {
            Ok(begun) => return Ok((begun, None)),
            Err(stopped @ StepError::Stopped { .. }) => return Err(stopped),
            Err(error) => error,
        };
        let Options { first, .. } = &self.options;
        for options in [self.options.last(), first] {
            match begin(options) {
                Ok(begun) => {
                    let fallback = fallback_message(self.options(), options, &error);
                    return Ok((begun, Some(fallback)));
                }
                Err(stopped @ StepError::Stopped { .. }) => return Err(stopped),
                Err(_) => {}
            }
        }
        Err(error)
    }

    /// Goes on with other options; a run that has ended takes them when it begins anew.
    fn with_options(&mut self, change: impl FnOnce(&mut StepOptions)) -> Result<(), String> {
        let mut options = self.options().clone();
        change(&mut options);
        if self.goes_on() {
            self.stepper
                .set_options(options)
                .map_err(|e| e.to_string())?;
        } else {
            Stepper::new(self.start.clone(), options.clone()).map_err(|e| e.to_string())?;
            self.options.next = Some(options);
        }
        self.fallback = None;
        self.renew();
        Ok(())
    }

    fn set(&mut self, control: &str, drive: Option<&str>, value: f64) -> Result<(), String> {
        let scene = self.stepper.scene();
        let number = scene.control(control).map_err(|e| e.to_string())?;
        let set = match drive {
            None => self.stepper.set_control(number, value),
            Some(drive) => {
                let drives = scene.controls[number].drives.iter();
                let mut names = drives.map(|d| scene.constraint_names[d.constraint].as_str());
                let place = names.position(|name| name == drive);
                let place =
                    place.ok_or_else(|| format!("control `{control}` drives no `{drive}`"))?;
                self.stepper.set_drive(number, place, value)
            }
        };
        set.map_err(|e| e.to_string())
    }

    fn set_mass(&mut self, mass: f64) -> Result<(), String> {
        let scene = self.stepper.scene();
        let load = scene.load.map(|i| scene.body_names[i].clone());
        let load = load.ok_or("no body is the load: name one by `load` in the scene")?;
        let load = self.stepper.body(&load).map_err(|e| e.to_string())?;
        let changed = self.stepper.change(|edit| edit.set_mass(load, mass));
        changed.map_err(|e| e.to_string())?;
        // Gaps of a heavier load may be larger.
        let limits = Limits::Scene(self.stepper.scene().gap_limits());
        self.simulation = Simulation::new(usize::MAX, limits);
        if let Some((recorder, _)) = &mut self.tape {
            recorder.renew();
        }
        self.renew();
        Ok(())
    }

    fn record(&mut self) -> Result<(), String> {
        if self.tape.is_some() {
            return Err("a recording goes on: stop it first".to_owned());
        }
        let mut bytes = Vec::new();
        // As if for a minute: longer recordings keep fewer frames a second.
        let steps = (60.0 / self.stepper.options().dt) as usize;
        let recorder = Recorder::begin(&mut bytes, &self.stepper, steps);
        self.tape = Some((recorder.map_err(|e| e.to_string())?, bytes));
        self.recorded = None;
        Ok(())
    }

    fn end_recording(&mut self) {
        let Some((recorder, mut bytes)) = self.tape.take() else {
            return;
        };
        let reason = self.simulation.failure.as_ref().map(|f| f.reason.clone());
        // Memory takes all that is written.
        let _ = recorder.end(&mut bytes, self.stepper.time(), reason);
        self.recorded = Some(bytes.into());
    }

    /// The layout of the scene as it is now.
    fn renew(&mut self) {
        self.observer = Observer::new(&self.stepper);
        self.generation += 1;
        self.last.clear();
    }

    /// The present frame: number of its layout and of its contacts, each of 4 bytes, its time of 8, then the integers of its
    /// channels and contacts ([`Observer::observe`]), little-endian.
    pub fn frame(&mut self) -> Vec<u8> {
        if !self.observer.fits(self.stepper.scene()) {
            self.renew();
        }
        self.values.clear();
        self.contacts.clear();
        self.observer
            .observe(&self.stepper, &self.sample, &self.last, &mut self.values);
        self.last.clone_from(&self.values);
        observe_contacts(&self.stepper, &mut self.contacts);
        let mut bytes = Vec::with_capacity(16 + 4 * (self.values.len() + self.contacts.len()));
        bytes.extend(self.generation.to_le_bytes());
        bytes.extend(((self.contacts.len() / 10) as u32).to_le_bytes());
        bytes.extend(self.stepper.time().to_le_bytes());
        for number in self.values.iter().chain(&self.contacts) {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }

    /// Number of the layout of the last frame.
    pub fn generation(&self) -> u32 {
        self.generation
    }

    /// Data for the page to draw frames of this generation.
    pub fn about(&self) -> About {
        let scene = self.stepper.scene();
        let of = |c: usize| scene.constraint_names[c].clone();
        let controls = scene.controls.iter().map(|control| {
            let drives = control.drives.iter().map(|drive| of(drive.constraint));
            (control.name.clone(), drives.collect())
        });
        let compiled = |choice: &Choice| choice.check().is_ok();
        let solvers = Choice::all().into_iter().filter(compiled);
        About {
            generation: self.generation,
            gravity: scene.gravity.into(),
            controls: controls.collect(),
            solvers: solvers.map(|choice| choice.to_string()).collect(),
            schemes: Scheme::KINDS.map(|scheme| scheme.to_string()).into(),
            layout: self.observer.layout.clone(),
        }
    }

    /// State of the run that the page shows beside frames.
    pub fn status(&self) -> Status {
        let (options, scene) = (self.options(), self.stepper.scene());
        let values = |control: &Control| {
            let drives = control.drives.iter();
            drives.map(|drive| scene.drive_value(drive)).collect()
        };
        let error = self.sample.error.map(|e| Error {
            total: e.total(),
            lost: e.lost,
            unseen: e.unseen as u64,
        });
        let failure = self.simulation.failure.as_ref();
        Status {
            solver: Choice::of(options).to_string(),
            scheme: options.scheme.to_string(),
            paused: self.paused,
            steps: self.steps,
            controls: scene.controls.iter().map(values).collect(),
            load: scene.load.map(|i| scene.bodies.mass[i]),
            error,
            failure: failure.map(ToString::to_string),
            fallback: self.fallback.clone(),
            recording: self.tape.as_ref().map(|(_, bytes)| bytes.len()),
            recorded: self.recorded.as_ref().map(Bytes::len),
        }
    }
}

#[cfg(test)]
mod tests;
