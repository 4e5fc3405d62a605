//! A second thread that does one piece of work at a time, over and over.
//!
//! A factorisation lasts tens of microseconds; to wake a thread takes as long. So the thread waits for more work by
//! asking for it for a while after it has finished some ([`AWAKE`]), and sleeps from then on. Work that is given to it
//! while it sleeps may as well be done by the thread that gives it: whoever comes first takes it.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{JoinHandle, Thread};
use std::time::{Duration, Instant};

/// How long the thread stays awake without work: longer than what a step does between two uses of its solver.
const AWAKE: Duration = Duration::from_millis(1);

/// Questions for work between two looks at the clock.
const QUESTIONS: u32 = 200;

/// No work, and the thread is asking for some.
const AWAKE_AND_FREE: u32 = 0;
/// No work, and the thread sleeps.
const ASLEEP: u32 = 1;
/// Work that nobody has taken.
const GIVEN: u32 = 2;
/// Work that somebody does.
const TAKEN: u32 = 3;
/// The thread is to end.
const ENDED: u32 = 4;

#[derive(Debug)]
struct Shared<T> {
    turn: AtomicU32,
    data: Mutex<T>,
    work: fn(&mut T),
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, T> {
        self.data.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does the work if it is given and nobody has taken it.
    fn take(&self) -> bool {
        let (given, taken) = (GIVEN, TAKEN);
        let mine = self
            .turn
            .compare_exchange(given, taken, Ordering::Acquire, Ordering::Relaxed);
        if mine.is_err() {
            return false;
        }
        let _done = Done(&self.turn);
        (self.work)(&mut self.lock());
        true
    }
}

/// Says that work is done when it goes, even where that panics: the other thread waits for it.
struct Done<'a>(&'a AtomicU32);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        // Where the thread is to end that stays so.
        let (taken, free) = (TAKEN, AWAKE_AND_FREE);
        let changed = self
            .0
            .compare_exchange(taken, free, Ordering::Release, Ordering::Relaxed);
        changed.ok();
    }
}

/// What the thread does until it is to end.
fn serve<T>(shared: &Shared<T>) {
    let mut since = Instant::now();
    loop {
        for _ in 0..QUESTIONS {
            match shared.turn.load(Ordering::Relaxed) {
                ENDED => return,
                GIVEN if shared.take() => since = Instant::now(),
                _ => std::hint::spin_loop(),
            }
        }
        if since.elapsed() < AWAKE {
            continue;
        }
        let order = (Ordering::Relaxed, Ordering::Relaxed);
        let (free, asleep) = (AWAKE_AND_FREE, ASLEEP);
        let sleeps = shared.turn.compare_exchange(free, asleep, order.0, order.1);
        if sleeps.is_ok() {
            std::thread::park();
            // Waked for no work yet, or by chance.
            let waked = shared.turn.compare_exchange(asleep, free, order.0, order.1);
            waked.ok();
            since = Instant::now();
        }
    }
}

/// The thread, and the data that it works on.
#[derive(Debug)]
pub(crate) struct Worker<T> {
    shared: Arc<Shared<T>>,
    handle: Option<JoinHandle<()>>,
}

impl<T: Send + 'static> Worker<T> {
    /// Starts a thread that does `work`, which must not panic. `None` where the system gives no thread.
    pub(crate) fn new(data: T, work: fn(&mut T)) -> Option<Self> {
        let shared = Arc::new(Shared {
            turn: AtomicU32::new(AWAKE_AND_FREE),
            data: Mutex::new(data),
            work,
        });
        let theirs = shared.clone();
        let builder = std::thread::Builder::new().name("taut-solver".to_owned());
        let handle = builder.spawn(move || serve(&theirs)).ok()?;
        Some(Self {
            shared,
            handle: Some(handle),
        })
    }

    /// The data, between pieces of work.
    pub(crate) fn data(&self) -> MutexGuard<'_, T> {
        self.shared.lock()
    }

    /// Whether the thread is awake; it is waked if it is not, which takes a while.
    pub(crate) fn is_awake(&self) -> bool {
        let awake = self.shared.turn.load(Ordering::Relaxed) != ASLEEP;
        if !awake {
            self.thread().map(Thread::unpark);
        }
        awake
    }

    /// Gives the thread its work. [`finish`](Self::finish) comes next, and [`data`](Self::data) only after that.
    pub(crate) fn give(&self) {
        let before = self.shared.turn.swap(GIVEN, Ordering::AcqRel);
        if before == ASLEEP {
            self.thread().map(Thread::unpark);
        }
    }

    /// Returns when the work is done, and does it itself where the thread has not begun.
    pub(crate) fn finish(&self) {
        if self.shared.take() {
            return;
        }
        let mut asked = 0_u32;
        while self.shared.turn.load(Ordering::Acquire) == TAKEN {
            asked = asked.wrapping_add(1);
            if asked.is_multiple_of(QUESTIONS) {
                // Another process may have its processor.
                std::thread::yield_now();
            } else {
                std::hint::spin_loop();
            }
        }
    }

    fn thread(&self) -> Option<&Thread> {
        self.handle.as_ref().map(JoinHandle::thread)
    }
}

impl<T> Drop for Worker<T> {
    fn drop(&mut self) {
        self.shared.turn.store(ENDED, Ordering::Release);
        if let Some(handle) = self.handle.take() {
            handle.thread().unpark();
            // It ends without a panic, for `work` has none.
            handle.join().ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Work is done once each time, whoever does it and whether or not the thread sleeps.
    #[test]
    fn work_is_done_once_each_time() {
        let worker = Worker::new(0_u32, |n| *n += 1).expect("a thread");
        for round in 1..=2000 {
            worker.give();
            worker.finish();
            assert_eq!(*worker.data(), round);
            if round % 500 == 0 {
                std::thread::sleep(2 * AWAKE);
                worker.is_awake();
            }
        }
        // It ends with work that nobody has finished.
        worker.give();
    }

    #[test]
    fn a_sleeping_thread_is_waked() {
        let worker = Worker::new((), |()| ()).expect("a thread");
        let until = |awake: bool| {
            let begin = Instant::now();
            while (worker.shared.turn.load(Ordering::Relaxed) != ASLEEP) != awake {
                assert!(begin.elapsed() < Duration::from_secs(20), "awake: {awake}");
                std::thread::sleep(AWAKE / 10);
            }
        };
        until(false);
        assert!(!worker.is_awake());
        until(true);
        until(false);
    }
}
