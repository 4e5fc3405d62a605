//! Effective inertia M̃ of all bodies at the beginning of a step, and products with it.
//!
//! M̃ = diag(m I₃, R I Rᵀ + α Δt² K) block by block, [SL (3)] with the geometric stiffness K of [`crate::geometric`].
//! This is the one place where it is computed. Static and driven bodies are infinitely heavy: M̃⁻¹ = 0 and Δt f = 0; their
//! M̃ is the identity, which the KKT matrix needs. Point masses have three degrees of freedom; where six stand in a
//! vector, an inertia of 1 kg m² fills up the angular ones, on which nothing acts.

use crate::gyroscopic::{self, About};
use nalgebra::Matrix3;
use taut_lanes::vector::{
    Sym3, Vec3, add, gather, inverse, scale, scale_add, splat, sub, times, turned,
};
use taut_lanes::{Aligned, Lanes, Level, WideKernel, dispatch_wide};
use taut_model::body_vectors::{packed, unpacked};
use taut_model::lanes::{Numbers, PACK, load_part, part};
use taut_model::{Bodies, BodyLanes, BodyPack, BodyVectors, Scene};

/// M̃ and its inverse for all bodies, and the impulses Δt f that do not come from constraints.
#[derive(Debug, Clone)]
pub(crate) struct Inertia {
    /// Mass of each body and of what fills up the last vector \[kg].
    pub(crate) mass: Aligned,
    /// 1/mass \[1/kg].
    pub(crate) inverse_mass: Aligned,
    /// Angular part of M̃, world frame \[kg m²]: xx, yx, zx, yy, zy, zz.
    pub(crate) angular: BodyVectors,
    /// Its inverse.
    pub(crate) inverse_angular: BodyVectors,
    /// Δt f, [linear (N s), angular (N m s)]: gravity and external; the gyroscopic torque is part of [`crate::gyroscopic`].
    pub(crate) impulse: BodyVectors,
    /// Dynamic bodies with an axis of symmetry.
    pub(crate) rods: Rods,
    /// All other bodies.
    pub(crate) others: Vec<usize>,
}

/// Bodies with an axis of symmetry, in packs: R I Rᵀ = across I₃ + (along − across) n nᵀ for the axis n.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rods {
    /// The bodies, filled up with copies of the last one.
    pub(crate) bodies: Vec<BodyPack>,
    pub(crate) shapes: Vec<RodShape>,
    /// Bodies without the copies.
    count: usize,
}

/// Constant inertial data of eight bodies with an axis of symmetry.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(64))]
pub(crate) struct RodShape {
    /// The axis in the body frame, a unit vector along one of its axes.
    axis: [Numbers; 3],
    across: Numbers,
    /// Inertia along the axis less that across it.
    excess: Numbers,
    /// Inertia along the axis over that across it, less 1.
    ratio: Numbers,
}

impl RodShape {
    /// The shape of body `i`, if it has an axis of symmetry.
    fn take(&mut self, lane: usize, bodies: &Bodies, i: usize) {
        let Some((axis, ratio)) = gyroscopic::symmetry(&bodies.inertia[i]) else {
            return;
        };
        let inertia = if bodies.is_point(i) {
            Matrix3::identity()
        } else {
            bodies.inertia[i]
        };
        let along = inertia[(axis, axis)];
        let other = (axis + 1) % 3;
        for (k, numbers) in self.axis.iter_mut().enumerate() {
            numbers[lane] = f64::from(u8::from(k == axis));
        }
        self.across[lane] = inertia[(other, other)];
        self.excess[lane] = along - self.across[lane];
        self.ratio[lane] = ratio - 1.0;
    }

    /// The axes of symmetry of the bodies from `lane` on.
    #[inline(always)]
    pub(crate) fn about<V: Lanes, const L: usize>(&self, lane: usize) -> About<V> {
        About {
            axis: load_part::<V, L, 3>(&self.axis, lane),
            excess: V::load(part::<_, L>(&self.ratio, lane)),
        }
    }
}

