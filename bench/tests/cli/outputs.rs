use crate::*;
use std::io::{BufRead, BufReader};

/// Partial files left in a folder.
fn left_over(at: &At) -> Vec<PathBuf> {
    let entries = fs::read_dir(&at.0).expect("a folder");
    let paths = entries.map(|e| e.expect("an entry").path());
    paths
        .filter(|p| p.extension().is_some_and(|e| e == "part"))
        .collect()
}

/// The program in a shell, where `taut` stands for it.
#[cfg(unix)]
fn shell(at: &At, line: &str) -> Output {
    let line = line.replace("taut", env!("CARGO_BIN_EXE_taut"));
    let mut shell = Command::new("sh");
    let shell = shell.current_dir(&at.0).args(["-c", &line]);
    let output = shell.stdin(Stdio::null()).output();
    output.unwrap_or_else(|e| panic!("`{line}`: {e}"))
}

/// A failed output leaves the others intact, is named, and ends with code 2.
#[cfg(target_os = "linux")]
#[test]
fn one_output_that_fails_does_not_cost_the_others() {
    let at = folder("one_fails");
    let run = "run hoist --set segments=2 --time 0.5";
    for (option, others) in [
        ("--out", ["--json", "--save"]),
        ("--json", ["--out", "--save"]),
        ("--save", ["--out", "--json"]),
        ("--record", ["--out", "--save"]),
    ] {
        let [a, b] = others;
        let text = format!("{run} {option} /dev/full {a} file{a} {b} file{b}");
        let [stdout, stderr] = at.ends(2, text);
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        assert!(stderr.contains("cannot write `/dev/full`"), "{stderr}");
        assert!(stdout.contains("stable"), "{option}");
        for other in others {
            let name = format!("file{other}");
            if other == "--out" {
                assert_eq!(at.read(&name).lines().count(), 31);
            } else {
                assert!(at.parsed(&name).is_object());
            }
            fs::remove_file(at.join(name)).expect("written");
        }
    }
    assert_eq!(left_over(&at), Vec::<PathBuf>::new());
}

/// An unwritable output is refused before the work, which would take hours here.
#[test]
fn outputs_are_tried_before_the_run() {
    let at = folder("tried");
    fs::create_dir(at.join("folder")).expect("writable");
    at.write("file", "in the way");
    let run = "run hoist --time 1e5 --dt 0.01";
    for option in ["--out", "--json", "--save"] {
        for path in ["folder", "file/x", "."] {
            let words = [&format!("cannot write `{path}`")[..]];
            at.refused(format!("{run} {option} {path}"), &words);
        }
    }
    let rows = r"
        bench --json folder → cannot write `folder`
        static --json folder → cannot write `folder`
        hard --json folder → cannot write `folder`
        paper --json folder → cannot write `folder`
        matrices --out m --json folder → cannot write `folder`
        paper --out file → cannot write `file`
        matrices --out file/m → cannot write `file/m`
        dump hoist --step 9999999 --out file → cannot write `file`
    ";
    at.refuses(rows);
}

