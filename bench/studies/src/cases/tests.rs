use super::*;
use std::fs;
use std::path::{Path, PathBuf};

/// An empty folder of a test's own.
fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("taut-cases-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder to write to");
    folder
}

fn header(shard: Shard) -> Header {
    Header {
        version: "1".to_owned(),
        command: vec!["study".to_owned(), "roots".to_owned()],
        inputs: Vec::new(),
        shard,
    }
}

/// A study of two stages, the second of which needs what the first found: roots of numbers, some of which have none.
fn roots(cases: &Cases) -> Result<Vec<(f64, String)>, ExperimentError> {
    let numbers: Vec<f64> = (-2..7).map(f64::from).collect();
    let found = cases.in_turn(
        "roots",
        &numbers,
        |x| x.abs(),
        |x| Ok::<_, CasesError>((x.sqrt(), 1.0 / x)),
    )?;
    let places: Vec<usize> = (0..numbers.len()).collect();
    let told = cases.in_turn(
        "words",
        &places,
        |k| numbers[*k].abs(),
        |k| {
            let (root, inverse) = found.of(*k)?;
            Ok::<_, CasesError>(format!("{root} {inverse}"))
        },
    )?;
    let found = found.all()?.into_iter().map(|(root, _)| root);
    Ok(found.zip(told.all()?).collect())
}

/// A run of it with a file: what it came to, and how many cases were run.
fn run(path: &Path, shard: Shard, resume: bool) -> (Option<String>, usize) {
    let machine = format!("machine {}", shard.number);
    let opened = Journal::open(path, header(shard), machine, resume, true);
    let (journal, written) = opened.expect("a file of cases");
    let cases = Cases::new(shard, written.known, Some(journal));
    let found = Cases::unless_elsewhere(roots(&cases)).expect("runs");
    cases.finish().expect("written");
    (
        found.map(|found| format!("{found:?}")),
        cases.counts.run.load(Relaxed),
    )
}

fn read(path: &Path) -> Written {
    Written::read(path).expect("a file of cases")
}

fn joined(paths: &[PathBuf]) -> Result<Joined, CasesError> {
    Joined::of(paths.iter().map(|path| read(path)).collect())
}

/// Files of all shards.
fn shards(at: &Path, of: usize) -> Vec<PathBuf> {
    let one = |number| {
        let path = at.join(format!("{number}-of-{of}.cases"));
        let (found, _) = run(&path, Shard { number, of }, false);
        assert_eq!(found.is_some(), of == 1, "{number} of {of}");
        path
    };
    (1..=of).map(one).collect()
}

