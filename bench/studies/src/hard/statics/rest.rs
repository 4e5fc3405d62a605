//! H15, H16: where a scene that asks for its static equilibrium starts.
//!
//! H15: pulled, bent and twisted specimens of all materials under their whole load at once, the twisted ones by up to 37
//! turns: gaps F L/YA, angles M L/YI and T L/GJ of the whole, as in H01 to H03, where the load rises in steps.
//!
//! H16: a load on two massless slings from one point of a hook turns about the vertical without resistance: which
//! solver is at work, and how its rounding turns the load, must not decide whether rest is found. All solvers find the
//! same, with the load turned as it was.

use crate::hard::{either, solvers, together, worse};
use crate::paper::specimens::{Joint, MATERIALS, largest, params, read};
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, TAU};
use taut_integrator::static_equilibrium;
use taut_model::{
    Body, Constraint, Frame, HoistParams, MasslessCable, RowLaw, Scene, SceneError, Specimen,
};
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_solver::Backend;

/// Bar of the whole's elongation or angle, relative; of positions over the cable's length; of orientations in rad.
pub const BAR: f64 = 1e-9;

/// Relative error of the elongation, the bend or the twist of a specimen at rest: 10 % longer, a quarter of a circle, or
/// `turns` turns.
pub(super) fn off_its_load(
    specimen: Specimen,
    material: (&str, f64),
    n: usize,
    turns: f64,
) -> Result<f64, ExperimentError> {
    let mut loaded = params(specimen, material, n, Joint::Cosserat);
    let (stiffness, length) = (loaded.resolve()?.stiffness, loaded.length);
    let exact = match specimen {
        Specimen::Pull => {
            loaded.force = Some(0.1 * stiffness.ea);
            0.1 * length
        }
        Specimen::Bend => {
            loaded.moment = Some(FRAC_PI_2 * stiffness.ei / length);
            FRAC_PI_2
        }
        _ => {
            loaded.torque = Some(turns * TAU * stiffness.gj / length);
            turns * TAU
        }
    };
    let backend = Backend::preferred().unwrap_or(Backend::Banded);
    let joints = read(&static_equilibrium(loaded.build()?, &backend)?, n);
    let measured = joints.iter().map(|joint| match specimen {
        Specimen::Pull => joint.gap,
        Specimen::Bend => joint.bend,
        _ => joint.twist,
    });
    Ok((measured.sum::<f64>() / exact - 1.0).abs())
}

pub(super) fn loaded_at_once(
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    let sizes: &[usize] = if quick { &[5, 24] } else { &[5, 12, 24, 60] };
    let loads = [
        (Specimen::Pull, 0.0),
        (Specimen::Bend, 0.0),
        (Specimen::Twist, 0.37),
        (Specimen::Twist, 3.7),
        (Specimen::Twist, 37.0),
    ];
    progress.set_length((MATERIALS.len() * loads.len()) as u64);
    let mut checks = Vec::new();
    for material in MATERIALS {
        for (specimen, turns) in loads {
            let errors = sizes
                .iter()
                .map(|&n| off_its_load(specimen, material, n, turns));
            let error = largest(errors.collect::<Result<Vec<_>, _>>()?.into_iter());
            let what = if turns > 0.0 {
                format!("{turns} turns")
            } else {
                specimen.name().to_owned()
            };
            let check = Check::off(
                format!("{}, {what}, N = {sizes:?}", material.0),
                "the load over the stiffness",
                error,
                "",
                BAR,
            );
            checks.push(check.by("relative error of the whole").algebraic());
            progress.inc(1);
        }
    }
    Ok(checks.into())
}

/// A hook of 100 kg on 10 m of cable of `n` segments, and a load of 5 t on two slings from one point of it to points a
/// metre from the load's axis, in the direction `angle` (rad) about the vertical.
///
/// # Errors
/// Numbers out of range.
pub fn slings(n: usize, angle: f64) -> Result<Scene, SceneError> {
    let hoist = HoistParams {
        segments: n,
        load_mass: Some(100.0),
        segment_mass: Some(40.0 / n as f64),
        ..HoistParams::default()
    };
    let mut scene = hoist.build()?;
    let hook = scene.bodies.len() - 1;
    let point = Vector3::new(0.0, 0.0, -0.2);
    let size = Vector3::new(2.0, 1.0, 1.0);
    let below = scene.bodies.position[hook] + point - Vector3::z() * 1.5;
    let load = scene.add_body("crate", Body::cuboid(size, 5000.0).at(below));
    let outwards = Vector3::new(angle.cos(), angle.sin(), 0.0);
    let length = 2.0_f64.sqrt();
    for (name, side) in [("sling-1", 1.0), ("sling-2", -1.0)] {
        let end = outwards * side + Vector3::z() * 0.5;
        let ends = vec![Frame::body(hook, point), Frame::body(load, end)];
        let cable = MasslessCable::new(ends, length, RowLaw::new(length / 1e7, 0.0));
        scene.add_constraint(name, Constraint::MasslessCable(cable), 2);
    }
    scene.load = Some(load);
    Ok(scene)
}

/// Largest distance of a body of `scene` from where it is in the other, over 10 m, and largest angle \[rad].
pub(super) fn apart(scene: &Scene, other: &Scene) -> [f64; 2] {
    let (a, b) = (&scene.bodies, &other.bodies);
    let ways = a.position.iter().zip(&b.position);
    let turns = a.orientation.iter().zip(&b.orientation);
    [
        largest(ways.map(|(x, y)| (x - y).norm())) / 10.0,
        largest(turns.map(|(p, q)| p.angle_to(q))),
    ]
}

pub(super) fn from_one_point(
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    let sizes: &[usize] = either(quick, &[8, 40], &[8, 12, 24, 40, 80]);
    let angles = if quick { 3 } else { 20 };
    let all = solvers();
    progress.set_length((sizes.len() * all.len()) as u64);
    let mut checks = Vec::new();
    for &n in sizes {
        let mut found = Vec::new();
        let mut first: Vec<Scene> = Vec::new();
        for choice in &all {
            let mut off = 0.0;
            for k in 0..angles {
                let start = slings(n, TAU / 4.0 * k as f64 / angles as f64)?;
                let Ok(rest) = static_equilibrium(start.clone(), &choice.backend) else {
                    off = f64::NAN;
                    continue;
                };
                if first.len() == k {
                    first.push(rest.clone());
                }
                let [_, turned] = apart(&rest, &start);
                let [moved, _] = apart(&rest, &first[k]);
                off = worse(off, moved.max(turned));
            }
            let check = Check::off("", "the first solver's", off, "", BAR)
                .by("positions over L, and the load's turning");
            found.push((choice.family(), check));
            progress.inc(1);
        }
        checks.extend(together(&format!("N = {n}, {angles} directions"), found));
    }
    Ok(checks.into())
}
