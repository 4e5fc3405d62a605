//! Invariants of every run, as a table of named functions.
//!
//! Tolerances are those of the documentation. [`EnergyBalance`] is
//! off by less than 4·10⁻² of the motion's own energy in shocks and 10⁻³ elsewhere; sleep moves
//! nothing by more than its distance; friction is regularised by 10⁻⁹ of a contact's own response.
//! Ten thousand times rounding is allowed.

use super::run::{Case, Moment, Part, Run};
use super::{Choices, End, Form, G, RATE, contacts, paired, ropes};
use crate::prelude::*;

/// A violated invariant.
#[derive(Debug, Clone)]
pub struct Violation {
    /// Its name in the table.
    pub invariant: &'static str,
    /// Step of the violation, from 0.
    pub step: usize,
    /// Numbers that violate it.
    pub numbers: String,
}

/// A step and its numbers, where an invariant is violated.
pub(crate) type Fault = Option<(usize, String)>;

/// An invariant, and its name as a sentence.
pub(crate) type Invariant = (&'static str, fn(&Case) -> Fault);

/// All of them, those of one run first.
pub(crate) const ALL: [Invariant; 22] = [
    ("a run ends neither unstable nor unsolved", ends_well),
    ("states and energies are numbers", is_finite),
    (
        "no energy comes from nowhere, by the step's own balance",
        balance,
    ),
    (
        "a scene that nothing drives gains no energy",
        passive_energy,
    ),
    ("no bounce of a single body gains energy", bounce_energy),
    ("a ball comes up to e² of its drop", rebound),
    (
        "a slack rope carries nothing, and no rope pushes",
        ropes::slack,
    ),
    (
        "a taut rope is stretched by what it carries",
        ropes::stretch,
    ),
    ("what slips from part to part is not lost", ropes::lengths),
    (
        "tensions at a sheave are within e^(±μθ)",
        ropes::cone_of_sheaves,
    ),
    (
        "friction of sheaves takes energy away",
        ropes::work_of_sheaves,
    ),
    ("friction of contacts is within its cone", contacts::cone),
    ("friction of contacts takes energy away", contacts::work),
    ("impulses are what changes the momentum", momentum),
    (
        "what rides on a turntable stays where it is",
        contacts::ride,
    ),
    ("a pushed cable does not read as pulled", pushed),
    (
        "a run that is saved midway goes on with the same bits",
        paired::saved,
    ),
    ("the estimate does not change the run", paired::estimated),
    ("asleep and awake are within a millimetre", paired::asleep),
    (
        "sub-steps are steps of their own length",
        paired::substepped,
    ),
    (
        "machines that nothing connects do not know of each other",
        paired::beside,
    ),
    (
        "smaller steps do not move away from the answer",
        paired::refined,
    ),
];

/// Outcome of choices.
#[derive(Debug)]
pub enum Outcome {
    /// All invariants hold.
    Sound(Box<Case>),
    /// The scene is refused with a typed error.
    Refused(String),
    /// An invariant is violated.
    Violated(Violation),
}

/// Runs the choices and judges all invariants, in their order, to the first that is violated.
pub fn judge(choices: &Choices) -> Outcome {
    let judged = std::panic::catch_unwind(|| judged(choices));
    judged.unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        let text = text.or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
        Outcome::Violated(Violation {
            invariant: "nothing panics",
            step: 0,
            numbers: text.unwrap_or_default(),
        })
    })
}

fn judged(choices: &Choices) -> Outcome {
    let case = match Case::of(choices) {
        Ok(case) => case,
        Err(error) => return refused(choices, &error),
    };
    if case.run.steps.is_empty() {
        let error = case.run.error.as_ref();
        return Outcome::Refused(error.map_or_else(String::new, ToString::to_string));
    }
    for (invariant, holds) in ALL {
        if let Some((step, numbers)) = holds(&case) {
            return Outcome::Violated(Violation {
                invariant,
                step,
                numbers,
            });
        }
    }
    Outcome::Sound(Box::new(case))
}

