//! Massless cable: the total length through any number of attachment points, with a winch if wanted.
//!
//! With the points p₀ … p_m (p = x + r) and the spans d_k = p_{k−1} − p_k, n_k = d_k/|d_k|:
//!
//!   φ = Σ_k |d_k| − L(t)  \[SL §III (b)],   φ̇ = Σ_j (n_{j+1} − n_j)·ṗ_j − L̇,  n_0 = n_{m+1} = 0
//!
//! 1 row, m. The cable slides freely through the inner points: one tension |λ| in all spans. With
//! [`sheaves`](MasslessCable::sheaves) it runs over wheels there ([`Sheave`]); beyond one with friction a cable goes on as
//! another one ([`crate::Scene::reeve`]). φ > 0 and λ < 0 where it is taut. With `tension_only` the row has the bound λ ≤ 0 and is
//! slack where it is too long; without, it also pushes.
//!
//! A winch changes L at a speed of its own and holds up to a tension F: λ ≥ −F. Where that is not enough the drum slips:
//! what is then paid out is what the elastic law asks for, Σ|d_k| − L = ε F ([`MasslessCable::settle`]). Compliance is
//! proportional to the length, ε(L) = ε L/L_ref.
//!
//! A span of length zero has no direction: it is taken to be z, so that all is finite.

mod path;

pub(crate) use path::End;

use nalgebra::Vector3;

use super::distance::direction;
use super::facts::{Facts, NO_ROWS, Parts, any_moves, difference};
use super::sheave::Sheave;
use super::{RowKind, RowLaw, Rows};
use crate::body::Bodies;
use crate::error::{SceneError, check, limited};
use crate::frame::{Frame, Resolved};
#[cfg(feature = "serde")]
use crate::unlimited::is_zero;

/// A tension less than the limit by this part of it is rounding.
const STALL: f64 = 1e-9;

/// Pays a cable out and hauls it in.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Winch {
    /// Speed at which it pays out \[m/s]; negative hauls in; default 0. Without effect while the brake is on.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    pub speed: f64,
    /// Largest tension that the winch holds while the brake is off \[N], ≥ 0; above it the drum slips; default no limit, as `inf`.
    #[cfg_attr(feature = "serde", serde(with = "crate::unlimited"))]
    pub force_limit: f64,
    /// True while the brake is on: the drum then stands still; default `false`.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "std::ops::Not::not"))]
    pub brake: bool,
    /// Largest tension that the brake holds \[N], ≥ 0; above it the drum slips; default no limit, as `inf`.
    #[cfg_attr(feature = "serde", serde(with = "crate::unlimited"))]
    pub brake_limit: f64,
    /// Length at which hauling in stops \[m], > 0; default 1e-3.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_shortest"))]
    pub shortest: f64,
    /// Length at which the drum is empty and its end holds any tension \[m]; default no limit, as `inf`.
    #[cfg_attr(feature = "serde", serde(with = "crate::unlimited"))]
    pub longest: f64,
    /// True while a motor that hauls in stands at the end of its empty drum, under a tension beyond `force_limit`. The step sets
    /// it.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "std::ops::Not::not"))]
    pub stalled: bool,
    /// Time from which `speed` holds \[s]; the cable has its `length` then. A winch with a time > 0
    /// rests before it. One with 0, at the start of a run, was running already, so that a load that
    /// moves with its cable feels no start. Default 0.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    pub since: f64,
}

#[cfg(feature = "serde")]
fn is_shortest(length: &f64) -> bool {
    length.to_bits() == Winch::new().shortest.to_bits()
}

