use crate::*;

/// Headings and rows of a table; `None` for a cell without a number.
fn table(text: &str) -> (Vec<String>, Vec<Vec<Option<f64>>>) {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let headings = reader.headers().expect("a heading").iter();
    let headings = headings.map(ToOwned::to_owned).collect();
    let rows = reader.records().map(|record| {
        let record = record.expect("as long as the heading");
        record.iter().map(|cell| cell.parse().ok()).collect()
    });
    (headings, rows.collect())
}

#[test]
fn a_table_has_the_columns_that_are_asked_for_with_their_units() {
    let at = folder("columns");
    at.write("c.csv", "time,hoist_speed\n0,0\n0.5,0.1\n");
    let columns = "hook.vz,time,hoist_speed,bottom.tension,bottom.force,rope-1.length,load.speed,rail.drive,load_tension,rope-1.path";
    let run = "run gantry --set segments=3 --controls c.csv --time 0.5";
    let (headings, rows) = table(&at.good(format!("{run} --columns {columns} --out -")));
    let expected = [
        "hook.vz [m/s]",
        "time [s]",
        "hoist_speed",
        "bottom.tension [N]",
        "bottom.force [N]",
        "rope-1.length [m]",
        "load.speed [m/s]",
        "rail.drive [N]",
        "load_tension [N]",
        "rope-1.path [m]",
    ];
    assert_eq!(headings, expected);
    assert_eq!(rows.len(), 30);
    let value = |row: usize, column: usize| rows[row][column].expect("a number");
    for row in 0..30 {
        let time = value(row, 1);
        assert!((time - (row + 1) as f64 / 60.0).abs() < 1e-12);
        // The step holds the value of its middle.
        let speed = 0.2 * (time - 0.5 / 60.0);
        assert!((value(row, 2) - speed).abs() < 1e-12);
        // The tension is the part of the force along the cable.
        let along = value(row, 3) / value(row, 4);
        assert!(along > 0.99 && along < 1.0 + 1e-12, "{along}");
        assert_eq!(value(row, 3), value(row, 8));
        assert!(value(row, 7).abs() < 1.0, "nothing drives the trolley");
        // A taut rope is as long as its path, but for its stretch.
        let stretch = value(row, 9) / value(row, 5) - 1.0;
        assert!((0.0..1e-3).contains(&stretch), "{stretch}");
    }
    // Two falls a rope: it gets shorter twice as fast as the hook rises.
    let risen: f64 = (1..30).map(|row| value(row, 2) / 60.0).sum();
    let hauled = value(0, 5) - value(29, 5);
    assert!((hauled - 2.0 * risen).abs() < 1e-9, "{hauled} {risen}");
    assert!(value(29, 0) > 0.05 && value(29, 6) > 0.05);
}

#[test]
fn without_columns_the_table_is_that_of_the_run_and_its_names_are_columns() {
    let at = folder("default_columns");
    let run = "run hoist --set segments=2 --set move_x=0.5 --time 0.2 --out -";
    let (headings, rows) = table(&at.good(run));
    assert_eq!(
        headings.join(","),
        "time_s,load_x_m,load_y_m,load_z_m,kinetic_J,gravity_J,elastic_J,max_gap_m,iterations,step_ns,load_tension_N"
    );
    let named =
        "time,load_x,load_y,load_z,kinetic,gravity,elastic,max_gap,iterations,step,load_tension";
    let (headings, again) = table(&at.good(format!("{run} --columns {named}")));
    assert_eq!(
        headings.join(","),
        "time [s],load_x [m],load_y [m],load_z [m],kinetic [J],gravity [J],elastic [J],max_gap [m],iterations,\
         step [ns],load_tension [N]"
    );
    for (row, other) in rows.iter().zip(&again) {
        for column in (0..11).filter(|column| *column != 9) {
            assert_eq!(row[column], other[column], "{}", headings[column]);
        }
    }
    assert_eq!((rows.len(), again.len()), (12, 12));
}

