use crate::*;

const INPUTS: &str = "time,trolley_speed,hoist_speed\n0,0,0\n0.2,0.5,0\n0.4,0.5,0.3\n0.6,0,0\n";

#[test]
fn a_resumed_run_is_the_run_itself() {
    let at = folder("resumed");
    at.write("inputs.csv", INPUTS);
    for scene in [
        "gantry --set segments=3 --set winch_force=3300 --controls inputs.csv",
        "hoist --set segments=4 --set seed=1 --set move_x=0.5 --set mass_ratio=100",
        "hoist --set segments=4 --set seed=1 --backend cg:jacobi:iterations=20",
        "particles-f --set seed=3 --scheme spook --substeps 2 --guard 1e-4",
    ] {
        let whole = at.json(format!(
            "run {scene} --time 1 --json - --save half.json --save-at 0.5"
        ));
        let controls = if scene.contains("--controls") {
            "--controls inputs.csv"
        } else {
            ""
        };
        let rest = at.json(format!(
            "run --resume half.json {controls} --time 0.5 --json -"
        ));
        for same in "scene backend scheme guard dt final_state planar".split(' ') {
            assert_eq!(whole[same], rest[same], "{scene}: {same}");
            assert!(!whole[same].is_null(), "{scene}: {same}");
        }
        assert_eq!(whole["energy"]["end"], rest["energy"]["end"], "{scene}");
        let path =
            |run: &serde_json::Value| run["load"]["position"].as_array().expect("a list").clone();
        let (all, rest) = (path(&whole), path(&rest));
        assert_eq!((all.len(), rest.len()), (60, 30), "{scene}");
        assert_eq!(all[30..], rest[..], "{scene}");
    }
    // By default the end is saved; what is resumed and saved at once is the same text.
    at.good("run ring --time 0.2 --save a.json");
    let once = at.json("run ring --time 0.4 --json - --save b.json");
    let again = at.json("run --resume a.json --time 0.2 --json - --save c.json");
    assert_eq!(once["final_state"], again["final_state"]);
    let read = |name: &str| at.read(name);
    assert_eq!(read("b.json"), read("c.json"));
    assert_ne!(read("a.json"), read("b.json"));
}

/// A run that was driven says so where it goes on without its table.
#[test]
fn a_driven_run_goes_on_with_its_table() {
    let at = folder("driven_on");
    at.write("inputs.csv", INPUTS);
    let run = "gantry --set segments=3 --controls inputs.csv --time 0.3";
    at.good(format!("run {run} --save a.json"));
    let words = [
        "a.json` was driven",
        "trolley_speed, hoist_speed",
        "--controls",
    ];
    at.refused("run --resume a.json --time 0.1", &words);
    let on = "run --resume a.json --time 0.1 --json -";
    let held = at.json(format!("{on} --hold-controls --save b.json"));
    let driven = at.json(format!("{on} --controls inputs.csv"));
    assert_ne!(held["final_state"], driven["final_state"]);
    at.refused("run --resume b.json --time 0.1", &["was driven"]);
    at.refused("run hoist --hold-controls", &["--hold-controls"]);
}

#[test]
fn files_that_are_no_saved_run_are_refused() {
    let at = folder("not_saved");
    at.good("run hoist --set segments=3 --time 0.1 --save run.json");
    let text = at.read("run.json");
    let write = |text: &str| at.write("bad.json", text);
    // Keys in another order, whole numbers without a point.
    let sorted: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let sorted = sorted.as_object().expect("an object").iter().rev();
    let entry = |(key, value): (&String, &serde_json::Value)| format!("\"{key}\": {value}");
    let sorted: Vec<_> = sorted.map(entry).collect();
    write(&format!("{{{}}}", sorted.join(",\n")).replace("0.0,", "0,"));
    at.good("run --resume bad.json --time 0.1");
    let rows = r#"
        version":3 | version":7 | version 7 … run the scene again
        substeps":1 | substeps":2 | bad.json` is damaged … checksum
        backend":"banded | backend":"best | best … banded
        contacts":"newton | contacts":"staggered:sweeps=10 | staggered … before the joints … newton
    "#;
    write(&text[..text.len() / 3]);
    let read = "run --resume bad.json --time 0.1 → bad.json";
    at.refuses(format!("{read} … no saved run … EOF"));
    for row in rows.trim().lines() {
        let [old, new, words] = [0, 1, 2].map(|k| row.trim().split(" | ").nth(k).expect("three"));
        write(&text.replacen(old, new, 1));
        at.refuses(format!("{read} … {words}"));
    }
    at.write("bad.json", [0xff, 0xfe, 0x00]);
    let rows = r"
        run --resume bad.json → bad.json … UTF-8
        run --resume none.json → none.json … cannot read
        run --resume run.json --dt 0.01 → --resume … --dt
        run hoist --resume run.json → --resume … SCENE
        run --resume run.json --set segments=4 → --resume … --set
        run hoist --save-at 1 → --save … --help
        run hoist --time 1 --save x.json --save-at 2 → --save-at … 2 s … 1 s
        run --resume run.json --time 1 --save x.json --save-at 0 → --save-at … 0 s
        run hoist --save x.json --save-at nan → --save-at
        run hoist --time 0.1 --save - --json - → `--save` … share
    ";
    at.refuses(rows);
}
