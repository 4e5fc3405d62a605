//! Rows with bounds that close and open: ropes that go slack. Contacts are no rows of the system ([`crate::contact`]).
//!
//! Such a row is a spring and a damper that act while it is stretched, x = φ > 0, and only pull:
//!
//! ```text
//! T = max(0, (x + τ ẋ)/ε)  for x > 0,    else 0
//! ```
//!
//! **The damper of a slack row.** The law is passive, and φ + τ r cut off at T ≥ 0 is another one: it pulls at a slack of τ r. Over
//! a step the damper therefore takes the rate of x₊ = max(0, φ) instead of r = φ̇: a row that is slack by −φ at the beginning has
//!
//! ```text
//! (x₊⁺ − x₊)/Δt = (φ + Δt r⁺)/Δt = r⁺ + φ/Δt
//! ```
//!
//! which counts as violated by τ φ/Δt < 0 more than it is. Its force then begins where φ⁺ > 0, whatever τ is, and where τ is large
//! the row ends the step at φ⁺ = 0 instead of before it. A row that is stretched and opens within the step has no force by either.
//!
//! Such a row may not give back more energy than it took. Three effects of the step would:
//!
//! **What a row remembers of its fall.** A scheme of second order takes φ̄ = φ + Δt (p r⁺ − q r + s r⁻), which for a rigid
//! row that closes at φ ∈ (0, Δt r] asks for r⁺ = r − φ/(p Δt), down to −1.5 r with p = 0.4. Held on both sides it would ring
//! that down; held on one it lets go at the peak. With (p, q, s) = (1, 0, 0) the row closes *before* φ = 0, where
//! φ + Δt r > 0, with 0 ≤ r⁺ = −φ/Δt < r: an impact without rebound. A row is therefore *young* until r and r⁻ are those of
//! a closed row, and takes the share w = x²/(1 + x²) of these weights meanwhile, x = Ω²/Ω_c², with Ω² = Δt² J M̃⁻¹ Jᵀ/ε of
//! the row alone: its stiffness in the step's eyes. That overstates Ω where others hold the bodies too, and so errs towards
//! damping. Soft rows resolve their rebound and keep it. A row that was open and opens further has no such past: w = 1. One
//! whose drive jumps, as that of a winch that is set to another speed, is young again: its past rates are of another motion. So
//! is a two-sided row that an event makes between bodies that part or approach: it has φ = 0 then, takes r⁺ = r for a step and
//! rings from −1.5 r on.
//!
//! **A part of a cable that is held at both ends** takes (1, 0, 0) for good: the rope that slips over to it has no mass, and by
//! weights of second order it swings, undamped or growing. One that moves next to no body takes them while it is young.
//!
//! **The kink of a soft row.** Sampled at steps of Δt, the work ∫ φ₊ dφ of a row that is crossed at the rate r is in error
//! by B₂(θ) r² Δt²/2, θ ∈ [0, 1) the phase of the crossing, B₂(θ) = θ² − θ + ⅙: up to Ω²/4 of the energy, one way and the
//! other, more than the scheme damps where Ω is small. The mean over the two steps about t, weighted by a hat, has no such
//! error on a straight path, since the hats add up to 1:
//!
//! ```text
//! ∫ (1 − |u|) (φ + u Δt r)₊ du = φ₊ + Δt |r| (1 − |φ|/(Δt |r|))³/6    for |φ| < Δt |r|
//! ```
//!
//! The row takes this for φ, as far as it is soft, ε/(ε + Δt² J M̃⁻¹ Jᵀ), and as far as its weights look at the present
//! state, 1 − (p − q + s): a linearly implicit row looks at the end of the step, where φ̄ is its φ already.
//!
//! No step leads to the start of a run: of its whole first kick, the half that belongs to the time before goes in advance. It is
//! that of the earlier half of the hat,
//!
//! ```text
//! 2 ∫₀¹ (1 − u) (φ − u Δt r)₊ du = φ − Δt r/3    for φ, φ − Δt r ≥ 0
//! ```
//!
//! With φ₊ instead, a load that leaves the rope on which it starts gains the part Ω²/3 of the energy of r.
//!
//! **Drift that implicit sub-steps take back.** Implicit Euler asks for φ⁺ + ε λ⁺ = 0 at the end of each sub-step, so that
//! what was left of φ + ε λ at the beginning of a step that is redone goes in one sub-step, however short, at a speed without
//! limit; a row held on one side then keeps that speed. Here it goes in proportion to time, over the whole step.

