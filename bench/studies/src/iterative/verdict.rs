//! Where iterations win: what the rows say, for each error and start.

use super::{Record, Start};

/// Result for one error and start: the cases where iterations win.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    pub target: f64,
    pub start: Start,
    /// Cases whose start is not within the error already.
    pub cases: usize,
    /// Rows faster than the direct solver, the fastest of each case, the largest gain first.
    pub wins: Vec<Record>,
    /// The row that loses least if none wins.
    pub nearest: Option<Record>,
}

/// A verdict for each start and error.
#[must_use]
pub fn verdicts(records: &[Record]) -> Vec<Verdict> {
    let mut targets: Vec<f64> = records.iter().map(|r| r.target).collect();
    targets.sort_by(|a, b| b.total_cmp(a));
    targets.dedup();
    let mut verdicts = Vec::new();
    for start in Start::ALL {
        for &target in &targets {
            let of = |r: &&Record| r.start == Some(start) && r.target == target;
            let (mut fastest, mut cases) = (Vec::new(), 0);
            let scene = |r: &Record| (r.scene.clone(), r.size, r.mass_ratio.to_bits());
            for case in records.chunk_by(|a, b| scene(a) == scene(b)) {
                let own: Vec<&Record> = case.iter().filter(of).collect();
                cases += usize::from(own.iter().any(|r| r.iterations != Some(0)));
                let reached = own.into_iter().filter(|r| r.gain().is_some());
                fastest.extend(
                    reached
                        .max_by(|a, b| {
                            a.gain()
                                .partial_cmp(&b.gain())
                                .unwrap_or(std::cmp::Ordering::Equal)
                        })
                        .cloned(),
                );
            }
            fastest.sort_by(|a, b| {
                b.gain()
                    .partial_cmp(&a.gain())
                    .unwrap_or(std::cmp::Ordering::Equal)
            });
            let nearest = fastest.first().cloned();
            let wins: Vec<Record> = fastest
                .into_iter()
                .filter(|r| r.gain() > Some(1.0))
                .collect();
            verdicts.push(Verdict {
                target,
                start,
                cases,
                nearest: nearest.filter(|_| wins.is_empty()),
                wins,
            });
        }
    }
    verdicts
}