impl Winch {
    /// A winch at rest without limits.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            speed: 0.0,
            force_limit: f64::INFINITY,
            brake: false,
            brake_limit: f64::INFINITY,
            shortest: 1e-3,
            longest: f64::INFINITY,
            stalled: false,
            since: 0.0,
        }
    }

    /// Checks that all numbers are in their ranges; `what` is whose winch it is. The limits of a part of a cable are less by the
    /// rope in the other parts.
    ///
    /// # Errors
    /// The first number that is not.
    pub fn validate(&self, is_part: bool, what: impl Fn() -> String) -> Result<(), SceneError> {
        let of = |key: &str| format!("{}: winch.{key}", what());
        check(of("speed"), self.speed, true, "finite (m/s)")?;
        check(of("since"), self.since, true, "finite (s)")?;
        for (key, limit) in [
            ("force_limit", self.force_limit),
            ("brake_limit", self.brake_limit),
        ] {
            let needs = "≥ 0 N; leave it out, or inf, for no limit";
            limited(of(key), limit, limit >= 0.0, needs)?;
        }
        let shortest = self.shortest;
        let needs = "> 0 m: where hauling in stops";
        check(of("shortest"), shortest, shortest > 0.0 || is_part, needs)?;
        let needs = "≥ winch.shortest (m); leave it out, or inf, for no limit";
        limited(of("longest"), self.longest, self.longest >= shortest, needs)
    }

    /// Length at time `t` (s) of a cable that is `length` long at the time [`Winch::since`] \[m].
    #[must_use]
    pub(crate) fn length_at(&self, length: f64, t: f64) -> f64 {
        if self.brake || self.speed == 0.0 || self.stalled {
            return length;
        }
        // A cable that is out of the range already stays as it is.
        let (shortest, longest) = (self.shortest.min(length), self.longest.max(length));
        let after = |time: f64| (length + self.speed * time).clamp(shortest, longest);
        match t - self.since {
            time if time >= 0.0 => after(time),
            _ if self.since > 0.0 => length,
            // As it goes on: a drum at its stop or end stood there before.
            time => (2.0 * length - after(-time)).clamp(shortest, longest),
        }
    }

    /// Lower bound of λ at the length that the cable has at the moment \[N]: of an empty drum its end holds any tension, unless
    /// its motor hauls in.
    pub(crate) fn lower_bound(&self, length: f64) -> f64 {
        let hauls = self.speed < 0.0 && !self.brake && !self.stalled;
        match length < self.longest || hauls {
            true if self.brake => -self.brake_limit,
            true => -self.force_limit,
            false => f64::NEG_INFINITY,
        }
    }

    /// Sets the speed \[m/s], positive pays out, of a cable that is `length` (m) long now. The motor of an empty drum with a
    /// finite `force_limit` that begins to haul in stalls until the next step tells the tension.
    pub fn set_speed(&mut self, speed: f64, length: f64) {
        let begins = self.stalled || self.speed >= 0.0 || self.brake;
        self.speed = speed;
        self.stalled =
            begins && self.force_limit < f64::INFINITY && self.stalls(length, f64::INFINITY);
    }

    /// True where the drum stalls at this length (m) under this tension (N).
    pub(crate) fn stalls(&self, length: f64, tension: f64) -> bool {
        let hauls = self.speed < 0.0 && !self.brake;
        hauls && length >= self.longest && tension >= self.force_limit * (1.0 - STALL)
    }
}

impl Default for Winch {
    fn default() -> Self {
        Self::new()
    }
}

/// Total length through two or more points, 1 row.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MasslessCable {
    /// The attachment frames in the order of the cable, at least 2; their axes are not used.
    pub frames: Vec<Frame>,
    /// The sheaves at these points, one entry a frame with `None` at a plain point, or empty
    /// without sheaves. Those at the ends are drums.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "Vec::is_empty")
    )]
    pub sheaves: Vec<Option<Sheave>>,
    /// Total length L at rest \[m], > 0; with a winch, that at the time [`Winch::since`].
    pub length: f64,
    /// Law of the row, compliance in m/N of a cable with that length.
    pub law: RowLaw,
    /// True for a cable that goes slack instead of pushing.
    pub tension_only: bool,
    /// Winch that changes its length.
    pub winch: Option<Winch>,
}

