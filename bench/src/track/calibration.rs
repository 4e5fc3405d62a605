//! A fixed piece of floating-point work, to measure steps by: it lasts longer on a slower machine as they do.
//!
//! One unit is a chain of multiplications and additions that wait for one another, as substitution with small blocks
//! does, and as much work again on independent numbers in the first-level cache, as the products of blocks are: about a
//! microsecond. Its arithmetic is that of the target that the program is built for; kernels that choose wider
//! instructions at run time gain on it where there are some.

use std::hint::black_box;

/// Numbers of the independent part: 4 KiB.
const WIDTH: usize = 512;
/// Links of the chain in a unit.
const CHAIN: usize = 256;
/// Passes over the independent numbers in a unit.
const SWEEPS: usize = 4;

/// The kernel's numbers.
pub(super) struct Calibration {
    chain: f64,
    wide: [f64; WIDTH],
}

impl Calibration {
    pub(super) fn new() -> Self {
        Self {
            chain: 1.0,
            wide: std::array::from_fn(|i| i as f64),
        }
    }

    /// Works for `units` units.
    pub(super) fn run(&mut self, units: usize) {
        // Contractions towards 1: the numbers stay what they are, whatever is run.
        let (factor, term) = black_box((0.75, 0.25));
        for _ in 0..units {
            for _ in 0..CHAIN {
                self.chain = self.chain * factor + term;
            }
            for _ in 0..SWEEPS {
                for x in &mut self.wide {
                    *x = *x * factor + term;
                }
            }
            black_box(&mut *self);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_work_is_done_and_its_numbers_stay_finite() {
        let mut calibration = Calibration::new();
        calibration.run(1);
        assert!((calibration.wide[511] - 1.0 - 510.0 * 0.75_f64.powi(4)).abs() < 1e-9);
        calibration.run(1000);
        assert_eq!(calibration.chain, 1.0);
        assert!(calibration.wide.iter().all(|x| (x - 1.0).abs() < 1e-12));
    }
}
