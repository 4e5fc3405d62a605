//! The contact problem of a step as a whole, contacts and joints: the global problem of FCLIB (Acary, Brémond, Koziara and
//! Pérignon, *FCLIB: a collection of discrete 3D frictional contact problems*, INRIA RT-444, 2014), with two
//! regularisations besides.
//!
//! ```text
//! M v = H r + G λ + f,    Gᵀ v + Σ_G λ + b = 0,    u = Hᵀ v + Σ_H r + w
//! r_N ≥ 0,  u_N ≥ 0,  r_N u_N = 0,    |r_T| ≤ μ r_N,  u_T = −κ r_T with κ ≥ 0 where it slides, 0 where it sticks
//! ```
//!
//! In the words of [`crate::contact`]: v are the velocities v + Δv of the moving bodies at the end of the step, M = M̃,
//! G = Jᵀ, λ the impulses μ of the joints, H and r the rows and impulses p of the contacts, μ their friction μ_f;
//! f = M̃ v + Δt f, b = −c, w is b of the contacts. What static and driven bodies move is in b and w.

use super::Stage;
use crate::Stepper;
use nalgebra::Matrix6;
use taut_model::body_vectors::unpacked;

/// An entry: row, column, value.
pub type Entry = (usize, usize, f64);

/// A global frictional contact problem of n components of velocity, p rows of joints, n_c contacts and m = 3 n_c rows of
/// contacts, each the normal first, then two tangents. SI units: kg, m/s, N s, and with angles kg m², rad/s, N m s.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContactProblem {
    /// Sizes of the diagonal blocks of M, one a moving body: six, linear before angular, or three of a point mass.
    pub bodies: Vec<usize>,
    /// Columns of G that belong to a joint, joint by joint.
    pub joints: Vec<usize>,
    /// M, n × n, symmetric and positive definite: the lower triangle.
    pub inertia: Vec<Entry>,
    /// G, n × p.
    pub of_joints: Vec<Entry>,
    /// H, n × m.
    pub of_contacts: Vec<Entry>,
    /// f, length n.
    pub impulse: Vec<f64>,
    /// b, length p.
    pub joint_rates: Vec<f64>,
    /// w, length m.
    pub contact_rates: Vec<f64>,
    /// μ, length n_c, ≥ 0.
    pub friction: Vec<f64>,
    /// Diagonal of Σ_G, length p, ≥ 0.
    pub joint_regularization: Vec<f64>,
    /// Diagonal of Σ_H, length m, ≥ 0.
    pub contact_regularization: Vec<f64>,
    /// A solution, where one is known.
    pub solution: Option<ContactSolution>,
}

/// Solution of a [`ContactProblem`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContactSolution {
    /// v, length n. The angular velocities of a spinning body are those before its free rotation in
    /// the step.
    pub velocities: Vec<f64>,
    /// λ, length p.
    pub joints: Vec<f64>,
    /// r, length m. Where Σ_H is small it is nearly one of many solutions.
    pub contacts: Vec<f64>,
}

impl Stepper {
    /// The contact problem of the last [`solve`](Self::solve), that of its last pass, with the solution that it found: of the
    /// contacts that carry an impulse or would be passed through without one. Rows of joints at their bounds are empty
    /// columns of G with a λ of their own, which is in f. `None` where nothing touches or the present state is not
    /// solved. Allocates.
    #[must_use]
    pub fn contact_problem(&mut self) -> Option<ContactProblem> {
        if self.stage != Stage::Solved || self.contacts.none_active() {
            return None;
        }
        // Δt f is to be without contacts and with the rows at their bounds.
        self.contacts.take_out(&mut self.pieces.inertia, false);
        self.bounded.hold(&mut self.pieces, self.mu_dt);
        let mut problem = self.posed();
        self.bounded.release(&mut self.pieces);
        self.contacts.apply(&mut self.pieces.inertia, false);
        let change = self.pieces.dv.clone();
        self.pieces.update_velocity_change(&self.mu);
        let touches = self.contacts.touches.iter().filter(|touch| touch.active);
        problem.solution = Some(ContactSolution {
            velocities: self.velocities(true),
            joints: self.mu.to_vec(),
            contacts: touches.flat_map(|touch| touch.impulse).collect(),
        });
        self.pieces.dv = change;
        Some(problem)
    }

