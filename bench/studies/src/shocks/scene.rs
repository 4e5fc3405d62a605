//! The shocks, and the scenes that they begin with.

use crate::motions::linearized;
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt;
use taut_measure::random::Random;
use taut_model::{Bodies, HoistParams, Scene, SceneError};

pub(super) const SEGMENTS: usize = 24;

/// The step that the shocks are timed by, and the length of the jerk \[s].
pub(super) const FRAME: f64 = 1.0 / 60.0;

/// When the jerk begins \[s].
const JERK_START: f64 = 0.1;

/// How far the dropped load falls before the cable is straight, over the cable's length. This is 0.5 m for 10 m of
/// cable; half a metre would be half the cable of 1 m, folded and not slack.
pub(super) const DROP: f64 = 0.05;

/// How far the plucked cable's middle is drawn aside, over the cable's length.
pub(super) const PLUCK: f64 = 0.02;

const KICK_SEED: u64 = 1;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shock {
    /// The middle third of the segments is given a velocity in a random direction in space, the same for all.
    Kick {
        /// Its magnitude \[m/s].
        speed: f64,
    },
    /// The load is given 1 m/s downwards.
    LoadKick,
    /// The anchor moves by 0.2 L sideways within one step of 1/60 s.
    Jerk,
    /// The load falls by [`DROP`] L under a slack, bowed cable, and is caught.
    Drop,
    /// The taut cable is drawn aside in the middle by [`PLUCK`] L, at the tension of its equilibrium, and released.
    Pluck,
    /// The load's mass and inertia are doubled in the equilibrium of the single load.
    Double,
}

impl Shock {
    /// All that the sweep runs.
    pub(super) const ALL: [Self; 8] = [
        Self::Kick { speed: 1.0 },
        Self::Kick { speed: 5.0 },
        Self::Kick { speed: 20.0 },
        Self::LoadKick,
        Self::Jerk,
        Self::Drop,
        Self::Pluck,
        Self::Double,
    ];

    /// Time at which the world has done its work, and the energy can only fall \[s].
    pub(super) fn end(self) -> f64 {
        match self {
            Self::Jerk => JERK_START + FRAME,
            _ => 0.0,
        }
    }

    fn params(self, ratio: f64, length: f64) -> HoistParams {
        let jerk = if self == Self::Jerk { 0.2 } else { 0.0 } * length;
        HoistParams {
            segments: SEGMENTS,
            length,
            mass_ratio: ratio,
            seed: 1,
            move_x: jerk,
            move_start: JERK_START,
            move_duration: FRAME,
            ..HoistParams::default()
        }
    }

    /// Largest gap of a joint in the equilibrium that the motion is about \[m].
    pub(super) fn equilibrium_gap(self, ratio: f64, length: f64) -> Result<f64, SceneError> {
        let hanging = if self == Self::Double { 2.0 } else { 1.0 } * ratio;
        let scene = self.params(hanging, length).hanging_equilibrium()?;
        let rows = linearized(&scene);
        Ok(rows.phi.iter().fold(0.0, |most, phi| phi.abs().max(most)))
    }
}

impl fmt::Display for Shock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Kick { speed } => return write!(f, "kick {speed} m/s"),
            Self::LoadKick => "load kick",
            Self::Jerk => "jerk",
            Self::Drop => "drop",
            Self::Pluck => "pluck",
            Self::Double => "double",
        })
    }
}

/// The scene at the beginning of a shock: a hoist of 24 segments of 1 kg with Cosserat joints and EA = 2·10⁷ N, a load
/// of `ratio` kg on a cable of `length` m, in its static equilibrium unless the shock says otherwise. The segments turn
/// with random angular velocities of up to 10⁻³ rad/s, so that nothing stays in a plane.
pub(super) fn scene(shock: Shock, ratio: f64, length: f64) -> Result<Scene, SceneError> {
    let params = shock.params(ratio, length);
    if shock == Shock::Drop {
        let mut scene = params.build()?;
        bow(&mut scene.bodies, length);
        return Ok(scene);
    }
    let mut scene = params.hanging_equilibrium()?;
    let bodies = &mut scene.bodies;
    match shock {
        Shock::Kick { speed } => {
            let kick = random_direction(KICK_SEED) * speed;
            for v in &mut bodies.velocity[SEGMENTS / 3..2 * SEGMENTS / 3] {
                *v += kick;
            }
        }
        Shock::LoadKick => bodies.velocity[SEGMENTS].z -= 1.0,
        Shock::Pluck => pluck(bodies, length),
        Shock::Double => {
            bodies.mass[SEGMENTS] *= 2.0;
            bodies.inertia[SEGMENTS] *= 2.0;
        }
        Shock::Jerk | Shock::Drop => {}
    }
    Ok(scene)
}

/// A unit vector, all directions alike.
fn random_direction(seed: u64) -> Vector3<f64> {
    let mut random = Random::new(seed);
    loop {
        let v = random.vector(1.0);
        let square = v.norm_squared();
        if (0.01..=1.0).contains(&square) {
            return v / square.sqrt();
        }
    }
}

/// The rotation of a segment whose lower end points along `down`.
fn along(down: Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&-Vector3::z(), &down).unwrap_or_else(UnitQuaternion::identity)
}

