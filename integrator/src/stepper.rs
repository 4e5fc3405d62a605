//! The step, [SL Algorithm 1] for one group: linearise, assemble, factorise, solve, refine, update.
//!
//! The unknown is the velocity *change* Δv together with the impulses μ. Both are kept through the refinement, and its
//! residual comes from the pieces,
//!
//! ```text
//! Δv ← Δv + M̃⁻¹ (Δt f + Jᵀ μ − M̃ Δv),    r = (c − J v) − J Δv − Σ μ
//! ```
//!
//! not from the assembled S, whose diagonal has rounded small inverse masses away. With μ = Δv = 0 the same two lines
//! give the right-hand side of the Schur form.

use crate::inertia::Inertia;
use crate::plan::{BlockOf, Plan};
use crate::products::{add_transposed, subtract_jacobian};
use crate::regularization::Regularization;
use crate::report::PhaseClock;
use crate::{Form, Phase, StepError, StepOptions, StepReport};
use nalgebra::{UnitQuaternion, Vector3};
use taut_model::{Bodies, Linearized, Scene, update_windings};
use taut_solver::{LinearSolver, RefineScratch, SolveError, SolveReport, SymBlockMatrix};

/// A scene in motion: its state, its linear system and the solver.
pub struct Stepper {
    scene: Scene,
    options: StepOptions,
    time: f64,
    solver: Box<dyn LinearSolver>,
    plan: Plan,
    matrix: SymBlockMatrix,
    /// Right-hand side and solution of the linear system, length `matrix.dim()`.
    rhs: Vec<f64>,
    x: Vec<f64>,
    scratch: RefineScratch,
    pieces: Pieces,
    /// Impulses μ = Δt λ of the last solve, one a row.
    mu: Vec<f64>,
    /// Whether `mu` belongs to the present state, which then may be advanced.
    solved: bool,
}

/// What the linear system is made of, and the velocity change that goes with the present multipliers.
struct Pieces {
    rows: Linearized,
    inertia: Inertia,
    regularization: Regularization,
    /// W = J M̃⁻¹, laid out as the Jacobian.
    w: Vec<f64>,
    /// c − J v, one a row.
    rate: Vec<f64>,
    /// Δv, 6 numbers a body.
    dv: Vec<f64>,
    /// An impulse or a momentum, 6 numbers a body.
    impulse: Vec<f64>,
}

impl Pieces {
    /// Δv ← Δv + M̃⁻¹ (Δt f + Jᵀ μ − M̃ Δv).
    fn update_velocity_change(&mut self, mu: &[f64]) {
        let inertia = &self.inertia;
        self.impulse.copy_from_slice(&inertia.impulse);
        add_transposed(&self.rows, mu, &mut self.impulse);
        let (impulses, _) = self.impulse.as_chunks_mut::<6>();
        let (dvs, _) = self.dv.as_chunks_mut::<6>();
        for (i, (p, dv)) in impulses.iter_mut().zip(dvs).enumerate() {
            let mut buffer = [0.0; 6];
            inertia.apply(i, dv, &mut buffer);
            for (p, momentum) in p.iter_mut().zip(&buffer) {
                *p -= momentum;
            }
            inertia.apply_inverse(i, p, &mut buffer);
            for (dv, correction) in dv.iter_mut().zip(&buffer) {
                *dv += correction;
            }
        }
    }

    /// r = (c − J v) − J Δv − Σ μ with the Δv that goes with μ.
    fn residual(&mut self, mu: &[f64], r: &mut [f64]) {
        self.update_velocity_change(mu);
        for (r, ((rate, sigma), mu)) in r
            .iter_mut()
            .zip(self.rate.iter().zip(&self.regularization.sigma).zip(mu))
        {
            *r = rate - sigma * mu;
        }
        subtract_jacobian(&self.rows, &self.dv, r);
    }
}

