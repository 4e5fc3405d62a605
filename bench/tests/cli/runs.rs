use crate::*;
use taut_solver::Backend;

/// A load of 10⁵ segment masses on an anchor that moves: more than the paper's step can do. The program says so, in
/// every way.
#[test]
fn an_unstable_run_has_code_1_and_still_its_summary() {
    let at = folder("unstable");
    let arguments = "run hoist --scheme linearly-implicit --stiffness off --guard off --set mass_ratio=1e5 \
        --set seed=1 --set move_x=0.5 --time 5 --json -";
    let [stdout, stderr] = at.ends(1, arguments);
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(stderr.contains("unstable at t = "), "{stderr}");
    let summary: Value = serde_json::from_str(&stdout).expect("JSON alone");
    assert_eq!(summary["stable"], false);
    let end = summary["failure"]["time"].as_f64().expect("a time");
    assert!(end > 0.0 && end < 5.0, "{end}");
    assert!(
        summary["failure"]["reason"]
            .as_str()
            .is_some_and(|r| !r.is_empty())
    );
    assert_eq!(summary["steps"].as_u64(), Some((end * 60.0).round() as u64));
}

/// The step that gains too much has no sample, but its excess counts.
#[test]
fn a_run_lost_by_its_energy_says_by_how_much() {
    let at = folder("from_nowhere");
    let arguments = "run net --backend gauss-seidel:joints:iterations=4 --time 1 --json -";
    let [stdout, _] = at.ends(1, arguments);
    let summary: Value = serde_json::from_str(&stdout).expect("JSON alone");
    let reason = summary["failure"]["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("from nowhere"), "{reason}");
    let excess = summary["max_energy_excess"].as_f64();
    assert!(excess.is_some_and(|excess| excess > 0.2), "{excess:?}");
}

#[test]
fn the_summary_of_a_run_has_its_fields() {
    let at = folder("run");
    let run = at.json("run hoist --set segments=4 --set mass_ratio=10 --time 0.5 --json -");
    for field in ["scene", "backend", "scheme"] {
        let holds = run[field].as_str().is_some_and(|s| !s.is_empty());
        assert!(holds, "{field}: {run}");
    }
    let found = (&run["scene"], &run["stable"], &run["steps"]);
    assert_eq!(found, (&"hoist".into(), &true.into(), &30.into()));
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    assert!((number(&run["dt"]) * 60.0 - 1.0).abs() < 1e-15);
    assert!(number(&run["max_violation_m"]) >= 0.0);
    assert!(number(&run["max_elongation_error"]) >= 0.0);
    for field in ["median", "min", "max"] {
        assert!(number(&run["step_ns"][field]) > 0.0, "{field}");
    }
    for instant in ["start", "end"] {
        for kind in ["kinetic", "gravity", "elastic"] {
            let holds = number(&run["energy"][instant][kind]).is_finite();
            assert!(holds, "{instant} {kind}");
        }
    }
    let (times, positions) = (&run["load"]["time"], &run["load"]["position"]);
    assert_eq!(times.as_array().map(Vec::len), Some(30));
    assert_eq!(positions.as_array().map(Vec::len), Some(30));
    assert!((number(&times[29]) - 0.5).abs() < 1e-12);
    // 10 m of cable, stretched a little.
    let off = (number(&positions[29][2]) + 10.0).abs();
    assert!(off < 0.01, "{positions}");
}

/// The tension above a load at rest, the largest of a swing, and the column of each step.
#[test]
fn runs_tell_the_tension_above_the_load() {
    let at = folder("tension");
    let run = "run hoist --set mass_ratio=100 --set equilibrium=true --time 0.2 --substeps 4";
    let run = at.json(format!("{run} --json - --out deep/t.csv"));
    let weight = 100.0 * 9.81;
    for field in ["load_tension", "max_load_tension"] {
        let tension = run[field].as_f64().expect("a number");
        assert!((tension / weight - 1.0).abs() < 1e-6, "{field}: {tension}");
    }
    let csv = at.read("deep/t.csv");
    let heading = csv.lines().next().expect("a heading");
    assert!(heading.ends_with(",load_tension_N"), "{heading}");
    let last = csv.lines().last().and_then(|line| line.rsplit(',').next());
    let last: f64 = last.expect("a cell").parse().expect("a number");
    assert!((last / weight - 1.0).abs() < 1e-6, "{last}");
}

#[test]
fn likely_mistakes_are_noted() {
    let at = folder("notes");
    let scene = at.good("scene hoist --set segments=3 --explicit");
    at.write("weightless.toml", scene.replacen("-9.81", "0", 1));
    let [stdout, stderr] = at.ends(0, "run weightless.toml --time 0.1 --json -");
    let note = "gravity is zero and no other force acts: the load has no weight";
    assert_eq!(stderr, format!("note: {note}\n"));
    let run: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!(run["notes"], serde_json::json!([note]));
    // EA in MN.
    let soft = at.good("run hoist --set ea=20 --set mass_ratio=0.1 --time 1");
    assert!(soft.contains("is its stiffness in newtons?"), "{soft}");
}

/// A box on the ground whose centre is at this height, below a press that comes down.
fn pressed(height: f64) -> String {
    format!(
        "name = 'press'\ngravity = [0, 0, -9.81]\n[[ground]]\nname = 'floor'\n\
         [[body]]\nname = 'press'\nmobility = 'driven'\nshape = {{ box = {{ size = [1, 1, 1] }} }}\n\
         position = [0, 0, 1.6]\nvelocity = [0, 0, -1]\ncollide = true\n\
         [[body]]\nname = 'box'\nmass = 10\nshape = {{ box = {{ size = [1, 1, 1] }} }}\n\
         position = [0, 0, {height}]\ncollide = true\n"
    )
}

#[test]
fn overlaps_are_noted_that_a_run_begins_with() {
    let at = folder("overlaps");
    at.write("apart.toml", pressed(0.5));
    let run = at.json("run apart.toml --time 0.8 --json -");
    let deepest = run["contacts"]["deepest_m"].as_f64();
    assert!(deepest.is_some_and(|depth| depth > 0.2), "{deepest:?}");
    assert_eq!(run["notes"], serde_json::json!([]));
    at.write("sunk.toml", pressed(0.3));
    let run = at.json("run sunk.toml -q --time 0.05 --json -");
    let notes = run["notes"].to_string();
    has(&notes, "overlap by 2.000e-1 m at the start");
}

/// The first step may hold a blow, after which half of it is gone.
#[test]
fn a_run_begins_with_the_energy_of_the_state_given() {
    let at = folder("begins");
    let scene = "name = 'ball'\ngravity = [0, 0, -9.81]\n[[ground]]\nname = 'floor'\n\
                 [[body]]\nname = 'ball'\nmass = 1\nshape = { sphere = { radius = 0.1 } }\n\
                 position = [0, 0, 0.14]\nvelocity = [0, 0, -5]\ncollide = { restitution = 0.8 }\n";
    at.write("ball.toml", scene);
    let run = at.json("run ball.toml --time 0.5 --json -");
    assert_eq!(run["energy"]["start"]["kinetic"], 12.5);
    assert_eq!(run["energy"]["start"]["gravity"], 9.81 * 0.14);
    assert!(run["failure"].is_null(), "{}", run["failure"]);
}

#[test]
fn the_list_of_backends_names_all_with_licence_and_whether_they_are_there() {
    let stdout = folder("backends").good("backends");
    for backend in Backend::all() {
        let mut line = stdout.lines();
        let line = line.find(|l| l.split_whitespace().next() == Some(backend.name()));
        let line = line.unwrap_or_else(|| panic!("{} is missing in\n{stdout}", backend.name()));
        let there = if backend.is_compiled() { "yes" } else { "no" };
        assert!(line.split_whitespace().any(|w| w == there), "{line}");
        assert!(line.contains(backend.licence()), "{line}");
    }
}

#[test]
fn the_solver_that_was_chosen_is_told_with_the_reason() {
    let at = folder("chosen");
    let line = "run hoist --set segments=4 --time 0.5 --backend auto";
    let told = at.json(format!("{line} --json - --save auto.json"));
    assert_eq!(told["backend"], "auto");
    let chosen = &told["chosen"];
    let backend = chosen["backend"].as_str().expect("a name");
    assert!(backend.parse::<Backend>().expect("known").is_compiled());
    let reason = chosen["reason"].as_str().expect("a sentence");
    let stdout = at.good(line);
    assert!(stdout.contains(&format!("auto: {backend} (")), "{stdout}");
    assert!(stdout.contains(reason), "{stdout}");
    // A saved run keeps `auto` and chooses again.
    let resumed = at.json("run --resume auto.json --time 0.1 --json -");
    assert_eq!(resumed["backend"], "auto");
    assert_eq!(resumed["chosen"]["reason"], chosen["reason"]);
    let named = at.json(
        line.replace("auto", backend)
            .replace("--backend", "--json - --backend"),
    );
    assert!(named.get("chosen").is_none());
    assert_eq!(named["load"], told["load"]);
}

#[test]
fn runs_take_schemes_stiffness_guard_and_substeps() {
    let at = folder("options");
    let run = |options: &str| {
        at.json(format!(
            "run hoist --set segments=4 --time 0.5 {options} --json -"
        ))
    };
    let default = run("");
    assert_eq!(default["scheme"], "third-difference");
    let found = (&default["stiffness"], &default["guard"]);
    assert_eq!(found, (&Value::from("0.4"), &Value::from(0.005)));
    let paper = run("--scheme linearly-implicit --stiffness off --guard off --dt 1/120");
    let found = (&paper["stiffness"], &paper["guard"]);
    assert_eq!(found, (&Value::from("off"), &Value::Null));
    assert_eq!(paper["steps"], 60);
    let divided = run("--scheme spook --stiffness 0.5 --substeps 2");
    assert_eq!(divided["stiffness"], "0.5");
    assert_eq!(divided["substeps"], 2);
    assert_eq!(default["elimination"], "scene");
    let ordered = run("--elimination minimum-degree");
    assert_eq!(ordered["elimination"], "minimum-degree");
    // A chain has no fill in either.
    assert!(default["factor_entries"].as_u64() > Some(0));
    assert_eq!(default["factor_entries"], ordered["factor_entries"]);
    let resting = run("--set equilibrium=true");
    let holds = resting["max_elongation_error"].as_f64();
    let holds = holds.is_some_and(|e| e < 1e-9);
    assert!(holds, "{resting}");
    let rows = r"
        run hoist --stiffness=-1 → alpha
        run hoist --stiffness nan → alpha
        run hoist --stiffness soft → stiffness
        run hoist --stiffness relative:0.5 → off, a weight such as 0.4
        run hoist --guard=-1 → guard.tolerance
        run hoist --guard never → --guard
        run hoist --substeps 0 → substeps
        run hoist --scheme third-difference:a=0.1 → `a`
        run hoist --scheme third-difference:gamma=1 → gamma
        run hoist --elimination band → minimum-degree
        run hoist --dt 1/0 → --dt
        run hoist --set damping=-1 → damping
        run hoist --set ea=0 → ea
    ";
    at.refuses(rows);
}

#[test]
fn json_goes_to_a_file_beside_the_table() {
    let at = folder("bench_file");
    let stdout = at.good(
        "bench --quick --rows --segments 3 --ratios 5 --iterations 2 --time 0.3 --json rows.json",
    );
    assert!(stdout.contains("dense"), "{stdout}");
    let read = |name: &str| -> Value {
        let text = fs::read_to_string(at.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{name}: {e}"))
    };
    assert!(
        read("rows.json")
            .as_array()
            .is_some_and(|rows| !rows.is_empty())
    );
    // Where later commands look for it.
    assert_eq!(read("target/taut/bench.json"), read("rows.json"));
    let answer = at.good("bench --quick --segments 3 --ratios 5 --iterations 2 --time 0.3");
    let holds = answer.contains("\n Use `") && answer.lines().count() < 20;
    assert!(holds, "{answer}");
    let written = "report target/taut/bench.report.json --markdown results.md";
    assert_eq!(at.good(written), "");
    let results = at.read("results.md");
    assert!(results.contains("\nUse `"), "{results}");
    let two = "report target/taut/bench.report.json rows.json --out page.html";
    at.refused(two, &["give one", "--markdown"]);
}

/// `taut run … | head -1`: whoever stops reading is not told of a panic.
#[cfg(unix)]
#[test]
fn a_reader_that_stops_reading_is_no_panic() {
    let at = folder("closed_pipe");
    for arguments in ["backends", "run hoist --set segments=2 --time 0.1"] {
        let mut child = at
            .program(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        let stderr = text(&output.stderr);
        assert!(!stderr.contains("panicked"), "`taut {arguments}`: {stderr}");
        assert_ne!(
            output.status.code(),
            Some(101),
            "`taut {arguments}`: {stderr}"
        );
    }
}

#[test]
fn help_and_version_are_no_errors() {
    let at = folder("help");
    assert!(at.good("--version").contains(env!("CARGO_PKG_VERSION")));
    for command in ["", "run", "bench", "static", "backends"] {
        let help = at.good(format!("{command} --help"));
        assert!(help.contains("Usage"), "{command}");
    }
}

/// The drum of the guide of scenes, as it is printed there.
const DRUM: &str = include_str!("../../../model/src/scene_file/drum.toml");

#[test]
fn the_drum_of_the_guide_lifts_its_load_as_printed() {
    let at = folder("drum");
    at.write("drum.toml", DRUM);
    let run = "run drum.toml --time 4";
    let table = at.good(format!("{run} --columns time,load.z,rope-2.slip --out -"));
    let last = table.lines().last().expect("rows").split(',').nth(1);
    let height: f64 = last.expect("a height").parse().expect("a number");
    // 0.15 m/s for four seconds.
    assert!((height + 10.0 - 0.6).abs() < 0.05, "{height}");
    let told = at.good(run);
    has(&told, "load tension  9.8 … in what holds the load");
    has(&told, "m, of `rope … open or stretched");
}

#[test]
fn a_drum_that_starts_at_once_over_a_soft_cable_is_stable() {
    let at = folder("jump");
    for speed in ["0.5", "-0.5"] {
        let soft = DRUM.replace("speed = -0.5", &format!("speed = {speed}"));
        at.write("soft.toml", soft.replace("ea = 2e6", "ea = 1e6"));
        let told = at.good("run soft.toml --time 4");
        assert!(told.contains("verdict  stable\n"), "{told}");
    }
}

/// A drum that runs empty: the reason, and code 1, from a run and from the main job.
#[test]
fn a_scene_that_is_lost_is_told_with_its_reason() {
    let at = folder("lost");
    let lost = DRUM
        .replace("turns = 4.25", "turns = 0.3")
        .replace("length = 22.2", "length = 14.7")
        .replace("speed = -0.5", "speed = 2.5");
    at.write("lost.toml", lost);
    for call in [
        "run lost.toml --time 2",
        "bench --quick --scene lost.toml --time 2 --backends banded",
    ] {
        let [_, told] = at.ends(1, call);
        has(&told, "`rope` has run off its drum");
    }
}

/// A gantry at rest sleeps until its trolley is driven, and a run that was saved asleep goes on with the same bits.
#[test]
fn a_run_sleeps_on_request() {
    let at = folder("sleeps");
    at.write("drive.csv", "time,trolley_speed\n6,0\n6.5,0.3\n");
    let run = "run gantry --set segments=3 --controls drive.csv";
    let awake = at.json(format!("{run} --time 8 --json -"));
    let slept = at.json(format!(
        "{run} --time 8 --sleep --columns asleep --save half.json --save-at 5 --json -"
    ));
    assert!(awake.get("steps_asleep").is_none());
    let asleep = slept["columns"]["asleep"].as_array().expect("a list");
    let steps = asleep.iter().filter(|asleep| **asleep == 1.0).count();
    assert_eq!(slept["steps_asleep"].as_u64(), Some(steps as u64));
    assert!(asleep[299] == 1.0 && asleep[359] == 1.0 && asleep[361] == 0.0 && steps > 100);
    let path = |run: &Value| -> Vec<[f64; 3]> {
        serde_json::from_value(run["load"]["position"].clone()).expect("points")
    };
    let (path, other) = (path(&slept), path(&awake));
    let pairs = path.iter().flatten().zip(other.iter().flatten());
    let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart > 0.0 && apart < 1e-3, "{apart}");
    let resumed = at.json("run --resume half.json --time 3 --controls drive.csv --json -");
    assert_eq!(resumed["final_state"], slept["final_state"]);
    assert_eq!(resumed["steps_asleep"].as_u64(), Some(60));
    let told = at.good("run gantry --sleep=5 --time 5");
    assert!(told.contains("asleep") && !at.good("run gantry --time 5").contains("asleep"));
    let rows = r"
        run gantry --sleep=-1 → sleep.distance … > 0
        run --resume half.json --sleep → --sleep … --resume
    ";
    at.refuses(rows);
}
