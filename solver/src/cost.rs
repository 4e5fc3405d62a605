//! Predicted time of a direct solver for one system, from counts. [`Backend::Auto`] chooses the
//! cheapest backend by it before anything is factorised.
//!
//! The time of a factorisation with two solves, as a step makes them, is taken to be a sum of counts,
//!
//! ```text
//! t = c₀ + c₁ n + c₂ e + c₃ f + c₄ b + c₅ u + c₆ r e
//! ```
//!
//! with n scalar rows, e entries and f operations of the factor, b its blocks and u the products of two of them, r rows of a
//! border. The c are a way's own: a *way* is a piece of code, of which a backend has one or two. Entries and operations are
//! counted block by block ([`elimination_cost`]), b and u follow from them and the mean block of the matrix. Nothing is
//! measured when a solver is chosen, so that the choice is the same on every machine and in every run.

use crate::{
    Backend, BlockPattern, EliminationCost, FaerFactorization, Preconditioner, SolveError,
    elimination_cost,
};

/// Counts of a system whose blocks are eliminated in some order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Counts {
    /// Scalar rows.
    pub rows: usize,
    /// Block rows.
    pub blocks: usize,
    /// Mean entries of a stored block.
    pub block: f64,
    /// Cost of the block LDLᵀ in that order.
    pub factor: EliminationCost,
    /// Rows of the border where `banded` takes the system as a chain ([`Backend::border_rows`]).
    pub border: Option<usize>,
    /// Iterations to be expected of a solver that iterates; 0 where nothing is known of them.
    pub iterations: f64,
}

/// Number of counts that a time is a sum of.
pub const TERMS: usize = 7;

/// A piece of code that factorises, with the time of each of the counts \[ns].
struct Way {
    name: &'static str,
    times: [f64; TERMS],
}

/// Least squares of `taut study auto --fit`: relative errors of the linear solve with one refinement, on scenes that the
/// choice is not judged on, with AVX-512. Groups, which iterate, from `taut study scenes`: nets of 4² to 18² nodes, load/node
/// ratios from 1 to 10⁴, 2.9 ns where a swing begins. 1.8 ns is set by hand: at 2.9 nets of 5² and 8² that swing on took a
/// solver 1.4 to 1.7 times as slow.
#[rustfmt::skip]
const WAYS: [Way; 8] = [
    //                              call      row    entry  flop  block   update border
    Way { name: "chain",   times: [410.0,   0.000,  0.934, 0.000,  0.0,  15.7, 0.139] },
    Way { name: "blocks",  times: [  0.0, 109.000,  0.000, 0.212,  0.0,   0.0, 0.000] },
    Way { name: "entries", times: [345.0,  49.500,  2.360, 0.551,  0.0,   0.0, 0.000] },
    Way { name: "panels",  times: [  0.0,  93.100,  6.560, 0.000, 73.9,   0.0, 0.000] },
    Way { name: "columns", times: [253.0,  65.500,  0.000, 0.964,  0.0,   0.0, 0.000] },
    Way { name: "fronts",  times: [1010.0,  0.000, 47.400, 0.000, 204.0,  0.0, 0.000] },
    Way { name: "dense",   times: [320.0,   0.000,  6.520, 0.000,  0.0,   0.0, 0.000] },
    Way { name: "groups",  times: [  0.0,   0.000,  1.800, 0.000,  0.0,   0.0, 0.000] },
];

/// Operations for each entry of the factor from which on faer works on panels: 9 of its own, which are half as many and
/// 1.5 for each entry besides.
const PANELS: f64 = 15.0;

impl Counts {
    /// Counts of a system of `pattern`, eliminated in an order of cost `factor`.
    #[must_use]
    pub fn new(pattern: &BlockPattern, factor: EliminationCost, border: Option<usize>) -> Self {
        Self {
            rows: pattern.dim(),
            blocks: pattern.blocks(),
            block: pattern.stored_values() as f64 / pattern.stored_blocks().max(1) as f64,
            factor,
            border,
            iterations: 0.0,
        }
    }

    /// Counts of a system in the order of its pattern, for solvers that are given no border to
    /// make.
    ///
    /// # Errors
    /// The errors of [`elimination_cost`].
    pub fn in_order(pattern: &BlockPattern) -> Result<Self, SolveError> {
        let order: Vec<usize> = (0..pattern.blocks()).collect();
        // All backends that keep the order refuse a larger factor, so the cost is capped.
        let most = EliminationCost::LARGEST;
        let cost = elimination_cost(pattern, &order, most)?.unwrap_or(most);
        Ok(Self::new(pattern, cost, None))
    }