impl MasslessCable {
    /// A cable without winch that goes slack instead of pushing: through `frames`, `length` in m, compliance in m/N.
    #[must_use]
    pub fn new(frames: Vec<Frame>, length: f64, law: RowLaw) -> Self {
        Self {
            frames,
            sheaves: Vec::new(),
            length,
            law,
            tension_only: true,
            winch: None,
        }
    }

    /// Length at rest at time `t` (s) \[m]; what it was before [`Winch::since`] is said there.
    #[must_use]
    pub fn length_at(&self, t: f64) -> f64 {
        self.winch
            .map_or(self.length, |w| w.length_at(self.length, t))
    }

    /// Compliance at time `t` (s) of what is off the drums \[m/N].
    #[must_use]
    pub fn compliance_at(&self, t: f64) -> f64 {
        let length = self.length_at(t) - self.wound();
        // The quotient of equal numbers is exact.
        self.law.compliance * (length / self.length)
    }

    /// Makes time `t` (s) the one that `length` and compliance belong to, so that the winch can be set anew.
    pub fn rebase(&mut self, t: f64) {
        self.set_length(self.length_at(t), t);
    }

    /// Pays out what a drum that slipped at time `t` (s) has let go, where the spans are `excess` (m) longer than the
    /// length at rest: until its elastic law gives the force `spring` (N), the holding force less that of a damper, or the drum is
    /// empty. Returns what it paid out.
    pub fn settle(&mut self, excess: f64, spring: f64, t: f64) -> f64 {
        let Some(winch) = self.winch else {
            return 0.0;
        };
        let (now, compliance) = (self.length_at(t), self.compliance_at(t));
        // (total − L) = (ε/now) L F, of what is off the drums; a part's compliance is that of its path, (ε/now) total.
        let wound = self.wound();
        let (off, total) = (now - wound, now - wound + excess);
        let strain = compliance / off * spring;
        let settled = match self.is_part() {
            true => total * (1.0 - strain),
            false => total / (1.0 + strain),
        } + wound;
        let settled = settled.min(winch.longest.max(now));
        if settled > now {
            self.set_length(settled, t);
            return settled - now;
        }
        0.0
    }

    /// Empties the drum at time `t` (s). Returns true where rope was left on it.
    pub fn run_out(&mut self, t: f64) -> bool {
        let longest = self.winch.map_or(f64::INFINITY, |w| w.longest);
        let was_not = longest < f64::INFINITY && self.length_at(t) < longest;
        if was_not {
            self.set_length(longest, t);
        }
        was_not
    }

    fn set_length(&mut self, length: f64, t: f64) {
        if let Some(winch) = &mut self.winch {
            self.law.compliance *= length / self.length;
            self.length = length;
            winch.since = winch.since.max(t);
        }
    }

    /// Length of its path at time `t` (s), with what lies on its sheaves: Λ \[m].
    #[must_use]
    pub fn path(&self, bodies: &Bodies, t: f64) -> f64 {
        let mut phi = [0.0];
        self.evaluate(bodies, t, &mut Rows::new(&mut phi, &mut [], &mut []));
        phi[0] + self.length_at(t)
    }

    /// Makes it longer by so much at time `t` (s), of the same material \[m]; what its winch may still feed stays.
    pub(crate) fn lengthen(&mut self, by: f64, t: f64) {
        self.rebase(t);
        if let Some(winch) = &mut self.winch {
            winch.shortest += by;
            winch.longest += by;
        }
        let length = self.length + by;
        self.law.compliance *= length / self.length;
        self.length = length;
    }
}

impl Facts for MasslessCable {
    fn parts(&self) -> Parts {
        [(RowKind::Length, 1, Some(self.law)), NO_ROWS, NO_ROWS]
    }

