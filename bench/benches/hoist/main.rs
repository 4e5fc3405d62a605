//! The hoist, hanging at an angle, throughput in joints: `solvers/<backend>/N` is factorisation and solve of its
//! assembled system, `step/hoist/<backend>/N` the whole step from one state, `change/N` a body hooked on to a segment and
//! let go. Parts of the step alone: `kernels`, `assembly`.

mod assembly;
mod kernels;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use taut_integrator::Stepper;
use taut_measure::Choice;
use taut_model::nalgebra::Vector3;
use taut_model::{Body, Constraint, Frame, HoistParams, RowLaw, Scene, Spherical};

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

fn changes(c: &mut Criterion) {
    let choice = Choice::all().into_iter().find(|c| c.check().is_ok());
    let (_, mut stepper) = stepper(&choice.expect("a solver is compiled in"), 400);
    stepper.step().expect("the hoist is stable");
    let law = RowLaw::new(1e-7, 0.0);
    let mut hooked = None;
    c.bench_function("change/400", |bencher| {
        bencher.iter(|| {
            let change = stepper.change(|edit| match hooked.take() {
                Some((body, joint)) => {
                    edit.remove_constraint(joint)?;
                    edit.remove_body(body)?;
                    Ok(None)
                }
                None => {
                    let place = edit.scene().bodies.position[300];
                    let body = edit.add_body("visitor", Body::sphere(0.1, 1.0).at(place));
                    let sides = [300, edit.body_index(body)?];
                    let frames = sides.map(|body| Frame::body(body, Vector3::zeros()));
                    let hook = Spherical {
                        frames,
                        stretch: law,
                    };
                    let joint = edit.add_constraint("hook", Constraint::Spherical(hook), 0);
                    Ok(Some((body, joint)))
                }
            });
            hooked = change.expect("the change is sound");
        });
    });
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

criterion_group!(
    benches,
    kernels::kernels,
    assembly::assembly,
    solvers,
    step,
    changes
);
criterion_main!(benches);
