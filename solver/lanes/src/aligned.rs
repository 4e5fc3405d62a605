//! Numbers of which a chosen one begins a cache line: vectors of them that are stored do not straddle two.

use std::ops::{Deref, DerefMut};

/// Doubles that keep their number and their alignment.
#[derive(Debug, Default)]
pub struct Aligned {
    /// Some more than there are.
    numbers: Vec<f64>,
    /// The first that counts.
    first: usize,
    len: usize,
    /// The one that begins a line.
    aligned: usize,
}

/// A cache line, in bytes and doubles.
const LINE: usize = 64;
const IN_LINE: usize = LINE / size_of::<f64>();

impl Aligned {
    /// `len` zeros. Allocates.
    #[must_use]
    pub fn new(len: usize) -> Self {
        Self::aligned_at(len, 0)
    }

    /// `len` zeros, of which the one at `aligned` begins with a cache line. Allocates.
    #[must_use]
    pub fn aligned_at(len: usize, aligned: usize) -> Self {
        let aligned = aligned % IN_LINE;
        let numbers = vec![0.0; len + IN_LINE];
        let line = numbers.as_ptr().align_offset(LINE).min(IN_LINE);
        Self {
            numbers,
            first: (line + IN_LINE - aligned) % IN_LINE,
            len,
            aligned,
        }
    }
}

impl Deref for Aligned {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        &self.numbers[self.first..self.first + self.len]
    }
}

impl DerefMut for Aligned {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.numbers[self.first..self.first + self.len]
    }
}

impl<'a> IntoIterator for &'a Aligned {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a> IntoIterator for &'a mut Aligned {
    type Item = &'a mut f64;
    type IntoIter = std::slice::IterMut<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl From<Vec<f64>> for Aligned {
    fn from(numbers: Vec<f64>) -> Self {
        let mut aligned = Self::new(numbers.len());
        aligned.copy_from_slice(&numbers);
        aligned
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        let mut clone = Self::aligned_at(self.len, self.aligned);
        clone.copy_from_slice(self);
        clone
    }
}

impl PartialEq for Aligned {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_are_aligned_and_equal() {
        for (len, aligned) in [(0, 0), (1, 0), (7, 0), (100, 0), (100, 3), (100, 27)] {
            let mut a = Aligned::aligned_at(len, aligned);
            for (i, v) in a.iter_mut().enumerate() {
                *v = i as f64;
            }
            let b = a.clone();
            assert_eq!(a, b);
            for v in [&a, &b] {
                assert_eq!(v.len(), len);
                let at = v.as_ptr() as usize + aligned * size_of::<f64>();
                assert_eq!(at % LINE, 0, "{len} {aligned}");
            }
        }
    }
}