/// Lays the unstretched cable in a bow, an arc in x with an S a tenth as wide in y, with the load at rest all but below the
/// anchor and [`DROP`] L above its place on the straight cable. A bow and not a kink, whose one joint would store more
/// energy in bending than the load sets free in falling.
fn bow(bodies: &mut Bodies, length: f64) {
    let tangent = |bend: f64, i: usize| {
        let s = (i as f64 + 0.5) / SEGMENTS as f64;
        let across = 0.1 * (std::f64::consts::TAU * s).cos();
        Vector3::new((bend * (1.0 - 2.0 * s)).sin(), bend * across, -1.0).normalize()
    };
    // The height falls as the bend grows: bisection for the bend at the wanted height.
    let height = |bend| (0..SEGMENTS).map(|i| -tangent(bend, i).z).sum::<f64>() / SEGMENTS as f64;
    let (mut straighter, mut rounder) = (0.0, 1.5);
    for _ in 0..60 {
        let bend = 0.5 * (straighter + rounder);
        if height(bend) > 1.0 - DROP {
            straighter = bend;
        } else {
            rounder = bend;
        }
    }
    let segment = length / SEGMENTS as f64;
    let mut end = Vector3::zeros();
    for i in 0..SEGMENTS {
        let down = tangent(rounder, i);
        bodies.position[i] = end + down * (0.5 * segment);
        bodies.orientation[i] = along(down);
        end += down * segment;
    }
    bodies.position[SEGMENTS] = end;
}

/// Draws the middle joint of the hanging cable aside by [`PLUCK`] L along y: two straight legs, each as long as that
/// half of the stretched cable was, so that the load rises a little. The joint in the middle keeps its gap upright.
fn pluck(bodies: &mut Bodies, length: f64) {
    let (aside, half) = (PLUCK * length, SEGMENTS / 2);
    let end = |i: usize, side: f64| -bodies.position[i].z + side * 0.5 * length / SEGMENTS as f64;
    let (middle, below) = (end(half - 1, 1.0), end(half, -1.0));
    let hook = -bodies.position[SEGMENTS].z;
    let [upper, lower] = [middle, hook - below].map(|leg| aside / leg);
    let down = |sine: f64| Vector3::new(0.0, sine, -(1.0 - sine * sine).sqrt());
    let (upper, lower) = (down(upper), down(-lower));
    let lower_start = upper * middle - Vector3::z() * (below - middle);
    for i in 0..=SEGMENTS {
        let depth = -bodies.position[i].z;
        let (start, leg, reached) = if i < half {
            (Vector3::zeros(), upper, depth)
        } else {
            (lower_start, lower, depth - below)
        };
        bodies.position[i] = start + leg * reached;
        if i < SEGMENTS {
            bodies.orientation[i] = along(leg);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaps(scene: &Scene) -> Vec<f64> {
        let rows = linearized(scene);
        (0..rows.constraints())
            .map(|c| Vector3::from_column_slice(&rows.phi[rows.row_range(c)][..3]).norm())
            .collect()
    }

    #[test]
    fn the_bow_is_closed_slack_and_not_plane() {
        for length in [1.0, 10.0] {
            let scene = scene(Shock::Drop, 1e3, length).unwrap();
            assert!(gaps(&scene).iter().all(|gap| *gap < 1e-14 * length));
            let load = scene.bodies.position[SEGMENTS];
            assert!((load.z / length + 1.0 - DROP).abs() < 1e-12, "{load}");
            // The S across does not quite come back.
            let holds = load.x.abs() < 1e-12 && load.y.abs() < 5e-3 * length;
            assert!(holds, "{load}");
            let middle = scene.bodies.position[SEGMENTS / 4];
            let holds = middle.x > 0.05 * length && middle.y > 0.005 * length;
            assert!(holds, "{middle}");
        }
    }

    #[test]
    fn the_plucked_cable_keeps_the_gaps_of_the_equilibrium() {
        for ratio in [1e2, 1e6] {
            let plucked = scene(Shock::Pluck, ratio, 10.0).unwrap();
            let hanging = scene(Shock::Double, ratio, 10.0).unwrap();
            for (a, b) in gaps(&plucked).into_iter().zip(gaps(&hanging)) {
                assert!((a - b).abs() < 1e-13, "{a} {b}");
            }
            let load = plucked.bodies.position[SEGMENTS];
            assert!(load.xy().norm() < 1e-14 && load.z > hanging.bodies.position[SEGMENTS].z);
            let aside = |i: usize| plucked.bodies.position[i].y;
            let most = aside(11).max(aside(12));
            assert!(most < 0.2 && most > 0.19, "{most}");
        }
    }

    #[test]
    fn the_kick_has_its_speed_and_three_components() {
        let kicked = scene(Shock::Kick { speed: 5.0 }, 1e3, 10.0).unwrap();
        let moving = (0..=SEGMENTS).filter(|&i| kicked.bodies.velocity[i].norm() > 0.0);
        let moving: Vec<_> = moving.collect();
        assert_eq!(moving, (8..16).collect::<Vec<_>>());
        let v = kicked.bodies.velocity[8];
        assert!((v.norm() - 5.0).abs() < 1e-14 && v.amin() > 0.5, "{v}");
    }

    #[test]
    fn the_doubled_load_hangs_lower() {
        let gap = |shock: Shock| shock.equilibrium_gap(1e3, 10.0).unwrap();
        assert!((gap(Shock::Double) / gap(Shock::Jerk) - 2.0).abs() < 0.03);
    }
}
