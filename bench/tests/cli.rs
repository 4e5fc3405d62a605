//! The command line as a user or a script meets it: exit codes, one line on standard error, JSON alone on standard
//! output.

use serde_json::Value;
use std::process::{Command, Output};

/// Runs `taut` in the build's temporary folder, so that what it writes stays out of the tree.
fn taut(args: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(args)
        .current_dir(env!("CARGO_TARGET_TMPDIR"))
        .output();
    output.expect("the binary runs")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Bad input ends with code 2 and one line that holds all of `says`.
#[track_caller]
fn refused(args: &[&str], says: &[&str]) {
    let output = taut(args);
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{args:?}: {text}");
    assert_eq!(text.lines().count(), 1, "{args:?}: {text}");
    for word in says {
        assert!(
            text.contains(word),
            "{args:?} does not say `{word}`: {text}"
        );
    }
    assert!(
        output.stdout.is_empty(),
        "{args:?} prints to standard output"
    );
}

#[test]
fn bad_names_list_what_there_is() {
    refused(&["run", "nope"], &["nope", "hoist"]);
    refused(
        &["run", "hoist", "--backend", "superlu"],
        &["superlu", "banded", "cg"],
    );
    refused(
        &["run", "hoist", "--backend", "cg:fast"],
        &["fast", "jacobi"],
    );
    refused(
        &["run", "hoist", "--backend", "cg/kkt"],
        &["positive definite", "/kkt"],
    );
    refused(&["run", "hoist", "--scheme", "euler"], &["euler"]);
    refused(
        &["run", "hoist", "--set", "lenght=3"],
        &["lenght", "length"],
    );
    refused(
        &["run", "hoist", "--set", "joint=glue"],
        &["glue", "cosserat"],
    );
    refused(
        &["bench", "--backends", "banded,pardiso"],
        &["pardiso", "umfpack"],
    );
    refused(&["fly"], &["fly", "--help"]);
}

#[test]
fn bad_numbers_say_what_is_allowed() {
    for (set, says) in [
        ("segment_mass=-1", "> 0"),
        ("segment_mass=0", "> 0"),
        ("length=0", "> 0"),
        ("length=nan", "> 0"),
        ("ea=inf", "ea"),
        ("segments=0", "at least 1"),
        ("segments=99999999999", "at most"),
        ("mass_ratio=1e300", "finite"),
        ("foo", "KEY=VALUE"),
    ] {
        refused(&["run", "hoist", "--set", set], &[says]);
    }
    refused(&["run", "hoist", "--dt=-1"], &["--dt", "positive"]);
    refused(&["run", "hoist", "--dt=nan"], &["--dt", "positive"]);
    refused(&["run", "hoist", "--time", "1e300"], &["--time", "at most"]);
    refused(&["bench", "--ratios", "x"], &["x", "--ratios"]);
    refused(&["bench", "--ratios=-1"], &["--ratios", "positive"]);
    refused(&["bench", "--segments", "0"], &["segments", "at least 1"]);
    refused(
        &["bench", "--iterations", "0"],
        &["--iterations", "at least 1"],
    );
    refused(&["bench", "--time", "1e300"], &["--time", "at most"]);
    refused(&["static", "--ratios", "nan"], &["--ratios", "positive"]);
}

#[test]
fn bad_files_are_located() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("files");
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("a temporary file");
        path.to_string_lossy().into_owned()
    };
    let missing = folder.join("missing.toml");
    refused(
        &["run", &missing.to_string_lossy()],
        &["missing.toml", "cannot read"],
    );
    refused(&["run", &folder.to_string_lossy()], &["cannot read"]);
    refused(
        &["run", &file("empty.toml", "")],
        &["no bodies", "[[body]]"],
    );
    refused(
        &["run", &file("broken.toml", "[hoist]\nlength = = 2\n")],
        &["line 2"],
    );
    refused(
        &["run", &file("key.toml", "[hoist]\nlenght = 2\n")],
        &["lenght", "length"],
    );
    refused(
        &["run", &file("mass.toml", "[hoist]\nsegment_mass = -2\n")],
        &["segment_mass", "> 0"],
    );
    let good = file("good.toml", "[hoist]\nsegments = 3\nmass_ratio = 2.0\n");
    let output = taut(&[
        "run",
        &good,
        "--time",
        "0.1",
        "--out",
        &format!("{good}/x.csv"),
    ]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(
        taut(&["run", &good, "--time", "0.1"]).status.code(),
        Some(0)
    );
    std::fs::remove_dir_all(&folder).expect("the folder goes");
}