impl Stepper {
    /// A stepper for a scene, at time 0. Allocates everything that the steps need, but for what libraries allocate.
    ///
    /// # Errors
    /// An invalid scene or option, a backend that is not compiled in or does not take the form.
    pub fn new(scene: Scene, options: StepOptions) -> Result<Self, StepError> {
        scene.validate()?;
        options.validate()?;
        let at_start = |source| StepError::Solve {
            source,
            culprit: None,
            time: 0.0,
        };
        let rows = Linearized::new(&scene);
        let plan = Plan::new(options.form, &scene, &rows).map_err(at_start)?;
        let mut solver = options.backend.create().map_err(at_start)?;
        solver.analyze(&plan.pattern).map_err(at_start)?;
        let (dim, bodies) = (plan.pattern.dim(), 6 * scene.bodies.len());
        Ok(Self {
            time: 0.0,
            solver,
            matrix: SymBlockMatrix::zeros(plan.pattern.clone()),
            rhs: vec![0.0; dim],
            x: vec![0.0; dim],
            scratch: RefineScratch::new(dim),
            mu: vec![0.0; rows.rows()],
            solved: false,
            pieces: Pieces {
                inertia: Inertia::new(&scene.bodies),
                regularization: Regularization::new(rows.rows()),
                w: vec![0.0; rows.jacobian.len()],
                rate: vec![0.0; rows.rows()],
                dv: vec![0.0; bodies],
                impulse: vec![0.0; bodies],
                rows,
            },
            plan,
            scene,
            options,
        })
    }