#[test]
fn the_summary_holds_the_same_columns() {
    let at = folder("json_columns");
    let run = "run hoist --set segments=2 --time 0.2 --columns load.z,load.gap,anchor.tension";
    let summary = at.json(format!("{run} --out rows.csv --json -"));
    let text = at.read("rows.csv");
    let (headings, rows) = table(&text);
    let columns = summary["columns"].as_object().expect("an object");
    assert_eq!(columns.len(), 3);
    for (k, heading) in headings.iter().enumerate() {
        let series = columns[heading].as_array().expect("a list");
        let series: Vec<_> = series.iter().map(serde_json::Value::as_f64).collect();
        let column: Vec<_> = rows.iter().map(|row| row[k]).collect();
        assert_eq!(series, column, "{heading}");
    }
    let found = summary["load"]["position"][11][2].as_f64();
    assert_eq!(found, rows[11][0], "the load is the body of that name");
    let without = at.json("run hoist --set segments=2 --time 0.2 --json -");
    assert!(without.get("columns").is_none());
}

#[test]
fn what_an_event_makes_is_a_column_that_is_empty_until_then() {
    let at = folder("made_columns");
    let scene = r#"
load = "load"
[[body]]
name = "load"
mass = 100.0
shape = { sphere = { radius = 0.2 } }
[[massless_cable]]
name = "rope"
through = [{ body = "world", point = [0.0, 0.0, 3.0] }, { body = "load" }]
stretch = 1e-7
[[event]]
name = "tie"
at = 0.2
attach = [{ name = "link", a = { body = "world", point = [0.0, 0.0, 1.0] }, b = { body = "load" } }]
release = ["rope"]
"#;
    at.write("tied.toml", scene);
    let run = "run tied.toml --time 0.5 --out - --columns time";
    let (headings, rows) = table(&at.good(format!("{run},link.tension,link.gap")));
    assert_eq!(headings[1..], ["link.tension [N]", "link.gap [m]"]);
    assert_eq!(rows[0][1..], [None, None]);
    let last = rows[29][1].expect("a tension");
    assert!((last / 981.0 - 1.0).abs() < 1e-3, "{last}");
    let told = "`link` has no `slack`: choose one of tension";
    at.refused(format!("{run},link.slack"), &[told]);
}

/// The tower crane of the examples as a text: a sling is let go, another breaks under all of the load.
#[test]
fn what_comes_and_goes_is_told_and_followed() {
    let at = folder("events");
    let crane = include_str!("../../../integrator/examples/tower_crane.toml");
    let crane = crane.replace("name = \"right\"", "name = \"right\"\nbreaks_at = 4e4");
    let event = "[[event]]\nname = \"slip\"\nat = 0.5\nrelease = [\"left\"]\n";
    at.write("crane.toml", format!("{crane}\n{event}"));
    at.write("c.csv", "time,trolley_speed\n0,0\n1,0.5\n");
    let columns = "time,events,rope.tension,left.tension,right.tension,load.z,trolley.vx";
    let run = format!("run crane.toml --controls c.csv --time 1.5 --columns {columns}");
    let summary = at.json(format!("{run} --out rows.csv --json -"));
    let text = at.read("rows.csv");
    let (headings, rows) = table(&text);
    assert_eq!(headings[1..3], ["events", "rope.tension [N]"]);
    let names = |events: &serde_json::Value| -> Vec<String> {
        let events = events.as_array().expect("a list").iter();
        let name = |e: &serde_json::Value| e[1].as_str().expect("a name").to_owned();
        events.map(name).collect()
    };
    assert_eq!(names(&summary["events"]), ["slip", "right breaks"]);
    let forces = &summary["event_forces"];
    assert!(forces[0].is_null() && forces[1].as_f64().expect("a force") > 0.5 * 9.81 * 5300.0);
    let sum = |column: usize| -> f64 { rows.iter().filter_map(|row| row[column]).sum() };
    assert_eq!(sum(1), 2.0);
    let first = &rows[0];
    let weight = 9.81 * 5300.0;
    let tension = first[2].expect("a tension");
    assert!((tension / weight - 1.0).abs() < 0.05, "{tension}");
    let last = &rows[rows.len() - 1];
    assert_eq!((last[3], last[4]), (None, None));
    assert!(last[2].expect("a tension") < 0.2 * weight);
    assert!(last[5].expect("a height") < first[5].expect("a height") - 1.0);
    assert!(last[6].expect("a speed") > 0.2, "the trolley goes on");
    let told = at.good(run.replace("--columns", "--out - --columns"));
    assert_eq!(told.lines().count(), 91);
    let run = "run crane.toml --time 0.1 --out - --columns";
    let (_, ends) = table(&at.good(format!("{run} rope.0.tension,rope.29.tension")));
    // 29 of 30 steel segments (radius 12 mm, 20 m in all) hang between the middles of the first and
    // the last.
    let between = ends[0][0].expect("a tension") - ends[0][1].expect("a tension");
    let rope = 7850.0 * std::f64::consts::PI * 0.012_f64.powi(2) * 20.0 * 9.81;
    let off = (between / rope - 29.0 / 30.0).abs();
    assert!(off < 1e-3, "{between} {rope}");
    let none = format!("{run} rope.30.tension");
    at.refused(&none, &["`rope.30.tension`", "30 segments"]);
    let told = at.good("run crane.toml --time 1.5");
    assert!(told.contains("event  t = 0.5000 s: slip"), "{told}");
}

