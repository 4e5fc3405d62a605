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
mod shape;

pub use plane::growth_out_of_plane;
pub use shape::deviations;

use super::{Joint, MATERIALS, SEGMENTS, order, params, summed, tasks};
use crate::checks::each;
use crate::options::pick;
use crate::paper::words::{self, chart, judged, named_check, number, table, with};
use crate::rest::relax;
use indicatif::ProgressBar;
use nalgebra::Vector3;
use plane::{slowest_mode, stability_of_the_plane};
use serde_json::{Value, json};
use shape::{MEASURES, axis, measure, polygon};
use std::f64::consts::{FRAC_PI_4, TAU};
use taut_model::{ResolvedSpecimen, Scene, Specimen, SpecimenParams};
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_output::plot::Chart;

/// Joints, and the directions of their moments.
const LOADED: [(Joint, f64); 3] = [
    (Joint::Cosserat, 0.0),
    (Joint::Cosserat, FRAC_PI_4),
    (Joint::Ordinary, 0.0),
];

/// Bends specimens of every material, in parallel, from the straight cable to the full circle; quick by half the loads.
pub fn run(quick: bool, progress: &ProgressBar) -> Result<Vec<Value>, ExperimentError> {
    let loads = pick(quick, [24, 12]);
    let tasks = tasks(&MATERIALS, &LOADED);
    let rows = each(&tasks, progress, |&(material, n, (joint, direction))| {
        bend(material, n, (joint, direction), loads)
    })?;
    Ok(rows.concat())
}

fn bend(
    material: (&str, f64),
    n: usize,
    (joint, direction): (Joint, f64),
    loads: usize,
) -> Result<Vec<Value>, ExperimentError> {
    let params = SpecimenParams {
        moment_direction: direction,
        ..params(Specimen::Bend, material, n, joint)
    };
    let to = if direction == 0.0 { 1.0 } else { STABLE };
    let specimen = params.resolve()?;
    let mut scene = params.build()?;
    let axis = axis(&params);
    if joint != Joint::Cosserat {
        // Its scalar angle has no direction when straight: it starts from half the first load's shape.
        let half = 0.5 * TAU / loads as f64;
        (scene.bodies.position, scene.bodies.orientation) = polygon(&specimen, &axis, half);
    }
    let unit = specimen.stiffness.ei / params.length;
    let dt = 10.0 / slowest_mode(&specimen);
    (1..=loads)
        .filter(|k| *k as f64 <= to * loads as f64)
        .map(|k| {
            let angle = TAU * k as f64 / loads as f64;
            scene.bodies.torque[n] = axis * (angle * unit);
            scene = relax(std::mem::take(&mut scene), dt)?;
            let row = json!({
                "material": material.0,
                "segments": n,
                "joint": joint,
                "direction_rad": direction,
                "angle_theory": angle,
                "moment_nm": angle * unit,
            });
            Ok(with(&row, &measure(&scene, &specimen, &axis, angle)))
        })
        .collect()
}

/// A specimen under the moment for `part` of a circle, bent to `share` of that.
fn loaded(
    material: (&str, f64),
    segments: usize,
    part: f64,
    share: f64,
) -> Result<(Scene, ResolvedSpecimen, Vector3<f64>), ExperimentError> {
    let params = params(Specimen::Bend, material, segments, Joint::Cosserat);
    let (specimen, axis) = (params.resolve()?, axis(&params));
    let mut scene = params.build()?;
    let bodies = &mut scene.bodies;
    (bodies.position, bodies.orientation) = polygon(&specimen, &axis, share * (part * TAU));
    bodies.torque[segments] = axis * (part * TAU * specimen.stiffness.ei / params.length);
    Ok((scene, specimen, axis))
}

/// A specimen at rest, bent to `part` of a circle from a tenth less, and what is measured of it.
pub(in crate::paper) fn bent(
    material: (&str, f64),
    segments: usize,
    part: f64,
) -> Result<(Scene, Value), ExperimentError> {
    let (scene, specimen, axis) = loaded(material, segments, part, 0.9)?;
    let scene = relax(scene, 10.0 / slowest_mode(&specimen))?;
    let row = measure(&scene, &specimen, &axis, part * TAU);
    Ok((scene, row))
}

