//! Problems of steps: written, read, and solved to what the step found.

use super::files::{self, Info, ProblemError, Step};
use super::{ContactProblem, solve};
use crate::choice::Choice;
use crate::matrix::market::Fault;
use crate::matrix::solve::Config;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use taut_integrator::{StepOptions, Stepper};
use taut_model::{Bodies, Grounded, GroundedParams};
use taut_solver::Backend;

/// A scene on the ground after some steps, with that method.
fn moving(grounded: Grounded, mass_ratio: f64, method: &str, steps: usize) -> Stepper {
    let params = GroundedParams {
        mass_ratio,
        segments: 12,
        ..GroundedParams::new(grounded)
    };
    let options = StepOptions {
        contacts: method.parse().expect("a method"),
        ..Choice::schur(Backend::Dense(Default::default())).options(1.0 / 60.0)
    };
    let mut stepper = Stepper::new(params.build().expect("built"), options).expect("sound");
    for _ in 0..steps {
        stepper.step().expect("stable");
    }
    stepper
}

/// The problem of its next step.
fn next_problem(stepper: &mut Stepper) -> ContactProblem {
    stepper.begin().expect("begins");
    stepper.solve().expect("solves");
    stepper.contact_problem().expect("they touch")
}

fn info(problem: &ContactProblem) -> Info {
    let step = Step {
        scene: "scene".to_owned(),
        step: 3,
        time: 0.05,
        dt: 1.0 / 60.0,
        solver: "newton".to_owned(),
    };
    Info::new(problem, step)
}

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("taut-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    folder
}

fn config() -> Config {
    let compiled = Backend::all().into_iter().filter(Backend::is_compiled);
    Config {
        backends: compiled.collect(),
        budget: Duration::ZERO,
        ..Config::default()
    }
}

/// Where the velocities of moving bodies, which free rotation does not turn, differ from those of a problem, over the largest of
/// them and of what their weight does in a step.
fn off(own: &[f64], bodies: &Bodies) -> f64 {
    let (mut apart, mut size, mut first) = (0.0_f64, 9.81_f64 / 60.0, 0);
    for i in (0..bodies.len()).filter(|i| bodies.is_dynamic(*i)) {
        for (own, after) in own[first..].iter().zip(&bodies.velocity[i]) {
            apart = apart.max((own - after).abs());
            size = size.max(after.abs());
        }
        first += if bodies.is_point(i) { 3 } else { 6 };
    }
    assert_eq!(first, own.len());
    apart / size
}

/// Whatever backend factorises the joints, the problem's solution is the velocities that the step ends with.
#[test]
fn a_problem_solved_again_is_the_step() {
    for grounded in Grounded::ALL {
        for mass_ratio in [1.0, 1e3] {
            let steps = if grounded == Grounded::Pile { 25 } else { 20 };
            let mut stepper = moving(grounded, mass_ratio, "newton", steps);
            let problem = next_problem(&mut stepper);
            let at = folder(&format!("contacts-{grounded:?}-{mass_ratio}"));
            let about = info(&problem);
            files::write(&problem, &about, &at, mass_ratio > 1.0).expect("written");
            let (read, told) = files::read(&at).expect("read");
            assert_eq!((&sorted(&read), &told), (&sorted(&problem), &about));
            stepper.advance().expect("advances");
            let own = problem.solution.expect("solved").velocities;
            let off = off(&own, &stepper.scene().bodies);
            assert!(off < 1e-12, "{grounded:?} {mass_ratio}: {off}");

            let results = solve::run(&read, &told, &at, &config()).expect("a sound problem");
            let newton = results.records.iter().filter(|r| r.method == "newton");
            for row in newton.clone() {
                let off = row.velocity_error.expect("a reference");
                assert!(off < 1e-9, "{grounded:?} {mass_ratio}: {row:?}");
                assert!(row.complementarity < 1e-9 && row.cone < 1e-10, "{row:?}");
            }
            // The stack has no joints, and nothing to factorise.
            let backends = newton.count();
            assert!(backends == 1 || grounded != Grounded::Stack, "{results:?}");
            assert!(backends > 0, "{results:?}");
            fs::remove_dir_all(&at).expect("removed");
        }
    }
}

