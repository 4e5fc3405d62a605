//! H33 and H34: what a step does to a deformation mode, and to a gap.
//!
//! H33: in each step a mode is multiplied by the roots of the scheme's characteristic polynomial ([`crate::law`]),
//! whatever joint it belongs to: measured as the roots of the recurrence that fits the motion.
//!
//! H34: a rigid row closes its gap by φ̄ + τ r_{n+1} = 0, a recurrence of the gaps alone whatever the inertia; as Δt →
//! 0 every scheme closes it as e^(−t/τ), at a rate that has a power series in Δt/τ, so that four time steps
//! extrapolate it.

use crate::hard::{DT, at, each_solver, worse};
use crate::law;
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::pace;
use taut_integrator::{GeometricStiffness, Scheme, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Cosserat, Frame, JointLaw, RowLaw, Scene, Spherical, hanging_axes,
};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Largest error of a root's modulus (relative) or phase (rad) that passes.
pub(super) const LAW_BAR: f64 = 1e-8;
/// Largest error of a gap, relative to the initial one, and of τ, relative, that passes.
pub(super) const GAP_BAR: f64 = 1e-6;
/// The schemes, with the third difference in its two weights.
const SCHEMES: [Scheme; 4] = [
    Scheme::LinearlyImplicit,
    Scheme::Spook,
    Scheme::THIRD_DIFFERENCE,
    Scheme::ThirdDifference {
        a: 0.75,
        gamma: -0.2,
    },
];
/// Ω = ωΔt and θ = τ/Δt of H33.
const FREQUENCIES: [f64; 5] = [0.05, 0.2, 1.0, 3.0, 10.0];
const THETAS: [f64; 2] = [0.0, 0.5];

/// A body of 2 kg on a spring, and what is measured of it.
#[derive(Debug, Clone, Copy)]
struct Mode {
    name: &'static str,
    /// m or I.
    inertia: f64,
    scene: fn(RowLaw) -> Scene,
    coordinate: fn(&Scene) -> f64,
}

const MODES: [Mode; 3] = [
    Mode {
        name: "stretch",
        inertia: 2.0,
        scene: ball,
        coordinate: |scene| scene.bodies.position[0].x,
    },
    Mode {
        name: "twist",
        inertia: 0.008,
        scene: |law| turned(law, Vector3::new(0.0, 0.0, 0.3)),
        coordinate: |scene| scene.bodies.orientation[0].scaled_axis().z,
    },
    Mode {
        name: "bend",
        inertia: 0.008,
        scene: |law| turned(law, Vector3::new(0.3, 0.0, 0.0)),
        coordinate: |scene| scene.bodies.orientation[0].scaled_axis().x,
    },
];

/// A ball held at its centre, 1 cm off.
fn ball(law: RowLaw) -> Scene {
    let mut scene = Scene::new("ball");
    let place = Vector3::new(0.01, 0.0, 0.0);
    let body = scene.add_body("ball", Body::sphere(0.1, 2.0).at(place));
    let frames = [
        Frame::world(Vector3::zeros()),
        Frame::body(body, Vector3::zeros()),
    ];
    let spring = Spherical {
        frames,
        stretch: law,
    };
    scene.add_constraint("spring", Constraint::Spherical(spring), 0);
    scene
}

/// A ball, I = 0.4·2 kg·0.01 m², held by a cable joint of one `law` for bend and twist and turned
/// by `turn` (rad).
fn turned(law: RowLaw, turn: Vector3<f64>) -> Scene {
    let mut scene = Scene::new("turned");
    let turn = UnitQuaternion::from_scaled_axis(turn);
    let body = scene.add_body("ball", Body::sphere(0.1, 2.0).turned(turn));
    let frames = [
        Frame::world(Vector3::zeros()).with_axes(hanging_axes()),
        Frame::body(body, Vector3::zeros()).with_axes(hanging_axes()),
    ];
    let law = JointLaw {
        stretch: Some(RowLaw::new(1e-6, 0.0)),
        bend: Some(law),
        twist: Some(law),
    };
    let joint = Cosserat::new(frames, law);
    scene.add_constraint("spring", Constraint::Cosserat(joint), 0);
    scene
}