#[test]
fn shards_together_are_the_whole_study() {
    let at = folder("whole");
    let whole = format!("{:?}", roots(&Cases::default()).expect("runs"));
    for of in [1, 2, 3, 9, 12] {
        let whole_study = joined(&shards(&at, of)).expect("whole");
        assert_eq!(whole_study.known.len(), 18);
        assert_eq!(whole_study.header, header(Shard::WHOLE));
        let cases = Cases::merged(whole_study.known);
        assert_eq!(
            format!("{:?}", roots(&cases).expect("known")),
            whole,
            "{of}"
        );
        assert_eq!(cases.counts.run.load(Relaxed), 0);
        if of == 2 {
            assert_eq!(
                whole_study.machine,
                "shards 1/2: machine 1; shards 2/2: machine 2"
            );
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
    let mut known = Vec::new();
    for length in 0..=bytes.len() {
        fs::write(&path, &bytes[..length]).expect("writable");
        let before = Written::of(&path, &bytes[..length]);
        let before = before.map_or(0, |written| written.known.len());
        let (found, run_again) = run(&path, Shard::WHOLE, true);
        assert_eq!((found, before + run_again), (whole.clone(), 18), "{length}");
        assert_eq!(fs::read(&path).expect("readable"), bytes, "{length}");
        known.push(before);
    }
    assert!(known.is_sorted() && known.contains(&17) && known.ends_with(&[18, 18]));
    // Nobody asked for what is there.
    assert_eq!(run(&path, Shard::WHOLE, false).1, 18);
    let _ = fs::remove_dir_all(at);
}

#[test]
fn another_machine_that_takes_a_file_up_is_named() {
    let at = folder("machines");
    let path = at.join("a.cases");
    run(&path, Shard::WHOLE, false);
    let bytes = fs::read(&path).expect("readable");
    fs::write(&path, &bytes[..bytes.len() / 2]).expect("writable");
    let opened = Journal::open(
        &path,
        header(Shard::WHOLE),
        "another".to_owned(),
        true,
        true,
    );
    let (_, written) = opened.expect("a file of cases");
    assert_eq!(machines(&[written]), "machine 1; another");
    let _ = fs::remove_dir_all(at);
}

fn refused<T: Debug>(result: Result<T, CasesError>, words: &[&str]) {
    let error = result.expect_err("a fault").to_string();
    for word in words {
        assert!(error.contains(word), "`{word}` is missing in {error}");
    }
}

#[test]
fn files_that_do_not_belong_together_are_named() {
    let at = folder("together");
    let [one, two, three] = shards(&at, 3).try_into().expect("three");
    refused(joined(&[]), &["missing"]);
    refused(
        joined(&[one.clone(), three.clone()]),
        &["missing, of 3: 2", "roots --shard 2/3`"],
    );
    let twice = [one.clone(), two.clone(), two.clone(), three.clone()];
    refused(joined(&twice), &["2/3", "twice", "2-of-3.cases"]);
    let other = shards(&at, 2).remove(0);
    let words = ["1-of-2.cases", "number of shards", "`2`", "`3`"];
    refused(joined(&[one.clone(), other]), &words);
    for (change, words) in [
        (
            (|h: &mut Header| h.version = "2".to_owned()) as fn(&mut Header),
            ["version", "`2`"],
        ),
        (
            |h| h.command.push("--quick".to_owned()),
            ["command", "roots --quick"],
        ),
        (
            |h| {
                h.inputs.push(Input {
                    path: "a.toml".into(),
                    checksum: 1,
                });
            },
            ["content", "a.toml 00000001"],
        ),
    ] {
        let mut files = [&one, &two, &three].map(|path| read(path));
        change(&mut files[1].header);
        let found = Joined::of(files.to_vec());
        refused(found, &[words[0], words[1], "2-of-3.cases", "1-of-3.cases"]);
        let resumed = Journal::open(&two, files[1].header.clone(), String::new(), true, true);
        refused(resumed, &[words[0], words[1], "2-of-3.cases", "this run"]);
    }
    let mut files = [&one, &two, &three].map(|path| read(path));
    files[2].all = None;
    let resumed = format!(
        "`taut study roots --shard 3/3 --resume --cases {}`",
        three.display()
    );
    refused(Joined::of(files.to_vec()), &["3-of-3.cases", &resumed]);
    files[2].all = Some(20);
    refused(Joined::of(files.to_vec()), &["18 cases", "20"]);
    let _ = fs::remove_dir_all(at);
}

#[test]
fn what_is_no_file_of_cases_is_refused_and_left_as_it_is() {
    let at = folder("others");
    let path = at.join("a.cases");
    run(&path, Shard::WHOLE, false);
    let good = fs::read(&path).expect("readable");
    let middle = good.len() / 2;
    let zeros = [&good[..], &[0; 8]].concat();
    let again = [&good[..], &good[middle..]].concat();
    for (bytes, words) in [
        (&b"time,load\n0,1\n"[..], "no file of cases"),
        (b"\xd9\xd9\xf7\x63abc", "no file of cases"),
        (&good[..40], "within its header"),
        (&[], "within its header"),
        (&zeros, "damaged at byte"),
        (&again, "damaged at byte"),
    ] {
        refused(Written::of(&path, bytes), &[words, "a.cases"]);
        if !words.contains("header") {
            fs::write(&path, bytes).expect("writable");
            let resumed = Journal::open(&path, header(Shard::WHOLE), String::new(), true, true);
            refused(resumed, &[words]);
            assert_eq!(fs::read(&path).expect("readable"), bytes);
        }
    }
    refused(Written::read(&at), &["no file of cases"]);
    refused(Written::read(&at.join("none")), &["cannot read", "none"]);
    // Absurd lengths take no memory: they are torn, or none.
    for start in [[0x5b; 9], [0x9b; 9], [0xbb; 9]] {
        let absurd = [&good[..good.len() - 8], &start[..1], &[0xff; 8]].concat();
        let _ = Written::of(&path, &absurd);
    }
    let _ = fs::remove_dir_all(at);
}

#[test]
fn a_file_has_one_writer_and_no_readers_beside_it() {
    let at = folder("writers");
    let path = at.join("a.cases");
    let open = || Journal::open(&path, header(Shard::WHOLE), String::new(), false, true);
    let first = open().expect("a file of cases");
    refused(open(), &["another run", "--cases"]);
    refused(Written::read(&path), &["another run"]);
    drop(first);
    open().expect("nobody writes it");
    let _ = fs::remove_dir_all(at);
}

/// A byte that is another one is found, unless it is one of the machine's name.
#[test]
fn damage_is_found() {
    let at = folder("damage");
    let path = at.join("a.cases");
    let (whole, _) = run(&path, Shard::WHOLE, false);
    let good = fs::read(&path).expect("readable");
    let found = |bytes: &[u8]| -> Result<String, ExperimentError> {
        let study = Joined::of(vec![Written::of(&path, bytes)?])?;
        Ok(format!("{:?}", roots(&Cases::merged(study.known))?))
    };
    let mut unnoticed = 0;
    for at in 0..good.len() {
        let mut flipped = good.clone();
        flipped[at] ^= 1;
        let missing = [&good[..at], &good[at + 1..]].concat();
        for bytes in [flipped, missing] {
            if let Ok(found) = found(&bytes) {
                assert_eq!(Some(found), whole, "byte {at}");
                unnoticed += 1;
            }
        }
    }
    // Header and machine are not cases.
    assert!(unnoticed < 100, "{unnoticed} of {}", 2 * good.len());
    let _ = fs::remove_dir_all(at);
}

/// A record is refused in the place of another case.
#[test]
fn records_of_other_cases_are_not_taken() {
    let at = folder("labels");
    let path = at.join("a.cases");
    run(&path, Shard::WHOLE, false);
    let cases = Cases::merged(read(&path).known);
    let run = |x: &f64| Ok::<_, CasesError>((*x, *x));
    let other = cases.in_turn("roots", &[-2.0, 5.0], |_| 1.0, run);
    let error = other.expect_err("another case").to_string();
    assert!(error.contains("case 2 of the stage `roots`"), "{error}");
    let more = cases.in_turn("halves", &[1.0], |_| 1.0, run);
    let error = more.expect_err("no such stage").to_string();
    assert!(error.contains("is in no file"), "{error}");
    let _ = fs::remove_dir_all(at);
}
