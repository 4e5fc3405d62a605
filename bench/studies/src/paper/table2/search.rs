//! The largest stable ratio: up by decades, then by halves inside the first decade that fails.

use taut_ground::trajectory::Failure;

/// The end of the first stretch of stable ratios.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Found {
    /// Largest stable ratio; `None` where 1 is unstable.
    pub stable: Option<f64>,
    /// The largest ratio tried is stable.
    pub capped: bool,
    /// How the smallest unstable ratio that was tried failed.
    pub failure: Option<Failure>,
}

/// Largest ratio 10^(k/`per_decade`), k ≥ 0, below the first whole decade up to 10^`decades` that fails.
pub fn largest<E>(
    decades: u32,
    per_decade: u32,
    fails: impl Fn(f64) -> Result<Option<Failure>, E>,
) -> Result<Found, E> {
    let ratio = |k: u32| 10.0_f64.powf(f64::from(k) / f64::from(per_decade));
    let mut found = Found::default();
    let mut stable = None;
    for decade in 0..=decades {
        found.failure = fails(ratio(decade * per_decade))?;
        if found.failure.is_some() {
            break;
        }
        stable = Some(decade * per_decade);
    }
    found.capped = found.failure.is_none();
    if let (Some(low), false) = (&mut stable, found.capped) {
        let mut high = *low + per_decade;
        while high - *low > 1 {
            let middle = (*low + high) / 2;
            match fails(ratio(middle))? {
                None => *low = middle,
                failure => {
                    high = middle;
                    found.failure = failure;
                }
            }
        }
    }
    found.stable = stable.map(ratio);
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    fn search(limit: f64) -> Found {
        let found = largest::<Infallible>(3, 4, |ratio| {
            Ok((ratio > limit).then(|| Failure {
                time: ratio,
                reason: String::new(),
            }))
        });
        found.unwrap_or_else(|e| match e {})
    }

    #[test]
    fn the_limit_is_bracketed_to_a_quarter_of_a_decade() {
        for limit in [1.0, 2.0, 5.0, 9.0, 10.0, 37.0, 999.0] {
            let found = search(limit);
            let stable = found.stable.expect("1 is stable");
            assert!(
                stable <= limit && limit < 1.001 * stable * 10.0_f64.powf(0.25),
                "{limit}"
            );
            let next = found.failure.expect("fails above").time;
            assert!(
                next > limit && next < 1.001 * stable * 10.0_f64.powf(0.25),
                "{limit}"
            );
            assert!(!found.capped);
        }
    }

    #[test]
    fn both_ends_are_told() {
        assert_eq!(search(0.5).stable, None);
        let top = search(1e9);
        assert_eq!(
            (top.stable, top.capped, top.failure),
            (Some(1e3), true, None)
        );
    }
}
