//! Controls that change within a step: a value for each of its sub-steps.
//!
//! A drive that speeds up by a Δt in a step would take all of it in the first of n sub-steps, with the force m (g + n a) there.

use super::Stepper;
use super::access::refused;
use crate::StepError;

/// What controls follow in the next step.
#[derive(Default)]
pub(crate) struct Course {
    controls: Vec<usize>,
    /// Of each of these in turn: one value a sub-step.
    values: Vec<f64>,
}

impl Course {
    /// Value of `control` in sub-step `k`, if it has one there.
    pub(super) fn value(&self, control: usize, k: usize) -> Option<f64> {
        let of = self.controls.iter().position(|c| *c == control)?;
        let count = self.values.len() / self.controls.len();
        self.values[of * count..][..count].get(k).copied()
    }

    pub(super) fn clear(&mut self) {
        self.controls.clear();
        self.values.clear();
    }

    /// `control` follows nothing any more.
    pub(super) fn leave(&mut self, control: usize) {
        if let Some(of) = self.controls.iter().position(|c| *c == control) {
            let count = self.values.len() / self.controls.len();
            self.controls.remove(of);
            self.values.drain(of * count..(of + 1) * count);
        }
    }
}

impl Stepper {
    /// Sets control number `control` to `values` in turn, one a sub-step of the next step; it keeps the last one
    /// \[m/s or rad/s]. A drive that follows a table gets the mean of the table over each sub-step. A changed or restored run knows
    /// the first value only. After its first steps it allocates nothing.
    ///
    /// # Errors
    /// As [`set_control`](Self::set_control), and [`StepError::NotControllable`] where there are not as many values as sub-steps.
    pub fn set_course(&mut self, control: usize, values: &[f64]) -> Result<(), StepError> {
        if values.len() != self.step.options.substeps {
            return Err(refused("a course".into(), "needs one value a sub-step"));
        }
        for value in values {
            self.channel(control, *value)?;
        }
        self.set_control(control, values[0])?;
        if values.len() > 1 {
            self.wake();
            self.course.controls.push(control);
            self.course.values.extend(values);
        }
        Ok(())
    }

    /// Sets the controls for sub-step `k` of a step.
    pub(super) fn follow_course(&mut self, k: usize) -> Result<(), StepError> {
        for i in 0..self.course.controls.len() {
            let control = self.course.controls[i];
            if let Some(value) = self.course.value(control, k) {
                self.drive(control, value)?;
            }
        }
        if self.step.uses.winches && !self.course.controls.is_empty() {
            self.step.check_winches()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{With, centre, dense, on_earth, reeled, winch};
    use nalgebra::Vector3;
    use taut_model::{Body, Control, Frame, RowLaw};

    /// A load on the rope of a winch with a control.
    fn hoist(dt: f64, substeps: usize, estimate: Option<usize>) -> Stepper {
        let mut scene = on_earth("hoist");
        let body = scene.add_body("load", Body::sphere(1000.0, 0.5));
        scene.bodies.position[body].z = -10.0;
        scene.load = Some(body);
        let frames = vec![Frame::world(Vector3::zeros()), centre(body)];
        let law = RowLaw::new(1e-7, 0.0);
        let rope = reeled(winch(0.0), frames, 10.0, law);
        let rope = scene.add_constraint("rope", rope, 0);
        scene.controls.push(Control::of("hoist", rope, -1.0));
        let options = dense().with(|o| (o.dt, o.substeps, o.estimate) = (dt, substeps, estimate));
        Stepper::new(scene, options).expect("a run")
    }

    /// Half of a step's ramp fell in its first sub-step.
    #[test]
    fn a_course_over_sub_steps_is_one_of_small_steps() {
        let (dt, n) = (1.0 / 60.0, 16);
        let mean = |k: usize| (k as f64 + 0.5) * dt / n as f64;
        let mut coarse = hoist(dt, n, None);
        let mut fine = hoist(dt / n as f64, 1, None);
        let mut largest = 0.0_f64;
        for step in 0..60 {
            let values: Vec<f64> = (0..n).map(|k| mean(step * n + k)).collect();
            coarse.set_course(0, &values).expect("a course");
            coarse.step().expect("a step");
            for value in values {
                fine.set_control(0, value).expect("a control");
                fine.step().expect("a step");
                largest = largest.max(fine.tension(0).expect("a rope"));
            }
            let height = |run: &Stepper| run.scene().bodies.position[0].z;
            let apart = height(&coarse) - height(&fine);
            assert!(apart.abs() < 1e-12, "step {step}: {apart} m");
        }
        // m (g + a), and the swing of its start.
        assert!(largest < 1000.0 * 11.9, "{largest} N");
        assert!(coarse.tension(0).expect("a rope") < largest);
    }

    #[test]
    fn the_estimate_follows_a_course() {
        for n in [1, 2, 4] {
            let dt = 1.0 / 60.0;
            let mut run = hoist(dt, n, Some(2));
            let mut error = 0.0;
            for step in 0..120 {
                let at = |k: usize| (step as f64 + (k as f64 + 0.5) / n as f64) * dt;
                let values: Vec<f64> = (0..n).map(|k| (3.0 * at(k)).sin()).collect();
                run.set_course(0, &values).expect("a course");
                let estimate = run.step().expect("a step").error.expect("an estimate");
                assert!(!estimate.lost && estimate.unseen == 0, "{estimate:?}");
                error = estimate.time;
            }
            assert!(error < 1e-3, "{n} sub-steps: {error} m");
        }
    }

    #[test]
    fn a_control_that_is_set_leaves_its_course() {
        let mut run = hoist(1.0 / 60.0, 2, None);
        run.set_course(0, &[0.1, 0.2]).expect("a course");
        run.set_control(0, 0.3).expect("a control");
        run.step().expect("a step");
        assert_eq!(run.scene().control_value(0), Some(0.3));
        run.set_course(0, &[0.1, 0.2]).expect("a course");
        run.step().expect("a step");
        assert_eq!(run.scene().control_value(0), Some(0.2));
        for course in [&[0.1][..], &[0.1, f64::NAN], &[]] {
            assert!(run.set_course(0, course).is_err(), "{course:?}");
        }
    }
}
