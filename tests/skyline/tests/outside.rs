//! A solver from outside in the stepper and in the commands of `taut`; what one does wrong.

use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output};
use taut_integrator::{StepOptions, Stepper};
use taut_model::HoistParams;
use taut_skyline::{SKYLINE, Skyline};
use taut_solver::agreement::{Claims, check};

const PROGRAM: &str = env!("CARGO_BIN_EXE_skyline");
const FAULTY: &str = env!("CARGO_BIN_EXE_faulty");

fn run(program: &str, place: &str, arguments: &str) -> Output {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(place);
    std::fs::create_dir_all(&folder).expect("a folder to write to");
    let mut command = Command::new(program);
    command.current_dir(folder).args(arguments.split(' '));
    command.output().expect("the program starts")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("UTF-8")
}

fn good(program: &str, place: &str, arguments: &str) -> String {
    let output = run(program, place, arguments);
    let told = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "`{arguments}`: {told}");
    text(&output.stdout).to_owned()
}

/// The rows that a command writes, and their solvers.
fn rows(program: &str, place: &str, arguments: &str) -> Vec<(String, Value)> {
    let stdout = good(program, place, &format!("{arguments} --json -"));
    let all: Value = serde_json::from_str(&stdout).expect("JSON");
    let rows = all.get("records").unwrap_or(&all);
    let rows: Vec<Value> = rows.as_array().expect("rows").clone();
    // Kernels may be something else than a backend.
    let solver = |row: &Value| {
        row.get("backend")
            .or(row.get("solver"))?
            .as_str()
            .map(str::to_owned)
    };
    let backend = |row: &Value| solver(row).expect("a solver");
    rows.into_iter().map(|row| (backend(&row), row)).collect()
}

#[test]
fn it_agrees_as_every_backend_has_to() {
    let mut made = (SKYLINE.create)("").expect("no options");
    for solver in [
        &mut Skyline::default(),
        &mut *made as &mut dyn taut_solver::LinearSolver,
    ] {
        check(solver, &Claims::DIRECT).unwrap_or_else(|e| panic!("{e}"));
    }
}

#[test]
fn the_stepper_steps_with_it() {
    let scene = || HoistParams::default().build().expect("a scene");
    let options = StepOptions::default;
    let solver = Box::new(Skyline::default());
    let given = Stepper::with_solver(scene(), options(), solver, SKYLINE.capabilities);
    let mut given = given.expect("a stepper");
    let mut named = Stepper::new(scene(), options()).expect("a stepper");
    for _ in 0..30 {
        assert!(given.step().expect("a step").solve.is_claim());
        named.step().expect("a step");
    }
    let last = |stepper: &Stepper| stepper.scene().bodies.position.last().copied();
    let apart = last(&given).zip(last(&named)).map(|(a, b)| (a - b).norm());
    assert!(apart.is_some_and(|apart| apart < 1e-9), "{apart:?}");
}

#[test]
fn it_stands_in_every_table_by_default() {
    let at = "tables";
    let line = good(PROGRAM, at, "backends");
    let mut line = line.lines();
    let line = line.find(|l| l.contains("skyline")).expect("its row");
    let holds = line.contains("MIT OR Apache-2.0") && line.contains("definite");
    assert!(holds, "{line}");
    for command in [
        "bench --quick --segments 3 --ratios 10 --iterations 1 --time 0.2",
        "study kernels --quick --segments 3",
        "study linear --quick --segments 3 --ratios 10",
    ] {
        let rows = rows(PROGRAM, at, command);
        let of = |name: &str| rows.iter().filter(|(own, _)| own == name).count();
        assert!(of("banded") > 0 && of("skyline") > 0, "`{command}`");
        assert_eq!(of("skyline"), of("nalgebra-sparse"), "`{command}`");
        let sound = |row: &Value| row["error"].is_null();
        let own = rows.iter().filter(|(name, _)| name == "skyline");
        assert!(own.into_iter().all(|(_, row)| sound(row)), "`{command}`");
    }
    // Its curves have its colour.
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(at);
    let page = std::fs::read_to_string(folder.join("target/taut/report.html")).expect("a page");
    let [red, green, blue] = SKYLINE.entry.colour;
    let stroke = format!("#{red:02X}{green:02X}{blue:02X}");
    let holds = page.contains("skyline") && page.contains(&stroke);
    assert!(holds, "{stroke}");
}

#[test]
fn its_options_are_its_own() {
    let rows = rows(
        PROGRAM,
        "options",
        "bench --quick --segments 3 --ratios 10 --time 0.2 --backends skyline:noise=16",
    );
    let mut all_hold = rows.iter();
    let all_hold = all_hold.all(|(_, row)| row["options"] == "skyline:noise=16");
    assert!(all_hold, "{rows:?}");
    for (backend, words) in [
        (
            "skyline:fast",
            "refuses `fast`: option `noise` is out of range",
        ),
        ("skyline:noise=-1", "refuses `noise=-1`"),
        ("skyline/kkt", "needs a positive definite matrix"),
        (
            "skylines",
            "umfpack, cg, gauss-seidel, minres, dense, skyline",
        ),
    ] {
        let line = &format!("run hoist --backend {backend}");
        let output = run(PROGRAM, "options", line);
        assert_eq!(output.status.code(), Some(2), "{backend}");
        let says = text(&output.stderr).contains(words);
        assert!(says, "{}", text(&output.stderr));
    }
}

#[test]
fn what_a_solver_does_wrong_marks_its_row_and_the_run_goes_on() {
    let command = "bench --quick --segments 3 --ratios 10 --iterations 1 --time 0.2";
    let rows = rows(FAULTY, "faulty", command);
    for (name, words) in [
        ("faulty:nan", "a NaN or an infinity in block 0"),
        ("faulty:claims", "claims a solution whose backward error is"),
        ("faulty:less", "rows of its solution unwritten"),
        ("faulty:more", "index out of bounds"),
        ("faulty:forgets", "refuses in `factorize`"),
    ] {
        let own: Vec<_> = rows.iter().filter(|(own, _)| own == name).collect();
        assert!(!own.is_empty(), "{name}");
        for (_, row) in own {
            let error = row["error"].as_str().unwrap_or_default();
            assert!(error.contains("solver `faulty`"), "{name}: {row}");
            assert!(error.contains(words), "{error}");
        }
    }
    assert!(
        rows.iter()
            .any(|(name, row)| name == "banded" && row["error"].is_null())
    );
}
