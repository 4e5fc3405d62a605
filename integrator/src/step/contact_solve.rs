//! The step's solve with contacts: see [`crate::contact`].

use super::Step;
use crate::contact::groups::LIMIT;
use crate::contact::rebound::Budget;
use crate::response::factor_of;
use crate::system_data::SystemData;
use crate::{Phase, StepError};
use nalgebra::Vector3;
use taut_model::{Bodies, BodyVectors};
use taut_solver::SolveError;
use taut_solver::coulomb::ConeMethod;

/// Solutions through W at most: what it is inexact by each takes away.
const PASSES: usize = 6;

/// Largest violation of the contacts' conditions, over the size of their rates, that needs no further pass.
const TOLERANCE: f64 = 1e-10;

impl Step {
    /// Finds the contacts of a step of `dt` from the present state.
    pub(crate) fn find_contacts(&mut self, dt: f64, of_scheme: bool) -> Result<(), StepError> {
        self.contacts.of_scheme = of_scheme;
        // Implicit sub-steps leave the velocities of a staggered scheme half of its step behind.
        let parts = self.options.substeps as f64 * f64::from(self.guarded.division.parts);
        self.contacts.late = match self.options.scheme.is_staggered() {
            true => 0.5 * self.options.dt / parts,
            false => 0.5 * dt,
        };
        self.contacts.find(&self.scene, dt, self.time == 0.0)?;
        Ok(())
    }

    /// Tells the contacts of the last solve with its impulses, found again at the present state: no step of a run that is asleep finds
    /// them.
    pub(crate) fn tell_known_contacts(&mut self) -> Result<(), StepError> {
        let (known, dt) = self.contacts.known();
        if known.is_empty() {
            return Ok(());
        }
        self.contacts.find(&self.scene, dt, false)?;
        let contacts = self.contacts.reported(&self.system_data);
        let contacts = contacts.map(|(_, contact)| contact).collect();
        self.output.reported.put_contacts(contacts);
        Ok(())
    }

    /// After a solve with the contacts' impulses as they were: the solution with those that keep their conditions.
    pub(crate) fn solve_contacts(&mut self, dt: f64) -> Result<(), StepError> {
        let rebounds = self.contacts.rebounds;
        let mut found = self.pass_through(dt, TOLERANCE, Self::solve_rows_again)?;
        if self.jams() {
            self.contacts.rebounds = false;
            let passed = self.pass_through(dt, TOLERANCE, Self::solve_rows_again);
            self.contacts.rebounds = rebounds;
            found = passed?;
        }
        self.contacts.remember(dt);
        self.contacts.count(&mut self.tally.contacts, found, dt);
        let decided = found <= TOLERANCE && !self.contacts.sink(dt);
        self.tally.undecided += usize::from(!decided);
        Ok(())
    }

    /// True if friction wedges what has to rebound: see [`Contacts::jam`](crate::contact::Contacts::jam).
    fn jams(&self) -> bool {
        if !self.contacts.rebound_is_due() {
            return false;
        }
        let (scene, v) = (&self.scene, &self.system_data.v);
        let fall = scene.gravity.norm() * self.contacts.dt();
        self.contacts.jam(scene.mass(), fall, |i| v.get(i))
    }

    /// Passes through W until the conditions hold to `tolerance`; `solve` finds μ for the contacts' impulses. The largest
    /// violation that is left, over the size of the rates.
    pub(crate) fn pass_through(
        &mut self,
        dt: f64,
        tolerance: f64,
        mut solve: impl FnMut(&mut Self) -> Result<(), StepError>,
    ) -> Result<f64, StepError> {
        let mut rates = std::mem::take(&mut self.contacts.rates);
        let done = self.passes(dt, tolerance, &mut rates, &mut solve);
        self.contacts.rates = rates;
        done
    }

    fn passes(
        &mut self,
        dt: f64,
        tolerance: f64,
        rates: &mut Vec<f64>,
        solve: &mut impl FnMut(&mut Self) -> Result<(), StepError>,
    ) -> Result<f64, StepError> {
        // A pass takes away what W is inexact by; what sweeps leave is their answer.
        let mut passes = match self.options.contacts {
            ConeMethod::Newton => PASSES,
            _ => 1,
        };
        let close = self.scene.gravity.norm() * dt;
        for pass in 0.. {
            self.system_data
                .update_velocity_change(&self.multipliers.mu);
            self.contacts.rates(&self.system_data, rates);
            // W is that of another matrix at first.
            let new = self.contacts.activate(rates, close) || pass == 0;
            // A changed pattern of slipping sheaves changes W.
            let other = std::mem::take(&mut self.slip.has_changed);
            if (new || other) && self.build_operator()? {
                self.contacts.rates(&self.system_data, rates);
            }
            self.contacts.regularize(rates);
            let found = self.contacts.violation(rates, &self.system_data, close);
            let settled = found <= tolerance && (!new || self.contacts.none_active());
            if passes == 0 || settled {
                return Ok(found);
            }
            // Contacts become active one after the other at worst.
            passes -= usize::from(!new);
            let done = self.solve_dense(dt, rates, pass == 0);
            self.contacts.apply(&mut self.system_data.inertia, true);
            self.tally.end(Phase::Solve);
            self.effort.check(self.time)?;
            // Where no impulses are found, further passes find none either.
            if !done.map_err(|e| self.culprit(e))? {
                passes = passes.min(1);
            }
            solve(self)?;
            if self.effort.is_spent() {
                self.system_data
                    .update_velocity_change(&self.multipliers.mu);
                self.contacts.rates(&self.system_data, rates);
                self.contacts.regularize(rates);
                return Ok(self.contacts.violation(rates, &self.system_data, close));
            }
        }
        Ok(f64::NAN)
    }

