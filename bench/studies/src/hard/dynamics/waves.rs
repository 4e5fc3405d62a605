//! H23: longitudinal waves in a steel bar.
//!
//! c = √(E/ρ), transit L/c; fixed and free ω = (2n − 1)πc/(2L); with an end mass β tan β = m/M, ω = βc/L. The chain of
//! rods has exact frequencies too ([`super::line`]), and an exact response to a force F that sets in at its free end:
//! with its modes u_k, ω_k
//!
//! ```text
//! v_j(t) = Σ_k u_k(j) u_k(N) F sin(ω_k t)/(ω_k m Σ_i u_k(i)²)
//! ```
//!
//! A front runs up from the end and leaves the velocity F c/EA behind it; where the front of the continuum is, that of
//! a chain has reached a third of it (an Airy integral). A time step of 1/60 s sees none of this in a bar of 10 m:
//! what it must do is come to rest at the static elongation.

use super::line::{Hold, Line, end_mass, end_mass_continuum, free_end};
use super::shape::Shape;
use crate::hard::worse;
use crate::hard::{at, solvers, together};
use crate::law;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::PI;
use taut_ground::modes::natural;
use taut_ground::pace;
use taut_integrator::{GeometricStiffness, Scheme, StepOptions, Stepper};
use taut_model::{Body, CrossSection, Material, Scene, Stiffness};
use taut_output::check::{Check, ExperimentError, Measure, Outcome, Verdict};

const LENGTH: f64 = 10.0;
const RADIUS: f64 = 0.01;
const SEGMENTS: usize = 50;
/// The force that sets in at the lower end \[N].
const FORCE: f64 = 1000.0;
/// Largest relative error of a frequency beside the discrete bar.
const BAR: f64 = 1e-4;
/// Largest error of an arrival, in segments.
const ARRIVAL_BAR: f64 = 1.0;
/// Largest ringing after three quarters of a second of 60 steps a second, over the static elongation.
const RINGING_BAR: f64 = 1e-6;

fn section() -> CrossSection {
    CrossSection::Circle { radius: RADIUS }
}

/// Mass per length \[kg/m].
fn density() -> f64 {
    Material::STEEL.density * section().area()
}

/// √(E/ρ) \[m/s].
fn speed() -> f64 {
    (Material::STEEL.young / Material::STEEL.density).sqrt()
}

/// The bar, fixed above, with an end mass of 1/`ratio` of its own or none.
fn bar(segments: usize, ratio: Option<f64>) -> Scene {
    let l = LENGTH / segments as f64;
    let line = Line {
        segments,
        length: LENGTH,
        rod: Body::rod(l, RADIUS, density() * l),
        stiffness: Stiffness::new(&Material::STEEL, &section()),
        bends: true,
        tension: 0.0,
        ends: [Hold::Clamped, ratio.map_or(Hold::Free, |_| Hold::Load)],
        load: ratio.map(|r| Body::sphere(1.0, density() * LENGTH / r)),
    };
    line.scene("bar")
}

/// The bar with the force on its last rod.
pub(super) fn pulled() -> Scene {
    let mut scene = bar(SEGMENTS, None);
    scene.bodies.force[SEGMENTS - 1] = Vector3::new(0.0, 0.0, -FORCE);
    scene
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    let modes: &[usize] = if quick { &[1] } else { &[1, 2, 3] };
    for &number in modes {
        let name = format!("free end, mode {number}");
        let theta = free_end(SEGMENTS, number);
        let wave = (2 * number - 1) as f64 * PI / 2.0;
        checks.extend(frequencies(&name, None, number, [theta, wave])?);
    }
    let ratios: &[f64] = if quick { &[0.1] } else { &[1.0, 0.1, 1e-3] };
    for &ratio in ratios {
        let name = format!("end mass, m/M = {ratio}");
        let waves = [end_mass(SEGMENTS, ratio), end_mass_continuum(ratio)];
        checks.extend(frequencies(&name, Some(ratio), 1, waves)?);
    }
    checks.extend(arrivals()?);
    checks.extend(at_sixty(quick)?);
    Ok(checks.into())
}