use crate::active_set::{ActiveSet, RowState, response, response_of_row};
use crate::options::Weights;
use crate::system_data::SystemData;
use taut_model::{Linearized, RowBounds};

/// Steps for which a row is young: those in which r or r⁻ is from before it closed, and the one in which it closes.
const YOUNG: u8 = 3;

/// Not known yet: the first step looks at the state.
pub(crate) const UNKNOWN: u8 = u8::MAX;

/// Ω_c, at which a young row is half linearly implicit. With 3 as with 4 no fall of 0.2 to 2 m rebounds higher; 3 leaves
/// less, 0.4 for 0.6 at Ω = 2, of a rebound that the step resolves no more.
const HALF: f64 = 3.0;

/// J M̃⁻¹ Jᵀ of a part of a cable that counts as held at both ends, over that of another part.
const HELD: f64 = 1e-2;

/// Least Ω, with its damper's part, of a row that divides its step where it is caught. Undivided, lifts by a pulley are 3 % short
/// from here on, 16 % from Ω = 0.5 on, half from Ω = 2 on. A swing faster than g Δt/Ω goes slack again, and so do its divisions end; an
/// undamped one between g Δt and that stays taut and divided.
pub(crate) const SOFT: f64 = 0.1;

/// Least Ω of a row whose step a jump of its drive divides. Undivided, the dip of a load whose winch is set to another speed is 1 to
/// 2 % short from here on, a quarter from Ω = 1.7 on, and all of it from Ω = 6 on.
const DRIVEN: f64 = 0.35;

/// Least such jump over the rate that divides a step elsewhere. The swing of the jump before is left to whole steps at that rate, and
/// divisions that begin within it take the part Ω²/3 of its energy.
const JUMP: f64 = 2.0;

/// Least Ω of a row that counts as rigid: its parts do not resolve a swing. Softer rows that are neither caught nor driven by a jump
/// divide no step but one that goes on.
pub(crate) const STIFF: f64 = 96.0;

/// Largest drift that is of a curve, over that of the curve at the present state.
const MOST: f64 = 1.5;

/// Drift that is rounding, over that of the curve.
const ROUNDING: f64 = 1e-9;

/// A row without bounds that an event has made, and the steps since then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub(crate) struct Made {
    pub(crate) constraint: usize,
    pub(crate) row: usize,
    pub(crate) age: u8,
}

/// Activation history of the bounded rows, in the order of [`taut_model::Linearized::bounds`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Activation {
    /// Steps since a row was last at a bound, up to [`YOUNG`].
    ages: Vec<u8>,
    /// Young rows without bounds, which events have made.
    made: Vec<Made>,
    /// φ at the beginning of the step or implicit sub-step \[m].
    begin: Vec<f64>,
    /// φ + ε λ at the beginning of a step that is redone, one a row \[m].
    drift: Vec<f64>,
    /// Part of the drift that a divided step holds, one a row \[m].
    held: Vec<f64>,
    /// Part of the drift left to the sub-steps after the present one, 0 … 1.
    pub(crate) left: f64,
    /// Part of the step that the present sub-step takes.
    pub(crate) share: f64,
    /// True if no step leads to the present state: its kick is of half a step.
    pub(crate) begins: bool,
}

impl Activation {
    /// For a scene with `rows` rows, `bounded` of them with bounds.
    pub(crate) fn new(rows: usize, bounded: usize) -> Self {
        Self {
            ages: vec![UNKNOWN; bounded],
            made: Vec::new(),
            begin: vec![0.0; bounded],
            drift: vec![0.0; rows],
            held: vec![0.0; rows],
            left: 0.0,
            share: 1.0,
            begins: false,
        }
    }

