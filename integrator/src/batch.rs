//! Many cables of equal shape: their linear systems are solved together, one in each lane of a vector.
//!
//! Scenes whose systems have the same blocks (the same cable with other loads, states, materials; a fleet; samples of
//! something uncertain) take their steps side by side. All but the solve is what [`Stepper`] does, for each by itself; the
//! matrices of as many as a register holds go to [`BatchBanded`] together, and so do the solves of the refinement. A
//! cable that needs something else than one linear step goes alone for that step: its first one, one that its guard
//! redoes, one with rows that have bounds, one whose system cannot be solved. No cable's result depends on another's but
//! for rounding.
//!
//! That pays for short cables. By itself a cable is eliminated from both ends at once, in half a register of four, and
//! what its step reads stays in the nearest caches; side by side the values must be brought together first. Steps of
//! eight hoists together take 0.88 to 0.91 times what they take one by one with 8 segments, 0.95 to 0.99 with 16, 0.98 to
//! 1 with 24, and 1.02 to 1.06 with 100 (AVX2; 3, 5 and 6 rows a joint). Cables of more than 150 rows go one by one: it
//! began to cost from 160 to 200 on.

use crate::report::{PhaseClock, Work};
use crate::{Form, Phase, StepError, StepOptions, StepReport, Stepper};
use std::ops::Range;
use std::sync::Arc;
use taut_lanes::Level;
use taut_model::Scene;
use taut_solver::{
    BatchBanded, BlockPattern, SymBlockMatrix, batch_get_four, batch_len, batch_set_four,
};

/// Most rows of a cable that goes together with others, measured on four lanes.
const MOST_ROWS: usize = 150;

/// Cables of equal shape that step together.
///
/// Where vectors hold four doubles or more, the systems of cables of at most 150 rows are solved together by
/// [`BatchBanded`]. Longer cables are as fast one by one, and each is solved by the backend of the options.
///
/// ```
/// use taut_integrator::{BatchStepper, StepOptions};
/// use taut_model::HoistParams;
///
/// let loads = [10.0, 100.0, 1e3, 1e4];
/// let scenes = loads.map(|mass_ratio| HoistParams { segments: 12, mass_ratio, ..HoistParams::default() }.build());
/// let scenes = scenes.into_iter().collect::<Result<Vec<_>, _>>()?;
/// let mut batch = BatchStepper::new(scenes, &StepOptions::default())?;
/// for _ in 0..60 {
///     for report in batch.step() {
///         assert!(report.is_ok());
///     }
/// }
/// assert!((batch.cables()[3].time() - 1.0).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct BatchStepper {
    cables: Vec<Stepper>,
    reports: Vec<Result<StepReport, StepError>>,
    /// Where vectors hold enough cables, and those are short enough, to be faster than the two ends of each.
    together: Option<Together>,
}

/// What one cable's step has come to so far.
#[derive(Debug)]
struct Progress {
    work: Work,
    done: Result<(), StepError>,
    /// Whether this sub-step's system waits for the solve of all.
    waits: bool,
}

/// The solver of as many cables as go together, and its numbers.
struct Together {
    solver: BatchBanded,
    /// The matrix of places where no cable waits.
    identity: SymBlockMatrix,
    /// Right-hand sides or residuals, solutions or corrections.
    b: Vec<f64>,
    x: Vec<f64>,
    /// The same of each place.
    each: Vec<Vec<f64>>,
    progress: Vec<Progress>,
}

