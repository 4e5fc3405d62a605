//! The ratio of two programs' times, with an interval: the median of the ratios of many rounds and its bootstrap interval
//! (B. Efron, *Bootstrap methods: another look at the jackknife*, 1979).

use taut_measure::random::Random;

/// Bootstrap samples.
const SAMPLES: usize = 2000;

/// Part of the samples outside of the interval, on each side: the interval holds 95 %.
const TAIL: f64 = 0.025;

/// A ratio with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    pub value: f64,
    /// The interval's lower end.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Ratio {
    /// Median of the rounds' ratios with its bootstrap interval; NaN without rounds.
    pub(super) fn of(rounds: impl Iterator<Item = f64>) -> Self {
        let rounds: Vec<f64> = rounds.collect();
        let mut random = Random::new(1);
        let drawn = (0..SAMPLES).map(|_| {
            let draws = rounds.iter().map(|_| rounds[random.below(rounds.len())]);
            median(draws)
        });
        let mut medians: Vec<f64> = drawn.collect();
        medians.sort_by(f64::total_cmp);
        let at = |part: f64| medians[(part * (SAMPLES - 1) as f64).round() as usize];
        Self {
            value: median(rounds.iter().copied()),
            low: at(TAIL),
            high: at(1.0 - TAIL),
        }
    }
}

/// The median; NaN of nothing.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[half],
        _ => 0.5 * (sorted[half - 1] + sorted[half]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_stand_in_the_middle() {
        let median = |values: &[f64]| median(values.iter().copied());
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
        assert!(Ratio::of([].into_iter()).value.is_nan());
    }

    /// As many ratios as quick comparisons have rounds, off by up to 1 %, and one in eight by up to 12 %, as where a process
    /// lies badly in memory.
    fn rounds(random: &mut Random, centre: f64) -> Vec<f64> {
        let round = |i: usize| {
            let off = if i.is_multiple_of(8) { 0.12 } else { 0.01 };
            centre * (1.0 + off * random.uniform())
        };
        (0..32).map(round).collect()
    }

    #[test]
    fn the_interval_holds_the_ratio_nearly_always() {
        let mut random = Random::new(7);
        let holds = |_: &usize| {
            let ratio = Ratio::of(rounds(&mut random, 1.0).into_iter());
            ratio.low <= 1.0 && 1.0 <= ratio.high
        };
        let held = (0..200).filter(holds).count();
        assert!(held >= 176, "{held} of 200");
    }

    #[test]
    fn ratios_of_a_few_bad_rounds_move_the_median_little() {
        let mut random = Random::new(3);
        for centre in [1.0, 1.1] {
            let mut disturbed = rounds(&mut random, centre);
            disturbed[3] = 40.0;
            disturbed[5] = 0.02;
            let ratio = Ratio::of(disturbed.into_iter());
            assert!((ratio.value - centre).abs() < 0.005, "{ratio:?}");
            assert!(ratio.high - ratio.low < 0.02, "{ratio:?}");
        }
    }
}