    /// Steps since each row was last at a bound, as [`put`](Self::put) takes them back.
    pub(crate) fn ages(&self) -> &[u8] {
        &self.ages
    }

    pub(crate) fn put(&mut self, ages: &[u8]) {
        self.ages.copy_from_slice(ages);
    }

    /// Rows without bounds that are young.
    pub(crate) fn made(&self) -> &[Made] {
        &self.made
    }

    /// These rows without bounds are young.
    pub(crate) fn make(&mut self, made: Vec<Made>) {
        self.made = made;
    }

    /// The state to come is not that which the steps led to.
    pub(crate) fn forget(&mut self) {
        self.ages.fill(UNKNOWN);
        self.made.iter_mut().for_each(|row| row.age = YOUNG);
    }

    /// A step is done, with the rows where `bounded` has them.
    pub(crate) fn accept(&mut self, bounded: &ActiveSet) {
        for (age, place) in self.ages.iter_mut().zip(bounded.places()) {
            *age = match place {
                RowState::Inside => age.saturating_add(1).min(YOUNG),
                RowState::Lower | RowState::Upper => 0,
            };
        }
        for row in &mut self.made {
            row.age = row.age.saturating_add(1).min(YOUNG);
        }
    }

    /// The weights of the rows that events made; they are like all others when they are no longer young.
    fn weigh_made(&mut self, system_data: &mut SystemData, of: &[Weights; 2], dt: f64) {
        self.made.retain(|row| {
            let young = row.age < YOUNG;
            let implicit = if young {
                let response = response_of_row(system_data, row.constraint, row.row);
                share(response, system_data.rows.compliance[row.row], dt)
            } else {
                0.0
            };
            system_data.mix_weights(row.row, of, implicit);
            young
        });
    }

    /// The weights of the bounded rows at the present state, where the rows' rates are `jv` + `phi_t`, and their drives those of this
    /// step; M̃⁻¹ is its own. A change of the drive by more than `jerk` is a jump \[m/s].
    pub(crate) fn weigh(
        &mut self,
        system_data: &mut SystemData,
        of: &[Weights; 2],
        (jv, phi_t): (&[f64], &[f64]),
        jerk: f64,
        bounded: &ActiveSet,
        dt: f64,
    ) {
        if !self.made.is_empty() {
            self.weigh_made(system_data, of, dt);
        }
        for k in 0..self.ages.len() {
            let bound = system_data.rows.bounds[k];
            let (r, side) = (bound.row, bound.side());
            let (phi, rate) = (side * system_data.rows.phi[r], side * (jv[r] + phi_t[r]));
            let age = &mut self.ages[k];
            if *age == YOUNG && side != 0.0 && (system_data.rows.phi_t[r] - phi_t[r]).abs() > jerk {
                *age = 1;
            }
            if *age == UNKNOWN {
                // A row that is open, or within a step of it, has not been closed for long.
                *age = if phi < dt * rate.abs() { 0 } else { YOUNG };
            }
            let implicit = match *age {
                0 if rate < 0.0 => 1.0,
                // Bodies that are much heavier than the others resolve their swing themselves once it has begun.
                YOUNG.. => f64::from(bounded.is_held(system_data, k, 0.0)),
                _ if bounded.is_held(system_data, k, HELD) => 1.0,
                _ => share(response(system_data, k), system_data.rows.compliance[r], dt),
            };
            system_data.mix_weights(r, of, implicit);
        }
    }

