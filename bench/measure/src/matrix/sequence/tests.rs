use super::*;
use crate::choice::Choice;
use crate::matrix::dump;
use std::fs;
use std::path::PathBuf;
use taut_integrator::Stepper;
use taut_model::{Action, Event, HoistParams, When};

/// A hoist of three segments that swings, the load of which falls off after five steps.
fn stepper() -> Stepper {
    let params = HoistParams {
        segments: 3,
        mass_ratio: 1e4,
        initial_angle: 0.4,
        ..HoistParams::default()
    };
    let mut scene = params.build().expect("builds");
    let last = scene.constraints.len() - 1;
    scene.events.push(Event {
        name: "dropped".to_owned(),
        when: When::Time(4.5 / 60.0),
        then: vec![Action::Release(last)],
    });
    let options = Choice::schur(taut_solver::Backend::Dense(Default::default()));
    Stepper::new(scene, options.options(1.0 / 60.0)).expect("starts")
}

/// Matrix and right-hand side of each form.
type BothForms = [(SymBlockMatrix, Vec<f64>); 2];

/// A folder with the systems of steps 2 to 7 of that hoist, and the stepper's own of both forms.
fn recorded(name: &str, gzip: bool) -> (PathBuf, Vec<BothForms>) {
    let folder = std::env::temp_dir().join(format!("taut-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    let mut recorder = Recorder::new(Wanted {
        folder: folder.clone(),
        comments: vec!["hoist".to_owned()],
        exact: true,
        gzip,
    })
    .expect("a folder");
    let mut recorded = stepper();
    let mut systems = Vec::new();
    for step in 0..8 {
        if step >= 2 {
            recorder.take(step, &recorded).expect("taken");
            // Oracle: another run up to there, which nothing has looked at.
            let mut other = stepper();
            for _ in 0..step {
                other.step().expect("steps");
            }
            systems.push(dump::assembled(&mut other).expect("assembled"));
        }
        recorded.step().expect("steps");
    }
    let Written {
        files, stretches, ..
    } = recorder.finish().expect("written");
    assert_eq!((files.len(), stretches), (1 + 2 * 2 * 4, 2));
    (folder, systems)
}

fn lower(a: &SymBlockMatrix) -> Vec<f64> {
    let mut values = Vec::new();
    a.for_each_lower(|_, _, value| values.push(value));
    values
}

/// The systems of an unrecorded run, to the last bit but for the sign of zeros, in two stretches: the second without the
/// load's joint.
#[test]
fn a_sequence_comes_back_as_it_was() {
    for gzip in [false, true] {
        let (folder, systems) = recorded(&format!("sequence-{gzip}"), gzip);
        let sequence = read(&folder).expect("reads");
        assert_eq!((sequence.first, sequence.len()), (2, 6));
        let lengths: Vec<usize> = sequence.stretches.iter().map(|s| s.time.len()).collect();
        assert_eq!(lengths, [3, 3]);
        let mut own = systems.into_iter();
        for stretch in &sequence.stretches {
            for (step, time) in stretch.time.iter().enumerate() {
                let number = 6 - own.len() + 2;
                assert!((time - number as f64 / 60.0).abs() < 1e-12);
                let both = own.next().expect("as many");
                for (systems, (a, b)) in stretch.systems.iter().zip(both) {
                    let mut matrix = systems.first();
                    systems.put(step, &mut matrix);
                    // Files hold, and solvers read, the lower triangle of a diagonal block only.
                    assert_eq!(matrix.pattern(), a.pattern());
                    assert_eq!(lower(&matrix), lower(&a));
                    assert_eq!(systems.rhs[step], b);
                    let exact = &systems.exact.as_ref().expect("asked for")[step];
                    let found = taut_solver::reference_solution(&a, &b).expect("regular");
                    assert!(taut_solver::forward_error(exact, &found) < 1e-15);
                }
            }
        }
        fs::remove_dir_all(folder).expect("removed");
    }
}

