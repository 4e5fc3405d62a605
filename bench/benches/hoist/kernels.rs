//! `kernels/chain-B/N`: factorisation and solve of one cable with joints of B rows between its N segments;
//! `kernels/batch-B/N`: of eight of them side by side. Joints a second, of all cables.

use criterion::{BenchmarkId, Criterion, Throughput};
use std::hint::black_box;
use taut_solver::{Backend, BatchBanded, BatchMatrix, batch_index, batch_len};
use taut_studies::kernels::{BATCH, Case, Joint};

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
        let (batch, rhs) = side_by_side(&case);
        let mut x = vec![0.0; rhs.len()];
        let mut solver = BatchBanded::new(a.pattern(), BATCH).expect("the cable is a chain");
        group.throughput(Throughput::Elements(joints * BATCH as u64));
        let id = BenchmarkId::new(format!("batch-{}", joint.rows()), segments);
        group.bench_function(id, |bencher| {
            bencher.iter(|| {
                solver
                    .factorize(black_box(&batch))
                    .expect("the matrices are sound");
                solver
                    .solve(black_box(&rhs), &mut x)
                    .expect("the systems solve");
            });
        });
    }
    group.finish();
}

fn side_by_side(case: &Case) -> (BatchMatrix, Vec<f64>) {
    let pattern = case.schur().0.pattern();
    let dim = pattern.dim();
    let mut a = BatchMatrix::zeros(pattern.clone(), BATCH).expect("eight fit");
    let mut b = vec![0.0; batch_len(dim, BATCH)];
    let systems = case.batch().expect("the hoists have a step");
    for (cable, (matrix, rhs)) in systems.iter().enumerate() {
        a.set(cable, matrix).expect("they have one pattern");
        for (r, value) in rhs.iter().enumerate() {
            b[batch_index(dim, r, cable)] = *value;
        }
    }
    (a, b)
}
