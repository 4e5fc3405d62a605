use crate::*;

/// A trolley that drives off and stops, a hook that is lifted: jerks that the winches slip at.
const INPUTS: &str = "time,trolley_speed,hoist_speed\n0,0,0\n0.2,0.5,0\n0.4,0.5,0.3\n0.6,0,0\n";

const GANTRY: &str = "gantry --set segments=3 --set winch_force=3300 --set trolley_force=500";

/// A folder with the inputs in `inputs.csv`.
fn with_inputs(name: &str) -> At {
    let at = folder(name);
    at.write("inputs.csv", INPUTS);
    at
}

fn same(a: &Value, b: &Value, place: &str) {
    for what in ["load", "final_state", "energy", "max_violation_m", "steps"] {
        assert_eq!(a[what], b[what], "{place}: {what}");
        assert!(!a[what].is_null(), "{place}: {what}");
    }
}

/// Where the trolley is at the end \[m].
fn trolley(run: &Value) -> f64 {
    run["final_state"]["position"][1][0].as_f64().expect("x")
}

#[test]
fn a_driven_run_can_be_repeated() {
    let at = with_inputs("driven");
    let arguments = format!("run {GANTRY} --controls inputs.csv --time 1 --json -");
    let first = at.json(&arguments);
    let found = (&first["stable"], &first["steps"]);
    assert_eq!(found, (&true.into(), &60.into()));
    same(&first, &at.json(&arguments), "twice");
    // 0.2 s at 0.5 m/s and two ramps of as much: the rail's motor slips at first.
    let way = trolley(&first);
    assert!(way > 0.1 && way < 0.21, "{way}");
    let still = at.json(format!("run {GANTRY} --time 1 --json -"));
    assert!(trolley(&still).abs() < 1e-6, "{still}");
    assert_ne!(first["final_state"], still["final_state"]);
    // Without limits the trolley goes just where the table says.
    let strong = "run gantry --set segments=3 --controls inputs.csv --time 1 --json -";
    let way = trolley(&at.json(strong));
    assert!((way - 0.2).abs() < 1e-9, "{way}");
}

#[test]
fn faulty_inputs_are_refused_with_their_line() {
    let at = folder("faulty_inputs");
    for (text, words) in [
        ("", &["time"][..]),
        ("time,hoist_speed\n0,0\n1,nan\n", &["line 3", "finite"]),
        ("time,hoist_speed\n0,\n", &["line 2", "finite"]),
        ("time,hoist_speed\n0,0\n1,0\n1,0\n", &["line 4", "ascend"]),
        ("time,hoist_speed\n1,0\n0,0\n", &["line 3", "ascend"]),
        ("time,hoist_speed\n0,0,0\n", &["line 2", "has 3 values"]),
    ] {
        at.write("bad.csv", text);
        let mut all = vec!["bad.csv"];
        all.extend(words);
        at.refused("run gantry --controls bad.csv --time 0.1", &all);
    }
    at.write("bad.csv", [0xff, 0xfe, 0x00]);
    let rows = r"
        run gantry --controls bad.csv → bad.csv … UTF-8
        run gantry --controls none.csv → none.csv … cannot read
        run gantry --controls → --controls … --help
    ";
    at.refuses(rows);
    // A scene without controls has none of that name.
    at.write("bad.csv", "time,hoist_speed\n0,0\n");
    let rows = r"
        run hoist --controls bad.csv → hoist_speed
        run gantry --set winch_force=-1 → winch_force is -1 … ≥ 0 N
        run gantry --set parts=1 → parts is 1 … 2 to 12
        scene gantry --set drop=nan → drop is NaN
        scene gantry --set pulleys=3 → pulleys … sheaves … parts
    ";
    at.refuses(rows);
}

/// A winch that hauls in and pays out segments: their number changes between steps without an event.
#[test]
fn segments_leave_and_enter_at_a_winch() {
    let at = folder("segments_wound");
    let crane = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../integrator/examples/segment_crane.toml"
    );
    let run = at.json(format!(
        "run {crane} --time 5 --columns rope-start.length --json -"
    ));
    assert_eq!(run["stable"], true, "{}", run["failure"]);
    let lengths = run["columns"]["rope-start.length [m]"].as_array();
    let lengths = lengths.expect("a list");
    let [first, last] = [lengths.first(), lengths.last()].map(|x| x.and_then(Value::as_f64));
    let hauled = first.expect("a length") - last.expect("a length");
    assert!((hauled - 2.0).abs() < 0.02, "0.5 m/s for 4 s: {hauled}");
    let bodies = run["final_state"]["name"].as_array().expect("names").len();
    assert!(bodies < 22, "{bodies}");
}
