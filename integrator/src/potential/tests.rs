use super::*;
use crate::guarded::Pass;
use crate::report::{PhaseClock, Work};
use crate::{Scheme, StepOptions};
use taut_model::HoistParams;

/// The derivative of Ψ is −λ', with compliance and without, inside the limits and at them; with e = ε it is g²/(2ε).
#[test]
fn the_force_is_the_derivative_of_the_energy() {
    let none = (f64::NEG_INFINITY, f64::INFINITY);
    let (lambda, h) = (-3.0, 1e-6);
    for (own, soft) in [(0.5, 0.5), (0.0, 0.5), (0.2, 0.5)] {
        for limits in [none, (f64::NEG_INFINITY, 0.0), (-2.0, 2.0)] {
            for g in [-4.0, -0.3, 0.01, 0.7, 5.0] {
                let at = |g: f64| energy(g, lambda, own, soft, limits);
                let slope = (at(g + h).0 - at(g - h).0) / (2.0 * h);
                assert!(
                    (slope + at(g).1).abs() < 1e-8,
                    "{own} {soft} {limits:?} {g}"
                );
                assert!(limits.0 <= at(g).1 && at(g).1 <= limits.1);
                if own == soft && limits == none {
                    assert!((at(g).0 - g * g / (2.0 * own)).abs() < 1e-14 * g * g / own);
                }
            }
        }
    }
}

/// A swinging cable of four segments after its first pass, its search about to begin.
fn after_a_pass(damping: f64, ea: Option<f64>) -> (Stepper, f64) {
    let params = HoistParams {
        segments: 4,
        initial_angle: 1.0,
        seed: 1,
        seed_rate: 2.0,
        damping,
        ea,
        ..HoistParams::default()
    };
    let options = StepOptions {
        scheme: Scheme::LinearlyImplicit,
        ..StepOptions::default()
    };
    let dt = options.dt;
    let mut stepper = Stepper::new(params.build().unwrap(), options).unwrap();
    for _ in 0..20 {
        stepper.step().unwrap();
    }
    let bodies = &stepper.scene.bodies;
    let (mu, tension) = (&stepper.mu, &stepper.tension);
    (stepper.substep_start).save(bodies, stepper.time, (mu, stepper.mu_dt), tension);
    stepper.pieces.load_velocities(bodies);
    stepper.pieces.dv.clear();
    let end = stepper.time + dt;
    stepper.pieces.rows.drive(&stepper.scene, stepper.time, end);
    stepper.begin_search(true, dt);
    let (mut clock, mut work) = (PhaseClock::start(), Work::default());
    let pass = stepper.newton_pass(Pass::First, dt, end, &mut clock, &mut work);
    assert!(pass.unwrap().is_finite());
    stepper.search.soften(&stepper.pieces, dt);
    (stepper, dt)
}

/// Φ after a `part` of the step.
fn potential_at(stepper: &mut Stepper, part: f64, step: &Six, dt: f64) -> f64 {
    let (from, rows) = (stepper.search.from.clone(), stepper.mu.len());
    stepper.pieces.dv.combine((1.0, &from), (part, step));
    stepper.substep_start.restore(&mut stepper.scene.bodies);
    stepper.move_bodies(dt).unwrap();
    let end = stepper.time + dt;
    stepper.pieces.rows.update_state(&stepper.scene, end);
    let mut gaps = vec![0.0; rows];
    stepper.gaps(&mut gaps, dt);
    stepper.potential(&stepper.pieces.dv, &gaps, dt).0
}

/// The slope of Φ is that of its differences; it is negative, and as large as a system that is solved exactly has it:
/// twice what Φ loses where it is a parabola.
#[test]
fn the_slope_is_that_of_the_potential() {
    for (damping, ea) in [(0.0, None), (0.05, None), (0.0, Some(1e4))] {
        let (mut stepper, dt) = after_a_pass(damping, ea);
        stepper.search.to.copy_from(&stepper.pieces.dv);
        let slope = stepper.slope(dt);
        let mut step = stepper.search.to.clone();
        step.combine((1.0, &stepper.search.to), (-1.0, &stepper.search.from));
        let h = 1e-5;
        let [more, less] = [h, -h].map(|part| potential_at(&mut stepper, part, &step, dt));
        let difference = (more - less) / (2.0 * h);
        assert!(slope < 0.0);
        assert!(
            (difference / slope - 1.0).abs() < 1e-5,
            "{difference} {slope}"
        );
    }
}

/// A step that leads too far is shortened until it is of use, and one that is right is taken.
#[test]
fn a_step_too_far_is_shortened() {
    for (times, taken) in [(1.0, true), (30.0, false)] {
        let (mut stepper, dt) = after_a_pass(0.0, None);
        let from = stepper.search.from.clone();
        let to = stepper.pieces.dv.clone();
        let mut step = to.clone();
        step.combine((1.0, &to), (-1.0, &from));
        let begin = potential_at(&mut stepper, 0.0, &step, dt);
        potential_at(&mut stepper, times, &step, dt);
        let end = stepper.time + dt;
        let found = stepper.search(true, true, dt, end).unwrap();
        assert_eq!(found.whole, taken, "{found:?}");
        let dv = stepper.pieces.dv.clone();
        let mut gaps = vec![0.0; stepper.mu.len()];
        stepper.gaps(&mut gaps, dt);
        assert!(stepper.potential(&dv, &gaps, dt).0 < begin);
    }
}