    /// φ of soft rows at their kink, after the rows have been regularised with the rates `rate`.
    pub(crate) fn round_kinks(&self, system_data: &mut SystemData, rate: &[f64], dt: f64) {
        for k in 0..self.ages.len() {
            let bound = system_data.rows.bounds[k];
            let (r, side) = (bound.row, bound.side());
            let (phi, reach) = (side * system_data.rows.phi[r], dt * rate[r].abs());
            let compliance = system_data.rows.compliance[r];
            let is_smooth = phi.abs() >= reach && !(self.begins && phi > 0.0);
            if side == 0.0 || is_smooth || compliance == 0.0 {
                continue;
            }
            let soft = compliance / (compliance + dt * dt * response(system_data, k));
            let mean = if self.begins {
                earlier_mean(phi, -dt * side * rate[r])
            } else {
                let rest = 1.0 - phi.abs() / reach;
                phi.max(0.0) + reach * rest * rest * rest / 6.0
            };
            let here = 1.0 - system_data.regularization.ahead(r);
            system_data.add_violation(r, here * soft * side * (mean - phi), dt);
        }
    }

    /// Before the passes of a step or an implicit sub-step, at the state that it begins with.
    pub(crate) fn begin(&mut self, rows: &Linearized) {
        for (begin, bound) in self.begin.iter_mut().zip(&rows.bounds) {
            *begin = rows.phi[bound.row];
        }
    }

    /// φ of bounded row `k` at the beginning of the step or implicit sub-step \[m].
    pub(crate) fn begun(&self, k: usize) -> f64 {
        self.begin[k]
    }

    /// Force of the spring of bounded row `k` at the end of a sub-step of `dt` (s) in which it gave way at its lower limit, the pull
    /// F: with F = (x + τ ẋ)/ε its stretch x has gone towards ε F \[N].
    ///
    /// ```text
    /// x⁺ = (Δt ε F + τ x)/(Δt + τ)
    /// ```
    pub(crate) fn spring_of_limit(&self, rows: &Linearized, k: usize, dt: f64) -> f64 {
        let bound = rows.bounds[k];
        let (compliance, damping) = (rows.compliance[bound.row], rows.damping[bound.row]);
        let pull = -bound.lower;
        if damping == 0.0 || compliance == 0.0 {
            return pull;
        }
        let begun = self.begin[k].max(0.0) / compliance;
        (dt * pull + damping * begun) / (dt + damping)
    }

    /// φ of the open side, 0 of a row that begins taut, or has no open side \[m].
    fn slack(&self, k: usize, bound: &RowBounds) -> f64 {
        let side = bound.side();
        side * (side * self.begin[k]).min(0.0)
    }

    /// Dampers of rows that begin slack act from φ = 0 on, in the prepared system of a step `dt` long.
    pub(crate) fn damp_from_taut(&self, system_data: &mut SystemData, dt: f64) {
        for k in 0..self.begin.len() {
            let bound = system_data.rows.bounds[k];
            let damped = system_data.rows.damping[bound.row] * self.slack(k, &bound);
            if damped != 0.0 {
                system_data.add_violation(bound.row, damped / dt, dt);
            }
        }
    }

