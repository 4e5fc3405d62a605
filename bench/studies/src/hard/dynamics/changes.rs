//! H59: what is hooked on, let go, cut, or breaks while it moves.
//!
//! A load let go at rest falls by n(n + 1)/2 g Δt² in n steps of v⁺ = v − g Δt, x⁺ = x + Δt v⁺. Where one of two equal
//! ropes breaks, the other goes from W/2 to the new rest at W and as far beyond, to 3/2 W. A body of mass m₁ and speed v that
//! catches one of m₂ at rest goes on with it: the momentum stays, and m₁² v²/(2(m₁ + m₂)) of the energy. A cut is no force:
//! momentum and angular momentum are those before, and the steps after it turn no more than those before, whose forces act
//! at the beginning of a step.

use crate::hard::{DT, GRAVITY, at, either, under_gravity, worse};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use taut_integrator::{Edit, StepError, StepOptions, Stepper};
use taut_model::{
    Action, Body, Cable, CableEnd, Constraint, Distance, Event, Frame, HoistParams, Material,
    RowLaw, Scene, Segments, When,
};
use taut_output::check::{Check, ExperimentError, Outcome};

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let hooked = hooked(either(quick, 500, 10_000))?;
    Ok([let_go()?, broken()?, caught()?, cut()?, hooked]
        .concat()
        .into())
}

/// Each scene at its beginning.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![twins(), spinning()?])
}

fn let_go() -> Result<Vec<Check>, ExperimentError> {
    let params = HoistParams {
        mass_ratio: 1e6,
        ..HoistParams::default()
    };
    let mut stepper = Stepper::new(params.hanging_equilibrium()?, at(DT))?;
    let load = stepper.body("load")?;
    let place = |stepper: &Stepper| {
        let number = stepper.body_index(load)?;
        Ok::<_, StepError>(stepper.scene().bodies.position[number])
    };
    // Before the first step a scheme with velocities between the steps would let it fall by ½ g t² from rest.
    stepper.step()?;
    stepper.change(|edit| edit.remove_constraint(edit.constraint("load")?))?;
    let start = place(&stepper)?;
    let mut off = 0.0;
    for n in 1..=60 {
        stepper.step()?;
        let fallen = 0.5 * f64::from(n * (n + 1)) * GRAVITY * DT * DT;
        let exact = start - Vector3::z() * fallen;
        off = worse(off, (place(&stepper)? - exact).norm());
    }
    let case = "a load of 10⁶ segments' masses let go: fall over a second";
    let check = Check::off(case, "n(n + 1)/2 g Δt²", off, "m", 1e-12);
    Ok(vec![check.by("largest distance from it")])
}

/// 100 kg on two equal links side by side, 5 Hz on one of them, of which one is cut after 0.1 s.
fn twins() -> Scene {
    let mut scene = under_gravity("two ropes");
    let load = scene.add_body("load", Body::particle(100.0).at(Vector3::z() * -1.0));
    scene.load = Some(load);
    for name in ["left", "right"] {
        let frames = [
            Frame::world(Vector3::zeros()),
            Frame::body(load, Vector3::zeros()),
        ];
        scene.add_constraint(name, link(frames, 1.0, RowLaw::new(1e-5, 0.0)), 0);
    }
    scene.events.push(Event {
        name: "cut".into(),
        when: When::Time(0.1),
        then: vec![Action::Release(0)],
    });
    scene.start_in_equilibrium = true;
    scene
}

fn link(frames: [Frame; 2], length: f64, law: RowLaw) -> Constraint {
    Constraint::Distance(Distance {
        frames,
        length,
        law,
        transverse: false,
    })
}

fn broken() -> Result<Vec<Check>, ExperimentError> {
    let peak = |dt: f64| -> Result<f64, StepError> {
        let mut stepper = Stepper::new(twins(), at(dt))?;
        let mut peak = 0.0;
        while stepper.time() < 0.6 {
            stepper.step()?;
            peak = worse(peak, stepper.tension(0).unwrap_or(f64::NAN));
        }
        Ok(peak / (100.0 * GRAVITY))
    };
    let row = |rate: f64, bar: f64| -> Result<Check, ExperimentError> {
        let case = format!("one of two ropes breaks, Δt = 1/{rate} s: peak in the other, over W");
        Ok(Check::relative(case, [1.5, peak(1.0 / rate)?], "", bar))
    };
    Ok(vec![row(960.0, 1e-3)?, row(60.0, 0.05)?])
}

