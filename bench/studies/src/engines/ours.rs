//! Our own step: one a frame and a few, with the cable's full joints and with ball joints, which is all that the baselines
//! have.

use taut_integrator::{StepError, StepOptions, Stepper};
use taut_measure::engine::contact_scenes::{Known, Places};
use taut_measure::engine::motion::{FRAME, Motion};
use taut_measure::engine::{Engine, Setting};
use taut_measure::trajectory::load_position;
use taut_model::{HoistParams, JointKind, Scene};

/// The default, what it costs less with less, and what sub-steps bring.
pub(super) fn on_hoist() -> Engine {
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
    let (full, balls) = (JointKind::Cosserat, JointKind::Spherical);
    let settings = [
        ("default, 1 step", full, default.clone()),
        ("no guard, unrefined", full, plain.clone()),
        ("2 sub-steps", full, substeps(2)),
        ("4 sub-steps", full, substeps(4)),
        ("ball joints", balls, default.clone()),
        ("both", balls, plain),
    ];
    let settings = settings.map(|(text, joint, options)| {
        let scene = move |motion: &Motion| {
            let params = HoistParams {
                joint,
                ..motion.params.clone()
            };
            Motion { params, ..*motion }.scene().map_err(Into::into)
        };
        setting(text, options, scene, load_position)
    });
    engine(settings.into())
}

/// The default, for the ground.
pub(super) fn on_ground() -> Engine<Known, Places> {
    let scene = |known: &Known| Ok(known.scene.clone());
    let places = |scene: &Scene| scene.bodies.position.clone();
    let default = StepOptions::default();
    engine(vec![setting("default, 1 step", default, scene, places)])
}

fn engine<M, P>(settings: Vec<Setting<M, P>>) -> Engine<M, P> {
    Engine {
        name: "taut",
        ladders: vec![settings],
        all: true,
    }
}

fn setting<M, P: 'static>(
    text: &str,
    options: StepOptions,
    scene: impl Fn(&M) -> Result<Scene, StepError> + 'static,
    observe: fn(&Scene) -> P,
) -> Setting<M, P> {
    let options = StepOptions {
        dt: FRAME,
        ..options
    };
    Setting {
        text: text.to_owned(),
        substeps: options.substeps,
        start: Box::new(move |motion: &M| {
            let mut stepper = Stepper::new(scene(motion)?, options.clone())?;
            Ok(Box::new(move || {
                stepper.step().map_err(|e| e.to_string())?;
                Ok(observe(stepper.scene()))
            }))
        }),
    }
}
