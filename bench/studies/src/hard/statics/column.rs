//! H09, H10: straight chains along x that buckle under thrust, their own weight, or torque.
//!
//! Length 1 m, EI = GJ = 1 N m², 1 kg/m; n segments of l = 1/n, no stretch. With c = EI/l of an inner joint:
//!
//! ```text
//! thrust P, pinned       P = π²,                  chain 4 (c/l) sin²(π/2n)
//! weight q, clamped      q = (9/4) j²_{−1/3,1},   chain: K ψ = q D ψ of the tilts
//! torque T, pinned,      T²/4 = P + π²,           chain (1 + T²/4c²)^½ = (1 + l P/2c)/cos(π/n)
//!   tension P
//! torque T, clamped      T/2 = tan ½T,            chain: [`buckling_torque`]
//! ```
//!
//! The third: the tilts ψ_j (complex, y + iz) obey m_{j+1} = m_j + i l P ψ_j with m_j of
//! [`crate::paper::specimens::twist`] and no moment across at the ends; ψ_j = χ_j e^{iδj}, tan δ = T/2c, makes it
//! (c² + T²/4)^½ (χ_{j+1} + χ_{j−1}) = (2c + l P) χ_j, and the ends ask for χ ∝ cos(πj/n + …). Pinned ends carry
//! torques of fixed direction on the outer segments; between clamped ends the twist T L/GJ is given.

use super::buckling::{DISTURBANCE, Search, check, off_axis};
use crate::hard::special::bessel_zero;
use crate::hard::{counted, either};
use crate::paper::specimens::twist::{buckling_torque, greenhill};
use indicatif::ProgressBar;
use nalgebra::{DMatrix, Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};
use taut_model::{
    Body, Constraint, Cosserat, Frame, JointLaw, RowLaw, Scene, SceneError, Slider, Spherical,
};
use taut_output::check::{Check, ExperimentError, Outcome};

/// Bars of thrust and weight, and of the torques.
const BAR: f64 = 0.01;
const TORQUE_BAR: f64 = 0.02;
/// Halvings of a bracket.
const HALVINGS: usize = 8;

/// How the ends are held; the far one slides along x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Ends {
    /// Ball joints; torques ∓T (N m) of fixed direction on the outer segments.
    Pinned {
        /// T.
        torque: f64,
    },
    /// Clamps, the far one turned about x by this angle (rad).
    Clamped {
        /// T L/GJ.
        twist: f64,
    },
    /// A clamp at the origin, the other end free, under gravity towards it (m/s²).
    Free {
        /// q over 1 kg/m.
        gravity: f64,
    },
}

