//! The capstan of masses and of segments: cables that friction on a fixed cylinder holds.
//!
//! **Masses.** n point masses lie on the cylinder at the angles (k + ½) δ, δ = π/n, on rigid links; the legs hang
//! straight down. A mass turns the link by δ and has the pulls T and T' at ½δ to the tangent. While it slips
//!
//! ```text
//! (T' − T) cos ½δ = μ (T' + T) sin ½δ    ⇒    T'/T = (1 + μ tan ½δ)/(1 − μ tan ½δ)
//! ```
//!
//! whose n-th power is the holding limit of the whole, e^(μπ) with an error of second order.
//!
//! The masses' own weight and inertia join in, m (a + g cos θ + μ g sin θ) a mass at the angle θ.
//!
//! **Segments.** Capsules of the radius r touch with their middles, as in the [edge](super::edge), R off the axis, at
//! joints that turn by δ. The pull T is at α to a segment's axis, T' at β. While it slips, friction μ N is r off that axis:
//!
//! ```text
//! T' cos β − T cos α = μ N,    T sin α + T' sin β = N,    T sin α − T' sin β = c N,    c = μ r/((R + r) tan ½δ)
//! ⇒  (1 − c) cot β = (1 + c) cot α + 2 μ,    T'/T = (1 − c) sin α/((1 + c) sin β)
//! ```
//!
//! All segments pull alike where α + β = δ, which makes tan α the root of (2μ + t (1 − c)) x² + 2 (1 − μ t) x = t (1 + c),
//! t = tan δ. The legs of n such segments then hang straight down where n δ = π: T'/T = q is the n-th part of the whole.
//!
//! In the limit n → ∞ the pull is at κ = μ ν r/(R + r) to the tangent, and of its part S along it
//!
//! ```text
//! dN = ν S dφ,    dS = (μ ν − κ) S dφ,    ν = 1 − κ (μ ν − κ)
//! ⇒  q^n → e^(μ ν π R/(R + r)),    1 − ν = ν² μ² r R/(R + r)²
//! ```
//!
//! With ν = 1 this is what the moments of pulls along the tangent leave; their error is of second order in μ.
//! At the polygon whose joints all turn by δ the limit is lower, by an error of second order: it is bracketed by what
//! holds and what slips.

