//! The command line as its users meet it: exit codes, what goes to which stream, files for programs.

use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use taut_solver::Backend;

/// An empty folder of a test's own, in which the program runs.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder to write to");
    folder
}

/// The program with the words of a line as arguments, its streams piped.
fn program(folder: &PathBuf, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
    command
        .current_dir(folder)
        .args(arguments.split_whitespace())
        .stdin(Stdio::null());
    command
}

fn taut(folder: &PathBuf, arguments: &str) -> Output {
    let output = program(folder, arguments).output();
    output.unwrap_or_else(|e| panic!("`taut {arguments}`: {e}"))
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

/// Bad input: code 2, nothing on standard output, and one line on standard error with all the words.
fn refused(folder: &PathBuf, arguments: &str, words: &[&str]) {
    let output = taut(folder, arguments);
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    let place = format!("`taut {arguments}`: {stderr}");
    assert_eq!(output.status.code(), Some(2), "{place}");
    assert_eq!(stdout, "", "{place}");
    assert_eq!(stderr.lines().count(), 1, "{place}");
    assert!(stderr.ends_with('\n'), "{place}");
    for word in words {
        assert!(stderr.contains(word), "`{word}` is missing in {place}");
    }
}

/// A good run: code 0 and nothing on standard error.
fn good(folder: &PathBuf, arguments: &str) -> String {
    let output = taut(folder, arguments);
    assert_eq!(text(&output.stderr), "", "`taut {arguments}`");
    assert_eq!(output.status.code(), Some(0), "`taut {arguments}`");
    text(&output.stdout).to_owned()
}

/// A good run that writes nothing but JSON to standard output.
fn json(folder: &PathBuf, arguments: &str) -> Value {
    let stdout = good(folder, arguments);
    serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("`taut {arguments}`: {e}\n{stdout}"))
}

#[test]
fn unknown_names_list_the_known_ones() {
    let at = folder("unknown_names");
    let backends = ["superlu", "banded", "gauss-seidel", "umfpack"];
    refused(&at, "run hoist --backend superlu", &backends);
    refused(&at, "bench --backends banded,superlu", &backends);
    refused(&at, "static --backends superlu", &backends);
    refused(
        &at,
        "run hoist --backend cg:quick",
        &["cg", "jacobi", "group"],
    );
    refused(&at, "run hoist --backend cg/kkt", &["cg", "/kkt"]);
    refused(&at, "run hoist --backend banded/lu", &["lu", "schur, kkt"]);
    refused(&at, "run crane", &["crane", "hoist"]);
    refused(
        &at,
        "run hoist --scheme euler",
        &["euler", "linearly-implicit"],
    );
    refused(&at, "crane", &["crane", "--help"]);
    refused(&at, "run hoist --fast", &["--fast", "--help"]);
}

#[test]
fn a_missing_argument_is_named() {
    let at = folder("missing_argument");
    refused(&at, "run", &["SCENE", "--help"]);
    refused(&at, "run hoist --json", &["--json", "--help"]);
}

#[test]
fn a_backend_that_is_not_compiled_in_is_named_with_its_feature() {
    let at = folder("not_compiled");
    let features = [
        ("banded", cfg!(feature = "banded")),
        ("gauss-seidel", cfg!(feature = "gauss-seidel")),
        ("cg", cfg!(feature = "cg")),
        ("faer", cfg!(feature = "faer")),
        ("nalgebra-sparse", cfg!(feature = "nalgebra-sparse")),
        ("umfpack", cfg!(feature = "umfpack")),
    ];
    for (name, on) in features {
        let arguments = format!("run hoist --set segments=2 --time 0.1 --backend {name}");
        if on {
            good(&at, &arguments);
        } else {
            let cure = format!("--features {name}");
            refused(&at, &arguments, &[name, "not compiled in", &cure]);
        }
    }
}

