//! Calls into the C library: the only unsafe code of the crate.
//!
//! Whatever C relies on is checked or held here, so that no caller can break it: a [`Pattern`] is
//! well-formed, an [`Analysis`] and its [`Factors`] keep the pattern they were made of, and every
//! length is compared before a pointer is passed.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::ptr::{null, null_mut};
use std::sync::Arc;

use crate::{Error, Options, Scaling, Strategy};

include!(concat!(env!("OUT_DIR"), "/constants.rs"));

unsafe extern "C" {
    fn umfpack_di_defaults(control: *mut f64);
    fn umfpack_di_symbolic(
        n_row: i32,
        n_col: i32,
        col_ptr: *const i32,
        row_idx: *const i32,
        values: *const f64,
        symbolic: *mut *mut c_void,
        control: *const f64,
        info: *mut f64,
    ) -> i32;
    fn umfpack_di_numeric(
        col_ptr: *const i32,
        row_idx: *const i32,
        values: *const f64,
        symbolic: *mut c_void,
        numeric: *mut *mut c_void,
        control: *const f64,
        info: *mut f64,
    ) -> i32;
    fn umfpack_di_wsolve(
        system: i32,
        col_ptr: *const i32,
        row_idx: *const i32,
        values: *const f64,
        x: *mut f64,
        b: *const f64,
        numeric: *mut c_void,
        control: *const f64,
        info: *mut f64,
        index_work: *mut i32,
        work: *mut f64,
    ) -> i32;
    fn umfpack_di_free_symbolic(symbolic: *mut *mut c_void);
    fn umfpack_di_free_numeric(numeric: *mut *mut c_void);
}

/// Statistics of a call.
pub(crate) type Info = [f64; INFO];

/// The settings of all calls.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Control([f64; CONTROL]);

impl Control {
    /// UMFPACK's own settings.
    pub(crate) fn defaults() -> Self {
        let mut control = [0.0; CONTROL];
        // SAFETY: the array has the length that the library's header gives, and C fills it.
        unsafe { umfpack_di_defaults(control.as_mut_ptr()) };
        Self(control)
    }

    pub(crate) fn new(options: &Options) -> Result<Self, Error> {
        let mut control = Self::defaults();
        let mut set = |index: usize, value: f64| control.0[index] = value;
        // C converts this number to an int.
        let steps = options.refinement_steps.min(i32::MAX.unsigned_abs());
        set(IRSTEP, f64::from(steps));
        let strategy = match options.strategy {
            Strategy::Auto => STRATEGY_AUTO,
            Strategy::Unsymmetric => STRATEGY_UNSYMMETRIC,
            Strategy::Symmetric => STRATEGY_SYMMETRIC,
        };
        set(STRATEGY, f64::from(strategy));
        let scaling = match options.scaling {
            Scaling::None => SCALE_NONE,
            Scaling::Sum => SCALE_SUM,
            Scaling::Max => SCALE_MAX,
        };
        set(SCALE, f64::from(scaling));
        if let Some(value) = options.pivot_tolerance {
            if !(0.0..=1.0).contains(&value) {
                let name = "pivot_tolerance";
                return Err(Error::InvalidOption { name, value });
            }
            set(PIVOT_TOLERANCE, value);
        }
        Ok(control)
    }
}

/// The positions of the entries of a square matrix, checked and owned: C reads them unchecked.
pub(crate) struct Pattern {
    n: i32,
    col_ptr: Vec<i32>,
    row_idx: Vec<i32>,
}

