use super::*;
use crate::matrix::write;
use proptest::prelude::*;
use std::sync::Arc;
use taut_solver::{BlockPattern, SymBlockMatrix};

fn parse(text: &[u8]) -> Result<Market, MarketError> {
    read_from(text, Path::new("a.mtx"))
}

const REAL: &str = "%%MatrixMarket matrix coordinate real general\n";

#[test]
fn entries_are_read_as_they_stand() {
    let text = "%%matrixmarket MATRIX Coordinate Real General\r\n% made by hand\r\n\r\n3 2 4\r\n\
                1 1 -0.0\r\n% between\r\n3 2 1D-3\r\n  2\t1  4.9406564584124654e-324 \r\n1 1 2\r\n\r\n";
    let market = parse(text.as_bytes()).expect("reads");
    let found = (market.rows, market.columns, market.symmetric);
    assert_eq!(found, (3, 2, false));
    let expected = [(0, 0, -0.0), (2, 1, 1e-3), (1, 0, 5e-324), (0, 0, 2.0)];
    assert_eq!(market.entries, expected);
    assert!(market.entries[0].2.is_sign_negative());
    let marked = format!("\u{feff}{text}");
    assert_eq!(parse(marked.as_bytes()).expect("reads"), market);
}

/// Comments are gone when they are read, and what they tell of blocks has an end.
#[test]
fn comments_do_not_fill_the_memory() {
    let line = format!("% blocks{}\n", " 1".repeat(500_000));
    let text = format!("{REAL}{}1 1 1\n1 1 1\n", line.repeat(17));
    says(&text, 18, "comments tell of more than 8388608 blocks");
}

#[test]
fn arrays_go_by_columns() {
    let entries = |head: &str, body: &str| {
        let text = format!("%%MatrixMarket matrix array {head}\n{body}\n");
        parse(text.as_bytes()).expect("reads").entries
    };
    let found = entries("real general", "2 1\n0\n5");
    assert_eq!(found, [(0, 0, 0.0), (1, 0, 5.0)]);
    let found = entries("integer general", "2 2\n1\n2\n0\n4");
    assert_eq!(found, [(0, 0, 1.0), (1, 0, 2.0), (1, 1, 4.0)]);
    let expected = [
        (0, 0, 1.0),
        (1, 0, 2.0),
        (2, 0, 3.0),
        (1, 1, 4.0),
        (2, 1, 5.0),
        (2, 2, 6.0),
    ];
    assert_eq!(entries("real symmetric", "3 3\n1\n2\n3\n4\n5\n6"), expected);
}

/// The text is refused in that line, with those words.
fn says(text: &str, line: u64, words: &str) {
    let e = parse(text.as_bytes()).expect_err(text);
    assert_eq!(e.line, Some(line), "{e}");
    assert!(e.message.contains(words), "`{words}` is missing in: {e}");
    assert!(e.to_string().starts_with("a.mtx, line "), "{e}");
}

#[test]
fn headers_that_do_not_serve_say_why_and_what_to_do() {
    let banner = |rest: &str| format!("%%MatrixMarket {rest}\n1 1 1\n1 1 1\n");
    says("", 1, "the file is empty");
    says("1 1 1\n", 1, "%%MatrixMarket matrix");
    says("a.mtx\0\0\0", 1, ".tar.gz");
    says(
        &banner("matrix coordinate real"),
        1,
        "no Matrix Market banner",
    );
    for (kind, words) in [
        ("vector coordinate real general", "`matrix`"),
        ("matrix dense real general", "`array`"),
        ("matrix coordinate complex general", "twice the size"),
        ("matrix coordinate pattern general", "no values"),
        ("matrix coordinate text general", "`real`"),
        ("matrix coordinate real skew-symmetric", "both triangles"),
        ("matrix coordinate complex hermitian", "twice the size"),
        ("matrix coordinate real hermitian", "`symmetric`"),
        ("matrix coordinate real triangular", "`general`"),
    ] {
        says(&banner(kind), 1, words);
    }
    let real = |rest: &str| format!("{REAL}{rest}");
    says(&real("% only\n"), 3, "before its sizes");
    says(&real("1 1\n"), 2, "has 2 numbers");
    says(&real("-1 1 1\n"), 2, "`-1`");
    says(&real("99999999999999999999 1 1\n"), 2, "can be held");
    says(&real("1 1 9223372036854775807\n"), 2, "can be held");
    let array = "%%MatrixMarket matrix array real general\n";
    let line = &format!("{array}1000000000000 1000000000000\n");
    says(line, 2, "coordinates");
    says(&format!("{array}2 1\n1 2\n"), 3, "has 2 numbers");
    let symmetric = "%%MatrixMarket matrix coordinate real symmetric\n";
    says(&format!("{symmetric}2 3 1\n"), 2, "as many rows");
    says(&format!("{symmetric}2 2 1\n1 2 1\n"), 3, "lower triangle");
}

