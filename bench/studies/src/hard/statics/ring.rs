//! H11: a straight elastic rod, bent to a ring and twisted, leaves its plane at the twist Θ = 2π √3 EI/GJ (Michell;
//! Zajac), in the mode of two waves: of n waves √(n² − 1).
//!
//! The ring of N segments, with the bend β = 2π/N and the twist Ω = Θ/N in every joint, is an equilibrium for any Ω.
//! Its second variation is that of Σ E(R_k, R_{k+1}) + Λ·Σ h t_k, with the force Λ that keeps the ring closed and
//! along its axis. All segments being alike, turned to their own place, tilts of the form q e^{2πi n k/N} decouple,
//! and the ring buckles where the 3 × 3 matrix of n = 2 gets singular. Its entries are differences of E, which is
//! written here from the swing and the twist of the relative rotation.

use super::buckling::{DISTURBANCE, Search, check};
use crate::hard::counted;
use crate::hard::special::root;
use crate::paper::specimens::largest;
use indicatif::ProgressBar;
use nalgebra::{Complex, Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, TAU};
use taut_ground::modes::natural;
use taut_model::{Body, Constraint, Cosserat, Frame, JointLaw, RowLaw, Scene, SceneError};
use taut_output::check::{Check, ExperimentError, Outcome, Verdict};

/// Bar of the critical twist.
pub(super) const BAR: f64 = 0.02;
/// Time step and duration \[s].
const RUN: [f64; 2] = [0.05, 60.0];
/// GJ/EI.
pub(super) const RATIO: f64 = 3.0;

/// Michell's twist in turns for a mode of `waves` ≥ 2 waves.
pub(super) fn michell(waves: usize) -> f64 {
    ((waves * waves) as f64 - 1.0).sqrt() / RATIO
}

/// The joint's energy for small turns `a`, `b` of its sides, each in the frame of its own segment (tangent, across in
/// the plane, axis of the ring), over EI/h.
fn energy(a: &Vector3<f64>, b: &Vector3<f64>, beta: f64, omega: f64) -> f64 {
    let (a, b) = (
        Rotation3::from_scaled_axis(*a),
        Rotation3::from_scaled_axis(*b),
    );
    let bend = Rotation3::from_scaled_axis(Vector3::z() * beta);
    let twist = Rotation3::from_scaled_axis(Vector3::x() * omega);
    // Side b's frame is turned on by the twist, about its own tangent.
    let relative = a.inverse() * bend * b * twist;
    let q = UnitQuaternion::from_rotation_matrix(&relative);
    let cosine = relative.matrix()[(0, 0)];
    let sine = relative.matrix()[(1, 0)].hypot(relative.matrix()[(2, 0)]);
    let theta = sine.atan2(cosine);
    let mut found = 2.0 * q.i.atan2(q.w);
    found -= TAU * ((found - omega) / TAU).round();
    0.5 * (theta * theta + RATIO * found * found)
}

/// The smallest twist in turns at which the ring of `n` segments leaves its plane in a mode of `waves` waves.
pub(super) fn chain(n: usize, waves: usize) -> f64 {
    let beta = TAU / n as f64;
    let determinant = |turns: f64| stability(beta, TAU * turns / n as f64, waves as f64 * beta);
    let guess = michell(waves);
    root(determinant, 0.7 * guess, 1.3 * guess)
}

/// Determinant of the second variation for the phase `alpha` a segment.
fn stability(beta: f64, omega: f64, alpha: f64) -> f64 {
    const H: f64 = 2e-3;
    // Turns (of a, of b) along two of the six coordinates.
    let at = |i: usize, x: f64, j: usize, y: f64| {
        let mut turns = [Vector3::zeros(); 2];
        turns[i / 3][i % 3] += x;
        turns[j / 3][j % 3] += y;
        energy(&turns[0], &turns[1], beta, omega)
    };
    let slope = |i: usize| {
        let d = |h: f64| (at(i, h, i, 0.0) - at(i, -h, i, 0.0)) / (2.0 * h);
        (4.0 * d(H) - d(2.0 * H)) / 3.0
    };
    let second = |i: usize, j: usize| {
        let d = |h: f64| {
            let corners = at(i, h, j, h) - at(i, h, j, -h) - at(i, -h, j, h) + at(i, -h, j, -h);
            corners / (4.0 * h * h)
        };
        (4.0 * d(H) - d(2.0 * H)) / 3.0
    };
    // θ·(g + h t × Λ) = 0 with Λ along z: h Λ = g·y, since t × z = −y.
    let force = slope(1) + slope(4);
    let (forward, back) = (Complex::cis(alpha), Complex::cis(-alpha));
    let matrix = Matrix3::from_fn(|i, j| {
        let own = second(i, j) + second(3 + i, 3 + j);
        // ½ Λ·(θ × (θ × h t)) = ½ h Λ θ_z θ_t.
        let closing = if i + j == 2 && i != j {
            0.5 * force
        } else {
            0.0
        };
        let (there, here) = (second(i, 3 + j), second(j, 3 + i));
        Complex::from(own + closing) + forward * there + back * here
    });
    matrix.determinant().re
}

