//! What the program prints is what it printed.

use crate::rows::Rows;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Agreement of two numbers, of the larger one: levels of SIMD round differently, and iterations amplify that.
pub(crate) const RELATIVE: f64 = 1e-3;

/// Agreement of numbers near zero: errors of rounding differ by machine.
pub(crate) const ABSOLUTE: f64 = 1e-9;

/// The folder of the golden files.
pub(crate) fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden")
}

/// True if the files are to be written, not compared: `TAUT_GOLDEN=write`.
pub(crate) fn writes() -> bool {
    std::env::var("TAUT_GOLDEN").is_ok_and(|word| word == "write")
}

/// The program with the words of a line, in a folder of its own.
pub(crate) fn program(name: &str, arguments: &str) -> Output {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("golden-{name}"));
    fs::create_dir_all(&folder).expect("a folder to write to");
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
    let arguments = arguments.split_whitespace();
    command
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::null());
    command.output().expect("the program starts")
}

/// Its standard output and exit code; its standard error is passed on.
pub(crate) fn taut(name: &str, arguments: &str) -> (String, i32) {
    let output = program(name, arguments);
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    (text, output.status.code().unwrap_or(-1))
}

fn json(name: &str, arguments: &str) -> Value {
    let (text, _) = taut(name, arguments);
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("`taut {arguments}`: {e}\n{text}"))
}

/// Writes the rows, or compares them with those of the file.
fn check(name: &str, now: &Rows) {
    let path = golden().join(format!("{name}.rows"));
    if writes() {
        fs::write(&path, now.to_string()).expect("a golden file is written");
        return;
    }
    let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let differences = Rows::parse(&text).differences(now);
    let holds = differences.is_empty();
    assert!(holds, "{name}:\n{}", differences.join("\n"));
}

/// Columns of the main job that tell no time.
const OF_BENCH: &str = "segments mass_ratio options iterations_used refinements backward_error forward_error \
    forward_error_unrefined load_error_m energy_drift max_violation_m stable claimed_converged \
    verified_converged verified_to_rounding frames failure error";

const OF_STATIC: &str = "backend segments mass_ratio elongation_m error error_continuum sideways_m";

const OF_CHECKS: &str = "experiment case reference ours error bar verdict";

/// Iterations that end by a tolerance, or do not converge, count otherwise on each machine.
const ITERATIVE: &[&str] = &[":tolerance=", "cg:none", "minres"];

/// Hard cases whose numbers are times, or ends of iterations and of motions that rounding decides; their bars hold them.
const UNSTEADY: &[&str] = &[
    "gantry load/element 1e5: all but the slowest",
    "gantry load/element 1e5: real-time factor",
    "gantry load/element 1e5: slowest step",
    "load 10⁵, driven: energy",
    "H54 iterations: load in 1 s",
    "H58 a net, five iterations",
];

/// Figures of the paper whose numbers are times or follow from times.
const TIMED: &[&str] = &[
    "fig13",
    "claims cost",
    "claims 3 iterations",
    "claims 20 iterations",
    "table2",
];

/// The rows of a study have these columns, named by `key`; of some only the names count.
fn has_rows(name: &str, arguments: &str, [columns, key]: [&str; 2], named: &[&str]) {
    let found = json(name, &format!("{arguments} --json - --quiet"));
    check(name, &Rows::of(&found, columns, key, named));
}

#[test]
fn the_main_job_has_its_rows() {
    let columns = [OF_BENCH, "segments mass_ratio options"];
    has_rows("bench", "bench --quick", columns, ITERATIVE);
}

#[test]
#[ignore = "takes minutes: `--ignored` runs it"]
fn hard_cases_have_their_rows() {
    let columns = [OF_CHECKS, "experiment case"];
    has_rows("hard", "hard --quick", columns, UNSTEADY);
}

#[test]
#[ignore = "takes minutes: `--ignored` runs it"]
fn the_papers_figures_have_their_rows() {
    let columns = [OF_CHECKS, "experiment case"];
    has_rows("paper", "paper --quick", columns, TIMED);
}

#[test]
#[ignore = "takes minutes: `--ignored` runs it"]
fn cables_at_rest_have_their_rows() {
    let columns = [OF_STATIC, "backend segments mass_ratio"];
    has_rows("static", "static", columns, ITERATIVE);
}

#[test]
fn named_scenes_have_their_states_and_texts() {
    let mut lines = Vec::new();
    for name in taut_model::named::NAMES.map(str::to_owned) {
        let (text, code) = taut("scene", &format!("scene {name} --quiet"));
        assert_eq!(code, 0, "{name}");
        let path = golden().join(format!("scenes/{name}.toml"));
        if writes() {
            fs::write(&path, &text).expect("a golden file is written");
        } else {
            let old = fs::read_to_string(&path).unwrap_or_default();
            assert_eq!(text, old, "`taut scene {name}` against {}", path.display());
        }
        let run = format!("run {name} --time 0.3333 --estimate off --out - --quiet");
        lines.push((name, taut("run", &run).0));
    }
    check("runs", &Rows::of_tables(&lines));
}