#[test]
fn a_faulty_folder_is_refused_with_the_file_at_fault() {
    let (folder, _) = recorded("faulty-sequence", false);
    let refused = |file: &str, change: &dyn Fn(String) -> Option<String>, words: &[&str]| {
        let path = folder.join(file);
        let text = fs::read_to_string(&path).expect("there");
        match change(text.clone()) {
            Some(changed) => fs::write(&path, changed).expect("writable"),
            None => fs::remove_file(&path).expect("removable"),
        }
        let message = read(&folder).expect_err("a fault").to_string();
        for word in words {
            assert!(message.contains(word), "`{word}` is missing in {message}");
        }
        fs::write(&path, text).expect("writable");
    };
    let without = |line: &'static str| {
        move |text: String| {
            let kept = text.lines().filter(|l| !l.starts_with(line));
            Some(kept.map(|l| format!("{l}\n")).collect())
        }
    };
    let cut = |text: String| text.get(..text.len() / 2).map(str::to_owned);
    let swapped =
        |from: &'static str, to: &'static str| move |text: String| Some(text.replacen(from, to, 1));
    refused(INDEX, &|_| None, &["holds no sequence", "taut dump"]);
    refused(INDEX, &without("3,"), &[INDEX, "step 4 follows step 2"]);
    refused(INDEX, &without("step"), &[INDEX, "line 1", "step,time"]);
    refused(INDEX, &swapped("\n3,", "\nx,"), &[INDEX, "line 3", "x,"]);
    refused(INDEX, &swapped(",2\n", ",3\n"), &["stretch 3", "gap"]);
    let empty = |_| Some("step,time,stretch\n".to_owned());
    refused(INDEX, &empty, &[INDEX, "no steps"]);
    // A step less than the arrays have.
    refused(INDEX, &without("7,"), &["schur_2_values.mtx", "× 3", "× 2"]);
    refused("kkt_1.mtx", &|_| None, &["kkt_1.mtx", "cannot be read"]);
    refused("schur_2_rhs.mtx", &|_| None, &["schur_2_rhs.mtx"]);
    let all = &["schur_1_values.mtx", "cut off"];
    refused("schur_1_values.mtx", &cut, all);
    refused("kkt_2_rhs.mtx", &cut, &["kkt_2_rhs.mtx"]);
    let dense = swapped("coordinate real symmetric", "coordinate real general");
    refused("schur_1.mtx", &dense, &["schur_1.mtx"]);
    // Rows of values stand for entries by their order.
    let exchanged = |text: String| {
        let mut lines: Vec<&str> = text.lines().collect();
        let last = lines.len() - 1;
        lines.swap(last, last - 1);
        Some(lines.join("\n") + "\n")
    };
    refused("kkt_1.mtx", &exchanged, &["kkt_1.mtx", "out of order"]);
    let sparse = |text: String| {
        let sizes = text.lines().find(|l| !l.starts_with('%'))?.to_owned();
        let heading = "%%MatrixMarket matrix coordinate real general";
        Some(format!("{heading}\n{sizes} 1\n1 1 1\n"))
    };
    refused("schur_1_rhs.mtx", &sparse, &["schur_1_rhs.mtx", "array"]);
    assert_eq!(read(&folder).expect("as it was").len(), 6);
    fs::remove_dir_all(folder).expect("removed");
}

/// Solutions and files of the other ending that an earlier sequence left are not read with those of the next.
#[test]
fn a_sequence_takes_the_place_of_another() {
    let (folder, _) = recorded("replaced-sequence", false);
    let wanted = Wanted {
        folder: folder.clone(),
        gzip: true,
        ..Wanted::default()
    };
    let mut recorder = Recorder::new(wanted).expect("a folder");
    // An unfinished sequence cannot be read.
    let none = read(&folder).map(drop).unwrap_err().to_string();
    assert!(none.contains("holds no sequence"), "{none}");
    recorder.take(0, &stepper()).expect("taken");
    recorder.finish().expect("written");
    let sequence = read(&folder).expect("reads");
    assert_eq!((sequence.first, sequence.len()), (0, 1));
    assert_eq!(sequence.stretches[0].systems[0].exact, None);
    fs::remove_dir_all(folder).expect("removed");
}
