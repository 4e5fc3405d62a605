//! Data of a step's linear system, and its residual.
//!
//! The unknown is the velocity *change* Δv together with the impulses μ. Both are kept through the refinement, and its
//! residual comes from the system's data,
//!
//! ```text
//! Δv ← Δv + M̃⁻¹ (Δt f + Jᵀ μ − M̃ Δv),    r = (c − J v) − J Δv − Σ μ
//! ```
//!
//! not from the assembled S, whose diagonal has rounded small inverse masses away. With μ = Δv = 0 the same two lines
//! give the right-hand side of the Schur form.
//!
//! **Dampers of rods, massless cables and joints that swing.** A damper of a row resists the rate at which φ grows over the
//! step. With positions x⁺ = x + Δt v⁺ this is
//!
//! ```text
//! (φ(x + Δt v⁺) − φ(x))/Δt = r⁺ + Δt κ/2 + …,    κ = vᵀ (∂²φ/∂x²) v
//! ```
//!
//! and not r⁺, the rate along the tangent: on a circle of radius L, κ = v²/L. A damper that takes r⁺ resists the return of the
//! Δt² κ/2 that each step leaves, and a load at v on a rope with the damping time τ swings τ Δt κ/2 too far out: 54 mm for
//! 100 kg on 2 m from 90°, 172 mm with ten times the damping time. Here the row counts as violated by τ/Δt times what φ grows
//! by beyond its tangent if the bodies go on freely from the velocities of the step before: the rate is then right to second
//! order in Δt. The lever arm r of a body that a joint holds to the world bends the way of the gap likewise, by (ω × (ω × r) + ω̇ × r) Δt²/2
//! with ω̇ of its free rotation. Joints between bodies are left out: light bodies that whip between loads of 10⁵ times their
//! mass do not go on at the velocities of the step before, and gained energy by it. The guard's implicit steps know the path of
//! their last iterate, and follow it in all lengths.

use crate::geometric::{Geometric, wrench};
use crate::inertia::Inertia;
use crate::options::Weights;
use crate::regularization::{Known, Regularization};
use taut_lanes::vector::dot;
use taut_lanes::{Aligned, Isa, Kernel, Lanes, Level, WideKernel, dispatch, dispatch_wide};
use taut_model::BodyVectors;
use taut_model::lanes::{Numbers, PACK, in_packs};
use taut_model::{Bodies, Constraint, Joint, Linearized, RowKind, Scene};

/// The pieces M̃, J, Σ, c, Δt f, and the velocity change that goes with the present multipliers.
pub(crate) struct SystemData {
    pub(crate) rows: Linearized,
    /// Constraints whose dampers follow the curve: rods, massless cables, and joints to the world.
    curved: Vec<usize>,
    /// Kind of each row.
    kinds: Vec<Kind>,
    /// Rows that hold a speed.
    speed_rows: Vec<usize>,
    /// Scales of the joints' gaps, as [`Gap`] has them, pack by pack.
    joint_gaps: Vec<Numbers>,
    /// The other gaps that turn.
    gaps: Vec<Gap>,
    /// Constraints whose only row is at a bound: what they measure does not act. Empty where no row has bounds.
    pub(crate) idle: Vec<bool>,
    pub(crate) geometric: Geometric,
    pub(crate) inertia: Inertia,
    pub(crate) regularization: Regularization,
    /// c − J v, one a row.
    pub(crate) rate: Aligned,
    /// v at the beginning of the step.
    pub(crate) v: BodyVectors,
    /// Δv.
    pub(crate) dv: BodyVectors,
    /// The angular velocities that K is multiplied with on the right-hand side.
    pub(crate) drive: BodyVectors,
    /// Rates known before a Newton pass (h of [`crate::regularization`]), one a row.
    pub(crate) known: Aligned,
    /// φ at the end of the step as the linearisation predicts it, one a row.
    pub(crate) predicted: Aligned,
    /// Scratch: an impulse or velocities.
    impulse: BodyVectors,
}

