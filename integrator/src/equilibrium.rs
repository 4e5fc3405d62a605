//! Static equilibrium by pseudo-transient continuation: implicit steps from rest, each one linear solve, with the
//! velocity set to zero in between and a time step that grows as the linearisation comes to hold. For long steps a pass
//! is Newton's method on f + Jᵀ λ = 0, ε λ = −φ.
//!
//! A long step from rest divides what rounding leaves of the balance of forces, u F, by the body's inertia: light
//! segments of a cable that carries 10⁶ times their weight would jump about by micrometres, and spin about their axes.
//! Inertia has no part in an equilibrium, so each body gets what its constraint forces accelerate with
//! [`ACCELERATION`] on top of its own.

use crate::guarded::Pass;
use crate::report::{PhaseClock, Work};
use crate::stepper::Stepper;
use crate::{GeometricStiffness, Scheme, StepError, StepOptions};
use nalgebra::Vector3;
use taut_model::Scene;
use taut_solver::Backend;

/// Solves at most.
const PASSES: usize = 400;
/// Pseudo time step below which a system that cannot be solved will not be solvable \[s].
const SHORTEST: f64 = 1e-6;
/// Longest pseudo time step \[s]: modes of a second are then reduced a thousandfold a pass.
const LONGEST: f64 = 30.0;
/// Acceleration that constraint forces give to the inertia added for them \[m/s²]: about gravity's, so that a segment is
/// as inert as what hangs on it.
const ACCELERATION: f64 = 10.0;
/// Largest disagreement of a pass that is accepted.
const ACCEPTED: f64 = 0.05;
/// Change of the positions, over the scene's extent, at which the state is an equilibrium.
const TOLERANCE: f64 = 1e-11;
/// Largest change of an angle in a pass that is accepted \[rad]: less than half a turn, so that windings are followed.
const LARGEST_TURN: f64 = 2.5;
/// Change of an angle that a row measures at which it is one \[rad]: twist moves no attachment.
const ANGLE_TOLERANCE: f64 = 1e-9;

/// The scene at rest where its forces balance at t = 0, nearest in the sense of damped motion from its present pose.
/// Velocities are kept as they are for the start. Orientation about an axis without resistance stays as it is.
///
/// # Errors
/// [`StepError::NoEquilibrium`] where none is found in 400 solves (a body that nothing holds, a mechanism in free
/// fall); else as [`Stepper::step`].
pub fn static_equilibrium(scene: Scene, backend: &Backend) -> Result<Scene, StepError> {
    // An iteration that stops early leaves the forces out of balance.
    let backend = match backend {
        iterative if iterative.is_iterative() => {
            if Backend::Banded.is_compiled() {
                Backend::Banded
            } else {
                Backend::Dense(taut_solver::DenseOptions::default())
            }
        }
        direct => direct.clone(),
    };
    let options = StepOptions {
        dt: 1.0 / 60.0,
        refinements: 1,
        scheme: Scheme::LinearlyImplicit,
        stiffness: GeometricStiffness::Off,
        guard: None,
        backend,
        ..StepOptions::default()
    };
    let bodies = &scene.bodies;
    let (velocity, spin) = (bodies.velocity.clone(), bodies.angular_velocity.clone());
    let mut stepper = Stepper::new(
        Scene {
            start_in_equilibrium: false,
            ..scene
        },
        options,
    )?;
    let (mut clock, mut work) = (PhaseClock::start(), Work::default());
    let mut dt = 1.0 / 60.0;
    let mut change = f64::INFINITY;
    for _ in 0..PASSES {
        let done = stepper.relax(dt, &mut clock, &mut work)?;
        match done {
            Some((moved, turned)) => {
                change = moved.max(turned);
                if dt >= LONGEST && moved <= TOLERANCE && turned <= ANGLE_TOLERANCE {
                    let mut scene = stepper.into_scene();
                    scene.bodies.velocity = velocity;
                    scene.bodies.angular_velocity = spin;
                    return Ok(scene);
                }
                dt = (4.0 * dt).min(LONGEST);
            }
            None => dt *= 0.25,
        }
    }
    Err(StepError::NoEquilibrium {
        passes: PASSES,
        change,
        limited: stepper.at_force_limit(),
    })
}

impl Stepper {
    /// One pass from rest: the largest change of a position over the scene's extent and of an angular row (rad), or `None`
    /// where the linearisation did not hold and the state is as before.
    fn relax(
        &mut self,
        dt: f64,
        clock: &mut PhaseClock,
        work: &mut Work,
    ) -> Result<Option<(f64, f64)>, StepError> {
        let bodies = &mut self.scene.bodies;
        bodies.velocity.fill(Vector3::zeros());
        bodies.angular_velocity.fill(Vector3::zeros());
        self.substep_start
            .save(bodies, self.time, (&self.mu, self.mu_dt), &self.tension);
        self.pieces.load_velocities(bodies);
        self.pieces.dv.clear();
        self.pieces.rows.drive(&self.scene, self.time, self.time);
        let pass = Pass::FromRest(ACCELERATION);
        let disagreement = match self.newton_pass(pass, dt, self.time, clock, work) {
            Ok(d) => d,
            Err(StepError::NonFinite { .. }) => f64::INFINITY,
            // A shorter step is nearer to a regular one.
            Err(StepError::Solve { .. }) if dt > SHORTEST => f64::INFINITY,
            Err(e) => return Err(e),
        };
        let turned = self.largest_turn(dt);
        if disagreement <= ACCEPTED && turned <= LARGEST_TURN {
            self.pieces.rows.follow_windings(&mut self.scene, self.time);
            return Ok(Some((self.largest_motion(dt), turned)));
        }
        let start = std::mem::take(&mut self.substep_start);
        self.go_back(&start);
        self.substep_start = start;
        Ok(None)
    }

    /// Largest change of an angular row in `dt` \[rad]: |J v| dt of the last iterate.
    fn largest_turn(&mut self, dt: f64) -> f64 {
        let [rates, _] = &mut self.in_rows;
        self.pieces.rates_after(rates);
        let angular = rates
            .iter()
            .enumerate()
            .filter(|(r, _)| self.pieces.is_angular(*r));
        angular.map(|(_, rate)| dt * rate.abs()).fold(0.0, f64::max)
    }

    /// Largest way of a body's centre or attachment in `dt`, over the scene's extent. Turning about a lever arm moves
    /// nothing.
    fn largest_motion(&self, dt: f64) -> f64 {
        let (bodies, rows) = (&self.scene.bodies, &self.pieces.rows);
        let mut moved = bodies
            .velocity
            .iter()
            .map(Vector3::norm)
            .fold(0.0, f64::max);
        let mut extent = 0.0_f64;
        if let Some(first) = bodies.position.first() {
            let way = bodies.position.iter().map(|x| (x - first).norm());
            extent = way.fold(0.0, f64::max);
        }
        for (s, slot) in rows.slots.iter().enumerate() {
            let lever = rows.lever(s);
            moved = moved.max(bodies.angular_velocity[slot.body].cross(&lever).norm());
            extent = extent.max(lever.norm());
        }
        // A single body held at its centre has no extent: metres then.
        dt * moved / if extent > 0.0 { extent } else { 1.0 }
    }
}
