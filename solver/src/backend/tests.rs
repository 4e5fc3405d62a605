use super::*;
use crate::agreement::{Claims, check};

#[test]
fn text_form_round_trips() {
    let texts = "banded gauss-seidel:groups:trial:iterations=7:tolerance=1e-3 \
        cg:none:iterations=3:tolerance=0e0 cg:jacobi minres:iterations=3:tolerance=1e-6 \
        umfpack:refinement=0 faer:lblt faer:lu nalgebra-sparse dense:extended dense:double auto";
    for text in texts.split(' ') {
        let backend: Backend = text.parse().unwrap();
        assert_eq!(backend.to_string().parse(), Ok(backend), "{text}");
    }
}

#[test]
fn what_iterates_has_limits_that_can_be_set() {
    for backend in Backend::built_in() {
        let set = backend.with_iterations(7).with_tolerance(1e-3);
        let limits = (set.iterations(), set.tolerance());
        let expected = backend.is_iterative().then_some((7, 1e-3));
        assert_eq!(limits, expected.unzip(), "{backend}");
    }
}

#[test]
fn the_entry_of_each_backend_is_its_own() {
    let named = |text: &str| text.strip_suffix("/kkt").unwrap_or(text).parse::<Backend>();
    for backend in Backend::built_in() {
        let entry = backend.entry();
        assert_eq!(entry.name.parse(), Ok(backend.clone()));
        for row in entry.rows {
            assert_eq!(named(row).unwrap().name(), entry.name, "{row}");
        }
    }
}

#[test]
fn iterations_take_a_guess_and_eliminations_do_not() {
    let compiled = Backend::all().into_iter().filter(Backend::is_compiled);
    for backend in compiled.filter(|backend| *backend != Backend::Auto) {
        let solver = backend.create().unwrap();
        assert_eq!(solver.takes_guess(), backend.is_iterative(), "{backend}");
    }
}

#[test]
fn the_first_that_takes_the_systems_is_taken() {
    let cg = Backend::ConjugateGradient(CgOptions::default());
    let umfpack = Backend::Umfpack(UmfpackOptions::default());
    let of = |all: &[&Backend], indefinite| {
        let first = Backend::first_of(all.iter().copied().cloned(), indefinite);
        first.map_or("none".to_owned(), |b| b.to_string())
    };
    assert_eq!(of(&[&Backend::Banded, &cg], false), "banded");
    assert_eq!(of(&[&Backend::NalgebraSparse, &cg], true), "none");
    assert_eq!(of(&[&cg, &umfpack], true), "umfpack:refinement=0");
    // The dense solver is always there.
    assert!(Backend::preferred().is_ok_and(|b| b.is_compiled()));
    assert!(Backend::first_for(true).is_some_and(|b| b.is_compiled() && b.accepts_indefinite()));
}

#[test]
fn auto_solves_as_a_direct_solver() {
    let claims = Claims::of(&Backend::Auto);
    let agreement = check(&mut *Backend::Auto.create().unwrap(), &claims);
    assert!(agreement.unwrap_or_else(|e| panic!("{e}")).systems >= 24);
}
