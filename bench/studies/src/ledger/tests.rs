//! Scenes whose parts have a known worth.

use super::change::Change;
use super::*;
use taut_integrator::{GeometricStiffness, Scheme, StepOptions};
use taut_measure::lean::Part;

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
    let runs = [&question.whole, &lean.expect("has it")].map(|setup| question.once(setup, 1e3));
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

/// A specimen that begins straight under a small load: what its rows hold, moves freely without them.
#[test]
fn bending_of_a_cantilever_and_torsion_of_a_twisted_specimen_are_worth_all_of_it() {
    for (name, load, part) in [
        ("bend", "moment", Part::Bending),
        ("twist", "torque", Part::Torsion),
    ] {
        let straight = [("segments", "8"), ("equilibrium", "false"), (load, "1e-3")];
        let question = question(setup(name, &straight), 0.05);
        let own = question.once(&question.whole, 1e3);
        let (begin, end) = (own.poses[0].1, own.poses[own.poses.len() - 1].1);
        let held = own.lever * end.angle_to(&begin);
        let worth = worth(&question, part);
        let holds = worth > 100.0 * held && worth > 1e-4;
        assert!(holds, "{name}: {worth}, {held}");
    }
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
        let [phase, damping] = row.predicted.expect("a law");
        near(row.measured[0], phase);
        assert!((row.measured[1] - damping).abs() < 0.05 * damping + 1e-9);
    }
    // Roots to leading order: x taken at x + a δ²x + γ δ³x, and at x alone.
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
    assert!(found.lean.keeps, "{:?}", found.lean);
    assert!(!found.left_out.is_empty() && found.lean.rows < found.whole.rows);
    let text = found.setup.source.to_commented_toml().expect("text");
    let again = Setup {
        source: SceneSource::parse(&text, &[]).expect("read"),
        options: found.setup.options.clone(),
    };
    let [written, ran] = [&again, &found.setup].map(|setup| question.once(setup, 1e3).poses);
    assert!(written == ran);
}

#[test]
fn a_scene_that_is_lost_has_no_ledger() {
    let mut whole = setup("hoist", &[("initial_angle", "1.5"), ("mass_ratio", "1e6")]);
    whole.options.guard = None;
    whole.options.stiffness = GeometricStiffness::Off;
    let error = ledger(&question(whole, 2.0), &ProgressBar::hidden());
    let error = error.expect_err("lost").to_string();
    let says = error.starts_with("the whole scene does not run to its end: ");
    assert!(says, "{error}");
}

#[test]
fn what_the_motion_did_without_is_not_left_out() {
    // A second before it lands.
    let landing = include_str!("../../../../integrator/examples/landing.toml");
    let whole = Setup {
        source: SceneSource::parse(landing, &[]).expect("a scene"),
        options: StepOptions::default(),
    };
    let question = Question {
        tolerance: 1e-2,
        ..question(whole, 1.0)
    };
    let found = ledger(&question, &ProgressBar::hidden()).expect("runs");
    for what in ["no contacts", "no guard"] {
        let line = found.lines.iter().find(|line| line.what == what);
        let line = line.expect("a line");
        assert!(line.keeps && !line.used, "{line:?}");
        assert!(!found.left_out.iter().any(|left| left == what));
    }
}

/// Scenes that have no law, and those without oscillations, have a ledger too.
#[test]
fn modes_never_end_a_ledger() {
    for (name, overrides) in [
        ("tackle", &[("friction", "0")][..]),
        ("net", &[]),
        ("twist", &[]),
    ] {
        // Rows or a reason.
        let _ = modes::rows(&setup(name, overrides)).map(|rows| rows.len());
    }
    let driven = "body = [{ name = \"a\", mobility = \"driven\" }]\nload = \"a\"";
    let whole = Setup {
        source: SceneSource::parse(driven, &[]).expect("a scene"),
        options: StepOptions::default(),
    };
    assert!(modes::rows(&whole).is_err());
    let error = ledger(&question(whole, 1.0), &ProgressBar::hidden()).expect_err("no load");
    let says = error.to_string().contains("no load that forces move");
    assert!(says, "{error}");
}
