//! A gantry crane that an operator drives: trolley and hoist follow speeds that are set between steps.
//!
//! `cargo run -p taut-integrator --example crane`

use std::error::Error;
use std::process::ExitCode;
use taut_integrator::{StepOptions, Stepper};
use taut_model::{Controls, GantryParams};

/// Speeds asked for by the operator at time t \[s]: travel for 4 s, then hoist for 4 s, then stop.
fn operator(t: f64) -> Controls {
    Controls {
        trolley_speed: if t < 4.0 { 0.5 } else { 0.0 }, // m/s
        hoist_speed: if (4.0..8.0).contains(&t) { 0.25 } else { 0.0 }, // m/s, upwards
    }
}

/// The error in its own words, which `fn main() -> Result` would not print.
fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("crane: {e}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let scene = GantryParams {
        mass_ratio: 1e3,
        ..GantryParams::default()
    }
    .build()?;
    let (trolley, hook) = (scene.body("trolley")?, scene.body("hook")?);
    let hanger = scene.constraint("bottom")?; // the joint above the load
    let start = scene.bodies.position.clone();
    let mut stepper = Stepper::new(scene, StepOptions::default())?;
    println!(
        "{:>6} {:>12} {:>9} {:>9} {:>12}",
        "t [s]", "trolley [m]", "hook x", "hook z", "tension [kN]"
    );
    while stepper.time() < 10.0 {
        stepper.set_controls(&operator(stepper.time()))?;
        let report = stepper.step()?;
        let frame = (report.time * 60.0).round() as u64;
        if frame.is_multiple_of(60) {
            let at = &stepper.scene().bodies.position; // m, world
            println!(
                "{:6.2} {:12.4} {:9.4} {:9.4} {:12.2}",
                report.time,
                at[trolley].x,
                at[hook].x,
                at[hook].z,
                1e-3 * stepper.tension(hanger).unwrap_or(f64::NAN)
            );
        }
    }
    let at = &stepper.scene().bodies.position;
    let (travelled, lifted) = (at[trolley].x - start[trolley].x, at[hook].z - start[hook].z);
    println!("travelled {travelled:.3} m of 2, lifted {lifted:.3} m of 1");
    if (travelled - 2.0).abs() > 0.05 || (lifted - 1.0).abs() > 0.1 {
        return Err("the crane is not where it was driven".into());
    }
    Ok(())
}

#[test]
fn runs() {
    run().unwrap();
}
