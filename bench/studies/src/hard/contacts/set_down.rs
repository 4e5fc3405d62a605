//! H66: a load on a damped rope over a sheave with friction, set down and picked up.
//!
//! A hook with a load on a sling hangs from a rope over one sheave. Before and behind it the rope has the lengths ℓᵢ at rest,
//! the paths Λᵢ, the compliances εᵢ and the tensions Tᵢ, and slips with s over it. In each step, whatever winch and floor do,
//!
//! ```text
//! Σ ℓᵢ = what it was and the winch has fed
//! εᵢ Tᵢ = max(0, xᵢ + τ ẋᵢ) with x = max(0, Λ − ℓ)
//! T₂ = e^(μθ) T₁ for s > 0,  T₁ = e^(μθ) T₂ for s < 0,  between the two for s = 0;    so (T₂ − T₁) s ≥ 0
//! ```
//!
//! The linearly implicit step has x and T at its end and ẋ as the difference over it, so that its law holds as it stands.

use super::{DT, GRAVITY, ground, put_box, rough};
use crate::hard::{at, either, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::pace;
use taut_integrator::{Scheme, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Control, Frame, MasslessCable, RowLaw, Scene, SceneError, Sheave, Winch,
};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Compliance of rope and sling \[m/N], height of the load at first \[m].
const COMPLIANCE: f64 = 3e-7;
const ABOVE: f64 = 0.2;
const RADIUS: f64 = 0.2;
/// Weight of hook and load \[N].
const WEIGHT: f64 = 820.0 * GRAVITY;
/// Numbers of the rope's two parts.
const PARTS: [usize; 2] = [1, 2];
const DAMPINGS: [f64; 2] = [0.0, 0.05];
const FRICTIONS: [f64; 2] = [0.02, 0.3];
/// Speeds of the hook \[m/s], each for [`STAGE`] steps: on the floor, still, up, still.
const SPEEDS: [f64; 4] = [-0.3, 0.0, 0.3, 0.0];
const STAGE: usize = 120;
/// Quantities that judge a run, their references, and the units of the errors.
const ROWS: [[&str; 3]; 4] = [
    ["Σ ℓ", "what the winch feeds", "m"],
    ["stretch, linearly implicit", "ε T − τ ẋ", "m"],
    ["T₂/T₁", "e^(±μθ) where it slips", ""],
    ["friction", "takes power", "W v"],
];
/// Largest error of each.
const BAR: f64 = 1e-9;
/// Slower than this nothing slips \[m/s].
const STILL: f64 = 1e-9;

/// The load hangs in its rope.
fn crane(damping: f64, friction: f64) -> Result<Scene, SceneError> {
    let mut scene = ground("set-down", 0.0, rough(0.5));
    let place = Vector3::new(RADIUS, 0.0, ABOVE + 0.5);
    let (size, turn) = (Vector3::repeat(1.0), UnitQuaternion::identity());
    let load = put_box(&mut scene, [size, place], turn, 800.0, rough(0.5));
    scene.load = Some(load);
    let hook = Body::particle(20.0).at(Vector3::new(RADIUS, 0.0, 5.0));
    let hook = Frame::body(scene.add_body("hook", hook), Vector3::zeros());
    let law = RowLaw::new(COMPLIANCE, damping);
    let sling = vec![hook, Frame::body(load, 0.5 * Vector3::z())];
    let sling = MasslessCable::new(sling, 4.0 - ABOVE, law);
    scene.add_constraint("sling", Constraint::MasslessCable(sling), 0);
    let hub = Frame::world(Vector3::z() * 10.0).along(&Vector3::y());
    let frames = vec![Frame::world(Vector3::new(-4.0, 0.0, 9.8)), hub, hook];
    let sheave = Sheave {
        friction,
        ..Sheave::new(RADIUS)
    };
    let mut rope = MasslessCable {
        sheaves: vec![None, Some(sheave), None],
        winch: Some(Winch::new()),
        ..MasslessCable::new(frames, 1.0, law)
    };
    let mut excess = [0.0];
    Constraint::MasslessCable(rope.clone()).violation(&scene.bodies, 0.0, &mut excess);
    rope.length += excess[0] - COMPLIANCE * WEIGHT;
    scene.reeve("rope", &rope, 0)?;
    scene.controls.push(Control::of("hoist", PARTS[0], -1.0));
    Ok(scene)
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![crane(0.05, 0.3)?])
}

