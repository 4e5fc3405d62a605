//! Table II, Fig. 13, Fig. 16, in small.

use indicatif::ProgressBar;
use serde_json::Value;
use taut_output::check::{Check, Verdict};
use taut_studies::paper::{swing, table2, timing};
use taut_tests::With;

fn assert_no_failure(checks: &[Check]) {
    for check in checks {
        assert_ne!(check.verdict, Verdict::Fail, "{check:?}");
    }
}

fn assert_narrow(text: &str) {
    for line in text.lines() {
        assert!(line.chars().count() <= 120, "{line}");
    }
}

/// The paper's joint in the plane is lost where linear theory says, and in space far below; Gauss–Seidel with a light top
/// is lost where its gap is a segment; geometric stiffness holds every ratio.
#[test]
fn the_limits_of_table_2_are_those_of_theory() {
    let run = table2::run(&table2::cases(true), true, &ProgressBar::hidden());
    let records = run.expect("sound");
    assert_narrow(&table2::text_tables(&records, true));
    assert_no_failure(&table2::checks(&records, true));
    let cells = |ends: &str, setting: &str, solver: &str| {
        let is_it = |r: &&Value| {
            let own = r["solver"].as_str();
            let own = own.is_some_and(|own| own.starts_with(solver));
            own && r["ends"] == ends && r["setting"] == setting
        };
        let cells: Vec<_> = records.iter().filter(is_it).collect();
        assert_eq!(cells.len(), 2);
        cells
    };
    for twist in ["ord.", "alt."] {
        let planar = cells("heavy ends", &format!("planar {twist}"), "direct");
        let seeded = cells("heavy ends", &format!("seeded {twist}"), "direct");
        for (planar, seeded) in planar.into_iter().zip(seeded) {
            let [limit, theory] = ["stable", "predicted"].map(|key| planar[key].as_f64());
            let (limit, theory) = (limit.expect("1 is stable"), theory.expect("explicit"));
            // Rounded down to whole decades here; the heavy top adds a little to the theory of a uniform cable. In exactly planar
            // motion rounding alone excites what is unstable: with AVX2 a ratio of 10⁴ outlives a limit of 10^3.5.
            let decades = (theory / limit).log10();
            assert!((-0.5..1.0).contains(&decades), "{planar:?}");
            let found = seeded["stable"].as_f64().unwrap_or(0.1);
            assert!(found < limit, "{seeded:?}");
        }
    }
    // With heavy ends a few sweeps hold what the direct solver holds; with a light top they do not.
    let sweeps = ["Gauss–Seidel, 3 ", "Gauss–Seidel, 20 "];
    for solver in sweeps.into_iter().chain(["conjugate gradient", "direct"]) {
        let heavy = cells("heavy ends", "K", solver);
        assert!(heavy.iter().all(|r| r["capped"] == true));
    }
    for solver in sweeps {
        let light = cells("light top", "K", solver);
        assert!(light.iter().all(|r| r["capped"] == false));
    }
}

/// A step's time goes as the number of elements and does not depend on the load. Medians of short runs: the bars leave
/// room for what else the machine does.
#[test]
fn times_go_as_the_number_of_elements() {
    let records = timing::run(true, &ProgressBar::hidden()).expect("sound");
    assert_narrow(&timing::text_tables(&records));
    for sweeps in [3, 0] {
        let p = timing::growth(&records, sweeps);
        assert!((0.85..1.25).contains(&p), "{sweeps}: {p}");
    }
}

/// The modes at rest say what the paper's step takes from a swing; other steps take next to nothing.
#[test]
fn the_swing_loses_what_its_modes_say() {
    let config = swing::Config::new(true);
    let results = swing::run(&config, &ProgressBar::hidden()).expect("sound");
    assert_narrow(&swing::text_tables(&results, &config));
    assert_no_failure(&swing::checks(&results, &config));
    let error = |law: &Value| law["error"].as_f64().unwrap_or(f64::NAN);
    assert!(results.laws.iter().all(|law| error(law) < 1e-8));
}

/// The difference between prediction and run without bending is of second order: the linearised
/// gaps put it into the energy.
#[test]
fn the_energy_of_a_free_swing_is_kept_to_second_order() {
    let left = |dt: f64| {
        let config = swing::Config::new(true).with(|p| p.dt = dt);
        let results = swing::run(&config, &ProgressBar::hidden()).expect("sound");
        let is_free = |row: &&Value| row["run"] == "ball joints at the ends";
        let free = results.runs.iter().find(is_free).expect("ball joints");
        let [lost, predicted] = ["end", "end_predicted"].map(|key| free[key].as_f64());
        (lost.expect("lasts") - predicted.expect("the paper's step")).abs()
    };
    let [coarse, fine] = [1.0 / 60.0, 1.0 / 120.0].map(left);
    println!("left over at Δt and Δt/2: {coarse:.2e}, {fine:.2e}");
    assert!(fine < 0.5 * coarse, "{coarse:e} {fine:e}");
}