#[test]
fn a_backend_that_is_not_compiled_in_names_its_feature() {
    for backend in taut_solver::Backend::all()
        .iter()
        .filter(|b| !b.is_compiled())
    {
        let feature = backend.feature().expect("only features are left out");
        refused(
            &["run", "hoist", "--backend", backend.name()],
            &["not compiled in", feature],
        );
    }
}

#[test]
fn a_run_tells_everything_as_json_and_nothing_else() {
    let args = [
        "run",
        "hoist",
        "--set",
        "segments=4",
        "--set",
        "mass_ratio=5",
        "--set",
        "initial_angle=0.2",
    ];
    let output = taut(&[&args[..], &["--time", "0.5", "--json", "-"]].concat());
    assert_eq!(
        (output.status.code(), stderr(&output).as_str()),
        (Some(0), "")
    );
    let run: Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
    for field in [
        "scene",
        "backend",
        "scheme",
        "dt",
        "steps",
        "stable",
        "max_violation_m",
        "max_elongation_error",
    ] {
        assert!(!run[field].is_null(), "{field}");
    }
    assert_eq!(run["load"]["time"].as_array().map(Vec::len), Some(30));
    assert_eq!(run["load"]["position"][0].as_array().map(Vec::len), Some(3));
    for end in ["start", "end"] {
        for kind in ["kinetic", "gravity", "elastic"] {
            assert!(run["energy"][end][kind].is_f64(), "{end} {kind}");
        }
    }
    assert!(run["step_ns"]["median"].as_f64() > Some(0.0));
    assert_eq!(
        run["final_state"]["position"].as_array().map(Vec::len),
        Some(5)
    );
}

#[test]
fn an_unstable_run_ends_with_code_1_and_says_when() {
    let args = [
        "run",
        "hoist",
        "--set",
        "mass_ratio=1e5",
        "--set",
        "seed=1",
        "--set",
        "move_x=0.5",
    ];
    let output = taut(&[&args[..], &["--time", "5"]].concat());
    let text = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.lines().count() == 1 && text.contains("unstable at t ="),
        "{text}"
    );
    assert!(String::from_utf8_lossy(&output.stdout).contains("verdict"));
}

#[test]
fn the_main_job_writes_every_field() {
    let args = [
        "bench",
        "--quick",
        "--segments",
        "4",
        "--ratios",
        "10",
        "--iterations",
        "1,5",
        "--time",
        "0.3",
    ];
    let output = taut(&[&args[..], &["--json", "-"]].concat());
    assert_eq!(
        (output.status.code(), stderr(&output).as_str()),
        (Some(0), "")
    );
    let rows: Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
    let rows = rows.as_array().expect("a list of records");
    assert!(rows.len() > 5);
    let fields = "scene segments mass_ratio backend options iterations dt step_ns step_ns_min solve_ns \
                  backward_error forward_error elongation_error load_error_m energy_drift max_violation_m stable";
    for row in rows {
        for field in fields.split_whitespace() {
            assert!(row.get(field).is_some(), "{field} in {row}");
        }
    }
}

#[test]
fn backends_are_listed_with_licences() {
    let output = taut(&["backends"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0));
    for backend in taut_solver::Backend::all() {
        assert!(
            text.contains(backend.name()) && text.contains(backend.licence()),
            "{text}"
        );
    }
}
