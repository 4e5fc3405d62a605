//! Recordings as they come: whole, cut, damaged, foreign, of other versions, of runs without steps or with states that are
//! not finite.

use crate::file::{self, Chunk, Header, MAGIC};
use crate::layout::Layout;
use crate::*;
use std::io::{self, Write};
use taut_integrator::{StepOptions, Stepper};
use taut_measure::trajectory::{Limits, Simulation};
use taut_model::{HoistParams, SceneSource};

fn options() -> StepOptions {
    StepOptions {
        backend: "dense".parse().expect("always there"),
        ..StepOptions::default()
    }
}

fn hoist() -> Stepper {
    let scene = HoistParams {
        segments: 3,
        mass_ratio: 50.0,
        move_x: 0.5,
        ..HoistParams::default()
    };
    Stepper::new(scene.build().expect("a scene"), options()).expect("a stepper")
}

/// Records steps, changing the stepper before each as wanted.
fn recorded(
    out: &mut dyn Write,
    budget: usize,
    mut stepper: Stepper,
    steps: usize,
    mut before: impl FnMut(&mut Stepper, usize),
) -> io::Result<()> {
    let mut recorder = Recorder::within(budget, out, &stepper, steps)?;
    let mut simulation = Simulation::new(steps, Limits::Sweep(f64::INFINITY));
    for k in 0.. {
        before(&mut stepper, k);
        let Some(sample) = simulation.step(&mut stepper) else {
            break;
        };
        recorder.step(out, &stepper, &sample)?;
    }
    recorder.end(out, stepper.time(), simulation.failure.map(|f| f.reason))
}

fn hoist_recorded(steps: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    recorded(&mut bytes, BUDGET, hoist(), steps, |_, _| ()).expect("memory");
    bytes
}

fn read(mut bytes: &[u8]) -> Result<Recording, RecordingError> {
    Recording::read(&mut bytes)
}

#[test]
fn what_is_read_is_what_was_recorded() {
    let mut stepper = hoist();
    let recording = read(&hoist_recorded(200)).expect("whole");
    assert_eq!((recording.frames(), recording.parts.len()), (200, 1));
    assert_eq!(recording.header.scene, "hoist");
    assert!(
        matches!(&recording.ending, Ending::Whole(end) if end.steps == 200 && end.reason.is_none())
    );
    assert_eq!(recording.early(), None);
    let part = &recording.parts[0];
    for frame in 0..200 {
        stepper.step().expect("stable");
        assert_eq!(part.times[frame], stepper.time());
        for (i, body) in part.layout.bodies.iter().enumerate() {
            let x = stepper.scene().bodies.position[i];
            let q = stepper.scene().bodies.orientation[i];
            let there = part.position(frame, i);
            let off = (x - nalgebra::Vector3::from(there)).amax();
            assert!(off <= 1e-6, "{frame} {i}");
            let [w, i, j, k] = [3, 4, 5, 6].map(|c| part.value(frame, body.pose + c));
            let turn =
                nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k));
            assert!(turn.angle_to(&q) < 1e-4, "{frame}: {}", turn.angle_to(&q));
        }
        for (c, name) in stepper.scene().constraint_names.iter().enumerate() {
            let channel = part.layout.channel(&format!("{name}.tension"));
            let channel = channel.expect("recorded");
            let tension = stepper.tension(c).expect("one");
            assert!((part.value(frame, channel) - tension).abs() <= 1e-6 * tension.abs());
        }
    }
}

/// Cut anywhere, a file is read up to there; whatever is damaged in it, nothing panics, and no more is read than was written.
#[test]
fn cut_and_damaged_files_are_read_as_far_as_they_are_whole() {
    let bytes = hoist_recorded(200);
    let whole = read(&bytes).expect("whole");
    let mut most = 0;
    for cut in (0..bytes.len()).step_by(3).chain([bytes.len() - 1]) {
        match read(&bytes[..cut]) {
            Ok(part) => {
                assert!(matches!(part.ending, Ending::Cut), "{cut}");
                assert!(part.early().is_some_and(|why| why.contains("cut")), "{cut}");
                assert!(part.frames() >= most && part.frames() <= 200);
                most = part.frames();
            }
            Err(e) => assert!(matches!(e, RecordingError::Nothing), "{cut}: {e}"),
        }
    }
    assert_eq!(most, 200);
    for place in (0..bytes.len()).step_by(3) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 1 << (place % 8);
        if let Ok(part) = read(&damaged) {
            assert!(part.frames() <= 200);
            for (a, b) in part.parts.iter().zip(&whole.parts) {
                assert_eq!(a.raw[..], b.raw[..a.raw.len()], "{place}");
            }
        }
    }
}