impl SystemData {
    /// v + Δv of a body.
    #[inline(always)]
    pub(crate) fn rates_after_solve(&self, body: usize) -> [f64; 6] {
        let (v, dv) = (self.v.get(body), self.dv.get(body));
        std::array::from_fn(|k| v[k] + dv[k])
    }

    pub(crate) fn new(scene: &Scene) -> Self {
        let rows = Linearized::new(scene);
        let (count, bodies) = (rows.rows(), scene.bodies.len());
        let parts = scene.constraints.iter().flat_map(Constraint::parts);
        let kinds: Vec<_> = parts
            .flat_map(|(kind, rows, _)| std::iter::repeat_n(Kind::of(kind), rows))
            .collect();
        let speed = |r: &usize| kinds[*r] == Kind::Speed;
        let gap = |c: usize| Gap::of(c, &scene.constraints[c], &rows, &kinds);
        let scale = |joint: &Joint| gap(joint.constraint).map_or(0.0, |gap| gap.scale);
        let joint_gaps = in_packs(rows.joints().iter().map(scale), 0.0);
        let gaps = rows.others().iter().filter_map(|c| gap(*c)).collect();
        let is_curved = |c: &usize| follows_curve(&scene.constraints[*c]);
        Self {
            curved: (0..scene.constraints.len()).filter(is_curved).collect(),
            speed_rows: (0..count).filter(speed).collect(),
            gaps,
            joint_gaps,
            kinds,
            idle: vec![
                false;
                if rows.bounds.is_empty() {
                    0
                } else {
                    rows.constraints()
                }
            ],
            geometric: Geometric::new(scene, &rows),
            inertia: Inertia::new(&scene.bodies),
            regularization: Regularization::new(count),
            rate: Aligned::new(count),
            v: BodyVectors::new(bodies),
            dv: BodyVectors::new(bodies),
            drive: BodyVectors::new(bodies),
            known: Aligned::new(count),
            predicted: Aligned::new(count),
            impulse: BodyVectors::new(bodies),
            rows,
        }
    }

    /// Scales the gaps of massless cables by their present lengths: a run and its restored copy then agree on what the guard redoes.
    pub(crate) fn rescale(&mut self, scene: &Scene) {
        for gap in &mut self.gaps {
            let constraint = &scene.constraints[gap.constraint];
            if constraint.link_length().is_some() {
                gap.scale = scale_of(constraint);
            }
        }
    }

    /// Takes the present lever arms and bending stiffness of these constraints, whose segment has been cut.
    pub(crate) fn renew(&mut self, scene: &Scene, cut: &[usize]) {
        for &c in cut {
            let scale = scale_of(&scene.constraints[c]);
            let joint = self.rows.joints().iter().position(|j| j.constraint == c);
            if let Some(k) = joint {
                self.joint_gaps[k / PACK][k % PACK] = scale;
                self.geometric.renew(k, &scene.constraints[c]);
            } else if let Some(gap) = self.gaps.iter_mut().find(|gap| gap.constraint == c) {
                gap.scale = scale;
            }
        }
    }

    /// True if the row belongs to the geometric stiffness of a link.
    pub(crate) fn is_transverse(&self, row: usize) -> bool {
        self.kinds[row] == Kind::Transverse
    }

    /// True if the row prescribes a speed.
    pub(crate) fn is_speed(&self, row: usize) -> bool {
        self.kinds[row] == Kind::Speed
    }

    /// True if rows hold speeds.
    pub(crate) fn holds_speeds(&self) -> bool {
        !self.speed_rows.is_empty()
    }

    /// Rows that hold a speed leave it as it is in the prepared system, but for bounded ones that are `held` at a limit of force.
    pub(crate) fn leave_speeds(&mut self, held: impl Fn(usize) -> bool) {
        let bounds = &self.rows.bounds;
        for &r in &self.speed_rows {
            let bound = bounds.binary_search_by_key(&r, |bound| bound.row);
            if !bound.is_ok_and(&held) {
                self.rate[r] = 0.0;
            }
        }
    }

