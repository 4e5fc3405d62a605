//! Packs: what is stored of eight joints or bodies at a time, number by number.
//!
//! A kernel takes as many of a pack as it has lanes: all eight where a register holds as many, each half by itself
//! elsewhere. The layout is the same for both.

use taut_lanes::Lanes;

/// Joints or bodies of a pack.
pub const PACK: usize = 8;

/// One number of each joint or body of a pack.
pub type Numbers = [f64; PACK];

/// Numbers of joints or bodies in packs, the last of which is filled up with `padding`.
#[must_use]
pub fn in_packs(numbers: impl Iterator<Item = f64>, padding: f64) -> Vec<Numbers> {
    let mut packs = Vec::new();
    for (k, x) in numbers.enumerate() {
        if k % PACK == 0 {
            packs.push([padding; PACK]);
        }
        packs[k / PACK][k % PACK] = x;
    }
    packs
}

/// True if the numbers of the bodies are consecutive.
pub(crate) fn follow(bodies: &[usize]) -> bool {
    bodies.windows(2).all(|pair| pair[1] == pair[0] + 1)
}

/// A property of a pack and of each of its halves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PerLanes<T> {
    whole: T,
    halves: [T; 2],
}

impl<T> PerLanes<T> {
    /// Evaluates `of` for the whole pack and for each half.
    #[inline(always)]
    pub fn new<U>(pack: &[U; PACK], of: impl Fn(&[U]) -> T) -> Self {
        let (lower, upper) = pack.split_at(PACK / 2);
        Self {
            whole: of(pack),
            halves: [of(lower), of(upper)],
        }
    }

    /// The property of the `L` lanes from `lane` on, a multiple of `L`, which is four or eight.
    #[inline(always)]
    #[must_use]
    pub fn get<const L: usize>(&self, lane: usize) -> &T {
        if L == PACK {
            &self.whole
        } else {
            &self.halves[lane / L % 2]
        }
    }
}

/// The `L` things from `lane` on, a multiple of `L`, which is four or eight.
#[inline(always)]
#[must_use]
pub fn part<T, const L: usize>(pack: &[T; PACK], lane: usize) -> &[T; L] {
    // So written it has no bounds to check.
    &pack.as_chunks().0[lane / L % (PACK / L)]
}

/// Component by component from the `L` lanes of a pack from `lane` on.
#[inline(always)]
#[must_use]
pub fn load_part<V: Lanes, const L: usize, const N: usize>(
    from: &[Numbers; N],
    lane: usize,
) -> [V; N] {
    let mut to = [V::splat(0.0); N];
    for (to, from) in to.iter_mut().zip(from) {
        *to = V::load(part::<_, L>(from, lane));
    }
    to
}

/// The reverse.
#[inline(always)]
pub(crate) fn save_part<V: Lanes, const L: usize, const N: usize>(
    from: &[V; N],
    to: &mut [Numbers; N],
    lane: usize,
) {
    for (from, to) in from.iter().zip(to) {
        from.store(&mut to.as_chunks_mut::<L>().0[lane / L % (PACK / L)]);
    }
}