    /// The contacts' impulses through W for their rates u, which become those without impulses; whether all were found.
    pub(super) fn solve_dense(
        &mut self,
        dt: f64,
        rates: &mut [f64],
        first: bool,
    ) -> Result<bool, SolveError> {
        let mut factor = factor_of!(self, Some(&mut self.slip));
        let (contacts, tally) = (&mut self.contacts, &mut self.tally);
        let (operator, touches) = (&mut contacts.operator, &mut contacts.touches);
        operator.take_away(touches, rates, &mut factor)?;
        if first {
            let after_blow = self.activation.made().iter().any(|row| row.age == 0);
            let bodies = &self.scene.bodies;
            let is_dynamic = |i| bodies.is_dynamic(i);
            let of = (self.options.contacts, &*rates);
            contacts.find_carried(of, is_dynamic, &mut factor, |report, softer| {
                tally.contacts.add(&report, softer);
            })?;
            contacts.aim(&self.system_data, rates, dt, after_blow);
        }
        let (operator, touches) = (&mut contacts.operator, &mut contacts.touches);
        let method = self.options.contacts;
        operator.solve(method, touches, rates, &mut factor, |report, softer| {
            tally.contacts.add(&report, softer);
        })
    }

    /// W of the active contacts; whether some became rigid.
    pub(super) fn build_operator(&mut self) -> Result<bool, StepError> {
        let mut factor = factor_of!(self, Some(&mut self.slip));
        let contacts = &mut self.contacts;
        let (operator, touches) = (&mut contacts.operator, &mut contacts.touches);
        let active = touches.iter().filter(|touch| touch.active).count();
        if active > LIMIT {
            return Err(StepError::TooManyContacts {
                contacts: active,
                most: LIMIT,
                time: self.time,
            });
        }
        operator.groups.divide(&self.system_data, touches);
        factor.effort.allow(operator.groups.count());
        let hardened = operator.harden(&self.scene, touches);
        let report = operator.build(&self.system_data, touches, &mut factor);
        let report = report.map_err(|e| self.culprit(e))?;
        self.effort.check(self.time)?;
        self.tally.add_part(report);
        self.tally.end(Phase::Solve);
        Ok(hardened)
    }

    /// After a step of the scheme: what arrived in it leaves with its restitution.
    pub(crate) fn rebound(&mut self) -> Result<(), StepError> {
        if !self.contacts.rebound_is_due() {
            return Ok(());
        }
        let [mut impulse, mut change] = std::mem::take(&mut self.contacts.blow);
        let mut mu = std::mem::take(&mut self.contacts.joints);
        let done = self.find_blow(&mut impulse, &mut change, &mut mu);
        if let Ok(Some(budget)) = done {
            self.strike(budget, &change, &mu);
        }
        (self.contacts.blow, self.contacts.joints) = ([impulse, change], mu);
        if done?.is_none() {
            self.contacts.resting.fill([0.0; 3]);
        }
        self.contacts.end_rebound();
        // The rates of the step are those before the blow. A drum that has emptied in it stands.
        let rows = &self.system_data.rows;
        self.history.forget(&rows.phi_t);
        for k in self.active_set.emptied() {
            self.history.phi_t[rows.bounds[k].row] = 0.0;
        }
        Ok(())
    }

    /// Impulses of the rebounds, and what joints make of them: by bodies, with the change of velocities, and by rows in `mu`.
    /// The blow comes after the bodies have moved, and the rows are those of that state: where a light body has a long lever
    /// those of the beginning leave its joint with the velocity of a turn. A row that would go beyond its bound, as a rope that
    /// would push, has no part in the blow. `None` where the shapes jam.
    fn find_blow(
        &mut self,
        impulse: &mut BodyVectors,
        change: &mut BodyVectors,
        mu: &mut Vec<f64>,
    ) -> Result<Option<Budget>, StepError> {
        let spent = self.begin_rebound()?;
        loop {
            if self.system_data.rows.rows() > 0 {
                self.active_set
                    .hold(&mut self.system_data, self.multipliers.mu_dt);
                let built = self.build_for_blow();
                self.active_set.release(&mut self.system_data);
                built?;
            }
            let budget = self.solve_rebound(spent)?;
            self.effort.check(self.time)?;
            self.blow(impulse, change, mu)?;
            let impulses = [&*self.multipliers.mu, &*mu];
            let dt = self.multipliers.mu_dt;
            if !self.active_set.let_go(&self.system_data, impulses, dt) {
                let jams = self.jams();
                if jams {
                    self.contacts.rest();
                }
                return Ok((!jams).then_some(budget));
            }
            self.contacts.rest();
        }
    }

