//! Bad input gives a typed error that names the fault: never a panic, never a NaN that goes on.

/// Systems that no backend can or should solve.
mod backends;
/// Motors, winches, controls, gantries, networks, static and driven bodies.
mod drives;
/// Scenes, parameters and step options.
mod scenes;

use taut_solver::Backend;

/// Every backend that is compiled in, with every option that changes its algorithm.
fn compiled() -> Vec<Backend> {
    let names = [
        "banded",
        "faer:llt",
        "faer:ldlt",
        "faer:lu",
        "nalgebra-sparse",
        "umfpack:refinement=0",
        "umfpack",
        "dense:double",
        "dense:extended",
        "cg:none",
        "cg:jacobi",
        "cg:group",
        "gauss-seidel:joints",
        "gauss-seidel:groups",
        "gauss-seidel:groups:trial",
    ];
    let all = names.iter().map(|name| name.parse().expect("a known name"));
    all.filter(Backend::is_compiled).collect()
}

/// The direct ones among them.
fn compiled_direct() -> Vec<Backend> {
    let mut all = compiled();
    all.retain(|b| !b.is_iterative());
    all
}
