//! Six numbers of each body: a velocity, an impulse, a symmetric 3×3 matrix.
//!
//! They are stored number by number, so that neighbouring bodies' numbers make a vector as they stand. After the last
//! body comes the world, and what fills up the last vector.

use crate::lanes::side;
use nalgebra::Vector3;
use std::array::from_fn;
use taut_lanes::vector::gather;
use taut_lanes::{Halves, Isa, Kernel, Lanes, Level, dispatch};
use taut_model::{ABREAST, Places};

/// Six numbers a body.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Six {
    values: Vec<f64>,
    /// Bodies that there is room for.
    room: usize,
}

/// Four bodies.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Group {
    bodies: [usize; ABREAST],
    /// The first of them where they are one after the other.
    first: Option<usize>,
}

impl Group {
    #[inline(always)]
    pub(crate) fn new(bodies: [usize; ABREAST], neighbours: bool) -> Self {
        Self {
            bodies,
            first: neighbours.then_some(bodies[0]),
        }
    }

    /// One number of each of the four.
    #[inline(always)]
    pub(crate) fn load<V: Lanes>(&self, from: &[f64]) -> V {
        match self.first {
            Some(first) => V::load(&from[first..first + ABREAST]),
            None => V::from_fn(|l| from[self.bodies[l]]),
        }
    }

    /// The bodies from a multiple of four on.
    #[inline(always)]
    pub(crate) fn starting_at(first: usize) -> Self {
        Self::new(from_fn(|l| first + l), true)
    }
}

impl Six {
    /// Zeros for `bodies` bodies and the world.
    pub(crate) fn new(bodies: usize) -> Self {
        let room = Self::room_for(bodies);
        Self {
            values: vec![0.0; 6 * room],
            room,
        }
    }

    /// Room for `bodies` bodies and the world, in whole vectors.
    pub(crate) fn room_for(bodies: usize) -> usize {
        (bodies + 1).next_multiple_of(ABREAST)
    }

    /// Bodies that there is room for, a multiple of four.
    pub(crate) fn room(&self) -> usize {
        self.room
    }

    /// The numbers of body `i`.
    #[inline]
    pub(crate) fn get(&self, i: usize) -> [f64; 6] {
        from_fn(|k| self.values[k * self.room + i])
    }

    #[inline]
    pub(crate) fn set(&mut self, i: usize, x: [f64; 6]) {
        for (k, x) in x.into_iter().enumerate() {
            self.values[k * self.room + i] = x;
        }
    }

    #[inline]
    pub(crate) fn add(&mut self, i: usize, x: [f64; 6]) {
        for (k, x) in x.into_iter().enumerate() {
            self.values[k * self.room + i] += x;
        }
    }

    /// The first and the last three numbers of all bodies.
    pub(crate) fn load(&mut self, first: &[Vector3<f64>], last: &[Vector3<f64>]) {
        dispatch(Level::best(), Load(self, first, last));
    }

    pub(crate) fn clear(&mut self) {
        self.values.fill(0.0);
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.values.copy_from_slice(&other.values);
    }

    /// x a + y b.
    pub(crate) fn combine(&mut self, (x, a): (f64, &Self), (y, b): (f64, &Self)) {
        let combine = Combine {
            to: &mut self.values,
            of: [(x, &a.values), (y, &b.values)],
        };
        dispatch(Level::best(), combine);
    }

    /// The numbers to be read by vectors.
    #[inline(always)]
    pub(crate) fn view(&self) -> View<'_> {
        let (a, rest) = self.values.split_at(self.room);
        let (b, rest) = rest.split_at(self.room);
        let (c, rest) = rest.split_at(self.room);
        let (d, rest) = rest.split_at(self.room);
        let (e, rest) = rest.split_at(self.room);
        View([a, b, c, d, e, &rest[..self.room]])
    }

    /// The numbers to be written by vectors.
    #[inline(always)]
    pub(crate) fn view_mut(&mut self) -> ViewMut<'_> {
        let (a, rest) = self.values.split_at_mut(self.room);
        let (b, rest) = rest.split_at_mut(self.room);
        let (c, rest) = rest.split_at_mut(self.room);
        let (d, rest) = rest.split_at_mut(self.room);
        let (e, rest) = rest.split_at_mut(self.room);
        ViewMut([a, b, c, d, e, &mut rest[..self.room]])
    }
}

