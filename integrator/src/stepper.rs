//! The step, [SL Algorithm 1] for one group: linearise, assemble, factorise, solve, refine, update. Where the guard finds
//! that the linearisation did not hold, [`crate::guarded`] redoes it.

use crate::bounded::{Bounded, Verdict};
use crate::elimination::{self, EliminationOrder};
use crate::history::{History, State};
use crate::matrix_free::{self, MatrixFree};
use crate::pieces::Pieces;
use crate::plan::{BlockOf, Plan};
use crate::products::times_jacobian;
use crate::report::{PhaseClock, Work};
use crate::{
    Form, GeometricStiffness, Phase, StepError, StepOptions, StepReport, equilibrium, motion,
};
use nalgebra::Vector3;
use taut_model::{Constraint, Scene};
use taut_solver::{LinearSolver, RefineScratch, SolveError, SolveReport, SymBlockMatrix};

/// A scene in motion: its state, its linear system and the solver.
pub struct Stepper {
    pub(crate) scene: Scene,
    pub(crate) options: StepOptions,
    pub(crate) time: f64,
    pub(crate) solver: Box<dyn LinearSolver>,
    pub(crate) elimination: EliminationOrder,
    pub(crate) plan: Plan,
    pub(crate) matrix: SymBlockMatrix,
    /// Right-hand side and solution of the linear system, length `matrix.dim()`.
    pub(crate) rhs: Vec<f64>,
    pub(crate) x: Vec<f64>,
    scratch: RefineScratch,
    /// Where the backend does without S.
    pub(crate) matrix_free: Option<MatrixFree>,
    /// Multipliers and a residual in the order of the scene's rows.
    pub(crate) in_rows: [Vec<f64>; 2],
    /// `pieces.rows` is the linearisation of the present state, but for ∂φ/∂t, which is the last step's.
    pub(crate) pieces: Pieces,
    /// Which rows are at their bounds.
    pub(crate) bounded: Bounded,
    pub(crate) history: History,
    /// Impulses μ = Δt λ of the last solve, one a row.
    pub(crate) mu: Vec<f64>,
    /// Length of the step that `mu` belongs to \[s].
    pub(crate) mu_dt: f64,
    /// λ that the geometric stiffness is made of, one a row \[N, N m].
    pub(crate) tension: Vec<f64>,
    /// Whether `tension` is that of some solve, and whether the first step has begun.
    pub(crate) tension_known: bool,
    pub(crate) started: bool,
    /// Whether `mu` belongs to the present state, which then may be advanced.
    pub(crate) solved: bool,
    /// Length of the sub-step that led to the present state and that `pieces` still hold; 0 for none \[s].
    pub(crate) advanced: f64,
    /// Steps that the guard still takes implicitly.
    pub(crate) holding: usize,
    /// States at the beginning of the step and of its sub-step.
    pub(crate) step_start: State,
    pub(crate) substep_start: State,
}

impl Stepper {
    /// A stepper for a scene, at time 0. Allocates everything that the steps need, but for what libraries allocate. A
    /// scene that asks for its static equilibrium is put there.
    ///
    /// # Errors
    /// An invalid scene or option, a backend that is not compiled in or does not take the form, no equilibrium.
    pub fn new(mut scene: Scene, options: StepOptions) -> Result<Self, StepError> {
        scene.validate()?;
        options.validate()?;
        if std::mem::take(&mut scene.start_in_equilibrium) {
            scene = equilibrium::static_equilibrium(scene, &options.backend)?;
        }
        let at_start = |source| StepError::Solve {
            source,
            culprit: None,
            time: 0.0,
        };
        let mut pieces = Pieces::new(&scene);
        elimination::check_size(&scene, &pieces.rows)?;
        let elimination =
            elimination::order_of(options.elimination, &scene, &pieces.rows, &options.backend)
                .map_err(at_start)?;
        let order = &elimination.constraints;
        let kept = matrix_free::kept(&options.backend, &scene);
        let plan = Plan::new(options.form, &scene, &pieces.rows, order, kept).map_err(at_start)?;
        let mut solver = options.backend.create().map_err(at_start)?;
        solver.analyze(&plan.pattern).map_err(at_start)?;
        pieces.rows.update(&scene, 0.0);
        let (dim, rows) = (plan.pattern.dim(), pieces.rows.rows());
        let dt = options.dt / options.substeps as f64;
        pieces.rows.drive(&scene, -dt, 0.0);
        let mut history = History::new(rows, scene.bodies.len());
        history.forget(&pieces.rows.phi_t);
        let state = State::new(&scene.bodies, rows);
        Ok(Self {
            time: 0.0,
            solver,
            matrix: SymBlockMatrix::zeros(plan.pattern.clone()),
            rhs: vec![0.0; dim],
            x: vec![0.0; dim],
            scratch: RefineScratch::new(dim),
            matrix_free: MatrixFree::new(&options.backend, &pieces),
            in_rows: [vec![0.0; rows], vec![0.0; rows]],
            history,
            mu: vec![0.0; rows],
            mu_dt: dt,
            tension: vec![0.0; rows],
            tension_known: false,
            started: false,
            solved: false,
            advanced: 0.0,
            holding: 0,
            step_start: state.clone(),
            substep_start: state,
            bounded: Bounded::new(&pieces),
            pieces,
            elimination,
            plan,
            scene,
            options,
        })
    }

