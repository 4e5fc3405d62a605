use crate::*;

#[test]
fn unknown_names_list_the_known_ones_and_missing_arguments_are_named() {
    let at = folder("unknown_names");
    let rows = r"
        run hoist --backend superlu → superlu … banded … gauss-seidel … umfpack
        bench --backends banded,superlu → superlu … banded … gauss-seidel … umfpack
        static --backends superlu → superlu … banded … gauss-seidel … umfpack
        run hoist --backend cg:quick → cg … jacobi … group
        run hoist --backend cg/kkt → cg … /kkt
        run hoist --backend banded/lu → lu … schur, kkt
        run crane → crane … hoist
        run hoist --scheme euler → euler … linearly-implicit … third-difference
        crane → crane … --help
        run hoist --fast → --fast … --help
        run → SCENE … --help
        run hoist --json → --json … --help
    ";
    at.refuses(rows);
}

#[test]
fn parameters_out_of_range_are_named_with_their_range() {
    let at = folder("parameters");
    let rows = r"
        run hoist --set segment_mass=-1 → segment_mass is -1 … > 0 kg
        bench --set segment_mass=-1 → segment_mass is -1 … > 0 kg
        bench --segments 0 → segments is 0 … at least 1
        run hoist --set segments=1.5 → segments … 1.5
        run hoist --set foo → --set foo … KEY=VALUE
        run hoist --set weight=3 → weight … segment_mass
        bench --set weight=3 → weight … segment_mass
    ";
    at.refuses(rows);
}

#[test]
fn numbers_out_of_range_are_named_with_their_option() {
    let at = folder("numbers");
    for ratios in ["x", "0", "nan", "inf", "1,,2", "1,-5"] {
        at.refused(format!("bench --ratios={ratios}"), &["--ratios"]);
        at.refused(format!("static --ratios={ratios}"), &["--ratios"]);
    }
    at.refused("bench --ratios=-1", &["--ratios", "-1", "positive"]);
    at.refused("bench --segments=-3", &["--segments"]);
    at.refused("bench --iterations 0", &["--iterations", "at least 1"]);
    for value in ["0", "-1", "nan", "inf", "1e300"] {
        at.refused(format!("run hoist --time={value}"), &["--time"]);
        at.refused(format!("bench --time={value}"), &["--time"]);
    }
    for value in ["0", "-1", "nan", "inf"] {
        at.refused(format!("run hoist --dt={value}"), &["--dt"]);
    }
    // More steps than anyone can store.
    at.refused("run hoist --dt 1e-300", &["steps"]);
}

#[test]
fn bad_scene_files_are_refused() {
    let at = folder("files");
    let file = |name: &str, content: &[u8]| at.write(name, content);
    file("empty.toml", b"");
    at.refused("run empty.toml", &["no bodies", "[[body]]"]);
    file("malformed.toml", b"[hoist]\nsegments = 4\nlength = = 3\n");
    at.refused("run malformed.toml", &["line 3"]);
    file("binary.toml", &[0xff, 0xfe, 0x00]);
    at.refused("run binary.toml", &["binary.toml", "UTF-8"]);
    at.refused("run missing.toml", &["missing.toml", "cannot read"]);
    at.refused("run ./missing", &["./missing", "cannot read"]);
    fs::create_dir(at.join("folder.toml")).expect("writable");
    at.refused("run folder.toml", &["folder.toml", "cannot read"]);
}

#[test]
fn files_that_cannot_be_written_are_an_error() {
    let at = folder("unwritable");
    at.write("file", "in the way");
    for option in ["--out file/load.csv", "--json file/run.json"] {
        let arguments = format!("run hoist --set segments=2 --time 0.1 {option}");
        let [_, stderr] = at.ends(2, &arguments);
        assert_eq!(stderr.lines().count(), 1, "{arguments}: {stderr}");
        has(&stderr, "cannot write `file/");
    }
}

#[test]
fn studies_refuse_options_of_others() {
    let at = folder("sweeps");
    let rows = r"
        study crane → crane … linear … taut study --help
        study --segments 3 → --segments … taut study --help
        study linear --iterations 5 → --iterations … unexpected argument … taut study linear --help
        study linear --set length=5 → --set … unexpected argument … taut study linear --help
        study linear --time 1 → --time … unexpected argument … taut study linear --help
        study linear --dt 1/60 → --dt … unexpected argument … taut study linear --help
        study linear --ratios 0 → --ratios … positive
        study linear --segments 0 → segments is 0
        study linear --backends superlu → superlu … banded
        study kernels --segments 0 → segments is 0
        study kernels --backends banded,superlu → superlu … banded … lapack:lower
        study kernels --backends dense/kkt+refine → +refine … /kkt
        study kernels --time 1 → --time
    ";
    at.refuses(rows);
    if !cfg!(feature = "lapack") {
        let row = "study kernels --backends lapack:lower → not compiled in … --features lapack";
        at.refuses(row);
    }
}
