//! Fig. 12: bend. Curvature M/YI, up to the full circle M = 2π YI/L.
//!
//! The discrete answer is a polygon: every inner joint bends by θ = M l/YI, those at the ends by θ/2, and the grip is
//! where the sides lead. How far that is from the circle of radius R = YI/M depends on where the radius is measured:
//!
//! ```text
//! through the segments' centres      l/(2 tan ½θ) = R (1 − θ²/12 − …)     second order in N
//! through the joints                 l/(2 sin ½θ) = R (1 + θ²/24 + …)     second order
//! length L over the angle between clamp and last segment, (N − ½) θ       R (1 + 1/(2N − 1)): first order
//! length L over the angle between first and last segment, (N − 1) θ       R (1 + 1/(N − 1)): first order
//! ```
//!
//! The last two leave out the half segments beyond the outer joints, as a cable without end joints does.
//!
//! A moment of fixed direction follows no potential. Beyond 0.85 to 0.9 of a circle the plane shape is an unstable
//! equilibrium against motion out of its plane, with any time step ([`growth_out_of_plane`]). Where the moment is along
//! an axis of the section, exact zeros keep the cable in its plane; along a diagonal, rounding does not, and those
//! specimens are bent to three quarters of a circle.

use super::{BAR, Joint, MATERIALS, SEGMENTS, largest, order, params, read, relax};
use crate::check::{Check, ExperimentError, Outcome, Verdict, csv};
use crate::plot::{Axis, Chart, Mark, Series};
use crate::table::{error, table, text};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::{FRAC_PI_4, TAU};
use taut_integrator::{StepOptions, Stepper};
use taut_model::{ResolvedSpecimen, Scene, Specimen, SpecimenParams};

/// What [`run`] runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Numbers of segments.
    pub segments: Vec<usize>,
    /// Loads from the straight cable to the full circle.
    pub loads: usize,
}

impl Default for Config {
    /// 24 loads.
    fn default() -> Self {
        Self {
            segments: SEGMENTS.to_vec(),
            loads: 24,
        }
    }
}

