//! What the code is made of, checked on its sources and on its allocations.

/// Steps allocate nothing.
mod allocations;
/// What the README and the front pages say, against what is there.
mod readme;
/// Who imports whom, where features and unsafe code stand, what lies at the top level.
mod sources;
