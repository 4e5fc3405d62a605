//! Shared by all direct backends: the phases, the judge of what their factor makes, and the rule of its condition.

use super::check_solution;
use crate::claim::Judge;
use crate::condition::{Factors, LEAST, Probe, Rule};
use crate::error::{columns, expect_columns};
use crate::kernels::Scalar;
use crate::matrix::all_below;
use crate::{
    AnalyzeReport, BlockPattern, FactorReport, LinearSolver, Phases, SolveError, SolveReport,
    Status, SymBlockMatrix,
};
use std::sync::Arc;

/// A factorisation: the phases of a [`LinearSolver`] without the checks of their input.
pub(crate) trait Direct: Send {
    /// The backend's name.
    const NAME: &'static str;

    /// State besides the factor.
    fn common(&mut self) -> &mut Common;

    /// Prepares for a pattern.
    fn prepare(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError>;

    /// Makes the factor of `a`, whose values may not be finite.
    fn eliminate(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError>;

    /// Returns true if theory bounds the backward error of a solution (`claim`): symmetric
    /// elimination with positive pivots only. False for LU.
    fn is_stable(&self) -> bool;

    /// Returns true if weak pivots of a stable factor leave the matrix in doubt: the rule then
    /// decides what a solution may claim.
    fn is_doubtful(&self) -> bool {
        false
    }

    /// The smallest by the largest pivot of the last factor, where that is at hand: a hint at its condition.
    fn pivot_ratio(&self) -> Option<f64> {
        None
    }

    /// Returns true if the elimination bounds its own backward error and no weak pivot is in doubt: what is left is the
    /// condition.
    fn is_sure(&self) -> bool {
        self.is_stable() && !self.is_doubtful()
    }

    /// Unit roundoff of the arithmetic that makes the factor.
    fn roundoff(&self) -> f64 {
        f64::ROUNDOFF
    }

    /// x from b by the factor.
    fn substitute(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError>;

    /// Solves for columns of `a.dim()` numbers.
    fn substitute_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        let mut columns = columns(a.dim(), b, x);
        columns.try_for_each(|(b, x)| self.substitute(a, b, x))
    }

    /// Checks `x`, the result of [`substitute`](Self::substitute) for `b`. Judges and corrects it
    /// if the factor is not stable or is doubtful, or its matrix near a singular one.
    fn accept(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        check_solution(a, x)?;
        if self.common().is_good() && self.is_sure() && has_digits(b) {
            return Ok(SolveReport::DIRECT);
        }
        let mut common = std::mem::take(self.common());
        let accepted = self.accept_by(a, b, x, &mut common);
        *self.common() = common;
        let Some(status) = accepted? else {
            return Ok(SolveReport::DIRECT);
        };
        check_solution(a, x)?;
        Ok(SolveReport {
            status,
            ..SolveReport::DIRECT
        })
    }

    /// The status of `x` by the last factor; `None` of one that theory bounds.
    fn accept_by(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
        common: &mut Common,
    ) -> Result<Option<Status>, SolveError> {
        self.examine(a, common)?;
        if common.is_good() && self.is_sure() && has_digits(b) {
            return Ok(None);
        }
        self.judge(a, b, x, common).map(Some)
    }

    /// Finds what the last factor is worth, once: by a probe, and by the rule where that does not suffice. Allocates nothing.
    ///
    /// # Errors
    /// Those of [`check`](Self::check).
    fn examine(&mut self, a: &SymBlockMatrix, common: &mut Common) -> Result<(), SolveError> {
        if common.examined {
            return Ok(());
        }
        let ratio = self.pivot_ratio();
        // The rule examines the first factors of an elimination without a guarantee, whatever the probe.
        if self.is_sure() || common.is_like(ratio) {
            let probe = self.probe(a, common)?;
            let roundoff = self.roundoff();
            if !common.suspect && probe.is_sound(common.growth, roundoff) {
                common.factors = Factors::Good;
                common.examined = true;
                return Ok(());
            }
        }
        self.check(a, common)?;
        common.growth = match common.factors {
            Factors::Good => Some(self.probe(a, common)?.growth),
            _ => None,
        };
        Ok(())
    }

    /// One solve with the last factor, which tells how near to singular its matrix is.
    fn probe(&mut self, a: &SymBlockMatrix, common: &mut Common) -> Result<Probe, SolveError> {
        let is_sure = self.is_sure();
        let Common { rule, buffers, .. } = common;
        let solve = |x: &mut [f64]| {
            buffers[0].copy_from_slice(x);
            self.substitute(a, &buffers[0], x)
        };
        if is_sure {
            rule.probe_definite(a, solve)
        } else {
            rule.probe(&a.entries(), solve)
        }
    }

    /// Looks at the last factor by the rule, which tells what it is worth. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::Singular`], and those of solves.
    fn check(&mut self, a: &SymBlockMatrix, common: &mut Common) -> Result<(), SolveError> {
        let roundoff = self.roundoff();
        // A is symmetric, so one solve serves A and Aᵀ.
        let solve = |x: &mut [f64], _| {
            common.buffers[0].copy_from_slice(x);
            self.substitute(a, &common.buffers[0], x)
        };
        let checked = common.rule.check(&a.entries(), roundoff, solve);
        common.factors = match checked {
            // Positive pivots that were tested make a solution of a matrix near by, of which nothing more can be claimed.
            Err(SolveError::Singular { .. }) if self.is_stable() => Factors::Useless,
            checked => checked.map_err(|e| of_block(e, a))?.factors,
        };
        common.ratio = self.pivot_ratio();
        common.growth = None;
        common.is_checked = true;
        common.examined = true;
        Ok(())
    }

    /// Checks the factor during a factorisation that met a pivot at the level of rounding.
    /// `singular` maps the error of a singular matrix.
    ///
    /// # Errors
    /// The error from `singular`, and those of solves.
    fn check_doubt(
        &mut self,
        a: &SymBlockMatrix,
        singular: impl FnOnce(SolveError) -> SolveError,
    ) -> Result<(), SolveError> {
        let mut common = std::mem::take(self.common());
        let checked = self.check(a, &mut common);
        *self.common() = common;
        checked.map_err(|e| match e {
            SolveError::Singular { .. } => singular(e),
            e => e,
        })
    }

    /// Corrects `x`, which the examined factor computed from `b`, and returns its status.
    fn judge(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
        common: &mut Common,
    ) -> Result<Status, SolveError> {
        let judge = match common.judge {
            Some(judge) => judge,
            None => {
                let [r, _] = &mut common.buffers;
                let judge = match common.factors {
                    Factors::Good | Factors::Useless => Judge::of(a, r),
                    Factors::Poor | Factors::Graded => common.rule.judge(&a.entries()),
                };
                *common.judge.insert(judge)
            }
        };
        let [r, d] = &mut common.buffers;
        let residual = |x: &[f64], r: &mut [f64]| a.subtract_product(b, x, r);
        let solve = |b: &[f64], x: &mut [f64], _| self.substitute(a, b, x);
        let judge = (judge, common.factors);
        let rule = &mut common.rule;
        rule.settle(judge, &a.entries(), x, [r, d], residual, solve)
    }
}

/// True if theory bounds the rounding of a solution for `b`, whose products are normal numbers.
fn has_digits(b: &[f64]) -> bool {
    !all_below(b, LEAST) || b.iter().all(|v| *v == 0.0)
}

/// State of a direct backend besides its factor.
#[derive(Debug, Default)]
pub(crate) struct Common {
    phases: Phases,
    /// Judge of the matrix factorised last; made when first needed.
    judge: Option<Judge>,
    /// A residual and its correction.
    buffers: [Vec<f64>; 2],
    rule: Rule,
    /// Quality of the factor, valid once it is examined.
    factors: Factors,
    /// True if the quality of the last factor is known.
    examined: bool,
    /// True if corrections by the last factor were larger than those by a good one: the probe is not enough.
    suspect: bool,
    /// True if the rule examined factors of this pattern.
    is_checked: bool,
    /// Pivot ratio of the factor that the rule examined last.
    ratio: Option<f64>,
    /// Growth in the probe of that factor, where the rule found it good.
    growth: Option<f64>,
}

impl Common {
    /// Returns true if the last factor was examined and found good.
    fn is_good(&self) -> bool {
        self.examined && self.factors == Factors::Good
    }

    /// Returns true if the rule found factors good whose pivot ratio, where there is one, was within a factor of 2 of
    /// this one, as happens from step to step.
    fn is_like(&self, ratio: Option<f64>) -> bool {
        let alike = match (self.ratio, ratio) {
            (Some(before), Some(ratio)) => (0.5..=2.0).contains(&(ratio / before)),
            (before, ratio) => before.is_none() && ratio.is_none(),
        };
        self.is_checked && self.growth.is_some() && alike
    }
}

/// The error with the block of its scalar row.
fn of_block(e: SolveError, a: &SymBlockMatrix) -> SolveError {
    match e {
        SolveError::Singular { block: row } => SolveError::Singular {
            block: a.pattern().block_of_row(row),
        },
        e => e,
    }
}

impl<D: Direct> LinearSolver for D {
    fn name(&self) -> &'static str {
        D::NAME
    }

    fn takes_guess(&self) -> bool {
        false
    }

    fn analyze(&mut self, pattern: &Arc<BlockPattern>) -> Result<AnalyzeReport, SolveError> {
        let report = self.prepare(pattern)?;
        let common = self.common();
        common.buffers = [(); 2].map(|()| vec![0.0; pattern.dim()]);
        common.rule = Rule::new(pattern.dim());
        (common.is_checked, common.growth, common.ratio) = (false, None, None);
        common.phases.analyzed(pattern);
        Ok(report)
    }

    fn factorize(&mut self, a: &SymBlockMatrix) -> Result<FactorReport, SolveError> {
        let common = self.common();
        common.phases.begin_unchecked(a)?;
        common.judge = None;
        (common.examined, common.suspect) = (false, false);
        let report = self.eliminate(a)?;
        self.common().phases.factorized();
        Ok(report)
    }

    fn solve(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.common().phases.begin_solve(a, b, x)?;
        self.substitute(a, b, x)?;
        self.accept(a, b, x)
    }

    fn solve_unjudged(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        self.common().phases.begin_solve(a, b, x)?;
        self.substitute(a, b, x)?;
        check_solution(a, x)?;
        let status = if self.is_sure() {
            Status::Direct
        } else {
            Status::Unjudged
        };
        Ok(SolveReport {
            status,
            ..SolveReport::DIRECT
        })
    }

    fn claims(&mut self, a: &SymBlockMatrix, evidence: bool) -> Result<Status, SolveError> {
        if evidence && !self.common().examined && self.is_sure() {
            return Ok(Status::Direct);
        }
        let mut common = std::mem::take(self.common());
        if self.roundoff() < f64::ROUNDOFF {
            // The correction solved for a residual in doubles, whatever the digits of the factor. What the probe leaves is the
            // rounding of its solution.
            let probe = self.probe(a, &mut common);
            let is_sound = probe.map(|probe| {
                let probe = Probe { left: 0.0, ..probe };
                probe.is_sound(Some(probe.growth), f64::ROUNDOFF)
            });
            if !matches!(is_sound, Ok(true)) {
                *self.common() = common;
                return is_sound.map(|_| Status::Stalled);
            }
        }
        if !evidence && !common.suspect {
            // A probe was not enough.
            (common.suspect, common.examined, common.judge) = (true, false, None);
        }
        let examined = self.examine(a, &mut common);
        let factors = common.factors;
        *self.common() = common;
        examined?;
        Ok(match factors {
            Factors::Good => Status::Direct,
            Factors::Poor | Factors::Graded => Status::Unjudged,
            Factors::Useless => Status::Stalled,
        })
    }

    fn error_bound(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &[f64],
        r: &[f64],
    ) -> Result<f64, SolveError> {
        if self.common().factors != Factors::Graded {
            return Ok(0.0);
        }
        let mut common = std::mem::take(self.common());
        let [left, zero] = &mut common.buffers;
        let residual = |x: &[f64], r: &mut [f64]| a.subtract_product(b, x, r);
        let rule = &mut common.rule;
        if rule.solves_exactly(&a.entries(), x, [left, zero], residual) {
            *self.common() = common;
            return Ok(0.0);
        }
        let solve = |x: &mut [f64], _| {
            common.buffers[0].copy_from_slice(x);
            self.substitute(a, &common.buffers[0], x)
        };
        let bound = common.rule.error(&a.entries(), x, r, solve);
        *self.common() = common;
        bound
    }

    fn solve_many(
        &mut self,
        a: &SymBlockMatrix,
        b: &[f64],
        x: &mut [f64],
    ) -> Result<SolveReport, SolveError> {
        expect_columns(a.dim(), b, x)?;
        for (b, x) in columns(a.dim(), b, x) {
            self.common().phases.begin_solve(a, b, x)?;
        }
        self.substitute_many(a, b, x)?;
        let mut report = SolveReport::DIRECT;
        for (b, x) in columns(a.dim(), b, x) {
            report = report.and(self.accept(a, b, x)?);
        }
        Ok(report)
    }
}
