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
//! by δ, and r δ from one length to the other: no φ changes. A part has the compliance Λ/EA of its stretched length, so that
//! length that slips at a fixed geometry changes the tensions linearly; a cable of one part has that of its length at rest,
//! which differs by the strain.

use super::Scene;
use crate::body::Bodies;
use crate::constraint::{Constraint, End, Lay, MasslessCable, Sheave, Winch, called};
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

/// What a part is laid with: all that slip and a cut that moves change of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Laid {
    length: f64,
    compliance: f64,
    winch: Option<Winch>,
    cut: f64,
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

    /// Moves each capstan's cut to the middle of its wrap, and the lengths with it, at time `t` (s). Allocates: no.
    pub fn recut(&mut self, t: f64) {
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
                    part.cut_at(cut, end, t);
                }
            }
        }
    }

    /// Moves the length `by` (m) over capstan number `i` from the part before to the one after at time `t` (s). Allocates: no.
    pub fn slip(&mut self, i: usize, by: f64, t: f64) {
        let Some(capstan) = self.capstans.get(i).copied() else {
            return;
        };
        for (part, by) in capstan.parts.into_iter().zip([-by, by]) {
            if let Some(part) = self.part_mut(part) {
                part.lengthen(by, t);
            }
        }
    }

    /// What the parts at capstan number `i` are laid with, for [`put_back`](Self::put_back).
    #[must_use]
    pub fn laid_at(&self, i: usize) -> [Laid; 2] {
        let parts = self.capstans.get(i).and_then(|c| self.parts(c));
        let laid = |part: &MasslessCable, cut: f64| Laid {
            length: part.length,
            compliance: part.law.compliance,
            winch: part.winch,
            cut,
        };
        parts.map_or_else(Default::default, |[before, after]| {
            let cut = after.first_arriving();
            [laid(before, cut), laid(after, cut)]
        })
    }

    /// Puts back what [`laid_at`](Self::laid_at) told. Allocates: no.
    pub fn put_back(&mut self, i: usize, laid: &[Laid; 2]) {
        let Some(capstan) = self.capstans.get(i).copied() else {
            return;
        };
        let both = laid.iter().zip([End::Last, End::First]);
        for (part, (laid, end)) in capstan.parts.into_iter().zip(both) {
            if let Some(part) = self.part_mut(part) {
                part.fasten(laid.cut, end);
                part.length = laid.length;
                part.law.compliance = laid.compliance;
                part.winch = laid.winch;
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
            let [before, after] = capstan.parts;
            let joined = before != after
                && self.parts(capstan).is_some_and(|[before, after]| {
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
                        && self.wrap(i).is_finite()
                });
            if !joined {
                return Err(SceneError::Conflict {
                    what: format!("{}: `{}`", what(), self.constraint_name(after)),
                    reason: "does not go on from another part on one shared sheave with `on` in both: lay the whole cable \
                             at once, by `Scene::reeve` or as one [[massless_cable]]",
                });
            }
        }
        self.validate_shared()
    }

    /// Checks that each shared end of a part is at one capstan.
    fn validate_shared(&self) -> Result<(), SceneError> {
        for (c, constraint) in self.constraints.iter().enumerate() {
            let Constraint::MasslessCable(part) = constraint else {
                continue;
            };
            let is_shared =
                |end: Option<&Option<Sheave>>| end.is_some_and(|s| s.is_some_and(|s| s.shared));
            let ends = [
                is_shared(part.sheaves.last()),
                is_shared(part.sheaves.first()),
            ];
            for (k, shared) in ends.into_iter().enumerate() {
                let capstans = self.capstans.iter().filter(|capstan| capstan.parts[k] == c);
                if capstans.count() != usize::from(shared) {
                    return Err(SceneError::Conflict {
                        what: format!("joint `{}`", self.constraint_names[c]),
                        reason: "has a shared sheave that one other part has to go on from, and no more",
                    });
                }
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
        if let Some(winch) = &mut part.winch {
            // The winch feeds the whole: what lies in the other parts is off its limits.
            winch.shortest -= whole.length - part.length;
            winch.longest -= whole.length - part.length;
        }
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
            if self.sheaves[side].is_some_and(|s| s.lay.is_off()) {
                return Err(SceneError::Conflict {
                    what: what(side),
                    reason: "is off: only sheaves without friction let the cable pass by",
                });
            }
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
