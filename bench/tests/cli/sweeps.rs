use crate::*;

/// The rows and their errors are those of the golden file; times and the selection of rows are looked at here.
#[test]
fn the_main_job_times_each_solver_with_each_limit() {
    let at = folder("bench");
    let arguments = "bench --quick --segments 4 --ratios 10 --iterations 1,5 --time 0.3 --json -";
    let records = at.json(arguments);
    let records = records.as_array().expect("a list of records");
    for record in records {
        for field in "dt step_ns step_ns_min solve_ns elongation_error".split(' ') {
            let number = record[field].as_f64();
            assert!(number.is_some_and(f64::is_finite), "{field}: {record}");
        }
        let found = record["step_ns_min"].as_f64();
        assert!(found <= record["step_ns"].as_f64(), "{record}");
    }
    let compiled = taut_measure::Choice::all().into_iter();
    let compiled = compiled.filter(|c| c.check().is_ok());
    for choice in compiled {
        let rows = records.iter();
        let rows: Vec<_> = rows.filter(|r| r["backend"] == *choice.family()).collect();
        let iterations = rows.iter().filter_map(|r| r["iterations"].as_u64());
        let iterations: Vec<_> = iterations.collect();
        let expected: &[u64] = if choice.backend.is_iterative() {
            &[1, 5]
        } else {
            &[0]
        };
        assert_eq!(iterations, expected, "{choice}");
    }
}

#[test]
fn studies_read_what_narrows_them() {
    let rows = "\
linear --segments 4,3,3 --ratios 1e9,10 --backends dense,dense,dense/kkt | straight, 3 segments;bent, 4 segments;at most 1e-12 with
kernels --quick --segments 3 --ratios 10,1e5 --backends dense,banded,dense+refine,banded | 3 segments, 4 joints of 5 rows, mass ratio 1e5;dense:double+refine";
    // Two solvers, two cables, two ratios, two poses, three refinements; three solvers, two ratios, three kinds of joints.
    for (row, count) in rows.lines().zip([48, 18]) {
        let (call, told) = row.split_once(" | ").expect("two cells");
        let study = call.split(' ').next().expect("a name");
        let at = folder(&format!("{study}_narrow"));
        let stdout = at.good(format!("study {call}"));
        for words in told.split(';') {
            assert!(stdout.contains(words), "`{words}` is missing in\n{stdout}");
        }
        let rows = fs::read_to_string(at.join(format!("target/taut/{study}.json")));
        let rows: Value = serde_json::from_str(&rows.expect("the copy")).expect("JSON");
        let records = rows.get("records").unwrap_or(&rows);
        assert_eq!(records.as_array().map(Vec::len), Some(count), "{study}");
    }
}

#[test]
fn the_study_accuracy_compares_every_scheme_with_the_reference() {
    let at = folder("accuracy");
    let line = "study accuracy --segments 4 --ratios 100 --dt 1/60,1/120,1/240 --time 1 \
                --backends banded,cg:group --iterations 20 --json -";
    let results = at.json(line);
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
        let holds = record["step_ns"].as_f64().is_some_and(|ns| ns > 0.0);
        assert!(holds, "{record}");
        let holds = record["reference_m"].as_f64().is_some_and(|e| e < 1e-5);
        assert!(holds, "{record}");
    }
    assert_eq!(of("default", 1.0 / 60.0)["stable"], true);
    assert!(records.iter().any(|r| r["iterations"] == 20));
    // The references are kept: the same again is the same, to the last bit.
    assert!(at.join("target/taut/reference").is_dir());
    let again = at.json(line);
    for (a, b) in records
        .iter()
        .zip(again["records"].as_array().expect("a list"))
    {
        assert_eq!(a["horizontal_m"], b["horizontal_m"], "{a}");
    }
}

#[test]
fn the_main_job_takes_scenes_with_branches_and_loops() {
    let at = folder("scenes");
    let rows = at.json("bench --scene ring,net --segments 8,9 --ratios 10 --backends banded,cg:group --iterations 50 --json -");
    let records = rows["records"].as_array().expect("a list");
    // The ring has two more orders of elimination.
    assert_eq!(records.len(), 2 * (1 + 2 + 1) + 2 * 2);
    for record in records {
        for field in "rows bodies size step_ns solve_ns_per_row forward_error".split(' ') {
            assert!(record[field].is_number(), "{field}: {record}");
        }
        assert!(record["error"].is_null(), "{record}");
        assert!(record["load_difference"].as_f64().expect("a run") < 1e-8);
    }
    let table = at.good("study scenes --scene ladder --quick --backends banded,faer:lu/kkt");
    assert!(table.contains("ladder, 3 cables") && !table.contains("MISSED"));
    let rows = r"
        study scenes --scene rung → rung … ring … ladder
        bench --scene ring --time 3 → --time … ring.toml
        bench --scene ring --rows → --rows … ring.toml
        bench --scene ring --set seed=2 → --set … ring.toml
        bench --scene ring --scene gantry → gantry … ring.toml
        study scenes --time 3 → --time … unexpected argument
        study scenes --scene ring --segments 3 → segments … at least 8
    ";
    at.refuses(rows);
}

