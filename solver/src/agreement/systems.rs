//! Random block systems with the shapes that cables, branches and loops give. Whoever makes one brings the random bits:
//! equal bits give equal systems.

use crate::{BlockPattern, SolveError, SymBlockMatrix};
use std::fmt;
use std::sync::Arc;

/// Numbers made of random bits.
pub(super) struct Random<'a>(pub(super) &'a mut dyn FnMut() -> u64);

impl Random<'_> {
    /// Evenly distributed in −1 … 1.
    pub(super) fn uniform(&mut self) -> f64 {
        ((self.0)() >> 11) as f64 * 2.0_f64.powi(-52) - 1.0
    }

    /// Evenly distributed in `from` … `to` on a logarithmic scale.
    pub(super) fn log_uniform(&mut self, from: f64, to: f64) -> f64 {
        let t = 0.5 * (1.0 + self.uniform());
        (from.ln() + t * (to / from).ln()).exp()
    }

    /// A number below `n`.
    pub(super) fn below(&mut self, n: usize) -> usize {
        ((self.0)() >> 33) as usize % n
    }

    /// Numbers in −1 … 1.
    fn numbers(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.uniform()).collect()
    }
}

/// How the blocks hang together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shape {
    /// One after the other.
    Chain,
    /// Each after a random earlier one.
    Tree,
    /// A chain with its ends joined, and two more chords.
    Loops,
}

impl Shape {
    /// All shapes.
    pub const ALL: [Self; 3] = [Self::Chain, Self::Tree, Self::Loops];

    /// Pairs of neighbours among `n`.
    fn edges(self, n: usize, random: &mut Random<'_>) -> Vec<(usize, usize)> {
        let chain = (1..n).map(|i| (i - 1, i));
        match self {
            Self::Chain => chain.collect(),
            Self::Tree => (1..n).map(|i| (random.below(i), i)).collect(),
            Self::Loops => chain
                .chain([(0, n - 1), (0, n / 2), (n / 3, n - 1)])
                .filter(|(i, j)| i != j)
                .collect(),
        }
    }
}

/// A system A x = b.
#[derive(Debug, Clone)]
pub struct System {
    /// The matrix A, n × n with n ≤ [`MOST_ROWS`]; no unit.
    pub a: SymBlockMatrix,
    /// The right-hand side b, of length n; evenly distributed in −1 … 1.
    pub b: Vec<f64>,
    /// Description, for messages.
    pub name: String,
}

