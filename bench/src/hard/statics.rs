//! Hard cases at rest: H01 to H14.

use super::Case;

/// The cases.
pub const CASES: &[Case] = &[];
