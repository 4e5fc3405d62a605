//! H43: where angles are singular: straight joints, the fold, twists of ±π and many turns.
//!
//! The Jacobian of every joint that measures angles is compared with differences in 32 digits ([`joints`]), at bends
//! from 10⁻¹² to π − 10⁻⁹. A row that is an angle without sign, as the paper's bend and the angle of two links are,
//! has the gradient n, the direction of the axis, which rounding of the axes turns by 10⁻¹⁶/sin θ: there is no
//! Jacobian to converge to where θ → 0, and the paper's safeguard s₀ adds s₀/(s₀ + sin θ). Rows that have a sign, or
//! two of them, are smooth at θ = 0; at the fold all of them end, but Jacobians are right up to it.
//!
//! Then motions: a torsion pendulum of 3½ turns to each side, whose law is a sine, and a joint that is whirled through
//! its fold, where the shortest way from u_a to u_b changes sides and the torque its sign. The energy ½ θ²/ε goes on
//! there; what a step that crosses the fold makes of it is of the order of Δt.

mod extended;
pub mod joints;

use crate::hard::{at, either, grid, worse};
use indicatif::ProgressBar;
use joints::{Kind, Pose, jacobian_error, pair, sensitivity};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Cosserat, Frame, Hinge, JointLaw, Motor, Paper, RowLaw, Scene, Target,
};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};

/// Error of a Jacobian, relative to the largest entry of its row.
pub const BAR: f64 = 1e-6;

/// Relative bar of the torsion pendulum's amplitude and period.
const PENDULUM_BAR: f64 = 1e-2;

/// Turns of the torsion pendulum to each side, its period, and how long it swings \[s].
const TURNS: f64 = 3.5;
const PERIOD: f64 = 4.0;
const PENDULUM_TIME: f64 = 12.0;

/// Time of the whirl \[s].
const WHIRL_TIME: f64 = 4.0;

/// Bends: distances from 0, and from π.
fn bends() -> Vec<f64> {
    let open = [1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 2.0, 3.0];
    let near_fold = [1e-3, 1e-6, 1e-9].map(|d| PI - d);
    [&open[..], &near_fold].concat()
}

fn poses(quick: bool) -> Vec<Pose> {
    let twists = [0.3, -1.1, PI - 1e-9, 1e-9 - PI, 2.9, 0.0];
    let pose = |(i, twist): (usize, f64)| {
        let k = i as f64;
        let axis = Vector3::new((3.0 * k).cos(), (5.0 * k).sin(), 0.3 + k.cos());
        Pose {
            turn: UnitQuaternion::from_scaled_axis(axis * (0.4 + k)),
            across: 1.7 * k - 2.0,
            twist,
        }
    };
    let count = either(quick, 3, twists.len());
    let some = twists.into_iter().enumerate().take(count);
    some.map(pose).collect()
}

/// A cable joint at the edge of each regime, in motion.
pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let at = |theta: f64| {
        let mut scene = pair(Kind::Cosserat, theta, &poses(true)[0]);
        scene.name = format!("bend {theta:.3}");
        scene.add_constraint("held", Kind::Cosserat.constraint(frames()), 0);
        scene.bodies.angular_velocity[1] = Vector3::new(0.3, 0.2, -0.1);
        scene
    };
    Ok(vec![at(1e-9), at(1.0), at(PI - 1e-3), whirl()])
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let (bends, poses) = (bends(), poses(quick));
    progress.set_length(Kind::ALL.len() as u64);
    let row = |kind: &Kind| -> Vec<f64> {
        let worst = |&theta: &f64| {
            let errors = poses.iter().map(|p| jacobian_error(*kind, theta, p));
            errors.fold(0.0, worse)
        };
        let row = bends.iter().map(worst).collect();
        progress.inc(1);
        row
    };
    let errors: Vec<Vec<f64>> = Kind::ALL.par_iter().map(row).collect();
    let judged = Kind::ALL.iter().zip(&errors);
    let judged = judged.map(|(&kind, errors)| jacobian_check(kind, &bends, errors, &poses));
    let mut checks: Vec<Check> = judged.collect();
    for kind in [Kind::Cosserat, Kind::Hinge, Kind::PaperTwist] {
        checks.extend(pendulum(kind)?);
    }
    checks.extend(whirled(quick));
    Ok(Outcome {
        checks,
        text: tables(&bends, &errors),
        ..Outcome::default()
    })
}

