//! Common ground of the bucklings H09, H10, H11: the stability of a disturbed equilibrium, and the
//! load where it ends.
//!
//! The scene starts in an equilibrium that would exist for any load, with small velocities, and runs freely in
//! linearly implicit steps without geometric stiffness, whose time step is a tenth or so of the critical mode's 1/ω:
//! the change of the forces' directions is then resolved, and the scheme's own damping ω² Δt lets a mode of small
//! stiffness fade or grow without much swinging. Below the critical load the disturbance fades, above it grows;
//! where it counts, the load is bisected.

use crate::paper::specimens::largest;
use taut_integrator::{StepError, StepOptions, Stepper};
use taut_model::{Scene, SceneError};
use taut_output::check::{Check, ExperimentError};

/// Size of the velocities that disturb \[m/s].
pub(super) const DISTURBANCE: f64 = 1e-7;

/// Distance at which an equilibrium of the size of 1 m is left \[m].
const LEFT: f64 = 1e-3;

/// Growth beyond which a disturbance has clearly left.
const GROWN: f64 = 10.0;

/// Distances from the equilibrium that are rounding of positions of about a metre \[m]: a disturbance that has faded to it
/// stays there, and what grows from less has to leave it.
const ROUNDING: f64 = 1e-14;

/// Largest distance of a body from the equilibrium, `off` (m), in the last quarter of the run over that in the second:
/// below 1 it fades. The first quarter is left to the stiff modes. Infinite where the equilibrium is left for good.
pub(super) fn growth(
    scene: Scene,
    [dt, time]: [f64; 2],
    off: fn(&Scene) -> f64,
) -> Result<f64, ExperimentError> {
    let options = StepOptions {
        dt,
        ..StepOptions::paper()
    };
    let mut stepper = Stepper::new(scene, options)?;
    let steps = taut_ground::trajectory::steps_in(time, dt);
    let (mut first, mut last) = (0.0_f64, 0.0_f64);
    for k in 0..steps {
        match stepper.step() {
            Ok(_) => {}
            // A state beyond all numbers has left for good. Another error does not concern the
            // equilibrium.
            Err(StepError::NonFinite { .. }) => return Ok(f64::INFINITY),
            Err(e) => return Err(e.into()),
        }
        let away = off(stepper.scene());
        if away.is_nan() || away > LEFT {
            return Ok(f64::INFINITY);
        }
        if (steps..2 * steps).contains(&(4 * k)) {
            first = first.max(away);
        } else if 4 * k >= 3 * steps {
            last = last.max(away);
        }
    }
    Ok(last / first.max(ROUNDING))
}

/// How the load is found at which an equilibrium buckles.
pub(super) struct Search {
    pub(super) case: String,
    /// The continuum's critical load, and the exact discrete one.
    pub(super) curve: f64,
    pub(super) exact: f64,
    /// Half width of the bracket about the exact discrete one, relative; the bar against the continuum.
    pub(super) bar: f64,
    /// Halvings of the bracket.
    pub(super) halvings: usize,
    /// Time step and duration of a run in which a disturbance fades or grows \[s].
    pub(super) run: [f64; 2],
}

/// The bracket and, in as many more runs as there are halvings, the load at which the disturbance neither fades nor grows.
pub(super) fn check(
    search: Search,
    scene: impl Fn(f64) -> Result<Scene, SceneError>,
    off: fn(&Scene) -> f64,
) -> Result<Vec<Check>, ExperimentError> {
    let Search {
        case,
        curve,
        exact,
        bar,
        halvings,
        run,
    } = search;
    let grows = |load: f64| growth(scene(load)?, run, off);
    let (mut low, mut high) = (exact * (1.0 - bar), exact * (1.0 + bar));
    let [below, above] = [grows(low)?, grows(high)?];
    let sound = below < 1.0 && above > GROWN;
    let grown = if above.is_finite() {
        format!("× {above:.0e}")
    } else {
        "left".to_owned()
    };
    let ours = format!("× {below:.0e}; {grown}");
    let bracket = Check::stated(
        format!("{case}: {:.0} % below and above", 100.0 * bar),
        "a disturbance fades; it grows",
        ours,
        sound,
    )
    .noting(format!(
        "about the exact chain's {exact:.6}; its growth over {} s",
        run[1]
    ));
    if !sound || halvings == 0 {
        return Ok(vec![bracket]);
    }
    for _ in 0..halvings {
        let middle = low.midpoint(high);
        if grows(middle)? > 1.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    let found = low.midpoint(high);
    let error = (found / curve - 1.0).abs();
    let ours = format!("{found:.5} ± {:.0e}", 0.5 * (high - low));
    let check = Check::within(
        format!("{case}: critical"),
        format!("{curve:.6}; chain {exact:.6}"),
        ours,
        error,
        bar,
    )
    .by("relative to the continuum's, by halving the bracket about the chain's: what is left of that stands with it")
    .space_part((exact / curve - 1.0).abs());
    Ok(vec![bracket, check])
}

/// Largest distance of a body from the x axis \[m].
pub(in crate::hard) fn off_axis(scene: &Scene) -> f64 {
    largest(scene.bodies.position.iter().map(|p| p.y.hypot(p.z)))
}
