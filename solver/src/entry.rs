//! Listing data of the solvers: one entry a solver.

/// A solver as tables, pages and the command line present it.
///
/// ```
/// use taut_solver::Entry;
///
/// let skyline = Entry { licence: "MIT", ..Entry::new("skyline") };
/// assert!(skyline.rows.is_empty() && skyline.feature.is_none());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    /// Name, as on the command line.
    pub name: &'static str,
    /// The Cargo feature that brings it; `None` where it is always there.
    pub feature: Option<&'static str>,
    /// Licence of the code behind it, as SPDX writes it.
    pub licence: &'static str,
    /// The options that it knows, for messages.
    pub options: &'static str,
    /// Variants worth a row of their own, each as `name[:option…][/kkt]`. Where there are none: the name, and `name/kkt` of
    /// one that takes indefinite matrices.
    pub rows: &'static [&'static str],
    /// Colour of its curves, red, green and blue: to be read on white and on black.
    pub colour: [u8; 3],
}

impl Entry {
    /// An entry with nothing but a name: no stated licence, no options, rows by default, a red.
    #[must_use]
    pub const fn new(name: &'static str) -> Self {
        Self {
            name,
            feature: None,
            licence: "not stated",
            options: "none",
            rows: &[],
            colour: [214, 60, 60],
        }
    }

    /// Entry of a backend of this crate, whose Cargo feature has the backend's name.
    const fn own(name: &'static str) -> Self {
        Self {
            feature: Some(name),
            licence: "MIT OR Apache-2.0",
            ..Self::new(name)
        }
    }
}

pub(crate) const BANDED: Entry = Entry {
    colour: [0, 114, 178],
    ..Entry::own("banded")
};

pub(crate) const FAER: Entry = Entry {
    licence: "MIT",
    options: "llt, ldlt, lblt, lu",
    // `:lblt` has a row in the study of kernels alone: it stalls on some machines (`backends/faer/lblt.rs`), and its pivoting
    // costs time that quasi-definite systems do not need.
    rows: &[
        "faer:llt",
        "faer:ldlt",
        "faer:ldlt/kkt",
        "faer:lu",
        "faer:lu/kkt",
    ],
    colour: [0, 158, 115],
    ..Entry::own("faer")
};

pub(crate) const NALGEBRA_SPARSE: Entry = Entry {
    licence: "Apache-2.0",
    colour: [40, 155, 215],
    ..Entry::own("nalgebra-sparse")
};

pub(crate) const UMFPACK: Entry = Entry {
    licence: "GPL-2.0-or-later",
    options: "refinement=N",
    // Its own refinement, against S, cannot bring back what forming S lost.
    rows: &["umfpack:refinement=0", "umfpack/kkt"],
    colour: [160, 80, 0],
    ..Entry::own("umfpack")
};

pub(crate) const CONJUGATE_GRADIENT: Entry = Entry {
    options: "none, jacobi, group, iterations=N, tolerance=T",
    rows: &["cg:none", "cg:jacobi", "cg:group"],
    colour: [204, 121, 167],
    ..Entry::own("cg")
};

pub(crate) const GAUSS_SEIDEL: Entry = Entry {
    options: "joints, groups, guess, trial, iterations=N, tolerance=T",
    rows: &["gauss-seidel:joints", "gauss-seidel:groups"],
    colour: [210, 130, 0],
    ..Entry::own("gauss-seidel")
};

pub(crate) const MINRES: Entry = Entry {
    options: "iterations=N, tolerance=T",
    // On S, which is definite, `cg` minimises at half the work.
    rows: &["minres/kkt"],
    colour: [120, 94, 240],
    ..Entry::own("minres")
};

pub(crate) const DENSE: Entry = Entry {
    feature: None,
    options: "double, extended",
    rows: &["dense"],
    colour: [128, 128, 128],
    ..Entry::own("dense")
};

pub(crate) const AUTO: Entry = Entry {
    feature: None,
    licence: "that of the solver chosen",
    colour: [90, 90, 90],
    rows: &["auto"],
    ..Entry::own("auto")
};