    /// Tells whether blows on one-sided rows divide the linear step of `dt` (s) that has been taken but not accepted: the largest Ω
    /// that its parts have to resolve, 0 where all rows struck count as rigid; `None` if nothing divides it.
    ///
    /// A row is struck where it is caught or thrown slack faster than `least` (m/s), where its rate changes by more while it is
    /// taut, where its drive jumps by more, or where its load lands faster: the floor may take the load in two steps, in the
    /// first of which the rope still pulls, and its other end is braked with it. Rows from [`SOFT`] to [`STIFF`] are struck only
    /// by a jump of their drive above [`DRIVEN`], or where it does not jump as they close, as their load lands, or as the step
    /// `goes_on` from a divided one and they swing faster: whole steps keep v² (1 + Ω²/3) of a swing, which parts that begin within
    /// it take for v².
    ///
    /// `hits` is told the rows that are struck, `before` are the rates of the step before, `driven` the change of a row's drive since
    /// the step before \[m/s], `landing` the speed of a row's load \[m/s], `loaded` the J M̃⁻¹ Jᵀ of a row with what its bodies carry, 0 of rows that are left out \[1/kg]; `thrown` the same of rows that
    /// slipped and whose load is thrown back in the step, which divide it whatever they do, 0 of all others.
    pub(crate) fn struck(
        &self,
        (system_data, bounded): (&SystemData, &ActiveSet),
        (before, driven): (&[f64], impl Fn(usize) -> f64),
        (dt, least, goes_on): (f64, f64, bool),
        (mut hits, curving): (impl FnMut(usize), impl Fn(usize) -> f64),
        landing: impl Fn(usize) -> f64,
        (loaded, thrown): (impl Fn(usize) -> f64, impl Fn(usize) -> f64),
    ) -> Option<f64> {
        let struck = |(k, place): (usize, RowState)| {
            let bound = system_data.rows.bounds[k];
            let (r, side, begin) = (bound.row, bound.side(), self.begin[k]);
            // Turns may close a row that its rate leaves open.
            let (predicted, found) = (system_data.predicted[r], system_data.rows.phi[r]);
            let turned = side * predicted < 0.0 && side * found > 0.0;
            let end = if turned { found } else { predicted };
            // A rigid row is taut at φ = 0 but for rounding, which does not tell how it came there.
            let (was_open, opens) = (self.ages[k] == 0, place != RowState::Inside);
            let (was_slack, is_slack) = (side * begin < 0.0, side * end < 0.0);
            let passes = was_slack != is_slack || was_open != opens || turned;
            let (compliance, damping) =
                (system_data.rows.compliance[r], system_data.rows.damping[r]);
            let is_stiff = |response: f64, least: f64| {
                dt * (dt + damping) * response > least * least * compliance
            };
            let own = response(system_data, k);
            let is_thrown = is_stiff(thrown(k), SOFT);
            if !is_thrown && (side == 0.0 || !passes && opens || !is_stiff(own, SOFT)) {
                return None;
            }
            let (is_rigid, omega) = (is_stiff(own, STIFF), dt * (own / compliance).sqrt());
            let (after, before) = ((end - begin) / dt, before[r]);
            let rate = match passes {
                true => after.abs().max(before.abs()),
                false if goes_on && !is_rigid => before.hypot((after - before) / omega),
                false => (after - before).abs(),
            };
            let drive = driven(k);
            let lands = !was_open && landing(k) > least;
            // A rigid row opens and closes by rounding, at rates that its curve makes of none.
            let explained = if is_rigid && rate > least {
                curving(k)
            } else {
                0.0
            };
            let is_hit = lands || rate > least + explained;
            if is_hit {
                hits(k);
            }
            // A rope that begins just at its length is caught as it is stretched, and so is one whose drum slipped.
            let is_caught = (was_slack || was_open) && !is_slack;
            let swings = is_caught || lands || goes_on;
            let bar = match drive > JUMP * least {
                true => DRIVEN,
                false if swings && drive <= least => SOFT,
                false => STIFF,
            };
            let divides = (is_hit || drive > least) && is_stiff(loaded(k), bar);
            (is_thrown || divides).then_some(if is_rigid { 0.0 } else { omega })
        };
        let all = bounded.places().enumerate().filter_map(struck);
        all.reduce(f64::max)
    }

    /// After a divided step elastic one-sided rows are young where they are taut, and open where they are slack: the rates of a
    /// swing in parts tell a whole step nothing.
    pub(crate) fn make_young(&mut self, rows: &Linearized) {
        let bounds = self.ages.iter_mut().zip(&rows.bounds);
        for (age, bound) in bounds.filter(|(_, b)| rows.compliance[b.row] > 0.0 && b.side() != 0.0)
        {
            let is_slack = bound.side() * rows.phi[bound.row] < 0.0;
            *age = if is_slack { 0 } else { (*age).min(1) };
        }
    }

    /// Nothing is left of the drift but what is held.
    pub(crate) fn forget_drift(&mut self) {
        self.drift.fill(0.0);
    }

    /// Nothing is held any more.
    pub(crate) fn let_go(&mut self) {
        self.held.fill(0.0);
    }