/// Chunks that are whole by their sums; of those that hold anything else the fuzzer's target is.
#[test]
fn chunks_in_another_order_are_refused() {
    let bytes = hoist_recorded(3);
    let mut from = &bytes[MAGIC.len() + 1..];
    let mut chunks = Vec::new();
    while let Some(chunk) = file::next(&mut from).expect("memory") {
        chunks.push(chunk);
    }
    assert_eq!(chunks.len(), 4);
    let header = &chunks[..1];
    for wrong in [
        &chunks[2..],
        &[&chunks[..2], header].concat(),
        &[header, &chunks[2..]].concat(),
    ] {
        let mut file = Vec::new();
        file::begin(&mut file).expect("memory");
        wrong
            .iter()
            .for_each(|c| file::put(&mut file, c).expect("memory"));
        assert!(matches!(read(&file), Err(RecordingError::Malformed { .. })));
    }
}

#[test]
fn foreign_and_newer_files_are_refused() {
    for foreign in [
        &b"time,x\n0,1\n"[..],
        b"{\"run\":1}",
        &[0xff; 100],
        b"taut-recorded\nand more",
    ] {
        let e = read(foreign).expect_err("foreign");
        assert!(matches!(e, RecordingError::Foreign), "{e}");
        assert!(e.to_string().contains("--record"), "{e}");
    }
    for nothing in [&b""[..], b"taut-rec", MAGIC] {
        let refused = matches!(read(nothing), Err(RecordingError::Nothing));
        assert!(refused, "{nothing:?}");
    }
    let mut newer = hoist_recorded(1);
    newer[MAGIC.len()] = VERSION + 1;
    let e = read(&newer).expect_err("newer");
    let refused = matches!(e, RecordingError::Newer { version } if version == VERSION + 1);
    assert!(refused, "{e}");
}

#[test]
fn a_run_of_no_steps_has_no_frames() {
    let recording = read(&hoist_recorded(0)).expect("whole");
    assert_eq!((recording.frames(), recording.span()), (0, None));
    let names = ["time".to_owned(), "load.z".to_owned()];
    let mut csv = Vec::new();
    table(&recording, &names).expect("names")(&mut csv).expect("memory");
    assert_eq!(csv, b"time,load.z\n");
    let shown = page(&[("none", &recording)]).expect("memory");
    assert!(shown.contains("\"parts\":[]"));
}

#[test]
fn a_state_that_is_not_finite_is_the_end() {
    let layout = Layout {
        channels: ["x", "y", "z", "qw", "qx", "qy", "qz"]
            .map(|q| layout::Channel {
                name: format!("ball.{q}"),
                unit: String::new(),
                step: None,
            })
            .to_vec(),
        bodies: vec![layout::Body {
            name: "ball".to_owned(),
            pose: 0,
            mass: 1.0,
            solids: Vec::new(),
            loads: Default::default(),
        }],
        load: Some(0),
        ..Layout::default()
    };
    for (bad, frames) in [(f32::NAN, 2), (f32::INFINITY, 0)] {
        let mut file = Vec::new();
        file::begin(&mut file).expect("memory");
        let mut put =
            |chunk: &Chunk, rest: &[u8]| file::write(&mut file, chunk, rest).expect("memory");
        put(&Chunk::Header(Header::default()), &[]);
        put(&Chunk::Layout(layout.clone()), &[]);
        let numbers = |k: usize| if k == frames { bad } else { 1.0 };
        let values: Vec<i32> = (0..28).map(|k| numbers(k / 7).to_bits() as i32).collect();
        let chunk = Chunk::Frames {
            times: vec![0.0, 1.0, 2.0, 3.0],
            contacts: vec![0; 4],
            events: Vec::new(),
        };
        let mut bytes = planes::encode(&values, 7);
        bytes.extend(planes::encode(&[], crate::record::OF_CONTACT));
        put(&chunk, &bytes);
        let recording = read(&file).expect("whole");
        assert_eq!(recording.frames(), frames);
        assert_eq!(recording.ending, Ending::NotFinite(frames as f64));
        assert!(page(&[("ball", &recording)]).is_ok());
    }
}

