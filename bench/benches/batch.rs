//! Hoists of different loads, hanging at an angle, in steps of all: `step/batch/N` with [`BatchStepper`],
//! `step/one-by-one/N` each with its own stepper. Throughput in joints.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use taut_integrator::{BatchStepper, StepOptions, Stepper};
use taut_model::{HoistParams, Scene};

const CABLES: usize = 8;
const SEGMENTS: [usize; 4] = [8, 16, 24, 100];

fn scenes(segments: usize) -> Vec<Scene> {
    let one = |i: usize| {
        let params = HoistParams {
            segments,
            mass_ratio: 100.0 * (1 + i) as f64,
            initial_angle: 0.3,
            ..HoistParams::default()
        };
        params.build().expect("the hoist builds")
    };
    (0..CABLES).map(one).collect()
}

fn batch(c: &mut Criterion) {
    let mut group = c.benchmark_group("step");
    for segments in SEGMENTS {
        let (scenes, options) = (scenes(segments), StepOptions::default());
        group.throughput(Throughput::Elements((CABLES * (segments + 1)) as u64));
        let one = |s: &Scene| Stepper::new(s.clone(), options.clone()).expect("a stepper");
        let mut ones: Vec<_> = scenes.iter().map(one).collect();
        group.bench_function(BenchmarkId::new("one-by-one", segments), |bencher| {
            bencher.iter(|| {
                for one in &mut ones {
                    one.step().expect("the step is taken");
                }
            });
        });
        let mut batch = BatchStepper::new(scenes, &options).expect("hoists are of one shape");
        group.bench_function(BenchmarkId::new("batch", segments), |bencher| {
            bencher.iter(|| assert!(batch.step().iter().all(Result::is_ok)));
        });
    }
    group.finish();
}

criterion_group!(benches, batch);
criterion_main!(benches);