/// Entries in the order of files.
fn sorted(problem: &ContactProblem) -> ContactProblem {
    let mut problem = problem.clone();
    for entries in [
        &mut problem.inertia,
        &mut problem.of_joints,
        &mut problem.of_contacts,
    ] {
        entries.sort_by_key(|&(r, c, _)| (c, r));
    }
    problem
}

/// The staggered method's own problem has its impulses, but not the solution.
#[test]
fn what_is_staggered_breaks_the_conditions_of_its_problem() {
    let mut stepper = moving(Grounded::Floor, 100.0, "staggered", 5);
    let problem = next_problem(&mut stepper);
    let results = solve::run(&problem, &info(&problem), Path::new("x"), &config());
    let records = results.expect("a sound problem").records;
    let of = |method: &str| records.iter().find(|r| r.method.starts_with(method));
    let (newton, staggered) = (of("newton").expect("a row"), of("stagg").expect("a row"));
    assert!(newton.complementarity < 1e-10, "{newton:?}");
    assert!(staggered.complementarity > 1e-3, "{staggered:?}");
    let [of_newton, own] = [newton, staggered].map(|r| r.velocity_error.expect("a reference"));
    assert!(own < 1e-6 && of_newton > 1e-3, "{own} {of_newton}");
    // More sweeps come closer to the condensed solution.
    let pgs = records.iter().filter(|r| r.method.starts_with("pgs"));
    let pgs: Vec<f64> = pgs.take(3).map(|r| r.complementarity).collect();
    assert!(pgs[0] > 1e3 * pgs[1] && pgs[1] >= pgs[2], "{pgs:?}");
    assert!(pgs[0] > 1e3 * newton.complementarity, "{pgs:?}");
}

#[test]
fn nothing_that_touches_has_no_problem() {
    let mut stepper = moving(Grounded::Floor, 10.0, "newton", 1);
    // The present state is not solved.
    assert_eq!(stepper.contact_problem(), None);
    let hoist = taut_model::HoistParams::default().build().expect("built");
    let mut stepper = Stepper::new(hoist, StepOptions::default()).expect("sound");
    stepper.solve().expect("solves");
    assert_eq!(stepper.contact_problem(), None);
}

/// A problem in `at` that all is well with.
fn sound(at: &Path) {
    let problem = next_problem(&mut moving(Grounded::Floor, 10.0, "newton", 2));
    files::write(&problem, &info(&problem), at, false).expect("written");
    files::read(at).expect("read");
}