/// The landing of the examples as a text: the ground takes over what the cable carried.
#[test]
fn forces_of_contacts_are_columns() {
    let at = folder("landing");
    let landing = include_str!("../../../integrator/examples/landing.toml");
    at.write("landing.toml", landing);
    let contact = "crate.contact,crate.contact_x,crate.contact_y,crate.contact_z";
    let run = format!("run landing.toml --columns time,{contact},rope.tension,crate.z --out -");
    let (headings, rows) = table(&at.good(&run));
    let expected = "crate.contact [N],crate.contact_x [N],crate.contact_y [N],crate.contact_z [N]";
    assert_eq!(headings[1..5].join(","), expected);
    let weight = 2000.0 * 9.81;
    let value = |row: usize, column: usize| rows[row][column].expect("a number");
    for row in 0..rows.len() {
        let [x, y, z] = [2, 3, 4].map(|column| value(row, column));
        let norm = (x * x + y * y + z * z).sqrt();
        assert!((norm - value(row, 1)).abs() <= 1e-12 * norm, "{norm}");
    }
    let [first, last] = [0, rows.len() - 1];
    assert_eq!((value(first, 1), value(last, 5)), (0.0, 0.0));
    let off = (value(last, 4) / weight - 1.0).abs();
    assert!(off < 1e-3, "{}", value(last, 4));
    let shared = |row: &usize| value(*row, 4) > 0.2 * weight && value(*row, 5) > 0.2 * weight;
    let shared: Vec<usize> = (0..rows.len()).filter(shared).collect();
    let holds = shared.len() > 30;
    assert!(holds, "the ground takes over in {} steps", shared.len());
    // At rest on the ground both carry the crate together.
    let middle = shared[shared.len() / 2];
    let both = value(middle, 4) + value(middle, 5);
    assert!((both / weight - 1.0).abs() < 0.02, "{both}");
}

