//! `taut view`: a scene to be driven from a browser.

use super::run::every;
use super::signals::signals;
use super::{Failure, SceneArgs, StepArgs, step_options};
use crate::run;
use crate::run_file::RunFile;
use clap::Args;
use std::sync::Arc;
use taut_integrator::{SavedRun, StepOptions};
use taut_measure::{files, trajectory};
use taut_view::{Drive, View};

pub(crate) const AFTER_HELP: &str = "\
Examples:
  taut view gantry
  taut view integrator/examples/tower_crane.toml --backend cg:group --port 8021";

#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    step: StepArgs,
    /// Estimates the error of the load's position, by a coarse run of steps so many times as long: off, or 2 and more
    #[arg(
        long,
        value_name = "K",
        default_value = "2",
        allow_hyphen_values = true
    )]
    estimate: String,
    /// Port of the page, on this machine alone; 0 for one that is free
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
}

/// Serves until a signal comes.
pub(crate) fn run(args: &ViewArgs) -> Result<(), Failure> {
    let prepared = run::prepare(args.scene.built()?);
    let options = StepOptions {
        energy_tolerance: Some(trajectory::ENERGY_TOLERANCE),
        estimate: every(&args.estimate)?,
        ..step_options(&args.step)?
    };
    let yardstick = prepared.yardstick;
    let mut drive = Drive::new(prepared.scene, options)?;
    let title = drive.stepper().scene().name.clone();
    let save = move |run: SavedRun| {
        let controls = run.scene().controls.iter();
        let driven = controls.map(|control| control.name.clone()).collect();
        let file = RunFile::new(run, yardstick, driven);
        file.bytes().map_err(|e| e.to_string())
    };
    let mut view = View::open(args.port, &title, Box::new(save))?;
    let signals = signals()?;
    drive.stop_by(Arc::clone(&signals.asked));
    files::print(&format!(
        "{}: {}\nOpen this address in a browser on this machine. Ctrl-C ends.\n",
        files::line(&title),
        view.address()
    ))?;
    view.run(&mut drive, &|| signals.last() != 0)?;
    Ok(())
}
