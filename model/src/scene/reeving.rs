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
//! by δ, and r δ from one length to the other: no φ changes. A cable that leaves such a sheave is one part there until it
//! lies down on it again ([`Scene::lift_off`], [`Scene::lay_down`]): at θ = 0 the lengths add up, the gradients do, and k
//! is 1, so that nothing jumps; where the tensions differed by rounding, springs in a row only lose energy. A part has the compliance Λ/EA of its stretched length, so that
//! length that slips at a fixed geometry changes the tensions linearly; a cable of one part has that of its length at rest,
//! which differs by the strain.

use super::{Scene, When};
use crate::body::Bodies;
use crate::constraint::{Constraint, End, MasslessCable, Sheave, SheaveContact, Winch, side_name};
use crate::error::{SceneError, check, refuse};
use crate::frame::Frame;

/// Largest μθ: beyond it e^(μθ) overflows.
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

/// Rest state of a part at a capstan: everything of it that slip and a moving cut change.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RestState {
    /// Length at rest \[m].
    pub(crate) length: f64,
    compliance: f64,
    winch: Option<Winch>,
    /// Angle on the sheave at which the part is fastened \[rad].
    pub(crate) cut: f64,
}

impl Scene {
    /// Appends a massless cable, cut at its inner sheaves that have friction, and returns the numbers of its parts. They are
    /// called `name`, `name-2`, `name-3` … The bodies have to be in their places. At the beginning all parts are strained
    /// alike; a winch pays out at the first point.
    ///
    /// # Errors
    /// A path that the cable cannot take, friction that is not ≥ 0 or stands at an end, a cable
    /// that can push.
    pub fn reeve(
        &mut self,
        name: &str,
        cable: &MasslessCable,
        group: u32,
    ) -> Result<Vec<usize>, SceneError> {
        self.reeve_at(name, cable, group, 0.0)
    }

    /// [`reeve`](Self::reeve) at time `t` (s), which the cable has its length at.
    ///
    /// # Errors
    /// As there.
    pub fn reeve_at(
        &mut self,
        name: &str,
        cable: &MasslessCable,
        group: u32,
        t: f64,
    ) -> Result<Vec<usize>, SceneError> {
        let mut bodies = cable.frames.iter().filter_map(Frame::body_index);
        if let Some(i) = bodies.find(|i| *i >= self.bodies.len()) {
            return Err(self.unknown_body(&format!("massless cable `{name}`"), i));
        }
        let parts = cable.in_parts(name, &self.bodies, t)?;
        let mut numbers: Vec<usize> = Vec::with_capacity(parts.len());
        self.add_parts(parts, (name, 0), group, &mut numbers);
        Ok(numbers)
    }

    /// Appends parts of the cable called `name`, `passed` of whose sheaves with friction come before them, and their numbers
    /// to `numbers`. They go on from the last of those.
    fn add_parts(
        &mut self,
        parts: impl IntoIterator<Item = Part>,
        (name, passed): (&str, usize),
        group: u32,
        numbers: &mut Vec<usize>,
    ) {
        for Part { cable, after } in parts {
            let (number, friction) = after.unwrap_or_default();
            let number = self.add_constraint(part_name(name, passed + number), cable, group);
            if let Some(before) = numbers.last() {
                let parts = [*before, number];
                self.capstans.push(Capstan { parts, friction });
            }
            numbers.push(number);
        }
    }

    /// True if a cable has sheaves with friction, whether it lies on them or not.
    #[must_use]
    pub fn has_rough_sheaves(&self) -> bool {
        let rough = |cable: &MasslessCable| cable.rough_sheaves().next().is_some();
        !self.capstans.is_empty() || self.massless_cables().any(|(_, cable)| rough(cable))
    }

