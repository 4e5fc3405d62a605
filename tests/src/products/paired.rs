//! Invariants of two runs of the same choices.

use super::invariants::{Fault, order, ringing};
use super::run::{Case, Moment, Run, options, sleep, steps};
use super::{Choices, G, Other, RATE, Rope, scene};
use crate::prelude::*;

/// Contacts beyond which a scene is not run with shorter steps.
const MANY: usize = 8;

/// The first step in which the steps `a`, which begin with number `from`, and a run of as many differ in a bit.
fn differs(a: &[Moment], b: &Run, from: usize) -> Fault {
    let steps = a.iter().zip(&b.steps);
    let mut other = steps.enumerate().filter(|(_, (a, b))| a.bits != b.bits);
    let found = other.next().map(|(n, (a, b))| {
        let k = a.bits.iter().zip(&b.bits).position(|(a, b)| a != b);
        let text = format!("number {k:?} of {} and {}", a.bits.len(), b.bits.len());
        (from + n, text)
    });
    let ends = (a.len(), b.steps.len());
    found.or_else(|| (ends.0 != ends.1).then(|| (from + ends.0, format!("{ends:?} steps"))))
}

fn again(case: &Case, options: StepOptions, steps: usize) -> Option<Run> {
    let stepper = Stepper::new(case.scene.clone(), options).ok()?;
    Some(Run::of(stepper, steps))
}

/// Steps that are taken up again besides the one midway, after what leaves most behind, and steps taken from each.
const RESUMED: usize = 4;
const FOLLOWED: usize = 3;

pub(super) fn saved(case: &Case) -> Fault {
    let all = case.run.steps.len();
    let half = all / 2;
    let leaves = |m: &Moment| m.report.divided + m.report.events > 0 || m.report.redone;
    let before_last = case.run.steps[..all.saturating_sub(1)].iter().enumerate();
    let sudden = before_last.filter(|(_, m)| leaves(m));
    let mut resumed: Vec<usize> = sudden.map(|(n, _)| n + 1).take(RESUMED).collect();
    resumed.push(half);
    resumed.sort_unstable();
    let mut stepper = Stepper::new(case.scene.clone(), options(&case.choices)).ok()?;
    let mut done = 0;
    for from in resumed {
        while done < from {
            stepper.step().ok()?;
            done += 1;
        }
        let after = &case.run.steps[from..];
        let rest = steps() - from;
        let count = if from == half {
            rest
        } else {
            rest.min(FOLLOWED)
        };
        let fault = match stepper.save().and_then(Stepper::restore) {
            Ok(restored) => {
                let own = &after[..count.min(after.len())];
                differs(own, &Run::of(restored, count), from)
            }
            Err(error) => Some((from, error.to_string())),
        };
        if fault.is_some() {
            return fault;
        }
    }
    None
}

pub(super) fn estimated(case: &Case) -> Fault {
    let own = options(&case.choices);
    let other = own.with(|o| o.estimate = o.estimate.is_none().then_some(2));
    differs(&case.run.steps, &again(case, other, steps())?, 0)
}

/// A load that hangs far away over a sheave with friction, and another that an event ties where it hangs.
const FAR: &str = include_str!("far.toml");

/// Machines that nothing connects do not know of each other: up to rounding, until shapes touch, which amplifies it.
pub(super) fn beside(case: &Case) -> Fault {
    let own = options(&case.choices);
    if own.sleep.is_some() || !case.choices.gravity || case.choices.load.mass > 1e12 {
        return None;
    }
    let text = scene::toml(&case.choices).ok()? + FAR;
    let scene = SceneSource::parse(&text, &[]).ok()?.build().ok()?;
    let (load, own_load) = (scene.load?, case.load());
    let mut stepper = Stepper::new(scene, own).ok()?;
    for (n, m) in case.run.steps.iter().enumerate() {
        stepper.step().ok()?;
        if m.report.contacts.touching > 0 {
            return None;
        }
        let off = stepper.scene().bodies.position[load] - m.bodies.position[own_load];
        if off.norm() > 1e-6 {
            return Some((
                n,
                format!("{:.3e} m off beside another machine", off.norm()),
            ));
        }
    }
    None
}

/// A swing may be off by the distance, and a creep goes on by it in each period. Left out: unstable
/// rest without friction, where a creep grows, and bodies that an event lets go, with the velocity
/// that a swing has then.
pub(super) fn asleep(case: &Case) -> Fault {
    let c = &case.choices;
    if c.friction == 0.0 && matches!(c.other, Some(Other::Under { .. })) {
        return None;
    }
    let own = options(&case.choices);
    let (sleeps, distance) = (own.sleep.is_some(), sleep().distance);
    let other = own.with(|o| o.sleep = (!sleeps).then(sleep));
    let other = again(case, other, steps())?;
    let slept = if sleeps { &case.run } else { &other };
    let since = slept.steps.iter().position(|m| m.report.asleep)?;
    let allowed = |n: usize| {
        let time = n.saturating_sub(since) as f64 / RATE;
        distance * (1.0 + time / sleep().period)
    };
    let pairs = case.run.steps.iter().zip(&other.steps).enumerate();
    let let_go = |n: usize| slept.steps[since..=n].iter().any(|m| m.report.events > 0);
    let pairs = pairs.take_while(|(n, _)| *n < since || !let_go(*n));
    let off = pairs.map(|(n, (a, b))| {
        let places = a.bodies.position.iter().zip(&b.bodies.position);
        (n, places.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max))
    });
    let mut beyond = off.filter(|(n, off)| *off > allowed(*n));
    beyond
        .next()
        .map(|(n, off)| (n, format!("{off:.3e} m apart")))
}

