//! Names that are looked up.

/// The name among those that are `known` that takes the fewest changes of a letter, for errors of unknown names. None
/// where all take more than half of their letters.
#[must_use]
pub fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let near = |other: &&str| {
        let letters = name.chars().count().max(other.chars().count());
        changes(name, other).is_some_and(|changes| 2 * changes <= letters)
    };
    known.filter(near).min_by_key(|other| changes(name, other))
}

/// At most eight names, and how many more there are.
pub(crate) fn first_names(names: &[String]) -> Vec<String> {
    let mut known: Vec<_> = names.iter().take(8).cloned().collect();
    if names.len() > known.len() {
        known.push(format!("and {} more", names.len() - known.len()));
    }
    known
}

/// [`first_names`], the nearest to `name` first where not all are listed.
pub(crate) fn near_names(name: &str, names: &[String]) -> Vec<String> {
    let mut names = names.to_vec();
    if names.len() > 8 {
        names.sort_by_cached_key(|other| changes(name, other).unwrap_or(usize::MAX));
    }
    first_names(&names)
}

/// Longest name that is compared with others.
const LONGEST: usize = 200;

/// Letters to change, to add or to drop (Levenshtein). None of names beyond [`LONGEST`] bytes.
fn changes(name: &str, other: &str) -> Option<usize> {
    if name.len().max(other.len()) > LONGEST {
        return None;
    }
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
    Some(row[other.len()])
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
        assert_eq!(changes("kitten", "sitting"), Some(3));
        assert_eq!(nearest(&"x".repeat(1000), known()), None);
    }

    #[test]
    fn a_name_that_shares_less_than_half_is_not_near() {
        assert_eq!(nearest("lo", ["load"].into_iter()), Some("load"));
        assert_eq!(nearest("lo", ["loads"].into_iter()), None);
        assert_eq!(nearest("k", ["j"].into_iter()), None);
        assert_eq!(nearest("ldz", ["dt", "load_z"].into_iter()), Some("load_z"));
    }

    #[test]
    fn names_are_cut_short() {
        let names: Vec<_> = (0..20).map(|i| i.to_string()).collect();
        let first = first_names(&names);
        assert_eq!((first.len(), first[8].as_str()), (9, "and 12 more"));
        assert_eq!(first_names(&names[..8]).len(), 8);
    }

    #[test]
    fn the_nearest_of_many_names_come_first() {
        let names: Vec<String> = (0..20).map(|i| format!("body-{i}")).collect();
        let near = near_names("bdy-17", &names);
        assert_eq!((near.len(), near[0].as_str()), (9, "body-17"));
        assert_eq!(near[8], "and 12 more");
        assert_eq!(near_names("body-7", &names[..8]), names[..8]);
    }
}
