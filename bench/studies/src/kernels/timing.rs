//! Passes in turns, and what they leave: times and errors.

use super::VISIT;
use super::case::{Case, failed, multipliers};
use super::rival::{MANY_SIDES, Rival};
use std::time::{Duration, Instant};
use taut_ground::choice::Choice;
use taut_ground::errors::worse;
use taut_integrator::{Form, StepError, Stepper};
#[cfg(feature = "lapack")]
use taut_rivals::lapack::Band;
use taut_solver::{BackwardError, LinearSolver, SymBlockMatrix, backward_error, forward_error};

/// Least duration of a sample: a thousand times that of reading the clock.
const SAMPLE: Duration = Duration::from_micros(25);

/// Fewest samples of a rival.
pub(super) const LEAST_SAMPLES: usize = 5;

/// Most passes of a sample.
const MOST_PASSES: usize = 10_000;

/// A rival with all that a pass needs.
enum Work<'a> {
    Solver {
        solver: Box<dyn LinearSolver>,
        system: (&'a SymBlockMatrix, &'a [f64]),
        /// The solver starts from `x`.
        iterates: bool,
        form: Form,
        x: Vec<f64>,
    },
    Many {
        solver: Box<dyn LinearSolver>,
        a: &'a SymBlockMatrix,
        /// The first column and its multiples.
        b: Vec<f64>,
        form: Form,
        x: Vec<f64>,
    },
    Refined {
        stepper: Box<Stepper>,
        tension: &'a [f64],
    },
    #[cfg(feature = "lapack")]
    Lapack {
        band: Band,
        system: (&'a SymBlockMatrix, &'a [f64]),
        x: Vec<f64>,
    },
}

impl<'a> Work<'a> {
    fn new(case: &'a Case, rival: &Rival) -> Result<Self, StepError> {
        match rival {
            Rival::Solver(choice) => {
                let (solver, system) = analyzed(case, choice)?;
                Ok(Self::Solver {
                    solver,
                    system,
                    iterates: choice.backend.is_iterative(),
                    form: choice.form,
                    x: vec![0.0; system.1.len()],
                })
            }
            Rival::Many(choice) => {
                let (solver, (a, first)) = analyzed(case, choice)?;
                let multiples = (1..=MANY_SIDES).map(|k| k as f64);
                let b: Vec<f64> = multiples
                    .flat_map(|k| first.iter().map(move |b| k * b))
                    .collect();
                Ok(Self::Many {
                    solver,
                    a,
                    form: choice.form,
                    x: vec![0.0; b.len()],
                    b,
                })
            }
            Rival::Refined(choice) => Ok(Self::Refined {
                stepper: Box::new(case.refining(choice)?),
                tension: case.tension(),
            }),
            #[cfg(feature = "lapack")]
            Rival::Lapack(triangle) => {
                let (a, b) = case.schur();
                Ok(Self::Lapack {
                    band: Band::new(a, *triangle).map_err(failed)?,
                    system: (a, b),
                    x: vec![0.0; b.len()],
                })
            }
            #[cfg(not(feature = "lapack"))]
            Rival::Lapack(_) => Err(failed(super::rival::NO_LAPACK)),
        }
    }

    /// So many passes; their time.
    fn run(&mut self, passes: usize) -> Result<Duration, StepError> {
        let clock = Instant::now();
        match self {
            Self::Solver {
                solver,
                system: (a, b),
                iterates,
                x,
                ..
            } => {
                for _ in 0..passes {
                    solver.factorize(a).map_err(failed)?;
                    if *iterates {
                        x.fill(0.0);
                    }
                    solver.solve(a, b, x).map_err(failed)?;
                }
            }
            Self::Many {
                solver, a, b, x, ..
            } => {
                for _ in 0..passes {
                    solver.factorize(a).map_err(failed)?;
                    x.fill(0.0);
                    solver.solve_many(a, b, x).map_err(failed)?;
                }
            }
            Self::Refined { stepper, tension } => {
                let mut spent = Duration::ZERO;
                for _ in 0..passes {
                    // Each solve leaves another tension, and with it another matrix for the next.
                    stepper.set_tension(tension)?;
                    spent += stepper.solve()?.phases.linear();
                }
                return Ok(spent);
            }
            #[cfg(feature = "lapack")]
            Self::Lapack {
                band,
                system: (_, b),
                x,
            } => {
                let mut spent = Duration::ZERO;
                for _ in 0..passes {
                    // The factor takes the place of the matrix.
                    band.refill();
                    let clock = Instant::now();
                    band.factorize().map_err(failed)?;
                    band.solve(b, x).map_err(failed)?;
                    spent += clock.elapsed();
                }
                return Ok(spent);
            }
        }
        Ok(clock.elapsed())
    }

    /// The errors of the last pass.
    fn errors(&self, case: &Case) -> Result<Errors, StepError> {
        let of = |(a, b): (&SymBlockMatrix, &[f64]), x: &[f64], mu: &[f64]| {
            Ok(Errors {
                backward: backward_error(a, b, x).map_err(failed)?,
                forward: forward_error(mu, case.exact()),
            })
        };
        match self {
            Self::Solver {
                system, form, x, ..
            } => match form {
                Form::Kkt => of(*system, x, &multipliers(system.0, x)),
                _ => of(*system, x, x),
            },
            Self::Many { a, b, form, x, .. } => {
                let dim = a.dim();
                let mu = match form {
                    Form::Kkt => multipliers(a, &x[..dim]),
                    _ => x[..dim].to_vec(),
                };
                let mut errors = of((a, &b[..dim]), &x[..dim], &mu)?;
                for (b, x) in b.chunks(dim).zip(x.chunks(dim)).skip(1) {
                    errors.widen(backward_error(a, b, x).map_err(failed)?);
                }
                Ok(errors)
            }
            Self::Refined { stepper, .. } => {
                let (a, b, x) = stepper.system();
                of((a, b), x, x)
            }
            #[cfg(feature = "lapack")]
            Self::Lapack { system, x, .. } => of(*system, x, x),
        }
    }
}