/// A mode of wave number θ of the chain and β/L of the continuum: eigenvalue and motion.
fn frequencies(
    name: &str,
    ratio: Option<f64>,
    number: usize,
    [theta, beta]: [f64; 2],
) -> Result<[Check; 2], ExperimentError> {
    let scene = bar(SEGMENTS, ratio);
    let modes = natural(&scene, &[2]);
    let l = LENGTH / SEGMENTS as f64;
    let shape = Shape {
        scene: &scene,
        modes: modes.as_ref(),
        number: number - 1,
        discrete: 2.0 * speed() / l * (0.5 * theta).sin(),
        continuum: beta * speed() / LENGTH,
        bar: BAR,
    };
    let dt = 1e-2 / shape.discrete;
    let stepped = law::elastic_frequency(Scheme::default(), shape.discrete, dt);
    Ok([
        shape.eigenvalue(format!("{name}: eigenvalue")),
        shape.motion(format!("{name}: motion"), at(dt), (Some(stepped), 1.5))?,
    ])
}

/// Velocity of mass `j` (from 1) of the chain at time `t` (s), upwards positive \[m/s].
fn response(j: usize, t: f64) -> f64 {
    let l = LENGTH / SEGMENTS as f64;
    let mass = density() * l;
    let mode = |k: usize| {
        let theta = free_end(SEGMENTS, k);
        let u = |i: usize| ((i as f64 - 0.5) * theta).sin();
        let omega = 2.0 * speed() / l * (0.5 * theta).sin();
        let norm: f64 = (1..=SEGMENTS).map(|i| u(i) * u(i)).sum();
        u(j) * u(SEGMENTS) * (omega * t).sin() / (omega * mass * norm)
    };
    -FORCE * (1..=SEGMENTS).map(mode).sum::<f64>()
}

/// First time at which samples, the first one at time 0, reach a third of the plateau \[intervals].
fn arrival(samples: impl Iterator<Item = f64>) -> f64 {
    let level = FORCE / (3.0 * speed() * density());
    let mut before = 0.0;
    for (n, v) in samples.enumerate() {
        if -v >= level {
            return n as f64 - (-v - level) / (before - v);
        }
        before = -v;
    }
    f64::NAN
}

/// When the front has passed a quarter, a half and three quarters of the bar.
fn arrivals() -> Result<Vec<Check>, ExperimentError> {
    let l = LENGTH / SEGMENTS as f64;
    let dt = 0.05 * l / speed();
    let steps = (1.4 * LENGTH / speed() / dt) as usize;
    let mut stepper = Stepper::new(pulled(), at(dt))?;
    let watched = [3 * SEGMENTS / 4, SEGMENTS / 2, SEGMENTS / 4];
    let mut seen = [const { Vec::new() }; 3];
    for _ in 0..steps {
        // The velocity after a step is that of its middle.
        pace::step(&mut stepper)?;
        for (samples, j) in seen.iter_mut().zip(watched) {
            samples.push(stepper.scene().bodies.velocity[j - 1].z);
        }
    }
    let rows = seen.into_iter().zip(watched).map(|(samples, j)| {
        // The force acts at the centre of the last rod.
        let way = (SEGMENTS - j) as f64;
        let ours = (arrival(samples.into_iter()) + 0.5) * dt * speed() / l;
        let exact = arrival((0..steps).map(|n| response(j, (n as f64 + 0.5) * dt)));
        let exact = (exact + 0.5) * dt * speed() / l;
        Check::number(
            format!("front after {way} segments"),
            [way, ours],
            "segments",
            Measure::Absolute,
            ARRIVAL_BAR,
        )
        .by("in segments; time: beside the chain's exact response; space: this beside the continuum")
        .time_part((ours - exact).abs()).space_part((exact - way).abs())
    });
    Ok(rows.collect())
}