    /// Before a step is redone in sub-steps from the present state, with λ of the last solve in `tension`. Implicit sub-steps take
    /// the drift of rows `without` bounds back at once.
    pub(crate) fn take_drift(&mut self, rows: &Linearized, tension: &[f64], without: bool) {
        let held = &self.held;
        let left = |r: usize| rows.phi[r] + rows.compliance[r] * tension[r] - held[r];
        for (r, drift) in self.drift.iter_mut().enumerate() {
            *drift = if without { left(r) } else { 0.0 };
        }
        for bound in &rows.bounds {
            let (r, side) = (bound.row, bound.side());
            self.drift[r] = if side != 0.0 {
                side * (side * left(r)).max(0.0)
            } else if tension[r] > bound.lower && tension[r] < bound.upper {
                left(r)
            } else {
                0.0
            };
        }
    }

    /// Half a kick to the present or from it is of forces, not of blows. In the prepared system of a step, whose rows have the rates
    /// `jv` + ∂φ/∂t, the bounded rows that are stiff in its eyes, and for which `leaves` is true, leave the bodies their rates. `now`
    /// are the rates with the drives of the step before, `before` those of the step before, `dt` its length (s).
    pub(crate) fn leave_rates(
        &self,
        system_data: &mut SystemData,
        (jv, now, before): (&[f64], &[f64], &[f64]),
        dt: f64,
        leaves: impl Fn(usize) -> bool,
    ) {
        for k in (0..self.ages.len()).filter(|k| leaves(*k)) {
            let bound = system_data.rows.bounds[k];
            let r = bound.row;
            if !system_data.is_speed(r) {
                let known = system_data.regularization.known_rate(r, now[r], before[r]);
                let blow = known - jv[r] - system_data.rows.phi_t[r];
                system_data.rate[r] -= stiff_part(system_data, &bound, dt) * blow;
            }
        }
    }

    /// Over a divided step the rows from `first` on hold their drift along the `curve` that whole steps leave, but for the part `own`
    /// of it that the step's parts leave \[m]. Curves change from step to step, by less than a half: what is beyond is drift of
    /// another kind.
    pub(crate) fn hold_drift(&mut self, first: usize, curve: &[f64], own: f64) {
        let drift = &mut self.drift[first..][..curve.len()];
        let square: f64 = curve.iter().map(|c| c * c).sum();
        if square == 0.0 {
            return;
        }
        let along: f64 = curve.iter().zip(&*drift).map(|(c, d)| c * d).sum();
        let part = (along / square).clamp(0.0, MOST);
        for ((curve, drift), held) in curve.iter().zip(drift).zip(&mut self.held[first..]) {
            *held = (part - own).max(0.0) * curve;
            *drift -= part * curve;
            if *drift * *drift < ROUNDING * ROUNDING * square {
                *drift = 0.0;
            }
        }
    }

    /// Takes the drift from rows that the parts of a divided step, `dt` long, resolve: their gap is the stretch of their force. So
    /// it is of dampers, and of all rows where the step `goes_on` from parts; a whole step leaves its gaps unfelt. One-sided rows
    /// with drift are young: the rates of whole steps would ring in parts.
    pub(crate) fn drop_resolved_drift(&mut self, system_data: &SystemData, goes_on: bool, dt: f64) {
        let rows = &system_data.rows;
        let is_bounded = |r: usize| rows.bounds.iter().any(|bound| bound.row == r);
        for (r, drift) in self.drift.iter_mut().enumerate() {
            let is_felt = rows.compliance[r] > 0.0 && (goes_on || rows.damping[r] > 0.0);
            if is_felt && *drift != 0.0 && !is_bounded(r) {
                *drift = 0.0;
            }
        }
        for (age, bound) in self.ages.iter_mut().zip(&rows.bounds) {
            let r = bound.row;
            if goes_on || rows.damping[r] > 0.0 {
                self.drift[r] *= stiff_part(system_data, bound, dt);
            }
            if bound.side() != 0.0 && self.drift[r] != 0.0 {
                *age = (*age).min(1);
            }
        }
    }

