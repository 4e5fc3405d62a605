//! Massless cables over sheaves that grip them: a length for each part between two such sheaves.
//!
//! Over a sheave with Coulomb friction μ the tensions before and after it may differ up to the ratio k = e^(μθ), θ being the
//! wrap (Euler, Eytelwein). [`Scene::reeve`] cuts a cable in the middle of each such wrap. A part is a [`MasslessCable`]
//! that is fastened to the sheave there ([`Sheave::shared`]), turns with it and has a tension of its own; as long as the
//! cable sticks that is all. Where it slips over the groove at a rate s, length goes from the part before to the one after:
//!
//! ```text
//! T_out ≤ k T_in  ⟂  s ≥ 0,    T_in ≤ k T_out  ⟂  s ≤ 0,    ℓ̇_in = −s,  ℓ̇_out = s
//! ```
//!
//! which a time stepper solves for. The sum of the lengths stays. After a step the cut goes to the middle of the wrap again,
//! by δ, and r δ from one length to the other: no φ changes. A part has the compliance Λ/EA of its present length, so that
//! length that slips at a fixed geometry changes the tensions linearly.

use super::Scene;
use crate::body::Bodies;
use crate::constraint::{Constraint, End, Lay, MasslessCable, Sheave, called};
use crate::error::{SceneError, check};
use crate::frame::Frame;

/// Largest μθ: beyond it e^(μθ) is no number.
const LARGEST: f64 = 700.0;

/// A sheave that grips a cable: the one that the first part ends at and the second begins with.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Capstan {
    /// The parts before and after it, by their constraints.
    pub parts: [usize; 2],
    /// Coefficient of friction μ ≥ 0.
    pub friction: f64,
}

impl Scene {
    /// Appends a massless cable, cut at its inner sheaves that have friction, and returns the numbers of its parts. They are
    /// called `name`, `name-2`, `name-3` … The bodies have to be in their places. At the beginning all parts are strained
    /// alike; a winch pays out at the first point.
    ///
    /// # Errors
    /// A path that the cable cannot take, friction that is no number ≥ 0 or at an end, a cable that can push.
    pub fn reeve(
        &mut self,
        name: &str,
        cable: &MasslessCable,
        group: u32,
    ) -> Result<Vec<usize>, SceneError> {
        let mut bodies = cable.frames.iter().filter_map(Frame::body_index);
        if let Some(i) = bodies.find(|i| *i >= self.bodies.len()) {
            return Err(self.unknown_body(&format!("massless cable `{name}`"), i));
        }
        let (parts, frictions) = cable.in_parts(name, &self.bodies)?;
        let mut numbers = Vec::with_capacity(parts.len());
        for (i, part) in parts.into_iter().enumerate() {
            numbers.push(self.add_constraint(part_name(name, i), part, group));
        }
        let joined = numbers.windows(2).zip(frictions);
        self.capstans.extend(joined.map(|(pair, friction)| Capstan {
            parts: [pair[0], pair[1]],
            friction,
        }));
        Ok(numbers)
    }

    /// Lays new cables on their sheaves as the bodies are at time `t` (s): from then on what winds up on a drum counts.
    pub fn lay_cables(&mut self, t: f64) {
        for constraint in &mut self.constraints {
            if let Constraint::MasslessCable(cable) = constraint
                && cable.is_new()
            {
                cable.update_winding(&self.bodies, t);
            }
        }
    }

    /// The parts at a capstan.
    fn parts(&self, capstan: &Capstan) -> Option<[&MasslessCable; 2]> {
        let [before, after] = capstan.parts.map(|i| match self.constraints.get(i) {
            Some(Constraint::MasslessCable(cable)) => Some(cable),
            _ => None,
        });
        Some([before?, after?])
    }

    /// The part with that number; nothing where a capstan names what is none.
    fn part_mut(&mut self, i: usize) -> Option<&mut MasslessCable> {
        match self.constraints.get_mut(i) {
            Some(Constraint::MasslessCable(cable)) => Some(cable),
            _ => None,
        }
    }