    /// True if the row's force follows from its length or angle: ε λ + φ = 0 at rest.
    pub(crate) fn has_law(&self, row: usize) -> bool {
        matches!(self.kinds[row], Kind::Length | Kind::Angle)
    }

    pub(crate) fn is_angular(&self, row: usize) -> bool {
        self.kinds[row] == Kind::Angle
    }

    /// True if the row's force follows from its length.
    pub(crate) fn is_length(&self, row: usize) -> bool {
        self.kinds[row] == Kind::Length
    }

    /// Damping time of a length \[s]; 0 of other rows. An angle jumps by 2π where a joint folds, which is no rate.
    pub(crate) fn path_damping(&self, row: usize) -> f64 {
        if self.is_length(row) {
            self.rows.damping[row]
        } else {
            0.0
        }
    }

    /// True if a length is damped.
    pub(crate) fn has_path_dampers(&self) -> bool {
        (0..self.rows.rows()).any(|r| self.path_damping(r) > 0.0)
    }

    /// Copies the velocities into `v`.
    pub(crate) fn load_velocities(&mut self, bodies: &Bodies) {
        self.v.load(&bodies.velocity, &bodies.angular_velocity);
    }

    /// The rows take the weights of their kinds.
    pub(crate) fn weigh(&mut self, weights: &[Weights; 2]) {
        let kinds = &self.kinds;
        self.regularization
            .weigh(weights, |r| kinds[r] == Kind::Transverse);
    }

    /// Row `r` takes the share `implicit` of the linearly implicit weights, the rest of its kind's.
    pub(crate) fn mix_weights(&mut self, r: usize, of: &[Weights; 2], implicit: f64) {
        let weights = of[usize::from(self.is_transverse(r))];
        self.regularization.mix(r, weights, implicit);
    }

    /// Row `r` of the prepared system of a step `dt` long counts as violated by `excess` more than it is.
    pub(crate) fn add_violation(&mut self, r: usize, excess: f64, dt: f64) {
        let Self { rows, rate, .. } = self;
        rate[r] += self.regularization.violation(r, excess, dt, rows);
    }

    /// Dampers follow the curve in the prepared system of a step from `time`, `dt` long (s); J v of the rows is `jv`.
    pub(crate) fn follow_curves(&mut self, scene: &Scene, jv: &[f64], (time, dt): (f64, f64)) {
        for i in 0..self.curved.len() {
            let c = self.curved[i];
            let (ahead, count) = scene.constraints[c].gap_ahead(&scene.bodies, time, dt);
            let first = self.rows.row_range(c).start;
            for (r, ahead) in (first..).zip(ahead).take(count) {
                let rows = &self.rows;
                let beyond = ahead - (rows.phi[r] + dt * (jv[r] + rows.phi_t[r]));
                // A path over sheaves may end ahead.
                if beyond.is_finite() {
                    self.add_violation(r, rows.damping[r] * beyond / dt, dt);
                }
            }
        }
    }

    /// Dampers follow their path in the prepared system of a Newton pass of a sub-step `dt` long, which began with φ = `begun`: the
    /// rows hold φ of the last iterate, and `known` its rates along the tangent.
    pub(crate) fn follow_iterate(&mut self, begun: &[f64], known: &[f64], dt: f64) {
        for (r, (begun, known)) in begun.iter().zip(known).enumerate() {
            let damping = self.path_damping(r);
            if damping > 0.0 {
                let beyond = (self.rows.phi[r] - begun) / dt - known;
                self.add_violation(r, damping * beyond, dt);
            }
        }
    }

    /// Compliance |d|/T of the transverse rows of links under tension T, from multipliers λ (N): k = T/|d| is what the
    /// tension of a link resists its turning with. A slack link's rows are so soft that they do nothing, and all are
    /// without `stiff`.
    pub(crate) fn soften_transverse_rows(&mut self, lambda: &[f64], stiff: bool) {
        /// Small in newtons and in metres.
        const SMALL: f64 = 1e-9;
        let rows = &mut self.rows;
        for i in 0..rows.transverse.len() {
            let link = &rows.transverse[i];
            let tension = if stiff { -lambda[link.length_row] } else { 0.0 };
            let compliance = link.distance.max(SMALL) / tension.max(SMALL);
            let range = link.rows();
            rows.compliance[range].fill(compliance);
        }
    }

