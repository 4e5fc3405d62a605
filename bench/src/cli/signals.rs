//! Signals: those that ask a run to end, and the one of a file that grows too long.

use super::Failure;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU, SIGXFSZ};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Signals that ask a run to end, with their names: of a user, a closed terminal, a batch system.
const ENDS: [(i32, &str); 4] = [
    (SIGINT, "SIGINT"),
    (SIGTERM, "SIGTERM"),
    (SIGHUP, "SIGHUP"),
    (SIGXCPU, "SIGXCPU"),
];

/// Those of them of which a second one ends the program at once. Of the others several come: a
/// terminal and its shell send one each, the limit of CPU time one a second.
const AT_ONCE: [i32; 2] = [SIGINT, SIGTERM];

/// The signals that ask a run to end.
pub(super) struct Signals {
    /// True once a signal has come.
    pub(super) asked: Arc<AtomicBool>,
    /// Its number, 0 for none so far.
    signal: Arc<AtomicUsize>,
}

impl Signals {
    /// Number of the last one, 0 for none so far.
    pub(super) fn last(&self) -> usize {
        self.signal.load(Ordering::Relaxed)
    }
}

/// Name of a signal that asks a run to end; `None` for 0.
pub(super) fn name(signal: usize) -> Option<&'static str> {
    let named = ENDS.iter().find(|(number, _)| *number as usize == signal);
    named.map(|(_, name)| *name)
}

/// Takes the signals that ask a run to end. Those that the program was started to ignore, as by
/// `nohup` or by a shell in the background, stay ignored.
pub(super) fn signals() -> Result<Signals, Failure> {
    let (asked, signal) = (Arc::new(AtomicBool::new(false)), Arc::default());
    let ignored = ignored();
    let known = ignored.is_some();
    let is_ignored = |which: i32| ignored.unwrap_or_default() >> (which - 1) & 1 == 1;
    for (which, _) in ENDS {
        // Where nobody tells, `nohup` must not lose its effect.
        if is_ignored(which) || (which == SIGHUP && !known) {
            continue;
        }
        if AT_ONCE.contains(&which) {
            flag::register_conditional_shutdown(which, 128 + which, Arc::clone(&asked))?;
        }
        flag::register_usize(which, Arc::clone(&signal), which as usize)?;
        flag::register(which, Arc::clone(&asked))?;
    }
    Ok(Signals { asked, signal })
}

/// Signals that the program ignores, bit n − 1 for signal n, where the system tells.
fn ignored() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    ignored_in(&status)
}

fn ignored_in(status: &str) -> Option<u64> {
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))?;
    u64::from_str_radix(line.trim(), 16).ok()
}

/// A file that grows beyond the limit of the shell (`ulimit -f`) becomes a failed write: without
/// this it ends the program.
pub(super) fn survive_long_files() {
    // Where it cannot be taken it stays as it was.
    let _ = flag::register(SIGXFSZ, Arc::default());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_from_the_status() {
        let status = "Name:\ttaut\nSigBlk:\t0000000000000000\nSigIgn:\t0000000000001003\n";
        let ignored = ignored_in(status).expect("told");
        let is_ignored = |which: i32| ignored >> (which - 1) & 1 == 1;
        assert!(is_ignored(SIGHUP) && is_ignored(SIGINT));
        assert!(!is_ignored(SIGTERM) && !is_ignored(SIGXCPU));
        assert_eq!(ignored_in("Name:\ttaut\n"), None);
        assert_eq!(ignored_in("SigIgn:\tx\n"), None);
    }

    #[test]
    fn each_signal_has_its_name() {
        assert_eq!(name(0), None);
        assert_eq!(name(SIGHUP as usize), Some("SIGHUP"));
        assert_eq!(name(SIGXCPU as usize), Some("SIGXCPU"));
    }
}