/// Values of `measure` (m or rad) at the start and after each of `steps` steps.
fn samples(
    scene: Scene,
    options: StepOptions,
    steps: usize,
    measure: impl Fn(&Scene) -> f64,
) -> Result<Vec<f64>, ExperimentError> {
    let mut stepper = Stepper::new(scene, options)?;
    let mut samples = vec![measure(stepper.scene())];
    for _ in 0..steps {
        pace::step(&mut stepper)?;
        samples.push(measure(stepper.scene()));
    }
    Ok(samples)
}

/// The scenes of H33: each mode at Ω = 1.
pub(super) fn modes_at_the_start() -> Result<Vec<Scene>, ExperimentError> {
    let scene = |mode: &Mode| (mode.scene)(RowLaw::new(DT * DT / mode.inertia, 0.0));
    Ok(MODES.iter().map(scene).collect())
}

pub(super) fn gap_at_the_start() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![ball(RowLaw::new(0.0, 2.5 * DT))])
}

fn with_scheme(scheme: Scheme, options: StepOptions) -> StepOptions {
    StepOptions {
        scheme,
        stiffness: GeometricStiffness::Off,
        guard: None,
        ..options
    }
}

pub(super) fn outcome(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for mode in &MODES {
        for scheme in SCHEMES {
            for theta in THETAS {
                checks.push(damped(mode, scheme, theta)?);
            }
        }
    }
    checks.extend(each_solver(
        "stretch, third-difference, every solver",
        |choice| {
            let mut worst = 0.0_f64;
            for omega in FREQUENCIES {
                let options = with_scheme(Scheme::default(), choice.plain_options(DT));
                let [modulus, phase] = law_error(&MODES[0], options, omega, 0.0)?;
                worst = worse(worst, modulus + phase);
            }
            Ok(Check::off(
                "",
                "roots of the polynomial",
                worst,
                "",
                LAW_BAR,
            ))
        },
    )?);
    Ok(checks.into())
}

/// Errors of modulus (relative) and phase (rad) of the largest root, Ω = `omega`.
fn law_error(
    mode: &Mode,
    options: StepOptions,
    omega: f64,
    theta: f64,
) -> Result<[f64; 2], ExperimentError> {
    let (scheme, dt) = (options.scheme, options.dt);
    let compliance = dt * dt / (mode.inertia * omega * omega);
    let scene = (mode.scene)(RowLaw::new(compliance, theta * dt));
    let x = samples(scene, options, 16, mode.coordinate)?;
    let expected = law::recurrence(scheme, [omega * omega, 0.0], theta);
    // The first steps have no past to look back on, and what has decayed is rounding.
    let first = if expected.len() == 3 { 3 } else { 1 };
    let last = x.iter().rposition(|y| y.abs() > 1e-6 * x[0].abs());
    let lasting = x.get(first..=last.unwrap_or(0)).unwrap_or_default();
    let found = law::roots(&law::fitted(lasting, expected.len()));
    let expected = law::roots(&expected);
    let (Some(found), Some(expected)) = (found.first(), expected.first()) else {
        return Ok([f64::NAN; 2]);
    };
    // Two real roots close to each other part into a pair by rounding: their phase says nothing.
    let phase = if expected[1] == 0.0 {
        0.0
    } else {
        (found[1] - expected[1]).abs()
    };
    Ok([(found[0] / expected[0] - 1.0).abs(), phase])
}

