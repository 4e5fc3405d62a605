//! H26: a folded chain of which one end is let go: it keeps its energy, and its tip overtakes free fall.
//!
//! With the tip's fall x, L = g = 1, the arm that falls has the length ½(1 − x) and all of the kinetic energy:
//!
//! ```text
//! v² = x (2 − x)/(1 − x),    t(x) = √2 (2E(φ, k) − F(φ, k)),  sin²φ = x, k² = ½,    t(1) = 1.19814…
//! T = ¼ M g (2 + 2x − 3x²)/(1 − x)        at the fixed end, and diverges
//! ```
//!
//! The chain here is point masses on rigid links, the fold one link wide: the width and the links that turn one after
//! the other are what the model adds. What it adds is of first order in the links' length, as the fold's width is: a
//! third chain with about half the links tells how much, apart from the errors that are compared.

use crate::hard::special::{complete_e, complete_k, elliptic_e, elliptic_f};
use crate::hard::worse;
use crate::hard::{at, solvers, together};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};
use taut_ground::pace;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Body, Constraint, Distance, Frame, RowLaw, Scene};
use taut_output::check::{Check, ExperimentError, Outcome};

const GRAVITY: f64 = 9.81;
const LENGTH: f64 = 10.0;
const MASS: f64 = 10.0;
/// Links of the chain, and of the one that tells what they add; steps of the whole fall.
const LINKS: usize = 151;
const FEW_LINKS: usize = 75;
const STEPS: f64 = 8000.0;
/// Largest relative error of a time that passes.
const BAR: f64 = 1e-2;
/// Largest gain of energy, over M g L, at small steps and at 60 a second.
const GAIN_BAR: f64 = 1e-4;

/// t(x) √(g/L) of the tip's fall x L.
pub(super) fn time_of_fall(x: f64) -> f64 {
    let k = FRAC_1_SQRT_2;
    let phi = x.sqrt().asin();
    SQRT_2 * (2.0 * elliptic_e(phi, k) - elliptic_f(phi, k))
}

/// The time of the whole fall beside that of a free one.
pub(super) fn ratio_to_free_fall() -> f64 {
    2.0 * complete_e(FRAC_1_SQRT_2) - complete_k(FRAC_1_SQRT_2)
}

/// A chain of `links`, an odd number: down from the origin, one link aside, up again.
pub(super) fn chain(links: usize) -> Scene {
    let link = LENGTH / links as f64;
    let arm = links / 2;
    let mut scene = Scene::new("folded chain");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    for i in 1..=links {
        let (x, z) = if i <= arm {
            (0.0, i as f64)
        } else {
            (1.0, (links - i) as f64)
        };
        // The links' mass at their ends.
        let mass = MASS / links as f64 * if i == links { 0.5 } else { 1.0 };
        let place = Vector3::new(x, 0.0, -z) * link;
        scene.add_body(format!("mass-{i}"), Body::particle(mass).at(place));
    }
    scene.load = Some(links - 1);
    for i in 0..links {
        let upper = match i {
            0 => Frame::world(Vector3::zeros()),
            i => Frame::body(i - 1, Vector3::zeros()),
        };
        let distance = Distance {
            frames: [upper, Frame::body(i, Vector3::zeros())],
            length: link,
            law: RowLaw::RIGID,
            transverse: true,
        };
        scene.add_constraint(format!("link-{}", i + 1), Constraint::Distance(distance), 0);
    }
    scene
}

/// Records of a fall.
#[derive(Debug, Clone, PartialEq, Default)]
struct Fall {
    /// The tip's fall after each step, over L.
    tip: Vec<f64>,
    /// Tension at the fixed end in each step, over M g.
    tension: Vec<f64>,
    /// Energy in each step less the first one, over M g L; the largest.
    energy: Vec<f64>,
    gain: f64,
    redone: usize,
}

fn fall(scene: Scene, options: StepOptions, time: f64) -> Result<Fall, StepError> {
    let dt = options.dt;
    let links = scene.bodies.len();
    let weight = scene.mass() * GRAVITY;
    let mut stepper = Stepper::new(scene, options)?;
    let start = stepper.scene().potential_energy();
    let mut found = Fall {
        tip: vec![0.0],
        ..Fall::default()
    };
    for _ in 0..(time / dt) as usize {
        found.redone += usize::from(pace::step(&mut stepper)?.redone);
        let energy = (stepper.energy().total() - start) / (weight * LENGTH);
        found.gain = worse(found.gain, energy);
        found.energy.push(energy);
        found
            .tip
            .push(-stepper.scene().bodies.position[links - 1].z / LENGTH);
        found
            .tension
            .push(-stepper.multipliers()[0] / (dt * weight));
    }
    Ok(found)
}