impl Rods {
    /// Packs of the dynamic bodies with an axis of symmetry, and the numbers of all others.
    pub(crate) fn new(bodies: &Bodies) -> (Self, Vec<usize>) {
        let shape = |i: usize| gyroscopic::symmetry(&bodies.inertia[i]);
        let rod = |i: &usize| bodies.is_dynamic(*i) && shape(*i).is_some();
        let (mut rods, others): (Vec<usize>, _) = (0..bodies.len()).partition(rod);
        let count = rods.len();
        if let Some(&last) = rods.last() {
            rods.resize(rods.len().next_multiple_of(PACK), last);
        }
        let (packs, _) = rods.as_chunks::<PACK>();
        let shapes = packs.iter().map(|pack| {
            let mut shapes = RodShape::default();
            for (lane, &i) in pack.iter().enumerate() {
                shapes.take(lane, bodies, i);
            }
            shapes
        });
        let rods = Self {
            shapes: shapes.collect(),
            bodies: packs.iter().map(|pack| BodyPack::new(*pack)).collect(),
            count,
        };
        (rods, others)
    }

    /// The bodies, `L` at a time, and how many they are without the copies; the shapes of their pack and the lane in it
    /// that the first of them has.
    #[inline(always)]
    pub(crate) fn lanes<const L: usize>(
        &self,
    ) -> impl Iterator<Item = (BodyLanes<'_, L>, usize, (&RodShape, usize))> {
        (0..self.count).step_by(L).map(|first| {
            let (pack, lane) = (first / PACK, first % PACK);
            let count = (self.count - first).min(L);
            let shapes = (&self.shapes[pack], lane);
            (self.bodies[pack].lanes(lane), count, shapes)
        })
    }
}

impl Inertia {
    pub(crate) fn new(bodies: &Bodies) -> Self {
        let n = bodies.len();
        let room = BodyVectors::room_for(n);
        let dynamic = |i: &usize| *i < n && bodies.is_dynamic(*i);
        let mass = |i| if dynamic(&i) { bodies.mass[i] } else { 1.0 };
        let inverse = |i| {
            if dynamic(&i) {
                1.0 / bodies.mass[i]
            } else {
                0.0
            }
        };
        let (rods, others) = Rods::new(bodies);
        let mut angular = BodyVectors::new(n);
        for i in 0..n {
            angular.set(i, packed(&Matrix3::identity()));
        }
        Self {
            rods,
            others,
            mass: aligned(room, mass),
            inverse_mass: aligned(room, inverse),
            angular,
            inverse_angular: BodyVectors::new(n),
            impulse: BodyVectors::new(n),
        }
    }

    /// Takes the mass and the inertia of body `i`, dynamic and with the axis of symmetry that it had.
    pub(crate) fn renew(&mut self, bodies: &Bodies, i: usize) {
        self.mass[i] = bodies.mass[i];
        self.inverse_mass[i] = 1.0 / bodies.mass[i];
        for (pack, shapes) in self.rods.bodies.iter().zip(&mut self.rods.shapes) {
            for (lane, _) in pack
                .indices()
                .iter()
                .enumerate()
                .filter(|(_, body)| **body == i)
            {
                shapes.take(lane, bodies, i);
            }
        }
    }

    /// M̃ and Δt f of the scene's present state, with the geometric stiffness K times `alpha`, and with Δt² K g for the
    /// angular velocities g of `drive`. `Err(body)` where the inertia has no inverse.
    pub(crate) fn update(
        &mut self,
        scene: &Scene,
        dt: f64,
        stiffness: &BodyVectors,
        alpha: f64,
        drive: &BodyVectors,
    ) -> Result<(), usize> {
        let factor = alpha * dt * dt;
        dispatch_wide(
            Level::best(),
            Update {
                inertia: self,
                scene,
                dt,
                stiffness,
                factor,
                drive,
            },
        )?;
        for k in 0..self.others.len() {
            let (i, bodies) = (self.others[k], &scene.bodies);
            if !bodies.is_dynamic(i) {
                continue;
            }
            let rotation = bodies.rotation(i);
            let world = packed(&(rotation * bodies.inertia[i] * rotation.transpose()));
            let (k, driven) = (stiffness.get(i), drive.get(i));
            let angular = angular_inertia(&world, &k, factor);
            let (inverse, determinant) = inverse(&angular);
            if determinant == 0.0 {
                return Err(i);
            }
            let (force, torque) = (bodies.force[i].as_ref(), bodies.torque[i].as_ref());
            let gravity = scene.gravity.as_ref();
            let impulse = impulse(bodies.mass[i], gravity, [force, torque], (&k, &driven), dt);
            self.impulse.set(i, impulse);
            self.angular.set(i, angular);
            self.inverse_angular.set(i, inverse);
        }
        Ok(())
    }