#[test]
fn parameters_out_of_range_are_named_with_their_range() {
    let at = folder("parameters");
    refused(
        &at,
        "run hoist --set segment_mass=-1",
        &["segment_mass is -1", "> 0 kg"],
    );
    refused(
        &at,
        "bench --set segment_mass=-1",
        &["segment_mass is -1", "> 0 kg"],
    );
    refused(&at, "run hoist --set length=0", &["length is 0", "> 0 m"]);
    refused(
        &at,
        "run hoist --set length=nan",
        &["length is NaN", "> 0 m"],
    );
    refused(
        &at,
        "run hoist --set mass_ratio=inf",
        &["mass_ratio is inf", "> 0"],
    );
    refused(
        &at,
        "run hoist --set segments=0",
        &["segments is 0", "at least 1"],
    );
    refused(&at, "bench --segments 0", &["segments is 0", "at least 1"]);
    refused(&at, "run hoist --set segments=1.5", &["segments", "1.5"]);
    refused(
        &at,
        "run hoist --set joint=glue",
        &["joint", "glue", "cosserat"],
    );
    refused(
        &at,
        "run hoist --set material=wood",
        &["wood", "steel, nylon, rubber"],
    );
    refused(&at, "run hoist --set foo", &["--set foo", "KEY=VALUE"]);
    refused(&at, "run hoist --set weight=3", &["weight", "segment_mass"]);
    refused(&at, "bench --set weight=3", &["weight", "segment_mass"]);
}

#[test]
fn numbers_out_of_range_are_named_with_their_option() {
    let at = folder("numbers");
    for ratios in ["x", "0", "nan", "inf", "1,,2", "1,-5"] {
        refused(&at, &format!("bench --ratios={ratios}"), &["--ratios"]);
        refused(&at, &format!("static --ratios={ratios}"), &["--ratios"]);
    }
    refused(&at, "bench --ratios=-1", &["--ratios", "-1", "positive"]);
    refused(&at, "bench --segments=-3", &["--segments"]);
    refused(&at, "bench --iterations 0", &["--iterations", "at least 1"]);
    for value in ["0", "-1", "nan", "inf", "1e300"] {
        refused(&at, &format!("run hoist --time={value}"), &["--time"]);
        refused(&at, &format!("bench --time={value}"), &["--time"]);
    }
    for value in ["0", "-1", "nan", "inf"] {
        refused(&at, &format!("run hoist --dt={value}"), &["--dt"]);
    }
    // More steps than anyone can store.
    refused(&at, "run hoist --dt 1e-300", &["steps"]);
}

#[test]
fn bad_scene_files_are_refused() {
    let at = folder("files");
    let file = |name: &str, content: &[u8]| fs::write(at.join(name), content).expect("writable");
    file("empty.toml", b"");
    refused(&at, "run empty.toml", &["no bodies", "[[body]]"]);
    file("comment.toml", b"# nothing yet\n");
    refused(&at, "run comment.toml", &["no bodies", "[[body]]"]);
    file("malformed.toml", b"[hoist]\nsegments = 4\nlength = = 3\n");
    refused(&at, "run malformed.toml", &["line 3"]);
    file("unknown.toml", b"[hoist]\nsegments = 4\nweight = 3\n");
    refused(
        &at,
        "run unknown.toml",
        &["line 3", "weight", "segment_mass"],
    );
    file("nan.toml", b"[hoist]\nlength = nan\n");
    refused(&at, "run nan.toml", &["length is NaN"]);
    file("binary.toml", &[0xff, 0xfe, 0x00]);
    refused(&at, "run binary.toml", &["binary.toml", "UTF-8"]);
    refused(&at, "run missing.toml", &["missing.toml", "cannot read"]);
    refused(&at, "run ./missing", &["./missing", "cannot read"]);
    fs::create_dir(at.join("folder.toml")).expect("writable");
    refused(&at, "run folder.toml", &["folder.toml", "cannot read"]);
}

/// Where a file cannot be written the run is not called good.
#[test]
fn files_that_cannot_be_written_are_an_error() {
    let at = folder("unwritable");
    fs::write(at.join("file"), "in the way").expect("writable");
    for option in ["--out file/load.csv", "--json file/run.json"] {
        let arguments = format!("run hoist --set segments=2 --time 0.1 {option}");
        let output = taut(&at, &arguments);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{arguments}: {stderr}");
        assert!(
            stderr.contains("cannot write `file/"),
            "{arguments}: {stderr}"
        );
    }
}

