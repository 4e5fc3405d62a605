//! From velocity changes to velocities and positions: v⁺ = v + Δv, x⁺ = x + Δt v⁺, and the rotation of
//! [`crate::gyroscopic`], of bodies with an axis of symmetry in lanes.

use crate::gyroscopic::{self, About};
use crate::inertia::Rods;
use nalgebra::{UnitQuaternion, Vector3};
use taut_lanes::vector::{Vec3, add, gather, save, scale_add};
use taut_lanes::{Lanes, Level, WideKernel, dispatch_wide};
use taut_model::body_vectors::BodyNumbers;
use taut_model::{Bodies, BodyLanes, BodyVectors, Mobility};

/// Moves all bodies over `dt` (s). `Err(body)`, the first of them, where a state is no longer
/// finite.
pub(crate) fn move_bodies(
    bodies: &mut Bodies,
    rods: &Rods,
    others: &[usize],
    v: &BodyVectors,
    dv: &BodyVectors,
    dt: f64,
) -> Result<(), usize> {
    let mut lost = dispatch_wide(
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
        // It spins as it is driven.
        _ => gyroscopic::turn_by(orientation, omega, dt),
    }
}

/// Moves the bodies with an axis of symmetry; the first one whose state is no longer finite.
struct Move<'a> {
    bodies: &'a mut Bodies,
    rods: &'a Rods,
    v: &'a BodyVectors,
    dv: &'a BodyVectors,
    dt: f64,
}

/// State of all bodies that a step changes.
struct Moving<'a> {
    position: &'a mut [Vector3<f64>],
    orientation: &'a mut [UnitQuaternion<f64>],
    velocity: &'a mut [Vector3<f64>],
    angular_velocity: &'a mut [Vector3<f64>],
}

impl<'a> Moving<'a> {
    /// Slices of the same length, so that bounds are checked once.
    #[inline(always)]
    fn new(bodies: &'a mut Bodies) -> Self {
        let n = bodies.len();
        Self {
            position: &mut bodies.position[..n],
            orientation: &mut bodies.orientation[..n],
            velocity: &mut bodies.velocity[..n],
            angular_velocity: &mut bodies.angular_velocity[..n],
        }
    }

    /// Moves `L` bodies from `first` on and says so, where all of them stay finite; none otherwise.
    #[inline(always)]
    fn together<V: Lanes, const L: usize>(
        &mut self,
        first: usize,
        [velocity, omega]: [&Vec3<V>; 2],
        about: &About<V>,
        half_dt: V,
    ) -> bool {
        let (Some(x), Some(q), Some(v), Some(w)) = (
            some::<_, L>(self.position, first),
            some::<_, L>(self.orientation, first),
            some::<_, L>(self.velocity, first),
            some::<_, L>(self.angular_velocity, first),
        ) else {
            return false;
        };
        let position = gather(x.each_ref().map(AsRef::as_ref));
        let position = scale_add(velocity, half_dt + half_dt, &position);
        let orientation = gather(q.each_ref().map(|q| q.coords.as_ref()));
        let (orientation, rotated) = about.turn(&orientation, omega, half_dt);
        let moved = add(&add(&position, velocity), &rotated);
        let quaternion = (orientation[0] + orientation[1]) + (orientation[2] + orientation[3]);
        let sum = (moved[0] + moved[1] + moved[2]) + quaternion;
        if !sum.abs().all_below(V::splat(f64::INFINITY)) {
            return false;
        }
        V::spread(&position, x.each_mut().map(AsMut::as_mut));
        V::spread(velocity, v.each_mut().map(AsMut::as_mut));
        V::spread(&rotated, w.each_mut().map(AsMut::as_mut));
        let q = q.each_mut().map(|q| q.as_mut_unchecked().coords.as_mut());
        V::spread(&orientation, q);
        true
    }

    /// Moves the first `count` of any bodies; the first of them whose state is no longer finite.
    #[inline(always)]
    fn apart<V: Lanes, const L: usize>(
        &mut self,
        pack: &[usize; L],
        count: usize,
        [velocity, omega]: [&Vec3<V>; 2],
        about: &About<V>,
        half_dt: V,
    ) -> Option<usize> {
        let position = gather(pack.map(|i| self.position[i].as_ref()));
        let position = scale_add(velocity, half_dt + half_dt, &position);
        let orientation = gather(pack.map(|i| self.orientation[i].coords.as_ref()));
        let (orientation, rotated) = about.turn(&orientation, omega, half_dt);
        let [velocity, rotated, position]: [[[f64; L]; 3]; 3] =
            [save(velocity), save(&rotated), save(&position)];
        let orientation: [[f64; L]; 4] = save(&orientation);
        let mut lost = None;
        for (lane, &i) in pack.iter().enumerate().take(count) {
            let vector = |x: &[[f64; L]; 3]| Vector3::new(x[0][lane], x[1][lane], x[2][lane]);
            self.velocity[i] = vector(&velocity);
            self.position[i] = vector(&position);
            let [x, y, z, w] = orientation.map(|x| x[lane]);
            let (orientation, rate) = (&mut self.orientation[i], &mut self.angular_velocity[i]);
            *rate = vector(&rotated);
            *orientation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
            let moved = self.position[i].sum() + orientation.coords.sum();
            let rates = self.velocity[i].sum() + rate.sum();
            if lost.is_none() && !(moved + rates).is_finite() {
                lost = Some(i);
            }
        }
        lost
    }
}

