use taut_tests::graphs::{ladder, net, parts, rings, star, tree};
use taut_tests::prelude::*;

const DT: f64 = 1.0 / 60.0;
const KINDS: [&str; 2] = ["spherical", "cosserat"];

fn scenes(kind: &str) -> [(&'static str, Scene); 6] {
    [
        ("Y", star(kind, 3, 4)),
        ("ring", rings(kind, 1, 8)),
        ("two rings", rings(kind, 2, 6)),
        ("net", net(kind, 6)),
        ("parts", parts(kind)),
        ("tree", tree(kind, 15, 2)),
    ]
}

fn options(choice: &Choice, elimination: Elimination) -> StepOptions {
    choice.options(DT).with(|o| o.elimination = elimination)
}

fn order(scene: &Scene, elimination: Elimination) -> EliminationOrder {
    let options = StepOptions::default().with(|o| o.elimination = elimination);
    let stepper = Stepper::new(scene.clone(), options).expect("sound");
    stepper.elimination().clone()
}

fn flops(scene: &Scene, elimination: Elimination) -> u64 {
    order(scene, elimination).cost.expect("few").flops
}

/// Rows of the border of `banded` in an order; more than any where it has none.
fn border_rows(scene: &Scene, elimination: Elimination) -> usize {
    let options = StepOptions::default().with(|o| o.elimination = elimination);
    let stepper = Stepper::new(scene.clone(), options).expect("sound");
    let pattern = stepper.system().0.pattern().clone();
    let as_it_is: Vec<usize> = (0..pattern.blocks()).collect();
    let rows = Backend::Banded.border_rows(&pattern, &as_it_is);
    rows.expect("an order").unwrap_or(usize::MAX)
}

/// Every direct solver, in both forms and every order, after one refinement; and the order is what it is called.
#[test]
fn direct_solvers_agree_in_every_order() {
    let [mut schur, mut kkt] = [(); 2].map(|()| Worst::default());
    for kind in KINDS {
        for (name, scene) in scenes(kind) {
            for elimination in Elimination::ALL {
                for choice in compiled_direct() {
                    let place = format!("{name} of {kind} joints, {choice}, {elimination}");
                    let options = options(&choice, elimination);
                    let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
                    let exact = stepper.reference_multipliers().expect("solvable");
                    stepper.solve().unwrap_or_else(|e| panic!("{place}: {e}"));
                    let error = forward_error(stepper.multipliers(), &exact);
                    match choice.form {
                        Form::Kkt => kkt.see(error, &place),
                        _ => schur.see(error, &place),
                    }
                    let taken = stepper.elimination().taken;
                    let asked = [taken, Elimination::Auto].contains(&elimination);
                    assert!(asked && taken != Elimination::Auto, "{place}: {taken}");
                    // The solution is left in the order of the system.
                    let (a, b, x) = stepper.system();
                    let error = backward_error(a, b, x).expect("lengths fit");
                    assert!(error.normwise < 1e-13, "{place}: {error:?}");
                }
            }
        }
    }
    schur.expect_measured("multipliers from S", 7.3e-16);
    kkt.expect_measured("multipliers from the KKT matrix", 6.4e-16);
}

/// Iterations, over joints and over the groups of the topology, in every order.
#[test]
fn iterative_solvers_agree_in_every_order() {
    let [mut sweeps, mut gradients, mut residuals] = [(); 3].map(|()| Worst::default());
    for (name, scene) in scenes("spherical") {
        for elimination in Elimination::ALL {
            for choice in compiled().into_iter().filter(|c| c.backend.is_iterative()) {
                let place = format!("{name}, {choice}, {elimination}");
                // Rounding leaves more of a residual of the KKT matrix.
                let tolerance = match choice.form {
                    Form::Kkt => 1e-10,
                    _ => 1e-12,
                };
                let backend = choice.backend.with_iterations(20_000);
                let patient = Choice {
                    backend: backend.with_tolerance(tolerance),
                    form: choice.form,
                };
                let options = options(&patient, elimination);
                let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
                let exact = stepper.reference_multipliers().expect("solvable");
                let report = stepper.solve().unwrap_or_else(|e| panic!("{place}: {e}"));
                assert_eq!(report.solve.status, Status::Converged, "{place}");
                let error = forward_error(stepper.multipliers(), &exact);
                match choice.backend.name() {
                    "cg" => gradients.see(error, &place),
                    "minres" => residuals.see(error, &place),
                    _ => sweeps.see(error, &place),
                }
            }
        }
    }
    sweeps.expect_measured("Gauss–Seidel", 9.3e-12);
    gradients.expect_measured("conjugate gradient", 1.2e-12);
    residuals.expect_measured("MINRES", 5.0e-9);
}

/// Where the groups are a forest each, their exact solves are the whole solve: one iteration of what would take hundreds.
#[test]
fn groups_of_the_topology_are_solved_at_once() {
    for name in ["cg:group", "gauss-seidel:groups"] {
        let choice: Choice = name.parse().expect("a known name");
        if choice.check().is_err() {
            continue;
        }
        for (name, scene) in [("Y", star("cosserat", 3, 20)), ("parts", parts("cosserat"))] {
            let options = options(&choice, Elimination::Auto);
            let mut stepper = Stepper::new(scene.clone(), options).expect("sound");
            let report = stepper.solve().expect("solvable");
            assert!(report.solve.iterations <= 4, "{name}, {choice}: {report:?}");
        }
        // A ring's closing joint has six rows: as many iterations beyond those at most, and no more for a longer ring.
        if choice.backend.name() == "cg" {
            for n in [20, 200] {
                let options = options(&choice, Elimination::Auto);
                let mut stepper = Stepper::new(rings("cosserat", 1, n), options).expect("sound");
                let report = stepper.solve().expect("solvable");
                assert!(report.solve.iterations <= 20, "{n} bodies: {report:?}");
            }
        }
    }
}

/// The constraint that a solver's error names is the one at that block, whatever the order.
#[test]
fn a_redundant_constraint_is_named_in_every_order() {
    for choice in ["banded", "banded/kkt"] {
        let choice: Choice = choice.parse().expect("a known name");
        if choice.check().is_err() {
            continue;
        }
        for elimination in Elimination::ALL {
            // A rigid joint twice, the second of them first in the scene.
            let mut scene = star("spherical", 3, 3);
            let rigid = taut_model::RowLaw::RIGID;
            let taut_model::Constraint::Spherical(joint) = &mut scene.constraints[5] else {
                panic!("joints are spherical");
            };
            joint.stretch = rigid;
            let again = scene.constraints[5].clone();
            let original = scene.constraint_names[5].clone();
            scene.add_constraint("again", again, 0);
            let mut stepper = Stepper::new(scene, options(&choice, elimination)).expect("sound");
            let error = stepper.solve().expect_err("redundant").to_string();
            let named = ["again", &original].map(|name| error.contains(&format!("`{name}`")));
            assert_ne!(named, [false; 2], "{choice}, {elimination}: {error}");
        }
    }
}

/// Orders of the scene and by minimum degree, with 6 rows a joint. The shorter border wins, then the scene's order where
/// there is one, else the fewer operations.
#[test]
fn the_automatic_order_has_the_shorter_border_or_is_the_cheaper() {
    let scenes = [
        ("ring of 1000", rings("cosserat", 1, 1000)),
        ("Y of 3 × 300", star("cosserat", 3, 300)),
        ("net of 20 × 20", net("cosserat", 20)),
        ("ladder of 8 × 24", ladder("cosserat", 8, 24)),
    ];
    for (name, scene) in scenes {
        let listed = [Elimination::Scene, Elimination::MinimumDegree];
        let auto = order(&scene, Elimination::Auto);
        let best = listed.into_iter().min_by_key(|&taken| {
            let (border, flops) = (border_rows(&scene, taken), flops(&scene, taken));
            println!("{name}, {taken}: {border} {flops}; {}", auto.taken);
            (border, if border < usize::MAX { 0 } else { flops })
        });
        assert_eq!(Some(auto.taken), best, "{name}");
    }
}