/// A load of 10⁵ segment masses on an anchor that moves: more than the paper's step can do. The program says so, in
/// every way.
#[test]
fn an_unstable_run_has_code_1_and_still_its_summary() {
    let at = folder("unstable");
    let arguments = "run hoist --scheme linearly-implicit --stiffness off --guard off --set mass_ratio=1e5 \
        --set seed=1 --set move_x=0.5 --time 5 --json -";
    let output = taut(&at, arguments);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(stderr.contains("unstable at t = "), "{stderr}");
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
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

#[test]
fn the_summary_of_a_run_has_its_fields() {
    let at = folder("run");
    let run = json(
        &at,
        "run hoist --set segments=4 --set mass_ratio=10 --time 0.5 --json -",
    );
    for field in ["scene", "backend", "scheme"] {
        assert!(
            run[field].as_str().is_some_and(|s| !s.is_empty()),
            "{field}: {run}"
        );
    }
    assert_eq!(
        (&run["scene"], &run["stable"], &run["steps"]),
        (&"hoist".into(), &true.into(), &30.into())
    );
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    assert!((number(&run["dt"]) * 60.0 - 1.0).abs() < 1e-15);
    assert!(number(&run["max_violation_m"]) >= 0.0);
    assert!(number(&run["max_elongation_error"]) >= 0.0);
    for field in ["median", "min", "max"] {
        assert!(number(&run["step_ns"][field]) > 0.0, "{field}");
    }
    for instant in ["start", "end"] {
        for kind in ["kinetic", "gravity", "elastic"] {
            assert!(
                number(&run["energy"][instant][kind]).is_finite(),
                "{instant} {kind}"
            );
        }
    }
    let (times, positions) = (&run["load"]["time"], &run["load"]["position"]);
    assert_eq!(times.as_array().map(Vec::len), Some(30));
    assert_eq!(positions.as_array().map(Vec::len), Some(30));
    assert!((number(&times[29]) - 0.5).abs() < 1e-12);
    // 10 m of cable, stretched a little.
    assert!(
        (number(&positions[29][2]) + 10.0).abs() < 0.01,
        "{positions}"
    );
}

/// A file with the same parameters is the same scene: the same numbers come out.
#[test]
fn a_scene_file_is_the_named_scene_with_its_parameters() {
    let at = folder("scene_file");
    fs::write(
        at.join("cable.toml"),
        "[hoist]\nsegments = 5\nmass_ratio = 20.0\nmove_x = 0.3\n",
    )
    .expect("writable");
    let by_file = json(&at, "run cable.toml --time 0.5 --json -");
    let by_name =
        "run hoist --set segments=5 --set mass_ratio=20 --set move_x=0.3 --time 0.5 --json -";
    let by_name = json(&at, by_name);
    assert_eq!(by_file["load"], by_name["load"]);
    assert_eq!(by_file["final_state"], by_name["final_state"]);
    // The anchor moves: it is not a comparison of zeros.
    assert!(
        by_file["load"]["position"][29][0]
            .as_f64()
            .is_some_and(|x| x != 0.0)
    );
}

/// Both forms of every scene, written and read back: the same run, bit for bit (numbers in JSON keep all their digits).
#[test]
fn a_written_scene_runs_as_the_scene_itself() {
    let at = folder("written_scene");
    for name in taut_model::named::NAMES {
        let size = if name.starts_with("particles") {
            "particles=4 --set seed=2"
        } else {
            "segments=4 --set seed=2"
        };
        let by_name = json(&at, &format!("run {name} --set {size} --time 0.2 --json -"));
        for form in ["", "--explicit"] {
            let written = good(&at, &format!("scene {name} --set {size} {form}"));
            fs::write(at.join("f"), written).expect("writable");
            let by_file = json(&at, "run f --time 0.2 --json -");
            for what in ["load", "final_state", "energy", "max_violation_m"] {
                assert_eq!(by_file[what], by_name[what], "{name} {form}: {what}");
            }
            // What was written is what is written of it.
            assert_eq!(
                good(&at, "scene f"),
                good(&at, &format!("scene {name} --set {size} {form}"))
            );
        }
        let speeds = by_name["final_state"]["velocity"].as_array();
        let mut components = speeds.into_iter().flatten().filter_map(Value::as_array);
        let moves = components.any(|v| v.iter().any(|x| x.as_f64() != Some(0.0)));
        assert!(moves, "{name} rests: it would be a comparison of zeros");
    }
    refused(&at, "scene crane", &["crane", "hoist"]);
    refused(&at, "scene hoist --set length=-1", &["length is -1"]);
}

#[test]
fn a_csv_file_has_a_line_for_each_step() {
    let at = folder("csv");
    let stdout = good(
        &at,
        "run hoist --set segments=3 --time 0.5 --out deep/load.csv",
    );
    assert!(
        stdout.contains("verdict") && stdout.contains("stable"),
        "{stdout}"
    );
    let csv = fs::read_to_string(at.join("deep/load.csv")).expect("written");
    let lines: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(lines.len(), 31);
    assert!(
        lines.iter().all(|line| line.len() == lines[0].len()),
        "{csv}"
    );
    for cell in lines[1..].iter().flatten() {
        assert!(cell.parse::<f64>().is_ok_and(f64::is_finite), "{cell}");
    }
}

#[test]
fn the_list_of_backends_names_all_with_licence_and_whether_they_are_there() {
    let stdout = good(&folder("backends"), "backends");
    for backend in Backend::all() {
        let line = stdout
            .lines()
            .find(|l| l.split_whitespace().next() == Some(backend.name()));
        let line = line.unwrap_or_else(|| panic!("{} is missing in\n{stdout}", backend.name()));
        let there = if backend.is_compiled() { "yes" } else { "no" };
        assert!(line.split_whitespace().any(|w| w == there), "{line}");
        assert!(line.contains(backend.licence()), "{line}");
    }
}

#[test]
fn the_main_job_writes_records_with_their_fields() {
    let at = folder("bench");
    let arguments = "bench --quick --segments 4 --ratios 10 --iterations 1,5 --time 0.3 --json -";
    let records = json(&at, arguments);
    let records = records.as_array().expect("a list of records");
    let numbers = [
        "segments",
        "mass_ratio",
        "iterations",
        "dt",
        "step_ns",
        "step_ns_min",
        "solve_ns",
        "backward_error",
        "forward_error",
        "elongation_error",
        "load_error_m",
        "max_violation_m",
    ];
    for record in records {
        for field in numbers {
            assert!(
                record[field].as_f64().is_some_and(f64::is_finite),
                "{field}: {record}"
            );
        }
        for field in ["scene", "backend", "options"] {
            assert!(
                record[field].as_str().is_some_and(|s| !s.is_empty()),
                "{field}: {record}"
            );
        }
        assert!(record["stable"].is_boolean(), "{record}");
        // The anchor still moves at the end: there may be no drift to speak of.
        assert!(record.get("energy_drift").is_some(), "{record}");
        assert_eq!(
            (&record["segments"], &record["mass_ratio"]),
            (&4.into(), &10.0.into())
        );
        assert!(
            record["step_ns_min"].as_f64() <= record["step_ns"].as_f64(),
            "{record}"
        );
    }
    let compiled = taut_bench::Choice::all()
        .into_iter()
        .filter(|c| c.check().is_ok());
    for choice in compiled {
        let rows: Vec<_> = records
            .iter()
            .filter(|r| r["backend"] == *choice.family())
            .collect();
        let iterations: Vec<_> = rows
            .iter()
            .filter_map(|r| r["iterations"].as_u64())
            .collect();
        let expected: &[u64] = if choice.backend.is_iterative() {
            &[1, 5]
        } else {
            &[0]
        };
        assert_eq!(iterations, expected, "{choice}");
    }
}

#[test]
fn the_linear_sweep_writes_records_with_their_fields() {
    let at = folder("linear");
    let records = json(&at, "bench --sweep linear --quick --json -");
    let records = records.as_array().expect("a list of records");
    for record in records {
        for field in ["mass_ratio", "ea", "forward_error", "backward_error"] {
            let sound = |x: f64| x.is_finite() && x >= 0.0;
            assert!(
                record[field].as_f64().is_some_and(sound),
                "{field}: {record}"
            );
        }
        for field in ["pose", "backend", "options"] {
            assert!(
                record[field].as_str().is_some_and(|s| !s.is_empty()),
                "{field}: {record}"
            );
        }
        assert_eq!(record["segments"], 24, "{record}");
        assert_eq!(record["error"], Value::Null, "{record}");
    }
    let compiled = taut_bench::Choice::all()
        .into_iter()
        .filter(|c| c.check().is_ok());
    for choice in compiled {
        let rows = records
            .iter()
            .filter(|r| r["backend"] == *choice.family())
            .count();
        // Two poses, five ratios, three refinements.
        assert_eq!(rows, 30, "{choice}");
    }
}

#[test]
fn the_linear_sweep_reads_what_narrows_it() {
    let at = folder("linear_narrow");
    let stdout = good(
        &at,
        "bench --sweep linear --segments 4,3,3 --ratios 1e9,10 --backends dense,dense,dense/kkt",
    );
    for words in [
        "straight, 3 segments",
        "bent, 4 segments",
        "at most 1e-12 with",
    ] {
        assert!(stdout.contains(words), "`{words}` is missing in\n{stdout}");
    }
    let rows = fs::read_to_string(at.join("target/taut/linear.json")).expect("the copy");
    let rows: Value = serde_json::from_str(&rows).expect("JSON");
    // Two solvers, two cables, two ratios, two poses, three refinements.
    assert_eq!(rows.as_array().map(Vec::len), Some(48));
}

#[test]
fn the_accuracy_sweep_compares_every_scheme_with_the_reference() {
    let at = folder("accuracy");
    let line = "bench --sweep accuracy --segments 4 --ratios 100 --dt 1/60,1/120,1/240 --time 1 \
                --backends banded,cg:group --iterations 20 --json -";
    let results = json(&at, line);
    let records = results["records"].as_array().expect("a list of records");
    let of = |setting: &str, dt: f64| {
        let found = records.iter().find(|r| {
            r["setting"] == setting
                && r["joint"] == "cosserat"
                && r["drive"] == "aside"
                && r["dt"].as_f64().is_some_and(|x| (x - dt).abs() < 1e-12)
                && r["refinements"] == 1
        });
        found.unwrap_or_else(|| panic!("no record of {setting} at {dt}"))
    };
    let error = |r: &Value| {
        let of = |field: &str| r[field].as_f64().expect("a number");
        of("horizontal_m").hypot(of("vertical_m"))
    };
    let errors = [60.0, 120.0, 240.0].map(|rate: f64| error(of("default", 1.0 / rate)));
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1]).log2() > 1.8, "{errors:?}");
    }
    assert!(errors[0] < 1e-4, "{errors:?}");
    for record in records {
        assert!(
            record["step_ns"].as_f64().is_some_and(|ns| ns > 0.0),
            "{record}"
        );
        assert!(
            record["reference_m"].as_f64().is_some_and(|e| e < 1e-5),
            "{record}"
        );
    }
    assert_eq!(of("default", 1.0 / 60.0)["stable"], true);
    assert!(records.iter().any(|r| r["iterations"] == 20));
    assert!(results["costs"].as_array().is_some_and(|c| c.len() == 5));
    // The references are kept: the same again is the same, to the last bit.
    assert!(at.join("target/taut/reference").is_dir());
    let again = json(&at, line);
    for (a, b) in records
        .iter()
        .zip(again["records"].as_array().expect("a list"))
    {
        assert_eq!(a["horizontal_m"], b["horizontal_m"], "{a}");
    }
}

