use crate::*;

fn rows(results: &Value) -> &[Value] {
    results["records"].as_array().expect("records")
}

fn row<'a>(results: &'a Value, backend: &str) -> &'a Value {
    let found = rows(results).iter().find(|r| r["backend"] == backend);
    found.unwrap_or_else(|| panic!("{backend}: {results}"))
}

const UNSYMMETRIC: &str =
    "%%MatrixMarket matrix coordinate real general\n3 3 5\n1 2 1\n2 1 4\n2 2 1\n3 3 2\n1 3 -1\n";

#[test]
fn a_dumped_step_is_solved_to_its_exact_solution() {
    let at = folder("dump");
    let files =
        at.good("dump hoist --set segments=6 --set mass_ratio=1e4 --step 3 --out systems --gzip");
    let names: Vec<&str> = files.lines().collect();
    assert_eq!(names.len(), 7, "{files}");
    for (name, blocks) in [("hoist_3", 7), ("hoist_3_kkt", 14)] {
        let results = at.json(format!("solve systems/{name}.mtx.gz --json -"));
        let about = &results["about"];
        assert_eq!(about["blocks"], blocks, "{about}");
        let says = about["solution"].as_str();
        let says = says.is_some_and(|x| x.contains("_x.mtx.gz"));
        assert!(says, "{about}");
        assert!(about["condition"].as_f64() > Some(1e3), "{about}");
        let dense = row(&results, "dense:double");
        assert!(dense["forward_error"].as_f64() < Some(1e-10), "{dense}");
        let found = dense["backward_error_componentwise"].as_f64();
        assert!(found < Some(1e-13), "{dense}");
        assert!(dense["factorize_ns"].as_f64() > Some(0.0), "{dense}");
    }
    // Repeating the command writes identical files.
    let first = fs::read(at.join(names[0])).expect("written");
    at.good("dump hoist --set segments=6 --set mass_ratio=1e4 --step 3 --out systems --gzip");
    assert_eq!(fs::read(at.join(names[0])).expect("written"), first);
    // Without compression the comments can be read by people.
    at.good("dump hoist --set segments=6 --step 0 --out plain --name first --dt 0.01");
    let told = at.read("plain/first.mtx");
    for words in [
        "% scene hoist segments=6",
        "% step 0",
        "% time step 1e-2 s",
        "mass ratio",
        "form schur",
        "% blocks 3 6",
    ] {
        assert!(told.contains(words), "{words}: {told}");
    }
    let kkt = at.read("plain/first_kkt.mtx");
    has(&kkt, "form kkt … % signs + -");
}

#[test]
fn matrices_that_are_not_symmetric_are_solved_by_those_that_can() {
    let at = folder("unsymmetric");
    at.write("a.mtx", UNSYMMETRIC);
    let results = at.json("solve a.mtx --json -");
    assert_eq!(results["about"]["symmetric"], false);
    assert!(
        results["about"]["solution"]
            .as_str()
            .is_some_and(|x| x.contains("1, exactly"))
    );
    for record in rows(&results) {
        assert!(record["forward_error"].as_f64() < Some(1e-15), "{record}");
    }
    assert!(row(&results, "dense:double")["status"] == "direct");
    if cfg!(feature = "banded") {
        let row =
            "solve a.mtx --backend banded → a:  … banded … symmetric … umfpack, faer:lu, dense";
        at.refuses(row);
    }
    // b and x of its own.
    for (name, values) in [("b.mtx", "1\n9\n2"), ("x.mtx", "1.75\n2\n1")] {
        let array = format!("%%MatrixMarket matrix array real general\n3 1\n{values}\n");
        at.write(name, &array);
    }
    let results = at.json("solve a.mtx b.mtx x.mtx --backend dense,dense:extended --json -");
    for record in rows(&results) {
        assert!(record["forward_error"].as_f64() < Some(1e-15), "{record}");
    }
    let table = at.good("solve a.mtx b.mtx x.mtx --backend dense");
    assert!(table.contains("b: b.mtx; x: x.mtx"), "{table}");
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
}

