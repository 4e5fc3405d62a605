//! H58: lost runs are called so, and no others.
//!
//! A run that is lost goes on, finite, with energy from nowhere or with links many times their length. What ends it are the
//! scene's own limits of gaps ([`Scene::gap_limits`]) and the balance of energy
//! ([`StepOptions::energy_tolerance`]), of which point masses and massless cables have as much as bodies that turn. A
//! healthy run may be fast: bodies that spin about their axes, an anchor in a circle, a blow.

use crate::hard::under_gravity;
use indicatif::ProgressBar;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use taut_ground::trajectory::{ENERGY_TOLERANCE, Limits, Simulation, steps_in};
use taut_integrator::{GeometricStiffness, Scheme, StepError, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Frame, HoistParams, MasslessCable, Network, NetworkParams,
    ParticleChainParams, RowLaw, Scene, Winch,
};
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_solver::Backend;

/// A run, and whether it is lost.
struct Run {
    name: &'static str,
    scene: Scene,
    options: StepOptions,
    time: f64,
    lost: bool,
}

/// A load of 33 kg beside a stiff rope that a winch hauls in: at rest it would hang 5.3 m down.
pub(super) fn winched() -> Scene {
    let mut scene = under_gravity("a winch hauls a load in");
    let body = Body::new(33.0, Matrix3::identity() * 1e-4);
    let load = scene.add_body("load", body.at(Vector3::new(1.8173, 0.0, -4.9787)));
    scene.load = Some(load);
    let frames = vec![
        Frame::world(Vector3::zeros()),
        Frame::body(load, Vector3::zeros()),
    ];
    let rope = MasslessCable {
        winch: Some(Winch {
            speed: -0.45,
            ..Winch::new()
        }),
        ..MasslessCable::new(frames, 5.3, RowLaw::new(5.3e-9, 0.0))
    };
    scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
    scene
}

/// A chain that the paper's step loses.
pub(super) fn chain() -> Result<Scene, ExperimentError> {
    let params = ParticleChainParams {
        load_mass: 500.0,
        ..ParticleChainParams::default()
    };
    Ok(params.build()?)
}

/// A cable whose segments spin fast about their axes.
fn spinning() -> Result<Scene, ExperimentError> {
    let params = HoistParams {
        segments: 12,
        mass_ratio: 1e3,
        move_x: 0.4,
        ..HoistParams::default()
    };
    let mut scene = params.build()?;
    scene.bodies.angular_velocity[..12].fill(Vector3::new(0.001, 0.002, 50.0));
    Ok(scene)
}

fn runs() -> Result<Vec<Run>, ExperimentError> {
    let default = StepOptions::default;
    let run = |name, lost, time, options, scene| Run {
        name,
        scene,
        options,
        time,
        lost,
    };
    let spook = StepOptions {
        scheme: Scheme::Spook,
        stiffness: GeometricStiffness::inertia(Scheme::Spook.default_alpha()),
        ..default()
    };
    let circle = HoistParams {
        circle_radius: 1.0,
        circle_period: 2.0,
        ..HoistParams::default()
    };
    let paper = StepOptions::paper();
    let mut runs = vec![
        run("particles, the paper's step", true, 30.0, paper, chain()?),
        run("a winch, spook", false, 8.0, spook, winched()),
        run("a winch", false, 8.0, default(), winched()),
        run("segments that spin", false, 20.0, default(), spinning()?),
        run(
            "an anchor in a circle",
            false,
            10.0,
            default(),
            circle.build()?,
        ),
    ];
    let five: Result<Backend, _> = "gauss-seidel:joints:iterations=5".parse();
    if let Some(backend) = five.ok().filter(Backend::is_compiled) {
        let options = StepOptions {
            refinements: 0,
            backend,
            ..default()
        };
        let net = NetworkParams::new(Network::Net).build()?;
        runs.push(run("a net, five iterations", true, 10.0, options, net));
    }
    Ok(runs)
}

/// Reason for which a run was found lost, if it was, and its largest excess of energy.
fn found(run: &Run) -> Result<(Option<String>, f64), StepError> {
    let options = StepOptions {
        energy_tolerance: Some(ENERGY_TOLERANCE),
        ..run.options.clone()
    };
    let steps = steps_in(run.time, options.dt);
    let mut stepper = Stepper::new(run.scene.clone(), options)?;
    let limits = Limits::Scene(stepper.scene().gap_limits());
    let mut simulation = Simulation::new(steps, limits);
    let mut excess = 0.0_f64;
    while let Some(sample) = simulation.step(&mut stepper) {
        excess = sample.balance.map_or(excess, |b| excess.max(b.excess));
    }
    Ok((simulation.failure.map(|f| f.reason), excess))
}

pub(super) fn outcome(_: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let runs = runs()?;
    progress.set_length(runs.len() as u64);
    let check = |run: &Run| -> Result<Check, ExperimentError> {
        let (why, excess) = found(run)?;
        let sound = why.is_some() == run.lost;
        let reference = if run.lost { "lost" } else { "good" };
        let note = format!("largest energy from nowhere {excess:.1e} of the motion's own");
        let ours = why.map_or_else(|| "good".to_owned(), |why| format!("lost: {why}"));
        progress.inc(1);
        Ok(Check::stated(run.name, reference, ours, sound).noting(note))
    };
    let checks: Vec<Check> = runs.par_iter().map(check).collect::<Result<_, _>>()?;
    Ok(checks.into())
}
