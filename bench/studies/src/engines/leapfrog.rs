//! The explicit baseline: point masses and springs stepped by leapfrog (kick–drift), four side by side.
//!
//! v ← v + Δt (g + F/m), x ← x + Δt v, with v half a step ahead. It is stable below Δt = 2/ω, ω² ≈ 4 k/m for a long
//! chain: that, not accuracy, is what sets its number of sub-steps. A sub-step is two passes over plain arrays, which
//! are padded to whole vectors by points that nothing holds and nothing moves.

use nalgebra::Vector3;
use taut_lanes::{Isa, Kernel, Lanes, Level, dispatch};
use taut_measure::engine::motion::{FRAME, Motion, Points};
use taut_measure::engine::{self, Engine, Setting, doubling};

/// Points of a vector.
const WIDTH: usize = 4;

/// The chain. Spring i joins points i and i + 1; its force is at i + 1, so that the sum at point i is that at i + 1
/// less that at i.
#[derive(Debug, Clone)]
struct Leapfrog {
    /// Positions, a coordinate each \[m].
    x: [Vec<f64>; 3],
    /// Velocities half a sub-step ahead \[m/s].
    v: [Vec<f64>; 3],
    /// Forces on the upper point of a spring \[N].
    f: [Vec<f64>; 3],
    /// Reciprocal masses, 0 for what is held \[1/kg].
    inverse_mass: Vec<f64>,
    /// Accelerations along z without springs \[m/s²].
    gravity: Vec<f64>,
    /// Stiffness of each spring, 0 for those of the padding \[N/m].
    stiffness: Vec<f64>,
    /// Length of a spring without force \[m].
    length: f64,
    load: usize,
    /// Instructions that it runs on.
    level: Level,
}

/// Sub-steps of the chain.
struct Advance<'a> {
    chain: &'a mut Leapfrog,
    dt: f64,
    substeps: usize,
}

impl Leapfrog {
    /// At rest at the start, `gravity` along −z in m/s²; velocities half a sub-step of `dt` (s) ahead.
    fn new(points: &Points, gravity: f64, dt: f64) -> Self {
        let n = points.mass.len();
        let padded = n.next_multiple_of(WIDTH);
        let mut x = [0, 1, 2].map(|k| points.position.iter().map(|p| p[k]).collect::<Vec<_>>());
        // The padding goes on downwards: springs there have a length, and no stiffness. One point more, for the last.
        for x in &mut x {
            let last = x[n - 1];
            let step = last - x[n - 2];
            x.extend((1..=padded + 1 - n).map(|i| last + i as f64 * step));
        }
        let of_points = |held: f64, free: &dyn Fn(f64) -> f64| {
            let mut values = vec![0.0; padded];
            for (value, mass) in values.iter_mut().zip(&points.mass) {
                *value = free(*mass);
            }
            values[0] = held;
            values
        };
        let mut stiffness = vec![0.0; padded];
        stiffness[..n - 1].fill(points.stiffness);
        let zeros = |n: usize| [(); 3].map(|()| vec![0.0; n]);
        let mut chain = Self {
            x,
            v: zeros(padded),
            f: zeros(padded + 1),
            inverse_mass: of_points(0.0, &|mass| 1.0 / mass),
            gravity: of_points(0.0, &|_| -gravity),
            stiffness,
            length: points.length,
            load: n - 1,
            level: Level::best(),
        };
        let start = chain.x.clone();
        chain.advance(0.5 * dt, 1);
        chain.x = start;
        chain
    }

    /// `substeps` sub-steps of `dt` (s).
    fn advance(&mut self, dt: f64, substeps: usize) {
        let level = self.level;
        dispatch(
            level,
            Advance {
                chain: self,
                dt,
                substeps,
            },
        );
    }

    /// Position of the load \[m].
    fn load(&self) -> Vector3<f64> {
        Vector3::from_fn(|k, _| self.x[k][self.load])
    }
}

/// The chain as an engine.
pub(super) fn engine() -> Engine {
    let setting = |substeps: usize| Setting {
        text: engine::substeps(substeps),
        substeps,
        start: Box::new(move |motion: &Motion| {
            let dt = FRAME / substeps as f64;
            let mut chain = Leapfrog::new(&motion.points()?, motion.params.gravity, dt);
            Ok(Box::new(move || {
                chain.advance(dt, substeps);
                Ok(chain.load())
            }))
        }),
    };
    Engine {
        name: "leapfrog",
        ladders: vec![doubling(1, 4096).map(setting).collect()],
        all: false,
    }
}