/// A typed error is fine, but for what the documentation allows.
fn refused(choices: &Choices, error: &StepError) -> Outcome {
    let of_link =
        matches!(error, StepError::Scene(SceneError::UnknownJoint { name, .. }) if name == "link");
    let text = error.to_string();
    if choices.attach.is_some() && (of_link || text.contains("`link`")) {
        return Outcome::Violated(Violation {
            invariant: "an event lets go what another one attached",
            step: 0,
            numbers: text,
        });
    }
    Outcome::Refused(text)
}

fn ends_well(case: &Case) -> Fault {
    if case.choices.load.mass > 1e12 {
        return None;
    }
    // Where a force vanishes its bound is within the noise: in single steps, not for long.
    let steps = case.run.steps.iter().enumerate();
    let mut undecided = steps.filter(|(_, m)| m.report.undecided > 0);
    let allowed = case.run.steps.len() / 20;
    if let Some((n, m)) = undecided.nth(allowed) {
        let count = m.report.undecided;
        let text = format!("{count} undecided, as in {allowed} steps before");
        return Some((n, text));
    }
    let error = case.run.error.as_ref()?;
    let lost = matches!(
        error,
        StepError::NonFinite { .. } | StepError::EnergyGain { .. } | StepError::Solve { .. }
    );
    lost.then(|| (case.run.steps.len(), error.to_string()))
}

/// The first step for which `of` gives numbers.
pub(super) fn first(case: &Case, of: impl Fn(usize, &Moment) -> Option<String>) -> Fault {
    first_of(&case.run, of)
}

/// The first step of a run for which `of` gives numbers.
pub(super) fn first_of(run: &Run, of: impl Fn(usize, &Moment) -> Option<String>) -> Fault {
    let steps = run.steps.iter().enumerate();
    steps.filter_map(|(n, m)| Some((n, of(n, m)?))).next()
}

fn is_finite(case: &Case) -> Fault {
    first(case, |_, m| {
        let all = m.bodies.position.iter().chain(&m.bodies.velocity);
        let finite = all.flatten().all(|x| x.is_finite());
        let balance = m.report.balance?;
        let sums = [balance.gained, balance.work, balance.excess];
        (!finite || !sums.iter().all(|x| x.is_finite())).then(|| format!("{balance:?}"))
    })
}

/// True if a rope closed or opened, a drum slipped, shapes met, an event fired or the guard stepped
/// in up to step `n`.
fn shocked(case: &Case, n: usize) -> bool {
    let steps = &case.run.steps[..=n];
    let place = |p: &Part| (p.tension > 0.0, p.tension >= p.holds * (1.0 - 1e-9));
    let taut = |m: &Moment| m.parts.iter().map(place).collect::<Vec<_>>();
    let other = |pair: &[Moment]| {
        taut(&pair[0]) != taut(&pair[1])
            || pair[0].report.contacts.touching != pair[1].report.contacts.touching
            || presses(&pair[0]) != presses(&pair[1])
    };
    let sudden = |m: &Moment| m.report.redone || m.report.events > 0 || m.report.undecided > 0;
    steps.iter().any(sudden) || steps.windows(2).any(other)
}

/// True if shapes press on each other within the step.
fn presses(m: &Moment) -> bool {
    m.contacts.iter().any(|c| c.force.norm() > 0.0)
}

/// Documented accuracy of the balance in shocks, and elsewhere.
const SHOCK: f64 = 4e-2;
const SMOOTH: f64 = 1e-3;
/// Ω from which the guard divides steps in which a shape is thrown back under a rope.
const SWINGS: f64 = 0.1;
/// Most that a tumbling body may gain in a bounce, as the limits say: the band that its free
/// rotation keeps its energy in.
const TUMBLING: f64 = 1e-3;