    fn evaluate(&self, bodies: &Bodies, t: f64, rows: &mut Rows<'_>) {
        if !self.sheaves.is_empty() {
            return self.evaluate_over_sheaves(bodies, t, rows);
        }
        let resolved = |(k, f): (usize, &Frame)| (k, f.resolve(bodies, t));
        let mut sides = self.frames.iter().enumerate().map(resolved);
        let Some(mut last) = sides.next() else {
            return;
        };
        let (mut total, mut blocks) = (0.0, 0);
        let mut before = Vector3::zeros();
        let mut finish = |(k, side): &(usize, Resolved), g: Vector3<f64>| {
            if let Some(block) = rows.block_of(*k, &self.frames[*k], &mut blocks) {
                rows.point(block, 0, &g, &side.lever);
            }
        };
        for next in sides {
            let (length, n) = direction(&super::gap(&last.1, &next.1));
            total += length;
            finish(&last, n - before);
            (before, last) = (n, next);
        }
        finish(&last, -before);
        rows.phi[0] = total - self.length_at(t);
    }

    fn only_pulls(&self, side: usize) -> bool {
        !matches!(self.sheaves.get(side), Some(Some(_)))
    }

    fn link_length(&self) -> Option<f64> {
        Some(self.length)
    }

    fn span_length(&self) -> Option<f64> {
        let off = self.length - self.wound();
        Some(off / (self.frames.len() - 1).max(1) as f64)
    }

    fn gap_ahead(&self, bodies: &Bodies, t: f64, dt: f64) -> ([f64; 3], usize) {
        let excess = self.path_ahead(bodies, t, dt) - self.length_at(t + dt);
        ([excess, 0.0, 0.0], 1)
    }

    fn drive_points(&self, bodies: &Bodies, times: [f64; 2], phi_t: &mut [f64]) {
        let [before, after] = times.map(|t| self.compliance_factor(t, 0.0));
        if any_moves(&self.frames, times) || before != after {
            difference(self, bodies, times, phi_t);
        }
    }

    fn winch(&self) -> Option<&Winch> {
        self.winch.as_ref()
    }

    fn winch_mut(&mut self, t: f64) -> Option<(&mut Winch, f64)> {
        self.rebase(t);
        let winch = self.winch.as_mut()?;
        winch.since = t;
        Some((winch, self.length))
    }

    fn stall(&mut self, tension: f64, t: f64) -> bool {
        let length = self.length_at(t);
        let Some(stalls) = self.winch.map(|w| w.stalls(length, tension)) else {
            return false;
        };
        let changes = self.winch.is_some_and(|w| w.stalled != stalls);
        if changes {
            self.rebase(t);
            self.winch.iter_mut().for_each(|w| w.stalled = stalls);
        }
        changes
    }

    fn length_at(&self, t: f64) -> Option<f64> {
        Some(self.length_at(t))
    }

    fn bounds(&self, t: f64) -> Option<(usize, f64, f64)> {
        let (limited, no_limit) = (self.tension_only || self.winch.is_some(), f64::INFINITY);
        let lower = |winch: Winch| winch.lower_bound(self.length_at(t));
        let upper = if self.tension_only { 0.0 } else { no_limit };
        limited.then(|| (0, self.winch.map_or(-no_limit, lower), upper))
    }

    fn compliance_factor(&self, t: f64, excess: f64) -> f64 {
        if !self.sheaves.is_empty() {
            let excess = if self.is_part() { excess } else { 0.0 };
            return (self.length_at(t) - self.wound() + excess) / self.length;
        }
        if self.winch.is_some() {
            return self.length_at(t) / self.length;
        }
        1.0
    }

    fn update_winding(&mut self, bodies: &Bodies, t: f64) -> bool {
        self.update_winding(bodies, t)
    }

    fn validate(&self, what: &dyn Fn() -> String) -> Result<(), SceneError> {
        let (length, of) = (self.length, || format!("{}: length", what()));
        check(of(), length, length > 0.0, "> 0 m")?;
        let Some(winch) = self.winch else {
            return Ok(());
        };
        winch.validate(self.is_part(), what)?;
        let limits = if self.is_part() { Winch::new() } else { winch };
        let within = (limits.shortest..=limits.longest).contains(&length);
        let needs = "between shortest and longest of its winch";
        check(of(), length, within, needs)
    }
}

#[cfg(test)]
mod tests;