#[test]
fn definite_backends_say_who_solves_what_is_not() {
    let at = folder("indefinite");
    at.write(
        "a.mtx",
        "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 1\n2 2 -1\n",
    );
    for (backend, is_there) in [
        ("cg:none", cfg!(feature = "cg")),
        ("nalgebra-sparse", cfg!(feature = "nalgebra-sparse")),
    ] {
        let line = format!("solve a.mtx --backend {backend}");
        if is_there {
            at.refused(&line, &["not positive definite", "umfpack", "dense"]);
        }
    }
    at.write(
        "singular.mtx",
        "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 1\n2 1 1\n2 2 1\n",
    );
    at.refused("solve singular.mtx --backend dense", &["singular"]);
}

/// One of several files is no reason to lose what was measured of the others; where all are singular, that is the answer.
#[test]
fn a_singular_matrix_among_others_is_left_out() {
    let at = folder("singular_among_others");
    at.write("a.mtx", UNSYMMETRIC);
    let whole = "%%MatrixMarket matrix array real general\n3 3\n1\n4\n7\n2\n5\n8\n3\n6\n9\n";
    at.write("whole.mtx", whole);
    let table = at.good("study matrix a.mtx,whole.mtx --quick");
    for words in ["Left out", "whole: ", "the matrix is singular to rounding"] {
        assert!(table.contains(words), "{words}: {table}");
    }
    let results = at.json("study matrix whole.mtx,a.mtx --quick --json -");
    let results = results.as_array().expect("a list");
    let count = |of: &Value| rows(of).iter().filter(|r| r["status"] == "direct").count();
    assert_eq!(results.iter().map(count).filter(|n| *n > 0).count(), 1);
    // Whatever the reasons of those that are for symmetric matrices alone.
    for run in ["study matrix whole.mtx --quick", "solve whole.mtx"] {
        at.refused(run, &["whole: the matrix is singular to rounding"]);
    }
}

#[test]
fn the_benchmark_of_a_matrix_sorts_and_compares() {
    let at = folder("bench_matrix");
    at.good("dump hoist --set segments=4 --step 1 --out .");
    at.write("a.mtx", UNSYMMETRIC);
    let results = at.json("study matrix hoist_1.mtx,a.mtx --quick --json -");
    let results = results.as_array().expect("a list");
    assert_eq!(results.len(), 2);
    for result in results {
        let ratios = || rows(result).iter().filter(|r| r["status"] != "limit");
        let ratios = ratios().map(|r| r["ratio"].as_f64().expect("a number"));
        assert_eq!(ratios.fold(f64::INFINITY, f64::min), 1.0, "{result}");
        for record in rows(result) {
            let words = "analyze_ns factorize_ns solve_ns ns_per_block_row \
                forward_error";
            for field in words.split(' ') {
                let holds = record[field].as_f64();
                let holds = holds.is_some_and(|x| x.is_finite() && x >= 0.0);
                assert!(holds, "{field}: {record}");
            }
        }
    }
    let table = at.good("study matrix hoist_1.mtx --quick --iterations 5");
    assert!(table.contains("ns/block"), "{table}");
    assert!(at.join("target/taut/matrix.json").exists());
    let rows = r"
        study matrix hoist_1.mtx --ratios 1 → --ratios … unexpected argument
        study matrix hoist_1.mtx --iterations 0 → --iterations … at least 1
    ";
    at.refuses(rows);
}