#[test]
fn runs_take_schemes_stiffness_guard_and_substeps() {
    let at = folder("options");
    let run = |options: &str| {
        json(
            &at,
            &format!("run hoist --set segments=4 --time 0.5 {options} --json -"),
        )
    };
    let default = run("");
    assert_eq!(default["scheme"], "third-difference");
    assert_eq!(
        (&default["stiffness"], &default["guard"]),
        (&Value::from("0.4"), &Value::from(0.005))
    );
    let paper = run("--scheme linearly-implicit --stiffness off --guard off --dt 1/120");
    assert_eq!(
        (&paper["stiffness"], &paper["guard"]),
        (&Value::from("off"), &Value::Null)
    );
    assert_eq!(paper["steps"], 60);
    let relative = run(
        "--scheme spook --stiffness relative:0.5 --angular-scheme linearly-implicit --substeps 2",
    );
    assert_eq!(relative["stiffness"], "relative:0.5");
    assert_eq!(relative["substeps"], 2);
    assert_eq!(default["elimination"], "scene");
    let ordered = run("--elimination minimum-degree");
    assert_eq!(ordered["elimination"], "minimum-degree");
    // A chain has no fill in either.
    assert!(default["factor_entries"].as_u64() > Some(0));
    assert_eq!(default["factor_entries"], ordered["factor_entries"]);
    let resting = run("--set equilibrium=true");
    assert!(
        resting["max_elongation_error"]
            .as_f64()
            .is_some_and(|e| e < 1e-9),
        "{resting}"
    );
    for (options, word) in [
        ("--stiffness=-1", "alpha"),
        ("--stiffness nan", "alpha"),
        ("--stiffness soft", "stiffness"),
        ("--guard=-1", "guard.tolerance"),
        ("--guard never", "--guard"),
        ("--substeps 0", "substeps"),
        ("--scheme third-difference:a=0.1", "`a`"),
        ("--scheme third-difference:gamma=1", "gamma"),
        ("--scheme euler", "third-difference"),
        ("--elimination band", "minimum-degree"),
        ("--dt=-1", "--dt"),
        ("--dt nan", "--dt"),
        ("--dt 1/0", "--dt"),
        ("--set damping=-1", "damping"),
        ("--set ea=0", "ea"),
    ] {
        refused(&at, &format!("run hoist {options}"), &[word]);
    }
}

