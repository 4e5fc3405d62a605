//! H30: masses over a sheave, block and tackle: cables that slide through points without friction.
//!
//! Atwood's machine: a = g (m₁ − m₂)/(m₁ + m₂), the sheave being a point without inertia. With a sheave of inertia I
//! and radius r, a = g (m₁ − m₂)/(m₁ + m₂ + I/r²): a disc with two cables that leave its rim, exact as long as they
//! are tangent to it, that is in the first step. Tackle of n parts: each carries T = W/n; what is hauled in lifts the
//! block by 1/n; the sum of the spans is the cable's length at all times.

use crate::hard::{each_solver, solvers, together};
use indicatif::ProgressBar;
use nalgebra::{Matrix3, Vector3};
use taut_integrator::{Stepper, static_equilibrium};
use taut_model::{Body, Constraint, Frame, Hinge, MasslessCable, RowLaw, Scene, Winch, axes_along};
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_solver::Backend;

const GRAVITY: f64 = 10.0;
const DT: f64 = 1.0 / 60.0;
/// Largest relative error that passes.
const BAR: f64 = 1e-8;

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = atwood()?;
    checks.extend(sheave()?);
    for parts in 2..=12 {
        checks.extend(tackle(parts)?);
    }
    Ok(checks.into())
}

/// The masses \[kg] of Atwood's machine, and the inertia \[kg m²] and radius \[m] of its sheave.
const HEAVY: f64 = 3.0;
const LIGHT: f64 = 2.0;
const SHEAVE: f64 = 0.05;
const RADIUS: f64 = 0.2;

/// Two masses over a point of the world.
fn over_a_point() -> Scene {
    let mut scene = Scene::new("atwood");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let mut hang = |name: &str, mass: f64, depth: f64| {
        let body = Body::particle(mass).at(Vector3::new(0.0, 0.0, -depth));
        Frame::body(scene.add_body(name, body), Vector3::zeros())
    };
    let frames = vec![
        hang("heavy", HEAVY, 2.0),
        Frame::world(Vector3::zeros()),
        hang("light", LIGHT, 5.0),
    ];
    let cable = MasslessCable::new(frames, 7.0, RowLaw::RIGID);
    scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    scene
}

/// Two masses on a disc that turns about y, at rest.
fn over_a_sheave() -> Scene {
    let mut scene = Scene::new("atwood with a sheave");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let axes = axes_along(&Vector3::y()).unwrap_or_else(taut_model::hanging_axes);
    let inertia = Matrix3::from_diagonal(&Vector3::repeat(SHEAVE));
    let disc = scene.add_body("sheave", Body::new(5.0, inertia));
    let frames = [
        Frame::world(Vector3::zeros()).with_axes(axes),
        Frame::body(disc, Vector3::zeros()).with_axes(axes),
    ];
    scene.add_constraint("axle", Constraint::Hinge(Hinge::new(frames)), 0);
    for (name, mass, side) in [("heavy", HEAVY, -1.0), ("light", LIGHT, 1.0)] {
        let rim = Vector3::x() * (side * RADIUS);
        let depth = Vector3::z() * 3.0;
        let body = scene.add_body(name, Body::particle(mass).at(rim - depth));
        let frames = vec![Frame::body(disc, rim), Frame::body(body, Vector3::zeros())];
        let cable = MasslessCable::new(frames, 3.0, RowLaw::RIGID);
        scene.add_constraint(name, Constraint::MasslessCable(cable), 0);
    }
    scene
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let mut hauled = block(4, RowLaw::RIGID);
    hauled.set_control(0, 0.6, 0.0);
    Ok(vec![over_a_point(), over_a_sheave(), hauled])
}

/// The acceleration of the first step.
fn sheave() -> Result<Vec<Check>, ExperimentError> {
    let inert = HEAVY + LIGHT + SHEAVE / (RADIUS * RADIUS);
    let exact = GRAVITY * (HEAVY - LIGHT) / inert;
    let mut found = Vec::new();
    for choice in solvers() {
        let mut stepper = Stepper::new(over_a_sheave(), choice.options(DT))?;
        // The first step itself starts half a step back, and ends half a step on.
        stepper.step()?;
        let ours = -2.0 * stepper.scene().bodies.velocity[1].z / DT;
        let check = Check::relative("", [exact, ours], "m/s²", BAR);
        found.push((choice.family(), check));
    }
    let rows = together("Atwood's machine, sheave with inertia, first step", found);
    let note = "a sheave here is a point: a cable does not wind on a rim as the disc turns";
    let noted = |c: Check| {
        let both = [c.note.as_str(), note].join("; ");
        c.noting(both)
    };
    Ok(rows.into_iter().map(noted).collect())
}

