//! Which solver [`Backend::Auto`] stands for: of those compiled in the one that is predicted to take the least time for
//! the scene's linear system, each in the order of the constraints that it would take.
//!
//! The joints alone decide, not the state or what touches: a run that is saved and restored has the same solver.

use crate::elimination::{self, EliminationOrder, MOST};
use crate::plan::Plan;
use crate::stepper::{Stepper, at_start};
use crate::{Form, StepError, StepOptions};
use std::time::Instant;
use taut_model::{Linearized, Scene};
use taut_solver::{Backend, Chosen, Counts, SolveError};

/// The order of the constraints, and the solver where it is to be chosen.
pub(crate) fn order_and_solver(
    options: &StepOptions,
    scene: &Scene,
    rows: &Linearized,
) -> Result<(EliminationOrder, Option<Chosen>), StepError> {
    if options.backend != Backend::Auto {
        let order = elimination::order_of(options.elimination, scene, rows, &options.backend);
        return Ok((order.map_err(at_start)?, None));
    }
    let begun = Instant::now();
    let candidates = Backend::candidates(options.form == Form::Kkt);
    let chosen = match options.form {
        Form::Kkt => of_kkt(options, scene, rows, candidates),
        Form::Schur => of_schur(options, scene, rows, candidates),
    };
    let (order, chosen) = chosen
        .map_err(at_start)?
        .ok_or_else(|| options.not_accepted())?;
    let analysis = begun.elapsed();
    Ok((order, Some(Chosen { analysis, ..chosen })))
}

type Found = Result<Option<(EliminationOrder, Chosen)>, SolveError>;

/// Each candidate with the order that it would have. All that factorise, factorise all of S.
fn of_schur(
    options: &StepOptions,
    scene: &Scene,
    rows: &Linearized,
    candidates: Vec<Backend>,
) -> Found {
    let Some(first) = candidates.first() else {
        return Ok(None);
    };
    let pattern = elimination::factorized(scene, rows, first)?;
    let mut orders = elimination::orders(options.elimination, scene, &pattern)?;
    let (mut taken, mut counted) = (Vec::new(), Vec::new());
    for backend in candidates {
        let at = elimination::taken_by(&backend, &orders, &pattern)?;
        let border = backend.border_rows(&pattern, &orders[at].constraints)?;
        let factor = orders[at].cost.unwrap_or(MOST);
        taken.push(at);
        counted.push((backend, Counts::new(&pattern, factor, border)));
    }
    let chosen = Chosen::among(&counted);
    Ok(chosen.and_then(|chosen| {
        let mut all = counted.iter().zip(taken);
        let (_, at) = all.find(|((backend, _), _)| *backend == chosen.backend)?;
        Some((orders.swap_remove(at), chosen))
    }))
}

/// All candidates in the order of the first, for the KKT matrix has blocks that no order of the constraints counts.
fn of_kkt(
    options: &StepOptions,
    scene: &Scene,
    rows: &Linearized,
    candidates: Vec<Backend>,
) -> Found {
    let Some(first) = candidates.first() else {
        return Ok(None);
    };
    let order =
        |backend: &Backend| elimination::order_of(options.elimination, scene, rows, backend);
    let of_first = order(first)?;
    let plan = Plan::new(options.form, scene, rows, &of_first.constraints)?;
    let counts = Counts::in_order(&plan.pattern)?;
    let counted: Vec<_> = candidates.into_iter().map(|b| (b, counts)).collect();
    let Some(chosen) = Chosen::among(&counted) else {
        return Ok(None);
    };
    Ok(Some((order(&chosen.backend)?, chosen)))
}

impl Stepper {
    /// The solver that was chosen, and why, where [`StepOptions::backend`] is [`Backend::Auto`].
    #[must_use]
    pub fn chosen(&self) -> Option<&Chosen> {
        self.chosen.as_ref()
    }

    /// The backend at work: that of the options, or the one chosen.
    #[must_use]
    pub fn backend(&self) -> &Backend {
        let chosen = self.chosen.as_ref();
        chosen.map_or(&self.options.backend, |chosen| &chosen.backend)
    }
}