    /// Σ, and c − J v for the rates `jv` = J v and what is `known` of them.
    pub(crate) fn regularize(&mut self, dt: f64, jv: &[f64], known: Known<'_>) {
        let Self { rows, rate, .. } = self;
        self.regularization.update(dt, rows, jv, known, rate);
        for &r in &self.speed_rows {
            // J v⁺ is what it is to be, whatever went before.
            let c = -self.rows.phi_t[r];
            self.regularization.sigma[r] = 0.0;
            self.rate[r] = c - jv[r];
        }
    }

    /// M̃ of every body grows by what the constraint forces of multipliers `lambda` would move with `acceleration`
    /// (m/s²), about every axis as at the distance of their constraints' longer lever arms: a body that a torque turns about
    /// its centre has none of its own. `Err(body)` where the inertia has no inverse.
    pub(crate) fn add_ballast(&mut self, lambda: &[f64], acceleration: f64) -> Result<(), usize> {
        let Self { rows, inertia, .. } = self;
        for (s, slot) in rows.slots.iter().enumerate() {
            let (force, torque) = wrench(rows, s, lambda);
            let arms = rows
                .slot_range(slot.constraint)
                .map(|s| rows.lever(s).norm());
            let (force, arm) = (force.norm(), arms.fold(0.0, f64::max));
            let angular = (force * arm + torque.norm()) * arm;
            if !inertia.add_ballast(slot.body, force / acceleration, angular / acceleration) {
                return Err(slot.body);
            }
        }
        Ok(())
    }

    /// Δv ← Δv + M̃⁻¹ (Δt f + Jᵀ μ − M̃ Δv).
    pub(crate) fn update_velocity_change(&mut self, mu: &[f64]) {
        self.impulse.copy_from(&self.inertia.impulse);
        self.rows.add_transposed(mu, &mut self.impulse);
        self.inertia.correct_velocities(&self.impulse, &mut self.dv);
    }

    /// r = (c − J v) − J Δv with the Δv of no impulses but Δt f.
    pub(crate) fn free_residual(&mut self, r: &mut [f64]) {
        self.inertia.free_velocities(&mut self.dv);
        self.rows.times_jacobian(&self.dv, r);
        dispatch(Level::best(), SubtractFrom(&self.rate, r));
    }

    /// r = (c − J v) − J Δv − Σ μ with the Δv that goes with μ.
    pub(crate) fn residual(&mut self, mu: &[f64], r: &mut [f64]) {
        self.update_velocity_change(mu);
        self.rows.times_jacobian(&self.dv, r);
        let residual = Residual {
            rate: &self.rate,
            sigma: &self.regularization.sigma,
            mu,
            r,
        };
        dispatch(Level::best(), residual);
    }

    /// J (v + Δv).
    pub(crate) fn rates_after(&self, rates: &mut [f64]) {
        self.rows.times_jacobian_of_sum([&self.v, &self.dv], rates);
    }

    /// φ + Δt (J (v + Δv) + ∂φ/∂t) into `predicted`.
    pub(crate) fn predict(&mut self, dt: f64) {
        let mut predicted = std::mem::take(&mut self.predicted);
        self.rates_after(&mut predicted);
        let Linearized { phi, phi_t, .. } = &self.rows;
        dispatch(Level::best(), Predict(dt, phi, phi_t, &mut predicted));
        self.predicted = predicted;
    }

    /// By how much a row that is predicted on its open side, or at its bound, is found beyond it \[m].
    fn found_taut(&self, gap: &Gap) -> f64 {
        let bounds = &self.rows.bounds;
        let Some(bound) = bounds.iter().find(|bound| bound.row == gap.first) else {
            return 0.0;
        };
        let of = |phi: &[f64]| bound.side() * phi[gap.first];
        if of(&self.predicted) <= 0.0 {
            of(&self.rows.phi).max(0.0)
        } else {
            0.0
        }
    }

