//! H22: a taut string and a stiff one.
//!
//! ```text
//! string           ω_k = (kπ/L) √(T/μ)
//! N masses         ω_k = 2 √(T/(m h)) sin(kπ/(2(N + 1)))                 spacing h
//! N pinned rods    ω_k² = (4T/l · s² + 16 EI/l³ · s⁴)/(m (2 + cos θ)/3),   θ = kπ/N, s = sin ½θ
//! pinned, stiff    ω_k = (kπ/L) √(T/μ) √(1 + k²π²EI/(TL²))
//! ```
//!
//! The rods' mass matrix is the consistent one of linear displacements, (1, 4, 1)/6.

use super::line::{Hold, Line};
use super::shape::Shape;
use crate::hard::{at, solvers, together};
use crate::law;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::PI;
use taut_ground::modes::natural;
use taut_ground::pace;
use taut_integrator::Stepper;
use taut_model::{Body, Constraint, Distance, Frame, RowLaw, Scene, Stiffness};
use taut_output::check::{Check, ExperimentError, Measure, Outcome};

/// Length \[m], tension \[N], mass per length \[kg/m], and an axial stiffness \[N] that leaves 10⁻⁶ of the frequency.
const LENGTH: f64 = 10.0;
const TENSION: f64 = 100.0;
const DENSITY: f64 = 1.0;
const EA: f64 = 1e8;
/// Bending stiffness of the stiff string, T L²/100 \[N m²].
const EI: f64 = 0.01 * TENSION * LENGTH * LENGTH;
const MASSES: usize = 15;
const RODS: usize = 16;
/// Time step of the motions \[s].
const DT: f64 = 1.0 / 960.0;
/// Largest relative error beside the discrete string that passes.
const BAR: f64 = 1e-4;

/// N point masses on links between two points.
fn particles() -> Scene {
    let spacing = LENGTH / (MASSES + 1) as f64;
    let compliance = spacing / EA;
    let mut scene = Scene::new("string of masses");
    let at = |i: usize| Vector3::x() * (spacing * i as f64);
    let end = |i: usize| {
        if i == 0 || i > MASSES {
            Frame::world(at(i))
        } else {
            Frame::body(i - 1, Vector3::zeros())
        }
    };
    for i in 1..=MASSES {
        let body = Body::particle(DENSITY * spacing).at(at(i));
        scene.add_body(format!("mass-{i}"), body);
    }
    for i in 0..=MASSES {
        let link = Distance {
            frames: [end(i), end(i + 1)],
            length: spacing - compliance * TENSION,
            law: RowLaw::new(compliance, 0.0),
            transverse: false,
        };
        scene.add_constraint(format!("link-{}", i + 1), Constraint::Distance(link), 0);
    }
    scene
}

/// N rods, with bending stiffness or without.
fn rods(stiff: bool) -> Scene {
    let segment = LENGTH / RODS as f64;
    let stiffness = Stiffness {
        ea: EA,
        ei: EI,
        gj: EI,
    };
    let line = Line {
        segments: RODS,
        length: LENGTH,
        rod: Body::rod(segment, 1e-3, DENSITY * segment),
        stiffness,
        bends: stiff,
        tension: TENSION,
        ends: [Hold::Pinned, Hold::Pinned],
        load: None,
    };
    line.scene(if stiff {
        "stiff string"
    } else {
        "string of rods"
    })
}

/// ω_k of the masses \[rad/s].
fn of_masses(k: usize) -> f64 {
    let spacing = LENGTH / (MASSES + 1) as f64;
    let angle = k as f64 * PI / (2 * (MASSES + 1)) as f64;
    2.0 * (TENSION / (DENSITY * spacing * spacing)).sqrt() * angle.sin()
}

/// ω_k of the rods \[rad/s].
fn of_rods(k: usize, ei: f64) -> f64 {
    let l = LENGTH / RODS as f64;
    let theta = k as f64 * PI / RODS as f64;
    let s = (0.5 * theta).sin().powi(2);
    let stiffness = 4.0 * TENSION / l * s + 16.0 * ei / l.powi(3) * s * s;
    (stiffness / (DENSITY * l * (2.0 + theta.cos()) / 3.0)).sqrt()
}

