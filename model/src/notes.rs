//! Limits and plausibility from a scene's own lengths: how far its constraints can open, and which
//! of its numbers are likely mistakes.

use crate::constraint::{Constraint, MasslessCable};
use crate::contacts::{Collisions, Contact};
use crate::error::{SceneError, refuse};
use crate::frame::Frame;
use crate::scene::Scene;

/// Lever arm over a body's radius of gyration beyond which its unit is in doubt: the ends of a rod are at 1.7, and
/// millimetres for metres make that 1,700.
const FAR: f64 = 300.0;

/// Strain beyond which a cable's stiffness is in doubt: steel ropes break at 2 %.
const STRAINED: f64 = 0.05;

/// Fleet angle beyond which the axis of a sheave is in doubt \[°]: crane standards allow 4 in plain grooves.
const STEEP: f64 = 4.0;

/// Slack over length that is no rounding.
const LOOSE: f64 = 1e-9;

/// Overlap of two shapes over the smallest dimension of either, beyond which they are not meant to touch.
const INSIDE: f64 = 0.1;

fn and_more(others: usize) -> String {
    match others {
        0 => String::new(),
        others => format!(" and {others} more"),
    }
}

/// A massless cable at the start, all parts of it together.
#[derive(Debug, Clone, Copy, Default)]
struct RestPath {
    /// Number of its first part.
    first: usize,
    /// Length at rest, length of its path, and length at rest off the drums \[m].
    length: f64,
    path: f64,
    off: f64,
    /// Compliance over length \[1/N].
    per_metre: f64,
}

impl RestPath {
    fn strain(&self) -> f64 {
        (self.path - self.length) / self.off
    }

    /// \[N]; infinite where it is rigid.
    fn tension(&self) -> f64 {
        self.strain() / self.per_metre
    }
}

impl Constraint {
    /// How far it is open for the violations `phi` of its rows (m, rad) \[m]: the distance of the points of a joint, the
    /// distance across a slider's axis, by how much a link is too long or too short; a cable that can go slack is never
    /// too short. `None` where no row measures a gap.
    ///
    /// # Panics
    /// When `phi` is shorter than the rows.
    #[must_use]
    pub fn gap(&self, phi: &[f64]) -> Option<f64> {
        if matches!(self.bounds(0.0), Some((0, _, 0.0))) {
            return Some(phi[0].max(0.0));
        }
        let mut first = 0;
        self.parts().find_map(|(kind, count, _)| {
            let range = first..first + count;
            first += count;
            let gap = kind.is_gap();
            gap.then(|| phi[range].iter().map(|x| x * x).sum::<f64>().sqrt())
        })
    }

    /// Length of cable that it stands for \[m], over which its gap is a strain: that of a link or cable, and the sum of a
    /// joint's lever arms on bodies, which for the joints of a cable is the distance of its segments' centres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.link_length().unwrap_or_else(|| {
            let on_bodies = self.frames().iter().filter(|f| f.body_index().is_some());
            on_bodies.map(|f| f.point.norm()).sum()
        })
    }
}

impl Scene {
    /// Gap of each constraint beyond which a motion of the scene is lost \[m]; infinite where it has none.
    ///
    /// With its length ℓ, the sum of its bodies' radii of gyration where it has no length (of a point mass the longest link
    /// that holds it), and e = ε W of its compliance ε and the scene's weight W (external forces included), a weight that
    /// falls by twice ℓ opens it by e + √(e² + 4 e ℓ) < 2 (ℓ + e), which is the limit. A constraint without any length has
    /// none.
    #[must_use]
    pub fn gap_limits(&self) -> Vec<f64> {
        let weight = self.mass() * self.gravity.norm() + self.external_force();
        let mut sizes: Vec<f64> = (0..self.bodies.len()).map(|i| self.size(i)).collect();
        for c in &self.constraints {
            for body in c.bodies().filter(|body| self.bodies.is_point(*body)) {
                sizes[body] = sizes[body].max(c.length());
            }
        }
        let limit = |c: &Constraint| {
            let (_, _, law) = c.parts().find(|(kind, ..)| kind.is_gap())?;
            let length = match c.length() {
                length if length > 0.0 => length,
                _ => c.bodies().map(|body| sizes[body]).sum(),
            };
            let limit = 2.0 * (length + law.compliance * weight);
            (length > 0.0).then_some(limit)
        };
        self.constraints
            .iter()
            .map(|c| limit(c).unwrap_or(f64::INFINITY))
            .collect()
    }

