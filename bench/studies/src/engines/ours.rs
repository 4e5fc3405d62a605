//! Our own step: one a frame and a few, with the cable's full joints and with ball joints, which is all that the rivals
//! have.

use taut_ground::engine::grounded::{Known, Places};
use taut_ground::engine::motion::{FRAME, Motion};
use taut_ground::engine::{Engine, Setting};
use taut_ground::trajectory::load_position;
use taut_integrator::{StepOptions, Stepper};
use taut_model::{HoistParams, JointKind};

/// The default, what it costs less with less, and what sub-steps bring.
pub(super) fn engine() -> Engine {
    let default = StepOptions::default();
    let plain = StepOptions {
        guard: None,
        refinements: 0,
        ..default.clone()
    };
    let substeps = |substeps| StepOptions {
        substeps,
        ..default.clone()
    };
    let full = JointKind::Cosserat;
    let settings = vec![
        setting("default, 1 step", full, default.clone()),
        setting("no guard, unrefined", full, plain.clone()),
        setting("2 sub-steps", full, substeps(2)),
        setting("4 sub-steps", full, substeps(4)),
        setting("ball joints", JointKind::Spherical, default),
        setting("both", JointKind::Spherical, plain),
    ];
    Engine {
        name: "taut",
        ladders: vec![settings],
        all: true,
    }
}

/// The default, for the ground.
pub(super) fn on_ground() -> Engine<Known, Places> {
    let options = StepOptions {
        dt: FRAME,
        ..StepOptions::default()
    };
    let setting = Setting {
        text: "default, 1 step".to_owned(),
        substeps: options.substeps,
        start: Box::new(move |known: &Known| {
            let mut stepper = Stepper::new(known.scene.clone(), options.clone())?;
            Ok(Box::new(move || {
                stepper.step().map_err(|e| e.to_string())?;
                Ok(stepper.scene().bodies.position.clone())
            }))
        }),
    };
    Engine {
        name: "taut",
        ladders: vec![vec![setting]],
        all: true,
    }
}

fn setting(text: &str, joint: JointKind, options: StepOptions) -> Setting {
    let options = StepOptions {
        dt: FRAME,
        ..options
    };
    Setting {
        text: text.to_owned(),
        substeps: options.substeps,
        start: Box::new(move |motion: &Motion| {
            let motion = Motion {
                params: HoistParams {
                    joint,
                    ..motion.params.clone()
                },
                angle: motion.angle,
            };
            let mut stepper = Stepper::new(motion.scene()?, options.clone())?;
            Ok(Box::new(move || {
                stepper.step().map_err(|e| e.to_string())?;
                Ok(load_position(stepper.scene()))
            }))
        }),
    }
}
