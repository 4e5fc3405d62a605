//! State to return to, and rates of the past that multistep schemes use.

use crate::contact::{Contacts, Known};
use nalgebra::{UnitQuaternion, Vector3};
use taut_lanes::Aligned;
use taut_model::scene::reeving::RestState;
use taut_model::{Bodies, BodyVectors, Scene};

/// The moving part of [`Bodies`], and the multipliers that go with it.
#[derive(Debug, Clone, Default)]
pub(crate) struct State {
    position: Vec<Vector3<f64>>,
    orientation: Vec<UnitQuaternion<f64>>,
    velocity: Vec<Vector3<f64>>,
    angular_velocity: Vec<Vector3<f64>>,
    mu: Vec<f64>,
    mu_dt: f64,
    /// λ of the geometric stiffness, which need not be `mu` over `mu_dt`.
    tension: Vec<f64>,
    /// Lengths at rest, compliances, winches and cuts of the two parts at each of the scene's
    /// capstans.
    capstan_rest: Vec<[RestState; 2]>,
    /// Impulses of the contacts, and the length of their step \[s].
    known: Vec<Known>,
    known_dt: f64,
    time: f64,
}

impl State {
    pub(crate) fn new(scene: &Scene, rows: usize) -> Self {
        let bodies = &scene.bodies;
        Self {
            position: bodies.position.clone(),
            orientation: bodies.orientation.clone(),
            velocity: bodies.velocity.clone(),
            angular_velocity: bodies.angular_velocity.clone(),
            mu: vec![0.0; rows],
            mu_dt: 1.0,
            tension: vec![0.0; rows],
            capstan_rest: vec![Default::default(); scene.capstans.len()],
            known: Vec::new(),
            known_dt: 1.0,
            time: 0.0,
        }
    }

    /// Takes the state of the scene at `time`, impulses `mu` of a step of `mu_dt`, and the tension.
    pub(crate) fn save(
        &mut self,
        scene: &Scene,
        time: f64,
        (mu, mu_dt): (&[f64], f64),
        tension: &[f64],
    ) {
        let bodies = &scene.bodies;
        for (i, rest) in self.capstan_rest.iter_mut().enumerate() {
            *rest = scene.rest_states(i);
        }
        self.position.copy_from_slice(&bodies.position);
        self.orientation.copy_from_slice(&bodies.orientation);
        self.velocity.copy_from_slice(&bodies.velocity);
        self.angular_velocity
            .copy_from_slice(&bodies.angular_velocity);
        self.mu.copy_from_slice(mu);
        self.tension.copy_from_slice(tension);
        (self.mu_dt, self.time) = (mu_dt, time);
    }

    /// Puts the bodies back; returns their time.
    pub(crate) fn restore(&self, bodies: &mut Bodies) -> f64 {
        bodies.position.copy_from_slice(&self.position);
        bodies.orientation.copy_from_slice(&self.orientation);
        bodies.velocity.copy_from_slice(&self.velocity);
        bodies
            .angular_velocity
            .copy_from_slice(&self.angular_velocity);
        self.time
    }

    /// Puts the lengths of cables over sheaves with friction back.
    pub(crate) fn restore_lengths(&self, scene: &mut Scene) {
        for (i, rest) in self.capstan_rest.iter().enumerate() {
            scene.restore_rest(i, rest);
        }
    }

    /// Takes the contacts' impulses. Allocates only where there are more than before.
    pub(crate) fn save_contacts(&mut self, contacts: &Contacts) {
        let (known, known_dt) = contacts.known();
        self.known.clear();
        self.known.extend_from_slice(known);
        self.known_dt = known_dt;
    }

    /// Puts the contacts' impulses back.
    pub(crate) fn restore_contacts(&self, contacts: &mut Contacts) {
        contacts.remember_again(&self.known, self.known_dt);
    }

    /// Orientation of body `i`.
    pub(crate) fn orientation(&self, i: usize) -> &UnitQuaternion<f64> {
        &self.orientation[i]
    }

    /// Puts the impulses and the tension back; returns the length of the impulses' step.
    pub(crate) fn restore_multipliers(&self, mu: &mut [f64], tension: &mut [f64]) -> f64 {
        mu.copy_from_slice(&self.mu);
        tension.copy_from_slice(&self.tension);
        self.mu_dt
    }
}

/// Rates of the step before: r_{n−1} of the rows, v_{n−1} of the bodies.
#[derive(Debug, Clone)]
pub(crate) struct History {
    /// True if the rates are those of the step before; else the past is taken to be like the
    /// present.
    pub(crate) known: bool,
    /// r_{n−1} = J v + ∂φ/∂t, one a row.
    pub(crate) rate: Aligned,
    /// r_n of the step under way, one a row.
    pub(crate) rate_now: Aligned,
    /// ∂φ/∂t of the last step, one a row.
    pub(crate) phi_t: Aligned,
    /// v_{n−1}.
    pub(crate) v: BodyVectors,
}

impl History {
    pub(crate) fn new(rows: usize, bodies: usize) -> Self {
        Self {
            known: false,
            rate: Aligned::new(rows),
            rate_now: Aligned::new(rows),
            phi_t: Aligned::new(rows),
            v: BodyVectors::new(bodies),
        }
    }

    /// The past is like the present, of rates `jv` = J v: r_{n−1} = r_n.
    pub(crate) fn take_rates(&mut self, jv: &[f64]) {
        for (rate, (jv, phi_t)) in self.rate.iter_mut().zip(jv.iter().zip(&self.phi_t)) {
            *rate = jv + phi_t;
        }
    }

    /// The step under way is done: `v` is what it started from, `phi_t` its ∂φ/∂t.
    pub(crate) fn accept(&mut self, v: &BodyVectors, phi_t: &[f64]) {
        std::mem::swap(&mut self.rate, &mut self.rate_now);
        self.v.copy_from(v);
        self.phi_t.copy_from_slice(phi_t);
        self.known = true;
    }

    /// The past no longer belongs to the present; `phi_t` is that of the last step.
    pub(crate) fn forget(&mut self, phi_t: &[f64]) {
        self.phi_t.copy_from_slice(phi_t);
        self.known = false;
    }
}
