//! Names that most tests use.

pub use crate::random::Random;
pub use crate::scenes::{centre, origin};
pub use crate::{
    With, Worst, allowed, bits, compiled, compiled_direct, compiled_iterative, oracle, paper,
    unguarded,
};
pub use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};
pub use taut_integrator::{Resolved, *};
pub use taut_measure::Choice;
pub use taut_model::*;
pub use taut_solver::{
    Backend, BlockPattern, DenseOptions, DoubleDouble, LinearSolver, SolveError, SolveReport,
    Status, SymBlockMatrix, backward_error, forward_error, norm_inf, residual,
};
