//! Access to a running simulation between two steps: states, loads, driven bodies, motors, winches
//! and controls.

use crate::run::Stepper;
use crate::step::Stage;
use crate::{ContactImpulses, StepError};
use nalgebra::Vector3;
use taut_model::{
    Bodies, Constraint, Control, Controls, Drive, Mobility, Motor, Scene, Target, Winch,
};
use taut_solver::SolveError;

impl Stepper {
    /// Replaces the impulses that the next solve starts from, one a row \[N s, N m s]: those of another solve of the same
    /// scene. The geometric stiffness does not change: see [`set_tension`](Self::set_tension).
    ///
    /// # Errors
    /// [`SolveError::Dimension`] in [`StepError::Solve`].
    pub fn set_multipliers(&mut self, mu: &[f64]) -> Result<(), StepError> {
        self.check_rows(mu)?;
        self.step.multipliers.mu.copy_from_slice(mu);
        self.step.multipliers.mu_dt = self.step.substep();
        self.step.output.reported.forget();
        self.step.progress.stage.unsolve();
        self.wake();
        Ok(())
    }

    /// Replaces the multipliers λ = μ/Δt that the next solve's geometric stiffness is made of, one a row \[N, N m]: so
    /// that solvers can be compared on the same system.
    ///
    /// # Errors
    /// [`SolveError::Dimension`] in [`StepError::Solve`].
    pub fn set_tension(&mut self, lambda: &[f64]) -> Result<(), StepError> {
        self.check_rows(lambda)?;
        self.step.multipliers.tension.copy_from_slice(lambda);
        self.step.multipliers.tension_known = true;
        self.step.progress.stage.unsolve();
        self.wake();
        Ok(())
    }

    /// Replaces what the next step starts from at contacts, so that solvers can be compared on the same system.
    pub fn set_contact_impulses(&mut self, impulses: &ContactImpulses) {
        let known = impulses.known.clone();
        self.step.contacts.put(known, impulses.dt);
        self.step.progress.stage.unsolve();
        self.wake();
    }

    fn check_rows(&self, rows: &[f64]) -> Result<(), StepError> {
        if rows.len() == self.step.multipliers.mu.len() {
            return Ok(());
        }
        let source = SolveError::Dimension {
            what: "multipliers",
            expected: self.step.multipliers.mu.len(),
            found: rows.len(),
        };
        Err(StepError::Solve {
            source,
            culprit: None,
            time: self.step.time,
        })
    }

    /// Puts the bodies into another state of the same scene, at a time \[s]; multipliers stay (they are zero after a step
    /// that failed), the past is taken to be like that state, velocities are taken as they are, and each twist row unwraps
    /// to the angle within half a turn of its last one, to 0.01 rad; cables over sheaves lie as they do, unless they are
    /// [laid](Self::lay_cables) as in that state before. Allocates nothing. Where it fails nothing has changed.
    ///
    /// # Errors
    /// [`SolveError::Dimension`] in [`StepError::Solve`] where the number of bodies differs, [`StepError::Scene`] with the
    /// name of a body whose state is not finite, whose orientation has not the norm 1, or that is static and moves, and
    /// [`StepError::NotControllable`] where the time is not finite.
    pub fn set_state(&mut self, bodies: &Bodies, time: f64) -> Result<(), StepError> {
        let expected = self.step.scene.bodies.len();
        for found in [
            bodies.position.len(),
            bodies.orientation.len(),
            bodies.velocity.len(),
            bodies.angular_velocity.len(),
            bodies.mobility.len(),
        ] {
            if expected != found {
                let source = SolveError::Dimension {
                    what: "bodies",
                    expected,
                    found,
                };
                return Err(StepError::Solve {
                    source,
                    culprit: None,
                    time: self.step.time,
                });
            }
        }
        for (i, name) in self.step.scene.body_names.iter().enumerate() {
            bodies.validate_state(i, name)?;
        }
        if !time.is_finite() {
            return Err(refused(
                "the time of a state".to_owned(),
                "is not finite: give the seconds since the run began",
            ));
        }
        let own = &mut self.step.scene.bodies;
        own.position.copy_from_slice(&bodies.position);
        own.orientation.copy_from_slice(&bodies.orientation);
        own.velocity.copy_from_slice(&bodies.velocity);
        own.angular_velocity
            .copy_from_slice(&bodies.angular_velocity);
        self.step.time = time;
        self.outdate_coarse_run();
        self.step.output.account.close();
        self.step.progress.stage = Stage::Unsolved;
        self.step.progress.started = true;
        self.step.progress.newly_added.clear();
        self.step.guarded.hold_off = 0;
        self.step.activation.forget();
        let rows = &mut self.step.system_data.rows;
        rows.drive(
            &self.step.scene,
            time - self.step.options.dt / self.step.options.substeps as f64,
            time,
        );
        self.step.history.forget(&rows.phi_t);
        rows.update(&self.step.scene, time);
        if rows.follow_windings(&mut self.step.scene, time) {
            rows.update(&self.step.scene, time);
        }
        self.wake();
        Ok(())
    }