/// (Ω Δt)² of the fastest ringing of a load on its ropes without mass, or above: of the stiffnesses' sum.
pub(super) fn ringing(case: &Case) -> f64 {
    let masses = case.scene.dynamic_bodies();
    let masses = masses.map(|i| case.scene.bodies.mass[i]);
    let lightest = masses.fold(f64::INFINITY, f64::min);
    let steps = case.run.steps.first().into_iter().flat_map(|m| &m.parts);
    let stiffness: f64 = steps.map(|p| 1.0 / p.compliance.max(1e-300)).sum();
    stiffness / lightest / (RATE * RATE)
}

/// Part of the energy of its rope's ringing that a step does not see: velocities half a step before
/// and after have a mean that is less by (Ω Δt)²/8.
fn rings(case: &Case) -> f64 {
    (0.25 * ringing(case)).min(1.0)
}

/// Largest square of the angle \[rad²] that bodies which touch, or a contact's normal, turn by in a
/// sub-step up to step `n`: the relative error of a step in which shapes roll on each other.
fn turns(case: &Case, n: usize) -> f64 {
    let substeps = case.choices.steps.substeps as f64;
    let mut most = 0.0_f64;
    for pair in case.run.steps[..=n].windows(2) {
        let (before, now) = (&pair[0].contacts, &pair[1]);
        for contact in now.contacts.iter().filter(|c| c.force.norm() > 0.0) {
            let last = before.iter().filter(|c| c.bodies == contact.bodies);
            let turned = last.map(|c| c.normal.cross(&contact.normal).norm());
            let spin = |i: &usize| now.bodies.angular_velocity[*i].norm() / RATE;
            let spins: f64 = contact.bodies.iter().flatten().map(spin).sum();
            most = most.max(turned.fold(spins, f64::max) / substeps);
        }
    }
    most * most
}

/// Work of the contacts' forces over their gaps in step `n`, and of the weight over the largest gap
/// up to the next step of contacts that press in two steps in a row \[J]. A shape that rolls on a
/// round body leaves it by the square of its turn.
fn apart(case: &Case, n: usize) -> f64 {
    fn press(m: &Moment) -> impl Iterator<Item = &ContactForce> {
        m.contacts.iter().filter(|c| c.force.norm() > 0.0)
    }
    let steps = &case.run.steps;
    let works = press(&steps[n]).map(|c| c.gap.abs() * c.force.norm());
    let works: f64 = works.sum();
    let pairs = steps[..steps.len().min(n + 2)].windows(2);
    let gaps = pairs.flat_map(|pair| {
        let rests = |c: &&ContactForce| press(&pair[0]).any(|old| old.bodies == c.bodies);
        press(&pair[1])
            .filter(rests)
            .map(|c| c.gap)
            .collect::<Vec<_>>()
    });
    works + case.scene.mass() * G * gaps.fold(0.0, f64::max)
}

/// Most elastic energy of the ropes without mass up to step `n` \[J].
fn strained(case: &Case, n: usize) -> f64 {
    let of = |m: &Moment| -> f64 {
        let parts = m.parts.iter();
        parts
            .map(|p| 0.5 * p.compliance * p.tension * p.tension)
            .sum()
    };
    let steps = &case.run.steps[..=n];
    steps.iter().map(of).fold(case.stretched, f64::max)
}

/// Work of ropes and links in half a step \[J], where the guard took over or gave back up to step
/// `n`. An implicit step has the force of its end, a step of the scheme that of its beginning, so
/// that one force counts twice or not at all.
fn handed_over(case: &Case, n: usize) -> f64 {
    let half = 0.5 / (RATE * case.choices.steps.substeps as f64);
    let of = |m: &Moment| -> f64 {
        let bodies = m.bodies.velocity.iter().zip(&m.sizes);
        bodies.map(|(v, size)| v.norm() * size * half).sum()
    };
    let pairs = case.run.steps[..=n].windows(2);
    let guarded = |m: &Moment| m.report.implicit_substeps > 0;
    let over = pairs.filter(|pair| guarded(&pair[0]) != guarded(&pair[1]));
    over.map(|pair| of(&pair[0])).fold(0.0, f64::max)
}

