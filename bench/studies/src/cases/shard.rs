//! Which shard runs which case.

use std::fmt;
use std::str::FromStr;

/// Most shards of a study.
const MOST: usize = 10_000;

/// One of several runs that share a study, such as `3/8`: the third of eight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which it is, from 1.
    pub number: usize,
    /// How many there are.
    pub of: usize,
}

impl Shard {
    /// The only one.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Which cases of these costs are its own. The most expensive case that is left goes to the shard with the least to do, the
    /// first of several: the shards cost alike as far as the costs are right. Equal costs are dealt in turn.
    #[must_use]
    pub fn own(self, costs: &[f64]) -> Vec<bool> {
        let mut order: Vec<usize> = (0..costs.len()).collect();
        order.sort_by(|&a, &b| costs[b].total_cmp(&costs[a]));
        // Shards beyond the number of cases get none.
        let mut loads = vec![0.0_f64; self.of.min(costs.len())];
        let mut own = vec![false; costs.len()];
        for case in order {
            let least = (0..loads.len()).min_by(|&a, &b| loads[a].total_cmp(&loads[b]));
            if let Some(shard) = least {
                loads[shard] += costs[case];
                own[case] = shard + 1 == self.number;
            }
        }
        own
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let shard = text.split_once('/').and_then(|(number, of)| {
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            (1 <= number && number <= of && of <= MOST).then_some(Self { number, of })
        });
        shard.ok_or_else(|| {
            format!(
                "a shard is its number and how many there are, at most {MOST}: from 1/8 to 8/8 for eight"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shards(of: usize, costs: &[f64]) -> Vec<Vec<bool>> {
        let shard = |number| Shard { number, of };
        (1..=of).map(|number| shard(number).own(costs)).collect()
    }

    #[test]
    fn every_case_is_dealt_once_and_shards_cost_alike() {
        let costs: Vec<f64> = (0..100).map(|k| f64::from(k * k % 37 + 1)).collect();
        for of in [1, 2, 8, 99, 100, 101, 250] {
            let own = shards(of, &costs);
            for case in 0..costs.len() {
                assert_eq!(
                    own.iter().filter(|own| own[case]).count(),
                    1,
                    "{case} of {of}"
                );
            }
            let cost = |own: &Vec<bool>| -> f64 {
                let cases = own.iter().zip(&costs).filter(|(own, _)| **own);
                cases.map(|(_, cost)| cost).sum()
            };
            let loads: Vec<f64> = own.iter().map(cost).collect();
            let most = loads.iter().fold(0.0_f64, |m, x| m.max(*x));
            let mean = costs.iter().sum::<f64>() / of as f64;
            assert!(most <= mean + 37.0, "{of}: {most} of {mean}");
            if of == 8 {
                assert!(most < 1.01 * mean, "{most} of {mean}");
            }
        }
        assert_eq!(shards(3, &[]), vec![Vec::<bool>::new(); 3]);
        assert_eq!(shards(2, &[f64::NAN, 1.0])[0].len(), 2);
    }

    #[test]
    fn equal_costs_are_dealt_in_turn() {
        let first: Vec<Vec<bool>> = shards(3, &[1.0; 4]);
        assert_eq!(first[0], [true, false, false, true]);
        assert_eq!(first[2], [false, false, true, false]);
    }

    #[test]
    fn a_shard_is_read_as_it_is_written() {
        assert_eq!("3/8".parse(), Ok(Shard { number: 3, of: 8 }));
        assert_eq!("3/8".parse::<Shard>().unwrap().to_string(), "3/8");
        for text in [
            "3/2", "0/2", "1/0", "0/0", "", "/", "1", "a/b", "1/2/3", "-1/2", "1/10001", "1/1e9",
        ] {
            assert!(text.parse::<Shard>().unwrap_err().contains("8/8"), "{text}");
        }
    }
}
