//! Vectors of six numbers a body: velocities, impulses, symmetric 3×3 matrices.
//!
//! They are stored number by number, so that neighbouring bodies' numbers make a vector as they stand. After the last
//! body comes the world, and padding to whole vectors of lanes.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::array::from_fn;
use taut_lanes::vector::{Quaternion, Vec3, gather};
use taut_lanes::{Aligned, Isa, Kernel, Lanes, Level, WideKernel, dispatch, dispatch_wide};

use crate::body::Bodies;
use crate::lanes::{PACK, PerLanes, follow};

/// Six numbers a body, for all bodies of a scene and the world. Methods of bodies that there is no room for panic, also those
/// of its views.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodyVectors {
    values: Aligned,
    /// Bodies that there is room for.
    room: usize,
    /// Bodies and the world.
    count: usize,
}

/// Eight bodies, by their numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BodyPack {
    indices: [usize; PACK],
    /// The first of them where they are one after the other.
    first: PerLanes<Option<usize>>,
}

/// Bodies of `L` lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BodyLanes<'a, const L: usize> {
    indices: &'a [usize; L],
    first: Option<usize>,
}

impl BodyPack {
    /// Any bodies; the number of bodies stands for the world.
    #[inline(always)]
    #[must_use]
    pub fn new(indices: [usize; PACK]) -> Self {
        let first = |of: &[usize]| follow(of).then_some(of[0]);
        Self {
            first: PerLanes::new(&indices, first),
            indices,
        }
    }

    /// The `L` bodies from `lane` on, a multiple of `L`.
    #[inline(always)]
    #[must_use]
    pub fn lanes<const L: usize>(&self, lane: usize) -> BodyLanes<'_, L> {
        BodyLanes {
            indices: crate::lanes::part(&self.indices, lane),
            first: *self.first.get::<L>(lane),
        }
    }

    /// The numbers of all.
    #[must_use]
    pub fn indices(&self) -> &[usize; PACK] {
        &self.indices
    }
}