/// Gain of slow bounces under a rope that swings with Ω up to step `n` \[J]: below g Δt they divide no step, and take up Ω²/3 of
/// their energy each.
fn bounced(case: &Case, n: usize) -> f64 {
    if case.choices.restitution == 0.0 {
        return 0.0;
    }
    let pairs = case.run.steps[..=n].windows(2);
    let bounces = pairs.filter(|pair| presses(&pair[1]) && !presses(&pair[0]));
    let bounces = bounces.count() as f64;
    let slowest = G / case.rate();
    let energy = 0.5 * case.scene.mass() * slowest * slowest;
    bounces * energy * (ringing(case) / 3.0).min(1.0)
}

/// The first step of a scene without the guard after which a body turns by more than 0.1 rad in a sub-step, or in which a shape is
/// thrown back under a rope that swings noticeably within a step: what the guard is for.
fn resolved(case: &Case) -> usize {
    let (steps, c) = (&case.run.steps, &case.choices);
    let segments = c.rope.as_ref().is_some_and(|r| r.segments.is_some());
    let swings = c.restitution > 0.0 && (segments || ringing(case) > SWINGS * SWINGS);
    if c.steps.guard || !segments && !swings {
        return steps.len();
    }
    let beyond = |m: &Moment| segments && spins(case, m) || swings && presses(m);
    steps.iter().position(beyond).unwrap_or(steps.len())
}

/// True if a body turns by more than 0.1 rad in a sub-step, which needs the guard.
fn spins(case: &Case, m: &Moment) -> bool {
    let mut spins = m.bodies.angular_velocity.iter().map(Vector3::norm);
    spins.any(|spin| spin > 0.1 * case.rate())
}

/// Energy of the strained rope that drums wind up, which the balance leaves out: half the strain times their work \[J].
fn wound_up(case: &Case, n: usize) -> f64 {
    let winds = |c: &Choices| {
        let rope = c.rope.as_ref();
        rope.is_some_and(|r| r.winch.is_some() || matches!(r.end, End::Drum(_)))
    };
    if !winds(&case.choices) {
        return 0.0;
    }
    let steps = &case.run.steps[..=n];
    let strain = |p: &Part| p.compliance * p.tension / p.length;
    let strains = steps.iter().flat_map(|m| &m.parts).map(strain);
    let works = steps.iter().filter_map(|m| m.report.balance);
    let work = works.map(|b| b.work.abs()).fold(0.0, f64::max);
    0.5 * strains.fold(0.0, f64::max) * work
}

fn balance(case: &Case) -> Fault {
    let resolved = resolved(case);
    first(case, |n, m| {
        let balance = m.report.balance.filter(|_| n < resolved)?;
        let rough = balance.excess > SMOOTH && (rings(case) > SMOOTH || shocked(case, n));
        let most = if rough { SHOCK } else { SMOOTH };
        let most = if balance.excess > most {
            let rings = rings(case) * strained(case, n);
            let joules = wound_up(case, n) + rings + handed_over(case, n) + apart(case, n);
            let joules = joules + bounced(case, n);
            most + joules / balance.scale + turns(case, n)
        } else {
            most
        };
        (balance.excess > most).then(|| format!("{balance:?}, allowed {most:e}"))
    })
}

/// Kinetic energy and that of taut ropes without mass at the beginning of step `n` \[J], and both with that of gravity.
fn energy(case: &Case, n: usize) -> (f64, f64) {
    // Velocities stand half a sub-step before the beginning; the first are given there. So may be those that a divided step left.
    let late = 0.5 / case.choices.steps.substeps as f64;
    match n
        .checked_sub(1)
        .map(|last| case.run.steps[last].report.divided)
    {
        None => energy_with(case, n, 0.0),
        Some(0) => energy_with(case, n, late),
        Some(_) => {
            let both = [0.0, late].map(|part| energy_with(case, n, part));
            if both[0].1 < both[1].1 {
                both[0]
            } else {
                both[1]
            }
        }
    }
}