    /// Moving bodies with the first of their components.
    fn components(&self) -> Vec<(usize, usize, usize)> {
        let (bodies, mut first) = (&self.scene.bodies, 0);
        let of = |i| {
            let size = if bodies.is_point(i) { 3 } else { 6 };
            first += size;
            (i, first - size, size)
        };
        self.scene.dynamic_bodies().map(of).collect()
    }

    /// v of the moving bodies, or v + Δv.
    fn velocities(&self, after: bool) -> Vec<f64> {
        let of = |(i, _, size): (usize, usize, usize)| {
            let (v, dv) = (self.pieces.v.get(i), self.pieces.dv.get(i));
            (0..size).map(move |k| if after { v[k] + dv[k] } else { v[k] })
        };
        self.components().into_iter().flat_map(of).collect()
    }

    /// The problem of the pieces as they are.
    fn posed(&self) -> ContactProblem {
        let (rows, inertia) = (&self.pieces.rows, &self.pieces.inertia);
        let mut problem = ContactProblem {
            joints: (0..rows.constraints())
                .map(|c| rows.row_range(c).len())
                .collect(),
            joint_regularization: self.pieces.regularization.sigma.to_vec(),
            joint_rates: self.pieces.rate.iter().map(|rate| -rate).collect(),
            ..ContactProblem::default()
        };
        let mut first_of = vec![None; self.scene.bodies.len()];
        for (i, first, size) in self.components() {
            first_of[i] = Some((first, size));
            problem.bodies.push(size);
            let mut block = Matrix6::from_diagonal_element(inertia.mass[i]);
            let angular = unpacked(inertia.angular.get(i));
            block.fixed_view_mut::<3, 3>(3, 3).copy_from(&angular);
            let (v, impulse) = (self.pieces.v.get(i), inertia.impulse.get(i));
            for (r, row) in block.row_iter().enumerate().take(size) {
                let lower = (0..=r).filter(|c| row[*c] != 0.0);
                let entries = lower.map(|c| (first + r, first + c, row[c]));
                problem.inertia.extend(entries);
                let momentum: f64 = row.iter().zip(v).take(size).map(|(m, v)| m * v).sum();
                problem.impulse.push(momentum + impulse[r]);
            }
        }
        for (s, slot) in rows.slots.iter().enumerate() {
            let start = rows.row_range(slot.constraint).start;
            let Some((first, size)) = first_of[slot.body] else {
                continue;
            };
            let v = self.pieces.v.get(slot.body);
            for (r, row) in rows.block(s).rows().iter().enumerate() {
                add_row(&mut problem.of_joints, row, (first, size), start + r);
                // −c and what other bodies move: −(c − J v) less what moving ones do.
                let moved: f64 = row.iter().zip(v).map(|(j, v)| j * v).sum();
                problem.joint_rates[start + r] -= moved;
            }
        }
        self.pose_contacts(&mut problem, &first_of);
        problem
    }

    /// Rows of the contacts.
    fn pose_contacts(&self, problem: &mut ContactProblem, first_of: &[Option<(usize, usize)>]) {
        let contacts = &self.contacts;
        for (i, touch) in contacts.touches.iter().enumerate() {
            let floor = contacts.operator.floor(i);
            if !touch.active {
                continue;
            }
            problem.friction.push(touch.found.surface.friction);
            for k in 0..3 {
                let column = problem.contact_rates.len();
                let (mut rate, mut sigma) = (0.0, floor);
                if k == 0 {
                    rate += touch.offset + touch.aim;
                    sigma += touch.softness;
                } else {
                    rate += touch.turn[k - 1];
                }
                for (body, row) in touch.row(k) {
                    match first_of[body] {
                        Some(place) => add_row(&mut problem.of_contacts, &row, place, column),
                        None => {
                            let v = self.pieces.v.get(body);
                            rate += row.iter().zip(v).map(|(h, v)| h * v).sum::<f64>();
                        }
                    }
                }
                problem.contact_rates.push(rate);
                problem.contact_regularization.push(sigma);
            }
        }
    }
}

/// The entries of a row of J or H on a body, as a column.
fn add_row(to: &mut Vec<Entry>, row: &[f64; 6], (first, size): (usize, usize), column: usize) {
    let entries = row[..size].iter().enumerate().filter(|(_, x)| **x != 0.0);
    to.extend(entries.map(|(k, x)| (first + k, column, *x)));
}