    /// Lays the massless cables over sheaves as in another state of the same scene, before
    /// [`set_state`](Self::set_state): with the lengths of their parts, their winches, and where they touch their sheaves.
    ///
    /// # Errors
    /// [`StepError::NotControllable`] with a cable that runs through other points there; nothing has changed then.
    pub fn lay_cables(&mut self, scene: &Scene) -> Result<(), StepError> {
        let pairs = || self.step.scene.constraints.iter().zip(&scene.constraints);
        let differs = |(own, other): &(&Constraint, &Constraint)| match (own, other) {
            (Constraint::MasslessCable(own), Constraint::MasslessCable(other)) => {
                own.frames != other.frames
            }
            (own, other) => own.rows() != other.rows(),
        };
        if self.step.scene.constraints.len() != scene.constraints.len()
            || pairs().any(|p| differs(&p))
        {
            return Err(refused(
                format!("the cables of scene `{}`", scene.name),
                "are not those of this one: lay them as in a state of the same scene",
            ));
        }
        for (own, other) in self
            .step
            .scene
            .constraints
            .iter_mut()
            .zip(&scene.constraints)
        {
            if let (Constraint::MasslessCable(own), Constraint::MasslessCable(other)) = (own, other)
                && !other.sheaves.is_empty()
            {
                own.clone_from(other);
            }
        }
        self.step.progress.stage.unsolve();
        self.wake();
        Ok(())
    }

    /// Replaces the external force \[N] and torque \[N m] on a body from the next step on, world frame: loads that
    /// change with time.
    ///
    /// # Errors
    /// [`SolveError::Dimension`] in [`StepError::Solve`] where there is no body `body`, [`StepError::NotControllable`] with
    /// its name where a component is not finite, or a torque acts on a point mass.
    pub fn set_load(
        &mut self,
        body: usize,
        force: Vector3<f64>,
        torque: Vector3<f64>,
    ) -> Result<(), StepError> {
        let bodies = &mut self.step.scene.bodies;
        if body >= bodies.len() {
            let source = SolveError::Dimension {
                what: "bodies",
                expected: bodies.len(),
                found: body,
            };
            return Err(StepError::Solve {
                source,
                culprit: None,
                time: self.step.time,
            });
        }
        if !force.iter().chain(&torque).all(|x| x.is_finite()) {
            return Err(refused(
                format!("body `{}`", self.step.scene.body_names[body]),
                "got a force or a torque that is not finite",
            ));
        }
        if bodies.is_point(body) && torque != Vector3::zeros() {
            return Err(refused(
                format!("body `{}`", self.step.scene.body_names[body]),
                "is a point mass, which no torque turns: give it a shape or an inertia",
            ));
        }
        let changes = (bodies.force[body], bodies.torque[body]) != (force, torque);
        bodies.force[body] = force;
        bodies.torque[body] = torque;
        self.step.progress.stage.unsolve();
        if changes {
            self.outdate_coarse_run();
            self.wake();
        }
        Ok(())
    }

