//! Random numbers that are the same in every run.

use nalgebra::{UnitQuaternion, Vector3};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A generator. Whoever uses one prints its seed on failure.
#[derive(Debug, Clone)]
pub struct Random(Xoshiro256PlusPlus);

impl Random {
    /// The generator of a seed.
    pub fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Evenly distributed in −1 … 1.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * 2.0_f64.powi(-52) - 1.0
    }

    /// Evenly distributed in `from` … `to` on a logarithmic scale.
    pub fn log_uniform(&mut self, from: f64, to: f64) -> f64 {
        let t = 0.5 * (1.0 + self.uniform());
        (from.ln() + t * (to / from).ln()).exp()
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() >> 33) as usize % n
    }

    /// A vector with components in −`size` … `size`.
    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| size * self.uniform())
    }

    /// A rotation by up to about `angle` (rad).
    pub fn rotation(&mut self, angle: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(self.vector(angle))
    }

    /// Numbers in −1 … 1.
    pub fn numbers(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.uniform()).collect()
    }

    /// The numbers below `n` in random order (Fisher and Yates).
    pub fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}