#[test]
fn the_graded_set_is_written_with_its_index() {
    let at = folder("matrices");
    let entries = at.json("matrices --out set --quick --gzip --json -");
    let entries = entries.as_array().expect("a list");
    let index = at.read("set/index.csv");
    assert_eq!(index.lines().count(), entries.len() + 1);
    assert!(index.starts_with(
        "name,topology,size,state,mass_ratio,epsilon,form,dim,blocks,entries,condition"
    ));
    let bytes: u64 = entries.iter().filter_map(|e| e["bytes"].as_u64()).sum();
    assert!(bytes < 10_000_000, "{bytes}");
    let hard = entries
        .iter()
        .find(|e| e["name"] == "chain24_bent_r1e6_stiff")
        .expect("in the set");
    assert!(hard["condition"].as_f64() > Some(1e6), "{hard}");
    let results = at.json("solve set/chain24_bent_r1e6_stiff.mtx.gz --backend dense --json -");
    let found = row(&results, "dense:double")["forward_error"].as_f64();
    assert!(found < Some(1e-2), "{results}");
}

#[test]
fn files_that_hold_no_system_are_refused_with_their_line() {
    let at = folder("bad_matrices");
    at.write("scene.mtx", "[hoist]\n");
    let hollow =
        "%%MatrixMarket matrix coordinate real general\n999999999999 999999999999 1\n1 1 1\n";
    at.write("hollow.mtx", hollow);
    at.write("a.mtx", UNSYMMETRIC);
    let short = "%%MatrixMarket matrix array real general\n2 1\n1\n9\n";
    at.write("a_b.mtx", short);
    let rows = r"
        solve none.mtx → none.mtx … cannot be read
        solve scene.mtx → scene.mtx … line 1 … %%MatrixMarket
        solve hollow.mtx → hollow.mtx … singular … 1 entries
        solve a.mtx → a_b.mtx … 2 × 1 … 3 rows
    ";
    at.refuses(rows);
    fs::remove_file(at.join("a_b.mtx")).expect("there");
    // The file at fault is named, be it b or x.
    let coordinates = "%%MatrixMarket matrix coordinate real general\n3 1 4\n";
    let infinite = format!("{coordinates}1 1 1e308\n1 1 1e308\n2 1 1\n3 1 1\n");
    at.write("infinite.mtx", &infinite);
    let two = "%%MatrixMarket matrix array real general\n3 2\n1\n2\n3\n4\n5\n6\n";
    at.write("two.mtx", two);
    let one = "%%MatrixMarket matrix array real general\n3 1\n1\n2\n3\n";
    at.write("one.mtx", one);
    for (file, words) in [
        ("infinite.mtx", ["infinite.mtx: ", "row 1"]),
        ("two.mtx", ["two.mtx: ", "3 × 2"]),
    ] {
        at.refused(format!("solve a.mtx {file}"), &words);
        at.refused(format!("solve a.mtx one.mtx {file}"), &words);
    }
    at.good("solve a.mtx one.mtx one.mtx");
    // One block of 2000 rows is four million numbers for 2000.
    let entries: String = (1..=2000).map(|i| format!("{i} {i} 1\n")).collect();
    let head = "%%MatrixMarket matrix coordinate real symmetric\n% blocks 2000\n2000 2000 2000\n";
    at.write("block.mtx", format!("{head}{entries}"));
    let rows = r"
        solve block.mtx → block.mtx:  … `% blocks` … 4000000
        solve a.mtx --backend superlu → superlu … banded
        solve a.mtx --backend dense/kkt → /kkt … drop
        dump hoist --step 1 → --out
        dump hoist --out x → --step
        dump hoist --step 1 --out x --name a/b → --name … a/b
        dump hoist --step 1 --out x --dt 0 → --dt … positive
        dump crane --step 1 --out x → crane … hoist
    ";
    at.refuses(rows);
    at.write("file", "in the way");
    at.ends(2, "dump hoist --set segments=2 --step 0 --out file/x");
}

