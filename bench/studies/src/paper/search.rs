//! The largest stable ratio: up in steps to the first that fails, then by halves between it and the one before.

/// Searches up to `top` in steps of `step`, then to `width`, all in decades; `fails` takes the logarithm of a ratio. The end
/// of the first stretch of stable ratios, as a logarithm, none where 1 is unstable; and how the smallest unstable ratio that
/// was tried failed, none where the largest one tried is stable.
pub(super) fn largest<F, E>(
    [top, step, width]: [f64; 3],
    fails: impl Fn(f64) -> Result<Option<F>, E>,
) -> Result<(Option<f64>, Option<F>), E> {
    let (mut low, mut high) = (None, 0.0);
    let mut failure = None;
    while high <= top {
        failure = fails(high)?;
        if failure.is_some() {
            break;
        }
        low = Some(high);
        high += step;
    }
    while let (Some(stable), true) = (low, failure.is_some())
        && high - stable > width
    {
        let middle = 0.5 * (stable + high);
        match fails(middle)? {
            None => low = Some(middle),
            failed => (high, failure) = (middle, failed),
        }
    }
    Ok((low, failure))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    fn search(limit: f64) -> (Option<f64>, Option<f64>) {
        let fails = |decade: f64| Ok::<_, Infallible>((decade > limit).then_some(decade));
        largest([3.0, 1.0, 0.25], fails).unwrap_or_else(|e| match e {})
    }

    #[test]
    fn the_limit_is_bracketed_to_a_quarter_of_a_decade() {
        for limit in [0.0, 0.3, 0.7, 0.99, 1.0, 1.57, 2.999] {
            let (stable, failure) = search(limit);
            let stable = stable.expect("1 is stable");
            assert!(stable <= limit && limit < stable + 0.25, "{limit}");
            let next = failure.expect("fails above");
            assert!(next > limit && next <= stable + 0.25, "{limit}");
        }
    }

    #[test]
    fn both_ends_are_told() {
        assert_eq!(search(-0.5).0, None);
        assert_eq!(search(9.0), (Some(3.0), None));
    }
}
