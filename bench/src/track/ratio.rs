//! The ratio of two programs' times, with an interval: the median of many ratios and its bootstrap interval
//! (B. Efron, *Bootstrap methods: another look at the jackknife*, 1979).

use serde::Serialize;
use taut_ground::random::Random;

/// Bootstrap samples.
const SAMPLES: usize = 2000;

/// Part of the samples outside of the interval, on each side: the interval holds 95 %.
const TAIL: f64 = 0.025;

/// A ratio with its interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ratio {
    /// The ratio.
    pub value: f64,
    /// The interval's lower end.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

impl Ratio {
    /// Of the ratios that were measured in some rounds; NaN where there are none.
    ///
    /// The processes of a round share their places in memory and with them a part of their error. So whole rounds are drawn
    /// first, with replacement, then as many ratios of each.
    pub(super) fn of(rounds: &[Vec<f64>]) -> Self {
        let mut all: Vec<f64> = rounds.concat();
        let value = median(&mut all);
        let mut random = Random::new(1);
        let mut drawn = Vec::with_capacity(all.len());
        let medians = (0..SAMPLES).map(|_| {
            drawn.clear();
            for _ in rounds {
                let round = &rounds[random.below(rounds.len())];
                drawn.extend(round.iter().map(|_| round[random.below(round.len())]));
            }
            median(&mut drawn)
        });
        let mut medians: Vec<f64> = medians.collect();
        medians.sort_by(f64::total_cmp);
        let at = |part: f64| medians[(part * (SAMPLES - 1) as f64).round() as usize];
        Self {
            value,
            low: at(TAIL),
            high: at(1.0 - TAIL),
        }
    }
}

/// The median; NaN of nothing. The values are left in order.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    match values.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => values[half],
        _ => 0.5 * (values[half - 1] + values[half]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_stand_in_the_middle() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&mut []).is_nan());
        assert!(Ratio::of(&[]).value.is_nan());
    }

    /// Ratios about 1 in eight rounds, each with an error of its own.
    fn rounds(random: &mut Random, shared: f64, own: f64) -> Vec<Vec<f64>> {
        let round = |random: &mut Random| {
            let centre = 1.0 + shared * random.uniform();
            (0..8).map(|_| centre + own * random.uniform()).collect()
        };
        (0..8).map(|_| round(random)).collect()
    }

    #[test]
    fn the_interval_holds_the_ratio_nearly_always() {
        for (shared, own) in [(0.0, 0.02), (0.02, 0.02), (0.02, 0.0)] {
            let mut random = Random::new(7);
            let holds = |_: &usize| {
                let ratio = Ratio::of(&rounds(&mut random, shared, own));
                ratio.low <= 1.0 && 1.0 <= ratio.high
            };
            let held = (0..100).filter(holds).count();
            assert!(held >= 88, "{held} of 100 with {shared} and {own}");
        }
    }

    #[test]
    fn a_disturbed_ratio_moves_little() {
        let mut disturbed = rounds(&mut Random::new(3), 0.0, 0.01);
        disturbed[2][3] = 40.0;
        disturbed[5][1] = 0.02;
        let ratio = Ratio::of(&disturbed);
        assert!((ratio.value - 1.0).abs() < 0.005, "{ratio:?}");
        assert!(ratio.high - ratio.low < 0.02, "{ratio:?}");
    }
}