/// See [`Six::combine`].
struct Combine<'a> {
    to: &'a mut [f64],
    of: [(f64, &'a [f64]); 2],
}

impl Kernel for Combine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let [(x, a), (y, b)] = self.of;
        for (sum, (a, b)) in self.to.iter_mut().zip(a.iter().zip(b)) {
            *sum = x * a + y * b;
        }
    }
}

struct Load<'a>(&'a mut Six, &'a [Vector3<f64>], &'a [Vector3<f64>]);

impl Kernel for Load<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self(six, first, last) = self;
        let ((firsts, _), (lasts, _)) = (first.as_chunks(), last.as_chunks());
        let together = firsts.len() * ABREAST;
        let mut to = six.view_mut();
        for (k, (first, last)) in firsts.iter().zip(lasts).enumerate() {
            let first: &[Vector3<f64>; ABREAST] = first;
            let last: &[Vector3<f64>; ABREAST] = last;
            let [a, b, c] = gather::<I::X4, ABREAST, 3>(first.each_ref().map(AsRef::as_ref));
            let [d, e, f] = gather::<I::X4, ABREAST, 3>(last.each_ref().map(AsRef::as_ref));
            to.store(&Group::starting_at(ABREAST * k), &[a, b, c, d, e, f]);
        }
        for (i, (a, b)) in first.iter().zip(last).enumerate().skip(together) {
            six.set(i, [a.x, a.y, a.z, b.x, b.y, b.z]);
        }
    }
}

/// The numbers one by one, all of the same length: made before a loop, so that its bounds are checked once a vector of
/// bodies.
pub(crate) struct View<'a>([&'a [f64]; 6]);

/// The same, to be written.
pub(crate) struct ViewMut<'a>([&'a mut [f64]; 6]);

impl View<'_> {
    /// The numbers of four bodies.
    #[inline(always)]
    pub(crate) fn load<V: Lanes>(&self, of: &Group) -> [V; 6] {
        let mut to = [V::splat(0.0); 6];
        for (to, from) in to.iter_mut().zip(&self.0) {
            *to = of.load(from);
        }
        to
    }
}

impl ViewMut<'_> {
    /// The numbers of four bodies.
    #[inline(always)]
    pub(crate) fn load<V: Lanes>(&self, of: &Group) -> [V; 6] {
        View(self.0.each_ref().map(|numbers| &**numbers)).load(of)
    }

    #[inline(always)]
    pub(crate) fn store<V: Lanes>(&mut self, of: &Group, from: &[V; 6]) {
        if let Some(first) = of.first {
            for (to, from) in self.0.iter_mut().zip(from) {
                from.store(&mut to[first..first + ABREAST]);
            }
        } else {
            for (to, from) in self.0.iter_mut().zip(from) {
                let mut lanes = [0.0; ABREAST];
                from.store(&mut lanes);
                for (i, x) in of.bodies.into_iter().zip(lanes) {
                    to[i] = x;
                }
            }
        }
    }

    /// Adds to the numbers of the bodies of the sides a and b of four joints.
    #[inline(always)]
    pub(crate) fn add_sides<V>(&mut self, places: &Places, [on_a, on_b]: [&[V; 6]; 2])
    where
        V: Halves<Half: Halves>,
    {
        if !places.along {
            self.add(&side(places, 0), on_a, places.count);
            self.add(&side(places, 1), on_b, places.count);
            return;
        }
        // A vector is stored once: one that is loaded again, shifted by a body, would wait for the store.
        let (first, before) = (places.bodies[1][0], places.bodies[0][0]);
        let sums = on_a.iter().zip(on_b);
        for (to, (on_a, on_b)) in self.0.iter_mut().zip(sums) {
            let both = *on_b + on_a.shift_in(V::splat(0.0));
            add_to(both, &mut to[first..first + ABREAST]);
            add_to(on_a.lower().lower(), &mut to[before..=before]);
        }
    }

    /// Adds to the numbers of the first `count` of four bodies, one after the other where they are the same.
    #[inline(always)]
    fn add<V: Lanes>(&mut self, of: &Group, added: &[V; 6], count: usize) {
        if let Some(first) = of.first
            && count == ABREAST
        {
            for (to, added) in self.0.iter_mut().zip(added) {
                add_to(*added, &mut to[first..first + ABREAST]);
            }
        } else {
            for (to, added) in self.0.iter_mut().zip(added) {
                let mut lanes = [0.0; ABREAST];
                added.store(&mut lanes);
                for (i, x) in of.bodies.into_iter().zip(lanes).take(count) {
                    to[i] += x;
                }
            }
        }
    }
}

