//! Choice of the solver that [`Backend::Auto`] stands for: among those compiled in, the one with
//! the least predicted time for the scene's linear system, each in the order of the constraints
//! that it would take.
//!
//! Joints, masses and whether there are shapes decide, not the state: a run that is saved and restored has the same solver.

use crate::elimination::{self, EliminationOrder, MOST};
use crate::plan::Plan;
use crate::stepper::{Stepper, at_start};
use crate::{Form, StepError, StepOptions};
use taut_model::{Linearized, Scene};
use taut_solver::clock::Moment;
use taut_solver::{Backend, CgOptions, Chosen, Counts, SolveError};

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
    let candidates = Backend::candidates(options.form == Form::Kkt);
    let (order, chosen) = among(options, scene, rows, candidates)?;
    Ok((order, Some(chosen)))
}

/// The best of the candidates, with its order.
fn among(
    options: &StepOptions,
    scene: &Scene,
    rows: &Linearized,
    candidates: Vec<Backend>,
) -> Result<(EliminationOrder, Chosen), StepError> {
    let found = match options.form {
        Form::Schur => of_schur(options, scene, rows, candidates),
        Form::Kkt => of_kkt(options, scene, rows, candidates),
    };
    found
        .map_err(at_start)?
        .ok_or_else(|| options.not_accepted())
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
    // So far it is what one that is named does.
    let begun = Moment::now();
    let (mut taken, mut counted) = (Vec::new(), Vec::new());
    for backend in candidates {
        let (at, border) = elimination::taken_by(&backend, &orders, &pattern)?;
        // `banded` eliminates a chain with leaves and a border at the cost of the cheapest order, whichever it is given.
        let counted_in = if border.is_some() { 0 } else { at };
        let factor = orders[counted_in].cost.unwrap_or(MOST);
        taken.push(at);
        counted.push((backend, Counts::new(&pattern, factor, border)));
    }
    // Chains with a border have few operations: nothing that iterates is as fast.
    let is_chain = counted.iter().any(|(_, c)| c.border.is_some());
    if orders.len() > 1
        && !is_chain
        && let Some((order, backend, counts)) = of_groups(options, scene, rows)?
    {
        orders.push(order);
        taken.push(orders.len() - 1);
        counted.push((backend, counts));
    }
    let chosen = Chosen::among(&counted);
    Ok(chosen.and_then(|chosen| {
        let mut all = counted.iter().zip(taken);
        let (_, at) = all.find(|((backend, _), _)| *backend == chosen.backend)?;
        let analysis = begun.elapsed();
        Some((orders.swap_remove(at), Chosen { analysis, ..chosen }))
    }))
}

