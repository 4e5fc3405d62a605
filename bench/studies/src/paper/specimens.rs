//! Figs 10–12: a cable of 1 m, pulled, twisted and bent by loads at its end, against theory \[SL §VII-A].
//!
//! Under end loads every joint carries the same force or moment, so that the discrete specimen has an exact answer
//! ([`taut_model::specimen`]): each joint opens or turns by load times its length over stiffness. What the specimens are
//! measured against is that answer, to rounding, and the continuum, with the order of the difference in N.
//!
//! Materials are the paper's as far as its scan can be read: Y = 2·10⁷, 2·10⁹, 2·10¹¹ N/m² for rubber, nylon, steel and
//! ν = 0.3, on a square cross-section of 10⁻⁴ m² (the exponent is lost). Only the steel's dynamics depend on that area.

pub mod bend;
pub mod pull;
pub mod twist;

use super::words::number;
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::Value;
use taut_integrator::{GeometricStiffness, StepError, StepOptions, Stepper, static_equilibrium};
use taut_model::{
    Constraint, JointKind, Linearized, Material, RowKind, Scene, Specimen, SpecimenParams,
    TwistDefinition, update_windings,
};
use taut_solver::Backend;

/// The paper's materials: name, Young's modulus \[Pa].
pub const MATERIALS: [(&str, f64); 3] = [("rubber", 2e7), ("nylon", 2e9), ("steel", 2e11)];

pub const SEGMENTS: [usize; 4] = [3, 6, 12, 24];

const POISSON: f64 = 0.3;

/// A joint law of the paper or of ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Joint {
    /// Two bend rows, twist by swing and twist.
    #[serde(rename = "cosserat")]
    Cosserat,
    /// The paper's, with its ordinary twist angle.
    #[serde(rename = "paper, ordinary")]
    Ordinary,
    /// The paper's, with its alternative twist angle.
    #[serde(rename = "paper, alternative")]
    Alternative,
}

impl Joint {
    pub const ALL: [Self; 3] = [Self::Cosserat, Self::Ordinary, Self::Alternative];

    fn law(self) -> (JointKind, TwistDefinition) {
        match self {
            Self::Cosserat => (JointKind::Cosserat, TwistDefinition::Ordinary),
            Self::Ordinary => (JointKind::Paper, TwistDefinition::Ordinary),
            Self::Alternative => (JointKind::Paper, TwistDefinition::Alternative),
        }
    }
}

/// A specimen of one of the paper's materials, without load.
pub fn params(
    specimen: Specimen,
    (material, young): (&str, f64),
    segments: usize,
    joint: Joint,
) -> SpecimenParams {
    let (kind, twist_definition) = joint.law();
    SpecimenParams {
        segments,
        material: material.to_owned(),
        young: Some(young),
        poisson: Some(POISSON),
        density: Material::named(material).map(|m| m.density),
        joint: kind,
        twist_definition,
        force: Some(0.0),
        torque: Some(0.0),
        moment: Some(0.0),
        equilibrium: false,
        ..SpecimenParams::new(specimen)
    }
}

/// Values of the rows of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reading {
    /// Gap along x, positive when open \[m].
    pub gap: f64,
    /// Largest gap across \[m].
    pub across: f64,
    /// Bend angle \[rad].
    pub bend: f64,
    /// Twist with its winding \[rad].
    pub twist: f64,
}

/// The rows of all cable joints from the clamp to the grip; the bearing is left out.
pub fn read(scene: &Scene, segments: usize) -> Vec<Reading> {
    let mut rows = Linearized::new(scene);
    rows.update(scene, 0.0);
    let joint = |j: usize| reading(&scene.constraints[j], &rows.phi[rows.row_range(j)]);
    (0..=segments).map(joint).collect()
}

fn reading(constraint: &Constraint, phi: &[f64]) -> Reading {
    let mut reading = Reading::default();
    let mut next = 0;
    for (kind, count, _) in constraint.parts() {
        let part = &phi[next..next + count];
        next += count;
        match kind {
            RowKind::Stretch => {
                reading.gap = -part[0];
                reading.across = part[1].hypot(part[2]);
            }
            RowKind::Bend => reading.bend = part.iter().map(|b| b * b).sum::<f64>().sqrt(),
            RowKind::Twist => reading.twist = part[0],
            _ => {}
        }
    }
    reading
}

