//! What has a formula or a definition is that: to 10⁻⁹ and better with direct solvers, unless a test says its own bar.

/// The assembled systems: symmetric, definite, and the same as their definition.
mod assembly;
/// Rows with bounds: complementarity, against all active sets.
mod bounded;
/// Bounded rows, motors, winches, driven bodies.
mod driven;
/// A step's equations as dense matrices.
mod equations;
/// Angles and rotations to 30 digits.
mod extended;
/// The hanging cable, settled and held.
mod hanging;
/// Jacobians of joints at singular angles, beside differences in 32 digits.
mod jacobians;
/// Angular rows of joints from half angles in 32 digits.
mod joints;
/// Networks at rest carry their weight.
mod networks;
/// Static shapes, however they are reached.
mod rest;
/// Rigid rows, and compliant ones near that limit.
mod rigid;
