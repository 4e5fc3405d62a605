use taut_tests::prelude::*;
use taut_tests::scenes::{Pose, hoist};

const DT: f64 = 1.0 / 60.0;
const RATIOS: [f64; 6] = [1.0, 10.0, 1e2, 1e3, 1e4, 1e5];
const SEGMENTS: [usize; 2] = [8, 24];
const SCENES: [(&str, JointKind, Pose); 6] = [
    ("spherical-straight", JointKind::Spherical, Pose::Straight),
    ("spherical-bent", JointKind::Spherical, Pose::Bent),
    ("cosserat-straight", JointKind::Cosserat, Pose::Straight),
    ("cosserat-bent", JointKind::Cosserat, Pose::Bent),
    ("paper-straight", JointKind::Paper, Pose::Straight),
    ("paper-bent", JointKind::Paper, Pose::Bent),
];

/// Forward errors of the multipliers as they were measured: scene, solver, refinements, one column for each ratio.
const MEASURED: &str = include_str!("scenes.txt");

/// The solver with enough iterations to converge, where it iterates.
fn patient(choice: &Choice) -> Choice {
    Choice {
        backend: choice.backend.with_iterations(20_000).with_tolerance(1e-10),
        form: choice.form,
    }
}

/// Solvers that end in reasonable time: sweeps grow with the mass ratio, and with the square of the
/// number of segments where stiff bending couples them.
fn feasible(choice: &Choice, joint: JointKind, ratio: f64) -> bool {
    choice.backend.name() != "gauss-seidel" || (joint == JointKind::Spherical && ratio <= 10.0)
}

/// Largest forward error over the numbers of segments; `None` where the solver is left out.
fn measure(
    (_, joint, pose): (&str, JointKind, Pose),
    choice: &Choice,
    refinements: usize,
    ratio: f64,
) -> Option<f64> {
    let choice = patient(choice);
    if !feasible(&choice, joint, ratio) {
        return None;
    }
    let errors = SEGMENTS.map(|segments| {
        let options = choice.options(DT).with(|o| o.refinements = refinements);
        let scene = hoist(joint, pose, segments, ratio);
        let tension = tension(&scene);
        let mut stepper = Stepper::new(scene, options).expect("sound");
        assert!(tension.iter().all(|t| t.is_finite()), "{joint:?}");
        stepper.set_tension(&tension).expect("as many rows");
        let exact = stepper.reference_multipliers().expect("solvable");
        let report = stepper.solve().expect("solvable");
        let place = format!("{joint:?}, {pose:?}, {segments} segments, {choice}, ratio {ratio:e}");
        if choice.backend.is_iterative() {
            // The claimed residual is that of the system the solver was given.
            let what = format!("{place}: {report:?}");
            assert_eq!(report.solve.status, Status::Converged, "{what}");
            let (a, b, x) = stepper.system();
            let r = norm(&residual(a, b, x).expect("lengths fit")) / norm(b);
            assert!(r <= 1e-10 * (1.0 + 1e-6), "{place}: {r:e}");
        }
        let error = forward_error(stepper.multipliers(), &exact);
        assert!(error.is_finite() && norm_inf(&exact) > 0.0, "{place}");
        error
    });
    Some(errors[0].max(errors[1]))
}

/// The tension that the pose has, λ = −φ/ε: the geometric stiffness of every solver is made of the same.
fn tension(scene: &Scene) -> Vec<f64> {
    let mut rows = Linearized::new(scene);
    rows.update(scene, 0.0);
    let laws = rows.phi.iter().zip(&rows.compliance);
    laws.map(|(phi, compliance)| -phi / compliance).collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Calls `each(key, errors)` for each row of the table that this build can measure.
fn rows(mut each: impl FnMut(String, Vec<Option<f64>>)) {
    for scene in SCENES {
        for choice in compiled() {
            let most = usize::from(!choice.backend.is_iterative());
            for refinements in 0..=most {
                let errors = RATIOS.map(|ratio| measure(scene, &choice, refinements, ratio));
                let key = format!("{:18} {:22} {refinements}", scene.0, choice.family());
                each(key, errors.to_vec());
            }
        }
    }
}

/// Every solver that is compiled in, on every scene, within ten times of what was measured for it there.
#[test]
fn every_solver_agrees_with_the_reference_multipliers() {
    let mut faults = Vec::new();
    rows(|key, errors| {
        let words: Vec<&str> = key.split_whitespace().collect();
        let row = MEASURED.lines().find_map(|line| {
            let line: Vec<&str> = line.split_whitespace().collect();
            line.starts_with(&words)
                .then(|| line[words.len()..].to_vec())
        });
        let row = row.unwrap_or_else(|| panic!("no row `{key}` in scenes.txt"));
        assert_eq!(row.len(), RATIOS.len(), "{key}");
        for ((error, measured), ratio) in errors.into_iter().zip(row).zip(RATIOS) {
            let Some(error) = error else {
                assert_eq!(measured, "-", "{key}");
                continue;
            };
            let measured: f64 = measured.parse().unwrap_or_else(|e| panic!("{key}: {e}"));
            if error.is_nan() || error > allowed(measured) {
                faults.push(format!(
                    "{key}, ratio {ratio:e}: {error:.1e}, was {measured:.1e}"
                ));
            }
        }
    });
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Refined once, both forms are at roundoff, although forming S loses up to 10⁻¹⁰ where a heavy
/// load's tension makes thin segments 10⁷ times easier to turn about their axes than across.
#[test]
fn the_table_allows_refined_solvers_little_more_than_roundoff() {
    let mut rows = 0;
    for line in MEASURED.lines().filter(|l| !l.starts_with('#')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        if words[2] == "1" {
            let errors = words[3..].iter();
            let errors = errors.map(|w| w.parse::<f64>().expect("a number"));
            assert!(errors.fold(0.0, f64::max) <= 1.2e-15, "{line}");
            rows += 1;
        }
    }
    let what = "every direct solver has a row in every scene";
    assert_eq!(rows, 12 * SCENES.len(), "{what}");
}

/// Writes the table anew: `cargo test -p taut-tests --features umfpack --test all -- --ignored --nocapture table`.
#[test]
#[ignore = "prints what scenes.txt holds"]
fn print_the_table() {
    println!(
        "# {:16} {:22} refinements, ratios {RATIOS:?}",
        "scene", "solver"
    );
    rows(|key, errors| {
        let columns = errors.iter();
        let columns = columns.map(|e| e.map_or("      -".to_owned(), |e| format!("{e:.1e}")));
        println!("{key} {}", columns.collect::<Vec<_>>().join(" "));
    });
}