#[cfg(unix)]
#[test]
fn a_place_is_written_once_and_not_over_what_is_read() {
    let at = folder("same_place");
    fs::create_dir(at.join("deep")).expect("writable");
    std::os::unix::fs::symlink("a.json", at.join("link")).expect("linked");
    let run = "run hoist --set segments=2 --time 0.1";
    for (first, second) in [
        ("a.json", "a.json"),
        ("a.json", "./deep/../a.json"),
        ("a.json", "link"),
        ("link", "deep/../link"),
    ] {
        for there in [false, true] {
            let file = at.join("a.json");
            if there {
                fs::write(&file, "old").expect("writable");
            }
            for [a, b] in [["--out", "--json"], ["--json", "--save"]] {
                let words = [a, b, "cannot share a file"];
                at.refused(format!("{run} {a} {first} {b} {second}"), &words);
            }
            let found = fs::read_to_string(&file).ok();
            assert_eq!(found.as_deref(), there.then_some("old"));
            let _ = fs::remove_file(&file);
        }
    }
    // Devices are not filled.
    at.good(format!("-q {run} --out /dev/null --json /dev/null"));
    let scene = at.good("scene hoist --set segments=2");
    at.write("s.toml", &scene);
    at.write("c.csv", "time,hoist_speed\n0,0\n");
    let rows = r"
        run s.toml --json ./s.toml → it is read … --json
        run gantry --controls c.csv --out c.csv → it is read … --out
    ";
    at.refuses(rows);
    assert_eq!(at.read("s.toml"), scene);
    // A run goes on in its place, and through a link the file is written that it names.
    at.good(format!("{run} --save link"));
    assert!(at.parsed("a.json").is_object());
    at.refused("run --resume link --out a.json", &["it is read"]);
    let before = at.read("a.json");
    at.good("run --resume a.json --time 0.1 --save link");
    assert!(at.join("link").is_symlink());
    assert_ne!(at.read("a.json"), before);
    at.good(format!("{run} --json rows.json"));
    at.refused("report rows.json --out rows.json", &["it is read"]);
}

/// The disk is full in the middle of a record: what is whole is kept, and gone on with.
#[cfg(unix)]
#[test]
fn a_file_of_cases_holds_whole_lines() {
    let at = folder("full_disk");
    let call = "study stability --quick --time 0.1 --cases";
    at.good(format!("{call} whole"));
    for blocks in [0, 1, 4] {
        let line = format!("ulimit -f {blocks}; taut {call} {blocks}");
        let output = shell(&at, &line);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        let left = at.read(blocks.to_string());
        assert!(left.is_empty() || left.ends_with('\n'), "{left}");
        at.good(format!("{call} {blocks} --resume"));
        let both = ["whole", &blocks.to_string()].map(|name| at.read(name).len());
        assert_eq!(both[0], both[1]);
    }
}

/// A file that grows too large, as on a full disk, and a program that is killed: the old run or the new one is there.
#[cfg(unix)]
#[test]
fn a_saved_run_is_never_half_of_one() {
    let at = folder("killed");
    at.good("run hoist --set segments=400 --time 0.1 --save s.json");
    let old = at.read("s.json");
    assert!(old.len() > 20_000);
    // In blocks of 512 or 1024 bytes.
    shell(
        &at,
        "ulimit -f 8; taut run --resume s.json --time 0.1 --save s.json",
    );
    assert_eq!(at.read("s.json"), old);
    for wait in [30, 60, 90, 120] {
        let mut child = at
            .program("run --resume s.json --time 0.05 --save s.json")
            .stdout(Stdio::null())
            .spawn()
            .expect("the program starts");
        std::thread::sleep(std::time::Duration::from_millis(wait));
        child.kill().expect("it can be killed");
        child.wait().expect("it ends");
        assert!(at.parsed("s.json")["run"].is_object(), "after {wait} ms");
    }
    // It keeps its permissions.
    use std::os::unix::fs::PermissionsExt;
    let file = at.join("s.json");
    fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).expect("own");
    at.good("run --resume s.json --time 0.05 --save s.json");
    let mode = fs::metadata(&file).expect("there").permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
}

