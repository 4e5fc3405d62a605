//! The hoist, hanging at an angle, throughput in joints: `solvers/<backend>/N` is factorisation and solve of its
//! assembled system, `step/hoist/<backend>/N` the whole step from one state. Parts of it alone: `kernels`, `assembly`.

mod assembly;
mod kernels;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use taut_ground::Choice;
use taut_integrator::Stepper;
use taut_model::{HoistParams, Scene};

const SEGMENTS: [usize; 5] = [12, 24, 50, 100, 1000];

/// Every compiled solver and size, but for the dense solver where its cubic cost would take minutes.
fn cases() -> impl Iterator<Item = (Choice, usize)> {
    let compiled = Choice::all().into_iter().filter(|c| c.check().is_ok());
    compiled
        .flat_map(|choice| SEGMENTS.map(|n| (choice.clone(), n)))
        .filter(|(choice, n)| choice.backend.name() != "dense" || *n <= 24)
}

fn stepper(choice: &Choice, segments: usize) -> (Scene, Stepper) {
    let params = HoistParams {
        segments,
        initial_angle: 0.3,
        ..HoistParams::default()
    };
    let scene = params.build().expect("the hoist builds");
    let stepper = Stepper::new(scene.clone(), choice.options(1.0 / 60.0));
    (scene, stepper.expect("the solver is compiled in"))
}

fn id(choice: &Choice, segments: usize) -> BenchmarkId {
    BenchmarkId::new(choice.family().replace('/', "-"), segments)
}

fn solvers(c: &mut Criterion) {
    let mut group = c.benchmark_group("solvers");
    for (choice, segments) in cases() {
        let (_, mut stepper) = stepper(&choice, segments);
        stepper.solve().expect("the first step solves");
        let (a, b, x) = stepper.system();
        let mut solver = choice.backend.create().expect("the solver is compiled in");
        solver.analyze(a.pattern()).expect("the pattern is sound");
        let mut solution = x.to_vec();
        group.throughput(Throughput::Elements(segments as u64 + 1));
        group.bench_function(id(&choice, segments), |bencher| {
            bencher.iter(|| {
                solver.factorize(black_box(a)).expect("the matrix is sound");
                solution.fill(0.0);
                solver
                    .solve(a, black_box(b), &mut solution)
                    .expect("the system solves")
            });
        });
    }
    group.finish();
}

fn step(c: &mut Criterion) {
    let mut group = c.benchmark_group("step/hoist");
    for (choice, segments) in cases() {
        let (scene, mut stepper) = stepper(&choice, segments);
        let cold = vec![0.0; stepper.multipliers().len()];
        group.throughput(Throughput::Elements(segments as u64 + 1));
        group.bench_function(id(&choice, segments), |bencher| {
            bencher.iter(|| {
                stepper.set_multipliers(&cold).expect("the rows fit");
                stepper
                    .set_state(&scene.bodies, 0.0)
                    .expect("the state fits");
                stepper.step().expect("the step is taken")
            });
        });
    }
    group.finish();
}

criterion_group!(benches, kernels::kernels, assembly::assembly, solvers, step);
criterion_main!(benches);
