//! Contacts before the joints, as the paper has them: see [`crate::contact::method`].

use super::Stepper;
use crate::{Phase, StepError};

impl Stepper {
    /// True if this solve takes contacts before the joints.
    pub(crate) fn is_staggered(&self) -> bool {
        self.options.contacts.is_staggered() && !self.contacts.is_empty()
    }

    /// Impulses of the contacts of a step of `dt` as if there were no joints, into Δt f.
    pub(crate) fn project_contacts(&mut self, dt: f64) -> Result<(), StepError> {
        let (contacts, pieces) = (&mut self.contacts, &mut self.pieces);
        for touch in &mut contacts.touches {
            touch.impulse = [0.0; 3];
        }
        contacts.apply(&mut pieces.inertia, true);
        pieces.inertia.free_velocities(&mut pieces.dv);
        let mut rates = std::mem::take(&mut contacts.rates);
        contacts.rates(pieces, &mut rates);
        // Contacts that only the impulses of others would close take part as well.
        contacts.activate(&rates, f64::INFINITY);
        let done = self.build_operator().and_then(|hardened| {
            if hardened {
                self.contacts.rates(&self.pieces, &mut rates);
            }
            let done = self.solve_dense(dt, &mut rates, true);
            self.contacts.apply(&mut self.pieces.inertia, true);
            done.map(|_| ()).map_err(|e| self.culprit(e))
        });
        self.contacts.rates = rates;
        self.tally.end(Phase::Solve);
        done
    }

    /// The rates u of the pieces' Δv, and the largest violation of the contacts' conditions by them, over their size.
    pub(crate) fn violation_of(&self, rates: &mut Vec<f64>) -> f64 {
        self.contacts.rates(&self.pieces, rates);
        self.contacts.regularize(rates);
        self.contacts.violation(rates, &self.pieces)
    }

    /// Largest violation of the contacts' conditions after the joints, over the size of the rates.
    pub(crate) fn violation_after_joints(&mut self) -> f64 {
        self.pieces.update_velocity_change(&self.mu);
        let mut rates = std::mem::take(&mut self.contacts.rates);
        let found = self.violation_of(&mut rates);
        self.contacts.rates = rates;
        found
    }
}

#[cfg(test)]
mod tests {
    use crate::contact::tests::{self as touching, rough};
    use crate::{ContactMethod, StepError, StepOptions, Stepper};
    use nalgebra::Vector3;
    use taut_model::collide::Shape;
    use taut_model::{
        Body, Constraint, Distance, Frame, Grounded, GroundedParams, MasslessCable, RowLaw, Scene,
    };
    use taut_solver::forward_error;

    const G: f64 = 9.81;

    fn stepper(scene: Scene, method: &str) -> Stepper {
        let options = StepOptions {
            contacts: method.parse().expect("a method"),
            energy_tolerance: Some(0.2),
            ..StepOptions::default()
        };
        Stepper::new(scene, options).expect("a sound scene")
    }

    fn ground(friction: f64) -> Scene {
        touching::ground(0.0, rough(friction))
    }

    fn add_box(scene: &mut Scene, at: Vector3<f64>, mass: f64, friction: f64) -> usize {
        touching::add_box(scene, at, mass, rough(friction))
    }

    fn link(scene: &mut Scene, [a, b]: [usize; 2], length: f64) {
        let ends = [a, b].map(|body| Frame::body(body, Vector3::zeros()));
        let cable = MasslessCable::new(ends.to_vec(), length, RowLaw::new(1e-6, 0.0));
        scene.add_constraint("rope", Constraint::MasslessCable(cable), 0);
    }

    #[test]
    fn a_box_alone_rests() {
        let mut scene = ground(0.5);
        let i = add_box(&mut scene, Vector3::z() * 0.5, 3.0, 0.5);
        let mut stepper = stepper(scene, "staggered");
        for _ in 0..120 {
            let report = stepper.step().expect("a step");
            assert!((report.contacts.load / (3.0 * G) - 1.0).abs() < 1e-2);
        }
        let bodies = &stepper.scene().bodies;
        let moved = (bodies.position[i] - Vector3::z() * 0.5).norm();
        assert!(moved < 1e-3, "{moved}");
        assert!(bodies.velocity[i].norm() < 1e-3, "{}", bodies.velocity[i]);
    }

    #[test]
    fn momenta_of_bodies_that_meet_are_kept() {
        let mut scene = Scene::new("free");
        let [a, b, c] =
            [-0.9, 0.4, 1.6].map(|x| add_box(&mut scene, Vector3::x() * x, 1.0 + x, 0.4));
        scene.bodies.mass[a] = 2.0;
        link(&mut scene, [b, c], 1.2);
        scene.bodies.velocity[a].x = 2.0;
        let momentum = scene.momentum();
        let mut stepper = stepper(scene, "staggered");
        for _ in 0..60 {
            stepper.step().expect("a step");
        }
        let scene = stepper.scene();
        assert!(scene.bodies.velocity[b].x > 0.2, "they have not met");
        assert!((scene.momentum() - momentum).norm() < 1e-12);
    }

