//! Static equilibrium by pseudo-transient continuation: implicit steps from rest, each one linear solve, with the
//! velocity set to zero in between and a time step that grows as the linearisation comes to hold. For long steps a pass
//! is Newton's method on f + Jᵀ λ = 0, ε λ = −φ; the passes end where these two hold ([`crate::equilibrium_residual`]), not where
//! nothing moves: what turns without resistance may drift with rounding, and what is soft moves little though it is far
//! from rest.
//!
//! A long step from rest divides what rounding leaves of the balance of forces, u F, by the body's inertia: light
//! segments of a cable that carries 10⁶ times their weight would jump about by micrometres, and spin about their axes.
//! Inertia has no part in an equilibrium, so each body gets what its constraint forces accelerate with
//! [`ACCELERATION`] on top of its own.
//!
//! A rope that is stretched at the start gives that way in one pass where it is rigid, however short the pass. Passes shorter
//! than the first leave the rest of it to later ones ([`crate::activation`]).
//!
//! A link or cable under tension T that turns with its ends resists them with T/|d| across; without that in its matrix
//! a long step lets a load on slings overshoot a thousandfold. Links therefore get their transverse rows here, and
//! all else that has a [length](Constraint::link_length), such as massless cables, a link without length row along each span
//! ([`Spans`]).
//!
//! Contacts take no part: a state in which shapes overlap is refused.

use crate::step::Step;
use crate::step::guarded::Pass;
use crate::{GeometricStiffness, Scheme, StepError, StepOptions};
use nalgebra::Vector3;
use taut_model::{Constraint, Distance, RowLaw, Scene};
use taut_solver::Backend;

/// Solves at most.
const PASSES: usize = 400;
/// First pseudo time step \[s].
const FIRST: f64 = 1.0 / 60.0;
/// Pseudo time step below which a system that cannot be solved will not be solvable, nor hold \[s].
const SHORTEST: f64 = 1e-6;
/// Longest pseudo time step \[s]: modes of a second are then reduced a thousandfold a pass.
const LONGEST: f64 = 30.0;
/// Acceleration that constraint forces give to the inertia added for them \[m/s²]: about gravity's, so that a segment is
/// as inert as what hangs on it.
const ACCELERATION: f64 = 10.0;
/// Largest disagreement of a pass that is accepted.
const ACCEPTED: f64 = 0.05;
/// Imbalance at which the state is an equilibrium, once no shorter step reduces it.
const BALANCED: f64 = 1e-9;
/// Imbalance that is rounding.
const ROUNDING: f64 = 1e-15;
/// Imbalance from which on a longest step that stalls is taken to be stopped by its rounding, u F Δt² over the inertia.
const NEAR: f64 = 1e-6;
/// A pass that leaves more than this part of the equilibrium_residual stalls.
const STALLED: f64 = 0.95;
/// Times that the step is then quartered.
const QUARTERINGS: usize = 5;
/// Passes that may stall at each of the shorter lengths: slow modes go on there below the rounding of the fast ones.
const PATIENCE: usize = 10;
/// Overlap of shapes beyond that of the start, over the smallest dimension of either, that is no equilibrium.
const SUNK: f64 = 1e-2;
/// Largest change of an angle in a pass that is accepted \[rad]: less than half a turn, so that windings are followed.
const LARGEST_TURN: f64 = 2.5;

/// The scene at rest where its forces balance at t = 0, nearest in the sense of damped motion from its present pose.
/// Forces and torques balance, and rows keep their laws, to rounding as far as that can be had, and to 10⁻⁹ of the
/// largest. Velocities are kept as they are for the start. Orientation about an axis without resistance stays as it is.
///
/// # Errors
/// [`StepError::NoEquilibrium`] where none is found in 400 solves (a body that nothing holds, a mechanism in free
/// fall); [`StepError::EquilibriumOverlaps`] where shapes would be inside each other there; else as
/// [`Stepper::step`](crate::Stepper::step).
pub fn static_equilibrium(mut scene: Scene, backend: &Backend) -> Result<Scene, StepError> {
    scene.validate()?;
    let mut resting = Scene {
        start_in_equilibrium: false,
        ..scene.clone()
    };
    let spans = Spans::add(&mut resting);
    let mut step = Step::build(resting, options(backend), &mut None)?;
    spans.take_tensions(&mut step);
    let (mut pace, mut moved) = (Pace::start(), None);
    let mut passes = 0;
    while passes < PASSES && 4.0 * pace.dt > SHORTEST {
        passes += 1;
        spans.leave_out_lengths(&mut step);
        match step.relax(pace.dt)? {
            None => pace.dt *= 0.25,
            Some(way) => {
                moved = Some(way);
                let rests = pace.ends_with(step.equilibrium_residual());
                if rests || (passes == PASSES && pace.equilibrium_residual <= BALANCED) {
                    let before = overlap(&scene);
                    take_pose(step.scene, &mut scene);
                    return keeps_apart(scene, before);
                }
            }
        }
    }
    let (change, body) = moved.unzip();
    Err(StepError::NoEquilibrium {
        passes,
        change: change.unwrap_or(f64::INFINITY),
        body: body.and_then(|i: usize| scene.body_names.get(i).cloned()),
        equilibrium_residual: pace.equilibrium_residual,
        limited: step.at_force_limit(),
    })
}

