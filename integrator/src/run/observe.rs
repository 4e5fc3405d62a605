//! Queries of a stepper: scene, multipliers, linear system, energies, and the exact solution of the
//! next step.

use crate::run::Stepper;
use crate::{
    Chosen, ContactForce, ContactImpulses, EliminationOrder, Energy, Form, RowForces, StepError,
    StepOptions,
};
use nalgebra::Matrix3;
use taut_model::body_vectors::unpacked;
use taut_model::{Linearized, Loads, Scene, Wrench};
use taut_solver::{Backend, SymBlockMatrix};

impl Stepper {
    /// Rate at which a cable slips over each sheave with friction, in the direction of travel \[m/s], in the order of
    /// [`Scene::capstans`]; 0 where it sticks. Of the last sub-step.
    pub fn slip_rates(&self) -> impl Iterator<Item = f64> + '_ {
        self.step.slip.rates()
    }

    /// The scene in its present state.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.step.scene
    }

    /// The scene in its present state, without the stepper.
    #[must_use]
    pub fn into_scene(self) -> Scene {
        self.step.scene
    }

    /// The options.
    #[must_use]
    pub fn options(&self) -> &StepOptions {
        &self.step.options
    }

    /// Time of the present state \[s].
    #[must_use]
    pub fn time(&self) -> f64 {
        self.step.time
    }

    /// Impulses μ = h λ of the last solve, one a row \[N s, N m s]. Their time h is that of the last sub-step, which the
    /// guard may have shortened: see [`row_forces`](Self::row_forces).
    #[must_use]
    pub fn multipliers(&self) -> &[f64] {
        &self.step.multipliers.mu
    }

    /// Forces λ of the rows of constraint `constraint`, means over the last step with all its sub-steps, those of the guard
    /// included; after a [`solve`](Self::solve) those of it. `None` where there is no such constraint. Zero before the first
    /// solve.
    #[must_use]
    pub fn row_forces(&self, constraint: usize) -> Option<RowForces> {
        self.step.row_forces(constraint)
    }

    /// As [`row_forces`](Self::row_forces), of the last sub-step alone: the forces that gaps and energies of the present state
    /// belong to.
    #[must_use]
    pub fn last_forces(&self, constraint: usize) -> Option<RowForces> {
        self.step.last_forces(constraint)
    }

    /// Force \[N] and torque \[N m] that constraint `constraint` exerts on its side b at b's attachment point, world frame:
    /// [`force_on`](Self::force_on) side 1. On a joint's side a acts the opposite force.
    #[must_use]
    pub fn force(&self, constraint: usize) -> Option<Wrench> {
        self.force_on(constraint, 1)
    }

    /// Force \[N] and torque \[N m] that constraint `constraint` exerts on its side number `side`, an index into
    /// [`Constraint::frames`](taut_model::Constraint::frames), at the side's attachment point, world frame. On a side held
    /// by the world or by a static body it is the load of that anchor. `None` where there is no such
    /// constraint or side. Allocates nothing.
    ///
    /// The magnitudes are the [`row_forces`](Self::row_forces), means over the last step; points and directions are those of
    /// its end, the present state. The forces on a body add up to m (Δv/Δt − g) of that step: to rounding where they come from
    /// gaps, to the angle that a link, cable or slider turns by in the step where they follow its direction.
    #[must_use]
    pub fn force_on(&self, constraint: usize, side: usize) -> Option<Wrench> {
        self.step.force_on(constraint, side)
    }

    /// Tension, bending, twist and drive of constraint `constraint`, of the instant of [`force_on`](Self::force_on).
    /// `None` where there is no such constraint. Allocates nothing.
    #[must_use]
    pub fn loads(&self, constraint: usize) -> Option<Loads> {
        self.step.loads(constraint)
    }

    /// Tension of constraint `constraint` \[N], that of its [`loads`](Self::loads): negative where it pushes; of a joint of
    /// a cable along the cable. `None` where there is no such constraint, or none that has a tension: see
    /// [`Scene::loads`](taut_model::Scene::loads).
    #[must_use]
    pub fn tension(&self, constraint: usize) -> Option<f64> {
        self.step.tension(constraint)
    }

    /// Tension in the middle of segment number `segment`, from 0, of the cable of segments called `cable` \[N]: the mean of
    /// the pulls on its two ends along it, whatever holds them, negative where they push. A free end counts as zero. Exact
    /// for a cable that hangs at rest under its own weight. Allocates.
    ///
    /// # Errors
    /// [`StepError::Scene`] for a cable or a segment that is not there.
    pub fn tension_in(&self, cable: &str, segment: usize) -> Result<f64, StepError> {
        let (scene, rows) = (&self.step.scene, &self.step.system_data.rows);
        let body = scene.segment(cable, segment)?;
        let held = rows.slots.iter().filter(|slot| slot.body == body);
        let mut constraints: Vec<usize> = held.map(|slot| slot.constraint).collect();
        // One may hold a body at several points.
        constraints.dedup();
        let mut pull = 0.0;
        for constraint in constraints {
            let frames = scene.constraints[constraint].frames().iter().enumerate();
            for (side, frame) in frames.filter(|(_, f)| f.body_index() == Some(body)) {
                let force = self.force_on(constraint, side);
                let out = frame.resolve(&scene.bodies, self.step.time).lever;
                let out = out.try_normalize(0.0).unwrap_or_default();
                pull += force.map_or(0.0, |wrench| wrench.force.dot(&out));
            }
        }
        Ok(0.5 * pull)
    }

    /// The contacts of the last step: those that carried a force in it, and those near enough to.
    pub fn contacts(&self) -> impl Iterator<Item = ContactForce> + '_ {
        let reported = self.step.output.reported.contacts();
        let last = || self.step.contacts.reported(&self.step.system_data);
        let own = reported.is_none().then(last).into_iter().flatten();
        let own = own.map(|(_, contact)| contact);
        reported.into_iter().flatten().chain(own)
    }

    /// Contact impulses of the last solve: the next step starts from them and takes its geometric
    /// stiffness at contacts from them.
    #[must_use]
    pub fn contact_impulses(&self) -> ContactImpulses {
        let (known, dt) = self.step.contacts.known();
        let known = known.to_vec();
        ContactImpulses { known, dt }
    }

    /// Kinetic, gravitational and elastic energy \[J] at the beginning of the last sub-step, where position, tension and the
    /// mean of the velocities before and after it belong to one instant. (With [`crate::Scheme::LinearlyImplicit`] the
    /// tension belongs to the end, an error of first order.) After a step that the guard redid: that of its end, where its
    /// tension is; a staggered scheme's velocities are then half a step late, an error of Δt/2 times the power. Before a step
    /// of the present state: that of its positions and velocities as they are, and the elastic energy of the last solve.
    #[must_use]
    pub fn energy(&self) -> Energy {
        self.step.energy()
    }

    /// Elastic energy ½ Σ ε λ² of the last solve's multipliers \[J]. With damping (τ > 0) the multipliers of moving rows hold the
    /// dissipative force too, and this is no longer stored energy alone. After a step that the guard redid or divided, at most
    /// ½ φ²/ε of each row, and none of slack ones.
    #[must_use]
    pub fn elastic_energy(&self) -> f64 {
        self.step.elastic_energy()
    }

    /// The order of the constraints in the linear system, and what it costs.
    #[must_use]
    pub fn elimination(&self) -> &EliminationOrder {
        &self.step.system.elimination
    }

    /// The solver that was chosen, and why, where [`StepOptions::backend`] is [`Backend::Auto`].
    #[must_use]
    pub fn chosen(&self) -> Option<&Chosen> {
        self.step.system.chosen.as_ref()
    }

    /// The backend at work: that of the options, or the one chosen.
    #[must_use]
    pub fn backend(&self) -> &Backend {
        let chosen = self.step.system.chosen.as_ref();
        chosen.map_or(&self.step.options.backend, |chosen| &chosen.backend)
    }

    /// The geometric stiffness K that the last solve gave a body as inertia, of which α Δt² joins its own, world \[N m]:
    /// [`GeometricStiffness`](crate::GeometricStiffness). Zero where that is off; `None` for a body that is not there.
    #[must_use]
    pub fn geometric_stiffness(&self, body: usize) -> Option<Matrix3<f64>> {
        let stiffness = self.step.system_data.geometric.stiffness();
        (body < self.step.scene.bodies.len()).then(|| unpacked(stiffness.get(body)))
    }

    /// The linear system of the last solve: matrix n × n, right-hand side of length n, solution as the backend and the
    /// refinement left it; n is the number of rows of S (1/kg, m/s, N s on rows of lengths), or six a moving body and the
    /// rows of the KKT matrix. Its blocks stand in the order of [`elimination`](Self::elimination).
    #[must_use]
    pub fn system(&self) -> (&SymBlockMatrix, &[f64], &[f64]) {
        (
            &self.step.system.matrix,
            &self.step.system.rhs,
            &self.step.system.x,
        )
    }

    /// Matrix and right-hand side of the last [`solve`](Self::solve) in either form, assembled anew from the same pieces,
    /// constraints in the order of [`elimination`](Self::elimination); rows at their bounds stay there.
    /// Allocates.
    ///
    /// # Errors
    /// [`SolveError`](taut_solver::SolveError) in [`StepError::Solve`] where the pattern is too large.
    pub fn assembled(&mut self, form: Form) -> Result<(SymBlockMatrix, Vec<f64>), StepError> {
        self.step.assembled(form)
    }

    /// The constraints' linearisation at the present state; ∂φ/∂t is that of the last step or solve.
    #[must_use]
    pub fn linearized(&self) -> &Linearized {
        &self.step.system_data.rows
    }

    /// The exact impulses of the next sub-step from the present state, one a row \[N s, N m s], to the last digit: the KKT
    /// system of the system's data M̃, J, Σ, c (as rounded to doubles) in extended precision. The oracle for every form and backend. Those
    /// of the first step come after [`begin`](Self::begin). Allocates.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn reference_multipliers(&mut self) -> Result<Vec<f64>, StepError> {
        self.step.reference_multipliers()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    /// A swinging load of 600 kg on six soft segments, the middle ones kicked aside at `kick` (m/s).
    fn swing(options: StepOptions, kick: f64) -> Stepper {
        let params = HoistParams::default()
            .with(|p| (p.segments, p.mass_ratio, p.segment_mass) = (6, 600.0, Some(1.0)))
            .with(|p| (p.ea, p.move_x, p.move_duration) = (Some(1e6), 0.5, 0.5))
            .with(|p| p.seed = 3);
        let mut scene = params.hanging_equilibrium().unwrap();
        scene.bodies.velocity[2..4].fill(Vector3::y() * kick);
        Stepper::new(scene, options).unwrap()
    }

    /// After a step that began with these velocities, the force above the load against what accelerates the load,
    /// m (Δv/Δt − g), and against φ/ε, both relative.
    fn apart(stepper: &Stepper, before: &[Vector3<f64>]) -> [f64; 2] {
        let (load, joint) = (6, 6);
        let rate =
            (stepper.step.scene.bodies.velocity[load] - before[load]) / stepper.step.options.dt;
        let carried =
            (rate - stepper.step.scene.gravity).norm() * stepper.step.scene.bodies.mass[load];
        let rows = &stepper.step.system_data.rows;
        let stretched: Vec<_> = rows
            .row_range(joint)
            .map(|r| rows.phi[r] / rows.compliance[r])
            .collect();
        let elastic = Vector3::from_column_slice(&stretched).norm();
        let tension = stepper.force(joint).unwrap().force.norm();
        let last = stepper.last_forces(joint).unwrap();
        let last = Vector3::from_column_slice(&last).norm();
        [tension / carried, last / elastic].map(|ratio| (ratio - 1.0).abs())
    }

    #[test]
    fn the_tension_balances_the_load_in_sub_steps_of_every_scheme() {
        for scheme in Scheme::KINDS {
            for substeps in [1, 2, 4, 8] {
                let options =
                    StepOptions::default().with(|o| (o.scheme, o.substeps) = (scheme, substeps));
                let mut stepper = swing(options, 0.0);
                stepper.step().unwrap();
                for _ in 1..60 {
                    let before = stepper.step.scene.bodies.velocity.clone();
                    stepper.step().unwrap();
                    let [balance, law] = apart(&stepper, &before);
                    assert!(balance < 1e-9, "{scheme}, {substeps}: {balance}");
                    // The forces of second order are those of the sub-step's beginning.
                    assert!(law < 0.1, "{scheme}, {substeps}: {law}");
                }
                let weight = 9.81 * 600.0;
                let tension = stepper.tension(6).unwrap();
                let off = (tension / weight - 1.0).abs();
                assert!(off < 0.25, "{substeps}: {tension}");
            }
        }
    }

    #[test]
    fn the_tension_balances_the_load_in_implicit_sub_steps() {
        let mut shortened = 0;
        for (substeps, kick) in [
            (1, 70.0),
            (4, 70.0),
            (1, 50.0),
            (4, 50.0),
            (1, 30.0),
            (4, 30.0),
        ] {
            let options = StepOptions {
                substeps,
                guard: Some(Guard::default().with(|g| (g.substeps, g.passes) = (2, 2))),
                ..StepOptions::default()
            };
            let mut stepper = swing(options, kick);
            stepper.step().unwrap();
            let mut was_divided = false;
            for _ in 1..30 {
                let before = stepper.step.scene.bodies.velocity.clone();
                let report = stepper.step().unwrap();
                let [balance, law] = apart(&stepper, &before);
                // The forces of second order are those of the beginning of a divided step's last part.
                if stepper.step.multipliers.mu_dt < 0.9 * stepper.step.substep()
                    && report.divided == 0
                {
                    assert!(report.implicit_substeps > 1);
                    assert!(law < 0.1, "{substeps}: {law}");
                    shortened += 1;
                }
                // A divided step leaves velocities of its end.
                let divided = report.divided > 0;
                if !divided && !was_divided {
                    assert!(balance < 1e-9, "{substeps}: {balance}");
                }
                was_divided = divided;
            }
        }
        assert!(shortened > 5, "{shortened}");
    }

    /// After a step that began with these velocities, force of all constraints on body `i`, and m (Δv/Δt − g).
    fn carried(stepper: &Stepper, before: &[Vector3<f64>], i: usize) -> [Vector3<f64>; 2] {
        let scene = stepper.scene();
        let mut sum = Vector3::zeros();
        for (c, constraint) in scene.constraints.iter().enumerate() {
            for (side, frame) in constraint.frames().iter().enumerate() {
                if frame.body_index() == Some(i) {
                    sum += stepper.force_on(c, side).unwrap().force;
                }
            }
        }
        let rate = (scene.bodies.velocity[i] - before[i]) / stepper.step.options.dt;
        [sum, (rate - scene.gravity) * scene.bodies.mass[i]]
    }

    #[test]
    fn the_forces_on_a_body_are_what_accelerates_it() {
        for (substeps, kick) in [(1, 0.0), (4, 0.0), (1, 50.0)] {
            let options = StepOptions::default().with(|o| o.substeps = substeps);
            let mut stepper = swing(options, kick);
            stepper.step().unwrap();
            for _ in 1..30 {
                let before = stepper.step.scene.bodies.velocity.clone();
                stepper.step().unwrap();
                let largest = stepper.force(0).unwrap().force.norm();
                for body in 0..7 {
                    let [sum, needed] = carried(&stepper, &before, body);
                    assert!((sum - needed).norm() < 1e-9 * largest, "{body}: {sum}");
                }
            }
        }
    }

    #[test]
    fn the_anchor_of_a_hanging_hoist_carries_the_whole_weight() {
        let params = HoistParams::default().with(|p| p.mass_ratio = 1e4);
        let scene = params.hanging_equilibrium().unwrap();
        let weight = scene.gravity * scene.mass();
        let anchor = scene.constraint("anchor").unwrap();
        let mut stepper = Stepper::new(scene, StepOptions::default()).unwrap();
        stepper.steps(3);
        let [on_world, on_cable] = [0, 1].map(|side| stepper.force_on(anchor, side).unwrap());
        assert!((on_world.force - weight).norm() < 1e-9 * weight.norm());
        assert_eq!(on_cable.force, -on_world.force);
        assert_eq!(stepper.force(anchor), Some(on_cable));
        let loads = stepper.loads(anchor).unwrap();
        assert_eq!(loads.tension, stepper.tension(anchor));
        assert!((loads.tension.unwrap() / weight.norm() - 1.0).abs() < 1e-9);
    }

    /// A cable that stands out from a wall, 1 m of it, under its own weight.
    #[test]
    fn a_cantilever_has_its_moment_at_the_clamp() {
        let params =
            taut_model::SpecimenParams::new(taut_model::Specimen::Bend).with(|p| p.segments = 10);
        let mut scene = params.build().unwrap();
        scene.gravity = Vector3::z() * -9.81;
        let grip = scene.bodies.len() - 1;
        scene.bodies.torque[grip] = Vector3::zeros();
        scene.start_in_equilibrium = true;
        let mut stepper = Stepper::new(scene, StepOptions::default()).unwrap();
        stepper.step().unwrap();
        let scene = stepper.scene();
        let (mut force, mut torque) = (Vector3::zeros(), Vector3::zeros());
        for i in scene.dynamic_bodies() {
            let weight = scene.gravity * scene.bodies.mass[i];
            force += weight;
            // The clamp is at the origin.
            torque += scene.bodies.position[i].cross(&weight);
        }
        let on_wall = stepper.force_on(0, 0).unwrap();
        assert!((on_wall.force - force).norm() < 1e-9 * force.norm());
        let error = (on_wall.torque - torque).norm() / torque.norm();
        assert!(torque.norm() > 0.1 && error < 1e-6, "{torque} {error:e}");
        let loads = stepper.loads(0).unwrap();
        let bending = loads.bending.unwrap();
        assert!((bending / torque.norm() - 1.0).abs() < 1e-2, "{bending}");
        assert!(loads.twist.unwrap().abs() < 1e-9 && loads.drive.is_none());
    }

    #[test]
    fn the_tension_in_a_hanging_cable_is_the_weight_below() {
        let params = HoistParams::default()
            .with(|p| (p.segments, p.segment_mass, p.load_mass) = (6, Some(2.0), Some(30.0)));
        let scene = params.hanging_equilibrium().unwrap();
        let mut stepper = Stepper::new(scene, StepOptions::default()).unwrap();
        stepper.step().unwrap();
        for segment in 0..6 {
            let below = 30.0 + 2.0 * (5.5 - segment as f64);
            let tension = stepper.tension_in("cable", segment).unwrap();
            assert!((tension / (9.81 * below) - 1.0).abs() < 1e-9, "{tension}");
        }
        for (cable, segment, words) in [
            ("cable", 6, "cable `cable`: segment 6: is not there"),
            ("rope", 0, "cable `rope` is not known: choose one of cable"),
        ] {
            let fault = stepper.tension_in(cable, segment).unwrap_err().to_string();
            assert!(fault.starts_with(words), "{fault}");
        }
    }

    #[test]
    fn a_constraint_that_is_not_there_has_no_force() {
        let mut stepper = swing(StepOptions::default(), 0.0);
        assert_eq!(stepper.row_forces(3).unwrap()[..], [0.0; 6]);
        stepper.step().unwrap();
        assert_eq!(stepper.row_forces(6).unwrap().len(), 3);
        assert!(stepper.row_forces(7).is_none() && stepper.tension(7).is_none());
        assert!(stepper.force(7).is_none() && stepper.loads(7).is_none());
        assert!(stepper.force(6).is_some() && stepper.force_on(6, 2).is_none());
    }
}
