//! Where the blocks of a chain lie in its matrix, and in which step of the two eliminations each has its turn.

use super::overlay::Offsets;
use crate::BlockPattern;

/// Where a block lies that is eliminated, and its coupling to the block that comes after it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BlockSlot {
    /// First scalar row.
    pub(super) row: usize,
    /// Number of rows; 0 for padding.
    pub(super) size: usize,
    /// First value of the diagonal block ([`Offsets`]).
    pub(super) diagonal: usize,
    /// First value of the coupling to the next block; `None` where there is none.
    pub(super) coupling: Option<usize>,
    /// Number of rows of the next block.
    pub(super) next: usize,
}

impl BlockSlot {
    /// The block `here`, and the block `next` that it couples to.
    fn new(offsets: Offsets<'_>, here: usize, next: Option<usize>) -> Self {
        let pattern = offsets.pattern;
        let next = next.unwrap_or(here);
        let coupling = pattern.find(here.max(next), here.min(next));
        Self {
            row: pattern.rows(here).start,
            size: pattern.size(here),
            diagonal: offsets.of(pattern.column(here).start),
            coupling: coupling.filter(|_| next != here).map(|k| offsets.of(k)),
            next: pattern.size(next),
        }
    }
}

/// The size that the blocks of a chain are padded to; `None` where one of the blocks (ascending) couples to one of them
/// that is not its neighbour among them, or has more than six rows.
pub(super) fn size_of_chain(pattern: &BlockPattern, chain: &[usize]) -> Option<usize> {
    let is_chain = chain.iter().enumerate().all(|(i, &block)| {
        let coupled = pattern.column(block).skip(1);
        let mut schedule = coupled.filter_map(|k| chain.binary_search(&pattern.row(k)).ok());
        schedule.all(|other| other == i + 1)
    });
    let largest = chain.iter().map(|&j| pattern.size(j)).max().unwrap_or(0);
    match largest {
        _ if !is_chain => None,
        0..=3 => Some(3),
        4..=5 => Some(5),
        6 => Some(6),
        _ => None,
    }
}

/// A step of both eliminations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// The block of each elimination: up from the first block, down from the last.
    pub(super) ends: [BlockSlot; 2],
    /// True if these blocks and their couplings exist in full size.
    pub(super) full: bool,
}

/// The two eliminations of a chain.
#[derive(Debug, Clone)]
pub(super) struct Schedule {
    /// All blocks are padded to this many rows: 3, 5 or 6.
    pub(super) size: usize,
    /// The steps, then one with the middle block at the first end.
    pub(super) steps: Vec<Step>,
    /// Steps of which a diagonal block is a patch.
    pub(super) patched: Vec<usize>,
}

impl Schedule {
    /// Places of the blocks `chain` (ascending); `None` unless [`size_of_chain`] accepts them.
    pub(super) fn new(offsets: Offsets<'_>, chain: &[usize]) -> Option<Self> {
        let size = size_of_chain(offsets.pattern, chain)?;
        let blocks = chain.len();
        let count = blocks / 2;
        let mut steps: Vec<Step> = (0..count)
            .map(|t| {
                // With an even number of blocks the second elimination is one block shorter and comes one step later.
                let down = blocks - blocks % 2 - t;
                let down = if down < blocks {
                    BlockSlot::new(offsets, chain[down], Some(chain[down - 1]))
                } else {
                    BlockSlot::default()
                };
                let ends = [BlockSlot::new(offsets, chain[t], Some(chain[t + 1])), down];
                let full = |p: &BlockSlot| p.size == size && p.next == size && p.coupling.is_some();
                Step {
                    full: ends.iter().all(full),
                    ends,
                }
            })
            .collect();
        let middle = chain.get(count);
        let middle = middle.map_or(BlockSlot::default(), |&j| BlockSlot::new(offsets, j, None));
        steps.push(Step {
            ends: [middle, BlockSlot::default()],
            full: false,
        });
        let is_patch = |step: &Step| step.ends.iter().any(|p| offsets.is_patch(p.diagonal));
        let patched = (0..steps.len()).filter(|&t| is_patch(&steps[t])).collect();
        Some(Self {
            size,
            steps,
            patched,
        })
    }

    /// Number of steps before the middle block.
    pub(super) fn steps(&self) -> usize {
        self.steps.len() - 1
    }
}
