use super::*;
use crate::step::guarded::Pass;
use crate::testing::*;

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
                let off = (slope + at(g).1).abs();
                assert!(off < 1e-8, "{own} {soft} {limits:?} {g}");
                assert!(limits.0 <= at(g).1 && at(g).1 <= limits.1);
                if own == soft && limits == none {
                    assert!((at(g).0 - g * g / (2.0 * own)).abs() < 1e-14 * g * g / own);
                }
            }
        }
    }
}

/// A swinging cable of four segments after its first pass, its search about to begin.
fn after_a_pass(damping: f64, ea: Option<f64>) -> (Step, f64) {
    let params = HoistParams::default()
        .with(|p| (p.segments, p.initial_angle, p.seed) = (4, 1.0, 1))
        .with(|p| (p.seed_rate, p.damping, p.ea) = (2.0, damping, ea));
    let options = StepOptions::default().with(|o| o.scheme = Scheme::LinearlyImplicit);
    let dt = options.dt;
    let mut stepper = Stepper::new(params.build().unwrap(), options).unwrap();
    stepper.steps(20);
    let mut inner = stepper.step;
    inner.keep_substep_start();
    let bodies = &inner.scene.bodies;
    inner.system_data.load_velocities(bodies);
    inner.system_data.dv.clear();
    let end = inner.time + dt;
    inner.system_data.rows.drive(&inner.scene, inner.time, end);
    inner.begin_search(true, dt);
    let pass = inner.newton_pass(Pass::First, dt, end);
    assert!(pass.unwrap().is_finite());
    inner.guarded.search.soften(&inner.system_data, dt);
    (inner, dt)
}

/// Φ after a `part` of the step.
fn potential_at(inner: &mut Step, part: f64, step: &BodyVectors, dt: f64) -> f64 {
    let from = inner.guarded.search.from.clone();
    let rows = inner.multipliers.mu.len();
    inner.system_data.dv.combine((1.0, &from), (part, step));
    inner.guarded.substep_start.restore(&mut inner.scene.bodies);
    inner.move_bodies(dt).unwrap();
    let end = inner.time + dt;
    inner.system_data.rows.update_state(&inner.scene, end);
    let mut gaps = vec![0.0; rows];
    inner.gaps(&mut gaps, dt);
    inner.potential(&inner.system_data.dv, &gaps, dt).0
}

/// The slope of Φ is that of its differences; it is negative, and as large as a system that is solved exactly has it:
/// twice what Φ loses where it is a parabola.
#[test]
fn the_slope_is_that_of_the_potential() {
    for (damping, ea) in [(0.0, None), (0.05, None), (5.0, None), (0.0, Some(1e4))] {
        let (mut inner, dt) = after_a_pass(damping, ea);
        inner.guarded.search.to.copy_from(&inner.system_data.dv);
        let slope = inner.slope(dt);
        let mut step = inner.guarded.search.to.clone();
        step.combine(
            (1.0, &inner.guarded.search.to),
            (-1.0, &inner.guarded.search.from),
        );
        let h = 1e-5;
        let [more, less] = [h, -h].map(|part| potential_at(&mut inner, part, &step, dt));
        let difference = (more - less) / (2.0 * h);
        assert!(slope < 0.0);
        let off = (difference / slope - 1.0).abs();
        assert!(off < 1e-5, "{difference} {slope}");
    }
}

/// A step that leads too far is shortened until it is of use, and one that is right is taken.
#[test]
fn a_step_too_far_is_shortened() {
    for (times, taken) in [(1.0, true), (30.0, false)] {
        let (mut inner, dt) = after_a_pass(0.0, None);
        let from = inner.guarded.search.from.clone();
        let to = inner.system_data.dv.clone();
        let mut step = to.clone();
        step.combine((1.0, &to), (-1.0, &from));
        let begin = potential_at(&mut inner, 0.0, &step, dt);
        potential_at(&mut inner, times, &step, dt);
        let end = inner.time + dt;
        inner.search(true, true, dt, end).unwrap();
        let [there, far] = [&inner.system_data.dv, &inner.guarded.search.to].map(|dv| dv.get(1));
        assert_eq!(there == far, taken, "{there:?} {far:?}");
        let dv = inner.system_data.dv.clone();
        let mut gaps = vec![0.0; inner.multipliers.mu.len()];
        inner.gaps(&mut gaps, dt);
        assert!(inner.potential(&dv, &gaps, dt).0 < begin);
    }
}

/// The energy gained is that of velocities and gravity where all rows keep their gaps; velocities lose it.
#[test]
fn a_gain_is_lost() {
    let (mut inner, dt) = after_a_pass(0.0, None);
    let before = inner.gained(dt);
    let kinetic = inner.scene.kinetic_energy();
    assert!(before.abs() < 1e-2 * kinetic, "{before} of {kinetic}");
    for velocity in &mut inner.scene.bodies.velocity {
        *velocity *= 2.0;
    }
    let (gain, all) = (inner.gained(dt), inner.scene.kinetic_energy());
    assert!(gain > kinetic, "{gain} of {kinetic}");
    inner.lose_gain(dt);
    let left = inner.scene.kinetic_energy();
    assert!((left - (all - gain)).abs() < 1e-12 * all, "{left}");
}

/// A change of the angular velocity turns a body further by as much, to the square of the change: a rod that swings, and
/// one that spins fast besides.
#[test]
fn changes_turn_further() {
    let (mut inner, dt) = after_a_pass(0.0, None);
    let start = inner.guarded.substep_start.clone();
    let long = start.orientation(1) * Vector3::z();
    let across = |x: f64, y: f64, z: f64| {
        let v = Vector3::new(x, y, z);
        v - long * long.dot(&v)
    };
    let v = inner.system_data.v.get(1);
    let mut axis_after = |omega: Vector3<f64>| {
        start.restore(&mut inner.scene.bodies);
        inner.system_data.dv.clear();
        let [a, b, c] = [omega.x - v[3], omega.y - v[4], omega.z - v[5]];
        inner.system_data.dv.set(1, [0.0, 0.0, 0.0, a, b, c]);
        inner.move_bodies(dt).unwrap();
        inner.scene.bodies.orientation[1] * Vector3::z()
    };
    for spin in [0.0, 300.0] {
        let last = across(50.0, -60.0, 80.0) + long * spin;
        for h in [1e-1, 1e-2, 1e-3] {
            let change = across(30.0, 40.0, 5.0) * h;
            let further = crate::step::guarded::swing_further(&long, &(last * dt), &change);
            let turned = nalgebra::UnitQuaternion::from_scaled_axis(change * dt);
            let expected = turned * axis_after(last);
            let [off, plain] = [further, change].map(|c| axis_after(last + c).angle(&expected));
            let second_order = (change.norm() * dt).powi(2);
            let holds = off < second_order + 1e-7;
            assert!(holds, "{spin} {h}: {off} {second_order}");
            assert!(plain > 0.05 * change.norm() * dt, "{plain}");
        }
    }
}

/// A body without an axis of symmetry turns by the whole of its angular velocity.
#[test]
fn turns_follow_each_other() {
    let turn = |u: Vector3<f64>| nalgebra::UnitQuaternion::from_scaled_axis(u);
    let (u, all) = (Vector3::new(0.8, -1.0, 1.3), Vector3::new(0.5, 0.7, 0.1));
    for h in [1e-1, 1e-2, 1e-3] {
        let change = all * h;
        let further = crate::step::guarded::turn_further(&u, &change);
        let off = turn(u + further).angle_to(&(turn(change) * turn(u)));
        assert!(off < change.norm_squared(), "{off}");
    }
}