/// Adds a vector to as many numbers.
#[inline(always)]
fn add_to<V: Lanes>(added: V, to: &mut [f64]) {
    (V::load(to) + added).store(to);
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_model::{Body, Constraint, Frame, HoistParams, Linearized, RowLaw, Scene, Spherical};

    struct Access;

    impl Kernel for Access {
        type Output = ();

        #[inline(always)]
        fn run<I: Isa>(self) {
            let mut six = Six::new(6);
            for i in 0..7 {
                six.set(i, from_fn(|k| (10 * i + k) as f64));
            }
            for (bodies, neighbours) in [([1, 2, 3, 4], true), ([5, 0, 6, 5], false)] {
                let group = Group::new(bodies, neighbours);
                let lanes = six.view().load::<I::X4>(&group);
                for (k, x) in lanes.iter().enumerate() {
                    let mut found = [0.0; 4];
                    x.store(&mut found);
                    assert_eq!(found, bodies.map(|i| (10 * i + k) as f64));
                }
                let mut other = Six::new(6);
                other.view_mut().store(&group, &lanes);
                let other = other.view_mut().load::<I::X4>(&group);
                for (a, b) in lanes.into_iter().zip(other) {
                    assert_eq!((a - b).abs().max_lane(), 0.0);
                }
                let mut sum = Six::new(6);
                sum.view_mut().add(&group, &lanes, 3);
                sum.view_mut().add(&group, &lanes, 4);
                let expected = |i: usize| {
                    let times = |(lane, j): (usize, &usize)| {
                        f64::from(u8::from(*j == i)) * if lane < 3 { 2.0 } else { 1.0 }
                    };
                    bodies.iter().enumerate().map(times).sum::<f64>() * (10 * i + 4) as f64
                };
                for i in 0..7 {
                    assert_eq!(sum.get(i)[4], expected(i), "{bodies:?} {i}");
                }
            }
        }
    }

    /// What acts on both sides of joints, of all packs of a scene.
    struct Sides<'a>(&'a Linearized, usize);

    impl Kernel for Sides<'_> {
        /// How many packs are along a cable.
        type Output = usize;

        #[inline(always)]
        fn run<I: Isa>(self) -> usize {
            let zero = [I::X4::splat(0.0); 6];
            let (mut on_a, mut on_b) = (zero, zero);
            for k in 0..6 {
                on_a[k] = I::X4::from_fn(|l| (1 + 7 * k + l) as f64);
                on_b[k] = I::X4::from_fn(|l| (100 * l + k) as f64);
            }
            let (mut together, mut apart) = (Six::new(self.1), Six::new(self.1));
            let mut along = 0;
            for (_, places) in self.0.abreast.packs() {
                together.view_mut().add_sides(places, [&on_a, &on_b]);
                let mut to = apart.view_mut();
                to.add(&side(places, 0), &on_a, places.count);
                to.add(&side(places, 1), &on_b, places.count);
                along += usize::from(places.along);
            }
            assert_eq!(together, apart);
            along
        }
    }

    #[test]
    fn both_sides_together_are_one_after_the_other() {
        let hoist = |segments| HoistParams {
            segments,
            ..HoistParams::default()
        };
        for (segments, packs) in [(2, 0), (3, 1), (4, 1), (9, 2), (11, 3)] {
            let scene = hoist(segments).build().expect("builds");
            let (rows, bodies) = (Linearized::new(&scene), scene.bodies.len());
            for level in Level::available() {
                let along = dispatch(level, Sides(&rows, bodies));
                assert_eq!(along, packs, "{level}: {segments} segments");
            }
        }
        // A ring of four: the last body comes before the first.
        let mut scene = Scene::new("ring");
        for _ in 0..4 {
            scene.add_body("rod", Body::rod(1.0, 0.1, 1.0));
        }
        for i in 0..4 {
            let frames = [(i + 3) % 4, i].map(|i| Frame::body(i, Vector3::zeros()));
            scene.add_constraint(
                "joint",
                Constraint::Spherical(Spherical {
                    frames,
                    stretch: RowLaw::new(1e-6, 0.0),
                }),
                0,
            );
        }
        for level in Level::available() {
            assert_eq!(
                dispatch(level, Sides(&Linearized::new(&scene), 4)),
                1,
                "{level}"
            );
        }
    }

    #[test]
    fn lanes_and_single_bodies_are_the_same_numbers() {
        for level in Level::available() {
            dispatch(level, Access);
        }
    }
}
