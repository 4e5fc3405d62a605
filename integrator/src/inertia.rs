//! Effective inertia M̃ of all bodies at the beginning of a step, and products with it.
//!
//! M̃ = diag(m I₃, R I Rᵀ + α Δt² K) block by block, [SL (3)] with the geometric stiffness K of [`crate::geometric`].
//! This is the one place where it is computed. Static and driven bodies are infinitely heavy: M̃⁻¹ = 0 and Δt f = 0; their
//! M̃ is the identity, which the KKT matrix needs.

use crate::geometric::Geometric;
use crate::gyroscopic;
use crate::lanes::{axis, packed, unpacked};
use nalgebra::{Matrix3, Vector3};
use std::array::from_fn;
use taut_lanes::vector::{Sym3, add, gather, inverse, save, scale, scale_add, splat, sub, times};
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
use taut_model::{ABREAST, Bodies, Four, Scene};

/// M̃ and its inverse for all bodies, and the impulses Δt f that do not come from constraints.
#[derive(Debug, Clone)]
pub(crate) struct Inertia {
    /// Mass of each body \[kg].
    pub(crate) mass: Vec<f64>,
    /// 1/mass \[1/kg].
    pub(crate) inverse_mass: Vec<f64>,
    /// Angular part of M̃, world frame \[kg m²]: xx, yx, zx, yy, zy, zz.
    pub(crate) angular: Vec<[f64; 6]>,
    /// Its inverse.
    pub(crate) inverse_angular: Vec<[f64; 6]>,
    /// Δt f: 6 numbers a body, [linear (N s), angular (N m s)]: gravity, external and gyroscopic.
    pub(crate) impulse: Vec<f64>,
    /// Dynamic bodies with an axis of symmetry, four abreast.
    pub(crate) rods: Rods,
    /// All other bodies.
    pub(crate) others: Vec<usize>,
}

/// Bodies with an axis of symmetry, four abreast: R I Rᵀ = across I₃ + (along − across) n nᵀ for the axis n.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rods {
    /// The bodies, filled up with copies of the last one.
    pub(crate) bodies: Vec<[usize; ABREAST]>,
    pub(crate) shapes: Vec<RodShape>,
}

/// What does not change of four bodies.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C, align(32))]
pub(crate) struct RodShape {
    /// The axis in the body frame, a unit vector along one of its axes.
    pub(crate) axis: [Four; 3],
    across: Four,
    /// Inertia along the axis less that across it.
    excess: Four,
    /// Inertia along the axis over that across it, less 1.
    pub(crate) ratio: Four,
}

impl Rods {
    /// Those of the bodies that are dynamic and symmetric, and all others.
    pub(crate) fn new(bodies: &Bodies) -> (Self, Vec<usize>) {
        let shape = |i: usize| gyroscopic::symmetry(&bodies.inertia[i]);
        let rod = |i: &usize| bodies.is_dynamic(*i) && shape(*i).is_some();
        let (mut rods, others): (Vec<usize>, _) = (0..bodies.len()).partition(rod);
        if let Some(&last) = rods.last() {
            rods.resize(rods.len().next_multiple_of(ABREAST), last);
        }
        let (packs, _) = rods.as_chunks::<ABREAST>();
        let shapes = packs.iter().map(|pack| {
            let mut shapes = RodShape::default();
            for (lane, &i) in pack.iter().enumerate() {
                if let Some((axis, ratio)) = shape(i) {
                    let along = bodies.inertia[i][(axis, axis)];
                    let other = (axis + 1) % 3;
                    shapes.axis[axis][lane] = 1.0;
                    shapes.across[lane] = bodies.inertia[i][(other, other)];
                    shapes.excess[lane] = along - shapes.across[lane];
                    shapes.ratio[lane] = ratio - 1.0;
                }
            }
            shapes
        });
        let rods = Self {
            shapes: shapes.collect(),
            bodies: packs.to_vec(),
        };
        (rods, others)
    }
}

impl Inertia {
    pub(crate) fn new(bodies: &Bodies) -> Self {
        let n = bodies.len();
        let dynamic = |i: &usize| bodies.is_dynamic(*i);
        let mass = |i| if dynamic(&i) { bodies.mass[i] } else { 1.0 };
        let inverse = |i| {
            if dynamic(&i) {
                1.0 / bodies.mass[i]
            } else {
                0.0
            }
        };
        let (rods, others) = Rods::new(bodies);
        Self {
            rods,
            others,
            mass: (0..n).map(mass).collect(),
            inverse_mass: (0..n).map(inverse).collect(),
            angular: vec![packed(&Matrix3::identity()); n],
            inverse_angular: vec![[0.0; 6]; n],
            impulse: vec![0.0; 6 * n],
        }
    }

