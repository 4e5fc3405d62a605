//! One solve that tells whether a factor needs the rule: the growth of a vector of noise, with rows and columns scaled.
//!
//! ‖Ã⁻¹ v‖∞ for a v of signs and sizes of 0.5 to 1.5 is at least |uᵀ v| ‖u‖∞ over the smallest singular value, with its unit
//! vector u: of n rows it is seldom below a thousandth of ‖Ã⁻¹‖/n. Equal sizes would leave out a u such as (1, −1).

use super::{Rule, Scales};
use crate::agreement::split_mix;
use crate::kernels::Scalar;
use crate::{SolveError, SymBlockMatrix, norm_inf};

/// Growth up to which a matrix is far from singular: four digits from the condition that the rule refuses.
const SOUND: f64 = 1e11;

/// Growth above which the rule examines every factor.
const NEAR: f64 = 1e13;

/// ‖v − Ã y‖∞ up to which the factors solve for v. Factors that hide a singular matrix leave the part of v along its null
/// vector.
const SOLVED: f64 = 1e-4;

/// Result of a probe.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Probe {
    /// ‖y‖∞ of Ã y = v.
    pub(crate) growth: f64,
    /// ‖v − Ã y‖∞, 0 where theory bounds it.
    pub(crate) left: f64,
}

impl Probe {
    /// Returns true if the factor is as sound as one whose probe `before` the rule found good, or far from singular.
    pub(crate) fn is_sound(self, before: Option<f64>, roundoff: f64) -> bool {
        let wider = f64::ROUNDOFF / roundoff;
        let alike = |before: f64| self.growth <= 2.0 * before && self.growth <= NEAR * wider;
        let near = self.growth <= SOUND * wider || before.is_some_and(alike);
        near && self.left <= SOLVED
    }
}

/// Signs and sizes of 0.5 to 1.5.
pub(super) fn noise(v: &mut [f64], bits: &mut impl FnMut() -> u64) {
    for v in v {
        let bits = bits();
        let size = 0.5 + (bits >> 12) as f64 / (1_u64 << 52) as f64;
        *v = if bits & 1 == 0 { size } else { -size };
    }
}

impl Rule {
    /// Probes the factor of a positive definite matrix, scaled by the powers of two next to the roots of its diagonal.
    /// `solve` is x ← A⁻¹ x. Allocates nothing.
    ///
    /// # Errors
    /// The errors of `solve`.
    pub(crate) fn probe_definite(
        &mut self,
        a: &SymBlockMatrix,
        mut solve: impl FnMut(&mut [f64]) -> Result<(), SolveError>,
    ) -> Result<Probe, SolveError> {
        let mut bits = split_mix(self.sums.len() as u64);
        let (scales, x) = (&mut self.sums, &mut self.estimate.largest);
        roots(a, scales);
        noise(x, &mut bits);
        x.iter_mut().zip(&*scales).for_each(|(x, s)| *x *= s);
        let growth = match solve(x) {
            Err(SolveError::NonFinite { .. }) => f64::INFINITY,
            solved => {
                solved?;
                x.iter_mut().zip(&*scales).for_each(|(x, s)| *x *= s);
                largest(x)
            }
        };
        Ok(Probe { growth, left: 0.0 })
    }

    /// Probes factors whose elimination guarantees nothing; rows and columns are scaled as by the rule. `solve` is
    /// x ← A⁻¹ x. Allocates nothing.
    ///
    /// # Errors
    /// The errors of `solve`.
    pub(crate) fn probe(
        &mut self,
        entries: &(impl Iterator<Item = (usize, usize, f64)> + Clone),
        mut solve: impl FnMut(&mut [f64]) -> Result<(), SolveError>,
    ) -> Result<Probe, SolveError> {
        self.scales.of(entries.clone());
        let mut bits = split_mix(self.sums.len() as u64);
        let (left, y) = (&mut self.sums, &mut self.estimate.largest);
        noise(left, &mut bits);
        y.copy_from_slice(left);
        let mut solve = |x: &mut [f64], _| solve(x);
        match self.scales.solve(y, false, &mut solve) {
            Err(SolveError::NonFinite { .. }) => return Ok(Probe::UNKNOWN),
            solved => solved?,
        }
        entries.clone().for_each(|(r, c, a)| {
            left[r] -= Scales::at(&self.scales, r, c, a) * y[c];
        });
        self.inverse = largest(y);
        Ok(Probe {
            growth: self.inverse,
            left: largest(left),
        })
    }
}