impl Config {
    /// 12 loads.
    #[must_use]
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
    /// Material.
    pub material: String,
    /// Segments.
    pub segments: usize,
    /// Joint.
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

/// Bends every specimen, in parallel.
///
/// # Errors
/// A scene or a step that fails.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Row>, ExperimentError> {
    let mut tasks = Vec::new();
    for material in MATERIALS {
        for &segments in &config.segments {
            for (joint, direction) in [
                (Joint::Cosserat, 0.0),
                (Joint::Cosserat, FRAC_PI_4),
                (Joint::Ordinary, 0.0),
            ] {
                tasks.push((material, segments, joint, direction));
            }
        }
    }
    progress.set_length(tasks.len() as u64);
    let rows: Vec<Vec<Row>> = tasks
        .par_iter()
        .map(|&(material, segments, joint, direction)| {
            let params = SpecimenParams {
                moment_direction: direction,
                ..params(Specimen::Bend, material, segments, joint)
            };
            let to = if direction == 0.0 { 1.0 } else { STABLE };
            let rows = bend(material.0, &params, joint, (config.loads, to));
            progress.inc(1);
            rows
        })
        .collect::<Result<_, _>>()?;
    Ok(rows.into_iter().flatten().collect())
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
        let (positions, turns) = polygon(&specimen, &axis, 0.5 * TAU / loads as f64);
        scene.bodies.position = positions;
        scene.bodies.orientation = turns;
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

/// Part of a circle to which specimens without exact zeros are bent.
const STABLE: f64 = 0.75;

/// Slowest bending mode of the cantilever, 3.516 (YI/(ρA L⁴))^½ \[rad/s].
fn slowest_mode(specimen: &ResolvedSpecimen) -> f64 {
    let length = specimen.segment_length * specimen.segments as f64;
    let line_mass = specimen.segment_mass / specimen.segment_length;
    3.516 * (specimen.stiffness.ei / line_mass).sqrt() / length.powi(2)
}

/// By how much a disturbance out of the plane of a steel specimen with `segments` segments grows, bent to `part` of a
/// circle and left to creep: largest displacement at the end over that at a sixth of the way, and 0 where it falls to
/// rounding. `refined` divides the time step by it, over the same time.
///
/// # Errors
/// A scene that is not sound.
pub fn growth_out_of_plane(
    segments: usize,
    part: f64,
    refined: f64,
) -> Result<f64, ExperimentError> {
    const PASSES: f64 = 300.0;
    let params = params(Specimen::Bend, MATERIALS[2], segments, Joint::Cosserat);
    let specimen = params.resolve()?;
    let mut scene = params.build()?;
    let axis = axis(&params);
    let (positions, turns) = polygon(&specimen, &axis, part * TAU);
    (scene.bodies.position, scene.bodies.orientation) = (positions, turns);
    scene.bodies.torque[segments] = axis * (part * TAU * specimen.stiffness.ei / params.length);
    for (i, x) in scene.bodies.position.iter_mut().enumerate() {
        x.z += 1e-9 * (1.7 * i as f64).sin();
    }
    let options = StepOptions {
        dt: 1.0 / (3.0 * refined * slowest_mode(&specimen)),
        ..StepOptions::paper()
    };
    let mut stepper = Stepper::new(scene, options)?;
    // A pass from rest moves by Δt²: the creep's time.
    let passes = (PASSES * refined * refined) as usize;
    let aside =
        |stepper: &Stepper| largest(stepper.scene().bodies.position.iter().map(|x| x.z.abs()));
    let mut early = f64::NAN;
    for pass in 0..passes {
        let mut bodies = stepper.scene().bodies.clone();
        bodies.velocity.fill(Vector3::zeros());
        bodies.angular_velocity.fill(Vector3::zeros());
        stepper.set_state(&bodies, 0.0)?;
        if stepper.step().is_err() {
            return Ok(f64::INFINITY);
        }
        if pass == passes / 6 {
            early = aside(&stepper);
        }
    }
    let late = aside(&stepper);
    Ok(if late < 1e-14 { 0.0 } else { late / early })
}

fn axis(params: &SpecimenParams) -> Vector3<f64> {
    let (sine, cosine) = params.moment_direction.sin_cos();
    Vector3::new(0.0, sine, cosine)
}

/// Centres and rotations of the exact discrete specimen bent by `angle` about `axis`; the grip comes last.
fn polygon(
    specimen: &ResolvedSpecimen,
    axis: &Vector3<f64>,
    angle: f64,
) -> (Vec<Vector3<f64>>, Vec<UnitQuaternion<f64>>) {
    let (n, l) = (specimen.segments, specimen.segment_length);
    let turn = |a: f64| UnitQuaternion::from_scaled_axis(axis * a);
    let (mut positions, mut turns) = (Vec::new(), Vec::new());
    let mut end = Vector3::zeros();
    for i in 0..n {
        let turned = turn(angle * (i as f64 + 0.5) / n as f64);
        let side = turned * Vector3::x() * l;
        positions.push(end + 0.5 * side);
        turns.push(turned);
        end += side;
    }
    positions.push(end);
    turns.push(turn(angle));
    (positions, turns)
}

fn measure(scene: &Scene, specimen: &ResolvedSpecimen, axis: &Vector3<f64>, angle: f64) -> Row {
    let n = specimen.segments;
    let length = specimen.segment_length * n as f64;
    let joints = read(scene, n);
    let exact = |j: usize| angle * specimen.joint_length(j) / length;
    let errors = joints.iter().enumerate();
    let errors = errors.map(|(j, r)| (r.bend / exact(j) - 1.0).abs());
    let tip = scene.bodies.position[n];
    let discrete = polygon(specimen, axis, angle).0[n];
    let radius = length / angle;
    let arc = Vector3::x() * (radius * angle.sin())
        + axis.cross(&Vector3::x()) * (radius * (1.0 - angle.cos()));
    let found = radius_of_centres(&scene.bodies.position[..n]);
    // The angle between two segments is that of the joints between them.
    let between = |joints: &[super::Reading]| joints.iter().map(|r| r.bend).sum::<f64>();
    let deviation = |found: f64| found / radius - 1.0;
    Row {
        material: String::new(),
        segments: n,
        joint: String::new(),
        direction_rad: 0.0,
        angle_theory: angle,
        moment_nm: 0.0,
        angle_error: largest(errors),
        tip_error: (tip - discrete).norm() / length,
        tip_from_arc: (tip - arc).norm() / length,
        radius_m: found,
        radius_deviation: deviation(found),
        half_missing_deviation: deviation(length / between(&joints[..n])),
        ends_missing_deviation: deviation(length / between(&joints[1..n])),
    }
}

/// Radius of the circle through the three middle ones of some points \[m].
fn radius_of_centres(points: &[Vector3<f64>]) -> f64 {
    // Neighbours: on a full circle the outer points come together.
    let middle = points.len() / 2;
    let (a, b, c) = (points[middle - 1], points[middle], points[middle + 1]);
    let (p, q) = (b - a, c - b);
    let area = p.cross(&q).norm();
    p.norm() * q.norm() * (c - a).norm() / (2.0 * area)
}

/// Deviations of one measure at one angle over N: steel, Cosserat joint, in the plane.
#[must_use]
pub fn deviations(rows: &[Row], angle: f64, measure: fn(&Row) -> f64) -> Vec<(usize, f64)> {
    let steel = |r: &&Row| {
        r.material == MATERIALS[2].0
            && r.joint == Joint::Cosserat.name()
            && r.direction_rad == 0.0
            && (r.angle_theory - angle).abs() < 1e-9
    };
    let rows = rows.iter().filter(steel);
    rows.map(|r| (r.segments, measure(r))).collect()
}

/// The paper's deviations of N = 6 and N = 24.
const PUBLISHED: [(usize, f64); 2] = [(6, 0.10), (24, 0.025)];

/// The measures of the radius: name, value, order expected.
type Measure = (&'static str, fn(&Row) -> f64, f64);
const MEASURES: [Measure; 3] = [
    ("through the centres", |r| r.radius_deviation, 2.0),
    (
        "L/angle, half a segment missing",
        |r| r.half_missing_deviation,
        1.0,
    ),
    (
        "L/angle, both ends missing",
        |r| r.ends_missing_deviation,
        1.0,
    ),
];

/// Checks, tables, rows and charts.
///
/// # Errors
/// Rows that cannot be written.
pub fn outcome(rows: &[Row]) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for (material, _) in MATERIALS {
        let of = |measure: fn(&Row) -> f64| {
            largest(rows.iter().filter(|r| r.material == material).map(measure))
        };
        let row = |what: &str, reference: &str, error: f64| {
            let case = format!("bend, {material}: {what}");
            let ours = format!("{error:.1e}");
            Check::within(case, reference.to_owned(), ours, error, BAR).by(
                "largest error over N, joints, directions of the moment and loads to the circle",
            )
        };
        checks.push(row("angle of a joint", "M l/YI", of(|r| r.angle_error)));
        // A zero takes the rows of the other directions out of the maximum.
        checks.push(row("end of the cable, over L", "polygon", {
            of(|r| {
                if r.direction_rad == 0.0 {
                    r.tip_error
                } else {
                    0.0
                }
            })
        }));
        checks.push(row("end, moment at 45°, to ¾ circle", "polygon", {
            of(|r| {
                if r.direction_rad == 0.0 {
                    0.0
                } else {
                    r.tip_error
                }
            })
        }));
    }
    let closing = largest(
        rows.iter()
            .filter(|r| (r.angle_theory - TAU).abs() < 1e-9 && r.direction_rad == 0.0)
            .map(|r| r.tip_from_arc),
    );
    let ours = format!("{closing:.1e}");
    let reference = "a closed circle".to_owned();
    checks.push(
        Check::within("bend: M = 2π YI/L closes", reference, ours, closing, BAR)
            .by("distance of the ends over L, for every N, moment along an axis of the section"),
    );
    let full = |measure: fn(&Row) -> f64| deviations(rows, TAU, measure);
    let quarter = |measure: fn(&Row) -> f64| deviations(rows, 0.25 * TAU, measure);
    for (name, measure, expected) in MEASURES {
        let finest: Vec<_> = quarter(measure).into_iter().filter(|d| d.0 >= 12).collect();
        let found = order(&finest).unwrap_or(f64::NAN);
        checks.push(
            Check::within(
                format!("bend: order in N, {name}"),
                format!("{expected}"),
                format!("{found:.3}"),
                (found - expected).abs(),
                0.1,
            )
            .by("order of the radius' deviation from YI/M, N = 12 to 24, a quarter of a circle"),
        );
    }
    checks.extend(published(&full));
    checks.push(stability_of_the_plane()?);
    Ok(Outcome {
        checks,
        text: tables(rows),
        csv: csv(rows)?,
        charts: charts(rows),
        ..Outcome::default()
    })
}

/// Up to which part of a circle the plane shape is stable, with two time steps.
fn stability_of_the_plane() -> Result<Check, ExperimentError> {
    const PARTS: [f64; 5] = [0.75, 0.8, 0.85, 0.9, 1.0];
    let segments = SEGMENTS[SEGMENTS.len() - 1];
    let mut stable = [0.0_f64; 2];
    for (stable, refined) in stable.iter_mut().zip([1.0, 2.0]) {
        for part in PARTS {
            if growth_out_of_plane(segments, part, refined)? > 10.0 {
                break;
            }
            *stable = part;
        }
    }
    let verdict = if stable[0] >= 1.0 && stable[1] >= 1.0 {
        Verdict::Holds
    } else {
        Verdict::HoldsOnlyIf
    };
    Ok(Check::claim(
        format!("bend: the plane circle is stable, N = {segments}"),
        "a cable bent to a circle",
        format!(
            "to {} of a circle, {} at half the step",
            stable[0], stable[1]
        ),
        verdict,
        "undisturbed out of its plane: a moment of fixed direction follows no potential, and the plane shape is an \
         unstable equilibrium near the full circle",
    ))
}

fn published(full: &impl Fn(fn(&Row) -> f64) -> Vec<(usize, f64)>) -> Vec<Check> {
    let at = |measure, n: usize| {
        let all = full(measure);
        all.iter()
            .find(|d| d.0 == n)
            .map_or(f64::NAN, |d| d.1.abs())
    };
    let mut checks = Vec::new();
    for (n, printed) in PUBLISHED {
        let ours = at(MEASURES[0].1, n);
        let note = "the deviation depends on where the radius is measured; see the orders";
        checks.push(
            Check::published(
                format!("bend: deviation at N = {n}"),
                format!("{} %", 100.0 * printed),
                format!("{:.2} %", 100.0 * ours),
                (ours / printed - 1.0).abs(),
                0.25,
            )
            .by("relative difference of the deviations; radius through the segments' centres at the full circle")
            .noting(note),
        );
    }
    let misfit = |measure| {
        let ratios = PUBLISHED.map(|(n, printed)| (at(measure, n) / printed).ln().abs());
        ratios[0].max(ratios[1])
    };
    let best = MEASURES
        .iter()
        .min_by(|a, b| misfit(a.1).total_cmp(&misfit(b.1)));
    if let Some((name, measure, _)) = best {
        let [a, b] = PUBLISHED.map(|(n, _)| 100.0 * at(*measure, n));
        let factor = misfit(*measure).exp();
        let verdict = if factor <= 1.2 {
            Verdict::HoldsOnlyIf
        } else {
            Verdict::DoesNotHold
        };
        checks.push(Check::claim(
            "bend: the measure nearest to the paper's",
            "10 %, 2.5 % at N = 6, 24",
            format!("{name}: {a:.1} %, {b:.2} %"),
            verdict,
            "10 % to 2.5 % over four times the segments is first order: the cable's end half segments are left out of \
             the bending; with end joints of half a segment's compliance the deviation is of second order",
        ));
    }
    checks
}

fn tables(rows: &[Row]) -> String {
    let mut t = table(&[
        "radius of steel at the full circle",
        "N = 3",
        "6",
        "12",
        "24",
        "order, 12 to 24",
    ]);
    for (name, measure, _) in MEASURES {
        let found = deviations(rows, TAU, measure);
        let mut cells = vec![name.to_owned()];
        for n in SEGMENTS {
            let cell = found.iter().find(|d| d.0 == n);
            cells.push(cell.map_or_else(String::new, |d| format!("{:+.2} %", 100.0 * d.1)));
        }
        let finest: Vec<_> = found.into_iter().filter(|d| d.0 >= 12).collect();
        cells.push(order(&finest).map_or_else(String::new, |p| format!("{p:.2}")));
        t.add_row(cells);
    }
    let mut e = table(&[
        "joint",
        "N",
        "direction",
        "joint angle error",
        "tip error / L",
    ]);
    for group in rows.chunk_by(|a, b| {
        (&a.material, a.segments, &a.joint, a.direction_rad)
            == (&b.material, b.segments, &b.joint, b.direction_rad)
    }) {
        let Some(last) = group.last().filter(|r| r.material == MATERIALS[2].0) else {
            continue;
        };
        e.add_row([
            last.joint.clone(),
            last.segments.to_string(),
            format!("{:.0}°", last.direction_rad.to_degrees()),
            error(Some(largest(group.iter().map(|r| r.angle_error)))),
            error(Some(largest(group.iter().map(|r| r.tip_error)))),
        ]);
    }
    format!("{}\nsteel, largest over all loads\n{}", text(&t), text(&e))
}

fn charts(rows: &[Row]) -> Vec<Chart> {
    let end = largest(rows.iter().map(|r| r.angle_theory));
    let plane = |r: &&Row| r.direction_rad == 0.0 && r.joint == Joint::Cosserat.name();
    let mut torque = vec![Series::new(
        "theory",
        vec![[0.0, 0.0], [end, end]],
        Mark::Line,
    )];
    let mut deviation = Vec::new();
    for n in SEGMENTS {
        let of = rows.iter().filter(plane).filter(|r| r.segments == n);
        let points = of.map(|r| [1.0 / r.radius_m, r.angle_theory]).collect();
        torque.push(Series::new(format!("N = {n}"), points, Mark::Points));
    }
    for (name, measure, _) in MEASURES {
        let all = deviations(rows, TAU, measure);
        let points = all.iter().map(|&(n, d)| [n as f64, d.abs()]).collect();
        deviation.push(Series::new(name, points, Mark::LineAndPoints));
    }
    let printed = PUBLISHED.map(|(n, d)| [n as f64, d]).to_vec();
    deviation.push(Series::new("paper", printed, Mark::Points));
    vec![
        Chart {
            title: "Bend: rubber, nylon and steel".to_owned(),
            x: Axis::linear("1/R through the centres (1/m)"),
            y: Axis::linear("M L/YI"),
            series: torque,
        },
        Chart {
            title: "Deviation of the radius at the full circle".to_owned(),
            x: Axis::log("N"),
            y: Axis::log("|R M/YI − 1|"),
            series: deviation,
        },
    ]
}