/// One scheme over all frequencies; for the linearly implicit one the polynomial's roots beside their closed form too.
fn damped(mode: &Mode, scheme: Scheme, theta: f64) -> Result<Check, ExperimentError> {
    let (mut worst, mut closed) = (0.0_f64, 0.0_f64);
    let mut moduli = Vec::new();
    for omega in FREQUENCIES {
        let [modulus, phase] = law_error(mode, with_scheme(scheme, at(DT)), omega, theta)?;
        worst = worse(worst, modulus + phase);
        let roots = law::roots(&law::recurrence(scheme, [omega * omega, 0.0], theta));
        let [own, own_phase] = roots.first().copied().unwrap_or([f64::NAN; 2]);
        moduli.push(format!("{own:.4}"));
        if scheme == Scheme::LinearlyImplicit && theta == 0.0 {
            let exact = (1.0 + omega * omega).powf(-0.5);
            closed = closed.max((own / exact - 1.0).abs());
            closed = closed.max((own_phase - omega.atan()).abs());
        }
    }
    let check = Check::within(
        format!("{}, {scheme}, τ = {theta} Δt", mode.name),
        format!("× {}", moduli.join(", ")),
        format!("within {worst:.1e}"),
        worst + closed,
        LAW_BAR,
    );
    let by = "modulus of the largest root, relative, plus phase, rad, at Ω = 0.05, 0.2, 1, 3, 10";
    Ok(check.by(by).algebraic_part(worst))
}

pub(super) fn gaps(_quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for scheme in SCHEMES {
        for theta in [1.0, 2.5, 20.0] {
            let worst = closing(with_scheme(scheme, at(DT)), theta)?;
            let case = format!("{scheme}, τ = {theta} Δt: gap step by step");
            let check = Check::off(case, "φ̄ + τ r = 0", worst, "", GAP_BAR);
            checks.push(check.by("largest over 40 steps, over the initial gap"));
        }
        checks.push(relaxation(scheme)?);
    }
    checks.extend(each_solver("third-difference, every solver", |choice| {
        let options = with_scheme(Scheme::default(), choice.plain_options(DT));
        let worst = closing(options, 2.5)?;
        Ok(Check::off("", "φ̄ + τ r = 0", worst, "", GAP_BAR))
    })?);
    Ok(checks.into())
}

/// Largest error of a gap beside its recurrence, over the initial gap.
fn closing(options: StepOptions, theta: f64) -> Result<f64, ExperimentError> {
    let weights = options.scheme.weights();
    let (p, q, s) = (weights.next, weights.now, weights.before);
    let scene = ball(RowLaw::new(0.0, theta * options.dt));
    let x = samples(scene, options, 40, |s| s.bodies.position[0].x)?;
    let d = p + theta;
    let mut worst = 0.0_f64;
    for n in 3..x.len() - 1 {
        let next = ((d - 1.0 + q) * x[n] - (q + s) * x[n - 1] + s * x[n - 2]) / d;
        worst = worse(worst, (x[n + 1] - next).abs() / x[0]);
    }
    Ok(worst)
}

/// The set time beside that of the exponential at Δt → 0.
fn relaxation(scheme: Scheme) -> Result<Check, ExperimentError> {
    let tau = 0.1_f64;
    let steps = [50.0, 100.0, 200.0, 400.0].map(|n| tau / n);
    let mut rates = Vec::new();
    for dt in steps {
        let count = (2.0 * tau / dt).round() as usize;
        let scene = ball(RowLaw::new(0.0, tau));
        let x = samples(scene, with_scheme(scheme, at(dt)), count, |s| {
            s.bodies.position[0].x
        })?;
        let half = count / 2;
        rates.push(tau * (x[half] / x[count]).ln() / ((count - half) as f64 * dt));
    }
    let coarse = (rates[0] - 1.0).abs();
    // Neville's scheme towards Δt = 0.
    for level in 1..rates.len() {
        for i in (level..rates.len()).rev() {
            let factor = steps[i - level] / steps[i];
            rates[i] += (rates[i] - rates[i - 1]) / (factor - 1.0);
        }
    }
    let found = tau / rates[3];
    let case = format!("{scheme}: relaxation time as Δt → 0");
    let check = Check::relative(case, [tau, found], "s", GAP_BAR);
    let note = "time: what Δt = τ/50 adds, before the extrapolation";
    Ok(check.noting(note).time_part(coarse))
}
