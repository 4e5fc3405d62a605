//! H16: where a scene that asks for its static equilibrium starts.
//!
//! A load on two massless slings from one point of a hook turns about the vertical without resistance: which
//! solver is at work, and how its rounding turns the load, must not decide whether rest is found. All solvers find the
//! same, with the load turned as it was.

use crate::hard::{either, solvers, together, worse};
use crate::paper::specimens::largest;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use std::f64::consts::TAU;
use taut_integrator::static_equilibrium;
use taut_model::{Body, Constraint, Frame, HoistParams, MasslessCable, RowLaw, Scene, SceneError};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Bar of the whole's elongation or angle, relative; of positions over the cable's length; of orientations in rad.
pub const BAR: f64 = 1e-9;

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
