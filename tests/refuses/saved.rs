use serde_json::{Value, json};
use taut_bench::run_file::RunFile;
use taut_tests::prelude::*;

/// A saved run of a gantry as JSON.
fn good() -> Value {
    let params = GantryParams::default().with(|p| p.segments = 2);
    let scene = params.build().expect("sound parameters");
    let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
    taut_tests::steps(&mut stepper, 3);
    serde_json::to_value(stepper.save().expect("a sound state")).expect("a value")
}

/// Error of the reader, or of the restoration, with one value of the run replaced.
fn refusal(at: &str, value: Value) -> String {
    let mut run = good();
    let place = run.pointer_mut(at).unwrap_or_else(|| panic!("no {at}"));
    *place = value;
    let read = serde_json::from_value::<SavedRun>(run);
    let text = match read.map(Stepper::restore) {
        Err(e) => e.to_string(),
        Ok(Err(e)) => e.to_string(),
        Ok(Ok(_)) => panic!("{at} is taken"),
    };
    assert!(!text.contains('\n'), "{text}");
    text
}

#[test]
fn a_scheme_of_angular_rows_is_refused_unless_it_was_none() {
    let with = |key: &str, value: Value| {
        let mut run = good();
        run["options"][key] = value;
        let read = serde_json::from_value::<SavedRun>(run);
        read.map(|run| run.options().clone())
            .map_err(|e| e.to_string())
    };
    let found = with("angular_scheme", Value::Null);
    assert_eq!(found, Ok(StepOptions::default()));
    let text = with("angular_scheme", json!("spook")).expect_err("a scheme");
    assert!(text.contains("`angular_scheme` is `spook`, where all rows take `scheme`"));
    let text = with("lateral_scheme", Value::Null).expect_err("no key");
    assert!(text.contains("unknown field `lateral_scheme`"), "{text}");
}

#[test]
fn a_damaged_run_says_what_does_not_fit() {
    let run = good();
    assert!(
        serde_json::from_value(run.clone())
            .map(Stepper::restore)
            .expect("reads")
            .is_ok()
    );
    let short = |at: &str| {
        let list = run.pointer(at);
        let mut list = list.and_then(Value::as_array).expect("a list").clone();
        list.pop();
        Value::Array(list)
    };
    for at in "impulses tension drive places ages velocity velocity_change".split(' ') {
        let text = refusal(&format!("/{at}"), short(&format!("/{at}")));
        assert!(text.contains(&format!("`{at}` has")), "{text}");
    }
    for at in ["rate", "drive", "velocity"] {
        let text = refusal(&format!("/past/{at}"), short(&format!("/past/{at}")));
        assert!(text.contains(&format!("`past.{at}` has")), "{text}");
    }
    let rows = r#"
        /version → 1 → version 1
        /version → "1" → u32
        /time → null → f64
        /impulse_time → 0.0 → `impulse_time`
        /impulse_time → -1.0 → `impulse_time`
        /advanced → -1.0 → `advanced`
        /holding → -1 → usize
        /places/0 → "nowhere" → nowhere
        /options/dt → 0.0 → `dt`
        /options/substeps → 0 → `substeps`
        /options/backend → "superlu" → superlu
        /options/scheme → "third-difference:a=0.1:gamma=0" → `a`
        /options/stiffness → "NaN" → `alpha`
        /options/guard/passes → 0 → `guard.passes`
        /scene/load → 99 → number 99
        /scene/bodies/mass/2 → 0.0 → mass is 0
        /scene/bodies/position/1 → [0.0, 1.0] → invalid length
        /scene/bodies/orientation/1 → [2.0, 0.0, 0.0, 0.0] → unit quaternion
        /scene/bodies/inertia/2 → [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0] → inertia
        /scene/bodies/mobility/0 → "sleepy" → sleepy
        /scene/body_names/1 → "crane" → crane
        /scene/constraints → [] → length
        /scene/groups → [] → groups
    "#;
    for row in rows.trim().lines() {
        let [at, value, words] = [0, 1, 2].map(|k| row.trim().split(" → ").nth(k).expect("a cell"));
        let text = refusal(at, serde_json::from_str(value).expect("JSON"));
        assert!(text.contains(words), "{at}: {text}");
    }
}