/// By which part of their size the shapes overlap that overlap most.
fn overlap(scene: &Scene) -> f64 {
    scene
        .deepest_overlap()
        .map_or(0.0, |(_, part)| part.max(0.0))
}

/// A scene that was put to rest without contacts, whose shapes overlapped by the part `before` of their size.
fn keeps_apart(scene: Scene, before: f64) -> Result<Scene, StepError> {
    match scene.deepest_overlap() {
        Some((deepest, part)) if part > before + SUNK => Err(StepError::EquilibriumOverlaps {
            colliders: deepest.colliders.map(|i| scene.colliders[i].name.clone()),
            depth: -deepest.gap,
        }),
        _ => Ok(scene),
    }
}

/// The options of the passes.
fn options(backend: &Backend) -> StepOptions {
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
    StepOptions {
        dt: FIRST,
        refinements: 1,
        scheme: Scheme::LinearlyImplicit,
        stiffness: GeometricStiffness::Off,
        guard: None,
        backend,
        ..StepOptions::default()
    }
}

/// Poses and windings of the scene that came to rest. Of links, which got rows of their own there, there is nothing to
/// take.
fn take_pose(found: Scene, scene: &mut Scene) {
    scene.bodies.position = found.bodies.position;
    scene.bodies.orientation = found.bodies.orientation;
    for (constraint, found) in scene.constraints.iter_mut().zip(found.constraints) {
        if !matches!(found, Constraint::Distance(_)) {
            *constraint = found;
        }
    }
    scene.start_in_equilibrium = false;
}

/// Length of the passes, and the progress that decides it.
struct Pace {
    /// Length of the next pass \[s].
    dt: f64,
    /// Imbalance after the last pass, relative.
    equilibrium_residual: f64,
    /// Times that the step has been quartered since the longest stalled.
    quartered: usize,
    /// Passes that stalled at this length.
    stalled: usize,
}

impl Pace {
    fn start() -> Self {
        Self {
            dt: FIRST,
            equilibrium_residual: f64::INFINITY,
            quartered: 0,
            stalled: 0,
        }
    }

    /// Takes the equilibrium_residual after a pass and sets the length of the next; true if the pass was the
    /// last.
    fn ends_with(&mut self, equilibrium_residual: f64) -> bool {
        let last = std::mem::replace(&mut self.equilibrium_residual, equilibrium_residual);
        let shortened = self.quartered > 0;
        self.stalled +=
            usize::from(equilibrium_residual >= STALLED * last && equilibrium_residual <= NEAR);
        let stalls = self.stalled > if shortened { PATIENCE } else { 0 };
        if stalls && self.quartered < QUARTERINGS && (shortened || self.dt >= LONGEST) {
            self.quartered += 1;
            self.stalled = 0;
            self.dt *= 0.25;
        } else if !shortened || stalls || equilibrium_residual > NEAR {
            if shortened && equilibrium_residual <= BALANCED {
                return true;
            }
            (self.quartered, self.stalled) = (0, 0);
            self.dt = (4.0 * self.dt).min(LONGEST);
        }
        equilibrium_residual <= ROUNDING
    }
}

/// The links along the spans of what pulls along its line, after all other constraints: their transverse rows alone are used.
struct Spans {
    /// Constraint whose span each link is.
    cables: Vec<usize>,
    /// The first link.
    first: usize,
}

impl Spans {
    /// Adds a link along each span that can turn, and transverse rows to the links that there are.
    fn add(scene: &mut Scene) -> Self {
        let first = scene.constraints.len();
        let mut cables = Vec::new();
        for c in 0..first {
            if let Constraint::Distance(link) = &mut scene.constraints[c] {
                link.transverse = true;
                continue;
            }
            let Some(length) = scene.constraints[c].link_length() else {
                continue;
            };
            let frames = scene.constraints[c].frames().to_vec();
            for (k, span) in frames.windows(2).enumerate() {
                let moves = |f: &taut_model::Frame| {
                    f.body_index().is_some_and(|i| scene.bodies.is_dynamic(i))
                };
                if span[0].body_index() == span[1].body_index() || !span.iter().any(moves) {
                    continue;
                }
                let link = Constraint::Distance(Distance {
                    frames: [span[0], span[1]],
                    length,
                    law: RowLaw::new(1.0, 0.0),
                    transverse: true,
                });
                let name = format!("{}, span {}", scene.constraint_names[c], k + 1);
                scene.add_constraint(name, link, scene.groups[c]);
                cables.push(c);
            }
        }
        Self { cables, first }
    }

    /// The links' transverse rows are as stiff as their cables' tensions make them.
    fn take_tensions(&self, step: &mut Step) {
        if self.cables.is_empty() {
            return;
        }
        let system_data = &mut step.system_data;
        let constraints = system_data.rows.constraints();
        // The guard ignores the links: their φ is no gap.
        system_data.idle.resize(constraints, false);
        system_data.idle[self.first..].fill(true);
        let links = system_data.rows.transverse.len() - self.cables.len();
        for (k, &cable) in self.cables.iter().enumerate() {
            system_data.rows.transverse[links + k].length_row =
                system_data.rows.row_range(cable).start;
        }
    }