impl Pattern {
    pub(crate) fn new(n: usize, col_ptr: &[i32], row_idx: &[i32]) -> Result<Self, Error> {
        // C forms n + 1 as an int.
        let order = index("n", n)?;
        if order == i32::MAX {
            return Err(Error::IndexOverflow {
                what: "n",
                value: n,
            });
        }
        index("row_idx", row_idx.len())?;
        if n == 0 {
            return Err(Error::NonPositiveDimension);
        }
        check_len("col_ptr", n + 1, col_ptr)?;
        let mut end = 0;
        for (column, next) in col_ptr.windows(2).enumerate() {
            let rows = (usize::try_from(next[0]).ok())
                .zip(usize::try_from(next[1]).ok())
                .filter(|(start, _)| *start == end)
                .and_then(|(start, stop)| row_idx.get(start..stop))
                .filter(|rows| rows.is_sorted_by(|a, b| a < b))
                .filter(|rows| rows.iter().all(|row| (0..order).contains(row)));
            let column = Some(column);
            end += rows.ok_or(Error::InvalidMatrix { column })?.len();
        }
        check_len("row_idx", end, row_idx)?;
        let mut pattern = Self {
            n: order,
            col_ptr: filled(n + 1, 0)?,
            row_idx: filled(end, 0)?,
        };
        pattern.col_ptr.copy_from_slice(col_ptr);
        pattern.row_idx.copy_from_slice(row_idx);
        Ok(pattern)
    }

    pub(crate) fn n(&self) -> usize {
        self.col_ptr.len() - 1
    }

    fn check(&self, col_ptr: &[i32], row_idx: &[i32], values: &[f64]) -> Result<(), Error> {
        if *self.col_ptr != *col_ptr || *self.row_idx != *row_idx {
            return Err(Error::DifferentPattern);
        }
        self.check_values(values)
    }

    fn check_values(&self, values: &[f64]) -> Result<(), Error> {
        check_len("values", self.row_idx.len(), values)?;
        check_finite("values", values)
    }
}

/// A number as an index of C.
pub(crate) fn index(what: &'static str, value: usize) -> Result<i32, Error> {
    i32::try_from(value).map_err(|_| Error::IndexOverflow { what, value })
}

fn check_len<T>(what: &'static str, expected: usize, slice: &[T]) -> Result<(), Error> {
    let found = slice.len();
    if found == expected {
        return Ok(());
    }
    Err(Error::DimensionMismatch {
        what,
        expected,
        found,
    })
}

fn check_finite(what: &'static str, slice: &[f64]) -> Result<(), Error> {
    match slice.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(Error::NonFinite { what, index }),
        None => Ok(()),
    }
}

fn filled<T: Copy>(len: usize, value: T) -> Result<Vec<T>, Error> {
    let mut vec = Vec::new();
    vec.try_reserve_exact(len).map_err(|_| Error::OutOfMemory)?;
    vec.resize(len, value);
    Ok(vec)
}

/// Owns a symbolic object of the library.
pub(crate) struct Analysis {
    handle: *mut c_void,
    pub(crate) pattern: Arc<Pattern>,
}

// SAFETY: the object is heap memory that nothing else refers to, the library has no thread-local
// state, and its allocator is malloc, which any thread may free.
unsafe impl Send for Analysis {}

impl Analysis {
    pub(crate) fn new(
        pattern: Pattern,
        values: Option<&[f64]>,
        control: &Control,
    ) -> Result<Self, Error> {
        if let Some(values) = values {
            pattern.check_values(values)?;
        }
        let mut analysis = Self {
            handle: null_mut(),
            pattern: Arc::new(pattern),
        };
        let pattern = &*analysis.pattern;
        let mut info = [0.0; INFO];
        // SAFETY: a pattern is well-formed, the values are null or as many as its entries, control
        // and info have the lengths that the library's header gives.
        let status = unsafe {
            umfpack_di_symbolic(
                pattern.n,
                pattern.n,
                pattern.col_ptr.as_ptr(),
                pattern.row_idx.as_ptr(),
                values.map_or(null(), <[f64]>::as_ptr),
                &raw mut analysis.handle,
                control.0.as_ptr(),
                info.as_mut_ptr(),
            )
        };
        Error::check(status, f64::NAN)?;
        Ok(analysis)
    }
}

