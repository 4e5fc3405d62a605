//! Invariants of ropes and of the sheaves that they slip over.

use super::invariants::{Fault, first};
use super::run::{Case, Moment, Part};
use super::{RATE, scene};
use nalgebra::Vector3;

/// The part in the three states before the end of step `n`, latest last.
fn history<'a>(case: &'a Case, n: usize, part: &'a Part) -> Option<[&'a Part; 4]> {
    let steps = &case.run.steps[n.checked_sub(3)?..=n];
    // A cable that leaves a sheave is one part with another path.
    let other = |m: &Moment| {
        let sudden = m.report.events > 0 || m.report.implicit_substeps > 0;
        sudden || m.parts.len() != steps[3].parts.len()
    };
    if steps.iter().any(other) {
        return None;
    }
    let of = |k: usize| steps[k].part(&part.name);
    Some([of(0)?, of(1)?, of(2)?, part])
}

/// The mean of past and future gaps that the third-difference scheme takes, [`taut_integrator::Scheme`].
fn mean_gap(phi: [f64; 4]) -> f64 {
    let [a, b, c, d] = phi;
    c + 0.5 * (d - 2.0 * c + b) - 0.1 * (d - 3.0 * c + 3.0 * b - a)
}

/// Stretch ε T by the last step's force \[m], which belongs to the beginning of the step: so does the compliance, that of as much
/// rope as the part had then.
fn stretched(history: [&Part; 4]) -> f64 {
    let [_, _, begins, ends] = history;
    begins.compliance * ends.tension
}

/// Farthest that a gap goes in the steps beside t: its rate at t is the mean of theirs, or that at
/// the end of the first.
fn way(phi: [f64; 4]) -> f64 {
    let bends = 0.5 * (phi[3] - 2.0 * phi[2] + phi[1]).abs();
    (phi[3] - phi[2]).abs().max((phi[2] - phi[1]).abs()) + bends
}

/// Largest gap that a slack part may have in the eyes of the step. A part that crosses its length
/// takes the mean of a hat about t, up to a sixth of its way in a step, besides what the scheme
/// adds for the gaps before and after.
fn largest_mean(phi: [f64; 4]) -> f64 {
    let way = way(phi);
    let crosses = phi[2] > -way;
    if phi[2] > 0.0 {
        return mean_gap(phi).max(0.0) + way / 6.0;
    }
    let beside = mean_gap(phi) - if crosses { phi[2] } else { 0.0 };
    beside.max(0.0) + if crosses { way / 6.0 } else { 0.0 }
}

/// Groups of parts that a cable slips between. Slip shortens one part by as much as it lengthens
/// the next, so that only their sum tells a slack cable.
fn chains(m: &Moment) -> Vec<Vec<&Part>> {
    let mut chains: Vec<Vec<&Part>> = m.parts.iter().map(|part| vec![part]).collect();
    for wheel in &m.wheels {
        let (joined, rest) = chains.into_iter().partition::<Vec<_>, _>(|chain| {
            chain.iter().any(|part| wheel.parts.contains(&part.name))
        });
        chains = rest;
        chains.push(joined.into_iter().flatten().collect());
    }
    chains
}

pub(super) fn slack(case: &Case) -> Fault {
    let noise = 1e-9 * case.choices.weight().min(1e12);
    first(case, |n, m| {
        if let Some(part) = m
            .parts
            .iter()
            .find(|part| part.tension.min(part.mean) < -noise)
        {
            return Some(format!("{part:?} pushes"));
        }
        // A blow is in the velocities that a step ends with, and not in the tension: two steps
        // remember the rate before.
        let near = &case.run.steps[n.saturating_sub(2)..=n];
        let touches = near.iter().any(|m| m.report.contacts.touching > 0);
        let blows = case.choices.restitution > 0.0 && touches;
        if case.choices.steps.substeps > 1 || m.report.asleep || blows {
            return None;
        }
        chains(m).into_iter().find_map(|chain| {
            let mut phi = [0.0; 4];
            let (mut parts, mut law) = (0.0, 0.0);
            for part in &chain {
                let history = history(case, n, part)?;
                let own = history.map(|p| p.phi);
                phi.iter_mut().zip(own).for_each(|(sum, phi)| *sum += phi);
                parts += largest_mean(own);
                law += stretched(history);
            }
            // Parts that a sheave holds apart cross their lengths one by one.
            let most = largest_mean(phi).max(parts);
            let way = way(phi);
            let is_rigid = chain.iter().all(|part| part.compliance == 0.0);
            let turning = chain.iter().map(|part| turning(case, n, part) * (1.0 + part.damping * RATE));
            let turning: f64 = turning.sum();
            let open = phi[2] < 0.0 && phi[3] < 0.0 && law > most + turning + 1e-9;
            let open = if is_rigid { phi[2] < -way - turning - 1e-6 } else { open };
            let pulls = chain.iter().find(|part| part.tension > noise)?;
            open.then(|| {
                format!(
                    "`{}` carries {:.4e} N while {:.3e} m, then {:.3e} m longer than its path (τ = {} s)",
                    pulls.name, pulls.tension, -phi[2], -phi[3], pulls.damping
                )
            })
        })
    })
}

