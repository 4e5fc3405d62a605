//! Contacts with dry friction, condensed onto the factor of the joints \[SL §V-D, §VII-D].
//!
//! A contact has three rows H of the relative velocity where two shapes meet: along the normal n, from shape 1 to shape 0,
//! and along two directions across it: rows of a joint's J at the point, [`row_along`]. Its impulse p, in the same axes, joins Δt f:
//!
//! ```text
//! M̃ Δv = Δt f + Jᵀ μ + Hᵀ p,      J Δv + Σ μ = c − J v,      u = H (v + Δv) + b + σ p
//! p_N ≥ 0,  u_N ≥ 0,  p_N u_N = 0,      |p_T| ≤ μ_f p_N,  u_T against p_T where it slides, 0 where it sticks
//! ```
//!
//! Eliminating Δv and μ with the factor of the joints' S leaves a small dense problem for [`taut_solver::coulomb`]:
//!
//! ```text
//! u = W p + q,     W = H M̃⁻¹ Hᵀ − G S⁻¹ Gᵀ + diag σ,     G = H M̃⁻¹ Jᵀ
//! ```
//!
//! one solve with that factor for each row of a body with joints (the dense operator is in [`operator`]). W only steers:
//! after each solution all rows are solved and refined from the system's data with p as a part of Δt f, u is taken from them, and
//! what it lacks of the conditions goes through W once more.
//!
//! **Normal row.** b = φ/Δt of a gap φ: the shapes at most touch at the end of the step. Of a penetration b = Υ φ/Δt with
//! Υ = 1/(1 + τ/Δt); its compliance gives σ = Υ ε/Δt². The linearly implicit form, \[SL (8)–(11)], in every
//! scheme, with τ of critical damping at least ([`damping`]): contacts do not ring. The force f of the last step explains ε f
//! of the penetration. What is left, as of shapes that overlap at the start, is undone with at most [`RECOVERY`]. In a step
//! that shapes arrive in their contact is rigid: [`blow`].
//!
//! **Rows across.** b of surfaces that turn within the step: [`turning`].
//!
//! **Regularisation.** A box that stands on four corners has twelve rows for six degrees of freedom. Each row has
//! [`FLOOR`] of its own W in σ besides: the impulses are unique, and a contact that sticks creeps by as little.
//!
//! Where no impulses are found that keep the conditions, nor nearly so, as of bodies that are jammed between others, the
//! contacts that hang together are taken 100 times softer for the step, up to three times, and the report counts it.
//!
//! **Geometric stiffness.** A force F at the lever r of a body has the part (F·r)⁺ (I − r rᵀ/r²) as that of a joint. The
//! normal turns besides, as the surfaces are curved: a normal force N has −N ∂²φ/∂θ² of the gap φ
//! ([`Contact::turning`](taut_model::contacts::Contact::turning)), N (R + r) of a rod of radius r that rocks across a cylinder
//! of radius R. Of all contacts of a body the sum counts, as far as it is positive: a box between boxes has next to none. What
//! ∂²φ/∂q² has between turns and motions along the surface, and between both bodies, which vanishes where one of them is
//! round about its centre, no block of a body can hold: the step sees it explicitly.
//!
//! Restitution: [`rebound`].

mod blow;
mod damping;
pub(crate) mod groups;
pub(crate) mod operator;
pub(crate) mod rebound;
mod sweeps;
mod through;
mod turning;

use crate::ContactReport;
use crate::geometric::Geometric;
use crate::inertia::Inertia;
use crate::system_data::SystemData;
use nalgebra::{Matrix3, Vector3};
use operator::Operator;
use taut_model::collide::Surface;
use taut_model::constraint::row_along;
use taut_model::contacts::{Collisions, Contact};
use taut_model::linearized::dot;
use taut_model::{BodyVectors, Scene, SceneError, axes_along};
use taut_solver::coulomb::violation;

/// Largest speed at which a penetration is undone \[m/s].
const RECOVERY: f64 = 0.5;

