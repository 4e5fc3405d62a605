//! Where the blocks of a chain lie in its matrix, and in which step of the two eliminations each has its turn.

use super::block::triangle;
use crate::BlockPattern;

/// Where a block lies that is eliminated, and its coupling to the block that comes after it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    /// First scalar row.
    pub(super) row: usize,
    /// Number of rows; 0 for padding.
    pub(super) size: usize,
    /// First value of the diagonal block.
    pub(super) diagonal: usize,
    /// First value of the coupling to the next block; `None` where there is none.
    pub(super) coupling: Option<usize>,
    /// Number of rows of the next block.
    pub(super) next: usize,
}

impl Place {
    /// The block `j`, its coupling stored in block column `column`, and the block `next` after it.
    fn new(pattern: &BlockPattern, j: usize, column: usize, next: usize) -> Self {
        let coupling = pattern.column(column).nth(1);
        Self {
            row: pattern.rows(j).start,
            size: pattern.size(j),
            diagonal: pattern.values(pattern.column(j).start).start,
            coupling: coupling.map(|k| pattern.values(k).start),
            next: pattern.size(next),
        }
    }
}

/// The size that all blocks of a chain are padded to; `None` where the pattern is no chain in its order, or a block has
/// more than six rows.
pub(super) fn size_of_chain(pattern: &BlockPattern) -> Option<usize> {
    let blocks = pattern.blocks();
    let is_chain = (0..blocks).all(|j| {
        let mut coupled = pattern.column(j).skip(1);
        coupled.all(|k| pattern.row(k) == j + 1)
    });
    let largest = (0..blocks).map(|j| pattern.size(j)).max().unwrap_or(0);
    match largest {
        _ if !is_chain => None,
        0..=3 => Some(3),
        4..=5 => Some(5),
        6 => Some(6),
        _ => None,
    }
}

/// The blocks from the first to the last.
pub(super) fn in_order(pattern: &BlockPattern) -> Vec<Place> {
    let last = pattern.blocks().saturating_sub(1);
    (0..pattern.blocks())
        .map(|j| Place::new(pattern, j, j, last.min(j + 1)))
        .collect()
}

/// A step of both eliminations.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// The block of each elimination: up from the first block, down from the last.
    pub(super) ends: [Place; 2],
    /// Whether these blocks and their couplings are there in full size.
    pub(super) full: bool,
}

/// The two eliminations of a chain.
#[derive(Debug, Clone)]
pub(super) struct Places {
    /// All blocks are padded to this many rows: 3, 5 or 6.
    pub(super) size: usize,
    /// The steps, then one with the middle block at the first end.
    pub(super) steps: Vec<Step>,
    blocks: usize,
}

impl Places {
    /// `None` where the pattern is no chain in its order, or a block has more than six rows.
    pub(super) fn new(pattern: &BlockPattern) -> Option<Self> {
        let size = size_of_chain(pattern)?;
        let blocks = pattern.blocks();
        let place = |j, column, next| Place::new(pattern, j, column, next);
        let count = blocks / 2;
        let mut steps: Vec<Step> = (0..count)
            .map(|t| {
                // With an even number of blocks the second elimination is one block shorter and comes one step later.
                let down = blocks - blocks % 2 - t;
                let down = if down < blocks {
                    place(down, down - 1, down - 1)
                } else {
                    Place::default()
                };
                let ends = [place(t, t, t + 1), down];
                let full = |p: &Place| p.size == size && p.next == size && p.coupling.is_some();
                // The middle block is not the second end's.
                Step {
                    full: t + 1 < count && ends.iter().all(full),
                    ends,
                }
            })
            .collect();
        let middle = if blocks == 0 {
            Place::default()
        } else {
            place(count, count, count)
        };
        steps.push(Step {
            ends: [middle, Place::default()],
            full: false,
        });
        Some(Self {
            size,
            steps,
            blocks,
        })
    }

    /// Number of steps before the middle block.
    pub(super) fn steps(&self) -> usize {
        self.steps.len() - 1
    }

    /// 1/D of row `row` of block `block` in the factor.
    pub(super) fn inverse_pivot(&self, factor: &[f64], block: usize, row: usize) -> f64 {
        let (count, size) = (self.steps(), self.size);
        let (step, lane) = if block <= count {
            (block, 0)
        } else {
            (self.blocks - block - self.blocks % 2, 1)
        };
        let first = step * (triangle(size) + size * size) + triangle(size) - size;
        factor[2 * (first + row) + lane]
    }
}