/// A double pendulum, released level; none of its bodies is called the load.
const BALLS: &str = include_str!("texts/balls.toml");

#[test]
fn the_main_job_takes_any_scene() {
    let at = folder("own_scene");
    at.write("balls.toml", BALLS);
    // Speeds that change in every frame, so that the systems of the common states depend on the way there.
    let drive = "time,trolley_speed,hoist_speed\n0,0,0\n0.5,0.5,0.4\n1,0,0\n";
    at.write("drive.csv", drive);
    let quick = "--quick --backends banded,dense,cg:group --iterations 50 --time 0.5";
    for (scene, name, ratio) in [
        ("balls.toml", "balls.toml", 4.0),
        (
            "gantry --set segments=4 --controls drive.csv",
            "gantry",
            1000.0,
        ),
    ] {
        let rows = at.json(format!("bench --scene {scene} {quick} --json -"));
        let rows = rows.as_array().expect("a list");
        assert_eq!(rows.len(), 3, "{name}");
        for row in rows {
            assert_eq!(row["scene"], name, "{row}");
            assert_eq!(row["mass_ratio"].as_f64(), Some(ratio), "{row}");
            assert!(row["segments"].is_null() && row["elongation_error"].is_null());
            assert!(row["error"].is_null() && row["stable"] == true, "{row}");
            assert!(row["joints"].as_u64() > Some(1) && row["step_ns"].as_f64() > Some(0.0));
            // The load moves by half a metre and more; the step's own error is a part of that.
            assert!(row["load_error_m"].as_f64() < Some(0.05), "{row}");
            if row["iterations"] == 0 {
                assert!(row["forward_error"].as_f64() < Some(1e-11), "{row}");
            }
        }
        let fastest = rows.iter().filter_map(|r| r["fastest_at"].as_array());
        assert_eq!(fastest.flatten().count(), 3, "{rows:?}");
        let page = at.read("target/taut/report.html");
        assert!(page.contains(&format!("{name}, mass ratio")), "{name}");
    }
    let answer = at.good(format!("bench --scene balls.toml,gantry {quick} --rows"));
    for words in [
        "balls.toml, gantry: Δt",
        "\n gantry ",
        "balls.toml, mass ratio 4, the step",
        "balls.toml: no load is named, `lower` moves most",
    ] {
        assert!(answer.contains(words), "`{words}` is missing in {answer}");
    }
}

#[test]
fn what_is_no_scene_to_measure_is_refused() {
    let at = folder("no_scene");
    at.write("notes.toml", "colour = 3\n");
    let wall = "name = \"wall\"\n[[body]]\nname = \"mast\"\nmobility = \"static\"\n";
    at.write("wall.toml", wall);
    at.write("drive.csv", "time,slew\n0,0\n");
    let rows = r"
        bench --scene notes.toml → notes.toml … colour
        bench --scene none.toml → none.toml … cannot read
        bench --scene crane → crane … gantry
        bench --scene wall.toml → wall … no moving bodies
        dump wall.toml --steps 0..3 --out s → wall … no moving bodies
        bench --scene gantry --segments 4 → --segments … --set
        bench --scene gantry --ratios 4 → --ratios … --set
        bench --scene gantry --set sheaves=3 → sheaves
        bench --scene gantry --controls drive.csv → drive.csv … slew
        bench --controls drive.csv → --scene
    ";
    at.refuses(rows);
}

#[test]
fn studies_are_listed_with_what_they_measure() {
    let list = folder("studies").good("study");
    for study in taut_studies::studies::STUDIES {
        let line = list.lines().find(|l| l.starts_with(study.name));
        let says = line.is_some_and(|l| l.ends_with(study.question().about));
        assert!(says, "{list}");
    }
}

#[test]
fn rows_of_a_study_are_a_csv_table() {
    let at = folder("csv");
    let line = "study linear --segments 3 --ratios 1,1e3 --backends dense --csv -";
    let text = at.good(line);
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let headings = reader.headers().expect("headings").clone();
    assert_eq!(headings.iter().next(), Some("pose"));
    let rows = reader.records().collect::<Result<Vec<_>, _>>();
    // Two ratios, two poses, three refinements.
    assert_eq!(rows.expect("rows of equal length").len(), 12);
    at.refused(format!("{line} --json -"), &["--csv", "--json"]);
}
