//! Wall-clock time, by which steps and choices are measured and on which nothing else depends.

use std::time::Duration;

/// Clock reading; always zero where there is no clock, as on `wasm32-unknown-unknown`.
#[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
type Reading = std::time::Instant;
#[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
type Reading = Duration;

/// An instant of the system's clock. On `wasm32-unknown-unknown` there is none: every time that is measured is zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment(Reading);

impl Moment {
    /// This one.
    #[must_use]
    pub fn now() -> Self {
        #[cfg(not(all(target_arch = "wasm32", target_os = "unknown")))]
        let reading = Reading::now();
        #[cfg(all(target_arch = "wasm32", target_os = "unknown"))]
        let reading = Reading::ZERO;
        Self(reading)
    }

    /// The time since an earlier one.
    #[must_use]
    pub fn since(self, earlier: Self) -> Duration {
        self.0 - earlier.0
    }

    /// The time since this one.
    #[must_use]
    pub fn elapsed(self) -> Duration {
        Self::now().since(self)
    }
}
