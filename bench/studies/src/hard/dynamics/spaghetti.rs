//! H31: the flying spaghetti: a flexible rod that is thrown by a force and a moment on one end, and then flies free.
//!
//! After Simo and Vu-Quoc, *On the dynamics in space of rods undergoing large motions* (1988): L = 10, EA = GA = 10⁴,
//! EI = GJ = 500, Aρ = 1, Jρ = 10 across; the force 8 along x and the moment 80 about y act on the lower end for 2.5
//! s, here with half that moment about z besides, so that nothing stays in a plane. No closed form is known:
//! afterwards momentum and angular momentum have to stay (the first one is the force times 2.5 s), the energy must not
//! grow, and the motion has to converge with the step.
//!
//! Where the force sets in and stops it excites axial and shear waves of up to 2√(EA/(Aρ l²)) = 400 rad/s in the chain:
//! the order of the motion shows only at steps that resolve them.

use crate::hard::{DT, either, farthest, solvers, together, worse};
use indicatif::ProgressBar;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use taut_ground::pace;
use taut_integrator::{GeometricStiffness, StepError, StepOptions, Stepper};
use taut_model::{Body, Constraint, Cosserat, Frame, Scene, Stiffness, hanging_axes};
use taut_output::check::{Check, ExperimentError, Outcome};

const RODS: usize = 20;
const LENGTH: f64 = 10.0;
const DENSITY: f64 = 1.0;
/// Rotary inertia per length across the rod; twice that along it.
const ROTARY: f64 = 10.0;
const STIFFNESS: Stiffness = Stiffness {
    ea: 1e4,
    ei: 500.0,
    gj: 500.0,
};
/// Throw: force along x \[N], moment \[N m], duration \[s].
const FORCE: f64 = 8.0;
const MOMENT: [f64; 3] = [0.0, 80.0, 40.0];
const THROW: f64 = 2.5;
/// Bars: linear momentum and gain of energy after the throw (relative).
const MOMENTUM_BAR: f64 = 1e-12;
const GAIN_BAR: f64 = 1e-3;
/// Largest difference of an order from 2 that passes.
const ORDER_BAR: f64 = 0.2;
/// Largest relative drift of the angular momentum at 1/240 s that passes.
const ANGULAR_BAR: f64 = 1e-5;

/// The rod from (6, 0, 0) to (0, 0, 8), at rest.
pub(super) fn scene() -> Scene {
    let l = LENGTH / RODS as f64;
    let mut scene = Scene::new("flying spaghetti");
    let (lower, upper) = (Vector3::new(6.0, 0.0, 0.0), Vector3::new(0.0, 0.0, 8.0));
    let along = (upper - lower) / LENGTH;
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along);
    let turn = turn.unwrap_or_else(UnitQuaternion::identity);
    let across = l * (ROTARY + DENSITY * l * l / 12.0);
    let inertia = Matrix3::from_diagonal(&Vector3::new(across, across, 2.0 * ROTARY * l));
    for i in 0..RODS {
        let place = lower + along * (l * (i as f64 + 0.5));
        let rod = Body::new(DENSITY * l, inertia).at(place).turned(turn);
        scene.add_body(format!("rod-{}", i + 1), rod);
    }
    let half = Vector3::new(0.0, 0.0, 0.5 * l);
    let law = STIFFNESS.joint_law(l, 0.0);
    for i in 1..RODS {
        let frames = [Frame::body(i, -half), Frame::body(i - 1, half)];
        let joint = Cosserat::new(frames.map(|f| f.with_axes(hanging_axes())), law);
        scene.add_constraint(format!("joint-{i}"), Constraint::Cosserat(joint), 0);
    }
    scene
}

pub(super) fn scenes() -> Result<Vec<Scene>, ExperimentError> {
    let mut scene = scene();
    scene.bodies.force[0].x = FORCE;
    scene.bodies.torque[0] = Vector3::from(MOMENT);
    Ok(vec![scene])
}

/// Records of a flight.
#[derive(Default)]
struct Flight {
    /// Centres of the first and the last rod in turn, after each sixtieth of a second \[m].
    ends: Vec<Vector3<f64>>,
    /// Largest departure of the momentum from the impulse, relative.
    momentum: f64,
    /// Largest change of the angular momentum about the origin after the throw, relative.
    angular: f64,
    /// Energy at the end of the throw \[J].
    energy: f64,
    gain: f64,
    /// Relative change of the energy from the end of the throw to the last step.
    change: f64,
    redone: usize,
}

