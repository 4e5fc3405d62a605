use super::*;
use crate::matrix::prepared::Problem;
use crate::matrix::solve::{Config, Results, run};
use std::time::Duration;
use taut_solver::forward_error;

fn parsed(text: &str) -> Result<(Matrix, Dropped), MarketError> {
    let path = Path::new("a.mtx");
    matrix_of(&market::read_from(text.as_bytes(), path)?, path)
}

fn system(matrix: Matrix) -> System {
    let (b, exact) = times_ones(&matrix);
    System {
        name: "test".to_owned(),
        matrix,
        dropped: Dropped::default(),
        b,
        from: RightHandSide::Ones { exact },
        x: None,
    }
}

/// −∇² on a grid of n × n, or upwind with a wind, which is not symmetric.
fn grid(n: usize, wind: f64) -> Matrix {
    let mut entries = Vec::new();
    for i in 0..n * n {
        entries.push((i, i, 4.0 + wind));
        for (there, j) in [
            (i % n > 0, i.wrapping_sub(1)),
            (i % n + 1 < n, i + 1),
            (i >= n, i.wrapping_sub(n)),
            (i + n < n * n, i + n),
        ] {
            let blown = if j.wrapping_add(1) == i { -wind } else { 0.0 };
            entries.extend(there.then_some((i, j, -1.0 + blown)));
        }
    }
    let market = Market {
        rows: n * n,
        columns: n * n,
        entries,
        ..Market::default()
    };
    matrix_of(&market, Path::new("grid.mtx")).expect("sound").0
}

#[test]
fn every_backend_solves_a_symmetric_matrix_or_says_why_not() {
    let results = run(&system(grid(12, 0.0)), &Config::default());
    assert!(results.about.symmetric && results.about.condition > Some(10.0));
    for backend in solve::backends() {
        let name = crate::Choice::schur(backend.clone()).family();
        let row = results.records.iter().find(|r| r.backend == name);
        let omitted = results.omissions.iter().find(|o| o.backend == name);
        let grouped = backend.factorizes_groups();
        let what = format!("{name}: {omitted:?}");
        assert_eq!(row.is_some(), backend.is_compiled() && !grouped, "{what}");
        if let Some(row) = row {
            let error = row.forward_error.expect("1 is the solution");
            let bar = if backend.is_iterative() { 1e-2 } else { 1e-14 };
            assert!(error < bar && row.backward_error < bar, "{row:?}");
            let holds = row.ratio >= 1.0 && row.factorize_ns > 0.0 && row.repeats > 0;
            assert!(holds, "{row:?}");
        }
    }
}

#[test]
fn every_backend_solves_an_unsymmetric_matrix_or_says_who_does() {
    let results = run(&system(grid(9, 0.5)), &Config::default());
    assert!(!results.about.symmetric);
    for backend in solve::backends()
        .into_iter()
        .filter(taut_solver::Backend::is_compiled)
    {
        let name = crate::Choice::schur(backend.clone()).family();
        match results.records.iter().find(|r| r.backend == name) {
            Some(row) => {
                assert!(backend.accepts_unsymmetric(), "{name}");
                assert!(row.forward_error.is_some_and(|e| e < 1e-14), "{row:?}");
            }
            None => {
                let omission = results.omissions.iter().find(|o| o.backend == name);
                let reason = &omission.expect("a reason").reason;
                assert!(reason.contains("umfpack, faer:lu, dense"), "{reason}");
            }
        }
    }
}

/// A grid of 10⁴ unknowns has a band of 100: 10⁶ entries, two thirds of them fill that minimum degree avoids.
#[test]
fn a_large_grid_is_solved_in_the_order_of_minimum_degree() {
    let system = system(grid(100, 0.0));
    let problem = Problem::new(&system.matrix);
    let ordered = problem.ordered.expect("symmetric").expect("within reach");
    assert_eq!(ordered.name(), "minimum-degree");
    assert!(ordered.cost.entries < 400_000, "{:?}", ordered.cost);
    let config = Config {
        backends: vec![if taut_solver::Backend::Banded.is_compiled() {
            taut_solver::Backend::Banded
        } else {
            return;
        }],
        budget: std::time::Duration::ZERO,
        ..Config::default()
    };
    let results = run(&system, &config);
    let holds = results.records[0].forward_error < Some(1e-12);
    assert!(holds, "{results:?}");
}

#[test]
fn right_hand_sides_are_exact_or_their_solution_is() {
    // Row sums of 1/3 are rounded: 1 is not the solution, and what is differs by the condition number.
    let thirds =
        "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 1\n2 1 0.333\n2 2 0.1109\n";
    let system = system(parsed(thirds).expect("sound").0);
    assert_eq!(system.from, RightHandSide::Ones { exact: false });
    let problem = Problem::new(&system.matrix);
    let (x, _) = exact::solution(&problem, &system.b).expect("contracts");
    let off = forward_error(&x, &[1.0, 1.0]);
    let condition = exact::condition(&problem).expect("regular").of_matrix;
    let holds = condition > 1e4 && off > 1e-17 && off < 1e-11;
    assert!(holds, "{condition:e} {off:e}");
    // The exact solution by hand: A⁻¹ b with det = 0.1109 − 0.333².
    let Matrix::Symmetric(a) = &system.matrix else {
        panic!("symmetric")
    };
    let exact = taut_solver::reference_solution(a, &system.b).expect("regular");
    assert_eq!(x, exact);
}

