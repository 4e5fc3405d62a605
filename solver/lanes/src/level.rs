//! Which instructions kernels run on.

use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;

/// Instructions that this processor has. Values can only be had where that is so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Level(u8);

const NAMES: [&str; 3] = ["portable", "avx2", "avx512"];

impl Level {
    /// Plain doubles, on any processor.
    pub const PORTABLE: Self = Self(0);
    pub(crate) const AVX2: Self = Self(1);
    pub(crate) const AVX512: Self = Self(2);

    /// The levels that this processor has, ascending: `portable`; on x86-64 `avx2` (with FMA) and `avx512` (F, VL
    /// and DQ, with the former).
    #[must_use]
    pub fn available() -> Vec<Self> {
        [Self::PORTABLE, Self::AVX2, Self::AVX512]
            .into_iter()
            .filter(|level| level.is_available())
            .collect()
    }

    #[cfg(target_arch = "x86_64")]
    fn is_available(self) -> bool {
        use std::arch::is_x86_feature_detected as has;
        let avx2 = || has!("avx2") && has!("fma");
        match self {
            Self::AVX2 => avx2(),
            Self::AVX512 => avx2() && has!("avx512f") && has!("avx512vl") && has!("avx512dq"),
            _ => true,
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn is_available(self) -> bool {
        self == Self::PORTABLE
    }

    /// Most doubles in a register.
    #[must_use]
    pub fn widest(self) -> usize {
        [1, 4, 8][usize::from(self.0)]
    }

    /// The level that the environment variable `TAUT_SIMD` asks for, by its name; `None` where it is not set.
    ///
    /// # Errors
    /// [`ParseLevelError`] where there is no such level, or not on this processor.
    pub fn wanted() -> Result<Option<Self>, ParseLevelError> {
        let name = std::env::var_os("TAUT_SIMD");
        name.map(|name| name.to_string_lossy().parse()).transpose()
    }

    /// The [`wanted`](Self::wanted) level, for measurements; the highest that there is where none is asked for, or one
    /// that cannot be had: a program that lets its users ask reports that error. Read once.
    #[must_use]
    #[inline]
    pub fn best() -> Self {
        static BEST: OnceLock<Level> = OnceLock::new();
        *BEST.get_or_init(|| {
            let highest = || Self::available().pop().unwrap_or(Self::PORTABLE);
            Self::wanted().ok().flatten().unwrap_or_else(highest)
        })
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(NAMES[usize::from(self.0)])
    }
}

/// Why a text names no level.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ParseLevelError {
    /// There is no such level.
    Unknown {
        /// The name given.
        name: String,
    },
    /// This processor does not have it.
    Absent {
        /// The name given.
        name: String,
    },
}

impl fmt::Display for ParseLevelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { name } => {
                write!(
                    f,
                    "unknown level `{name}`: choose one of {}",
                    NAMES.join(", ")
                )
            }
            Self::Absent { name } => {
                write!(f, "this processor has no `{name}`: it has ")?;
                let names: Vec<_> = Level::available().iter().map(Level::to_string).collect();
                f.write_str(&names.join(", "))
            }
        }
    }
}

impl std::error::Error for ParseLevelError {}

impl FromStr for Level {
    type Err = ParseLevelError;

    fn from_str(text: &str) -> Result<Self, ParseLevelError> {
        let name = || text.to_owned();
        let index = NAMES.iter().position(|&n| n == text);
        let level = Self(index.ok_or_else(|| ParseLevelError::Unknown { name: name() })? as u8);
        if level.is_available() {
            Ok(level)
        } else {
            Err(ParseLevelError::Absent { name: name() })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for level in Level::available() {
            assert_eq!(level.to_string().parse(), Ok(level));
        }
        assert!(Level::available().contains(&Level::best()));
        let unknown = "mmx".parse::<Level>().unwrap_err();
        assert!(unknown.to_string().contains("portable, avx2"));
    }
}