    /// Velocity \[m/s] and angular velocity \[rad/s] of a driven body from the next step on, world frame.
    ///
    /// # Errors
    /// [`StepError::NotControllable`] where body `body` is not there or not driven, or a velocity is not finite.
    pub fn set_velocity(
        &mut self,
        body: usize,
        velocity: Vector3<f64>,
        angular_velocity: Vector3<f64>,
    ) -> Result<(), StepError> {
        let bodies = &mut self.step.scene.bodies;
        if body >= bodies.len() {
            return Err(missing("body", body, bodies.len()));
        }
        let what = || format!("body `{}`", self.step.scene.body_names[body]);
        if bodies.mobility[body] != Mobility::Driven {
            let reason = "is not driven: make its mobility `driven`";
            return Err(refused(what(), reason));
        }
        if !velocity
            .iter()
            .chain(&angular_velocity)
            .all(|x| x.is_finite())
        {
            return Err(refused(what(), "got a velocity that is not finite"));
        }
        let (v, w) = (
            velocity - bodies.velocity[body],
            angular_velocity - bodies.angular_velocity[body],
        );
        bodies.velocity[body] = velocity;
        bodies.angular_velocity[body] = angular_velocity;
        // The rows' past rate J v + ∂φ/∂t belongs to the old velocity: ∂φ/∂t takes up the change of
        // J v.
        let rows = &self.step.system_data.rows;
        let slots = rows.slots.iter().enumerate();
        for (s, slot) in slots.filter(|(_, slot)| slot.body == body) {
            let range = rows.row_range(slot.constraint);
            for (phi_t, j) in self.step.history.phi_t[range]
                .iter_mut()
                .zip(rows.block(s).rows())
            {
                let change = [v.x, v.y, v.z, w.x, w.y, w.z];
                *phi_t -= taut_model::linearized::dot(j, &change);
            }
        }
        self.outdate_coarse_run();
        self.step.progress.stage.unsolve();
        Ok(())
    }

    /// Replaces the motor of constraint `constraint` from the next step on.
    ///
    /// # Errors
    /// [`StepError::NotControllable`] where that has no motor or a number is out of its range; a motor has to hold what
    /// it held before, a position or a speed, for the rows of a scene to stay the same. Those of a solve as
    /// [`set_control`](Self::set_control).
    pub fn set_motor(&mut self, constraint: usize, motor: Motor) -> Result<(), StepError> {
        let constraints = &mut self.step.scene.constraints;
        if constraint >= constraints.len() {
            return Err(missing("constraint", constraint, constraints.len()));
        }
        let what = || {
            format!(
                "constraint `{}`",
                self.step.scene.constraint_names[constraint]
            )
        };
        let Some(own) = constraints[constraint].motor_mut() else {
            return Err(refused(what(), "has no motor"));
        };
        if std::mem::discriminant(&own.target) != std::mem::discriminant(&motor.target) {
            return Err(refused(
                what(),
                "holds a position or a speed, and goes on with that",
            ));
        }
        motor.validate(what)?;
        let jump = match (own.target, motor.target) {
            (Target::Speed(before), Target::Speed(after)) => after - before,
            _ => 0.0,
        };
        self.step.catch_up_at_jump(constraint, jump)?;
        let Some(own) = self.step.scene.constraints[constraint].motor_mut() else {
            return Ok(());
        };
        if own.target != motor.target && !matches!(motor.target, Target::Speed(_)) {
            // Another position is energy of its own.
            self.step.output.account.close();
        }
        let changes = *own != motor;
        *own = motor;
        self.changed(changes);
        Ok(())
    }

    /// Replaces the winch of constraint `constraint` from the present time on, which takes the place of
    /// [`Winch::since`].
    ///
    /// # Errors
    /// [`StepError::NotControllable`] where that has no winch or a number is out of its range; those of a solve as
    /// [`set_control`](Self::set_control).
    pub fn set_winch(&mut self, constraint: usize, winch: Winch) -> Result<(), StepError> {
        let scene = &self.step.scene;
        if constraint >= scene.constraints.len() {
            return Err(missing("constraint", constraint, scene.constraints.len()));
        }
        let what = || format!("constraint `{}`", scene.constraint_names[constraint]);
        let Some(own) = scene.constraints[constraint].winch() else {
            return Err(refused(what(), "has no winch"));
        };
        winch.validate(false, what)?;
        // A braked drum stands still.
        let [before, after] = [own, &winch].map(|w| if w.brake { 0.0 } else { w.speed });
        self.step.catch_up_at_jump(constraint, after - before)?;
        let (scene, time) = (&mut self.step.scene, self.step.time);
        scene.cut_at_winch(constraint, time, 0.0);
        let Some((own, length)) = scene.constraints[constraint].winch_mut(time) else {
            return Ok(());
        };
        let speed = winch.speed;
        let mut winch = Winch {
            since: own.since,
            stalled: own.stalled,
            speed: before,
            ..winch
        };
        winch.set_speed(speed, length);
        let changes = *own != winch;
        *own = winch;
        self.changed(changes);
        Ok(())
    }