    /// Largest size of c − J v.
    pub(crate) fn largest_rate(&self) -> f64 {
        let sizes = self.rate.iter().map(|rate| rate.abs());
        sizes.fold(0.0, f64::max)
    }

    /// Largest distance of a gap from its prediction, over the length that turns; that of a slack cable is what it ends taut by.
    /// NaN where a gap is.
    pub(crate) fn disagreement(&self) -> f64 {
        let joints = JointGaps {
            rows: &self.rows,
            predicted: &self.predicted,
            scales: &self.joint_gaps,
        };
        let mut worst = dispatch_wide(Level::best(), joints);
        if worst.is_nan() {
            return worst;
        }
        for gap in &self.gaps {
            let relative = gap.square(&self.rows.phi, &self.predicted) * gap.scale;
            let is_less = relative <= worst;
            if !is_less {
                if relative.is_nan() {
                    return f64::NAN;
                }
                if self.idle.get(gap.constraint) != Some(&true) {
                    worst = relative;
                } else {
                    worst = (self.found_taut(gap).powi(2) * gap.scale).max(worst);
                }
            }
        }
        worst.sqrt()
    }
}

/// True of rods, massless cables and joints to the world with dampers.
fn follows_curve(constraint: &Constraint) -> bool {
    let is_at_world = || constraint.frames().iter().any(|f| f.body_index().is_none());
    let is_followed =
        constraint.link_length().is_some() || constraint.has_stretch_rows() && is_at_world();
    let first = constraint.parts().next();
    is_followed && first.is_some_and(|(.., law)| law.damping > 0.0)
}

/// Largest square of [`SystemData::disagreement`] among the joints, which are never idle; NaN where their sum is not finite.
struct JointGaps<'a> {
    rows: &'a Linearized,
    predicted: &'a [f64],
    scales: &'a [Numbers],
}

impl WideKernel for JointGaps<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) -> f64 {
        let [mut worst, mut sum] = [V::splat(0.0); 2];
        let scales = self.scales.iter().flat_map(|pack| pack.as_chunks::<L>().0);
        for (joints, scale) in self.rows.joint_lanes::<L>().zip(scales) {
            let [x, y, z, ..] = joints.rows_of::<V>(&self.rows.phi);
            let [p, q, r, ..] = joints.rows_of::<V>(self.predicted);
            let gap = [x - p, y - q, z - r];
            let relative = dot(&gap, &gap) * V::load(scale);
            (worst, sum) = (relative.max(worst), sum + relative);
        }
        // A largest number passes over NaN, a sum does not.
        if sum.all_below(V::splat(f64::INFINITY)) {
            worst.max_lane()
        } else {
            f64::NAN
        }
    }
}

/// r ← rate − r.
struct SubtractFrom<'a>(&'a [f64], &'a mut [f64]);

impl Kernel for SubtractFrom<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        for (r, rate) in self.1.iter_mut().zip(self.0) {
            *r = rate - *r;
        }
    }
}

/// r ← (rate − Σ μ) − r.
struct Residual<'a> {
    rate: &'a [f64],
    sigma: &'a [f64],
    mu: &'a [f64],
    r: &'a mut [f64],
}

impl Kernel for Residual<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let system_data = self.rate.iter().zip(self.sigma).zip(self.mu);
        for (r, ((rate, sigma), mu)) in self.r.iter_mut().zip(system_data) {
            *r = (rate - sigma * mu) - *r;
        }
    }
}

/// p ← φ + Δt (p + ∂φ/∂t).
struct Predict<'a>(f64, &'a [f64], &'a [f64], &'a mut [f64]);

impl Kernel for Predict<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self(dt, phi, phi_t, predicted) = self;
        for (p, (phi, phi_t)) in predicted.iter_mut().zip(phi.iter().zip(phi_t)) {
            *p = phi + dt * (*p + phi_t);
        }
    }
}