#[test]
fn sweeps_refuse_what_has_no_effect_on_them() {
    let at = folder("sweeps");
    refused(&at, "bench --sweep crane", &["crane", "--sweep", "linear"]);
    refused(&at, "bench --sweep", &["--sweep", "--help"]);
    for option in ["--iterations 5", "--set length=5", "--time 1", "--dt 1/60"] {
        let name = option.split(' ').next().unwrap_or_default();
        refused(
            &at,
            &format!("bench --sweep linear {option}"),
            &[name, "no effect on `--sweep linear`"],
        );
    }
    refused(&at, "--sweep linear --ratios 0", &["--ratios", "positive"]);
    refused(&at, "bench --sweep linear --segments 0", &["segments is 0"]);
    refused(
        &at,
        "bench --sweep linear --backends superlu",
        &["superlu", "banded"],
    );
}

#[test]
fn the_paper_writes_checks_rows_and_charts() {
    let at = folder("paper");
    refused(&at, "paper fig6", &["fig6", "table1", "claims", "drawings"]);
    let checks = json(&at, "paper fig4 fig5 --quick --json -");
    let checks = checks.as_array().expect("a list");
    assert!(checks.len() >= 3);
    for check in checks {
        for field in ["case", "reference", "ours", "criterion", "verdict", "note"] {
            assert!(check[field].is_string(), "{field}: {check}");
        }
        for field in ["error", "bar"] {
            assert!(check[field].is_number() || check[field].is_null());
        }
    }
    for name in ["fig4", "fig5"] {
        let file = |end| fs::read_to_string(at.join(format!("target/taut/paper/{name}.{end}")));
        let csv = file("csv").expect("rows");
        assert!(csv.lines().count() > 1000, "{csv}");
        let record: Value = serde_json::from_str(&file("json").expect("checks")).expect("JSON");
        assert_eq!(record["experiment"], name);
        assert!(record["quick"].as_bool().expect("whether quick"));
        let svg = file("svg").expect("a chart");
        assert!(svg.starts_with("<svg") && svg.contains("stretch") | svg.contains("frequency"));
    }
    let table = good(&at, "paper fig12 --quick --out figures");
    assert!(at.join("figures/fig12.svg").exists());
    assert!(table.contains("Fig. 12: bend") && table.contains("pass"));
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    fs::write(at.join("taken"), "").expect("writes");
    let output = taut(&at, "paper fig4 --quick --out taken/here");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("taken/here"));
}