fn shown(theta: f64) -> String {
    if PI - theta < 0.01 {
        format!("π−{:.0e}", PI - theta)
    } else if theta < 0.01 {
        format!("{theta:.0e}")
    } else {
        format!("{theta}")
    }
}

fn tables(bends: &[f64], errors: &[Vec<f64>]) -> String {
    let heads: Vec<String> = bends.iter().map(|&t| shown(t)).collect();
    let rows = Kind::ALL.iter().zip(errors).map(|(kind, errors)| {
        // One digit: eleven columns have to find room.
        let cells = errors.iter().map(|e| format!("{e:.0e}")).collect();
        (kind.name().to_owned(), cells)
    });
    let grid = grid("Jacobian, bend", &heads, rows);
    format!(
        "Errors of Jacobians against differences in 32 digits, relative to the largest entry of the row\n{grid}\n"
    )
}

fn jacobian_check(kind: Kind, bends: &[f64], errors: &[f64], poses: &[Pose]) -> Check {
    let pairs = || bends.iter().copied().zip(errors.iter().copied());
    let error = errors.iter().copied().fold(0.0, worse);
    let is_it = |p: &(f64, f64)| p.1 == error || p.1.is_nan();
    let at = pairs().rfind(is_it).map_or(f64::NAN, |p| p.0);
    let ours = format!("{error:.1e} at {}", shown(at));
    let case = format!("Jacobian, {}", kind.name());
    let mut check = Check::within(case, "differences in 32 digits", ours, error, BAR)
        .by("largest over angles of 10⁻¹² to π − 10⁻⁹, twists to ±π and poses");
    if check.verdict != Verdict::Fail {
        return check;
    }
    let excused = if kind.loses_direction() {
        // Where the row has a direction it has to be the right one.
        let resolved = pairs().filter(|(theta, _)| theta.min(PI - theta) >= 1e-6);
        let elsewhere = resolved.map(|p| p.1).fold(0.0, worse);
        check.note = format!(
            "an angle without sign: its gradient is a direction that is lost to the rounding of the axes where \
             the angle vanishes, and the paper's s₀ = 10⁻¹⁴ besides; {elsewhere:.0e} at distances of 10⁻⁶ and more"
        );
        elsewhere <= BAR
    } else {
        let rounding = poses.iter().map(|p| sensitivity(kind, at, p));
        let rounding = rounding.fold(0.0, f64::max);
        check.note = format!(
            "there a rounding of one coordinate of the middle point changes the exact Jacobian by {rounding:.1e}"
        );
        // It goes through some ten roundings on the way.
        error <= 10.0 * rounding
    };
    if excused {
        check.verdict = Verdict::Limit;
    }
    check
}

/// A ball on a joint at its centre.
fn ball(constraint: Constraint, spin: Vector3<f64>) -> Scene {
    let mut scene = Scene::new("ball");
    let mut body = Body::sphere(RADIUS, 1.0);
    body.angular_velocity = spin;
    scene.add_body("ball", body);
    scene.add_constraint("joint", constraint, 0);
    scene
}

/// Radius of the ball and its inertia \[m, kg m²].
const RADIUS: f64 = 0.5;
const INERTIA: f64 = 0.4 * RADIUS * RADIUS;

fn frames() -> [Frame; 2] {
    let at = |frame: Frame| frame.with_axes(Matrix3::identity());
    [
        at(Frame::world(Vector3::zeros())),
        at(Frame::body(0, Vector3::zeros())),
    ]
}

/// The turn of the joint with its winding.
fn turned(constraint: &Constraint) -> f64 {
    match constraint {
        Constraint::Cosserat(c) => c.twist_reference,
        Constraint::Hinge(h) => h.angle_reference,
        Constraint::Paper(p) => p.twist_reference,
        _ => f64::NAN,
    }
}

