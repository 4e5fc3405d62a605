//! Settings of an experiment for its page and for `NAME.report.json`: a name and a value with its
//! unit.

use crate::notation::number;
use taut_measure::choice::Choice;

/// The values, each once, in the order of their first places.
pub fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

/// A name and a value.
pub type Setting = (String, String);

/// Settings from names and values.
pub fn set<const N: usize>(pairs: [(&str, String); N]) -> Vec<Setting> {
    pairs.map(|(name, value)| (name.to_owned(), value)).to_vec()
}

/// Values beside each other; a name may hold a comma.
pub fn list<T>(values: &[T], shown: impl Fn(&T) -> String) -> String {
    let shown: Vec<String> = values.iter().map(shown).collect();
    let has_comma = shown.iter().any(|text| text.contains(','));
    shown.join(if has_comma { "; " } else { ", " })
}

/// Most numbers that are named one by one.
const MOST: usize = 14;

/// Numbers in order; of many the first and the last.
pub fn numbers(values: &[f64]) -> String {
    match values {
        [first, .., last] if values.len() > MOST => {
            format!(
                "{} from {} to {}",
                values.len(),
                number(*first),
                number(*last)
            )
        }
        _ => list(values, |x| number(*x)),
    }
}

/// Counts beside each other.
pub fn counts(values: &[usize]) -> String {
    list(values, ToString::to_string)
}

pub fn seconds(time: f64) -> String {
    format!("{} s", number(time))
}

/// A time step, as a fraction of a second where it is one.
pub fn step(dt: f64) -> String {
    let rate = 1.0 / dt;
    if rate > 1.0 && (rate - rate.round()).abs() < 1e-6 * rate {
        format!("1/{rate:.0} s")
    } else {
        seconds(dt)
    }
}

/// Solvers beside each other, without iterations and tolerances.
pub fn solvers(choices: &[Choice]) -> String {
    list(choices, Choice::family)
}

/// Refinements per solver in studies that give direct solvers one.
pub const ONE_REFINEMENT: &str = "1 for direct solvers; umfpack/kkt its own, iterations none";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_short_and_have_units() {
        assert_eq!(step(1.0 / 60.0), "1/60 s");
        assert_eq!(step(0.015), "0.015 s");
        assert_eq!(numbers(&[1.0, 1e3, 1e5]), "1, 10³, 10⁵");
        let many: Vec<f64> = (0..25).map(|k| 10_f64.powf(f64::from(k) / 4.0)).collect();
        assert_eq!(numbers(&many), "25 from 1 to 10⁶");
    }
}