impl Kernel for Advance<'_> {
    type Output = ();

    #[inline(always)] // without it the instructions are not those of the level
    fn run<I: Isa>(self) {
        let Leapfrog {
            x: [x, y, z],
            v: [u, v, w],
            f: [fx, fy, fz],
            inverse_mass,
            gravity,
            stiffness,
            length,
            ..
        } = self.chain;
        let padded = stiffness.len();
        let (dt, length, one) = (
            I::X4::splat(self.dt),
            I::X4::splat(*length),
            I::X4::splat(1.0),
        );
        for _ in 0..self.substeps {
            for i in (0..padded).step_by(WIDTH) {
                let (dx, dy, dz) = (
                    difference::<I::X4>(&x[i..]),
                    difference::<I::X4>(&y[i..]),
                    difference::<I::X4>(&z[i..]),
                );
                let distance = dx.mul_add(dx, dy.mul_add(dy, dz * dz)).sqrt();
                let force = I::X4::load(&stiffness[i..]) * (one - length / distance);
                (force * dx).store(&mut fx[i + 1..]);
                (force * dy).store(&mut fy[i + 1..]);
                (force * dz).store(&mut fz[i + 1..]);
            }
            for i in (0..padded).step_by(WIDTH) {
                let kick = dt * I::X4::load(&inverse_mass[i..]);
                let fallen = dt * I::X4::load(&gravity[i..]);
                drift(
                    kick,
                    dt,
                    &fx[i..],
                    I::X4::splat(0.0),
                    &mut u[i..],
                    &mut x[i..],
                );
                drift(
                    kick,
                    dt,
                    &fy[i..],
                    I::X4::splat(0.0),
                    &mut v[i..],
                    &mut y[i..],
                );
                drift(kick, dt, &fz[i..], fallen, &mut w[i..], &mut z[i..]);
            }
        }
    }
}

/// Each number's successor less itself.
#[inline(always)] // without it the instructions are not those of the level, which goes for closures too
fn difference<V: Lanes>(x: &[f64]) -> V {
    V::load(&x[1..]) - V::load(x)
}

/// One coordinate of a vector's worth of points: the velocities by forces and `fallen`, then the positions.
#[inline(always)] // likewise
fn drift<V: Lanes>(kick: V, dt: V, force: &[f64], fallen: V, v: &mut [f64], x: &mut [f64]) {
    let next = kick.mul_add(difference(force), V::load(v) + fallen);
    next.store(v);
    dt.mul_add(next, V::load(x)).store(x);
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_model::HoistParams;

    fn points(segments: usize, mass_ratio: f64) -> (Motion, Points) {
        let params = HoistParams {
            segments,
            mass_ratio,
            ..HoistParams::default()
        };
        let motion = Motion { params, angle: 0.0 };
        let points = motion.points().expect("sound");
        (motion, points)
    }

    /// The chain is as long as the analytic elongation says, and stays so: its forces balance the weight there.
    #[test]
    fn it_rests_at_the_analytic_elongation() {
        for (segments, ratio) in [(1, 1.0), (6, 1e3), (7, 1e5), (24, 10.0)] {
            let (motion, points) = points(segments, ratio);
            let dt = FRAME / 256.0;
            let mut chain = Leapfrog::new(&points, motion.params.gravity, dt);
            let exact = motion.params.exact_elongation();
            for _ in 0..60 {
                chain.advance(dt, 256);
                let elongation = -chain.load().z - motion.params.length;
                let error = (elongation - exact).abs();
                assert!(error < 1e-12 * 10.0, "{segments}, {ratio}: {error}");
            }
        }
    }

    /// Released unstretched a light cable's load bounces about the elongation, to twice it.
    #[test]
    fn it_bounces_about_the_analytic_elongation() {
        let (motion, mut points) = points(6, 1e4);
        points.position.clone_from(&points.unstretched);
        let (dt, substeps) = (FRAME / 256.0, 256);
        let mut chain = Leapfrog::new(&points, motion.params.gravity, dt);
        let exact = motion.params.exact_elongation();
        let mut most = 0.0_f64;
        for _ in 0..60 {
            chain.advance(dt, substeps);
            most = most.max(-chain.load().z - motion.params.length);
        }
        assert!((most / (2.0 * exact) - 1.0).abs() < 0.02, "{most} {exact}");
    }
}
