//! H20: a pendulum of large amplitude, T/T₀ = (2/π) K(sin ½θ₀).
//!
//! A point mass on a rigid massless link, let go at rest: the period is the time between two passages of the lowest
//! point in the same direction. The step's error is its dispersion, of second order in Δt; for small amplitudes it is
//! that of the leapfrog, sin(½ω_hΔt) = ½ωΔt.

use super::frequency;
use crate::hard::each_solver;
use crate::hard::special::complete_k;
use crate::law;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, TAU};
use taut_integrator::{GeometricStiffness, Scheme, StepOptions};
use taut_model::{Body, Constraint, Distance, Frame, RowLaw, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const GRAVITY: f64 = 9.81;
const LENGTH: f64 = 1.0;
/// Amplitudes \[°].
const ANGLES: [f64; 7] = [30.0, 60.0, 90.0, 120.0, 150.0, 170.0, 179.0];
/// Steps over the small pendulum's period.
const STEPS: [f64; 3] = [2000.0, 4000.0, 8000.0];
/// Largest relative error of the period at Δt → 0, by two steps' extrapolation.
const BAR: f64 = 1e-6;
/// Largest difference of the order from 2.
const ORDER_BAR: f64 = 0.1;
/// Largest relative error of the frequency of small swings beside the leapfrog's.
const LAW_BAR: f64 = 1e-8;

/// T/T₀ at the amplitude `angle` (rad).
pub(super) fn period_ratio(angle: f64) -> f64 {
    complete_k((0.5 * angle).sin()) / FRAC_PI_2
}

fn small_period() -> f64 {
    TAU * (LENGTH / GRAVITY).sqrt()
}

/// The pendulum at rest at `angle` (rad), its link with the damping time `damping` (s).
fn scene(angle: f64, damping: f64) -> Scene {
    let mut scene = Scene::new("pendulum");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let place = Vector3::new(angle.sin(), 0.0, -angle.cos()) * LENGTH;
    let load = scene.add_body("load", Body::particle(1.0).at(place));
    let link = Distance {
        frames: [
            Frame::world(Vector3::zeros()),
            Frame::body(load, Vector3::zeros()),
        ],
        length: LENGTH,
        law: RowLaw::new(0.0, damping),
        transverse: false,
    };
    scene.add_constraint("link", Constraint::Distance(link), 0);
    scene
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok([30.0_f64, 179.0].map(|a| scene(a.to_radians(), 0.0)).into())
}

fn options(scheme: Scheme, dt: f64) -> StepOptions {
    StepOptions {
        dt,
        scheme,
        stiffness: GeometricStiffness::inertia(scheme.default_alpha()),
        ..StepOptions::default()
    }
}

fn angle(scene: &Scene) -> f64 {
    let x = scene.bodies.position[0];
    x.x.atan2(-x.z)
}

/// The period over two swings \[s].
fn period(scheme: Scheme, angle_at_start: f64, dt: f64) -> Result<f64, ExperimentError> {
    // A rigid row rings at the Nyquist frequency with the trapezoidal scheme.
    let damping = if scheme == Scheme::Spook {
        2.5 * dt
    } else {
        0.0
    };
    let expected = small_period() * period_ratio(angle_at_start);
    let scene = scene(angle_at_start, damping);
    let samples = frequency::record(scene, options(scheme, dt), 2.1 * expected, angle)?;
    let found = frequency::passages(&samples, true, 1.0);
    Ok(match found.as_slice() {
        [first, second, ..] => (second - first) * dt,
        _ => f64::NAN,
    })
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let angles: &[f64] = if quick { &[30.0, 120.0] } else { &ANGLES };
    let mut checks = Vec::new();
    for &degrees in angles {
        checks.extend(swing(Scheme::default(), degrees)?);
    }
    for scheme in [Scheme::LinearlyImplicit, Scheme::Spook] {
        checks.extend(swing(scheme, 120.0)?);
    }
    checks.extend(small()?);
    Ok(checks.into())
}

/// Period at Δt → 0, and order.
fn swing(scheme: Scheme, degrees: f64) -> Result<[Check; 2], ExperimentError> {
    let ratio = period_ratio(degrees.to_radians());
    let exact = small_period() * ratio;
    // Near the top the period depends on the logarithm of what is missing to it: small errors there count.
    let finer = match degrees {
        d if d > 175.0 => 8.0,
        d if d > 160.0 => 4.0,
        _ => 1.0,
    };
    let [coarse, fine, finest] = STEPS.map(|steps| {
        let dt = small_period() / (finer * steps);
        period(scheme, degrees.to_radians(), dt).map(|t| t / exact - 1.0)
    });
    let (coarse, fine, finest) = (coarse?, fine?, finest?);
    let extrapolated = fine + (fine - coarse) / 3.0;
    // The default damps with Δt³, which near the top weighs as much as Δt²: without it.
    let order = ((8.0 * fine - coarse) / (8.0 * finest - fine)).abs().log2();
    let name = |what: &str| format!("{degrees}°, {scheme}: {what}");
    let steps = format!("Δt = T₀/{}, T₀/{}", finer * STEPS[0], finer * STEPS[1]);
    Ok([
        Check::within(
            name("period"),
            format!("T/T₀ = {ratio:.10}"),
            format!("{:.10}", ratio * (1.0 + extrapolated)),
            extrapolated.abs(),
            BAR,
        )
        .by("relative, extrapolated from two steps; time: what the shorter adds")
        .noting(steps.clone())
        .time_part((fine - extrapolated).abs()),
        Check::second_order(name("order"), order, ORDER_BAR)
            .by("difference of the order from 2, of three steps without their term in Δt³")
            .noting(format!("{steps}, T₀/{}", finer * STEPS[2])),
    ])
}

/// Small swings at 60 steps a second beside the leapfrog's law, with every solver.
fn small() -> Result<Vec<Check>, ExperimentError> {
    let (dt, start) = (1.0 / 60.0, 1e-4);
    let omega = TAU / small_period();
    let exact = law::geometric_frequency(omega, dt);
    each_solver("10⁻⁴ rad at 1/60 s", |choice| {
        let measured = frequency::of_motion(
            scene(start, 0.0),
            choice.plain_options(dt),
            (omega, 4.0),
            |scene| scene.bodies.position[0].x,
        )?;
        let check = Check::relative("", [exact, measured], "rad/s", LAW_BAR)
            .by("relative to 2 sin(½ω_hΔt) = ωΔt; time: ω_h of the law beside √(g/L)")
            .algebraic();
        Ok(check.time_part((exact / omega - 1.0).abs()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn period_ratios_as_printed() {
        let printed = [
            1.0174087976,
            1.0731820072,
            1.1803405990,
            1.3728805006,
            1.7622037295,
            2.4393627197,
            3.9010651604,
        ];
        for (degrees, ratio) in ANGLES.into_iter().zip(printed) {
            assert!((period_ratio(degrees.to_radians()) - ratio).abs() < 1e-10);
        }
    }
}