    /// Δv ← Δv + M̃⁻¹ (impulse − M̃ Δv), twice: thin segments under tension turn 10⁴ to 10⁸ times more easily about their
    /// axis than across, M̃⁻¹ is as inexact, and the second pass takes the first one's error away.
    pub(crate) fn correct_velocities(&self, impulse: &BodyVectors, dv: &mut BodyVectors) {
        let change = VelocityChange::<false> {
            inertia: self,
            impulse,
            dv,
        };
        dispatch_wide(Level::best(), change);
    }

    /// Δv = M̃⁻¹ Δt f, in the two passes of [`correct_velocities`](Self::correct_velocities).
    pub(crate) fn free_velocities(&self, dv: &mut BodyVectors) {
        let change = VelocityChange::<true> {
            inertia: self,
            impulse: &self.impulse,
            dv,
        };
        dispatch_wide(Level::best(), change);
    }

    /// M̃ of body `i` grows by `mass` (kg) and by `angular` (kg m²) about every axis; Δt f stays. `false` where there is
    /// no inverse.
    pub(crate) fn add_ballast(&mut self, i: usize, mass: f64, angular: f64) -> bool {
        if self.is_immovable(i) {
            return true;
        }
        self.mass[i] += mass;
        self.inverse_mass[i] = 1.0 / self.mass[i];
        self.angular
            .add(i, [angular, 0.0, 0.0, angular, 0.0, angular]);
        let inverse = unpacked(self.angular.get(i)).try_inverse();
        inverse.is_some_and(|inverse| {
            self.inverse_angular.set(i, packed(&inverse));
            true
        })
    }

    /// True if body `i` is static or driven.
    pub(crate) fn is_immovable(&self, i: usize) -> bool {
        self.inverse_mass[i] == 0.0
    }

    /// Adds Jᵀ μ of one row `j` on body `i` to Δt f.
    pub(crate) fn add_impulse(&mut self, i: usize, j: &[f64; 6], mu: f64) {
        if self.is_immovable(i) {
            return;
        }
        self.impulse.add(i, j.map(|j| j * mu));
    }

    /// M̃⁻¹ p for body `i`.
    #[inline]
    pub(crate) fn apply_inverse(&self, i: usize, p: &[f64; 6], to: &mut [f64; 6]) {
        let [x, y, z, p, q, r] = *p;
        let [x, y, z] = scale(&[x, y, z], self.inverse_mass[i]);
        let [p, q, r] = times(&self.inverse_angular.get(i), &[p, q, r]);
        *to = [x, y, z, p, q, r];
    }
}

/// One number of each body that there is room for.
fn aligned(room: usize, number: impl Fn(usize) -> f64) -> Aligned {
    let mut numbers = Aligned::new(room);
    for (i, x) in numbers.iter_mut().enumerate() {
        *x = number(i);
    }
    numbers
}

/// R I Rᵀ + α Δt² K, for `world` = R I Rᵀ and `factor` = α Δt².
#[inline(always)]
fn angular_inertia<V: Lanes>(world: &Sym3<V>, stiffness: &Sym3<V>, factor: V) -> Sym3<V> {
    let mut sum = *world;
    for (entry, stiffness) in sum.iter_mut().zip(stiffness) {
        *entry = stiffness.mul_add(factor, *entry);
    }
    sum
}

/// Δt f of gravity and external forces and torques, and Δt² K g for the angular part g of what drives K.
#[inline(always)]
fn impulse<V: Lanes>(
    mass: V,
    gravity: &Vec3<V>,
    [force, torque]: [&Vec3<V>; 2],
    (stiffness, drive): (&Sym3<V>, &[V; 6]),
    dt: V,
) -> [V; 6] {
    let [.., p, q, r] = *drive;
    let driven = scale_add(&times(stiffness, &[p, q, r]), dt, torque);
    let [x, y, z] = scale(&scale_add(gravity, mass, force), dt);
    let [p, q, r] = scale(&driven, dt);
    [x, y, z, p, q, r]
}

