//! Matrices of which some blocks are replaced, as those are that leaves couple to (`leaves`).

use crate::{BlockPattern, SymBlockMatrix};
use std::collections::BTreeMap;

/// The values of a matrix and other blocks: numbers beyond those of the values are the patches'.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overlay<'a> {
    pub(crate) values: &'a [f64],
    pub(crate) patches: &'a [f64],
}

impl<'a> Overlay<'a> {
    /// So many values from number `first` on; `None` beyond the last, or from the matrix into the patches.
    #[inline(always)]
    pub(super) fn get(self, first: usize, count: usize) -> Option<&'a [f64]> {
        match self.values.get(first..first + count) {
            None => self.patch(first.checked_sub(self.values.len())?, count),
            found => found,
        }
    }

    /// The same, of values that exist.
    pub(super) fn block(self, first: usize, count: usize) -> &'a [f64] {
        match first.checked_sub(self.values.len()) {
            None => &self.values[first..first + count],
            Some(first) => &self.patches[first..first + count],
        }
    }

    #[cold]
    fn patch(self, first: usize, count: usize) -> Option<&'a [f64]> {
        self.patches.get(first..first + count)
    }
}

impl<'a> From<&'a SymBlockMatrix> for Overlay<'a> {
    fn from(a: &'a SymBlockMatrix) -> Self {
        Self {
            values: a.values(),
            patches: &[],
        }
    }
}

/// Where stored blocks begin: those with a patch in it, all others in the matrix.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Offsets<'a> {
    pub(super) pattern: &'a BlockPattern,
    pub(super) patched: &'a BTreeMap<usize, usize>,
}

impl<'a> From<&'a BlockPattern> for Offsets<'a> {
    fn from(pattern: &'a BlockPattern) -> Self {
        static NONE: BTreeMap<usize, usize> = BTreeMap::new();
        Self {
            pattern,
            patched: &NONE,
        }
    }
}

impl Offsets<'_> {
    /// The number of the first value of stored block `k`.
    pub(super) fn of(self, k: usize) -> usize {
        let own = || self.pattern.values(k).start;
        self.patched.get(&k).copied().unwrap_or_else(own)
    }

    /// Returns true if `first` is the first value of a patch.
    pub(super) fn is_patch(self, first: usize) -> bool {
        first >= self.pattern.stored_values()
    }
}
