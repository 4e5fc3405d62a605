//! H37: Greenhill's torque in motion, with and without tension.
//!
//! A cable of EI = 30 N m², GJ = 25 N m², 2 m, between a clamp and a grip in a bearing, which draws it by P and lets it turn
//! about the axis only; a torque on the grip, small random velocities, the default step at 1/60 s. Below the chain's own
//! buckling torque ([`buckling_torque`]) it stays straight, above it leaves.

use crate::hard::either;
use crate::paper::specimens::twist::buckling_torque;
use indicatif::ProgressBar;
use std::f64::consts::PI;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Scene, SceneError, Specimen, SpecimenParams};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};

const LENGTH: f64 = 2.0;
const EI: f64 = 30.0;
const EA: f64 = 1e6;
/// Parts of the buckling torque below and above it.
const BELOW: f64 = 0.95;
const ABOVE: f64 = 1.1;
/// Distance from the axis within which the cable is straight, and beyond which it has left \[m].
const BAR: f64 = 1e-5;
const LEFT: f64 = 1e-3;

/// The cable under P = `tension` EIπ²/L² and `torque` (N m).
pub(super) fn scene(segments: usize, tension: f64, torque: f64) -> Result<Scene, SceneError> {
    let params = SpecimenParams {
        segments,
        length: LENGTH,
        ei: Some(EI),
        gj: Some(25.0),
        ea: Some(EA),
        force: Some(tension * EI * (PI / LENGTH).powi(2)),
        torque: Some(torque),
        bearing: true,
        seed: 4,
        ..SpecimenParams::new(Specimen::Twist)
    };
    params.build()
}

/// Largest distance from the axis in `time` (s) of the default step; infinite where the cable is lost.
fn off_axis(scene: Scene, time: f64) -> Result<f64, ExperimentError> {
    let mut stepper = Stepper::new(scene, StepOptions::default())?;
    let mut farthest = 0.0_f64;
    for _ in 0..taut_ground::trajectory::steps_in(time, stepper.options().dt) {
        match stepper.step() {
            Ok(_) => {}
            Err(StepError::NonFinite { .. }) => return Ok(f64::INFINITY),
            Err(e) => return Err(e.into()),
        }
        farthest = super::worse(
            farthest,
            super::super::statics::buckling::off_axis(stepper.scene()),
        );
    }
    Ok(farthest)
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let (counts, tensions): (&[usize], &[f64]) = either(
        quick,
        (&[20], &[0.0, 10.0]),
        (&[8, 12, 20, 40, 60], &[0.0, 1.0, 3.0, 10.0]),
    );
    progress.set_length((counts.len() * tensions.len()) as u64);
    let mut checks = Vec::new();
    for (&n, &tension) in counts
        .iter()
        .flat_map(|n| tensions.iter().map(move |p| (n, p)))
    {
        let slenderness = EA * LENGTH * LENGTH / EI;
        let own = EI / LENGTH * buckling_torque(n, slenderness, tension * PI * PI);
        let at = |part: f64| off_axis(scene(n, tension, part * own)?, 10.0);
        let case = format!("N = {n}, P = {tension} EIπ²/L²");
        let (below, above) = (at(BELOW)?, at(ABOVE)?);
        checks.push(
            Check::off(
                format!("{case}: at {BELOW} of {own:.2} N m"),
                "straight",
                below,
                "m",
                BAR,
            )
            .by("largest distance from the axis in 10 s"),
        );
        checks.push(Check::claim(
            format!("{case}: at {ABOVE} of it"),
            "buckles",
            format!("{above:.1e} m"),
            Verdict::of(above > LEFT),
            "largest distance from the axis in 10 s",
        ));
        progress.inc(1);
    }
    Ok(checks.into())
}