fn fly(options: StepOptions, time: f64) -> Result<Flight, StepError> {
    let dt = options.dt;
    let half = Vector3::new(0.0, 0.0, -0.5 * LENGTH / RODS as f64);
    let mut stepper = Stepper::new(scene(), options)?;
    let mut found = Flight::default();
    let throw = (THROW / dt).round() as usize;
    let each = (DT / dt).round() as usize;
    let mut spin = Vector3::zeros();
    for n in 0..(time / dt).round() as usize {
        // At the jump its mean: the step's impulse then is that of the force.
        let share = match n.cmp(&throw) {
            std::cmp::Ordering::Less => 1.0,
            std::cmp::Ordering::Equal => 0.5,
            std::cmp::Ordering::Greater => 0.0,
        };
        let force = Vector3::x() * (FORCE * share);
        let lever = stepper.scene().bodies.orientation[0] * half;
        let torque = lever.cross(&force) + Vector3::from(MOMENT) * share;
        stepper.set_load(0, force, torque)?;
        found.redone += usize::from(pace::step(&mut stepper)?.redone);
        let after = stepper.scene();
        if (n + 1) % each == 0 {
            let ends = [0, RODS - 1].map(|i| after.bodies.position[i]);
            found.ends.extend(ends);
        }
        if n <= throw {
            continue;
        }
        // A step moves and turns the bodies freely: that keeps their momenta.
        let impulse = Vector3::x() * (FORCE * THROW);
        let error = (after.momentum() - impulse).norm() / impulse.norm();
        found.momentum = worse(found.momentum, error);
        let angular = after.angular_momentum(&Vector3::zeros());
        let energy = stepper.energy().total();
        if n == throw + 1 {
            (spin, found.energy) = (angular, energy);
        }
        found.angular = worse(found.angular, (angular - spin).norm() / spin.norm());
        found.change = energy / found.energy - 1.0;
        found.gain = worse(found.gain, found.change);
    }
    Ok(found)
}

pub(super) fn outcome(quick: bool, _progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let time = either(quick, 3.0, 10.0);
    let run = |finer: u32, stiffness: GeometricStiffness| {
        let dt = 1.0 / (60.0 * f64::from(finer));
        let options = StepOptions {
            dt,
            stiffness,
            ..StepOptions::default()
        };
        fly(options, time)
    };
    let usual = StepOptions::default().stiffness;
    let [coarse, fine] = [4, 16].map(|finer| run(finer, usual));
    let [first, second, third] = [64, 128, 256].map(|finer| run(finer, usual));
    let (coarse, fine) = (coarse?, fine?);
    let (first, second, third) = (first?, second?, third?);
    let distance = |a: &Flight, b: &Flight| farthest(&a.ends, &b.ends);
    let order = (distance(&first, &second) / distance(&second, &third)).log2();
    let drift = 0.5 * (coarse.angular / fine.angular).log2();
    let free = run(4, GeometricStiffness::Off)?;
    let mut checks = vec![
        kept("1/240 s: momentum", coarse.momentum),
        Check::second_order(
            "motion: order of self-convergence, 1/3840 to 1/15360 s",
            order,
            ORDER_BAR,
        )
        .noting(format!(
            "the ends differ by {:.1e} m between 1/240 and 1/15360 s, by {:.1e} m between the last two; the guard took \
             {} steps back at 1/240 s",
            distance(&coarse, &third),
            distance(&second, &third),
            coarse.redone
        )),
        Check::second_order(
            "angular momentum: order of its drift, 1/240 to 1/960 s",
            drift,
            ORDER_BAR,
        )
        .noting(format!(
            "relative drift {:.1e} at 1/240 s, {:.1e} at 1/960 s; {:.1e} at 1/240 s without geometric stiffness: what \
             remains is the couple of a force that, filtered over three steps, is not along the gap it acts across",
            coarse.angular, fine.angular, free.angular
        )),
        Check::off(
            "angular momentum: its drift at 1/240 s",
            "kept",
            coarse.angular,
            "",
            ANGULAR_BAR,
        )
        .by("largest change after the throw, relative"),
    ];
    checks.extend(
        [("1/240 s", &coarse), ("1/960 s", &fine)].map(|(name, flight)| {
            Check::within(
                format!("{name}: energy after the throw"),
                format!("no more than {:.3} J", flight.energy),
                format!("{:+.1e}, {:+.1e} at the end", flight.gain, flight.change),
                flight.gain,
                GAIN_BAR,
            )
            .by("largest gain, relative")
        }),
    );
    let chosen = solvers().into_iter();
    let chosen = chosen.filter(|choice| !(quick && choice.backend.is_iterative()));
    let found = chosen.map(|choice| {
        let flight = fly(choice.options(DT), 3.0)?;
        Ok((choice.family(), kept("", flight.momentum)))
    });
    let found: Result<_, StepError> = found.collect();
    checks.extend(together("1/60 s: momentum", found?));
    Ok(checks.into())
}

fn kept(name: &str, error: f64) -> Check {
    let check = Check::off(
        name,
        format!("F t = {} N s", FORCE * THROW),
        error,
        "",
        MOMENTUM_BAR,
    );
    check.by("relative, largest after the throw")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spaghetti_is_straight_and_closed() {
        let scene = scene();
        let mut rows = taut_model::Linearized::new(&scene);
        rows.update(&scene, 0.0);
        assert!(rows.phi.iter().all(|phi| phi.abs() < 1e-13));
        assert!((scene.mass() - 10.0).abs() < 1e-12);
    }
}
