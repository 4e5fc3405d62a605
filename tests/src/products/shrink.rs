//! Smaller choices with the same violation.

use super::invariants::{Outcome, Violation, judge};
use super::{Choices, End, Form, Other, Rope};

/// Judgements that a search may take.
const MOST: usize = 200;

/// Drops features and halves numbers as long as the same invariant stays violated.
pub fn smallest(choices: &Choices, violation: &Violation) -> (Choices, Violation) {
    let (mut best, mut found) = (choices.clone(), violation.clone());
    let mut left = MOST;
    loop {
        let smaller = candidates(&best).into_iter().find_map(|c| {
            left = left.checked_sub(1)?;
            match judge(&c) {
                Outcome::Violated(v) if v.invariant == found.invariant => Some((c, v)),
                _ => None,
            }
        });
        match smaller {
            Some((c, v)) => (best, found) = (c, v),
            None => return (best, found),
        }
    }
}

/// A step to something plainer.
type Change = fn(&mut Choices);

const DROPS: [Change; 26] = [
    |c| c.other = None,
    |c| c.ground = None,
    |c| c.rope = None,
    |c| c.release = None,
    |c| c.attach = None,
    |c| c.gravity = true,
    |c| c.steps.estimate = false,
    |c| c.steps.sleep = false,
    |c| c.steps.guard = true,
    |c| c.steps.substeps = 1,
    |c| c.friction = 0.5,
    |c| c.restitution = 0.0,
    |c| c.load.mass = 100.0,
    |c| c.load.form = Form::Ball,
    |c| c.load.velocity = [0.0; 3],
    |c| c.load.spin = [0.0; 3],
    |c| c.load.turned = [0.0; 2],
    |c| of_rope(c, |r| r.end = End::World),
    |c| of_rope(c, |r| r.sheave = None),
    |c| of_rope(c, |r| r.winch = None),
    |c| of_rope(c, |r| r.segments = None),
    |c| of_rope(c, |r| r.breaks = None),
    |c| of_rope(c, |r| (r.slack, r.aside) = (0.0, 0.0)),
    |c| of_rope(c, |r| r.aside = 0.0),
    |c| of_rope(c, |r| r.damping = 0.0),
    |c| of_rope(c, |r| r.strain = 1e-3),
];

const HALVES: [Change; 10] = [
    |c| c.load.mass *= 0.5,
    |c| c.load.velocity = c.load.velocity.map(|v| half(v, 0.05)),
    |c| c.load.spin = c.load.spin.map(|v| half(v, 0.05)),
    |c| c.load.turned = c.load.turned.map(|v| half(v, 0.02)),
    |c| of_rope(c, |r| r.slack = half(r.slack, 0.01)),
    |c| of_rope(c, |r| r.aside = half(r.aside, 0.01)),
    |c| of_rope(c, |r| r.damping = half(r.damping, 0.01)),
    |c| {
        if let Some(g) = &mut c.ground {
            (g.below, g.slope) = (half(g.below, 1e-3), half(g.slope, 0.05));
        }
    },
    |c| {
        if let Some(Other::Under {
            ratio, off, gap, ..
        }) = &mut c.other
        {
            (*ratio, *off, *gap) = (
                half(*ratio - 1.0, 0.1) + 1.0,
                half(*off, 1e-3),
                half(*gap, 1e-3),
            );
        }
    },
    |c| {
        if let Some(Other::Turntable { rate, radius }) = &mut c.other {
            (*rate, *radius) = (half(*rate, 0.1), half(*radius - 1.0, 0.1) + 1.0);
        }
    },
];

fn of_rope(c: &mut Choices, change: impl Fn(&mut Rope)) {
    if let Some(rope) = &mut c.rope {
        change(rope);
    }
}

/// Half of it, or nothing where that is little.
fn half(x: f64, least: f64) -> f64 {
    if x.abs() < least { 0.0 } else { 0.5 * x }
}

fn candidates(choices: &Choices) -> Vec<Choices> {
    let changes = DROPS.iter().chain(&HALVES);
    let made = changes.map(|change| {
        let mut c = choices.clone();
        change(&mut c);
        c.settled()
    });
    made.filter(|c| c != choices && c.load.mass >= 1.0)
        .collect()
}
