//! The solver that [`Backend::Auto`] stands for in a step: the first that is compiled in, or conjugate gradient where loops
//! fill the factor. Joints, masses and shapes decide, not the state: a restored run has the same solver.
//!
//! `banded` is the first. On chains with a narrow border a whole step takes 1.1 to 1.5 times as long with the next best.
//! Elsewhere the factor of S over those of its groups decides: nets of 5² to 20² nodes, 2.8 to 7.4 times, take 1.2 to 2.4
//! times as long with `banded` as iterated; ladders, 1.3 to 1.4 times, take 1.2 to 1.6 times as long iterated.

use crate::elimination::{self, EliminationOrder, MOST};
use crate::step::at_start;
use crate::{Form, StepError, StepOptions};
use std::fmt;
use taut_model::{Linearized, Scene};
use taut_solver::{Backend, CgOptions};

/// Entries of the whole factor over those of the groups' from which on to iterate is faster.
const FILL: f64 = 2.5;

/// Heaviest body over the lightest up to which is iterated: from 10³ on steps of nets stay above the tolerance.
const RATIO: f64 = 300.0;

/// The solver that was chosen, with what decided; its text is the reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// The solver.
    pub backend: Backend,
    /// Scalar rows of S.
    pub rows: usize,
    /// Those of the border, where S is a chain with one ([`Backend::border_rows`]).
    pub border: Option<usize>,
    /// Entries of the factor of S over those of its groups, where it might be iterated.
    pub fill: Option<f64>,
}

impl fmt::Display for Chosen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} rows", self.rows)?;
        match (self.border, self.fill) {
            (Some(0), _) => f.write_str(" that are a chain"),
            (Some(rows), _) => write!(f, " that are a chain with a border of {rows}"),
            (_, Some(fill)) => write!(f, ", a factor {fill:.1} times as large as its groups'"),
            _ => f.write_str(", for the first solver that takes them"),
        }
    }
}

/// The order of the constraints, and the solver where it is to be chosen.
pub(crate) fn order_and_solver(
    options: &StepOptions,
    scene: &Scene,
    rows: &Linearized,
) -> Result<(EliminationOrder, Option<Chosen>), StepError> {
    let order = |backend: &Backend| {
        elimination::order_of(options.elimination, scene, rows, backend).map_err(at_start)
    };
    if options.backend != Backend::Auto {
        return Ok((order(&options.backend)?, None));
    }
    let schur = options.form == Form::Schur;
    let first = Backend::first_for(!schur).ok_or_else(|| options.not_accepted())?;
    let whole = order(&first)?;
    let pattern = elimination::factorized(scene, rows, &first).map_err(at_start)?;
    let border = first.border_rows(&pattern, &whole.constraints);
    let mut chosen = Chosen {
        rows: rows.rows(),
        border: border.map_err(at_start)?,
        fill: None,
        backend: first,
    };
    let groups = Backend::ConjugateGradient(CgOptions::default());
    if schur && chosen.border.is_none() && groups.is_compiled() && may_iterate(scene) {
        let parts = order(&groups)?;
        let [all, own] = [&whole, &parts].map(|o| o.cost.unwrap_or(MOST).entries as f64);
        let fill = all / own.max(1.0);
        chosen.fill = Some(fill);
        if fill >= FILL {
            chosen.backend = groups;
            return Ok((parts, Some(chosen)));
        }
    }
    Ok((whole, Some(chosen)))
}

/// Contacts may want many solves, and heavy loads many iterations.
fn may_iterate(scene: &Scene) -> bool {
    let masses = || scene.dynamic_bodies().map(|body| scene.bodies.mass[body]);
    let lightest = masses().fold(f64::INFINITY, f64::min);
    scene.colliders.is_empty() && masses().all(|mass| mass <= RATIO * lightest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    fn stepped(scene: &Scene, form: Form, backend: Backend) -> Stepper {
        let options = StepOptions {
            form,
            refinements: usize::from(!backend.is_iterative()),
            backend,
            ..StepOptions::default()
        };
        let mut stepper = Stepper::new(scene.clone(), options).unwrap();
        stepper.step().unwrap();
        stepper
    }

    /// In the same order with the same bits, and so after it was saved and restored.
    #[test]
    fn it_steps_as_the_solver_that_was_chosen() {
        for (form, name) in [
            (Form::Schur, "ring"),
            (Form::Schur, "net"),
            (Form::Kkt, "gantry"),
        ] {
            let mut scene = named(name).unwrap();
            // The equilibrium would be found with the one and with the other.
            scene.start_in_equilibrium = false;
            let own = stepped(&scene, form, Backend::Auto);
            let other = stepped(&scene, form, own.backend().clone());
            assert_eq!(own.elimination(), other.elimination(), "{name}");
            assert_eq!(own.multipliers(), other.multipliers(), "{name}");
            let restored = Stepper::restore(own.save().unwrap()).unwrap();
            assert_eq!((restored.chosen(), other.chosen()), (own.chosen(), None));
        }
    }

    #[test]
    fn what_loops_fill_is_iterated_under_light_loads_without_shapes() {
        let first = Backend::first_for(false).unwrap();
        let net = |mass_ratio| {
            let mut params = NetworkParams::new(Network::Net);
            (params.rows, params.columns) = (8, 8);
            (params.mass_ratio, params.equilibrium) = (mass_ratio, false);
            params.build().unwrap()
        };
        let mut touching = net(100.0);
        touching.add_collider(Collider::new("ground", None, Shape::HalfSpace));
        let others = ["hoist", "gantry", "ring", "ladder"].map(|name| named(name).unwrap());
        for scene in others.into_iter().chain([touching, net(1e5)]) {
            let stepper = stepped(&scene, Form::Schur, Backend::Auto);
            assert_eq!(*stepper.backend(), first, "{}", stepper.chosen().unwrap());
        }
        let groups = Backend::ConjugateGradient(CgOptions::default());
        if groups.is_compiled() {
            let stepper = stepped(&net(100.0), Form::Schur, Backend::Auto);
            let found = (stepper.backend(), stepper.step.refinements());
            assert_eq!(found, (&groups, 0));
        }
    }
}