/// The straight chain, disturbed; `tension` (N) draws the far end.
pub(super) fn scene(n: usize, ends: Ends, tension: f64) -> Result<Scene, SceneError> {
    let l = 1.0 / n as f64;
    let mut scene = Scene::new("column");
    // The rod's z along x, its x along −z.
    let along = UnitQuaternion::from_scaled_axis(Vector3::y() * FRAC_PI_2);
    let rolled = |angle: f64| UnitQuaternion::from_scaled_axis(Vector3::x() * angle);
    let per_joint = match ends {
        Ends::Pinned { torque } => torque * l,
        Ends::Clamped { twist } => twist * l,
        Ends::Free { .. } => 0.0,
    };
    for i in 0..n {
        let mut rod = Body::rod(l, 0.02, l)
            .at(Vector3::x() * (l * (i as f64 + 0.5)))
            .turned(rolled(per_joint * (i as f64 + 0.5)) * along);
        let t = i as f64;
        rod.velocity = Vector3::new(0.0, (1.7 * t).sin(), (2.3 * t + 1.0).cos()) * DISTURBANCE;
        if let Ends::Pinned { torque } = ends {
            let outer = f64::from(u8::from(i + 1 == n)) - f64::from(u8::from(i == 0));
            rod.torque = Vector3::x() * (outer * torque);
        }
        scene.add_body(format!("segment-{}", i + 1), rod);
    }
    let law = |part: f64| JointLaw {
        stretch: Some(RowLaw::RIGID),
        bend: Some(RowLaw::new(part * l, 0.0)),
        twist: Some(RowLaw::new(part * l, 0.0)),
    };
    // u along the rod.
    let axes = along.inverse().to_rotation_matrix().into_inner();
    let at = |i: usize, sign: f64| Frame::body(i, Vector3::z() * (sign * 0.5 * l)).with_axes(axes);
    let world = |x: f64| Frame::world(Vector3::x() * x).with_axes(Matrix3::identity());
    let ball = |frames| {
        Constraint::Spherical(Spherical {
            frames,
            stretch: RowLaw::RIGID,
        })
    };
    let first = [world(0.0), at(0, -1.0)];
    let first = match ends {
        Ends::Pinned { .. } => ball(first),
        _ => Constraint::Cosserat(Cosserat::new(first, law(0.5))),
    };
    scene.add_constraint("start", first, 0);
    for j in 1..n {
        let joint = Cosserat::new([at(j - 1, 1.0), at(j, -1.0)], law(1.0));
        scene.add_constraint(format!("joint-{j}"), Constraint::Cosserat(joint), 0);
    }
    if let Ends::Free { gravity } = ends {
        scene.gravity = Vector3::x() * -gravity;
        scene.validate()?;
        return Ok(scene);
    }
    let mut end = Body::sphere(0.1, l).at(Vector3::x());
    end.force = Vector3::x() * tension;
    let end = scene.add_body("end", end);
    let centre = Frame::body(end, Vector3::zeros());
    let last = match ends {
        Ends::Clamped { twist } => {
            let turned = Rotation3::from_scaled_axis(Vector3::x() * twist).into_inner();
            let frames = [at(n - 1, 1.0), centre.with_axes(turned)];
            Constraint::Cosserat(Cosserat::new(frames, law(0.5)))
        }
        _ => ball([at(n - 1, 1.0), centre]),
    };
    scene.add_constraint("end", last, 0);
    let slider = Slider::new([world(0.0), centre.with_axes(Matrix3::identity())]);
    scene.add_constraint("slider", Constraint::Slider(slider), 0);
    scene.validate()?;
    Ok(scene)
}

/// Critical thrust of the pinned chain.
pub(super) fn euler(n: usize) -> f64 {
    4.0 * (n as f64).powi(2) * (FRAC_PI_2 / n as f64).sin().powi(2)
}

/// Critical weight a metre of the clamped chain: half a joint's length at the clamp, weights in the segments' middles.
pub(super) fn own_weight(n: usize) -> f64 {
    let c = n as f64;
    // ½ l² q (n − i − ½) ψ_i² is what a tilt lowers the weights by.
    let lowers = |i: usize| ((c - i as f64 - 0.5) / (c * c)).sqrt();
    let spring = |j: usize| if j == 0 { 2.0 * c } else { c };
    let entry = |i: usize, j: usize| {
        let k = match i.abs_diff(j) {
            0 => spring(i) + if i + 1 < n { c } else { 0.0 },
            1 => -c,
            _ => 0.0,
        };
        k / (lowers(i) * lowers(j))
    };
    DMatrix::from_fn(n, n, entry).symmetric_eigenvalues().min()
}

/// Critical weight of the beam: (9/4) j²_{−1/3,1}.
pub(super) fn own_weight_of_beam() -> f64 {
    2.25 * bessel_zero(-1.0 / 3.0, 1).powi(2)
}

/// Critical torque between pinned ends under the tension `tension`: of the chain.
pub(super) fn pinned_torque(n: usize, tension: f64) -> f64 {
    let (c, l) = (n as f64, 1.0 / n as f64);
    let ratio = (1.0 + 0.5 * l * tension / c) / (PI / c).cos();
    2.0 * c * (ratio * ratio - 1.0).sqrt()
}

/// Critical torque of the rod between pinned ends.
pub(super) fn pinned_torque_of_rod(tension: f64) -> f64 {
    2.0 * (tension + PI * PI).sqrt()
}

/// Where the chain buckles that `loaded` puts between its ends and draws by a tension (N), for a load.
fn buckles(
    n: usize,
    search: Search,
    loaded: impl Fn(f64) -> (Ends, f64),
) -> Result<Vec<Check>, ExperimentError> {
    let scene = |load: f64| {
        let (ends, tension) = loaded(load);
        scene(n, ends, tension)
    };
    check(search, scene, off_axis)
}

