//! Structure of the code, checked on its sources.

/// Where kinds of constraint are told apart.
mod kinds;
/// Statements of the README and the front pages about the workspace.
mod readme;
/// Who imports whom, where features and unsafe code stand, what lies at the top level.
mod sources;