    /// Sets control number `control` of the scene to `value`, a speed \[m/s or rad/s], from the next step on: see
    /// [`Scene::controls`](taut_model::Scene::controls), and [`control_index`](Self::control_index) for one that stays the
    /// same while the scene changes. Allocates nothing.
    ///
    /// # Errors
    /// [`StepError::NotControllable`] where there is no such control or the value is not finite; those of a solve where it jumps
    /// while bodies touch or hang on massless ropes.
    pub fn set_control(&mut self, control: usize, value: f64) -> Result<(), StepError> {
        self.channel(control, value)?;
        self.course.leave(control);
        self.drive(control, value)
    }

    /// [`set_control`](Self::set_control) of a control that is there.
    pub(super) fn drive(&mut self, control: usize, value: f64) -> Result<(), StepError> {
        for k in 0..self.step.scene.controls[control].drives.len() {
            self.before_jump(self.step.scene.controls[control].drives[k], value)?;
        }
        self.step.scene.set_control(control, value, self.step.time);
        // Lengths go on from where they are and laws with them: what the rows are at this time does not change.
        self.step.system_data.rescale(&self.step.scene);
        self.step.progress.stage.unsolve();
        Ok(())
    }

    /// Before a drive of a control gets this value; a braked drum stands still with any.
    fn before_jump(&mut self, drive: Drive, value: f64) -> Result<(), StepError> {
        let scene = &self.step.scene;
        let winch = scene.constraints[drive.constraint].winch();
        let is_braked = winch.is_some_and(|winch| winch.brake);
        match scene.drive_value(&drive) {
            Some(before) if !is_braked => {
                let faster = (value - before) * drive.gain;
                self.step.catch_up_at_jump(drive.constraint, faster)
            }
            _ => Ok(()),
        }
    }

    /// A control that takes this value.
    pub(super) fn channel(&self, control: usize, value: f64) -> Result<&Control, StepError> {
        let Some(channel) = self.step.scene.controls.get(control) else {
            return Err(missing("control", control, self.step.scene.controls.len()));
        };
        if !value.is_finite() {
            let what = format!("control `{}`", channel.name);
            return Err(refused(what, "got a value that is not finite"));
        }
        Ok(channel)
    }

    /// Sets motor or winch number `drive` of control number `control` alone, as the control would
    /// with this value, until the control is set again.
    ///
    /// # Errors
    /// As [`set_control`](Self::set_control), and [`StepError::NotControllable`] where the control
    /// has no such drive.
    pub fn set_drive(&mut self, control: usize, drive: usize, value: f64) -> Result<(), StepError> {
        let drives = &self.channel(control, value)?.drives;
        let Some(&driven) = drives.get(drive) else {
            return Err(missing("drive", drive, drives.len()));
        };
        self.course.leave(control);
        self.before_jump(driven, value)?;
        self.step.scene.set_drive(driven, value, self.step.time);
        self.changed(true);
        Ok(())
    }

    /// Sets the gantry's controls from the next step on. Allocates nothing.
    ///
    /// # Errors
    /// [`SceneError::UnknownControl`](taut_model::SceneError::UnknownControl) in [`StepError::Scene`] where the scene has no
    /// control of one of their names, else as [`set_control`](Self::set_control).
    pub fn set_controls(&mut self, controls: &Controls) -> Result<(), StepError> {
        for (name, value) in controls.values() {
            self.set_control(self.step.scene.control(name)?, value)?;
        }
        Ok(())
    }

    /// Laws and bounds are those of the present state again; its solve no longer is. What `changes` them wakes the scene.
    fn changed(&mut self, changes: bool) {
        self.step.progress.stage.unsolve();
        if changes {
            self.outdate_coarse_run();
            self.wake();
        }
        self.step
            .system_data
            .rows
            .update(&self.step.scene, self.step.time);
        self.step.system_data.rescale(&self.step.scene);
    }
}

/// The error of a number `i` where there are `count`.
fn missing(kind: &str, i: usize, count: usize) -> StepError {
    refused(format!("{kind} number {i}, of {count},"), "is not there")
}

