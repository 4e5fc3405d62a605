//! A load of 10 t on 10 m of steel cable, swung by its anchor: what the smallest program with a cable needs.
//!
//! `cargo run -p taut-integrator --example hanging_load`

use std::error::Error;
use std::process::ExitCode;
use taut_integrator::{StepOptions, Stepper};
use taut_model::HoistParams;

/// The error in its own words, which `fn main() -> Result` would not print.
fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("hanging_load: {e}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let scene = HoistParams {
        segments: 24,
        length: 10.0,            // m
        segment_mass: Some(1.0), // kg
        load_mass: Some(1e4),    // kg
        move_x: 0.5,             // m, the anchor
        move_duration: 1.0,      // s
        equilibrium: true,
        ..HoistParams::default()
    }
    .build()?;
    let (load, anchor) = (scene.body("load")?, scene.constraint("anchor")?);

    // The solver is the first that the features bring: here that is all there is to choosing one.
    let mut stepper = Stepper::new(scene, StepOptions::default())?;
    println!("solver {}", stepper.options().backend);
    println!(
        "{:>6} {:>9} {:>9} {:>12} {:>8}",
        "t [s]", "x [m]", "z [m]", "tension [kN]", "µs/step"
    );
    let mut slowest = 0.0_f64;
    for frame in 1..=300 {
        let report = stepper.step()?;
        slowest = slowest.max(report.phases.total().as_secs_f64());
        if frame % 60 == 0 {
            let x = stepper.scene().bodies.position[load]; // m, world
            let tension = stepper.tension(anchor).ok_or("the anchor has no tension")?; // N
            let micros = 1e6 * report.phases.total().as_secs_f64();
            println!(
                "{:6.2} {:9.4} {:9.4} {:12.2} {:8.1}",
                report.time,
                x.x,
                x.z,
                1e-3 * tension,
                micros
            );
            // It swings: its weight is 98.1 kN, and no more than a third is added to it or taken away.
            let weight = 1e4 * 9.81;
            if (tension / weight - 1.0).abs() > 1.0 / 3.0 {
                return Err(
                    format!("a tension of {tension} N is not that of a swinging load").into(),
                );
            }
        }
    }
    println!("slowest step: {:.0} µs of a frame's 16 667", 1e6 * slowest);
    Ok(())
}

#[test]
fn runs() {
    run().unwrap();
}