/// Least regularisation of a row, over its own part of W.
pub(crate) const FLOOR: f64 = 1e-9;

/// Depth, over the size of both shapes, that is no longer a contact's.
const SUNK: f64 = 1e-3;

/// Depth, over the size of both shapes, at which surfaces that yield carry nothing that may be trusted.
const CRUSHED: f64 = 0.5;

/// Most bodies of a contact.
pub(crate) const CARRIERS: usize = 4;

/// A body of a contact.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ContactBody {
    pub(crate) body: usize,
    /// From its centre to its surface there; zero for point masses, which never turn.
    lever: Vector3<f64>,
    /// The part of the contact's force that it carries, < 0 on the second side.
    part: f64,
}

/// The larger violation; unlike `f64::max` it keeps NaN.
fn worse(a: f64, b: f64) -> f64 {
    if a <= b || b.is_nan() { b } else { a }
}

/// A contact of the step.
#[derive(Debug, Clone)]
pub(crate) struct ContactPoint {
    pub(crate) found: Contact,
    /// n, and two directions across it.
    pub(crate) axes: [Vector3<f64>; 3],
    /// Its bodies, and how many.
    carriers: [ContactBody; CARRIERS],
    count: usize,
    /// Set while the contact has rows in W; elsewhere p = 0.
    pub(crate) active: bool,
    /// Impulse p over a step of [`Contacts::dt`], in `axes` \[N s].
    pub(crate) impulse: [f64; 3],
    /// b of the normal row, and the further target rate of a rebound \[m/s].
    pub(crate) offset: f64,
    pub(crate) aim: f64,
    /// b of the tangential rows, where surfaces turn \[m/s].
    pub(crate) turn: [f64; 2],
    /// ε Υ/Δt² of the normal row \[1/kg].
    pub(crate) softness: f64,
    /// b of the normal row of a rigid contact, as in a blow \[m/s].
    pub(crate) rigid: f64,
    /// `softness` and `offset` before the contact was made rigid.
    spring: [f64; 2],
    /// `hit`: the shapes close fast enough for a blow. `arrives`: the contact carried nothing
    /// before.
    pub(crate) hit: bool,
    pub(crate) arrives: bool,
    /// Normal rate after a rebound, where the shapes arrive in this step \[m/s], and when they do; infinite where they do not \[s].
    pub(crate) rebound: Option<f64>,
    arrival: f64,
    /// True where something else stops the shapes before they arrive.
    stopped: bool,
    /// Excess of the rates with the step's impulses, and of those with a blow's, over the ones that tell their work \[m/s]:
    /// see [`rebound`].
    pub(crate) shift: [[f64; 3]; 2],
    /// `struck`: a blow passes through the contact in this step. `jolted`: one did in the last
    /// step.
    pub(crate) struck: bool,
    jolted: bool,
}

