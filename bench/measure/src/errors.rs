//! Errors as numbers, which of two is worse; errors as causes, of which no more is asked than their text.

/// Why something could not be done.
pub type Cause = Box<dyn std::error::Error + Send + Sync>;

/// The larger of two errors; NaN counts as the largest.
pub fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}