/// A signal ends a run in order: rows and state are there while it goes on, the summary says how far it got.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_run_in_order() {
    let all = [("TERM", 143), ("INT", 130), ("HUP", 129), ("XCPU", 152)];
    for (signal, code) in all {
        let at = folder(&format!("signal_{signal}"));
        let arguments = "run hoist --set segments=2 --time 1e5 --out - --json j.json --save s.json --save-at 0.5";
        let mut child = at
            .program(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let stdout = child.stdout.take().expect("piped");
        let rows = BufReader::new(stdout).lines();
        let mut rows = rows.map(|row| row.expect("text"));
        // Long after the state was due.
        assert_eq!(rows.by_ref().take(2000).count(), 2000);
        let saved = at.parsed("s.json");
        let pid = child.id().to_string();
        let mut kill = Command::new("kill");
        let asked = kill.args([&format!("-{signal}"), &pid]).status();
        assert!(asked.expect("a shell's tool").success());
        let count = 2000 + rows.count();
        let output = child.wait_with_output().expect("it ends");
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{stderr}");
        let says = stderr.contains(&format!(
            "stopped by SIG{signal} after {} of 6000000 steps",
            count - 1
        ));
        assert!(says, "{stderr}");
        let summary = at.parsed("j.json");
        assert_eq!(summary["steps"], count - 1);
        assert_eq!(
            (&summary["stable"], &summary["failure"], &summary["stopped"]),
            (&false.into(), &Value::Null, &format!("SIG{signal}").into())
        );
        let found = summary["load"]["time"].as_array().map(Vec::len);
        assert_eq!(found, Some(count - 1));
        assert_eq!(at.parsed("s.json"), saved);
        let found = saved["run"]["time"].as_f64().map(|t| (60.0 * t).round());
        assert_eq!(found, Some(30.0));
        at.good("run --resume s.json --time 0.1");
    }
}

/// `nohup`, and a shell for what it starts in the background, have signals ignored.
#[cfg(target_os = "linux")]
#[test]
fn signals_that_are_ignored_stay_ignored() {
    let at = folder("ignored");
    let run = "taut -q run hoist --set segments=2 --time 1e5 --save s.json >o";
    for (signal, other, code) in [("HUP", "TERM", 143), ("INT", "HUP", 129)] {
        let line = format!(
            "trap '' {signal}; {run} & sleep 1; kill -{signal} $!; sleep 1; kill -{other} $! && wait $!"
        );
        let output = shell(&at, &line);
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{signal}: {stderr}");
        let says = stderr.contains(&format!("stopped by SIG{other}"));
        assert!(says, "{stderr}");
        at.good("run --resume s.json --time 0.1");
    }
}

/// A limit of the shell for files is no reason to die: what was recorded up to there stays.
#[cfg(target_os = "linux")]
#[test]
fn a_file_that_grows_too_long_is_a_failed_write() {
    let at = folder("too_long");
    let line = "ulimit -f 40; taut -q run hoist --set segments=12 --time 20 --record r.tape >o";
    let output = shell(&at, line);
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    has(stderr, "cannot write `r.tape`: File too large");
    // What was written before is a recording.
    let [_, note] = at.ends(0, "replay r.tape");
    assert!(note.contains("cut or damaged after"), "{note}");
    assert!(left_over(&at).is_empty());
}

/// Where nobody can be told the code still tells.
#[cfg(target_os = "linux")]
#[test]
fn streams_that_are_full_or_closed_are_no_panic() {
    let at = folder("streams");
    let unstable = "run hoist --scheme linearly-implicit --stiffness off --guard off --set mass_ratio=1e5 \
        --set seed=1 --set move_x=0.5 --time 5";
    for (line, code) in [
        ("taut run nope 2>/dev/full", 2),
        ("taut run nope 2>&-", 2),
        ("taut run hoist --time 2>/dev/full", 2),
        (&format!("taut {unstable} 2>/dev/full"), 1),
        (&format!("taut {unstable} --json - 2>/dev/full"), 1),
        ("TAUT_SIMD=x taut backends 2>/dev/full", 2),
        ("taut $(printf '\\377')", 2),
        ("taut -q $(printf '\\377') run", 2),
        ("taut run $(printf '\\377')", 2),
        ("taut --help >/dev/full", 2),
        ("taut run --help >/dev/full", 2),
        ("taut --version >/dev/full", 2),
        ("taut backends >/dev/full", 2),
        ("taut run hoist --time 0.1 >/dev/full", 2),
        ("taut run hoist --time 0.1 --out - >/dev/full", 2),
        ("taut run hoist --time 0.1 --json - >/dev/full", 2),
        ("taut scene hoist >/dev/full", 2),
        ("taut backends >/dev/null", 0),
    ] {
        let output = shell(&at, line);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "`{line}`: {stderr}");
        assert!(!stderr.contains("panicked"), "`{line}`: {stderr}");
    }
    // By its paths standard output is what `-` is.
    let line = "taut run hoist --time 0.1 --json /dev/stdout";
    for line in [format!("{line} | cat"), format!("{line} >j; cat j")] {
        let output = shell(&at, &line);
        let alone: Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
        assert_eq!(alone["steps"], 6, "{line}");
    }
}

