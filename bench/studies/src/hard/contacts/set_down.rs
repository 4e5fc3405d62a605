//! H66: a load on a damped rope over a sheave with friction, set down and picked up.
//!
//! A hook with a load on a sling hangs from a rope over one sheave. Before and behind it the rope has the lengths ℓᵢ at rest,
//! the paths Λᵢ, the compliances εᵢ and the tensions Tᵢ, and slips with s over it. In each step, whatever winch and floor do,
//!
//! ```text
//! Σ ℓᵢ = what it was and the winch has fed
//! Tᵢ = 0, or εᵢ Tᵢ = xᵢ + τ ẋᵢ with xᵢ = max(0, Λᵢ − ℓᵢ):  Σ ℓᵢ = path − stretch
//! T₂ = e^(μθ) T₁ for s > 0,  T₁ = e^(μθ) T₂ for s < 0,  between the two for s = 0;    so (T₂ − T₁) s ≥ 0
//! ```
//!
//! The linearly implicit step has x and T at its end and ẋ as the difference over it, so that its law holds as it stands.

use super::{DT, GRAVITY, ground, put_box, rough};
use crate::hard::{at, either, worse};
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::pace;
use taut_integrator::{Scheme, StepError, StepOptions, Stepper};
use taut_model::{
    Body, Constraint, Control, Frame, MasslessCable, RowLaw, Scene, SceneError, Sheave, Winch,
};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Compliance of rope and sling \[m/N], height of the load at first \[m].
const COMPLIANCE: f64 = 3e-7;
const ABOVE: f64 = 0.2;
const RADIUS: f64 = 0.2;
const DAMPINGS: [f64; 2] = [0.0, 0.05];
const FRICTIONS: [f64; 2] = [0.02, 0.3];
const SCHEMES: [Scheme; 2] = [Scheme::LinearlyImplicit, Scheme::THIRD_DIFFERENCE];
/// Speeds of the hook \[m/s], each for [`STAGE`] steps: on the floor, still, up, still.
const SPEEDS: [f64; 4] = [-0.3, 0.0, 0.3, 0.0];
const STAGE: usize = 120;
/// Largest errors: of lengths \[m], of T₂/T₁, and power with which friction drives over that of the hoist.
const LENGTH: f64 = 1e-9;
const RATIO: f64 = 1e-9;
const POWER: f64 = 1e-9;
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

/// Numbers of the rope's two parts.
const PARTS: [usize; 2] = [1, 2];
/// Of hook and load \[N].
const WEIGHT: f64 = 820.0 * GRAVITY;

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

/// Largest errors of a run.
#[derive(Debug, Clone, Copy, Default)]
struct Found {
    /// Of the lengths at rest \[m], and of those with their stretch by the law.
    fed: f64,
    law: f64,
    /// Of the tensions' ratio where the rope slips, and their excess over it, relative.
    ratio: f64,
    /// Power with which friction drives, over W and the hoist's speed.
    drives: f64,
    /// How far it slips in all \[m].
    way: f64,
}

fn drive(
    scene: Scene,
    damping: f64,
    friction: f64,
    scheme: Scheme,
    cycles: usize,
) -> Result<Found, StepError> {
    let options = StepOptions { scheme, ..at(DT) };
    let mut stepper = Stepper::new(scene, options)?;
    stepper.begin()?;
    let (mut found, mut due) = (Found::default(), length(&stepper));
    for speed in SPEEDS.repeat(cycles) {
        stepper.set_control(0, speed)?;
        for _ in 0..STAGE {
            let (grip, before) = ((friction * stepper.scene().wrap(0)).exp(), rows(&stepper));
            pace::step(&mut stepper)?;
            due -= speed * DT;
            found.fed = worse(found.fed, (length(&stepper) - due).abs());
            let tension = PARTS.map(|c| stepper.tension(c).unwrap_or(f64::NAN));
            for (k, [now, _]) in rows(&stepper).into_iter().enumerate() {
                let [phi, compliance] = before[k];
                let rate = (now - phi.max(0.0)) / DT;
                let off = now + damping * rate - compliance * tension[k];
                found.law = worse(found.law, if tension[k] > 0.0 { off.abs() } else { now });
            }
            let [a, b] = tension;
            let slip = stepper.slip_rates().sum::<f64>();
            found.way += slip.abs() * DT;
            found.drives = worse(found.drives, (a - b) * slip / (0.3 * WEIGHT));
            let (pulling, behind) = if slip > 0.0 { (b, a) } else { (a, b) };
            let off = match slip.abs() {
                s if s > STILL => (pulling - grip * behind).abs(),
                _ => (a - grip * b).max(b - grip * a).max(0.0),
            };
            found.ratio = worse(found.ratio, off / a.max(b).max(f64::MIN_POSITIVE));
        }
    }
    Ok(found)
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let cycles = either(quick, 1, 10);
    let mut checks = Vec::new();
    for (damping, friction) in DAMPINGS.into_iter().flat_map(|d| FRICTIONS.map(|f| (d, f))) {
        let run = |scheme| {
            Ok(drive(
                crane(damping, friction)?,
                damping,
                friction,
                scheme,
                cycles,
            )?)
        };
        let runs: Result<Vec<Found>, ExperimentError> = SCHEMES.into_iter().map(run).collect();
        let runs = runs?;
        let largest = |of: fn(&Found) -> f64| runs.iter().map(of).fold(0.0, worse);
        let case = format!("τ = {damping} s, μ = {friction}");
        let check = |what: &str, reference: &str, error, unit, bar| {
            let case = format!("{case}: {what}");
            Check::off(case, reference, error, unit, bar)
        };
        let way = runs.iter().map(|f| f.way).fold(f64::INFINITY, f64::min);
        let slips = format!("slips by {way:.2} m in {cycles} set-downs");
        checks.extend([
            check(
                "Σ ℓ",
                "what the winch feeds",
                largest(|f| f.fed),
                "m",
                LENGTH,
            ),
            check("path − stretch", "ℓ", runs[0].law, "m", LENGTH).by("linearly implicit"),
            check(
                "T₂/T₁ where it slips",
                "e^(±μθ)",
                largest(|f| f.ratio),
                "",
                RATIO,
            )
            .noting(slips),
            check("friction", "takes power", largest(|f| f.drives), "", POWER).by("over W v"),
        ]);
    }
    Ok(checks.into())
}