/// Binary formats hold what JSON cannot: numbers that are not finite are refused where they are restored.
#[test]
fn numbers_that_are_not_finite_are_refused() {
    let run: SavedRun = serde_json::from_value(good()).expect("reads");
    let mut bytes = Vec::new();
    ciborium::into_writer(&run, &mut bytes).expect("writes");
    let value: ciborium::Value = ciborium::from_reader(bytes.as_slice()).expect("reads");
    let with_nan = |field: &str| {
        let mut value = value.clone();
        let entries = value.as_map_mut().expect("a map");
        let field = (entries.iter_mut()).find(|(key, _)| key.as_text() == Some(field));
        let mut place = &mut field.expect("a field").1;
        loop {
            place = match place {
                ciborium::Value::Array(list) => list.first_mut().expect("an entry"),
                // The account is a map: its `work` is one of the sums.
                ciborium::Value::Map(entries) => {
                    let mut work = entries.iter_mut();
                    let work = work.find(|(k, _)| k.as_text() == Some("work"));
                    &mut work.expect("a sum").1
                }
                _ => break,
            };
        }
        *place = ciborium::Value::Float(f64::NAN);
        let mut bytes = Vec::new();
        ciborium::into_writer(&value, &mut bytes).expect("writes");
        let run: SavedRun = ciborium::from_reader(bytes.as_slice()).expect("reads");
        Stepper::restore(run).map(|_| ())
    };
    for name in "time advanced impulse_time impulses tension velocity drive account".split(' ') {
        match with_nan(name) {
            Err(StepError::Saved { what, reason }) => {
                assert!(what == name && reason.contains("NaN"), "{what} {reason}");
            }
            other => panic!("{name}: {other:?}"),
        }
    }
}

#[test]
fn foreign_and_truncated_files_are_refused_with_their_place() {
    let yardstick = json!({"cable": null, "planar": false});
    let file = json!({"run": good(), "yardstick": yardstick, "driven": [], "checksum": 0});
    let file = file.to_string();
    assert!(RunFile::parse(&file).is_ok_and(|file| !file.is_whole()));
    for (text, words) in [
        ("", "EOF"),
        ("{}", "missing field `run`"),
        ("[1, 2]", "SavedRun"),
        ("{\"scene\": \"hoist\"}", "unknown field `scene`"),
        ("name = \"hoist\"", "expected"),
        (&file[..file.len() / 2], "EOF"),
        (
            &file.replacen("\"version\":3", "\"version\":9", 1),
            "version 9",
        ),
    ] {
        let error = RunFile::parse(text).expect_err("no run").to_string();
        assert!(error.contains(words) && error.contains("line"), "{error}");
    }
}

/// One bit of a file that is another one: refused, or the same run.
#[test]
fn no_bit_can_be_lost() {
    let path = std::env::temp_dir().join(format!("taut-saved-{}", std::process::id()));
    let run = serde_json::from_value(good()).expect("reads");
    let yardstick = json!({"cable": [10.0, 0.5], "planar": true});
    let yardstick = serde_json::from_value(yardstick).expect("reads");
    let file = RunFile::new(run, yardstick, vec!["hoist_speed".to_owned()]);
    let to = taut_measure::files::Output::open(&path).expect("writable");
    file.write(&to).expect("written");
    let bytes = std::fs::read(&path).expect("written");
    std::fs::remove_file(path).expect("written");
    let read = |bytes: &[u8]| RunFile::parse(std::str::from_utf8(bytes).ok()?).ok();
    let whole = read(&bytes).filter(RunFile::is_whole).expect("is whole");
    let (mut damaged, mut parsed) = (bytes.clone(), 0);
    for (at, byte) in bytes.iter().enumerate() {
        let bit = 1 << (at % 7);
        damaged[at] ^= bit;
        if let Some(file) = read(&damaged) {
            parsed += 1;
            assert!(!file.is_whole() || file == whole, "byte {at}, bit {bit}");
        }
        damaged[at] = *byte;
    }
    assert!(parsed > 500, "{parsed} of {} are a run", bytes.len());
}

/// A solve that is lost is not saved.
#[test]
fn impulses_that_are_not_finite_are_not_saved() {
    let scene = GantryParams::default().build().expect("sound parameters");
    let mut stepper = Stepper::new(scene, StepOptions::default()).expect("sound");
    stepper.step().expect("a stable run");
    let rows = stepper.multipliers().len();
    stepper
        .set_multipliers(&vec![f64::INFINITY; rows])
        .expect("as many rows");
    match stepper.save() {
        Err(StepError::Saved {
            what: "impulses", ..
        }) => {}
        other => panic!("{other:?}"),
    }
}