impl ContactPoint {
    fn new(found: &Contact, scene: &Scene, dt: f64) -> Self {
        let n = found.normal;
        let axes = axes_along(&n).map_or([n; 3], |a| [0, 1, 2].map(|k| a.column(k).into_owned()));
        let (mut carriers, mut count) = ([ContactBody::default(); CARRIERS], 0);
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            let both = [found.bodies[side], found.partners[side]];
            for body in both.into_iter().flatten() {
                let lever = found.points[side] - scene.bodies.position[body];
                let turns = !scene.bodies.is_point(body);
                carriers[count] = ContactBody {
                    body,
                    lever: if turns { lever } else { Vector3::zeros() },
                    part: if both[1].is_some() { 0.5 * sign } else { sign },
                };
                count += 1;
            }
        }
        Self {
            axes,
            carriers,
            count,
            active: false,
            impulse: [0.0; 3],
            offset: found.gap / dt,
            aim: 0.0,
            turn: [0.0; 2],
            softness: 0.0,
            rigid: found.gap / dt,
            spring: [0.0; 2],
            hit: false,
            arrives: false,
            rebound: None,
            arrival: f64::INFINITY,
            stopped: false,
            shift: [[0.0; 3]; 2],
            struck: false,
            jolted: false,
            found: *found,
        }
    }

    /// Takes σ, and b of a penetration, for the impulse of the last step, or a force of `presumed` (N) where there was none.
    fn recover(&mut self, scene: &Scene, dt: f64, presumed: f64) {
        let compliance = self.found.surface.compliance;
        let force = match self.impulse[0] {
            0.0 if self.found.gap < 0.0 => presumed,
            impulse => impulse / dt,
        };
        let rate = 1.0 / (dt + self.damping(scene, force));
        self.softness = compliance * rate / dt;
        if self.found.gap >= 0.0 {
            return;
        }
        let depth = -self.found.gap;
        let sprung = (compliance * force).min(depth);
        self.rigid = -(rate * (depth - sprung)).min(RECOVERY);
        self.offset = self.rigid - rate * sprung;
    }

    /// Its impulse in the world \[N s].
    pub(crate) fn world_impulse(&self) -> Vector3<f64> {
        let ([n, s, t], p) = (&self.axes, &self.impulse);
        n * p[0] + s * p[1] + t * p[2]
    }

    /// Its bodies.
    pub(crate) fn carriers(&self) -> &[ContactBody] {
        &self.carriers[..self.count]
    }

    /// Row `k` of H, body by body.
    pub(crate) fn row(&self, k: usize) -> impl Iterator<Item = (usize, [f64; 6])> + '_ {
        self.carriers().iter().map(move |carrier| {
            let axis = self.axes[k] * carrier.part;
            (carrier.body, row_along(&axis, &carrier.lever))
        })
    }

    /// Adds Hᵀ p to `to`.
    pub(crate) fn add_to(&self, to: &mut BodyVectors) {
        for (k, p) in self.impulse.iter().enumerate() {
            for (i, row) in self.row(k) {
                to.add(i, row.map(|h| h * p));
            }
        }
    }

    /// The first of [`rates`](Self::rates).
    pub(crate) fn normal_rate(&self, of: impl Fn(usize) -> [f64; 6]) -> f64 {
        self.row(0).map(|(i, row)| dot(&row, &of(i))).sum()
    }

    /// The velocity that friction is against, of the last solve, world \[m/s].
    fn slip(&self, system_data: &SystemData) -> Vector3<f64> {
        let [_, s, t] = self.rates(|i| system_data.rates_after_solve(i));
        self.axes[1] * (s + self.turn[0]) + self.axes[2] * (t + self.turn[1])
    }

    /// H v, for velocities that `of` gives.
    pub(crate) fn rates(&self, of: impl Fn(usize) -> [f64; 6]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.row(k).map(|(i, row)| dot(&row, &of(i))).sum())
    }
}

/// A contact of the last step, as in the last of its sub-steps that had it, with the force that it carries.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ContactForce {
    /// Numbers of its shapes in [`Scene::colliders`].
    pub colliders: [usize; 2],
    /// Their bodies; `None` for the world.
    pub bodies: [Option<usize>; 2],
    /// Bodies that share the force half and half with those: [`Contact::partners`].
    pub partners: [Option<usize>; 2],
    /// Where the first body touches, world \[m].
    pub point: Vector3<f64>,
    /// Unit vector from the second shape to the first.
    pub normal: Vector3<f64>,
    /// Distance of the shapes at the beginning of the sub-step \[m], < 0 where they penetrate.
    pub gap: f64,
    /// Force on the first side, world \[N]: the mean over the step, blows included.
    pub force: Vector3<f64>,
    /// Velocity of the first surface along the second in the middle of the sub-step, without blows, world \[m/s]. Friction is
    /// against it: exactly so of the sub-step's own forces, to the violation that the report tells.
    pub slip: Vector3<f64>,
}

/// Contact impulses of the last solve, from which the next step starts. They fit other steppers of
/// the same scene only.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContactImpulses {
    pub(crate) known: Vec<Known>,
    pub(crate) dt: f64,
}