    /// Wrap of capstan number `i` \[rad]; NaN where there is none.
    #[must_use]
    pub fn wrap(&self, i: usize) -> f64 {
        let parts = self.capstans.get(i).and_then(|c| self.parts(c));
        parts.map_or(f64::NAN, |[before, after]| {
            after.first_leaving() - before.last_arriving()
        })
    }

    /// Moves each capstan's cut to the middle of its wrap, and the lengths with it. Allocates: no.
    pub fn recut(&mut self) {
        for i in 0..self.capstans.len() {
            let capstan = self.capstans[i];
            let Some([before, after]) = self.parts(&capstan) else {
                continue;
            };
            let cut = 0.5 * (before.last_arriving() + after.first_leaving());
            if !cut.is_finite() {
                continue;
            }
            for (part, end) in capstan.parts.into_iter().zip([End::Last, End::First]) {
                if let Some(part) = self.part_mut(part) {
                    part.cut_at(cut, end);
                }
            }
        }
    }

    /// Moves the length `by` (m) over capstan number `i` from the part before to the one after. Allocates: no.
    pub fn slip(&mut self, i: usize, by: f64) {
        let Some(capstan) = self.capstans.get(i).copied() else {
            return;
        };
        for (part, by) in capstan.parts.into_iter().zip([-by, by]) {
            if let Some(part) = self.part_mut(part) {
                part.lengthen(by);
            }
        }
    }

    /// Lengths of the parts at capstan number `i` \[m] and its cut \[rad], for [`put_back`](Self::put_back).
    #[must_use]
    pub fn lengths_at(&self, i: usize) -> [f64; 3] {
        let parts = self.capstans.get(i).and_then(|c| self.parts(c));
        parts.map_or([f64::NAN; 3], |[before, after]| {
            [before.length, after.length, after.first_arriving()]
        })
    }

    /// Puts back what [`lengths_at`](Self::lengths_at) told. Allocates: no.
    pub fn put_back(&mut self, i: usize, [before, after, cut]: [f64; 3]) {
        let Some(capstan) = self.capstans.get(i).copied() else {
            return;
        };
        let both = [(before, End::Last), (after, End::First)];
        for (part, (length, end)) in capstan.parts.into_iter().zip(both) {
            if let Some(part) = self.part_mut(part) {
                part.fasten(cut, end);
                part.lengthen(length - part.length);
                part.length = length;
            }
        }
    }

    /// Checks that each capstan joins the end of a part to the beginning of another one, on one sheave.
    pub(crate) fn validate_capstans(&self) -> Result<(), SceneError> {
        for (i, capstan) in self.capstans.iter().enumerate() {
            let what = || format!("capstan {}", i + 1);
            let needs = "≥ 0";
            check(
                format!("{}: friction", what()),
                capstan.friction,
                capstan.friction >= 0.0,
                needs,
            )?;
            let joined = self.parts(capstan).is_some_and(|[before, after]| {
                let ends = [before.sheaves.last(), after.sheaves.first()];
                let frames = [before.frames.last(), after.frames.first()];
                let [Some(Some(end)), Some(Some(begin))] = ends else {
                    return false;
                };
                end.shared
                    && begin.shared
                    && end.radius == begin.radius
                    && frames[0] == frames[1]
                    && before.tension_only
                    && after.tension_only
            });
            if !joined {
                return Err(SceneError::Conflict {
                    what: what(),
                    reason: "does not join two parts on one shared sheave: lay the cable with `Scene::reeve`",
                });
            }
            let turned = capstan.friction * self.wrap(i);
            let needs = "≤ 700: friction times wrap, of which e^(μθ) is taken; use a drum that does not slip instead";
            // A wrap that is not known yet is no number.
            if turned > LARGEST {
                check(format!("{}: μθ", what()), turned, false, needs)?;
            }
        }
        Ok(())
    }
}

