//! `assembly/FORM/N`: matrix and right-hand side of a step from its pieces, by the step's own clock, for the hoist with
//! joints of 6 rows between its N segments.

use criterion::{BenchmarkId, Criterion, Throughput};
use std::time::Duration;
use taut_integrator::{Form, Phase, StepOptions, Stepper};
use taut_measure::Choice;
use taut_solver::Backend;
use taut_studies::kernels::Joint;

const SEGMENTS: [usize; 3] = [24, 100, 1000];

pub(crate) fn assembly(c: &mut Criterion) {
    let mut group = c.benchmark_group("assembly");
    // Without refinement, so that little else is done between two assemblies.
    let forms = [Form::Schur, Form::Kkt].map(|form| (form, backend(form)));
    for (form, backend) in forms {
        for segments in SEGMENTS {
            let hoist = Joint::Cosserat.hoist(segments, 1e3).build();
            let options = StepOptions {
                form,
                refinements: 0,
                ..Choice::schur(backend.clone()).plain_options(1.0 / 60.0)
            };
            let stepper = Stepper::new(hoist.expect("the hoist builds"), options);
            let mut stepper = stepper.expect("the solver is compiled in");
            stepper.solve().expect("the first step solves");
            group.throughput(Throughput::Elements(segments as u64 + 1));
            group.bench_function(BenchmarkId::new(form.to_string(), segments), |bencher| {
                bencher.iter_custom(|count| {
                    let time = |_| {
                        let report = stepper.solve().expect("the step solves");
                        report.phases.of(Phase::Assemble)
                    };
                    (0..count).map(time).sum::<Duration>()
                });
            });
        }
    }
    group.finish();
}

/// The first solver compiled in that takes a form.
fn backend(form: Form) -> Backend {
    let fits = |b: &Backend| b.is_compiled() && (form != Form::Kkt || b.accepts_indefinite());
    let found = Backend::all().into_iter().find(fits);
    found.expect("the dense solver takes all")
}
