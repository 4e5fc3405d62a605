//! Fig. 10: pull. ΔL/L = F/YA, whatever the number of segments.

use super::{Joint, MATERIALS, off_exact, params, summed, tasks};
use crate::checks::each;
use crate::options::pick;
use crate::paper::words::{self, chart, judged, largest, table};
use crate::rest::{read, settle};
use indicatif::ProgressBar;
use serde_json::{Value, json};
use taut_model::{Specimen, SpecimenParams};
use taut_output::check::{ExperimentError, Outcome};

/// Pulls every specimen, in parallel, to strains F/YA of 50 % in steps of 5 %; quick to two.
pub fn run(quick: bool, progress: &ProgressBar) -> Result<Vec<Value>, ExperimentError> {
    let strains: Vec<f64> = (1..=10).map(|k| 0.05 * f64::from(k)).collect();
    let strains = pick(quick, [strains, vec![0.01, 0.5]]);
    let of = |joint| strains.iter().map(move |&strain| (joint, strain));
    let variants: Vec<_> = [Joint::Cosserat, Joint::Ordinary]
        .into_iter()
        .flat_map(of)
        .collect();
    let tasks = tasks(&MATERIALS, &variants);
    each(&tasks, progress, |&(material, n, (joint, strain))| {
        pull(material, n, joint, strain)
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
        "gap_error": off_exact(&read(&scene, n), |r| r.gap, exact),
        "elongation_error": (strain / strain_theory - 1.0).abs(),
        "centres_error": (strain_of_centres / strain_theory - 1.0).abs(),
        "sideways_m": largest(sideways),
    }))
}

/// Checks, table, rows and chart.
pub fn outcome(rows: &[Value]) -> Result<Outcome, ExperimentError> {
    let mut checks = judged(rows, "material", &["pull-gap", "pull-elongation"]);
    checks.extend(judged(rows, "", &["pull"]));
    let errors = ["gap_error", "elongation_error"];
    let steel = summed(rows, &["segments", "joint"], &errors);
    let text = format!("steel\n{}", table("pull", &steel));
    words::outcome(checks, text, rows, vec![chart("pull", &Value::Null, rows)])
}