/// Time at which the tip first has fallen by `x` L \[steps].
fn passage(tip: &[f64], x: f64) -> f64 {
    let Some(n) = tip.iter().position(|y| *y >= x).filter(|n| *n > 0) else {
        return f64::NAN;
    };
    n as f64 - (tip[n] - x) / (tip[n] - tip[n - 1])
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let whole = time_of_fall(1.0) * (LENGTH / GRAVITY).sqrt();
    let (links, steps) = (LINKS, STEPS);
    let run = |links: usize, steps: f64| {
        let options = at(whole / steps);
        fall(chain(links), options, 1.05 * whole)
    };
    let fine = run(links, steps)?;
    let coarser = if quick {
        None
    } else {
        Some([run(links, 0.5 * steps)?, run(FEW_LINKS, steps)?])
    };
    let dt = whole / steps;
    let mut checks = [0.5, 0.9, 0.97]
        .map(|x| fallen(x, &fine, coarser.as_ref(), dt))
        .to_vec();
    checks.push(lowest(&fine, links, whole / steps));
    checks.push(tension(&fine, links, whole / steps));
    let gain = |name: String, found: &Fall| {
        let most = passage(&found.tip, 0.9);
        let at = |n: usize| found.energy.get(n).copied().unwrap_or(f64::NAN);
        let (late, last) = (at(most as usize), at(found.energy.len().saturating_sub(1)));
        Check::within(
            name,
            "no gain",
            format!("{late:+.1e} at 0.9 L, {last:+.1e} at the end"),
            found.gain,
            GAIN_BAR,
        )
        .by("largest gain of energy over M g L")
        .noting(format!(
            "steps that the guard took implicitly: {}",
            found.redone
        ))
    };
    checks.push(gain(format!("{links} links, {steps} steps: energy"), &fine));
    let mut found = Vec::new();
    for choice in solvers() {
        let dt = 1.0 / 60.0;
        let check = match fall(chain(25), choice.options(dt), 3.0) {
            Ok(result) => gain(String::new(), &result),
            Err(e) => {
                Check::within("", "no gain", "lost", f64::NAN, GAIN_BAR).noting(e.to_string())
            }
        };
        found.push((choice.family(), check));
        if quick {
            break;
        }
    }
    checks.extend(together("25 links at 1/60 s for 3 s: energy", found));
    Ok(checks.into())
}

/// When the tip has fallen by `x` L, beside t(x); where the error comes from by a run of half the steps and one of
/// [`FEW_LINKS`].
fn fallen(x: f64, fine: &Fall, coarser: Option<&[Fall; 2]>, dt: f64) -> Check {
    let exact = time_of_fall(x) * (LENGTH / GRAVITY).sqrt();
    let ours = passage(&fine.tip, x) * dt;
    let error = ours / exact - 1.0;
    let check = Check::relative(
        format!("{LINKS} links: tip falls by {x} L"),
        [exact, ours],
        "s",
        BAR,
    );
    let Some([half, few]) = coarser else {
        return check;
    };
    let time = (ours - passage(&half.tip, x) * 2.0 * dt) / 3.0 / exact;
    let [length, longer] = [LINKS, FEW_LINKS].map(|n| (n as f64).recip());
    let space = (passage(&few.tip, x) * dt - ours) * length / (longer - length) / exact;
    check
        .by(format!(
            "relative; time: a third of what half the steps change; space: what {FEW_LINKS} links change, times the \
             links' lengths' ratio, first order"
        ))
        .noting(format!(
            "both leave {:+.0e} of {error:+.0e}",
            error - time - space
        ))
        .time_part(time.abs()).space_part(space.abs())
}

/// When the tip is lowest, beside t(1).
fn lowest(fall: &Fall, links: usize, dt: f64) -> Check {
    let deepest = fall
        .tip
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(b.1));
    let (n, depth) = deepest.map_or((0, f64::NAN), |(n, y)| (n, *y));
    let exact = time_of_fall(1.0) * (LENGTH / GRAVITY).sqrt();
    let ours = n as f64 * dt;
    let free = (2.0 * LENGTH / GRAVITY).sqrt();
    Check::relative(
        format!("{links} links: tip is lowest"),
        [exact, ours],
        "s",
        BAR,
    )
    .noting(format!(
        "at a fall of {depth:.4} L, after {:.6} of a free fall; exact {:.6}",
        ours / free,
        ratio_to_free_fall()
    ))
}

/// Tension at the fixed end around x = ½, its mean over the links that turn meanwhile.
fn tension(fall: &Fall, links: usize, dt: f64) -> Check {
    let [first, last] = [0.4, 0.6].map(|x| passage(&fall.tip, x));
    let scale = (LENGTH / GRAVITY).sqrt();
    let (mut ours, mut exact, mut count) = (0.0, 0.0, 0.0);
    for (n, tension) in fall.tension.iter().enumerate() {
        let t = n as f64;
        if t < first || t > last {
            continue;
        }
        let x = fall.tip[n];
        ours += tension;
        exact += 0.25 * (2.0 + 2.0 * x - 3.0 * x * x) / (1.0 - x);
        count += 1.0;
    }
    let (ours, exact) = (ours / count, exact / count);
    let spread = (time_of_fall(0.6) - time_of_fall(0.4)) * scale / dt;
    Check::relative(
        format!("{links} links: mean tension at the fixed end, x = 0.4 to 0.6"),
        [exact, ours],
        "M g",
        BAR,
    )
    .noting(format!("{count} steps, {spread:.0} by the formula"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_of_fall_as_printed() {
        assert!((time_of_fall(1.0) - 1.1981402347).abs() < 1e-10);
        assert!((ratio_to_free_fall() - 0.8472130848).abs() < 1e-10);
        // dt/dx = 1/v.
        for x in [0.2, 0.5, 0.9] {
            let h = 1e-5;
            let slope = (time_of_fall(x + h) - time_of_fall(x - h)) / (2.0 * h);
            let speed = (x * (2.0 - x) / (1.0 - x)).sqrt();
            assert!((slope * speed - 1.0).abs() < 1e-8, "{x}");
        }
    }

    #[test]
    fn the_folded_chain_is_closed() {
        let scene = chain(25);
        let mut rows = taut_model::Linearized::new(&scene);
        rows.update(&scene, 0.0);
        assert!(rows.phi.iter().all(|gap| gap.abs() < 1e-14));
        assert!(scene.bodies.position[24].z.abs() < 1e-15);
    }
}
