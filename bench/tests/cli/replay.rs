use crate::*;

/// A table as headings and rows of numbers.
fn csv(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let headings = lines.next();
    let headings = headings.expect("a heading").split(',').map(str::to_owned);
    let number = |cell: &str| cell.parse().unwrap_or(f64::NAN);
    let rows = lines.map(|line| line.split(',').map(number).collect());
    (headings.collect(), rows.collect())
}

/// A column of a recording equals that of the run, to the digits of single precision.
#[test]
fn tables_of_recordings_are_those_of_their_runs() {
    let at = folder("tape");
    at.write(
        "in.csv",
        "time,trolley_speed,hoist_speed\n0,0,0\n0.5,1,0.5\n",
    );
    for (scene, own) in [
        (
            "gantry --set segments=4 --controls in.csv",
            "hook.x,bottom.tension,joint-2.twist,hoist_speed,rope-1.tension,rope-1.length,cable.tension",
        ),
        (
            "floor",
            "load.z,load.contact_z,load.contact,rope-2.contact_z,rope.tension",
        ),
    ] {
        let shared =
            "time,load_x,load_z,kinetic,gravity,elastic,max_gap,load_tension,contacts,error";
        let names = format!("{shared},{own}");
        at.good(format!(
            "run {scene} --time 2 --columns {names} --out run.csv --record run.tape"
        ));
        let replayed = at.good(format!("replay run.tape --csv {names}"));
        let (headings, run) = csv(&at.read("run.csv"));
        let (others, recorded) = csv(&replayed);
        assert_eq!(headings, others);
        assert_eq!((run.len(), recorded.len()), (120, 120));
        for (a, b) in run.iter().flatten().zip(recorded.iter().flatten()) {
            let holds = (a - b).abs() <= 1e-6 * a.abs() + 1e-30 || (a.is_nan() && b.is_nan());
            assert!(holds, "{a} {b}");
        }
        at.good(format!("replay run.tape --csv {names} --out again.csv"));
        assert_eq!(at.read("again.csv"), replayed);
    }
    let size = |at: &At| fs::metadata(at.join("long.tape")).expect("written").len();
    at.good("run gantry --controls in.csv --time 60 --record long.tape");
    assert!(size(&at) <= 4_000_000, "{}", size(&at));
    let shown = at.good("replay long.tape");
    assert!(shown.contains("3600, from 0.017 s to 60.000 s"), "{shown}");
}

#[test]
fn bad_recordings_are_refused_and_cut_ones_read() {
    let at = folder("tape-bad");
    at.good("run hoist --set segments=3 --time 3 --record good.tape");
    let bytes = fs::read(at.join("good.tape")).expect("written");
    at.write("cut.tape", &bytes[..bytes.len() / 2]);
    at.write("empty.tape", &bytes[..10]);
    let mut newer = bytes;
    newer[15] = 9;
    at.write("newer.tape", newer);
    at.write("other.tape", "time,x\n");
    let rows = r"
        replay none.tape → `none.tape` … No such file
        replay other.tape → `other.tape` … no recording … --record
        replay newer.tape --html x.html → version 9 … newer
        replay empty.tape → before anything was recorded
        replay good.tape --csv time,load.vx → `load.vx` … load.x … taut run --columns
        replay good.tape --csv nothing → `nothing` … load_x
        replay good.tape --csv time,time → twice
        replay good.tape --html good.tape → it is read
        replay good.tape --out x.csv → --csv
        replay good.tape --against cut.tape → --html
        run hoist --record a.json --json a.json → cannot share a file
    ";
    at.refuses(rows);
    let output = at.taut("replay cut.tape --csv time");
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    let holds = output.status.success() && stderr.starts_with("note: `cut.tape`");
    assert!(holds, "{stderr}");
    let holds = stdout.lines().count() > 64 && stdout.lines().count() < 180;
    assert!(holds, "{stdout}");
}

