//! From velocity changes to velocities and positions: v⁺ = v + Δv, x⁺ = x + Δt v⁺, and the rotation of
//! [`crate::gyroscopic`], of bodies with an axis of symmetry four abreast.

use crate::gyroscopic;
use crate::inertia::{RodShape, Rods};
use crate::six::{Group, Six};
use nalgebra::{UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_4;
use taut_lanes::functions::sinc_cos;
use taut_lanes::vector::{
    Quaternion, Vec3, add, dot, gather, load, product, save, scale, scale_add, sub, turned,
};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
use taut_model::{ABREAST, Bodies, Mobility};

/// Moves all bodies over `dt` (s). `Err(body)`, the first of them, where a state is no longer
/// finite.
pub(crate) fn move_bodies(
    bodies: &mut Bodies,
    rods: &Rods,
    others: &[usize],
    v: &Six,
    dv: &Six,
    dt: f64,
) -> Result<(), usize> {
    let mut lost = dispatch(
        Level::best(),
        Move {
            bodies: &mut *bodies,
            rods,
            v,
            dv,
            dt,
        },
    );
    for &i in others {
        take_velocities(bodies, i, &v.get(i), &dv.get(i));
        bodies.position[i] += dt * bodies.velocity[i];
        turn(bodies, i, dt);
        let moved = bodies.position[i].sum() + bodies.orientation[i].coords.sum();
        let rates = bodies.velocity[i].sum() + bodies.angular_velocity[i].sum();
        if !(moved + rates).is_finite() {
            lost = Some(lost.map_or(i, |first| first.min(i)));
        }
    }
    lost.map_or(Ok(()), Err)
}

fn take_velocities(bodies: &mut Bodies, i: usize, v: &[f64; 6], dv: &[f64; 6]) {
    let sum = |k: usize| v[k] + dv[k];
    bodies.velocity[i] = Vector3::new(sum(0), sum(1), sum(2));
    bodies.angular_velocity[i] = Vector3::new(sum(3), sum(4), sum(5));
}

/// The rotation of one body over `dt`, by its angular velocity.
fn turn(bodies: &mut Bodies, i: usize, dt: f64) {
    let (orientation, omega) = (&mut bodies.orientation[i], &mut bodies.angular_velocity[i]);
    match bodies.mobility[i] {
        Mobility::Dynamic => gyroscopic::turn(&bodies.inertia[i], orientation, omega, dt),
        // It spins as it is told to.
        _ => gyroscopic::turn_by(orientation, omega, dt),
    }
}

/// Moves the bodies with an axis of symmetry; the first one whose state is no longer finite.
struct Move<'a> {
    bodies: &'a mut Bodies,
    rods: &'a Rods,
    v: &'a Six,
    dv: &'a Six,
    dt: f64,
}

/// The quaternion of the rotation vector `turn`, and the square of half its angle.
#[inline(always)]
fn exponential<V: Lanes>(turn: &Vec3<V>) -> (Quaternion<V>, V) {
    let half = V::splat(0.5);
    let square = dot(turn, turn) * half * half;
    let (sinc, cosine) = sinc_cos(square);
    let scale = sinc * half;
    (
        [turn[0] * scale, turn[1] * scale, turn[2] * scale, cosine],
        square,
    )
}

/// Orientation and angular velocity after `dt`, and the square of half the larger angle turned by.
#[inline(always)]
fn turn_rods<V: Lanes>(
    orientation: &Quaternion<V>,
    omega: &Vec3<V>,
    shape: &RodShape,
    dt: V,
) -> (Quaternion<V>, Vec3<V>, V) {
    let axis = turned(orientation, &load(&shape.axis));
    let spin = dot(omega, &axis) * V::load(&shape.ratio);
    let precession = scale_add(&axis, spin, omega);
    let (carried, first) = exponential(&scale(&precession, dt));
    let (spun, second) = exponential(&scale(&sub(omega, &precession), dt));
    let mut q = product(&carried, &product(&spun, orientation));
    let square = q[3].mul_add(q[3], dot(&[q[0], q[1], q[2]], &[q[0], q[1], q[2]]));
    // One Newton step for 1/√square.
    let scale = V::splat(0.5) * (V::splat(3.0) - square);
    for q in &mut q {
        *q = *q * scale;
    }
    (q, turned(&carried, omega), first.max(second))
}

