//! Forces that a step tells: their means over it.
//!
//! A step of several sub-steps, in parts, or redone by the guard has a solve for each of them, and the last one does not know of
//! a catch in an earlier one. With the impulses μ_k of all of them a step of Δt tells
//!
//! ```text
//! λ = 1/Δt Σ_k μ_k
//! ```
//!
//! of rows, and likewise of contacts: the sum of λ Δt over a run is that of its impulses, whatever the sub-steps. What joints carry
//! of a blow between shapes is part of it. Motion and energies are those of the sub-steps.

use super::Step;
use crate::ContactForce;
use nalgebra::Vector3;
use taut_lanes::Aligned;

/// A contact of the step, with the sum of its impulses \[N s] in place of its force.
#[derive(Debug, Clone)]
struct Touched {
    key: Vector3<f64>,
    contact: ContactForce,
    /// True once the present sub-step has found it again.
    taken: bool,
}

/// Sums over the sub-steps of a step.
#[derive(Debug, Clone)]
pub(crate) struct Reported {
    /// Σ μ of the sub-steps so far, one a row \[N s, N m s]; λ once the step is done \[N, N m].
    pub(crate) sum: Aligned,
    touched: Vec<Touched>,
    /// Time of the sub-steps so far \[s].
    time: f64,
    /// Largest measure of each event of the scene over the sub-steps: the force \[N], or minus the distance \[m].
    pub(crate) met: Vec<f64>,
    /// True once the present step has more forces than those of its last solve.
    pub(crate) opened: bool,
    /// True where these are reported, and not the forces of the last solve.
    tells: bool,
    /// Contacts of the step before the scene was changed.
    of_before: Option<Vec<ContactForce>>,
}

impl Reported {
    /// Those of the last solve are reported.
    pub(crate) fn new(rows: usize) -> Self {
        Self {
            sum: Aligned::new(rows),
            touched: Vec::new(),
            time: 0.0,
            met: Vec::new(),
            opened: false,
            tells: false,
            of_before: None,
        }
    }

    /// Forces λ of all rows, where they are not those of the last solve \[N, N m].
    pub(crate) fn forces(&self) -> Option<&[f64]> {
        self.tells.then_some(&*self.sum)
    }

    /// Contacts, where they are not those of the last sub-step.
    pub(crate) fn contacts(&self) -> Option<impl Iterator<Item = ContactForce> + '_> {
        if !self.tells && self.of_before.is_none() {
            return None;
        }
        let of_sum = self.touched.iter().map(|touched| touched.contact);
        Some(of_sum.chain(self.of_before.iter().flatten().copied()))
    }

    /// Takes the contacts that the step had before the scene was changed.
    pub(crate) fn put_contacts(&mut self, of_before: Vec<ContactForce>) {
        self.touched.clear();
        self.of_before = Some(of_before);
    }

    /// Takes forces that another run reported.
    pub(crate) fn put(&mut self, forces: Vec<f64>) {
        (self.sum, self.tells) = (forces.into(), true);
        self.touched.clear();
    }

    /// Those of the last solve are reported again.
    pub(crate) fn forget(&mut self) {
        (self.time, self.opened, self.tells) = (0.0, false, false);
        self.of_before = None;
    }

    /// The sums become means over their time, which are reported. Those of one solve alone stay as they are.
    fn close(&mut self) {
        let factor = 1.0 / self.time;
        self.sum.iter_mut().for_each(|force| *force *= factor);
        for touched in &mut self.touched {
            touched.contact.force *= factor;
        }
        self.tells = true;
    }

    /// Adds impulses of rows.
    pub(super) fn add(&mut self, mu: &[f64], factor: f64) {
        let sum = self.sum.iter_mut().zip(mu);
        sum.for_each(|(sum, mu)| *sum += factor * mu);
    }

    /// Sums start from nothing, where there are none yet.
    fn open(&mut self) {
        if !self.opened {
            self.opened = true;
            self.sum.fill(0.0);
            self.touched.clear();
        }
    }

    /// The contact of the same shapes nearest to `key` that the present sub-step has not found yet. `touched` is sorted.
    fn find<'a>(
        touched: &'a mut [Touched],
        colliders: [usize; 2],
        key: &Vector3<f64>,
    ) -> Option<&'a mut Touched> {
        let first = touched.partition_point(|touched| touched.contact.colliders < colliders);
        let apart = |touched: &Touched| (touched.key - key).norm_squared();
        touched[first..]
            .iter_mut()
            .take_while(|touched| touched.contact.colliders == colliders)
            .filter(|touched| !touched.taken)
            .min_by(|a, b| apart(a).total_cmp(&apart(b)))
    }
}

impl Step {
    /// Adds a sub-step of `dt`. In a divided step the sums of its parts' rows are those of the division.
    pub(super) fn accumulate_forces(&mut self, dt: f64) {
        self.output.reported.open();
        self.output.reported.time += dt;
        if self.is_divided() {
            self.add_part();
        } else {
            self.output.reported.add(&self.multipliers.mu, 1.0);
        }
        let Reported { touched, .. } = &mut self.output.reported;
        touched.iter_mut().for_each(|touched| touched.taken = false);
        let known = touched.len();
        for (key, mut contact) in self.contacts.reported(&self.system_data) {
            contact.force *= dt;
            match Reported::find(&mut touched[..known], contact.colliders, &key) {
                Some(same) => {
                    contact.force += same.contact.force;
                    *same = Touched {
                        key,
                        contact,
                        taken: true,
                    };
                }
                None => touched.push(Touched {
                    key,
                    contact,
                    taken: true,
                }),
            }
        }
        if touched.len() > known {
            touched.sort_unstable_by_key(|touched| touched.contact.colliders);
        }
    }

    /// `part` of the joints' impulses `mu` in a blow after the sub-step.
    pub(crate) fn add_blow(&mut self, mu: &[f64], part: f64) {
        if !mu.is_empty() {
            self.output.reported.open();
            self.output.reported.add(mu, part);
        }
    }

    /// The step is done, with more forces than those of its last solve: means are reported from here on.
    pub(crate) fn close_output(&mut self) {
        self.output.reported.close();
        if !self.output.reported.touched.is_empty() {
            let contacts = self
                .output
                .reported
                .touched
                .iter()
                .map(|touched| &touched.contact);
            self.tally.contacts.load = contacts.map(|c| c.force.dot(&c.normal)).sum();
        }
        self.measure_events();
    }
}

#[cfg(test)]
mod tests;