/// However many steps are made, the numbers stay within the budget. Of a run as long as announced the frames reach its end.
#[test]
fn recordings_are_bounded() {
    let (steps, budget) = (2000, 20_000);
    let run = |announced: usize| {
        let mut bytes = Vec::new();
        let mut stepper = hoist();
        let mut recorder =
            Recorder::within(budget, &mut bytes, &stepper, announced).expect("memory");
        let mut simulation = Simulation::new(steps, Limits::Sweep(f64::INFINITY));
        while let Some(sample) = simulation.step(&mut stepper) {
            recorder
                .step(&mut bytes, &stepper, &sample)
                .expect("memory");
        }
        recorder
            .end(&mut bytes, stepper.time(), None)
            .expect("memory");
        read(&bytes).expect("whole")
    };
    let end = steps as f64 / 60.0;
    for (announced, reach) in [(steps, 0.98 * end), (1, 0.1 * end)] {
        let recording = run(announced);
        let part = &recording.parts[0];
        let (frames, width) = (part.times.len(), part.layout.channels.len());
        assert!((frames - 1) * (4 * width + 12) <= budget, "{frames}");
        assert!(
            recording
                .span()
                .is_some_and(|[_, last]| last > reach && last <= end + 1e-9)
        );
    }
    // Sub-steps do not count.
    let fine = StepOptions {
        dt: 1.0 / 240.0,
        ..options()
    };
    let stepper = Stepper::new(hoist().into_scene(), fine).expect("a stepper");
    let mut bytes = Vec::new();
    recorded(&mut bytes, BUDGET, stepper, 240, |_, _| ()).expect("memory");
    let recording = read(&bytes).expect("whole");
    assert_eq!(recording.frames(), 60);
    assert!(
        recording
            .span()
            .is_some_and(|[_, last]| (last - 1.0).abs() < 1e-9)
    );
}

const WINCH: &str = include_str!("tests/winch.toml");

fn winch_recorded() -> Recording {
    let scene = SceneSource::parse(WINCH, &[]).expect("a scene");
    let scene = scene.build().expect("a scene");
    let mut bytes = Vec::new();
    let stepper = Stepper::new(scene, options()).expect("a stepper");
    recorded(&mut bytes, BUDGET, stepper, 150, |_, _| ()).expect("memory");
    read(&bytes).expect("whole")
}

/// A winch takes segments in: each change of the scene begins a part, whose first segment has the length that is off the drum.
#[test]
fn a_scene_that_changes_begins_a_new_part() {
    let recording = winch_recorded();
    assert_eq!(recording.early(), None);
    let bodies = recording.parts.iter();
    let bodies: Vec<usize> = bodies.map(|p| p.layout.bodies.len()).collect();
    let holds = bodies.len() > 2 && bodies.is_sorted_by(|a, b| a >= b);
    assert!(holds, "{bodies:?}");
    assert_eq!(recording.frames(), 150);
    assert_eq!(recording.events.len(), 1);
    for part in &recording.parts {
        let first = part.layout.cables[0].bodies[0];
        let length = part.layout.bodies[first].solids[0].length.expect("changes");
        let lengths = (0..part.times.len()).map(|k| part.value(k, length));
        let lengths: Vec<f64> = lengths.collect();
        assert!(lengths.is_sorted_by(|a, b| a >= b), "{lengths:?}");
    }
}

/// Translations of the node of that name, by the reader of another crate: its times and positions.
fn translations(asset: &::gltf::Gltf, name: &str) -> (Vec<f32>, Vec<[f32; 3]>) {
    let blob = asset.blob.as_deref();
    let animation = asset.animations().next().expect("an animation");
    let mut found = None;
    for channel in animation.channels() {
        let target = channel.target();
        let reader = channel.reader(|_| blob);
        let outputs = reader.read_outputs().expect("numbers");
        if let ::gltf::animation::util::ReadOutputs::Translations(all) = outputs
            && target.node().name() == Some(name)
        {
            found = Some((
                reader.read_inputs().expect("times").collect(),
                all.collect(),
            ));
        }
    }
    found.unwrap_or_else(|| panic!("no `{name}`"))
}