/// A solver that has analysed its system of a case.
fn analyzed<'a>(case: &'a Case, choice: &Choice) -> Result<Analyzed<'a>, StepError> {
    let mut solver = choice.backend.create().map_err(failed)?;
    let system = match choice.form {
        Form::Kkt => case.kkt(),
        _ => case.schur(),
    };
    solver.analyze(system.0.pattern()).map_err(failed)?;
    Ok((solver, system))
}

type Analyzed<'a> = (Box<dyn LinearSolver>, (&'a SymBlockMatrix, &'a [f64]));

/// How wrong the solution of a pass is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Errors {
    pub(super) backward: BackwardError,
    pub(super) forward: f64,
}

impl Errors {
    /// Takes in the backward error of another solution of the pass.
    fn widen(&mut self, other: BackwardError) {
        let largest = &mut self.backward;
        largest.normwise = worse(largest.normwise, other.normwise);
        largest.componentwise = worse(largest.componentwise, other.componentwise);
    }
}

/// Time of a pass \[ns].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Time {
    pub(super) least: f64,
    pub(super) median: f64,
}

/// A rival on a case with what was measured of it.
pub(super) struct Contestant<'a> {
    /// All that it needs, and its errors; why it cannot, where it failed.
    ready: Result<(Work<'a>, Errors), StepError>,
    /// Passes of a sample.
    passes: usize,
    /// A pass outlasts ten turns, so the state of the caches is irrelevant.
    slow: bool,
    spent: Duration,
    /// Time of a pass in each sample \[ns].
    samples: Vec<f64>,
}

impl<'a> Contestant<'a> {
    /// Prepares it, makes a pass, and finds its errors and how long a pass is.
    pub(super) fn new(case: &'a Case, rival: &Rival) -> Self {
        let mut passes = 1;
        let mut slow = false;
        let ready = Work::new(case, rival).and_then(|mut work| {
            work.run(1)?;
            let errors = work.errors(case)?;
            let time = work.run(1)?;
            slow = time > VISIT * 10;
            passes = (SAMPLE.as_nanos() / time.as_nanos().max(1)) as usize;
            Ok((work, errors))
        });
        Self {
            ready,
            passes: passes.clamp(1, MOST_PASSES),
            slow,
            spent: Duration::ZERO,
            samples: Vec::new(),
        }
    }

    /// A turn.
    fn visit(&mut self) {
        let Ok((work, _)) = &mut self.ready else {
            return;
        };
        let clock = Instant::now();
        let mut turn = || {
            if !self.slow {
                // The others have taken the caches.
                work.run(self.passes)?;
            }
            loop {
                let time = work.run(self.passes)?;
                let pass = time.as_nanos() as f64 / self.passes as f64;
                self.samples.push(pass);
                if clock.elapsed() >= VISIT {
                    return Ok(());
                }
            }
        };
        if let Err(e) = turn() {
            self.ready = Err(e);
        }
        self.spent += clock.elapsed();
    }

    fn is_done(&self) -> bool {
        self.ready.is_err() || self.samples.len() >= LEAST_SAMPLES
    }

    /// Number of samples.
    pub(super) fn samples(&self) -> usize {
        self.samples.len()
    }

    /// Errors and times, or the error that ended it.
    pub(super) fn measured(&self) -> Result<(Errors, Time), &StepError> {
        let (_, errors) = self.ready.as_ref()?;
        Ok((*errors, summary(&self.samples)))
    }
}

fn summary(samples: &[f64]) -> Time {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
    Time {
        least: at(0),
        median: at(sorted.len() / 2),
    }
}

/// Turns, round by round, until each has had its share and enough samples. Who has had more time than the rounds so far
/// waits.
pub(super) fn in_turns(contestants: &mut [Contestant<'_>], share: Duration) {
    let clock = Instant::now();
    let all = share * u32::try_from(contestants.len()).unwrap_or(u32::MAX);
    let mut due = Duration::ZERO;
    while clock.elapsed() < all || !contestants.iter().all(Contestant::is_done) {
        for contestant in contestants.iter_mut() {
            if contestant.spent <= due {
                contestant.visit();
            }
        }
        due += VISIT;
        if contestants.iter().all(|c| c.ready.is_err()) {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::Joint;

    #[test]
    fn a_summary_has_the_least_and_the_median() {
        let time = summary(&[3.0, 1.0, 9.0]);
        assert_eq!((time.least, time.median), (1.0, 3.0));
        assert!(summary(&[]).least.is_nan());
    }

    /// One that fails neither stops the others nor is waited for.
    #[test]
    fn who_fails_is_left_alone() {
        let case = Case::new(Joint::Spherical, 4, 10.0).unwrap();
        let rivals = ["dense", "umfpack", "gauss-seidel:iterations=0"];
        let rivals = rivals.map(|name| name.parse::<Rival>().unwrap());
        let mut contestants = rivals.each_ref().map(|r| Contestant::new(&case, r));
        in_turns(&mut contestants, Duration::ZERO);
        assert!(contestants[0].measured().is_ok());
        assert!(contestants[0].samples() >= LEAST_SAMPLES);
        assert!(contestants[2].measured().is_err());
        in_turns(&mut contestants[2..], Duration::from_secs(3600));
    }
}