/// Steps and comments that nobody asked for are not kept: 100 000 and a million of them in 16 MB.
#[cfg(target_os = "linux")]
#[test]
fn long_runs_and_long_files_take_no_memory() {
    let at = folder("memory");
    let small = |line: &str| {
        let output = shell(&at, &format!("ulimit -d 16000; {line}"));
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "`{line}`: {stderr}");
    };
    small("taut run hoist --set segments=1 --guard off --dt 0.01 --time 1000 --out rows.csv");
    assert_eq!(at.read("rows.csv").lines().count(), 100_001);
    small(
        "(echo '%%MatrixMarket matrix coordinate real general'; yes % | head -1000000; echo 1 1 1; echo 1 1 1) \
         | gzip -1 > a.mtx.gz",
    );
    small("taut solve a.mtx.gz --backend dense");
}

/// Gravity of 10⁹ m/s² on cables that hold each other: a step whose contacts take long to find is no reason to wait.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_step_that_takes_long() {
    let at = folder("signal_in_a_step");
    let arguments = "run pile --set mass_ratio=1e6 --set ei=1 --set damping=0.5 --set gravity=1e9 --time 1 --out o.csv \
                     --json j.json --save s.json --record r.tape";
    let child = at.program(arguments).stderr(Stdio::piped()).spawn();
    let child = child.expect("the program starts");
    std::thread::sleep(std::time::Duration::from_secs(2));
    let mut kill = Command::new("kill");
    let asked = kill.args(["-TERM", &child.id().to_string()]).status();
    assert!(asked.expect("a shell's tool").success());
    let asked = std::time::Instant::now();
    let output = child.wait_with_output().expect("it ends");
    let waited = asked.elapsed().as_secs_f64();
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(143), "{stderr}");
    assert!(stderr.contains("stopped by SIGTERM after "), "{stderr}");
    assert!(waited < 10.0, "{waited} s");
    let summary = at.parsed("j.json");
    assert_eq!(summary["stopped"], "SIGTERM");
    assert_eq!(summary["failure"], Value::Null);
    let rows = at.read("o.csv").lines().count();
    assert_eq!(summary["steps"], rows - 1);
    let saved = at.parsed("s.json");
    let time = saved["run"]["time"].as_f64().expect("a number");
    assert_eq!((60.0 * time).round() as usize, rows - 1);
    assert!(at.join("r.tape").exists() && left_over(&at).is_empty());
}

/// A killed recording is read where it lies, and gone once the next one is whole.
#[cfg(unix)]
#[test]
fn what_a_killed_recording_leaves_is_read_and_then_removed() {
    let at = folder("killed_recording");
    let mut child = at.program("run hoist --set segments=2 --time 1e5 --record r.tape");
    let mut child = child.spawn().expect("the program starts");
    let begun = std::time::Instant::now();
    let part = loop {
        let of_size = |path: &PathBuf| fs::metadata(path).is_ok_and(|m| m.len() > 200_000);
        if let Some(part) = left_over(&at).into_iter().find(of_size) {
            break part;
        }
        assert!(begun.elapsed().as_secs() < 60, "nothing is recorded");
    };
    child.kill().expect("it can be killed");
    child.wait().expect("it ends");
    let name = part.file_name().expect("a name").to_str().expect("text");
    let says = name.starts_with(&format!(".r.tape.taut-{}-", child.id()));
    assert!(says, "{name}");
    let table = at.taut(format!("replay {name} --csv time,load_x"));
    assert!(table.status.success() && text(&table.stdout).lines().count() > 128);
    at.good("run hoist --set segments=2 --time 0.1 --record other.tape");
    assert!(part.exists());
    at.good("run hoist --set segments=2 --time 0.1 --record r.tape");
    assert!(!part.exists() && left_over(&at).is_empty());
}
