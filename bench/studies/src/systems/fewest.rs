//! The fewest iterations that reach an error: up by doubling, then by bisection.

use taut_integrator::StepError;

/// Errors of a solver over its iterations.
pub struct Fewest<F> {
    error: F,
    limit: usize,
    /// From this many on the count is sought to that part of itself.
    exact: usize,
    /// Iterations and errors, ascending.
    known: Vec<(usize, f64)>,
}

impl<F: FnMut(usize) -> Result<f64, StepError>> Fewest<F> {
    pub fn new(limit: usize, exact: usize, error: F) -> Self {
        Self {
            error,
            limit,
            exact,
            known: Vec::new(),
        }
    }

    pub fn error(&mut self, iterations: usize) -> Result<f64, StepError> {
        let place = self.known.partition_point(|(k, _)| *k < iterations);
        match self.known.get(place) {
            Some((k, error)) if *k == iterations => Ok(*error),
            _ => {
                let error = (self.error)(iterations)?;
                self.known.insert(place, (iterations, error));
                Ok(error)
            }
        }
    }

    /// Fewest iterations for an error, as far as it falls with them; none where the limit is not enough.
    pub fn within(&mut self, target: f64) -> Result<Option<usize>, StepError> {
        let (mut short, mut k) = (0, 1);
        while self.error(k)? > target {
            if k == self.limit {
                return Ok(None);
            }
            short = k;
            k = (2 * k).min(self.limit);
        }
        while k - short > 1 + short / self.exact {
            let middle = short.midpoint(k);
            if self.error(middle)? <= target {
                k = middle;
            } else {
                short = middle;
            }
        }
        Ok(Some(k))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_is_the_least_that_is_enough_and_each_is_tried_once() {
        let mut tried = Vec::new();
        let mut search = Fewest::new(1000, usize::MAX, |k| {
            tried.push(k);
            Ok(1.0 / k as f64)
        });
        assert_eq!(search.within(0.1).ok(), Some(Some(10)));
        assert_eq!(search.within(0.01).ok(), Some(Some(100)));
        assert_eq!(search.within(1e-4).ok(), Some(None));
        tried.sort_unstable();
        assert!(tried.windows(2).all(|pair| pair[0] < pair[1]), "{tried:?}");
        let mut coarse = Fewest::new(1000, 64, |k| Ok(1.0 / k as f64));
        let found = coarse.within(1.0 / 700.0).ok().flatten();
        assert!(found.is_some_and(|k| (700..=711).contains(&k)), "{found:?}");
    }
}