impl ContactForce {
    /// The part of the force that a body has, world \[N].
    #[must_use]
    pub fn on(&self, body: usize) -> Vector3<f64> {
        let of_side = |side: usize| {
            let both = [self.bodies[side], self.partners[side]];
            let part = if both[1].is_some() { 0.5 } else { 1.0 };
            if both.contains(&Some(body)) {
                part
            } else {
                0.0
            }
        };
        self.force * (of_side(0) - of_side(1))
    }
}

/// A contact of the last solve: the key by which the next step recognises it, and its impulse in
/// the world \[N s].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(crate) struct Known {
    pub(crate) colliders: [usize; 2],
    pub(crate) key: [f64; 3],
    pub(crate) impulse: [f64; 3],
    /// True where a blow passed through it: its force does not last.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) struck: bool,
}

/// The contacts of a scene, found anew for each step.
pub(crate) struct Contacts {
    collisions: Collisions,
    pub(crate) touches: Vec<ContactPoint>,
    /// Contacts of the last solve, sorted by their colliders; `taken` marks those recognised in
    /// this step.
    known: Vec<Known>,
    taken: Vec<bool>,
    /// True in a step of the scheme itself, whose rates belong to the middles of steps.
    pub(crate) of_scheme: bool,
    /// By how much velocities are behind the positions, in implicit sub-steps too \[s].
    pub(crate) late: f64,
    /// False once the rebounds of a step have jammed.
    pub(crate) rebounds: bool,
    /// Admits only contacts at rest, while the accelerations of the beginning are sought.
    pub(crate) begins: bool,
    /// True in a sub-step that begins with the blow of a rod that an event has just made.
    after_blow: bool,
    /// Steps that the impulses and the known ones belong to \[s].
    dt: f64,
    known_dt: f64,
    /// Δt f without contacts: of the step, and with the rows that are held at a bound.
    free: [BodyVectors; 2],
    pub(crate) operator: Operator,
    /// K of the turning of normals, with its body, contact by contact.
    turning: Vec<(usize, Matrix3<f64>)>,
    /// Three numbers a contact, and the impulses of the step while those of its rebounds are found.
    pub(crate) rates: Vec<f64>,
    pub(crate) resting: Vec<[f64; 3]>,
    /// Scratch of rebounds: impulses and velocities by bodies, rates of contacts \[m/s],
    /// multipliers of the joints.
    pub(crate) blow: [BodyVectors; 2],
    wanted: Vec<f64>,
    pub(crate) joints: Vec<f64>,
    /// Rates of contacts without what arrives \[m/s].
    carried: Vec<f64>,
}

impl Contacts {
    pub(crate) fn new(scene: &Scene, system_data: &SystemData) -> Self {
        let collisions = Collisions::new(scene);
        let nothing = collisions.is_empty();
        let bodies = if nothing { 0 } else { scene.bodies.len() };
        Self {
            operator: if nothing {
                Operator::default()
            } else {
                Operator::new(scene, &system_data.rows)
            },
            collisions,
            touches: Vec::new(),
            known: Vec::new(),
            taken: Vec::new(),
            of_scheme: false,
            late: 0.0,
            rebounds: true,
            begins: false,
            after_blow: false,
            dt: 1.0,
            known_dt: 1.0,
            free: [(); 2].map(|()| BodyVectors::new(bodies)),
            turning: Vec::new(),
            rates: Vec::new(),
            resting: Vec::new(),
            blow: [(); 2].map(|()| BodyVectors::new(bodies)),
            wanted: Vec::new(),
            joints: Vec::new(),
            carried: Vec::new(),
        }
    }

    /// True if some pair of shapes may ever meet.
    pub(crate) fn can_be(&self) -> bool {
        !self.collisions.is_empty()
    }

