//! Groups of contacts, each of which makes one dense problem.
//!
//! Contacts that share neither a body nor a tree of joints do not couple: each such island is a problem of its own. One of
//! more than [`MOST`] contacts is split. Its bodies are numbered from the ground up, breadth first over contacts and joints;
//! its contacts take the order of their upper bodies, and every [`OWN`] of them begin a group, which the other contacts of
//! their bodies join up to [`MOST`]: groups overlap, for what one leaves at its rim the next has inside.

use super::ContactPoint;
use crate::system_data::SystemData;
use std::ops::Range;
use taut_model::{Linearized, Scene};

/// Most contacts of a dense problem.
pub(crate) const MOST: usize = 200;

/// Contacts that a group of a split island begins with.
const OWN: usize = 100;

/// Most active contacts of a scene.
pub(crate) const LIMIT: usize = 20_000;

/// Contacts that hang together.
#[derive(Debug, Clone)]
pub(crate) struct Island {
    /// Its contacts, as places in the order of [`Groups::order`].
    pub(crate) contacts: Range<usize>,
    /// Its groups; one where it is not split.
    pub(crate) groups: Range<usize>,
}

impl Island {
    pub(crate) fn is_split(&self) -> bool {
        self.groups.len() > 1
    }
}

/// The active contacts by islands and groups.
#[derive(Default)]
pub(crate) struct Groups {
    /// Slots of the joints at each body, and the part of the scene that hangs together with it by joints.
    pub(super) slots: Vec<Vec<usize>>,
    part: Vec<usize>,
    joined: Vec<usize>,
    /// Contacts in the order of their islands.
    pub(crate) order: Vec<usize>,
    pub(crate) islands: Vec<Island>,
    /// Places in that order, group by group, and each group's range of them.
    members: Vec<usize>,
    groups: Vec<Range<usize>>,
    /// Bodies with the places of their contacts, in order.
    at: Vec<(usize, usize)>,
    /// Numbers of the bodies from the ground on, and those to go on from.
    rank: Vec<usize>,
    queue: Vec<usize>,
}

impl Groups {
    pub(crate) fn new(scene: &Scene, rows: &Linearized) -> Self {
        let bodies = scene.bodies.len();
        let mut slots = vec![Vec::new(); bodies];
        let mut part: Vec<usize> = (0..bodies).collect();
        for (s, slot) in rows.slots.iter().enumerate() {
            slots[slot.body].push(s);
        }
        for c in 0..rows.constraints() {
            let moved = rows.slots[rows.slot_range(c)].iter().map(|s| s.body);
            let mut dynamic = moved.filter(|i| scene.bodies.is_dynamic(*i));
            if let Some(first) = dynamic.next() {
                dynamic.for_each(|other| join(&mut part, first, other));
            }
        }
        flatten(&mut part);
        Self {
            slots,
            part,
            ..Self::default()
        }
    }

    /// Number of groups.
    pub(crate) fn count(&self) -> usize {
        self.groups.len()
    }

    /// Number of groups of split islands.
    pub(crate) fn split(&self) -> usize {
        let split = self.islands.iter().filter(|island| island.is_split());
        split.map(|island| island.groups.len()).sum()
    }

    /// Places of group `k`.
    pub(crate) fn members(&self, k: usize) -> &[usize] {
        &self.members[self.groups[k].clone()]
    }

    /// Contacts of group `k`.
    pub(crate) fn contacts(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        self.members(k).iter().map(|at| self.order[*at])
    }

    /// Sorts the active contacts.
    pub(crate) fn divide(&mut self, system_data: &SystemData, touches: &[ContactPoint]) {
        let Self { joined, part, .. } = self;
        joined.clear();
        joined.extend(0..part.len());
        let parts = |i: usize| movable(system_data, &touches[i]).map(|i| i.map(|i| part[i]));
        let active = (0..touches.len()).filter(|i| touches[*i].active);
        self.order.clear();
        self.order.extend(active);
        for i in &self.order {
            if let [Some(a), Some(b)] = parts(*i) {
                join(joined, a, b);
            }
        }
        flatten(joined);
        let island = |i: usize| parts(i).into_iter().flatten().next().map(|p| joined[p]);
        self.order.sort_unstable_by_key(|i| (island(*i), *i));
        self.islands.clear();
        self.members.clear();
        self.groups.clear();
        let mut first = 0;
        for k in 0..self.order.len() {
            let last = k + 1 == self.order.len();
            if last || island(self.order[k]) != island(self.order[k + 1]) {
                let (contacts, groups) = (first..k + 1, self.islands.len()..0);
                self.islands.push(Island { contacts, groups });
                first = k + 1;
            }
        }
        for k in 0..self.islands.len() {
            let (contacts, first) = (self.islands[k].contacts.clone(), self.groups.len());
            if contacts.len() > MOST {
                self.part_island(contacts, system_data, touches);
            } else {
                self.add_group(contacts);
            }
            self.islands[k].groups = first..self.groups.len();
        }
    }