impl fmt::Display for System {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

/// Scalar rows that a random system has at most.
pub const MOST_ROWS: usize = 120;

/// A positive definite system: like S = J M⁻¹ Jᵀ + Σ, a sum of B W Bᵀ over pairs of neighbours, whose weights W spread
/// over three decades, with random block sizes 1 … 7. Blocks are in three groups, one after the other. `bits` gives 64
/// random bits at each call. Allocates.
///
/// # Errors
/// None that these sizes could meet: those of [`BlockPattern::new`].
pub fn positive_definite(
    shape: Shape,
    bits: &mut dyn FnMut() -> u64,
) -> Result<System, SolveError> {
    const COLUMNS: usize = 9;
    let mut random = Random(bits);
    let blocks = 4 + random.below(24);
    let mut sizes: Vec<usize> = (0..blocks).map(|_| 1 + random.below(7)).collect();
    while sizes.iter().sum::<usize>() > MOST_ROWS {
        sizes.pop();
    }
    let blocks = sizes.len();
    let edges = shape.edges(blocks, &mut random);
    let groups = (0..blocks).map(|i| (3 * i / blocks) as u32).collect();
    let pattern = BlockPattern::new(&sizes, &edges)?.with_groups(groups)?;
    let mut a = SymBlockMatrix::zeros(Arc::new(pattern));
    // Each pair, and each block with the ground, shares a body of its own.
    let grounds = (0..blocks).map(|i| (i, i));
    for (i, j) in edges.into_iter().chain(grounds) {
        let weight = random.log_uniform(1e-3, 1.0);
        let b_i = random.numbers(sizes[i] * COLUMNS);
        let b_j = random.numbers(sizes[j] * COLUMNS);
        add_product(&mut a, (i, &b_i), (i, &b_i), weight);
        if i != j {
            add_product(&mut a, (j, &b_j), (j, &b_j), weight);
            add_product(&mut a, (j, &b_j), (i, &b_i), weight);
        }
    }
    for (i, &size) in sizes.iter().enumerate() {
        let sigma = random.log_uniform(1e-5, 1e-2);
        let k = a.pattern().column(i).start;
        add_diagonal(a.block_mut(k), size, sigma);
    }
    Ok(finish(a, &format!("definite {shape:?}"), &mut random))
}

/// A quasi-definite system like the KKT matrix [M Jᵀ; J −Σ]: bodies of 3 or 6 rows, constraints of 1 … 7 rows between
/// neighbours, each body just before the first constraint that acts on it. `bits` and errors as above. Allocates.
///
/// # Errors
/// None that these sizes could meet: those of [`BlockPattern::new`].
pub fn quasi_definite(shape: Shape, bits: &mut dyn FnMut() -> u64) -> Result<System, SolveError> {
    let mut random = Random(bits);
    let bodies = 3 + random.below(8);
    let edges = shape.edges(bodies, &mut random);
    let (mut sizes, mut couplings, mut body_block) = (Vec::new(), Vec::new(), vec![None; bodies]);
    let mut is_body = Vec::new();
    for (i, j) in edges {
        let ends = [i, j].map(|body| {
            *body_block[body].get_or_insert_with(|| {
                sizes.push(3 + 3 * random.below(2));
                is_body.push(true);
                sizes.len() - 1
            })
        });
        if sizes.iter().sum::<usize>() + 7 > MOST_ROWS {
            break;
        }
        // No more rows than its bodies have: without Σ they are independent.
        let most = 7.min(sizes[ends[0]] + sizes[ends[1]]);
        sizes.push(1 + random.below(most));
        is_body.push(false);
        couplings.extend(ends.map(|end| (end, sizes.len() - 1)));
    }
    let pattern = BlockPattern::new(&sizes, &couplings)?;
    let mut a = SymBlockMatrix::zeros(Arc::new(pattern));
    for (i, &is_body) in is_body.iter().enumerate() {
        let n = sizes[i];
        let k = a.pattern().column(i).start;
        if is_body {
            let factor = random.numbers(n * 9);
            let mass = random.log_uniform(0.1, 100.0);
            add_product(&mut a, (i, &factor), (i, &factor), mass);
            add_diagonal(a.block_mut(k), n, 0.3 * mass);
            for k in a.pattern().clone().column(i).skip(1) {
                a.block_mut(k).fill_with(|| random.uniform());
            }
        } else {
            let sigma = random.log_uniform(1e-6, 1e-2);
            add_diagonal(a.block_mut(k), n, -sigma);
            for k in a.pattern().clone().column(i).skip(1) {
                a.block_mut(k).fill_with(|| random.uniform());
            }
        }
    }
    Ok(finish(a, &format!("quasi-definite {shape:?}"), &mut random))
}

pub(super) fn finish(a: SymBlockMatrix, name: &str, random: &mut Random<'_>) -> System {
    let sizes: Vec<usize> = (0..a.pattern().blocks())
        .map(|i| a.pattern().size(i))
        .collect();
    let b = random.numbers(a.dim());
    System {
        name: format!("{name} (blocks {sizes:?})"),
        a,
        b,
    }
}

/// Adds w X Yᵀ to the block of two block rows (first ≥ second), X and Y row-major.
fn add_product(a: &mut SymBlockMatrix, x: (usize, &[f64]), y: (usize, &[f64]), w: f64) {
    let (i, j) = (x.0, y.0);
    let p = a.pattern().clone();
    let (m, n) = (p.size(i), p.size(j));
    let columns = x.1.len() / m;
    let Some(k) = p.find(i, j) else {
        return;
    };
    let block = a.block_mut(k);
    for r in 0..m {
        for c in 0..n {
            let (x, y) = (&x.1[r * columns..], &y.1[c * columns..]);
            let product: f64 = x[..columns].iter().zip(y).map(|(x, y)| x * y).sum();
            block[r + m * c] += w * product;
        }
    }
}

fn add_diagonal(block: &mut [f64], n: usize, value: f64) {
    for r in 0..n {
        block[r * (n + 1)] += value;
    }
}