/// All forms at once, each in its file; nothing moves in a run of no frames.
#[test]
fn recordings_become_pictures_pages_and_animations() {
    let at = folder("tape-forms");
    at.good("run hoist --set segments=3 --time 1 --record a.tape");
    let told = at.good("replay a.tape --png 0.5 --html a.html --gltf a.glb --csv time --out a.csv");
    let says = told.starts_with("t = 0.500 s, coloured by tension from ");
    assert!(says, "{told}");
    for (file, begin) in [
        ("a.png", &b"\x89PNG"[..]),
        ("a.glb", b"glTF"),
        ("a.html", b"<!DOCTYPE html>"),
        ("a.csv", b"time [s]\n"),
    ] {
        let bytes = fs::read(at.join(file)).expect("written");
        assert!(bytes.starts_with(begin), "{file}");
    }
    at.good("replay a.tape --gltf a.gltf --png 1 --picture b.png -q");
    let written = fs::read(at.join("a.gltf")).expect("written");
    let json: serde_json::Value = serde_json::from_slice(&written).expect("JSON");
    assert_eq!(json["asset"]["version"], "2.0");
    assert!(at.join("b.png").is_file());
    // Cut before its first frame.
    let bytes = fs::read(at.join("a.tape")).expect("written");
    at.write("none.tape", &bytes[..bytes.len() / 4]);
    for form in [
        "--gltf x.glb",
        "--png 0",
        "--csv time,load_x",
        "--html x.html",
        "",
    ] {
        let [stdout, stderr] = at.ends(2, format!("replay none.tape {form}"));
        assert!(stderr.contains("no frame"), "{stderr}");
        assert!(stdout.is_empty() && !at.join("x.html").exists());
    }
    at.ends(2, "replay a.tape --against none.tape --html x.html");
}

/// A run that fails tells why where it is replayed; one that was asked to end does, too.
#[test]
fn a_recording_tells_how_its_run_ended() {
    let at = folder("tape-end");
    let unstable = "run hoist --set segments=24 --set mass_ratio=1e5 --set move_x=0.5 --set seed=1 --scheme linearly-implicit \
                    --stiffness off --guard off --time 10 --record lost.tape";
    at.ends(1, unstable);
    let output = at.taut("replay lost.tape --html lost.html");
    let stderr = text(&output.stderr);
    let holds =
        output.status.success() && stderr.contains("ended at t =") || stderr.contains("not finite");
    assert!(holds, "{stderr}");
    let page = at.read("lost.html");
    assert!(page.contains("ended at t =") || page.contains("not finite"));
}

/// A scene in which all is called so, TOML.
pub(crate) fn named(name: &str) -> String {
    format!(
        "name = \"{name}\"
        load = \"{name}\"
        body = [
          {{ name = \"jib\", mobility = \"static\", position = [0, 0, 1] }},
          {{ name = \"{name}\", mass = 1, shape = {{ sphere = {{ radius = 0.1 }} }} }},
        ]
        [[massless_cable]]
        name = \"{name}\"
        through = [{{ body = \"jib\" }}, {{ body = \"{name}\" }}]
        stretch = 1e-5
        length = 1
        winch = {{}}
        [[control]]
        name = \"speed {name}\"
        drives = [{{ joint = \"{name}\" }}]
        [[event]]
        name = \"{name}\"
        at = 0.05
        set = [{{ control = \"speed {name}\", value = 0.1 }}]
        "
    )
}

#[test]
fn names_that_hold_html_are_text() {
    let at = folder("tape-names");
    let name = "</script><script>document.title='broken'</script><b>&amp;";
    let scene = named(name);
    at.write("names.toml", scene);
    at.good("run names.toml --time 0.1 --record <b>.tape");
    at.good("replay <b>.tape --html page.html");
    let page = at.read("page.html");
    let holds = !page.contains("<script>document.title") && !page.contains("<b>");
    assert!(holds, "escaped");
    assert_eq!(page.matches("</script>").count(), 2);
    assert!(page.contains("\\u003c/script>"));
}
