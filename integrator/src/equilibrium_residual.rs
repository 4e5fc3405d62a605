//! Distance of a state at rest from equilibrium, as one number.
//!
//! With the multipliers λ of the last solve an equilibrium has, for each dynamic body and each row,
//!
//! ```text
//! f + Jᵀ λ = 0,    ε λ + φ = 0
//! ```
//!
//! with f of gravity and external loads, and J and φ of the present state. The first is compared with the largest sum of
//! the magnitudes of all that acts on one body; torques count over the longest lever arm of the body, so that they are
//! forces too. The second is a force (ε λ + φ)/ε where the row is soft, compared with the same, and a length or an angle
//! where it is stiff, compared with the scene's extent or a radian: whichever is less. φ/ε alone would magnify the
//! rounding of φ by the stiffness, and has no meaning for rigid rows. A scene without loads has nothing to compare with
//! where its forces are far below those that rounding of φ makes: it is at rest.

use crate::geometric::wrench;
use crate::step::Step;
use nalgebra::Vector3;
use taut_model::Scene;

/// Part of the forces of rounding below which an unloaded scene has no prestress.
const NOTHING: f64 = 1e-6;

/// Forces on one body.
#[derive(Debug, Clone, Copy, Default)]
struct Acting {
    /// Sums \[N, N m].
    force: Vector3<f64>,
    torque: Vector3<f64>,
    /// Sums of the magnitudes \[N, N m].
    forces: f64,
    torques: f64,
    /// Longest lever arm \[m].
    arm: f64,
}

impl Acting {
    fn add(&mut self, force: &Vector3<f64>, torque: &Vector3<f64>, lever: &Vector3<f64>) {
        self.force += force;
        self.torque += torque;
        self.forces += force.norm();
        self.torques += lever.norm() * force.norm() + (torque - lever.cross(force)).norm();
        self.arm = self.arm.max(lever.norm());
    }
}

/// Weight, external force and external torque of a body \[N, N m].
fn load_on(scene: &Scene, i: usize) -> (Vector3<f64>, Vector3<f64>) {
    let bodies = &scene.bodies;
    let force = bodies.mass[i] * scene.gravity + bodies.force[i];
    (force, bodies.torque[i])
}

impl Step {
    /// The equilibrium_residual of the present state, as a part of the largest forces.
    pub(crate) fn equilibrium_residual(&self) -> f64 {
        let (scene, rows) = (&self.scene, &self.system_data.rows);
        let mut lambda = self.multipliers.tension.clone();
        // At rest they do nothing.
        for row in rows
            .transverse
            .iter()
            .flat_map(taut_model::Transverse::rows)
        {
            lambda[row] = 0.0;
        }
        let mut balances = vec![Acting::default(); scene.bodies.len()];
        for i in scene.dynamic_bodies() {
            let (force, torque) = load_on(scene, i);
            balances[i].add(&force, &torque, &Vector3::zeros());
        }
        for (s, slot) in rows.slots.iter().enumerate() {
            let (force, torque) = wrench(rows, s, &lambda);
            balances[slot.body].add(&force, &torque, &rows.lever(s));
        }
        let longest = balances.iter().map(|b| b.arm).fold(0.0, f64::max);
        let longest = if longest > 0.0 { longest } else { 1.0 };
        for balance in balances.iter_mut().filter(|b| b.arm == 0.0) {
            balance.arm = longest;
        }
        let dynamic = || scene.dynamic_bodies().map(|i| &balances[i]);
        let largest = dynamic()
            .map(|b| b.forces.max(b.torques / b.arm))
            .fold(0.0, f64::max);
        let extent = self.extent();
        // Rows with a law: number, arm that turns a moment into a force \[m], and scale of the
        // opening \[m or rad].
        let sizes = |c: usize| {
            let arms = rows.slot_range(c).map(|s| balances[rows.slots[s].body].arm);
            let arm = arms.fold(longest, f64::min);
            let of = move |r: usize| match self.system_data.is_angular(r) {
                true => (r, arm, 1.0),
                false => (r, 1.0, extent),
            };
            let active = self.system_data.idle.get(c) != Some(&true);
            let laws = move |r: &usize| active && self.system_data.has_law(*r);
            rows.row_range(c).filter(laws).map(of)
        };
        let laws = || (0..rows.constraints()).flat_map(sizes);
        let is_loaded = |i: usize| load_on(scene, i) != (Vector3::zeros(), Vector3::zeros());
        let soft = laws().filter(|(r, ..)| rows.compliance[*r] > 0.0);
        let rounding = soft.map(|(r, arm, size)| f64::EPSILON * size / rows.compliance[r] / arm);
        let rounding = rounding.fold(0.0, f64::max);
        if !scene.dynamic_bodies().any(is_loaded) && largest <= NOTHING * rounding {
            return 0.0;
        }
        let largest = if largest > 0.0 { largest } else { 1.0 };
        let lacking = dynamic().map(|b| b.force.norm().max(b.torque.norm() / b.arm) / largest);
        let open = laws().map(|(r, arm, size)| {
            let open = (rows.phi[r] + rows.compliance[r] * lambda[r]).abs();
            (open / size).min(open / rows.compliance[r] / (arm * largest))
        });
        // NaN, of 0/0 in a rigid row, is no part.
        lacking.chain(open).fold(0.0, f64::max)
    }

    /// Largest distance of a body from the first, or of an attachment from its body's centre \[m];
    /// 1 m if there is neither.
    pub(crate) fn extent(&self) -> f64 {
        let (bodies, rows) = (&self.scene.bodies, &self.system_data.rows);
        let first = bodies.position.first().copied().unwrap_or_default();
        let way = bodies.position.iter().map(|x| (x - first).norm());
        let arms = (0..rows.slots.len()).map(|s| rows.lever(s).norm());
        let extent = way.chain(arms).fold(0.0, f64::max);
        if extent > 0.0 { extent } else { 1.0 }
    }
}