impl Drop for Analysis {
    fn drop(&mut self) {
        // SAFETY: the handle is null, which C ignores, or an object that this value alone owns.
        unsafe { umfpack_di_free_symbolic(&raw mut self.handle) };
    }
}

/// Owns a numeric object of the library, or none after a failure, and the memory of its solves.
pub(crate) struct Factors {
    handle: *mut c_void,
    pub(crate) pattern: Arc<Pattern>,
    index_work: Vec<i32>,
    work: Vec<f64>,
}

// SAFETY: as for `Analysis`; the pattern is shared, but never written.
unsafe impl Send for Factors {}

impl Factors {
    /// Has no factors yet.
    pub(crate) fn new(pattern: &Arc<Pattern>) -> Result<Self, Error> {
        let n = pattern.n();
        Ok(Self {
            handle: null_mut(),
            pattern: Arc::clone(pattern),
            index_work: filled(n, 0)?,
            work: filled(n.saturating_mul(5), 0.0)?,
        })
    }

    fn free(&mut self) {
        // SAFETY: the handle is null, which C ignores, or an object that this value alone owns; C
        // leaves null behind.
        unsafe { umfpack_di_free_numeric(&raw mut self.handle) };
    }

    pub(crate) fn factorise(
        &mut self,
        analysis: &Analysis,
        (col_ptr, row_idx, values): (&[i32], &[i32], &[f64]),
        control: &Control,
    ) -> Result<Info, Error> {
        analysis.pattern.check(col_ptr, row_idx, values)?;
        if self.pattern.n != analysis.pattern.n {
            *self = Self::new(&analysis.pattern)?;
        }
        // The memory of the old factors is the first that the allocator gives to the new ones.
        self.free();
        self.pattern = Arc::clone(&analysis.pattern);
        let mut info = [0.0; INFO];
        // SAFETY: the analysis is a valid object made of this very pattern, the values are as many
        // as the pattern's entries, control and info have the lengths that the header gives.
        let status = unsafe {
            umfpack_di_numeric(
                self.pattern.col_ptr.as_ptr(),
                self.pattern.row_idx.as_ptr(),
                values.as_ptr(),
                analysis.handle,
                &raw mut self.handle,
                control.0.as_ptr(),
                info.as_mut_ptr(),
            )
        };
        Error::check(status, info[RCOND]).inspect_err(|_| self.free())?;
        Ok(info)
    }

    pub(crate) fn solve(
        &mut self,
        system: i32,
        (col_ptr, row_idx, values): (&[i32], &[i32], &[f64]),
        b: &[f64],
        x: &mut [f64],
        control: &Control,
    ) -> Result<Info, Error> {
        let pattern = &*self.pattern;
        if self.handle.is_null() {
            return Err(Error::InvalidNumericObject);
        }
        pattern.check(col_ptr, row_idx, values)?;
        check_len("b", pattern.n(), b)?;
        check_len("x", pattern.n(), x)?;
        check_finite("b", b)?;
        let mut info = [0.0; INFO];
        // SAFETY: the factors are a valid object of this pattern, the values are as many as its
        // entries, b, x and the index memory have n numbers and the other memory the 5 n that
        // refinement needs, control and info have the lengths that the header gives.
        let status = unsafe {
            umfpack_di_wsolve(
                system,
                pattern.col_ptr.as_ptr(),
                pattern.row_idx.as_ptr(),
                values.as_ptr(),
                x.as_mut_ptr(),
                b.as_ptr(),
                self.handle,
                control.0.as_ptr(),
                info.as_mut_ptr(),
                self.index_work.as_mut_ptr(),
                self.work.as_mut_ptr(),
            )
        };
        Error::check(status, f64::NAN)?;
        check_finite("x", x)?;
        Ok(info)
    }
}

impl Drop for Factors {
    fn drop(&mut self) {
        self.free();
    }
}