    /// The sheaves with friction that a cable has left, by their capstans: the wrap is negative.
    pub fn left(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.capstans.len()).filter(|i| self.wrap(*i) < 0.0)
    }

    /// Makes the parts at capstan number `i` one, in the place of the first of them, that passes the sheave by from time `t`
    /// (s) on. What watches the second one watches it. Returns the number of the second one, which nothing names any more
    /// and which is to be [removed](Self::remove).
    pub fn lift_off(&mut self, i: usize, t: f64) -> Option<usize> {
        let capstan = *self.capstans.get(i)?;
        let [first, second] = capstan.parts;
        let mut after = self.massless_mut(second)?.clone();
        after.rebase(t);
        let before = self.massless_mut(first)?;
        before.append(&after, capstan.friction, t);
        self.capstans.remove(i);
        for capstan in &mut self.capstans {
            capstan.parts = capstan.parts.map(|c| if c == second { first } else { c });
        }
        for event in &mut self.events {
            if let When::Force { constraint, .. } = &mut event.when
                && *constraint == second
            {
                *constraint = first;
            }
        }
        Some(second)
    }

    /// The cables that lie on a sheave with friction which they have passed by so far.
    pub fn landed(&self) -> impl Iterator<Item = usize> + '_ {
        let cables = self.massless_cables();
        cables.filter_map(|(c, cable)| cable.grips().then_some(c))
    }

    /// Cuts a cable at the sheaves with friction that it lies on since time `t` (s). The first part stays in its place; returns
    /// the numbers of the others, which are appended. All have the tension that it had, and what slips over other sheaves goes on.
    ///
    /// # Errors
    /// As [`reeve`](Self::reeve); the scene is then as it was.
    pub fn lay_down(&mut self, c: usize, t: f64) -> Result<Vec<usize>, SceneError> {
        let Some(cable) = self.massless(c) else {
            return Ok(Vec::new());
        };
        let mut cable = cable.clone();
        cable.rebase(t);
        let (name, passed) = self.begins_with(c);
        let mut parts = cable.in_parts(&name, &self.bodies, t)?.into_iter();
        let Some(first) = parts.next() else {
            return Ok(Vec::new());
        };
        let group = self.groups[c];
        self.constraints[c] = first.cable.into();
        let mut numbers = vec![c];
        self.add_parts(parts, (&name, passed), group, &mut numbers);
        let (last, made) = (numbers[numbers.len() - 1], numbers.len() - 1);
        let known = self.capstans.len() - made;
        for capstan in &mut self.capstans[..known] {
            // A part that followed the whole follows its last part now.
            let [before, _] = &mut capstan.parts;
            *before = if *before == c { last } else { *before };
        }
        Ok(numbers.split_off(1))
    }

    /// The parts of the cable that constraint number `c` is a part of, from its first one; `c`
    /// alone if it is not a part.
    pub fn parts_of(&self, c: usize) -> impl Iterator<Item = usize> + '_ {
        // A chain has no more links than there are capstans.
        let count = self.capstans.len();
        let linked = move |c: &usize, [from, to]: [usize; 2]| {
            let link = self.capstans.iter().find(|s| s.parts[from] == *c);
            link.map(|s| s.parts[to])
        };
        let back = std::iter::successors(Some(c), move |c| linked(c, [1, 0]));
        let first = back.take(count + 1).last();
        std::iter::successors(first, move |c| linked(c, [0, 1])).take(count + 1)
    }

    /// Name of the cable that constraint number `c` is a part of, and how many sheaves with friction come before it.
    fn begins_with(&self, c: usize) -> (String, usize) {
        let (mut name, mut passed) = (c, 0);
        for (k, part) in self.parts_of(c).take_while(|part| *part != c).enumerate() {
            if k == 0 {
                name = part;
            }
            let left = self.massless(part).map(|part| part.rough_sheaves().count());
            passed += 1 + left.unwrap_or(0);
        }
        (self.constraint_name(name).to_owned(), passed)
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
        let [before, after] = capstan.parts.map(|i| self.massless(i));
        Some([before?, after?])
    }

    /// Massless cable number `i`; `None` for any other constraint.
    fn massless(&self, i: usize) -> Option<&MasslessCable> {
        self.constraints.get(i)?.massless_cable()
    }

    /// [`massless`](Self::massless), to be changed.
    fn massless_mut(&mut self, i: usize) -> Option<&mut MasslessCable> {
        match self.constraints.get_mut(i) {
            Some(Constraint::MasslessCable(cable)) => Some(cable),
            _ => None,
        }
    }

    /// Wrap of capstan number `i` \[rad]; NaN if there is no such capstan.
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
                if let Some(part) = self.massless_mut(part) {
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
            if let Some(part) = self.massless_mut(part) {
                part.lengthen(by, t);
            }
        }
    }

    /// Rest state of the parts at capstan number `i`, for [`restore_rest`](Self::restore_rest).
    #[must_use]
    pub fn rest_states(&self, i: usize) -> [RestState; 2] {
        let parts = self.capstans.get(i).and_then(|c| self.parts(c));
        let rest = |part: &MasslessCable, cut: f64| RestState {
            length: part.length,
            compliance: part.law.compliance,
            winch: part.winch,
            cut,
        };
        parts.map_or_else(Default::default, |[before, after]| {
            let cut = after.first_arriving();
            [rest(before, cut), rest(after, cut)]
        })
    }

    /// Restores the state that [`rest_states`](Self::rest_states) returned. Does not allocate.
    pub fn restore_rest(&mut self, i: usize, rest: &[RestState; 2]) {
        let Some(capstan) = self.capstans.get(i).copied() else {
            return;
        };
        let both = rest.iter().zip([End::Last, End::First]);
        for (part, (rest, end)) in capstan.parts.into_iter().zip(both) {
            if let Some(part) = self.massless_mut(part) {
                part.fasten(rest.cut, end);
                part.length = rest.length;
                part.law.compliance = rest.compliance;
                part.winch = rest.winch;
            }
        }
    }

    /// Checks that each capstan joins the end of a part to the beginning of another one, on one sheave.
    pub(crate) fn validate_capstans(&self) -> Result<(), SceneError> {
        for (i, capstan) in self.capstans.iter().enumerate() {
            let what = || format!("capstan {}", i + 1);
            let (of, friction) = (format!("{}: friction", what()), capstan.friction);
            check(of, friction, friction >= 0.0, "≥ 0")?;
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
                let reason = "does not go on from another part on one shared sheave with `on` in both: lay the whole cable \
                             at once, by `Scene::reeve` or as one [[massless_cable]]";
                let of = format!("{}: `{}`", what(), self.constraint_name(after));
                return refuse(of, reason);
            }
        }
        self.validate_shared()
    }

    /// Checks that each shared end of a part is at one capstan.
    fn validate_shared(&self) -> Result<(), SceneError> {
        for (c, part) in self.massless_cables() {
            let is_shared =
                |end: Option<&Option<Sheave>>| end.is_some_and(|s| s.is_some_and(|s| s.shared));
            let ends = [part.sheaves.last(), part.sheaves.first()];
            for (k, shared) in ends.map(is_shared).into_iter().enumerate() {
                let capstans = self.capstans.iter().filter(|capstan| capstan.parts[k] == c);
                if capstans.count() != usize::from(shared) {
                    let reason =
                        "has a shared sheave that one other part has to go on from, and no more";
                    return refuse(format!("joint `{}`", self.constraint_names[c]), reason);
                }
            }
        }
        Ok(())
    }
}