/// Amplitude and period of a torsion pendulum of many turns, each of them a row.
fn pendulum(kind: Kind) -> Result<Vec<Check>, StepError> {
    let rate = TAU / PERIOD;
    let law = RowLaw::new(1.0 / (INERTIA * rate * rate), 0.0);
    let held = JointLaw {
        stretch: Some(RowLaw::RIGID),
        bend: (kind == Kind::Cosserat).then_some(RowLaw::RIGID),
        twist: Some(law),
    };
    let constraint = match kind {
        Kind::Hinge => Constraint::Hinge(Hinge {
            motor: Some(Motor {
                target: Target::Position(0.0),
                law,
                ..Motor::speed(0.0)
            }),
            ..Hinge::new(frames())
        }),
        Kind::Cosserat => Constraint::Cosserat(Cosserat::new(frames(), held)),
        _ => Constraint::Paper(Paper::new(frames(), held)),
    };
    let amplitude = TURNS * TAU;
    let scene = ball(constraint, Vector3::x() * (amplitude * rate));
    let options = StepOptions::default();
    let dt = options.dt;
    let mut stepper = Stepper::new(scene, options)?;
    let (mut largest, mut crossings, mut before) = (0.0_f64, Vec::new(), 0.0);
    for step in 1..=taut_ground::trajectory::steps_in(PENDULUM_TIME, dt) {
        stepper.step()?;
        let now = turned(&stepper.scene().constraints[0]);
        largest = worse(largest, now.abs());
        if before < 0.0 && now >= 0.0 {
            crossings.push(dt * (step as f64 - now / (now - before)));
        }
        before = now;
    }
    let span = crossings.first().zip(crossings.last());
    let period = span.map_or(f64::NAN, |(a, b)| (b - a) / (crossings.len() - 1) as f64);
    let row = |what: &str, exact: f64, found: f64, unit| {
        let case = format!("{what} of ±{TURNS} turns, {}", kind.name());
        Check::relative(case, [exact, found], unit, PENDULUM_BAR)
            .by("torsion pendulum at Δt = 1/60 s, relative")
    };
    Ok(vec![
        row("amplitude", amplitude, largest, "rad"),
        row("period", PERIOD, period, "s"),
    ])
}

/// A ball that is whirled about v through the fold of its joint, at twice the energy that the fold has.
fn whirl() -> Scene {
    let law = JointLaw {
        stretch: Some(RowLaw::RIGID),
        bend: Some(RowLaw::new(1.0, 0.0)),
        twist: None,
    };
    let energy = PI * PI;
    let spin = (2.0 * energy / INERTIA).sqrt();
    let joint = Constraint::Cosserat(Cosserat::new(frames(), law));
    let mut scene = ball(joint, Vector3::y() * spin);
    scene.name = "whirled through the fold".to_owned();
    scene
}

/// Change of the energy of the whirl at a time step, over what it has, and how often it folded.
fn whirl_at(dt: f64) -> Result<(f64, usize), StepError> {
    let options = at(dt);
    let mut stepper = Stepper::new(whirl(), options)?;
    stepper.step()?;
    let first = stepper.energy().total();
    let (mut folds, mut before) = (0, 0.0);
    for _ in 1..taut_ground::trajectory::steps_in(WHIRL_TIME, dt) {
        stepper.step()?;
        let bend = stepper.linearized().phi[3];
        folds += usize::from((bend - before).abs() > PI);
        before = bend;
    }
    Ok((stepper.energy().total() / first - 1.0, folds))
}

/// Largest change of the whirl's energy that passes, and the largest at 1/60 s, whose folds are a limit.
const WHIRL_BARS: [f64; 2] = [1e-3, 0.2];

fn whirled(quick: bool) -> Vec<Check> {
    let rates: &[f64] = either(quick, &[60.0, 240.0], &[60.0, 240.0, 960.0, 3840.0]);
    let found: Vec<_> = rates.iter().map(|r| (r, whirl_at(1.0 / r))).collect();
    let finer = found.iter().skip(1).filter_map(|(_, f)| f.as_ref().ok());
    let finer: Vec<String> = finer.map(|(change, _)| format!("{change:+.1e}")).collect();
    let judged = |(rate, found): &(&f64, Result<(f64, usize), StepError>)| {
        let case = format!("whirled through the fold for {WHIRL_TIME} s, 1/{rate} s");
        match found {
            Ok((change, folds)) => {
                let ours = format!("energy {change:+.1e} in {folds} folds");
                let [bar, most] = WHIRL_BARS;
                let mut check = Check::within(case, "none", ours, change.abs(), bar)
                    .by("relative change of the energy");
                if *folds == 0 {
                    check.verdict = Verdict::Fail;
                    check.note = "it does not fold".to_owned();
                } else if check.verdict == Verdict::Fail && **rate == 60.0 && change.abs() <= most {
                    check.verdict = Verdict::Limit;
                    check.note = format!(
                        "it passes the fold at {:.2} rad a step: where the bend is π its torque turns round, within a \
                         step that takes one for all of it; in shorter steps {}",
                        (PI * PI / INERTIA).sqrt() / **rate,
                        finer.join(", ")
                    );
                }
                check
            }
            Err(e) => Check::failed(case, "goes on", &e),
        }
    };
    found.iter().map(judged).collect()
}
