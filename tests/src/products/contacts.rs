//! Invariants of friction at contacts.

use super::invariants::{Fault, first_of};
use super::run::Case;
use super::{G, Other, RATE};

pub(super) fn cone(case: &Case) -> Fault {
    let (noise, friction) = (1e-6 * case.choices.weight(), case.choices.friction);
    first_of(case.fine()?, |_, m| {
        if m.report.undecided > 0 || m.report.contacts.softened > 0 || !m.is_one_solve() {
            return None;
        }
        m.contacts.iter().find_map(|c| {
            let normal = c.force.dot(&c.normal);
            let across = (c.force - c.normal * normal).norm();
            let beyond = normal < -noise || across > friction * normal * (1.0 + 1e-6) + noise;
            beyond.then(|| format!("normal {normal:e} N, friction {across:e} N, μ = {friction}"))
        })
    })
}

/// The step's law, of the velocity that it takes to slip in the middle of the step; blows have
/// another. With the residual r of a contact whose impulse p moves itself by w p, the projection
/// z = w p − r of w p − u onto the cone has u·z ≤ r·z, so that
///
/// ```text
/// w p·u ≤ r·(u + w p) − r²,      p·u ≤ |r| |p| + (|r|/w) |u|
/// ```
///
/// The report tells the largest r Δt and r/(w Δt).
pub(super) fn work(case: &Case) -> Fault {
    let c = &case.choices;
    if c.restitution > 0.0 {
        return None;
    }
    first_of(case.fine()?, |_, m| {
        if m.report.undecided > 0 || !m.is_one_solve() || m.report.asleep {
            return None;
        }
        let left = &m.report.contacts;
        let after = &m.bodies;
        // Rounding of velocities and forces, in sums of some numbers of this size.
        let speed = |i: usize| after.velocity[i].norm() + after.angular_velocity[i].norm();
        let bodies = (0..after.len()).filter(|i| after.is_dynamic(*i));
        let fastest = bodies.map(speed).fold(1.0, f64::max);
        m.contacts.iter().find_map(|c| {
            let across = c.force - c.normal * c.normal.dot(&c.force);
            let (size, power) = (across.norm(), across.dot(&c.slip));
            let rate = left.residual_gap * case.rate() + 1e-12 * fastest;
            let residual = left.residual_force + 1e-14 * c.force.norm();
            let allowed = size * rate + residual * c.slip.norm();
            (power > allowed).then(|| {
                let slip = c.slip.norm();
                format!(
                    "friction {size:e} N, slip {slip:e} m/s: {power:e} W, allowed {allowed:e} W"
                )
            })
        })
    })
}

/// Where friction holds it with room to spare: a circle in steps is one to the second order.
pub(super) fn ride(case: &Case) -> Fault {
    let c = &case.choices;
    let Some(Other::Turntable { rate, radius }) = c.other else {
        return None;
    };
    if rate * rate * radius > 0.7 * c.friction * G || c.attach.is_some() {
        return None;
    }
    let (load, time) = (case.load(), case.run.steps.len() as f64 / RATE);
    let last = case.run.steps.last()?;
    let centre = case.scene.bodies.position[case.scene.body("table").ok()?];
    let arm = (last.bodies.position[load] - centre).xy().norm();
    // 0.1 mm a minute at 0.1 rad/s and 20 m, in the proportion of an error of second order.
    let drift = 1e-4 / 60.0 * (rate / 0.1).powi(3) * (radius / 20.0);
    let allowed = drift * time + 1e-6 * radius;
    let off = (arm - radius).abs();
    (off > allowed).then(|| {
        let text =
            format!("{off:.3e} m outwards at {rate} rad/s and {radius} m, allowed {allowed:.1e} m");
        (case.run.steps.len(), text)
    })
}