    /// Length of a sub-step \[s].
    pub(crate) fn substep(&self) -> f64 {
        self.options.dt / self.options.substeps as f64
    }

    /// Advances the scene by one time step. Allocates nothing with the project's own backends.
    ///
    /// # Errors
    /// [`StepError::Solve`] (the state is then that at the beginning of the sub-step) and [`StepError::NonFinite`].
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        let mut clock = PhaseClock::start();
        let mut work = Work::default();
        let done = self.whole_step(&mut clock, &mut work);
        self.drop_tension_unless(done.is_ok());
        done.map(|()| self.report(work, &clock))
    }

    fn whole_step(&mut self, clock: &mut PhaseClock, work: &mut Work) -> Result<(), StepError> {
        self.begin_step(clock, work)?;
        for _ in 0..self.options.substeps {
            self.take_substep(clock, work)?;
        }
        Ok(())
    }

    /// What comes before a step's sub-steps.
    pub(crate) fn begin_step(
        &mut self,
        clock: &mut PhaseClock,
        work: &mut Work,
    ) -> Result<(), StepError> {
        if self.started {
            self.find_tension(clock, work)
        } else {
            self.start(clock, work)
        }
    }

    pub(crate) fn take_substep(
        &mut self,
        clock: &mut PhaseClock,
        work: &mut Work,
    ) -> Result<(), StepError> {
        match self.options.guard {
            None => self.plain_step(clock, work),
            Some(guard) => self.guarded_step(guard, clock, work),
        }
    }

    /// What led to a failure may be of any size: the next solve finds its tension anew, and starts from zero.
    pub(crate) fn drop_tension_unless(&mut self, good: bool) {
        if !good {
            self.tension_known = false;
            self.mu.fill(0.0);
        }
    }

    pub(crate) fn report(&self, work: Work, clock: &PhaseClock) -> StepReport {
        work.report(self.time, self.options.refinements, clock.times())
    }

    pub(crate) fn plain_step(
        &mut self,
        clock: &mut PhaseClock,
        work: &mut Work,
    ) -> Result<(), StepError> {
        self.solve_scheme(self.options.stiffness, clock, work)?;
        self.end_plain(clock)
    }

    /// What comes after the solve of a sub-step without guard.
    pub(crate) fn end_plain(&mut self, clock: &mut PhaseClock) -> Result<(), StepError> {
        self.advance()?;
        clock.end(Phase::Update);
        Ok(())
    }

    /// The first half of a sub-step: solves for the impulses of the present state, which stays as it is. With
    /// [`advance`](Self::advance) after it this is an unguarded [`step`](Self::step) without its sub-steps.
    ///
    /// # Errors
    /// [`StepError::Solve`].
    pub fn solve(&mut self) -> Result<StepReport, StepError> {
        let mut clock = PhaseClock::start();
        let mut work = Work::default();
        let found = self.find_tension(&mut clock, &mut work);
        let done =
            found.and_then(|()| self.solve_scheme(self.options.stiffness, &mut clock, &mut work));
        self.drop_tension_unless(done.is_ok());
        done.map(|()| self.report(work, &clock))
    }

    /// A solve without geometric stiffness, where there are no multipliers to make it of.
    pub(crate) fn find_tension(
        &mut self,
        clock: &mut PhaseClock,
        work: &mut Work,
    ) -> Result<(), StepError> {
        if self.options.stiffness == GeometricStiffness::Off || self.tension_known {
            return Ok(());
        }
        self.solve_scheme(GeometricStiffness::Off, clock, work)
    }

    /// What comes before the first step: the multipliers of the starting state, for the geometric stiffness; and
    /// velocities half a step back for the schemes that keep them there, v_0 − (Δt/2) a_0.
    fn start(&mut self, clock: &mut PhaseClock, work: &mut Work) -> Result<(), StepError> {
        self.find_tension(clock, work)?;
        if self.options.scheme.is_staggered() {
            self.solve_scheme(self.options.stiffness, clock, work)?;
            self.pieces.update_velocity_change(&self.mu);
            let bodies = &mut self.scene.bodies;
            for i in 0..bodies.len() {
                let [x, y, z, p, q, r] = self.pieces.dv.get(i);
                bodies.velocity[i] -= Vector3::new(x, y, z) * 0.5;
                bodies.angular_velocity[i] -= Vector3::new(p, q, r) * 0.5;
            }
        }
        self.solved = false;
        self.started = true;
        Ok(())
    }

    /// Solves the scheme's linear system at the present state.
    pub(crate) fn solve_scheme(
        &mut self,
        stiffness: GeometricStiffness,
        clock: &mut PhaseClock,
        work: &mut Work,
    ) -> Result<(), StepError> {
        self.prepare(stiffness)?;
        clock.end(Phase::Linearize);
        self.solve_prepared(self.substep(), clock, work)
    }

    /// M̃, Δt f, Σ and c of the scheme at the present state.
    pub(crate) fn prepare(&mut self, stiffness: GeometricStiffness) -> Result<(), StepError> {
        self.solved = false;
        self.advanced = 0.0;
        let dt = self.substep();
        let (pieces, history) = (&mut self.pieces, &mut self.history);
        pieces.load_velocities(&self.scene.bodies);
        // r_n: the driven part is that of the step that led here.
        let jv = &mut self.in_rows[0];
        times_jacobian(&pieces.rows, &pieces.v, jv);
        for (rate, (jv, phi_t)) in history
            .rate_now
            .iter_mut()
            .zip(jv.iter().zip(&history.phi_t))
        {
            *rate = jv + phi_t;
        }
        if !history.known {
            history.rate.copy_from_slice(&history.rate_now);
            history.v.copy_from(&pieces.v);
        }
        pieces.weigh(&self.options.row_weights(stiffness));
        let (now, before) = (&history.rate_now, &history.rate);
        pieces
            .regularization
            .combine_rates(now, before, &mut pieces.known);
        pieces.rows.drive(&self.scene, self.time, self.time + dt);
        let stiff = stiffness != GeometricStiffness::Off;
        pieces.soften_transverse_rows(&self.tension, stiff);
        pieces.regularize(dt, jv);
        let gamma = self.options.scheme.weights().history();
        match stiffness {
            GeometricStiffness::Off => pieces.geometric.clear(),
            _ => pieces.geometric.update(&pieces.rows, &self.tension),
        }
        if matches!(stiffness, GeometricStiffness::Relative { .. }) {
            pieces.geometric.update_chords(&self.scene, self.time, dt);
        }
        let (now, before) = (&pieces.v, &history.v);
        pieces
            .geometric
            .drive(stiffness, gamma, now, before, &mut pieces.drive);
        self.update_inertia(dt, stiffness.alpha())
    }

    pub(crate) fn update_inertia(&mut self, dt: f64, alpha: f64) -> Result<(), StepError> {
        let Pieces {
            inertia,
            geometric,
            drive,
            ..
        } = &mut self.pieces;
        inertia
            .update(&self.scene, dt, geometric.stiffness(), alpha, drive)
            .map_err(|i| self.not_finite(i))
    }

    pub(crate) fn not_finite(&self, body: usize) -> StepError {
        StepError::NonFinite {
            body: self.scene.body_names[body].clone(),
            time: self.time,
        }
    }

    /// Assembles, factorises, solves and refines the system of the pieces, for a step `dt` long: once, or until all rows
    /// with bounds keep them.
    pub(crate) fn solve_prepared(
        &mut self,
        dt: f64,
        clock: &mut PhaseClock,
        work: &mut Work,
    ) -> Result<(), StepError> {
        self.bounded.begin();
        loop {
            self.bounded.hold(&mut self.pieces, dt);
            let solved = self.solve_once(dt, clock, work);
            self.bounded.release(&mut self.pieces);
            solved?;
            let verdict = self.bounded.judge(&mut self.pieces, &mut self.mu, dt);
            work.undecided += usize::from(verdict == Verdict::Undecided);
            if verdict != Verdict::Changed {
                break;
            }
        }
        self.solved_for(dt);
        Ok(())
    }

    /// `mu` is the solution of the present state's system for a step `dt` long.
    pub(crate) fn solved_for(&mut self, dt: f64) {
        self.mu_dt = dt;
        let frequency = 1.0 / dt;
        for (tension, mu) in self.tension.iter_mut().zip(&self.mu) {
            *tension = mu * frequency;
        }
        self.tension_known = true;
        self.solved = true;
    }

    /// One linear system: μ of all rows as if none had bounds.
    fn solve_once(
        &mut self,
        dt: f64,
        clock: &mut PhaseClock,
        work: &mut Work,
    ) -> Result<(), StepError> {
        self.assemble(dt);
        clock.end(Phase::Assemble);
        self.solver
            .factorize(&self.matrix)
            .map_err(|e| self.culprit(e))?;
        clock.end(Phase::Factorize);
        let report = self.solve_factorized().map_err(|e| self.culprit(e))?;
        clock.end(Phase::Solve);
        let refined = self.refine().map_err(|e| self.culprit(e))?;
        clock.end(Phase::Refine);
        work.add(report, refined);
        self.take_multipliers();
        Ok(())
    }

    fn solve_factorized(&mut self) -> Result<SolveReport, SolveError> {
        let Self {
            solver,
            matrix,
            rhs,
            x,
            pieces,
            plan,
            ..
        } = self;
        match &mut self.matrix_free {
            None => solver.solve(matrix, rhs, x),
            Some(free) => free.solve(&mut **solver, (plan, pieces), matrix, rhs, x),
        }
    }

    /// `mu` from the solution `x`.
    pub(crate) fn take_multipliers(&mut self) {
        let sign = self.multiplier_sign();
        self.plan
            .scatter_multipliers(&self.pieces.rows, &self.x, sign, &mut self.mu);
    }

    /// The matrix, the right-hand side, and the guess in `x`.
    pub(crate) fn assemble(&mut self, dt: f64) {
        let Pieces {
            rows,
            inertia,
            regularization,
            ..
        } = &self.pieces;
        self.plan
            .fill(rows, inertia, regularization, &mut self.matrix);
        let sign = self.multiplier_sign();
        if dt != self.mu_dt {
            // The same forces over another time.
            let factor = dt / self.mu_dt;
            self.mu.iter_mut().for_each(|mu| *mu *= factor);
            self.mu_dt = dt;
        }
        match self.options.form {
            Form::Schur => {
                if self.plan.in_scene_order {
                    self.pieces.free_residual(&mut self.rhs);
                } else {
                    let [residual, _] = &mut self.in_rows;
                    self.pieces.free_residual(residual);
                    let rows = &self.pieces.rows;
                    self.plan.gather(rows, None, residual, 1.0, &mut self.rhs);
                }
                let rows = &self.pieces.rows;
                self.plan.gather(rows, None, &self.mu, 1.0, &mut self.x);
            }
            Form::Kkt => {
                let Pieces {
                    rows,
                    inertia,
                    rate,
                    dv,
                    ..
                } = &self.pieces;
                self.plan
                    .gather(rows, Some(&inertia.impulse), rate, 1.0, &mut self.rhs);
                self.plan
                    .gather(rows, Some(dv), &self.mu, sign, &mut self.x);
            }
        }
        if !self.options.warm_start {
            self.x.fill(0.0);
        }
    }

    /// The report of the last refinement, if there was one, with the iterations of all.
    fn refine(&mut self) -> Result<Option<SolveReport>, SolveError> {
        let Self {
            solver,
            matrix,
            rhs,
            x,
            scratch,
            pieces,
            plan,
            matrix_free,
            in_rows: [mu, residual],
            ..
        } = self;
        let sweeps = self.options.refinements;
        if let Some(free) = matrix_free {
            return free.refine(&mut **solver, (plan, pieces), matrix, x, sweeps);
        }
        match self.options.form {
            Form::Schur => {
                taut_solver::refine(&mut **solver, matrix, x, scratch, sweeps, |x, r| {
                    schur_residual(plan, pieces, x, [mu, residual], r);
                })
            }
            Form::Kkt => taut_solver::refine(&mut **solver, matrix, x, scratch, sweeps, |x, r| {
                matrix.subtract_product(rhs, x, r);
            }),
        }
    }

    /// The residual of the Schur form at `x` from the pieces.
    pub(crate) fn schur_residual(&mut self, r: &mut [f64]) {
        let [mu, residual] = &mut self.in_rows;
        schur_residual(&self.plan, &mut self.pieces, &self.x, [mu, residual], r);
    }

    /// The second half of a sub-step: velocities from the impulses of the last [`solve`](Self::solve), then positions.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`] in [`StepError::Solve`] without a solve of the present state, and
    /// [`StepError::NonFinite`]; the state is then not to be used.
    pub fn advance(&mut self) -> Result<(), StepError> {
        let done = self.advance_unwound();
        self.drop_tension_unless(done.is_ok());
        done?;
        self.accept();
        Ok(())
    }

    /// The present state is not taken back any more: angles are followed through their turns, and drums that slipped
    /// have paid out.
    pub(crate) fn accept(&mut self) {
        let rows = &mut self.pieces.rows;
        rows.follow_windings(&mut self.scene, self.time);
        let mut slipped = false;
        for bound in self.bounded.at_lower().map(|k| rows.bounds[k]) {
            let constraint = &mut self.scene.constraints[bound.constraint];
            if let Constraint::MasslessCable(cable) = constraint {
                let paid = cable.settle(rows.phi[bound.row], self.time);
                // The step took the cable to be as long as the winch alone would have it.
                self.history.phi_t[bound.row] -= paid / self.advanced;
                slipped |= paid > 0.0;
            }
        }
        if slipped {
            self.pieces.rows.update_state(&self.scene, self.time);
        }
    }

    /// [`advance`](Self::advance) that leaves the windings of twist rows, so that it can be taken back.
    pub(crate) fn advance_unwound(&mut self) -> Result<(), StepError> {
        if !std::mem::take(&mut self.solved) {
            let source = SolveError::OutOfOrder {
                called: "advance",
                needs: "solve",
            };
            return Err(self.culprit(source));
        }
        self.started = true;
        let dt = self.substep();
        self.pieces.update_velocity_change(&self.mu);
        self.pieces.predict(dt);
        self.history.accept(&self.pieces.v, &self.pieces.rows.phi_t);
        self.time += dt;
        self.move_bodies(dt)?;
        self.advanced = dt;
        self.pieces.rows.update_state(&self.scene, self.time);
        Ok(())
    }

    /// v⁺ = v + Δv from `pieces`, then positions, over `dt`.
    pub(crate) fn move_bodies(&mut self, dt: f64) -> Result<(), StepError> {
        let Pieces { inertia, v, dv, .. } = &self.pieces;
        let bodies = &mut self.scene.bodies;
        motion::move_bodies(bodies, &inertia.rods, &inertia.others, v, dv, dt)
            .map_err(|i| self.not_finite(i))
    }

    /// Takes back what [`advance_unwound`](Self::advance_unwound) did since `saved`.
    pub(crate) fn go_back(&mut self, saved: &State) {
        self.time = saved.restore(&mut self.scene.bodies);
        self.mu_dt = saved.restore_multipliers(&mut self.mu, &mut self.tension);
        self.solved = false;
        self.advanced = 0.0;
        self.pieces.rows.update_state(&self.scene, self.time);
    }

    /// The unknown of the symmetric KKT form is −μ.
    fn multiplier_sign(&self) -> f64 {
        match self.options.form {
            Form::Schur => 1.0,
            Form::Kkt => -1.0,
        }
    }

    /// A solver's error with its block's name.
    fn culprit(&self, source: SolveError) -> StepError {
        let block = match &source {
            SolveError::Singular { block }
            | SolveError::NotPositiveDefinite { block }
            | SolveError::NonFinite { block, .. } => Some(*block),
            _ => None,
        };
        let name = |b: usize| match self.plan.block.get(b)? {
            BlockOf::Body(i) => self.scene.body_names.get(*i),
            BlockOf::Constraint(c) => self.scene.constraint_names.get(*c),
        };
        StepError::Solve {
            culprit: block.and_then(name).cloned(),
            source,
            time: self.time,
        }
    }
}