/// A weight of 98.1 N two metres out along x turns what holds it about y.
#[test]
fn locks_hinges_and_sliders_have_moments() {
    let at = folder("moments");
    let run = "run arm.toml --time 1 --columns";
    for joint in [
        "kind = \"lock\"",
        "kind = \"hinge\"\naxis = [1, 0, 0]",
        "kind = \"slider\"\naxis = [1, 0, 0]",
    ] {
        let scene = format!(
            "[[body]]\nname = \"arm\"\nmass = 10\nshape = {{ sphere = {{ radius = 0.2 }} }}\nposition = [2, 0, 0]\n\
             [[joint]]\nname = \"hold\"\n{joint}\na = \"world\"\nb = \"arm\"\npoint = [0, 0, 0]\n"
        );
        at.write("arm.toml", scene);
        let columns = "hold.moment,hold.mx,hold.my,hold.mz,hold.fz";
        let (headings, rows) = table(&at.good(format!("{run} {columns} --out -")));
        let expected = "hold.moment [N m],hold.mx [N m],hold.my [N m],hold.mz [N m],hold.fz [N]";
        assert_eq!(headings.join(","), expected);
        let last = rows.last().expect("rows").iter();
        let last: Vec<f64> = last.map(|value| value.expect("a number")).collect();
        for (value, right) in last.iter().zip([196.2, 0.0, -196.2, 0.0, 98.1]) {
            assert!((value - right).abs() < 0.2, "{joint}: {last:?}");
        }
    }
    let ball = "run hoist --set segments=2 --out a.csv --columns load.moment";
    at.refused(ball, &["`load` has no `moment`"]);
}

/// `run --help` lists every quantity that a refused column name is answered with.
#[test]
fn the_help_names_every_quantity() {
    let at = folder("column_help");
    let help = at.good("run --help");
    let asked = [
        ("run hoist --set segments=2", "depth"),
        ("run hoist --set segments=2", "load.zz"),
        ("run hoist --set segments=3", "joint-1.zz"),
        ("run gantry --set segments=2", "rail.zz"),
        ("run tackle", "rope-2.zz"),
    ];
    for (run, column) in asked {
        let output = at.taut(format!("{run} --out a.csv --columns {column}"));
        let told = text(&output.stderr);
        let (_, names) = told.trim_end().split_once("choose one of ").expect(told);
        let names = names.split(", or ").next().unwrap_or_default();
        for name in names.split(", ") {
            let listed = help.split(|c: char| !(c.is_alphanumeric() || c == '_'));
            assert!(listed.into_iter().any(|word| word == name), "{name}");
        }
    }
    assert!(help.contains("NAME-2") && help.contains("CABLE.SEGMENT.tension"));
}

#[test]
fn names_may_have_dots() {
    let at = folder("dotted_columns");
    let scene = at.good("scene hoist --set segments=2 --explicit");
    let scene = scene.replace("\"load\"", "\"big.load\"");
    at.write("s.toml", scene);
    let run = "run s.toml --time 0.1 --columns big.load.z,big.load.tension --out -";
    let (headings, rows) = table(&at.good(run));
    assert_eq!(headings, ["big.load.z [m]", "big.load.tension [N]"]);
    assert_eq!(rows.len(), 6);
}

#[test]
fn unknown_columns_are_refused_before_the_run_with_what_there_is() {
    let at = folder("bad_columns");
    // Hours of a run, to a file that is not begun.
    let [hoist, gantry] = ["hoist", "gantry"]
        .map(|scene| format!("run {scene} --set segments=2 --time 1e5 --out rows.csv --columns"));
    let rows = format!(
        r"
        {hoist} load.z,depth → `depth` … load_tension … NAME.QUANTITY
        {hoist} lod.z → `lod` … segment-1, segment-2, load … anchor, joint-1, load
        {hoist} load.zz → `zz` … x, y, z, vx … tension, fx … gap
        {hoist} anchor.twist → `anchor` has no `twist`
        {hoist} load.z,load.z → `load.z` is there twice
        {hoist} load. → `load` has no ``
        {hoist} .z → is called ``
        {gantry} hoist → trolley_speed, hoist_speed
        {gantry} rope-1.fx → choose one of tension, drive, length
        {gantry} rail.tension → choose one of fx, fy, fz, force, drive, gap
        run hoist --columns load.z → --columns … --out … --json
        "
    );
    at.refuses(&rows);
    assert!(!at.join("rows.csv").exists());
}