/// [`energy`] with the `part` of the step's change of velocities that stands between them and the beginning.
fn energy_with(case: &Case, n: usize, part: f64) -> (f64, f64) {
    let (before, after) = (case.before(n), &case.run.steps[n].bodies);
    let mut middle = case.scene.clone();
    middle.bodies = before.clone();
    for i in middle.dynamic_bodies().collect::<Vec<_>>() {
        let bodies = &mut middle.bodies;
        bodies.velocity[i] += (after.velocity[i] - before.velocity[i]) * part;
        // Bodies turn freely after the forces of the beginning: by the momentum they have then.
        if let Some(inverse) = before.inertia_world(i).try_inverse() {
            let momentum = after.inertia_world(i) * after.angular_velocity[i];
            bodies.angular_velocity[i] += (inverse * momentum - before.angular_velocity[i]) * part;
        }
    }
    let now = &case.run.steps[n];
    // By its path and by its force, the lesser: a stiff rope rings in its path, a damper pulls besides.
    let stored = |p: &Part| {
        let tension = now.part(&p.name).map_or(0.0, |p| p.tension.max(0.0));
        let by_path = 0.5 * p.phi.max(0.0).powi(2) / p.compliance.max(1e-300);
        by_path.min(0.5 * p.compliance * tension * tension)
    };
    let parts = n.checked_sub(1).map(|last| &case.run.steps[last].parts);
    let elastic: f64 = match parts {
        Some(parts) => parts.iter().map(stored).sum(),
        None => case.stretched,
    };
    let kinetic = middle.kinetic_energy();
    (
        kinetic + elastic,
        kinetic + middle.potential_energy() + elastic,
    )
}

/// True if shapes press on each other in step `n` or one of its neighbours: velocities jump there.
fn touches(case: &Case, n: usize) -> bool {
    let near = case.run.steps[n.saturating_sub(1)..].iter().take(3);
    near.flat_map(|m| &m.contacts).any(|c| c.force.norm() > 0.0)
}

/// Beyond the balance's accuracy: a tenth of a millimetre of the scene's weight, as far as surfaces give way.
fn passive_energy(case: &Case) -> Fault {
    let c = &case.choices;
    let massless = c.rope.as_ref().is_none_or(|r| r.segments.is_none());
    if !c.is_passive() || !massless || c.load.mass > 1e12 {
        return None;
    }
    let (start, mut scale, mut shock) = (energy(case, 0), 0.0_f64, false);
    let rings = rings(case);
    let weight = case.scene.mass() * G;
    for n in 1..resolved(case) {
        let m = &case.run.steps[n];
        shock |= m.report.redone || m.report.events > 0;
        let blows = c.restitution > 0.0 && touches(case, n);
        // Half of the change of velocities in a step that is divided is not its first half kick.
        let begins = m.report.divided > 0 && case.run.steps[n - 1].report.divided == 0;
        if blows || begins || m.report.redone || m.report.asleep {
            continue;
        }
        let (kinetic, total) = energy(case, n);
        scale = scale.max(kinetic).max(start.0);
        let sudden = shock || rings > SMOOTH || shocked(case, n);
        let part = if sudden { SHOCK } else { SMOOTH } + turns(case, n);
        let pressed = apart(case, n);
        // Gravity acts on what is let go from half a step before on.
        let late = if case.run.steps[..=n].iter().any(|m| m.report.events > 0) {
            let fastest = (2.0 * scale / case.scene.mass()).sqrt();
            weight * (0.5 * fastest / RATE + 0.125 * G / (RATE * RATE))
        } else {
            0.0
        };
        let allowed = part * scale + 1e-5 * weight + pressed + rings * strained(case, n) + late;
        let gain = total - start.1;
        if gain > allowed {
            return Some((
                n,
                format!("{gain:.3e} J above the start, allowed {allowed:.3e} J"),
            ));
        }
    }
    None
}