/// Sub-steps are steps of their own length, to the rounding of their times. Sleep, what events tie or let go, sheaves that a
/// rope leaves, and segments that split or merge are decided at the ends of steps.
pub(super) fn substepped(case: &Case) -> Fault {
    let substeps = case.choices.steps.substeps;
    let at_ends = case.choices.steps.sleep || !case.scene.events.is_empty();
    let fine = case.fine().filter(|_| substeps > 1 && !at_ends)?;
    let parts = fine.steps.chunks_exact(substeps);
    let steps = case.run.steps.iter().zip(parts).enumerate();
    let parts_of = |m: &Moment| (m.wheels.len(), m.bodies.len());
    let first = case.run.steps.first().map(parts_of)?;
    let lies = |m: &Moment| parts_of(m) == first;
    let mut steps = steps.take_while(|(_, (a, parts))| lies(a) && parts.iter().all(lies));
    steps.find_map(|(n, (a, parts))| {
        let places = a.bodies.position.iter().zip(&parts.last()?.bodies.position);
        let off = places.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        (off > 1e-9).then(|| (n, format!("{off:.3e} m off the run of {substeps} steps")))
    })
}

/// Where the load ends with steps so many times as short, and from a place moved by so much.
fn end(choices: &Choices, finer: usize, moved: f64) -> Option<Vector3<f64>> {
    let mut scene = scene::build(choices).ok()?;
    let load = scene.load?;
    scene.bodies.position[load] += Vector3::new(0.6, 0.0, 0.8) * moved;
    let options = options(choices)
        .with(|o| (o.dt, o.estimate, o.sleep) = (1.0 / (RATE * finer as f64), None, None))
        .with(|o| o.substeps = 1);
    let mut stepper = Stepper::new(scene, options).ok()?;
    for _ in 0..steps() * finer {
        stepper.step().ok()?;
    }
    Some(stepper.scene().bodies.position[load])
}

/// Ω Δt of a ringing that a step follows.
pub(super) const RESOLVED: f64 = 0.125;

/// λ Δt of a decay e^(−λ t) that a step of first order follows: halving the step divides the error by 1.7 or more.
const CALM: f64 = 0.2;

/// Times that the steps of the last halving are shorter than those of the first.
const HALVED: usize = 16;

/// Rate τ Ω² at which the damper of a rope without mass stops what is fast, times a step so many times as short.
fn relaxation(case: &Case, finer: usize) -> f64 {
    let damping = case.choices.rope.as_ref().map_or(0.0, |r| r.damping);
    damping * RATE * ringing(case) / finer as f64
}

/// Returns true if what a damper stops takes some steps of the halvings and a part of others: an error that is of no order there.
pub(super) fn relaxes(case: &Case) -> bool {
    let first = relaxation(case, coarsest(case));
    first > CALM && first < HALVED as f64
}

/// Times that the steps of the first of the halvings are shorter than the case's: a power of two, so that they follow the
/// ringing of its ropes, if 32 suffices, and what their dampers stop, if 64 does.
pub(super) fn coarsest(case: &Case) -> usize {
    let shorter = |finer: &usize| (RESOLVED * *finer as f64).powi(2) >= ringing(case);
    let first = [1, 2, 4, 8, 16, 32].into_iter().find(shorter).unwrap_or(1);
    let calm = |finer: &usize| *finer >= first && relaxation(case, *finer) <= CALM;
    let calm = [1, 2, 4, 8, 16, 32, 64].into_iter().find(calm);
    calm.unwrap_or(first)
}

/// Distances of the ends of runs with Δt, Δt/2 and Δt/4 \[m], Δt that of [`coarsest`], where no small change of the start
/// becomes a large one.
fn refinements(case: &Case) -> Option<[f64; 2]> {
    let (choices, coarsest) = (&case.choices, coarsest(case));
    let [coarse, middle, fine] = [1, 2, 4].map(|finer| end(choices, coarsest * finer, 0.0));
    let (coarse, middle, fine) = (coarse?, middle?, fine?);
    let apart = 1e-7;
    let chaos = (end(choices, 4 * coarsest, apart)? - fine).norm() / apart;
    (chaos < 10.0).then(|| [(coarse - middle).norm(), (middle - fine).norm()])
}