/// `L` from the first on, if there are as many.
#[inline(always)]
fn some<T, const L: usize>(of: &mut [T], first: usize) -> Option<&mut [T; L]> {
    of.get_mut(first..)?.first_chunk_mut()
}

/// Linear and angular velocities after their changes.
#[inline(always)]
fn rates<V: Lanes, const L: usize>(
    v: &BodyNumbers<'_>,
    dv: &BodyNumbers<'_>,
    of: &BodyLanes<'_, L>,
) -> (Vec3<V>, Vec3<V>) {
    let [vx, vy, vz, x, y, z] = v.load(of);
    let [ux, uy, uz, p, q, r] = dv.load(of);
    (
        add(&[vx, vy, vz], &[ux, uy, uz]),
        add(&[x, y, z], &[p, q, r]),
    )
}

impl WideKernel for Move<'_> {
    type Output = Option<usize>;

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) -> Option<usize> {
        let Self {
            bodies,
            rods,
            v,
            dv,
            dt,
        } = self;
        let (v, dv, half_dt) = (v.view(), dv.view(), V::splat(0.5 * dt));
        let mut bodies = Moving::new(bodies);
        let mut lost: Option<usize> = None;
        for (group, count, (shape, lane)) in rods.lanes::<L>() {
            let (velocity, omega) = rates(&v, &dv, &group);
            let (rates, about) = ([&velocity, &omega], shape.about::<V, L>(lane));
            if let Some(first) = group.first()
                && bodies.together::<V, L>(first, rates, &about, half_dt)
            {
                continue;
            }
            let moved = bodies.apart(group.indices(), count, rates, &about, half_dt);
            lost = lost.or(moved);
        }
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

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
                let mut v = BodyVectors::new(count);
                let mut dv = BodyVectors::new(count);
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
                        let off = (found.coords[k] - exact.coords[k]).abs();
                        assert!(off < 2e-15, "{speed} {i}");
                    }
                }
            }
        }
    }

    /// Bodies that are neighbours move as the same bodies with others between them, to the bit, whether all turn by
    /// angles for lanes or one does not; and the first one that is lost has its name in either case.
    #[test]
    fn neighbours_move_as_others_do() {
        let rates = |i: usize, speed: f64| -> [f64; 6] {
            std::array::from_fn(|k| speed * ((6 * i + k) as f64).sin())
        };
        for (fast, broken) in [
            (None, None),
            (Some(2), None),
            (None, Some((1, 0))),
            (None, Some((2, 4))),
            (Some(0), Some((3, 5))),
        ] {
            let moved = |stride: usize| {
                let mut bodies = Bodies::new();
                let (mut v, mut dv) = (BodyVectors::new(8 * stride), BodyVectors::new(8 * stride));
                for i in 0..8 * stride {
                    let mut body = Body::rod(1.5, 0.1, 2.0);
                    if i % stride > 0 {
                        body.mobility = Mobility::Static;
                    } else {
                        let i = i / stride;
                        let turn = Vector3::new(0.3 * i as f64, -0.7, 1.1);
                        body.orientation = UnitQuaternion::from_scaled_axis(turn);
                        body.position = turn * 3.0;
                        let speed = if fast == Some(i) { 300.0 } else { 1.0 };
                        let mut rates = rates(i, speed);
                        if let Some((at, k)) = broken
                            && i % 4 == at
                        {
                            rates[k] = f64::NAN;
                        }
                        v.set(stride * i, rates);
                        dv.set(stride * i, [1e-3; 6]);
                    }
                    bodies.push(body);
                }
                let (rods, others) = Rods::new(&bodies);
                let mut neighbours = rods.bodies.iter();
                let neighbours = neighbours.all(|pack| pack.lanes::<8>(0).first().is_some());
                assert_eq!((rods.shapes.len(), neighbours), (1, stride == 1));
                let lost = move_bodies(&mut bodies, &rods, &others, &v, &dv, 1.0 / 60.0);
                let state = |i: usize| {
                    let q = bodies.orientation[i].coords;
                    let (v, w) = (bodies.velocity[i], bodies.angular_velocity[i]);
                    let x = bodies.position[i];
                    x.iter()
                        .chain(&q)
                        .chain(&v)
                        .chain(&w)
                        .map(|x| x.to_bits())
                        .collect::<Vec<_>>()
                };
                let states: Vec<_> = (0..8).map(|i| state(stride * i)).collect();
                (states, lost.map_err(|i| i / stride))
            };
            let (together, apart) = (moved(1), moved(3));
            assert_eq!(together, apart, "{fast:?} {broken:?}");
            assert_eq!(together.1, broken.map_or(Ok(()), |(at, _)| Err(at)));
        }
    }

    #[test]
    fn the_first_body_that_is_lost_is_named() {
        let mut bodies = Bodies::new();
        for _ in 0..6 {
            bodies.push(Body::rod(1.0, 0.1, 1.0));
        }
        let (rods, others) = Rods::new(&bodies);
        let mut v = BodyVectors::new(6);
        v.set(4, [0.0, f64::INFINITY, 0.0, 0.0, 0.0, 0.0]);
        v.set(5, [0.0, 0.0, 0.0, f64::NAN, 0.0, 0.0]);
        let found = move_bodies(&mut bodies, &rods, &others, &v, &BodyVectors::new(6), 0.1);
        assert_eq!(found, Err(4));
    }
}
