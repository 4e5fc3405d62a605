//! Fig. 10: pull. ΔL/L = F/YA, whatever the number of segments.

use super::{Joint, MATERIALS, SEGMENTS, largest, params, read, settle, summed, worst};
use crate::checks::each;
use crate::options::pick;
use crate::paper::words::{self, chart, diagonal, series, table, tell};
use indicatif::ProgressBar;
use serde_json::{Value, json};
use taut_model::{Specimen, SpecimenParams};
use taut_output::check::{ExperimentError, Outcome};
use taut_output::plot::Mark;

/// Pulls every specimen, in parallel, to strains F/YA of 50 % in steps of 5 %; quick to two.
pub fn run(quick: bool, progress: &ProgressBar) -> Result<Vec<Value>, ExperimentError> {
    let strains: Vec<f64> = (1..=10).map(|k| 0.05 * f64::from(k)).collect();
    let strains = pick(quick, [strains, vec![0.01, 0.5]]);
    let mut tasks = Vec::new();
    for material in MATERIALS {
        for n in SEGMENTS {
            for joint in [Joint::Cosserat, Joint::Ordinary] {
                tasks.extend(strains.iter().map(|&s| (material, n, joint, s)));
            }
        }
    }
    each(&tasks, progress, |&(material, segments, joint, strain)| {
        pull(material, segments, joint, strain)
    })
}

/// A specimen under one force: the strain F/YA of the continuum and that of the whole; the paper's measure, change of the
/// distance of the first and last segments' centres over that distance; relative errors, the largest of a joint's gap against
/// F l_j/YA, of the elongation and of the centres; the largest distance of a body from the axis.
fn pull(
    material: (&str, f64),
    n: usize,
    joint: Joint,
    strain_theory: f64,
) -> Result<Value, ExperimentError> {
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
    Ok(json!({
        "material": material.0,
        "segments": n,
        "joint": joint,
        "strain_theory": strain_theory,
        "force_n": force,
        "strain": strain,
        "strain_of_centres": strain_of_centres,
        "gap_error": largest(gap_errors),
        "elongation_error": (strain / strain_theory - 1.0).abs(),
        "centres_error": (strain_of_centres / strain_theory - 1.0).abs(),
        "sideways_m": largest(sideways),
    }))
}

/// Checks, table, rows and chart.
pub fn outcome(rows: &[Value]) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for (material, _) in MATERIALS {
        let said = |name, key| {
            let own = rows.iter().filter(|row| row["material"] == material);
            tell(name, json!({ "material": material })).off(worst(own, key))
        };
        checks.push(said("pull-gap", "gap_error"));
        checks.push(said("pull-elongation", "elongation_error"));
    }
    let whole = ["elongation_error", "centres_error"].map(|key| worst(rows, key));
    checks.push(tell("pull", json!({})).off(largest(whole.into_iter())));
    let errors = ["gap_error", "elongation_error"];
    let steel = summed(rows, &["segments", "joint"], &errors);
    let axes = ["strain", "strain_theory"];
    let mut lines = vec![diagonal("theory", worst(rows, "strain_theory"))];
    lines.extend(series(rows, "N = {segments}", axes, Mark::Points));
    let text = format!("steel\n{}", table("pull", &steel));
    words::outcome(checks, text, rows, vec![chart("pull", &Value::Null, lines)])
}