fn caught() -> Result<Vec<Check>, ExperimentError> {
    let (m1, m2, v) = (3.0, 1000.0, 2.0);
    let mut scene = Scene::new("catch");
    let mut runner = Body::sphere(0.1, m1);
    runner.velocity = Vector3::x() * v;
    scene.add_body("runner", runner);
    scene.add_body("block", Body::sphere(0.5, m2).at(Vector3::x() * 1.5));
    let mut stepper = Stepper::new(scene, at(DT))?;
    for _ in 0..10 {
        stepper.step()?;
    }
    let place = &stepper.scene().bodies.position;
    let length = (place[1] - place[0]).norm();
    stepper.change(|edit| hook(edit, length))?;
    for _ in 0..200 {
        stepper.step()?;
    }
    let momentum = stepper.scene().momentum().x;
    let energy = [
        m1 * m1 * v * v / (2.0 * (m1 + m2)),
        stepper.scene().kinetic_energy(),
    ];
    let case = "a rigid link catches a body 333 times heavier";
    Ok(vec![
        Check::relative(
            format!("{case}: momentum"),
            [m1 * v, momentum],
            "N s",
            1e-14,
        ),
        Check::relative(format!("{case}: energy"), energy, "J", 1e-12),
    ])
}

/// Ties bodies 0 and 1 together.
fn hook(edit: &mut Edit, length: f64) -> Result<(), StepError> {
    let frames = [0, 1].map(|body| Frame::body(body, Vector3::zeros()));
    edit.add_constraint("link", link(frames, length, RowLaw::RIGID), 0);
    Ok(())
}

/// A free, taut cable that turns about its middle and flies.
fn spinning() -> Result<Scene, ExperimentError> {
    let half = Vector3::x() * 2.0;
    let mut cable = Cable::round(
        "rope",
        &Material::NYLON,
        0.01,
        [half, -half].map(CableEnd::Free),
    );
    cable.segments = Segments::Equal(8);
    let mut scene = Scene::new("spinning cable");
    scene.add_cable(&cable)?;
    let spin = Vector3::new(0.3, -0.2, 4.0);
    let bodies = &mut scene.bodies;
    for (x, v) in bodies.position.iter().zip(&mut bodies.velocity) {
        *v = spin.cross(x) + Vector3::new(0.5, 0.1, -0.2);
    }
    bodies.angular_velocity.fill(spin);
    Ok(scene)
}

fn cut() -> Result<Vec<Check>, ExperimentError> {
    let mut stepper = Stepper::new(spinning()?, at(DT))?;
    let momenta = |stepper: &Stepper| {
        let about = Vector3::new(1.0, 2.0, 3.0);
        let scene = stepper.scene();
        (scene.momentum(), scene.angular_momentum(&about))
    };
    let mut turned = [0.0; 2];
    let mut kicked = 0.0;
    for _ in 0..20 {
        stepper.step()?;
    }
    for (is_cut, turned) in [false, true].into_iter().zip(&mut turned) {
        let (p, l) = momenta(&stepper);
        if is_cut {
            stepper.change(|edit| edit.cut("rope", 3))?;
        }
        stepper.step()?;
        let (next_p, next_l) = momenta(&stepper);
        kicked = worse(kicked, (next_p - p).norm() / p.norm());
        *turned = (next_l - l).norm() / l.norm();
    }
    let [whole, halved] = turned;
    let case = "a taut, spinning cable is cut in its middle";
    let drift = format!("{whole:.2e} in a step before");
    Ok(vec![
        Check::off(format!("{case}: momentum"), "kept", kicked, "", 1e-12),
        Check::within(
            format!("{case}: angular momentum"),
            drift,
            format!("{halved:.2e}"),
            halved / whole,
            1.0,
        )
        .by("over what the scheme loses in a step without a cut"),
    ])
}

fn hooked(times: usize) -> Result<Vec<Check>, ExperimentError> {
    let mut scene = Scene::new("hooks");
    scene.add_body("trolley", Body::sphere(0.2, 50.0));
    scene.add_body("load", Body::sphere(0.2, 20.0).at(Vector3::z() * -1.0));
    scene.bodies.velocity.fill(Vector3::x() * 0.2);
    let options = StepOptions {
        energy_tolerance: Some(1e-9),
        ..at(DT)
    };
    let mut stepper = Stepper::new(scene, options)?;
    let start = stepper.scene().kinetic_energy();
    for _ in 0..times {
        stepper.change(|edit| hook(edit, 1.0))?;
        stepper.step()?;
        stepper.change(|edit| edit.remove_constraint(edit.constraint("link")?))?;
    }
    let case = format!("hooked on and off {times} times without a pull: energy");
    let energies = [start, stepper.scene().kinetic_energy()];
    Ok(vec![Check::relative(case, energies, "J", 1e-12)])
}