/// glTF is read back by another reader: every body where it was, at its time.
#[test]
fn animations_are_read_by_others() {
    let recording = read(&hoist_recorded(90)).expect("whole");
    let file = animation(&recording, true).expect("frames");
    let asset = ::gltf::Gltf::from_slice(&file).expect("valid glTF");
    let part = &recording.parts[0];
    for (i, body) in part.layout.bodies.iter().enumerate() {
        let (times, at) = translations(&asset, &body.name);
        assert_eq!((times.len(), at.len()), (90, 90));
        for (k, at) in at.iter().enumerate() {
            assert_eq!(part.position(k, i), at.map(f64::from));
            assert!((f64::from(times[k]) - (part.times[k] - part.times[0])).abs() < 1e-6);
        }
    }
    // Its points are all within the file, and as JSON it has the same bytes.
    let blob = asset.blob.as_deref();
    for mesh in asset.meshes() {
        for primitive in mesh.primitives() {
            let reader = primitive.reader(|_| blob);
            let points = reader.read_positions().expect("points").count();
            let mut corners = reader.read_indices().expect("corners").into_u32();
            assert!(points > 3 && corners.all(|k| (k as usize) < points));
        }
    }
    let text = animation(&recording, false).expect("frames");
    ::gltf::Gltf::from_slice(&text).expect("valid glTF");
    let text: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
    let uri = text["buffers"][0]["uri"].as_str().expect("data");
    let data = uri.split("base64,").nth(1).expect("base64");
    let bytes = base64::Engine::decode(&base64::engine::general_purpose::STANDARD, data);
    assert_eq!(bytes.expect("base64"), blob.expect("bytes"));
    let none = read(&hoist_recorded(0)).expect("whole");
    assert_eq!(animation(&none, true), Err(NoFrames));
}

/// Segments that a winch has taken in have no size, and the first one shrinks on the way.
#[test]
fn bodies_that_go_vanish_from_animations() {
    let recording = winch_recorded();
    let file = animation(&recording, true).expect("frames");
    let asset = ::gltf::Gltf::from_slice(&file).expect("valid glTF");
    let blob = asset.blob.as_deref();
    let (mut gone, mut shrunk) = (0, 0);
    for channel in asset
        .animations()
        .flat_map(|a| a.channels().collect::<Vec<_>>())
    {
        let outputs = channel.reader(|_| blob).read_outputs();
        if let Some(::gltf::animation::util::ReadOutputs::Scales(scales)) = outputs {
            let scales: Vec<[f32; 3]> = scales.collect();
            let first = scales.first().expect("some");
            let last = scales.last().expect("some");
            gone += usize::from(*first == [1.0; 3] && *last == [0.0; 3]);
            shrunk += usize::from(last[2] < first[2] && last[2] > 0.0);
        }
    }
    let bodies = |part: Option<&Part>| part.map_or(0, |p| p.layout.bodies.len());
    let expected = bodies(recording.parts.first()) - bodies(recording.parts.last());
    assert_eq!(gone, expected);
    assert!(gone > 0 && shrunk > 0, "{gone} {shrunk}");
}

/// A picture has the cable in the colour of its tension above the load, whatever the time that is asked for.
#[test]
fn a_picture_shows_what_is_there() {
    let recording = read(&hoist_recorded(60)).expect("whole");
    let mut shown = Vec::new();
    for (time, frame) in [(-1.0, 0), (0.5, 29), (1e9, 59)] {
        let still = still(&recording, time).expect("frames");
        assert_eq!(still.time, recording.parts[0].times[frame]);
        assert!(
            still
                .tensions
                .is_some_and(|[low, high]| 0.0 < low && low < high)
        );
        let reader = png::Decoder::new(io::Cursor::new(&still.png)).read_info();
        let mut reader = reader.expect("PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("small")];
        reader.next_frame(&mut pixels).expect("PNG");
        let is = |like: fn(&[u8]) -> bool| pixels.chunks(3).filter(|p| like(p)).count();
        let load = is(|p| p[2] > p[0] && p[0] > p[1] && p[2] > 150);
        assert!(load > 100, "{load}");
        assert!(is(|p| p != [255; 3]) > load + 200);
        shown.push(still.png);
    }
    assert!(shown[0] != shown[1] && shown[1] != shown[2]);
    assert!(still(&read(&hoist_recorded(0)).expect("whole"), 0.0).is_err());
    assert!(still(&winch_recorded(), 2.0).is_ok());
}