/// Part of a circle to which specimens without exact zeros are bent.
const STABLE: f64 = 0.75;

/// The paper's deviations of N = 6 and N = 24.
const PUBLISHED: [(usize, f64); 2] = [(6, 0.10), (24, 0.025)];

/// Checks, tables, rows and charts.
pub fn outcome(rows: &[Value]) -> Result<Outcome, ExperimentError> {
    let of_material = ["bend-angle", "bend-end", "bend-diagonal"];
    let mut checks = judged(rows, "material", &of_material);
    checks.extend(judged(rows, "", &["bend-closes"]));
    checks.extend(MEASURES.map(|(name, measure, expected)| {
        let found = finest(&deviations(rows, 0.25 * TAU, measure)).unwrap_or(f64::NAN);
        named_check("bend-order", json!({ "measure": name })).compared_with([expected, found])
    }));
    checks.extend(published(rows));
    checks.push(stability_of_the_plane()?);
    words::outcome(checks, tables(rows), rows, charts(rows))
}

/// Order in N of the two finest specimens' deviations.
fn finest(all: &[(usize, f64)]) -> Option<f64> {
    let finest: Vec<_> = all.iter().copied().filter(|d| d.0 >= 12).collect();
    order(&finest)
}

/// The deviation at N of a measure at the full circle.
fn at(rows: &[Value], measure: &str, n: usize) -> f64 {
    let all = deviations(rows, TAU, measure);
    all.iter().find(|d| d.0 == n).map_or(f64::NAN, |d| d.1)
}

fn published(rows: &[Value]) -> Vec<Check> {
    let size = |measure, n: usize| at(rows, measure, n).abs();
    let deviation = |(n, printed): (usize, f64)| {
        let values = [printed, size(MEASURES[0].1, n)].map(|d| 100.0 * d);
        named_check("bend-deviation", json!({ "n": n })).compared_with(values)
    };
    let mut checks = PUBLISHED.map(deviation).to_vec();
    let misfit = |measure| {
        let ratios = PUBLISHED.map(|(n, printed)| (size(measure, n) / printed).ln().abs());
        ratios[0].max(ratios[1])
    };
    let mut measures = MEASURES;
    measures.sort_by(|a, b| misfit(a.1).total_cmp(&misfit(b.1)));
    let (name, measure, _) = measures[0];
    let [a, b] = PUBLISHED.map(|(n, _)| 100.0 * size(measure, n));
    let said = named_check("bend-nearest", json!({ "measure": name, "a": a, "b": b }));
    checks.push(said.so(misfit(measure).exp() <= 1.2));
    checks
}

fn tables(rows: &[Value]) -> String {
    let radius = MEASURES.map(|(name, measure, _)| {
        let mut row = json!({ "measure": name });
        for n in SEGMENTS {
            row[n.to_string()] = (100.0 * at(rows, measure, n)).into();
        }
        row["order"] = finest(&deviations(rows, TAU, measure)).into();
        row
    });
    let same = ["material", "segments", "joint", "direction_rad"];
    let steel = summed(rows, &same, &["angle_error", "tip_error"]);
    let [radius, steel] = [table("bend-radius", &radius), table("bend", &steel)];
    format!("{radius}\nsteel, largest over all loads\n{steel}")
}

fn charts(rows: &[Value]) -> Vec<Chart> {
    let curved = |r: &Value| with(r, &json!({ "curvature": 1.0 / number(r, "radius_m") }));
    let curved: Vec<Value> = rows.iter().map(curved).collect();
    let deviations = MEASURES.iter().flat_map(|(name, measure, _)| {
        let all = deviations(rows, TAU, measure).into_iter();
        all.map(move |(n, d)| json!({ "measure": name, "n": n, "deviation": d.abs() }))
    });
    let deviations: Vec<Value> = deviations.collect();
    vec![
        chart("bend", &Value::Null, &curved),
        chart("bend-deviation", &Value::Null, &deviations),
    ]
}