    /// M̃ and Δt f of the scene's present state, with the geometric stiffness times `alpha`. `Err(body)` where the
    /// inertia has no inverse.
    pub(crate) fn update(
        &mut self,
        scene: &Scene,
        dt: f64,
        geometric: &Geometric,
        alpha: f64,
    ) -> Result<(), usize> {
        let stiffness = geometric.stiffness();
        let factor = alpha * dt * dt;
        dispatch(
            Level::best(),
            Update {
                inertia: self,
                scene,
                dt,
                stiffness,
                factor,
            },
        )?;
        for k in 0..self.others.len() {
            let (i, bodies) = (self.others[k], &scene.bodies);
            if !bodies.is_dynamic(i) {
                continue;
            }
            let rotation = bodies.rotation(i);
            let world = rotation * bodies.inertia[i] * rotation.transpose();
            let inertia = world + unpacked(stiffness[i]) * factor;
            let inverse = inertia.try_inverse().ok_or(i)?;
            let omega = &bodies.angular_velocity[i];
            let force = bodies.mass[i] * scene.gravity + bodies.force[i];
            let gyroscopic = gyroscopic::impulse(&bodies.inertia[i], &rotation, &world, omega, dt);
            let angular = dt * bodies.torque[i] + gyroscopic;
            self.impulse[6 * i..6 * i + 3].copy_from_slice((dt * force).as_slice());
            self.impulse[6 * i + 3..6 * i + 6].copy_from_slice(angular.as_slice());
            self.angular[i] = packed(&inertia);
            self.inverse_angular[i] = packed(&inverse);
        }
        Ok(())
    }

    /// Δv ← Δv + M̃⁻¹ (impulse − M̃ Δv), twice: thin segments under tension turn 10⁴ to 10⁸ times more easily about their
    /// axis than across, M̃⁻¹ is as inexact, and the second pass takes the first one's error away. 6 numbers a body.
    pub(crate) fn correct_velocities(&self, impulse: &[f64], dv: &mut [f64]) {
        let change = VelocityChange {
            inertia: self,
            impulse: impulse.as_chunks().0,
            dv: dv.as_chunks_mut().0,
        };
        dispatch(Level::best(), change);
    }

    /// M̃ of body `i` grows by `mass` (kg) and by `angular` (kg m²) about every axis; Δt f stays. `false` where there is
    /// no inverse.
    pub(crate) fn add_ballast(&mut self, i: usize, mass: f64, angular: f64) -> bool {
        if self.is_immovable(i) {
            return true;
        }
        self.mass[i] += mass;
        self.inverse_mass[i] = 1.0 / self.mass[i];
        for k in [0, 3, 5] {
            self.angular[i][k] += angular;
        }
        let inverse = unpacked(self.angular[i]).try_inverse();
        inverse.is_some_and(|inverse| {
            self.inverse_angular[i] = packed(&inverse);
            true
        })
    }

    /// Whether body `i` is static or driven.
    pub(crate) fn is_immovable(&self, i: usize) -> bool {
        self.inverse_mass[i] == 0.0
    }

    /// Adds an impulse's angular part to Δt f of body `i`.
    pub(crate) fn add_angular_impulse(&mut self, i: usize, impulse: &Vector3<f64>) {
        if self.is_immovable(i) {
            return;
        }
        for (to, p) in self.impulse[6 * i + 3..6 * i + 6]
            .iter_mut()
            .zip(impulse.iter())
        {
            *to += p;
        }
    }

    /// Adds Jᵀ μ of one row `j` on body `i` to Δt f.
    pub(crate) fn add_impulse(&mut self, i: usize, j: &[f64; 6], mu: f64) {
        if self.is_immovable(i) {
            return;
        }
        for (to, j) in self.impulse[6 * i..6 * i + 6].iter_mut().zip(j) {
            *to += j * mu;
        }
    }

    /// y = M̃⁻¹ p for body `i`.
    #[inline]
    pub(crate) fn apply_inverse(&self, i: usize, p: &[f64; 6], y: &mut [f64; 6]) {
        let turned = unpacked(self.inverse_angular[i]) * Vector3::new(p[3], p[4], p[5]);
        let linear = self.inverse_mass[i];
        *y = [
            linear * p[0],
            linear * p[1],
            linear * p[2],
            turned.x,
            turned.y,
            turned.z,
        ];
    }
}