/// M̃ and Δt f of the bodies with an axis of symmetry; `Err(body)` where M̃ has no inverse.
struct Update<'a> {
    inertia: &'a mut Inertia,
    scene: &'a Scene,
    dt: f64,
    stiffness: &'a BodyVectors,
    /// Factor of the stiffness K in M̃ \[s²].
    factor: f64,
    drive: &'a BodyVectors,
}

impl WideKernel for Update<'_> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) -> Result<(), usize> {
        let Self { inertia, scene, .. } = self;
        let bodies = &scene.bodies;
        let (stiffness, drive) = (self.stiffness.view(), self.drive.view());
        let mut impulses = inertia.impulse.view_mut();
        let mut angulars = inertia.angular.view_mut();
        let mut inverses = inertia.inverse_angular.view_mut();
        let (dt, factor) = (V::splat(self.dt), V::splat(self.factor));
        let gravity = splat::<V>(scene.gravity.into());
        let mut lost = None;
        for (group, count, (shape, lane)) in inertia.rods.lanes::<L>() {
            let (_, orientation) = group.poses::<V>(bodies, count);
            let n = turned(&orientation, &load_part::<V, L, 3>(&shape.axis, lane));
            let across = V::load(part::<_, L>(&shape.across, lane));
            let excess = V::load(part::<_, L>(&shape.excess, lane));
            let stiffness = stiffness.load::<V, L>(&group);
            let along = scale(&n, excess);
            let world = [
                along[0].mul_add(n[0], across),
                along[0] * n[1],
                along[0] * n[2],
                along[1].mul_add(n[1], across),
                along[1] * n[2],
                along[2].mul_add(n[2], across),
            ];
            let angular = angular_inertia(&world, &stiffness, factor);
            let (inverse, determinant) = inverse(&angular);
            let mass = group.load::<V>(&bodies.mass);
            let external = gather(group.indices().map(|i| bodies.force[i].as_ref()));
            let torque = gather(group.indices().map(|i| bodies.torque[i].as_ref()));
            let drive = drive.load(&group);
            let forces = [&external, &torque];
            let impulse = impulse(mass, &gravity, forces, (&stiffness, &drive), dt);
            impulses.store(&group, &impulse, count);
            angulars.store(&group, &angular, count);
            inverses.store(&group, &inverse, count);
            let mut determinants = [0.0; L];
            determinant.store(&mut determinants);
            for (determinant, &i) in determinants.into_iter().zip(group.indices()) {
                if determinant == 0.0 {
                    lost.get_or_insert(i);
                }
            }
        }
        lost.map_or(Ok(()), Err)
    }
}

/// See [`Inertia::correct_velocities`]; `FROM_REST` from Δv = 0.
struct VelocityChange<'a, const FROM_REST: bool> {
    inertia: &'a Inertia,
    impulse: &'a BodyVectors,
    dv: &'a mut BodyVectors,
}

impl<const FROM_REST: bool> WideKernel for VelocityChange<'_, FROM_REST> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) {
        let Self {
            inertia,
            impulse,
            dv,
        } = self;
        let (mass, inverse_mass) = (&inertia.mass[..], &inertia.inverse_mass[..]);
        let (angular, inverse) = (inertia.angular.view(), inertia.inverse_angular.view());
        let firsts = dv.each_first::<L>();
        let (impulse, mut dv) = (impulse.view(), dv.view_mut());
        for first in firsts {
            let mass = V::load(&mass[first..first + L]);
            let inverse_mass = V::load(&inverse_mass[first..first + L]);
            let angular = angular.load_from::<V>(first);
            let inverse = inverse.load_from::<V>(first);
            let [px, py, pz, lx, ly, lz] = impulse.load_from::<V>(first);
            let (p, l) = ([px, py, pz], [lx, ly, lz]);
            let (mut v, mut w) = (scale(&p, inverse_mass), times(&inverse, &l));
            if !FROM_REST {
                let [vx, vy, vz, wx, wy, wz] = dv.load_from::<V>(first);
                (v, w) = ([vx, vy, vz], [wx, wy, wz]);
            }
            for _ in usize::from(FROM_REST)..2 {
                let lacking = scale_add(&v, -mass, &p);
                v = scale_add(&lacking, inverse_mass, &v);
                let correction = times(&inverse, &sub(&l, &times(&angular, &w)));
                w = add(&w, &correction);
            }
            dv.store_from(first, &[v[0], v[1], v[2], w[0], w[1], w[2]]);
        }
    }
}
