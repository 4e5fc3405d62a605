//! Scenes whose parts have a known worth.

use super::change::Change;
use super::*;
use taut_integrator::{GeometricStiffness, Scheme, StepOptions};
use taut_model::scene_file::Part;

fn setup(name: &str, overrides: &[(&str, &str)]) -> Setup {
    Setup {
        source: SceneSource::load(name, overrides).expect("known"),
        options: StepOptions::default(),
    }
}

fn question(whole: Setup, time: f64) -> Question {
    Question {
        whole,
        controls: None,
        tolerance: 1e-3,
        time,
    }
}

/// How far the load goes without a part \[m].
fn worth(question: &Question, part: Part) -> f64 {
    let lean = Change::Without(part).apply(&question.whole).expect("sound");
    let runs = [&question.whole, &lean.expect("has it")].map(|setup| question.once(setup));
    runs[1].apart(&runs[0]).expect("run to their ends")
}

#[test]
fn torsion_and_bending_of_a_straight_hanging_cable_are_worth_nothing() {
    let question = question(setup("hoist", &[("segments", "8")]), 1.0);
    for part in [Part::Torsion, Part::Bending] {
        let worth = worth(&question, part);
        assert!(worth < 1e-12, "{part:?}: {worth}");
    }
}

#[test]
fn bending_of_a_cantilever_is_worth_all_of_it() {
    let question = question(setup("bend", &[("segments", "8"), ("moment", "20")]), 0.2);
    let lean = Change::Without(Part::Bending).apply(&question.whole);
    let lean = lean.expect("sound").expect("has it");
    let bent = question.once(&question.whole);
    let [whole, lean] = [&bent, &question.once(&lean)].map(|run| run.failure.clone());
    assert_eq!(whole, None);
    // Nothing holds the chain against the moment.
    assert!(lean.is_some() || worth(&question, Part::Bending) > 0.1);
    assert!(bent.poses[0].1.angle() > 1e-3);
}

#[test]
fn torsion_of_a_twisted_specimen_is_worth_its_turn() {
    let question = question(setup("twist", &[("segments", "8")]), 0.2);
    let run = question.once(&question.whole);
    let turn = run.lever * run.poses[0].1.angle();
    assert!(turn > 0.0 && run.failure.is_none());
    let lean = Change::Without(Part::Torsion).apply(&question.whole);
    let lean = question.once(&lean.expect("sound").expect("has it"));
    assert!(lean.failure.is_some() || lean.apart(&run).expect("run") > 0.5 * turn);
}

/// The slowest oscillation of a load on a cable, a swing.
fn swing(scheme: Scheme, stiffness: GeometricStiffness) -> modes::Row {
    let mut swing = setup("hoist", &[("segments", "6"), ("mass_ratio", "100")]);
    swing.options.scheme = scheme;
    swing.options.stiffness = stiffness;
    let rows = modes::rows(&swing).expect("modes");
    *rows.first().expect("a swing")
}

#[test]
fn a_swing_has_the_phase_error_and_the_damping_of_its_scheme() {
    let near = |ours: f64, exact: f64| assert!((ours / exact - 1.0).abs() < 0.05, "{ours} {exact}");
    for scheme in Scheme::KINDS {
        let row = swing(scheme, GeometricStiffness::inertia(scheme.default_alpha()));
        near(row.omega, (9.81_f64 / 10.0).sqrt());
        near(row.measured[0], row.predicted[0]);
        assert!((row.measured[1] - row.predicted[1]).abs() < 0.05 * row.predicted[1] + 1e-9);
    }
    // What the roots are to leading order: x taken at x + a δ²x + γ δ³x, and at x alone.
    let Scheme::ThirdDifference { a, gamma } = Scheme::THIRD_DIFFERENCE else {
        panic!("the default scheme");
    };
    let row = swing(Scheme::THIRD_DIFFERENCE, GeometricStiffness::inertia(0.4));
    let phase = row.omega * StepOptions::default().dt;
    near(row.measured[0], (1.0 / 24.0 - 0.5 * a) * phase.powi(2));
    near(row.measured[1], 0.5 * gamma.abs() * phase.powi(4));
    let row = swing(Scheme::THIRD_DIFFERENCE, GeometricStiffness::Off);
    near(row.measured[0], phase.powi(2) / 24.0);
    assert!(row.measured[1].abs() < 1e-9, "{row:?}");
}

#[test]
fn the_lean_scene_keeps_the_tolerance_and_is_read_back_as_it_ran() {
    let whole = setup(
        "hoist",
        &[
            ("segments", "12"),
            ("initial_angle", "0.1"),
            ("equilibrium", "true"),
            ("move_x", "0.5"),
        ],
    );
    let question = Question {
        tolerance: 1e-2,
        ..question(whole, 2.0)
    };
    let found = ledger(&question, &ProgressBar::hidden()).expect("runs");
    assert!(found.lean.may_go, "{:?}", found.lean);
    assert!(!found.left_out.is_empty() && found.lean.rows < found.whole.rows);
    let text = found.setup.source.to_commented_toml().expect("text");
    let again = Setup {
        source: SceneSource::parse(&text, &[]).expect("read"),
        options: found.setup.options.clone(),
    };
    let [written, ran] = [&again, &found.setup].map(|setup| question.once(setup).poses);
    assert!(written == ran);
}

#[test]
fn a_scene_that_is_lost_has_no_ledger() {
    let mut whole = setup("hoist", &[("initial_angle", "1.5"), ("mass_ratio", "1e6")]);
    whole.options.guard = None;
    whole.options.stiffness = GeometricStiffness::Off;
    let error = ledger(&question(whole, 2.0), &ProgressBar::hidden());
    let error = error.err().expect("lost").to_string();
    assert!(
        error.starts_with("the whole scene does not run to its end: "),
        "{error}"
    );
}