/// H09.
pub(super) fn thrust_and_weight(
    quick: bool,
    progress: &ProgressBar,
) -> Result<Outcome, ExperimentError> {
    let counts: &[usize] = if quick { &[12] } else { &[12, 24, 48] };
    let mut checks = Vec::new();
    for &n in counted(progress, counts) {
        let search = |what: &str, [curve, exact]: [f64; 2], run| Search {
            case: format!("{what}, N = {n}"),
            curve,
            exact,
            bar: BAR,
            halvings: either(quick, 0, HALVINGS),
            run,
        };
        let thrust = search("thrust, pinned", [PI * PI, euler(n)], [0.02, 20.0]);
        let pinned = |p: f64| (Ends::Pinned { torque: 0.0 }, -p);
        checks.extend(buckles(n, thrust, pinned)?);
        let weights = [own_weight_of_beam(), own_weight(n)];
        let weight = search("own weight, clamped", weights, [0.04, 80.0]);
        checks.extend(buckles(n, weight, |q| (Ends::Free { gravity: q }, 0.0))?);
    }
    Ok(checks.into())
}

/// H10.
pub(super) fn torque(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let counts: &[usize] = if quick { &[24] } else { &[24, 48] };
    // Long rods under tension buckle in many waves: they need the finer chain.
    let fine = |n: usize, tension: f64| tension < 50.0 || n >= 48;
    let tensions: &[f64] = either(quick, &[0.0], &[-5.0, 0.0, 10.0, 100.0]);
    let mut checks = Vec::new();
    for &n in counted(progress, counts) {
        let search = |what: String, [curve, exact]: [f64; 2], tension: f64| Search {
            case: format!("torque, {what}, N = {n}"),
            curve,
            exact,
            bar: TORQUE_BAR,
            halvings: either(quick, 0, HALVINGS),
            // The tension's transverse stiffness is explicit.
            run: [0.01 / (1.0 + tension.max(0.0) / 10.0).sqrt(), 10.0],
        };
        let torques = [greenhill(), buckling_torque(n, 1e12, 0.0)];
        let clamped = search("clamped".to_owned(), torques, 0.0);
        checks.extend(buckles(n, clamped, |t| (Ends::Clamped { twist: t }, 0.0))?);
        for &tension in tensions.iter().filter(|t| fine(n, **t)) {
            let torques = [pinned_torque_of_rod(tension), pinned_torque(n, tension)];
            let pinned = search(format!("pinned, P = {tension}"), torques, tension);
            checks.extend(buckles(n, pinned, |torque| {
                (Ends::Pinned { torque }, tension)
            })?);
        }
    }
    Ok(checks.into())
}

pub(super) fn scenes_of_thrust() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![
        scene(8, Ends::Pinned { torque: 0.0 }, -8.0)?,
        scene(8, Ends::Free { gravity: 6.0 }, 0.0)?,
    ])
}

pub(super) fn scenes_of_torque() -> Result<Vec<Scene>, ExperimentError> {
    Ok(vec![
        scene(8, Ends::Clamped { twist: 7.0 }, 0.0)?,
        scene(8, Ends::Pinned { torque: 5.0 }, 0.0)?,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(ours: f64, reference: f64, error: f64) {
        assert!((ours / reference - 1.0).abs() < error, "{ours} {reference}");
    }

    #[test]
    fn the_continua_have_the_known_numbers() {
        near(own_weight_of_beam(), 7.837347439, 1e-9);
        near(own_weight_of_beam().cbrt(), 1.98635270, 1e-8);
        near(greenhill(), 8.986818916, 1e-9);
        near(pinned_torque_of_rod(0.0), 2.0 * PI, 1e-15);
    }

    #[test]
    fn the_chains_near_them_at_second_order() {
        for (of, limit) in [
            (euler as fn(usize) -> f64, PI * PI),
            (own_weight, own_weight_of_beam()),
            (|n| pinned_torque(n, 10.0), pinned_torque_of_rod(10.0)),
        ] {
            let off = |n| of(n) / limit - 1.0;
            near(off(32) / off(64), 4.0, 0.02);
        }
    }
}
