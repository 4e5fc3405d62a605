//! H60: cables along routes. A helix laid of a cable that is straight at rest, and a cable of segments of unlike lengths.
//!
//! A helix of radius R and rise p a turn has the curvature κ = R ω²/(R² ω² + p²) with ω = 2π a turn, and a cable that is bent
//! along it without torsion stores ½ EI κ² L. The error of the segments is of second order, the twist none: parallel
//! transport. A hanging cable of any segments is stretched by Σ_j ε_j T_j exactly, ε_j = l_j/EA of the length l_j that joint j
//! stands for, T_j the weight below it.

use crate::hard::{DT, GRAVITY, at, under_gravity, worse};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use taut_integrator::Stepper;
use taut_model::{
    Body, Cable, CableEnd, Frame, Linearized, Material, RowKind, Scene, Segments, Stiffness,
};
use taut_output::check::{Check, ExperimentError, Outcome};

const STIFFNESS: Stiffness = Stiffness {
    ea: 1e6,
    ei: 40.0,
    gj: 30.0,
};
/// Radius of the helix, its rise a turn \[m], and its turns.
const HELIX: [f64; 3] = [0.5, 0.2, 2.5];
/// Legs of its route: it ends in the direction of the last one, an error of one part in 10⁶ of the energy.
const LEGS: usize = 400_000;

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let [radius, rise, turns] = HELIX;
    let along = (TAU * radius).hypot(rise);
    let curvature = TAU * TAU * radius / (along * along);
    let exact = 0.5 * STIFFNESS.ei * curvature * curvature * along * turns;
    let [coarse, fine] = [energies(&helix(16)?), energies(&helix(32)?)];
    let error = |energies: [f64; 3]| energies[1] / exact - 1.0;
    let order = (error(coarse) / error(fine)).log2();
    let case = "a helix of 2½ turns, 32 segments";
    let none = |what: &str, part: f64| {
        Check::off(format!("{case}: {what}"), "none", part, "", 1e-14)
            .by("energy over that of bending")
    };
    let bending = format!("{case}: bending energy");
    let mut checks = vec![
        Check::relative(bending, [exact, fine[1]], "J", 2e-3),
        none("twist", fine[2] / fine[1]),
        none("stretch", fine[0] / fine[1]),
        Check::second_order("a helix: order of the bending energy in 1/N", order, 0.1)
            .with_note("16 and 32 segments; the direction of the last leg is 0.04 of it"),
    ];
    checks.push(uneven()?);
    Ok(checks.into())
}

/// The uneven cable at its beginning.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![hanging()?])
}

fn helix(segments: usize) -> Result<Scene, ExperimentError> {
    let [radius, rise, turns] = HELIX;
    let point = |i: usize| {
        let turn = turns * i as f64 / LEGS as f64;
        let (sine, cosine) = (TAU * turn).sin_cos();
        Vector3::new(radius * cosine, radius * sine, rise * turn)
    };
    let ends = [point(0), point(LEGS)].map(|p| CableEnd::Clamped(Frame::world(p)));
    let cable = Cable {
        points: (1..LEGS).map(point).collect(),
        segments: Segments::Equal(segments),
        stiffness: STIFFNESS,
        ..Cable::round("helix", &Material::STEEL, 0.01, ends)
    };
    let mut scene = Scene::new("helix");
    scene.add_cable(&cable)?;
    Ok(scene)
}

/// Elastic energies ½ φ²/ε of the stretch, bend and twist rows \[J].
fn energies(scene: &Scene) -> [f64; 3] {
    let mut lin = Linearized::new(scene);
    lin.update(scene, 0.0);
    let mut sums = [0.0; 3];
    for (c, joint) in scene.constraints.iter().enumerate() {
        for (k, row) in lin.row_range(c).enumerate() {
            let sum = match joint.row(k).0 {
                RowKind::Stretch => 0,
                RowKind::Bend => 1,
                _ => 2,
            };
            sums[sum] += 0.5 * lin.phi[row] * lin.phi[row] / lin.compliance[row];
        }
    }
    sums
}

/// A load of 2 t on 9 m of cable in segments of 1 m and ⅛ m by turns.
fn hanging() -> Result<Scene, ExperimentError> {
    let mut scene = under_gravity("uneven cable");
    let load = scene.add_body("load", Body::sphere(0.3, 2000.0).at(Vector3::z() * -9.0));
    scene.load = Some(load);
    let ends = [
        Frame::world(Vector3::zeros()),
        Frame::body(load, Vector3::zeros()),
    ];
    let lengths = [1.0, 0.125].repeat(8);
    let mut cable = Cable::round("rope", &Material::STEEL, 0.012, ends.map(CableEnd::Pinned));
    cable.segments = Segments::Lengths(lengths);
    scene.add_cable(&cable)?;
    scene.start_in_equilibrium = true;
    Ok(scene)
}

fn uneven() -> Result<Check, ExperimentError> {
    let scene = hanging()?;
    let rods = scene.cables[0].bodies.iter().map(|i| scene.bodies.mass[*i]);
    let mut below = scene.mass();
    let mut exact = 0.0;
    let mut masses = rods;
    for joint in &scene.cables[0].joints {
        exact += scene.constraints[*joint].row(0).1.compliance * below * GRAVITY;
        below -= masses.next().unwrap_or(0.0);
    }
    let start = scene.bodies.position[0].z;
    let mut stepper = Stepper::new(scene, at(DT))?;
    let mut off = 0.0;
    let mut sunk = 0.0;
    for _ in 0..60 {
        stepper.step()?;
        sunk = start - stepper.scene().bodies.position[0].z;
        off = worse(off, (sunk / exact - 1.0).abs());
    }
    let case = "segments of lengths 8 : 1: elongation under 2 t";
    Ok(Check::relative(case, [exact, sunk], "m", 1e-9)
        .with_note(format!("at most {off:.1e} off over a second")))
}