impl Kernel for Move<'_> {
    type Output = Option<usize>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Option<usize> {
        let Self {
            bodies,
            rods,
            v,
            dv,
            dt,
        } = self;
        let (v, dv, step) = (v.view(), dv.view(), I::X4::splat(dt));
        let mut lost: Option<usize> = None;
        for (pack, shape) in rods.bodies.iter().zip(&rods.shapes) {
            let group = Group::new(*pack, shape.neighbours);
            let [vx, vy, vz, x, y, z] = v.load::<I::X4>(&group);
            let [ux, uy, uz, p, q, r] = dv.load::<I::X4>(&group);
            let velocity = add(&[vx, vy, vz], &[ux, uy, uz]);
            let omega = add(&[x, y, z], &[p, q, r]);
            let position = gather(pack.map(|i| bodies.position[i].as_ref()));
            let position = scale_add(&velocity, step, &position);
            let orientation = gather(pack.map(|i| bodies.orientation[i].coords.as_ref()));
            let (orientation, rotated, half_angle) = turn_rods(&orientation, &omega, shape, step);
            let velocity = save(&velocity);
            let (omega, rotated) = (save(&omega), save(&rotated));
            let (position, orientation): (_, [[f64; ABREAST]; 4]) =
                (save(&position), save(&orientation));
            let [half_angle]: [[f64; ABREAST]; 1] = save(&[half_angle]);
            for (lane, &i) in pack.iter().enumerate() {
                // A body that fills up the last pack moves once.
                if pack[..lane].contains(&i) {
                    continue;
                }
                let vector =
                    |x: &[[f64; ABREAST]; 3]| Vector3::new(x[0][lane], x[1][lane], x[2][lane]);
                bodies.velocity[i] = vector(&velocity);
                bodies.position[i] = vector(&position);
                let [x, y, z, w] = orientation.map(|x| x[lane]);
                if half_angle[lane] <= FRAC_PI_4 * FRAC_PI_4 {
                    bodies.angular_velocity[i] = vector(&rotated);
                    bodies.orientation[i] =
                        UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
                } else {
                    bodies.angular_velocity[i] = vector(&omega);
                    turn(bodies, i, dt);
                }
                let moved = bodies.position[i].sum() + bodies.orientation[i].coords.sum();
                let rates = bodies.velocity[i].sum() + bodies.angular_velocity[i].sum();
                if lost.is_none() && !(moved + rates).is_finite() {
                    lost = Some(i);
                }
            }
        }
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use taut_model::Body;

    /// Lanes turn bodies as single ones turn, at every speed, about every axis of symmetry, whatever their number.
    #[test]
    fn lanes_and_single_bodies_agree() {
        for count in [1, 3, 4, 5, 9] {
            for speed in [0.0, 1e-9, 0.1, 30.0, 200.0] {
                let mut bodies = Bodies::new();
                for i in 0..count {
                    let mut diagonal = Vector3::repeat(2.0);
                    diagonal[i % 3] = [0.3, 2.0, 5.0][i / 3];
                    let mut body = Body::new(1.5, Matrix3::from_diagonal(&diagonal));
                    let turn = Vector3::new(0.3 * i as f64, -0.7, 1.1);
                    body.orientation = UnitQuaternion::from_scaled_axis(turn);
                    bodies.push(body);
                }
                let mut v = Six::new(count);
                let mut dv = Six::new(count);
                for i in 0..count {
                    let number = |k: usize| (6 * i + k) as f64;
                    v.set(i, std::array::from_fn(|k| speed * number(k).sin()));
                    dv.set(i, std::array::from_fn(|k| 0.1 * speed * number(k).cos()));
                }
                let (dt, mut single) = (1.0 / 60.0, bodies.clone());
                let (rods, others) = Rods::new(&bodies);
                assert!(others.is_empty());
                move_bodies(&mut bodies, &rods, &others, &v, &dv, dt).unwrap();
                for i in 0..count {
                    take_velocities(&mut single, i, &v.get(i), &dv.get(i));
                    single.position[i] += dt * single.velocity[i];
                    turn(&mut single, i, dt);
                    let close = |a: f64, b: f64| (a - b).abs() <= 4e-15 * speed.max(1.0);
                    for k in 0..3 {
                        assert!(close(bodies.position[i][k], single.position[i][k]));
                        assert_eq!(bodies.velocity[i][k], single.velocity[i][k]);
                        let (found, exact) =
                            (&bodies.angular_velocity[i], &single.angular_velocity[i]);
                        assert!(close(found[k], exact[k]), "{speed} {i}: {found} {exact}");
                    }
                    let (found, exact) = (&bodies.orientation[i], &single.orientation[i]);
                    for k in 0..4 {
                        assert!(
                            (found.coords[k] - exact.coords[k]).abs() < 2e-15,
                            "{speed} {i}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_first_body_that_is_lost_is_named() {
        let mut bodies = Bodies::new();
        for _ in 0..6 {
            bodies.push(Body::rod(1.0, 0.1, 1.0));
        }
        let (rods, others) = Rods::new(&bodies);
        let mut v = Six::new(6);
        v.set(4, [0.0, f64::INFINITY, 0.0, 0.0, 0.0, 0.0]);
        v.set(5, [0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0]);
        let found = move_bodies(&mut bodies, &rods, &others, &v, &Six::new(6), 0.1);
        assert_eq!(found, Err(4));
    }
}
