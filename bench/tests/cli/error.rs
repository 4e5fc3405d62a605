use crate::*;

const SWING: &str = "run hoist --set segments=6 --set equilibrium=true --set move_x=0.5 --time 2";

fn error_mm(run: &Value) -> f64 {
    let part = |name: &str| run["error"][name].as_f64().expect("a number");
    1e3 * (part("time") + part("algebra") + part("segments"))
}

/// The sub-steps that are taken keep the error that is asked for, and half of them do not.
#[test]
fn sub_steps_keep_an_error() {
    let at = folder("error");
    let bare = at.json(format!("{SWING} --json -"));
    assert!(error_mm(&bare) > 0.02, "{}", bare["error"]);
    assert!(at.good(SWING).contains("load error"));
    let kept = at.json(format!("{SWING} --error 0.02 --json -"));
    let substeps = kept["substeps"].as_u64().expect("a number");
    assert!(substeps > 1 && error_mm(&kept) <= 0.02, "{substeps}");
    let half = at.json(format!("{SWING} --substeps {} --json -", substeps / 2));
    assert!(error_mm(&half) > 0.02);
    let off = at.json(format!("{SWING} --estimate off --json -"));
    assert!(off.get("error").is_none());
    assert_eq!(off["final_state"], bare["final_state"]);
}

#[test]
fn errors_that_cannot_be_kept_are_told() {
    let at = folder("no_error");
    let rows = format!(
        r"
        {SWING} --estimate 1 → estimate … 2
        {SWING} --estimate x → --estimate … off
        {SWING} --error 0 → --error
        {SWING} --estimate off --error 1 → --error … --estimate off
        run --resume x.json --error 1 → --error … --resume
        "
    );
    at.refuses(&rows);
    // The shape of two segments is wrong by more.
    let [_, said] = at.ends(
        1,
        "run hoist --set segments=3 --set initial_angle=1 --set mass_ratio=1 --time 1 --error 1e-3",
    );
    assert!(said.contains("sub-steps"), "{said}");
}

/// Scenes at rest are not wrong by a tenth of a motion that they do not have; each part has its own cure.
#[test]
fn the_cure_of_an_error_is_that_of_its_largest_part() {
    let at = folder("cure");
    let rest = [
        "ladder", "net", "gantry", "cranes", "stack", "pull", "twist", "bend", "junction",
    ];
    let rest = rest.map(|scene| (scene, "time step ", "; over"));
    let others = [
        ("ring", "more segments lessen it", "--substeps"),
        (
            "hoist",
            "its motion of 9.0e0 mm: smaller steps lessen it",
            "more segments",
        ),
        ("hoist --dt 0.1 --time 0.1", "none was compared", "about"),
    ];
    for (scene, says, not) in rest.into_iter().chain(others) {
        let time = if scene.contains("--time") {
            ""
        } else {
            " --time 1"
        };
        let told = at.good(format!("run {scene}{time}"));
        let line = told.lines().find(|line| line.contains("load error"));
        let line = line.unwrap_or_else(|| panic!("{scene}: {told}"));
        let holds = line.contains(says) && !line.contains(not);
        assert!(holds, "{scene}: {line}");
        assert!(!told.contains("median -"), "{scene}: {told}");
    }
    let short = "run hoist --dt 10 --time 5";
    at.refused(short, &["--time", "at least one step"]);
}

#[test]
fn the_widest_gap_has_a_name_and_a_time() {
    let at = folder("widest");
    for scene in ["hoist", "tackle", "capstan", "particles-a"] {
        let run = at.json(format!("run {scene} --time 0.5 --json -"));
        let gap = &run["largest_gap"];
        assert_eq!(gap["gap_m"], run["max_violation_m"], "{scene}: {gap}");
        let holds = gap["joint"].is_string() && gap["time"].as_f64() > Some(0.0);
        assert!(holds, "{scene}");
    }
    // Rigid links of a fast motion open by what a step's curvature is.
    let run = at.json("run particles-a --time 2 --json -");
    assert!(run["unexplained_gap"]["gap_m"].as_f64() > Some(1e-3));
    let told = at.good("run particles-a --time 2");
    has(&told, "more than its force explains at t = ");
}