impl Probe {
    const UNKNOWN: Self = Self {
        growth: f64::INFINITY,
        left: f64::INFINITY,
    };
}

/// ‖x‖∞; infinite where a number is not finite.
fn largest(x: &[f64]) -> f64 {
    match x.iter().all(|x| x.is_finite()) {
        true => norm_inf(x),
        false => f64::INFINITY,
    }
}

/// The powers of two next to the roots of the diagonal, 1 where that is 0.
fn roots(a: &SymBlockMatrix, roots: &mut [f64]) {
    let p = a.pattern();
    for j in (0..p.blocks()).filter(|&j| p.size(j) > 0) {
        let diagonal = a.block(p.column(j).start).iter().step_by(p.size(j) + 1);
        for (root, &a) in roots[p.rows(j)].iter_mut().zip(diagonal) {
            *root = root_power(a.abs());
        }
    }
}

/// The power of two at or below √x; 1 of 0 and of what is not finite.
fn root_power(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return 1.0;
    }
    let exponent = (x.to_bits() >> 52) as i64 - 1023;
    f64::from_bits(((exponent.div_euclid(2) + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The residual of a probe is rounding where the factors solve, and of the size of the noise where they do not.
    #[test]
    fn a_probe_sees_what_the_factors_do_not_solve() {
        let diagonal = [3.0, -0.2, 5e4];
        let entries = (0..3).map(|i| (i, i, diagonal[i]));
        let mut rule = Rule::new(3);
        let mut probe = |part: f64| {
            let solve = |x: &mut [f64]| {
                x.iter_mut().zip(diagonal).for_each(|(x, a)| *x /= part * a);
                Ok(())
            };
            rule.probe(&entries, solve).expect("solves")
        };
        let sound = probe(1.0);
        assert!(sound.left < 1e-15, "{sound:?}");
        assert!((0.25..=1.5).contains(&sound.growth), "{sound:?}");
        assert!(sound.is_sound(None, f64::ROUNDOFF));
        let wrong = probe(1.01);
        assert!((0.004..0.016).contains(&wrong.left), "{wrong:?}");
        assert!(!wrong.is_sound(None, f64::ROUNDOFF));
    }

    #[test]
    fn roots_are_powers_of_two_at_or_below_the_root() {
        for x in [
            1.0,
            3.9,
            4.0,
            1e-300,
            1e300,
            0.24,
            f64::MIN_POSITIVE,
            5e-324,
        ] {
            let root = root_power(x);
            assert!(root.log2().fract() == 0.0 && root > 0.0, "{x}");
            let part = x.sqrt() / root;
            let holds = (1.0..2.0).contains(&part) || x < f64::MIN_POSITIVE;
            assert!(holds, "{x} {part}");
        }
        assert_eq!([root_power(0.0), root_power(f64::INFINITY)], [1.0; 2]);
    }

    #[test]
    fn a_probe_tells_near_singular_from_regular() {
        let sound = |growth, left, before| Probe { growth, left }.is_sound(before, f64::ROUNDOFF);
        assert!(sound(1e10, 1e-6, None));
        assert!(!sound(1e12, 1e-6, None) && sound(1e12, 1e-6, Some(6e11)));
        assert!(!sound(1e12, 1e-6, Some(4e11)) && !sound(2e13, 0.0, Some(2e13)));
        assert!(!sound(1.0, 0.1, Some(1.0)) && !sound(f64::INFINITY, 0.0, Some(f64::INFINITY)));
        assert!(!sound(f64::NAN, 0.0, None));
    }
}
