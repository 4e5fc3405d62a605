use crate::*;

const SWING: &str = "hoist --set segments=6 --set equilibrium=true --set move_x=0.5";

/// The last position of the load.
fn end(run: &Value) -> [f64; 3] {
    let path = run["load"]["position"].as_array().expect("a path");
    let last = path.last().expect("steps");
    [0, 1, 2].map(|k| last[k].as_f64().expect("a number"))
}

/// The command that a ledger ends with runs what it has written.
#[test]
fn the_lean_scene_runs_by_its_command_within_the_tolerance() {
    let at = folder("ledger");
    let arguments = format!("ledger {SWING} --time 1 --tolerance 50 --apply lean.toml --json -");
    let ledger = at.json(&arguments);
    let command = ledger["command"].as_str().expect("a command");
    let written = at.read("lean.toml");
    assert!(written.starts_with(&format!("# {command}\n")), "{written}");
    assert_eq!(ledger["lean"]["keeps"], true);
    let run = command.strip_prefix("taut ").expect("of this program");
    let ends = [
        at.json(format!("{run} --json -")),
        at.json(format!("run {SWING} --time 1 --json -")),
    ];
    let [lean, whole] = [end(&ends[0]), end(&ends[1])];
    let squares = lean.iter().zip(whole).map(|(a, b)| (a - b).powi(2));
    let apart = squares.sum::<f64>().sqrt();
    let told = ledger["lean"]["apart_mm"].as_f64().expect("a number");
    let holds = apart <= 1e-3 * told + 1e-12 && told < 100.0;
    assert!(holds, "{apart} {told}");
}

#[test]
fn what_has_no_ledger_is_told() {
    let at = folder("no_ledger");
    at.refused("ledger hoist --tolerance 0", &["--tolerance", "0"]);
    at.refused("ledger hoist --time 0.01", &["--time", "from 2 to"]);
    at.refused("ledger hoist --time 1e9", &["--time", "100000"]);
    // A blow in the first step leaves an error far above a nanometre.
    let [_, stderr] = at.ends(
        1,
        "ledger hoist --set segments=3 --time 0.2 --tolerance 1e-6 --apply lean.toml",
    );
    assert!(stderr.contains("beyond the tolerance"));
    let written = fs::read_to_string(at.join("lean.toml")).unwrap_or_default();
    assert_eq!(written, "");
    let shown = at.good("ledger twist --set segments=4 --time 0.1 --tolerance 5");
    has(&shown, "keeps … finest");
}