/// A body by itself above the ground.
fn is_single(c: &Choices) -> bool {
    c.rope.is_none() && c.other.is_none() && c.attach.is_none() && c.ground.is_some()
}

/// True if the load flies freely through step `n`: gravity alone changes its velocity.
fn flies(case: &Case, n: usize) -> bool {
    let (load, after) = (case.load(), &case.run.steps[n].bodies);
    let change = after.velocity[load] - case.before(n).velocity[load];
    // The first velocities stand at the beginning of the step, later ones half a sub-step before.
    let part = if n == 0 {
        1.0 - 0.5 / case.choices.steps.substeps as f64
    } else {
        1.0
    };
    (change - case.scene.gravity * (part / RATE)).norm() < 1e-6
}

fn bounce_energy(case: &Case) -> Fault {
    if !is_single(&case.choices) {
        return None;
    }
    let c = &case.choices;
    // Measured from the body's lowest place.
    let floor = case.scene.mass() * G * lowest(case);
    let mut last = energy(case, 0).1 - floor;
    for n in 1..case.run.steps.len() {
        if !flies(case, n) {
            continue;
        }
        let now = energy(case, n).1 - floor;
        if now > last * (1.0 + TUMBLING) + 1e-4 * c.weight() {
            return Some((
                n,
                format!("{now:.4e} J after {last:.4e} J: {:.4}", now / last),
            ));
        }
        last = now;
    }
    None
}

/// Least height of the load's centre \[m].
fn lowest(case: &Case) -> f64 {
    let load = case.load();
    let heights = case.run.steps.iter().map(|m| m.bodies.position[load].z);
    heights.fold(f64::INFINITY, f64::min)
}

/// Height of the first bounce: within a hundredth of e² h, with the yielding of the surface and
/// the time of the blow besides.
fn rebound(case: &Case) -> Fault {
    let c = &case.choices;
    let ground = c.ground.filter(|g| g.slope == 0.0)?;
    if !is_single(c) || c.load.form != Form::Ball || c.load.turned != [0.0; 2] {
        return None;
    }
    let [_, _, up] = c.load.velocity;
    let drop = ground.below + up * up / (2.0 * G);
    let load = case.load();
    let rest = case.scene.bodies.position[load].z - ground.below;
    let hit = (0..case.run.steps.len()).find(|n| !flies(case, *n))?;
    let flight = (hit + 1..case.run.steps.len()).take_while(|n| flies(case, *n));
    let flight = flight.map(|n| &case.run.steps[n]);
    // By its energy: it may come up higher between two steps. Velocities stand half a sub-step before the end.
    let half = 0.5 / (RATE * c.steps.substeps as f64);
    let apex = flight.map(|m| {
        let speed = m.bodies.velocity[load].z - G * half;
        m.bodies.position[load].z - rest + 0.5 * speed * speed / G
    });
    let apex = apex.fold(0.0, f64::max);
    let expected = c.restitution * c.restitution * drop;
    // The step knows the time of the blow to a step of free fall.
    let fall = G / (RATE * RATE);
    let allowed = 0.01 * expected + 1e-10 * c.weight() + fall * half * RATE;
    let off = (apex - expected).abs();
    (drop > 0.05 && off > allowed).then(|| {
        let text = format!("apex {apex:.4} m, e² h = {expected:.4} m, h = {drop:.4} m");
        (hit, text)
    })
}

