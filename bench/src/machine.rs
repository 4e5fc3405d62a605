//! What machine the figures were measured on.

use serde::Serialize;
use taut_lanes::Level;

/// The compiler that this was built with.
pub const RUSTC: &str = env!("TAUT_RUSTC");

/// The processor that it was compiled for, as the compiler's `target-cpu` names it.
pub const TARGET_CPU: &str = env!("TAUT_TARGET_CPU");

/// The machine and the build.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Processor model, where the system tells.
    pub cpu: String,
    /// Threads available.
    pub threads: usize,
    /// Architecture and operating system.
    pub target: String,
    /// `release` or `debug`: debug figures are not worth comparing.
    pub profile: &'static str,
    /// The instructions that vectors are made of, see [`taut_lanes::Level`].
    pub simd: String,
}

impl Machine {
    /// This machine.
    #[must_use]
    pub fn current() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = info
            .lines()
            .find_map(|l| l.strip_prefix("model name")?.split_once(':'));
        Self {
            cpu: model
                .map_or("unknown processor", |(_, name)| name.trim())
                .to_owned(),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            profile: if cfg!(debug_assertions) {
                "debug"
            } else {
                "release"
            },
            simd: Level::best().to_string(),
        }
    }
}

impl std::fmt::Display for Machine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}, {} threads, {}, {} build, {}",
            self.cpu, self.threads, self.target, self.profile, self.simd
        )
    }
}