/// M̃ and Δt f of the bodies with an axis of symmetry; `Err(body)` where M̃ has no inverse.
struct Update<'a> {
    inertia: &'a mut Inertia,
    scene: &'a Scene,
    dt: f64,
    stiffness: &'a [[f64; 6]],
    /// What the stiffness is multiplied with.
    factor: f64,
}

impl Kernel for Update<'_> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn run<I: Isa>(self) -> Result<(), usize> {
        let Self { inertia, scene, .. } = self;
        let bodies = &scene.bodies;
        let (dt, factor) = (I::X4::splat(self.dt), I::X4::splat(self.factor));
        let gravity = splat::<I::X4>(scene.gravity.into());
        let mut lost = None;
        for (pack, shape) in inertia.rods.bodies.iter().zip(&inertia.rods.shapes) {
            let n = axis::<I::X4>(pack.map(|i| &bodies.orientation[i]), &shape.axis);
            let (across, excess) = (I::X4::load(&shape.across), I::X4::load(&shape.excess));
            let stiffness = gather::<I::X4, _, 6>(pack.map(|i| &self.stiffness[i]));
            let along = scale(&n, excess);
            let world = [
                along[0].mul_add(n[0], across),
                along[0] * n[1],
                along[0] * n[2],
                along[1].mul_add(n[1], across),
                along[1] * n[2],
                along[2].mul_add(n[2], across),
            ];
            let mut angular: Sym3<I::X4> = world;
            for (entry, stiffness) in angular.iter_mut().zip(stiffness) {
                *entry = stiffness.mul_add(factor, *entry);
            }
            let (inverse, determinant) = inverse(&angular);
            let mass = I::X4::from_fn(|l| bodies.mass[pack[l]]);
            let external = gather(pack.map(|i| bodies.force[i].as_ref()));
            let torque = gather(pack.map(|i| bodies.torque[i].as_ref()));
            let force = scale(&scale_add(&gravity, mass, &external), dt);
            let ([x, y, z], [p, q, r]) = (force, scale(&torque, dt));
            let at = pack.map(|i| 6 * i);
            I::X4::scatter(&[x, y, z, p, q, r], &mut inertia.impulse, at);
            I::X4::scatter(&angular, inertia.angular.as_flattened_mut(), at);
            I::X4::scatter(&inverse, inertia.inverse_angular.as_flattened_mut(), at);
            let [determinant]: [Four; 1] = save(&[determinant]);
            for (determinant, &i) in determinant.into_iter().zip(pack) {
                if determinant == 0.0 {
                    lost.get_or_insert(i);
                }
            }
        }
        lost.map_or(Ok(()), Err)
    }
}

/// See [`Inertia::correct_velocities`].
struct VelocityChange<'a> {
    inertia: &'a Inertia,
    impulse: &'a [[f64; 6]],
    dv: &'a mut [[f64; 6]],
}

impl Kernel for VelocityChange<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self {
            inertia,
            impulse,
            dv,
        } = self;
        let bodies = dv.len();
        for first in (0..bodies).step_by(ABREAST) {
            // The last ones are done once more where they do not come out even.
            let pack: [usize; ABREAST] = from_fn(|l| (first + l).min(bodies - 1));
            let mass = I::X4::from_fn(|l| inertia.mass[pack[l]]);
            let inverse_mass = I::X4::from_fn(|l| inertia.inverse_mass[pack[l]]);
            let angular = gather::<I::X4, _, 6>(pack.map(|i| &inertia.angular[i]));
            let inverse = gather::<I::X4, _, 6>(pack.map(|i| &inertia.inverse_angular[i]));
            let [px, py, pz, lx, ly, lz] = gather::<I::X4, _, 6>(pack.map(|i| &impulse[i]));
            let [vx, vy, vz, wx, wy, wz] = gather::<I::X4, _, 6>(pack.map(|i| &dv[i]));
            let (p, l) = ([px, py, pz], [lx, ly, lz]);
            let (mut v, mut w) = ([vx, vy, vz], [wx, wy, wz]);
            for _ in 0..2 {
                let lacking = scale_add(&v, -mass, &p);
                v = scale_add(&lacking, inverse_mass, &v);
                let correction = times(&inverse, &sub(&l, &times(&angular, &w)));
                w = add(&w, &correction);
            }
            let found = [v[0], v[1], v[2], w[0], w[1], w[2]];
            I::X4::scatter(&found, dv.as_flattened_mut(), pack.map(|i| 6 * i));
        }
    }
}