    /// Advances the scene by one time step. Allocates nothing with the project's own backends.
    ///
    /// # Errors
    /// [`StepError::Solve`] (the state is then that at the beginning of the step) and [`StepError::NonFinite`].
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        let mut clock = PhaseClock::start();
        let (solve, iterations) = self.solve_timed(&mut clock)?;
        self.advance()?;
        clock.end(Phase::Update);
        Ok(StepReport {
            time: self.time,
            solve,
            iterations,
            refinements: self.options.refinements,
            phases: clock.times(),
        })
    }

    /// The first half of a step: solves for the impulses of the present state, which stays as it is. With
    /// [`advance`](Self::advance) after it this is [`step`](Self::step).
    ///
    /// # Errors
    /// [`StepError::Solve`].
    pub fn solve(&mut self) -> Result<StepReport, StepError> {
        let mut clock = PhaseClock::start();
        let (solve, iterations) = self.solve_timed(&mut clock)?;
        let refinements = self.options.refinements;
        Ok(StepReport {
            time: self.time,
            solve,
            iterations,
            refinements,
            phases: clock.times(),
        })
    }

    fn solve_timed(&mut self, clock: &mut PhaseClock) -> Result<(SolveReport, usize), StepError> {
        self.linearize()?;
        clock.end(Phase::Linearize);
        self.assemble();
        clock.end(Phase::Assemble);
        self.solver
            .factorize(&self.matrix)
            .map_err(|e| self.culprit(e))?;
        clock.end(Phase::Factorize);
        let report = self
            .solver
            .solve(&self.matrix, &self.rhs, &mut self.x)
            .map_err(|e| self.culprit(e))?;
        clock.end(Phase::Solve);
        let refined = self.refine().map_err(|e| self.culprit(e))?;
        clock.end(Phase::Refine);
        let sign = self.multiplier_sign();
        self.plan
            .scatter_multipliers(&self.pieces.rows, &self.x, sign, &mut self.mu);
        self.solved = true;
        Ok((report, report.iterations + refined))
    }

    /// φ, J, Σ, c, M̃, Δt f of the present state.
    fn linearize(&mut self) -> Result<(), StepError> {
        self.solved = false;
        let (pieces, dt) = (&mut self.pieces, self.options.dt);
        pieces.rows.update(&self.scene, self.time);
        pieces.rows.drive(&self.scene, self.time, self.time + dt);
        pieces
            .regularization
            .update(self.options.scheme, dt, &pieces.rows);
        let no_inverse = |i: usize| StepError::NonFinite {
            body: self.scene.body_names[i].clone(),
            time: self.time,
        };
        pieces.inertia.update(&self.scene, dt).map_err(no_inverse)?;
        let bodies = &self.scene.bodies;
        for (i, v) in pieces.dv.chunks_exact_mut(6).enumerate() {
            v[..3].copy_from_slice(bodies.velocity[i].as_slice());
            v[3..].copy_from_slice(bodies.angular_velocity[i].as_slice());
        }
        pieces.rate.copy_from_slice(&pieces.regularization.c);
        subtract_jacobian(&pieces.rows, &pieces.dv, &mut pieces.rate);
        pieces.dv.fill(0.0);
        Ok(())
    }

    /// The matrix, the right-hand side, and the guess in `x`.
    fn assemble(&mut self) {
        let Pieces {
            rows,
            inertia,
            regularization,
            w,
            ..
        } = &mut self.pieces;
        self.plan
            .fill(rows, inertia, regularization, w, &mut self.matrix);
        let sign = self.multiplier_sign();
        match self.options.form {
            Form::Schur => {
                self.x.fill(0.0);
                self.pieces.residual(&self.x, &mut self.rhs);
                self.x.copy_from_slice(&self.mu);
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
                    .gather(rows, &inertia.impulse, rate, 1.0, &mut self.rhs);
                self.plan.gather(rows, dv, &self.mu, sign, &mut self.x);
            }
        }
        if !self.options.warm_start {
            self.x.fill(0.0);
        }
    }

    fn refine(&mut self) -> Result<usize, SolveError> {
        let Self {
            solver,
            matrix,
            rhs,
            x,
            scratch,
            pieces,
            ..
        } = self;
        let sweeps = self.options.refinements;
        let report = match self.options.form {
            Form::Schur => {
                taut_solver::refine(&mut **solver, matrix, x, scratch, sweeps, |mu, r| {
                    pieces.residual(mu, r)
                })
            }
            Form::Kkt => taut_solver::refine(&mut **solver, matrix, x, scratch, sweeps, |x, r| {
                matrix.subtract_product(rhs, x, r);
            }),
        };
        Ok(report?.map_or(0, |r| r.iterations))
    }

    /// The second half of a step: velocities from the impulses of the last [`solve`](Self::solve), then positions.
    ///
    /// # Errors
    /// [`SolveError::OutOfOrder`] in [`StepError::Solve`] without a solve of the present state, and
    /// [`StepError::NonFinite`]; the state is then not to be used.
    pub fn advance(&mut self) -> Result<(), StepError> {
        if !std::mem::take(&mut self.solved) {
            let source = SolveError::OutOfOrder {
                called: "advance",
                needs: "solve",
            };
            return Err(self.culprit(source));
        }
        self.pieces.update_velocity_change(&self.mu);
        if self.options.form == Form::Kkt {
            // Δv started from zero here: the second pass removes the first one's roundoff, as a refinement of the Schur
            // form does along the way.
            self.pieces.update_velocity_change(&self.mu);
        }
        self.time += self.options.dt;
        let (bodies, dt) = (&mut self.scene.bodies, self.options.dt);
        for (i, dv) in self.pieces.dv.chunks_exact(6).enumerate() {
            bodies.velocity[i] += Vector3::from_column_slice(&dv[..3]);
            bodies.angular_velocity[i] += Vector3::from_column_slice(&dv[3..]);
            bodies.position[i] += dt * bodies.velocity[i];
            let turn = UnitQuaternion::from_scaled_axis(dt * bodies.angular_velocity[i]);
            bodies.orientation[i] = turn * bodies.orientation[i];
            bodies.orientation[i].renormalize_fast();
            let moved = bodies.position[i].sum() + bodies.orientation[i].coords.sum();
            if !(moved + bodies.velocity[i].sum() + bodies.angular_velocity[i].sum()).is_finite() {
                return Err(StepError::NonFinite {
                    body: self.scene.body_names[i].clone(),
                    time: self.time,
                });
            }
        }
        update_windings(&mut self.scene, self.time);
        Ok(())
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

    /// The scene in its present state.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The options.
    #[must_use]
    pub fn options(&self) -> &StepOptions {
        &self.options
    }

    /// Time of the present state \[s].
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Impulses μ = Δt λ of the last solve, one a row \[N s, N m s].
    #[must_use]
    pub fn multipliers(&self) -> &[f64] {
        &self.mu
    }

    /// Replaces the impulses that the next solve starts from: those of another solve of the same scene.
    ///
    /// # Errors
    /// [`SolveError::Dimension`] in [`StepError::Solve`].
    pub fn set_multipliers(&mut self, mu: &[f64]) -> Result<(), StepError> {
        if mu.len() != self.mu.len() {
            let source = SolveError::Dimension {
                what: "multipliers",
                expected: self.mu.len(),
                found: mu.len(),
            };
            return Err(StepError::Solve {
                source,
                culprit: None,
                time: self.time,
            });
        }
        self.mu.copy_from_slice(mu);
        self.solved = false;
        Ok(())
    }

    /// Puts the bodies into another state of the same scene, at a time; multipliers stay, and each twist row unwraps to
    /// the angle within half a turn of its last one. Allocates nothing.
    ///
    /// # Errors
    /// [`SolveError::Dimension`] in [`StepError::Solve`] where the number of bodies differs.
    pub fn set_state(&mut self, bodies: &Bodies, time: f64) -> Result<(), StepError> {
        let (expected, found) = (self.scene.bodies.len(), bodies.len());
        if expected != found {
            let source = SolveError::Dimension {
                what: "bodies",
                expected,
                found,
            };
            return Err(StepError::Solve {
                source,
                culprit: None,
                time,
            });
        }
        let own = &mut self.scene.bodies;
        own.position.copy_from_slice(&bodies.position);
        own.orientation.copy_from_slice(&bodies.orientation);
        own.velocity.copy_from_slice(&bodies.velocity);
        own.angular_velocity
            .copy_from_slice(&bodies.angular_velocity);
        self.time = time;
        self.solved = false;
        update_windings(&mut self.scene, time);
        Ok(())
    }

    /// The linear system of the last solve: matrix, right-hand side, solution as the backend and the refinement left
    /// it.
    #[must_use]
    pub fn system(&self) -> (&SymBlockMatrix, &[f64], &[f64]) {
        (&self.matrix, &self.rhs, &self.x)
    }

    /// The constraints' linearisation at the last solve.
    #[must_use]
    pub fn linearized(&self) -> &Linearized {
        &self.pieces.rows
    }

    /// Elastic energy ½ Σ ε λ² of the last solve's multipliers \[J]; not ½ φ²/ε, which overstates stiff rows. With
    /// damping (τ > 0) the multipliers of moving rows hold the dissipative force too, and this is no longer stored
    /// energy alone.
    #[must_use]
    pub fn elastic_energy(&self) -> f64 {
        let lambda = self.mu.iter().map(|mu| mu / self.options.dt);
        0.5 * self
            .pieces
            .rows
            .compliance
            .iter()
            .zip(lambda)
            .map(|(e, l)| e * l * l)
            .sum::<f64>()
    }

    /// The exact impulses of the present state, to the last digit: the KKT system of the pieces M̃, J, Σ, c (as rounded
    /// to doubles) in extended precision. The oracle for every form and backend. Allocates.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn reference_multipliers(&mut self) -> Result<Vec<f64>, StepError> {
        self.linearize()?;
        let Pieces {
            rows,
            inertia,
            regularization,
            w,
            rate,
            ..
        } = &mut self.pieces;
        let at_state = |source| StepError::Solve {
            source,
            culprit: None,
            time: self.time,
        };
        let plan = Plan::new(Form::Kkt, &self.scene, rows).map_err(at_state)?;
        let mut a = SymBlockMatrix::zeros(plan.pattern.clone());
        plan.fill(rows, inertia, regularization, w, &mut a);
        let mut b = vec![0.0; a.dim()];
        plan.gather(rows, &inertia.impulse, rate, 1.0, &mut b);
        let x = taut_solver::reference_solution(&a, &b).map_err(at_state)?;
        let mut mu = vec![0.0; rows.rows()];
        plan.scatter_multipliers(rows, &x, -1.0, &mut mu);
        Ok(mu)
    }
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
            ..StepOptions::default()
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
        let again = scene.constraints[0];
        scene.add_constraint("again", again, 0);
        let error = Stepper::new(scene, options(Form::Schur))
            .unwrap()
            .step()
            .unwrap_err();
        assert!(error.to_string().contains("`again`"), "{error}");
    }
}