/// m Δv of each body against gravity, constraints and contacts: to the angle that ropes turn by in the step. Sub-steps are
/// steps here: means of forces over them have the directions of the last one.
fn momentum(case: &Case) -> Fault {
    let c = &case.choices;
    if c.load.mass > 1e12 {
        return None;
    }
    let (run, rate) = (case.fine()?, case.rate());
    let gravity = case.scene.gravity;
    let mut held = case.scene.constraints.iter();
    let held = held.any(|c| c.frames().iter().any(|f| f.body_index().is_none()));
    // Ties to the world come later.
    let held = held || !case.scene.events.is_empty();
    first_of(run, |n, m| {
        // The first step begins at the velocities' own time.
        let before = &run.steps[n.checked_sub(1)?].bodies;
        // A divided step leaves velocities of its end to the next one. So does one after which something was let go, or a drive
        // jumped under what stands on it.
        let divided = |n: usize| {
            let report = &run.steps[n].report;
            report.divided > 0 || report.events > 0
        };
        let sudden = m.report.asleep || divided(n) || divided(n - 1);
        if sudden || before.len() != m.bodies.len() {
            return None;
        }
        let mut left = Vector3::zeros();
        let mut scale = 0.0;
        for i in case.scene.dynamic_bodies().filter(|i| *i < m.forces.len()) {
            let mass = m.bodies.mass[i];
            let change = (m.bodies.velocity[i] - before.velocity[i]) * mass * rate;
            left += change - gravity * mass - m.forces[i];
            // A swing that turns back within the step is not seen in its way.
            let speed = m.bodies.velocity[i].norm() + before.velocity[i].norm();
            let turn = (speed + m.bodies.angular_velocity[i].norm()) / rate;
            let moves = m.bodies.velocity[i].norm() * mass * rate;
            let angle = if held { (10.0 * turn).min(2.0) } else { 0.0 };
            scale += m.sizes[i] * (angle + 1e-9) + 1e-10 * (moves + mass * G);
        }
        (left.norm() > scale)
            .then(|| format!("{:.3e} N left over, allowed {scale:.3e} N", left.norm()))
    })
}

/// The joint at the load tells a pull although the segment above is pushed, or a cable breaks in compression.
fn pushed(case: &Case) -> Fault {
    let weight = case.choices.weight();
    let run = case.fine()?;
    // Segments that whirl are pulled at one end and pushed at the other.
    let whirls = |m: &Moment| !case.choices.steps.guard && spins(case, m);
    let steady = run.steps.iter().position(whirls).unwrap_or(run.steps.len());
    first_of(run, |n, m| {
        if n >= steady {
            return None;
        }
        if let Some([at_end, within, _]) = m.column
            && within < -0.1 * weight
            && at_end > 0.1 * weight
        {
            return Some(format!(
                "tension {at_end:.3e} N at the end, {within:.3e} N in the last segment"
            ));
        }
        let broken = m.fired.iter().any(|name| name.contains("breaks"));
        // A blow may begin and end in the step that breaks it, of which what is left tells.
        let [.., before] = run.steps[n.checked_sub(1)?].column?;
        let most = m.column.map_or(before, |[.., most]| before.max(most));
        (broken && most < 0.0).then(|| {
            let (names, forces) = (&m.fired, &m.fired_forces);
            format!("{names:?} by {forces:?} N, {most:.3e} N at most")
        })
    })
}

/// Order of convergence of a case in which nothing is sudden and no rope rings faster than the steps of the halvings, relaxes
/// within them or is slack: the binary logarithm of how many times less the second halving of the step changes than the first.
pub fn order(case: &Case) -> Option<f64> {
    let steps = case.run.steps.len().checked_sub(1)?;
    let [first, second] = (*case.halvings.get()?)?;
    let rope = case.choices.rope.as_ref();
    let finest = paired::coarsest(case) as f64;
    let rings = rope.is_some_and(|r| r.slack > 0.0 || r.segments.is_some())
        || ringing(case) > (paired::RESOLVED * finest).powi(2)
        || paired::relaxes(case);
    let touches = case.run.steps[0].report.contacts.touching > 0;
    let smooth = !shocked(case, steps) && !touches && !rings;
    (smooth && second > 1e-9).then(|| (first / second).log2())
}
