//! Frames by the clock: 60 a second, and late ones are reported.

use std::time::{Duration, Instant};

/// Frames a second.
pub const RATE: f64 = 60.0;

/// When frames are due, and how they have kept to it.
///
/// Frame k is due at t₀ + k/60 s, and late where its work ends after the next is due. Then the clock goes on from where it
/// is: the run has lost that time, and no step is left out to catch up.
#[derive(Debug, Clone)]
pub struct Clock {
    due: Instant,
    period: Duration,
    /// Frames so far.
    pub frames: u64,
    /// Frames that were late.
    pub late: u64,
    /// Time lost by them.
    pub lost: Duration,
    /// Longest work on a frame since it was last [asked for](Self::busiest).
    busiest: Duration,
}

impl Clock {
    /// A clock whose first frame is due now.
    pub fn start(now: Instant) -> Self {
        Self {
            due: now,
            period: Duration::from_secs_f64(1.0 / RATE),
            frames: 0,
            late: 0,
            lost: Duration::ZERO,
            busiest: Duration::ZERO,
        }
    }

    /// When the next frame is due.
    pub fn due(&self) -> Instant {
        self.due
    }

    /// A frame was begun and is done.
    pub fn done(&mut self, begun: Instant, now: Instant) {
        self.frames += 1;
        self.busiest = self.busiest.max(now.saturating_duration_since(begun));
        self.due += self.period;
        let behind = now.saturating_duration_since(self.due);
        if behind > Duration::ZERO {
            self.late += 1;
            self.lost += behind;
            self.due = now;
        }
    }

    /// The longest work on a frame since the last call.
    pub fn busiest(&mut self) -> Duration {
        std::mem::take(&mut self.busiest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_frames_are_counted_and_lose_their_time() {
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        let mut clock = Clock::start(start);
        clock.done(at(0), at(3));
        assert_eq!((clock.frames, clock.late), (1, 0));
        assert_eq!((clock.due() - start).as_millis(), 16);
        // Due at 16.7 ms, begun too late, done before the next is due.
        clock.done(at(20), at(30));
        assert_eq!((clock.late, clock.lost), (0, Duration::ZERO));
        // Due at 33.3 ms, done 20 ms after the next.
        clock.done(at(34), at(70));
        assert_eq!((clock.frames, clock.late), (3, 1));
        assert!((clock.lost.as_secs_f64() - 0.02).abs() < 1e-6);
        assert_eq!(clock.due(), at(70));
        assert_eq!(clock.busiest().as_millis(), 36);
        assert_eq!(clock.busiest(), Duration::ZERO);
    }
}