/// Rows of a constraint that measure a length that turns.
#[derive(Debug, Clone, Copy)]
struct Gap {
    constraint: usize,
    first: usize,
    rows: usize,
    /// 1 over the square of the length over which the gap turns, as far as that makes it nonlinear \[1/m²].
    scale: f64,
}

impl Gap {
    /// Squared distance between the gap and its prediction \[m²].
    fn square(&self, found: &[f64], predicted: &[f64]) -> f64 {
        let rows = self.first..self.first + self.rows;
        let pairs = found[rows.clone()].iter().zip(&predicted[rows]);
        pairs.map(|(a, b)| (a - b) * (a - b)).sum()
    }

    /// The gap of constraint `c`, if it turns.
    fn of(c: usize, constraint: &Constraint, rows: &Linearized, kinds: &[Kind]) -> Option<Self> {
        let length = turning_length(constraint);
        let range = rows.row_range(c);
        let lengths = range
            .clone()
            .take(3)
            .take_while(|r| kinds[*r] == Kind::Length);
        (length > 0.0).then(|| Self {
            constraint: c,
            first: range.start,
            rows: lengths.count(),
            scale: scale_of(constraint),
        })
    }
}

/// 1 over the square of the length that a constraint's gap turns over, 0 where it does not turn \[1/m²].
fn scale_of(constraint: &Constraint) -> f64 {
    let length = turning_length(constraint);
    if length > 0.0 {
        1.0 / (length * length)
    } else {
        0.0
    }
}

/// Kind of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Length,
    Angle,
    Transverse,
    Speed,
}

impl Kind {
    fn of(kind: RowKind) -> Self {
        match kind {
            RowKind::Transverse => Self::Transverse,
            RowKind::Speed => Self::Speed,
            kind if kind.is_angular() => Self::Angle,
            _ => Self::Length,
        }
    }
}

/// Lever arm that turns a gap error into an angle: the longer one of the two, or a span of what has spans; 0 where φ is
/// linear in the positions, or does not begin with a gap \[m].
fn turning_length(constraint: &Constraint) -> f64 {
    let first = constraint.parts().next();
    if !first.is_some_and(|(kind, ..)| kind.is_gap()) {
        return 0.0;
    }
    let frames = constraint.frames().iter();
    let on_bodies = frames.filter(|f| f.body_index().is_some());
    let lever = on_bodies.map(|f| f.point.norm()).fold(0.0, f64::max);
    // Of several spans the shorter ones turn faster than the mean.
    lever.max(constraint.span_length().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    /// Joints in lanes, and a link beside them: the guard finds every gap that is off its
    /// prediction, relative to the gap's own length, and every gap that is no number.
    #[test]
    fn every_gap_off_its_prediction_is_a_disagreement() {
        for segments in [1, 9, 16] {
            let params = HoistParams::default().with(|p| p.segments = segments);
            let mut scene = params.build().unwrap();
            let link = Distance {
                frames: [Frame::world(Vector3::x()), centre(0)],
                length: 0.7,
                law: RowLaw::RIGID,
                transverse: false,
            };
            scene.add_constraint("link", Constraint::Distance(link), 0);
            let mut system_data = SystemData::new(&scene);
            system_data.rows.update(&scene, 0.0);
            system_data.predicted.copy_from_slice(&system_data.rows.phi);
            assert_eq!(system_data.disagreement(), 0.0);
            for (c, constraint) in scene.constraints.iter().enumerate() {
                let row = system_data.rows.row_range(c).start;
                let exact = system_data.predicted[row];
                system_data.predicted[row] += 1e-3;
                let turned = system_data.disagreement() * turning_length(constraint);
                assert!((turned - 1e-3).abs() < 1e-12, "{segments} {c}: {turned}");
                for lost in [f64::NAN, f64::INFINITY] {
                    system_data.predicted[row] = lost;
                    assert!(!system_data.disagreement().is_finite(), "{segments} {c}");
                }
                system_data.predicted[row] = exact;
            }
        }
    }
}