/// Refused with the file that is at fault.
#[test]
fn files_that_make_no_problem_are_refused_by_name() {
    let at = folder("bad-contacts");
    sound(&at);
    let keep = |name: &str| fs::read_to_string(at.join(name)).expect("there");
    let vector = |name: &str, line: &str| {
        let lines = keep(name);
        let count = lines.lines().count();
        let changed = lines.lines().enumerate();
        let changed = changed.map(|(k, own)| if k + 1 == count { line } else { own });
        changed.collect::<Vec<_>>().join("\n")
    };
    let cases = [
        ("f.mtx", vector("f.mtx", "nan"), Fault::Value),
        ("f.mtx", vector("f.mtx", "1e999"), Fault::Value),
        (
            "b.mtx",
            "%%MatrixMarket matrix array real general\n2 1\n1\n2\n".to_owned(),
            Fault::Shape,
        ),
        ("w.mtx", vector("w.mtx", ""), Fault::Count),
        ("mu.mtx", vector("mu.mtx", "-0.1"), Fault::Value),
        ("Sigma_G.mtx", vector("Sigma_G.mtx", "-1"), Fault::Value),
        ("Sigma_H.mtx", vector("Sigma_H.mtx", "-1"), Fault::Value),
        ("H.mtx", vector("H.mtx", "99999 1 1.0"), Fault::Index),
        ("G.mtx", vector("G.mtx", "1 99999 1.0"), Fault::Index),
        ("M.mtx", vector("M.mtx", "0 1 1.0"), Fault::Index),
        (
            "G.mtx",
            "%%MatrixMarket matrix coordinate real general\n2 2 0\n".to_owned(),
            Fault::Shape,
        ),
    ];
    for (name, text, fault) in cases {
        let whole = keep(name);
        fs::write(at.join(name), &text).expect("written");
        let error = files::read(&at).expect_err(name);
        match error {
            ProblemError::Member(e) => {
                assert_eq!((e.fault, e.path.ends_with(name)), (fault, true), "{e}");
            }
            other => panic!("{name}: {other}"),
        }
        fs::write(at.join(name), whole).expect("written");
    }
    for name in ["M.mtx", "H.mtx", "w.mtx", "mu.mtx", "Sigma_H.mtx", "r.mtx"] {
        let whole = keep(name);
        fs::remove_file(at.join(name)).expect("removed");
        let error = files::read(&at).expect_err(name);
        let unreadable = matches!(&error, ProblemError::Member(e) if e.fault == Fault::Unreadable);
        assert!(unreadable && error.to_string().contains(name), "{error}");
        fs::write(at.join(name), whole).expect("written");
    }
    let whole = keep(files::INFO);
    for (from, to) in [
        ("spacedim = 3", "spacedim = 2"),
        ("spacedim", "dimension"),
        ("sizes = [", "sizes = [1.5, "),
        ("sizes = [", "sizes = ["),
    ] {
        let changed = if from == to {
            "title = \"x\"\nspacedim = 3\nsizes = [1, 0, 300000]\n".to_owned()
        } else {
            whole.replacen(from, to, 1)
        };
        fs::write(at.join(files::INFO), changed).expect("written");
        let error = files::read(&at).expect_err(to);
        assert!(matches!(error, ProblemError::Info { .. }), "{error}");
    }
    fs::remove_file(at.join(files::INFO)).expect("removed");
    assert!(matches!(files::read(&at), Err(ProblemError::None(_))));
    fs::remove_dir_all(&at).expect("removed");
}

/// Sizes that no files hold are refused before memory is asked for.
#[test]
fn sizes_that_promise_more_than_there_is_are_refused() {
    let at = folder("hollow-contacts");
    sound(&at);
    let info = "title = \"x\"\nspacedim = 3\nsizes = [999999999999, 0, 3]\n";
    fs::write(at.join(files::INFO), info).expect("written");
    let banner = "%%MatrixMarket matrix coordinate real general\n";
    for (name, columns) in [("M", 999_999_999_999_u64), ("G", 0), ("H", 3)] {
        let text = format!("{banner}999999999999 {columns} 0\n");
        fs::write(at.join(format!("{name}.mtx")), text).expect("written");
    }
    let error = files::read(&at).expect_err("hollow");
    assert!(error.to_string().contains("too few entries"), "{error}");
    fs::remove_dir_all(&at).expect("removed");
}

#[test]
fn an_inertia_that_is_none_is_refused() {
    let problem = next_problem(&mut moving(Grounded::Floor, 10.0, "newton", 2));
    let refused = |change: &dyn Fn(&mut ContactProblem)| {
        let mut changed = problem.clone();
        change(&mut changed);
        let results = solve::run(&changed, &info(&changed), Path::new("x"), &config());
        results.expect_err("refused").to_string()
    };
    let negative = refused(&|problem| problem.inertia[0].2 = -1.0);
    assert!(
        negative.contains("M.mtx") && negative.contains("positive"),
        "{negative}"
    );
    let joined = refused(&|problem| {
        let n = problem.impulse.len();
        problem.inertia.extend((1..n).map(|r| (r, r - 1, 1e-9)));
    });
    assert!(
        joined.contains("M.mtx") && joined.contains("64"),
        "{joined}"
    );
}
