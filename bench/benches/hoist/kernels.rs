//! `kernels/chain-B/N`: factorisation and solve of a cable with joints of B rows between its N segments, in joints a second.

use criterion::{BenchmarkId, Criterion, Throughput};
use std::hint::black_box;
use taut_solver::Backend;
use taut_studies::kernels::{Case, Joint};

const SEGMENTS: [usize; 3] = [24, 100, 1000];

pub(crate) fn kernels(c: &mut Criterion) {
    let mut group = c.benchmark_group("kernels");
    for (joint, segments) in Joint::ALL
        .into_iter()
        .flat_map(|j| SEGMENTS.map(|n| (j, n)))
    {
        let case = Case::new(joint, segments, 1e3).expect("the hoist has a step");
        let (a, b) = case.schur();
        let joints = a.pattern().blocks() as u64;
        if let Ok(mut solver) = Backend::Banded.create() {
            solver.analyze(a.pattern()).expect("the pattern is sound");
            let mut x = vec![0.0; b.len()];
            group.throughput(Throughput::Elements(joints));
            let id = BenchmarkId::new(format!("chain-{}", joint.rows()), segments);
            group.bench_function(id, |bencher| {
                bencher.iter(|| {
                    solver.factorize(black_box(a)).expect("the matrix is sound");
                    solver
                        .solve(a, black_box(b), &mut x)
                        .expect("the system solves")
                });
            });
        }
    }
    group.finish();
}