#[test]
fn hard_cases_are_checks_by_name() {
    let at = folder("hard");
    refused(&at, "hard H99", &["H99", "H42", "H47", "H50"]);
    let checks = json(&at, "hard h50 H50 --quick --json -");
    let checks = checks.as_array().expect("a list");
    assert!(checks.len() >= 4);
    for check in checks {
        for field in ["case", "reference", "ours", "criterion", "verdict", "note"] {
            assert!(check[field].is_string(), "{field}: {check}");
        }
        for field in ["error", "bar"] {
            assert!(check[field].is_number() || check[field].is_null());
        }
    }
    let table = good(&at, "hard H42 --quick --json checks.json");
    assert!(table.contains("H42: dependent") && table.contains("limit"));
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    assert!(at.join("checks.json").exists());
}

#[test]
fn the_main_job_takes_scenes_with_branches_and_loops() {
    let at = folder("scenes");
    let rows = json(
        &at,
        "bench --scene ring,net --segments 8,9 --ratios 10 --backends banded,cg:group --iterations 50 --json -",
    );
    let records = rows["records"].as_array().expect("a list");
    // The ring has three more orders of elimination.
    assert_eq!(records.len(), 2 * (1 + 3 + 1) + 2 * 2);
    for record in records {
        for field in [
            "rows",
            "bodies",
            "size",
            "step_ns",
            "solve_ns_per_row",
            "forward_error",
        ] {
            assert!(record[field].is_number(), "{field}: {record}");
        }
        assert!(record["error"].is_null(), "{record}");
        assert!(record["load_difference"].as_f64().expect("a run") < 1e-8);
    }
    let table = good(
        &at,
        "bench --scene ladder --quick --backends banded,faer:lu/kkt",
    );
    assert!(table.contains("ladder, 3 cables") && !table.contains("MISSED"));
    refused(&at, "bench --scene rung", &["rung", "ring", "ladder"]);
    refused(&at, "bench --scene ring --time 3", &["--time", "--scene"]);
    refused(
        &at,
        "bench --scene ring --segments 3",
        &["segments", "at least 8"],
    );
}