/// ω_k of the continuum \[rad/s].
fn of_string(k: usize, ei: f64) -> f64 {
    let wave = k as f64 * PI / LENGTH;
    wave * (TENSION / DENSITY).sqrt() * (1.0 + wave * wave * ei / TENSION).sqrt()
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let all = [
        (particles(), [1, 2]),
        (rods(false), [0, 4]),
        (rods(true), [0, 4]),
    ];
    let moved = all.into_iter().map(|(mut scene, coordinates)| {
        if let Some(modes) = natural(&scene, &coordinates) {
            modes.displace(&mut scene, 0, 1e-3);
        }
        scene
    });
    Ok(moved.collect())
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let last = if quick { 1 } else { 4 };
    let mut checks = string(
        "15 masses",
        &particles(),
        &[2],
        [of_masses, |k| of_string(k, 0.0)],
        last,
    )?;
    checks.extend(string(
        "16 rods",
        &rods(false),
        &[0, 4],
        [|k| of_rods(k, 0.0), |k| of_string(k, 0.0)],
        last,
    )?);
    checks.extend(string(
        "16 stiff rods",
        &rods(true),
        &[0, 4],
        [|k| of_rods(k, EI), |k| of_string(k, EI)],
        last,
    )?);
    checks.extend(every_solver(quick)?);
    Ok(checks.into())
}

/// The first mode of the masses over some steps with every solver: from rest the leapfrog has x_n = x_0 cos nθ,
/// 2 sin ½θ = ωΔt.
fn every_solver(quick: bool) -> Result<Vec<Check>, ExperimentError> {
    let (dt, steps, amplitude) = (1.0 / 240.0, 24, 1e-4);
    let mut scene = particles();
    if let Some(modes) = natural(&scene, &[2]) {
        modes.displace(&mut scene, 0, amplitude);
    }
    let middle = MASSES / 2;
    let start = scene.bodies.position[middle].z;
    let exact = (law::geometric_frequency(of_masses(1), dt) * dt * f64::from(steps)).cos();
    let mut found = Vec::new();
    for choice in solvers() {
        if quick && choice.backend.is_iterative() {
            continue;
        }
        let mut stepper = Stepper::new(scene.clone(), choice.plain_options(dt))?;
        for _ in 0..steps {
            pace::step(&mut stepper)?;
        }
        let ours = stepper.scene().bodies.position[middle].z / start;
        let check = Check::number("", [exact, ours], "", Measure::Absolute, BAR);
        found.push((choice.family(), check.by("difference of x/x₀")));
    }
    Ok(together("15 masses, mode 1: 24 steps of 1/240 s", found))
}

/// The first modes of a string: eigenvalues, the motion of the first and the last.
fn string(
    name: &str,
    scene: &Scene,
    coordinates: &[usize],
    [discrete, continuum]: [fn(usize) -> f64; 2],
    last: usize,
) -> Result<Vec<Check>, ExperimentError> {
    let modes = natural(scene, coordinates);
    let mut checks = Vec::new();
    for k in 1..=last {
        let shape = Shape {
            scene,
            modes: modes.as_ref(),
            number: k - 1,
            discrete: discrete(k),
            continuum: continuum(k),
            bar: BAR,
        };
        let case = |what: &str| format!("{name}, mode {k}: {what}");
        let stretch = if coordinates.len() == 1 {
            String::new()
        } else {
            let part = TENSION / EA;
            format!(
                "the formula leaves out the joints' stretch, T/EA = {part:.0e}: half of it and more is in `algebraic`"
            )
        };
        checks.push(shape.eigenvalue(case("eigenvalue")).noting(stretch.clone()));
        // With rods the scheme also filters the tension's part; the law holds for point masses.
        let leapfrog = law::geometric_frequency(shape.discrete, DT);
        let stepped = (coordinates.len() == 1).then_some(leapfrog);
        if k == 1 || k == last {
            let options = at(DT);
            let check = shape.motion(case("motion"), options, (stepped, 1.5))?;
            checks.push(check.noting(stretch));
        }
    }
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discrete_strings_tend_to_the_continuous_ones() {
        assert!((of_masses(1) / of_string(1, 0.0) - 1.0).abs() < 2e-3);
        for ei in [0.0, EI] {
            assert!(
                (of_rods(1, ei) / of_string(1, ei) - 1.0).abs() < 2e-3,
                "{ei}"
            );
        }
        // k²π²/100 of bending.
        let factor = of_string(2, EI) / of_string(2, 0.0);
        assert!((factor - (1.0 + 0.04 * PI * PI).sqrt()).abs() < 1e-14);
    }
}