impl BatchStepper {
    /// Steppers for some scenes, at time 0, with the same options; the backend is that of cables that go alone. Allocates
    /// everything that the steps need.
    ///
    /// # Errors
    /// As for [`Stepper::new`]; [`StepError::NotOneShape`] where there is no scene, the form is not the Schur form, the
    /// backend is matrix-free, a scene's joints are no chain in the order of their elimination, or not the first one's.
    pub fn new(scenes: Vec<Scene>, options: &StepOptions) -> Result<Self, StepError> {
        if options.form != Form::Schur {
            let reason = "is to be solved in the KKT form: use the Schur form";
            return Err(StepError::NotOneShape { cable: 0, reason });
        }
        if options.backend.is_matrix_free() {
            let reason = "is to be solved without its matrix: use another backend";
            return Err(StepError::NotOneShape { cable: 0, reason });
        }
        let new = |scene| Stepper::new(scene, options.clone());
        let mut cables = scenes.into_iter().map(new).collect::<Result<Vec<_>, _>>()?;
        let Some(first) = cables.first() else {
            let reason = "is missing: there is none at all";
            return Err(StepError::NotOneShape { cable: 0, reason });
        };
        let pattern = first.plan.pattern.clone();
        let other = |c: &Stepper| *c.plan.pattern != *pattern;
        if let Some(cable) = cables.iter().position(other) {
            let reason = "is not of the shape of the first one";
            return Err(StepError::NotOneShape { cable, reason });
        }
        for cable in &mut cables {
            cable.plan.pattern = pattern.clone();
        }
        let width = Level::best().widest().clamp(4, 8);
        let pays = Level::best().widest() >= 4 && pattern.dim() <= MOST_ROWS;
        let count = if pays { width } else { 0 };
        let solver = BatchBanded::new(&pattern, count).map_err(|_| StepError::NotOneShape {
            cable: 0,
            reason: "is no chain of joints: use a stepper for each",
        })?;
        let never = |c: &Stepper| c.report(Work::default(), &PhaseClock::start());
        Ok(Self {
            reports: cables.iter().map(|c| Ok(never(c))).collect(),
            cables,
            together: pays.then(|| Together {
                solver,
                identity: identity(&pattern),
                b: vec![0.0; batch_len(pattern.dim(), width)],
                x: vec![0.0; batch_len(pattern.dim(), width)],
                each: vec![vec![0.0; pattern.dim()]; width],
                progress: (0..width).map(|_| Progress::new()).collect(),
            }),
        })
    }

    /// The cables, in the order of their scenes.
    #[must_use]
    pub fn cables(&self) -> &[Stepper] {
        &self.cables
    }

    /// The same, to set states, loads, motors and controls.
    pub fn cables_mut(&mut self) -> &mut [Stepper] {
        &mut self.cables
    }

    /// Advances each cable by one time step, and says what became of it: what [`Stepper::step`] does, where times of
    /// phases are means over the cables that went together. A cable that fails does not hold up the others. Allocates
    /// nothing with the project's own backends where no cable fails.
    pub fn step(&mut self) -> &[Result<StepReport, StepError>] {
        let width = self.together.as_ref().map_or(1, |t| t.progress.len());
        let reports = self.reports.chunks_mut(width);
        for (cables, reports) in self.cables.chunks_mut(width).zip(reports) {
            // Empty places cost as much as filled ones. A stepper that was put here later may be of another shape.
            let fits = |t: &&mut Together| {
                let own = |c: &Stepper| Arc::ptr_eq(&c.plan.pattern, t.identity.pattern());
                2 * cables.len() >= width && cables.iter().all(own)
            };
            match self.together.as_mut().filter(fits) {
                Some(together) => together.step(cables, reports),
                None => {
                    for (cable, report) in cables.iter_mut().zip(reports) {
                        *report = cable.step();
                    }
                }
            }
        }
        &self.reports
    }
}

impl Progress {
    fn new() -> Self {
        Self {
            work: Work::default(),
            done: Ok(()),
            waits: false,
        }
    }
}

impl Together {
    fn step(&mut self, cables: &mut [Stepper], reports: &mut [Result<StepReport, StepError>]) {
        let mut clock = PhaseClock::start();
        let substeps = cables.first().map_or(0, |c| c.options.substeps);
        for (cable, p) in cables.iter_mut().zip(&mut self.progress) {
            *p = Progress::new();
            p.done = cable.begin_step(&mut clock, &mut p.work);
        }
        for _ in 0..substeps {
            for (cable, p) in cables.iter_mut().zip(&mut self.progress) {
                if p.done.is_ok() {
                    p.begin(cable, &mut clock);
                }
            }
            self.solve(cables, &mut clock);
            for (cable, p) in cables.iter_mut().zip(&mut self.progress) {
                if std::mem::take(&mut p.waits) {
                    p.end(cable, &mut clock);
                }
            }
        }
        let phases = clock.times().share(cables.len());
        let steps = cables.iter_mut().zip(&mut self.progress);
        for ((cable, p), report) in steps.zip(reports) {
            let Progress { mut work, done, .. } = std::mem::replace(p, Progress::new());
            let done = done.and_then(|()| cable.weigh(&mut work));
            cable.drop_tension_unless(done.is_ok());
            let refinements = cable.options.refinements;
            *report = done.map(|()| work.report(cable.time, refinements, phases));
        }
    }

    /// Solves the systems of the cables that wait. What cannot be solved no longer waits: it goes alone.
    fn solve(&mut self, cables: &mut [Stepper], clock: &mut PhaseClock) {
        while self.progress.iter().any(|p| p.waits) {
            let Err(failed) = self.try_solve(cables, clock) else {
                return;
            };
            // A fault that is no waiting cable's is everybody's.
            let places = match failed.filter(|&cable| self.progress[cable].waits) {
                Some(cable) => cable..cable + 1,
                None => 0..cables.len(),
            };
            self.go_alone(places, cables, clock);
        }
    }