/// Largest departure of the free end from its static elongation in the last quarter of a second, over that.
fn ringing(options: StepOptions, damping: f64) -> Result<f64, ExperimentError> {
    let mut scene = pulled();
    for constraint in &mut scene.constraints {
        if let taut_model::Constraint::Cosserat(joint) = constraint {
            let laws = &mut joint.law;
            let all = [&mut laws.stretch, &mut laws.bend, &mut laws.twist];
            for law in all.into_iter().flatten() {
                law.damping = damping;
            }
        }
    }
    let stiffness = Stiffness::new(&Material::STEEL, &section());
    // To the centre of the last rod.
    let rest = FORCE * (LENGTH - 0.5 * LENGTH / SEGMENTS as f64) / stiffness.ea;
    let start = scene.bodies.position[SEGMENTS - 1].z;
    let dt = options.dt;
    let mut stepper = Stepper::new(scene, options)?;
    let mut worst = 0.0;
    for n in 0..(1.0 / dt) as usize {
        pace::step(&mut stepper)?;
        if (n as f64) * dt >= 0.75 {
            let down = start - stepper.scene().bodies.position[SEGMENTS - 1].z;
            worst = worse(worst, (down / rest - 1.0).abs());
        }
    }
    Ok(worst)
}

/// Most that what is let go from its unstrained length and not damped is away from rest, over the static elongation.
const UNDAMPED: f64 = 1.0 + 1e-6;

/// 60 steps a second: the default with every solver, then the other schemes.
fn at_sixty(quick: bool) -> Result<Vec<Check>, ExperimentError> {
    let dt = 1.0 / 60.0;
    let check = |worst: f64| {
        Check::off("", "static elongation", worst, "", RINGING_BAR)
            .by("largest over the last quarter of a second, over the static elongation")
    };
    let mut found = Vec::new();
    for choice in solvers() {
        if quick && choice.backend.is_iterative() {
            continue;
        }
        found.push((
            choice.family(),
            check(ringing(choice.plain_options(dt), 0.0)?),
        ));
    }
    let mut checks = together("ringing at 1/60 s, third-difference", found);
    let with = |scheme| StepOptions {
        scheme,
        stiffness: GeometricStiffness::Off,
        ..at(dt)
    };
    let rows = [
        (Scheme::LinearlyImplicit, 0.0),
        (Scheme::Spook, 0.0),
        (Scheme::Spook, 2.5 * dt),
    ];
    for (scheme, damping) in rows {
        let mut check = check(ringing(with(scheme), damping)?);
        check.case = format!("ringing at 1/60 s, {scheme}, τ = {:.1} Δt", damping / dt);
        let omega = speed() / LENGTH * free_end(1, 1) * dt;
        let roots = law::roots(&law::recurrence(scheme, [omega * omega, 0.0], damping / dt));
        let kept = roots.first().map_or(f64::NAN, |z| z[0]);
        let own_swing = check.error.is_some_and(|e| e <= UNDAMPED);
        if check.verdict == Verdict::Fail && kept > 1.0 - 1e-9 && own_swing {
            check.verdict = Verdict::Limit;
            check = check.noting(format!(
                "the scheme damps nothing at τ = 0: the first mode keeps {kept:.6} of its amplitude in a step"
            ));
        }
        checks.push(check);
    }
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_leaves_a_plateau() {
        let (l, plateau) = (LENGTH / SEGMENTS as f64, FORCE / (speed() * density()));
        assert!((speed() / 5048.0 - 1.0).abs() < 1e-3);
        assert!((LENGTH / speed() - 2e-3).abs() < 2e-5);
        // Far behind the front, and far ahead of it.
        let v = response(40, 40.0 * l / speed());
        assert!((-v / plateau - 1.0).abs() < 0.2, "{v} {plateau}");
        assert!(response(10, 20.0 * l / speed()).abs() < 1e-3 * plateau);
        // A third at the continuum's front, which starts at the free end, half a segment beyond the last mass.
        let way = (SEGMENTS - 10) as f64 + 0.5;
        let third = -response(10, way * l / speed()) / plateau;
        assert!((third - 1.0 / 3.0).abs() < 0.05, "{third}");
    }
}
