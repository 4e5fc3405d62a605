//! Contacts that are hit.
//!
//! The law of impact knows no compliance, and shapes that arrive are stopped within one step: where Δt is not long against
//! √(m ε) a contact's spring would slow them down over several steps, of which the last ones know nothing of the speed of
//! arrival. So a contact is rigid, σ = 0, in a step that it is hit in, and so are all contacts of its island, through which the
//! blow passes on. What the spring of one has explained of its depth stays: u_N ≥ 0 of that part.
//!
//! A contact is hit where its shapes close faster than [`slowest`](super::rebound::slowest). Where one that touches carried a
//! force in the last step, they have to close faster than the swing of what it carries on its own spring, g √(ε m) with the
//! mass m of both bodies as seen along the normal: a weight on a spring that is let go reaches no more. What a driven body
//! pushes gives way by compliance alone, so that in its island only contacts that had carried nothing become rigid as they are
//! hit. So does what joints hold, as a motor at its speed does: where they leave nothing of the contact's W but rounding, it keeps
//! its spring, until a motor comes to its limit of force.

use super::operator::Operator;
use super::{ContactPoint, Contacts};
use nalgebra::Vector3;
use taut_model::{BodyVectors, Scene};

impl ContactPoint {
    /// 1/m + (r × n)·I⁻¹ (r × n) of its bodies without joints and other contacts \[1/kg].
    pub(super) fn mobility(&self, scene: &Scene) -> f64 {
        let bodies = &scene.bodies;
        let of = |(i, [x, y, z, p, q, r]): (usize, [f64; 6])| {
            if !bodies.is_dynamic(i) {
                return 0.0;
            }
            let line = Vector3::new(x, y, z).norm_squared() / bodies.mass[i];
            if bodies.is_point(i) {
                return line;
            }
            let turn = bodies.orientation[i].inverse() * Vector3::new(p, q, r);
            let inverse = bodies.inertia[i].try_inverse().unwrap_or_default();
            line + turn.dot(&(inverse * turn))
        };
        self.row(0).map(of).sum()
    }

    /// True if the shapes touch and the contact carried a force in the last step.
    fn carries(&self) -> bool {
        self.impulse[0] > 0.0 && self.found.gap <= 0.0
    }

    /// Decides whether the contact is hit, from the impulse of the last step: its shapes have to
    /// close faster than `slowest` (m/s).
    pub(super) fn meet(&mut self, scene: &Scene, slowest: f64) {
        let rate = self.normal_rate(|i| scene.bodies.rates(i));
        if rate >= -slowest {
            return;
        }
        let mut least = slowest;
        if self.carries() {
            let mass = self.mobility(scene).recip();
            let swing = scene.gravity.norm() * (self.found.surface.compliance * mass).sqrt();
            least = least.max(swing);
        }
        (self.hit, self.arrives) = (rate < -least, !self.carries());
    }

    /// Direction in which it pushes `body`; zero where that is not in contact.
    pub(crate) fn push(&self, body: usize) -> Vector3<f64> {
        let own = self
            .carriers()
            .iter()
            .filter(|carrier| carrier.body == body);
        own.fold(Vector3::zeros(), |sum, carrier| {
            sum + self.axes[0] * carrier.part
        })
    }

    /// True if one of the bodies is driven and moves.
    fn is_driven(&self, scene: &Scene) -> bool {
        let carriers = self.carriers().iter();
        let mut moves = carriers.map(|of| (of.body, scene.bodies.rates(of.body)));
        moves.any(|(i, rates)| !scene.bodies.is_dynamic(i) && rates != [0.0; 6])
    }

    /// Makes the contact rigid for this step; false if it was rigid before.
    fn harden(&mut self) -> bool {
        let soft = self.softness != 0.0;
        if soft {
            self.spring = [self.softness, self.offset];
            self.softness = 0.0;
            self.offset = self.rigid;
        }
        soft
    }

    /// Gives the contact the spring back that a blow took, if any: joints hold its bodies against each other.
    pub(super) fn soften(&mut self) {
        if self.struck && self.softness == 0.0 && self.spring[0] > 0.0 {
            [self.softness, self.offset] = self.spring;
        }
    }
}

impl Contacts {
    /// Largest mass of a dynamic body that presses on `body` against a `pull` on it \[kg].
    pub(crate) fn heaviest_on(&self, scene: &Scene, body: usize, pull: &Vector3<f64>) -> f64 {
        let pressing = self.touches.iter().filter(|touch| touch.impulse[0] > 0.0);
        let against = pressing.filter(|touch| touch.push(body).dot(pull) < 0.0);
        let others = against
            .flat_map(ContactPoint::carriers)
            .map(|carrier| carrier.body);
        others
            .filter(|&other| other != body && scene.bodies.is_dynamic(other))
            .fold(0.0, |most, other| scene.bodies.mass[other].max(most))
    }

    /// Contacts whose shapes are thrown back in the step.
    pub(crate) fn thrown_back(&self) -> impl Iterator<Item = &ContactPoint> {
        self.touches.iter().filter(|touch| touch.rebound.is_some())
    }

    /// Those, and where they count the ones that `land`: that press now and did not in the step before.
    pub(crate) fn struck(&self, land: bool) -> impl Iterator<Item = &ContactPoint> {
        let landed = move |touch: &ContactPoint| land && touch.arrives && touch.impulse[0] > 0.0;
        let touches = self.touches.iter();
        touches.filter(move |touch| touch.rebound.is_some() || landed(touch))
    }

    /// Contacts that press now and did not in the step before.
    fn landed(&self) -> impl Iterator<Item = &ContactPoint> {
        let touches = self.touches.iter();
        touches.filter(|touch| touch.arrives && touch.impulse[0] > 0.0)
    }

    /// True if something lands in the step.
    pub(crate) fn lands(&self) -> bool {
        self.landed().next().is_some()
    }

    /// Fastest speed, at the velocities `v`, at which `body` lands on what pushes it along a `pull` on it, and throws it back
    /// if `thrown` \[m/s].
    pub(crate) fn landing(
        &self,
        body: usize,
        v: &BodyVectors,
        pull: &Vector3<f64>,
        thrown: bool,
    ) -> f64 {
        let along = self
            .landed()
            .filter(|touch| !thrown || touch.rebound.is_some())
            .filter(|touch| touch.push(body).dot(pull) > 0.0);
        let speeds = along.map(|touch| -touch.normal_rate(|i| v.get(i)));
        speeds.fold(0.0, f64::max)
    }
}

impl Operator {
    /// Contacts of the islands in which one is hit become rigid; whether any did.
    pub(crate) fn harden(&self, scene: &Scene, touches: &mut [ContactPoint]) -> bool {
        if !touches.iter().any(|touch| touch.hit) {
            return false;
        }
        let mut hardened = false;
        for island in &self.groups.islands {
            let members = &self.groups.order[island.contacts.clone()];
            if !members.iter().any(|i| touches[*i].hit) {
                continue;
            }
            let driven = members.iter().any(|i| touches[*i].is_driven(scene));
            for touch in members.iter() {
                let touch = &mut touches[*touch];
                if !driven || (touch.hit && touch.arrives) {
                    touch.struck = true;
                    hardened |= touch.harden();
                }
            }
        }
        hardened
    }
}