    /// Solves for some cables, as far as they wait, one by one.
    fn go_alone(&mut self, which: Range<usize>, cables: &mut [Stepper], clock: &mut PhaseClock) {
        let steps = self.progress.iter_mut().zip(cables);
        for (p, cable) in steps.take(which.end).skip(which.start) {
            if std::mem::take(&mut p.waits) {
                p.solve_alone(cable, clock);
            }
        }
    }

    /// Factorises, solves and refines; the place that fails.
    fn try_solve(
        &mut self,
        cables: &mut [Stepper],
        clock: &mut PhaseClock,
    ) -> Result<(), Option<usize>> {
        let Self {
            solver,
            identity,
            b,
            x,
            each,
            progress,
        } = self;
        let matrix = |place: usize| match cables.get(place) {
            Some(cable) if progress[place].waits => &cable.matrix,
            _ => &*identity,
        };
        solver.factorize_each(matrix).map_err(|e| e.cable)?;
        clock.end(Phase::Factorize);
        let sweeps = cables.first().map_or(0, |c| c.options.refinements);
        for sweep in 0..=sweeps {
            for (place, own) in each.iter_mut().enumerate() {
                match cables.get_mut(place).filter(|_| progress[place].waits) {
                    None => own.fill(0.0),
                    Some(cable) if sweep == 0 => own.copy_from_slice(&cable.rhs),
                    Some(cable) => cable.schur_residual(own),
                }
            }
            for (k, four) in each.as_chunks::<4>().0.iter().enumerate() {
                let four = four.each_ref().map(Vec::as_slice);
                batch_set_four(b, 4 * k, four).map_err(|_| None)?;
            }
            solver.solve(b, x).map_err(|e| e.cable)?;
            for (k, four) in each.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                let four = four.each_mut().map(Vec::as_mut_slice);
                batch_get_four(x, 4 * k, four).map_err(|_| None)?;
            }
            let solved = cables.iter_mut().zip(&*each).zip(&*progress);
            for ((cable, own), _) in solved.filter(|(_, p)| p.waits) {
                match sweep {
                    0 => cable.x.copy_from_slice(own),
                    _ => cable.x.iter_mut().zip(own).for_each(|(x, dx)| *x += dx),
                }
            }
            clock.end(if sweep == 0 {
                Phase::Solve
            } else {
                Phase::Refine
            });
        }
        Ok(())
    }
}

/// The identity, in a pattern.
fn identity(pattern: &Arc<BlockPattern>) -> SymBlockMatrix {
    let mut a = SymBlockMatrix::zeros(pattern.clone());
    for j in 0..pattern.blocks() {
        let diagonal = a.block_mut(pattern.column(j).start);
        diagonal
            .iter_mut()
            .step_by(pattern.size(j) + 1)
            .for_each(|d| *d = 1.0);
    }
    a
}

impl Progress {
    /// Prepares the next sub-step, or takes it where it is none for all together.
    fn begin(&mut self, cable: &mut Stepper, clock: &mut PhaseClock) {
        if cable.holding > 0 || !cable.bounded.is_empty() {
            self.done = cable.take_substep(clock, &mut self.work);
            return;
        }
        if cable.options.guard.is_some() {
            cable.begin_guarded();
        }
        if let Err(e) = cable.prepare(cable.options.stiffness) {
            self.finish(cable, Err(e), clock);
            return;
        }
        clock.end(Phase::Linearize);
        cable.assemble(cable.substep());
        self.waits = true;
        clock.end(Phase::Assemble);
    }

    /// The prepared system by the cable's own solver.
    fn solve_alone(&mut self, cable: &mut Stepper, clock: &mut PhaseClock) {
        let dt = cable.substep();
        let solved = cable.solve_prepared(dt, clock, &mut self.work);
        self.finish(cable, solved, clock);
    }

    /// What comes after the solve of all.
    fn end(&mut self, cable: &mut Stepper, clock: &mut PhaseClock) {
        self.work.add_direct();
        cable.take_multipliers();
        let dt = cable.substep();
        cable.solved_for(dt);
        self.finish(cable, Ok(()), clock);
    }

    fn finish(
        &mut self,
        cable: &mut Stepper,
        solved: Result<(), StepError>,
        clock: &mut PhaseClock,
    ) {
        self.done = match cable.options.guard {
            None => solved.and_then(|()| cable.end_plain(clock)),
            Some(guard) => cable.end_guarded(guard, solved, clock, &mut self.work),
        };
    }
}

#[cfg(all(test, feature = "banded"))]
mod tests;
