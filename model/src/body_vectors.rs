//! Vectors of six numbers a body: velocities, impulses, symmetric 3×3 matrices.
//!
//! They are stored number by number, so that neighbouring bodies' numbers make a vector as they stand. After the last
//! body comes the world, and padding to whole vectors of lanes.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::array::from_fn;
use taut_lanes::vector::{Quaternion, Vec3, gather};
use taut_lanes::{Halves, Isa, Kernel, Lanes, Level, dispatch};

use crate::body::Bodies;

/// Bodies, or joints, in a vector of lanes.
pub const PACK: usize = 4;

/// Six numbers a body, for all bodies of a scene and the world.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodyVectors {
    values: Vec<f64>,
    /// Bodies that there is room for.
    room: usize,
}

/// Four bodies, by their numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FourBodies {
    indices: [usize; PACK],
    /// The first of them where they are one after the other.
    first: Option<usize>,
}

/// Whether four are one after the other.
pub(crate) fn follow(four: &[usize; PACK]) -> bool {
    four.windows(2).all(|pair| pair[1] == pair[0] + 1)
}

impl FourBodies {
    /// Any four bodies; the number of bodies stands for the world.
    #[inline(always)]
    #[must_use]
    pub fn new(indices: [usize; PACK]) -> Self {
        let first = follow(&indices).then_some(indices[0]);
        Self { indices, first }
    }

    /// Four bodies one after the other.
    #[inline(always)]
    #[must_use]
    pub fn starting_at(first: usize) -> Self {
        Self {
            indices: from_fn(|l| first + l),
            first: Some(first),
        }
    }

    /// The numbers of the four.
    #[inline(always)]
    #[must_use]
    pub fn indices(&self) -> &[usize; PACK] {
        &self.indices
    }

    /// The first of them where they are one after the other.
    #[inline(always)]
    #[must_use]
    pub fn first(&self) -> Option<usize> {
        self.first
    }

    /// Positions and orientations \[x, y, z, w] of the four; the world stands upright at the origin.
    #[inline(always)]
    #[must_use]
    pub fn poses<V: Lanes>(&self, bodies: &Bodies) -> (Vec3<V>, Quaternion<V>) {
        let (position, orientation) = (&bodies.position, &bodies.orientation);
        if let Some(first) = self.first
            && let Some(x) = position.get(first..).and_then(<[_]>::first_chunk::<PACK>)
            && let Some(q) = orientation
                .get(first..)
                .and_then(<[_]>::first_chunk::<PACK>)
        {
            let q = q.each_ref().map(|q| q.coords.as_ref());
            return (gather(x.each_ref().map(AsRef::as_ref)), gather(q));
        }
        let upright = UnitQuaternion::identity();
        let x = self
            .indices
            .map(|i| position.get(i).map_or(&[0.0; 3], AsRef::as_ref));
        let q = self
            .indices
            .map(|i| orientation.get(i).unwrap_or(&upright).coords.as_ref());
        (gather(x), gather(q))
    }

    /// One number of each of the four, out of one number of each body.
    ///
    /// # Panics
    /// When `from` has none of a body.
    #[inline(always)]
    #[must_use]
    pub fn load<V: Lanes>(&self, from: &[f64]) -> V {
        match self.first {
            Some(first) => V::load(&from[first..first + PACK]),
            None => V::from_fn(|l| from[self.indices[l]]),
        }
    }
}

/// The six numbers of a symmetric matrix: xx, yx, zx, yy, zy, zz.
#[must_use]
pub fn packed(a: &Matrix3<f64>) -> [f64; 6] {
    [a.m11, a.m21, a.m31, a.m22, a.m32, a.m33]
}

/// The symmetric matrix of six numbers.
#[must_use]
pub fn unpacked([xx, yx, zx, yy, zy, zz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, yx, zx, yx, yy, zy, zx, zy, zz)
}

impl BodyVectors {
    /// Zeros for `bodies` bodies and the world.
    #[must_use]
    pub fn new(bodies: usize) -> Self {
        let room = Self::room_for(bodies);
        Self {
            values: vec![0.0; 6 * room],
            room,
        }
    }

    /// Room for `bodies` bodies and the world, in whole vectors.
    #[must_use]
    pub fn room_for(bodies: usize) -> usize {
        (bodies + 1).next_multiple_of(PACK)
    }

    /// Bodies that there is room for, a multiple of four.
    #[inline]
    #[must_use]
    pub fn room(&self) -> usize {
        self.room
    }