    fn add_group(&mut self, members: impl IntoIterator<Item = usize>) {
        let first = self.members.len();
        self.members.extend(members);
        self.groups.push(first..self.members.len());
    }

    /// Groups of an island that is too large for one.
    fn part_island(
        &mut self,
        island: Range<usize>,
        system_data: &SystemData,
        touches: &[ContactPoint],
    ) {
        self.list(&island, system_data, touches);
        self.number(system_data, touches);
        let rank = &self.rank;
        let upper = |i: &usize| {
            let ranks = movable(system_data, &touches[*i]).map(|i| i.map(|i| rank[i]));
            ranks.into_iter().max()
        };
        self.order[island.clone()].sort_unstable_by_key(|i| (upper(i), *i));
        self.list(&island, system_data, touches);
        for first in island.clone().step_by(OWN) {
            let start = self.members.len();
            let last = (first + OWN).min(island.end);
            self.members.extend(first..last);
            let mut next = start;
            while next < self.members.len() && self.members.len() - start < MOST {
                let place = self.members[next];
                next += 1;
                for i in movable(system_data, &touches[self.order[place]])
                    .into_iter()
                    .flatten()
                {
                    let from = self.at.partition_point(|(body, _)| *body < i);
                    for (_, other) in self.at[from..].iter().take_while(|(body, _)| *body == i) {
                        let room = self.members.len() - start < MOST;
                        if room && !self.members[start..].contains(other) {
                            self.members.push(*other);
                        }
                    }
                }
            }
            self.groups.push(start..self.members.len());
        }
    }

    /// Lists the places of an island's contacts by bodies.
    fn list(&mut self, island: &Range<usize>, system_data: &SystemData, touches: &[ContactPoint]) {
        self.at.clear();
        for place in island.clone() {
            let bodies = movable(system_data, &touches[self.order[place]]);
            self.at
                .extend(bodies.into_iter().flatten().map(|i| (i, place)));
        }
        self.at.sort_unstable();
    }

    /// Numbers the bodies of the listed contacts from one on the ground on.
    fn number(&mut self, system_data: &SystemData, touches: &[ContactPoint]) {
        let (rows, unknown) = (&system_data.rows, usize::MAX);
        self.rank.clear();
        self.rank.resize(self.part.len(), unknown);
        self.queue.clear();
        let (mut count, mut next) = (0, 0);
        let mut reach = |rank: &mut Vec<usize>, queue: &mut Vec<usize>, body: usize| {
            if rank[body] == unknown && !system_data.inertia.is_immovable(body) {
                rank[body] = count;
                count += 1;
                queue.push(body);
            }
        };
        for seed in self.seeds(system_data, touches) {
            reach(&mut self.rank, &mut self.queue, seed);
            while let Some(&body) = self.queue.get(next) {
                next += 1;
                let from = self.at.partition_point(|(b, _)| *b < body);
                let here = self.at[from..].iter().take_while(|(b, _)| *b == body);
                let touching =
                    here.flat_map(|(_, place)| movable(system_data, &touches[self.order[*place]]));
                let jointed = self.slots[body].iter().flat_map(|s| {
                    let of = rows.slot_range(rows.slots[*s].constraint);
                    rows.slots[of].iter().map(|slot| Some(slot.body))
                });
                for other in touching.chain(jointed).flatten() {
                    reach(&mut self.rank, &mut self.queue, other);
                }
            }
        }
    }

    /// The listed bodies, those that touch the ground first.
    fn seeds(&self, system_data: &SystemData, touches: &[ContactPoint]) -> Vec<usize> {
        let grounded =
            |place: usize| movable(system_data, &touches[self.order[place]]).contains(&None);
        let first = self.at.iter().filter(|(_, place)| grounded(*place));
        let all = first.chain(&self.at);
        all.map(|(body, _)| *body).collect()
    }
}

/// The bodies of a contact that move.
fn movable(system_data: &SystemData, touch: &ContactPoint) -> [Option<usize>; 2] {
    let bodies = touch.found.bodies;
    bodies.map(|i| i.filter(|i| !system_data.inertia.is_immovable(*i)))
}

/// The name of a part, by ever shorter ways.
fn root(part: &mut [usize], mut i: usize) -> usize {
    while part[i] != i {
        part[i] = part[part[i]];
        i = part[i];
    }
    i
}

/// The two become one part, named by its least member.
fn join(part: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(part, a), root(part, b));
    part[a.max(b)] = a.min(b);
}

/// Each has the name of its part.
fn flatten(part: &mut [usize]) {
    for i in 0..part.len() {
        part[i] = part[part[i]];
    }
}
