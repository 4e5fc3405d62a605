//! What the program says besides what was asked for: progress bars and notes, on a terminal and unless `--quiet`.

use crate::Failure;
use indicatif::style::ProgressTracker;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt;
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use taut_bench::output;
use taut_bench::pace::{self, Pace};

/// Whether anything but what was asked for is said.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Console {
    /// Neither bars nor notes.
    pub(crate) quiet: bool,
}

impl Console {
    /// A bar on a terminal, nothing elsewhere.
    pub(crate) fn progress(self, length: u64) -> ProgressBar {
        let bar = ProgressBar::new(length);
        if self.quiet {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        if !bar.is_hidden() {
            // A unit may take long: the clock goes on meanwhile.
            bar.enable_steady_tick(Duration::from_millis(250));
        }
        match ProgressStyle::with_template(TEMPLATE) {
            Ok(style) => bar.with_style(style.with_key("pace", Tracker::default())),
            Err(_) => bar,
        }
    }

    /// A line about what was done, which is no data: on a terminal only.
    pub(crate) fn note(self, text: &str) -> Result<(), Failure> {
        if !self.quiet && std::io::stdout().is_terminal() {
            output::print(&format!("{text}\n"))?;
        }
        Ok(())
    }
}

/// What a bar shows.
const TEMPLATE: &str = "{msg:18} {wide_bar} {pos}/{len} {elapsed} {pace}";

/// The part of a bar that says how fast it goes.
#[derive(Debug, Clone, Default)]
struct Tracker(Pace);

impl ProgressTracker for Tracker {
    fn clone_box(&self) -> Box<dyn ProgressTracker> {
        Box::new(self.clone())
    }

    fn tick(&mut self, _: &ProgressState, now: Instant) {
        self.0.note(now, pace::made());
    }

    fn reset(&mut self, _: &ProgressState, _: Instant) {
        self.0 = Pace::default();
    }

    fn write(&self, state: &ProgressState, out: &mut dyn fmt::Write) {
        // What cannot be written is not shown.
        let _ = out.write_str(&self.0.text(state.per_sec()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_is_sound_and_a_quiet_bar_hidden() {
        assert!(ProgressStyle::with_template(TEMPLATE).is_ok());
        assert!(Console { quiet: true }.progress(3).is_hidden());
    }
}
