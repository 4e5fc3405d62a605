//! Where things are in a frame.

use crate::layout::{Line, Point, Shape, Solid};
use crate::read::Part;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// A point \[m].
pub(crate) type At = Point3<f64>;

fn three(x: &[f32; 3]) -> Vector3<f64> {
    Vector3::new(x[0], x[1], x[2]).cast()
}

/// The turn with these components, scalar first; the identity if they are too small.
fn turn([w, i, j, k]: [f64; 4]) -> UnitQuaternion<f64> {
    let all = Quaternion::new(w, i, j, k);
    UnitQuaternion::try_new(all, 1e-6).unwrap_or_default()
}

impl Part {
    /// Pose of a body, or of the world.
    pub(crate) fn pose(&self, frame: usize, body: Option<usize>) -> Isometry3<f64> {
        let Some(body) = body else {
            return Isometry3::identity();
        };
        let first = self.layout.bodies[body].pose;
        let at = Translation3::from(self.position(frame, body));
        let components = [3, 4, 5, 6].map(|k| self.value(frame, first + k));
        Isometry3::from_parts(at, turn(components))
    }

    pub(crate) fn point(&self, frame: usize, point: &Point) -> At {
        match point.moved {
            Some(first) => [0, 1, 2].map(|k| self.value(frame, first + k)).into(),
            None => self.pose(frame, point.body) * At::from(three(&point.at)),
        }
    }

    /// The straight spans of a line, each with the number of the point that it begins at. A sheave is touched at its angles, or
    /// passed by.
    pub(crate) fn spans(&self, frame: usize, line: &Line) -> Vec<(usize, [At; 2])> {
        let mut spans = Vec::new();
        let mut last: Option<(usize, At)> = None;
        for (k, point) in line.points.iter().enumerate() {
            let centre = self.point(frame, point);
            let mut both = [centre; 2];
            if let Some(sheave) = &point.sheave {
                let turn = self.pose(frame, point.body).rotation;
                let [v, w] = sheave.axes.map(|axis| turn * three(&axis));
                both = [0, 1].map(|end| {
                    let (sine, cosine) = self.value(frame, sheave.angles + end).sin_cos();
                    centre + (v * cosine + w * sine) * f64::from(sheave.radius)
                });
            }
            let [arriving, leaving] = both;
            if !arriving.iter().chain(leaving.iter()).all(|x| x.is_finite()) {
                continue;
            }
            if let Some((k, from)) = last {
                spans.push((k, [from, arriving]));
            }
            last = Some((k, leaving));
        }
        spans
    }

    /// Length over that of the layout, of a capsule whose length changes.
    pub(crate) fn stretch(&self, frame: usize, solid: &Solid) -> f64 {
        match (solid.length, solid.shape) {
            (Some(channel), Shape::Capsule { length, .. }) if length > 0.0 => {
                self.value(frame, channel) / f64::from(length)
            }
            _ => 1.0,
        }
    }
}

impl Solid {
    /// Its pose in the frame of its body.
    pub(crate) fn pose(&self) -> Isometry3<f64> {
        let at = Translation3::from(three(&self.at));
        Isometry3::from_parts(at, turn(self.turn.map(f64::from)))
    }
}

/// The turn from z to a direction.
pub(crate) fn along(direction: &Vector3<f64>) -> UnitQuaternion<f64> {
    let z = Vector3::z();
    let about = |axis| UnitQuaternion::from_scaled_axis(axis);
    UnitQuaternion::rotation_between(&z, direction)
        .unwrap_or_else(|| about(Vector3::x() * std::f64::consts::PI))
}