/// Twice the length by which the path of a part at the end of step `n` exceeds that of its rates, those that the step
/// remembers of the two before included \[m]: points go round in a circle about the part's other end, as long as the part is
/// now, or about the body's centre.
fn turning(case: &Case, n: usize, part: &Part) -> f64 {
    let rope = case.choices.rope.as_ref();
    let sheave = rope.is_some_and(|r| r.sheave.is_some());
    let sheave = sheave.then(|| scene::hub(&case.choices));
    let of = |m: &Moment| {
        let bodies = &m.bodies;
        let squares = (0..bodies.len()).map(|i| {
            let (v, w) = (bodies.velocity[i], bodies.angular_velocity[i]);
            let span =
                |hub: Vector3<f64>| f64::min(0.5 * part.length, (bodies.position[i] - hub).norm());
            let arm = sheave.map_or(0.5 * part.length, span);
            v.norm_squared() / arm + 0.25 * w.norm_squared()
        });
        squares.fold(0.0, f64::max)
    };
    let near = case.run.steps[n.saturating_sub(2)..=n].iter().map(of);
    near.fold(0.0, f64::max) / (RATE * RATE)
}

/// ε T = φ̄ + τ φ̇ of a taut part whose drum holds, to how far φ moved in the last steps.
pub(super) fn stretch(case: &Case) -> Fault {
    if case.choices.steps.substeps > 1 || case.choices.load.mass > 1e12 {
        return None;
    }
    first(case, |n, m| {
        m.parts.iter().find_map(|part| {
            let history = history(case, n, part)?;
            let slips = part.tension >= part.holds * (1.0 - 1e-9);
            if m.report.asleep || slips || history.iter().any(|p| p.tension <= 0.0) {
                return None;
            }
            let phi = history.map(|p| p.phi);
            let [least, most] = [f64::min, f64::max].map(|f| phi.into_iter().reduce(f).unwrap_or(0.0));
            let law = stretched(history);
            let found = mean_gap(phi) + part.damping * (phi[3] - phi[2]) * RATE;
            let parts = if m.report.divided > 0 { 2.0 } else { 1.0 };
            let moved = parts * (most - least) * (1.0 + part.damping * RATE);
            let allowed = 1e-6 + 1e-6 * law + moved + turning(case, n, part) * (1.0 + part.damping * RATE);
            ((law - found).abs() > allowed).then(|| {
                format!(
                    "`{}`: ε T = {law:.3e} m of {:.3e} N, path less length and damping {found:.3e} m, moved {moved:.1e} m",
                    part.name, part.tension
                )
            })
        })
    })
}

/// The parts' lengths add up to the same, but for what winches and slipping drums pay out.
pub(super) fn lengths(case: &Case) -> Fault {
    if case.choices.rope.as_ref()?.winch.is_some() {
        return None;
    }
    let sum = |m: &Moment| m.parts.iter().map(|p| p.length).sum::<f64>();
    first(case, |n, m| {
        let last = &case.run.steps[n.checked_sub(1)?];
        let (before, after) = (sum(last), sum(m));
        let same = last.parts.len() == m.parts.len() && m.report.events == 0;
        (same && (after - before).abs() > 1e-9 * after.max(1.0))
            .then(|| format!("{before} m, then {after} m"))
    })
}

/// Tensions before and after a sheave, its slip and grip.
fn at_sheaves(m: &Moment) -> impl Iterator<Item = (f64, f64, f64, f64)> + '_ {
    let tension = |name: &String| m.part(name).map(|p| p.tension);
    m.wheels
        .iter()
        .filter_map(move |w| Some((tension(&w.parts[0])?, tension(&w.parts[1])?, w.slip, w.grip)))
}

/// By how much e^(μθ) differs between sub-steps or parts, over itself: a span turns by its end's way over its length.
fn between(case: &Case, n: usize) -> f64 {
    let m = &case.run.steps[n];
    let friction = case.choices.rope.as_ref().and_then(|r| r.sheave);
    if case.choices.steps.substeps == 1 && m.report.divided == 0 {
        return 0.0;
    }
    // A body at rest at the end of the step moved in its first sub-step.
    let ends = [case.before(n), &m.bodies];
    let speeds = ends.iter().flat_map(|bodies| &bodies.velocity);
    let fastest = speeds.map(Vector3::norm).fold(0.0, f64::max);
    let lengths = m.parts.iter().map(|part| part.length);
    let shortest = lengths.fold(f64::INFINITY, f64::min);
    friction.unwrap_or(0.0) * fastest / (RATE * shortest)
}

pub(super) fn cone_of_sheaves(case: &Case) -> Fault {
    let noise = 1e-6 * case.choices.weight();
    first(case, |n, m| {
        // The grip is that of the beginning of the step.
        let wheels = &case.run.steps[n.saturating_sub(1)].wheels;
        if n == 0 || wheels.len() != m.wheels.len() || m.report.undecided > 0 {
            return None;
        }
        at_sheaves(m)
            .zip(wheels)
            .find_map(|((before, after, slip, grip), last)| {
                let grip = grip.max(last.grip) * (1.0 + 1e-6 + between(case, n));
                let beyond = before > grip * after + noise || after > grip * before + noise;
                beyond.then(|| {
                    format!("{before:.6e} and {after:.6e} N, e^μθ = {grip}, slip {slip:e} m/s")
                })
            })
    })
}

/// Slip follows the pull: the part behind the sheave is strained more, by all that friction can
/// hold.
pub(super) fn work_of_sheaves(case: &Case) -> Fault {
    let weight = case.choices.weight();
    first(case, |_, m| {
        // Forces of a divided step are means over its parts, and the slip is that of the last one: no power follows from both.
        if m.report.divided > 0 {
            return None;
        }
        at_sheaves(m).find_map(|(before, after, slip, _)| {
            let power = (before - after) * slip;
            (power > 1e-9 * weight * slip.abs().max(1e-6) && slip.abs() > 1e-9)
                .then(|| format!("{before:.6e} and {after:.6e} N, slip {slip:e} m/s: {power:e} W"))
        })
    })
}