/// Gives the parts of a cable its length and compliance so that they are strained alike.
fn share(parts: &mut [MasslessCable], whole: &MasslessCable, bodies: &Bodies) {
    let spans: Vec<f64> = parts.iter().map(|part| part.path(bodies, 0.0)).collect();
    let wound: Vec<f64> = parts.iter().map(MasslessCable::wound).collect();
    let (path, off) = (spans.iter().sum::<f64>(), wound.iter().sum::<f64>());
    let part_of = (whole.length - off) / (path - off);
    let per_metre = whole.law.compliance / whole.length;
    for (part, (span, wound)) in parts.iter_mut().zip(spans.iter().zip(&wound)) {
        part.length = (span - wound) * part_of + wound;
        part.law.compliance = per_metre * part.length;
    }
}

/// Name of part number `i`, from 0, of a cable.
pub(crate) fn part_name(name: &str, i: usize) -> String {
    match i {
        0 => name.to_owned(),
        _ => format!("{name}-{}", i + 1),
    }
}

impl MasslessCable {
    /// Its parts between the inner sheaves that have friction, with the friction between each and the next.
    ///
    /// # Errors
    /// As [`Scene::reeve`].
    pub(crate) fn in_parts(
        &self,
        name: &str,
        bodies: &Bodies,
    ) -> Result<(Vec<Self>, Vec<f64>), SceneError> {
        let of = format!("massless cable `{name}`");
        let what = |side: usize| called(&of, side);
        self.check_path(bodies, 0.0, &of)?;
        let friction = |side: usize| self.sheaves[side].map_or(0.0, |s| s.friction);
        let cuts: Vec<usize> = (0..self.sheaves.len())
            .filter(|&side| friction(side) > 0.0)
            .collect();
        if cuts.is_empty() {
            return Ok((vec![self.clone()], Vec::new()));
        }
        if !self.tension_only {
            return Err(SceneError::Conflict {
                what: of,
                reason: "pushes, which over a sheave with friction nothing can: remove `tension_only = false` or the friction",
            });
        }
        let mut laid = self.clone();
        laid.update_winding(bodies, 0.0);
        for &side in &cuts {
            if let Some(Lay::On { arriving, leaving }) = laid.sheaves[side].map(|s| s.lay) {
                let turned = friction(side) * (leaving - arriving);
                let needs =
                    "≤ 700, for e^(μθ): let the cable end on a drum, which it does not slip from";
                check(
                    format!("{}: friction times wrap", what(side)),
                    turned,
                    turned <= LARGEST,
                    needs,
                )?;
            }
        }
        let mut first = 0;
        let ends = cuts.iter().copied().chain([self.frames.len() - 1]);
        let parts = ends.map(|end| laid.part(std::mem::replace(&mut first, end), end));
        let mut parts: Vec<_> = parts.collect();
        share(&mut parts, self, bodies);
        Ok((parts, cuts.into_iter().map(friction).collect()))
    }

    /// The part from one side to another, which are sheaves it shares with other parts unless they are its ends.
    fn part(&self, first: usize, last: usize) -> Self {
        let mut sheaves = self.sheaves[first..=last].to_vec();
        let ends = sheaves.len() - 1;
        for (end, inner) in [(0, first > 0), (ends, last + 1 < self.frames.len())] {
            if let Some(sheave) = sheaves[end].as_mut().filter(|_| inner) {
                let mut cut = *sheave;
                if let Lay::On { arriving, leaving } = sheave.lay {
                    let middle = 0.5 * (arriving + leaving);
                    cut.lay = if end == 0 {
                        Lay::On {
                            arriving: middle,
                            leaving,
                        }
                    } else {
                        Lay::On {
                            arriving,
                            leaving: middle,
                        }
                    };
                }
                *sheave = Sheave {
                    friction: 0.0,
                    turns: 0.0,
                    shared: true,
                    ..cut
                };
            }
        }
        Self {
            frames: self.frames[first..=last].to_vec(),
            sheaves,
            winch: self.winch.filter(|_| first == 0),
            ..self.clone()
        }
    }
}