pub(super) fn refused(what: String, reason: &'static str) -> StepError {
    StepError::NotControllable { what, reason }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    fn options() -> StepOptions {
        let backend = taut_solver::Backend::Dense(taut_solver::DenseOptions::default());
        StepOptions::paper().with(|o| (o.form, o.backend) = (Form::Schur, backend))
    }

    #[test]
    fn the_gantry_is_driven_by_its_controls() {
        let gantry = taut_model::GantryParams::default();
        let default = StepOptions::default().with(|o| o.backend = options().backend);
        let mut stepper = Stepper::new(gantry.build().unwrap(), default).unwrap();
        let start = stepper.scene().bodies.position.clone();
        let controls = Controls {
            trolley_speed: 0.5,
            hoist_speed: 0.1,
        };
        stepper.set_controls(&controls).unwrap();
        stepper.steps(120);
        let moved = |i: usize| stepper.scene().bodies.position[i] - start[i];
        let time = stepper.time();
        assert_eq!(moved(0), Vector3::zeros());
        assert!((moved(1).x - 0.5 * time).abs() < 1e-9, "{}", moved(1));
        // The hook follows in swings and bounces.
        assert!((moved(2).z - 0.1 * time).abs() < 0.05, "{}", moved(2));
        let mut other = Stepper::new(Scene::new("no bodies"), options());
        assert!(other.is_err());
        let mut free = Scene::new("free");
        free.add_body("ball", taut_model::Body::sphere(1.0, 1.0));
        other = Stepper::new(free, options());
        let refused = other.unwrap().set_controls(&controls).unwrap_err();
        assert!(refused.to_string().contains("`trolley_speed`"), "{refused}");
    }

    #[test]
    fn a_load_acts_from_the_next_step_on() {
        let mut scene = Scene::new("free");
        let body = taut_model::Body::sphere(1.0, 2.0);
        scene.add_body("ball", body);
        let mut stepper = Stepper::new(scene, options()).unwrap();
        stepper.step().unwrap();
        stepper
            .set_load(0, Vector3::x() * 4.0, Vector3::zeros())
            .unwrap();
        stepper.step().unwrap();
        let dt = stepper.options().dt;
        assert!((stepper.scene().bodies.velocity[0].x - 2.0 * dt).abs() < 1e-15);
        let error = stepper.set_load(1, Vector3::zeros(), Vector3::zeros());
        assert!(matches!(error, Err(StepError::Solve { .. })));
        for bad in [f64::NAN, f64::INFINITY] {
            let error = stepper.set_load(0, Vector3::x() * bad, Vector3::zeros());
            let message = error.unwrap_err().to_string();
            assert!(message.starts_with("body `ball` got"), "{message}");
        }
        // Refused loads act on nothing.
        stepper.step().unwrap();
    }

    #[test]
    fn a_state_that_is_none_is_refused_whole() {
        let scene = taut_model::HoistParams::default().build().unwrap();
        let mut stepper = Stepper::new(
            scene,
            StepOptions::default().with(|o| o.backend = options().backend),
        )
        .unwrap();
        stepper.step().unwrap();
        let (before, time) = (stepper.scene().clone(), stepper.time());
        let mut short = before.bodies.clone();
        short.velocity.pop();
        let mut unlike = before.bodies.clone();
        unlike.position[0].x = 7.0;
        unlike.position[2].x = f64::NAN;
        for (bodies, at, named) in [
            (&short, 0.0, "bodies"),
            (&unlike, 0.0, "segment-3"),
            (&before.bodies, f64::NAN, "time"),
        ] {
            let message = stepper.set_state(bodies, at).unwrap_err().to_string();
            assert!(message.contains(named), "{message}");
            assert_eq!((stepper.scene(), stepper.time()), (&before, time));
        }
    }

    /// The rate that a changed velocity takes from the past is that of one step, in joints between bodies too.
    #[test]
    fn a_step_forgets_what_a_changed_velocity_took_from_the_past() {
        let mut scene = Scene::new("towed");
        let hook = scene.add_body("hook", Body::sphere(0.1, 1.0));
        scene.bodies.mobility[hook] = Mobility::Driven;
        let rope = scene.add_body("rope", Body::rod(1.0, 0.02, 1.0));
        scene.bodies.position[rope] = -0.5 * Vector3::z();
        let stretch = RowLaw {
            compliance: 1e-6,
            damping: 0.0,
        };
        let ends = [(hook, 0.0), (rope, 0.5)];
        let frames = ends.map(|(body, z)| Frame::body(body, Vector3::z() * z));
        let joint = Constraint::Spherical(Spherical { frames, stretch });
        scene.add_constraint("joint", joint, 0);
        let mut stepper = Stepper::new(scene, StepOptions::default()).unwrap();
        stepper.step().unwrap();
        stepper
            .set_velocity(hook, Vector3::x(), Vector3::zeros())
            .unwrap();
        assert_eq!(stepper.step.history.phi_t[0].abs(), 1.0);
        stepper.step().unwrap();
        assert_eq!(*stepper.step.history.phi_t, [0.0; 3]);
    }
}