    /// The numbers of body `i`.
    ///
    /// # Panics
    /// When there is no room for it.
    #[inline]
    #[must_use]
    pub fn get(&self, i: usize) -> [f64; 6] {
        from_fn(|k| self.values[k * self.room + i])
    }

    /// Sets the numbers of body `i`.
    ///
    /// # Panics
    /// When there is no room for it.
    #[inline]
    pub fn set(&mut self, i: usize, x: [f64; 6]) {
        for (k, x) in x.into_iter().enumerate() {
            self.values[k * self.room + i] = x;
        }
    }

    /// Adds to the numbers of body `i`.
    ///
    /// # Panics
    /// When there is no room for it.
    #[inline]
    pub fn add(&mut self, i: usize, x: [f64; 6]) {
        for (k, x) in x.into_iter().enumerate() {
            self.values[k * self.room + i] += x;
        }
    }

    /// Takes the first and the last three numbers of all bodies.
    ///
    /// # Panics
    /// When there is no room for them.
    pub fn load(&mut self, first: &[Vector3<f64>], last: &[Vector3<f64>]) {
        dispatch(Level::best(), Load(self, first, last));
    }

    /// Sets all numbers to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Takes all numbers of another of the same size.
    ///
    /// # Panics
    /// When the sizes differ.
    pub fn copy_from(&mut self, other: &Self) {
        self.values.copy_from_slice(&other.values);
    }

    /// x a + y b, given as pairs of a factor and numbers.
    pub fn combine(&mut self, (x, a): (f64, &Self), (y, b): (f64, &Self)) {
        let combine = Combine {
            to: &mut self.values,
            of: [(x, &a.values), (y, &b.values)],
        };
        dispatch(Level::best(), combine);
    }

    /// The numbers to be read by vectors.
    #[inline(always)]
    #[must_use]
    pub fn view(&self) -> BodyNumbers<'_> {
        let (a, rest) = self.values.split_at(self.room);
        let (b, rest) = rest.split_at(self.room);
        let (c, rest) = rest.split_at(self.room);
        let (d, rest) = rest.split_at(self.room);
        let (e, rest) = rest.split_at(self.room);
        BodyNumbers([a, b, c, d, e, &rest[..self.room]])
    }

    /// The numbers to be written by vectors.
    #[inline(always)]
    pub fn view_mut(&mut self) -> BodyNumbersMut<'_> {
        let (a, rest) = self.values.split_at_mut(self.room);
        let (b, rest) = rest.split_at_mut(self.room);
        let (c, rest) = rest.split_at_mut(self.room);
        let (d, rest) = rest.split_at_mut(self.room);
        let (e, rest) = rest.split_at_mut(self.room);
        BodyNumbersMut([a, b, c, d, e, &mut rest[..self.room]])
    }
}

/// See [`BodyVectors::combine`].
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

struct Load<'a>(&'a mut BodyVectors, &'a [Vector3<f64>], &'a [Vector3<f64>]);

impl Kernel for Load<'_> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self) {
        let Self(vectors, first, last) = self;
        let ((firsts, _), (lasts, _)) = (first.as_chunks(), last.as_chunks());
        let together = firsts.len() * PACK;
        let mut to = vectors.view_mut();
        for (k, (first, last)) in firsts.iter().zip(lasts).enumerate() {
            let first: &[Vector3<f64>; PACK] = first;
            let last: &[Vector3<f64>; PACK] = last;
            let [a, b, c] = gather::<I::X4, PACK, 3>(first.each_ref().map(AsRef::as_ref));
            let [d, e, f] = gather::<I::X4, PACK, 3>(last.each_ref().map(AsRef::as_ref));
            to.store(&FourBodies::starting_at(PACK * k), &[a, b, c, d, e, f]);
        }
        for (i, (a, b)) in first.iter().zip(last).enumerate().skip(together) {
            vectors.set(i, [a.x, a.y, a.z, b.x, b.y, b.z]);
        }
    }
}

/// The numbers one by one, all of the same length: made before a loop, so that its bounds are checked once a vector of
/// bodies.
pub struct BodyNumbers<'a>([&'a [f64]; 6]);

/// The same, to be written.
pub struct BodyNumbersMut<'a>([&'a mut [f64]; 6]);

