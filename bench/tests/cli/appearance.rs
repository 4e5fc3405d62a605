use crate::*;

/// First character of every style sequence.
const ESCAPE: char = '\u{1b}';

const BOLD: &str = "\u{1b}[1m";

const SPD: &str =
    "%%MatrixMarket matrix coordinate real symmetric\n3 3 4\n1 1 4\n2 1 1\n2 2 3\n3 3 2\n";

/// Standard output of a good run in an environment, with nothing on standard error.
fn output(folder: &At, arguments: &str, environment: &[(&str, &str)]) -> String {
    let mut command = folder.program(arguments);
    let output = command.envs(environment.iter().copied()).output();
    let output = output.unwrap_or_else(|e| panic!("`taut {arguments}`: {e}"));
    let place = format!("`taut {arguments}` with {environment:?}");
    assert_eq!(text(&output.stderr), "", "{place}");
    assert_eq!(output.status.code(), Some(0), "{place}");
    text(&output.stdout).to_owned()
}

/// A folder with a matrix in `a.mtx`.
fn with_matrix(name: &str) -> At {
    let at = folder(name);
    at.write("a.mtx", SPD);
    at
}

#[test]
fn a_pipe_holds_no_escape_sequence_unless_forced() {
    let at = with_matrix("colours");
    for arguments in ["hard H32 --quick", "--help", "run --help"] {
        let plain: &[&[(&str, &str)]] = &[
            &[],
            &[("NO_COLOR", "1")],
            &[("CLICOLOR", "1")],
            &[("NO_COLOR", "1"), ("CLICOLOR_FORCE", "1")],
        ];
        for environment in plain {
            let shown = output(&at, arguments, environment);
            let says = !shown.contains(ESCAPE);
            assert!(says, "{arguments} {environment:?}: {shown:?}");
        }
        let forced = output(&at, arguments, &[("CLICOLOR_FORCE", "1")]);
        assert!(forced.contains(ESCAPE), "{arguments}: {forced:?}");
    }
    assert!(!output(&at, "solve a.mtx", &[]).contains(ESCAPE));
    let forced = output(&at, "solve a.mtx", &[("CLICOLOR_FORCE", "1")]);
    let marked = forced.split(BOLD).skip(1).filter(|rest| {
        let value = rest.split(ESCAPE).next();
        value.is_some_and(|v| v.ends_with('*'))
    });
    if cfg!(feature = "banded") {
        // With two solvers or more each of six columns marks a best value.
        assert!(marked.count() >= 6, "{forced:?}");
    }
    let json = output(&at, "solve a.mtx --json -", &[("CLICOLOR_FORCE", "1")]);
    assert!(!json.contains(ESCAPE), "{json:?}");
}

#[test]
fn best_values_are_marked_and_the_mark_explained() {
    let at = with_matrix("marks");
    let shown = at.good("solve a.mtx");
    let legend = shown.lines().position(|l| l.starts_with("*: the least"));
    let legend = legend.unwrap_or_else(|| panic!("{shown}"));
    let rows: Vec<&str> = shown.lines().skip(legend + 1).collect();
    let marked = rows.iter().any(|r| r.contains('*'));
    assert_eq!(marked, cfg!(feature = "banded"), "{shown}");
    let one = at.good("solve a.mtx --backend dense");
    let rows: Vec<&str> = one.lines().skip(legend + 1).collect();
    assert!(rows.iter().all(|r| !r.contains('*')), "{one}");
}

#[test]
fn quiet_runs_print_what_was_asked_for_and_nothing_else() {
    let at = with_matrix("quiet");
    let listed = at.good("backends");
    for arguments in ["backends --quiet", "-q backends"] {
        assert_eq!(at.good(arguments), listed, "{arguments}");
    }
    let table = at.good("--quiet study matrix a.mtx --quick");
    let holds = table.contains("ns/block") && !table.contains("written");
    assert!(holds, "{table}");
    let run = at.good("run hoist --set segments=2 --time 0.1 -q");
    assert!(run.contains("verdict"), "{run}");
}

#[test]
fn tables_fit_into_120_columns() {
    let at = with_matrix("narrow");
    let main_job = "--quick --segments 24 --ratios 1e5 --iterations 10,100 --time 0.1";
    for arguments in [
        main_job,
        "bench --scene ring,net --quick --segments 8",
        "study matrix a.mtx --quick",
        "study accuracy --quick --segments 4 --ratios 100 --time 0.1",
        "study engines --quick --segments 4 --ratios 100 --time 0.1",
        "study iterative --quick --segments 4 --ratios 100 --iterations 20",
        "study kernels --quick --segments 4 --ratios 100",
        "study linear --quick --segments 4 --ratios 100,1e12",
        "study shocks --quick --ratios 100 --time 1",
        "hard H43 H54 --quick",
        "static --segments 100 --ratios 1e5 --limit 2 --backends banded/kkt,cg:group",
        "run hoist --set segments=2 --time 0.1",
        "solve a.mtx",
        "backends",
    ] {
        if arguments.contains("banded") && !cfg!(all(feature = "banded", feature = "cg")) {
            continue;
        }
        let shown = at.good(arguments);
        for line in shown.lines() {
            assert!(line.chars().count() <= 120, "{arguments}: {line}");
        }
    }
}

/// Names of scenes from elsewhere cannot clear a terminal, set its title or forge lines.
#[test]
fn control_characters_of_names_are_escaped() {
    let at = folder("control-characters");
    let name = r"a\u001b]0;x\u0007\u001b[2J\r\nb\u009b1m";
    at.write("names.toml", super::replay::named(name));
    at.write(
        "bad.toml",
        super::replay::named(name).replace("mass = 1", "mass = 1e-300\ncolour = 2"),
    );
    for arguments in [
        "run names.toml --time 0.1 --record a.tape",
        "replay a.tape",
        "ledger names.toml --time 0.1 --tolerance 5",
        "run bad.toml",
        "run names.toml --columns no-such.x --out o.csv",
        "replay a.tape --csv no-such",
        "scene names.toml",
        "view no\u{1b}[2Jsuch",
    ] {
        let output = at.taut(arguments);
        let all = [&output.stdout, &output.stderr].map(|s| text(s).to_owned());
        let orders = |c: char| c.is_control() && c != '\n';
        let says = !all.concat().contains(orders);
        assert!(says, "`taut {arguments}`: {all:?}");
        assert!(text(&output.stderr).lines().count() <= 1, "{all:?}");
    }
    let told = at.good("replay a.tape");
    let events = told.lines();
    let events = events.filter(|line| line.trim_start().starts_with("event"));
    assert_eq!(events.count(), 1, "{told}");
    let says = told.contains(r"a\u{1b}]0;x\u{7}\u{1b}[2J\r\nb\u{9b}1m");
    assert!(says, "{told}");
}

/// A number of hundreds of digits is no message.
#[test]
fn numbers_in_messages_are_short() {
    let at = folder("long-numbers");
    for (arguments, number) in [
        ("run hoist --set segment_mass=5e-324", "5e-324"),
        (
            "run hoist --scheme third-difference:a=0.5:gamma=1e300",
            "1e300",
        ),
        ("run hoist --dt -1e250", "-1e250"),
    ] {
        let [_, stderr] = at.ends(2, arguments);
        assert!(stderr.contains(number) && stderr.len() < 300, "{stderr}");
    }
}
