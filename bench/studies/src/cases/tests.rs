use super::*;
use serde::Deserialize;
use std::fs;
use std::path::{Path, PathBuf};

/// An empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("taut-cases-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder to write to");
    folder
}

fn header() -> Header {
    Header {
        version: "1".to_owned(),
        command: vec!["study".to_owned(), "roots".to_owned()],
        inputs: Vec::new(),
        machine: "a machine".to_owned(),
    }
}

/// A study of two stages, the second of which needs what the first found: roots of numbers, some of which have none.
fn roots(cases: &Cases) -> Result<Vec<(f64, String)>, ExperimentError> {
    let numbers: Vec<f64> = (-2..7).map(f64::from).collect();
    let root = |x: &f64| Ok::<_, Elsewhere>((x.sqrt(), 1.0 / x));
    let found = cases.in_turn("roots", &numbers, root)?;
    let places: Vec<usize> = (0..numbers.len()).collect();
    let word = |k: &usize| {
        let (root, inverse) = found.of(*k)?;
        Ok::<_, Elsewhere>(format!("{root} {inverse}"))
    };
    let told = cases.in_turn("words", &places, word)?;
    let found = found.all()?.into_iter().map(|(root, _)| root);
    Ok(found.zip(told.all()?).collect())
}

fn open(path: &Path, resume: bool, is_asked_for: bool) -> Result<(Journal, Written), String> {
    Journal::open(path, header(), resume, is_asked_for)
}

/// A run of it with a file: what it came to, and how many cases were run.
fn run(path: &Path, shard: Shard, resume: bool) -> (Option<String>, usize) {
    let (journal, written) = open(path, resume, true).expect("a file of cases");
    let cases = Cases::new(shard, written.known, Some(journal));
    let found = Cases::unless_elsewhere(roots(&cases)).expect("runs");
    cases.finish().expect("written");
    let found = found.map(|found| format!("{found:?}"));
    (found, cases.counts[2].load(Relaxed))
}

fn refused<T: Debug>(result: Result<T, impl ToString>, words: &[&str]) {
    let error = result.expect_err("a fault").to_string();
    for word in words {
        assert!(error.contains(word), "`{word}` is missing in {error}");
    }
}

#[test]
fn shards_together_are_the_whole_study() {
    let at = folder("whole");
    let whole = format!("{:?}", roots(&Cases::default()).expect("runs"));
    for of in [1, 2, 3, 9, 12] {
        let one = |number| {
            let path = at.join(format!("{number}-of-{of}.cases"));
            let (found, _) = run(&path, Shard { number, of }, false);
            assert_eq!(found.is_some(), of == 1, "{number} of {of}");
            path
        };
        let files: Vec<PathBuf> = (1..=of).map(one).collect();
        let read = Written::read(&files).expect("files of one study");
        assert_eq!(read.machines, ["a machine"]);
        let cases = Cases::merged(read.known);
        let merged = format!("{:?}", roots(&cases).expect("known"));
        assert_eq!(merged, whole, "{of}");
        assert_eq!(cases.counts[2].load(Relaxed), 0);
        if of > 1 {
            let rest = Written::read(&files[1..]).expect("files of one study");
            let words = &["roots 1: -2.0", "all shards"];
            refused(roots(&Cases::merged(rest.known)), words);
        }
    }
    let _ = fs::remove_dir_all(at);
}

/// Killed at any byte: what is whole in the file is known, the rest is run, and the file ends up as that of one run.
#[test]
fn a_file_that_ends_anywhere_is_taken_up_without_loss() {
    let at = folder("torn");
    let path = at.join("whole.cases");
    let (whole, run_first) = run(&path, Shard::WHOLE, false);
    assert_eq!(run_first, 18);
    let bytes = fs::read(&path).expect("readable");
    for length in 0..=bytes.len() {
        fs::write(&path, &bytes[..length]).expect("writable");
        let (found, run_again) = run(&path, Shard::WHOLE, true);
        let lines = bytes[..length].iter().filter(|b| **b == b'\n').count();
        let ours = (found, run_again);
        assert_eq!(ours, (whole.clone(), 18 - lines.saturating_sub(1)));
        assert_eq!(fs::read(&path).expect("readable"), bytes, "{length}");
    }
    let words = &["whole.cases", "--resume", "delete"];
    refused(open(&path, false, true), words);
    let (_, anew) = open(&path, false, false).expect("a file of cases");
    assert!(anew.known.is_empty());
    let _ = fs::remove_dir_all(at);
}

#[test]
fn files_of_other_settings_and_files_without_cases_are_refused_and_left_as_they_are() {
    let at = folder("others");
    let [path, other] = ["a.cases", "b.cases"].map(|name| at.join(name));
    run(&path, Shard::WHOLE, false);
    let good = fs::read(&path).expect("readable");
    let changes: [(fn(&mut Header), _); 3] = [
        (|h| h.version = "2".to_owned(), ["version", "`2`"]),
        (
            |h| h.command.push("--quick".to_owned()),
            ["command", "roots --quick"],
        ),
        (
            |h| h.inputs.push("a.toml 01".to_owned()),
            ["content", "a.toml 01"],
        ),
    ];
    for (change, words) in changes {
        let mut changed = header();
        change(&mut changed);
        let all = &[&words[..], &["a.cases", "this run"]].concat();
        refused(Journal::open(&path, changed.clone(), true, true), all);
        let _ = fs::remove_file(&other);
        let (journal, _) = Journal::open(&other, changed, false, true).expect("new");
        Cases::new(Shard::WHOLE, Known::new(), Some(journal))
            .finish()
            .expect("written");
        let all = &[&words[..], &["b.cases", "a.cases"]].concat();
        refused(Written::read(&[path.clone(), other.clone()]), all);
    }
    let damaged = [&good[..], b"{}\n", &good[..]].concat();
    for (bytes, words) in [
        (&b"time,load\n0,1\n"[..], "no file of cases"),
        (b"\xd9\xd9\xf7\x63abc", "earlier version"),
        (b"{\"header\":1}\n", "damaged in line 1"),
        (&damaged, "damaged in line 20"),
    ] {
        fs::write(&path, bytes).expect("writable");
        refused(open(&path, true, true), &[words, "a.cases"]);
        let all = &[words, "a.cases"];
        refused(Written::read(std::slice::from_ref(&path)), all);
        assert_eq!(fs::read(&path).expect("readable"), bytes);
    }
    let all = &["no file of cases"];
    refused(Written::read(std::slice::from_ref(&at)), all);
    refused(Written::read(&[at.join("none")]), &["cannot read", "none"]);
    let _ = fs::remove_dir_all(at);
}

