//! H44, the ball: it bounces to rest, slides until it rolls, and rolls down an incline.
//!
//! A ball that falls by H and keeps e of its speed in each bounce comes to rest after
//!
//! ```text
//! t = √(2H/g) (1 + 2 Σ eⁿ) = √(2H/g) (1 + e)/(1 − e)
//! ```
//!
//! infinitely many bounces later. A solid ball, I = ⅖ m r², that is pushed with v₀ slides with −μ g and spins up with
//! 5/2 μ g/r. It rolls from t = 2 v₀/(7 μ g) on, with 5/7 v₀, after 12 v₀²/(49 μ g) of way. Down a plane it rolls with 5/7 g sin α where μ ≥ 2/7 tan
//! α. Below that it slides with g (sin α − μ cos α), which is more.

use super::{DT, GRAVITY, ground, put, rising, rough, run};
use crate::hard::at;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_integrator::StepError;
use taut_model::collide::{Shape, Surface};
use taut_model::{Body, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const MU: f64 = 0.3;
const RADIUS: f64 = 0.2;
/// Largest relative error of a speed or an acceleration.
const BAR: f64 = 1e-6;
/// Largest relative error of a time.
const TIME: f64 = 1e-2;

fn ball(slope: f64, height: f64, surface: Surface) -> Scene {
    let mut scene = ground("ball", slope, surface);
    let place = rising(slope) * Vector3::z() * (RADIUS + height);
    let shape = Shape::Sphere { radius: RADIUS };
    put(
        &mut scene,
        "ball",
        Body::sphere(RADIUS, 1.0).at(place),
        shape,
        surface,
    );
    scene
}

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = vec![bounces(DT / 4.0)?, bounces(DT)?];
    checks.extend(pushed()?);
    checks.extend(rolls()?);
    Ok(checks.into())
}

/// When the last bounce ends.
fn bounces(dt: f64) -> Result<Check, ExperimentError> {
    let (e, height) = (0.8, 1.0);
    let surface = Surface {
        restitution: e,
        ..rough(0.0)
    };
    let mut last = 0.0;
    let steps = (6.0 / dt).round() as usize;
    let (stepper, _) = run(ball(0.0, height, surface), at(dt), steps, |stepper, _| {
        if stepper.scene().bodies.velocity[0].z > 1e-6 {
            last = stepper.time();
        }
    })?;
    let exact = (2.0 * height / GRAVITY).sqrt() * (1.0 + e) / (1.0 - e);
    let rest = stepper.scene().bodies.position[0].z - RADIUS;
    let rate = 1.0 / dt;
    let case = format!("ball dropped by 1 m, e = 0.8, {rate:.0} steps a second: bounces until");
    let check = Check::relative(case, [exact, last], "s", TIME);
    let check = check.noting(format!("rests {rest:.1e} m above its contact"));
    let cause = "a bounce is not resolved below |g| Δt/10 of speed, and the last ones take less than a step";
    Ok(check.limited(dt > 0.01 && (last / exact - 1.0).abs() < 0.1, cause))
}

fn pushed() -> Result<Vec<Check>, ExperimentError> {
    let speed = 3.0;
    let mut scene = ball(0.0, 0.0, rough(MU));
    scene.bodies.velocity[0].x = speed;
    let dt = DT / 4.0;
    let (mut rolls, mut found) = (None, 0.0);
    let (stepper, _) = run(scene, at(dt), 480, |stepper, _| {
        let bodies = &stepper.scene().bodies;
        found = bodies.velocity[0].x;
        let slip = found - RADIUS * bodies.angular_velocity[0].y;
        // Velocities are those of half a step before.
        if slip < 1e-6 * speed && rolls.is_none() {
            rolls = Some(stepper.time() - 0.5 * dt);
        }
    })?;
    let exact = 2.0 * speed / (7.0 * MU * GRAVITY);
    let ours = rolls.unwrap_or(f64::NAN);
    // Back from where it has rolled to since.
    let slid = stepper.scene().bodies.position[0].x - found * (stepper.time() - exact);
    let way = 12.0 * speed * speed / (49.0 * MU * GRAVITY);
    let kept = stepper.energy().kinetic / (0.5 * speed * speed);
    Ok(vec![
        Check::relative(
            "ball pushed with 3 m/s: rolls from",
            [exact, ours],
            "s",
            TIME,
        ),
        Check::relative(
            "ball pushed with 3 m/s: rolls with",
            [5.0 / 7.0 * speed, found],
            "m/s",
            BAR,
        )
        .noting(format!(
            "after 2 s; keeps {kept:.6} of its energy, exact 5/7"
        )),
        // A step that it begins sliding and ends rolling is off by at most the way of friction in it.
        Check::relative(
            "ball pushed with 3 m/s: slides by",
            [way, slid],
            "m",
            0.5 * MU * GRAVITY * dt * dt / way,
        ),
    ])
}

/// Acceleration down the plane, and the slip of the surfaces after a second.
fn down(slope: f64, friction: f64) -> Result<[f64; 2], StepError> {
    let way = rising(slope) * -Vector3::x();
    let mut all = Vec::new();
    let (stepper, _) = run(
        ball(slope, 0.0, rough(friction)),
        at(DT),
        60,
        |stepper, _| {
            all.push(stepper.scene().bodies.velocity[0].dot(&way));
        },
    )?;
    let spin = stepper.scene().bodies.angular_velocity[0].y;
    Ok([(all[59] - all[5]) / (54.0 * DT), all[59] + RADIUS * spin])
}

fn rolls() -> Result<Vec<Check>, ExperimentError> {
    let slope = 20.0_f64.to_radians();
    let least = 2.0 / 7.0 * slope.tan();
    let rolling = 5.0 / 7.0 * GRAVITY * slope.sin();
    let mut checks = Vec::new();
    for friction in [0.5, 1.001 * least] {
        let [ours, slip] = down(slope, friction)?;
        let case = format!("ball down 20°, μ = {friction:.6}: rolls");
        let check = Check::relative(case, [rolling, ours], "m/s²", BAR);
        checks.push(check.noting(format!("slips with {slip:.1e} m/s")));
    }
    let friction = 0.9 * least;
    let [ours, slip] = down(slope, friction)?;
    let exact = GRAVITY * (slope.sin() - friction * slope.cos());
    let case = format!("ball down 20°, μ = {friction:.6}: slides");
    let check = Check::relative(case, [exact, ours], "m/s²", BAR);
    checks.push(check.noting(format!("slips with {slip:.1e} m/s")));
    Ok(checks)
}