    #[test]
    fn impulses_lie_in_their_cones() {
        let scene = GroundedParams::new(Grounded::Floor).build().expect("built");
        let mut stepper = stepper(scene, "staggered:sweeps=3");
        let mut sliding = 0;
        for _ in 0..60 {
            let report = stepper.step().expect("a step");
            assert!(report.contacts.cone <= 1e-10, "{report:?}");
            sliding += report.contacts.sliding;
        }
        assert!(sliding > 60, "{sliding}");
    }

    /// A ball of 1 kg on the ground below one of `ratio` kg that stands on it by a rod: its contact carries itself alone.
    fn pressed(ratio: f64) -> Scene {
        let mut scene = ground(0.0);
        let shape = Shape::Sphere { radius: 0.5 };
        let low = Body::sphere(0.5, 1.0).at(Vector3::z() * 0.5);
        let low = touching::add(&mut scene, low, shape, rough(0.0));
        let high = Body::sphere(0.5, ratio).at(Vector3::z() * 2.5);
        let high = scene.add_body("load", high);
        let ends = [low, high].map(|body| Frame::body(body, Vector3::zeros()));
        let rod = Distance {
            frames: ends,
            length: 2.0,
            law: RowLaw::new(1e-9, 0.0),
            transverse: false,
        };
        scene.add_constraint("rod", Constraint::Distance(rod), 0);
        scene
    }

    #[test]
    fn what_joints_press_on_the_ground_goes_through() {
        let deepest = |method: &str, ratio: f64| {
            let mut stepper = stepper(pressed(ratio), method);
            let (mut deepest, mut violation) = (0.0_f64, 0.0_f64);
            for _ in 0..30 {
                let report = stepper.step().expect("a step").contacts;
                deepest = deepest.max(report.deepest);
                violation = violation.max(report.complementarity);
            }
            (deepest, violation)
        };
        for ratio in [10.0, 1e5] {
            let (deep, violation) = deepest("newton", ratio);
            assert!(
                deep < 1e-3 && violation < 1e-10,
                "{ratio}: {deep} {violation}"
            );
            let (deep, violation) = deepest("staggered", ratio);
            // The load's weight is not carried: half a second of its fall, less what undoes penetration.
            assert!(deep > 0.1 && violation > 0.1, "{ratio}: {deep} {violation}");
        }
    }

    #[test]
    fn what_is_not_carried_is_the_residual() {
        let mut stepper = stepper(pressed(1e5), "staggered");
        let dt = stepper.options().dt;
        let report = stepper.step().expect("a step").contacts;
        // Both fall as if there were no ground. The contact knows of the low ball, whose surface yields with 1/m along the
        // normal and with 1/m + r²/I, I = ⅖ m r², across it.
        let mobility = (1.0 + 2.0 * 3.5) / 3.0;
        let gap = report.residual_gap / (G * dt * dt);
        let force = report.residual_force * mobility / G;
        assert!((gap - 1.0).abs() < 1e-3, "{gap}");
        assert!((force - 1.0).abs() < 1e-3, "{force}");
    }

    #[test]
    fn a_stack_that_gains_energy_ends_with_that_error() {
        let params = GroundedParams {
            mass_ratio: 1.0,
            ..GroundedParams::new(Grounded::Stack)
        };
        let mut stepper = stepper(params.build().expect("built"), "staggered:sweeps=10");
        let error = (0..180).find_map(|_| stepper.step().err());
        assert!(
            matches!(error, Some(StepError::EnergyGain { .. })),
            "{error:?}"
        );
    }

    #[test]
    fn exact_multipliers_are_those_of_the_staggered_step() {
        let scene = GroundedParams::new(Grounded::Floor).build().expect("built");
        let mut stepper = stepper(scene, "staggered");
        for _ in 0..10 {
            stepper.step().expect("a step");
        }
        let exact = stepper.reference_multipliers().expect("exact ones");
        stepper.solve().expect("a solve");
        assert!(forward_error(stepper.multipliers(), &exact) < 1e-9);
    }

    #[test]
    fn more_sweeps_than_end_are_refused() {
        let options = StepOptions {
            contacts: ContactMethod::Staggered { sweeps: usize::MAX },
            ..StepOptions::default()
        };
        let error = Stepper::new(pressed(1.0), options).err().expect("refused");
        assert!(
            matches!(error, StepError::InvalidOption { field, .. } if field == "contacts.sweeps"),
            "{error}"
        );
    }
}