fn atwood() -> Result<Vec<Check>, ExperimentError> {
    let scene = over_a_point();
    let exact = GRAVITY * (HEAVY - LIGHT) / (HEAVY + LIGHT);
    each_solver("Atwood's machine", |choice| {
        let mut stepper = Stepper::new(scene.clone(), choice.options(DT))?;
        let steps = 30_u32;
        for _ in 0..steps {
            stepper.step()?;
        }
        let time = f64::from(steps) * DT;
        let fallen = -2.0 - stepper.scene().bodies.position[0].z;
        let ours = 2.0 * fallen / (time * time);
        Ok(Check::relative("", [exact, ours], "m/s²", BAR))
    })
}

/// A block that hangs in `parts` vertical falls of one cable, 0.1 m apart, and a control that hauls it in.
fn block(parts: usize, law: RowLaw) -> Scene {
    let (mass, drop) = (500.0, 4.0);
    let mut scene = Scene::new("tackle");
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let body = Body::cuboid(Vector3::new(1.5, 0.4, 0.4), mass).at(Vector3::new(0.0, 0.0, -drop));
    let body = scene.add_body("block", body);
    scene.load = Some(body);
    let mut frames = Vec::new();
    for k in 0..parts {
        let x = Vector3::x() * (0.1 * (k as f64 - 0.5 * (parts - 1) as f64));
        let mut ends = [Frame::world(x), Frame::body(body, x)];
        if k % 2 == 1 {
            ends.reverse();
        }
        frames.extend(ends);
    }
    let length = parts as f64 * drop + 0.1 * (parts - 1) as f64;
    let cable = MasslessCable {
        winch: Some(Winch::new()),
        ..MasslessCable::new(frames, length, law)
    };
    scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    scene.controls.push(super::hauling("haul"));
    scene
}

fn tackle(parts: usize) -> Result<Vec<Check>, ExperimentError> {
    let weight = 500.0 * GRAVITY;
    let share = weight / parts as f64;
    let compliance = 1e-6;
    let (mut tension, mut lifted, mut spans) = (Vec::new(), Vec::new(), Vec::new());
    for choice in solvers() {
        let scene = block(parts, RowLaw::new(compliance, 0.0));
        let scene = static_equilibrium(scene, &Backend::Banded)?;
        // The solver's own step from there.
        let mut stepper = Stepper::new(scene, choice.options(DT))?;
        stepper.step()?;
        let ours = -stepper.multipliers()[0] / DT;
        tension.push((
            choice.family(),
            Check::relative("", [share, ours], "N", BAR).by("tension of a part, relative to W/n"),
        ));

        let (speed, time) = (0.6, 1.0);
        let mut stepper = Stepper::new(block(parts, RowLaw::RIGID), choice.options(DT))?;
        stepper.set_control(0, speed)?;
        while stepper.time() < time - 0.5 * DT {
            stepper.step()?;
        }
        // A winch that starts at once leaves the spans half a step behind at first: the end counts.
        let slack = stepper.linearized().phi[0].abs();
        let rise = stepper.scene().bodies.position[0].z + 4.0;
        let exact = speed * time / parts as f64;
        let by = "relative, once the spans add up to the length";
        lifted.push((
            choice.family(),
            Check::relative("", [exact, rise], "m", BAR).by(by),
        ));
        let by = "sum of the spans less the length";
        spans.push((
            choice.family(),
            Check::off("", "the length", slack, "m", BAR).by(by),
        ));
    }
    let mut checks = together(&format!("{parts} parts at rest"), tension);
    checks.extend(together(&format!("{parts} parts, 0.6 m hauled in"), lifted));
    checks.extend(together(&format!("{parts} parts, then their spans"), spans));
    Ok(checks)
}