/// The flat ring of radius 1 m of `n` segments, EI = 1 N m², 1 kg/m, twisted by `turns` and disturbed.
pub(super) fn scene(n: usize, turns: f64) -> Result<Scene, SceneError> {
    let beta = TAU / n as f64;
    let h = 2.0 * (0.5 * beta).sin();
    let mut scene = Scene::new("ring");
    let along = UnitQuaternion::from_scaled_axis(Vector3::y() * FRAC_PI_2);
    // Body frame: z along the segment. u along it, the other two wherever.
    let axes = along.inverse().to_rotation_matrix().into_inner();
    let middle = (0.5 * beta).cos();
    for k in 0..n {
        let angle = beta * k as f64;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle) * along;
        let (sine, cosine) = angle.sin_cos();
        let mut rod = Body::rod(h, 0.02, h)
            .at(Vector3::new(sine, -cosine, 0.0) * middle)
            .turned(turn);
        let wave = (2.0 * angle).cos() + 0.3 * (3.0 * angle).sin();
        rod.velocity.z = DISTURBANCE * wave;
        scene.add_body(format!("segment-{}", k + 1), rod);
    }
    let law = |compliance: f64| Some(RowLaw::new(compliance, 0.0));
    let law = JointLaw {
        stretch: Some(RowLaw::RIGID),
        bend: law(h),
        twist: law(h / RATIO),
    };
    let twist = Rotation3::from_scaled_axis(Vector3::x() * (TAU * turns / n as f64));
    for k in 0..n {
        let end = Vector3::z() * (0.5 * h);
        let next = (k + 1) % n;
        let frames = [
            Frame::body(k, end).with_axes(axes),
            Frame::body(next, -end).with_axes(axes * twist),
        ];
        // The last one closes the ring.
        let group = u32::from(next == 0);
        let joint = Constraint::Cosserat(Cosserat::new(frames, law));
        scene.add_constraint(format!("joint-{}", k + 1), joint, group);
    }
    scene.validate()?;
    Ok(scene)
}

fn off_plane(scene: &Scene) -> f64 {
    largest(scene.bodies.position.iter().map(|p| p.z.abs()))
}

/// Unstable modes of the flat ring at a twist.
fn unstable(n: usize, turns: f64) -> Result<usize, SceneError> {
    let mut ring = scene(n, turns)?;
    ring.bodies.velocity.fill(Vector3::zeros());
    let modes = natural(&ring, &[0, 1, 2, 3, 4, 5]);
    let squares = modes.map_or_else(Vec::new, |m| m.squares);
    Ok(squares.iter().filter(|w| **w < -SMALL).count())
}

/// ω² beyond which a mode is told from the ring's six free motions \[1/s²].
const SMALL: f64 = 1e-2;

/// A mode of more waves: a ring held flat until then has two more unstable modes, in sine and in cosine, beyond its twist.
fn higher(n: usize, waves: usize) -> Result<Check, ExperimentError> {
    let (curve, exact) = (michell(waves), chain(n, waves));
    let (mut low, mut high) = ((1.0 - BAR) * exact, (1.0 + BAR) * exact);
    let (below, above) = (unstable(n, low)?, unstable(n, high)?);
    for _ in 0..8 {
        let middle = 0.5 * (low + high);
        if unstable(n, middle)? > below {
            high = middle;
        } else {
            low = middle;
        }
    }
    let found = 0.5 * (low + high);
    let check = Check::within(
        format!("GJ/EI = {RATIO}, N = {n}, {waves} waves, turns"),
        format!("{curve:.6}; chain {exact:.6}"),
        format!("{found:.5}; {below} unstable modes below, {above} above"),
        (found / curve - 1.0).abs(),
        BAR,
    )
    .by("relative to the continuum's, by halving the bracket; modes of the ring at rest")
    .algebraic_part((found / exact - 1.0).abs())
    .space_part((exact / curve - 1.0).abs());
    Ok(if above == below + 2 {
        check
    } else {
        Check {
            verdict: Verdict::Fail,
            ..check
        }
    })
}

pub(super) fn outcome(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let counts: &[usize] = if quick { &[24] } else { &[24, 48, 96] };
    let mut checks = Vec::new();
    for &n in counted(progress, counts) {
        let search = Search {
            case: format!("GJ/EI = {RATIO}, N = {n}, turns"),
            curve: michell(2),
            exact: chain(n, 2),
            bar: BAR,
            halvings: if quick { 0 } else { 11 },
            run: RUN,
        };
        checks.extend(check(search, |turns| scene(n, turns), off_plane)?);
        // A wave of fewer segments is that of the chain, not of the continuum.
        for waves in [3, 4].into_iter().filter(|w| 16 * w <= n) {
            checks.push(higher(n, waves)?);
        }
    }
    Ok(checks.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ring_of_segments_has_the_known_twists() {
        for (n, printed, error) in [(24, 0.5826, 2e-4), (48, 0.5786, 6e-5), (96, 0.5777, 6e-5)] {
            let found = chain(n, 2);
            assert!((found - printed).abs() < error, "{n}: {found}");
        }
        assert!((chain(192, 3) / michell(3) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn the_model_s_ring_leaves_its_plane_at_the_exact_twist() {
        let critical = chain(24, 2);
        let at = |part: f64| {
            let ring = scene(24, part * critical).expect("a scene");
            super::super::buckling::growth(ring, RUN, off_plane).expect("steps")
        };
        let (below, above) = (at(1.0 - 3e-4), at(1.0 + 3e-4));
        assert!(below < 1.0 && above > 1.0, "{below} {above}");
    }

    #[test]
    fn the_flat_ring_is_an_equilibrium() {
        let mut ring = scene(12, 0.4).expect("a scene");
        for v in &mut ring.bodies.velocity {
            *v = Vector3::zeros();
        }
        let mut stepper =
            taut_integrator::Stepper::new(ring, taut_integrator::StepOptions::paper())
                .expect("sound");
        stepper.step().expect("solvable");
        let speed = stepper.scene().bodies.velocity.iter().map(Vector3::norm);
        assert!(largest(speed) < 1e-13);
    }
}
