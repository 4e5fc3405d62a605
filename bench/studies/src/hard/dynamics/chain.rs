//! H21: frequencies of a hanging chain, uniform and with a payload.
//!
//! ```text
//! uniform chain     ω_k = ½ j_{0,k} √(g/L)
//! N equal masses    ω² = (g/h) · zeros of Laguerre's L_N                    exact for the discrete chain
//! with payload M    ((R + s) y')' + Ω² y = 0,  R = M/m_cable,  y(1) = 0,  y'(0) = −Ω² y(0),  s from below, g = L = 1
//! ```
//!
//! Ours are the eigenvalues of the library's own matrices ([`taut_ground::modes`]), and the frequencies of motions that
//! start in those shapes; the segments' part of the error is the discrete chain beside the continuous one.

use super::shape::Shape;
use crate::hard::special::{bessel_zero, laguerre_zeros, root};
use crate::hard::{at, each_solver};
use crate::law;
use indicatif::ProgressBar;
use nalgebra::{DMatrix, DVector};
use taut_ground::modes::natural;
use taut_model::{ParticleChainParams, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const GRAVITY: f64 = 9.81;
const LENGTH: f64 = 1.0;
/// Masses of the uniform chain, and of the cable with a payload.
const MASSES: usize = 5;
const CABLE_MASSES: usize = 32;
/// m_cable/M of the payloads.
const RATIOS: [f64; 4] = [0.01, 0.1, 1.0, 10.0];
/// Time step of the motions \[s]: (ωΔt)²/24 of the fifth mode is 3·10⁻⁷.
const DT: f64 = 1.0 / 9600.0;
/// Largest relative error beside the discrete chain that passes.
const BAR: f64 = 1e-6;
/// Displacement of the scenes \[m].
const AMPLITUDE: f64 = 1e-5;

/// A chain of `masses` masses of 1 kg on rigid links, the lowest one of `last` kg.
fn chain(masses: usize, last: f64) -> Result<Scene, ExperimentError> {
    let params = ParticleChainParams {
        particles: masses,
        spacing: LENGTH / masses as f64,
        mass: 1.0,
        load_mass: last,
        compliance: 0.0,
        gravity: GRAVITY,
        horizontal: false,
        ..ParticleChainParams::default()
    };
    Ok(params.build()?)
}

/// A cable of [`CABLE_MASSES`] segments with its mass at their ends, half a segment's with the payload.
fn loaded(ratio: f64) -> Result<Scene, ExperimentError> {
    chain(CABLE_MASSES, CABLE_MASSES as f64 / ratio + 0.5)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    [chain(MASSES, 1.0), loaded(0.01)]
        .into_iter()
        .map(|scene| bent(scene?))
        .collect()
}

/// The scene in its first shape.
fn bent(mut scene: Scene) -> Result<Scene, ExperimentError> {
    if let Some(modes) = natural(&scene, &[0, 2]) {
        modes.displace(&mut scene, 0, AMPLITUDE);
    }
    Ok(scene)
}

/// ω² of the discrete chain \[1/s²], ascending, from its tensions T_i over the link's length and its masses.
fn discrete(scene: &Scene) -> Vec<f64> {
    let mass = &scene.bodies.mass;
    let (n, link) = (mass.len(), LENGTH / mass.len() as f64);
    let below = |i: usize| mass[i..].iter().sum::<f64>() * GRAVITY / link;
    let mut stiffness = DMatrix::zeros(n, n);
    for i in 0..n {
        stiffness[(i, i)] += below(i);
        if i > 0 {
            stiffness[(i - 1, i - 1)] += below(i);
            stiffness[(i - 1, i)] -= below(i);
            stiffness[(i, i - 1)] -= below(i);
        }
    }
    let root = DVector::from_iterator(n, mass.iter().map(|m| m.sqrt().recip()));
    let root = DMatrix::from_diagonal(&root);
    let values = (&root * stiffness * &root).symmetric_eigenvalues();
    let mut values: Vec<f64> = values.iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// ω₁ √(L/g) of a cable of mass `ratio` times its payload's.
///
/// Around the upper end, x = 1 − s, the solution has a power series whose radius is 1 + R > 1.
pub(super) fn loaded_frequency(ratio: f64) -> f64 {
    let top = 1.0 + ratio.recip();
    let mismatch = |omega: f64| {
        let square = omega * omega;
        let (mut a, mut b) = (0.0, 1.0);
        let (mut value, mut slope) = (0.0, 1.0);
        for n in 0..4000_u32 {
            let n = f64::from(n);
            let c = ((n + 1.0) * (n + 1.0) * b - square * a) / (top * (n + 2.0) * (n + 1.0));
            // The terms of x^(n+1) in y and of x^(n+1) in y'.
            value += b;
            slope += (n + 2.0) * c;
            (a, b) = (b, c);
            if b.abs() * (n + 2.0) < 1e-18 && a.abs() < 1e-18 {
                break;
            }
        }
        slope - square * value
    };
    root(mismatch, 0.9, 1.2 * 0.5 * bessel_zero(0.0, 1))
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = uniform(quick)?;
    let ratios: &[f64] = if quick { &[1.0] } else { &RATIOS };
    for &ratio in ratios {
        checks.extend(payload(ratio, quick)?);
    }
    Ok(checks.into())
}

fn uniform(quick: bool) -> Result<Vec<Check>, ExperimentError> {
    let scene = chain(MASSES, 1.0)?;
    let modes = natural(&scene, &[0, 2]);
    let mut checks = Vec::new();
    for (k, zero) in laguerre_zeros(MASSES).into_iter().enumerate() {
        let shape = Shape {
            scene: &scene,
            modes: modes.as_ref(),
            number: k,
            discrete: (zero * GRAVITY * MASSES as f64 / LENGTH).sqrt(),
            continuum: 0.5 * bessel_zero(0.0, k + 1) * (GRAVITY / LENGTH).sqrt(),
            bar: BAR,
        };
        let name = |what: &str| format!("5 masses, mode {}: {what}", k + 1);
        checks.push(shape.eigenvalue(name("eigenvalue")));
        if k == 0 || !quick {
            let periods = if quick { 1.0 } else { 3.0 };
            let stepped = Some(law::geometric_frequency(shape.discrete, DT));
            checks.push(shape.motion(name("motion"), at(DT), (stepped, periods))?);
        }
        if k == 0 {
            checks.extend(every_solver(&shape)?);
        }
    }
    Ok(checks)
}

fn payload(ratio: f64, quick: bool) -> Result<Vec<Check>, ExperimentError> {
    let scene = loaded(ratio)?;
    let modes = natural(&scene, &[0, 2]);
    let continuum = loaded_frequency(ratio);
    let shape = Shape {
        scene: &scene,
        modes: modes.as_ref(),
        number: 0,
        discrete: discrete(&scene).first().map_or(f64::NAN, |w| w.sqrt()),
        continuum: continuum * (GRAVITY / LENGTH).sqrt(),
        bar: BAR,
    };
    let name = |what: &str| format!("m_cable/M = {ratio}: {what}");
    let note = format!("the continuous cable: ω₁√(L/g) = {continuum:.9}; 32 segments");
    let mut checks = vec![shape.eigenvalue(name("eigenvalue")).noting(note)];
    if !quick {
        // (ω₁Δt)²/24 is 2·10⁻⁷.
        let dt = 1.0 / 1600.0;
        let stepped = Some(law::geometric_frequency(shape.discrete, dt));
        checks.push(shape.motion(name("motion"), at(dt), (stepped, 1.5))?);
    }
    Ok(checks)
}

/// The first mode of the uniform chain in motion, with every solver; (ω₁Δt)²/24 is 6·10⁻⁷.
fn every_solver(shape: &Shape<'_>) -> Result<Vec<Check>, ExperimentError> {
    let dt = 1.0 / 960.0;
    let stepped = Some(law::geometric_frequency(shape.discrete, dt));
    each_solver("5 masses, mode 1: motion at 1/960 s", |choice| {
        let check = shape.motion("", choice.plain_options(dt), (stepped, 1.2))?;
        Ok(check)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_payload_makes_a_pendulum_of_the_chain() {
        let printed = [1.000829123, 1.007933711, 1.056422480, 1.157393756];
        for (ratio, digits) in RATIOS.into_iter().zip(printed) {
            assert!((loaded_frequency(ratio) - digits).abs() < 1e-9, "{ratio}");
        }
        // All cable: the uniform chain.
        let uniform = 0.5 * bessel_zero(0.0, 1);
        assert!((loaded_frequency(200.0) / uniform - 1.0).abs() < 1e-2);
    }

    #[test]
    fn the_discrete_chain_has_the_zeros_of_laguerre() {
        let scene = chain(MASSES, 1.0).unwrap();
        for (square, zero) in discrete(&scene).iter().zip(laguerre_zeros(MASSES)) {
            assert!((square / (zero * GRAVITY * 5.0) - 1.0).abs() < 1e-13);
        }
        let loaded = discrete(&loaded(1.0).unwrap())[0].sqrt() / GRAVITY.sqrt();
        assert!(
            (loaded / loaded_frequency(1.0) - 1.0).abs() < 1e-3,
            "{loaded}"
        );
    }
}