/// The residual of the Schur form at `x` from the pieces, into `r`; `mu` and `residual` are one number a row.
fn schur_residual(
    plan: &Plan,
    pieces: &mut Pieces,
    x: &[f64],
    [mu, residual]: [&mut [f64]; 2],
    r: &mut [f64],
) {
    if plan.in_scene_order {
        return pieces.residual(x, r);
    }
    plan.scatter_multipliers(&pieces.rows, x, 1.0, mu);
    pieces.residual(mu, residual);
    plan.gather(&pieces.rows, None, residual, 1.0, r);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;
    use taut_model::{Body, Constraint, Frame, Motion, RowLaw, Spherical};

    const DT: f64 = 1.0 / 60.0;

    fn options(form: Form) -> StepOptions {
        let dense = taut_solver::Backend::Dense(taut_solver::DenseOptions::default());
        StepOptions {
            dt: DT,
            form,
            backend: dense,
            ..StepOptions::paper()
        }
    }

    /// A body of 2 kg at `x` held at its centre to the world's origin, without gravity.
    fn held(x: Vector3<f64>, law: RowLaw, motion: Motion) -> Scene {
        let mut scene = Scene::new("held");
        scene.gravity = Vector3::zeros();
        let body = scene.add_body("ball", Body::sphere(0.1, 2.0).at(x));
        let world = Frame::world(Vector3::zeros()).moving(motion);
        let frames = [world, Frame::body(body, Vector3::zeros())];
        scene.add_constraint(
            "spring",
            Constraint::Spherical(Spherical {
                frames,
                stretch: law,
            }),
            0,
        );
        scene
    }

    #[test]
    fn a_free_body_falls_as_symplectic_euler_says() {
        let mut scene = Scene::new("free");
        scene.gravity = Vector3::new(0.0, 0.0, -10.0);
        scene.add_body("ball", Body::sphere(0.1, 2.0));
        for form in [Form::Schur, Form::Kkt] {
            let mut stepper = Stepper::new(scene.clone(), options(form)).unwrap();
            for n in 1..=60 {
                stepper.step().unwrap();
                let exact = -10.0 * DT * DT * f64::from(n * (n + 1)) / 2.0;
                assert!((stepper.scene().bodies.position[0].z - exact).abs() < 1e-13);
            }
        }
    }

    /// The step is implicit Euler on a deformation mode of frequency ω: eigenvalues (1 ± iωΔt)/(1 + ω²Δt²), so that
    /// with determinants of three consecutive amplitudes their squared modulus is 1/(1 + ω²Δt²) to rounding.
    #[test]
    fn a_deformation_mode_is_damped_by_its_law() {
        let (mass, compliance) = (2.0_f64, 1e-3_f64);
        let scene = held(
            Vector3::new(0.01, 0.0, 0.0),
            RowLaw::new(compliance, 0.0),
            Motion::Fixed,
        );
        for form in [Form::Schur, Form::Kkt] {
            let mut stepper = Stepper::new(scene.clone(), options(form)).unwrap();
            let mut x = vec![0.01];
            for _ in 0..8 {
                stepper.step().unwrap();
                x.push(stepper.scene().bodies.position[0].x);
            }
            let law = 1.0 / (1.0 + DT * DT / (mass * compliance));
            for w in x.windows(4) {
                let ratio = (w[2] * w[2] - w[3] * w[1]) / (w[1] * w[1] - w[2] * w[0]);
                assert!((ratio / law - 1.0).abs() < 1e-10, "{form}: {ratio} {law}");
            }
        }
    }

    /// τ turns a gap without inertia in the way into an exponential: φ⁺ = φ/(1 + Δt/τ) for ε = 0.
    #[test]
    fn a_gap_relaxes_with_its_damping_time() {
        let tau = 0.1;
        let scene = held(
            Vector3::new(0.0, 0.02, 0.0),
            RowLaw::new(0.0, tau),
            Motion::Fixed,
        );
        let mut stepper = Stepper::new(scene, options(Form::Schur)).unwrap();
        let mut exact = 0.02;
        for _ in 0..20 {
            stepper.step().unwrap();
            exact /= 1.0 + DT / tau;
            assert!((stepper.scene().bodies.position[0].y - exact).abs() < 1e-15);
        }
    }

    #[test]
    fn a_rigid_row_follows_a_moving_anchor_without_lag() {
        let displacement = Vector3::new(0.5, -0.2, 0.1);
        let motion = Motion::Smooth {
            displacement,
            start: 0.1,
            duration: 0.5,
        };
        let scene = held(Vector3::zeros(), RowLaw::RIGID, motion);
        for form in [Form::Schur, Form::Kkt] {
            let mut stepper = Stepper::new(scene.clone(), options(form)).unwrap();
            for _ in 0..60 {
                stepper.step().unwrap();
                let anchor = motion.displacement(stepper.time());
                assert!((stepper.scene().bodies.position[0] - anchor).norm() < 1e-14);
            }
            assert_eq!(motion.displacement(stepper.time()), displacement);
        }
    }

    #[test]
    fn a_spin_about_a_principal_axis_turns_by_its_angle() {
        let mut scene = Scene::new("top");
        scene.gravity = Vector3::zeros();
        let mut body = Body::new(1.0, Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 3.0)));
        body.angular_velocity = Vector3::new(0.0, 0.0, 2.0);
        scene.add_body("top", body);
        let mut stepper = Stepper::new(scene, options(Form::Schur)).unwrap();
        for _ in 0..60 {
            stepper.step().unwrap();
        }
        let turned = stepper.scene().bodies.orientation[0].scaled_axis();
        assert!(
            (turned - Vector3::new(0.0, 0.0, 2.0)).norm() < 1e-13,
            "{turned}"
        );
    }

    #[test]
    fn a_failed_solve_names_the_constraint() {
        let mut scene = held(Vector3::zeros(), RowLaw::RIGID, Motion::Fixed);
        let again = scene.constraints[0].clone();
        scene.add_constraint("again", again, 0);
        let error = Stepper::new(scene, options(Form::Schur))
            .unwrap()
            .step()
            .unwrap_err();
        assert!(error.to_string().contains("`again`"), "{error}");
    }

    /// A hanging cable, and a stepper on it with the default scheme and stiffness.
    fn hanging(guard: Option<crate::Guard>) -> Stepper {
        let params = taut_model::HoistParams {
            segments: 3,
            seed: 1,
            // A twist row would remember the turns of a motion that is lost.
            twist: Some(false),
            ..taut_model::HoistParams::default()
        };
        let options = StepOptions {
            guard,
            ..StepOptions {
                backend: options(Form::Schur).backend,
                ..StepOptions::default()
            }
        };
        Stepper::new(params.hanging_equilibrium().unwrap(), options).unwrap()
    }

    /// The tension of a motion that is lost makes M̃ overflow: with it, no later step would succeed.
    #[test]
    fn a_failed_step_leaves_no_tension_behind() {
        for guard in [None, Some(crate::Guard::default())] {
            let mut stepper = hanging(guard);
            let good = stepper.scene().bodies.clone();
            let from_good = |stepper: &mut Stepper| {
                stepper.set_state(&good, 0.0).unwrap();
                stepper.step().map(|_| stepper.multipliers().to_vec())
            };
            let expected = from_good(&mut hanging(guard));
            assert!(expected.is_ok());
            for speed in [1e100, 1e160, 1e200, 1e300] {
                let mut bad = good.clone();
                bad.velocity[0].x = speed;
                stepper.set_state(&bad, 0.0).unwrap();
                let failed = (0..10_000).any(|_| stepper.step().is_err());
                assert!(failed, "{speed:e}, {guard:?}");
                assert_eq!(from_good(&mut stepper), expected, "{speed:e}, {guard:?}");
            }
        }
    }

    /// A step that is redone has the tension that it began with, whatever guess its solves start from.
    #[test]
    fn the_tension_of_a_step_that_is_taken_back_comes_back() {
        let guard = crate::Guard {
            tolerance: f64::MIN_POSITIVE,
            ..crate::Guard::default()
        };
        let [a, b] = [0.0, -10.0].map(|guess| {
            let mut stepper = hanging(Some(guard));
            let bodies = stepper.scene().bodies.clone();
            let rows = stepper.multipliers().len();
            stepper.set_state(&bodies, 0.0).unwrap();
            stepper.set_multipliers(&vec![guess; rows]).unwrap();
            stepper.set_tension(&vec![-100.0; rows]).unwrap();
            assert!(stepper.step().unwrap().redone);
            stepper.into_scene()
        });
        assert_eq!(a, b);
    }
}