/// Conjugate gradient with the groups as its preconditioner, of a system that fills; none where contacts may want many
/// solves. Its iterations are those of nets that swing, to a residual of 10⁻¹²: 6 to 231 of them from 84 to 1683 rows and from
/// a ratio R of the bodies' masses of 1 to 10⁵, n^¼ max(1.9, 0.6 R^0.37) to 15 % up to R = 10³ and too many beyond. The
/// multipliers are then wrong by 10⁻¹⁴ to 10⁻¹², those of direct solvers by 10⁻¹⁵.
fn of_groups(
    options: &StepOptions,
    scene: &Scene,
    rows: &Linearized,
) -> Result<Option<(EliminationOrder, Backend, Counts)>, SolveError> {
    let backend = Backend::ConjugateGradient(CgOptions::default());
    if !backend.is_compiled() || !scene.colliders.is_empty() {
        return Ok(None);
    }
    let pattern = elimination::factorized(scene, rows, &backend)?;
    let Some(order) = elimination::orders(options.elimination, scene, &pattern)?
        .into_iter()
        .next()
    else {
        return Ok(None);
    };
    let masses = || scene.dynamic_bodies().map(|body| scene.bodies.mass[body]);
    let ends = masses().fold((f64::INFINITY, 0.0), |(a, b), m| (m.min(a), m.max(b)));
    let ratio: f64 = ends.1 / ends.0;
    let counts = Counts {
        iterations: (pattern.dim() as f64).powf(0.25) * (0.6 * ratio.powf(0.37)).max(1.9),
        ..Counts::new(&pattern, order.cost.unwrap_or(MOST), None)
    };
    Ok(Some((order, backend, counts)))
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
    let begun = Moment::now();
    let counts = Counts::in_order(&plan.pattern)?;
    let counted: Vec<_> = candidates.into_iter().map(|b| (b, counts)).collect();
    let Some(chosen) = Chosen::among(&counted) else {
        return Ok(None);
    };
    let analysis = begun.elapsed();
    Ok(Some((
        order(&chosen.backend)?,
        Chosen { analysis, ..chosen },
    )))
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

    /// Refinements of a solve: one chosen that iterates to its own tolerance has none.
    pub(crate) fn refinements(&self) -> usize {
        match &self.chosen {
            Some(chosen) if chosen.backend.is_iterative() => 0,
            _ => self.options.refinements,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_model::named;
    use taut_solver::{CgOptions, DenseOptions};

    fn auto(form: Form) -> StepOptions {
        StepOptions {
            form,
            backend: Backend::Auto,
            refinements: 1,
            ..StepOptions::default()
        }
    }

    fn stepped(scene: &Scene, options: StepOptions) -> Stepper {
        let mut stepper = Stepper::new(scene.clone(), options).unwrap();
        for _ in 0..10 {
            stepper.step().unwrap();
        }
        stepper
    }

    /// In the same order with the same bits, and so after it was saved and restored, or changed.
    #[test]
    fn it_steps_as_the_solver_that_was_chosen() {
        for form in [Form::Schur, Form::Kkt] {
            for name in ["hoist", "ring", "gantry", "net"] {
                let mut scene = named(name).unwrap();
                // The equilibrium would be found with the one and with the other.
                scene.start_in_equilibrium = false;
                let mut own = stepped(&scene, auto(form));
                assert_eq!(own.options().backend, Backend::Auto);
                let chosen = own.chosen().unwrap().backend.clone();
                assert_eq!(*own.backend(), chosen);
                let options = StepOptions {
                    refinements: usize::from(!chosen.is_iterative()),
                    backend: chosen.clone(),
                    ..auto(form)
                };
                let other = stepped(&scene, options);
                assert!(other.chosen().is_none());
                assert_eq!(own.elimination(), other.elimination(), "{name}");
                assert_eq!(own.multipliers(), other.multipliers(), "{name}");
                let mut restored = Stepper::restore(own.save().unwrap()).unwrap();
                assert_eq!(*restored.backend(), chosen);
                restored.step().unwrap();
                own.step().unwrap();
                assert_eq!(own.multipliers(), restored.multipliers(), "{name}");
                assert_eq!(own.scene(), restored.scene(), "{name}");
            }
        }
    }

    #[test]
    fn a_changed_scene_has_a_solver_of_its_own() {
        let mut stepper = stepped(&named("hoist").unwrap(), auto(Form::Schur));
        let before = stepper.chosen().unwrap().counts;
        let joint = stepper.constraint("joint-12").unwrap();
        let changed = stepper.change(|edit| edit.remove_constraint(joint));
        changed.unwrap();
        assert!(stepper.chosen().unwrap().counts.rows < before.rows);
        stepper.step().unwrap();
    }

    #[test]
    fn cables_are_for_the_solver_of_chains() {
        if !Backend::Banded.is_compiled() {
            return;
        }
        for name in ["hoist", "gantry", "ring", "tackle", "pile"] {
            let stepper = Stepper::new(named(name).unwrap(), auto(Form::Schur)).unwrap();
            let chosen = stepper.chosen().unwrap();
            assert_eq!(chosen.backend, Backend::Banded, "{name}: {chosen}");
        }
    }

    /// Large nets are iterated under loads like those of the measurements, not under heavier loads
    /// or where they may touch something.
    #[test]
    fn nets_are_iterated_where_that_is_predicted_to_be_faster() {
        let net = |mass_ratio| {
            let params = taut_model::NetworkParams {
                rows: 20,
                columns: 20,
                mass_ratio,
                equilibrium: false,
                ..taut_model::NetworkParams::new(taut_model::Network::Net)
            };
            params.build().unwrap()
        };
        let iterates = |scene: Scene| {
            let mut stepper = Stepper::new(scene, auto(Form::Schur)).unwrap();
            stepper.step().unwrap();
            let iterates = stepper.backend().is_iterative();
            assert_eq!(stepper.refinements(), usize::from(!iterates));
            iterates
        };
        let cg = Backend::ConjugateGradient(CgOptions::default());
        assert_eq!(iterates(net(100.0)), cg.is_compiled());
        let mut touching = net(100.0);
        let ground = taut_model::Shape::HalfSpace;
        touching.add_collider(taut_model::Collider::new("ground", None, ground));
        if Backend::candidates(false).len() > 1 {
            assert!(!iterates(net(1e5)) && !iterates(touching));
        }
    }

    #[test]
    fn one_alone_is_taken_and_none_is_an_error() {
        let scene = named("hoist").unwrap();
        let rows = Linearized::new(&scene);
        let cg = Backend::ConjugateGradient(CgOptions::default());
        let dense = Backend::Dense(DenseOptions::default());
        for (form, alone) in [
            (Form::Schur, &cg),
            (Form::Schur, &dense),
            (Form::Kkt, &dense),
        ] {
            let options = auto(form);
            let (_, chosen) = among(&options, &scene, &rows, vec![alone.clone()]).unwrap();
            assert_eq!((&chosen.backend, chosen.next), (alone, None));
        }
        for form in [Form::Schur, Form::Kkt] {
            let none = among(&auto(form), &scene, &rows, Vec::new());
            assert!(matches!(none, Err(StepError::FormNotAccepted { .. })));
        }
    }
}