#[test]
fn blocks_and_groups_come_back() {
    let text = "%%MatrixMarket matrix coordinate real symmetric\n% blocks 2\n% blocks 1\n% groups 1 0\n\
                3 3 4\n1 1 2\n2 2 2\n3 3 2\n3 1 -1\n";
    let (Matrix::Symmetric(a), _) = parsed(text).expect("sound") else {
        panic!("symmetric")
    };
    let p = a.pattern();
    assert_eq!((p.blocks(), p.size(0), p.groups()), (2, 2, &[1, 0][..]));
    assert_eq!((a.get(2, 0), a.get(1, 0)), (-1.0, 0.0));
    // Words that are not numbers make a plain comment.
    let (plain, _) =
        parsed(&text.replace("% blocks 2\n% blocks 1\n% groups 1 0", "% blocks of ice"))
            .expect("sound");
    assert_eq!(plain.blocks(), 3);
    for (bad, word) in [
        ("% blocks 2 2", "% blocks"),
        ("% blocks 1 2\n% groups 1", "% groups"),
    ] {
        let e = parsed(&text.replace("% blocks 2\n% blocks 1\n% groups 1 0", bad))
            .expect_err("refused");
        let holds = e.message.contains(word) && e.message.contains("drop it");
        assert!(holds, "{e}");
    }
}

#[test]
fn what_is_no_regular_system_is_refused_before_it_is_made() {
    let general = |rest: &str| format!("%%MatrixMarket matrix coordinate real general\n{rest}");
    for (text, words) in [
        (general("2 3 1\n1 1 1\n"), "2 × 3 is not square"),
        (general("0 0 0\n"), "no rows"),
        (
            general("1000000000000 1000000000000 1\n1 1 1\n"),
            "singular",
        ),
        (
            general("1 1 2\n1 1 1e308\n1 1 1e308\n"),
            "more than a double holds",
        ),
    ] {
        let e = parsed(&text).expect_err("refused");
        assert!(e.to_string().contains(words), "{e}");
    }
}

#[test]
fn duplicates_are_added_and_symmetry_is_seen() {
    let text = "%%MatrixMarket matrix coordinate real general\n2 2 5\n1 1 4\n1 2 1\n2 1 0.5\n2 1 0.5\n2 2 3\n";
    let (matrix, dropped) = parsed(text).expect("sound");
    assert_eq!(dropped.duplicates, 1);
    assert!(matches!(matrix, Matrix::Symmetric(_)));
    let (matrix, _) = parsed(&text.replace("2 1 0.5\n2 1 0.5", "2 1 0.5\n2 1 0.6")).expect("sound");
    assert!(matches!(matrix, Matrix::General(_)));
}

/// Results of all backends on a file.
fn results(text: &str) -> Results {
    let (matrix, dropped) = parsed(text).expect("sound");
    let config = Config {
        budget: Duration::ZERO,
        ..Config::default()
    };
    let read = System {
        dropped,
        ..system(matrix)
    };
    run(&read, &config)
}

fn general(n: usize, entries: &[(usize, usize, f64)]) -> String {
    let kind = "%%MatrixMarket matrix coordinate real general";
    let lines = entries.iter();
    let lines = lines.map(|(r, c, a)| format!("{} {} {a:?}\n", r + 1, c + 1));
    format!(
        "{kind}\n{n} {n} {}\n{}",
        entries.len(),
        lines.collect::<String>()
    )
}

fn rows(a: &[&[f64]]) -> String {
    let of_row = |(r, row): (usize, &&[f64])| {
        row.iter()
            .enumerate()
            .map(move |(c, a)| (r, c, *a))
            .collect()
    };
    let entries: Vec<Vec<_>> = a.iter().enumerate().map(of_row).collect();
    general(a.len(), &entries.concat())
}

#[test]
fn a_singular_matrix_is_said_to_be_singular_and_where_it_is_empty() {
    let to_rounding = "the matrix is singular to rounding: rows depend on others";
    for (text, words) in [
        (
            rows(&[&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0], &[7.0, 8.0, 9.0]]),
            to_rounding,
        ),
        (
            rows(&[&[1.0, 0.0, 1.0], &[0.0, 0.0, 0.0], &[1.0, 0.0, 1.0]]),
            "row 2 holds nothing",
        ),
        (
            rows(&[&[1.0, 0.0, 2.0], &[3.0, 0.0, 1.0], &[1.0, 0.0, 5.0]]),
            "column 2 holds nothing",
        ),
    ] {
        let results = results(&text);
        let told = results.about.singular.clone().unwrap_or_default();
        assert!(told.contains(words), "{text}{told}");
        let claim = results.records.iter().find(|r| r.status == "direct");
        assert_eq!(claim, None, "{text}");
        for record in &results.records {
            assert_eq!(record.forward_error, None, "{text}{record:?}");
        }
        if let Some(refusal) = results.refusal() {
            assert!(refusal.contains("is singular"), "{refusal}");
        }
    }
}

/// Numbers for which nothing couples cost nothing.
#[test]
fn zeros_of_a_file_are_counted_and_dropped() {
    let n = 4000;
    let mut entries: Vec<_> = (0..n).map(|i| (i, i, 4.0)).collect();
    entries.extend((1..n).flat_map(|i| [(i, i - 1, -1.0), (i - 1, i, -1.0)]));
    // Zeros in all rows, most of them far from the diagonal.
    entries.extend((0..10 * n).map(|k| (k % n, (k * 7919 + k / n * 31 + 13) % n, 0.0)));
    let results = results(&general(n, &entries));
    assert!(results.about.zeros > 35_000, "{}", results.about.zeros);
    assert_eq!(results.about.entries, 3 * n - 2);
    for row in results.records.iter().filter(|r| r.status == "direct") {
        assert!(row.forward_error < Some(1e-14), "{row:?}");
    }
}