/// How far the load gets \[m].
fn moved(case: &Case) -> f64 {
    let places = case.run.steps.iter();
    let places = places.map(|m| m.bodies.position[case.load()]);
    let start = places.clone().next().unwrap_or_default();
    places.map(|x| (x - start).norm()).fold(0.0, f64::max)
}

/// Shift of the start that the times of bounces and catches are off by, more or less \[m].
const SHIFT: f64 = 5e-3;

/// Factor by which a halving changes less than the one before it: of order 1 with a quarter for what is of higher order.
const ORDER: f64 = 1.68;

/// Returns true if the halvings of a case say nothing of its order: a third one or a fourth moves the
/// end less, as of order 0.9, or a start that is moved by as much as a bounce is late leads elsewhere.
fn is_early(case: &Case, [first, second]: [f64; 2]) -> bool {
    let end = |finer, moved| end(&case.choices, coarsest(case) * finer, moved);
    let [fine, finest, shifted] = [end(4, 0.0), end(8, 0.0), end(4, SHIFT)];
    let (Some(fine), Some(finest), Some(shifted)) = (fine, finest, shifted) else {
        return false;
    };
    let third = (fine - finest).norm();
    let fourth_gains = |factor: f64| {
        let fourth = end(HALVED, 0.0).map(|x| (finest - x).norm());
        fourth.is_some_and(|fourth| third >= factor * fourth)
    };
    let nearer = match order(case) {
        // Errors of first and of second order that cancel at one step do not at a quarter of it.
        Some(_) => first / third >= ORDER.powi(2) || second / third >= ORDER || fourth_gains(ORDER),
        // A step knows a hit slower than gravity's speed in it as rest: the halvings begin where it is faster.
        None => third <= 0.75 * second || fourth_gains(1.33),
    };
    nearer || (shifted - fine).norm() > 10.0 * SHIFT
}

/// Convergence of motions that do not amplify a change. Halving the steps once more changes the end
/// by at most as much as the first halving. Where shapes meet or part and ropes close or open within
/// a step, half a step of the fastest motion, and of one as fast the other way, are allowed besides.
pub(super) fn refined(case: &Case) -> Fault {
    // Times of bounces are known to a step. A rope at its breaking force breaks or not. A rope that
    // rings is let go in any phase. Friction wedges what a link holds or does not. Ten runs more of
    // faces on faces would take seconds.
    let c = &case.choices;
    let touches = c.ground.is_some() || c.other.is_some();
    let bounces = c.restitution > 0.0;
    let let_go = |r: &Rope| c.release.is_some() && r.strain > 0.0;
    let rope = c.rope.as_ref();
    let breaks = rope.is_some_and(|r| r.breaks.is_some() || let_go(r));
    let wedges = touches && c.attach.is_some();
    if bounces || breaks || wedges || case.run.steps.iter().any(|m| m.report.contacts.near > MANY) {
        return None;
    }
    let [first, second] = (*case.halvings.get_or_init(|| refinements(case)))?;
    let load = case.load();
    let speeds = case.run.steps.iter();
    let speeds = speeds.map(|m| m.bodies.velocity[load].norm());
    // Oscillations faster than a step are not resolved.
    let rings = rope.map_or(0.0, |r| {
        let stretch = r.strain * r.length;
        let jerked = r.winch.iter().flat_map(|w| w.speeds);
        let jerk = jerked.fold(0.0, |most: f64, speed| most.max(speed.abs()));
        2.0 * (stretch + jerk * (stretch / G).sqrt())
    });
    // What touches rings in the compliance of its contacts, and slides so much further.
    let slid = if touches { 1e-4 * moved(case) } else { 0.0 };
    let [half, fastest] = [0.5 / RATE, speeds.fold(0.0, f64::max)];
    let presses = |m: &Moment| m.contacts.iter().filter(|c| c.force.norm() > 0.0).count();
    let pulls = |m: &Moment| m.parts.iter().filter(|p| p.tension > 0.0).count();
    let changes = |of: &dyn Fn(&Moment) -> usize| {
        let pairs = case.run.steps.windows(2);
        pairs.filter(|pair| of(&pair[0]) != of(&pair[1])).count()
    };
    // A step divides itself for a catch that may be over at its end.
    let divided = case.run.steps.iter().filter(|m| m.report.divided > 0);
    // The first step may catch a slack rope.
    let slack = usize::from(rope.is_some_and(|r| r.slack > 0.0));
    let sudden = changes(&presses) + changes(&pulls) + divided.count() + slack;
    let sudden = sudden.min(2) as f64;
    let allowed = first + 1e-5 + rings + slid + sudden * half * 2.0 * fastest;
    // Where nothing is sudden the order is 1 or more.
    let allowed = match order(case) {
        Some(_) => first / ORDER + 1e-6 * (1.0 + moved(case)),
        None => allowed,
    };
    let is_wrong = second > allowed && !is_early(case, [first, second]);
    is_wrong.then(|| {
        let text =
            format!("{first:.3e} m by the first halving of the step, {second:.3e} m by the second");
        (steps(), text)
    })
}
