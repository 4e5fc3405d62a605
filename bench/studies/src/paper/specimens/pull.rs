//! Fig. 10: pull. ΔL/L = F/YA, whatever the number of segments.

use super::{BAR, Joint, MATERIALS, SEGMENTS, largest, params, read, settle};
use crate::checks::each;
use indicatif::ProgressBar;
use serde::Serialize;
use taut_model::{Specimen, SpecimenParams};
use taut_output::check::{Check, ExperimentError, Outcome, csv};
use taut_output::plot::{Axis, Chart, Mark, Series};
use taut_output::table::{error, table, text};

#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub segments: Vec<usize>,
    /// F/YA.
    pub strains: Vec<f64>,
}

impl Default for Config {
    /// To 50 % in steps of 5 %.
    fn default() -> Self {
        Self {
            segments: SEGMENTS.to_vec(),
            strains: (1..=10).map(|k| 0.05 * f64::from(k)).collect(),
        }
    }
}

impl Config {
    pub fn quick() -> Self {
        Self {
            strains: vec![0.01, 0.5],
            ..Self::default()
        }
    }
}

/// A specimen under one force.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    pub material: String,
    pub segments: usize,
    pub joint: String,
    /// F/YA: the strain of the continuum.
    pub strain_theory: f64,
    /// F \[N].
    pub force_n: f64,
    /// Elongation of the whole over its length.
    pub strain: f64,
    /// The paper's measure: change of the distance of the first and last segments' centres over that distance.
    pub strain_of_centres: f64,
    /// Largest relative error of a joint's gap against F l_j/YA.
    pub gap_error: f64,
    /// Relative error of the elongation against F L/YA.
    pub elongation_error: f64,
    /// Relative error of the strain of the centres against F/YA.
    pub centres_error: f64,
    /// Largest distance of a body from the axis \[m].
    pub sideways_m: f64,
}

/// Pulls every specimen, in parallel.
pub fn run(config: &Config, progress: &ProgressBar) -> Result<Vec<Row>, ExperimentError> {
    let mut tasks = Vec::new();
    for material in MATERIALS {
        for &segments in &config.segments {
            for joint in [Joint::Cosserat, Joint::Ordinary] {
                tasks.extend(
                    config
                        .strains
                        .iter()
                        .map(|&s| (material, segments, joint, s)),
                );
            }
        }
    }
    each(&tasks, progress, |&(material, segments, joint, strain)| {
        pull(material, segments, joint, strain)
    })
}

fn pull(
    material: (&str, f64),
    n: usize,
    joint: Joint,
    strain_theory: f64,
) -> Result<Row, ExperimentError> {
    let free = params(Specimen::Pull, material, n, joint);
    let force = strain_theory * free.resolve()?.stiffness.ea;
    let loaded = SpecimenParams {
        force: Some(force),
        ..free
    };
    let specimen = loaded.resolve()?;
    let scene = settle(loaded.build()?)?;
    let exact = |j: usize| force * specimen.joint_length(j) / specimen.stiffness.ea;
    let gaps = read(&scene, n);
    let gap_errors = gaps.iter().enumerate();
    let gap_errors = gap_errors.map(|(j, r)| (r.gap / exact(j) - 1.0).abs());
    let x = |i: usize| scene.bodies.position[i].x;
    let strain = (x(n) - loaded.length) / loaded.length;
    let centres = loaded.length - specimen.segment_length;
    let strain_of_centres = (x(n - 1) - x(0) - centres) / centres;
    let sideways = scene.bodies.position.iter().map(|p| p.y.hypot(p.z));
    Ok(Row {
        material: material.0.to_owned(),
        segments: n,
        joint: joint.name().to_owned(),
        strain_theory,
        force_n: force,
        strain,
        strain_of_centres,
        gap_error: largest(gap_errors),
        elongation_error: (strain / strain_theory - 1.0).abs(),
        centres_error: (strain_of_centres / strain_theory - 1.0).abs(),
        sideways_m: largest(sideways),
    })
}

/// Checks, table, rows and chart.
pub fn outcome(rows: &[Row]) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for (material, _) in MATERIALS {
        let of = |measure: fn(&Row) -> f64| {
            largest(rows.iter().filter(|r| r.material == material).map(measure))
        };
        let case = |what: &str| format!("pull, {material}: {what}");
        let row = |what: &str, reference: &str, error: f64| {
            Check::off(case(what), reference, error, "", BAR)
        };
        let all = "largest relative error over N, joints and forces";
        checks.push(row("gap of a joint", "F l/YA", of(|r| r.gap_error)).by(all));
        checks.push(row("elongation", "F L/YA", of(|r| r.elongation_error)).by(all));
    }
    let whole = largest(rows.iter().map(|r| r.elongation_error.max(r.centres_error)));
    checks.push(
        Check::off(
            "pull: independent of N",
            "on the theoretical line to 50 %",
            whole,
            "",
            BAR,
        )
        .published()
        .by(
            "elongation, and distance of the outer segments' centres, for every N: no order, exact",
        ),
    );
    Ok(Outcome {
        checks,
        text: tables(rows),
        csv: csv(rows)?,
        charts: vec![chart(rows)],
        ..Outcome::default()
    })
}

fn tables(rows: &[Row]) -> String {
    let mut t = table(&[
        "joint",
        "N",
        "F/YA at most",
        "ΔL/L",
        "between centres",
        "gap error",
        "ΔL error",
    ]);
    for row in rows.chunk_by(|a, b| (a.segments, &a.joint) == (b.segments, &b.joint)) {
        let Some(last) = row.last().filter(|r| r.material == MATERIALS[2].0) else {
            continue;
        };
        t.add_row([
            last.joint.clone(),
            last.segments.to_string(),
            format!("{}", last.strain_theory),
            format!("{:.12}", last.strain),
            format!("{:.12}", last.strain_of_centres),
            error(Some(largest(row.iter().map(|r| r.gap_error)))),
            error(Some(largest(row.iter().map(|r| r.elongation_error)))),
        ]);
    }
    format!("steel\n{}", text(&t))
}

fn chart(rows: &[Row]) -> Chart {
    let end = largest(rows.iter().map(|r| r.strain_theory));
    let line = vec![[0.0, 0.0], [end, end]];
    let mut series = vec![Series::new("theory", line, Mark::Line)];
    for n in SEGMENTS {
        let of = rows.iter().filter(|r| r.segments == n);
        let points = of.map(|r| [r.strain, r.strain_theory]).collect();
        series.push(Series::new(format!("N = {n}"), points, Mark::Points));
    }
    Chart {
        title: "Pull: rubber, nylon and steel".to_owned(),
        x: Axis::linear("ΔL/L"),
        y: Axis::linear("F/YA"),
        series,
    }
}
