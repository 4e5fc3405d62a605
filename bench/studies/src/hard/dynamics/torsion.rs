//! H24: a disc on a cable that twists, ω = √(GJ/(L I_d)); with the cable's own inertia ω = (β/L)√(GJ/j), β tan β =
//! J/I_d, J = jL. The chain of rods has ω = 2√(k/J₁) sin ½θ with (I_d/J₁) sin θ tan Nθ = 1 ([`super::line`]).

use super::line::{Hold, Line, end_mass, end_mass_continuum};
use super::shape::Shape;
use crate::hard::{at, each_solver};
use crate::law;
use indicatif::ProgressBar;
use taut_ground::modes::natural;
use taut_integrator::Scheme;
use taut_model::{Body, Scene, Stiffness};
use taut_output::check::{Check, ExperimentError, Outcome};

const LENGTH: f64 = 2.0;
const SEGMENTS: usize = 24;
/// Mass \[kg] and radius \[m] of the rods together: J = ½ m r².
const MASS: f64 = 6.0;
const RADIUS: f64 = 0.02;
const STIFFNESS: Stiffness = Stiffness {
    ea: 1e7,
    ei: 50.0,
    gj: 40.0,
};
/// J/I_d.
const RATIOS: [f64; 3] = [1.0, 0.1, 1e-3];
/// Largest relative error that passes.
const BAR: f64 = 1e-4;

/// Inertia of the cable about its axis \[kg m²].
fn inertia() -> f64 {
    0.5 * MASS * RADIUS * RADIUS
}

fn scene(ratio: f64) -> Scene {
    let l = LENGTH / SEGMENTS as f64;
    let radius = 0.2;
    let disc = Body::rod(0.05, radius, 2.0 * inertia() / ratio / (radius * radius));
    let line = Line {
        segments: SEGMENTS,
        length: LENGTH,
        rod: Body::rod(l, RADIUS, MASS / SEGMENTS as f64),
        stiffness: STIFFNESS,
        bends: true,
        tension: 0.0,
        ends: [Hold::Clamped, Hold::Load],
        load: Some(disc),
    };
    line.scene("torsional pendulum")
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let twisted = |ratio: f64| {
        let mut scene = scene(ratio);
        if let Some(modes) = natural(&scene, &[5]) {
            modes.displace(&mut scene, 0, 0.1);
        }
        scene
    };
    Ok(vec![twisted(1.0), twisted(1e-3)])
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let ratios: &[f64] = if quick { &[0.1] } else { &RATIOS };
    let mut checks = Vec::new();
    for &ratio in ratios {
        checks.extend(pendulum(ratio, quick)?);
    }
    Ok(checks.into())
}

fn pendulum(ratio: f64, quick: bool) -> Result<Vec<Check>, ExperimentError> {
    let scene = scene(ratio);
    let modes = natural(&scene, &[5]);
    let (n, disc) = (SEGMENTS as f64, inertia() / ratio);
    let wave = (STIFFNESS.gj / (inertia() / LENGTH)).sqrt();
    let theta = end_mass(SEGMENTS, ratio);
    let shape = Shape {
        scene: &scene,
        modes: modes.as_ref(),
        number: 0,
        discrete: 2.0 * wave * n / LENGTH * (0.5 * theta).sin(),
        continuum: end_mass_continuum(ratio) * wave / LENGTH,
        bar: BAR,
    };
    let massless = (STIFFNESS.gj / (LENGTH * disc)).sqrt();
    let note = format!(
        "massless cable: √(GJ/(L I_d)) = {massless:.6} rad/s; with a third of its inertia on the disc {:.6}",
        (STIFFNESS.gj / (LENGTH * (disc + inertia() / 3.0))).sqrt()
    );
    let name = |what: &str| format!("J/I_d = {ratio}: {what}");
    let stepped = |dt| {
        Some(law::elastic_frequency(
            Scheme::default(),
            shape.discrete,
            dt,
        ))
    };
    // 10⁻²rad a step: 2·10⁻⁵ of the frequency.
    let dt = 1e-2 / shape.discrete;
    let options = at(dt);
    let mut checks = vec![
        shape.eigenvalue(name("eigenvalue")).noting(note),
        shape.motion(name("motion"), options, (stepped(dt), 1.5))?,
    ];
    if ratio == 0.1 && !quick {
        checks.extend(each_solver(&name("motion"), |choice| {
            let check = shape.motion("", choice.plain_options(dt), (stepped(dt), 1.0))?;
            Ok(check)
        })?);
    }
    Ok(checks)
}
