//! H29: frequencies of cranes: a trolley with a pendulum, a double pendulum of hook and load, a block on two parallel
//! cables that turns, and the gantry itself.
//!
//! Small oscillations about the static equilibrium, measured from the motion ([`super::frequency`]):
//!
//! ```text
//! trolley    ω² = (g/L)(1 + m/M)                        trolley M, load m
//! hook       ω² = ½ g {s ∓ √[s² − 4 (1+R)/(L₁L₂)]},     s = (1+R)(1/L₁ + 1/L₂),  R = m_load/m_hook
//! bifilar    ω² = m g a b/(I L)                         half spacings a, b of the ends above and below
//! ```

use super::frequency::{self, of_motion, record, stride};
use crate::hard::at;
use crate::law;
use indicatif::ProgressBar;
use nalgebra::{UnitQuaternion, Vector3};
use taut_ground::modes::natural;
use taut_integrator::static_equilibrium;
use taut_model::{
    Body, Constraint, Distance, End, Frame, GantryParams, JointKind, MasslessCable, RowLaw, Scene,
    Slider, axes_along,
};
use taut_output::check::{Check, ExperimentError, Outcome};
use taut_solver::Backend;

const GRAVITY: f64 = 9.81;
/// Time step, short enough for the frequencies to be the scene's: the step's own error is (ωΔt)²/24.
const DT: f64 = 1.0 / 480.0;
/// Largest relative error of a frequency that passes.
const BAR: f64 = 1e-4;
/// Angle of the oscillations \[rad].
const ANGLE: f64 = 1e-3;

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = vec![trolley()?];
    checks.extend(double_pendulum()?);
    checks.push(bifilar()?);
    let ratios: &[f64] = if quick { &[1e5] } else { &[1e3, 1e4, 1e5] };
    for &ratio in ratios {
        checks.extend(gantry(ratio)?);
    }
    Ok(checks.into())
}

fn check(case: impl Into<String>, formula: f64, measured: f64) -> Check {
    Check::relative(case, [formula, measured], "rad/s", BAR)
        .by("relative; time: what the step makes of the formula's frequency, by its law")
        .time_part((law::geometric_frequency(formula, DT) / formula - 1.0).abs())
}

/// A massless link of `length` (m) between the centres of two bodies.
fn link(scene: &mut Scene, name: &str, frames: [Frame; 2], length: f64) {
    let link = Distance {
        frames,
        length,
        law: RowLaw::RIGID,
        transverse: false,
    };
    scene.add_constraint(name, Constraint::Distance(link), 0);
}

fn crane(name: &str) -> Scene {
    let mut scene = Scene::new(name);
    scene.gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    scene
}

/// Masses of trolley and load \[kg], and the cable's length \[m].
const TROLLEY: [f64; 3] = [50.0, 100.0, 4.0];

pub(super) fn on_a_trolley() -> (Scene, [usize; 2]) {
    let [trolley_mass, load_mass, length] = TROLLEY;
    let mut scene = crane("trolley");
    let trolley = Body::cuboid(Vector3::repeat(0.5), trolley_mass);
    let trolley = scene.add_body("trolley", trolley);
    let place = Vector3::new(ANGLE.sin(), 0.0, -ANGLE.cos()) * length;
    let load = scene.add_body("load", Body::particle(load_mass).at(place));
    let along = axes_along(&Vector3::x()).unwrap_or_else(taut_model::hanging_axes);
    let centre = |body| Frame::body(body, Vector3::zeros());
    let frames = [
        Frame::world(Vector3::zeros()).with_axes(along),
        centre(trolley).with_axes(along),
    ];
    scene.add_constraint("rail", Constraint::Slider(Slider::new(frames)), 0);
    let cable = MasslessCable::new(vec![centre(trolley), centre(load)], length, RowLaw::RIGID);
    scene.add_constraint("cable", Constraint::MasslessCable(cable), 0);
    (scene, [trolley, load])
}

fn trolley() -> Result<Check, ExperimentError> {
    let (scene, [trolley, load]) = on_a_trolley();
    let [trolley_mass, load_mass, length] = TROLLEY;
    let formula = (GRAVITY / length * (1.0 + load_mass / trolley_mass)).sqrt();
    let x = |scene: &Scene| scene.bodies.position[load].x - scene.bodies.position[trolley].x;
    let samples = record(scene, at(DT), 12.0, x)?;
    let measured = frequency::single(&samples, DT, stride(formula, DT));
    Ok(check("trolley on a free rail", formula, measured))
}

/// Frequencies of two point masses on massless links \[rad/s], ascending.
fn double(ratio: f64, [upper, lower]: [f64; 2]) -> [f64; 2] {
    let s = (1.0 + ratio) * (1.0 / upper + 1.0 / lower);
    let root = (s * s - 4.0 * (1.0 + ratio) / (upper * lower)).sqrt();
    [s - root, s + root].map(|x| (0.5 * GRAVITY * x).sqrt())
}

/// Lengths above and below the hook \[m], and load over hook.
const LENGTHS: [f64; 2] = [4.0, 1.5];
const RATIO: f64 = 4.0;

pub(super) fn hook_and_load() -> Scene {
    let (lengths, ratio) = (LENGTHS, RATIO);
    let mut scene = crane("double pendulum");
    let hook = Body::particle(100.0).at(Vector3::new(0.0, 0.0, -lengths[0]));
    let hook = scene.add_body("hook", hook);
    let place = Vector3::new(ANGLE.sin(), 0.0, -ANGLE.cos()) * lengths[1];
    let load = Body::particle(100.0 * ratio).at(place - Vector3::z() * lengths[0]);
    let load = scene.add_body("load", load);
    let centre = |body| Frame::body(body, Vector3::zeros());
    let top = [Frame::world(Vector3::zeros()), centre(hook)];
    link(&mut scene, "upper", top, lengths[0]);
    link(
        &mut scene,
        "lower",
        [centre(hook), centre(load)],
        lengths[1],
    );
    scene
}

