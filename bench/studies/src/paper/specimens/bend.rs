//! Fig. 12: bend. Curvature M/YI, up to the full circle M = 2π YI/L.
//!
//! The discrete answer is a polygon: every inner joint bends by θ = M l/YI, those at the ends by θ/2, and the grip is
//! where the sides lead. How far that is from the circle of radius R = YI/M depends on where the radius is measured
//! ([`deviations`]).
//!
//! A moment of fixed direction follows no potential. Beyond 0.85 to 0.9 of a circle the plane shape is an unstable
//! equilibrium against motion out of its plane ([`growth_out_of_plane`]). Where the moment is along an axis of the
//! section, exact zeros keep the cable in its plane; along a diagonal, rounding does not, and those specimens are bent to
//! three quarters of a circle.

mod plane;
mod report;
mod shape;

pub use plane::growth_out_of_plane;
pub use report::outcome;
pub use shape::deviations;

use super::{Joint, MATERIALS, SEGMENTS, params, relax};
use crate::checks::each;
use indicatif::ProgressBar;
use plane::slowest_mode;
use serde::Serialize;
use shape::{axis, measure, shape};
use std::f64::consts::{FRAC_PI_4, TAU};
use taut_model::{Scene, Specimen, SpecimenParams};
use taut_output::check::ExperimentError;

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub segments: Vec<usize>,
    /// Loads from the straight cable to the full circle.
    pub loads: usize,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            segments: SEGMENTS.to_vec(),
            loads: 24,
        }
    }
}

impl Config {
    pub fn quick() -> Self {
        Self {
            loads: 12,
            ..Self::default()
        }
    }
}

/// A specimen under one moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    pub material: String,
    pub segments: usize,
    pub joint: String,
    /// Direction of the moment across the cable, from +z towards +y \[rad].
    pub direction_rad: f64,
    /// M L/YI: the angle of the whole \[rad].
    pub angle_theory: f64,
    /// M \[N m].
    pub moment_nm: f64,
    /// Largest relative error of a joint's angle against M l_j/YI.
    pub angle_error: f64,
    /// Distance of the grip from where the polygon leads it, over L.
    pub tip_error: f64,
    /// Distance of the grip from the end of the continuum's arc, over L.
    pub tip_from_arc: f64,
    /// Radius through the segments' centres \[m].
    pub radius_m: f64,
    /// Its deviation from YI/M, relative.
    pub radius_deviation: f64,
    /// Deviation of L over the angle between clamp and last segment.
    pub half_missing_deviation: f64,
    /// Deviation of L over the angle between first and last segment.
    pub ends_missing_deviation: f64,
}

/// Joints, and the directions of their moments.
const LOADED: [(Joint, f64); 3] = [
    (Joint::Cosserat, 0.0),
    (Joint::Cosserat, FRAC_PI_4),
    (Joint::Ordinary, 0.0),
];

/// Bends every specimen, in parallel.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Row>, ExperimentError> {
    let mut tasks = Vec::new();
    for material in MATERIALS {
        for &n in &config.segments {
            tasks.extend(LOADED.map(|(joint, direction)| (material, n, joint, direction)));
        }
    }
    let rows = each(&tasks, progress, |&(material, n, joint, direction)| {
        let params = SpecimenParams {
            moment_direction: direction,
            ..params(Specimen::Bend, material, n, joint)
        };
        let to = if direction == 0.0 { 1.0 } else { STABLE };
        bend(material.0, &params, joint, (config.loads, to))
    })?;
    Ok(rows.concat())
}

fn bend(
    material: &str,
    params: &SpecimenParams,
    joint: Joint,
    (loads, to): (usize, f64),
) -> Result<Vec<Row>, ExperimentError> {
    let specimen = params.resolve()?;
    let n = specimen.segments;
    let mut scene = params.build()?;
    let axis = axis(params);
    if joint != Joint::Cosserat {
        // Its scalar angle has no direction when straight: it starts from half the first load's shape.
        shape(&mut scene, &specimen, &axis, 0.5 * TAU / loads as f64);
    }
    let unit = specimen.stiffness.ei / params.length;
    let dt = 10.0 / slowest_mode(&specimen);
    (1..=loads)
        .filter(|k| *k as f64 <= to * loads as f64)
        .map(|k| {
            let angle = TAU * k as f64 / loads as f64;
            scene.bodies.torque[n] = axis * (angle * unit);
            scene = relax(std::mem::take(&mut scene), dt)?;
            Ok(Row {
                material: material.to_owned(),
                joint: joint.name().to_owned(),
                direction_rad: params.moment_direction,
                moment_nm: angle * unit,
                ..measure(&scene, &specimen, &axis, angle)
            })
        })
        .collect()
}

/// A specimen at rest, bent to `part` of a circle from a tenth less, and what is measured of it.
pub(in crate::paper) fn bent(
    material: (&str, f64),
    segments: usize,
    part: f64,
) -> Result<(Scene, Row), ExperimentError> {
    let params = params(Specimen::Bend, material, segments, Joint::Cosserat);
    let (specimen, axis, angle) = (params.resolve()?, axis(&params), part * TAU);
    let mut scene = params.build()?;
    shape(&mut scene, &specimen, &axis, 0.9 * angle);
    scene.bodies.torque[segments] = axis * (angle * specimen.stiffness.ei / params.length);
    let scene = relax(scene, 10.0 / slowest_mode(&specimen))?;
    let row = measure(&scene, &specimen, &axis, angle);
    Ok((scene, row))
}

/// Part of a circle to which specimens without exact zeros are bent.
const STABLE: f64 = 0.75;