#[test]
fn a_sequence_is_dumped_and_every_solver_goes_through_it() {
    let at = folder("sequence");
    at.write("drive.csv", "time,hoist_speed\n0,0\n1,0.4\n");
    let dump = "dump gantry --set segments=4 --set mass_ratio=1e5 --controls drive.csv";
    let files = at.good(format!("{dump} --steps 3..23 --out s --gzip --exact"));
    // A matrix and three arrays of each form, and the index.
    assert_eq!(files.lines().count(), 9, "{files}");
    // One step is a system like any other.
    let one = at.json("solve s/schur_1.mtx.gz --json -");
    assert!(!rows(&one).is_empty(), "{one}");
    let results = at.json("study sequence s --iterations 5,50 --json -");
    let banded = row(&results, "banded");
    for row in rows(&results) {
        assert!(row["error"].is_null(), "{row}");
        assert_eq!((&row["steps"], &row["analyses"]), (&20.into(), &1.into()));
        for list in "factorize_ns_by_step solve_ns_by_step forward_error_by_step".split(' ') {
            let found = row[list].as_array().map(Vec::len);
            assert_eq!(found, Some(20), "{list}: {row}");
        }
        if row["iterations"] == 0 {
            assert!(row["backward_error"].as_f64() < Some(1e-13), "{row}");
            assert_eq!(row["claimed"], 20, "{row}");
        }
    }
    assert!(banded["forward_error"].as_f64() < Some(1e-6), "{banded}");
    let table = at.good("study sequence s --backends banded,dense/kkt,cg:group");
    assert!(table.contains("20 systems, patterns: 1"), "{table}");
    assert!(table.lines().all(|l| l.chars().count() <= 120), "{table}");
    let page = at.read("target/taut/report.html");
    assert!(page.contains("Error by step"), "the page of the sequence");
    let csv = at.good("study sequence s --backends banded --csv -");
    assert!(csv.starts_with("backend,") && csv.lines().count() == 2);
}

#[test]
fn contact_problems_and_contacts_before_the_joints_are_refused() {
    let at = folder("contacts");
    let files = at.good("dump floor --set segments=6 --set mass_ratio=100 --out s --step 30");
    assert_eq!(files.lines().count(), 7, "{files}");
    let rows = r"
        solve s → `s` … taut run … --contacts
        solve s/info.toml → s/info.toml … --contacts
        run stack --contacts staggered:sweeps=10 → staggered … before the joints … newton
        run stack --contacts jacobi → jacobi … pgs:sweeps=N
    ";
    at.refuses(rows);
}

/// A rope that breaks changes the pattern, which is told.
#[test]
fn a_change_of_pattern_is_told() {
    let at = folder("broken_sequence");
    let scene = at.good("scene hoist --set segments=3 --explicit");
    let event = "\n[[event]]\nname = \"snap\"\nat = 0.05\nrelease = [\"load\"]\n";
    at.write("breaks.toml", format!("{scene}{event}"));
    let [stdout, stderr] = at.ends(0, "dump breaks.toml --steps 0..6 --out s");
    assert!(stderr.contains("the pattern changes 1 time"));
    assert_eq!(stdout.lines().count(), 13);
    let results = at.json("study sequence s --backends banded --json -");
    let row = row(&results, "banded");
    assert_eq!((&row["steps"], &row["analyses"]), (&6.into(), &2.into()));
    assert!(row["forward_error"].as_f64() < Some(1e-10), "{row}");
}

#[test]
fn what_is_no_sequence_is_refused() {
    let at = folder("no_sequence");
    let dump = "dump hoist --set segments=3 --out s";
    let rows = format!(
        r"
        {dump} --steps 9..3 → --steps … empty
        {dump} --steps 3..3 → --steps … empty
        {dump} --steps 3 → --steps … 0..600
        {dump} --steps -1..3 → -1
        {dump} --steps 0..99999999999 → --steps … at most
        {dump} --steps 0..3 --step 2 → --steps … --step
        {dump} --step 2 --exact → --step … --exact
        {dump} → --step <K> … --steps <A..B>
        study sequence s → `s` … no sequence … taut dump
        study sequence → DIR
        "
    );
    at.refuses(&rows);
}
