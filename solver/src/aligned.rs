//! Numbers that begin with a cache line: vectors of them that are stored do not straddle two.

/// Doubles that keep their number and their alignment.
#[derive(Debug)]
pub(crate) struct Aligned {
    /// Some more than there are.
    numbers: Vec<f64>,
    /// The first that counts.
    first: usize,
    len: usize,
}

/// A cache line, in bytes and doubles.
const LINE: usize = 64;
const IN_LINE: usize = LINE / size_of::<f64>();

impl Aligned {
    /// `len` zeros.
    pub(crate) fn new(len: usize) -> Self {
        let numbers = vec![0.0; len + IN_LINE];
        let first = numbers.as_ptr().align_offset(LINE).min(IN_LINE);
        Self {
            numbers,
            first,
            len,
        }
    }

    pub(crate) fn as_slice(&self) -> &[f64] {
        &self.numbers[self.first..self.first + self.len]
    }

    pub(crate) fn as_mut_slice(&mut self) -> &mut [f64] {
        &mut self.numbers[self.first..self.first + self.len]
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        let mut clone = Self::new(self.len);
        clone.as_mut_slice().copy_from_slice(self.as_slice());
        clone
    }
}

impl PartialEq for Aligned {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_are_aligned_and_equal() {
        for len in [0, 1, 7, 100] {
            let mut a = Aligned::new(len);
            for (i, v) in a.as_mut_slice().iter_mut().enumerate() {
                *v = i as f64;
            }
            let b = a.clone();
            assert_eq!(a, b);
            for v in [&a, &b] {
                assert_eq!(v.as_slice().len(), len);
                assert_eq!(v.as_slice().as_ptr() as usize % LINE, 0);
            }
        }
    }
}