    /// The factor and W of the rows at the present state, without those that are held at bounds.
    fn build_for_blow(&mut self) -> Result<(), StepError> {
        self.assemble(self.multipliers.mu_dt);
        let factorized = self.system.solver.factorize(&self.system.matrix);
        factorized.map_err(|e| self.culprit(e))?;
        self.build_operator().map(|_| ())
    }

    /// Energy that the step's impulses have added, of the rates that it was solved for.
    fn begin_rebound(&mut self) -> Result<f64, StepError> {
        let mut factor = factor_of!(self, None);
        let (contacts, bodies) = (&mut self.contacts, &self.scene.bodies);
        let (v, dv) = (&self.system_data.v, &self.system_data.dv);
        // Passes of an implicit step turn on from the last one.
        let of_scheme = contacts.of_scheme;
        let solved_for = |i: usize| match of_scheme {
            true => std::array::from_fn(|k| v.get(i)[k] + dv.get(i)[k]),
            false => bodies.rates(i),
        };
        let begun = |i: usize| v.get(i);
        let spent = contacts.begin_rebound([&begun, &solved_for], &mut factor);
        spent.map_err(|e| self.culprit(e))
    }

    /// The contacts' impulses of the rebounds, after the step's have `spent` so much energy (J).
    fn solve_rebound(&mut self, spent: f64) -> Result<Budget, StepError> {
        // A cable sticks to its sheaves in the instant of a blow.
        let mut factor = factor_of!(self, None);
        let (contacts, tally) = (&mut self.contacts, &mut self.tally);
        let bodies = &self.scene.bodies;
        let mut solved = true;
        let done = contacts.rebound(
            (self.options.contacts, contacts.dt(), spent),
            |i| bodies.rates(i),
            &mut factor,
            |report, softer| {
                tally.contacts.add(&report, softer);
                solved = report.solved;
            },
        );
        tally.undecided += usize::from(!solved);
        done.map_err(|e| self.culprit(e))
    }

    /// The velocities change as far as the blow has the energy for, and the work of what is driven: the law of impact is the same for
    /// shapes that move together.
    fn strike(&mut self, budget: Budget, change: &BodyVectors, mu: &[f64]) {
        let (linear, square) = works(&self.scene.bodies, change);
        let by_rows = self.work_by_rows(mu);
        let part = budget.part(linear - self.work_by_contacts() - by_rows, square);
        if part < 1.0 {
            self.contacts.lessen(part);
        }
        self.account_for_blow(part * by_rows);
        let bodies = &mut self.scene.bodies;
        for i in 0..bodies.len() {
            if bodies.is_dynamic(i) {
                let [x, y, z, p, q, r] = change.get(i);
                bodies.velocity[i] += Vector3::new(x, y, z) * part;
                bodies.angular_velocity[i] += Vector3::new(p, q, r) * part;
            }
        }
        self.add_blow(mu, part);
    }

    /// The impulses of contacts and joints by bodies, and the change of velocities.
    fn blow(
        &mut self,
        impulse: &mut BodyVectors,
        change: &mut BodyVectors,
        mu: &mut Vec<f64>,
    ) -> Result<(), StepError> {
        impulse.clear();
        change.clear();
        for touch in &self.contacts.touches {
            touch.add_to(impulse);
        }
        let SystemData { rows, inertia, .. } = &self.system_data;
        inertia.correct_velocities(impulse, change);
        if rows.rows() > 0 {
            mu.clear();
            mu.resize(rows.rows(), 0.0);
            rows.times_jacobian(change, mu);
            for k in (0..rows.bounds.len()).filter(|k| self.active_set.holds(*k)) {
                mu[rows.bounds[k].row] = 0.0;
            }
            mu.iter_mut().for_each(|rate| *rate = -*rate);
            let report = factor_of!(self, None).respond(mu);
            let report = report.map_err(|e| self.culprit(e))?;
            self.tally.add_part(report);
            let SystemData { rows, inertia, .. } = &self.system_data;
            rows.add_transposed(mu, impulse);
            inertia.correct_velocities(impulse, change);
        }
        Ok(())
    }
}

/// v·M Δv and Δv·M Δv of dynamic bodies as they stand, for a change Δv of their velocities \[J].
pub(crate) fn works(bodies: &Bodies, change: &BodyVectors) -> (f64, f64) {
    let (mut linear, mut square) = (0.0, 0.0);
    for i in (0..bodies.len()).filter(|i| bodies.is_dynamic(*i)) {
        let [x, y, z, p, q, r] = change.get(i);
        let (dv, dw) = (Vector3::new(x, y, z), Vector3::new(p, q, r));
        let (momentum, spin) = (dv * bodies.mass[i], bodies.inertia_world(i) * dw);
        linear += bodies.velocity[i].dot(&momentum) + bodies.angular_velocity[i].dot(&spin);
        square += dv.dot(&momentum) + dw.dot(&spin);
    }
    (linear, square)
}
