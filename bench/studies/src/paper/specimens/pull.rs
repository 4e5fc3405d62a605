//! Fig. 10: pull. ΔL/L = F/YA, whatever the number of segments.

use super::{Joint, MATERIALS, SEGMENTS, largest, params, read, settle, summed, worst};
use crate::checks::each;
use crate::paper::words::{self, chart, diagonal, rows as rows_of, series, table, tell};
use indicatif::ProgressBar;
use serde::Serialize;
use serde_json::{Value, json};
use taut_model::{Specimen, SpecimenParams};
use taut_output::check::{ExperimentError, Outcome, csv};
use taut_output::plot::Mark;

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
        for &n in &config.segments {
            for joint in [Joint::Cosserat, Joint::Ordinary] {
                tasks.extend(config.strains.iter().map(|&s| (material, n, joint, s)));
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
    let all = rows_of(rows);
    let mut checks = Vec::new();
    for (material, _) in MATERIALS {
        let said = |name, key| {
            let own = all.iter().filter(|row| row["material"] == material);
            tell(name, json!({ "material": material })).off(worst(own, key))
        };
        checks.push(said("pull-gap", "gap_error"));
        checks.push(said("pull-elongation", "elongation_error"));
    }
    let whole = ["elongation_error", "centres_error"].map(|key| worst(&all, key));
    checks.push(tell("pull", json!({})).off(largest(whole.into_iter())));
    let errors = ["gap_error", "elongation_error"];
    let steel = summed(rows, &["segments", "joint"], &errors);
    let axes = ["strain", "strain_theory"];
    let mut lines = vec![diagonal("theory", worst(&all, "strain_theory"))];
    lines.extend(series(&all, "N = {segments}", axes, Mark::Points));
    let text = format!("steel\n{}", table("pull", &steel));
    let charts = vec![chart("pull", &Value::Null, lines)];
    Ok(words::outcome(checks, text, csv(rows)?, charts))
}
