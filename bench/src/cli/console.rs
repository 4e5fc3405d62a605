//! Progress bars and notes beside the requested output, on a terminal and unless `--quiet`.

use super::Failure;
use indicatif::style::ProgressTracker;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt;
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use taut_measure::files;
use taut_measure::pace::{self, Pace};

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
        bar.with_style(style())
    }

    /// A likely mistake, on standard error.
    pub(crate) fn doubt(self, note: impl fmt::Display) {
        if !self.quiet {
            files::note(note);
        }
    }

    /// Prints a remark, which is not data: on a terminal only.
    pub(crate) fn note(self, text: &str) -> Result<(), Failure> {
        if !self.quiet && std::io::stdout().is_terminal() {
            files::print(&format!("{text}\n"))?;
        }
        Ok(())
    }
}

const TEMPLATE: &str = "{msg:18} {wide_bar} {pos}/{len} {elapsed} {pace}";

/// How it shows it.
fn style() -> ProgressStyle {
    let style = ProgressStyle::with_template(TEMPLATE);
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    style.with_key("pace", Tracker::default())
}

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
        // A bar that cannot be written is left out.
        let _ = out.write_str(&self.0.text(state.per_sec()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use indicatif::TermLike;
    use std::io::Result;
    use std::sync::{Arc, Mutex};
    use taut_integrator::{StepOptions, Stepper};
    use taut_model::HoistParams;

    /// A terminal of 120 columns that keeps what is written.
    #[derive(Debug, Clone, Default)]
    struct Terminal(Arc<Mutex<String>>);

    impl TermLike for Terminal {
        fn width(&self) -> u16 {
            120
        }
        fn move_cursor_up(&self, _: usize) -> Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> Result<()> {
            Ok(())
        }
        fn write_line(&self, line: &str) -> Result<()> {
            self.write_str(line)
        }
        fn write_str(&self, text: &str) -> Result<()> {
            self.0.lock().unwrap().push_str(text);
            Ok(())
        }
        fn clear_line(&self) -> Result<()> {
            self.0.lock().unwrap().clear();
            Ok(())
        }
        fn flush(&self) -> Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_bar_shows_steps_a_second_and_the_real_time_factor() {
        let terminal = Terminal::default();
        let target = ProgressDrawTarget::term_like(Box::new(terminal.clone()));
        let bar = ProgressBar::with_draw_target(Some(30), target).with_style(style());
        bar.set_message("hoist");
        bar.tick();
        let scene = HoistParams {
            segments: 2,
            ..HoistParams::default()
        };
        let scene = scene.build().unwrap();
        let mut stepper = Stepper::new(scene, StepOptions::default()).unwrap();
        for _ in 0..30 {
            pace::step(&mut stepper).unwrap();
            bar.inc(1);
            std::thread::sleep(Duration::from_millis(10));
        }
        bar.tick();
        let shown = terminal.0.lock().unwrap().clone();
        for words in ["hoist ", " 30/30 ", " steps/s, ", "× real time"] {
            assert!(shown.contains(words), "{words}: {shown:?}");
        }
        assert!(shown.trim_end().chars().count() <= 120, "{shown:?}");
    }

    #[test]
    fn a_quiet_bar_is_hidden() {
        assert!(Console { quiet: true }.progress(3).is_hidden());
    }
}