impl<const L: usize> BodyLanes<'_, L> {
    /// The numbers of the bodies.
    #[inline(always)]
    #[must_use]
    pub fn indices(&self) -> &[usize; L] {
        self.indices
    }

    /// The first of them where they are one after the other.
    #[inline(always)]
    #[must_use]
    pub fn first(&self) -> Option<usize> {
        self.first
    }

    /// Positions and orientations \[x, y, z, w] of the first `count`, the last of them in all other lanes; the world stands
    /// upright at the origin.
    #[inline(always)]
    #[must_use]
    pub fn poses<V: Lanes>(&self, bodies: &Bodies, count: usize) -> (Vec3<V>, Quaternion<V>) {
        let (position, orientation) = (&bodies.position, &bodies.orientation);
        if let Some(first) = self.first
            && count == L
            && let Some(x) = position.get(first..).and_then(<[_]>::first_chunk::<L>)
            && let Some(q) = orientation.get(first..).and_then(<[_]>::first_chunk::<L>)
        {
            let q = q.each_ref().map(|q| q.coords.as_ref());
            return (gather(x.each_ref().map(AsRef::as_ref)), gather(q));
        }
        let upright = UnitQuaternion::identity();
        let indices: [usize; L] = from_fn(|l| self.indices[l.min(count - 1)]);
        let x = indices.map(|i| position.get(i).map_or(&[0.0; 3], AsRef::as_ref));
        let q = indices.map(|i| orientation.get(i).unwrap_or(&upright).coords.as_ref());
        (gather(x), gather(q))
    }

    /// One number of each, out of one number of each body.
    ///
    /// # Panics
    /// When `from` has none of a body.
    #[inline(always)]
    #[must_use]
    pub fn load<V: Lanes>(&self, from: &[f64]) -> V {
        match self.first {
            Some(first) => V::load(&from[first..first + L]),
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
            values: Aligned::new(6 * room),
            room,
            count: bodies + 1,
        }
    }

    /// Room for `bodies` bodies and the world, in whole vectors, and for the padding of a pack that ends with the world.
    #[must_use]
    pub fn room_for(bodies: usize) -> usize {
        (bodies + PACK).next_multiple_of(PACK)
    }

    /// The first body of each vector of `L` lanes that has a body or the world.
    #[inline(always)]
    pub fn each_first<const L: usize>(&self) -> impl Iterator<Item = usize> + use<L> {
        (0..self.count).step_by(L)
    }

    /// The numbers of body `i`.
    #[inline]
    #[must_use]
    pub fn get(&self, i: usize) -> [f64; 6] {
        from_fn(|k| self.values[k * self.room + i])
    }

    /// Sets the numbers of body `i`.
    #[inline]
    pub fn set(&mut self, i: usize, x: [f64; 6]) {
        for (k, x) in x.into_iter().enumerate() {
            self.values[k * self.room + i] = x;
        }
    }

    /// Adds to the numbers of body `i`.
    #[inline]
    pub fn add(&mut self, i: usize, x: [f64; 6]) {
        for (k, x) in x.into_iter().enumerate() {
            self.values[k * self.room + i] += x;
        }
    }

    /// Takes the first and the last three numbers of all bodies.
    pub fn load(&mut self, first: &[Vector3<f64>], last: &[Vector3<f64>]) {
        dispatch_wide(Level::best(), Load(self, first, last));
    }

    /// Sets all numbers to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Takes all numbers of another of the same size.
    ///
    /// # Panics
    /// When the sizes differ.
    #[inline]
    pub fn copy_from(&mut self, other: &Self) {
        self.values.copy_from_slice(&other.values);
    }

    /// x a + y b, given as pairs of a factor and numbers.
    pub fn combine(&mut self, a: (f64, &Self), b: (f64, &Self)) {
        self.combine_from(0, a, b);
    }

    /// x a + y b in the last three numbers of each body; the first three stay.
    pub fn combine_last(&mut self, a: (f64, &Self), b: (f64, &Self)) {
        self.combine_from(3 * self.room, a, b);
    }

    fn combine_from(&mut self, first: usize, (x, a): (f64, &Self), (y, b): (f64, &Self)) {
        let combine = Combine {
            to: &mut self.values[first..],
            of: [(x, &a.values[first..]), (y, &b.values[first..])],
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

impl WideKernel for Load<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes, const L: usize>(self) {
        let Self(vectors, first, last) = self;
        let ((firsts, _), (lasts, _)) = (first.as_chunks(), last.as_chunks());
        let together = firsts.len() * L;
        let mut to = vectors.view_mut();
        for (k, (first, last)) in firsts.iter().zip(lasts).enumerate() {
            let first: &[Vector3<f64>; L] = first;
            let last: &[Vector3<f64>; L] = last;
            let [a, b, c] = gather::<V, L, 3>(first.each_ref().map(AsRef::as_ref));
            let [d, e, f] = gather::<V, L, 3>(last.each_ref().map(AsRef::as_ref));
            to.store_from(L * k, &[a, b, c, d, e, f]);
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
    /// The numbers of as many bodies as there are lanes, one after the other.
    #[inline(always)]
    #[must_use]
    pub fn load_from<V: Lanes>(&self, first: usize) -> [V; 6] {
        let mut to = [V::splat(0.0); 6];
        for (to, from) in to.iter_mut().zip(&self.0) {
            *to = V::load(&from[first..first + V::LANES]);
        }
        to
    }

    /// The numbers of any bodies.
    #[inline(always)]
    #[must_use]
    pub fn load<V: Lanes, const L: usize>(&self, of: &BodyLanes<'_, L>) -> [V; 6] {
        if let Some(first) = of.first {
            return self.load_from(first);
        }
        let mut to = [V::splat(0.0); 6];
        for (to, from) in to.iter_mut().zip(&self.0) {
            *to = V::from_fn(|l| from[of.indices[l]]);
        }
        to
    }
}

impl BodyNumbersMut<'_> {
    /// As [`BodyNumbers::load_from`].
    #[inline(always)]
    #[must_use]
    pub fn load_from<V: Lanes>(&self, first: usize) -> [V; 6] {
        BodyNumbers(self.0.each_ref().map(|numbers| &**numbers)).load_from(first)
    }

    /// Writes the numbers of as many bodies as there are lanes, one after the other.
    #[inline(always)]
    pub fn store_from<V: Lanes>(&mut self, first: usize, from: &[V; 6]) {
        for (to, from) in self.0.iter_mut().zip(from) {
            from.store(&mut to[first..first + V::LANES]);
        }
    }

    /// Writes the numbers of the first `count` of some bodies.
    #[inline(always)]
    pub fn store<V: Lanes, const L: usize>(
        &mut self,
        of: &BodyLanes<'_, L>,
        from: &[V; 6],
        count: usize,
    ) {
        if let Some(first) = of.first
            && count == L
        {
            return self.store_from(first, from);
        }
        for (to, from) in self.0.iter_mut().zip(from) {
            let mut lanes = [0.0; L];
            from.store(&mut lanes);
            for (i, x) in of.indices.iter().zip(lanes).take(count) {
                to[*i] = x;
            }
        }
    }

    /// Adds to the numbers of `b`, one after the other, and of `a`, of which all but the first are those of `b` but the last.
    #[inline(always)]
    pub(crate) fn add_along<V: Lanes, const L: usize>(
        &mut self,
        a: &BodyLanes<'_, L>,
        b: &BodyLanes<'_, L>,
        [on_a, on_b]: [&[V; 6]; 2],
    ) {
        // A vector is stored once: one that is loaded again, shifted by a body, would wait for the store.
        let (first, before) = (b.indices[0], a.indices[0]);
        let sums = on_a.iter().zip(on_b);
        for (to, (on_a, on_b)) in self.0.iter_mut().zip(sums) {
            let both = *on_b + on_a.shift_in(V::splat(0.0));
            add_to(both, &mut to[first..first + L]);
            to[before] += on_a.first_lane();
        }
    }

    /// Adds to the numbers of the first `count` of some bodies, one after the other where they are the same.
    #[inline(always)]
    pub(crate) fn add<V: Lanes, const L: usize>(
        &mut self,
        of: &BodyLanes<'_, L>,
        added: &[V; 6],
        count: usize,
    ) {
        if let Some(first) = of.first
            && count == L
        {
            for (to, added) in self.0.iter_mut().zip(added) {
                add_to(*added, &mut to[first..first + L]);
            }
        } else {
            for (to, added) in self.0.iter_mut().zip(added) {
                let mut lanes = [0.0; L];
                added.store(&mut lanes);
                for (i, x) in of.indices.iter().zip(lanes).take(count) {
                    to[*i] += x;
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
    use crate::testing::With;
    use crate::{Body, Constraint, Frame, HoistParams, Linearized, RowLaw, Scene, Spherical};
    use taut_lanes::vector::save;

    struct Access;

    /// Lanes of two packs: one after the other in the first, in any order in the second.
    #[inline(always)]
    fn access<V: Lanes, const L: usize>() {
        for lane in (0..PACK).step_by(L) {
            let mut numbers = BodyVectors::new(9);
            for i in 0..10 {
                numbers.set(i, from_fn(|k| (10 * i + k) as f64));
            }
            for bodies in [[1, 2, 3, 4, 5, 6, 7, 8], [5, 0, 6, 5, 9, 9, 5, 7]] {
                let pack = BodyPack::new(bodies);
                let group = pack.lanes::<L>(lane);
                let bodies = *group.indices();
                let lanes = numbers.view().load::<V, L>(&group);
                let found: [[f64; L]; 6] = save(&lanes);
                for (k, found) in found.into_iter().enumerate() {
                    assert_eq!(found, bodies.map(|i| (10 * i + k) as f64));
                }
                let mut other = BodyVectors::new(9);
                other.view_mut().store(&group, &lanes, L);
                let other = other.view().load::<V, L>(&group);
                for (a, b) in lanes.into_iter().zip(other) {
                    assert_eq!((a - b).abs().max_lane(), 0.0);
                }
                let mut sum = BodyVectors::new(9);
                sum.view_mut().add(&group, &lanes, L - 1);
                sum.view_mut().add(&group, &lanes, L);
                let expected = |i: usize| {
                    let times = |(lane, j): (usize, &usize)| {
                        f64::from(u8::from(*j == i)) * if lane < L - 1 { 2.0 } else { 1.0 }
                    };
                    bodies.iter().enumerate().map(times).sum::<f64>() * (10 * i + 4) as f64
                };
                for i in 0..10 {
                    assert_eq!(sum.get(i)[4], expected(i), "{bodies:?} {i}");
                }
            }
        }
    }

    impl Kernel for Access {
        type Output = ();

        #[inline(always)]
        fn run<I: Isa>(self) {
            access::<I::X4, 4>();
            access::<I::X8, 8>();
        }
    }

    /// Adds numbers to both sides of all joints of a scene, together and one after the other.
    struct Sides<'a>(&'a Linearized, usize);

    impl Sides<'_> {
        #[inline(always)]
        fn together<V: Lanes, const L: usize>(&self) -> usize {
            let zero = [V::splat(0.0); 6];
            let (mut on_a, mut on_b) = (zero, zero);
            let (mut together, mut apart) = (BodyVectors::new(self.1), BodyVectors::new(self.1));
            let mut along = 0;
            for joints in self.0.joint_lanes::<L>() {
                let real = |l: usize| f64::from(u8::from(l < joints.count()));
                for k in 0..6 {
                    on_a[k] = V::from_fn(|l| real(l) * (1 + 7 * k + l) as f64);
                    on_b[k] = V::from_fn(|l| real(l) * (100 * l + k) as f64);
                }
                joints.add_to_sides([&on_a, &on_b], &mut together.view_mut());
                let mut to = apart.view_mut();
                to.add(&joints.bodies(0), &on_a, joints.count());
                to.add(&joints.bodies(1), &on_b, joints.count());
                along += usize::from(joints.are_along_a_cable());
            }
            assert_eq!(together, apart);
            along
        }
    }

    impl Kernel for Sides<'_> {
        /// How many fours and eights are along a cable.
        type Output = [usize; 2];

        #[inline(always)]
        fn run<I: Isa>(self) -> [usize; 2] {
            [self.together::<I::X4, 4>(), self.together::<I::X8, 8>()]
        }
    }

    #[test]
    fn both_sides_together_are_one_after_the_other() {
        let hoist = |segments| HoistParams::default().with(|p| p.segments = segments);
        for (segments, packs) in [
            (2, [1, 1]),
            (3, [1, 1]),
            (4, [2, 1]),
            (9, [3, 2]),
            (23, [6, 3]),
        ] {
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
            let along = dispatch(level, Sides(&Linearized::new(&scene), 4));
            assert_eq!(along, [1, 1], "{level}");
        }
    }

    #[test]
    fn lanes_and_single_bodies_are_the_same_numbers() {
        for level in Level::available() {
            dispatch(level, Access);
        }
    }
}
