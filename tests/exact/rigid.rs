use taut_tests::prelude::*;
use taut_tests::scenes::rigid_chain;

const DT: f64 = 1.0 / 60.0;
const SEGMENT: f64 = 0.5;
/// Damping time of rigid rows: two to three time steps are advised.
const TAU: f64 = 2.5 * DT;

/// The chain of rigid ball joints with other laws, its anchor moved aside, its segments turning out of the plane.
fn chain(load: f64, law: RowLaw) -> Scene {
    let mut scene = rigid_chain(8, load);
    let moving = HoistParams::default()
        .with(|p| (p.segments, p.length, p.mass_ratio) = (8, 8.0 * SEGMENT, load))
        .with(|p| (p.joint, p.move_x, p.seed) = (JointKind::Spherical, 0.3, 3));
    let moving = moving.build().expect("sound parameters");
    scene.constraints = moving.constraints;
    scene.bodies.angular_velocity = moving.bodies.angular_velocity;
    for constraint in &mut scene.constraints {
        if let Constraint::Spherical(Spherical { stretch, .. }) = constraint {
            *stretch = law;
        }
    }
    scene
}

fn options(scheme: Scheme) -> StepOptions {
    StepOptions {
        scheme,
        stiffness: GeometricStiffness::inertia(scheme.default_alpha()),
        ..StepOptions::default()
    }
}

/// Path of the load, largest gap, steps redone.
fn path(
    scene: Scene,
    options: StepOptions,
    time: f64,
) -> Result<(Vec<Vector3<f64>>, f64, usize), StepError> {
    let (mut path, mut gap, mut redone) = (Vec::new(), 0.0_f64, 0);
    let steps = (time / options.dt).round() as usize;
    let mut stepper = Stepper::new(scene, options)?;
    for _ in 0..steps {
        redone += usize::from(stepper.step()?.redone);
        let rows = stepper.linearized();
        let gaps = (0..rows.constraints()).map(|c| {
            let phi = &rows.phi[rows.row_range(c)];
            Vector3::from_column_slice(&phi[..3]).norm()
        });
        gap = gap.max(gaps.fold(0.0, f64::max));
        path.push(stepper.scene().bodies.position[8]);
    }
    Ok((path, gap, redone))
}

/// Ratios with the largest gap over a segment's length that was measured: what a step's curvature opens. A chain that
/// carries little is thrown about.
const GAPS: [(f64, f64); 7] = [
    (1.0, 9.7e-4),
    (10.0, 1.7e-4),
    (1e2, 8.8e-6),
    (1e3, 6.8e-6),
    (1e4, 6.8e-6),
    (1e5, 6.8e-6),
    (1e6, 6.8e-6),
];

/// Compliance zero, at every ratio, for 5 s: nothing is lost and the joints stay closed.
#[test]
fn rigid_joints_stay_closed_at_every_mass_ratio() {
    for scheme in [Scheme::Spook, Scheme::default()] {
        for (load, measured) in GAPS {
            let scene = chain(load, RowLaw::new(0.0, TAU));
            let (path, gap, redone) = path(scene, options(scheme), 5.0).expect("stable");
            let place = format!("{scheme}, ratio {load:e}");
            assert_eq!(redone, 0, "{place}");
            // It swings, and does not fly.
            let reach = path.iter().map(|x| (x.x - 0.3).abs()).fold(0.0, f64::max);
            assert!(reach < 1.0 && reach > 0.05, "{place}: {reach}");
            let mut worst = Worst::default();
            worst.see(gap / SEGMENT, &place);
            worst.expect_measured("gap over a segment's length", measured);
        }
    }
}

/// The motion is continuous in ε at 0: trajectories differ by O(ε).
#[test]
fn the_rigid_limit_is_continuous() {
    for scheme in [Scheme::Spook, Scheme::default()] {
        for load in [1.0, 1e3] {
            let run = |compliance: f64| {
                let scene = chain(load, RowLaw::new(compliance / load, TAU));
                path(scene, options(scheme), 2.0).expect("stable").0
            };
            let rigid = run(0.0);
            let differences = [1e-5, 1e-6, 1e-7, 1e-8].map(|compliance| {
                let soft = run(compliance);
                let pairs = soft.iter().zip(&rigid);
                pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
            });
            println!("{scheme}, load {load}: {differences:?}");
            for pair in differences.windows(2) {
                let order = (pair[0] / pair[1]).log10();
                assert!((0.9..1.1).contains(&order), "{scheme}: {differences:?}");
            }
        }
    }
}
