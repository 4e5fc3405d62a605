use taut_measure::trajectory::steps_in;
use taut_output::check::UNCONVERGED;
use taut_studies::hard::solvers;
use taut_tests::prelude::*;
use taut_tests::scenes::{BALL, DRAWN, ball_jointed, copies, overstretched};

const DT: f64 = 1.0 / 60.0;

/// Relative bar of a force.
const BAR: f64 = 1e-8;

/// The force of each joint on the ball after a step, over its share of the weight.
fn shares(
    n: usize,
    compliance: f64,
    choice: &Choice,
) -> Result<(Vec<Vector3<f64>>, SolveReport), StepError> {
    let mut stepper = Stepper::new(copies(n, compliance), choice.plain_options(DT))?;
    let before = stepper.scene().clone();
    let said = stepper.step().map(|report| report.solve);
    // A refused step leaves the state as it was.
    assert!(said.is_ok() || *stepper.scene() == before, "{choice}");
    let said = said?;
    let rows = stepper.multipliers().chunks_exact(3);
    // Side a is the world.
    let share = |mu: &[f64]| -Vector3::from_column_slice(mu) * (n as f64 / BALL / DT);
    Ok((rows.map(share).collect(), said))
}

/// Largest distance of a share from 1 upwards and 0 sideways.
fn uneven(shares: &[Vector3<f64>]) -> f64 {
    let each = shares.iter().map(|s| (s - Vector3::z()).norm());
    each.fold(0.0, |m: f64, e| if e > m || e.is_nan() { e } else { m })
}

/// Whatever their compliance, m g/k each, which of all multipliers with this sum has the least norm. Of stiff copies
/// Gauss–Seidel joint by joint says that it has not come so far.
#[test]
fn a_doubled_compliant_joint_shares_the_weight() {
    for (n, compliance) in [(2, 1e-6), (3, 1e-6), (2, 1e-10), (3, 1e-10)] {
        for choice in solvers() {
            let place = format!("{n} × {choice}, {compliance:e} m/N");
            let (shares, said) = shares(n, compliance, &choice).expect("solvable");
            let sweeps = compliance < 1e-6 && choice.family() == "gauss-seidel:joints";
            let unfinished = sweeps && !said.is_claim();
            let bar = if unfinished { UNCONVERGED } else { BAR };
            assert!(uneven(&shares) <= bar, "{place}: {shares:?}");
        }
    }
}

/// Exact factorisations of S or of its groups refuse the joint; iterations without them find multipliers of the right
/// sum, of least norm those that stay in the range of S.
#[test]
fn a_doubled_rigid_joint_is_refused_by_name_or_solved_with_the_right_sum() {
    for (n, choice) in [2, 3]
        .into_iter()
        .flat_map(|n| solvers().into_iter().map(move |c| (n, c)))
    {
        let place = format!("{n} × {choice}");
        let family = choice.family();
        let iterates = ["gauss-seidel:joints", "cg:none", "cg:jacobi", "minres/kkt"];
        match shares(n, 0.0, &choice) {
            Err(StepError::Solve {
                source, culprit, ..
            }) => {
                assert!(!iterates.contains(&&*family), "{place}: {source}");
                assert_eq!(culprit.as_deref(), Some("copy-2"), "{place}");
                assert!(source.to_string().contains("singular"), "{place}: {source}");
            }
            Err(e) => panic!("{place}: {e}"),
            Ok((shares, _)) => {
                assert!(iterates.contains(&&*family), "{place}: {shares:?}");
                let mean = shares.iter().sum::<Vector3<f64>>() / n as f64;
                assert!((mean.z - 1.0).abs() <= BAR, "{place}: {shares:?}");
                let least_norm = family != "gauss-seidel:joints";
                assert_eq!(uneven(&shares) <= BAR, least_norm, "{place}: {shares:?}");
            }
        }
    }
}

/// Held at (1 + s) L the cable carries EA s: in equilibrium, and after forty damping times of a run from where it is
/// unstrained, which is straight, so that its steps are linear.
#[test]
fn an_overstretched_cable_is_drawn_to_ea_times_strain() {
    for (damping, seconds) in [(0.0, DT), (0.05, 2.0)] {
        let mut worst = Worst::default();
        for choice in solvers() {
            let mut cable = overstretched(Some(damping));
            cable.start_in_equilibrium = damping == 0.0;
            let mut stepper = Stepper::new(cable, choice.plain_options(DT)).expect("sound");
            for _ in 0..steps_in(seconds, DT) {
                stepper.step().unwrap_or_else(|e| panic!("{choice}: {e}"));
            }
            let rows = stepper.linearized();
            for c in 0..rows.constraints() {
                let mu = &stepper.multipliers()[rows.row_range(c)];
                let tension = Vector3::from_column_slice(&mu[..3]).norm() / DT;
                worst.see((tension / DRAWN - 1.0).abs(), &choice);
            }
        }
        assert!(worst.error() <= BAR, "damping {damping}: {worst:?}");
    }
}

/// No state meets the constraints of a rigid one. Iterations see it when what they have left to do is the same from sweep
/// to sweep.
#[test]
fn an_overstretched_rigid_cable_is_refused_by_every_solver() {
    for choice in solvers() {
        let backend = choice.backend.with_iterations(200);
        let choice = Choice {
            backend,
            form: choice.form,
        };
        for options in [choice.options(DT), choice.plain_options(DT)] {
            let mut stepper = Stepper::new(overstretched(None), options).expect("sound");
            let found = stepper.step().map(drop);
            let refused = matches!(found, Err(StepError::Solve { .. }));
            assert!(refused, "{choice}: {found:?}");
        }
    }
}

/// Where J has full rank S(ε) is regular at ε = 0, and μ(ε) = μ₀ − ε S₀⁻¹ μ₀/(w Δt²) + O(ε²): multipliers are bounded,
/// continuous, and differ from the rigid ones by a multiple of ε.
#[test]
fn joints_ever_stiffer_come_to_rigid_ones() {
    for choice in solvers() {
        let solve = |compliance: f64| {
            let scene = ball_jointed(compliance);
            let mut stepper = Stepper::new(scene, paper(&choice, DT)).expect("sound");
            let said = stepper.solve().unwrap_or_else(|e| panic!("{choice}: {e}"));
            (stepper.multipliers().to_vec(), said.solve, stepper)
        };
        let (rigid, said, mut stepper) = solve(0.0);
        let exact = stepper.reference_multipliers().expect("solvable");
        let error = forward_error(&rigid, &exact);
        assert!(error <= BAR || !said.is_claim(), "{choice}: {error:e}");
        let soft = (6..=16).map(|k| solve(10_f64.powi(-k)).0);
        let soft: Vec<Vec<f64>> = soft.collect();
        let mut bounded = soft.iter();
        let bounded = bounded.all(|mu| norm_inf(mu) <= 1.01 * norm_inf(&rigid));
        let mut differences: Vec<f64> = soft.iter().map(|mu| forward_error(mu, &rigid)).collect();
        // Above rounding, and small.
        differences.retain(|d| (1e-9..1e-2).contains(d));
        let mut orders = differences.windows(2).map(|w| (w[0] / w[1]).log10());
        let order = differences.len() > 1 && orders.all(|order| (order - 1.0).abs() <= 0.05);
        assert!(bounded && order, "{choice}: {differences:?}");
    }
}