/// A part of a cable, and after what it comes: the number of sheaves with friction before it, and the friction of the last.
pub(crate) struct Part {
    pub(crate) cable: MasslessCable,
    pub(crate) after: Option<(usize, f64)>,
}

/// Gives the parts of a cable its length and compliance at time `t` so that they are strained alike.
fn share(parts: &mut [Part], whole: &MasslessCable, bodies: &Bodies, t: f64) {
    let lengths = |part: &Part| (part.cable.path(bodies, t), part.cable.wound());
    let (spans, wound): (Vec<f64>, Vec<f64>) = parts.iter().map(lengths).unzip();
    let (path, off) = (spans.iter().sum::<f64>(), wound.iter().sum::<f64>());
    let part_of = (whole.length - off) / (path - off);
    let per_metre = whole.law.compliance / whole.length;
    for (Part { cable, .. }, (span, wound)) in parts.iter_mut().zip(spans.iter().zip(&wound)) {
        cable.length = (span - wound) * part_of + wound;
        cable.law.compliance = per_metre * cable.length;
        if let Some(winch) = &mut cable.winch {
            // The winch feeds the whole: what lies in the other parts is off its limits.
            winch.shortest -= whole.length - cable.length;
            winch.longest -= whole.length - cable.length;
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
    /// Its inner sheaves with friction, on which it lies or not.
    fn rough_sheaves(&self) -> impl Iterator<Item = usize> + '_ {
        let rough = |s: &Option<Sheave>| s.is_some_and(|s| s.friction > 0.0);
        (0..self.sheaves.len()).filter(move |&side| rough(&self.sheaves[side]))
    }

    /// True if it lies on an inner sheave with friction; a part never does.
    fn grips(&self) -> bool {
        let on = |side: usize| self.sheaves[side].is_some_and(|s| !s.contact.is_off());
        self.rough_sheaves().any(on)
    }

    /// Its parts between the inner sheaves that have friction and that it lies on, at time `t` (s).
    pub(crate) fn in_parts(
        &self,
        name: &str,
        bodies: &Bodies,
        t: f64,
    ) -> Result<Vec<Part>, SceneError> {
        let of = format!("massless cable `{name}`");
        let what = |side: usize| side_name(&of, side);
        self.check_path(bodies, t, &of)?;
        let friction = |side: usize| self.sheaves[side].map_or(0.0, |s| s.friction);
        let rough: Vec<usize> = self.rough_sheaves().collect();
        if !rough.is_empty() && !self.tension_only {
            let reason = "pushes, which over a sheave with friction nothing can: remove `tension_only = false` or the friction";
            return refuse(of, reason);
        }
        let mut wound = self.clone();
        wound.update_winding(bodies, t);
        // Number of sheaves with friction up to each cut.
        let mut cuts: Vec<(usize, usize)> = Vec::with_capacity(rough.len());
        for (passed, &side) in (1..).zip(&rough) {
            if self.sheaves[side].is_some_and(|s| s.contact.is_off()) {
                // Until a step has it lie down.
                wound.sheaves[side] = self.sheaves[side];
            }
            let contact = wound.sheaves[side].map(|s| s.contact);
            if let Some(SheaveContact::On { arriving, leaving }) = contact {
                let turned = friction(side) * (leaving - arriving);
                let needs =
                    "≤ 700, for e^(μθ): let the cable end on a drum, which it does not slip from";
                let of = format!("{}: friction times wrap", what(side));
                check(of, turned, turned <= LARGEST, needs)?;
                cuts.push((side, passed));
            }
        }
        if cuts.is_empty() {
            let (cable, after) = (self.clone(), None);
            return Ok(vec![Part { cable, after }]);
        }
        let mut begin = (0, None);
        let ends = cuts.into_iter();
        let ends = ends.map(|(side, passed)| (side, Some((passed, friction(side)))));
        let part = |(end, next): (usize, Option<(usize, f64)>)| {
            let (first, after) = std::mem::replace(&mut begin, (end, next));
            let cable = wound.part(first, end);
            Part { cable, after }
        };
        let ends = ends.chain([(self.frames.len() - 1, None)]);
        let mut parts: Vec<_> = ends.map(part).collect();
        share(&mut parts, self, bodies, t);
        Ok(parts)
    }

    /// Goes on as another part at time `t` (s), past the sheave with friction at which they were joined.
    fn append(&mut self, after: &Self, friction: f64, t: f64) {
        let compliance = self.law.compliance + after.law.compliance;
        self.rebase(t);
        self.lengthen(after.length, t);
        self.law.compliance = compliance;
        if let Some(Some(sheave)) = self.sheaves.last_mut() {
            let contact = SheaveContact::Off { clear: true };
            *sheave = Sheave {
                friction,
                contact,
                ..Sheave::new(sheave.radius)
            };
        }
        self.frames.extend_from_slice(&after.frames[1..]);
        self.sheaves.extend_from_slice(&after.sheaves[1..]);
    }

    /// The part from one side to another, which are sheaves it shares with other parts unless they are its ends.
    fn part(&self, first: usize, last: usize) -> Self {
        let mut sheaves = self.sheaves[first..=last].to_vec();
        let ends = sheaves.len() - 1;
        for (end, inner) in [(0, first > 0), (ends, last + 1 < self.frames.len())] {
            if let Some(sheave) = sheaves[end].as_mut().filter(|_| inner) {
                let mut cut = *sheave;
                if let SheaveContact::On { arriving, leaving } = &mut cut.contact {
                    let middle = 0.5 * (*arriving + *leaving);
                    *(if end == 0 { arriving } else { leaving }) = middle;
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
