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
    pub of: usize,
}

impl Shard {
    /// The only one.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// True for its own cases. They are dealt in turn, each round begun one shard later: a list that repeats itself is dealt
    /// evenly all the same.
    pub fn owns(self, case: usize) -> bool {
        (case + case / self.of) % self.of + 1 == self.number
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

    #[test]
    fn every_case_is_dealt_once_and_a_list_that_repeats_itself_evenly() {
        for of in [1, 2, 3, 8, 99] {
            let shards = (1..=of).map(|number| Shard { number, of });
            let own = shards.map(|shard| (0..of * of).filter(move |case| shard.owns(*case)));
            let own: Vec<Vec<usize>> = own.map(Iterator::collect).collect();
            let mut all = own.concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..of * of));
            for cases in own {
                let mut kinds: Vec<usize> = cases.into_iter().map(|case| case % of).collect();
                kinds.sort_unstable();
                assert!(kinds.into_iter().eq(0..of), "{of}");
            }
        }
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
