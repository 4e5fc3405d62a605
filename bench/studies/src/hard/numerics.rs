//! Hard cases for the algebra and for the program: H40 to H58, and what the solvers claim in all hard cases.

mod adverse;
mod agreement;
pub mod angles;
pub mod claims;
pub mod ill_conditioned;
pub mod infeasible;
mod ladders;
pub mod long_run;
mod lost;
mod mass_ratio;
mod mechanisms;
pub mod redundant;
pub mod rigid_limit;

use super::{Coded, no_scenes};
use indicatif::ProgressBar;
use taut_model::Scene;
use taut_output::check::{ExperimentError, Outcome};
use taut_solver::{
    Backend, DenseOptions, Precision, SolveError, SymBlockMatrix, reference_solution,
};

pub const CASES: &[Coded] = &[
    Coded {
        name: "H40",
        title: "mass ratios from 1 to 10¹⁰: conditions, sweeps, errors of every solver",
        run: mass_ratio::outcome,
        scenes: mass_ratio::scenes,
    },
    Coded {
        name: "H42",
        title: "dependent constraints: doubled joints, Bricard's six-bar, rows of four-bars",
        run: redundant_constraints,
        scenes: redundant_scenes,
    },
    Coded {
        name: "H43",
        title: "singular angles: straight, folded, twisted by half a turn and by many",
        run: angles::outcome,
        scenes: angles::scenes,
    },
    Coded {
        name: "H46",
        title: "ill-conditioned matrices: Hilbert, bending, graded, growth",
        run: ill_conditioned::outcome,
        scenes: no_scenes,
    },
    Coded {
        name: "H47",
        title: "branches and loops: the same answer from every solver",
        run: agreement::outcome,
        scenes: agreement::scenes,
    },
    Coded {
        name: "H49",
        title: "ten million steps of a swing",
        run: long_run::outcome,
        scenes: || Ok(vec![long_run::scene()?]),
    },
    Coded {
        name: "H50",
        title: "a cable held at ends farther apart than it is long",
        run: infeasible::outcome,
        scenes: infeasible::scenes,
    },
    Coded {
        name: "H51",
        title: "joints ever stiffer, and rigid",
        run: rigid_limit::outcome,
        scenes: rigid_limit::scenes,
    },
    Coded {
        name: "H54",
        title: "ladders of time steps and iterations",
        run: ladders::outcome,
        scenes: ladders::scenes,
    },
    Coded {
        name: "H57",
        title: "ten thousand adverse systems: no false claim of any backend",
        run: adverse::outcome,
        scenes: no_scenes,
    },
    Coded {
        name: "H58",
        title: "lost runs are called so, and no others",
        run: lost::outcome,
        scenes: || Ok(vec![lost::chain()?, lost::winched()]),
    },
    Coded {
        name: "claims",
        title: "claimed against verified, every solver in the scenes of all hard cases",
        run: claims::outcome,
        scenes: no_scenes,
    },
];

fn redundant_constraints(quick: bool, progress: &ProgressBar) -> Result<Outcome, ExperimentError> {
    let mut checks = redundant::checks()?;
    checks.extend(mechanisms::checks(quick, progress)?);
    Ok(checks.into())
}

/// The solution of A x = b in 32 digits, rounded: by the reference of the solver crate or, where its order of
/// elimination costs it too many of them, by dense LU with exchanges of rows.
pub(super) fn extended_solution(a: &SymBlockMatrix, b: &[f64]) -> Result<Vec<f64>, SolveError> {
    if let Ok(x) = reference_solution(a, b) {
        return Ok(x);
    }
    let mut solver = Backend::Dense(DenseOptions {
        precision: Precision::Extended,
    })
    .create()?;
    solver.analyze(a.pattern())?;
    solver.factorize(a)?;
    let mut x = vec![0.0; b.len()];
    solver.solve(a, b, &mut x)?;
    Ok(x)
}

/// Doubled joints and mechanisms, with compliance and without.
fn redundant_scenes() -> Result<Vec<Scene>, ExperimentError> {
    let mut scenes = Vec::new();
    for compliance in [1e-6, 0.0] {
        let copies = redundant::scene(2, compliance)?;
        let bricard = mechanisms::bricard(compliance)?;
        for mut scene in [copies, bricard] {
            scene.name = format!("{}, ε = {compliance:.0e}", scene.name);
            scenes.push(scene);
        }
    }
    Ok(scenes)
}