#[test]
fn a_file_has_one_writer_whose_failure_is_told() {
    let at = folder("fails");
    let path = at.join("a.cases");
    let (mut journal, _) = open(&path, false, false).expect("opened");
    refused(open(&path, false, false), &["another run", "--cases"]);
    journal.file = fs::File::open(&path).expect("there");
    let cases = Cases::new(Shard::WHOLE, Known::new(), Some(journal));
    refused(roots(&cases), &["cannot write", "a.cases"]);
    drop(cases);
    // What fails once is not tried again: the records behind it would follow a part of one.
    let (mut journal, _) = open(&path, false, false).expect("opened");
    let closed = fs::File::open(&path).expect("there");
    let writable = std::mem::replace(&mut journal.file, closed);
    refused(journal.write(None), &["cannot write"]);
    journal.file = writable;
    refused(journal.write(None), &["cannot write"]);
    assert_eq!(fs::read(&path).expect("there"), b"");
    let _ = fs::remove_dir_all(at);
}

#[test]
fn a_case_of_two_files_has_one_record() {
    let at = folder("twice");
    let both = ["a.cases", "b.cases"].map(|name| at.join(name));
    run(&both[0], Shard::WHOLE, false);
    let text = fs::read_to_string(&both[0]).expect("written");
    let write = |record: &str| {
        assert!(text.contains(r##"["#NaN",-0.5]"##), "{text}");
        let other = text.replace(r##"["#NaN",-0.5]"##, record);
        fs::write(&both[1], format!("\u{feff}{other}")).expect("writable");
    };
    write(r##"["#NaN",-0.5]"##);
    assert_eq!(Written::read(&both).expect("one").known.len(), 18);
    write("true");
    let words = ["a.cases", "b.cases", "different records", "roots 1: -2.0"];
    refused(Written::read(&both), &words);
    let read = Written::read(&both[1..]).expect("readable");
    let words = [
        "b.cases` is damaged in the record",
        "roots 1: -2.0",
        "(invalid type",
    ];
    refused(roots(&Cases::merged(read.known)), &words);
    let _ = fs::remove_dir_all(at);
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Part {
    Unit,
    One(Option<f64>),
    Pair(f32, Option<()>),
    Named {
        text: String,
        large: u64,
        small: i64,
    },
}

/// NaN, infinities, all bits of finite numbers, and texts that look like them.
#[test]
fn records_are_read_as_they_were_written() {
    let part = |text: &str| Part::Named {
        text: text.to_owned(),
        large: u64::MAX,
        small: i64::MIN,
    };
    let numbers = [
        0.1 + 0.2,
        -0.0,
        1e300,
        f64::MIN_POSITIVE / 3.0,
        7.0,
        1e20,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];
    let parts = [
        Part::Unit,
        Part::One(None),
        Part::One(Some(f64::INFINITY)),
        Part::Pair(0.1, None),
    ];
    let parts: Vec<Part> = parts
        .into_iter()
        .chain(["#NaN", "NaN", "##inf", "#", "", "#a"].map(part))
        .collect();
    let record = Record::of(&(numbers, parts.clone())).expect("written");
    let text = serde_json::to_string(&record.0).expect("JSON");
    assert!(text.contains(r##""#inf","#-inf","#NaN""##), "{text}");
    let record = Record(serde_json::from_str(&text).expect("JSON"));
    let (again, others): ([f64; 9], Vec<Part>) = record.read().expect("readable");
    assert_eq!(again.map(f64::to_bits)[..8], numbers.map(f64::to_bits)[..8]);
    assert!(again[8].is_nan());
    assert_eq!(others, parts);
}

#[test]
fn every_case_is_dealt_once_and_a_list_that_repeats_itself_evenly() {
    for of in [1, 2, 3, 8, 99] {
        let shards = (1..=of).map(|number| Shard { number, of });
        let own = shards.map(|shard| (0..of * of).filter(move |case| shard.owns(*case)));
        let own: Vec<Vec<usize>> = own.map(Iterator::collect).collect();
        let mut all = own.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..of * of));
        for cases in own {
            let mut kinds: Vec<usize> = cases.into_iter().map(|case| case % of).collect();
            kinds.sort_unstable();
            assert!(kinds.into_iter().eq(0..of), "{of}");
        }
    }
}

#[test]
fn a_shard_is_read_as_it_is_written() {
    assert_eq!("3/8".parse(), Ok(Shard { number: 3, of: 8 }));
    assert_eq!("3/8".parse::<Shard>().unwrap().to_string(), "3/8");
    for text in [
        "3/2", "0/2", "1/0", "0/0", "", "/", "1", "a/b", "1/2/3", "-1/2", "1/10001", "1/1e9",
    ] {
        assert!(text.parse::<Shard>().unwrap_err().contains("8/8"), "{text}");
    }
}