    /// Numbers of the shapes that can come to touch within the step.
    pub(crate) fn colliders(&self) -> impl Iterator<Item = usize> + '_ {
        self.touches.iter().flat_map(|touch| touch.found.colliders)
    }

    /// Contacts of the last sub-step, by their keys, with the means of their forces over it.
    pub(crate) fn reported<'a>(
        &'a self,
        system_data: &'a SystemData,
    ) -> impl Iterator<Item = (Vector3<f64>, ContactForce)> + 'a {
        self.touches.iter().map(|touch| {
            let found = &touch.found;
            let contact = ContactForce {
                slip: touch.slip(system_data),
                colliders: found.colliders,
                bodies: found.bodies,
                partners: found.partners,
                point: found.points[0],
                normal: found.normal,
                gap: found.gap,
                force: touch.world_impulse() / self.dt,
            };
            (found.key, contact)
        })
    }

    /// True if some contact carries something.
    pub(crate) fn presses(&self) -> bool {
        self.touches.iter().any(|touch| touch.impulse[0] > 0.0)
    }

    /// True if no shapes are near each other.
    pub(crate) fn is_empty(&self) -> bool {
        self.touches.is_empty()
    }

    /// Finds the contacts of a step of `dt` from the present state; those that the last solve had start from its impulses. At the
    /// `start` of a run the springs of shapes that begin inside each other may carry up to the weight of all that touches: what is laid
    /// down at its resting depth rests, and what is deeper is pushed out.
    pub(crate) fn find(&mut self, scene: &Scene, dt: f64, start: bool) -> Result<(), SceneError> {
        let found = self.collisions.find(scene, dt)?;
        self.touches.clear();
        let touches = found
            .iter()
            .map(|contact| ContactPoint::new(contact, scene, dt));
        self.touches.extend(touches);
        let slowest = rebound::slowest(scene, dt);
        if self.begins {
            self.touches.retain(|touch| touch.rests(scene, slowest, dt));
        }
        let presumed = match start {
            true => self.touching_mass(scene) * scene.gravity.norm(),
            false => 0.0,
        };
        let factor = dt / self.known_dt;
        self.dt = dt;
        self.taken.clear();
        self.taken.resize(self.known.len(), false);
        for touch in &mut self.touches {
            let pair = touch.found.colliders;
            let first = self.known.partition_point(|known| known.colliders < pair);
            let same = self.known.iter().enumerate().skip(first);
            let same = same.take_while(|(_, known)| known.colliders == pair);
            let apart = |known: &Known| (Vector3::from(known.key) - touch.found.key).norm_squared();
            let left = same.filter(|(i, _)| !self.taken[*i]);
            if let Some((i, known)) = left.min_by(|a, b| apart(a.1).total_cmp(&apart(b.1))) {
                let impulse = Vector3::from(known.impulse) * factor;
                let own = touch.axes.map(|axis| axis.dot(&impulse));
                // The normal may have turned so far that the old impulse would pull.
                touch.impulse = if own[0] > 0.0 { own } else { [0.0; 3] };
                touch.jolted = known.struck;
                self.taken[i] = true;
            }
            touch.recover(scene, dt, presumed);
            touch.meet(scene, slowest);
            touch.follow(scene, dt);
        }
        Ok(())
    }

    /// Mass of the dynamic bodies that begin inside others \[kg].
    fn touching_mass(&self, scene: &Scene) -> f64 {
        let inside = self.touches.iter().filter(|t| t.found.gap < 0.0);
        let bodies = inside.flat_map(ContactPoint::carriers).map(|of| of.body);
        let mut bodies: Vec<_> = bodies.filter(|i| scene.bodies.is_dynamic(*i)).collect();
        bodies.sort_unstable();
        bodies.dedup();
        bodies.iter().map(|i| scene.bodies.mass[*i]).sum()
    }

    /// The impulses are those of a solve of `dt`.
    pub(crate) fn remember(&mut self, dt: f64) {
        self.known_dt = dt;
        self.known.clear();
        self.known.extend(self.touches.iter().map(|touch| Known {
            colliders: touch.found.colliders,
            key: touch.found.key.into(),
            impulse: touch.world_impulse().into(),
            struck: touch.struck,
        }));
    }

    /// Contacts kept by [`remember`](Self::remember), and the length of their step \[s].
    pub(crate) fn known(&self) -> (&[Known], f64) {
        (&self.known, self.known_dt)
    }

    /// Takes the contacts back that [`known`](Self::known) gave of this scene, in their order. Does
    /// not allocate.
    pub(crate) fn remember_again(&mut self, known: &[Known], dt: f64) {
        self.known.clear();
        self.known.extend_from_slice(known);
        self.known_dt = dt;
    }

    /// Takes contacts from outside, in any order.
    pub(crate) fn put(&mut self, known: Vec<Known>, dt: f64) {
        if dt > 0.0 {
            self.known_dt = dt;
        }
        self.known = known;
        // `find` searches by colliders.
        self.known.sort_by_key(|known| known.colliders);
    }

    /// Step that the impulses belong to \[s].
    pub(crate) fn dt(&self) -> f64 {
        self.dt
    }

    /// K of the contacts' forces as the last solve left them. Those of a blow do not last: they would make bodies as inert
    /// against turning as nothing holds them, and what is struck next would leave with energy from nowhere.
    pub(crate) fn stiffen(&mut self, scene: &Scene, geometric: &mut Geometric) {
        self.turning.clear();
        for touch in self.touches.iter().filter(|touch| !touch.jolted) {
            let force = touch.world_impulse() / self.dt;
            let pressed = touch.impulse[0] / self.dt;
            for carrier in touch.carriers() {
                let (i, part) = (carrier.body, carrier.part);
                geometric.add_force(i, &carrier.lever, &(force * part));
                if pressed > 0.0 && scene.bodies.is_dynamic(i) && !scene.bodies.is_point(i) {
                    let side = usize::from(part < 0.0);
                    let k = touch.found.turning(side, &scene.bodies.position[i]);
                    self.turning.push((i, k * (pressed * part.abs())));
                }
            }
        }
        self.turning.sort_unstable_by_key(|(i, _)| *i);
        for of in self.turning.chunk_by(|a, b| a.0 == b.0) {
            geometric.add_positive(of[0].0, of.iter().map(|(_, k)| k).sum());
        }
    }

    /// Keeps Δt f as it is without contacts.
    pub(crate) fn keep(&mut self, inertia: &Inertia, held: bool) {
        if !self.is_empty() {
            self.free[usize::from(held)].copy_from(&inertia.impulse);
        }
    }

    /// Δt f holds the contacts' impulses.
    pub(crate) fn apply(&self, inertia: &mut Inertia, held: bool) {
        if self.is_empty() {
            return;
        }
        self.take_out(inertia, held);
        for touch in &self.touches {
            for (k, p) in touch.impulse.iter().enumerate() {
                for (i, row) in touch.row(k) {
                    inertia.add_impulse(i, &row, *p);
                }
            }
        }
    }

    /// Δt f is without them again.
    pub(crate) fn take_out(&self, inertia: &mut Inertia, held: bool) {
        if !self.is_empty() {
            inertia.impulse.copy_from(&self.free[usize::from(held)]);
        }
    }

    /// u of each contact with the system's data' v + Δv, without its σ p, into `rates`.
    pub(crate) fn rates(&self, system_data: &SystemData, rates: &mut Vec<f64>) {
        rates.clear();
        for touch in &self.touches {
            let [n, s, t] = touch.rates(|i| system_data.rates_after_solve(i));
            let [across, over] = touch.turn;
            rates.extend([n + touch.offset + touch.aim, s + across, t + over]);
        }
    }

    /// Adds σ p to u.
    pub(crate) fn regularize(&self, rates: &mut [f64]) {
        self.operator.add_regularization(&self.touches, rates);
    }

    /// True if the regularisation of a contact admits a depth above [`SUNK`] of the size of its
    /// shapes: the bodies differ too much in mass, or the contact was softened for want of a solution.
    /// Or if one that presses is deeper than [`CRUSHED`] of that, on surfaces that are not meant to be
    /// soft: the bodies are too heavy for what they yield.
    pub(crate) fn sink(&self, dt: f64) -> bool {
        let sinks = |(i, touch): (usize, &ContactPoint)| {
            let (pressed, size) = (touch.impulse[0], touch.found.size());
            let soft = touch.found.surface.compliance > 2.0 * Surface::default().compliance;
            let crushed = pressed > 0.0 && !soft && -touch.found.gap > CRUSHED * size;
            self.operator.floor(i) * pressed * dt > SUNK * size || crushed
        };
        self.touches.iter().enumerate().any(sinks)
    }

    pub(crate) fn none_active(&self) -> bool {
        self.touches.iter().all(|touch| !touch.active)
    }

    /// Contacts that carry an impulse, or whose rates u are less than `close` (m/s) from being passed through, become active;
    /// whether there are new ones.
    pub(crate) fn activate(&mut self, rates: &[f64], close: f64) -> bool {
        let mut new = false;
        for (touch, rate) in self.touches.iter_mut().zip(rates.as_chunks::<3>().0) {
            if !touch.active && (touch.impulse[0] > 0.0 || rate[0] < close) {
                (touch.active, new) = (true, true);
            }
        }
        new
    }

    /// Violation of the conditions of contact `n` by the rates u \[m/s].
    fn residual(&self, n: usize, rates: &[f64]) -> f64 {
        let touch = &self.touches[n];
        let inert = touch.impulse.map(|p| self.operator.weight(n) * p);
        let rate = std::array::from_fn(|k| rates[3 * n + k]);
        violation(inert, rate, touch.found.surface.friction)
    }

    /// Largest violation of the conditions by the rates u, over the largest of all rates, or over `least` (m/s), that of a weight
    /// in a step: where ropes carry the weight, the rates are its rounding.
    pub(crate) fn violation(&self, rates: &[f64], system_data: &SystemData, least: f64) -> f64 {
        let (mut worst, mut size) = (0.0_f64, least);
        for (n, touch) in self.touches.iter().enumerate() {
            worst = worse(worst, self.residual(n, rates));
            let before = touch.rates(|i| system_data.v.get(i));
            for (before, p) in before.iter().zip(touch.impulse) {
                let inert = self.operator.weight(n) * p;
                size = size.max(before.abs()).max(inert.abs());
            }
        }
        if size > 0.0 { worst / size } else { worst }
    }

    /// Writes the state of the contacts after the step into `report`, with the violation `found`.
    pub(crate) fn count(&self, report: &mut ContactReport, found: f64, dt: f64) {
        report.touching = 0;
        report.sliding = 0;
        report.complementarity = worse(report.complementarity, found);
        let largest = self
            .touches
            .iter()
            .flat_map(|t| t.impulse)
            .fold(0.0, |m: f64, p| m.max(p.abs()));
        for (i, touch) in self.touches.iter().enumerate() {
            let residual = self.residual(i, &self.rates);
            let force = residual / (self.operator.weight(i) * dt);
            report.residual_gap = worse(report.residual_gap, residual * dt);
            report.residual_force = worse(report.residual_force, force);
            let [n, s, t] = touch.impulse;
            let (friction, across) = (touch.found.surface.friction, s.hypot(t));
            report.touching += usize::from(n > 0.0);
            report.sliding += usize::from(n > 0.0 && across >= friction * n * (1.0 - 1e-9));
            let beyond = (across - friction * n).max(0.0).max(-n);
            if beyond > 0.0 {
                report.cone = report.cone.max(beyond / largest);
            }
            report.deepest = report.deepest.max(-touch.found.gap);
        }
        report.near = self.touches.len();
        report.groups = self.operator.groups.split();
        report.load = self.touches.iter().map(|t| t.impulse[0]).sum::<f64>() / dt;
    }
}

#[cfg(test)]
pub(crate) mod tests;
