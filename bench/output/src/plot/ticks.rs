//! Where an axis has its ticks, and what stands at them: decades on a logarithmic axis, with 2 and 5 between them where
//! there are few, else round numbers.

use crate::notation::{number, on_log_axis};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// Most ticks of an axis.
pub(super) const MOST: usize = 10;

/// An axis between two places, with its ticks. Places are logarithms on a logarithmic one, negative on a reversed one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    ends: Range<f64>,
    ticks: Vec<f64>,
    log: bool,
    reversed: bool,
    /// Labels at the ticks of an axis without numbers.
    names: Vec<String>,
}

impl Scale {
    pub(super) fn new(ends: Range<f64>, log: bool, reversed: bool) -> Self {
        let span = ends.end - ends.start;
        let ends = if span.is_finite() && span > 0.0 {
            ends
        } else {
            0.0..1.0
        };
        let ticks = if log { decades(&ends) } else { round(&ends) };
        Self {
            ends,
            ticks,
            log,
            reversed,
            names: Vec::new(),
        }
    }

    /// Axis of names at the places 0, 1 …; of more than [`MOST`] names only some get a tick.
    pub(super) fn of_names(names: &[String]) -> Self {
        let places = (0..names.len()).step_by(names.len().div_ceil(MOST).max(1));
        let places = places.map(|place| place as f64);
        Self {
            ticks: places.collect(),
            names: names.to_vec(),
            ..Self::new(-0.5..names.len() as f64 - 0.5, false, false)
        }
    }
}

/// Multiples of 1, 2 or 5 times a power of ten, at most nine of them.
fn round(ends: &Range<f64>) -> Vec<f64> {
    let span = ends.end - ends.start;
    let unit = 10_f64.powf((span / 8.0).log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|k| k * unit);
    let step = steps.into_iter().find(|s| span / s <= 8.0);
    let step = step.unwrap_or(span / 8.0);
    let first = (ends.start / step).ceil();
    let ticks = (0..MOST).map(|k| (first + k as f64) * step);
    ticks.take_while(|t| *t <= ends.end).collect()
}

/// Places of powers of ten. Where these are two or fewer, also 2 and 5 times them. Where all are
/// two or fewer, round numbers.
fn decades(ends: &Range<f64>) -> Vec<f64> {
    let span = ends.end - ends.start;
    let every = (span / 8.0).ceil().max(1.0);
    let first = (ends.start / every).ceil();
    let whole = (0..MOST).map(|k| (first + k as f64) * every);
    let whole: Vec<f64> = whole.take_while(|t| *t <= ends.end).collect();
    if whole.len() > 2 {
        return whole;
    }
    let low = ends.start.floor();
    let between = (0..4).flat_map(|k| [1.0_f64, 2.0, 5.0].map(|m| low + f64::from(k) + m.log10()));
    let between: Vec<f64> = between.filter(|t| ends.contains(t)).collect();
    if between.len() > 2 {
        return between;
    }
    let values = 10_f64.powf(ends.start)..10_f64.powf(ends.end);
    round(&values).into_iter().map(f64::log10).collect()
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value - self.ends.start) / (self.ends.end - self.ends.start);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.ends.clone()
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, place: &f64) -> String {
        let place = *place;
        if !self.names.is_empty() {
            return self.names.get(place as usize).cloned().unwrap_or_default();
        }
        if self.log {
            return on_log_axis(10_f64.powf(place));
        }
        let place = if self.reversed { -place } else { place };
        let span = self.ends.end - self.ends.start;
        // Rounding can leave a residue where the sum is zero.
        number(if place.abs() < 1e-9 * span {
            0.0
        } else {
            place
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(ends: Range<f64>, log: bool) -> Vec<String> {
        let scale = Scale::new(ends, log, false);
        scale.ticks.iter().map(|t| scale.format_ext(t)).collect()
    }

    #[test]
    fn a_logarithmic_axis_has_powers_of_ten() {
        let found = shown(-16.2..0.3, true);
        assert_eq!(found, ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "1"]);
        assert_eq!(shown(0.8..3.1, true), ["10", "100", "10³"]);
        assert_eq!(shown(0.0..1.6, true), ["1", "2", "5", "10", "20"]);
        assert_eq!(shown(-2.1..0.2, true), ["0.01", "0.1", "1"]);
        let found = shown(-16.1..-14.9, true);
        assert_eq!(found, ["10⁻¹⁶", "2·10⁻¹⁶", "5·10⁻¹⁶", "10⁻¹⁵"]);
    }

    #[test]
    fn a_linear_axis_has_round_numbers_and_no_axis_too_many() {
        let found = shown(-0.4..61.0, false);
        assert_eq!(found, ["0", "10", "20", "30", "40", "50", "60"]);
        for exponent in -30..30 {
            for factor in [1.0, 1.7, 3.0, 7.9] {
                let ends = -0.3 * 10_f64.powi(exponent)..factor * 10_f64.powi(exponent);
                let count = shown(ends, false).len();
                assert!((3..=MOST).contains(&count), "{exponent}: {count}");
            }
        }
        for span in [1e-3, 0.2, 1.0, 3.0, 12.0, 90.0, 1e3] {
            let count = shown(-3.21..span - 3.21, true).len();
            assert!((2..=MOST).contains(&count), "{span}: {count}");
        }
        // An empty, undefined or overflowing range falls back to 0..1.
        for ends in [f64::NAN..1.0, 1.0..1.0, f64::MIN..f64::MAX] {
            assert_eq!(Scale::new(ends, false, false).range(), 0.0..1.0);
        }
    }
}