/// Length at rest of both parts \[m].
fn length(stepper: &Stepper) -> f64 {
    let parts = PARTS.map(|c| match &stepper.scene().constraints[c] {
        Constraint::MasslessCable(cable) => cable.length_at(stepper.time()),
        _ => f64::NAN,
    });
    parts[0] + parts[1]
}

/// φ and ε of both parts.
fn rows(stepper: &Stepper) -> [[f64; 2]; 2] {
    let rows = stepper.linearized();
    PARTS.map(|c| {
        let row = rows.row_range(c).start;
        [rows.phi[row], rows.compliance[row]]
    })
}

/// Largest errors of a run, those of [`ROWS`], and how far the rope slips in all \[m].
fn drive(
    [damping, friction]: [f64; 2],
    scheme: Scheme,
    cycles: usize,
) -> Result<([f64; 4], f64), ExperimentError> {
    let options = StepOptions { scheme, ..at(DT) };
    let mut stepper = Stepper::new(crane(damping, friction)?, options)?;
    stepper.begin()?;
    let (mut largest, mut way, mut due) = ([0.0; 4], 0.0, length(&stepper));
    for speed in SPEEDS.repeat(cycles) {
        stepper.set_control(0, speed)?;
        for _ in 0..STAGE {
            let (grip, before) = ((friction * stepper.scene().wrap(0)).exp(), rows(&stepper));
            let report = pace::step(&mut stepper)?;
            due -= speed * DT;
            let [a, b] = PARTS.map(|c| stepper.tension(c).unwrap_or(f64::NAN));
            let mut law = 0.0;
            for (k, [phi, compliance]) in before.into_iter().enumerate() {
                let (now, tension) = (rows(&stepper)[k][0], [a, b][k]);
                let off = now + damping * (now - phi.max(0.0)) / DT - compliance * tension;
                // Without tension it is slack, or its damper would push.
                law = worse(law, if tension > 0.0 { off.abs() } else { off });
            }
            let slip = stepper.slip_rates().sum::<f64>();
            let (pulling, behind) = if slip > 0.0 { (b, a) } else { (a, b) };
            let ratio = if slip.abs() > STILL {
                (pulling - grip * behind).abs()
            } else {
                (a - grip * b).max(b - grip * a).max(0.0)
            };
            // A divided step tells the mean of its parts' tensions.
            let implicit = scheme == Scheme::LinearlyImplicit && report.divided == 0;
            let errors = [
                (length(&stepper) - due).abs(),
                if implicit { law } else { 0.0 },
                ratio / a.max(b).max(f64::MIN_POSITIVE),
                (a - b) * slip / (SPEEDS[2] * WEIGHT),
            ];
            largest = [0, 1, 2, 3].map(|k| worse(largest[k], errors[k]));
            way += slip.abs() * DT;
        }
    }
    Ok((largest, way))
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let cycles = either(quick, 1, 10);
    let mut checks = Vec::new();
    for rope in DAMPINGS.into_iter().flat_map(|d| FRICTIONS.map(|f| [d, f])) {
        let (implicit, _) = drive(rope, Scheme::LinearlyImplicit, cycles)?;
        let (default, way) = drive(rope, Scheme::default(), cycles)?;
        for (k, [what, reference, unit]) in ROWS.into_iter().enumerate() {
            let case = format!("τ = {} s, μ = {}: {what}", rope[0], rope[1]);
            let check = Check::off(case, reference, worse(implicit[k], default[k]), unit, BAR);
            checks.push(check.noting(format!("{cycles} set-downs slip by {way:.1} m")));
        }
    }
    Ok(checks.into())
}
