//! Commands and frames.

use super::*;
use taut_model::{GantryParams, HoistParams};
use taut_recording::Recording;

fn options() -> StepOptions {
    StepOptions {
        backend: "dense".parse().expect("a backend"),
        ..StepOptions::default()
    }
}

fn gantry() -> Drive {
    let params = GantryParams {
        segments: 3,
        separate_ropes: true,
        ..GantryParams::default()
    };
    Drive::new(params.build().expect("builds"), options()).expect("sound")
}

fn ask(drive: &mut Drive, command: &str) -> Option<String> {
    let command = serde_json::from_str(command).expect("a command");
    drive.command(command).err()
}

fn load(drive: &Drive) -> f64 {
    let scene = drive.stepper().scene();
    scene.bodies.position[scene.load.expect("a load")].x
}

#[test]
fn frames_say_where_things_are() {
    let mut drive = gantry();
    drive.advance(0.5, &|| true);
    assert_eq!(drive.status().steps, 31);
    let frame = drive.frame();
    let about = drive.about();
    let word = |k: usize| <[u8; 4]>::try_from(&frame[4 * k..4 * k + 4]).expect("four bytes");
    assert_eq!(u32::from_le_bytes(word(0)), about.generation);
    assert_eq!(frame.len(), 16 + 4 * about.layout.channels.len());
    let x = about.layout.channel("load.x").expect("a channel");
    assert_eq!(f32::from_le_bytes(word(4 + x)), load(&drive) as f32);
    assert_eq!(about.controls.len(), drive.status().controls.len());
}