#[test]
fn entries_that_make_no_sense_say_why_and_what_to_do() {
    let real = |rest: &str| format!("{REAL}{rest}");
    says(&real("2 2 1\n0 1 1\n"), 3, "count from 1");
    says(&real("2 2 1\n1 -1 1\n"), 3, "the column is `-1`");
    says(&real("2 2 1\n1.5 1 1\n"), 3, "the row is `1.5`");
    says(&real("2 2 1\n1 3 1\n"), 3, "the column is 3 of 2");
    says(&real("2 2 1\n1 99999999999999999999 1\n"), 3, "from 1 to 2");
    for (value, words) in [
        ("nan", "finite"),
        ("-inf", "finite"),
        ("1e999", "fit a double"),
        ("one", "a number"),
        ("1,5", "a number"),
    ] {
        says(&real(&format!("2 2 1\n1 1 {value}\n")), 3, words);
    }
    says(&real("2 2 1\n1 1\n"), 3, "has 2 numbers");
    says(&real("2 2 1\n1 1 1 0\n"), 3, "has 4 numbers");
    says(&real("2 2 1\n1 1 1\n2 2 2\n"), 4, "line 2 promises");
    says(&real("2 2 3\n1 1 1\n2 2 2\n"), 5, "after 2 of the 3");
    let integer = "%%MatrixMarket matrix coordinate integer general\n";
    says(&format!("{integer}1 1 1\n1 1 1.5\n"), 3, "integer");
    let name = &format!("{integer}1 1 1\n1 1 9007199254740993\n");
    says(name, 3, "`real`");
    for power in [54, 63, 64] {
        let text = format!("{integer}1 1 1\n1 1 {}\n", 1_i128 << power);
        let market = parse(text.as_bytes()).expect("a double holds it");
        assert_eq!(market.entries, [(0, 0, 2.0_f64.powi(power))]);
    }
}

/// Announced sizes that the file does not fill allocate nothing.
#[test]
fn a_header_alone_costs_nothing() {
    let e = parse(format!("{REAL}1000000 1000000 1000000000000\n1 1 1\n").as_bytes())
        .expect_err("cut off");
    assert!(e.message.contains("after 1 of the"), "{e}");
    let endless = std::io::repeat(b'7');
    let e = read_from(BufReader::new(endless), Path::new("endless")).expect_err("no line");
    assert!(e.message.contains("is no line of text"), "{e}");
}

#[test]
fn damaged_and_missing_files_are_errors() {
    let folder = std::env::temp_dir().join(format!("taut-market-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let e = read(&folder.join("none.mtx")).expect_err("missing");
    assert_eq!(e.line, None);
    let text = format!("{REAL}1 1 1\n% {}\n1 1 1\n", "filler ".repeat(500));
    let path = write::file(&folder, "packed", &text, true).expect("written");
    assert_eq!(read(&path).expect("reads").entries, [(0, 0, 1.0)]);
    let bytes = std::fs::read(&path).expect("there");
    std::fs::write(&path, &bytes[..bytes.len() / 2]).expect("written");
    let e = read(&path).expect_err("cut off");
    assert!(e.message.contains("damaged"), "{e}");
    std::fs::remove_dir_all(folder).expect("removed");
}

/// Any finite double, denormals and both zeros among them.
fn double() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => any::<u64>().prop_map(f64::from_bits).prop_filter("finite", |x| x.is_finite()),
        1 => Just(-0.0),
        1 => (1_u64..1 << 52).prop_map(f64::from_bits),
        1 => prop::sample::select(vec![f64::MAX, f64::MIN_POSITIVE, f64::EPSILON, 5e-324, 0.1]),
    ]
}

proptest! {
    #[test]
    fn vectors_come_back_to_the_last_bit(v in prop::collection::vec(double(), 1..40)) {
        let text = write::vector(&v, &["any numbers".to_owned()]);
        let back = parse(text.as_bytes()).expect("reads");
        let bits = |v: f64| v.to_bits();
        let found = back.entries.iter().map(|e| bits(e.2)).collect::<Vec<_>>();
        prop_assert_eq!(found, v.iter().copied().map(bits).collect::<Vec<_>>());
    }

    #[test]
    fn matrices_come_back_to_the_last_bit(
        sizes in prop::collection::vec(0_usize..5, 1..8),
        pairs in prop::collection::vec((0_usize..8, 0_usize..8), 0..12),
        values in prop::collection::vec(double(), 700),
    ) {
        prop_assume!(sizes.iter().sum::<usize>() > 0);
        let n = sizes.len();
        // Blocks without rows have no entries that tell of them.
        let has_rows = |&(i, j): &(usize, usize)| sizes[i] > 0 && sizes[j] > 0;
        let couplings: Vec<_> = pairs.iter().map(|&(i, j)| (i % n, j % n)).filter(has_rows).collect();
        let groups = (0..n).map(|i| (i % 3) as u32).collect();
        let pattern = BlockPattern::new(&sizes, &couplings).expect("sound").with_groups(groups).expect("sound");
        let mut a = SymBlockMatrix::zeros(Arc::new(pattern));
        for (to, &from) in a.values_mut().iter_mut().zip(values.iter().cycle()) {
            *to = from;
        }
        let text = write::symmetric(&a, &vec![true; n], &[]);
        let path = Path::new("a.mtx");
        let back = crate::matrix::stored_matrix_of(&parse(text.as_bytes()).expect("reads"), path).expect("sound");
        let crate::matrix::Matrix::Symmetric(back) = back else { panic!("symmetric") };
        prop_assert_eq!(back.pattern(), a.pattern());
        let lower = |a: &SymBlockMatrix| {
            let mut bits = Vec::new();
            a.for_each_lower(|r, c, v| bits.push((r, c, v.to_bits())));
            bits
        };
        prop_assert_eq!(lower(&back), lower(&a));
    }

    #[test]
    fn no_text_is_a_panic(text in prop::collection::vec(any::<u8>(), 0..200), with_banner: bool) {
        let banner: &[u8] = if with_banner { REAL.as_bytes() } else { b"" };
        let _ = parse(&[banner, &text].concat());
    }

    #[test]
    fn no_line_of_numbers_is_a_panic(text in "([0-9e. -]{0,12}\n){0,6}") {
        let _ = parse(format!("{REAL}{text}").as_bytes());
        let _ = parse(format!("%%MatrixMarket matrix array real symmetric\n{text}").as_bytes());
    }
}
