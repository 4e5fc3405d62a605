//! What several kernels share: bodies and axes of four joints, symmetric matrices as six numbers.

use crate::six::Group;
use nalgebra::{Matrix3, UnitQuaternion};
use taut_lanes::Lanes;
use taut_lanes::vector::{Vec3, gather, load, turned};
use taut_model::{ABREAST, Four, Places};

/// The bodies of one side of four joints.
#[inline(always)]
pub(crate) fn side(places: &Places, side: usize) -> Group {
    Group::new(places.bodies[side], places.neighbours[side])
}

/// The six numbers of a symmetric matrix, xx, yx, zx, yy, zy, zz.
pub(crate) fn packed(a: &Matrix3<f64>) -> [f64; 6] {
    [a.m11, a.m21, a.m31, a.m22, a.m32, a.m33]
}

/// The matrix of six numbers.
pub(crate) fn unpacked([xx, yx, zx, yy, zy, zz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, yx, zx, yx, yy, zy, zx, zy, zz)
}

/// An axis of four bodies in the world frame.
#[inline(always)]
pub(crate) fn axis<V: Lanes>(
    orientation: [&UnitQuaternion<f64>; ABREAST],
    axis: &[Four; 3],
) -> Vec3<V> {
    turned(&gather(orientation.map(|q| q.coords.as_ref())), &load(axis))
}