#[test]
fn networks_run_by_name() {
    let at = folder("networks");
    for scene in [
        "ring --set points=1",
        "junction --set joint=spherical",
        "cranes --set mass_ratio=1e4",
        "ladder --set cables=3",
        "net --set rows=5 --set held=corners",
    ] {
        let run = json(
            &at,
            &format!("run {scene} --set seed=1 --time 0.5 --json -"),
        );
        assert_eq!(run["stable"], true, "{run}");
    }
    refused(&at, "run net --set columns=1", &["columns", "at least 2"]);
}

#[test]
fn chains_and_specimens_run_by_name() {
    let at = folder("named_scenes");
    for name in [
        "particles-b",
        "particles-c",
        "particles-d",
        "particles-e",
        "particles-f",
    ] {
        let run = json(
            &at,
            &format!("run {name} --scheme linearly-implicit --time 1 --json -"),
        );
        assert_eq!(run["scene"], name);
        assert_eq!(run["stable"], true, "{run}");
    }
    for name in ["pull", "twist", "bend"] {
        let run = json(
            &at,
            &format!("run {name} --set material=nylon --set segments=6 --time 0.5 --json -"),
        );
        assert_eq!(run["scene"], name);
        assert_eq!(run["steps"], 30, "{run}");
    }
    refused(
        &at,
        "run particles-e --set added_compliance=-1",
        &["added_compliance"],
    );
    refused(
        &at,
        "run twist --set joint=spherical",
        &["joint", "cosserat"],
    );
}

#[test]
fn json_goes_to_a_file_beside_the_table() {
    let at = folder("bench_file");
    let stdout = good(
        &at,
        "bench --quick --segments 3 --ratios 5 --iterations 2 --time 0.3 --json rows.json",
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
}

#[test]
fn the_static_table_is_json_too() {
    let at = folder("static");
    let rows = json(&at, "static --segments 3 --ratios 10 --limit 200 --json -");
    for row in rows["settled"].as_array().expect("direct solvers") {
        assert!(row["error"].as_f64().is_some_and(|e| e <= 1e-9), "{row}");
    }
    if cfg!(feature = "cg") {
        let needed = rows["needed"].as_array().expect("iterative solvers");
        let cg = needed.iter().filter(|r| r["backend"] == "cg:jacobi");
        assert!(
            cg.map(|r| r["iterations"].as_u64()).all(|n| n == Some(4)),
            "{rows}"
        );
    }
}

/// `taut run … | head -1`: whoever stops reading is not told of a panic.
#[cfg(unix)]
#[test]
fn a_reader_that_stops_reading_is_no_panic() {
    let at = folder("closed_pipe");
    for arguments in ["backends", "run hoist --set segments=2 --time 0.1"] {
        let mut child = program(&at, arguments)
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
    assert!(good(&at, "--version").contains(env!("CARGO_PKG_VERSION")));
    for command in [
        "--help",
        "run --help",
        "bench --help",
        "static --help",
        "backends --help",
    ] {
        assert!(good(&at, command).contains("Usage"), "{command}");
    }
}
