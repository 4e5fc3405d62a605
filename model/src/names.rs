//! Names that are looked up.

/// The name among those that are `known` that takes the fewest changes of a letter, for errors of unknown names.
#[must_use]
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    known.min_by_key(|other| changes(name, other))
}

/// Letters to change, to add or to drop (Levenshtein).
fn changes(name: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (i, a) in name.chars().enumerate() {
        let (mut above, mut left) = (row[0], i + 1);
        row[0] = left;
        for (j, b) in other.iter().enumerate() {
            let here = (above + usize::from(a != *b)).min(left.min(row[j + 1]) + 1);
            (above, left) = (row[j + 1], here);
            row[j + 1] = here;
        }
    }
    row[other.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_has_the_fewest_changes() {
        let known = || ["load", "lode", "ladle"].into_iter();
        assert_eq!(nearest("laod", known()), Some("load"));
        assert_eq!(nearest("ladl", known()), Some("ladle"));
        assert_eq!(nearest("x", std::iter::empty()), None);
        assert_eq!(changes("kitten", "sitting"), 3);
    }
}