fn double_pendulum() -> Result<Vec<Check>, ExperimentError> {
    let formula = double(RATIO, LENGTHS);
    let samples = record(hook_and_load(), at(DT), 16.0, |scene| {
        scene.bodies.position[0].x
    })?;
    let measured = frequency::pair(&samples, DT, stride(formula[1], DT));
    let names = ["hook and load, slow", "hook and load, fast"];
    let rows = names.into_iter().zip(formula.into_iter().zip(measured));
    Ok(rows.map(|(n, (f, m))| check(n, f, m)).collect())
}

/// A block on two cables, and the frequency of its turning \[rad/s].
pub(super) fn on_two_cables() -> (Scene, f64) {
    let (above, below, length, mass) = (1.0_f64, 0.6_f64, 3.0_f64, 200.0_f64);
    // The cables lean inwards: the block hangs this far down.
    let fall = (length * length - (above - below) * (above - below)).sqrt();
    let mut scene = crane("bifilar");
    let block = Body::cuboid(Vector3::new(2.0, 0.5, 0.5), mass);
    let inertia = block.inertia[(2, 2)];
    let turned = UnitQuaternion::from_scaled_axis(Vector3::z() * ANGLE);
    let block = block.at(Vector3::new(0.0, 0.0, -fall)).turned(turned);
    let block = scene.add_body("block", block);
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        let frames = vec![
            Frame::world(Vector3::x() * (above * side)),
            Frame::body(block, Vector3::x() * (below * side)),
        ];
        let cable = MasslessCable::new(frames, length, RowLaw::new(1e-9, 0.0));
        scene.add_constraint(name, Constraint::MasslessCable(cable), 0);
    }
    let formula = (mass * GRAVITY * above * below / (inertia * fall)).sqrt();
    (scene, formula)
}

fn bifilar() -> Result<Check, ExperimentError> {
    let (scene, formula) = on_two_cables();
    let yaw = |scene: &Scene| scene.bodies.orientation[0].scaled_axis().z;
    let samples = record(scene, at(DT), 12.0, yaw)?;
    let measured = frequency::single(&samples, DT, stride(formula, DT));
    Ok(check("block on two cables, turning", formula, measured)
        .noting("L is the depth of the block: the cables lean"))
}

/// The gantry as what the formula speaks of: hook and load as points, a cable of little mass between them, the trolley
/// held by its motor. The formula is for points; what the scene's own frequencies are is an eigenvalue problem
/// ([`natural`]), with which the motion is compared.
fn gantry(ratio: f64) -> Result<Vec<Check>, ExperimentError> {
    let params = GantryParams {
        mass_ratio: ratio,
        gravity: GRAVITY,
        drop: 4.0,
        cable_length: 1.5,
        // Few, so that their mass stays small beside that of a hook of 250 elements.
        segments: 2,
        hook_height: 1e-3,
        load_offset: Some(0.0),
        joint: JointKind::Spherical,
        attachment: End::Spherical,
        seed: 0,
        ..GantryParams::default()
    };
    let mut scene = static_equilibrium(params.build()?, &Backend::Banded)?;
    scene.start_in_equilibrium = false;
    let (hook, load) = (2, scene.bodies.len() - 1);
    let depth = |body: usize| -scene.bodies.position[body].z;
    let lengths = [depth(hook), depth(load) - depth(hook)];
    let masses = |body: usize| scene.bodies.mass[body];
    let formula = double(masses(load) / masses(hook), lengths);
    // In the plane of the trolley's path: along x and z, and about y.
    let Some(modes) = natural(&scene, &[0, 2, 4]) else {
        let case = format!("gantry, load/element {ratio:.0e}");
        return Ok(vec![Check::stated(
            case,
            "modes at rest",
            "degenerate",
            false,
        )]);
    };
    let mut checks = Vec::new();
    for (name, formula) in ["slow", "fast"].into_iter().zip(formula) {
        let from = |k: &usize| (modes.frequency(*k) - formula).abs();
        let nearest = (0..modes.squares.len()).min_by(|a, b| from(a).total_cmp(&from(b)));
        let k = nearest.unwrap_or_default();
        let exact = modes.frequency(k);
        // One mode alone: the hook, which tilts on its falls, has one beside the slow one.
        let mut swung = scene.clone();
        modes.displace(&mut swung, k, ANGLE * lengths[0]);
        let measured = of_motion(swung, at(DT), (exact, 6.0), |scene| {
            scene.bodies.position[hook].x
        })?;
        let whole = check(
            format!("gantry, load/element {ratio:.0e}: {name}"),
            exact,
            measured,
        );
        checks.push(
            Check {
                reference: format!("{exact:.6} rad/s; points on massless cables {formula:.6}"),
                ..whole
            }
            .noting(
                "against the scene's own modes at rest; space: what its cable's mass and stretch and the hook's size make \
                 of the formula's frequency, for the lengths of the equilibrium",
            )
            .time_part((law::geometric_frequency(exact, DT) / exact - 1.0).abs()).space_part((exact / formula - 1.0).abs()),
        );
    }
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_double_pendulum_as_printed() {
        let [slow, fast] = double(RATIO, LENGTHS);
        assert!((slow - 1.36405016).abs() < 1e-8 && (fast - 6.56520123).abs() < 1e-8);
    }
}