    /// Likely mistakes in the scene, valid all the same, a line each: bodies that nothing holds, lengths in another unit,
    /// gravity forgotten, ropes askew, slack or too short, shapes inside each other or that meet nothing.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.gravity.norm() > 0.0 {
            // With colliders, a falling body may land.
            if self.colliders.is_empty() {
                notes.extend(self.unheld());
            }
        } else if self.load.is_some() && self.external_force() == 0.0 {
            let note = "gravity is zero and no other force acts: the load has no weight";
            notes.push(note.to_owned());
        }
        notes.extend(self.far_lever());
        notes.extend(self.fleet_angle());
        notes.extend(self.slack());
        notes.extend(self.short());
        notes.extend(self.overlap());
        notes.extend(self.meets_nothing());
        notes
    }

    /// The contact of the shapes that overlap most, or are nearest, for their size, and by which part of the smallest
    /// dimension of either they overlap: < 0 where they are apart. `None` where nothing is near anything.
    #[must_use]
    pub fn deepest_overlap(&self) -> Option<(Contact, f64)> {
        let mut collisions = Collisions::new(self);
        let contacts = collisions.find(self, 0.0).ok()?;
        let part = |c: &Contact| {
            let least = c.colliders.map(|i| self.colliders[i].shape.dimensions()[0]);
            -c.gap / least[0].min(least[1])
        };
        let parts = contacts.iter().map(|c| (*c, part(c)));
        parts.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The deepest overlap of shapes, where it is in doubt.
    fn overlap(&self) -> Option<String> {
        let (deepest, part) = self.deepest_overlap()?;
        let ([a, b], depth) = (
            deepest.colliders.map(|i| &self.colliders[i].name),
            -deepest.gap,
        );
        (part > INSIDE).then(|| {
            format!(
                "the shapes `{a}` and `{b}` overlap by {depth:.3e} m at the start, which throws them apart: move one, or \
                 leave the pair out by groups"
            )
        })
    }

    /// Dynamic bodies and cables with shapes that meet nothing.
    fn meets_nothing(&self) -> Option<String> {
        let alone = Collisions::new(self).alone(self);
        let (first, others) = alone.split_first()?;
        let meets = match others.len() {
            0 => " meets nothing".to_owned(),
            more => and_more(more) + " meet nothing",
        };
        let name = &self.colliders[*first].name;
        Some(format!(
            "shape `{name}`{meets}: no other shape is in groups that let both meet, but for those that joints hold; \
             add [[ground]] or a [[collider]], or change `groups` or `meets`"
        ))
    }

    /// The steepest fleet angle, where that is in doubt.
    fn fleet_angle(&self) -> Option<String> {
        let cables = self.massless_cables();
        let steepest = cables.filter_map(|(c, cable)| {
            let (side, angle) = cable.fleet_angle(&self.bodies, 0.0)?;
            Some((c, side, angle))
        });
        let (c, side, angle) = steepest.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let (cable, angle, point) = (&self.constraint_names[c], angle.to_degrees(), side + 1);
        (angle > STEEP).then(|| {
            format!(
                "`{cable}` has a fleet angle of {angle:.1}° at the sheave that is its point {point}, and ropes leave their \
                 grooves beyond {STEEP}°: turn the axis of the sheave, or move it"
            )
        })
    }

    /// The first cable over sheaves that is longer than its path, all parts of it together.
    fn slack(&self) -> Option<String> {
        let over = self
            .massless_cables()
            .filter(|(_, cable)| !cable.sheaves.is_empty() && cable.tension_only);
        let mut rope = over.filter_map(|(first, _)| self.rest_path(first));
        let rope = rope.find(|rope| rope.length - rope.path > LOOSE * rope.length)?;
        let (cable, path) = (&self.constraint_names[rope.first], rope.path);
        let slack = rope.length - path;
        Some(format!(
            "`{cable}` starts slack: it is {slack:.3e} m longer than its path over the sheaves, which is {path:.6} m long"
        ))
    }

    /// The massless cable that is strained most at the start and pulls by more than the scene's weight.
    fn short(&self) -> Option<String> {
        if self.start_in_equilibrium {
            // The start moves to the equilibrium: the present strain says nothing.
            return None;
        }
        let firsts = self.massless_cables().map(|(first, _)| first);
        let rope = firsts.filter_map(|first| self.pulls(first));
        let rope = rope.max_by(|a, b| a.strain().total_cmp(&b.strain()))?;
        let (cable, path) = (&self.constraint_names[rope.first], rope.path);
        let (short, strain) = (path - rope.length, 100.0 * rope.strain());
        let pull = match rope.tension() {
            f64::INFINITY => " of what cannot stretch".to_owned(),
            tension => format!(" that pulls with {tension:.3e} N, more than the scene weighs"),
        };
        Some(format!(
            "`{cable}` starts taut: it is {short:.3e} m shorter than its path, which is {path:.6} m long, a strain of \
             {strain:.2} %{pull}: leave its length out for that of the path, or give its slack or a smaller tension"
        ))
    }

    /// Refuses a massless cable, by its first part, that is strained by more than 5 % at the start and pulls by more than the
    /// scene's weight.
    ///
    /// # Errors
    /// [`SceneError::Conflict`] with the cable, its length and its path.
    pub fn check_short(&self, first: usize) -> Result<(), SceneError> {
        let Some(rope) = self.pulls(first).filter(|rope| rope.strain() > STRAINED) else {
            return Ok(());
        };
        let (cable, strain) = (&self.constraint_names[first], 100.0 * rope.strain());
        let RestPath { length, path, .. } = rope;
        let reason = "leave `length` out for the length of the path, give `slack` (m) or a smaller `tension` (N), or \
                      `strained = true` where it is meant so";
        refuse(
            format!(
                "massless cable `{cable}`: length is {length} m, but its path is {path:.6} m long, a strain of {strain:.3} % at \
                 the start"
            ),
            reason,
        )
    }

    /// A massless cable that is shorter than its path and pulls by more than the scene's weight, but for rounding.
    fn pulls(&self, first: usize) -> Option<RestPath> {
        let weight = self.mass() * self.gravity.norm() + self.external_force();
        let rope = self.rest_path(first)?;
        let short = rope.path - rope.length > LOOSE * rope.length;
        (short && rope.tension() > weight * (1.0 + 1e-6)).then_some(rope)
    }

    /// Path and rest length at the start of the massless cable with this first part; `None` if it
    /// is not a massless cable, or not a first part.
    fn rest_path(&self, first: usize) -> Option<RestPath> {
        if self.parts_of(first).next() != Some(first) {
            return None;
        }
        let mut rope = RestPath {
            first,
            ..RestPath::default()
        };
        for part in self.parts_of(first) {
            if let Some(cable) = self.constraints.get(part)?.massless_cable() {
                let own = cable.length_at(0.0);
                rope.length += own;
                rope.path += cable.path(&self.bodies, 0.0);
                rope.off += own - cable.wound();
                rope.per_metre = cable.law.compliance / cable.length;
            }
        }
        (rope.length > 0.0).then_some(rope)
    }

    /// The massless cables over sheaves, and the lengths of their paths, with what lies on sheaves and drums \[m].
    #[must_use]
    pub fn paths(&self) -> Vec<(String, f64)> {
        let over = self.massless_cables();
        let over = over.filter(|(_, cable)| cable.sheaves.iter().any(Option::is_some));
        let rope = over.filter_map(|(first, _)| self.rest_path(first));
        rope.map(|rope| (self.constraint_names[rope.first].clone(), rope.path))
            .collect()
    }

    /// The massless cables with their numbers.
    pub(crate) fn massless_cables(&self) -> impl Iterator<Item = (usize, &MasslessCable)> {
        let constraints = self.constraints.iter().enumerate();
        constraints.filter_map(|(c, constraint)| Some((c, constraint.massless_cable()?)))
    }

    /// The note on the largest strain of a run, where it is one: `gaps` are the largest of each constraint in it \[m]. A
    /// constraint without length has no strain.
    #[must_use]
    pub fn strain_note(&self, gaps: &[f64]) -> Option<String> {
        let strains = self.constraints.iter().zip(gaps).enumerate();
        let strains = strains.map(|(c, (constraint, gap))| (c, gap / constraint.length()));
        let (c, strain) = strains
            .filter(|(_, strain)| strain.is_finite())
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let (constraint, percent) = (&self.constraint_names[c], 100.0 * strain);
        (strain > STRAINED).then(|| {
            format!("`{constraint}` was strained by {percent:.1} %: is its stiffness in newtons?")
        })
    }

    /// Dynamic bodies in components of the graph that nothing fixed holds.
    fn unheld(&self) -> Option<String> {
        let topology = crate::topology::Topology::of(self);
        let mut held = vec![false; topology.components];
        for (constraint, component) in self
            .constraints
            .iter()
            .zip(&topology.component_of_constraint)
        {
            let fixed = |f: &Frame| f.body_index().is_none_or(|b| !self.bodies.is_dynamic(b));
            if let Some(component) = component {
                held[*component] |= constraint.frames().iter().any(fixed);
            }
        }
        let components = topology.component_of_body.iter().enumerate();
        let mut loose = components.filter_map(|(b, c)| (!held[(*c)?]).then_some(b));
        let body = &self.body_names[loose.next()?];
        let others = and_more(loose.count());
        Some(format!(
            "nothing holds body `{body}`{others}: no constraints lead to the world or to a static or driven body"
        ))
    }

    /// The lever arm that is longest beside its dynamic body, where that is in doubt.
    fn far_lever(&self) -> Option<String> {
        let levers = self
            .constraints
            .iter()
            .enumerate()
            .flat_map(|(c, constraint)| {
                let on_bodies = constraint.frames().iter();
                on_bodies.filter_map(move |f| Some((c, f.body_index()?, f.point.norm())))
            });
        let dynamic = levers.filter(|(_, b, _)| self.bodies.is_dynamic(*b));
        let far = dynamic.map(|(c, b, lever)| (c, b, lever, self.size(b)));
        let (c, b, lever, size) = far.max_by(|x, y| (x.2 / x.3).total_cmp(&(y.2 / y.3)))?;
        let (constraint, body) = (&self.constraint_names[c], &self.body_names[b]);
        (lever > FAR * size).then(|| {
            format!(
                "`{constraint}` holds body `{body}` at {lever:.3e} m from its centre, whose radius of gyration is \
                 {size:.3e} m: are all lengths in metres?"
            )
        })
    }

    /// Radius of gyration of a body, √(tr I/2m) \[m].
    fn size(&self, body: usize) -> f64 {
        let bodies = &self.bodies;
        (0.5 * bodies.inertia[body].trace() / bodies.mass[body]).sqrt()
    }

    /// Sum of the sizes of all external forces, and of torques over their bodies' radii of gyration \[N].
    fn external_force(&self) -> f64 {
        let bodies = &self.bodies;
        self.dynamic_bodies()
            .map(|i| match bodies.torque[i].norm() {
                0.0 => bodies.force[i].norm(),
                torque => bodies.force[i].norm() + torque / self.size(i),
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    #[test]
    fn no_named_scene_is_in_doubt() {
        for name in named::NAMES {
            let scene = named(name).expect("builds");
            assert_eq!((scene.name.as_str(), scene.validate()), (name, Ok(())));
            assert_eq!(scene.notes(), [""; 0], "{name}");
        }
    }

    #[test]
    fn mistakes_are_noted() {
        let hoist = || HoistParams::default().build().expect("builds");
        let mut loose = hoist();
        loose.constraints.remove(24);
        loose.constraint_names.remove(24);
        loose.groups.remove(24);
        let text = loose.notes().remove(0);
        assert!(text.starts_with("nothing holds body `load`:"), "{text}");
        // The anchor is what holds all of them.
        loose.constraints.remove(0);
        let text = loose.notes().remove(0);
        assert!(text.contains("`segment-1` and 24 more"), "{text}");

        let mut far = hoist();
        far.constraints[3].frames_mut()[1].point *= 1000.0;
        let text = far.notes().remove(0);
        let says = text.starts_with("`joint-3` holds body `segment-4` at 2.083e2 m");
        assert!(says, "{text}");

        let mut light = hoist();
        light.gravity = Vector3::zeros();
        assert!(light.notes()[0].starts_with("gravity is zero"));
        light.bodies.force[24].x = 1.0;
        assert_eq!(light.notes(), [""; 0]);
    }

    #[test]
    fn cables_askew_or_slack_over_their_sheaves_are_noted() {
        let params = ReevedParams::new(Reeved::Capstan);
        let mut askew = params.build().expect("builds");
        let mut slack = params.build().expect("builds");
        let load = askew.body("load").expect("a load");
        // 10 m below the sheave.
        askew.bodies.position[load].y += 1.0;
        let text = askew.notes().remove(0);
        let says = text
            .starts_with("`rope-2` has a fleet angle of 5.7° at the sheave that is its point 1");
        assert!(says, "{text}");
        askew.bodies.position[load].y -= 0.4;
        assert!(!askew.notes().concat().contains("fleet angle"));

        // Both parts of the rope lose a little; what one gains the other may have.
        slack.bodies.position[load].z += 0.25;
        let text = slack.notes().remove(0);
        assert!(text.starts_with("`rope` starts slack: it is 2.5"), "{text}");
    }

    #[test]
    fn shapes_that_begin_inside_each_other_are_noted() {
        use crate::collide::{Collider, Shape};
        let mut scene = Scene::new("heap");
        for (name, z) in [("low", 0.95), ("high", 2.7)] {
            let body = scene.add_body(name, Body::sphere(1.0, 1.0).at(Vector3::z() * z));
            let ball = Shape::Sphere { radius: 1.0 };
            scene.add_collider(Collider::new(name, Some(body), ball));
        }
        scene.add_collider(Collider::new("ground", None, Shape::HalfSpace));
        let text = scene.notes().remove(0);
        let words = "the shapes `low` and `high` overlap by 2.500e-1 m at the start";
        assert!(text.starts_with(words), "{text}");
        // A little is what a resting contact has.
        scene.bodies.position[1].z = 2.9;
        assert_eq!(scene.notes(), [""; 0]);
    }

    #[test]
    fn shapes_that_meet_nothing_are_noted() {
        use crate::collide::{Collider, Shape, Surface};
        use crate::{Cable, CableEnd, Material};
        let ball = Shape::Sphere { radius: 1.0 };
        let mut scene = Scene::new("yard");
        let load = scene.add_body("crate", Body::sphere(1.0, 1.0).at(Vector3::z() * 9.0));
        scene.add_collider(Collider::new("crate", Some(load), ball));
        let text = scene.notes().remove(0);
        let words = "shape `crate` meets nothing: no other shape is in groups that let both meet";
        assert!(text.starts_with(words), "{text}");

        // A cable on a drum: the segment that the drum's joint holds meets nothing itself.
        let drum = scene.add_body("drum", Body::fixed());
        let ends = [
            Frame::body(drum, Vector3::x()),
            Frame::world(Vector3::x() * 9.0),
        ];
        let mut rope = Cable::round("rope", &Material::STEEL, 0.01, ends.map(CableEnd::Pinned));
        rope.collide = Some(Surface::default());
        scene.add_cable(&rope).expect("laid");
        let lone = |scene: &Scene| scene.notes().pop();
        assert_eq!(lone(&scene), None, "crate and rope meet");
        scene.colliders[0].meets = 0b10;
        let text = lone(&scene).expect("a note");
        let says = text.starts_with("shape `crate` and 1 more meet nothing: ");
        assert!(says, "{text}");
        scene.add_collider(Collider::new("drum", Some(drum), ball));
        scene.colliders[0].groups = 0b10;
        let text = lone(&scene).expect("a note");
        assert!(text.starts_with("shape `crate` meets nothing: "), "{text}");
        scene.colliders[0].meets = u32::MAX;
        assert_eq!(lone(&scene), None);
    }

    #[test]
    fn strains_beyond_five_per_cent_are_noted() {
        let scene = HoistParams::default().build().expect("builds");
        let mut gaps = vec![0.02; 25];
        let note = scene.strain_note(&gaps).expect("strained");
        assert!(note.starts_with("`load` was strained by 9.6 %"), "{note}");
        gaps[0] = 0.0;
        gaps[24] = 0.0;
        assert_eq!(scene.strain_note(&gaps), None);
    }

    #[test]
    fn limits_are_of_lengths_and_weights() {
        let chain = ParticleChainParams::default().build().expect("builds");
        for (limit, constraint) in chain.gap_limits().iter().zip(&chain.constraints) {
            let Constraint::Distance(Distance { length, .. }) = constraint else {
                assert_eq!(*limit, f64::INFINITY);
                continue;
            };
            assert!((limit / (2.0 * length) - 1.0).abs() < 1e-3, "{limit}");
        }
        // A joint at the centre of a body: its size, and what its weight stretches it by.
        let mut scene = Scene::new("held");
        scene.gravity = Vector3::z() * -10.0;
        let body = scene.add_body("ball", Body::sphere(0.5, 2.0));
        let frames = [origin(), centre(body)];
        let stretch = RowLaw::new(0.05, 0.0);
        scene.add_constraint(
            "joint",
            Constraint::Spherical(Spherical { frames, stretch }),
            0,
        );
        let limit = scene.gap_limits()[0];
        let off = (limit - 2.0 * (0.5 * 0.6_f64.sqrt() + 1.0)).abs();
        assert!(off < 1e-12, "{limit}");
    }
}