    /// 1, n, e, f, b, u, r e.
    fn terms(&self) -> [f64; TERMS] {
        let (entries, flops) = (self.factor.entries as f64, self.factor.flops as f64);
        let block = self.block.max(1.0);
        [
            1.0,
            self.rows as f64,
            entries,
            flops,
            entries / block,
            0.5 * flops / block.powf(1.5),
            self.border.unwrap_or(0) as f64 * entries,
        ]
    }

    /// Counts of the same system as a dense one without symmetry.
    fn dense(self) -> Self {
        let rows = self.rows as u64;
        let entries = rows.saturating_mul(rows);
        let flops = entries.saturating_mul(rows) / 3 * 2;
        Self {
            factor: EliminationCost { entries, flops },
            ..self
        }
    }

    /// Counts of an iteration that solves with this factor each time.
    fn iterated(self) -> Self {
        let entries = self.factor.entries as f64 * self.iterations;
        let factor = EliminationCost {
            entries: entries as u64,
            flops: 0,
        };
        Self { factor, ..self }
    }

    /// Returns true if faer works on panels, not entry by entry.
    fn makes_panels(&self) -> bool {
        let mean_rows = self.rows as f64 / self.blocks.max(1) as f64;
        let upper = self.rows as f64 * (mean_rows - 1.0) * 0.5;
        let (entries, flops) = (self.factor.entries as f64, self.factor.flops as f64);
        flops > PANELS * (entries - upper)
    }
}

impl Backend {
    /// The way that it goes for a system of these counts, its name and the counts that its time is a sum of; `None` where
    /// it is of another crate or its iterations are not known.
    #[must_use]
    pub fn way(&self, counts: &Counts) -> Option<(&'static str, [f64; TERMS])> {
        let way = |at: usize, counts: &Counts| Some((WAYS[at].name, counts.terms()));
        match self {
            Self::Banded if counts.border.is_some() => way(0, counts),
            Self::Banded => way(1, counts),
            Self::Faer(o) if o.factorization == FaerFactorization::Lu => way(5, counts),
            Self::Faer(_) if counts.makes_panels() => way(3, counts),
            Self::Faer(_) => way(2, counts),
            Self::NalgebraSparse => way(4, counts),
            Self::Umfpack(_) => way(5, counts),
            Self::Dense(_) => way(6, &counts.dense()),
            Self::ConjugateGradient(o)
                if o.preconditioner == Preconditioner::Group && counts.iterations > 0.0 =>
            {
                way(7, &counts.iterated())
            }
            _ => None,
        }
    }

    /// Predicted time of a factorisation and two solves \[ns of the machine that the coefficients are from].
    #[must_use]
    pub fn predicted(&self, counts: &Counts) -> Option<f64> {
        let (name, terms) = self.way(counts)?;
        let way = WAYS.iter().find(|way| way.name == name)?;
        Some(terms.iter().zip(way.times).map(|(x, time)| x * time).sum())
    }

    /// The solvers that [`Backend::Auto`] chooses from, in order of preference: those compiled in that factorise and take
    /// the systems asked for, `indefinite` ones such as the KKT matrix or not. Where the dense one is the only one, the first
    /// that iterates takes its place.
    #[must_use]
    pub fn candidates(indefinite: bool) -> Vec<Self> {
        let compiled = Self::built_in().into_iter().filter(Self::is_compiled);
        Self::fitting(compiled, indefinite)
    }

    /// Candidates among `all`.
    pub(crate) fn fitting(all: impl Iterator<Item = Self>, indefinite: bool) -> Vec<Self> {
        let fits = |b: &Self| !indefinite || b.accepts_indefinite();
        let (iterative, mut direct): (Vec<Self>, Vec<Self>) =
            all.filter(fits).partition(Self::is_iterative);
        for backend in &mut direct {
            if let Self::Umfpack(options) = backend {
                // Whoever chooses refines.
                options.refinement_steps = 0;
            }
        }
        match (&direct[..], iterative.into_iter().next()) {
            ([] | [Self::Dense(_)], Some(first)) => vec![first],
            _ => direct,
        }
    }
}