use super::edge::{EDGE, Over, RADIUS};
use super::{cylinder, rough, run};
use crate::hard::{DT, GRAVITY, at, either, under_gravity};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::PI;
use taut_integrator::{GeometricStiffness, StepError, StepOptions};
use taut_model::collide::{Collider, Shape};
use taut_model::{Body, Constraint, Distance, Frame, RowLaw, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const MU: f64 = 0.3;
/// Mass of a point over that of the load.
const LIGHT: f64 = 1e-3;
/// Part of the limit by which what holds and what slips are apart.
const APART: f64 = 1e-3;
/// Speed of what slips after half a second \[m/s].
const FAST: f64 = 5e-4;
/// Largest relative error of a ratio of tensions.
const BAR: f64 = 1e-6;
/// Mass of all segments that slip \[kg]: a part of 4·10⁻⁷ of the lighter load, whose weight the ratio leaves out. Much
/// lighter ones would give way at their contacts, whose least regularisation is a part of 1/m, as fast as they slip.
const WEIGHTLESS: f64 = 4e-5;
/// Largest deviation of the order from 2.
const ORDER: f64 = 0.05;

/// The ratio of the tensions of n masses without mass that slip.
fn discrete(count: usize) -> f64 {
    let part = MU * (0.5 * PI / count as f64).tan();
    ((1.0 + part) / (1.0 - part)).powi(count as i32)
}

/// T of the last leg for that of the first one, \[N], where the masses slip with the acceleration a along the cylinder.
fn carried(count: usize, first: f64, a: f64) -> f64 {
    let turn = PI / count as f64;
    let (s, c) = (0.5 * turn).sin_cos();
    (0..count).fold(first, |pull, k| {
        let (up, along) = ((k as f64 + 0.5) * turn).sin_cos();
        let own = LIGHT * (a + GRAVITY * (along + MU * up));
        (pull * (c + MU * s) + own) / (c - MU * s)
    })
}

/// The loads' acceleration, and the ratio of the tensions of the legs.
fn accelerated(count: usize, loads: [f64; 2]) -> [f64; 2] {
    let leg = (0.5 * PI / count as f64).cos();
    let pulls = |a: f64| {
        let first = loads[0] * (GRAVITY + a * leg);
        [first, carried(count, first, a)]
    };
    // Pull of the second load beyond the leg's, linear in a.
    let excess = |a: f64| loads[1] * (GRAVITY - a * leg) - pulls(a)[1];
    let a = excess(0.0) / (excess(0.0) - excess(1.0));
    let [first, last] = pulls(a);
    [a * leg, last / first]
}

/// Point masses on a cylinder, and loads.
fn masses(count: usize, loads: [f64; 2]) -> Scene {
    let mut scene = under_gravity("capstan of masses");
    scene.add_collider(cylinder("drum", MU, 1.0, EDGE));
    let turn = PI / count as f64;
    let mut places: Vec<Vector3<f64>> = (0..count)
        .map(|k| {
            let angle = (k as f64 + 0.5) * turn;
            Vector3::new(angle.cos(), 0.0, angle.sin()) * (EDGE + RADIUS)
        })
        .collect();
    places.insert(0, places[0] - Vector3::z());
    places.push(places[count] - Vector3::z());
    for (k, place) in places.iter().enumerate() {
        let mass = match k {
            0 => loads[0],
            k if k == count + 1 => loads[1],
            _ => LIGHT,
        };
        let name = format!("mass-{k}");
        let body = scene.add_body(&name, Body::particle(mass).at(*place));
        if (1..=count).contains(&k) {
            scene.add_collider(Collider {
                surface: rough(MU),
                groups: 2,
                meets: 1,
                ..Collider::new(name, Some(body), Shape::Sphere { radius: RADIUS })
            });
        }
    }
    for (k, pair) in places.windows(2).enumerate() {
        let link = Distance {
            frames: [k, k + 1].map(|body| Frame::body(body, Vector3::zeros())),
            length: (pair[1] - pair[0]).norm(),
            law: RowLaw::RIGID,
            transverse: false,
        };
        scene.add_constraint(format!("link-{k}"), Constraint::Distance(link), 0);
    }
    scene
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let over = segments(8, [1.0, 2.0]);
    Ok(vec![over.build()?])
}

/// The step without what is made of a past.
fn plain() -> StepOptions {
    StepOptions {
        guard: None,
        stiffness: GeometricStiffness::Off,
        ..at(DT)
    }
}

/// The ratio of the tensions of masses that slip, in the first step.
fn slipping(count: usize, loads: [f64; 2]) -> Result<f64, StepError> {
    let (stepper, _) = run(masses(count, loads), plain(), 1, |_, _| {})?;
    let tension = |link: usize| stepper.tension(link).unwrap_or(f64::NAN);
    Ok(tension(count) / tension(0))
}

/// Acceleration of the heavier load in the first steps, once the contacts have yielded.
fn sinking(count: usize, loads: [f64; 2]) -> Result<f64, StepError> {
    let (from, steps) = (4, 8);
    let mut speeds = Vec::new();
    run(masses(count, loads), plain(), steps, |stepper, _| {
        speeds.push(-stepper.scene().bodies.velocity[count + 1].z);
    })?;
    Ok((speeds[steps - 1] - speeds[from]) / (DT * (steps - 1 - from) as f64))
}

fn segments(joints: usize, loads: [f64; 2]) -> Over {
    Over {
        legs: 2,
        segment: 1e-3,
        loads: loads.map(|mass| 100.0 * mass),
        friction: MU,
        ..Over::even(joints)
    }
}

/// α of each of so many segments that slip \[rad], and the ratio T'/T of them all.
fn steady(count: usize) -> [f64; 2] {
    let turn = PI / count as f64;
    let c = MU * RADIUS / ((EDGE + RADIUS) * (0.5 * turn).tan());
    let t = turn.tan();
    let (square, half) = (2.0 * MU + t * (1.0 - c), 1.0 - MU * t);
    let root = (half * half + square * t * (1.0 + c)).sqrt() - half;
    let alpha = root.atan2(square);
    let one = (1.0 - c) * alpha.sin() / ((1.0 + c) * (turn - alpha).sin());
    [alpha, one.powi(count as i32)]
}

/// T'/T of [`steady`] in the limit of many segments.
fn continuous() -> f64 {
    let part = EDGE / (EDGE + RADIUS);
    let excess = 4.0 * MU * MU * part * (1.0 - part);
    let press = 2.0 / (1.0 + (1.0 + excess).sqrt());
    (MU * press * PI * part).exp()
}

/// The ratio of the tensions of so many segments that slip, in the first step.
fn yielding(count: usize) -> Result<f64, ExperimentError> {
    let turn = PI / count as f64;
    let [alpha, limit] = steady(count);
    let over = Over {
        joints: count + 1,
        first: alpha - 0.5 * turn,
        segment: WEIGHTLESS / count as f64,
        ..segments(count, [1.0, 2.0 * limit])
    };
    let (stepper, _) = run(over.build()?, plain(), 1, |_, _| {})?;
    let joints = &stepper.scene().cables[0].joints;
    let pull = |k: usize| {
        let wrench = stepper.force_on(joints[over.legs + k], 0);
        wrench.map_or(f64::NAN, |w| w.force.norm())
    };
    Ok(pull(count) / pull(0))
}

/// Checks of slipping cables of more and more segments.
fn slipping_segments() -> Result<Vec<Check>, ExperimentError> {
    let mut checks = Vec::new();
    let (counts, mut errors) = ([4, 8, 16, 32], Vec::new());
    for count in counts {
        let [_, exact] = steady(count);
        let case = format!("{count} segments on a cylinder, slipping: T'/T");
        let check = Check::relative(case, [exact, yielding(count)?], "", BAR);
        let off = exact / continuous() - 1.0;
        errors.push(off.abs());
        checks.push(check.noting(format!("{off:+.1e} off the limit of many")));
    }
    let order = (errors[2] / errors[3]).log2();
    let case = "segments on a cylinder, slipping: order in n";
    let plain = (MU * PI * EDGE / (EDGE + RADIUS)).exp();
    let note = format!(
        "to e^(μνπR/(R + r)), {:+.1e} off e^(μπR/(R + r))",
        continuous() / plain - 1.0
    );
    checks.push(Check::second_order(case, order, ORDER).noting(note));
    Ok(checks)
}

/// The largest ratio of the loads that the cable holds, by bisection: the second one moves slower than [`FAST`] after half a
/// second.
fn limit(joints: usize) -> Result<f64, ExperimentError> {
    let [mut holds, mut slips] = [1.5, 3.5];
    while slips / holds - 1.0 > 1e-4 {
        let middle = 0.5 * (holds + slips);
        let scene = segments(joints, [1.0, middle]).build()?;
        let (stepper, _) = run(scene, at(DT), 30, |_, _| {})?;
        if stepper.scene().bodies.velocity[1].z > -FAST {
            holds = middle;
        } else {
            slips = middle;
        }
    }
    Ok(holds)
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for count in [4, 8, 16, 32] {
        let loads = [1.0, 2.0 * discrete(count)];
        let [_, exact] = accelerated(count, loads);
        let case = format!("{count} masses on a cylinder, slipping: T'/T");
        let check = Check::relative(case, [exact, slipping(count, loads)?], "", BAR);
        let off = discrete(count) / (MU * PI).exp() - 1.0;
        checks.push(check.noting(format!("without their own masses {off:+.1e} off e^(μπ)")));
        checks.push(holds(count)?);
    }
    checks.extend(slipping_segments()?);
    let counts: &[usize] = either(quick, &[8, 16], &[8, 16, 32]);
    for &joints in counts {
        let bar = 0.4 / joints as f64;
        let case = format!("{joints} joints of segments on a cylinder: the ratio that still holds");
        let both = [continuous(), limit(joints)?];
        checks.push(Check::relative(case, both, "", bar));
    }
    Ok(checks.into())
}

/// Masses hold just below the limit and slip just above it.
fn holds(count: usize) -> Result<Check, ExperimentError> {
    let limit = carried(count, GRAVITY, 0.0) / GRAVITY;
    let [below, above] = [1.0 - APART, 1.0 + APART].map(|part| [1.0, limit * part]);
    let [held, slipped] = [sinking(count, below)?, sinking(count, above)?];
    let [exact, _] = accelerated(count, above);
    let case = format!("{count} masses on a cylinder, (1 ∓ {APART:e}) of the limit: hold and slip");
    let ours = format!("{held:+.1e} and {slipped:.3e} m/s²");
    let reference = format!("0 and from {exact:.3e} m/s² on");
    let good = held.abs() < 0.01 * exact && (0.5..2.0).contains(&(slipped / exact));
    Ok(Check::stated(case, reference, ours, good))
}