impl BodyNumbers<'_> {
    /// The numbers of four bodies.
    ///
    /// # Panics
    /// When there is no room for one of them.
    #[inline(always)]
    #[must_use]
    pub fn load<V: Lanes>(&self, of: &FourBodies) -> [V; 6] {
        let mut to = [V::splat(0.0); 6];
        if let Some(first) = of.first {
            for (to, from) in to.iter_mut().zip(&self.0) {
                *to = V::load(&from[first..first + PACK]);
            }
        } else {
            for (to, from) in to.iter_mut().zip(&self.0) {
                *to = V::from_fn(|l| from[of.indices[l]]);
            }
        }
        to
    }
}

impl BodyNumbersMut<'_> {
    /// The numbers of four bodies.
    ///
    /// # Panics
    /// When there is no room for one of them.
    #[inline(always)]
    #[must_use]
    pub fn load<V: Lanes>(&self, of: &FourBodies) -> [V; 6] {
        BodyNumbers(self.0.each_ref().map(|numbers| &**numbers)).load(of)
    }

    /// Writes the numbers of four bodies.
    ///
    /// # Panics
    /// When there is no room for one of them.
    #[inline(always)]
    pub fn store<V: Lanes>(&mut self, of: &FourBodies, from: &[V; 6]) {
        if let Some(first) = of.first {
            for (to, from) in self.0.iter_mut().zip(from) {
                from.store(&mut to[first..first + PACK]);
            }
        } else {
            for (to, from) in self.0.iter_mut().zip(from) {
                let mut lanes = [0.0; PACK];
                from.store(&mut lanes);
                for (i, x) in of.indices.into_iter().zip(lanes) {
                    to[i] = x;
                }
            }
        }
    }

    /// Adds to the numbers of `b`, one after the other, and of `a`, of which all but the first are those of `b` but the last.
    #[inline(always)]
    pub(crate) fn add_along<V>(
        &mut self,
        a: &FourBodies,
        b: &FourBodies,
        [on_a, on_b]: [&[V; 6]; 2],
    ) where
        V: Halves<Half: Halves>,
    {
        // A vector is stored once: one that is loaded again, shifted by a body, would wait for the store.
        let (first, before) = (b.indices[0], a.indices[0]);
        let sums = on_a.iter().zip(on_b);
        for (to, (on_a, on_b)) in self.0.iter_mut().zip(sums) {
            let both = *on_b + on_a.shift_in(V::splat(0.0));
            add_to(both, &mut to[first..first + PACK]);
            add_to(on_a.lower().lower(), &mut to[before..=before]);
        }
    }

    /// Adds to the numbers of the first `count` of four bodies, one after the other where they are the same.
    #[inline(always)]
    pub(crate) fn add<V: Lanes>(&mut self, of: &FourBodies, added: &[V; 6], count: usize) {
        if let Some(first) = of.first
            && count == PACK
        {
            for (to, added) in self.0.iter_mut().zip(added) {
                add_to(*added, &mut to[first..first + PACK]);
            }
        } else {
            for (to, added) in self.0.iter_mut().zip(added) {
                let mut lanes = [0.0; PACK];
                added.store(&mut lanes);
                for (i, x) in of.indices.into_iter().zip(lanes).take(count) {
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
    use crate::{Body, Constraint, Frame, HoistParams, Linearized, RowLaw, Scene, Spherical};

    struct Access;

    impl Kernel for Access {
        type Output = ();

        #[inline(always)]
        fn run<I: Isa>(self) {
            let mut numbers = BodyVectors::new(6);
            for i in 0..7 {
                numbers.set(i, from_fn(|k| (10 * i + k) as f64));
            }
            for bodies in [[1, 2, 3, 4], [5, 0, 6, 5]] {
                let group = FourBodies::new(bodies);
                let lanes = numbers.view().load::<I::X4>(&group);
                for (k, x) in lanes.iter().enumerate() {
                    let mut found = [0.0; 4];
                    x.store(&mut found);
                    assert_eq!(found, bodies.map(|i| (10 * i + k) as f64));
                }
                let mut other = BodyVectors::new(6);
                other.view_mut().store(&group, &lanes);
                let other = other.view_mut().load::<I::X4>(&group);
                for (a, b) in lanes.into_iter().zip(other) {
                    assert_eq!((a - b).abs().max_lane(), 0.0);
                }
                let mut sum = BodyVectors::new(6);
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
            let (mut together, mut apart) = (BodyVectors::new(self.1), BodyVectors::new(self.1));
            let mut along = 0;
            for four in self.0.four_joints() {
                four.add_to_sides([&on_a, &on_b], &mut together.view_mut());
                let mut to = apart.view_mut();
                to.add(four.bodies(0), &on_a, four.count());
                to.add(four.bodies(1), &on_b, four.count());
                along += usize::from(four.are_along_a_cable());
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