/// Passes of [`relax`] and what they divide its time step by.
const PASSES: [(usize, f64); 3] = [(8, 1.0), (60, 10.0), (3, 100.0)];

/// Implicit steps from rest, each one Newton's pass that leaves 1/(1 + ω²Δt²) of a mode ω: `dt` (s) is ten times the
/// slowest mode's 1/ω. A pass turns the rounding of the joints' torques, u M, into rotations u M Δt²/I of the light
/// segments; shorter steps at the end take these away and leave the slow modes where they are. Longer ones, as
/// those of [`static_equilibrium`], would not come to rest here.
pub fn relax(mut scene: Scene, dt: f64) -> Result<Scene, StepError> {
    for (passes, divisor) in PASSES {
        let options = StepOptions {
            dt: dt / divisor,
            stiffness: GeometricStiffness::inertia(1.0),
            ..StepOptions::paper()
        };
        scene = passes_from_rest(scene, options, passes)?;
    }
    Ok(scene)
}

/// As many steps of `options`, each from rest.
pub fn passes_from_rest(
    scene: Scene,
    options: StepOptions,
    passes: usize,
) -> Result<Scene, StepError> {
    let mut stepper = Stepper::new(scene, options)?;
    for _ in 0..passes {
        step_from_rest(&mut stepper)?;
    }
    Ok(stepper.into_scene())
}

fn step_from_rest(stepper: &mut Stepper) -> Result<(), StepError> {
    let mut bodies = stepper.scene().bodies.clone();
    bodies.velocity.fill(Vector3::zeros());
    bodies.angular_velocity.fill(Vector3::zeros());
    stepper.set_state(&bodies, 0.0)?;
    stepper.step().map(|_| ())
}

/// Settlings of a load at most: a pass reduces what is left a thousandfold or more.
const SETTLINGS: usize = 20;

/// The static equilibrium of the scene under its loads with the windings followed, repeated until no row changes by
/// more than its rounding. No joint may turn by half a turn on the way.
pub fn settle(mut scene: Scene) -> Result<Scene, StepError> {
    let backend = Backend::preferred().unwrap_or(Backend::Banded);
    let mut rows = Linearized::new(&scene);
    let mut last: Vec<f64> = Vec::new();
    for _ in 0..SETTLINGS {
        scene = static_equilibrium(scene, &backend)?;
        update_windings(&mut scene, 0.0);
        rows.update(&scene, 0.0);
        let size = rows.phi.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
        let change = rows.phi.iter().zip(&last);
        let change = change.fold(0.0_f64, |m, (p, q)| m.max((p - q).abs()));
        if !last.is_empty() && change <= 1e-14 * size {
            break;
        }
        last = rows.phi.to_vec();
    }
    Ok(scene)
}

/// Order p of errors e ∝ N⁻ᵖ from the first and the last of (N, e), `None` where they are rounding.
pub fn order(errors: &[(usize, f64)]) -> Option<f64> {
    let ((n0, e0), (n1, e1)) = (*errors.first()?, *errors.last()?);
    let sound = e0.abs() > 1e-12 && e1.abs() > 1e-12 && n0 != n1;
    sound.then(|| (e0 / e1).abs().ln() / (n1 as f64 / n0 as f64).ln())
}

/// The largest of some errors; NaN where one is.
pub(crate) fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |m, e| if e > m || e.is_nan() { e } else { m })
}

/// The last rows of steel of groups that have the same in some columns, each with the group's largest errors.
fn summed(rows: &[Value], same: &[&str], errors: &[&str]) -> Vec<Value> {
    let groups = rows.chunk_by(|a, b| same.iter().all(|key| a[*key] == b[*key]));
    let groups = groups.filter_map(|group| {
        let mut row = group.last()?.clone();
        for key in errors {
            row[*key] = worst(group, key).into();
        }
        (row["material"] == MATERIALS[2].0).then_some(row)
    });
    groups.collect()
}

/// The largest error of a column; NaN where a row has none.
pub(crate) fn worst<'a>(rows: impl IntoIterator<Item = &'a Value>, key: &str) -> f64 {
    largest(rows.into_iter().map(|row| number(row, key)))
}
