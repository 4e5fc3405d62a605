//! Random vectors with a seed, for scenes that must leave their plane of symmetry.

use nalgebra::Vector3;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A source of vectors with components uniform in −1 to 1, the same for the same seed on every machine.
fn vectors(seed: u64) -> impl FnMut() -> Vector3<f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut uniform = move || (random.next_u64() >> 11) as f64 * 2.0_f64.powi(-52) - 1.0;
    move || Vector3::new(uniform(), uniform(), uniform())
}

/// Replaces `rates` by vectors with components within ±`bound`; seed 0 leaves them.
pub(crate) fn replace(rates: &mut [Vector3<f64>], seed: u64, bound: f64) {
    if seed != 0 {
        let mut random = vectors(seed);
        rates.fill_with(|| random() * bound);
    }
}
