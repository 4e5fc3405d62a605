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

use super::words::{largest, worst};
use crate::rest::Reading;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use taut_model::{JointKind, Material, Specimen, SpecimenParams, TwistDefinition};

/// The paper's materials: name, Young's modulus \[Pa].
pub const MATERIALS: [(&str, f64); 3] = [("rubber", 2e7), ("nylon", 2e9), ("steel", 2e11)];

pub const SEGMENTS: [usize; 4] = [3, 6, 12, 24];

const POISSON: f64 = 0.3;

/// A joint law of the paper or of ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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

/// Order p of errors e ∝ N⁻ᵖ from the first and the last of (N, e), `None` where they are rounding.
pub fn order(errors: &[(usize, f64)]) -> Option<f64> {
    let ((n0, e0), (n1, e1)) = (*errors.first()?, *errors.last()?);
    let sound = e0.abs() > 1e-12 && e1.abs() > 1e-12 && n0 != n1;
    sound.then(|| (e0 / e1).abs().ln() / (n1 as f64 / n0 as f64).ln())
}

/// Every material and number of segments with each of some variants.
fn tasks<T: Copy>(
    materials: &[(&'static str, f64)],
    variants: &[T],
) -> Vec<((&'static str, f64), usize, T)> {
    let mut tasks = Vec::new();
    for &material in materials {
        for n in SEGMENTS {
            tasks.extend(variants.iter().map(|&variant| (material, n, variant)));
        }
    }
    tasks
}

/// The largest relative error of a number of the joints against its exact values.
fn off_exact(
    joints: &[Reading],
    number: impl Fn(&Reading) -> f64,
    exact: impl Fn(usize) -> f64,
) -> f64 {
    let errors = joints.iter().enumerate();
    largest(errors.map(|(j, joint)| (number(joint) / exact(j) - 1.0).abs()))
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