    /// Closes and opens the rows that a step of `dt` resolves by their gaps, before a solve that moves none. Beside a step to come a
    /// row closes the time `ahead` (s), at its `rate` (m/s), before φ = 0, where its [kink](Self::round_kinks) begins; after one it
    /// had no force before φ = 0.
    pub(crate) fn close_by_gaps(
        bounded: &mut ActiveSet,
        system_data: &SystemData,
        rate: &[f64],
        dt: f64,
        ahead: f64,
    ) {
        for (k, bound) in system_data.rows.bounds.iter().enumerate() {
            if stiff_part(system_data, bound, dt) < 0.5 {
                let reach = bound.side() * ahead * rate[bound.row].abs();
                bounded.put_by_gap(k, bound, system_data.rows.phi[bound.row] + reach);
            }
        }
    }

    /// Leaves the part `left` of the drift to the sub-steps after this one, of `dt`, whose rows have been regularised; that of a row
    /// whose weights take φ at the beginning of the sub-step is the part left then.
    pub(crate) fn leave_drift(&self, system_data: &mut SystemData, dt: f64) {
        for (r, (drift, held)) in self.drift.iter().zip(&self.held).enumerate() {
            if *drift != 0.0 || *held != 0.0 {
                let here = 1.0 - system_data.regularization.ahead(r);
                let left = self.left + here * self.share;
                system_data.add_violation(r, -(left * drift + held), dt);
            }
        }
    }

    /// A one-sided row with drift that has been slack since is taken back no faster than the others, after
    /// [`leave_drift`](Self::leave_drift); λ of the last solve is in `tension`.
    pub(crate) fn return_slowly(&self, system_data: &mut SystemData, tension: &[f64], dt: f64) {
        for k in 0..self.begin.len() {
            let bound = system_data.rows.bounds[k];
            let (r, side) = (bound.row, bound.side());
            let drift = side * self.drift[r];
            if drift > 0.0 {
                let gap =
                    self.begin[k] - self.held[r] + system_data.rows.compliance[r] * tension[r];
                let ahead = side * gap - (self.left + self.share) * drift;
                let young = system_data.regularization.ahead(r).max(0.0);
                let more = young * stiff_part(system_data, &bound, dt) * ahead.max(0.0);
                system_data.add_violation(r, -side * more, dt);
            }
        }
    }

    /// Both in the rows' `gaps` φ + τ r of an implicit sub-step `dt` long.
    pub(crate) fn leave_gaps(&self, rows: &Linearized, gaps: &mut [f64], dt: f64) {
        for (k, bound) in rows.bounds.iter().enumerate() {
            gaps[bound.row] += rows.damping[bound.row] * self.slack(k, bound) / dt;
        }
        for (gap, (drift, held)) in gaps.iter_mut().zip(self.drift.iter().zip(&self.held)) {
            *gap -= self.left * drift + held;
        }
    }
}

/// 2 ∫₀¹ (1 − u) (φ + u `change`)₊ du.
fn earlier_mean(phi: f64, change: f64) -> f64 {
    let zero = -phi / change;
    match (phi >= 0.0, phi + change >= 0.0) {
        (true, true) => phi + change / 3.0,
        (true, false) => -change * zero * zero * (1.0 - zero / 3.0),
        (false, true) => change * (1.0 - zero).powi(3) / 3.0,
        (false, false) => 0.0,
    }
}

/// The [`share`] of a bounded row.
fn stiff_part(system_data: &SystemData, bound: &RowBounds, dt: f64) -> f64 {
    let response = response_of_row(system_data, bound.constraint, bound.row);
    share(response, system_data.rows.compliance[bound.row], dt)
}

/// The share w of linearly implicit weights of a young row with this J M̃⁻¹ Jᵀ and this compliance.
fn share(response: f64, compliance: f64, dt: f64) -> f64 {
    let (stiff, soft) = (dt * dt * response, HALF * HALF * compliance);
    if stiff > 0.0 {
        1.0 / (1.0 + (soft / stiff).powi(2))
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_damping;