    /// J = 0 and φ = 0 in the links' own rows, so that λ = 0: the present linearisation holds them.
    fn leave_out_lengths(&self, step: &mut Step) {
        let rows = &mut step.system_data.rows;
        for link in self.first..rows.constraints() {
            let (row, slots) = (rows.row_range(link).start, rows.slot_range(link));
            rows.phi[row] = 0.0;
            for slot in slots {
                let from = rows.slots[slot].offset;
                rows.jacobian[from..from + 6].fill(0.0);
            }
        }
    }
}

impl Step {
    /// One pass from rest: the largest change of a position over the scene's extent, and whose it is, or `None` where the
    /// linearisation did not hold and the state is as before.
    fn relax(&mut self, dt: f64) -> Result<Option<(f64, usize)>, StepError> {
        let bodies = &mut self.scene.bodies;
        bodies.velocity.fill(Vector3::zeros());
        bodies.angular_velocity.fill(Vector3::zeros());
        self.keep_substep_start();
        self.system_data.load_velocities(&self.scene.bodies);
        self.system_data.dv.clear();
        self.system_data
            .rows
            .drive(&self.scene, self.time, self.time);
        self.slip.forget();
        self.slip.update_ratios(&self.scene);
        self.activation.begin(&self.system_data.rows);
        self.activation
            .take_drift(&self.system_data.rows, &self.multipliers.tension, false);
        self.activation.left = (1.0 - dt / FIRST).max(0.0);
        let pass = Pass::FromRest(ACCELERATION);
        let disagreement = match self.newton_pass(pass, dt, self.time) {
            Ok(d) => d,
            Err(StepError::NonFinite { .. }) => f64::INFINITY,
            // A shorter step is nearer to a regular one.
            Err(StepError::Solve { .. }) if dt > SHORTEST => f64::INFINITY,
            Err(e) => return Err(e),
        };
        if disagreement <= ACCEPTED && self.largest_turn(dt) <= LARGEST_TURN {
            self.system_data
                .rows
                .follow_windings(&mut self.scene, self.time);
            return Ok(Some(self.largest_motion(dt)));
        }
        let start = std::mem::take(&mut self.guarded.substep_start);
        self.go_back(&start);
        self.guarded.substep_start = start;
        Ok(None)
    }

    /// Largest change of an angular row in `dt` \[rad]: |J v| dt of the last iterate.
    fn largest_turn(&mut self, dt: f64) -> f64 {
        let [rates, _] = &mut self.system.in_rows;
        self.system_data.rates_after(rates);
        let angular = rates
            .iter()
            .enumerate()
            .filter(|(r, _)| self.system_data.is_angular(*r));
        angular.map(|(_, rate)| dt * rate.abs()).fold(0.0, f64::max)
    }

    /// Largest way of a body's centre or attachment in `dt`, over the scene's extent, and the body. Turning about a lever
    /// arm moves nothing.
    fn largest_motion(&self, dt: f64) -> (f64, usize) {
        let (bodies, rows) = (&self.scene.bodies, &self.system_data.rows);
        let centres = bodies.velocity.iter().map(Vector3::norm).enumerate();
        let turning = rows.slots.iter().enumerate().map(|(s, slot)| {
            let omega = bodies.angular_velocity[slot.body];
            (slot.body, omega.cross(&rows.lever(s)).norm())
        });
        let (body, speed) = (centres.chain(turning))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or_default();
        (dt * speed / self.extent(), body)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    /// A box stands on the ground, on a rope that is this much too long to hold it up.
    fn hung(slack: f64) -> Result<Scene, StepError> {
        let mut scene = Scene::new("hung");
        scene.gravity.z = -9.81;
        scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
        let size = Vector3::repeat(1.0);
        let body = Body::cuboid(size, 100.0).at(Vector3::z() * 0.5);
        let load = scene.add_body("load", body);
        scene.add_collider(Collider::new("load", Some(load), Shape::Cuboid { size }));
        let ends = vec![
            Frame::world(Vector3::z() * 5.0),
            Frame::body(load, Vector3::z() * 0.5),
        ];
        let rope = MasslessCable::new(ends, 4.0 + slack, RowLaw::new(1e-6, 0.0));
        scene.add_constraint("rope", Constraint::MasslessCable(rope), 0);
        static_equilibrium(scene, &Backend::Banded)
    }

    #[test]
    fn what_would_hang_through_the_ground_is_refused() {
        assert!(hung(-0.1).is_ok() && hung(0.005).is_ok());
        let refused = hung(0.1).expect_err("it would hang in the ground");
        let words = refused.to_string();
        let StepError::EquilibriumOverlaps { colliders, depth } = refused else {
            panic!("{refused}");
        };
        assert_eq!(colliders, ["ground", "load"]);
        assert!((depth - 0.1).abs() < 2e-3, "{depth}");
        assert!(words.contains("`load`") && words.contains("start without equilibrium"));
    }
}
