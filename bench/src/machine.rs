//! Description of the machine that figures were measured on.

use serde::Serialize;
use std::process::{Command, Stdio};
use taut_lanes::Level;

/// The compiler that this was built with.
pub const RUSTC: &str = env!("TAUT_RUSTC");

/// The processor that it was compiled for, as the compiler's `target-cpu` names it.
pub const TARGET_CPU: &str = env!("TAUT_TARGET_CPU");

/// The flags of the compiler, as `CARGO_ENCODED_RUSTFLAGS` has them.
pub const ENCODED_RUSTFLAGS: &str = env!("TAUT_ENCODED_RUSTFLAGS");

/// `release` or `debug`.
pub const PROFILE: &str = if cfg!(debug_assertions) {
    "debug"
} else {
    "release"
};

/// The options of `cargo` that choose the features of this build.
const FEATURES: &str = env!("TAUT_FEATURES");

/// The command line that makes this build, from its sources, and runs it with these arguments as well; for a shell.
pub fn command(arguments: &[String]) -> String {
    let mut words = Vec::new();
    if let Ok(simd) = std::env::var("TAUT_SIMD") {
        words.push(format!("TAUT_SIMD={}", quoted(&simd)));
    }
    words.extend(rustflags().map(|flags| format!("RUSTFLAGS={}", quoted(&flags))));
    words.push("cargo run".to_owned());
    words.extend(build_options().map(str::to_owned));
    if !arguments.is_empty() {
        words.push("--".to_owned());
        words.extend(arguments.iter().map(|a| quoted(a)));
    }
    words.join(" ")
}

/// The options of the compiler that choose the processor; none for the generic one.
fn rustflags() -> Option<String> {
    (TARGET_CPU != "generic").then(|| format!("-C target-cpu={TARGET_CPU}"))
}

/// The options of `cargo` that make this build.
pub fn build_options() -> impl Iterator<Item = &'static str> {
    let profile = (PROFILE == "release").then_some("--release");
    profile
        .into_iter()
        .chain(["--locked"])
        .chain(FEATURES.split_whitespace())
}

/// The present commit of the source folder, with a mark for changed files, as `git describe` has
/// it. It is the commit that was built unless the folder has moved on since. `unknown` without git
/// or outside a repository.
pub fn commit() -> String {
    let described = Command::new("git")
        .args(["-C", env!("CARGO_MANIFEST_DIR")])
        .args(["describe", "--always", "--dirty"])
        // Nothing is written there, not even what git keeps for itself; no other repository is meant.
        .env("GIT_OPTIONAL_LOCKS", "0")
        .env_remove("GIT_DIR")
        .env_remove("GIT_WORK_TREE")
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output();
    let text = described.ok().filter(|out| out.status.success());
    let text = text.and_then(|out| String::from_utf8(out.stdout).ok());
    let text = text.map(|text| text.trim().to_owned());
    text.filter(|text| !text.is_empty())
        .unwrap_or_else(|| "unknown".to_owned())
}

/// A word as a shell reads it back. None holds a NUL, which no argument can.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    shlex::try_quote(word).map_or_else(|_| word.to_owned(), std::borrow::Cow::into_owned)
}

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
            profile: PROFILE,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_commit_is_one_word() {
        let commit = commit();
        let holds = !commit.is_empty() && !commit.contains(char::is_whitespace);
        assert!(holds, "{commit}");
    }

    #[test]
    fn the_command_builds_with_these_features_and_is_quoted_for_a_shell() {
        let arguments = ["bench", "--set", "name=a b's"].map(str::to_owned);
        let words = shlex::split(&command(&arguments)).expect("closed quotes");
        assert_eq!(words[words.len() - 3..], arguments);
        for (name, on) in [
            ("umfpack", cfg!(feature = "umfpack")),
            ("--no-default-features", !cfg!(feature = "default")),
        ] {
            let named = words.iter().any(|w| w.split(',').any(|part| part == name));
            assert_eq!(named, on, "{name}: {words:?}");
        }
    }
}
