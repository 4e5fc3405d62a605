//! H25: bending modes of a beam, ω = (βL)² √(EI/ρA)/L², cos βL cosh βL = −1 for a cantilever and 1 for one clamped at
//! both ends.
//!
//! The chain of rods that bends in its joints by a_j − a_{j−1}, the first one by a_1 over half a rod, has the exact
//! frequencies of a small eigenvalue problem in the rods' angles a_j: mass from the centres' displacements and the
//! rods' own inertia, stiffness EI/l a joint.

use super::line::{Hold, Line};
use super::shape::Shape;
use crate::hard::special::root;
use crate::hard::{at, each_solver};
use indicatif::ProgressBar;
use nalgebra::{DMatrix, SymmetricEigen};
use std::f64::consts::PI;
use taut_ground::modes::natural;
use taut_model::{Body, Scene, Stiffness};
use taut_output::check::{Check, ExperimentError, Outcome};

const LENGTH: f64 = 2.0;
const MASS: f64 = 1.0;
const RADIUS: f64 = 1e-3;
/// Stiff enough axially for what the gaps shear to be 10⁻⁶ of the deflection.
const STIFFNESS: Stiffness = Stiffness {
    ea: 1e7,
    ei: 10.0,
    gj: 10.0,
};
const SEGMENTS: usize = 32;
/// Largest relative error beside the beam with 32 rods, and difference of the order from 2.
const BAR: f64 = 1e-2;
const ORDER_BAR: f64 = 0.1;

/// How a beam is held.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Cantilever,
    Clamped,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Cantilever => "cantilever",
            Self::Clamped => "clamped at both ends",
        }
    }

    /// (βL)² of mode `k`, from 1.
    fn square(self, k: usize) -> f64 {
        let (sign, middle) = match self {
            Self::Cantilever => (1.0, k as f64 - 0.5),
            Self::Clamped => (-1.0, k as f64 + 0.5),
        };
        // cos x = ∓1/cosh x lies near (k ∓ ½)π.
        let beta = root(
            |x| x.cos() + sign / x.cosh(),
            (middle - 0.4) * PI,
            (middle + 0.4) * PI,
        );
        beta * beta
    }
}

fn scene(kind: Kind, segments: usize) -> Scene {
    let l = LENGTH / segments as f64;
    let lower = match kind {
        Kind::Cantilever => Hold::Free,
        Kind::Clamped => Hold::Clamped,
    };
    let line = Line {
        segments,
        length: LENGTH,
        rod: Body::rod(l, RADIUS, MASS / segments as f64),
        stiffness: STIFFNESS,
        bends: true,
        tension: 0.0,
        ends: [Hold::Clamped, lower],
        load: None,
    };
    line.scene("beam")
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let bent = [Kind::Cantilever, Kind::Clamped].map(|kind| {
        let mut scene = scene(kind, SEGMENTS);
        if let Some(modes) = natural(&scene, &[0, 4]) {
            modes.displace(&mut scene, 0, 1e-3);
        }
        scene
    });
    Ok(bent.into())
}