#[test]
fn controls_drive_together_and_one_by_one() {
    let mut drive = gantry();
    let names: Vec<_> = drive.about().controls.into_iter().map(|c| c.0).collect();
    assert_eq!(names, ["trolley_speed", "rope_1_speed", "rope_2_speed"]);
    let begun = load(&drive);
    let found = ask(
        &mut drive,
        r#"{"set": {"control": "trolley_speed", "value": 0.5}}"#,
    );
    assert_eq!(found, None);
    drive.advance(2.0, &|| true);
    assert!(load(&drive) > begun + 0.5);
    assert_eq!(drive.status().controls[0], [Some(0.5)]);
    let alone = r#"{"set": {"control": "trolley_speed", "drive": "rail", "value": 0.25}}"#;
    assert_eq!(ask(&mut drive, alone), None);
    assert_eq!(drive.status().controls[0], [Some(0.25)]);
    for command in [
        r#"{"set": {"control": "none", "value": 0.5}}"#,
        r#"{"set": {"control": "trolley_speed", "drive": "rope-1", "value": 0.5}}"#,
        r#"{"mass": -1}"#,
        r#"{"solver": "no-such"}"#,
        r#"{"scheme": "no-such"}"#,
    ] {
        let refused = ask(&mut drive, command);
        assert!(refused.is_some_and(|text| !text.is_empty()), "{command}");
        assert_eq!(drive.status().controls[0], [Some(0.25)]);
    }
    assert_eq!(ask(&mut drive, r#"{"pause": true}"#), None);
}

#[test]
fn solvers_schemes_and_masses_change_on_the_way() {
    let mut drive = gantry();
    drive.advance(0.5, &|| true);
    let generation = drive.generation();
    assert_eq!(ask(&mut drive, r#"{"solver": "dense/kkt"}"#), None);
    assert_eq!(ask(&mut drive, r#"{"scheme": "spook"}"#), None);
    assert_eq!(ask(&mut drive, r#"{"mass": 1234}"#), None);
    assert!(drive.generation() > generation);
    let status = drive.status();
    let found = (&*status.solver, &*status.scheme);
    assert_eq!(found, ("dense:double/kkt", "spook"));
    let layout = drive.about().layout;
    assert_eq!(layout.bodies[layout.load.expect("a load")].mass, 1234.0);
    let time = drive.stepper().time();
    drive.advance(0.5, &|| true);
    assert!((drive.stepper().time() - time - 0.5).abs() < 1e-9);
    assert_eq!(drive.status().failure, None);
    assert_eq!(ask(&mut drive, "\"restart\""), None);
    assert_eq!(drive.status().steps, 1);
    assert_eq!(drive.status().solver, "dense:double/kkt");
}

#[test]
fn what_stands_still_moves_by_single_steps_only() {
    let mut drive = gantry();
    ask(&mut drive, r#"{"pause": true}"#);
    drive.advance(1.0, &|| true);
    assert_eq!(drive.status().steps, 1);
    ask(&mut drive, "\"step\"");
    assert_eq!(drive.status().steps, 2);
    ask(&mut drive, r#"{"pause": false}"#);
    drive.advance(0.1, &|| true);
    assert_eq!(drive.status().steps, 8);
}

#[test]
fn ropes_pay_out_together_or_alone() {
    let scene = GantryParams::default().build().expect("builds");
    let mut drive = Drive::new(scene, options()).expect("sound");
    ask(
        &mut drive,
        r#"{"set": {"control": "hoist_speed", "value": 0.5}}"#,
    );
    assert_eq!(drive.status().controls[1], [Some(0.5); 2]);
    let alone = r#"{"set": {"control": "hoist_speed", "drive": "rope-2", "value": -0.25}}"#;
    assert_eq!(ask(&mut drive, alone), None);
    assert_eq!(drive.status().controls[1], [Some(0.5), Some(-0.25)]);
}

/// Segments have merged since the last frame, and the load has another number.
#[test]
fn a_mass_is_that_of_the_load_without_frames_between() {
    let text = include_str!("../../../../integrator/examples/rope.toml");
    let source = taut_model::SceneSource::parse(text, &[]).expect("read");
    let mut drive = Drive::new(source.build().expect("builds"), options()).expect("sound");
    drive.frame();
    let bodies = drive.stepper().scene().bodies.len();
    while drive.stepper().scene().bodies.len() == bodies {
        drive.advance(1.0 / 60.0, &|| true);
    }
    assert_eq!(ask(&mut drive, r#"{"mass": 25}"#), None);
    assert_eq!(drive.status().load, Some(25.0));
    let scene = drive.stepper().scene();
    let hook = scene.body_names.iter().position(|name| name == "hook");
    assert_eq!(scene.bodies.mass[hook.expect("a hook")], 25.0);
}

/// Time without steps is lost where a frame may not take longer.
#[test]
fn a_frame_ends_in_time() {
    let mut drive = gantry();
    let left = std::cell::Cell::new(3);
    let may = || {
        left.set(left.get() - 1);
        left.get() >= 0
    };
    drive.advance(1.0, &may);
    assert_eq!(drive.status().steps, 4);
    drive.advance(1.0 / 60.0, &|| true);
    assert_eq!(drive.status().steps, 5);
}

/// Frames and steps that do not fit into each other: none is lost.
#[test]
fn steps_of_any_length_keep_the_time() {
    for dt in [1.0 / 240.0, 1.0 / 100.0, 1.0 / 50.0] {
        let options = StepOptions { dt, ..options() };
        let scene = HoistParams::default().build().expect("builds");
        let mut drive = Drive::new(scene, options).expect("sound");
        for _ in 0..60 {
            drive.advance(1.0 / 60.0, &|| true);
        }
        let time = drive.stepper().time() - dt;
        assert!((time - 1.0).abs() < 1e-9, "{dt}: {time}");
    }
}

#[test]
fn recordings_hold_what_was_seen() {
    let mut drive = gantry();
    assert_eq!(drive.recorded(), None);
    ask(&mut drive, r#"{"record": true}"#);
    drive.advance(1.0, &|| true);
    assert!(drive.status().recording.is_some());
    assert!(ask(&mut drive, r#"{"record": true}"#).is_some());
    ask(&mut drive, r#"{"record": false}"#);
    let bytes = drive.recorded().expect("a recording");
    let recording = Recording::read(&mut &bytes[..]).expect("whole");
    assert_eq!(recording.frames(), 60);
    assert_eq!(recording.early(), None);
}

/// A run that has ended takes other choices, and always begins anew.
#[test]
fn a_choice_that_ends_the_run_locks_nothing() {
    // Controls of a lost run are not finite, so that no step of its options can be made from there.
    let mut drive = gantry();
    drive.advance(0.1, &|| true);
    let sound = drive.stepper().options().clone();
    for scheme in [
        "third-difference:a=1e300",
        "third-difference:a=1e5:gamma=-4e4",
    ] {
        let refused = ask(&mut drive, &format!(r#"{{"scheme": "{scheme}"}}"#));
        let says = refused.is_some_and(|text| text.contains("at most 100"));
        assert!(says, "{scheme}");
    }
    assert_eq!(*drive.stepper().options(), sound);
    let speed = r#"{"set": {"control": "trolley_speed", "value": 1e300}}"#;
    assert_eq!(ask(&mut drive, speed), None);
    drive.advance(0.5, &|| true);
    assert!(drive.status().failure.is_some());
    assert_eq!(ask(&mut drive, r#"{"scheme": "spook"}"#), None);
    assert_eq!(drive.status().scheme, "spook");
    assert!(drive.status().failure.is_some());
    assert!(ask(&mut drive, r#"{"solver": "no-such"}"#).is_some());
    assert_eq!(ask(&mut drive, r#""restart""#), None);
    let status = drive.status();
    assert_eq!((status.failure, status.steps), (None, 1));
    assert_eq!(status.scheme, "spook");
    drive.advance(0.5, &|| true);
    assert!(drive.status().steps > 20);
}

/// Where the chosen options make no step, a restart begins with those of the last step that was made.
#[test]
fn a_restart_falls_back_to_what_has_made_steps() {
    let mut drive = gantry();
    assert_eq!(ask(&mut drive, r#"{"scheme": "spook"}"#), None);
    drive.advance(0.1, &|| true);
    // No page can choose it: the first step overflows.
    let endless = |options: &mut StepOptions| options.dt = 1e200;
    assert_eq!(drive.with_options(endless), Ok(()));
    assert_eq!(ask(&mut drive, r#""step""#), None);
    assert!(drive.status().failure.is_some());
    assert_eq!(ask(&mut drive, r#""restart""#), None);
    let status = drive.status();
    assert_eq!((status.failure, status.scheme.as_str()), (None, "spook"));
    assert_eq!(drive.stepper().options().dt, StepOptions::default().dt);
    let fallback = status.fallback.expect("it tells");
    assert!(fallback.contains("makes no step"), "{fallback}");
    let holds = fallback.contains("began anew with `dense") && fallback.ends_with("`spook`");
    assert!(holds, "{fallback}");
    // Until the options hold that were chosen.
    assert_eq!(ask(&mut drive, r#""restart""#), None);
    assert_eq!(drive.status().fallback, None);
}

/// The first step of a restart looks at the flag: nothing else is tried, and the run stays.
#[test]
fn a_restart_that_is_stopped_leaves_the_run() {
    let mut drive = gantry();
    drive.advance(0.1, &|| true);
    let stop = Arc::new(AtomicBool::new(false));
    drive.stop_by(Arc::clone(&stop));
    stop.store(true, std::sync::atomic::Ordering::Relaxed);
    let (steps, time) = (drive.status().steps, drive.stepper().time());
    let refused = ask(&mut drive, r#""restart""#).expect("stopped");
    assert!(refused.contains("asked to end"), "{refused}");
    let found = (drive.status().steps, drive.stepper().time());
    assert_eq!(found, (steps, time));
    stop.store(false, std::sync::atomic::Ordering::Relaxed);
    assert_eq!(ask(&mut drive, r#""restart""#), None);
    assert_eq!(drive.status().steps, 1);
    stop.store(true, std::sync::atomic::Ordering::Relaxed);
    drive.advance(0.1, &|| true);
    assert_eq!(drive.status().steps, 1, "the new run has the flag, too");
}
