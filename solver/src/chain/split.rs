//! A long chain on two threads: each eliminates one end, and the caller joins them in the middle.
//!
//! The factor is that of `twisted`, number for number but for rounding, and needs no more arithmetic: it is the cheaper
//! way for two threads (independent pieces of a chain fill towards the block before them, which costs 2.4 times the
//! arithmetic). What is lost is that a thread has one end to work on, and waits for its divisions.
//!
//! The second thread owns its end: values and right-hand side are copied to it, the solution from it, so that no memory
//! is shared. See [`Worker`] for how the threads wait for each other.

use super::end::End;
use super::places::Places;
use super::{Chain, places};
use crate::worker::Worker;
use crate::{BlockPattern, SymBlockMatrix};
use std::ops::Range;
use taut_lanes::Level;

/// Fewest blocks for which two threads are faster than one.
const FEWEST_BLOCKS: usize = 150;

/// Fewest blocks for which it is worth while to wait until the second thread has waked up.
const FEWEST_ASLEEP: usize = 5000;

/// Twisted factor of a chain, its ends by two threads.
#[derive(Debug)]
pub(crate) struct Split {
    up: End,
    down: Worker<Down>,
    /// The last block of each end and the middle one.
    tail: Chain,
    /// What the second end copies: values and rows.
    values: Range<usize>,
    rows: Range<usize>,
    /// The rows of its last block.
    last: Range<usize>,
    blocks: usize,
}

/// The end of the second thread, and its copies of what it needs.
#[derive(Debug)]
struct Down {
    end: End,
    values: Vec<f64>,
    b: Vec<f64>,
    x: Vec<f64>,
    work: Work,
    accepted: bool,
}

/// What the second thread is to do.
#[derive(Debug, Clone, Copy)]
enum Work {
    Factorize,
    Forward,
    Backward,
}

fn work(down: &mut Down) {
    match down.work {
        Work::Factorize => down.accepted = down.end.factorize(&down.values),
        Work::Forward => down.end.forward(&down.b, &mut down.x),
        Work::Backward => down.end.backward(&mut down.x),
    }
}

impl Split {
    /// For matrices of `pattern`, if it is a chain of small blocks in its order, long enough, and there are two
    /// processors. Starts a thread and allocates all that is needed.
    pub(crate) fn new(pattern: &BlockPattern, level: Level) -> Option<Self> {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        if processors < 2 || pattern.blocks() < FEWEST_BLOCKS {
            return None;
        }
        Self::of_any_length(pattern, level)
    }

    /// The same for any chain of at least three blocks.
    pub(super) fn of_any_length(pattern: &BlockPattern, level: Level) -> Option<Self> {
        let all: Vec<usize> = (0..pattern.blocks()).collect();
        let (size, steps) = (places::size_of_chain(pattern, &all)?, all.len() / 2);
        let places = Places::new(pattern, &all)?;
        let end = |end: usize| places.steps[..steps].iter().map(move |s| s.ends[end]);
        // With an even number of blocks the second end is one shorter.
        let mut down: Vec<_> = end(1).skip(1 - all.len() % 2).collect();
        let last = down.last().copied()?;
        let values = last.diagonal..pattern.stored_values();
        let rows = last.row..pattern.dim();
        for place in &mut down {
            place.row -= rows.start;
            place.diagonal -= values.start;
        }
        // The coupling of the last one to the middle is in a column before.
        let (_, coupled) = down.split_last_mut()?;
        for place in coupled {
            place.coupling = place.coupling.map(|first| first - values.start);
        }
        let up = End::new(size, level, false, end(0).collect());
        let down = Down {
            end: End::new(size, level, true, down),
            values: vec![0.0; values.len()],
            b: vec![0.0; rows.len()],
            x: vec![0.0; rows.len()],
            work: Work::Factorize,
            accepted: false,
        };
        let tail = Places {
            size,
            steps: places.steps[steps - 1..].to_vec(),
        };
        Some(Self {
            up,
            down: Worker::new(down, work)?,
            tail: Chain::on(tail, level),
            last: last.row..last.row + last.size,
            values,
            rows,
            blocks: all.len(),
        })
    }

    /// Whether two threads are the faster way now. Wakes the second one up, for later, where it sleeps.
    pub(crate) fn is_ready(&self) -> bool {
        self.down.is_awake() || self.blocks >= FEWEST_ASLEEP
    }

    /// Factorises `a`, of the pattern of [`new`](Self::new); whether all pivots are more than noise. Allocates nothing.
    pub(crate) fn factorize(&mut self, a: &SymBlockMatrix) -> bool {
        {
            let mut down = self.down.data();
            down.values
                .copy_from_slice(&a.values()[self.values.clone()]);
            down.work = Work::Factorize;
        }
        self.down.give();
        let accepted = self.up.factorize(a.values());
        self.down.finish();
        let down = self.down.data();
        let ends = [self.up.last(), down.end.last()];
        accepted && down.accepted && self.tail.join(ends, a.values())
    }

    /// Solves A x = b, both of length `dim`. Allocates nothing.
    pub(crate) fn solve(&mut self, b: &[f64], x: &mut [f64]) {
        {
            let mut down = self.down.data();
            down.b.copy_from_slice(&b[self.rows.clone()]);
            down.work = Work::Forward;
        }
        self.down.give();
        let middle = self.tail.middle_rows();
        x[middle.clone()].copy_from_slice(&b[middle]);
        self.up.forward(b, x);
        self.down.finish();
        let own = 0..self.last.len();
        {
            let mut down = self.down.data();
            x[self.last.clone()].copy_from_slice(&down.x[own.clone()]);
            self.tail.solve_in_place(x);
            down.x[own].copy_from_slice(&x[self.last.clone()]);
            down.work = Work::Backward;
        }
        self.down.give();
        self.up.backward(x);
        self.down.finish();
        x[self.rows.clone()].copy_from_slice(&self.down.data().x);
    }
}