/// ω of the chain of rods \[rad/s], ascending.
fn discrete(kind: Kind, segments: usize) -> Vec<f64> {
    let n = segments;
    let l = LENGTH / n as f64;
    let rod = MASS / n as f64;
    let inertia = rod * (3.0 * RADIUS * RADIUS + l * l) / 12.0;
    // Centre j is moved by l(a_1 + … + a_{j−1} + ½ a_j).
    let centre = DMatrix::from_fn(n, n, |j, i| match i.cmp(&j) {
        std::cmp::Ordering::Less => l,
        std::cmp::Ordering::Equal => 0.5 * l,
        std::cmp::Ordering::Greater => 0.0,
    });
    let mass = centre.transpose() * &centre * rod + DMatrix::identity(n, n) * inertia;
    let k = STIFFNESS.ei / l;
    let mut stiffness = DMatrix::zeros(n, n);
    for i in 0..n {
        // Half a rod's length at a clamped end.
        stiffness[(i, i)] += if i == 0 { 2.0 * k } else { k };
        if i + 1 < n {
            stiffness[(i, i)] += k;
            stiffness[(i, i + 1)] -= k;
            stiffness[(i + 1, i)] -= k;
        } else if kind == Kind::Clamped {
            stiffness[(i, i)] += 2.0 * k;
        }
    }
    // Clamped below too, the end does not move: Σ a = 0, whose complement is kept.
    let basis = if kind == Kind::Clamped {
        let mean = DMatrix::from_element(n, n, 1.0 / n as f64);
        let eigen = SymmetricEigen::new(mean);
        let kept: Vec<usize> = (0..n).filter(|i| eigen.eigenvalues[*i] < 0.5).collect();
        eigen.eigenvectors.select_columns(&kept)
    } else {
        DMatrix::identity(n, n)
    };
    let reduced = |m: DMatrix<f64>| basis.transpose() * m * &basis;
    let Some(factor) = reduced(mass).cholesky() else {
        return Vec::new();
    };
    let Some(inverse) = factor.l().try_inverse() else {
        return Vec::new();
    };
    let values = (&inverse * reduced(stiffness) * inverse.transpose()).symmetric_eigenvalues();
    let mut values: Vec<f64> = values.iter().map(|w| w.sqrt()).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// ω of the beam \[rad/s].
fn continuum(kind: Kind, k: usize) -> f64 {
    kind.square(k) * (STIFFNESS.ei * LENGTH / MASS).sqrt() / (LENGTH * LENGTH)
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = Vec::new();
    for (kind, last) in [(Kind::Cantilever, 3), (Kind::Clamped, 1)] {
        checks.extend(beam(kind, last, quick)?);
    }
    Ok(checks.into())
}

/// Modes beside the beam, the order of the rods, and the first mode's motion.
fn beam(kind: Kind, last: usize, quick: bool) -> Result<Vec<Check>, ExperimentError> {
    let (fine, coarse) = (scene(kind, SEGMENTS), scene(kind, SEGMENTS / 2));
    let modes = natural(&fine, &[0, 4]);
    let before = natural(&coarse, &[0, 4]);
    let exact = discrete(kind, SEGMENTS);
    let mut checks = Vec::new();
    for k in 1..=last {
        let shape = Shape {
            scene: &fine,
            modes: modes.as_ref(),
            number: k - 1,
            discrete: exact.get(k - 1).copied().unwrap_or(f64::NAN),
            continuum: continuum(kind, k),
            bar: BAR,
        };
        let name = |what: &str| format!("{}, mode {k}: {what}", kind.name());
        let note = format!("(βL)² = {:.9}", kind.square(k));
        checks.push(shape.beside_continuum(name("eigenvalue")).noting(note));
        let found = |m: &Option<_>| {
            let m: &Option<taut_ground::modes::Natural> = m;
            m.as_ref().map_or(f64::NAN, |m| m.frequency(k - 1))
        };
        let error = |m| (found(m) / shape.continuum - 1.0).abs();
        let order = (error(&before) / error(&modes)).log2();
        checks.push(
            Check::second_order(name("order"), order, ORDER_BAR)
                .by("difference of the order from 2, 16 to 32 rods"),
        );
        if k > 1 {
            continue;
        }
        // Without tension the scheme's filter acts on the bending alone; K does nothing.
        let dt = 2e-2 / shape.discrete;
        let stepped =
            crate::law::elastic_frequency(taut_integrator::Scheme::default(), shape.discrete, dt);
        let options = at(dt);
        checks.push(shape.motion(name("motion"), options, (Some(stepped), 1.5))?);
        if kind == Kind::Cantilever && !quick {
            checks.extend(each_solver(&name("motion"), |choice| {
                let check = shape.motion("", choice.plain_options(dt), (Some(stepped), 0.6))?;
                Ok(check)
            })?);
        }
    }
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wave_numbers_as_printed() {
        for (k, digits) in [(1, 3.516015269), (2, 22.03449156), (3, 61.69721441)] {
            assert!((Kind::Cantilever.square(k) / digits - 1.0).abs() < 1e-9);
        }
        assert!((Kind::Clamped.square(1) / 22.37328545 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_chain_of_rods_tends_to_the_beam() {
        for kind in [Kind::Cantilever, Kind::Clamped] {
            let error = |n| (discrete(kind, n)[0] / continuum(kind, 1) - 1.0).abs();
            let (coarse, fine) = (error(20), error(40));
            assert!(
                fine < 5e-3 && (coarse / fine).log2() > 1.9,
                "{coarse} {fine}"
            );
        }
    }
}
